//! Kolmogorov-Smirnov: the largest distance between a distribution function and the samples, or between two samples.
//!
//! One sample of size n, sorted uniforms u_i: D = max_i max(i/n - u_i, u_i - (i-1)/n). Its upper tail P(D >= d) is found
//! by region (the layout follows Simard and L'Ecuyer, "Computing the two-sided Kolmogorov-Smirnov distribution", J. Stat.
//! Softw. 39(11), 2011):
//! - n d^2 >= 4: twice the one-sided tail, P(D+ >= d) = d sum_j C(n, j) (d + j/n)^(j-1) (1 - d - j/n)^(n-j) (Smirnov 1944;
//!   Birnbaum and Tingey 1951, eq. 3.0). All terms are positive, so that the relative error stays small down to p =
//!   1e-300; counting both sides twice overstates p by a relative 3e-11 at most. Above n = 1e5 the terms are a smooth,
//!   vanishing function of j, of which every (n/8192)-th is taken;
//! - else, n <= 1000: 1 - the matrix power of Marsaglia, Tsang and Wang (J. Stat. Softw. 8(18), 2003), after Durbin 1968;
//! - else: 1 - the expansion in 1/sqrt(n) to third order of Pelz and Good (J. R. Stat. Soc. B 38, 1976).
//!
//! Two samples of sizes m and n: P(D >= d) exactly, by the share of lattice paths that leave the band |i/m - j/n| < d
//! (Hodges, "The significance probability of the Smirnov two-sample test", Ark. Mat. 3, 1958), as long as that takes under
//! 2e8 steps; else the one-sample tail of size m n/(m + n).
//!
//! Grouped data: D is the largest distance at a border between groups. It is never above the D of the values themselves,
//! so that the one-sample tail overstates p (Noether, "Note on the Kolmogorov statistic in the discrete case", Metrika 7,
//! 1963).

use super::error::{Error, require};
use super::grouped::Borders;
use super::saddle::{ln_binomial, stirling_error};
use std::f64::consts::{PI, TAU};

/// Above this size, and not in the tail, the matrix gives way to the expansion.
const MATRIX_MAX: u64 = 1000;
/// Above this size the one-sided sum is thinned out.
const SUM_MAX: u64 = 100_000;
/// How many terms are then left, about.
const SUM_TERMS: u64 = 8192;
/// Most lattice points that the exact two-sample tail may visit.
const LATTICE_MAX: f64 = 2e8;

/// A distance with its p-value.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Figure {
    /// The largest distance D between the two distribution functions.
    pub statistic: f64,
    /// Probability of a distance at least this large if the distributions agree.
    pub p: f64,
}

/// Refuses NaN, values outside [0, 1] if `unit`, and steps down.
pub(super) fn check_sorted(name: &'static str, values: &[f64], unit: bool) -> Result<(), Error> {
    if values.is_empty() {
        return Err(Error::TooFew { name, len: 0, min: 1 });
    }
    for (index, &value) in values.iter().enumerate() {
        let required = if value.is_nan() || (unit && !(0.0..=1.0).contains(&value)) {
            if unit { "in [0, 1]" } else { "a number" }
        } else if index > 0 && value < values[index - 1] {
            "sorted: no smaller than the element before"
        } else {
            continue;
        };
        return Err(Error::Element { name, index, value, required });
    }
    Ok(())
}

/// The one-sample test of sorted values that should be uniform in [0, 1].
///
/// # Errors
/// No values; a value outside [0, 1], NaN, or smaller than the one before it.
///
/// ```
/// use warpcheck::statistics::kolmogorov;
/// let figure = kolmogorov::one_sample(&[0.1, 0.2, 0.3])?;
/// assert!((figure.statistic - 0.7).abs() < 1e-15 && figure.p > 0.05 && figure.p < 0.06);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn one_sample(uniforms: &[f64]) -> Result<Figure, Error> {
    check_sorted("uniforms", uniforms, true)?;
    let n = uniforms.len() as f64;
    let distance = |(i, &u): (usize, &f64)| f64::max((i as f64 + 1.0) / n - u, u - i as f64 / n);
    let statistic = uniforms.iter().enumerate().map(distance).fold(0.0, f64::max);
    Ok(Figure { statistic, p: sf(statistic, uniforms.len() as u64)? })
}

