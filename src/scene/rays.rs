//! What a ray meets: the queries, and two ways to answer them.
//!
//! [`Bvh`] is the fast one (a binary tree from `obvhs`, our own watertight triangle test), [`TriangleList`] the same test on
//! every triangle ([`Rays`] is one of both), [`BruteForce`] the obvious
//! one that judges them. A renderer with a faster library implements [`RayQueries`] and changes nothing else.

use glam::{DVec3, Vec3, Vec3A};
use obvhs::{
    Boundable,
    aabb::Aabb,
    bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
    ray::RayHit,
};
use std::fmt;

/// A ray `origin + t direction` for t in (0, `t_max`]; t is a distance if the direction is a unit vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; any length but 0.
    pub direction: Vec3,
    /// Where it ends, in lengths of `direction`.
    pub t_max: f32,
    /// The triangle it starts from, which it cannot hit.
    pub from: Option<u32>,
}

impl Ray {
    /// An endless ray from a point in free space, such as a camera's eye.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY, from: None }
    }

    /// The same ray up to `t_max`.
    pub fn until(self, t_max: f32) -> Self {
        Self { t_max, ..self }
    }

    /// The point at `t`, rounded once.
    pub fn at(&self, t: f32) -> Vec3 {
        (self.origin.as_dvec3() + t as f64 * self.direction.as_dvec3()).as_vec3()
    }
}

/// Where a ray meets a triangle `a b c`: at `(1 - u - v) a + u b + v c`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the triangle.
    pub triangle: u32,
    /// Position on the ray, in lengths of its direction.
    pub t: f32,
    /// Weight of the second vertex, in [0, 1].
    pub u: f32,
    /// Weight of the third vertex, in [0, 1].
    pub v: f32,
}

/// The questions that an estimator asks about a set of triangles.
///
/// Both sides of a triangle can be hit; triangles without an area cannot. A ray that is not finite hits nothing.
pub trait RayQueries: Send + Sync {
    /// The first triangle on the ray. If several are met at the same `t`, any of them, but always the same.
    fn closest(&self, ray: &Ray) -> Option<Hit>;

    /// Whether anything but triangle `but` stands on the ray.
    fn blocked(&self, ray: &Ray, but: Option<u32>) -> bool;

    /// Whether anything stands on the ray.
    fn occluded(&self, ray: &Ray) -> bool {
        self.blocked(ray, None)
    }

    /// Whether a shadow ray from `origin`, a point on triangle `from` (already [offset](offset_origin)) or in free
    /// space, reaches the point `target` on triangle `triangle` before it meets anything else.
    ///
    /// A blocker that is closer to the target than the rounding of the coordinates (2^-21 of the largest) is not told
    /// from the target itself: it is a neighbour that shares an edge. A target that coincides with the origin is not
    /// reached.
    ///
    /// ```
    /// use glam::Vec3;
    /// use warpcheck::scene::{BruteForce, RayQueries};
    /// let floor_and_lamp = [0.0, 2.0].map(|y| [Vec3::new(-9.0, y, -9.0), Vec3::new(0.0, y, 9.0), Vec3::new(9.0, y, -9.0)]);
    /// let rays = BruteForce::new(&floor_and_lamp);
    /// assert!(rays.reaches(Vec3::ZERO, Some(0), Vec3::Y * 2.0, 1));
    /// assert!(!rays.reaches(Vec3::NEG_Y, None, Vec3::Y * 2.0, 1)); // the floor is in the way
    /// ```
    fn reaches(&self, origin: Vec3, from: Option<u32>, target: Vec3, triangle: u32) -> bool {
        let direction = target - origin;
        let size = origin.abs().max(target.abs()).max_element();
        let t_max = 1.0 - size * 2.0_f32.powi(-21) / direction.length();
        // Negated, so that NaN, from a target at the origin, is "no".
        t_max > 0.0 && !self.blocked(&Ray { origin, direction, t_max, from }, Some(triangle))
    }
}

