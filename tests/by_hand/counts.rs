//! Counts that were chosen, against masses that are known: the statistics, worked out here.

use super::*;
use std::ops::Range;
use warpcheck::domain::{Discrete, Interval, Square};
use warpcheck::statistics::{anderson_darling, binomial, chi_square, kolmogorov, normal};
use warpcheck::verify::{Row, Settings, Verdict, recording};

/// An entry for each row; that after the last is a sample that was rejected. An eighth as many pilots go before, by the masses.
fn entries(masses: &[f64], counts: &[u64]) -> Examination {
    let all: u64 = counts.iter().sum();
    assert_eq!(all % 7, 0);
    let cumulative: Vec<f64> = masses
        .iter()
        .scan(0.0, |sum, m| {
            *sum += m;
            Some(*sum)
        })
        .collect();
    let entry_at = |x: f64| cumulative.iter().position(|&c| x < c).unwrap_or(masses.len());
    let pilots = shuffled((0..all / 7).map(|i| entry_at((i as f64 + 0.5) * 7.0 / all as f64)).collect());
    let judged =
        shuffled(counts.iter().enumerate().flat_map(|(i, &count)| vec![i; count as usize]).collect());
    let rows = Given::new(1, pilots.into_iter().chain(judged).map(|i| i as f64).collect());
    let last = masses.len();
    let row = move |numbers: &[f64]| {
        let entry = numbers[0] as usize;
        Row { point: (entry < last).then_some(entry), density: None, weight: None }
    };
    let settings = Settings { diagnose: false, ..Settings::default() };
    recording(Discrete::new(masses.len()), rows, row)
        .unwrap()
        .density(|&i| masses[i])
        .examine(&settings)
        .unwrap()
}

/// O ln(O / E) + E - O, twice.
fn deviance(observed: f64, expected: f64) -> f64 {
    2.0 * if observed > 0.0 { observed * (observed / expected).ln() + expected - observed } else { expected }
}

fn pearson(counts: &[u64], expected: &[f64]) -> f64 {
    counts.iter().zip(expected).map(|(&o, e)| (o as f64 - e).powi(2) / e).sum()
}

fn g(counts: &[u64], expected: &[f64]) -> f64 {
    counts.iter().zip(expected).map(|(&o, &e)| deviance(o as f64, e)).sum()
}

#[track_caller]
fn is_chi_square(finding: &Finding, name: &str, statistic: f64, df: f64) {
    assert_eq!(finding.detail, format!("{name} = {statistic:.1} at {df} degrees of freedom"));
    let (p, conservative) = p_of(finding);
    near(p, chi_square::sf(statistic, df).unwrap(), 1e-6);
    near(conservative, p, 1e-3);
}

#[test]
fn four_entries() {
    let examination = entries(&[0.25; 4], &[400, 300, 350, 350]);
    let (x2, gg) = (5000.0 / 350.0, g(&[400, 300, 350, 350], &[350.0; 4]));
    is_chi_square(found(&examination, "chi-square", "4 cells"), "X^2", x2, 3.0);
    is_chi_square(found(&examination, "chi-square", "4 cells, G"), "G", gg, 3.0);
    assert_eq!(
        (examination.samples, examination.rejected, examination.scales.as_slice()),
        (1400, 0, &[4][..])
    );
    // Of entries and pairs of them, entry 1 is the least likely, at its share of the level: 9/10 by mass, the rest by number.
    let least = found(&examination, "chi-square", "least likely cell");
    let weight = |mass: f64| 0.9 * mass / 2.0 + 0.1 / 6.0;
    near(p_of(least).0, binomial::two_sided(300, 1400, 0.25).unwrap() / weight(0.25), 1e-9);
    assert_eq!(
        least.detail,
        "300 samples where 350.000 +- 7.8e-14 were expected (exact binomial), at index 1; the worst of 6 cells"
    );
    // A thousandth of a sample makes three with a probability of 1.7e-10, two with one of 5e-7; the level is 1.7e-7.
    assert_eq!(least.sees, "3 samples where none are expected");
    let none = found(&examination, "chi-square", "rejected");
    assert_eq!(none.detail, "0 samples where 0.000 +- 1.4e-3 were expected (exact binomial)");
    assert_eq!(p_of(none), (1.0, 1.0));
    assert_eq!(examination.findings.iter().filter(|f| f.check == "chi-square").count(), 4);
    // Cells and their figures.
    let figures: Vec<_> = examination
        .cells
        .iter()
        .map(|c| (c.place.as_str(), c.observed, c.expected, c.samples, c.others))
        .collect();
    assert_eq!(figures[1], ("index 1", 300, 350.0, 1400, 0));
    assert_eq!(
        examination.elsewhere.iter().map(|c| (c.place.as_str(), c.observed, c.expected)).collect::<Vec<_>>(),
        [("rejected", 0, 0.0)]
    );
    // One look at fewer samples than are looked at before the end.
    let [look] = &examination.history[..] else { panic!("{:?}", examination.history) };
    assert_eq!(look.samples, 1400);
    near(look.p, chi_square::sf(x2, 3.0).unwrap(), 1e-3);
    // So many more pairs of entries that the half is the least likely.
    let examination = entries(&[0.25; 4], &[400, 400, 300, 300]);
    let least = found(&examination, "chi-square", "least likely cell");
    near(p_of(least).0, binomial::two_sided(800, 1400, 0.5).unwrap() / weight(0.5), 1e-9);
    assert!(least.detail.contains("at indices "), "{}", least.detail);
}

