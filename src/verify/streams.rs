//! Streams of points that should not depend on each other: the threads, pixels or passes of a renderer.
//!
//! - two streams at the same place, and a place apart: tables of counts, class by class, tested for independence (Pearson; see the check `independence`);
//! - consecutive points of each stream, likewise;
//! - points of different streams that are equal to the last bit, against how often points of one stream are: given the number of equal pairs, that
//!   between streams is binomial;
//! - runs of w points that come up twice, anywhere: at the rate q of equal points, P pairs of runs have one with a probability of P q^w at most, and w is so
//!   long that this is nothing. Finds a stream that is another one shifted by any lag, or that starts over.

use super::examination::{Against, Examination};
use super::expectation::LEAST;
use super::finding::{Evidence, Finding, Verdict};
use super::points::{PointsError, locate};
use super::report::Report;
use super::setters::setters;
use super::settings::Settings;
use crate::domain::{Domain, Knots, Location, Partition, Space};
use crate::sampler::ToPoint;
use crate::statistics::{binomial, chi_square};
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::time::Instant;

const CHECK: &str = "streams";
/// Up to this many streams every pair is looked at, beyond it neighbours only.
const ALL_PAIRS: usize = 8;
/// Classes that tables have, at most.
const CLASSES: f64 = 16.0;
/// Points that classes are cut from.
const PILOTS: usize = 1 << 14;
/// A run that comes up twice has no larger probability than this.
const NOTHING: f64 = 1e-8;
/// Longest run that is looked for.
const LONGEST: usize = 256;

/// Begins to look at streams of points, each in the order in which it was drawn: do they depend on each other, or on themselves?
///
/// All pairs of up to 8 streams are held against each other, of more of them each stream and the next; equal points and runs are looked for in all.
///
/// ```
/// use warpcheck::domain::Square;
/// use warpcheck::random::{stream, unit_f64};
/// use warpcheck::verify::{Verdict, streams};
///
/// let thread = |seed| {
///     let mut rng = stream(seed, "my renderer", 0);
///     (0..4096).map(|_| [unit_f64(&mut rng), unit_f64(&mut rng)]).collect::<Vec<_>>()
/// };
/// streams(Square, &[thread(1), thread(2), thread(3)])?.run().assert();
/// // Two threads with one seed:
/// assert_eq!(streams(Square, &[thread(1), thread(2), thread(1)])?.run().verdict(), Verdict::Fail);
/// # Ok::<(), warpcheck::verify::PointsError>(())
/// ```
///
/// # Errors
/// Without streams, if one has no points, or if a point lies outside of the domain (named by stream and index).
pub fn streams<D, L, T>(domain: D, streams: &[L]) -> Result<Streams, PointsError>
where
    D: Domain,
    L: AsRef<[T]>,
    T: ToPoint<D::Point> + Clone,
{
    if streams.is_empty() {
        return Err(PointsError::NoStreams);
    }
    let mut located = Vec::with_capacity(streams.len());
    for (stream, points) in streams.iter().enumerate() {
        let points = points.as_ref();
        if points.is_empty() {
            return Err(PointsError::EmptyStream { stream });
        }
        located.push(
            locate(&domain, points.iter().cloned().map(ToPoint::to_point))
                .map_err(|(index, point, why)| PointsError::PointOfStream { stream, index, point, why })?,
        );
    }
    Ok(Streams {
        space: Box::new(domain),
        streams: located,
        name: "streams".to_owned(),
        settings: Settings::default(),
    })
}

/// A look at streams that is being set up; see [`streams`].
pub struct Streams {
    space: Box<dyn Space>,
    streams: Vec<Vec<Location>>,
    name: String,
    settings: Settings,
}

impl Streams {
    setters! {
        name: "What the report calls them.";
        alpha: "The probability that independent streams fail, at most; 1e-3 unless told.";
        run: "Makes the tests and judges them.";
    }

    /// Makes the tests without judging them, so that they can be judged with others in one [`Report`].
    pub fn examine(self) -> Examination {
        let start = Instant::now();
        let points = self.streams.iter().map(Vec::len).sum::<usize>() as u64;
        let mut examination = Examination::bare(self.name.clone(), &*self.space, points, Against::Relations);
        examination.findings = self.tables();
        examination.findings.extend(self.repeats());
        if examination.findings.is_empty() {
            let detail = format!("{points} points are too few to tell anything");
            examination.findings.push(Finding::certain(CHECK, Verdict::Inconclusive, detail));
        }
        examination.time = start.elapsed();
        examination
    }

