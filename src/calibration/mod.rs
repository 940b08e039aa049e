//! How often right samplers fail, and whether p-values are what they say they are: the verification, verified.
//!
//! A check that is made at level alpha may fail a right sampler with probability alpha and no more. [`calibrate`] examines right samplers again and
//! again, each time with another seed, and counts. In one run
//! - a check **alone** raises an alarm at a level if a [`Report`](crate::verify::Report) of its findings alone fails there, that is if Holm's correction
//!   over its own conservative p-values leaves one below the level, or if it fails for certain;
//! - the **whole verdict** raises one if the report of all findings fails;
//! - in a run that **stops as soon as it knows** ([`Settings::anytime`](crate::verify::Settings)), the same, with a look after every shard of 16384
//!   samples.
//!
//! The rate of alarms stands beside the level with its interval (Clopper and Pearson, Biometrika 26, 1934), and is *over* if so many alarms have
//! an exact binomial probability that is too small at the nominal rate. Where no chance is involved the nominal rate is 0. Rates are judged for all samplers together and for each.
//!
//! The p-values as computed, before errors of expected counts are taken off, are tested for uniformity (Kolmogorov 1933). Some are not meant to be
//! uniform, only no smaller than uniform ones: exact tests of counts, the corrected smallest of many, distances of grouped values, 1 / e. They are tested on
//! that side alone, by D+ = max(i / n - p_i) with P(D+ > d) <= exp(-2 n d^2) (Massart, Ann. Prob. 18, 1990). Rates and p-values are judged together, by Holm's correction
//! at level [`SIGNIFICANCE`].
//!
//! An examination is first made at a level so small that nothing is suspicious and nothing examined twice; its p-values are those that are tested. Where it fails at a level,
//! it is made again at that level, with all the second looks that come before a failure. So alarms are counted as a user
//! at that level meets them.

mod observation;
mod rate;
mod uniformity;

pub use rate::{CertainFailure, Mode, Rate, Row, Subject, Tally};
pub use uniformity::{Claim, Uniformity};

use crate::parallel;
use crate::sampler::Sampler;
use crate::statistics::multiplicity::holm;
use crate::verify::{Examination, Settings, verify};
use observation::{Observation, observe};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Levels at which alarms are counted.
pub const LEVELS: [f64; 3] = [0.05, 0.01, 1e-3];

/// The probability, at most, that [`Calibration::holds`] says no of checks that are calibrated.
pub const SIGNIFICANCE: f64 = 1e-3;

/// Runs between two looks at the flag that stops; what is done in parallel.
const BATCH: u64 = 64;

/// A right sampler by name, as something that can be examined.
pub struct Candidate<'a> {
    name: String,
    share: u32,
    examine: Box<dyn Fn(&Settings) -> Examination + Send + Sync + 'a>,
}

impl<'a> Candidate<'a> {
    /// Whatever can be examined: `examine` must depend on nothing but the settings it is given.
    pub fn new(
        name: impl Into<String>,
        examine: impl Fn(&Settings) -> Examination + Send + Sync + 'a,
    ) -> Self {
        Self { name: name.into(), share: 1, examine: Box::new(examine) }
    }

    /// A sampler.
    pub fn sampler<S: Sampler>(name: impl Into<String>, sampler: &'a S) -> Self {
        let name = name.into();
        let called = name.clone();
        Self::new(name, move |settings| {
            verify(sampler).name(called.as_str()).settings(settings.clone()).examine()
        })
    }

    /// How many runs it gets, in proportion to the shares of the others; 1 unless told.
    ///
    /// # Panics
    /// If it is 0.
    #[track_caller]
    pub fn share(self, share: u32) -> Self {
        assert!(share > 0, "a share must be positive");
        Self { share, ..self }
    }
}

