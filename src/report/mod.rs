//! Tells the story: a run's result as a table for people, as JSON for programs, and as pictures.

mod assert;
#[cfg(feature = "json")]
mod json;
#[cfg(feature = "render")]
mod pictures;
#[cfg(feature = "pictures")]
mod residuals;
mod table;

#[cfg(feature = "json")]
pub use json::to_json;
#[cfg(feature = "render")]
pub use pictures::{EnvironmentFigure, environment_sheet, histogram_sheet};
#[cfg(feature = "pictures")]
pub use residuals::{overview_sheet, residual_planes, residual_sheet};
pub use table::{Style, table};
