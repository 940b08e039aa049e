//! `warpcheck verify`: the battery on all shipped samplers, or those named.

use super::common::{self, DEFAULT_OUT, OutputFolder, ReportArgument, print};
use anyhow::{Context, Result, bail};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use warpcheck::catalogue::{self, Entry};
use warpcheck::picture::{Compression, write_atomically, write_planes, write_png};
use warpcheck::report;
use warpcheck::report::html::Page;
use warpcheck::verify::{Report, Settings, Verdict};

#[derive(Args)]
pub struct Arguments {
    /// Samplers or families; all that ship if none is named
    names: Vec<String>,
    /// Samples of each sampler
    #[arg(long, default_value = "1M", value_parser = common::count, allow_negative_numbers = true)]
    samples: u64,
    /// Seed
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Probability that a run of right samplers fails, at most
    #[arg(long, default_value = "0.001", value_parser = common::level, allow_negative_numbers = true)]
    alpha: f64,
    /// Look after every batch and stop as soon as a sampler is known to be wrong (`--samples` is the most to draw)
    #[arg(long)]
    anytime: bool,
    /// Draw for this many seconds per sampler at most
    #[arg(long, value_name = "SECONDS", value_parser = common::seconds, allow_negative_numbers = true)]
    time: Option<f64>,
    /// Leave out a check (may be given again)
    #[arg(long, value_name = "CHECK")]
    without: Vec<String>,
    /// A line for each sampler, however many there are
    #[arg(long)]
    long: bool,
    /// List the checks, and do nothing
    #[arg(long, conflicts_with_all = ["json", "report"])]
    checks: bool,
    /// Folder for pictures
    #[arg(long, value_name = "DIR", default_value = DEFAULT_OUT)]
    out: PathBuf,
    /// Also write everything that was found as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgument,
    /// List the samplers that ship, and do nothing
    #[arg(long, conflicts_with_all = ["json", "report"])]
    list: bool,
    /// Exit with 0 if nothing fails, though something is inconclusive
    #[arg(long)]
    allow_inconclusive: bool,
    /// Folder of the shipped maps and meshes
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
}

/// Samplers up to which each has a line; of more, those of a family that passed share one, so that all fits a screen.
const SHORT: usize = 24;

