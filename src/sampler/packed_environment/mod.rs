//! An environment map with tables that are small and fast, sampled many directions at a time.
//!
//! The density is that of [`Environment`](super::Environment), the baseline, in both [`RowWarp`]s; see there for map and measure. What differs:
//!
//! | [`Form`] | bytes a texel | memory accesses | order of the variates |
//! |---|---|---|---|
//! | `Guide` (`Ordered`) | 4.2 | some in cache, one | both kept |
//! | `Alias` (`Unordered`) | 8 | one | the second kept, the first lost |
//!
//! and a few dozen bytes a row and a column. The tables are made in parallel, the same bits on any number of threads. (u, v) becomes a direction by
//! polynomials off by at most 4e-9 (before the direction is rounded to `f32`), and a direction is told its texel by sides of borders,
//! not by inverse trigonometric functions; so its density costs one access to the tables. Masses are differences of the integers that are
//! searched.
//!
//! Rows that aren't black have 2^31 steps: a texel lighter than 5e-10 of its row is drawn with that probability, and reported with it.

mod flat;
mod rows;

use super::environment::{LEAST_SINE, MARGIN, margin, row_weight};
use super::{EnvironmentSample, Error, Form, RadianceMap, RowWarp, Sample, Sampler, luminance};
use crate::domain::{Knots, LatLong, Sphere, turns};
use flat::Flat;
use glam::{DVec2, DVec3, Vec3};
use rows::Rows;
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;

use super::discrete::{BATCH, in_batches};

/// A latitude-longitude map of radiance and compact tables to sample it. The density is that of [`Environment`](super::Environment), up to the resolution
/// of the tables, and always the one that is searched.
///
/// [`Form::Guide`] takes 4.2 bytes a texel and keeps the order of both variates; [`Form::Alias`] takes 8 and is faster, but loses the order of the
/// first. Both are made in parallel (with the feature of that name), the same bits on any number of threads.
///
/// ```
/// use warpcheck::sampler::{EnvironmentSample, Form, PackedEnvironment, RadianceMap, RowWarp};
/// let map = RadianceMap::new(4, 2, vec![[1.0; 3]; 8])?;
/// let map = PackedEnvironment::new(map, RowWarp::UniformCosTheta, Form::Ordered)?;
/// let mut samples = [EnvironmentSample::default(); 2];
/// map.sample_all(&[[0.3, 0.6], [0.9, 0.1]], &mut samples);
/// assert_eq!(samples[0], map.sample([0.3, 0.6]));
/// assert!((f64::from(samples[1].density) * 4.0 * std::f64::consts::PI - 1.0).abs() < 1e-6);
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct PackedEnvironment {
    map: Arc<RadianceMap>,
    rows: RowWarp,
    row_weights: Box<[f64]>,
    /// Where in a row samples are placed; only for [`RowWarp::UniformCosTheta`].
    drops: Box<[Drop]>,
    edges: LatLong,
    /// The size of a texel along u and v, and how far from its borders samples keep, as a part of it.
    texel: [f64; 2],
    margins: [f64; 2],
    tables: Tables,
}

#[derive(Clone, Debug)]
enum Tables {
    Guide(Rows),
    Alias(Flat),
}

/// A texel that was drawn, and where in it.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    column: usize,
    row: usize,
    /// Place in the texel, along u and along v, in `[0, 1)`.
    across: f64,
    down: f64,
    /// The probability of the texel; NaN from an alias table, where it follows from the texel, which not everybody reads.
    mass: f64,
}

/// The weights of texels: luminance times that of the row.
#[derive(Clone, Copy)]
struct Weights<'a> {
    map: &'a RadianceMap,
    rows: &'a [f64],
}

impl<'a> Weights<'a> {
    fn width(&self) -> usize {
        self.map.width()
    }

    fn height(&self) -> usize {
        self.map.height()
    }

    #[inline]
    fn weight(&self, column: usize, row: usize) -> f64 {
        self.rows[row] * luminance(self.map.texels()[row * self.map.width() + column])
    }

    fn row(&self, row: usize) -> impl Iterator<Item = f64> + use<'a> {
        let (width, weight) = (self.map.width(), self.rows[row]);
        self.map.texels()[row * width..(row + 1) * width].iter().map(move |&texel| weight * luminance(texel))
    }

    fn black(&self) -> Error {
        Error::Black { width: self.width(), height: self.height() }
    }
}

