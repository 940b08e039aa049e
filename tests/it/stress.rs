//! Extreme inputs do what they should, and the judging bites: a wrong component makes its rows fail.

use glam::{Vec2, Vec3};
use warpcheck::domain::Discrete;
use warpcheck::report::{stress_table, stress_table_by_component};
use warpcheck::sampler::{DiscreteCdf, DiscreteTable, Form, Sampler, TriangleWarp, from_fn};
use warpcheck::stress::{self, Component, Kind, Outcome, Row, Trial, Unit};

#[track_caller]
fn all_are_right(wanted: impl Fn(&Row) -> bool) {
    let done = stress::run(stress::rows().into_iter().filter(wanted), |_| true);
    assert!(!done.is_empty());
    let table = stress_table(&done, Default::default());
    println!("{table}");
    // Under the rows the words that explain them may be wider.
    let rows = table.split("\npass: ").next().unwrap_or_default();
    assert!(rows.lines().all(|line| line.chars().count() <= 160), "{table}");
    assert!(done.iter().all(|(_, outcome)| outcome.is_ok()), "{table}");
}

#[test]
fn discrete() {
    all_are_right(|row| row.component == Component::Discrete && !row.heavy);
}

#[test]
fn triangle() {
    all_are_right(|row| row.component == Component::Triangle && !row.heavy);
}

#[test]
fn solid_angle() {
    all_are_right(|row| row.component == Component::SolidAngle && !row.heavy);
}

#[test]
fn environment() {
    all_are_right(|row| row.component == Component::Environment && !row.heavy);
}

#[test]
fn lobes() {
    all_are_right(|row| row.component == Component::Lobes && !row.heavy);
}

#[test]
fn mixture() {
    all_are_right(|row| row.component == Component::Mixture && !row.heavy);
}

#[test]
#[ignore = "takes minutes and 2 GB"]
fn heavy_rows() {
    all_are_right(|row| row.heavy);
}

/// The inputs of the rows that fail.
fn failing(rows: Vec<Row>) -> Vec<String> {
    let done = stress::run(rows.into_iter().filter(|row| !row.heavy), |_| true);
    done.into_iter().filter(|(_, outcome)| !outcome.is_ok()).map(|(row, _)| row.input).collect()
}

fn allowed(entries: f64, largest: f64) -> f64 {
    (4.0 + entries * largest) * 2.0_f64.powi(-53)
}

/// A CDF as it is usually written, with sums of a type and a search.
macro_rules! plain_cdf {
    ($float:ty, $search:expr) => {
        move |weights: &[f64]| {
            let sums = weights.iter().scan(0.0, |sum: &mut $float, &w| {
                *sum += w as $float;
                Some(*sum)
            });
            let cdf: Vec<$float> = sums.collect();
            let (total, masses) = (cdf[cdf.len() - 1], cdf.clone());
            Ok::<_, String>(from_fn(
                Discrete::new(cdf.len()),
                move |xi: $float| cdf.partition_point(|&c| $search(c, xi * total)).min(cdf.len() - 1),
                move |i: usize| (masses[i] - if i > 0 { masses[i - 1] } else { 0.0 }) / total,
            ))
        }
    };
}

#[test]
fn wrong_tables_fail() {
    let upper_bound = |sum, wanted| sum <= wanted;
    let single = failing(stress::discrete_rows(plain_cdf!(f32, upper_bound), allowed));
    for input in ["[5e-324, 0]", "[MAX, MAX]", "areas from 1e-30 to 1e30", "1, then 1e6 of 1e-8"] {
        assert!(single.iter().any(|failed| failed == input), "{input}: {single:?}");
    }
    // In f64 only what overflows, underflows or is absorbed goes wrong.
    let upper_bound = |sum, wanted| sum <= wanted;
    let double = failing(stress::discrete_rows(plain_cdf!(f64, upper_bound), allowed));
    assert_eq!(double, ["[5e-324, 0]", "[MAX, MAX]", "areas from 1e-30 to 1e30"]);
    // The wrong one of two searches returns an entry of weight 0 at xi = 0.
    let lower_bound = |sum, wanted| sum < wanted;
    let first = failing(stress::discrete_rows(plain_cdf!(f64, lower_bound), allowed));
    assert!(first.iter().any(|failed| failed == "zeros first"), "{first:?}");
}

