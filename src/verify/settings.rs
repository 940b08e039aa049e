//! What a verification is told: how many samples, which seed, how sure.

use super::examination::{Examination, examine};
use super::report::Report;
use crate::sampler::Sampler;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// How far the drawing of samples has come, for a progress bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drawn {
    /// Samples drawn so far.
    pub samples: u64,
    /// Samples to draw.
    pub of: u64,
}

/// Settings of a verification.
#[derive(Clone)]
pub struct Settings {
    /// Samples to draw.
    pub samples: u64,
    /// Seed of the run; same seed, same bits.
    pub seed: u64,
    /// The probability that a run of right samplers fails, at most, over everything it tests.
    pub alpha: f64,
    /// How many other samplers the same suite verifies in runs of their own; all share alpha.
    pub others: u64,
    /// Called now and then while samples are drawn.
    pub progress: Option<Arc<dyn Fn(Drawn) + Send + Sync>>,
    /// Once set, drawing ends soon and what was drawn is judged.
    pub stop: Option<Arc<AtomicBool>>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { samples: 1_000_000, seed: 1, alpha: 1e-3, others: 0, progress: None, stop: None }
    }
}

impl Settings {
    /// The part of alpha that is this run's own.
    pub(super) fn own_alpha(&self) -> f64 {
        self.alpha / (1.0 + self.others as f64)
    }

    pub(crate) fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }
}

/// A verification that is being set up; see [`verify`](super::verify).
pub struct Verify<'a, S> {
    sampler: &'a S,
    name: String,
    settings: Settings,
}

impl<'a, S: Sampler> Verify<'a, S> {
    pub(super) fn new(sampler: &'a S) -> Self {
        let full = std::any::type_name::<S>();
        // "warpcheck::sampler::phong::PhongLobe" -> "PhongLobe"
        let head = full.split('<').next().unwrap_or(full);
        let name = head.rsplit("::").next().unwrap_or(full).to_owned();
        Self { sampler, name, settings: Settings::default() }
    }

    /// What the report calls the sampler.
    pub fn name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// How many samples to draw; 1e6 unless told.
    ///
    /// # Panics
    /// If it is 0.
    #[track_caller]
    pub fn samples(mut self, samples: u64) -> Self {
        assert!(samples > 0, "there must be at least 1 sample");
        self.settings.samples = samples;
        self
    }

    /// The seed; 1 unless told.
    pub fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }

    /// The probability that a right sampler fails, at most; 1e-3 unless told.
    ///
    /// # Panics
    /// Unless it lies between 0 and 1.
    #[track_caller]
    pub fn alpha(mut self, alpha: f64) -> Self {
        assert!(alpha > 0.0 && alpha < 1.0, "alpha is {alpha}; it must lie between 0 and 1");
        self.settings.alpha = alpha;
        self
    }

    /// How many other samplers the same suite verifies; alpha is shared among all.
    pub fn among(mut self, others: u64) -> Self {
        self.settings.others = others;
        self
    }

    /// All settings at once, in place of any that were made before.
    pub fn settings(mut self, settings: Settings) -> Self {
        self.settings = settings;
        self
    }

    /// Runs the checks without judging them, so that several samplers can be judged in one [`Report`].
    pub fn examine(self) -> Examination {
        examine(self.sampler, self.name, &self.settings)
    }

    /// Runs the checks and judges them.
    pub fn run(self) -> Report {
        let settings = self.settings.clone();
        Report::new(vec![self.examine()], &settings)
    }
}
