//! Which directions are drawn to estimate the light that a point reflects.
//!
//! | strategy | density per solid angle of a direction w |
//! | --- | --- |
//! | uniform | 1 / 2 pi on the hemisphere about the normal |
//! | brdf | p_brdf, that of the BRDF's lobes |
//! | light | p_light, of the point of an emitter, or of the environment, that w leads to |
//! | mis:c | c p_brdf + (1 - c) p_light: one sample, of one of the two with probabilities c and 1 - c |
//! | mis:auto | the same with a c for each pixel |
//! | mis-two, mis-two:power | one of p_brdf and one of p_light, weighted by the balance or the power heuristic |
//!
//! mis:c is the one-sample estimator with the balance heuristic (Veach 1997, section 9.2.4), mis-two the two-sample
//! estimator (section 9.2.2): it takes two rays for a sample, and its sum of both has no variance from the choice.
//!
//! mis:auto chooses c by [`AUTO_PASSES`] passes before the first: with f the integrand and p_c the mixture, the
//! second moment of f / p_c is the integral of f^2 / p_c, which samples of the mixture with 1/2 estimate for every
//! c at once as the mean of f^2 / (p_c p_{1/2}). The c of [`AUTO_WEIGHTS`] with the least mean, in luminance
//! over the pixel and its eight neighbours, is taken. These passes draw from streams of their own and are left
//! out of the picture, which is unbiased for that: given the weights, its samples are independent of those that chose
//! them. No candidate is 0 or 1, so that a wrong choice has at most 8 times the second moment of the better strategy.

use super::Error;
use crate::sampler::Heuristic;
use std::{fmt, str::FromStr};

/// How many passes [`Strategy::MisAuto`] chooses its weights by.
pub const AUTO_PASSES: u32 = 16;
/// The weights of the BRDF that [`Strategy::MisAuto`] chooses among.
pub const AUTO_WEIGHTS: [f32; 5] = [0.125, 0.25, 0.5, 0.75, 0.875];

/// From which density directions are drawn.
///
/// Written and read as `uniform`, `brdf`, `light`, `mis:0.75`, `mis:auto`, `mis-two`, `mis-two:power`; `mis` alone
/// is `mis:0.5`, `mis-two:balance` is `mis-two`.
///
/// ```
/// use warpcheck::estimator::Strategy;
/// let strategy: Strategy = "mis:0.75".parse()?;
/// assert_eq!(strategy, Strategy::Mis { brdf_weight: 0.75 });
/// assert_eq!(strategy.to_string(), "mis:0.75");
/// assert!("mis:1.5".parse::<Strategy>().is_err());
/// # Ok::<(), warpcheck::estimator::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Strategy {
    /// Uniform over the hemisphere: the baseline that everything must beat.
    Uniform,
    /// From the lobes of the BRDF.
    Brdf,
    /// From the lights.
    Light,
    /// From a mixture of both.
    Mis {
        /// The probability c of drawing from the BRDF, in [0, 1]. 0 is [`Strategy::Light`] and 1 is
        /// [`Strategy::Brdf`], bit for bit.
        brdf_weight: f64,
    },
    /// From a mixture of both whose weight is chosen for each pixel.
    MisAuto,
    /// One from the lobes, one from the lights.
    MisTwo {
        /// How the two are weighted.
        heuristic: Heuristic,
    },
}

impl Strategy {
    /// Whether directions are drawn from the lights.
    pub fn draws_lights(self) -> bool {
        match self {
            Self::Uniform | Self::Brdf => false,
            Self::Mis { brdf_weight } => brdf_weight < 1.0,
            Self::Light | Self::MisAuto | Self::MisTwo { .. } => true,
        }
    }

    /// Whether directions are drawn from the lobes of the BRDF.
    pub fn draws_lobes(self) -> bool {
        match self {
            Self::Uniform | Self::Light => false,
            Self::Mis { brdf_weight } => brdf_weight > 0.0,
            Self::Brdf | Self::MisAuto | Self::MisTwo { .. } => true,
        }
    }
}

impl fmt::Display for Strategy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Uniform => f.pad("uniform"),
            Self::Brdf => f.pad("brdf"),
            Self::Light => f.pad("light"),
            Self::Mis { brdf_weight } => f.pad(&format!("mis:{brdf_weight}")),
            Self::MisAuto => f.pad("mis:auto"),
            Self::MisTwo { heuristic: Heuristic::Balance } => f.pad("mis-two"),
            Self::MisTwo { heuristic: Heuristic::Power } => f.pad("mis-two:power"),
        }
    }
}

impl FromStr for Strategy {
    type Err = Error;

    fn from_str(given: &str) -> Result<Self, Error> {
        let wrong = || Error::Strategy { given: given.into() };
        Ok(match given {
            "uniform" => Self::Uniform,
            "brdf" => Self::Brdf,
            "light" => Self::Light,
            "mis" => Self::Mis { brdf_weight: 0.5 },
            "mis:auto" => Self::MisAuto,
            "mis-two" | "mis-two:balance" => Self::MisTwo { heuristic: Heuristic::Balance },
            "mis-two:power" => Self::MisTwo { heuristic: Heuristic::Power },
            _ => {
                let weight = given.strip_prefix("mis:").and_then(|c| c.parse().ok());
                let brdf_weight = weight.filter(|c| (0.0..=1.0).contains(c)).ok_or_else(wrong)?;
                Self::Mis { brdf_weight }
            }
        })
    }
}
