//! Marginal and conditional, each searched with a guide: the order of both variates is kept.
//!
//! The marginal is that of a [`DiscreteCdf`] over the rows. A row's conditional has 2^31 steps and one boundary of 4 bytes a texel, rounded from the running
//! sum and moved by as many steps as it takes to leave every texel that has light at least one; what is stored is the last step before it, which fits
//! into an `i32`, -1 included. A mass is the difference of two of them, exactly.
//!
//! Sixteen boundaries are a line of the cache. The upper 15 bits of each line's last one stand beside them once more: ends of lines, 2 bytes for 16
//! texels, that stay in cache, and are searched with a guide (as in [`DiscreteGuide`](crate::sampler::DiscreteGuide); Chen and Asau 1974): for each of
//! as many buckets of equal width as a row has lines, how many ends lie before it. From there on eight ends are counted, without a branch, which leaves
//! one line of boundaries to be fetched, for all samples of a batch at once, and its texels to be counted. Rows are found likewise, among four.
//!
//! Where eight ends are too few, or 15 bits don't tell a step from an end, the line that was fetched shows it, since all of it is passed; then the rest of the
//! row is searched in halves.

use super::{Found, Weights};
use crate::pages::Pages;
use crate::parallel;
use crate::random::ONE_MINUS_EPSILON_F64;
use crate::sampler::discrete::{Neumaier, STEPS as ROW_STEPS, inside};
use crate::sampler::{DiscreteCdf, Error};

/// 2^31: how many steps a row has.
const STEPS: f64 = 2_147_483_648.0;
/// Boundaries a line.
const LINE: usize = 16;
/// Ends of lines that are counted.
const ENDS: usize = 8;
/// Rows that are counted.
const ROWS: usize = 4;
/// Buckets of the guide to the rows for each of them: at least so many. All of it takes 32 bytes a row at most.
const BUCKETS: usize = 4;

#[derive(Clone, Debug)]
pub(super) struct Rows {
    width: usize,
    marginal: DiscreteCdf,
    /// Where each row starts, in steps of the marginal, and where the last one ends. Filled up by what no step reaches, so that [`ROWS`] can be counted.
    starts: Pages<f64>,
    /// For each bucket of the first variate, the row of its start.
    row_guide: Pages<u32>,
    /// A line that no row needs, and then the last step of each texel or of what is before it, row after row, each filled up to whole lines. A row that
    /// has no light is all -1, and never searched. Before the first texel of a row there always stands 2^31 - 1 or -1.
    lasts: Pages<i32>,
    /// Lines a row.
    lines: usize,
    /// The upper bits of the last boundary of each line, row after row, each filled up so that [`ENDS`] can be counted from any line on.
    ends: Pages<i16>,
    /// How far the rows of `ends` are apart.
    ends_stride: usize,
    /// For each bucket of each row, how many ends lie before it.
    guide: Pages<u16>,
    /// A bucket is the upper bits of a step, and these are the lower ones.
    bucket_bits: u32,
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
        let lines = width.div_ceil(LINE);
        let stride = lines * LINE;
        if height >= u32::MAX as usize / stride {
            let value = (stride * height) as f64;
            return Err(Error::Parameter {
                parameter: "number of texels, rows filled up to multiples of 16",
                value,
                allowed: "under 2^32 with guide tables",
            });
        }
        let sums = parallel::map(height, |row| weights.row(row).fold(Sum::default(), Sum::add));
        let marginal: Vec<f64> = sums.iter().map(|sum| sum.value()).collect();
        let marginal = DiscreteCdf::new(&marginal).map_err(|_| weights.black())?;
        let mut starts = Pages::zeros(height + 1 + ROWS);
        starts.fill(f64::INFINITY);
        // Integers up to 2^53, exactly.
        starts
            .iter_mut()
            .zip(0..=height)
            .for_each(|(start, row)| *start = marginal.cumulative(row) * ROW_STEPS);
        let mut row_guide = Pages::zeros((BUCKETS * height).next_power_of_two());
        let bucket_width = ROW_STEPS / row_guide.len() as f64;
        let mut row = 0;
        for (bucket, first) in row_guide.iter_mut().enumerate() {
            while starts[row + 1] <= bucket as f64 * bucket_width {
                row += 1;
            }
            *first = row as u32;
        }

