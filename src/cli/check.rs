//! `warpcheck check`: samplers that are not in Rust. Samples from files and pipes, or programs that are asked for them.

use super::common::{self, Dossier, OutputFolder, ReportArgument, print};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use indicatif::ProgressBar;
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};
use warpcheck::domain::Space;
use warpcheck::foreign::{
    AGAIN, Columns, Convention, Coordinates, DomainName, Frame, Given, Keeping, Layout, Measure, OneOfTwo,
    Place, Program, ProgramRows, Samples, Started, Table, WithTable, of_densities, of_program, of_samples,
    of_two, read_array, read_to_nothing,
};
use warpcheck::picture::{Compression, write_atomically, write_planes, write_png};
use warpcheck::report;
use warpcheck::sampler::{Sampler, luminance};
use warpcheck::verify::{
    Against, Batch, Diagnosis, Examination, Piece, Recording, Report, Rows, Settings, Verdict,
    compare_recordings, recording, recording_of_pieces,
};

#[derive(Args)]
pub struct Arguments {
    /// Samples: .npy, .npz, text, or bytes with --columns; standard input if none or - is named
    file: Option<PathBuf>,
    /// A program to be asked for samples and densities, in place of a file (docs/protocol.md)
    #[arg(long, value_name = "CMD", conflicts_with_all = ["file", "columns", "partial", "integral"])]
    sampler: Option<String>,
    /// Where points live: square, disk, triangle[:AREA], hemisphere, sphere, interval:LOW:HIGH, discrete:COUNT
    #[arg(long)]
    domain: Option<DomainName>,
    /// What the columns are, and how bytes are numbers: x,y,z,pdf:f32
    #[arg(long, value_name = "NAMES")]
    columns: Option<Columns>,
    /// Frame of the directions: z-up, y-up, x-up, or what our x, y and z are in theirs: x,-z,y
    #[arg(long, allow_hyphen_values = true)]
    frame: Option<Frame>,
    /// What densities that come with the samples are per; the domain's own measure unless told
    #[arg(long)]
    measure: Option<Measure>,
    /// The density as a table over the domain (.npy, .exr, .hdr)
    #[arg(long, value_name = "FILE", conflicts_with = "env")]
    density: Option<PathBuf>,
    /// What the table is per; the domain's own measure unless told
    #[arg(long, value_name = "MEASURE", requires = "density")]
    density_measure: Option<Measure>,
    /// Divide the table by its integral
    #[arg(long, requires = "density")]
    normalise: bool,
    /// The density that is proportional to this environment map (.hdr, .exr)
    #[arg(long, value_name = "FILE")]
    env: Option<PathBuf>,
    /// With the sine: of each row's centre, as most tables have it, or exactly
    #[arg(long, value_name = "HOW", requires = "env", num_args = 0..=1, default_missing_value = "row", require_equals = true)]
    sine: Option<Sine>,
    /// Samples of the same distribution, to compare with; - is standard input
    #[arg(long, value_name = "FILE", conflicts_with_all = ["density", "env", "measure", "partial", "integral", "anytime", "time", "without"])]
    against: Option<PathBuf>,
    /// The density may be 0 over parts of the domain that nothing here says
    #[arg(long)]
    partial: bool,
    /// The integral that the mean of the columns `weight`, or `value` over `pdf`, should be
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true)]
    integral: Option<f64>,
    /// Seconds that a program may take for its first line and for an answer [default: 60 and 10]
    #[arg(long, value_name = "SECONDS", value_parser = common::seconds, allow_negative_numbers = true)]
    timeout: Option<f64>,
    /// Samples, at most: all of a file, 1M of a program unless told
    #[arg(long, value_parser = common::count, allow_negative_numbers = true)]
    samples: Option<u64>,
    /// Seed
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Probability that a right sampler fails, at most
    #[arg(long, default_value = "0.001", value_parser = common::level, allow_negative_numbers = true)]
    alpha: f64,
    /// Look after every batch and stop as soon as the samples are known to be wrong
    #[arg(long)]
    anytime: bool,
    /// Judge for this many seconds at most
    #[arg(long, value_name = "SECONDS", value_parser = common::seconds, allow_negative_numbers = true)]
    time: Option<f64>,
    /// Leave out a check (may be given again; `warpcheck verify --checks` lists them)
    #[arg(long, value_name = "CHECK")]
    without: Vec<String>,
    /// What the report calls the samples
    #[arg(long)]
    name: Option<String>,
    /// Also write pictures into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Also write everything that was found as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Exit with 0 if nothing fails, though something is inconclusive
    #[arg(long)]
    allow_inconclusive: bool,
    #[command(flatten)]
    report: ReportArgument,
    /// Read the samples and do nothing with them, to measure what the pipe costs
    #[arg(long, hide = true)]
    null: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Sine {
    /// Texels weigh the sine of their row's centre, and are uniform in theta
    Row,
    /// The density per solid angle is constant in a texel
    Exact,
}

