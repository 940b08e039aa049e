//! Passes over the picture, one sample a pixel each.
//!
//! A sample has a uniform place in its pixel (a box filter one pixel wide). The picture is cut into tiles, runs
//! of [`TILE`] pixels in row order; tile t of pass p draws from its own stream of the seed, number p 2^32 + t.
//! A pass is split among threads by tiles, and passes follow each other, so every pixel adds the same samples
//! in the same order: the film is the same to the last bit for any number of threads, and a picture that is
//! continued is the picture made at once.

use super::brdf::{ALL_LOBES, GGX, Lobes, NO_LOBES, PHONG};
use super::integrator::Directions;
use super::{AUTO_PASSES, AUTO_WEIGHTS, Film, Integrator, Lights, Strategy, VARIATES};
use crate::parallel;
use crate::random::{fill_unit, stream, unit_f64};
use crate::scene::Scene;
use glam::Vec3;
use rand::Rng;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Pixels that share a stream in a pass.
const TILE: usize = 256;

/// How much to draw, and from which streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Passes: samples a pixel.
    pub spp: u32,
    /// The streams don't depend on the strategy. Pictures of two strategies with the same seed are correlated,
    /// since they share their camera rays and more: give estimates that are to be compared different seeds.
    pub seed: u64,
}

/// Where a rendering stands after a pass.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// Passes done, those before a continuation included.
    pub passes: u32,
    /// Passes there are to be.
    pub total: u32,
    /// What is there so far.
    pub film: &'a Film,
    /// Time spent in passes so far.
    pub time: Duration,
}

/// A picture and how it was made.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture.
    pub film: Film,
    /// Passes in it.
    pub passes: u32,
    /// Samples that came out NaN or infinite. They are in the film as 0, so that one of them does not spoil a
    /// picture, and any is a mistake in the estimator or the scene.
    pub non_finite: u64,
    /// Time spent in passes.
    pub time: Duration,
    /// How directions were drawn.
    pub strategy: Strategy,
    /// The seed of its streams.
    pub seed: u64,
    /// The weight of the BRDF in each pixel, once [`Strategy::MisAuto`] has chosen them.
    pub(super) weights: Option<Box<[f32]>>,
}

/// Renders a scene. `on_pass` is called after each pass and says whether to go on; what is done when it says no
/// is kept.
///
/// ```
/// use warpcheck::estimator::{Lights, Settings, Strategy, render};
/// use warpcheck::scene::Scene;
/// let scene = Scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml"))?;
/// let lights = Lights::load(&scene)?;
/// let settings = Settings { spp: 4, seed: 1 };
/// let mut picture = render(&scene, &lights, Strategy::Light, settings, |p| p.passes < 2); // stopped after 2
/// assert_eq!((picture.passes, picture.non_finite), (2, 0));
/// picture.resume(&scene, &lights, 4, |_| true);
/// assert_eq!(picture.passes, 4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Panics
/// If the weight of a [`Strategy::Mis`] is not in [0, 1].
pub fn render(
    scene: &Scene,
    lights: &Lights,
    strategy: Strategy,
    settings: Settings,
    on_pass: impl FnMut(Progress) -> bool,
) -> Rendered {
    let film = Film::new(scene.picture.width as usize, scene.picture.height as usize);
    let Settings { spp, seed } = settings;
    let (time, weights) = (Duration::ZERO, None);
    let mut rendered = Rendered { film, passes: 0, non_finite: 0, time, strategy, seed, weights };
    rendered.resume(scene, lights, spp, on_pass);
    rendered
}

impl Rendered {
    /// Adds the passes that are missing to `spp` in all. The scene and its lights have to be the same as
    /// before.
    ///
    /// # Panics
    /// If the scene's picture has another size.
    pub fn resume(
        &mut self,
        scene: &Scene,
        lights: &Lights,
        spp: u32,
        on_pass: impl FnMut(Progress) -> bool,
    ) {
        self.resume_with(&Integrator::new(scene, lights, self.strategy), spp, on_pass);
    }

    /// The same with an integrator that is there.
    ///
    /// # Panics
    /// If its scene's picture has another size, or its strategy is another.
    pub fn resume_with(
        &mut self,
        integrator: &Integrator,
        spp: u32,
        mut on_pass: impl FnMut(Progress) -> bool,
    ) {
        let picture = integrator.scene().picture;
        let (width, height) = (picture.width as usize, picture.height as usize);
        assert_eq!(
            (self.film.width(), self.film.height()),
            (width, height),
            "the picture's size has changed"
        );
        assert_eq!(self.strategy, integrator.strategy(), "the strategy has changed");
        if self.passes < spp {
            self.prepare(integrator);
        }
        // Compiled once for each set of lobes, so that no sample asks for one that the scene hasn't.
        let pass = match integrator.lobes() {
            NO_LOBES => Self::pass::<NO_LOBES>,
            PHONG => Self::pass::<PHONG>,
            GGX => Self::pass::<GGX>,
            _ => Self::pass::<ALL_LOBES>,
        };
        while self.passes < spp {
            let start = Instant::now();
            pass(self, integrator, width);
            self.time += start.elapsed();
            let Self { passes, ref film, time, .. } = *self;
            if !on_pass(Progress { passes, total: spp, film, time }) {
                break;
            }
        }
    }

