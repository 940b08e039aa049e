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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Integral, Interval};
    use crate::sampler::{Sampler, from_fn};
    use crate::verify::expectation::told;
    use crate::verify::finding::Evidence;
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;
    use crate::verify::tally::Tally;

    /// An integral over 1 by less than it may be off proves nothing.
    #[test]
    fn how_much_is_over_1() {
        let sampler = from_fn(Interval::new(0.0, 1.0), |u: f64| u, |_: f64| 1.0);
        let extras = Extras::default();
        let (probe, tally, settings) =
            (Subject::new(&sampler, &extras), Tally::default(), Settings::default());
        for (value, error, verdict) in [
            (0.5, 0.0, Verdict::Pass),
            (1.000_009, 0.0, Verdict::Pass),
            (1.000_011, 0.0, Verdict::Fail),
            (1.01, 0.000_1, Verdict::Fail),
            (1.01, 0.009_98, Verdict::Fail),
            (1.01, 0.009_995, Verdict::Inconclusive),
            (1.01, 0.02, Verdict::Inconclusive),
            (f64::NAN, 0.0, Verdict::Inconclusive),
        ] {
            let mut expectation = told::expectation(&sampler.domain(), [Integral::default(); 4], vec![]);
            expectation.total = told::integral(value, error);
            let case = Case { probe: &probe, expectation: &expectation, tally: &tally, settings: &settings };
            let [finding] = &Normalisation.run(&case)[..] else { panic!("not one finding") };
            assert_eq!(finding.evidence, Evidence::Certain(verdict), "{value} +- {error}");
        }
    }
}