    fn tables(&self) -> Vec<Finding> {
        let shortest = self.streams.iter().map(Vec::len).min().unwrap_or(0);
        let wanted = (shortest as f64 / LEAST).sqrt().min(CLASSES);
        if wanted < 2.0 {
            return Vec::new();
        }
        // All streams give the cuts and the classes: a table is judged given its margins.
        let all = self.streams.iter().map(Vec::len).sum::<usize>();
        let pilots: Vec<Location> =
            self.streams.iter().flatten().step_by(all.div_ceil(PILOTS)).copied().collect();
        // Far lighter than a class: whichever entries or places share a leaf share their class.
        let per_leaf = (pilots.len() / 256).max(1);
        let partition = Partition::from_pilots(&*self.space, pilots, &Knots::default(), per_leaf);
        let leaves: Vec<Vec<usize>> =
            self.streams.iter().map(|points| points.iter().map(|p| partition.leaf_of(p)).collect()).collect();
        let mut masses = vec![0.0; partition.leaves().len()];
        leaves.iter().flatten().for_each(|&leaf| masses[leaf] += 1.0 / all as f64);
        // Cells weigh between half of this and all of it.
        let groups = partition.group(&masses, 1.4 / wanted, 0.0);
        let (class_of_group, classes) = join_light(&groups.of_leaf, &masses, groups.cells.len(), shortest);
        if classes < 2 {
            return Vec::new();
        }
        let class = |leaf: usize| groups.of_leaf[leaf].map_or(0, |group| class_of_group[group]);
        let joint = |pairs: &mut dyn Iterator<Item = (usize, usize)>| {
            let mut counts = vec![0; classes * classes];
            pairs.for_each(|(a, b)| counts[class(a) * classes + class(b)] += 1);
            counts
        };
        let apart = |a: &[usize], b: &[usize]| joint(&mut a.iter().copied().zip(b.iter().copied()));
        let mut findings = Vec::new();
        for (i, stream) in leaves.iter().enumerate() {
            let part = format!("stream {i}, consecutive points");
            findings.extend(table(part, &apart(stream, &stream[1..]), classes));
        }
        for first in 0..leaves.len() {
            let all = leaves.len() <= ALL_PAIRS;
            for second in first + 1..if all { leaves.len() } else { (first + 2).min(leaves.len()) } {
                let (a, b) = (&leaves[first], &leaves[second]);
                let pairs = [
                    ("same place", apart(a, b)),
                    ("the second a place ahead", apart(a, &b[1..])),
                    ("the first a place ahead", apart(&a[1..], b)),
                ];
                for (how, counts) in pairs {
                    let part = format!("streams {first} and {second}, {how}");
                    findings.extend(table(part, &counts, classes));
                }
            }
        }
        findings
    }

    fn repeats(&self) -> Vec<Finding> {
        let lengths: Vec<f64> = self.streams.iter().map(|s| s.len() as f64).collect();
        let within: f64 = lengths.iter().map(|n| 0.5 * n * (n - 1.0)).sum();
        let total: f64 = lengths.iter().sum();
        let between = 0.5 * total * (total - 1.0) - within;
        if within < 1.0 {
            return Vec::new();
        }
        let points = self.equal_runs(1);
        let mut findings = Vec::new();
        // Entries and atoms are equal so often that pairs of pairs hang together; for them there are the runs.
        let continuous = self.space.axes() > 0 && !(0..self.space.patches()).any(|p| self.space.is_atom(p));
        if continuous && between > 0.0 {
            let (b, w) = (points.between, points.within);
            let p = if b + w == 0 {
                1.0
            } else {
                binomial::upper_tail(b, b + w, between / (between + within)).unwrap_or(f64::NAN)
            };
            let detail = format!(
                "{b} pairs of points of different streams are equal to the last bit, and {w} of one stream{}",
                points.example()
            );
            findings.push(chance(p, detail).part("equal points"));
        }
        // The rate of equal points, not less than what as many pairs may hide.
        let rate = ((points.within as f64 + 3.0) / within).min(1.0);
        let shortest = self.streams.iter().map(Vec::len).min().unwrap_or(0);
        let bound = |w: usize| (between + within) * rate.powi(w as i32);
        let Some(length) = (2..=LONGEST.min(shortest)).find(|&w| bound(w) <= NOTHING) else {
            return findings;
        };
        let runs = self.equal_runs(length);
        let found = runs.between + runs.within;
        let p = if found > 0 { bound(length) } else { 1.0 };
        let detail = format!("runs of {length} points that come up again: {found}{}", runs.example());
        findings.push(chance(p, detail).part("repeated runs"));
        findings
    }

