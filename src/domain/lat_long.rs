//! The borders of rows and columns as vectors, to tell the texel of a direction without an inverse trigonometric function.
//!
//! A polynomial of error 1e-5 guesses; then the direction is held against the borders beside it: theta >= theta_k where
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
        let row = find(&self.rows, 2.0 * turns::about(sine as f32, w.z as f32), DVec2::new(w.z, sine));
        let column = find(&self.columns, turns::about(w.y as f32, w.x as f32), DVec2::new(w.x, w.y));
        (column, row, sine)
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.rows) + size_of_val(&*self.columns)
    }
}

/// The interval between edges that a vector lies in, at about `share` of them.
#[inline]
fn find(edges: &[DVec2], share: f32, v: DVec2) -> usize {
    let count = edges.len() - 1;
    // Nobody's guess for NaN: the first.
    let mut k = ((share * count as f32) as u32 as usize).min(count - 1);
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
