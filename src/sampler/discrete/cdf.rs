//! Discrete selection by inversion of a CDF.
//!
//! P(i) = w_i / sum w. The running sum S_i is compensated (Neumaier) in `f64` on weights scaled by a power of two,
//! then turned into integer boundaries of [0, 2^53):
//!
//!   b_i = floor(S_i / S_N (2^53 - M)) + m_i,   M positive weights, m_i of them among the first i.
//!
//! So b_N = 2^53 exactly, an entry of weight 0 has width 0 and is never returned, and every positive weight has at
//! least one of the 2^53 steps and can be returned. A variate is a 53-bit integer k = floor(2^53 xi), and the entry is
//! the one with b_i <= k < b_{i+1}, found by binary search. The mass reported is the width searched, (b_{i+1} - b_i) / 2^53,
//! to the last bit; it differs from w_i / sum w by at most (M + 1) 2^-53.
//!
//! Inversion by search: Devroye, "Non-Uniform Random Variate Generation", 1986, section III.2. Variates with fewer bits
//! (24 for one `f32`) reach only what their lattice meets.

use super::{Choice, position_of, step_at, step_of};
use crate::pages::Pages;
use crate::random::ONE_MINUS_EPSILON_F64;
use crate::sampler::Error;

/// 2^53, how many steps the variate is cut into.
pub(in crate::sampler) const STEPS: f64 = 9_007_199_254_740_992.0;

/// A table to select an index with given probabilities from one variate. See the file for its mathematics.
///
/// ```
/// use warpcheck::sampler::DiscreteCdf;
/// let table = DiscreteCdf::new(&[1.0, 0.0, 3.0])?;
/// let choice = table.choose(0.7);
/// assert_eq!(choice.index, 2);
/// assert!((choice.mass - 0.75).abs() < 1e-15);
/// assert!((choice.rest - 0.6).abs() < 1e-14); // (0.7 - 0.25) / 0.75
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DiscreteCdf {
    /// b_1 … b_N; b_0 = 0 is left out.
    boundaries: Pages<u64>,
}

impl DiscreteCdf {
    /// A table for these weights, which need not be normalised.
    ///
    /// # Errors
    /// Without weights, if all are 0, or if one is negative, NaN or infinite (named by its index).
    pub fn new(weights: &[f64]) -> Result<Self, Error> {
        if weights.is_empty() {
            return Err(Error::NoWeights);
        }
        if weights.len() > u32::MAX as usize {
            let value = weights.len() as f64;
            return Err(Error::Parameter { parameter: "number of weights", value, allowed: "under 2^32" });
        }
        if let Some((index, &value)) =
            weights.iter().enumerate().find(|(_, w)| !(w.is_finite() && **w >= 0.0))
        {
            return Err(Error::Weight { index, value });
        }
        let largest = weights.iter().copied().fold(0.0, f64::max);
        if largest == 0.0 {
            return Err(Error::AllZero { count: weights.len() });
        }
        // By powers of two, which round nothing, to where sums neither overflow nor lose denormals. In two steps,
        // since 2^1074 is no f64.
        let exponent = -exponent_of(largest);
        let (half, other) = (exponent / 2, exponent - exponent / 2);
        let scaled = |w: f64| w * power_of_two(half) * power_of_two(other);

        let mut running = Neumaier::default();
        let total = {
            let mut total = Neumaier::default();
            weights.iter().for_each(|&w| total.add(scaled(w)));
            total.value()
        };
        let positive = weights.iter().filter(|&&w| w > 0.0).count() as u64;
        let free = STEPS - positive as f64;
        let (mut boundaries, mut passed, mut shared) = (Pages::zeros(weights.len()), 0_u64, 0_u64);
        for (boundary, &w) in boundaries.iter_mut().zip(weights) {
            if w > 0.0 {
                running.add(scaled(w));
                passed += 1;
                // At the last positive entry running = total to the last bit, since both are the same additions;
                // before it the rounded value may step back by one unit.
                let share = (running.value() / total).min(1.0);
                shared = shared.max((share * free) as u64);
            }
            *boundary = shared + passed;
        }
        debug_assert_eq!(shared + passed, STEPS as u64);
        Ok(Self { boundaries })
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.boundaries.len()
    }

    /// Never true: an empty table cannot be made.
    pub fn is_empty(&self) -> bool {
        self.boundaries.is_empty()
    }

