//! Do two samplers draw from one distribution? Asked without any density.
//!
//! Cells are cut by pilots of both. In each cell the first sampler should have its share of the samples that both have there:
//! - chi-square of homogeneity at several scales, and Williams' G beside it where counts are large ([`chi_square::two_sample`]);
//! - the node of the tree of cells whose two counts are least likely, exactly (binomial given their sum, which is conservative; times the number of
//!   nodes): an error in one piece, of whatever size;
//! - Kolmogorov-Smirnov in the order of the tree;
//! - rejected samples are a cell; entries of a discrete set are counted by the remainder of their index as well.
//!
//! Given how many samples both have in a cell, all ways to label them are equally likely if the distributions agree. So cells are joined, pooled and left out
//! by these sums without bias; only the cuts must not come from the samples that are judged.

use super::examination::{Against, Examination};
use super::expectation::{LEAST, MODULI};
use super::finding::{Evidence, Finding, Verdict};
use super::map::{self, CellFigure};
use super::points::{Samples, same};
use super::probe::{Fate, Probe, each_pilot};
use super::report::Report;
use super::setters::setters;
use super::settings::{Drawn, Settings};
use super::tally::SHARD;
use crate::domain::{Cell, Domain, Knots, Location, Partition, Space};
use crate::random::{fill_unit, stream};
use crate::sampler::{Sampler, fill_vec};
use crate::statistics::{binomial, chi_square, kolmogorov};
use std::time::Instant;

const CHECK: &str = "two-sample";
/// Pilots of each sampler, at least and at most; as a share of the samples that are judged between.
const PILOTS: [u64; 2] = [1 << 12, 1 << 17];
const PILOTS_SHARE: u64 = 64;
const PILOTS_PER_LEAF: usize = 8;
/// Of points that were given, one in so many is a pilot.
const PILOT_STRIDE: usize = 8;
/// Numbers of cells that the scales aim at.
const SCALES: [usize; 5] = [16, 128, 1024, 8192, 65536];
/// Below this many samples a cell a finer scale is not worth a test of its own.
const WORTH: f64 = 100.0;
/// Expected counts at which G joins in.
const PLENTY: f64 = 100.0;
/// Entries of a discrete set from which on remainders are counted.
const MANY: usize = 1024;
/// Two samples that agree better than this are no two samples.
const TOO_ALIKE: f64 = 1e-9;
/// Up to this size of the smaller sample, the distance of two distribution functions is referred to the exact distribution.
const EXACT_KS: u64 = 2_000;
const CHUNK: usize = 512;

/// Where one set of variates leads.
enum Place {
    Rejected,
    Outside,
    At(Location),
}

/// A sampler, as far as it draws.
trait Source: Sync {
    fn space(&self) -> &dyn Space;
    fn space_for_keeps(&self) -> Box<dyn Space>;
    fn dimensions(&self) -> usize;
    fn knots(&self) -> Knots;
    fn places(&self, xi: &[f64], out: &mut Vec<Place>);
    /// What is wrong with the sample of `xi`, for people.
    fn complaint(&self, xi: &[f64]) -> String;
}

struct Drawing<'a, D: Domain> {
    sampler: &'a dyn Sampler<Domain = D>,
    domain: D,
}

impl<D: Domain> Source for Drawing<'_, D> {
    fn space(&self) -> &dyn Space {
        &self.domain
    }

    fn space_for_keeps(&self) -> Box<dyn Space> {
        Box::new(self.domain.clone())
    }

    fn dimensions(&self) -> usize {
        self.sampler.dimensions()
    }

    fn knots(&self) -> Knots {
        self.sampler.knots()
    }

    fn places(&self, xi: &[f64], out: &mut Vec<Place>) {
        let mut samples = Vec::new();
        fill_vec(self.sampler, xi, &mut samples);
        out.clear();
        out.extend(samples.into_iter().map(|sample| match sample {
            None => Place::Rejected,
            Some(sample) => self.domain.locate(&sample.point).map_or(Place::Outside, Place::At),
        }));
    }

    fn complaint(&self, xi: &[f64]) -> String {
        let point = self.sampler.sample(xi).map(|s| s.point);
        let why = point.as_ref().and_then(|p| self.domain.locate(p).err());
        point.zip(why).map_or_else(String::new, |(point, why)| {
            format!("xi = {xi:?} gives {}, which {why}", self.domain.in_words(&point))
        })
    }
}

