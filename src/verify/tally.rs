//! Draws the samples and counts them: per cell, per pair of consecutive cells, rejected, outside of the domain, without density.
//!
//! Samples are drawn in shards of fixed size, each from its own stream, and merged in order: the same seed gives the same counts on any
//! number of threads.

use super::expectation::{Expectation, FLAT, LeafNote, MODULI, Resolved};
use super::probe::{Draw, Fate, Probe, is_asked};
use super::settings::{Drawn, Settings};
use crate::random::{fill_unit, stream};
use crate::statistics::Moments;
use std::time::Instant;

pub(super) const SHARD: u64 = 1 << 14;
/// Shards between two looks at the clock; also what bounds the memory.
const BATCH: u64 = 64;
/// Shards that share a tally once there are finer cells than samples in a shard: to empty and to merge a tally costs as much as many samples.
const SHARED: u64 = 8;
/// Samples that are drawn in one go, few enough that all that is known of them stays in the nearest cache; of who pays for every question, more.
const CHUNK: usize = 128;
const SLOW_CHUNK: usize = 512;
/// In this many first shards the density is asked again at every sample's point, later at each one in [`ASKED_RARELY`].
const ASKED_ALWAYS: u64 = 4;
/// A power of two: to divide by a number that isn't known costs as much as to count.
const ASKED_RARELY: usize = 16;
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
    pub per_leaf: Vec<u64>,
    /// For each cell of both coarse scales.
    pub inverse: Vec<Inverse>,
    /// Of each leaf; empty where densities can be asked.
    pub filled: Vec<Filled>,
    /// For each axis with lines across it, samples between two lines, of leaves that a line cuts.
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
        let (mine, theirs) = (&mut self.disagreement, other.disagreement);
        mine.asked += theirs.asked;
        mine.wrong += theirs.wrong;
        if theirs.worst > mine.worst {
            (mine.worst, mine.example) = (theirs.worst, theirs.example);
        }
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

    /// Whether something was seen that no right sampler does.
    pub fn offends(&self) -> bool {
        let offences = [&self.outside, &self.unsupported, &self.invalid, &self.left_over_outside];
        offences.iter().any(|o| o.count > 0) || self.disagreement.wrong > 0
    }
}

