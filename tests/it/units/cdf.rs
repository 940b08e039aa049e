use warpcheck::random::ONE_MINUS_EPSILON_F64;
use warpcheck::sampler::{DiscreteCdf, Error};

#[test]
fn zero_weights_are_never_returned() {
    let table = DiscreteCdf::new(&[0.0, 0.0, 1.0, 0.0, 2.0, 0.0]).unwrap();
    for xi in [0.0, 0.333_333, 1.0 / 3.0, 0.34, 0.5, ONE_MINUS_EPSILON_F64, 1.0, f64::NAN, -1.0] {
        let choice = table.choose(xi);
        assert!(matches!(choice.index, 2 | 4), "{xi}: {choice:?}");
        assert!((0.0..1.0).contains(&choice.rest), "{xi}: {choice:?}");
    }
    assert_eq!((0..6).map(|i| table.mass(i)).sum::<f64>(), 1.0);
}

#[test]
fn extreme_weights() {
    for weights in [vec![5e-324, 0.0], vec![f64::MAX, f64::MAX], vec![f64::MAX, 5e-324], vec![1e-320; 7]] {
        let table = DiscreteCdf::new(&weights).unwrap();
        assert_eq!((0..weights.len()).map(|i| table.mass(i)).sum::<f64>(), 1.0, "{weights:?}");
        for (i, w) in weights.iter().enumerate() {
            assert_eq!(table.mass(i) > 0.0, *w > 0.0, "{weights:?}");
        }
    }
}

#[test]
fn powers_of_two_change_no_bit() {
    let weights: Vec<f64> = (1..1000).map(|i| (f64::from(i) * 0.7).sin().abs()).collect();
    let scaled = |s: f64| DiscreteCdf::new(&weights.iter().map(|w| w * s).collect::<Vec<_>>()).unwrap();
    let plain = scaled(1.0);
    assert_eq!(plain, scaled(2.0_f64.powi(60)));
    assert_eq!(plain, scaled(2.0_f64.powi(-60)));
}

#[test]
fn a_long_tail_after_a_heavy_entry_stays_reachable() {
    let mut weights = vec![1e-8; 1_000_000];
    weights[0] = 1.0;
    let table = DiscreteCdf::new(&weights).unwrap();
    let tail = 1.0 - table.mass(0);
    assert!((tail / (999_999.0 * 1e-8 / (1.0 + 999_999.0 * 1e-8)) - 1.0).abs() < 1e-6, "{tail}");
    assert!((1..weights.len()).all(|i| table.mass(i) > 0.0));
}

#[test]
fn the_inverse_stays_in_an_entry_of_one_step() {
    let mut weights = vec![1e-30; 1000];
    weights[0] = 1.0;
    let table = DiscreteCdf::new(&weights).unwrap();
    assert_eq!(table.mass(777), 2.0_f64.powi(-53));
    for rest in [0.0, 0.5, ONE_MINUS_EPSILON_F64] {
        assert!((0..1000).all(|i| table.choose(table.variate(i, rest)).index == i), "{rest}");
    }
}

#[test]
fn bad_weights_are_named() {
    assert_eq!(DiscreteCdf::new(&[]), Err(Error::NoWeights));
    assert_eq!(DiscreteCdf::new(&[0.0; 3]), Err(Error::AllZero { count: 3 }));
    assert_eq!(DiscreteCdf::new(&[1.0, -2.0]), Err(Error::Weight { index: 1, value: -2.0 }));
    assert!(matches!(DiscreteCdf::new(&[f64::NAN]), Err(Error::Weight { index: 0, .. })));
    assert!(matches!(DiscreteCdf::new(&[1.0, f64::INFINITY]), Err(Error::Weight { index: 1, .. })));
}
