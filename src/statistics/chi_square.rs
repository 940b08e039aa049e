//! Pearson's chi-square and the log-likelihood-ratio statistic of counts, and the distributions they follow.
//!
//! - Pearson: X^2 = sum (O_i - E_i)^2 / E_i
//! - likelihood ratio: G = 2 sum O_i ln(O_i / E_i)
//!
//! Both follow chi-square with (cells - 1) degrees of freedom as the expected counts grow (Cramer, "Mathematical
//! Methods of Statistics", 1946, 30.1; Wilks 1938). With x = X^2 and k degrees of freedom, P(chi^2 > x) = Q(k/2, x/2),
//! the incomplete gamma function (Abramowitz and Stegun 26.4.19). Under an alternative with cell masses p_i instead of
//! q_i, X^2 of N samples follows the noncentral distribution with lambda = N sum (p_i - q_i)^2 / q_i (A&S 26.4.25;
//! Cohen 1988, ch. 7).
//!
//! - homogeneity of counts a_i and b_i with totals A and B: X^2 = sum (sqrt(B/A) a_i - sqrt(A/B) b_i)^2 / (a_i + b_i), which
//!   is Pearson's statistic of the two-row table against its margins (Cramer 1946, 30.6), again with (cells - 1) degrees
//!   of freedom;
//! - Williams' correction ("Improved likelihood ratio tests for complete contingency tables", Biometrika 63, 1976): G / q has
//!   the mean of chi-square to order 1/N, with q = 1 + (sum 1/q_i - 1) / (6 N (cells - 1)) for given masses q_i, and
//!   q = 1 + (N/A + N/B - 1) (N sum 1/(a_i + b_i) - 1) / (6 N (cells - 1)) for two rows, N = A + B.

use super::error::{Error, probability, require};
use super::root::find_root_increasing;
use super::saddle::deviance;
use super::{CompensatedSum, gamma};

pub use super::noncentral_chi_square::{
    detectable_relative_error, noncentral_cdf, noncentral_sf, noncentrality_for_power,
};

/// A statistic with the distribution it was referred to.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Figure {
    /// The statistic.
    pub statistic: f64,
    /// Degrees of freedom: cells with a positive expected count, less one.
    pub df: f64,
    /// Probability of a statistic at least this large if the expected counts are right.
    pub p: f64,
    /// Natural logarithm of `p`, which does not underflow.
    pub ln_p: f64,
}

impl Figure {
    fn new(statistic: f64, df: f64) -> Result<Self, Error> {
        Ok(Self { statistic, df, p: sf(statistic, df)?, ln_p: ln_sf(statistic, df)? })
    }
}

/// Pearson's statistic of `observed` against `expected` counts.
///
/// Cells where both are 0 don't count as cells; a cell with a hit where none can be makes the statistic infinite and p
/// zero. Nothing is pooled: cells should have expected counts of 5 or so before the p-value is believed.
///
/// # Errors
/// Different lengths, no cell at all, an expected count that is negative, NaN or infinite, or totals that differ by more
/// than sqrt(N)/10 (which could add 0.01 to the statistic): then some outcome is missing from the cells.
///
/// ```
/// use warpcheck::statistics::chi_square;
/// let figure = chi_square::statistic(&[44, 56], &[50.0, 50.0])?;
/// assert_eq!((figure.statistic, figure.df), (1.44, 1.0));
/// assert!((figure.p - 0.230139340443).abs() < 1e-11);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn statistic(observed: &[u64], expected: &[f64]) -> Result<Figure, Error> {
    accumulate(observed, expected, |o, e| (o - e) * ((o - e) / e))
}

/// The log-likelihood-ratio statistic G of `observed` against `expected` counts: arguments, conventions and errors as in
/// [`statistic`]. Each cell adds 2 [O ln(O/E) + E - O], which is never negative, so that nothing cancels.
///
/// ```
/// use warpcheck::statistics::chi_square;
/// let figure = chi_square::g_statistic(&[44, 56], &[50.0, 50.0])?;
/// assert!((figure.statistic - 1.4434760615).abs() < 1e-9);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn g_statistic(observed: &[u64], expected: &[f64]) -> Result<Figure, Error> {
    accumulate(observed, expected, |o, e| 2.0 * deviance(o, e, o - e))
}

