//! A domain with atoms: points that carry a mass of their own beside the density on the rest. The mirror of a material, a delta light.
//!
//! The measure is that of the domain plus counting on the atoms, so a "density" at an atom is its probability (mass), and a mixture with delta parts
//! has one density everywhere (Radon-Nikodym derivative with respect to the sum; Veach 1997, section 9.2.6 on specular scattering). An atom is a
//! patch behind those of the domain; its chart is `[0, 1]^axes` with Jacobian 1, so that a constant mass integrates to itself. All samples of an atom
//! lie at one place of its chart, therefore cells and lines never cut it.

use super::{Cell, Domain, Location, Outside, Space};
use std::sync::Arc;

/// A point of [`WithAtoms`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mixed<P> {
    /// On the domain itself; the density is per its measure.
    Continuous(P),
    /// An atom, by its index; the density is its mass.
    Atom(usize),
}

/// A domain and some atoms. Densities are per the domain's measure, and masses at the atoms.
///
/// A smooth conductor over a diffuse base: with probability 0.3 the mirror direction and no other, else a cosine lobe.
///
/// ```
/// use glam::Vec3;
/// use warpcheck::domain::{Hemisphere, Mixed, WithAtoms};
/// use warpcheck::sampler::{CosineHemisphere, from_fn};
///
/// let material = from_fn(
///     WithAtoms::named(Hemisphere, ["the mirror direction"]),
///     |[pick, u, v]: [f32; 3]| {
///         if pick < 0.3 { Mixed::Atom(0) } else { Mixed::Continuous(CosineHemisphere.sample([u, v].into())) }
///     },
///     |w: Mixed<Vec3>| match w {
///         Mixed::Atom(_) => 0.3,
///         Mixed::Continuous(w) => 0.7 * CosineHemisphere.density(w),
///     },
/// );
/// warpcheck::verify(&material).samples(50_000).run().assert();
/// ```
#[derive(Clone, Debug)]
pub struct WithAtoms<D> {
    domain: D,
    names: Arc<[String]>,
}

impl<D: Domain> WithAtoms<D> {
    /// `domain` and this many atoms, which may be 0.
    pub fn new(domain: D, atoms: usize) -> Self {
        Self::named(domain, (0..atoms).map(|i| format!("atom {i}")))
    }

    /// `domain` and an atom for each name, by which reports call it.
    pub fn named(domain: D, names: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { domain, names: names.into_iter().map(Into::into).collect() }
    }

    /// The domain without its atoms.
    pub fn domain(&self) -> &D {
        &self.domain
    }

    /// How many atoms there are.
    pub fn atoms(&self) -> usize {
        self.names.len()
    }

    /// The atom that a patch is.
    fn atom(&self, patch: usize) -> Option<usize> {
        patch.checked_sub(self.domain.patches())
    }

    /// The part of a cell on the domain itself, and the atoms in it.
    fn parts(&self, cell: &Cell) -> (Option<Cell>, std::ops::Range<usize>) {
        let first = self.domain.patches();
        let (start, end) = (cell.patches.start, cell.patches.end);
        let own = (start < first).then(|| Cell { patches: start..end.min(first), ..cell.clone() });
        (own, start.max(first) - first..end.max(first) - first)
    }
}

