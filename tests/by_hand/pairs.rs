//! Two samples side by side, with counts that were chosen.

use super::*;
use glam::{DVec2, DVec3};
use std::sync::atomic::{AtomicU64, Ordering};
use warpcheck::domain::{Discrete, Interval, Knots, MeshSurface, Square, SurfacePoint};
use warpcheck::random::fill_unit;
use warpcheck::sampler::from_draws;
use warpcheck::statistics::{binomial, chi_square, kolmogorov};
use warpcheck::verify::{
    Against, Report, Row, Samples, Settings, Verdict, compare, compare_recordings, compare_samples, recording,
};

/// Entries with these counts after each eighth was taken away as a pilot; pilots go through all entries in turn.
fn chosen(counts: &[u64]) -> Vec<usize> {
    let judged =
        shuffled(counts.iter().enumerate().flat_map(|(i, &n)| vec![i; n as usize]).collect::<Vec<_>>());
    let turns = judged.chunks(7).enumerate();
    turns.flat_map(|(i, seven)| [&[i % counts.len()][..], seven].concat()).collect()
}

fn compared(first: &[u64], second: &[u64], rejected: [u64; 2]) -> Examination {
    let samples = |counts: &[u64], rejected| {
        Samples::new(Discrete::new(counts.len()), chosen(counts)).unwrap().rejected(rejected)
    };
    compare_samples(&samples(first, rejected[0]), &samples(second, rejected[1])).names("a", "b").examine()
}

#[track_caller]
fn is_chi_square(finding: &Finding, name: &str, figure: chi_square::Figure) {
    assert_eq!(
        finding.detail,
        format!("{name} = {:.1} at {} degrees of freedom", figure.statistic, figure.df)
    );
    near(p_of(finding).0, figure.p, 1e-9);
}

#[test]
fn four_entries_of_two() {
    let (first, second) = ([400, 300, 350, 350], [175, 175, 180, 170]);
    let examination = compared(&first, &second, [0, 0]);
    // 1400 and 700: the first should have two thirds of each.
    let x2: f64 = first
        .iter()
        .zip(second)
        .map(|(&a, b)| (a as f64 - 2.0 * b as f64).powi(2) / (2 * (a + b)) as f64)
        .sum();
    let finding = found(&examination, "two-sample", "4 cells");
    assert_eq!(finding.detail, format!("X^2 = {x2:.1} at 3 degrees of freedom"));
    near(p_of(finding).0, chi_square::sf(x2, 3.0).unwrap(), 1e-9);
    is_chi_square(
        found(&examination, "two-sample", "4 cells, G"),
        "G",
        chi_square::two_sample_g(&first, &second).unwrap(),
    );
    let least = found(&examination, "two-sample", "least likely node");
    assert_eq!(
        least.detail,
        "300 and 175 samples (exact binomial, given their sum), at index 1; the worst of 7 nodes"
    );
    near(p_of(least).0, (7.0 * binomial::two_sided(300, 475, 2.0 / 3.0).unwrap()).min(1.0), 1e-9);
    assert_eq!(examination.findings.len(), 3);
    assert_eq!(
        (examination.samples, examination.against, examination.name.as_str()),
        (1400, Against::Points(700), "a against b")
    );
    assert_eq!((examination.scales.as_slice(), examination.rejected), (&[4][..], 0));
    let figures: Vec<_> =
        examination.cells.iter().map(|c| (c.place.as_str(), c.observed, c.samples, c.others)).collect();
    assert_eq!(figures[1], ("index 1", 300, 1400, 700));
    near(examination.cells[1].expected, 475.0 * 2.0 / 3.0, 1e-12);
    assert!(examination.elsewhere.is_empty());
    near(examination.map(1).observed[1], 300.0 / 1400.0, 1e-12);
    // An error far beyond chance.
    let least = compared(&[700, 0, 350, 350], &[175; 4], [0, 0]);
    let least = found(&least, "two-sample", "least likely node");
    near(p_of(least).0, 7.0 * binomial::two_sided(0, 175, 2.0 / 3.0).unwrap(), 1e-9);
    // Two neighbours that are off alike are less likely together: 950 samples of both of them.
    let halves = compared(&[400, 400, 300, 300], &[175; 4], [0, 0]);
    let least = found(&halves, "two-sample", "least likely node");
    assert_eq!(
        least.detail,
        "600 and 350 samples (exact binomial, given their sum), at indices 2..=3; the worst of 7 nodes"
    );
    near(p_of(least).0, 7.0 * binomial::two_sided(600, 950, 2.0 / 3.0).unwrap(), 1e-9);
    // All of both in one entry: there is no other node that has any.
    let one = compared(&[1400, 0], &[700, 0], [0, 0]);
    assert!(
        one.findings
            .iter()
            .all(|f| f.part != "least likely node" || f.detail.ends_with("the worst of 2 nodes"))
    );
}

