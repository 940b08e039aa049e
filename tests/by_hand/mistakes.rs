//! Mistakes that show without counts, and what the diagnosis says of them.

use super::*;
use glam::{DVec2, DVec3};
use std::f64::consts::FRAC_1_PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use warpcheck::domain::{Cell, Discrete, Hemisphere, Interval, MeshSurface, Square, SurfacePoint, Triangle};
use warpcheck::random::{ONE_MINUS_EPSILON_F64, fill_unit};
use warpcheck::verify::{Diagnosis, Settings, Verify};

const SAMPLES: usize = 2000;
/// So few that no counts are compared.
const FEW: usize = 900;

fn line() -> Interval {
    Interval::new(0.0, 1.0)
}

fn plain(xi: &[f64]) -> Option<Sample<f64>> {
    Some(Sample { point: xi[0], density: 1.0 })
}

/// By the checks that need no masses of cells, which take longer than all else.
fn certain<D: Domain>(verify: Verify<'_, D>) -> Examination {
    let slow = ["jacobian", "chi-square", "scan", "distribution", "normalisation"];
    slow.iter().fold(verify, |verify, name| verify.without(name)).examine()
}

fn diagnosis<D: Domain>(told: &Told<'_, D>, samples: usize) -> Option<Diagnosis> {
    certain(warpcheck::verify(told).samples(samples as u64)).diagnosis
}

/// The variates of the samples that are judged, ascending.
fn drawn() -> Vec<f64> {
    let mut xi = vec![0.0; SAMPLES];
    fill_unit(&mut stream(1, "verify", 0), &mut xi);
    xi.sort_by(f64::total_cmp);
    xi
}

/// So many points outside, of a domain on which one of each is known, in the place of none or of those that are rejected.
fn outside<D: Domain>(
    domain: D,
    inside: D::Point,
    outside: D::Point,
    density: f64,
    count: usize,
    rejected: usize,
) -> Option<Diagnosis> {
    let xi = drawn();
    let sample = |x: &[f64]| {
        let point = if x[0] < xi[count] { outside.clone() } else { inside.clone() };
        (x[0] <= xi[SAMPLES - 1 - rejected]).then_some(Sample { point, density })
    };
    diagnosis(&Told::new(domain, sample, move |_| density), SAMPLES)
}

#[test]
fn shares_of_points_outside() {
    let (within, without) = (DVec3::new(0.25, 0.25, 0.5), DVec3::new(1.5, -0.5, 0.0));
    let triangle = |count: usize| outside(Triangle::with_area(1.0), within, without, 1.0, count, 0);
    let named = |count: usize, name: &str| triangle(count).is_some_and(|d| d.is(name));
    // Within five standard errors of the share: 6.4 samples of 2000/48, 19.4 of a quarter, 22.4 of a half.
    for (share, deviation, name) in [
        (2000.0 / 48.0, (2000.0_f64 / 48.0 * 47.0 / 48.0).sqrt(), "branch squared"),
        (500.0, 375.0_f64.sqrt(), "one coordinate folded"),
        (1000.0, 500.0_f64.sqrt(), "fold missing"),
    ] {
        for (off, is) in [(-4.9, true), (4.9, true), (-5.1, false), (5.1, false)] {
            let count = (share + off * deviation).round() as usize;
            let off = (count as f64 - share).abs() / deviation;
            assert_eq!(named(count, name), off < 5.0, "{count}: {name}, {is}");
        }
    }
    let text = |count: usize| triangle(count).unwrap().text;
    assert!(text(42).starts_with("1/48 of the points leave the triangle, as with the branch xi0 < xi1^2"));
    assert!(
        text(500).starts_with("a quarter of the points leave the triangle")
            && text(1000).starts_with("half of the points leave the triangle")
    );
    // What the density leaves to rejection, where nothing is rejected.
    let square = |count: usize, rejected: usize| {
        outside(Square, DVec2::splat(0.5), DVec2::splat(1.5), 0.9, count, rejected)
    };
    let returned = square(203, 0).unwrap();
    assert!(returned.is("rejected samples returned"));
    assert_eq!(
        returned.text,
        "10.150% of the points lie outside, the share that the density leaves to rejection: they are returned, not rejected"
    );
    assert!(
        !square(203, 1).is_some_and(|d| d.is("rejected samples returned"))
            && !square(300, 0).is_some_and(|d| d.is("rejected samples returned"))
    );
    let under = outside(Hemisphere, DVec3::Z, DVec3::NEG_Z, 0.5 * FRAC_1_PI, 1010, 0).unwrap();
    assert_eq!(
        (under.name.as_str(), under.text.as_str()),
        (
            "sphere for hemisphere",
            "half of the directions are under the horizon: the sphere is sampled for the hemisphere"
        )
    );
    assert!(
        !outside(Hemisphere, DVec3::Z, DVec3::NEG_Z, 0.5 * FRAC_1_PI, 700, 0)
            .is_some_and(|d| d.is("sphere for hemisphere"))
    );
    assert!(
        !outside(Square, DVec2::splat(0.5), DVec2::splat(1.5), 1.0, 1000, 0)
            .is_some_and(|d| d.is("fold missing") || d.is("sphere for hemisphere"))
    );
}

