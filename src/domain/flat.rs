//! Flat pieces: intervals (finite or not), the unit square, the unit disk.

use super::direction::of_phi;
use super::{Cell, Confusion, Domain, Factor, Keeps, Location, Outside, Space, TOLERANCE};
use glam::DVec2;
use std::f64::consts::TAU;

/// The reals from `low` to `high`, measured by length; either end may be infinite.
///
/// A finite interval is charted linearly, an infinite end by x = e^s - 1 with s = t / (1 - t), so that even tails as heavy as
/// x^-1.05 lie within reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    /// From `low` to `high`, each finite or infinite.
    ///
    /// # Panics
    /// Unless `low < high`, and if both are finite but their difference is not.
    #[track_caller]
    pub fn new(low: f64, high: f64) -> Self {
        assert!(low < high, "an interval needs low < high, got {low} and {high}");
        let overflows = low.is_finite() && high.is_finite() && !(high - low).is_finite();
        assert!(!overflows, "the interval from {low} to {high} is longer than any number");
        Self { low, high }
    }

    /// All reals.
    pub fn real_line() -> Self {
        Self::new(f64::NEG_INFINITY, f64::INFINITY)
    }

    /// The reals from 0 up.
    pub fn positive() -> Self {
        Self::new(0.0, f64::INFINITY)
    }
}

/// x = e^s - 1, s = t / (1 - t), and dx / dt.
fn stretch(t: f64) -> (f64, f64) {
    let s = t / (1.0 - t);
    (s.exp_m1(), s.exp() / ((1.0 - t) * (1.0 - t)))
}

/// The inverse of [`stretch`], for x >= 0.
fn shrink(x: f64) -> f64 {
    let s = x.max(0.0).ln_1p();
    s / (1.0 + s)
}

impl Space for Interval {
    fn confusions(&self) -> Vec<Confusion> {
        if self.low.is_finite() != self.high.is_finite() {
            return Vec::new();
        }
        vec![Confusion::new("mirrored", Keeps::Measure, |[t, _]| [1.0 - t, 0.0])]
    }

    fn cell_measure(&self, cell: &Cell) -> f64 {
        self.point(0, cell.high).0 - self.point(0, cell.low).0
    }

    fn name(&self) -> &'static str {
        "interval"
    }

    fn per(&self) -> &'static str {
        "length"
    }

    fn measure(&self) -> f64 {
        self.high - self.low
    }

    fn axes(&self) -> usize {
        1
    }

    fn describe(&self, cell: &Cell) -> String {
        format!("x {:.6}..{:.6}", self.point(0, cell.low).0, self.point(0, cell.high).0)
    }

    fn picture_aspect(&self) -> f64 {
        4.0
    }

    fn picture_location(&self, x: f64, _: f64) -> Option<Location> {
        Some(Location { patch: 0, at: [x, 0.0] })
    }

    fn picture_position(&self, location: &Location) -> [f64; 2] {
        [location.at[0], 0.5]
    }

    fn picture_scale(&self, x: f64, _: f64) -> f64 {
        self.point(0, [x, 0.0]).1
    }

    fn picture_caption(&self) -> &'static str {
        "the interval from low to high (an infinite end drawn in)"
    }
}

impl Domain for Interval {
    fn magnitude(&self, x: &f64) -> f64 {
        x.abs().max(1e-3 * if self.measure().is_finite() { self.measure() } else { 1.0 })
    }

    type Point = f64;

    fn point(&self, _: usize, at: [f64; 2]) -> (f64, f64) {
        let t = at[0];
        match (self.low.is_finite(), self.high.is_finite()) {
            (true, true) => {
                let length = self.high - self.low;
                (self.low + t * length, length)
            }
            (true, false) => {
                let (x, slope) = stretch(t);
                (self.low + x, slope)
            }
            (false, true) => {
                let (x, slope) = stretch(1.0 - t);
                (self.high - x, slope)
            }
            (false, false) => {
                let (x, slope) = stretch((2.0 * t - 1.0).abs());
                (if t < 0.5 { -x } else { x }, 2.0 * slope)
            }
        }
    }

    fn locate(&self, x: &f64) -> Result<Location, Outside> {
        let x = *x;
        if !x.is_finite() {
            return Err(Outside(format!("is not finite: {x}")));
        }
        // Roundings of the ends, but never a noticeable part of the interval.
        let size =
            [self.low, self.high].into_iter().filter(|v| v.is_finite()).fold(0.0, |a: f64, v| a.max(v.abs()));
        let slack = (TOLERANCE * size.max(1e-30)).min(1e-3 * (self.high - self.low));
        if x < self.low - slack || x > self.high + slack {
            return Err(Outside(format!("is {x}, outside of [{}, {}]", self.low, self.high)));
        }
        let t = match (self.low.is_finite(), self.high.is_finite()) {
            (true, true) => (x - self.low) / (self.high - self.low),
            (true, false) => shrink(x - self.low),
            (false, true) => 1.0 - shrink(self.high - x),
            (false, false) => 0.5 + 0.5 * shrink(x.abs()).copysign(x),
        };
        Ok(Location { patch: 0, at: [t.clamp(0.0, 1.0), 0.0] })
    }
}

/// The closed unit square, measured by area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Square;

impl Space for Square {
    fn factors(&self) -> Vec<Factor> {
        vec![Factor { name: "x", value: |l| l.at[0] }, Factor { name: "y", value: |l| l.at[1] }]
    }