#[test]
fn what_is_a_cell_of_two() {
    // Of 1400 and 700 a cell must hold 24, so that the smaller one expects 8 of them; G wants 300 each.
    let has = |pair: (u64, u64), part: &str| {
        let examination = compared(&[700, 700 - pair.0, pair.0], &[350, 350 - pair.1, pair.1], [0, 0]);
        examination.findings.iter().any(|f| f.part == part)
    };
    assert!(has((16, 8), "3 cells") && !has((16, 7), "3 cells") && has((16, 7), "2 cells"));
    assert!(has((200, 100), "3 cells, G") && !has((200, 99), "3 cells, G"));
    let examination = compared(&[700, 684, 16], &[350, 343, 7], [0, 0]);
    let pool = found(&examination, "two-sample", "pool of light cells");
    assert_eq!(pool.detail, "16 and 7 samples (exact binomial, given their sum)");
    near(p_of(pool).0, binomial::two_sided(16, 23, 2.0 / 3.0).unwrap(), 1e-9);
    let places: Vec<_> = examination.elsewhere.iter().map(|c| (c.place.as_str(), c.observed)).collect();
    assert_eq!(places, [("the pool of light cells", 16)]);
    near(examination.elsewhere[0].expected, 23.0 * 2.0 / 3.0, 1e-9);
    // Two light entries apart from each other are a pool that is a cell.
    let examination = compared(&[16, 684, 684, 16], &[7, 343, 343, 7], [0, 0]);
    is_chi_square(
        found(&examination, "two-sample", "3 cells"),
        "X^2",
        chi_square::two_sample(&[684, 684, 32], &[343, 343, 14]).unwrap(),
    );
    assert!(examination.findings.iter().all(|f| f.part != "pool of light cells"));
    // Rejected ones are, too.
    let examination = compared(&[700, 630], &[350, 343], [70, 7]);
    is_chi_square(
        found(&examination, "two-sample", "3 cells"),
        "X^2",
        chi_square::two_sample(&[700, 630, 70], &[350, 343, 7]).unwrap(),
    );
    assert_eq!((examination.samples, examination.rejected), (1400, 70));
    assert_eq!(
        (
            examination.elsewhere[0].place.as_str(),
            examination.elsewhere[0].observed,
            examination.elsewhere.len()
        ),
        ("rejected", 70, 1)
    );
    let few = compared(&[700, 693], &[350, 350], [7, 0]);
    let rejected = found(&few, "two-sample", "rejected");
    assert_eq!(rejected.detail, "7 and 0 samples (exact binomial, given their sum)");
    near(p_of(rejected).0, binomial::two_sided(7, 7, 2.0 / 3.0).unwrap(), 1e-2);
    assert!(few.findings.iter().any(|f| f.part == "2 cells"));
}

