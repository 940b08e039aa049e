//! A sampler with a delta part: a smooth conductor over a diffuse base, a point light among area lights.
//!
//! One variate picks the atom with probability c, the other sampler otherwise. The mass of the atom is c; the density of every other point is
//! (1 - c) p, to which the delta part adds nothing.

use super::{Error, PointOf, Preimage, Sample, Sampler};
use crate::domain::{Cell, Knots, Mixed, WithAtoms};

/// Draws one atom with probability `c`, from `sampler` otherwise.
///
/// ```
/// use warpcheck::sampler::{CosineHemisphere, WithDelta};
/// let material = WithDelta::new(0.3, "the mirror direction", CosineHemisphere)?;
/// warpcheck::verify(&material).samples(50_000).run().assert();
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct WithDelta<S> {
    c: f64,
    name: String,
    sampler: S,
}

impl<S: Sampler> WithDelta<S> {
    /// The atom `name` with mass `c`, and (1 - c) of `sampler`.
    ///
    /// # Errors
    /// Unless `c` is in 0..=1.
    pub fn new(c: f64, name: impl Into<String>, sampler: S) -> Result<Self, Error> {
        if !(0.0..=1.0).contains(&c) {
            return Err(Error::Parameter { parameter: "c", value: c, allowed: "from 0 to 1" });
        }
        Ok(Self { c, name: name.into(), sampler })
    }
}

impl<S: Sampler> Sampler for WithDelta<S> {
    type Domain = WithAtoms<S::Domain>;

    fn domain(&self) -> Self::Domain {
        WithAtoms::named(self.sampler.domain(), [self.name.as_str()])
    }

    /// The variate that picks, then those of the sampler.
    fn dimensions(&self) -> usize {
        1 + self.sampler.dimensions()
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<PointOf<Self>>> {
        if xi[0] < self.c {
            return Some(Sample { point: Mixed::Atom(0), density: self.c });
        }
        let Sample { point, density } = self.sampler.sample(&xi[1..])?;
        Some(Sample { point: Mixed::Continuous(point), density: (1.0 - self.c) * density })
    }

    fn density(&self, point: &PointOf<Self>) -> f64 {
        match point {
            Mixed::Atom(0) => self.c,
            Mixed::Atom(_) => 0.0,
            Mixed::Continuous(point) => (1.0 - self.c) * self.sampler.density(point),
        }
    }

    fn preimages(&self, point: &PointOf<Self>) -> Option<Vec<Preimage>> {
        let Mixed::Continuous(point) = point else { return None };
        let shifted = |p: Preimage| Preimage {
            xi: std::iter::once(0.5 + 0.5 * self.c).chain(p.xi).collect(),
            selecting: p.selecting + 1,
            weight: (1.0 - self.c) * p.weight,
        };
        Some(self.sampler.preimages(point)?.into_iter().map(shifted).collect())
    }

    fn variate_knots(&self, dimension: usize) -> Vec<f64> {
        match dimension {
            0 if self.c > 0.0 && self.c < 1.0 => vec![self.c],
            0 => Vec::new(),
            _ => self.sampler.variate_knots(dimension - 1),
        }
    }

    fn cell_mass(&self, cell: &Cell) -> Option<f64> {
        use crate::domain::Space;
        let first = self.sampler.domain().patches();
        let own =
            Cell { patches: cell.patches.start.min(first)..cell.patches.end.min(first), ..cell.clone() };
        let own = if own.patches.is_empty() { 0.0 } else { self.sampler.cell_mass(&own)? };
        Some((1.0 - self.c) * own + if cell.patches.contains(&first) { self.c } else { 0.0 })
    }

    fn knots(&self) -> Knots {
        self.sampler.knots()
    }

    fn has_density(&self) -> bool {
        self.sampler.has_density()
    }
}
