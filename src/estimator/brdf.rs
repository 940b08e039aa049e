//! What a material reflects, and directions that follow it.
//!
//! Everything is in the frame of the surface, +Z its shading normal on the side that is looked at; w_o leads to
//! the viewer, r is its mirror image, p_phong(w) = (n + 1) / 2 pi max(0, w . r)^n the normalised Phong lobe
//! ([`PhongLobe`]). Per steradian:
//!
//! - convention `mtl`: f_r = K_d / pi + K_s p_phong, n = N_s;
//! - convention `kd-phong`: f_r = K_d / pi if N_s <= 1, otherwise K_d p_phong with n = N_s and nothing else.
//!
//! A material with a roughness has a GGX lobe D G2 / (4 cos theta_o cos theta_i) ([`GgxVisibleNormals`], Fresnel's factor 1) in place of
//! p_phong in f_r, and its visible normals' density in place of p_phong in what follows. Its albedo is under 1: light that would be
//! scattered twice among the facets is lost.
//!
//! (The lobe is normalised over the sphere about r, not with the cosine of the surface: a mirror direction at
//! normal incidence reflects (n + 1)/(n + 2), and at grazing angles what falls under the surface is lost.
//! Lafortune and Willems 1994 have n + 2.)
//!
//! Directions are drawn from p_brdf = (1 - g) cos theta / pi + g p_phong, where g is the largest channel of the
//! glossy factor over the sum of both largest channels. f_r and p_brdf share one evaluation of the lobe, whose
//! cosine is taken from the chord
//! |w - r|: at n = 1e6 the dot product of two `f32` vectors has no digits left.

use crate::sampler::{CosineHemisphere, GgxVisibleNormals, PhongLobe};
use crate::scene::{Convention, Material};
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Sets of glossy lobes, for code that is compiled once a set: what is not in it is not tested for.
pub(super) type Lobes = u8;
pub(super) const NO_LOBES: Lobes = 0;
pub(super) const PHONG: Lobes = 1;
pub(super) const GGX: Lobes = 2;
pub(super) const ALL_LOBES: Lobes = PHONG | GGX;

/// A material under a convention, for all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflection {
    diffuse: Vec3,
    glossy: Vec3,
    shape: Shape,
    /// g: the probability of drawing from the lobe.
    glossy_share: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Phong { exponent: f32 },
    Ggx { alpha: f32 },
}

#[derive(Clone, Copy, Debug)]
enum Lobe {
    None,
    Phong(PhongLobe),
    Ggx(GgxVisibleNormals),
}

/// A material seen from a direction.
///
/// ```
/// use glam::Vec3;
/// use warpcheck::estimator::Reflection;
/// use warpcheck::scene::{Convention, Material};
/// let grey = Material { kd: Vec3::splat(0.5), ..Material::default() };
/// let brdf = Reflection::new(&grey, Convention::Mtl).seen_from(Vec3::Z);
/// let (value, density) = brdf.evaluate(Vec3::new(0.6, 0.0, 0.8));
/// assert!((value.x - 0.5 / std::f32::consts::PI).abs() < 1e-7);
/// assert!((density - 0.8 / std::f32::consts::PI).abs() < 1e-7);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Brdf {
    reflection: Reflection,
    lobe: Lobe,
}

impl Reflection {
    const BLACK: Self = Self {
        diffuse: Vec3::ZERO,
        glossy: Vec3::ZERO,
        shape: Shape::Phong { exponent: 0.0 },
        glossy_share: 0.0,
    };

    /// How a material reflects under a convention.
    pub fn new(material: &Material, convention: Convention) -> Self {
        let Material { kd, ks, ns, roughness, .. } = *material;
        let (diffuse, glossy) = match convention {
            Convention::Mtl => (kd, ks),
            Convention::KdPhong if ns > 1.0 || roughness.is_some() => (Vec3::ZERO, kd),
            Convention::KdPhong => (kd, Vec3::ZERO),
        };
        let [d, g] = [diffuse, glossy].map(|k| k.max_element());
        let sum = d + g;
        let glossy_share = match () {
            () if !(g > 0.0) => 0.0,
            () if sum < f32::INFINITY => g / sum,
            () => 0.5 * g / (0.5 * d + 0.5 * g),
        };
        let shape = match roughness {
            Some(alpha) => Shape::Ggx { alpha: alpha.clamp(1e-4, 1.0) },
            None => Shape::Phong { exponent: ns.clamp(0.0, f32::MAX) },
        };
        Self { diffuse, glossy, shape, glossy_share }
    }

    /// Whether nothing is reflected.
    pub fn is_black(&self) -> bool {
        self.diffuse == Vec3::ZERO && self.glossy == Vec3::ZERO
    }

