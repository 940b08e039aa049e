//! The borders of rows and columns as vectors, to tell the texel of a direction without an inverse trigonometric function.
//!
//! A polynomial of error 1e-5 guesses. Where a border is closer than that, the direction is held against it: theta >= theta_k where
//! sin theta cos theta_k - cos theta sin theta_k >= 0, and likewise for phi. So the answer has the error of one cross product, 2e-16, and not that
//! of the guess.

use super::turns;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Borders of the rows and columns of a latitude-longitude picture.
#[derive(Clone, Debug)]
pub(crate) struct LatLong {
    /// (cos, sin) of theta_0 … theta_H.
    rows: Box<[DVec2]>,
    /// (cos, sin) of phi_0 … phi_W.
    columns: Box<[DVec2]>,
}

impl LatLong {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let edges = |count: usize, range: f64| {
            (0..=count).map(|k| DVec2::from_angle(range * k as f64 / count as f64)).collect()
        };
        Self { rows: edges(height, PI), columns: edges(width, TAU) }
    }

    /// The (column, row) of a direction, and the sine of its theta.
    #[inline]
    pub(crate) fn texel_of(&self, w: DVec3) -> (usize, usize, f64) {
        let sine = (w.x * w.x + w.y * w.y).sqrt();
        let row = find(&self.rows, 2.0 * turns::about(sine, w.z), 2.0 * turns::ERROR, DVec2::new(w.z, sine));
        let column = find(&self.columns, turns::about(w.y, w.x), turns::ERROR, DVec2::new(w.x, w.y));
        (column, row, sine)
    }

    /// The (column, row) of each direction, as [`texel_of`](Self::texel_of) has them: what it does without a branch for all, then the rest.
    #[inline]
    pub(crate) fn texels_of<const N: usize>(&self, [x, y, z]: &[[f64; N]; 3]) -> [(usize, usize); N] {
        let (width, height) = ((self.columns.len() - 1) as f64, (self.rows.len() - 1) as f64);
        let mut sine = [0.0; N];
        for i in 0..N {
            sine[i] = (x[i] * x[i] + y[i] * y[i]).sqrt();
        }
        let (down, around) = (turns::abouts(&sine, z), turns::abouts(y, x));
        let mut texels = [(0, 0); N];
        for i in 0..N {
            let (column, row) = (Guess::new(around[i] * width), Guess::new(2.0 * down[i] * height));
            texels[i] =
                if column.is_certain(turns::ERROR * width) & row.is_certain(2.0 * turns::ERROR * height) {
                    (column.interval, row.interval)
                } else {
                    let (column, row, _) = self.texel_of(DVec3::new(x[i], y[i], z[i]));
                    (column, row)
                };
        }
        texels
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.rows) + size_of_val(&*self.columns)
    }
}

/// About where a vector lies, counted in intervals between edges.
struct Guess {
    interval: usize,
    /// Place in the interval.
    place: f64,
}

impl Guess {
    #[inline(always)]
    fn new(at: f64) -> Self {
        let interval = at as u32;
        Self { interval: interval as usize, place: at - f64::from(interval) }
    }

    /// Whether the interval is the right one if the guess is off by at most so much. Not where the guess is the last edge, nor for NaN.
    #[inline(always)]
    fn is_certain(&self, error: f64) -> bool {
        (self.place > error) & (self.place < 1.0 - error)
    }
}

/// The interval between edges that a vector lies in, at `share` of them, give or take `error`.
#[inline]
fn find(edges: &[DVec2], share: f64, error: f64, v: DVec2) -> usize {
    let count = edges.len() - 1;
    let guess = Guess::new(share * count as f64);
    if guess.is_certain(error * count as f64) {
        return guess.interval;
    }
    // Nobody's guess for NaN: the first.
    let mut k = guess.interval.min(count - 1);
    let passed = |edge: DVec2| edge.perp_dot(v) >= 0.0;
    // The first and the last edge are no matter of sides: for columns they are the same.
    while k > 0 && !passed(edges[k]) {
        k -= 1;
    }
    while k + 1 < count && passed(edges[k + 1]) {
        k += 1;
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Borders and what is within a few roundings of them, the middle of intervals, poles: the guess changes nothing, nor do several at once.
    #[test]
    fn guesses_are_taken_where_they_are_right() {
        for (width, height) in [(1, 1), (2, 1), (3, 2), (64, 32), (1000, 777), (5000, 3)] {
            let texels = LatLong::new(width, height);
            let plain = |edges: &[DVec2], v: DVec2| {
                let inner = &edges[1..edges.len() - 1];
                // Half of a turn at a time, in which sides are in order.
                let later = v.y < 0.0;
                let before = |edge: &&DVec2| match (edge.y < 0.0, later) {
                    (false, true) => true,
                    (true, false) => false,
                    _ => edge.perp_dot(v) >= 0.0,
                };
                inner.iter().take_while(before).count()
            };
            let mut all = Vec::new();
            for k in 0..2000 {
                let part = |k: usize, of: usize| {
                    let (edge, step) = (k * 7919 % (of + 1), (k / 7 % 9) as f64 - 4.0);
                    let off = if k.is_multiple_of(3) { 0.5 } else { step * 10.0_f64.powi(-(k as i32 % 17)) };
                    ((edge as f64 + off) / of as f64).clamp(0.0, 1.0)
                };
                let (sin_theta, cos_theta) = (PI * part(k, height)).sin_cos();
                let (sin_phi, cos_phi) = (TAU * part(k * 31 + 1, width)).sin_cos();
                all.push(DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta));
            }
            for batch in all.as_chunks::<16>().0 {
                let w = [0, 1, 2].map(|axis| batch.map(|w| w[axis]));
                for (&w, found) in batch.iter().zip(texels.texels_of(&w)) {
                    let (column, row, sine) = texels.texel_of(w);
                    assert_eq!((column, row), found, "{w}");
                    assert_eq!(row, plain(&texels.rows, DVec2::new(w.z, sine)), "{width} {height} {w}");
                    // At a pole all columns meet.
                    if sine > 0.0 {
                        assert_eq!(
                            column,
                            plain(&texels.columns, DVec2::new(w.x, w.y)),
                            "{width} {height} {w}"
                        );
                    }
                }
            }
        }
    }
}
