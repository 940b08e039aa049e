//! Two samples without any density, and streams against one another.

use glam::{DVec3, Vec3};
use warpcheck::domain::*;
use warpcheck::random::{stream, unit_f64};
use warpcheck::sampler::*;
use warpcheck::statistics::binomial;
use warpcheck::verify;
use warpcheck::verify::{PointsError, Report, Samples, Verdict, compare, compare_samples, streams};

fn run<A: Sampler, B: Sampler<Domain = A::Domain>>(a: &A, b: &B) -> Report {
    compare(a, b).samples(200_000).seed(3).run()
}

#[test]
fn different_ways_to_one_distribution_pass() {
    let warp = |warp| BarycentricWarp::new(warp, 2.0).unwrap();
    run(&warp(TriangleWarp::LowDistortion), &warp(TriangleWarp::SquareRoot)).assert();
    let mean = Vec3::new(0.36, -0.48, 0.8);
    let vmf = VonMisesFisher::new(mean, 1e4).unwrap();
    let mirrored = from_draws(Sphere, |[u, v]: [f64; 2]| {
        VonMisesFisher::new(mean * Vec3::new(1.0, -1.0, 1.0), 1e4)
            .ok()
            .and_then(|s| Sampler::sample(&s, &[u, v]))
            .map(|s| s.point * DVec3::new(1.0, -1.0, 1.0))
    });
    run(&vmf, &mirrored).assert();
    // Rejecting on both sides, a table and a search through it.
    let quarter = |shift: f64| {
        from_draws(Square, move |[u, v]: [f64; 2]| {
            let p = [(u + shift).fract(), v];
            (p[0] * p[0] + p[1] * p[1] < 1.0).then_some(p)
        })
    };
    run(&quarter(0.0), &quarter(0.3)).assert();
    let weights: Vec<f64> = (0..5000).map(|i| f64::from(i % 7)).collect();
    let total: f64 = weights.iter().sum();
    let search = from_draws(Discrete::new(5000), |xi: f64| {
        let mut left = xi * total;
        weights.iter().position(|w| {
            left -= w;
            left < 0.0
        })
    });
    run(&DiscreteCdf::new(&weights).unwrap(), &search).assert();
    run(&DiscreteCdf::new(&[2.0]).unwrap(), &DiscreteCdf::new(&[3.0]).unwrap()).assert();
}

#[test]
fn different_distributions_fail() {
    let outgoing = Vec3::new(0.6, 0.0, 0.8);
    let ggx = GgxVisibleNormals::new(outgoing, 0.3).unwrap();
    let phong = PhongLobe::new(Vec3::new(-0.6, 0.0, 0.8), 20.0).unwrap();
    let vmf = |kappa| VonMisesFisher::new(outgoing, kappa).unwrap();
    let on_hemisphere = from_draws(Hemisphere, |[u, v]: [f64; 2]| {
        Sampler::sample(&vmf(30.0), &[u, v]).map(|s| s.point).filter(|w| w.z > 0.0)
    });
    let pairs = [
        ("Phong, GGX", run(&phong, &ggx)),
        ("vMF, GGX", run(&on_hemisphere, &ggx)),
        ("cosine, uniform", run(&CosineHemisphere, &UniformHemisphere)),
        ("vMF 1e4 and 1.03e4", run(&vmf(1e4), &vmf(1.03e4))),
        // The same points, but some of them rejected.
        ("rejecting", {
            let some = from_draws(Hemisphere, |[u, v, keep]: [f32; 3]| {
                (keep < 0.98).then(|| CosineHemisphere.sample([u, v].into()))
            });
            run(&CosineHemisphere, &some)
        }),
        ("every second entry", {
            let all = from_draws(Discrete::new(1 << 20), |xi: f64| (xi * 1_048_576.0) as usize);
            let even = from_draws(Discrete::new(1 << 20), |xi: f64| (xi * 1_048_576.0) as usize & !1);
            run(&all, &even)
        }),
        ("domains", run(&DiscreteCdf::new(&[1.0; 3]).unwrap(), &DiscreteCdf::new(&[1.0; 4]).unwrap())),
    ];
    for (name, report) in pairs {
        assert_eq!(report.verdict(), Verdict::Fail, "{name}:\n{report}");
    }
    let outside = from_draws(Hemisphere, |[u, v]: [f32; 2]| -CosineHemisphere.sample([u, v].into()));
    let report = run(&CosineHemisphere, &outside);
    assert!(format!("{report}").contains("under the horizon"), "{report}");
}

/// A density too high by a part over 5% of the mass, in a square, and too low elsewhere.
fn planted(part: f64) -> impl Sampler<Domain = Square> {
    let side = 0.05_f64.sqrt();
    from_draws(Square, move |[u, v, pick]: [f64; 3]| {
        let inside = |x: f64, y: f64| [0.3 + side * x, 0.2 + side * y];
        if pick < 0.05 * part / 0.95 { inside(u, v) } else { [u, v] }
    })
}

