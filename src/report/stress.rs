//! What extremes did, as a table for people and as JSON for programs.

use super::table::Style;
use crate::stress::{Component, Outcome, Reach, Row, Unit};
use crate::verify::Verdict;
use std::fmt::Write;

/// So wide are lines at most; what happened is told below a row if it doesn't fit beside it.
const WIDTH: usize = 160;

/// One line a row, under a heading for each component; below them what is not as it should be, and the sum of it all.
///
/// ```
/// use warpcheck::stress;
/// let mis = stress::rows().into_iter().filter(|row| row.input.starts_with("power"));
/// let table = warpcheck::report::stress_table(&stress::run(mis, |_| true), Default::default());
/// assert!(table.contains("pass: 3 of 3 rows"));
/// ```
pub fn stress_table(done: &[(Row, Outcome)], style: Style) -> String {
    let mut out = String::new();
    for component in Component::ALL {
        let mine: Vec<_> = done.iter().filter(|(row, _)| row.component == component).collect();
        if mine.is_empty() {
            continue;
        }
        let width = |text: fn(&Row) -> &str, title: &str| {
            let widths = mine.iter().map(|(row, _)| text(row).chars().count());
            widths.max().unwrap_or(0).max(title.len())
        };
        let input = width(|row| &row.input, component.name());
        let should = width(|row| &row.should, "what should");
        let _ = writeln!(
            out,
            "{}{:4}  {:input$}  {:should$}  {FIGURES}  what happened",
            if out.is_empty() { "" } else { "\n" },
            "",
            component.name(),
            "what should",
        );
        let mut above = "";
        for (row, outcome) in mine {
            // As in a list by hand, what is the same is not written again.
            let same = std::mem::replace(&mut above, &row.should) == row.should;
            let should_be = if same { "\"" } else { row.should.as_str() };
            let figures = figures(Some((row, outcome)), outcome.reach);
            let line = format!("{}  {:input$}  {should_be:should$}", mark(outcome.is_ok(), style), row.input);
            let happened = happened(outcome);
            // An error has no figures before its words.
            let beside =
                if figures.trim().is_empty() { happened.clone() } else { format!("{figures}  {happened}") };
            let fits = 4 + 2 + input + 2 + should + 2 + beside.trim_end().chars().count() <= WIDTH;
            let beside = if fits { beside.trim_end() } else { figures.trim_end() };
            let _ = writeln!(out, "{}", format!("{line}  {beside}").trim_end());
            if !fits && !happened.is_empty() {
                wrapped(&mut out, &happened);
            }
        }
    }
    told(&mut out, done, style);
    out.push_str("\": as above\n");
    out
}

/// One line a component: its rows, the error that is nearest to what is allowed, what no variate reaches, how long it took. Below them, in full, the rows
/// that are not as they should be, and the sum of it all.
///
/// ```
/// use warpcheck::stress;
/// let mis = stress::rows().into_iter().filter(|row| row.input.starts_with("power"));
/// let table = warpcheck::report::stress_table_by_component(&stress::run(mis, |_| true), Default::default());
/// assert!(table.contains("3 of 3") && table.lines().count() < 10);
/// ```
pub fn stress_table_by_component(done: &[(Row, Outcome)], style: Style) -> String {
    let mut out =
        format!("{:4}  {:11}  {:>10}  {FIGURES}  {:>7}  in which row\n", "", "component", "rows", "time");
    for component in Component::ALL {
        let mine: Vec<_> = done.iter().filter(|(row, _)| row.component == component).collect();
        if mine.is_empty() {
            continue;
        }
        let right = mine.iter().filter(|(_, outcome)| outcome.is_ok()).count();
        let seconds: f64 = mine.iter().map(|(_, outcome)| outcome.time.as_secs_f64()).sum();
        // Where nothing is allowed and nothing is off, nothing is near.
        let part = |(row, outcome): &(Row, Outcome)| {
            outcome.worst.map(|worst| if worst == 0.0 { 0.0 } else { worst / row.allowed })
        };
        let nearest = mine
            .iter()
            .filter_map(|each| part(each).map(|part| (part, *each)))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, (row, outcome))| (row, outcome));
        let _ = writeln!(
            out,
            "{}  {:11}  {:>10}  {}  {seconds:>6.1}s  {}",
            mark(right == mine.len(), style),
            component.name(),
            format!("{right} of {}", mine.len()),
            figures(nearest, mine.iter().filter_map(|(_, outcome)| outcome.reach).reduce(Reach::and)),
            nearest.map_or("", |(row, _)| &row.input),
        );
    }
    told(&mut out, done, style);
    out
}

/// The heading of [`figures`].
const FIGURES: &str = "   error  allowed in     lost/53b lost/24b";

/// The error of a row beside what is allowed, and what is lost.
fn figures(of: Option<(&Row, &Outcome)>, reach: Option<Reach>) -> String {
    let (error, allowed, unit) = of
        .and_then(|(row, outcome)| outcome.worst.map(|worst| (row, worst)))
        .map(|(row, worst)| (error(worst, row.unit), short(row.allowed), row.unit.name()))
        .unwrap_or_default();
    let lost = reach.map_or(String::new(), |reach| reach.missed.to_string());
    let by_24 = reach.and_then(|reach| reach.missed_by_24_bits);
    let by_24 = by_24.map_or(String::new(), |(missed, _)| missed.to_string());
    format!("{error:>8} {allowed:>8} {unit:5}  {lost:>8} {by_24:>8}")
}

