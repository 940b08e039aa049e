//! Error against run time: how fast strategies come to the right picture.
//!
//! For every strategy, several pictures of independent seeds are rendered pass by pass, each on one thread, and measured at 1, 2, 4,
//! 8, … passes. With x the mean of a picture at a pixel and channel, r the reference, and v the squared standard error of r, the measures are
//!
//! - squared error: mean over pixels and channels of (x - r)^2 - v;
//! - relative squared error: mean of ((x - r)^2 - v) / (r^2 + epsilon), epsilon = (m / 10)^2 with m the mean of the reference;
//! - worst tile: the largest, over tiles of [`Experiment::tile`] pixels, of the mean relative squared error inside.
//!
//! The error of the reference is taken off, so (but for the maximum) their expectations are those of a perfect reference. They are of
//! error, not of variance: bias is in them. Means and standard errors are over seeds; what chance made of the reference, which all seeds share, is
//! added to the latter (but for the maximum): v is the expectation of its squared error e^2, which scatters about it by 2 v^2 if e is normal.
//!
//! - Slope: y = A n^b is fitted to the mean squared error y of each count by the quasi-likelihood of a constant relative error
//!   (sum of (y / A n^b - 1)(1, ln n) = 0; McCullagh and Nelder 1989, section 8.3: least squares of ln y without the bias that the
//!   logarithm of a noisy mean has); half of b is the slope of the root, -1/2 if nothing is wrong. Its interval is the delete-one jackknife over seeds (Efron 1982) with
//!   Student's t, since the measures of one picture depend on each other. Measures that the reference's own error exceeds a third of are left out.
//! - Efficiency: 1 / (squared error x CPU time of a picture), at the largest count.
//! - Bias: the squared bias is the mean over pixels and pairs of seeds i, j of (x_i - r)(x_j - r) - v, whose expectation no variance is in.
//! - Outliers: the share of the summed squared error that the worst 0.1% of the pixels have.
//!
//! Where the reference is a closed form of some materials ([`Truth::Parts`]), all means are over the pixels that show one of them and nothing else.
//!
//! Everything but the times is the same to the last bit for any number of threads.

use super::{Clock, Cost, Film, Integrator, Lights, Pixel, Settings, Strategy, render, share_out_of_reach};
use crate::picture::{Field, Picture};
use crate::random::stream;
use crate::sampler::Heuristic;
use crate::scene::{RayQueries, Scene};
use crate::statistics::{Moments, student_t};
use rand::Rng;
use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

/// Share of the pixels that are called outliers.
pub const OUTLIERS: f64 = 1e-3;
/// Confidence of the intervals.
pub const CONFIDENCE: f64 = 0.95;
/// The fewest passes of a picture: one has no standard error, and no slope.
pub const LEAST_PASSES: u32 = 2;
/// Passes of the pilot that finds the best strategy and what a pass costs.
const PILOT: u32 = 8;
/// Passes of the reference for every pass of a picture.
const REFERENCE: u32 = 16;
/// The first counts cost more than their share, since everything is cold: the fit does without, if enough are left.
const WARM: u32 = 4;

/// What is rendered and measured.
#[derive(Clone)]
pub struct Experiment {
    /// The strategies.
    pub strategies: Vec<Strategy>,
    /// Pictures of each strategy, at least 2.
    pub seeds: u32,
    /// How long each is rendered.
    pub budget: Budget,
    /// Seed of everything.
    pub seed: u64,
    /// What is right.
    pub truth: Truth,
    /// Pixels along the side of a tile.
    pub tile: usize,
    /// Parts of the picture that are measured on their own.
    pub regions: Vec<Region>,
    /// Called, from any thread, with the passes done and all there are to be.
    pub progress: Option<Arc<dyn Fn(u64, u64) + Send + Sync>>,
    /// Set to stop after the pass; what is measured is kept.
    pub stop: Option<Arc<AtomicBool>>,
}

impl Default for Experiment {
    fn default() -> Self {
        let mis = Strategy::Mis { brdf_weight: 0.5 };
        let mis_two = Strategy::MisTwo { heuristic: Heuristic::Balance };
        Self {
            strategies: vec![Strategy::Brdf, Strategy::Light, mis, mis_two],
            seeds: 8,
            budget: Budget::Passes(256),
            seed: 1,
            truth: Truth::LongRun(None),
            tile: 16,
            regions: Vec::new(),
            progress: None,
            stop: None,
        }
    }
}

impl Experiment {
    /// With the regions cut down to what the truth is known of.
    fn of_what_is_known(&self) -> Self {
        let mut plan = self.clone();
        if let Truth::Parts(parts) = &self.truth {
            let known: HashSet<_> = parts.iter().flat_map(|(part, _)| &part.pixels).collect();
            plan.regions.iter_mut().for_each(|r| r.pixels.retain(|pixel| known.contains(pixel)));
            plan.regions.retain(|r| !r.pixels.is_empty());
        }
        plan
    }
}

/// How long a picture is rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// So many samples a pixel, whatever they cost, at least [`LEAST_PASSES`].
    Passes(u32),
    /// As many as a pilot says fit into so many seconds of CPU time, at least [`LEAST_PASSES`]: more of what is cheap.
    Seconds(f64),
}