#[test]
fn nothing_or_no_number() {
    let none = diagnosis(&Told::new(line(), |_: &[f64]| None, |_| 1.0), SAMPLES).unwrap();
    assert_eq!(
        (none.name.as_str(), none.text.as_str()),
        (
            "nothing is sampled",
            "every sample is rejected: the lamp's other side, the other hemisphere, an empty table"
        )
    );
    assert!(none.explains && none.gain == 0.0 && none.margin.is_none() && none.others.is_empty());
    let xi = drawn();
    let over = |density: f64, returned: f64| {
        let part = |x: f64| x > 0.9;
        let sample =
            |x: &[f64]| Some(Sample { point: x[0], density: if part(x[0]) { returned } else { 1.0 } });
        diagnosis(&Told::new(line(), sample, |&x| if part(x) { density } else { 1.0 }), SAMPLES).unwrap()
    };
    let count = xi.iter().filter(|&&x| x > 0.9).count();
    let nan = over(f64::NAN, f64::NAN);
    assert!(
        nan.is("density not finite") && nan.text.starts_with("the density is NaN at 0.9"),
        "{}",
        nan.text
    );
    assert!(
        nan.text.contains(&format!(", and at {count} of {SAMPLES} samples (the density at 0.9")),
        "{}",
        nan.text
    );
    assert!(
        over(f64::INFINITY, f64::INFINITY).is("density not finite")
            && over(-1.0, -1.0).is("density negative")
    );
    let asked = over(f64::NAN, 1.0);
    assert!(
        asked.text.contains(&format!(", and at {count} of {SAMPLES} samples (asked for the density at 0.9")),
        "{}",
        asked.text
    );
}

#[test]
fn what_is_left_over() {
    let told = |rest: fn(f64) -> f64| {
        let sample = |x: &[f64]| Some(Sample { point: usize::from(x[0] >= 0.5), density: 0.5 });
        Told {
            left_over: Some(Box::new(move |x: &[f64]| rest(x[0]))),
            ..Told::new(Discrete::new(2), sample, |_| 0.5)
        }
    };
    assert_eq!(diagnosis(&told(|x| (2.0 * x).fract()), FEW), None);
    let half = diagnosis(&told(|x| x % 0.5), FEW).unwrap();
    assert!(half.is("left-over variate not re-scaled"), "{half:?}");
    assert!(
        half.text.starts_with("the variate left over is never above 0.5000: it is not re-scaled")
            || half.text.contains("above 0.4999"),
        "{}",
        half.text
    );
    let most = |largest: f64| {
        let told = if largest < 0.9 {
            told(|x| 0.899 * (2.0 * x).fract())
        } else {
            told(|x| 0.902 * (2.0 * x).fract())
        };
        diagnosis(&told, FEW)
    };
    assert!(
        most(0.899).unwrap().is("left-over variate not re-scaled")
            && !most(0.902).is_some_and(|d| d.is("left-over variate not re-scaled"))
    );
    let beyond =
        diagnosis(&told(|x| if (0.2..0.3).contains(&x) { 1.0 } else { (2.0 * x).fract() }), FEW).unwrap();
    assert_eq!(
        (beyond.name.as_str(), beyond.text.as_str()),
        ("left-over variate outside", "the variate left over leaves [0, 1): the variate left over is 1")
    );
}

