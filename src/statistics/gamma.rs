//! The regularised incomplete gamma functions, P(a, x) = gamma(a, x) / Gamma(a) and Q = 1 - P.
//!
//! Of the two, the one on the short side of the mode is computed, as a logarithm, and the other is its complement:
//! - x < a + 1: P = x^a e^-x / Gamma(a + 1) * sum_j x^j / ((a + 1) ... (a + j))             (DLMF 8.7.1);
//! - x >= a + 1: Q = x^a e^-x / Gamma(a) * 1/(x + 1 - a - 1 (1 - a)/(x + 3 - a - ...))      (DLMF 8.9.2, even part);
//! - a > 1e5 and x > a / 2, where both would need thousands of terms: Gauss-Legendre over the tail of the density.
//!
//! The factor in front comes from Loader's saddle-point form (`saddle.rs`), so that it keeps its digits for large a.

use super::error::{Error, require};
use super::saddle::{deviance, ln_poisson, tail_integral};

/// Above this shape the tail is integrated.
const LARGE: f64 = 1e5;

/// One tail of a distribution, as a logarithm; the other is its complement.
#[derive(Debug, Clone, Copy)]
pub(super) enum Tail {
    /// ln P(X <= x).
    Lower(f64),
    /// ln P(X > x).
    Upper(f64),
}

impl Tail {
    pub(super) fn ln_lower(self) -> f64 {
        match self {
            Self::Lower(ln) => ln.min(0.0),
            Self::Upper(ln) => ln_one_minus_exp(ln),
        }
    }

    pub(super) fn ln_upper(self) -> f64 {
        match self {
            Self::Upper(ln) => ln.min(0.0),
            Self::Lower(ln) => ln_one_minus_exp(ln),
        }
    }

    pub(super) fn lower(self) -> f64 {
        match self {
            Self::Lower(ln) => ln.min(0.0).exp(),
            Self::Upper(ln) => -ln.min(0.0).exp_m1(),
        }
    }

    pub(super) fn upper(self) -> f64 {
        match self {
            Self::Upper(ln) => ln.min(0.0).exp(),
            Self::Lower(ln) => -ln.min(0.0).exp_m1(),
        }
    }
}

/// ln(1 - e^ln) for ln <= 0.
fn ln_one_minus_exp(ln: f64) -> f64 {
    if ln >= 0.0 {
        f64::NEG_INFINITY
    } else if ln > -std::f64::consts::LN_2 {
        (-ln.exp_m1()).ln()
    } else {
        (-ln.exp()).ln_1p()
    }
}

/// Tail of the gamma distribution of shape a > 0 at x >= 0, both checked by the caller.
pub(super) fn tail(a: f64, x: f64) -> Tail {
    if x == 0.0 {
        return Tail::Lower(f64::NEG_INFINITY);
    }
    if x == f64::INFINITY {
        return Tail::Upper(f64::NEG_INFINITY);
    }
    let ln_kernel = ln_poisson(a, x);
    if a > LARGE && x > 0.5 * a {
        let start = deviance(a, x, a - x);
        let (sign, end) = if x > a { (1.0, f64::INFINITY) } else { (-1.0, x) };
        let rate = ((a - 1.0) / x - 1.0).abs();
        let integral = tail_integral(a.sqrt().min(1.0 / rate), end, |t| {
            let z = x + sign * t;
            start - deviance(a, z, a - z) - (sign * t / x).ln_1p()
        });
        let ln = ln_kernel + (a / x).ln() + integral.ln();
        if x > a { Tail::Upper(ln) } else { Tail::Lower(ln) }
    } else if x < a + 1.0 {
        let (mut sum, mut term, mut n) = (1.0, 1.0, a);
        while term > 1e-17 * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        Tail::Lower(ln_kernel + f64::ln(sum))
    } else {
        let mut b = x + 1.0 - a;
        let (mut c, mut d) = (1e300, 1.0 / b);
        let (mut value, mut i) = (d, 0.0);
        loop {
            i += 1.0;
            let numerator = i * (a - i);
            b += 2.0;
            d = 1.0 / (numerator * d + b);
            c = b + numerator / c;
            value *= c * d;
            if (c * d - 1.0).abs() < 1e-16 || i > 1e6 {
                break;
            }
        }
        Tail::Upper(ln_kernel + (a * value).ln())
    }
}

fn checked_tail(a: f64, x: f64) -> Result<Tail, Error> {
    require(a > 0.0 && a.is_finite(), "a", a, "positive and finite")?;
    require(x >= 0.0, "x", x, "non-negative")?;
    Ok(tail(a, x))
}

/// P(a, x), the share of a gamma distribution of shape `a` (scale 1) that lies below `x`. Relative error below 1e-12
/// down to the smallest `f64`, for a from 0.01 to 1e12.
///
/// # Errors
/// `a` not positive and finite, or `x` negative or NaN.
///
/// ```
/// let p = warpcheck::statistics::gamma::lower(1.0, 2.0)?;
/// assert!((p - (1.0 - f64::exp(-2.0))).abs() < 1e-15);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn lower(a: f64, x: f64) -> Result<f64, Error> {
    Ok(checked_tail(a, x)?.lower())
}

/// Q(a, x) = 1 - P(a, x), with the accuracy and errors of [`lower`].
///
/// ```
/// let q = warpcheck::statistics::gamma::upper(1.0, 500.0)?;
/// assert!((q / f64::exp(-500.0) - 1.0).abs() < 1e-12);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn upper(a: f64, x: f64) -> Result<f64, Error> {
    Ok(checked_tail(a, x)?.upper())
}