/// Samples of a program, unless told.
const PROGRAM_SAMPLES: u64 = 1_000_000;

pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    if arguments.null {
        return null(arguments);
    }
    for name in &arguments.without {
        if warpcheck::verify::checks().all(|(known, _)| known != name) {
            bail!("there is no check `{name}` (warpcheck verify --checks lists them)");
        }
    }
    if arguments.timeout.is_some() && arguments.sampler.is_none() {
        bail!("--timeout is for the answers of a program, which --sampler names");
    }
    if arguments.against.as_deref() == Some(Path::new("-")) && reads_stdin(arguments) {
        bail!("standard input can't be both the samples and what they are compared with");
    }
    let out = arguments.out.clone().unwrap_or_default();
    arguments.json.as_deref().map(|file| common::output_file(file, &out)).transpose()?;
    let _folder = arguments.out.as_deref().map(OutputFolder::make).transpose()?;
    let dossier = arguments.report.begin(format!("{}: somebody else's sampler", name(arguments)))?;
    let stop = common::stop_on_ctrl_c();
    let most =
        arguments.samples.unwrap_or(if arguments.sampler.is_some() { PROGRAM_SAMPLES } else { u64::MAX });
    let mut settings = Settings {
        samples: most,
        seed: arguments.seed,
        alpha: arguments.alpha,
        anytime: arguments.anytime,
        time: arguments.time.map(Duration::from_secs_f64),
        without: arguments.without.clone(),
        stop: Some(Arc::clone(&stop)),
        ..Settings::default()
    };
    let bar = common::progress(most, "samples");
    bar.set_message(name(arguments));
    let mine = bar.clone();
    settings.progress = Some(Arc::new(move |drawn| {
        mine.set_length(drawn.of);
        mine.set_position(drawn.samples);
    }));
    let search = Search { bar: &bar, name: name(arguments), stop: &stop, began: Cell::new(false) };
    let mut may_jump = false;
    let examined = match &arguments.sampler {
        Some(command) => {
            let started = Started::new(command, arguments.timeout.map(Duration::from_secs_f64))?;
            let domain = match (arguments.domain, started.greeting().get("domain")) {
                (Some(domain), _) => domain,
                (None, Some(said)) => {
                    said.parse().map_err(anyhow::Error::msg).context("the program's first line")?
                }
                (None, None) => bail!("neither the program nor --domain says where points live"),
            };
            may_jump = started.greeting().get("grid").is_none()
                && !matches!(domain, DomainName::Triangle(_) | DomainName::Discrete(_))
                && !(arguments.density.is_some() || arguments.env.is_some() || arguments.against.is_some());
            warpcheck::on_domain!(domain, domain => program(started, domain, arguments, &settings, &search))
        }
        None => {
            let Some(domain) = arguments.domain else { bail!("say with --domain where the points live") };
            warpcheck::on_domain!(domain, domain => samples(domain, arguments, &settings, &search))
        }
    };
    bar.finish_and_clear();
    let examination = examined?;
    settings.samples = examination.samples;
    let report = Report::new(vec![examination], &settings);
    let stopped = stop.load(Ordering::Relaxed).then(|| match search.began.get() {
        true => "Stopped while the cause was being looked for.",
        false => "Stopped: this is of the samples that were judged until then.",
    });
    let code = conclude(&report, arguments, stopped, dossier)?;
    if may_jump && report.verdict() == Verdict::Inconclusive && report.examinations[0].integral.1 > ROUGH {
        print(
            "hint: if the density jumps from texel to texel, the program's first line can say where: grid=COLUMNSxROWS (docs/protocol.md)\n",
        )?;
    }
    Ok(code)
}

