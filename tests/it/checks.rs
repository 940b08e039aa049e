//! Each check fails on what it is there for, and passes, or does not answer, where all is right.

use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};
use std::sync::atomic::{AtomicU64, Ordering};
use warpcheck::domain::{Discrete, Hemisphere, Interval, Sphere, Square};
use warpcheck::random::SplitMix64;
use warpcheck::sampler::*;
use warpcheck::verify;
use warpcheck::verify::{Conclusion, Evidence, Report, Verdict};

const SAMPLES: u64 = 200_000;

fn of<'a>(report: &'a Report, check: &str) -> Vec<&'a Conclusion> {
    report.conclusions[0].iter().filter(|c| c.finding.check == check).collect()
}

#[track_caller]
fn fails(report: &Report, check: &str) {
    assert!(of(report, check).iter().any(|c| c.verdict == Verdict::Fail), "{check} did not fail:\n{report}");
}

#[track_caller]
fn passes(report: &Report, check: &str) {
    let found = of(report, check);
    assert!(!found.is_empty(), "{check} said nothing");
    assert!(found.iter().all(|c| c.verdict == Verdict::Pass), "{check} did not pass: {found:#?}");
}

fn run<S: Sampler>(sampler: &S) -> Report {
    verify(sampler).samples(SAMPLES).seed(3).undiagnosed().run()
}

/// A tenth of a percent, found without a count.
#[test]
fn jacobian_sees_a_thousandth() {
    let scaled = |factor: f32| {
        from_fn(
            Hemisphere,
            |xi: Vec2| CosineHemisphere.sample(xi),
            move |w: Vec3| CosineHemisphere.density(w) * factor,
        )
    };
    passes(&run(&scaled(1.0)), "jacobian");
    fails(&run(&scaled(0.999)), "jacobian");
    fails(&run(&scaled(1.001)), "jacobian");
}

/// Several variates lead to one point: listed, found, or not to be found.
#[test]
fn jacobian_sums_preimages() {
    // Two variates a point, which nobody lists.
    let folded = from_fn(Interval::new(0.0, 1.0), |u: f64| (2.0 * u - 1.0).abs(), |_: f64| 1.0);
    passes(&run(&folded), "jacobian");
    let halved = from_fn(Interval::new(0.0, 1.0), |u: f64| (2.0 * u - 1.0).abs(), |_: f64| 0.5);
    fails(&run(&halved), "jacobian");
    let twice =
        from_fn(Square, |p: DVec2| DVec2::new((2.0 * p.x).fract(), (p.y - 0.5).abs() * 2.0), |_: DVec2| 1.0);
    passes(&run(&twice), "jacobian");
    // A mixture lists those of its parts.
    let mixture = Mixture::new(0.3, CosineHemisphere, UniformHemisphere).unwrap();
    passes(&run(&mixture), "jacobian");
    // Bits that are mixed up have no derivative.
    let hashed = from_fn(
        Interval::new(0.0, 1.0),
        |u: f64| warpcheck::random::unit_f64(&mut SplitMix64::from_variate(u)),
        |_: f64| 1.0,
    );
    let report = run(&hashed);
    assert!(of(&report, "jacobian").iter().all(|c| c.finding.evidence == Evidence::Unanswered), "{report}");
    assert_eq!(report.verdict(), Verdict::Pass, "{report}");
}

/// The Jacobian has the cosine but not the sine.
#[test]
fn jacobian_sees_a_missing_sine() {
    let uniform_in_angle = from_fn(
        Sphere,
        |[u, v]: [f64; 2]| {
            let ((st, ct), (sp, cp)) = ((PI * u).sin_cos(), (TAU * v).sin_cos());
            DVec3::new(st * cp, st * sp, ct)
        },
        |_: DVec3| 0.25 / PI,
    );
    fails(&run(&uniform_in_angle), "jacobian");
}

struct WithInverse(fn(f64) -> f64);

impl Sampler for WithInverse {
    type Domain = Interval;
    fn domain(&self) -> Interval {
        Interval::new(0.0, 1.0)
    }
    fn dimensions(&self) -> usize {
        1
    }
    fn sample(&self, xi: &[f64]) -> Option<Sample<f64>> {
        let point = xi[0].sqrt();
        Some(Sample { point, density: 2.0 * point })
    }
    fn density(&self, x: &f64) -> f64 {
        2.0 * x
    }
    fn invert(&self, x: &f64) -> Option<Vec<f64>> {
        Some(vec![(self.0)(*x)])
    }
}

