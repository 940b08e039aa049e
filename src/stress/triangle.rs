//! Warps of the unit square, and points of mesh lights with vertices that `f32` can hardly hold. Oracles: moments of the uniform triangle
//! (E[b] = 1/3, E[b^2] = 1/6, E[b_i b_j] = 1/12), and areas in closed form from sides that are powers of two times small integers, so exact.

use super::{Component, Kind, Reach, Row, Trial, Unit, corner_pairs, lattice, mean};
use crate::random::to_f32;
use crate::sampler::{Error, MeshLight, Sides, TriangleWarp};
use glam::{DVec3, Vec2, Vec3};

const HERE: Component = Component::Triangle;

pub(super) fn rows() -> Vec<Row> {
    let mut rows = warp_rows("low distortion", |xi| TriangleWarp::LowDistortion.barycentric(xi));
    rows.extend(warp_rows("square root", |xi| TriangleWarp::SquareRoot.barycentric(xi)));
    rows.extend(lights());
    rows.extend(degenerate());
    rows
}

/// The rows of a warp of the unit square to barycentric coordinates.
///
/// ```
/// use glam::{Vec2, Vec3};
/// use warpcheck::stress;
/// // A widely copied text branches at xi1^2.
/// let printed = |xi: Vec2| {
///     let (b0, b1) = if xi.x < xi.y * xi.y { (0.5 * xi.x, xi.y - 0.5 * xi.x) } else { (xi.x - 0.5 * xi.y, 0.5 * xi.y) };
///     Vec3::new(b0, b1, 1.0 - b0 - b1)
/// };
/// let outcomes = stress::run(stress::warp_rows("printed", printed), |_| true);
/// assert!(outcomes.iter().all(|(_, outcome)| !outcome.is_ok()));
/// ```
pub fn warp_rows(name: &str, warp: impl Fn(Vec2) -> Vec3 + Clone + Send + Sync + 'static) -> Vec<Row> {
    let at = |warp: &dyn Fn(Vec2) -> Vec3, xi: [f64; 2]| warp(Vec2::from(xi.map(to_f32)));
    let inside = {
        let warp = warp.clone();
        move |trial: &mut Trial| {
            for xi in corner_pairs().chain(lattice(16_384)) {
                let b = at(&warp, xi);
                trial.must(b.min_element() >= 0.0, || format!("xi = {xi:?} leads outside, to {b}"));
                trial.compare(b.as_dvec3().element_sum(), 1.0, || format!("xi = {xi:?}"));
            }
            trial.reach(Reach::told_apart(lattice(16_384).map(|xi| bits(at(&warp, xi)))));
        }
    };
    let moments = move |trial: &mut Trial| {
        let points: Vec<DVec3> = lattice(1_048_576).map(|xi| at(&warp, xi).as_dvec3()).collect();
        trial.reach(Reach::told_apart(points.iter().take(65_536).map(|b| bits(b.as_vec3()))));
        for i in 0..3 {
            let (j, name) = ((i + 1) % 3, |what: &str| what.to_owned());
            trial.compare(mean(points.iter().map(|b| b[i])), 1.0 / 3.0, || name("E[b]"));
            trial.compare(mean(points.iter().map(|b| b[i] * b[i])), 1.0 / 6.0, || name("E[b^2]"));
            trial.compare(mean(points.iter().map(|b| b[i] * b[j])), 1.0 / 12.0, || name("E[b_i b_j]"));
        }
    };
    let row = |input: &str, should: &str, tolerance, ask: Box<dyn Fn(&mut Trial) + Send + Sync>| {
        HERE.row(Kind::Value, format!("{name}: {input}"), should, tolerance, ask)
    };
    vec![
        row("corners of the square", "b_i >= 0, sum 1", (2.0, Unit::UlpF32), Box::new(inside)),
        row("a million points", "moments 1/3, 1/6, 1/12", (1e-4, Unit::Relative), Box::new(moments)),
    ]
}

const fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// What two points have to differ in to be two.
fn bits(point: Vec3) -> [u32; 3] {
    point.to_array().map(f32::to_bits)
}

/// Lights of one triangle of known area.
fn lights() -> Vec<Row> {
    let row = |input: &str, vertices: [Vec3; 3], area: f64| {
        let ask = move |trial: &mut Trial| {
            if let Some(light) = trial.accepted(MeshLight::new(&[vertices], Sides::Front)) {
                points(trial, &light, vertices, area);
            }
        };
        let should = "1 / area; points on it";
        HERE.row(Kind::Value, input, should, (4.0, Unit::UlpF64), ask)
    };
    let (huge, tiny) = (3e38_f32, 1e-12_f32);
    let side = |x: f32| f64::from(x);
    let sliver_width = 0.0625; // the step of f32 at 1e6
    vec![
        row(
            "vertices at +-3e38",
            [v(-huge, -huge, huge), v(huge, -huge, huge), v(-huge, huge, huge)],
            2.0 * side(huge) * side(huge),
        ),
        row(
            "legs of 1e-12",
            [Vec3::ZERO, v(tiny, 0.0, 0.0), v(0.0, tiny, 0.0)],
            0.5 * side(tiny) * side(tiny),
        ),
        row("legs of 5e9", [Vec3::ZERO, v(0.0, 5e9, 0.0), v(0.0, 0.0, 5e9)], 0.5 * 5e9 * 5e9),
        row(
            "legs of 1e-12 and 5e9",
            [Vec3::ZERO, v(tiny, 0.0, 0.0), v(0.0, 5e9, 0.0)],
            0.5 * side(tiny) * 5e9,
        ),
        row(
            "legs of 1e-45",
            [Vec3::ZERO, v(1e-45, 0.0, 0.0), v(0.0, 1e-45, 0.0)],
            0.5 * side(1e-45) * side(1e-45),
        ),
        row(
            "sliver of aspect 1e8 at 1e6",
            [v(1e6, 1e6, 1e6), v(7.25e6, 1e6, 1e6), v(1e6, 1e6 + sliver_width, 1e6)],
            0.5 * 6.25e6 * side(sliver_width),
        ),
        row(
            "sliver of aspect 8e7 at 1e6, slanted",
            // (a, b, c) x (a, b, c + w) = w (b, -a, 0)
            [v(1e6, 1e6, 1e6), v(4e6, 5e6, 1e6), v(4e6, 5e6, 1e6 + sliver_width)],
            0.5 * 5e6 * side(sliver_width),
        ),
    ]
}

