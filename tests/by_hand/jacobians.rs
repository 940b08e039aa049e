//! density x |det| = 1, place by place: how many places are asked, and what is said of them.

use super::*;
use glam::DVec2;
use warpcheck::domain::{Discrete, Interval, Mixed, Square, WithAtoms};
use warpcheck::random::fill_unit;
use warpcheck::verify::Verdict;

/// The places: variates on a lattice of 2^-20, with room at both ends.
fn places() -> Vec<f64> {
    let mut xi = vec![0.0; 384];
    fill_unit(&mut stream(1, "jacobian", 0), &mut xi);
    xi.iter().map(|x| ((1.0 / 64.0 + 31.0 / 32.0 * x) * 1_048_576.0).floor() / 1_048_576.0).collect()
}

fn judged(told: Told<'_, Interval>) -> Finding {
    found(&alone(warpcheck::verify(&told).samples(1000), "jacobian"), "jacobian", "").clone()
}

/// Variates as they are, of this density.
fn plain<'a>(density: f64) -> Told<'a, Interval> {
    Told::new(
        Interval::new(0.0, 1.0),
        move |xi: &[f64]| Some(Sample { point: xi[0], density }),
        move |_| density,
    )
}

/// Points in steps of 2^-16 at seven of ten places, where a quotient of differences is known no better than by a thousandth or so: it is what most places know that counts, and
/// not what the best do.
#[test]
fn what_most_places_know() {
    let stepped = |x: f64| if x < 0.7 { (65_536.0 * x).round() / 65_536.0 } else { x };
    let sample = move |xi: &[f64]| Some(Sample { point: stepped(xi[0]), density: 1.0 });
    let finding = judged(Told::new(Interval::new(0.0, 1.0), sample, |_| 1.0));
    is_certain(&finding, Verdict::Pass);
    let error: f64 = finding.sees.split(' ').nth(4).and_then(|word| word.parse().ok()).unwrap();
    assert!((1e-3..0.05).contains(&error), "{}", finding.sees);
}

#[test]
fn how_many_places_answer() {
    let right = judged(plain(1.0));
    is_certain(&right, Verdict::Pass);
    let all =
        "density x |det d point / d xi| = 1 at 384 places; 0 places skipped, where differences don't settle";
    assert_eq!(right.detail, all);
    // Eight of them must be wrong, which 16.6 on average are with probability 0.99.
    assert!(
        right.sees.starts_with("a relative error of 5.")
            && right.sees.ends_with("e-4 over 4.3% of the variates"),
        "{}",
        right.sees
    );
    let slow = judged(Told { is_slow: true, ..plain(1.0) });
    assert!(slow.detail.starts_with("density x |det d point / d xi| = 1 at 64 places; 0"), "{}", slow.detail);
    // Of 64 places three must be: 9 of them on average.
    assert!(slow.sees.ends_with("e-4 over 14.1% of the variates"), "{}", slow.sees);
    // Samples that are rejected answer nothing, nor do those whose differences reach there.
    let kept = |to: f64| {
        let sample = move |xi: &[f64]| (xi[0] < to).then_some(Sample { point: xi[0], density: 1.0 });
        judged(Told::new(Interval::new(0.0, 1.0), sample, |_| 1.0))
    };
    let there = places().iter().filter(|&&x| x < 0.5).count();
    let numbers: Vec<usize> = kept(0.5).detail.split(' ').filter_map(|word| word.parse().ok()).collect();
    assert_eq!(numbers[1] + numbers[2], there, "{}", kept(0.5).detail);
    assert!(numbers[2] < 8, "{}", kept(0.5).detail);
    // Fewer than sixteen say nothing.
    let few = kept(0.02);
    assert_eq!(few.evidence, Evidence::Unanswered);
    assert!(few.detail.starts_with("only ") && few.detail.contains(" places answer; "), "{}", few.detail);
}

