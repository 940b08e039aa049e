//! Is it only a convention? Before anything else is blamed, the samples are judged again under every other frame and measure that there is, and against every
//! other reading of the density that was given.

use super::source::Held;
use super::table::Table;
use super::{Convention, Coordinates, Layout, Measure, Program, WithTable};
use crate::domain::Space;
use crate::random::{fill_unit, stream};
use crate::sampler::{Sampler, fill_vec};
use crate::verify::{Diagnosis, Evidence, Examination, Report, Row, RowsError, Settings, Verdict, recording};
use glam::DVec3;

/// Rows that are judged again.
pub const AGAIN: usize = 1 << 16;
/// Samples of a program that are judged again, those by which most conventions are ruled out before, and those that only are looked at.
const PROGRAM_AGAIN: u64 = 1 << 15;
const PROGRAM_FIRST: u64 = 1 << 12;
pub(super) const GLANCE: usize = 1024;
/// Frames that are judged, of those under which the rows are likeliest.
pub(super) const FRAMES: usize = 4;

/// What samples are held against.
#[derive(Clone, Copy)]
pub struct Given<'a, D> {
    /// The density, if there is one beside the column.
    pub table: Option<&'a Table<D>>,
    /// Other readings of it, in words.
    pub rivals: &'a [(String, Table<D>)],
    /// Whether the density may be 0 where nobody knows.
    pub partial: bool,
}

/// Settings by which the rows that were kept are judged again.
pub(super) fn settings_of(settings: &Settings) -> Settings {
    Settings {
        samples: AGAIN as u64,
        anytime: false,
        time: None,
        diagnose: false,
        progress: None,
        ..settings.clone()
    }
}

/// Checks that ask for points one by one, which takes a program long.
const ONE_BY_ONE: [&str; 5] = ["jacobian", "round trip", "agreement", "domain", "support"];

/// Whether an examination passes, with an answer of a check that a wrong convention would fail. One that was stopped convinces nobody.
pub(super) fn convinces(examination: Examination, settings: &Settings) -> bool {
    if settings.stopped() {
        return false;
    }
    let telling = ["chi-square", "weights", "two-sample"];
    let answered = |e: &Examination| {
        e.findings.iter().any(|f| telling.contains(&f.check) && matches!(f.evidence, Evidence::Chance { .. }))
    };
    answered(&examination) && Report::new(vec![examination], settings).verdict() == Verdict::Pass
}

/// What the name of this convention is, and how it is told.
pub(super) const FROM_ONE: (&str, &str) = ("indices from 1", "count from 1");

/// Whether indices of a discrete set count from 1, as in Julia, MATLAB and Fortran: none is 0, and some is one beyond the last. Samplers that are off by one
/// and stay inside do neither.
pub(super) fn count_from_one(space: &dyn Space, indices: impl Iterator<Item = f64>) -> bool {
    if space.axes() > 0 {
        return false;
    }
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = indices.fold(ends, |(low, high), index| (low.min(index), high.max(index)));
    low >= 1.0 && high == space.patches() as f64
}

/// Numbers of a row whose index is in this column, counted from 0 in place of 1.
pub(super) fn from_zero(numbers: &[f64], column: usize) -> Vec<f64> {
    let mut numbers = numbers.to_vec();
    numbers[column] -= 1.0;
    numbers
}

fn diagnosis(found: Vec<(String, String)>, settings: &Settings) -> Option<Diagnosis> {
    let whole = |text: String| format!("a convention, most likely: {text} nothing is wrong");
    first_of(found.into_iter().map(|(name, text)| (name, whole(text))), settings)
}

/// The first of these mistakes, each a name and a sentence; the others look the same. None if not all were tried.
pub(super) fn first_of(
    mut found: impl Iterator<Item = (String, String)>,
    settings: &Settings,
) -> Option<Diagnosis> {
    let (name, mut text) = found.next().filter(|_| !settings.stopped())?;
    let alike: Vec<String> = found.map(|(name, _)| name).collect();
    if !alike.is_empty() {
        text += &format!(" (or, which looks the same here: {})", alike[..alike.len().min(3)].join("; "));
    }
    Some(Diagnosis { name, alike, text, explains: true, gain: 0.0, margin: None, others: Vec::new() })
}

