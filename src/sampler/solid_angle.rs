//! From area to solid angle.
//!
//! A point y on a surface with unit normal n_y, seen from x along w = (y - x)/|y - x|: a density per area becomes one per solid angle by
//! p(w) = p(y) |y - x|^2 / (n_y . -w) (Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th edition, eq. 5.6). The difference
//! y - x of two `f32` points is taken in `f64`, where it is exact over all but absurd ranges, and so is what follows.

use glam::{DVec3, Vec3};

/// A surface point as another point sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// From the viewer to the surface, of unit length.
    pub direction: DVec3,
    /// Squared distance.
    pub distance_squared: f64,
    /// n_y . -w: positive where the side of the normal is seen.
    pub cosine: f64,
}

impl View {
    /// How `x` sees the point `y` of a surface whose unit normal there is `normal`; `None` where x = y.
    ///
    /// ```
    /// use glam::Vec3;
    /// use warpcheck::sampler::View;
    /// let view = View::new(Vec3::ZERO, Vec3::new(0.0, 0.0, 2.0), Vec3::NEG_Z).unwrap();
    /// assert_eq!(view.per_solid_angle(0.5), 2.0); // |y - x|^2 / cos = 4
    /// ```
    #[inline]
    pub fn new(x: Vec3, y: Vec3, normal: Vec3) -> Option<Self> {
        Self::along(y.as_dvec3() - x.as_dvec3(), normal)
    }

    /// The same from the difference y - x, for who knows it better than two rounded points do.
    #[inline]
    pub fn along(between: DVec3, normal: Vec3) -> Option<Self> {
        let distance_squared = between.length_squared();
        let direction = between.try_normalize()?;
        Some(Self { direction, distance_squared, cosine: -normal.as_dvec3().dot(direction) })
    }

    /// The density per solid angle of a density per area at the point; 0 for an edge-on or turned-away surface, to which no
    /// direction leads.
    #[inline]
    pub fn per_solid_angle(&self, per_area: f64) -> f64 {
        if self.cosine > 0.0 { per_area * (self.distance_squared / self.cosine) } else { 0.0 }
    }

    /// The density per area at the point of a density per solid angle.
    #[inline]
    pub fn per_area(&self, per_solid_angle: f64) -> f64 {
        per_solid_angle * (self.cosine.max(0.0) / self.distance_squared)
    }

    /// The same point of a surface of which both sides count.
    #[inline]
    pub fn two_sided(self) -> Self {
        Self { cosine: self.cosine.abs(), ..self }
    }
}
