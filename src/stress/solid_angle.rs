//! From area to solid angle, near, far, grazing and edge-on. Oracles: |y - x|^2 / (A cos) of directions that are known in closed form, Van Oosterom
//! and Strackee's solid angle, the values that they publish, and those in `data/reference`.

use super::{Component, Kind, Reach, Row, Trial, Unit, corner_pairs, lattice};
use crate::oracle::solid_angle_of_triangle;
use crate::sampler::{MeshLight, Sampler, SeenFrom, Sides, SphericalTriangle, View};
use crate::statistics::CompensatedSum;
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

const HERE: Component = Component::SolidAngle;

/// Values that another program found, each a triangle and its solid angle from the origin.
const REFERENCE: &str = include_str!("../../data/reference/closed_forms.json");

pub(super) fn rows() -> Vec<Row> {
    let mut rows = nothing_seen();
    rows.extend(single_points());
    rows.extend(whole_triangles());
    rows.extend(catalogue());
    rows.extend(by_solid_angle());
    rows
}

const fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// Front towards +Z.
const UNIT: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

fn light(triangle: [Vec3; 3]) -> MeshLight {
    MeshLight::new(&[triangle], Sides::Both).expect("a triangle with an area")
}

/// Where no direction leads to the light: no sample, density 0, and never NaN.
fn nothing_seen() -> Vec<Row> {
    let dark = |input: &str, x: Vec3, triangle: [Vec3; 3], sides: Sides| {
        let ask = move |trial: &mut Trial| {
            let Some(light) = trial.accepted(MeshLight::new(&[triangle], sides)) else { return };
            let directions = SeenFrom::new(&light, x);
            for [a, b] in corner_pairs().chain(lattice(256)) {
                let sample = light.sample_from(x, [0.5, a, b]);
                trial.must(sample.is_none(), || format!("xi = ({a}, {b}) draws {sample:?}"));
                let y = light.sample_surface([0.5, a, b]).point;
                trial.compare(light.density_from(x, y, 0), 0.0, || format!("density of {y}"));
                let w = (y - x).as_dvec3().normalize_or(DVec3::X);
                trial.compare(directions.density(&w), 0.0, || format!("density along {w}"));
            }
        };
        HERE.row(Kind::Limit, input, "no sample, density 0", (0.0, Unit::Absolute), ask)
    };
    vec![
        dark("x in the plane of the light", v(3.0, -2.0, 0.0), UNIT, Sides::Both),
        dark("x in its plane, inside it", v(0.25, 0.25, 0.0), UNIT, Sides::Both),
        dark("x at a vertex", Vec3::X, UNIT, Sides::Both),
        dark("x 1e-30 behind a one-sided light", v(0.25, 0.25, -1e-30), UNIT, Sides::Front),
        HERE.row(Kind::Limit, "x = y", "None: there is no direction", (0.0, Unit::Absolute), |trial| {
            for y in [Vec3::ZERO, v(1e38, -1e-38, 3.0), Vec3::splat(f32::MIN_POSITIVE)] {
                let view = View::new(y, y, Vec3::Z);
                trial.must(view.is_none(), || format!("at {y}: {view:?}"));
            }
        }),
    ]
}

