//! The change-of-variables identity: density x |det d point / d xi| = 1, at single points, by differences.
//!
//! If several variates lead to a point, density = sum of weight / |det| over them. A sampler may list them
//! ([`Sampler::preimages`](crate::sampler::Sampler::preimages)); otherwise others are looked for when the identity fails with one.
//!
//! Derivatives are central differences of fourth order, (8 (f(h) - f(-h)) - (f(2h) - f(-2h))) / 12 h (Abramowitz and Stegun 25.3.6). The step halves from
//! 1/32 down; truncation falls as h^4 while the rounding of an `f32` point grows as 1/h, and the step is the one at which three in a row agree best
//! (after Ridders, Adv. Eng. Softw. 4, 1982). The error is their difference, plus what rounding can do at that step, and steps of other lengths must
//! agree within it. Over many small jumps (texels that nobody named) the differences are those of the average density: so what
//! bends the density across the step, at the points drawn and between them, counts as error too. A place where no step settles has a jump or a kink within reach, and is skipped and counted. Variates are on a lattice of 2^-20, so that steps are exact in `f32`; a sampler that takes `f64` simply settles at a smaller step.

use super::check::{Case, Check, Needs, Rests};
use super::expectation::Expectation;
use super::finding::{Evidence, Finding, Verdict};
use super::probe::{Fate, Probe};
use crate::domain::Location;
use crate::random::{fill_unit, stream};
use crate::sampler::Preimage;
use std::collections::HashMap;
use std::ops::Range;

const PLACES: usize = 384;
/// A sampler that is slow to answer is asked at fewer places, from fewer starts.
const SLOWER: usize = 6;
const LATTICE: f64 = 1_048_576.0;
/// Variates keep this far from 0 and 1, for the differences to have room.
const ROOM: f64 = 1.0 / 64.0;
const LARGEST_STEP: f64 = 1.0 / 32.0;
const STEPS: usize = 28;
/// Rounding of an `f32` point, relative to its size: a last place or two, and 1.5 of those in a difference.
const ROUNDING: f64 = 2e-7;
/// A place answers if the relative error of its identity is below this.
const ACCURATE: f64 = 0.01;
/// Relative difference that is no rounding of an `f32` density.
const TOLERANCE: f64 = 5e-4;
/// Fewer answers than this say nothing.
const ENOUGH: usize = 16;
/// This share of the answers, and this many, must be wrong: a kink of the density now and then looks like an error.
const WRONG_SHARE: f64 = 0.02;
const WRONG: usize = 3;
/// Samples among which other preimages are looked for.
const BANK: usize = 1 << 15;
/// At so many places they are looked for though all seems well.
const LOOKED_AT: usize = 24;

pub(super) struct JacobianIdentity;

impl Check for JacobianIdentity {
    fn name(&self) -> &'static str {
        "jacobian"
    }

    fn about(&self) -> &'static str {
        "density x |det d point / d xi| = 1, point by point"
    }

    fn rests(&self) -> Rests {
        Rests::NoCounts
    }

    fn needs(&self) -> Needs {
        Needs::Variates
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let probe = case.probe;
        let (axes, dimensions) = (probe.space().axes(), probe.dimensions());
        if axes == 0 || dimensions < axes {
            return Vec::new();
        }
        let mut rng = stream(case.settings.seed, "jacobian", 0);
        let mut xi = vec![0.0; dimensions];
        let (mut errors, mut unsettled, mut wrong) = (Vec::new(), 0_usize, Vec::new());
        let mut bank = None;
        for _ in 0..if probe.is_slow() { PLACES / SLOWER } else { PLACES } {
            fill_unit(&mut rng, &mut xi);
            xi.iter_mut().for_each(|x| *x = (LATTICE * (ROOM + (1.0 - 2.0 * ROOM) * *x)).floor() / LATTICE);
            let Some(look) = probe.look(&xi) else { continue };
            let Ok(location) = look.location else { continue };
            if probe.space().is_atom(location.patch) || !(look.asked > 0.0) {
                continue;
            }
            match identity(probe, case.expectation, &xi, &location, look.asked, &mut bank) {
                Answer::Unlisted => return Vec::new(),
                Answer::Unsettled => unsettled += 1,
                Answer::Product { value, error } => {
                    errors.push(error);
                    let [low, high] = look.range.map(|density| value * density / look.asked - 1.0);
                    if low.max(-high) > TOLERANCE + 3.0 * error {
                        wrong.push((value, look.point, xi.clone()));
                    }
                }
            }
        }
        let answered = errors.len();
        let skipped = match unsettled {
            1 => "1 place skipped, where differences don't settle".to_owned(),
            _ => format!("{unsettled} places skipped, where differences don't settle"),
        };
        if answered < ENOUGH {
            let detail = format!("only {answered} places answer; {skipped}");
            return vec![Finding::new(self.name(), Evidence::Unanswered, detail)];
        }
        errors.sort_by(f64::total_cmp);
        let limit = WRONG.max((WRONG_SHARE * answered as f64).ceil() as usize);
        // The middle one says more than the largest.
        wrong.sort_by(|a, b| a.0.total_cmp(&b.0));
        let finding = match wrong.get(wrong.len() / 2) {
            Some((value, point, xi)) if wrong.len() >= limit => Finding::certain(
                self.name(),
                Verdict::Fail,
                format!(
                    "density x |det d point / d xi| is not 1 at {} of {answered} places; its median there is {value:.5}, at {point} (xi = {xi:?}); {skipped}",
                    wrong.len()
                ),
            ),
            _ => Finding::certain(
                self.name(),
                Verdict::Pass,
                format!("density x |det d point / d xi| = 1 at {answered} places; {skipped}"),
            ),
        };
        // So many places must be hit with probability 0.99: a Poisson count of mean m + 2.33 sqrt(m) + 2 reaches m.
        let mean = limit as f64 + 2.33 * (limit as f64).sqrt() + 2.0;
        let (error, share) = (TOLERANCE + 3.0 * errors[answered / 2], (mean / answered as f64).min(1.0));
        vec![
            finding
                .sees(format!("a relative error of {error:.1e} over {:.1}% of the variates", 100.0 * share)),
        ]
    }
}

