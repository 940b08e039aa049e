//! The e-process: numbers against a table, its martingale property by enumeration, and what it does over many runs.

use super::{multinomial, table};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use warpcheck::statistics::Error;
use warpcheck::statistics::e_process::{EProcess, ln_mean_e};

fn once(p: &[f64], errors: &[f64], counts: &[u64]) -> EProcess {
    let mut test = EProcess::new(p, errors).unwrap();
    test.observe(counts).unwrap();
    test
}

/// All ways to put `n` samples into `cells` cells.
fn outcomes(n: u64, cells: usize) -> Vec<Vec<u64>> {
    if cells == 1 {
        return vec![vec![n]];
    }
    (0..=n)
        .flat_map(|first| {
            outcomes(n - first, cells - 1).into_iter().map(move |rest| [vec![first], rest].concat())
        })
        .collect()
}

fn probability(counts: &[u64], p: &[f64]) -> f64 {
    let factorial = |n: u64| (1..=n).map(|i| i as f64).product::<f64>();
    let orders = factorial(counts.iter().sum()) / counts.iter().map(|&n| factorial(n)).product::<f64>();
    orders * counts.iter().zip(p).map(|(&n, p)| p.powi(n as i32)).product::<f64>()
}

#[test]
fn matches_the_table() {
    for row in table("e_process") {
        let case = row[0] as u64;
        let cells = [2, 3, 5, 40][case as usize % 4];
        let weights: Vec<f64> = (0..cells).map(|i| (1 + (7 * i + 3 * case) % 11) as f64).collect();
        let sum: f64 = weights.iter().sum();
        let p: Vec<f64> = weights.iter().map(|w| w / sum).collect();
        let size = 10_f64.powi(2 + 3 * (case as i32 / 4));
        let counts: Vec<u64> = (0..cells)
            .zip(&p)
            .map(|(i, q)| (size * q * (1.0 + 0.01 * (((5 * i + case) % 7) as f64 - 3.0))) as u64)
            .collect();
        assert_eq!(counts.iter().sum::<u64>() as f64, row[1], "case {case}");
        let error = [1e-6, 1e-3, 3e-2][case as usize % 3];
        let errors: Vec<f64> = p.iter().map(|q| error * q).collect();
        let test = once(&p, &errors, &counts);
        println!("{row:?}: {} {}", test.ln_e(), test.ln_e_conservative());
        // Bounds of the errors are taken 1e-12 further apart, which each sample pays for.
        let tolerance = |truth: f64| 1e-10 + 1e-11 * truth.abs() + 1e-13 * row[1];
        assert!((test.ln_e() - row[2]).abs() < tolerance(row[2]), "{test:?} {row:?}");
        let truth = row[3].min(row[2]);
        assert!((test.ln_e_conservative() - truth).abs() < tolerance(truth), "{test:?} {row:?}");
    }
}

#[test]
fn mean_over_all_outcomes_is_one() {
    for p in [vec![0.5, 0.5], vec![0.2, 0.3, 0.5], vec![1e-6, 0.001, 0.998999, 0.0]] {
        for n in [1, 2, 5, 9] {
            let mean: f64 = outcomes(n, p.len())
                .iter()
                .filter(|counts| probability(counts, &p) > 0.0)
                .map(|counts| probability(counts, &p) * once(&p, &vec![0.0; p.len()], counts).ln_e().exp())
                .sum();
            assert!((mean - 1.0).abs() < 1e-12, "{mean} at {p:?}, {n}");
        }
    }
}

#[test]
fn conservative_mean_is_at_most_one_for_any_probabilities_within_the_errors() {
    let (given, errors) = ([0.2, 0.31, 0.5, 0.0], [0.05, 0.02, 0.05, 0.01]);
    let mut largest = 0.0_f64;
    for truth in
        [[0.2, 0.3, 0.5, 0.0], [0.16, 0.33, 0.5, 0.01], [0.25, 0.29, 0.45, 0.01], [0.15, 0.3, 0.55, 0.0]]
    {
        for n in [1, 3, 8] {
            let mean: f64 = outcomes(n, 4)
                .iter()
                .filter(|counts| probability(counts, &truth) > 0.0)
                .map(|counts| {
                    let test = once(&given, &errors, counts);
                    assert!(test.ln_e_conservative() <= test.ln_e());
                    probability(counts, &truth) * test.ln_e_conservative().exp()
                })
                .sum();
            largest = largest.max(mean);
        }
    }
    println!("largest mean {largest}");
    assert!(largest <= 1.0 && largest > 0.5, "{largest}");
}

