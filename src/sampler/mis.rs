//! Weights of multiple importance sampling.
//!
//! A sample that strategy i drew with density p_i, of which there are n_i samples (or which is chosen with probability n_i), has the weight
//!
//!   w_i = (n_i p_i)^b / sum_k (n_k p_k)^b,
//!
//! with b = 1 the balance and b = 2 the power heuristic (Veach and Guibas 1995; Veach 1997, sections 9.2.2 to 9.2.4). One-sample MIS with the
//! balance heuristic needs no weights: [`Mixture`](super::Mixture) is that.
//!
//! Written as they stand the powers overflow: in `f32` from p = 1.8e19 on, which a lamp of 1e-10 at distance 1 has. So densities are divided by
//! the largest of them, shares by the largest share, and the products by the largest product: every ratio is at most 1, the sum at least
//! 1, and what underflows is a weight of 0 that no digit shows.

/// How the weights of strategies follow from their densities.
///
/// ```
/// use warpcheck::sampler::Heuristic;
/// assert_eq!(Heuristic::Balance.weight(3.0_f32, 1.0), 0.75);
/// assert_eq!(Heuristic::Power.weight(3.0_f32, 1.0), 0.9);
/// assert_eq!(Heuristic::Power.weight(1e20_f32, 2e-23), 1.0); // not NaN
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heuristic {
    /// In proportion to n p: never much worse than any other.
    #[default]
    Balance,
    /// In proportion to (n p)^2: better where one strategy is nearly right.
    Power,
}

/// `f32` or `f64`.
pub trait Real: sealed::Real {}
impl Real for f32 {}
impl Real for f64 {}

mod sealed {
    use std::ops::{Add, Div, Mul};

    pub trait Real: Copy + PartialOrd + Add<Output = Self> + Div<Output = Self> + Mul<Output = Self> {
        const ZERO: Self;
        const ONE: Self;
        const INFINITY: Self;
    }
    impl Real for f32 {
        const ZERO: Self = 0.0;
        const ONE: Self = 1.0;
        const INFINITY: Self = f32::INFINITY;
    }
    impl Real for f64 {
        const ZERO: Self = 0.0;
        const ONE: Self = 1.0;
        const INFINITY: Self = f64::INFINITY;
    }
}

impl Heuristic {
    /// The weight of a sample of the strategy that has the density `own` there, beside one other strategy with as many samples.
    #[inline]
    pub fn weight<T: Real>(self, own: T, other: T) -> T {
        self.weight_among(0, [(T::ONE, own), (T::ONE, other)])
    }

    /// The weight of a sample of strategy number `own` among `strategies`, each a share (its number of samples, or the probability with which
    /// it is chosen) and its density at the sample, all densities per the same measure.
    ///
    /// 0 where the strategy has no density or no share, and so where nobody has. An infinite density (a delta) takes all the weight from finite ones;
    /// several share it by their shares.
    ///
    /// ```
    /// use warpcheck::sampler::Heuristic;
    /// let weight = |own| Heuristic::Balance.weight_among(own, [(3.0, 1.0), (1.0, 5.0)]); // 3 of the BRDF, 1 of the light
    /// assert!((weight(0) - 3.0_f64 / 8.0).abs() < 1e-15 && (weight(1) - 5.0 / 8.0).abs() < 1e-15);
    /// ```
    ///
    /// # Panics
    /// If there is no strategy `own`.
    #[inline]
    pub fn weight_among<T: Real, const N: usize>(self, own: usize, strategies: [(T, T); N]) -> T {
        let largest = |values: [T; N]| values.into_iter().fold(T::ZERO, |a, b| if b > a { b } else { a });
        // Who never draws, or never here, has no say in what is large.
        let active = strategies.map(|(share, density)| share > T::ZERO && density > T::ZERO);
        if !active[own] {
            return T::ZERO;
        }
        let kept = |value: fn((T, T)) -> T| {
            let mut values = strategies.map(value);
            values.iter_mut().zip(active).for_each(|(v, active)| {
                if !active {
                    *v = T::ZERO
                }
            });
            values
        };
        let (shares, densities) = (kept(|s| s.0), kept(|s| s.1));
        let (most, top) = (largest(shares), largest(densities));
        let relative = |density: T| match () {
            () if top < T::INFINITY => density / top,
            () if density < top => T::ZERO,
            () => T::ONE,
        };
        let products: [T; N] = std::array::from_fn(|i| shares[i] / most * relative(densities[i]));
        let peak = largest(products);
        if !(products[own] > T::ZERO) {
            return T::ZERO;
        }
        let powers = products.map(|product| {
            let ratio = product / peak;
            if self == Self::Power { ratio * ratio } else { ratio }
        });
        powers[own] / powers.into_iter().fold(T::ZERO, |sum, power| sum + power)
    }
}
