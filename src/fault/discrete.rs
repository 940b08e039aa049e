//! Tables of weights.

use super::{Boxed, Fault, Specimen, Twin};
use crate::domain::{Discrete, Knots};
use crate::sampler::{DiscreteCdf, LightTree, PointOf, Sample, Sampler, from_fn};
use glam::Vec3;

fn forty() -> Vec<f64> {
    (0..40).map(|i| f64::from(1 + (i * 7 + 3) % 11)).collect()
}

/// A thousand entries, the last one of no weight.
fn thousand() -> Vec<f64> {
    (0..1000).map(|i| if i == 999 { 0.0 } else { f64::from(1 + (i * 7 + 3) % 11) }).collect()
}

/// Sixteenths, some of them 0, the first as well.
fn sixteenths() -> Vec<f64> {
    vec![0.0, 2.0, 1.0, 1.0, 0.0, 4.0, 0.0, 0.0, 3.0, 1.0, 2.0, 1.0, 0.0, 1.0]
}

fn million() -> Vec<f64> {
    vec![0.3; 1_000_000]
}

fn tail() -> Vec<f64> {
    let mut weights = vec![1e-8; 1_000_001];
    weights[0] = 1.0;
    weights
}

fn right(weights: &[f64]) -> Specimen {
    Specimen::sampler(DiscreteCdf::new(weights).expect("weights that can be sampled"))
}

const FORTY: Twin = Twin::new("table of 40 weights", || right(&forty()));
const THOUSAND: Twin = Twin::new("table of 1000 weights", || right(&thousand()));
const SIXTEENTHS: Twin = Twin::new("table of sixteenths", || right(&sixteenths()));
const MILLION: Twin = Twin::new("table of 1e6 equal weights", || right(&million()));
const TAIL: Twin = Twin::new("table of one heavy and 1e6 light weights", || right(&tail()));
const WEIGHTS: Twin = Twin::new("builder of tables", || {
    Specimen::Weights(|weights| Ok(Box::new(DiscreteCdf::new(weights).map_err(|error| error.to_string())?)))
});

/// Where lights are chosen from.
const HERE: Vec3 = Vec3::new(1.0, 2.0, 0.5);

/// Forty lights of a tree, chosen as seen from [`HERE`], with the probabilities that they have as seen from `from`.
fn by_tree(from: Vec3) -> Specimen {
    let light = |i: u32| {
        let at = Vec3::new((i % 8) as f32, (i / 8) as f32, 3.0 + (i % 3) as f32);
        ([at, at + 0.1 * Vec3::X, at + 0.1 * Vec3::Y], 1.0 + f64::from(i % 5))
    };
    let tree = LightTree::new((0..40).map(light)).expect("lights with power");
    let asked = tree.clone();
    Specimen::sampler(from_fn(
        Discrete::new(40),
        move |xi: f64| tree.choose(HERE, xi).0,
        move |i: usize| asked.mass(from, i),
    ))
}

const LIGHTS: Twin = Twin::new("tree of 40 lights", || by_tree(HERE));

/// The probabilities that the weights ask for.
fn probabilities(weights: &[f64]) -> Vec<f64> {
    let total: f64 = weights.iter().sum();
    weights.iter().map(|w| w / total).collect()
}

/// Ends of the entries' intervals, summed up in `f64`.
fn ends(weights: &[f64]) -> Vec<f64> {
    let sums = weights.iter().scan(0.0, |sum, w| {
        *sum += w;
        Some(*sum)
    });
    sums.collect()
}

/// The same in `f32`.
fn ends_f32(weights: &[f64]) -> Vec<f32> {
    let sums = weights.iter().scan(0.0_f32, |sum, &w| {
        *sum += w as f32;
        Some(*sum)
    });
    sums.collect()
}

/// The same divided by a sum that came out larger elsewhere: the last one is 1 - 2^-20.
fn ends_short(weights: &[f64]) -> Vec<f32> {
    let ends = ends_f32(weights);
    let total = ends[ends.len() - 1] / (1.0 - 8.0 * f32::EPSILON);
    ends.iter().map(|end| end / total).collect()
}

/// A search that claims the probabilities of the weights.
fn searched(weights: &[f64], search: impl Fn(f64) -> usize + Send + Sync + 'static) -> Specimen {
    let p = probabilities(weights);
    let claimed = move |i: usize| p.get(i).copied().unwrap_or(0.0);
    Specimen::sampler(from_fn(Discrete::new(weights.len()), search, claimed))
}

/// A sampler that says what it leaves over.
struct LeavesOver<S, L> {
    sampler: S,
    left_over: L,
}

