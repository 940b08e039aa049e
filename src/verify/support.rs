//! Samples lie where the density is positive; the density is positive wherever the target is.

use super::check::{Case, Check, Needs, Rests};
use super::finding::{Evidence, Finding, Verdict};
use crate::domain::Cell;

/// Samples on the edge of a support may be rounded across it; more than this share is no rounding.
const BORDER_SHARE: f64 = 1e-4;
/// How far inside of a cell its corners are looked at, as a share of the cell: on the border itself two pieces of code need not agree
/// which texel they are in.
const INSIDE: f64 = 1e-3;

pub(super) struct Support;

impl Check for Support {
    fn name(&self) -> &'static str {
        "support"
    }

    fn about(&self) -> &'static str {
        "no sample outside of the domain or where the density is 0; density wherever the target is positive"
    }

    fn rests(&self) -> Rests {
        Rests::NoCounts
    }

    fn needs(&self) -> Needs {
        Needs::Samples
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let mut findings = vec![samples(self.name(), case)];
        findings.extend(target(self.name(), case));
        findings
    }
}

/// Samples outside of the domain, without density or with an impossible one.
fn samples(check: &'static str, case: &Case<'_>) -> Finding {
    let all = case.tally.with_pilots();
    for (offences, what) in [
        (&all.outside, "are outside of the domain"),
        (&all.invalid, "have an impossible density"),
        (&all.unsupported, "are where the density is 0"),
        (&case.tally.left_over_outside, "leave over a variate outside of [0, 1)"),
    ] {
        if let Some(first) = &offences.first {
            let detail = format!(
                "{} of {} samples {what}; the first: {} ({})",
                offences.count, all.samples, first.what, first.sample
            );
            return Finding::certain(check, Verdict::Fail, detail);
        }
    }
    let kept = all.samples - all.rejected;
    let least = 4.6 / all.samples.max(1) as f64;
    if !case.probe.tells_densities() {
        let detail = format!("all {kept} samples lie in the domain");
        let sees = format!("samples outside of it if they are {least:.0e} or more of all");
        return Finding::certain(check, Verdict::Pass, detail).sees(sees);
    }
    let share = all.on_border as f64 / all.samples.max(1) as f64;
    let (verdict, border) = match all.on_border {
        0 => (Verdict::Pass, String::new()),
        n if share <= BORDER_SHARE => (Verdict::Pass, format!(", {n} of them a rounding beyond its border")),
        n => (
            Verdict::Fail,
            format!(", but {n} of them have the density 0 on a border: too many for rounding"),
        ),
    };
    Finding::certain(check, verdict, format!("all {kept} samples lie where the density is positive{border}"))
        .sees(format!("samples without density if they are {least:.0e} or more of all"))
}

/// The middle and the corners of a cell, slightly inside.
fn places(cell: &Cell, axes: usize) -> impl Iterator<Item = [f64; 2]> {
    let along = |axis: usize| {
        let (low, high) = (cell.low[axis], cell.high[axis]);
        let margin = INSIDE * (high - low);
        if axis < axes { vec![low + margin, 0.5 * (low + high), high - margin] } else { vec![0.0] }
    };
    let (first, second) = (along(0), along(1));
    first.into_iter().flat_map(move |a| second.clone().into_iter().map(move |b| [a, b]))
}

/// A place where the target is positive and the density is 0.
pub(super) fn target_fails(case: &Case<'_>) -> Option<String> {
    target("", case).filter(|f| f.evidence == Evidence::Certain(Verdict::Fail)).map(|f| f.detail)
}

fn target(check: &'static str, case: &Case<'_>) -> Option<Finding> {
    const PATCHES: usize = 64;
    let (probe, axes) = (case.probe, case.probe.space().axes());
    probe.target_at(0, [0.5; 2])?;
    let mut looked = 0_u64;
    for cell in case.expectation.partition.leaves() {
        // Of a cell of many patches some, evenly.
        let step = cell.patches.len().div_ceil(PATCHES).max(1);
        for patch in cell.patches.clone().step_by(step) {
            for at in places(cell, axes) {
                looked += 1;
                let (target, (density, jacobian)) =
                    (probe.target_at(patch, at)?, probe.density_at(patch, at));
                if target > 0.0 && !(density > 0.0) && jacobian > 0.0 {
                    let point = probe.describe(patch, at);
                    let detail = format!(
                        "the target at {point} is {target}, the density {density}: what is there can't be sampled"
                    );
                    return Some(Finding::certain(check, Verdict::Fail, detail).part("target"));
                }
                if target.is_nan() {
                    let detail = format!("the target at {} is NaN", probe.describe(patch, at));
                    return Some(
                        Finding::new(check, Evidence::Certain(Verdict::Inconclusive), detail).part("target"),
                    );
                }
            }
        }
    }
    let detail = format!("there is density wherever the target is positive, at {looked} places");
    Some(Finding::certain(check, Verdict::Pass, detail).part("target"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_a_cell() {
        let cell = Cell { patches: 0..1, low: [0.25, 0.5], high: [0.75, 1.0] };
        let along = [[0.2505, 0.5, 0.7495], [0.5005, 0.75, 0.9995]];
        let near = |found: Vec<[f64; 2]>, expected: Vec<[f64; 2]>| {
            assert_eq!(found.len(), expected.len(), "{found:?}");
            let off = found.iter().zip(&expected).map(|(a, b)| (a[0] - b[0]).abs().max((a[1] - b[1]).abs()));
            assert!(off.fold(0.0, f64::max) < 1e-15, "{found:?}");
        };
        near(places(&cell, 0).collect(), vec![[0.0; 2]]);
        near(places(&cell, 1).collect(), along[0].map(|a| [a, 0.0]).into());
        let all = along[0].iter().flat_map(|&a| along[1].map(|b| [a, b]));
        near(places(&cell, 2).collect(), all.collect());
    }
}