#[test]
fn densities_that_are_off_everywhere() {
    for (density, verdict) in [
        (1.000_48, Verdict::Pass),
        (0.999_52, Verdict::Pass),
        (1.000_6, Verdict::Fail),
        (0.999_4, Verdict::Fail),
    ] {
        is_certain(&judged(plain(density)), verdict);
    }
    let twice = judged(plain(2.0));
    let words =
        "density x |det d point / d xi| is not 1 at 384 of 384 places; its median there is 2.00000, at 0.";
    assert!(
        twice.detail.starts_with(words)
            && twice.detail.ends_with("]); 0 places skipped, where differences don't settle"),
        "{}",
        twice.detail
    );
    // By a square root the density is 2 x: right, or with a square root too many.
    let root = |density: fn(f64) -> f64| {
        let sample = move |xi: &[f64]| Some(Sample { point: xi[0].sqrt(), density: density(xi[0].sqrt()) });
        judged(Told::new(Interval::new(0.0, 1.0), sample, move |&x| density(x)))
    };
    is_certain(&root(|x| 2.0 * x), Verdict::Pass);
    is_certain(&root(|x| 1.5 * x.sqrt()), Verdict::Fail);
    // The median of the wrong ones, by their size.
    let wrong = root(|x| 3.0 * x * x);
    let mut products: Vec<f64> = places().iter().map(|u| 1.5 * u.sqrt()).collect();
    products.sort_by(f64::total_cmp);
    let median: f64 =
        wrong.detail.split("median there is ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
    near(median, products[192], 0.02);
}

/// How many places answer, and how many are skipped.
fn answered(finding: &Finding) -> (usize, usize) {
    let numbers: Vec<usize> = finding.detail.split(' ').filter_map(|word| word.parse().ok()).collect();
    assert_eq!(numbers.len(), 3, "{}", finding.detail);
    (numbers[1], numbers[2])
}

/// An atom has no differences, and where there is no density there is nothing to multiply.
#[test]
fn places_that_are_not_asked() {
    let there = |from: f64| places().iter().filter(|&&x| x >= from).count();
    let atoms = Told::new(
        WithAtoms::new(Interval::new(0.0, 1.0), 1),
        |xi: &[f64]| {
            let point = if xi[0] < 0.5 { Mixed::Atom(0) } else { Mixed::Continuous(2.0 * xi[0] - 1.0) };
            Some(Sample { point, density: 0.5 })
        },
        |_| 0.5,
    );
    let finding = found(&alone(warpcheck::verify(&atoms).samples(1000), "jacobian"), "jacobian", "").clone();
    let (all, skipped) = answered(&finding);
    assert!(all + skipped == there(0.5) && skipped < 8, "{}", finding.detail);
    let plain = |xi: &[f64]| Some(Sample { point: xi[0], density: 1.0 });
    let dark = Told::new(Interval::new(0.0, 1.0), plain, |&x| if x < 0.25 { 0.0 } else { 1.0 });
    let finding = judged(dark);
    let (all, skipped) = answered(&finding);
    assert!(all + skipped == there(0.25) && skipped < 8, "{}", finding.detail);
}

/// Entries have no derivatives, nor have points of a plane by one variate.
#[test]
fn who_has_no_jacobian() {
    let nothing = |examination: Examination| {
        assert!(examination.findings.is_empty(), "{:?}", examination.findings);
    };
    let entries = Told::new(
        Discrete::new(4),
        |xi: &[f64]| Some(Sample { point: (4.0 * xi[0]) as usize, density: 0.25 }),
        |_| 0.25,
    );
    nothing(alone(warpcheck::verify(&entries).samples(1000), "jacobian"));
    let curve = Told::new(
        Square,
        |xi: &[f64]| Some(Sample { point: DVec2::new(xi[0], (64.0 * xi[0]).fract()), density: 1.0 }),
        |_| 1.0,
    );
    nothing(alone(warpcheck::verify(&curve).samples(1000), "jacobian"));
}

/// Two variates lead to each point, and the density is the sum of what either gives it: 1/2 and 1/2, or 1/4 and 3/4.
#[test]
fn two_variates_for_each_point() {
    let folded = |fold: f64, density: f64| {
        let point = move |u: f64| if u < fold { u / fold } else { (1.0 - u) / (1.0 - fold) };
        let sample = move |xi: &[f64]| Some(Sample { point: point(xi[0]), density });
        judged(Told::new(Interval::new(0.0, 1.0), sample, move |_| density))
    };
    for fold in [0.5, 0.25] {
        is_certain(&folded(fold, 1.0), Verdict::Pass);
        is_certain(&folded(fold, 2.0), Verdict::Fail);
    }
}

/// Where all variates lead to one point there is no slope.
#[test]
fn places_that_are_skipped() {
    let mut sorted = places();
    sorted.sort_by(f64::total_cmp);
    let flat_from = |first: usize| {
        let from = 0.5 * (sorted[first - 1] + sorted[first]);
        assert!(sorted[first] - sorted[first - 1] > 2e-4, "too close to an edge");
        let sample = move |xi: &[f64]| Some(Sample { point: xi[0].min(from), density: 1.0 });
        judged(Told::new(Interval::new(0.0, 1.0), sample, |_| 1.0)).detail
    };
    let said = |answered: usize, skipped: &str| {
        format!(
            "density x |det d point / d xi| = 1 at {answered} places; {skipped} skipped, where differences don't settle"
        )
    };
    let widest = (150..250).max_by(|&a, &b| {
        let gap = |i: usize| sorted[i] - sorted[i - 1];
        gap(a).total_cmp(&gap(b))
    });
    let first = widest.unwrap();
    assert_eq!(flat_from(first), said(first, &format!("{} places", 384 - first)));
    assert_eq!(flat_from(383), said(383, "1 place"));
}
