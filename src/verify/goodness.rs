//! Counts against expected counts, at several scales.
//!
//! Pearson's X^2 = sum (O - E)^2 / E over cells of about equal expected mass. At each scale
//! - cells that expect fewer than [`LEAST`] samples are pooled, and the pool is a cell like the others, or is tested exactly
//!   (binomial) if it expects few samples itself;
//! - rejected samples are a cell: they expect 1 minus the integral of the density;
//! - errors of the expected counts lower the statistic before it fails anybody: sqrt(X^2) is a norm of (O - E) / sqrt E, so
//!   the true one is at least sqrt(X^2) - sqrt(sum (n err)^2 / E).
//!
//! At the finest scale where every cell expects [`PLENTY`] samples or more, the log-likelihood ratio G is tested beside it: it sees emptied cells better. And of all cells of
//! the tree, large and small, however few samples they expect, the one whose count is least likely is tested exactly (binomial, times the number of
//! cells): a crowd in a place of millionths of the mass, and a slight error over some percent of it, wherever its borders are.
//!
//! A discrete domain with more entries than cells is also counted by the remainder of the index, so that entries which lie between each other (a table
//! that reaches only every second one) don't hide in one cell.
//!
//! Coarse cells see a slight error over much of the mass, fine ones a strong error in a small place; their p-values are corrected together.

use super::check::{Case, Check, Needs, Rests};
use super::expectation::{Expectation, LEAST, MODULI, Mass};
use super::finding::{Evidence, Finding, Verdict};
use super::map::CellFigure;
use super::tally::Tally;
use crate::domain::{Cell, Space};
use crate::statistics::{binomial, chi_square};

const CHECK: &str = "chi-square";
/// An error of a mass, absolute, that leaves an exact test conclusive.
const NARROW: f64 = 1e-4;
/// The chi-square approximation of G is a few percent off at 30 samples a cell (Williams 1976), and not to be seen from here on.
const PLENTY: f64 = 100.0;

pub(super) struct GoodnessOfFit;

impl Check for GoodnessOfFit {
    fn name(&self) -> &'static str {
        CHECK
    }

    fn about(&self) -> &'static str {
        "counts in cells of equal mass, at several scales, against the integral of the density (X^2, G, exact tests of rare cells)"
    }

    fn rests(&self) -> Rests {
        Rests::ExpectedCounts
    }

    fn needs(&self) -> Needs {
        Needs::Density
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        findings(case)
    }
}

/// What a cell counted and should have.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Count {
    pub observed: u64,
    pub mass: f64,
    pub error: f64,
}

impl Count {
    pub fn new(observed: u64, mass: Mass) -> Self {
        Self { observed, mass: mass.value, error: mass.error }
    }

    /// What the error of the expected count can add to the statistic of `n` samples, at most.
    fn slack(&self, n: f64) -> f64 {
        n * self.error.powi(2) / self.mass
    }
}