/// Of 10 runs at 1e6 samples of each and alpha 0.001, 5 saw 5% over 5% of the mass. An error of 8% is always seen.
#[test]
fn what_is_seen_over_five_percent_of_the_mass() {
    let plain = from_draws(Square, |[u, v]: [f64; 2]| [u, v]);
    let caught = |part: f64, runs: u64| {
        let run = |seed: &u64| compare(&plain, &planted(part)).samples(1_000_000).seed(*seed).run();
        (0..runs).filter(|seed| run(seed).verdict() == Verdict::Fail).count()
    };
    let (slight, plain_to_see) = (caught(0.05, 3), caught(0.08, 1));
    println!("caught: 5% in {slight} of 3 runs, 8% in {plain_to_see} of 1");
    assert!(slight >= 1 && plain_to_see == 1, "{slight} {plain_to_see}");
}

#[test]
fn as_many_false_alarms_as_alpha_says() {
    false_alarms(60);
}

#[test]
#[ignore = "long: many runs"]
fn as_many_false_alarms_in_a_thousand_as_alpha_says() {
    false_alarms(1000);
}

fn false_alarms(runs: u64) {
    const ALPHA: f64 = 0.05;
    let mean = Vec3::new(0.36, -0.48, 0.8);
    let vmf = VonMisesFisher::new(mean, 50.0).unwrap();
    let same = from_draws(Sphere, |[u, v]: [f64; 2]| Sampler::sample(&vmf, &[u, v]).map(|s| s.point));
    let alarms = (0..runs)
        .filter(|&seed| {
            compare(&vmf, &same).samples(4_000).seed(seed).alpha(ALPHA).run().verdict() != Verdict::Pass
        })
        .count() as u64;
    println!("{alarms} of {runs} at alpha {ALPHA}");
    assert!(binomial::upper_tail(alarms, runs, ALPHA).unwrap() > 1e-4, "{alarms} of {runs}");
}

fn square_points(seed: u64, count: usize) -> Vec<[f64; 2]> {
    let mut rng = stream(seed, "points", 0);
    (0..count).map(|_| [unit_f64(&mut rng), unit_f64(&mut rng)]).collect()
}

#[test]
fn points_alone() {
    let samples = |seed, count| Samples::new(Square, square_points(seed, count)).unwrap();
    compare_samples(&samples(1, 50_000), &samples(2, 80_000)).names("a", "b").run().assert();
    // As f32, and with rejected variates.
    let single = square_points(3, 50_000).into_iter().map(|[x, y]| [x as f32, y as f32]);
    let single = Samples::new(Square, single).unwrap();
    compare_samples(&samples(1, 50_000), &single).run().assert();
    compare_samples(&samples(1, 50_000).rejected(5000), &samples(2, 80_000).rejected(8000)).run().assert();
    let fails = |a: &Samples<Square>, b: &Samples<Square>| {
        let report = compare_samples(a, b).run();
        assert_eq!(report.verdict(), Verdict::Fail, "{report}");
    };
    fails(&samples(1, 50_000).rejected(5000), &samples(2, 80_000));
    let root = square_points(4, 50_000).into_iter().map(|[x, y]| [x.powf(1.1), y]);
    fails(&samples(1, 50_000), &Samples::new(Square, root).unwrap());
    // The same points twice are no two samples.
    let report = compare_samples(&samples(1, 50_000), &samples(1, 50_000)).run();
    assert_eq!(report.verdict(), Verdict::Inconclusive, "{report}");
    assert!(format!("{report}").contains("not drawn independently"), "{report}");
    for count in [0, 1, 10] {
        let report = compare_samples(&samples(1, count), &samples(2, count)).run();
        assert_eq!(report.verdict(), Verdict::Inconclusive, "{count}: {report}");
    }
    let error = Samples::new(Sphere, [DVec3::X, DVec3::Y, 2.0 * DVec3::Z]).unwrap_err();
    assert!(matches!(error, PointsError::Point { index: 2, .. }), "{error}");
}

#[test]
fn no_density_is_said_to_be_none() {
    let draws = from_draws(Square, |[u, v]: [f64; 2]| [u, v]);
    let report = verify(&draws).run();
    assert_eq!(report.verdict(), Verdict::Inconclusive);
    let text = format!("{report}");
    assert!(text.contains("no density to hold its samples against") && !text.contains("NaN"), "{text}");
}