/// Classes that consecutive samples are tallied in: the cells of the coarsest scale and one for the rest.
pub(super) fn classes(expectation: &Expectation) -> usize {
    1 + expectation.scales.first().map_or(0, |scale| scale.cells.len())
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
    let shards = settings.samples.div_ceil(SHARD);
    let mut next = 0;
    let time_is_up = || settings.time.is_some_and(|time| start.elapsed() >= time);
    while next < shards && !(next > 0 && (settings.stopped() || time_is_up())) {
        // With a time to keep, look at the clock more often.
        let batch = if settings.time.is_some() { BATCH / 8 } else { BATCH }.min(shards - next);
        let wanted = (batch * SHARD).min(settings.samples - next * SHARD);
        let loaded = probe.load(next * SHARD, wanted);
        let batch = loaded.div_ceil(SHARD);
        let together = if next < BATCH || probe.is_slow() { 1 } else { SHARED };
        let judge = || {
            crate::parallel::map(batch.div_ceil(together) as usize, |i| {
                let mut tally = Tally::empty(probe, expectation);
                for shard in i as u64 * together..batch.min((i as u64 + 1) * together) {
                    let count = SHARD.min(loaded - shard * SHARD);
                    draw_shard(probe, expectation, settings.seed, next + shard, count, &mut tally);
                }
                tally
            })
        };
        // What is read from elsewhere is read while the last that came is judged.
        let after = next + batch;
        let ahead = (BATCH * SHARD).min(settings.samples.saturating_sub(after * SHARD));
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

fn draw_shard(
    probe: &dyn Probe,
    expectation: &Expectation,
    seed: u64,
    shard: u64,
    count: u64,
    tally: &mut Tally,
) {
    let mut rng = stream(seed, "verify", shard);
    let dimensions = probe.dimensions().max(1);
    tally.samples += count;
    let chunk = if probe.is_slow() { SLOW_CHUNK } else { CHUNK };
    let mut xi = vec![0.0; chunk * dimensions];
    let (mut draws, mut leaves) = (Vec::with_capacity(chunk), Vec::with_capacity(chunk));
    let (mut notes, mut values) = (Vec::<LeafNote>::with_capacity(chunk), Vec::new());
    let mut apart = vec![0; chunk];
    let mut counter = Counter::new(probe, expectation);
    let ask = if shard < ASKED_ALWAYS { 1 } else { ASKED_RARELY };
    let mut left = count as usize;
    let mut next_row = shard * SHARD + 1;
    while left > 0 {
        let xi = &mut xi[..left.min(chunk) * dimensions];
        match probe.pilots() {
            None => fill_unit(&mut rng, xi),
            // Rows, by their number plus 1.
            Some(_) => xi.iter_mut().enumerate().for_each(|(i, xi)| *xi = (next_row + i as u64) as f64),
        }
        next_row += xi.len() as u64;
        probe.draw(xi, ask, &mut draws, &mut values);
        expectation.partition.leaves_of(draws.iter().map(|draw| &draw.location), &mut leaves);
        // Leaves are all over the memory: loops with nothing else in them wait for many at once.
        notes.clear();
        notes.extend(leaves.iter().map(|&leaf| expectation.coarse.note(leaf)));
        for (draw, &leaf) in draws.iter().zip(&leaves) {
            tally.per_leaf[leaf] += u64::from(draw.fate == Fate::Drawn);
        }
        // Which leaves a line cuts is not to be predicted: those are set apart without a branch.
        for (i, (marginal, counts)) in expectation.marginals.iter().zip(&mut tally.between_lines).enumerate()
        {
            let mut cut = 0;
            for (k, (draw, note)) in draws.iter().zip(&notes).enumerate() {
                apart[cut] = k;
                cut += usize::from(note.is_cut_by(i) & (draw.fate == Fate::Drawn));
            }
            for &k in &apart[..cut] {
                counts[marginal.slab(leaves[k], draws[k].location.at[marginal.axis])] += 1;
            }
        }
        let places = leaves.iter().zip(&notes);
        for (i, ((draw, (&leaf, note)), xi)) in
            draws.iter().zip(places).zip(xi.chunks_exact(dimensions)).enumerate()
        {
            // Where nobody can be asked, only what the pilots show of the densities.
            let scale = match expectation.resolved.get(leaf) {
                None => 1.0,
                Some(part) if draw.fate == Fate::Drawn => part.map_or(0.0, |part| {
                    let square = part.square(&draw.location.at);
                    square.map_or(0.0, |square| {
                        // Larger ones would hide by their own variance that others are missing.
                        let weight = (part.scale / draw.density).min(FLAT);
                        let filled = &mut tally.filled[leaf];
                        filled.sums[square] += weight;
                        filled.squared += weight * weight;
                        part.scale
                    })
                }),
                Some(_) => 0.0,
            };
            counter.count(draw, (note.cell(), scale), xi, is_asked(i, ask), tally);
        }
        let functions = tally.known.len().max(1);
        for values in values.chunks_exact(functions) {
            tally.known.iter_mut().zip(values).for_each(|(moments, &value)| moments.add(value));
        }
        left -= draws.len();
    }
}

struct Counter<'a> {
    probe: &'a dyn Probe,
    expectation: &'a Expectation,
    by_remainder: bool,
    has_left_over: bool,
    classes: usize,
    previous: Option<usize>,
}

impl<'a> Counter<'a> {
    fn new(probe: &'a dyn Probe, expectation: &'a Expectation) -> Self {
        let middle = vec![0.5; probe.dimensions()];
        Self {
            probe,
            expectation,
            by_remainder: !expectation.remainders.is_empty(),
            has_left_over: probe.left_over(&middle).is_some(),
            classes: classes(expectation),
            previous: None,
        }
    }

    /// All but the counts of the leaf and of what lines cut it into; `cell` is that of the coarse scales, and what its 1 / density is multiplied by, 0 if
    /// it doesn't count.
    fn count(
        &mut self,
        draw: &Draw,
        (cell, scale): (usize, f64),
        xi: &[f64],
        asked: bool,
        tally: &mut Tally,
    ) {
        let mut class = self.classes - 1;
        match draw.fate {
            Fate::Rejected => tally.rejected += 1,
            Fate::Outside => {
                let why = || self.probe.look(xi).and_then(|l| l.location.err().map(|why| (l.point, why)));
                tally.outside.add(self.probe, xi, || {
                    why().map_or_else(String::new, |(p, why)| format!("the point {p} {why}"))
                });
            }
            Fate::Drawn => {
                class = self.expectation.coarse.cells[cell][0].unwrap_or(class);
                if scale > 0.0 && draw.density > 0.0 {
                    tally.inverse[cell].add(scale / draw.density);
                }
                if self.by_remainder {
                    for (counts, m) in tally.remainders.iter_mut().zip(MODULI) {
                        counts[draw.location.patch % m] += 1;
                    }
                }
                self.judge(draw, xi, asked, tally);
            }
        }
        if let Some(previous) = self.previous.replace(class) {
            tally.pairs[previous * self.classes + class] += 1;
        }
        if self.has_left_over && draw.fate == Fate::Drawn {
            match self.probe.left_over(xi) {
                Some(rest) if (0.0..1.0).contains(&rest) => {
                    tally.left_over[class * CLASSES + (rest * CLASSES as f64) as usize] += 1;
                }
                Some(rest) => {
                    tally
                        .left_over_outside
                        .add(self.probe, xi, || format!("the variate left over is {rest}"));
                }
                None => {}
            }
        }
    }

    /// What the densities say of themselves.
    fn judge(&self, draw: &Draw, xi: &[f64], asked: bool, tally: &mut Tally) {
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
