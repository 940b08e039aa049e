//! Draws the samples and counts them: per cell, per pair of consecutive cells, rejected, outside of the domain, without density.
//!
//! Samples are drawn in shards of fixed size, each from its own stream, and merged in order: the same seed gives the same counts on any
//! number of threads.

use super::expectation::{Expectation, FLAT, LeafNote, MODULI, Quick, Resolved, UNKNOWN};
use super::probe::{Draw, Fate, Probe, each_pilot, is_asked};
use super::settings::{Drawn, Settings};
use crate::random::{fill_unit, stream};
use crate::statistics::Moments;
use std::time::Instant;

pub(super) const SHARD: u64 = 1 << 14;
/// Shards between two looks at the clock; also what bounds the memory. Of what is read, fewer: it should still be in the cache when it is judged.
const BATCH: u64 = 64;
const BATCH_OF_ROWS: u64 = 32;
/// Shards that share a tally once there are finer cells than samples in a shard: to empty and to merge a tally costs as much as many samples.
const SHARED: u64 = 8;
const SHARED_ROWS: u64 = 4;
/// Samples that are drawn in one go, few enough that all that is known of them stays in the nearest cache; of who pays for every question, more.
const CHUNK: usize = 128;
const SLOW_CHUNK: usize = 512;
/// Of those that are hardly asked, more: the few of them that are looked at closely wait for the end of their shard.
const QUICK_CHUNK: usize = 512;
/// In this many first shards the density is asked again at every sample's point, later at each one in [`ASKED_RARELY`].
const ASKED_ALWAYS: u64 = 4;
/// A power of two: to divide by a number that isn't known costs as much as to count.
const ASKED_RARELY: usize = 16;
/// The same of samples whose square is enough to count them.
const HARDLY_ASKED: usize = 64;
/// Rounding may move a sample on the border of the support this far beyond it.
const BORDER: f64 = 1e-6;
/// Classes of the left-over variate.
pub(super) const CLASSES: usize = 16;

/// A sample with something wrong with it.
#[derive(Clone, Debug)]
pub(super) struct Offence {
    /// Which sample, for people: "xi = [0.5, 0.25]".
    pub sample: String,
    pub what: String,
}

/// How many samples had one kind of fault, and the first of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Offences {
    pub count: u64,
    pub first: Option<Offence>,
}

impl Offences {
    fn add(&mut self, probe: &dyn Probe, xi: &[f64], what: impl FnOnce() -> String) {
        self.count += 1;
        self.first.get_or_insert_with(|| Offence { sample: probe.called(xi), what: what() });
    }

    fn merge(&mut self, other: Self) {
        self.count += other.count;
        if self.first.is_none() {
            self.first = other.first;
        }
    }
}

/// The worst disagreement between the density returned and the density asked.
#[derive(Clone, Debug, Default)]
pub(super) struct Disagreement {
    pub asked: u64,
    pub wrong: u64,
    /// Relative difference beyond what rounding of the point explains, of the worst sample.
    pub worst: f64,
    pub example: Option<Offence>,
}

impl Disagreement {
    fn merge(&mut self, other: Self) {
        self.asked += other.asked;
        self.wrong += other.wrong;
        if other.worst > self.worst {
            (self.worst, self.example) = (other.worst, other.example);
        }
    }
}

/// Sums of 1 / density over the samples of one cell, or of the [scale](Resolved::scale) of its place over the density.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Inverse {
    pub count: u64,
    /// Of the first, second and third power.
    pub powers: [f64; 3],
    pub largest: f64,
}

impl Inverse {
    #[inline]
    fn add(&mut self, weight: f64) {
        let square = weight * weight;
        self.count += 1;
        self.powers[0] += weight;
        self.powers[1] += square;
        self.powers[2] += square * weight;
        self.largest = self.largest.max(weight);
    }

    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.powers.iter_mut().zip(other.powers).for_each(|(a, b)| *a += b);
        self.largest = self.largest.max(other.largest);
    }
}

