//! E[1 / density] over a cell is the cell's measure: a test of pairs (point, density) that needs no integral of the density.
//!
//! E[1{x in C} / p(x)] = integral over C of p / p = measure of C wherever p > 0 on C. Its tails can be heavy: over a sphere, the plain mean of 2e5
//! weights of a lobe of kappa 10 comes out 40% low, because the directions that carry the weight are never drawn. So it is asked only of cells whose
//! largest possible weight, from the density at places in them and not from the judged samples, is small against the sum of squares; the others stay
//! unanswered. Where there is no density to be asked, only those that come with the samples, a cell is what its pilots show of it: the boxes that a few
//! neighbours each span, where their densities are within a factor of 4, and its weights are over the density around them (see `Resolved`). The density
//! may yet be low between samples, as in the dark texels of a starry map, which none of them meets: where samples don't fill the boxes, a mean that is too low
//! is no proof. What is finer than a quarter of a box is not seen; `partial` is for that. The p-value is the normal tail times exp(|gamma| z^3 / 3), the leading term of Cramér's series of a mean over its own standard error, for
//! the skewness that those weights allow (Wang, Electron. Commun. Probab. 16, 2011), and is corrected over the cells asked.
//!
//! A density that follows its importance f has a nearly constant f / density = r. If its spread over its mean is s at most, P(|r / mean - 1| > k s) <= 1 / k^2
//! (Chebyshev 1867), whatever its tails: the number of samples beyond k s is tested against that by its binomial tail, for several k.
//!
//! The mean of f / density for functions with known integrals is tested alike, and is unanswered where the samples themselves show heavy tails.

use super::check::{Case, Check, Needs, Rests};
use super::expectation::{Mass, Resolved};
use super::finding::{Evidence, Finding, Verdict};
use super::power::Power;
use super::tally::Inverse;
use crate::domain::{Cell, Location, Space};
use crate::random::{fill_unit, stream};
use crate::statistics::{self, Moments, binomial, normal};

/// Samples that a cell must expect to be asked.
const ENOUGH: f64 = 1000.0;
/// The same of parts in which densities are of one magnitude.
const ENOUGH_RESOLVED: f64 = 250.0;
const LARGEST_SHARE_RESOLVED: f64 = 5e-2;
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
        let (alone, told) = (!case.probe.has_density(), case.probe.tells_densities());
        if alone && told || !alone && case.probe.space().axes() > 0 && case.tally.samples > 0 {
            findings.extend(inverse_density(self.name(), case, alone));
        }
        findings.extend(spread(self.name(), case));
        for ((name, integral), moments) in case.probe.known().into_iter().zip(&case.tally.known) {
            let mut finding = known_integral(self.name(), name, integral, moments);
            // Without densities nothing else judges anything but where samples are.
            if !told && finding.evidence == Evidence::Unanswered {
                finding.evidence = Evidence::Certain(Verdict::Inconclusive);
            }
            findings.push(finding);
        }
        findings
    }
}

