//! The table that a run prints.

use crate::statistics::normal;
use crate::verify::{CellFigure, Evidence, Examination, Report, Verdict, p_value};
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
    let lines = (0..report.examinations.len()).map(|i| Line::of(report, &report.examinations[i].name, &[i]));
    told(report, &lines.collect::<Vec<_>>(), style, replay)
}

/// The same with one line for what passed of a family (the name up to its first `/`), so that a long list fits a screen: the least p-value, the
/// weakest power, and the sums of samples and times.
///
/// ```
/// use warpcheck::sampler::{UniformHemisphere, UniformSphere};
/// use warpcheck::verify::{Report, Settings, verify};
/// let settings = Settings { samples: 20_000, ..Settings::default() };
/// let first = verify(&UniformSphere).name("uniform/sphere").settings(settings.clone()).examine();
/// let second = verify(&UniformHemisphere).name("uniform/hemisphere").settings(settings.clone()).examine();
/// let report = Report::new(vec![first, second], &settings);
/// let table = warpcheck::report::table_by_family(&report, Default::default(), |name| name.to_owned());
/// assert!(table.contains("uniform (2)") && !table.contains("uniform/sphere"));
/// ```
pub fn table_by_family(report: &Report, style: Style, replay: impl Fn(&str) -> String) -> String {
    let mut families: Vec<(String, Vec<usize>)> = Vec::new();
    for (i, e) in report.examinations.iter().enumerate() {
        let family = e.name.split('/').next().unwrap_or(&e.name);
        let passed = report.verdict_on(i) == Verdict::Pass;
        match families.iter_mut().find(|(name, _)| passed && name == family) {
            Some((_, members)) => members.push(i),
            None if passed => families.push((family.to_owned(), vec![i])),
            None => families.push((e.name.clone(), vec![i])),
        }
    }
    let lines = families.iter().map(|(name, members)| match members.as_slice() {
        [one] => Line::of(report, &report.examinations[*one].name, members),
        _ => Line::of(report, &format!("{name} ({})", members.len()), members),
    });
    told(report, &lines.collect::<Vec<_>>(), style, replay)
}

/// A line of the table: one sampler, or several of a family that passed.
struct Line {
    name: String,
    domain: String,
    verdict: Verdict,
    samples: u64,
    rejected: u64,
    /// The one that is farthest from 1.
    integral: (f64, f64),
    p: Option<f64>,
    seen: Option<(f64, f64)>,
    seconds: f64,
}

impl Line {
    fn of(report: &Report, name: &str, members: &[usize]) -> Self {
        let all = || members.iter().map(|&i| &report.examinations[i]);
        let seen = |e: &Examination| {
            let power = e.power(report.level());
            power.iter().find(|p| p.mass == 0.05).or(power.first()).map(|p| (p.error, p.mass))
        };
        let mut domains: Vec<&str> = all().map(|e| e.domain).collect();
        domains.dedup();
        let far = |e: &&Examination| (e.integral.0 - 1.0).abs();
        Self {
            name: name.to_owned(),
            domain: if let [one] = domains.as_slice() { (*one).to_owned() } else { "several".to_owned() },
            verdict: members.iter().map(|&i| report.verdict_on(i)).max().unwrap_or(Verdict::Inconclusive),
            samples: all().map(|e| e.samples).sum(),
            rejected: all().map(|e| e.rejected).sum(),
            integral: all()
                .max_by(|a, b| far(a).total_cmp(&far(b)))
                .map_or((f64::NAN, f64::NAN), |e| e.integral),
            p: members.iter().filter_map(|&i| report.adjusted_p(i)).min_by(f64::total_cmp),
            seen: all().filter_map(seen).max_by(|a, b| a.0.total_cmp(&b.0)),
            seconds: all().map(|e| e.time.as_secs_f64()).sum(),
        }
    }
}