/// The strategy that a long run is made by: it draws both from the lights and from the lobes, so that nothing stays unseen for long. (The one of least
/// variance, by its own account, may be one that has not seen what there is.)
pub const LONG_RUN: Strategy = Strategy::MisTwo { heuristic: Heuristic::Balance };

/// What pictures are compared with.
#[derive(Clone, Debug)]
pub enum Truth {
    /// 16 times as many samples of a strategy, from other seeds; if none is named, of [`LONG_RUN`]. Its error is estimated.
    LongRun(Option<Strategy>),
    /// A picture of the same size, taken as exact.
    Picture(Picture),
    /// Parts of the picture whose radiance is known exactly; what is in none of them is left out of all measures.
    Parts(Vec<(Region, [f32; 3])>),
}

impl Truth {
    /// The strategy of the long run, if it is one.
    pub fn long_run(&self) -> Option<Strategy> {
        match self {
            Self::LongRun(named) => Some(named.unwrap_or(LONG_RUN)),
            Self::Picture(_) | Self::Parts(_) => None,
        }
    }

    /// The closed form of the scene: the pixels that show nothing but a material whose radiance its `[reference]` names. None if there is no such pixel.
    ///
    /// ```
    /// use warpcheck::estimator::Truth;
    /// use warpcheck::scene::Scene;
    /// let scene = Scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/furnace.toml"))?;
    /// let Some(Truth::Parts(parts)) = Truth::closed_form(&scene) else { panic!() };
    /// assert_eq!((parts[0].0.name.as_str(), parts[0].1), ("ball", [0.8, 0.5, 0.2]));
    /// # Ok::<(), warpcheck::scene::Error>(())
    /// ```
    pub fn closed_form(scene: &Scene) -> Option<Self> {
        let known = scene.reference.as_ref().map(|r| &r.radiance).filter(|known| !known.is_empty())?;
        let parts = regions_by_material(scene).into_iter();
        let parts: Vec<_> = parts
            .filter_map(|region| {
                let radiance = known.get(&region.name)?.to_array();
                Some((region, radiance))
            })
            .collect();
        (!parts.is_empty()).then_some(Self::Parts(parts))
    }
}

/// A part of the picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Region {
    /// What it shows.
    pub name: String,
    /// Pixels, as indices in row order.
    pub pixels: Vec<usize>,
}

/// The pixels that show one material and nothing else (at their corners and in the middle), by its name.
pub fn regions_by_material(scene: &Scene) -> Vec<Region> {
    let (width, height) = (scene.picture.width as usize, scene.picture.height as usize);
    let mut regions = BTreeMap::<&str, Vec<usize>>::new();
    for pixel in 0..width * height {
        let (x, y) = ((pixel % width) as f32, (pixel / width) as f32);
        let mut seen = [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(dx, dy)| {
            let hit = scene.rays().closest(&scene.camera.ray(x + dx, y + dy))?;
            Some(scene.material(hit.triangle).name.as_str())
        });
        seen.sort();
        if let (Some(name), true) = (seen[0], seen[0] == seen[4]) {
            regions.entry(name).or_default().push(pixel);
        }
    }
    regions.into_iter().map(|(name, pixels)| Region { name: name.to_owned(), pixels }).collect()
}

/// A mean over seeds and its standard error; NaN for less than two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
}

impl Measured {
    fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let moments: Moments = values.into_iter().collect();
        Self { mean: moments.mean(), error: moments.standard_error().unwrap_or(f64::NAN) }
    }

    /// With another, independent error.
    fn and(self, error: f64) -> Self {
        Self { error: self.error.hypot(error), ..self }
    }
}

/// A figure with its interval at [`CONFIDENCE`]; infinite if there are too few seeds for one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The figure.
    pub value: f64,
    /// Half the width of its interval.
    pub half_width: f64,
}

/// How many standard errors an interval at [`CONFIDENCE`] reaches to either side (Student's t); infinite without a degree of freedom.
pub(crate) fn standard_errors(freedom: f64) -> f64 {
    student_t::isf(0.5 * (1.0 - CONFIDENCE), freedom).unwrap_or(f64::INFINITY)
}

impl Interval {
    /// Whether a value lies inside.
    pub fn contains(&self, value: f64) -> bool {
        (self.value - value).abs() <= self.half_width
    }
}

/// The measures of all pictures of a strategy at one count of passes.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    /// Samples a pixel.
    pub passes: u32,
    /// Pictures that came so far.
    pub seeds: usize,
    /// CPU seconds of a picture's passes.
    pub cpu: Measured,
    /// Seconds on the wall, likewise, of one thread.
    pub wall: Measured,
    /// Squared error, in radiance squared.
    pub squared: Measured,
    /// Relative squared error.
    pub relative: Measured,
    /// The largest relative squared error of a tile.
    pub worst_tile: Measured,
    /// Squared error of each of [`Convergence::regions`].
    pub regions: Vec<Measured>,
}