#[test]
fn null_paths_stay_low_and_average_to_one() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let p: Vec<f64> = (1..=20).map(|i| f64::from(i) / 210.0).collect();
    let (paths, mut mean, mut crossed) = (2000, 0.0, [0; 3]);
    let levels = [0.5, 0.1, 0.02];
    for _ in 0..paths {
        let mut test = EProcess::new(&p, &[0.0; 20]).unwrap();
        for look in 0..16 {
            test.observe(&multinomial(1 << look, &p, &mut rng)).unwrap();
        }
        mean += test.ln_e().exp() / f64::from(paths);
        for (hits, level) in crossed.iter_mut().zip(levels) {
            *hits += i32::from(test.anytime_p().0 <= level);
        }
    }
    println!("mean e {mean}, crossed {crossed:?} of {paths} at {levels:?}");
    for (hits, level) in crossed.into_iter().zip(levels) {
        let expected = f64::from(paths) * level;
        assert!(f64::from(hits) < expected + 4.0 * expected.sqrt(), "{hits} of {paths} at {level}");
    }
    // At 65 535 samples most of the mean of e comes from paths that 2000 draws may miss; short paths show all of it.
    assert!(mean < 1.5, "{mean}");
    let (mut mean, mut squares, paths) = (0.0, 0.0, 20_000);
    for _ in 0..paths {
        let e = once(&[0.2; 5], &[0.0; 5], &multinomial(30, &[0.2; 5], &mut rng)).ln_e().exp();
        mean += e / f64::from(paths);
        squares += e * e / f64::from(paths);
    }
    let error = ((squares - mean * mean) / f64::from(paths)).sqrt();
    println!("mean e at 30 samples {mean} +- {error}");
    assert!((mean - 1.0).abs() < 4.0 * error, "{mean} +- {error}");
}

#[test]
fn five_percent_too_much_over_five_percent_of_the_mass_is_found() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let given = [0.05; 20];
    let errors = [0.05 * 1e-6; 20];
    let mut drawn = given.map(|p| p - 0.0025 / 19.0);
    drawn[7] = 0.0525;
    let (mut needed, mut found) = (Vec::new(), 0);
    for _ in 0..200 {
        let mut test = EProcess::new(&given, &errors).unwrap();
        let (mut batch, mut total) = (1000_u64, 0);
        while total + batch <= 1_000_000 {
            test.observe(&multinomial(batch, &drawn, &mut rng)).unwrap();
            total += batch;
            batch = total / 4 + 1000;
            if test.anytime_p().1 <= 1e-4 {
                found += 1;
                needed.push(total);
                break;
            }
        }
    }
    needed.sort_unstable();
    println!("found {found} of 200; median of the samples needed {}", needed[needed.len() / 2]);
    assert!(found >= 198);
}

#[test]
fn errors_cost_little_where_counts_agree_and_excuse_what_lies_within_them() {
    let p = [0.1, 0.2, 0.3, 0.4];
    let counts = [1_000_000_u64, 2_000_000, 3_000_000, 4_000_000];
    // 10 % too much in one cell, with errors of 1e-5: p_i + error_i alone would cost N times their sum, 400.
    let found = once(&p, &[1e-5; 4], &[1_100_000, 1_950_000, 2_975_000, 3_975_000]);
    assert!(
        found.ln_e() - found.ln_e_conservative() < 50.0 && found.ln_e_conservative() > 3000.0,
        "{found:?}"
    );
    let exact = once(&p, &[1e-9; 4], &counts);
    assert!((exact.ln_e() - exact.ln_e_conservative()).abs() < 1e-6, "{exact:?}");
    let excused = once(&p, &[0.02; 4], &[1_100_000, 1_950_000, 2_975_000, 3_975_000]);
    assert!(excused.ln_e() > 3000.0 && excused.ln_e_conservative() < 0.0, "{excused:?}");
}

#[test]
fn one_sample_has_a_closed_form() {
    // e_k = c/q for any k, with q = p over their sum and c the centre, where the error of an empty cell has its share.
    let (p, truth) = ([0.51, 0.51, 0.0], f64::ln(1.02 / 1.04));
    let mut test = once(&p, &[0.0, 0.0, 0.02], &[1, 0, 0]);
    assert!((test.ln_e() - truth).abs() < 1e-12, "{test:?}");
    // Within the errors the first may be anything from q to p, and the second is at least q: no more than q is left.
    assert!((test.ln_e_conservative() - truth).abs() < 1e-10, "{test:?}");
    assert_eq!((test.largest(), test.anytime_p()), ((0.0, 0.0), (1.0, 1.0)));
    test.observe(&[299, 100, 0]).unwrap();
    let largest = (test.ln_e(), test.ln_e_conservative());
    assert!(largest.0 > 40.0 && largest.1 > 40.0);
    test.observe(&[0, 200, 0]).unwrap();
    assert!(test.ln_e() < 0.0 && test.largest() == largest);
    assert_eq!(test.anytime_p(), (f64::exp(-largest.0), f64::exp(-largest.1)));
    // The first, whose share of the sum is 1/3, can't be less; the third leaves the second all that its error allows.
    let test = once(&[0.34; 3], &[0.0, 0.05, 0.05], &[0, 1, 0]);
    assert!(test.ln_e().abs() < 1e-14, "{test:?}");
    let truth = f64::ln(1.0 / 3.0) - f64::ln(2.0 / 3.0 - 0.29);
    assert!((test.ln_e_conservative() - truth).abs() < 1e-10, "{test:?}");
    // Without errors there is nothing to be conservative about.
    let exact = once(&[0.25, 0.75], &[0.0; 2], &[2_500_000_000, 7_500_000_000]);
    assert_eq!(exact.ln_e(), exact.ln_e_conservative());
    // A cell that can have no samples refutes by one, and excuses nothing as long as it has none.
    let (p, errors) = ([0.5, 0.5, 0.0], [0.1, 0.1, 0.0]);
    let hit = once(&p, &errors, &[10, 10, 1]);
    assert_eq!((hit.ln_e(), hit.ln_e_conservative()), (f64::INFINITY, f64::INFINITY));
    let excused = once(&p, &errors, &[600, 400, 0]);
    assert!(excused.ln_e() > 10.0 && excused.ln_e_conservative() <= 0.0, "{excused:?}");
}

