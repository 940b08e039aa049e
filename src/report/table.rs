//! The table that a run prints.

use crate::verify::{Evidence, Report, Verdict, p_value};
use std::fmt::Write;

/// How text is set off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Style {
    /// Plain text.
    #[default]
    Plain,
    /// ANSI colours, for a terminal.
    Colour,
}

impl Style {
    pub(super) fn paint(self, text: &str, verdict: Verdict) -> String {
        let code = match verdict {
            Verdict::Pass => "32",
            Verdict::Inconclusive => "33",
            Verdict::Fail => "1;31",
        };
        if self == Self::Colour { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_owned() }
    }
}

/// One line a sampler; below them what did not pass, with the line that replays it, and the sum of it all.
///
/// `replay` makes the command that examines one sampler again.
pub fn table(report: &Report, style: Style, replay: impl Fn(&str) -> String) -> String {
    let mut out = String::new();
    let names = report.examinations.iter().map(|e| e.name.len());
    let name_width = names.max().unwrap_or(0).max("sampler".len());
    let _ = writeln!(
        out,
        "{:name_width$}  {:12}  {:12} {:>10} {:>9}  {:>20}  {:>9}  {:>15}  {:>7}",
        "sampler",
        "domain",
        "verdict",
        "samples",
        "rejected",
        "integral of density",
        "least p",
        "would have seen",
        "time"
    );
    for (i, e) in report.examinations.iter().enumerate() {
        let verdict = report.verdict_on(i);
        let seen = e.power(report.level());
        let seen = seen.iter().find(|p| p.mass == 0.05).or(seen.first());
        let seen = seen.map_or("-".to_owned(), |p| format!("{} on {}%", percent(p.error), 100.0 * p.mass));
        let p = report
            .adjusted_p(i)
            .map_or("-".to_owned(), |p| p_value(p).trim_start_matches("= ").replace("< ", "<"));
        let _ = writeln!(
            out,
            "{:name_width$}  {:12}  {} {:>10} {:>9}  {:>20}  {:>9}  {:>15}  {:>6.2}s",
            e.name,
            e.domain,
            style.paint(&format!("{verdict:12}"), verdict),
            e.samples,
            percent(e.rejected as f64 / e.samples.max(1) as f64),
            integral(e.integral),
            p,
            seen,
            e.time.as_secs_f64()
        );
    }
    for (i, e) in report.examinations.iter().enumerate() {
        let verdict = report.verdict_on(i);
        if verdict == Verdict::Pass {
            continue;
        }
        let _ = writeln!(out, "\n{}: {}", style.paint(&verdict.to_string(), verdict), e.name);
        let _ = report.write_failure(&mut out, i);
        let _ = writeln!(out, "  replay: {}", replay(&e.name));
    }
    let count = |verdict| (0..report.examinations.len()).filter(|&i| report.verdict_on(i) == verdict).count();
    let certain = report
        .examinations
        .iter()
        .flat_map(|e| &e.findings)
        .filter(|f| matches!(f.evidence, Evidence::Certain(_)))
        .count();
    let _ = writeln!(
        out,
        "\n{}: {} of {} samplers pass, {} fail, {} inconclusive",
        style.paint(&report.verdict().to_string(), report.verdict()),
        count(Verdict::Pass),
        report.examinations.len(),
        count(Verdict::Fail),
        count(Verdict::Inconclusive)
    );
    let _ = writeln!(
        out,
        "seed {}; {certain} certain checks, {} p-values corrected together (Holm): a run of right samplers fails with probability {:?} at most",
        report.seed, report.tests, report.alpha
    );
    let _ = writeln!(
        out,
        "would have seen: the relative error of the density over that share of the mass in one piece, that is caught with probability 0.99"
    );
    out
}

fn percent(share: f64) -> String {
    match 100.0 * share {
        0.0 => "0".to_owned(),
        x if x < 0.01 => format!("{x:.0e}%"),
        x if x < 10.0 => format!("{x:.2}%"),
        x => format!("{x:.1}%"),
    }
}

fn integral((value, error): (f64, f64)) -> String {
    if value.is_nan() {
        return "-".to_owned(); // there is no density to integrate
    }
    format!("{value:.6} +- {error:.0e}")
}
