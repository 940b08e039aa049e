//! Where the mass is: cells from pilot samples, and the mass of every cell by quadrature of the density.
//!
//! Quadrature sees a peak because the cells follow the pilots. What it can still miss is a sliver of a support that ends inside a cell (the
//! far corner of a lamp seen at a grazing angle). So cells in which the density is 0 here and positive there are cut again by many more samples,
//! and what even those may have missed is added to the error of the total. None of these samples are the ones that are judged.

use crate::domain::{Domain, Integral, Integrator, Knots, Location, Partition};
use crate::random::{fill_unit, stream};
use crate::sampler::Sampler;
use std::collections::HashMap;

const PILOTS: usize = 1 << 14;
const PILOTS_PER_LEAF: usize = 8;
const SHARD: usize = 1 << 11;
/// Samples that look for slivers, at least and at most; as a share of those that are judged between.
const GUIDES: [usize; 2] = [1 << 17, 1 << 22];
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
}

impl Expectation {
    /// For `samples` samples to be judged.
    pub(super) fn new<S: Sampler>(sampler: &S, seed: u64, samples: u64) -> Self {
        let (domain, knots) = (sampler.domain(), sampler.knots());
        let pilots = locations(sampler, seed, "pilot", PILOTS);
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
            let guides = (samples / GUIDES_SHARE).clamp(GUIDES[0] as u64, GUIDES[1] as u64) as usize;
            look_again(sampler, seed, guides, &knots, &partition, &mut leaves, &integrate);
            unseen = UNSEEN / guides as f64;
        }
        let contradiction = take_given_masses(sampler, &partition, &mut leaves);
        let mut total = leaves.iter().copied().fold(Integral::default(), |a, b| a + b);
        total.error += unseen;
        Self { partition, leaves, total, contradiction }
    }

    pub(super) fn masses(&self) -> Vec<f64> {
        self.leaves.iter().map(|leaf| leaf.value).collect()
    }
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
    partition: &Partition,
    leaves: &mut [Integral],
) -> Option<String> {
    let mut contradiction = None;
    for (integral, cell) in leaves.iter_mut().zip(partition.leaves()) {
        let Some(mass) = sampler.cell_mass(cell) else { continue };
        let agrees = (mass - integral.value).abs() <= integral.error + 1e-9 + 1e-6 * mass;
        if !agrees && contradiction.is_none() {
            let (place, value) = (sampler.domain().describe(cell), integral.value);
            contradiction = Some(format!(
                "the sampler gives {place} the mass {mass:e}, its density integrates to {value:e} there"
            ));
        }
        (integral.value, integral.error) = (mass, 0.0);
    }
    contradiction
}