impl Default for Arguments {
    fn default() -> Self {
        Self {
            names: Vec::new(),
            samples: 1_000_000,
            seed: 1,
            alpha: 1e-3,
            anytime: false,
            time: None,
            without: Vec::new(),
            checks: false,
            long: false,
            out: DEFAULT_OUT.into(),
            json: None,
            report: ReportArgument::default(),
            list: false,
            allow_inconclusive: false,
            data: None,
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    onto(arguments, None)
}

/// With what was found put onto a page of somebody else's, if there is one.
pub fn onto(arguments: &Arguments, page: Option<&mut Page>) -> Result<ExitCode> {
    if arguments.checks {
        return list_checks();
    }
    for name in &arguments.without {
        if warpcheck::verify::checks().all(|(known, _)| known != name) {
            bail!("there is no check `{name}` (--checks lists them)");
        }
    }
    let data = common::data_folder(arguments.data.as_deref())?;
    let entries = catalogue::entries(&data);
    if arguments.list && arguments.names.is_empty() {
        return list(&entries.iter().collect::<Vec<_>>());
    }
    let chosen = choose(&entries, &arguments.names)?;
    if arguments.list {
        return list(&chosen);
    }
    let stop = common::stop_on_ctrl_c();
    arguments.json.as_deref().map(|file| common::output_file(file, &arguments.out)).transpose()?;
    let _folder = OutputFolder::make(&arguments.out)?;
    let dossier = match page {
        Some(_) => None,
        None => arguments.report.begin(match arguments.names.as_slice() {
            [] => "Samplers that ship".to_owned(),
            names if names.len() > 3 => format!("Samplers: {} and {} more", names[0], names.len() - 1),
            names => format!("Samplers: {}", names.join(", ")),
        })?,
    };
    let bar = common::progress(chosen.len() as u64 * arguments.samples, "samples");
    let mut settings = Settings {
        samples: arguments.samples,
        seed: arguments.seed,
        alpha: arguments.alpha,
        anytime: arguments.anytime,
        time: arguments.time.map(std::time::Duration::from_secs_f64),
        without: arguments.without.clone(),
        samplers: chosen.len() as u64,
        stop: Some(Arc::clone(&stop)),
        ..Settings::default()
    };
    // All of them before the first sample: a bad file is not to be met after the work of an hour.
    let make =
        |entry: &&Entry| entry.make().with_context(|| format!("can't make the sampler {}", entry.name));
    let subjects = chosen.iter().map(make).collect::<Result<Vec<_>>>()?;
    let mut examinations = Vec::new();
    for (i, (entry, subject)) in chosen.iter().zip(&subjects).enumerate() {
        bar.set_message(entry.name.clone());
        let (mine, before) = (bar.clone(), i as u64 * arguments.samples);
        settings.progress = Some(Arc::new(move |drawn| mine.set_position(before + drawn.samples)));
        examinations.push(subject.examine(&entry.name, &settings));
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    bar.finish_and_clear();
    let stopped = stop.load(Ordering::Relaxed);

    let report = Report::new(examinations, &settings);
    let replay = |name: &str| {
        let Arguments { seed, alpha, .. } = arguments;
        // As many as were drawn, which the clock or Ctrl-C may have made fewer than were asked for.
        let cut_short = stopped || arguments.time.is_some();
        let drawn = report.examinations.iter().find(|e| cut_short && e.name == name).map(|e| e.samples);
        let samples = drawn.unwrap_or(arguments.samples);
        // {:?}: 1e-300 is not spelled out.
        let mut line = format!("warpcheck verify {name} --samples {samples} --seed {seed} --alpha {alpha:?}");
        if arguments.anytime {
            line += " --anytime";
        }
        let quoted = |word: &str| shlex::try_quote(word).map_or_else(|_| word.to_owned(), Into::into);
        for check in &arguments.without {
            line += &format!(" --without {}", quoted(check));
        }
        if let Some(data) = &arguments.data {
            line += &format!(" --data {}", quoted(&data.to_string_lossy()));
        }
        line
    };
    let table = match arguments.long || chosen.len() <= SHORT {
        true => report::table(&report, common::style(), replay),
        false => report::table_by_family(&report, common::style(), replay),
    };
    print(&table)?;
    if stopped {
        print(&format!(
            "stopped: {} of {} samplers were examined\n",
            report.examinations.len(),
            chosen.len()
        ))?;
    }
    write_pictures(&report, arguments)?;
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::to_json(&report, replay));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    if let Some(page) = page {
        page.verify(&report, replay);
    }
    common::finish(dossier, |page| {
        if stopped {
            page.says(format!(
                "Stopped: {} of {} samplers were examined.",
                report.examinations.len(),
                chosen.len()
            ));
        }
        page.verify(&report, replay);
    })?;
    Ok(match report.verdict() {
        _ if stopped => ExitCode::from(130),
        Verdict::Fail => ExitCode::from(1),
        Verdict::Inconclusive if !arguments.allow_inconclusive => ExitCode::from(3),
        _ => ExitCode::SUCCESS,
    })
}

fn choose<'a>(entries: &'a [Entry], names: &[String]) -> Result<Vec<&'a Entry>> {
    if names.is_empty() {
        return Ok(entries.iter().filter(|entry| entry.right).collect());
    }
    common::choose(entries, names)
}

fn list_checks() -> Result<ExitCode> {
    let lines: String =
        warpcheck::verify::checks().map(|(name, about)| format!("{name:14}  {about}\n")).collect();
    print(&lines)?;
    Ok(ExitCode::SUCCESS)
}

fn list(entries: &[&Entry]) -> Result<ExitCode> {
    let width = entries.iter().map(|e| e.name.len()).max().unwrap_or(0);
    let lines: String = entries.iter().map(|e| format!("{:width$}  {}\n", e.name, e.about)).collect();
    print(&lines)?;
    Ok(ExitCode::SUCCESS)
}

fn write_pictures(report: &Report, arguments: &Arguments) -> Result<()> {
    if report.examinations.is_empty() {
        return Ok(());
    }
    let bar = common::progress(report.examinations.len() as u64, "pictures");
    bar.set_message("drawing");
    for (i, examination) in report.examinations.iter().enumerate() {
        let path = arguments.out.join(common::file_stem(&examination.name));
        write_png(common::with_extension(&path, "png"), &report::residual_sheet(report, i))?;
        let evidence = common::with_extension(&path, "exr");
        if report.verdict_on(i) == Verdict::Pass {
            // Of an earlier run that failed: it would tell a lie now.
            let _ = std::fs::remove_file(evidence);
        } else {
            write_planes(evidence, &report::residual_planes(examination)?, Compression::Zip)?;
        }
        bar.inc(1);
    }
    write_png(arguments.out.join("overview.png"), &report::overview_sheet(report))?;
    bar.finish_and_clear();
    print(&format!(
        "pictures: {}/ (overview.png, and observed | expected | residual of each sampler)\n",
        arguments.out.display()
    ))
}