/// Begins to compare two samplers of the same domain: do they draw from one distribution? Only their `sample` is asked, never a density.
///
/// ```
/// use warpcheck::sampler::{BarycentricWarp, TriangleWarp};
/// let heitz = BarycentricWarp::new(TriangleWarp::LowDistortion, 1.0)?;
/// let square_root = BarycentricWarp::new(TriangleWarp::SquareRoot, 1.0)?;
/// warpcheck::verify::compare(&heitz, &square_root).names("Heitz", "square root").samples(50_000).run().assert();
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
pub fn compare<'a, A, B>(first: &'a A, second: &'a B) -> Compare<'a>
where
    A: Sampler,
    B: Sampler<Domain = A::Domain>,
{
    Compare {
        sources: [
            Box::new(Drawing { domain: first.domain(), sampler: first }),
            Box::new(Drawing { domain: second.domain(), sampler: second }),
        ],
        names: ["the first".to_owned(), "the second".to_owned()],
        settings: Settings::default(),
    }
}

/// Begins to compare two sets of points, drawn by whatever: are they of one distribution? The points must be independent; correlated ones (blue
/// noise, stratified, a Markov chain) fail or pass for that reason alone.
///
/// Every eighth point of both, from the first on, is a pilot: it only says where cells are cut, and is not judged.
///
/// ```
/// use warpcheck::domain::Square;
/// use warpcheck::random::{stream, unit_f64};
/// use warpcheck::verify::{Samples, compare_samples};
///
/// let mut points = |purpose| {
///     let mut rng = stream(1, purpose, 0);
///     Samples::new(Square, (0..10_000).map(|_| [unit_f64(&mut rng), unit_f64(&mut rng)]).collect::<Vec<_>>())
/// };
/// compare_samples(&points("a")?, &points("b")?).run().assert();
/// # Ok::<(), warpcheck::verify::PointsError>(())
/// ```
pub fn compare_samples<'a, D: Domain>(first: &'a Samples<D>, second: &'a Samples<D>) -> CompareSamples<'a> {
    CompareSamples {
        spaces: [&first.domain, &second.domain],
        space: Box::new(first.domain.clone()),
        points: [&first.locations, &second.locations],
        rejected: [first.rejected, second.rejected],
        names: ["the first".to_owned(), "the second".to_owned()],
        settings: Settings::default(),
    }
}

/// A comparison of two samplers that is being set up; see [`compare`].
pub struct Compare<'a> {
    sources: [Box<dyn Source + 'a>; 2],
    names: [String; 2],
    settings: Settings,
}

/// A comparison of two sets of points that is being set up; see [`compare_samples`].
pub struct CompareSamples<'a> {
    spaces: [&'a dyn Space; 2],
    space: Box<dyn Space>,
    points: [&'a [Location]; 2],
    rejected: [u64; 2],
    names: [String; 2],
    settings: Settings,
}

macro_rules! common_setters {
    () => {
        /// What the report calls the two.
        pub fn names(mut self, first: impl Into<String>, second: impl Into<String>) -> Self {
            self.names = [first.into(), second.into()];
            self
        }

        setters! {
            alpha: "The probability that two of one distribution fail, at most; 1e-3 unless told.";
            run: "Makes the tests and judges them.";
        }
    };
}

impl Compare<'_> {
    setters! {
        samples: "How many samples to draw from each; 1e6 unless told.";
        seed: "The seed; 1 unless told. The two samplers never share a variate, whatever the seed.";
    }

    common_setters!();

    /// Makes the tests without judging them, so that several comparisons can be judged in one [`Report`].
    pub fn examine(self) -> Examination {
        let start = Instant::now();
        let [first, second] = &self.sources;
        let name = format!("{} against {}", self.names[0], self.names[1]);
        let n = self.settings.samples;
        if !same(first.space(), second.space()) {
            return differing(name, first.space(), second.space(), Against::Sampler(n));
        }
        let knots = first.knots().merged(&second.knots());
        let pilots = (n / PILOTS_SHARE).clamp(PILOTS[0], PILOTS[1]);
        let pilots = [0, 1].map(|side| pilot_places(&*self.sources[side], self.settings.seed, side, pilots));
        let cells = cut(first.space(), pilots.concat(), &knots);
        let sides = [0, 1].map(|side| draw(&*self.sources[side], &cells, &self.settings, side));
        let case = Comparison { space: first.space(), partition: &cells, sides: &sides, names: &self.names };
        let mut examination = case.examine(name, Against::Sampler(n), first.space_for_keeps());
        examination.time = start.elapsed();
        examination
    }
}

