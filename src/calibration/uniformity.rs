//! p-values against the uniform distribution.

use super::SIGNIFICANCE;
use super::observation::Observation;
use super::rate::Mode;
use crate::statistics::kolmogorov;
use std::collections::BTreeMap;

/// Fewer p-values than this are not tested.
const ENOUGH: usize = 20;

/// What a p-value claims of itself when all is well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Claim {
    /// It is uniform in [0, 1].
    Uniform,
    /// It is below u with probability u at most: exact tests of counts, corrected minima, grouped values, 1 / e.
    AtLeastUniform,
}

impl Claim {
    /// What is not known to be uniform claims no more than it must.
    fn of(check: &str, part: &str) -> Self {
        // "pool of light cells" is an exact test of one count.
        let table = check == "chi-square" && (part.starts_with('~') || part.starts_with("index modulo"));
        if table || check == "independence" { Self::Uniform } else { Self::AtLeastUniform }
    }
}

/// The p-values of one part of one check over many runs.
#[derive(Clone, Debug)]
pub struct Uniformity {
    /// The check.
    pub check: &'static str,
    /// Which part of it; numbers of cells, which differ from run to run, rounded to a power of 2.
    pub part: String,
    /// The sampler; `None` for all together.
    pub sampler: Option<String>,
    /// How the runs were made.
    pub mode: Mode,
    /// What they claim.
    pub claim: Claim,
    /// The p-values, sorted.
    pub p_values: Vec<f64>,
    /// The largest distance between the two distribution functions: D, or D+ if they claim to be at least uniform.
    pub distance: f64,
    /// Probability of such a distance if the claim is true, at most.
    pub p: f64,
    /// The same after correction over the whole calibration.
    pub adjusted_p: f64,
}

impl Uniformity {
    fn new(
        check: &'static str,
        part: String,
        sampler: Option<String>,
        mode: Mode,
        mut p_values: Vec<f64>,
    ) -> Self {
        p_values.sort_by(f64::total_cmp);
        let claim = Claim::of(check, &part);
        let n = p_values.len() as f64;
        let above = |(i, p): (usize, &f64)| (i as f64 + 1.0) / n - p;
        let (distance, p) = match claim {
            // Sorted probabilities: nothing to refuse.
            Claim::Uniform => kolmogorov::one_sample(&p_values).map_or((0.0, 1.0), |f| (f.statistic, f.p)),
            Claim::AtLeastUniform => {
                let distance = p_values.iter().enumerate().map(above).fold(0.0, f64::max);
                // Twice, since the bound holds from 1/2 down only.
                (distance, (2.0 * (-2.0 * n * distance * distance).exp()).min(1.0))
            }
        };
        Self { check, part, sampler, mode, claim, p_values, distance, p, adjusted_p: p }
    }

    /// Whether the claim is refuted.
    pub fn refuted(&self) -> bool {
        self.adjusted_p < SIGNIFICANCE
    }

    /// The empirical distribution function at `p`: the share of p-values no larger.
    pub fn share_up_to(&self, p: f64) -> f64 {
        self.p_values.partition_point(|&x| x <= p) as f64 / self.p_values.len().max(1) as f64
    }
}

/// "187 cells" and "190 cells" of two seeds are the same part.
fn same_in_all_runs(part: &str) -> String {
    let Some((number, rest)) = part.split_once(' ').filter(|(_, rest)| rest.starts_with("cells")) else {
        return part.to_owned();
    };
    match number.parse::<f64>() {
        Ok(cells) if cells >= 1.0 => format!("~{} {rest}", 2.0_f64.powi(cells.log2().round() as i32)),
        _ => part.to_owned(),
    }
}

pub(super) fn parts(names: &[&str], observations: &[(usize, Mode, Observation)]) -> Vec<Uniformity> {
    let mut found = Vec::new();
    for mode in [Mode::Fixed, Mode::Anytime] {
        // In a run that stops early only the bets are new: the rest was tested in runs of fixed length.
        let counts = |check: &str| mode == Mode::Fixed || check == "sequential";
        let mut values: BTreeMap<(&'static str, String, Option<usize>), Vec<f64>> = BTreeMap::new();
        for (which, _, observation) in observations.iter().filter(|o| o.1 == mode) {
            for (check, part, p) in observation.p_values.iter().filter(|(check, ..)| counts(check)) {
                // NaN: it is inconclusive and says nothing.
                if (0.0..=1.0).contains(p) {
                    let part = same_in_all_runs(part);
                    for sampler in [None, Some(*which)] {
                        values.entry((*check, part.clone(), sampler)).or_default().push(*p);
                    }
                }
            }
        }
        let enough = values.into_iter().filter(|(_, values)| values.len() >= ENOUGH);
        found.extend(enough.map(|((check, part, sampler), values)| {
            Uniformity::new(check, part, sampler.map(|i| names[i].to_owned()), mode, values)
        }));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_cells_are_told_apart_by_scale() {
        assert_eq!(same_in_all_runs("187 cells, G"), "~128 cells, G");
        assert_eq!(same_in_all_runs("1368 cells"), "~1024 cells");
        assert_eq!(same_in_all_runs("index modulo 61"), "index modulo 61");
        assert_eq!(same_in_all_runs("axis 0, KS"), "axis 0, KS");
    }

    #[test]
    fn each_side_is_tested_as_claimed() {
        let of = |check, part: &str, power: f64| {
            let values = (0..2000).map(|i| ((f64::from(i) + 0.5) / 2000.0).powf(power)).collect();
            Uniformity::new(check, part.to_owned(), None, Mode::Fixed, values).refuted()
        };
        for (check, part) in
            [("chi-square", "~128 cells"), ("chi-square", "pool of light cells"), ("weights", "")]
        {
            assert!(!of(check, part, 1.0) && of(check, part, 1.3), "{check} {part}: small p-values");
        }
        // Too large: refutes only the claim to be uniform.
        assert!(of("chi-square", "~128 cells", 0.7) && of("independence", "two streams", 0.7));
        assert!(!of("chi-square", "pool of light cells", 0.7) && !of("distribution", "axis 0, KS", 0.7));
    }
}
