//! Many tests, one error rate: adjusted p-values that can be compared with the level of the whole family.
//!
//! - Holm's step-down: with p_(1) <= ... <= p_(m), adjusted p_(i) = max over j <= i of min(1, (m - j + 1) p_(j))
//!   (Holm, "A simple sequentially rejective multiple test procedure", Scand. J. Statist. 6, 1979); holds for any dependence.
//! - Sidak: 1 - (1 - p)^m (Sidak, JASA 62, 1967); for independent tests, formed as -expm1(m log1p(-p)), which keeps the
//!   digits of p = 1e-300.

use super::error::{Error, probability};

/// Sidak's adjusted value of one p-value out of `tests`.
///
/// # Errors
/// `p` outside [0, 1], or NaN.
///
/// ```
/// let adjusted = warpcheck::statistics::multiplicity::sidak(1e-300, 1000)?;
/// assert!((adjusted / 1e-297 - 1.0).abs() < 1e-12);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn sidak(p: f64, tests: u64) -> Result<f64, Error> {
    probability("p", p)?;
    Ok(if tests == 0 { 0.0 } else { -(tests as f64 * (-p).ln_1p()).exp_m1() })
}

/// Holm's adjusted p-values, in the order of `p`.
///
/// # Errors
/// An element outside [0, 1], or NaN.
///
/// ```
/// let adjusted = warpcheck::statistics::multiplicity::holm(&[0.01, 0.04, 0.03])?;
/// assert_eq!(adjusted, [0.03, 0.06, 0.06]);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
pub fn holm(p: &[f64]) -> Result<Vec<f64>, Error> {
    if let Some((index, &value)) = p.iter().enumerate().find(|(_, p)| !(0.0..=1.0).contains(*p)) {
        return Err(Error::Element { name: "p", index, value, required: "a probability in [0, 1]" });
    }
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let mut adjusted = vec![0.0; p.len()];
    let mut largest = 0.0_f64;
    for (rank, &index) in order.iter().enumerate() {
        largest = largest.max((p[index] * (p.len() - rank) as f64).min(1.0));
        adjusted[index] = largest;
    }
    Ok(adjusted)
}

/// One member of a [`Family`], with its adjusted p-value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adjusted<'a> {
    /// Name under which the test was entered.
    pub name: &'a str,
    /// Its own p-value.
    pub p: f64,
    /// Holm's adjusted p-value: reject at the family's level if this is no larger.
    pub adjusted: f64,
}

/// A family of tests that share one level: the probability that any of them rejects though all is well.
///
/// ```
/// use warpcheck::statistics::multiplicity::Family;
/// let mut family = Family::new();
/// family.push("chi-square", 0.2)?;
/// family.push("lower tail", 1e-9)?;
/// let rejected: Vec<_> = family.adjusted().filter(|test| test.adjusted <= 1e-4).map(|test| test.name).collect();
/// assert_eq!(rejected, ["lower tail"]);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Family {
    names: Vec<String>,
    p: Vec<f64>,
}

impl Family {
    /// A family without members.
    pub fn new() -> Self {
        Self::default()
    }

    /// Enters a test by name.
    ///
    /// # Errors
    /// `p` outside [0, 1], or NaN.
    pub fn push(&mut self, name: impl Into<String>, p: f64) -> Result<(), Error> {
        self.p.push(probability("p", p)?);
        self.names.push(name.into());
        Ok(())
    }

    /// Number of tests entered.
    pub fn len(&self) -> usize {
        self.p.len()
    }

    /// Whether no test was entered.
    pub fn is_empty(&self) -> bool {
        self.p.is_empty()
    }

    /// The tests with Holm's adjusted p-values, in the order in which they were entered.
    pub fn adjusted(&self) -> impl Iterator<Item = Adjusted<'_>> {
        let adjusted = holm(&self.p).unwrap_or_default(); // checked when they were entered
        self.names.iter().zip(&self.p).zip(adjusted).map(|((name, &p), adjusted)| Adjusted {
            name,
            p,
            adjusted,
        })
    }

    /// The smallest adjusted p-value, by which the family stands or falls; 1 for an empty family.
    pub fn smallest(&self) -> f64 {
        self.adjusted().fold(1.0, |least, test| least.min(test.adjusted))
    }
}
