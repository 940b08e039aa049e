//! Uniform directions on the hemisphere about +Z and on the whole sphere.
//!
//! Archimedes: equal steps in z cut equal areas. Hemisphere: z = 1 - xi0, density 1 / 2 pi; sphere: z = 1 - 2 xi0, density
//! 1 / 4 pi, per solid angle. sin theta = sqrt((1 - z)(1 + z)) is formed from xi0, not from a rounded z, so that nothing
//! cancels near a pole (Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th edition, section A.5.2).

use super::cosine_hemisphere::azimuth_variate;
use super::{Sample, Sampler};
use crate::domain::{Hemisphere, Sphere};
use crate::random::to_f32;
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Directions of the upper hemisphere, density 1 / 2 pi per solid angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UniformHemisphere;

/// All directions, density 1 / 4 pi per solid angle.
///
/// ```
/// use warpcheck::sampler::UniformSphere;
/// assert_eq!(UniformSphere.sample(glam::Vec2::new(0.5, 0.0)), glam::Vec3::X);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UniformSphere;

/// The direction 1 - z = `drop` below the pole, at `turn` of the way round.
#[inline]
fn from_drop(drop: f32, turn: f32) -> Vec3 {
    let (sin, cos) = (TAU * turn).sin_cos();
    let r = (drop * (2.0 - drop)).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, 1.0 - drop)
}

/// 1 - z without cancellation near the pole.
fn drop_of(w: DVec3) -> f64 {
    if w.z > 0.0 { (w.x * w.x + w.y * w.y) / (1.0 + w.z) } else { 1.0 - w.z }
}

impl UniformHemisphere {
    /// The direction for variates in `[0, 1)`.
    #[inline]
    pub fn sample(&self, xi: Vec2) -> Vec3 {
        from_drop(xi.x, xi.y)
    }

    /// Density per solid angle; 0 under the horizon.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        if w.z >= 0.0 { 0.5 * FRAC_1_PI } else { 0.0 }
    }
}

impl UniformSphere {
    /// The direction for variates in `[0, 1)`.
    #[inline]
    pub fn sample(&self, xi: Vec2) -> Vec3 {
        from_drop(2.0 * xi.x, xi.y)
    }

    /// Density per solid angle.
    #[inline]
    pub fn density(&self, _: Vec3) -> f32 {
        0.25 * FRAC_1_PI
    }
}

impl Sampler for UniformHemisphere {
    type Domain = Hemisphere;

    fn domain(&self) -> Hemisphere {
        Hemisphere
    }

    fn dimensions(&self) -> usize {
        2
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
        let w = Self::sample(self, Vec2::new(to_f32(xi[0]), to_f32(xi[1])));
        Some(Sample { point: w.as_dvec3(), density: f64::from(Self::density(self, w)) })
    }

    fn density(&self, w: &DVec3) -> f64 {
        f64::from(Self::density(self, w.as_vec3()))
    }

    fn invert(&self, w: &DVec3) -> Option<Vec<f64>> {
        Some(vec![drop_of(*w), azimuth_variate(*w)])
    }
}

impl Sampler for UniformSphere {
    type Domain = Sphere;

    fn domain(&self) -> Sphere {
        Sphere
    }

    fn dimensions(&self) -> usize {
        2
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
        let w = Self::sample(self, Vec2::new(to_f32(xi[0]), to_f32(xi[1])));
        Some(Sample { point: w.as_dvec3(), density: f64::from(Self::density(self, w)) })
    }

    fn density(&self, w: &DVec3) -> f64 {
        f64::from(Self::density(self, w.as_vec3()))
    }

    fn invert(&self, w: &DVec3) -> Option<Vec<f64>> {
        Some(vec![0.5 * drop_of(*w), azimuth_variate(*w)])
    }
}