/// A distance of grouped data, with its p-values.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Grouped {
    /// The largest distance D between the two distribution functions at a border of two groups.
    pub statistic: f64,
    /// At least the probability of a distance as large, if the masses are right.
    pub p: f64,
    /// The same, if each cumulative mass is right within its error.
    pub p_conservative: f64,
}

/// The one-sample test of values of which only the group is known: `counts` of the groups, in the order in which the
/// distribution functions run through them, against their `masses`.
///
/// Both p-values are conservative: slightly where no group holds more than a few percent, much for a handful of groups.
/// `error` bounds the absolute error of each sum of masses from the first on; it is taken off the statistic for
/// `p_conservative`. A count in a group of mass 0 shifts the distribution functions and no more.
///
/// # Errors
/// Different lengths; no values; a mass that is negative, NaN or infinite; masses that don't add up to 1 within `error`
/// and 1e-12; a negative or NaN `error`.
///
/// ```
/// use warpcheck::statistics::kolmogorov;
/// let figure = kolmogorov::grouped(&[30, 20, 50], &[0.25, 0.25, 0.5], 0.01)?;
/// assert!((figure.statistic - 0.05).abs() < 1e-15);
/// assert!(figure.p > 0.9 && figure.p_conservative > figure.p);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn grouped(counts: &[u64], masses: &[f64], error: f64) -> Result<Grouped, Error> {
    let groups = Borders::new(counts, masses, error)?;
    let statistic = groups.borders.iter().fold(0.0_f64, |largest, border| largest.max(border.excess.abs()));
    let p_conservative = sf((statistic - groups.error).max(0.0), groups.n)?;
    Ok(Grouped { statistic, p: sf(statistic, groups.n)?, p_conservative })
}

/// P(D >= d) for the one-sample statistic of `n` values.
///
/// Relative error below 1e-10 for n <= 1000, and for any n where n d^2 >= 4 (p below 7e-4); below 2e-6 elsewhere.
///
/// # Errors
/// `d` NaN, or `n` zero.
///
/// ```
/// // n = 1: the distance is at least 1/2, and uniform above.
/// let p = warpcheck::statistics::kolmogorov::sf(0.75, 1)?;
/// assert!((p - 0.5).abs() < 1e-14);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn sf(d: f64, n: u64) -> Result<f64, Error> {
    require(!d.is_nan(), "d", d, "a number")?;
    require(n > 0, "n", 0.0, "at least 1")?;
    let size = n as f64;
    Ok(if d * size <= 0.5 {
        1.0
    } else if d >= 1.0 {
        0.0
    } else if size * d * d >= 4.0 {
        2.0 * one_sided_tail(d, n)
    } else if n == 1 {
        2.0 * (1.0 - d)
    } else if n <= MATRIX_MAX {
        1.0 - matrix_cdf(d, n)
    } else {
        1.0 - expansion_cdf(d, size)
    }
    .clamp(0.0, 1.0))
}

/// P(D+ >= d), 0 < d < 1.
fn one_sided_tail(d: f64, n: u64) -> f64 {
    let size = n as f64;
    let last = (size * (1.0 - d)).floor();
    let stride = if n > SUM_MAX { (n / SUM_TERMS) as f64 } else { 1.0 };
    let (mut sum, mut j) = (0.0, 0.0);
    while j <= last {
        let x = d + j / size;
        sum += ln_binomial(j, size - j, x, (1.0 - x).max(0.0)).exp() / x;
        j += stride;
    }
    d * stride * sum
}

