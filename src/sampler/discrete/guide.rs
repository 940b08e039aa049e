//! Inversion by a guide table.
//!
//! [0, 2^53) is cut into m = 2^k >= N buckets of equal width, so that the bucket of a step is its upper k bits, without a rounding. For each
//! bucket g_j is the number of boundaries at or before its start: the entry of a step lies at g_j or a few entries further (Chen and
//! Asau 1974; Devroye, "Non-Uniform Random Variate Generation", 1986, section III.2.4: 1 + N / m comparisons are expected).
//! How many further is counted over four boundaries, all of them, without a branch: a scan that stops at the right one
//! is mispredicted nearly every time. Where all four are passed, the rest of the bucket is searched in halves, so that no weights make it slower
//! than a binary search.
//!
//! The boundaries are those of [`DiscreteCdf`], and so is every answer.

use super::{BATCH, Choice, DiscreteCdf, position_of, step_of};
use crate::sampler::Error;

/// Boundaries looked at without a branch.
const LANES: usize = 4;

/// A table to select an index in about two memory accesses, keeping the order of the variates.
///
/// ```
/// use warpcheck::sampler::{DiscreteCdf, DiscreteGuide};
/// let weights = [1.0, 0.0, 3.0, 0.5, 2.0];
/// let (guide, cdf) = (DiscreteGuide::new(&weights)?, DiscreteCdf::new(&weights)?);
/// assert_eq!(guide.choose(0.7), cdf.choose(0.7));
/// let mut out = [0; 3];
/// guide.indices(&[0, 1 << 63, u64::MAX], &mut out); // many at a time: memory is waited for once, not three times
/// assert_eq!(out, [0, 2, 4]);
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DiscreteGuide {
    cdf: DiscreteCdf,
    /// g_0 … g_m, but none past N - 4, so that four boundaries follow; empty under five entries.
    guide: Box<[u32]>,
    /// The bits of a step below its bucket.
    shift: u32,
}

impl DiscreteGuide {
    /// A table for these weights, which need not be normalised.
    ///
    /// # Errors
    /// Without weights, if there are 2^32 or more, if all are 0, or if one is negative, NaN or infinite (named by its index).
    pub fn new(weights: &[f64]) -> Result<Self, Error> {
        Ok(Self::from_cdf(DiscreteCdf::new(weights)?))
    }

    /// The same table, searched with a guide.
    pub fn from_cdf(cdf: DiscreteCdf) -> Self {
        let entries = cdf.len();
        if entries <= LANES {
            return Self { cdf, guide: Box::default(), shift: 0 };
        }
        let buckets = entries.next_power_of_two();
        let shift = 53 - buckets.trailing_zeros();
        let (boundaries, last) = (cdf.boundaries(), entries - LANES);
        let mut passed = 0;
        let guide = (0..=buckets as u64)
            .map(|bucket| {
                while passed < last && boundaries[passed] <= bucket << shift {
                    passed += 1;
                }
                passed as u32
            })
            .collect();
        Self { cdf, guide, shift }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.cdf.len()
    }

    /// Never true: an empty table cannot be made.
    pub fn is_empty(&self) -> bool {
        self.cdf.is_empty()
    }

    /// The entry for a variate in `[0, 1)`. What lies outside is moved to the nearest end, NaN to 0.
    #[inline]
    pub fn choose(&self, xi: f64) -> Choice {
        let position = position_of(xi);
        self.cdf.choice(self.index(position as u64), position)
    }

    /// The entry that a step of `0..2^53` falls in.
    #[inline]
    fn index(&self, step: u64) -> usize {
        if self.guide.is_empty() {
            return self.cdf.index(step);
        }
        let start = self.guide[(step >> self.shift) as usize] as usize;
        let passed = self.passed(start, step);
        if passed == LANES { self.crowded(start, step) } else { start + passed }
    }

    /// How many of the four boundaries from `start` on lie at or before the step.
    #[inline]
    fn passed(&self, start: usize, step: u64) -> usize {
        let lanes: &[u64] = &self.cdf.boundaries()[start..start + LANES];
        lanes.iter().map(|&b| usize::from(b <= step)).sum()
    }

