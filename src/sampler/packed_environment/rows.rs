//! Marginal and conditional, each searched with a guide: the order of both variates is kept.
//!
//! The marginal over the rows is a [`DiscreteGuide`]. A row's conditional has 2^31 steps and one boundary of 4 bytes a texel, rounded from the running sum
//! and moved by as many steps as it takes to leave every texel that has light at least one; and a guide with as many buckets as the
//! largest power of two up to the width, 2 bytes each. A mass is the difference of two boundaries, exactly.

use super::{Found, Weights};
use crate::parallel;
use crate::random::ONE_MINUS_EPSILON_F64;
use crate::sampler::{DiscreteGuide, Error};

/// 2^31: how many steps a row has.
const STEPS: u32 = 1 << 31;
/// Boundaries looked at without a branch.
const LANES: usize = 4;

#[derive(Clone, Debug)]
pub(super) struct Rows {
    width: usize,
    marginal: DiscreteGuide,
    /// Where each texel ends, row after row, and some more, so that four can be read anywhere. A row that has no light is all 0, and never searched.
    ends: Box<[u32]>,
    /// The first texel, in its row, that ends after the start of a bucket.
    guides: Box<[u16]>,
    /// The bits of a step below its bucket.
    shift: u32,
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
        let mut ends = vec![0; width * height + LANES - 1].into_boxed_slice();
        parallel::chunks_mut(&mut ends[..width * height], width, |row, ends| {
            fill_ends(ends, weights, row, &sums[row]);
        });
        let buckets = 1 << width.ilog2();
        let shift = 31 - width.ilog2();
        let mut guides = vec![0; buckets * height].into_boxed_slice();
        parallel::chunks_mut(&mut guides, buckets, |row, guide| {
            let ends = &ends[row * width..(row + 1) * width];
            let mut passed = 0;
            for (bucket, first) in guide.iter_mut().enumerate() {
                while passed + 1 < width && u64::from(ends[passed]) <= (bucket as u64) << shift {
                    passed += 1;
                }
                *first = passed as u16;
            }
        });
        Ok(Self { width, marginal, ends, guides, shift })
    }

    /// The texels for variates of row and column.
    #[inline]
    pub(super) fn find<const N: usize>(&self, xi: &[[f64; 2]; N]) -> [Found; N] {
        let rows = self.marginal.choose_batch(&xi.map(|[row, _]| row));
        let positions = xi.map(|[_, column]| position_of(column));
        let mut starts = [0; N];
        for i in 0..N {
            let bucket = (positions[i] as u32 >> self.shift) as usize;
            starts[i] = usize::from(self.guides[(rows[i].index << (31 - self.shift)) + bucket]);
        }
        let mut passed = [0; N];
        for i in 0..N {
            let first = rows[i].index * self.width + starts[i];
            let lanes: &[u32; LANES] = self.ends[first..first + LANES].try_into().expect("four of them");
            let step = positions[i] as u32;
            // Behind the row's end lies the next row: only those before the first that isn't passed count.
            let mut count = 0;
            let mut all = 1;
            for &end in lanes {
                all &= usize::from(end <= step);
                count += all;
            }
            passed[i] = count;
        }
        let mut found = [Found::default(); N];
        for i in 0..N {
            let mut column = starts[i] + passed[i];
            if passed[i] == LANES {
                column = self.crowded(rows[i].index, column, positions[i] as u32);
            }
            let (start, width) = self.interval(rows[i].index, column);
            found[i] = Found {
                column,
                row: rows[i].index,
                across: ((positions[i] - start) / width).min(ONE_MINUS_EPSILON_F64),
                down: rows[i].rest,
                mass: rows[i].mass * (width * (1.0 / f64::from(STEPS))),
            };
        }
        found
    }

    /// The texel where four in a row don't reach.
    #[cold]
    fn crowded(&self, row: usize, from: usize, step: u32) -> usize {
        let bucket = (row << (31 - self.shift)) + (step >> self.shift) as usize;
        let is_last = (step >> self.shift) as usize + 1 == 1 << (31 - self.shift);
        let end = if is_last { self.width } else { usize::from(self.guides[bucket + 1]) + 1 };
        let ends = &self.ends[row * self.width..(row + 1) * self.width];
        from + ends[from..end].partition_point(|&end| end <= step)
    }

    /// Where a texel starts, and how wide it is, in steps.
    #[inline]
    fn interval(&self, row: usize, column: usize) -> (f64, f64) {
        let at = row * self.width + column;
        let start = if column == 0 { 0 } else { self.ends[at - 1] };
        (f64::from(start), f64::from(self.ends[at] - start))
    }

    pub(super) fn mass(&self, column: usize, row: usize) -> f64 {
        self.marginal.mass(row) * (self.interval(row, column).1 * (1.0 / f64::from(STEPS)))
    }

    /// Some of the variates at which row or column change; columns of the likeliest row.
    pub(super) fn knots(&self, dimension: usize) -> Vec<f64> {
        if dimension == 0 {
            return self.marginal.some_boundaries();
        }
        let rows = 0..self.ends.len() / self.width;
        let likeliest =
            rows.max_by(|&a, &b| self.marginal.mass(a).total_cmp(&self.marginal.mass(b))).unwrap_or(0);
        let ends = &self.ends[likeliest * self.width..(likeliest + 1) * self.width];
        let knots =
            ends.iter().step_by(self.width.div_ceil(512)).map(|&end| f64::from(end) / f64::from(STEPS));
        knots.filter(|&xi| xi > 0.0 && xi < 1.0).collect()
    }

    pub(super) fn bytes(&self) -> usize {
        self.marginal.bytes() + size_of_val(&*self.ends) + size_of_val(&*self.guides)
    }
}

/// Where a variate lies in `[0, 2^31)`. What lies outside of `[0, 1)` is moved to the nearest end, NaN to 0.
#[inline]
fn position_of(xi: f64) -> f64 {
    let xi = if xi > 0.0 { xi.min(ONE_MINUS_EPSILON_F64) } else { 0.0 };
    xi * f64::from(STEPS)
}

/// A row's boundaries.
fn fill_ends(ends: &mut [u32], weights: &Weights<'_>, row: usize, total: &Sum) {
    let (mut sum, mut end, mut left) = (Sum::default(), 0, total.positive);
    for (slot, weight) in ends.iter_mut().zip(weights.row(row)) {
        if weight > 0.0 {
            sum = sum.add(weight);
            left -= 1;
            let share = (sum.value() / total.value()).min(1.0);
            let wanted = (share * f64::from(STEPS)).round() as u32;
            // One step at least for it, and for each that follows.
            end = wanted.max(end + 1).min(STEPS - left);
        }
        *slot = end;
    }
}

/// Neumaier's compensated sum, and how many of its terms are positive.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    sum: f64,
    compensation: f64,
    pub(super) positive: u32,
}

impl Sum {
    pub(super) fn add(self, x: f64) -> Self {
        let sum = self.sum + x;
        let lost = if self.sum >= x { (self.sum - sum) + x } else { (x - sum) + self.sum };
        Self { sum, compensation: self.compensation + lost, positive: self.positive + u32::from(x > 0.0) }
    }

    pub(super) fn value(&self) -> f64 {
        self.sum + self.compensation
    }
}
