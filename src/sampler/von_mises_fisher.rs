//! The von Mises-Fisher distribution on the sphere: the Gaussian of directions.
//!
//! Density kappa / (2 pi (1 - e^{-2 kappa})) e^{-kappa (1 - cos alpha)} per solid angle, alpha the angle to the mean direction.
//! Inversion of its CDF in z = cos alpha gives the drop 1 - z = -ln(1 - xi (1 - e^{-2 kappa})) / kappa (Ulrich 1984; stable form
//! after Jakob, "Numerically stable sampling of the von Mises-Fisher distribution on S^2", 2012). The density is read
//! from the chord, 1 - cos alpha = |w - mean|^2 / 2, which keeps its digits at kappa = 1e6, where a dot product in `f32` is 6% off.

use super::{Error, Frame, Sample, Sampler, checked};
use crate::domain::Sphere;
use crate::random::to_f32;
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Directions about a mean direction, the more concentrated the larger kappa.
///
/// ```
/// use warpcheck::sampler::VonMisesFisher;
/// let lobe = VonMisesFisher::new(glam::Vec3::X, 100.0)?;
/// assert!(lobe.sample(glam::Vec2::new(0.5, 0.5)).x > 0.99);
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VonMisesFisher {
    frame: Frame,
    kappa: f32,
    /// 1 - e^{-2 kappa}
    span: f32,
}

impl VonMisesFisher {
    /// About `mean`, a unit vector, with concentration `kappa`.
    ///
    /// # Errors
    /// Unless kappa is in 1e-3..=1e9 and `mean` finite and of unit length.
    pub fn new(mean: Vec3, kappa: f32) -> Result<Self, Error> {
        checked("length of the mean direction", mean.length(), 0.999..=1.001, "1")?;
        let kappa = checked("kappa", kappa, 1e-3..=1e9, "from 1e-3 to 1e9")?;
        Ok(Self { frame: Frame::new(mean.normalize()), kappa, span: -(-2.0 * kappa).exp_m1() })
    }

    /// The direction for variates in `[0, 1)`.
    #[inline]
    pub fn sample(&self, xi: Vec2) -> Vec3 {
        let drop = (-(-xi.x * self.span).ln_1p() / self.kappa).min(2.0);
        let r = (drop * (2.0 - drop)).sqrt();
        let (sin, cos) = (TAU * xi.y).sin_cos();
        self.frame.to_world(Vec3::new(r * cos, r * sin, 1.0 - drop)).normalize()
    }

    /// Density per solid angle.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        let drop = 0.5 * (w - self.frame.normal).length_squared();
        self.kappa / self.span * 0.5 * FRAC_1_PI * (-self.kappa * drop).exp()
    }
}

impl Sampler for VonMisesFisher {
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
}