/// [`g_statistic`] with Williams' correction, which brings p closer to its nominal level where expected counts are
/// small: arguments, conventions and errors are the same.
///
/// ```
/// use warpcheck::statistics::chi_square;
/// let figure = chi_square::williams_g_statistic(&[44, 56], &[50.0, 50.0])?;
/// // q = 1 + (2 + 2 - 1) / (6 * 100)
/// assert!((figure.statistic - 1.4434760615 / 1.005).abs() < 1e-9);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn williams_g_statistic(observed: &[u64], expected: &[f64]) -> Result<Figure, Error> {
    let g = g_statistic(observed, expected)?;
    let n = expected.iter().copied().collect::<CompensatedSum>().value();
    let inverses = expected.iter().filter(|e| **e > 0.0).map(|e| n / e).collect::<CompensatedSum>().value();
    williams(g, (inverses - 1.0) / n)
}

/// G divided by 1 + excess / (6 df).
fn williams(g: Figure, excess: f64) -> Result<Figure, Error> {
    if g.df == 0.0 {
        return Ok(g);
    }
    Figure::new(g.statistic / (1.0 + excess / (6.0 * g.df)), g.df)
}

/// Pearson's test of homogeneity: are `first` and `second`, of any totals, counts of the same distribution?
///
/// Cells where both are 0 are left out. Nothing is pooled: cells should share 10 counts or so before the p-value is
/// believed.
///
/// # Errors
/// Different lengths, or a total of 0.
///
/// ```
/// use warpcheck::statistics::chi_square;
/// let figure = chi_square::two_sample(&[10, 20, 0], &[40, 30, 0])?;
/// assert!((figure.statistic - 100.0 / 21.0).abs() < 1e-14 && figure.df == 1.0);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn two_sample(first: &[u64], second: &[u64]) -> Result<Figure, Error> {
    let pair = Pair::new(first, second)?;
    let (n, m) = (pair.first, pair.second);
    let cells = pair.cells.iter().map(|&(a, b)| {
        // a - E, with E = A (a + b)/(A + B) the expected count.
        let difference = pair.difference(a, b);
        difference * (difference / (a + b)) * ((n + m) / n) * ((n + m) / m)
    });
    Figure::new(cells.collect::<CompensatedSum>().value(), pair.df())
}

/// The likelihood-ratio test of homogeneity with Williams' correction: arguments, conventions and errors as in
/// [`two_sample`], of which it is a check where cells are thin.
///
/// ```
/// use warpcheck::statistics::chi_square;
/// let figure = chi_square::two_sample_g(&[10, 20], &[40, 30])?;
/// assert!((figure.statistic - 4.742251857).abs() < 1e-8);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn two_sample_g(first: &[u64], second: &[u64]) -> Result<Figure, Error> {
    let pair = Pair::new(first, second)?;
    let n = pair.first + pair.second;
    let cells = pair.cells.iter().map(|&(a, b)| {
        let difference = pair.difference(a, b);
        let (e, f) = (pair.first * ((a + b) / n), pair.second * ((a + b) / n));
        2.0 * (deviance(a, e, difference) + deviance(b, f, -difference))
    });
    let g = Figure::new(cells.collect::<CompensatedSum>().value(), pair.df())?;
    let columns = pair.cells.iter().map(|&(a, b)| n / (a + b)).collect::<CompensatedSum>().value() - 1.0;
    williams(g, (n / pair.first + n / pair.second - 1.0) * columns / n)
}

/// Two count vectors side by side, without the cells that are empty in both.
struct Pair {
    cells: Vec<(f64, f64)>,
    first: f64,
    second: f64,
}

impl Pair {
    fn new(first: &[u64], second: &[u64]) -> Result<Self, Error> {
        if first.len() != second.len() {
            let (left_len, right_len) = (first.len(), second.len());
            return Err(Error::Length { left: "first", left_len, right: "second", right_len });
        }
        let total = |name: &'static str, counts: &[u64]| {
            let total: CompensatedSum = counts.iter().map(|&count| count as f64).collect();
            let total = total.value();
            if total > 0.0 { Ok(total) } else { Err(Error::TooFew { name, len: 0, min: 1 }) }
        };
        let cells = first.iter().zip(second).map(|(&a, &b)| (a as f64, b as f64));
        Ok(Self {
            cells: cells.filter(|&(a, b)| a + b > 0.0).collect(),
            first: total("counts in the first sample", first)?,
            second: total("counts in the second sample", second)?,
        })
    }

    fn df(&self) -> f64 {
        (self.cells.len() - 1) as f64
    }

    /// a less its expected count.
    fn difference(&self, a: f64, b: f64) -> f64 {
        (self.second * a - self.first * b) / (self.first + self.second)
    }
}

