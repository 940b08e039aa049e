//! Samplers that were verified: what failed first, the table of samplers by checks, a section for each.

use super::super::residuals::density_heat;
use super::figure::{Figure, index_uri};
use super::line_plot::{Series, plot};
use super::page::{Block, Cell, Column, Failure, Page, Row, Section, Table, id};
use crate::picture::{Field, Heat};
use crate::verify::{Conclusion, Evidence, Examination, Power, Report, Verdict, checks, p_value};
use plotters::prelude::IntoLogRange;
use std::time::Duration;

/// Height of the maps of a sampler that passed, and of one that did not.
const HEIGHT: [usize; 2] = [144, 256];
/// Cells that can be pointed at, at most; of more the page would grow too large.
const POINTABLE: usize = 8192;
/// Samplers up to which every cell says where it is.
const PLACED: usize = 8;
/// The least p-value that has a place on a plot.
const LEAST: f64 = 1e-30;
/// Failures that are told at the top of the page.
const TOLD: usize = 100;

/// "0.31", "2.4e-7", "<1e-300".
fn p_text(p: f64) -> String {
    p_value(p).trim_start_matches("= ").replace("< ", "<")
}

fn percent(share: f64) -> String {
    match 100.0 * share {
        0.0 => "0%".to_owned(),
        x if x < 0.01 => format!("{x:.0e}%"),
        x if x < 10.0 => format!("{x:.2}%"),
        x => format!("{x:.1}%"),
    }
}

/// 1500000 as "1,500,000".
pub(super) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

pub(super) fn seconds(time: Duration) -> String {
    match time.as_secs_f64() {
        s if s < 0.1 => format!("{:.1} ms", 1e3 * s),
        s if s < 100.0 => format!("{s:.2} s"),
        s => format!("{s:.0} s"),
    }
}

impl Page {
    /// The verdicts, what failed, the table, and a section for each sampler. `replay` makes the line that examines one again.
    pub fn verify(&mut self, report: &Report, replay: impl Fn(&str) -> String) -> &mut Self {
        let number = report.examinations.len();
        let of = |verdict| (0..number).filter(|&i| report.verdict_on(i) == verdict).count();
        let mut order: Vec<usize> = (0..number).collect();
        order.sort_by_key(|&i| std::cmp::Reverse(report.verdict_on(i)));
        let time: Duration = report.examinations.iter().map(|e| e.time).sum();
        self.judged(report.verdict())
            .says(format!(
                "{} of {number} samplers pass, {} fail, {} inconclusive. {} p-values were corrected together (Holm): a run of right samplers fails with \
                 probability {:?} at most.",
                of(Verdict::Pass),
                of(Verdict::Fail),
                of(Verdict::Inconclusive),
                count(report.tests),
                report.alpha
            ))
            .fact("samplers", number.to_string())
            .fact("samples each, at most", count(report.samples))
            .fact("seed", report.seed.to_string())
            .fact("false alarms after correction", format!("{:?} of runs", report.alpha))
            .fact("p-values", count(report.tests))
            .fact("time", seconds(time));
        let bad: Vec<usize> =
            order.iter().copied().filter(|&i| report.verdict_on(i) != Verdict::Pass).collect();
        if !bad.is_empty() {
            let mut section = Section::new("failures", "What did not pass").short("Failures");
            section.blocks.push(failures(report, &bad, &replay));
            self.section(section);
        }
        let overview = Section::new("overview", "Samplers by checks").short("Checks")
            .with(Block::Table(overview(report, &order)))
            .with(words(
                "A cell has the worst verdict of the check's parts and the least of their p-values, corrected for their own number; none where no chance is \
                 involved, – where the check has no answer or does not apply. Verdicts, and “corrected p”, are after correction over the whole run. Sees: the relative error of the density over 5% of the mass (or the share that is \
                 named) in one piece that is caught with probability 0.99.",
            ));
        self.section(overview);
        self.section(Section::new("samplers", "Sampler by sampler").short("Samplers").with(words(
            "Observed, expected, and what is left of the counts in standard deviations: a right sampler leaves noise.",
        )));
        for &i in &order {
            self.section(sampler(report, i, replay(&report.examinations[i].name)));
        }
        self
    }
}

