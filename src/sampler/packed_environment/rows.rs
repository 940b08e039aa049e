//! Marginal and conditional, each searched with a guide: the order of both variates is kept.
//!
//! The marginal over the rows is a [`DiscreteGuide`]. A row's conditional has 2^31 steps and one boundary of 4 bytes a texel, rounded from the running sum
//! and moved by as many steps as it takes to leave every texel that has light at least one; what is stored is the last step before it, which fits
//! into an `i32`, -1 included. A mass is the difference of two of them, exactly.
//!
//! Sixteen boundaries are a line of the cache. The last one of each line is stored beside them once more, and each row has a guide over these, in 2
//! bytes for about a line: both few enough to stay in cache. From where the guide points, eight ends of lines are counted without a branch (where
//! all are passed, the rest of the row is searched in halves), which leaves one line to be fetched, for all samples of a batch at once, and its
//! texels to be counted.

use super::{Found, Weights};
use crate::pages::Pages;
use crate::parallel;
use crate::random::ONE_MINUS_EPSILON_F64;
use crate::sampler::discrete::{Neumaier, inside};
use crate::sampler::{DiscreteGuide, Error};

/// 2^31: how many steps a row has.
const STEPS: f64 = 2_147_483_648.0;
/// Boundaries a line.
const LINE: usize = 16;
/// Boundaries, or ends of lines, that are counted without a branch.
const LANES: usize = 8;

#[derive(Clone, Debug)]
pub(super) struct Rows {
    width: usize,
    marginal: DiscreteGuide,
    /// The last step of each texel or of what is before it, row after row, each filled up to whole lines. A row that has no light is all -1,
    /// and never searched.
    lasts: Pages<i32>,
    /// How far the rows of `lasts` are apart.
    stride: usize,
    /// The last boundary of each line, row after row, each followed by [`LANES`] that nothing passes. Empty where a row fits into a line.
    ends: Pages<i32>,
    /// How many lines of the row end before the start of a bucket.
    guides: Pages<u16>,
    /// Binary logarithm of the buckets a row.
    bits: u32,
}

impl Rows {
    pub(super) fn new(weights: &Weights<'_>) -> Result<Self, Error> {
        let (width, height) = (weights.width(), weights.height());
        if width > 1 << 16 {
            let value = width as f64;
            return Err(Error::Parameter {
                parameter: "width of the map",
                value,
                allowed: "at most 65536 with guide tables",
            });
        }
        let sums = parallel::map(height, |row| weights.row(row).fold(Sum::default(), Sum::add));
        let marginal: Vec<f64> = sums.iter().map(|sum| sum.value()).collect();
        let marginal = DiscreteGuide::new(&marginal).map_err(|_| weights.black())?;
        let lines = if width < LINE { 0 } else { width.div_ceil(LINE) };
        let stride = width.max(lines * LINE);
        let mut lasts = Pages::zeros(stride * height);
        parallel::chunks_mut(&mut lasts, stride, |row, lasts| {
            let (lasts, filling) = lasts.split_at_mut(width);
            fill(lasts, weights, row, &sums[row]);
            filling.fill(i32::MAX);
        });
        let mut ends = Pages::zeros(if lines == 0 { 0 } else { (lines + LANES) * height });
        parallel::chunks_mut(&mut ends, lines + LANES, |row, ends| {
            ends.fill(i32::MAX);
            let lasts = &lasts[row * stride..(row + 1) * stride];
            ends.iter_mut().zip(lasts.chunks_exact(LINE)).for_each(|(end, line)| *end = line[LINE - 1]);
        });
        let bits = lines.next_power_of_two().trailing_zeros();
        let mut guides = Pages::zeros(if lines == 0 { 0 } else { height << bits });
        parallel::chunks_mut(&mut guides, 1 << bits, |row, guide| {
            let ends = &ends[row * (lines + LANES)..][..lines];
            let mut passed = 0;
            for (bucket, first) in guide.iter_mut().enumerate() {
                let start = (bucket as u64) << (31 - bits);
                while passed < lines && i64::from(ends[passed]) < start as i64 {
                    passed += 1;
                }
                *first = passed as u16;
            }
        });
        Ok(Self { width, marginal, lasts, stride, ends, guides, bits })
    }