fn findings(case: &Case<'_>) -> Vec<Finding> {
    let (expectation, tally) = (case.expectation, case.tally);
    let n = tally.samples as f64;
    if !(expectation.total.value.is_finite() && expectation.total.error.is_finite()) {
        let detail = "the density has no finite integral to expect counts from";
        return vec![Finding::certain(CHECK, Verdict::Inconclusive, detail)];
    }
    let rejected = Count::new(tally.rejected, expectation.rejected());
    let (mut findings, mut separately, mut finest_with_plenty) = (Vec::new(), Vec::new(), None);
    // A rejected mass that is all quadrature error is no cell: the exact test knows what to do with an interval.
    let rejected_is_cell = rejected.mass * n >= LEAST && rejected.slack(n) < 0.5;
    if !rejected_is_cell {
        separately.push(("rejected", rejected));
    }
    for scale in &expectation.scales {
        let (masses, pool) = expectation.masses_at(scale);
        let (observed, in_pool) = observed(scale, tally);
        let mut counts: Vec<Count> = observed.iter().zip(masses).map(|(&o, m)| Count::new(o, m)).collect();
        let pool = Count::new(in_pool, pool);
        if rejected_is_cell {
            counts.push(rejected);
        }
        if pool.mass * n >= LEAST {
            counts.push(pool);
        } else if pool.observed > 0 || pool.mass > 0.0 {
            separately.push(("pool of light cells", pool));
        }
        if counts.len() < 2 {
            continue;
        }
        findings.push(pearson(&counts, n));
        if counts.iter().all(|c| c.mass * n >= PLENTY) {
            finest_with_plenty = Some(counts);
        }
    }
    findings.extend(finest_with_plenty.map(|counts| likelihood_ratio(&counts, n)));
    let asked = findings.len();
    let remainders = expectation.remainders.iter().zip(&tally.remainders);
    for (modulus, (masses, observed)) in MODULI.into_iter().zip(remainders) {
        let counts: Vec<Count> = masses
            .iter()
            .zip(observed)
            .map(|(&mass, &observed)| Count { observed, mass, error: 0.0 })
            .collect();
        if counts.iter().all(|c| c.mass * n >= LEAST) && rejected.mass * n < LEAST {
            findings.push(pearson(&counts, n).part(format!("index modulo {modulus}")));
        }
    }
    findings.extend(least_likely_cell(case));
    // The light cells of two scales often are the same ones.
    separately
        .dedup_by(|a, b| (a.0, a.1.observed, a.1.mass.to_bits()) == (b.0, b.1.observed, b.1.mass.to_bits()));
    findings.extend(separately.into_iter().map(|(what, count)| exact(what, count, tally.samples)));
    if asked == 0 {
        findings.push(nothing_to_compare(case));
    }
    findings
}

/// The chi-square test at every scale whose cells expect enough of the samples so far, with Bonferroni's correction; `None` where there is none.
pub(super) fn p_of_counts(expectation: &Expectation, tally: &Tally) -> Option<f64> {
    let n = tally.samples as f64;
    if !(expectation.total.value.is_finite() && expectation.total.error.is_finite()) {
        return None;
    }
    let rejected = Count::new(tally.rejected, expectation.rejected());
    let scales = expectation.scales.iter().filter_map(|scale| {
        let ((masses, pool), (observed, in_pool)) = (expectation.masses_at(scale), observed(scale, tally));
        let cells = observed.iter().zip(masses).map(|(&o, m)| Count::new(o, m));
        if cells.clone().any(|c| c.mass * n < LEAST) {
            return None;
        }
        let others = [rejected, Count::new(in_pool, pool)].into_iter().filter(|c| c.mass * n >= LEAST);
        let counts: Vec<Count> = cells.chain(others).collect();
        let finding = (counts.len() > 1).then(|| pearson(&counts, n))?;
        finding.evidence.p_values().map(|(_, conservative)| conservative)
    });
    let (number, least) = scales.fold((0.0, f64::INFINITY), |(k, least), p| (k + 1.0, p.min(least)));
    (number > 0.0).then(|| (number * least).min(1.0))
}

fn nothing_to_compare(case: &Case<'_>) -> Finding {
    let (space, samples) = (case.probe.space(), case.tally.samples);
    let (verdict, detail) = if space.axes() == 0 && space.patches() == 1 {
        (Verdict::Pass, "there is only one entry to choose".to_owned())
    } else if case.tally.rejected == samples {
        (Verdict::Inconclusive, "every sample was rejected: there is nothing to judge".to_owned())
    } else {
        (Verdict::Inconclusive, format!("{samples} samples are too few: no two cells expect {LEAST} of them"))
    };
    Finding::certain(CHECK, verdict, detail)
}

/// Counts of the cells of a scale, and of its pool.
pub(super) fn observed(scale: &crate::domain::Groups, tally: &Tally) -> (Vec<u64>, u64) {
    let (mut counts, mut pool) = (vec![0; scale.cells.len()], 0);
    for (count, group) in tally.per_leaf.iter().zip(&scale.of_leaf) {
        *group.map_or(&mut pool, |g| &mut counts[g]) += count;
    }
    (counts, pool)
}