/// How samples fill what is [resolved](Resolved) of a leaf.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Filled {
    /// Sums of the weights in its squares, none more than [`FLAT`].
    pub sums: [f64; Resolved::SQUARES],
    /// Sum of the squared weights.
    pub squared: f64,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    pub samples: u64,
    /// How many of them were weighed by 1 / density, if they were drawn.
    pub weighed: u64,
    pub per_leaf: Vec<u64>,
    /// For each cell of both coarse scales.
    pub inverse: Vec<Inverse>,
    /// Of each leaf; empty where densities can be asked.
    pub filled: Vec<Filled>,
    /// For each axis with lines across it, samples between two lines.
    pub between_lines: Vec<Vec<u64>>,
    /// Samples by the remainder of their index, for each of [`MODULI`], where that is asked.
    pub remainders: [Vec<u64>; 2],
    /// For each class of a sample, the class of the next one: the cells of the coarsest scale, and all else.
    pub pairs: Vec<u64>,
    /// For each such class, the class of the variate that was left over.
    pub left_over: Vec<u64>,
    pub left_over_outside: Offences,
    /// Of f / density, for every function with a known integral.
    pub known: Vec<Moments>,
    pub rejected: u64,
    pub outside: Offences,
    /// Density 0 although no neighbour has any.
    pub unsupported: Offences,
    /// Density NaN, infinite or negative.
    pub invalid: Offences,
    /// Density 0, but a neighbour a rounding away has some.
    pub on_border: u64,
    pub disagreement: Disagreement,
    /// What single pilots show of themselves, where they are rows like all others; they are counted in no cell.
    pub pilots: Option<Box<Self>>,
}

impl Tally {
    fn empty(probe: &dyn Probe, expectation: &Expectation) -> Self {
        let leaves = expectation.partition.leaves().len();
        let classes = classes(expectation);
        Self {
            per_leaf: vec![0; leaves],
            inverse: vec![Inverse::default(); expectation.coarse.cells.len()],
            filled: vec![Filled::default(); expectation.resolved.len()],
            between_lines: expectation.marginals.iter().map(|m| vec![0; m.lines.len() + 1]).collect(),
            remainders: MODULI.map(|m| vec![0; m]),
            pairs: vec![0; classes * classes],
            left_over: vec![0; classes * CLASSES],
            known: vec![Moments::default(); probe.known().len()],
            ..Self::default()
        }
    }

    fn merge(&mut self, other: Self) {
        fn add(mine: &mut [u64], theirs: &[u64]) {
            mine.iter_mut().zip(theirs).for_each(|(a, b)| *a += b);
        }
        self.samples += other.samples;
        self.weighed += other.weighed;
        add(&mut self.per_leaf, &other.per_leaf);
        self.inverse.iter_mut().zip(&other.inverse).for_each(|(a, b)| a.merge(b));
        for (mine, theirs) in self.filled.iter_mut().zip(&other.filled) {
            mine.sums.iter_mut().zip(theirs.sums).for_each(|(a, b)| *a += b);
            mine.squared += theirs.squared;
        }
        self.between_lines.iter_mut().zip(&other.between_lines).for_each(|(a, b)| add(a, b));
        self.remainders.iter_mut().zip(&other.remainders).for_each(|(a, b)| add(a, b));
        add(&mut self.pairs, &other.pairs);
        add(&mut self.left_over, &other.left_over);
        self.left_over_outside.merge(other.left_over_outside);
        self.known.iter_mut().zip(&other.known).for_each(|(a, b)| a.merge(b));
        self.rejected += other.rejected;
        self.outside.merge(other.outside);
        self.unsupported.merge(other.unsupported);
        self.invalid.merge(other.invalid);
        self.on_border += other.on_border;
        self.disagreement.merge(other.disagreement);
    }

    /// The counts of cells and of rejected samples alone.
    pub fn counts(&self) -> Self {
        Self {
            samples: self.samples,
            per_leaf: self.per_leaf.clone(),
            rejected: self.rejected,
            ..Self::default()
        }
    }

    /// What single samples show of themselves, those that are counted and pilots that are rows like them, which come first.
    pub fn with_pilots(&self) -> Singles {
        let mut all = Singles::default();
        for tally in self.pilots.iter().map(Box::as_ref).chain([self]) {
            all.samples += tally.samples;
            all.rejected += tally.rejected;
            all.on_border += tally.on_border;
            all.outside.merge(tally.outside.clone());
            all.unsupported.merge(tally.unsupported.clone());
            all.invalid.merge(tally.invalid.clone());
            all.disagreement.merge(tally.disagreement.clone());
        }
        all
    }

    /// Whether something was seen that no right sampler does.
    pub fn offends(&self) -> bool {
        let offences = [&self.outside, &self.unsupported, &self.invalid, &self.left_over_outside];
        offences.iter().any(|o| o.count > 0)
            || self.disagreement.wrong > 0
            || self.pilots.as_ref().is_some_and(|pilots| pilots.offends())
    }
}

/// What samples show of themselves, each alone: what is certain, whatever the others are.
#[derive(Clone, Debug, Default)]
pub(super) struct Singles {
    pub samples: u64,
    pub rejected: u64,
    pub outside: Offences,
    pub unsupported: Offences,
    pub invalid: Offences,
    pub on_border: u64,
    pub disagreement: Disagreement,
}

/// Classes that consecutive samples are tallied in: the cells of the coarsest scale and one for the rest.
pub(super) fn classes(expectation: &Expectation) -> usize {
    1 + expectation.scales.first().map_or(0, |scale| scale.cells.len())
}

