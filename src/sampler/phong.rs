//! The Phong lobe about a mirror direction.
//!
//! Density (n + 1) / 2 pi cos^n alpha per solid angle, alpha the angle to the mirror direction r, alpha < pi/2 (Lafortune and
//! Willems, "Using the Modified Phong Reflectance Model for Physically Based Rendering", 1994). Inversion gives
//! cos alpha = xi^(1/(n + 1)). `f32` has 195 values of that at n = 1e6 and one at 1e9, so what is computed is the
//! drop 1 - cos alpha = -expm1(ln xi / (n + 1)), and the density is read from the chord: cos alpha = 1 - |w - r|^2 / 2.
//!
//! At n = 1e9 the lobe is 4e-5 rad wide, the smallest angle at which differences of `f32` directions still have two digits. Larger
//! exponents are cut to that, in samples and density alike: a mirror.
//!
//! The part of the lobe under the surface is rejected: the sampler returns nothing, the density is 0 there, and the
//! integral of the density is 1 minus the rejected mass.

use super::{Error, Frame, Sample, Sampler, checked};
use crate::domain::Hemisphere;
use crate::random::to_f32;
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::TAU;

/// The least cosine with the mirror direction.
const RIM: f32 = 5e-7;

/// Directions about a mirror direction with density (n + 1) / 2 pi cos^n alpha per solid angle, above the surface z = 0.
///
/// ```
/// use warpcheck::sampler::PhongLobe;
/// let lobe = PhongLobe::new(glam::Vec3::Z, 1e6)?;
/// let w = lobe.sample(glam::Vec2::new(0.5, 0.0)).unwrap();
/// assert!((w.x - 1.177e-3).abs() < 1e-6); // alpha = sqrt(2 ln 2 / 1e6)
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhongLobe {
    frame: Frame,
    exponent: f32,
}

impl PhongLobe {
    /// Larger exponents are cut to this one.
    pub const LARGEST_EXPONENT: f32 = 1e9;

    /// The lobe of this exponent about `mirror`, a unit vector in the frame whose +Z is the surface normal.
    ///
    /// # Errors
    /// Unless the exponent is finite and at least 0, and `mirror` finite and of unit length.
    pub fn new(mirror: Vec3, exponent: f32) -> Result<Self, Error> {
        checked("length of the mirror direction", mirror.length(), 0.999..=1.001, "1")?;
        let exponent = checked("exponent", exponent, 0.0..=f32::MAX, "finite and at least 0")?;
        Ok(Self { frame: Frame::new(mirror.normalize()), exponent: exponent.min(Self::LARGEST_EXPONENT) })
    }

    /// The direction for variates in `[0, 1)`; `None` where it falls under the surface.
    #[inline]
    pub fn sample(&self, xi: Vec2) -> Option<Vec3> {
        // Off the rim, where the density is 0: farther than the direction is rounded, and than the power underflows.
        let drop = -(xi.x.max(f32::MIN_POSITIVE).ln() / (self.exponent + 1.0)).exp_m1();
        let drop = drop.min(1.0 - RIM);
        let r = (drop * (2.0 - drop)).sqrt();
        let (sin, cos) = (TAU * xi.y).sin_cos();
        let w = self.frame.to_world(Vec3::new(r * cos, r * sin, 1.0 - drop)).normalize();
        (w.z > 0.0).then_some(w)
    }

    /// Density per solid angle; 0 under the surface and behind the lobe.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        // In f64 up to the end: near the rim the power magnifies a rounding by the exponent times the logarithm, 87 at most.
        let (w, normal) = (w.as_dvec3(), self.frame.normal.as_dvec3());
        let drop = 0.5 * (w - normal).length_squared();
        // The chord has the digits near the mirror direction, the dot product has them near the rim, if its terms don't round.
        let log_cosine = if drop < 0.5 { (-drop).ln_1p() } else { w.dot(normal).max(0.0).ln() };
        if w.z <= 0.0 || log_cosine == f64::NEG_INFINITY {
            return 0.0;
        }
        let exponent = f64::from(self.exponent);
        ((exponent + 1.0) / std::f64::consts::TAU * (exponent * log_cosine).exp()) as f32
    }
}

impl Sampler for PhongLobe {
    type Domain = Hemisphere;

    fn domain(&self) -> Hemisphere {
        Hemisphere
    }

    fn dimensions(&self) -> usize {
        2
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
        let w = Self::sample(self, Vec2::new(to_f32(xi[0]), to_f32(xi[1])))?;
        Some(Sample { point: w.as_dvec3(), density: f64::from(Self::density(self, w)) })
    }

    fn density(&self, w: &DVec3) -> f64 {
        f64::from(Self::density(self, w.as_vec3()))
    }
}