/// Densities of one point each, in closed form.
fn single_points() -> Vec<Row> {
    // x = (0, 0, z) has its foot in the middle of the hypotenuse; y there at r is seen at d = sqrt(z^2 + r^2), cos = z / d.
    let about = |edge: f32| [v(-edge, -edge, 0.0), v(edge, -edge, 0.0), v(-edge, edge, 0.0)];
    let above = |input: &str, z: f32, edge: f32, note: bool| {
        let ask = move |trial: &mut Trial| {
            let triangle = about(edge);
            let (light, x) = (light(triangle), v(0.0, 0.0, z));
            let (z, area) = (f64::from(z), 2.0 * f64::from(edge) * f64::from(edge));
            let mut range = (f64::INFINITY, 0.0_f64);
            for [a, b] in corner_pairs().chain(lattice(4_096)) {
                let on = light.sample_surface([0.5, a, b]).barycentric.as_dvec3();
                // The first coordinate is what the others leave, as it is for the point.
                let r = f64::from(edge) * DVec3::new(2.0 * on.y - 1.0, 2.0 * on.z - 1.0, 0.0);
                let truth = r.length().hypot(z).powi(3) / (z.abs() * area);
                let found = light.sample_from(x, [0.5, a, b]).map_or(0.0, |s| s.density);
                range = (range.0.min(found), range.1.max(found));
                trial.compare(found, truth, || format!("xi = ({a}, {b})"));
            }
            if note {
                trial.note(format!("density {:.1e} to {:.1e}", range.0, range.1));
            }
        };
        HERE.row(Kind::Value, input, "d^2 / (A cos), finite", (1e-14, Unit::Relative), ask)
    };
    let grazing = |trial: &mut Trial| {
        // From (0, 0, 1e-8) to y in the plane, cos = 1e-8 / d.
        let z = 1e-8_f32;
        for (dx, dy) in [(1.0, 0.0), (0.6, 0.8), (-1.0, 1.0), (1e3, 1.0)] {
            let y = v(dx, dy, 0.0);
            let d = y.as_dvec3().length().hypot(f64::from(z));
            let view = View::new(v(0.0, 0.0, z), y, Vec3::Z);
            let found = view.map_or(0.0, |view| view.per_solid_angle(2.0));
            trial.compare(found, 2.0 * d.powi(3) / f64::from(z), || y);
        }
    };
    let moved = |trial: &mut Trial| {
        // Integers, which 1e7 moves without rounding.
        let triangle = [v(-64.0, -64.0, 100.0), v(64.0, -32.0, 100.0), v(0.0, 96.0, 140.0)];
        let (here, far) = (light(triangle), light(triangle.map(|v| v + Vec3::splat(1e7))));
        for [a, b] in corner_pairs().chain(lattice(4_096)) {
            let [one, other] = [(&here, Vec3::ZERO), (&far, Vec3::splat(1e7))]
                .map(|(light, x)| light.sample_from(x, [0.5, a, b]));
            let density = |s: Option<crate::sampler::LightSample>| s.map_or(f64::NAN, |s| s.density);
            trial.compare(density(other), density(one), || format!("xi = ({a}, {b})"));
            trial.must(one.map(|s| s.direction) == other.map(|s| s.direction), || {
                format!("{one:?} {other:?}")
            });
        }
    };
    vec![
        above("distance 1e20", 1e20, 0.5, true),
        above("distance 1e-23, unit light", 1e-23, 0.5, true),
        above("distance 1e-23, edge 1e-23", 1e-23, 1e-23, true),
        above("edge 1e-10 at distance 1", 1.0, 0.5e-10, true),
        above("distance 3e38, edge 3e38", 3e38, 1.5e38, true),
        HERE.row(Kind::Value, "cosine 1e-8", "d^2 / cos, finite", (1e-14, Unit::Relative), grazing),
        HERE.row(Kind::Value, "origin moved by 1e7", "the same bits", (0.0, Unit::UlpF64), moved),
    ]
}

