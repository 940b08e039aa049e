//! Tells the story: a run's result as a table for people, as JSON for programs, and as pictures.

#[cfg(feature = "render")]
mod accord;
mod assert;
mod calibration;
#[cfg(feature = "plots")]
mod calibration_plot;
#[cfg(feature = "render")]
mod convergence;
#[cfg(all(feature = "render", feature = "plots"))]
mod convergence_plot;
#[cfg(feature = "render")]
mod convergence_sheet;
#[cfg(all(feature = "render", feature = "json"))]
mod drawn;
mod faults;
#[cfg(feature = "html")]
pub mod html;
#[cfg(feature = "json")]
mod json;
#[cfg(any(feature = "plots", feature = "render"))]
mod palette;
#[cfg(feature = "render")]
mod pictures;
#[cfg(feature = "render")]
mod plan;
#[cfg(feature = "plots")]
mod plot;
#[cfg(feature = "pictures")]
mod residuals;
#[cfg(feature = "render")]
mod stress;
mod table;

#[cfg(all(feature = "render", feature = "json"))]
pub use accord::accord_to_json;
#[cfg(feature = "render")]
pub use accord::{accord_sheet, accord_table};
pub use calibration::calibration_table;
#[cfg(feature = "json")]
pub use calibration::calibration_to_json;
#[cfg(feature = "plots")]
pub use calibration_plot::calibration_plot;
#[cfg(all(feature = "render", feature = "json"))]
pub use convergence::convergence_to_json;
#[cfg(feature = "render")]
pub use convergence::{convergence_table, convergence_to_csv, region_ratios};
#[cfg(all(feature = "render", feature = "plots"))]
pub use convergence_plot::convergence_plot;
#[cfg(feature = "render")]
pub use convergence_sheet::{AtEqualTime, convergence_sheet, winner_map};
#[cfg(all(feature = "render", feature = "json"))]
pub use drawn::{histograms_to_json, renders_to_json};
#[cfg(feature = "json")]
pub use faults::faults_to_json;
pub use faults::{Twins, fault_table};
#[cfg(feature = "json")]
pub use json::to_json;
#[cfg(feature = "html")]
#[cfg(feature = "render")]
use pictures::dotted;
#[cfg(feature = "render")]
pub use pictures::{EnvironmentFigure, environment_sheet, histogram_sheet};
#[cfg(feature = "render")]
pub use plan::plan_table;
#[cfg(all(feature = "render", feature = "json"))]
pub use plan::plan_to_json;
#[cfg(feature = "pictures")]
pub use residuals::{overview_sheet, residual_planes, residual_sheet};
#[cfg(all(feature = "render", feature = "json"))]
pub use stress::stress_to_json;
#[cfg(feature = "render")]
pub use stress::{stress_table, stress_table_by_component};
pub use table::{Style, table, table_by_family};
