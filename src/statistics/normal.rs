//! The standard normal distribution, accurate far out in the tail.
//!
//! P(Z > z) = Q(1/2, z^2/2) / 2 for z >= 0 (DLMF 7.11.2), through the incomplete gamma function of `gamma.rs`, whose
//! logarithm does not underflow; P(Z > -z) = 1 - P(Z > z).

use super::error::{Error, probability};
use super::gamma;
use super::root::find_root_increasing;
use std::f64::consts::LN_2;

/// P(Z > z). Relative error below 1e-13 while the result is a normal number (z up to 37.5); NaN for NaN.
///
/// ```
/// let p = warpcheck::statistics::normal::sf(10.0);
/// assert!((p / 7.619853024160527e-24 - 1.0).abs() < 1e-13);
/// ```
pub fn sf(z: f64) -> f64 {
    if z.is_nan() {
        return f64::NAN;
    }
    let tail = gamma::tail(0.5, 0.5 * z * z);
    if z >= 0.0 { 0.5 * tail.upper() } else { 0.5 + 0.5 * tail.lower() }
}

/// ln P(Z > z), for any z: no underflow, and no loss where P is close to 1. NaN for NaN.
///
/// ```
/// let ln_p = warpcheck::statistics::normal::ln_sf(100.0);
/// assert!((ln_p + 5005.524208694205).abs() < 1e-9);
/// ```
pub fn ln_sf(z: f64) -> f64 {
    if z.is_nan() {
        f64::NAN
    } else if z >= 0.0 {
        gamma::tail(0.5, 0.5 * z * z).ln_upper() - LN_2
    } else {
        (-sf(-z)).ln_1p()
    }
}

/// The z with P(Z > z) = `p`; infinite at the ends. Relative error about 1e-13.
///
/// # Errors
/// `p` outside [0, 1], or NaN.
///
/// ```
/// let z = warpcheck::statistics::normal::isf(0.025)?;
/// assert!((z - 1.959963984540054).abs() < 1e-12);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn isf(p: f64) -> Result<f64, Error> {
    probability("p", p)?;
    Ok(if p == 0.5 {
        0.0
    } else if p > 0.5 {
        -positive_isf(1.0 - p)
    } else {
        positive_isf(p)
    })
}

/// The z > 0 with P(Z > z) = p, p < 1/2.
fn positive_isf(p: f64) -> f64 {
    if p == 0.0 {
        return f64::INFINITY;
    }
    let ln_p = p.ln();
    find_root_increasing(0.0, 1.0, 0.0, |z| ln_p - ln_sf(z))
}