fn null(arguments: &Arguments) -> Result<ExitCode> {
    let start = Instant::now();
    let bytes = read_to_nothing(&place(arguments.file.as_deref()))?;
    let seconds = start.elapsed().as_secs_f64();
    print(&format!("{bytes} bytes in {seconds:.3} s: {:.1} MB/s\n", bytes as f64 / seconds / 1e6))?;
    Ok(ExitCode::SUCCESS)
}

fn place(file: Option<&Path>) -> Place {
    match file {
        Some(file) if file != Path::new("-") => Place::File(file.to_owned()),
        _ => Place::Stdin,
    }
}

/// Whether the samples themselves come from standard input.
fn reads_stdin(arguments: &Arguments) -> bool {
    arguments.sampler.is_none() && place(arguments.file.as_deref()) == Place::Stdin
}

fn name(arguments: &Arguments) -> String {
    let file = |file: &Path| {
        file.file_stem().map_or_else(|| "samples".to_owned(), |s| s.to_string_lossy().into_owned())
    };
    arguments.name.clone().unwrap_or_else(|| match (&arguments.sampler, &arguments.file) {
        (Some(command), _) => command.clone(),
        (None, Some(path)) if path != Path::new("-") => file(path),
        _ => "standard input".to_owned(),
    })
}

/// The convention of the command line, or else the one that a program says, or else ours.
fn convention<D: Coordinates>(
    domain: D,
    arguments: &Arguments,
    started: Option<&Started>,
) -> Result<Convention<D>> {
    let said = |key: &str| started.and_then(|s| s.greeting().get(key).map(str::to_owned));
    let mut convention = Convention::new(domain);
    let frame = match (arguments.frame, said("frame")) {
        (Some(frame), _) => Some(frame),
        (None, Some(said)) => {
            Some(said.parse().map_err(anyhow::Error::msg).context("the program's first line")?)
        }
        (None, None) => None,
    };
    if let Some(frame) = frame {
        if !convention.domain.has_frame() {
            bail!("points of the {} have no frame; only directions do", convention.domain.name());
        }
        convention.frame = frame;
    }
    let measure = match (arguments.measure, said("measure")) {
        (Some(measure), _) => Some(measure),
        (None, Some(said)) => {
            Some(said.parse().map_err(anyhow::Error::msg).context("the program's first line")?)
        }
        (None, None) => None,
    };
    convention.measure = allowed(&convention.domain, measure.unwrap_or(convention.measure))?;
    Ok(convention)
}

fn allowed(space: &dyn Space, measure: Measure) -> Result<Measure> {
    let all = Measure::of(space);
    if !all.contains(&measure) {
        let names: Vec<String> = all.iter().map(Measure::to_string).collect();
        bail!("on the {} densities are per {}, not {measure}", space.name(), names.join(", "));
    }
    Ok(measure)
}

/// The density that was given, and other readings of it.
type Readings<D> = (Table<D>, Vec<(String, Table<D>)>);

fn readings<D>(given: &Option<Readings<D>>, partial: bool) -> Given<'_, D> {
    Given {
        table: given.as_ref().map(|(table, _)| table),
        rivals: given.as_ref().map_or(&[], |(_, rivals)| rivals.as_slice()),
        partial,
    }
}