/// How many samples are drawn until so many are weighed.
pub(super) fn drawn_until(weighed: f64, expectation: &Expectation) -> f64 {
    let first = (ASKED_ALWAYS * SHARD) as f64;
    let rest = if expectation.quick.is_some() { HARDLY_ASKED as f64 } else { 1.0 };
    weighed.min(first) + rest * (weighed - first).max(0.0)
}

/// Draws `settings.samples` samples, or fewer if stopped, if the time is up, or if `enough` says so of what was drawn so far. `enough` is asked
/// after every shard, in order; beyond the first batch after every few.
pub(super) fn draw(
    probe: &dyn Probe,
    expectation: &Expectation,
    settings: &Settings,
    enough: &mut dyn FnMut(&Tally) -> bool,
) -> Tally {
    let start = Instant::now();
    let mut total = Tally::empty(probe, expectation);
    total.pilots = probe.pilots().map(|pilots| Box::new(look_at_pilots(probe, expectation, pilots)));
    let shards = settings.samples.div_ceil(SHARD);
    let mut next = 0;
    let (all, shared) = if probe.pilots().is_some() { (BATCH_OF_ROWS, SHARED_ROWS) } else { (BATCH, SHARED) };
    let time_is_up = || settings.time.is_some_and(|time| start.elapsed() >= time);
    while next < shards && !(next > 0 && (settings.stopped() || time_is_up())) {
        // With a time to keep, look at the clock more often.
        let batch = if settings.time.is_some() { BATCH / 8 } else { all }.min(shards - next);
        let wanted = (batch * SHARD).min(settings.samples - next * SHARD);
        let loaded = probe.load(next * SHARD, wanted);
        let batch = loaded.div_ceil(SHARD);
        // Who has a time to keep has few shards at a time.
        let alone = next < BATCH || probe.is_slow() || settings.time.is_some();
        let together = if alone { 1 } else { shared };
        let judge = || {
            crate::parallel::map(batch.div_ceil(together) as usize, |i| {
                let mut tally = Tally::empty(probe, expectation);
                let mut counter = Counter::new(probe, expectation);
                for shard in i as u64 * together..batch.min((i as u64 + 1) * together) {
                    let count = SHARD.min(loaded - shard * SHARD);
                    draw_shard(&mut counter, settings.seed, next + shard, count, &mut tally);
                }
                counter.settle(&mut tally);
                tally
            })
        };
        // What is read from elsewhere is read while the last that came is judged.
        let after = next + batch;
        let ahead = (all * SHARD).min(settings.samples.saturating_sub(after * SHARD));
        let (tallies, ()) = crate::parallel::join(judge, || {
            if loaded == wanted && settings.time.is_none() {
                probe.load_ahead(ahead);
            }
        });
        for tally in tallies {
            total.merge(tally);
            if enough(&total) {
                return total;
            }
        }
        next += batch;
        if let Some(progress) = &settings.progress {
            progress(Drawn { samples: total.samples, of: settings.samples });
        }
        if loaded < wanted {
            break;
        }
    }
    total
}

/// Pilots that are rows like all others: each is looked at alone, since they must not be counted in cells that were cut by them.
fn look_at_pilots(probe: &dyn Probe, expectation: &Expectation, pilots: usize) -> Tally {
    let all = each_pilot(pilots, pilots);
    let parts: Vec<&[f64]> = all.chunks(SHARD as usize).collect();
    let looked = crate::parallel::map(parts.len(), |i| {
        let (mut counter, mut tally) = (Counter::new(probe, expectation), Tally::default());
        parts[i].chunks(CHUNK).for_each(|xi| counter.look_alone(xi, &mut tally));
        tally
    });
    let mut total = Tally::default();
    looked.into_iter().for_each(|tally| total.merge(tally));
    total
}