#[test]
fn rejected_samples_are_a_cell() {
    let examination = entries(&[0.2, 0.3, 0.4], &[300, 400, 550, 150]);
    let (counts, expected) = ([300, 400, 550, 150], [280.0, 420.0, 560.0, 140.0]);
    is_chi_square(found(&examination, "chi-square", "4 cells"), "X^2", pearson(&counts, &expected), 3.0);
    is_chi_square(found(&examination, "chi-square", "4 cells, G"), "G", g(&counts, &expected), 3.0);
    assert_eq!(examination.rejected, 150);
    let elsewhere = &examination.elsewhere[0];
    assert_eq!((elsewhere.place.as_str(), elsewhere.observed, elsewhere.samples), ("rejected", 150, 1400));
    near(elsewhere.expected, 140.0, 1e-9);
    near(examination.integral.0, 0.9, 1e-12);
    // Seven of them are expected: too few for a cell, and tested alone, by a mass that is known to a millionth.
    let examination = entries(&[0.495, 0.5], &[695, 690, 15]);
    is_chi_square(
        found(&examination, "chi-square", "2 cells"),
        "X^2",
        pearson(&[695, 690], &[693.0, 700.0]),
        1.0,
    );
    let rejected = found(&examination, "chi-square", "rejected");
    assert_eq!(rejected.detail, "15 samples where 7.000 +- 1.4e-3 were expected (exact binomial)");
    near(p_of(rejected).0, binomial::two_sided(15, 1400, 0.005 + 1e-6).unwrap(), 1e-6);
    let examination = entries(&[0.495, 0.5], &[698, 700, 2]);
    near(
        p_of(found(&examination, "chi-square", "rejected")).0,
        binomial::two_sided(2, 1400, 0.005 - 1e-6).unwrap(),
        1e-6,
    );
    // Eight are a cell.
    let eighth = 8.0 / 1400.0 + 1e-9;
    let examination = entries(&[0.5, 0.5 - eighth], &[700, 690, 10]);
    assert!(found(&examination, "chi-square", "3 cells").detail.starts_with("X^2 = 0.5 at 2"));
    assert!(
        examination.findings.iter().all(|f| f.part != "3 cells, G" && f.part != "rejected"),
        "8 are no plenty"
    );
    // A hundred are plenty, for G.
    let has_g = |mass: f64, count: u64| {
        let examination = entries(&[mass, 1.0 - mass], &[count, 1400 - count]);
        examination.findings.iter().any(|f| f.part == "2 cells, G")
    };
    assert!(has_g(100.01 / 1400.0, 100) && !has_g(99.99 / 1400.0, 100));
}

#[test]
fn light_entries_are_pooled() {
    // Entry 3 expects 5.6 samples, and has 14.
    let masses = [0.5, 0.25, 0.246, 0.004];
    let examination = entries(&masses, &[700, 350, 336, 14]);
    is_chi_square(
        found(&examination, "chi-square", "3 cells"),
        "X^2",
        pearson(&[700, 350, 336], &[700.0, 350.0, 344.4]),
        2.0,
    );
    let pool = found(&examination, "chi-square", "pool of light cells");
    assert_eq!(pool.detail, "14 samples where 5.600 +- 1.2e-15 were expected (exact binomial)");
    near(p_of(pool).0, binomial::two_sided(14, 1400, 0.004).unwrap(), 1e-9);
    let places: Vec<_> = examination.elsewhere.iter().map(|c| (c.place.as_str(), c.observed)).collect();
    assert_eq!(places, [("rejected", 0), ("the pool of light cells", 14)]);
    near(examination.elsewhere[1].expected, 5.6, 1e-9);
    assert_eq!(examination.scales, [3]);
    // A pool is tested where it has a mass but no samples, and where it has samples but no mass.
    let empty = entries(&masses, &[700, 350, 350, 0]);
    near(
        p_of(found(&empty, "chi-square", "pool of light cells")).0,
        binomial::two_sided(0, 1400, 0.004).unwrap(),
        1e-9,
    );
    assert_eq!(
        (empty.elsewhere[1].place.as_str(), empty.elsewhere[1].observed),
        ("the pool of light cells", 0)
    );
    near(empty.elsewhere[1].expected, 5.6, 1e-9);
    let massless = entries(&[0.5, 0.5, 0.0], &[700, 693, 7]);
    let pool = found(&massless, "chi-square", "pool of light cells");
    assert_eq!((pool.detail.split(" samples").next(), p_of(pool).0), (Some("7"), 0.0));
    assert_eq!(massless.elsewhere[1].observed, 7);
    // Two apart from each other, 9 and 3 expected together, are a cell.
    let masses = [0.004, 0.496, 0.496, 0.004];
    let examination = entries(&masses, &[4, 694, 694, 8]);
    is_chi_square(
        found(&examination, "chi-square", "3 cells"),
        "X^2",
        pearson(&[694, 694, 12], &[694.4, 694.4, 11.2]),
        2.0,
    );
    assert_eq!(examination.scales, [2]);
    let cells: Vec<_> = examination.history.iter().map(|l| l.p).collect();
    near(cells[0], chi_square::sf(pearson(&[694, 694, 12], &[694.4, 694.4, 11.2]), 2.0).unwrap(), 1e-6);
}