/// Where a cell's weights lie: the largest that its density allows; `None` if the density vanishes somewhere in it.
fn largest_weight(case: &Case<'_>, leaf: usize) -> Option<f64> {
    if let Some(resolved) = case.expectation.resolved.get(leaf) {
        // Of a few pilots only.
        return resolved.map(|part| 2.0 * part.largest);
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

/// Where nothing but these means judges the densities, they have to judge those of this share of the samples.
const LEAST_SHARE: f64 = 0.5;

/// `alone`: nothing else judges the densities, so that without an answer there is no verdict.
fn inverse_density(check: &'static str, case: &Case<'_>, alone: bool) -> Vec<Finding> {
    let part = "1 / density";
    let holes = !case.probe.partial() && has_holes(case);
    let one_sided = case.probe.partial() || holes;
    let unjudged = |detail: String| {
        let detail = format!("{detail}, and nothing else judges densities that come with the samples");
        Finding::certain(check, Verdict::Inconclusive, detail).part("densities judged")
    };
    let leaves = case.expectation.leaves.len();
    let limits: Vec<Option<f64>> = crate::parallel::map(leaves, |leaf| largest_weight(case, leaf));
    let (mut asked, mut of, mut needed) = (0_u64, 0_u64, f64::INFINITY);
    let mut figures: Vec<(Figure, &Cell)> = Vec::new();
    let (mut share, mut error, mut lowest) = (0.0, 0.0_f64, 1.0_f64);
    let n = case.tally.weighed as f64;
    for (i, scale) in case.expectation.coarse.scales.iter().enumerate() {
        for (group, figure) in cells(case, i, &limits, one_sided) {
            of += 1;
            let figure = match figure {
                Ok(figure) => figure,
                // What keeps others from being asked is not their number.
                Err(samples) => {
                    needed = needed.min(if samples > n { samples } else { f64::INFINITY });
                    continue;
                }
            };
            asked += 1;
            lowest = lowest.min(figure.p_low);
            if i == 0 {
                share += figure.share;
                error = error.max(figure.relative_error);
            }
            figures.push((figure, &scale.cells[group]));
        }
    }
    // Of those that fell anywhere.
    share /= (1.0 - case.tally.rejected as f64 / case.tally.samples as f64).max(f64::MIN_POSITIVE);
    // Of those beyond all p-values the farthest off.
    let off = |figure: &Figure| figure.ratio.ln().abs();
    figures.sort_by(|(a, _), (b, _)| a.p.total_cmp(&b.p).then_with(|| off(b).total_cmp(&off(a))));
    let Some((worst, cell)) = figures.first() else {
        needed = super::tally::drawn_until(needed, case.expectation);
        let (samples, least) = (case.tally.samples, at_least(needed));
        let detail =
            format!("the weights of all {of} cells have tails too heavy for {samples} samples{least}");
        return vec![if alone {
            unjudged(detail)
        } else {
            Finding::new(check, Evidence::Unanswered, detail).part(part)
        }];
    };
    let (p, ratio) = ((worst.p * asked as f64).min(1.0), worst.ratio);
    let place = case.probe.space().describe(cell);
    let mut detail = format!(
        "mean of 1 / density against the measure of {asked} of {of} cells; the worst is {ratio:.5} times it, at {place}"
    );
    if alone {
        let wrong = figures.iter().filter(|(figure, _)| figure.p * (asked as f64) < case.settings.alpha);
        detail += &how_far_off(case.probe.space(), wrong);
    }
    let mut finding = Finding::new(check, Evidence::Chance { p, conservative: p }, detail).part(part);
    if share > 0.0 {
        // Of a cell's mean: 7 standard errors are missed once in a hundred times at the level of a single test.
        let power = Power { mass: share, error: 7.0 * error };
        let percent = [power.error, power.mass].map(|x| 100.0 * x);
        finding = finding
            .sees(format!("a relative error of {:.1}% in any of {:.0}% of the mass", percent[0], percent[1]));
        finding.power = Some(power);
    }
    let mut findings = vec![finding];
    if holes && lowest * (asked as f64) < case.settings.alpha {
        findings.push(unjudged(
            "the mean of 1 / density is too low, but the density varies much between neighbouring samples: either densities are too large, or it is low \
             or 0 where no sample fell (--partial)"
                .to_owned(),
        ));
    }
    if alone && share < LEAST_SHARE {
        findings.push(unjudged(format!(
            "only {:.1}% of the samples are in cells whose weights have tails light enough",
            100.0 * share
        )));
    }
    findings
}

/// How many samples it takes, to two digits; nothing where nobody ever draws so many.
fn at_least(needed: f64) -> String {
    if needed < 1e12 {
        let round = 10_f64.powf(needed.log10().floor() - 1.0);
        format!(" (it takes about {} at least)", (needed / round).ceil() * round)
    } else {
        String::new()
    }
}

/// Places where the density is told to be too low or too high.
const TOLD: usize = 3;

/// By how much the density is too low or too high in the first of these cells, and in others that have no part of them.
fn how_far_off<'a>(space: &dyn Space, wrong: impl Iterator<Item = &'a (Figure, &'a Cell)>) -> String {
    let apart = |a: &Cell, b: &Cell| {
        let along = |axis: usize| a.high[axis] <= b.low[axis] || b.high[axis] <= a.low[axis];
        a.patches.end <= b.patches.start || b.patches.end <= a.patches.start || (0..space.axes()).any(along)
    };
    let mut told: Vec<&Cell> = Vec::new();
    let mut text = String::new();
    for (figure, cell) in wrong {
        if told.len() == TOLD {
            break;
        }
        if !told.iter().all(|other| apart(cell, other)) {
            continue;
        }
        text += &match told.len() {
            0 => format!(", where the density is {}", figure.in_words()),
            1 => format!("; {} at {}", figure.in_words(), space.describe(cell)),
            _ => format!(", {} at {}", figure.in_words(), space.describe(cell)),
        };
        told.push(cell);
    }
    text
}

/// The mean of 1 / density over the measure, and its error, where that is the same in all cells of the coarsest scale.
pub(super) fn common_ratio(case: &Case<'_>) -> Option<(f64, f64)> {
    let leaves = case.expectation.leaves.len();
    let limits: Vec<Option<f64>> = (0..leaves).map(|leaf| largest_weight(case, leaf)).collect();
    case.expectation.coarse.scales.first()?;
    let partial = case.probe.partial();
    let figures: Vec<Figure> =
        cells(case, 0, &limits, partial).filter_map(|(_, figure)| figure.ok()).collect();
    let precision = |f: &Figure| 1.0 / f.relative_error.max(ROUNDING).powi(2);
    let total: f64 = figures.iter().map(precision).sum();
    let mean = figures.iter().map(|f| f.ratio * precision(f)).sum::<f64>() / total;
    let spread: f64 = figures.iter().map(|f| (f.ratio - mean).powi(2) * precision(f)).sum();
    let df = figures.len() as f64 - 1.0;
    (df >= 3.0 && spread < df + 5.0 * (2.0 * df).sqrt()).then_some((mean, total.powf(-0.5)))
}

/// Leaves of this share whose pilots' densities are of several magnitudes are rough.
const ROUGH_SHARE: f64 = 0.25;

/// Whether the density may be low between samples: if it is rough, or if samples leave out parts of the boxes that their neighbours span. Then their weights
/// are spread over the squares of each box more unevenly than chance and a tenth, in the sum of all squared deviations over their variances. A factor
/// that is the same all over a box plays no part.
fn has_holes(case: &Case<'_>) -> bool {
    let resolved = case.expectation.resolved.iter().zip(&case.expectation.leaves);
    let rough: f64 = resolved.filter(|(part, _)| part.is_none()).map(|(_, mass)| mass.value).sum();
    if rough > ROUGH_SHARE {
        return true;
    }
    let (mut found, mut expected) = (0.0, 0.0);
    for (part, filled) in case.expectation.resolved.iter().zip(&case.tally.filled) {
        let Some(part) = part else { continue };
        let sums = &filled.sums[..part.squares()];
        let all: f64 = sums.iter().sum();
        let square = |(sum, share): (&f64, &f32)| {
            let share = f64::from(*share);
            (sum - share * all).powi(2) / (share * filled.squared)
        };
        let of_box: f64 = sums.iter().zip(&part.shares).map(square).sum();
        // It is NaN of an empty box; one square, of an entry, adds nothing to either.
        if of_box.is_finite() {
            found += of_box;
            expected += part.squares() as f64 - 1.0;
        }
    }
    found > 1.1 * expected + 10.0 * f64::sqrt(expected)
}

struct Figure {
    p: f64,
    /// That the mean is so low.
    p_low: f64,
    /// Mean of the weights over the measure.
    ratio: f64,
    relative_error: f64,
    share: f64,
}

impl Figure {
    /// How far the density is off: the mean of 1 / density is that of 1 / what it should be times what it should be over what it is.
    fn in_words(&self) -> String {
        let (of_right, error) = (1.0 / self.ratio, self.relative_error / self.ratio.powi(2));
        let side = if of_right < 1.0 { "low" } else { "high" };
        match of_right {
            0.5..=2.0 => {
                format!("{:.1}% +- {:.1}% too {side}", 100.0 * (of_right - 1.0).abs(), 100.0 * error)
            }
            _ => format!("{of_right:.2} +- {error:.2} times what it should be"),
        }
    }
}

/// The cells of one of the two coarse scales, with a figure where they can be asked, and otherwise with the samples that it takes.
fn cells<'a>(
    case: &'a Case<'_>,
    which: usize,
    limits: &'a [Option<f64>],
    one_sided: bool,
) -> impl Iterator<Item = (usize, Result<Figure, f64>)> + 'a {
    let coarse = &case.expectation.coarse;
    let scale = &coarse.scales[which];
    let (masses, _) = case.expectation.masses_at(scale);
    let known = case.expectation.resolved.is_empty();
    let start = |(group, mass): (usize, &Mass)| {
        let measure = case.probe.space().cell_measure(&scale.cells[group]);
        if known { Region::known(mass.value, measure) } else { Region::default() }
    };
    let mut regions: Vec<Region> = masses.iter().enumerate().map(start).collect();
    for (leaf, group) in scale.of_leaf.iter().enumerate() {
        let Some(group) = *group else { continue };
        let region = &mut regions[group];
        match case.expectation.resolved.get(leaf) {
            None => region.limit = region.limit.zip(limits[leaf]).map(|(a, b)| a.max(b)),
            // What is not resolved is no part of it.
            Some(part) => {
                if let (Some(part), Some(limit)) = (part, limits[leaf]) {
                    region.add(part, limit, case.expectation.leaves[leaf].value);
                }
            }
        }
    }
    for (cells, inverse) in coarse.cells.iter().zip(&case.tally.inverse) {
        if let Some(group) = cells[which] {
            regions[group].sums.merge(inverse);
        }
    }
    let n = case.tally.weighed as f64;
    let pilots = case.probe.pilots().unwrap_or(0) as f64;
    regions.into_iter().enumerate().map(move |(group, region)| {
        let figure = |limit| {
            let skewness = region.skewness(limit, n, pilots);
            region.figure(n, limit, skewness, one_sided).ok_or_else(|| region.needed(n, limit, skewness))
        };
        (group, region.limit.map_or(Err(f64::INFINITY), figure))
    })
}

