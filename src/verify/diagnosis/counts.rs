//! The counts that hypotheses are fitted to, and how well masses fit them.

use crate::statistics::chi_square;
use crate::verify::check::Case;

/// Cells, at least and at most; between as many, or up to twice as many, as leave this many samples to each.
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

#[cfg(test)]
impl Counts {
    /// Each leaf a cell, its mass known exactly.
    pub fn exact(observed: &[f64], claimed: &[f64], rejected: f64) -> Self {
        let (cells, drawn) = (observed.len(), observed.iter().sum::<f64>());
        Self {
            of_leaf: (0..cells).collect(),
            places: (0..cells).map(|cell| format!("cell {cell}")).collect(),
            observed: observed.to_vec(),
            claimed: claimed.to_vec(),
            errors: vec![0.0; cells],
            slivers: vec![0.0; cells],
            drawn,
            all: drawn + rejected,
            rejected,
            rejected_claimed: 1.0 - claimed.iter().sum::<f64>(),
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Discrete, Knots, Location, Partition};
    use crate::sampler::{Sampler, from_fn};
    use crate::verify::expectation::{Expectation, told};
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;
    use crate::verify::tally::Tally;

    #[track_caller]
    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{found}, not {expected}");
    }

    /// 1000 samples in three cells, 200 rejected.
    fn counts() -> Counts {
        Counts {
            of_leaf: vec![0, 1, 1, 2],
            places: vec![String::new(); 3],
            observed: vec![500.0, 300.0, 200.0],
            claimed: vec![0.45, 0.27, 0.18],
            errors: vec![0.0, 0.009, 0.018],
            slivers: vec![0.0, 0.0, 0.02],
            drawn: 1000.0,
            all: 1200.0,
            rejected: 200.0,
            rejected_claimed: 0.1,
        }
    }

    /// G = 2 sum O ln(O / E) + E - O.
    fn g(cells: &[(f64, f64)]) -> f64 {
        cells.iter().map(|(o, e)| 2.0 * (o * (o / e).ln() + e - o)).sum()
    }