fn words(text: impl Into<String>) -> Block {
    Block::Words { text: text.into() }
}

fn failures(report: &Report, bad: &[usize], replay: &impl Fn(&str) -> String) -> Block {
    let item = |&i: &usize| {
        let e = &report.examinations[i];
        let failed = worst_findings(&report.conclusions[i]);
        let says = match (&e.diagnosis, failed.first()) {
            (Some(diagnosis), _) => diagnosis.text.clone(),
            (None, Some(c)) => format!("{}: {}", c.finding.check, c.finding.detail),
            (None, None) => "nothing was found out".to_owned(),
        };
        Failure {
            name: e.name.clone(),
            id: id("sampler", &e.name),
            status: report.verdict_on(i).to_string(),
            says,
            checks: failed.iter().map(|c| c.finding.check).collect::<Vec<_>>().join(", "),
            replay: replay(&e.name),
        }
    };
    Block::Failures { items: bad.iter().take(TOLD).map(item).collect(), more: bad.len().saturating_sub(TOLD) }
}

/// Of each check that did not pass the part that says it most clearly.
fn worst_findings(conclusions: &[Conclusion]) -> Vec<&Conclusion> {
    let mut worst: Vec<&Conclusion> = Vec::new();
    let bad = |c: &&Conclusion| c.verdict != Verdict::Pass && c.finding.evidence != Evidence::Unanswered;
    let rank = |c: &Conclusion| (std::cmp::Reverse(c.verdict), c.adjusted_p.unwrap_or(0.0));
    for conclusion in conclusions.iter().filter(bad) {
        match worst.iter_mut().find(|c| c.finding.check == conclusion.finding.check) {
            Some(known) if rank(conclusion).partial_cmp(&rank(known)) == Some(std::cmp::Ordering::Less) => {
                *known = conclusion;
            }
            Some(_) => {}
            None => worst.push(conclusion),
        }
    }
    worst.sort_by_key(|c| std::cmp::Reverse(c.verdict));
    worst
}

fn overview(report: &Report, order: &[usize]) -> Table {
    let mut names: Vec<&str> = Vec::new();
    for finding in report.examinations.iter().flat_map(|e| &e.findings) {
        if !names.contains(&finding.check) {
            names.push(finding.check);
        }
    }
    // In the order of the battery, and then what is none of it.
    let place = |name: &str| checks().position(|(known, _)| known == name).unwrap_or(usize::MAX);
    names.sort_by_key(|name| place(name));
    let about = |name: &str| checks().find(|(known, _)| *known == name).map_or("", |(_, about)| about);
    let columns = [
        Column::words("sampler"),
        Column::words("verdict"),
        Column::numbers("corrected p").about("the least of the sampler, corrected over the whole run"),
    ]
    .into_iter()
    .chain([Column::numbers("sees").about(
        "relative error of the density over 5% of the mass in one piece, caught with probability 0.99",
    )])
    .chain(names.iter().map(|name| Column::numbers(*name).about(about(name))))
    .chain([Column::numbers("samples"), Column::numbers("time")]);
    let rows = order.iter().map(|&i| {
        let e = &report.examinations[i];
        let verdict = report.verdict_on(i);
        let p = report.adjusted_p(i);
        let power = e.power(report.level());
        let seen = power.iter().find(|p| p.mass == 0.05).or(power.first());
        let sees = |p: &Power| match p.mass {
            0.05 => percent(p.error),
            mass => format!("{} on {:.0}%", percent(p.error), 100.0 * mass),
        };
        let order = match verdict {
            Verdict::Fail => "0",
            Verdict::Inconclusive => "1",
            Verdict::Pass => "2",
        };
        let mut judged = Cell::verdict(verdict, verdict.to_string());
        judged.sort = Some(order.to_owned());
        let head = [
            Cell::new(e.name.clone()).link(id("sampler", &e.name)).about(e.domain),
            judged,
            Cell::number(p.unwrap_or(f64::NAN), p.map_or("–".to_owned(), p_text)),
            Cell::number(seen.map_or(f64::NAN, |p| p.error), seen.map_or("–".to_owned(), sees)),
        ];
        let of_checks = names.iter().map(|name| check_cell(&report.conclusions[i], name));
        let tail = [
            Cell::number(e.samples as f64, count(e.samples)),
            Cell::number(e.time.as_secs_f64(), seconds(e.time)),
        ];
        Row::new(head.into_iter().chain(of_checks).chain(tail)).judged(verdict)
    });
    Table {
        caption: format!("{} samplers; those that did not pass come first; a heading sorts", order.len()),
        columns: columns.collect(),
        rows: rows.collect(),
        filter: true,
    }
}

