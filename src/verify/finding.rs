//! What one check found.

use super::Power;
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
    /// An e-value, the largest so far of a test that may look as often as it likes (Ville's inequality): 1 / e is a p-value.
    Betting {
        /// Logarithm of the e-value, as computed from the expected counts.
        ln_e: f64,
        /// The smallest that the error of the expected counts allows. Only this one can fail a sampler.
        conservative: f64,
    },
    /// The check can't answer here, and others do: inconclusive, but no reason to call the sampler so.
    Unanswered,
}

impl Evidence {
    /// The p-value and the conservative one, where chance is involved.
    pub fn p_values(&self) -> Option<(f64, f64)> {
        match *self {
            Self::Chance { p, conservative } => Some((p, conservative)),
            Self::Betting { ln_e, conservative } => {
                Some(((-ln_e).exp().min(1.0), (-conservative).exp().min(1.0)))
            }
            Self::Certain(_) | Self::Unanswered => None,
        }
    }
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
    /// What it would have caught, as a phrase: "a relative error of 1e-3 over 3% of the variates"; empty where that can't be said.
    pub sees: String,
    /// The same in figures, where it is a relative error over a share of the mass.
    pub power: Option<Power>,
}

impl Finding {
    pub(super) fn new(check: &'static str, evidence: Evidence, detail: impl Into<String>) -> Self {
        Self { check, part: String::new(), evidence, detail: detail.into(), sees: String::new(), power: None }
    }

    pub(super) fn certain(check: &'static str, verdict: Verdict, detail: impl Into<String>) -> Self {
        Self::new(check, Evidence::Certain(verdict), detail)
    }

    pub(super) fn part(self, part: impl Into<String>) -> Self {
        Self { part: part.into(), ..self }
    }

    pub(super) fn sees(self, sees: impl Into<String>) -> Self {
        Self { sees: sees.into(), ..self }
    }
}