/// A strategy's way to the right picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The strategy.
    pub strategy: Strategy,
    /// Measures at growing counts of passes.
    pub rungs: Vec<Rung>,
    /// Slope of the logarithm of the root of the squared error over that of the CPU time.
    pub slope_time: Option<Interval>,
    /// The same over the number of samples.
    pub slope_samples: Option<Interval>,
    /// A, b of the squared error A t^b over CPU seconds.
    pub fit_time: Option<(f64, f64)>,
    /// A, b of the squared error A n^b over passes.
    pub fit_samples: Option<(f64, f64)>,
    /// 1 / (squared error x CPU seconds).
    pub efficiency: f64,
    /// Squared error that is common to all seeds, in radiance squared, and its standard error, from how it scatters over the pixels: too
    /// large where there is bias, and more of it in some pixels.
    pub squared_bias: Measured,
    /// Share of the squared error in the worst 0.1% of the pixels of a picture.
    pub outliers: Measured,
    /// The variance that the films claim over the squared error: 1 if right, less if the films have not seen what makes up the error.
    pub claimed: f64,
    /// For tiles of [`WINNER_TILE`] pixels: squared error x CPU seconds.
    pub cost: Field,
    /// The standard error of that, over seeds.
    pub cost_error: Field,
    /// Samples that were NaN or infinite, in all pictures.
    pub non_finite: u64,
    /// CPU seconds of a picture before its first pass, which are not in the times of the rungs: `mis:auto` chooses its weights.
    pub before: Measured,
    /// Share of the tiles that show a lobe which the samples of the largest count hardly find. What error it has there is not known until they do,
    /// so that slope, efficiency and time to reach an error are none of the whole picture.
    pub out_of_reach: f64,
}

/// Relative errors below this are those of `f32` pictures.
const EXACT: f64 = 1e-6;

/// Pixels along the side of what [`Convergence::winners`] decides about.
pub const WINNER_TILE: usize = 8;

impl Curve {
    /// The measures at the largest count.
    pub fn last(&self) -> Option<&Rung> {
        self.rungs.last()
    }

    /// Whether all of its error is rounding (root mean square below 1e-6 of the radiance): then slopes, bias and efficiency say nothing.
    pub fn is_exact(&self) -> bool {
        self.last().is_some_and(|last| last.relative.mean < EXACT * EXACT)
    }

    /// Whether its samples can have found all lobes that are shown, so that its error is that of the whole picture.
    pub fn sees_all(&self) -> bool {
        self.out_of_reach == 0.0
    }

    /// Passes and CPU seconds until the root of the squared error is `root`, by the fits: beyond the last count, an extrapolation.
    pub fn to_reach(&self, root: f64) -> Option<(f64, f64)> {
        let at = |(a, b): (f64, f64)| (b < 0.0).then(|| (root * root / a).powf(1.0 / b));
        Some((at(self.fit_samples?)?, at(self.fit_time?)?))
    }
}

/// What pictures were compared with.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The mean radiance.
    pub picture: Picture,
    /// The strategy and passes of a long run; none if it was given.
    pub run: Option<(Strategy, u32)>,
    /// Its own mean squared error, estimated; 0 if it was given.
    pub squared_error: f64,
    /// What it took, on all threads: wall time only.
    pub wall: f64,
    /// The parts whose radiance is known in closed form, and which alone are compared; none if the whole picture is.
    pub parts: Vec<(String, [f32; 3])>,
    variance: Vec<[f32; 3]>,
    /// Whether a pixel is compared.
    compared: Vec<bool>,
}

impl Reference {
    /// Without an error.
    fn exact(picture: Picture, parts: Vec<(String, [f32; 3])>, compared: Vec<bool>) -> Self {
        let variance = vec![[0.0; 3]; compared.len()];
        Self { picture, run: None, squared_error: 0.0, wall: 0.0, parts, variance, compared }
    }

    /// How many pixels are compared.
    pub fn pixels(&self) -> usize {
        self.compared.iter().filter(|&&compared| compared).count()
    }

    /// Of values for all pixels, those of the pixels that are compared.
    fn only<'a, T: 'a>(&'a self, all: impl IntoIterator<Item = T> + 'a) -> impl Iterator<Item = T> + 'a {
        all.into_iter().zip(&self.compared).filter_map(|(value, &compared)| compared.then_some(value))
    }

    /// The standard error that its own makes, weighted by what `weight` says of pixel and channel, in the mean over `pixels`. Channels may be one and
    /// the same, and count as such.
    fn own_error(
        &self,
        pixels: impl ExactSizeIterator<Item = usize>,
        weight: impl Fn(usize, usize) -> f64,
    ) -> f64 {
        let count = pixels.len() as f64;
        let off = |p: usize| (0..3).map(|c| f64::from(self.variance[p][c]) * weight(p, c)).sum::<f64>() / 3.0;
        (2.0 * pixels.map(|p| off(p).powi(2)).sum::<f64>()).sqrt() / count
    }
}

