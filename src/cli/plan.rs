//! `warpcheck plan`: what a scene needs, what is left out, and why.

use super::common::{self, LightArguments, ReportArgument};
use anyhow::Result;
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use warpcheck::estimator::{Plan, Strategy};
use warpcheck::picture::write_atomically;
use warpcheck::report;
use warpcheck::report::html::Page;

#[derive(Args)]
pub struct Arguments {
    /// The scene file (TOML)
    scene: PathBuf,
    /// The strategies that are to be used, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "mis:0.5")]
    strategy: Vec<Strategy>,
    #[command(flatten)]
    lights: LightArguments,
    /// Also write the plan as JSON
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
    arguments.json.as_deref().map(|file| common::output_file(file, Path::new(""))).transpose()?;
    let stem = common::stem(&arguments.scene);
    let dossier = if page.is_some() { None } else { arguments.report.begin(format!("{stem}: the plan"))? };
    let scene = arguments.lights.scene(&arguments.scene)?;
    let strategies = common::strategies(&arguments.strategy, &[])?;
    let plan = Plan::of(&scene, &strategies, arguments.lights.sampling())?;
    common::print(&report::plan_table(&plan))?;
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::plan_to_json(&plan));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    if let Some(page) = page {
        page.plan(&stem, &plan);
    }
    common::finish(dossier, |page| {
        let strategies: Vec<String> = arguments.strategy.iter().map(ToString::to_string).collect();
        page.fact("strategies", strategies.join(", ")).plan(&stem, &plan);
    })?;
    Ok(ExitCode::SUCCESS)
}