#[test]
fn two_that_can_not_be_compared() {
    let said = |examination: &Examination, part: &str, verdict: Verdict| {
        let finding = found(examination, "two-sample", part);
        is_certain(finding, verdict);
        finding.detail.clone()
    };
    let none = compared(&[0; 2], &[70, 70], [0, 0]);
    assert_eq!(said(&none, "", Verdict::Inconclusive), "a has no samples to judge");
    let none = compared(&[70, 70], &[0; 2], [0, 0]);
    assert_eq!(said(&none, "", Verdict::Inconclusive), "b has no samples to judge");
    assert_eq!((none.findings.len(), none.cells.len(), none.samples), (1, 0, 140));
    let few = compared(&[7, 7], &[7, 7], [0, 0]);
    assert_eq!(
        said(&few, "", Verdict::Inconclusive),
        "14 and 14 samples are too few: no two cells expect 8 of each"
    );
    let one = compared(&[700], &[700], [0, 0]);
    assert_eq!(said(&one, "", Verdict::Pass), "there is only one entry to choose");
    assert_eq!(one.findings.len(), 1);
    let nothing = compared(&[0, 0], &[0, 0], [100, 70]);
    assert_eq!(
        said(&nothing, "", Verdict::Inconclusive),
        "both reject every sample: there is nothing to compare"
    );
    // Counts that are the same are no two samples.
    let same = compared(&[400, 300, 350, 350], &[400, 300, 350, 350], [0, 0]);
    assert_eq!(
        said(&same, "independence", Verdict::Inconclusive),
        "the counts of 4 cells agree better than chance allows (p < 1e-300 of agreeing so well): the two are not drawn independently, so nothing can be said"
    );
    let other = compared(&[400, 300, 350, 350], &[401, 301, 349, 349], [0, 0]);
    assert!(other.findings.iter().all(|f| f.part != "independence"));
    let sizes = |first: usize, second: usize| {
        let of = |n: usize| Samples::new(Discrete::new(n), vec![0_usize; 80]).unwrap();
        let (a, b) = (of(first), of(second));
        compare_samples(&a, &b).examine()
    };
    let differ = sizes(3, 4);
    assert_eq!(
        said(&differ, "", Verdict::Fail),
        "the domains differ: discrete of 3 patches and measure 3, and discrete of 4 patches and measure 4"
    );
    assert_eq!((differ.against, differ.samples), (Against::Points(80), 0));
    let line = |end: f64| Samples::new(Interval::new(0.0, end), vec![0.5; 80]).unwrap();
    assert_eq!(
        compare_samples(&line(1.0), &line(2.0)).examine().findings[0].evidence,
        Evidence::Certain(Verdict::Fail)
    );
    let real = || Samples::new(Interval::real_line(), vec![0.5; 80]).unwrap();
    assert!(
        compare_samples(&real(), &real()).examine().findings.iter().all(|f| !f.detail.contains("differ"))
    );
    let out = Samples::new(Square, vec![[0.5, 0.5], [0.5, 2.0]]).unwrap_err();
    assert_eq!(out.to_string(), "point 1, (0.500, 2.000), is [0.5, 2], outside of the unit square");
    let empty = Samples::new(Square, Vec::<[f64; 2]>::new()).unwrap();
    assert!(empty.is_empty() && !line(1.0).is_empty() && line(1.0).len() == 80);
}

#[test]
fn an_order_of_two() {
    // From the 17th entry on there is an order to speak of.
    let spread = |n: u64, more: u64| (0..17).map(|i| n + if i < 5 { more } else { 0 }).collect::<Vec<u64>>();
    let judge = |first: &[u64], second: &[u64]| {
        let examination = compared(first, second, [0, 0]);
        let (n, m) = (first.iter().sum::<u64>(), second.iter().sum::<u64>());
        let below =
            |counts: &[u64], total: u64, i: usize| counts[..=i].iter().sum::<u64>() as f64 / total as f64;
        let d = (0..17).map(|i| (below(first, n, i) - below(second, m, i)).abs()).fold(0.0, f64::max);
        let finding = found(&examination, "two-sample", "KS");
        assert_eq!(finding.detail, format!("D = {d:.2e} in the order of 17 cells"));
        // Small samples have an exact distribution, large ones that of one sample of their harmonic size.
        let exact = n.min(m) <= 2000 && n.max(m) <= 8000;
        let size = (n as f64 * m as f64 / (n + m) as f64).round() as u64;
        let p = if exact { kolmogorov::two_sample_sf(d, n, m) } else { kolmogorov::sf(d, size) };
        near(p_of(finding).0, p.unwrap(), 1e-9);
    };
    judge(&spread(70, 14), &spread(70, 0));
    judge(&spread(70, 0), &spread(210, 21));
    judge(&spread(119, 0), &spread(119, 7));
    judge(&spread(70, 0), &spread(490, 21));
    // An entry is a cell, of however few pilots.
    let hundred = compared(&[14; 100], &[7; 100], [0, 0]);
    assert!(found(&hundred, "two-sample", "KS").detail.ends_with(" in the order of 100 cells"));
    assert!(
        found(&hundred, "two-sample", "least likely node").detail.ends_with("; the worst of 199 nodes"),
        "{:?}",
        hundred.findings
    );
    let sixteen = compared(&[70; 16], &[77; 16], [0, 0]);
    assert!(sixteen.findings.iter().all(|f| f.part != "KS"));
    // Entries of one remainder, from 1024 of them on.
    let many = |n: usize| {
        let counts = |of: &dyn Fn(usize) -> u64| (0..n).map(of).collect::<Vec<u64>>();
        let (first, second) = (counts(&|i| 7 + u64::from(i % 64 == 3)), counts(&|_| 7));
        (compared(&first, &second, [0, 0]), first, second)
    };
    let (examination, first, second) = many(1024);
    for modulus in [64, 61] {
        let classes = |counts: &[u64]| {
            (0..modulus).map(|r| counts.iter().skip(r).step_by(modulus).sum()).collect::<Vec<u64>>()
        };
        let figure = chi_square::two_sample(&classes(&first), &classes(&second)).unwrap();
        is_chi_square(found(&examination, "two-sample", &format!("index modulo {modulus}")), "X^2", figure);
    }
    assert!(many(1023).0.findings.iter().all(|f| !f.part.starts_with("index")));
    // Remainders that nobody has are no hindrance, some that both have few of are.
    let even = |few: u64| {
        (0..1024)
            .map(|i| {
                if i % 2 == 0 {
                    14
                } else if i == 1 {
                    few
                } else {
                    0
                }
            })
            .collect::<Vec<u64>>()
    };
    let has = |first: u64, second: u64| {
        compared(&even(first), &even(second), [0, 0]).findings.iter().any(|f| f.part == "index modulo 64")
    };
    assert!(has(0, 0) && !has(7, 7) && has(8, 8) && !has(7, 0) && !has(0, 7));
}

