//! Extremes: what the samplers do with inputs that break `f32`, plain CDFs and textbook formulas.
//!
//! A [`Row`] is one component, one extreme input and what should happen: a value (within so much of an oracle in `f64` that shares no code with the
//! component), a graceful limit, or a typed error that names the input. [`run`] asks the component and tells what did happen: the
//! worst error, what no variate reaches, and whether all is as it should be.
//!
//! ```
//! use warpcheck::stress::{self, Component};
//! let rows = stress::rows().into_iter().filter(|row| row.component == Component::Triangle && !row.heavy);
//! for (row, outcome) in stress::run(rows, |_| true) {
//!     assert!(outcome.wrong.is_empty(), "{}: {:?}", row.input, outcome.wrong);
//! }
//! ```
//!
//! The rows of discrete samplers and of triangle warps can be asked of one's own: [`discrete_rows`], [`warp_rows`].

mod discrete;
mod environment;
mod lobes;
mod mixture;
mod solid_angle;
mod triangle;

pub use discrete::discrete_rows;
pub use triangle::warp_rows;

use crate::statistics::CompensatedSum;
use std::collections::HashSet;
use std::fmt;
use std::hash::Hash;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// What is put under stress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Selection of an index by weights.
    Discrete,
    /// Warps of the unit square onto a triangle, and points of mesh lights.
    Triangle,
    /// Densities per area seen per solid angle, and solid angles.
    SolidAngle,
    /// Environment maps.
    Environment,
    /// Phong and GGX lobes, and materials of them.
    Lobes,
    /// Mixtures, MIS weights, the film, and the comparison of estimates.
    Mixture,
}

impl Component {
    /// All, in the order of the table.
    pub const ALL: [Self; 6] =
        [Self::Discrete, Self::Triangle, Self::SolidAngle, Self::Environment, Self::Lobes, Self::Mixture];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete",
            Self::Triangle => "triangle",
            Self::SolidAngle => "solid-angle",
            Self::Environment => "environment",
            Self::Lobes => "lobes",
            Self::Mixture => "mixture",
        }
    }

    /// A row about this component whose question is `ask`. Errors are allowed up to `allowed`.
    pub fn row(
        self,
        kind: Kind,
        input: impl Into<String>,
        should: impl Into<String>,
        (allowed, unit): (f64, Unit),
        ask: impl Fn(&mut Trial) + Send + Sync + 'static,
    ) -> Row {
        let (component, input, should) = (self, input.into(), should.into());
        Row { component, input, should, kind, allowed, unit, heavy: false, ask: Box::new(ask) }
    }
}

impl fmt::Display for Component {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// There is no component of this name.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("there is no component `{given}`; there are {}", Component::ALL.map(Component::name).join(", "))]
pub struct UnknownComponent {
    /// What was asked for.
    pub given: String,
}

impl FromStr for Component {
    type Err = UnknownComponent;

    fn from_str(given: &str) -> Result<Self, UnknownComponent> {
        let found = Self::ALL.into_iter().find(|component| component.name() == given);
        found.ok_or_else(|| UnknownComponent { given: given.into() })
    }
}

/// What should happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The right value.
    Value,
    /// Where there is no right value, or none that can be held: a limit that does no harm.
    Limit,
    /// A typed error that names the input.
    Refusal,
}

impl Kind {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Value => "value",
            Self::Limit => "limit",
            Self::Refusal => "error",
        }
    }
}

/// How errors are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Steps of `f32` at the true value; half a step is rounding.
    UlpF32,
    /// Steps of `f64` at the true value.
    UlpF64,
    /// Parts of the true value.
    Relative,
    /// As it is, for probabilities.
    Absolute,
}

impl Unit {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::UlpF32 => "ulp32",
            Self::UlpF64 => "ulp64",
            Self::Relative => "rel",
            Self::Absolute => "abs",
        }
    }

    /// How far `found` is from `truth`; infinite if `found` is no number, and relative to a true 0 unless it is met.
    fn error(self, found: f64, truth: f64) -> f64 {
        let error = match self {
            _ if found == truth => 0.0,
            Self::UlpF32 => (found - truth).abs() / ulp_f32(truth),
            Self::UlpF64 => (found - truth).abs() / (truth.abs().next_up() - truth.abs()),
            Self::Relative => (found - truth).abs() / truth.abs(),
            Self::Absolute => (found - truth).abs(),
        };
        if error.is_nan() { f64::INFINITY } else { error }
    }
}

