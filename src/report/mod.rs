//! Tells the story: a run's result as a table for people, as JSON for programs, and as pictures.

mod assert;
mod calibration;
#[cfg(feature = "plots")]
mod calibration_plot;
mod faults;
#[cfg(feature = "json")]
mod json;
#[cfg(feature = "render")]
mod pictures;
#[cfg(feature = "render")]
mod plan;
#[cfg(feature = "pictures")]
mod residuals;
#[cfg(feature = "render")]
mod stress;
mod table;

pub use calibration::calibration_table;
#[cfg(feature = "json")]
pub use calibration::calibration_to_json;
#[cfg(feature = "plots")]
pub use calibration_plot::calibration_plot;
#[cfg(feature = "json")]
pub use faults::faults_to_json;
pub use faults::{Twins, fault_table};
#[cfg(feature = "json")]
pub use json::to_json;
#[cfg(feature = "render")]
pub use pictures::{EnvironmentFigure, environment_sheet, histogram_sheet};
#[cfg(feature = "render")]
pub use plan::plan_table;
#[cfg(all(feature = "render", feature = "json"))]
pub use plan::plan_to_json;
#[cfg(feature = "pictures")]
pub use residuals::{overview_sheet, residual_planes, residual_sheet};
#[cfg(feature = "render")]
pub use stress::stress_table;
#[cfg(all(feature = "render", feature = "json"))]
pub use stress::stress_to_json;
pub use table::{Style, table};
