//! The samplers of direct illumination, one idea a file, and the trait through which everything is judged.
//!
//! A sampler's own methods take and return `f32` geometry ([`glam::Vec3`]) as a renderer would call them; the
//! trait [`Sampler`] shows the same code to the checks with points in `f64`, which every `f32` converts to exactly.

mod barycentric;
mod closure;
mod cosine_hemisphere;
mod discrete;
mod distribution;
mod draws;
mod environment;
mod frame;
mod ggx;
mod light_tree;
mod mesh_light;
mod mis;
mod mixture;
mod packed_environment;
mod phong;
mod solid_angle;
mod spherical_triangle;
mod uniform_direction;
mod von_mises_fisher;
mod with_delta;

pub use barycentric::{BarycentricWarp, TriangleWarp};
pub use closure::{Closures, FromPoint, IntoDraw, ToPoint, Variates, from_fn};
pub use cosine_hemisphere::CosineHemisphere;
pub use discrete::{Choice, DiscreteAlias, DiscreteCdf, DiscreteGuide, DiscreteTable, Form};
pub use distribution::{from_distribution, from_statrs};
pub use draws::{Draws, from_draws};
pub use environment::{Environment, EnvironmentSample, RadianceMap, RowWarp, luminance};
pub use frame::Frame;
pub use ggx::GgxVisibleNormals;
pub use light_tree::LightTree;
pub use mesh_light::{LightSample, MeshLight, Placement, SeenFrom, Sides, SurfaceSample};
pub use mis::{Heuristic, Real};
pub use mixture::Mixture;
pub use packed_environment::PackedEnvironment;
pub use phong::PhongLobe;
pub use solid_angle::View;
pub use spherical_triangle::SphericalTriangle;
pub use uniform_direction::{UniformHemisphere, UniformSphere};
pub use von_mises_fisher::VonMisesFisher;
pub use with_delta::WithDelta;

use crate::domain::{Cell, Domain, Knots};

/// The points of a sampler's domain.
pub type PointOf<S> = <<S as Sampler>::Domain as Domain>::Point;

/// A point and the density with which it was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<P> {
    /// The point.
    pub point: P,
    /// The density there, per the domain's measure.
    pub density: f64,
}

/// Variates that give a point; see [`Sampler::preimages`].
#[derive(Clone, Debug, PartialEq)]
pub struct Preimage {
    /// The variates.
    pub xi: Vec<f64>,
    /// How many of them, at the front, only select a branch of the sampler: the point doesn't move with them.
    pub selecting: usize,
    /// The probability of that branch; 1 if nothing is selected.
    pub weight: f64,
}

/// Draws points of a domain from uniform variates, and knows their density.
///
/// ```
/// use warpcheck::domain::Hemisphere;
/// use warpcheck::sampler::{Sample, Sampler};
/// use glam::DVec3;
/// use std::f64::consts::{PI, TAU};
///
/// /// Malley's method, Pharr, Jakob and Humphreys, section A.5.3.
/// struct Cosine;
///
/// impl Sampler for Cosine {
///     type Domain = Hemisphere;
///     fn domain(&self) -> Hemisphere { Hemisphere }
///     fn dimensions(&self) -> usize { 2 }
///     fn sample(&self, xi: &[f64]) -> Option<Sample<DVec3>> {
///         let (r, phi) = (xi[0].sqrt(), TAU * xi[1]);
///         let point = DVec3::new(r * phi.cos(), r * phi.sin(), (1.0 - xi[0]).sqrt());
///         Some(Sample { point, density: self.density(&point) })
///     }
///     fn density(&self, w: &DVec3) -> f64 { w.z / PI }
/// }
///
/// warpcheck::verify(&Cosine).samples(100_000).run().assert();
/// ```
pub trait Sampler: Sync {
    /// Where its points live.
    type Domain: Domain;

    /// The domain.
    fn domain(&self) -> Self::Domain;

    /// How many uniform variates one sample takes.
    fn dimensions(&self) -> usize;

    /// The sample for these [`dimensions`](Self::dimensions) variates, each in `[0, 1)`; `None` where the sampler
    /// rejects them. Rejected mass is counted, and tested against 1 minus the integral of the density.
    fn sample(&self, xi: &[f64]) -> Option<Sample<PointOf<Self>>>;

    /// [`sample`](Self::sample) for many variates, one sample's after the other's: `xi` has [`dimensions`](Self::dimensions) for each of `samples`.
    /// Samplers that read tables override it, to wait for memory once and not once a sample, and programs at the other end of a pipe. The
    /// samples are the same to the last bit.
    ///
    /// ```
    /// use warpcheck::sampler::{DiscreteAlias, Sampler};
    /// let table = DiscreteAlias::new(&[1.0, 2.0, 3.0])?;
    /// let xi = [0.1, 0.9, 0.5];
    /// let mut samples = [None; 3];
    /// table.fill(&xi, &mut samples);
    /// assert!((0..3).all(|i| samples[i] == table.sample(&xi[i..=i])));
    /// # Ok::<(), warpcheck::sampler::Error>(())
    /// ```
    ///
    /// # Panics
    /// If `xi` has another length.
    fn fill(&self, xi: &[f64], samples: &mut [Option<Sample<PointOf<Self>>>]) {
        let dimensions = self.dimensions();
        assert_eq!(xi.len(), dimensions * samples.len(), "{dimensions} variates a sample");
        for (i, sample) in samples.iter_mut().enumerate() {
            *sample = self.sample(&xi[i * dimensions..(i + 1) * dimensions]);
        }
    }

