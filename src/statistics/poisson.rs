//! Exact Poisson tails and test.
//!
//! P(X >= k) = P(k, mean) and P(X <= k) = Q(k + 1, mean), the incomplete gamma functions (DLMF 8.4.10); the probability of
//! a single count is Loader's saddle-point form (`saddle.rs`).

use super::error::{Error, require};
use super::gamma::{self, Tail};
use super::saddle::ln_poisson;

/// The tail at and above k: its "lower" is P(X >= k), its "upper" P(X < k).
fn tail_from(k: u64, mean: f64) -> Result<Tail, Error> {
    require(mean >= 0.0 && mean.is_finite(), "mean", mean, "non-negative and finite")?;
    Ok(if k == 0 { Tail::Upper(f64::NEG_INFINITY) } else { gamma::tail(k as f64, mean) })
}

/// P(X = k). Relative error about 1e-13.
///
/// # Errors
/// `mean` negative, infinite or NaN; so for all functions of this file.
///
/// ```
/// let p = warpcheck::statistics::poisson::pmf(0, 2.0)?;
/// assert!((p - f64::exp(-2.0)).abs() < 1e-16);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn pmf(k: u64, mean: f64) -> Result<f64, Error> {
    tail_from(k, mean)?;
    Ok(if mean == 0.0 { f64::from(k == 0) } else { ln_poisson(k as f64, mean).exp() })
}

/// P(X >= k). Relative error below 1e-11 for means up to 1e10, near the mean as in the tail; errors as for [`pmf`].
///
/// ```
/// let p = warpcheck::statistics::poisson::upper_tail(1, 1e-9)?;
/// assert!((p / 0.9999999995e-9 - 1.0).abs() < 1e-12);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn upper_tail(k: u64, mean: f64) -> Result<f64, Error> {
    Ok(tail_from(k, mean)?.lower())
}

/// P(X <= k); accuracy as for [`upper_tail`], errors as for [`pmf`].
pub fn lower_tail(k: u64, mean: f64) -> Result<f64, Error> {
    Ok(tail_from(k.saturating_add(1), mean)?.upper())
}

/// ln P(X >= k), which does not underflow; errors as for [`pmf`].
pub fn ln_upper_tail(k: u64, mean: f64) -> Result<f64, Error> {
    Ok(tail_from(k, mean)?.ln_lower())
}

/// ln P(X <= k), which does not underflow; errors as for [`pmf`].
pub fn ln_lower_tail(k: u64, mean: f64) -> Result<f64, Error> {
    Ok(tail_from(k.saturating_add(1), mean)?.ln_upper())
}

/// Two-sided exact p-value of a count `k`: twice the smaller tail, at most 1 (the convention of
/// [`binomial::two_sided`](super::binomial::two_sided)); errors as for [`pmf`].
///
/// ```
/// let p = warpcheck::statistics::poisson::two_sided(0, 3.0)?;
/// assert!((p - 2.0 * f64::exp(-3.0)).abs() < 1e-15);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn two_sided(k: u64, mean: f64) -> Result<f64, Error> {
    Ok((2.0 * upper_tail(k, mean)?.min(lower_tail(k, mean)?)).min(1.0))
}