#[test]
fn residuals_are_standard_normal() {
    let plain = from_draws(Square, |[u, v]: [f64; 2]| [u, v]);
    let examination = compare(&plain, &plain).samples(400_000).examine();
    let n = examination.cells.len() as f64;
    let square: f64 = examination.cells.iter().map(|c| c.residual().powi(2)).sum::<f64>() / n;
    assert!((square - 1.0).abs() < 6.0 * (2.0 / n).sqrt(), "{square} over {n} cells");
    let map = compare(&plain, &planted(0.05)).samples(100_000).examine().map(32);
    assert!(map.residual.iter().all(|r| r.is_finite()));
    let mean = map.observed.iter().sum::<f64>() / (32.0 * 32.0);
    assert!((mean - 1.0).abs() < 0.03, "{mean}");
}

#[test]
fn independent_streams_pass_and_others_fail() {
    let single = |seed, count| -> Vec<[f32; 2]> {
        square_points(seed, count).into_iter().map(|[x, y]| [x as f32, y as f32]).collect()
    };
    let judge = |list: &[Vec<[f32; 2]>]| streams(Square, list).unwrap().run();
    let three = || vec![single(1, 20_000), single(2, 20_000), single(3, 30_000)];
    judge(&three()).assert();
    judge(&(0..12).map(|seed| single(seed, 4000)).collect::<Vec<_>>()).assert();
    let fails = |name: &str, list: &[Vec<[f32; 2]>], part: &str| {
        let report = judge(list);
        assert_eq!(report.verdict(), Verdict::Fail, "{name}: {report}");
        let caught = |c: &verify::Conclusion| c.verdict == Verdict::Fail && c.finding.part.contains(part);
        assert!(report.conclusions[0].iter().any(caught), "{name}, not by {part}: {report}");
    };
    let mut identical = three();
    identical[2] = identical[0].clone();
    fails("identical", &identical, "streams 0 and 2, same place");
    let mut lagged = three();
    lagged[1] = lagged[0][1..].to_vec();
    fails("shifted by one", &lagged, "streams 0 and 1");
    fails("shifted by one", &lagged, "repeated runs");
    let mut far = three();
    far[1] = far[0][777..].iter().copied().chain(single(9, 777)).collect();
    fails("shifted by 777", &far, "repeated runs");
    let mut shuffled = three();
    shuffled[1] = shuffled[0].iter().rev().copied().collect();
    fails("in another order", &shuffled, "equal points");
    let mut again = three();
    again[2] = [&again[2][..5000], &again[2][..5000]].concat();
    fails("started over", &again, "repeated runs");
    let mut sticky = three();
    for i in (1..20_000).step_by(5) {
        sticky[0][i][0] = sticky[0][i - 1][0];
    }
    fails("sticky", &sticky, "stream 0, consecutive");
    let mut mirrored = three();
    mirrored[1] = mirrored[0].iter().map(|[x, y]| [1.0 - x, *y]).collect();
    fails("antithetic", &mirrored, "same place");
}

#[test]
fn streams_of_entries() {
    let table = DiscreteCdf::new(&[5.0, 1.0, 2.0, 0.5, 0.0, 3.0]).unwrap();
    let draw = |seed, count| -> Vec<usize> {
        let mut rng = stream(seed, "entries", 0);
        (0..count).map(|_| table.choose(unit_f64(&mut rng)).index).collect()
    };
    let judge = |list: &[Vec<usize>]| streams(Discrete::new(6), list).unwrap().run().verdict();
    assert_eq!(judge(&[draw(1, 20_000), draw(2, 20_000), draw(3, 20_000)]), Verdict::Pass);
    assert_eq!(judge(&[draw(1, 20_000), draw(1, 20_000)]), Verdict::Fail);
    let far = [draw(1, 20_000), draw(1, 25_000)[5000..].to_vec()];
    assert_eq!(judge(&far), Verdict::Fail);
    assert_eq!(judge(&[draw(1, 1), draw(2, 1)]), Verdict::Inconclusive);
    assert!(matches!(
        streams(Discrete::new(5), &[draw(1, 50)]),
        Err(PointsError::PointOfStream { stream: 0, .. })
    ));
    assert_eq!(streams::<_, Vec<usize>, _>(Discrete::new(5), &[]).err(), Some(PointsError::NoStreams));
}

/// At level alpha over the whole table of streams, as often as alpha says.
#[test]
fn streams_alarm_as_often_as_alpha_says() {
    const RUNS: u64 = 200;
    let alarms = (0..RUNS)
        .filter(|seed| {
            let list: Vec<_> = (0..3).map(|i| square_points(1000 + 3 * seed + i, 1200)).collect();
            streams(Square, &list).unwrap().alpha(0.05).run().verdict() != Verdict::Pass
        })
        .count() as u64;
    println!("{alarms} of {RUNS}");
    // None at all would mean that nothing was asked.
    assert!(alarms > 0);
    assert!(binomial::upper_tail(alarms, RUNS, 0.05).unwrap() > 1e-4, "{alarms} of {RUNS}");
}
