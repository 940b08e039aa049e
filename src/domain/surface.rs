//! Triangles and meshes, measured by area; points are barycentric.
//!
//! The chart of a triangle is Duffy's: b0 = 1 - s, b1 = s t, b2 = s (1 - t), with d area = 2 A s ds dt
//! (Duffy 1982). It is neither of the two warps that samplers use.

use super::mistake::of_indices;
use super::{Cell, Confusion, Domain, Factor, Keeps, Location, Outside, Space, TOLERANCE};
use glam::DVec3;
use std::sync::Arc;

/// A triangle of a given area; its points are barycentric coordinates (b0, b1, b2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    area: f64,
}

impl Triangle {
    /// A triangle of this area.
    ///
    /// # Panics
    /// Unless the area is positive and finite.
    #[track_caller]
    pub fn with_area(area: f64) -> Self {
        assert!(area > 0.0 && area.is_finite(), "a triangle needs a positive, finite area, got {area}");
        Self { area }
    }

    /// The triangle with these vertices.
    ///
    /// # Panics
    /// If it has no area.
    #[track_caller]
    pub fn from_vertices(vertices: [DVec3; 3]) -> Self {
        let [a, b, c] = vertices;
        Self::with_area(0.5 * (b - a).cross(c - a).length())
    }
}

/// A point on a mesh: a triangle and barycentric coordinates on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index of the triangle.
    pub triangle: usize,
    /// Barycentric coordinates (b0, b1, b2).
    pub barycentric: DVec3,
}

/// The triangles of a mesh, given by their areas.
#[derive(Clone, Debug)]
pub struct MeshSurface {
    areas: Arc<[f64]>,
}

impl MeshSurface {
    /// The mesh whose triangles have these areas; an area may be 0.
    ///
    /// # Panics
    /// Unless there is a triangle, all areas are finite and at least 0, and one is positive.
    #[track_caller]
    pub fn from_areas(areas: impl Into<Arc<[f64]>>) -> Self {
        let areas = areas.into();
        for (i, area) in areas.iter().enumerate() {
            assert!(area.is_finite() && *area >= 0.0, "triangle {i} has the area {area}");
        }
        assert!(areas.iter().any(|&a| a > 0.0), "a mesh surface needs a triangle with an area");
        Self { areas }
    }
}

impl MeshSurface {
    /// Tiles in a row of the picture.
    fn columns(&self) -> usize {
        (self.areas.len() as f64).sqrt().ceil() as usize
    }
}

fn chart(area: f64, at: [f64; 2]) -> (DVec3, f64) {
    let [s, t] = at;
    (DVec3::new(1.0 - s, s * t, s * (1.0 - t)), 2.0 * area * s)
}

/// The share of a triangle's area that a rectangle of its chart covers.
fn part_of_area(cell: &Cell) -> f64 {
    let ([a, from], [b, to]) = (cell.low, cell.high);
    (b - a) * (b + a) * (to - from)
}

/// Two barycentric coordinates are affine in the plane: their determinant is area up to a constant, which both get a root of.
fn barycentric_step(area: f64, from: DVec3, to: DVec3) -> Option<[f64; 2]> {
    let step = to - from;
    let scale = (2.0 * area).sqrt();
    step.is_finite().then_some([scale * step.y, scale * step.z])
}

fn locate(b: DVec3) -> Result<[f64; 2], Outside> {
    if !b.is_finite() {
        return Err(Outside(format!("has barycentric coordinates that are not finite: {b}")));
    }
    if b.min_element() < -TOLERANCE || (b.element_sum() - 1.0).abs() > 3.0 * TOLERANCE {
        return Err(Outside(format!("has barycentric coordinates {b}, outside of the triangle")));
    }
    let b = b.max(DVec3::ZERO);
    let s = b.y + b.z; // not 1 - b0: the last bits near vertex 0 are kept
    Ok([s.min(1.0), if s > 0.0 { b.y / s } else { 0.0 }])
}

fn barycentric(at: [f64; 2]) -> DVec3 {
    chart(0.5, at).0
}

