//! Directions: the unit sphere and the upper hemisphere, measured by solid angle.
//!
//! The chart is (theta, phi) scaled to the unit square, theta from +Z and phi from +X towards +Y, with
//! d omega = sin theta d theta d phi. The angles come from `atan2`, so that the last bits of a direction near
//! either pole are kept.

use super::{
    Cell, Confusion, Domain, Factor, Keeps, Location, Outside, Pixels, Space, TOLERANCE, Uncounted, in_short,
    turns,
};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// All unit vectors, measured by solid angle; +Z is theta = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sphere;

/// The unit vectors with z >= 0, measured by solid angle; +Z is theta = 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hemisphere;

fn direction(theta: f64, phi: f64) -> DVec3 {
    let ((sin_theta, cos_theta), (sin_phi, cos_phi)) = (theta.sin_cos(), phi.sin_cos());
    DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}

/// Whether a vector is as long as a direction, up to rounding; not so if it is not finite.
#[inline]
fn is_unit(w: DVec3) -> bool {
    (w.length_squared() - 1.0).abs() <= 2.0 * TOLERANCE
}

/// (theta, phi) of a unit vector, phi in `[0, 2 pi)`.
fn angles(w: DVec3) -> Result<(f64, f64), Outside> {
    if !w.is_finite() {
        return Err(Outside(format!("is not finite: {w}")));
    }
    if !is_unit(w) {
        return Err(Outside(format!("has length {}", w.length())));
    }
    let phi = w.y.atan2(w.x);
    // Of unit length, so that squares neither overflow nor, beyond 1e-150 rad of a pole, vanish: no `hypot`.
    Ok((w.truncate().length().atan2(w.z), if phi < 0.0 { phi + TAU } else { phi }))
}

/// Where directions lie on a chart whose theta ends at `range`; those that `inside` does not take are left to `locate`, which may know better.
fn locate_directions(
    points: &[DVec3],
    range: f64,
    out: &mut Vec<Option<Location>>,
    inside: impl Fn(DVec3) -> bool,
    locate: impl Fn(&DVec3) -> Result<Location, Outside>,
) {
    const LANES: usize = 8;
    for some in points.chunks(LANES) {
        let (mut x, mut y, mut z, mut r) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for (i, w) in some.iter().enumerate() {
            (x[i], y[i], z[i]) = (w.x, w.y, w.z);
        }
        for i in 0..LANES {
            r[i] = (x[i] * x[i] + y[i] * y[i]).sqrt();
        }
        let (mut theta, mut phi) = (turns::angles(&r, &z), turns::angles(&y, &x));
        for i in 0..LANES {
            let down = theta[i] / range;
            (theta[i], phi[i]) = (if down < 1.0 { down } else { 1.0 }, phi[i] / TAU);
        }
        out.extend(some.iter().enumerate().map(|(i, w)| {
            if is_unit(*w) && inside(*w) {
                Some(Location { patch: 0, at: [theta[i], phi[i]] })
            } else {
                locate(w).ok()
            }
        }));
    }
}

/// The same to within [`ROUGHLY`]; NaN unless `inside`.
fn locate_directions_roughly(
    points: &[DVec3],
    range: f64,
    out: &mut [Vec<f32>; 2],
    inside: impl Fn(f32) -> bool,
) {
    const LANES: usize = 32;
    let turns_in_range = (TAU / range) as f32;
    for some in points.chunks(LANES) {
        let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for (i, w) in some.iter().enumerate() {
            (x[i], y[i], z[i]) = (w.x as f32, w.y as f32, w.z as f32);
        }
        let (mut sine, mut doubt) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let square = x[i] * x[i] + y[i] * y[i];
            // Who is nearly as long as a direction may be is looked at closely.
            let is_unit = (square + z[i] * z[i] - 1.0).abs() <= TOLERANCE as f32;
            // So close to a pole numbers vanish.
            let has_turn = square >= 1e-30;
            sine[i] = square.sqrt();
            doubt[i] = if is_unit & has_turn & inside(z[i]) { 0.0 } else { f32::NAN };
        }
        let (mut down, mut around) = (turns::abouts_f32(&sine, &z), turns::abouts_f32(&y, &x));
        for i in 0..LANES {
            down[i] *= turns_in_range;
            around[i] += doubt[i];
        }
        out[0].extend_from_slice(&down[..some.len()]);
        out[1].extend_from_slice(&around[..some.len()]);
    }
}