/// What [`Convergence::winners`] says of a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Winner {
    /// The place of the strategy with the least squared error x time on the list.
    pub strategy: usize,
    /// How many times more the second needs; infinite if the error of the first can't be told from 0.
    pub lead: f64,
    /// Whether all others need more by more than chance, at [`CONFIDENCE`] for a tile.
    pub is_sure: bool,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Convergence {
    /// One for every strategy, in the order of the plan.
    pub curves: Vec<Curve>,
    /// What is right.
    pub reference: Reference,
    /// Epsilon of the relative squared error, in radiance squared.
    pub epsilon: f64,
    /// Names and sizes in pixels of [`Experiment::regions`], without the pixels that are not compared and the regions that have no others.
    pub regions: Vec<(String, usize)>,
    /// Pixels along the side of a tile.
    pub tile: usize,
    /// Pictures of each strategy.
    pub seeds: u32,
    /// Seed of everything.
    pub seed: u64,
    /// Whether it was stopped before all was measured.
    pub stopped: bool,
}

/// What one picture had at one count.
struct Sight {
    passes: u32,
    cost: Cost,
    squared: f64,
    relative: f64,
    worst_tile: f64,
    regions: Vec<f64>,
}

/// One picture, measured on the way.
#[derive(Default)]
struct Run {
    sights: Vec<Sight>,
    /// x - r at the last sight.
    difference: Vec<[f32; 3]>,
    /// Mean squared standard error that the film claims.
    claimed: f64,
    outliers: f64,
    non_finite: u64,
    /// CPU seconds before the first pass.
    before: f64,
}

/// Renders and measures.
///
/// ```
/// use warpcheck::estimator::{Budget, Lights, Experiment, Strategy, convergence};
/// use warpcheck::scene::Scene;
/// let file = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml");
/// let text = std::fs::read_to_string(file)?.replace("256", "16");
/// let scene = Scene::from_toml(&text, file)?;
/// let plan = Experiment { strategies: vec![Strategy::Light], seeds: 3, budget: Budget::Passes(16), ..Experiment::default() };
/// let found = convergence(&scene, &Lights::load(&scene)?, &plan);
/// let slope = found.curves[0].slope_samples.unwrap();
/// assert!(slope.contains(-0.5), "{slope:?}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Panics
/// If there is no strategy, the tile is 0, a picture that is given has another size than the scene's, or the parts that are known have no pixel.
pub fn convergence(scene: &Scene, lights: &Lights, plan: &Experiment) -> Convergence {
    assert!(!plan.strategies.is_empty() && plan.tile > 0, "nothing to measure");
    let plan = &plan.of_what_is_known();
    let work = Work::new(scene, lights, plan);
    let reference = work.reference();
    let pixels = reference.picture.pixels().len();
    let sum = reference.only(reference.picture.pixels()).flatten().map(|&r| f64::from(r)).sum::<f64>();
    let mean = sum / (3 * reference.pixels()) as f64;
    let epsilon = (0.1 * mean).powi(2).max(f64::MIN_POSITIVE);
    let own = OwnError {
        squared: reference.own_error(0..pixels, |_, _| 1.0),
        relative: reference.own_error(0..pixels, |p, c| {
            1.0 / (f64::from(reference.picture.pixels()[p][c]).powi(2) + epsilon)
        }),
        regions: {
            let regions = plan.regions.iter();
            regions.map(|r| reference.own_error(r.pixels.iter().copied(), |_, _| 1.0)).collect()
        },
    };
    let count = plan.strategies.len();
    // Seeds come one after the other, so that what is done when it is stopped is something of every strategy.
    let runs = work.on_threads(count * plan.seeds as usize, |i| {
        let (strategy, seed) = (i % count, i / count);
        work.run(strategy, seed as u64, &reference, epsilon)
    });
    let of = |strategy: usize| {
        let runs: Vec<_> =
            runs.iter().skip(strategy).step_by(count).filter(|r| !r.sights.is_empty()).collect();
        curve(scene, plan, strategy, &runs, &reference, &own)
    };
    Convergence {
        curves: (0..count).map(of).collect(),
        epsilon,
        regions: plan.regions.iter().map(|r| (r.name.clone(), r.pixels.len())).collect(),
        tile: plan.tile,
        seeds: plan.seeds,
        seed: plan.seed,
        stopped: work.stopped(),
        reference,
    }
}

impl Convergence {
    /// The most CPU seconds that every strategy's pictures had, each up to its largest count.
    pub fn common_time(&self) -> Option<f64> {
        let times = self.curves.iter().map(|c| c.last().map(|rung| rung.cpu.mean));
        times.collect::<Option<Vec<_>>>()?.into_iter().reduce(f64::min)
    }

    /// For every strategy, a picture of as many passes as fit into `seconds` of CPU time by what was measured, at least 1; how many is
    /// the only thing about it that depends on times. They have the seeds of the first pictures that were measured.
    pub fn at_equal_time(&self, scene: &Scene, lights: &Lights, seconds: f64) -> Vec<(u32, Film)> {
        let pictures = self.curves.iter().map(|curve| {
            let pass = curve.last().map_or(f64::INFINITY, |r| r.cpu.mean / f64::from(r.passes));
            let spp = ((seconds / pass).round() as u32).max(1);
            let seed = seed_of(self.seed, "picture", curve.strategy, 0);
            (spp, render(scene, lights, curve.strategy, Settings { spp, seed }, |_| true).film)
        });
        pictures.collect()
    }

