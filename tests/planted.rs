//! What is planted is found as often as the battery says.
use warpcheck::domain::Square;
use warpcheck::sampler::{Sampler, from_fn};
use warpcheck::verify;
use warpcheck::verify::Verdict;

/// Uniform on the square by its own account, but with density 1 + `error` over a rectangle of area `mass` somewhere, made up for elsewhere.
fn planted(mass: f64, error: f64, seed: u64) -> impl Sampler<Domain = Square> {
    let hash = |k: u64| (((seed * 7919 + k) as f64 * 12.9898).sin() * 43_758.547).fract().abs();
    let aspect = 0.5 + hash(1);
    let (w, h) = ((mass * aspect).sqrt(), (mass / aspect).sqrt());
    let (x, y) = (hash(2) * (1.0 - w), hash(3) * (1.0 - h));
    let inside = move |u: f64, v: f64| u >= x && u < x + w && v >= y && v < y + h;
    from_fn(
        Square,
        move |[pick, u, v, a, b]: [f64; 5]| {
            // With probability mass * error, a point that would fall anywhere else falls inside.
            if pick < mass * error / (1.0 - mass) && !inside(u, v) { [x + w * a, y + h * b] } else { [u, v] }
        },
        |_: [f64; 2]| 1.0,
    )
}

#[test]
fn rates() {
    for (mass, error) in [(0.05, 0.05)] {
        let mut caught = 0;
        let mut by = std::collections::BTreeMap::new();
        for seed in 0..120 {
            let report = verify(&planted(mass, error, seed)).seed(seed).run();
            caught += u64::from(report.verdict() == Verdict::Fail);
            for c in &report.conclusions[0] {
                if c.verdict == Verdict::Fail {
                    *by.entry(format!(
                        "{} {}",
                        c.finding.check,
                        c.finding.part.trim_start_matches(|x: char| x.is_numeric())
                    ))
                    .or_insert(0) += 1;
                }
            }
            if seed == 0 {
                println!("tests {} power {:?}", report.tests, report.examinations[0].power(report.level()));
            }
        }
        println!("{error} over {mass}: {caught} of 40, by {by:#?}");
    }
}
