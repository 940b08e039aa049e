//! Points on triangles.

use super::{Fault, Specimen, Trial, Twin};
use crate::domain::{MeshSurface, Sphere, Square, SurfacePoint, Triangle};
use crate::sampler::{BarycentricWarp, MeshLight, Sample, Sampler, SeenFrom, Sides, TriangleWarp, from_fn};
use glam::{DVec3, Vec2, Vec3};

const FOLDED: TriangleWarp = TriangleWarp::LowDistortion;

fn right(warp: TriangleWarp) -> Specimen {
    Specimen::sampler(BarycentricWarp::new(warp, 1.0).expect("an area"))
}

const FOLD: Twin = Twin::new("low-distortion warp", || right(TriangleWarp::LowDistortion));
const ROOT: Twin = Twin::new("square-root warp", || right(TriangleWarp::SquareRoot));

/// A warp onto a triangle of area 1, with the density of the right one.
fn warp(b: fn(f32, f32) -> (f32, f32)) -> Specimen {
    warp_with(b, 1.0)
}

fn warp_with(b: fn(f32, f32) -> (f32, f32), density: f32) -> Specimen {
    Specimen::sampler(from_fn(
        Triangle::with_area(1.0),
        move |[u, v]: [f32; 2]| {
            let (b0, b1) = b(u, v);
            Vec3::new(b0, b1, 1.0 - b0 - b1)
        },
        move |_: Vec3| density,
    ))
}

/// The square-root warp with an inverse of its own.
struct WithInverse {
    warp: BarycentricWarp,
    inverse: fn(&DVec3) -> [f64; 2],
}

impl Sampler for WithInverse {
    type Domain = Triangle;

    fn domain(&self) -> Triangle {
        self.warp.domain()
    }

    fn dimensions(&self) -> usize {
        self.warp.dimensions()
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
        Sampler::sample(&self.warp, xi)
    }

    fn density(&self, b: &DVec3) -> f64 {
        Sampler::density(&self.warp, b)
    }

    fn invert(&self, b: &DVec3) -> Option<Vec<f64>> {
        Some((self.inverse)(b).to_vec())
    }
}

/// Two triangles of a unit square, scaled by 1 and by 5 after they were modelled with equal areas.
const WORLD_AREAS: [f64; 2] = [0.5, 2.5];
const OBJECT_AREA: f64 = 0.5;

fn on_surface(triangle: usize, u: f32, v: f32) -> SurfacePoint {
    SurfacePoint { triangle, barycentric: FOLDED.barycentric(Vec2::new(u, v)).as_dvec3() }
}

const SCALED: Twin = Twin::new("two triangles by their area in the world", || {
    Specimen::sampler(from_fn(
        MeshSurface::from_areas(WORLD_AREAS.to_vec()),
        |[s, u, v]: [f32; 3]| on_surface(usize::from(s >= 1.0 / 6.0), u, v),
        |_: SurfacePoint| 1.0 / 3.0,
    ))
});

const CORNERS: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];

/// The unit square as two triangles of its corners.
fn quad(triangles: [[usize; 3]; 2]) -> Specimen {
    Specimen::sampler(from_fn(
        Square,
        move |[s, u, v]: [f32; 3]| {
            let [a, b, c] = triangles[usize::from(s >= 0.5)].map(|i| CORNERS[i]);
            let w = FOLDED.barycentric(Vec2::new(u, v));
            w.x * a + w.y * b + w.z * c
        },
        |_: Vec2| 1.0_f32,
    ))
}

const QUAD: Twin = Twin::new("quad of two triangles", || quad([[0, 1, 2], [0, 2, 3]]));

/// A lamp overhead that shines down, and the point that it should light.
const LAMP: [Vec3; 3] = [Vec3::new(-1.0, -1.0, 2.0), Vec3::new(-1.0, 1.0, 2.0), Vec3::new(1.0, -1.0, 2.0)];
const UNDER: Vec3 = Vec3::new(-0.3, 0.2, 0.0);

fn lamp(triangle: [Vec3; 3]) -> SeenFrom {
    SeenFrom::new(MeshLight::new(&[triangle], Sides::Front).expect("a triangle"), UNDER)
}

/// What is seen of the lamp must be sampled.
fn lit(sampler: SeenFrom) -> Specimen {
    let front = lamp(LAMP);
    Trial::<Sphere>::new(sampler).target(move |w: &DVec3| f64::from(u8::from(front.density(w) > 0.0))).into()
}

