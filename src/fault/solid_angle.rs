//! Lamps seen from a point, per solid angle.

use super::{Fault, Specimen, Trial, Twin};
use crate::domain::Sphere;
use crate::sampler::{MeshLight, Sampler, SeenFrom, Sides, SphericalTriangle, from_fn};
use glam::{DVec3, Vec3};

/// A tilted quad of two unequal triangles, and who sees it.
const QUAD: [Vec3; 4] =
    [Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.5), Vec3::new(1.0, 2.0, 0.5), Vec3::new(0.0, 1.0, 0.0)];
const VIEWER: Vec3 = Vec3::new(0.1, 0.3, 0.9);
/// A surface at the viewer.
const RECEIVER: DVec3 = DVec3::new(0.0, 0.6, -0.8);

fn triangles() -> [[Vec3; 3]; 2] {
    [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i: usize| QUAD[i]))
}

fn light(sides: Sides) -> MeshLight {
    MeshLight::new(&triangles(), sides).expect("triangles")
}

/// What a direction meets.
struct Meeting {
    distance: f64,
    cosine: f64,
    triangle: usize,
    /// The right density.
    density: f64,
}

/// Intersects the quad's triangles one by one, by Cramer's rule.
fn meet(seen: &SeenFrom, w: DVec3) -> Option<Meeting> {
    let density = seen.density(&w);
    triangles().into_iter().enumerate().find_map(|(triangle, vertices)| {
        let [a, b, c] = vertices.map(|v| v.as_dvec3() - VIEWER.as_dvec3());
        let (normal, inside) = ((b - a).cross(c - a).normalize(), |p: DVec3, q: DVec3| p.cross(q).dot(w));
        let sides = [inside(a, b), inside(b, c), inside(c, a)];
        let hit = sides.iter().all(|s| *s <= 0.0) || sides.iter().all(|s| *s >= 0.0);
        let distance = normal.dot(a) / normal.dot(w);
        (hit && distance > 0.0).then(|| Meeting { distance, cosine: normal.dot(w).abs(), triangle, density })
    })
}

/// The quad sampled rightly, with a density that is made of what a direction meets. Its author says what mistakes a density of this kind may have.
fn claiming(mistake: fn(&Meeting, DVec3) -> f64) -> Specimen {
    let seen = SeenFrom::new(light(Sides::Front), VIEWER);
    let claim = move |w: DVec3, factor: fn(&Meeting, DVec3) -> f64| {
        meet(&seen, w).map_or(0.0, |m| mistake(&m, w) * factor(&m, w))
    };
    let claim = std::sync::Arc::new(claim);
    let rivals: [(&str, fn(&Meeting, DVec3) -> f64); 8] = [
        ("divided by the cosine at the light", |m, _| 1.0 / m.cosine),
        ("times the cosine at the light", |m, _| m.cosine),
        ("times the distance", |m, _| m.distance),
        ("times the distance squared", |m, _| m.distance.powi(2)),
        ("divided by the distance squared", |m, _| m.distance.powi(-2)),
        ("the cosine at the light, not at the receiver", |m, w| receiver_cosine(w) / m.cosine),
        ("times the probability of selecting the triangle", |m, _| AREAS[m.triangle]),
        ("no conversion from area to solid angle", |m, _| m.distance.powi(-2) * m.cosine),
    ];
    let sampler = SeenFrom::new(light(Sides::Front), VIEWER);
    let density = std::sync::Arc::clone(&claim);
    let broken = from_fn(
        Sphere,
        move |[s, u, v]: [f64; 3]| sampler.sample(&[s, u, v]).map(|s| s.point),
        move |w: DVec3| density(w, |_, _| 1.0),
    );
    rivals
        .into_iter()
        .fold(Trial::new(broken), |trial, (name, factor)| {
            let claim = std::sync::Arc::clone(&claim);
            trial.rival(name, move |w: &DVec3| claim(*w, factor))
        })
        .into()
}

/// Areas of the two triangles, up to a constant.
const AREAS: [f64; 2] = [2.0, 1.0];

fn receiver_cosine(w: DVec3) -> f64 {
    w.dot(RECEIVER).max(0.05)
}

/// Interpolates the normals of a round lamp over the flat triangles.
fn shading_cosine(m: &Meeting, w: DVec3) -> f64 {
    let point = VIEWER.as_dvec3() + m.distance * w;
    let normal = DVec3::new(point.x - 0.5, 0.5 * (point.y - 0.8), 1.0).normalize();
    (-normal.dot(w)).max(0.05)
}

const LIGHT: Twin = Twin::new("quad light, per solid angle", || {
    Specimen::sampler(SeenFrom::new(light(Sides::Front), VIEWER))
});

