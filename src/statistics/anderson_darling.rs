//! Anderson-Darling: a distance between samples and a distribution that weighs the tails as heavily as the middle.
//!
//! For sorted uniforms, A^2 = -n - (1/n) sum_i (2i - 1) [ln u_i + ln(1 - u_(n+1-i))] (Anderson and Darling, "A test of
//! goodness of fit", JASA 49, 1954, eq. 2).
//!
//! As n grows, A^2 becomes a sum of chi-square variables with weights 1/(j (j + 1)), whose upper tail is Smirnov's
//! alternating series of integrals between the weights' reciprocals (Durbin, "Distribution Theory for Tests Based on the
//! Sample Distribution Function", 1973, 4.4); with s = 2 sqrt(u + 1/4) running over 4k + v, |v| < 1,
//! P(A^2 > z) = sum_k (-1)^(k+1) / (2 sqrt pi) * integral of exp(-u z/2) s / sqrt(u cos(pi v/2)) dv, k = 1, 2, ...
//! The correction for finite n is that of Marsaglia and Marsaglia ("Evaluating the Anderson-Darling distribution",
//! J. Stat. Softw. 9(2), 2004).
//!
//! Grouped data: A^2 = n integral of h^2 / (F (1 - F)) dF with h = F_n - F (Anderson and Darling, eq. 1), where F_n, known
//! at the borders of the groups only, is drawn linear in F between them. h is then a mean over the values' places in their
//! groups, which can only lower the integral of its square: the limiting tail overstates p.
//!
//! If F may be off by up to e everywhere, |h| is lowered by e, F and 1 - F are raised by e, and 2 e is taken off the mass
//! dF of each group: no true F within the error gives a smaller integral. Nor is there one left at the ends, where
//! all the mass may be an error, that could be infinite.

use super::CompensatedSum;
use super::error::{Error, require};
use super::grouped::Borders;
use super::kolmogorov::check_sorted;
use super::saddle::{GAUSS, deviance};
use std::f64::consts::PI;

/// The statistic with its p-value.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Figure {
    /// A^2; infinite if a value is exactly 0 or 1.
    pub statistic: f64,
    /// Probability of a statistic at least this large if the values are uniform.
    pub p: f64,
}

/// The test of sorted values that should be uniform in [0, 1].
///
/// # Errors
/// No values; a value outside [0, 1], NaN, or smaller than the one before it.
///
/// ```
/// use warpcheck::statistics::anderson_darling;
/// let figure = anderson_darling::one_sample(&[0.25, 0.5, 0.75])?;
/// assert!(figure.statistic < 0.3 && figure.p > 0.9);
/// assert_eq!(anderson_darling::one_sample(&[0.0, 0.5])?.p, 0.0);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn one_sample(uniforms: &[f64]) -> Result<Figure, Error> {
    check_sorted("uniforms", uniforms, true)?;
    let n = uniforms.len() as f64;
    let pairs = uniforms.iter().zip(uniforms.iter().rev()).enumerate();
    let sum: CompensatedSum =
        pairs.map(|(i, (low, high))| (2.0 * i as f64 + 1.0) / n * (low.ln() + (-high).ln_1p())).collect();
    let statistic = -n - sum.value();
    Ok(Figure { statistic, p: sf(statistic, uniforms.len() as u64)? })
}

/// The statistic of grouped data, with its p-values.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Grouped {
    /// A^2; infinite if the first or last group has mass 0, but not count 0.
    pub statistic: f64,
    /// At least the probability of a statistic as large, if the masses are right.
    pub p: f64,
    /// The same, if each cumulative mass is right within its error.
    pub p_conservative: f64,
}