#[test]
fn targets_without_density() {
    // Nothing is drawn in the upper tenth, though the target is positive there, but for the last hundredth.
    let sampler = Told::new(
        line(),
        |x: &[f64]| Some(Sample { point: 0.9 * x[0], density: 1.0 / 0.9 }),
        |&x| if x <= 0.9 { 1.0 / 0.9 } else { 0.0 },
    );
    let judged = |target: fn(f64) -> f64| {
        certain(warpcheck::verify(&sampler).target(move |x| target(*x)).samples(FEW as u64))
    };
    let right = judged(|x| if x < 0.89 { 1.0 } else { 0.0 });
    let said = found(&right, "support", "target");
    is_certain(said, warpcheck::verify::Verdict::Pass);
    assert!(
        said.detail.starts_with("there is density wherever the target is positive, at ")
            && said.detail.ends_with(" places"),
        "{}",
        said.detail
    );
    // Three places in each leaf.
    let places: usize = said.detail.split(' ').rev().nth(1).unwrap().parse().unwrap();
    assert!(places.is_multiple_of(3) && places > 3000, "{places}");
    let wrong = judged(|x| 2.0 * x);
    let said = found(&wrong, "support", "target");
    is_certain(said, warpcheck::verify::Verdict::Fail);
    assert!(
        said.detail.starts_with("the target at 0.9")
            && said.detail.ends_with(", the density 0: what is there can't be sampled"),
        "{}",
        said.detail
    );
    let diagnosis = wrong.diagnosis.unwrap();
    assert!(diagnosis.is("target without density"), "{diagnosis:?}");
    assert!(
        diagnosis.text.starts_with("the density is 0 where the target is positive (")
            && diagnosis.text.contains("a row or column without mass")
    );
    let share: f64 = diagnosis.text.split('(').nth(1).unwrap().split('%').next().unwrap().parse().unwrap();
    assert!((share - 10.0).abs() < 1.0, "{share}");
    // Of where the target is 0 nothing is asked.
    let half = judged(|x| if x > 0.5 { 1.0 } else { 0.0 }).diagnosis.unwrap();
    let share: f64 = half.text.split('(').nth(1).unwrap().split('%').next().unwrap().parse().unwrap();
    assert!((share - 20.0).abs() < 2.0, "{share}");
    let nan = judged(|x| if x > 0.5 { f64::NAN } else { 1.0 });
    let said = found(&nan, "support", "target");
    is_certain(said, warpcheck::verify::Verdict::Inconclusive);
    assert!(
        said.detail.starts_with("the target at 0.50") && said.detail.ends_with(" is NaN"),
        "{}",
        said.detail
    );
    // Of many entries some are looked at; on an atom all there is.
    let entries = Told::new(
        Discrete::new(3),
        |x: &[f64]| Some(Sample { point: usize::from(x[0] >= 0.5), density: 0.5 }),
        |&i| if i < 2 { 0.5 } else { 0.0 },
    );
    let judged = |target: fn(usize) -> f64| {
        certain(warpcheck::verify(&entries).target(move |i| target(*i)).samples(FEW as u64))
    };
    is_certain(
        found(&judged(|i| if i < 2 { 1.0 } else { 0.0 }), "support", "target"),
        warpcheck::verify::Verdict::Pass,
    );
    let wrong = judged(|_| 1.0);
    assert_eq!(
        found(&wrong, "support", "target").detail,
        "the target at 2 is 1, the density 0: what is there can't be sampled"
    );
    assert!(wrong.diagnosis.unwrap().text.contains("(33.3% of where it is; for one the target at 2 is 1"));
}

/// Shares are of the measure, however many of the cells that are looked at lie where samples do.
#[test]
fn targets_without_density_on_half_of_a_square() {
    let sample = |xi: &[f64]| Some(Sample { point: DVec2::new(xi[0], 0.5 * xi[1]), density: 2.0 });
    let density = |p: &DVec2| if p.y <= 0.5 { 2.0 } else { 0.0 };
    let sampler = Told { dimensions: 2, ..Told::new(Square, sample, density) };
    let diagnosis =
        certain(warpcheck::verify(&sampler).target(|_| 1.0).samples(FEW as u64)).diagnosis.unwrap();
    let share: f64 = diagnosis.text.split('(').nth(1).unwrap().split('%').next().unwrap().parse().unwrap();
    assert!(diagnosis.is("target without density") && (share - 50.0).abs() < 3.0, "{diagnosis:?}");
}

