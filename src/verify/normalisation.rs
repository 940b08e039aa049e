//! The density integrates to 1 less the rejected mass. That it is no more than 1 is certain; whether what is missing was rejected is
//! a matter of counts, tested with the cells.

use super::expectation::Expectation;
use super::finding::{Finding, Verdict};
use crate::domain::Domain;

const CHECK: &str = "normalisation";
/// What `f32` densities may add up to too much.
const ROUNDING: f64 = 1e-5;

pub(super) fn check<D: Domain>(domain: &D, expectation: &Expectation, rejected: f64) -> Finding {
    let total = expectation.total;
    if let Some((place, value)) = total.bad {
        let point = domain.point(place.patch, place.at).0;
        return Finding::certain(CHECK, Verdict::Fail, format!("the density at {point:?} is {value}"));
    }
    let figures = format!(
        "the density integrates to {:.7} +- {:.1e}, and {:.3e} of the samples were rejected",
        total.value, total.error, rejected
    );
    if let Some(contradiction) = &expectation.contradiction {
        return Finding::certain(CHECK, Verdict::Fail, contradiction.clone());
    }
    if !total.value.is_finite() {
        return Finding::certain(CHECK, Verdict::Inconclusive, figures);
    }
    let over = total.value - 1.0;
    let verdict = if over <= ROUNDING {
        Verdict::Pass
    } else if over > total.error + ROUNDING {
        Verdict::Fail
    } else {
        Verdict::Inconclusive
    };
    Finding::certain(CHECK, verdict, figures)
}
