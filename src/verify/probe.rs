//! A sampler as the checks see it: variates in, locations and densities out, whatever its points are.
//!
//! The checks are compiled once, against [`Probe`]; only the loops of this file, where samples are drawn, are compiled for every domain, and none for every
//! sampler: whoever tests many of their own waits for the compiler no longer.

use crate::domain::{Cell, Domain, Knots, Location, Space};
use crate::sampler::{Preimage, Sampler, fill_vec};

/// What became of one set of variates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fate {
    Rejected,
    Outside,
    Drawn,
}

/// One sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Draw {
    pub fate: Fate,
    pub location: Location,
    /// The density that came with it.
    pub density: f64,
    /// The density that asking for its point gives, where it was asked.
    pub asked: f64,
}

impl Draw {
    pub fn without_point(fate: Fate) -> Self {
        Self { fate, location: Location { patch: 0, at: [0.0; 2] }, density: 0.0, asked: 0.0 }
    }
}

/// One sample looked at closely.
pub(super) struct Look {
    /// The point, for people.
    pub point: String,
    pub location: Result<Location, String>,
    pub density: f64,
    pub asked: f64,
}

/// How well an inverse inverts.
pub(super) struct RoundTrip {
    /// What the inverse gives.
    pub xi: Vec<f64>,
    /// Distance from the point to the point of those variates, as a displacement; infinite if there is none.
    pub distance: f64,
    pub point: String,
}

/// A function whose integral over the domain is known.
pub(super) struct Known<'a, P> {
    pub name: String,
    pub function: Box<dyn Fn(&P) -> f64 + Send + Sync + 'a>,
    pub integral: f64,
}

/// A named function of a point.
pub(super) type Named<'a, P> = (String, Box<dyn Fn(&P) -> f64 + Send + Sync + 'a>);

/// What the person who verifies says beside the sampler.
pub(super) struct Extras<'a, P> {
    pub target: Option<Box<dyn Fn(&P) -> f64 + Send + Sync + 'a>>,
    pub known: Vec<Known<'a, P>>,
    pub rivals: Vec<Named<'a, P>>,
    pub importance: Option<Importance<'a, P>>,
}

/// What the density should be proportional to.
pub(super) struct Importance<'a, P> {
    pub function: Box<dyn Fn(&P) -> f64 + Send + Sync + 'a>,
    /// The largest relative standard deviation of function / density.
    pub spread: f64,
}

impl<P> Default for Extras<'_, P> {
    fn default() -> Self {
        Self { target: None, known: Vec::new(), rivals: Vec::new(), importance: None }
    }
}

/// Whether the `i`-th of some samples is asked for its density again where every `ask`-th is, a power of two.
#[inline]
pub(super) fn is_asked(i: usize, ask: usize) -> bool {
    i & (ask - 1) == 0
}