/// A count that is less likely by itself, 29 of 14, is not as unlikely for its share of the level as 624 of 686.
#[test]
fn the_least_likely_cell_is_that_for_its_weight() {
    let examination = entries(&[0.49, 0.01, 0.25, 0.25], &[624, 29, 374, 373]);
    let least = found(&examination, "chi-square", "least likely cell");
    assert!(least.detail.contains(", at index 0; the worst of 6 cells"), "{}", least.detail);
    let alone = |count: u64, mass: f64| binomial::two_sided(count, 1400, mass).unwrap();
    let weighted = |count: u64, mass: f64| alone(count, mass) / (0.9 * mass / 2.0 + 0.1 / 6.0);
    near(p_of(least).0, weighted(624, 0.49), 1e-9);
    assert!(alone(624, 0.49) > alone(29, 0.01) && weighted(624, 0.49) < weighted(29, 0.01));
}

/// Of 32 entries eight make a quarter, and windows hold as many and no more; those that expect fewer than fifty samples don't count.
#[test]
fn windows_of_entries() {
    let scanned = |counts: Vec<u64>| found(&entries(&[1.0 / 32.0; 32], &counts), "scan", "").clone();
    let crowd = scanned((0..32).map(|i| if i < 8 { 91 } else { 63 }).collect());
    assert!(
        crowd.detail.starts_with("728 samples where 560.000 +-")
            && crowd.detail.contains(" in 1/4 of the mass"),
        "{}",
        crowd.detail
    );
    near(p_of(&crowd).0, binomial::two_sided(728, 2240, 0.25).unwrap() * 32.0 * 7.0, 1e-6);
    // Alone the first entry expects 43.75.
    let pair = scanned((0..32).map(|i| [100, 42, 41][usize::from(i > 0) + usize::from(i > 29)]).collect());
    assert!(
        pair.detail.starts_with("142 samples where 87.500 +-")
            && pair.detail.contains(" in 1/16 of the mass"),
        "{}",
        pair.detail
    );
}

#[test]
fn nothing_to_compare() {
    let one = entries(&[1.0], &[1400]);
    let only = found(&one, "chi-square", "");
    is_certain(only, Verdict::Pass);
    assert_eq!(only.detail, "there is only one entry to choose");
    assert!(one.history.is_empty() && one.findings.iter().all(|f| f.part != "least likely cell"));
    let few = entries(&[0.5, 0.5], &[7, 7]);
    let only = found(&few, "chi-square", "");
    is_certain(only, Verdict::Inconclusive);
    assert_eq!(only.detail, "14 samples are too few: no two cells expect 8 of them");
    let none = entries(&[1.0, 0.0], &[0, 0, 1400]);
    let only = found(&none, "chi-square", "");
    is_certain(only, Verdict::Inconclusive);
    assert_eq!(only.detail, "every sample was rejected: there is nothing to judge");
}

/// Whoever has many entries counts them by the remainder of their index, too.
#[test]
fn remainders_of_an_index() {
    const ENTRIES: usize = 1280;
    let counts = |of: &dyn Fn(usize) -> u64| (0..ENTRIES).map(of).collect::<Vec<_>>();
    let judged = |counts: &[u64]| entries(&[1.0 / ENTRIES as f64; ENTRIES], counts);
    // 7 of each, but for one in 64 that has two more and another that has two less.
    let uneven = counts(&|i| match i % 64 {
        3 => 9,
        5 => 5,
        _ => 7,
    });
    let examination = judged(&uneven);
    // 20 entries of each remainder, and 140 samples of them.
    is_chi_square(
        found(&examination, "chi-square", "index modulo 64"),
        "X^2",
        2.0 * 40.0 * 40.0 / 140.0,
        63.0,
    );
    let of_61: Vec<(u64, f64)> = (0..61)
        .map(|r| (r..ENTRIES).step_by(61).fold((0, 0.0), |(n, e), i| (n + uneven[i], e + 7.0)))
        .collect();
    let (observed, expected): (Vec<u64>, Vec<f64>) = of_61.into_iter().unzip();
    is_chi_square(
        found(&examination, "chi-square", "index modulo 61"),
        "X^2",
        pearson(&observed, &expected),
        60.0,
    );
    // 1024 entries are too few for that, and so are 7 samples of a remainder.
    let few = entries(&[1.0 / 1024.0; 1024], &[7; 1024]);
    assert!(few.findings.iter().all(|f| !f.part.starts_with("index")));
    let some = entries(&[1.0 / 1025.0; 1025], &[7; 1025]);
    assert!(some.findings.iter().any(|f| f.part == "index modulo 64"));
    let sparse = judged(&counts(&|i| u64::from(i % 3 == 0 && i < 1260)));
    assert!(sparse.findings.iter().all(|f| !f.part.starts_with("index")));
}

