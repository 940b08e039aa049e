//! `warpcheck converge`: error against run time, strategy by strategy.

use super::common::{self, DEFAULT_OUT, LightArguments, OutputFolder, ReportArgument, print};
use anyhow::{Context, Result, bail};
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use warpcheck::estimator::{
    self, Budget, Clock, Convergence, Curve, Experiment, LEAST_PASSES, Lights, Plan, Settings, Strategy,
    Truth, convergence, render,
};
use warpcheck::picture::{Picture, write_atomically, write_png};
use warpcheck::report::html::{Group, Page};
use warpcheck::report::{self, AtEqualTime};
use warpcheck::scene::Scene;

#[derive(Args)]
pub struct Arguments {
    /// The scene file (TOML)
    scene: PathBuf,
    /// Strategies, separated by commas [default: brdf, light, mis:0.5, mis-two]
    #[arg(long, value_delimiter = ',')]
    strategy: Vec<Strategy>,
    #[command(flatten)]
    lights: LightArguments,
    /// Independent pictures of each strategy
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..=1000), allow_negative_numbers = true)]
    seeds: u32,
    /// Samples a pixel of each picture [default: 256]
    #[arg(long, value_name = "MAX", value_parser = common::passes, conflicts_with = "time", allow_negative_numbers = true)]
    spp: Option<u32>,
    /// CPU seconds for each picture instead; counts then depend on the machine
    #[arg(long, value_name = "S", value_parser = common::seconds, allow_negative_numbers = true)]
    time: Option<f64>,
    /// What is right: a picture (EXR, HDR), a radiance that is everywhere (one number, or red,green,blue), or a strategy, of which a long run is
    /// made [default: the closed form that the scene's [reference] names, if it does; or else mis-two]
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Root mean square error to reach, in radiance [default: the least that was reached]
    #[arg(long, value_name = "RMS", value_parser = common::seconds, allow_negative_numbers = true)]
    reach: Option<f64>,
    /// Multiply the radiance with this before it is shown [default: as the scene says]
    #[arg(long, value_name = "FACTOR", value_parser = common::exposure, allow_negative_numbers = true)]
    exposure: Option<f32>,
    /// Seed
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Folder for the plot, the table (CSV) and the contact sheet
    #[arg(long, value_name = "DIR", default_value = DEFAULT_OUT)]
    out: PathBuf,
    /// Also write everything that was measured as JSON
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
    let clock = Clock::start();
    let mut scene = arguments.lights.scene(&arguments.scene)?;
    scene.picture.exposure = arguments.exposure.unwrap_or(scene.picture.exposure);
    let default = Experiment::default();
    let strategies = common::strategies(&arguments.strategy, &default.strategies)?;
    let truth = match &arguments.reference {
        Some(given) => truth(&scene, given)?,
        None => own_truth(&scene, arguments.lights.replaces_map())?,
    };
    let rendered = strategies.iter().copied().chain(truth.long_run()).collect::<Vec<_>>();
    let planned = Plan::of(&scene, &rendered, arguments.lights.sampling())?;
    let lights = planned.lights();
    let setup = clock.read();
    let stop = common::stop_on_ctrl_c();
    arguments.json.as_deref().map(|file| common::output_file(file, &arguments.out)).transpose()?;
    let _folder = OutputFolder::make(&arguments.out)?;
    let stem = common::stem(&arguments.scene);
    let dossier = match page {
        Some(_) => None,
        None => arguments.report.begin(format!("{stem}: error against run time"))?,
    };
    let bar = common::progress(1, "passes");
    bar.set_message("converging");
    let mine = bar.clone();
    let budget = arguments.time.map(Budget::Seconds).or(arguments.spp.map(Budget::Passes));
    let plan = Experiment {
        strategies,
        seeds: arguments.seeds,
        budget: budget.unwrap_or(default.budget),
        seed: arguments.seed,
        truth,
        regions: estimator::regions_by_material(&scene),
        progress: Some(Arc::new(move |done, total| {
            mine.set_length(total);
            mine.set_position(done);
        })),
        stop: Some(Arc::clone(&stop)),
        ..default
    };
    let found = convergence(&scene, lights, &plan);
    bar.finish_and_clear();
    let out = |ending: &str| arguments.out.join(format!("{}-converge{ending}", common::file_stem(&stem)));
    let stopped = |done: &str| print(&format!("stopped: {done}\n"));
    if found.curves.iter().all(|c| c.rungs.is_empty()) {
        stopped("no picture was measured")?;
        return Ok(ExitCode::from(130));
    }

    let black = |c: &Curve| c.last().is_some_and(|last| last.squared.mean == 0.0);
    if found.curves.iter().all(black) && found.reference.picture.pixels().iter().all(|p| *p == [0.0; 3]) {
        bail!("no strategy saw any light, and the reference is black: there is no error to measure");
    }
    if let Some(few) = arguments.spp.filter(|&spp| spp < LEAST_PASSES) {
        print(&format!("{LEAST_PASSES} samples a pixel: {few} has no standard error and no slope\n"))?;
    }
    print(&report::convergence_table(&found, setup, arguments.reach))?;
    let (width, height) = (scene.picture.width, scene.picture.height);
    let title = format!("{stem}, {width} x {height}: error against run time");
    // What people draw from comes before the drawing.
    let csv = report::convergence_to_csv(&found);
    write_atomically(out(".csv"), |file| file.write_all(csv.as_bytes()))?;
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::convergence_to_json(&found, setup, arguments.reach));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    let svg = report::convergence_plot(&title, &found).context("can't draw the plot")?;
    write_atomically(out(".svg"), |file| file.write_all(svg.as_bytes()))?;
    print(&format!("\nplot: {}; figures: {}\n", out(".svg").display(), out(".csv").display()))?;
    if found.stopped {
        common::finish(dossier, |page| {
            page.says("Stopped: this is of the pictures that were measured.");
            let _ = page.convergence(&stem, &found, setup, &[], &[], common::tone(&scene));
        })?;
        stopped("what is above is of the pictures that were measured; no contact sheet")?;
        return Ok(ExitCode::from(130));
    }
    let mut at_times = Vec::new();
    if let Some(seconds) = found.common_time() {
        let at =
            |seconds: f64| AtEqualTime { seconds, pictures: found.at_equal_time(&scene, lights, seconds) };
        let times = [seconds / 8.0, seconds].map(at);
        let sheet = report::convergence_sheet(&stem, &found, &times, common::tone(&scene));
        write_png(out("-sheet.png"), &sheet)?;
        print(&format!("contact sheet: {}\n", out("-sheet.png").display()))?;
        at_times = times.into();
    }
    if page.is_some() || dossier.is_some() {
        let equal = equal_samples(&scene, lights, &found, arguments.seed);
        let fill = |page: &mut Page| {
            page.convergence(&stem, &found, setup, &at_times, &equal, common::tone(&scene)).map(|_| ())
        };
        let mut drawn = page.map_or(Ok(()), fill);
        common::finish(dossier, |page| {
            page.fact("seed", arguments.seed.to_string())
                .fact("pictures of each strategy", arguments.seeds.to_string());
            drawn = fill(page);
        })?;
        drawn.context("can't draw the plot")?;
    }
    Ok(if stop.load(Ordering::Relaxed) { ExitCode::from(130) } else { ExitCode::SUCCESS })
}

