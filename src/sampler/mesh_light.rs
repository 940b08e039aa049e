//! A mesh light: triangle selection by area, the barycentric warp, and the conversion to solid angle.
//!
//! A triangle is selected by inversion of the area CDF ([`DiscreteGuide`]), a point on it by the barycentric warp ([`TriangleWarp`]), so the density is
//! mass(i) / area(i) per area: 1 / total area, up to the resolution of the table that is searched. Triangles may also have weights
//! ([`MeshLight::weighted`]: by radiance, so that selection is by power), be selected from outside ([`LightTree`](super::LightTree)), or have the
//! point placed uniformly in their solid angle ([`Placement`]). Seen from x a density per area is converted per
//! solid angle ([`View`]). One-sided triangles emit on the side from which their vertices are counter-clockwise; from the other side, and edge-on, the
//! sample is rejected.
//!
//! Two densities per solid angle exist, and mixing them up is a classic mistake:
//! - of a *point* that was sampled: [`LightSample::density`], of that triangle alone. It is what an estimator needs whose shadow ray must
//!   reach that very triangle.
//! - of a *direction*: a sampler that ignores visibility can generate the same direction through several triangles, so
//!   [`SeenFrom`] sums over every emissive hit along the ray. It is what integrates to 1 (less the rejected mass) over directions.

use super::{DiscreteGuide, Error, Preimage, Sample, Sampler, SphericalTriangle, TriangleWarp, View};
use crate::domain::{MeshSurface, Sphere, SurfacePoint};
use crate::random::to_f32;
use glam::{DVec3, Vec2, Vec3};
use std::borrow::Borrow;

/// Which sides of a triangle emit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// The side from which the vertices are counter-clockwise.
    #[default]
    Front,
    /// Both.
    Both,
}

/// How a point of the selected triangle is placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placement {
    /// Uniform in area.
    #[default]
    Area,
    /// Uniform in the solid angle under which the triangle is seen ([`SphericalTriangle`]).
    SolidAngle,
}

#[derive(Clone, Debug)]
struct Emitter {
    vertices: [Vec3; 3],
    normal: Vec3,
    area: f64,
    sides: Sides,
}

/// Triangles that emit, sampled uniformly by area.
///
/// ```
/// use glam::Vec3;
/// use warpcheck::sampler::{MeshLight, Sides};
/// let quad = [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i: usize| {
///     [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y][i]
/// }));
/// let light = MeshLight::new(&quad, Sides::Front)?;
/// assert_eq!(light.area(), 1.0);
/// let from = Vec3::new(0.5, 0.5, 1.0);
/// let seen = light.sample_from(from, [0.3, 0.5, 0.5]).unwrap();
/// assert!(seen.density >= 1.0 && seen.triangle == 0);
/// assert!(light.sample_from(-from, [0.3, 0.5, 0.5]).is_none()); // from behind
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct MeshLight {
    emitters: Vec<Emitter>,
    table: DiscreteGuide,
    warp: TriangleWarp,
    area: f64,
}

/// A point on a mesh light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// The point.
    pub point: Vec3,
    /// The unit normal of its triangle.
    pub normal: Vec3,
    /// Which triangle.
    pub triangle: usize,
    /// Barycentric coordinates (b0, b1, b2).
    pub barycentric: Vec3,
    /// Density per area; `f32` has no number for that of a triangle 1e38 wide.
    pub density: f64,
}

/// A point on a mesh light, as seen from a point that it lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// The point.
    pub point: Vec3,
    /// Which triangle.
    pub triangle: usize,
    /// Unit vector towards it.
    pub direction: Vec3,
    /// Distance to it.
    pub distance: f32,
    /// Density per solid angle with which this point of this triangle was drawn; of a light 1e20 away it is more than `f32` holds.
    pub density: f64,
}

impl MeshLight {
    /// A light of these triangles, all emitting on these sides. Degenerate triangles are never returned.
    ///
    /// # Errors
    /// Without triangles or area, or if a vertex is not finite.
    pub fn new(triangles: &[[Vec3; 3]], sides: Sides) -> Result<Self, Error> {
        Self::with_sides(triangles.iter().map(|&t| (t, sides)))
    }