/// What the checks ask.
pub(super) trait Probe: Sync {
    fn space(&self) -> &dyn Space;
    fn space_for_keeps(&self) -> Box<dyn Space>;
    fn dimensions(&self) -> usize;
    fn knots(&self) -> &Knots;
    fn variate_knots(&self, dimension: usize) -> Vec<f64>;
    /// A sample for every `dimensions` of the variates into `out`; every `ask`-th, a power of two, is asked for its density again. The values f / density of the
    /// functions with known integrals go to `values`, as many for each sample as there are functions.
    fn draw(&self, xi: &[f64], ask: usize, out: &mut Vec<Draw>, values: &mut Vec<f64>);
    /// Only where the samples fall.
    fn locate(&self, xi: &[f64], out: &mut Vec<Location>);
    fn look(&self, xi: &[f64]) -> Option<Look>;
    /// Density and Jacobian of the chart.
    fn density_at(&self, patch: usize, at: [f64; 2]) -> (f64, f64);
    /// The same at many locations, into the emptied `out`.
    fn densities_at(&self, places: &[Location], out: &mut Vec<(f64, f64)>);
    fn describe(&self, patch: usize, at: [f64; 2]) -> String;
    /// The densities a step of `epsilon` around the sample of `xi`.
    fn densities_around(&self, xi: &[f64], epsilon: f64) -> Vec<f64>;
    /// The displacements from the sample of one set of variates to those of others, one after another in `to`, and the densities asked at the latter;
    /// `None` if any is missing. All at once, since to ask may be slow.
    fn displacements(&self, from: &[f64], to: &[f64]) -> Option<Vec<([f64; 2], f64)>>;
    /// The densities at parts of the way from the sample of one set of variates to that of another, along the chart.
    fn densities_between(&self, from: &[f64], to: &[f64], parts: &[f64]) -> Option<Vec<f64>>;
    /// How large the numbers of its point are; 0 if there is none.
    fn magnitude(&self, xi: &[f64]) -> f64;
    /// All preimages of the sample of `xi`, if the sampler lists them.
    fn preimages(&self, xi: &[f64]) -> Option<Vec<Preimage>>;
    fn round_trip(&self, xi: &[f64]) -> Option<RoundTrip>;
    fn left_over(&self, xi: &[f64]) -> Option<f64>;
    fn cell_mass(&self, cell: &Cell) -> Option<f64>;
    fn target_at(&self, patch: usize, at: [f64; 2]) -> Option<f64>;
    /// What the density should be proportional to, over the density, at the samples of these variates; the spread allowed.
    fn importance(&self, xi: &[f64]) -> Option<(Vec<f64>, f64)>;
    /// Names and integrals of the functions with known integrals.
    fn known(&self) -> Vec<(&str, f64)>;
    /// Names and values of the densities that a mistaken copy may have.
    fn rivals_at(&self, patch: usize, at: [f64; 2]) -> Vec<(String, f64)>;

    /// What a sample is called, for people.
    fn called(&self, xi: &[f64]) -> String {
        format!("xi = {xi:?}")
    }

    /// Where samples were drawn by somebody else, how many of them are pilots: the variates (i + 1/2) / count, i = 0, 1, …, are them. There is no asking for more then.
    fn pilots(&self) -> Option<usize> {
        None
    }

    /// Makes samples ready to be judged, `count` from `first` on, and returns how many there are.
    fn load(&self, _first: u64, count: u64) -> u64 {
        count
    }

    /// Reads up to `count` samples that will be asked for next, while others are judged.
    fn load_ahead(&self, _count: u64) {}

    /// How many samples there will be, about.
    fn rows_expected(&self, most: u64) -> u64 {
        most
    }

    /// Whether any point can be asked for its density.
    fn has_density(&self) -> bool {
        true
    }

    /// Whether a density comes with each sample.
    fn returns_density(&self) -> bool {
        true
    }

    /// Whether to ask costs far more than to count.
    fn is_slow(&self) -> bool {
        false
    }

    /// Whether the density may be 0 where nobody knows.
    fn partial(&self) -> bool {
        false
    }
}

/// The pilots, each once, up to `most`.
pub(super) fn each_pilot(count: usize, most: usize) -> Vec<f64> {
    (0..count.min(most)).map(|i| (i as f64 + 0.5) / count as f64).collect()
}

/// A sampler that can be asked. What was drawn by somebody else is a [`Recording`](super::recording::Recording).
pub(super) struct Subject<'a, D: Domain> {
    sampler: &'a dyn Sampler<Domain = D>,
    domain: D,
    knots: Knots,
    dimensions: usize,
    extras: &'a Extras<'a, D::Point>,
}

impl<'a, D: Domain> Subject<'a, D> {
    pub fn new(sampler: &'a dyn Sampler<Domain = D>, extras: &'a Extras<'a, D::Point>) -> Self {
        Self {
            domain: sampler.domain(),
            knots: sampler.knots(),
            dimensions: sampler.dimensions(),
            sampler,
            extras,
        }
    }

    /// The points of all sets of variates; `None` if any has none.
    fn points_of(&self, xi: &[f64]) -> Option<Vec<D::Point>> {
        let mut samples = Vec::new();
        fill_vec(self.sampler, xi, &mut samples);
        samples.into_iter().map(|sample| Some(sample?.point)).collect()
    }

