//! Right samplers that are hard to judge never fail; broken ones that are hard to see do.

use glam::{DVec2, DVec3, Vec3};
use warpcheck::domain::{Discrete, Interval, Sphere, Square};
use warpcheck::sampler::*;
use warpcheck::verify;
use warpcheck::verify::{Report, Verdict};

fn run<S: Sampler>(sampler: &S, samples: u64) -> Report {
    verify(sampler).samples(samples).seed(12).undiagnosed().run()
}

#[track_caller]
fn does_not_fail<S: Sampler>(name: &str, sampler: &S) {
    let report = run(sampler, 200_000);
    assert_ne!(report.verdict(), Verdict::Fail, "{name}:\n{report}");
}

#[track_caller]
fn fails<S: Sampler>(name: &str, sampler: &S, samples: u64) {
    let report = run(sampler, samples);
    assert_eq!(report.verdict(), Verdict::Fail, "{name}:\n{report}");
}

/// A map whose density jumps at every texel, which nobody said: quadrature can't know it well enough, and says so.
#[test]
#[ignore = "long: quadrature over unnamed edges"]
fn maps_without_knots() {
    for sun in [0.0_f32, 3e4] {
        let (width, height) = (512, 256);
        let noise = |i: usize| ((i as f32 * 12.9898).sin() * 43_758.547).fract().abs();
        let mut texels: Vec<[f32; 3]> = (0..width * height).map(|i| [0.05 + noise(i); 3]).collect();
        texels[100 * width + 77] = [sun + 1.0; 3];
        let map = Environment::new(width, height, texels, RowWarp::UniformV).unwrap();
        let bare =
            from_fn(Sphere, |xi: [f64; 2]| Environment::sample(&map, xi).direction, |w: Vec3| map.density(w));
        does_not_fail("a map without knots", &bare);
        does_not_fail("the same with knots", &map);
    }
}

/// A comb whose teeth may keep step with the nodes of a quadrature rule.
#[test]
#[ignore = "long: quadrature does what it can"]
fn combs() {
    for teeth in [2001.0, 65_536.0] {
        let comb = from_fn(
            Square,
            move |[u, v]: [f64; 2]| {
                let tooth = (u * teeth).floor();
                DVec2::new((tooth + 0.5 * (u * teeth - tooth)) / teeth, v)
            },
            move |p: DVec2| if (p.x * teeth).fract() < 0.5 { 2.0 } else { 0.0 },
        );
        does_not_fail("a comb", &comb);
    }
}

/// Small random patches are kept, the rest is rejected.
#[test]
#[ignore = "long: quadrature over ninety thousand patches"]
fn a_support_with_many_edges() {
    let kept = |p: DVec2| {
        let cell = (p.x * 300.0).floor() * 311.0 + (p.y * 300.0).floor();
        ((cell * 12.9898).sin() * 43_758.547).fract().abs() < 0.05
    };
    let patches = from_fn(
        Square,
        move |p: DVec2| kept(p).then_some(p),
        move |p: DVec2| if kept(p) { 1.0 } else { 0.0 },
    );
    does_not_fail("patches", &patches);
}

#[test]
fn singular_densities_and_heavy_tails() {
    let power = |e: f64| {
        from_fn(
            Interval::new(0.0, 1.0),
            move |u: f64| (1.0 - u).powf(1.0 / e),
            move |x: f64| e * x.powf(e - 1.0),
        )
    };
    for e in [0.5, 0.2, 0.05] {
        does_not_fail(&format!("{e} x^({e} - 1)"), &power(e));
    }
    for a in [1.0, 0.5, 0.2] {
        let pareto = from_fn(
            Interval::new(1.0, f64::INFINITY),
            move |u: f64| (1.0 - u).powf(-1.0 / a),
            move |x: f64| a * x.powf(-a - 1.0),
        );
        does_not_fail(&format!("Pareto {a}"), &pareto);
    }
}

