//! Find out whether the Monte Carlo samplers of a renderer are right, and how good they are.
//!
//! *Statistics* judge samples that *samplers* draw on a *domain*; *oracles* say what is right; *verify* puts
//! the questions; *scenes* and *estimators* show that it matters; *reports* tell the story.

#[cfg(feature = "render")]
pub mod catalogue;
pub mod domain;
#[cfg(feature = "render")]
pub mod estimator;
mod parallel;
#[cfg(feature = "pictures")]
pub mod picture;
pub mod random;
pub mod report;

pub use verify::verify;
pub mod histogram;
pub mod sampler;
#[cfg(feature = "render")]
pub mod scene;
pub mod statistics;
pub mod verify;
