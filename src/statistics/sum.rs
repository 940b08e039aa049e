//! Sums that keep their low bits, and moments in one pass.
//!
//! [`CompensatedSum`] carries the rounding error of every addition along: with s the running sum and c the
//! carried error, `t = s + x; c += if |s| >= |x| { (s - t) + x } else { (x - t) + s }; s = t`
//! (Neumaier, "Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen", ZAMM 54, 1974).
//! [`Moments`] updates mean and sum of squared deviations (Welford, Technometrics 4, 1962) and merges two
//! parts by Chan, Golub and LeVeque ("Updating formulae and a pairwise algorithm", 1979, eq. 2.1).

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

/// Count, mean and variance of a stream of numbers, in one pass and mergeable.
///
/// ```
/// use warpcheck::statistics::Moments;
/// let mut left: Moments = [4.0, 7.0].into_iter().collect();
/// let right: Moments = [13.0, 16.0].into_iter().collect();
/// left.merge(&right);
/// assert_eq!((left.count(), left.mean(), left.variance()), (4, 10.0, Some(30.0)));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// No numbers yet.
    pub const fn new() -> Self {
        Self { count: 0, mean: 0.0, squares: 0.0 }
    }

    /// Adds one number.
    pub fn add(&mut self, x: f64) {
        self.count += 1;
        let delta = x - self.mean;
        self.mean += delta / self.count as f64;
        self.squares += delta * (x - self.mean);
    }

    /// Adds all numbers that `other` has seen.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        let (n, m) = (self.count as f64, other.count as f64);
        let delta = other.mean - self.mean;
        self.mean += delta * (m / (n + m));
        self.squares += other.squares + delta * delta * (n * (m / (n + m)));
        self.count += other.count;
    }

    /// How many numbers were added.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Arithmetic mean; 0 if there are no numbers.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased sample variance (divisor n - 1); `None` below two numbers.
    pub fn variance(&self) -> Option<f64> {
        (self.count > 1).then(|| self.squares / (self.count - 1) as f64)
    }

    /// Standard error of the mean, sqrt(variance / n); `None` below two numbers.
    pub fn standard_error(&self) -> Option<f64> {
        self.variance().map(|variance| (variance / self.count as f64).sqrt())
    }
}

impl Extend<f64> for Moments {
    fn extend<I: IntoIterator<Item = f64>>(&mut self, numbers: I) {
        numbers.into_iter().for_each(|x| self.add(x));
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(numbers: I) -> Self {
        let mut moments = Self::new();
        moments.extend(numbers);
        moments
    }
}