impl<S: Sampler, L: Fn(f64) -> f64 + Sync> Sampler for LeavesOver<S, L> {
    type Domain = S::Domain;

    fn domain(&self) -> S::Domain {
        self.sampler.domain()
    }

    fn dimensions(&self) -> usize {
        self.sampler.dimensions()
    }

    fn sample(&self, xi: &[f64]) -> Option<Sample<PointOf<S>>> {
        self.sampler.sample(xi)
    }

    fn density(&self, point: &PointOf<S>) -> f64 {
        self.sampler.density(point)
    }

    fn left_over(&self, xi: &[f64]) -> Option<f64> {
        Some((self.left_over)(xi[0]))
    }

    fn knots(&self) -> Knots {
        self.sampler.knots()
    }
}

/// An alias table (Walker 1977, Vose 1991) as (threshold, alias) by entry.
struct Alias {
    cells: Vec<(f64, usize)>,
}

impl Alias {
    /// With `drains` the entries that are left at the end get a full cell of their own; with `returns` a donor that has become light is light.
    fn new(weights: &[f64], drains: bool, returns: bool) -> Self {
        let count = weights.len() as f64;
        let mut left: Vec<f64> = probabilities(weights).iter().map(|p| p * count).collect();
        let mut cells = vec![(0.0, 0); weights.len()];
        let (mut light, mut heavy): (Vec<usize>, Vec<usize>) =
            (0..weights.len()).partition(|&i| left[i] < 1.0);
        while let (Some(&donor), Some(&entry)) = (heavy.last(), light.last()) {
            light.pop();
            cells[entry] = (left[entry], donor);
            left[donor] -= 1.0 - left[entry];
            let done = if returns { left[donor] < 1.0 } else { left[donor] < 0.0 };
            if done {
                heavy.pop();
                if returns {
                    light.push(donor);
                } else {
                    cells[donor] = (left[donor], donor);
                }
            }
        }
        if drains {
            light.into_iter().chain(heavy).for_each(|entry| cells[entry] = (1.0, entry));
        }
        Self { cells }
    }

    fn choose(&self, xi: f64) -> usize {
        let place = xi * self.cells.len() as f64;
        let cell = (place as usize).min(self.cells.len() - 1);
        let (threshold, alias) = self.cells[cell];
        if place - (cell as f64) < threshold { cell } else { alias }
    }
}

/// A builder that accepts weights for which `sound` holds, and checks nothing else.
fn building(weights: &[f64], sound: fn(f64) -> bool) -> Result<Boxed<Discrete>, String> {
    if weights.is_empty() || !weights.iter().all(|&w| sound(w)) {
        return Err("there are no weights, or one is unsound".to_owned());
    }
    let (p, ends) = (probabilities(weights), ends(weights));
    let total = ends[ends.len() - 1];
    if total == 0.0 {
        return Err("all weights are 0".to_owned());
    }
    let last = ends.len() - 1;
    Ok(Box::new(from_fn(
        Discrete::new(p.len()),
        move |xi: f64| ends.partition_point(|&end| end <= xi * total).min(last),
        move |i: usize| p[i],
    )))
}

const NOT_REFUSED: (&[&str], &[&str]) = (&["refusal"], &["refusal"]);