/// Integrals over a whole light.
fn whole_triangles() -> Vec<Row> {
    let close = |trial: &mut Trial| {
        let x = v(0.25, 0.25, 1e-8);
        let seen = UNIT.map(|v| v.as_dvec3() - x.as_dvec3());
        trial.compare(solid_angle_of_triangle(seen), TAU, || "closed form");
        trial.compare(solid_angle_by_views(UNIT, x), TAU, || "sum of cos / d^2 over the area");
        let light = light(UNIT);
        let directions = SeenFrom::new(&light, x);
        // Every direction but the last 1e-7 above the horizon meets the light.
        for [a, b] in lattice(4_096) {
            let (sin, cos) = (TAU * b).sin_cos();
            let r = (1.0 - a * a).sqrt();
            let w = DVec3::new(r * cos, r * sin, -a);
            let truth = (f64::from(x.z) / a).powi(2) / a / 0.5;
            let found = directions.density(&w);
            trial.must((found / truth - 1.0).abs() < 1e-12, || {
                format!("density along {w}: {found:e}, truth {truth:e}")
            });
        }
    };
    let reference = |trial: &mut Trial| {
        let triangles = reference();
        trial.must(triangles.len() == 3, || format!("{} triangles in data/reference", triangles.len()));
        for (i, (vertices, truth)) in triangles.into_iter().enumerate() {
            in_every_way(trial, &format!("triangle {i}, "), vertices, truth);
        }
    };
    let half_space = |trial: &mut Trial| {
        let far = 1e19_f32;
        let triangle = [v(-far, -far, 1.0), v(far, -far, 1.0), v(0.0, far, 1.0)];
        trial.compare(solid_angle_by_views(triangle, Vec3::ZERO), TAU, || "sum of cos / d^2 over the area");
    };
    vec![
        HERE.row(
            Kind::Value,
            "x 1e-8 above a unit triangle",
            "solid angle 2 pi",
            (1e-6, Unit::Absolute),
            close,
        ),
        HERE.row(
            Kind::Value,
            "triangle 1e19 wide at distance 1",
            "solid angle 2 pi",
            (1e-6, Unit::Absolute),
            half_space,
        ),
        HERE.row(
            Kind::Value,
            "triangles of data/reference",
            "solid angles there, in four ways",
            (1e-6, Unit::Relative),
            reference,
        ),
    ]
}

/// The catalogue of Van Oosterom and Strackee 1983: triangles seen from the origin, and the solid angles that are printed there.
fn catalogue() -> Vec<Row> {
    let entry = |input: &str, should: &str, vertices: [[f64; 3]; 3], truth: f64| {
        let vertices = vertices.map(DVec3::from);
        let ask = move |trial: &mut Trial| {
            in_every_way(trial, "", vertices, truth);
            trial.note(format!("{:.11e} sr", solid_angle_of_triangle(vertices)));
        };
        HERE.row(Kind::Value, input, format!("{should}, in four ways"), (1e-6, Unit::Relative), ask)
    };
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    vec![
        entry("an octant", "pi/2", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 0.5 * PI),
        entry(
            "(1, 1, 1), (1, -1, -1), (-1, 1, -1)",
            "pi",
            [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]],
            PI,
        ),
        entry(
            "a face of the icosahedron",
            "pi/5",
            [[0.0, 1.0, golden], [0.0, -1.0, golden], [golden, 0.0, 1.0]],
            0.2 * PI,
        ),
        entry(
            "(0, 0, 1), (1e-4, 0, 1), (0, 1e-4, 1)",
            "4.99999997500e-9",
            [[0.0, 0.0, 1.0], [1e-4, 0.0, 1.0], [0.0, 1e-4, 1.0]],
            4.999_999_975_00e-9,
        ),
    ]
}

/// The solid angle of a triangle seen from the origin: in closed form, as the sum of cos / d^2 over its area, as the mean of 1 / density over points of a
/// light, and by who draws directions. All but the first have vertices that are rounded to `f32`.
fn in_every_way(trial: &mut Trial, which: &str, vertices: [DVec3; 3], truth: f64) {
    trial.compare(solid_angle_of_triangle(vertices), truth, || format!("{which}closed form"));
    let triangle = vertices.map(|v| v.as_vec3());
    let by_views = solid_angle_by_views(triangle, Vec3::ZERO);
    trial.compare(by_views, truth, || format!("{which}sum of cos / d^2 over the area"));
    let light = light(triangle);
    let inverse =
        |[a, b]: [f64; 2]| light.sample_from(Vec3::ZERO, [0.5, a, b]).map_or(f64::NAN, |s| 1.0 / s.density);
    let sampled = super::mean(lattice(1_048_576).map(inverse));
    trial.compare(sampled, truth, || format!("{which}mean of 1 / density"));
    let by_directions = SphericalTriangle::new(Vec3::ZERO, triangle).map_or(f64::NAN, |t| t.solid_angle());
    trial.compare(by_directions, truth, || format!("{which}by solid angle"));
}

