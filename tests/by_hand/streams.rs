//! Streams: tables of classes counted here, equal points and runs that were put there.

use super::*;
use warpcheck::domain::{Discrete, Interval, Mixed, WithAtoms};
use warpcheck::random::{stream, unit_f64};
use warpcheck::statistics::normal;
use warpcheck::verify::{Against, Verdict, streams};

/// Entries with these cumulative probabilities.
fn entries(number: u64, count: usize, cumulative: &[f64]) -> Vec<usize> {
    let mut rng = stream(5, "entries", number);
    (0..count).map(|_| unit_f64(&mut rng)).map(|u| cumulative.iter().filter(|&&c| c <= u).count()).collect()
}

/// X^2 of the pairs of classes, and its degrees of freedom.
fn independence(pairs: impl Iterator<Item = (usize, usize)>, classes: usize) -> (f64, usize) {
    let mut counts = vec![vec![0.0; classes]; classes];
    pairs.for_each(|(a, b)| counts[a][b] += 1.0);
    let rows: Vec<f64> = counts.iter().map(|row| row.iter().sum()).collect();
    let columns: Vec<f64> = (0..classes).map(|c| counts.iter().map(|row| row[c]).sum()).collect();
    let n: f64 = rows.iter().sum();
    let cell = |(r, c): (usize, usize)| {
        let expected = rows[r] * columns[c] / n;
        (counts[r][c] - expected).powi(2) / expected
    };
    let all = (0..classes).flat_map(|r| (0..classes).map(move |c| (r, c)));
    (all.map(cell).sum(), (classes - 1).pow(2))
}

#[track_caller]
fn has_table(
    examination: &Examination,
    part: &str,
    pairs: impl Iterator<Item = (usize, usize)>,
    classes: usize,
) {
    let (statistic, df) = independence(pairs, classes);
    let finding = found(examination, "streams", part);
    assert_eq!(
        finding.detail,
        format!("X^2 = {statistic:.1} at {df} degrees of freedom, {classes} classes"),
        "{part}"
    );
    if df == 1 {
        near(p_of(finding).0, 2.0 * normal::sf(statistic.sqrt()), 1e-9);
    }
}

/// Tables of all pairs of streams, where `class` says which entries are counted together.
fn are_tabled(cumulative: &[f64], lengths: &[usize], classes: usize, class: impl Fn(usize) -> usize) {
    let all: Vec<Vec<usize>> =
        lengths.iter().enumerate().map(|(i, &n)| entries(i as u64, n, cumulative)).collect();
    let examination = streams(Discrete::new(cumulative.len() + 1), &all).unwrap().examine();
    let classes_of = |s: usize, from: usize| all[s][from..].iter().map(|&i| class(i)).collect::<Vec<_>>();
    for i in 0..all.len() {
        let part = format!("stream {i}, consecutive points");
        has_table(&examination, &part, classes_of(i, 0).into_iter().zip(classes_of(i, 1)), classes);
        for j in i + 1..all.len() {
            for (how, a, b) in
                [("same place", 0, 0), ("the second a place ahead", 0, 1), ("the first a place ahead", 1, 0)]
            {
                let part = format!("streams {i} and {j}, {how}");
                has_table(&examination, &part, classes_of(i, a).into_iter().zip(classes_of(j, b)), classes);
            }
        }
    }
    let tables = examination.findings.iter().filter(|f| f.detail.contains("classes")).count();
    assert_eq!(tables, all.len() + 3 * all.len() * (all.len() - 1) / 2);
    assert_eq!(
        (examination.samples, examination.against),
        (lengths.iter().sum::<usize>() as u64, Against::Relations)
    );
}