enum Answer {
    /// The sampler takes more variates than there are axes, and doesn't say which of them select.
    Unlisted,
    /// No step is small enough for truncation and large enough for rounding.
    Unsettled,
    Product {
        value: f64,
        error: f64,
    },
}

fn identity(
    probe: &dyn Probe,
    expectation: &Expectation,
    xi: &[f64],
    location: &Location,
    density: f64,
    bank: &mut Option<Bank>,
) -> Answer {
    let axes = probe.space().axes();
    if let Some(preimages) = probe.preimages(xi) {
        return sum(probe, density, &preimages);
    }
    if probe.dimensions() != axes {
        return Answer::Unlisted;
    }
    let here = Preimage { xi: xi.to_vec(), selecting: 0, weight: 1.0 };
    let answer = sum(probe, density, std::slice::from_ref(&here));
    let Answer::Product { value, error } = answer else { return answer };
    let fits = (value - 1.0).abs() <= TOLERANCE + 3.0 * error;
    if fits && bank.as_ref().is_some_and(|bank| bank.asked >= LOOKED_AT) {
        return answer;
    }
    // Before anything is called wrong, and at some places before it is called right: do other variates lead here?
    let bank = bank.get_or_insert_with(|| Bank::new(probe, expectation));
    match bank.others(probe, expectation, xi, location) {
        Some(others) if others.is_empty() => answer,
        Some(mut others) => {
            others.push(here);
            sum(probe, density, &others)
        }
        None if fits => answer,
        None => Answer::Unsettled,
    }
}

/// density / (sum of weight / |det|).
fn sum(probe: &dyn Probe, density: f64, preimages: &[Preimage]) -> Answer {
    let (mut total, mut total_error) = (0.0, 0.0);
    for preimage in preimages {
        let Some((determinant, error)) = determinant(probe, &preimage.xi, preimage.selecting) else {
            return Answer::Unsettled;
        };
        let part = preimage.weight / determinant;
        total += part;
        total_error += part * error;
    }
    let error = total_error / total;
    if !(error <= ACCURATE) {
        return Answer::Unsettled;
    }
    Answer::Product { value: density / total, error }
}