/// The test of values of which only the group is known: `counts` of the groups, in the order in which the distribution
/// functions run through them, against their `masses`.
///
/// Both p-values are of the limiting distribution, good from some ten values on, and conservative: slightly for
/// hundreds of groups, much for a handful. `error` bounds the absolute error of each sum of masses from the first on.
/// It costs `p_conservative` about 2 `error` times the number of groups, as a share of the statistic.
///
/// # Errors
/// Different lengths; no values; a mass that is negative, NaN or infinite; masses that don't add up to 1 within `error`
/// and 1e-12; a negative or NaN `error`.
///
/// ```
/// use warpcheck::statistics::anderson_darling;
/// // Two halves: h = 0.1 at F = 1/2, and A^2 = n h^2 (8 ln 2 - 4).
/// let figure = anderson_darling::grouped(&[60, 40], &[0.5, 0.5], 1e-6)?;
/// assert!((figure.statistic - (8.0 * f64::ln(2.0) - 4.0)).abs() < 1e-13);
/// assert!(figure.p_conservative > figure.p && figure.p_conservative < figure.p + 1e-3);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn grouped(counts: &[u64], masses: &[f64], error: f64) -> Result<Grouped, Error> {
    let groups = Borders::new(counts, masses, error)?;
    let statistic = groups.n as f64 * distance(&groups, 0.0);
    let conservative = groups.n as f64 * distance(&groups, groups.error);
    Ok(Grouped { statistic, p: limit_sf(statistic), p_conservative: limit_sf(conservative) })
}

/// Integral of h^2 / (F (1 - F)) dF, or the least it can be if F is off by up to `error`.
fn distance(groups: &Borders, error: f64) -> f64 {
    let mut sum = CompensatedSum::new();
    for pair in groups.borders.windows(2) {
        let (first, last) = (pair[0], pair[1]);
        // Read off the end where the difference is sharper.
        let mass = if last.below < 0.5 { last.below - first.below } else { first.above - last.above };
        if !(mass > 2.0 * error) {
            continue;
        }
        let (below, above) = (first.below + error, last.above + error);
        for sign in [1.0, -1.0] {
            let (a, b) = (sign * first.excess - error, sign * last.excess - error);
            if a.max(b) <= 0.0 {
                continue;
            }
            // The part of the group where sign h > error, as shares of its mass.
            let from = if a < 0.0 { a / (a - b) } else { 0.0 };
            let to = if b < 0.0 { a / (a - b) } else { 1.0 };
            let part = Part {
                below: below + from * mass,
                mass: (to - from) * mass,
                above: above + (1.0 - to) * mass,
                first: a.max(0.0),
                last: b.max(0.0),
            };
            sum.add(part.integral() * (1.0 - 2.0 * error / mass));
        }
    }
    sum.value()
}

/// A stretch of F over which h runs linearly from `first` to `last`.
#[derive(Debug, Clone, Copy)]
struct Part {
    below: f64,
    mass: f64,
    above: f64,
    first: f64,
    last: f64,
}

impl Part {
    /// Integral of h^2 / (x y), x running up from `below` and y down to `above`.
    fn integral(self) -> f64 {
        let Self { below, mass, above, first, last } = self;
        if (below == 0.0 && first > 0.0) || (above == 0.0 && last > 0.0) {
            return f64::INFINITY;
        }
        if below == 0.0 || above == 0.0 {
            // Only without an error, so that x + y = 1 and h = b x: b^2 integral of x / (1 - x), and its mirror image.
            let largest = first.max(last);
            // (-ln(1 - m) - m) / m^2 = 1/2 + m/3 + ...; a mass below 1e-162 has no square.
            // What is left of 1 is behind the other end, to more digits than 1 - m.
            let rest = below.max(above);
            let rise = if mass < 1e-16 { 0.5 } else { deviance(1.0, rest, mass) / (mass * mass) };
            return largest * largest * rise;
        }
        // The rule has its full accuracy as long as neither x nor y changes by more than a factor 4.
        if below + mass > 4.0 * below || above + mass > 4.0 * above {
            let steepest = 3.0 * below.min(above);
            let (left, right) =
                if below < above { (steepest, mass - steepest) } else { (mass - steepest, steepest) };
            let middle = (right * first + left * last) / mass;
            let low = Self { mass: left, above: above + right, last: middle, ..self };
            let high = Self { mass: right, below: below + left, first: middle, ..self };
            return low.integral() + high.integral();
        }
        let at = |t: f64| {
            let h = first + t * (last - first);
            let (x, y) = (below + t * mass, above + (1.0 - t) * mass);
            // mass is at most three times the smaller: their quotient is safe where 1 / (x y) overflows.
            h * (h / x.max(y)) * (mass / x.min(y))
        };
        0.5 * GAUSS.iter().map(|(x, w)| w * (at(0.5 - 0.5 * x) + at(0.5 + 0.5 * x))).sum::<f64>()
    }
}