/// The worst of a check's findings.
fn check_cell(conclusions: &[Conclusion], check: &str) -> Cell {
    let mine = || conclusions.iter().filter(|c| c.finding.check == check);
    let answered = mine().filter(|c| c.finding.evidence != Evidence::Unanswered);
    let Some(verdict) = answered.clone().map(|c| c.verdict).max() else {
        let why = mine().next().map_or("does not apply", |c| &c.finding.detail);
        return Cell::number(f64::NAN, "–").about(why);
    };
    // What this check alone would say: its least p-value, corrected for its own parts. The verdict is that of the whole run.
    let ps =
        answered.clone().filter_map(|c| c.finding.evidence.p_values()).map(|(_, conservative)| conservative);
    let (parts, least) = ps.fold((0.0, f64::INFINITY), |(n, least), p| (n + 1.0, p.min(least)));
    let p = (parts > 0.0).then(|| (parts * least).min(1.0));
    let worst = answered
        .filter(|c| c.verdict == verdict)
        .min_by(|a, b| a.adjusted_p.unwrap_or(2.0).total_cmp(&b.adjusted_p.unwrap_or(2.0)));
    let mut cell = match p {
        // What is certain sorts as its p-value would: 0 if it fails.
        Some(p) => Cell::number(p, p_text(p)),
        None => Cell::number(if verdict == Verdict::Pass { 2.0 } else { 0.0 }, ""),
    };
    cell.status = Some(verdict.to_string());
    cell.about(worst.map_or(String::new(), |c| c.finding.detail.clone()))
}

fn sampler(report: &Report, i: usize, replay: String) -> Section {
    let e = &report.examinations[i];
    let verdict = report.verdict_on(i);
    let mut section = Section::new(id("sampler", &e.name), e.name.clone());
    section.status = Some(verdict.to_string());
    section.open = Some(verdict != Verdict::Pass);
    section.aside = format!("{}, {} samples, {}", e.domain, count(e.samples), seconds(e.time));
    let (integral, error) = e.integral;
    if !integral.is_nan() {
        section.blocks.push(words(format!(
            "The density per {} integrates to {integral:.6} ± {error:.0e}; {} of {} samples were rejected.",
            e.per,
            count(e.rejected),
            count(e.samples)
        )));
    }
    if let Some(diagnosis) = &e.diagnosis {
        section.blocks.push(words(format!("Diagnosis: {}", diagnosis.text)));
    }
    if verdict != Verdict::Pass {
        let items = worst_findings(&report.conclusions[i]).into_iter().map(|c| {
            let part =
                if c.finding.part.is_empty() { String::new() } else { format!(" ({})", c.finding.part) };
            let p = c.adjusted_p.map_or(String::new(), |p| format!("; p {} after correction", p_value(p)));
            (c.verdict.to_string(), format!("{}{part}: {}{p}", c.finding.check, c.finding.detail))
        });
        section.blocks.push(Block::List { items: items.collect() });
    }
    section.blocks.push(Block::Command { line: replay });
    if !e.cells.is_empty() {
        section.blocks.push(maps(report, i, verdict));
    }
    section.blocks.extend(plots(report, e));
    section.blocks.push(Block::More {
        summary: format!("all {} findings", e.findings.len()),
        blocks: vec![Block::Table(findings(&report.conclusions[i]))],
    });
    let worst = e.worst_cells(10);
    if !worst.is_empty() {
        section.blocks.push(Block::More {
            summary: "places with the largest residuals".into(),
            blocks: vec![Block::Table(worst_places(e))],
        });
    }
    if !e.edges.is_empty() {
        section.blocks.push(Block::More {
            summary: edge_summary(e),
            blocks: vec![
                words("Each value along each variate, the others at 1/2. The check “domain” tries all combinations, and the knots of tables."),
                Block::Table(edges(e)),
            ],
        });
    }
    section.blocks.extend(timing(e));
    section
}