/// How far a rough place may be off: the error of turns, times the four quarters of a turn that the shortest axis of a chart may be, and what rounding
/// a direction to `f32` turns it by.
const ROUGHLY: f32 = 4.0 * (turns::ERROR as f32 + 1e-7);

/// Solid angle of a cell: (cos a - cos b) times the width in phi, without cancellation.
fn solid_angle(cell: &Cell, theta_range: f64) -> f64 {
    let (a, b) = (cell.low[0] * theta_range, cell.high[0] * theta_range);
    2.0 * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin() * (cell.high[1] - cell.low[1]) * TAU
}

/// On the tangent plane at `from`, which touches the sphere to second order.
fn tangent_step(from: DVec3, to: DVec3) -> Option<[f64; 2]> {
    let (t, b) = from.normalize().any_orthonormal_pair();
    let step = to - from;
    step.is_finite().then_some([t.dot(step), b.dot(step)])
}

fn tangent_neighbours(w: DVec3, epsilon: f64) -> impl Iterator<Item = DVec3> {
    let (t, b) = w.any_orthonormal_pair();
    [t, -t, b, -b].into_iter().map(move |step| (w + epsilon * step).normalize())
}

fn describe(cell: &Cell, theta_range: f64) -> String {
    let degrees = |x: f64, range: f64| (x * range).to_degrees();
    format!(
        "theta {:.4}..{:.4} deg, phi {:.4}..{:.4} deg",
        degrees(cell.low[0], theta_range),
        degrees(cell.high[0], theta_range),
        degrees(cell.low[1], TAU),
        degrees(cell.high[1], TAU)
    )
}

/// The direction at chart coordinates, for a chart whose theta ends at `range`.
fn charted(at: [f64; 2], range: f64) -> DVec3 {
    direction(at[0] * range, at[1] * TAU)
}

/// Points uniform in a cube around the origin, normalised without rejecting the corners: along w it reaches 1 / max |w_i|, and the density is the
/// cube of that.
fn normalised_cube(w: DVec3) -> f64 {
    w.abs().max_element().powi(-3)
}

fn turned(x: f64, turn: f64) -> f64 {
    (x + turn).rem_euclid(1.0)
}

/// What turns and mirrors phi, which every domain with a polar chart has.
pub(super) fn of_phi() -> Vec<Confusion> {
    use Keeps::Measure;
    vec![
        Confusion::new("phi reversed", Measure, |[a, b]| [a, 1.0 - b]),
        Confusion::new("phi half a turn off", Measure, |[a, b]| [a, turned(b, 0.5)]),
        Confusion::new("phi a quarter turn off", Measure, |[a, b]| [a, turned(b, 0.25)]),
        Confusion::new("phi a quarter turn off", Measure, |[a, b]| [a, turned(b, -0.25)]),
        Confusion::new("x mirrored", Measure, |[a, b]| [a, turned(0.5, -b)]),
        Confusion::new("x and y exchanged", Measure, |[a, b]| [a, turned(0.25, -b)]),
    ]
}

/// An isometry of the sphere as a map of chart coordinates.
fn moved(at: [f64; 2], map: fn(DVec3) -> DVec3) -> [f64; 2] {
    let w = map(charted(at, PI));
    [w.x.hypot(w.y).atan2(w.z) / PI, turned(w.y.atan2(w.x) / TAU, 0.0)]
}

impl Space for Sphere {
    fn embed(&self, location: &Location) -> [f64; 3] {
        self.point(0, location.at).0.into()
    }

    fn factors(&self) -> Vec<Factor> {
        vec![
            Factor { name: "sin theta", value: |l| (l.at[0] * PI).sin() },
            Factor { name: "cos theta", value: |l| (l.at[0] * PI).cos().abs() },
        ]
    }