#[test]
fn an_order_of_places() {
    // Of 16 pilots, 8 to a leaf, a line has two leaves; of 8 it has one, and no order.
    let compared = |count: usize| {
        let points = |shift: f64| {
            let places = (0..count).map(|i| ((i as f64 + shift) * 0.618_034).fract()).collect::<Vec<_>>();
            Samples::new(Interval::new(0.0, 1.0), places).unwrap()
        };
        let (a, b) = (points(0.0), points(0.5));
        compare_samples(&a, &b).examine()
    };
    let two = compared(64);
    assert!(found(&two, "two-sample", "KS").detail.ends_with(" in the order of 2 cells"));
    assert!(compared(32).findings.iter().all(|f| f.part != "KS"));
    // Triangles of a mesh are places, and have no remainders that tell anything.
    let on_a_mesh = |shift: usize| {
        let point = |i: usize| SurfacePoint { triangle: i % 1024, barycentric: DVec3::splat(1.0 / 3.0) };
        let points: Vec<_> = (shift..shift + 4096).map(point).collect();
        Samples::new(MeshSurface::from_areas(vec![1.0; 1024]), points).unwrap()
    };
    let (a, b) = (on_a_mesh(0), on_a_mesh(7));
    let meshes = compare_samples(&a, &b).examine();
    assert!(meshes.findings.iter().all(|f| !f.part.starts_with("index")), "{:?}", meshes.findings);
}

