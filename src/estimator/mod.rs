//! A compact estimator of direct illumination: several strategies for one integral, which therefore have to
//! agree.
//!
//! What the camera sees at a point x in direction w_o is, in radiance (W / (m^2 sr), per channel of linear
//! RGB),
//!
//!   L(x, w_o) = L_e(x, w_o) + integral over the sphere of L_i(x, w) f_r(w_o, w) max(n . w, 0) dw,
//!
//! where L_i is what an emitter or the environment sends *directly* to x: light that was reflected before is
//! left out (Kajiya 1986, cut after the first bounce). A [`Strategy`] says from which density per solid angle w
//! is drawn; every strategy estimates the same integral, so that two pictures that differ by more than their
//! standard errors prove a mistake ([`compare`]).
//!
//! | file | idea |
//! | --- | --- |
//! | `strategy` | which directions are drawn: [`Strategy`] |
//! | `brdf` | what a material reflects, and a density that follows it: [`Reflection`], [`Brdf`] |
//! | `light_sampling` | how a point of the emitters is drawn: [`LightSampling`] |
//! | `lights` | all lights of a scene as one sampler: [`Lights`] |
//! | `integrator` | one sample of one pixel: [`Integrator`] |
//! | `film` | sums over samples: [`Film`], [`Blocks`] |
//! | `plan` | what a scene and a strategy need, and nothing else: [`Plan`] |
//! | `render` | passes over the picture: [`render`], [`Rendered`] |
//! | `saved` | a film on disk, to go on with: [`Rendered::save`], [`Rendered::open`] |
//! | `agreement` | do two pictures agree? [`compare`], [`Agreement`] |
//! | `agree` | do several agree, tile by tile, and how closely? [`agree()`], [`Accord`] |
//! | `convergence` | error against run time: [`convergence()`], [`Convergence`] |
//! | `clock` | CPU time of a thread: [`Clock`] |
//!
//! ```no_run
//! use warpcheck::estimator::{Lights, Rules, Settings, Strategy, compare, render};
//! use warpcheck::scene::Scene;
//!
//! let scene = Scene::load("data/scene/cornell.toml")?;
//! let lights = Lights::load(&scene)?;
//! let blocks = |strategy, seed| {
//!     render(&scene, &lights, strategy, Settings { spp: 64, seed }, |_| true).film.blocks(16)
//! };
//! let mis = blocks(Strategy::Mis { brdf_weight: 0.5 }, 1);
//! let light = blocks(Strategy::Light, 2); // another seed: the comparison is of independent estimates
//! assert!(compare(&mis, &light, Rules::default(), |_, _| false)?.agrees(1e-3));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod agree;
mod agreement;
mod brdf;
mod clock;
mod convergence;
mod error;
mod film;
mod integrator;
mod light_sampling;
mod lights;
mod plan;
mod reach;
mod render;
mod saved;
mod strategy;

pub use agree::{
    Accord, CONFIDENCE as AGREEMENT_CONFIDENCE, Criteria, Doubt, Estimate, Pair, TileTest, agree, sample,
    sampled_passes,
};
pub use agreement::{Agreement, Deviation, Judgement, Rules, compare};
pub use brdf::{Brdf, Reflection};
pub use clock::{Clock, Cost};
pub(crate) use convergence::standard_errors;
pub use convergence::{
    Budget, CONFIDENCE, Convergence, Curve, Experiment, Interval, LEAST_PASSES, LONG_RUN, Measured, OUTLIERS,
    Reference, Region, Rung, Truth, WINNER_TILE, Winner, convergence, regions_by_material,
};
pub use error::Error;
pub use film::{Blocks, Film, Pixel};
pub use integrator::{Integrator, VARIATES};
pub use light_sampling::{LightSampling, Selection};
pub use lights::{LightDraw, Lights, Target};
pub use plan::{Part, Plan};
pub use reach::share_out_of_reach;
pub use render::{Progress, Rendered, Settings, render};
pub use saved::FilmError;
pub use strategy::{AUTO_PASSES, AUTO_WEIGHTS, Strategy};