    /// The entry for a variate in `[0, 1)`. What lies outside is moved to the nearest end, NaN to 0.
    #[inline]
    pub fn choose(&self, xi: f64) -> Choice {
        let position = position_of(xi);
        self.choice(self.index(step_at(position)), position)
    }

    /// The entry that a step of `0..2^53` falls in.
    #[inline]
    pub(super) fn index(&self, step: u64) -> usize {
        self.boundaries.partition_point(|&b| b <= step)
    }

    /// The choice of an entry that was found at this position, in steps.
    #[inline(always)]
    pub(super) fn choice(&self, index: usize, position: f64) -> Choice {
        let start = self.start(index);
        let width = (self.boundaries[index] - start) as f64;
        let rest = ((position - start as f64) / width).min(ONE_MINUS_EPSILON_F64);
        Choice { index, mass: width / STEPS, rest }
    }

    /// The entries for 64 random bits each: [`choose`](Self::choose) at the variate of their upper 53.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn indices(&self, bits: &[u64], out: &mut [u32]) {
        assert_eq!(bits.len(), out.len(), "as many bits as indices");
        out.iter_mut().zip(bits).for_each(|(i, &bits)| *i = self.index(step_of(bits)) as u32);
    }

    /// [`choose`](Self::choose) for many variates.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn choose_all(&self, xi: &[f64], out: &mut [Choice]) {
        assert_eq!(xi.len(), out.len(), "as many variates as choices");
        out.iter_mut().zip(xi).for_each(|(choice, &xi)| *choice = self.choose(xi));
    }

    /// How many of the 2^53 steps an entry has.
    #[inline]
    pub(super) fn steps(&self, index: usize) -> u64 {
        self.boundaries[index] - self.start(index)
    }

    /// b_1 … b_N.
    #[inline]
    pub(super) fn boundaries(&self) -> &[u64] {
        &self.boundaries
    }

    /// The probability with which [`choose`](Self::choose) returns an entry; 0 past the end.
    #[inline]
    pub fn mass(&self, index: usize) -> f64 {
        match self.boundaries.get(index) {
            Some(&end) => (end - self.start(index)) as f64 / STEPS,
            None => 0.0,
        }
    }

    /// Bytes that the table takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.boundaries)
    }

    /// The probability of all entries before `index`.
    pub fn cumulative(&self, index: usize) -> f64 {
        self.start(index.min(self.len())) as f64 / STEPS
    }

    /// The variate at which this entry with this rest is chosen; the inverse of [`choose`](Self::choose).
    pub fn variate(&self, index: usize, rest: f64) -> f64 {
        let (start, end) = (self.start(index) as f64, self.boundaries[index] as f64);
        // Above 2^52 the middle of a step is no f64, and would round to the next entry.
        (start + rest * (end - start)).min(end.next_down()) / STEPS
    }

    /// Up to 512 of the variates at which the entry changes, evenly spread over the entries, first and last included.
    pub(in crate::sampler) fn some_boundaries(&self) -> Vec<f64> {
        let inner = self.len() - 1;
        let count = inner.min(512);
        (0..count)
            .map(|i| {
                self.boundaries[if count > 1 { i * (inner - 1) / (count - 1) } else { 0 }] as f64 / STEPS
            })
            .filter(|&knot| knot > 0.0 && knot < 1.0)
            .collect()
    }

    #[inline]
    fn start(&self, index: usize) -> u64 {
        if index == 0 { 0 } else { self.boundaries[index - 1] }
    }
}

/// The exponent e with 2^e <= x < 2^(e + 1), for x > 0, denormals included.
fn exponent_of(x: f64) -> i32 {
    let bits = (x.to_bits() >> 52) as i32;
    if bits > 0 { bits - 1023 } else { exponent_of(x * power_of_two(64)) - 64 }
}

fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// Neumaier's compensated running sum (ZAMM 54, 1974), here so that tables are built without help from what judges them.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::sampler) struct Neumaier {
    sum: f64,
    compensation: f64,
}

impl Neumaier {
    pub(in crate::sampler) fn add(&mut self, x: f64) {
        let t = self.sum + x;
        self.compensation += if self.sum >= x { (self.sum - t) + x } else { (x - t) + self.sum };
        self.sum = t;
    }

    pub(in crate::sampler) fn value(&self) -> f64 {
        self.sum + self.compensation
    }
}
