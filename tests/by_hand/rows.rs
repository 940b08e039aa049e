//! Rows that somebody else drew: which are read, what is said of them, what their densities and weights give.

use super::*;
use std::sync::Mutex;
use std::time::Duration;
use warpcheck::domain::{Discrete, Interval, Location};
use warpcheck::statistics::Moments;
use warpcheck::verify::{Against, Row, Settings, Verdict, recording};

/// Tells how many were asked for, and fails at a row.
struct Asked<'a> {
    rows: Given,
    asked: &'a Mutex<Vec<(usize, usize)>>,
    fails_at: usize,
}

impl Rows for Asked<'_> {
    fn width(&self) -> usize {
        self.rows.width
    }

    fn count(&self) -> Option<u64> {
        self.rows.count()
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        if self.rows.given / self.rows.width >= self.fails_at {
            return Err("row is torn".into());
        }
        let read = self.rows.read(most, out)?;
        self.asked.lock().unwrap().push((most, read));
        Ok(read)
    }
}

fn uniform(count: usize) -> Vec<f64> {
    let mut rng = stream(21, "rows", 0);
    (0..count).map(|_| unit_f64(&mut rng)).collect()
}

fn point(numbers: &[f64]) -> Row<f64> {
    Row { point: Some(numbers[0]), density: None, weight: None }
}

fn line() -> Interval {
    Interval::new(0.0, 1.0)
}

#[test]
fn how_rows_are_read() {
    let read = |count: usize, counted: bool, at_once: usize, samples: u64| {
        let asked = Mutex::new(Vec::new());
        let rows = Asked {
            rows: Given { counted, at_once, ..Given::new(1, uniform(count)) },
            asked: &asked,
            fails_at: usize::MAX,
        };
        let settings = Settings { samples, diagnose: false, ..Settings::default() };
        let examination =
            recording(line(), rows, point).unwrap().density(|_| 1.0).examine(&settings).unwrap();
        assert_eq!(examination.against, Against::Given);
        // There are no variates that have ends.
        assert!(examination.edges.is_empty());
        (examination.samples, asked.into_inner().unwrap())
    };
    // An eighth of few are pilots; so many are read at first that few are known to be so.
    assert_eq!(
        read(8000, true, usize::MAX, u64::MAX),
        (7000, vec![(131_072, 8000), (123_072, 0), (0, 0)][..2].to_vec())
    );
    assert_eq!(read(8000, false, usize::MAX, u64::MAX).0, 7000);
    assert_eq!(read(15, true, usize::MAX, u64::MAX).0, 14);
    assert_eq!(read(7, false, usize::MAX, u64::MAX).0, 6);
    assert_eq!(read(8000, true, usize::MAX, 500).0, 500);
    // By bits, as pipes give them.
    let (samples, asked) = read(3000, false, 1000, u64::MAX);
    assert_eq!(samples, 2625);
    assert_eq!(asked[..4], [(131_072, 1000), (130_072, 1000), (129_072, 1000), (128_072, 0)]);
    // Of many 2^14 are pilots, and what was read ahead is judged.
    let (samples, asked) = read(140_000, true, usize::MAX, u64::MAX);
    assert_eq!((samples, asked[0]), (140_000 - 16_384, (131_072, 131_072)));
    assert_eq!(asked[1..].iter().map(|a| a.1).sum::<usize>(), 140_000 - 131_072);
    assert_eq!(read(140_000, false, usize::MAX, u64::MAX).0, 140_000 - 16_384);
    assert_eq!(read(140_000, false, 999, 100_000).0, 100_000);
    // No more than are judged: 130,000, of which 131,072 - 2^14 are there.
    let (samples, asked) = read(150_000, false, usize::MAX, 130_000);
    assert_eq!((samples, &asked[1..]), (130_000, &[(15_312, 15_312)][..]));
    assert_eq!(
        recording(line(), Given::new(1, vec![]), point).err().unwrap().to_string(),
        "there are no samples: not a single row"
    );
}

/// No more is read than is judged, however many there are: who writes to the pipe may be waiting for an answer.
#[test]
fn rows_that_are_not_judged_are_not_read() {
    let asked = Mutex::new(Vec::new());
    let rows = Asked {
        rows: Given { counted: false, ..Given::new(1, uniform(300_000)) },
        asked: &asked,
        fails_at: usize::MAX,
    };
    let settings = Settings { samples: 200_000, diagnose: false, ..Settings::default() };
    let examination = recording(line(), rows, point).unwrap().density(|_| 1.0).examine(&settings).unwrap();
    let read: usize = asked.into_inner().unwrap().iter().map(|a| a.1).sum();
    assert_eq!((examination.samples, read), (200_000, 200_000 + 16_384));
}

