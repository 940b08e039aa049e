//! Sums that keep their low bits.
//!
//! [`CompensatedSum`] carries the rounding error of every addition along: with s the running sum and c the
//! carried error, `t = s + x; c += if |s| >= |x| { (s - t) + x } else { (x - t) + s }; s = t`
//! (Neumaier, "Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen", ZAMM 54, 1974).

use std::iter::Sum;

/// A sum of `f64` with an error that does not grow with the number of terms (about 1 ulp of the result, plus
/// n u^2 times the sum of magnitudes).
///
/// ```
/// use warpcheck::statistics::CompensatedSum;
/// let sum: CompensatedSum = [1.0, 1e100, 1.0, -1e100].into_iter().collect();
/// assert_eq!(sum.value(), 2.0);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CompensatedSum {
    sum: f64,
    carry: f64,
}

impl CompensatedSum {
    /// The empty sum.
    pub const fn new() -> Self {
        Self { sum: 0.0, carry: 0.0 }
    }

    /// Adds one term.
    pub fn add(&mut self, x: f64) {
        let total = self.sum + x;
        // After an infinity there is nothing left to compensate, and inf - inf would turn it into NaN.
        if total.is_finite() {
            self.carry +=
                if self.sum.abs() >= x.abs() { (self.sum - total) + x } else { (x - total) + self.sum };
        }
        self.sum = total;
    }

    /// Adds all that `other` has summed, with its carried error.
    pub fn merge(&mut self, other: &Self) {
        self.add(other.sum);
        self.add(other.carry);
    }

    /// The sum so far.
    pub fn value(&self) -> f64 {
        self.sum + self.carry
    }
}

impl Extend<f64> for CompensatedSum {
    fn extend<I: IntoIterator<Item = f64>>(&mut self, terms: I) {
        terms.into_iter().for_each(|x| self.add(x));
    }
}

impl FromIterator<f64> for CompensatedSum {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Self {
        let mut sum = Self::new();
        sum.extend(terms);
        sum
    }
}

impl Sum<f64> for CompensatedSum {
    fn sum<I: Iterator<Item = f64>>(terms: I) -> Self {
        terms.collect()
    }
}