/// Uniform directions through triangles. With xi1 at its end the direction lies on the far edge, where it cuts off the share xi0 of the solid angle; between
/// the second vertex and there, 1 - cos is even in xi1.
fn by_solid_angle() -> Vec<Row> {
    let through = |input: &str, x: Vec3, triangle: [Vec3; 3], allowed: f64| {
        let ask = move |trial: &mut Trial| {
            let Some(made) = SphericalTriangle::new(x, triangle) else {
                return trial.must(false, || "has no solid angle".into());
            };
            let seen = triangle.map(|v| v.as_dvec3() - x.as_dvec3());
            let truth = solid_angle_of_triangle(seen);
            trial.compare(made.solid_angle(), truth, || "solid angle");
            let [a, b, _] = seen.map(DVec3::normalize);
            let last = crate::random::ONE_MINUS_EPSILON_F64;
            for [xi0, xi1] in corner_pairs().chain(lattice(1_024)) {
                let w = made.sample([xi0, xi1]);
                trial.must(w.is_normalized(), || format!("xi = ({xi0}, {xi1}) gives {w}"));
                // What is cut off has few digits where it is hardly anything.
                if xi0 > 1e-3 {
                    let on_edge = made.sample([xi0, last]);
                    let share = solid_angle_of_triangle([a, b, on_edge]) / truth;
                    trial.must((share / xi0 - 1.0).abs() < 1e-6, || format!("xi0 = {xi0} cuts off {share}"));
                    let heights = [w, on_edge].map(|w| (w - b).length_squared());
                    trial.must((heights[0] - xi1 * heights[1]).abs() <= 1e-6 * heights[1], || {
                        format!("xi = ({xi0}, {xi1}): heights {heights:?}")
                    });
                }
            }
            let directions = lattice(16_384).map(|xi| made.sample(xi).to_array().map(f64::to_bits));
            trial.reach(Reach::told_apart(directions));
            trial.note(format!("{:.3e} sr", made.solid_angle()));
        };
        HERE.row(Kind::Value, format!("by solid angle: {input}"), "uniform", (allowed, Unit::Relative), ask)
    };
    let nowhere = |input: &str, x: Vec3, triangle: [Vec3; 3]| {
        let ask = move |trial: &mut Trial| {
            let made = SphericalTriangle::new(x, triangle);
            trial.must(made.is_none(), || format!("{made:?}"));
        };
        HERE.row(
            Kind::Limit,
            format!("by solid angle: {input}"),
            "None: there is no solid angle",
            (0.0, Unit::Absolute),
            ask,
        )
    };
    let far = |z: f32| UNIT.map(|v| v + Vec3::new(0.1, 0.2, z));
    vec![
        through("an octant", Vec3::ZERO, [Vec3::X, Vec3::Y, Vec3::Z], 1e-15),
        through("x 1e-8 above a unit triangle", v(0.25, 0.25, 1e-8), UNIT, 1e-12),
        through("edge 1e-4 at distance 1", Vec3::ZERO, far(1e4), 1e-12),
        through("edge 1e-6 at distance 1", Vec3::ZERO, far(1e6), 1e-9),
        through(
            "a needle of 1 by 1e-6",
            Vec3::ZERO,
            [v(-0.5, 0.0, 1.0), v(0.5, 0.0, 1.0), v(0.0, 1e-6, 1.0)],
            1e-9,
        ),
        through("scaled by 1e30", Vec3::ZERO, [Vec3::X, Vec3::Y, Vec3::Z].map(|v| 1e30 * v), 1e-15),
        nowhere("x in its plane", v(3.0, -2.0, 0.0), UNIT),
        nowhere("x in a vertex", Vec3::X, UNIT),
        nowhere("collinear", Vec3::Z, [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]),
    ]
}

