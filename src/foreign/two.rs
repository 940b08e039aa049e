//! Do two samples differ only by a convention? They are compared again with one of them read otherwise: in another frame, with an axis mirrored or two exchanged,
//! or with indices that count from 1.

use super::conventions::{
    AGAIN, FRAMES, FROM_ONE, GLANCE, convinces, count_from_one, first_of, from_zero, settings_of,
};
use super::corrections::GAIN;
use super::source::Held;
use super::{Convention, Coordinates, Frame, Layout, ProgramRows};
use crate::domain::{Confusion, Keeps, Location};
use crate::verify::{
    Diagnosis, Evidence, Examination, Finding, Report, Row, RowsError, Settings, Verdict, compare_recordings,
    recording,
};
use glam::DVec3;
use std::sync::Arc;

type RowOf<'a, P> = Box<dyn Fn(&[f64]) -> Row<P> + Send + Sync + 'a>;

/// One of two samples that were compared: rows that were kept, and what they say.
pub struct OneOfTwo<'a, D: Coordinates> {
    held: &'a Held,
    row: RowOf<'a, D::Point>,
    /// The first column of the point.
    column: usize,
    name: &'a str,
}

impl<'a, D: Coordinates> OneOfTwo<'a, D> {
    /// Of a file or pipe.
    pub fn of_samples(
        held: &'a Held,
        layout: &'a Layout,
        convention: &'a Convention<D>,
        name: &'a str,
    ) -> Self {
        let row = Box::new(|numbers: &[f64]| layout.row(convention, numbers));
        Self { held, row, column: layout.point_columns()[0], name }
    }

    /// Of a program.
    pub fn of_program(held: &'a Held, convention: &'a Convention<D>, name: &'a str) -> Self {
        let row = Box::new(|numbers: &[f64]| ProgramRows::row(&convention.domain, numbers));
        Self { held, row, column: 0, name }
    }

    /// Whether more points are outside than a slip at the border puts there.
    fn is_outside(&self, domain: &D) -> bool {
        let points = self.held.rows(GLANCE).filter_map(|numbers| (self.row)(numbers).point);
        let (outside, all) = points.fold((0, 0), |(outside, all), point| {
            (outside + usize::from(domain.locate(&point).is_err()), all + 1)
        });
        100 * outside > all
    }

    fn counts_from_one(&self, domain: &D) -> bool {
        let kept = self.held.rows(AGAIN).filter(|numbers| (self.row)(numbers).point.is_some());
        count_from_one(domain, kept.map(|numbers| numbers[self.column]))
    }
}

/// One way to read one or both of the two otherwise.
struct Reading<'a, P> {
    /// What it is called, and the condition in words.
    name: String,
    words: String,
    /// What the rows of each say then.
    rows: [RowOf<'a, P>; 2],
}

/// The least p-value; 0 where something is wrong for certain.
fn least_p(examination: &Examination) -> f64 {
    let p = |finding: &Finding| match finding.evidence {
        Evidence::Certain(Verdict::Fail) => Some(0.0),
        evidence => evidence.p_values().map(|(_, p)| p),
    };
    examination.findings.iter().filter_map(p).fold(1.0, f64::min)
}

