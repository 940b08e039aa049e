//! All checks on one sampler, before anything is judged.

use super::expectation::Expectation;
use super::finding::{Evidence, Finding, Verdict};
use super::map::{CellFigure, Painter, ResidualMap};
use super::settings::Settings;
use super::{agreement, chi_square, edges, map, normalisation, tally};
use crate::domain::Domain;
use crate::sampler::Sampler;
use crate::statistics::chi_square as tail;
use std::time::{Duration, Instant};

/// A relative error of `error` over any `mass` of the distribution would have been caught with probability 0.99.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// Share of the mass.
    pub mass: f64,
    /// Relative error of the density over it.
    pub error: f64,
}

/// What the checks found on one sampler.
pub struct Examination {
    /// What the sampler is called.
    pub name: String,
    /// The domain: "sphere".
    pub domain: &'static str,
    /// What densities are per: "solid angle".
    pub per: &'static str,
    /// Chart coordinates of the domain: 2 for areas, 1 or 0 for what is drawn as a strip.
    pub axes: usize,
    /// What the axes of its pictures are.
    pub picture_caption: &'static str,
    /// Samples drawn.
    pub samples: u64,
    /// How many of them the sampler rejected.
    pub rejected: u64,
    /// The integral of the density, and its error.
    pub integral: (f64, f64),
    /// What was found.
    pub findings: Vec<Finding>,
    /// The cells of the finest scale.
    pub cells: Vec<CellFigure>,
    /// What the finest scale counted without a place on the domain: rejected samples, and the pool of light cells.
    pub elsewhere: Vec<CellFigure>,
    /// Degrees of freedom of each scale of the chi-square test.
    pub degrees: Vec<u64>,
    /// Time that it took.
    pub time: Duration,
    painter: Painter,
}

impl std::fmt::Debug for Examination {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Examination").field("name", &self.name).field("findings", &self.findings).finish()
    }
}

impl Examination {
    /// Rasters of this height of what was observed, expected and left over.
    pub fn map(&self, height: usize) -> ResidualMap {
        (self.painter)(height)
    }

    /// The cells whose counts are farthest from what was expected, worst first; rejected samples and the pool of light cells count as cells.
    pub fn worst_cells(&self, count: usize) -> Vec<&CellFigure> {
        let mut cells: Vec<_> = self.cells.iter().chain(&self.elsewhere).collect();
        cells.sort_by(|a, b| b.residual().abs().total_cmp(&a.residual().abs()));
        cells.truncate(count);
        cells
    }

    /// How many p-values it adds to the run's correction.
    pub fn tests(&self) -> u64 {
        self.findings.iter().filter(|f| matches!(f.evidence, Evidence::Chance { .. })).count() as u64
    }

    /// The relative error over 1, 5, 20 and 50% of the mass that the chi-square test at level `alpha` would have caught with
    /// probability 0.99, at its best scale: an error e over the share y, made up for over the rest, adds
    /// n e^2 y / (1 - y) to the statistic of every scale whose cells it fills.
    pub fn power(&self, alpha: f64) -> Vec<Power> {
        let shares = [0.01, 0.05, 0.2, 0.5];
        shares
            .iter()
            .filter_map(|&mass| {
                let best = self
                    .degrees
                    .iter()
                    // A cell larger than the error dilutes it.
                    .filter(|&&df| mass * (df + 1) as f64 >= 1.0)
                    .filter_map(|&df| tail::noncentrality_for_power(alpha, df as f64, 0.99).ok())
                    .min_by(f64::total_cmp)?;
                Some(Power { mass, error: (best * (1.0 - mass) / (self.samples as f64 * mass)).sqrt() })
            })
            .collect()
    }
}

pub(super) fn examine<S: Sampler>(sampler: &S, name: String, settings: &Settings) -> Examination {
    let start = Instant::now();
    let domain = sampler.domain();
    let mut findings = vec![edges::check(sampler)];
    let mut expectation = Expectation::new(sampler, settings.seed, settings.samples);
    let tally = tally::draw(sampler, &expectation.partition, settings);
    let rejected = tally.rejected as f64 / tally.samples.max(1) as f64;
    let mut normalisation = normalisation::check(&domain, &expectation, rejected);
    let mut counts = chi_square::check(&domain, &expectation, &tally);
    let suspicious = |finding: &Finding| match finding.evidence {
        Evidence::Certain(verdict) => verdict != Verdict::Pass,
        Evidence::Chance { conservative, .. } => conservative < settings.alpha,
    };
    if suspicious(&normalisation) || counts.findings.iter().any(suspicious) {
        expectation.doubt(sampler, settings.seed);
        normalisation = normalisation::check(&domain, &expectation, rejected);
        counts = chi_square::check(&domain, &expectation, &tally);
    }
    findings.extend([normalisation, agreement::support(&tally), agreement::check(&tally)]);
    findings.extend(counts.findings);
    Examination {
        name,
        domain: domain.name(),
        per: domain.per(),
        axes: domain.axes(),
        picture_caption: domain.picture_caption(),
        samples: tally.samples,
        rejected: tally.rejected,
        integral: (expectation.total.value, expectation.total.error),
        findings,
        cells: counts.cells.clone(),
        elsewhere: counts.elsewhere,
        degrees: counts.degrees,
        time: start.elapsed(),
        painter: map::painter(domain, expectation.partition, counts.cells, counts.cell_of_leaf),
    }
}
