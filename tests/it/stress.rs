//! Extreme inputs do what they should, and the judging bites: a wrong component makes its rows fail.

use glam::{Vec2, Vec3};
use warpcheck::domain::Discrete;
use warpcheck::report::stress_table;
use warpcheck::sampler::{DiscreteCdf, Sampler, TriangleWarp, from_fn};
use warpcheck::stress::{self, Component, Kind, Outcome, Row, Trial, Unit};

#[track_caller]
fn all_are_right(wanted: impl Fn(&Row) -> bool) {
    let done = stress::run(stress::rows().into_iter().filter(wanted), |_| true);
    assert!(!done.is_empty());
    let table = stress_table(&done, Default::default());
    println!("{table}");
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
#[ignore = "takes a minute and 2 GB"]
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
    let table = stress_table(&done, Default::default());
    assert!(table.contains("fail: 0 of 2 rows"), "{table}");
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
