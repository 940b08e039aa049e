//! Moments in one pass, and the test of a mean against a known value.
//!
//! With delta = x - mean, sums S_p of the p-th powers of deviations are updated value by value (Welford, Technometrics 4,
//! 1962) and part by part (Chan, Golub and LeVeque 1979, eq. 2.1; for p = 3 and 4 Pebay, "Formulas for robust, one-pass
//! parallel computation of covariances and arbitrary-order statistical moments", SAND2008-6212, eqs. 1.5, 1.6, 2.1).
//!
//! The test: z = (mean - expected) / sqrt(S_2 / (n (n - 1))), and p = 2 P(Z > |z|) exp(|g| |z|^3 / 3), where g =
//! S_3 / S_2^(3/2) is the skewness of the mean. That is the leading term of the tail of a mean in units of its estimated
//! error (Wang, "Refined self-normalized large deviations for independent random variables", J. Theor. Probab. 24, 2011; for a
//! known error, Cramer's 1938 expansion has 1/6 in place of 1/3), with the sign under which it is larger.
//!
//! Of a long-tailed distribution, a sample has not seen the values that matter for the mean, and doesn't know it. Two
//! measures: z is that of a sample with two more values as far out as the farthest, both on the side that brings
//! the mean closer; and no verdict is given where the farthest value holds more than 1/50 of S_2 or 1/10 of S_4. The share of
//! S_p doesn't vanish with n if the p-th moment is infinite (O'Brien, J. Appl. Probab. 17, 1980), so that tails
//! x^(-a) with a below 4 are out. What is rarer than 1/n leaves no trace in any sample.

use super::error::{Error, require};
use super::normal;

/// Fewest values that are trusted with a mean.
const LEAST: u64 = 1000;
/// Largest share of the sum of squared deviations, and of their squares, that one value may hold.
const SHARE: [f64; 2] = [0.02, 0.1];
/// Values as far out as the farthest that may have been missed.
const MISSED: f64 = 2.0;
/// Largest |g| |z|^3 / 3 for which its exponential is believed.
const LARGEST_TERM: f64 = 1.0;

/// Count, mean, higher moments and extremes of a stream of numbers, in one pass and mergeable.
///
/// ```
/// use warpcheck::statistics::Moments;
/// let mut left: Moments = [4.0, 7.0].into_iter().collect();
/// let right: Moments = [13.0, 16.0].into_iter().collect();
/// left.merge(&right);
/// assert_eq!((left.count(), left.mean(), left.variance()), (4, 10.0, Some(30.0)));
/// assert_eq!((left.smallest(), left.largest(), left.skewness()), (4.0, 16.0, Some(0.0)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
    cubes: f64,
    fourths: f64,
    smallest: f64,
    largest: f64,
}

impl Default for Moments {
    fn default() -> Self {
        Self::new()
    }
}

impl Moments {
    /// No numbers yet.
    pub const fn new() -> Self {
        Self {
            count: 0,
            mean: 0.0,
            squares: 0.0,
            cubes: 0.0,
            fourths: 0.0,
            smallest: f64::INFINITY,
            largest: f64::NEG_INFINITY,
        }
    }

    /// Adds one number.
    pub fn add(&mut self, x: f64) {
        self.count += 1;
        let n = self.count as f64;
        let delta = x - self.mean;
        let step = delta / n;
        self.mean += step;
        let square = delta * (x - self.mean);
        self.fourths += square * step * step * (n * n - 3.0 * n + 3.0) + 6.0 * step * step * self.squares
            - 4.0 * step * self.cubes;
        self.cubes += square * step * (n - 2.0) - 3.0 * step * self.squares;
        self.squares += square;
        self.smallest = self.smallest.min(x);
        self.largest = self.largest.max(x);
    }

    /// Adds all numbers that `other` has seen. The same parts in the same order give the same bits.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let (n, m) = (self.count as f64, other.count as f64);
        let delta = other.mean - self.mean;
        let (left, right) = (n / (n + m), m / (n + m));
        let between = delta * delta * (n * right);
        self.fourths += other.fourths
            + between * delta * delta * (left * left - left * right + right * right)
            + 6.0 * delta * delta * (left * left * other.squares + right * right * self.squares)
            + 4.0 * delta * (left * other.cubes - right * self.cubes);
        self.cubes += other.cubes
            + between * delta * (left - right)
            + 3.0 * delta * (left * other.squares - right * self.squares);
        self.mean += delta * right;
        self.squares += other.squares + between;
        self.count += other.count;
        self.smallest = self.smallest.min(other.smallest);
        self.largest = self.largest.max(other.largest);
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

    /// Skewness sqrt(n) S_3 / S_2^(3/2); `None` if all numbers are equal.
    pub fn skewness(&self) -> Option<f64> {
        (self.squares > 0.0)
            .then(|| (self.count as f64).sqrt() * (self.cubes / self.squares / self.squares.sqrt()))
    }

    /// Kurtosis n S_4 / S_2^2, 3 for a normal distribution; `None` if all numbers are equal.
    pub fn kurtosis(&self) -> Option<f64> {
        (self.squares > 0.0).then(|| self.count as f64 * (self.fourths / self.squares / self.squares))
    }

