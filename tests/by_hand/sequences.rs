//! Runs that stop as soon as they know.

use super::*;
use std::sync::atomic::{AtomicU64, Ordering};
use warpcheck::domain::{Discrete, Interval};
use warpcheck::random::fill_unit;
use warpcheck::statistics::e_process::{EProcess, ln_mean_e};
use warpcheck::verify::{Row, Settings, Verdict, Verify, recording};

const SHARD: usize = 1 << 14;

/// Entries of these masses, drawn by these cumulative probabilities.
fn told<'a>(masses: &'a [f64], cumulative: &'a [f64]) -> Told<'a, Discrete> {
    let entry = |x: f64| cumulative.iter().filter(|&&c| c <= x).count();
    Told::new(
        Discrete::new(masses.len()),
        move |x: &[f64]| Some(Sample { point: entry(x[0]), density: masses[entry(x[0])] }),
        |&i| masses[i],
    )
}

fn anytime<D: Domain>(verify: Verify<'_, D>) -> Examination {
    verify.anytime().undiagnosed().examine()
}

#[test]
fn bets_are_those_of_the_counts() {
    let masses = [0.25; 4];
    let judge = |cumulative: &[f64], samples: usize| {
        let sampler = told(&masses, cumulative);
        let examination = anytime(warpcheck::verify(&sampler).samples(samples as u64));
        // Entries, the pool, and what is rejected, which is known to a millionth.
        let error = examination.integral.1;
        let mut process = EProcess::new(
            &[0.25, 0.25, 0.25, 0.25, 0.0, 0.0],
            &[
                0.25 * f64::EPSILON,
                0.25 * f64::EPSILON,
                0.25 * f64::EPSILON,
                0.25 * f64::EPSILON,
                0.0,
                error + 1e-6,
            ],
        )
        .unwrap();
        let (mut largest, mut conservative, mut looks) = (0.0_f64, 0.0_f64, vec![]);
        for shard in 0..samples.div_ceil(SHARD) {
            if conservative >= 1000.0_f64.ln() {
                break;
            }
            let mut xi = vec![0.0; SHARD.min(samples - shard * SHARD)];
            fill_unit(&mut stream(1, "verify", shard as u64), &mut xi);
            let mut counts = [0; 6];
            xi.iter().for_each(|&x| counts[cumulative.iter().filter(|&&c| c <= x).count()] += 1);
            process.observe(&counts).unwrap();
            largest = largest.max(ln_mean_e(&[process.ln_e()]));
            conservative = conservative.max(ln_mean_e(&[process.ln_e_conservative()]));
            looks.push(conservative);
        }
        let drawn = samples.min(looks.len() * SHARD);
        let finding = found(&examination, "sequential", "1 scales");
        let Evidence::Betting { ln_e, conservative: sure } = finding.evidence else { panic!("{finding:?}") };
        assert!((ln_e - largest).abs() < 1e-9 && (sure - conservative).abs() < 1e-9, "{ln_e} {largest}");
        let detail = format!("ln e = {conservative:.1} at most, in ");
        let samples =
            format!(" looks at {drawn} samples: a right sampler ever reaches 6.9 with probability 0.001");
        assert!(
            finding.detail.starts_with(&detail) && finding.detail.ends_with(&samples),
            "{}",
            finding.detail
        );
        assert_eq!((examination.samples, examination.anytime), (drawn as u64, true));
        (examination, looks)
    };
    let (right, looks) = judge(&[0.25, 0.5, 0.75], 50_000);
    assert!(found(&right, "sequential", "1 scales").detail.contains(" at most, in 4 looks at 50000 samples"));
    assert_eq!(right.history.iter().map(|l| l.samples).collect::<Vec<_>>(), [16_384, 32_768, 50_000]);
    for (look, at) in right.history.iter().zip([0, 1, 3]) {
        near(look.p, (-looks[at]).exp().min(1.0), 1e-9);
    }
    // Neither tests of a number of samples fixed before, nor power at one.
    let tests: Vec<_> = right.findings.iter().map(|f| f.check).collect();
    assert!(
        tests.contains(&"normalisation")
            && !tests.contains(&"chi-square")
            && !tests.contains(&"independence")
            && !tests.contains(&"weights"),
        "{tests:?}"
    );
    assert!(right.power(1e-3).is_empty());
    // A tenth too many in one entry are known after the first shard, a thirtieth after some.
    let (wrong, looks) = judge(&[0.275, 0.5, 0.75], 500_000);
    assert!(looks[0] > 1000.0_f64.ln() && wrong.samples == SHARD as u64);
    let (_, looks) = judge(&[0.2585, 0.5, 0.75], 200_000);
    assert!(looks.len() > 1);
}

