//! An estimator whose answer is known: a function of uniform variates that is right on average.
//!
//! Weights of multiple importance sampling, light counts, rejected samples: what is wrong with them shows in no density, only in the mean. It is tested as
//! [`Moments::mean_test`](crate::statistics::Moments::mean_test) does, which gives no answer where the tails are too heavy for one.

use super::edges;
use super::examination::{Against, Examination};
use super::finding::{Evidence, Finding, Verdict};
use super::report::Report;
use super::setters::setters;
use super::settings::Settings;
use super::{Diagnosis, diagnosis};
use crate::domain::Interval;
use crate::random::{fill_unit, stream};
use crate::sampler::Variates;
use crate::statistics::{Moments, Trust, normal};
use std::time::Instant;

/// Samples a shard.
const SHARD: u64 = 1 << 14;
/// Relative difference from the truth that rounding explains.
const ROUNDING: f64 = 1e-6;
/// Standard errors within which a mean looks like a multiple of the truth.
const SURE: f64 = 4.0;

/// Begins to verify an estimator: `truth` is what its mean should be. A sample that is rejected is one of value 0.
///
/// ```
/// use warpcheck::verify::{Verdict, estimator};
/// // The irradiance under a white sky by uniform directions: cos theta over 1 / 2 pi.
/// let right = |[u, _]: [f32; 2]| f64::from(std::f32::consts::TAU * (1.0 - u));
/// estimator(right, std::f64::consts::PI).samples(100_000).run().assert();
/// let wrong = move |xi: [f32; 2]| 0.5 * right(xi);
/// let report = estimator(wrong, std::f64::consts::PI).samples(100_000).run();
/// assert_eq!(report.verdict(), Verdict::Fail);
/// assert!(report.examinations[0].diagnosis.as_ref().unwrap().is("constant 1 / 2"));
/// ```
pub fn estimator<'a, X: Variates>(estimate: impl Fn(X) -> f64 + Sync + 'a, truth: f64) -> Estimator<'a> {
    Estimator {
        estimate: Box::new(move |xi| estimate(X::from_variates(xi))),
        dimensions: X::DIMENSIONS,
        truth,
        name: "estimator".to_owned(),
        settings: Settings::default(),
    }
}

/// A verification of an estimator that is being set up; see [`estimator`].
pub struct Estimator<'a> {
    estimate: Box<dyn Fn(&[f64]) -> f64 + Sync + 'a>,
    dimensions: usize,
    truth: f64,
    name: String,
    settings: Settings,
}

impl Estimator<'_> {
    setters! {
        name: "What the report calls it.";
        samples: "How many samples to draw; 1e6 unless told.";
        settings;
        run: "Draws, and judges the mean.";
    }

    /// Draws without judging, so that several estimators can be judged in one [`Report`].
    pub fn examine(self) -> Examination {
        let start = Instant::now();
        let moments = self.draw();
        let (mean, diagnosis) = self.mean(&moments);
        Examination {
            domain: "estimator",
            per: "sample",
            findings: vec![self.ends(), mean],
            diagnosis,
            time: start.elapsed(),
            ..Examination::bare(
                self.name.clone(),
                &Interval::new(0.0, 1.0),
                moments.count(),
                Against::Relations,
            )
        }
    }

    fn draw(&self) -> Moments {
        let samples = self.settings.samples;
        let shards = crate::parallel::map(samples.div_ceil(SHARD) as usize, |shard| {
            let mut rng = stream(self.settings.seed, "estimator", shard as u64);
            let mut xi = vec![0.0; self.dimensions];
            let mut moments = Moments::new();
            for _ in 0..SHARD.min(samples - shard as u64 * SHARD) {
                fill_unit(&mut rng, &mut xi);
                moments.add((self.estimate)(&xi));
            }
            moments
        });
        let mut all = Moments::new();
        shards.iter().for_each(|shard| all.merge(shard));
        all
    }

    /// Values at the ends of the variates.
    fn ends(&self) -> Finding {
        let bad = edges::places(self.dimensions)
            .find_map(|xi| Some((self.estimate)(&xi)).filter(|x| !x.is_finite()).map(|value| (xi, value)));
        match bad {
            Some((xi, value)) => {
                Finding::certain("domain", Verdict::Fail, format!("at xi = {xi:?} the value is {value}"))
            }
            None => {
                Finding::certain("domain", Verdict::Pass, "values are finite at the ends of the variates")
            }
        }
    }

    fn mean(&self, moments: &Moments) -> (Finding, Option<Diagnosis>) {
        let (mean, truth) = (moments.mean(), self.truth);
        let Ok(test) = moments.mean_test(truth, ROUNDING * truth.abs()) else {
            let detail = format!("not every value is a number: their mean is {mean}");
            return (Finding::certain("mean", Verdict::Fail, detail), None);
        };
        let error = moments.standard_error().unwrap_or(f64::NAN);
        let detail = format!("the mean is {mean:.6} +- {error:.1e}, the truth {truth:.6}");
        let p = test.p_conservative;
        let evidence = match test.trust {
            Trust::Constant => Evidence::Certain(if p == 0.0 { Verdict::Fail } else { Verdict::Pass }),
            trust if trust.is_trusted() => Evidence::Chance { p, conservative: p },
            _ => Evidence::Unanswered,
        };
        // What is seen with probability 0.99 (2.33 standard errors) beyond what alpha asks for.
        let z = 2.33 + normal::isf(0.5 * self.settings.own_alpha()).unwrap_or(f64::NAN);
        let sees = format!("a mean that is {:.1e} off", z * error + ROUNDING * truth.abs());
        let finding = Finding::new("mean", evidence, detail).sees(sees);
        let suspicious = p < self.settings.alpha && evidence != Evidence::Unanswered;
        let tolerance = ROUNDING + SURE * error / mean.abs();
        let named = suspicious && truth != 0.0;
        (finding, if named { diagnosis::of_mean(mean / truth, tolerance) } else { None })
    }
}
