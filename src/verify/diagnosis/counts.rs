//! The counts that hypotheses are fitted to, and how well masses fit them.

use crate::statistics::chi_square;
use crate::verify::check::Case;

/// Cells, at least and at most; as many between as leave this many samples to each.
const CELLS: [u64; 2] = [16, 1024];
const PER_CELL: u64 = 100;
/// An expected count that no hypothesis is held below: a single stray sample must not rule one out.
const LEAST: f64 = 1e-3;
/// A relative error of a mass from which on it is no more than a guess.
const SLIVER: f64 = 0.1;
/// A fit whose p-value is above this is taken for right.
const ACCEPTED: f64 = 1e-5;

/// Counts in cells that don't depend on which of claim and samples is right: their size is chosen by both.
pub(super) struct Counts {
    pub of_leaf: Vec<usize>,
    /// A cell's description.
    pub places: Vec<String>,
    pub observed: Vec<f64>,
    /// Claimed masses, as claimed.
    pub claimed: Vec<f64>,
    /// What quadrature can't tell of them.
    errors: Vec<f64>,
    /// Where it can tell hardly anything, how much more or less may be there: slivers of a support that ends in the cell.
    slivers: Vec<f64>,
    /// Samples in the cells.
    pub drawn: f64,
    /// All samples that say something: those and the rejected ones.
    pub all: f64,
    pub rejected: f64,
    pub rejected_claimed: f64,
}

impl Counts {
    pub fn new(case: &Case<'_>) -> Self {
        let (expectation, tally) = (case.expectation, case.tally);
        let (partition, leaves) = (&expectation.partition, &expectation.leaves);
        let total = expectation.total.value;
        // The pilots were samples, and each leaf has about as many.
        let share = 0.5 / leaves.len() as f64;
        let both: Vec<f64> = leaves.iter().map(|leaf| 0.5 * leaf.value / total + share).collect();
        let cells = (tally.samples / PER_CELL).clamp(CELLS[0], CELLS[1]);
        let groups = partition.group(&both, 1.0 / cells as f64, 0.0);
        let of_leaf: Vec<usize> = groups.of_leaf.iter().map(|g| g.unwrap_or(0)).collect();
        let observed = gather(&of_leaf, groups.cells.len(), tally.per_leaf.iter().map(|&count| count as f64));
        let claimed = gather(&of_leaf, groups.cells.len(), leaves.iter().map(|leaf| leaf.value));
        let errors = gather(&of_leaf, groups.cells.len(), leaves.iter().map(|leaf| leaf.error));
        let slivers = claimed
            .iter()
            .zip(&errors)
            .map(|(&mass, &error)| if error > SLIVER * mass { error / total } else { 0.0 })
            .collect();
        let (drawn, rejected) = (observed.iter().sum::<f64>(), tally.rejected as f64);
        Self {
            places: groups.cells.iter().map(|cell| case.probe.space().describe(cell)).collect(),
            of_leaf,
            observed,
            claimed,
            errors,
            slivers,
            drawn,
            all: drawn + rejected,
            rejected,
            rejected_claimed: expectation.rejected().value,
        }
    }

    /// The masses of the cells, which sum to 1.
    pub fn shape(&self, leaves: &[f64]) -> Option<Vec<f64>> {
        self.normalised(gather(&self.of_leaf, self.observed.len(), leaves.iter().copied()))
    }

    pub fn normalised(&self, mut masses: Vec<f64>) -> Option<Vec<f64>> {
        let total: f64 = masses.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        masses.iter_mut().for_each(|m| *m /= total);
        Some(masses)
    }

    /// G of the drawn samples against masses that sum to 1.
    pub fn g(&self, shape: &[f64]) -> f64 {
        let cell = |((&o, &m), &sliver): ((&f64, &f64), &f64)| {
            let (expected, loose) = (self.drawn * m, self.drawn * sliver);
            deviance(
                o,
                if loose > 0.0 { o.clamp((expected - loose).max(0.0), expected + loose) } else { expected },
            )
        };
        self.observed.iter().zip(shape).zip(&self.slivers).map(cell).sum()
    }

    /// G of all samples against the masses as claimed, whatever they sum to (Poisson deviance).
    pub fn g_claimed(&self) -> f64 {
        let cells: f64 =
            self.observed.iter().zip(&self.claimed).map(|(&o, &m)| deviance(o, self.all * m)).sum();
        cells + deviance(self.rejected, self.all * self.rejected_claimed)
    }

    /// Cells less one; one that expects a fraction of a sample counts as that fraction.
    pub fn df(&self, shape: &[f64]) -> f64 {
        (shape.iter().map(|m| (self.drawn * m).min(1.0)).sum::<f64>() - 1.0).max(1.0)
    }

    /// What errors of the masses may add to G.
    fn slack(&self, shape: &[f64]) -> f64 {
        let total: f64 = self.claimed.iter().sum();
        let cell = |(m, e): (&f64, &f64)| if *m > 0.0 { (e / total).powi(2) / m } else { 0.0 };
        self.drawn * shape.iter().zip(&self.errors).map(cell).sum::<f64>()
    }

    /// Whether masses with so many fitted parameters fit the counts.
    pub fn accepts(&self, shape: &[f64], parameters: u32) -> bool {
        let df = (self.df(shape) - f64::from(parameters)).max(1.0);
        let lowered = (self.g(shape).max(0.0).sqrt() - self.slack(shape).sqrt()).max(0.0).powi(2);
        chi_square::sf(lowered, df).is_ok_and(|p| p > ACCEPTED)
    }

    /// The noncentrality by which so many samples would tell one shape from another.
    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let cell = |(a, b): (&f64, &f64)| (a - b).powi(2) / (0.5 * (a + b)).max(LEAST / self.drawn);
        self.drawn * a.iter().zip(b).map(cell).sum::<f64>()
    }
}

fn gather(of_leaf: &[usize], cells: usize, leaves: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sums = vec![0.0; cells];
    of_leaf.iter().zip(leaves).for_each(|(&cell, value)| sums[cell] += value);
    sums
}

/// 2 [O ln(O / E) + E - O].
fn deviance(observed: f64, expected: f64) -> f64 {
    let expected = expected.max(LEAST);
    if observed == 0.0 {
        return 2.0 * expected;
    }
    let off = (expected - observed) / observed;
    // -ln(1 + x) + x, which cancels for small x.
    2.0 * observed * if off.abs() < 1e-4 { 0.5 * off * off } else { off - off.ln_1p() }
}
