//! An environment map with tables that are small and fast, sampled many directions at a time.
//!
//! The density is that of [`Environment`](super::Environment), the baseline, in both [`RowWarp`]s; see there for map and measure. What differs:
//!
//! | [`Form`] | bytes a texel | memory accesses | order of the variates |
//! |---|---|---|---|
//! | `Guide` (`Ordered`) | 4.3 | some in cache, one | both kept |
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
/// [`Form::Guide`] takes 4.3 bytes a texel and keeps the order of both variates; [`Form::Alias`] takes 8 and is faster, but loses the order of the
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
    column: u32,
    row: u32,
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

/// A place in `[0, 1]`, moved `margin` off the ends. Comparisons make two instructions, where `clamp` asks whether margins are in order.
#[inline(always)]
fn kept_off(place: f64, margin: f64) -> f64 {
    let most = 1.0 - margin;
    let place = if place > margin { place } else { margin };
    if place < most { place } else { most }
}

impl PackedEnvironment {
    /// The tables for a map.
    ///
    /// # Errors
    /// If all is black; with guides if the map is wider than 65,536 texels; if it has 2^32 texels or more, with guides in rows that are
    /// filled up to multiples of 16.
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

    /// What is found for each of the variates, one after the other.
    #[inline]
    fn find<const N: usize>(&self, xi: &[[f64; 2]; N], found: impl FnMut(usize, Found)) {
        match &self.tables {
            Tables::Guide(rows) => rows.find(xi, found),
            Tables::Alias(flat) => flat.find(xi, found),
        }
    }

    #[inline]
    fn find_all<const N: usize>(&self, xi: &[[f64; 2]; N]) -> [Found; N] {
        let mut all = [Found::default(); N];
        self.find(xi, |i, found| all[i] = found);
        all
    }

    /// (u, v) of what is found.
    #[inline]
    fn uvs<const N: usize>(&self, xi: &[[f64; 2]; N], uv: &mut [[f64; 2]; N]) {
        match self.rows {
            RowWarp::UniformV => {
                self.find(xi, |i, found| uv[i] = [self.u(&found), self.uniform_v(&found)]);
            }
            RowWarp::UniformCosTheta => self.find(xi, |i, found| uv[i] = self.uv(&found)),
        }
    }

    /// (u, v) of what was found.
    #[inline]
    fn uv(&self, found: &Found) -> [f64; 2] {
        let v = match self.rows {
            RowWarp::UniformV => self.uniform_v(found),
            RowWarp::UniformCosTheta => {
                let drop = &self.drops[found.row as usize];
                let from_pole = 2.0 * FRAC_1_PI * (0.5 * drop.at(found.down)).sqrt().min(1.0).asin();
                if drop.south { 1.0 - from_pole } else { from_pole }
            }
        };
        [self.u(found), v]
    }

    #[inline]
    fn u(&self, found: &Found) -> f64 {
        (f64::from(found.column) + kept_off(found.across, self.margins[0])) * self.texel[0]
    }

    #[inline]
    fn uniform_v(&self, found: &Found) -> f64 {
        (f64::from(found.row) + kept_off(found.down, self.margins[1])) * self.texel[1]
    }

    /// The directions of what was found, as x, y and z, and the sines of their theta.
    #[inline]
    fn directions<const N: usize>(&self, found: &[Found; N]) -> [[f64; N]; 4] {
        // Arrays of one coordinate each: what loops are vectorised over.
        let (mut turns, mut halves, mut directions) = ([0.0; N], [0.0; N], [[0.0; N]; 4]);
        let [x, y, z, sines] = &mut directions;
        match self.rows {
            RowWarp::UniformV => {
                for i in 0..N {
                    (turns[i], halves[i]) = (self.u(&found[i]), 0.5 * self.uniform_v(&found[i]));
                }
                for i in 0..N {
                    (sines[i], z[i]) = turns::sin_cos(halves[i]);
                }
            }
            RowWarp::UniformCosTheta => {
                for i in 0..N {
                    turns[i] = self.u(&found[i]);
                    let drop = &self.drops[found[i].row as usize];
                    let fallen = drop.at(found[i].down);
                    sines[i] = (fallen * (2.0 - fallen)).max(0.0).sqrt();
                    z[i] = if drop.south { fallen - 1.0 } else { 1.0 - fallen };
                }
            }
        }
        for i in 0..N {
            let (sin_phi, cos_phi) = turns::sin_cos(turns[i]);
            (x[i], y[i]) = (sines[i] * cos_phi, sines[i] * sin_phi);
        }
        directions
    }

    /// The directions alone of [`samples`](Self::samples).
    #[inline]
    fn points<const N: usize>(&self, xi: &[[f64; 2]; N], points: &mut [Option<DVec3>; N]) {
        let [x, y, z, _] = self.directions(&self.find_all(xi));
        for i in 0..N {
            points[i] = Some(DVec3::new(x[i], y[i], z[i]).as_vec3().as_dvec3());
        }
    }

    #[inline]
    fn samples<const N: usize>(&self, xi: &[[f64; 2]; N]) -> [EnvironmentSample; N] {
        let mut found = self.find_all(xi);
        // A loop with nothing else in it waits for many texels at once.
        let (texels, mut radiance) = (self.map.texels(), [[0.0; 3]; N]);
        for i in 0..N {
            radiance[i] = texels[found[i].row as usize * self.map.width() + found[i].column as usize];
        }
        if let Tables::Alias(flat) = &self.tables {
            let weights = self.weights();
            found.iter_mut().for_each(|found| {
                found.mass = flat.mass(&weights, found.column as usize, found.row as usize)
            });
        }
        let [x, y, z, sines] = self.directions(&found);
        let mut samples = [EnvironmentSample::default(); N];
        for i in 0..N {
            let Found { row, mass, .. } = found[i];
            samples[i] = EnvironmentSample {
                direction: DVec3::new(x[i], y[i], z[i]).as_vec3(),
                uv: DVec2::from_array(self.uv(&found[i])),
                density: (mass * self.per_solid_angle(row as usize, sines[i].max(LEAST_SINE))) as f32,
                radiance: radiance[i].into(),
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
        in_batches::<BATCH, _, _>(xi, out, |xi, out| *out = self.samples(xi), |xi| self.sample(xi));
    }

    /// (u, v) of [`sample`](Self::sample) for many variates, and nothing else.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn uv_all(&self, xi: &[[f64; 2]], out: &mut [[f64; 2]]) {
        assert_eq!(xi.len(), out.len(), "as many pairs of variates as places");
        let one = |xi| {
            let mut uv = [[0.0; 2]];
            self.uvs(&[xi], &mut uv);
            uv[0]
        };
        in_batches::<BATCH, _, _>(xi, out, |xi, out| self.uvs(xi, out), one);
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
        let one = |xi| {
            let mut point = [None];
            self.points(&[xi], &mut point);
            point[0]
        };
        in_batches::<BATCH, _, _>(xi, points, |xi, out| self.points(xi, out), one);
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
