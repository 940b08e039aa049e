//! Where the mass is: cells from pilot samples, and the mass of every cell by quadrature of the density.
//!
//! Quadrature sees a peak because the cells follow the pilots. What it can still miss is a sliver of a support that ends inside a cell (the
//! far corner of a lamp seen at a grazing angle). So cells in which the density is 0 here and positive there are cut again by many more samples,
//! and what even those may have missed is added to the error of the total. None of these samples are the ones that are judged.

use super::probe::{Fate, Probe, each_pilot};
#[cfg(test)]
use crate::domain::Knots;
use crate::domain::{
    Cell, Groups, Integral, Integrator, Location, Partition, Space, Squares, integrate_at_random,
};
use crate::random::{fill_unit, stream, unit_f64};
use std::collections::HashMap;

/// Pilot samples, at least and at most; as a share of the samples that are judged between, so that more samples make finer cells.
const PILOTS: [u64; 2] = [1 << 14, 1 << 18];
const PILOTS_SHARE: u64 = 64;
const PILOTS_PER_LEAF: usize = 8;
/// The same where pilots have to show the density by themselves: the more, the larger the part of the leaf that they span.
const RESOLVING_PER_LEAF: usize = 16;
const LEAST_RESOLVING: usize = 4;
/// The largest ratio of densities of one magnitude.
pub(super) const FLAT: f64 = 4.0;
const SHARD: usize = 1 << 11;
/// Samples that look for slivers, at least and at most; as a share of those that are judged between.
const GUIDES: [u64; 2] = [1 << 17, 1 << 22];
const GUIDES_SHARE: u64 = 8;
const GUIDES_PER_PIECE: usize = 4;
/// A place without any of N samples holds more than this over N with probability e^-8.
const UNSEEN: f64 = 8.0;
/// Cells that expect fewer samples are pooled (Cochran 1954 has 5 as the usual bound).
pub(super) const LEAST: f64 = 8.0;
/// Numbers of cells that the scales aim at; the finest ones are there only if there are samples for them.
const SCALES: [usize; 6] = [16, 48, 192, 1024, 8192, 65536];
/// Below this many samples a cell a finer scale is not worth a test of its own.
const WORTH: f64 = 100.0;
/// Lines across each axis whose marginal distribution is tested; domains of more patches have none.
const LINES: usize = 20;
const LINES_PATCHES: usize = 8;

/// The cells of a sampler's domain, and what its density says of them.
#[derive(Clone)]
pub(super) struct Expectation {
    pub partition: Partition,
    /// Mass of each leaf, and its error.
    pub leaves: Vec<Integral>,
    /// Sum over the leaves.
    pub total: Integral,
    /// Coarser partitions, from coarse to fine.
    pub scales: Vec<Groups>,
    /// What is tallied by few cells.
    pub coarse: Coarse,
    /// Where most samples are known by their square alone.
    pub quick: Option<Quick>,
    /// For each axis, lines across it and the mass below each.
    pub marginals: Vec<Marginal>,
    /// Where a mass that the sampler gave is not the integral of its density.
    pub contradiction: Option<String>,
    /// Of a discrete domain: the mass of the entries whose index leaves each remainder, for each of [`MODULI`].
    pub remainders: Vec<Vec<f64>>,
    /// What is known of each leaf's density where there is none to be asked of; empty otherwise.
    pub resolved: Vec<Option<Resolved>>,
}

/// The part of a leaf whose density its pilots show: the box that they span, in which their densities are of one magnitude. What lies around it may
/// have any density, and where that is low its 1 / density decides a mean although no sample is ever seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolved {
    low: [f64; 2],
    size: [f64; 2],
    /// How many [squares](Self::SQUARES) there are along each axis, and their shares of the measure.
    squares: [usize; 2],
    pub shares: [f32; Self::SQUARES],
    /// The harmonic mean of the pilots' densities. Weights are this over the density: near 1 all over the domain.
    pub scale: f64,
    /// What the mean of the weights should be.
    pub expected: f64,
    /// The largest weight of a pilot.
    pub largest: f64,
    /// Sums of the second and third power of the pilots' weights.
    pub powers: [f64; 2],
}

impl Resolved {
    /// Each is cut into so many, to see whether samples fill it.
    pub const SQUARES: usize = 16;

    /// Of a leaf whose pilots have these 1 / density.
    fn new(space: &dyn Space, partition: &Partition, leaf: usize, weights: &[f64]) -> Option<Self> {
        let mut cell = partition.leaves()[leaf].clone();
        let (least, largest) =
            weights.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &w| (low.min(w), high.max(w)));
        // The least and the largest are blind to NaN.
        let flat = weights.iter().all(|w| *w > 0.0 && w.is_finite()) && largest <= FLAT * least;
        let [low, high] = partition.pilot_box(leaf)?;
        if !flat || space.axes() > 0 && weights.len() < LEAST_RESOLVING {
            return None;
        }
        for axis in 0..space.axes() {
            (cell.low[axis], cell.high[axis]) = (low[axis], high[axis]);
        }
        let scale = weights.len() as f64 / weights.iter().sum::<f64>();
        let squares = match space.axes() {
            0 => [1, 1],
            1 => [Self::SQUARES, 1],
            _ => [4, Self::SQUARES / 4],
        };
        let size = [0, 1].map(|axis| high[axis] - low[axis]);
        let measure = space.cell_measure(&cell);
        let shares = std::array::from_fn(|i| {
            let mut square = cell.clone();
            let along = [i / squares[1] % squares[0], i % squares[1]];
            for axis in 0..space.axes() {
                let edge = |k: usize| low[axis] + size[axis] * k as f64 / squares[axis] as f64;
                (square.low[axis], square.high[axis]) = (edge(along[axis]), edge(along[axis] + 1));
            }
            (space.cell_measure(&square) / measure) as f32
        });
        Some(Self {
            low,
            size,
            squares,
            shares,
            scale,
            expected: scale * measure,
            largest: scale * largest,
            powers: [2, 3].map(|power| weights.iter().map(|w| (scale * w).powi(power)).sum()),
        })
    }

    /// The square that a place lies in.
    #[inline]
    pub fn square(&self, at: &[f64; 2]) -> Option<usize> {
        let mut square = 0;
        for (axis, at) in at.iter().enumerate() {
            let from = at - self.low[axis];
            if !(0.0..=self.size[axis]).contains(&from) {
                return None;
            }
            let number = self.squares[axis];
            let along = (from / self.size[axis].max(f64::MIN_POSITIVE) * number as f64) as usize;
            square = square * number + along.min(number - 1);
        }
        Some(square)
    }

    /// How many squares there are.
    pub fn squares(&self) -> usize {
        self.squares[0] * self.squares[1]
    }
}

/// The two coarsest scales as they were when samples were counted by them, and what else the tally has to know of each leaf.
#[derive(Clone)]
pub(super) struct Coarse {
    pub scales: Vec<Groups>,
    /// For each cell of both scales at once, its cell in either.
    pub cells: Vec<[Option<usize>; 2]>,
    of_leaf: Vec<LeafNote>,
}

/// The cell of both coarse scales that a leaf lies in, its class, and whether its density is positive all over.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LeafNote {
    cell: u16,
    class: u16,
}