/// How often to examine, and how.
#[derive(Clone)]
pub struct Plan {
    /// Runs over all samplers.
    pub runs: u64,
    /// Samples of each run.
    pub samples: u64,
    /// Samples of each run that stops as soon as it knows; 0 leaves those runs out.
    pub anytime_samples: u64,
    /// Seed; same seed, same bits.
    pub seed: u64,
    /// Names of checks to leave out.
    pub without: Vec<String>,
    /// Called now and then with the number of runs that are done.
    pub progress: Option<Arc<dyn Fn(u64) + Send + Sync>>,
    /// Once set, no more runs are begun; those that are done are judged.
    pub stop: Option<Arc<AtomicBool>>,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            runs: 10_000,
            samples: 20_000,
            anytime_samples: 10 << 14,
            seed: 1,
            without: Vec::new(),
            progress: None,
            stop: None,
        }
    }
}

impl Plan {
    fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// The seed of one run: two runs never share one, nor do two plans whose seeds differ in their lower half.
    fn seed_of(&self, run: u64) -> u64 {
        self.seed.rotate_left(32).wrapping_add(run)
    }

    fn settings(&self, run: u64, mode: Mode) -> Settings {
        let (samples, anytime) = match mode {
            Mode::Fixed => (self.samples, false),
            Mode::Anytime => (self.anytime_samples, true),
        };
        Settings {
            samples,
            anytime,
            seed: self.seed_of(run),
            without: self.without.clone(),
            stop: self.stop.clone(),
            ..Settings::default()
        }
    }
}

/// What was measured.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The samplers, and how many runs each had.
    pub samplers: Vec<(String, u64)>,
    /// Runs done over all samplers: fewer than planned if it was stopped.
    pub runs: u64,
    /// Samples of each run.
    pub samples: u64,
    /// Samples of each run that stops as soon as it knows, at most.
    pub anytime_samples: u64,
    /// The seed.
    pub seed: u64,
    /// Alarms: every check alone in the order of the battery, then the whole verdict; those of runs that stop as soon as they know come last.
    pub rows: Vec<Row>,
    /// The p-values of every part of every check, for all samplers together and for each.
    pub uniformity: Vec<Uniformity>,
}

impl Calibration {
    /// Whether no rate is over its level and no p-value is smaller than it should be, or not uniform where it claims to be.
    pub fn holds(&self) -> bool {
        !self.rows.iter().any(Row::over) && !self.uniformity.iter().any(Uniformity::refuted)
    }

    /// The row of a check alone, or of the `whole verdict`.
    pub fn row(&self, name: &str, mode: Mode) -> Option<&Row> {
        self.rows.iter().find(|row| row.mode == mode && row.name() == name)
    }

    /// The uniformity of the p-values behind a row, worst first.
    pub fn uniformity_of(&self, row: &Row) -> Vec<&Uniformity> {
        let mut all: Vec<&Uniformity> = self
            .uniformity
            .iter()
            .filter(|u| u.mode == row.mode && row.subject == Subject::Check(u.check))
            .collect();
        all.sort_by(|a, b| a.adjusted_p.total_cmp(&b.adjusted_p).then(a.p.total_cmp(&b.p)));
        all
    }
}