/// Judges the rows that were kept under other conventions; what makes them pass is the diagnosis. `told` hears what is tried.
///
/// # Errors
/// None that reading memory could give.
pub fn of_samples<D: Coordinates>(
    held: &Held,
    layout: &Layout,
    convention: &Convention<D>,
    given: Given<'_, D>,
    settings: &Settings,
    told: &dyn Fn(&str),
) -> Result<Option<Diagnosis>, RowsError> {
    let settings = settings_of(settings);
    type RowOf<'a, P> = &'a (dyn Fn(&[f64]) -> Row<P> + Send + Sync);
    let passes_by = |row: RowOf<'_, D::Point>, table: Option<&Table<D>>| -> Result<bool, RowsError> {
        if settings.stopped() {
            return Ok(false);
        }
        let mut rows = recording(convention.domain.clone(), held.again(), row)?.partial(given.partial);
        if let Some(table) = table {
            rows = rows.knots(table.knots()).density_of_places(|places, out| table.at_many(places, out));
        }
        Ok(convinces(rows.examine(&settings)?, &settings))
    };
    let passes = |convention: &Convention<D>, table: Option<&Table<D>>| {
        passes_by(&|row: &[f64]| layout.row(convention, row), table)
    };
    if passes(convention, given.table)? {
        return Ok(None); // so few rows don't show what is wrong
    }
    let mut found = Vec::new();
    let column = layout.point_columns()[0];
    let kept = held.rows(AGAIN).filter(|row| layout.row(convention, row).point.is_some());
    if count_from_one(&convention.domain, kept.map(|row| row[column])) {
        let (name, words) = FROM_ONE;
        told(name);
        if passes_by(&|row: &[f64]| layout.row(convention, &from_zero(row, column)), given.table)? {
            found.push((name.to_owned(), format!("if the indices {words},")));
            return Ok(diagnosis(found, &settings));
        }
    }
    for (words, table) in given.rivals {
        told(words);
        if passes(convention, Some(table))? {
            found.push((words.clone(), format!("with {words},")));
        }
    }
    let measures = convention.others().into_iter().filter(|other| other.measure != convention.measure);
    for other in measures.filter(|_| layout.has_density()) {
        let (name, words) = named(&other, false);
        told(&name);
        if passes(&other, given.table)? {
            found.push((name, words));
            if convention.measure == Measure::of(&convention.domain)[0] {
                found.extend(as_factor(other.measure).map(|factor| (factor.to_owned(), String::new())));
            }
        }
    }
    if !found.is_empty() {
        return Ok(diagnosis(found, &settings));
    }
    let frames = match given.table {
        Some(table) => likeliest_frames(held, layout, convention, table),
        None => upright_frames(held, layout, convention),
    };
    for other in frames {
        let (name, words) = named(&other, true);
        told(&name);
        if passes(&other, given.table)? {
            found.push((name, words));
            // Without a table one way up is enough.
            if given.table.is_none() {
                break;
            }
        }
    }
    Ok(diagnosis(found, &settings))
}

/// What a density per this measure is to whoever means it to be one per the domain's own.
fn as_factor(measure: Measure) -> Option<&'static str> {
    match measure {
        Measure::ProjectedSolidAngle => Some("lacks cos theta"),
        Measure::ThetaPhi => Some("extra sin theta"),
        Measure::RPhi => Some("extra r"),
        _ => None,
    }
}

/// Without a density of the place, turning points about the vertical changes nothing, and which way is up no more than what lies inside, and what a density
/// is per: a frame for each way that is up under which the rows lie inside; none where all of them are as good as the own one.
fn upright_frames<D: Coordinates>(
    held: &Held,
    layout: &Layout,
    convention: &Convention<D>,
) -> Vec<Convention<D>> {
    let inside = |convention: &Convention<D>| {
        let points = held.rows(GLANCE).filter_map(|row| layout.row(convention, row).point);
        let (inside, all) = points.fold((0, 0), |(inside, all), point| {
            (inside + usize::from(convention.domain.locate(&point).is_ok()), all + 1)
        });
        100 * inside >= 99 * all
    };
    if !convention.domain.has_frame() || inside(convention) && convention.measure == Measure::SolidAngle {
        return Vec::new();
    }
    let mut ups = vec![convention.frame.to_theirs(DVec3::Z)];
    let frames = convention.others().into_iter().filter(|other| other.frame != convention.frame);
    let another_way_up = frames.filter(|other| {
        let up = other.frame.to_theirs(DVec3::Z);
        let is_new = !ups.contains(&up);
        ups.push(up);
        is_new
    });
    another_way_up.filter(inside).collect()
}

/// The frames under which the rows have the largest likelihood (that of the right one is the largest in the mean; Gibbs' inequality).
fn likeliest_frames<D: Coordinates>(
    held: &Held,
    layout: &Layout,
    convention: &Convention<D>,
    table: &Table<D>,
) -> Vec<Convention<D>> {
    let score = |convention: &Convention<D>| -> f64 {
        let ln =
            |row: &[f64]| layout.row(convention, row).point.map_or(0.0, |point| table.density(&point).ln());
        held.rows(GLANCE).map(ln).sum()
    };
    likeliest(convention, score)
}