/// What a cell's mean of 1 / density is taken over.
#[derive(Clone, Default)]
struct Region {
    mass: f64,
    measure: f64,
    /// The largest weight that is possible.
    limit: Option<f64>,
    /// Sums of the second and third power of the pilots' weights, where these are all that is known.
    pilots: Option<[f64; 2]>,
    sums: Inverse,
}

impl Region {
    /// A whole cell.
    fn known(mass: f64, measure: f64) -> Self {
        Self { mass, measure, limit: Some(0.0), ..Self::default() }
    }

    fn add(&mut self, part: &Resolved, limit: f64, mass: f64) {
        self.mass += mass;
        self.measure += part.expected;
        self.limit = Some(self.limit.unwrap_or(0.0).max(limit));
        let sums = self.pilots.get_or_insert_default();
        sums.iter_mut().zip(part.powers).for_each(|(sum, power)| *sum += power);
    }

    /// At least, by Jensen's inequality: E[w^2] >= (E[w])^2 / P(cell).
    fn least_square(&self) -> f64 {
        self.measure * self.measure / self.mass
    }

    /// Third moment over the 3/2th power of the second, of the mean of `n` weights: twice that of the pilots, or as a weight at the limit in every sample
    /// would make it.
    fn skewness(&self, limit: f64, n: f64, pilots: f64) -> f64 {
        let of = |third: f64, second: f64| third / (second.powf(1.5) * n.sqrt());
        match self.pilots {
            Some([second, third]) => 2.0 * of(third / pilots, second / pilots),
            None => of(limit.powi(3) * self.mass, self.least_square()),
        }
    }

