//! What is made of findings: verdicts, texts, power, figures of cells and their pictures.

use super::*;
use warpcheck::domain::{Cell, Disk, Interval};
use warpcheck::sampler::{DiscreteCdf, Sampler, from_fn};
use warpcheck::statistics::{chi_square, normal};
use warpcheck::verify::{Against, CellFigure, Conclusion, Diagnosis, Report, Settings, Verdict, estimator};

/// An examination without findings.
fn blank() -> Examination {
    let mut examination = estimator(|_: f64| 0.0, 0.0).samples(1).examine();
    examination.findings.clear();
    examination
}

fn finding(check: &'static str, evidence: Evidence) -> Finding {
    Finding {
        check,
        part: String::new(),
        evidence,
        detail: "so".to_owned(),
        sees: String::new(),
        power: None,
    }
}

fn chance(p: f64, conservative: f64) -> Finding {
    finding("chi-square", Evidence::Chance { p, conservative })
}

fn with(findings: Vec<Finding>) -> Examination {
    let mut examination = blank();
    examination.findings = findings;
    examination
}

fn verdicts(report: &Report) -> Vec<Verdict> {
    report.conclusions.iter().flatten().map(|c| c.verdict).collect()
}

#[test]
fn p_values_are_judged_together() {
    use Verdict::{Fail, Inconclusive, Pass};
    let settings = Settings { seed: 9, samples: 77, ..Settings::default() };
    // Holm's correction: the smallest of four times 4, the next times 3.
    let report = Report::new(
        vec![
            with(vec![chance(2.4e-4, 2.4e-4), chance(0.5, 0.5)]),
            with(vec![chance(3.5e-4, 3.5e-4), finding("support", Evidence::Certain(Pass)), chance(0.9, 0.9)]),
        ],
        &settings,
    );
    assert_eq!(verdicts(&report), [Fail, Pass, Pass, Pass, Pass]);
    assert_eq!((report.tests, report.seed, report.samples, report.alpha), (4, 9, 77, 1e-3));
    near(report.adjusted_p(0).unwrap(), 9.6e-4, 1e-12);
    near(report.adjusted_p(1).unwrap(), 1.05e-3, 1e-12);
    assert_eq!((report.verdict_on(0), report.verdict_on(1), report.verdict()), (Fail, Pass, Fail));
    near(report.level(), 2.5e-4, 1e-12);
    assert_eq!(report.examinations[1].tests(), 2);
    // Who shares alpha with three others has a quarter of it.
    let shared = Settings { others: 3, ..settings.clone() };
    let report = Report::new(vec![with(vec![chance(2.6e-4, 2.6e-4)]), with(vec![])], &shared);
    assert_eq!((verdicts(&report), report.alpha, report.level()), (vec![Pass], 2.5e-4, 2.5e-4));
    // Alpha itself is no failure, and what is conservatively none is not told.
    let one = |finding: Finding| Report::new(vec![with(vec![finding])], &settings);
    for (found, verdict) in [
        (chance(1e-3, 1e-3), Pass),
        (chance(0.999e-3, 0.999e-3), Fail),
        (chance(0.999e-3, 1e-3), Inconclusive),
        (chance(f64::NAN, f64::NAN), Inconclusive),
        (chance(f64::NAN, 1e-9), Fail),
        (finding("sequential", Evidence::Betting { ln_e: 7.0, conservative: 6.9 }), Inconclusive),
        (finding("sequential", Evidence::Betting { ln_e: 7.0, conservative: 6.91 }), Fail),
        (finding("sequential", Evidence::Betting { ln_e: -1.0, conservative: -1.0 }), Pass),
        (finding("jacobian", Evidence::Unanswered), Inconclusive),
        (finding("jacobian", Evidence::Certain(Inconclusive)), Inconclusive),
    ] {
        assert_eq!(verdicts(&one(found.clone())), [verdict], "{found:?}");
    }
    near(one(chance(f64::NAN, f64::NAN)).adjusted_p(0).unwrap(), 1.0, 0.0);
    near(
        one(finding("sequential", Evidence::Betting { ln_e: -1.0, conservative: -2.0 }))
            .adjusted_p(0)
            .unwrap(),
        1.0,
        0.0,
    );
    near(
        one(finding("sequential", Evidence::Betting { ln_e: 3.0, conservative: 2.0 })).adjusted_p(0).unwrap(),
        (-2.0_f64).exp(),
        1e-12,
    );
    let bet = Evidence::Betting { ln_e: 3.0, conservative: -2.0 };
    assert_eq!(bet.p_values(), Some(((-3.0_f64).exp(), 1.0)));
    // No answer is no reason to fail, but no pass either where there is no other.
    let none = one(finding("jacobian", Evidence::Unanswered));
    assert_eq!((none.verdict(), none.adjusted_p(0), none.tests, none.level()), (Inconclusive, None, 0, 1e-3));
    let beside = Report::new(
        vec![with(vec![
            finding("jacobian", Evidence::Unanswered),
            finding("support", Evidence::Certain(Pass)),
        ])],
        &settings,
    );
    assert_eq!(beside.verdict(), Pass);
    assert_eq!(Report::new(vec![], &settings).verdict(), Inconclusive);
}

