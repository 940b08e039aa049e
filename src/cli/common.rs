//! What commands share: counts with suffixes, the data folder, progress, Ctrl-C, the output folder.

use anyhow::{Context, Result, bail};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use warpcheck::catalogue::{self, Entry};
use warpcheck::estimator::{LightSampling, Selection, Strategy};
use warpcheck::picture::{Picture, Tone};
use warpcheck::report::Style;
use warpcheck::report::html::{GENERATOR, Page};
use warpcheck::sampler::Placement;
use warpcheck::scene::{Display, Scene};

/// Where pictures go unless told.
pub const DEFAULT_OUT: &str = "warpcheck-out";

/// The most samples that can be asked for: days of drawing.
const MOST: u64 = 1_000_000_000_000;

/// A count such as `300`, `50k`, `1.5M`, `1G` or `1e8`.
pub fn count(text: &str) -> Result<u64, String> {
    let (digits, factor) = match text.chars().last() {
        Some('k' | 'K') => (&text[..text.len() - 1], 1e3),
        Some('m' | 'M') => (&text[..text.len() - 1], 1e6),
        Some('g' | 'G') => (&text[..text.len() - 1], 1e9),
        _ => (text, 1.0),
    };
    let value = digits
        .replace('_', "")
        .parse::<f64>()
        .map_err(|_| "not a count; write 300, 50k, 1M or 1e8".to_owned())?;
    let value = value * factor;
    if !value.is_finite() || value < 1.0 {
        return Err("there must be at least 1".to_owned());
    }
    if value > MOST as f64 {
        return Err(format!("too many: at most {MOST:e}"));
    }
    // 1.001 * 1000 is 1000.9999999999999.
    let whole = value.round();
    if (value - whole).abs() > 2.0 * f64::EPSILON * whole {
        return Err("not a whole number".to_owned());
    }
    Ok(whole as u64)
}

/// A count of samples a pixel.
pub fn passes(text: &str) -> Result<u32, String> {
    let most = |&n: &u32| n <= 1_000_000_000;
    u32::try_from(count(text)?).ok().filter(most).ok_or_else(|| "too many: at most 1e9".to_owned())
}

/// A probability strictly between 0 and 1.
pub fn level(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x < 1.0 => Ok(x),
        _ => Err("must be a number between 0 and 1".to_owned()),
    }
}

/// What radiance is multiplied with before it is shown.
pub fn exposure(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
        _ => Err("must be a positive number".to_owned()),
    }
}

/// A time in seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x < 1e9 => Ok(x),
        _ => Err("must be a positive number of seconds".to_owned()),
    }
}

/// How a scene is lit: what `render`, `plan`, `converge` and `agree` have in common.
#[derive(clap::Args)]
pub struct LightArguments {
    /// How triangles of the emitters are selected: area, power or power/d2
    #[arg(long, value_name = "HOW", default_value_t)]
    lights: Selection,
    /// How points on them are placed: area or solid-angle
    #[arg(long, value_name = "HOW", default_value_t)]
    triangles: Placement,
    /// An environment map in place of the scene's
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
}

impl LightArguments {
    /// How the emitters are sampled.
    pub fn sampling(&self) -> LightSampling {
        LightSampling { selection: self.lights, placement: self.triangles }
    }

    /// Whether the light is another than the scene's own.
    pub fn replaces_map(&self) -> bool {
        self.map.is_some()
    }

    /// The scene, under the map that was named.
    pub fn scene(&self, file: &Path) -> Result<Scene> {
        let mut scene = Scene::load(file)?;
        if let Some(map) = &self.map {
            let Some(environment) = &mut scene.environment else {
                bail!("--map replaces the map of a scene, but {} has no [environment]", file.display());
            };
            environment.file.clone_from(map);
        }
        Ok(scene)
    }
}

/// The folder of shipped data: as told, beside the working directory, or where the program was built.
pub fn data_folder(told: Option<&Path>) -> Result<PathBuf> {
    if let Some(folder) = told {
        if !folder.is_dir() {
            bail!("there is no folder {}", folder.display());
        }
        return Ok(folder.to_owned());
    }
    let candidates = [PathBuf::from("data"), PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/data"))];
    candidates.into_iter().find(|folder| folder.join("env").is_dir() && folder.join("mesh").is_dir()).context(
        "the shipped data were found neither in ./data nor where the program was built; say --data DIR",
    )
}

/// The entries with these names or of these families, each once.
pub fn choose<'a>(entries: &'a [Entry], names: &[String]) -> Result<Vec<&'a Entry>> {
    let mut chosen: Vec<&Entry> = Vec::new();
    for name in names {
        match catalogue::find(entries, name) {
            Ok(found) => chosen.extend(found),
            Err(Some(nearest)) => {
                bail!("there is no sampler `{name}`; did you mean `{nearest}`? (--list shows all)")
            }
            Err(None) => bail!("there is no sampler `{name}` (--list shows all)"),
        }
    }
    let mut seen = std::collections::HashSet::new();
    chosen.retain(|entry| seen.insert(&entry.name));
    Ok(chosen)
}

