//! Adaptive quadrature over a cell, with an error estimate.
//!
//! Each rectangle is integrated by the tensor product of Kronrod's seven points, which contain Gauss' three
//! (Kronrod 1965; nodes from QUADPACK's generator, Piessens et al. 1983); the rectangle with the largest error is halved
//! across the axis that causes it until the tolerance is met or the budget is used up. Where the caller says that
//! the density is smooth between known lines (texels), rectangles keep to them and start with a rule of five points.

use super::{Cell, Domain, Knots, Location, Space};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// An integral and how well it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Integral {
    /// The value.
    pub value: f64,
    /// An estimate, meant to be an upper bound, of its absolute error.
    pub error: f64,
    /// How often the integrand was evaluated.
    pub evaluations: u64,
    /// How often it was 0: some, but not all, where the edge of a support crosses the cell.
    pub zeros: u64,
    /// The first place met where the integrand was NaN, infinite or negative, and what it was.
    pub bad: Option<(Location, f64)>,
}

impl std::ops::Add for Integral {
    type Output = Self;

    /// The integral over both places; errors add.
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            error: self.error + other.error,
            evaluations: self.evaluations + other.evaluations,
            zeros: self.zeros + other.zeros,
            bad: self.bad.or(other.bad),
        }
    }
}

/// Densities and Jacobians of the chart at some locations, in their order, into the emptied `out`: many at a time, since what is asked may be at the
/// other end of a pipe.
pub type ChartDensity<'a> = dyn Fn(&[Location], &mut Vec<(f64, f64)>) + 'a;

/// Settings of the quadrature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integrator {
    /// Stop when the error is below this part of the value, …
    pub relative_tolerance: f64,
    /// … or below this, …
    pub absolute_tolerance: f64,
    /// … or when this many evaluations are used up. The first pass over the knots is always made.
    pub max_evaluations: u64,
}

impl Default for Integrator {
    fn default() -> Self {
        Self { relative_tolerance: 1e-6, absolute_tolerance: 0.0, max_evaluations: 20_000 }
    }
}

// Kronrod nodes on [-1, 1]; every second one is Gauss'.
const NODES: [f64; 7] = [
    -0.960_491_268_708_020_3,
    -0.774_596_669_241_483_4,
    -0.434_243_749_346_802_56,
    0.0,
    0.434_243_749_346_802_56,
    0.774_596_669_241_483_4,
    0.960_491_268_708_020_3,
];
const KRONROD: [f64; 7] = [
    0.104_656_226_026_467_27,
    0.268_488_089_868_333_44,
    0.401_397_414_775_962_2,
    0.450_916_538_658_474_14,
    0.401_397_414_775_962_2,
    0.268_488_089_868_333_44,
    0.104_656_226_026_467_27,
];
const GAUSS: [f64; 7] = [0.0, 5.0 / 9.0, 0.0, 8.0 / 9.0, 0.0, 5.0 / 9.0, 0.0];

struct Piece {
    patch: usize,
    low: [f64; 2],
    high: [f64; 2],
    value: f64,
    error: f64,
    worst_axis: usize,
    cheap: bool,
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Piece {}
impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error)
    }
}

impl Integrator {
    /// The integral of `density`, smooth between the `knots`, over `cell` with respect to the domain's measure.
    ///
    /// ```
    /// use warpcheck::domain::*;
    /// let whole = Cell::whole(&Sphere);
    /// let area = Integrator::default().integrate(&Sphere, &whole, &Knots::default(), |_| 1.0);
    /// assert!((area.value - 4.0 * std::f64::consts::PI).abs() < area.error.max(1e-9));
    /// ```
    pub fn integrate<D: Domain>(
        &self,
        domain: &D,
        cell: &Cell,
        knots: &Knots,
        density: impl Fn(&D::Point) -> f64,
    ) -> Integral {
        self.integrate_chart(domain, cell, knots, &Knots::default(), &|places, out| {
            out.clear();
            out.extend(places.iter().map(|place| {
                let (point, jacobian) = domain.point(place.patch, place.at);
                (density(&point), jacobian)
            }));
        })
    }