/// P(D < d) = n!/n^n (H^n)_kk, with H a matrix of 2k - 1 rows, k = floor(n d) + 1.
fn matrix_cdf(d: f64, n: u64) -> f64 {
    let size = n as f64;
    let k = (size * d) as usize + 1;
    let m = 2 * k - 1;
    let h = k as f64 - size * d;
    let mut a = vec![0.0; m * m];
    for i in 0..m {
        for j in 0..m.min(i + 2) {
            a[i * m + j] = 1.0;
        }
    }
    for i in 0..m {
        a[i * m] -= h.powi(i as i32 + 1);
        a[(m - 1) * m + i] -= h.powi((m - i) as i32);
    }
    a[(m - 1) * m] += (2.0 * h - 1.0).max(0.0).powi(m as i32);
    let mut factorial = vec![1.0; m + 1];
    for i in 1..=m {
        factorial[i] = factorial[i - 1] * i as f64;
    }
    for i in 0..m {
        for j in 0..m.min(i + 2) {
            // 1/e in each factor H takes the e^-n of Stirling's n!/n^n, and keeps the powers in range.
            a[i * m + j] /= factorial[i + 1 - j] * std::f64::consts::E;
        }
    }
    (TAU * size).sqrt() * stirling_error(size).exp() * matrix_power(a, m, n)[(k - 1) * m + k - 1]
}

fn matrix_power(mut base: Vec<f64>, m: usize, mut exponent: u64) -> Vec<f64> {
    let mut result: Option<Vec<f64>> = None;
    while exponent > 0 {
        if exponent & 1 == 1 {
            result = Some(result.map_or_else(|| base.clone(), |result| product(&result, &base, m)));
        }
        exponent >>= 1;
        if exponent > 0 {
            base = product(&base, &base, m);
        }
    }
    result.unwrap_or(base)
}

fn product(a: &[f64], b: &[f64], m: usize) -> Vec<f64> {
    let mut c = vec![0.0; m * m];
    for (row_a, row_c) in a.chunks_exact(m).zip(c.chunks_exact_mut(m)) {
        for (&x, row_b) in row_a.iter().zip(b.chunks_exact(m)) {
            row_c.iter_mut().zip(row_b).for_each(|(c, b)| *c += x * b);
        }
    }
    c
}

/// P(D < d) by K0 + K1/n^(1/2) + K2/n + K3/n^(3/2) of Pelz and Good, eqs. 4 to 7.
fn expansion_cdf(d: f64, n: f64) -> f64 {
    let z2 = n * d * d;
    let z = z2.sqrt();
    let (z4, z6, pi2) = (z2 * z2, z2 * z2 * z2, PI * PI);
    let mut k = [0.0; 4];
    let terms = (16.0 * z / PI).ceil() as usize + 2;
    for i in 0..terms {
        let w = pi2 * ((i as f64 + 0.5) * (i as f64 + 0.5));
        let e = (-w / (2.0 * z2)).exp();
        k[0] += e;
        k[1] += e * (w - z2);
        k[2] += e * (6.0 * z6 + 2.0 * z4 + (2.0 * z4 - 5.0 * z2) * w + (1.0 - 2.0 * z2) * w * w);
        k[3] += e
            * (-30.0 * z6 - 90.0 * z6 * z2
                + (135.0 * z4 - 96.0 * z6) * w
                + (212.0 * z4 - 60.0 * z2) * w * w
                + (5.0 - 30.0 * z2) * w * w * w);
    }
    let (mut second, mut third) = (0.0, 0.0);
    for i in 1..=terms {
        let w = pi2 * (i as f64 * i as f64);
        let e = (-w / (2.0 * z2)).exp();
        second += e * w;
        third += e * w * (3.0 * z2 - w);
    }
    let root = TAU.sqrt();
    let k0 = root / z * k[0];
    let k1 = root / (6.0 * z4) * k[1];
    let k2 = root / (72.0 * z6 * z) * k[2] - root / (36.0 * z2 * z) * second;
    let k3 = root / (6480.0 * z6 * z4) * k[3] + root / (216.0 * z6) * third;
    let s = n.sqrt();
    k0 + (k1 + (k2 + k3 / s) / s) / s
}

