//! Grouped data: distances against a table, their p-values over many simulated tables, two count vectors.

use super::{Worst, multinomial, table};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use warpcheck::statistics::{Error, anderson_darling, chi_square, kolmogorov};

#[test]
fn distances_match_the_table() {
    let (mut d, mut a2, mut conservative) = (Worst::default(), Worst::default(), Worst::default());
    for row in table("grouped") {
        let groups = (row.len() - 4) / 2;
        let counts: Vec<u64> = row[4..4 + groups].iter().map(|&count| count as u64).collect();
        let masses = &row[4 + groups..];
        let figure = kolmogorov::grouped(&counts, masses, row[3]).unwrap();
        d.relative(figure.statistic, row[0], &row);
        let n = counts.iter().sum();
        let off = (figure.statistic - row[3]).max(0.0);
        assert!((figure.p_conservative - kolmogorov::sf(off, n).unwrap()).abs() < 1e-9, "{figure:?}");
        let figure = anderson_darling::grouped(&counts, masses, row[3]).unwrap();
        // Masses are known to 1e-16: below 1e-6 or so, the statistic is that of their rounding.
        a2.relative(figure.statistic + 1e-6, row[1] + 1e-6, &row);
        assert!(figure.p_conservative >= figure.p);
        conservative.relative(figure.p_conservative, anderson_darling::limit_sf(row[2]), &row);
    }
    d.below(1e-10);
    a2.below(1e-10);
    conservative.below(1e-10);
}

#[test]
fn many_small_groups_are_the_values_themselves() {
    // One value in the middle of every group, and one group in ten thousand values.
    let n = 2000;
    let values: Vec<f64> = (0..n).map(|i| ((f64::from(i) + 0.5) / f64::from(n)).powf(1.05)).collect();
    let mut counts = vec![0; 100_000];
    values.iter().for_each(|x| counts[(x * 1e5) as usize] += 1);
    let masses = vec![1e-5; 100_000];
    let (d, a2) =
        (kolmogorov::one_sample(&values).unwrap(), anderson_darling::one_sample(&values).unwrap().statistic);
    let grouped = kolmogorov::grouped(&counts, &masses, 0.0).unwrap();
    assert!((grouped.statistic / d.statistic - 1.0).abs() < 1e-3, "{grouped:?} {d:?}");
    let grouped = anderson_darling::grouped(&counts, &masses, 0.0).unwrap().statistic;
    assert!((grouped / a2 - 1.0).abs() < 0.01, "{grouped} {a2}");
}

#[test]
fn two_groups_have_a_closed_form_however_light_one_is() {
    // h rises to e = k/n - m over a mass m, and falls over the rest: the integrals of x / (1 - x) and (1 - x) / x leave
    // A^2 = n e^2 [(-ln(1 - m) - m) / m^2 + (-ln m - (1 - m)) / (1 - m)^2], where the first term tends to 1/2.
    for m in [1e-250_f64, 1e-100, 1e-20, 1e-17] {
        let e = 0.01 - m;
        let truth = 100.0 * e * e * (0.5 - m.ln() - 1.0);
        for (counts, masses) in [([1, 99], [m, 1.0 - m]), ([99, 1], [1.0 - m, m])] {
            let found = anderson_darling::grouped(&counts, &masses, 0.0).unwrap().statistic;
            assert!((found / truth - 1.0).abs() < 1e-12, "{found}, but {truth} at {m}");
        }
    }
}

#[test]
fn masses_are_divided_by_their_sum() {
    // Each half has half of the mass, and a border may be off by the error and by what the sum is off.
    let figure = kolmogorov::grouped(&[60, 40], &[0.51, 0.51], 0.025).unwrap();
    assert!((figure.statistic - 0.1).abs() < 1e-15, "{figure:?}");
    assert!((figure.p - kolmogorov::sf(0.1, 100).unwrap()).abs() < 1e-12, "{figure:?}");
    assert!((figure.p_conservative - kolmogorov::sf(0.055, 100).unwrap()).abs() < 1e-12, "{figure:?}");
    // Two halves: A^2 = n h^2 (8 ln 2 - 4).
    let found = anderson_darling::grouped(&[60, 40], &[0.51, 0.51], 0.025).unwrap().statistic;
    assert!((found - (8.0 * f64::ln(2.0) - 4.0)).abs() < 1e-13, "{found}");
}