/// A table that never draws one of its entries, whatever mass it gives it.
fn losing(weights: &[f64]) -> Result<impl Sampler<Domain = Discrete> + use<>, String> {
    let table = DiscreteCdf::new(weights).map_err(|error| error.to_string())?;
    let positive = |w: &f64| *w > 0.0;
    let (kept, lost) =
        (weights.iter().position(positive).unwrap(), weights.iter().rposition(positive).unwrap());
    let (draws, entries) = (table.clone(), table.len());
    let draw = move |xi: f64| Some(draws.choose(xi).index).filter(|&i| i != lost).unwrap_or(kept);
    Ok(from_fn(Discrete::new(entries), draw, move |i: usize| table.mass(i)))
}

#[test]
fn a_lost_entry_is_counted() {
    let rows = stress::discrete_rows(losing, allowed).into_iter().filter(|row| !row.heavy);
    for (row, outcome) in stress::run(rows, |_| true) {
        let reach = outcome.reach.unwrap();
        // Who has one entry can't lose it.
        let lost = u64::from(reach.of > 1);
        assert_eq!(reach.missed, lost, "{}: {outcome:?}", row.input);
        assert_eq!(outcome.is_ok(), lost == 0, "{}: {outcome:?}", row.input);
        assert!(reach.missed_by_24_bits.unwrap().0 >= lost, "{}: {outcome:?}", row.input);
    }
}

/// What variates of 24 bits miss, against all 2^24 of them.
#[test]
fn what_24_bits_miss_is_what_none_of_them_draws() {
    // As the row has them.
    let weights: Vec<f64> =
        (0..=600).map(|i| 10.0_f64.powf(f64::from(i * 233 % 601) / 10.0 - 30.0)).collect();
    for (form, prefix) in [(Form::Cdf, ""), (Form::Guide, "guide table: "), (Form::Alias, "alias table: ")] {
        let input = format!("{prefix}areas from 1e-30 to 1e30");
        let row = stress::rows().into_iter().find(|row| row.input == input).unwrap();
        let (missed, share) = row.run().reach.unwrap().missed_by_24_bits.unwrap();
        let table = DiscreteTable::new(&weights, form).unwrap();
        let mut drawn = vec![false; weights.len()];
        let mut indices = [0; 1 << 12];
        for first in (0..1_u64 << 24).step_by(indices.len()) {
            let bits: Vec<u64> = (first..first + indices.len() as u64).map(|k| k << 40).collect();
            table.indices(&bits, &mut indices);
            indices.iter().for_each(|&i| drawn[i as usize] = true);
        }
        let lost: Vec<usize> = (0..weights.len()).filter(|&i| !drawn[i]).collect();
        assert_eq!(missed, lost.len() as u64, "{form:?}");
        assert!(missed > 100, "{form:?}: {missed}");
        let mass: f64 = lost.iter().map(|&i| table.mass(i)).sum();
        assert!((share - mass).abs() <= 1e-9 * mass, "{form:?}: {share:e} {mass:e}");
    }
}

/// Entries of a step are far off in parts of what they weigh, and counted.
#[test]
fn light_entries_are_told_in_parts_of_what_they_weigh() {
    let rows = stress::discrete_rows(|weights: &[f64]| DiscreteCdf::new(weights), allowed);
    let row = rows.into_iter().find(|row| row.input == "areas from 1e-30 to 1e30").unwrap();
    let outcome = row.run();
    let relative = outcome.relative.unwrap();
    assert_eq!((relative.heavy + relative.light, relative.share), (601, 601.0 * 2.0_f64.powi(-53)));
    assert!(relative.worst < 0.01 && relative.worst_of_light > 1e40, "{relative:?}");
    assert!(relative.of_one_step > 400 && relative.of_one_step <= relative.light, "{relative:?}");
    assert!(outcome.happened.contains(&format!("{} have one step", relative.of_one_step)), "{outcome:?}");
}

