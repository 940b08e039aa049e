//! What the battery says of the fault collection: a table for people, JSON for programs.

use super::table::Style;
use crate::fault::{Help, Outcome, Score};
use crate::verify::Verdict;
use std::fmt::Write;

/// How often correct twins did not pass.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Twins {
    /// How many twins there are.
    pub twins: usize,
    /// Runs over all of them and all seeds.
    pub runs: u64,
    /// Names of those that did not pass, and how often.
    pub rejected: Vec<(String, u64)>,
}

/// What of [`fault_table`] is not plain.
const LEGEND: &str = "\
caught by: the first check that failed of the whole samples, and how many more did; (!): none of those that were to catch it
samples: the fewest of 1k, 2k, 5k, 10k, … with which it is caught, the median over the seeds; -: nothing is drawn, or most seeds don't catch it
seeds: with how many it is caught, of those that it was tried with; one where chance has no part
diagnosis: of the whole samples of the first seed; unknown: that nothing known explains them, or nothing is said
";

/// A line for every fault, and the score.
pub fn fault_table(outcomes: &[Outcome], twins: &Twins, style: Style) -> String {
    let mut text = String::new();
    let width = outcomes.iter().map(|o| o.name.len()).max().unwrap_or(5).max(5);
    let checks = |o: &Outcome| {
        let more = if o.caught_by.len() > 1 {
            format!(" and {} more", o.caught_by.len() - 1)
        } else {
            String::new()
        };
        let first = o.caught_by.first().map_or("-", String::as_str);
        // By none that was to catch it.
        format!("{first}{more}{}", if o.as_expected || o.caught == 0 { "" } else { " (!)" })
    };
    let by = outcomes.iter().map(|o| checks(o).len()).max().unwrap_or(9).max(9);
    let _ = writeln!(
        text,
        "{:width$}  {:by$}  {:>8}  {:>7}  diagnosis",
        "fault", "caught by", "samples", "seeds"
    );
    for o in outcomes {
        let samples = o.samples.map_or("-".to_owned(), count);
        let seeds = format!("{}/{}", o.caught, o.of);
        let said = match (o.diagnosed, o.help) {
            (false, _) if o.unknown => "unknown",
            (false, _) => "wrong",
            (true, Help::None) => "right",
            (true, Help::Rivals) => "right, by a density that its author named",
            (true, Help::CheckName) => "right, by the name of the check",
        };
        let line = format!("{:width$}  {:by$}  {samples:>8}  {seeds:>7}  {said}", o.name, checks(o));
        let good = o.is_caught() && o.as_expected && o.diagnosed;
        let verdict = match (o.is_caught(), good) {
            (false, _) => Verdict::Fail,
            (true, false) => Verdict::Inconclusive,
            (true, true) => Verdict::Pass,
        };
        let line = if good { line } else { style.paint(&line, verdict) };
        let _ = writeln!(text, "{line}");
        if !good && !o.diagnosis.is_empty() {
            let _ = writeln!(text, "    {}", o.diagnosis);
        }
    }
    let score = Score::of(outcomes);
    let percent = 100.0 * score.diagnosed as f64 / score.faults.max(1) as f64;
    let _ = writeln!(
        text,
        "caught {} of {}; diagnosed {} ({percent:.0}%), {} of them without help; correct twins: {}",
        score.caught,
        score.faults,
        score.diagnosed,
        score.unaided,
        match twins.runs {
            0 => "not tried".to_owned(),
            runs => {
                let rejected: u64 = twins.rejected.iter().map(|(_, times)| times).sum();
                format!("{} of {runs} runs passed", runs - rejected)
            }
        }
    );
    let held: Vec<&Outcome> = outcomes.iter().filter(|o| o.held_back).collect();
    if !held.is_empty() {
        let score = Score::of(held.iter().copied());
        let _ = writeln!(
            text,
            "of the {} held back: caught {}, diagnosed {}",
            score.faults, score.caught, score.diagnosed
        );
    }
    for (name, times) in &twins.rejected {
        let _ = writeln!(text, "    did not pass, {times} times: {name}");
    }
    if !outcomes.is_empty() {
        let _ = write!(text, "\n{LEGEND}");
    }
    text
}

/// 1000 as 1k, 2000000 as 2M.
fn count(n: u64) -> String {
    match n {
        n if n >= 1_000_000 && n.is_multiple_of(1_000_000) => format!("{}M", n / 1_000_000),
        n if n >= 1000 && n.is_multiple_of(1000) => format!("{}k", n / 1000),
        n => n.to_string(),
    }
}

/// The same with all that was said.
#[cfg(feature = "json")]
pub fn faults_to_json(outcomes: &[Outcome], twins: &Twins, plan: &crate::fault::Plan) -> serde_json::Value {
    use serde_json::json;
    let score = Score::of(outcomes);
    let faults = outcomes.iter().map(|o| {
        json!({
            "name": o.name,
            "caught_by": o.caught_by,
            "as_expected": o.as_expected,
            "seeds_caught": o.caught,
            "seeds": o.of,
            "samples_median": o.samples,
            "diagnosed": o.diagnosed,
            "unknown": o.unknown,
            "help": match o.help { Help::None => "none", Help::Rivals => "rivals", Help::CheckName => "name of the check" },
            "held_back": o.held_back,
            "diagnosis": o.diagnosis,
        })
    });
    let rejected = twins.rejected.iter().map(|(name, times)| json!({ "name": name, "times": times }));
    json!({
        "kind": "faults",
        "schema_version": 2,
        "program": concat!("warpcheck ", env!("CARGO_PKG_VERSION")),
        "samples": plan.samples,
        "seed": plan.seed,
        "seeds": plan.seeds,
        "alpha": plan.alpha,
        "faults": faults.collect::<Vec<_>>(),
        "score": { "faults": score.faults, "caught": score.caught, "diagnosed": score.diagnosed, "unaided": score.unaided },
        "twins": { "twins": twins.twins, "runs": twins.runs, "rejected": rejected.collect::<Vec<_>>() },
    })
}