/// P(A^2 >= z) in the limit of many samples. Relative error below 1e-12, down to the smallest `f64`; NaN for NaN.
///
/// ```
/// let p = warpcheck::statistics::anderson_darling::limit_sf(2.492366735155);
/// assert!((p - 0.05).abs() < 1e-6);
/// ```
pub fn limit_sf(z: f64) -> f64 {
    const NODES: usize = 128;
    if z.is_nan() {
        return f64::NAN;
    }
    if z < 0.02 {
        return 1.0; // to within 1e-25
    }
    let mut total = 0.0;
    for k in 1.. {
        // Gauss-Chebyshev: the integrand is a smooth function divided by sqrt(1 - v^2).
        let integral: f64 = (0..NODES)
            .map(|i| {
                let theta = PI * (i as f64 + 0.5) / NODES as f64;
                let v = theta.cos();
                let s = 4.0 * f64::from(k) + v;
                let u = 0.25 * (s * s - 1.0);
                let to_end = if v < 0.0 { (0.5 * theta).cos() } else { (0.5 * theta).sin() }.powi(2) * 2.0;
                (-0.5 * u * z).exp() * s * theta.sin() / (u * (0.5 * PI * to_end).sin()).sqrt()
            })
            .sum();
        let term = 0.5 / PI.sqrt() * (PI / NODES as f64) * integral;
        total += if k % 2 == 1 { term } else { -term };
        if term <= 1e-17 * total {
            break;
        }
    }
    total.clamp(0.0, 1.0)
}

/// P(A^2 >= z) for `n` samples.
///
/// Exact for n = 1; absolute error below 1.5e-2 for n = 2 and 3, 6e-4 for n from 4, 2e-4 for n from 16 (against
/// simulations of a million samples and more), and falling as 1/n. Below p = 1e-3, where the correction for finite n was
/// not fitted, its relative size at 1e-3 is kept: for n below 100 or so a small p is then right to some ten percent only.
///
/// # Errors
/// `z` NaN, or `n` zero.
///
/// ```
/// let p = warpcheck::statistics::anderson_darling::sf(2.5, 10)?;
/// assert!((p - 0.05).abs() < 2e-3);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn sf(z: f64, n: u64) -> Result<f64, Error> {
    require(!z.is_nan(), "z", z, "a number")?;
    require(n > 0, "n", 0.0, "at least 1")?;
    if n == 1 {
        // A^2 = -1 - ln(u (1 - u)) > z outside the roots of u (1 - u) = e^(-1 - z).
        let product = 4.0 * (-1.0 - z).exp();
        return Ok(if product >= 1.0 { 1.0 } else { product / (1.0 + (1.0 - product).sqrt()) });
    }
    const FITTED: f64 = 1e-3;
    let p = limit_sf(z);
    let correction = error_fix(1.0 - p.max(FITTED), n as f64) * (p / FITTED).min(1.0);
    Ok((p - correction).clamp(0.0, 1.0))
}

/// What must be added to the limiting distribution function `x` at sample size n: `errfix` of Marsaglia and Marsaglia.
fn error_fix(x: f64, n: f64) -> f64 {
    if x > 0.8 {
        return (-130.2137
            + (745.2337 - (1705.091 - (1950.646 - (1116.360 - 255.7844 * x) * x) * x) * x) * x)
            / n;
    }
    let c = 0.01265 + 0.1757 / n;
    if x < c {
        let t = x / c;
        let t = t.sqrt() * (1.0 - t) * (49.0 * t - 102.0);
        return t * (0.0037 / (n * n) + 0.00078 / n + 0.00006) / n;
    }
    let t = (x - c) / (0.8 - c);
    let t = -0.00022633 + (6.54034 - (14.6538 - (14.458 - (8.259 - 1.91864 * t) * t) * t) * t) * t;
    t * (0.04213 + 0.01365 / n) / n
}