/// How many of `p` are at most `level`, as standard deviations above what is expected of uniform ones.
fn surplus(p: &[f64], level: f64) -> f64 {
    let (n, hits) = (p.len() as f64, p.iter().filter(|p| **p <= level).count() as f64);
    (hits - n * level) / (n * level * (1.0 - level)).sqrt()
}

#[test]
fn p_values_are_not_below_uniform() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for groups in [50, 500, 2000] {
        // Masses that range over a factor of a thousand.
        let weights: Vec<f64> = (0..groups).map(|i| 10_f64.powf(f64::from(i * 7 % 31) / 10.0)).collect();
        let total: f64 = weights.iter().sum();
        let masses: Vec<f64> = weights.iter().map(|w| w / total).collect();
        for n in [10_000, 100_000, 1_000_000] {
            let mut p = [const { Vec::new() }; 4];
            // Masses as the user has them: every border off by up to 1e-5, with a steady drift.
            let error = 1e-5;
            let drift = 2.0 * error / f64::from(groups);
            let shifted: Vec<f64> = (0..groups)
                .zip(&masses)
                .map(|(i, mass)| (mass + if 2 * i < groups { drift } else { -drift }).max(0.0))
                .collect();
            for _ in 0..100 {
                let counts = multinomial(n, &masses, &mut rng);
                p[0].push(kolmogorov::grouped(&counts, &masses, 0.0).unwrap().p);
                p[1].push(anderson_darling::grouped(&counts, &masses, 0.0).unwrap().p);
                p[2].push(kolmogorov::grouped(&counts, &shifted, error).unwrap().p_conservative);
                p[3].push(anderson_darling::grouped(&counts, &shifted, error).unwrap().p_conservative);
            }
            for (p, name) in p.iter().zip(["D", "A^2", "D, off", "A^2, off"]) {
                let surplus = [0.5, 0.1, 0.01].map(|level| surplus(p, level));
                println!("{groups} groups, n = {n}, {name}: {surplus:.1?} sigma above 0.5, 0.1, 0.01");
                assert!(surplus.iter().all(|sigma| *sigma < 4.0), "{groups} {n} {name}: {surplus:?}");
                // Nor far above: the groups are small enough for a test that is worth its name.
                assert!(groups < 500 || surplus[0] > -6.0, "{groups} {n} {name}: {surplus:?}");
            }
        }
    }
}

#[test]
fn a_wrong_end_is_seen_by_anderson_and_darling() {
    let (masses, counts) = ([1e-4, 0.4999, 0.5], [400, 49_600, 50_000]);
    let figure = anderson_darling::grouped(&counts, &masses, 0.0).unwrap();
    assert!(figure.p < 1e-3 && kolmogorov::grouped(&counts, &masses, 0.0).unwrap().p > 0.05, "{figure:?}");
    // What may be an error of the mass is no evidence.
    let figure = anderson_darling::grouped(&counts, &masses, 3e-3).unwrap();
    assert!(figure.p < 1e-3 && figure.p_conservative > 0.5, "{figure:?}");
}

