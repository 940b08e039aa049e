//! A scan by windows: is there a place, wherever its borders lie, that gets too many or too few samples?
//!
//! Cells see an error well if it fills them. Here windows slide: about each of some hundred centres, the cells nearest to it up to a half, a quarter, … of a
//! percent of the mass, overlapping freely (Kulldorff, "A spatial scan statistic", Commun. Statist. 26, 1997). They are chosen by the expected masses alone.
//! The window with the smallest binomial p-value counts, times the number of windows: each size has the same part of the level, and the centres share it.

use super::check::{Case, Check, Needs, Rests};
use super::finding::{Evidence, Finding};
use super::goodness::{Count, observed, surprise};
use crate::domain::{Cell, Location, Space};
use crate::statistics::normal;

/// What windows are put together from: cells of this part of the mass.
pub(super) const PIECES: f64 = 512.0;
const CENTRES: usize = 256;
/// Sizes of windows: 2^-2 to 2^-8 of the mass.
const SIZES: std::ops::RangeInclusive<i32> = 2..=8;
/// A window expects this many samples at least.
const ENOUGH: f64 = 50.0;

pub(super) struct Scan;

impl Check for Scan {
    fn name(&self) -> &'static str {
        "scan"
    }

    fn about(&self) -> &'static str {
        "overlapping windows of 1/4 to 1/256 of the mass: the one whose count is least likely"
    }

    fn rests(&self) -> Rests {
        Rests::ExpectedCounts
    }

    fn needs(&self) -> Needs {
        Needs::Density
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        scan(self.name(), case).into_iter().collect()
    }
}

struct Window {
    centre: usize,
    size: i32,
    count: Count,
    surprise: f64,
}

fn scan(check: &'static str, case: &Case<'_>) -> Option<Finding> {
    let (expectation, tally, space) = (case.expectation, case.tally, case.probe.space());
    let n = tally.samples as f64;
    if !(expectation.total.value.is_finite() && expectation.total.error.is_finite()) {
        return None;
    }
    let pieces = expectation.partition.group(&expectation.masses(), 1.0 / PIECES, 0.0);
    if pieces.cells.len() < 16 {
        return None;
    }
    let (masses, _) = expectation.masses_at(&pieces);
    let (counts, _) = observed(&pieces, tally);
    let counts: Vec<Count> = counts.iter().zip(masses).map(|(&o, m)| Count::new(o, m)).collect();
    let places: Vec<[f64; 3]> = pieces.cells.iter().map(|cell| middle(space, cell)).collect();
    let step = counts.len().div_ceil(CENTRES);
    let centres: Vec<usize> = (0..counts.len()).step_by(step).collect();
    let total: f64 = counts.iter().map(|c| c.mass).sum();
    let least = |about: usize| -> Option<Window> {
        let centre = places[about];
        let mut order: Vec<(f64, usize)> = (places.iter().enumerate())
            .map(|(i, place)| ((0..3).map(|k| (place[k] - centre[k]).powi(2)).sum::<f64>(), i))
            .collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut windows = SIZES.rev().map(|size| (size, total * 2.0_f64.powi(-size))).peekable();
        let (mut inside, mut best) = (Count::default(), None::<Window>);
        for (_, piece) in order {
            inside.observed += counts[piece].observed;
            inside.mass += counts[piece].mass;
            inside.error += counts[piece].error;
            // One heavy piece may reach over several sizes.
            while let Some(&(size, target)) = windows.peek() {
                if inside.mass < target {
                    break;
                }
                windows.next();
                let surprise = surprise(&inside, n);
                // Of windows with the same pieces the largest, which they fill.
                if inside.mass * n >= ENOUGH && best.as_ref().is_none_or(|b| surprise >= b.surprise) {
                    best = Some(Window { centre: about, size, count: inside, surprise });
                }
            }
        }
        best
    };
    let windows = crate::parallel::map(centres.len(), |i| least(centres[i]));
    let worst = windows.into_iter().flatten().max_by(|a, b| a.surprise.total_cmp(&b.surprise))?;
    let tests = (centres.len() * SIZES.count()) as f64;
    let mut finding = super::goodness::exact("", worst.count, tally.samples);
    if let Evidence::Chance { p, conservative } = &mut finding.evidence {
        for p in [p, conservative] {
            *p = (*p * tests).min(1.0);
        }
    }
    finding.check = check;
    finding.detail = format!(
        "{} in 1/{} of the mass about {}; the worst of {tests} windows",
        finding.detail,
        1 << worst.size,
        space.describe(&pieces.cells[worst.centre])
    );
    let error = detectable(0.05, n, 1e-4 / tests);
    Some(finding.sees(format!("a relative error of {:.2}% over 5% of the mass in one piece", 100.0 * error)))
}