/// Of a triangle without an area no point can be wanted.
#[test]
fn targets_on_nothing() {
    let middle = |triangle: usize| SurfacePoint { triangle, barycentric: DVec3::splat(1.0 / 3.0) };
    let judged = |areas: [f64; 2]| {
        let sample = |_: &[f64]| Some(Sample { point: middle(0), density: 1.0 });
        let density = |p: &SurfacePoint| if p.triangle == 0 { 1.0 } else { 0.0 };
        let sampler = Told::new(MeshSurface::from_areas(areas.to_vec()), sample, density);
        let examination = alone(warpcheck::verify(&sampler).target(|_| 1.0).samples(FEW as u64), "support");
        found(&examination, "support", "target").evidence
    };
    assert_eq!(judged([1.0, 0.0]), Evidence::Certain(warpcheck::verify::Verdict::Pass));
    assert_eq!(judged([1.0, 1.0]), Evidence::Certain(warpcheck::verify::Verdict::Fail));
}

/// Of 16,384 points, which the check of repeats draws.
#[test]
fn points_of_a_table() {
    let judged = |point: &'static (dyn Fn(f64) -> f64 + Sync)| {
        let sample = move |x: &[f64]| Some(Sample { point: point(x[0]), density: 1.0 });
        diagnosis(&Told::new(line(), sample, |_| 1.0), FEW)
    };
    let few = judged(&|x| (4096.0 * x).floor() / 4096.0).unwrap();
    assert!(few.is("few points"), "{few:?}");
    let (_, rest) = few.text.split_once("there are about ").unwrap();
    near(rest.split(' ').next().unwrap().parse().unwrap(), 4096.0, 0.05);
    // One that all others share is another fault.
    let clamped = judged(&|x| x.max(0.2));
    assert!(!clamped.as_ref().is_some_and(|d| d.is("few points")), "{clamped:?}");
}