/// The step of `f32` from |x| on.
fn ulp_f32(x: f64) -> f64 {
    let x = (x as f32).abs();
    f64::from(x.next_up()) - f64::from(x)
}

/// What of a component no variate reaches: entries with a weight, lights, texels with light, variates whose points fall together. Each is looked for by
/// draws from inside the interval of variates that is said to be its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reach {
    /// How many there are.
    pub of: u64,
    /// How many variates of 53 bits miss. None should be.
    pub missed: u64,
    /// How many variates of 24 bits miss (one `f32`), and the share of the mass that these have; `None` where that is no question. It is the
    /// variate that lacks the bits, not the component, so this is for information.
    pub missed_by_24_bits: Option<(u64, f64)>,
}

impl Reach {
    /// What both lose, added up; variates of 24 bits count where they are asked of either.
    pub fn and(self, other: Self) -> Self {
        let missed_by_24_bits = match (self.missed_by_24_bits, other.missed_by_24_bits) {
            (Some(a), Some(b)) => Some((a.0 + b.0, a.1 + b.1)),
            (one, another) => one.or(another),
        };
        Self { of: self.of + other.of, missed: self.missed + other.missed, missed_by_24_bits }
    }

    /// Of variates that differ, how many draw what another one drew before.
    fn told_apart<T: Eq + Hash>(drawn: impl IntoIterator<Item = T>) -> Self {
        let (mut of, mut seen) = (0, HashSet::new());
        for drawn in drawn {
            of += 1;
            seen.insert(drawn);
        }
        Self { of, missed: of - seen.len() as u64, missed_by_24_bits: None }
    }

    /// One more, of this mass; whether variates of 53 and of 24 bits draw it.
    fn count(&mut self, drawn: [bool; 2], mass: f64) {
        let [by_53, by_24] = drawn;
        self.of += 1;
        self.missed += u64::from(!by_53);
        let (missed, share) = self.missed_by_24_bits.unwrap_or_default();
        self.missed_by_24_bits = Some(if by_24 { (missed, share) } else { (missed + 1, share + mass) });
    }
}

/// How far masses are off in parts of the true ones. A table in whole steps of 2^-53 has few digits where the mass is a few steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Relative {
    /// The share from which on an entry counts as heavy: N steps of 2^-53, for N entries of positive weight.
    pub share: f64,
    /// How many are heavy.
    pub heavy: u64,
    /// The worst error of these.
    pub worst: f64,
    /// How many are lighter.
    pub light: u64,
    /// How many of the light ones have one step, the least that a table gives.
    pub of_one_step: u64,
    /// The worst error of the light ones.
    pub worst_of_light: f64,
}

impl fmt::Display for Relative {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.worst {
            0.0 => write!(f, "rel 0"),
            worst => write!(f, "rel {worst:.1e}"),
        }?;
        if self.light > 0 {
            write!(
                f,
                " down to shares of {:.1e}; of {} lighter {} have one step, rel {:.1e}",
                self.share, self.light, self.of_one_step, self.worst_of_light
            )?;
        }
        Ok(())
    }
}

/// One line of the table.
pub struct Row {
    /// What is asked.
    pub component: Component,
    /// What it is given.
    pub input: String,
    /// What should happen …
    pub should: String,
    /// … and of which kind that is.
    pub kind: Kind,
    /// The largest error that is allowed.
    pub allowed: f64,
    /// In which unit.
    pub unit: Unit,
    /// Whether it takes more than a second, or a GB of memory.
    pub heavy: bool,
    ask: Box<dyn Fn(&mut Trial) + Send + Sync>,
}

impl Row {
    /// The same row as one that takes long.
    pub fn heavy(self) -> Self {
        Self { heavy: true, ..self }
    }