/// Drawn again here: the same variates, in shards of 2^14.
#[test]
fn samplers_are_drawn_from_streams_of_their_own() {
    const SAMPLES: u64 = 20_000;
    let entry =
        |xi: f64, shift: f64| if xi < 0.1 { None } else { Some(((xi - 0.1) / 0.9 * 3.0 + shift) as usize) };
    let first = from_draws(Discrete::new(3), move |xi: f64| entry(xi, 0.0));
    let second = from_draws(Discrete::new(3), move |xi: f64| entry(xi, 0.02).map(|i| i.min(2)));
    let counts = |purpose: &str, shift: f64| {
        let mut counts = [0; 4];
        for (shard, count) in [(0, 16_384), (1, SAMPLES as usize - 16_384)] {
            let mut xi = vec![0.0; count];
            fill_unit(&mut stream(4, purpose, shard), &mut xi);
            xi.into_iter().for_each(|xi| counts[entry(xi, shift).map_or(3, |i| i.min(2))] += 1);
        }
        counts
    };
    let examination = compare(&first, &second).names("a", "b").samples(SAMPLES).seed(4).examine();
    let (a, b) = (counts("compare, the first", 0.0), counts("compare, the second", 0.02));
    assert_eq!(examination.cells.iter().map(|c| c.observed).collect::<Vec<_>>(), a[..3]);
    assert_eq!(
        (examination.rejected, examination.against, examination.samples),
        (a[3], Against::Sampler(SAMPLES), SAMPLES)
    );
    near(examination.cells[0].expected, (a[0] + b[0]) as f64 / 2.0, 1e-12);
    is_chi_square(
        found(&examination, "two-sample", "4 cells"),
        "X^2",
        chi_square::two_sample(&a, &b).unwrap(),
    );
    // Points outside are counted, and are in no table.
    let outside = from_draws(Square, |[u, v]: [f64; 2]| DVec2::new(u + if v < 0.25 { 1.0 } else { 0.0 }, v));
    let square = from_draws(Square, |[u, v]: [f64; 2]| DVec2::new(u, v));
    let examination = compare(&square, &outside).names("a", "b").samples(SAMPLES).examine();
    let mut xi = vec![0.0; 2 * 16_384];
    fill_unit(&mut stream(1, "compare, the second", 0), &mut xi);
    let mut all = xi.as_chunks::<2>().0.to_vec();
    let mut xi = vec![0.0; 2 * (SAMPLES as usize - 16_384)];
    fill_unit(&mut stream(1, "compare, the second", 1), &mut xi);
    all.extend(xi.as_chunks::<2>().0);
    let out: Vec<_> = all.iter().filter(|xi| xi[1] < 0.25).collect();
    let finding = found(&examination, "support", "");
    is_certain(finding, Verdict::Fail);
    let [u, v] = *out[0];
    let first = format!(
        "xi = {:?} gives ({:.3}, {v:.3}), which is [{}, {v}], outside of the unit square",
        out[0],
        u + 1.0,
        u + 1.0
    );
    assert_eq!(
        finding.detail,
        format!("{} samples of b lie outside of the domain; the first: {first}", out.len())
    );
    assert_eq!(examination.against, Against::Sampler(SAMPLES - out.len() as u64));
    // With 2^12 pilots of each, 8 to a leaf, a square has as many cells as the samples allow: no more than 1024 below 100 samples each.
    let square_again = from_draws(Square, |[u, v]: [f64; 2]| DVec2::new(v, u));
    let examination = compare(&square, &square_again).samples(SAMPLES).examine();
    assert_eq!(examination.scales.len(), 3);
    assert!(examination.scales[2] > 900 && examination.scales[2] < 2048, "{:?}", examination.scales);
    let counted = examination.cells.iter().chain(&examination.elsewhere).map(|c| c.observed).sum::<u64>();
    assert_eq!(counted, SAMPLES);
}

/// A sampler of the line whose density may jump at a third.
struct Jumps;

impl Sampler for Jumps {
    type Domain = Interval;
    fn domain(&self) -> Interval {
        Interval::new(0.0, 1.0)
    }
    fn dimensions(&self) -> usize {
        1
    }
    fn sample(&self, xi: &[f64]) -> Option<Sample<f64>> {
        Some(Sample { point: xi[0], density: 1.0 })
    }
    fn density(&self, _: &f64) -> f64 {
        1.0
    }
    fn knots(&self) -> Knots {
        Knots { axes: [vec![1.0 / 3.0], vec![]] }
    }
}

/// Where either says that its density jumps, cells are cut.
#[test]
fn cells_of_two_end_at_knots() {
    let plain = from_draws(Interval::new(0.0, 1.0), |xi: f64| xi);
    let is_cut = |examination: Examination| {
        assert!(examination.cells.len() > 8);
        examination.cells.iter().any(|figure| figure.cell.high[0] == 1.0 / 3.0)
    };
    assert!(is_cut(compare(&plain, &Jumps).samples(2000).examine()));
    assert!(is_cut(compare(&Jumps, &plain).samples(2000).examine()));
    assert!(!is_cut(compare(&plain, &plain).samples(2000).examine()));
}

/// One in 64 of many samples, by which cells are cut, beside those that are judged.
#[test]
fn pilots_of_two_samplers() {
    const SAMPLES: u64 = 64 * 4608;
    let asked = AtomicU64::new(0);
    let counted = from_draws(Discrete::new(2), |xi: f64| {
        asked.fetch_add(1, Ordering::Relaxed);
        usize::from(xi < 0.5)
    });
    let plain = from_draws(Discrete::new(2), |xi: f64| usize::from(xi < 0.5));
    compare(&counted, &plain).samples(SAMPLES).examine();
    assert_eq!(asked.into_inner(), SAMPLES + 4608);
}

