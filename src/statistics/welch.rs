//! Welch's t test: do two samples of unequal variance have the same mean?
//!
//! t = (m_1 - m_2) / sqrt(e_1 + e_2) with e_i = s_i^2 / n_i, referred to Student's t with
//! (e_1 + e_2)^2 / (e_1^2 / (n_1 - 1) + e_2^2 / (n_2 - 1)) degrees of freedom
//! (Welch, "The generalization of Student's problem", Biometrika 34, 1947; Satterthwaite 1946).

use super::error::{Error, require};
use super::{Moments, student_t};

/// What Welch's test found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Welch {
    /// Difference of the means, first minus second, in standard errors.
    pub t: f64,
    /// Effective degrees of freedom.
    pub df: f64,
    /// Probability, if the means are equal, of a |t| at least this large.
    pub p: f64,
}

/// Mean, unbiased variance and count of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Arithmetic mean.
    pub mean: f64,
    /// Unbiased variance (divisor count - 1).
    pub variance: f64,
    /// Number of values.
    pub count: u64,
}

impl From<&Moments> for Summary {
    fn from(moments: &Moments) -> Self {
        Self {
            mean: moments.mean(),
            variance: moments.variance().unwrap_or(f64::NAN),
            count: moments.count(),
        }
    }
}

impl Summary {
    /// Squared standard error of the mean.
    fn check(&self) -> Result<f64, Error> {
        if self.count < 2 {
            return Err(Error::TooFew { name: "sample", len: self.count, min: 2 });
        }
        require(self.mean.is_finite(), "mean", self.mean, "finite")?;
        let ok = self.variance >= 0.0 && self.variance.is_finite();
        require(ok, "variance", self.variance, "non-negative and finite")?;
        Ok(self.variance / self.count as f64)
    }
}

/// Welch's two-sided test of equal means.
///
/// If neither sample varies at all, equal means give t = 0, p = 1, and different ones an infinite t and p = 0.
///
/// # Errors
/// A count below 2, a mean that is not finite, a variance that is negative or not finite.
///
/// ```
/// use warpcheck::statistics::welch::{Summary, welch_t_test};
/// let a = Summary { mean: 20.0, variance: 4.0, count: 10 };
/// let b = Summary { mean: 22.0, variance: 9.0, count: 12 };
/// let found = welch_t_test(a, b)?;
/// assert!((found.t + 1.8650096165).abs() < 1e-9 && (found.df - 19.19).abs() < 0.01);
/// assert!((found.p - 0.0775464387).abs() < 1e-9);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn welch_t_test(first: Summary, second: Summary) -> Result<Welch, Error> {
    let (e1, e2) = (first.check()?, second.check()?);
    let difference = first.mean - second.mean;
    let error = e1 + e2;
    if error == 0.0 {
        let df = (first.count - 1) as f64 + (second.count - 1) as f64;
        return Ok(if difference == 0.0 {
            Welch { t: 0.0, df, p: 1.0 }
        } else {
            Welch { t: difference.signum() * f64::INFINITY, df, p: 0.0 }
        });
    }
    // Shares of the squared error, so that tiny or huge variances neither under- nor overflow.
    let (w1, w2) = (e1 / error, e2 / error);
    let df = 1.0 / (w1 * w1 / (first.count - 1) as f64 + w2 * w2 / (second.count - 1) as f64);
    let t = difference / error.sqrt();
    Ok(Welch { t, df, p: (2.0 * student_t::sf(t.abs(), df)?).min(1.0) })
}