/// The cells of the finest scale; what has no place (rejected samples, the pool of light cells); and the cell of each leaf, `None` in the pool.
pub(super) fn figures(
    space: &dyn Space,
    expectation: &Expectation,
    tally: &Tally,
) -> (Vec<CellFigure>, Vec<CellFigure>, Vec<Option<usize>>) {
    let n = tally.samples as f64;
    let nowhere = |place: &str, observed: u64, mass: f64| CellFigure {
        cell: Cell { patches: 0..0, low: [0.0; 2], high: [0.0; 2] },
        place: place.to_owned(),
        observed,
        expected: mass * n,
        samples: tally.samples,
        others: 0,
    };
    let mut elsewhere = vec![nowhere("rejected", tally.rejected, expectation.rejected().value)];
    let Some(finest) = expectation.scales.last() else {
        return (Vec::new(), elsewhere, vec![None; tally.per_leaf.len()]);
    };
    let ((masses, pool), (observed, in_pool)) = (expectation.masses_at(finest), observed(finest, tally));
    let cells = finest.cells.iter().zip(masses).zip(observed).map(|((cell, mass), observed)| CellFigure {
        cell: cell.clone(),
        place: space.describe(cell),
        observed,
        expected: mass.value * n,
        samples: tally.samples,
        others: 0,
    });
    if in_pool > 0 || pool.value > 0.0 {
        elsewhere.push(nowhere("the pool of light cells", in_pool, pool.value));
    }
    (cells.collect(), elsewhere, finest.of_leaf.clone())
}

fn pearson(counts: &[Count], n: f64) -> Finding {
    let statistic = counts.iter().map(|c| (c.observed as f64 - n * c.mass).powi(2) / (n * c.mass)).sum();
    judge("X^2", statistic, counts, n).part(format!("{} cells", counts.len()))
}

/// G = 2 sum O ln(O / E) + E - O.
fn likelihood_ratio(counts: &[Count], n: f64) -> Finding {
    let statistic = counts.iter().map(|c| deviance(c.observed as f64, n * c.mass)).sum();
    judge("G", statistic, counts, n).part(format!("{} cells, G", counts.len()))
}

fn deviance(observed: f64, expected: f64) -> f64 {
    2.0 * if observed > 0.0 { observed * (observed / expected).ln() + expected - observed } else { expected }
}

fn judge(name: &str, statistic: f64, counts: &[Count], n: f64) -> Finding {
    let df = counts.len() as f64 - 1.0;
    let slack: f64 = counts.iter().map(|c| c.slack(n)).sum();
    let lowered = (statistic.max(0.0).sqrt() - slack.sqrt()).max(0.0).powi(2);
    let tail = |x: f64| chi_square::sf(x, df).unwrap_or(f64::NAN);
    let figures = format!("{name} = {statistic:.1} at {df} degrees of freedom");
    if slack > (2.0 * df).sqrt() {
        let evidence = match tail(lowered) {
            // Wrong even after the largest possible error is taken off.
            conservative if conservative < 1e-6 => Evidence::Chance { p: tail(statistic), conservative },
            _ => Evidence::Certain(Verdict::Inconclusive),
        };
        let detail = format!(
            "{figures}, but errors of the expected counts alone may make it {slack:.1}; if the density jumps, say along which lines (knots)"
        );
        return Finding::new(CHECK, evidence, detail);
    }
    let evidence = Evidence::Chance { p: tail(statistic), conservative: tail(lowered) };
    Finding::new(CHECK, evidence, figures)
}

