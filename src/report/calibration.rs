//! A calibration as a table for people and as JSON for programs.

use super::table::Style;
use crate::calibration::{Calibration, Claim, LEVELS, Mode, Rate, Row, SIGNIFICANCE, Subject, Uniformity};
use crate::verify::{Verdict, p_value};
use std::fmt::Write;

/// Rates of alarms beside their levels; below them the p-values, and what is wrong.
///
/// ```
/// use warpcheck::calibration::{Candidate, Plan, calibrate};
/// use warpcheck::sampler::UniformSphere;
/// let plan = Plan { runs: 5, samples: 5_000, anytime_samples: 0, ..Plan::default() };
/// let calibration = calibrate(&[Candidate::sampler("sphere", &UniformSphere)], &plan);
/// let table = warpcheck::report::calibration_table(&calibration, Default::default());
/// assert!(table.contains("whole verdict"));
/// ```
pub fn calibration_table(calibration: &Calibration, style: Style) -> String {
    let mut out = String::new();
    let _ = write!(out, "{:24} {:>5} {:>6}", "alarms of right samplers", "tests", "runs");
    for level in LEVELS {
        let _ = write!(out, "  {:>25}", format!("at {level:?}"));
    }
    let _ = writeln!(out, "  {:>6}  {:7} {:>8}", "incon.", "verdict", "least p");
    for row in calibration.rows.iter().filter(|row| is_news(row)) {
        let tests = row.all.tests as f64 / row.all.runs as f64;
        let _ = write!(out, "{:24} {:>5.1} {:>6}", title(row), tests, row.all.runs);
        for rate in &row.all.rates {
            let _ = write!(out, "  {:>25}", measured(rate, row.all.runs));
        }
        let least = calibration.uniformity_of(row).first().map_or("-".to_owned(), |u| short(u.adjusted_p));
        let inconclusive = row.all.rates.iter().map(|r| r.inconclusive).max().unwrap_or(0);
        let verdict = verdict(row.over(), "over", "within", style);
        let _ = writeln!(out, "  {inconclusive:>6}  {verdict} {least:>8}");
    }
    let _ = writeln!(
        out,
        "alarms, their rate and its 95% interval in percent; checks without p-values may raise none; incon.: inconclusive, at most at any level"
    );
    parts(&mut out, calibration, style);
    complaints(&mut out, calibration);
    let per_run = match calibration.anytime_samples {
        0 => format!("{} samples each", calibration.samples),
        anytime => format!(
            "{} samples each, and {anytime} at most with a look after every shard",
            calibration.samples
        ),
    };
    let samplers: Vec<String> =
        calibration.samplers.iter().map(|(name, runs)| format!("{name} ({runs})")).collect();
    let _ = writeln!(
        out,
        "\n{}: {} runs, {per_run}; seed {}; judged together at {SIGNIFICANCE:?} (Holm)\nsamplers and their runs: {}",
        verdict(!calibration.holds(), "fail", "pass", style).trim_end(),
        calibration.runs,
        calibration.seed,
        samplers.join(", ")
    );
    out
}

/// Runs that stop early repeat the checks that don't count; those are of interest only if they fail.
fn is_news(row: &Row) -> bool {
    row.mode == Mode::Fixed || row.subject == Subject::Whole || row.name() == "sequential" || row.over()
}

fn title(row: &Row) -> String {
    match row.mode {
        Mode::Fixed => row.name().to_owned(),
        Mode::Anytime => format!("{}, peeking", row.name()),
    }
}

/// "507  5.07 [4.65, 5.52]".
fn measured(rate: &Rate, runs: u64) -> String {
    let percent = |x: f64| format!("{:.*}", if rate.level < 0.01 { 3 } else { 2 }, 100.0 * x);
    let share = rate.alarms as f64 / runs.max(1) as f64;
    format!(
        "{}  {} [{}, {}]",
        rate.alarms,
        percent(share),
        percent(rate.interval.lower),
        percent(rate.interval.upper)
    )
}

fn verdict(bad: bool, no: &str, yes: &str, style: Style) -> String {
    let (word, verdict) = if bad { (no, Verdict::Fail) } else { (yes, Verdict::Pass) };
    style.paint(&format!("{word:7}"), verdict)
}

fn short(p: f64) -> String {
    p_value(p).trim_start_matches("= ").replace("< ", "<")
}