/// Moves a point that was computed on a surface off it, to the side that `normal` points to.
///
/// Wächter and Binder, "A Fast and Robust Method for Avoiding Self-Intersection" (Ray Tracing Gems, 2019, chapter 6):
/// each coordinate moves by 256 ulps times the component of the normal, which follows the rounding error at any scale;
/// close to 0, where ulps vanish but the error of the other coordinates stays, by a fixed length. The paper's fixed
/// length of 2^-16 (below |x| = 2^-5) is meant for scenes a few units wide: here both are multiplied by `unit`, a power
/// of two that [`offset_unit`] takes from the scene's extent, so that a scene in millimetres behaves like one in metres.
///
/// Together with [`Ray::from`], which rules out the starting triangle itself, this keeps a ray from meeting the
/// neighbours of the triangle it leaves. `normal` has to be the geometric one, on the side that the ray leaves.
pub fn offset_origin(point: Vec3, normal: Vec3, unit: f32) -> Vec3 {
    let offset = |x: f32, n: f32| {
        if x.abs() < unit / 32.0 {
            return x + unit / 65536.0 * n;
        }
        let ulps = (256.0 * n) as i32;
        f32::from_bits(x.to_bits().wrapping_add_signed(if x < 0.0 { -ulps } else { ulps }))
    };
    Vec3::new(offset(point.x, normal.x), offset(point.y, normal.y), offset(point.z, normal.z))
}

/// The `unit` of [`offset_origin`] for a scene whose largest coordinate is `extent`: a sixteenth of it, as a power of
/// two. The fixed length is then between 8 and 16 ulps of the largest coordinate.
pub fn offset_unit(extent: f32) -> f32 {
    match extent.is_normal() {
        true => f32::from_bits(extent.abs().to_bits() & 0x7f80_0000) / 16.0,
        false => 1.0,
    }
}

/// A ray with the shear that maps it onto the z axis.
///
/// Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2(1), 2013), in f64: a ray cannot slip between
/// two triangles that share an edge, since both see the same three roundings of the edge function with opposite signs.
struct Sheared {
    /// Along the axes.
    origin: [f64; 3],
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Sheared {
    /// `None` if the ray is not finite or has no direction.
    fn new(ray: &Ray) -> Option<Self> {
        let d = ray.direction.as_dvec3().to_array();
        let z = ray.direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let shear = [d[axes[0]] / d[z], d[axes[1]] / d[z], 1.0 / d[z]];
        let usable = ray.origin.is_finite() && ray.direction.is_finite() && d[z] != 0.0;
        let origin = ray.origin.as_dvec3().to_array();
        usable.then_some(Self { origin: axes.map(|axis| origin[axis]), axes, shear })
    }

    /// t, u, v of the intersection with a triangle, for t > 0.
    #[inline]
    fn meet(&self, triangle: &[Vec3; 3]) -> Option<[f64; 3]> {
        let [x, y, z] = self.axes;
        let [sx, sy, sz] = self.shear;
        let [ox, oy, oz] = self.origin;
        let seen = |p: &Vec3| {
            // Where they lie: an array made of them would have to be stored first.
            let p: &[f32; 3] = p.as_ref();
            let [px, py, pz] = [p[x], p[y], p[z]].map(f64::from);
            let depth = pz - oz;
            [px - ox - sx * depth, py - oy - sy * depth, depth]
        };
        let [a, b, c] = [seen(&triangle[0]), seen(&triangle[1]), seen(&triangle[2])];
        let w = [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]];
        if w.iter().any(|&e| e < 0.0) && w.iter().any(|&e| e > 0.0) {
            return None;
        }
        let sum = w[0] + w[1] + w[2];
        let t = (w[0] * a[2] + w[1] * b[2] + w[2] * c[2]) * sz / sum;
        // A triangle seen edge-on has sum 0, and t is NaN or infinite.
        (sum != 0.0 && t > 0.0).then(|| [t, w[1] / sum, w[2] / sum])
    }
}

/// A bounding volume hierarchy over triangles (`obvhs`, a binary tree).
///
/// The binary tree, not the eight-wide one of the same crate: that one lets a ray enter no box closer than 1e-4, in
/// whatever unit the scene is measured, and takes a direction with a component of -0 for one that points the other way.
/// Boxes are padded by 2^-18 of the largest coordinate, so that rounding in the box test loses no triangle; this holds
/// for rays that start not much farther away than the scene is large.
pub struct Bvh {
    tree: Bvh2,
    /// Vertices in the order of the tree's leaves.
    triangles: Vec<[Vec3; 3]>,
}

