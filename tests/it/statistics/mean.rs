//! Moments and the test of a mean: against plain sums, and over many samples of light and heavy tails.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use warpcheck::statistics::{Error, Moments, Trust};

#[test]
fn higher_moments_match_exact_sums() {
    // 0, 1, 4, ..., 99^2 on top of a million: mean 3283.5 and central moments by exact integer sums.
    let moments: Moments = (0..100_i64).map(|i| 1e6 + (i * i) as f64).collect();
    let central = |power: u32| {
        // Twice the deviation is a whole number.
        let sum: i128 = (0..100_i128).map(|i| (2 * i * i - 6567).pow(power)).sum();
        sum as f64 / f64::from(1_u32 << power)
    };
    let skewness = 10.0 * central(3) / central(2).powf(1.5);
    let kurtosis = 100.0 * central(4) / central(2).powi(2);
    assert_eq!(moments.mean(), 1_003_283.5);
    assert!((moments.variance().unwrap() / (central(2) / 99.0) - 1.0).abs() < 1e-12);
    assert!((moments.skewness().unwrap() / skewness - 1.0).abs() < 1e-10, "{moments:?} {skewness}");
    assert!((moments.kurtosis().unwrap() / kurtosis - 1.0).abs() < 1e-10, "{moments:?} {kurtosis}");
    assert_eq!((moments.smallest(), moments.largest()), (1e6, 1e6 + 9801.0));
    assert_eq!((Moments::new().skewness(), Moments::default().kurtosis()), (None, None));
}

/// Of `runs` samples, how many are trusted, and in how many of these p is at most each level.
fn alarms(runs: u32, n: u32, mean: f64, mut draw: impl FnMut() -> f64) -> (u32, [u32; 2]) {
    let (mut trusted, mut alarms) = (0, [0; 2]);
    for _ in 0..runs {
        let moments: Moments = (0..n).map(|_| draw()).collect();
        let test = moments.mean_test(mean, 0.0).unwrap();
        if test.trust.is_trusted() {
            trusted += 1;
            alarms[0] += u32::from(test.p <= 1e-2);
            alarms[1] += u32::from(test.p <= 1e-3);
        }
    }
    (trusted, alarms)
}

#[test]
fn no_false_alarms_however_heavy_the_tail() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut check = |name: &str, runs: u32, n: u32, mean: f64, draw: &mut dyn FnMut(f64) -> f64| {
        let (trusted, alarms) = alarms(runs, n, mean, || draw(1.0 - rng.random::<f64>()));
        println!("{name}, n = {n}: {trusted} of {runs} trusted, alarms at 1e-2 and 1e-3: {alarms:?}");
        for (alarms, level) in alarms.into_iter().zip([1e-2, 1e-3]) {
            let expected = level * f64::from(trusted);
            assert!(
                f64::from(alarms) <= expected + 4.0 * expected.sqrt() + 1.0,
                "{name}: {alarms} of {trusted}"
            );
        }
        trusted
    };
    for exponent in [1.2, 1.6, 2.5, 3.5] {
        let power = -1.0 / exponent;
        let mean = exponent / (exponent - 1.0);
        let trusted = check(&format!("Pareto {exponent}"), 2000, 2000, mean, &mut |u| u.powf(power));
        assert!(trusted < 100);
    }
    let trusted = check("exponential", 1500, 5000, 1.0, &mut |u| -u.ln());
    assert!(trusted > 750);
    let trusted = check("uniform", 2000, 2000, 0.5, &mut |u| u);
    assert_eq!(trusted, 2000);
    // One in a thousand is a thousand times as large: skewed, but bounded.
    let rare = &mut |u| if u < 0.001 { 1000.0 } else { 0.0 };
    check("rare", 200, 20_000, 1.0, rare);
}

#[test]
fn one_percent_is_caught_in_a_million_values() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let values: Vec<f64> = (0..1_000_000).map(|_| rng.random::<f64>()).collect();
    for (name, of) in [("uniform", (|u| 2.0 * u) as fn(f64) -> f64), ("exponential", |u: f64| -(-u).ln_1p())]
    {
        let moments: Moments = values.iter().map(|&u| of(u)).collect();
        let right = moments.mean_test(1.0, 1e-6).unwrap();
        assert!(right.trust == Trust::Trusted && right.p > 1e-4, "{name}: {right:?}");
        let wrong = moments.mean_test(1.01, 1e-4).unwrap();
        println!("{name}: {wrong:?}");
        assert!(wrong.trust.is_trusted() && wrong.p_conservative < 1e-15, "{name}: {wrong:?}");
        let excused = moments.mean_test(1.01, 0.012).unwrap();
        assert!(excused.p < 1e-15 && excused.p_conservative == 1.0, "{name}: {excused:?}");
        // So far out, only a bound is left.
        let far = moments.mean_test(3.0, 0.0).unwrap();
        assert!(far.trust.is_trusted() && far.p < 1e-15, "{name}: {far:?}");
    }
}