/// Of few samples too the coarse cells are compared, and those as fine as their counts allow.
#[test]
fn scales_of_few_samples() {
    let examination = compared(&[14; 64], &[14; 64], [0, 0]);
    assert_eq!(examination.scales, [16, 64]);
}

/// As files of points are compared: the first eighth are pilots, the rest is judged as it comes.
#[test]
fn recordings_are_compared_row_by_row() {
    let rows = |counts: &[u64], at_once: usize| {
        let all: u64 = counts.iter().sum();
        // None of them is outside, where pilots would be seen too.
        let pilots = (0..all as usize / 7).map(|i| i % counts.len().min(4));
        let judged =
            shuffled(counts.iter().enumerate().flat_map(|(i, &n)| vec![i; n as usize]).collect::<Vec<_>>());
        Given {
            at_once,
            counted: at_once.is_multiple_of(2),
            ..Given::new(1, pilots.chain(judged).map(|i| i as f64).collect())
        }
    };
    // Entry 3 is a sample that was rejected, and 4 one outside of three entries.
    let entry = |numbers: &[f64]| Row {
        point: (numbers[0] != 3.0).then_some(numbers[0] as usize),
        density: None,
        weight: None,
    };
    let a = recording(Discrete::new(3), rows(&[400, 300, 350, 350, 0], 1000), entry).unwrap().name("a");
    let b = recording(Discrete::new(3), rows(&[170, 180, 175, 140, 35], 77), entry).unwrap().name("b");
    let examination = compare_recordings(&a, &b, &Settings::default()).unwrap();
    is_chi_square(
        found(&examination, "two-sample", "4 cells"),
        "X^2",
        chi_square::two_sample(&[400, 300, 350, 350], &[170, 180, 175, 140]).unwrap(),
    );
    assert_eq!(
        (examination.samples, examination.against, examination.rejected),
        (1400, Against::Points(665), 350)
    );
    assert_eq!(examination.cells.iter().map(|c| c.observed).collect::<Vec<_>>(), [400, 300, 350]);
    let outside = found(&examination, "support", "");
    assert!(
        outside.detail.starts_with("35 samples of b lie outside of the domain; the first: row "),
        "{}",
        outside.detail
    );
    assert!(outside.detail.ends_with(": 4 is index 4 of 3 entries"), "{}", outside.detail);
    assert_eq!(Report::new(vec![examination], &Settings::default()).verdict(), Verdict::Fail);
    // Rows of different domains; fewer samples than there are.
    let c = recording(Discrete::new(4), rows(&[70, 70, 70], 64), entry).unwrap();
    assert!(
        compare_recordings(&a, &c, &Settings::default()).unwrap().findings[0]
            .detail
            .starts_with("the domains differ")
    );
    let some = |counts: &[u64]| recording(Discrete::new(3), rows(counts, 64), entry).unwrap();
    // More rows than are counted at once.
    let many = recording(Discrete::new(3), rows(&[15_000, 12_000, 8_000, 7_000, 0], 10_000), entry).unwrap();
    let examination = compare_recordings(&many, &some(&[400, 300, 350]), &Settings::default()).unwrap();
    assert_eq!(examination.cells.iter().map(|c| c.observed).collect::<Vec<_>>(), [15_000, 12_000, 8_000]);
    assert_eq!((examination.samples, examination.rejected), (42_000, 7_000));
    // More than are read at once, and not more of them than are asked for.
    let alternating = (0..(1 << 20) + 40_000).map(|i| f64::from(i % 2)).collect();
    let many = recording(Discrete::new(3), Given::new(1, alternating), entry).unwrap();
    let settings = Settings { samples: (1 << 20) + 10, ..Settings::default() };
    let examination = compare_recordings(&many, &some(&[400, 300, 350]), &settings).unwrap();
    assert_eq!(examination.samples, settings.samples);
    let settings = Settings { samples: 500, ..Settings::default() };
    let examination = compare_recordings(&some(&[400, 300, 350]), &some(&[70, 140, 70]), &settings).unwrap();
    assert_eq!((examination.samples, examination.against), (500, Against::Points(280)));
}
