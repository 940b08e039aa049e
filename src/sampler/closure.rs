//! A pair of closures becomes a [`Sampler`], in `f32` or `f64`, with or without the density returned.

use super::{PointOf, Sample, Sampler};
use crate::domain::{Domain, Knots, Mixed, SurfacePoint};
use crate::random::to_f32;
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::marker::PhantomData;

/// What a sampling closure takes: one variate or an array of them, `f32` or `f64`, or a glam vector.
///
/// `f32` variates are rounded to nearest and stay under 1.
pub trait Variates {
    /// How many variates it is.
    const DIMENSIONS: usize;
    /// From this many variates in `[0, 1)`.
    fn from_variates(xi: &[f64]) -> Self;
}

/// What a sampling closure returns for a point of type `P`: the point, or a pair of the point and its density, or an
/// `Option` of either, `None` for rejected mass.
pub trait IntoDraw<P> {
    /// The point, and its density if it came along.
    fn into_draw(self) -> Option<(P, Option<f64>)>;
}

/// Types that convert to a domain's point.
pub trait ToPoint<P> {
    /// The point.
    fn to_point(self) -> P;
}

/// Types that a density closure may take for a domain's point.
pub trait FromPoint<P> {
    /// From the point; `f32` types round.
    fn from_point(point: &P) -> Self;
}

impl Variates for f64 {
    const DIMENSIONS: usize = 1;
    fn from_variates(xi: &[f64]) -> Self {
        xi[0]
    }
}

impl Variates for f32 {
    const DIMENSIONS: usize = 1;
    fn from_variates(xi: &[f64]) -> Self {
        to_f32(xi[0])
    }
}

impl<const N: usize> Variates for [f64; N] {
    const DIMENSIONS: usize = N;
    fn from_variates(xi: &[f64]) -> Self {
        std::array::from_fn(|i| xi[i])
    }
}

impl<const N: usize> Variates for [f32; N] {
    const DIMENSIONS: usize = N;
    fn from_variates(xi: &[f64]) -> Self {
        std::array::from_fn(|i| to_f32(xi[i]))
    }
}

macro_rules! vector_variates {
    ($($vector:ty, $array:ty);*) => {$(
        impl Variates for $vector {
            const DIMENSIONS: usize = <$array>::DIMENSIONS;
            fn from_variates(xi: &[f64]) -> Self {
                <$array>::from_variates(xi).into()
            }
        }
    )*};
}
vector_variates!(Vec2, [f32; 2]; Vec3, [f32; 3]; DVec2, [f64; 2]; DVec3, [f64; 3]);

macro_rules! point_conversions {
    ($($point:ty { $($other:ty, |$o:ident| $to:expr, |$p:ident| $from:expr;)+ })*) => {$($(
        impl ToPoint<$point> for $other {
            #[inline]
            fn to_point(self) -> $point {
                let $o = self;
                $to
            }
        }
        impl FromPoint<$point> for $other {
            #[inline]
            fn from_point($p: &$point) -> Self {
                $from
            }
        }
        impl IntoDraw<$point> for $other {
            #[inline]
            fn into_draw(self) -> Option<($point, Option<f64>)> {
                Some((self.to_point(), None))
            }
        }
        impl IntoDraw<$point> for Option<$other> {
            #[inline]
            fn into_draw(self) -> Option<($point, Option<f64>)> {
                self.map(|point| (point.to_point(), None))
            }
        }
        impl<T: Into<f64>> IntoDraw<$point> for ($other, T) {
            #[inline]
            fn into_draw(self) -> Option<($point, Option<f64>)> {
                Some((self.0.to_point(), Some(self.1.into())))
            }
        }
        impl<T: Into<f64>> IntoDraw<$point> for Option<($other, T)> {
            #[inline]
            fn into_draw(self) -> Option<($point, Option<f64>)> {
                self.map(|(point, density)| (point.to_point(), Some(density.into())))
            }
        }
    )+)*};
}
point_conversions! {
    usize {
        usize, |x| x, |p| *p;
        u32, |x| x as usize, |p| *p as u32;
    }
    f64 {
        f64, |x| x, |p| *p;
        f32, |x| f64::from(x), |p| *p as f32;
    }
    DVec2 {
        DVec2, |x| x, |p| *p;
        [f64; 2], |x| x.into(), |p| (*p).into();
        Vec2, |x| x.as_dvec2(), |p| p.as_vec2();
        [f32; 2], |x| Vec2::from(x).as_dvec2(), |p| p.as_vec2().into();
    }
    DVec3 {
        DVec3, |x| x, |p| *p;
        [f64; 3], |x| x.into(), |p| (*p).into();
        Vec3, |x| x.as_dvec3(), |p| p.as_vec3();
        [f32; 3], |x| Vec3::from(x).as_dvec3(), |p| p.as_vec3().into();
    }
    SurfacePoint {
        SurfacePoint, |x| x, |p| *p;
        (usize, Vec3), |x| SurfacePoint { triangle: x.0, barycentric: x.1.as_dvec3() }, |p| (p.triangle, p.barycentric.as_vec3());
    }
}