    /// A light of triangles each of which says on which sides it emits.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_sides(triangles: impl IntoIterator<Item = ([Vec3; 3], Sides)>) -> Result<Self, Error> {
        Self::weighted(triangles.into_iter().map(|(vertices, sides)| (vertices, sides, 1.0)))
    }

    /// A light of triangles that are selected in proportion to their area times a weight of their own. What weighs 0 is never selected.
    ///
    /// # Errors
    /// As [`new`](Self::new), and if a weight is negative, NaN or infinite.
    pub fn weighted(triangles: impl IntoIterator<Item = ([Vec3; 3], Sides, f64)>) -> Result<Self, Error> {
        let (mut emitters, mut weights) = (Vec::new(), Vec::new());
        for (triangle, (vertices, sides, weight)) in triangles.into_iter().enumerate() {
            if let Some(&vertex) = vertices.iter().find(|v| !v.is_finite()) {
                return Err(Error::Vertex { triangle, vertex });
            }
            let [a, b, c] = vertices.map(|v| v.as_dvec3());
            let cross = (b - a).cross(c - a);
            let normal = cross.normalize_or_zero().as_vec3();
            let area = if normal == Vec3::ZERO { 0.0 } else { 0.5 * cross.length() };
            emitters.push(Emitter { vertices, normal, area, sides });
            weights.push(weight * area);
        }
        let table = DiscreteGuide::new(&weights).map_err(|error| match error {
            Error::AllZero { count } => Error::NoArea { triangles: count },
            other => other,
        })?;
        Ok(Self {
            area: emitters.iter().map(|e| e.area).sum(),
            emitters,
            table,
            warp: TriangleWarp::default(),
        })
    }

    /// The same light with another warp.
    pub fn with_warp(self, warp: TriangleWarp) -> Self {
        Self { warp, ..self }
    }

    /// Total area.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.emitters.len()
    }

    /// Never true: a light without triangles cannot be made.
    pub fn is_empty(&self) -> bool {
        self.emitters.is_empty()
    }

    /// The probability with which a triangle is selected, as the table that is searched has it.
    #[inline]
    pub fn mass(&self, triangle: usize) -> f64 {
        self.table.mass(triangle)
    }

    /// Bytes that the triangles and the table take.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.emitters) + self.table.bytes()
    }

    /// Density per area on a triangle, as the table that is searched has it.
    #[inline]
    pub fn density_on(&self, triangle: usize) -> f64 {
        match self.emitters.get(triangle) {
            Some(emitter) if emitter.area > 0.0 => self.table.mass(triangle) / emitter.area,
            _ => 0.0,
        }
    }

    /// A point on the light for variates in `[0, 1)`: one for the triangle, two for the warp.
    #[inline]
    pub fn sample_surface(&self, xi: [f64; 3]) -> SurfaceSample {
        let choice = self.table.choose(xi[0]);
        self.place(choice.index, choice.mass, [xi[1], xi[2]])
    }

    /// Which triangle a variate in `[0, 1)` selects, and its mass.
    #[inline]
    pub fn select(&self, xi: f64) -> (usize, f64) {
        let choice = self.table.choose(xi);
        (choice.index, choice.mass)
    }

    fn place(&self, triangle: usize, mass: f64, xi: [f64; 2]) -> SurfaceSample {
        let emitter = &self.emitters[triangle];
        let barycentric = self.warp.barycentric(Vec2::new(to_f32(xi[0]), to_f32(xi[1])));
        SurfaceSample {
            point: emitter.at(barycentric, DVec3::ZERO).as_vec3(),
            normal: emitter.normal,
            triangle,
            barycentric,
            density: mass / emitter.area,
        }
    }

    /// A point on the light as seen from `x`, for variates in `[0, 1)`; `None` where the point turns its dark side to `x`, is seen
    /// edge-on, or is `x` itself.
    #[inline]
    pub fn sample_from(&self, x: Vec3, xi: [f64; 3]) -> Option<LightSample> {
        self.sample_selected(x, self.select(xi[0]), Placement::Area, [xi[1], xi[2]])
    }

    /// A point of a triangle that was selected with probability `mass`, by this light or by somebody else, as seen from `x`; `None` as for
    /// [`sample_from`](Self::sample_from).
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    pub fn sample_selected(
        &self,
        x: Vec3,
        (triangle, mass): (usize, f64),
        placement: Placement,
        xi: [f64; 2],
    ) -> Option<LightSample> {
        if placement == Placement::SolidAngle {
            let (seen, normal, plane) = self.emitters[triangle].solid_angle_from(x)?;
            let w = seen.sample(xi);
            let distance = plane / normal.dot(w);
            let found = distance > 0.0 && distance.is_finite();
            return found.then(|| LightSample {
                point: (x.as_dvec3() + distance * w).as_vec3(),
                triangle,
                direction: w.as_vec3(),
                distance: distance as f32,
                density: mass / seen.solid_angle(),
            });
        }
        let s = self.place(triangle, mass, xi);
        let view = self.view(x, &s)?;
        let density = view.per_solid_angle(s.density);
        (density > 0.0).then(|| LightSample {
            point: s.point,
            triangle,
            direction: view.direction.as_vec3(),
            distance: view.distance_squared.sqrt() as f32,
            density,
        })
    }

    /// Density per solid angle, as seen from `x`, with which [`sample_selected`](Self::sample_selected) gives the point `y` of a triangle
    /// selected with probability `mass`. 0 from the dark side.
    #[inline]
    pub fn density_selected(
        &self,
        x: Vec3,
        y: Vec3,
        (triangle, mass): (usize, f64),
        placement: Placement,
    ) -> f64 {
        let Some(emitter) = self.emitters.get(triangle) else { return 0.0 };
        match placement {
            Placement::Area if !(emitter.area > 0.0) => 0.0,
            Placement::Area => {
                let view = View::new(x, y, emitter.normal).map(|v| emitter.seen(v));
                view.map_or(0.0, |v| v.per_solid_angle(mass / emitter.area))
            }
            Placement::SolidAngle => {
                emitter.solid_angle_from(x).map_or(0.0, |(seen, ..)| mass / seen.solid_angle())
            }
        }
    }

    /// Density per solid angle, as seen from `x`, of the point `y` of a triangle: what [`sample_from`](Self::sample_from) gives if it
    /// draws that point. 0 from the dark side.
    #[inline]
    pub fn density_from(&self, x: Vec3, y: Vec3, triangle: usize) -> f64 {
        self.density_selected(x, y, (triangle, self.mass(triangle)), Placement::Area)
    }

    /// From the vertices, not from the rounded point: an ulp of a coordinate is a large angle at a grazing distance.
    fn view(&self, x: Vec3, s: &SurfaceSample) -> Option<View> {
        let emitter = &self.emitters[s.triangle];
        Some(emitter.seen(View::along(emitter.at(s.barycentric, x.as_dvec3()), s.normal)?))
    }

    /// The sampler of directions towards this light from `x`.
    pub fn seen_from(&self, x: Vec3) -> SeenFrom<&Self> {
        SeenFrom::new(self, x)
    }
}

