//! Alarms, counted.

use super::observation::{Judged, Observation};
use super::{LEVELS, SIGNIFICANCE};
use crate::statistics::binomial::{self, Interval};
use crate::verify::Verdict;

/// How runs were made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// A number of samples that was fixed before.
    Fixed,
    /// A look after every shard of samples, until it is known.
    Anytime,
}

/// What raised alarms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// One check, as if it were the only one.
    Check(&'static str),
    /// All checks together.
    Whole,
}

/// The alarms at one level.
#[derive(Clone, Copy, Debug)]
pub struct Rate {
    /// The level alpha: the nominal rate, at most.
    pub level: f64,
    /// Runs that failed.
    pub alarms: u64,
    /// Runs that came out inconclusive.
    pub inconclusive: u64,
    /// 95% interval of the true rate of failures.
    pub interval: Interval,
    /// Probability of so many failures or more at the nominal rate, which is 0 where no chance is involved.
    pub p: f64,
    /// The same after correction over the whole calibration.
    pub adjusted_p: f64,
}

impl Rate {
    /// Whether there are more failures than the level explains.
    pub fn over(&self) -> bool {
        self.adjusted_p < SIGNIFICANCE
    }
}

/// Runs and their alarms.
#[derive(Clone, Debug)]
pub struct Tally {
    /// Runs in which there was an answer.
    pub runs: u64,
    /// How many p-values there were in all of them.
    pub tests: u64,
    /// Runs that failed without chance.
    pub certain: u64,
    /// At each of [`LEVELS`].
    pub rates: [Rate; 3],
}

impl Tally {
    fn new<'a>(judged: impl Iterator<Item = &'a Judged> + Clone) -> Self {
        let runs = judged.clone().count() as u64;
        let tests = judged.clone().map(|j| j.tests).sum();
        let certain = judged.clone().filter(|j| j.certain).count() as u64;
        let mut at = 0;
        let rates = LEVELS.map(|level| {
            let count = |verdict| judged.clone().filter(|j| j.verdicts[at] == verdict).count() as u64;
            let (alarms, inconclusive) = (count(Verdict::Fail), count(Verdict::Inconclusive));
            at += 1;
            let nominal = if tests > 0 { level } else { 0.0 };
            // Counts of runs and constants: these can't be refused.
            let p = binomial::upper_tail(alarms, runs, nominal).unwrap_or(1.0);
            let interval = binomial::clopper_pearson(alarms, runs, 0.95);
            let interval = interval.unwrap_or(Interval { lower: 0.0, upper: 1.0 });
            Rate { level, alarms, inconclusive, interval, p, adjusted_p: p }
        });
        Self { runs, tests, certain, rates }
    }

    /// Whether the rate is over its level anywhere.
    pub fn over(&self) -> bool {
        self.rates.iter().any(Rate::over)
    }

    /// Whether no chance is involved: the nominal rate is 0.
    pub fn is_certain(&self) -> bool {
        self.tests == 0
    }
}

/// A failure of a right sampler in which no chance was involved.
#[derive(Clone, Debug)]
pub struct CertainFailure {
    /// The sampler.
    pub sampler: String,
    /// Seed of the run, as [`Settings`](crate::verify::Settings) have it.
    pub seed: u64,
    /// What the check said.
    pub detail: String,
}

/// The alarms of one check, or of the whole verdict.
#[derive(Clone, Debug)]
pub struct Row {
    /// Whose alarms these are.
    pub subject: Subject,
    /// How the runs were made.
    pub mode: Mode,
    /// All samplers together.
    pub all: Tally,
    /// Each sampler that the check has an answer for.
    pub by_sampler: Vec<(String, Tally)>,
    /// The first failure without chance of each sampler.
    pub certain: Vec<CertainFailure>,
}

impl Row {
    /// Name of the check, or `whole verdict`.
    pub fn name(&self) -> &'static str {
        match self.subject {
            Subject::Check(name) => name,
            Subject::Whole => "whole verdict",
        }
    }

    /// Whether there are more alarms than there should be: over all samplers, over one of them, or one that no chance explains.
    pub fn over(&self) -> bool {
        self.all.certain > 0 || self.all.over() || self.by_sampler.iter().any(|(_, tally)| tally.over())
    }

    pub(super) fn tallies_mut(&mut self) -> impl Iterator<Item = &mut Tally> {
        std::iter::once(&mut self.all).chain(self.by_sampler.iter_mut().map(|(_, tally)| tally))
    }
}

pub(super) fn rows(names: &[&str], observations: &[(usize, Mode, Observation)]) -> Vec<Row> {
    [Mode::Fixed, Mode::Anytime].into_iter().flat_map(|mode| rows_of(names, observations, mode)).collect()
}

fn rows_of(names: &[&str], observations: &[(usize, Mode, Observation)], mode: Mode) -> Vec<Row> {
    let runs = || observations.iter().filter(move |o| o.1 == mode);
    if runs().next().is_none() {
        return Vec::new();
    }
    // Not every check has something to say of every sampler: those of the battery in its order, then what is new.
    let mut checks: Vec<&'static str> = crate::verify::checks().map(|(name, _)| name).collect();
    for (name, _) in runs().flat_map(|(_, _, o)| &o.checks) {
        if !checks.contains(name) {
            checks.push(name);
        }
    }
    let subjects = checks.into_iter().map(Subject::Check).chain([Subject::Whole]);
    let rows = subjects.map(|subject| {
        let judged = |o: &Observation| match subject {
            Subject::Check(wanted) => o.checks.iter().find(|(name, _)| *name == wanted).map(|(_, j)| *j),
            Subject::Whole => Some(o.whole),
        };
        let all: Vec<(usize, Judged)> =
            runs().filter_map(|(which, _, o)| Some((*which, judged(o)?))).collect();
        let of = |sampler: usize| all.iter().filter(move |(which, _)| *which == sampler).map(|(_, j)| j);
        let answered = (0..names.len()).filter(|&i| of(i).next().is_some());
        let mut certain: Vec<CertainFailure> = Vec::new();
        for (which, _, observation) in runs() {
            let mine = observation.certain.iter().find(|(name, _)| subject == Subject::Check(name));
            let Some((_, detail)) = mine else { continue };
            if certain.iter().all(|failure| failure.sampler != names[*which]) {
                let sampler = names[*which].to_owned();
                certain.push(CertainFailure { sampler, seed: observation.seed, detail: detail.clone() });
            }
        }
        Row {
            subject,
            mode,
            by_sampler: answered.map(|i| (names[i].to_owned(), Tally::new(of(i)))).collect(),
            all: Tally::new(all.iter().map(|(_, j)| j)),
            certain,
        }
    });
    rows.filter(|row| row.all.runs > 0).collect()
}
