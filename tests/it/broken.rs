//! The fault collection: each broken specimen is caught, by the check that should see it, and its right twin passes with the same settings and seed. The
//! whole of it, with many seeds and the diagnoses, is `warpcheck faults`.

use warpcheck::domain::{Interval, Square};
use warpcheck::fault::{self, Fault};
use warpcheck::sampler::*;
use warpcheck::verify;
use warpcheck::verify::{Report, Settings, Verdict};

const SAMPLES: u64 = 200_000;
const SEED: u64 = 4;

fn run<S: Sampler>(sampler: &S) -> Report {
    verify(sampler).samples(SAMPLES).seed(SEED).undiagnosed().run()
}

/// Passes where it should, fails where it should, by the check that should see it.
#[track_caller]
fn tell_apart<R: Sampler, B: Sampler>(right: &R, broken: &B, caught_by: &str) {
    run(right).assert();
    let report = run(broken);
    assert_eq!(report.verdict(), Verdict::Fail, "not caught:\n{report}");
    let caught: Vec<_> = report.conclusions[0]
        .iter()
        .filter(|c| c.verdict == Verdict::Fail)
        .map(|c| c.finding.check)
        .collect();
    assert!(caught.contains(&caught_by), "caught by {caught:?}, not by {caught_by}:\n{report}");
}

/// Needs more samples than the others.
const NEEDS_MANY: &str = "discrete/f32-running-sum";

/// Each `step`th of a family.
#[track_caller]
fn bites(family: &str, step: usize) {
    let faults: Vec<Fault> = fault::all().into_iter().filter(|f| f.family() == family).collect();
    assert!(faults.len() >= 7, "{} faults in {family}", faults.len());
    bite(faults.into_iter().step_by(step).filter(|f| step == 1 || f.name != NEEDS_MANY));
}

#[track_caller]
fn bite(faults: impl Iterator<Item = Fault>) {
    let mut passed: Vec<&str> = Vec::new();
    for fault in faults {
        // Twenty such runs or so in a family, a hundred in all.
        let settings = Settings {
            samples: if fault.name == NEEDS_MANY { 1_000_000 } else { SAMPLES / 2 },
            seed: SEED,
            others: 150,
            diagnose: false,
            ..Settings::default()
        };
        let judged =
            |specimen: fault::Specimen| Report::new(vec![specimen.examine(fault.name, &settings)], &settings);
        let broken = judged(fault.make());
        assert_eq!(broken.verdict(), Verdict::Fail, "not caught:\n{broken}");
        let caught = |check: &&str| {
            broken.conclusions[0].iter().any(|c| c.verdict == Verdict::Fail && c.finding.check == *check)
        };
        assert!(fault.caught_by.iter().any(caught), "{} not by {:?}:\n{broken}", fault.name, fault.caught_by);
        if !passed.contains(&fault.twin.name) {
            let right = judged(fault.twin.make());
            assert_eq!(right.verdict(), Verdict::Pass, "{}:\n{right}", fault.twin.name);
            passed.push(fault.twin.name);
        }
    }
}

#[test]
fn names_are_their_own_and_families_are_known() {
    let faults = fault::all();
    let mut names: Vec<_> = faults.iter().map(|f| f.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), faults.len());
    for fault in &faults {
        assert!(
            !fault.wrong.is_empty() && !fault.seen.is_empty() && !fault.caught_by.is_empty(),
            "{}",
            fault.name
        );
        assert!(fault.name.contains('/'), "{}", fault.name);
    }
    assert_eq!(faults.iter().filter(|f| f.held_back).count(), 10);
}

/// Its quadrature has no edges of lamps to follow.
#[test]
fn solid_angle_of_small_triangles() {
    bite(fault::named("solid-angle/acos-unclamped").into_iter());
}

/// A few of each family; all of them are behind `--ignored`.
#[test]
fn discrete() {
    bites("discrete", 3);
}

#[test]
fn triangle() {
    bites("triangle", 3);
}

#[test]
fn environment() {
    bites("environment", 10);
}

#[test]
fn lobes() {
    bites("lobes", 10);
}

#[test]
fn estimators() {
    bites("estimators", 3);
}

#[test]
#[ignore = "long: every fault of five families beside its twin"]
fn every_fault() {
    for family in ["discrete", "triangle", "environment", "lobes", "estimators"] {
        bites(family, 1);
    }
}

#[test]
#[ignore = "long: quadrature over the edges of lamps"]
fn solid_angle() {
    bites("solid-angle", 1);
}

/// NaN at one variate in 2^24.
#[test]
fn nan_at_the_edge() {
    let broken = from_fn(
        Interval::positive(),
        |xi: f32| -xi.ln() * if xi == 0.0 { 0.0 } else { 1.0 }, // inf * 0
        |x: f32| (-x).exp(),
    );
    let right = from_fn(Interval::positive(), |xi: f32| -(-xi).ln_1p(), |x: f32| (-x).exp());
    tell_apart(&right, &broken, "domain");
}

/// 0.3% of the samples lie where the density claims 4e-6 of the mass.
#[test]
fn a_crowd_in_a_rare_place() {
    let side = 0.002_f64; // 4e-6 of the unit square
    let broken = from_fn(
        Square,
        move |[pick, u, v]: [f64; 3]| if pick < 0.003 { [0.3 + side * u, 0.7 + side * v] } else { [u, v] },
        |_: [f64; 2]| 1.0,
    );
    tell_apart(&from_fn(Square, |[u, v]: [f64; 2]| [u, v], |_: [f64; 2]| 1.0), &broken, "chi-square");
}
