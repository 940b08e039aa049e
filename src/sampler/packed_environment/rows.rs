//! Marginal and conditional, each searched with a guide: the order of both variates is kept.
//!
//! The marginal over the rows is a [`DiscreteGuide`]. A row's conditional has 2^31 steps and one boundary of 4 bytes a texel, rounded from the running sum
//! and moved by as many steps as it takes to leave every texel that has light at least one; what is stored is the last step before it, which fits
//! into an `i32`, -1 included. A mass is the difference of two of them, exactly. The guide of a row has a bucket for four texels, 2 bytes each, few
//! enough to stay in cache. From where it points, 16 boundaries are searched without a branch: one tells the half (which fetches the line, for all
//! samples of a batch), then eight are counted. Where all are passed, the rest of the bucket is searched in halves.

use super::{Found, Weights};
use crate::pages::Pages;
use crate::parallel;
use crate::random::ONE_MINUS_EPSILON_F64;
use crate::sampler::discrete::{Neumaier, inside};
use crate::sampler::{DiscreteGuide, Error};

/// 2^31: how many steps a row has.
const STEPS: f64 = 2_147_483_648.0;
/// Boundaries counted without a branch, after as many again were halved.
const LANES: usize = 8;
/// Texels a bucket.
const CROWD: usize = 4;

#[derive(Clone, Debug)]
pub(super) struct Rows {
    width: usize,
    marginal: DiscreteGuide,
    /// The last step of each texel or of what is before it, row after row. A row that has no light is all -1, and never searched.
    lasts: Pages<i32>,
    /// How many texels of the row end at or before the start of a bucket, but none past the width - 16.
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
        let mut lasts = Pages::zeros(width * height);
        parallel::chunks_mut(&mut lasts, width, |row, lasts| fill(lasts, weights, row, &sums[row]));
        let buckets = (1 << width.ilog2() >> CROWD.ilog2()).max(1_usize);
        let bits = buckets.trailing_zeros();
        let furthest = width.saturating_sub(2 * LANES);
        let mut guides = Pages::zeros(buckets * height);
        parallel::chunks_mut(&mut guides, buckets, |row, guide| {
            let lasts = &lasts[row * width..(row + 1) * width];
            let mut passed = 0;
            for (bucket, first) in guide.iter_mut().enumerate() {
                let start = (bucket as u64) << (31 - bits);
                while passed < furthest && i64::from(lasts[passed]) < start as i64 {
                    passed += 1;
                }
                *first = passed as u16;
            }
        });
        Ok(Self { width, marginal, lasts, guides, bits })
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
        let (guides, lasts) = (&*self.guides, &*self.lasts);
        if self.width < 2 * LANES {
            for i in 0..N {
                let step = positions[i] as i32;
                columns[i] = self.row(rows[i].index).partition_point(|&last| last < step);
            }
        } else {
            let (mut starts, mut crowded) = ([0; N], 0_u64);
            for i in 0..N {
                let bucket = positions[i] as u32 as usize >> (31 - self.bits);
                starts[i] = usize::from(guides[(rows[i].index << self.bits) + bucket]);
            }
            // Both ends of what is searched, since they lie in two cache lines, and nothing else in between.
            let (mut middles, mut ends) = ([0; N], [0; N]);
            for i in 0..N {
                let first = rows[i].index * self.width + starts[i];
                (middles[i], ends[i]) = (lasts[first + LANES - 1], lasts[first + 2 * LANES - 1]);
            }
            for i in 0..N {
                let step = positions[i] as i32;
                starts[i] += if middles[i] < step { LANES } else { 0 };
                crowded |= u64::from(ends[i] < step) << i;
            }
            for i in 0..N {
                let first = rows[i].index * self.width + starts[i];
                let step = positions[i] as i32;
                let passed: i32 =
                    lasts[first..first + LANES].iter().map(|&last| i32::from(last < step)).sum();
                columns[i] = starts[i] + passed as usize;
            }
            while crowded != 0 {
                let i = crowded.trailing_zeros() as usize % N;
                crowded &= crowded - 1;
                columns[i] = self.crowded(rows[i].index, columns[i], positions[i] as u32);
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
        &self.lasts[row * self.width..(row + 1) * self.width]
    }

    /// The texel, where sixteen don't reach, or the first eight end just before it.
    #[cold]
    fn crowded(&self, row: usize, from: usize, step: u32) -> usize {
        let next = (step >> (31 - self.bits)) as usize + 1;
        // The guide stops short of the last texels.
        let end = match next >> self.bits {
            0 => usize::from(self.guides[(row << self.bits) + next]) + 2 * LANES,
            _ => self.width,
        };
        from + self.row(row)[from..end.clamp(from, self.width)].partition_point(|&last| last < step as i32)
    }

    /// Where a texel starts, and how wide it is, in steps.
    #[inline]
    fn interval(&self, row: usize, column: usize) -> (f64, f64) {
        let at = row * self.width + column;
        let before = if column == 0 { -1 } else { self.lasts[at - 1] };
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
        let rows = 0..self.lasts.len() / self.width;
        let likeliest =
            rows.max_by(|&a, &b| self.marginal.mass(a).total_cmp(&self.marginal.mass(b))).unwrap_or(0);
        let some = self.row(likeliest).iter().step_by(self.width.div_ceil(512));
        let knots = some.map(|&last| (f64::from(last) + 1.0) / STEPS);
        knots.filter(|&xi| xi > 0.0 && xi < 1.0).collect()
    }

    pub(super) fn bytes(&self) -> usize {
        self.marginal.bytes() + size_of_val(&*self.lasts) + size_of_val(&*self.guides)
    }
}

/// Where a variate lies in `[0, 2^31)`, once it is [`inside`].
#[inline]
fn position_of(xi: f64) -> f64 {
    inside(xi) * STEPS
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