#[test]
fn round_trip() {
    passes(&run(&WithInverse(|x| x * x)), "round trip");
    fails(&run(&WithInverse(|x| x)), "round trip");
    fails(&run(&WithInverse(|x| 1.0 + x * x)), "round trip");
    fails(&run(&WithInverse(|_| f64::NAN)), "round trip");
}

/// NaN at one knot of a table and nowhere else.
#[test]
fn knots_of_tables_are_tried() {
    struct Knot(bool);
    impl Sampler for Knot {
        type Domain = Square;
        fn domain(&self) -> Square {
            Square
        }
        fn dimensions(&self) -> usize {
            2
        }
        fn sample(&self, xi: &[f64]) -> Option<Sample<DVec2>> {
            let x = if self.0 && xi[0] == 0.3 { f64::NAN } else { xi[0] };
            Some(Sample { point: DVec2::new(x, xi[1]), density: 1.0 })
        }
        fn density(&self, _: &DVec2) -> f64 {
            1.0
        }
        fn variate_knots(&self, dimension: usize) -> Vec<f64> {
            if dimension == 0 { vec![0.3] } else { Vec::new() }
        }
    }
    passes(&run(&Knot(false)), "domain");
    fails(&run(&Knot(true)), "domain");
}

/// Black texels beside bright ones: bilinear look-up has light where a piecewise constant density has none.
#[test]
fn support_of_a_bilinear_map() {
    let (width, height) = (16, 8);
    let texels: Vec<[f32; 3]> =
        (0..width * height).map(|i| [if i % width < 8 { 1.0 } else { 0.0 }; 3]).collect();
    let map = Environment::new(width, height, texels.clone(), RowWarp::UniformCosTheta).unwrap();
    let column = move |w: &DVec3| {
        let u = w.y.atan2(w.x) / TAU;
        (if u < 0.0 { u + 1.0 } else { u }) * width as f64
    };
    let lit =
        move |column: f64| if (column.rem_euclid(width as f64) as usize) % width < 8 { 1.0 } else { 0.0 };
    let nearest = move |w: &DVec3| lit(column(w));
    let bilinear = move |w: &DVec3| {
        let x = column(w) - 0.5;
        let t = x - x.floor();
        (1.0 - t) * lit(x.floor()) + t * lit(x.floor() + 1.0)
    };
    passes(&verify(&map).samples(SAMPLES).target(nearest).run(), "support");
    fails(&verify(&map).samples(SAMPLES).target(bilinear).run(), "support");
}

/// A drift so slow that no cell shows it.
#[test]
fn distribution_sees_a_drift() {
    let drifting = |power: f64| from_fn(Interval::new(0.0, 1.0), move |u: f64| u.powf(power), |_: f64| 1.0);
    let run = |power| verify(&drifting(power)).samples(1_000_000).without("jacobian").run();
    passes(&run(1.0), "distribution");
    fails(&run(1.015), "distribution");
}

/// The mean of 1 / density: asked where it can be, and of wide lobes nowhere near their backs.
#[test]
fn weights() {
    let lobe = VonMisesFisher::new(Vec3::X, 10.0).unwrap();
    for seed in 0..6 {
        let report = verify(&lobe).samples(SAMPLES).seed(seed).run();
        assert!(of(&report, "weights").iter().all(|c| c.verdict != Verdict::Fail), "{report}");
    }
    passes(&run(&UniformSphere), "weights");
    // 5% too much density over a quarter of the square, too little elsewhere.
    let claimed = |p: DVec2| if p.x < 0.5 && p.y < 0.5 { 1.05 } else { 1.0 - 0.05 / 3.0 };
    fails(&verify(&from_fn(Square, |p: DVec2| p, claimed)).samples(1_000_000).run(), "weights");
}