#[test]
fn a_mass_that_is_slightly_off_fails() {
    let make = |weights: &[f64]| {
        let table = DiscreteCdf::new(weights).map_err(|error| error.to_string())?;
        let (draws, entries) = (table.clone(), table.len());
        Ok::<_, String>(from_fn(
            Discrete::new(entries),
            move |xi: f64| draws.choose(xi).index,
            move |i: usize| table.mass(i) * (1.0 + 1e-9),
        ))
    };
    let failed = failing(stress::discrete_rows(make, allowed));
    assert!(failed.len() >= 7, "{failed:?}");
    let rows = stress::discrete_rows(|weights: &[f64]| DiscreteCdf::new(weights), allowed);
    assert_eq!(failing(rows), [""; 0]);
}

#[test]
fn wrong_warps_fail() {
    let right = |xi: Vec2| TriangleWarp::SquareRoot.barycentric(xi);
    assert_eq!(failing(stress::warp_rows("right", right)), [""; 0]);
    let unrooted = |xi: Vec2| Vec3::new(1.0 - xi.x, xi.x * xi.y, xi.x * (1.0 - xi.y));
    assert_eq!(failing(stress::warp_rows("w", unrooted)), ["w: a million points"]);
    let unfolded = |xi: Vec2| Vec3::new(xi.x, xi.y, 1.0 - xi.x - xi.y);
    assert_eq!(failing(stress::warp_rows("w", unfolded)).len(), 2);
    let not_a_number = |xi: Vec2| Vec3::new(xi.x / xi.x, 0.0, 0.0);
    assert_eq!(failing(stress::warp_rows("w", not_a_number)).len(), 2);
}

fn outcome(kind: Kind, tolerance: (f64, Unit), ask: fn(&mut Trial)) -> Outcome {
    Component::Discrete.row(kind, "an input", "be right", tolerance, ask).run()
}

#[test]
fn judging_is_strict() {
    let bad: [fn(&mut Trial); 8] = [
        |trial| trial.compare(1.0 + 3.0e-7, 1.0, || "over"),
        |trial| trial.compare(f64::NAN, 1.0, || "NaN"),
        |trial| trial.compare(f64::INFINITY, 1.0, || "infinite"),
        |trial| trial.compare(1e-300, 0.0, || "not 0"),
        |trial| trial.must(false, || "no".into()),
        |trial| trial.refused(Ok::<(), String>(()), |_| true),
        |trial| trial.refused(Err::<(), _>("another"), |_| false),
        |_| {}, // nothing asked
    ];
    for (i, ask) in bad.into_iter().enumerate() {
        let outcome = outcome(Kind::Value, (1e-7, Unit::Relative), ask);
        assert_eq!(outcome.wrong.len(), 1, "{i}: {outcome:?}");
    }
    let fine = outcome(Kind::Value, (0.5, Unit::UlpF32), |trial| {
        trial.compare((1.0_f32 / 3.0).into(), 1.0 / 3.0, || "rounded");
        trial.compare(0.0, 4e-86, || "under the least f32");
        trial.refused(Err::<(), _>("as it should"), |_| true);
    });
    assert!(fine.is_ok() && fine.worst.unwrap() > 0.1, "{fine:?}");
    assert_eq!(fine.happened, "as it should");
    // Five complaints are three, and a count.
    let many = outcome(Kind::Value, (0.0, Unit::UlpF64), |trial| {
        (0..5).for_each(|i| trial.must(false, || format!("complaint {i}")));
    });
    assert_eq!(many.wrong, ["complaint 0", "complaint 1", "complaint 2", "and 2 more"]);
}