impl CompareSamples<'_> {
    common_setters!();

    /// Makes the tests without judging them, so that several comparisons can be judged in one [`Report`].
    pub fn examine(self) -> Examination {
        let start = Instant::now();
        let name = format!("{} against {}", self.names[0], self.names[1]);
        let space = self.spaces[0];
        let against = Against::Points(self.points[1].len() as u64);
        if !same(self.spaces[0], self.spaces[1]) {
            return differing(name, self.spaces[0], self.spaces[1], against);
        }
        // One stride for both, so that points and rejected variates keep their proportion alike.
        let longest = self.points[0].len().max(self.points[1].len());
        let stride = PILOT_STRIDE.max(longest / PILOTS[1] as usize);
        let pilots = self.points.map(|points| points.iter().step_by(stride).copied().collect::<Vec<_>>());
        let cells = cut(space, pilots.concat(), &Knots::default());
        let sides = [0, 1].map(|side| {
            let mut counts = Side::empty(&cells);
            let judged = self.points[side].iter().enumerate().filter(|(i, _)| i % stride != 0);
            judged.for_each(|(_, location)| counts.add(&cells, location));
            counts.rejected = self.rejected[side];
            counts
        });
        let case = Comparison { space, partition: &cells, sides: &sides, names: &self.names };
        let mut examination = case.examine(name, against, self.space);
        examination.time = start.elapsed();
        examination
    }
}

/// Recordings as [`compare_samples`] would judge their points, read as they come.
pub(super) fn examine_recordings(
    recordings: [&dyn Probe; 2],
    names: [String; 2],
    settings: &Settings,
) -> Examination {
    let start = Instant::now();
    let name = format!("{} against {}", names[0], names[1]);
    let space = recordings[0].space();
    if !same(space, recordings[1].space()) {
        return differing(name, space, recordings[1].space(), Against::Points(0));
    }
    let pilots = recordings.map(|recording| super::expectation::locations(recording, 0, "pilot", 0));
    let cells = cut(space, pilots.concat(), &Knots::default());
    let sides = recordings.map(|recording| count_rows(recording, &cells, settings));
    let case = Comparison { space, partition: &cells, sides: &sides, names: &names };
    let mut examination = case.examine(name, Against::Points(0), recordings[0].space_for_keeps());
    examination.time = start.elapsed();
    examination
}

fn count_rows(recording: &dyn Probe, cells: &Partition, settings: &Settings) -> Side {
    const BATCH: u64 = 64 * SHARD;
    let (mut total, mut first) = (pilots_outside(recording, cells), 0);
    loop {
        let wanted = BATCH.min(settings.samples - first);
        let loaded = recording.load(first, wanted);
        let counted = crate::parallel::map(loaded.div_ceil(SHARD) as usize, |shard| {
            let from = first + shard as u64 * SHARD;
            let rows: Vec<f64> =
                (from..(from + SHARD).min(first + loaded)).map(|row| row as f64 + 1.0).collect();
            let (mut draws, mut values) = (Vec::new(), Vec::new());
            let mut counts = Side::empty(cells);
            recording.draw(&rows, usize::MAX, &mut draws, &mut values);
            for (draw, row) in draws.iter().zip(&rows) {
                match draw.fate {
                    Fate::Drawn => counts.add(cells, &draw.location),
                    Fate::Rejected => counts.rejected += 1,
                    Fate::Outside => counts.add_outside(recording, *row),
                }
            }
            counts
        });
        counted.into_iter().for_each(|counts| total.merge(counts));
        first += loaded;
        if let Some(progress) = &settings.progress {
            progress(Drawn { samples: first, of: settings.samples });
        }
        if loaded < wanted || first >= settings.samples || settings.stopped() {
            return total;
        }
    }
}

