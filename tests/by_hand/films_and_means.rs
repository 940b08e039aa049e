//! Films and estimators: what they are asked, and what is said of their answers.

use super::*;
use std::cell::{Cell, RefCell};
use warpcheck::random::{ONE_MINUS_EPSILON_F32, ONE_MINUS_EPSILON_F64, stream, unit_f64};
use warpcheck::statistics::Moments;
use warpcheck::verify::{Report, Settings, Values, Verdict, estimator, film};

const PARTS: [&str; 5] = ["constant", "small after large", "rejected", "nothing", "threads"];
/// 1e6 and 2^22 ones; 0 to 6 in turn, 65,536 of them.
const MEANS: [f64; 5] = [0.5, 5_194_304.0 / 4_194_305.0, 0.25, 0.0, 196_603.0 / 65_536.0];

/// Which question it is, by how many values there are.
fn question(streams: &[Values]) -> usize {
    let lengths = [1 << 25, (1 << 22) + 1, 1 << 12, 16, 1 << 16];
    let left = streams[0].size_hint();
    assert_eq!((Some(left.0), streams.len()), (left.1, if left.0 == 1 << 16 { 4 } else { 1 }));
    lengths.iter().position(|&length| length == left.0).unwrap()
}

#[test]
fn what_a_film_is_asked() {
    let asked = RefCell::new(Vec::new());
    let answer = |streams: Vec<Values>| {
        let question = question(&streams);
        for stream in streams {
            let first: Vec<_> = stream.clone().take(9).collect();
            asked.borrow_mut().push((question, first));
            let (mut rest, mut count) = (stream, 0);
            while question == 3 && rest.next().is_some() {
                count += 1;
                assert_eq!(rest.size_hint(), (16 - count, Some(16 - count)));
            }
        }
        MEANS[question]
    };
    let examination = film(answer).name("mine").examine();
    let asked = asked.into_inner();
    assert_eq!(
        asked.iter().map(|(question, _)| question).collect::<Vec<_>>(),
        [vec![&0, &1, &2, &3], vec![&4; 32]].concat()
    );
    let seven = |i: u64| Some((i % 7) as f64);
    assert_eq!(asked[0].1, [Some(0.5); 9]);
    assert_eq!(asked[1].1[..3], [Some(1e6), Some(1.0), Some(1.0)]);
    assert_eq!(asked[2].1, [Some(1.0), None, None, None, Some(1.0), None, None, None, Some(1.0)]);
    assert_eq!(asked[3].1, [None; 9]);
    assert_eq!(asked[35].1, (0..9).map(seven).collect::<Vec<_>>());
    assert_eq!((examination.name.as_str(), examination.domain, examination.per), ("mine", "film", "sample"));
    assert_eq!(examination.samples, (1 << 25) + (1 << 22) + 1 + (1 << 12) + 16 + 8 * 4 * (1 << 16));
    assert!(
        PARTS
            .iter()
            .zip(&examination.findings)
            .all(|(part, finding)| finding.part == *part && finding.check == "film")
    );
    let detail = "the mean of 262144 samples in 4 streams is 2.999923706, and should be 2.999923706";
    assert_eq!(found(&examination, "film", "threads").detail, detail);
    assert_eq!(Report::new(vec![examination], &Settings::default()).verdict(), Verdict::Pass);
}

#[test]
fn which_means_of_a_film_are_wrong() {
    // Each is off by a little less than a hundred-thousandth, or by a little more.
    for (off, verdict) in [
        (0.99e-5, Verdict::Pass),
        (-0.99e-5, Verdict::Pass),
        (1.01e-5, Verdict::Fail),
        (-1.01e-5, Verdict::Fail),
    ] {
        let examination = film(|streams| MEANS[question(&streams)] * (1.0 + off)).examine();
        for (part, finding) in PARTS.iter().zip(&examination.findings) {
            is_certain(finding, if *part == "nothing" { Verdict::Pass } else { verdict });
        }
    }
    for wrong in [f64::NAN, f64::INFINITY, 1e-9] {
        let examination =
            film(|streams| if question(&streams) == 3 { wrong } else { MEANS[question(&streams)] }).examine();
        is_certain(found(&examination, "film", "nothing"), Verdict::Fail);
        is_certain(found(&examination, "film", "threads"), Verdict::Pass);
    }
    // One of eight times is enough, and then no more is asked.
    for wrong in 0..9 {
        let tries = Cell::new(0);
        let answer = |streams: Vec<Values>| {
            let question = question(&streams);
            let off = if question == 4 && tries.replace(tries.get() + 1) == wrong { 1.0 } else { 0.0 };
            MEANS[question] + off
        };
        let examination = film(answer).examine();
        let finding = found(&examination, "film", "threads");
        is_certain(finding, if wrong < 8 { Verdict::Fail } else { Verdict::Pass });
        assert_eq!(finding.detail.contains("is 3.999923706, and should be 2.999923706"), wrong < 8);
        assert_eq!(tries.get(), (wrong + 1).min(8));
    }
}