fn told(report: &Report, lines: &[Line], style: Style, replay: impl Fn(&str) -> String) -> String {
    let mut out = String::new();
    let names = lines.iter().map(|line| line.name.len());
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
    for line in lines {
        let seen = line.seen.map_or("-".to_owned(), |(error, mass)| {
            format!("{} on {}%", percent(error), (100.0 * mass).round())
        });
        let p = line.p.map_or("-".to_owned(), |p| p_value(p).trim_start_matches("= ").replace("< ", "<"));
        let _ = writeln!(
            out,
            "{:name_width$}  {:12}  {} {:>10} {:>9}  {:>20}  {:>9}  {:>15}  {:>6.2}s",
            line.name,
            line.domain,
            style.paint(&format!("{:12}", line.verdict), line.verdict),
            line.samples,
            percent(line.rejected as f64 / line.samples.max(1) as f64),
            integral(line.integral),
            p,
            seen,
            line.seconds
        );
    }
    for (i, e) in report.examinations.iter().enumerate() {
        let verdict = report.verdict_on(i);
        if verdict == Verdict::Pass {
            continue;
        }
        let _ = writeln!(out, "\n{}: {}", style.paint(&verdict.to_string(), verdict), e.name);
        let _ = report.write_failure(&mut out, i);
        if e.cells.len() >= LEAST_CELLS {
            let residuals: Vec<f64> = e.cells.iter().map(CellFigure::residual).collect();
            let _ = writeln!(
                out,
                "  residuals of the cells, from under -5 to over 5 sigma: {}   of a right sampler: {}",
                bars(&classes(residuals.iter().map(|r| (r + 5.5) / 11.0), RESIDUALS)),
                bars(&normal_classes(residuals.len()))
            );
        }
        let _ = writeln!(out, "  replay: {}", replay(&e.name));
    }
    let count = |verdict| (0..report.examinations.len()).filter(|&i| report.verdict_on(i) == verdict).count();
    let findings = || report.examinations.iter().flat_map(|e| &e.findings);
    let certain = findings().filter(|f| matches!(f.evidence, Evidence::Certain(_))).count();
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
    let p: Vec<f64> = findings().filter_map(|f| f.evidence.p_values()).map(|(p, _)| p).collect();
    if p.len() >= LEAST_TESTS {
        let _ = writeln!(
            out,
            "p-values from 0 to 1, before correction: {} (right samplers: none crowd on the left)",
            bars(&classes(p.iter().copied(), P_VALUES))
        );
    }
    let _ = writeln!(
        out,
        "would have seen: the relative error of the density over that share of the mass in one piece, that is caught with probability 0.99"
    );
    out
}

/// Classes of residuals, of p-values; a histogram of less than so many says nothing.
const RESIDUALS: usize = 11;
const P_VALUES: usize = 20;
const LEAST_CELLS: usize = 16;
const LEAST_TESTS: usize = 60;

/// Counts of numbers in [0, 1), in so many classes; what is outside goes to the ends.
fn classes(numbers: impl Iterator<Item = f64>, classes: usize) -> Vec<f64> {
    let mut counts = vec![0.0; classes];
    numbers
        .filter(|x| !x.is_nan())
        .for_each(|x| counts[((x * classes as f64) as usize).min(classes - 1)] += 1.0);
    counts
}

/// What standard normal residuals would be like.
fn normal_classes(number: usize) -> Vec<f64> {
    let below = |z: f64| normal::sf(-z);
    let edge = |i: usize| i as f64 - 5.5;
    (0..RESIDUALS).map(|i| number as f64 * (below(edge(i + 1)) - below(edge(i)))).collect()
}

/// A histogram in a line, in eighths; what is there at all is seen.
fn bars(counts: &[f64]) -> String {
    let most = counts.iter().copied().fold(0.0, f64::max);
    let bar = |&count: &f64| match (8.0 * count / most).ceil() {
        _ if count < 0.5 => ' ',
        eighths => char::from_u32(0x2580 + (eighths as u32).clamp(1, 8)).unwrap_or(' '),
    };
    format!("|{}|", counts.iter().map(bar).collect::<String>())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn histograms_in_a_line() {
        assert_eq!(bars(&[0.0, 1.0, 8.0, 4.0]), "| ▁█▄|");
        assert_eq!(classes([-3.0, 0.0, 0.49, 0.5, 7.0, f64::NAN].into_iter(), 2), [3.0, 2.0]);
        let normal = normal_classes(1000);
        assert!((normal.iter().sum::<f64>() - 1000.0).abs() < 1e-3 && (normal[5] - 382.9).abs() < 0.1);
    }
}
