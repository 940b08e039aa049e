//! A running program as a sampler: everything that is asked of samplers in Rust can be asked of it.

use super::columns::density_is_first;
use super::process::{Greeting, Process, ProgramError};
use super::{Convention, Coordinates, Table, table};
use crate::domain::{Knots, Space};
use crate::random::{fill_unit, stream};
use crate::sampler::{PointOf, Sample, Sampler, fill_vec};
use crate::verify::{Row, Rows, RowsError};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How long a program may take for an answer, unless told.
pub const TIMEOUT: Duration = Duration::from_secs(10);
/// How long it may take for its first line, unless told: imports of numerical libraries are slow.
pub const FIRST_TIMEOUT: Duration = Duration::from_secs(60);
/// Texels of a grid, at most: quadrature asks each of them for its density.
const MOST_TEXELS: usize = 1 << 24;
/// Variates that are asked twice.
const TWICE: usize = 64;
/// Coordinates of points that are no such numbers, but text or bytes in another order, taken for numbers.
const PLAUSIBLE: std::ops::RangeInclusive<f64> = 1e-60..=1e60;

/// A program that has started and said what it samples, but was not asked anything yet.
pub struct Started {
    process: Process,
}

impl Started {
    /// Starts `command`, which is split into words as a shell does, without a shell. The first line and each answer may take `timeout`; if none is told,
    /// [`FIRST_TIMEOUT`] and [`TIMEOUT`].
    ///
    /// # Errors
    /// If it doesn't start, or its first line is not that of the protocol.
    pub fn new(command: &str, timeout: Option<Duration>) -> Result<Self, ProgramError> {
        let timeouts = [TIMEOUT, FIRST_TIMEOUT].map(|unless_told| timeout.unwrap_or(unless_told));
        Ok(Self { process: Process::start(command, timeouts)? })
    }

    /// What it says of itself.
    pub fn greeting(&self) -> &Greeting {
        &self.process.greeting
    }

    /// The sampler, on a domain and under a convention.
    ///
    /// # Errors
    /// If it doesn't say how many variates it takes, dies, hangs, answers nonsense, or gives two answers to the same question.
    pub fn on<D: Coordinates>(self, convention: Convention<D>) -> Result<Program<D>, ProgramError> {
        let wrong = |why: String| ProgramError::Greeting { command: self.process.command.clone(), why };
        let dimensions =
            self.greeting().get("dimensions").ok_or_else(|| wrong("`dimensions` is missing".to_owned()))?;
        let dimensions = match dimensions.parse::<usize>() {
            Ok(d) if (1..=64).contains(&d) => d,
            _ => return Err(wrong(format!("dimensions={dimensions} is not a number from 1 to 64"))),
        };
        let has_density = match self.greeting().get("density") {
            None | Some("yes") => true,
            Some("no") => false,
            Some(other) => return Err(wrong(format!("density={other} is neither yes nor no"))),
        };
        let knots = match self.greeting().get("grid") {
            None => Knots::default(),
            Some(said) => {
                grid(&convention.domain, said).map_err(|why| wrong(format!("grid={said} {why}")))?
            }
        };
        let program = Program {
            process: self.process,
            knots,
            convention,
            dimensions,
            has_density,
            failure: Mutex::new(None),
            failed: AtomicBool::new(false),
            stop: Arc::default(),
            quits: false,
        };
        program.ask_twice()?;
        Ok(program)
    }
}

/// The lines of a grid over the chart of a domain, COLUMNSxROWS.
fn grid(space: &dyn Space, text: &str) -> Result<Knots, String> {
    let of = |text: &str| text.parse::<usize>().ok().filter(|n| (1..=MOST_TEXELS).contains(n));
    let size = text.split_once('x').and_then(|(columns, rows)| Some((of(columns)?, of(rows)?)));
    let Some((columns, rows)) = size else { return Err("is not COLUMNSxROWS, such as 512x256".to_owned()) };
    match space.name() {
        _ if columns * rows > MOST_TEXELS => Err(format!("has more than {MOST_TEXELS} texels")),
        name @ ("triangle" | "discrete") => {
            Err(format!("says nothing on the {name} domain, which has no rows and columns"))
        }
        "interval" if rows > 1 => Err("has more than the one row of an interval".to_owned()),
        _ => Ok(table::grid(space, rows, columns)),
    }
}