fn accumulate(observed: &[u64], expected: &[f64], cell: impl Fn(f64, f64) -> f64) -> Result<Figure, Error> {
    if observed.len() != expected.len() {
        return Err(Error::Length {
            left: "observed",
            left_len: observed.len(),
            right: "expected",
            right_len: expected.len(),
        });
    }
    let mut sum = CompensatedSum::new();
    let (mut total_observed, mut total_expected) = (CompensatedSum::new(), CompensatedSum::new());
    let mut cells = 0_u64;
    for (index, (&o, &e)) in observed.iter().zip(expected).enumerate() {
        if !(e >= 0.0 && e.is_finite()) {
            let required = "non-negative and finite";
            return Err(Error::Element { name: "expected", index, value: e, required });
        }
        let o = o as f64;
        total_observed.add(o);
        total_expected.add(e);
        if e > 0.0 {
            cells += 1;
            sum.add(cell(o, e));
        } else if o > 0.0 {
            sum.add(f64::INFINITY);
        }
    }
    if cells == 0 {
        return Err(Error::TooFew { name: "cells with an expected count", len: 0, min: 1 });
    }
    let (total_observed, total_expected) = (total_observed.value(), total_expected.value());
    if (total_observed - total_expected).abs() > 0.1 * total_observed.max(total_expected).sqrt() {
        return Err(Error::Total { observed: total_observed, expected: total_expected });
    }
    Figure::new(sum.value(), (cells - 1) as f64)
}

/// P(chi^2 >= x) with `df` degrees of freedom: the p-value of a statistic `x`.
///
/// Relative error below 1e-12 for df from 0.1 to 1e6, down to p = 1e-300. With df = 0 the distribution is a point at 0:
/// p is 1 for x <= 0, and 0 above.
///
/// # Errors
/// `x` NaN, or `df` negative, infinite or NaN.
///
/// ```
/// let p = warpcheck::statistics::chi_square::sf(3.841458820694124, 1.0)?;
/// assert!((p - 0.05).abs() < 1e-14);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn sf(x: f64, df: f64) -> Result<f64, Error> {
    figure(x, df, 1.0, 0.0, |tail| tail.upper())
}

/// P(chi^2 <= x); accuracy and errors as for [`sf`].
pub fn cdf(x: f64, df: f64) -> Result<f64, Error> {
    if x == 0.0 && df == 0.0 {
        return Ok(1.0);
    }
    figure(x, df, 0.0, 1.0, |tail| tail.lower())
}

/// ln P(chi^2 >= x), good far beyond the point where [`sf`] underflows; errors as for [`sf`].
///
/// ```
/// // Two degrees of freedom: exp(-x/2).
/// let ln_p = warpcheck::statistics::chi_square::ln_sf(1e6, 2.0)?;
/// assert!((ln_p + 5e5).abs() < 1e-6);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn ln_sf(x: f64, df: f64) -> Result<f64, Error> {
    figure(x, df, 0.0, f64::NEG_INFINITY, |tail| tail.ln_upper())
}

/// The figure at `x`, given its values at and below 0 and, for df = 0, above.
fn figure(x: f64, df: f64, below: f64, above: f64, f: impl Fn(gamma::Tail) -> f64) -> Result<f64, Error> {
    require(!x.is_nan(), "x", x, "a number")?;
    require(df >= 0.0 && df.is_finite(), "df", df, "non-negative and finite")?;
    Ok(if df == 0.0 {
        if x > 0.0 { above } else { below }
    } else if x <= 0.0 {
        below
    } else {
        f(gamma::tail(0.5 * df, 0.5 * x))
    })
}

/// The x with P(chi^2 >= x) = `p`: the critical value of a test at level p. Relative error about 1e-12.
///
/// # Errors
/// `p` outside [0, 1], or `df` not positive and finite.
///
/// ```
/// let x = warpcheck::statistics::chi_square::isf(0.05, 1.0)?;
/// assert!((x - 3.841458820694124).abs() < 1e-11);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn isf(p: f64, df: f64) -> Result<f64, Error> {
    probability("p", p)?;
    require(df > 0.0 && df.is_finite(), "df", df, "positive and finite")?;
    if p == 0.0 || p == 1.0 {
        return Ok(if p == 0.0 { f64::INFINITY } else { 0.0 });
    }
    let a = 0.5 * df;
    // In u = ln(x/2), so that a lower tail that ends at x = 1e-200 is found as easily as an upper one.
    let step = 0.5 * (2.0 / df).sqrt().min(1.0);
    let u = if p < 0.5 {
        let target = p.ln();
        find_root_increasing(a.ln(), step, 0.0, |u| target - gamma::tail(a, u.exp()).ln_upper())
    } else {
        let target = (-p).ln_1p();
        find_root_increasing(a.ln(), step, 0.0, |u| gamma::tail(a, u.exp()).ln_lower() - target)
    };
    Ok(2.0 * u.exp())
}