/// The range of 1 - |cos theta| in a row, seen from the nearer pole.
#[derive(Clone, Copy, Debug)]
struct Drop {
    near: f64,
    range: f64,
    /// What keeps off the borders.
    least: f64,
    most: f64,
    south: bool,
}

impl Drop {
    fn new(row: usize, height: usize) -> Self {
        let step = PI / height as f64;
        let south = 2 * row + 1 > height;
        let from_pole = if south { height - 1 - row } else { row } as f64 * step;
        // cos a - cos b = 2 sin((a + b) / 2) sin((b - a) / 2), without cancellation.
        let between = |a: f64, b: f64| 2.0 * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin();
        let (far, margin) = (from_pole + step, MARGIN.min(0.25 * step));
        let range = between(from_pole, far);
        Self {
            near: between(0.0, from_pole),
            range,
            least: between(from_pole, from_pole + margin) / range,
            most: 1.0 - between(far - margin, far) / range,
            south,
        }
    }

    /// 1 - |cos theta|, for a place in the row.
    #[inline]
    fn at(&self, place: f64) -> f64 {
        let part = if self.south { 1.0 - place } else { place };
        self.near + part.clamp(self.least, self.most) * self.range
    }
}

impl PackedEnvironment {
    /// The tables for a map.
    ///
    /// # Errors
    /// If all is black; with guides if the map is wider than 65,536 texels, with an alias table if it has 2^32 texels or more.
    pub fn new(map: impl Into<Arc<RadianceMap>>, rows: RowWarp, form: Form) -> Result<Self, Error> {
        let map = map.into();
        let (width, height) = (map.width(), map.height());
        let row_weights: Box<[f64]> = (0..height).map(|row| row_weight(rows, row, height)).collect();
        let weights = Weights { map: &map, rows: &row_weights };
        let tables = match form {
            Form::Unordered | Form::Alias => Tables::Alias(Flat::new(&weights)?),
            Form::Ordered | Form::Guide | Form::Cdf => Tables::Guide(Rows::new(&weights)?),
        };
        let drops = match rows {
            RowWarp::UniformV => Box::default(),
            RowWarp::UniformCosTheta => (0..height).map(|row| Drop::new(row, height)).collect(),
        };
        let (texel, edges) = ([1.0 / width as f64, 1.0 / height as f64], LatLong::new(width, height));
        let margins = [TAU * texel[0], PI * texel[1]].map(margin);
        Ok(Self { edges, map, rows, row_weights, drops, texel, margins, tables })
    }

    /// The map.
    pub fn map(&self) -> &RadianceMap {
        &self.map
    }

    /// Which form the tables have: [`Form::Guide`] or [`Form::Alias`].
    pub fn form(&self) -> Form {
        match self.tables {
            Tables::Guide(_) => Form::Guide,
            Tables::Alias(_) => Form::Alias,
        }
    }

    /// Bytes that the tables take, without the map.
    pub fn table_bytes(&self) -> usize {
        let tables = match &self.tables {
            Tables::Guide(rows) => rows.bytes(),
            Tables::Alias(flat) => flat.bytes(),
        };
        tables + self.edges.bytes() + size_of_val(&*self.row_weights) + size_of_val(&*self.drops)
    }