    #[test]
    fn deviances() {
        near(deviance(12.0, 10.0), g(&[(12.0, 10.0)]));
        near(deviance(8.0, 10.0), g(&[(8.0, 10.0)]));
        assert_eq!((deviance(10.0, 10.0), deviance(0.0, 10.0), deviance(0.0, 0.0)), (0.0, 20.0, 2e-3));
        // No hypothesis is held below a thousandth of a sample.
        near(deviance(1.0, 0.0), g(&[(1.0, 1e-3)]));
        // Near each other only the square is left of O (x^2 - 2 x^3 / 3 + …); beyond it is not, nor where it cancels.
        near(deviance(1e6, 1e6 + 90.0), 1e6 * 9e-5_f64.powi(2));
        near(deviance(1e6, 1e6 - 90.0), 1e6 * 9e-5_f64.powi(2));
        for x in [1.1e-4_f64, -1.1e-4] {
            let series = 1e6 * (x * x - 2.0 / 3.0 * x.powi(3));
            assert!((deviance(1e6, 1e6 * (1.0 + x)) / series - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn fits() {
        let counts = counts();
        assert_eq!(counts.shape(&[1.0, 1.0, 0.5, 1.5]), Some(vec![0.25, 0.375, 0.375]));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(counts.shape(&[bad; 4]), None);
        }
        // The last cell may have 20 samples more or less: 230 are the nearest to the 200 that it has.
        near(counts.g(&[0.5, 0.25, 0.25]), g(&[(300.0, 250.0), (200.0, 230.0)]));
        near(counts.g(&[0.5, 0.35, 0.15]), g(&[(300.0, 350.0), (200.0, 170.0)]));
        near(counts.g(&[0.51, 0.3, 0.19]), g(&[(500.0, 510.0)]));
        // As claimed, of all 1200 samples, 120 of them rejected.
        let claimed = g(&[(500.0, 540.0), (300.0, 324.0), (200.0, 216.0), (200.0, 120.0)]);
        near(counts.g_claimed(), claimed);
        // Cells less one, those that expect less than a sample by what they expect.
        assert_eq!((counts.df(&[0.5, 0.3, 0.2]), counts.df(&[0.9995, 0.0005, 0.0])), (2.0, 1.0));
        let many = Counts { drawn: 100.0, ..self::counts() };
        near(many.df(&[0.5, 0.4, 0.075, 0.025, 0.004, 0.006]), 4.0);
        // Errors of 1% and 2% of the mass, in cells of 30% and 20% of it; of a cell without mass none.
        near(counts.slack(&[0.5, 0.3, 0.2]), 1000.0 * (1e-4 / 0.3 + 4e-4 / 0.2));
        near(counts.slack(&[0.7, 0.3, 0.0]), 1000.0 * 1e-4 / 0.3);
        // The noncentrality of one shape under the mean of two.
        near(counts.distance(&[0.5, 0.3, 0.2], &[0.4, 0.3, 0.3]), 1000.0 * (0.01 / 0.45 + 0.01 / 0.25));
        near(
            counts.distance(&[1.0, 0.0, 0.0], &[1.0 - 1e-7, 1e-7, 0.0]),
            1000.0 * (1e-14 / (1.0 - 0.5e-7) + 1e-14 / 1e-6),
        );
    }

    /// Of 64 entries 8 have half of the mass, which is `total`, and all were drawn alike.
    fn of_entries(total: f64, errors: &[f64]) -> Counts {
        let sampler = from_fn(Discrete::new(64), |u: f64| (64.0 * u) as usize, |_: usize| 1.0 / 64.0);
        let space = sampler.domain();
        let entries = (0..64).map(|patch| Location { patch, at: [0.0; 2] }).collect();
        let mass = |entry: usize| total * 0.5 / if entry < 8 { 8.0 } else { 56.0 };
        let integral = |i: usize| told::integral(mass(i), errors.get(i).map_or(0.0, |error| mass(i) * error));
        let leaves: Vec<_> = (0..64).map(integral).collect();
        let expectation = Expectation {
            partition: Partition::from_pilots(&space, entries, &Knots::default(), 1),
            total: told::integral(total, 0.0),
            leaves,
            ..told::expectation(&space, [told::integral(0.0, 0.0); 4], vec![])
        };
        let tally = Tally { samples: 1400, per_leaf: vec![20; 64], rejected: 120, ..Tally::default() };
        let (extras, settings) = (Extras::default(), Settings::default());
        let probe = Subject::new(&sampler, &extras);
        Counts::new(&Case { probe: &probe, expectation: &expectation, tally: &tally, settings: &settings })
    }

    /// Cells hold a sixteenth of claim and samples together at most, whatever the claimed masses sum to.
    #[test]
    fn cells_of_claim_and_samples() {
        for total in [1.0, 0.125, 8.0] {
            let counts = of_entries(total, &[]);
            // A heavy entry is a cell, of a 32nd and a 128th; of the others four are, of an 80th each.
            assert_eq!(counts.of_leaf[..8], [0, 1, 2, 3, 4, 5, 6, 7]);
            assert_eq!(counts.observed.len(), 8 + 14);
            assert_eq!((counts.drawn, counts.all, counts.rejected), (1280.0, 1400.0, 120.0));
        }
    }

    /// Masses that are known to less than a tenth may be so much more or less, as a share of all.
    #[test]
    fn masses_that_are_guesses() {
        for total in [1.0, 0.125] {
            let counts = of_entries(total, &[0.11, 0.09, 0.0, 3.0]);
            near(counts.slivers[0], 0.11 / 16.0);
            near(counts.slivers[3], 3.0 / 16.0);
            let guesses: Vec<_> = (0..22).filter(|&cell| counts.slivers[cell] > 0.0).collect();
            assert_eq!(guesses, [0, 3]);
        }
    }

    #[test]
    fn which_fits_are_accepted() {
        let exact = |observed: [f64; 3], errors: [f64; 3]| Counts {
            observed: observed.into(),
            errors: errors.into(),
            slivers: vec![0.0; 3],
            drawn: observed.iter().sum(),
            ..counts()
        };
        let shape = [0.5, 0.3, 0.2];
        // At two degrees of freedom the tail is e^(-G / 2): G = 23.03 has a hundred-thousandth.
        let at = |more: f64| exact([500.0 + more, 300.0 - more, 200.0], [0.0; 3]);
        let (inside, outside) = (64.0, 65.0);
        assert!(at(inside).g(&shape) < 23.02 && at(outside).g(&shape) > 23.04);
        assert!(at(inside).accepts(&shape, 0) && !at(outside).accepts(&shape, 0));
        // A fitted parameter takes one of them, and then 19.5 has it; there is always one left.
        let (inside, outside) = (59.0, 60.0);
        assert!(at(inside).g(&shape) < 19.5 && at(outside).g(&shape) > 19.6);
        for parameters in [1, 2, 5] {
            assert!(at(inside).accepts(&shape, parameters) && !at(outside).accepts(&shape, parameters));
        }
        // What errors may add is taken off: the root of the slack from the root of G, which must come below that of 23.03.
        let with_error = |slack: f64| {
            let error = 0.9 * (0.3 * slack / 1000.0).sqrt();
            exact([575.0, 225.0, 200.0], [0.0, error, 0.0])
        };
        let g = with_error(0.0).g(&shape);
        let enough = (g.sqrt() - 23.03_f64.sqrt()).powi(2);
        assert!(
            with_error(1.05 * enough).accepts(&shape, 0) && !with_error(0.95 * enough).accepts(&shape, 0)
        );
    }
}
