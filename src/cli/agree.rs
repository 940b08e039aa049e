//! `warpcheck agree`: strategies against one another and against a reference.

use super::common::{self, DEFAULT_OUT, LightArguments, OutputFolder, ReportArgument, print};
use anyhow::{Context, Result, bail};
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use warpcheck::estimator::{
    Blocks, Criteria, Estimate, Experiment, Judgement, Plan, Settings, Strategy, agree, sample,
    sampled_passes,
};
use warpcheck::picture::{write_atomically, write_png};
use warpcheck::report;
use warpcheck::scene::{Reference, Scene};

#[derive(Args)]
pub struct Arguments {
    /// The scene file (TOML)
    scene: PathBuf,
    /// Strategies, separated by commas [default: brdf, light, mis:0.5, mis-two]
    #[arg(long, value_delimiter = ',')]
    strategy: Vec<Strategy>,
    #[command(flatten)]
    lights: LightArguments,
    /// Also compare with a picture (EXR, HDR), or with means and errors of blocks (JSON, see data/reference) [default: the scene's
    /// [reference], if it has such a file]
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Don't compare with the scene's [reference]
    #[arg(long, conflicts_with = "reference")]
    no_reference: bool,
    /// The picture has no noise; without this, its noise is estimated from how pixels differ from their neighbours
    #[arg(long, requires = "reference")]
    exact: bool,
    /// Samples a pixel
    #[arg(long, value_name = "N", default_value = "256", value_parser = common::passes, allow_negative_numbers = true)]
    spp: u32,
    /// Pixels along the side of a tile [default: 8, or that of the blocks]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=4096), allow_negative_numbers = true)]
    tile: Option<u32>,
    /// Probability of a false alarm
    #[arg(long, value_name = "P", default_value_t = 1e-3, value_parser = common::level, allow_negative_numbers = true)]
    alpha: f64,
    /// Exit with 0 if the verdict is inconclusive
    #[arg(long)]
    allow_inconclusive: bool,
    /// Seed
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Folder for the maps of p-values
    #[arg(long, value_name = "DIR", default_value = DEFAULT_OUT)]
    out: PathBuf,
    /// Also write everything that was found as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgument,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let scene = arguments.lights.scene(&arguments.scene)?;
    let strategies = common::strategies(&arguments.strategy, &Experiment::default().strategies)?;
    let plan = Plan::of(&scene, &strategies, arguments.lights.sampling())?;
    let lights = plan.lights();
    let spp = sampled_passes(arguments.spp);
    let reference = match &arguments.reference {
        Some(file) => Some(reference(&scene, file, arguments)?),
        None => own_reference(&scene, arguments)?,
    };
    if strategies.len() + usize::from(reference.is_some()) < 2 {
        bail!("one strategy alone agrees with itself: name two, or a --reference");
    }
    let tile = reference.as_ref().map_or(arguments.tile.unwrap_or(8) as usize, |r| r.size);
    let stop = common::stop_on_ctrl_c();
    arguments.json.as_deref().map(|file| common::output_file(file, &arguments.out)).transpose()?;
    let _folder = OutputFolder::make(&arguments.out)?;
    let stem = common::stem(&arguments.scene);
    let dossier = arguments.report.begin(format!("{stem}: do strategies agree?"))?;
    let bar = common::progress(u64::from(spp) * strategies.len() as u64, "passes");
    let mut estimates = Vec::new();
    for &strategy in &strategies {
        bar.set_message(format!("{stem} {strategy}"));
        let settings = Settings { spp: arguments.spp, seed: arguments.seed };
        let estimate = sample(&scene, lights, strategy, settings, tile, |_| {
            bar.inc(1);
            !stop.load(Ordering::Relaxed)
        });
        // Half an estimate has half the batches, and a strategy that is missing is no verdict: what is done is compared.
        estimates.extend(estimate);
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    bar.finish_and_clear();
    estimates.extend(reference);
    let stopped = stop.load(Ordering::Relaxed);
    if stopped {
        print(&format!("stopped: {} of {} strategies were rendered\n", estimates.len(), strategies.len()))?;
        if estimates.len() < 2 {
            return Ok(ExitCode::from(130));
        }
    }
    let accord = agree(&estimates, Criteria { level: arguments.alpha, ..Criteria::default() })?;
    if spp != arguments.spp {
        print(&format!("{spp} samples a pixel: {} make no whole batches\n", arguments.spp))?;
    }
    print(&report::accord_table(&accord, &estimates, common::style()))?;
    let sheet = arguments.out.join(format!("{}-agree.png", common::file_stem(&stem)));
    write_png(&sheet, &report::accord_sheet(&format!("{stem}: do strategies agree?"), &accord, &estimates))?;
    print(&format!("maps: {}\n", sheet.display()))?;
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::accord_to_json(&accord, &estimates, arguments.seed));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    common::finish(dossier, |page| {
        page.fact("scene", format!("{stem}, {} x {}", scene.picture.width, scene.picture.height))
            .fact("seed", arguments.seed.to_string())
            .fact("samples a pixel", spp.to_string())
            .accord(&stem, &accord, &estimates);
    })?;
    Ok(match accord.judgement() {
        _ if stopped => ExitCode::from(130),
        Judgement::Agree => ExitCode::SUCCESS,
        Judgement::Differ => ExitCode::from(1),
        Judgement::Inconclusive if arguments.allow_inconclusive => ExitCode::SUCCESS,
        Judgement::Inconclusive => ExitCode::from(3),
    })
}