/// Observed, expected and residual, with the counts of the cells to point at.
fn maps(report: &Report, i: usize, verdict: Verdict) -> Block {
    let e = &report.examinations[i];
    let height = HEIGHT[usize::from(verdict != Verdict::Pass)];
    let map = e.map(if e.axes == 2 { height } else { height / 2 });
    let field =
        |values: &[f64]| Field::new(map.width, map.height, values.to_vec()).expect("a map's own shape");
    let [observed, expected, residual] = [&map.observed, &map.expected, &map.residual].map(|v| field(v));
    let heat = density_heat([&observed, &expected]);
    let unit = format!("density per {}", e.per);
    let alt = |what: &str| format!("{what} of {} over its {}; {}", e.name, e.domain, e.picture_caption);
    let worst = e.cells.iter().map(|c| c.residual().abs()).filter(|r| r.is_finite()).fold(0.0, f64::max);
    let cells = e.cells.len();
    let figures = vec![
        Figure::heat("observed", &observed, heat, &unit, alt("density of the samples")).caption(format!(
            "{} samples in {} cells",
            count(e.samples),
            count(cells as u64)
        )),
        Figure::heat("expected", &expected, heat, &unit, alt("density that is claimed"))
            .caption("integral of the density over each cell"),
        Figure::heat(
            "residual",
            &residual,
            Heat::residuals(5.0),
            "(observed − expected) / standard deviation",
            format!("{}; the largest is {worst:.1} standard deviations", alt("residuals")),
        )
        .caption(e.picture_caption),
    ];
    let hover = (cells <= POINTABLE).then(|| {
        // One figure behind the point, none where nobody would see it.
        let round = |x: f64| {
            let x = if x < 1e4 { (10.0 * x).round() / 10.0 } else { x.round() };
            if x.fract() == 0.0 { serde_json::json!(x as u64) } else { serde_json::json!(x) }
        };
        let placed = verdict != Verdict::Pass || report.examinations.len() <= PLACED;
        let data = serde_json::json!({
            "index": index_uri(map.width, map.height, &map.cell),
            "observed": e.cells.iter().map(|c| c.observed).collect::<Vec<_>>(),
            "expected": e.cells.iter().map(|c| round(c.expected)).collect::<Vec<_>>(),
            "samples": e.cells.first().map_or(0, |c| c.samples),
            "others": e.cells.first().map_or(0, |c| c.others),
            "places": placed.then(|| e.cells.iter().map(|c| c.place.as_str()).collect::<Vec<_>>()),
        });
        data.to_string().replace('<', "\\u003c")
    });
    Block::Figures { figures, zoom: true, hover }
}

