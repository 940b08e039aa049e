//! GGX visible normals, reflected.
//!
//! The microfacet distribution D(m) = 1 / (pi a^2 (x^2/a^2 + y^2/a^2 + z^2)^2) (Walter et al. 2007; Trowbridge and Reitz 1975)
//! with roughness a, seen from w_o: visible normals have the density D_v(m) = G1(w_o) max(0, w_o . m) D(m) / cos theta_o (Heitz, "Sampling the
//! GGX Distribution of Visible Normals", JCGT 2018). They are sampled as spherical caps (Dupuy and Benyoub, "Sampling Visible GGX
//! Normals with Spherical Caps", 2023): w_o is stretched to the hemisphere configuration, a uniform point c of the cap
//! z >= -z_o is added to it, and the sum is stretched back. The reflected direction w_i has the density D_v / (4 w_o . m), that is
//! G1(w_o) D(m) / (4 cos theta_o) per solid angle. Reflections under the surface are rejected.

use super::{Error, Sample, Sampler, checked};
use crate::domain::Hemisphere;
use crate::random::to_f32;
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Directions w_i that a GGX surface of roughness `alpha` reflects w_o into, by its visible normals.
///
/// ```
/// use warpcheck::sampler::GgxVisibleNormals;
/// let lobe = GgxVisibleNormals::new(glam::Vec3::new(0.6, 0.0, 0.8), 0.1)?;
/// let w = lobe.sample(glam::Vec2::new(0.3, 0.7)).unwrap();
/// assert!(lobe.density(w) > 0.0);
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GgxVisibleNormals {
    outgoing: Vec3,
    alpha: f32,
    /// G1(w_o) / (4 cos theta_o), formed without a division by the cosine.
    visible: f32,
}

impl GgxVisibleNormals {
    /// The lobe seen from `outgoing`, a unit vector in the frame whose +Z is the surface normal.
    ///
    /// # Errors
    /// Unless alpha is in 1e-4..=1, and `outgoing` of unit length and above the surface.
    pub fn new(outgoing: Vec3, alpha: f32) -> Result<Self, Error> {
        checked("length of the outgoing direction", outgoing.length(), 0.999..=1.001, "1")?;
        checked("cosine of the outgoing direction", outgoing.z, f32::MIN_POSITIVE..=1.001, "above 0")?;
        let alpha = checked("alpha", alpha, 1e-4..=1.0, "from 1e-4 to 1")?;
        let outgoing = outgoing.normalize();
        // G1 = 2 z / (z + sqrt(z^2 + a^2 (x^2 + y^2))), Heitz 2014, eq. 71 and 72.
        let slope = alpha * alpha * outgoing.truncate().length_squared();
        let visible = 0.5 / (outgoing.z + (outgoing.z * outgoing.z + slope).sqrt());
        Ok(Self { outgoing, alpha, visible })
    }

    /// The visible microfacet normal for variates in `[0, 1)`.
    #[inline]
    pub fn normal(&self, xi: Vec2) -> Vec3 {
        let a = self.alpha;
        let o = (self.outgoing * Vec3::new(a, a, 1.0)).normalize();
        let (sin, cos) = (TAU * xi.x).sin_cos();
        // The height of the cap's point above its foot, and its drop below the pole: z itself would cancel in both.
        let (height, drop) = ((1.0 - xi.y) * (1.0 + o.z), xi.y * (1.0 + o.z));
        let r = (drop * (2.0 - drop)).max(0.0).sqrt();
        Vec3::new(a * (r * cos + o.x), a * (r * sin + o.y), height).normalize()
    }

    /// The reflected direction for variates in `[0, 1)`; `None` where it falls under the surface.
    #[inline]
    pub fn sample(&self, xi: Vec2) -> Option<Vec3> {
        let m = self.normal(xi);
        let w = (2.0 * self.outgoing.dot(m) * m - self.outgoing).normalize();
        (w.z > 0.0).then_some(w)
    }

    /// Density of the reflected direction, per solid angle; 0 under the surface.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        if w.z <= 0.0 {
            return 0.0;
        }
        // In f64, since opposite directions along the horizon leave a half vector as short as a denormal.
        let m = (w + self.outgoing).as_dvec3().normalize().as_vec3();
        let a2 = self.alpha * self.alpha;
        let t = m.truncate().length_squared() / a2 + m.z * m.z;
        self.visible * FRAC_1_PI / (a2 * t * t)
    }

    /// The BRDF of the surface per steradian over [`density`](Self::density), without Fresnel's factor:
    /// D G2 / (4 cos theta_o cos theta_i) has G2 / (G1(w_o) cos theta_i) times the density, with the height-correlated G2 of Smith
    /// (Heitz 2014, eq. 99) = (o + s_o) / (o s_i + i s_o), o and i the cosines and s = sqrt(z^2 + a^2 (x^2 + y^2)). 0 under the surface.
    #[inline]
    pub fn brdf_over_density(&self, w: Vec3) -> f32 {
        if w.z <= 0.0 {
            return 0.0;
        }
        let both = 0.5 / self.visible;
        let slope = self.alpha * self.alpha * w.truncate().length_squared();
        let (out, inn) = (both - self.outgoing.z, (w.z * w.z + slope).sqrt());
        both / (self.outgoing.z * inn + w.z * out)
    }
}

impl Sampler for GgxVisibleNormals {
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