    /// Asks the component.
    pub fn run(&self) -> Outcome {
        let start = Instant::now();
        let mut trial = Trial { unit: self.unit, ..Trial::new() };
        // A panic is an answer too, a wrong one.
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| (self.ask)(&mut trial))) {
            let words = panic.downcast_ref::<String>().map(String::as_str);
            let words = words.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
            trial.wrong(format!("panicked: {words}"));
        }
        let Trial { worst, reach, relative, notes, mut wrong, unsaid, asked, .. } = trial;
        if let Some((error, place)) = worst.as_ref().filter(|(error, _)| !(*error <= self.allowed)) {
            wrong.insert(0, format!("error {error:.3e} {} at {place}", self.unit.name()));
        }
        if let Some(reach) = reach.filter(|reach| reach.missed > 0) {
            wrong.push(format!("{} of {} are never reached", reach.missed, reach.of));
        }
        if asked == 0 {
            wrong.push("nothing was asked".into());
        }
        if unsaid > 0 {
            wrong.push(format!("and {unsaid} more"));
        }
        let worst = worst.map(|(error, _)| error);
        Outcome { happened: notes.join("; "), worst, relative, reach, wrong, time: start.elapsed() }
    }
}

impl fmt::Debug for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}: {}", self.component, self.input, self.should)
    }
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// In words.
    pub happened: String,
    /// The worst error, in the row's unit; `None` where nothing has a true value.
    pub worst: Option<f64>,
    /// Errors of masses in parts of the true ones; `None` but for tables of weights.
    pub relative: Option<Relative>,
    /// What no variate reaches; `None` where that is no question: nothing is drawn, or there is nothing to be missed.
    pub reach: Option<Reach>,
    /// What is not as it should be; empty if all is.
    pub wrong: Vec<String>,
    /// How long it took.
    pub time: Duration,
}

impl Outcome {
    /// Whether all is as it should be.
    pub fn is_ok(&self) -> bool {
        self.wrong.is_empty()
    }
}

/// How a row's question is put: it tells what it found, and the trial keeps the worst.
pub struct Trial {
    unit: Unit,
    worst: Option<(f64, String)>,
    reach: Option<Reach>,
    relative: Option<Relative>,
    notes: Vec<String>,
    wrong: Vec<String>,
    unsaid: u64,
    asked: u64,
}

impl Trial {
    /// More complaints than these are only counted.
    const COMPLAINTS: usize = 3;

    fn new() -> Self {
        let (notes, wrong) = (Vec::new(), Vec::new());
        Self {
            unit: Unit::Absolute,
            worst: None,
            reach: None,
            relative: None,
            notes,
            wrong,
            unsaid: 0,
            asked: 0,
        }
    }

    /// A value and what it should be; `place` says where, should it be the worst.
    pub fn compare<P: fmt::Display>(&mut self, found: f64, truth: f64, place: impl FnOnce() -> P) {
        self.asked += 1;
        let error = self.unit.error(found, truth);
        if self.worst.as_ref().is_none_or(|(worst, _)| error > *worst) {
            self.worst = Some((error, format!("{}: {found:e}, truth {truth:e}", place())));
        }
    }

    /// What has to hold; `complaint` says what is wrong if it doesn't.
    pub fn must(&mut self, holds: bool, complaint: impl FnOnce() -> String) {
        self.asked += 1;
        if !holds {
            self.wrong(complaint());
        }
    }

    /// The component has to refuse, with an error that `is_right`.
    pub fn refused<T, E: fmt::Display>(&mut self, result: Result<T, E>, is_right: impl FnOnce(&E) -> bool) {
        match result {
            Err(error) => {
                self.note(error.to_string());
                self.must(is_right(&error), || format!("another error was expected: {error}"));
            }
            Ok(_) => self.must(false, || "was accepted".into()),
        }
    }

    /// The component has to accept.
    pub fn accepted<T, E: fmt::Display>(&mut self, result: Result<T, E>) -> Option<T> {
        self.asked += 1;
        result.map_err(|error| self.wrong(format!("was refused: {error}"))).ok()
    }

    /// What no variate reaches; of several answers all, added up.
    pub fn reach(&mut self, reach: Reach) {
        self.asked += 1;
        self.reach = Some(self.reach.map_or(reach, |before| before.and(reach)));
    }

