//! Find out whether the Monte Carlo samplers of a renderer are right, and how good they are.
//!
//! *Statistics* judge samples that *samplers* draw on a *domain*; *oracles* say what is right; *verify* puts
//! the questions; *scenes* and *estimators* show that it matters; *reports* tell the story.

pub mod statistics;
pub mod random;
pub mod domain;
pub mod sampler;
pub mod oracle;
pub mod verify;
#[cfg(feature = "pictures")]
pub mod picture;
#[cfg(feature = "render")]
pub mod scene;
#[cfg(feature = "render")]
pub mod estimator;
pub mod report;