fn draw_shard(counter: &mut Counter, seed: u64, shard: u64, count: u64, tally: &mut Tally) {
    let (probe, expectation) = (counter.probe, counter.expectation);
    let mut rng = stream(seed, "verify", shard);
    let dimensions = probe.dimensions().max(1);
    tally.samples += count;
    counter.previous = None;
    let ask = if shard < ASKED_ALWAYS { 1 } else { ASKED_RARELY };
    let quick = expectation.quick.as_ref().filter(|_| shard >= ASKED_ALWAYS && tally.known.is_empty());
    let chunk = match quick {
        Some(_) => QUICK_CHUNK,
        None if probe.is_slow() => SLOW_CHUNK,
        None => CHUNK,
    };
    let mut xi = vec![0.0; chunk * dimensions];
    let mut left = count as usize;
    let mut next_row = shard * SHARD + 1;
    while left > 0 {
        let samples = left.min(chunk);
        let xi = &mut xi[..samples * dimensions];
        match probe.pilots() {
            None => fill_unit(&mut rng, xi),
            // Rows, by their number plus 1.
            Some(_) => {
                let first = next_row as f64;
                xi.iter_mut().zip(0_i32..).for_each(|(xi, i)| *xi = first + f64::from(i));
            }
        }
        next_row += xi.len() as u64;
        match quick {
            Some(quick) => counter.quickly(quick, xi),
            None => {
                let mut classes = std::mem::take(&mut counter.classes);
                counter.closely(xi, ask, |_| true, &mut classes, tally);
                counter.follow(&classes, tally);
                counter.classes = classes;
                tally.weighed += samples as u64;
            }
        }
        left -= samples;
    }
    if quick.is_some() {
        counter.look_at_the_rest(tally);
    }
}

/// Counts samples, and keeps what it counts them with.
struct Counter<'a> {
    probe: &'a dyn Probe,
    expectation: &'a Expectation,
    by_remainder: bool,
    has_left_over: bool,
    tells_densities: bool,
    number_of_classes: usize,
    previous: Option<u16>,
    draws: Vec<Draw>,
    values: Vec<f64>,
    leaves: Vec<usize>,
    notes: Vec<LeafNote>,
    classes: Vec<u16>,
    places: [Vec<f32>; 2],
    squares: Vec<u32>,
    /// Samples of each kind of squares that are not in a tally yet.
    of_kinds: Vec<u32>,
    /// The class of each sample of a shard that is counted by squares, and which of them are to be looked at closely.
    quick_classes: Vec<u16>,
    rest: Vec<usize>,
    rest_xi: Vec<f64>,
}

impl<'a> Counter<'a> {
    fn new(probe: &'a dyn Probe, expectation: &'a Expectation) -> Self {
        let middle = vec![0.5; probe.dimensions()];
        Self {
            probe,
            expectation,
            by_remainder: !expectation.remainders.is_empty(),
            has_left_over: probe.left_over(&middle).is_some(),
            tells_densities: probe.tells_densities(),
            number_of_classes: classes(expectation),
            previous: None,
            draws: Vec::new(),
            values: Vec::new(),
            leaves: Vec::new(),
            notes: Vec::new(),
            classes: Vec::new(),
            places: [Vec::new(), Vec::new()],
            squares: Vec::new(),
            of_kinds: vec![0; expectation.quick.as_ref().map_or(0, |quick| quick.classes.len())],
            quick_classes: Vec::new(),
            rest: Vec::new(),
            rest_xi: Vec::new(),
        }
    }

    /// Adds what isn't there yet to the tally.
    fn settle(self, tally: &mut Tally) {
        if let Some(quick) = &self.expectation.quick {
            quick.settle(&self.of_kinds, &mut tally.per_leaf, &mut tally.between_lines);
        }
    }

    /// Samples of whom most need only be known by their squares: all that isn't sure and each [`HARDLY_ASKED`]-th is left to be looked at closely.
    fn quickly(&mut self, quick: &Quick, xi: &[f64]) {
        let error = self.probe.locate_roughly(xi, &mut self.places);
        quick.squares.find(&self.places, error, &mut self.squares);
        let count = self.squares.len();
        // Squares are all over the memory: a loop with nothing else in it waits for many at once.
        let mut kinds = [UNKNOWN; QUICK_CHUNK];
        kinds.iter_mut().zip(&self.squares).for_each(|(kind, square)| *kind = quick.kind(*square));
        kinds.iter_mut().step_by(HARDLY_ASKED).for_each(|kind| *kind = UNKNOWN);
        let (mut rest, mut others) = ([0; QUICK_CHUNK], 0);
        let first = self.quick_classes.len();
        self.quick_classes.resize(first + count, 0);
        for (i, (class, &kind)) in self.quick_classes[first..].iter_mut().zip(&kinds).enumerate() {
            rest[others] = i;
            others += usize::from(kind == UNKNOWN);
            *class = quick.classes[usize::from(kind)];
            self.of_kinds[usize::from(kind)] += 1;
        }
        let dimensions = xi.len() / count.max(1);
        for &i in &rest[..others] {
            self.rest.push(first + i);
            self.rest_xi.extend_from_slice(&xi[i * dimensions..][..dimensions]);
        }
    }

