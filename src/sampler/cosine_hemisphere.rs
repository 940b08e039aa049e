//! The cosine-weighted hemisphere about +Z.
//!
//! Malley's method: a uniform point of the disk, lifted onto the hemisphere. r = sqrt xi0, phi = 2 pi xi1,
//! z = sqrt(1 - xi0); density cos theta / pi per solid angle (Pharr, Jakob and Humphreys, "Physically Based Rendering",
//! 4th edition, section A.5.3).

use super::{Sample, Sampler};
use crate::domain::Hemisphere;
use crate::random::to_f32;
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Directions with density cos theta / pi per solid angle.
///
/// ```
/// use warpcheck::sampler::CosineHemisphere;
/// let w = CosineHemisphere.sample(glam::Vec2::new(0.0, 0.3));
/// assert_eq!(w, glam::Vec3::Z);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CosineHemisphere;

impl CosineHemisphere {
    /// The direction for variates in `[0, 1)`.
    #[inline]
    pub fn sample(&self, xi: Vec2) -> Vec3 {
        let (sin, cos) = (TAU * xi.y).sin_cos();
        let r = xi.x.sqrt();
        Vec3::new(r * cos, r * sin, (1.0 - xi.x).sqrt())
    }

    /// Density per solid angle; 0 under the horizon.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        w.z.max(0.0) * FRAC_1_PI
    }
}

impl Sampler for CosineHemisphere {
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
        Some(vec![w.x * w.x + w.y * w.y, azimuth_variate(*w)])
    }
}

/// phi / 2 pi in `[0, 1)`.
pub(super) fn azimuth_variate(w: DVec3) -> f64 {
    let turn = w.y.atan2(w.x) / std::f64::consts::TAU;
    if turn < 0.0 { (turn + 1.0).min(crate::random::ONE_MINUS_EPSILON_F64) } else { turn }
}