    /// The points of [`fill`](Self::fill), without their densities, for what only counts where samples fall. Samplers that would read
    /// a table for the density override it; the points are the same to the last bit.
    ///
    /// ```
    /// use warpcheck::sampler::{DiscreteAlias, Sampler};
    /// let table = DiscreteAlias::new(&[1.0, 2.0, 3.0])?;
    /// let mut points = [None; 3];
    /// table.fill_points(&[0.1, 0.9, 0.5], &mut points);
    /// assert_eq!(points[1], table.sample(&[0.9]).map(|sample| sample.point));
    /// # Ok::<(), warpcheck::sampler::Error>(())
    /// ```
    ///
    /// # Panics
    /// If `xi` has another length.
    fn fill_points(&self, xi: &[f64], points: &mut [Option<PointOf<Self>>]) {
        let mut samples = nothing_yet(points.len());
        self.fill(xi, &mut samples);
        keep_points(samples, points);
    }

    /// The density at a point, per the domain's measure.
    fn density(&self, point: &PointOf<Self>) -> f64;

    /// The density at every point, in their order, into the emptied `out`.
    fn density_many(&self, points: &[PointOf<Self>], out: &mut Vec<f64>) {
        out.clear();
        out.extend(points.iter().map(|point| self.density(point)));
    }

    /// The variates that give `point`, where an inverse exists.
    fn invert(&self, _point: &PointOf<Self>) -> Option<Vec<f64>> {
        None
    }

    /// All variates that give `point`: its density is the sum of weight / |det d point / d xi| over them, xi the variates behind
    /// the selecting ones. Unless told, the one that [`invert`](Self::invert) gives, where there are as many variates as the domain has axes.
    fn preimages(&self, point: &PointOf<Self>) -> Option<Vec<Preimage>> {
        use crate::domain::Space;
        if self.dimensions() != self.domain().axes() {
            return None;
        }
        self.invert(point).map(only_preimage)
    }

    /// A variate that sampling left over, re-scaled for reuse: uniform in `[0, 1)` and independent of the point. `None` where there is none.
    fn left_over(&self, _xi: &[f64]) -> Option<f64> {
        None
    }

    /// Values of one variate at which a table switches from one entry to the next, where roundings show; a few hundred are enough.
    fn variate_knots(&self, _dimension: usize) -> Vec<f64> {
        Vec::new()
    }

    /// Densities, up to a constant, that a mistaken copy of this sampler may have: ("without the cosine", its value at `point`). The diagnosis
    /// tries them.
    fn rivals(&self, _point: &PointOf<Self>) -> Vec<(&'static str, f64)> {
        Vec::new()
    }

    /// The probability of a cell, where the sampler knows it exactly; quadrature of the density otherwise.
    fn cell_mass(&self, _cell: &Cell) -> Option<f64> {
        None
    }

    /// Whether [`density`](Self::density) means anything. Where not, the sampler can be compared with another one
    /// ([`compare`](crate::verify::compare)), but not verified.
    fn has_density(&self) -> bool {
        true
    }

    /// Whether asking it costs far more than counting what it answers, as it does at the other end of a pipe. Then nobody asks it for what is known
    /// already.
    fn is_slow(&self) -> bool {
        false
    }

    /// The least and the largest value that the density may have at `point`, where [`density`](Self::density) is a table that stands for one that nobody
    /// knows better than its texels; `None` where it is the density. What is asked point by point allows for it; counts don't.
    fn density_range(&self, _point: &PointOf<Self>) -> Option<[f64; 2]> {
        None
    }

    /// Where the density may jump, along the axes of the domain's chart. Helps quadrature; a wrong answer costs
    /// accuracy, which the error estimate then shows.
    fn knots(&self) -> Knots {
        Knots::default()
    }
}

// What the default methods do that depends on no sampler, apart, so that it is compiled once a point's type and not once a sampler.

fn nothing_yet<P>(count: usize) -> Vec<Option<Sample<P>>> {
    let mut samples = Vec::new();
    samples.resize_with(count, || None);
    samples
}

fn keep_points<P>(samples: Vec<Option<Sample<P>>>, points: &mut [Option<P>]) {
    points.iter_mut().zip(samples).for_each(|(point, sample)| *point = sample.map(|sample| sample.point));
}

fn only_preimage(xi: Vec<f64>) -> Vec<Preimage> {
    vec![Preimage { xi, selecting: 0, weight: 1.0 }]
}

