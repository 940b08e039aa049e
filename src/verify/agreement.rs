//! The density returned with a sample is the density asked at its point.

use super::check::{Case, Check, Needs, Rests};
use super::finding::{Finding, Verdict};

pub(super) struct Agreement;

impl Check for Agreement {
    fn name(&self) -> &'static str {
        "agreement"
    }

    fn about(&self) -> &'static str {
        "the density returned with a sample is the density asked at its point"
    }

    fn rests(&self) -> Rests {
        Rests::NoCounts
    }

    fn needs(&self) -> Needs {
        Needs::TwoDensities
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let found = case.tally.with_pilots().disagreement;
        vec![match &found.example {
            _ if found.asked == 0 => Finding::certain(
                self.name(),
                Verdict::Inconclusive,
                "no sample had a density to compare",
            ),
            Some(example) => Finding::certain(
                self.name(),
                Verdict::Fail,
                format!(
                    "the density returned differs from the density asked for {} of {} samples, at worst by a factor of 1 + {:.2e}: {} ({})",
                    found.wrong, found.asked, found.worst, example.what, example.sample
                ),
            ),
            None => Finding::certain(
                self.name(),
                Verdict::Pass,
                format!(
                    "the density returned is the density asked, within 1e-4 or a rounding of the point, for all {} samples asked",
                    found.asked
                ),
            )
            .sees(format!("a difference for {:.0e} or more of the samples", 4.6 / found.asked as f64)),
        }]
    }
}
