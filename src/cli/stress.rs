//! `warpcheck stress`: inputs that break `f32`, and what happens beside what should.

use super::common::{self, ReportArgument, print};
use anyhow::Result;
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use warpcheck::picture::write_atomically;
use warpcheck::report;
use warpcheck::report::html::Page;
use warpcheck::stress::{self, Component, Row};

#[derive(Args)]
pub struct Arguments {
    /// Components: discrete, triangle, solid-angle, environment, lobes, mixture; all if none is named
    components: Vec<Component>,
    /// Leave out the rows that take long or much memory
    #[arg(long)]
    quick: bool,
    /// A line for each row, however many there are
    #[arg(long)]
    long: bool,
    /// Also write everything that was found as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgument,
    /// List the rows, and do nothing
    #[arg(long, conflicts_with_all = ["json", "report"])]
    list: bool,
}

/// Rows up to which each has a line; of more, those of a component share one, so that all fits a screen.
const SHORT: usize = 24;

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    onto(arguments, None)
}

/// With what was found put onto a page of somebody else's, if there is one.
pub fn onto(arguments: &Arguments, page: Option<&mut Page>) -> Result<ExitCode> {
    let wanted = |row: &Row| {
        let named = arguments.components.is_empty() || arguments.components.contains(&row.component);
        named && !(arguments.quick && row.heavy)
    };
    let rows: Vec<Row> = stress::rows().into_iter().filter(wanted).collect();
    if arguments.list {
        return list(&rows);
    }
    arguments.json.as_deref().map(|file| common::output_file(file, Path::new(""))).transpose()?;
    let dossier = if page.is_some() { None } else { arguments.report.begin("Extreme inputs")? };
    let stop = common::stop_on_ctrl_c();
    let total = rows.len();
    let bar = common::progress(total as u64, "rows");
    let mut begun = 0;
    let done = stress::run(rows, |row| {
        bar.set_message(format!("{}: {}", row.component, row.input));
        bar.set_position(begun);
        begun += 1;
        !stop.load(Ordering::Relaxed)
    });
    bar.finish_and_clear();
    let stopped = done.len() < total;

    print(&match arguments.long || total <= SHORT {
        true => report::stress_table(&done, common::style()),
        false => report::stress_table_by_component(&done, common::style()),
    })?;
    if stopped {
        print(&format!("stopped: {} of {total} rows were run\n", done.len()))?;
    }
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::stress_to_json(&done));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    if let Some(page) = page {
        page.stress(&done);
    }
    common::finish(dossier, |page| {
        page.says(format!("{} of {total} rows were run.", done.len())).stress(&done);
    })?;
    Ok(match done.iter().all(|(_, outcome)| outcome.is_ok()) {
        _ if stopped => ExitCode::from(130),
        false => ExitCode::from(1),
        true => ExitCode::SUCCESS,
    })
}

fn list(rows: &[Row]) -> Result<ExitCode> {
    let width = rows.iter().map(|row| row.input.chars().count()).max().unwrap_or(0);
    let line = |row: &Row| {
        let heavy = if row.heavy { " (takes long)" } else { "" };
        format!("{:11}  {:width$}  {}: {}{heavy}\n", row.component, row.input, row.kind.name(), row.should)
    };
    print(&rows.iter().map(line).collect::<String>())?;
    Ok(ExitCode::SUCCESS)
}