/// A pipe whose end nobody knew is judged by as many cells as if its rows had been counted before, and ends where it ends if there is a time to keep too.
#[test]
fn pipes_that_end_early() {
    let points = uniform(190_000);
    let judged = |counted: bool, time: Option<Duration>| {
        let rows = Given { counted, ..Given::new(1, points.clone()) };
        let settings = Settings { time, diagnose: false, ..Settings::default() };
        recording(line(), rows, point).unwrap().density(|_| 1.0).examine(&settings).unwrap()
    };
    let hour = Some(Duration::from_secs(3600));
    let (known, piped, timed) = (judged(true, None), judged(false, None), judged(false, hour));
    for examination in [&known, &piped, &timed] {
        assert_eq!(examination.samples, 190_000 - 16_384);
        assert_eq!(examination.scales, known.scales);
        assert!(examination.cells.iter().all(|cell| cell.expected >= 8.0));
    }
}

#[test]
fn rows_that_can_not_be_read() {
    let at = |fails_at: usize, samples: u64| {
        let asked = Mutex::new(Vec::new());
        let rows = Asked {
            rows: Given { at_once: 10_000, ..Given::new(1, uniform(200_000)) },
            asked: &asked,
            fails_at,
        };
        let settings = Settings { samples, diagnose: false, ..Settings::default() };
        let opened = match recording(line(), rows, point) {
            Ok(opened) => opened.density(|_| 1.0),
            Err(why) => return format!("at once: {why}"),
        };
        opened.examine(&settings).map_or_else(|why| why.to_string(), |e| e.samples.to_string())
    };
    assert_eq!(at(100_000, u64::MAX), "at once: row is torn");
    assert_eq!(at(150_000, u64::MAX), "row is torn");
    assert_eq!(at(usize::MAX, u64::MAX), (200_000 - 16_384).to_string());
}

#[test]
fn rows_are_called_by_their_number() {
    // Row 70 of 80 is out, then row 3 as well, a pilot, which is in no cell, but none of the domain either.
    let mut numbers = uniform(80);
    let settings = Settings { diagnose: false, ..Settings::default() };
    for (row, says) in [
        (
            70,
            "1 of 80 samples are outside of the domain; the first: the point 1.500 is 1.5, outside of [0, 1] (row 70)",
        ),
        (
            3,
            "2 of 80 samples are outside of the domain; the first: the point 1.500 is 1.5, outside of [0, 1] (row 3)",
        ),
    ] {
        numbers[row] = 1.5;
        let examination = recording(line(), Given::new(1, numbers.clone()), point)
            .unwrap()
            .density(|_| 1.0)
            .name("mine")
            .examine(&settings)
            .unwrap();
        let support = found(&examination, "support", "");
        is_certain(support, Verdict::Fail);
        assert_eq!(support.detail, says);
        assert_eq!((examination.name.as_str(), examination.samples), ("mine", 70));
    }
    // Where the density is 0, or none.
    let judged = |density: &(dyn Fn(f64) -> f64 + Sync)| {
        let rows = Given::new(1, uniform(80));
        let examination =
            recording(line(), rows, point).unwrap().density(|&x| density(x)).examine(&settings).unwrap();
        let finding = found(&examination, "support", "");
        (finding.evidence, finding.detail.clone())
    };
    let all = uniform(80);
    let low: Vec<usize> = (0..80).filter(|&i| all[i] < 0.2).collect();
    for (value, says) in [
        (0.0, "are where the density is 0; the first: the density"),
        (f64::NAN, "have an impossible density; the first: the density"),
        (-1.0, "have an impossible density; the first: the density"),
    ] {
        let (evidence, detail) = judged(&|x| if x < 0.2 { value } else { 1.25 });
        assert_eq!(evidence, Evidence::Certain(Verdict::Fail));
        assert_eq!(
            detail,
            format!("{} of 80 samples {says} at {:.3} is {value} (row {})", low.len(), all[low[0]], low[0])
        );
    }
    // A rounding beyond the border is forgiven, to one in ten thousand.
    let on_border = |count: usize, borders: usize| {
        let mut numbers: Vec<f64> = (0..count).map(|i| 0.5 + 0.5 * (i as f64 + 0.5) / count as f64).collect();
        numbers = shuffled(numbers);
        numbers[count - borders..].fill(0.5 - 5e-7);
        let examination = recording(line(), Given::new(1, numbers), point)
            .unwrap()
            .density(|&x| if x < 0.5 { 0.0 } else { 2.0 })
            .examine(&settings)
            .unwrap();
        let finding = found(&examination, "support", "");
        (finding.evidence, finding.detail.clone(), finding.sees.clone())
    };
    let (pass, fail) = (Evidence::Certain(Verdict::Pass), Evidence::Certain(Verdict::Fail));
    let none = on_border(16_000, 0);
    assert_eq!(
        (none.0, none.1.as_str(), none.2.as_str()),
        (
            pass,
            "all 16000 samples lie where the density is positive",
            "samples without density if they are 3e-4 or more of all"
        )
    );
    let one = on_border(16_000, 1);
    assert_eq!(
        (one.0, one.1.as_str()),
        (pass, "all 16000 samples lie where the density is positive, 1 of them a rounding beyond its border")
    );
    let two = on_border(16_000, 2);
    assert_eq!(
        (two.0, two.1.as_str()),
        (
            fail,
            "all 16000 samples lie where the density is positive, but 2 of them have the density 0 on a border: too many for rounding"
        )
    );
}