#[test]
fn the_mean_of_an_estimator_is_that_of_its_samples() {
    const SAMPLES: u64 = 20_000;
    let square = |x: f64| x * x;
    let drawn: Moments = [(0, 16_384), (1, SAMPLES - 16_384)]
        .into_iter()
        .flat_map(|(shard, count)| {
            let mut rng = stream(7, "estimator", shard);
            (0..count).map(move |_| square(unit_f64(&mut rng))).collect::<Vec<_>>()
        })
        .collect();
    let examine = |truth: f64| {
        let settings = Settings { samples: SAMPLES, seed: 7, ..Settings::default() };
        estimator(square, truth).name("mine").settings(settings).examine()
    };
    let examination = examine(1.0 / 3.0);
    let mean = found(&examination, "mean", "");
    let error = (drawn.variance().unwrap() / SAMPLES as f64).sqrt();
    assert_eq!(mean.detail, format!("the mean is {:.6} +- {error:.1e}, the truth 0.333333", drawn.mean()));
    let test = drawn.mean_test(1.0 / 3.0, 1e-6 / 3.0).unwrap();
    let (p, conservative) = p_of(mean);
    near(p, test.p_conservative, 1e-9);
    near(conservative, test.p_conservative, 1e-9);
    // 2.326 standard errors beyond the 3.29 of one in a thousand.
    assert_eq!(mean.sees, format!("a mean that is {:.1e} off", (2.33 + 3.290_527) * error + 1e-6 / 3.0));
    assert_eq!(
        (examination.samples, examination.domain, examination.name.as_str()),
        (SAMPLES, "estimator", "mine")
    );
    is_certain(found(&examination, "domain", ""), Verdict::Pass);
    assert!(examination.diagnosis.is_none());
    // A truth of twice as much is far off, and named; one of 0 has no ratio.
    let half = examine(2.0 / 3.0);
    let diagnosis = half.diagnosis.as_ref().unwrap();
    assert!(diagnosis.is("constant 1 / 2"), "{diagnosis:?}");
    assert_eq!(diagnosis.text, "every value is 1 / 2 times what it should be");
    assert_eq!(examine(0.0).diagnosis, None);
    // A truth of no name.
    let odd = examine(0.2).diagnosis.unwrap();
    assert!(!odd.explains);
    assert_eq!(
        (odd.name, odd.text),
        ("constant".to_owned(), format!("the mean is {:.6} times what it should be", drawn.mean() / 0.2))
    );
}

#[test]
fn values_without_spread_or_number() {
    let constant = |value: f64, truth: f64| estimator(move |_: f64| value, truth).samples(2000).examine();
    // Rounding explains a millionth.
    for (value, evidence) in [
        (3.0, Evidence::Chance { p: 1.0, conservative: 1.0 }),
        (3.000_002_9, Evidence::Chance { p: 1.0, conservative: 1.0 }),
        (3.000_003_1, Evidence::Certain(Verdict::Fail)),
        (-3.0, Evidence::Certain(Verdict::Fail)),
    ] {
        assert_eq!(found(&constant(value, 3.0), "mean", "").evidence, evidence, "{value}");
    }
    assert!(constant(-3.0, 3.0).diagnosis.unwrap().name == "constant");
    assert!(constant(1.5, 3.0).diagnosis.unwrap().is("constant 1 / 2"));
    assert!(constant(1.5, -3.0).diagnosis.unwrap().name == "constant");
    let few = estimator(|x: f64| x, 0.9).samples(999).examine();
    assert_eq!((found(&few, "mean", "").evidence, few.diagnosis), (Evidence::Unanswered, None));
    let heavy = estimator(|x: f64| if x < 1e-3 { 1e3 } else { 0.0 }, 0.1).samples(5000).examine();
    assert_eq!((found(&heavy, "mean", "").evidence, heavy.diagnosis), (Evidence::Unanswered, None));
    // Not a number in the middle.
    let bad =
        estimator(|x: f64| if (0.3..0.4).contains(&x) { f64::NAN } else { x }, 0.5).samples(2000).examine();
    is_certain(found(&bad, "mean", ""), Verdict::Fail);
    assert_eq!(found(&bad, "mean", "").detail, "not every value is a number: their mean is NaN");
    is_certain(found(&bad, "domain", ""), Verdict::Pass);
    // Or at one end alone.
    for (end, value) in [
        (0.0, f64::INFINITY),
        (f64::from(ONE_MINUS_EPSILON_F32), f64::NEG_INFINITY),
        (ONE_MINUS_EPSILON_F64, f64::NAN),
    ] {
        let examination =
            estimator(move |[x, y]: [f64; 2]| if y == end { value } else { x }, 0.5).samples(2000).examine();
        let domain = found(&examination, "domain", "");
        is_certain(domain, Verdict::Fail);
        assert_eq!(domain.detail, format!("at xi = {:?} the value is {value}", [0.0, end]));
    }
}