/// The sum over a triangle's area of what [`View`] makes of it, cos / d^2, in polar coordinates about the foot of x, which has to be inside: the radius is
/// spread so that cos / d^2 r dr is even, r = h tan t.
fn solid_angle_by_views(triangle: [Vec3; 3], x: Vec3) -> f64 {
    let [a, b, c] = triangle.map(|v| v.as_dvec3() - x.as_dvec3());
    let normal = (b - a).cross(c - a).normalize();
    let height = normal.dot(a);
    if height == 0.0 {
        return 0.0;
    }
    let foot = height * normal;
    // Signed triangles from the foot to each edge.
    let mut sum = CompensatedSum::new();
    for (p, q) in [(a - foot, b - foot), (b - foot, c - foot), (c - foot, a - foot)] {
        let edge = (q - p).normalize();
        let across = edge.cross(normal);
        let distance = across.dot(p);
        if distance == 0.0 {
            continue;
        }
        // The edge is at distance / cos psi, psi from its nearest point on.
        let angle = |r: DVec3| edge.dot(r).atan2(distance.abs());
        let (from, to) = (angle(p), angle(q));
        const STEPS: usize = 256;
        for i in 0..STEPS {
            // Denser where the edge runs away: smooth at both ends.
            let ease = |s: f64| s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
            let slope = |s: f64| 30.0 * s * s * (1.0 - s) * (1.0 - s);
            let s = (i as f64 + 0.5) / STEPS as f64;
            let psi = from + (to - from) * ease(s);
            let reach = (distance.abs() / psi.cos() / height.abs()).atan();
            let direction = psi.cos() * across * distance.signum() + psi.sin() * edge;
            let ring: f64 = (0..STEPS)
                .map(|k| {
                    let t = (k as f64 + 0.5) / STEPS as f64;
                    let at = reach * ease(t);
                    let r = height.abs() * at.tan();
                    let view = View::along(foot + r * direction, normal.as_vec3()).map(View::two_sided);
                    let per_area = view.map_or(f64::NAN, |view| view.per_area(1.0));
                    // dr = h / cos^2 t dt
                    per_area * r * height.abs() / at.cos().powi(2) * reach * slope(t) / STEPS as f64
                })
                .sum();
            sum.add(distance.signum() * ring * (to - from) * slope(s) / STEPS as f64);
        }
    }
    sum.value().abs()
}

/// The triangles of [`REFERENCE`], whose fields "tri" and "solid_angle" are picked out of the text, so that no JSON reader is needed.
fn reference() -> Vec<([DVec3; 3], f64)> {
    let numbers = |text: &str, count: usize| -> Vec<f64> {
        text.split(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c)))
            .filter_map(|word| word.parse().ok())
            .take(count)
            .collect()
    };
    let entries = REFERENCE.split("\"tri\":").skip(1);
    let read = |entry: &str| {
        let t = numbers(entry, 9);
        let angle = numbers(entry.split("\"solid_angle\":").nth(1)?, 1);
        (t.len() == 9).then(|| ([0, 3, 6].map(|k| DVec3::new(t[k], t[k + 1], t[k + 2])), angle[0]))
    };
    entries.filter_map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_find_an_octant() {
        let octant = solid_angle_by_views([Vec3::X, Vec3::Y, Vec3::Z], Vec3::ZERO);
        assert!((octant - TAU / 4.0).abs() < 1e-6, "{octant}");
        assert_eq!(reference().len(), 3);
    }
}