/// Pilots that lie outside of the domain: they are rows like all others, of whom nothing is counted.
fn pilots_outside(recording: &dyn Probe, cells: &Partition) -> Side {
    let (pilots, mut counts) = (recording.pilots().unwrap_or(0), Side::empty(cells));
    let (mut draws, mut values) = (Vec::new(), Vec::new());
    let rows = each_pilot(pilots, pilots);
    recording.draw(&rows, usize::MAX, &mut draws, &mut values);
    let outside = draws.iter().zip(&rows).filter(|(draw, _)| draw.fate == Fate::Outside);
    outside.for_each(|(_, row)| counts.add_outside(recording, *row));
    counts
}

fn differing(name: String, first: &dyn Space, second: &dyn Space, against: Against) -> Examination {
    let size = |s: &dyn Space| format!("{} of {} patches and measure {}", s.name(), s.patches(), s.measure());
    let detail = format!("the domains differ: {}, and {}", size(first), size(second));
    Examination {
        findings: vec![Finding::certain(CHECK, Verdict::Fail, detail)],
        ..Examination::bare(name, first, 0, against)
    }
}

fn cut(space: &dyn Space, pilots: Vec<Location>, knots: &Knots) -> Partition {
    let per_leaf = if space.axes() == 0 { 1 } else { PILOTS_PER_LEAF };
    Partition::from_pilots(space, pilots, knots, per_leaf)
}

fn pilot_places(source: &dyn Source, seed: u64, side: usize, count: u64) -> Vec<Location> {
    let mut rng = stream(seed, ["compare, pilots of the first", "compare, pilots of the second"][side], 0);
    let mut xi = vec![0.0; CHUNK * source.dimensions().max(1)];
    let (mut found, mut places) = (Vec::new(), Vec::new());
    for _ in 0..count.div_ceil(CHUNK as u64) {
        fill_unit(&mut rng, &mut xi);
        source.places(&xi, &mut places);
        found.extend(places.iter().filter_map(|place| match place {
            Place::At(location) => Some(*location),
            _ => None,
        }));
    }
    found
}

/// What one of the two counted.
#[derive(Clone, Debug)]
struct Side {
    per_leaf: Vec<u64>,
    rejected: u64,
    outside: u64,
    first_outside: Option<String>,
    remainders: [Vec<u64>; 2],
}

impl Side {
    fn empty(partition: &Partition) -> Self {
        Self {
            per_leaf: vec![0; partition.leaves().len()],
            rejected: 0,
            outside: 0,
            first_outside: None,
            remainders: MODULI.map(|m| vec![0; m]),
        }
    }

    #[inline]
    fn add(&mut self, partition: &Partition, location: &Location) {
        self.per_leaf[partition.leaf_of(location)] += 1;
        self.remainders.iter_mut().zip(MODULI).for_each(|(counts, m)| counts[location.patch % m] += 1);
    }

    fn add_outside(&mut self, recording: &dyn Probe, row: f64) {
        self.outside += 1;
        self.first_outside.get_or_insert_with(|| {
            let look = recording.look(&[row]).and_then(|l| l.location.err().map(|why| (l.point, why)));
            look.map_or_else(String::new, |(point, why)| {
                format!("{}: {point} {why}", recording.called(&[row]))
            })
        });
    }

    fn merge(&mut self, other: Self) {
        fn add(mine: &mut [u64], theirs: &[u64]) {
            mine.iter_mut().zip(theirs).for_each(|(a, b)| *a += b);
        }
        add(&mut self.per_leaf, &other.per_leaf);
        self.remainders.iter_mut().zip(&other.remainders).for_each(|(a, b)| add(a, b));
        self.rejected += other.rejected;
        self.outside += other.outside;
        self.first_outside = self.first_outside.take().or(other.first_outside);
    }

    /// All that have a column of their own in the tables.
    fn total(&self) -> u64 {
        self.per_leaf.iter().sum::<u64>() + self.rejected
    }
}

fn draw(source: &dyn Source, partition: &Partition, settings: &Settings, side: usize) -> Side {
    let shards = settings.samples.div_ceil(SHARD);
    let purpose = ["compare, the first", "compare, the second"][side];
    let dimensions = source.dimensions().max(1);
    let counted = crate::parallel::map(shards as usize, |shard| {
        let mut rng = stream(settings.seed, purpose, shard as u64);
        let mut left = SHARD.min(settings.samples - shard as u64 * SHARD) as usize;
        let (mut xi, mut places) = (vec![0.0; CHUNK * dimensions], Vec::with_capacity(CHUNK));
        let mut counts = Side::empty(partition);
        while left > 0 {
            let xi = &mut xi[..left.min(CHUNK) * dimensions];
            fill_unit(&mut rng, xi);
            source.places(xi, &mut places);
            for (place, xi) in places.iter().zip(xi.chunks_exact(dimensions)) {
                match place {
                    Place::At(location) => counts.add(partition, location),
                    Place::Rejected => counts.rejected += 1,
                    Place::Outside => {
                        counts.outside += 1;
                        counts.first_outside.get_or_insert_with(|| source.complaint(xi));
                    }
                }
            }
            left -= places.len();
        }
        counts
    });
    let mut total = Side::empty(partition);
    counted.into_iter().for_each(|counts| total.merge(counts));
    total
}