#[test]
fn tables_of_classes_are_those_counted_here() {
    are_tabled(&[0.5], &[32, 40, 33], 2, |i| i);
    are_tabled(&[0.3, 0.6], &[300], 3, |i| i);
    // Entries 2 and 3 have 4%, too little even together, and go to the first class.
    are_tabled(&[0.48, 0.96, 0.98], &[200, 220], 2, |i| usize::from(i == 1));
    // Entries 0 and 2 have 9% each, which is too little for one but not for both: they are a class of their own.
    are_tabled(&[0.09, 0.54, 0.63], &[200, 210], 3, |i| [0, 1, 0, 2][i]);
    // Places of an interval, cut at quantiles: of 4 classes each holds a quarter or so, and is not to be told here.
    let points: Vec<Vec<f64>> = (0..2)
        .map(|s| (0..130).map(|i| (f64::from(i * 37 + 11 * s) * 0.618_034).fract()).collect())
        .collect();
    let examination = streams(Interval::new(0.0, 1.0), &points).unwrap().examine();
    assert!(
        found(&examination, "streams", "streams 0 and 1, same place")
            .detail
            .ends_with("at 9 degrees of freedom, 4 classes")
    );
    // Of 255 points each a cell weighs less than a quarter.
    let all: Vec<Vec<f64>> =
        (0..2).map(|s| (0..255).map(|i| (f64::from(2 * i + s) * 0.618_034).fract()).collect()).collect();
    let examination = streams(Interval::new(0.0, 1.0), &all).unwrap().examine();
    let detail = &found(&examination, "streams", "streams 0 and 1, same place").detail;
    let classes: usize = detail.split(' ').rev().nth(1).unwrap().parse().unwrap();
    assert!((5..=16).contains(&classes), "{detail}");
}

#[test]
fn how_many_streams_and_points_are_tabled() {
    // 32 points are enough for two classes, 31 are not.
    let halves = |n: usize| (0..n).map(|i| i / 2 % 2).collect::<Vec<_>>();
    let parts = |lengths: &[usize]| {
        let all: Vec<_> = lengths.iter().map(|&n| halves(n)).collect();
        let findings = streams(Discrete::new(2), &all).unwrap().name("mine").examine().findings;
        findings.into_iter().map(|f| f.part).filter(|part| part != "repeated runs").collect::<Vec<_>>()
    };
    assert_eq!(parts(&[32, 50]).len(), 2 + 3);
    assert_eq!(parts(&[31, 50]), [""]);
    assert_eq!(parts(&[32; 8]).len(), 8 + 3 * 28);
    // Of nine only neighbours.
    let nine = parts(&[32; 9]);
    assert_eq!(nine.len(), 9 + 3 * 8);
    assert!(
        nine.contains(&"streams 7 and 8, same place".to_owned())
            && !nine.contains(&"streams 0 and 2, same place".to_owned())
    );
    // One entry only is no table.
    let few = streams(Discrete::new(2), &[vec![1_usize; 40]]).unwrap().examine();
    assert!(few.findings.iter().all(|f| f.part != "stream 0, consecutive points"));
    let two = streams(Discrete::new(2), &[[1_usize]]).unwrap().examine();
    is_certain(found(&two, "streams", ""), Verdict::Inconclusive);
    assert_eq!(found(&two, "streams", "").detail, "1 points are too few to tell anything");
}