/// 1 - b_i is the distance from vertex i, as a share of the height: what a warp without its square root leaves in the density.
fn factors() -> Vec<Factor> {
    vec![
        Factor { name: "distance from vertex 0 (1 - b0)", value: |l| l.at[0] },
        Factor { name: "distance from vertex 1 (1 - b1)", value: |l| 1.0 - barycentric(l.at).y },
        Factor { name: "distance from vertex 2 (1 - b2)", value: |l| 1.0 - barycentric(l.at).z },
    ]
}

fn usual_densities() -> Vec<Factor> {
    vec![
        Factor { name: "without the square root at vertex 0", value: |l| 1.0 / l.at[0] },
        Factor { name: "without the square root at vertex 1", value: |l| 1.0 / (1.0 - barycentric(l.at).y) },
        Factor { name: "without the square root at vertex 2", value: |l| 1.0 / (1.0 - barycentric(l.at).z) },
        // Along b the cube reaches to 1 / max b.
        Factor {
            name: "of three variates divided by their sum",
            value: |l| barycentric(l.at).max_element().powi(-3),
        },
    ]
}

/// Vertices in another order.
fn permutations() -> Vec<Confusion> {
    fn from(b: DVec3) -> [f64; 2] {
        locate(b).unwrap_or([0.0; 2])
    }
    use Keeps::Measure;
    vec![
        Confusion::new("vertices 1 and 2 exchanged", Measure, |[s, t]| [s, 1.0 - t]),
        Confusion::new("vertices 0 and 1 exchanged", Measure, |at| {
            let b = barycentric(at);
            from(DVec3::new(b.y, b.x, b.z))
        }),
        Confusion::new("vertices 0 and 2 exchanged", Measure, |at| {
            let b = barycentric(at);
            from(DVec3::new(b.z, b.y, b.x))
        }),
        Confusion::new("vertices rotated", Measure, |at| {
            let b = barycentric(at);
            from(DVec3::new(b.y, b.z, b.x))
        }),
        Confusion::new("vertices rotated", Measure, |at| {
            let b = barycentric(at);
            from(DVec3::new(b.z, b.x, b.y))
        }),
    ]
}

impl Space for Triangle {
    fn embed(&self, location: &Location) -> [f64; 3] {
        chart(self.area, location.at).0.into()
    }

    fn factors(&self) -> Vec<Factor> {
        factors()
    }

    fn usual_densities(&self) -> Vec<Factor> {
        usual_densities()
    }

    fn axis_names(&self) -> [&'static str; 2] {
        ["1 - b0", "b1 / (b1 + b2)"]
    }

    fn confusions(&self) -> Vec<Confusion> {
        permutations()
    }

    fn cell_measure(&self, cell: &Cell) -> f64 {
        self.area * part_of_area(cell)
    }

    fn name(&self) -> &'static str {
        "triangle"
    }

    fn per(&self) -> &'static str {
        "area"
    }

    fn measure(&self) -> f64 {
        self.area
    }

    fn extent(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        [high[0] - low[0], (high[1] - low[1]) * 0.5 * (low[0] + high[0])]
    }

    fn describe(&self, cell: &Cell) -> String {
        describe(cell)
    }

    fn picture_location(&self, x: f64, y: f64) -> Option<Location> {
        // Vertex 0 at the top, 1 at the left, 2 at the right.
        let b = DVec3::new(1.0 - y, 0.5 + 0.5 * y - x, x - 0.5 + 0.5 * y);
        (b.min_element() >= 0.0).then(|| self.locate(&b).ok()).flatten()
    }

    fn picture_position(&self, location: &Location) -> [f64; 2] {
        let b = chart(self.area, location.at).0;
        [0.5 + 0.5 * (b.z - b.y), 1.0 - b.x]
    }

    /// The triangle covers half of the picture.
    fn picture_scale(&self, _: f64, _: f64) -> f64 {
        2.0 * self.area
    }

    fn picture_caption(&self) -> &'static str {
        "the triangle: vertex 0 at the top, 1 left, 2 right"
    }
}

impl Domain for Triangle {
    type Point = DVec3;