    /// The texels for variates of row and column.
    #[inline]
    pub(super) fn find<const N: usize>(&self, xi: &[[f64; 2]; N]) -> [Found; N] {
        // Loops and no `map`, which for arrays isn't always compiled in line.
        let (mut down, mut positions, mut columns) = ([0.0; N], [0.0; N], [0; N]);
        for i in 0..N {
            (down[i], positions[i]) = (xi[i][0], position_of(xi[i][1]));
        }
        let rows = self.marginal.choose_batch(&down);
        let (guides, ends, lasts) = (&*self.guides, &*self.ends, &*self.lasts);
        if ends.is_empty() {
            for i in 0..N {
                let step = positions[i] as i32;
                columns[i] = self.row(rows[i].index).partition_point(|&last| last < step);
            }
        } else {
            let (mut crowded, mut middles) = (0_u64, [0; N]);
            for i in 0..N {
                let bucket = positions[i] as u32 as usize >> (31 - self.bits);
                columns[i] = usize::from(guides[(rows[i].index << self.bits) + bucket]);
            }
            for i in 0..N {
                let step = positions[i] as i32;
                let first = self.ends_of(rows[i].index) + columns[i];
                let passed = count(&ends[first..first + LANES], step);
                columns[i] += passed;
                crowded |= u64::from(passed == LANES) << i;
            }
            while crowded != 0 {
                let i = crowded.trailing_zeros() as usize % N;
                crowded &= crowded - 1;
                columns[i] = self.crowded(rows[i].index, columns[i], positions[i] as i32);
            }
            // A loop with nothing else in it waits for many lines at once.
            for i in 0..N {
                columns[i] *= LINE;
                middles[i] = lasts[rows[i].index * self.stride + columns[i] + LANES - 1];
            }
            for i in 0..N {
                let step = positions[i] as i32;
                columns[i] += if middles[i] < step { LANES } else { 0 };
                let first = rows[i].index * self.stride + columns[i];
                columns[i] += count(&lasts[first..first + LANES], step);
            }
        }
        let mut found = [Found::default(); N];
        for i in 0..N {
            let (start, width) = self.interval(rows[i].index, columns[i]);
            found[i] = Found {
                column: columns[i],
                row: rows[i].index,
                across: ((positions[i] - start) / width).min(ONE_MINUS_EPSILON_F64),
                down: rows[i].rest,
                mass: rows[i].mass * (width * (1.0 / STEPS)),
            };
        }
        found
    }

    fn row(&self, row: usize) -> &[i32] {
        &self.lasts[row * self.stride..][..self.width]
    }

    /// Where the ends of a row's lines begin.
    #[inline]
    fn ends_of(&self, row: usize) -> usize {
        row * (self.stride / LINE + LANES)
    }

    /// The line, where as many lines as are counted end before it.
    #[cold]
    fn crowded(&self, row: usize, from: usize, step: i32) -> usize {
        let ends = &self.ends[self.ends_of(row)..][..self.stride / LINE];
        from + ends[from..].partition_point(|&end| end < step)
    }

    /// Where a texel starts, and how wide it is, in steps.
    #[inline]
    fn interval(&self, row: usize, column: usize) -> (f64, f64) {
        let at = row * self.stride + column;
        let before = match column {
            0 => -1,
            // In cache, as the line before isn't.
            _ if column % LINE == 0 => self.ends[self.ends_of(row) + column / LINE - 1],
            _ => self.lasts[at - 1],
        };
        (f64::from(before) + 1.0, f64::from(self.lasts[at]) - f64::from(before))
    }

    pub(super) fn mass(&self, column: usize, row: usize) -> f64 {
        self.marginal.mass(row) * (self.interval(row, column).1 * (1.0 / STEPS))
    }

    /// Some of the variates at which row or column change; columns of the likeliest row.
    pub(super) fn knots(&self, dimension: usize) -> Vec<f64> {
        if dimension == 0 {
            return self.marginal.some_boundaries();
        }
        let rows = 0..self.lasts.len() / self.stride;
        let likeliest =
            rows.max_by(|&a, &b| self.marginal.mass(a).total_cmp(&self.marginal.mass(b))).unwrap_or(0);
        let some = self.row(likeliest).iter().step_by(self.width.div_ceil(512));
        let knots = some.map(|&last| (f64::from(last) + 1.0) / STEPS);
        knots.filter(|&xi| xi > 0.0 && xi < 1.0).collect()
    }

    pub(super) fn bytes(&self) -> usize {
        self.marginal.bytes()
            + size_of_val(&*self.lasts)
            + size_of_val(&*self.ends)
            + size_of_val(&*self.guides)
    }
}

/// Where a variate lies in `[0, 2^31)`, once it is [`inside`].
#[inline]
fn position_of(xi: f64) -> f64 {
    inside(xi) * STEPS
}

/// How many boundaries are before a step.
#[inline]
fn count(lasts: &[i32], step: i32) -> usize {
    lasts.iter().map(|&last| i32::from(last < step)).sum::<i32>() as usize
}

/// A row's boundaries.
fn fill(lasts: &mut [i32], weights: &Weights<'_>, row: usize, total: &Sum) {
    let (mut sum, mut end, mut left) = (Sum::default(), 0, i64::from(total.positive));
    for (last, weight) in lasts.iter_mut().zip(weights.row(row)) {
        if weight > 0.0 {
            sum = sum.add(weight);
            left -= 1;
            let share = (sum.value() / total.value()).min(1.0);
            // One step at least for it, and for each that follows.
            end = ((share * STEPS).round() as i64).max(end + 1).min((1 << 31) - left);
        }
        *last = (end - 1) as i32;
    }
}

/// A compensated sum, and how many of its terms are positive.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    sum: Neumaier,
    pub(super) positive: u32,
}

impl Sum {
    pub(super) fn add(mut self, x: f64) -> Self {
        self.sum.add(x);
        self.positive += u32::from(x > 0.0);
        self
    }

    pub(super) fn value(&self) -> f64 {
        self.sum.value()
    }
}