/// A running program as a [`Sampler`]. Where it fails (dies, hangs, answers nonsense), samples are rejected and densities 0 from then on,
/// and [`finish`](Self::finish) says why.
///
/// ```no_run
/// use warpcheck::domain::Hemisphere;
/// use warpcheck::foreign::{Convention, Started};
/// let program = Started::new("python3 sampler.py", None)?.on(Convention::new(Hemisphere))?;
/// let report = warpcheck::verify(&program).name("sampler.py").run();
/// program.finish()?;
/// report.assert();
/// # Ok::<(), warpcheck::foreign::ProgramError>(())
/// ```
pub struct Program<D> {
    process: Process,
    /// Where it says that its density may jump.
    knots: Knots,
    convention: Convention<D>,
    dimensions: usize,
    has_density: bool,
    failure: Mutex<Option<ProgramError>>,
    failed: AtomicBool,
    stop: Arc<AtomicBool>,
    /// Whether it is asked no more once that is set.
    quits: bool,
}

impl<D: Coordinates> Program<D> {
    /// A flag to set once the program has failed; for [`Settings::stop`](crate::verify::Settings::stop), so that drawing ends then.
    pub fn stopping(self, stop: Arc<AtomicBool>) -> Self {
        Self { stop, ..self }
    }

    /// Whether its samples are rejected and its densities 0 from the time that the flag is set: where nobody will look at them.
    pub(super) fn quits_when_stopped(&mut self, quits: bool) {
        self.quits = quits;
    }

    /// The same program under another convention, for a while.
    pub(super) fn under(&mut self, convention: Convention<D>) -> Convention<D> {
        std::mem::replace(&mut self.convention, convention)
    }

    /// The convention.
    pub fn convention(&self) -> &Convention<D> {
        &self.convention
    }

    /// Ends the program.
    ///
    /// # Errors
    /// Why it failed on the way; that it wrote more than it was asked for.
    pub fn finish(&self) -> Result<(), ProgramError> {
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner).take();
        failure.map_or_else(|| self.process.finish(), Err)
    }

    fn ask(&self, word: &str, rows: &[f64], width: usize, each: usize, out: &mut Vec<f64>) -> bool {
        if self.failed.load(Ordering::Relaxed) || self.quits && self.stop.load(Ordering::Relaxed) {
            return false;
        }
        let Err(error) = self.process.ask(word, rows, width, each, out) else { return true };
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        self.failed.store(true, Ordering::Relaxed);
        self.stop.store(true, Ordering::Relaxed);
        false
    }

    fn width(&self) -> usize {
        self.convention.domain.names().len()
    }

    /// The same variates in one request and in two: a program that keeps a state, or takes bytes for other numbers, shows.
    fn ask_twice(&self) -> Result<(), ProgramError> {
        let mut xi = vec![0.0; TWICE * self.dimensions];
        fill_unit(&mut stream(0, "asked twice", 0), &mut xi);
        let (width, each) = (self.width(), self.width() + 1);
        let (mut all, mut half, mut again) = (Vec::new(), Vec::new(), Vec::new());
        self.process.ask("sample", &xi, self.dimensions, each, &mut all)?;
        for part in xi.chunks(TWICE / 2 * self.dimensions).rev() {
            self.process.ask("sample", part, self.dimensions, each, &mut half)?;
            again.splice(0..0, half.drain(..));
        }
        let coordinates =
            || all.chunks_exact(each).flat_map(|row| &row[..width]).filter(|x| **x != 0.0 && !x.is_nan());
        let implausible = coordinates().filter(|x| !PLAUSIBLE.contains(&x.abs())).count();
        let rows =
            || all.chunks_exact(each).zip(again.chunks_exact(each)).zip(xi.chunks_exact(self.dimensions));
        if 2 * implausible > coordinates().count() {
            let what = format!("the first of {TWICE} points is {:?}", &all[..width]);
            return Err(ProgramError::Nonsense {
                command: self.process.command.clone(),
                when: format!("when asked `sample {TWICE}`"),
                what,
            });
        }
        if self.convention.domain.has_frame() && density_is_first(&all) {
            return Err(ProgramError::DensityFirst { command: self.process.command.clone() });
        }
        let same = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
        };
        let Some(((a, b), xi)) = rows().find(|((a, b), _)| !same(a, b)) else { return Ok(()) };
        // One that says more than it is asked, little by little, has forgotten nothing.
        self.process.finish()?;
        Err(ProgramError::Forgetful {
            command: self.process.command.clone(),
            xi: xi.to_vec(),
            first: format!("{a:?}"),
            second: format!("{b:?}"),
        })
    }
}

impl<D: Coordinates> Sampler for Program<D> {
    type Domain = D;

    fn domain(&self) -> D {
        self.convention.domain.clone()
    }

