//! The noncentral chi-square distribution: what a chi-square test sees when the sampler is wrong.
//!
//! P(X > x) = sum_j e^(-lambda/2) (lambda/2)^j / j! Q(df/2 + j, x/2) (Abramowitz and Stegun 26.4.25), summed outward from the largest Poisson weight, with
//! Q(a + 1, y) = Q(a, y) + y^a e^-y / Gamma(a + 1) (Benton and Krishnamoorthy, CSDA 43, 2003). Beyond
//! df + lambda = 1e12, Sankaran's power transformation to the normal (Biometrika 50, 1963) is exact to 1e-9.

use super::error::{Error, inner_probability, require};
use super::root::find_root_increasing;
use super::saddle::ln_poisson;
use super::{chi_square, gamma, normal};

/// Above this df + lambda the distribution is normal enough.
const LARGE: f64 = 1e12;

/// (P(X > x), P(X <= x)).
fn tails(x: f64, df: f64, lambda: f64) -> (f64, f64) {
    if x <= 0.0 {
        return (1.0, 0.0);
    }
    if x == f64::INFINITY {
        return (0.0, 1.0);
    }
    let mean = df + lambda;
    if mean > LARGE {
        let z = sankaran(x, df, lambda);
        return (normal::sf(z), normal::sf(-z));
    }
    let (half, y) = (0.5 * lambda, 0.5 * x);
    let mode = half.floor();
    let peak = ln_poisson(mode, half).exp();
    let shape = 0.5 * df + mode;
    let tail = gamma::tail(shape, y);
    let (mut upper, mut lower) = (peak * tail.upper(), peak * tail.lower());
    // Upward: Q grows by the kernel at each step.
    let (mut weight, mut q, mut p) = (peak, tail.upper(), tail.lower());
    let (mut j, mut kernel) = (mode, ln_poisson(shape, y).exp());
    while weight > 1e-18 * peak {
        q = (q + kernel).min(1.0);
        p = (p - kernel).max(0.0);
        j += 1.0;
        kernel *= y / (0.5 * df + j);
        weight *= half / j;
        upper += weight * q;
        lower += weight * p;
    }
    // Downward: it shrinks by the kernel of the step below.
    (weight, q, p) = (peak, tail.upper(), tail.lower());
    (j, kernel) = (mode, ln_poisson(shape, y).exp());
    while j > 0.0 && weight > 1e-18 * peak {
        kernel *= (0.5 * df + j) / y;
        q = (q - kernel).max(0.0);
        p = (p + kernel).min(1.0);
        weight *= j / half;
        j -= 1.0;
        upper += weight * q;
        lower += weight * p;
    }
    (upper.min(1.0), lower.min(1.0))
}

/// The standard normal deviate that `x` corresponds to.
fn sankaran(x: f64, df: f64, lambda: f64) -> f64 {
    let mean = df + lambda;
    let second = df + 2.0 * lambda;
    let h = 1.0 - 2.0 / 3.0 * (mean / second) * ((df + 3.0 * lambda) / second);
    let p = second / mean / mean;
    let m = (h - 1.0) * (1.0 - 3.0 * h);
    let power = (h * ((x - mean) / mean).ln_1p()).exp_m1();
    (power - h * p * (h - 1.0 - 0.5 * (2.0 - h) * m * p)) / (h * (2.0 * p).sqrt() * (1.0 + 0.5 * m * p))
}

fn checked_tails(x: f64, df: f64, lambda: f64) -> Result<(f64, f64), Error> {
    require(!x.is_nan(), "x", x, "a number")?;
    require(df > 0.0 && df.is_finite(), "df", df, "positive and finite")?;
    require(lambda >= 0.0 && lambda.is_finite(), "lambda", lambda, "non-negative and finite")?;
    Ok(tails(x, df, lambda))
}

/// P(X > x) for the noncentral chi-square distribution with `df` degrees of freedom and noncentrality `lambda`: the power
/// of a chi-square test with critical value `x`.
///
/// Absolute error below 1e-11 for df and lambda up to 1e6, below 1e-8 beyond; time grows as sqrt(lambda) up to 1e12.
///
/// # Errors
/// `x` NaN, `df` not positive and finite, `lambda` negative, infinite or NaN.
///
/// ```
/// use warpcheck::statistics::chi_square;
/// let power = chi_square::noncentral_sf(chi_square::isf(0.05, 9.0)?, 9.0, 20.0)?;
/// assert!(power > 0.85 && power < 0.95);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn noncentral_sf(x: f64, df: f64, lambda: f64) -> Result<f64, Error> {
    Ok(checked_tails(x, df, lambda)?.0)
}

/// P(X <= x): the probability that the test misses the fault. Accuracy and errors as for [`noncentral_sf`].
pub fn noncentral_cdf(x: f64, df: f64, lambda: f64) -> Result<f64, Error> {
    Ok(checked_tails(x, df, lambda)?.1)
}

/// The noncentrality at which a chi-square test at level `alpha` with `df` degrees of freedom rejects with probability
/// `power`; 0 if the level alone is enough. Relative error about 1e-9.
///
/// # Errors
/// `alpha` or `power` outside (0, 1), `df` not positive and finite.
///
/// ```
/// // One degree of freedom: (z_0.025 + z_0.1)^2, nearly.
/// let lambda = warpcheck::statistics::chi_square::noncentrality_for_power(0.05, 1.0, 0.9)?;
/// assert!((lambda - 10.507).abs() < 1e-3);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn noncentrality_for_power(alpha: f64, df: f64, power: f64) -> Result<f64, Error> {
    inner_probability("alpha", alpha)?;
    inner_probability("power", power)?;
    let critical = chi_square::isf(alpha, df)?;
    if power <= alpha {
        return Ok(0.0);
    }
    // Normal scores, not probabilities: they are close to linear in the noncentrality.
    let target = normal::isf(power)?;
    let score = |lambda: f64| {
        let (upper, lower) = tails(critical, df, lambda);
        let z = if upper < 0.5 { normal::isf(upper) } else { normal::isf(lower).map(|z| -z) };
        target - z.unwrap_or(f64::NAN).clamp(-1e3, 1e3)
    };
    let step = (2.0 * df).sqrt() + 1.0;
    Ok(find_root_increasing(0.0, step, 0.0, score))
}

/// The relative error of the density over a share `mass` of the probability, balanced by the rest, that gives a
/// noncentrality of `lambda` with `samples` samples: with p = (1 + r) q there,
/// lambda = N r^2 mass / (1 - mass), so r = sqrt(lambda (1 - mass) / (N mass)).
///
/// # Errors
/// `lambda` negative or not finite, `samples` zero, `mass` outside (0, 1).
///
/// ```
/// use warpcheck::statistics::chi_square;
/// // A million samples in 100 cells at level 1e-4: what is caught 99 times of 100 over a tenth of the mass?
/// let lambda = chi_square::noncentrality_for_power(1e-4, 99.0, 0.99)?;
/// let error = chi_square::detectable_relative_error(lambda, 1_000_000, 0.1)?;
/// assert!(error > 0.03 && error < 0.04);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn detectable_relative_error(lambda: f64, samples: u64, mass: f64) -> Result<f64, Error> {
    require(lambda >= 0.0 && lambda.is_finite(), "lambda", lambda, "non-negative and finite")?;
    require(samples > 0, "samples", 0.0, "at least 1")?;
    inner_probability("mass", mass)?;
    Ok((lambda * (1.0 - mass) / (samples as f64 * mass)).sqrt())
}