    /// Does now what comes before the first pass, if it is not done: [`Strategy::MisAuto`] chooses its weights.
    pub fn prepare(&mut self, integrator: &Integrator) {
        if self.strategy == Strategy::MisAuto && self.weights.is_none() {
            let start = Instant::now();
            let picture = integrator.scene().picture;
            let (width, height) = (picture.width as usize, picture.height as usize);
            self.weights = Some(choose_weights(integrator, width, height, self.seed));
            self.time += start.elapsed();
        }
    }

    /// The weight of the BRDF that [`Strategy::MisAuto`] has chosen for each pixel, row after row; `None` before, and for
    /// other strategies.
    pub fn weights(&self) -> Option<&[f32]> {
        self.weights.as_deref()
    }

    fn pass<const LOBES: Lobes>(&mut self, integrator: &Integrator, width: usize) {
        let (seed, pass) = (self.seed, self.passes);
        let weights = self.weights.as_deref();
        let non_finite = AtomicU64::new(0);
        parallel::chunks_mut(self.film.pixels_mut(), TILE, |tile, pixels| {
            let rng = stream(seed, "render", u64::from(pass) << 32 | tile as u64);
            let scene = integrator.scene();
            let begun: Vec<_> = samples(integrator, rng, tile, width)
                .take(pixels.len())
                .map(|(i, x, y, xi)| {
                    let directions = weights.map_or(integrator.directions(), |w| Directions::Mixture(w[i]));
                    integrator.begin::<LOBES>(directions, x, y, xi)
                })
                .collect();
            // Shadow rays of a tile one after another.
            for (pixel, begun) in pixels.iter_mut().zip(begun) {
                let mut radiance = begun.finish(scene);
                if !radiance.is_finite() {
                    radiance = Vec3::ZERO;
                    non_finite.fetch_add(1, Ordering::Relaxed);
                }
                pixel.add(radiance.as_dvec3());
            }
        });
        self.non_finite += non_finite.into_inner();
        self.passes += 1;
    }
}

/// For each pixel of a tile: its index, a place in it, and the variates of an estimate.
fn samples(
    integrator: &Integrator,
    mut rng: impl Rng,
    tile: usize,
    width: usize,
) -> impl Iterator<Item = (usize, f32, f32, [f64; VARIATES])> {
    let used = integrator.variates();
    (tile * TILE..).map(move |i| {
        let [dx, dy] = [(); 2].map(|()| unit_f64(&mut rng));
        let mut xi = [0.0; VARIATES];
        fill_unit(&mut rng, &mut xi[..used]);
        (i, ((i % width) as f64 + dx) as f32, ((i / width) as f64 + dy) as f32, xi)
    })
}

/// The weights of [`Strategy::MisAuto`]: see the file on strategies.
fn choose_weights(integrator: &Integrator, width: usize, height: usize, seed: u64) -> Box<[f32]> {
    let mut moments = vec![[0.0; AUTO_WEIGHTS.len()]; width * height];
    parallel::chunks_mut(&mut moments, TILE, |tile, pixels| {
        for pass in 0..AUTO_PASSES {
            let rng = stream(seed, "weights of mis:auto", u64::from(pass) << 32 | tile as u64);
            for (sums, (_, x, y, xi)) in pixels.iter_mut().zip(samples(integrator, rng, tile, width)) {
                let found = integrator.second_moments(x, y, xi);
                sums.iter_mut().zip(found).for_each(|(sum, moment)| *sum += moment);
            }
        }
    });
    let around = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
    let weight = |pixel: usize| {
        let (x, y) = (pixel % width, pixel / width);
        let near = around(y, height).flat_map(|y| around(x, width).map(move |x| y * width + x));
        let sums = near.fold([0.0; AUTO_WEIGHTS.len()], |sums, i| {
            std::array::from_fn(|candidate| sums[candidate] + moments[i][candidate])
        });
        // 1/2 comes first, so that darkness leaves it there.
        let least = (0..sums.len())
            .fold(AUTO_WEIGHTS.len() / 2, |best, i| if sums[i] < sums[best] { i } else { best });
        AUTO_WEIGHTS[least]
    };
    (0..width * height).map(weight).collect()
}
