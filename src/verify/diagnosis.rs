//! Which known mistake would explain the counts.

use super::check::Case;

/// What would explain the counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// In words: "the density lacks cos theta".
    pub text: String,
}

pub(super) fn diagnose(_case: &Case<'_>) -> Option<Diagnosis> {
    None
}