impl Emitter {
    /// The point less `origin`. Rounded coordinates sum to 1 up to 1e-7 only, which is more than the width of a sliver far from the
    /// origin: so two of them multiply edges.
    fn at(&self, b: Vec3, origin: DVec3) -> DVec3 {
        let [v0, v1, v2] = self.vertices.map(|v| v.as_dvec3());
        (v0 - origin) + f64::from(b.y) * (v1 - v0) + f64::from(b.z) * (v2 - v0)
    }

    /// The triangle as `x` sees it, its normal (of any length) and n . (v0 - x); `None` from the dark side and edge-on.
    fn solid_angle_from(&self, x: Vec3) -> Option<(SphericalTriangle, DVec3, f64)> {
        let [v0, v1, v2] = self.vertices.map(|v| v.as_dvec3());
        let normal = (v1 - v0).cross(v2 - v0);
        let plane = normal.dot(v0 - x.as_dvec3());
        let lit = plane < 0.0 || self.sides == Sides::Both;
        let seen = if lit { SphericalTriangle::new(x, self.vertices) } else { None };
        Some((seen?, normal, plane))
    }

    fn seen(&self, view: View) -> View {
        match self.sides {
            Sides::Front => view,
            Sides::Both => view.two_sided(),
        }
    }
}

/// A [`MeshLight`] on its own surface, per area.
impl Sampler for MeshLight {
    type Domain = MeshSurface;

    fn domain(&self) -> MeshSurface {
        MeshSurface::from_areas(self.emitters.iter().map(|e| e.area).collect::<Vec<_>>())
    }