/// |det d point / d xi| over the variates behind the selecting ones, and its relative error.
fn determinant(probe: &dyn Probe, xi: &[f64], selecting: usize) -> Option<(f64, f64)> {
    let axes = probe.space().axes();
    let room = xi[selecting..selecting + axes].iter().fold(1.0_f64, |room, &x| room.min(x).min(1.0 - x));
    let size = probe.magnitude(xi);
    let differentiate = |step: f64| Difference::new(probe, xi, selecting, axes, step);
    let mut step = LARGEST_STEP;
    let (mut last, mut last_bend): ([Option<f64>; 2], f64) = ([None; 2], f64::INFINITY);
    let mut best: Option<(f64, f64, f64)> = None;
    for _ in 0..STEPS {
        if 2.0 * step < room {
            let now = differentiate(step);
            let rounding = now.as_ref().map_or(f64::INFINITY, |now| now.rounding(ROUNDING * size));
            let bend = now.as_ref().map_or(f64::INFINITY, |now| now.bend);
            let value = now.map(|now| now.determinant());
            if let ([Some(older), Some(old)], Some(now)) = (last, value) {
                let error = (older - old).abs().max((old - now).abs()) / old.abs() + rounding + last_bend;
                if best.is_none_or(|(.., least)| error < least) {
                    best = Some((2.0 * step, old, error));
                }
                if rounding > ACCURATE {
                    break; // and it only grows
                }
            }
            (last, last_bend) = ([last[1], value], bend);
        }
        step *= 0.5;
    }
    let (step, value, error) = best?;
    // Steps of other lengths must agree: over jumps, three halvings agree by accident now and then, and a comb may keep step with them.
    let mut worst = error;
    for factor in [0.83, 0.71, 0.59] {
        let other = differentiate(factor * step)?;
        worst = worst.max((other.determinant() - value).abs() / value.abs()).max(other.bend);
        worst = worst.max(bend_between(probe, xi, selecting, axes, factor * step)?);
    }
    (value != 0.0 && worst <= ACCURATE).then(|| (value.abs(), worst))
}

/// How far the density is from a straight line between the sample and those a step away: a density that vanishes between the points that are drawn
/// (a comb) bends nowhere else.
fn bend_between(probe: &dyn Probe, xi: &[f64], selecting: usize, axes: usize, step: f64) -> Option<f64> {
    const PARTS: [f64; 3] = [0.27, 0.61, 0.83];
    let stencil = stencil(xi, selecting..selecting + axes, |x| [x - step, x + step]);
    let densities: Vec<f64> =
        probe.displacements(xi, &stencil)?.into_iter().map(|(_, density)| density).collect();
    let (here, around) = densities.split_first()?;
    let mut bend = 0.0_f64;
    // The first of the stencil is the place itself.
    for (moved, there) in stencil.chunks_exact(xi.len()).skip(1).zip(around) {
        for (part, between) in PARTS.into_iter().zip(probe.densities_between(xi, moved, &PARTS)?) {
            bend = bend.max((between - (here + part * (there - here))).abs() / here);
        }
    }
    Some(bend)
}

/// Sets of variates, one after another: `xi` itself, then for each of some variates `xi` with that one at each of the places that `moved` gives for it.
fn stencil<const N: usize>(xi: &[f64], variates: Range<usize>, moved: impl Fn(f64) -> [f64; N]) -> Vec<f64> {
    let mut all = xi.to_vec();
    for variate in variates {
        for place in moved(xi[variate]) {
            all.extend_from_slice(xi);
            let at = all.len() - xi.len() + variate;
            all[at] = place;
        }
    }
    all
}

/// Central differences at one step.
struct Difference {
    /// Derivatives of the displacement by each variate.
    columns: [[f64; 2]; 2],
    axes: usize,
    step: f64,
    /// How far the density is from a straight line across the step, relative to itself: small unless it jumps.
    bend: f64,
}

impl Difference {
    fn new(probe: &dyn Probe, xi: &[f64], selecting: usize, axes: usize, step: f64) -> Option<Self> {
        let (mut columns, mut bend) = ([[0.0; 2]; 2], 0.0_f64);
        let four = |x| [x + step, x - step, x + 2.0 * step, x - 2.0 * step];
        let stencil = stencil(xi, selecting..selecting + axes, four);
        let all = probe.displacements(xi, &stencil)?;
        let ((_, here), around) = all.split_first()?;
        for (column, four) in columns.iter_mut().zip(around.as_chunks::<4>().0) {
            let [(near, a), (back, b), (far, c), (far_back, d)] = four;
            bend = bend.max((a + b - 2.0 * here).abs().max((c + d - 2.0 * here).abs()) / here);
            for i in 0..2 {
                column[i] = (8.0 * (near[i] - back[i]) - (far[i] - far_back[i])) / (12.0 * step);
            }
        }
        let found = Self { columns, axes, step, bend };
        found.determinant().is_finite().then_some(found)
    }

    fn determinant(&self) -> f64 {
        let [a, b] = self.columns;
        if self.axes == 1 { a[0] } else { a[0] * b[1] - a[1] * b[0] }
    }

    /// The relative error of the determinant if points are rounded by `rounding`.
    fn rounding(&self, rounding: f64) -> f64 {
        let [a, b] = self.columns.map(|[x, y]| x.hypot(y));
        let lengths = if self.axes == 1 { 1.0 } else { a + b };
        rounding * lengths / (self.step * self.determinant().abs())
    }
}

/// Samples by the leaf that they fall into, to look for other preimages of a point.
struct Bank {
    in_leaf: HashMap<usize, Vec<Vec<f64>>>,
    /// How often it was asked.
    asked: usize,
}

