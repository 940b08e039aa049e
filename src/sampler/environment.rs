//! An environment map, sampled by marginal and conditional CDFs.
//!
//! The map is latitude-longitude: u = phi / 2 pi from +X towards +Y, v = theta / pi from +Z, row 0 at theta = 0. The radiance is constant in
//! each texel. With L the luminance of texel (i, j), 0.2126 R + 0.7152 G + 0.0722 B (Rec. 709), the joint probability of
//! a texel is proportional to L times a row weight, the marginal is its sum over a row, the conditional is joint over marginal; both are
//! inverted ([`DiscreteCdf`]), and the variate left over places the sample inside the texel, so that (u, v) is continuous in the variates
//! (Pharr and Humphreys 2004; Pharr, Jakob and Humphreys, 4th edition, section 12.5).
//!
//! Inside a row there are two ways to place theta ([`RowWarp`]):
//! - uniform in v: row weight sin theta at the row's centre; density per uv p(u, v) = P W H, per solid angle p(u, v) / (2 pi^2 sin theta) at
//!   the theta of the sample, not of the row;
//! - uniform in cos theta: row weight cos theta_top - cos theta_bottom, which is the solid angle of its texels up to 2 pi / W; density per solid
//!   angle P over the texel's solid angle, constant in the texel, and exactly 1 / 4 pi for a constant map.
//!
//! `f32` directions are about 1e-7 rad coarse. Samples keep 2e-7 rad (at most a quarter of a texel) away from the texel's borders, so that the direction
//! returned always lies in the texel that was chosen, and its density is that of the texel: without it, one sample in 1e5 beside a sun is asked
//! for the density of the sky.

use super::{DiscreteCdf, Error, Sample, Sampler};
use crate::domain::{Knots, Sphere};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Luminance of linear Rec. 709 RGB.
///
/// ```
/// assert!((warpcheck::sampler::luminance([1.0, 1.0, 1.0]) - 1.0).abs() < 1e-12);
/// ```
#[inline]
pub fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

/// How theta is placed inside a row of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RowWarp {
    /// Uniform in v: piecewise constant per uv.
    #[default]
    UniformV,
    /// Uniform in cos theta: piecewise constant per solid angle.
    UniformCosTheta,
}

/// A latitude-longitude map of radiance, constant in each texel, without anything to sample it.
///
/// ```
/// use glam::Vec3;
/// use warpcheck::sampler::RadianceMap;
/// let map = RadianceMap::new(1, 2, vec![[1.0; 3], [0.0; 3]])?; // bright above, dark below
/// assert_eq!((map.radiance(Vec3::Z), map.radiance(Vec3::NEG_Z)), (Vec3::ONE, Vec3::ZERO));
/// assert_eq!(map.constant(), None);
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceMap {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
}