/// The box of a triangle, widened.
struct Padded(Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Bvh {
    /// Builds the tree; `triangles` are finite world-space vertices, their order gives the ids.
    ///
    /// # Panics
    /// If there are 2^31 triangles or more.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        assert!(triangles.len() < 1 << 31, "a tree holds fewer than 2^31 triangles");
        let padding = extent(triangles) * 2.0_f32.powi(-18);
        let boxes: Vec<_> = triangles
            .iter()
            .map(|t| {
                let bounds = Aabb::from_points(&t.map(Vec3A::from));
                Padded(Aabb { min: bounds.min - padding, max: bounds.max + padding })
            })
            .collect();
        let ids = (0..triangles.len() as u32).collect();
        let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &boxes,
            ids,
            SortPrecision::U64,
            3,
        );
        // obvhs keeps fixed stacks, and panics when they are full: sizes that span many powers of two make trees that
        // are too deep for them. Such a tree is left as it is, and its stack made as large as it needs.
        let depth = |tree: &Bvh2| if tree.nodes.is_empty() { 0 } else { tree.depth(0) };
        if depth(&tree) < 48 {
            let mut reinsertion = ReinsertionOptimizer::default();
            reinsertion.run(&mut tree, 0.05, None);
            collapse(&mut tree, 4, 3.0);
        }
        tree.max_depth = tree.max_depth.max(depth(&tree) + 1);
        let triangles = tree.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
        Self { tree, triangles }
    }
}

impl fmt::Debug for Bvh {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Bvh({} triangles, {} nodes)", self.triangles.len(), self.tree.nodes.len())
    }
}

impl RayQueries for Bvh {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let sheared = Sheared::new(ray)?;
        let (boxed, scale) = box_ray(ray);
        let mut best = None;
        self.tree.ray_traverse(boxed, &mut RayHit::none(), |r, leaf| {
            let triangle = self.tree.primitive_indices[leaf];
            match sheared.meet(&self.triangles[leaf]) {
                Some([t, u, v]) if ((t / scale) as f32) < r.tmax && Some(triangle) != ray.from => {
                    best = Some(Hit { triangle, t: t as f32, u: u as f32, v: v as f32 });
                    (t / scale) as f32
                }
                _ => f32::INFINITY,
            }
        });
        best
    }

    fn blocked(&self, ray: &Ray, but: Option<u32>) -> bool {
        let Some(sheared) = Sheared::new(ray) else { return false };
        let (boxed, scale) = box_ray(ray);
        !self.tree.ray_traverse_miss(boxed, |_, leaf| {
            let triangle = Some(self.tree.primitive_indices[leaf]);
            match sheared.meet(&self.triangles[leaf]) {
                Some([t, _, _]) if triangle != ray.from && triangle != but => (t / scale) as f32,
                _ => f32::INFINITY,
            }
        })
    }
}

/// Every triangle in turn, by the test of [`Bvh`]: the same hits, but for which of two triangles at the same t is named.
#[derive(Clone, Debug)]
pub struct TriangleList(Box<[[Vec3; 3]]>);

impl TriangleList {
    /// `triangles` are finite world-space vertices, their order gives the ids.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        Self(triangles.into())
    }
}

impl RayQueries for TriangleList {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let sheared = Sheared::new(ray)?;
        let mut best: Option<Hit> = None;
        for (triangle, vertices) in (0..).zip(&self.0) {
            let Some([t, u, v]) = sheared.meet(vertices) else { continue };
            let t = t as f32;
            let nearer = best.map_or(t <= ray.t_max, |best| t < best.t);
            if nearer && Some(triangle) != ray.from {
                best = Some(Hit { triangle, t, u: u as f32, v: v as f32 });
            }
        }
        best
    }

    fn blocked(&self, ray: &Ray, but: Option<u32>) -> bool {
        let Some(sheared) = Sheared::new(ray) else { return false };
        (0..).zip(&self.0).any(|(triangle, vertices)| {
            let met = sheared.meet(vertices).is_some_and(|[t, ..]| t as f32 <= ray.t_max);
            met && Some(triangle) != ray.from && Some(triangle) != but
        })
    }
}

/// How ray queries are answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayStructure {
    /// [`TriangleList`].
    List,
    /// [`Bvh`].
    Tree,
}

