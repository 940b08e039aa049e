//! What is planted is found as often as the battery says that it would be, and what is right is not.

use glam::Vec3;
use warpcheck::domain::Square;
use warpcheck::sampler::{PhongLobe, Sampler, VonMisesFisher, from_fn};
use warpcheck::statistics::binomial;
use warpcheck::verify;
use warpcheck::verify::Verdict;

/// Uniform on the square by its own account, but with density 1 + `error` over a rectangle of area `mass` somewhere, made up for elsewhere.
fn planted(mass: f64, error: f64, place: u64) -> impl Sampler<Domain = Square> {
    let hash = |k: u64| (((place * 7919 + k) as f64 * 12.9898).sin() * 43_758.547).fract().abs();
    // Of any shape that is no sliver.
    let aspect = (0.5 + hash(1)).max(mass);
    let (w, h) = ((mass * aspect).sqrt(), (mass / aspect).sqrt());
    let (x, y) = (hash(2) * (1.0 - w), hash(3) * (1.0 - h));
    let inside = move |u: f64, v: f64| u >= x && u < x + w && v >= y && v < y + h;
    // Of the points that would fall outside this share falls inside.
    let moved = mass * error / (1.0 - mass);
    from_fn(
        Square,
        move |[pick, u, v, a, b]: [f64; 5]| {
            if pick < moved && !inside(u, v) { [x + w * a, y + h * b] } else { [u, v] }
        },
        |_: [f64; 2]| 1.0,
    )
}

/// In how many of `runs` it is found wrong.
fn caught<S: Sampler>(runs: u64, samples: u64, make: impl Fn(u64) -> S) -> u64 {
    (0..runs)
        .filter(|&seed| {
            verify(&make(seed)).samples(samples).seed(seed).undiagnosed().run().verdict() == Verdict::Fail
        })
        .count() as u64
}

#[test]
fn five_percent_over_five_percent() {
    let found = caught(4, 1_000_000, |place| planted(0.05, 0.05, place));
    assert!(found >= 3, "{found} of 4");
}

#[test]
#[ignore = "long: forty runs"]
fn five_percent_over_five_percent_in_forty() {
    let found = caught(40, 1_000_000, |place| planted(0.05, 0.05, place));
    assert!(found >= 39, "{found} of 40");
}

#[test]
#[ignore = "long: many runs"]
fn three_percent_over_twenty_percent() {
    assert_eq!(caught(8, 1_000_000, |place| planted(0.2, 0.03, place)), 8);
}

/// 0.3% of the samples lie where the density claims 4e-6 of the mass.
fn crowded(place: u64) -> impl Sampler<Domain = Square> {
    let side = 0.002_f64; // 4e-6 of the unit square
    let (x, y) = ((place as f64 * 0.618).fract() * 0.9, (place as f64 * 0.414).fract() * 0.9);
    from_fn(
        Square,
        move |[pick, u, v]: [f64; 3]| if pick < 0.003 { [x + side * u, y + side * v] } else { [u, v] },
        |_: [f64; 2]| 1.0,
    )
}

#[test]
#[ignore = "long: a dozen runs or more"]
fn a_crowd_in_a_rare_place() {
    assert_eq!(caught(8, 1_000_000, crowded), 8);
    assert_eq!(caught(40, 50_000, crowded), 40);
}

#[test]
#[ignore = "long: forty runs of each"]
fn forty_of_forty() {
    assert_eq!(caught(40, 1_000_000, |place| planted(0.2, 0.03, place)), 40);
    assert_eq!(caught(40, 1_000_000, crowded), 40);
}

/// "Would have caught, with probability 0.99": planted exactly so.
#[test]
#[ignore = "long: a dozen runs or more"]
fn power_is_as_stated() {
    stated(12);
}

#[test]
#[ignore = "long: a hundred runs of each"]
fn power_is_as_stated_in_a_hundred() {
    stated(100);
}

fn stated(runs: u64) {
    let right = from_fn(Square, |p: [f64; 2]| p, |_: [f64; 2]| 1.0);
    let report = verify(&right).samples(200_000).run();
    let stated = report.examinations[0].power(report.level());
    assert_eq!(stated.iter().map(|p| p.mass).collect::<Vec<_>>(), [0.01, 0.05, 0.2, 0.5]);
    for power in stated {
        let found = caught(runs, 200_000, |place| planted(power.mass, power.error, place));
        // So few, at a rate of 0.99, once in 1e4.
        let surprise = binomial::lower_tail(found, runs, 0.99).unwrap();
        assert!(surprise > 1e-4, "{:.3} over {}: {found} of {runs}", power.error, power.mass);
        // And it is no empty boast: a third of that is mostly missed.
        if power.mass < 0.1 {
            let found = caught(runs / 2, 200_000, |place| planted(power.mass, power.error / 3.0, place));
            assert!(found <= runs / 4, "a third of {:.3} over {}: {found}", power.error, power.mass);
        }
    }
}

/// Peaky lobes, rejected by others every time, fail no more often than alpha says.
#[test]
#[ignore = "long: many runs"]
fn peaky_lobes_are_accepted() {
    accepted(4);
}

#[test]
#[ignore = "long: a hundred runs of each"]
fn peaky_lobes_are_accepted_at_the_nominal_rate() {
    accepted(100);
}

fn accepted(runs: u64) {
    const ALPHA: f64 = 0.05;
    let mean = Vec3::new(0.36, -0.48, 0.8);
    let alarms =
        |sampler: &dyn Fn(u64) -> Verdict| (0..runs).filter(|&s| sampler(s) == Verdict::Fail).count() as u64;
    let mut total = 0;
    for kappa in [1e2, 1e4, 1e6] {
        let lobe = VonMisesFisher::new(mean, kappa).unwrap();
        total += alarms(&|seed| verify(&lobe).samples(200_000).seed(seed).alpha(ALPHA).run().verdict());
    }
    let lobe = PhongLobe::new(mean, 1e6).unwrap();
    total += alarms(&|seed| verify(&lobe).samples(200_000).seed(seed).alpha(ALPHA).run().verdict());
    let surprise = binomial::upper_tail(total, 4 * runs, ALPHA).unwrap();
    assert!(surprise > 1e-4, "{total} of {} runs failed", 4 * runs);
    // A million samples at the default level.
    for kappa in [1e2, 1e4, 1e6] {
        verify(&VonMisesFisher::new(mean, kappa).unwrap()).run().assert();
    }
}
