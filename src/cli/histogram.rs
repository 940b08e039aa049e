//! `warpcheck histogram`: draws samples and writes their histogram, of an environment map or of any sampler that ships.

use super::common::{self, DEFAULT_OUT, OutputFolder, ReportArgument};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use warpcheck::catalogue::{self, HistogramFigure};
use warpcheck::domain::{Domain, Space, Sphere};
use warpcheck::histogram::{Histogram, claimed_density};
use warpcheck::picture::{Compression, Picture, Planes, Tone, write_atomically, write_planes, write_png};
use warpcheck::random::{fill_unit, stream};
use warpcheck::report::html::{EnvironmentStop, Page};
use warpcheck::report::{self, EnvironmentFigure, environment_sheet, histogram_sheet};
use warpcheck::sampler::{Form, PackedEnvironment, RowWarp, Sampler, UniformSphere, luminance};
use warpcheck::verify::Settings;

#[derive(Args)]
pub struct Arguments {
    /// An environment map (.hdr or .exr), or the name of a shipped sampler
    target: String,
    /// Samples; several counts, separated by commas, give a picture each
    #[arg(long, default_value = "1M", value_parser = common::count, value_delimiter = ',', allow_negative_numbers = true)]
    samples: Vec<u64>,
    /// Seed
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// How theta is placed inside a row of a map [default: uniform-v]
    #[arg(long, value_enum)]
    rows: Option<Rows>,
    /// Height of the histogram in pixels; that of the map (2048 at most), or 256, unless told
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=2048), allow_negative_numbers = true)]
    height: Option<u32>,
    /// Folder for pictures
    #[arg(long, value_name = "DIR", default_value = DEFAULT_OUT)]
    out: PathBuf,
    /// Also write what was drawn as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Folder of the shipped maps and meshes
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgument,
}

#[derive(Clone, Copy, ValueEnum)]
enum Rows {
    /// Uniform in v
    UniformV,
    /// Uniform in cos theta
    UniformCos,
}

/// Rows of the tallest histogram: a dozen planes of 2048 x 4096 pixels take a gigabyte.
const TALLEST: usize = 2048;
/// Uniform samples, at most.
const UNIFORM: u64 = 10_000_000;
/// Samples that are drawn as dots.
const DOTS: usize = 1500;

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    onto(arguments, None)
}

/// With what was found put onto a page of somebody else's, if there is one.
pub fn onto(arguments: &Arguments, page: Option<&mut Page>) -> Result<ExitCode> {
    let file = Path::new(&arguments.target);
    let extension = file.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let is_file = file.exists() || ["hdr", "exr", "pic"].contains(&extension.as_str());
    let mut counts = arguments.samples.clone();
    counts.sort_unstable();
    counts.dedup();
    let run = Run::new(arguments, &counts);
    arguments.json.as_deref().map(|file| common::output_file(file, &arguments.out)).transpose()?;
    let mut drawn: Vec<(Histogram, Duration)> = Vec::new();
    if is_file {
        let map = Map::read(file, arguments)?;
        let _folder = OutputFolder::make(&arguments.out)?;
        let dossier = match page {
            Some(_) => None,
            None => arguments.report.begin(format!("Samples of the map {}", map.name))?,
        };
        let wanted = page.is_some() || dossier.is_some();
        let mut stops = Vec::new();
        for &samples in &counts {
            if run.stopped() {
                break;
            }
            stops.extend(map.draw(&run, samples, wanted, &mut drawn)?);
        }
        if let (Some(page), false) = (page, stops.is_empty()) {
            map.put(page, stops.clone());
        }
        common::finish(dossier, |page| {
            page.fact("map", format!("{} x {}", map.sampler.map().width(), map.sampler.map().height()))
                .fact("seed", arguments.seed.to_string());
            map.put(page, stops);
        })?;
    } else {
        let data = common::data_folder(arguments.data.as_deref())?;
        let entries = catalogue::entries(&data);
        let entry = match catalogue::find(&entries, &arguments.target).as_deref() {
            Ok([entry]) => *entry,
            Ok(several) => {
                let names: Vec<_> = several.iter().map(|e| e.name.as_str()).collect();
                bail!("`{}` is a family; name one of {}", arguments.target, names.join(", "))
            }
            Err(Some(nearest)) => {
                bail!("there is no file or sampler `{}`; did you mean `{nearest}`?", arguments.target)
            }
            Err(None) => {
                bail!("there is no file or sampler `{}` (`warpcheck verify --list`)", arguments.target)
            }
        };
        if arguments.rows.is_some() {
            bail!(
                "--rows is how the rows of a map's file are sampled; `{}` is a sampler already",
                entry.name
            );
        }
        let subject = entry.make().with_context(|| format!("can't make the sampler {}", entry.name))?;
        let _folder = OutputFolder::make(&arguments.out)?;
        let dossier = match page {
            Some(_) => None,
            None => arguments.report.begin(format!("Samples of {}", entry.name))?,
        };
        let mut figures = Vec::new();
        // Strips need no height.
        let height = arguments.height.map_or(if subject.aspect() > 2.0 { 128 } else { 256 }, |h| h as usize);
        for &samples in &counts {
            if run.stopped() {
                break;
            }
            let start = Instant::now();
            let figure = subject.histogram(height, &run.settings(samples, &entry.name));
            let path = run.path(&entry.name, figure.histogram.samples);
            write_sampler(&path, &entry.name, &figure)?;
            run.say(&figure.histogram, start, &path)?;
            drawn.push((figure.histogram.clone(), start.elapsed()));
            figures.push(figure);
        }
        if let Some(page) = page {
            page.histogram(&entry.name, &figures);
        }
        common::finish(dossier, |page| {
            page.fact("seed", arguments.seed.to_string()).histogram(&entry.name, &figures);
        })?;
    }
    run.bar.finish_and_clear();
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::histograms_to_json(&arguments.target, arguments.seed, &drawn));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    Ok(if run.stopped() { ExitCode::from(130) } else { ExitCode::SUCCESS })
}