    /// What [`quickly`](Self::quickly) left over of a shard, and what needs all of its samples in their order.
    fn look_at_the_rest(&mut self, tally: &mut Tally) {
        let (rest, xi) = (std::mem::take(&mut self.rest), std::mem::take(&mut self.rest_xi));
        let mut all = std::mem::take(&mut self.quick_classes);
        let mut classes = std::mem::take(&mut self.classes);
        let dimensions = xi.len() / rest.len().max(1);
        for (rest, xi) in rest.chunks(CHUNK).zip(xi.chunks(CHUNK * dimensions.max(1))) {
            self.closely(xi, 1, |i| is_asked(rest[i], HARDLY_ASKED), &mut classes, tally);
            rest.iter().zip(&classes).for_each(|(&i, &class)| all[i] = class);
        }
        self.follow(&all, tally);
        tally.weighed += all.len().div_ceil(HARDLY_ASKED) as u64;
        (self.rest, self.rest_xi, self.quick_classes, self.classes) = (rest, xi, all, classes);
        self.rest.clear();
        self.rest_xi.clear();
        self.quick_classes.clear();
    }

    /// Samples one by one: where they fall, and what their densities say. Of those that are `weighed`, 1 / density is added up.
    fn closely(
        &mut self,
        xi: &[f64],
        ask: usize,
        is_weighed: impl Fn(usize) -> bool,
        classes: &mut Vec<u16>,
        tally: &mut Tally,
    ) {
        let (probe, expectation) = (self.probe, self.expectation);
        let (mut draws, mut leaves, mut notes) = (
            std::mem::take(&mut self.draws),
            std::mem::take(&mut self.leaves),
            std::mem::take(&mut self.notes),
        );
        probe.draw(xi, ask, &mut draws, &mut self.values);
        expectation.partition.leaves_of(draws.iter().map(|draw| &draw.location), &mut leaves);
        // Leaves are all over the memory: loops with nothing else in them wait for many at once.
        notes.clear();
        notes.extend(leaves.iter().map(|&leaf| expectation.coarse.note(leaf)));
        for (draw, &leaf) in draws.iter().zip(&leaves) {
            tally.per_leaf[leaf] += u64::from(draw.fate == Fate::Drawn);
        }
        for (marginal, counts) in expectation.marginals.iter().zip(&mut tally.between_lines) {
            for draw in &draws {
                counts[marginal.slab(draw.location.at[marginal.axis])] += u64::from(draw.fate == Fate::Drawn);
            }
        }
        let others = (self.number_of_classes - 1) as u16;
        classes.clear();
        classes.extend(
            draws
                .iter()
                .zip(&notes)
                .map(|(d, note)| if d.fate == Fate::Drawn { note.class() } else { others }),
        );
        let dimensions = xi.len() / draws.len().max(1);
        for (i, draw) in draws.iter().enumerate() {
            let xi = &xi[i * dimensions..][..dimensions];
            match draw.fate {
                Fate::Rejected => tally.rejected += 1,
                Fate::Outside => self.outside(xi, tally),
                Fate::Drawn => {
                    if is_weighed(i) {
                        self.weigh(draw, (leaves[i], notes[i].cell()), tally);
                    }
                    if self.by_remainder {
                        for (counts, m) in tally.remainders.iter_mut().zip(MODULI) {
                            counts[draw.location.patch % m] += 1;
                        }
                    }
                    if self.has_left_over {
                        self.left_over(usize::from(classes[i]), xi, tally);
                    }
                    self.judge(draw, xi, is_asked(i, ask), tally);
                }
            }
        }
        let functions = tally.known.len().max(1);
        for values in self.values.chunks_exact(functions) {
            tally.known.iter_mut().zip(values).for_each(|(moments, &value)| moments.add(value));
        }
        (self.draws, self.leaves, self.notes) = (draws, leaves, notes);
    }

    /// Samples one by one, by what they show of themselves.
    fn look_alone(&mut self, xi: &[f64], tally: &mut Tally) {
        let mut draws = std::mem::take(&mut self.draws);
        self.probe.draw(xi, 1, &mut draws, &mut self.values);
        tally.samples += draws.len() as u64;
        for (draw, xi) in draws.iter().zip(xi) {
            let xi = std::slice::from_ref(xi);
            match draw.fate {
                Fate::Rejected => tally.rejected += 1,
                Fate::Outside => self.outside(xi, tally),
                Fate::Drawn => self.judge(draw, xi, true, tally),
            }
        }
        self.draws = draws;
    }

    fn outside(&self, xi: &[f64], tally: &mut Tally) {
        let why = || self.probe.look(xi).and_then(|l| l.location.err().map(|why| (l.point, why)));
        tally.outside.add(self.probe, xi, || {
            why().map_or_else(String::new, |(p, why)| format!("the point {p} {why}"))
        });
    }

    /// Counts pairs of consecutive samples by their classes.
    fn follow(&mut self, classes: &[u16], tally: &mut Tally) {
        let mut previous = self.previous;
        for &class in classes {
            if let Some(previous) = previous {
                tally.pairs[usize::from(previous) * self.number_of_classes + usize::from(class)] += 1;
            }
            previous = Some(class);
        }
        self.previous = previous;
    }