    fn dimensions(&self) -> usize {
        3
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<SurfacePoint>> {
        let s = self.sample_surface([xi[0], xi[1], xi[2]]);
        let point = SurfacePoint { triangle: s.triangle, barycentric: s.barycentric.as_dvec3() };
        Some(Sample { point, density: s.density })
    }

    fn density(&self, point: &SurfacePoint) -> f64 {
        self.density_on(point.triangle)
    }

    fn invert(&self, point: &SurfacePoint) -> Option<Vec<f64>> {
        if self.density_on(point.triangle) == 0.0 {
            return None;
        }
        let xi = self.warp.invert(point.barycentric.as_vec3());
        Some(vec![self.table.variate(point.triangle, 0.5), f64::from(xi.x), f64::from(xi.y)])
    }

    fn preimages(&self, point: &SurfacePoint) -> Option<Vec<Preimage>> {
        Some(vec![Preimage {
            xi: self.invert(point)?,
            selecting: 1,
            weight: self.table.mass(point.triangle),
        }])
    }

    fn left_over(&self, xi: &[f64]) -> Option<f64> {
        Some(self.table.choose(xi[0]).rest)
    }

    fn variate_knots(&self, dimension: usize) -> Vec<f64> {
        if dimension == 0 { self.table.some_boundaries() } else { Vec::new() }
    }
}

/// A mesh light as the directions in which a point sees it, per solid angle.
///
/// Its density sums over every emissive hit along the ray, hidden ones included, since the sampler ignores visibility. A query visits
/// all triangles in a slice of the directions: it is for checks, a renderer asks [`MeshLight::density_from`] about the hit that its own
/// rays found.
#[derive(Clone, Debug)]
pub struct SeenFrom<L = MeshLight> {
    light: L,
    x: Vec3,
    slices: Slices,
}

impl<L: Borrow<MeshLight>> SeenFrom<L> {
    /// The directions from `x` to `light`, which may be owned, borrowed or shared.
    pub fn new(light: L, x: Vec3) -> Self {
        let origin = x.as_dvec3();
        let mesh = light.borrow();
        let cones = mesh.emitters.iter().enumerate().filter_map(|(triangle, emitter)| {
            let cone = Cone::new(emitter, mesh.density_on(triangle), origin);
            let corners = emitter.vertices.map(|v| (v.as_dvec3() - origin).normalize_or_zero());
            // Degenerate triangles span no cone, and a plane through x is seen edge-on.
            (cone.density > 0.0 && cone.plane != 0.0).then_some((cone, corners))
        });
        Self { slices: Slices::new(cones.collect()), light, x }
    }
}

/// The cone of directions from a point through a triangle: three planes through the point, which two neighbours share to the bit, so that
/// no direction slips between them.
#[derive(Clone, Copy, Debug)]
struct Cone {
    /// Normals of the planes through x and the edges, pointing to the inside.
    edges: [DVec3; 3],
    normal: DVec3,
    /// n . (v0 - x), the signed distance of the triangle's plane; negative where its front is seen.
    plane: f64,
    /// Density per area; 0 where no side that emits is seen.
    density: f64,
}

/// Where a ray meets a triangle.
struct Hit {
    distance: f64,
    cosine: f64,
    /// Density per area.
    density: f64,
}

/// Cones by the component of the direction along one axis, the one along which they spread most.
#[derive(Clone, Debug)]
struct Slices {
    axis: usize,
    low: f64,
    per_unit: f64,
    /// The cones that reach into each slice.
    slices: Vec<Vec<u32>>,
    cones: Vec<Cone>,
}

impl Slices {
    fn new(cones: Vec<(Cone, [DVec3; 3])>) -> Self {
        let spread = |axis: usize| {
            let ranges = cones.iter().map(|(_, corners)| range(*corners, axis));
            let whole = ranges.fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
            (axis, whole.0, whole.1)
        };
        let (axis, low, high) =
            (0..3).map(spread).max_by(|a, b| (a.2 - a.1).total_cmp(&(b.2 - b.1))).unwrap_or((0, -1.0, 1.0));
        let count = cones.len().clamp(1, 1024);
        let mut new = Self {
            axis,
            low,
            per_unit: count as f64 / (high - low).max(1e-9),
            slices: vec![Vec::new(); count],
            cones: Vec::new(),
        };
        for (cone, corners) in cones {
            let (from, to) = range(corners, axis);
            for slice in new.slice(from)..=new.slice(to) {
                new.slices[slice].push(new.cones.len() as u32);
            }
            new.cones.push(cone);
        }
        new
    }