    fn displacement(&self, from: &DVec3, to: &DVec3) -> Option<[f64; 2]> {
        barycentric_step(self.area, *from, *to)
    }

    fn point(&self, _: usize, at: [f64; 2]) -> (DVec3, f64) {
        chart(self.area, at)
    }

    fn locate(&self, b: &DVec3) -> Result<Location, Outside> {
        Ok(Location { patch: 0, at: locate(*b)? })
    }
}

fn describe(cell: &Cell) -> String {
    format!(
        "b0 {:.4}..{:.4}, b1/(b1+b2) {:.4}..{:.4}",
        1.0 - cell.high[0],
        1.0 - cell.low[0],
        cell.low[1],
        cell.high[1]
    )
}

impl Space for MeshSurface {
    fn factors(&self) -> Vec<Factor> {
        factors()
    }

    fn usual_densities(&self) -> Vec<Factor> {
        usual_densities()
    }

    fn axis_names(&self) -> [&'static str; 2] {
        ["1 - b0", "b1 / (b1 + b2)"]
    }

    fn confusions(&self) -> Vec<Confusion> {
        let mut all = of_indices(self.areas.len());
        all.extend(permutations());
        all
    }

    fn cell_measure(&self, cell: &Cell) -> f64 {
        self.areas[cell.patches.clone()].iter().sum::<f64>() * part_of_area(cell)
    }

    fn name(&self) -> &'static str {
        "mesh surface"
    }

    fn per(&self) -> &'static str {
        "area"
    }

    fn measure(&self) -> f64 {
        self.areas.iter().sum()
    }

    fn patches(&self) -> usize {
        self.areas.len()
    }

    fn extent(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        Triangle { area: 1.0 }.extent(low, high)
    }

    fn describe(&self, cell: &Cell) -> String {
        match cell.patches.end - cell.patches.start {
            1 => format!("triangle {}, {}", cell.patches.start, describe(cell)),
            _ => format!("triangles {}..={}", cell.patches.start, cell.patches.end - 1),
        }
    }

    fn picture_location(&self, x: f64, y: f64) -> Option<Location> {
        // Tiles in reading order, one a triangle.
        let columns = self.columns() as f64;
        let (tile_x, tile_y) =
            ((x * columns).floor().min(columns - 1.0), (y * columns).floor().min(columns - 1.0));
        let patch = (tile_y * columns + tile_x) as usize;
        (patch < self.areas.len())
            .then_some(Location { patch, at: [x * columns - tile_x, y * columns - tile_y] })
    }

    fn picture_position(&self, location: &Location) -> [f64; 2] {
        let columns = self.columns();
        let (x, y) = (location.patch % columns, location.patch / columns);
        let within = |tile: usize, at: f64| (tile as f64 + at.min(1.0 - 1e-9)) / columns as f64;
        [within(x, location.at[0]), within(y, location.at[1])]
    }

    fn picture_scale(&self, x: f64, y: f64) -> f64 {
        let columns = self.columns() as f64;
        self.picture_location(x, y).map_or(0.0, |l| columns * columns * self.point(l.patch, l.at).1)
    }

    fn picture_caption(&self) -> &'static str {
        "one square a triangle, in order of index, row by row (charts, not to scale)"
    }
}

impl Domain for MeshSurface {
    type Point = SurfacePoint;

    fn displacement(&self, from: &SurfacePoint, to: &SurfacePoint) -> Option<[f64; 2]> {
        let area = *self.areas.get(from.triangle)?;
        if from.triangle != to.triangle {
            return None;
        }
        barycentric_step(area, from.barycentric, to.barycentric)
    }

    fn point(&self, patch: usize, at: [f64; 2]) -> (SurfacePoint, f64) {
        let (barycentric, jacobian) = chart(self.areas[patch], at);
        (SurfacePoint { triangle: patch, barycentric }, jacobian)
    }

    fn locate(&self, point: &SurfacePoint) -> Result<Location, Outside> {
        if point.triangle >= self.areas.len() {
            return Err(Outside(format!("is on triangle {} of {}", point.triangle, self.areas.len())));
        }
        Ok(Location { patch: point.triangle, at: locate(point.barycentric)? })
    }
}
