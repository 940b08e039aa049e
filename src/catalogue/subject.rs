//! A sampler as a trait object: what can be done with one without knowing its points.

use crate::domain::Space;
use crate::fault::Specimen;
use crate::histogram::{Histogram, claimed_density};
use crate::sampler::Sampler;
use crate::verify::{Examination, Settings, verify};

/// A sampler of whatever domain.
pub trait Subject: Send + Sync {
    /// Runs the checks.
    fn examine(&self, name: &str, settings: &Settings) -> Examination;

    /// Draws a histogram of this height.
    fn histogram(&self, height: usize, settings: &Settings) -> HistogramFigure;

    /// Width over height of its pictures.
    fn aspect(&self) -> f64;
}

/// A histogram and what it should look like.
#[derive(Clone, Debug)]
pub struct HistogramFigure {
    /// The counts.
    pub histogram: Histogram,
    /// Density of the samples per pixel, per the domain's measure; NaN outside of the domain.
    pub drawn: Vec<f64>,
    /// Density that the sampler claims, likewise.
    pub claimed: Vec<f64>,
    /// What the density is per.
    pub per: &'static str,
    /// The domain.
    pub domain: &'static str,
    /// What the picture's axes are.
    pub caption: &'static str,
}

/// Those that are samplers; of the others there is no picture to draw.
impl Subject for Specimen {
    fn examine(&self, name: &str, settings: &Settings) -> Examination {
        Specimen::examine(self, name, settings)
    }

    fn histogram(&self, height: usize, settings: &Settings) -> HistogramFigure {
        self.as_subject().expect("a specimen that is a sampler").histogram(height, settings)
    }

    fn aspect(&self) -> f64 {
        self.as_subject().map_or(1.0, Subject::aspect)
    }
}

impl Specimen {
    /// The sampler, of whatever domain, without what its author says of it.
    pub fn as_subject(&self) -> Option<&dyn Subject> {
        Some(match self {
            Self::Discrete(trial) => trial.sampler(),
            Self::Interval(trial) => trial.sampler(),
            Self::Square(trial) => trial.sampler(),
            Self::Triangle(trial) => trial.sampler(),
            Self::Surface(trial) => trial.sampler(),
            Self::Hemisphere(trial) => trial.sampler(),
            Self::Sphere(trial) => trial.sampler(),
            Self::Weights(_) | Self::Maps(_) | Self::Streams(_) | Self::Film(_) | Self::Estimator(_) => {
                return None;
            }
        })
    }
}

impl<S: Sampler + Send> Subject for S {
    fn examine(&self, name: &str, settings: &Settings) -> Examination {
        verify(self).name(name).settings(settings.clone()).examine()
    }

    fn histogram(&self, height: usize, settings: &Settings) -> HistogramFigure {
        let domain = self.domain();
        let width = ((height as f64 * domain.picture_aspect()).round() as usize).max(1);
        let histogram = Histogram::draw(self, width, height, settings);
        HistogramFigure {
            drawn: histogram.density(&domain),
            claimed: claimed_density(self, width, height),
            histogram,
            per: domain.per(),
            domain: domain.name(),
            caption: domain.picture_caption(),
        }
    }

    fn aspect(&self) -> f64 {
        self.domain().picture_aspect()
    }
}
