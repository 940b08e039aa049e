//! Draws the samples and counts them: per cell, rejected, outside of the domain, without density.
//!
//! Samples are drawn in shards of fixed size, each from its own stream, and merged in order: the same seed gives the same counts on any
//! number of threads.

use super::expectation::MODULI;
use super::settings::{Drawn, Settings};
use crate::domain::{Domain, Partition};
use crate::random::{fill_unit, stream};
use crate::sampler::{Sample, Sampler};

const SHARD: u64 = 1 << 14;
/// Shards between two looks at the clock; also what bounds the memory.
const BATCH: u64 = 64;
/// In this many first shards the density is asked again at every sample's point, later at each one in [`ASKED_RARELY`].
const ASKED_ALWAYS: u64 = 4;
const ASKED_RARELY: u64 = 16;
/// Rounding may move a sample on the border of the support this far beyond it.
const BORDER: f64 = 1e-6;

/// A sample with something wrong with it.
#[derive(Clone, Debug)]
pub(super) struct Offence {
    pub xi: Vec<f64>,
    pub what: String,
}

/// How many samples had one kind of fault, and the first of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Offences {
    pub count: u64,
    pub first: Option<Offence>,
}

impl Offences {
    fn add(&mut self, xi: &[f64], what: impl FnOnce() -> String) {
        self.count += 1;
        self.first.get_or_insert_with(|| Offence { xi: xi.to_vec(), what: what() });
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

#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    pub samples: u64,
    pub per_leaf: Vec<u64>,
    /// Samples by the remainder of their index, for each of [`MODULI`].
    pub remainders: [Vec<u64>; 2],
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
    fn empty(leaves: usize) -> Self {
        Self { per_leaf: vec![0; leaves], remainders: MODULI.map(|m| vec![0; m]), ..Self::default() }
    }

    fn merge(&mut self, other: Self) {
        self.samples += other.samples;
        let mine = self.per_leaf.iter_mut().chain(self.remainders.iter_mut().flatten());
        mine.zip(other.per_leaf.iter().chain(other.remainders.iter().flatten())).for_each(|(a, b)| *a += b);
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
}

/// Draws `settings.samples` samples, or fewer if stopped.
pub(super) fn draw<S: Sampler>(sampler: &S, partition: &Partition, settings: &Settings) -> Tally {
    let leaves = partition.leaves().len();
    let mut total = Tally::empty(leaves);
    let shards = settings.samples.div_ceil(SHARD);
    let mut next = 0;
    while next < shards && !(settings.stopped() && next > 0) {
        let batch = BATCH.min(shards - next);
        let tallies = crate::parallel::map(batch as usize, |i| {
            let shard = next + i as u64;
            let count = SHARD.min(settings.samples - shard * SHARD);
            draw_shard(sampler, partition, settings.seed, shard, count)
        });
        tallies.into_iter().for_each(|t| total.merge(t));
        next += batch;
        if let Some(progress) = &settings.progress {
            progress(Drawn { samples: total.samples, of: settings.samples });
        }
    }
    total
}

fn draw_shard<S: Sampler>(sampler: &S, partition: &Partition, seed: u64, shard: u64, count: u64) -> Tally {
    let domain = sampler.domain();
    let discrete = domain.axes() == 0;
    let mut rng = stream(seed, "verify", shard);
    let mut xi = vec![0.0; sampler.dimensions()];
    let mut tally = Tally { samples: count, ..Tally::empty(partition.leaves().len()) };
    for i in 0..count {
        fill_unit(&mut rng, &mut xi);
        let Some(sample) = sampler.sample(&xi) else {
            tally.rejected += 1;
            continue;
        };
        match domain.locate(&sample.point) {
            Ok(location) => {
                tally.per_leaf[partition.leaf_of(&location)] += 1;
                if discrete {
                    tally
                        .remainders
                        .iter_mut()
                        .zip(MODULI)
                        .for_each(|(counts, m)| counts[location.patch % m] += 1);
                }
            }
            Err(why) => {
                tally.outside.add(&xi, || format!("the point {why}"));
                continue;
            }
        }
        let density = sample.density;
        if !(density.is_finite() && density >= 0.0) {
            tally.invalid.add(&xi, || format!("the density at {:?} is {density}", sample.point));
        } else if density == 0.0 {
            if has_density_nearby(sampler, &domain, &sample) {
                tally.on_border += 1;
            } else {
                tally.unsupported.add(&xi, || format!("the density at {:?} is 0", sample.point));
            }
        } else if shard < ASKED_ALWAYS || i % ASKED_RARELY == 0 {
            ask_again(sampler, &domain, &sample, &xi, &mut tally);
        }
    }
    tally
}

fn has_density_nearby<S: Sampler>(
    sampler: &S,
    domain: &S::Domain,
    sample: &Sample<<S::Domain as Domain>::Point>,
) -> bool {
    domain.neighbours(&sample.point, BORDER).iter().any(|p| sampler.density(p) > 0.0)
}

/// Compares the density returned with the density asked at the same point. Where they differ by more than 1e-4, the densities a
/// rounding away say how much of it the rounding of the point explains.
fn ask_again<S: Sampler>(
    sampler: &S,
    domain: &S::Domain,
    sample: &Sample<<S::Domain as Domain>::Point>,
    xi: &[f64],
    tally: &mut Tally,
) {
    tally.disagreement.asked += 1;
    let (returned, asked) = (sample.density, sampler.density(&sample.point));
    if !(asked.is_finite() && asked >= 0.0) {
        tally.invalid.add(xi, || format!("asked for the density at {:?}, it says {asked}", sample.point));
        return;
    }
    if asked == 0.0 {
        if has_density_nearby(sampler, domain, sample) {
            tally.on_border += 1;
        } else {
            tally.unsupported.add(xi, || format!("asked for the density at {:?}, it says 0", sample.point));
        }
        return;
    }
    let slack = 1e-4 * returned;
    if (returned - asked).abs() <= slack {
        return;
    }
    let (mut low, mut high) = (asked, asked);
    for p in domain.neighbours(&sample.point, 2.5e-7) {
        let density = sampler.density(&p);
        (low, high) = (low.min(density), high.max(density));
    }
    let spread = high - low;
    let excess = (low - spread - returned).max(returned - (high + spread));
    if !(excess <= slack) {
        let found = &mut tally.disagreement;
        found.wrong += 1;
        let relative = (returned / asked).max(asked / returned) - 1.0;
        if relative > found.worst {
            found.worst = relative;
            let what =
                format!("{returned:e} came with the point {:?}, where asking gives {asked:e}", sample.point);
            found.example = Some(Offence { xi: xi.to_vec(), what });
        }
    }
}
