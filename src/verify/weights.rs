//! E[1 / density] over a cell is the cell's measure: a test of pairs (point, density) that needs no integral of the density.
//!
//! E[1{x in C} / p(x)] = integral over C of p / p = measure of C wherever p > 0 on C. Its tails can be heavy: over a sphere, the plain mean of 2e5
//! weights of a lobe of kappa 10 comes out 40% low, because the directions that carry the weight are never drawn. So it is asked only of cells whose
//! largest possible weight, from the density at places in them and not from the judged samples, is small against the sum of squares; the others stay
//! unanswered. The p-value is the normal tail times exp(|gamma| z^3 / 3), the leading term of Cramér's series of a mean over its own standard error, for
//! the skewness that those weights allow (Wang, Electron. Commun. Probab. 16, 2011), and is corrected over the cells asked.
//!
//! A density that follows its importance f has a nearly constant f / density = r. If its spread over its mean is s at most, P(|r / mean - 1| > k s) <= 1 / k^2
//! (Chebyshev 1867), whatever its tails: the number of samples beyond k s is tested against that by its binomial tail, for several k.
//!
//! The mean of f / density for functions with known integrals is tested alike, and is unanswered where the samples themselves show heavy tails.

use super::check::{Case, Check, Needs, Rests};
use super::finding::{Evidence, Finding, Verdict};
use super::tally::Inverse;
use crate::domain::{Cell, Location};
use crate::random::{fill_unit, stream};
use crate::statistics::{self, Moments, binomial, normal};

/// Samples that a cell must expect to be asked.
const ENOUGH: f64 = 1000.0;
/// The largest weight may hold this share of the sum of squares.
const LARGEST_SHARE: f64 = 1e-2;
/// Weights are inverse `f32` densities.
const ROUNDING: f64 = 1e-6;

pub(super) struct Weights;

impl Check for Weights {
    fn name(&self) -> &'static str {
        "weights"
    }

    fn about(&self) -> &'static str {
        "the mean of 1 / density over a cell is the cell's measure; the mean of f / density is the integral of f"
    }

    fn rests(&self) -> Rests {
        Rests::Counts
    }

    fn needs(&self) -> Needs {
        Needs::Weights
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let mut findings = Vec::new();
        // Entries are counted, wherever their masses can be asked.
        if (case.probe.space().axes() > 0 || !case.probe.has_density()) && case.tally.samples > 0 {
            findings.push(inverse_density(self.name(), case));
        }
        findings.extend(spread(self.name(), case));
        for ((name, integral), moments) in case.probe.known().into_iter().zip(&case.tally.known) {
            findings.push(known_integral(self.name(), name, integral, moments));
        }
        findings
    }
}

/// Where a cell's weights lie: the largest that its density allows; `None` if the density vanishes somewhere in it.
fn largest_weight(case: &Case<'_>, leaf: usize) -> Option<f64> {
    if let Some(&largest) = case.expectation.largest_weights.get(leaf) {
        // Of eight pilots only.
        return (largest > 0.0 && largest.is_finite()).then_some(2.0 * largest);
    }
    let cell: &Cell = &case.expectation.partition.leaves()[leaf];
    if case.expectation.leaves[leaf].zeros > 0 || cell.patches.len() > 16 {
        return None;
    }
    let axes = case.probe.space().axes();
    let along = |axis: usize| -> &[f64] { if axis < axes { &[0.02, 0.26, 0.5, 0.74, 0.98] } else { &[0.5] } };
    let mut places = Vec::new();
    for patch in cell.patches.clone() {
        for &a in along(0) {
            places.extend(along(1).iter().map(|&b| {
                let part = [a, b];
                let at = [0, 1].map(|i| cell.low[i] + part[i] * (cell.high[i] - cell.low[i]));
                Location { patch, at }
            }));
        }
    }
    let mut largest = 0.0_f64;
    let mut densities = Vec::new();
    case.probe.densities_at(&places, &mut densities);
    for (density, _) in densities {
        if !(density > 0.0) {
            return None;
        }
        largest = largest.max(1.0 / density);
    }
    // Between the places the density may be lower yet.
    Some(1.5 * largest)
}