/// A picture by every strategy with the same number of samples: the least that all of them had.
fn equal_samples(scene: &Scene, lights: &Lights, found: &Convergence, seed: u64) -> Vec<Group> {
    let Some(spp) =
        found.curves.iter().map(|c| c.last().map_or(0, |rung| rung.passes)).min().filter(|n| *n > 0)
    else {
        return Vec::new();
    };
    let films = found.curves.iter().map(|curve| {
        let rendered = render(scene, lights, curve.strategy, Settings { spp, seed }, |_| true);
        let caption = format!("{:.2} s", rendered.time.as_secs_f64());
        (curve.strategy.to_string(), caption, rendered.film)
    });
    vec![Group { name: format!("{spp} samples a pixel"), note: String::new(), films: films.collect() }]
}

/// What the scene says of itself, or else a long run. Whatever doesn't fit is said and left out, since nobody asked for it.
fn own_truth(scene: &Scene, is_under_another_map: bool) -> Result<Truth> {
    let is_known = scene.reference.as_ref().is_some_and(|r| !r.radiance.is_empty());
    let why = match Truth::closed_form(scene) {
        None if !is_known => return Ok(Truth::LongRun(None)),
        None => "no pixel shows it and nothing else",
        Some(_) if is_under_another_map => "it is not of this --map",
        Some(truth) => return Ok(truth),
    };
    print(&format!("the closed form of the scene's [reference] is left out: {why}\n"))?;
    Ok(Truth::LongRun(None))
}

/// A long run, a picture of the scene's size, or the same radiance everywhere.
fn truth(scene: &Scene, given: &Path) -> Result<Truth> {
    let (width, height) = (scene.picture.width as usize, scene.picture.height as usize);
    let text = given.to_string_lossy();
    if let Ok(strategy) = text.parse() {
        return Ok(Truth::LongRun(Some(strategy)));
    }
    let numbers: Result<Vec<f32>, _> = text.split(',').map(str::parse).collect();
    let radiance = match numbers.as_deref() {
        Ok(&[grey]) => [grey; 3],
        Ok(&[r, g, b]) => [r, g, b],
        Ok(_) => bail!("a reference of radiance {text} is neither one number nor red,green,blue"),
        Err(_) if given.extension().is_some_and(|e| e == "json") => bail!(
            "{text} has block means, with which only `agree` compares; `converge` takes a picture (EXR, HDR), a radiance or a strategy"
        ),
        Err(_) => return Ok(Truth::Picture(common::reference(scene, given)?)),
    };
    if !radiance.iter().all(|r| r.is_finite() && *r >= 0.0) {
        bail!("a reference of radiance {text} makes no sense");
    }
    Ok(Truth::Picture(Picture::from_fn(width, height, |_, _| radiance)))
}
