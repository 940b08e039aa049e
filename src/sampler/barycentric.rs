//! The barycentric warp: a uniform point on a triangle from two variates.
//!
//! Low-distortion (Heitz, "A Low-Distortion Map Between Triangle and Square", 2019): the square is folded along its
//! diagonal,
//!
//!   xi0 < xi1:  b0 = xi0 / 2, b1 = xi1 - b0;   otherwise  b1 = xi1 / 2, b0 = xi0 - b1;   b2 = 1 - b0 - b1.
//!
//! The branch compares xi0 with xi1; a widely copied text has xi0 < xi1^2, which leaves the triangle on 1/48 of the square.
//! In both branches b0 + b1 = max(xi0, xi1), so b2 = 1 - max(xi0, xi1) has no rounding to make it negative.
//!
//! Square root (Turk, Graphics Gems, 1990; Osada et al. 2002): b0 = 1 - sqrt xi0, b1 = xi1 sqrt xi0.
//!
//! Both have the density 1 / area, per area.

use super::{Sample, Sampler};
use crate::domain::Triangle;
use crate::random::to_f32;
use glam::{DVec3, Vec2, Vec3};

/// Which map from the unit square to barycentric coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TriangleWarp {
    /// Heitz' fold: nearby variates stay nearby, angles are kept better.
    #[default]
    LowDistortion,
    /// The square root: smooth, but squeezes one side of the square into a vertex.
    SquareRoot,
}

impl TriangleWarp {
    /// Barycentric coordinates (b0, b1, b2) for variates in `[0, 1)`: none negative, summing to 1 up to rounding.
    ///
    /// ```
    /// use warpcheck::sampler::TriangleWarp;
    /// let b = TriangleWarp::LowDistortion.barycentric(glam::Vec2::new(0.25, 0.75));
    /// assert_eq!(b, glam::Vec3::new(0.125, 0.625, 0.25));
    /// ```
    #[inline]
    pub fn barycentric(self, xi: Vec2) -> Vec3 {
        match self {
            Self::LowDistortion => {
                // The fold without its branch, which would be mispredicted every other time: what is taken off is half of the smaller.
                let half = 0.5 * if xi.x < xi.y { xi.x } else { xi.y };
                let larger = if xi.x < xi.y { xi.y } else { xi.x };
                Vec3::new(xi.x - half, xi.y - half, 1.0 - larger)
            }
            Self::SquareRoot => {
                let root = xi.x.sqrt();
                Vec3::new(1.0 - root, xi.y * root, root * (1.0 - xi.y))
            }
        }
    }

    /// [`barycentric`](Self::barycentric) of many variates, to the last bit, in a loop that the compiler vectorises.
    ///
    /// ```
    /// use warpcheck::sampler::TriangleWarp;
    /// use glam::{Vec2, Vec3};
    /// let xi = [Vec2::new(0.25, 0.75), Vec2::new(0.5, 0.125)];
    /// let mut b = [Vec3::ZERO; 2];
    /// TriangleWarp::LowDistortion.barycentric_all(&xi, &mut b);
    /// assert_eq!(b, xi.map(|xi| TriangleWarp::LowDistortion.barycentric(xi)));
    /// ```
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn barycentric_all(self, xi: &[Vec2], out: &mut [Vec3]) {
        assert_eq!(xi.len(), out.len(), "as many pairs of variates as points");
        let pairs = out.iter_mut().zip(xi);
        // Chosen once: the branch is not in the loop.
        match self {
            Self::LowDistortion => pairs.for_each(|(b, &xi)| *b = Self::LowDistortion.barycentric(xi)),
            Self::SquareRoot => pairs.for_each(|(b, &xi)| *b = Self::SquareRoot.barycentric(xi)),
        }
    }

    /// The variates for barycentric coordinates; the inverse of [`barycentric`](Self::barycentric).
    pub fn invert(self, b: Vec3) -> Vec2 {
        match self {
            Self::LowDistortion if b.x < b.y => Vec2::new(2.0 * b.x, b.y + b.x),
            Self::LowDistortion => Vec2::new(b.x + b.y, 2.0 * b.y),
            Self::SquareRoot => {
                let root = b.y + b.z;
                Vec2::new(root * root, if root > 0.0 { b.y / root } else { 0.0 })
            }
        }
    }
}

/// A [`TriangleWarp`] on a triangle of a given area, as a [`Sampler`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarycentricWarp {
    warp: TriangleWarp,
    area: f32,
}

impl BarycentricWarp {
    /// `warp` on a triangle of this area.
    ///
    /// # Errors
    /// Unless the area is positive and finite.
    pub fn new(warp: TriangleWarp, area: f32) -> Result<Self, super::Error> {
        let area = super::checked("area", area, f32::MIN_POSITIVE..=f32::MAX, "positive and finite")?;
        Ok(Self { warp, area })
    }

    /// Density per area, the same everywhere.
    pub fn density(&self) -> f32 {
        1.0 / self.area
    }
}

impl Sampler for BarycentricWarp {
    type Domain = Triangle;

    fn domain(&self) -> Triangle {
        Triangle::with_area(f64::from(self.area))
    }

    fn dimensions(&self) -> usize {
        2
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
        let point = self.warp.barycentric(Vec2::new(to_f32(xi[0]), to_f32(xi[1]))).as_dvec3();
        Some(Sample { point, density: f64::from(self.density()) })
    }

    fn density(&self, _: &DVec3) -> f64 {
        f64::from(self.density())
    }

    fn invert(&self, b: &DVec3) -> Option<Vec<f64>> {
        let xi = self.warp.invert(b.as_vec3());
        Some(vec![f64::from(xi.x), f64::from(xi.y)])
    }
}
