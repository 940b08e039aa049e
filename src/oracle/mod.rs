//! What is right, in `f64` and by other formulas than the samplers use: nothing here calls a sampler, and no sampler calls this, so that a
//! mistake can't cancel.

mod directions;
mod environment;
mod solid_angle;

pub use directions::{cosine, ggx_reflected, phong, phong_under_horizon, von_mises_fisher};
pub use environment::EnvironmentOracle;
pub use solid_angle::{irradiance_of_polygon, solid_angle_of_triangle};