    /// |x - r| / sqrt(r^2 + epsilon), the root of its mean square over the channels; NaN where nothing is compared.
    pub fn error_map(&self, film: &Film) -> Field {
        let width = film.width();
        Field::from_fn(width, film.height(), |x, y| {
            if !self.reference.compared[y * width + x] {
                return f64::NAN;
            }
            let (mean, r) = (film.pixel(x, y).mean(), self.reference.picture.pixels()[y * width + x]);
            let squares = (0..3).map(|c| {
                let r = f64::from(r[c]);
                (mean[c] - r).powi(2) / (r * r + self.epsilon)
            });
            (squares.sum::<f64>() / 3.0).sqrt()
        })
    }

    /// For tiles of [`WINNER_TILE`] pixels: the strategy with the least squared error x time; none where all are without error.
    pub fn winners(&self) -> Vec<Option<Winner>> {
        let tiles = self.curves[0].cost.values().len();
        if self.curves.iter().all(Curve::is_exact) {
            return vec![None; tiles];
        }
        let seeds = |i: usize| self.curves[i].last().map_or(0, |last| last.seeds);
        let winner = |tile: usize| {
            let at = |c: &Curve| (c.cost.values()[tile], c.cost_error.values()[tile]);
            let mut costs: Vec<_> = self.curves.iter().map(at).enumerate().collect();
            costs.retain(|(_, (cost, _))| !cost.is_nan());
            costs.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
            let (&(best, (least, error)), others) = costs.split_first()?;
            let second = others.first().map_or(f64::INFINITY, |(_, (cost, _))| *cost);
            let is_more = |&(other, (cost, its_error)): &(usize, (f64, f64))| {
                let freedom = (seeds(best) + seeds(other)) as f64 - 2.0;
                cost - least > standard_errors(freedom) * error.hypot(its_error)
            };
            (second > 0.0).then(|| Winner {
                strategy: best,
                lead: second / least.max(0.0),
                is_sure: others.iter().all(is_more),
            })
        };
        (0..tiles).map(winner).collect()
    }
}

fn seed_of(seed: u64, purpose: &str, strategy: Strategy, number: u64) -> u64 {
    stream(seed, &format!("converge {purpose} {strategy}"), number).next_u64()
}

struct Work<'a> {
    scene: &'a Scene,
    lights: &'a Lights,
    plan: &'a Experiment,
    /// Passes of each strategy.
    passes: Vec<u32>,
    done: AtomicU64,
    total: u64,
}

impl<'a> Work<'a> {
    fn new(scene: &'a Scene, lights: &'a Lights, plan: &'a Experiment) -> Self {
        let count = plan.strategies.len();
        let mut work = Self { scene, lights, plan, passes: Vec::new(), done: AtomicU64::new(0), total: 0 };
        work.passes = match plan.budget {
            Budget::Passes(passes) => vec![passes.max(LEAST_PASSES); count],
            Budget::Seconds(s) => work.on_threads(count, |i| {
                let strategy = plan.strategies[i];
                let settings = Settings { spp: 0, seed: seed_of(plan.seed, "pilot", strategy, 0) };
                let integrator = Integrator::new(scene, lights, strategy);
                let mut pilot = render(scene, lights, strategy, settings, |_| true);
                pilot.prepare(&integrator);
                let clock = Clock::start();
                pilot.resume_with(&integrator, PILOT, |_| !work.stopped());
                let pass = clock.read().cpu.as_secs_f64() / f64::from(PILOT);
                ((s / pass) as u32).max(LEAST_PASSES)
            }),
        };
        let pictures = work.passes.iter().map(|&p| u64::from(p) * u64::from(plan.seeds)).sum::<u64>();
        work.total = pictures + u64::from(work.reference_passes());
        work
    }

    fn reference_passes(&self) -> u32 {
        let Some(strategy) = self.plan.truth.long_run() else { return 0 };
        let place = self.plan.strategies.iter().position(|&listed| listed == strategy);
        let passes = place.map(|i| self.passes[i]).or(self.passes.iter().copied().min());
        passes.map_or(0, |passes| passes.saturating_mul(REFERENCE))
    }