#[test]
fn order_of_batches_is_irrelevant() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (p, errors) = ([0.4, 0.35, 0.25], [1e-3; 3]);
    let batches: Vec<Vec<u64>> =
        (0..10).map(|_| (0..3).map(|_| rng.random_range(0..1000)).collect()).collect();
    let run = |order: &mut dyn Iterator<Item = &Vec<u64>>| {
        let mut test = EProcess::new(&p, &errors).unwrap();
        order.for_each(|batch| test.observe(batch).unwrap());
        (test.ln_e(), test.ln_e_conservative())
    };
    let all: Vec<u64> = (0..3).map(|i| batches.iter().map(|batch| batch[i]).sum()).collect();
    let whole = run(&mut [all].iter());
    assert_eq!(run(&mut batches.iter()), whole);
    assert_eq!(run(&mut batches.iter().rev()), whole);
}

#[test]
fn impossible_cells_and_bad_arguments() {
    let zero = once(&[0.5, 0.5, 0.0], &[0.0; 3], &[10, 10, 0]);
    assert!(zero.ln_e() <= 0.0);
    let hit = once(&[0.5, 0.5, 0.0], &[0.0; 3], &[10, 10, 1]);
    assert_eq!((hit.ln_e(), hit.ln_e_conservative()), (f64::INFINITY, f64::INFINITY));
    assert_eq!(hit.anytime_p(), (0.0, 0.0));
    let uncertain = once(&[0.5, 0.5, 0.0], &[1e-3; 3], &[10, 10, 1]);
    assert_eq!(uncertain.ln_e(), f64::INFINITY);
    assert!(uncertain.ln_e_conservative() < 5.0, "{uncertain:?}");
    // If the others are exact, there is no room for the third.
    assert!(once(&[0.5, 0.5, 0.0], &[0.0, 0.0, 1e-3], &[10, 10, 1]).ln_e_conservative() > 20.0);
    let many = once(&[0.5, 0.5, 0.0], &[1e-3; 3], &[10_000, 10_000, 1000]);
    assert!(many.ln_e_conservative() > 1000.0, "{many:?}");
    let mut kept = once(&[0.5, 0.5], &[0.0; 2], &[300, 100]);
    let p = kept.anytime_p();
    kept.observe(&[0, 200]).unwrap();
    assert!(kept.ln_e() < 0.0 && kept.anytime_p() == p && p.0 < 1e-15);

    assert!(matches!(EProcess::new(&[0.5, 0.5], &[0.0]), Err(Error::Length { .. })));
    assert!(matches!(EProcess::new(&[], &[]), Err(Error::TooFew { .. })));
    assert!(matches!(EProcess::new(&[0.5, 0.6], &[0.01; 2]), Err(Error::Argument { .. })));
    assert!(matches!(EProcess::new(&[0.5, f64::NAN], &[0.01; 2]), Err(Error::Element { .. })));
    assert!(matches!(EProcess::new(&[1.5, -0.5], &[0.0; 2]), Err(Error::Element { .. })));
    assert!(matches!(EProcess::new(&[0.5, 0.5], &[0.0, -1.0]), Err(Error::Element { .. })));
    assert!(EProcess::new(&[0.5, 0.5], &[0.0; 2]).unwrap().observe(&[1]).is_err());
    assert_eq!(ln_mean_e(&[]), 0.0);
    assert_eq!(ln_mean_e(&[f64::INFINITY, 0.0]), f64::INFINITY);
    assert_eq!(ln_mean_e(&[f64::NEG_INFINITY; 2]), f64::NEG_INFINITY);
    assert!(ln_mean_e(&[f64::NAN, 1.0]).is_nan() && ln_mean_e(&[1.0, f64::NAN]).is_nan());
}
