//! Error against run time as a table for people, CSV for spreadsheets and JSON for programs.

use crate::estimator::{Convergence, Cost, Curve, Interval, Measured, standard_errors};
use std::fmt::Write;

/// Where errors are compared: the root mean square error of the strategy that came closest, which is what each is asked to reach unless told.
fn target(found: &Convergence) -> Option<f64> {
    let last = compared(found).filter_map(|c| c.last()).map(|r| r.squared.mean).filter(|e| *e > 0.0);
    last.reduce(f64::min).map(f64::sqrt)
}

/// Whether there is no error to compare.
pub(super) fn all_exact(found: &Convergence) -> bool {
    found.curves.iter().all(Curve::is_exact)
}

fn inexact(found: &Convergence) -> impl Iterator<Item = &Curve> {
    found.curves.iter().filter(|curve| !curve.is_exact())
}

/// Whether its error is no rounding, and all of it known.
pub(super) fn is_compared(curve: &Curve) -> bool {
    !curve.is_exact() && curve.sees_all()
}

fn compared(found: &Convergence) -> impl Iterator<Item = &Curve> {
    found.curves.iter().filter(|curve| is_compared(curve))
}

/// The efficiency of the best of those that have an error, and can know it.
pub(super) fn best_efficiency(found: &Convergence) -> f64 {
    compared(found).map(|c| c.efficiency).filter(|e| e.is_finite()).fold(0.0, f64::max)
}

fn root(m: Measured) -> String {
    let root = m.mean.max(0.0).sqrt();
    match m.error / (2.0 * root) {
        half if half.is_finite() => format!("{root:.3e} ± {:.0}%", 100.0 * half / root),
        _ => format!("{root:.3e}"),
    }
}

fn slope(s: Option<Interval>) -> String {
    s.map_or("-".to_owned(), |s| format!("{:.3} ± {:.3}", s.value, s.half_width))
}

/// How many times the best, which is above 0 unless it is exact. Where the best is exact but for roundings, no digits.
pub(super) fn over_best(x: f64) -> String {
    match x {
        x if !x.is_finite() => "-".to_owned(),
        0.0 => "exact".to_owned(),
        x if x < 9.995 => format!("{x:.2}"),
        x if x >= 1e5 => format!("{x:.0e}"),
        x => format!("{x:.0}"),
    }
}

/// The same with its interval, in as many digits.
pub(super) fn ratio(Interval { value, half_width }: Interval) -> String {
    let text = over_best(value);
    match half_width {
        half if !(half.is_finite() && half > 0.0) || value >= 1e5 => text,
        half if value < 9.995 => format!("{text} ± {half:.2}"),
        half => format!("{text} ± {half:.0}"),
    }
}

