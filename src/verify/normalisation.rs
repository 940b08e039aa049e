//! The density integrates to 1 less the rejected mass. That it is no more than 1 is certain; whether what is missing was rejected is
//! a matter of counts, tested with the cells.

use super::expectation::Expectation;
use super::finding::{Finding, Verdict};

const CHECK: &str = "normalisation";
/// What `f32` densities may add up to too much.
const ROUNDING: f64 = 1e-5;

pub(super) fn check(expectation: &Expectation) -> Finding {
    let total = expectation.total;
    let figures = format!("the density integrates to {:.7} +- {:.1e}", total.value, total.error);
    if let Some(contradiction) = &expectation.contradiction {
        return Finding::certain(CHECK, Verdict::Fail, contradiction.clone());
    }
    if total.value.is_nan() || total.value - total.error < 0.0 && total.value < 0.0 {
        return Finding::certain(CHECK, Verdict::Fail, figures);
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
