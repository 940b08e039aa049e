//! What a verification is told: how many samples, which seed, how sure.

use super::examination::{Against, Examination, examine};
use super::finding::{Finding, Verdict};
use super::probe::{Extras, Importance, Known, Subject};
use super::report::Report;
use super::setters::setters;
use crate::domain::{Domain, Space};
use crate::sampler::Sampler;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

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
    /// Samples to draw, at most.
    pub samples: u64,
    /// Stop drawing after this time. What was drawn until then depends on the machine, and with it every figure.
    pub time: Option<Duration>,
    /// Look after every batch and stop as soon as it is known, by tests that allow it.
    pub anytime: bool,
    /// Seed of the run; same seed, same bits.
    pub seed: u64,
    /// The probability that a run of right samplers fails, at most, over everything it tests.
    pub alpha: f64,
    /// How many other samplers the same suite verifies in runs of their own; all share alpha.
    pub others: u64,
    /// How many samplers this run judges together.
    pub samplers: u64,
    /// Names of checks to leave out.
    pub without: Vec<String>,
    /// Whether to look for what would explain a failure, which may take longer than all else.
    pub diagnose: bool,
    /// Called now and then while samples are drawn.
    pub progress: Option<Arc<dyn Fn(Drawn) + Send + Sync>>,
    /// Once set, drawing ends soon and what was drawn is judged.
    pub stop: Option<Arc<AtomicBool>>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            samples: 1_000_000,
            time: None,
            anytime: false,
            seed: 1,
            alpha: 1e-3,
            others: 0,
            samplers: 1,
            without: Vec::new(),
            diagnose: true,
            progress: None,
            stop: None,
        }
    }
}

impl Settings {
    /// The part of alpha that is this run's own.
    pub(super) fn own_alpha(&self) -> f64 {
        self.alpha / (1.0 + self.others as f64)
    }

    /// The level at which an anytime-valid test stops.
    pub(super) fn stopping_level(&self) -> f64 {
        self.own_alpha() / self.samplers.max(1) as f64
    }

    pub(crate) fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }
}

/// A verification that is being set up; see [`verify`](super::verify).
pub struct Verify<'a, D: Domain> {
    sampler: &'a dyn Sampler<Domain = D>,
    extras: Extras<'a, D::Point>,
    name: String,
    settings: Settings,
}

impl<'a, D: Domain> Verify<'a, D> {
    setters! {
        name: "What the report calls the sampler.";
        samples: "How many samples to draw; 1e6 unless told.";
        seed: "The seed; 1 unless told.";
        alpha: "The probability that a right sampler fails, at most; 1e-3 unless told.";
        settings;
        run: "Runs the checks and judges them.";
    }

    /// `full`: the name of the sampler's type.
    pub(super) fn new(sampler: &'a dyn Sampler<Domain = D>, full: &str) -> Self {
        // "warpcheck::sampler::phong::PhongLobe" -> "PhongLobe"
        let head = full.split('<').next().unwrap_or(full);
        let name = head.rsplit("::").next().unwrap_or(full).to_owned();
        Self { sampler, extras: Extras::default(), name, settings: Settings::default() }
    }

    /// How many other samplers the same suite verifies; alpha is shared among all.
    pub fn among(mut self, others: u64) -> Self {
        self.settings.others = others;
        self
    }

    /// Draws for this many seconds, or until the number of samples is reached.
    ///
    /// # Panics
    /// Unless it is positive and finite.
    #[track_caller]
    pub fn seconds(mut self, seconds: f64) -> Self {
        assert!(
            seconds > 0.0 && seconds < 1e9,
            "the budget is {seconds} seconds; it must be positive and finite"
        );
        self.settings.time = Some(Duration::from_secs_f64(seconds));
        self
    }

    /// Looks after every batch and stops as soon as it is known that the sampler is wrong. However often it looks, a right sampler fails with
    /// probability alpha at most. Only tests that allow this are made: few cells, so that what they see is coarse.
    ///
    /// ```
    /// use warpcheck::sampler::CosineHemisphere;
    /// warpcheck::verify(&CosineHemisphere).anytime().samples(500_000).run().assert();
    /// ```
    pub fn anytime(mut self) -> Self {
        self.settings.anytime = true;
        self
    }