impl LeafNote {
    #[inline]
    pub fn cell(self) -> usize {
        usize::from(self.cell)
    }

    /// The class that consecutive samples are tallied in: the cell of the coarsest scale, or behind them all that have none.
    #[inline]
    pub fn class(self) -> u16 {
        self.class
    }
}

/// What follows from the square that a sample lies in, where nothing else has to be known of it: neither a leaf nor a line of a marginal cuts the square,
/// and its density is known to be positive. Squares of which the same follows are of one kind, so that a sample is counted once and not for each of that.
#[derive(Clone)]
pub(super) struct Quick {
    pub squares: Squares,
    /// The kind of each square, small enough for the cache.
    of_squares: Vec<u16>,
    /// Of each kind, the class that consecutive samples are tallied in, and the rest: nothing yet of [`UNKNOWN`].
    pub classes: Vec<u16>,
    kinds: Vec<Kind>,
}

/// What all samples in squares of one kind are counted for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
struct Kind {
    leaf: usize,
    /// The slab along each marginal.
    slabs: [u8; 2],
}

/// The kind of squares of which more has to be known.
pub(super) const UNKNOWN: u16 = 0;

/// Share of the pilots that have to be known by their square, or it isn't worth to ask.
const MOSTLY: f64 = 0.75;

impl Quick {
    fn new(
        probe: &dyn Probe,
        partition: &Partition,
        coarse: &Coarse,
        marginals: &[Marginal],
    ) -> Option<Self> {
        let is_positive: Vec<bool> =
            partition.leaves().iter().map(|cell| probe.is_positive_over(cell)).collect();
        if !is_positive.contains(&true) {
            return None;
        }
        let (squares, leaves) = partition.squares()?;
        let sides = squares.sides;
        // Where a line cuts a row or column of squares there is no slab.
        let slab = |marginal: &Marginal, k: usize| {
            let [low, high] = [k, k + 1].map(|k| k as f64 / sides[marginal.axis] as f64);
            let from = marginal.slab(low);
            marginal.lines.get(from).is_none_or(|&line| line >= high).then_some(from as u8)
        };
        let slabs: Vec<Vec<Option<u8>>> =
            marginals.iter().map(|m| (0..sides[m.axis]).map(|k| slab(m, k)).collect()).collect();
        let kind = |square: usize, leaf: usize| {
            let (mut kind, at) = (Kind { leaf, slabs: [0; 2] }, [square / sides[1], square % sides[1]]);
            for ((slab, marginal), slabs) in kind.slabs.iter_mut().zip(marginals).zip(&slabs) {
                *slab = slabs[at[marginal.axis]]?;
            }
            Some(kind)
        };
        let (mut kinds, mut classes) = (vec![Kind::default()], vec![0]);
        let mut numbers = HashMap::new();
        let mut number = |kind: Kind| {
            *numbers.entry(kind).or_insert_with(|| {
                kinds.push(kind);
                classes.push(coarse.note(kind.leaf).class());
                kinds.len() - 1
            })
        };
        let of_square = |(square, leaf): (usize, Option<usize>)| {
            let kind = leaf.filter(|&leaf| is_positive[leaf]).and_then(|leaf| kind(square, leaf));
            u16::try_from(kind.map_or(usize::from(UNKNOWN), &mut number)).ok()
        };
        let of_squares = leaves.into_iter().enumerate().map(of_square).collect::<Option<_>>()?;
        let quick = Self { squares, of_squares, classes, kinds };
        let (pilots, mut places, mut found) = (probe.pilots()?, [Vec::new(), Vec::new()], Vec::new());
        let error = probe.locate_roughly(&each_pilot(pilots, pilots), &mut places);
        quick.squares.find(&places, error, &mut found);
        let known = found.iter().filter(|square| quick.kind(**square) != UNKNOWN).count();
        (known as f64 >= MOSTLY * pilots as f64).then_some(quick)
    }

    /// The kind of a square, or [`UNKNOWN`].
    #[inline]
    pub fn kind(&self, square: u32) -> u16 {
        self.of_squares.get(square as usize).copied().unwrap_or(UNKNOWN)
    }

    /// Adds what was counted of each kind that is known to the counts of leaves and between lines.
    pub fn settle(&self, counts: &[u32], per_leaf: &mut [u64], between_lines: &mut [Vec<u64>]) {
        for (kind, &count) in self.kinds.iter().zip(counts).skip(usize::from(UNKNOWN) + 1) {
            let count = u64::from(count);
            per_leaf[kind.leaf] += count;
            between_lines
                .iter_mut()
                .zip(kind.slabs)
                .for_each(|(counts, slab)| counts[usize::from(slab)] += count);
        }
    }
}

impl Coarse {
    fn new(scales: &[Groups], leaves: usize) -> Self {
        let scales = scales[..scales.len().min(2)].to_vec();
        let mut cells = Vec::new();
        let mut number = HashMap::new();
        let rest = scales.first().map_or(0, |scale| scale.cells.len());
        let of_leaf = (0..leaves).map(|leaf| {
            let both = [0, 1].map(|i| scales.get(i).and_then(|scale| scale.of_leaf[leaf]));
            let cell = *number.entry(both).or_insert_with(|| {
                cells.push(both);
                cells.len() as u16 - 1 // of a hundred or so
            });
            let class = both[0].unwrap_or(rest) as u16;
            LeafNote { cell, class }
        });
        let of_leaf = of_leaf.collect();
        Self { scales, cells, of_leaf }
    }

    #[inline]
    pub fn note(&self, leaf: usize) -> LeafNote {
        self.of_leaf[leaf]
    }
}

/// The marginal distribution along one axis of the chart, at some lines across it.
#[derive(Clone)]
pub(super) struct Marginal {
    pub axis: usize,
    pub lines: Vec<f64>,
    /// Mass below each line.
    pub below: Vec<Integral>,
    /// For each of [`SLICES`] of the axis, how many lines lie at or below its lower end and below its upper one: a sample is compared with those between only.
    near: Vec<(u8, u8)>,
}

/// A power of two, so that which slice a coordinate lies in is no matter of rounding.
const SLICES: usize = 256;

impl Marginal {
    fn new(axis: usize, lines: Vec<f64>, below: Vec<Integral>) -> Self {
        let edge = |slice: usize| slice as f64 / SLICES as f64;
        let near = |slice: usize| {
            let from = lines.partition_point(|&line| line <= edge(slice));
            let to = lines.partition_point(|&line| line < edge(slice + 1));
            (from as u8, to as u8) // of twenty
        };
        Self { axis, below, near: (0..SLICES).map(near).collect(), lines }
    }

    /// How many lines lie at or below `x`.
    #[inline]
    pub fn slab(&self, x: f64) -> usize {
        let (from, to) = self.near[((x * SLICES as f64) as i64 as usize).min(SLICES - 1)];
        let crossing = &self.lines[usize::from(from)..usize::from(to)];
        usize::from(from) + crossing.iter().map(|&line| usize::from(line <= x)).sum::<usize>()
    }
}

/// Mass and its error, of one cell of a scale.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mass {
    pub value: f64,
    pub error: f64,
}

/// Entries that lie between each other share cells; those of one remainder do not.
pub(super) const MODULI: [usize; 2] = [64, 61];