    fn left_over(&self, class: usize, xi: &[f64], tally: &mut Tally) {
        match self.probe.left_over(xi) {
            Some(rest) if (0.0..1.0).contains(&rest) => {
                tally.left_over[class * CLASSES + (rest * CLASSES as f64) as usize] += 1;
            }
            Some(rest) => {
                let what = || format!("the variate left over is {rest}");
                tally.left_over_outside.add(self.probe, xi, what);
            }
            None => {}
        }
    }

    /// Adds 1 / density of a sample to the sums of its cell.
    fn weigh(&self, draw: &Draw, (leaf, cell): (usize, usize), tally: &mut Tally) {
        // Where nobody can be asked, only what the pilots show of the densities.
        let scale = match self.expectation.resolved.get(leaf) {
            None => 1.0,
            Some(None) => 0.0,
            Some(Some(part)) => part.square(&draw.location.at).map_or(0.0, |square| {
                // Larger ones would hide by their own variance that others are missing.
                let weight = (part.scale / draw.density).min(FLAT);
                let filled = &mut tally.filled[leaf];
                filled.sums[square] += weight;
                filled.squared += weight * weight;
                part.scale
            }),
        };
        if scale > 0.0 && draw.density > 0.0 {
            tally.inverse[cell].add(scale / draw.density);
        }
    }

    /// What the densities say of themselves, if there are any.
    fn judge(&self, draw: &Draw, xi: &[f64], asked: bool, tally: &mut Tally) {
        if !self.tells_densities {
            return;
        }
        let density = draw.density;
        let point = || self.probe.look(xi).map_or_else(String::new, |look| look.point);
        if !(density.is_finite() && density >= 0.0) {
            tally.invalid.add(self.probe, xi, || format!("the density at {} is {density}", point()));
        } else if density == 0.0 {
            self.zero(xi, "the density", tally);
        } else if asked {
            tally.disagreement.asked += 1;
            let asked = draw.asked;
            if !(asked.is_finite() && asked >= 0.0) {
                tally
                    .invalid
                    .add(self.probe, xi, || format!("asked for the density at {}, it says {asked}", point()));
            } else if asked == 0.0 {
                self.zero(xi, "asked, the density", tally);
            } else if (density - asked).abs() > SLACK * density {
                self.disagree(density, asked, xi, tally);
            }
        }
    }

    fn zero(&self, xi: &[f64], what: &str, tally: &mut Tally) {
        if self.probe.densities_around(xi, BORDER).iter().any(|&d| d > 0.0) {
            tally.on_border += 1;
        } else {
            let point = || self.probe.look(xi).map_or_else(String::new, |look| look.point);
            tally.unsupported.add(self.probe, xi, || format!("{what} at {} is 0", point()));
        }
    }

    /// Where the density returned and the density asked differ by more than the slack, the densities a rounding away say how much of it the rounding of
    /// the point explains.
    fn disagree(&self, returned: f64, asked: f64, xi: &[f64], tally: &mut Tally) {
        let (mut low, mut high) = (asked, asked);
        for density in self.probe.densities_around(xi, 2.5e-7) {
            (low, high) = (low.min(density), high.max(density));
        }
        let spread = high - low;
        let excess = (low - spread - returned).max(returned - (high + spread));
        if excess <= SLACK * returned {
            return;
        }
        let found = &mut tally.disagreement;
        found.wrong += 1;
        let relative = (returned / asked).max(asked / returned) - 1.0;
        if relative > found.worst {
            found.worst = relative;
            let point = self.probe.look(xi).map_or_else(String::new, |look| look.point);
            let what = format!("{returned:e} came with the point {point}, where asking gives {asked:e}");
            found.example = Some(Offence { sample: self.probe.called(xi), what });
        }
    }
}