/// The two-sample test: both samples sorted, of any distribution. With ties between the samples (values drawn from a
/// discrete distribution), p is conservative.
///
/// # Errors
/// An empty sample; a value that is NaN or smaller than the one before it.
///
/// ```
/// use warpcheck::statistics::kolmogorov;
/// let figure = kolmogorov::two_sample(&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0])?;
/// assert_eq!(figure.statistic, 1.0);
/// assert!((figure.p - 0.1).abs() < 1e-15);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn two_sample(first: &[f64], second: &[f64]) -> Result<Figure, Error> {
    check_sorted("first", first, false)?;
    check_sorted("second", second, false)?;
    let (m, n) = (first.len() as i128, second.len() as i128);
    let (mut i, mut j, mut largest) = (0, 0, 0_i128);
    while i < first.len() && j < second.len() {
        let x = first[i].min(second[j]);
        while i < first.len() && first[i] <= x {
            i += 1;
        }
        while j < second.len() && second[j] <= x {
            j += 1;
        }
        largest = largest.max((i as i128 * n - j as i128 * m).abs());
    }
    let statistic = largest as f64 / (m * n) as f64;
    Ok(Figure { statistic, p: two_sample_tail(largest, m, n) })
}

/// P(D >= d) for the two-sample statistic of `m` and `n` values. Exact to 1e-11 where the lattice is walked (m = n = 1e5
/// and below); else within some percent.
///
/// # Errors
/// `d` NaN, or a size of zero.
///
/// ```
/// let p = warpcheck::statistics::kolmogorov::two_sample_sf(1.0, 3, 3)?;
/// assert!((p - 0.1).abs() < 1e-15);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn two_sample_sf(d: f64, m: u64, n: u64) -> Result<f64, Error> {
    require(!d.is_nan(), "d", d, "a number")?;
    require(m > 0, "m", 0.0, "at least 1")?;
    require(n > 0, "n", 0.0, "at least 1")?;
    if d > 1.0 {
        return Ok(0.0);
    }
    // The statistic is a multiple of 1/(m n): the next one at or above d, but for the rounding of d itself.
    let steps = d.max(0.0) * m as f64 * n as f64;
    Ok(two_sample_tail((steps * (1.0 - 1e-14)).ceil() as i128, i128::from(m), i128::from(n)))
}

/// P(|i n - j m| >= distance somewhere on a random path from (0, 0) to (m, n)).
fn two_sample_tail(distance: i128, m: i128, n: i128) -> f64 {
    if distance <= 0 {
        return 1.0;
    }
    let (m, n) = (m.min(n), m.max(n));
    let d = distance as f64 / (m as f64 * n as f64);
    // The cells of the band, and a row, which is kept.
    if m as f64 * n as f64 * (2.0 * d).min(1.0) + n as f64 > LATTICE_MAX {
        let size = m as f64 * (n as f64 / (m as f64 + n as f64));
        return sf(d, size.round() as u64).unwrap_or(f64::NAN);
    }
    // outside[j]: probability that a random path to (i, j) has left the band; 1 above it. What is below it, no later row
    // reads.
    let mut outside = vec![1.0; n as usize + 1];
    for i in 0..=m {
        let low = ((i * n - distance).div_euclid(m) + 1).max(0);
        let high = (i * n + distance - 1).div_euclid(m).min(n);
        let mut left = 1.0;
        for j in low..=high {
            let cell = &mut outside[j as usize];
            let (x, y) = (i as f64, j as f64);
            *cell = if i + j == 0 {
                0.0
            } else if j == 0 {
                *cell
            } else if i == 0 {
                left
            } else {
                (x * *cell + y * left) / (x + y)
            };
            left = *cell;
        }
    }
    outside[n as usize]
}
