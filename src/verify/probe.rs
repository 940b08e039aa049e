//! A sampler as the checks see it: variates in, locations and densities out, whatever its points are.
//!
//! The checks are compiled once, against [`Probe`]; only the loops of this file, where samples are drawn, are compiled for every domain, and none for every
//! sampler: whoever tests many of their own waits for the compiler no longer.

use crate::domain::{Cell, Domain, Knots, Location, Space, in_short};
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
    /// The least and the largest that the density may be there, where it is known only so well.
    pub range: [f64; 2],
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
    /// Where the samples fall on the chart of the only patch, to within the error that is returned; NaN where that can't be said without a closer look.
    fn locate_roughly(&self, _xi: &[f64], _out: &mut [Vec<f32>; 2]) -> f32 {
        f32::NAN
    }
    /// Whether the density is known to be positive all over a cell, so that of the samples in it only some need be asked.
    fn is_positive_over(&self, _cell: &Cell) -> bool {
        false
    }
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

    /// Whether anybody says how dense a sample is.
    fn tells_densities(&self) -> bool {
        self.returns_density() || self.has_density()
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
                        Some(Some(location)) => {
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
        let asked = self.sampler.density(&sample.point);
        Some(Look {
            point: self.domain.in_words(&sample.point),
            location: self.domain.locate(&sample.point).map_err(|why| why.0),
            density: sample.density,
            asked,
            range: self.sampler.density_range(&sample.point).unwrap_or([asked; 2]),
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
        in_short(&self.domain.point(patch, at).0)
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
        Some(RoundTrip { xi: inverse, distance, point: in_short(&point) })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Discrete, Interval, Sphere, Square};
    use crate::sampler::{DiscreteCdf, Sample, from_fn};
    use glam::{DVec2, DVec3};

    #[test]
    fn every_so_many_are_asked() {
        let asked = |ask: usize| (0..40).filter(|&i| is_asked(i, ask)).collect::<Vec<_>>();
        assert_eq!(asked(1), (0..40).collect::<Vec<_>>());
        assert_eq!((asked(16), asked(8)), (vec![0, 16, 32], vec![0, 8, 16, 24, 32]));
        assert_eq!(
            (each_pilot(4, 9), each_pilot(4, 2)),
            (vec![0.125, 0.375, 0.625, 0.875], vec![0.125, 0.375])
        );
    }

    /// Points up to 1/2 are rejected, beyond 7/8 outside of the domain.
    fn told() -> impl Sampler<Domain = Interval> {
        from_fn(
            Interval::new(0.0, 4.0),
            |u: f64| (u >= 0.5).then_some((if u > 0.875 { 5.0 } else { 4.0 * u }, 2.0)),
            |x: f64| 3.0 * x,
        )
    }

    #[test]
    fn samples_that_are_drawn() {
        let sampler = told();
        let mut extras = Extras::default();
        let probe = Subject::new(&sampler, &extras);
        let (mut draws, mut values) = (Vec::new(), vec![1.0]);
        probe.draw(&[0.5, 0.25, 0.75, 0.9], 1, &mut draws, &mut values);
        let found: Vec<_> = draws.iter().map(|d| (d.fate, d.location.at[0], d.density, d.asked)).collect();
        let nowhere = |fate| (fate, 0.0, 0.0, 0.0);
        assert_eq!(
            found,
            [
                (Fate::Drawn, 0.5, 2.0, 6.0),
                nowhere(Fate::Rejected),
                (Fate::Drawn, 0.75, 2.0, 9.0),
                nowhere(Fate::Outside)
            ]
        );
        assert!(values.is_empty());
        probe.draw(&[0.5, 0.625, 0.75], 2, &mut draws, &mut values);
        assert_eq!(draws.iter().map(|d| d.asked).collect::<Vec<_>>(), [6.0, 0.0, 9.0]);
        let mut places = Vec::new();
        probe.locate(&[0.5, 0.25, 0.75, 0.9], &mut places);
        assert_eq!(places.iter().map(|l| l.at[0]).collect::<Vec<_>>(), [0.5, 0.75]);
        // Functions over the density, 0 of what is rejected.
        let known = |name: &str, factor: f64| Known {
            name: name.to_owned(),
            function: Box::new(move |x: &f64| factor * x),
            integral: factor,
        };
        extras.known = vec![known("a", 1.0), known("b", 10.0)];
        let probe = Subject::new(&sampler, &extras);
        probe.draw(&[0.5, 0.25, 0.75, 0.9], 1, &mut draws, &mut values);
        assert_eq!(values, [1.0, 10.0, 0.0, 0.0, 1.5, 15.0, 2.5, 25.0]);
        assert_eq!(probe.known(), [("a", 1.0), ("b", 10.0)]);
        assert_eq!(
            (probe.left_over(&[0.5]), probe.pilots(), probe.load(3, 7), probe.rows_expected(9)),
            (None, None, 7, 9)
        );
        assert!(probe.has_density() && probe.returns_density() && !probe.is_slow() && !probe.partial());
        // Nothing is known of a place without a closer look.
        assert!(probe.locate_roughly(&[0.75], &mut [vec![], vec![]]).is_nan());
    }

    #[test]
    fn one_sample_closely() {
        let sampler = told();
        let extras = Extras {
            target: Some(Box::new(|x: &f64| x + 1.0)),
            known: vec![],
            rivals: vec![("mine".to_owned(), Box::new(|x: &f64| 7.0 * x))],
            importance: Some(Importance { function: Box::new(|x: &f64| 8.0 * x), spread: 0.25 }),
        };
        let probe = Subject::new(&sampler, &extras);
        let look = probe.look(&[0.75]).unwrap();
        assert_eq!(
            (look.point.as_str(), look.density, look.asked, look.location.unwrap().at[0]),
            ("3.000", 2.0, 9.0, 0.75)
        );
        assert!(probe.look(&[0.25]).is_none() && probe.look(&[0.9]).unwrap().location.is_err());
        assert_eq!(
            (probe.density_at(0, [0.25, 0.0]), probe.target_at(0, [0.25, 0.0])),
            ((3.0, 4.0), Some(2.0))
        );
        let (mut answers, place) = (vec![(1.0, 1.0)], |x: f64| Location { patch: 0, at: [x, 0.0] });
        probe.densities_at(&[place(0.25), place(0.5)], &mut answers);
        assert_eq!(answers, [(3.0, 4.0), (6.0, 4.0)]);
        assert_eq!(
            (probe.describe(0, [0.25, 0.0]).as_str(), probe.called(&[0.5]).as_str()),
            ("1.000", "xi = [0.5]")
        );
        assert_eq!(probe.densities_around(&[0.5], 0.25), [3.0, 9.0]);
        assert_eq!((probe.densities_around(&[0.25], 0.25), probe.magnitude(&[0.25])), (vec![], 0.0));
        assert_eq!(probe.magnitude(&[0.5]), sampler.domain().magnitude(&2.0));
        assert_eq!(probe.importance(&[0.5, 0.25, 0.75]), Some((vec![8.0, 12.0], 0.25)));
        assert_eq!(probe.rivals_at(0, [0.5, 0.0]), [("mine".to_owned(), 14.0)]);
        // By the measure: a quarter of the variates is 1 of 4.
        assert_eq!(
            probe.displacements(&[0.5], &[0.75, 0.5]),
            Some(vec![([1.0, 0.0], 9.0), ([0.0, 0.0], 6.0)])
        );
        assert_eq!((probe.displacements(&[0.5], &[0.25]), probe.displacements(&[0.5], &[0.9])), (None, None));
        assert_eq!(probe.densities_between(&[0.5], &[0.75], &[0.25, 0.5]), Some(vec![6.75, 7.5]));
        assert_eq!(
            (
                probe.densities_between(&[0.5], &[0.25], &[0.5]),
                probe.densities_between(&[0.5], &[0.9], &[0.5])
            ),
            (None, None)
        );
        let none = Extras::default();
        let probe = Subject::new(&sampler, &none);
        assert_eq!(
            (probe.target_at(0, [0.5; 2]), probe.importance(&[0.5]), probe.rivals_at(0, [0.5; 2])),
            (None, None, vec![])
        );
    }

    /// Around the seam of a sphere the short way, and between patches no way.
    #[test]
    fn ways_between_two_samples() {
        let at =
            |theta: f64, phi: f64| DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        let tau = std::f64::consts::TAU;
        let sphere =
            from_fn(Sphere, move |[u, v]: [f64; 2]| at(tau / 2.0 * u, tau * v), |w: DVec3| w.y.atan2(w.x));
        let extras = Extras::default();
        let probe = Subject::new(&sphere, &extras);
        let near = |found: Option<Vec<f64>>, expected: [f64; 2]| {
            let found = found.unwrap();
            assert!(
                found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9),
                "{found:?}, not {expected:?}"
            );
        };
        near(probe.densities_between(&[0.5, 0.125], &[0.5, 0.375], &[0.25, 0.5]), [0.1875 * tau, 0.25 * tau]);
        near(
            probe.densities_between(&[0.5, 0.9375], &[0.5, 0.0625], &[0.25, 0.75]),
            [-0.03125 * tau, 0.03125 * tau],
        );
        near(
            probe.densities_between(&[0.5, 0.0625], &[0.5, 0.9375], &[0.25, 0.75]),
            [0.03125 * tau, -0.03125 * tau],
        );
        // Along theta there is no way round.
        let square = from_fn(Square, |xi: [f64; 2]| DVec2::new(xi[0], xi[1]), |p: DVec2| p.x + 10.0 * p.y);
        let extras = extras_of();
        let probe = Subject::new(&square, &extras);
        near(
            probe.densities_between(&[0.125, 0.5], &[0.875, 0.25], &[0.25, 0.5]),
            [0.3125 + 4.375, 0.5 + 3.75],
        );
        let table = DiscreteCdf::new(&[1.0; 4]).unwrap();
        let none = none_of();
        let probe = Subject::new(&table, &none);
        assert_eq!(probe.densities_between(&[0.1], &[0.9], &[0.5]), None);
        assert_eq!(probe.displacements(&[0.1], &[0.9]), None);
    }

    fn extras_of() -> Extras<'static, DVec2> {
        Extras::default()
    }

    fn none_of() -> Extras<'static, usize> {
        Extras::default()
    }

    #[test]
    fn how_well_an_inverse_inverts() {
        struct Odd(Vec<f64>);
        impl Sampler for Odd {
            type Domain = Square;
            fn domain(&self) -> Square {
                Square
            }
            fn dimensions(&self) -> usize {
                2
            }
            fn sample(&self, xi: &[f64]) -> Option<Sample<DVec2>> {
                (xi[0] < 0.9).then_some(Sample { point: DVec2::new(xi[0], xi[1]), density: 1.0 })
            }
            fn density(&self, _: &DVec2) -> f64 {
                1.0
            }
            fn invert(&self, _: &DVec2) -> Option<Vec<f64>> {
                Some(self.0.clone())
            }
        }
        let trip = |inverse: &[f64]| {
            let (sampler, extras) = (Odd(inverse.to_vec()), extras_of());
            let trip = Subject::new(&sampler, &extras).round_trip(&[0.5, 0.25]).unwrap();
            assert_eq!((trip.xi.as_slice(), trip.point.as_str()), (inverse, "(0.500, 0.250)"));
            trip.distance
        };
        assert_eq!(
            (trip(&[0.5, 0.25]), trip(&[0.75, 0.25]), trip(&[0.5, 0.0]), trip(&[0.8, 0.65])),
            (0.0, 0.25, 0.25, 0.3_f64.hypot(0.4))
        );
        assert_eq!(
            (trip(&[0.95, 0.25]), trip(&[0.5]), trip(&[0.5, 0.25, 0.5])),
            (f64::INFINITY, f64::INFINITY, f64::INFINITY)
        );
        // Beyond the ends, the ends.
        assert_eq!((trip(&[-1.0, 0.25]), trip(&[0.5, 1.25]) < 0.75), (0.5, true));
        let (sampler, extras) = (Odd(vec![]), extras_of());
        assert!(Subject::new(&sampler, &extras).round_trip(&[0.95, 0.5]).is_none());
        let entries = |inverse: f64| {
            struct Entries(f64);
            impl Sampler for Entries {
                type Domain = Discrete;
                fn domain(&self) -> Discrete {
                    Discrete::new(2)
                }
                fn dimensions(&self) -> usize {
                    1
                }
                fn sample(&self, xi: &[f64]) -> Option<Sample<usize>> {
                    Some(Sample { point: usize::from(xi[0] >= 0.5), density: 0.5 })
                }
                fn density(&self, _: &usize) -> f64 {
                    0.5
                }
                fn invert(&self, _: &usize) -> Option<Vec<f64>> {
                    Some(vec![self.0])
                }
            }
            let (sampler, extras) = (Entries(inverse), none_of());
            Subject::new(&sampler, &extras).round_trip(&[0.75]).unwrap().distance
        };
        assert_eq!((entries(0.5), entries(0.25)), (0.0, f64::INFINITY));
    }
}