/// Of all cells of the tree, from half of the mass down to single leaves, the one whose count is least likely, exactly.
///
/// Bonferroni's correction by weight (Rosenthal and Rubin 1983; Genovese, Roeder and Wasserman 2006): every size of cell gets the same part of the
/// level, which its cells share by their mass; a tenth goes to all cells alike, so that the lightest can answer too.
fn least_likely_cell(case: &Case<'_>) -> Option<Finding> {
    const ALIKE: f64 = 0.1;
    let (expectation, tally) = (case.expectation, case.tally);
    let n = tally.samples as f64;
    let mut before = vec![Count::default()];
    for (leaf, &observed) in expectation.leaves.iter().zip(&tally.per_leaf) {
        let last = before[before.len() - 1];
        before.push(Count {
            observed: last.observed + observed,
            mass: last.mass + leaf.value,
            error: last.error + leaf.error,
        });
    }
    let cells: Vec<(&Cell, Count)> = (expectation.partition.nodes().skip(1))
        .map(|(cell, leaves)| {
            let (a, b) = (before[leaves.start], before[leaves.end]);
            let observed = b.observed - a.observed;
            (cell, Count { observed, mass: (b.mass - a.mass).max(0.0), error: b.error - a.error })
        })
        .collect();
    let all: f64 = cells.iter().map(|(_, count)| count.mass).sum();
    let weight = |count: &Count| (1.0 - ALIKE) * count.mass / all.max(1e-300) + ALIKE / cells.len() as f64;
    let surprise = |count: &Count| surprise(count, n) + weight(count).ln();
    let (cell, count) = cells.iter().max_by(|a, b| surprise(&a.1).total_cmp(&surprise(&b.1)))?;
    let mut finding = exact("least likely cell", *count, tally.samples);
    if let Evidence::Chance { p, conservative } = &mut finding.evidence {
        for p in [p, conservative] {
            *p = (*p / weight(count)).min(1.0);
        }
    }
    let place = case.probe.space().describe(cell);
    finding.detail = format!("{}, at {place}; the worst of {} cells", finding.detail, cells.len());
    let level = 1e-5 * ALIKE / cells.len() as f64;
    let least =
        (1..1000).find(|&k| binomial::upper_tail(k, tally.samples, 1e-3 / n).is_ok_and(|p| p < level));
    Some(finding.sees(format!("{} samples where none are expected", least.unwrap_or(1000))))
}

/// About -ln p of a count under the nearest mass that its error allows: half of the deviance of the cell and of all else.
pub(super) fn surprise(count: &Count, n: f64) -> f64 {
    let observed = count.observed as f64;
    let near =
        observed.clamp(n * (count.mass - count.error).max(0.0), n * (count.mass + count.error).max(0.0));
    if observed == near {
        return 0.0;
    }
    0.5 * (deviance(observed, near.max(1e-300)) + deviance(n - observed, (n - near).max(1e-300)))
}