    /// As [`integrate`](Self::integrate), of a function that gives density and Jacobian at locations, first
    /// cutting the cell at further lines where something is to be looked for. Compiled once: the call costs little beside what it calls.
    pub fn integrate_chart(
        &self,
        space: &dyn Space,
        cell: &Cell,
        knots: &Knots,
        grading: &Knots,
        density: &ChartDensity<'_>,
    ) -> Integral {
        if space.axes() == 0 {
            // Atoms: the integral is a plain sum, and its rounding error at most (count - 1) roundings.
            let mut bad = None;
            let places: Vec<Location> =
                cell.patches.clone().map(|patch| Location { patch, at: [0.0; 2] }).collect();
            let mut values = Vec::new();
            density(&places, &mut values);
            let value = (cell.patches.clone().zip(values))
                .map(|(patch, (value, _))| {
                    if !is_density(value) && bad.is_none() {
                        bad = Some((Location { patch, at: [0.0; 2] }, value));
                    }
                    value
                })
                .sum::<f64>();
            let evaluations = cell.patches.len() as u64;
            let error = evaluations as f64 * f64::EPSILON * value.abs();
            return Integral { value, error, evaluations, zeros: 0, bad };
        }
        let mut run = Run {
            density,
            places: Vec::new(),
            answers: Vec::new(),
            values: Vec::new(),
            axes: space.axes(),
            evaluations: 0,
            zeros: 0,
            bad: None,
        };
        let mut heap = BinaryHeap::new();
        let (mut settled, mut settled_error) = (0.0, 0.0);
        let has_knots = !knots.axes[0].is_empty() || !knots.axes[1].is_empty();
        for (patch, low, high) in pieces(space, cell, knots, grading) {
            let piece = run.measure(patch, low, high, has_knots);
            if piece.error > 0.01 * self.relative_tolerance * piece.value.abs() {
                heap.push(piece);
            } else {
                settled += piece.value;
                settled_error += piece.error;
            }
        }
        loop {
            let (mut value, mut error) = (settled, settled_error);
            // Summed afresh from time to time only: the running totals of a long refinement drift.
            for piece in &heap {
                value += piece.value;
                error += piece.error;
            }
            // Refine a batch before summing again, so that the sum's cost stays small against the refinement's.
            let goal = (self.relative_tolerance * value.abs()).max(self.absolute_tolerance);
            if error <= goal
                || heap.is_empty()
                || run.evaluations >= self.max_evaluations
                || !value.is_finite()
            {
                return Integral {
                    value,
                    error,
                    evaluations: run.evaluations,
                    zeros: run.zeros,
                    bad: run.bad,
                };
            }
            let batch = 1 + heap.len() / 4;
            let mut halves = Vec::with_capacity(2 * batch);
            for _ in 0..batch {
                let Some(piece) = heap.pop() else { break };
                if run.evaluations >= self.max_evaluations {
                    heap.push(piece);
                    break;
                }
                if piece.cheap {
                    halves.push(run.measure(piece.patch, piece.low, piece.high, false));
                    continue;
                }
                let axis = piece.worst_axis;
                let middle = 0.5 * (piece.low[axis] + piece.high[axis]);
                if middle <= piece.low[axis] || middle >= piece.high[axis] {
                    settled += piece.value;
                    settled_error += piece.error;
                    continue;
                }
                let (mut low, mut high) = (piece.low, piece.high);
                (high[axis], low[axis]) = (middle, middle);
                halves.push(run.measure(piece.patch, piece.low, high, false));
                halves.push(run.measure(piece.patch, low, piece.high, false));
            }
            heap.extend(halves);
        }
    }
}