    fn confusions(&self) -> Vec<Confusion> {
        use Keeps::Measure;
        vec![
            Confusion::new("x mirrored", Measure, |[x, y]| [1.0 - x, y]),
            Confusion::new("y mirrored", Measure, |[x, y]| [x, 1.0 - y]),
            Confusion::new("x and y mirrored", Measure, |[x, y]| [1.0 - x, 1.0 - y]),
            Confusion::new("x and y exchanged", Measure, |[x, y]| [y, x]),
            Confusion::new("a quarter turn off", Measure, |[x, y]| [y, 1.0 - x]),
            Confusion::new("a quarter turn off", Measure, |[x, y]| [1.0 - y, x]),
        ]
    }

    fn cell_measure(&self, cell: &Cell) -> f64 {
        (cell.high[0] - cell.low[0]) * (cell.high[1] - cell.low[1])
    }

    fn name(&self) -> &'static str {
        "square"
    }

    fn per(&self) -> &'static str {
        "area"
    }

    fn measure(&self) -> f64 {
        1.0
    }

    fn describe(&self, cell: &Cell) -> String {
        format!("x {:.5}..{:.5}, y {:.5}..{:.5}", cell.low[0], cell.high[0], cell.low[1], cell.high[1])
    }

    fn picture_location(&self, x: f64, y: f64) -> Option<Location> {
        Some(Location { patch: 0, at: [x, 1.0 - y] })
    }

    fn picture_position(&self, location: &Location) -> [f64; 2] {
        [location.at[0], 1.0 - location.at[1]]
    }

    fn picture_scale(&self, _: f64, _: f64) -> f64 {
        1.0
    }

    fn picture_caption(&self) -> &'static str {
        "the unit square: x to the right, y up"
    }
}

impl Domain for Square {
    type Point = DVec2;

    fn point(&self, _: usize, at: [f64; 2]) -> (DVec2, f64) {
        (at.into(), 1.0)
    }

    fn locate(&self, p: &DVec2) -> Result<Location, Outside> {
        let inside = |x: f64| (-TOLERANCE..=1.0 + TOLERANCE).contains(&x);
        if !(inside(p.x) && inside(p.y)) {
            return Err(Outside(format!("is {p}, outside of the unit square")));
        }
        Ok(Location { patch: 0, at: p.clamp(DVec2::ZERO, DVec2::ONE).into() })
    }
}

/// The closed unit disk, measured by area; its chart is polar, (r, phi / 2 pi).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disk;

impl Space for Disk {
    fn embed(&self, location: &Location) -> [f64; 3] {
        let p = self.point(0, location.at).0;
        [p.x, p.y, 0.0]
    }

    fn factors(&self) -> Vec<Factor> {
        vec![Factor { name: "r", value: |l| l.at[0] }]
    }

    fn usual_densities(&self) -> Vec<Factor> {
        vec![Factor { name: "uniform in r and phi", value: |l| 1.0 / l.at[0] }]
    }

    fn confusions(&self) -> Vec<Confusion> {
        let mut all = of_phi();
        all.push(Confusion::new("r and phi exchanged", Keeps::Chart, |[r, phi]| [phi, r]));
        all.push(Confusion::new("r from the rim", Keeps::Chart, |[r, phi]| [1.0 - r, phi]));
        all
    }

    fn axis_names(&self) -> [&'static str; 2] {
        ["r", "phi"]
    }

    fn wraps(&self, axis: usize) -> bool {
        axis == 1
    }

    fn cell_measure(&self, cell: &Cell) -> f64 {
        let ([a, from], [b, to]) = (cell.low, cell.high);
        0.5 * (b - a) * (b + a) * (to - from) * TAU
    }

    fn name(&self) -> &'static str {
        "disk"
    }

    fn per(&self) -> &'static str {
        "area"
    }

    fn measure(&self) -> f64 {
        TAU / 2.0
    }

    fn extent(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        [high[0] - low[0], (high[1] - low[1]) * TAU * 0.5 * (low[0] + high[0])]
    }

    fn describe(&self, cell: &Cell) -> String {
        let degrees = |x: f64| x * 360.0;
        format!(
            "r {:.5}..{:.5}, phi {:.3}..{:.3} deg",
            cell.low[0],
            cell.high[0],
            degrees(cell.low[1]),
            degrees(cell.high[1])
        )
    }

    fn picture_location(&self, x: f64, y: f64) -> Option<Location> {
        self.locate(&DVec2::new(2.0 * x - 1.0, 1.0 - 2.0 * y)).ok()
    }

    fn picture_position(&self, location: &Location) -> [f64; 2] {
        let p = self.point(0, location.at).0;
        [0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y]
    }

    fn picture_scale(&self, _: f64, _: f64) -> f64 {
        4.0
    }

    fn picture_caption(&self) -> &'static str {
        "the unit disk: x to the right, y up"
    }
}

impl Domain for Disk {
    type Point = DVec2;

    fn point(&self, _: usize, at: [f64; 2]) -> (DVec2, f64) {
        (DVec2::from_angle(at[1] * TAU) * at[0], TAU * at[0])
    }

    fn locate(&self, p: &DVec2) -> Result<Location, Outside> {
        if !p.is_finite() || p.length() > 1.0 + TOLERANCE {
            return Err(Outside(format!("is {p}, outside of the unit disk")));
        }
        Ok(Location { patch: 0, at: [p.length().min(1.0), p.y.atan2(p.x).rem_euclid(TAU) / TAU] })
    }
}