/// Compares the rows that were kept of two samples again, with one of them read under other conventions; what makes them pass is the diagnosis. `told` hears
/// what is tried.
///
/// # Errors
/// None that reading memory could give.
pub fn of_two<D: Coordinates>(
    sides: &[OneOfTwo<'_, D>; 2],
    convention: &Convention<D>,
    settings: &Settings,
    told: &dyn Fn(&str),
) -> Result<Option<Diagnosis>, RowsError> {
    let settings = settings_of(settings);
    let judged = |rows: [&RowOf<'_, D::Point>; 2]| -> Result<Examination, RowsError> {
        let of = |i: usize| {
            let side: &OneOfTwo<'_, D> = &sides[i];
            recording(convention.domain.clone(), side.held.again(), rows[i])
        };
        compare_recordings(&of(0)?, &of(1)?, &settings)
    };
    let before = judged([&sides[0].row, &sides[1].row])?;
    // Where they hardly differ, many a frame is as good as the own one.
    let least = GAIN * least_p(&before);
    if Report::new(vec![before], &settings).verdict() != Verdict::Fail {
        return Ok(None); // so few rows don't show what is wrong
    }
    let mut found = Vec::new();
    for Reading { name, words, rows: [first, second] } in readings(sides, convention) {
        if settings.stopped() {
            return Ok(None);
        }
        told(&name);
        let examination = judged([&first, &second])?;
        if least_p(&examination) <= least {
            continue;
        }
        // As those of a file and of another that was made from it.
        let is_alike = |f: &Finding| {
            f.part == "independence" && matches!(f.evidence, Evidence::Certain(Verdict::Inconclusive))
        };
        let end = if examination.findings.iter().any(is_alike) {
            "the two agree, better than independent samples would"
        } else if convinces(examination, &settings) {
            "nothing is wrong"
        } else {
            continue;
        };
        found.push((name, format!("a convention, most likely: {words}, {end}")));
        if found.len() == FRAMES {
            break;
        }
    }
    Ok(first_of(found.into_iter(), &settings))
}

/// All of them, the likelier ones first.
fn readings<'a, D: Coordinates>(
    sides: &'a [OneOfTwo<'_, D>; 2],
    convention: &'a Convention<D>,
) -> Vec<Reading<'a, D::Point>> {
    let domain = &convention.domain;
    if domain.has_frame() {
        return frames(sides, convention);
    }
    let from_one = [0, 1].map(|i| sides[i].counts_from_one(domain));
    if from_one != [false; 2] {
        let (name, words) = FROM_ONE;
        let whose = match from_one {
            [true, true] => String::new(),
            [first, _] => format!(" of {}", sides[usize::from(!first)].name),
        };
        let row = |i: usize| -> RowOf<'a, D::Point> {
            let side = &sides[i];
            match from_one[i] {
                true => Box::new(|numbers: &[f64]| (side.row)(&from_zero(numbers, side.column))),
                false => Box::new(|numbers: &[f64]| (side.row)(numbers)),
            }
        };
        let words = format!("if the indices{whose} {words}");
        return vec![Reading { name: name.to_owned(), words, rows: [row(0), row(1)] }];
    }
    // Of one axis there is no more than its mirror image, which hardly anybody takes for the other.
    if domain.axes() < 2 {
        return Vec::new();
    }
    let confusions =
        domain.confusions().into_iter().filter(|c| c.keeps == Keeps::Measure && undoes_itself(c));
    let all = confusions.map(|confusion| {
        let words = format!("if the points of {} are read with {}", sides[0].name, confusion.name);
        let name = confusion.name.to_owned();
        let to: Moved<'a, D::Point> = Arc::new(move |point| match domain.locate(&point) {
            Ok(at) => (confusion.origins)(&at).first().map_or(point, |at| domain.point(at.patch, at.at).0),
            Err(_) => point,
        });
        Reading { name, words, rows: moved(sides, [true, false], &to) }
    });
    all.collect()
}

/// Where a point belongs that is read otherwise.
type Moved<'a, P> = Arc<dyn Fn(P) -> P + Send + Sync + 'a>;

/// The rows of both, with the points of some of them moved.
fn moved<'a, D: Coordinates>(
    sides: &'a [OneOfTwo<'_, D>; 2],
    which: [bool; 2],
    to: &Moved<'a, D::Point>,
) -> [RowOf<'a, D::Point>; 2] {
    [0, 1].map(|i| -> RowOf<'a, D::Point> {
        let (side, to) = (&sides[i], Arc::clone(to));
        Box::new(move |numbers| {
            let row = (side.row)(numbers);
            if which[i] { Row { point: row.point.map(&*to), ..row } } else { row }
        })
    })
}