    fn stopped(&self) -> bool {
        self.plan.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// Counts a pass; whether to go on.
    fn pass(&self) -> bool {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.plan.progress.iter().for_each(|progress| progress(done, self.total));
        !self.stopped()
    }

    /// `f(0), …, f(count - 1)`, each on one thread alone, as many at a time as there are threads.
    fn on_threads<T: Send>(&self, count: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
        let next = AtomicUsize::new(0);
        let work = || {
            // What is parallel inside of it happens on this one thread, which can then read its own clock.
            let alone =
                rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
            let indices =
                std::iter::from_fn(|| Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&i| i < count));
            indices.map(|i| (i, alone.install(|| f(i)))).collect::<Vec<_>>()
        };
        let workers = rayon::current_num_threads().min(count);
        let mut results: Vec<_> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
            threads
                .into_iter()
                .flat_map(|t| t.join().unwrap_or_else(|e| std::panic::resume_unwind(e)))
                .collect()
        });
        results.sort_by_key(|&(i, _)| i);
        results.into_iter().map(|(_, result)| result).collect()
    }

    fn reference(&self) -> Reference {
        let [width, height] = [self.scene.picture.width, self.scene.picture.height].map(|x| x as usize);
        let pixels = width * height;
        let named = match &self.plan.truth {
            Truth::LongRun(named) => *named,
            Truth::Picture(picture) => {
                let size = [picture.width(), picture.height()];
                let wanted = [width, height];
                assert_eq!(size, wanted, "the reference has another size than the scene's picture");
                return Reference::exact(picture.clone(), Vec::new(), vec![true; pixels]);
            }
            Truth::Parts(parts) => {
                let (mut radiance, mut compared) = (vec![[0.0; 3]; pixels], vec![false; pixels]);
                for (region, known) in parts {
                    for &pixel in &region.pixels {
                        (radiance[pixel], compared[pixel]) = (*known, true);
                    }
                }
                assert!(compared.contains(&true), "the parts that are known have no pixel");
                let picture = Picture::from_fn(width, height, |x, y| radiance[y * width + x]);
                let names = parts.iter().map(|(region, known)| (region.name.clone(), *known));
                return Reference::exact(picture, names.collect(), compared);
            }
        };
        let strategy = named.unwrap_or(LONG_RUN);
        let clock = Clock::start();
        let settings = Settings {
            spp: self.reference_passes(),
            seed: seed_of(self.plan.seed, "reference", strategy, 0),
        };
        let rendered = render(self.scene, self.lights, strategy, settings, |_| self.pass());
        let variance = rendered.film.pixels().iter();
        Reference {
            picture: rendered.film.picture(),
            run: Some((strategy, rendered.passes)),
            squared_error: claimed_variance(rendered.film.pixels()),
            wall: clock.read().wall.as_secs_f64(),
            parts: Vec::new(),
            compared: vec![true; pixels],
            variance: variance.map(|p| p.standard_error().map(|e| (e * e) as f32)).collect(),
        }
    }

    fn run(&self, strategy: usize, number: u64, reference: &Reference, epsilon: f64) -> Run {
        let mut run = Run::default();
        if self.stopped() {
            return run;
        }
        let (strategy, most) = (self.plan.strategies[strategy], self.passes[strategy]);
        let settings = Settings { spp: 0, seed: seed_of(self.plan.seed, "picture", strategy, number) };
        let integrator = Integrator::new(self.scene, self.lights, strategy);
        let mut rendered = render(self.scene, self.lights, strategy, settings, |_| true);
        let clock = Clock::start();
        rendered.prepare(&integrator);
        run.before = clock.read().cpu.as_secs_f64();
        let counts =
            std::iter::successors(Some(1_u32), |n| n.checked_mul(2)).take_while(|&n| n < most).chain([most]);
        let mut cost = Cost::default();
        for passes in counts {
            let clock = Clock::start();
            rendered.resume_with(&integrator, passes, |_| self.pass());
            cost += clock.read();
            if rendered.passes < passes {
                break;
            }
            run.sights.push(self.see(&rendered.film, passes, cost, reference, epsilon));
            // The film of the last full count, whatever comes after it.
            run.difference = differences(&rendered.film, reference);
            run.claimed = claimed_variance(reference.only(rendered.film.pixels()));
        }
        run.non_finite = rendered.non_finite;
        let compared = reference.only(&run.difference);
        let mut squares: Vec<f64> = compared.map(|d| d.iter().map(|&d| f64::from(d).powi(2)).sum()).collect();
        squares.sort_by(|a, b| b.total_cmp(a));
        let worst = (squares.len() as f64 * OUTLIERS).ceil() as usize;
        run.outliers = squares.iter().take(worst).sum::<f64>() / squares.iter().sum::<f64>();
        run
    }

    fn see(&self, film: &Film, passes: u32, cost: Cost, reference: &Reference, epsilon: f64) -> Sight {
        let mut squared = vec![0.0; film.pixels().len()];
        let (width, tile) = (film.width(), self.plan.tile);
        let columns = width.div_ceil(tile);
        let mut tiles = vec![(0.0, 0.0); columns * film.height().div_ceil(tile)];
        for (i, (pixel, (r, v))) in
            film.pixels().iter().zip(reference.picture.pixels().iter().zip(&reference.variance)).enumerate()
        {
            if !reference.compared[i] {
                continue;
            }
            let (mut square, mut relative) = (0.0, 0.0);
            for (x, (&r, &v)) in pixel.mean().into_iter().zip(r.iter().zip(v)) {
                let (r, v) = (f64::from(r), f64::from(v));
                let s = (x - r).powi(2) - v;
                square += s / 3.0;
                relative += s / (r * r + epsilon) / 3.0;
            }
            squared[i] = square;
            let (sum, number) = &mut tiles[i / width / tile * columns + i % width / tile];
            *sum += relative;
            *number += 1.0;
        }
        let mean = |values: &mut dyn Iterator<Item = f64>, count: usize| values.sum::<f64>() / count as f64;
        let regions = self.plan.regions.iter();
        let compared = reference.pixels();
        Sight {
            passes,
            cost,
            relative: tiles.iter().map(|t| t.0).sum::<f64>() / compared as f64,
            // A tile of which nothing is compared is 0 / 0, which no maximum takes.
            worst_tile: tiles.iter().map(|t| t.0 / t.1).fold(f64::NEG_INFINITY, f64::max),
            regions: regions
                .map(|r| mean(&mut r.pixels.iter().map(|&p| squared[p]), r.pixels.len()))
                .collect(),
            squared: mean(&mut squared.iter().copied(), compared),
        }
    }
}

