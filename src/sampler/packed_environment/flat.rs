//! All texels in one alias table: one memory access, but the order of the first variate is lost.
//!
//! A cell takes 8 bytes ([`AliasCells`]). The masses are integers too, out of 2^53 steps, and aren't stored: they follow from the texel,
//!
//!   m_i = 1 + a + floor(w_i s) + (i < b), 0 where w_i = 0,
//!
//! with s = (2^53 - M) / sum w for the M texels that have light, and a and b such that they sum up to 2^53. So the mass reported is the one that is
//! searched, for nothing but the texel's radiance, which whoever samples it reads anyway; and every texel that has light is drawn.

use super::rows::Sum;
use super::{Found, Weights};
use crate::parallel;
use crate::sampler::Error;
use crate::sampler::discrete::{AliasCells, STEPS};

#[derive(Clone, Debug)]
pub(super) struct Flat {
    shares: Shares,
    cells: AliasCells,
    width: Divisor,
}

/// What turns weights into steps.
#[derive(Clone, Copy, Debug)]
struct Shares {
    scale: f64,
    /// 1 + a.
    least: u64,
    /// b: the texels before it have one step more.
    one_more: usize,
}

impl Shares {
    fn new(weights: &Weights<'_>) -> Result<Self, Error> {
        let height = weights.height();
        let sums = parallel::map(height, |row| weights.row(row).fold(Sum::default(), Sum::add));
        let total = sums.iter().fold(Sum::default(), |total, sum| total.add(sum.value())).value();
        let positive: u64 = sums.iter().map(|sum| u64::from(sum.positive)).sum();
        if positive == 0 {
            return Err(weights.black());
        }
        let mut scale = (STEPS - positive as f64) / total;
        let mut left = None;
        while left.is_none() {
            let steps: u64 =
                parallel::map(height, |row| weights.row(row).map(|w| (w * scale) as u64).sum::<u64>())
                    .into_iter()
                    .sum();
            left = (STEPS as u64).checked_sub(positive + steps);
            // The sum was rounded down: a few steps too many.
            scale = if left.is_none() { scale * (1.0 - 1e-15) } else { scale };
        }
        let left = left.unwrap_or(0);
        // The first texels that have light, `more` of them, get what is left.
        let (least, mut more) = (1 + left / positive, left % positive);
        let mut one_more = 0;
        for (row, sum) in sums.iter().enumerate() {
            if more < u64::from(sum.positive) {
                let lit = |(_, w): &(usize, f64)| *w > 0.0;
                let column =
                    weights.row(row).enumerate().filter(lit).nth(more as usize).map_or(0, |(c, _)| c);
                one_more = row * weights.width() + column;
                break;
            }
            more -= u64::from(sum.positive);
        }
        Ok(Self { scale, least, one_more })
    }

    #[inline]
    fn steps(&self, texel: usize, weight: f64) -> u64 {
        if weight > 0.0 {
            self.least + (weight * self.scale) as u64 + u64::from(texel < self.one_more)
        } else {
            0
        }
    }
}

impl Flat {
    pub(super) fn new(weights: &Weights<'_>) -> Result<Self, Error> {
        let texels = weights.width() * weights.height();
        if texels > u32::MAX as usize {
            let value = texels as f64;
            return Err(Error::Parameter {
                parameter: "number of texels",
                value,
                allowed: "under 2^32 in an alias table",
            });
        }
        let (shares, width) = (Shares::new(weights)?, Divisor::new(weights.width() as u32));
        let cells = AliasCells::new(texels, |i| {
            let (row, column) = width.divide(i as u32);
            shares.steps(i, weights.weight(column, row))
        });
        Ok(Self { shares, cells, width })
    }

    /// The texels for variates, one after the other: the first selects and places across, the second places down. Without their masses.
    #[inline]
    pub(super) fn find<const N: usize>(&self, xi: &[[f64; 2]; N], mut found: impl FnMut(usize, Found)) {
        let mut across = [0.0; N];
        for i in 0..N {
            across[i] = xi[i][0];
        }
        let chosen = self.cells.choose_batch(&across);
        for i in 0..N {
            let (texel, across) = chosen[i];
            let (row, column) = self.width.divide(texel as u32);
            let down = if xi[i][1] > 0.0 { xi[i][1] } else { 0.0 };
            found(i, Found { column: column as u32, row: row as u32, across, down, mass: f64::NAN });
        }
    }

    #[inline]
    pub(super) fn mass(&self, weights: &Weights<'_>, column: usize, row: usize) -> f64 {
        let texel = row * weights.width() + column;
        self.shares.steps(texel, weights.weight(column, row)) as f64 / STEPS
    }

    /// Borders of some cells.
    pub(super) fn knots(&self, dimension: usize) -> Vec<f64> {
        if dimension == 0 { self.cells.some_borders() } else { Vec::new() }
    }

    pub(super) fn bytes(&self) -> usize {
        self.cells.bytes()
    }
}

/// Division by a number known beforehand (Lemire, Kaser and Kurz, "Faster remainder by direct computation", 2019).
#[derive(Clone, Copy, Debug)]
struct Divisor {
    by: u32,
    /// ceil(2^64 / by); unused for 1.
    inverse: u64,
}

impl Divisor {
    fn new(by: u32) -> Self {
        Self { by, inverse: (u64::MAX / u64::from(by)).wrapping_add(1) }
    }

    /// Quotient and remainder.
    #[inline]
    fn divide(self, x: u32) -> (usize, usize) {
        let quotient = match self.by {
            1 => x,
            _ => ((u128::from(self.inverse) * u128::from(x)) >> 64) as u32,
        };
        (quotient as usize, (x - quotient * self.by) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_are_right() {
        for by in [1, 2, 3, 5, 7, 641, 4096, 8192, 65_535, 65_536, u32::MAX] {
            for x in [0, 1, by - 1, by, by.wrapping_add(1), 1 << 25, 4_294_836_225, u32::MAX - 1, u32::MAX] {
                let (quotient, remainder) = Divisor::new(by).divide(x);
                assert_eq!((quotient as u32, remainder as u32), (x / by, x % by), "{x} / {by}");
            }
        }
    }
}
