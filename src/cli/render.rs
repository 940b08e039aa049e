//! `warpcheck render`: a scene with one strategy or several, progressively, and the contact sheet of them all.

use super::common::{self, DEFAULT_OUT, LightArguments, OutputFolder, ReportArgument};
use anyhow::{Result, bail};
use clap::Args;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Instant;
use warpcheck::estimator::{
    Integrator, Plan, Progress, Rendered, Settings, Strategy, render, share_out_of_reach,
};
use warpcheck::picture::{Canvas, Sheet, Tile, write_atomically, write_exr, write_png};
use warpcheck::report;
use warpcheck::report::html::Group;
use warpcheck::scene::Scene;

#[derive(Args)]
pub struct Arguments {
    /// The scene file (TOML)
    scene: PathBuf,
    /// uniform, brdf, light, mis:C (C the weight of the BRDF), mis:auto, mis-two or mis-two:power; several, separated by commas
    /// [default: mis:0.5]
    #[arg(long, value_delimiter = ',')]
    strategy: Vec<Strategy>,
    /// Samples a pixel; several, separated by commas, give a picture each [default: 16, or as --time and --error say]
    #[arg(long, value_parser = common::passes, value_delimiter = ',', allow_negative_numbers = true)]
    spp: Vec<u32>,
    /// Also a picture after each of these numbers of samples a pixel, separated by commas
    #[arg(long, value_parser = common::passes, value_delimiter = ',', allow_negative_numbers = true)]
    snapshots: Vec<u32>,
    /// Stop each strategy after this many seconds of rendering, those of a resumed film included
    #[arg(long, value_name = "SECONDS", value_parser = common::seconds, allow_negative_numbers = true)]
    time: Option<f64>,
    /// Stop each strategy when the relative standard error of its pixels, in root mean square, is down to this
    #[arg(long, value_name = "RELATIVE", value_parser = common::level, allow_negative_numbers = true)]
    error: Option<f64>,
    #[command(flatten)]
    lights: LightArguments,
    /// Keep the film of each strategy, to go on with it later
    #[arg(long)]
    film: bool,
    /// Save the film on the way after so many seconds, again and again, in case there is no end
    #[arg(long, value_name = "SECONDS", requires = "film", default_value = "60", value_parser = common::seconds, allow_negative_numbers = true)]
    save_every: f64,
    /// Go on with a film of the same scene, strategy and seed
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// All pictures on one contact sheet [default: brdf, light, mis 3/4, 1/2, 1/4 at 1, 10, 100 spp]
    #[arg(long)]
    sheet: bool,
    /// Multiply the radiance with this before it is shown [default: as the scene says]
    #[arg(long, value_name = "FACTOR", value_parser = common::exposure, allow_negative_numbers = true)]
    exposure: Option<f32>,
    /// Seed
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Folder for pictures
    #[arg(long, value_name = "DIR", default_value = DEFAULT_OUT)]
    out: PathBuf,
    /// Also write what was rendered as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgument,
}

/// The most samples a pixel.
const MOST_PASSES: u32 = 1_000_000_000;
/// Below this many samples a pixel no standard error is believed.
const LEAST_PASSES: u32 = 16;

/// A picture that is black after so many is not waited for.
const BLACK_PASSES: u32 = 4096;

/// In words.
fn samples_a_pixel(count: u32) -> String {
    format!("{count} sample{} a pixel", if count == 1 { "" } else { "s" })
}