    /// Errors of masses in parts of the true ones.
    pub fn relative(&mut self, relative: Relative) {
        self.asked += 1;
        self.relative = Some(relative);
    }

    /// What happened, in words.
    pub fn note(&mut self, happened: impl Into<String>) {
        self.notes.push(happened.into());
    }

    fn wrong(&mut self, complaint: String) {
        if self.wrong.len() < Self::COMPLAINTS { self.wrong.push(complaint) } else { self.unsaid += 1 }
    }
}

/// The whole table, in order of the components.
pub fn rows() -> Vec<Row> {
    let mut all = discrete::rows();
    all.extend(triangle::rows());
    all.extend(solid_angle::rows());
    all.extend(environment::rows());
    all.extend(lobes::rows());
    all.extend(mixture::rows());
    all
}

/// Runs rows one after the other, since some need much memory. `on_row` is called before each and says whether to go on; what is done when it says
/// no is kept.
pub fn run(rows: impl IntoIterator<Item = Row>, mut on_row: impl FnMut(&Row) -> bool) -> Vec<(Row, Outcome)> {
    let mut done = Vec::new();
    for row in rows {
        if !on_row(&row) {
            break;
        }
        let outcome = row.run();
        done.push((row, outcome));
    }
    done
}

// ---- What the components' files share ----

/// A variate of every sort that is known to make trouble: 0, the least of 24, 32 and 53 bits, around 1/2, the largest under 1.
const CORNERS: [f64; 9] = [
    0.0,
    1.0 / 9_007_199_254_740_992.0,
    1.0 / 4_294_967_296.0,
    1.0 / 16_777_216.0,
    0.5 - 1.0 / 16_777_216.0,
    0.5,
    0.5 + 1.0 / 16_777_216.0,
    1.0 - 1.0 / 16_777_216.0,
    crate::random::ONE_MINUS_EPSILON_F64,
];

/// So many points of the unit square, evenly spread: multiples of 1 / count and of the golden ratio. No edge that runs along an axis meets many of them, as
/// it would meet a square grid's.
fn lattice(count: u32) -> impl Iterator<Item = [f64; 2]> {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    (0..count).map(move |i| [(f64::from(i) + 0.5) / f64::from(count), (f64::from(i) * GOLDEN).fract()])
}

/// All pairs of [`CORNERS`].
fn corner_pairs() -> impl Iterator<Item = [f64; 2]> {
    CORNERS.into_iter().flat_map(|a| CORNERS.into_iter().map(move |b| [a, b]))
}

/// The mean of many terms, without rounding that matters.
fn mean(terms: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (CompensatedSum::new(), 0_u64);
    terms.for_each(|x| {
        sum.add(x);
        count += 1;
    });
    sum.value() / count as f64
}

/// How fine the variates are whose reach is asked.
const BITS: [u32; 2] = [53, 24];

/// Of the variates of so many bits in `[start, end)` the first, one in the middle and the last; none if it has none.
fn variates_in((start, end): (f64, f64), bits: u32) -> impl Iterator<Item = f64> + Clone {
    let steps = (1_u64 << bits) as f64;
    let (first, last) = ((start * steps).ceil(), (end * steps).ceil().min(steps) - 1.0);
    let middle = first + (0.5 * (last - first)).floor();
    let some = if first <= last { 3 } else { 0 };
    [first, middle, last].into_iter().take(some).map(move |step| step / steps)
}

/// The first and the last variate of so many bits in each of so many cells of equal width, where they have any. A cell of an alias table has two entries, one at
/// either end: nothing else is in it.
fn ends_of_cells(cells: usize, bits: u32) -> impl Iterator<Item = [f64; 2]> {
    let (cells, steps) = (cells as u64, 1_u64 << bits);
    // ceil(cell 2^bits / cells), in pieces that fit.
    let start = move |cell: u64| cell * (steps / cells) + (cell * (steps % cells)).div_ceil(cells);
    let mut next = 0;
    (1..=cells).filter_map(move |cell| {
        let first = std::mem::replace(&mut next, start(cell));
        (first < next).then(|| [first, next - 1].map(|step| step as f64 / steps as f64))
    })
}