    fn weights(&self) -> Weights<'_> {
        Weights { map: &self.map, rows: &self.row_weights }
    }

    #[inline]
    fn find<const N: usize>(&self, xi: &[[f64; 2]; N]) -> [Found; N] {
        match &self.tables {
            Tables::Guide(rows) => rows.find(xi),
            Tables::Alias(flat) => flat.find(xi),
        }
    }

    /// (u, v) of what was found.
    #[inline]
    fn uvs<const N: usize>(&self, found: &[Found; N]) -> [[f64; 2]; N] {
        let mut uv = [[0.0; 2]; N];
        match self.rows {
            RowWarp::UniformV => {
                for i in 0..N {
                    uv[i] = [self.u(&found[i]), self.uniform_v(&found[i])];
                }
            }
            RowWarp::UniformCosTheta => {
                for i in 0..N {
                    let drop = &self.drops[found[i].row];
                    let from_pole = 2.0 * FRAC_1_PI * (0.5 * drop.at(found[i].down)).sqrt().min(1.0).asin();
                    uv[i] = [self.u(&found[i]), if drop.south { 1.0 - from_pole } else { from_pole }];
                }
            }
        }
        uv
    }

    #[inline]
    fn u(&self, found: &Found) -> f64 {
        (found.column as f64 + found.across.clamp(self.margins[0], 1.0 - self.margins[0])) * self.texel[0]
    }

    #[inline]
    fn uniform_v(&self, found: &Found) -> f64 {
        (found.row as f64 + found.down.clamp(self.margins[1], 1.0 - self.margins[1])) * self.texel[1]
    }

    /// The directions of what was found, and the sines of their theta.
    #[inline]
    fn directions<const N: usize>(&self, found: &[Found; N]) -> [[f64; 4]; N] {
        let (mut turns, mut directions) = ([0.0; N], [[0.0; 4]; N]);
        for i in 0..N {
            turns[i] = self.u(&found[i]);
        }
        match self.rows {
            RowWarp::UniformV => {
                for i in 0..N {
                    let (sin_phi, cos_phi) = turns::sin_cos(turns[i]);
                    let (sine, cosine) = turns::sin_cos(0.5 * self.uniform_v(&found[i]));
                    directions[i] = [sine * cos_phi, sine * sin_phi, cosine, sine];
                }
            }
            RowWarp::UniformCosTheta => {
                for i in 0..N {
                    let (sin_phi, cos_phi) = turns::sin_cos(turns[i]);
                    let drop = &self.drops[found[i].row];
                    let fallen = drop.at(found[i].down);
                    let sine = (fallen * (2.0 - fallen)).max(0.0).sqrt();
                    let cosine = if drop.south { fallen - 1.0 } else { 1.0 - fallen };
                    directions[i] = [sine * cos_phi, sine * sin_phi, cosine, sine];
                }
            }
        }
        directions
    }

    /// The directions alone of [`samples`](Self::samples).
    #[inline]
    fn points<const N: usize>(&self, xi: &[[f64; 2]; N]) -> [Option<DVec3>; N] {
        let directions = self.directions(&self.find(xi));
        let mut points = [None; N];
        for i in 0..N {
            let [x, y, z, _] = directions[i];
            points[i] = Some(DVec3::new(x, y, z).as_vec3().as_dvec3());
        }
        points
    }

    #[inline]
    fn samples<const N: usize>(&self, xi: &[[f64; 2]; N]) -> [EnvironmentSample; N] {
        let mut found = self.find(xi);
        if let Tables::Alias(flat) = &self.tables {
            let weights = self.weights();
            found.iter_mut().for_each(|found| found.mass = flat.mass(&weights, found.column, found.row));
        }
        let uv = self.uvs(&found);
        let directions = self.directions(&found);
        let mut samples = [EnvironmentSample::default(); N];
        for i in 0..N {
            let [x, y, z, sine] = directions[i];
            let Found { column, row, mass, .. } = found[i];
            samples[i] = EnvironmentSample {
                direction: DVec3::new(x, y, z).as_vec3(),
                uv: DVec2::from_array(uv[i]),
                density: (mass * self.per_solid_angle(row, sine.max(LEAST_SINE))) as f32,
                radiance: self.map.texels()[row * self.map.width() + column].into(),
            };
        }
        samples
    }

    /// The direction for variates in `[0, 1)`. With guides, `xi[0]` selects the row and `xi[1]` the column; with an alias table, `xi[0]` the
    /// texel.
    #[inline]
    pub fn sample(&self, xi: [f64; 2]) -> EnvironmentSample {
        self.samples(&[xi])[0]
    }

    /// [`sample`](Self::sample) for many variates, to the last bit.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn sample_all(&self, xi: &[[f64; 2]], out: &mut [EnvironmentSample]) {
        assert_eq!(xi.len(), out.len(), "as many pairs of variates as samples");
        in_batches::<BATCH, _, _>(xi, out, |xi| self.samples(xi), |xi| self.sample(xi));
    }

    /// (u, v) of [`sample`](Self::sample) for many variates, and nothing else.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn uv_all(&self, xi: &[[f64; 2]], out: &mut [[f64; 2]]) {
        assert_eq!(xi.len(), out.len(), "as many pairs of variates as places");
        in_batches::<BATCH, _, _>(
            xi,
            out,
            |xi| self.uvs(&self.find(xi)),
            |xi| self.uvs(&self.find(&[xi]))[0],
        );
    }

    /// The direction of (u, v), of unit length; as [`sample`](Self::sample) has it for [`RowWarp::UniformV`]. Off by at most 4e-9 before it is
    /// rounded to `f32`.
    #[inline]
    pub fn direction_of(uv: [f64; 2]) -> Vec3 {
        let (sin_phi, cos_phi) = turns::sin_cos(uv[0]);
        let (sine, cosine) = turns::sin_cos(0.5 * uv[1]);
        DVec3::new(sine * cos_phi, sine * sin_phi, cosine).as_vec3()
    }

    /// Density per solid angle of a direction, a unit vector in the map's frame.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        Sampler::density(self, &w.as_dvec3()) as f32
    }

    /// The probability of a texel.
    pub fn texel_mass(&self, column: usize, row: usize) -> f64 {
        match &self.tables {
            Tables::Guide(rows) => rows.mass(column, row),
            Tables::Alias(flat) => flat.mass(&self.weights(), column, row),
        }
    }

    /// The variates at which a texel is drawn, `[start, end)` for each of the two; empty for the second where the texel is black. `None` with an alias
    /// table, where they lie in pieces.
    pub fn variates(&self, column: usize, row: usize) -> Option<[(f64, f64); 2]> {
        match &self.tables {
            Tables::Guide(rows) => Some(rows.variates(column, row)),
            Tables::Alias(_) => None,
        }
    }

    /// What turns a texel's probability into a density per solid angle.
    #[inline]
    fn per_solid_angle(&self, row: usize, sine: f64) -> f64 {
        let (width, height) = (self.map.width() as f64, self.map.height() as f64);
        match self.rows {
            RowWarp::UniformV => width * height / (TAU * PI * sine),
            RowWarp::UniformCosTheta => width / (TAU * self.row_weights[row]),
        }
    }
}