fn density<D: Coordinates>(domain: &D, arguments: &Arguments) -> Result<Option<Readings<D>>> {
    if let Some(file) = &arguments.env {
        if domain.name() != "sphere" {
            bail!("an environment map is over the sphere, not over the {}", domain.name());
        }
        let (rows, columns, values) = picture(file)?;
        let table = |sine: Option<Sine>| -> Result<Table<D>> {
            let (values, measure) = match sine {
                Some(Sine::Exact) => (values.clone(), Measure::SolidAngle),
                None => (values.clone(), Measure::Uv),
                Some(Sine::Row) => {
                    let sine =
                        |i: usize| (std::f64::consts::PI * ((i / columns) as f64 + 0.5) / rows as f64).sin();
                    (values.iter().enumerate().map(|(i, v)| v * sine(i)).collect(), Measure::Uv)
                }
            };
            let table = Table::new(domain.clone(), rows, columns, values, measure);
            Ok(table.with_context(|| file.display().to_string())?.normalised())
        };
        let readings =
            [(Some(Sine::Row), "--sine"), (None, "no --sine"), (Some(Sine::Exact), "--sine=exact")];
        let others = readings.into_iter().filter(|(sine, _)| *sine != arguments.sine);
        let rivals =
            others.map(|(sine, words)| Ok((words.to_owned(), table(sine)?))).collect::<Result<_>>()?;
        return Ok(Some((table(arguments.sine)?, rivals)));
    }
    let Some(file) = &arguments.density else { return Ok(None) };
    let is_picture =
        file.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case("hdr"));
    let (rows, columns, values) = if is_picture { picture(file)? } else { read_array(file)? };
    let own = allowed(domain, arguments.density_measure.unwrap_or(Measure::of(domain)[0]))?;
    let table = |measure: Measure| -> Result<Table<D>> {
        let table = Table::new(domain.clone(), rows, columns, values.clone(), measure);
        let table = table.with_context(|| file.display().to_string())?;
        Ok(if arguments.normalise { table.normalised() } else { table })
    };
    let others = Measure::of(domain).into_iter().filter(|measure| *measure != own);
    let rivals = others.map(|m| Ok((format!("--density-measure {m}"), table(m)?))).collect::<Result<_>>()?;
    Ok(Some((table(own)?, rivals)))
}

/// The luminance of a picture: rows, columns, values.
fn picture(file: &Path) -> Result<(usize, usize, Vec<f64>)> {
    let picture = warpcheck::picture::read(file)?;
    let values = picture.pixels().iter().map(|&rgb| luminance(rgb)).collect();
    Ok((picture.height(), picture.width(), values))
}

/// The search for what would explain a failure, which may take longer than all else.
struct Search<'a> {
    bar: &'a ProgressBar,
    name: String,
    stop: &'a Arc<AtomicBool>,
    began: Cell<bool>,
}

impl Search<'_> {
    /// Looks for it unless stopped before. What was found until somebody stops it is not the likeliest.
    fn explain(
        &self,
        examination: &mut Examination,
        look: impl FnOnce(&dyn Fn(&str)) -> Result<Option<Diagnosis>>,
    ) -> Result<()> {
        if self.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        self.began.set(true);
        let told = |tried: &str| {
            common::say_on(self.bar, format!("{} fails; looking for the cause: {tried}", self.name));
        };
        let found = look(&told)?;
        let before = examination.diagnosis.take();
        if !self.stop.load(Ordering::Relaxed) {
            examination.diagnosis = found.or(before);
        }
        Ok(())
    }
}