#[test]
fn a_failure_in_words() {
    let p = |part: &str, p: f64| Finding { part: part.to_owned(), ..chance(p, p) };
    let mut examination = with(vec![
        p("16 cells", 1e-9),
        p("48 cells", 1e-12),
        p("192 cells", 0.4),
        finding("support", Evidence::Certain(Verdict::Fail)),
        Finding { detail: "otherwise".to_owned(), ..finding("support", Evidence::Certain(Verdict::Fail)) },
        finding("weights", Evidence::Certain(Verdict::Inconclusive)),
        Finding { check: "scan", ..p("", 1e-200) },
        Finding { check: "scan", ..p("more", 1e-200) },
        Finding { check: "repeats", ..p("", 0.001) },
    ]);
    let cell = |observed: u64, expected: f64, place: &str| CellFigure {
        cell: Cell { patches: 0..1, low: [0.0; 2], high: [1.0; 2] },
        place: place.to_owned(),
        observed,
        expected,
        samples: 100,
        others: 0,
    };
    examination.cells = vec![
        cell(30, 20.0, "a"),
        cell(20, 20.0, "b"),
        cell(0, 50.0, "c"),
        cell(60, 1e-12, "d"),
        cell(51, 50.0, "e"),
    ];
    examination.elsewhere = vec![cell(8, 20.0, "rejected")];
    (examination.against, examination.integral, examination.rejected, examination.samples) =
        (Against::Density, (0.9, 2e-3), 8, 100);
    examination.diagnosis = Some(Diagnosis {
        name: "n".to_owned(),
        alike: vec![],
        text: "it is so".to_owned(),
        explains: true,
        gain: 0.0,
        margin: None,
        others: vec![],
    });
    let settings = Settings { alpha: 1e-2, ..Settings::default() };
    let said = |examination: Examination| {
        let report = Report::new(vec![blank(), examination], &settings);
        let mut text = String::new();
        report.write_failure(&mut text, 1).unwrap();
        (text, report)
    };
    let (text, report) = said(examination);
    // Of a check the clearest part, or the first of two that are as clear.
    let expected = "  the density integrates to 0.900000 +- 2e-3; 8 of 100 samples were rejected
  diagnosis: it is so
  fail: chi-square (48 cells): so; p = 4.0e-12 after correction for 6 tests, level 0.01; and 1 more of its parts
  fail: support: so; and 1 more of its parts
  inconclusive: weights: so
  fail: scan: so; p = 6.0e-200 after correction for 6 tests, level 0.01; and 1 more of its parts
  fail: repeats: so; p = 2.0e-3 after correction for 6 tests, level 0.01
  worst places:
       +6.0e7 sigma  60 samples, 0.0 expected  at d
        -10.0 sigma  0 samples, 50.0 expected  at c
         -3.0 sigma  8 samples, 20.0 expected  at rejected
         +2.5 sigma  30 samples, 20.0 expected  at a
         +0.2 sigma  51 samples, 50.0 expected  at e
";
    assert_eq!(text, expected);
    let [_, conclusions] = &report.conclusions[..] else { panic!() };
    assert_eq!(conclusions.iter().filter(|c: &&Conclusion| c.adjusted_p.is_none()).count(), 3);
    let worst: Vec<_> = report.examinations[1].worst_cells(2).iter().map(|c| c.place.as_str()).collect();
    assert_eq!(worst, ["d", "c"]);
    // Where no density is involved, or nothing was counted, less is said.
    for (against, integral) in [
        (Against::Relations, (0.9, 0.1)),
        (Against::Sampler(5), (0.9, 0.1)),
        (Against::Density, (f64::NAN, 0.1)),
    ] {
        let mut examination = with(vec![finding("support", Evidence::Certain(Verdict::Fail))]);
        (examination.against, examination.integral) = (against, integral);
        examination.cells = vec![cell(30, 20.0, "a")];
        assert_eq!(said(examination).0, "  fail: support: so\n");
    }
    let mut given =
        with(vec![Finding { check: "scan", ..p("", 0.0) }, chance(0.0095, 0.5), chance(0.5, 0.5)]);
    (given.against, given.integral) = (Against::Given, (1.0, 0.0));
    let expected = "  the density integrates to 1.000000 +- 0e0; 0 of 1 samples were rejected
  fail: scan: so; p < 1e-300 after correction for 3 tests, level 0.01
";
    assert_eq!(said(given).0, expected);
    let told = |p: f64| {
        let (text, _) = said(with(vec![chance(1e-3, p)]));
        text.split("p ").nth(1).unwrap().split(" after").next().unwrap().to_owned()
    };
    assert_eq!([told(0.01), told(0.456), told(0.1)], ["= 0.01", "= 0.46", "= 0.10"]);
}