    /// How many samples a cell has to have, and which share of the square of its weights the largest may have at most.
    fn limits(&self) -> (f64, f64) {
        match self.pilots {
            None => (ENOUGH, LARGEST_SHARE),
            Some(_) => (ENOUGH_RESOLVED, LARGEST_SHARE_RESOLVED),
        }
    }

    /// Samples with which the cell would be asked, should its density go on as it is known by `n`.
    fn needed(&self, n: f64, limit: f64, skewness: f64) -> f64 {
        let (enough, largest_share) = self.limits();
        let of_largest = limit * limit / (largest_share * self.least_square());
        let all = [enough / self.mass, of_largest, n * (6.0 * skewness).powi(2)];
        all.into_iter().fold(0.0, f64::max)
    }

    /// Whether a cell is asked depends on its density alone: to ask those that happen to have many samples is to ask those whose mean comes out high.
    fn figure(&self, n: f64, limit: f64, skewness: f64, one_sided: bool) -> Option<Figure> {
        let [first, second, third] = self.sums.powers;
        let (measure, known) = (self.measure, self.pilots.is_none());
        let (enough, largest_share) = self.limits();
        if !(n * self.mass >= enough) || !measure.is_finite() || !(measure > 0.0) || !third.is_finite() {
            return None;
        }
        if limit * limit > largest_share * n * self.least_square() || 6.0 * skewness > 1.0 {
            return None;
        }
        // A weight beyond the limit belies the limit, where that was a promise.
        if known && self.sums.largest > limit {
            return None;
        }
        let mean = first / n;
        let variance = second / n - mean * mean;
        let error = (variance / n).sqrt();
        let seen = (third / n - 3.0 * mean * second / n + 2.0 * mean.powi(3)).abs()
            / (variance.powf(1.5) * n.sqrt());
        // The series holds for z that are small against 1 / skewness; beyond that a figure so large needs no fine print.
        let p = |off: f64| {
            let z = (off - ROUNDING * measure).max(0.0) / error;
            let widened = (seen.max(0.5 * skewness) * z.min(8.0).powi(3) / 3.0).exp();
            (2.0 * normal::sf(z) * widened).min(1.0)
        };
        let (high, low) = (p(mean - measure), p(measure - mean));
        Some(Figure {
            p: if one_sided { high } else { high.min(low) },
            p_low: low,
            ratio: mean / measure,
            relative_error: error / measure,
            share: self.sums.count as f64 / n,
        })
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Discrete, Knots, MeshSurface, Partition, Square, SurfacePoint};
    use crate::sampler::from_fn;
    use crate::verify::expectation::{Expectation, told};
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;
    use crate::verify::tally::{Filled, Tally};
    use glam::{DVec2, DVec3};