/// What all histograms of one call share.
struct Run<'a> {
    arguments: &'a Arguments,
    bar: indicatif::ProgressBar,
    stop: Arc<std::sync::atomic::AtomicBool>,
}

impl<'a> Run<'a> {
    fn new(arguments: &'a Arguments, counts: &[u64]) -> Self {
        let bar = common::progress(counts.iter().sum(), "samples");
        Self { arguments, bar, stop: common::stop_on_ctrl_c() }
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn settings(&self, samples: u64, message: &str) -> Settings {
        let (bar, before) = (self.bar.clone(), self.bar.position());
        bar.set_message(message.to_owned());
        Settings {
            samples,
            seed: self.arguments.seed,
            progress: Some(Arc::new(move |drawn| bar.set_position(before + drawn.samples))),
            stop: Some(Arc::clone(&self.stop)),
            ..Settings::default()
        }
    }

    /// Without an extension: `OUT/NAME-1M`.
    fn path(&self, name: &str, samples: u64) -> PathBuf {
        self.arguments.out.join(format!("{}-{}", common::file_stem(name), short(samples)))
    }

    fn say(&self, histogram: &Histogram, start: Instant, path: &Path) -> Result<()> {
        let seconds = start.elapsed().as_secs_f64();
        let line = format!(
            "{} samples in {seconds:.1} s ({:.1} million a second): {}.png, .exr\n",
            histogram.samples,
            histogram.samples as f64 / seconds / 1e6,
            path.display()
        );
        self.bar.suspend(|| common::print(&line))
    }
}

/// 1000000 as `1M`.
fn short(samples: u64) -> String {
    [(1_000_000_000, "G"), (1_000_000, "M"), (1000, "k")]
        .into_iter()
        .find(|(unit, _)| samples.is_multiple_of(*unit))
        .map_or_else(|| samples.to_string(), |(unit, suffix)| format!("{}{suffix}", samples / unit))
}

fn planes<const N: usize>(histogram: &Histogram, planes: [(&str, &[f64]); N]) -> Result<Planes> {
    let narrow = planes.map(|(name, values)| (name.to_owned(), values.iter().map(|&v| v as f32).collect()));
    let counts = ("counts".to_owned(), histogram.counts.iter().map(|&c| c as f32).collect());
    Ok(Planes::new(histogram.width, histogram.height, narrow.into_iter().chain([counts]))?)
}

fn write_sampler(path: &Path, name: &str, figure: &HistogramFigure) -> Result<()> {
    let planes = planes(&figure.histogram, [("drawn", &figure.drawn), ("claimed", &figure.claimed)])?;
    write_planes(common::with_extension(path, "exr"), &planes, Compression::Zip)?;
    write_png(common::with_extension(path, "png"), &histogram_sheet(name, figure))?;
    Ok(())
}

struct Map {
    name: String,
    sampler: PackedEnvironment,
    /// The map at the histogram's size.
    picture: Picture,
    tone: Tone,
    width: usize,
    height: usize,
    /// Luminance over its integral, per pixel of the histogram.
    target: Vec<f64>,
    seed: u64,
}

impl Map {
    fn read(file: &Path, arguments: &Arguments) -> Result<Self> {
        let rows = match arguments.rows {
            None | Some(Rows::UniformV) => RowWarp::UniformV,
            Some(Rows::UniformCos) => RowWarp::UniformCosTheta,
        };
        let map = catalogue::read_map(file)?;
        // What fills histograms fastest and still keeps strata together.
        let sampler = PackedEnvironment::new(map, rows, Form::Ordered)
            .with_context(|| format!("can't sample {}", file.display()))?;
        let map = sampler.map();
        let height = arguments.height.map_or(map.height().min(TALLEST), |h| h as usize);
        let width = if height == map.height() { map.width() } else { 2 * height };
        let direction = |column: usize, row: usize| {
            let at = [(row as f64 + 0.5) / height as f64, (column as f64 + 0.5) / width as f64];
            Sphere.point(0, at).0.as_vec3()
        };
        let picture = Picture::from_fn(width, height, |x, y| map.radiance(direction(x, y)).into());
        let luminances: Vec<f64> = picture.pixels().iter().map(|&texel| luminance(texel)).collect();
        let measure = |i: usize| Sphere.picture_scale(0.5, ((i / width) as f64 + 0.5) / height as f64);
        let integral = luminances.iter().enumerate().map(|(i, l)| l * measure(i)).sum::<f64>();
        let target = luminances.iter().map(|l| l / integral * (width * height) as f64).collect();
        // Exposed by the geometric mean: a sun does not darken its sky.
        let lit = luminances.iter().filter(|l| **l > 0.0);
        let mean = (lit.clone().map(|l| l.ln()).sum::<f64>() / lit.count().max(1) as f64).exp();
        let tone = Tone::Srgb { stops: (0.18 / mean).log2() as f32 };
        let stem = file.file_stem().map_or_else(|| "map".into(), |s| s.to_string_lossy());
        let name = match rows {
            RowWarp::UniformV => stem.into_owned(),
            RowWarp::UniformCosTheta => format!("{stem}-uniform-cos"),
        };
        Ok(Self { name, sampler, picture, tone, width, height, target, seed: arguments.seed })
    }

