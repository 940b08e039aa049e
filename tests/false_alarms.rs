//! How often right samplers fail or come out inconclusive: no more often than alpha says, and p-values are uniform.

use glam::Vec3;
use warpcheck::sampler::*;
use warpcheck::statistics::{binomial, kolmogorov};
use warpcheck::verify;
use warpcheck::verify::{Evidence, Report, Settings, Verdict};

const RUNS: u64 = 40;
const ALPHA: f64 = 0.05;

/// Counts the runs that fail, and checks the p-values of the chi-square test.
fn rate<S: Sampler>(name: &str, sampler: &S) -> u64 {
    let mut failures = 0;
    let mut p_values = Vec::new();
    for seed in 0..RUNS {
        let settings = Settings { samples: 20_000, seed, alpha: ALPHA, ..Settings::default() };
        let examination = verify(sampler).name(name).settings(settings.clone()).examine();
        let coarse =
            examination.findings.iter().find(|f| f.check == "chi-square" && f.part.ends_with("cells"));
        if let Some(Evidence::Chance { p, .. }) = coarse.map(|f| f.evidence) {
            p_values.push(p);
        }
        let report = Report::new(vec![examination], &settings);
        // What is widened into inconclusive just before it fails counts as an alarm too.
        failures += u64::from(report.verdict() != Verdict::Pass);
    }
    assert_eq!(p_values.len() as u64, RUNS);
    p_values.sort_by(f64::total_cmp);
    let uniform = kolmogorov::one_sample(&p_values).unwrap();
    assert!(
        uniform.p > 1e-5,
        "{name}: p-values are not uniform: D = {}, p = {:e}",
        uniform.statistic,
        uniform.p
    );
    failures
}

#[test]
fn right_samplers_fail_no_more_often_than_alpha() {
    let tilted = Vec3::new(0.36, -0.48, 0.8);
    let texels = (0..32 * 16).map(|i| if i == 200 { [1e4; 3] } else { [(i % 7) as f32; 3] }).collect();
    let failures = [
        ("cosine", rate("cosine", &CosineHemisphere)),
        ("vMF 1e4", rate("vMF 1e4", &VonMisesFisher::new(tilted, 1e4).unwrap())),
        ("GGX 0.5", rate("GGX 0.5", &GgxVisibleNormals::new(tilted, 0.5).unwrap())),
        ("map", rate("map", &Environment::new(32, 16, texels, RowWarp::UniformV).unwrap())),
    ];
    let total: u64 = failures.iter().map(|f| f.1).sum();
    let runs = RUNS * failures.len() as u64;
    // At the rate alpha this many failures or more would come up once in 1e5.
    let surprise = binomial::upper_tail(total, runs, ALPHA).unwrap();
    assert!(surprise > 1e-5, "{total} of {runs} runs failed at alpha {ALPHA}: {failures:?}");
    let interval = binomial::clopper_pearson(total, runs, 0.99).unwrap();
    println!(
        "{total} of {runs} runs failed, rate {:.4}..{:.4}, alpha {ALPHA}: {failures:?}",
        interval.lower, interval.upper
    );
}