#[test]
fn when_a_run_stops() {
    let masses = [0.25; 4];
    let cumulative = [0.262, 0.5, 0.75];
    let stops = |settings: Settings| {
        let sampler = told(&masses, &cumulative);
        let examination = anytime(
            warpcheck::verify(&sampler).settings(Settings { samples: 20 * SHARD as u64, ..settings }),
        );
        let finding = found(&examination, "sequential", "1 scales");
        let Evidence::Betting { conservative, .. } = finding.evidence else { panic!("{finding:?}") };
        (examination.samples / SHARD as u64, conservative)
    };
    // The level is alpha, shared with others and among samplers; a run stops at the first look beyond it.
    let looks = |level: f64| -> u64 {
        let mut process =
            EProcess::new(&[0.25, 0.25, 0.25, 0.25, 0.0, 0.0], &[0.0, 0.0, 0.0, 0.0, 0.0, 1e-6]).unwrap();
        (0..20)
            .find(|&shard| {
                let mut xi = vec![0.0; SHARD];
                fill_unit(&mut stream(1, "verify", shard), &mut xi);
                let mut counts = [0; 6];
                xi.iter().for_each(|&x| counts[cumulative.iter().filter(|&&c| c <= x).count()] += 1);
                process.observe(&counts).unwrap();
                process.ln_e_conservative() >= -level.ln()
            })
            .unwrap()
            + 1
    };
    for (settings, level) in [
        (Settings::default(), 1e-3),
        (Settings { alpha: 0.5, ..Settings::default() }, 0.5),
        (Settings { others: 1_000_000, ..Settings::default() }, 1e-3 / 1_000_001.0),
        (Settings { samplers: 1_000_000_000, ..Settings::default() }, 1e-12),
    ] {
        let (shards, conservative) = stops(settings);
        assert_eq!(shards, looks(level), "{level}");
        assert!(conservative >= -level.ln());
    }
    assert!(looks(0.5) <= looks(1e-3) && looks(0.5) < looks(1e-12));
    // One entry is nothing to bet on.
    let one = Told::new(Discrete::new(1), |_: &[f64]| Some(Sample { point: 0, density: 1.0 }), |_| 1.0);
    let examination = anytime(warpcheck::verify(&one).samples(2000));
    let finding = found(&examination, "sequential", "");
    is_certain(finding, Verdict::Inconclusive);
    assert_eq!(finding.detail, "there are no two cells to bet on");
    // Whoever offends is known at once.
    let outside = Told::new(
        Discrete::new(2),
        |x: &[f64]| {
            Some(Sample { point: if x[0] < 0.01 { 7 } else { usize::from(x[0] < 0.5) }, density: 0.5 })
        },
        |_| 0.5,
    );
    assert_eq!(anytime(warpcheck::verify(&outside).samples(500_000)).samples, SHARD as u64);
    let disagrees = Told::new(
        Discrete::new(2),
        |x: &[f64]| Some(Sample { point: usize::from(x[0] < 0.5), density: 0.6 }),
        |_| 0.5,
    );
    assert_eq!(anytime(warpcheck::verify(&disagrees).samples(500_000)).samples, SHARD as u64);
}

/// 4 cells, 16 and 64, or nearly so, and the mean over them.
#[test]
fn bets_at_several_scales() {
    let masses = [1.0 / 100.0; 100];
    let cumulative: Vec<f64> = (1..100).map(|i| f64::from(i) / 100.0).collect();
    let sampler = told(&masses, &cumulative);
    let examination = anytime(warpcheck::verify(&sampler).samples(20_000));
    let finding = found(&examination, "sequential", "3 scales");
    let Evidence::Betting { ln_e, conservative } = finding.evidence else { panic!("{finding:?}") };
    assert!((0.0..3.0).contains(&ln_e) && conservative <= ln_e);
}

/// Cells are integrated again, by few random points if somebody is plainly wrong, or else by many.
#[test]
fn who_is_hardly_wrong_is_doubted_longer() {
    // So many of 7000 rows in the lower half, each half evenly; the pilots are 1000.
    let doubted = |lower: usize| {
        let even =
            |count: usize, low: f64| (0..count).map(move |i| low + 0.5 * (i as f64 + 0.5) / count as f64);
        let judged = shuffled(even(lower, 0.0).chain(even(7000 - lower, 0.5)).collect());
        let numbers: Vec<f64> = even(500, 0.0).chain(even(500, 0.5)).chain(judged).collect();
        let asked = AtomicU64::new(0);
        let density = |_: &f64| {
            asked.fetch_add(1, Ordering::Relaxed);
            1.0
        };
        let row = |n: &[f64]| Row { point: Some(n[0]), density: None, weight: None };
        let settings = Settings { anytime: true, diagnose: false, ..Settings::default() };
        let examination = recording(Interval::new(0.0, 1.0), Given::new(1, numbers), row)
            .unwrap()
            .density(density)
            .examine(&settings)
            .unwrap();
        let bets = examination.findings.into_iter().find(|finding| finding.check == "sequential").unwrap();
        let Evidence::Betting { conservative, .. } = bets.evidence else { panic!("{bets:?}") };
        (conservative, asked.into_inner())
    };
    let (right, plainly, hardly) = (doubted(3500), doubted(5000), doubted(3790));
    // Suspicious is an e-value of 1000, and beyond doubt one of a billion.
    let (suspicious, sure) = (1e3_f64.ln(), 1e9_f64.ln());
    assert!(
        right.0 < suspicious && plainly.0 > sure && (suspicious..sure).contains(&hardly.0),
        "{right:?} {plainly:?} {hardly:?}"
    );
    // 256 points of each cell, and 4096 more.
    let [few, many] = [plainly.1 - right.1, hardly.1 - plainly.1];
    assert!(few > 0 && many > 8 * few, "{few} {many}");
}

/// Also where the masses were doubted, and the bets made again of all counts.
#[test]
fn as_many_looks_are_told_as_were_taken() {
    let masses = [0.25; 4];
    let cumulative = [0.2585, 0.5, 0.75];
    let sampler = told(&masses, &cumulative);
    let examination = anytime(warpcheck::verify(&sampler).samples(200_000));
    let looks = examination.samples / SHARD as u64;
    let detail = &found(&examination, "sequential", "1 scales").detail;
    assert!(
        looks > 1 && detail.contains(&format!(" in {looks} looks at {} samples", examination.samples)),
        "{detail}"
    );
}