/// Every part for all samplers together, and for single ones where it is refuted.
fn parts(out: &mut String, calibration: &Calibration, style: Style) {
    let shown: Vec<&Uniformity> =
        calibration.uniformity.iter().filter(|u| u.sampler.is_none() || u.refuted()).collect();
    if shown.is_empty() {
        return;
    }
    let name = |u: &Uniformity| {
        let part = if u.part.is_empty() { String::new() } else { format!(": {}", u.part) };
        let sampler = u.sampler.as_ref().map_or(String::new(), |name| format!(" of {name}"));
        format!("{}{part}{sampler}", u.check)
    };
    let width = shown.iter().map(|u| name(u).chars().count()).max().unwrap_or(0).max(8);
    let _ = writeln!(
        out,
        "\n{:width$}  {:14} {:>7} {:>7}  {:>8} {:>9}  {:7}",
        "p-values", "claim", "number", "D", "p", "corrected", "verdict"
    );
    for u in shown {
        let claim = match u.claim {
            Claim::Uniform => "uniform",
            Claim::AtLeastUniform => "not smaller",
        };
        let _ = writeln!(
            out,
            "{:width$}  {claim:14} {:>7} {:>7.4}  {:>8} {:>9}  {}",
            name(u),
            u.p_values.len(),
            u.distance,
            short(u.p),
            short(u.adjusted_p),
            verdict(u.refuted(), "refuted", "holds", style).trim_end()
        );
    }
    let _ = writeln!(
        out,
        "uniform: tested on both sides; not smaller: exact tests of counts, corrected minima, grouped values, 1 / e, tested on the side that matters"
    );
}

fn complaints(out: &mut String, calibration: &Calibration) {
    for row in calibration.rows.iter().filter(|row| row.over()) {
        let _ = writeln!(out, "\nover: {}", title(row));
        for (sampler, tally) in row.by_sampler.iter().filter(|(_, tally)| tally.over()) {
            let rates: Vec<String> = tally
                .rates
                .iter()
                .filter(|rate| rate.over())
                .map(|rate| format!("{} at {:?}", measured(rate, tally.runs), rate.level))
                .collect();
            let _ = writeln!(out, "  {sampler}, {} runs: {}", tally.runs, rates.join("; "));
        }
        for failure in &row.certain {
            let _ = writeln!(
                out,
                "  without chance: {}, seed {}: {}",
                failure.sampler, failure.seed, failure.detail
            );
        }
    }
}

/// Everything that a calibration measured. `schema_version` grows when the meaning of a field changes.
///
/// Each p-value's distribution is given as counts of 50 classes of equal width.
#[cfg(feature = "json")]
pub fn calibration_to_json(calibration: &Calibration) -> serde_json::Value {
    use serde_json::json;
    let mode = |mode: Mode| if mode == Mode::Fixed { "fixed" } else { "anytime" };
    let tally = |tally: &crate::calibration::Tally| {
        let rates = tally.rates.iter().map(|rate| {
            json!({
                "level": rate.level,
                "alarms": rate.alarms,
                "inconclusive": rate.inconclusive,
                "rate": rate.alarms as f64 / tally.runs.max(1) as f64,
                "interval_95": [rate.interval.lower, rate.interval.upper],
                "p": rate.p,
                "p_adjusted": rate.adjusted_p,
                "over": rate.over(),
            })
        });
        json!({
            "runs": tally.runs,
            "p_values": tally.tests,
            "failures_without_chance": tally.certain,
            "rates": rates.collect::<Vec<_>>(),
        })
    };
    let rows = calibration.rows.iter().map(|row| {
        let samplers = row.by_sampler.iter().map(|(name, t)| json!({ "sampler": name, "tally": tally(t) }));
        let certain =
            row.certain.iter().map(|f| json!({ "sampler": f.sampler, "seed": f.seed, "detail": f.detail }));
        json!({
            "name": row.name(),
            "mode": mode(row.mode),
            "over": row.over(),
            "tally": tally(&row.all),
            "samplers": samplers.collect::<Vec<_>>(),
            "failures_without_chance": certain.collect::<Vec<_>>(),
        })
    });
    let parts = calibration.uniformity.iter().map(|u| {
        let mut classes = [0_u64; 50];
        u.p_values.iter().for_each(|p| classes[((p * 50.0) as usize).min(49)] += 1);
        json!({
            "check": u.check,
            "part": u.part,
            "sampler": u.sampler,
            "mode": mode(u.mode),
            "claim": if u.claim == Claim::Uniform { "uniform" } else { "at least uniform" },
            "number": u.p_values.len(),
            "distance": u.distance,
            "p": u.p,
            "p_adjusted": u.adjusted_p,
            "refuted": u.refuted(),
            "classes": classes.to_vec(),
        })
    });
    let samplers = calibration.samplers.iter().map(|(name, runs)| json!({ "name": name, "runs": runs }));
    json!({
        "kind": "calibrate",
        "schema_version": 2,
        "program": concat!("warpcheck ", env!("CARGO_PKG_VERSION")),
        "holds": calibration.holds(),
        "significance": SIGNIFICANCE,
        "seed": calibration.seed,
        "runs": calibration.runs,
        "samples": calibration.samples,
        "anytime_samples": calibration.anytime_samples,
        "samplers": samplers.collect::<Vec<_>>(),
        "alarms": rows.collect::<Vec<_>>(),
        "uniformity": parts.collect::<Vec<_>>(),
    })
}