/// The relative error over a compact `mass` that some window shows with probability 0.99 at this level.
///
/// A window of a third of the region's mass or less fits inside wherever the region lies; one up to its own size covers it to 85% (a disk of equal area on a
/// square whose centre is off by half a step of the centres).
pub(super) fn detectable(mass: f64, n: f64, level: f64) -> f64 {
    let critical = normal::isf((0.5 * level).max(1e-300)).unwrap_or(f64::INFINITY);
    let needed = critical + 2.33;
    SIZES
        .map(|size| 2.0_f64.powi(-size))
        .filter(|window| window * n >= ENOUGH && *window <= mass)
        .map(|window| {
            let inside = if 3.0 * window <= mass { 1.0 } else { 0.85 };
            // What is too much inside is too little outside.
            let contrast = (inside - mass) / (1.0 - mass);
            needed * (1.0 - window).sqrt() / (contrast * (n * window).sqrt())
        })
        .fold(f64::INFINITY, f64::min)
}

/// Number of windows, at most.
pub(super) fn tests() -> f64 {
    (CENTRES * SIZES.count()) as f64
}

/// A point in the middle of a cell, in coordinates in which distances make sense.
fn middle(space: &dyn Space, cell: &Cell) -> [f64; 3] {
    let at = [0, 1].map(|axis| 0.5 * (cell.low[axis] + cell.high[axis]));
    let patch = (cell.patches.start + cell.patches.end.max(1) - 1) / 2;
    space.embed(&Location { patch, at })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Discrete, Domain, Sphere};
    use crate::sampler::from_fn;
    use crate::verify::expectation::Expectation;
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;
    use crate::verify::tally::Tally;

    /// The error of a window is that of all its cells, and one that nobody knows leaves nothing to look for.
    #[test]
    fn errors_of_windows() {
        let sampler = from_fn(Discrete::new(32), |u: f64| (32.0 * u) as usize, |_: usize| 1.0 / 32.0);
        let extras = Extras::default();
        let (probe, settings) = (Subject::new(&sampler, &extras), Settings::default());
        let mut expectation = Expectation::new(&probe, 1, 2240);
        expectation.leaves.iter_mut().for_each(|leaf| leaf.error = 0.001);
        let per_leaf = (0..32).map(|i| if i < 8 { 91 } else { 63 }).collect();
        let tally = Tally { samples: 2240, per_leaf, ..Tally::default() };
        let of = |expectation: &Expectation| {
            Scan.run(&Case { probe: &probe, expectation, tally: &tally, settings: &settings }).pop()
        };
        // Eight of 2.24 samples each.
        let finding = of(&expectation).unwrap();
        let counts = "728 samples where 560.000 +- 1.8e1 were expected (exact binomial) in 1/4 of the mass";
        assert!(finding.detail.starts_with(counts), "{}", finding.detail);
        let (p, conservative) = finding.evidence.p_values().unwrap();
        let tail = |mass: f64| 32.0 * 7.0 * crate::statistics::binomial::two_sided(728, 2240, mass).unwrap();
        assert!((p / tail(0.25) - 1.0).abs() < 1e-6 && (conservative / tail(0.258) - 1.0).abs() < 1e-6);
        expectation.total.error = f64::INFINITY;
        assert!(of(&expectation).is_none());
    }

    /// The critical value and 2.33 more, in standard deviations of the count of the window that sees most.
    #[test]
    fn errors_that_windows_see() {
        let needed = normal::isf(0.0005).unwrap() + 2.33;
        // Of 80% of the mass a window of a quarter lies inside; of 60% one of an eighth does, and of a quarter its own size sees more than a third of it.
        for (mass, window, inside) in [(0.8_f64, 0.25_f64, 1.0), (0.6, 0.125, 1.0), (0.25, 0.25, 0.85)] {
            let contrast = (inside - mass) / (1.0 - mass);
            let expected = needed * ((1.0 - window) / (1e6 * window)).sqrt() / contrast;
            let found = detectable(mass, 1e6, 1e-3);
            assert!((found / expected - 1.0).abs() < 1e-12, "{mass}: {found}, not {expected}");
        }
        // Of a thousand samples a 16th is the smallest window to expect fifty, and of 3% of the mass none is small enough.
        assert_eq!(detectable(0.03, 1e3, 1e-3), f64::INFINITY);
    }

    #[test]
    fn middles_of_cells() {
        let octant = Cell { patches: 0..1, low: [0.25, 0.5], high: [0.75, 0.75] };
        let expected = Sphere.point(0, [0.5, 0.625]).0;
        let found = middle(&Sphere, &octant);
        assert!(found.iter().zip(expected.to_array()).all(|(a, b)| (a - b).abs() < 1e-15), "{found:?}");
        // Of some entries the one in the middle, or before it.
        let entries =
            |patches| middle(&Discrete::new(9), &Cell { patches, low: [0.0; 2], high: [1.0; 2] })[0];
        assert_eq!((entries(0..1), entries(3..6), entries(3..7), entries(8..9)), (0.0, 8.0, 8.0, 16.0));
    }
}