impl Expectation {
    /// What pilots alone say, where there is no density for every point: the cells, and their share of the pilots.
    fn of_pilots(probe: &dyn Probe, samples: u64) -> Self {
        let count = probe.pilots().unwrap_or(0);
        let xi = each_pilot(count, count);
        let (mut draws, mut values) = (Vec::new(), Vec::new());
        probe.draw(&xi, usize::MAX, &mut draws, &mut values);
        draws.retain(|draw| draw.fate == Fate::Drawn);
        let space = probe.space();
        let pilots: Vec<Location> = draws.iter().map(|draw| draw.location).collect();
        let per_leaf = if space.axes() == 0 { 1 } else { RESOLVING_PER_LEAF };
        let partition = Partition::from_pilots(space, pilots, probe.knots(), per_leaf);
        let mut weights = vec![Vec::new(); partition.leaves().len()];
        for draw in &draws {
            weights[partition.leaf_of(&draw.location)].push(1.0 / draw.density);
        }
        let share = |weights: &Vec<f64>| weights.len() as f64 / count as f64;
        let leaves: Vec<Integral> =
            weights.iter().map(|w| Integral { value: share(w), ..Integral::default() }).collect();
        let resolved =
            weights.iter().enumerate().map(|(leaf, w)| Resolved::new(space, &partition, leaf, w)).collect();
        let unknown = Integral { value: f64::NAN, error: f64::NAN, ..Integral::default() };
        let scales = scales(&partition, &leaves, samples);
        let coarse = Coarse::new(&scales, partition.leaves().len());
        Self {
            partition,
            leaves,
            total: unknown,
            scales,
            coarse,
            quick: None,
            marginals: Vec::new(),
            contradiction: None,
            remainders: Vec::new(),
            resolved,
        }
    }

    /// Chooses the scales again, for the number of samples that there were after all. The coarsest stays: consecutive samples were counted by it.
    pub(super) fn settle(&mut self, samples: u64) {
        let again = scales(&self.partition, &self.leaves, samples.max(1));
        let coarsest = self.scales.drain(..).next();
        let finer = again.into_iter().skip(1);
        self.scales = coarsest.into_iter().chain(finer).collect();
        self.scales.dedup_by(|a, b| a.cells.len() == b.cells.len());
    }

    /// For `samples` samples to be judged.
    pub(super) fn new(probe: &dyn Probe, seed: u64, samples: u64) -> Self {
        if !probe.has_density() {
            return Self::of_pilots(probe, samples);
        }
        let (space, knots) = (probe.space(), probe.knots());
        let pilots = (samples / PILOTS_SHARE).clamp(PILOTS[0], PILOTS[1]);
        let pilots = locations(probe, seed, "pilot", pilots as usize);
        let per_leaf = if space.axes() == 0 { 1 } else { PILOTS_PER_LEAF };
        let lines = lines(probe, &pilots);
        let partition = Partition::from_pilots(space, pilots, knots, per_leaf);
        // An error t of all cells, at worst, adds n t^2 to the chi-square statistic: keep that well below its spread.
        let relative_tolerance = (0.5 / (samples as f64).sqrt()).clamp(1e-6, 1e-3);
        let integrator = Integrator { relative_tolerance, absolute_tolerance: 1e-9, max_evaluations: 20_000 };
        let integrate = |integrator: Integrator, partition: &Partition, leaf: usize, cell: &Cell| {
            let grading = partition.grading(leaf);
            integrator
                .integrate_chart(space, cell, knots, &grading, &|places, out| probe.densities_at(places, out))
        };
        // The parts that a line cuts off need no such care: their errors are taken off a distance, not summed up.
        let rough = Integrator { relative_tolerance: 1e-4, absolute_tolerance: 1e-9, max_evaluations: 400 };
        let whole = |partition: &Partition, leaf: usize| {
            integrate(integrator, partition, leaf, &partition.leaves()[leaf])
        };
        let mut leaves = crate::parallel::map(partition.leaves().len(), |leaf| whole(&partition, leaf));
        let mut unseen = 0.0;
        if leaves.iter().any(|leaf| leaf.zeros > 0) {
            let guides = (samples / GUIDES_SHARE).clamp(GUIDES[0], GUIDES[1]) as usize;
            let guides = probe.pilots().unwrap_or(guides);
            look_again(probe, seed, guides, &partition, &mut leaves, &whole);
            unseen = UNSEEN / guides as f64;
        }
        let contradiction = take_given_masses(probe, seed, &partition, &mut leaves);
        let mut total = leaves.iter().copied().fold(Integral::default(), |a, b| a + b);
        total.error += unseen;
        let below = |axis: usize, line: f64| {
            mass_below(&partition, &leaves, axis, line, |leaf, cell| match probe.cell_mass(cell) {
                Some(value) => Integral { value, ..Integral::default() },
                None => integrate(rough, &partition, leaf, cell),
            })
        };
        let marginals: Vec<Marginal> = lines
            .into_iter()
            .enumerate()
            .map(|(axis, lines)| {
                let below = crate::parallel::map(lines.len(), |i| below(axis, lines[i]));
                Marginal::new(axis, lines, below)
            })
            .collect();
        let mut remainders = Vec::new();
        if space.axes() == 0 && space.patches() > PILOTS[0] as usize / 16 {
            remainders = MODULI.map(|modulus| vec![0.0; modulus]).into();
            let entries: Vec<Location> =
                (0..space.patches()).map(|patch| Location { patch, at: [0.0; 2] }).collect();
            let mut masses = Vec::new();
            probe.densities_at(&entries, &mut masses);
            for (entry, (mass, _)) in masses.into_iter().enumerate() {
                remainders
                    .iter_mut()
                    .zip(MODULI)
                    .for_each(|(masses, modulus)| masses[entry % modulus] += mass);
            }
        }
        let scales = scales(&partition, &leaves, samples);
        let coarse = Coarse::new(&scales, partition.leaves().len());
        let quick = Quick::new(probe, &partition, &coarse, &marginals);
        Self {
            partition,
            leaves,
            total,
            scales,
            coarse,
            quick,
            marginals,
            contradiction,
            remainders,
            resolved: Vec::new(),
        }
    }

    /// The errors that [`doubt`](Self::doubt) widens, to take that back.
    pub(super) fn errors(&self) -> Errors {
        let of = |integrals: &[Integral]| integrals.iter().map(|integral| integral.error).collect();
        Errors {
            leaves: of(&self.leaves),
            total: self.total.error,
            below: self.marginals.iter().map(|marginal| of(&marginal.below)).collect(),
        }
    }

    /// Takes these errors, as back to what they were.
    pub(super) fn reset(&mut self, errors: &Errors) {
        let set = |integrals: &mut [Integral], errors: &[f64]| {
            integrals.iter_mut().zip(errors).for_each(|(integral, &error)| integral.error = error);
        };
        set(&mut self.leaves, &errors.leaves);
        self.total.error = errors.total;
        self.marginals.iter_mut().zip(&errors.below).for_each(|(m, errors)| set(&mut m.below, errors));
    }

