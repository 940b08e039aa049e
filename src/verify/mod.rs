//! The questions that are put to a sampler, and what is made of the answers.
//!
//! [`verify`] draws samples, integrates the density, runs every check and returns a [`Report`]:
//!
//! | check | what it asks |
//! |---|---|
//! | domain | points and densities are sound where floats break: variates at 0, just under 1, around the knots of tables, in all combinations |
//! | support | no sample where the density is 0, NaN, infinite or negative, none outside of the domain; density wherever a target is positive |
//! | agreement | the density returned with a sample is the density asked at its point |
//! | normalisation | the density integrates to no more than 1 (what is missing must turn up as rejected samples) |
//! | jacobian | density x determinant of d point / d xi is 1, point by point |
//! | round trip | the inverse, where there is one, inverts |
//! | chi-square | counts against expected counts in cells chosen by the mass, at several scales |
//! | scan | counts in overlapping windows, wherever the borders of an error lie |
//! | distribution | distribution functions of the marginals and of Rosenblatt's transform |
//! | weights | the mean of 1 / density over a cell is its measure |
//! | independence | consecutive samples, streams, points and left-over variates don't depend on each other |
//! | repeats | equal points are no more frequent than rounding explains |
//! | sequential | in place of those that count, in a run that stops as soon as it knows |
//!
//! Samples that somebody else drew, read from a file or a pipe, are a [`recording`]: the same checks, as far as samples alone allow.
//!
//! Without a density, [`compare`] holds two samplers against each other, [`compare_samples`] two sets of points, [`streams`] the streams of a
//! generator; [`metamorphic`] asks tables what must not change when their input does. Where there is no density at all, [`estimator`] holds a mean
//! against the truth, and [`film`] asks whether samples are added up rightly.
//!
//! Everything that involves chance gives a p-value; they are corrected together, over everything that the run tested (Holm), so that
//! a run of right samplers fails with a probability of at most alpha, however many there are.

mod agreement;
mod check;
mod diagnosis;
mod edges;
mod estimator;
mod examination;
mod expectation;
mod film;
mod finding;
mod goodness;
mod history;
mod independence;
mod jacobian;
mod map;
mod marginals;
pub mod metamorphic;
mod normalisation;
mod points;
mod power;
mod probe;
mod recording;
mod repeats;
mod report;
mod round_trip;
mod rows;
mod scan;
mod sequential;
mod setters;
mod settings;
mod streams;
mod support;
mod tally;
mod two_sample;
mod weights;

pub use check::checks;
pub use diagnosis::Diagnosis;
#[cfg(feature = "foreign")]
pub(crate) use diagnosis::{known_constant, known_to};
pub use edges::EdgeProbe;
pub use estimator::{Estimator, estimator};
pub use examination::{Against, Examination};
pub use film::{Film, Values, film};
pub use finding::{Evidence, Finding, Verdict};
pub use history::Look;
pub use map::{CellFigure, ResidualMap};
pub use points::{PointsError, Samples};
pub use power::Power;
pub use recording::{
    Batch, Recording, Row, compare_recordings, recording, recording_of_batches, recording_of_pieces,
};
pub(crate) use report::p_value;
pub use report::{Conclusion, Report};
pub use rows::{Block, Piece, Rows, RowsError};
pub use settings::{Drawn, Settings, Verify};
pub use streams::{Streams, streams};
pub use two_sample::{Compare, CompareSamples, compare, compare_samples};

use crate::sampler::Sampler;

/// Begins to verify a sampler; set what should differ from the defaults, then [`run`](Verify::run).
///
/// ```
/// use warpcheck::sampler::CosineHemisphere;
/// let report = warpcheck::verify(&CosineHemisphere).samples(100_000).seed(7).run();
/// println!("{report}");
/// report.assert();
/// ```
pub fn verify<S: Sampler>(sampler: &S) -> Verify<'_, S::Domain> {
    Verify::new(sampler, std::any::type_name::<S>())
}