/// Pictures show the domain alone: an atom has no place in them.
impl<D: Domain> Space for WithAtoms<D> {
    fn name(&self) -> &'static str {
        self.domain.name()
    }

    fn per(&self) -> &'static str {
        self.domain.per()
    }

    fn measure(&self) -> f64 {
        self.domain.measure() + self.atoms() as f64
    }

    fn patches(&self) -> usize {
        self.domain.patches() + self.atoms()
    }

    fn axes(&self) -> usize {
        self.domain.axes()
    }

    fn is_atom(&self, patch: usize) -> bool {
        self.atom(patch).is_some() || self.domain.is_atom(patch)
    }

    fn cell_measure(&self, cell: &Cell) -> f64 {
        let (own, atoms) = self.parts(cell);
        let chart: f64 = (0..self.axes()).map(|axis| cell.high[axis] - cell.low[axis]).product();
        own.map_or(0.0, |own| self.domain.cell_measure(&own)) + atoms.len() as f64 * chart
    }

    fn extent(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        self.domain.extent(low, high)
    }

    fn describe(&self, cell: &Cell) -> String {
        let (own, atoms) = self.parts(cell);
        let names = || self.names[atoms.clone()].join(", ");
        let atoms = match atoms.len() {
            0 => None,
            1..=3 => Some(names()),
            n => Some(format!("{n} atoms from {} to {}", self.names[atoms.start], self.names[atoms.end - 1])),
        };
        let parts = own.map(|own| self.domain.describe(&own)).into_iter().chain(atoms);
        parts.collect::<Vec<_>>().join(", and ")
    }

    /// Atoms lie apart from all else.
    fn embed(&self, location: &Location) -> [f64; 3] {
        match self.atom(location.patch) {
            Some(atom) => [1e6 + atom as f64, 0.0, 0.0],
            None => self.domain.embed(location),
        }
    }

    fn axis_names(&self) -> [&'static str; 2] {
        self.domain.axis_names()
    }

    fn wraps(&self, axis: usize) -> bool {
        self.domain.wraps(axis)
    }

    fn direction(&self, location: &Location) -> Option<glam::DVec3> {
        if self.atom(location.patch).is_some() { None } else { self.domain.direction(location) }
    }

    fn picture_aspect(&self) -> f64 {
        self.domain.picture_aspect()
    }

    fn picture_location(&self, x: f64, y: f64) -> Option<Location> {
        self.domain.picture_location(x, y)
    }

    /// NaN for an atom: it is drawn nowhere.
    fn picture_position(&self, location: &Location) -> [f64; 2] {
        match self.atom(location.patch) {
            Some(_) => [f64::NAN; 2],
            None => self.domain.picture_position(location),
        }
    }

    fn picture_scale(&self, x: f64, y: f64) -> f64 {
        self.domain.picture_scale(x, y)
    }

    fn picture_caption(&self) -> &'static str {
        self.domain.picture_caption()
    }
}

impl<D: Domain> Domain for WithAtoms<D> {
    type Point = Mixed<D::Point>;

    fn point(&self, patch: usize, at: [f64; 2]) -> (Self::Point, f64) {
        match self.atom(patch) {
            Some(atom) => (Mixed::Atom(atom), 1.0),
            None => {
                let (point, jacobian) = self.domain.point(patch, at);
                (Mixed::Continuous(point), jacobian)
            }
        }
    }

    /// An atom lies at the corner (0, 0) of its chart.
    fn locate(&self, point: &Self::Point) -> Result<Location, Outside> {
        match point {
            Mixed::Continuous(point) => self.domain.locate(point),
            Mixed::Atom(atom) if *atom < self.atoms() => {
                Ok(Location { patch: self.domain.patches() + atom, at: [0.0; 2] })
            }
            Mixed::Atom(atom) => Err(Outside(format!("is atom {atom} of {}", self.atoms()))),
        }
    }

    fn neighbours(&self, point: &Self::Point, epsilon: f64) -> Vec<Self::Point> {
        match point {
            Mixed::Continuous(point) => {
                self.domain.neighbours(point, epsilon).into_iter().map(Mixed::Continuous).collect()
            }
            Mixed::Atom(_) => Vec::new(),
        }
    }

    fn magnitude(&self, point: &Self::Point) -> f64 {
        match point {
            Mixed::Continuous(point) => self.domain.magnitude(point),
            Mixed::Atom(_) => 1.0,
        }
    }

    fn displacement(&self, from: &Self::Point, to: &Self::Point) -> Option<[f64; 2]> {
        match (from, to) {
            (Mixed::Continuous(from), Mixed::Continuous(to)) => self.domain.displacement(from, to),
            (Mixed::Atom(from), Mixed::Atom(to)) if from == to => Some([0.0; 2]),
            _ => None,
        }
    }
}