    /// Before anybody fails: integrates every leaf again by about so many random points, and widens each error to what the two disagree about. The error
    /// estimate of a quadrature rule is no bound where the integrand keeps step with the nodes, or has more edges than there are nodes.
    pub(super) fn doubt(&mut self, probe: &dyn Probe, seed: u64, points: usize) {
        if probe.space().axes() == 0 {
            return; // sums are exact
        }
        let partition = &self.partition;
        let whole = |leaf: usize| at_random(probe, seed, points, partition, leaf, &partition.leaves()[leaf]);
        let again = crate::parallel::map(self.leaves.len(), whole);
        let (mut value, mut variance) = (0.0, 0.0);
        let densest = largest_at_samples(probe, seed, partition);
        for (i, (leaf, (mass, error))) in self.leaves.iter_mut().zip(again).enumerate() {
            leaf.error = leaf.error.max((leaf.value - mass).abs() + SURE * error);
            if leaf.zeros > 0 && mass < SLIVER_HITS.sqrt() * error || mass == 0.0 && leaf.value > 0.0 {
                // A sliver of a support that hardly any point has hit: h hits, each worth error^2 / mass, don't tell their own error.
                let cell = &partition.leaves()[i];
                let chart =
                    (0..probe.space().axes()).map(|axis| cell.high[axis] - cell.low[axis]).product::<f64>();
                let one = if mass > 0.0 { error * error / mass } else { densest[i] * chart / points as f64 };
                leaf.error = leaf.error.max((MISSED * one).min(1.0));
            }
            value += mass;
            variance += error * error;
        }
        self.total.error = self.total.error.max((self.total.value - value).abs() + SURE * variance.sqrt());
        for marginal in &mut self.marginals {
            for (below, &line) in marginal.below.iter_mut().zip(&marginal.lines) {
                // The parts of leaves that the line cuts off are as doubtful as the leaves.
                let crossed = (partition.leaves().iter().zip(&self.leaves))
                    .filter(|(cell, _)| cell.low[marginal.axis] < line && line < cell.high[marginal.axis]);
                let doubt: f64 = crossed.map(|(_, leaf)| leaf.error).sum();
                below.error = below.error.max(self.total.error + doubt);
            }
        }
    }

    pub(super) fn masses(&self) -> Vec<f64> {
        self.leaves.iter().map(|leaf| leaf.value).collect()
    }

    /// The masses of the cells of a scale, and of its pool of light cells.
    pub(super) fn masses_at(&self, scale: &Groups) -> (Vec<Mass>, Mass) {
        let (mut masses, mut pool) = (vec![Mass::default(); scale.cells.len()], Mass::default());
        for (leaf, group) in self.leaves.iter().zip(&scale.of_leaf) {
            let mass = group.map_or(&mut pool, |g| &mut masses[g]);
            mass.value += leaf.value;
            mass.error += leaf.error;
        }
        (masses, pool)
    }

    /// What the density leaves to rejected samples.
    pub(super) fn rejected(&self) -> Mass {
        Mass { value: (1.0 - self.total.value).max(0.0), error: self.total.error + 1e-6 }
    }
}

/// Hits below which a sliver's own variance says nothing.
const SLIVER_HITS: f64 = 16.0;
/// Hits that may have been missed: e^-20 is the probability of none where so many are expected.
const MISSED: f64 = 20.0;
/// Random points of a leaf, about: first few, which are enough where somebody is plainly wrong, then many.
pub(super) const DOUBTS: [usize; 2] = [256, MANY];
const MANY: usize = 4096;

/// The errors of an [`Expectation`].
pub(super) struct Errors {
    leaves: Vec<f64>,
    total: f64,
    below: Vec<Vec<f64>>,
}

/// The largest density per chart area at samples in each leaf; 0 where none fell.
fn largest_at_samples(probe: &dyn Probe, seed: u64, partition: &Partition) -> Vec<f64> {
    const SAMPLES: usize = 1 << 14;
    let mut xi = vec![0.0; SAMPLES * probe.dimensions().max(1)];
    fill_unit(&mut stream(seed, "slivers", 0), &mut xi);
    let mut places = Vec::new();
    probe.locate(&xi, &mut places);
    let mut largest = vec![0.0_f64; partition.leaves().len()];
    let mut densities = Vec::new();
    probe.densities_at(&places, &mut densities);
    for (place, (density, jacobian)) in places.into_iter().zip(densities) {
        let leaf = &mut largest[partition.leaf_of(&place)];
        *leaf = leaf.max(density * jacobian);
    }
    largest
}

fn scales(partition: &Partition, leaves: &[Integral], samples: u64) -> Vec<Groups> {
    let masses: Vec<f64> = leaves.iter().map(|leaf| leaf.value).collect();
    let n = samples as f64;
    let mut scales: Vec<Groups> = Vec::new();
    for target in SCALES.into_iter().filter(|&cells| cells <= 1024 || n / cells as f64 >= WORTH) {
        let groups = partition.group(&masses, 1.0 / target as f64, LEAST / n);
        if scales.last().is_none_or(|last| last.cells.len() != groups.cells.len()) {
            scales.push(groups);
        }
    }
    scales
}

/// Lines at the quantiles of the pilots, moved to the nearest knot.
fn lines(probe: &dyn Probe, pilots: &[Location]) -> Vec<Vec<f64>> {
    let space = probe.space();
    let has_atoms = || (0..space.patches()).any(|patch| space.is_atom(patch)); // which lie on no side of a line
    if space.axes() < 2 || space.patches() > LINES_PATCHES || pilots.len() < 64 * LINES || has_atoms() {
        return Vec::new();
    }
    let along = |axis: usize| {
        let mut values: Vec<f64> = pilots.iter().map(|p| p.at[axis]).collect();
        values.sort_by(f64::total_cmp);
        let knots = &probe.knots().axes[axis];
        let mut lines: Vec<f64> = (1..=LINES)
            .map(|i| values[i * values.len() / (LINES + 1)])
            .map(|x| if knots.len() > 1 { crate::domain::nearest(x, knots) } else { x })
            .collect();
        lines.dedup();
        lines.retain(|&x| x > 0.0 && x < 1.0);
        lines
    };
    (0..space.axes()).map(along).collect()
}

/// The mass of all leaves and parts of leaves below a line across an axis.
fn mass_below(
    partition: &Partition,
    leaves: &[Integral],
    axis: usize,
    line: f64,
    part: impl Fn(usize, &Cell) -> Integral,
) -> Integral {
    let mut sum = Integral::default();
    for (leaf, cell) in partition.leaves().iter().enumerate() {
        if cell.high[axis] <= line {
            sum.value += leaves[leaf].value;
            sum.error += leaves[leaf].error;
        } else if cell.low[axis] < line {
            let mut below = cell.clone();
            below.high[axis] = line;
            let part = part(leaf, &below);
            sum.value += part.value;
            sum.error += part.error;
        }
    }
    sum
}

/// Standard errors that a random integral is given.
const SURE: f64 = 3.0;

/// The mass of a leaf, or of a part of it, by random points, and its standard error.
fn at_random(
    probe: &dyn Probe,
    seed: u64,
    points: usize,
    partition: &Partition,
    leaf: usize,
    cell: &Cell,
) -> (f64, f64) {
    let mut rng = stream(seed, "doubt", leaf as u64);
    let mut uniform = || unit_f64(&mut rng);
    let density = |places: &[Location], out: &mut Vec<(f64, f64)>| probe.densities_at(places, out);
    let grading = partition.grading(leaf);
    integrate_at_random(probe.space(), cell, probe.knots(), &grading, &density, points, &mut uniform)
}