/// The rectangles that lines cut a cell into, as (patch, low, high).
fn pieces(
    space: &dyn Space,
    cell: &Cell,
    knots: &Knots,
    grading: &Knots,
) -> Vec<(usize, [f64; 2], [f64; 2])> {
    let cuts = |axis: usize| -> Vec<f64> {
        if axis >= space.axes() {
            return vec![0.0, 1.0];
        }
        let (low, high) = (cell.low[axis], cell.high[axis]);
        let mut cuts = vec![low];
        cuts.extend_from_slice(knots.between(axis, low, high));
        cuts.extend_from_slice(grading.between(axis, low, high));
        cuts.sort_by(f64::total_cmp);
        cuts.push(high);
        cuts
    };
    let (first, second) = (cuts(0), cuts(1));
    let mut pieces = Vec::with_capacity(cell.patches.len() * first.len() * second.len());
    for patch in cell.patches.clone() {
        for a in first.windows(2) {
            pieces.extend(second.windows(2).map(|b| (patch, [a[0], b[0]], [a[1], b[1]])));
        }
    }
    pieces
}

/// The integral of `density` over `cell` once more, by another rule that shares no node with [`Integrator`] and can't fall into step with
/// the integrand: jittered points, one in each of about `strata` strata. Returns the value and its standard error, from the differences of
/// neighbouring strata, which is if anything too large.
pub fn integrate_at_random(
    space: &dyn Space,
    cell: &Cell,
    knots: &Knots,
    grading: &Knots,
    density: &ChartDensity<'_>,
    strata: usize,
    uniform: &mut dyn FnMut() -> f64,
) -> (f64, f64) {
    let pieces = pieces(space, cell, knots, grading);
    let each = (strata / pieces.len()).max(4);
    let (columns, rows) = if space.axes() == 2 {
        let side = (each as f64).sqrt() as usize;
        (side.next_multiple_of(2), side)
    } else {
        (1, each.next_multiple_of(2))
    };
    let (mut value, mut variance) = (0.0, 0.0);
    let (mut places, mut answers) = (Vec::new(), Vec::new());
    for (patch, low, high) in pieces {
        let count = (columns * rows) as f64;
        let size = [(high[0] - low[0]) / rows as f64, (high[1] - low[1]) / columns as f64];
        let area = size[0] * size[1];
        let (mut last, mut sum, mut squares) = (0.0, 0.0, 0.0);
        places.clear();
        places.extend((0..columns * rows).map(|stratum| {
            let at = [
                low[0] + (((stratum / columns) as f64) + uniform()) * size[0],
                low[1] + (((stratum % columns) as f64) + uniform()) * size[1],
            ];
            Location { patch, at }
        }));
        density(&places, &mut answers);
        for (stratum, &(value, jacobian)) in answers.iter().enumerate() {
            let f = if jacobian == 0.0 || !jacobian.is_finite() { 0.0 } else { value * jacobian };
            sum += f;
            if stratum % 2 == 1 {
                squares += (f - last) * (f - last);
            }
            last = f;
        }
        debug_assert!(count >= 2.0);
        value += sum * area;
        variance += squares * area * area;
    }
    (value, variance.sqrt())
}

struct Run<'a> {
    density: &'a ChartDensity<'a>,
    places: Vec<Location>,
    answers: Vec<(f64, f64)>,
    values: Vec<f64>,
    axes: usize,
    evaluations: u64,
    zeros: u64,
    bad: Option<(Location, f64)>,
}

fn is_density(value: f64) -> bool {
    value.is_finite() && value >= 0.0
}