    /// The entry where more than four lie in the bucket.
    #[cold]
    fn crowded(&self, start: usize, step: u64) -> usize {
        let first = start + LANES;
        // Past the bucket's end the guide may have stopped short of the last entries.
        let end = self.guide[(step >> self.shift) as usize + 1] as usize + LANES;
        first + self.cdf.boundaries()[first..end.min(self.len())].partition_point(|&b| b <= step)
    }

    /// The entries for 64 random bits each: [`choose`](Self::choose) at the variate of their upper 53.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn indices(&self, bits: &[u64], out: &mut [u32]) {
        assert_eq!(bits.len(), out.len(), "as many bits as indices");
        if self.guide.is_empty() {
            return self.cdf.indices(bits, out);
        }
        let (bits, bits_left) = bits.as_chunks::<BATCH>();
        let (out, out_left) = out.as_chunks_mut::<BATCH>();
        for (bits, out) in bits.iter().zip(out) {
            *out = self.batch(&bits.map(step_of));
        }
        for (&bits, out) in bits_left.iter().zip(out_left) {
            *out = self.index(step_of(bits)) as u32;
        }
    }

    /// The entries of 16 steps: first all guides, then all boundaries, so that the processor waits for all of them at once.
    #[inline]
    fn batch<const N: usize>(&self, steps: &[u64; N]) -> [u32; N] {
        let starts = steps.map(|step| self.guide[(step >> self.shift) as usize]);
        let mut passed = [0; N];
        for i in 0..N {
            passed[i] = self.passed(starts[i] as usize, steps[i]) as u32;
        }
        let mut entries = [0; N];
        let mut most = 0;
        for i in 0..N {
            entries[i] = starts[i] + passed[i];
            most = most.max(passed[i]);
        }
        if most == LANES as u32 {
            for i in 0..N {
                if passed[i] == LANES as u32 {
                    entries[i] = self.crowded(starts[i] as usize, steps[i]) as u32;
                }
            }
        }
        entries
    }

    /// [`choose`](Self::choose) for many variates.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn choose_all(&self, xi: &[f64], out: &mut [Choice]) {
        assert_eq!(xi.len(), out.len(), "as many variates as choices");
        let (xi, xi_left) = xi.as_chunks::<BATCH>();
        let (out, out_left) = out.as_chunks_mut::<BATCH>();
        for (xi, out) in xi.iter().zip(out) {
            *out = self.choose_batch(xi);
        }
        for (&xi, out) in xi_left.iter().zip(out_left) {
            *out = self.choose(xi);
        }
    }

    /// [`choose`](Self::choose) for a few variates.
    #[inline]
    pub(in crate::sampler) fn choose_batch<const N: usize>(&self, xi: &[f64; N]) -> [Choice; N] {
        let positions = xi.map(position_of);
        let entries = if self.guide.is_empty() {
            positions.map(|position| self.cdf.index(position as u64) as u32)
        } else {
            self.batch(&positions.map(|position| position as u64))
        };
        let mut choices = [Choice::default(); N];
        for i in 0..N {
            choices[i] = self.cdf.choice(entries[i] as usize, positions[i]);
        }
        choices
    }

    /// The probability with which [`choose`](Self::choose) returns an entry; 0 past the end.
    #[inline]
    pub fn mass(&self, index: usize) -> f64 {
        self.cdf.mass(index)
    }

    /// The probability of all entries before `index`.
    pub fn cumulative(&self, index: usize) -> f64 {
        self.cdf.cumulative(index)
    }

    /// The variate at which this entry with this rest is chosen; the inverse of [`choose`](Self::choose).
    pub fn variate(&self, index: usize, rest: f64) -> f64 {
        self.cdf.variate(index, rest)
    }

    /// Bytes that the table takes.
    pub fn bytes(&self) -> usize {
        self.cdf.bytes() + size_of_val(&*self.guide)
    }

    pub(in crate::sampler) fn some_boundaries(&self) -> Vec<f64> {
        self.cdf.some_boundaries()
    }
}
