//! Passes over the picture, one sample a pixel each.
//!
//! A sample has a uniform place in its pixel (a box filter one pixel wide). The picture is cut into tiles, runs
//! of [`TILE`] pixels in row order; tile t of pass p draws from its own stream of the seed, number p 2^32 + t.
//! A pass is split among threads by tiles, and passes follow each other, so every pixel adds the same samples
//! in the same order: the film is the same to the last bit for any number of threads, and a picture that is
//! continued is the picture made at once.

use super::{Film, Integrator, Lights, Strategy};
use crate::random::{stream, unit_f64};
use crate::scene::Scene;
use glam::Vec3;
use rayon::prelude::*;
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
    let mut rendered = Rendered { film, passes: 0, non_finite: 0, time: Duration::ZERO, strategy, seed };
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
        mut on_pass: impl FnMut(Progress) -> bool,
    ) {
        let (width, height) = (scene.picture.width as usize, scene.picture.height as usize);
        assert_eq!(
            (self.film.width(), self.film.height()),
            (width, height),
            "the picture's size has changed"
        );
        let integrator = Integrator::new(scene, lights, self.strategy);
        while self.passes < spp {
            let start = Instant::now();
            self.pass(&integrator, width);
            self.time += start.elapsed();
            let Self { passes, ref film, time, .. } = *self;
            if !on_pass(Progress { passes, total: spp, film, time }) {
                break;
            }
        }
    }

    fn pass(&mut self, integrator: &Integrator, width: usize) {
        let (seed, pass) = (self.seed, self.passes);
        let tiles = self.film.pixels_mut().par_chunks_mut(TILE).enumerate();
        let non_finite = tiles.map(|(tile, pixels)| {
            let mut rng = stream(seed, "render", u64::from(pass) << 32 | tile as u64);
            let mut non_finite = 0;
            for (pixel, i) in pixels.iter_mut().zip(tile * TILE..) {
                let [dx, dy, xi @ ..] = [(); 6].map(|()| unit_f64(&mut rng));
                let (x, y) = ((i % width) as f64 + dx, (i / width) as f64 + dy);
                let mut radiance = integrator.radiance(x as f32, y as f32, xi);
                if !radiance.is_finite() {
                    radiance = Vec3::ZERO;
                    non_finite += 1;
                }
                pixel.add(radiance.as_dvec3());
            }
            non_finite
        });
        self.non_finite += non_finite.sum::<u64>();
        self.passes += 1;
    }
}