#[test]
fn residuals_are_standardised() {
    let residual = |observed: u64, expected: f64, samples: u64, others: u64| {
        let cell = Cell { patches: 0..1, low: [0.0; 2], high: [1.0; 2] };
        CellFigure { cell, place: String::new(), observed, expected, samples, others }.residual()
    };
    near(residual(30, 20.0, 100, 0), 10.0 / 4.0, 1e-12);
    near(residual(10, 20.0, 100, 0), -10.0 / 4.0, 1e-12);
    // Of two samples the variance is less, by the share of the other.
    near(residual(30, 20.0, 100, 300), 10.0 / 12.0_f64.sqrt(), 1e-12);
    // All are expected.
    assert_eq!(residual(100, 100.0, 100, 0), 0.0);
    assert_eq!(residual(100, 100.000_05, 100, 0), 0.0);
    assert_eq!(residual(100, 100.000_2, 100, 0), f64::NEG_INFINITY);
    assert_eq!(residual(99, 100.0, 100, 0), f64::NEG_INFINITY);
    assert_eq!(residual(101, 100.0, 100, 0), f64::INFINITY);
    near(residual(100, 100.0 * (1.0 - 2e-9), 100, 0), 2e-7 / (200e-9_f64).sqrt(), 1e-6);
    assert_eq!(residual(100, 100.0 * (1.0 - 0.5e-9), 100, 0), 0.0);
    // None are.
    assert_eq!((residual(0, 0.0, 100, 0), residual(1, 0.0, 100, 0)), (0.0, f64::INFINITY));
}

/// The share of the noncentrality that is left of a region in one piece.
fn left(axes: i32, cells: f64) -> f64 {
    match axes {
        0 => cells.min(1.0),
        1 if cells > 1.0 => 1.0 - 0.5 / cells,
        2 if cells > 1.0 => (1.0 - 0.5 / cells.sqrt()).powi(2),
        _ => cells / f64::from(1 << axes),
    }
}

/// The relative error over a mass that windows show.
fn by_windows(mass: f64, n: f64, alpha: f64) -> f64 {
    let needed = normal::isf(0.5 * alpha / (7.0 * 256.0)).unwrap() + 2.33;
    let seen = [4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0].map(|parts| {
        let inside = if 3.0 / parts <= mass { 1.0 } else { 0.85 };
        let fits = 1.0 / parts <= mass && n / parts >= 50.0;
        let error =
            needed * (1.0 - 1.0 / parts).sqrt() * (1.0 - mass) / ((inside - mass) * (n / parts).sqrt());
        if fits { error } else { f64::INFINITY }
    });
    seen.into_iter().fold(f64::INFINITY, f64::min)
}