impl Bank {
    fn new(probe: &dyn Probe, expectation: &Expectation) -> Self {
        let mut rng = stream(0, "preimages", 0);
        let mut bank: HashMap<usize, Vec<Vec<f64>>> = HashMap::new();
        let dimensions = probe.dimensions();
        let mut xi = vec![0.0; BANK * dimensions];
        fill_unit(&mut rng, &mut xi);
        let (mut draws, mut values) = (Vec::new(), Vec::new());
        probe.draw(&xi, usize::MAX, &mut draws, &mut values);
        for (draw, xi) in draws.iter().zip(xi.chunks_exact(dimensions)).filter(|(d, _)| d.fate == Fate::Drawn)
        {
            bank.entry(expectation.partition.leaf_of(&draw.location)).or_default().push(xi.to_vec());
        }
        Self { in_leaf: bank, asked: 0 }
    }

    /// The other variates that lead to the sample of `xi`; `None` if there may be some that Newton's method can't reach.
    fn others(
        &mut self,
        probe: &dyn Probe,
        expectation: &Expectation,
        xi: &[f64],
        location: &Location,
    ) -> Option<Vec<Preimage>> {
        // Nearer than this, two solutions are one.
        const APART: f64 = 2e-3;
        const STARTS: usize = 64;
        let starts = if probe.is_slow() { STARTS / SLOWER } else { STARTS };
        self.asked += 1;
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > APART);
        let mut found: Vec<Preimage> = Vec::new();
        let mut unclear = false;
        let leaf = expectation.partition.leaf_of(location);
        let near = [leaf, leaf.wrapping_sub(1), leaf + 1];
        for start in near.iter().filter_map(|leaf| self.in_leaf.get(leaf)).flatten().take(starts) {
            if !apart(start, xi) || found.iter().any(|other| !apart(start, &other.xi)) {
                continue;
            }
            match newton(probe, xi, start) {
                Newton::Found(other) if apart(&other, xi) => {
                    if found.iter().all(|known| apart(&other, &known.xi)) {
                        found.push(Preimage { xi: other, selecting: 0, weight: 1.0 });
                    }
                }
                Newton::Found(_) | Newton::Left => {}
                Newton::Lost => unclear = true,
            }
        }
        (!unclear).then_some(found)
    }
}

enum Newton {
    Found(Vec<f64>),
    /// The solution lies outside of the unit cube.
    Left,
    Lost,
}