/// Two counts of one cell.
type Pair = (u64, u64);

struct Comparison<'a> {
    space: &'a dyn Space,
    partition: &'a Partition,
    sides: &'a [Side; 2],
    names: &'a [String; 2],
}

/// The cells of one scale.
struct Scale {
    of_leaf: Vec<Option<usize>>,
    cells: Vec<Cell>,
    counts: Vec<Pair>,
    pool: Pair,
}

impl Comparison<'_> {
    fn totals(&self) -> Pair {
        (self.sides[0].total(), self.sides[1].total())
    }

    /// What a cell must hold of both, so that either expects [`LEAST`].
    fn enough(&self) -> f64 {
        let (a, b) = self.totals();
        LEAST * (a + b) as f64 / a.min(b).max(1) as f64
    }

    fn rejected(&self) -> Pair {
        (self.sides[0].rejected, self.sides[1].rejected)
    }

    fn leaf(&self, leaf: usize) -> Pair {
        (self.sides[0].per_leaf[leaf], self.sides[1].per_leaf[leaf])
    }

    fn scales(&self) -> Vec<Scale> {
        let (a, b) = self.totals();
        let n = (a + b) as f64;
        let both = |(a, b): Pair| (a + b) as f64 / n;
        let masses: Vec<f64> = (0..self.partition.leaves().len()).map(|leaf| both(self.leaf(leaf))).collect();
        let mut scales: Vec<Scale> = Vec::new();
        for cells in SCALES.into_iter().filter(|&c| c <= 1024 || a.min(b) as f64 >= WORTH * c as f64) {
            let groups = self.partition.group(&masses, 1.0 / cells as f64, self.enough() / n);
            if scales.last().is_some_and(|last| last.cells.len() == groups.cells.len()) {
                continue;
            }
            let (mut counts, mut pool) = (vec![(0, 0); groups.cells.len()], (0, 0));
            for (leaf, group) in groups.of_leaf.iter().enumerate() {
                let (count, more) = (group.map_or(&mut pool, |g| &mut counts[g]), self.leaf(leaf));
                *count = (count.0 + more.0, count.1 + more.1);
            }
            scales.push(Scale { of_leaf: groups.of_leaf, cells: groups.cells, counts, pool });
        }
        scales
    }

    fn examine(&self, name: String, against: Against, keep: Box<dyn Space>) -> Examination {
        let (a, b) = self.totals();
        let against = match against {
            Against::Sampler(_) => Against::Sampler(b),
            _ => Against::Points(b),
        };
        let mut examination = Examination::bare(name, self.space, a, against);
        examination.rejected = self.sides[0].rejected;
        let mut findings = self.outside();
        if a == 0 || b == 0 {
            let none = &self.names[usize::from(a > 0)];
            let detail = format!("{none} has no samples to judge");
            findings.push(Finding::certain(CHECK, Verdict::Inconclusive, detail));
            examination.findings = findings;
            return examination;
        }
        let scales = self.scales();
        findings.extend(self.findings(&scales));
        examination.findings = findings;
        examination.scales = scales.iter().map(|scale| scale.cells.len()).collect();
        if let Some(finest) = scales.into_iter().last() {
            let figure = |cell: Cell, place: String, (x, y): Pair| CellFigure {
                cell,
                place,
                observed: x,
                expected: a as f64 * ((x + y) as f64 / (a + b) as f64),
                samples: a,
                others: b,
            };
            let nowhere = || Cell { patches: 0..0, low: [0.0; 2], high: [0.0; 2] };
            examination.elsewhere = vec![
                figure(nowhere(), "rejected".to_owned(), self.rejected()),
                figure(nowhere(), "the pool of light cells".to_owned(), finest.pool),
            ];
            examination.elsewhere.retain(|figure| figure.expected > 0.0);
            let cells = finest.cells.into_iter().zip(finest.counts);
            examination.cells =
                cells.map(|(cell, pair)| figure(cell.clone(), self.space.describe(&cell), pair)).collect();
            let figures = examination.cells.clone();
            examination.painter = map::painter(keep, self.partition.clone(), figures, finest.of_leaf);
        }
        examination
    }

    fn outside(&self) -> Vec<Finding> {
        let complain = |(side, name): (&Side, &String)| {
            let first = side.first_outside.as_ref()?;
            let detail =
                format!("{} samples of {name} lie outside of the domain; the first: {first}", side.outside);
            Some(Finding::certain("support", Verdict::Fail, detail))
        };
        self.sides.iter().zip(self.names).filter_map(complain).collect()
    }

    fn findings(&self, scales: &[Scale]) -> Vec<Finding> {
        let enough = self.enough();
        let is_cell = |pair: Pair| (pair.0 + pair.1) as f64 >= enough;
        let (mut findings, mut separately) = (Vec::new(), Vec::new());
        let rejected = self.rejected();
        if !is_cell(rejected) {
            separately.push(("rejected", rejected));
        }
        let mut alike: Option<(f64, f64)> = None;
        for scale in scales {
            let mut counts = scale.counts.clone();
            for (what, pair) in [("rejected", rejected), ("pool of light cells", scale.pool)] {
                if is_cell(pair) {
                    counts.push(pair);
                } else if what != "rejected" {
                    separately.push((what, pair));
                }
            }
            if counts.len() < 2 {
                continue;
            }
            if let Some((finding, below)) = self.homogeneity(&counts) {
                findings.push(finding);
                alike = Some((below, counts.len() as f64));
            }
            findings.extend(self.likelihood_ratio(&counts));
        }
        if findings.is_empty() {
            findings.push(self.nothing_to_compare());
        }
        if let Some((below, cells)) = alike.filter(|(below, _)| *below < TOO_ALIKE) {
            let detail = format!(
                "the counts of {cells} cells agree better than chance allows (p {} of agreeing so well): the two are not drawn independently, so nothing can be said",
                super::p_value(below)
            );
            findings.push(Finding::certain(CHECK, Verdict::Inconclusive, detail).part("independence"));
        }
        findings.extend(self.least_likely_node());
        findings.extend(self.kolmogorov());
        findings.extend(self.remainders());
        separately.retain(|(_, (a, b))| a + b > 0);
        separately.dedup();
        findings.extend(separately.into_iter().map(|(what, pair)| {
            let detail = format!("{} and {} samples (exact binomial, given their sum)", pair.0, pair.1);
            chance(self.exact(pair), detail).part(what)
        }));
        findings
    }

    fn nothing_to_compare(&self) -> Finding {
        let (a, b) = self.totals();
        if self.space.axes() == 0 && self.space.patches() == 1 {
            return Finding::certain(CHECK, Verdict::Pass, "there is only one entry to choose");
        }
        let detail = if self.rejected() == (a, b) {
            "both reject every sample: there is nothing to compare".to_owned()
        } else {
            format!("{a} and {b} samples are too few: no two cells expect {LEAST} of each")
        };
        Finding::certain(CHECK, Verdict::Inconclusive, detail)
    }

    /// The chi-square test, and the probability of a statistic as small.
    fn homogeneity(&self, counts: &[Pair]) -> Option<(Finding, f64)> {
        let (first, second): (Vec<u64>, Vec<u64>) = counts.iter().copied().unzip();
        let figure = chi_square::two_sample(&first, &second).ok()?;
        let detail = format!("X^2 = {:.1} at {} degrees of freedom", figure.statistic, figure.df);
        let below = chi_square::cdf(figure.statistic, figure.df).unwrap_or(1.0);
        Some((chance(figure.p, detail).part(format!("{} cells", counts.len())), below))
    }

    /// G with Williams' correction.
    fn likelihood_ratio(&self, counts: &[Pair]) -> Option<Finding> {
        if counts.iter().any(|&(a, b)| ((a + b) as f64) < self.enough() * PLENTY / LEAST) {
            return None;
        }
        let (first, second): (Vec<u64>, Vec<u64>) = counts.iter().copied().unzip();
        let figure = chi_square::two_sample_g(&first, &second).ok()?;
        let detail = format!("G = {:.1} at {} degrees of freedom", figure.statistic, figure.df);
        Some(chance(figure.p, detail).part(format!("{} cells, G", counts.len())))
    }

    /// The exact two-sided test of two counts, given their sum. The counts of a cell given all margins are hypergeometric, which has a smaller variance.
    fn exact(&self, (a, b): Pair) -> f64 {
        let (n, m) = self.totals();
        binomial::two_sided(a, a + b, n as f64 / (n + m) as f64).unwrap_or(f64::NAN)
    }

    fn least_likely_node(&self) -> Option<Finding> {
        let (n, m) = self.totals();
        let share = n as f64 / (n + m) as f64;
        let leaves = self.partition.leaves().len();
        // Counts of all leaves before each.
        let mut before = vec![(0_u64, 0_u64); leaves + 1];
        for leaf in 0..leaves {
            let (a, b) = self.leaf(leaf);
            before[leaf + 1] = (before[leaf].0 + a, before[leaf].1 + b);
        }
        let deviance = |observed: f64, expected: f64| {
            if observed > 0.0 { observed * (observed / expected).ln() } else { 0.0 }
        };
        let (mut nodes, mut worst) = (0_u64, None::<(f64, Pair, &Cell)>);
        for (cell, below) in self.partition.nodes() {
            let (start, end) = (before[below.start], before[below.end]);
            let (a, b) = (end.0 - start.0, end.1 - start.1);
            if a + b == 0 {
                continue;
            }
            nodes += 1;
            let sum = (a + b) as f64;
            let surprise = deviance(a as f64, sum * share) + deviance(b as f64, sum * (1.0 - share));
            if worst.as_ref().is_none_or(|w| surprise > w.0) {
                worst = Some((surprise, (a, b), cell));
            }
        }
        let (_, pair, cell) = worst.filter(|_| nodes > 1)?;
        let p = (self.exact(pair) * nodes as f64).min(1.0);
        let place = self.space.describe(cell);
        let detail = format!(
            "{} and {} samples (exact binomial, given their sum), at {place}; the worst of {nodes} nodes",
            pair.0, pair.1
        );
        Some(chance(p, detail).part("least likely node"))
    }

    /// In the order of the tree, rejected samples last.
    fn kolmogorov(&self) -> Option<Finding> {
        let leaves = self.partition.leaves().len();
        if leaves < 2 || (self.space.axes() == 0 && leaves <= 16) {
            return None;
        }
        let (n, m) = self.totals();
        let (mut a, mut b, mut largest) = (0, 0, 0.0_f64);
        for leaf in 0..leaves {
            let more = self.leaf(leaf);
            (a, b) = (a + more.0, b + more.1);
            largest = largest.max((a as f64 / n as f64 - b as f64 / m as f64).abs());
        }
        let p = if n.min(m) <= EXACT_KS && n.max(m) <= 4 * EXACT_KS {
            kolmogorov::two_sample_sf(largest, n, m)
        } else {
            kolmogorov::sf(largest, (n as f64 * (m as f64 / (n + m) as f64)).round() as u64)
        };
        let detail = format!("D = {largest:.2e} in the order of {leaves} cells");
        Some(chance(p.unwrap_or(f64::NAN), detail).part("KS"))
    }

    fn remainders(&self) -> Vec<Finding> {
        if self.space.axes() > 0 || self.space.patches() < MANY {
            return Vec::new();
        }
        let tables = MODULI.into_iter().zip(self.sides[0].remainders.iter().zip(&self.sides[1].remainders));
        tables
            .filter_map(|(modulus, (first, second))| {
                let pairs: Vec<Pair> = first.iter().copied().zip(second.iter().copied()).collect();
                let large = pairs.iter().all(|&(a, b)| a + b == 0 || (a + b) as f64 >= self.enough());
                let figure = large.then(|| chi_square::two_sample(first, second).ok()).flatten()?;
                let detail = format!("X^2 = {:.1} at {} degrees of freedom", figure.statistic, figure.df);
                Some(chance(figure.p, detail).part(format!("index modulo {modulus}")))
            })
            .collect()
    }
}

fn chance(p: f64, detail: String) -> Finding {
    Finding::new(CHECK, Evidence::Chance { p, conservative: p }, detail)
}
