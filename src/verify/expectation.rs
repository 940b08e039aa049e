//! Where the mass is: cells from pilot samples, and the mass of every cell by quadrature of the density.
//!
//! Quadrature sees a peak because the cells follow the pilots. What it can still miss is a sliver of a support that ends inside a cell (the
//! far corner of a lamp seen at a grazing angle). So cells in which the density is 0 here and positive there are cut again by many more samples,
//! and what even those may have missed is added to the error of the total. None of these samples are the ones that are judged.

use crate::domain::{Domain, Integral, Integrator, Knots, Location, Partition, integrate_at_random};
use crate::random::{fill_unit, stream, unit_f64};
use crate::sampler::{PointOf, Sampler};
use std::collections::HashMap;

/// Pilot samples, at least and at most; as a share of the samples that are judged between, so that more samples make finer cells.
const PILOTS: [u64; 2] = [1 << 14, 1 << 18];
const PILOTS_SHARE: u64 = 64;
const PILOTS_PER_LEAF: usize = 8;
const SHARD: usize = 1 << 11;
/// Samples that look for slivers, at least and at most; as a share of those that are judged between.
const GUIDES: [u64; 2] = [1 << 17, 1 << 22];
const GUIDES_SHARE: u64 = 8;
const GUIDES_PER_PIECE: usize = 4;
/// A place without any of N samples holds more than this over N with probability e^-8.
const UNSEEN: f64 = 8.0;

/// The cells of a sampler's domain, and what its density says of them.
pub(super) struct Expectation {
    pub partition: Partition,
    /// Mass of each leaf, and its error.
    pub leaves: Vec<Integral>,
    /// Sum over the leaves.
    pub total: Integral,
    /// Where a mass that the sampler gave is not the integral of its density.
    pub contradiction: Option<String>,
    /// Of a discrete domain: the mass of the entries whose index leaves each remainder, for each of [`MODULI`].
    pub remainders: Vec<Vec<f64>>,
}

/// Entries that lie between each other share cells; those of one remainder do not.
pub(super) const MODULI: [usize; 2] = [64, 61];

impl Expectation {
    /// For `samples` samples to be judged.
    pub(super) fn new<S: Sampler>(sampler: &S, seed: u64, samples: u64) -> Self {
        let (domain, knots) = (sampler.domain(), sampler.knots());
        let pilots = (samples / PILOTS_SHARE).clamp(PILOTS[0], PILOTS[1]);
        let pilots = locations(sampler, seed, "pilot", pilots as usize);
        let per_leaf = if domain.axes() == 0 { 1 } else { PILOTS_PER_LEAF };
        let partition = Partition::from_pilots(&domain, pilots, &knots, per_leaf);
        // An error t of all cells, at worst, adds n t^2 to the chi-square statistic: keep that well below its spread.
        let relative_tolerance = (0.5 / (samples as f64).sqrt()).clamp(1e-6, 1e-3);
        let integrator = Integrator { relative_tolerance, absolute_tolerance: 1e-9, max_evaluations: 20_000 };
        let integrate = |partition: &Partition, leaf: usize| {
            let (cell, grading) = (&partition.leaves()[leaf], partition.grading(leaf));
            integrator.integrate_graded(&domain, cell, &knots, &grading, |p| sampler.density(p))
        };
        let mut leaves = crate::parallel::map(partition.leaves().len(), |leaf| integrate(&partition, leaf));
        let mut unseen = 0.0;
        if leaves.iter().any(|leaf| leaf.zeros > 0) {
            let guides = (samples / GUIDES_SHARE).clamp(GUIDES[0], GUIDES[1]) as usize;
            look_again(sampler, seed, guides, &knots, &partition, &mut leaves, &integrate);
            unseen = UNSEEN / guides as f64;
        }
        let contradiction = take_given_masses(sampler, seed, &knots, &partition, &mut leaves);
        let mut total = leaves.iter().copied().fold(Integral::default(), |a, b| a + b);
        total.error += unseen;
        let mut remainders = Vec::new();
        if domain.axes() == 0 && domain.patches() > PILOTS[0] as usize / 16 {
            remainders = MODULI.map(|modulus| vec![0.0; modulus]).into();
            for entry in 0..domain.patches() {
                let mass = sampler.density(&domain.point(entry, [0.0; 2]).0);
                remainders
                    .iter_mut()
                    .zip(MODULI)
                    .for_each(|(masses, modulus)| masses[entry % modulus] += mass);
            }
        }
        Self { partition, leaves, total, contradiction, remainders }
    }