impl RadianceMap {
    /// From `width` x `height` texels of linear RGB radiance, row 0 on top.
    ///
    /// # Errors
    /// If the size and the number of texels differ, or a channel is negative, NaN or infinite (named by its texel).
    pub fn new(width: usize, height: usize, texels: Vec<[f32; 3]>) -> Result<Self, Error> {
        if texels.is_empty() || width.checked_mul(height) != Some(texels.len()) {
            return Err(Error::MapSize { width, height, texels: texels.len() });
        }
        for (i, texel) in texels.iter().enumerate() {
            if let Some(c) = texel.iter().position(|x| !(x.is_finite() && *x >= 0.0)) {
                let (column, row) = (i % width, i / width);
                return Err(Error::Texel { column, row, channel: ['R', 'G', 'B'][c], value: texel[c] });
            }
        }
        Ok(Self { width, height, texels })
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All texels, row after row.
    pub fn texels(&self) -> &[[f32; 3]] {
        &self.texels
    }

    /// The radiance that all texels have, if they have the same.
    pub fn constant(&self) -> Option<Vec3> {
        let first = self.texels[0];
        self.texels.iter().all(|&t| t == first).then(|| first.into())
    }

    /// Radiance from a direction, a unit vector in the map's frame: that of its texel.
    #[inline]
    pub fn radiance(&self, w: Vec3) -> Vec3 {
        let (column, row, _) = self.texel_of(w.as_dvec3());
        self.texels[row * self.width + column].into()
    }

    /// The (column, row) of a direction, and the sine of its theta.
    #[inline]
    fn texel_of(&self, w: DVec3) -> (usize, usize, f64) {
        let sine = w.x.hypot(w.y);
        let v = sine.atan2(w.z) / PI;
        let u = w.y.atan2(w.x) / TAU;
        let u = if u < 0.0 { u + 1.0 } else { u };
        let index = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
        (index(u, self.width), index(v, self.height), sine.max(LEAST_SINE))
    }
}

/// A latitude-longitude map of radiance and the tables to sample it.
///
/// ```
/// use warpcheck::sampler::{Environment, RowWarp};
/// let map = Environment::new(4, 2, vec![[1.0; 3]; 8], RowWarp::UniformCosTheta)?;
/// let sample = map.sample([0.3, 0.6]);
/// assert!((f64::from(sample.density) * 4.0 * std::f64::consts::PI - 1.0).abs() < 1e-6);
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Environment {
    map: RadianceMap,
    rows: RowWarp,
    marginal: DiscreteCdf,
    /// `None` for rows without luminance, which are never selected.
    conditionals: Vec<Option<DiscreteCdf>>,
}

/// A direction drawn from an [`Environment`] or a [`PackedEnvironment`](super::PackedEnvironment).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnvironmentSample {
    /// Unit vector in the map's frame.
    pub direction: Vec3,
    /// (u, v), in `[0, 1]`.
    pub uv: DVec2,
    /// Density per solid angle.
    pub density: f32,
    /// Radiance of the texel.
    pub radiance: Vec3,
}

/// Closer to a pole the density per solid angle of the uniform-v form is that at this theta: it would be infinite at the pole itself.
pub(super) const LEAST_SINE: f64 = 1e-12;
/// How far samples keep from a texel's borders, in radians.
pub(super) const MARGIN: f64 = 2e-7;

impl Environment {
    /// From `width` x `height` texels of linear RGB radiance, row 0 on top.
    ///
    /// # Errors
    /// If the size and the number of texels differ, a channel is negative, NaN or infinite (named by its texel), or all is black.
    pub fn new(width: usize, height: usize, texels: Vec<[f32; 3]>, rows: RowWarp) -> Result<Self, Error> {
        Self::from_map(RadianceMap::new(width, height, texels)?, rows)
    }

    /// The tables for a map.
    ///
    /// # Errors
    /// If all is black.
    pub fn from_map(map: RadianceMap, rows: RowWarp) -> Result<Self, Error> {
        let (width, height) = (map.width, map.height);
        let (mut weights, mut conditionals) = (Vec::with_capacity(height), Vec::with_capacity(height));
        for (row, texels) in map.texels.chunks_exact(width).enumerate() {
            let luminances: Vec<f64> = texels.iter().map(|&t| luminance(t)).collect();
            weights.push(row_weight(rows, row, height) * luminances.iter().sum::<f64>());
            conditionals.push(DiscreteCdf::new(&luminances).ok());
        }
        let marginal = DiscreteCdf::new(&weights).map_err(|_| Error::Black { width, height })?;
        Ok(Self { map, rows, marginal, conditionals })
    }

    /// The map.
    pub fn map(&self) -> &RadianceMap {
        &self.map
    }

    /// Bytes that the tables take, without the map.
    pub fn table_bytes(&self) -> usize {
        let conditionals = self.conditionals.iter().flatten().map(DiscreteCdf::bytes).sum::<usize>();
        size_of_val(&*self.conditionals) + conditionals + self.marginal.bytes()
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.map.width
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.map.height
    }