    fn slice(&self, component: f64) -> usize {
        (((component - self.low) * self.per_unit) as usize).min(self.slices.len() - 1)
    }

    fn density(&self, w: DVec3) -> f64 {
        self.slices[self.slice(w[self.axis])].iter().map(|&i| self.cones[i as usize].density(w)).sum()
    }

    fn hits(&self, w: DVec3) -> impl Iterator<Item = Hit> {
        self.slices[self.slice(w[self.axis])].iter().filter_map(move |&i| self.cones[i as usize].hit(w))
    }
}

/// Bounds of a component of the unit vectors in a spherical triangle, from the cap about its middle that holds its corners and so its edges.
fn range(corners: [DVec3; 3], axis: usize) -> (f64, f64) {
    let middle = (corners[0] + corners[1] + corners[2]).normalize_or_zero();
    let least = corners.iter().map(|c| c.dot(middle)).fold(1.0, f64::min);
    if least < 0.01 {
        return (-1.0, 1.0); // about as wide as a hemisphere
    }
    let (radius, angle) = (least.acos() + 1e-6, middle[axis].clamp(-1.0, 1.0).acos());
    ((angle + radius).min(std::f64::consts::PI).cos(), (angle - radius).max(0.0).cos())
}

impl Cone {
    fn new(emitter: &Emitter, density: f64, origin: DVec3) -> Self {
        let [a, b, c] = emitter.vertices.map(|v| v.as_dvec3() - origin);
        let normal = emitter.normal.as_dvec3();
        let plane = normal.dot(a);
        let front = plane < 0.0;
        let inward = if front { -1.0 } else { 1.0 };
        let lit = front || emitter.sides == Sides::Both;
        let edges = [a.cross(b), b.cross(c), c.cross(a)].map(|edge| inward * edge);
        Self { edges, normal, plane, density: if lit { density } else { 0.0 } }
    }

    /// What a ray along `w` meets; `None` unless it passes through the triangle.
    #[inline]
    fn hit(&self, w: DVec3) -> Option<Hit> {
        if self.edges.iter().any(|edge| edge.dot(w) < 0.0) {
            return None;
        }
        let cosine = self.normal.dot(w);
        let distance = self.plane / cosine;
        (distance > 0.0).then_some(Hit { distance, cosine: cosine.abs(), density: self.density })
    }

    /// Density per solid angle along `w`; 0 unless `w` passes through the triangle.
    #[inline]
    fn density(&self, w: DVec3) -> f64 {
        self.hit(w).map_or(0.0, |hit| hit.density * (hit.distance * hit.distance / hit.cosine))
    }
}

impl<L: Borrow<MeshLight> + Sync> Sampler for SeenFrom<L> {
    type Domain = Sphere;

    fn domain(&self) -> Sphere {
        Sphere
    }

    fn dimensions(&self) -> usize {
        3
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
        let seen = self.light.borrow().sample_from(self.x, [xi[0], xi[1], xi[2]])?;
        let point = seen.direction.as_dvec3();
        Some(Sample { point, density: self.density(&point) })
    }

    fn density(&self, w: &DVec3) -> f64 {
        self.slices.density(*w)
    }

    fn variate_knots(&self, dimension: usize) -> Vec<f64> {
        self.light.borrow().variate_knots(dimension)
    }

    fn rivals(&self, w: &DVec3) -> Vec<(&'static str, f64)> {
        let sum = |weight: fn(f64, f64) -> f64| {
            self.slices.hits(*w).map(|h| h.density * weight(h.distance, h.cosine)).sum()
        };
        vec![
            ("the cosine at the light left out", sum(|d, _| d * d)),
            ("the cosine at the light multiplied, not divided by", sum(|d, c| d * d * c)),
            ("the distance not squared", sum(|d, c| d / c)),
            ("the distance squared twice", sum(|d, c| d.powi(4) / c)),
            ("the squared distance left out", sum(|_, c| 1.0 / c)),
            ("no conversion from area to solid angle", sum(|_, _| 1.0)),
        ]
    }
}
