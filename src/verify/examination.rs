//! All checks on one sampler, before anything is judged.

use super::check::{BATTERY, Case, Rests};
use super::diagnosis::{Diagnosis, diagnose};
use super::edges::{self, EdgeProbe};
use super::expectation::{DOUBTS, Errors, Expectation};
use super::finding::{Evidence, Finding, Verdict};
use super::history::{History, Look};
use super::map::{CellFigure, Painter, ResidualMap};
use super::power::{self, Power};
use super::probe::Probe;
use super::sequential::Bets;
use super::settings::Settings;
#[cfg(feature = "foreign")]
use super::weights;
use super::{goodness, map, tally};
use crate::domain::Space;
use std::time::{Duration, Instant};

/// What samples were held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// The sampler's own density.
    Density,
    /// This many samples of another sampler.
    Sampler(u64),
    /// This many points that somebody else drew.
    Points(u64),
    /// A density that was given for samples which somebody else drew.
    Given,
    /// The densities that came with samples which somebody else drew, and nothing else.
    OwnDensities,
    /// Nothing: relations between the answers to several questions.
    Relations,
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
    /// What its samples were held against.
    pub against: Against,
    /// Samples drawn.
    pub samples: u64,
    /// How many of them the sampler rejected.
    pub rejected: u64,
    /// The integral of the density, and its error; NaN where no density is involved.
    pub integral: (f64, f64),
    /// What was found.
    pub findings: Vec<Finding>,
    /// The cells of the finest scale.
    pub cells: Vec<CellFigure>,
    /// What the finest scale counted without a place on the domain: rejected samples, and the pool of light cells.
    pub elsewhere: Vec<CellFigure>,
    /// Number of cells of each scale.
    pub scales: Vec<usize>,
    /// Whether it stopped as soon as it knew.
    pub anytime: bool,
    /// What would explain the counts, where they are not those of the density.
    pub diagnosis: Option<Diagnosis>,
    /// How the p-value went as samples came in: after each doubling of their number, and in the end.
    pub history: Vec<Look>,
    /// What the sampler made of edge values, variate by variate.
    pub edges: Vec<EdgeProbe>,
    /// Time that it took.
    pub time: Duration,
    /// The parts of that time, in order.
    pub phases: Vec<(&'static str, Duration)>,
    pub(super) painter: Painter,
    /// Of densities that came with the samples and are wrong: the mean of 1 / density over the measure and its error, where that is the same all over the domain.
    #[cfg(feature = "foreign")]
    pub(crate) common_ratio: Option<(f64, f64)>,
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
        self.findings.iter().filter(|f| f.evidence.p_values().is_some()).count() as u64
    }

    /// The relative error over 1, 5, 20 and 50% of the mass, in one piece, that would have been caught with probability 0.99 at level `alpha`; of densities
    /// that came with the samples, over the share of them that could be judged.
    pub fn power(&self, alpha: f64) -> Vec<Power> {
        match self.against {
            // The bets of a run that stops early have no power at a fixed number of samples.
            _ if self.anytime => Vec::new(),
            Against::OwnDensities => self.findings.iter().filter_map(|finding| finding.power).collect(),
            _ => power::power(self.axes, &self.scales, self.worth(), alpha),
        }
    }

    /// The probability with which a relative error of the density over `mass` of it, in one piece, would have been caught at level `alpha`; `None` in a run that
    /// stops as soon as it knows, and where nothing was counted, or not against expected counts.
    pub fn power_against(&self, alpha: f64, mass: f64, error: f64) -> Option<f64> {
        match self.against {
            Against::OwnDensities => None,
            _ if self.anytime => None,
            _ => power::probability(self.axes, &self.scales, self.worth(), alpha, mass, error),
        }
    }

    /// How many samples against a density would see as much.
    fn worth(&self) -> u64 {
        match self.against {
            Against::Density | Against::Given | Against::OwnDensities | Against::Relations => self.samples,
            Against::Sampler(others) | Against::Points(others) => {
                let (a, b) = (self.samples as f64, others as f64);
                (a * (b / (a + b))) as u64
            }
        }
    }

    /// One without cells, for checks that are not made of counts in cells.
    pub(super) fn bare(name: String, space: &dyn Space, samples: u64, against: Against) -> Self {
        let blank = |height: usize| {
            let nothing = vec![f64::NAN; height];
            let [observed, expected, residual] = [nothing.clone(), nothing.clone(), nothing];
            ResidualMap { width: 1, height, observed, expected, residual, cell: vec![None; height] }
        };
        Self {
            name,
            domain: space.name(),
            per: space.per(),
            axes: space.axes(),
            picture_caption: space.picture_caption(),
            against,
            samples,
            rejected: 0,
            integral: (f64::NAN, f64::NAN),
            findings: Vec::new(),
            cells: Vec::new(),
            elsewhere: Vec::new(),
            scales: Vec::new(),
            anytime: false,
            diagnosis: None,
            history: Vec::new(),
            edges: Vec::new(),
            time: Duration::ZERO,
            phases: Vec::new(),
            painter: Box::new(move |height| blank(height.max(1))),
            #[cfg(feature = "foreign")]
            common_ratio: None,
        }
    }
}