/// How the order of entries, or of places, is filled: at borders of entries, and at lines.
#[test]
fn distribution_functions() {
    let masses = [0.05; 18];
    let counts: Vec<u64> = (0..18).map(|i| 70 + 4 * (i % 3) - i / 6).chain([142 - 3]).collect();
    let counts: Vec<u64> = {
        let mut c = counts;
        let n: u64 = c.iter().sum();
        c[0] += 7 - n % 7;
        c
    };
    let n: u64 = counts.iter().sum();
    let examination = entries(&masses, &counts);
    let all: Vec<f64> = masses.iter().copied().chain([0.1]).collect();
    let error = examination.integral.1 + 1e-6;
    let ks = found(&examination, "distribution", "Rosenblatt, KS");
    let (mut below, mut expected, mut largest) = (0.0, 0.0, 0.0_f64);
    for (o, m) in counts.iter().zip(&all) {
        (below, expected) = (below + *o as f64 / n as f64, expected + m);
        largest = largest.max((below - expected).abs());
    }
    assert_eq!(ks.detail, format!("D = {largest:.2e}, 19 groups"));
    let figure = kolmogorov::grouped(&counts, &all, error).unwrap();
    near(p_of(ks).0, figure.p, 1e-6);
    near(p_of(ks).1, figure.p_conservative, 1e-6);
    let sees = (2e5_f64.ln() / (2.0 * n as f64)).sqrt() + 1.2 / (n as f64).sqrt() + error;
    assert_eq!(ks.sees, format!("{:.2}% of the samples on the wrong side of a line", 100.0 * sees));
    let ad = found(&examination, "distribution", "Rosenblatt, AD");
    let figure = anderson_darling::grouped(&counts, &all, error).unwrap();
    assert_eq!(ad.detail, format!("A^2 = {:.2}, 19 groups", figure.statistic));
    near(p_of(ad).0, figure.p, 1e-6);
    near(p_of(ad).1, figure.p_conservative, 1e-6);
    // Sixteen entries have no order to speak of; of who leaves out too much, or rejects all, nothing is said.
    let sixteen = entries(&[0.0625; 16], &[70; 16]);
    assert!(sixteen.findings.iter().all(|f| f.check != "distribution"));
    let seventeen = entries(&[1.0 / 17.0; 17], &[70; 17]);
    assert!(seventeen.findings.iter().any(|f| f.check == "distribution"));
    let too_much = entries(&[1.000_02 / 17.0; 17], &[70; 17]);
    assert!(too_much.findings.iter().all(|f| f.check != "distribution"));
    let hardly = entries(&[1.000_005 / 17.0; 17], &[70; 17]);
    assert!(hardly.findings.iter().any(|f| f.check == "distribution"));
}

/// The density 1/2 + x on [0, 1], and its integral.
fn rising(x: f64) -> f64 {
    0.5 + x
}

fn below(x: f64) -> f64 {
    0.5 * (x + x * x)
}

/// Numbers in [0, 1): pilots at even distances, and seven times as many that are judged. With 8 pilots in a leaf, these are cut in halves.
fn on_a_line(judged: &[f64]) -> Examination {
    let pilots = judged.len() / 7;
    assert!(pilots.is_power_of_two() && judged.len().is_multiple_of(7));
    let even = shuffled((0..pilots).map(|i| i as f64 / pilots as f64).collect::<Vec<_>>());
    let rows = Given::new(1, even.into_iter().chain(judged.iter().copied()).collect());
    let row = |numbers: &[f64]| Row { point: Some(numbers[0]), density: None, weight: None };
    let settings = Settings { diagnose: false, ..Settings::default() };
    recording(Interval::new(0.0, 1.0), rows, row).unwrap().density(|&x| rising(x)).examine(&settings).unwrap()
}

/// Drawn by 1/2 + x, but for one in a hundred.
fn slightly_crowded(count: usize) -> Vec<f64> {
    let mut rng = stream(12, "crowded", 0);
    let mut next = || unit_f64(&mut rng);
    (0..count)
        .map(|_| if next() < 0.01 { 0.40 + 0.01 * next() } else { 0.5 * ((1.0 + 8.0 * next()).sqrt() - 1.0) })
        .collect()
}

/// The topmost nodes of a tree that halves [0, 1] so often, of no more mass than this.
fn nodes(from: f64, size: f64, least: f64, most: f64) -> Vec<Range<f64>> {
    if size <= least || below(from + size) - below(from) <= most {
        return vec![from..from + size];
    }
    [nodes(from, 0.5 * size, least, most), nodes(from + 0.5 * size, 0.5 * size, least, most)].concat()
}

/// On a line there is an order even of few cells.
#[test]
fn a_distribution_of_eight_cells() {
    let quantile = |p: f64| 0.5 * ((1.0 + 8.0 * p).sqrt() - 1.0);
    let points: Vec<f64> = (0..448).map(|i| quantile((f64::from(i) + 0.5) / 448.0)).collect();
    let examination = on_a_line(&points);
    let cells: Vec<u64> = (0..8)
        .map(|c| points.iter().filter(|&&x| (x * 8.0) as usize == c).count() as u64)
        .chain([0])
        .collect();
    let masses: Vec<f64> =
        (0..8).map(|c| below((c + 1) as f64 / 8.0) - below(c as f64 / 8.0)).chain([0.0]).collect();
    let ks = found(&examination, "distribution", "Rosenblatt, KS");
    let figure = kolmogorov::grouped(&cells, &masses, 1e-6).unwrap();
    assert_eq!(ks.detail, format!("D = {:.2e}, 9 groups", figure.statistic));
    found(&examination, "distribution", "Rosenblatt, AD");
}