/// The quad, and a smaller one behind it that turns its back.
fn with_back(sides: Sides) -> MeshLight {
    let turned = [[0, 2, 1], [0, 3, 2]].map(|t| t.map(|i: usize| 0.8 * QUAD[i] + Vec3::new(1.2, 0.1, -0.2)));
    MeshLight::new(&[triangles(), turned].concat(), sides).expect("triangles")
}

const ONE_SIDED: Twin = Twin::new("one-sided quads, one of them turned away", || {
    Specimen::sampler(SeenFrom::new(with_back(Sides::Front), VIEWER))
});
const TWO_SIDED: Twin =
    Twin::new("two-sided quads", || Specimen::sampler(SeenFrom::new(with_back(Sides::Both), VIEWER)));

/// Triangles as seen from the origin.
const WIDE: [Vec3; 3] = [Vec3::new(1.0, 0.1, 0.2), Vec3::new(-0.6, 0.9, 0.15), Vec3::new(-0.6, -0.9, 0.2)];
const SMALL: [Vec3; 3] = [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.603, 0.0, 0.8), Vec3::new(0.6, 0.003, 0.8)];
const TINY: [Vec3; 3] =
    [Vec3::new(0.62, 0.0, 0.8), Vec3::new(0.6203, 0.0, 0.8), Vec3::new(0.62, 0.0003, 0.8)];

fn spherical(vertices: [Vec3; 3]) -> SphericalTriangle {
    SphericalTriangle::new(Vec3::ZERO, vertices).expect("a solid angle")
}

const WIDE_TRIANGLE: Twin = Twin::new("wide spherical triangle", || Specimen::sampler(spherical(WIDE)));
const SMALL_TRIANGLE: Twin = Twin::new("small spherical triangle", || Specimen::sampler(spherical(SMALL)));
const TINY_TRIANGLE: Twin = Twin::new("tiny spherical triangle", || Specimen::sampler(spherical(TINY)));

/// Sampled rightly, with the density 1 / `solid_angle`.
fn spherical_claiming(vertices: [Vec3; 3], solid_angle: fn([Vec3; 3]) -> f32) -> Specimen {
    let (right, omega) = (spherical(vertices), solid_angle(vertices.map(Vec3::normalize)));
    let inside = right;
    Specimen::sampler(from_fn(
        Sphere,
        move |xi: [f64; 2]| right.sample(xi),
        move |w: DVec3| if inside.density(w) > 0.0 { 1.0 / f64::from(omega) } else { 0.0 },
    ))
}

/// The sum of the angles between the planes of the edges, less pi.
fn girard([a, b, c]: [Vec3; 3]) -> f32 {
    let normals = [a.cross(b), b.cross(c), c.cross(a)].map(Vec3::normalize);
    let angle = |i: usize| (-normals[i].dot(normals[(i + 1) % 3])).acos();
    angle(0) + angle(1) + angle(2) - std::f32::consts::PI
}

/// By the three sides (L'Huilier; Todhunter, article 102).
fn l_huilier([a, b, c]: [Vec3; 3]) -> f32 {
    let sides = [(b, c), (c, a), (a, b)].map(|(p, q)| p.dot(q).acos());
    let half = 0.5 * sides.iter().sum::<f32>();
    let product =
        sides.iter().fold((0.5 * half).tan(), |product, side| product * (0.5 * (half - side)).tan());
    // Rounded below 0 is 0; NaN stays what it is, as `max` would not leave it.
    let product = if product < 0.0 { 0.0 } else { product };
    4.0 * product.sqrt().atan()
}