        let mut lasts = Pages::zeros(LINE + stride * height);
        lasts[..LINE].fill(i32::MAX);
        parallel::chunks_mut(&mut lasts[LINE..], stride, |row, lasts| {
            let (lasts, filling) = lasts.split_at_mut(width);
            fill(lasts, weights, row, &sums[row]);
            filling.fill(i32::MAX);
        });
        let ends_stride = lines + ENDS - 1;
        let mut ends = Pages::zeros(ends_stride * height);
        parallel::chunks_mut(&mut ends, ends_stride, |row, ends| {
            ends.fill(i16::MAX);
            let (lasts, _) = lasts[LINE + row * stride..][..stride].as_chunks::<LINE>();
            ends.iter_mut().zip(lasts).for_each(|(end, line)| *end = upper(line[LINE - 1]));
        });
        let buckets = lines.next_power_of_two();
        let bucket_bits = 31 - buckets.trailing_zeros();
        let mut guide = Pages::zeros(buckets * height);
        parallel::chunks_mut(&mut guide, buckets, |row, guide| {
            let ends = &ends[row * ends_stride..][..lines - 1];
            let mut before = 0;
            for (bucket, first) in (0..).zip(guide) {
                while before < ends.len() && ends[before] < upper(bucket << bucket_bits) {
                    before += 1;
                }
                *first = before as u16;
            }
        });
        Ok(Self { width, marginal, starts, row_guide, lasts, lines, ends, ends_stride, guide, bucket_bits })
    }

    /// The texels for variates of row and column, one after the other.
    #[inline]
    pub(super) fn find<const N: usize>(&self, xi: &[[f64; 2]; N], mut found: impl FnMut(usize, Found)) {
        // Loops and no `map`, which for arrays isn't always compiled in line. Slices once, since pages that are mapped are looked at each time.
        let (starts, row_guide, guide) = (&*self.starts, &*self.row_guide, &*self.guide);
        let (lasts, ends) = (&*self.lasts, &*self.ends);
        let (mut positions, mut steps, mut rows) = ([[0.0; 2]; N], [0; N], [0; N]);
        let buckets = row_guide.len() as f64;
        for i in 0..N {
            let xi = [inside(xi[i][0]), inside(xi[i][1])];
            positions[i] = [xi[0] * ROW_STEPS, xi[1] * STEPS];
            // Unsigned on the way, which takes fewer instructions.
            (rows[i], steps[i]) = ((xi[0] * buckets) as u32, positions[i][1] as u32 as i32);
        }
        for i in 0..N {
            rows[i] = row_guide[rows[i] as usize];
        }
        let mut crowded = false;
        for i in 0..N {
            let next = rows[i] as usize + 1;
            let passed: u32 =
                starts[next..next + ROWS].iter().map(|&start| u32::from(start <= positions[i][0])).sum();
            crowded |= passed == ROWS as u32;
            rows[i] += passed;
        }
        if crowded {
            self.further_rows(&positions, &mut rows);
        }

        // Numbers of lines, and then of boundaries, one less than that of the texel in `lasts`.
        let (mut places, buckets) = ([0; N], 1_u32 << (31 - self.bucket_bits));
        for i in 0..N {
            let bucket = steps[i] as u32 >> self.bucket_bits;
            places[i] = u32::from(guide[(rows[i] * buckets + bucket) as usize]);
        }
        let (lines, stride) = (self.lines as u32, self.ends_stride as u32);
        for i in 0..N {
            let first = (rows[i] * stride + places[i]) as usize;
            places[i] += rows[i] * lines + 1 + count_ends(&ends[first..first + ENDS], upper(steps[i]));
        }
        // A loop with nothing else in it waits for many lines at once.
        let (of_line, mut passed) = (lasts.as_chunks::<LINE>().0, false);
        for i in 0..N {
            passed |= of_line[places[i] as usize][LINE - 1] < steps[i];
        }
        let mut counts = [0; N];
        for i in 0..N {
            counts[i] = count(&of_line[places[i] as usize], steps[i]);
        }
        for i in 0..N {
            places[i] = places[i] * LINE as u32 + counts[i] - 1;
        }
        if passed {
            self.further(&rows, &steps, &mut places);
        }
        for i in 0..N {
            let (row, place) = (rows[i] as usize, places[i] as usize);
            let (around, from_to) = (&lasts[place..place + 2], &starts[row..row + 2]);
            let (start, width) = interval_of_lit(around[0], around[1]);
            let (top, height) = (from_to[0], from_to[1] - from_to[0]);
            let [y, x] = positions[i];
            found(
                i,
                Found {
                    column: places[i] - (LINE as u32 - 1) - rows[i] * (lines * LINE as u32),
                    row: rows[i],
                    across: ((x - start) / width).min(ONE_MINUS_EPSILON_F64),
                    down: ((y - top) / height).min(ONE_MINUS_EPSILON_F64),
                    mass: (height * (1.0 / ROW_STEPS)) * (width * (1.0 / STEPS)),
                },
            );
        }
    }

    fn row(&self, row: usize) -> &[i32] {
        &self.lasts[LINE + row * self.lines * LINE..][..self.width]
    }

    /// Rows past those that were counted.
    #[cold]
    fn further_rows(&self, positions: &[[f64; 2]], rows: &mut [u32]) {
        for (row, &[y, _]) in rows.iter_mut().zip(positions) {
            let next = &self.starts[*row as usize + 1..];
            if next[0] <= y {
                *row += next.partition_point(|&start| start <= y) as u32;
            }
        }
    }

    /// Texels past the line that was counted.
    #[cold]
    fn further(&self, rows: &[u32], steps: &[i32], places: &mut [u32]) {
        for ((&row, &step), place) in rows.iter().zip(steps).zip(places) {
            let row = row as usize;
            let (texels, first) = (self.row(row), LINE - 1 + row * self.lines * LINE);
            let column = *place as usize - first;
            if texels[column] < step {
                let (line, x) = (column / LINE, upper(step));
                let ends = &self.ends[row * self.ends_stride..][line..self.lines - 1];
                let from = (line + ends.partition_point(|&end| end < x)) * LINE;
                // Mostly in this line.
                let mut rest = &texels[from..];
                let mut reach = LINE;
                while reach < rest.len() && rest[reach - 1] < step {
                    reach *= 2;
                }
                rest = &rest[..reach.min(rest.len())];
                *place = (first + from + rest.partition_point(|&last| last < step)) as u32;
            }
        }
    }

    /// Where a texel starts, and how wide it is, in steps.
    #[inline(always)]
    fn interval(&self, row: usize, column: usize) -> (f64, f64) {
        let at = LINE + row * self.lines * LINE + column;
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
        let rows = 0..self.marginal.len();
        let likeliest =
            rows.max_by(|&a, &b| self.marginal.mass(a).total_cmp(&self.marginal.mass(b))).unwrap_or(0);
        let some = self.row(likeliest).iter().step_by(self.width.div_ceil(512));
        let knots = some.map(|&last| (f64::from(last) + 1.0) / STEPS);
        knots.filter(|&xi| xi > 0.0 && xi < 1.0).collect()
    }

    pub(super) fn bytes(&self) -> usize {
        self.marginal.bytes()
            + size_of_val(&*self.starts)
            + size_of_val(&*self.row_guide)
            + size_of_val(&*self.lasts)
            + size_of_val(&*self.ends)
            + size_of_val(&*self.guide)
    }
}

