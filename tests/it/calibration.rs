//! How often right samplers fail: no more often than the level says; and p-values are what they claim to be. `warpcheck calibrate` measures the
//! same with 10,000 runs.

use glam::Vec3;
use warpcheck::calibration::{Calibration, Candidate, Claim, Mode, Plan, calibrate};
use warpcheck::sampler::*;
use warpcheck::statistics::binomial;
use warpcheck::verify::{Evidence, Examination, Finding, Settings, Verdict};
use warpcheck::{report, verify};

/// Thirty runs see a rate of five times its level.
#[test]
fn right_samplers_fail_no_more_often_than_alpha() {
    right_samplers(30, 5_000);
}

#[test]
#[ignore = "long: a hundred runs see a rate of three times its level"]
fn right_samplers_fail_no_more_often_than_alpha_in_a_hundred() {
    right_samplers(100, 20_000);
}

fn right_samplers(runs: u64, samples: u64) {
    let triangle = BarycentricWarp::new(TriangleWarp::LowDistortion, 0.7).unwrap();
    let lobe = GgxVisibleNormals::new(Vec3::new(0.36, -0.48, 0.8), 0.5).unwrap();
    let areas: Vec<f64> = (1..=300).map(|i| f64::from(i % 17) + 0.1).collect();
    let table = DiscreteCdf::new(&areas).unwrap();
    let candidates = [
        Candidate::sampler("triangle", &triangle).share(3),
        Candidate::sampler("cosine", &CosineHemisphere),
        Candidate::sampler("GGX 0.5", &lobe),
        Candidate::sampler("table", &table).share(5),
    ];
    let plan = Plan { runs, samples, anytime_samples: 0, ..Plan::default() };
    let calibration = calibrate(&candidates, &plan);
    println!("{}", report::calibration_table(&calibration, report::Style::Plain));
    assert!(calibration.holds(), "{}", report::calibration_table(&calibration, report::Style::Plain));
    assert_eq!(calibration.runs, plan.runs);

    let whole = calibration.row("whole verdict", Mode::Fixed).unwrap();
    let [at_5_percent, ..] = whole.all.rates;
    // What is widened into inconclusive just before it fails counts as an alarm too. As many or more would come up once in 1e5.
    let alarms = at_5_percent.alarms + at_5_percent.inconclusive;
    let surprise = binomial::upper_tail(alarms, whole.all.runs, 0.05).unwrap();
    assert!(surprise > 1e-5, "{alarms} of {} runs did not pass at 0.05", whole.all.runs);
    for check in ["chi-square", "distribution", "independence", "support", "agreement", "normalisation"] {
        assert!(calibration.row(check, Mode::Fixed).is_some_and(|row| row.all.runs > 0), "{check}");
    }
    let claims = |check: &str, claim| {
        let tested = |u: &&warpcheck::calibration::Uniformity| u.check == check && u.claim == claim;
        calibration.uniformity.iter().filter(tested).map(|u| u.p_values.len()).max()
    };
    let runs = Some(runs as usize);
    assert_eq!(claims("chi-square", Claim::Uniform), runs);
    assert_eq!(claims("independence", Claim::Uniform), runs);
    assert_eq!(claims("distribution", Claim::AtLeastUniform), runs);
}

/// Under constant peeking the level holds at the worst of all looks.
#[test]
fn peeking_raises_no_more_alarms() {
    let weights: Vec<f64> = (0..60).map(|i| f64::from(1 + i % 5)).collect();
    let table = DiscreteCdf::new(&weights).unwrap();
    let plan = Plan { runs: 20, samples: 2_000, anytime_samples: 8 << 14, seed: 3, ..Plan::default() };
    let calibration = calibrate(&[Candidate::sampler("table", &table)], &plan);
    assert!(calibration.holds(), "{}", report::calibration_table(&calibration, report::Style::Plain));
    let row = calibration.row("sequential", Mode::Anytime).unwrap();
    assert_eq!((row.all.runs, row.all.tests), (20, 20));
    let looked = calibration.uniformity_of(row);
    assert!(looked.iter().any(|u| u.claim == Claim::AtLeastUniform && u.p_values.iter().any(|&p| p < 1.0)));
}