#[test]
fn what_would_have_been_caught() {
    let alpha = 1e-5;
    for (axes, scales, samples) in [
        (0, vec![20, 150], 1_000_000),
        (1, vec![16, 48, 200], 1_000_000),
        (2, vec![16, 48, 300], 300_000),
        (2, vec![1, 16], 300_000),
        (2, vec![16, 511], 300_000),
        (2, vec![16, 512], 300_000),
        (1, vec![16, 1000], 1_000_000),
        (2, vec![16, 1000], 20_000),
        // Of 100 samples no window expects 50 but the one of a half, which is none.
        (2, vec![16, 1000], 100),
    ] {
        let mut examination = blank();
        (examination.against, examination.samples, examination.axes) = (Against::Density, samples, axes);
        examination.scales = scales.clone();
        let n = samples as f64;
        let expected = |mass: f64| {
            let needed = |cells: usize| {
                chi_square::noncentrality_for_power(alpha, cells as f64 - 1.0, 0.99).unwrap()
                    / left(axes as i32, mass * cells as f64)
            };
            let best = scales.iter().filter(|&&c| c > 1).map(|&c| needed(c)).fold(f64::INFINITY, f64::min);
            let by_cells = (best * (1.0 - mass) / (n * mass)).sqrt();
            if scales[scales.len() - 1] >= 512 { by_cells.min(by_windows(mass, n, alpha)) } else { by_cells }
        };
        let power = examination.power(alpha);
        assert_eq!(power.iter().map(|p| p.mass).collect::<Vec<_>>(), [0.01, 0.05, 0.2, 0.5]);
        for p in power {
            near(p.error, expected(p.mass), 1e-9);
        }
        for (mass, error) in [(0.05, 0.02), (0.05, 0.06), (0.2, 0.015), (0.03, 0.05)] {
            let lambda = n * error * error * mass / (1.0 - mass);
            let by_cells = |cells: usize| {
                let df = cells as f64 - 1.0;
                chi_square::noncentral_sf(
                    chi_square::isf(alpha, df).unwrap(),
                    df,
                    lambda * left(axes as i32, mass * cells as f64),
                )
                .unwrap()
            };
            let mut best = scales.iter().filter(|&&c| c > 1).map(|&c| by_cells(c)).fold(0.0, f64::max);
            if scales[scales.len() - 1] >= 512 {
                let critical = normal::isf(0.5 * alpha / (7.0 * 256.0)).unwrap();
                best =
                    best.max(normal::sf(critical - (critical + 2.33) * error / by_windows(mass, n, alpha)));
            }
            near(examination.power_against(alpha, mass, error).unwrap(), best, 1e-9);
        }
        // Two samples are worth their harmonic mean, halved.
        let alone = examination.power(alpha);
        examination.samples = 3 * samples;
        let others = 3 * samples / 2;
        for against in [Against::Sampler(others), Against::Points(others)] {
            examination.against = against;
            assert_eq!(examination.power(alpha), alone);
        }
        examination.anytime = true;
        assert_eq!((examination.power(alpha), examination.power_against(alpha, 0.1, 0.1)), (vec![], None));
    }
    // One cell is no scale, and nothing counted tells nothing.
    for scales in [vec![], vec![1]] {
        let mut examination = blank();
        (examination.scales, examination.against) = (scales, Against::Density);
        assert_eq!((examination.power(alpha), examination.power_against(alpha, 0.1, 0.1)), (vec![], None));
    }
    // Densities that came with the samples say by themselves what they see.
    let power = warpcheck::verify::Power { mass: 0.6, error: 0.01 };
    let mut own = with(vec![Finding { power: Some(power), ..chance(0.5, 0.5) }, chance(0.5, 0.5)]);
    (own.against, own.scales) = (Against::OwnDensities, vec![16]);
    assert_eq!((own.power(alpha), own.power_against(alpha, 0.1, 0.1)), (vec![power], None));
}