/// Mean over pixels and channels of the squared standard error.
fn claimed_variance<'a>(pixels: impl IntoIterator<Item = &'a Pixel>) -> f64 {
    let squares = pixels.into_iter().flat_map(|p| p.standard_error()).map(|e| e * e);
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
    sum / count
}

fn differences(film: &Film, reference: &Reference) -> Vec<[f32; 3]> {
    let pixels = film.pixels().iter().zip(reference.picture.pixels());
    pixels
        .map(|(pixel, r)| {
            let mean = pixel.mean();
            [0, 1, 2].map(|c| (mean[c] - f64::from(r[c])) as f32)
        })
        .collect()
}

/// The standard errors of the means that the reference's own error makes.
struct OwnError {
    squared: f64,
    relative: f64,
    regions: Vec<f64>,
}

fn curve(
    scene: &Scene,
    plan: &Experiment,
    place: usize,
    runs: &[&Run],
    reference: &Reference,
    own: &OwnError,
) -> Curve {
    let strategy = plan.strategies[place];
    let counts = runs.iter().map(|r| r.sights.len()).max().unwrap_or(0);
    let at = |rung: usize| runs.iter().filter_map(move |r| r.sights.get(rung));
    let rungs: Vec<Rung> = (0..counts)
        .map(|i| {
            let measured = |f: fn(&Sight) -> f64| Measured::of(at(i).map(f));
            Rung {
                passes: at(i).next().map_or(0, |s| s.passes),
                seeds: at(i).count(),
                cpu: measured(|s| s.cost.cpu.as_secs_f64()),
                wall: measured(|s| s.cost.wall.as_secs_f64()),
                squared: measured(|s| s.squared).and(own.squared),
                relative: measured(|s| s.relative).and(own.relative),
                worst_tile: measured(|s| s.worst_tile),
                regions: {
                    let own = own.regions.iter().enumerate();
                    own.map(|(k, &own)| Measured::of(at(i).map(|s| s.regions[k])).and(own)).collect()
                },
            }
        })
        .collect();

    // Of what the reference is good enough for, all seeds but `without`.
    let fit = |by_time: bool, without: Option<usize>| {
        let usable = rungs.iter().filter(|r| r.squared.mean > 3.0 * reference.squared_error);
        let usable: Vec<_> = usable.map(|r| r.passes).collect();
        let warm = usable.iter().filter(|&&n| n >= WARM).count();
        let used = |s: &&Sight| usable.contains(&s.passes) && (warm < 3 || s.passes >= WARM);
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for i in 0..counts {
            let others = runs.iter().enumerate().filter(|(k, _)| Some(*k) != without).map(|(_, run)| run);
            let sights: Vec<_> = others.filter_map(|r| r.sights.get(i)).filter(used).collect();
            if !sights.is_empty() {
                let mean = |f: &dyn Fn(&Sight) -> f64| {
                    sights.iter().map(|s| f(s)).sum::<f64>() / sights.len() as f64
                };
                x.push(if by_time {
                    mean(&|s| s.cost.cpu.as_secs_f64())
                } else {
                    f64::from(sights[0].passes)
                });
                y.push(mean(&|s| s.squared));
            }
        }
        power_law(&x, &y)
    };
    let slope = |by_time: bool| {
        let value = 0.5 * fit(by_time, None)?.1;
        let parts: Option<Vec<f64>> = (0..runs.len()).map(|k| Some(0.5 * fit(by_time, Some(k))?.1)).collect();
        let n = runs.len() as f64;
        let half_width = match parts {
            Some(parts) if runs.len() > 1 => {
                let mean = parts.iter().sum::<f64>() / n;
                let spread = parts.iter().map(|b| (b - mean).powi(2)).sum::<f64>();
                standard_errors(n - 1.0) * (spread * (n - 1.0) / n).sqrt()
            }
            _ => f64::INFINITY,
        };
        Some(Interval { value, half_width })
    };

    // Only of pictures that came as far as the farthest.
    let whole: Vec<_> = runs.iter().filter(|r| r.sights.len() == counts).collect();
    let last = rungs.last();
    let (squared, cpu) = last.map_or((f64::NAN, f64::NAN), |r| (r.squared.mean, r.cpu.mean));
    let (bias, [cost, cost_error]) = across_seeds(scene, &whole, reference, cpu);
    Curve {
        strategy,
        slope_time: slope(true),
        slope_samples: slope(false),
        fit_time: fit(true, None),
        fit_samples: fit(false, None),
        efficiency: 1.0 / (squared * cpu),
        squared_bias: bias,
        outliers: Measured::of(whole.iter().map(|r| r.outliers)),
        claimed: whole.iter().map(|r| r.claimed).sum::<f64>() / whole.len() as f64 / squared,
        cost,
        cost_error,
        non_finite: runs.iter().map(|r| r.non_finite).sum(),
        before: Measured::of(runs.iter().map(|r| r.before)),
        out_of_reach: share_out_of_reach(scene, strategy, rungs.last().map_or(0, |r| r.passes)),
        rungs,
    }
}