/// What is not as it should be, in full; the sum of it all; what the columns mean.
fn told(out: &mut String, done: &[(Row, Outcome)], style: Style) {
    let wrong: Vec<_> = done.iter().filter(|(_, outcome)| !outcome.is_ok()).collect();
    for (row, outcome) in &wrong {
        let _ = writeln!(out, "\n{}: {}: {}", style.paint("fail", Verdict::Fail), row.component, row.input);
        let _ = writeln!(out, "  should: {}", row.should);
        if let Some(worst) = outcome.worst {
            let (worst, unit) = (error(worst, row.unit), row.unit.name());
            let _ = writeln!(out, "  error: {worst} {unit}; allowed: {}", short(row.allowed));
        }
        if let Some(reach) = outcome.reach {
            let by_24 = reach.missed_by_24_bits.map(|(missed, _)| format!(", {missed} with 24 bits"));
            let _ = writeln!(out, "  lost: {} of {}{}", reach.missed, reach.of, by_24.unwrap_or_default());
        }
        for line in
            Some(happened(outcome)).into_iter().filter(|words| !words.is_empty()).chain(outcome.wrong.clone())
        {
            let _ = writeln!(out, "  {line}");
        }
    }
    let verdict = if wrong.is_empty() { Verdict::Pass } else { Verdict::Fail };
    let seconds: f64 = done.iter().map(|(_, outcome)| outcome.time.as_secs_f64()).sum();
    let _ = writeln!(
        out,
        "\n{}: {} of {} rows are as they should be; {seconds:.1} s",
        style.paint(&verdict.to_string(), verdict),
        done.len() - wrong.len(),
        done.len()
    );
    out.push_str(
        "error: the worst, against an oracle in f64; rel: of the true value; ulp32, ulp64: in steps of f32 or f64 there, of which rounding is up to half; abs: as it is\n\
         lost/53b, lost/24b: entries, lights, texels or variates that no variate of 53 bits (of 24: one f32) reaches or tells apart\n\
         nothing there: no such question, as where a density, a weight or an error is asked for\n",
    );
    if done.iter().any(|(row, _)| row.input.contains(", even in ")) {
        out.push_str(
            "even in v, even in cos theta: how directions are spread inside a row of texels; guides, alias table: of a packed map\n",
        );
    }
}

fn mark(is_ok: bool, style: Style) -> String {
    let (word, verdict) = if is_ok { ("ok  ", Verdict::Pass) } else { ("FAIL", Verdict::Fail) };
    style.paint(word, verdict)
}

/// Below a row, in lines that are not too wide.
fn wrapped(out: &mut String, words: &str) {
    const INDENT: usize = 8;
    let mut column = 0;
    for word in words.split(' ') {
        let width = word.chars().count();
        if column == 0 || column + 1 + width > WIDTH {
            let _ = write!(out, "{}{:INDENT$}", if column == 0 { "" } else { "\n" }, "");
            column = INDENT;
        } else {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += width;
    }
    out.push('\n');
}

/// In words, with what a variate of 24 bits leaves out.
fn happened(outcome: &Outcome) -> String {
    let by_24 = outcome.reach.and_then(|reach| reach.missed_by_24_bits).filter(|(missed, _)| *missed > 0);
    let by_24 = by_24.map(|(_, mass)| format!("{:.1e} of the mass needs more than 24 bits", mass));
    [Some(outcome.happened.clone()).filter(|words| !words.is_empty()), by_24]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>()
        .join("; ")
}

/// An error; how much less than a thousandth of a step it is tells nobody anything.
fn error(worst: f64, unit: Unit) -> String {
    match unit {
        Unit::UlpF32 | Unit::UlpF64 if worst > 0.0 && worst < 1e-3 => "<0.001".to_owned(),
        _ => short(worst),
    }
}

fn short(x: f64) -> String {
    match x {
        0.0 => "0".to_owned(),
        x if (0.01..1000.0).contains(&x) => {
            format!("{:.3}", x).trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        x => format!("{x:.1e}"),
    }
}

/// Every row and what happened. `schema_version` grows when the meaning of a field changes.
#[cfg(feature = "json")]
pub fn stress_to_json(done: &[(Row, Outcome)]) -> serde_json::Value {
    use serde_json::json;
    let rows = done.iter().map(|(row, outcome)| {
        let reach = outcome.reach.map(|reach| {
            json!({
                "of": reach.of,
                "missed": reach.missed,
                "missed_by_24_bits": reach.missed_by_24_bits.map(|(missed, _)| missed),
                "mass_missed_by_24_bits": reach.missed_by_24_bits.map(|(_, mass)| mass),
            })
        });
        let relative = outcome.relative.map(|relative| {
            json!({
                "share": relative.share,
                "heavy": relative.heavy,
                "worst": relative.worst,
                "light": relative.light,
                "of_one_step": relative.of_one_step,
                "worst_of_light": relative.worst_of_light,
            })
        });
        json!({
            "component": row.component.name(),
            "input": row.input,
            "should": row.should,
            "kind": row.kind.name(),
            "happened": outcome.happened,
            // An infinite error is no JSON number; the row is not ok then.
            "worst_error": outcome.worst,
            "allowed_error": row.allowed,
            "unit": row.unit.name(),
            "relative": relative,
            "unreachable": reach,
            "ok": outcome.is_ok(),
            "wrong": outcome.wrong,
            "heavy": row.heavy,
            "seconds": outcome.time.as_secs_f64(),
        })
    });
    json!({
        "kind": "stress",
        "schema_version": 2,
        "program": concat!("warpcheck ", env!("CARGO_PKG_VERSION")),
        "ok": done.iter().all(|(_, outcome)| outcome.is_ok()),
        "rows": rows.collect::<Vec<_>>(),
    })
}