#[test]
fn known_integrals() {
    let irradiance = |value: f64| {
        let report = verify(&UniformHemisphere).samples(SAMPLES).integral("irradiance", |w| w.z, value).run();
        of(&report, "weights")
            .iter()
            .filter(|c| c.finding.part.contains("irradiance"))
            .map(|c| c.verdict)
            .max()
    };
    assert_eq!(irradiance(PI), Some(Verdict::Pass));
    assert_eq!(irradiance(PI * 1.02), Some(Verdict::Fail));
    // A weight with an infinite variance is not believed, whatever its mean happens to be.
    let report = verify(&from_fn(Interval::new(0.0, 1.0), |u: f64| u, |_: f64| 1.0))
        .samples(SAMPLES)
        .integral("heavy", |x: &f64| x.powf(-0.75), 4.0)
        .run();
    assert_eq!(report.verdict(), Verdict::Pass, "{report}");
    let heavy = of(&report, "weights").into_iter().find(|c| c.finding.part.contains("heavy")).unwrap();
    assert_eq!(heavy.finding.evidence, Evidence::Unanswered);
}

/// The next sample leans on the last one.
#[test]
fn samples_that_remember() {
    let last = AtomicU64::new(0);
    let leaning = from_fn(
        Interval::new(0.0, 1.0),
        |[u, pick]: [f64; 2]| {
            let before = f64::from_bits(last.load(Ordering::Relaxed));
            let now = if pick < 0.05 { before } else { u };
            last.store(now.to_bits(), Ordering::Relaxed);
            now
        },
        |_: f64| 1.0,
    );
    fails(&run(&leaning), "independence");
    passes(&run(&from_fn(Interval::new(0.0, 1.0), |[u, _]: [f64; 2]| u, |_: f64| 1.0)), "independence");
}

/// What is left over of a variate: re-scaled, as it was, or out of its range.
#[test]
fn left_over_variates() {
    struct Choose(fn(f64, f64, f64) -> f64);
    const WEIGHTS: [f64; 4] = [0.1, 0.2, 0.3, 0.4];
    impl Choose {
        fn find(xi: f64) -> (usize, f64) {
            let mut start = 0.0;
            for (i, w) in WEIGHTS.iter().enumerate() {
                if xi < start + w || i == 3 {
                    return (i, start);
                }
                start += w;
            }
            unreachable!("the last entry takes the rest")
        }
    }
    impl Sampler for Choose {
        type Domain = Discrete;
        fn domain(&self) -> Discrete {
            Discrete::new(4)
        }
        fn dimensions(&self) -> usize {
            1
        }
        fn sample(&self, xi: &[f64]) -> Option<Sample<usize>> {
            let point = Self::find(xi[0]).0;
            Some(Sample { point, density: WEIGHTS[point] })
        }
        fn density(&self, i: &usize) -> f64 {
            WEIGHTS[*i]
        }
        fn left_over(&self, xi: &[f64]) -> Option<f64> {
            let (i, start) = Self::find(xi[0]);
            Some((self.0)(xi[0], start, WEIGHTS[i]))
        }
    }
    let right = |xi: f64, start: f64, w: f64| ((xi - start) / w).clamp(0.0, 1.0_f64.next_down());
    passes(&run(&Choose(right)), "independence");
    fails(&run(&Choose(|xi, _, _| xi)), "independence");
    fails(&run(&Choose(|xi, start, w| (xi - start) / w * 1.001)), "support");
    fails(&run(&Choose(|xi, start, w| ((xi - start) / w).powi(2).clamp(0.0, 0.99))), "independence");
    passes(&run(&DiscreteCdf::new(&WEIGHTS).unwrap()), "independence");
}

/// 8 and 16 bits of a variate.
#[test]
fn few_distinct_values() {
    let coarse = |bits: i32| {
        from_fn(
            Square,
            move |[u, v]: [f64; 2]| {
                let steps = 2.0_f64.powi(bits);
                DVec2::new((u * steps).floor() / steps, (v * 256.0).floor() / 256.0)
            },
            |_: DVec2| 1.0,
        )
    };
    fails(&run(&coarse(8)), "repeats");
    fails(&run(&coarse(4)), "repeats");
    let one = |bits: i32| {
        from_fn(
            Interval::new(0.0, 1.0),
            move |u: f64| ((u * 2.0_f64.powi(bits)).floor() + 0.5) * 2.0_f64.powi(-bits),
            |_: f64| 1.0,
        )
    };
    fails(&run(&one(16)), "repeats");
    passes(&run(&one(24)), "repeats");
    passes(&run(&from_fn(Interval::new(0.0, 1.0), |u: f32| u, |_: f32| 1.0)), "repeats");
    passes(&run(&VonMisesFisher::new(Vec3::X, 1e6).unwrap()), "repeats");
}