fn likeliest<D: Coordinates>(
    convention: &Convention<D>,
    mut score: impl FnMut(&Convention<D>) -> f64,
) -> Vec<Convention<D>> {
    let frames = convention.others().into_iter().filter(|other| other.frame != convention.frame);
    let mut scored: Vec<(f64, Convention<D>)> = frames.map(|other| (score(&other), other)).collect();
    scored.retain(|(score, _)| *score > f64::NEG_INFINITY);
    scored.sort_by(|a, b| b.0.total_cmp(&a.0)); // stable: the likelier one by habit first
    scored.truncate(FRAMES);
    scored.into_iter().map(|(_, other)| other).collect()
}

fn named<D: Coordinates>(other: &Convention<D>, frame: bool) -> (String, String) {
    let name =
        if frame { format!("--frame {}", other.frame) } else { format!("--measure {}", other.measure) };
    let what = if frame { "the points are read with" } else { "the densities are read with" };
    (name.clone(), format!("if {what} {name},"))
}

/// The same for a program that can be asked again, held against its own density or a table. Once stopped, it is not asked any more.
pub fn of_program<D: Coordinates>(
    program: &mut Program<D>,
    given: Given<'_, D>,
    settings: &Settings,
    told: &dyn Fn(&str),
) -> Option<Diagnosis> {
    let settings = Settings { samples: PROGRAM_AGAIN, ..settings_of(settings) };
    program.quits_when_stopped(true);
    let diagnosis = match given.table {
        Some(table) => against_table(program, table, given.rivals, &settings, told),
        None => against_itself(program, &settings, told),
    };
    program.quits_when_stopped(false);
    diagnosis
}

/// The variates of the samples that are only looked at.
fn glanced<D: Coordinates>(program: &Program<D>, settings: &Settings) -> Vec<f64> {
    let mut xi = vec![0.0; GLANCE * program.dimensions()];
    fill_unit(&mut stream(settings.seed, "conventions", 0), &mut xi);
    xi
}

/// Other readings of the table, then the frames under which the program's samples are likeliest.
fn against_table<D: Coordinates>(
    program: &mut Program<D>,
    table: &Table<D>,
    rivals: &[(String, Table<D>)],
    settings: &Settings,
    told: &dyn Fn(&str),
) -> Option<Diagnosis> {
    let passes = |program: &Program<D>, table: &Table<D>| {
        let sampler = WithTable { program, table };
        convinces(crate::verify(&sampler).settings(settings.clone()).examine(), settings)
    };
    if passes(program, table) {
        return None; // so few samples don't show what is wrong
    }
    let mut found = Vec::new();
    for (words, table) in rivals {
        told(words);
        if passes(program, table) {
            found.push((words.clone(), format!("with {words},")));
        }
    }
    if found.is_empty() {
        let own = program.convention().clone();
        let xi = glanced(program, settings);
        let frames = if own.domain.has_frame() {
            likeliest(&own, |other| {
                program.under(other.clone());
                let mut samples = Vec::new();
                fill_vec(&*program, &xi, &mut samples);
                samples.iter().flatten().map(|sample| table.density(&sample.point).ln()).sum()
            })
        } else {
            Vec::new()
        };
        for other in frames {
            let (name, words) = named(&other, true);
            told(&name);
            program.under(other);
            if passes(program, table) {
                found.push((name, words));
                break;
            }
        }
        program.under(own);
    }
    diagnosis(found, settings)
}

fn against_itself<D: Coordinates>(
    program: &mut Program<D>,
    settings: &Settings,
    told: &dyn Fn(&str),
) -> Option<Diagnosis> {
    let own = program.convention().clone();
    let mut found = Vec::new();
    let xi = glanced(program, settings);
    let inside = |program: &Program<D>| {
        let mut samples = Vec::new();
        fill_vec(program, &xi, &mut samples);
        samples.iter().flatten().all(|s| own.domain.locate(&s.point).is_ok())
    };
    // A sampler that stays inside is as right in one frame as in another.
    let turned = !inside(program);
    for other in own.others().into_iter().filter(|other| (other.frame != own.frame) == turned) {
        if settings.stopped() {
            break;
        }
        let (name, words) = named(&other, turned);
        told(&name);
        program.under(other);
        let passes = |settings: &Settings| {
            convinces(crate::verify(&*program).settings(settings.clone()).examine(), settings)
        };
        // First what a wrong convention hardly passes, without what asks for points one by one: the fewer samples, the fewer cells to integrate over.
        let quick = Settings {
            samples: PROGRAM_FIRST,
            without: [&settings.without[..], &ONE_BY_ONE.map(str::to_owned)].concat(),
            ..settings.clone()
        };
        if inside(program) && passes(&quick) && passes(settings) {
            found.push((name, words));
            break;
        }
    }
    program.under(own);
    diagnosis(found, settings)
}