#[test]
fn importance_of_another_function() {
    let sampler = Told::new(
        line(),
        |x: &[f64]| Some(Sample { point: x[0].sqrt(), density: 2.0 * x[0].sqrt() }),
        |&x| 2.0 * x,
    );
    let judged = |importance: fn(f64) -> f64, spread: f64, rival: Option<fn(f64) -> f64>| {
        let verify =
            warpcheck::verify(&sampler).importance(move |x| importance(*x), spread).samples(FEW as u64);
        match rival {
            Some(rival) => certain(verify.rival("mine", move |x| rival(*x))).diagnosis,
            None => certain(verify).diagnosis,
        }
    };
    assert_eq!(judged(|x| 3.0 * x, 0.0, None), None);
    // x^2 / 2 x: its spread over its mean, under 2 x, is 1 / sqrt 8.
    let other = judged(|x| x * x, 0.1, None).unwrap();
    assert!(other.is("importance of another function"), "{other:?}");
    let spread: f64 =
        other.text.split("spreads by ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    near(spread, 0.125_f64.sqrt(), 0.03);
    let rival = judged(|x| x * x, 0.1, Some(|x| 7.0 * x)).unwrap();
    assert!(
        rival.is("importance of a rival")
            && rival
                .text
                .starts_with("the density follows mine (spread 0.000), not what it was made for (spread 0.3"),
        "{rival:?}"
    );
    // A place where the density that is asked is 0 has no ratio.
    let mut first = [0.0];
    fill_unit(&mut stream(1, "importance", 1), &mut first);
    let once = first[0].sqrt();
    let density = move |x: &f64| if *x == once { 0.0 } else { 2.0 * x };
    let sample = |x: &[f64]| Some(Sample { point: x[0].sqrt(), density: 2.0 * x[0].sqrt() });
    let told = Told::new(line(), sample, density);
    let verify = warpcheck::verify(&told).importance(|x| x * x, 0.1).samples(FEW as u64);
    let rival = certain(verify.rival("mine", |x| 7.0 * x)).diagnosis.unwrap();
    assert!(rival.is("importance of a rival"), "{rival:?}");
    // A rival that spreads as much is none: 0.2 at most where 0.1 is promised, and less than half of what is found.
    let rough = judged(|x| x * x, 0.1, Some(|x| if x < 0.5 { 2.0 * x } else { x })).unwrap();
    assert!(rough.is("importance of another function"), "{rough:?}");
    // x^p / 2 x has a spread of (p - 1) / sqrt(4 p): 0.35 of x^2 is less than half of the 1.24 of x^8, but more than 0.2.
    let loose = judged(|x| x.powi(8), 0.1, Some(|x| x * x)).unwrap();
    assert!(loose.is("importance of another function"), "{loose:?}");
    // 0.25 of x^1.65 is less than 0.3, but not than half of 0.35.
    let hardly = judged(|x| x * x, 0.15, Some(|x| x.powf(1.65))).unwrap();
    assert!(hardly.is("importance of another function"), "{hardly:?}");
}

#[test]
fn densities_that_disagree() {
    let told = |returned: &'static (dyn Fn(f64) -> f64 + Sync)| {
        let sample = move |x: &[f64]| Some(Sample { point: x[0], density: returned(x[0]) });
        diagnosis(&Told::new(line(), sample, |_| 1.0), FEW)
    };
    let constant = told(&|_| 1.25).unwrap();
    assert_eq!(
        (constant.name.as_str(), constant.text.as_str()),
        (
            "constant in the density returned",
            "the density returned with a sample is 1.250000 times the one at its point"
        )
    );
    let other = told(&|x| 0.5 + x).unwrap();
    assert_eq!(
        other.text,
        "the density returned with a sample is another function of the point than the density asked"
    );
    assert!(other.is("density returned is another"));
    let scattered = told(&|x| if (x * 1e6).fract() < 0.5 { 0.8 } else { 1.2 }).unwrap();
    assert!(
        scattered.is("chosen part only")
            && scattered
                .text
                .starts_with("the density returned with a sample depends on more than its point"),
        "{scattered:?}"
    );
    assert_eq!(told(&|_| 1.0), None);
    // Another one within leaves too, of which there are some 2000, but hardly.
    let waves = told(&|x| 1.0 + 0.5 * (200.0 * x).sin()).unwrap();
    assert!(waves.is("density returned is another"), "{waves:?}");
}

/// Of densities of which some are 0 where they are returned: the others are 1.25 times those that are asked.
#[test]
fn densities_that_disagree_by_a_constant() {
    let sample = |x: &[f64]| {
        let point = x[0].sqrt();
        Some(Sample { point, density: if x[0] < 0.01 { 0.0 } else { 2.5 * point } })
    };
    let constant = diagnosis(&Told::new(line(), sample, |x| 2.0 * x), FEW).unwrap();
    assert_eq!(constant.text, "the density returned with a sample is 1.250000 times the one at its point");
}

/// Of 2000 samples some 50 to 100 are in a cell, however many leaves there are.
#[test]
fn counts_that_nothing_explains() {
    // In each tenth of the line nearer to its lower end.
    let sample = |x: &[f64]| {
        let (tenth, within) = ((10.0 * x[0]).floor(), (10.0 * x[0]).fract());
        Some(Sample { point: (tenth + within * within) / 10.0, density: 1.1 })
    };
    let unknown = diagnosis(&Told::new(line(), sample, |_| 1.0), SAMPLES).unwrap();
    let words = " known mistakes explains the counts in ";
    let (_, cells) = unknown.text.split_once(words).unwrap_or_else(|| panic!("{unknown:?}"));
    let cells: u32 = cells.split(' ').next().unwrap().parse().unwrap();
    assert!((20..=40).contains(&cells) && !unknown.explains, "{}", unknown.text);
}

/// Counts are looked at from a thousand samples on, and tell more than densities that disagree.
#[test]
fn counts_of_a_thousand_samples() {
    // All in the lower half, of which the density returned is a tenth too large everywhere.
    let sample = |x: &[f64]| Some(Sample { point: 0.5 * x[0], density: 1.1 });
    let name = |samples: usize| diagnosis(&Told::new(line(), sample, |_| 1.0), samples).unwrap().name;
    assert_eq!(name(999), "constant in the density returned");
    assert_ne!(name(1000), "constant in the density returned");
}