#[test]
fn a_panic_is_a_failed_row() {
    let row = || {
        Component::Lobes.row(Kind::Limit, "a trap", "survive", (0.0, Unit::Absolute), |trial: &mut Trial| {
            trial.must(true, String::new);
            let table = DiscreteCdf::new(&[1.0]).unwrap();
            let _ = table.variate(7, 0.5);
        })
    };
    let done = stress::run([row(), row()], |_| true);
    assert!(done[1].1.wrong[0].starts_with("panicked: index out of bounds"), "{:?}", done[1].1);
    for table in
        [stress_table(&done, Default::default()), stress_table_by_component(&done, Default::default())]
    {
        assert!(table.contains("fail: 0 of 2 rows"), "{table}");
        assert_eq!(table.matches("fail: lobes: a trap\n  should: survive\n").count(), 2, "{table}");
    }
}

/// A line a component: the row that is nearest to what is allowed, what is lost in all of them; what is wrong in full.
#[test]
fn one_line_for_a_component() {
    let row = |input: &str, found: f64, missed: u64| {
        Component::Discrete.row(
            Kind::Value,
            input,
            "be 1",
            (0.5, Unit::Relative),
            move |trial: &mut Trial| {
                trial.compare(found, 1.0, || "here");
                trial.reach(stress::Reach { of: 9, missed, missed_by_24_bits: Some((4, 0.25)) });
                trial.note("it was asked");
            },
        )
    };
    let rows = vec![row("near", 1.0, 0), row("nearer", 1.25, 0), row("also", 1.125, 0)];
    let table = stress_table_by_component(&stress::run(rows, |_| true), Default::default());
    let line: Vec<&str> = table.lines().nth(1).unwrap().split_whitespace().collect();
    assert_eq!(line[..9], ["ok", "discrete", "3", "of", "3", "0.25", "0.5", "rel", "0"], "{table}");
    assert_eq!((line[9], line[11]), ("12", "nearer"), "{table}");
    assert!(!table.contains("it was asked"), "{table}");

    let rows = vec![row("near", 1.0, 2), row("nearer", 1.25, 0), row("far", 3.0, 0)];
    let table = stress_table_by_component(&stress::run(rows, |_| true), Default::default());
    let line: Vec<&str> = table.lines().nth(1).unwrap().split_whitespace().collect();
    assert_eq!(line[..9], ["FAIL", "discrete", "1", "of", "3", "2", "0.5", "rel", "2"], "{table}");
    let lost = "fail: discrete: near\n  should: be 1\n  error: 0 rel; allowed: 0.5\n  lost: 2 of 9, 4 with 24 bits\n";
    assert!(table.contains(lost) && table.contains("fail: discrete: far\n"), "{table}");
    assert!(table.contains("  error 2.000e0 rel at here: 3e0, truth 1e0\n"), "{table}");
}

#[test]
fn stopping_keeps_what_is_done() {
    let mut left = 2;
    let done = stress::run(stress::rows(), |_| {
        left -= 1;
        left >= 0
    });
    assert_eq!(done.len(), 2);
}

#[test]
fn components_are_found_by_name() {
    for component in Component::ALL {
        assert_eq!(component.name().parse(), Ok(component));
        assert!(stress::rows().iter().filter(|row| row.component == component).count() >= 10, "{component}");
    }
    let error = "lobe".parse::<Component>().unwrap_err().to_string();
    assert!(error.starts_with("there is no component `lobe`; there are discrete, "), "{error}");
    // No two rows are the same, so that a failure names one.
    let mut names: Vec<_> =
        stress::rows().iter().map(|row| format!("{} {}", row.component, row.input)).collect();
    names.sort();
    let before = names.len();
    names.dedup();
    assert_eq!(names.len(), before);
}

/// The middle of an entry of one step is no f64 above 1/2: it has to be drawn all the same.
#[test]
fn entries_of_one_step_are_inverted() {
    let mut weights = vec![1e-30; 100];
    weights[0] = 1.0;
    let table = DiscreteCdf::new(&weights).unwrap();
    for i in 0..100 {
        let xi = table.invert(&i).unwrap();
        assert_eq!(table.sample(&xi).unwrap().point, i);
    }
}
