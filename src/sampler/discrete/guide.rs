//! Inversion by a guide table.
//!
//! [0, 2^53) is cut into m = 2^k buckets of equal width, so that the bucket of a step is its upper k bits, without a rounding (rounding u * m
//! would put steps into the wrong one). For each bucket the guide says how many boundaries lie at or before its start: the entry of a step is that one
//! or one of the few that follow (Chen and Asau 1974; Devroye, "Non-Uniform Random Variate Generation", 1986, section III.2.4). Here a cell of the guide
//! holds the first boundary inside of its bucket too, to the last bit, and whether there are more:
//!
//!   [ last step before the boundary, 53 - k bits | more?, 1 bit | entry, 10 + k bits ]
//!
//! so that nine steps in ten are told their entry by one cell: one memory access, no branch. For the others boundaries are counted four at a time, all four of
//! them: a scan that stops at the right one is mispredicted nearly every time. Where all four are passed, the rest of the bucket is
//! searched in halves, so that no weights make it slower than a binary search.
//!
//! The boundaries are those of [`DiscreteCdf`], and so is every answer.

use super::{BATCH, Choice, DiscreteCdf, in_batches, in_wide_batches, position_of, step_at, step_of};
use crate::pages::Pages;
use crate::parallel;
use crate::sampler::Error;

/// Boundaries counted without a branch.
const LANES: usize = 4;
/// Steps searched together where only the index is wanted.
const WIDE: usize = 256;
/// Cells made by one task.
const PIECE: usize = 1 << 14;

/// A table to select an index in about one memory access, keeping the order of the variates.
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
    cells: Pages<u64>,
    /// k.
    bits: u32,
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
        // 1.5 to 3 buckets an entry; twice as many where they are cached all the same.
        let few = usize::from(cdf.len() <= 4096);
        let buckets = ((cdf.len() + cdf.len() / 2).next_power_of_two() << few).max(2);
        let bits = buckets.trailing_zeros();
        let boundaries = cdf.boundaries();
        let (shift, unit) = (53 - bits, 1_u64 << (11 + bits));
        let mut cells = Pages::zeros(buckets);
        parallel::chunks_mut(&mut cells, PIECE, |piece, cells| {
            let first = (piece * PIECE) as u64;
            let mut passed = boundaries.partition_point(|&b| b <= first << shift);
            for (bucket, cell) in (first..).zip(cells) {
                let entry = passed;
                let end = (bucket + 1) << shift;
                // Boundaries inside; one at the bucket's end belongs to the next.
                let inside = boundaries[entry..].iter().take_while(|&&b| b < end).count();
                passed += inside;
                while passed < boundaries.len() && boundaries[passed] <= end {
                    passed += 1;
                }
                let last = match inside {
                    0 => !(unit - 1),
                    _ => ((boundaries[entry] - 1) << 11) << bits,
                };
                *cell = last | if inside > 1 { unit >> 1 } else { 0 } | entry as u64;
            }
        });
        Self { cdf, cells, bits }
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
        self.cdf.choice(self.batch(&[step_at(position) << 11])[0] as usize, position)
    }

    /// The entries of the upper 53 bits of a few numbers: first all cells, then whatever they don't tell, so that the processor waits for all of memory at once.
    #[inline]
    fn batch<const N: usize>(&self, bits: &[u64; N]) -> [u32; N] {
        let more = 1 << (10 + self.bits);
        let guide = &*self.cells;
        // Loops and no `map`, which for arrays isn't always compiled in line.
        let mut cells = [0; N];
        for i in 0..N {
            cells[i] = guide[(bits[i] >> (64 - self.bits)) as usize];
        }
        // Those that their cells don't tell are listed without a branch, each in the place that the next takes if it isn't one.
        let (mut entries, mut untold, mut count) = ([0; N], [0_u8; N], 0);
        const { assert!(N <= 1 << u8::BITS) };
        for i in 0..N {
            // The lower bits of the cell don't matter: those of the step are 0.
            let passed = (step_of(bits[i]) << 11) << self.bits > cells[i];
            entries[i] = (cells[i] & (more - 1)) as u32 + u32::from(passed);
            untold[count] = i as u8;
            count += usize::from(passed & (cells[i] & more != 0));
        }
        for &i in &untold[..count] {
            let i = usize::from(i);
            entries[i] = self.further(entries[i] as usize, step_of(bits[i])) as u32;
        }
        entries
    }

    /// The entry of a step, which is this one or a later one of the same bucket.
    #[inline]
    fn further(&self, start: usize, step: u64) -> usize {
        let Some(last) = self.len().checked_sub(LANES) else { return self.cdf.index(step) };
        let start = start.min(last);
        let lanes = &self.cdf.boundaries()[start..start + LANES];
        let passed: usize = lanes.iter().map(|&b| usize::from(b <= step)).sum();
        if passed == LANES { self.crowded(start + LANES, step) } else { start + passed }
    }

    /// The entry where more than four lie in the bucket.
    #[cold]
    fn crowded(&self, start: usize, step: u64) -> usize {
        let next = (step >> (53 - self.bits)) as usize + 1;
        let end = match self.cells.get(next) {
            // Boundaries at its start are passed by it, and not by the step.
            Some(cell) => (cell & ((1 << (10 + self.bits)) - 1)) as usize,
            None => self.len(),
        };
        start + self.cdf.boundaries()[start..end.max(start)].partition_point(|&b| b <= step)
    }

    /// The entries for 64 random bits each: [`choose`](Self::choose) at the variate of their upper 53.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn indices(&self, bits: &[u64], out: &mut [u32]) {
        assert_eq!(bits.len(), out.len(), "as many bits as indices");
        in_wide_batches::<WIDE, _, _>(
            bits,
            out,
            |bits, out| *out = self.batch(bits),
            |bits, out| *out = self.batch(bits),
            |bits| self.batch(&[bits])[0],
        );
    }

    /// [`choose`](Self::choose) for many variates.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn choose_all(&self, xi: &[f64], out: &mut [Choice]) {
        assert_eq!(xi.len(), out.len(), "as many variates as choices");
        in_batches::<BATCH, _, _>(xi, out, |xi, out| *out = self.choose_batch(xi), |xi| self.choose(xi));
    }

    /// [`choose`](Self::choose) for a few variates.
    #[inline]
    pub(in crate::sampler) fn choose_batch<const N: usize>(&self, xi: &[f64; N]) -> [Choice; N] {
        let (mut positions, mut bits) = ([0.0; N], [0; N]);
        for i in 0..N {
            positions[i] = position_of(xi[i]);
            bits[i] = step_at(positions[i]) << 11;
        }
        let entries = self.batch(&bits);
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
        self.cdf.bytes() + size_of_val(&*self.cells)
    }

    pub(in crate::sampler) fn some_boundaries(&self) -> Vec<f64> {
        self.cdf.some_boundaries()
    }
}