/// It takes longer than what was stopped.
#[test]
fn who_is_stopped_gets_no_diagnosis() {
    let judged = |stop: bool| {
        let stop = Some(Arc::new(AtomicBool::new(stop)));
        let settings = Settings { samples: FEW as u64, stop, ..Settings::default() };
        let nothing = Told::new(line(), |_: &[f64]| None, |_| 1.0);
        certain(warpcheck::verify(&nothing).settings(settings)).diagnosis.map(|d| d.name)
    };
    assert_eq!((judged(false).as_deref(), judged(true)), (Some("nothing is sampled"), None));
}

/// A sampler of the line that gives its first cell a negative mass.
struct Negative;

impl Sampler for Negative {
    type Domain = Interval;
    fn domain(&self) -> Interval {
        line()
    }
    fn dimensions(&self) -> usize {
        1
    }
    fn sample(&self, xi: &[f64]) -> Option<Sample<f64>> {
        Some(Sample { point: xi[0], density: 1.25 })
    }
    fn density(&self, _: &f64) -> f64 {
        1.0
    }
    fn cell_mass(&self, cell: &Cell) -> Option<f64> {
        Some(if cell.low[0] == 0.0 { -0.1 } else { cell.high[0] - cell.low[0] })
    }
}

/// No counts are held against masses that can't be: what else is known is said.
#[test]
fn negative_masses_explain_nothing() {
    let diagnosis = certain(warpcheck::verify(&Negative).samples(SAMPLES as u64)).diagnosis.unwrap();
    assert!(diagnosis.is("constant in the density returned"), "{diagnosis:?}");
    // And that its density says otherwise.
    let examination = alone(warpcheck::verify(&Negative).samples(SAMPLES as u64), "normalisation");
    let detail = &found(&examination, "normalisation", "").detail;
    assert!(
        detail.starts_with("the sampler gives x 0.000000..")
            && detail.contains(" the mass -1e-1, its density "),
        "{detail}"
    );
}

#[test]
fn faults_of_a_single_variate() {
    let at = |at: f64, point: f64, density: f64| {
        let sample = move |x: &[f64]| {
            Some(if x[0] == at { Sample { point, density } } else { Sample { point: x[0], density: 1.0 } })
        };
        let told = Told { variate_knots: vec![0.3], ..Told::new(line(), sample, |_| 1.0) };
        diagnosis(&told, FEW).map(|d| (d.name, d.text)).unwrap_or_default()
    };
    let said = |name: &str, text: &str| (name.to_owned(), text.to_owned());
    assert_eq!(
        at(0.0, 1.5, 1.0),
        said("outside at the end", "at the variate 0 the point is 1.5, outside of [0, 1]")
    );
    assert_eq!(
        at(ONE_MINUS_EPSILON_F64, 1.5, 1.0),
        said("outside at the end", "at the largest variate under 1 the point is 1.5, outside of [0, 1]")
    );
    assert_eq!(
        at(0.3, -0.5, 1.0),
        said(
            "outside at the end",
            "where a variate is 0.3, a boundary of the table, the point is -0.5, outside of [0, 1]"
        )
    );
    assert_eq!(at(0.0, f64::NAN, 1.0).0, "not finite at the end");
    assert_eq!(
        at(0.0, 0.5, f64::INFINITY),
        said("density not finite at the end", "at the variate 0 the density is inf")
    );
    assert_eq!(at(0.7, 1.5, 1.0), said("", ""));
    let entry = Told::new(
        Discrete::new(3),
        |x: &[f64]| {
            Some(if x[0] == 0.0 {
                Sample { point: 2, density: 0.0 }
            } else {
                Sample { point: usize::from(x[0] >= 0.5), density: 0.5 }
            })
        },
        |&i| if i < 2 { 0.5 } else { 0.0 },
    );
    let mass = diagnosis(&entry, FEW).unwrap();
    assert_eq!(
        (mass.name.as_str(), mass.text.as_str()),
        (
            "entry of mass 0",
            "at the variate 0 an entry of mass 0 is returned, as by a search with < where <= belongs"
        )
    );
    assert_eq!(diagnosis(&Told::new(line(), plain, |_| 1.0), FEW), None);
}
