//! The battery on one fault: is it caught, after how many samples, and is the diagnosis right?

use super::{Fault, Specimen, Twin};
use crate::verify::{Report, Settings, Verdict};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Numbers of samples at which a fault is tried, 1, 2 and 5 times powers of ten.
const FEWEST: u64 = 1000;

/// How faults are examined.
#[derive(Clone)]
pub struct Plan {
    /// Samples of the whole examination, and the most that a fault may take.
    pub samples: u64,
    /// How many seeds, from `seed` on.
    pub seeds: u64,
    /// The first seed.
    pub seed: u64,
    /// The probability that any correct twin is rejected, over all of them and all seeds.
    pub alpha: f64,
    /// How many runs share alpha.
    pub runs: u64,
    /// Set from elsewhere to end early.
    pub stop: Option<Arc<AtomicBool>>,
}

impl Plan {
    /// A plan for so many specimens.
    pub fn new(samples: u64, seeds: u64, seed: u64, alpha: f64, specimens: usize) -> Self {
        Self { samples, seeds, seed, alpha, runs: seeds * specimens as u64, stop: None }
    }

    fn settings(&self, samples: u64, seed: u64, diagnose: bool) -> Settings {
        Settings {
            samples,
            seed,
            diagnose,
            alpha: self.alpha,
            others: self.runs.saturating_sub(1),
            stop: self.stop.clone(),
            ..Settings::default()
        }
    }

    fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    fn run(&self, specimen: &Specimen, name: &str, settings: &Settings) -> Report {
        Report::new(vec![specimen.examine(name, settings)], settings)
    }

    /// The seeds with which this specimen is tried; those that draw nothing have one.
    fn seeds_of(&self, specimen: &Specimen) -> impl Iterator<Item = u64> + use<> {
        let (first, count) = (self.seed, if specimen.is_random() { self.seeds } else { 1 });
        (0..count).map(move |i| first.wrapping_add(i))
    }

    /// The steps up to the whole budget.
    fn steps(&self) -> Vec<u64> {
        let decades = (0..).map(|k| FEWEST * 10_u64.pow(k)).take_while(|&d| d < self.samples);
        let mut steps: Vec<u64> =
            decades.flat_map(|d| [1, 2, 5].map(|k| k * d)).filter(|&n| n < self.samples).collect();
        steps.push(self.samples);
        steps
    }
}

/// What became of a fault.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Its name.
    pub name: &'static str,
    /// The checks that failed at the whole budget and the first seed, in the order of the battery.
    pub caught_by: Vec<String>,
    /// Whether one that was to catch it is among them.
    pub as_expected: bool,
    /// With how many seeds it was caught within the budget, …
    pub caught: u64,
    /// … of how many.
    pub of: u64,
    /// Samples that it took, the median over the seeds; `None` if most did not catch it, or if it isn't samples that are asked for.
    pub samples: Option<u64>,
    /// Whether what was said of it at the whole budget and the first seed is right.
    pub diagnosed: bool,
    /// Whether it was said that nothing that is known explains the samples, or nothing was said: not right, but not wrong either.
    pub unknown: bool,
    /// What helped the diagnosis.
    pub help: Help,
    /// Whether it was kept aside while the checks were written.
    pub held_back: bool,
    /// What was said of it.
    pub diagnosis: String,
}

impl Outcome {
    /// Whether it was caught with every seed.
    pub fn is_caught(&self) -> bool {
        self.of > 0 && self.caught == self.of
    }
}

/// What a right diagnosis owes to others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Help {
    /// Nothing.
    None,
    /// The author named densities that the mistake may lead to, the right one among them.
    Rivals,
    /// There is no diagnosis beside the name of the check or its part, which says it.
    CheckName,
}

/// How many were caught and diagnosed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Score {
    /// Faults.
    pub faults: usize,
    /// Those that were caught with every seed.
    pub caught: usize,
    /// Those whose diagnosis is right.
    pub diagnosed: usize,
    /// Those of them that had no help.
    pub unaided: usize,
}