/// Right samplers whose findings are tampered with. The examinations are real, of few samples, so that only the findings matter.
fn tampered(runs: u64, tamper: impl Fn(&mut Vec<Finding>, u64) + Send + Sync) -> Calibration {
    let table = DiscreteCdf::new(&[1.0, 2.0, 3.0]).unwrap();
    let without = verify::checks().map(|(name, _)| name.to_owned()).collect();
    let plan = Plan { runs, samples: 64, anytime_samples: 0, without, ..Plan::default() };
    let examine = |settings: &Settings| -> Examination {
        let mut examination = verify(&table).settings(settings.clone()).examine();
        tamper(&mut examination.findings, settings.seed);
        examination
    };
    calibrate(&[Candidate::new("tampered", examine)], &plan)
}

/// Uniform values, one for each seed.
fn uniform(seed: u64) -> f64 {
    // The golden ratio's multiples fill [0, 1) evenly (Weyl): the best uniform numbers to be had.
    (seed as f64 * 0.618_033_988_749_894_9).fract()
}

fn finding(check: &'static str, part: &str, evidence: Evidence) -> Finding {
    Finding {
        check,
        part: part.to_owned(),
        evidence,
        detail: "a figure".to_owned(),
        sees: String::new(),
        power: None,
    }
}

fn chance(check: &'static str, part: &str, p: f64) -> Finding {
    finding(check, part, Evidence::Chance { p, conservative: p })
}

#[test]
fn p_values_that_are_too_small_are_over() {
    let right = tampered(300, |findings, seed| findings.push(chance("chi-square", "9 cells", uniform(seed))));
    assert!(right.holds(), "{}", report::calibration_table(&right, report::Style::Plain));
    let rates = right.row("chi-square", Mode::Fixed).unwrap().all.rates;
    assert!((12..=18).contains(&rates[0].alarms), "{rates:?}");
    assert!(rates[0].interval.contains(0.05) && !rates[0].over());

    // p squared: at 0.05 it alarms with probability 0.22.
    let wrong = tampered(300, |findings, seed| {
        findings.push(chance("chi-square", "9 cells", uniform(seed).powi(2)));
        findings.push(chance("weights", "", 1.0));
    });
    assert!(!wrong.holds());
    let row = wrong.row("chi-square", Mode::Fixed).unwrap();
    assert!(row.over() && row.all.rates.iter().all(|rate| rate.over()), "{row:?}");
    assert!((64..=71).contains(&row.all.rates[0].alarms), "{:?}", row.all.rates);
    assert!(row.all.rates[0].interval.lower > 0.05);
    assert!(wrong.uniformity_of(row).iter().all(|u| u.refuted()));
    assert!(!wrong.row("weights", Mode::Fixed).unwrap().over());
    let table = report::calibration_table(&wrong, report::Style::Plain);
    assert!(table.contains("over: chi-square") && table.contains("fail: 300 runs"), "{table}");
}

#[test]
fn p_values_that_are_too_large_refute_only_a_claim_to_be_uniform() {
    let of = |part: &'static str| {
        let calibration = tampered(300, move |findings, seed| {
            findings.push(chance("chi-square", part, uniform(seed).sqrt()));
        });
        assert!(calibration.rows.iter().all(|row| !row.over()), "{part}");
        calibration.holds()
    };
    assert!(!of("9 cells") && of("least likely leaf"));
}