impl RayStructure {
    /// Up to this many triangles are met one by one. A tree won at two already (`cargo bench --bench plan`, group `rays`: 51 ns a ray
    /// against 90 at 2 triangles, 96 against 220 at 8, 184 against 1040 at 36), since one box spares most rays every triangle; with one
    /// triangle there is nothing to choose from.
    pub const LONGEST_LIST: usize = 1;

    /// The quicker one for so many triangles.
    pub fn for_triangles(count: usize) -> Self {
        if count <= Self::LONGEST_LIST { Self::List } else { Self::Tree }
    }
}

/// A list or a tree.
#[derive(Debug)]
pub enum Rays {
    /// A list.
    List(TriangleList),
    /// A tree.
    Tree(Bvh),
}

impl Rays {
    /// `triangles` are finite world-space vertices, their order gives the ids.
    pub fn new(triangles: &[[Vec3; 3]], structure: RayStructure) -> Self {
        match structure {
            RayStructure::List => Self::List(TriangleList::new(triangles)),
            RayStructure::Tree => Self::Tree(Bvh::new(triangles)),
        }
    }

    /// Which of both.
    pub fn structure(&self) -> RayStructure {
        match self {
            Self::List(_) => RayStructure::List,
            Self::Tree(_) => RayStructure::Tree,
        }
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::List(list) => size_of_val(&*list.0),
            Self::Tree(Bvh { tree, triangles }) => {
                let ids = size_of_val(&*tree.primitive_indices);
                size_of_val(&*tree.nodes) + ids + size_of_val(&**triangles)
            }
        }
    }
}

impl RayQueries for Rays {
    #[inline]
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        match self {
            Self::List(list) => list.closest(ray),
            Self::Tree(tree) => tree.closest(ray),
        }
    }

    #[inline]
    fn blocked(&self, ray: &Ray, but: Option<u32>) -> bool {
        match self {
            Self::List(list) => list.blocked(ray, but),
            Self::Tree(tree) => tree.blocked(ray, but),
        }
    }
}

/// The ray for the box tests, and the power of two that its direction was multiplied by.
///
/// `obvhs` treats components under 1.2e-7 as if they were that large, whatever the length of the direction, so the
/// largest is brought to [1, 2). Its rays leave out their end, ours include it.
fn box_ray(ray: &Ray) -> (obvhs::ray::Ray, f64) {
    let largest = ray.direction.abs().max_element().max(f32::MIN_POSITIVE);
    let scale = 1.0 / f32::from_bits(largest.to_bits() & 0x7f80_0000);
    let (origin, direction) = (ray.origin.into(), (ray.direction * scale).into());
    (obvhs::ray::Ray::new(origin, direction, 0.0, (ray.t_max / scale).next_up()), scale as f64)
}

/// The largest coordinate, without its sign.
pub(super) fn extent(triangles: &[[Vec3; 3]]) -> f32 {
    triangles.iter().flatten().fold(0.0, |m, p| p.abs().max_element().max(m))
}

/// Every triangle in turn, in f64 (Möller and Trumbore 1997): the oracle for other implementations.
#[derive(Clone, Debug)]
pub struct BruteForce(Vec<[DVec3; 3]>);

impl BruteForce {
    /// `triangles` are world-space vertices, their order gives the ids.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        Self(triangles.iter().map(|t| t.map(|p| p.as_dvec3())).collect())
    }

    fn hits(&self, ray: &Ray) -> impl Iterator<Item = (u32, f64, f64, f64)> {
        let Ray { origin, direction, t_max, from } = *ray;
        let (origin, direction) = (origin.as_dvec3(), direction.as_dvec3());
        self.0.iter().zip(0..).filter(move |(_, id)| Some(*id) != from).filter_map(move |([a, b, c], id)| {
            let (e1, e2, s) = (b - a, c - a, origin - a);
            let (p, q) = (direction.cross(e2), s.cross(e1));
            let det = e1.dot(p);
            let [t, u, v] = [e2.dot(q), s.dot(p), direction.dot(q)].map(|x| x / det);
            let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
            (inside && t > 0.0 && t <= t_max as f64).then_some((id, t, u, v))
        })
    }
}

impl RayQueries for BruteForce {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let (triangle, t, u, v) = self.hits(ray).min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(Hit { triangle, t: t as f32, u: u as f32, v: v as f32 })
    }

    fn blocked(&self, ray: &Ray, but: Option<u32>) -> bool {
        self.hits(ray).any(|(id, ..)| Some(id) != but)
    }
}
