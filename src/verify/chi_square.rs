//! Counts against expected counts, at several scales.
//!
//! Pearson's X^2 = sum (O - E)^2 / E over cells of about equal expected mass. At each scale
//! - cells that expect fewer than [`LEAST`] samples are pooled, and the pool is a cell like the others, or is tested exactly
//!   (binomial) if it expects few samples itself;
//! - rejected samples are a cell: they expect 1 minus the integral of the density;
//! - errors of the expected counts lower the statistic before it fails anybody: sqrt(X^2) is a norm of (O - E) / sqrt E, so
//!   the true one is at least sqrt(X^2) - sqrt(sum (n err)^2 / E).
//!
//! A discrete domain with more entries than cells is also counted by the remainder of the index, so that entries which lie between each other (a table
//! that reaches only every second one) don't hide in one cell.
//!
//! Coarse cells see a slight error over much of the mass, fine ones a strong error in a small place; their p-values are corrected together.

use super::expectation::{Expectation, MODULI};
use super::finding::{Evidence, Finding, Verdict};
use super::map::CellFigure;
use super::tally::Tally;
use crate::domain::{Cell, Domain};
use crate::statistics::{binomial, chi_square};

const CHECK: &str = "chi-square";
/// Cells that expect fewer samples are pooled (Cochran 1954 has 5 as the usual bound).
const LEAST: f64 = 8.0;
/// An error of a mass, absolute, that leaves an exact test conclusive.
const NARROW: f64 = 1e-4;
/// Numbers of cells that the scales aim at; the finest ones are there only if there are samples for them.
const SCALES: [usize; 5] = [16, 128, 1024, 8192, 65536];
/// Below this many samples a cell a finer scale is not worth a test of its own.
const WORTH: f64 = 100.0;

pub(super) struct Outcome {
    pub findings: Vec<Finding>,
    /// The cells of the finest scale.
    pub cells: Vec<CellFigure>,
    /// What has no place: the rejected samples, and the pool of light cells at the finest scale.
    pub elsewhere: Vec<CellFigure>,
    /// The cell of each leaf, `None` in the pool.
    pub cell_of_leaf: Vec<Option<usize>>,
    /// Degrees of freedom of each scale.
    pub degrees: Vec<u64>,
}

