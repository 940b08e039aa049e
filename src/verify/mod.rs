//! The questions that are put to a sampler, and what is made of the answers.
//!
//! [`verify`] draws samples, integrates the density, runs every check and returns a [`Report`]:
//!
//! - **edges**: variates at 0, just under 1, and other places where floats break, in all combinations;
//! - **agreement**: the density returned with a sample is the density asked at its point;
//! - **normalisation**: the density integrates to no more than 1 (what is missing must turn up as rejected samples);
//! - **support**: no sample where the density is 0, NaN, infinite or negative, none outside of the domain;
//! - **chi-square**: counts against expected counts in cells chosen by the mass, at several scales.
//!
//! Everything that involves chance gives a p-value; they are corrected together, over everything that the run tested (Holm), so that
//! a run of right samplers fails with a probability of at most alpha, however many there are.

mod agreement;
mod chi_square;
mod edges;
mod examination;
mod expectation;
mod finding;
mod map;
mod normalisation;
mod report;
mod settings;
mod tally;

pub use examination::{Examination, Power};
pub use finding::{Evidence, Finding, Verdict};
pub use map::{CellFigure, ResidualMap};
pub(crate) use report::p_value;
pub use report::{Conclusion, Report};
pub use settings::{Drawn, Settings, Verify};

use crate::sampler::Sampler;

/// Begins to verify a sampler; set what should differ from the defaults, then [`run`](Verify::run).
///
/// ```
/// use warpcheck::sampler::CosineHemisphere;
/// let report = warpcheck::verify(&CosineHemisphere).samples(100_000).seed(7).run();
/// println!("{report}");
/// report.assert();
/// ```
pub fn verify<S: Sampler>(sampler: &S) -> Verify<'_, S> {
    Verify::new(sampler)
}
