//! Distribution functions: Kolmogorov-Smirnov and Anderson-Darling on the marginals and on Rosenblatt's transform.
//!
//! The tree of cells gives a transform to one uniform variate: U = the mass of all leaves before the sample's (Rosenblatt 1952, with the tree's
//! order in place of the coordinates'; for an interval it is the CDF itself). It is known at the leaves' borders, so both statistics are those of grouped data.
//! The marginal along an axis of the chart is known at the lines that [`Expectation`](super::expectation::Expectation) lays across it. A slow drift
//! over many cells, each slightly off in the same direction, shows here before it shows in a sum of squares.

use super::check::{Case, Check, Needs, Rests};
use super::finding::{Evidence, Finding};
use crate::statistics::{anderson_darling, kolmogorov};

pub(super) struct Marginals;

impl Check for Marginals {
    fn name(&self) -> &'static str {
        "distribution"
    }

    fn about(&self) -> &'static str {
        "distribution functions of the marginals and of Rosenblatt's transform (Kolmogorov-Smirnov, Anderson-Darling)"
    }

    fn rests(&self) -> Rests {
        Rests::ExpectedCounts
    }

    fn needs(&self) -> Needs {
        Needs::Density
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let (expectation, tally) = (case.expectation, case.tally);
        let total = expectation.total;
        if !(total.value.is_finite() && total.error.is_finite()) || expectation.leaves.len() < 2 {
            return Vec::new();
        }
        let n = tally.samples;
        let rejected = expectation.rejected().value;
        // What lies outside is its own failure; here it would only confuse the counts.
        if n == 0 || tally.outside.count > 0 || tally.rejected == n || total.value - total.error > 1.0 + 1e-5
        {
            return Vec::new();
        }
        let mut findings = Vec::new();
        let mut masses = expectation.masses();
        masses.push(rejected);
        let mut counts = tally.per_leaf.clone();
        counts.push(tally.rejected);
        let scale: f64 = masses.iter().sum();
        masses.iter_mut().for_each(|m| *m = m.max(0.0) / scale);
        let error = total.error + 1e-6;
        // With mass at the last step only, there is no order to speak of.
        if case.probe.space().axes() > 0 || expectation.leaves.len() > 16 {
            findings.extend(kolmogorov_smirnov(self.name(), "Rosenblatt, KS", &counts, &masses, error, n));
            findings.extend(anderson(self.name(), "Rosenblatt, AD", &counts, &masses, error));
        }
        for (marginal, counts) in expectation.marginals.iter().zip(&tally.between_lines) {
            let mut error = error;
            let mut borders = vec![0.0];
            for below in &marginal.below {
                borders.push(below.value.max(*borders.last().unwrap_or(&0.0)));
                error = error.max(below.error);
            }
            borders.push(total.value.max(*borders.last().unwrap_or(&0.0)));
            let mut masses: Vec<f64> = borders.windows(2).map(|pair| pair[1] - pair[0]).collect();
            masses.push(rejected);
            let scale: f64 = masses.iter().sum();
            masses.iter_mut().for_each(|m| *m /= scale);
            let counts = [counts.as_slice(), &[tally.rejected]].concat();
            let part = format!("axis {}, KS", marginal.axis);
            findings.extend(kolmogorov_smirnov(self.name(), &part, &counts, &masses, error, n));
        }
        findings
    }
}

fn kolmogorov_smirnov(
    check: &'static str,
    part: &str,
    counts: &[u64],
    masses: &[f64],
    error: f64,
    n: u64,
) -> Option<Finding> {
    let figure = kolmogorov::grouped(counts, masses, error).ok()?;
    let detail = format!("D = {:.2e}, {} groups", figure.statistic, counts.len());
    // 1 - e^(-2 n d^2), twice: the critical distance at a level of 1e-5, and one standard deviation of 1/2 sqrt n thrice beyond it.
    let sees = ((2e5_f64.ln() / (2.0 * n as f64)).sqrt() + 1.2 / (n as f64).sqrt()) + error;
    Some(
        Finding::new(check, Evidence::Chance { p: figure.p, conservative: figure.p_conservative }, detail)
            .part(part)
            .sees(format!("{:.2}% of the samples on the wrong side of a line", 100.0 * sees)),
    )
}

fn anderson(check: &'static str, part: &str, counts: &[u64], masses: &[f64], error: f64) -> Option<Finding> {
    let figure = anderson_darling::grouped(counts, masses, error).ok()?;
    let detail = format!("A^2 = {:.2}, {} groups", figure.statistic, counts.len());
    Some(
        Finding::new(check, Evidence::Chance { p: figure.p, conservative: figure.p_conservative }, detail)
            .part(part),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Square;
    use crate::sampler::from_fn;
    use crate::verify::expectation::told;
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;
    use crate::verify::tally::Tally;
    use glam::DVec2;

    /// Masses whose integral is hardly known are taken as parts of it.
    #[test]
    fn masses_that_do_not_add_up() {
        let sampler = from_fn(Square, |xi: [f64; 2]| DVec2::from(xi), |_: DVec2| 1.0);
        let extras = Extras::default();
        let (probe, settings) = (Subject::new(&sampler, &extras), Settings::default());
        // 1.5 +- 0.6 in all.
        let lines = vec![(0, vec![0.25, 0.5], vec![told::integral(0.375, 0.0), told::integral(0.75, 0.0)])];
        let expectation = told::expectation(&Square, [told::integral(0.375, 0.15); 4], lines);
        let tally = Tally {
            samples: 100,
            per_leaf: vec![40, 20, 25, 15],
            between_lines: vec![vec![40, 20, 40]],
            ..Tally::default()
        };
        let case = Case { probe: &probe, expectation: &expectation, tally: &tally, settings: &settings };
        let findings = Marginals.run(&case);
        for (part, counts, masses) in [
            ("Rosenblatt, KS", &[40, 20, 25, 15, 0][..], &[0.25, 0.25, 0.25, 0.25, 0.0][..]),
            ("axis 0, KS", &[40, 20, 40, 0], &[0.25, 0.25, 0.5, 0.0]),
        ] {
            let finding = findings.iter().find(|finding| finding.part == part).unwrap();
            let figure = kolmogorov::grouped(counts, masses, 0.6 + 1e-6).unwrap();
            let (p, conservative) = finding.evidence.p_values().unwrap();
            assert!((p - figure.p).abs() < 1e-9 && conservative == 1.0, "{finding:?}");
            assert_eq!(finding.detail, format!("D = 1.50e-1, {} groups", counts.len()));
            // The root of ln (2e5) / 200, 1.2 / 10 and the error.
            assert_eq!(finding.sees, "96.70% of the samples on the wrong side of a line");
        }
        // An integral that is off by 5e-6, which nobody minds, is no reason not to look.
        let lines = vec![(0, vec![0.25, 0.5], vec![told::integral(0.25, 0.0), told::integral(0.5, 0.0)])];
        let rounded = told::expectation(&Square, [told::integral(0.25 + 1.25e-6, 0.0); 4], lines);
        let findings = Marginals.run(&Case { expectation: &rounded, ..case });
        for part in ["Rosenblatt, KS", "axis 0, KS"] {
            let finding = findings.iter().find(|finding| finding.part == part).unwrap();
            assert!(finding.detail.starts_with("D = 1.50e-1, "), "{finding:?}");
        }
        // Of masses that may be anything there is no distribution.
        let unknown = told::expectation(&Square, [told::integral(0.25, f64::INFINITY); 4], vec![]);
        assert!(Marginals.run(&Case { expectation: &unknown, ..case }).is_empty());
    }
}