impl Run<'_> {
    /// The integrand, density times Jacobian, at some nodes of a rectangle.
    fn evaluate(
        &mut self,
        patch: usize,
        centre: [f64; 2],
        half: [f64; 2],
        nodes: impl Iterator<Item = [f64; 2]>,
    ) {
        self.places.clear();
        self.places.extend(
            nodes.map(|[x, y]| Location { patch, at: [centre[0] + x * half[0], centre[1] + y * half[1]] }),
        );
        (self.density)(&self.places, &mut self.answers);
        self.evaluations += self.places.len() as u64;
        self.values.clear();
        for (place, &(value, jacobian)) in self.places.iter().zip(&self.answers) {
            // At a pole, or farther out than numbers go.
            let product = if jacobian == 0.0 || !jacobian.is_finite() { 0.0 } else { value * jacobian };
            if !(jacobian == 0.0 || !jacobian.is_finite() || is_density(value)) && self.bad.is_none() {
                self.bad = Some((*place, product));
            }
            self.zeros += u64::from(product == 0.0);
            self.values.push(product);
        }
    }

    fn measure(&mut self, patch: usize, low: [f64; 2], high: [f64; 2], cheap: bool) -> Piece {
        let half = [0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1])];
        let centre = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
        let (value, error, worst_axis);
        if cheap {
            // Gauss' two points an axis against the midpoint.
            let g = 1.0 / 3.0_f64.sqrt();
            let (midpoint, gauss);
            if self.axes == 1 {
                self.evaluate(patch, centre, half, [0.0, -g, g].map(|x| [x, 0.0]).into_iter());
                midpoint = 2.0 * self.values[0];
                gauss = self.values[1] + self.values[2];
            } else {
                let nodes = [[0.0, 0.0], [-g, -g], [-g, g], [g, -g], [g, g]];
                self.evaluate(patch, centre, half, nodes.into_iter());
                midpoint = 4.0 * self.values[0];
                gauss = self.values[1] + self.values[2] + self.values[3] + self.values[4];
            }
            (value, error, worst_axis) = (gauss, (gauss - midpoint).abs(), 0);
        } else if self.axes == 1 {
            let (mut kronrod, mut gauss, mut absolute) = (0.0, 0.0, 0.0);
            self.evaluate(patch, centre, half, NODES.iter().map(|&x| [x, 0.0]));
            for i in 0..7 {
                let v = self.values[i];
                kronrod += KRONROD[i] * v;
                gauss += GAUSS[i] * v;
                absolute += KRONROD[i] * v.abs();
            }
            (value, error, worst_axis) = (kronrod, sharpen((kronrod - gauss).abs(), absolute), 0);
        } else {
            let (mut kk, mut gk, mut kg, mut absolute) = (0.0, 0.0, 0.0, 0.0);
            let nodes = NODES.iter().flat_map(|&x| NODES.iter().map(move |&y| [x, y]));
            self.evaluate(patch, centre, half, nodes);
            for i in 0..7 {
                let (mut row_k, mut row_g, mut row_absolute) = (0.0, 0.0, 0.0);
                for j in 0..7 {
                    let v = self.values[7 * i + j];
                    row_k += KRONROD[j] * v;
                    row_g += GAUSS[j] * v;
                    row_absolute += KRONROD[j] * v.abs();
                }
                kk += KRONROD[i] * row_k;
                gk += GAUSS[i] * row_k;
                kg += KRONROD[i] * row_g;
                absolute += KRONROD[i] * row_absolute;
            }
            let (across_0, across_1) = ((kk - gk).abs(), (kk - kg).abs());
            (value, error) = (kk, sharpen(across_0 + across_1, absolute));
            worst_axis = usize::from(across_1 > across_0);
        }
        let area = if self.axes == 1 { half[0] } else { half[0] * half[1] };
        Piece { patch, low, high, value: value * area, error: error * area, worst_axis, cheap }
    }
}

/// The difference of the two rules is the error of Gauss' three points (order 6); that of Kronrod's seven (order
/// 12) is about its square. A jump gives a large difference, which is left as it is; a small one is lowered, but
/// thirty times less than smoothness would allow. Never below rounding.
fn sharpen(difference: f64, absolute: f64) -> f64 {
    if difference == 0.0 || absolute == 0.0 {
        return difference;
    }
    (difference * (30.0 * (difference / absolute).sqrt()).min(1.0)).max(2.0 * f64::EPSILON * absolute)
}