    /// Pairs of equal runs of `length` points, those of one stream only where they don't overlap.
    fn equal_runs(&self, length: usize) -> Runs {
        let mut keys = Vec::new();
        for (stream, points) in self.streams.iter().enumerate() {
            keys.extend(points.windows(length).enumerate().map(|(index, run)| {
                let mut hasher = DefaultHasher::new();
                run.iter().for_each(|p| {
                    (p.patch, p.at[0].to_bits(), p.at[1].to_bits()).hash(&mut hasher);
                });
                (hasher.finish(), stream, index)
            }));
        }
        keys.sort_unstable();
        let mut runs = Runs::default();
        for equal in keys.chunk_by(|a, b| a.0 == b.0).filter(|equal| equal.len() > 1) {
            let pairs = |n: u64| n * (n - 1) / 2;
            let mut within = 0;
            for of_one in equal.chunk_by(|a, b| a.1 == b.1) {
                within += pairs(of_one.len() as u64);
                let (first, last) = (of_one[0], of_one[of_one.len() - 1]);
                if length == 1 {
                    continue;
                } else if last.2 - first.2 >= length {
                    runs.within += 1;
                    runs.first.get_or_insert(((first.1, first.2), (last.1, last.2)));
                }
            }
            if length == 1 {
                runs.within += within;
            }
            let between = pairs(equal.len() as u64) - within;
            runs.between += between;
            if between > 0 {
                let other = equal.iter().find(|key| key.1 != equal[0].1).unwrap_or(&equal[0]);
                runs.first.get_or_insert(((equal[0].1, equal[0].2), (other.1, other.2)));
            }
        }
        runs
    }
}

/// The class of each group of cells, and how many there are: groups so light that a table of `n` points expects hardly any in their corner share one.
fn join_light(of_leaf: &[Option<usize>], leaves: &[f64], groups: usize, n: usize) -> (Vec<usize>, usize) {
    let mut masses = vec![0.0; groups];
    for (group, mass) in of_leaf.iter().zip(leaves) {
        group.iter().for_each(|&group| masses[group] += mass);
    }
    let is_light = |mass: f64| mass * mass * (n as f64) < LEAST / 4.0;
    let light: f64 = masses.iter().filter(|&&m| is_light(m)).sum();
    // What is too light even together goes to the first class.
    let mut classes = usize::from(!is_light(light));
    let class = |&mass: &f64| {
        if is_light(mass) {
            return 0;
        }
        classes += 1;
        classes - 1
    };
    (masses.iter().map(class).collect(), classes)
}

/// Pearson's test of independence of rows and columns; `None` with fewer than two of either.
fn table(part: String, counts: &[u64], classes: usize) -> Option<Finding> {
    let figure = chi_square::independence(counts, classes).ok()?;
    let detail =
        format!("X^2 = {:.1} at {} degrees of freedom, {classes} classes", figure.statistic, figure.df);
    Some(chance(figure.p, detail).part(part))
}

/// How often runs are equal, and where they are first, as (stream, index).
#[derive(Default)]
struct Runs {
    between: u64,
    within: u64,
    first: Option<((usize, usize), (usize, usize))>,
}

impl Runs {
    fn example(&self) -> String {
        self.first.map_or(String::new(), |((s, i), (t, j))| {
            format!("; for one, from point {i} of stream {s} and point {j} of stream {t} on")
        })
    }
}

fn chance(p: f64, detail: String) -> Finding {
    Finding::new(CHECK, Evidence::Chance { p, conservative: p }, detail)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 200 points a class of less than a tenth is light: its square expects two of them.
    #[test]
    fn light_groups_share_a_class() {
        let join = |of_leaf: &[Option<usize>], leaves: &[f64], groups: usize| {
            join_light(of_leaf, leaves, groups, 200)
        };
        let each =
            |masses: &[f64]| join(&(0..masses.len()).map(Some).collect::<Vec<_>>(), masses, masses.len());
        assert_eq!(each(&[0.5, 0.5]), (vec![0, 1], 2));
        // Two together weigh enough for a class of their own.
        assert_eq!(each(&[0.09, 0.45, 0.09, 0.37]), (vec![0, 1, 0, 2], 3));
        assert_eq!(
            join(
                &[Some(0), Some(0), Some(1), None, Some(2), Some(3)],
                &[0.05, 0.04, 0.45, 0.2, 0.09, 0.17],
                4
            ),
            (vec![0, 1, 0, 2], 3)
        );
        // What does not goes to the first class.
        assert_eq!(each(&[0.47, 0.04, 0.45, 0.04]), (vec![0, 0, 1, 0], 2));
        assert_eq!(each(&[0.101, 0.899]), (vec![0, 1], 2));
        assert_eq!(each(&[0.099, 0.901]), (vec![0, 0], 1));
    }
}