/// Density against area; points against the mean of the vertices by their coordinates, divided by what these sum to. A coordinate may be rounded to
/// `f32`, and may move along the triangle by what the barycentric ones are rounded by, but not off it.
fn points(trial: &mut Trial, light: &MeshLight, vertices: [Vec3; 3], area: f64) {
    let [a, b, c] = vertices.map(|v| v.as_dvec3());
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    for [x, y] in corner_pairs().chain(lattice(16_384)) {
        let s = light.sample_surface([0.5, x, y]);
        trial.compare(s.density, 1.0 / area, || format!("xi = ({x}, {y})"));
        let w = s.barycentric.as_dvec3();
        let exact = (w.x * a + w.y * b + w.z * c) / w.element_sum();
        for axis in 0..3 {
            let (found, truth) = (f64::from(s.point[axis]), exact[axis]);
            let moved = f64::from(f32::EPSILON) * (high[axis] - low[axis]);
            let holds = (found - truth).abs() <= 0.51 * super::ulp_f32(truth) + moved;
            trial.must(holds, || {
                format!("xi = ({x}, {y}) leads to {found:e} along axis {axis}, truth {truth:e}")
            });
        }
    }
    // Where variates share a point, f32 is too coarse there, not the light: its coordinates tell them apart.
    let drawn = || lattice(16_384).map(|[x, y]| light.sample_surface([0.5, x, y]));
    trial.reach(Reach::told_apart(drawn().map(|s| bits(s.barycentric))));
    let Reach { of, missed, .. } = Reach::told_apart(drawn().map(|s| bits(s.point)));
    if missed > 0 {
        trial.note(format!("f32 has {} points for {of} variates", of - missed));
    }
}

/// Triangles without area.
fn degenerate() -> Vec<Row> {
    let none = [
        ("collinear vertices", [Vec3::ZERO, v(0.1, 0.1, 0.1), v(0.3, 0.3, 0.3)]),
        ("two equal vertices", [v(1.0, 2.0, 3.0), v(1.0, 2.0, 3.0), v(5.0, 0.0, 1.0)]),
        ("three equal vertices", [v(1e20, 2.0, 3.0); 3]),
    ];
    let refuse = |(input, vertices): (&str, [Vec3; 3])| {
        let ask = move |trial: &mut Trial| {
            let light = MeshLight::new(&[vertices; 2], Sides::Both);
            trial.refused(light, |e| *e == Error::NoArea { triangles: 2 });
        };
        HERE.row(Kind::Refusal, input, "no area", (0.0, Unit::Absolute), ask)
    };
    let among = move |trial: &mut Trial| {
        let good = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let triangles = [none[0].1, none[1].1, good, none[2].1, good, none[0].1];
        let Some(light) = trial.accepted(MeshLight::new(&triangles, Sides::Front)) else { return };
        let mut seen = [0_u64; 6];
        for i in 0..1001 {
            let xi = (f64::from(i) / 1000.0).min(crate::random::ONE_MINUS_EPSILON_F64);
            seen[light.sample_surface([xi, 0.3, 0.6]).triangle] += 1;
        }
        for (i, &count) in seen.iter().enumerate() {
            let real = i == 2 || i == 4;
            trial.must((count > 0) == real, || format!("triangle {i} was drawn {count} times"));
            trial.compare(light.density_on(i), if real { 1.0 } else { 0.0 }, || format!("triangle {i}"));
        }
        trial.reach(Reach {
            of: 2,
            missed: [2, 4].iter().filter(|&&i| seen[i] == 0).count() as u64,
            missed_by_24_bits: None,
        });
    };
    let bad = |trial: &mut Trial| {
        let triangles = [[Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::ZERO, v(1.0, f32::NAN, 0.0), Vec3::Y]];
        let light = MeshLight::new(&triangles, Sides::Front);
        trial.refused(light, |e| matches!(e, Error::Vertex { triangle: 1, .. }));
    };
    let new =
        |kind, input, should, tolerance, ask: fn(&mut Trial)| HERE.row(kind, input, should, tolerance, ask);
    let mut rows: Vec<Row> = none.into_iter().map(refuse).collect();
    rows.push(HERE.row(
        Kind::Limit,
        "degenerate triangles among others",
        "weight 0, never drawn",
        (1.0, Unit::UlpF64),
        among,
    ));
    rows.push(new(Kind::Refusal, "a vertex that is NaN", "names triangle 1", (0.0, Unit::Absolute), bad));
    rows
}
