//! A mixture of two samplers: one-sample MIS with the balance heuristic.
//!
//! One variate picks the first sampler with probability c, the second otherwise; the density of what comes out is
//! c p_1 + (1 - c) p_2, whichever was picked (Veach 1997, section 9.2.4). At c = 0 and c = 1 it is one of the two, bit for bit.
//! Mixtures nest, so two are enough.

use super::{PointOf, Preimage, Sample, Sampler};
use crate::domain::{Domain, Knots};

/// Draws from `first` with probability `c`, from `second` otherwise.
///
/// ```
/// use warpcheck::sampler::{CosineHemisphere, Mixture, UniformHemisphere};
/// let mixture = Mixture::new(0.25, CosineHemisphere, UniformHemisphere)?;
/// warpcheck::verify(&mixture).samples(50_000).run().assert();
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixture<A, B> {
    c: f64,
    first: A,
    second: B,
}

impl<A, B> Mixture<A, B>
where
    A: Sampler,
    B: Sampler<Domain = A::Domain>,
{
    /// The mixture c `first` + (1 - c) `second`.
    ///
    /// # Errors
    /// Unless `c` is in 0..=1.
    pub fn new(c: f64, first: A, second: B) -> Result<Self, super::Error> {
        if !(0.0..=1.0).contains(&c) {
            return Err(super::Error::Parameter { parameter: "c", value: c, allowed: "from 0 to 1" });
        }
        Ok(Self { c, first, second })
    }
}

/// c a + (1 - c) b, where a part of weight 0 adds nothing even if it is infinite.
fn mix(c: f64, a: impl FnOnce() -> f64, b: impl FnOnce() -> f64) -> f64 {
    match c {
        0.0 => b(),
        1.0 => a(),
        _ => c * a() + (1.0 - c) * b(),
    }
}

impl<A, B> Sampler for Mixture<A, B>
where
    A: Sampler,
    B: Sampler<Domain = A::Domain>,
{
    type Domain = A::Domain;

    fn domain(&self) -> Self::Domain {
        self.first.domain()
    }

    /// The variate that picks, then those of the picked sampler.
    fn dimensions(&self) -> usize {
        1 + self.first.dimensions().max(self.second.dimensions())
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<PointOf<Self>>> {
        let (pick, rest) = (xi[0], &xi[1..]);
        if pick < self.c {
            let s = self.first.sample(rest)?;
            let density = mix(self.c, || s.density, || self.second.density(&s.point));
            Some(Sample { point: s.point, density })
        } else {
            let s = self.second.sample(rest)?;
            let density = mix(self.c, || self.first.density(&s.point), || s.density);
            Some(Sample { point: s.point, density })
        }
    }

    fn density(&self, point: &<Self::Domain as Domain>::Point) -> f64 {
        mix(self.c, || self.first.density(point), || self.second.density(point))
    }

    /// The chosen part's, if both list theirs.
    fn preimages(&self, point: &PointOf<Self>) -> Option<Vec<Preimage>> {
        let width = self.dimensions();
        let part = |pick: f64, weight: f64, preimages: Vec<Preimage>| {
            preimages.into_iter().map(move |p| {
                let mut xi = vec![pick];
                xi.extend(p.xi);
                xi.resize(width, 0.5); // variates that this part does not use
                Preimage { xi, selecting: p.selecting + 1, weight: weight * p.weight }
            })
        };
        let mut all = Vec::new();
        if self.c > 0.0 && self.first.density(point) > 0.0 {
            all.extend(part(0.5 * self.c, self.c, self.first.preimages(point)?));
        }
        if self.c < 1.0 && self.second.density(point) > 0.0 {
            all.extend(part(0.5 + 0.5 * self.c, 1.0 - self.c, self.second.preimages(point)?));
        }
        Some(all)
    }

    /// The border between the two, and the knots of either.
    fn variate_knots(&self, dimension: usize) -> Vec<f64> {
        if dimension == 0 {
            return if self.c > 0.0 && self.c < 1.0 { vec![self.c] } else { Vec::new() };
        }
        let of = |part: Vec<f64>, uses: bool| if uses { part } else { Vec::new() };
        let mut knots = of(self.first.variate_knots(dimension - 1), dimension <= self.first.dimensions());
        knots.extend(of(self.second.variate_knots(dimension - 1), dimension <= self.second.dimensions()));
        knots
    }

    fn rivals(&self, point: &PointOf<Self>) -> Vec<(&'static str, f64)> {
        vec![
            ("only the first part of the mixture", self.first.density(point)),
            ("only the second part of the mixture", self.second.density(point)),
            ("both parts of the mixture alike", self.first.density(point) + self.second.density(point)),
            (
                "the parts of the mixture exchanged",
                mix(1.0 - self.c, || self.first.density(point), || self.second.density(point)),
            ),
        ]
    }

    fn cell_mass(&self, cell: &crate::domain::Cell) -> Option<f64> {
        let (a, b) = (self.first.cell_mass(cell)?, self.second.cell_mass(cell)?);
        Some(mix(self.c, || a, || b))
    }

    fn knots(&self) -> Knots {
        self.first.knots().merged(&self.second.knots())
    }
}