/// Densities that came with the rows are held against those that are asked.
#[test]
fn densities_of_rows_and_those_asked() {
    let mut points = uniform(8000);
    points.iter_mut().for_each(|x| *x = x.sqrt());
    let judged = |given: &dyn Fn(usize, f64) -> f64| {
        let numbers = points.iter().enumerate().flat_map(|(i, &x)| [x, given(i, x)]).collect();
        let row = |n: &[f64]| Row { point: Some(n[0]), density: Some(n[1]), weight: None };
        let settings = Settings { diagnose: false, ..Settings::default() };
        recording(line(), Given::new(2, numbers), row)
            .unwrap()
            .density(|x| 2.0 * x)
            .examine(&settings)
            .unwrap()
    };
    let right = judged(&|_, x| 2.0 * x * (1.0 + 0.9e-4));
    let agreement = found(&right, "agreement", "");
    is_certain(agreement, Verdict::Pass);
    assert_eq!(
        agreement.detail,
        "the density returned is the density asked, within 1e-4 or a rounding of the point, for all 8000 samples asked"
    );
    assert_eq!(agreement.sees, "a difference for 6e-4 or more of the samples");
    // Four are off, a pilot first, the worst by a half.
    let wrong = judged(&|i, x| {
        2.0 * x
            * match i {
                20 => 1.2,
                2000 => 1.1,
                3000 => 1.5,
                4000 => 0.75,
                _ => 1.0,
            }
    });
    let agreement = found(&wrong, "agreement", "");
    is_certain(agreement, Verdict::Fail);
    let (x, asked) = (points[3000], 2.0 * points[3000]);
    assert_eq!(
        agreement.detail,
        format!(
            "the density returned differs from the density asked for 4 of 8000 samples, at worst by a factor of 1 + 5.00e-1: {:e} came with the point {x:.3}, where asking gives {asked:e} (row 3000)",
            asked * 1.5
        )
    );
    // Just beyond what nobody minds, and what a rounding of the point explains.
    let wrong = judged(&|_, x| 2.0 * x * (1.0 + 1.1e-4));
    is_certain(found(&wrong, "agreement", ""), Verdict::Fail);
    let low = judged(&|_, x| 2.0 * x * (1.0 - 1.1e-4));
    // A rounding of 2.5e-7 to either side explains three times that, which is more than 1.1e-4 of small ones.
    let wrong =
        points.iter().filter(|&&x| 2.0 * x * 1.1e-4 - 1.5e-6 > 1e-4 * 2.0 * x * (1.0 - 1.1e-4)).count();
    assert!(
        wrong < 8000 && found(&low, "agreement", "").detail.contains(&format!("for {wrong} of 8000 samples")),
        "{wrong}"
    );
    let invalid = judged(&|i, x| if i == 5000 { f64::INFINITY } else { 2.0 * x });
    assert!(
        found(&invalid, "support", "")
            .detail
            .contains("1 of 8000 samples have an impossible density; the first: the density at")
    );
}