/// Errors at the largest count, slopes, efficiencies, what it takes to reach an error (`reach`, root mean square in radiance; otherwise
/// that of the strategy that came closest), and the parts of the picture at equal time, of those that are not exact. `setup` is what it took to read the scene and to build its lights.
pub fn convergence_table(found: &Convergence, setup: Cost, reach: Option<f64>) -> String {
    let mut out = String::new();
    let name = |c: &Curve| c.strategy.to_string();
    let width = found.curves.iter().map(|c| name(c).len()).max().unwrap_or(0).max("strategy".len());
    let _ = writeln!(
        out,
        "{:width$}  {:>7} {:>8} {:>8}  {:>16} {:>16} {:>16}  {:>15} {:>15}",
        "strategy",
        "samples",
        "CPU s",
        "wall s",
        "rms error",
        "relative rms",
        "worst tile",
        "slope: time",
        "samples"
    );
    for curve in &found.curves {
        let Some(last) = curve.last() else {
            let _ = writeln!(out, "{:width$}  nothing was measured", name(curve));
            continue;
        };
        let figures = match curve.is_exact() {
            true => ["rounding", "rounding", "rounding", "-", "-"].map(str::to_owned),
            false => [
                root(last.squared),
                root(last.relative),
                root(last.worst_tile),
                slope(curve.slope_time.filter(|_| curve.sees_all())),
                slope(curve.slope_samples.filter(|_| curve.sees_all())),
            ],
        };
        let [squared, relative, worst, over_time, over_samples] = figures;
        let _ = writeln!(
            out,
            "{:width$}  {:>7} {:>8.3} {:>8.3}  {squared:>16} {relative:>16} {worst:>16}  {over_time:>15} {over_samples:>15}",
            name(curve),
            last.passes,
            last.cpu.mean,
            last.wall.mean,
        );
    }
    if !all_exact(found) {
        efficiencies(&mut out, found, width, reach.or_else(|| target(found)));
        if !found.regions.is_empty() {
            regions(&mut out, found);
        }
    }
    let exact = found.curves.iter().filter(|c| c.is_exact()).map(name).collect::<Vec<_>>().join(", ");
    match (all_exact(found), exact.as_str()) {
        (_, "") => {}
        (true, _) => {
            out.push_str("\nall strategies are exact, but for rounding: there is no error to compare\n")
        }
        (false, _) => {
            let _ = writeln!(out, "\n{exact}: exact, but for rounding; only the others are compared");
        }
    }
    let Cost { cpu, wall } = setup;
    let _ = writeln!(
        out,
        "\nreference: {}; relative errors over r^2 + {:.2e}; {} seeds from {}; tiles of {} pixels\n\
         set-up (scene and lights): {:.3} s CPU, {:.3} s wall, not in the times above, which are of the passes on one thread",
        reference(found),
        found.epsilon,
        seeds_of(found),
        found.seed,
        found.tile,
        cpu.as_secs_f64(),
        wall.as_secs_f64()
    );
    if !all_exact(found) {
        let _ = writeln!(
            out,
            "efficiency: 1 / (squared error x CPU s); worst 0.1%: their share of the squared error; claimed variance: that of the film over the squared error, \
             less than 1 where light is yet unseen; ~: beyond what was measured"
        );
    }
    for curve in found.curves.iter().filter(|c| !c.sees_all()) {
        let _ = writeln!(
            out,
            "{}: its samples hardly find the lobes that {:.0}% of the tiles show. Its error there is not known until they do: what is above is mostly luck",
            curve.strategy,
            100.0 * curve.out_of_reach
        );
    }
    for curve in found.curves.iter().filter(|c| c.before.mean > 1e-3) {
        let _ = writeln!(
            out,
            "{}: {:.3} s CPU a picture before its first pass, not in the times above",
            curve.strategy, curve.before.mean
        );
    }
    for curve in found.curves.iter().filter(|c| c.non_finite > 0) {
        let _ = writeln!(
            out,
            "{}: {} samples were NaN or infinite and count as black: this is a bug",
            curve.strategy, curve.non_finite
        );
    }
    out
}

/// What the pictures are compared with.
fn reference(found: &Convergence) -> String {
    let reference = &found.reference;
    if let Some((strategy, passes)) = reference.run {
        return format!(
            "{strategy} at {passes} samples a pixel, {:.1} s, own rms error {:.2e} (taken off)",
            reference.wall,
            reference.squared_error.sqrt()
        );
    }
    let names: Vec<_> = reference.parts.iter().map(|(name, _)| name.as_str()).collect();
    match names.as_slice() {
        [] => "given, taken as exact: its own error shows as bias^2".to_owned(),
        names => format!(
            "closed form of the scene ({}), at the {} of {} pixels that show nothing else",
            names.join(", "),
            reference.pixels(),
            reference.picture.pixels().len()
        ),
    }
}

/// What those that are not exact cost, and what it takes to reach an error.
fn efficiencies(out: &mut String, found: &Convergence, width: usize, reach: Option<f64>) {
    let best = best_efficiency(found);
    let _ = writeln!(
        out,
        "\n{:width$}  {:>10} {:>14}  {:>20} {:>9}  {:>20}  {:>11} {:>16}",
        "strategy",
        "efficiency",
        "time over best",
        reach.map_or("samples".to_owned(), |reach| format!("samples to {reach:.2e}")),
        "CPU s",
        "bias^2",
        "worst 0.1%",
        "claimed variance"
    );
    for curve in inexact(found).filter(|c| c.last().is_some()) {
        let known = curve.sees_all();
        let (samples, seconds) = reach.filter(|_| known).and_then(|reach| curve.to_reach(reach)).map_or(
            ("-".to_owned(), "-".to_owned()),
            |(n, t)| {
                let beyond = curve.last().is_some_and(|l| n > 1.001 * f64::from(l.passes));
                (format!("{}{n:.0}", if beyond { "~" } else { "" }), format!("{t:.2}"))
            },
        );
        let _ = writeln!(
            out,
            "{:width$}  {:>10.3e} {:>14}  {samples:>20} {seconds:>9}  {:>20}  {:>10.1}% {:>16}",
            curve.strategy.to_string(),
            curve.efficiency,
            if known { over_best(best / curve.efficiency) } else { "-".to_owned() },
            format!("{:.1e} ± {:.0e}", curve.squared_bias.mean, curve.squared_bias.error),
            100.0 * curve.outliers.mean,
            over_best(curve.claimed),
        );
    }
}