/// Whether the time or the error that was asked for is reached, or never will be.
fn is_enough(arguments: &Arguments, progress: &Progress) -> bool {
    let timed = arguments.time.is_some_and(|seconds| progress.time.as_secs_f64() >= seconds);
    let small = |error| {
        progress.passes >= LEAST_PASSES && progress.film.relative_error() <= error
            || progress.passes >= BLACK_PASSES && progress.film.is_black()
    };
    timed || arguments.error.is_some_and(small)
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let open_ended = arguments.time.is_some() || arguments.error.is_some();
    let (strategies, mut counts) = match arguments.sheet {
        true => (
            common::strategies(
                &arguments.strategy,
                &[
                    Strategy::Brdf,
                    Strategy::Light,
                    Strategy::Mis { brdf_weight: 0.75 },
                    Strategy::Mis { brdf_weight: 0.5 },
                    Strategy::Mis { brdf_weight: 0.25 },
                ],
            )?,
            common::or(&arguments.spp, &[1, 10, 100]),
        ),
        false => {
            let most = if open_ended { MOST_PASSES } else { 16 };
            (
                common::strategies(&arguments.strategy, &[Strategy::Mis { brdf_weight: 0.5 }])?,
                common::or(&arguments.spp, &[most]),
            )
        }
    };
    let most = counts.iter().copied().max().unwrap_or(1);
    if let Some(beyond) = arguments.snapshots.iter().find(|&&spp| spp > most) {
        bail!("no snapshot after {beyond} samples a pixel: --spp is {most}");
    }
    counts.extend(&arguments.snapshots);
    counts.sort_unstable();
    counts.dedup();
    if arguments.resume.is_some() && strategies.len() > 1 {
        bail!("--resume goes on with the film of one strategy, but {} were named", strategies.len());
    }
    let mut scene = arguments.lights.scene(&arguments.scene)?;
    scene.picture.exposure = arguments.exposure.unwrap_or(scene.picture.exposure);
    let plan = Plan::of(&scene, &strategies, arguments.lights.sampling())?;
    let lights = plan.lights();
    let resumed = match &arguments.resume {
        Some(film) => Some(Rendered::open(film, &scene, lights, strategies[0], arguments.seed)?),
        None => None,
    };
    if let Some(done) = resumed.as_ref().filter(|done| done.passes > most) {
        bail!("the film has {} passes already, more than --spp {most}", done.passes);
    }
    arguments.json.as_deref().map(|file| common::output_file(file, &arguments.out)).transpose()?;
    let mut made = Vec::new();
    let stop = common::stop_on_ctrl_c();
    let _folder = OutputFolder::make(&arguments.out)?;
    let bar = common::progress(u64::from(most) * strategies.len() as u64, "passes");
    let stem = common::stem(&arguments.scene);
    let dossier = arguments
        .report
        .begin(format!("{stem}: {}", if strategies.len() > 1 { "strategies" } else { "a picture" }))?;
    // Pictures by their place among the counts: those of one count are laid over one another.
    let mut groups: BTreeMap<u32, Group> = BTreeMap::new();
    let mut sheet = Sheet::new(format!("{stem}: strategies at equal samples"))
        .notes(format!(
            "{} x {} pixels, seed {}, exposure {}; direct light only",
            scene.picture.width, scene.picture.height, arguments.seed, scene.picture.exposure
        ))
        .columns(counts.iter().map(|spp| format!("{spp} spp")))
        .tile_width((scene.picture.width as usize).clamp(256, 512));
    for (i, &strategy) in strategies.iter().enumerate() {
        bar.set_message(format!("{stem} {strategy}"));
        let settings = Settings { spp: 0, seed: arguments.seed };
        let mut rendered =
            resumed.clone().unwrap_or_else(|| render(&scene, lights, strategy, settings, |_| true));
        let integrator = Integrator::new(&scene, lights, strategy);
        let mut tiles = Vec::new();
        let mut enough = false;
        let begun = rendered.passes;
        let film = common::with_extension(
            &arguments.out.join(common::file_stem(&format!("{stem}-{strategy}"))),
            "film",
        );
        let mut saved = Instant::now();
        for &spp in counts.iter().filter(|&&spp| spp >= begun) {
            loop {
                let mut is_due = false;
                rendered.resume_with(&integrator, spp, |progress| {
                    bar.set_position(i as u64 * u64::from(most) + u64::from(progress.passes));
                    enough = is_enough(arguments, &progress);
                    let goes_on = !enough && !stop.load(Ordering::Relaxed);
                    is_due =
                        goes_on && arguments.film && saved.elapsed().as_secs_f64() >= arguments.save_every;
                    goes_on && !is_due
                });
                if !is_due {
                    break;
                }
                rendered.save(&film, &scene, lights)?;
                saved = Instant::now();
            }
            if rendered.passes > 0 {
                // By what it has, which --time, --error or Ctrl-C may have made fewer than were asked for.
                let named = format!("{stem}-{strategy}-{}spp", rendered.passes);
                let path = arguments.out.join(common::file_stem(&named));
                let canvas = write(&scene, &rendered, &path)?;
                bar.suspend(|| say(&scene, &rendered, arguments.error.is_some(), &path))?;
                let seconds = rendered.time.as_secs_f64();
                if arguments.json.is_some() {
                    made.push(rendered.clone());
                }
                if dossier.is_some() {
                    let group = groups.entry(spp).or_insert_with(|| Group {
                        name: if open_ended && spp == most {
                            "as many samples as --time and --error let".into()
                        } else {
                            samples_a_pixel(spp)
                        },
                        note: String::new(),
                        films: Vec::new(),
                    });
                    let caption = format!("{}, {seconds:.2} s", samples_a_pixel(rendered.passes));
                    group.films.push((strategy.to_string(), caption, rendered.film.clone()));
                }
                tiles.push(Tile::new(canvas).caption(match rendered.passes < spp {
                    true => format!("stopped after {} spp, {seconds:.1} s", rendered.passes),
                    false => format!("{seconds:.1} s"),
                }));
            }
            if enough || stop.load(Ordering::Relaxed) {
                break;
            }
        }
        if arguments.film && rendered.passes > 0 {
            rendered.save(&film, &scene, lights)?;
            bar.suspend(|| common::print(&format!("film: {}\n", film.display())))?;
        }
        if !tiles.is_empty() {
            sheet = sheet.row(strategy.to_string(), tiles);
        }
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    bar.finish_and_clear();
    if stop.load(Ordering::Relaxed) {
        common::print("stopped: what is above is what was rendered until then\n")?;
    }
    if arguments.sheet {
        let path = arguments.out.join(format!("{}-sheet.png", common::file_stem(&stem)));
        write_png(&path, &sheet.draw())?;
        common::print(&format!("contact sheet: {}\n", path.display()))?;
    }
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::renders_to_json(&stem, arguments.seed, &made));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    common::finish(dossier, |page| {
        let (width, height) = (scene.picture.width, scene.picture.height);
        page.fact("scene", format!("{stem}, {width} x {height}"))
            .fact("seed", arguments.seed.to_string())
            .says("Direct light only. Standard errors are those that the films claim, from the scatter of their samples.");
        if stop.load(Ordering::Relaxed) {
            page.says("Stopped: this is what was rendered until then.");
        }
        page.renders(&stem, &groups.into_values().collect::<Vec<_>>(), common::tone(&scene))
            .plan(&stem, &plan);
    })?;
    Ok(if stop.load(Ordering::Relaxed) { ExitCode::from(130) } else { ExitCode::SUCCESS })
}