/// Where samples of a stream of their own fall.
pub(super) fn locations(probe: &dyn Probe, seed: u64, purpose: &str, count: usize) -> Vec<Location> {
    if let Some(pilots) = probe.pilots() {
        let mut found = Vec::with_capacity(pilots);
        probe.locate(&each_pilot(pilots, pilots), &mut found);
        return found;
    }
    crate::parallel::map(count / SHARD, |shard| {
        let mut rng = stream(seed, purpose, shard as u64);
        let mut xi = vec![0.0; probe.dimensions().max(1) * SHARD];
        fill_unit(&mut rng, &mut xi);
        let mut found = Vec::with_capacity(SHARD);
        probe.locate(&xi, &mut found);
        found
    })
    .concat()
}

/// Integrates the leaves that the edge of a support crosses again, cut so that each piece holds few of many samples.
fn look_again(
    probe: &dyn Probe,
    seed: u64,
    guides: usize,
    partition: &Partition,
    leaves: &mut [Integral],
    integrate: &(dyn Fn(&Partition, usize) -> Integral + Sync),
) {
    let mut in_leaf: HashMap<usize, Vec<Location>> = HashMap::new();
    for location in locations(probe, seed, "guide", guides) {
        let leaf = partition.leaf_of(&location);
        if leaves[leaf].zeros > 0 {
            in_leaf.entry(leaf).or_default().push(location);
        }
    }
    let mut crossed: Vec<(usize, Vec<Location>)> = in_leaf.into_iter().collect();
    crossed.sort_unstable_by_key(|(leaf, _)| *leaf);
    let again = crate::parallel::map(crossed.len(), |i| {
        let (leaf, guides) = &crossed[i];
        let cell = partition.leaves()[*leaf].clone();
        let pieces = Partition::within(probe.space(), cell, guides.clone(), probe.knots(), GUIDES_PER_PIECE);
        (0..pieces.leaves().len())
            .map(|piece| integrate(&pieces, piece))
            .fold(Integral::default(), |a, b| a + b)
    });
    for ((leaf, _), integral) in crossed.into_iter().zip(again) {
        leaves[leaf] = integral;
    }
}

/// Replaces integrals by the masses that the sampler knows exactly, and says where the two contradict each other.
fn take_given_masses(
    probe: &dyn Probe,
    seed: u64,
    partition: &Partition,
    leaves: &mut [Integral],
) -> Option<String> {
    let mut contradiction = None;
    for (leaf, integral) in leaves.iter_mut().enumerate() {
        let cell = &partition.leaves()[leaf];
        let Some(mass) = probe.cell_mass(cell) else { continue };
        let rounding = 1e-9 + 1e-6 * mass;
        let agrees = |value: f64, error: f64| (mass - value).abs() <= error + rounding;
        if contradiction.is_none() && !agrees(integral.value, integral.error) {
            let exact = probe.space().axes() == 0;
            let (again, error) = if exact {
                (integral.value, 0.0)
            } else {
                at_random(probe, seed, MANY, partition, leaf, cell)
            };
            if !agrees(again, SURE * error + (again - integral.value).abs()) {
                let (place, value) = (probe.space().describe(cell), integral.value);
                contradiction = Some(format!(
                    "the sampler gives {place} the mass {mass:e}, its density integrates to {value:e} there"
                ));
            }
        }
        (integral.value, integral.error) = (mass, 0.0);
    }
    contradiction
}

#[cfg(test)]
pub(super) mod told {
    use super::{
        Coarse, Expectation, Integral, Knots, Location, Marginal, Partition, Quick, Resolved, Space, Squares,
    };

    /// Four leaves, quarters along the first axis; 4 pilots in each, an 8th of the leaf from its ends.
    pub fn quarters(space: &dyn Space) -> Partition {
        let place = |x: f64, y: f64| Location { patch: 0, at: [x, y] };
        let of = |leaf: usize| {
            [0.125, 0.375, 0.625, 0.875]
                .map(|x| place((leaf as f64 + x) / 4.0, if space.axes() > 1 { 0.45 + 0.1 * x } else { 0.0 }))
        };
        let knots = Knots { axes: [vec![0.25, 0.5, 0.75], vec![]] };
        Partition::from_pilots(space, (0..4).flat_map(of).collect(), &knots, 4)
    }

    pub fn integral(value: f64, error: f64) -> Integral {
        Integral { value, error, ..Integral::default() }
    }

    /// Quarters of these masses, without scales, and lines across axes where the mass below each is told.
    pub fn expectation(
        space: &dyn Space,
        leaves: [Integral; 4],
        lines: Vec<(usize, Vec<f64>, Vec<Integral>)>,
    ) -> Expectation {
        Expectation {
            partition: quarters(space),
            leaves: leaves.into(),
            total: leaves.into_iter().fold(Integral::default(), |a, b| a + b),
            scales: vec![],
            coarse: Coarse::new(&[], 4),
            quick: None,
            marginals: lines
                .into_iter()
                .map(|(axis, lines, below)| Marginal::new(axis, lines, below))
                .collect(),
            contradiction: None,
            remainders: vec![],
            resolved: vec![],
        }
    }

    /// Squares of which nothing is known.
    pub fn quick() -> Quick {
        let squares = Squares { sides: [1; 2] };
        Quick { squares, of_squares: vec![], classes: vec![], kinds: vec![] }
    }

    /// What is resolved of a leaf, of which only sums are asked.
    pub fn resolved(expected: f64, powers: [f64; 2]) -> Resolved {
        let shares = [1.0 / Resolved::SQUARES as f32; Resolved::SQUARES];
        let (low, size, squares) = ([0.0; 2], [1.0; 2], [4, 4]);
        Resolved { low, size, squares, shares, scale: 1.0, expected, largest: 1.0, powers }
    }

    pub fn resolved_up_to(largest: f64) -> Resolved {
        Resolved { largest, ..resolved(1.0, [1.0; 2]) }
    }

    /// What is resolved of an entry.
    pub fn entry() -> Resolved {
        Resolved { squares: [1, 1], shares: [1.0; Resolved::SQUARES], ..resolved(1.0, [1.0; 2]) }
    }
}

#[cfg(test)]
mod tests {
    use super::told::{integral, quarters};
    use super::*;
    use crate::domain::{Discrete, Interval, Square, WithAtoms};
    use crate::sampler::{Sampler, from_fn};
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::rows::told::Given;
    use crate::verify::{Row, recording};
    use glam::DVec2;

    #[track_caller]
    fn all_near(found: &[f64], expected: &[f64]) {
        let same =
            found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(same, "{found:?}, not {expected:?}");
    }

    fn place(x: f64, y: f64) -> Location {
        Location { patch: 0, at: [x, y] }
    }