#[test]
fn one_sampler_among_many_and_one_certain_failure_are_seen() {
    // Over its level on one of five samplers only, which all five together hide.
    let table = DiscreteCdf::new(&[1.0, 2.0, 3.0]).unwrap();
    let without: Vec<String> = verify::checks().map(|(name, _)| name.to_owned()).collect();
    let candidates: Vec<Candidate<'_>> = (0..5)
        .map(|i| {
            let table = &table;
            let examine = move |settings: &Settings| {
                let mut examination = verify(table).settings(settings.clone()).examine();
                let p = if i == 4 { uniform(settings.seed / 5).powf(1.6) } else { 1.0 };
                examination.findings = vec![chance("weights", "", p)];
                examination
            };
            Candidate::new(format!("sampler {i}"), examine)
        })
        .collect();
    let plan = Plan { runs: 1000, samples: 64, anytime_samples: 0, without, ..Plan::default() };
    let calibration = calibrate(&candidates, &plan);
    let row = calibration.row("weights", Mode::Fixed).unwrap();
    assert!(!row.all.over() && row.by_sampler[4].1.over() && row.over(), "{row:?}");

    let first = plan.seed.rotate_left(32);
    let certain = tampered(50, |findings, seed| {
        let verdict = if seed == first + 7 { Verdict::Fail } else { Verdict::Pass };
        findings.push(finding("jacobian", "", Evidence::Certain(verdict)));
    });
    let row = certain.row("jacobian", Mode::Fixed).unwrap();
    assert!(row.over() && !certain.holds());
    assert_eq!((row.all.certain, row.all.rates[2].alarms, row.certain[0].seed), (1, 1, first + 7));
    let table = report::calibration_table(&certain, report::Style::Plain);
    assert!(table.contains("without chance: tampered, seed 4294967303: a figure"), "{table}");
}

/// What looks like a failure is examined again at its level before it counts, as it would be for a user.
#[test]
fn second_looks_count() {
    let table = DiscreteCdf::new(&[1.0, 2.0, 3.0]).unwrap();
    let examine = |settings: &Settings| {
        let mut examination = verify(&table).settings(settings.clone()).examine();
        let p = uniform(settings.seed).powi(3);
        // Doubted, it withdraws.
        let conservative = if p < settings.alpha { 1.0 } else { p };
        examination.findings = vec![finding("chi-square", "9 cells", Evidence::Chance { p, conservative })];
        examination
    };
    let without = verify::checks().map(|(name, _)| name.to_owned()).collect();
    let plan = Plan { runs: 200, samples: 64, anytime_samples: 0, without, ..Plan::default() };
    let calibration = calibrate(&[Candidate::new("doubted", examine)], &plan);
    let row = calibration.row("chi-square", Mode::Fixed).unwrap();
    assert!(!row.over());
    assert_eq!(row.all.rates[0].alarms, 0);
    assert!((70..=78).contains(&row.all.rates[0].inconclusive), "{:?}", row.all.rates);
    // The p-values are those from before the doubt.
    assert!(!calibration.holds() && calibration.uniformity_of(row)[0].refuted());
}

#[test]
fn a_plan_that_is_stopped_judges_what_was_done() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    let table = DiscreteCdf::new(&[1.0, 2.0, 3.0]).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    let plan = Plan {
        runs: 1000,
        samples: 100,
        anytime_samples: 0,
        stop: Some(stop),
        progress: Some(Arc::new(move |done| flag.store(done >= 128, Ordering::Relaxed))),
        ..Plan::default()
    };
    let calibration = calibrate(&[Candidate::sampler("table", &table)], &plan);
    assert_eq!(calibration.runs, 128);
    assert_eq!(calibration.row("whole verdict", Mode::Fixed).unwrap().all.runs, 128);
    let nothing = calibrate(&[Candidate::sampler("table", &table)], &plan);
    assert!(nothing.rows.is_empty() && nothing.runs == 0 && nothing.holds());
}

#[cfg(feature = "plots")]
#[test]
fn the_plot_names_every_check_that_involves_chance() {
    let plan = Plan { runs: 8, samples: 2_000, anytime_samples: 2_000, ..Plan::default() };
    let calibration = calibrate(&[Candidate::sampler("sphere", &UniformSphere)], &plan);
    let svg = report::calibration_plot(&calibration).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{svg}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    for word in ["chi-square", "independence", "whole verdict", "sequential, peeking", "8 runs, seed 1"] {
        assert!(svg.contains(word), "{word}");
    }
    assert!(!svg.contains("normalisation"), "nothing to draw on a logarithmic axis");
}