/// Relative difference of densities that nobody minds.
const SLACK: f64 = 1e-4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Cell, Hemisphere, Integral, Interval, Knots, Location};
    use crate::random::unit_f64;
    use crate::sampler::from_fn;
    use crate::verify::expectation::told;
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::rows::told::Given;
    use crate::verify::{Row, recording};
    use glam::DVec3;
    use std::time::Duration;

    /// Directions uniform over the hemisphere, some of them on lines of the chart, at its ends, below the horizon, too long, or not kept.
    fn rows() -> Vec<[f64; 4]> {
        let mut rng = stream(3, "quick", 0);
        let mut next = || unit_f64(&mut rng);
        let mut row = |i: usize| {
            let (mut theta, mut phi) = (next().acos(), std::f64::consts::TAU * next());
            match i % 97 {
                0 => phi = (phi * 10.0 / std::f64::consts::PI).round() * std::f64::consts::PI / 10.0,
                1 => theta = (theta * 24.0 / std::f64::consts::PI).round() * std::f64::consts::PI / 24.0,
                2 => phi = 0.0,
                3 if i.is_multiple_of(2) => theta = 0.0,
                3 => theta = std::f64::consts::FRAC_PI_2,
                _ => {}
            }
            let length = if i % 9_973 == 40 { 1.0 + 1e-5 } else { 1.0 };
            let below = if i % 8_999 == 41 { -1.0 } else { 1.0 };
            let kept = f64::from(u8::from(i % 101 != 42));
            [length * theta.sin() * phi.cos(), length * theta.sin() * phi.sin(), below * theta.cos(), kept]
        };
        (0..250_000).map(&mut row).collect()
    }

    /// What is counted by squares is what is counted one by one.
    #[test]
    fn samples_known_by_their_squares() {
        let of = |quick: bool| {
            let row = |numbers: &[f64]| Row {
                point: (numbers[3] != 0.0).then(|| DVec3::from_slice(numbers)),
                density: None,
                weight: None,
            };
            // Positive but for one texel, which only a closer look tells.
            let black = |at: &[f64; 2]| (0.5..7.0 / 12.0).contains(&at[0]) && (0.25..0.3).contains(&at[1]);
            let density = move |places: &[Location], out: &mut Vec<f64>| {
                out.extend(places.iter().map(|place| if black(&place.at) { 0.0 } else { 0.16 }));
            };
            let record = recording(Hemisphere, Given(rows().into_iter()), row).unwrap();
            let record = record.knots(Knots::grid(120, 200)).density_of_places(density);
            let positive = |cell: &Cell| {
                cell.low[0] >= 7.0 / 12.0 || cell.high[0] <= 0.5 || cell.low[1] >= 0.3 || cell.high[1] <= 0.25
            };
            let record = if quick { record.positive_over(positive) } else { record };
            let expectation = Expectation::new(&record, 1, 230_000);
            assert_eq!(expectation.quick.is_some(), quick);
            draw(&record, &expectation, &Settings::default(), &mut |_| false)
        };
        let (quick, close) = (of(true), of(false));
        assert_eq!((quick.samples, quick.rejected), (close.samples, close.rejected));
        assert_eq!(quick.per_leaf, close.per_leaf);
        assert_eq!(quick.between_lines, close.between_lines);
        assert_eq!(quick.pairs, close.pairs);
        for (a, b) in [(&quick.outside, &close.outside), (&quick.unsupported, &close.unsupported)] {
            assert!(a.count == b.count && a.count > 10, "{} {}", a.count, b.count);
            assert_eq!(a.first.as_ref().unwrap().sample, b.first.as_ref().unwrap().sample);
        }
        // Only what is asked is weighed: all of the first shards, then each 64th.
        assert_eq!(close.weighed, close.samples);
        let first = ASKED_ALWAYS * SHARD;
        let rest = close.samples - first;
        assert!((rest / 64..rest / 64 + 100).contains(&(quick.weighed - first)), "{}", quick.weighed);
        let weighed = |tally: &Tally| tally.inverse.iter().map(|i| i.count).sum::<u64>() as f64;
        assert!(
            (weighed(&quick) / quick.weighed as f64 - weighed(&close) / close.weighed as f64).abs() < 0.01
        );
    }

    /// All of the first four shards are weighed, and of more, where squares are enough to count them, each 64th.
    #[test]
    fn samples_that_are_drawn_until_enough_are_weighed() {
        let line = Interval::new(0.0, 1.0);
        let mut expectation = told::expectation(&line, [Integral::default(); 4], vec![]);
        let many = [0.0, 7.0, 65_536.0, 65_546.0, 1e9, f64::INFINITY];
        assert_eq!(many.map(|weighed| drawn_until(weighed, &expectation)), many);
        expectation.quick = Some(told::quick());
        assert_eq!(
            many.map(|weighed| drawn_until(weighed, &expectation)),
            [0.0, 7.0, 65_536.0, 66_176.0, 64e9 - 63.0 * 65_536.0, f64::INFINITY]
        );
    }

    /// Who has a time to keep looks at the clock after each eight shards, and draws as many at least.
    #[test]
    fn when_the_time_is_up() {
        let (sampler, extras) =
            (from_fn(Interval::new(0.0, 1.0), |u: f64| u, |_: f64| 1.0), Extras::default());
        let expectation = told::expectation(&Interval::new(0.0, 1.0), [Integral::default(); 4], vec![]);
        let drawn = |shards: u64, time: Duration| {
            let settings = Settings { samples: shards * SHARD, time: Some(time), ..Settings::default() };
            let tally = draw(&Subject::new(&sampler, &extras), &expectation, &settings, &mut |_| false);
            tally.samples / SHARD
        };
        let (none, ages) = (Duration::ZERO, Duration::from_secs(1 << 20));
        assert_eq!((drawn(7, none), drawn(17, none), drawn(9, ages)), (7, 8, 9));
    }

    /// The last shard is as short as what is left; beyond 64 shards they are looked at by eights.
    #[test]
    fn as_many_as_are_asked_for() {
        let (sampler, extras) =
            (from_fn(Interval::new(0.0, 1.0), |u: f64| u, |_: f64| 1.0), Extras::default());
        let expectation = told::expectation(&Interval::new(0.0, 1.0), [Integral::default(); 4], vec![]);
        let drawn = |samples: u64, time: Option<Duration>| {
            let settings = Settings { samples, time, ..Settings::default() };
            let mut looks = 0;
            let tally = draw(&Subject::new(&sampler, &extras), &expectation, &settings, &mut |_| {
                looks += 1;
                false
            });
            (tally.samples, tally.per_leaf.iter().sum::<u64>(), looks)
        };
        let (some, many) = (9 * SHARD + 5, 80 * SHARD);
        let ages = Some(Duration::from_secs(1 << 20));
        assert_eq!(drawn(some, ages), (some, some, 10));
        assert_eq!(drawn(some, None), (some, some, 10));
        assert_eq!(drawn(many, None), (many, many, 64 + 2));
        assert_eq!(drawn(many, ages), (many, many, 80));
    }

    #[test]
    fn powers_of_weights() {
        let mut some = Inverse::default();
        some.add(2.0);
        some.add(3.0);
        assert_eq!((some.count, some.powers, some.largest), (2, [5.0, 13.0, 35.0], 3.0));
        let mut other = Inverse::default();
        other.add(4.0);
        other.merge(&some);
        assert_eq!((other.count, other.powers, other.largest), (3, [9.0, 29.0, 99.0], 4.0));
    }

    /// Weights, the harmonic mean of the pilots' densities over each, are added up by the square of the box that pilots span.
    #[test]
    fn samples_fill_squares() {
        let mut rng = stream(4, "filled", 0);
        // Densities of one magnitude, but for some that are judged, whose weights are cut; a few are 0.
        let density = |i: usize| match i % 50 {
            0 if i >= 500 => 0.01,
            25 if i >= 500 && i.is_multiple_of(7) => 0.0,
            _ => [0.5, 1.0, 1.5][i % 3],
        };
        let rows: Vec<[f64; 4]> = (0..4000).map(|i| [unit_f64(&mut rng), density(i), 0.0, 0.0]).collect();
        let row = |n: &[f64]| Row { point: Some(n[0]), density: Some(n[1]), weight: None };
        let record = recording(Interval::new(0.0, 1.0), Given(rows.clone().into_iter()), row).unwrap();
        let expectation = Expectation::new(&record, 1, 3500);
        let settings = Settings { samples: 3500, ..Settings::default() };
        let tally = draw(&record, &expectation, &settings, &mut |_| false);
        assert_eq!((tally.samples, tally.weighed), (3500, 3500));
        let mut expected = vec![Filled::default(); expectation.resolved.len()];
        let (mut cut, mut weighed, mut nowhere) = (0, (0, 0.0), 0);
        for [x, density, ..] in &rows[500..] {
            let at = [*x, 0.0];
            let leaf = expectation.partition.leaf_of(&Location { patch: 0, at });
            let part = expectation.resolved[leaf].unwrap();
            if let Some(square) = part.square(&at) {
                let weight = (part.scale / density).min(4.0);
                cut += usize::from(weight == 4.0);
                expected[leaf].sums[square] += weight;
                expected[leaf].squared += weight * weight;
                // Their sum is that of all who have a density, and is not cut.
                if *density > 0.0 {
                    weighed = (weighed.0 + 1, weighed.1 + part.scale / density);
                }
            } else {
                nowhere += 1;
            }
        }
        assert!(expected.len() > 30 && cut > 30 && nowhere > 30);
        let count: u64 = tally.inverse.iter().map(|sums| sums.count).sum();
        let sum: f64 = tally.inverse.iter().map(|sums| sums.powers[0]).sum();
        assert!(count == weighed.0 && (sum - weighed.1).abs() < 1e-9 * sum, "{count} {sum}, not {weighed:?}");
        for (found, expected) in tally.filled.iter().zip(&expected) {
            let pairs = found.sums.iter().zip(&expected.sums).chain([(&found.squared, &expected.squared)]);
            pairs.for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{found:?}, not {expected:?}"));
        }
    }
}