    /// Draws and writes; what a page wants, if one does.
    fn draw(
        &self,
        run: &Run<'_>,
        samples: u64,
        wanted: bool,
        drawn: &mut Vec<(Histogram, Duration)>,
    ) -> Result<Option<EnvironmentStop>> {
        let start = Instant::now();
        let settings = run.settings(samples, &self.name);
        let importance = Histogram::draw(&self.sampler, self.width, self.height, &settings);
        let path = run.path(&self.name, importance.samples);
        run.say(&importance, start, &path)?;
        let took = start.elapsed();
        // The uniform ones are only there to be looked at.
        let settings =
            Settings { samples: importance.samples.min(UNIFORM), progress: None, stop: None, ..settings };
        let uniform = Histogram::draw(&UniformSphere, self.width, self.height, &settings);
        let (density, flat) = (importance.density(&Sphere), uniform.density(&Sphere));
        let dots = [dots(&UniformSphere, self.seed), dots(&self.sampler, self.seed)];
        let figure = EnvironmentFigure {
            samples: importance.samples,
            uniform_samples: uniform.samples,
            uniform: &flat,
            importance: &density,
            ..self.figure(&dots)
        };
        let sheet = environment_sheet(&self.name, &figure);
        let stop = wanted.then(|| EnvironmentStop::new(&self.name, &figure));
        let claimed = claimed_density(&self.sampler, self.width, self.height);
        let figures = [
            ("importance", density.as_slice()),
            ("uniform", &flat),
            ("claimed", &claimed),
            ("target", &self.target),
        ];
        write_planes(common::with_extension(&path, "exr"), &planes(&importance, figures)?, Compression::Zip)?;
        write_png(common::with_extension(&path, "png"), &sheet)?;
        drawn.push((importance, took));
        Ok(stop)
    }

    /// The map with dots on it, and no histograms.
    fn figure<'a>(&'a self, dots: &'a [Vec<[f64; 2]>; 2]) -> EnvironmentFigure<'a> {
        EnvironmentFigure {
            picture: &self.picture,
            tone: self.tone,
            samples: 0,
            uniform_samples: 0,
            uniform: &[],
            importance: &[],
            target: &self.target,
            uniform_dots: &dots[0],
            importance_dots: &dots[1],
        }
    }

    fn put(&self, page: &mut Page, stops: Vec<EnvironmentStop>) {
        let dots = [dots(&UniformSphere, self.seed), dots(&self.sampler, self.seed)];
        page.environment(&self.name, &self.figure(&dots), stops);
    }
}

/// The places of the first samples of a histogram.
fn dots<S: Sampler>(sampler: &S, seed: u64) -> Vec<[f64; 2]> {
    let domain = sampler.domain();
    let mut rng = stream(seed, "histogram", 0);
    let mut xi = vec![0.0; sampler.dimensions()];
    (0..DOTS)
        .filter_map(|_| {
            fill_unit(&mut rng, &mut xi);
            let location = domain.locate(&sampler.sample(&xi)?.point).ok()?;
            Some(domain.picture_position(&location))
        })
        .collect()
}