    /// The smallest number; infinity if there are none.
    pub fn smallest(&self) -> f64 {
        self.smallest
    }

    /// The largest number; minus infinity if there are none.
    pub fn largest(&self) -> f64 {
        self.largest
    }

    /// Two-sided test: is the mean `expected`, a value that is itself known to within `error`?
    ///
    /// The rounding of this accumulation, sqrt(n) + 8 units in the last place, is forgiven on top. Where the values lie
    /// outside 1e-70 to 1e70, their fourth powers may be lost, and the answer is not trusted.
    ///
    /// # Errors
    /// No values; values that are not finite; an `expected` that is not finite; an `error` that is negative or NaN.
    ///
    /// ```
    /// use warpcheck::statistics::{Moments, Verdict};
    /// let moments: Moments = (0..10_000).map(|i| f64::from(i * 7919 % 10_000) / 1e4).collect();
    /// let right = moments.mean_test(0.5, 1e-4)?;
    /// assert!(right.verdict == Verdict::Trusted && right.p > 0.9);
    /// let wrong = moments.mean_test(0.52, 1e-4)?;
    /// assert!(wrong.verdict.is_trusted() && wrong.p_conservative < 1e-9);
    /// # Ok::<(), warpcheck::statistics::Error>(())
    /// ```
    pub fn mean_test(&self, expected: f64, error: f64) -> Result<MeanTest, Error> {
        if self.count == 0 {
            return Err(Error::TooFew { name: "values", len: 0, min: 1 });
        }
        require(self.mean.is_finite(), "mean of the values", self.mean, "finite")?;
        require(self.squares.is_finite(), "sum of squared deviations", self.squares, "finite")?;
        require(expected.is_finite(), "expected", expected, "finite")?;
        require(error >= 0.0, "error", error, "non-negative")?;
        let n = self.count as f64;
        let difference = self.mean - expected;
        let rounding = f64::EPSILON * (n.sqrt() + 8.0) * self.mean.abs().max(expected.abs());
        let farthest = (self.largest - self.mean).max(self.mean - self.smallest);
        let scale = self.squares.sqrt();
        if scale == 0.0 {
            let p = |off: f64| if difference.abs() <= off { 1.0 } else { 0.0 };
            let (p, p_conservative) = (p(rounding), p(rounding + error));
            let few = self.count < LEAST;
            let verdict = match () {
                () if few => Verdict::TooFew,
                () if p_conservative == 0.0 => Verdict::Constant,
                () => Verdict::Trusted,
            };
            let z = if p == 1.0 { 0.0 } else { difference.signum() * f64::INFINITY };
            return Ok(MeanTest { z, skewness: 0.0, p, p_conservative, verdict });
        }
        let share = (farthest / scale).powi(2);
        let fourth_share = farthest.powi(4) / self.fourths;
        let skewness = self.cubes / self.squares / scale;
        // Where the term may no longer hold, p is kept at what it is there: tails only fall further.
        let furthest_z = (3.0 * LARGEST_TERM / skewness.abs()).cbrt();
        let root = (n * (n - 1.0)).sqrt();
        let at = |off: f64| {
            let z = ((difference.abs() - off).max(0.0) / scale * root - MISSED * farthest / scale).max(0.0)
                / (1.0 + MISSED * share).sqrt();
            let kept = z.min(furthest_z);
            let p = (2.0 * normal::sf(kept) * (skewness.abs() * kept * kept * kept / 3.0).exp()).min(1.0);
            (p, z > furthest_z)
        };
        let ((p, bounded), (p_conservative, _)) = (at(rounding), at(rounding + error));
        let verdict = if self.count < LEAST {
            Verdict::TooFew
        } else if !(share <= SHARE[0] && fourth_share <= SHARE[1]) {
            Verdict::HeavyTailed
        } else if bounded {
            Verdict::Bounded
        } else {
            Verdict::Trusted
        };
        Ok(MeanTest { z: difference / scale * root, skewness, p, p_conservative, verdict })
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

/// What the test of a mean found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MeanTest {
    /// Mean less expected value, in standard errors.
    pub z: f64,
    /// Skewness of the mean: that of the values over sqrt(n).
    pub skewness: f64,
    /// Probability of a |z| at least this large if the expected value is right, for what it is worth by `verdict`.
    pub p: f64,
    /// The same, if the expected value is right within its error.
    pub p_conservative: f64,
    /// Whether the sample is fit for the question.
    pub verdict: Verdict,
}

/// Whether a p-value of a mean can be believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Verdict {
    /// Nothing speaks against it.
    Trusted,
    /// The mean is so far off that the expansion of the tail may not hold there: p is an upper bound, that of the last
    /// point where it does.
    Bounded,
    /// Fewer than 1000 values: not to be believed.
    TooFew,
    /// One value holds more than 1/50 of the sum of squared deviations, or more than 1/10 of that of fourth powers: not to be
    /// believed.
    HeavyTailed,
    /// All values are equal, and not to what was expected: what would make up for it may just be rare. Not to be believed.
    Constant,
}

impl Verdict {
    /// Whether p is a p-value.
    pub fn is_trusted(self) -> bool {
        matches!(self, Self::Trusted | Self::Bounded)
    }
}