/// Squared bias over pixels, and the squared error x time over tiles with its standard error.
fn across_seeds(scene: &Scene, runs: &[&&Run], reference: &Reference, cpu: f64) -> (Measured, [Field; 2]) {
    let (width, height) = (scene.picture.width as usize, scene.picture.height as usize);
    let n = runs.len() as f64;
    let mut bias = Moments::new();
    let (columns, rows) = (width.div_ceil(WINNER_TILE), height.div_ceil(WINNER_TILE));
    // Of each tile the squared error of each seed, and over how many pixels.
    let mut tiles = vec![(vec![0.0; runs.len()], 0.0); columns * rows];
    for (pixel, v) in reference.only(reference.variance.iter().enumerate()).filter(|_| n > 0.0) {
        let (squares, pixels) =
            &mut tiles[pixel / width / WINNER_TILE * columns + pixel % width / WINNER_TILE];
        *pixels += 1.0;
        let mut product = 0.0;
        for (c, &v) in v.iter().enumerate() {
            let v = f64::from(v);
            let (mut sum, mut all) = (0.0, 0.0);
            for (run, square) in runs.iter().zip(&mut *squares) {
                let d = f64::from(run.difference[pixel][c]);
                *square += (d * d - v) / 3.0;
                sum += d;
                all += d * d;
            }
            product += ((sum * sum - all) / (n * (n - 1.0)) - v) / 3.0;
        }
        bias.add(product);
    }
    let bias = Measured { mean: bias.mean(), error: bias.standard_error().unwrap_or(f64::NAN) };
    let costs: Vec<Measured> = tiles
        .iter()
        .map(|(squares, pixels)| Measured::of(squares.iter().map(|s| s / pixels * cpu)))
        .collect();
    let field = |f: fn(&Measured) -> f64| Field::from_fn(columns, rows, |x, y| f(&costs[y * columns + x]));
    (bias, [field(|c| if c.mean.is_finite() { c.mean } else { f64::NAN }), field(|c| c.error)])
}

/// A and b of y = A x^b, so that the relative residuals have sum 0, alone and times ln x. None below 2 points, or if it is no
/// decreasing or growing of positive values.
fn power_law(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    if x.len() < 2 || x.iter().chain(y).any(|v| !(*v > 0.0)) {
        return None;
    }
    let n = x.len() as f64;
    let x: Vec<f64> = x.iter().map(|x| x.ln()).collect();
    let mean_x = x.iter().sum::<f64>() / n;
    let spread = x.iter().map(|x| (x - mean_x).powi(2)).sum::<f64>();
    // Least squares of ln y, then of the working response ln(fit) + y / fit - 1 until it stands.
    let mut target: Vec<f64> = y.iter().map(|y| y.ln()).collect();
    let mut found = (f64::NAN, f64::NAN);
    for _ in 0..100 {
        let mean = target.iter().sum::<f64>() / n;
        let b = x.iter().zip(&target).map(|(x, t)| (x - mean_x) * (t - mean)).sum::<f64>() / spread;
        let a = mean - b * mean_x;
        let moved = (a - found.0).abs() + (b - found.1).abs();
        found = (a, b);
        if moved < 1e-12 {
            break;
        }
        for ((t, x), y) in target.iter_mut().zip(&x).zip(y) {
            let fit = a + b * x;
            *t = fit + y / fit.exp() - 1.0;
        }
    }
    let (a, b) = (found.0.exp(), found.1);
    (a.is_finite() && a > 0.0 && b.is_finite()).then_some((a, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_found() {
        let x = [1.0, 2.0, 4.0, 8.0, 16.0];
        let (a, b) = power_law(&x, &x.map(|x: f64| 3.0 * x.powf(-0.8))).unwrap();
        assert!((a - 3.0).abs() < 1e-9 && (b + 0.8).abs() < 1e-9);
        // With noise the two sums are 0.
        let y = [3.1, 1.2, 0.9, 0.3, 0.2];
        let (a, b) = power_law(&x, &y).unwrap();
        let residuals: Vec<f64> = x.iter().zip(y).map(|(x, y)| y / (a * x.powf(b)) - 1.0).collect();
        assert!(residuals.iter().sum::<f64>().abs() < 1e-9);
        assert!(residuals.iter().zip(x).map(|(r, x)| r * x.ln()).sum::<f64>().abs() < 1e-9);
        assert_eq!(power_law(&[1.0], &[1.0]), None);
        assert_eq!(power_law(&[1.0, 2.0], &[1.0, 0.0]), None);
    }
}