/// Variates near `start` whose sample is the sample of `target`.
fn newton(probe: &dyn Probe, target: &[f64], start: &[f64]) -> Newton {
    /// A step so short is the end; the rounding of a point in a narrow lobe allows no shorter one.
    const SHORT: f64 = 2e-4;
    const STEPS: usize = 30;
    let axes = probe.space().axes();
    let step = 2.0_f64.powi(-10);
    let ends = |x: f64| [(x + step).min(1.0 - 1e-9), (x - step).max(0.0)];
    let mut xi = start.to_vec();
    for _ in 0..STEPS {
        let Some(all) = probe.displacements(target, &stencil(&xi, 0..axes, ends)) else {
            return Newton::Lost;
        };
        let (miss, mut columns) = (all[0].0, [[0.0; 2]; 2]);
        for ((column, &x), [(a, _), (b, _)]) in columns.iter_mut().zip(&xi).zip(all[1..].as_chunks::<2>().0) {
            let [ahead, behind] = ends(x);
            *column = [0, 1].map(|i| (a[i] - b[i]) / (ahead - behind));
        }
        let [a, b] = columns;
        let move_by = if axes == 1 {
            [-miss[0] / a[0], 0.0]
        } else {
            let determinant = a[0] * b[1] - b[0] * a[1];
            [
                -(miss[0] * b[1] - b[0] * miss[1]) / determinant,
                -(a[0] * miss[1] - miss[0] * a[1]) / determinant,
            ]
        };
        if !move_by.iter().all(|x| x.is_finite()) {
            return Newton::Lost;
        }
        let mut outside = false;
        for axis in 0..axes {
            let wanted = xi[axis] + move_by[axis].clamp(-0.1, 0.1);
            outside |= !(-1e-3..=1.0 + 1e-3).contains(&wanted);
            xi[axis] = wanted.clamp(0.0, 1.0 - 1e-9);
        }
        if outside {
            return Newton::Left;
        }
        if move_by.iter().all(|x| x.abs() < SHORT) {
            return Newton::Found(xi);
        }
    }
    Newton::Lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Integral, Interval, Square};
    use crate::sampler::{Sample, Sampler, from_fn};
    use crate::verify::expectation::told;
    use crate::verify::probe::{Extras, Subject};
    use glam::DVec2;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[track_caller]
    fn near(found: f64, expected: f64, off: f64) {
        assert!((found - expected).abs() <= off, "{found}, not {expected}");
    }

    fn line(
        sample: impl Fn(f64) -> f64 + Sync,
        density: impl Fn(f64) -> f64 + Sync,
    ) -> impl Sampler<Domain = Interval> {
        from_fn(Interval::new(0.0, 1.0), move |u: f64| sample(u), move |x: f64| density(x))
    }

    fn square(sample: impl Fn(f64, f64) -> [f64; 2] + Sync) -> impl Sampler<Domain = Square> {
        from_fn(Square, move |[u, v]: [f64; 2]| DVec2::from(sample(u, v)), |_: DVec2| 1.0)
    }

    /// u^2 (3 - 2 u) of which the derivative is 6 u (1 - u), and a twist.
    fn twisted(u: f64, v: f64) -> [f64; 2] {
        [0.5 * (u * u + v), 0.25 + 0.5 * u * v]
    }

    #[test]
    fn stencils() {
        let all = stencil(&[0.25, 0.5, 0.75], 1..3, |x| [x - 0.125, x + 0.125]);
        let expected = [
            [0.25, 0.5, 0.75],
            [0.25, 0.375, 0.75],
            [0.25, 0.625, 0.75],
            [0.25, 0.5, 0.625],
            [0.25, 0.5, 0.875],
        ];
        assert_eq!(all, expected.concat());
    }

    #[test]
    fn differences_of_fourth_order() {
        let extras = Extras::default();
        // Of fourth powers they are exact.
        let power = line(|u| 0.5 * u.powi(4), |_| 1.0);
        let probe = Subject::new(&power, &extras);
        let found = Difference::new(&probe, &[0.5], 0, 1, 0.125).unwrap();
        near(found.determinant(), 0.25, 1e-15);
        assert_eq!((found.bend, found.axes, found.step), (0.0, 1, 0.125));
        // A last place of 1e-7 in a difference over a step.
        near(found.rounding(1e-7), 1e-7 / (0.125 * 0.25), 1e-18);
        let extras = Extras::default();
        let twist = square(twisted);
        let probe = Subject::new(&twist, &extras);
        let found = Difference::new(&probe, &[0.5, 0.25], 0, 2, 0.0625).unwrap();
        // d (x, y) / d (u, v) = (u, 1/2; v/2, u/2).
        for (column, expected) in found.columns.iter().zip([[0.5, 0.125], [0.5, 0.25]]) {
            column.iter().zip(expected).for_each(|(a, b)| near(*a, b, 1e-14));
        }
        near(found.determinant(), 0.5 * 0.25 - 0.5 * 0.125, 1e-14);
        let lengths = 0.5_f64.hypot(0.125) + 0.5_f64.hypot(0.25);
        near(found.rounding(1e-7), 1e-7 * lengths / (0.0625 * 0.0625), 1e-18);
        // Out of the domain there is none.
        assert!(Difference::new(&probe, &[0.5, 0.25], 0, 2, 0.5).is_none());
    }

    #[test]
    fn densities_that_bend() {
        let extras = Extras::default();
        let bend = |density: fn(f64) -> f64| {
            let sampler = line(|u| u, density);
            Difference::new(&Subject::new(&sampler, &extras), &[0.5], 0, 1, 0.125).unwrap().bend
        };
        assert_eq!((bend(|x| x), bend(|_| 3.0)), (0.0, 0.0));
        // A parabola: (0.0625 over two steps, 0.015625 over one) twice, over 1/4.
        near(bend(|x| x * x), 2.0 * 0.0625 / 0.25, 1e-12);
        near(bend(|x| if (0.2..=0.8).contains(&x) { 1.0 } else { 1.5 }), 0.0, 1e-12);
        near(bend(|x| if x < 0.3 { 0.5 } else { 1.0 }), 0.5, 1e-12);
        near(bend(|x| if x > 0.6 { 1.25 } else { 1.0 }), 0.25, 1e-12);
        near(bend(|x| if (0.6..0.7).contains(&x) { 1.25 } else { 1.0 }), 0.25, 1e-12);
        // Between the points, at 27%, 61% and 83% of the way to either side.
        let between = |density: fn(f64) -> f64| {
            let sampler = line(|u| u, density);
            bend_between(&Subject::new(&sampler, &extras), &[0.5], 0, 1, 0.125).unwrap()
        };
        assert_eq!(between(|_| 2.0), 0.0);
        near(between(|x| 1.0 + x), 0.0, 1e-12);
        near(between(|x| if (0.57..0.58).contains(&x) { 5.0 } else { 2.0 }), 1.5, 1e-12);
        near(between(|x| if (0.46..0.47).contains(&x) { 5.0 } else { 2.0 }), 1.5, 1e-12);
        near(between(|x| if (0.6..0.61).contains(&x) { 1.0 } else { 2.0 }), 0.5, 1e-12);
        near(between(|x| if x > 0.6 { 3.0 } else { 2.0 }), 0.5 * 0.61, 1e-12);
    }

    #[test]
    fn determinants_settle() {
        let extras = Extras::default();
        let of = |sample: fn(f64) -> f64, xi: f64| {
            let sampler = line(sample, |_| 1.0);
            determinant(&Subject::new(&sampler, &extras), &[xi], 0)
        };
        for (sample, derivative) in [
            (f64::sqrt as fn(f64) -> f64, 0.5 / 0.3_f64.sqrt()),
            (|u| 1.0 - u * u, 0.6),
            (|u| 0.5 + 0.4 * (3.0 * u).sin(), 1.2 * 0.9_f64.cos()),
        ] {
            let (value, error) = of(sample, 0.3).unwrap();
            near(value, derivative, error * derivative);
            assert!(error < 1e-4, "{error}");
        }
        // No slope at all, and steps that are all jumps, don't.
        assert!(of(|_| 0.5, 0.3).is_none());
        assert!(of(|u| (u * 64.0).floor() / 64.0, 0.3).is_none());
        // Near an end there is room for shorter steps only.
        let (value, error) = of(|u| u * u, 1.0 / 64.0).unwrap();
        near(value, 1.0 / 32.0, error / 32.0);
        let within = |u: f64| {
            assert!((0.0..1.0).contains(&u), "asked at {u}");
            u * u
        };
        let (value, error) = of(within, 63.0 / 64.0).unwrap();
        near(value, 63.0 / 32.0, error * value);
        // A density that jumps an eightieth away leaves shorter steps.
        let jumping = line(|u| u, |x| if (x - 0.3).abs() < 0.0125 { 1.0 } else { 1.5 });
        let (value, error) = determinant(&Subject::new(&jumping, &extras), &[0.3], 0).unwrap();
        near(value, 1.0, error);
        // Errors are relative, on whatever scale.
        let long = from_fn(Interval::new(0.0, 1e9), |u: f64| 1e9 * u.sqrt(), |_: f64| 1.0);
        let (value, error) = determinant(&Subject::new(&long, &extras), &[0.3], 0).unwrap();
        near(value, 5e8 / 0.3_f64.sqrt(), error * value);
        assert!(error < 1e-4, "{error}");
        // Behind one that selects.
        let selecting = from_fn(
            Interval::new(0.0, 1.0),
            |[s, u]: [f64; 2]| if s < 0.5 { 0.5 * u } else { 0.5 + 0.5 * u * u },
            |_: f64| 1.0,
        );
        let probe = Subject::new(&selecting, &extras);
        near(determinant(&probe, &[0.25, 0.3], 1).unwrap().0, 0.5, 1e-5);
        near(determinant(&probe, &[0.75, 0.3], 1).unwrap().0, 0.3, 1e-5);
    }

    #[test]
    fn preimages_add_up() {
        let extras = Extras::default();
        let sampler = line(|u| u * u, |_| 1.0);
        let probe = Subject::new(&sampler, &extras);
        let at = |xi: f64, weight: f64| Preimage { xi: vec![xi], selecting: 0, weight };
        // Slopes of 1/2 and 1: a density of 2 + 1, or of 1/2 + 3/4.
        let product = |density: f64, preimages: &[Preimage]| match sum(&probe, density, preimages) {
            Answer::Product { value, error } => (value, error),
            _ => panic!("unsettled"),
        };
        near(product(3.0, &[at(0.25, 1.0), at(0.5, 1.0)]).0, 1.0, 1e-5);
        near(product(1.25, &[at(0.25, 0.25), at(0.5, 0.75)]).0, 1.0, 1e-5);
        let ([one, other], both) = (
            [0.25, 0.5].map(|xi| determinant(&probe, &[xi], 0).unwrap().1),
            product(1.0, &[at(0.25, 1.0), at(0.5, 1.0)]).1,
        );
        near(both, (2.0 * one + other) / 3.0, 1e-6 * both);
        let flat = line(|u| if u < 0.4 { u } else { 0.4 }, |_| 1.0);
        let probe = Subject::new(&flat, &extras);
        assert!(matches!(sum(&probe, 1.0, &[at(0.25, 1.0), at(0.7, 1.0)]), Answer::Unsettled));
    }

    #[test]
    fn newton_finds_what_leads_there() {
        let extras = Extras::default();
        let found = |probe: &dyn Probe, target: &[f64], start: &[f64]| match newton(probe, target, start) {
            Newton::Found(xi) => Ok(xi),
            Newton::Left => Err("left"),
            Newton::Lost => Err("lost"),
        };
        let tent = line(|u| if u < 0.5 { 2.0 * u } else { 2.0 - 2.0 * u }, |_| 1.0);
        let probe = Subject::new(&tent, &extras);
        near(found(&probe, &[0.3], &[0.6]).unwrap()[0], 0.7, 2e-4);
        near(found(&probe, &[0.3], &[0.95]).unwrap()[0], 0.7, 2e-4);
        near(found(&probe, &[0.3], &[0.05]).unwrap()[0], 0.3, 2e-4);
        let curved = line(|u| u * u, |_| 1.0);
        let probe = Subject::new(&curved, &extras);
        near(found(&probe, &[0.3], &[0.9]).unwrap()[0], 0.3, 1e-4);
        // What lies past the end is left, what has no slope is lost.
        let half = line(|u| if u < 0.5 { u } else { 0.25 * u + 0.1 }, |_| 1.0);
        let probe = Subject::new(&half, &extras);
        assert_eq!(found(&probe, &[0.45], &[0.8]), Err("left"));
        let flat = line(|u| if u < 0.5 { u } else { 0.25 }, |_| 1.0);
        let probe = Subject::new(&flat, &extras);
        assert_eq!(found(&probe, &[0.1], &[0.8]), Err("lost"));
        let extras = Extras::default();
        let twist = square(twisted);
        let probe = Subject::new(&twist, &extras);
        let xi = found(&probe, &[0.7, 0.2], &[0.6, 0.35]).unwrap();
        near(xi[0], 0.7, 2e-4);
        near(xi[1], 0.2, 2e-4);
        // A quarter turn, in which either variate moves the other coordinate alone.
        let turned = square(|u, v| [0.1 + 0.8 * v, 0.9 - 0.8 * u]);
        let probe = Subject::new(&turned, &extras);
        let xi = found(&probe, &[0.3, 0.6], &[0.7, 0.2]).unwrap();
        near(xi[0], 0.3, 2e-4);
        near(xi[1], 0.6, 2e-4);
        // Past the ends of both.
        let corner = square(|u, v| {
            let flat = |x: f64| 0.25 * x + 0.1;
            if u < 0.5 && v < 0.5 { [u, v] } else { [flat(u), flat(v)] }
        });
        assert_eq!(found(&Subject::new(&corner, &extras), &[0.45, 0.45], &[0.8, 0.8]), Err("left"));
        // A thousandth past an end is at it, and less than that before it is no end.
        let plain = line(|u| u, |_| 1.0);
        let extras = Extras::default();
        let probe = Subject::new(&plain, &extras);
        near(found(&probe, &[0.0005], &[0.05]).unwrap()[0], 0.0005, 2e-4);
        near(found(&probe, &[0.9995], &[0.95]).unwrap()[0], 0.9995, 2e-4);
        // A variate is below 1, where a step leads a little farther too.
        let convex = line(
            |u| {
                assert!((0.0..1.0).contains(&u), "asked at {u}");
                u * u
            },
            |_| 1.0,
        );
        near(found(&Subject::new(&convex, &extras), &[0.9995], &[0.95]).unwrap()[0], 0.9995, 2e-4);
    }

    /// Up to a half and back, as fast as is told of; its calls are counted.
    #[derive(Default)]
    struct Tent {
        is_slow: bool,
        calls: AtomicUsize,
    }

    impl Sampler for Tent {
        type Domain = Interval;
        fn domain(&self) -> Interval {
            Interval::new(0.0, 1.0)
        }
        fn dimensions(&self) -> usize {
            1
        }
        fn sample(&self, xi: &[f64]) -> Option<Sample<f64>> {
            self.calls.fetch_add(1, Ordering::Relaxed);
            Some(Sample { point: 1.0 - (2.0 * xi[0] - 1.0).abs(), density: 1.0 })
        }
        fn density(&self, _: &f64) -> f64 {
            1.0
        }
        fn is_slow(&self) -> bool {
            self.is_slow
        }
    }

    /// What others are found for 0.3, which leads to 0.6 in the third of four leaves, from starts in one of them; and with how many samples.
    fn others(is_slow: bool, leaf: usize, starts: Vec<f64>) -> (Vec<f64>, usize) {
        let (tent, extras) = (Tent { is_slow, ..Tent::default() }, Extras::default());
        let expectation = told::expectation(&tent.domain(), [Integral::default(); 4], vec![]);
        let starts = starts.into_iter().map(|start| vec![start]).collect();
        let mut bank = Bank { in_leaf: HashMap::from([(leaf, starts)]), asked: 0 };
        let location = Location { patch: 0, at: [0.6, 0.0] };
        let found = bank.others(&Subject::new(&tent, &extras), &expectation, &[0.3], &location).unwrap();
        assert_eq!(bank.asked, 1);
        (found.into_iter().map(|other| other.xi[0]).collect(), tent.calls.into_inner())
    }

    #[test]
    fn where_others_are_looked_for() {
        // In the leaf, before it and behind it, but no farther.
        for leaf in 0..4 {
            let (found, _) = others(false, leaf, vec![0.31, 0.64, 0.66]);
            assert_eq!(found.len(), usize::from(leaf > 0));
            found.iter().for_each(|&other| near(other, 0.7, 2e-4));
        }
        // From 64 starts, or from 10 if it is slow.
        let starts: Vec<f64> = (0..200).map(|i| 0.31 + 0.0001 * f64::from(i)).collect();
        let calls = |is_slow: bool| others(is_slow, 2, starts.clone()).1;
        let of_one = others(false, 2, starts[..1].to_vec()).1;
        assert_eq!((calls(false), calls(true)), (64 * of_one, 10 * of_one));
    }

    /// Where there may be others that can't be reached, what fits is right, and what doesn't says nothing.
    #[test]
    fn others_that_can_not_be_reached() {
        let answer = |density: f64| {
            let (flat, extras) =
                (line(|u| if u < 0.5 { u } else { 0.25 }, move |_| density), Extras::default());
            let expectation = told::expectation(&flat.domain(), [Integral::default(); 4], vec![]);
            let mut bank = Some(Bank { in_leaf: HashMap::from([(0, vec![vec![0.8]])]), asked: 0 });
            let location = Location { patch: 0, at: [0.1, 0.0] };
            identity(&Subject::new(&flat, &extras), &expectation, &[0.1], &location, density, &mut bank)
        };
        let Answer::Product { value, .. } = answer(1.0) else { panic!("no answer") };
        near(value, 1.0, 1e-6);
        assert!(matches!(answer(1.1), Answer::Unsettled) && matches!(answer(0.9), Answer::Unsettled));
    }

    /// Near 100 an `f32` point is rounded by 2e-5, which is 1/1600 of a step of 1/32 and more of shorter ones: as much is no error of the density.
    #[test]
    fn roundings_of_points_are_forgiven() {
        let answer = |density: f64| {
            let (far, extras) = (Interval::new(100.0, 101.0), Extras::default());
            let sampler =
                from_fn(far, |u: f64| 100.0 + if u < 0.5 { u } else { 0.25 }, move |_: f64| density);
            let probe = Subject::new(&sampler, &extras);
            let (value, error) = determinant(&probe, &[0.1], 0).unwrap();
            assert!((value - 1.0).abs() < 1e-9 && (1.0 / 1600.0..0.01).contains(&error), "{value} {error}");
            let expectation = told::expectation(&far, [Integral::default(); 4], vec![]);
            let mut bank = Some(Bank { in_leaf: HashMap::from([(0, vec![vec![0.8]])]), asked: 0 });
            let location = Location { patch: 0, at: [0.1, 0.0] };
            identity(&probe, &expectation, &[0.1], &location, density, &mut bank)
        };
        for density in [1.0, 1.002, 0.998] {
            let Answer::Product { value, .. } = answer(density) else { panic!("no answer") };
            near(value, density, 1e-6);
        }
        assert!(matches!(answer(1.1), Answer::Unsettled) && matches!(answer(0.9), Answer::Unsettled));
    }

    /// Others are looked for at some places though all is well, and wherever it isn't.
    #[test]
    fn when_others_are_looked_for() {
        let looked = |density: f64, before: usize| {
            let (sampler, extras) = (line(|u| u, move |_| density), Extras::default());
            let expectation = told::expectation(&sampler.domain(), [Integral::default(); 4], vec![]);
            let mut bank = Some(Bank { in_leaf: HashMap::new(), asked: before });
            let location = Location { patch: 0, at: [0.3, 0.0] };
            let probe = Subject::new(&sampler, &extras);
            let Answer::Product { value, .. } =
                identity(&probe, &expectation, &[0.3], &location, density, &mut bank)
            else {
                panic!("no answer");
            };
            near(value, density, 1e-6);
            bank.unwrap().asked - before
        };
        // Five ten-thousandths are forgiven.
        for density in [1.0, 1.0004, 0.9996] {
            assert_eq!((looked(density, LOOKED_AT - 1), looked(density, LOOKED_AT)), (1, 0));
        }
        assert_eq!((looked(1.001, LOOKED_AT), looked(0.999, LOOKED_AT)), (1, 1));
    }
}