/// Stops at once where much is wrong, later where little is, and never where nothing is.
#[test]
fn anytime() {
    let planted = |error: f64| {
        from_fn(
            Square,
            move |[pick, u, v]: [f64; 3]| {
                if pick < error { DVec2::new(0.25 * u, v) } else { DVec2::new(u, v) }
            },
            |_: DVec2| 1.0,
        )
    };
    let run = |error: f64| verify(&planted(error)).anytime().samples(1_000_000).seed(5).run();
    let (much, little, nothing) = (run(0.1), run(0.01), run(0.0));
    fails(&much, "sequential");
    fails(&little, "sequential");
    passes(&nothing, "sequential");
    let samples = |r: &Report| r.examinations[0].samples;
    assert!(
        samples(&much) < 50_000 && samples(&much) < samples(&little),
        "{} {}",
        samples(&much),
        samples(&little)
    );
    assert!(samples(&little) < 1_000_000, "{}", samples(&little));
    assert_eq!(samples(&nothing), 1_000_000);
    // Tests that want a fixed number of samples are not made.
    assert!(of(&much, "chi-square").is_empty());
    // What is certain stops it as well.
    let outside = from_fn(Square, |p: DVec2| 1.1 * p, |_: DVec2| 1.0);
    let report = verify(&outside).anytime().samples(3_000_000).run();
    fails(&report, "support");
    assert!(samples(&report) < 50_000);
}

/// Who stops before all is drawn knows: the integrals are doubted before, and not when nothing more can be drawn.
#[test]
fn anytime_stops_when_it_knows() {
    let planted = |error: f64| {
        from_fn(
            Square,
            move |[pick, u, v]: [f64; 3]| {
                let [u, v] = [u, v].map(f64::cbrt);
                if pick < error { DVec2::new(0.9 * u, v) } else { DVec2::new(u, v) }
            },
            |p: DVec2| 9.0 * (p.x * p.y).powi(2),
        )
    };
    let most = 4_000_000;
    let mut early = 0;
    for seed in 1..=4 {
        for error in [0.01, 0.015, 0.02] {
            let report = verify(&planted(error)).anytime().samples(most).seed(seed).run();
            if report.examinations[0].samples < most {
                early += 1;
                assert_eq!(report.verdict(), Verdict::Fail, "{error}, seed {seed}: {report}");
            }
        }
    }
    assert!(early >= 6, "{early}");
}

#[test]
fn a_budget_in_seconds_is_kept() {
    let report = verify(&UniformSphere).samples(1_000_000_000_000).seconds(0.2).run();
    let samples = report.examinations[0].samples;
    assert!(samples > 0 && samples < 1_000_000_000, "{samples}");
    assert_eq!(report.verdict(), Verdict::Pass, "{report}");
}

#[test]
fn checks_can_be_left_out() {
    let report = verify(&UniformSphere).samples(50_000).without("weights").without("jacobian").run();
    assert!(of(&report, "weights").is_empty() && of(&report, "jacobian").is_empty());
}

#[test]
#[should_panic(expected = "there is no check `jacobean`")]
fn a_check_that_is_none_is_named() {
    let _ = verify(&UniformSphere).without("jacobean");
}

/// A failure tells the whole story, and where its picture is.
#[test]
#[cfg(feature = "pictures")]
fn a_failure_can_be_acted_on() {
    let broken =
        from_fn(Hemisphere, |xi: Vec2| UniformHemisphere.sample(xi), |w: Vec3| CosineHemisphere.density(w));
    let report = verify(&broken).name("uniform, by mistake").samples(50_000).run();
    let told = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| report.assert())).unwrap_err();
    let told = told.downcast_ref::<String>().unwrap();
    for part in ["fail: uniform, by mistake", "worst places", "replay: ", "sigma", "at theta"] {
        assert!(told.contains(part), "no `{part}` in\n{told}");
    }
    let file = told.lines().find_map(|line| line.trim().strip_prefix("picture: ")).expect("a picture");
    assert!(std::path::Path::new(file).metadata().unwrap().len() > 1000, "{file}");
}

/// An entry of weight 0 is returned at one variate only.
#[test]
fn an_entry_without_mass_is_never_returned() {
    let weights = [0.0, 0.25, 0.75];
    let table = |xi: f64| {
        if xi == 0.0 {
            0
        } else if xi < 0.25 {
            1
        } else {
            2_usize
        }
    };
    fails(&run(&from_fn(Discrete::new(3), table, move |i: usize| weights[i])), "domain");
}
