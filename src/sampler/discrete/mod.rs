//! Discrete selection: an index with given probabilities from one variate, in three forms behind one face, [`DiscreteTable`].
//!
//! All have the same integer masses ([`DiscreteCdf`] says how they come about), and search exactly those: the mass reported is the one searched to the
//! last bit, the forms that keep order agree for every variate, and every positive weight can be drawn.

mod alias;
mod cdf;
mod guide;
mod table;

pub use alias::DiscreteAlias;
pub use cdf::DiscreteCdf;
pub use guide::DiscreteGuide;
pub use table::{DiscreteTable, Form};

pub(super) use alias::AliasCells;
pub(super) use cdf::{Neumaier, STEPS};

use super::{Sample, Sampler};
use crate::domain::{Cell, Discrete};
use crate::random::ONE_MINUS_EPSILON_F64;

/// What a table chose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Choice {
    /// The entry.
    pub index: usize,
    /// Its probability.
    pub mass: f64,
    /// The variate left over: where in the entry's interval (with an alias table, in the part of it that was hit) the variate fell, uniform in
    /// `[0, 1)` given the index.
    pub rest: f64,
}

/// A variate in `[0, 1)`. What lies outside is moved to the nearest end, NaN to 0.
#[inline]
pub(super) fn inside(xi: f64) -> f64 {
    // The smaller and the larger of two numbers as instructions have them, NaN being no less than anything.
    let xi = if xi > 0.0 { xi } else { 0.0 };
    if xi < ONE_MINUS_EPSILON_F64 { xi } else { ONE_MINUS_EPSILON_F64 }
}

/// Where a variate lies in `[0, 2^53)`, once it is [`inside`].
#[inline]
fn position_of(xi: f64) -> f64 {
    inside(xi) * STEPS
}

/// The step of a position: signed on the way, since what converts to it is one instruction.
#[inline]
fn step_at(position: f64) -> u64 {
    position as i64 as u64
}

/// Samples whose memory is waited for together.
pub(super) const BATCH: usize = 32;

/// `out[i]` from `from[i]`: N at a time by `many`, what is left by `one`. Both slices have the same length.
#[inline]
pub(super) fn in_batches<const N: usize, A: Copy, B>(
    from: &[A],
    out: &mut [B],
    many: impl Fn(&[A; N], &mut [B; N]),
    one: impl Fn(A) -> B,
) {
    let (from, from_left) = from.as_chunks::<N>();
    let (out, out_left) = out.as_chunks_mut::<N>();
    for (from, out) in from.iter().zip(out) {
        many(from, out);
    }
    for (&from, out) in from_left.iter().zip(out_left) {
        *out = one(from);
    }
}

/// The same with WIDE at a time first, as long as there are so many.
#[inline]
fn in_wide_batches<const WIDE: usize, A: Copy, B>(
    from: &[A],
    out: &mut [B],
    wide: impl Fn(&[A; WIDE], &mut [B; WIDE]),
    many: impl Fn(&[A; BATCH], &mut [B; BATCH]),
    one: impl Fn(A) -> B,
) {
    let whole = from.len() / WIDE * WIDE;
    let (out_wide, out_few) = out.split_at_mut(whole);
    in_batches(&from[..whole], out_wide, wide, &one);
    in_batches(&from[whole..], out_few, many, one);
}

/// The step of `0..2^53` of 64 random bits.
#[inline]
fn step_of(bits: u64) -> u64 {
    bits >> 11
}

/// The forms as samplers: only what inverts a variate differs.
macro_rules! sampler {
    ($($table:ty),+) => {$(
impl Sampler for $table {
    type Domain = Discrete;

    fn domain(&self) -> Discrete {
        Discrete::new(self.len())
    }

    fn dimensions(&self) -> usize {
        1
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<usize>> {
        let choice = self.choose(xi[0]);
        Some(Sample { point: choice.index, density: choice.mass })
    }

    fn fill(&self, xi: &[f64], samples: &mut [Option<Sample<usize>>]) {
        assert_eq!(xi.len(), samples.len(), "one variate a sample");
        let mut choices = [Choice::default(); 256];
        for (xi, samples) in xi.chunks(256).zip(samples.chunks_mut(256)) {
            let choices = &mut choices[..xi.len()];
            self.choose_all(xi, choices);
            for (sample, choice) in samples.iter_mut().zip(choices) {
                *sample = Some(Sample { point: choice.index, density: choice.mass });
            }
        }
    }

    fn fill_points(&self, xi: &[f64], points: &mut [Option<usize>]) {
        assert_eq!(xi.len(), points.len(), "one variate a point");
        let (mut bits, mut indices) = ([0; 256], [0; 256]);
        for (xi, points) in xi.chunks(256).zip(points.chunks_mut(256)) {
            let (bits, indices) = (&mut bits[..xi.len()], &mut indices[..xi.len()]);
            bits.iter_mut().zip(xi).for_each(|(bits, &xi)| *bits = step_at(position_of(xi)) << 11);
            self.indices(bits, indices);
            points.iter_mut().zip(indices).for_each(|(point, &mut index)| *point = Some(index as usize));
        }
    }

    fn density(&self, index: &usize) -> f64 {
        self.mass(*index)
    }

    fn invert(&self, index: &usize) -> Option<Vec<f64>> {
        (self.mass(*index) > 0.0).then(|| vec![self.variate(*index, 0.5)])
    }

    fn left_over(&self, xi: &[f64]) -> Option<f64> {
        Some(self.choose(xi[0]).rest)
    }

    fn variate_knots(&self, _: usize) -> Vec<f64> {
        self.some_boundaries()
    }

    fn cell_mass(&self, cell: &Cell) -> Option<f64> {
        Some(self.cumulative(cell.patches.end) - self.cumulative(cell.patches.start))
    }
}
    )+};
}
sampler!(DiscreteCdf, DiscreteGuide, DiscreteAlias, DiscreteTable);