/// p-value against samples, and the power curves.
fn plots(report: &Report, e: &Examination) -> Option<Block> {
    let mut plots = Vec::new();
    let history: Vec<(f64, f64)> =
        e.history.iter().map(|l| ((l.samples as f64).log10(), l.p.max(LEAST).log10())).collect();
    if history.len() > 1 {
        // Logarithms on an even axis: plotters has no ticks below 1e-16 on a logarithmic one.
        let level = report.level().log10();
        let least = history.iter().map(|h| h.1).fold(level, f64::min);
        let x = history[0].0 - 0.05..history[history.len() - 1].0 + 0.05;
        let svg = plot(
            ("samples", x),
            ("p-value", least - 0.5..0.3),
            &[("p".into(), history)],
            Some((level, "level of each single test")),
            (|x| short(10.0_f64.powf(x)), power_of_ten),
        );
        let last = e.history[e.history.len() - 1];
        plots.push((
            svg,
            format!(
                "{} against the number of samples; {} in the end. A wrong sampler's falls without end, a right one's wanders",
                if e.anytime { "1 / e-value" } else { "p-value of the counts" },
                p_text(last.p)
            ),
        ));
    }
    let mut power = e.power(report.level());
    power.retain(|p| e.power_against(report.level(), p.mass, p.error).is_some());
    if let (Some(first), Some(last)) = (power.first(), power.last()) {
        // From where even the largest region is not seen, with room for the names, to where the smallest is.
        let (low, high) = (0.04 * last.error.min(first.error), 1.5 * first.error.max(last.error));
        let errors: Vec<f64> = (0..=40).map(|k| low * (high / low).powf(f64::from(k) / 40.0)).collect();
        let series: Vec<Series> = power
            .iter()
            .map(|p| {
                let at = |&x: &f64| Some((x, e.power_against(report.level(), p.mass, x)?));
                (format!("over {}% of the mass", 100.0 * p.mass), errors.iter().filter_map(at).collect())
            })
            .collect();
        let svg = plot(
            ("relative error of the density", (low..high).log_scale()),
            ("probability that it is caught", 0.0..1.0),
            &series,
            None,
            (share, |y| format!("{y:.1}")),
        );
        let each = power.iter().map(|p| format!("{} over {}%", percent(p.error), 100.0 * p.mass));
        plots.push((
            svg,
            format!(
                "Power: caught with probability 0.99 is a relative error of {} of the mass in one piece",
                each.collect::<Vec<_>>().join(", ")
            ),
        ));
    }
    (!plots.is_empty()).then_some(Block::Plots { plots })
}

/// About so many: 15849 as "16k".
fn short(n: f64) -> String {
    let unit = 10.0_f64.powf(n.log10().floor() - 1.0);
    let n = (n / unit).round() * unit;
    let whole = |x: f64| format!("{x:.1}").trim_end_matches('0').trim_end_matches('.').to_owned();
    match n {
        n if n >= 1e9 => format!("{}G", whole(n / 1e9)),
        n if n >= 1e6 => format!("{}M", whole(n / 1e6)),
        n if n >= 1e3 => format!("{}k", whole(n / 1e3)),
        n => whole(n),
    }
}

/// Whether it is 1, 2 or 5 times a power of ten; others would not fit beside these on a logarithmic axis.
fn is_round(x: f64) -> bool {
    let digit = x / 10.0_f64.powf(x.log10().floor());
    [1.0, 2.0, 5.0, 10.0].iter().any(|d| (digit - d).abs() < 1e-6)
}

/// 10 to this power.
fn power_of_ten(power: f64) -> String {
    match power.round() {
        p if (power - p).abs() > 1e-6 => String::new(),
        p if p >= -2.0 => format!("{}", 10.0_f64.powf(p)),
        p => format!("1e{p}"),
    }
}

fn share(x: f64) -> String {
    if !is_round(x) {
        return String::new();
    }
    let digits = 2.0 - (100.0 * x).log10();
    let text = format!("{:.*}", digits.clamp(0.0, 6.0) as usize, 100.0 * x);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text}%")
}

fn findings(conclusions: &[Conclusion]) -> Table {
    let rows = conclusions.iter().map(|c| {
        let p = c.finding.evidence.p_values().map(|(p, _)| p);
        let number = |p: Option<f64>| Cell::number(p.unwrap_or(f64::NAN), p.map_or("–".into(), p_text));
        let unanswered = c.finding.evidence == Evidence::Unanswered;
        Row::new([
            if unanswered {
                Cell::new(format!("– {}", c.finding.check))
            } else {
                Cell::verdict(c.verdict, c.finding.check)
            },
            Cell::new(c.finding.part.clone()),
            number(p),
            number(c.adjusted_p),
            Cell::new(c.finding.sees.clone()),
            Cell::new(c.finding.detail.clone()),
        ])
    });
    Table {
        caption: String::new(),
        columns: vec![
            Column::words("check"),
            Column::words("part"),
            Column::numbers("p").about("of this test alone"),
            Column::numbers("corrected p").about("over everything that the run tested; the largest that the errors of the expected counts allow"),
            Column::words("would have caught"),
            Column::words("what was found"),
        ],
        rows: rows.collect(),
        filter: false,
    }
}