/// Writes the linear EXR and the PNG as the scene shows it.
fn write(scene: &Scene, rendered: &Rendered, path: &Path) -> Result<Canvas> {
    let picture = rendered.film.picture();
    let canvas = common::tone(scene).show(&picture);
    write_exr(common::with_extension(path, "exr"), &picture)?;
    write_png(common::with_extension(path, "png"), &canvas)?;
    Ok(canvas)
}

/// `told_error`: whether its own error stopped it.
fn say(scene: &Scene, rendered: &Rendered, told_error: bool, path: &Path) -> Result<()> {
    let seconds = rendered.time.as_secs_f64();
    let pixels = (rendered.film.width() * rendered.film.height()) as f64;
    let mut line = format!(
        "{:9} {:4} spp in {seconds:.2} s ({:.1} million samples a second): {}.exr, .png\n",
        rendered.strategy.to_string(),
        rendered.passes,
        pixels * f64::from(rendered.passes) / seconds / 1e6,
        path.display()
    );
    if rendered.passes > 1 && rendered.film.is_black() {
        line += "  no sample met any light: the picture is black\n";
    }
    if told_error {
        let beyond = share_out_of_reach(scene, rendered.strategy, rendered.passes);
        if beyond > 0.0 {
            line += &format!(
                "  its samples hardly find the lobes that {:.0}% of the tiles show: the error that it was stopped at leaves them out\n",
                100.0 * beyond
            );
        }
    }
    if rendered.non_finite > 0 {
        let non_finite = rendered.non_finite;
        line += &format!("  {non_finite} samples were NaN or infinite and count as black: this is a bug\n");
    }
    common::print(&line)
}