    /// The glossy lobe that it has.
    pub(super) fn lobes(&self) -> Lobes {
        match self.shape {
            _ if !(self.glossy_share > 0.0) => NO_LOBES,
            Shape::Phong { .. } => PHONG,
            Shape::Ggx { .. } => GGX,
        }
    }

    /// The share of the hemisphere that the glossy lobe fills, about: the mean of its density over the hemisphere over its largest value.
    pub(super) fn lobe_share(&self) -> Option<f64> {
        match self.shape {
            _ if !(self.glossy_share > 0.0) => None,
            Shape::Phong { exponent } => Some(1.0 / (f64::from(exponent) + 1.0)),
            // Half vectors within alpha of the normal; directions turn twice as fast.
            Shape::Ggx { alpha } => Some((2.0 * f64::from(alpha).powi(2)).min(1.0)),
        }
    }

    /// The BRDF for a viewer in direction `out`, a unit vector; black, and without samples, unless it is above the surface.
    #[inline]
    pub fn seen_from(&self, out: Vec3) -> Brdf {
        self.seen_among::<ALL_LOBES>(out)
    }

    /// The same for who knows that the lobe is in a set.
    #[inline]
    pub(super) fn seen_among<const LOBES: Lobes>(&self, out: Vec3) -> Brdf {
        if !(out.z > 0.0) {
            return Brdf { reflection: Self::BLACK, lobe: Lobe::None };
        }
        let glossy = LOBES != NO_LOBES && self.glossy_share > 0.0;
        let lobe = match self.shape {
            Shape::Phong { exponent } if LOBES & PHONG != 0 && glossy => {
                let mirror = Vec3::new(-out.x, -out.y, out.z);
                PhongLobe::new(mirror, exponent).map_or(Lobe::None, Lobe::Phong)
            }
            Shape::Ggx { alpha } if LOBES & GGX != 0 && glossy => {
                GgxVisibleNormals::new(out, alpha).map_or(Lobe::None, Lobe::Ggx)
            }
            _ => Lobe::None,
        };
        // So near the horizon that there is no lobe, what would be drawn from it is drawn like the rest.
        let glossy_share = if matches!(lobe, Lobe::None) { 0.0 } else { self.glossy_share };
        Brdf { reflection: Self { glossy_share, ..*self }, lobe }
    }
}

impl Brdf {
    /// The BRDF per steradian, without the cosine, and the density per solid angle with which
    /// [`sample`](Self::sample) draws `w`. Both are 0 under the surface.
    #[inline]
    pub fn evaluate(&self, w: Vec3) -> (Vec3, f32) {
        self.evaluate_among::<ALL_LOBES>(w)
    }

    /// The same for who knows that the lobe is in a set.
    #[inline]
    pub(super) fn evaluate_among<const LOBES: Lobes>(&self, w: Vec3) -> (Vec3, f32) {
        if w.z <= 0.0 || self.reflection.is_black() {
            return (Vec3::ZERO, 0.0);
        }
        let Reflection { diffuse, glossy, glossy_share: g, .. } = self.reflection;
        let cosine = (1.0 - g) * CosineHemisphere.density(w);
        match &self.lobe {
            Lobe::Phong(lobe) if LOBES & PHONG != 0 => {
                let phong = lobe.density(w);
                (diffuse * FRAC_1_PI + glossy * phong, cosine + g * phong)
            }
            Lobe::Ggx(lobe) if LOBES & GGX != 0 => {
                let density = lobe.density(w);
                let value = density * lobe.brdf_over_density(w);
                (diffuse * FRAC_1_PI + glossy * value, cosine + g * density)
            }
            _ => (diffuse * FRAC_1_PI, cosine),
        }
    }

    /// The direction for variates in `[0, 1)`, the first of which chooses the lobe; `None` where it falls under
    /// the surface, or if nothing is reflected.
    #[inline]
    pub fn sample(&self, xi: [f32; 3]) -> Option<Vec3> {
        self.sample_among::<ALL_LOBES>(xi)
    }

    /// The same for who knows that the lobe is in a set.
    #[inline]
    pub(super) fn sample_among<const LOBES: Lobes>(&self, xi: [f32; 3]) -> Option<Vec3> {
        if self.reflection.is_black() {
            return None;
        }
        let place = Vec2::new(xi[1], xi[2]);
        match &self.lobe {
            Lobe::Phong(lobe) if LOBES & PHONG != 0 && xi[0] < self.reflection.glossy_share => {
                lobe.sample(place)
            }
            Lobe::Ggx(lobe) if LOBES & GGX != 0 && xi[0] < self.reflection.glossy_share => lobe.sample(place),
            _ => Some(CosineHemisphere.sample(place)),
        }
    }
}
