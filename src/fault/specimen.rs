//! What a fault, or its correct twin, is an instance of: a sampler on one of the domains with what its author says of it, a builder of tables, streams, a
//! film, an estimator. Boxed, so that the checks are compiled once a domain and not once a fault.

use crate::domain::{Discrete, Domain, Hemisphere, Interval, MeshSurface, Sphere, Square, Triangle};
use crate::sampler::Sampler;
use crate::verify::{Estimator, Examination, Settings, Values, film, metamorphic, streams, verify};

/// A sampler of a domain, whatever its type.
pub type Boxed<D> = Box<dyn Sampler<Domain = D> + Send>;

/// A function of a point.
type Function<D> = Box<dyn Fn(&<D as Domain>::Point) -> f64 + Send + Sync>;

/// A sampler, and what its author tells the checks about it.
pub struct Trial<D: Domain> {
    sampler: Boxed<D>,
    target: Option<Function<D>>,
    importance: Option<(Function<D>, f64)>,
    rivals: Vec<(&'static str, Function<D>)>,
}

impl<D: Domain> Trial<D> {
    /// Nothing but the sampler.
    pub fn new(sampler: impl Sampler<Domain = D> + Send + 'static) -> Self {
        Self { sampler: Box::new(sampler), target: None, importance: None, rivals: Vec::new() }
    }

    /// See [`Verify::target`](crate::verify::Verify::target).
    pub fn target(self, target: impl Fn(&D::Point) -> f64 + Send + Sync + 'static) -> Self {
        Self { target: Some(Box::new(target)), ..self }
    }

    /// See [`Verify::importance`](crate::verify::Verify::importance).
    pub fn importance(
        self,
        function: impl Fn(&D::Point) -> f64 + Send + Sync + 'static,
        spread: f64,
    ) -> Self {
        Self { importance: Some((Box::new(function), spread)), ..self }
    }

    /// See [`Verify::rival`](crate::verify::Verify::rival).
    pub fn rival(
        mut self,
        name: &'static str,
        density: impl Fn(&D::Point) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.rivals.push((name, Box::new(density)));
        self
    }

    /// The sampler.
    pub fn sampler(&self) -> &Boxed<D> {
        &self.sampler
    }

    fn examine(&self, name: &str, settings: &Settings) -> Examination {
        let mut run = verify(&self.sampler).name(name).settings(settings.clone());
        if let Some(target) = &self.target {
            run = run.target(target);
        }
        if let Some((function, spread)) = &self.importance {
            run = run.importance(function, *spread);
        }
        for (name, density) in &self.rivals {
            run = run.rival(*name, density);
        }
        run.examine()
    }
}

/// A builder of a table, or why it can't be built.
type Built<D> = Result<Boxed<D>, String>;

/// What can be examined.
pub enum Specimen {
    /// A sampler of indices.
    Discrete(Trial<Discrete>),
    /// A sampler of numbers.
    Interval(Trial<Interval>),
    /// A sampler of the unit square.
    Square(Trial<Square>),
    /// A sampler of barycentric coordinates.
    Triangle(Trial<Triangle>),
    /// A sampler of points on a mesh.
    Surface(Trial<MeshSurface>),
    /// A sampler of upper directions.
    Hemisphere(Trial<Hemisphere>),
    /// A sampler of directions.
    Sphere(Trial<Sphere>),
    /// A builder of discrete tables.
    Weights(fn(&[f64]) -> Built<Discrete>),
    /// A builder of environment maps.
    Maps(fn(usize, usize, Vec<[f32; 3]>) -> Built<Sphere>),
    /// Streams of points of the unit square, for a seed.
    Streams(fn(u64) -> Vec<Vec<[f64; 2]>>),
    /// A film.
    Film(fn(Vec<Values>) -> f64),
    /// An estimator whose answer is known.
    Estimator(fn() -> Estimator<'static>),
}

macro_rules! samplers {
    ($($kind:ident $domain:ty),+) => {
        $(impl From<Trial<$domain>> for Specimen {
            fn from(trial: Trial<$domain>) -> Self {
                Self::$kind(trial)
            }
        })+
    };
}
samplers!(Discrete Discrete, Interval Interval, Square Square, Triangle Triangle, Surface MeshSurface, Hemisphere Hemisphere, Sphere Sphere);

impl Specimen {
    /// A sampler of which nothing else is said.
    pub fn sampler<D: Domain>(sampler: impl Sampler<Domain = D> + Send + 'static) -> Self
    where
        Self: From<Trial<D>>,
    {
        Trial::new(sampler).into()
    }

    /// Runs the checks. Builders are asked about tables of 65,536 samples, or fewer if the settings say so; a film draws nothing.
    ///
    /// # Panics
    /// If streams are empty or leave the unit square.
    pub fn examine(&self, name: &str, settings: &Settings) -> Examination {
        let few = || Settings { samples: settings.samples.min(1 << 16), ..settings.clone() };
        match self {
            Self::Discrete(trial) => trial.examine(name, settings),
            Self::Interval(trial) => trial.examine(name, settings),
            Self::Square(trial) => trial.examine(name, settings),
            Self::Triangle(trial) => trial.examine(name, settings),
            Self::Surface(trial) => trial.examine(name, settings),
            Self::Hemisphere(trial) => trial.examine(name, settings),
            Self::Sphere(trial) => trial.examine(name, settings),
            Self::Weights(build) => metamorphic::weights(build).name(name).settings(few()).examine(),
            Self::Maps(build) => metamorphic::maps(build).name(name).settings(few()).examine(),
            Self::Streams(make) => streams(Square, &make(settings.seed))
                .expect("streams of the unit square")
                .name(name)
                .examine(),
            Self::Film(mean) => film(mean).name(name).examine(),
            Self::Estimator(make) => make().name(name).settings(settings.clone()).examine(),
        }
    }

    /// Whether its number of samples is that of the settings.
    pub fn counts_samples(&self) -> bool {
        !matches!(self, Self::Film(_) | Self::Streams(_) | Self::Weights(_) | Self::Maps(_))
    }

    /// Whether its author names densities that a mistake may lead to.
    pub fn has_rivals(&self) -> bool {
        match self {
            Self::Hemisphere(trial) => !trial.rivals.is_empty(),
            Self::Sphere(trial) => !trial.rivals.is_empty(),
            _ => false,
        }
    }

    /// Whether more samples, or another seed, could change the answer.
    pub fn is_random(&self) -> bool {
        !matches!(self, Self::Film(_))
    }
}
