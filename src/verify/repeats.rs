//! Samples repeat no more often than rounding explains: a sampler that uses 8 or 16 bits of its variates has few points.
//!
//! Among N samples there are N (N - 1) / 2 pairs. Two agree to the last bit with the probability of the lattice of 24-bit variates, 2^-24, or that of
//! falling into one rounding cell of an `f32` point, which is its measure times the mean density; the number of pairs that agree is then about Poisson (the
//! birthday problem). More is too few distinct values.

use super::check::{Case, Check, Needs, Rests};
use super::finding::{Evidence, Finding};
use super::probe::{Fate, each_pilot};
use crate::random::{fill_unit, stream};
use crate::statistics::poisson;

const SAMPLES: usize = 1 << 14;
/// Sides of a rounding cell of an `f32` point of size 1; generous.
const ROUNDING: f64 = 2.4e-7;

pub(super) struct Repeats;

impl Check for Repeats {
    fn name(&self) -> &'static str {
        "repeats"
    }

    fn about(&self) -> &'static str {
        "no more equal points than 24-bit variates and rounding explain"
    }

    fn rests(&self) -> Rests {
        Rests::Counts
    }

    fn needs(&self) -> Needs {
        Needs::Samples
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let Some(Repeated { samples, pairs, equal, allowed, .. }) = repeated(case) else { return Vec::new() };
        let p = if equal == 0 { 1.0 } else { poisson::upper_tail(equal, allowed).unwrap_or(f64::NAN) };
        let distinct = if equal > 0 {
            format!(", as if there were {:.0} values", pairs / equal as f64)
        } else {
            String::new()
        };
        let detail = format!(
            "{equal} pairs of {samples} samples are equal to the last bit, {allowed:.1} may be{distinct}"
        );
        vec![Finding::new(self.name(), Evidence::Chance { p, conservative: p }, detail).sees(format!(
            "fewer than {:.0} distinct values",
            pairs / (allowed + 5.0 * allowed.sqrt() + 20.0)
        ))]
    }
}

/// How many pairs of points are equal.
pub(super) struct Repeated {
    /// Points that were compared.
    samples: usize,
    /// Pairs of them.
    pub(super) pairs: f64,
    /// Pairs that agree to the last bit.
    pub(super) equal: u64,
    /// Points that came more than once.
    pub(super) points: u64,
    /// How many equal pairs the lattice of variates and rounding explain.
    pub(super) allowed: f64,
}

/// `None` where points can't be told apart anyway, or there are none.
pub(super) fn repeated(case: &Case<'_>) -> Option<Repeated> {
    let (probe, space) = (case.probe, case.probe.space());
    if space.axes() == 0 {
        return None;
    }
    let mut rng = stream(case.settings.seed, "repeats", 0);
    let mut xi = vec![0.0; probe.dimensions().max(1) * SAMPLES];
    match probe.pilots() {
        None => fill_unit(&mut rng, &mut xi),
        Some(pilots) => xi = each_pilot(pilots, SAMPLES),
    }
    let mut draws = Vec::new();
    probe.draw(&xi, usize::MAX, &mut draws, &mut Vec::new());
    draws.retain(|d| d.fate == Fate::Drawn && !space.is_atom(d.location.patch) && d.density.is_finite());
    let n = draws.len() as f64;
    if n < 2.0 {
        return None;
    }
    let density = draws.iter().map(|d| d.density).sum::<f64>() / n;
    let mut keys: Vec<[u64; 3]> = draws
        .iter()
        .map(|d| [d.location.patch as u64, d.location.at[0].to_bits(), d.location.at[1].to_bits()])
        .collect();
    keys.sort_unstable();
    let (mut equal, mut points) = (0, 0);
    for run in keys.chunk_by(|a, b| a == b).map(|run| run.len() as u64).filter(|run| *run > 1) {
        equal += run * (run - 1) / 2;
        points += 1;
    }
    let pairs = 0.5 * n * (n - 1.0);
    let cell = ROUNDING.powi(space.axes() as i32);
    // Points are as large as the domain, as far as that is known.
    let measure = space.measure();
    let scale = if measure.is_finite() { measure.max(1.0) } else { 1.0 };
    let allowed = pairs * ((cell * scale * density).min(1.0) + 2.0_f64.powi(-24));
    Some(Repeated { samples: draws.len(), pairs, equal, points, allowed })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Integral, Interval};
    use crate::sampler::{Sampler, from_fn};
    use crate::verify::expectation::told;
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;
    use crate::verify::tally::Tally;
    use std::collections::HashMap;

    /// Of 20,000 values some come twice, and some more often.
    #[test]
    fn points_that_came_more_than_once() {
        let value = |u: f64| (20_000.0 * u).floor();
        let sampler = from_fn(Interval::new(0.0, 1.0), move |u: f64| value(u) / 20_000.0, |_: f64| 1.0);
        let (extras, tally, settings) = (Extras::default(), Tally::default(), Settings::default());
        let probe = Subject::new(&sampler, &extras);
        let expectation = told::expectation(&sampler.domain(), [Integral::default(); 4], vec![]);
        let case = Case { probe: &probe, expectation: &expectation, tally: &tally, settings: &settings };
        let found = repeated(&case).unwrap();
        let mut xi = vec![0.0; SAMPLES];
        fill_unit(&mut stream(settings.seed, "repeats", 0), &mut xi);
        let mut counts = HashMap::<u64, u64>::new();
        xi.into_iter().for_each(|u| *counts.entry(value(u) as u64).or_default() += 1);
        let points = counts.values().filter(|&&n| n > 1).count() as u64;
        let equal: u64 = counts.values().map(|n| n * (n - 1) / 2).sum();
        assert!(points > 1000 && equal > points + 100);
        assert_eq!((found.points, found.equal, found.samples), (points, equal, SAMPLES));
    }
}
