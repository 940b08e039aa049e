//! Where the mass is: cells from pilot samples, and the mass of every cell by quadrature of the density.

use crate::domain::{Domain, Integral, Integrator, Location, Partition};
use crate::random::{fill_unit, stream};
use crate::sampler::Sampler;

const PILOTS: usize = 1 << 14;
const PILOTS_PER_LEAF: usize = 8;
const PILOT_SHARD: usize = 1 << 11;

/// The cells of a sampler's domain, and what its density says of them.
pub(super) struct Expectation {
    pub partition: Partition,
    /// Mass of each leaf, and its error.
    pub leaves: Vec<Integral>,
    /// Sum over the leaves.
    pub total: Integral,
    /// The largest difference between a mass that the sampler gave and quadrature of its density, in units of what their errors allow,
    /// and what it was about.
    pub contradiction: Option<String>,
}

impl Expectation {
    pub(super) fn new<S: Sampler>(sampler: &S, seed: u64) -> Self {
        let (domain, knots) = (sampler.domain(), sampler.knots());
        let pilots: Vec<Location> = crate::parallel::map(PILOTS / PILOT_SHARD, |shard| {
            let mut rng = stream(seed, "pilot", shard as u64);
            let mut xi = vec![0.0; sampler.dimensions()];
            (0..PILOT_SHARD)
                .filter_map(|_| {
                    fill_unit(&mut rng, &mut xi);
                    domain.locate(&sampler.sample(&xi)?.point).ok()
                })
                .collect::<Vec<_>>()
        })
        .concat();
        let per_leaf = if domain.axes() == 0 { 1 } else { PILOTS_PER_LEAF };
        let partition = Partition::from_pilots(&domain, pilots, &knots, per_leaf);
        // A part in 1e4 of each cell cannot be seen below 1e9 samples; the errors are carried along all the same.
        let integrator =
            Integrator { relative_tolerance: 1e-4, absolute_tolerance: 1e-9, max_evaluations: 20_000 };
        let integrals = crate::parallel::map(partition.leaves().len(), |leaf| {
            let (cell, grading) = (&partition.leaves()[leaf], partition.grading(leaf));
            integrator.integrate_graded(&domain, cell, &knots, &grading, |p| sampler.density(p))
        });
        let mut contradiction = None;
        let leaves: Vec<Integral> = integrals
            .into_iter()
            .zip(partition.leaves())
            .map(|(integral, cell)| match sampler.cell_mass(cell) {
                None => integral,
                Some(mass) => {
                    let difference = (mass - integral.value).abs();
                    if !(difference <= integral.error + 1e-9 + 1e-6 * mass) {
                        contradiction.get_or_insert_with(|| {
                            format!(
                                "the sampler gives {} the mass {mass:e}, its density integrates to {:e} there",
                                domain.describe(cell),
                                integral.value
                            )
                        });
                    }
                    Integral { value: mass, error: 0.0, ..integral }
                }
            })
            .collect();
        let total = leaves.iter().fold(Integral::default(), |a, b| Integral {
            value: a.value + b.value,
            error: a.error + b.error,
            evaluations: a.evaluations + b.evaluations,
        });
        Self { partition, leaves, total, contradiction }
    }

    pub(super) fn masses(&self) -> Vec<f64> {
        self.leaves.iter().map(|leaf| leaf.value).collect()
    }
}