/// Two cells have a border at which there is something to compare, one has none.
#[test]
fn a_distribution_of_two_cells() {
    let points = |count: u32| (0..count).map(|i| f64::from(i) / f64::from(count)).collect::<Vec<_>>();
    // Even points, half of them below the middle, where 3/8 should be.
    let two = found(&on_a_line(&points(112)), "distribution", "Rosenblatt, KS").clone();
    assert_eq!(two.detail, "D = 1.25e-1, 3 groups");
    near(p_of(&two).0, kolmogorov::grouped(&[56, 56, 0], &[0.375, 0.625, 0.0], 1e-6).unwrap().p, 1e-6);
    let one = on_a_line(&points(56));
    assert!(one.findings.iter().all(|f| f.check != "distribution"), "{:?}", one.findings);
}

/// Points outside of the domain and samples that are all rejected are failures of their own, and no distribution of anything.
#[test]
fn no_distribution_of_points_outside() {
    let judged = |sample: fn(f64) -> Option<f64>| {
        let drawn = move |xi: &[f64]| sample(xi[0]).map(|point| Sample { point, density: 1.0 });
        let told = Told::new(Interval::new(0.0, 1.0), drawn, |_| 1.0);
        warpcheck::verify(&told).samples(2000).undiagnosed().examine().findings
    };
    let has = |sample: fn(f64) -> Option<f64>| judged(sample).iter().any(|f| f.check == "distribution");
    assert!(has(Some) && !has(|u| Some(if u < 0.01 { 2.0 } else { u })) && !has(|_| None));
}

/// Before anybody fails, masses are integrated again by random points: by 256 of them in each cell, and by 4096 unless that is enough.
#[test]
fn doubts_of_masses() {
    const COUNT: usize = 7 * 256;
    let error = |quantile: &dyn Fn(f64) -> f64| {
        let judged =
            shuffled((0..COUNT).map(|i| quantile((i as f64 + 0.5) / COUNT as f64)).collect::<Vec<_>>());
        let pilots = (0..256).map(|i| f64::from(i) / 256.0);
        let rows = Given::new(1, pilots.chain(judged).collect());
        let row = |numbers: &[f64]| Row { point: Some(numbers[0]), density: None, weight: None };
        let without =
            checks().map(|(name, _)| name.to_owned()).filter(|name| name != "distribution").collect();
        let settings = Settings { diagnose: false, without, ..Settings::default() };
        let record = recording(Interval::new(0.0, 1.0), rows, row).unwrap().density(|&x| rising(x));
        let examination = record.examine(&settings).unwrap();
        (examination.integral.1, p_of(found(&examination, "distribution", "Rosenblatt, KS")).1)
    };
    // Of (1 - w) (x + x^2) / 2 + w x, a mixture with a uniform density.
    let mixed = |w: f64| {
        let (a, b) = (0.5 * (1.0 - w), 0.5 * (1.0 + w));
        move |p: f64| ((b * b + 4.0 * a * p).sqrt() - b) / (2.0 * a)
    };
    let (right, sound) = error(&mixed(0.0));
    assert!(right < 1e-12 && sound > 0.5, "{right} {sound}");
    // The distance is w / 8: beyond doubt, and suspicious.
    let (plain, p) = error(&|p| p);
    assert!(p < 1e-15 && plain > 1e3 * right, "{plain} {p}");
    let (suspicious, p) = error(&mixed(0.5));
    assert!((1e-9..1e-4).contains(&p), "{p}");
    assert!(plain > 2.0 * suspicious && suspicious > 1e3 * right, "{plain} {suspicious}");
}

/// Who only counts failures, and has one that no integral can take back, needs no doubts.
#[test]
fn failures_without_doubt() {
    let error = |outside: bool| {
        let point = move |x: f64| if outside && x < 0.01 { 1.5 } else { x };
        let sample = move |xi: &[f64]| Some(Sample { point: point(xi[0]), density: rising(point(xi[0])) });
        let told = Told::new(Interval::new(0.0, 1.0), sample, |&x| rising(x));
        let others = checks().map(|(name, _)| name).filter(|name| !["support", "chi-square"].contains(name));
        let verify =
            others.fold(warpcheck::verify(&told).samples(20_000).undiagnosed(), |v, name| v.without(name));
        let examination = verify.examine();
        let fails = found(&examination, "support", "").evidence == Evidence::Certain(Verdict::Fail);
        assert_eq!(fails, outside);
        examination.integral.1
    };
    let (decided, doubted) = (error(true), error(false));
    assert!(decided < 1e-12 && doubted > 1e3 * decided, "{decided} {doubted}");
}