    /// The radiance of a texel.
    pub fn texel(&self, column: usize, row: usize) -> [f32; 3] {
        self.map.texels[row * self.map.width + column]
    }

    /// The table over the rows, searched with the first variate.
    pub fn marginal(&self) -> &DiscreteCdf {
        &self.marginal
    }

    /// The table over the columns of a row, searched with the second variate; `None` where the row is black.
    pub fn conditional(&self, row: usize) -> Option<&DiscreteCdf> {
        self.conditionals[row].as_ref()
    }

    /// The direction for variates in `[0, 1)`: `xi[0]` selects the row, `xi[1]` the column.
    #[inline]
    pub fn sample(&self, xi: [f64; 2]) -> EnvironmentSample {
        let row = self.marginal.choose(xi[0]);
        let Some(conditional) = &self.conditionals[row.index] else {
            unreachable!("a row of mass 0 is never chosen");
        };
        let column = conditional.choose(xi[1]);
        let (theta, sine) = self.theta(row.index, row.rest);
        let u = (column.index as f64 + keep_off(column.rest, TAU / self.map.width as f64))
            / self.map.width as f64;
        let (sin_phi, cos_phi) = (TAU * u).sin_cos();
        // Near the south pole pi - theta has lost its last digits; there the clamped sine is the better coordinate.
        let direction = DVec3::new(sine * cos_phi, sine * sin_phi, theta.cos()).as_vec3();
        EnvironmentSample {
            direction,
            uv: DVec2::new(u, theta / PI),
            density: (row.mass * column.mass * self.per_solid_angle(row.index, sine)) as f32,
            radiance: self.texel(column.index, row.index).into(),
        }
    }

    /// theta and its sine for a place in `[0, 1)` inside a row.
    fn theta(&self, row: usize, place: f64) -> (f64, f64) {
        let step = PI / self.map.height as f64;
        let top = row as f64 * step;
        let inside = match self.rows {
            RowWarp::UniformV => place * step,
            RowWarp::UniformCosTheta => {
                // 1 - cos theta is linear in the place; seen from the nearer pole, so that nothing cancels.
                let south = 2 * row + 1 > self.map.height;
                let (near, far) = if south {
                    ((self.map.height - 1 - row) as f64 * step, (self.map.height - row) as f64 * step)
                } else {
                    (top, top + step)
                };
                let part = if south { 1.0 - place } else { place };
                let drop = |theta: f64| 2.0 * (0.5 * theta).sin().powi(2);
                let drop = drop(near) + part * (drop(far) - drop(near));
                let theta = 2.0 * (0.5 * drop).sqrt().min(1.0).asin();
                if south { (row + 1) as f64 * step - (theta - near) - top } else { theta - near }
            }
        };
        let inside = step * keep_off((inside / step).clamp(0.0, 1.0), step);
        let theta = top + inside;
        // From the nearer pole.
        let from_south = (self.map.height - 1 - row) as f64 * step + (step - inside);
        (theta, if theta < 0.5 * PI { theta.sin() } else { from_south.sin() }.max(LEAST_SINE))
    }

    /// Radiance from a direction, a unit vector in the map's frame: that of its texel.
    #[inline]
    pub fn radiance(&self, w: Vec3) -> Vec3 {
        self.map.radiance(w)
    }