#[test]
fn equal_points_are_binomial() {
    let line = || Interval::new(0.0, 1.0);
    let points = |all: &[&[f64]]| {
        streams(line(), &all.iter().map(|s| s.to_vec()).collect::<Vec<_>>()).unwrap().examine()
    };
    // Of 15 pairs of six points 9 are of two streams.
    for (first, second, p, says) in [
        (
            [0.1, 0.2, 0.3],
            [0.4, 0.5, 0.6],
            1.0,
            "0 pairs of points of different streams are equal to the last bit, and 0 of one stream",
        ),
        (
            [0.1, 0.2, 0.3],
            [0.4, 0.2, 0.6],
            0.6,
            "1 pairs of points of different streams are equal to the last bit, and 0 of one stream; for one, from point 1 of stream 0 and point 1 of stream 1 on",
        ),
        (
            [0.1, 0.2, 0.3],
            [0.3, 0.2, 0.6],
            0.36,
            "2 pairs of points of different streams are equal to the last bit, and 0 of one stream",
        ),
        (
            [0.1, 0.2, 0.2],
            [0.3, 0.4, 0.6],
            1.0,
            "0 pairs of points of different streams are equal to the last bit, and 1 of one stream",
        ),
        (
            [0.1, 0.2, 0.2],
            [0.4, 0.4, 0.1],
            1.0 - 0.4_f64.powi(3),
            "1 pairs of points of different streams are equal to the last bit, and 2 of one stream",
        ),
        // Of three equal ones, one in the other stream, two pairs are of two.
        (
            [0.2, 0.1, 0.2],
            [0.4, 0.5, 0.2],
            0.36 * (0.4 * 3.0 + 0.6),
            "2 pairs of points of different streams are equal to the last bit, and 1 of one stream; for one, from point 0 of stream 0 and point 2 of stream 1 on",
        ),
    ] {
        let examination = points(&[&first, &second]);
        let finding = found(&examination, "streams", "equal points");
        assert!(finding.detail.starts_with(says), "{}", finding.detail);
        near(p_of(finding).0, p, 1e-12);
        assert_eq!(examination.findings.len(), 1);
    }
    // Of one stream nothing is between, and a single point of each is no pair within.
    assert_eq!(points(&[&[0.1, 0.2, 0.3]]).findings[0].evidence, Evidence::Certain(Verdict::Inconclusive));
    assert_eq!(points(&[&[0.1], &[0.1]]).findings[0].evidence, Evidence::Certain(Verdict::Inconclusive));
    let one_pair = points(&[&[0.1, 0.3], &[0.1]]);
    assert_eq!(one_pair.findings.len(), 1);
    // Two pairs of both streams and one of the first, of which one is equal.
    near(p_of(found(&one_pair, "streams", "equal points")).0, 2.0 / 3.0, 1e-12);
}

