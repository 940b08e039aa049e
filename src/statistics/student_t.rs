//! Student's t distribution.
//!
//! P(T > t) = I_x(df/2, 1/2) / 2 with x = df / (df + t^2), t >= 0 (Abramowitz and Stegun 26.7.1), both x and 1 - x being
//! formed without cancellation. From df = 1e15 on, the difference to the normal distribution is below 1e-12 wherever
//! p > 1e-300, and the normal takes over.

use super::error::{Error, probability, require};
use super::root::find_root_increasing;
use super::{beta, normal};

/// Where the distribution becomes the normal one.
const LARGE: f64 = 1e15;

/// P(T > t) with `df` degrees of freedom, not necessarily whole. Relative error below 1e-11.
///
/// # Errors
/// `t` NaN; `df` not positive, or NaN. An infinite `df` is the normal distribution.
///
/// ```
/// // One degree of freedom is Cauchy's distribution.
/// let p = warpcheck::statistics::student_t::sf(1.0, 1.0)?;
/// assert!((p - 0.25).abs() < 1e-15);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn sf(t: f64, df: f64) -> Result<f64, Error> {
    require(!t.is_nan(), "t", t, "a number")?;
    require(df > 0.0, "df", df, "positive")?;
    if df >= LARGE {
        return Ok(normal::sf(t));
    }
    let ratio = t * (t / df);
    let tail = beta::tail(0.5 * df, 0.5, 1.0 / (1.0 + ratio), 1.0 / (1.0 + 1.0 / ratio));
    Ok(if t >= 0.0 { 0.5 * tail.lower() } else { 0.5 + 0.5 * tail.upper() })
}

/// The t with P(T > t) = `p` and `df` degrees of freedom; infinite at the ends. Relative error about 1e-11.
///
/// # Errors
/// `p` outside [0, 1], or NaN; `df` not positive, or NaN.
///
/// ```
/// let t = warpcheck::statistics::student_t::isf(0.025, 4.0)?;
/// assert!((t - 2.7764451051977987).abs() < 1e-9);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn isf(p: f64, df: f64) -> Result<f64, Error> {
    probability("p", p)?;
    require(df > 0.0, "df", df, "positive")?;
    let positive = |p: f64| match p {
        0.0 => f64::INFINITY,
        // df is fine, and t is a number.
        _ => find_root_increasing(0.0, 1.0, 0.0, |t| p.ln() - sf(t, df).map_or(0.0, f64::ln)),
    };
    Ok(match p {
        0.5 => 0.0,
        _ if p > 0.5 => -positive(1.0 - p),
        _ => positive(p),
    })
}