/// Where a texel that has light starts and how wide it is, from the last step before it and its own. Before the first texel of a row there is 2^31 - 1, the
/// last step of the row before, or -1, if that has no light; after both of them, modulo 2^31, comes 0. (Black texels at the end of a row have 2^31 - 1 before
/// them too.)
#[inline(always)]
fn interval_of_lit(before: i32, last: i32) -> (f64, f64) {
    let start = before.wrapping_add(1) & i32::MAX;
    (f64::from(start), f64::from(last - start) + 1.0)
}

/// The upper 15 bits of a step, in order; -1 for -1. Differences of two of them fit too.
#[inline]
fn upper(step: i32) -> i16 {
    (step >> 16) as i16
}

/// How many of the ends are below `x`: signs of differences. Comparisons would be made into a mask whose bits are counted, slowly without an instruction
/// for it.
#[inline(always)]
fn count_ends(ends: &[i16], x: i16) -> u32 {
    ends.iter().map(|&end| (end.wrapping_sub(x) as u16) >> 15).sum::<u16>().into()
}

/// How many boundaries of a line are below `x`; both are -1 or more, so that differences don't overflow.
#[inline(always)]
fn count(line: &[i32; LINE], x: i32) -> u32 {
    line.iter().map(|&last| (last.wrapping_sub(x) as u32) >> 31).sum()
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
