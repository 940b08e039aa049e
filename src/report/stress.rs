//! What extremes did, as a table for people and as JSON for programs.

use super::table::Style;
use crate::stress::{Component, Outcome, Row};
use crate::verify::Verdict;
use std::fmt::Write;

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
    let width = |text: fn(&Row) -> &str, title: &str| {
        done.iter().map(|(row, _)| text(row).chars().count()).max().unwrap_or(0).max(title.len())
    };
    let (input, should) = (width(|row| &row.input, "input"), width(|row| &row.should, "what should"));
    for component in Component::ALL {
        let mut mine = done.iter().filter(|(row, _)| row.component == component).peekable();
        if mine.peek().is_none() {
            continue;
        }
        let _ = writeln!(
            out,
            "{}{:4}  {:input$}  {:should$}  {:>8} {:>8} {:5}  {:>5} {:>10}  what happened",
            if out.is_empty() { "" } else { "\n" },
            "",
            component.name(),
            "what should",
            "error",
            "allowed",
            "in",
            "lost",
            "at 24 bits"
        );
        for (row, outcome) in mine {
            let (error, allowed, unit) = match outcome.worst {
                Some(worst) => (short(worst), short(row.allowed), row.unit.name()),
                None => Default::default(),
            };
            let lost = outcome.reach.map_or(String::new(), |reach| reach.missed.to_string());
            let by_24 = outcome.reach.and_then(|reach| reach.missed_by_24_bits);
            let by_24 = by_24.map_or(String::new(), |(missed, _)| missed.to_string());
            let line = format!(
                "{}  {:input$}  {:should$}  {error:>8} {allowed:>8} {unit:5}  {lost:>5} {by_24:>10}  {}",
                mark(outcome, style),
                row.input,
                row.should,
                happened(outcome)
            );
            let _ = writeln!(out, "{}", line.trim_end());
        }
    }
    let wrong: Vec<_> = done.iter().filter(|(_, outcome)| !outcome.is_ok()).collect();
    for (row, outcome) in &wrong {
        let _ = writeln!(out, "\n{}: {}: {}", style.paint("fail", Verdict::Fail), row.component, row.input);
        for complaint in &outcome.wrong {
            let _ = writeln!(out, "  {complaint}");
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
    let _ = writeln!(
        out,
        "error: the worst, against an oracle in f64; rel: of the true value; ulp32, ulp64: in steps of f32 or f64 there, of which rounding is up to half\n\
         lost: entries, texels or variates that no variate of 53 bits reaches or tells apart; at 24 bits: those that a single f32 does not reach"
    );
    out
}

fn mark(outcome: &Outcome, style: Style) -> String {
    let (word, verdict) = if outcome.is_ok() { ("ok  ", Verdict::Pass) } else { ("FAIL", Verdict::Fail) };
    style.paint(word, verdict)
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
