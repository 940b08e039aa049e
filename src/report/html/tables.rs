//! Tables of what was found: faults, extremes, calibration.

use super::super::Twins;
#[cfg(feature = "render")]
use super::page::Failure;
use super::page::{Block, Cell, Column, Page, Row, Section, Table};
use super::verify::count;
use crate::calibration::Calibration;
use crate::fault::{Help, Outcome, Plan, Score};
use crate::verify::Verdict;

impl Page {
    /// What the battery says of faults and of their correct twins.
    pub fn faults(&mut self, outcomes: &[Outcome], twins: &Twins, plan: &Plan) -> &mut Self {
        let score = Score::of(outcomes);
        let rejected: u64 = twins.rejected.iter().map(|(_, times)| times).sum();
        let rows = outcomes.iter().map(|o| {
            let verdict = match (o.is_caught(), o.diagnosed) {
                (true, true) => Verdict::Pass,
                (true, false) => Verdict::Inconclusive,
                (false, _) => Verdict::Fail,
            };
            let said = match (o.diagnosed, o.help) {
                (false, _) => "wrong",
                (true, Help::None) => "right",
                (true, Help::Rivals) => "right, by a density that its author named",
                (true, Help::CheckName) => "right, by the name of the check",
            };
            let samples = o.samples.map_or(f64::NAN, |n| n as f64);
            Row::new([
                Cell::verdict(verdict, o.name),
                Cell::new(o.caught_by.join(", ")),
                Cell::number(samples, o.samples.map_or("–".into(), count)),
                Cell::number(o.caught as f64 / o.of.max(1) as f64, format!("{} of {}", o.caught, o.of)),
                Cell::new(said),
                Cell::new(o.diagnosis.clone()),
            ])
            .judged(verdict)
        });
        let table = Table {
            caption: format!("{} mistakes, each beside a correct twin", outcomes.len()),
            columns: vec![
                Column::words("fault"),
                Column::words("caught by"),
                Column::numbers("samples").about("that it took: the median over the seeds"),
                Column::numbers("seeds").about("with which it was caught"),
                Column::words("diagnosis"),
                Column::words("what was said"),
            ],
            rows: rows.collect(),
            filter: true,
        };
        self.section(
            Section::new("faults", "Faults, and what catches them")
                .short("Faults")
                .with(Block::Words {
                    text: format!(
                        "Caught {} of {}, diagnosed {}; {} of {} runs of correct twins passed. At most {} samples, {} seeds from {}.",
                        score.caught,
                        score.faults,
                        score.diagnosed,
                        twins.runs - rejected,
                        twins.runs,
                        count(plan.samples),
                        plan.seeds,
                        plan.seed
                    ),
                })
                .with(Block::Table(table)),
        )
    }

    /// How often right samplers fail, beside how often they may.
    ///
    /// # Errors
    /// As [`calibration_plot`](super::super::calibration_plot).
    pub fn calibration(&mut self, calibration: &Calibration) -> Result<&mut Self, std::fmt::Error> {
        let holds = calibration.holds();
        let text = super::super::calibration_table(calibration, super::super::Style::Plain);
        let svg = super::super::calibration_plot(calibration)?;
        self.judged(if holds { Verdict::Pass } else { Verdict::Fail })
            .says(format!(
                "{} runs of right samplers: {}",
                count(calibration.runs),
                if holds { "no rate is over its level." } else { "something is not what it claims." }
            ))
            .fact("runs", count(calibration.runs))
            .fact("samples each", count(calibration.samples))
            .fact("seed", calibration.seed.to_string())
            .section(
                Section::new("calibration", "False alarms")
                    .with(Block::Plots {
                        plots: vec![(
                            svg,
                            "Rates of false alarms beside their levels, and p-values beside the uniform law"
                                .into(),
                        )],
                    })
                    .with(Block::Text { text }),
            );
        Ok(self)
    }
}

#[cfg(feature = "render")]
impl Page {
    /// What extremes did, beside what they should.
    pub fn stress(&mut self, done: &[(crate::stress::Row, crate::stress::Outcome)]) -> &mut Self {
        let wrong: Vec<_> = done.iter().filter(|(_, outcome)| !outcome.is_ok()).collect();
        let verdict = if wrong.is_empty() { Verdict::Pass } else { Verdict::Fail };
        let mut section = Section::new("stress", "Extreme inputs").short("Extremes").with(Block::Words {
            text: format!("{} of {} rows are as they should be.", done.len() - wrong.len(), done.len()),
        });
        if !wrong.is_empty() {
            let items = wrong.iter().map(|(row, outcome)| Failure {
                name: format!("{}: {}", row.component, row.input),
                id: "stress".into(),
                status: Verdict::Fail.to_string(),
                says: outcome.wrong.join("; "),
                checks: row.should.clone(),
                replay: format!("warpcheck stress {}", row.component),
            });
            section.blocks.push(Block::Failures { items: items.collect(), more: 0 });
        }
        let rows = done.iter().map(|(row, outcome)| {
            let verdict = if outcome.is_ok() { Verdict::Pass } else { Verdict::Fail };
            let worst = outcome.worst;
            let reach = outcome.reach;
            let number = |x: Option<f64>| Cell::number(x.unwrap_or(f64::NAN), x.map_or(String::new(), short));
            let by_24 = reach.and_then(|r| r.missed_by_24_bits).map(|(missed, _)| missed as f64);
            Row::new([
                Cell::verdict(verdict, row.input.clone()),
                Cell::new(row.component.name()),
                Cell::new(row.should.clone()),
                number(worst),
                number(worst.map(|_| row.allowed)),
                Cell::new(if worst.is_some() { row.unit.name() } else { "" }),
                number(reach.map(|r| r.missed as f64)),
                number(by_24),
                Cell::new(outcome.happened.clone()),
            ])
            .judged(verdict)
        });
        section.blocks.push(Block::Table(Table {
            caption: "error: the worst, against an oracle in f64; ulp: in steps of f32 or f64 there".into(),
            columns: vec![
                Column::words("input"),
                Column::words("of"),
                Column::words("what should happen"),
                Column::numbers("error"),
                Column::numbers("allowed"),
                Column::words("in"),
                Column::numbers("lost/53b").about(
                    "entries, lights, texels or variates that no variate of 53 bits reaches or tells apart; empty: no such question",
                ),
                Column::numbers("lost/24b").about("those that none of 24 bits, a single f32, does"),
                Column::words("what happened"),
            ],
            rows: rows.collect(),
            filter: true,
        }));
        self.judged(verdict).section(section)
    }
}

#[cfg(feature = "render")]
fn short(x: f64) -> String {
    match x {
        0.0 => "0".to_owned(),
        x if (0.01..1e6).contains(&x) => {
            format!("{x:.3}").trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        x => format!("{x:.1e}"),
    }
}