/// The page that every command offers.
#[derive(clap::Args, Default)]
pub struct ReportArgument {
    /// Also write all of it as a page for the browser, DIR/index.html
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
}

impl ReportArgument {
    /// A page to be filled, if one is wanted; finds out now whether it can be written.
    pub fn begin(&self, title: impl Into<String>) -> Result<Option<Dossier>> {
        self.report.as_deref().map(|folder| Dossier::begin(folder, title)).transpose()
    }
}

/// A page that is being filled, and where it goes.
pub struct Dossier {
    pub page: Page,
    folder: PathBuf,
    start: Instant,
    _made: OutputFolder,
}

impl Dossier {
    /// A page for this folder, which is made. Refuses to take the place of a page that isn't ours.
    pub fn begin(folder: &Path, title: impl Into<String>) -> Result<Self> {
        let file = folder.join("index.html");
        if let Ok(there) = std::fs::read(&file) {
            let ours = there.windows(GENERATOR.len()).take(4096).any(|bytes| bytes == GENERATOR.as_bytes());
            if !ours {
                bail!(
                    "{} was not made by warpcheck, and is not replaced; name another folder",
                    file.display()
                );
            }
        }
        let made = OutputFolder::make(folder)?;
        let mut page = Page::new(title);
        page.fact(
            "command",
            std::iter::once("warpcheck".into()).chain(std::env::args().skip(1)).collect::<Vec<_>>().join(" "),
        );
        Ok(Self { page, folder: folder.to_owned(), start: Instant::now(), _made: made })
    }

    /// Writes it and says where.
    pub fn finish(mut self) -> Result<()> {
        self.page.fact("time of the whole run", format!("{:.1} s", self.start.elapsed().as_secs_f64()));
        let file = self.page.write(&self.folder)?;
        say(&format!("report: {}\n", file.display()))
    }
}

/// Adds to the page, if there is one, and writes it.
pub fn finish(dossier: Option<Dossier>, fill: impl FnOnce(&mut Page)) -> Result<()> {
    let Some(mut dossier) = dossier else { return Ok(()) };
    fill(&mut dossier.page);
    dossier.finish()
}

/// Whether [`print`] says nothing: what the main command adds to its page is told there alone.
static MUTE: AtomicBool = AtomicBool::new(false);

/// Does something without a word on standard output.
pub fn quietly<T>(act: impl FnOnce() -> T) -> T {
    MUTE.store(true, Ordering::Relaxed);
    let done = act();
    MUTE.store(false, Ordering::Relaxed);
    done
}

/// The folders that were made for output. Those that nothing was put into go again with this value.
#[must_use]
pub struct OutputFolder(Vec<PathBuf>);

impl OutputFolder {
    /// Makes the folder, and finds out now rather than after the work whether it can be written to.
    pub fn make(folder: &Path) -> Result<Self> {
        let missing = folder.ancestors().filter(|f| !f.as_os_str().is_empty() && !f.exists());
        let made = Self(missing.map(Path::to_owned).collect());
        std::fs::create_dir_all(folder)
            .with_context(|| format!("can't make the folder {}", folder.display()))?;
        probe(folder)?;
        Ok(made)
    }
}

fn probe(folder: &Path) -> Result<()> {
    let probe = folder.join(format!(".warpcheck-{}-probe", std::process::id()));
    std::fs::write(&probe, b"")
        .and_then(|()| std::fs::remove_file(&probe))
        .with_context(|| format!("can't write into the folder {}", folder.display()))
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        for folder in &self.0 {
            // Fails if there is something inside, as it should.
            let _ = std::fs::remove_dir(folder);
        }
    }
}

/// Finds out whether a file can be written, to a folder that is there or is `made`, which is going to be.
pub fn output_file(file: &Path, made: &Path) -> Result<()> {
    if file.is_dir() {
        bail!("{} is a folder, not a file", file.display());
    }
    if file.extension().is_some_and(|e| e == "png" || e == "exr") {
        bail!("{} is the name of a picture; call the JSON file something else", file.display());
    }
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() && folder != made => {
            bail!("there is no folder {} to write {} into", folder.display(), file.display())
        }
        Some(folder) if folder.is_dir() => probe(folder),
        _ => Ok(()),
    }
}

