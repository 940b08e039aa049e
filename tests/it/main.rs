//! All integration tests, one question a file, as one binary: each binary costs a link, and tests share their threads better than binaries do theirs.

#[cfg(feature = "cli")]
mod agree;
mod atoms;
#[cfg(feature = "cli")]
mod bad_input;
mod broken;
#[cfg(feature = "cli")]
mod browser;
mod by_hand;
mod calibration;
mod checks;
#[cfg(feature = "cli")]
mod cli;
#[cfg(feature = "cli")]
mod converge;
mod diagnosis;
mod environment;
#[cfg(feature = "render")]
mod estimator;
mod examples;
#[cfg(feature = "parallel")]
mod fast;
#[cfg(feature = "cli")]
mod foreign;
#[cfg(feature = "render")]
mod fuzzed;
mod hard;
#[cfg(feature = "cli")]
mod json;
mod metamorphic;
mod oracles;
mod own_densities;
#[cfg(feature = "pictures")]
mod picture;
mod planted;
mod properties;
#[cfg(feature = "cli")]
mod report;
#[cfg(feature = "render")]
mod scene_input;
#[cfg(feature = "render")]
mod scenes;
mod shipped;
mod statistics;
#[cfg(feature = "render")]
mod strategies;
#[cfg(feature = "render")]
mod stress;
mod two_samples;
mod units;