/// Every second entry can't be reached, its neighbour comes twice as often: a table with too few bits.
#[test]
fn entries_that_lie_between_each_other() {
    for entries in [1000_usize, 100_000, 1_000_000] {
        let halved = from_fn(
            Discrete::new(entries),
            move |u: f64| ((u * entries as f64) as usize) & !1,
            move |_: usize| 1.0 / entries as f64,
        );
        fails(&format!("{entries} entries"), &halved, 1_000_000);
        let right = from_fn(
            Discrete::new(entries),
            move |u: f64| (u * entries as f64) as usize,
            move |_: usize| 1.0 / entries as f64,
        );
        does_not_fail(&format!("{entries} entries"), &right);
    }
}

/// One in two thousand samples comes with a density three times too large, or with one that asking denies.
#[test]
fn densities_that_rarely_disagree() {
    let strip = |w: DVec3| (w.y.atan2(w.x) * 1000.0).fract().abs() < 5e-4;
    let uniform = 0.25 / std::f64::consts::PI;
    let direction = |xi: [f64; 2]| Sampler::sample(&UniformSphere, &xi).expect("never rejects").point;
    let tripled = from_fn(
        Sphere,
        move |xi: [f64; 2]| {
            let w = direction(xi);
            (w, if strip(w) { 3.0 * uniform } else { uniform })
        },
        move |_: DVec3| uniform,
    );
    fails("3 times too large", &tripled, 500_000);
    let denied = from_fn(
        Sphere,
        move |xi: [f64; 2]| (direction(xi), uniform),
        move |w: DVec3| if w.x.to_bits().is_multiple_of(2000) { 0.0 } else { uniform },
    );
    fails("denied", &denied, 500_000);
    let nan = from_fn(
        Sphere,
        move |xi: [f64; 2]| (direction(xi), uniform),
        move |w: DVec3| if w.x.to_bits().is_multiple_of(2000) { f64::NAN } else { uniform },
    );
    fails("NaN", &nan, 500_000);
}

#[test]
fn points_just_outside() {
    let beyond = from_fn(Interval::new(1e6, 1e6 + 1.0), |u: f64| 1e6 + 1.01 + 0.4 * u, |_: f64| 1.0);
    fails("beyond the end", &beyond, 100_000);
}

/// NaN, infinite or negative where no sample goes.
#[test]
fn impossible_densities_off_the_samples() {
    for bad in [f64::NAN, f64::INFINITY, -0.1] {
        let sampler = from_fn(
            Square,
            |[u, v]: [f64; 2]| DVec2::new(0.5 * u, v),
            move |p: DVec2| if p.x <= 0.5 { 2.0 } else { bad },
        );
        fails(&format!("{bad}"), &sampler, 100_000);
    }
}

#[test]
fn constant_factors_are_seen() {
    for factor in [0.9, 0.999, 1.001, 1.1] {
        let scaled = from_fn(Square, |p: DVec2| p, move |_: DVec2| factor);
        fails(&format!("times {factor}"), &scaled, 1_000_000);
    }
}

#[test]
#[should_panic(expected = "alpha is NaN")]
fn an_alpha_that_is_none_is_refused() {
    let _ = verify(&CosineHemisphere).alpha(f64::NAN);
}

/// An infinite density over a spot: judged, and soon. Cells of infinite mass were once cut down to thousands of them.
#[test]
fn an_infinite_density_fails_and_does_not_hang() {
    let inside = |p: DVec2| p.x < 0.01 && p.y < 0.01;
    let spot = from_fn(
        Square,
        |[u, v]: [f64; 2]| [0.01 * u, 0.01 * v],
        move |p: DVec2| if inside(p) { f64::INFINITY } else { 0.0 },
    );
    let report = verify(&spot).samples(100_000).undiagnosed().run();
    assert_eq!(report.verdict(), Verdict::Fail, "{report}");
}

/// A triangle a ten-thousandth of a radian high across half of the sphere: quadrature can't follow its edges, and has to say so.
#[test]
#[ignore = "long: quadrature over a sliver"]
fn a_sliver_is_not_rejected() {
    let vertices = [Vec3::new(1.0, 0.0, 1.0), Vec3::new(1.0, 0.25, 1.0), Vec3::new(1.0, 0.5, 1.0002)];
    let sliver = SphericalTriangle::new(Vec3::ZERO, vertices).unwrap();
    for seed in 1..4 {
        let report = verify(&sliver).samples(1_000_000).seed(seed).undiagnosed().run();
        assert_ne!(report.verdict(), Verdict::Fail, "{report}");
    }
}