impl Score {
    /// Of these.
    pub fn of<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Self {
        outcomes.into_iter().fold(Self::default(), |score, outcome| Self {
            faults: score.faults + 1,
            caught: score.caught + usize::from(outcome.is_caught()),
            diagnosed: score.diagnosed + usize::from(outcome.diagnosed),
            unaided: score.unaided + usize::from(outcome.diagnosed && outcome.help == Help::None),
        })
    }
}

/// Tries a fault with every seed, and looks once at what is said of it. `None` if it was stopped before the end.
pub fn examine(fault: &Fault, plan: &Plan) -> Option<Outcome> {
    let specimen = fault.make();
    let whole = plan.run(&specimen, fault.name, &plan.settings(plan.samples, plan.seed, true));
    let failed = || whole.conclusions[0].iter().filter(|c| c.verdict == Verdict::Fail).map(|c| &c.finding);
    let mut caught_by: Vec<String> = failed().map(|f| f.check.to_owned()).collect();
    caught_by.dedup();
    let steps = plan.steps();
    let needed: Vec<Option<u64>> = plan
        .seeds_of(&specimen)
        .map(|seed| {
            steps.iter().copied().take_while(|_| !plan.stopped()).find(|&samples| {
                let report = plan.run(&specimen, fault.name, &plan.settings(samples, seed, false));
                report.verdict() == Verdict::Fail
            })
        })
        .collect();
    if plan.stopped() {
        return None;
    }
    let diagnosis = whole.examinations[0].diagnosis.as_ref();
    let diagnosed = match diagnosis {
        Some(diagnosis) => fault.diagnoses.iter().any(|name| diagnosis.is(name)),
        None => failed().any(|f| fault.diagnoses.iter().any(|name| f.check == *name || f.part == *name)),
    };
    Some(Outcome {
        name: fault.name,
        as_expected: fault.caught_by.iter().any(|check| caught_by.iter().any(|by| by == check)),
        caught_by,
        caught: needed.iter().flatten().count() as u64,
        of: needed.len() as u64,
        samples: if specimen.counts_samples() { median(needed) } else { None },
        diagnosed,
        unknown: diagnosis.is_none_or(|diagnosis| !diagnosis.explains),
        help: match diagnosis {
            None => Help::CheckName,
            Some(_) if specimen.has_rivals() => Help::Rivals,
            Some(_) => Help::None,
        },
        held_back: fault.held_back,
        diagnosis: match diagnosis {
            Some(diagnosis) => diagnosis.text.clone(),
            None => failed().next().map_or(String::new(), |f| format!("{}: {}", f.check, f.detail)),
        },
    })
}

/// The lower median, where `None` is more than any number.
fn median(mut needed: Vec<Option<u64>>) -> Option<u64> {
    needed.sort_by_key(|samples| samples.unwrap_or(u64::MAX));
    needed.get(needed.len().saturating_sub(1) / 2).copied().flatten()
}

/// With how many seeds a correct twin does not pass at the whole budget, and of how many; the first report of those. The seeds and settings are those of the
/// faults, but for the smaller numbers of samples that these are tried with first. Seeds after a stop are not counted.
pub fn examine_twin(twin: &Twin, plan: &Plan) -> (u64, u64, Option<Report>) {
    let specimen = twin.make();
    let (mut rejected, mut of, mut first) = (0, 0, None);
    for seed in plan.seeds_of(&specimen) {
        let report = plan.run(&specimen, twin.name, &plan.settings(plan.samples, seed, false));
        if plan.stopped() {
            break;
        }
        of += 1;
        if report.verdict() != Verdict::Pass {
            rejected += 1;
            first.get_or_insert(report);
        }
    }
    (rejected, of, first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_end_at_the_budget_and_medians_count_what_was_not_caught() {
        assert_eq!(Plan::new(20_000, 3, 1, 1e-3, 1).steps(), [1000, 2000, 5000, 10_000, 20_000]);
        assert_eq!(Plan::new(500, 3, 1, 1e-3, 1).steps(), [500]);
        assert_eq!(median(vec![None, Some(5), Some(1), None]), Some(5));
        assert_eq!(median(vec![None, Some(5), None]), None);
    }
}
