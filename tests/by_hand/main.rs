//! Verifications where the report is known by hand: counts that were chosen, samples that are drawn again here, closed forms. Written for their mutants (docs/mutants.md), and a binary
//! of their own that is asked for: `cargo test --test by_hand`.

mod counts;
mod diagnoses;
mod films_and_means;
mod jacobians;
mod mistakes;
mod pairs;
mod relations;
mod reports;
mod rows;
mod sequences;
mod streams;
mod variates;
mod weights;

use warpcheck::domain::Domain;
use warpcheck::random::{stream, unit_f64};
use warpcheck::sampler::{Preimage, Sample, Sampler};
use warpcheck::verify::{Evidence, Examination, Finding, Rows, RowsError, Verify, checks};

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found}, not {expected}");
}

/// Rows of numbers, given out so many at a time.
struct Given {
    numbers: Vec<f64>,
    width: usize,
    at_once: usize,
    /// Whether it says how many there are.
    counted: bool,
    given: usize,
}

impl Given {
    fn new(width: usize, numbers: Vec<f64>) -> Self {
        Self { numbers, width, at_once: usize::MAX, counted: true, given: 0 }
    }
}

impl Rows for Given {
    fn width(&self) -> usize {
        self.width
    }

    fn count(&self) -> Option<u64> {
        self.counted.then_some((self.numbers.len() / self.width) as u64)
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        let rows = most.min(self.at_once).min((self.numbers.len() - self.given) / self.width);
        let end = self.given + rows * self.width;
        out.extend_from_slice(&self.numbers[self.given..end]);
        self.given = end;
        Ok(rows)
    }
}

/// What one check alone finds.
fn alone<D: Domain>(verify: Verify<'_, D>, check: &str) -> Examination {
    let others = checks().map(|(name, _)| name).filter(|name| *name != check);
    others.fold(verify.undiagnosed(), |verify, name| verify.without(name)).examine()
}

/// The same in another order.
fn shuffled<T>(mut all: Vec<T>) -> Vec<T> {
    let mut rng = stream(11, "shuffled", 0);
    for i in (1..all.len()).rev() {
        all.swap(i, (unit_f64(&mut rng) * (i + 1) as f64) as usize);
    }
    all
}

/// The finding of a check, or of a part of it.
#[track_caller]
fn found<'a>(examination: &'a Examination, check: &str, part: &str) -> &'a Finding {
    let same = |finding: &&Finding| finding.check == check && finding.part == part;
    examination
        .findings
        .iter()
        .find(same)
        .unwrap_or_else(|| panic!("no {check} ({part}) in {:#?}", examination.findings))
}

/// Its p-value, and the conservative one.
#[track_caller]
fn p_of(finding: &Finding) -> (f64, f64) {
    finding.evidence.p_values().unwrap_or_else(|| panic!("no p-value: {finding:?}"))
}

#[track_caller]
fn is_certain(finding: &Finding, verdict: warpcheck::verify::Verdict) {
    assert_eq!(finding.evidence, Evidence::Certain(verdict), "{finding:?}");
}

/// A sampler that is told what to answer.
struct Told<'a, D: Domain> {
    domain: D,
    dimensions: usize,
    sample: Box<dyn Fn(&[f64]) -> Option<Sample<D::Point>> + Sync + 'a>,
    density: Box<dyn Fn(&D::Point) -> f64 + Sync + 'a>,
    invert: Option<Box<dyn Fn(&D::Point) -> Vec<f64> + Sync + 'a>>,
    preimages: Option<Box<dyn Fn(&D::Point) -> Vec<Preimage> + Sync + 'a>>,
    left_over: Option<Box<dyn Fn(&[f64]) -> f64 + Sync + 'a>>,
    variate_knots: Vec<f64>,
    is_slow: bool,
}

impl<'a, D: Domain> Told<'a, D> {
    /// Of one variate, unless told.
    fn new(
        domain: D,
        sample: impl Fn(&[f64]) -> Option<Sample<D::Point>> + Sync + 'a,
        density: impl Fn(&D::Point) -> f64 + Sync + 'a,
    ) -> Self {
        Self {
            domain,
            dimensions: 1,
            sample: Box::new(sample),
            density: Box::new(density),
            invert: None,
            preimages: None,
            left_over: None,
            variate_knots: vec![],
            is_slow: false,
        }
    }
}

impl<D: Domain> Sampler for Told<'_, D> {
    type Domain = D;
    fn domain(&self) -> D {
        self.domain.clone()
    }
    fn dimensions(&self) -> usize {
        self.dimensions
    }
    fn sample(&self, xi: &[f64]) -> Option<Sample<D::Point>> {
        (self.sample)(xi)
    }
    fn density(&self, point: &D::Point) -> f64 {
        (self.density)(point)
    }
    fn invert(&self, point: &D::Point) -> Option<Vec<f64>> {
        self.invert.as_ref().map(|invert| invert(point))
    }
    fn preimages(&self, point: &D::Point) -> Option<Vec<Preimage>> {
        self.preimages.as_ref().map(|preimages| preimages(point))
    }
    fn left_over(&self, xi: &[f64]) -> Option<f64> {
        self.left_over.as_ref().map(|left_over| left_over(xi))
    }
    fn variate_knots(&self, dimension: usize) -> Vec<f64> {
        if dimension == 0 { self.variate_knots.clone() } else { vec![] }
    }
    fn is_slow(&self) -> bool {
        self.is_slow
    }
}
