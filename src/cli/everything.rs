//! No command at all: verifies every sampler that ships, and makes a page that shows what the other commands do.

use super::common::{self, DEFAULT_OUT, Dossier};
use super::{Cli, Command, converge, faults, histogram, plan, stress, verify};
use anyhow::Result;
use clap::Parser;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use warpcheck::report::html::Page;

/// What follows the samplers on the page: smaller than what one would ask for, so that all of it takes half a minute.
const ALSO: [&[&str]; 5] = [
    &["histogram", "env/spruit_sunrise_512.hdr", "--samples", "1M,10M"],
    &["converge", "scene/veach_a3.toml", "--strategy", "brdf,light,mis:0.5", "--seeds", "2", "--spp", "8"],
    &["plan", "scene/veach_a3.toml", "--strategy", "brdf,light,mis:0.5"],
    &["stress", "--quick"],
    &["faults", "triangle", "--seeds", "1", "--samples", "20k"],
];

pub fn run() -> Result<ExitCode> {
    let out = Path::new(DEFAULT_OUT);
    let mut dossier = Dossier::begin(out, "warpcheck: what ships")?;
    let verdict = verify::onto(&verify::Arguments::default(), Some(&mut dossier.page))?;
    let data = common::data_folder(None)?;
    let mut worst = verdict;
    for words in ALSO {
        if common::stop_on_ctrl_c().load(Ordering::Relaxed) {
            break;
        }
        let words = words.iter().map(|word| match data.join(word) {
            file if file.is_file() => file.into_os_string(),
            _ => word.into(),
        });
        let command = Cli::try_parse_from(std::iter::once("warpcheck".into()).chain(words))?.command;
        let code =
            common::quietly(|| command.map_or(Ok(ExitCode::SUCCESS), |c| onto(&c, &mut dossier.page)))?;
        if verdict == ExitCode::SUCCESS && code != ExitCode::SUCCESS {
            worst = code;
        }
    }
    let stopped = common::stop_on_ctrl_c().load(Ordering::Relaxed);
    if stopped {
        dossier.page.says("Stopped: this is what was done until then.");
    }
    dossier.finish()?;
    if stopped {
        common::print("stopped: the page has what was done until then\n")?;
        return Ok(ExitCode::from(130));
    }
    Ok(worst)
}

fn onto(command: &Command, page: &mut Page) -> Result<ExitCode> {
    match command {
        Command::Histogram(arguments) => histogram::onto(arguments, Some(page)),
        Command::Converge(arguments) => converge::onto(arguments, Some(page)),
        Command::Plan(arguments) => plan::onto(arguments, Some(page)),
        Command::Stress(arguments) => stress::onto(arguments, Some(page)),
        Command::Faults(arguments) => faults::onto(arguments, Some(page)),
        _ => Ok(ExitCode::SUCCESS),
    }
}
