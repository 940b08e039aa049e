//! What one check found.

use std::fmt::{Display, Formatter};

/// The outcome of a check, a sampler or a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Nothing wrong was found.
    Pass,
    /// It can't be told: the reference is not accurate enough, or there are too few samples.
    Inconclusive,
    /// It is wrong.
    Fail,
}

impl Display for Verdict {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Pass => "pass",
            Self::Inconclusive => "inconclusive",
            Self::Fail => "fail",
        })
    }
}

/// What a finding rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Evidence {
    /// No chance is involved.
    Certain(Verdict),
    /// A p-value, judged after correction over the whole run.
    Chance {
        /// As computed from the expected counts.
        p: f64,
        /// The largest p-value that the error of the expected counts allows. Only this one can fail a sampler.
        conservative: f64,
    },
}

/// One thing that one check found.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The check: "chi-square".
    pub check: &'static str,
    /// Which part of it: "128 cells"; may be empty.
    pub part: String,
    /// What it rests on.
    pub evidence: Evidence,
    /// A sentence with the figures.
    pub detail: String,
}

impl Finding {
    pub(super) fn certain(check: &'static str, verdict: Verdict, detail: impl Into<String>) -> Self {
        Self { check, part: String::new(), evidence: Evidence::Certain(verdict), detail: detail.into() }
    }
}