fn samples<D: Coordinates>(
    domain: D,
    arguments: &Arguments,
    settings: &Settings,
    search: &Search<'_>,
) -> Result<Examination> {
    let convention = convention(domain, arguments, None)?;
    let given = density(&convention.domain, arguments)?;
    let place = place(arguments.file.as_deref());
    let read = Samples::open(&place, arguments.columns.as_ref(), &convention)?;
    let layout = read.layout().clone();
    if let Some(file) = &arguments.against {
        let place = self::place(Some(file));
        let others = Samples::open(&place, arguments.columns.as_ref(), &convention)?;
        let (names, theirs) = ([name(arguments), place.name()], others.layout().clone());
        let ((rows, kept), (others, kept_others)) = (Keeping::new(read, AGAIN), Keeping::new(others, AGAIN));
        let first = recorded(&convention, rows, &layout)?.name(&names[0]);
        let second = recorded(&convention, others, &theirs)?.name(&names[1]);
        let examination = compare_recordings(&first, &second, settings).map_err(plain)?;
        let [held, held_others] =
            [&kept, &kept_others].map(|k| k.lock().unwrap_or_else(PoisonError::into_inner));
        let sides = [
            OneOfTwo::of_samples(&held, &layout, &convention, &names[0]),
            OneOfTwo::of_samples(&held_others, &theirs, &convention, &names[1]),
        ];
        return compared(examination, &sides, &convention, settings, search);
    }
    match (arguments.integral, layout.has_weight()) {
        (Some(_), false) => bail!("--integral needs a column `weight` or `value`"),
        (None, true) => {
            bail!("there is a column of weights or values: say with --integral what their mean should be")
        }
        _ => {}
    }
    let told = given.is_some() || layout.has_density();
    if !told && !layout.has_weight() {
        bail!(
            "there is nothing to hold the samples against: name a column `pdf`, or say --density, --env or --against (or --integral with a column `weight`)"
        );
    }
    if given.is_none() && arguments.anytime {
        bail!("--anytime bets on counts, which need a density of every place: --density or --env");
    }
    let (rows, kept) = Keeping::new(read, AGAIN);
    let mut record = recorded(&convention, rows, &layout)?
        .name(name(arguments))
        .partial(arguments.partial)
        .integral(arguments.integral);
    let table = given.as_ref().map(|(table, _)| table);
    if let Some(table) = table {
        record = record
            .knots(table.knots())
            .density_of_places(|places, out| table.at_many(places, out))
            .positive_over(|cell| table.is_positive_over(cell));
    }
    let (mut examination, fails) = judged(record.examine(settings).map_err(plain)?, settings)?;
    // A mean of weights is the same in every frame.
    if fails && told {
        let given = readings(&given, arguments.partial);
        let held = kept.lock().unwrap_or_else(PoisonError::into_inner);
        // Nothing but the column says what the density should be, and nobody what is wrong with it.
        let unexplained = given.table.is_none() && !given.partial && examination.diagnosis.is_none();
        search.explain(&mut examination, |told| {
            let found = of_samples(&held, &layout, &convention, given, settings, told).map_err(plain)?;
            match found {
                None if unexplained => {
                    of_densities(&held, &layout, &convention, settings, told).map_err(plain)
                }
                found => Ok(found),
            }
        })?;
    }
    Ok(examination)
}

/// What two samples that were compared say, and why they differ.
fn compared<D: Coordinates>(
    examination: Examination,
    sides: &[OneOfTwo<'_, D>; 2],
    convention: &Convention<D>,
    settings: &Settings,
    search: &Search<'_>,
) -> Result<Examination> {
    let (mut examination, fails) = judged(examination, settings)?;
    if fails {
        search.explain(&mut examination, |told| of_two(sides, convention, settings, told).map_err(plain))?;
    }
    Ok(examination)
}

fn recorded<'a, D: Coordinates>(
    convention: &'a Convention<D>,
    rows: impl Rows + 'a,
    layout: &'a Layout,
) -> Result<Recording<'a, D>> {
    let width = rows.width();
    let batch = move |rows: Piece<'_>, out: &mut Batch<D::Point>| layout.batch(convention, rows, width, out);
    recording_of_pieces(convention.domain.clone(), rows, batch).map_err(plain)
}

fn plain(error: warpcheck::verify::RowsError) -> anyhow::Error {
    anyhow::Error::msg(error.to_string())
}

/// The examination, and whether it fails.
fn judged(examination: Examination, settings: &Settings) -> Result<(Examination, bool)> {
    let mut report = Report::new(vec![examination], settings);
    let fails = report.verdict() == Verdict::Fail;
    Ok((report.examinations.pop().context("an examination was lost")?, fails))
}