    fn usual_densities(&self) -> Vec<Factor> {
        vec![
            Factor { name: "uniform in theta and phi", value: |l| 1.0 / (l.at[0] * PI).sin() },
            Factor { name: "of a normalised cube", value: |l| normalised_cube(charted(l.at, PI)) },
            Factor {
                name: "cosine-weighted on the upper hemisphere",
                value: |l| (l.at[0] * PI).cos().max(0.0),
            },
            Factor { name: "uniform on the upper hemisphere", value: |l| f64::from(u8::from(l.at[0] < 0.5)) },
        ]
    }

    fn confusions(&self) -> Vec<Confusion> {
        use Keeps::{Chart, Measure};
        let mut all = of_phi();
        all.extend([
            Confusion::new("v flipped (theta from the other pole)", Measure, |[a, b]| [1.0 - a, b]),
            Confusion::new("opposite direction", Measure, |[a, b]| [1.0 - a, turned(b, 0.5)]),
            Confusion::new("theta and phi exchanged", Chart, |[a, b]| [b, a]),
            Confusion::new("theta and phi exchanged", Measure, |[a, b]| [b, a]),
            Confusion::new("y and z exchanged", Measure, |at| moved(at, |w| DVec3::new(w.x, w.z, w.y))),
            Confusion::new("y up for z up", Measure, |at| moved(at, |w| DVec3::new(w.x, -w.z, w.y))),
            Confusion::new("y up for z up", Measure, |at| moved(at, |w| DVec3::new(w.x, w.z, -w.y))),
            Confusion::new("x and z exchanged", Measure, |at| moved(at, |w| DVec3::new(w.z, w.y, w.x))),
            Confusion::new("axes rotated", Measure, |at| moved(at, |w| DVec3::new(w.y, w.z, w.x))),
            Confusion::new("axes rotated", Measure, |at| moved(at, |w| DVec3::new(w.z, w.x, w.y))),
        ]);
        all
    }

    fn axis_names(&self) -> [&'static str; 2] {
        ["theta", "phi"]
    }

    fn wraps(&self, axis: usize) -> bool {
        axis == 1
    }

    fn direction(&self, location: &Location) -> Option<DVec3> {
        Some(charted(location.at, PI))
    }

    fn cell_measure(&self, cell: &Cell) -> f64 {
        solid_angle(cell, PI)
    }

    fn name(&self) -> &'static str {
        "sphere"
    }

    fn per(&self) -> &'static str {
        "solid angle"
    }

    fn measure(&self) -> f64 {
        4.0 * PI
    }

    fn extent(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        let middle = 0.5 * (low[0] + high[0]) * PI;
        [(high[0] - low[0]) * PI, (high[1] - low[1]) * TAU * middle.sin()]
    }

    fn describe(&self, cell: &Cell) -> String {
        describe(cell, PI)
    }

    fn picture_aspect(&self) -> f64 {
        2.0
    }

    fn picture_location(&self, x: f64, y: f64) -> Option<Location> {
        Some(Location { patch: 0, at: [y, x] })
    }

    fn picture_position(&self, location: &Location) -> [f64; 2] {
        [location.at[1], location.at[0]]
    }

    fn picture_scale(&self, _: f64, y: f64) -> f64 {
        PI * TAU * (PI * y).sin()
    }

    fn picture_caption(&self) -> &'static str {
        "lat-long: phi 0..360 deg to the right, theta 0 (+Z) at the top to 180 deg"
    }
}

impl Domain for Sphere {
    fn magnitude(&self, _: &DVec3) -> f64 {
        1.0
    }

    type Point = DVec3;

    fn displacement(&self, from: &DVec3, to: &DVec3) -> Option<[f64; 2]> {
        tangent_step(*from, *to)
    }

    fn point(&self, _: usize, at: [f64; 2]) -> (DVec3, f64) {
        let theta = at[0] * PI;
        (direction(theta, at[1] * TAU), PI * TAU * theta.sin())
    }