/// What the scene file says that its picture is to be compared with, where that is a picture of the same: block means with their errors if it has some
/// and the tiles are theirs, or else the picture. Whatever doesn't fit is said and left out, since nobody asked for it. A radiance in closed form is for `converge`.
fn own_reference(scene: &Scene, arguments: &Arguments) -> Result<Option<Estimate>> {
    let has_file = |r: &&Reference| r.file.is_some() || r.blocks.is_some();
    let Some(own) = scene.reference.as_ref().filter(has_file).filter(|_| !arguments.no_reference) else {
        return Ok(None);
    };
    if arguments.lights.replaces_map() {
        print("the scene's [reference] is left out: it is not of this --map\n")?;
        return Ok(None);
    }
    let mut why = String::new();
    for file in own.blocks.iter().chain(&own.file) {
        match reference(scene, file, arguments) {
            Ok(estimate) => {
                let file = file.display();
                print(&format!("reference: {file}, as the scene says (--no-reference leaves it out)\n"))?;
                return Ok(Some(estimate));
            }
            Err(error) => why = common::sentence(&error),
        }
    }
    print(&format!("the scene's [reference] is left out: {why}\n"))?;
    Ok(None)
}

/// A reference with its tiles.
fn reference(scene: &Scene, file: &Path, &Arguments { tile, exact, .. }: &Arguments) -> Result<Estimate> {
    let (width, height) = (scene.picture.width as usize, scene.picture.height as usize);
    if file.extension().is_none_or(|e| e != "json") {
        let picture = common::reference(scene, file)?;
        return Ok(Estimate::from_picture("reference", &picture, tile.unwrap_or(8) as usize, exact));
    }
    let text = std::fs::read(file).with_context(|| format!("can't read {}", file.display()))?;
    let blocks = serde_json::from_slice::<BlockFile>(&text)
        .with_context(|| format!("{} is no file of block means", file.display()))?;
    let shape = [blocks.width, blocks.height];
    if shape != [width, height] {
        bail!(
            "{} is of {} x {} pixels, the scene's picture has {width} x {height}",
            file.display(),
            shape[0],
            shape[1]
        );
    }
    let (columns, rows) = (width.div_ceil(blocks.block.max(1)), height.div_ceil(blocks.block.max(1)));
    let (means, standard_errors) = (blocks.block_mean.concat(), blocks.block_stderr.concat());
    if blocks.block == 0 || [means.len(), standard_errors.len()] != [columns * rows; 2] {
        bail!("{} does not have {columns} x {rows} blocks", file.display());
    }
    if tile.is_some_and(|t| t as usize != blocks.block) {
        bail!(
            "the blocks of {} have {} pixels: --tile can't be another number",
            file.display(),
            blocks.block
        );
    }
    let effective = vec![[f64::INFINITY; 3]; means.len()];
    let blocks = Blocks { size: blocks.block, columns, rows, means, standard_errors, effective };
    Ok(Estimate::known("reference", &blocks, width, height))
}

/// What data/reference/veach_a3_256x128.json has.
#[derive(serde::Deserialize)]
struct BlockFile {
    width: usize,
    height: usize,
    block: usize,
    block_mean: Vec<Vec<[f64; 3]>>,
    block_stderr: Vec<Vec<[f64; 3]>>,
}