/// To standard output; a reader that has seen enough (`| head`) is no error.
pub fn print(text: &str) -> Result<()> {
    if MUTE.load(Ordering::Relaxed) { Ok(()) } else { say(text) }
}

fn say(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error).context("can't write the result"),
        _ => Ok(()),
    }
}

/// Set by Ctrl-C, the same for all who ask. A second Ctrl-C ends the program at once.
pub fn stop_on_ctrl_c() -> Arc<AtomicBool> {
    static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    if let Some(stop) = STOP.get() {
        return Arc::clone(stop);
    }
    let stop = Arc::clone(STOP.get_or_init(Arc::default));
    let flag = Arc::clone(&stop);
    let handler = move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        if std::io::stderr().is_terminal() {
            eprintln!("\nstopping; what is done is kept (Ctrl-C again to quit at once)");
        }
    };
    // Without a handler Ctrl-C still works, it only keeps nothing.
    let _ = ctrlc::set_handler(handler);
    stop
}

/// Colour on a terminal, unless NO_COLOR is set (no-color.org).
pub fn style() -> Style {
    match std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none() {
        true => Style::Colour,
        false => Style::Plain,
    }
}

/// A progress bar on a terminal, nothing elsewhere.
pub fn progress(total: u64, unit: &str) -> ProgressBar {
    let target = if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    let template = format!(
        "{{msg:32!}} {{bar:30}} {{percent:>3}}%  {{human_pos}} of {{human_len}} {unit}  {{per_sec}}  {{eta}} left"
    );
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style);
    }
    bar
}

/// Makes a progress bar say what is being done, where nobody knows for how long.
pub fn say_on(bar: &ProgressBar, words: String) {
    if let Ok(style) = ProgressStyle::with_template("{spinner} {wide_msg} {elapsed}") {
        bar.set_style(style);
    }
    bar.set_message(words);
    bar.enable_steady_tick(Duration::from_millis(100));
}

pub use warpcheck::picture::file_stem;

/// What was told, or something otherwise.
pub fn or<T: Clone>(told: &[T], otherwise: &[T]) -> Vec<T> {
    if told.is_empty() { otherwise.to_vec() } else { told.to_vec() }
}

/// The strategies that were named, each once, or others if none was.
pub fn strategies(named: &[Strategy], otherwise: &[Strategy]) -> Result<Vec<Strategy>> {
    if let Some(i) = (1..named.len()).find(|&i| named[..i].contains(&named[i])) {
        bail!("--strategy names {} twice; the two would draw the same samples", named[i]);
    }
    Ok(or(named, otherwise))
}

/// What a scene is called.
pub fn stem(scene: &Path) -> String {
    scene.file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned())
}

/// How a scene wants its picture to be shown.
pub fn tone(scene: &Scene) -> Tone {
    let stops = scene.picture.exposure.log2();
    match scene.picture.display {
        Display::Srgb => Tone::Srgb { stops },
        Display::Gamma22 => Tone::Gamma { stops },
    }
}

/// Reads a picture that has to have the size of the scene's.
pub fn reference(scene: &Scene, file: &Path) -> Result<Picture> {
    let picture = warpcheck::picture::read(file)?;
    let (size, wanted) = ((picture.width(), picture.height()), (scene.picture.width, scene.picture.height));
    if size != (wanted.0 as usize, wanted.1 as usize) {
        let (file, (width, height)) = (file.display(), wanted);
        bail!("{file} has {} x {} pixels, the scene's picture {width} x {height}", size.0, size.1);
    }
    if picture.first_bad_texel().is_some() {
        bail!("{} has texels that are no radiance", file.display());
    }
    Ok(picture)
}

/// An error and its causes in one line; a cause that the error quotes is not said again.
pub fn sentence(error: &anyhow::Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |said, cause| match () {
        () if said.is_empty() => cause,
        () if said.contains(&cause) => said,
        () => format!("{said}: {cause}"),
    })
}

/// `path` with a dot and `extension` behind it, where [`Path::with_extension`] would cut `ggx-0.1` short.
pub fn with_extension(path: &Path, extension: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_take_suffixes() {
        assert_eq!(count("300"), Ok(300));
        assert_eq!(count("50k"), Ok(50_000));
        assert_eq!(count("1.5M"), Ok(1_500_000));
        assert_eq!(count("1G"), Ok(1_000_000_000));
        assert_eq!(count("1e8"), Ok(100_000_000));
        assert_eq!(count("1.001k"), Ok(1001));
        for bad in ["0", "-3", "", "k", "1P", "1.0001k", "many", "1.5", "1e99", "NaN", "inf", "1e300G"] {
            assert!(count(bad).is_err(), "{bad}");
        }
    }
}