/// Examines each candidate again and again, and counts how often it fails.
///
/// Fewer runs than planned are judged if [`Plan::stop`] is set, and none if it is set from the start. No bit depends on the number of threads.
///
/// ```
/// use warpcheck::calibration::{calibrate, Candidate, Mode, Plan};
/// use warpcheck::sampler::{BarycentricWarp, TriangleWarp};
///
/// let triangle = BarycentricWarp::new(TriangleWarp::LowDistortion, 1.0)?;
/// let plan = Plan { runs: 20, samples: 5_000, anytime_samples: 0, ..Plan::default() };
/// let calibration = calibrate(&[Candidate::sampler("triangle", &triangle)], &plan);
/// assert!(calibration.holds());
/// let whole = calibration.row("whole verdict", Mode::Fixed).unwrap();
/// assert_eq!(whole.all.runs, 20);
/// println!("{} of 20 failed at level 0.05", whole.all.rates[0].alarms);
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
pub fn calibrate(candidates: &[Candidate<'_>], plan: &Plan) -> Calibration {
    let schedule = schedule(candidates, plan.runs);
    let mut observations: Vec<(usize, Mode, Observation)> = Vec::new();
    let (mut next, total) = (0, schedule.len() as u64);
    while next < total && !plan.stopped() {
        let batch = BATCH.min(total - next);
        let done = parallel::map(batch as usize, |i| {
            let run = next + i as u64;
            let which = schedule[run as usize];
            let mut both = Vec::new();
            for mode in [Mode::Fixed, Mode::Anytime] {
                let settings = plan.settings(run, mode);
                if settings.samples > 0 && !plan.stopped() {
                    both.push((which, mode, observe(&candidates[which].examine, &settings)));
                }
            }
            // What was cut short is not what was asked for.
            (!plan.stopped()).then_some(both)
        });
        observations.extend(done.into_iter().flatten().flatten());
        next += batch;
        if let Some(progress) = &plan.progress {
            progress(next);
        }
    }
    let names: Vec<&str> = candidates.iter().map(|c| c.name.as_str()).collect();
    let runs_of =
        |i: usize| observations.iter().filter(|(which, mode, _)| *which == i && *mode == Mode::Fixed).count();
    let samplers: Vec<(String, u64)> =
        names.iter().enumerate().map(|(i, name)| ((*name).to_owned(), runs_of(i) as u64)).collect();
    let mut calibration = Calibration {
        runs: samplers.iter().map(|s| s.1).sum(),
        samplers,
        samples: plan.samples,
        anytime_samples: plan.anytime_samples,
        seed: plan.seed,
        rows: rate::rows(&names, &observations),
        uniformity: uniformity::parts(&names, &observations),
    };
    correct(&mut calibration);
    calibration
}

/// Which candidate each run belongs to: in turns, as the shares say, so that also a part of the runs is shared out fairly.
fn schedule(candidates: &[Candidate<'_>], runs: u64) -> Vec<usize> {
    let shares: f64 = candidates.iter().map(|c| f64::from(c.share)).sum();
    let mut given = vec![0.0; candidates.len()];
    (0..runs)
        .map_while(|run| {
            let owed = |i: usize| f64::from(candidates[i].share) / shares * (run as f64 + 1.0) - given[i];
            let next = (0..candidates.len()).max_by(|&a, &b| owed(a).total_cmp(&owed(b)).then(b.cmp(&a)))?;
            given[next] += 1.0;
            Some(next)
        })
        .collect()
}

/// Holm's correction over everything that can say no.
fn correct(calibration: &mut Calibration) {
    let rates =
        calibration.rows.iter_mut().flat_map(Row::tallies_mut).flat_map(|tally| tally.rates.iter_mut());
    let parts = calibration.uniformity.iter_mut();
    let (p, mut slots): (Vec<f64>, Vec<&mut f64>) = rates
        .map(|rate| (rate.p, &mut rate.adjusted_p))
        .chain(parts.map(|part| (part.p, &mut part.adjusted_p)))
        .unzip();
    // All of them are probabilities, so that there is nothing to refuse.
    for (slot, adjusted) in slots.iter_mut().zip(holm(&p).unwrap_or_default()) {
        **slot = adjusted;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_kept_at_any_number_of_runs() {
        let candidate = |share| Candidate::new("", |_| unreachable!()).share(share);
        let candidates = [candidate(5), candidate(1), candidate(2)];
        for runs in [8, 80, 800] {
            let schedule = schedule(&candidates, runs);
            let of = |i| schedule.iter().filter(|&&s| s == i).count() as u64;
            assert_eq!([of(0), of(1), of(2)], [5, 1, 2].map(|share| share * runs / 8));
        }
        assert!(schedule(&[], 5).is_empty());
    }
}