/// [`Sampler::fill`] into the emptied `out`.
pub(crate) fn fill_vec<S: Sampler + ?Sized>(
    sampler: &S,
    xi: &[f64],
    out: &mut Vec<Option<Sample<PointOf<S>>>>,
) {
    out.clear();
    out.resize_with(xi.len() / sampler.dimensions().max(1), || None);
    sampler.fill(xi, out);
}

/// A reference to a sampler, and a boxed one, are samplers.
macro_rules! forward {
    ($($pointer:ty),+) => {$(
impl<S: Sampler + ?Sized> Sampler for $pointer {
    type Domain = S::Domain;

    fn domain(&self) -> Self::Domain {
        (**self).domain()
    }

    fn dimensions(&self) -> usize {
        (**self).dimensions()
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<PointOf<Self>>> {
        (**self).sample(xi)
    }

    fn fill(&self, xi: &[f64], samples: &mut [Option<Sample<PointOf<Self>>>]) {
        (**self).fill(xi, samples);
    }

    fn fill_points(&self, xi: &[f64], points: &mut [Option<PointOf<Self>>]) {
        (**self).fill_points(xi, points);
    }

    fn density(&self, point: &PointOf<Self>) -> f64 {
        (**self).density(point)
    }

    fn density_many(&self, points: &[PointOf<Self>], out: &mut Vec<f64>) {
        (**self).density_many(points, out);
    }

    fn invert(&self, point: &PointOf<Self>) -> Option<Vec<f64>> {
        (**self).invert(point)
    }

    fn preimages(&self, point: &PointOf<Self>) -> Option<Vec<Preimage>> {
        (**self).preimages(point)
    }

    fn left_over(&self, xi: &[f64]) -> Option<f64> {
        (**self).left_over(xi)
    }

    fn variate_knots(&self, dimension: usize) -> Vec<f64> {
        (**self).variate_knots(dimension)
    }

    fn rivals(&self, point: &PointOf<Self>) -> Vec<(&'static str, f64)> {
        (**self).rivals(point)
    }

    fn cell_mass(&self, cell: &Cell) -> Option<f64> {
        (**self).cell_mass(cell)
    }

    fn is_slow(&self) -> bool {
        (**self).is_slow()
    }

    fn density_range(&self, point: &PointOf<Self>) -> Option<[f64; 2]> {
        (**self).density_range(point)
    }

    fn knots(&self) -> Knots {
        (**self).knots()
    }

    fn has_density(&self) -> bool {
        (**self).has_density()
    }
}
    )+};
}
forward!(&S, Box<S>);

/// What a sampler can't be made from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is nothing to choose from.
    #[error("there are no weights to choose by")]
    NoWeights,
    /// A weight is negative, NaN or infinite.
    #[error("weight {index} is {value:?}; weights must be finite and at least 0")]
    Weight {
        /// Which weight.
        index: usize,
        /// What it is.
        value: f64,
    },
    /// The power of a light is 0, negative, NaN or infinite.
    #[error("light {index} has the power {value:?}; powers must be finite and above 0")]
    Power {
        /// Which light.
        index: usize,
        /// What it is.
        value: f64,
    },
    /// All weights are 0.
    #[error("all {count} weights are 0")]
    AllZero {
        /// How many there are.
        count: usize,
    },
    /// A texel is negative, NaN or infinite.
    #[error(
        "texel (column {column}, row {row}) has {channel} = {value:?}; radiance must be finite and at least 0"
    )]
    Texel {
        /// Column, from 0 on the left.
        column: usize,
        /// Row, from 0 on top.
        row: usize,
        /// Which channel.
        channel: char,
        /// What it is.
        value: f32,
    },
    /// A map has no texels, or another number of them than its size says.
    #[error("the map is {width} x {height}, but has {texels} texels")]
    MapSize {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Texels given.
        texels: usize,
    },
    /// A map without any light.
    #[error("the map is black: all of its {width} x {height} texels have no luminance")]
    Black {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A vertex is NaN or infinite.
    #[error("triangle {triangle} has the vertex {vertex}; vertices must be finite")]
    Vertex {
        /// Which triangle.
        triangle: usize,
        /// The vertex.
        vertex: glam::Vec3,
    },
    /// A light without area.
    #[error("the light has no area: all of its {triangles} triangles are degenerate")]
    NoArea {
        /// How many triangles there are.
        triangles: usize,
    },
    /// A parameter is out of its range.
    #[error("{parameter} is {value:?}; it must be {allowed}")]
    Parameter {
        /// Its name.
        parameter: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
}

/// `value` if it lies in `allowed`, an error that names the parameter otherwise.
fn checked(
    parameter: &'static str,
    value: f32,
    range: std::ops::RangeInclusive<f32>,
    allowed: &'static str,
) -> Result<f32, Error> {
    if range.contains(&value) {
        Ok(value)
    } else {
        Err(Error::Parameter { parameter, value: f64::from(value), allowed })
    }
}
