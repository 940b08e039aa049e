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
        let table = check == "chi-square" && (part.starts_with("scale ") || part.starts_with("index modulo"));
        if table || check == "independence" { Self::Uniform } else { Self::AtLeastUniform }
    }
}

/// The p-values of one part of one check over many runs.
#[derive(Clone, Debug)]
pub struct Uniformity {
    /// The check.
    pub check: &'static str,
    /// Which part of it; `scale 1` are the coarsest cells, whose number differs from run to run.
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

/// Gives the parts of one run, in order, names that are the same in all runs: "187 cells" and "190 cells" of two seeds are both "scale 2".
struct Scales {
    cells: String,
    scale: u32,
}

impl Scales {
    fn new() -> Self {
        Self { cells: String::new(), scale: 0 }
    }

    fn name(&mut self, check: &str, part: &str) -> String {
        let Some((cells, rest)) = part.split_once(" cells").filter(|_| check == "chi-square") else {
            return part.to_owned();
        };
        if !cells.bytes().all(|c| c.is_ascii_digit()) {
            return part.to_owned();
        }
        // X^2 and G of the same cells.
        if cells != self.cells {
            (self.cells, self.scale) = (cells.to_owned(), self.scale + 1);
        }
        format!("scale {}{rest}", self.scale)
    }
}

pub(super) fn parts(names: &[&str], observations: &[(usize, Mode, Observation)]) -> Vec<Uniformity> {
    let mut found = Vec::new();
    for mode in [Mode::Fixed, Mode::Anytime] {
        // In a run that stops early only the bets are new: the rest was tested in runs of fixed length.
        let counts = |check: &str| mode == Mode::Fixed || check == "sequential";
        let mut values: BTreeMap<(&'static str, String, Option<usize>), Vec<f64>> = BTreeMap::new();
        for (which, _, observation) in observations.iter().filter(|o| o.1 == mode) {
            let mut scales = Scales::new();
            for (check, part, p) in observation.p_values.iter().filter(|(check, ..)| counts(check)) {
                let part = scales.name(check, part);
                // NaN: it is inconclusive and says nothing.
                if (0.0..=1.0).contains(p) {
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
    fn scales_have_the_same_name_in_all_runs() {
        let names = |parts: &[&str]| {
            let mut scales = Scales::new();
            parts.iter().map(|part| scales.name("chi-square", part)).collect::<Vec<_>>()
        };
        let expected = ["scale 1", "scale 1, G", "scale 2", "index modulo 61", "pool of light cells"];
        for [coarse, fine] in [["24", "187"], ["22", "300"]] {
            let (coarse, g, fine) =
                (format!("{coarse} cells"), format!("{coarse} cells, G"), format!("{fine} cells"));
            assert_eq!(names(&[&coarse, &g, &fine, expected[3], expected[4]]), expected);
        }
        assert_eq!(Scales::new().name("weights", "9 cells"), "9 cells");
    }

    #[test]
    fn each_side_is_tested_as_claimed() {
        let of = |check, part: &str, power: f64| {
            let values = (0..2000).map(|i| ((f64::from(i) + 0.5) / 2000.0).powf(power)).collect();
            Uniformity::new(check, part.to_owned(), None, Mode::Fixed, values).refuted()
        };
        for (check, part) in
            [("chi-square", "scale 2"), ("chi-square", "pool of light cells"), ("weights", "")]
        {
            assert!(!of(check, part, 1.0) && of(check, part, 1.3), "{check} {part}: small p-values");
        }
        // Too large: refutes only the claim to be uniform.
        assert!(of("chi-square", "scale 2", 0.7) && of("independence", "two streams", 0.7));
        assert!(!of("chi-square", "pool of light cells", 0.7) && !of("distribution", "axis 0, KS", 0.7));
    }
}
