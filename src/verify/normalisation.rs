//! The density integrates to 1 less the rejected mass. That it is no more than 1 is certain; whether what is missing was rejected is
//! a matter of counts, tested with the cells.

use super::check::{Case, Check, Needs, Rests};
use super::finding::{Finding, Verdict};

/// What `f32` densities may add up to too much.
const ROUNDING: f64 = 1e-5;

pub(super) struct Normalisation;

impl Check for Normalisation {
    fn name(&self) -> &'static str {
        "normalisation"
    }

    fn about(&self) -> &'static str {
        "the density integrates to 1, less what is rejected, and is a density wherever quadrature looks"
    }

    fn rests(&self) -> Rests {
        Rests::Quadrature
    }

    fn needs(&self) -> Needs {
        Needs::Density
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let total = case.expectation.total;
        let certain = |verdict, detail: String| vec![Finding::certain(self.name(), verdict, detail)];
        if let Some((place, value)) = total.bad {
            let point = case.probe.describe(place.patch, place.at);
            return certain(Verdict::Fail, format!("the density at {point} is {value}"));
        }
        let figures = format!(
            "the density integrates to {:.7} +- {:.1e}, and {:.3e} of the samples were rejected",
            total.value,
            total.error,
            case.tally.rejected as f64 / case.tally.samples.max(1) as f64
        );
        if let Some(contradiction) = &case.expectation.contradiction {
            return certain(Verdict::Fail, contradiction.clone());
        }
        if !total.value.is_finite() {
            return certain(Verdict::Inconclusive, figures);
        }
        let over = total.value - 1.0;
        let verdict = if over <= ROUNDING {
            Verdict::Pass
        } else if over > total.error + ROUNDING {
            Verdict::Fail
        } else {
            Verdict::Inconclusive
        };
        let sees = format!("an integral more than {:.1e} over 1", ROUNDING + total.error);
        certain(verdict, figures).into_iter().map(|f| f.sees(sees.clone())).collect()
    }
}
