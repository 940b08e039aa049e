//! A sampler that only draws: nobody knows its density, but two such samplers can be compared.

use super::closure::{IntoDraw, Variates};
use super::{PointOf, Sample, Sampler};
use crate::domain::Domain;
use std::marker::PhantomData;

/// A sampler made by [`from_draws`].
pub struct Draws<D, S, X, R> {
    domain: D,
    sample: S,
    types: PhantomData<fn(X) -> R>,
}

/// A sampler from a closure that samples, without any density; for [`compare`](crate::verify::compare). The types of the closure say how many
/// variates it takes and whether it rejects, as for [`from_fn`](super::from_fn); a density that comes with the point is dropped.
///
/// Its density is NaN everywhere, and [`has_density`](Sampler::has_density) is false: [`verify`](crate::verify::verify) has nothing to hold
/// the samples against, and says so (inconclusive).
///
/// ```
/// use warpcheck::domain::Disk;
/// use warpcheck::sampler::from_draws;
/// use std::f64::consts::TAU;
///
/// let polar = from_draws(Disk, |[u, v]: [f64; 2]| {
///     let (sin, cos) = (TAU * v).sin_cos();
///     [u.sqrt() * cos, u.sqrt() * sin]
/// });
/// let rejecting = from_draws(Disk, |[u, v]: [f64; 2]| {
///     let p = [2.0 * u - 1.0, 2.0 * v - 1.0];
///     (p[0] * p[0] + p[1] * p[1] <= 1.0).then_some(p)
/// });
/// // As many points in every cell, but the second rejects 21% of its variates.
/// assert!(warpcheck::verify::compare(&polar, &rejecting).samples(20_000).run().verdict() != warpcheck::verify::Verdict::Pass);
/// ```
pub fn from_draws<D, X, R, S>(domain: D, sample: S) -> Draws<D, S, X, R>
where
    D: Domain,
    X: Variates,
    R: IntoDraw<D::Point>,
    S: Fn(X) -> R + Sync,
{
    Draws { domain, sample, types: PhantomData }
}

impl<D, X, R, S> Sampler for Draws<D, S, X, R>
where
    D: Domain,
    X: Variates,
    R: IntoDraw<D::Point>,
    S: Fn(X) -> R + Sync,
{
    type Domain = D;

    fn domain(&self) -> D {
        self.domain.clone()
    }

    fn dimensions(&self) -> usize {
        X::DIMENSIONS
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<PointOf<Self>>> {
        let (point, _) = (self.sample)(X::from_variates(xi)).into_draw()?;
        Some(Sample { point, density: f64::NAN })
    }

    fn density(&self, _: &PointOf<Self>) -> f64 {
        f64::NAN
    }

    fn has_density(&self) -> bool {
        false
    }
}