    fn each<'x>(&self, xi: &'x [f64]) -> impl Iterator<Item = &'x [f64]> {
        // A sampler without variates has one sample, and a chunk can't be empty.
        xi.chunks_exact(self.dimensions.max(1))
    }
}

impl<D: Domain> Probe for Subject<'_, D> {
    fn space(&self) -> &dyn Space {
        &self.domain
    }

    fn space_for_keeps(&self) -> Box<dyn Space> {
        Box::new(self.domain.clone())
    }

    fn dimensions(&self) -> usize {
        self.dimensions
    }

    fn knots(&self) -> &Knots {
        &self.knots
    }

    fn variate_knots(&self, dimension: usize) -> Vec<f64> {
        self.sampler.variate_knots(dimension)
    }

    fn draw(&self, xi: &[f64], ask: usize, out: &mut Vec<Draw>, values: &mut Vec<f64>) {
        out.clear();
        values.clear();
        let mut samples = Vec::new();
        fill_vec(self.sampler, xi, &mut samples);
        let every = |step: usize| -> Vec<D::Point> {
            samples.iter().step_by(step).flatten().map(|sample| sample.point.clone()).collect()
        };
        let (mut asked, mut places) = (Vec::new(), Vec::with_capacity(samples.len()));
        self.sampler.density_many(&every(ask), &mut asked);
        self.domain.locate_many(&every(1), &mut places);
        let (mut asked, mut places) = (asked.into_iter(), places.into_iter());
        for (i, sample) in samples.into_iter().enumerate() {
            let draw = match sample {
                None => Draw::without_point(Fate::Rejected),
                Some(sample) => {
                    let asked = if is_asked(i, ask) { asked.next().unwrap_or(f64::NAN) } else { 0.0 };
                    for known in &self.extras.known {
                        values.push((known.function)(&sample.point) / sample.density);
                    }
                    match places.next() {
                        Some(Ok(location)) => {
                            Draw { fate: Fate::Drawn, location, density: sample.density, asked }
                        }
                        _ => Draw::without_point(Fate::Outside),
                    }
                }
            };
            out.push(draw);
            values.resize(out.len() * self.extras.known.len(), 0.0); // rejected: f counts as 0
        }
    }

    fn locate(&self, xi: &[f64], out: &mut Vec<Location>) {
        let mut samples = Vec::new();
        fill_vec(self.sampler, xi, &mut samples);
        out.extend(samples.into_iter().flatten().filter_map(|sample| self.domain.locate(&sample.point).ok()));
    }

    fn look(&self, xi: &[f64]) -> Option<Look> {
        let sample = self.sampler.sample(xi)?;
        Some(Look {
            point: format!("{:?}", sample.point),
            location: self.domain.locate(&sample.point).map_err(|why| why.0),
            density: sample.density,
            asked: self.sampler.density(&sample.point),
        })
    }

    fn density_at(&self, patch: usize, at: [f64; 2]) -> (f64, f64) {
        let (point, jacobian) = self.domain.point(patch, at);
        (self.sampler.density(&point), jacobian)
    }

    fn densities_at(&self, places: &[Location], out: &mut Vec<(f64, f64)>) {
        let points = places.iter().map(|place| self.domain.point(place.patch, place.at));
        let (points, jacobians): (Vec<_>, Vec<f64>) = points.unzip();
        let mut densities = Vec::with_capacity(places.len());
        self.sampler.density_many(&points, &mut densities);
        out.clear();
        out.extend(densities.into_iter().zip(jacobians));
    }

    fn describe(&self, patch: usize, at: [f64; 2]) -> String {
        format!("{:?}", self.domain.point(patch, at).0)
    }

    fn densities_around(&self, xi: &[f64], epsilon: f64) -> Vec<f64> {
        let Some(sample) = self.sampler.sample(xi) else { return Vec::new() };
        let neighbours = self.domain.neighbours(&sample.point, epsilon);
        let mut densities = Vec::with_capacity(neighbours.len());
        self.sampler.density_many(&neighbours, &mut densities);
        densities
    }

    fn displacements(&self, from: &[f64], to: &[f64]) -> Option<Vec<([f64; 2], f64)>> {
        let points = self.points_of(&[from, to].concat())?;
        let (from, to) = points.split_first()?;
        let mut densities = Vec::with_capacity(to.len());
        self.sampler.density_many(to, &mut densities);
        to.iter()
            .zip(densities)
            .map(|(to, density)| Some((self.domain.displacement(from, to)?, density)))
            .collect()
    }

    fn densities_between(&self, from: &[f64], to: &[f64], parts: &[f64]) -> Option<Vec<f64>> {
        let ends = self.points_of(&[from, to].concat())?;
        let (a, b) = (self.domain.locate(&ends[0]).ok()?, self.domain.locate(&ends[1]).ok()?);
        let mut step = [0, 1].map(|axis| b.at[axis] - a.at[axis]);
        for (axis, step) in step.iter_mut().enumerate() {
            // The short way round.
            if self.domain.wraps(axis) && step.abs() > 0.5 {
                *step -= step.signum();
            }
        }
        let between = |part: &f64| {
            let at = [0, 1].map(|axis| (a.at[axis] + part * step[axis]).rem_euclid(1.0));
            self.domain.point(a.patch, at).0
        };
        let points: Vec<D::Point> = parts.iter().map(between).collect();
        let mut densities = Vec::with_capacity(parts.len());
        self.sampler.density_many(&points, &mut densities);
        (a.patch == b.patch).then_some(densities)
    }

    fn magnitude(&self, xi: &[f64]) -> f64 {
        self.sampler.sample(xi).map_or(0.0, |sample| self.domain.magnitude(&sample.point))
    }

    fn preimages(&self, xi: &[f64]) -> Option<Vec<Preimage>> {
        self.sampler.preimages(&self.sampler.sample(xi)?.point)
    }

    fn round_trip(&self, xi: &[f64]) -> Option<RoundTrip> {
        let point = self.sampler.sample(xi)?.point;
        let inverse = self.sampler.invert(&point)?;
        let inside: Vec<f64> =
            inverse.iter().map(|x| x.clamp(0.0, crate::random::ONE_MINUS_EPSILON_F64)).collect();
        let again = if inverse.len() == self.dimensions { self.sampler.sample(&inside) } else { None };
        let distance = again.map_or(f64::INFINITY, |again| {
            if self.domain.axes() == 0 {
                let patch = |p| self.domain.locate(p).map(|l| l.patch).ok();
                return if patch(&again.point) == patch(&point) { 0.0 } else { f64::INFINITY };
            }
            let step = self.domain.displacement(&point, &again.point);
            step.map_or(f64::INFINITY, |[a, b]| a.hypot(b))
        });
        Some(RoundTrip { xi: inverse, distance, point: format!("{point:?}") })
    }

    fn left_over(&self, xi: &[f64]) -> Option<f64> {
        self.sampler.left_over(xi)
    }

    fn cell_mass(&self, cell: &Cell) -> Option<f64> {
        self.sampler.cell_mass(cell)
    }

    fn target_at(&self, patch: usize, at: [f64; 2]) -> Option<f64> {
        let target = self.extras.target.as_ref()?;
        Some(target(&self.domain.point(patch, at).0))
    }

    fn importance(&self, xi: &[f64]) -> Option<(Vec<f64>, f64)> {
        let importance = self.extras.importance.as_ref()?;
        let ratio = |xi: &[f64]| {
            let sample = self.sampler.sample(xi)?;
            Some((importance.function)(&sample.point) / sample.density)
        };
        Some((self.each(xi).filter_map(ratio).collect(), importance.spread))
    }

    fn known(&self) -> Vec<(&str, f64)> {
        self.extras.known.iter().map(|k| (k.name.as_str(), k.integral)).collect()
    }

    fn rivals_at(&self, patch: usize, at: [f64; 2]) -> Vec<(String, f64)> {
        let point = self.domain.point(patch, at).0;
        let own = self.sampler.rivals(&point).into_iter().map(|(name, value)| (name.to_owned(), value));
        own.chain(self.extras.rivals.iter().map(|(name, f)| (name.clone(), f(&point)))).collect()
    }

    fn is_slow(&self) -> bool {
        self.sampler.is_slow()
    }
}
