//! `warpcheck render`: a scene with one strategy or several, progressively, and the contact sheet of them all.

use super::common::{self, DEFAULT_OUT, OutputFolder};
use anyhow::Result;
use clap::Args;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use warpcheck::estimator::{Lights, Rendered, Settings, Strategy, render};
use warpcheck::picture::{Canvas, Sheet, Tile, write_exr, write_png};
use warpcheck::scene::Scene;

#[derive(Args)]
pub struct Arguments {
    /// The scene file (TOML)
    scene: PathBuf,
    /// uniform, brdf, light or mis:C, C the weight of the BRDF; several, separated by commas [default: mis:0.5]
    #[arg(long, value_delimiter = ',')]
    strategy: Vec<Strategy>,
    /// Samples a pixel; several, separated by commas, give a picture each [default: 16]
    #[arg(long, value_parser = common::passes, value_delimiter = ',', allow_negative_numbers = true)]
    spp: Vec<u32>,
    /// All pictures on one contact sheet [default: brdf, light, mis 3/4, 1/2, 1/4 at 1, 10, 100 spp]
    #[arg(long)]
    sheet: bool,
    /// Seed
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Folder for pictures
    #[arg(long, value_name = "DIR", default_value = DEFAULT_OUT)]
    out: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let (strategies, mut counts) = match arguments.sheet {
        true => (
            common::or(
                &arguments.strategy,
                &[
                    Strategy::Brdf,
                    Strategy::Light,
                    Strategy::Mis { brdf_weight: 0.75 },
                    Strategy::Mis { brdf_weight: 0.5 },
                    Strategy::Mis { brdf_weight: 0.25 },
                ],
            ),
            common::or(&arguments.spp, &[1, 10, 100]),
        ),
        false => (
            common::or(&arguments.strategy, &[Strategy::Mis { brdf_weight: 0.5 }]),
            common::or(&arguments.spp, &[16]),
        ),
    };
    counts.sort_unstable();
    counts.dedup();
    let scene = Scene::load(&arguments.scene)?;
    let lights = Lights::load(&scene)?;
    let stop = common::stop_on_ctrl_c();
    let _folder = OutputFolder::make(&arguments.out)?;
    let most = counts.last().copied().unwrap_or(1);
    let bar = common::progress(u64::from(most) * strategies.len() as u64, "passes");
    let stem = common::stem(&arguments.scene);
    let mut sheet = Sheet::new(format!("{stem}: strategies at equal samples"))
        .notes(format!(
            "{} x {} pixels, seed {}; direct light only",
            scene.picture.width, scene.picture.height, arguments.seed
        ))
        .columns(counts.iter().map(|spp| format!("{spp} spp")))
        .tile_width((scene.picture.width as usize).clamp(256, 512));
    for (i, &strategy) in strategies.iter().enumerate() {
        bar.set_message(format!("{stem} {strategy}"));
        let settings = Settings { spp: 0, seed: arguments.seed };
        let mut rendered = render(&scene, &lights, strategy, settings, |_| true);
        let mut tiles = Vec::new();
        for &spp in &counts {
            rendered.resume(&scene, &lights, spp, |progress| {
                bar.set_position(i as u64 * u64::from(most) + u64::from(progress.passes));
                !stop.load(Ordering::Relaxed)
            });
            if rendered.passes > 0 {
                let path = arguments.out.join(common::file_stem(&format!("{stem}-{strategy}-{spp}spp")));
                let canvas = write(&scene, &rendered, &path)?;
                bar.suspend(|| say(&rendered, &path))?;
                let seconds = rendered.time.as_secs_f64();
                tiles.push(Tile::new(canvas).caption(match rendered.passes < spp {
                    true => format!("stopped after {} spp, {seconds:.1} s", rendered.passes),
                    false => format!("{seconds:.1} s"),
                }));
            }
            if stop.load(Ordering::Relaxed) {
                break;
            }
        }
        if !tiles.is_empty() {
            sheet = sheet.row(strategy.to_string(), tiles);
        }
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    bar.finish_and_clear();
    if arguments.sheet {
        let path = arguments.out.join(format!("{}-sheet.png", common::file_stem(&stem)));
        write_png(&path, &sheet.draw())?;
        common::print(&format!("contact sheet: {}\n", path.display()))?;
    }
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

fn say(rendered: &Rendered, path: &Path) -> Result<()> {
    let seconds = rendered.time.as_secs_f64();
    let pixels = (rendered.film.width() * rendered.film.height()) as f64;
    let mut line = format!(
        "{:9} {:4} spp in {seconds:.2} s ({:.1} million samples a second): {}.exr, .png\n",
        rendered.strategy.to_string(),
        rendered.passes,
        pixels * f64::from(rendered.passes) / seconds / 1e6,
        path.display()
    );
    if rendered.non_finite > 0 {
        let non_finite = rendered.non_finite;
        line += &format!("  {non_finite} samples were NaN or infinite and count as black: this is a bug\n");
    }
    common::print(&line)
}