/// How many pictures of each strategy came, of as many as there should be.
pub(super) fn seeds_of(found: &Convergence) -> String {
    let came = found.curves.iter().filter_map(|c| c.last()).map(|r| r.seeds).min().unwrap_or(0);
    if came as u64 == u64::from(found.seeds) {
        came.to_string()
    } else {
        format!("{came} of {}", found.seeds)
    }
}

/// Errors of parts of the picture at equal time, over the least of the strategies that are not exact.
fn regions(out: &mut String, found: &Convergence) {
    let width =
        found.regions.iter().map(|r| r.0.len()).max().unwrap_or(0).max("rms error at equal time".len());
    let _ = write!(out, "\n{:width$} {:>7}", "rms error at equal time", "pixels");
    found.curves.iter().for_each(|c| {
        let _ = write!(out, " {:>13}", c.strategy);
    });
    let _ = writeln!(out);
    for (name, pixels, ratios) in region_ratios(found) {
        let _ = write!(out, "{name:width$} {pixels:>7}");
        ratios.iter().for_each(|r| {
            let _ = write!(out, " {:>13}", ratio(*r));
        });
        let _ = writeln!(out);
    }
    let _ = writeln!(
        out,
        "over that of the best strategy, with 95% intervals over seeds, by what the picture shows (materials); its square is the ratio of times for equal error"
    );
}

/// For the whole picture (what of it is compared) and each part: its name, its pixels, and the root mean square error of each strategy at equal CPU time (by the
/// law of the square root, from its largest count) over the least of those that are not exact. 1 is the best of these, and has no interval; 0 is exact
/// ([`Curve::is_exact`], or no error at all in the part); NaN or infinite where the error of the best can't be told from 0. The intervals are of first order, from the standard errors of squared error and time of both, and Student's t.
pub fn region_ratios(found: &Convergence) -> Vec<(String, usize, Vec<Interval>)> {
    let whole = ("whole picture".to_owned(), found.reference.pixels());
    let row = |(i, (name, pixels)): (usize, &(String, usize))| {
        // The root of squared error x time, its relative variance and the seeds; none of what is exact.
        let cost = |c: &Curve| {
            let Some(l) = c.last() else { return Some((f64::NAN, f64::NAN, 0)) };
            let squared = if i == 0 { l.squared } else { l.regions[i - 1] };
            let varies = squared.error > 0.0;
            if c.is_exact() || squared.mean == 0.0 && !varies {
                return None;
            }
            let relative = |m: Measured| (0.5 * m.error / m.mean).powi(2);
            let root = (squared.mean.max(0.0) * l.cpu.mean).sqrt();
            Some((root, relative(squared) + relative(l.cpu), l.seeds))
        };
        let costs: Vec<_> = found.curves.iter().map(cost).collect();
        let known = costs.iter().enumerate().filter_map(|(k, cost)| Some((k, (*cost)?)));
        let best = known.filter(|(_, cost)| !cost.0.is_nan()).min_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let over_least = |k: usize| {
            let Some((root, own, own_seeds)) = costs[k] else {
                return Interval { value: 0.0, half_width: 0.0 };
            };
            let Some((best, (least, its, seeds))) = best else {
                return Interval { value: f64::NAN, half_width: f64::INFINITY };
            };
            if k == best && least > 0.0 {
                return Interval { value: 1.0, half_width: 0.0 };
            }
            let freedom = (seeds + own_seeds) as f64 - 2.0;
            let value = root / least;
            let half_width = value * standard_errors(freedom) * (its + own).sqrt();
            Interval { value, half_width: if half_width.is_nan() { f64::INFINITY } else { half_width } }
        };
        (name.clone(), *pixels, (0..costs.len()).map(over_least).collect())
    };
    std::iter::once(&whole).chain(&found.regions).enumerate().map(row).collect()
}

/// A line for every strategy and count, with a header; the last columns are of the parts of the picture, by name. What is not known, as the standard error of one
/// picture, is left empty.
pub fn convergence_to_csv(found: &Convergence) -> String {
    let mut out = "strategy,samples,seeds,cpu_seconds,wall_seconds,squared_error,squared_error_se,\
                   relative_squared_error,relative_squared_error_se,worst_tile,worst_tile_se"
        .to_owned();
    let quoted = |text: String| {
        if text.contains(['"', ',', '\n', '\r']) {
            format!("\"{}\"", text.replace('"', "\"\""))
        } else {
            text
        }
    };
    for (name, _) in &found.regions {
        for column in [format!("squared_error {name}"), format!("squared_error_se {name}")] {
            let _ = write!(out, ",{}", quoted(column));
        }
    }
    out.push('\n');
    for curve in &found.curves {
        for r in &curve.rungs {
            let _ = write!(out, "{},{},{}", curve.strategy, r.passes, r.seeds);
            let errors = [r.squared, r.relative, r.worst_tile].into_iter().chain(r.regions.iter().copied());
            let times = [r.cpu.mean, r.wall.mean];
            for x in times.into_iter().chain(errors.flat_map(|m| [m.mean, m.error])) {
                let _ = if x.is_finite() { write!(out, ",{x:e}") } else { write!(out, ",") };
            }
            out.push('\n');
        }
    }
    out
}