/// Part of alpha below which a p-value condemns whatever else is tested.
const BEYOND_DOUBT: f64 = 1e-6;

pub(super) fn examine(probe: &dyn Probe, name: String, settings: &Settings) -> Examination {
    let start = Instant::now();
    let space = probe.space();
    let mut expectation = Expectation::new(probe, settings.seed, probe.rows_expected(settings.samples));
    let integrated = start.elapsed();
    let mut history = History::new();
    let mut bets = if settings.anytime { Bets::new(&expectation) } else { None };
    let stop_at = -settings.stopping_level().ln();
    // By so many points of each, the errors of the masses, once somebody is about to fail.
    let mut doubted: [Option<Errors>; DOUBTS.len()] = Default::default();
    let tally = tally::draw(probe, &expectation, settings, &mut |tally| {
        let mut ln_e = bets.as_mut().map(|bets| bets.look(tally));
        if ln_e.is_some_and(|ln_e| ln_e >= stop_at) && doubted[0].is_none() {
            // Who doesn't know any more what is found then goes on.
            for (points, errors) in DOUBTS.into_iter().zip(&mut doubted) {
                let mut again = expectation.clone();
                again.doubt(probe, settings.seed, points);
                bets = bets.as_ref().and_then(|bets| bets.again(&again, tally));
                ln_e = bets.as_ref().map(Bets::ln_e);
                *errors = Some(again.errors());
                if ln_e.is_some_and(|ln_e| -ln_e < (BEYOND_DOUBT * settings.alpha).ln()) {
                    break;
                }
            }
        }
        history.look(tally, ln_e);
        settings.anytime && (tally.offends() || ln_e.is_some_and(|ln_e| ln_e >= stop_at))
    });
    if probe.pilots().is_some() {
        expectation.settle(tally.samples);
    }
    let drawn = start.elapsed();
    let wanted = |rests: Rests| match rests {
        Rests::NoCounts | Rests::Quadrature => true,
        Rests::Counts | Rests::ExpectedCounts => !settings.anytime,
    };
    let checks: Vec<_> = BATTERY
        .into_iter()
        .filter(|check| wanted(check.rests()) && check.needs().met_by(probe))
        .filter(|check| !settings.without.iter().any(|name| name == check.name()))
        .collect();
    let mut found: Vec<Vec<Finding>> = {
        let case = Case { probe, expectation: &expectation, tally: &tally, settings };
        checks.iter().map(|check| check.run(&case)).collect()
    };
    let below = |finding: &Finding, level: f64| match finding.evidence {
        Evidence::Chance { conservative, .. } => conservative < level,
        Evidence::Betting { conservative, .. } => (-conservative).exp() < level,
        Evidence::Certain(_) | Evidence::Unanswered => false,
    };
    let certain = |finding: &Finding| finding.evidence == Evidence::Certain(Verdict::Fail);
    let suspicious = |finding: &Finding| {
        let undecided = finding.evidence == Evidence::Certain(Verdict::Inconclusive);
        certain(finding) || undecided || below(finding, settings.alpha)
    };
    // By so much that no correction for how much is tested matters.
    let condemned = |finding: &Finding| certain(finding) || below(finding, BEYOND_DOUBT * settings.alpha);
    let on_quadrature = |rests: Rests| matches!(rests, Rests::Quadrature | Rests::ExpectedCounts);
    let doubtful = checks
        .iter()
        .zip(&found)
        .any(|(check, findings)| on_quadrature(check.rests()) && findings.iter().any(suspicious))
        || bets.as_ref().is_some_and(|bets| suspicious(&bets.finding(&tally)));
    // Who only counts failures, or pays for every question, has one where no quadrature is involved.
    let decided = (!settings.diagnose || probe.is_slow())
        && checks
            .iter()
            .zip(&found)
            .any(|(check, findings)| !on_quadrature(check.rests()) && findings.iter().any(certain));
    // Nor is there anything to doubt in the integral of what is no number somewhere.
    if doubtful && !decided && expectation.total.bad.is_none() {
        let errors = expectation.errors();
        for (points, known) in DOUBTS.into_iter().zip(doubted) {
            expectation.reset(known.as_ref().unwrap_or(&errors));
            if known.is_none() {
                expectation.doubt(probe, settings.seed, points);
            }
            let case = Case { probe, expectation: &expectation, tally: &tally, settings };
            // Few points leave a wide margin. Who was suspected and fails even so fails with a narrower one too.
            let mut settled = true;
            for (check, findings) in checks.iter().zip(&mut found).filter(|(c, _)| on_quadrature(c.rests())) {
                let suspected = findings.iter().filter(|finding| suspicious(finding)).count();
                *findings = check.run(&case);
                settled &= findings.iter().filter(|finding| condemned(finding)).count() >= suspected;
            }
            if let Some(before) = &bets {
                bets = before.again(&expectation, &tally);
                settled &= bets.as_ref().is_some_and(|bets| condemned(&bets.finding(&tally)));
            }
            if settled {
                break;
            }
        }
    }
    let mut findings: Vec<Finding> = found.into_iter().flatten().collect();
    findings.extend(bets.iter().map(|bets| bets.finding(&tally)));
    if settings.anytime && bets.is_none() {
        findings.push(Finding::certain(
            "sequential",
            Verdict::Inconclusive,
            "there are no two cells to bet on",
        ));
    }
    let case = Case { probe, expectation: &expectation, tally: &tally, settings };
    let checked = start.elapsed();
    let suspected = findings.iter().any(suspicious);
    let diagnosis = if settings.diagnose && suspected { diagnose(&case) } else { None };
    #[cfg(feature = "foreign")]
    let common_ratio = if suspected && !probe.has_density() { weights::common_ratio(&case) } else { None };
    let history = history.judge(&expectation, &tally, bets.as_ref().map(Bets::ln_e));
    let edges = edges::probes(probe);
    let diagnosed = start.elapsed();
    let (mut cells, mut elsewhere, mut cell_of_leaf) = goodness::figures(space, &expectation, &tally);
    if !probe.has_density() {
        // The pilots' shares are no expected counts.
        (cells, elsewhere) = (Vec::new(), Vec::new());
        cell_of_leaf.fill(None);
        expectation.scales.clear();
    }
    Examination {
        name,
        domain: space.name(),
        per: space.per(),
        axes: space.axes(),
        picture_caption: space.picture_caption(),
        against: Against::Density,
        samples: tally.samples,
        rejected: tally.rejected,
        integral: (expectation.total.value, expectation.total.error),
        findings,
        cells: cells.clone(),
        elsewhere,
        scales: expectation.scales.iter().map(|scale| scale.cells.len()).collect(),
        anytime: settings.anytime,
        diagnosis,
        history,
        edges,
        phases: vec![
            ("cells and integrals", integrated),
            ("drawing", drawn - integrated),
            ("checks", checked - drawn),
            ("diagnosis", diagnosed - checked),
        ],
        time: start.elapsed(),
        painter: map::painter(probe.space_for_keeps(), expectation.partition, cells, cell_of_leaf),
        #[cfg(feature = "foreign")]
        common_ratio,
    }
}