pub(super) fn faults() -> Vec<Fault> {
    vec![
        Fault::new(
            "solid-angle/cosine-missing",
            "the cosine at the light is left out of the conversion",
            LIGHT,
            || claiming(|m, _| m.density * m.cosine),
        )
        .seen("TzuChieh/Photon-v2 #90, w23/xash3d-fwgs #46 (area lights as points)")
        .caught(&["chi-square", "jacobian"], &["divided by the cosine at the light"]),
        Fault::new(
            "solid-angle/cosine-at-the-receiver",
            "the cosine is that at the wrong end",
            LIGHT,
            || claiming(|m, w| m.density * m.cosine / receiver_cosine(w)),
        )
        .seen("mmp/pbrt-v3 #183 confuses the sides of a disk light")
        .caught(&["chi-square"], &["the cosine at the light, not at the receiver"]),
        Fault::new(
            "solid-angle/shading-normal",
            "the cosine is taken with the interpolated normal",
            LIGHT,
            || claiming(|m, w| m.density * m.cosine / shading_cosine(m, w)),
        )
        .seen("mitsuba-renderer/mitsuba3 #1952 (sample_direction and pdf_direction use different normals)")
        .caught(&["chi-square"], &[])
        .held_back(),
        Fault::new("solid-angle/distance-not-squared", "the distance itself, not its square", LIGHT, || {
            claiming(|m, _| m.density / m.distance)
        })
        .seen("bevyengine/bevy PR 24671 mixes area and solid angle")
        .caught(&["chi-square", "jacobian"], &["times the distance"]),
        Fault::new("solid-angle/distance-squared-twice", "the square of a squared distance", LIGHT, || {
            claiming(|m, _| m.density * m.distance.powi(2))
        })
        .seen("GPUOpen-LibrariesAndSDKs/RadeonProRender-Baikal #82 (area to solid angle converted twice: large scenes are darker)")
        .caught(&["chi-square", "jacobian"], &["divided by the distance squared"]),
        Fault::new(
            "solid-angle/back-side-counted",
            "|cos| lets the dark side of a one-sided light into the density",
            ONE_SIDED,
            || {
                let (right, both) = (
                    SeenFrom::new(with_back(Sides::Front), VIEWER),
                    SeenFrom::new(with_back(Sides::Both), VIEWER),
                );
                Specimen::sampler(from_fn(
                    Sphere,
                    move |xi: [f64; 3]| right.sample(&xi).map(|s| s.point),
                    move |w: DVec3| both.density(&w),
                ))
            },
        )
        .seen("mmp/pbrt-v4 #59 (artefacts on the back of a one-sided mesh light)")
        .caught(&["chi-square", "normalisation"], &["hole"]),
        Fault::new(
            "solid-angle/one-branch-only",
            "the conversion is made in the branch of the front side alone",
            TWO_SIDED,
            || {
                let (right, front) = (
                    SeenFrom::new(with_back(Sides::Both), VIEWER),
                    SeenFrom::new(with_back(Sides::Front), VIEWER),
                );
                let per_area = 1.0 / with_back(Sides::Both).area();
                let sampler = SeenFrom::new(with_back(Sides::Both), VIEWER);
                Specimen::sampler(from_fn(
                    Sphere,
                    move |xi: [f64; 3]| sampler.sample(&xi).map(|s| s.point),
                    move |w: DVec3| {
                        let seen = front.density(&w);
                        if right.density(&w) > 1.000_001 * seen { seen + per_area } else { seen }
                    },
                ))
            },
        )
        .seen("mmp/pbrt-v3 #183 (one side of a disk light is sampled, the other evaluated)")
        .caught(&["chi-square"], &[])
        .held_back(),
        Fault::new(
            "solid-angle/selection-probability-missing",
            "1 / area of the triangle, without the probability of selecting it",
            LIGHT,
            || claiming(|m, _| m.density * 3.0 / AREAS[m.triangle]),
        )
        .seen("BachiLi/redner #56, NVIDIA/VisRTX PR 288")
        .caught(&["chi-square", "normalisation"], &["times the probability of selecting the triangle"]),
        Fault::new(
            "solid-angle/wrong-triangle",
            "the density is that of another triangle, after a sort of the list",
            LIGHT,
            || claiming(|m, _| m.density * AREAS[1 - m.triangle] / AREAS[m.triangle]),
        )
        .seen("IwakuraRein/CIS-565-Final-VR-Raytracer #8 (index of one list, size of another)")
        .caught(&["chi-square"], &[])
        .held_back(),
        Fault::new(
            "solid-angle/atan-for-atan2",
            "the solid angle of a wide triangle by atan",
            WIDE_TRIANGLE,
            || {
                spherical_claiming(WIDE, |[a, b, c]| {
                    2.0 * (a.dot(b.cross(c)) / (1.0 + a.dot(b) + b.dot(c) + c.dot(a))).atan().abs()
                })
            },
        )
        .seen("IlyaKuprov/Spinach PR 312 (about 0 instead of 2 pi)")
        .caught(&["normalisation", "chi-square"], &["constant"]),
        Fault::new(
            "solid-angle/acos-unclamped",
            "a side by acos of a product that is rounded beyond 1",
            TINY_TRIANGLE,
            || spherical_claiming(TINY, l_huilier),
        )
        .seen("YafaRay/Core PR 56 (black dots), Devsh-Graphics-Programming/Nabla PR 1001")
        .caught(&["support", "domain"], &["density not finite"]),
        Fault::new(
            "solid-angle/girard-in-f32",
            "a small solid angle as the sum of three angles less pi, in f32",
            SMALL_TRIANGLE,
            || spherical_claiming(SMALL, girard),
        )
        .seen("MilchRatchet/Luminary #88; mmp/pbrt-v4 falls back to areas below 3e-4 sr")
        .caught(&["normalisation", "chi-square"], &["constant"]),
    ]
}
