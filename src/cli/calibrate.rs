//! `warpcheck calibrate`: how often right samplers fail, beside how often they may.

use super::common::{self, DEFAULT_OUT, OutputFolder, ReportArgument, print};
use anyhow::{Context, Result, bail};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use warpcheck::calibration::{Candidate, Plan, calibrate};
use warpcheck::catalogue::{self, Entry, Subject};
use warpcheck::picture::write_atomically;
use warpcheck::report;

/// What is calibrated unless told: name and share of the runs. One of every kind, and more runs of what is quick:
/// 10,000 runs of both kinds are half an hour of one core.
const DEFAULT: [(&str, u32); 9] = [
    ("discrete/areas-teapot", 18),                     // a table
    ("discrete/ragged", 7),                            // weights from 1e-30 to 1e30
    ("triangle/low-distortion", 12),                   // a kink
    ("hemisphere/cosine", 4),                          // smooth
    ("ggx/0.3-grazing", 3),                            // rejects
    ("mixture/cosine-phong", 3),                       // a lobe on a smooth ground
    ("vmf/1e2", 1),                                    // a lobe
    ("ggx/0.01", 1),                                   // a peak
    ("environment/spruit_sunrise_512/uniform-cos", 1), // a map with a sun
];

#[derive(Args)]
pub struct Arguments {
    /// Right samplers or families; a choice of every kind if none is named
    names: Vec<String>,
    /// Runs over all samplers; 10k take a quarter of an hour on two cores
    #[arg(long, default_value = "10k", value_parser = common::count, allow_negative_numbers = true)]
    runs: u64,
    /// Samples of each run
    #[arg(long, default_value = "20k", value_parser = common::count, allow_negative_numbers = true)]
    samples: u64,
    /// Samples, at most, of each run that is looked at after every 16384
    #[arg(long, default_value = "163840", value_parser = common::count, allow_negative_numbers = true)]
    peeking: u64,
    /// Seed
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Folder for the plot, calibration.svg
    #[arg(long, value_name = "DIR", default_value = DEFAULT_OUT)]
    out: PathBuf,
    /// Also write everything that was measured as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgument,
    /// Folder of the shipped maps and meshes
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let data = common::data_folder(arguments.data.as_deref())?;
    let entries = catalogue::entries(&data);
    let chosen = choose(&entries, &arguments.names)?;
    let stop = common::stop_on_ctrl_c();
    arguments.json.as_deref().map(|file| common::output_file(file, &arguments.out)).transpose()?;
    let _folder = OutputFolder::make(&arguments.out)?;
    let mut dossier = arguments.report.begin("How often right samplers fail")?;
    let make = |entry: &Entry| entry.make().with_context(|| format!("can't make the sampler {}", entry.name));
    let subjects = chosen.iter().map(|(entry, _)| make(entry)).collect::<Result<Vec<Box<dyn Subject>>>>()?;
    let candidates: Vec<Candidate<'_>> = chosen
        .iter()
        .zip(&subjects)
        .map(|((entry, share), subject)| {
            let examine = move |settings: &_| subject.examine(&entry.name, settings);
            Candidate::new(entry.name.as_str(), examine).share(*share)
        })
        .collect();
    let bar = common::progress(arguments.runs, "runs");
    bar.set_message("calibrating");
    let mine = bar.clone();
    let calibration = calibrate(
        &candidates,
        &Plan {
            runs: arguments.runs,
            samples: arguments.samples,
            anytime_samples: arguments.peeking,
            seed: arguments.seed,
            progress: Some(Arc::new(move |done| mine.set_position(done))),
            stop: Some(Arc::clone(&stop)),
            ..Plan::default()
        },
    );
    bar.finish_and_clear();
    let stopped = stop.load(Ordering::Relaxed);

    print(&report::calibration_table(&calibration, common::style()))?;
    if stopped {
        print(&format!("stopped: {} of {} runs were made\n", calibration.runs, arguments.runs))?;
    }
    let plot = arguments.out.join("calibration.svg");
    let svg = report::calibration_plot(&calibration).context("can't draw the plot")?;
    write_atomically(&plot, |out| out.write_all(svg.as_bytes()))?;
    print(&format!("plot: {}\n", plot.display()))?;
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::calibration_to_json(&calibration));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    if let Some(dossier) = &mut dossier {
        dossier.page.calibration(&calibration).context("can't draw the plot")?;
    }
    common::finish(dossier, |_| {})?;
    Ok(match calibration.holds() {
        _ if stopped => ExitCode::from(130),
        false => ExitCode::from(1),
        true => ExitCode::SUCCESS,
    })
}

/// The samplers that are named, each with the same share; a broken one has no rate of false alarms.
fn choose<'a>(entries: &'a [Entry], names: &[String]) -> Result<Vec<(&'a Entry, u32)>> {
    if names.is_empty() {
        let find = |&(name, share): &(&str, u32)| {
            let entry = entries.iter().find(|entry| entry.name == name);
            Ok((entry.with_context(|| format!("there is no sampler `{name}`"))?, share))
        };
        return DEFAULT.iter().map(find).collect();
    }
    let chosen = common::choose(entries, names)?;
    if let Some(broken) = chosen.iter().find(|entry| !entry.right) {
        bail!("`{}` is broken on purpose: only right samplers raise false alarms", broken.name);
    }
    Ok(chosen.into_iter().map(|entry| (entry, 1)).collect())
}
