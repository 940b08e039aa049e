//! The density of an environment map, straight from its definition: luminance over the integral of luminance, by plain sums.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// What the density per solid angle of a sampled map should be.
#[derive(Clone, Debug)]
pub struct EnvironmentOracle {
    width: usize,
    height: usize,
    luminance: Vec<f64>,
}

impl EnvironmentOracle {
    /// Of `width` x `height` RGB texels, row 0 at theta = 0.
    pub fn new(width: usize, height: usize, texels: &[[f32; 3]]) -> Self {
        let weights = [0.2126, 0.7152, 0.0722];
        let luminance = texels.iter().map(|t| (0..3).map(|c| weights[c] * f64::from(t[c])).sum()).collect();
        Self { width, height, luminance }
    }

    fn row(&self, row: usize) -> f64 {
        self.luminance[row * self.width..(row + 1) * self.width].iter().sum()
    }

    fn texel(&self, w: DVec3) -> (f64, f64, usize) {
        // From the dot product, not from atan2, which the sampler uses; not near the poles.
        let theta = w.z.clamp(-1.0, 1.0).acos();
        let phi = w.y.atan2(w.x).rem_euclid(TAU);
        let row = ((theta / PI * self.height as f64) as usize).min(self.height - 1);
        let column = ((phi / TAU * self.width as f64) as usize).min(self.width - 1);
        (self.luminance[row * self.width + column], theta, row)
    }

    /// Piecewise constant per solid angle: L / sum over texels of L times their solid angle.
    pub fn uniform_cos_theta(&self, w: DVec3) -> f64 {
        let band = |row: usize| {
            let edge = |k: usize| (k as f64 * PI / self.height as f64).cos();
            TAU / self.width as f64 * (edge(row) - edge(row + 1))
        };
        let integral: f64 = (0..self.height).map(|row| self.row(row) * band(row)).sum();
        self.texel(w).0 / integral
    }

    /// Piecewise constant per uv, weighted by the sine at the middle of the row.
    pub fn uniform_v(&self, w: DVec3) -> f64 {
        let sine = |row: usize| ((row as f64 + 0.5) * PI / self.height as f64).sin();
        let sum: f64 = (0..self.height).map(|row| self.row(row) * sine(row)).sum();
        let (luminance, theta, row) = self.texel(w);
        luminance * sine(row) / sum * (self.width * self.height) as f64 / (2.0 * PI * PI * theta.sin())
    }
}