#[test]
fn groups_without_mass() {
    let inside = anderson_darling::grouped(&[50, 3, 50], &[0.5, 0.0, 0.5], 0.0).unwrap();
    assert!(inside.statistic.is_finite() && inside.p > 0.9);
    for (counts, masses) in [([1, 50, 50], [0.0, 0.5, 0.5]), ([50, 50, 1], [0.5, 0.5, 0.0])] {
        let end = anderson_darling::grouped(&counts, &masses, 0.0).unwrap();
        assert_eq!((end.statistic, end.p), (f64::INFINITY, 0.0));
        let end = anderson_darling::grouped(&counts, &masses, 1e-300).unwrap();
        assert!(end.p == 0.0 && end.p_conservative < 0.05, "{end:?}");
        let end = anderson_darling::grouped(&counts, &masses, 0.02).unwrap();
        assert!(end.p_conservative > 0.9, "{end:?}");
        assert!(kolmogorov::grouped(&counts, &masses, 0.0).unwrap().p > 0.9);
    }
    let single = anderson_darling::grouped(&[7], &[1.0], 0.0).unwrap();
    assert_eq!((single.statistic, single.p, single.p_conservative), (0.0, 1.0, 1.0));
    assert!(matches!(kolmogorov::grouped(&[1], &[0.5, 0.5], 0.0), Err(Error::Length { .. })));
    assert!(matches!(kolmogorov::grouped(&[0, 0], &[0.5, 0.5], 0.0), Err(Error::TooFew { .. })));
    assert!(matches!(anderson_darling::grouped(&[1, 1], &[0.5, 0.6], 0.01), Err(Error::Argument { .. })));
    assert!(matches!(anderson_darling::grouped(&[1, 1], &[1.5, -0.5], 0.0), Err(Error::Element { .. })));
    assert!(kolmogorov::grouped(&[1, 1], &[0.5, 0.5], f64::NAN).is_err());
    assert!(kolmogorov::grouped(&[], &[], 0.0).is_err());
    assert_eq!(kolmogorov::grouped(&[1, 1], &[0.5, 0.5], f64::INFINITY).unwrap().p_conservative, 1.0);
}

#[test]
fn two_count_vectors_match_the_table() {
    let (mut pearson, mut p, mut g) = (Worst::default(), Worst::default(), Worst::default());
    for row in table("two_sample_counts") {
        let counts: Vec<u64> = row[4..].iter().map(|&count| count as u64).collect();
        let (first, second) = counts.split_at(counts.len() / 2);
        let figure = chi_square::two_sample(first, second).unwrap();
        pearson.relative(figure.statistic, row[0], &row);
        p.relative(figure.p, row[1], &row);
        g.relative(chi_square::two_sample_g(first, second).unwrap().statistic, row[2] / row[3], &row);
        // A cell that is empty in both samples is none.
        let (wider, other) = ([first, &[0]].concat(), [second, &[0]].concat());
        assert_eq!(chi_square::two_sample(&wider, &other), Ok(figure));
    }
    pearson.below(1e-11);
    p.below(1e-10);
    g.below(1e-11);
    assert!(matches!(chi_square::two_sample(&[1, 2], &[1]), Err(Error::Length { .. })));
    assert!(matches!(chi_square::two_sample(&[1, 2], &[0, 0]), Err(Error::TooFew { .. })));
    assert!(matches!(chi_square::two_sample_g(&[], &[]), Err(Error::TooFew { .. })));
    let single = chi_square::two_sample_g(&[3], &[5]).unwrap();
    assert_eq!((single.df, single.p), (0.0, 1.0));
}

#[test]
fn williams_keeps_the_level_where_cells_are_thin() {
    // Four expected counts in each of 50 cells: G alone rejects too often.
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let masses = [0.02; 50];
    let (mut plain, mut corrected, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..4000 {
        let counts = multinomial(200, &masses, &mut rng);
        plain.push(chi_square::g_statistic(&counts, &[4.0; 50]).unwrap().p);
        corrected.push(chi_square::williams_g_statistic(&counts, &[4.0; 50]).unwrap().p);
        let other = multinomial(1000, &masses, &mut rng);
        pairs.push(chi_square::two_sample(&counts, &other).unwrap().p);
    }
    let found = [&plain, &corrected, &pairs].map(|p| surplus(p, 0.05));
    println!("sigma above 0.05: G {:.1}, corrected {:.1}, two samples {:.1}", found[0], found[1], found[2]);
    assert!(found[1] < 0.5 * found[0] && found[2].abs() < 4.0, "{found:?}");
}
