//! A film: what adds samples up and gives their mean.
//!
//! Sums stall (an `f32` sum of halves at 2^24 of them), samples are lost where two threads add at once, rejected samples are not counted. None of it is
//! random, so the questions are asked of sequences whose mean is known exactly:
//!
//! | part | what is added |
//! |---|---|
//! | constant | 0.5, 2^25 times |
//! | small after large | 1e6 once, then 2^22 times 1 |
//! | rejected | one sample of value 1 in four, the others rejected: they count as 0 |
//! | nothing | only rejected samples: the mean is 0, not NaN |
//! | threads | small integers from four threads at once, eight times: their sum has no rounding, whatever the order |

use super::examination::{Against, Examination};
use super::finding::{Finding, Verdict};
use super::report::Report;
use super::setters::setters;
use super::settings::Settings;
use crate::domain::Interval;
use std::time::Instant;

/// Relative error of a mean that nobody minds.
const NEAR: f64 = 1e-5;
const THREADS: usize = 4;
const TRIES: usize = 8;
const EACH: u64 = 1 << 16;

/// Samples for one thread, in order: values, and `None` for what is rejected.
///
/// ```
/// use warpcheck::verify::{film, Values};
/// let in_f64 = |streams: Vec<Values>| {
///     let (mut sum, mut count) = (0.0, 0_u64);
///     for value in streams.into_iter().flatten() {
///         sum += value.unwrap_or(0.0);
///         count += 1;
///     }
///     sum / count as f64
/// };
/// film(in_f64).run().assert();
/// ```
#[derive(Clone, Debug)]
pub struct Values {
    value: fn(u64) -> Option<f64>,
    next: u64,
    end: u64,
}

impl Iterator for Values {
    type Item = Option<f64>;

    #[inline]
    fn next(&mut self) -> Option<Option<f64>> {
        (self.next < self.end).then(|| {
            self.next += 1;
            (self.value)(self.next - 1)
        })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = (self.end - self.next) as usize;
        (left, Some(left))
    }
}

/// Begins to verify a film: `mean` adds up the values of all streams, each on a thread of its own if there are several and the film is meant for
/// that, and gives their mean.
pub fn film<'a>(mean: impl Fn(Vec<Values>) -> f64 + 'a) -> Film<'a> {
    Film { mean: Box::new(mean), name: "film".to_owned() }
}

/// A verification of a film that is being set up; see [`film`].
pub struct Film<'a> {
    mean: Box<dyn Fn(Vec<Values>) -> f64 + 'a>,
    name: String,
}

/// One question.
struct Question {
    part: &'static str,
    value: fn(u64) -> Option<f64>,
    count: u64,
    threads: usize,
    tries: usize,
    mean: f64,
}

fn questions() -> [Question; 5] {
    let one = |part, value, count, mean| Question { part, value, count, threads: 1, tries: 1, mean };
    let large = 1e6 + f64::from(1 << 22);
    let integers: u64 = (0..EACH).map(|i| i % 7).sum();
    [
        one("constant", |_| Some(0.5), 1 << 25, 0.5),
        one(
            "small after large",
            |i| Some(if i == 0 { 1e6 } else { 1.0 }),
            (1 << 22) + 1,
            large / f64::from((1 << 22) + 1),
        ),
        one("rejected", |i| i.is_multiple_of(4).then_some(1.0), 1 << 12, 0.25),
        one("nothing", |_| None, 16, 0.0),
        Question {
            part: "threads",
            value: |i| Some((i % 7) as f64),
            count: EACH,
            threads: THREADS,
            tries: TRIES,
            mean: integers as f64 / EACH as f64,
        },
    ]
}

impl Film<'_> {
    setters! {
        name: "What the report calls it.";
    }

    /// Asks without judging, so that several films can be judged in one [`Report`].
    pub fn examine(self) -> Examination {
        let start = Instant::now();
        let (mut findings, mut samples) = (Vec::new(), 0);
        for question in questions() {
            let streams =
                vec![Values { value: question.value, next: 0, end: question.count }; question.threads];
            let total = question.count * question.threads as u64;
            let wrong = (0..question.tries).find_map(|_| {
                samples += total;
                let mean = (self.mean)(streams.clone());
                let off = (mean - question.mean).abs();
                (!(off <= NEAR * question.mean.abs())).then_some(mean)
            });
            let (verdict, found) = match wrong {
                Some(mean) => (Verdict::Fail, mean),
                None => (Verdict::Pass, question.mean),
            };
            let detail = format!(
                "the mean of {total} samples in {} streams is {found:.9}, and should be {:.9}",
                question.threads, question.mean
            );
            findings.push(Finding::certain("film", verdict, detail).part(question.part));
        }
        Examination {
            domain: "film",
            per: "sample",
            findings,
            time: start.elapsed(),
            ..Examination::bare(self.name.clone(), &Interval::new(0.0, 1.0), samples, Against::Relations)
        }
    }

    /// Asks, and judges the answers.
    pub fn run(self) -> Report {
        Report::new(vec![self.examine()], &Settings::default())
    }
}
