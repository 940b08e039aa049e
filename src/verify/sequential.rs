//! A test that may look after every batch and stop when it likes.
//!
//! Counts in few cells of equal mass, at several scales, each bet on by an e-process ([`EProcess`]): a martingale with mean 1 for a right sampler, so
//! that it ever reaches 1 / alpha with probability alpha at most, however often it is looked at (Ville 1939; Lindon and Malek, "Anytime-valid inference
//! for multinomial count data", 2022). The mean over the scales is an e-process again. Few cells, since a bet over many pays late.

use super::expectation::Expectation;
use super::finding::{Evidence, Finding};
use super::goodness::observed;
use super::tally::Tally;
use crate::domain::Groups;
use crate::statistics::e_process::{EProcess, ln_mean_e};

/// Numbers of cells that the scales aim at.
const SCALES: [usize; 3] = [4, 16, 64];

pub(super) struct Bets {
    scales: Vec<(Groups, EProcess, Vec<u64>)>,
    /// The largest mean over the scales so far: as computed, and what the errors of the masses leave of it.
    largest: (f64, f64),
    looks: u64,
}

impl Bets {
    /// `None` where there is nothing to bet on: fewer than two cells, or no finite integral.
    pub fn new(expectation: &Expectation) -> Option<Self> {
        let masses = expectation.masses();
        if !(expectation.total.value.is_finite() && expectation.total.error.is_finite()) {
            return None;
        }
        let mut scales: Vec<(Groups, EProcess, Vec<u64>)> = Vec::new();
        for cells in SCALES {
            let groups = expectation.partition.group(&masses, 1.0 / cells as f64, 0.0);
            if scales.last().is_some_and(|(last, ..)| last.cells.len() == groups.cells.len()) {
                continue;
            }
            let (cells, pool) = expectation.masses_at(&groups);
            let all = cells.into_iter().chain([pool, expectation.rejected()]);
            let (probabilities, errors): (Vec<f64>, Vec<f64>) =
                all.map(|m| (m.value.max(0.0), m.error)).unzip();
            let counts = vec![0; probabilities.len()];
            scales.push((groups, EProcess::new(&probabilities, &errors).ok()?, counts));
        }
        let looks_at_something = scales.iter().any(|(groups, ..)| groups.cells.len() > 1);
        looks_at_something.then_some(Self { scales, largest: (0.0, 0.0), looks: 0 })
    }

    /// The same bets where the masses are known otherwise: the e-value depends on the counts alone, not on when they were looked at.
    pub fn again(&self, expectation: &Expectation, tally: &Tally) -> Option<Self> {
        let mut again = Self::new(expectation)?;
        again.look(tally);
        again.looks = self.looks;
        Some(again)
    }

    /// Takes in what was drawn so far, and returns the conservative logarithm of the largest e-value.
    pub fn look(&mut self, tally: &Tally) -> f64 {
        self.looks += 1;
        for (groups, process, before) in &mut self.scales {
            let (mut now, pool) = observed(groups, tally);
            now.extend([pool, tally.rejected]);
            let new: Vec<u64> = now.iter().zip(&*before).map(|(now, before)| now - before).collect();
            // As many counts as probabilities: it can't fail.
            let _ = process.observe(&new);
            *before = now;
        }
        let mean = |of: fn(&EProcess) -> f64| {
            ln_mean_e(&self.scales.iter().map(|(_, p, _)| of(p)).collect::<Vec<_>>())
        };
        self.largest.0 = self.largest.0.max(mean(EProcess::ln_e));
        self.largest.1 = self.largest.1.max(mean(EProcess::ln_e_conservative));
        self.largest.1
    }

    /// The conservative logarithm of the largest e-value so far.
    pub fn ln_e(&self) -> f64 {
        self.largest.1
    }

    pub fn finding(&self, tally: &Tally) -> Finding {
        let (ln_e, conservative) = self.largest;
        let detail = format!(
            "ln e = {conservative:.1} at most, in {} looks at {} samples: a right sampler ever reaches {:.1} with probability 0.001",
            self.looks,
            tally.samples,
            1000.0_f64.ln()
        );
        Finding::new("sequential", Evidence::Betting { ln_e, conservative }, detail)
            .part(format!("{} scales", self.scales.len()))
    }
}
