//! Do two estimates of the same picture agree?
//!
//! For each block and channel z = (a - b) / sqrt(s_a^2 + s_b^2 + (r m)^2), m = (a + b) / 2, which is standard
//! normal if both estimates are of the same quantity and the means are of many samples. The largest |z| catches
//! what is wrong in one place. An error that is small everywhere hides in it: a hundred blocks that are all 2 %
//! too bright, each known to 2 %. So the mean over the blocks of the relative difference d = (a - b) / m is
//! judged as well, channel by channel, which gains a factor of sqrt(blocks). (Not the mean of z, nor weights 1
//! / s^2: where radiance has a heavy tail, the blocks that came out too dark also claim too small an error, and
//! would pull it down.)
//!
//! The p-value is the smallest of all these tests, corrected for their number (Šidák). The channels of a block
//! depend on each other, which makes that correction a little too careful.
//!
//! A mean that hangs on few samples has no normal distribution, and no standard error to trust: what neither
//! estimate has seen is not in it. Blocks where either has fewer than [`Rules::least_effective`] samples that
//! count ([`Blocks::effective`]) are left out and counted. Where they are more than what was compared, agreement of the others says
//! nothing about the picture: a lamp that hardly a direction of the BRDF meets is neither right nor wrong, it is unseen ([`Judgement`]).

use super::{Blocks, Error};
use crate::statistics::{multiplicity::sidak, normal};
use std::fmt;

/// When blocks are compared, and what is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// How many samples a mean has to hang on; 100 by default.
    pub least_effective: f64,
    /// r: a relative error that neither standard error knows of, added in quadrature. At least 1e-6 is allowed
    /// in any case, for the rounding of `f32` radiance.
    pub allowance: f64,
}

impl Default for Rules {
    fn default() -> Self {
        Self { least_effective: 100.0, allowance: 0.0 }
    }
}

/// What a comparison leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judgement {
    /// No difference that chance would not make.
    Agree,
    /// They are not of the same quantity.
    Differ,
    /// Most of what was to be compared hangs on too few samples, or there was nothing.
    Inconclusive,
}

/// One block in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Column of blocks.
    pub column: usize,
    /// Row of blocks.
    pub row: usize,
    /// 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// Difference over its standard error.
    pub z: f64,
}

/// How well two estimates agree.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// How many blocks were compared, each channel counted.
    pub compared: usize,
    /// How many were left out on request.
    pub left_out: usize,
    /// How many hang on too few samples.
    pub too_few: usize,
    /// The largest |z|.
    pub largest: Option<Deviation>,
    /// The mean of z^2 over what was compared: near 1 if the standard errors are right.
    pub mean_square: f64,
    /// Mean relative difference first - second, and its standard error, by channel; NaN where nothing was
    /// compared.
    pub brightness: [(f64, f64); 3],
    /// The probability of something at least as unlikely by chance, corrected for the number of tests.
    pub p: f64,
}

impl Agreement {
    /// What the comparison leads to at a level such as 1e-3.
    pub fn judgement(&self, level: f64) -> Judgement {
        match () {
            () if self.compared > 0 && !(self.p >= level) => Judgement::Differ,
            () if self.too_few >= self.compared => Judgement::Inconclusive,
            () => Judgement::Agree,
        }
    }

    /// Whether the two agree, at a level such as 1e-3, where they were compared. No if there was nothing to compare.
    pub fn agrees(&self, level: f64) -> bool {
        self.compared > 0 && self.p >= level
    }