fn program<D: Coordinates>(
    started: Started,
    domain: D,
    arguments: &Arguments,
    settings: &Settings,
    search: &Search<'_>,
) -> Result<Examination> {
    let convention = convention(domain, arguments, Some(&started))?;
    let given = density(&convention.domain, arguments)?;
    let mut program: Program<D> = started.on(convention.clone())?.stopping(Arc::clone(search.stop));
    let name = name(arguments);
    if let Some(file) = &arguments.against {
        let place = place(Some(file));
        let others = Samples::open(&place, arguments.columns.as_ref(), &convention)?;
        let (names, theirs) = ([name, place.name()], others.layout().clone());
        let rows = ProgramRows::new(&program, settings.samples, settings.seed);
        let ((rows, kept), (others, kept_others)) = (Keeping::new(rows, AGAIN), Keeping::new(others, AGAIN));
        let first =
            recording(convention.domain.clone(), rows, |row| ProgramRows::row(&convention.domain, row));
        let first = first.map_err(plain)?.name(&names[0]);
        let second = recorded(&convention, others, &theirs)?.name(&names[1]);
        let examination = compare_recordings(&first, &second, settings).map_err(plain)?;
        program.finish()?;
        let [held, held_others] =
            [&kept, &kept_others].map(|k| k.lock().unwrap_or_else(PoisonError::into_inner));
        let sides = [
            OneOfTwo::of_program(&held, &convention, &names[0]),
            OneOfTwo::of_samples(&held_others, &theirs, &convention, &names[1]),
        ];
        return compared(examination, &sides, &convention, settings, search);
    }
    let examination = match &given {
        Some((table, _)) => {
            let sampler = WithTable { program: &program, table };
            warpcheck::verify(&sampler).name(name).settings(settings.clone()).examine()
        }
        None if !program.has_density() => {
            bail!("the program has no density: say --density, --env or --against")
        }
        None => warpcheck::verify(&program).name(name).settings(settings.clone()).examine(),
    };
    let (mut examination, fails) = judged(examination, settings)?;
    if fails {
        search.explain(&mut examination, |told| {
            Ok(of_program(&mut program, readings(&given, false), settings, told))
        })?;
    }
    program.finish()?;
    Ok(examination)
}

/// An integral that is known less well than this may be of a density with edges.
const ROUGH: f64 = 3e-4;

fn conclude(
    report: &Report,
    arguments: &Arguments,
    stopped: Option<&str>,
    dossier: Option<Dossier>,
) -> Result<ExitCode> {
    let replay = |_: &str| {
        let words: Vec<String> = std::env::args().skip(1).collect();
        let line = shlex::try_join(words.iter().map(String::as_str)).unwrap_or_else(|_| words.join(" "));
        let piped = reads_stdin(arguments) || arguments.against.as_deref() == Some(Path::new("-"));
        format!("warpcheck {line}{}", if piped { ", with the same samples on standard input" } else { "" })
    };
    print(&report::table(report, common::style(), replay))?;
    if let Some(words) = stopped {
        print(&format!("{words}\n"))?;
    }
    let examination = &report.examinations[0];
    if let Some(folder) = arguments.out.as_deref().filter(|_| !examination.cells.is_empty()) {
        let path = folder.join(common::file_stem(&examination.name));
        write_png(common::with_extension(&path, "png"), &report::residual_sheet(report, 0))?;
        let evidence = common::with_extension(&path, "exr");
        if report.verdict() == Verdict::Pass {
            let _ = std::fs::remove_file(evidence); // of an earlier run that failed
        } else {
            write_planes(evidence, &report::residual_planes(examination)?, Compression::Zip)?;
        }
    } else if arguments.out.is_some() {
        let why = match examination.against {
            Against::OwnDensities => {
                "what comes with the samples says nothing of places without one; --density or --env would"
            }
            _ => "there are no cells to draw",
        };
        print(&format!("no pictures: {why}\n"))?;
    }
    if let Some(file) = &arguments.json {
        let json = format!("{:#}\n", report::to_json(report, replay));
        write_atomically(file, |out| out.write_all(json.as_bytes()))?;
    }
    common::finish(dossier, |page| {
        if let Some(words) = stopped {
            page.says(words);
        }
        page.verify(report, replay);
    })?;
    Ok(match report.verdict() {
        _ if stopped.is_some() => ExitCode::from(130),
        Verdict::Fail => ExitCode::from(1),
        Verdict::Inconclusive if !arguments.allow_inconclusive => ExitCode::from(3),
        _ => ExitCode::SUCCESS,
    })
}