/// Everything that was measured; `reach` as in [`convergence_table`]. `schema_version` grows when the meaning of a field changes.
#[cfg(feature = "json")]
pub fn convergence_to_json(found: &Convergence, setup: Cost, reach: Option<f64>) -> serde_json::Value {
    use serde_json::{Value, json};
    let measured = |m: Measured| json!({ "mean": m.mean, "standard_error": m.error });
    let interval = |s: Option<Interval>| {
        s.map_or(Value::Null, |s| json!({ "value": s.value, "half_width": s.half_width }))
    };
    let power = |f: Option<(f64, f64)>| f.map_or(Value::Null, |(a, b)| json!({ "factor": a, "exponent": b }));
    let reach = reach.or_else(|| target(found));
    let curves = found.curves.iter().map(|c| {
        let rungs = c.rungs.iter().map(|r| {
            let regions = found.regions.iter().zip(&r.regions).map(|(n, m)| (n.0.clone(), measured(*m)));
            json!({
                "samples": r.passes,
                "seeds": r.seeds,
                "cpu_seconds": measured(r.cpu),
                "wall_seconds": measured(r.wall),
                "squared_error": measured(r.squared),
                "relative_squared_error": measured(r.relative),
                "worst_tile": measured(r.worst_tile),
                "regions": regions.collect::<serde_json::Map<_, _>>(),
            })
        });
        let exact = c.is_exact();
        let reached = reach.filter(|_| is_compared(c)).and_then(|e| c.to_reach(e)).map_or(
            Value::Null,
            |(samples, seconds)| json!({ "rms_error": reach, "samples": samples, "cpu_seconds": seconds }),
        );
        json!({
            "strategy": c.strategy.to_string(),
            "rungs": rungs.collect::<Vec<_>>(),
            "exact": exact,
            "slope_over_time": interval(c.slope_time.filter(|_| !exact)),
            "slope_over_samples": interval(c.slope_samples.filter(|_| !exact)),
            "squared_error_over_time": power(c.fit_time.filter(|_| !exact)),
            "squared_error_over_samples": power(c.fit_samples.filter(|_| !exact)),
            "efficiency": (!exact).then_some(c.efficiency),
            "to_reach": reached,
            "squared_bias": measured(c.squared_bias),
            "outliers": measured(c.outliers),
            "claimed_variance": c.claimed,
            "cpu_seconds_before": measured(c.before),
            "out_of_reach": c.out_of_reach,
            "non_finite": c.non_finite,
        })
    });
    let equal_time = region_ratios(found).into_iter().map(|(name, pixels, ratios)| {
        let over_best: Vec<_> = ratios.into_iter().map(|r| interval(Some(r))).collect();
        json!({ "part": name, "pixels": pixels, "rms_error_over_best": over_best })
    });
    let reference = match found.reference.run {
        Some((strategy, samples)) => json!({
            "strategy": strategy.to_string(),
            "samples": samples,
            "squared_error": found.reference.squared_error,
        }),
        None if found.reference.parts.is_empty() => json!({ "given": true }),
        None => {
            let parts = found.reference.parts.iter().map(|(name, radiance)| (name.clone(), json!(radiance)));
            let radiance: serde_json::Map<_, _> = parts.collect();
            json!({ "given": true, "radiance": radiance, "pixels": found.reference.pixels() })
        }
    };
    json!({
        "kind": "converge",
        "schema_version": 2,
        "program": concat!("warpcheck ", env!("CARGO_PKG_VERSION")),
        "seed": found.seed,
        "seeds": found.seeds,
        "tile": found.tile,
        "epsilon": found.epsilon,
        "outlier_share": crate::estimator::OUTLIERS,
        "confidence": crate::estimator::CONFIDENCE,
        "stopped": found.stopped,
        "reference": reference,
        "equal_time": equal_time.collect::<Vec<_>>(),
        "setup": { "cpu_seconds": setup.cpu.as_secs_f64(), "wall_seconds": setup.wall.as_secs_f64() },
        "strategies": curves.collect::<Vec<_>>(),
    })
}