#[test]
fn all_cells_of_a_line() {
    let points = slightly_crowded(7 * 1024);
    let examination = on_a_line(&points);
    let n = points.len() as f64;
    let count = |range: &Range<f64>| points.iter().filter(|x| range.contains(x)).count() as u64;
    let mass = |range: &Range<f64>| below(range.end) - below(range.start);
    let scale = |target: f64| nodes(0.0, 1.0, 1.0 / 128.0, 1.0 / target);
    let scales: Vec<Vec<Range<f64>>> = [16.0, 48.0, 192.0].map(scale).into();
    assert_eq!(examination.scales, scales.iter().map(Vec::len).collect::<Vec<_>>());
    assert_eq!((scales[2].len(), examination.cells.len()), (128, 128));
    for (leaf, figure) in scales[2].iter().zip(&examination.cells) {
        assert_eq!((figure.observed, figure.samples), (count(leaf), points.len() as u64));
        assert_eq!((figure.cell.low[0], figure.cell.high[0]), (leaf.start, leaf.end));
        near(figure.expected, n * mass(leaf), 1e-9);
    }
    let mut worst_scale = 1.0_f64;
    for cells in &scales {
        let observed: Vec<u64> = cells.iter().map(count).collect();
        let expected: Vec<f64> = cells.iter().map(|c| n * mass(c)).collect();
        let (x2, df) = (pearson(&observed, &expected), cells.len() as f64 - 1.0);
        is_chi_square(found(&examination, "chi-square", &format!("{} cells", cells.len())), "X^2", x2, df);
        worst_scale = worst_scale.min(chi_square::sf(x2, df).unwrap());
        let part = format!("{} cells, G", cells.len());
        // The finest of those where every cell expects a hundred.
        let plenty = expected.iter().all(|&e| e >= 100.0) && cells.len() > 16;
        assert_eq!(examination.findings.iter().any(|f| f.part == part), plenty, "{part}");
        if plenty {
            is_chi_square(found(&examination, "chi-square", &part), "G", g(&observed, &expected), df);
        }
    }
    assert_eq!(examination.history.len(), 1);
    near(examination.history[0].p, 3.0 * worst_scale, 1e-3);
    // All nodes of the tree: half of the line, a quarter, … 1/128.
    let halves = (1..8).flat_map(|k| {
        (0..1 << k).map(move |i| f64::from(i) / f64::from(1 << k)..f64::from(i + 1) / f64::from(1 << k))
    });
    let weight = |mass: f64| 0.9 * mass / 7.0 + 0.1 / 254.0;
    let surprise = |o: f64, e: f64| 0.5 * (deviance(o, e) + deviance(n - o, n - e));
    let all: Vec<_> = halves
        .map(|cell| (surprise(count(&cell) as f64, n * mass(&cell)) + weight(mass(&cell)).ln(), cell))
        .collect();
    assert_eq!(all.len(), 254);
    let (_, cell) = all.iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    let (o, m) = (count(cell), mass(cell));
    let least = found(&examination, "chi-square", "least likely cell");
    assert!(least.detail.starts_with(&format!("{o} samples where {:.3} +-", n * m)), "{}", least.detail);
    assert!(
        least.detail.ends_with(&format!("at x {:.6}..{:.6}; the worst of 254 cells", cell.start, cell.end)),
        "{}",
        least.detail
    );
    near(p_of(least).0, binomial::two_sided(o, points.len() as u64, m).unwrap() / weight(m), 1e-4);
    // Windows about each leaf: the nearest ones, until they hold a 256th of the mass, a 128th, …, a quarter.
    let leaves = &scales[2];
    let middle = |leaf: usize| 0.5 * (leaves[leaf].start + leaves[leaf].end);
    let mut worst = (f64::NEG_INFINITY, 0, 0, 0.0, 0);
    for about in 0..128 {
        let mut order: Vec<usize> = (0..128).collect();
        order.sort_by(|&a, &b| {
            (middle(a) - middle(about)).abs().total_cmp(&(middle(b) - middle(about)).abs())
        });
        let (mut o, mut m, mut size) = (0, 0.0, 8);
        for leaf in order {
            (o, m) = (o + count(&leaves[leaf]), m + mass(&leaves[leaf]));
            while size >= 2 && m >= 0.5_f64.powi(size) {
                let surprise = surprise(o as f64, n * m);
                if n * m >= 50.0 && surprise > worst.0 {
                    worst = (surprise, about, size, m, o);
                }
                size -= 1;
            }
        }
    }
    let (_, about, size, m, o) = worst;
    let scan = found(&examination, "scan", "");
    let place =
        format!("about x {:.6}..{:.6}; the worst of 896 windows", leaves[about].start, leaves[about].end);
    assert!(scan.detail.ends_with(&format!("in 1/{} of the mass {place}", 1 << size)), "{}", scan.detail);
    near(p_of(scan).0, (binomial::two_sided(o, points.len() as u64, m).unwrap() * 896.0).min(1.0), 1e-4);
    // 5% of the mass in one piece: windows of 1/64 fit into it wherever it lies, and one of 1/32 covers most.
    let needed = normal::isf(0.5e-4 / 896.0).unwrap() + 2.33;
    let sees = [(128.0, 1.0), (64.0, 1.0), (32.0, 0.85)].map(|(parts, inside): (f64, f64)| {
        needed * (1.0 - 1.0 / parts).sqrt() * 0.95 / ((inside - 0.05) * (n / parts).sqrt())
    });
    let sees = sees.into_iter().fold(f64::INFINITY, f64::min);
    assert_eq!(
        scan.sees,
        format!("a relative error of {:.2}% over 5% of the mass in one piece", 100.0 * sees)
    );
    // The distribution function at the borders of leaves.
    let share = |x: f64| points.iter().filter(|&&p| p < x).count() as f64 / n;
    let largest = leaves.iter().map(|l| (share(l.end) - below(l.end)).abs()).fold(0.0, f64::max);
    assert_eq!(
        found(&examination, "distribution", "Rosenblatt, KS").detail,
        format!("D = {largest:.2e}, 129 groups")
    );
    assert!(examination.findings.iter().all(|f| f.part != "axis 0, KS"));
    // Fewer than sixteen pieces are no place to look for windows.
    let few = on_a_line(&points[..7 * 64]);
    assert!(few.scales == [8] && few.findings.iter().all(|f| f.check != "scan"));
    assert!(on_a_line(&points[..7 * 128]).findings.iter().any(|f| f.check == "scan"));
}