    #[test]
    fn what_pilots_show_of_a_leaf() {
        let line = Interval::new(0.0, 8.0);
        let partition = quarters(&line);
        assert_eq!(partition.leaves().len(), 4);
        let weights = [1.0, 2.0, 3.0, 4.0];
        let part = Resolved::new(&line, &partition, 1, &weights).unwrap();
        // The harmonic mean of the densities 1, 1/2, 1/3 and 1/4 is 4/10; the box is 3/16 of 8.
        all_near(&[part.scale, part.expected, part.largest], &[0.4, 0.4 * 1.5, 1.6]);
        all_near(&part.powers, &[0.16 * 30.0, 0.064 * 100.0]);
        assert_eq!((part.squares(), part.squares), (16, [16, 1]));
        all_near(&part.shares.map(f64::from), &[1.0 / 16.0; 16]);
        let (low, size) = (0.25 + 0.125 / 4.0, 0.75 / 4.0);
        let square = |x: f64| part.square(&[x, 0.0]);
        assert_eq!(
            (square(low), square(low + size), square(low + 0.999 * size), square(low + size / 16.0 * 3.5)),
            (Some(0), Some(15), Some(15), Some(3))
        );
        assert_eq!((square(low - 1e-9), square(low + size + 1e-9)), (None, None));
        // A factor of 4 is one magnitude, more is not; nor are fewer than four pilots, no density, or one that is infinite.
        let of = |weights: &[f64]| Resolved::new(&line, &partition, 1, weights).is_some();
        assert!(
            of(&[1.0, 1.0, 1.0, 4.0])
                && !of(&[1.0, 1.0, 1.0, 4.01])
                && of(&[2.0; 4])
                && !of(&[2.0; 3])
                && of(&[2.0; 5])
        );
        assert!(
            !of(&[0.0; 4])
                && !of(&[f64::INFINITY; 4])
                && !of(&[f64::NAN; 4])
                && !of(&[2.0, 2.0, 2.0, f64::NAN])
        );
        // Of a square four by four, unless it is a part that the pilots span: here along a diagonal.
        let partition = quarters(&Square);
        let part = Resolved::new(&Square, &partition, 2, &[2.0; 4]).unwrap();
        all_near(&[part.scale, part.expected, part.largest], &[0.5, 0.5 * (0.75 / 4.0) * 0.075, 1.0]);
        assert_eq!((part.squares, part.squares()), ([4, 4], 16));
        let (low, size) = ([0.5 + 0.125 / 4.0, 0.4625], [0.75 / 4.0, 0.075]);
        let square = |a: f64, b: f64| part.square(&[low[0] + a * size[0], low[1] + b * size[1]]);
        assert_eq!(
            (square(0.1, 0.3), square(0.6, 0.1), square(0.9, 0.9), square(0.3, 0.8)),
            (Some(1), Some(8), Some(15), Some(7))
        );
        assert_eq!(
            (square(0.5, -0.01), square(0.5, 1.01), square(-0.01, 0.5), square(1.01, 0.5)),
            (None, None, None, None)
        );
        all_near(&part.shares.map(f64::from), &[1.0 / 16.0; 16]);
        // Shares are of the measure: on a hemisphere, rows of a chart in theta are unequal.
        let partition = Partition::from_pilots(
            &crate::domain::Hemisphere,
            vec![place(0.25, 0.25), place(0.75, 0.75)],
            &Knots::default(),
            4,
        );
        let part = Resolved::new(&crate::domain::Hemisphere, &partition, 0, &[2.0; 4]).unwrap();
        let sum: f32 = part.shares.iter().sum();
        assert!(
            (sum - 1.0).abs() < 1e-5 && part.shares[0] < part.shares[15] && part.shares[0] == part.shares[3]
        );
        // An entry is resolved by any number of its pilots.
        let entries = Discrete::new(2);
        let pilots = vec![Location { patch: 0, at: [0.0; 2] }, Location { patch: 1, at: [0.0; 2] }];
        let partition = Partition::from_pilots(&entries, pilots, &Knots::default(), 1);
        let part = Resolved::new(&entries, &partition, 1, &[4.0]).unwrap();
        all_near(&[part.scale, part.expected, part.largest], &[0.25, 0.25, 1.0]);
        assert_eq!((part.squares(), part.square(&[0.0; 2])), (1, Some(0)));
    }

    /// Lines at the ends of slices, several in one, and one in the last.
    #[test]
    fn samples_between_lines() {
        let lines = vec![0.1, 0.1001, 0.25, 0.4, 0.999];
        let marginal = Marginal::new(1, lines.clone(), vec![]);
        let mut places = vec![0.0, 0.05, 0.1, 0.100_05, 0.2, 0.3, 0.9, 0.999_999];
        places.extend(lines.iter().flat_map(|line| [line - 1e-16, *line, line + 1e-16]));
        places.extend((0..=SLICES).map(|k| k as f64 / SLICES as f64));
        for x in places.into_iter().filter(|x| *x <= 1.0) {
            assert_eq!(marginal.slab(x), lines.iter().filter(|&&line| line <= x).count(), "{x}");
        }
    }

    /// Of squares that lie in one leaf and that no line cuts a sample's leaf, class and slabs are known, where three quarters of the pilots lie in such.
    #[test]
    fn what_squares_tell() {
        let rows: Vec<[f64; 2]> =
            (0..512).map(|i| [i / 8 % 8, i % 8].map(|k| (f64::from(k) + 0.3) / 8.0)).collect();
        let row = |n: &[f64]| Row { point: Some(DVec2::new(n[0], n[1])), density: None, weight: None };
        let partition = quarters(&Square);
        let scale = Groups {
            of_leaf: vec![Some(1), None, Some(0), Some(1)],
            cells: vec![Cell { patches: 0..1, low: [0.0; 2], high: [1.0; 2] }; 2],
        };
        let coarse = Coarse::new(&[scale], 4);
        let quick = |lines: [f64; 2], positive_from: f64| {
            let record = recording(Square, Given(rows.clone().into_iter()), row).unwrap();
            let record = record.density(|_| 1.0).positive_over(move |cell| cell.low[0] >= positive_from);
            let marginals = [0, 1].map(|axis| Marginal::new(axis, vec![lines[axis]], vec![]));
            Quick::new(&record, &partition, &coarse, &marginals)
        };
        for (lines, positive_from) in [([0.3, 0.5], 0.0), ([0.5, 0.7], 0.0), ([0.5, 0.75], 0.25)] {
            let quick = quick(lines, positive_from).unwrap();
            assert_eq!((quick.squares.sides, quick.of_squares.len()), ([4, 4], 16));
            for square in 0..16 {
                let low = [square / 4, square % 4].map(|k| f64::from(k) / 4.0);
                let is_cut = (0..2).any(|axis| low[axis] < lines[axis] && lines[axis] < low[axis] + 0.25);
                let kind = quick.kind(square);
                assert_eq!(kind == UNKNOWN, is_cut || low[0] < positive_from, "{square}");
                if kind != UNKNOWN {
                    let leaf = square as usize / 4;
                    let slabs = [0, 1].map(|axis| u8::from(low[axis] >= lines[axis]));
                    assert_eq!(quick.kinds[usize::from(kind)], Kind { leaf, slabs });
                    assert_eq!(quick.classes[usize::from(kind)], [1, 2, 0, 1][leaf]);
                }
            }
        }
        // Less than that isn't worth it.
        for (lines, positive_from) in
            [([0.3, 0.6], 0.0), ([0.5, 0.5], 0.5), ([0.5, 0.7], 0.25), ([0.5, 0.5], 1.0)]
        {
            assert!(quick(lines, positive_from).is_none());
        }
    }

