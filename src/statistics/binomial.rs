//! Exact binomial tails, test and interval, for counts up to 2^53.
//!
//! P(X >= k) = I_p(k, n - k + 1), the incomplete beta function (DLMF 8.17.5), which `beta.rs` computes by as many terms
//! as it takes; the probability of a single count is Loader's saddle-point form (`saddle.rs`).

use super::beta;
use super::error::{Error, inner_probability, probability};
use super::gamma::Tail;
use super::root::find_root_increasing;
use super::saddle::ln_binomial;

/// An interval of the real line, ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

impl Interval {
    /// Whether `x` lies inside, ends included.
    pub fn contains(&self, x: f64) -> bool {
        self.lower <= x && x <= self.upper
    }
}

/// The tail of X at and above k: its "lower" is P(X >= k), its "upper" P(X < k). `q` = 1 - `p`.
fn tail_from(k: u64, n: u64, p: f64, q: f64) -> Tail {
    if k == 0 {
        Tail::Upper(f64::NEG_INFINITY)
    } else if k > n {
        Tail::Lower(f64::NEG_INFINITY)
    } else {
        beta::tail(k as f64, (n - k) as f64 + 1.0, p, q)
    }
}

/// P(X = k) for `n` trials of probability `p`; 0 for k > n. Relative error about 1e-13.
///
/// # Errors
/// `p` outside [0, 1], or NaN.
///
/// ```
/// let p = warpcheck::statistics::binomial::pmf(2, 4, 0.5)?;
/// assert!((p - 0.375).abs() < 1e-15);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn pmf(k: u64, n: u64, p: f64) -> Result<f64, Error> {
    probability("p", p)?;
    Ok(if k > n {
        0.0
    } else if p == 0.0 || p == 1.0 {
        f64::from((p == 0.0 && k == 0) || (p == 1.0 && k == n))
    } else {
        ln_binomial(k as f64, (n - k) as f64, p, 1.0 - p).exp()
    })
}

/// P(X >= k) for `n` trials of probability `p`. Relative error below 1e-10 for n up to 1e10, near the mean as in the tail.
///
/// # Errors
/// `p` outside [0, 1], or NaN.
///
/// ```
/// let p = warpcheck::statistics::binomial::upper_tail(9, 10, 0.5)?;
/// assert!((p - 11.0 / 1024.0).abs() < 1e-15);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn upper_tail(k: u64, n: u64, p: f64) -> Result<f64, Error> {
    probability("p", p)?;
    Ok(tail_from(k, n, p, 1.0 - p).lower())
}

/// P(X <= k); accuracy and errors as for [`upper_tail`].
///
/// ```
/// let p = warpcheck::statistics::binomial::lower_tail(1, 10, 0.5)?;
/// assert!((p - 11.0 / 1024.0).abs() < 1e-15);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn lower_tail(k: u64, n: u64, p: f64) -> Result<f64, Error> {
    probability("p", p)?;
    Ok(tail_from(k.saturating_add(1), n, p, 1.0 - p).upper())
}

/// ln P(X >= k), which does not underflow; errors as for [`upper_tail`].
pub fn ln_upper_tail(k: u64, n: u64, p: f64) -> Result<f64, Error> {
    probability("p", p)?;
    Ok(tail_from(k, n, p, 1.0 - p).ln_lower())
}

/// ln P(X <= k), which does not underflow; errors as for [`upper_tail`].
pub fn ln_lower_tail(k: u64, n: u64, p: f64) -> Result<f64, Error> {
    probability("p", p)?;
    Ok(tail_from(k.saturating_add(1), n, p, 1.0 - p).ln_upper())
}

/// Two-sided exact p-value of `k` hits in `n` trials of probability `p`: twice the smaller tail, at most 1.
///
/// Of the conventions in use this is the one whose acceptance region is the [`clopper_pearson`] interval; it never
/// rejects more often than its level on either side (Cox and Hinkley, "Theoretical Statistics", 1974, 3.4).
///
/// # Errors
/// `p` outside [0, 1], or `k` above `n`.
///
/// ```
/// let p = warpcheck::statistics::binomial::two_sided(9, 10, 0.5)?;
/// assert!((p - 22.0 / 1024.0).abs() < 1e-15);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn two_sided(k: u64, n: u64, p: f64) -> Result<f64, Error> {
    check_count(k, n)?;
    Ok((2.0 * upper_tail(k, n, p)?.min(lower_tail(k, n, p)?)).min(1.0))
}

fn check_count(k: u64, n: u64) -> Result<(), Error> {
    if k > n {
        return Err(Error::Argument { name: "k", value: k as f64, required: "at most n" });
    }
    Ok(())
}

/// The Clopper-Pearson interval: every p that [`two_sided`] would not reject at level 1 - `confidence`, given `k` hits in
/// `n` trials (Clopper and Pearson, Biometrika 26, 1934). Ends have a relative error about 1e-10.
///
/// # Errors
/// `confidence` outside (0, 1), or `k` above `n`.
///
/// ```
/// let interval = warpcheck::statistics::binomial::clopper_pearson(0, 10, 0.95)?;
/// assert_eq!(interval.lower, 0.0);
/// assert!((interval.upper - (1.0 - 0.025_f64.powf(0.1))).abs() < 1e-12);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn clopper_pearson(k: u64, n: u64, confidence: f64) -> Result<Interval, Error> {
    inner_probability("confidence", confidence)?;
    check_count(k, n)?;
    let target = (0.5 * (1.0 - confidence)).ln();
    let (hits, misses) = (k as f64, (n - k) as f64);
    // In log-odds, so that ends close to 0 or 1 are found to the same relative accuracy.
    let start = ((hits + 0.5) / (misses + 0.5)).ln();
    let step = (1.0 / (hits + 0.5) + 1.0 / (misses + 0.5)).sqrt();
    let odds = |u: f64| (1.0 / (1.0 + (-u).exp()), 1.0 / (1.0 + u.exp()));
    let solve = |f: &dyn Fn(f64, f64) -> f64| {
        odds(find_root_increasing(start, step, 1e-13, |u| {
            let (p, q) = odds(u);
            f(p, q)
        }))
        .0
    };
    let lower = if k == 0 { 0.0 } else { solve(&|p, q| tail_from(k, n, p, q).ln_lower() - target) };
    let upper = if k == n { 1.0 } else { solve(&|p, q| target - tail_from(k + 1, n, p, q).ln_upper()) };
    Ok(Interval { lower, upper })
}
