//! Marginal and conditional, each searched with a guide: the order of both variates is kept.
//!
//! The marginal over the rows is a [`DiscreteGuide`]. A row's conditional has 2^31 steps and one boundary of 4 bytes a texel, rounded from the running sum
//! and moved by as many steps as it takes to leave every texel that has light at least one; what is stored is the last step before it, which fits
//! into an `i32`, -1 included. A mass is the difference of two of them, exactly.
//!
//! Sixteen boundaries are a line of the cache. The upper 16 bits of each line's last one stand beside them once more, those of 32 lines in a line of
//! their own, and the last of each of these a third time: a tree of 2 bytes for 16 texels, that stays in cache, counted without a branch. It leaves one
//! line of boundaries to be fetched, for all samples of a batch at once, and its texels to be counted. Where 16 bits don't tell a step from an end, the
//! line that was fetched does, since all of it is passed; then the rest of the row is searched in halves.

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
/// Ends of lines that are counted together.
const BLOCK: usize = 32;
/// Numbers that are counted at a time.
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
    /// The upper bits of the last boundary of each line, row after row, each filled up to whole blocks. Empty where a row fits into a line.
    ends: Pages<i16>,
    /// The last of each block of these, row after row, each filled up to whole lanes.
    tops: Pages<i16>,
    /// Blocks a row, and how far the rows of `tops` are apart.
    blocks: usize,
    tops_stride: usize,
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
        let blocks = lines.div_ceil(BLOCK);
        let mut ends = Pages::zeros(blocks * BLOCK * height);
        parallel::chunks_mut(&mut ends, (blocks * BLOCK).max(1), |row, ends| {
            ends.fill(i16::MAX);
            let lasts = &lasts[row * stride..(row + 1) * stride];
            ends.iter_mut()
                .zip(lasts.chunks_exact(LINE))
                .for_each(|(end, line)| *end = upper(line[LINE - 1]));
        });
        let tops_stride = blocks.next_multiple_of(LANES);
        let mut tops = Pages::zeros(tops_stride * height);
        parallel::chunks_mut(&mut tops, tops_stride.max(1), |row, tops| {
            tops.fill(i16::MAX);
            let ends = &ends[row * blocks * BLOCK..][..blocks * BLOCK];
            tops.iter_mut().zip(ends.chunks_exact(BLOCK)).for_each(|(top, block)| *top = block[BLOCK - 1]);
        });
        Ok(Self { width, marginal, lasts, stride, ends, tops, blocks, tops_stride })
    }

    /// The texels for variates of row and column.
    #[inline]
    pub(super) fn find<const N: usize>(&self, xi: &[[f64; 2]; N]) -> [Found; N] {
        // Loops and no `map`, which for arrays isn't always compiled in line.
        let (mut down, mut positions) = ([0.0; N], [0.0; N]);
        let (mut steps, mut columns) = ([0; N], [0; N]);
        for i in 0..N {
            (down[i], positions[i]) = (xi[i][0], position_of(xi[i][1]));
            steps[i] = positions[i] as i32;
        }
        let rows = self.marginal.choose_batch(&down);
        let (tops, ends, lasts) = (&*self.tops, &*self.ends, &*self.lasts);
        if ends.is_empty() {
            for i in 0..N {
                columns[i] = self.row(rows[i].index).partition_point(|&last| last < steps[i]);
            }
        } else {
            for i in 0..N {
                let tops = &tops[rows[i].index * self.tops_stride..][..self.tops_stride];
                columns[i] = count(tops, upper(steps[i]));
            }
            for i in 0..N {
                let block = rows[i].index * self.blocks + columns[i];
                let ends = &ends[block * BLOCK..(block + 1) * BLOCK];
                columns[i] = (columns[i] * BLOCK + count(ends, upper(steps[i]))) * LINE;
            }
            // A loop with nothing else in it waits for many lines at once.
            let (mut middles, mut passed) = ([0; N], 0_u64);
            for i in 0..N {
                middles[i] = lasts[rows[i].index * self.stride + columns[i] + LANES - 1];
            }
            for i in 0..N {
                let step = steps[i];
                columns[i] += if middles[i] < step { LANES } else { 0 };
                let first = rows[i].index * self.stride + columns[i];
                let lasts = &lasts[first..first + LANES];
                passed |= u64::from(lasts[LANES - 1] < step) << i;
                columns[i] += lasts.iter().map(|&last| i32::from(last < step)).sum::<i32>() as usize;
            }
            while passed != 0 {
                let i = passed.trailing_zeros() as usize % N;
                passed &= passed - 1;
                columns[i] = self.further(rows[i].index, columns[i], steps[i]);
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

    /// The texel, from the first on that can be it.
    #[cold]
    fn further(&self, row: usize, from: usize, step: i32) -> usize {
        from + self.row(row)[from..].partition_point(|&last| last < step)
    }

    /// Where a texel starts, and how wide it is, in steps.
    #[inline(always)]
    fn interval(&self, row: usize, column: usize) -> (f64, f64) {
        let at = row * self.stride + column;
        let before = if column == 0 { -1 } else { self.lasts[at - 1] };
        (f64::from(before) + 1.0, f64::from(self.lasts[at]) - f64::from(before))
    }

    /// The variates of row and column at which a texel is drawn.
    pub(super) fn variates(&self, column: usize, row: usize) -> [(f64, f64); 2] {
        let (start, width) = self.interval(row, column);
        let down = (self.marginal.cumulative(row), self.marginal.cumulative(row + 1));
        [down, (start / STEPS, (start + width) / STEPS)]
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
            + size_of_val(&*self.tops)
    }
}

/// Where a variate lies in `[0, 2^31)`, once it is [`inside`].
#[inline]
fn position_of(xi: f64) -> f64 {
    inside(xi) * STEPS
}

/// The upper 16 bits of a step, in order.
#[inline]
fn upper(step: i32) -> i16 {
    ((step >> 15) - (1 << 15)) as i16
}

/// How many of the numbers, whole lanes of them, are below `x`.
#[inline]
fn count(numbers: &[i16], x: i16) -> usize {
    let mut counts = [0_i16; LANES];
    for lanes in numbers.as_chunks::<LANES>().0 {
        for i in 0..LANES {
            counts[i] += i16::from(lanes[i] < x);
        }
    }
    counts.iter().sum::<i16>() as usize
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