    #[test]
    fn cells_of_both_coarse_scales() {
        let groups = |of_leaf: [Option<usize>; 3], cells: usize| Groups {
            of_leaf: of_leaf.into(),
            cells: vec![Cell { patches: 0..1, low: [0.0; 2], high: [1.0; 2] }; cells],
        };
        let scales =
            [groups([Some(0), Some(0), None], 1), groups([Some(0), Some(1), None], 2), groups([None; 3], 0)];
        let coarse = Coarse::new(&scales, 3);
        assert_eq!(coarse.cells, [[Some(0), Some(0)], [Some(0), Some(1)], [None, None]]);
        assert_eq!(coarse.scales.len(), 2);
        let notes = [0, 1, 2].map(|leaf| coarse.note(leaf));
        let notes = notes.map(|note| (note.cell(), note.class()));
        assert_eq!(notes, [(0, 0), (1, 0), (2, 1)]);
        let alike = Coarse::new(&scales[..1], 3);
        assert_eq!((alike.cells.as_slice(), alike.note(1).cell()), (&[[Some(0), None], [None, None]][..], 0));
    }

    #[test]
    fn mass_below_a_line() {
        let partition = quarters(&Interval::new(0.0, 1.0));
        let leaves = [integral(0.1, 0.001), integral(0.2, 0.002), integral(0.3, 0.004), integral(0.4, 0.008)];
        let asked = std::cell::RefCell::new(Vec::new());
        let below = |line: f64| {
            let part = |leaf: usize, cell: &Cell| {
                asked.borrow_mut().push((leaf, cell.low, cell.high));
                integral(0.05, 0.016)
            };
            let found = mass_below(&partition, &leaves, 0, line, part);
            (found.value, found.error)
        };
        let near = |(a, b): (f64, f64), c: f64, d: f64| all_near(&[a, b], &[c, d]);
        near(below(0.5), 0.3, 0.003);
        near(below(0.0), 0.0, 0.0);
        near(below(1.0), 1.0, 0.015);
        assert!(asked.borrow().is_empty());
        near(below(0.6), 0.35, 0.019);
        assert_eq!(*asked.borrow(), [(2, [0.5, 0.0], [0.6, 1.0])]);
    }

    #[test]
    fn lines_lie_at_quantiles_of_pilots() {
        let extras = Extras::default();
        let square =
            |knots: Knots| from_fn(Square, |xi: [f64; 2]| DVec2::from(xi), |_: DVec2| 1.0).with_knots(knots);
        let plain = square(Knots::default());
        let pilots = |count: usize| {
            (0..count)
                .map(|i| place(i as f64 / count as f64, (i * 11 % count) as f64 / count as f64))
                .collect::<Vec<_>>()
        };
        let few = lines(&Subject::new(&plain, &extras), &pilots(1279));
        assert!(few.is_empty());
        let all = lines(&Subject::new(&plain, &extras), &pilots(2100));
        let expected: Vec<f64> = (1..=20).map(|i| f64::from(i) / 21.0).collect();
        assert_eq!(all.len(), 2);
        all_near(&all[0], &expected);
        all_near(&all[1], &expected);
        // Moved to the nearest knot, each once; a single one moves none.
        let grid = lines(&Subject::new(&square(Knots::grid(4, 2)), &extras), &pilots(2100));
        all_near(&grid[0], &[0.25, 0.5, 0.75]);
        all_near(&grid[1], &expected);
        // None at the ends.
        let clamped: Vec<Location> = (0..2100)
            .map(|i| {
                place(
                    if i < 300 {
                        0.0
                    } else if i < 2000 {
                        i as f64 / 2100.0
                    } else {
                        1.0
                    },
                    0.5,
                )
            })
            .collect();
        let kept = lines(&Subject::new(&plain, &extras), &clamped);
        assert!(kept[0].len() == 17 && kept[1] == [0.5], "{kept:?}");
        let on_a_line = Extras::default();
        // Not on an interval, nor where there are atoms, which lie on no side.
        let interval = from_fn(Interval::new(0.0, 1.0), |u: f64| u, |_: f64| 1.0);
        assert!(lines(&Subject::new(&interval, &on_a_line), &pilots(2100)).is_empty());
        let atoms = from_fn(
            WithAtoms::new(Square, 1),
            |xi: [f64; 2]| crate::domain::Mixed::Continuous(DVec2::from(xi)),
            |_: crate::domain::Mixed<DVec2>| 1.0,
        );
        let extras = Extras::default();
        assert!(lines(&Subject::new(&atoms, &extras), &pilots(2100)).is_empty());
        let mesh = |patches: usize| {
            let domain = crate::domain::MeshSurface::from_areas(vec![1.0; patches]);
            let point = move |xi: [f64; 2]| crate::domain::SurfacePoint {
                triangle: 0,
                barycentric: glam::DVec3::new(xi[0], 0.0, 1.0 - xi[0]),
            };
            let sampler = from_fn(domain, point, |_: crate::domain::SurfacePoint| 1.0);
            let extras = Extras::default();
            lines(&Subject::new(&sampler, &extras), &pilots(2100)).len()
        };
        assert_eq!((mesh(8), mesh(9)), (2, 0));
    }

    /// A density of 2 x, less a fifth that is rejected: integrals, masses of scales, and what is left to rejected samples.
    #[test]
    fn masses_of_an_interval() {
        let sampler = from_fn(
            Interval::new(0.0, 1.0),
            |u: f64| (u < 0.8).then_some((u / 0.8).sqrt()),
            |x: f64| 1.6 * x,
        );
        let extras = Extras::default();
        let probe = Subject::new(&sampler, &extras);
        let mut expectation = Expectation::new(&probe, 1, 100_000);
        let leaves = expectation.partition.leaves().to_vec();
        assert!(leaves.len() > 1024);
        for (cell, leaf) in leaves.iter().zip(&expectation.leaves) {
            assert!(
                (leaf.value - 0.8 * (cell.high[0].powi(2) - cell.low[0].powi(2))).abs() <= leaf.error + 1e-12
            );
        }
        all_near(&[expectation.total.value, expectation.rejected().value], &[0.8, 0.2]);
        assert_eq!(expectation.rejected().error, expectation.total.error + 1e-6);
        // 16 cells, 48, 192 and 1024 at least, and no finer ones of 100 samples.
        assert_eq!(expectation.scales.len(), 4);
        for (scale, target) in expectation.scales.iter().zip([16, 48, 192, 1024]) {
            let (masses, pool) = expectation.masses_at(scale);
            let sum: f64 = masses.iter().map(|m| m.value).sum();
            assert!(masses.len() > target / 2 && masses.len() < 2 * target);
            let (least, most) =
                masses.iter().fold((1.0_f64, 0.0_f64), |(a, b), m| (a.min(m.value), b.max(m.value)));
            // Leaves are not cut, however heavy.
            let most_of_all = if target == 1024 { 2.0 } else { 1.0 } / target as f64;
            assert!(most <= most_of_all && least >= 8e-5, "{least} {most} {target}");
            all_near(&[sum + pool.value], &[0.8]);
        }
        let errors = expectation.errors();
        let before: Vec<f64> = expectation.leaves.iter().map(|l| l.error).collect();
        expectation.doubt(&probe, 1, 64);
        assert!(
            expectation.leaves.iter().zip(&before).all(|(l, b)| l.error > *b)
                && expectation.total.error > errors.total
        );
        // Three standard errors of a leaf by so many points, and what the two are apart.
        let at = |leaf: usize| at_random(&probe, 1, 64, &expectation.partition, leaf, &leaves[leaf]);
        let (mut value, mut variance) = (0.0, 0.0);
        for (i, leaf) in expectation.leaves.iter().enumerate() {
            let (mass, error) = at(i);
            all_near(&[leaf.error], &[((leaf.value - mass).abs() + 3.0 * error).max(before[i])]);
            (value, variance) = (value + mass, variance + error * error);
        }
        all_near(
            &[expectation.total.error],
            &[((0.8 - value).abs() + 3.0 * variance.sqrt()).max(errors.total)],
        );
        expectation.reset(&errors);
        assert!(
            expectation.leaves.iter().zip(&before).all(|(l, b)| l.error == *b)
                && expectation.total.error == errors.total
        );
    }