/// A column of weights has a mean.
#[test]
fn a_column_of_weights() {
    let points = uniform(9000);
    let judged = |integral: Option<f64>, weight: &dyn Fn(f64) -> f64| {
        let numbers = points.iter().flat_map(|&x| [x, weight(x)]).collect();
        let row = |n: &[f64]| Row { point: (n[0] > 0.1).then_some(n[0]), density: None, weight: Some(n[1]) };
        let settings = Settings { diagnose: false, ..Settings::default() };
        let density = |x: &f64| if *x > 0.1 { 1.0 } else { 0.0 };
        recording(line(), Given::new(2, numbers), row)
            .unwrap()
            .density(density)
            .integral(integral)
            .examine(&settings)
            .unwrap()
    };
    let part = "f / density, the column of weights";
    let examination = judged(Some(0.5), &|x| x);
    // The pilots are 9000 / 8; rejected samples count as 0.
    let weights: Vec<f64> = points[1125..].iter().map(|&x| if x > 0.1 { x } else { 0.0 }).collect();
    let n = weights.len() as f64;
    let mean = weights.iter().sum::<f64>() / n;
    let error = (weights.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
    let finding = found(&examination, "weights", part);
    assert_eq!(
        finding.detail,
        format!("the mean of f / density is {mean:.6} +- {error:.1e}, the integral 0.500000")
    );
    assert_eq!(finding.sees, format!("a mean that is {:.2}% off", 100.0 * (13.0 * error + 1e-6)));
    let moments: Moments = weights.iter().copied().collect();
    near(p_of(finding).0, moments.mean_test(0.5, 0.5e-6).unwrap().p_conservative, 1e-9);
    let rejected = points[1125..].iter().filter(|&&x| x <= 0.1).count() as u64;
    assert_eq!((examination.samples, examination.rejected), (7875, rejected));
    assert!(judged(None, &|x| x).findings.iter().all(|f| f.part != part));
    let bad = judged(Some(0.5), &|x| if x > 0.99 { f64::NAN } else { x });
    is_certain(found(&bad, "weights", part), Verdict::Fail);
    assert_eq!(found(&bad, "weights", part).detail, "f / density is not always a number: its mean is NaN");
    let heavy = judged(Some(1.0), &|x| if x > 0.9995 { 2000.0 } else { 0.0 });
    let finding = found(&heavy, "weights", part);
    assert_eq!(finding.evidence, Evidence::Unanswered);
    assert!(
        finding
            .detail
            .ends_with(", but its tails are too heavy, or its samples too few, for that to be believed")
    );
}

/// A density of places is asked for many at once, and of a mass for each cell.
#[test]
fn densities_of_places() {
    let points: Vec<f64> = uniform(8000).into_iter().map(f64::sqrt).collect();
    let settings = Settings { diagnose: false, ..Settings::default() };
    let by_point = recording(line(), Given::new(1, points.clone()), point)
        .unwrap()
        .density(|x| 2.0 * x)
        .examine(&settings)
        .unwrap();
    let places = |places: &[Location], out: &mut Vec<f64>| out.extend(places.iter().map(|l| 2.0 * l.at[0]));
    let by_place = recording(line(), Given::new(1, points.clone()), point)
        .unwrap()
        .density_of_places(places)
        .examine(&settings)
        .unwrap();
    let said =
        |e: &Examination| e.findings.iter().map(|f| (f.part.clone(), f.detail.clone())).collect::<Vec<_>>();
    assert_eq!(said(&by_point), said(&by_place));
    // With densities of their own, which are compared with those of places.
    let numbers = |factor: f64| points.iter().flat_map(|&x| [x, 2.0 * x * factor]).collect::<Vec<_>>();
    let both = |n: &[f64]| Row { point: Some(n[0]), density: Some(n[1]), weight: None };
    for (factor, verdict) in [(1.0, Verdict::Pass), (1.01, Verdict::Fail)] {
        let examination = recording(line(), Given::new(2, numbers(factor)), both)
            .unwrap()
            .density_of_places(places)
            .examine(&settings)
            .unwrap();
        is_certain(found(&examination, "agreement", ""), verdict);
    }
    // Masses that are known take the place of integrals, and may contradict them.
    let with_mass = |factor: f64| {
        let mass =
            move |cell: &warpcheck::domain::Cell| Some(factor * (cell.high[0].powi(2) - cell.low[0].powi(2)));
        recording(line(), Given::new(1, points.clone()), point)
            .unwrap()
            .density(|x| 2.0 * x)
            .cell_mass(mass)
            .examine(&settings)
            .unwrap()
    };
    near(with_mass(1.0).integral.0, 1.0, 1e-14);
    assert_eq!(with_mass(1.0).integral.1, 0.0);
    let doubled = with_mass(1.001);
    let finding = found(&doubled, "normalisation", "");
    is_certain(finding, Verdict::Fail);
    assert!(
        finding.detail.starts_with("the sampler gives x 0.000000..")
            && finding.detail.contains(", its density integrates to "),
        "{}",
        finding.detail
    );
    is_certain(found(&with_mass(1.0 + 0.5e-6), "normalisation", ""), Verdict::Pass);
    // Entries that nobody lists.
    let row = |n: &[f64]| Row { point: Some(n[0] as usize), density: None, weight: None };
    let table = (0..8000).map(|i| f64::from(i % 4)).collect();
    let examination = recording(Discrete::new(4), Given::new(1, table), row)
        .unwrap()
        .cell_mass(|cell| Some(0.25 * cell.patches.len() as f64))
        .density(|_| 0.25)
        .examine(&settings)
        .unwrap();
    assert_eq!(examination.integral, (1.0, 0.0));
}
