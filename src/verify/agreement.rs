//! The density returned with a sample is the density asked at its point.

use super::finding::{Finding, Verdict};
use super::tally::Tally;

const CHECK: &str = "agreement";
/// Samples on the edge of a support may be rounded across it; more than this share is no rounding.
const BORDER_SHARE: f64 = 1e-4;

pub(super) fn check(tally: &Tally) -> Finding {
    let found = &tally.disagreement;
    match &found.example {
        _ if found.asked == 0 => {
            Finding::certain(CHECK, Verdict::Inconclusive, "no sample had a density to compare")
        }
        Some(example) => Finding::certain(
            CHECK,
            Verdict::Fail,
            format!(
                "the density returned differs from the density asked for {} of {} samples, at worst by a factor of 1 + {:.2e}: {} (xi = {:?})",
                found.wrong, found.asked, found.worst, example.what, example.xi
            ),
        ),
        _ => Finding::certain(
            CHECK,
            Verdict::Pass,
            format!(
                "the density returned is the density asked, within 1e-4 or a rounding of the point, for all {} samples asked",
                found.asked
            ),
        ),
    }
}

/// Samples outside of the domain, without density or with an impossible one.
pub(super) fn support(tally: &Tally) -> Finding {
    const CHECK: &str = "support";
    for (offences, what) in [
        (&tally.outside, "are outside of the domain"),
        (&tally.invalid, "have an impossible density"),
        (&tally.unsupported, "are where the density is 0"),
    ] {
        if let Some(first) = &offences.first {
            let detail = format!(
                "{} of {} samples {what}; the first: {} (xi = {:?})",
                offences.count, tally.samples, first.what, first.xi
            );
            return Finding::certain(CHECK, Verdict::Fail, detail);
        }
    }
    let share = tally.on_border as f64 / tally.samples.max(1) as f64;
    let (verdict, border) = match tally.on_border {
        0 => (Verdict::Pass, String::new()),
        n if share <= BORDER_SHARE => (Verdict::Pass, format!(", {n} of them a rounding beyond its border")),
        n => (
            Verdict::Fail,
            format!(", but {n} of them have the density 0 on a border: too many for rounding"),
        ),
    };
    Finding::certain(
        CHECK,
        verdict,
        format!("all {} samples lie where the density is positive{border}", tally.samples - tally.rejected),
    )
}