/// The mean of 1 / density over a cell is its measure, where that expects a thousand samples.
#[test]
fn means_of_inverse_densities() {
    let points = slightly_crowded(7 * 4096);
    let examination = on_a_line(&points);
    let n = points.len() as f64;
    let [coarse, fine] = [16.0, 48.0].map(|target| nodes(0.0, 1.0, 1.0 / 512.0, 1.0 / target));
    let mass = |cell: &Range<f64>| below(cell.end) - below(cell.start);
    let (mut worst, mut share, mut error, mut asked) = ((1.0, 0.0, 0.0..0.0), 0.0, 0.0_f64, 0);
    for (i, cell) in coarse.iter().chain(&fine).enumerate() {
        if n * mass(cell) < 1000.0 {
            continue;
        }
        asked += 1;
        let inside: Vec<f64> = points.iter().filter(|x| cell.contains(x)).map(|&x| 1.0 / rising(x)).collect();
        let moment = |power: i32| inside.iter().map(|w| w.powi(power)).sum::<f64>() / n;
        let (mean, measure) = (moment(1), cell.end - cell.start);
        let variance = moment(2) - mean * mean;
        let deviation = (variance / n).sqrt();
        // The largest weight is looked for at 2% of the leftmost leaf, and the skewness is at least half of what it allows.
        let limit = 1.5 / rising(cell.start + 0.02 / 512.0);
        let square = measure * measure / mass(cell);
        let most = limit.powi(3) * mass(cell) / (square.powf(1.5) * n.sqrt());
        let skewness =
            (moment(3) - 3.0 * mean * moment(2) + 2.0 * mean.powi(3)).abs() / (variance.powf(1.5) * n.sqrt());
        let z = ((mean - measure).abs() - 1e-6 * measure) / deviation;
        let p = 2.0 * normal::sf(z) * (skewness.max(0.5 * most) * z.min(8.0).powi(3) / 3.0).exp();
        if p < worst.0 {
            worst = (p, mean / measure, cell.clone());
        }
        if i < coarse.len() {
            share += inside.len() as f64 / n;
            error = error.max(deviation / measure);
        }
    }
    let finding = found(&examination, "weights", "1 / density");
    let (p, ratio, cell) = worst;
    let of = coarse.len() + fine.len();
    let place = format!("x {:.6}..{:.6}", cell.start, cell.end);
    assert!(asked > 10 && asked < of);
    assert_eq!(
        finding.detail,
        format!(
            "mean of 1 / density against the measure of {asked} of {of} cells; the worst is {ratio:.5} times it, at {place}"
        )
    );
    near(p_of(finding).0, (p * asked as f64).min(1.0), 1e-6);
    let power = finding.power.unwrap();
    near(power.error, 7.0 * error, 1e-9);
    near(power.mass, share, 1e-12);
    assert_eq!(
        finding.sees,
        format!("a relative error of {:.1}% in any of {:.0}% of the mass", 700.0 * error, 100.0 * share)
    );
    // Of so few samples no cell expects a thousand.
    let few = on_a_line(&points[..7 * 1024]);
    let finding = found(&few, "weights", "1 / density");
    assert_eq!(finding.evidence, Evidence::Unanswered);
    let of =
        [16.0, 48.0].map(|target| nodes(0.0, 1.0, 1.0 / 128.0, 1.0 / target).len()).iter().sum::<usize>();
    let said =
        format!("the weights of all {of} cells have tails too heavy for 7168 samples (it takes about ");
    assert!(finding.detail.starts_with(&said), "{}", finding.detail);
}

