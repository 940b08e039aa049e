//! `warpcheck faults`: the battery on broken samplers, each beside its correct twin.

use super::common::{self, DEFAULT_OUT, ReportArgument, print};
use anyhow::{Result, bail};
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use warpcheck::fault::{self, Fault, Plan, Twin};
use warpcheck::picture::write_atomically;
use warpcheck::report::html::Page;
use warpcheck::report::{self, Twins};
use warpcheck::verify::Verdict;

#[derive(Args)]
#[command(after_help = "\
Exit code 0 if every fault is caught with every seed, by a check that was to catch it, and every twin passes; of the whole collection, at least four
fifths have to be diagnosed rightly, too. 1 if not, 130 if it was stopped.")]
pub struct Arguments {
    /// Faults or families; all if none is named
    names: Vec<String>,
    /// Samples of each run, at most
    #[arg(long, default_value = "1M", value_parser = common::count, allow_negative_numbers = true)]
    samples: u64,
    /// Seeds with which each fault and each twin is tried
    #[arg(long, default_value = "20", value_parser = common::count, allow_negative_numbers = true)]
    seeds: u64,
    /// The first seed, of whose samples the diagnosis is judged; the others only count whether a fault is caught
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Probability that any correct twin is rejected, over all of them and all seeds
    #[arg(long, default_value = "0.001", value_parser = common::level, allow_negative_numbers = true)]
    alpha: f64,
    /// Only the faults, without their correct twins
    #[arg(long)]
    without_twins: bool,
    /// List the faults: what is wrong, and where it was seen
    #[arg(long, conflicts_with_all = ["json", "report"])]
    list: bool,
    /// Also write everything that was found as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgument,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    onto(arguments, None)
}

/// With what was found put onto a page of somebody else's, if there is one.
pub fn onto(arguments: &Arguments, page: Option<&mut Page>) -> Result<ExitCode> {
    let faults = choose(&arguments.names)?;
    if arguments.list {
        let lines: String = faults
            .iter()
            .map(|f| {
                format!(
                    "{}\n    {}\n    seen: {}\n    caught by: {}\n",
                    f.name,
                    f.wrong,
                    f.seen,
                    f.caught_by.join(", ")
                )
            })
            .collect();
        print(&lines)?;
        return Ok(ExitCode::SUCCESS);
    }
    arguments.json.as_deref().map(|file| common::output_file(file, Path::new(DEFAULT_OUT))).transpose()?;
    let mut twins: Vec<Twin> = Vec::new();
    if !arguments.without_twins {
        for fault in &faults {
            if !twins.iter().any(|twin| twin.name == fault.twin.name) {
                twins.push(fault.twin);
            }
        }
    }
    let mut plan = Plan::new(
        arguments.samples,
        arguments.seeds,
        arguments.seed,
        arguments.alpha,
        faults.len() + twins.len(),
    );
    let dossier =
        if page.is_some() { None } else { arguments.report.begin("Faults, and what catches them")? };
    let stop = common::stop_on_ctrl_c();
    plan.stop = Some(Arc::clone(&stop));
    let bar = common::progress((faults.len() + twins.len()) as u64, "specimens");
    let mut outcomes = Vec::new();
    for fault in &faults {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        bar.set_message(fault.name);
        outcomes.extend(fault::examine(fault, &plan));
        bar.inc(1);
    }
    let mut found = Twins::default();
    for twin in &twins {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        bar.set_message(twin.name);
        let (rejected, of, first) = fault::examine_twin(twin, &plan);
        found.twins += 1;
        found.runs += of;
        if let Some(report) = first {
            found.rejected.push((format!("{}; {report}", twin.name), rejected));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    print(&report::fault_table(&outcomes, &found, common::style()))?;
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::faults_to_json(&outcomes, &found, &plan));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    let score = fault::Score::of(&outcomes);
    // Four fifths of the whole collection; a part of it may be all that is left.
    let enough = !arguments.names.is_empty() || 5 * score.diagnosed >= 4 * score.faults;
    let expected = outcomes.iter().all(|outcome| outcome.as_expected);
    let good = score.caught == score.faults && expected && enough && found.rejected.is_empty();
    if let Some(page) = page {
        page.faults(&outcomes, &found, &plan);
    }
    common::finish(dossier, |page| {
        page.judged(if good { Verdict::Pass } else { Verdict::Fail })
            .says(format!("{} of {} faults were examined.", outcomes.len(), faults.len()))
            .fact("false alarms of twins, at most", format!("{:?}", arguments.alpha))
            .faults(&outcomes, &found, &plan);
    })?;
    Ok(match () {
        () if stop.load(Ordering::Relaxed) => {
            print(&format!("stopped: {} of {} faults were examined\n", outcomes.len(), faults.len()))?;
            ExitCode::from(130)
        }
        () if good => ExitCode::SUCCESS,
        () => ExitCode::from(1),
    })
}

fn choose(names: &[String]) -> Result<Vec<Fault>> {
    let mut all = fault::all();
    for name in names {
        if !all.iter().any(|f| f.name == name || f.family() == name) {
            bail!("there is no fault `{name}` (--list shows all)");
        }
    }
    if !names.is_empty() {
        all.retain(|f| names.iter().any(|name| f.name == name || f.family() == name));
    }
    Ok(all)
}