#[test]
fn runs_that_come_up_again() {
    let distinct = |number: u64, count: usize| {
        let mut rng = stream(6, "runs", number);
        (0..count).map(|_| unit_f64(&mut rng)).collect::<Vec<f64>>()
    };
    let examine = |all: &[Vec<f64>]| streams(Interval::new(0.0, 1.0), all).unwrap().examine();
    // Two streams of 1000: 1,999,000 pairs, 999,000 of them within. At a rate of 3 in 999,000 three in a row are as good as impossible.
    let (pairs, within) = (1_999_000.0, 999_000.0);
    let (first, second) = (distinct(0, 1000), distinct(1, 1000));
    let judge =
        |first: &Vec<f64>, second: &Vec<f64>, length: i32, equal_within: f64, runs: u64, example: &str| {
            let examination = examine(&[first.clone(), second.clone()]);
            let finding = found(&examination, "streams", "repeated runs");
            assert_eq!(
                finding.detail,
                format!("runs of {length} points that come up again: {runs}{example}")
            );
            let bound = pairs * ((equal_within + 3.0) / within).powi(length);
            assert!(bound <= 1e-8 && bound * within / (equal_within + 3.0) > 1e-8);
            near(p_of(finding).0, if runs > 0 { bound } else { 1.0 }, 1e-9);
        };
    judge(&first, &second, 3, 0.0, 0, "");
    let with = |stream: &Vec<f64>, at: usize, points: &[f64]| {
        let mut all = stream.clone();
        all[at..at + points.len()].copy_from_slice(points);
        all
    };
    // Two points are no run of three; three are one, and five are three.
    judge(&first, &with(&second, 10, &first[500..502]), 3, 0.0, 0, "");
    let of_both = "; for one, from point 500 of stream 0 and point 10 of stream 1 on";
    judge(&first, &with(&second, 10, &first[500..503]), 3, 0.0, 1, of_both);
    let finding = examine(&[first.clone(), with(&second, 10, &first[500..505])]);
    assert!(
        found(&finding, "streams", "repeated runs")
            .detail
            .starts_with("runs of 3 points that come up again: 3; for one")
    );
    // At the very ends.
    judge(
        &first,
        &with(&second, 0, &first[997..]),
        3,
        0.0,
        1,
        "; for one, from point 997 of stream 0 and point 0 of stream 1 on",
    );
    // Of one stream, where three equal pairs raise the rate.
    judge(
        &with(&first, 200, &first[100..103]),
        &second,
        3,
        3.0,
        1,
        "; for one, from point 100 of stream 0 and point 200 of stream 0 on",
    );
    judge(
        &with(&first, 103, &first[100..103]),
        &second,
        3,
        3.0,
        1,
        "; for one, from point 100 of stream 0 and point 103 of stream 0 on",
    );
    // Runs that overlap are no second one: five equal points hold three runs of three.
    let five = with(&first, 100, &[first[100]; 5]);
    judge(&five, &second, 3, 10.0, 0, "");
    // More of them raise the rate so much that four in a row are looked for: of seven the first and the last overlap, of eight they don't.
    judge(&with(&first, 100, &[first[100]; 7]), &second, 4, 21.0, 0, "");
    let eight = with(&first, 100, &[first[100]; 8]);
    judge(&eight, &second, 4, 28.0, 1, "; for one, from point 100 of stream 0 and point 104 of stream 0 on");
    // In both streams and twice in one of them: two pairs between, and one within.
    let twice = with(&first, 200, &first[100..103]);
    let finding = examine(&[twice, with(&second, 10, &first[100..103])]);
    assert!(
        found(&finding, "streams", "repeated runs")
            .detail
            .starts_with("runs of 3 points that come up again: 3;")
    );
    // Entries come up again all the time; only runs of them count, up to all of the shorter stream.
    let (long, short) = (entries(0, 400, &[0.25, 0.5, 0.75]), entries(1, 60, &[0.25, 0.5, 0.75]));
    let examination = streams(Discrete::new(4), &[long.clone(), short.clone()]).unwrap().examine();
    let equal = |s: &[usize]| {
        let of = |entry: usize| s.iter().filter(|&&i| i == entry).count() as f64;
        (0..4).map(|entry| 0.5 * of(entry) * (of(entry) - 1.0)).sum::<f64>()
    };
    let within = 0.5 * (400.0 * 399.0 + 60.0 * 59.0);
    let rate = (equal(&long) + equal(&short) + 3.0) / within;
    let length = ((1e-8_f64 / (0.5 * 460.0 * 459.0)).ln() / rate.ln()).ceil();
    let detail = format!("runs of {length} points that come up again: 0");
    assert_eq!(found(&examination, "streams", "repeated runs").detail, detail);
    assert!(examination.findings.iter().all(|f| f.part != "equal points"));
    // So may atoms among other points.
    let mixed = |s: &[usize]| {
        s.iter()
            .enumerate()
            .map(|(i, &e)| {
                if e == 0 {
                    Mixed::Atom(0)
                } else {
                    Mixed::Continuous((i as f64 + 0.5 * e as f64) / 400.0 * 0.9)
                }
            })
            .collect::<Vec<_>>()
    };
    let domain = WithAtoms::new(Interval::new(0.0, 1.0), 1);
    let examination = streams(domain, &[mixed(&long), mixed(&short)]).unwrap().examine();
    assert!(examination.findings.iter().all(|f| f.part != "equal points"));
    // Too short for a run that says something.
    let examination = streams(Discrete::new(4), &[long, short[..10].to_vec()]).unwrap().examine();
    assert!(examination.findings.iter().all(|f| f.part != "repeated runs"));
}

#[test]
fn what_is_no_stream() {
    let none: [Vec<f64>; 0] = [];
    let error = |all: &[Vec<f64>]| streams(Interval::new(0.0, 1.0), all).err().unwrap().to_string();
    assert_eq!(error(&none), "there are no streams to look at");
    assert_eq!(error(&[vec![0.5], vec![]]), "stream 1 has no points");
    assert_eq!(
        error(&[vec![0.5], vec![0.5, 0.25, 1.5]]),
        "stream 1: point 2, 1.500, is 1.5, outside of [0, 1]"
    );
}