    #[track_caller]
    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{found}, not {expected}");
    }

    /// Of n samples so many with each of these weights.
    fn sums(weights: &[(u64, f64)]) -> Inverse {
        let power = |k: i32| weights.iter().map(|(count, w)| *count as f64 * w.powi(k)).sum();
        Inverse {
            count: weights.iter().map(|w| w.0).sum(),
            powers: [power(1), power(2), power(3)],
            largest: weights.iter().map(|w| w.1).fold(0.0, f64::max),
        }
    }

    const N: f64 = 1e5;

    /// A twentieth of the samples, by two densities that differ by a factor of 2: their mean weight is 0.075.
    fn region() -> Region {
        Region { sums: sums(&[(2500, 1.0), (2500, 2.0)]), ..Region::known(0.05, 0.075) }
    }

    #[test]
    fn the_mean_of_weights_of_a_cell() {
        let region = region();
        near(region.least_square(), 0.075 * 0.075 / 0.05);
        let skewness = region.skewness(3.0, N, 0.0);
        near(skewness, 27.0 * 0.05 / (0.1125_f64.powf(1.5) * N.sqrt()));
        let figure = region.figure(N, 3.0, skewness, false).unwrap();
        let (mean, second, third) = (0.075, 0.125, 0.225);
        let variance: f64 = second - mean * mean;
        near(figure.ratio, 1.0);
        near(figure.share, 0.05);
        near(figure.relative_error, (variance / N).sqrt() / 0.075);
        assert_eq!((figure.p, figure.p_low), (1.0, 1.0));
        // A measure that is 4% less or more.
        let seen = (third - 3.0 * mean * second + 2.0 * mean.powi(3)) / (variance.powf(1.5) * N.sqrt());
        let p = |off: f64, measure: f64, skewness: f64| {
            let z = (off - 1e-6 * measure) / (variance / N).sqrt();
            2.0 * normal::sf(z) * (seen.max(0.5 * skewness) * z.min(8.0).powi(3) / 3.0).exp()
        };
        for (measure, low) in [(0.072, false), (0.078, true)] {
            let region = Region { measure, ..region.clone() };
            for one_sided in [false, true] {
                for skewness in [0.001, 0.1] {
                    let figure = region.figure(N, 3.0, skewness, one_sided).unwrap();
                    let expected = p(0.003, measure, skewness).min(1.0);
                    near(figure.p, if low && one_sided { 1.0 } else { expected });
                    near(figure.p_low, if low { expected } else { 1.0 });
                    near(figure.ratio, 0.075 / measure);
                }
            }
        }
        // Beyond 8 standard errors the series is kept at what it is there.
        let far = Region { measure: 0.06, ..region };
        near(far.figure(N, 3.0, 0.1, false).unwrap().p, p(0.015, 0.06, 0.1));
        assert!((0.015 / (variance / N).sqrt()) > 8.0);
    }

    #[test]
    fn which_cells_can_be_asked() {
        let asked = |region: &Region, n: f64, limit: f64, skewness: f64| {
            region.figure(n, limit, skewness, false).is_some()
        };
        let region = region();
        // A thousand samples, of a part that is resolved 250.
        assert!(asked(&region, 20_000.0, 2.0, 0.0) && !asked(&region, 19_999.0, 2.0, 0.0));
        let resolved = Region { pilots: Some([1.0, 1.0]), ..region.clone() };
        assert!(asked(&resolved, 5000.0, 2.0, 0.0) && !asked(&resolved, 4999.0, 2.0, 0.0));
        // The largest weight holds a hundredth of the sum of squares at most, or a twentieth.
        let most = |share: f64| (share * N * 0.1125_f64).sqrt();
        assert!(asked(&region, N, most(0.0099), 0.0) && !asked(&region, N, most(0.0101), 0.0));
        assert!(asked(&resolved, N, most(0.0499), 0.0) && !asked(&resolved, N, most(0.0501), 0.0));
        assert!(asked(&region, N, 3.0, 0.1666) && !asked(&region, N, 3.0, 0.1667));
        // A weight beyond what was promised belies it; where nothing was, it may be.
        assert!(
            asked(&region, N, 2.0, 0.0) && !asked(&region, N, 1.999, 0.0) && asked(&resolved, N, 1.999, 0.0)
        );
        for measure in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            assert!(!asked(&Region { measure, ..region.clone() }, N, 3.0, 0.0));
        }
        let infinite =
            Region { sums: Inverse { powers: [1.0, 1.0, f64::INFINITY], ..region.sums }, ..region.clone() };
        assert!(!asked(&infinite, N, 3.0, 0.0) && !asked(&Region { mass: f64::NAN, ..region }, N, 3.0, 0.0));
    }

    /// So many that there are enough of them in the cell, that the largest weight has no large share, and that the mean is little skewed.
    #[test]
    fn samples_that_a_cell_needs() {
        let region = region();
        near(region.needed(N, 3.0, 0.0), 1000.0 / 0.05);
        near(region.needed(N, 6.0, 0.0), 36.0 / (0.01 * 0.1125));
        near(region.needed(N, 3.0, 0.1), N * 0.36);
        let resolved = Region { pilots: Some([1.0, 1.0]), ..region };
        near(resolved.needed(N, 3.0, 0.0), 250.0 / 0.05);
        near(resolved.needed(N, 6.0, 0.0), 36.0 / (0.05 * 0.1125));
        // With as many it is asked, with fewer it is not.
        for limit in [3.0, 6.0] {
            let asked = |n: f64| resolved.figure(n, limit, 0.0, false).is_some();
            let needed = resolved.needed(N, limit, 0.0);
            assert!(asked(1.001 * needed) && !asked(0.999 * needed));
        }
    }

    /// Two digits, rounded up.
    #[test]
    fn samples_that_it_takes() {
        let takes = |count: &str| format!(" (it takes about {count} at least)");
        assert_eq!(at_least(120_001.0), takes("130000"));
        assert_eq!(at_least(4_000.0), takes("4000"));
        assert_eq!(at_least(9_999_999.0), takes("10000000"));
        assert_eq!(at_least(9.9e11), takes("990000000000"));
        assert_eq!((at_least(1e12), at_least(f64::INFINITY)), (String::new(), String::new()));
    }

    fn off_by(ratio: f64, relative_error: f64) -> Figure {
        Figure { p: 0.0, p_low: 0.0, ratio, relative_error, share: 0.1 }
    }

    /// Where the mean of 1 / density is 5/4 of what it should be the density is 4/5 of it.
    #[test]
    fn how_far_a_density_is_off_in_words() {
        for (ratio, error, words) in [
            (1.25, 0.05, "20.0% +- 3.2% too low"),
            (0.8, 0.016, "25.0% +- 2.5% too high"),
            (2.0, 0.2, "50.0% +- 5.0% too low"),
            (0.5, 0.01, "100.0% +- 4.0% too high"),
            (4.0, 0.32, "0.25 +- 0.02 times what it should be"),
            (0.4, 0.016, "2.50 +- 0.10 times what it should be"),
        ] {
            assert_eq!(off_by(ratio, error).in_words(), words);
        }
    }

    #[test]
    fn where_a_density_is_off() {
        let told = |space: &dyn Space, cells: &[Cell]| {
            let figures: Vec<_> = [0.8, 1.25, 4.0, 0.5, 2.0].map(|ratio| off_by(ratio, 0.0)).into();
            let wrong: Vec<(Figure, &Cell)> = figures.into_iter().zip(cells).collect();
            how_far_off(space, wrong.iter())
        };
        let entries = |all: &[std::ops::Range<usize>]| {
            let cell = |patches: &std::ops::Range<usize>| Cell {
                patches: patches.clone(),
                low: [0.0; 2],
                high: [1.0; 2],
            };
            told(&Discrete::new(10), &all.iter().map(cell).collect::<Vec<_>>())
        };
        assert_eq!(entries(&[]), "");
        let high = ", where the density is 25.0% +- 0.0% too high";
        assert_eq!(entries(&[2..4, 2..4]), high);
        // What has a part of another is not told of again, what borders on it is.
        assert_eq!(entries(&[2..4, 3..5, 1..3, 0..9, 2..3]), high);
        assert_eq!(entries(&[2..4, 0..2]), format!("{high}; 20.0% +- 0.0% too low at indices 0..=1"));
        // Three are enough.
        let three = format!(
            "{high}; 20.0% +- 0.0% too low at index 4, 0.25 +- 0.00 times what it should be at indices 0..=1"
        );
        assert_eq!(entries(&[2..4, 4..5, 0..2, 6..8]), three);
        let others = format!(
            "{high}; 0.25 +- 0.00 times what it should be at index 4, 100.0% +- 0.0% too high at index 1"
        );
        assert_eq!(entries(&[2..4, 3..4, 4..5, 1..2, 9..10]), others);
        let squares = |all: &[[f64; 4]]| {
            let cell = |[left, right, low, high]: &[f64; 4]| Cell {
                patches: 0..1,
                low: [*left, *low],
                high: [*right, *high],
            };
            let cells: Vec<Cell> = all.iter().map(cell).collect();
            (told(&Square, &cells), cells)
        };
        let middle = [0.25, 0.5, 0.25, 0.5];
        let corner = [0.375, 0.75, 0.375, 0.75];
        assert_eq!(squares(&[middle, corner]).0, high);
        assert_eq!(squares(&[corner, middle]).0, high);
        // To either side along either axis.
        for beside in
            [[0.0, 0.25, 0.3, 0.4], [0.5, 0.75, 0.3, 0.4], [0.3, 0.4, 0.0, 0.25], [0.3, 0.4, 0.5, 0.75]]
        {
            let (text, cells) = squares(&[middle, beside]);
            assert_eq!(text, format!("{high}; 20.0% +- 0.0% too low at {}", Square.describe(&cells[1])));
        }
    }

    #[test]
    fn what_pilots_show_is_added_up() {
        let mut region = Region::default();
        assert!(region.limit.is_none() && region.pilots.is_none());
        let part = told::resolved;
        region.add(&part(0.25, [5.0, 7.0]), 3.0, 0.125);
        region.add(&part(0.5, [50.0, 70.0]), 2.0, 0.0625);
        assert_eq!(
            (region.mass, region.measure, region.limit, region.pilots),
            (0.1875, 0.75, Some(3.0), Some([55.0, 77.0]))
        );
        // Twice that of 1000 pilots, over the square root of the samples.
        near(region.skewness(9.0, N, 1000.0), 2.0 * 0.077 / (0.055_f64.powf(1.5) * N.sqrt()));
        let mut merged = sums(&[(10, 1.0)]);
        merged.merge(&sums(&[(5, 3.0), (1, 0.5)]));
        assert_eq!((merged.count, merged.powers, merged.largest), (16, [25.5, 55.25, 145.125], 3.0));
    }

    /// What is resolved of four leaves, whose boxes of 16 squares each have these sums.
    fn told_of(
        resolved: [Option<Resolved>; 4],
        filled: [Filled; 4],
        check: impl Fn(&Case<'_>) -> bool,
    ) -> bool {
        let sampler = from_fn(Square, |xi: [f64; 2]| DVec2::from(xi), |_: DVec2| 1.0);
        let extras = Extras::default();
        let masses = [0.26, 0.24, 0.25, 0.25].map(|mass| told::integral(mass, 0.0));
        let expectation =
            Expectation { resolved: resolved.into(), ..told::expectation(&Square, masses, vec![]) };
        let tally = Tally { filled: filled.into(), ..Tally::default() };
        let (probe, settings) = (Subject::new(&sampler, &extras), Settings::default());
        check(&Case { probe: &probe, expectation: &expectation, tally: &tally, settings: &settings })
    }

    #[test]
    fn the_largest_weight_is_twice_that_of_pilots() {
        let part = |largest: f64| Some(told::resolved_up_to(largest));
        assert!(told_of([part(1.0), None, part(3.0), part(1.5)], Default::default(), |case| [0, 1, 2, 3]
            .map(|leaf| largest_weight(case, leaf))
            == [Some(2.0), None, Some(6.0), Some(3.0)]));
    }

    /// Half more than at the places that are looked at, unless the density was 0 somewhere, or the cell is of more patches than anybody looks at.
    #[test]
    fn the_largest_weight_of_a_density() {
        let largest = |probe: &dyn crate::verify::probe::Probe, expectation: &Expectation| {
            let (tally, settings) = (Tally::default(), Settings::default());
            let case = Case { probe, expectation, tally: &tally, settings: &settings };
            (0..expectation.partition.leaves().len())
                .map(|leaf| largest_weight(&case, leaf))
                .collect::<Vec<_>>()
        };
        let sampler = from_fn(Square, |xi: [f64; 2]| DVec2::from(xi), |_: DVec2| 0.5);
        let extras = Extras::default();
        let (probe, mass) = (Subject::new(&sampler, &extras), told::integral(0.25, 0.0));
        let crossed = crate::domain::Integral { zeros: 1, ..mass };
        let expectation = told::expectation(&Square, [mass, crossed, mass, mass], vec![]);
        assert_eq!(largest(&probe, &expectation), [Some(3.0), None, Some(3.0), Some(3.0)]);
        let mesh = |patches: usize| {
            let domain = MeshSurface::from_areas(vec![1.0; patches]);
            let partition = Partition::from_pilots(&domain, vec![], &Knots::default(), 1);
            let point = |_: f64| SurfacePoint { triangle: 0, barycentric: DVec3::X };
            let sampler = from_fn(domain, point, |_: SurfacePoint| 0.5);
            let extras = Extras::default();
            let expectation = Expectation { partition, ..told::expectation(&Square, [mass; 4], vec![]) };
            largest(&Subject::new(&sampler, &extras), &expectation)
        };
        assert_eq!((mesh(16), mesh(17)), (vec![Some(3.0)], vec![None]));
    }

    /// A sum of squared deviations over their variances beyond 1.1 times what is expected, 15 of each box, and ten roots of it.
    #[test]
    fn boxes_that_are_not_filled() {
        let part = Some(told::resolved(1.0, [1.0; 2]));
        // Of 160 in all two squares are off, by what gives this sum.
        let filled = |found: f64| {
            let mut sums = [10.0; Resolved::SQUARES];
            let off = (found / 32.0).sqrt();
            (sums[3], sums[8]) = (10.0 + off, 10.0 - off);
            Filled { sums, squared: 1.0 }
        };
        let even = filled(0.0);
        let holes = |all: [Filled; 4]| told_of([part; 4], all, has_holes);
        let limit = |boxes: f64| 1.1 * 15.0 * boxes + 10.0 * (15.0 * boxes).sqrt();
        let nothing = Filled::default();
        for (off, is) in [(-0.1, false), (0.1, true)] {
            // Boxes without samples are not counted.
            assert_eq!(holes([nothing, filled(limit(1.0) + off), nothing, nothing]), is);
            assert_eq!(holes([even, filled(limit(4.0) + off), even, even]), is);
            assert_eq!(holes([filled(100.0), filled(limit(4.0) - 100.0 + off), even, even]), is);
        }
        assert!(!holes([nothing; 4]));
        // What is not resolved of more than a quarter of the samples is rough.
        assert!(told_of([None, part, part, part], [even; 4], has_holes));
        assert!(!told_of([part, None, part, part], [even; 4], has_holes));
        assert!(told_of([part, None, None, part], [even; 4], has_holes));
        // An entry is one square, which is as full as it is.
        let entry = Some(told::entry());
        let one = Filled { sums: [7.0; Resolved::SQUARES], squared: 1.0 };
        assert!(!told_of([entry; 4], [one; 4], has_holes));
    }

    #[test]
    fn spreads() {
        near(relative_spread(&[1.0, 3.0]), 0.5);
        near(relative_spread(&[2.0, 2.0, 8.0]), 0.5_f64.sqrt());
        assert_eq!(relative_spread(&[4.0; 3]), 0.0);
    }
}