    /// Density per solid angle of a direction, a unit vector in the map's frame.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        Sampler::density(self, &w.as_dvec3()) as f32
    }

    /// Density per uv at (u, v), which integrates to 1 over the unit square; in both forms the probability of the texel times
    /// W H for the uniform-v form, and that times the Jacobian of cos theta for the other.
    pub fn density_uv(&self, uv: DVec2) -> f64 {
        let index = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
        let (column, row) = (index(uv.x, self.map.width), index(uv.y, self.map.height));
        let sine = (PI * uv.y).sin().max(LEAST_SINE);
        self.texel_mass(column, row) * self.per_solid_angle(row, sine) * TAU * PI * sine
    }

    /// Density per v of the marginal, which integrates to 1 over `[0, 1]`.
    pub fn density_v(&self, v: f64) -> f64 {
        let row = ((v * self.map.height as f64) as usize).min(self.map.height - 1);
        let sine = (PI * v).sin().max(LEAST_SINE);
        self.marginal.mass(row) * self.per_solid_angle(row, sine) * TAU * PI * sine / self.map.width as f64
    }

    /// Density per u of the conditional in the row of v, which integrates to 1 over `[0, 1]`; `None` where the row is black.
    pub fn density_u(&self, u: f64, v: f64) -> Option<f64> {
        let row = ((v * self.map.height as f64) as usize).min(self.map.height - 1);
        let column = ((u * self.map.width as f64) as usize).min(self.map.width - 1);
        Some(self.conditionals[row].as_ref()?.mass(column) * self.map.width as f64)
    }

    /// The probability of a texel.
    pub fn texel_mass(&self, column: usize, row: usize) -> f64 {
        self.conditionals[row].as_ref().map_or(0.0, |c| self.marginal.mass(row) * c.mass(column))
    }

    /// d(uv in texels) / d(solid angle): what turns a texel's probability into a density per solid angle.
    #[inline]
    fn per_solid_angle(&self, row: usize, sine: f64) -> f64 {
        let (width, height) = (self.map.width as f64, self.map.height as f64);
        match self.rows {
            RowWarp::UniformV => width * height / (TAU * PI * sine),
            RowWarp::UniformCosTheta => width / (TAU * row_weight(self.rows, row, self.map.height)),
        }
    }
}

/// The weight of a row's texels, see the file.
pub(super) fn row_weight(rows: RowWarp, row: usize, height: usize) -> f64 {
    let step = PI / height as f64;
    let centre = ((row as f64 + 0.5) * step).sin();
    match rows {
        RowWarp::UniformV => centre,
        // cos a - cos b = 2 sin((a + b) / 2) sin((b - a) / 2), without cancellation.
        RowWarp::UniformCosTheta => 2.0 * centre * (0.5 * step).sin(),
    }
}

/// A place in `[0, 1]` inside a texel `size` radians wide, moved off its borders.
#[inline]
fn keep_off(place: f64, size: f64) -> f64 {
    let margin = margin(size);
    place.clamp(margin, 1.0 - margin)
}

/// How far from the borders of a texel `size` radians wide samples keep, as a part of it.
#[inline]
pub(super) fn margin(size: f64) -> f64 {
    (MARGIN / size).min(0.25)
}

impl Sampler for Environment {
    type Domain = Sphere;

    fn domain(&self) -> Sphere {
        Sphere
    }

    fn dimensions(&self) -> usize {
        2
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
        let s = Self::sample(self, [xi[0], xi[1]]);
        Some(Sample { point: s.direction.as_dvec3(), density: f64::from(s.density) })
    }

    fn density(&self, w: &DVec3) -> f64 {
        let (column, row, sine) = self.map.texel_of(*w);
        self.texel_mass(column, row) * self.per_solid_angle(row, sine)
    }

    fn knots(&self) -> Knots {
        Knots::grid(self.map.height, self.map.width)
    }

    /// Those of the marginal, and those of the conditional of the likeliest row.
    fn variate_knots(&self, dimension: usize) -> Vec<f64> {
        if dimension == 0 {
            return self.marginal.some_boundaries();
        }
        let likeliest =
            (0..self.map.height).max_by(|&a, &b| self.marginal.mass(a).total_cmp(&self.marginal.mass(b)));
        likeliest
            .and_then(|row| self.conditionals[row].as_ref())
            .map(DiscreteCdf::some_boundaries)
            .unwrap_or_default()
    }
}
