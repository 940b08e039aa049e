//! How the p-value went as samples came in.
//!
//! A right sampler's wanders, a wrong one's falls without end: its logarithm is about linear in the number of samples. One look says which only to
//! those who know the level; the line says it to everybody. Counts are kept whenever the number of samples has doubled, and judged in the end, with the
//! expected counts as they are then, by the chi-square test alone (its scales by Bonferroni's correction).

use super::expectation::Expectation;
use super::goodness;
use super::tally::{SHARD, Tally};

/// The p-value at a number of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Samples drawn by then.
    pub samples: u64,
    /// The p-value of all of them, the largest that the errors of the expected counts allow; in a run that stops as soon as it knows, 1 over the largest
    /// e-value so far. Not corrected for other tests, nor for having looked before.
    pub p: f64,
}

/// Keeps counts to be judged later.
pub(super) struct History {
    next: u64,
    kept: Vec<Tally>,
    bets: Vec<Look>,
}

impl History {
    pub fn new() -> Self {
        Self { next: SHARD, kept: Vec::new(), bets: Vec::new() }
    }

    /// To be called after every shard; `ln_e` where there are bets.
    pub fn look(&mut self, tally: &Tally, ln_e: Option<f64>) {
        if tally.samples < self.next {
            return;
        }
        self.next = 2 * tally.samples;
        match ln_e {
            Some(ln_e) => self.bets.push(bet(tally.samples, ln_e)),
            None => self.kept.push(tally.counts()),
        }
    }

    /// What all samples say included.
    pub fn judge(mut self, expectation: &Expectation, tally: &Tally, ln_e: Option<f64>) -> Vec<Look> {
        let last = self.bets.last().map(|b| b.samples).max(self.kept.last().map(|t| t.samples));
        if last != Some(tally.samples) {
            match ln_e {
                Some(ln_e) => self.bets.push(bet(tally.samples, ln_e)),
                None => self.kept.push(tally.counts()),
            }
        }
        let judged = self.kept.iter().filter_map(|tally| {
            let p = goodness::p_of_counts(expectation, tally)?;
            Some(Look { samples: tally.samples, p })
        });
        self.bets.iter().copied().chain(judged).collect()
    }
}

fn bet(samples: u64, ln_e: f64) -> Look {
    Look { samples, p: (-ln_e).exp().min(1.0) }
}