    /// Before anybody fails: integrates every leaf again by random points, and widens each error to what the two disagree about. The error
    /// estimate of a quadrature rule is no bound where the integrand keeps step with the nodes, or has more edges than there are nodes.
    pub(super) fn doubt<S: Sampler>(&mut self, sampler: &S, seed: u64) {
        let domain = sampler.domain();
        if domain.axes() == 0 {
            return; // sums are exact
        }
        let knots = sampler.knots();
        let again = crate::parallel::map(self.leaves.len(), |leaf| {
            at_random(sampler, seed, &knots, &self.partition, leaf)
        });
        let (mut value, mut variance) = (0.0, 0.0);
        for (leaf, (mass, error)) in self.leaves.iter_mut().zip(again) {
            leaf.error = leaf.error.max((leaf.value - mass).abs() + SURE * error);
            value += mass;
            variance += error * error;
        }
        self.total.error = self.total.error.max((self.total.value - value).abs() + SURE * variance.sqrt());
    }

    pub(super) fn masses(&self) -> Vec<f64> {
        self.leaves.iter().map(|leaf| leaf.value).collect()
    }
}

/// Standard errors that a random integral is given.
const SURE: f64 = 3.0;

/// The mass of a leaf by random points, and its standard error.
fn at_random<S: Sampler>(
    sampler: &S,
    seed: u64,
    knots: &Knots,
    partition: &Partition,
    leaf: usize,
) -> (f64, f64) {
    let mut rng = stream(seed, "doubt", leaf as u64);
    let (cell, grading) = (&partition.leaves()[leaf], partition.grading(leaf));
    let (density, mut uniform) = (|p: &PointOf<S>| sampler.density(p), || unit_f64(&mut rng));
    integrate_at_random(&sampler.domain(), cell, knots, &grading, &density, &mut uniform)
}

/// Where samples of a stream of their own fall.
fn locations<S: Sampler>(sampler: &S, seed: u64, purpose: &str, count: usize) -> Vec<Location> {
    let domain = sampler.domain();
    crate::parallel::map(count / SHARD, |shard| {
        let mut rng = stream(seed, purpose, shard as u64);
        let mut xi = vec![0.0; sampler.dimensions()];
        (0..SHARD)
            .filter_map(|_| {
                fill_unit(&mut rng, &mut xi);
                domain.locate(&sampler.sample(&xi)?.point).ok()
            })
            .collect::<Vec<_>>()
    })
    .concat()
}

/// Integrates the leaves that the edge of a support crosses again, cut so that each piece holds few of many samples.
fn look_again<S: Sampler>(
    sampler: &S,
    seed: u64,
    guides: usize,
    knots: &Knots,
    partition: &Partition,
    leaves: &mut [Integral],
    integrate: &(impl Fn(&Partition, usize) -> Integral + Sync),
) {
    let domain = sampler.domain();
    let mut in_leaf: HashMap<usize, Vec<Location>> = HashMap::new();
    for location in locations(sampler, seed, "guide", guides) {
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
        let pieces = Partition::within(&domain, cell, guides.clone(), knots, GUIDES_PER_PIECE);
        (0..pieces.leaves().len())
            .map(|piece| integrate(&pieces, piece))
            .fold(Integral::default(), |a, b| a + b)
    });
    for ((leaf, _), integral) in crossed.into_iter().zip(again) {
        leaves[leaf] = integral;
    }
}

/// Replaces integrals by the masses that the sampler knows exactly, and says where the two contradict each other.
fn take_given_masses<S: Sampler>(
    sampler: &S,
    seed: u64,
    knots: &Knots,
    partition: &Partition,
    leaves: &mut [Integral],
) -> Option<String> {
    let mut contradiction = None;
    for (leaf, integral) in leaves.iter_mut().enumerate() {
        let cell = &partition.leaves()[leaf];
        let Some(mass) = sampler.cell_mass(cell) else { continue };
        let rounding = 1e-9 + 1e-6 * mass;
        let agrees = |value: f64, error: f64| (mass - value).abs() <= error + rounding;
        if contradiction.is_none() && !agrees(integral.value, integral.error) {
            let exact = sampler.domain().axes() == 0;
            let (again, error) =
                if exact { (integral.value, 0.0) } else { at_random(sampler, seed, knots, partition, leaf) };
            if !agrees(again, SURE * error + (again - integral.value).abs()) {
                let (place, value) = (sampler.domain().describe(cell), integral.value);
                contradiction = Some(format!(
                    "the sampler gives {place} the mass {mass:e}, its density integrates to {value:e} there"
                ));
            }
        }
        (integral.value, integral.error) = (mass, 0.0);
    }
    contradiction
}