pub(super) fn faults() -> Vec<Fault> {
    vec![
        Fault::new("discrete/f32-running-sum", "the CDF of 1e6 entries is summed up in f32", MILLION, || {
            let ends = ends_f32(&million());
            let total = ends[ends.len() - 1];
            let last = ends.len() - 1;
            searched(&million(), move |xi| ends.partition_point(|&e| e <= xi as f32 * total).min(last))
        })
        .seen("torch/torch7 #418 (upper half of the categories never drawn), pytorch/pytorch #43115")
        .caught(&["chi-square", "distribution"], &["step along the index"]),
        Fault::new(
            "discrete/last-under-1",
            "the last entry of the CDF is under 1, and the search falls off it",
            THOUSAND,
            || {
                let ends = ends_short(&thousand());
                searched(&thousand(), move |xi| ends.partition_point(|&e| f64::from(e) <= xi))
            },
        )
        .seen("torch/torch7 #453, microsoft/STL #1017 (discrete_distribution returns n)")
        .caught(&["domain", "support"], &["outside at the end"]),
        Fault::new(
            "discrete/zero-weight-at-0",
            "an entry of weight 0 is returned at xi = 0: `c < xi` where `c <= xi` belongs",
            SIXTEENTHS,
            || {
                let ends = ends(&probabilities(&sixteenths()));
                searched(&sixteenths(), move |xi| ends.partition_point(|&e| e < xi).min(13))
            },
        )
        .seen("NVIDIA/Megatron-Energon PR 260, YafaRay/Core PR 92 (index -1 at u = 0)")
        .caught(&["domain"], &["entry of mass 0"]),
        Fault::new(
            "discrete/zero-weight-at-a-knot",
            "a binary search returns the first of several equal knots, an entry of weight 0",
            SIXTEENTHS,
            || {
                let starts: Vec<f64> = ends(&probabilities(&sixteenths()))
                    .iter()
                    .scan(0.0, |start, &end| Some(std::mem::replace(start, end)))
                    .collect();
                searched(&sixteenths(), move |xi| match starts.partition_point(|&s| s < xi) {
                    at if starts.get(at) == Some(&xi) => at.max(1),
                    at => at - 1,
                })
            },
        )
        .seen("libmir/mir PR 236 (cdf [1, 3, 3, 4] hits the entry of weight 0)")
        .caught(&["domain"], &["entry of mass 0"]),
        Fault::new(
            "discrete/zero-weight-at-the-end",
            "what lies past the last knot is clamped to the last entry, whatever its weight",
            THOUSAND,
            || {
                let ends = ends_short(&thousand());
                searched(&thousand(), move |xi| ends.partition_point(|&e| f64::from(e) <= xi).min(999))
            },
        )
        .seen("forcedotcom/distributions #89; the clamp of mmp/pbrt-v4's SampleDiscrete is of this kind")
        .caught(&["domain", "support"], &["entry of mass 0"]),
        Fault::new(
            "discrete/lower-bound",
            "a lower bound for an upper bound, with whole numbers as variates",
            FORTY,
            || {
                let ends = ends(&forty());
                let total = ends[39];
                searched(&forty(), move |xi| ends.partition_point(|&e| e < (xi * total).floor()))
            },
        )
        .seen("libmir/mir PR 236 (the first category is counted twice)")
        .caught(&["chi-square"], &["mass moved between entries"]),
        Fault::new("discrete/off-by-one", "the entry behind the one that was found", FORTY, || {
            let table = DiscreteCdf::new(&forty()).expect("weights that can be sampled");
            searched(&forty(), move |xi| (table.choose(xi).index + 1).min(39))
        })
        .seen("godotengine/godot PR 93893, on the way")
        .caught(&["chi-square"], &["index one too large"]),
        Fault::new(
            "discrete/xi-rounds-to-1",
            "a variate of 53 bits is rounded to f32 and becomes 1",
            FORTY,
            || {
                let ends = ends(&probabilities(&forty()));
                searched(&forty(), move |xi| {
                    let xi = xi as f32;
                    ends.partition_point(|&e| e as f32 <= xi)
                })
            },
        )
        .seen("microsoft/STL #1074, cupy/cupy PR 4894 (curand gives 1), arrayfire/arrayfire #1610")
        .caught(&["domain"], &["outside at the end"]),
        Fault::new(
            "discrete/absorbed-tail",
            "1e6 entries of 1e-8 behind an entry of 1 vanish in an f32 sum",
            TAIL,
            || {
                let ends = ends_f32(&tail());
                let last = ends.len() - 1;
                searched(&tail(), move |xi| {
                    ends.partition_point(|&e| f64::from(e) <= xi * f64::from(ends[last])).min(last)
                })
            },
        )
        .seen("pytorch/pytorch #28390")
        .caught(&["chi-square"], &["absorbed tail"]),
        Fault::new(
            "discrete/light-tree-from-elsewhere",
            "a light is chosen as seen from one point, and its probability asked from another",
            LIGHTS,
            || by_tree(HERE + Vec3::new(0.3, 0.0, 0.0)),
        )
        .seen("gkjohnson/three-gpu-pathtracer #847 is of the kind (weights from different directions)")
        .caught(&["chi-square"], &["mass moved between entries"]),
        Fault::new(
            "discrete/alias-unfilled",
            "the entries left at the end of an alias table's construction get no cell",
            FORTY,
            || {
                let alias = Alias::new(&forty(), false, true);
                searched(&forty(), move |xi| alias.choose(xi))
            },
        )
        .seen("JuliaStats/StatsBase.jl PR 927, jliszka/probability-monad PR 5")
        .caught(&["chi-square"], &["mass moved between entries"]),
        Fault::new(
            "discrete/alias-negative",
            "a heavy entry of an alias table gives away more than it has",
            FORTY,
            || {
                let alias = Alias::new(&forty(), true, false);
                searched(&forty(), move |xi| alias.choose(xi))
            },
        )
        .seen("nrc-cnrc/EGSnrc #24 (a weight of -0.715), PR 557")
        .caught(&["chi-square"], &["mass moved between entries"]),
        Fault::new(
            "discrete/stale-sum",
            "weights are divided by the sum of what they were before an update",
            FORTY,
            || {
                let p: Vec<f64> = probabilities(&forty()).iter().map(|p| 0.97 * p).collect();
                let ends = ends(&p);
                searched(&forty(), move |xi| ends.partition_point(|&e| e <= xi).min(39))
            },
        )
        .seen("JuliaStats/Distributions.jl #832 (not normalised), mitsuba-renderer/mitsuba3 #1047 may be one")
        .caught(&["chi-square"], &["the rest goes to the last entry"]),
        Fault::new(
            "discrete/left-over-outside",
            "the variate left over, (xi - cdf) / pmf in f32, reaches 1",
            THOUSAND,
            || {
                let table = DiscreteCdf::new(&thousand()).expect("weights that can be sampled");
                let (p, ends) = (probabilities(&thousand()), ends_f32(&probabilities(&thousand())));
                let search = table.clone();
                let left_over = move |xi: f64| {
                    let i = search.choose(xi).index;
                    let start = if i == 0 { 0.0 } else { ends[i - 1] };
                    f64::from((xi as f32 - start) / p[i] as f32)
                };
                Specimen::sampler(LeavesOver { sampler: table, left_over })
            },
        )
        .seen("wjakob/nori PR 32 (sampleReuse leaves [0, 1]); mitsuba-renderer/mitsuba3's distr_1d.h divides without a clamp, too")
        .caught(&["support"], &["left-over variate outside"]),
        Fault::new(
            "discrete/left-over-unscaled",
            "the variate left over is not divided by the mass",
            FORTY,
            || {
                let table = DiscreteCdf::new(&forty()).expect("weights that can be sampled");
                let search = table.clone();
                let left_over = move |xi: f64| xi - search.cumulative(search.choose(xi).index);
                Specimen::sampler(LeavesOver { sampler: table, left_over })
            },
        )
        .seen("mmp/pbrt-v4 PR 163 (multiplied where it should be divided)")
        .caught(&["independence"], &["left-over variate not re-scaled"]),
        Fault::new("discrete/nan-accepted", "`w < 0` refuses no NaN", WEIGHTS, || {
            Specimen::Weights(|weights| building(weights, |w| !(w < 0.0) && w != f64::INFINITY))
        })
        .seen("numpy/numpy #11250 (choice with a NaN always gives the first element)")
        .caught(NOT_REFUSED.0, NOT_REFUSED.1)
        .no_sampler(),
        Fault::new(
            "discrete/infinity-accepted",
            "an infinite weight makes all probabilities 0 or NaN",
            WEIGHTS,
            || Specimen::Weights(|weights| building(weights, |w| w >= 0.0)),
        )
        .seen("rust-random/rand PR 1813, PR 1814 (infinite weights draw the least likely items)")
        .caught(NOT_REFUSED.0, NOT_REFUSED.1)
        .no_sampler(),
        Fault::new("discrete/negative-accepted", "a negative weight makes the CDF go back", WEIGHTS, || {
            Specimen::Weights(|weights| building(weights, f64::is_finite))
        })
        .seen("JuliaStats/StatsBase.jl PR 927 (negative weights give garbage)")
        .caught(NOT_REFUSED.0, NOT_REFUSED.1)
        .no_sampler(),
        Fault::new("discrete/sum-overflows", "the f32 sum of finite weights is infinite", WEIGHTS, || {
            Specimen::Weights(|weights| {
                let total: f32 = weights.iter().map(|&w| w as f32).sum();
                let right = DiscreteCdf::new(weights).map_err(|error| error.to_string())?;
                let p: Vec<f64> = weights.iter().map(|&w| f64::from(w as f32 / total)).collect();
                Ok(Box::new(from_fn(
                    Discrete::new(p.len()),
                    move |xi: f64| right.choose(xi).index,
                    move |i: usize| p[i],
                )))
            })
        })
        .seen("torch/cutorch PR 712 (2.1e38 + 1.7e38 is infinite in f32: the index is uninitialised memory)")
        .caught(NOT_REFUSED.0, NOT_REFUSED.1)
        .no_sampler(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The variates of each entry, counted on a fine grid, are its probability but for the ends of its intervals.
    #[test]
    fn an_alias_table_without_a_mistake_is_right() {
        const STEPS: usize = 1 << 18;
        let alias = Alias::new(&forty(), true, true);
        let mut counts = [0_usize; 40];
        (0..STEPS).for_each(|k| counts[alias.choose((k as f64 + 0.5) / STEPS as f64)] += 1);
        for (count, p) in counts.into_iter().zip(probabilities(&forty())) {
            assert!((count as f64 - p * STEPS as f64).abs() < 80.0, "{count} for {p}");
        }
    }
}