    /// Leaves a check out, by its name ([`checks`](super::checks)).
    ///
    /// # Panics
    /// If there is no check of this name.
    #[track_caller]
    pub fn without(mut self, check: &str) -> Self {
        let known = super::checks().any(|(name, _)| name == check);
        assert!(known, "there is no check `{check}`");
        self.settings.without.push(check.to_owned());
        self
    }

    /// Does not look for what would explain a failure: for those who only count failures.
    pub fn undiagnosed(mut self) -> Self {
        self.settings.diagnose = false;
        self
    }

    /// What the sampler is for: wherever `target` is positive, the density must be. For an environment map its radiance as it is looked up, for a light
    /// its emission.
    ///
    /// ```
    /// use warpcheck::{domain::Square, sampler::from_fn};
    /// let half = from_fn(Square, |[u, v]: [f64; 2]| [0.5 * u, v], |p: [f64; 2]| if p[0] < 0.5 { 2.0 } else { 0.0 });
    /// warpcheck::verify(&half).target(|p| if p.x < 0.4 { 1.0 } else { 0.0 }).samples(50_000).run().assert();
    /// ```
    pub fn target(mut self, target: impl Fn(&D::Point) -> f64 + Send + Sync + 'a) -> Self {
        self.extras.target = Some(Box::new(target));
        self
    }

    /// A function whose integral over the domain is known: the mean of f / density must be it.
    ///
    /// ```
    /// use warpcheck::sampler::CosineHemisphere;
    /// warpcheck::verify(&CosineHemisphere)
    ///     .integral("irradiance of a white sky", |w| w.z, std::f64::consts::PI)
    ///     .samples(50_000)
    ///     .run()
    ///     .assert();
    /// ```
    pub fn integral(
        mut self,
        name: impl Into<String>,
        function: impl Fn(&D::Point) -> f64 + Send + Sync + 'a,
        integral: f64,
    ) -> Self {
        self.extras.known.push(Known { name: name.into(), function: Box::new(function), integral });
        self
    }

    /// What the density should follow: `function` / density is as constant as `spread` says, its standard deviation over its mean. An error
    /// here makes no picture wrong, only noisy: the density is not that of the function that it was made for. 0 asks for exact proportion.
    ///
    /// ```
    /// use warpcheck::sampler::CosineHemisphere;
    /// use warpcheck::verify::Verdict;
    /// warpcheck::verify(&CosineHemisphere).importance(|w| w.z, 0.0).samples(50_000).run().assert();
    /// let report = warpcheck::verify(&CosineHemisphere).importance(|w| w.z * w.z, 0.1).samples(50_000).run();
    /// assert_eq!(report.verdict(), Verdict::Fail);
    /// ```
    ///
    /// # Panics
    /// Unless the spread is at least 0.
    #[track_caller]
    pub fn importance(mut self, function: impl Fn(&D::Point) -> f64 + Send + Sync + 'a, spread: f64) -> Self {
        assert!(spread >= 0.0, "the spread is {spread}; it must be at least 0");
        self.extras.importance = Some(Importance { function: Box::new(function), spread });
        self
    }

    /// A density, up to a constant, that the sampler may have by mistake, for the diagnosis to try: "my pdf without the Jacobian".
    pub fn rival(
        mut self,
        name: impl Into<String>,
        density: impl Fn(&D::Point) -> f64 + Send + Sync + 'a,
    ) -> Self {
        self.extras.rivals.push((name.into(), Box::new(density)));
        self
    }

    /// Runs the checks without judging them, so that several samplers can be judged in one [`Report`].
    pub fn examine(self) -> Examination {
        if !self.sampler.has_density() {
            return without_density(self.name, &self.sampler.domain());
        }
        examine(&Subject::new(self.sampler, &self.extras), self.name, &self.settings)
    }
}

fn without_density(name: String, space: &dyn Space) -> Examination {
    let detail = "the sampler has no density to hold its samples against; verify::compare holds them against those of another sampler";
    Examination {
        findings: vec![Finding::certain("density", Verdict::Inconclusive, detail)],
        ..Examination::bare(name, space, 0, Against::Density)
    }
}