    fn locate(&self, w: &DVec3) -> Result<Location, Outside> {
        let (theta, phi) = angles(*w)?;
        Ok(Location { patch: 0, at: [theta / PI, phi / TAU] })
    }

    fn locate_many(&self, points: &[DVec3], out: &mut Vec<Option<Location>>) {
        locate_directions(points, PI, out, |_| true, |w| self.locate(w));
    }

    fn locate_roughly(&self, points: &[DVec3], out: &mut [Vec<f32>; 2]) -> f32 {
        locate_directions_roughly(points, PI, out, |_| true);
        ROUGHLY
    }

    /// Without angles: their inverse trigonometric functions would cost more than most samplers.
    #[inline]
    fn pixel(&self, pixels: &Pixels, w: &DVec3) -> Result<Option<usize>, Outside> {
        if !is_unit(*w) {
            return self.locate(w).map(|_| None); // an error: see there
        }
        Ok(Some(pixels.of_direction(*w)))
    }

    /// Many at a time, in what is a loop without branches but for points near a border of pixels.
    fn count_pixels(&self, pixels: &Pixels, points: &[Option<DVec3>], counts: &mut [u32]) -> Uncounted {
        const BATCH: usize = 32;
        let mut uncounted = Uncounted::default();
        let mut one_by_one = |points: &[Option<DVec3>], counts: &mut [u32]| {
            for point in points {
                match point {
                    None => uncounted.none += 1,
                    Some(w) if !is_unit(*w) => uncounted.outside += 1,
                    Some(w) => counts[pixels.of_direction(*w)] += 1,
                }
            }
        };
        let (batches, rest) = points.as_chunks::<BATCH>();
        for batch in batches {
            let (mut w, mut are_units) = ([[0.0; BATCH]; 3], true);
            for i in 0..BATCH {
                let point = batch[i].unwrap_or(DVec3::ZERO);
                are_units &= is_unit(point);
                [w[0][i], w[1][i], w[2][i]] = point.to_array();
            }
            if are_units {
                pixels.of_directions(&w).iter().for_each(|&pixel| counts[pixel] += 1);
            } else {
                one_by_one(batch, counts);
            }
        }
        one_by_one(rest, counts);
        uncounted
    }

    fn neighbours(&self, w: &DVec3, epsilon: f64) -> Vec<DVec3> {
        tangent_neighbours(*w, epsilon).collect()
    }
}

impl Space for Hemisphere {
    fn embed(&self, location: &Location) -> [f64; 3] {
        self.point(0, location.at).0.into()
    }

    fn factors(&self) -> Vec<Factor> {
        vec![
            Factor { name: "cos theta", value: |l| (l.at[0] * FRAC_PI_2).cos() },
            Factor { name: "sin theta", value: |l| (l.at[0] * FRAC_PI_2).sin() },
        ]
    }

    fn usual_densities(&self) -> Vec<Factor> {
        vec![
            Factor { name: "cosine-weighted", value: |l| (l.at[0] * FRAC_PI_2).cos() },
            Factor { name: "uniform in theta and phi", value: |l| 1.0 / (l.at[0] * FRAC_PI_2).sin() },
            // The disk without its Jacobian lifted up: d r = cos theta d theta, so cos / sin per solid angle.
            Factor {
                name: "of a radius without its square root",
                value: |l| 1.0 / (l.at[0] * FRAC_PI_2).tan(),
            },
            Factor { name: "of a normalised cube", value: |l| normalised_cube(charted(l.at, FRAC_PI_2)) },
        ]
    }

    fn confusions(&self) -> Vec<Confusion> {
        use Keeps::{Chart, Measure};
        let mut all = of_phi();
        all.extend([
            Confusion::new("theta from the horizon", Chart, |[a, b]| [1.0 - a, b]),
            Confusion::new("sin theta and cos theta exchanged", Measure, |[a, b]| [1.0 - a, b]),
            Confusion::new("theta and phi exchanged", Chart, |[a, b]| [b, a]),
            Confusion::new("theta and phi exchanged", Measure, |[a, b]| [b, a]),
        ]);
        all
    }