/// Where the density is 0 here and there a sliver of its support may be missed: N pilots all miss a place of more than 8 / N with probability e^-8.
#[test]
fn slivers_that_no_pilot_met() {
    let integral = |end: f64| {
        let numbers: Vec<f64> = shuffled((0..8000).map(|i| end * (f64::from(i) + 0.5) / 8000.0).collect());
        let row = |n: &[f64]| Row { point: Some(n[0]), density: None, weight: None };
        let knots = warpcheck::domain::Knots { axes: [vec![0.75], vec![]] };
        recording(Interval::new(0.0, 1.0), Given::new(1, numbers), row)
            .unwrap()
            .knots(knots)
            .density(move |&x| if x < end { 1.0 / end } else { 0.0 })
            .examine(&Settings { diagnose: false, ..Settings::default() })
            .unwrap()
            .integral
    };
    // A thousand are pilots.
    let (value, error) = integral(0.75);
    near(value, 1.0, 1e-9);
    near(error, 8.0 / 1000.0, 1e-6);
    assert!(integral(1.0).1 < 1e-9);
}

/// Of a thousand more samples than a look takes, and so on: each time that there are twice as many.
#[test]
fn looks_at_what_came_so_far() {
    let masses = [0.1, 0.2, 0.3, 0.4];
    let total: usize = 7 * 12_000;
    let pilots =
        shuffled((0..total / 7).map(|i| [0, 1, 1, 2, 2, 2, 3, 3, 3, 3][i % 10]).collect::<Vec<usize>>());
    let mut rng = stream(13, "looks", 0);
    let judged: Vec<usize> = (0..total)
        .map(|_| unit_f64(&mut rng))
        .map(|u| [0.101, 0.3, 0.6, 2.0].iter().position(|&c| u < c).unwrap())
        .collect();
    let rows = Given::new(1, pilots.into_iter().chain(judged.iter().copied()).map(|i| i as f64).collect());
    let row = |numbers: &[f64]| Row { point: Some(numbers[0] as usize), density: None, weight: None };
    let examination = recording(Discrete::new(4), rows, row)
        .unwrap()
        .density(|&i| masses[i])
        .examine(&Settings::default())
        .unwrap();
    let p = |n: usize| {
        let counts: Vec<u64> =
            (0..4).map(|i| judged[..n].iter().filter(|&&j| j == i).count() as u64).collect();
        chi_square::sf(pearson(&counts, &masses.map(|m| m * n as f64)), 3.0).unwrap()
    };
    assert_eq!(
        examination.history.iter().map(|l| l.samples).collect::<Vec<_>>(),
        [16_384, 32_768, 65_536, 84_000]
    );
    for look in &examination.history {
        near(look.p, p(look.samples as usize), 1e-3);
    }
    // All shards are full: the last look is the last shard.
    let rows = Given::new(1, (0..18_725 * 2).map(|i| f64::from(i % 2)).collect());
    let row = |numbers: &[f64]| Row { point: Some(numbers[0] as usize), density: None, weight: None };
    let settings = Settings { samples: 32_768, ..Settings::default() };
    let examination =
        recording(Discrete::new(2), rows, row).unwrap().density(|_| 0.5).examine(&settings).unwrap();
    assert_eq!(examination.history.iter().map(|l| l.samples).collect::<Vec<_>>(), [16_384, 32_768]);
}

/// Twenty lines across each axis, at quantiles of the pilots.
#[test]
fn marginals_of_a_square() {
    const PILOTS: usize = 1280;
    let golden = |i: usize, by: f64| (i as f64 * by).fract();
    let pilots: Vec<[f64; 2]> =
        (0..PILOTS).map(|i| [golden(i, 0.754_877_666), golden(i, 0.569_840_29)]).collect();
    let mut rng = stream(14, "marginals", 0);
    let mut next = || unit_f64(&mut rng);
    let judged: Vec<[f64; 2]> = (0..7 * PILOTS).map(|_| [next().powf(1.01), next()]).collect();
    let rows = Given::new(2, pilots.iter().chain(&judged).flatten().copied().collect());
    let row = |numbers: &[f64]| Row {
        point: Some(glam::DVec2::new(numbers[0], numbers[1])),
        density: None,
        weight: None,
    };
    let examination = recording(Square, rows, row)
        .unwrap()
        .density(|_| 1.0)
        .examine(&Settings { diagnose: false, ..Settings::default() })
        .unwrap();
    for axis in 0..2 {
        let mut along: Vec<f64> = pilots.iter().map(|p| p[axis]).collect();
        along.sort_by(f64::total_cmp);
        let lines: Vec<f64> = (1..=20).map(|i| along[i * PILOTS / 21]).collect();
        let borders = [&[0.0], &lines[..], &[1.0]].concat();
        let masses: Vec<f64> = borders.windows(2).map(|b| b[1] - b[0]).chain([0.0]).collect();
        let count = |b: &[f64]| judged.iter().filter(|p| b[0] <= p[axis] && p[axis] < b[1]).count() as u64;
        let counts: Vec<u64> = borders.windows(2).map(count).chain([0]).collect();
        let finding = found(&examination, "distribution", &format!("axis {axis}, KS"));
        let figure = kolmogorov::grouped(&counts, &masses, 1e-6).unwrap();
        assert_eq!(finding.detail, format!("D = {:.2e}, 22 groups", figure.statistic));
        near(p_of(finding).0, figure.p, 1e-4);
    }
    assert_eq!(examination.findings.iter().filter(|f| f.part.starts_with("axis")).count(), 2);
}
