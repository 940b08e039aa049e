//! Which directions are drawn to estimate the light that a point reflects.
//!
//! | strategy | density per solid angle of a direction w |
//! | --- | --- |
//! | uniform | 1 / 2 pi on the hemisphere about the normal |
//! | brdf | p_brdf, that of the BRDF's lobes |
//! | light | p_light, of the point of an emitter, or of the environment, that w leads to |
//! | mis:c | c p_brdf + (1 - c) p_light: one sample, of one of the two with probabilities c and 1 - c |
//!
//! The last is the one-sample estimator with the balance heuristic (Veach 1997, section 9.2.4).

use super::Error;
use std::{fmt, str::FromStr};

/// From which density directions are drawn.
///
/// Written and read as `uniform`, `brdf`, `light`, `mis:0.75`; `mis` alone is `mis:0.5`.
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
}

impl fmt::Display for Strategy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Uniform => f.pad("uniform"),
            Self::Brdf => f.pad("brdf"),
            Self::Light => f.pad("light"),
            Self::Mis { brdf_weight } => f.pad(&format!("mis:{brdf_weight}")),
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
            _ => {
                let weight = given.strip_prefix("mis:").and_then(|c| c.parse().ok());
                let brdf_weight = weight.filter(|c| (0.0..=1.0).contains(c)).ok_or_else(wrong)?;
                Self::Mis { brdf_weight }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for name in ["uniform", "brdf", "light", "mis:0", "mis:0.25", "mis:1"] {
            assert_eq!(name.parse::<Strategy>().unwrap().to_string(), name);
        }
        assert_eq!("mis".parse::<Strategy>().unwrap(), Strategy::Mis { brdf_weight: 0.5 });
        for name in ["", "Light", "mis:", "mis:nan", "mis:-0.1", "mis:1.01", "mis:inf", "mis2"] {
            let error = name.parse::<Strategy>().unwrap_err().to_string();
            assert!(error.starts_with(&format!("`{name}` is no strategy")), "{error}");
        }
    }
}