fn inverse_density(check: &'static str, case: &Case<'_>) -> Finding {
    let leaves = case.expectation.leaves.len();
    let limits: Vec<Option<f64>> = crate::parallel::map(leaves, |leaf| largest_weight(case, leaf));
    let (mut asked, mut worst, mut of) = (0_u64, None::<(f64, String, f64)>, 0_u64);
    let (mut share, mut error) = (0.0, 0.0_f64);
    for (i, scale) in case.expectation.coarse.scales.iter().enumerate() {
        for (group, figure) in cells(case, i, &limits) {
            of += 1;
            let Some(figure) = figure else { continue };
            asked += 1;
            if i == 0 {
                share += figure.share;
                error = error.max(figure.relative_error);
            }
            if worst.as_ref().is_none_or(|w| figure.p < w.0) {
                worst = Some((figure.p, case.probe.space().describe(&scale.cells[group]), figure.ratio));
            }
        }
    }
    let Some((p, place, ratio)) = worst else {
        let detail = format!("the weights of all {of} cells have tails too heavy for this many samples");
        return Finding::new(check, Evidence::Unanswered, detail).part("1 / density");
    };
    let p = (p * asked as f64).min(1.0);
    let detail = format!(
        "mean of 1 / density against the measure of {asked} of {of} cells; the worst is {ratio:.5} times it, at {place}"
    );
    let sees = if share > 0.0 {
        format!("a relative error of {:.1}% in any of {:.0}% of the mass", 100.0 * 7.0 * error, 100.0 * share)
    } else {
        String::new()
    };
    Finding::new(check, Evidence::Chance { p, conservative: p }, detail).part("1 / density").sees(sees)
}

/// The mean of 1 / density over the measure, and its error, where that is the same in all cells of the coarsest scale.
pub(super) fn common_ratio(case: &Case<'_>) -> Option<(f64, f64)> {
    let leaves = case.expectation.leaves.len();
    let limits: Vec<Option<f64>> = (0..leaves).map(|leaf| largest_weight(case, leaf)).collect();
    case.expectation.coarse.scales.first()?;
    let figures: Vec<Figure> = cells(case, 0, &limits).filter_map(|(_, figure)| figure).collect();
    let precision = |f: &Figure| 1.0 / f.relative_error.max(ROUNDING).powi(2);
    let total: f64 = figures.iter().map(precision).sum();
    let mean = figures.iter().map(|f| f.ratio * precision(f)).sum::<f64>() / total;
    let spread: f64 = figures.iter().map(|f| (f.ratio - mean).powi(2) * precision(f)).sum();
    let df = figures.len() as f64 - 1.0;
    (df >= 3.0 && spread < df + 5.0 * (2.0 * df).sqrt()).then_some((mean, total.powf(-0.5)))
}

struct Figure {
    p: f64,
    /// Mean of the weights over the measure.
    ratio: f64,
    relative_error: f64,
    share: f64,
}

/// The cells of one of the two coarse scales, with a figure where they can be asked.
fn cells<'a>(
    case: &'a Case<'_>,
    which: usize,
    limits: &'a [Option<f64>],
) -> impl Iterator<Item = (usize, Option<Figure>)> + 'a {
    let n = case.tally.samples as f64;
    let coarse = &case.expectation.coarse;
    let scale = &coarse.scales[which];
    let groups = scale.cells.len();
    let (masses, _) = case.expectation.masses_at(scale);
    let mut sums = vec![(0_u64, Inverse::default(), Some(0.0_f64)); groups];
    for (leaf, group) in scale.of_leaf.iter().enumerate() {
        let Some(group) = *group else { continue };
        let (count, _, limit) = &mut sums[group];
        *count += case.tally.per_leaf[leaf];
        *limit = limit.zip(limits[leaf]).map(|(a, b)| a.max(b));
    }
    for (cells, inverse) in coarse.cells.iter().zip(&case.tally.inverse) {
        if let Some(group) = cells[which] {
            sums[group].1.merge(inverse);
        }
    }
    sums.into_iter().enumerate().map(move |(group, (count, inverse, limit))| {
        let measure = case.probe.space().cell_measure(&scale.cells[group]);
        let figure = limit.and_then(|limit| {
            figure(n, masses[group].value, count, &inverse, limit, measure, case.probe.partial())
        });
        (group, figure)
    })
}

/// Whether a cell is asked depends on its density alone: to ask those that happen to have many samples is to ask those whose mean comes out high.
fn figure(
    n: f64,
    mass: f64,
    count: u64,
    sums: &Inverse,
    limit: f64,
    measure: f64,
    partial: bool,
) -> Option<Figure> {
    let [first, second, third] = sums.powers;
    if !(n * mass >= ENOUGH) || !measure.is_finite() || !(measure > 0.0) || !third.is_finite() {
        return None;
    }
    // At least, by Jensen's inequality: E[w^2] >= (E[w])^2 / P(cell).
    let least_square = measure * measure / mass;
    // Third moment over the 3/2th power of the second, as a weight at the limit in every sample of the cell would make it.
    let skewness = limit.powi(3) * mass / (least_square.powf(1.5) * n.sqrt());
    // A weight beyond the limit belies the limit.
    if limit * limit > LARGEST_SHARE * n * least_square || 6.0 * skewness > 1.0 || sums.largest > limit {
        return None;
    }
    let mean = first / n;
    let variance = second / n - mean * mean;
    let error = (variance / n).sqrt();
    let off = if partial { mean - measure } else { (mean - measure).abs() };
    let off = (off - ROUNDING * measure).max(0.0);
    let z = off / error;
    let seen =
        (third / n - 3.0 * mean * second / n + 2.0 * mean.powi(3)).abs() / (variance.powf(1.5) * n.sqrt());
    // The series holds for z that are small against 1 / skewness; beyond that a figure so large needs no fine print.
    let widened = (seen.max(0.5 * skewness) * z.min(8.0).powi(3) / 3.0).exp();
    let p = (2.0 * normal::sf(z) * widened).min(1.0);
    Some(Figure { p, ratio: mean / measure, relative_error: error / measure, share: count as f64 / n })
}