    fn dimensions(&self) -> usize {
        self.dimensions
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<D::Point>> {
        alone(self, xi)
    }

    fn density(&self, point: &D::Point) -> f64 {
        let mut out = Vec::new();
        self.density_many(std::slice::from_ref(point), &mut out);
        out[0]
    }

    fn fill(&self, xi: &[f64], out: &mut [Option<Sample<D::Point>>]) {
        let (width, mut answer) = (self.width(), Vec::new());
        if !self.ask("sample", xi, self.dimensions, width + 1, &mut answer) {
            out.fill(None);
            return;
        }
        for (sample, row) in out.iter_mut().zip(answer.chunks_exact(width + 1)) {
            let theirs = row[width];
            *sample = (theirs != f64::NEG_INFINITY).then(|| {
                let point = self.convention.point(&row[..width]);
                let density = self.convention.density(&point, theirs);
                Sample { point, density }
            });
        }
    }

    fn density_many(&self, points: &[D::Point], out: &mut Vec<f64>) {
        out.clear();
        let mut rows = Vec::with_capacity(points.len() * self.width());
        points.iter().for_each(|point| self.convention.numbers(point, &mut rows));
        if self.has_density && self.ask("density", &rows, self.width(), 1, out) {
            out.iter_mut()
                .zip(points)
                .for_each(|(value, point)| *value = self.convention.density(point, *value));
        } else {
            out.clear();
            out.resize(points.len(), 0.0);
        }
    }

    fn has_density(&self) -> bool {
        self.has_density
    }

    fn knots(&self) -> Knots {
        self.knots.clone()
    }

    fn is_slow(&self) -> bool {
        true
    }
}

/// A sample of a sampler that answers many questions at once.
fn alone<S: Sampler>(sampler: &S, xi: &[f64]) -> Option<Sample<PointOf<S>>> {
    let mut out = [const { None }];
    sampler.fill(xi, &mut out);
    let [sample] = out;
    sample
}

/// A program's samples with the density of a table. What comes with its samples is its own density, if it has one.
pub struct WithTable<'a, D> {
    /// The program.
    pub program: &'a Program<D>,
    /// The table.
    pub table: &'a Table<D>,
}

impl<D: Coordinates> Sampler for WithTable<'_, D> {
    type Domain = D;

    fn domain(&self) -> D {
        self.program.domain()
    }

    fn dimensions(&self) -> usize {
        self.program.dimensions
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<D::Point>> {
        alone(self, xi)
    }

    fn density(&self, point: &D::Point) -> f64 {
        self.table.density(point)
    }

    fn density_range(&self, point: &D::Point) -> Option<[f64; 2]> {
        Some(self.table.range(point))
    }

    fn fill(&self, xi: &[f64], out: &mut [Option<Sample<D::Point>>]) {
        self.program.fill(xi, out);
        if !self.program.has_density {
            out.iter_mut().flatten().for_each(|sample| sample.density = self.table.density(&sample.point));
        }
    }

    fn knots(&self) -> Knots {
        self.table.knots()
    }

    fn is_slow(&self) -> bool {
        self.program.is_slow()
    }
}

/// A program's samples as rows: their numbers in our frame, and 1, or 0 for a sample that was rejected.
pub struct ProgramRows<'a, D> {
    program: &'a Program<D>,
    rng: rand_chacha::ChaCha8Rng,
    left: u64,
}

impl<'a, D: Coordinates> ProgramRows<'a, D> {
    /// So many samples.
    pub fn new(program: &'a Program<D>, samples: u64, seed: u64) -> Self {
        Self { program, rng: stream(seed, "program", 0), left: samples }
    }

    /// What a row says.
    pub fn row(domain: &D, row: &[f64]) -> Row<D::Point> {
        let width = row.len() - 1;
        Row {
            point: (row[width] != 0.0).then(|| domain.point_of(&row[..width])),
            density: None,
            weight: None,
        }
    }
}

impl<D: Coordinates> Rows for ProgramRows<'_, D> {
    fn width(&self) -> usize {
        self.program.width() + 1
    }

    fn count(&self) -> Option<u64> {
        Some(self.left)
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        let count = most.min(1 << 14).min(usize::try_from(self.left).unwrap_or(usize::MAX));
        let mut xi = vec![0.0; count * self.program.dimensions];
        fill_unit(&mut self.rng, &mut xi);
        let mut samples = Vec::new();
        fill_vec(self.program, &xi, &mut samples);
        if self.program.failed.load(Ordering::Relaxed) {
            self.program.finish()?;
        }
        for sample in samples {
            match sample {
                Some(sample) => {
                    self.program.convention.domain.numbers_of(&sample.point, out);
                    out.push(1.0);
                }
                None => out.resize(out.len() + self.width(), 0.0),
            }
        }
        self.left -= count as u64;
        Ok(count)
    }
}