pub(super) fn check<D: Domain>(domain: &D, expectation: &Expectation, tally: &Tally) -> Outcome {
    let n = tally.samples as f64;
    let masses = expectation.masses();
    let mut outcome = Outcome {
        findings: Vec::new(),
        cells: Vec::new(),
        elsewhere: Vec::new(),
        cell_of_leaf: vec![None; masses.len()],
        degrees: Vec::new(),
    };
    if !(expectation.total.value.is_finite() && expectation.total.error.is_finite()) {
        outcome.findings.push(Finding::certain(
            CHECK,
            Verdict::Inconclusive,
            "the density has no finite integral to expect counts from",
        ));
        return outcome;
    }
    let rejected = Count {
        observed: tally.rejected,
        mass: (1.0 - expectation.total.value).max(0.0),
        error: expectation.total.error + 1e-6,
    };
    let figure = |place: &str, count: Count| CellFigure {
        cell: Cell { patches: 0..0, low: [0.0; 2], high: [0.0; 2] },
        place: place.to_owned(),
        observed: count.observed,
        expected: count.mass * n,
        samples: tally.samples,
    };
    let mut separately = Vec::new();
    // A rejected mass that is all quadrature error is no cell: the exact test knows what to do with an interval.
    let rejected_is_cell = rejected.mass * n >= LEAST && rejected.slack(n) < 0.5;
    if !rejected_is_cell {
        separately.push(("rejected", rejected));
    }
    let mut last_cells = 0;
    for scale in SCALES.into_iter().filter(|&scale| scale <= 1024 || n / scale as f64 >= WORTH) {
        let groups = expectation.partition.group(&masses, 1.0 / scale as f64, LEAST / n);
        if groups.cells.len() == last_cells {
            continue;
        }
        last_cells = groups.cells.len();
        let mut counts = vec![Count::default(); groups.cells.len()];
        let mut pool = Count::default();
        for (leaf, group) in groups.of_leaf.iter().enumerate() {
            let count = group.map_or(&mut pool, |g| &mut counts[g]);
            count.observed += tally.per_leaf[leaf];
            count.mass += expectation.leaves[leaf].value;
            count.error += expectation.leaves[leaf].error;
        }
        outcome.cells = (counts.iter().zip(&groups.cells))
            .map(|(count, cell)| CellFigure {
                cell: cell.clone(),
                place: domain.describe(cell),
                observed: count.observed,
                expected: count.mass * n,
                samples: tally.samples,
            })
            .collect();
        outcome.cell_of_leaf = groups.of_leaf;
        outcome.elsewhere = vec![figure("rejected", rejected)];
        if pool.observed > 0 || pool.mass > 0.0 {
            outcome.elsewhere.push(figure("the pool of light cells", pool));
        }
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
        outcome.degrees.push(counts.len() as u64 - 1);
        outcome.findings.push(pearson(&counts, n));
    }
    let remainders = expectation.remainders.iter().zip(&tally.remainders);
    for (modulus, (masses, observed)) in MODULI.into_iter().zip(remainders) {
        let counts: Vec<Count> = masses
            .iter()
            .zip(observed)
            .map(|(&mass, &observed)| Count { observed, mass, error: 0.0 })
            .collect();
        if counts.iter().all(|c| c.mass * n >= LEAST) && rejected.mass * n < LEAST {
            let mut finding = pearson(&counts, n);
            finding.part = format!("index modulo {modulus}");
            outcome.findings.push(finding);
        }
    }
    // The light cells of two scales often are the same ones.
    separately
        .dedup_by(|a, b| (a.0, a.1.observed, a.1.mass.to_bits()) == (b.0, b.1.observed, b.1.mass.to_bits()));
    for (what, count) in separately {
        outcome.findings.push(exact(what, count, tally.samples));
    }
    if outcome.degrees.is_empty() {
        let detail = match expectation.partition.leaves().len() {
            1 if domain.axes() == 0 && domain.patches() == 1 => {
                Finding::certain(CHECK, Verdict::Pass, "there is only one entry to choose")
            }
            _ if tally.rejected == tally.samples => Finding::certain(
                CHECK,
                Verdict::Inconclusive,
                "every sample was rejected: there is nothing to judge",
            ),
            _ => Finding::certain(
                CHECK,
                Verdict::Inconclusive,
                format!("{} samples are too few: no two cells expect {LEAST} of them", tally.samples),
            ),
        };
        outcome.findings.push(detail);
    }
    outcome
}

#[derive(Clone, Copy, Debug, Default)]
struct Count {
    observed: u64,
    mass: f64,
    error: f64,
}

impl Count {
    /// What the error of the expected count can add to the statistic of `n` samples, at most.
    fn slack(&self, n: f64) -> f64 {
        n * self.error.powi(2) / self.mass
    }
}

fn pearson(counts: &[Count], n: f64) -> Finding {
    let df = counts.len() as f64 - 1.0;
    let statistic: f64 = counts.iter().map(|c| (c.observed as f64 - n * c.mass).powi(2) / (n * c.mass)).sum();
    let slack: f64 = counts.iter().map(|c| c.slack(n)).sum();
    let lowered = (statistic.sqrt() - slack.sqrt()).max(0.0).powi(2);
    let tail = |x: f64| chi_square::sf(x, df).unwrap_or(f64::NAN);
    let part = format!("{} cells", counts.len());
    let figures = format!("X^2 = {statistic:.1} at {df} degrees of freedom");
    if slack > (2.0 * df).sqrt() {
        return Finding {
            check: CHECK,
            part,
            evidence: match tail(lowered) {
                // Wrong even after the largest possible error is taken off.
                conservative if conservative < 1e-6 => Evidence::Chance { p: tail(statistic), conservative },
                _ => Evidence::Certain(Verdict::Inconclusive),
            },
            detail: format!(
                "{figures}, but errors of the expected counts alone may make it {slack:.1}; if the density jumps, say along which lines (knots)"
            ),
        };
    }
    let evidence = Evidence::Chance { p: tail(statistic), conservative: tail(lowered) };
    Finding { check: CHECK, part, evidence, detail: figures }
}

/// The exact test of one count whose probability is known to lie in an interval.
fn exact(what: &str, count: Count, samples: u64) -> Finding {
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
    Finding {
        check: CHECK,
        part: what.to_owned(),
        evidence: Evidence::Chance { p, conservative },
        detail: format!(
            "{} samples where {:.3} +- {:.1e} were expected (exact binomial)",
            count.observed,
            n * count.mass,
            n * count.error
        ),
    }
}