/// A spread that is rounding of `f32` densities.
const ROUNDED_SPREAD: f64 = 1e-4;
/// Distances from the mean, in promised spreads, at which samples are counted.
const DISTANCES: [f64; 6] = [1.25, 1.5, 2.0, 3.0, 5.0, 10.0];
const MEAN_ERRORS: f64 = 6.0;
const SPREAD_SAMPLES: u64 = 1 << 18;

/// Standard deviation over mean.
pub(super) fn relative_spread(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v / mean - 1.0).powi(2)).sum::<f64>() / n).sqrt()
}

fn spread(check: &'static str, case: &Case<'_>) -> Option<Finding> {
    case.probe.importance(&[])?;
    let samples = case.tally.samples.min(SPREAD_SAMPLES) as usize;
    let mut xi = vec![0.0; samples * case.probe.dimensions().max(1)];
    fill_unit(&mut stream(case.settings.seed, "importance", 0), &mut xi);
    let (ratios, allowed) = case.probe.importance(&xi)?;
    let certain = |verdict, detail: String| Finding::certain(check, verdict, detail).part("spread");
    if let Some(bad) = ratios.iter().find(|r| !(r.is_finite() && **r >= 0.0)) {
        return Some(certain(Verdict::Fail, format!("importance over density is {bad} at a sample")));
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    if !(mean > 0.0) {
        return Some(certain(
            Verdict::Fail,
            "the importance is 0 at all samples, or all were rejected".to_owned(),
        ));
    }
    let deviation = |r: &f64| (r / mean - 1.0).abs();
    let n = ratios.len() as f64;
    let limit = allowed + ROUNDED_SPREAD;
    let found = relative_spread(&ratios);
    let detail =
        format!("importance over density spreads by {found:.4} of its mean, where {allowed:.4} is promised");
    // The mean is one of the samples; it may be off by some standard errors.
    let slack = MEAN_ERRORS * limit / n.sqrt();
    let tail = |k: &f64| {
        let beyond =
            ratios.iter().filter(|r| deviation(r) > (k * limit + slack) / (1.0 - slack)).count() as u64;
        binomial::upper_tail(beyond, ratios.len() as u64, 1.0 / (k * k)).unwrap_or(f64::NAN)
    };
    let p = (DISTANCES.iter().map(tail).fold(1.0, f64::min) * DISTANCES.len() as f64).min(1.0);
    let evidence = Evidence::Chance { p, conservative: p };
    Some(Finding::new(check, evidence, detail).part("spread"))
}

fn known_integral(check: &'static str, name: &str, integral: f64, moments: &Moments) -> Finding {
    let part = format!("f / density, {name}");
    let Ok(test) = moments.mean_test(integral, ROUNDING * integral.abs()) else {
        let detail = format!("f / density is not always a number: its mean is {}", moments.mean());
        return Finding::certain(check, Verdict::Fail, detail).part(part);
    };
    let error = moments.standard_error().unwrap_or(f64::NAN);
    let detail = format!(
        "the mean of f / density is {:.6} +- {error:.1e}, the integral {integral:.6}",
        moments.mean()
    );
    // A constant weight, f proportional to the density, has no spread to test by, and none to hide behind.
    let constant = test.trust == statistics::Trust::Constant;
    if constant && (moments.mean() - integral).abs() > 1e-4 * integral.abs() {
        return Finding::certain(check, Verdict::Fail, detail).part(part);
    }
    if !test.trust.is_trusted() && !constant {
        let detail =
            format!("{detail}, but its tails are too heavy, or its samples too few, for that to be believed");
        return Finding::new(check, Evidence::Unanswered, detail).part(part);
    }
    let sees = format!("a mean that is {:.2}% off", 100.0 * (6.5 * error / integral.abs() + ROUNDING));
    let evidence = if constant {
        Evidence::Certain(Verdict::Pass)
    } else {
        // What rounding explains is no reason to doubt.
        Evidence::Chance { p: test.p_conservative, conservative: test.p_conservative }
    };
    Finding::new(check, evidence, detail).part(part).sees(sees)
}
