//! Uniform directions through a triangle: its solid angle, sampled.
//!
//! A triangle with vertices A, B, C (relative to x, of lengths |A|, …, and unit vectors a, b, c) is seen under the solid angle
//!
//!   omega = 2 atan2(|det(A, B, C)| / (|A| |B| |C|), 1 + a . b + b . c + c . a)
//!
//! (Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983), whatever its size; the sum of angles less pi (Girard) has no digits left for
//! small ones. It is sampled as Arvo does ("Stratified Sampling of Spherical Triangles", SIGGRAPH 1995): the first variate picks the point c' on the arc
//! from a to c such that the triangle a, b, c' has the share xi0 of the area, the second a height between b and c', uniform in the cosine. With p the arc
//! from a to b, A the angle at a and E = xi0 omega, the arc q from a to c' has
//!
//!   tan(q / 2) = sin(E / 2) / (tan(p / 2) sin(A - E / 2)),
//!
//! which follows from tan(E / 2) = tan(p / 2) tan(q / 2) sin A / (1 + tan(p / 2) tan(q / 2) cos A) (Todhunter, "Spherical Trigonometry", 1886, article 103)
//! and divides small numbers by small numbers where Arvo's cosines cancel. Differences of vertices are taken before products, in `f64`.

use super::{Sample, Sampler};
use crate::domain::Sphere;
use glam::{DVec3, Vec3};

/// The directions from a point through a triangle, sampled with the density 1 / solid angle per solid angle.
///
/// ```
/// use glam::Vec3;
/// use warpcheck::sampler::SphericalTriangle;
/// let octant = SphericalTriangle::new(Vec3::ZERO, [Vec3::X, Vec3::Y, Vec3::Z]).unwrap();
/// assert!((octant.solid_angle() - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
/// let w = octant.sample([0.3, 0.6]);
/// assert!(w.min_element() >= 0.0 && w.is_normalized());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    /// Unit vectors to the vertices.
    corners: [DVec3; 3],
    /// Normals of the planes through x and the edges, pointing to the inside.
    edges: [DVec3; 3],
    solid_angle: f64,
    /// tan(p / 2), p the arc from a to b.
    half_arc: f64,
    /// The angle at a.
    angle: f64,
    /// Unit tangent at a towards c.
    tangent: DVec3,
}

impl SphericalTriangle {
    /// The triangle as seen from `x`; `None` where it has no solid angle: degenerate, edge-on, not finite, or with `x` in a vertex.
    pub fn new(x: Vec3, vertices: [Vec3; 3]) -> Option<Self> {
        let origin = x.as_dvec3();
        let between = |from: usize, to: usize| vertices[to].as_dvec3() - vertices[from].as_dvec3();
        let [a, b, c] = vertices.map(|v| v.as_dvec3() - origin);
        let corners = [a.try_normalize()?, b.try_normalize()?, c.try_normalize()?];
        // Along unit vectors, so that nothing overflows: a x b = a x (b - a).
        let [ua, ub, uc] = corners;
        let ab = ua.cross(between(0, 1) / b.length());
        let ac = ua.cross(between(0, 2) / c.length());
        let bc = ub.cross(between(1, 2) / c.length());
        let volume = ab.dot(between(0, 2) / c.length());
        let around = 1.0 + ua.dot(ub) + ub.dot(uc) + uc.dot(ua);
        let solid_angle = 2.0 * volume.abs().atan2(around);
        let inward = volume.signum();
        let tangent = ac.cross(ua).try_normalize()?;
        let sound = volume != 0.0 && solid_angle.is_finite() && solid_angle > 0.0;
        sound.then_some(Self {
            corners,
            edges: [inward * ab, inward * bc, -inward * ac],
            solid_angle,
            half_arc: ab.length() / (1.0 + ua.dot(ub)),
            angle: volume.abs().atan2(ab.dot(ac)),
            tangent,
        })
    }

    /// The solid angle, in steradians, up to 2 pi.
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// The direction for two variates in `[0, 1)`, a unit vector.
    #[inline]
    pub fn sample(&self, xi: [f64; 2]) -> DVec3 {
        let [a, b, _] = self.corners;
        let half = 0.5 * xi[0] * self.solid_angle;
        let t = half.sin() / (self.half_arc * (self.angle - half).sin());
        // cos q a + sin q u, as a step from a.
        let (sine, drop) = (2.0 * t / (1.0 + t * t), 2.0 * t * t / (1.0 + t * t));
        let on_arc = a + (sine * self.tangent - drop * a);
        let chord = on_arc - b;
        let drop = xi[1] * 0.5 * chord.length_squared();
        // From b towards the point on the arc, by 1 - cos = drop.
        let towards = (chord + 0.5 * chord.length_squared() * b).normalize_or_zero();
        let w = b + ((drop * (2.0 - drop)).max(0.0).sqrt() * towards - drop * b);
        w.normalize()
    }

    /// Density per solid angle of a unit vector: 1 / solid angle through the triangle, 0 elsewhere.
    #[inline]
    pub fn density(&self, w: DVec3) -> f64 {
        let inside = self.edges.iter().all(|edge| edge.dot(w) >= 0.0);
        if inside { 1.0 / self.solid_angle } else { 0.0 }
    }
}

impl Sampler for SphericalTriangle {
    type Domain = Sphere;

    fn domain(&self) -> Sphere {
        Sphere
    }

    fn dimensions(&self) -> usize {
        2
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
        // Inside by construction, up to the rounding of a direction on an edge.
        Some(Sample { point: Self::sample(self, [xi[0], xi[1]]), density: 1.0 / self.solid_angle })
    }

    fn density(&self, w: &DVec3) -> f64 {
        Self::density(self, *w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{fill_unit, stream};

    #[test]
    fn samples_pass_through_the_triangle() {
        let mut rng = stream(5, "spherical triangle", 0);
        for scale in [1e-7_f32, 1e-3, 1.0, 50.0] {
            let v = [Vec3::new(0.1, 0.0, 1.0), Vec3::new(1.0, 0.3, 0.9), Vec3::new(-0.2, 1.0, 1.2)];
            let v = v.map(|p| Vec3::new(p.x * scale, p.y * scale, p.z));
            let triangle = SphericalTriangle::new(Vec3::ZERO, v).unwrap();
            let mut xi = [0.0; 2];
            for _ in 0..2000 {
                fill_unit(&mut rng, &mut xi);
                let w = triangle.sample(xi);
                assert!(w.is_normalized());
                let widest = triangle.edges.iter().map(|e| e.length()).fold(0.0, f64::max);
                let depth = triangle.edges.iter().map(|e| e.dot(w)).fold(f64::INFINITY, f64::min);
                assert!(depth > -1e-15 * widest.max(1e-3), "{depth:e} at scale {scale}");
            }
        }
    }
}
