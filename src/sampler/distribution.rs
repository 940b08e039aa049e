//! A `rand` distribution with a density, or a `statrs` distribution, becomes a [`Sampler`](super::Sampler).

use super::closure::{Closures, FromPoint, IntoDraw, from_fn};
use crate::domain::{Domain, Interval};
use crate::random::SplitMix64;
use rand::distr::Distribution;
use statrs::distribution::{Continuous, ContinuousCDF};

/// A sampler of the points that `distribution` draws, with this density per the domain's measure.
///
/// A distribution asks a generator for as many bits as it likes; here the generator is started from one variate, so that
/// every sample is still a function of its variate and can be replayed.
///
/// ```
/// use rand_distr::Normal;
/// use warpcheck::domain::Interval;
/// use warpcheck::sampler::from_distribution;
///
/// let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
/// let normal = from_distribution(Interval::real_line(), Normal::new(0.0, 1.0).unwrap(), density);
/// warpcheck::verify(&normal).samples(100_000).run().assert();
/// ```
pub fn from_distribution<D, R, X, Q, T, P>(
    domain: D,
    distribution: R,
    density: P,
) -> Closures<D, impl Fn(f64) -> X + Sync, P, f64, X, (Q, T)>
where
    D: Domain,
    R: Distribution<X> + Sync,
    X: IntoDraw<D::Point>,
    Q: FromPoint<D::Point>,
    T: Into<f64>,
    P: Fn(Q) -> T + Sync,
{
    from_fn(domain, move |xi: f64| distribution.sample(&mut SplitMix64::from_variate(xi)), density)
}

/// A sampler that inverts the CDF of a continuous `statrs` distribution, with its own density.
///
/// ```
/// use statrs::distribution::Gamma;
/// use warpcheck::{domain::Interval, sampler::from_statrs};
/// let gamma = from_statrs(Interval::positive(), Gamma::new(3.0, 2.0).unwrap());
/// warpcheck::verify(&gamma).samples(20_000).run().assert();
/// ```
pub fn from_statrs<S>(
    domain: Interval,
    distribution: S,
) -> Closures<Interval, impl Fn(f64) -> f64 + Sync, impl Fn(f64) -> f64 + Sync, f64, f64, (f64, f64)>
where
    S: ContinuousCDF<f64, f64> + Continuous<f64, f64> + Clone + Sync,
{
    let inverted = distribution.clone();
    from_fn(
        domain,
        // Inside of (0, 1): an infinite end is no point.
        move |xi: f64| inverted.inverse_cdf(xi.max(f64::EPSILON / 4.0)),
        move |x: f64| distribution.pdf(x),
    )
}