    /// The smallest relative error of the brightness, the same everywhere, that is judged wrong at this level
    /// more often than not: what agreement rules out.
    pub fn would_catch(&self, level: f64) -> f64 {
        let single = level / (self.compared + 3) as f64;
        let z = normal::isf(single / 2.0).unwrap_or(f64::NAN);
        self.brightness.iter().map(|&(_, error)| z * error).fold(f64::INFINITY, f64::min)
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Some(worst) = self.largest else { return write!(f, "nothing to compare") };
        let channel = ["red", "green", "blue"][worst.channel];
        write!(
            f,
            "{} compared, {} left out, {} with too few samples; ",
            self.compared, self.left_out, self.too_few
        )?;
        write!(f, "largest |z| {:.2} at block ({}, {}) {channel}; ", worst.z.abs(), worst.column, worst.row)?;
        write!(f, "mean z^2 {:.2}; brightness", self.mean_square)?;
        self.brightness.iter().try_for_each(|(d, e)| write!(f, " {:+.2}±{:.2}%", 100.0 * d, 100.0 * e))?;
        write!(f, "; p = {:.2e}", self.p)
    }
}

/// Compares two independent estimates of the same picture, leaving out the blocks (column, row) for which
/// `leave_out` says so.
///
/// ```
/// use warpcheck::estimator::{Blocks, Rules, compare};
/// let flat = |mean| Blocks {
///     size: 16, columns: 8, rows: 8,
///     means: vec![[mean; 3]; 64],
///     standard_errors: vec![[0.01; 3]; 64],
///     effective: vec![[1e4; 3]; 64],
/// };
/// let judged = compare(&flat(1.02), &flat(1.0), Rules::default(), |_, _| false)?;
/// assert!(judged.largest.unwrap().z < 1.5); // no block gives it away, all of them together do
/// assert!(!judged.agrees(1e-3));
/// # Ok::<(), warpcheck::estimator::Error>(())
/// ```
///
/// # Errors
/// If the blocks are not the same.
pub fn compare(
    first: &Blocks,
    second: &Blocks,
    rules: Rules,
    leave_out: impl Fn(usize, usize) -> bool,
) -> Result<Agreement, Error> {
    let [a, b] = [first, second].map(|x| [x.columns, x.rows, x.size]);
    if a != b {
        return Err(Error::Shape { first: a, second: b });
    }
    let allowance = rules.allowance.max(1e-6);
    let (mut compared, mut left_out, mut too_few) = (0, 0, 0);
    let mut largest: Option<Deviation> = None;
    let mut squares = 0.0;
    let mut relative = [(0.0, 0.0, 0.0); 3]; // number, sum of differences, sum of variances
    for block in 0..first.means.len() {
        let (column, row) = (block % first.columns, block / first.columns);
        if leave_out(column, row) {
            left_out += 3;
            continue;
        }
        for (channel, (number, sum, variance)) in relative.iter_mut().enumerate() {
            let of = |x: &Blocks| (x.means[block][channel], x.standard_errors[block][channel]);
            let ((a, sa), (b, sb)) = (of(first), of(second));
            if first.effective[block][channel].min(second.effective[block][channel]) < rules.least_effective {
                too_few += 1;
                continue;
            }
            let mean = 0.5 * (a + b);
            let random = sa * sa + sb * sb;
            let error = (random + (allowance * mean).powi(2)).sqrt();
            let z = if a == b { 0.0 } else { (a - b) / error };
            let z = if z.is_nan() { f64::INFINITY } else { z };
            compared += 1;
            squares += z * z;
            if largest.is_none_or(|l| z.abs() > l.z.abs()) {
                largest = Some(Deviation { column, row, channel, z });
            }
            // What is known to no better than a tenth would only blur the mean.
            if random.sqrt() < 0.1 * mean {
                *number += 1.0;
                *sum += (a - b) / mean;
                *variance += random / (mean * mean);
            }
        }
    }
    // What all blocks have in common does not average out.
    let brightness =
        relative.map(|(n, sum, variance)| (sum / n, (variance / (n * n) + allowance * allowance).sqrt()));
    let overall = brightness.iter().map(|(d, e)| (d / e).abs()).filter(|z| !z.is_nan());
    let extreme = overall.fold(largest.map_or(0.0, |l| l.z.abs()), f64::max);
    let p = sidak((2.0 * normal::sf(extreme)).min(1.0), compared as u64 + 3).unwrap_or(0.0);
    Ok(Agreement {
        compared,
        left_out,
        too_few,
        largest,
        mean_square: squares / compared as f64,
        brightness,
        p,
    })
}