#[test]
fn pictures_show_densities() {
    // Three entries of 5 have all of the mass; the picture is four times as wide as it is high.
    let table = DiscreteCdf::new(&[1.0, 0.0, 2.0, 0.0, 5.0]).unwrap();
    let examination = warpcheck::verify(&table).samples(20_000).examine();
    let map = examination.map(5);
    assert_eq!((map.width, map.height, map.cell.len(), map.observed.len()), (20, 5, 100, 100));
    assert_eq!(examination.cells.len(), 3);
    for i in 0..100 {
        let entry = i % 20 / 4;
        let Some(cell) = examination.cells.iter().position(|c| c.cell.patches.contains(&entry)) else {
            assert!(
                map.cell[i].is_none()
                    && [&map.observed, &map.expected, &map.residual].iter().all(|x| x[i].is_nan())
            );
            continue;
        };
        let figure = &examination.cells[cell];
        assert_eq!(map.cell[i], Some(cell as u32));
        let entries = figure.cell.patches.len() as f64;
        near(map.observed[i], figure.observed as f64 / 20_000.0 / entries, 1e-12);
        near(map.expected[i], figure.expected / 20_000.0 / entries, 1e-12);
        near(map.residual[i], figure.residual(), 1e-12);
    }
    assert_eq!((examination.map(0).width, examination.map(0).height), (4, 1));
    // On an interval of length 4 a density of 1/4; of a disk the corners show nothing.
    let line = from_fn(Interval::new(0.0, 4.0), |u: f64| 4.0 * u, |_: f64| 0.25);
    let examination = warpcheck::verify(&line).samples(20_000).examine();
    let map = examination.map(3);
    assert!(map.expected.iter().all(|d| (d - 0.25).abs() < 1e-9) && map.width == 12);
    let (x, low) = (7.5 / 12.0, 3.0);
    let cell = map.cell[7].unwrap() as usize;
    let Cell { low: from, high: to, .. } = examination.cells[cell].cell;
    assert!(from[0] <= x && x < to[0] && low > 0.0);
    near(
        map.observed[7],
        examination.cells[cell].observed as f64 / 20_000.0 / (4.0 * (to[0] - from[0])),
        1e-9,
    );
    let radius = |[u, v]: [f64; 2]| {
        let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
        [u.sqrt() * cos, u.sqrt() * sin]
    };
    let disk = from_fn(Disk, radius, |_: glam::DVec2| std::f64::consts::FRAC_1_PI);
    let map = warpcheck::verify(&disk).samples(20_000).examine().map(8);
    assert!([0, 1, 6, 7, 8, 15, 56, 63].iter().all(|&i| map.observed[i].is_nan() && map.cell[i].is_none()));
    assert!([3, 10, 20, 27, 36, 44].iter().all(|&i| map.observed[i] > 0.1 && map.cell[i].is_some()));
    // What has no cells shows nothing.
    let map = blank().map(3);
    assert_eq!((map.width, map.height, map.cell), (1, 3, vec![None; 3]));
    assert!(map.observed.len() == 3 && map.observed[0].is_nan() && map.residual[2].is_nan());
    assert_eq!(blank().map(0).height, 1);
    assert_eq!(table.dimensions(), 1);
}

/// Each check has a name, and a sentence of its own on what it asks.
#[test]
fn checks_say_what_they_ask() {
    let all: Vec<_> = checks().collect();
    let names = [
        "domain",
        "support",
        "agreement",
        "normalisation",
        "jacobian",
        "round trip",
        "chi-square",
        "scan",
        "distribution",
        "weights",
        "independence",
        "repeats",
    ];
    assert_eq!(all.iter().map(|(name, _)| *name).collect::<Vec<_>>(), names);
    for (i, (name, about)) in all.iter().enumerate() {
        assert!(about.split_whitespace().count() > 4, "{name}: {about:?}");
        assert!(all[..i].iter().all(|(_, other)| other != about), "{name}: {about:?}");
    }
}