fn worst_places(e: &Examination) -> Table {
    let rows = e.worst_cells(10).into_iter().map(|cell| {
        let residual = cell.residual();
        Row::new([
            Cell::number(-residual.abs(), format!("{residual:+.1}")),
            Cell::number(cell.observed as f64, count(cell.observed)),
            Cell::number(cell.expected, format!("{:.1}", cell.expected)),
            Cell::new(cell.place.clone()),
        ])
    });
    Table {
        caption: String::new(),
        columns: vec![
            Column::numbers("residual, σ"),
            Column::numbers("observed"),
            Column::numbers("expected"),
            Column::words("where"),
        ],
        rows: rows.collect(),
        filter: false,
    }
}

fn edge_summary(e: &Examination) -> String {
    let wrong = e.edges.iter().filter(|edge| edge.wrong.is_some()).count();
    let rejected = e.edges.iter().filter(|edge| edge.point.is_none()).count();
    format!(
        "edge probes: {} of {} are sound, {rejected} of them rejected",
        e.edges.len() - wrong,
        e.edges.len()
    )
}

/// A row for each value, a column for each variate.
fn edges(e: &Examination) -> Table {
    let variates = e.edges.iter().map(|edge| edge.variate + 1).max().unwrap_or(0);
    let values: Vec<f64> = e.edges.iter().filter(|edge| edge.variate == 0).map(|edge| edge.value).collect();
    let cell = |variate: usize, value: f64| {
        let edge = e.edges.iter().find(|edge| edge.variate == variate && edge.value == value);
        match edge {
            None => Cell::new("–"),
            Some(edge) => match (&edge.wrong, &edge.point) {
                (Some(wrong), _) => Cell::verdict(Verdict::Fail, wrong.clone()),
                (None, None) => Cell::verdict(Verdict::Pass, "rejected"),
                (None, Some(point)) => {
                    Cell::verdict(Verdict::Pass, format!("{:.4e}", edge.density)).about(format!("at {point}"))
                }
            },
        }
    };
    Table {
        caption: format!("density per {} at the point of each variate", e.per),
        columns: std::iter::once(Column::numbers("value"))
            .chain((0..variates).map(|v| Column::words(format!("variate {}", v + 1))))
            .collect(),
        rows: values
            .iter()
            .map(|&value| {
                let named = Cell::number(value, edge_name(value));
                Row::new(std::iter::once(named).chain((0..variates).map(|v| cell(v, value))))
            })
            .collect(),
        filter: false,
    }
}

/// The edge values as people write them.
fn edge_name(x: f64) -> String {
    let power = |x: f64| x > 0.0 && x.log2().fract() == 0.0;
    match x {
        0.0 => "0".into(),
        x if x < 1e-300 => "least f64".into(),
        x if x < 1e-40 => "least f32".into(),
        x if x < 0.25 && power(x) => format!("2^{}", x.log2()),
        x if x > 0.5 && power(1.0 - x) => format!("1 − 2^{}", (1.0 - x).log2()),
        x if x < 0.5 && x > 0.49 && power(0.5 - x) => format!("1/2 − 2^{}", (0.5 - x).log2()),
        x if x > 0.5 && x < 0.51 && power(x - 0.5) => format!("1/2 + 2^{}", (x - 0.5).log2()),
        x => format!("{x}"),
    }
}

fn timing(e: &Examination) -> Option<Block> {
    let total = e.time.as_secs_f64();
    if e.phases.is_empty() || !(total > 0.0) {
        return None;
    }
    let bars =
        e.phases.iter().map(|(name, time)| ((*name).to_owned(), time.as_secs_f64() / total, seconds(*time)));
    let drawing =
        e.phases.iter().find(|(name, _)| *name == "drawing").map_or(total, |(_, t)| t.as_secs_f64());
    let rate = e.samples as f64 / drawing / 1e6;
    Some(Block::Bars {
        label: format!(
            "time: {}, {rate:.1} million samples a second while drawing and counting",
            seconds(e.time)
        ),
        bars: bars.collect(),
    })
}