const WINDING: Twin = Twin::new("lamp that shines down", || lit(lamp(LAMP)));

pub(super) fn faults() -> Vec<Fault> {
    vec![
        Fault::new(
            "triangle/branch-squared",
            "the low-distortion warp branches at xi0 < xi1^2 and leaves the triangle",
            FOLD,
            || warp(|u, v| if u < v * v { (0.5 * u, v - 0.5 * u) } else { (u - 0.5 * v, 0.5 * v) }),
        )
        .seen("a misprint of Heitz's map that is copied; no thread about it was found")
        .caught(&["domain", "support"], &["branch squared"]),
        Fault::new("triangle/no-square-root", "b0 = 1 - xi0: samples bunch at a vertex", ROOT, || {
            warp(|u, v| (1.0 - u, v * u))
        })
        .seen("thi-ng/geom PR 83 (points clump)")
        .caught(
            &["chi-square"],
            &["without the square root at vertex 0", "extra distance from vertex 0 (1 - b0)"],
        ),
        Fault::new(
            "triangle/inverse-without-square",
            "the inverse of the square-root warp takes 1 - b0 for its square",
            ROOT,
            || {
                let warp = BarycentricWarp::new(TriangleWarp::SquareRoot, 1.0).expect("an area");
                Specimen::sampler(WithInverse { warp, inverse: |b| [1.0 - b.x, b.y / (1.0 - b.x)] })
            },
        )
        .seen("tilemapjp/ThinPlateSplineJS #1 is of the kind (a warp and its inverse don't match)")
        .caught(&["round trip"], &["round trip"]),
        Fault::new("triangle/fold-missing", "half of the points lie outside", FOLD, || warp(|u, v| (u, v)))
            .seen("seismology/mc_kernel #8 (points sometimes outside of the element)")
            .caught(&["domain", "support"], &["fold missing"]),
        Fault::new("triangle/fold-one-coordinate", "only one coordinate is folded back", FOLD, || {
            warp(|u, v| if u + v > 1.0 { (1.0 - u, v) } else { (u, v) })
        })
        .seen("bevyengine/bevy PR 12766 (suggested in review: |1 - u - v| folds one weight of three)")
        .caught(&["domain", "support"], &["one coordinate folded"]),
        Fault::new(
            "triangle/area-without-half",
            "the length of the cross product is taken for the area",
            FOLD,
            || {
                warp_with(
                    |u, v| {
                        let b = FOLDED.barycentric(Vec2::new(u, v));
                        (b.x, b.y)
                    },
                    0.5,
                )
            },
        )
        .seen("KratosMultiphysics/Kratos #1158 (the area normal of a triangle lacks its 1/2)")
        .caught(&["chi-square", "normalisation", "jacobian"], &["constant 1 / 2"]),
        Fault::new(
            "triangle/area-in-object-space",
            "areas are those before a scale, which is not the same for all triangles",
            SCALED,
            || {
                Specimen::sampler(from_fn(
                    MeshSurface::from_areas(WORLD_AREAS.to_vec()),
                    |[s, u, v]: [f32; 3]| on_surface(usize::from(s >= 0.5), u, v),
                    |_: SurfacePoint| 0.5 / OBJECT_AREA,
                ))
            },
        )
        .seen("mmp/pbrt-v4 #494, GPUOpen-LibrariesAndSDKs/RadeonProRender-Baikal #186 (the light's power ignores the scale)")
        .caught(&["chi-square", "normalisation"], &["patches chosen alike", "extra patch's measure"]),
        Fault::new(
            "triangle/quad-wrong-vertex",
            "the second triangle of a quad repeats a vertex of the first",
            QUAD,
            || quad([[0, 1, 2], [0, 2, 1]]),
        )
        .seen("PointCloudLibrary/pcl PR 226 (A-B-C-D for A-B-D-C), AryanpurTech/BlueEngine #91 (a cube lacks a triangle)")
        .caught(&["chi-square"], &["hole"]),
        Fault::new(
            "triangle/wrong-side-emits",
            "vertices in the wrong order turn the emitting side away",
            WINDING,
            || {
                let [a, b, c] = LAMP;
                lit(lamp([a, c, b]))
            },
        )
        .seen("RenderToolbox/RenderToolbox3 #18, LuxCoreRender/LuxCore #503 (a mirrored mesh emits on its other side)")
        .caught(&["support"], &["nothing is sampled"]),
    ]
}