impl Sampler for PackedEnvironment {
    type Domain = Sphere;

    fn domain(&self) -> Sphere {
        Sphere
    }

    fn dimensions(&self) -> usize {
        2
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
        Some(Self::sample(self, [xi[0], xi[1]]).into())
    }

    fn fill(&self, xi: &[f64], samples: &mut [Option<Sample<DVec3>>]) {
        assert_eq!(xi.len(), 2 * samples.len(), "two variates a sample");
        let (xi, _) = xi.as_chunks::<2>();
        let mut drawn = [EnvironmentSample::default(); 4 * BATCH];
        for (xi, samples) in xi.chunks(drawn.len()).zip(samples.chunks_mut(4 * BATCH)) {
            let drawn = &mut drawn[..xi.len()];
            self.sample_all(xi, drawn);
            samples.iter_mut().zip(drawn).for_each(|(sample, &mut drawn)| *sample = Some(drawn.into()));
        }
    }

    fn fill_points(&self, xi: &[f64], points: &mut [Option<DVec3>]) {
        assert_eq!(xi.len(), 2 * points.len(), "two variates a point");
        let (xi, _) = xi.as_chunks::<2>();
        in_batches::<BATCH, _, _>(xi, points, |xi| self.points(xi), |xi| self.points(&[xi])[0]);
    }

    fn density(&self, w: &DVec3) -> f64 {
        let (column, row, sine) = self.edges.texel_of(*w);
        self.texel_mass(column, row) * self.per_solid_angle(row, sine.max(LEAST_SINE))
    }

    fn knots(&self) -> Knots {
        Knots::grid(self.map.height(), self.map.width())
    }

    fn variate_knots(&self, dimension: usize) -> Vec<f64> {
        match &self.tables {
            Tables::Guide(rows) => rows.knots(dimension),
            Tables::Alias(flat) => flat.knots(dimension),
        }
    }
}

impl From<EnvironmentSample> for Sample<DVec3> {
    fn from(sample: EnvironmentSample) -> Self {
        Self { point: sample.direction.as_dvec3(), density: f64::from(sample.density) }
    }
}
