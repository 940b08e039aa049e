//! The density of an environment map, straight from its definition: luminance over the integral of luminance, by plain sums.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// What the density per solid angle of a sampled map should be.
#[derive(Clone, Debug)]
pub struct EnvironmentOracle {
    width: usize,
    height: usize,
    luminance: Vec<f64>,
    /// Over the texels: L times solid angle, and L times the sine at the middle of the row.
    sums: [f64; 2],
}

impl EnvironmentOracle {
    /// Of `width` x `height` RGB texels, row 0 at theta = 0.
    pub fn new(width: usize, height: usize, texels: &[[f32; 3]]) -> Self {
        let weights = [0.2126, 0.7152, 0.0722];
        let luminance = texels.iter().map(|t| (0..3).map(|c| weights[c] * f64::from(t[c])).sum()).collect();
        let mut new = Self { width, height, luminance, sums: [0.0; 2] };
        let of =
            |weight: fn(&Self, usize) -> f64| (0..height).map(|row| new.row(row) * weight(&new, row)).sum();
        new.sums = [of(Self::texel_solid_angle), of(Self::sine)];
        new
    }

    fn row(&self, row: usize) -> f64 {
        self.luminance[row * self.width..(row + 1) * self.width].iter().sum()
    }

    fn texel_solid_angle(&self, row: usize) -> f64 {
        let edge = |k: usize| (k as f64 * PI / self.height as f64).cos();
        TAU / self.width as f64 * (edge(row) - edge(row + 1))
    }

    /// At the middle of a row.
    fn sine(&self, row: usize) -> f64 {
        ((row as f64 + 0.5) * PI / self.height as f64).sin()
    }

    fn texel(&self, w: DVec3) -> (f64, f64, usize) {
        // From the dot product, not from atan2, which the sampler uses; not near the poles.
        let theta = (w.z / w.length()).clamp(-1.0, 1.0).acos();
        let phi = w.y.atan2(w.x).rem_euclid(TAU);
        let row = ((theta / PI * self.height as f64) as usize).min(self.height - 1);
        let column = ((phi / TAU * self.width as f64) as usize).min(self.width - 1);
        (self.luminance[row * self.width + column], theta, row)
    }

    /// Piecewise constant per solid angle: L / sum over texels of L times their solid angle.
    pub fn uniform_cos_theta(&self, w: DVec3) -> f64 {
        self.texel(w).0 / self.sums[0]
    }

    /// Piecewise constant per uv, weighted by the sine at the middle of the row.
    pub fn uniform_v(&self, w: DVec3) -> f64 {
        let (luminance, theta, row) = self.texel(w);
        luminance * self.sine(row) / self.sums[1] * (self.width * self.height) as f64
            / (2.0 * PI * PI * theta.sin())
    }
}
