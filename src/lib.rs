//! Find out whether the Monte Carlo samplers of a renderer are right, and how good they are.
//!
//! *Statistics* judge samples that *samplers* draw on a *domain*; *oracles* say what is right; *verify* puts
//! the questions; *faults* prove that the questions bite; *scenes* and *estimators* show that it matters; *reports* tell the story.
//!
//! # Your own sampler, in a test
//!
//! ```
//! use glam::Vec3;
//! use warpcheck::{domain::Hemisphere, sampler::from_fn};
//!
//! // What your renderer has: two variates to a direction, and the density of a direction per solid angle.
//! fn sample(u: f32, v: f32) -> Vec3 {
//!     let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
//!     Vec3::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt())
//! }
//! fn pdf(w: Vec3) -> f32 {
//!     w.z / std::f32::consts::PI
//! }
//!
//! // #[test]
//! fn my_sampler_is_right() {
//!     let mine = from_fn(Hemisphere, |[u, v]: [f32; 2]| sample(u, v), |w: Vec3| pdf(w));
//!     warpcheck::verify(&mine).name("my cosine lobe").run().assert();
//! }
//! # my_sampler_is_right();
//! ```
//!
//! # Features
//!
//! Without features the library has statistics, domains, samplers, oracles and verification, and needs five small crates. `parallel` uses
//! several threads (the results stay the same to the last bit), `json` writes reports, `pictures` reads maps and writes pictures, `render` adds
//! scenes and estimators, `cli` (the default) the program.

pub mod calibration;
#[cfg(feature = "render")]
pub mod catalogue;
pub mod domain;
#[cfg(feature = "render")]
pub mod estimator;
pub mod fault;
#[cfg(feature = "foreign")]
pub mod foreign;
pub mod histogram;
pub mod oracle;
mod pages;
mod parallel;
#[cfg(feature = "pictures")]
pub mod picture;
pub mod random;
pub mod report;
pub mod sampler;
#[cfg(feature = "render")]
pub mod scene;
#[cfg(any(feature = "render", feature = "foreign"))]
mod spelling;
pub mod statistics;
#[cfg(feature = "render")]
pub mod stress;
pub mod verify;

pub use verify::verify;

/// The README's code is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