/// The exact test of one count whose probability is known to lie in an interval.
pub(super) fn exact(what: &str, count: Count, samples: u64) -> Finding {
    let n = samples as f64;
    let test = |mass: f64| {
        let mass = mass.clamp(0.0, 1.0);
        binomial::two_sided(count.observed, samples, mass).unwrap_or(f64::NAN)
    };
    let (low, high) = (count.mass - count.error, count.mass + count.error);
    let share = count.observed as f64 / n;
    let conservative = if share > high {
        test(high)
    } else if share < low {
        test(low)
    } else {
        1.0
    };
    let conservative = conservative.max(test(count.mass));
    // Between the ends of a narrow interval nobody can tell and nobody needs to: mass below its width is not claimed to be seen.
    let p = if count.error <= NARROW { conservative } else { test(count.mass) };
    let detail = format!(
        "{} samples where {:.3} +- {:.1e} were expected (exact binomial)",
        count.observed,
        n * count.mass,
        n * count.error
    );
    Finding::new(CHECK, Evidence::Chance { p, conservative }, detail).part(what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Groups, Interval};
    use crate::sampler::from_fn;
    use crate::verify::expectation::told;
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;

    #[track_caller]
    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{found}, not {expected}");
    }

    fn p_values(finding: &Finding) -> (f64, f64) {
        finding.evidence.p_values().unwrap()
    }

    #[test]
    fn deviances() {
        near(deviance(12.0, 10.0), 2.0 * (12.0 * 1.2_f64.ln() - 2.0));
        near(deviance(8.0, 10.0), 2.0 * (8.0 * 0.8_f64.ln() + 2.0));
        assert_eq!((deviance(0.0, 10.0), deviance(10.0, 10.0)), (20.0, 0.0));
    }

    /// An integral of which nothing is known is none, whatever its value.
    #[test]
    fn masses_without_a_known_error() {
        let line = Interval::new(0.0, 1.0);
        let (sampler, extras) = (from_fn(line, |u: f64| u, |_: f64| 1.0), Extras::default());
        let (probe, settings) = (Subject::new(&sampler, &extras), Settings::default());
        let expectation = told::expectation(&line, [told::integral(0.25, f64::INFINITY); 4], vec![]);
        let tally = Tally { samples: 100, per_leaf: vec![25; 4], ..Tally::default() };
        let case = Case { probe: &probe, expectation: &expectation, tally: &tally, settings: &settings };
        let [finding] = &findings(&case)[..] else { panic!("not one finding") };
        assert_eq!(finding.evidence, Evidence::Certain(Verdict::Inconclusive));
        assert_eq!(finding.detail, "the density has no finite integral to expect counts from");
    }

    /// Scales of which every cell expects eight samples have something to say, each other none yet.
    #[test]
    fn looks_at_few_samples() {
        let line = Interval::new(0.0, 1.0);
        let scale = |of_leaf: [usize; 4]| Groups {
            of_leaf: of_leaf.map(Some).into(),
            cells: vec![Cell::whole(&line); of_leaf[3] + 1],
        };
        let scales = vec![scale([0, 0, 1, 1]), scale([0, 1, 2, 3])];
        let expectation =
            Expectation { scales, ..told::expectation(&line, [told::integral(0.25, 0.0); 4], vec![]) };
        let p = |per_leaf: [u64; 4]| {
            let samples = per_leaf.iter().sum();
            p_of_counts(&expectation, &Tally { samples, per_leaf: per_leaf.into(), ..Tally::default() })
        };
        assert_eq!(p([3, 4, 4, 4]), None);
        // Halves expect eight of 16 and 15.5 of 31, quarters 7.75 of 31 and eight of 32.
        let tail = |statistic: f64, df: f64| chi_square::sf(statistic, df).unwrap();
        for (counts, expected) in [
            ([1, 3, 6, 6], tail(4.0, 1.0)),
            ([4, 4, 11, 12], tail(2.0 * 7.5 * 7.5 / 15.5, 1.0)),
            ([4, 4, 12, 12], 2.0 * tail(8.0, 1.0)),
            ([2, 14, 8, 8], 2.0 * tail(9.0, 3.0)),
        ] {
            let found = p(counts).unwrap();
            assert!((found - expected).abs() < 1e-6 * expected, "{counts:?}: {found}, not {expected}");
        }
    }

    #[test]
    fn surprises_beyond_what_an_error_explains() {
        let of = |observed: u64, error: f64| surprise(&Count { observed, mass: 0.25, error }, 400.0);
        near(of(130, 0.0), 0.5 * (deviance(130.0, 100.0) + deviance(270.0, 300.0)));
        near(of(80, 0.0), 0.5 * (deviance(80.0, 100.0) + deviance(320.0, 300.0)));
        // An error of 5% of all is 20 samples either way.
        near(of(130, 0.05), 0.5 * (deviance(130.0, 120.0) + deviance(270.0, 280.0)));
        near(of(70, 0.05), 0.5 * (deviance(70.0, 80.0) + deviance(330.0, 320.0)));
        assert_eq!((of(100, 0.0), of(119, 0.05), of(81, 0.05)), (0.0, 0.0, 0.0));
        // Errors beyond the mass leave nothing below 0.
        assert_eq!(of(0, 0.3), 0.0);
        near(
            surprise(&Count { observed: 3, mass: 0.0, error: 0.0 }, 400.0),
            0.5 * (deviance(3.0, 1e-300) + deviance(397.0, 400.0)),
        );
        near(surprise(&Count { observed: 0, mass: -0.5, error: 0.5 + 1e-3 }, 1e3) + 1.0, 1.0);
        near(
            surprise(&Count { observed: 399, mass: 1.0, error: 0.0 }, 400.0),
            0.5 * (deviance(399.0, 400.0) + deviance(1.0, 1e-300)),
        );
    }

    /// Of a mass that lies in an interval the nearest end is tested, which is the likeliest.
    #[test]
    fn exact_tests_of_masses_in_intervals() {
        let check = |(observed, mass, error): (u64, f64, f64), plain: f64, conservative: f64| {
            let found = p_values(&exact("", Count { observed, mass, error }, 1000));
            near(found.0, plain);
            near(found.1, conservative);
        };
        let two = |observed: u64, mass: f64| binomial::two_sided(observed, 1000, mass).unwrap();
        check((130, 0.1, 0.0), two(130, 0.1), two(130, 0.1));
        check((130, 0.1, 0.01), two(130, 0.1), two(130, 0.11));
        check((70, 0.1, 0.01), two(70, 0.1), two(70, 0.09));
        check((105, 0.1, 0.01), two(105, 0.1), 1.0);
        // A narrow interval is conclusive: 1e-4 is, a little more is not.
        check((130, 0.1, 1e-4), two(130, 0.1001), two(130, 0.1001));
        check((130, 0.1, 1.001e-4), two(130, 0.1), two(130, 0.100_100_1));
        // No mass is below 0 or above 1.
        check((0, 0.0, 0.1), 1.0, 1.0);
        check((999, 1.05, 0.01), 0.0, 0.0);
        let told = exact("some", Count { observed: 130, mass: 0.1, error: 0.01 }, 1000);
        let detail = "130 samples where 100.000 +- 1.0e1 were expected (exact binomial)";
        assert_eq!((told.check, told.part.as_str(), told.detail.as_str()), ("chi-square", "some", detail));
    }

    /// Errors of masses are taken off the statistic; where they alone may make it large, only a failure beyond them counts.
    #[test]
    fn statistics_less_what_errors_explain() {
        let count = |observed: u64, error: f64| Count { observed, mass: 0.25, error };
        let counts = |off: u64, error: f64| {
            vec![count(250 + off, error), count(250 - off, error), count(250, 0.0), count(250, 0.0)]
        };
        let tail = |x: f64| chi_square::sf(x, 3.0).unwrap();
        let sure = pearson(&counts(30, 0.0), 1000.0);
        assert_eq!(
            (sure.part.as_str(), sure.detail.as_str()),
            ("4 cells", "X^2 = 7.2 at 3 degrees of freedom")
        );
        near(p_values(&sure).0, tail(7.2));
        near(p_values(&sure).1, tail(7.2));
        // n error^2 / mass of two cells.
        let slack = 2.0 * 1000.0 * 0.01_f64.powi(2) / 0.25;
        let (p, conservative) = p_values(&pearson(&counts(30, 0.01), 1000.0));
        near(p, tail(7.2));
        near(conservative, tail((7.2_f64.sqrt() - slack.sqrt()).powi(2)));
        assert_eq!(p_values(&pearson(&counts(5, 0.01), 1000.0)).1, 1.0);
        // Their spread is sqrt 6: a slack of 2.4 is below it, one of 2.5 is not.
        let error = |slack: f64| (slack * 0.25 / 2000.0).sqrt();
        assert!(pearson(&counts(30, error(2.4)), 1000.0).evidence.p_values().is_some());
        let doubtful = pearson(&counts(30, error(2.5)), 1000.0);
        assert_eq!(doubtful.evidence, Evidence::Certain(Verdict::Inconclusive));
        let detail = "X^2 = 7.2 at 3 degrees of freedom, but errors of the expected counts alone may make it 2.5; if the density jumps, say along which lines (knots)";
        assert_eq!(doubtful.detail, detail);
        // (2 off^2 / 250): beyond all doubt at a tail of a millionth, at 30.66.
        let edge = (30.665_f64.sqrt() + 2.5_f64.sqrt()).powi(2);
        let off = |statistic: f64| (statistic * 125.0).sqrt();
        let wrong = pearson(&counts(off(edge).ceil() as u64, error(2.5)), 1000.0);
        let statistic = 2.0 * off(edge).ceil().powi(2) / 250.0;
        near(p_values(&wrong).0, tail(statistic));
        near(p_values(&wrong).1, tail((statistic.sqrt() - 2.5_f64.sqrt()).powi(2)));
        assert!(p_values(&wrong).1 < 1e-6 && wrong.detail.contains("may make it 2.5"));
        let unsure = pearson(&counts(off(edge).floor() as u64, error(2.5)), 1000.0);
        assert_eq!(unsure.evidence, Evidence::Certain(Verdict::Inconclusive));
        let g = likelihood_ratio(&counts(30, 0.0), 1000.0);
        let expected = deviance(280.0, 250.0) + deviance(220.0, 250.0);
        assert_eq!(g.part, "4 cells, G");
        near(p_values(&g).0, tail(expected));
    }
}