    /// Where densities come with the samples and nobody can be asked: shares of the pilots, and the harmonic mean of their densities.
    #[test]
    fn what_pilots_alone_say() {
        let rows: Vec<[f64; 2]> =
            (0..512).map(|i| [f64::from(i * 37 % 512) / 512.0, f64::from(1 + i % 3)]).collect();
        let row = |n: &[f64]| Row { point: Some(n[0]), density: Some(n[1]), weight: None };
        let record = recording(Interval::new(0.0, 1.0), Given(rows.clone().into_iter()), row).unwrap();
        let expectation = Expectation::new(&record, 1, 448);
        assert!(expectation.leaves.len() > 3 && expectation.resolved.len() == expectation.leaves.len());
        for (leaf, (mass, part)) in expectation.leaves.iter().zip(&expectation.resolved).enumerate() {
            // An eighth of the rows are pilots.
            let lies_there = |row: &&[f64; 2]| expectation.partition.leaf_of(&place(row[0], 0.0)) == leaf;
            let pilots: Vec<f64> = rows[..64].iter().filter(lies_there).map(|row| row[1]).collect();
            let count = pilots.len() as f64;
            let scale = count / pilots.iter().map(|density| 1.0 / density).sum::<f64>();
            all_near(&[mass.value, part.unwrap().scale], &[count / 64.0, scale]);
        }
    }

    /// What errors of all masses may add to a statistic of chi-square is small against its spread, however many samples there are.
    #[test]
    fn masses_are_as_good_as_samples_are_many() {
        let rows: Vec<[f64; 1]> = (0..512).map(|i| [f64::from(i * 37 % 512) / 512.0]).collect();
        let row = |n: &[f64]| Row { point: Some(n[0]), density: None, weight: None };
        let record = recording(Interval::new(0.0, 1.0), Given(rows.into_iter()), row).unwrap();
        // Jumps that nobody named, in some of the leaves.
        let record = record.density(|x| if (3.7 * x).fract() < 0.5 { 0.5 } else { 1.5 });
        for samples in [1_000_000, 10_000_000_000] {
            let masses = Expectation::new(&record, 1, samples).leaves;
            let slack = masses.iter().map(|leaf| samples as f64 * leaf.error.powi(2) / leaf.value);
            let slack: f64 = slack.sum();
            assert!(slack > 0.0 && slack <= 0.25, "{samples}: {slack}");
        }
    }

    /// Beyond a million samples one in 64 of them is a pilot, and of 8 pilots a leaf is made.
    #[test]
    fn more_samples_have_more_pilots() {
        let sampler = from_fn(Interval::new(0.0, 1.0), |u: f64| u, |_: f64| 1.0);
        let extras = Extras::default();
        let leaves = Expectation::new(&Subject::new(&sampler, &extras), 1, 3 << 19).leaves.len();
        assert!(leaves >= 3 << 10, "{leaves}");
    }

    /// A line is as doubtful as the whole and the leaves that it cuts.
    #[test]
    fn doubts_of_lines() {
        let sampler = from_fn(Square, |xi: [f64; 2]| DVec2::from(xi), |_: DVec2| 1.0);
        let extras = Extras::default();
        let leaves = [0.001, 0.002, 0.004, 0.008].map(|error| integral(0.25, error));
        let lines = vec![
            (0, vec![0.25, 0.6], vec![integral(0.25, 0.0), integral(0.6, 0.0)]),
            (1, vec![0.3, 0.7], vec![integral(0.3, 0.0), integral(0.7, 0.1)]),
        ];
        let mut expectation = told::expectation(&Square, leaves, lines);
        // Random points of a constant density give its integral, so that no leaf is doubted.
        expectation.doubt(&Subject::new(&sampler, &extras), 1, 64);
        let errors = expectation.errors();
        all_near(&errors.leaves, &[0.001, 0.002, 0.004, 0.008]);
        // Between leaves, through one, through all.
        all_near(&errors.below[0], &[0.015, 0.019]);
        all_near(&errors.below[1], &[0.03, 0.1]);
    }

    /// Per chart area: an interval of length 4 has four times its density.
    #[test]
    fn densest_samples_of_leaves() {
        let sampler = from_fn(Interval::new(0.0, 4.0), |u: f64| 4.0 * u, |x: f64| x / 8.0);
        let extras = Extras::default();
        let largest = largest_at_samples(&Subject::new(&sampler, &extras), 1, &quarters(&sampler.domain()));
        for (found, expected) in largest.iter().zip([0.5, 1.0, 1.5, 2.0]) {
            assert!((0.99 * expected..=expected).contains(found), "{largest:?}");
        }
        // Nothing is known of where no sample falls.
        let half = from_fn(Interval::new(0.0, 4.0), |u: f64| 2.0 * u, |_: f64| 0.5);
        let largest = largest_at_samples(&Subject::new(&half, &extras), 1, &quarters(&half.domain()));
        assert_eq!(largest, [2.0, 2.0, 0.0, 0.0]);
    }

    /// Leaves in which the density was 0 here and there, and those alone, are integrated again in pieces of few samples.
    #[test]
    fn edges_of_supports_are_looked_at_again() {
        let sampler = from_fn(Interval::new(0.0, 1.0), |u: f64| u, |_: f64| 1.0);
        let extras = Extras::default();
        let probe = Subject::new(&sampler, &extras);
        let partition = quarters(&sampler.domain());
        let crossed = |zeros: u64| Integral { zeros, ..integral(9.0, 0.0) };
        let mut leaves = [crossed(0), crossed(5), crossed(0), crossed(1)];
        let width = |pieces: &Partition, piece: usize| {
            let cell = &pieces.leaves()[piece];
            integral(cell.high[0] - cell.low[0], 1.0)
        };
        look_again(&probe, 1, 1 << 13, &partition, &mut leaves, &width);
        for leaf in [0, 2] {
            assert_eq!(leaves[leaf], crossed(0));
        }
        // A quarter of the samples lies in each, and 4 of them make a piece.
        for leaf in [1, 3] {
            all_near(&[leaves[leaf].value], &[0.25]);
            assert!(leaves[leaf].error > 400.0 && leaves[leaf].error < 1200.0, "{:?}", leaves[leaf]);
        }
    }
}
