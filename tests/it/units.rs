//! The library's parts one by one, a file each as in `src`: what callers can ask of them. (What only the inside shows is in unit tests: `cargo test --lib`.)

#[cfg(feature = "render")]
mod agreement;
#[cfg(feature = "render")]
mod brdf;
mod cdf;
#[cfg(feature = "pictures")]
mod colour;
#[cfg(feature = "foreign")]
mod convention;
mod direction;
mod domain;
#[cfg(feature = "render")]
mod film;
#[cfg(feature = "pictures")]
mod hdr;
#[cfg(feature = "pictures")]
mod label;
#[cfg(feature = "render")]
mod light_sampling;
mod light_tree;
mod mis;
mod partition;
mod random;
#[cfg(feature = "pictures")]
mod scale;
mod solid_angle;
mod spherical_triangle;
#[cfg(feature = "render")]
mod strategy;
#[cfg(feature = "foreign")]
mod table;
#[cfg(feature = "pictures")]
mod tone;