    fn axis_names(&self) -> [&'static str; 2] {
        ["theta", "phi"]
    }

    fn wraps(&self, axis: usize) -> bool {
        axis == 1
    }

    fn direction(&self, location: &Location) -> Option<DVec3> {
        Some(charted(location.at, FRAC_PI_2))
    }

    fn cell_measure(&self, cell: &Cell) -> f64 {
        solid_angle(cell, FRAC_PI_2)
    }

    fn name(&self) -> &'static str {
        "hemisphere"
    }

    fn per(&self) -> &'static str {
        "solid angle"
    }

    fn measure(&self) -> f64 {
        TAU
    }

    fn extent(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        let middle = 0.5 * (low[0] + high[0]) * FRAC_PI_2;
        [(high[0] - low[0]) * FRAC_PI_2, (high[1] - low[1]) * TAU * middle.sin()]
    }

    fn describe(&self, cell: &Cell) -> String {
        describe(cell, FRAC_PI_2)
    }

    fn picture_location(&self, x: f64, y: f64) -> Option<Location> {
        // Lambert's azimuthal equal-area projection, seen from +Z: r^2 = 1 - cos theta.
        let (px, py) = (2.0 * x - 1.0, 1.0 - 2.0 * y);
        let r2 = px * px + py * py;
        (r2 <= 1.0).then(|| {
            let theta = 2.0 * (0.5 * r2).sqrt().asin();
            let phi = py.atan2(px).rem_euclid(TAU);
            Location { patch: 0, at: [(theta / FRAC_PI_2).min(1.0), phi / TAU] }
        })
    }

    fn picture_position(&self, location: &Location) -> [f64; 2] {
        let r = std::f64::consts::SQRT_2 * (0.5 * location.at[0] * FRAC_PI_2).sin();
        let (sin, cos) = (location.at[1] * TAU).sin_cos();
        [0.5 + 0.5 * r * cos, 0.5 - 0.5 * r * sin]
    }

    /// The disk covers pi / 4 of the picture.
    fn picture_scale(&self, _: f64, _: f64) -> f64 {
        8.0
    }

    fn picture_caption(&self) -> &'static str {
        "equal-area disk seen from +Z: the rim is the horizon, +X to the right, +Y up"
    }
}

impl Domain for Hemisphere {
    fn magnitude(&self, _: &DVec3) -> f64 {
        1.0
    }

    type Point = DVec3;

    fn displacement(&self, from: &DVec3, to: &DVec3) -> Option<[f64; 2]> {
        tangent_step(*from, *to)
    }

    fn point(&self, _: usize, at: [f64; 2]) -> (DVec3, f64) {
        let theta = at[0] * FRAC_PI_2;
        let mut w = direction(theta, at[1] * TAU);
        w.z = w.z.max(0.0);
        (w, FRAC_PI_2 * TAU * theta.sin())
    }

    fn locate(&self, w: &DVec3) -> Result<Location, Outside> {
        let (theta, phi) = angles(*w)?;
        if w.z < -TOLERANCE {
            return Err(Outside(format!("is under the horizon: z = {}", in_short(&w.z))));
        }
        Ok(Location { patch: 0, at: [(theta / FRAC_PI_2).min(1.0), phi / TAU] })
    }

    fn locate_many(&self, points: &[DVec3], out: &mut Vec<Option<Location>>) {
        locate_directions(points, FRAC_PI_2, out, |w| w.z >= -TOLERANCE, |w| self.locate(w));
    }

    fn locate_roughly(&self, points: &[DVec3], out: &mut [Vec<f32>; 2]) -> f32 {
        locate_directions_roughly(points, FRAC_PI_2, out, |z| z >= 0.0);
        ROUGHLY
    }

    fn neighbours(&self, w: &DVec3, epsilon: f64) -> Vec<DVec3> {
        tangent_neighbours(*w, epsilon).filter(|w| w.z >= 0.0).collect()
    }
}