/// Whether places are where they were, once they are taken for each other twice: of others nobody knows by which of the two they are.
fn undoes_itself(confusion: &Confusion) -> bool {
    let start = Location { patch: 0, at: [0.3, 0.1] };
    let once = (confusion.origins)(&start);
    let twice = once.first().map(|at| (confusion.origins)(at));
    let end = twice.as_ref().and_then(|twice| twice.first());
    end.is_some_and(|end| (0..2).all(|axis| (end.at[axis] - start.at[axis]).abs() < 1e-9))
}

/// In every other frame those of which many points are outside, which can't be right in their own one; or else the first. Then it may as well be the second that is
/// turned: frames that have a name come first, whosesoever they are.
fn frames<'a, D: Coordinates>(
    sides: &'a [OneOfTwo<'_, D>; 2],
    convention: &'a Convention<D>,
) -> Vec<Reading<'a, D::Point>> {
    let (domain, own) = (&convention.domain, convention.frame);
    let outside = [0, 1].map(|i| sides[i].is_outside(domain));
    let is_named = |frame: Frame| [Frame::Z_UP, Frame::Y_UP, Frame::X_UP].contains(&frame);
    let of = |frame: Frame| {
        let (which, told) = match outside {
            [false, false] => match as_turned(own, frame) {
                Some(other) if is_named(other) && !is_named(frame) => ([false, true], other),
                _ => ([true, false], frame),
            },
            _ => (outside, frame),
        };
        let to: Moved<'a, D::Point> =
            Arc::new(move |point| domain.to_ours(domain.to_theirs(&point, own), told));
        let name = format!("--frame {told}");
        let (name, whose) = match which {
            [true, true] => (name, String::new()),
            [first, _] => {
                let whose = sides[usize::from(!first)].name;
                (format!("{whose} with {name}"), format!(" of {whose} alone"))
            }
        };
        let words = format!("if the points{whose} are read with --frame {told}");
        (is_named(told), Reading { name, words, rows: moved(sides, which, &to) })
    };
    let mut all: Vec<_> = Frame::all().into_iter().filter(|frame| *frame != own).map(of).collect();
    all.sort_by_key(|(named, _)| !named); // stable: the likelier one by habit first
    all.into_iter().map(|(_, reading)| reading).collect()
}

/// The frame of the second in which it agrees with a first in its own one, if the first in `frame` agrees with the second in `own`.
fn as_turned(own: Frame, frame: Frame) -> Option<Frame> {
    let axes = DVec3::new(1.0, 2.0, 3.0);
    let turned = own.to_ours(frame.to_theirs(own.to_ours(axes)));
    Frame::all().into_iter().find(|other| other.to_ours(axes) == turned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Space, Square};

    #[test]
    fn one_turned_is_the_other_turned_back() {
        for own in [Frame::Z_UP, Frame::Y_UP] {
            for frame in Frame::all() {
                let other = as_turned(own, frame).unwrap();
                // One place as each of them has it: turning either brings the two together.
                let ours = DVec3::new(0.1, -0.2, 0.3);
                let (first, second) = (frame.to_theirs(ours), own.to_theirs(ours));
                assert_eq!(own.to_ours(first), other.to_ours(second), "{own} {frame}");
            }
        }
        assert_eq!(as_turned(Frame::Z_UP, Frame::Y_UP), "x,z,-y".parse().ok());
    }

    #[test]
    fn what_undoes_itself() {
        let names = |undoes: bool| -> Vec<&str> {
            Square.confusions().iter().filter(|c| undoes_itself(c) == undoes).map(|c| c.name).collect()
        };
        assert_eq!(names(false), ["a quarter turn off"; 2]);
        assert_eq!(names(true), ["x mirrored", "y mirrored", "x and y mirrored", "x and y exchanged"]);
    }
}