#[test]
fn the_test_of_a_mean_is_the_documented_one() {
    // 10 + 0, 1, 4, ..., 81, a hundred times, and the same the other way round; z, p by the formulas of the module in
    // mpmath, from exact sums.
    let (skewness, z) = (0.021300156973138566, [2.942659839593789, -11.182107390456398]);
    let near = |got: f64, truth: f64| assert!((got / truth - 1.0).abs() < 1e-9, "{got} {truth}");
    for sign in [1.0, -1.0] {
        let of = |x: f64| if sign > 0.0 { x } else { 100.0 - x };
        let moments: Moments = (0..1000).map(|i| of(10.0 + f64::from(i % 10).powi(2))).collect();
        let test = moments.mean_test(of(36.0), 0.5).unwrap();
        near(test.z, sign * z[0]);
        near(test.skewness, sign * skewness);
        near(test.p, 0.005828622401351472);
        near(test.p_conservative, 0.028412637576037762);
        assert_eq!(test.trust, Trust::Trusted);
        // Beyond the last point where the expansion is believed, p is that of this point.
        let test = moments.mean_test(of(48.0), 0.0).unwrap();
        near(test.z, sign * z[1]);
        near(test.p, 5.333104828699114e-7);
        assert_eq!((test.p_conservative, test.trust), (test.p, Trust::Bounded));
    }
}

#[test]
fn the_mean_of_equal_values() {
    let ones = |n: u64| (0..n).map(|_| 1.0).collect::<Moments>();
    // sqrt(n) + 8 units in the last place are rounding.
    let test = |expected: f64, error: f64| ones(10_000).mean_test(expected, error).unwrap();
    assert_eq!(test(1.0 + 100.0 * f64::EPSILON, 0.0).p, 1.0);
    assert_eq!(test(1.0 + 120.0 * f64::EPSILON, 0.0).p, 0.0);
    assert_eq!(
        (test(1.0, 0.0).z, test(2.0, 0.0).z, test(0.5, 0.0).z),
        (0.0, f64::NEG_INFINITY, f64::INFINITY)
    );
    let excused = test(1.1, 0.15);
    assert_eq!((excused.p, excused.p_conservative, excused.trust), (0.0, 1.0, Trust::Trusted));
    let trust = |n: u64| ones(n).mean_test(1.0, 0.0).unwrap().trust;
    assert_eq!((trust(999), trust(1000)), (Trust::TooFew, Trust::Trusted));
    let few: Moments = [4.0, 7.0, 13.0, 16.0].into_iter().collect();
    assert_eq!(few.standard_error(), Some(7.5_f64.sqrt()));
    assert_eq!((ones(1).variance(), ones(1).standard_error()), (None, None));
}

#[test]
fn what_a_sample_cannot_tell() {
    let few: Moments = (0..999).map(f64::from).collect();
    assert_eq!(few.mean_test(0.0, 0.0).unwrap().trust, Trust::TooFew);
    let mut one_large: Moments = (0..100_000).map(|i| f64::from(i % 10)).collect();
    assert_eq!(one_large.mean_test(4.5, 0.0).unwrap().trust, Trust::Trusted);
    one_large.add(1e4);
    assert_eq!(one_large.mean_test(4.5, 0.0).unwrap().trust, Trust::HeavyTailed);
    // Weights that are all the same but for rounding.
    let constant: Moments = (0..100_000).map(|_| 0.1).collect();
    let test = constant.mean_test(0.1, 0.0).unwrap();
    assert_eq!((test.p, test.p_conservative, test.trust), (1.0, 1.0, Trust::Trusted));
    let test = constant.mean_test(0.2, 0.0).unwrap();
    assert_eq!((test.p, test.trust), (0.0, Trust::Constant));
    let rounded: Moments = (1..100_000).map(|i| f64::from(i) * (0.1 / f64::from(i))).collect();
    let test = rounded.mean_test(0.1, 0.0).unwrap();
    assert!(test.p > 0.01, "{test:?}");

    assert!(matches!(Moments::new().mean_test(0.0, 0.0), Err(Error::TooFew { .. })));
    let infinite: Moments = [1.0, f64::INFINITY].into_iter().collect();
    assert!(infinite.mean_test(0.0, 0.0).is_err());
    let nan: Moments = [1.0, f64::NAN].into_iter().collect();
    assert!(nan.mean_test(0.0, 0.0).is_err());
    assert!(few.mean_test(f64::NAN, 0.0).is_err());
    assert!(few.mean_test(0.0, -1.0).is_err());
    assert!(few.mean_test(0.0, f64::NAN).is_err());
    for scale in [1e-320, 1e-100, 1e100] {
        let scaled: Moments = (0..2000).map(|i| f64::from(i % 10) * scale).collect();
        assert!(!scaled.mean_test(5.0 * scale, 0.0).is_ok_and(|test| test.trust.is_trusted()));
    }
}