impl<P, T: ToPoint<P>> ToPoint<Mixed<P>> for Mixed<T> {
    fn to_point(self) -> Mixed<P> {
        match self {
            Self::Continuous(point) => Mixed::Continuous(point.to_point()),
            Self::Atom(atom) => Mixed::Atom(atom),
        }
    }
}

impl<P, T: FromPoint<P>> FromPoint<Mixed<P>> for Mixed<T> {
    fn from_point(point: &Mixed<P>) -> Self {
        match point {
            Mixed::Continuous(point) => Self::Continuous(T::from_point(point)),
            Mixed::Atom(atom) => Self::Atom(*atom),
        }
    }
}

impl<P, T: ToPoint<P>> IntoDraw<Mixed<P>> for Mixed<T> {
    fn into_draw(self) -> Option<(Mixed<P>, Option<f64>)> {
        Some((self.to_point(), None))
    }
}

impl<P, T: ToPoint<P>> IntoDraw<Mixed<P>> for Option<Mixed<T>> {
    fn into_draw(self) -> Option<(Mixed<P>, Option<f64>)> {
        self.map(|point| (point.to_point(), None))
    }
}

impl<P, T: ToPoint<P>, F: Into<f64>> IntoDraw<Mixed<P>> for (Mixed<T>, F) {
    fn into_draw(self) -> Option<(Mixed<P>, Option<f64>)> {
        Some((self.0.to_point(), Some(self.1.into())))
    }
}

impl<P, T: ToPoint<P>, F: Into<f64>> IntoDraw<Mixed<P>> for Option<(Mixed<T>, F)> {
    fn into_draw(self) -> Option<(Mixed<P>, Option<f64>)> {
        self.map(|(point, density)| (point.to_point(), Some(density.into())))
    }
}

/// A sampler made by [`from_fn`].
pub struct Closures<D, S, P, X, R, Q> {
    domain: D,
    sample: S,
    density: P,
    knots: Knots,
    types: PhantomData<fn(X, Q) -> R>,
}

impl<D, S, P, X, R, Q> Closures<D, S, P, X, R, Q> {
    /// Says where the density jumps: the texels of a map, say ([`Knots::grid`]). Quadrature then keeps to these lines.
    pub fn with_knots(self, knots: Knots) -> Self {
        Self { knots, ..self }
    }
}

/// A sampler from a closure that samples and one that gives the density, per the domain's measure.
///
/// The types of the closures say everything else: how many variates, `f32` or `f64`, whether it rejects, whether the
/// density comes with the sample (and is then checked against the other closure).
///
/// ```
/// use glam::Vec3;
/// use warpcheck::domain::Hemisphere;
/// use warpcheck::sampler::from_fn;
///
/// fn my_sample(u: f32, v: f32) -> Vec3 {
///     let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
///     Vec3::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt())
/// }
/// fn my_pdf(w: Vec3) -> f32 {
///     w.z / std::f32::consts::PI
/// }
///
/// let mine = from_fn(Hemisphere, |[u, v]: [f32; 2]| my_sample(u, v), |w: Vec3| my_pdf(w));
/// warpcheck::verify(&mine).samples(100_000).run().assert();
/// ```
pub fn from_fn<D, X, R, Q, T, S, P>(domain: D, sample: S, density: P) -> Closures<D, S, P, X, R, (Q, T)>
where
    D: Domain,
    X: Variates,
    R: IntoDraw<D::Point>,
    Q: FromPoint<D::Point>,
    T: Into<f64>,
    S: Fn(X) -> R + Sync,
    P: Fn(Q) -> T + Sync,
{
    Closures { domain, sample, density, knots: Knots::default(), types: PhantomData }
}

impl<D, X, R, Q, T, S, P> Sampler for Closures<D, S, P, X, R, (Q, T)>
where
    D: Domain,
    X: Variates,
    R: IntoDraw<D::Point>,
    Q: FromPoint<D::Point>,
    T: Into<f64>,
    S: Fn(X) -> R + Sync,
    P: Fn(Q) -> T + Sync,
{
    type Domain = D;

    fn domain(&self) -> D {
        self.domain.clone()
    }

    fn dimensions(&self) -> usize {
        X::DIMENSIONS
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<PointOf<Self>>> {
        let (point, density) = (self.sample)(X::from_variates(xi)).into_draw()?;
        let density = density.unwrap_or_else(|| self.density(&point));
        Some(Sample { point, density })
    }

    fn density(&self, point: &PointOf<Self>) -> f64 {
        (self.density)(Q::from_point(point)).into()
    }

    fn knots(&self) -> Knots {
        self.knots.clone()
    }
}
