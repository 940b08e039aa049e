//! Selection by weights. The oracle is w / sum w, with a compensated sum of weights that were divided by the largest.

use super::{CORNERS, Component, Kind, Reach, Row, Trial, Unit, missed_by_24_bits};
use crate::domain::Discrete;
use crate::random::ONE_MINUS_EPSILON_F64;
use crate::sampler::{DiscreteAlias, DiscreteCdf, DiscreteGuide, Error, LightTree, Sampler};
use crate::statistics::CompensatedSum;
use glam::Vec3;

const HERE: Component = Component::Discrete;

/// A step of a variate of 53 bits.
const STEP: f64 = 1.0 / 9_007_199_254_740_992.0;

pub(super) fn rows() -> Vec<Row> {
    // One step for each of M entries leaves 2^53 - M to be shared; each boundary is rounded by a few steps.
    let allowed = |entries: f64, largest: f64| (4.0 + entries * largest) * STEP;
    let mut rows = discrete_rows(DiscreteCdf::new, allowed);
    rows.extend(refusals(DiscreteCdf::new));
    // The other forms have the same masses, and lose or find other entries.
    let named = |form: &'static str| move |row: Row| Row { input: format!("{form}: {}", row.input), ..row };
    let guide = discrete_rows(DiscreteGuide::new, allowed).into_iter().chain(refusals(DiscreteGuide::new));
    rows.extend(guide.map(named("guide table")));
    let alias = rows_of(DiscreteAlias::new, allowed, false).into_iter().chain(refusals(DiscreteAlias::new));
    rows.extend(alias.map(named("alias table")));
    rows.extend(light_trees());
    rows
}

/// Lights by power over squared distance: from anywhere the masses sum to 1, none is 0, and what is chosen has the mass that is asked.
fn light_trees() -> Vec<Row> {
    let from = |input: &str, lights: fn() -> Vec<([Vec3; 3], f64)>, places: &'static [Vec3]| {
        let ask = move |trial: &mut Trial| {
            let lights = lights();
            let (count, mut missed) = (lights.len(), 0);
            let Some(tree) = trial.accepted(LightTree::new(lights)) else { return };
            for &x in places {
                let mut sum = CompensatedSum::new();
                for light in 0..count {
                    let mass = tree.mass(x, light);
                    missed += u64::from(!(mass > 0.0));
                    sum.add(mass);
                }
                trial.compare(sum.value(), 1.0, || format!("sum of the masses from {x}"));
                for xi in CORNERS.into_iter().chain(super::lattice(512).map(|[xi, _]| xi)) {
                    let (light, mass) = tree.choose(x, xi);
                    trial.must(light < count && mass == tree.mass(x, light), || {
                        format!("from {x}, xi = {xi}: light {light} with the mass {mass:e}")
                    });
                }
            }
            trial.reach(Reach { of: (count * places.len()) as u64, missed, missed_by_24_bits: None });
        };
        let should = "masses sum to 1, none is 0";
        HERE.row(Kind::Value, format!("light tree: {input}"), should, (1e-13, Unit::Absolute), ask)
    };
    const EVERYWHERE: [Vec3; 6] = [
        Vec3::ZERO,
        Vec3::X,
        Vec3::new(1e-30, -1e-30, 0.0),
        Vec3::new(3e38, 0.0, -3e38),
        Vec3::new(-1e19, 1e10, 1.0),
        Vec3::splat(f32::MIN_POSITIVE),
    ];
    fn at(x: f32, size: f32) -> [Vec3; 3] {
        [Vec3::new(x, 0.0, 0.0), Vec3::new(x + size, 0.0, 0.0), Vec3::new(x, size, 0.0)]
    }
    let refused = |input: &str, power: f64| {
        let ask = move |trial: &mut Trial| {
            let tree = LightTree::new([(at(0.0, 1.0), 1.0), (at(1.0, 1.0), power)]);
            trial.refused(tree, |e| matches!(e, Error::Power { index: 1, .. }));
        };
        let input = format!("light tree: {input}");
        HERE.row(Kind::Refusal, input, "names index 1", (0.0, Unit::Absolute), ask)
    };
    vec![
        from("one light", || vec![(at(0.0, 1.0), 5e-324)], &EVERYWHERE),
        from("powers 5e-324 and 1e308", || vec![(at(0.0, 1.0), 5e-324), (at(1.0, 1.0), 1e308)], &EVERYWHERE),
        from(
            "powers 1e308, 5e-324 and 5e-324",
            || vec![(at(0.0, 1.0), 1e308), (at(8.0, 1.0), 5e-324), (at(9.0, 1.0), 5e-324)],
            &EVERYWHERE,
        ),
        from(
            "sizes and places from 1e-30 to 1e30",
            || (-30..=30).map(|k| (at(10.0_f32.powi(k), 10.0_f32.powi(-k)), 10.0_f64.powi(k))).collect(),
            &EVERYWHERE,
        ),
        from("a thousand in one place", || vec![(at(1.0, 0.0), 1.0); 1000], &EVERYWHERE),
        refused("a power of 0", 0.0),
        refused("a power of NaN", f64::NAN),
        refused("an infinite power", f64::INFINITY),
    ]
}

/// The rows of tables of weights, asked of the sampler that `make` makes of weights. `allowed` says how far a mass may be from w / sum w, from the
/// number of positive weights and the largest share.
///
/// ```
/// use warpcheck::{domain::Discrete, sampler::from_fn, stress};
/// // Sums in f32, as many renderers have them.
/// let naive = |weights: &[f64]| {
///     let sums = weights.iter().scan(0.0_f32, |sum, &w| { *sum += w as f32; Some(*sum) });
///     let cdf: Vec<f32> = sums.collect();
///     let (total, masses) = (cdf[cdf.len() - 1], cdf.clone());
///     Ok::<_, String>(from_fn(
///         Discrete::new(cdf.len()),
///         move |xi: f32| cdf.partition_point(|&c| c <= xi * total).min(cdf.len() - 1),
///         move |i: usize| (masses[i] - if i > 0 { masses[i - 1] } else { 0.0 }) / total,
///     ))
/// };
/// let light = stress::discrete_rows(naive, |_, _| 1e-6).into_iter().filter(|row| !row.heavy);
/// let broken = stress::run(light, |_| true).into_iter().filter(|(_, outcome)| !outcome.is_ok());
/// assert!(broken.map(|(row, _)| row.input).any(|input| input == "[MAX, MAX]"));
/// ```
pub fn discrete_rows<S, E, M>(make: M, allowed: fn(entries: f64, largest: f64) -> f64) -> Vec<Row>
where
    S: Sampler<Domain = Discrete>,
    E: std::fmt::Display,
    M: Fn(&[f64]) -> Result<S, E> + Clone + Send + Sync + 'static,
{
    rows_of(make, allowed, true)
}

/// The same; in order if growing variates draw growing indices.
fn rows_of<S, E, M>(make: M, allowed: fn(entries: f64, largest: f64) -> f64, in_order: bool) -> Vec<Row>
where
    S: Sampler<Domain = Discrete>,
    E: std::fmt::Display,
    M: Fn(&[f64]) -> Result<S, E> + Clone + Send + Sync + 'static,
{
    let row = |input: &str, entries: f64, largest: f64, weights: fn() -> Vec<f64>| {
        let make = make.clone();
        let ask = move |trial: &mut Trial| {
            let weights = weights();
            if let Some(sampler) = trial.accepted(make(&weights)) {
                table(trial, &weights, &sampler, in_order);
            }
        };
        let tolerance = (allowed(entries, largest), Unit::Absolute);
        HERE.row(Kind::Value, input, "w / sum w; no entry of weight 0", tolerance, ask)
    };
    vec![
        row("N = 1", 1.0, 1.0, || vec![0.3]),
        row("[5e-324, 0]", 1.0, 1.0, || vec![5e-324, 0.0]),
        row("[MAX, MAX]", 2.0, 0.5, || vec![f64::MAX, f64::MAX]),
        row("zeros first", 2.0, 0.7, || vec![0.0, 0.0, 0.0, 1.0, 2.0]),
        row("zeros last", 2.0, 0.7, || vec![1.0, 2.0, 0.0, 0.0, 0.0]),
        row("zeros in runs of 10", 500.0, 0.01, || {
            (0..1000).map(|i| if i / 10 % 2 == 0 { 0.0 } else { f64::from(i) }).collect()
        }),
        row("areas from 1e-30 to 1e30", 601.0, 0.21, || {
            // In no order.
            (0..=600).map(|i| 10.0_f64.powf(f64::from(i * 233 % 601) / 10.0 - 30.0)).collect()
        }),
        row("1, then 1e6 of 1e-8", 1e6, 1.0, || {
            let mut weights = vec![1e-8; 1_000_001];
            weights[0] = 1.0;
            weights
        }),
        row("1e7 of 0.1", 1e7, 1e-7, || vec![0.1; 10_000_000]).heavy(),
        row("2^24 + 1 of 1", 1.7e7, 1e-7, || vec![1.0; (1 << 24) + 1]).heavy(),
    ]
}

/// Masses against weights, whether each entry can be drawn, and that no entry of weight 0 is.
fn table(trial: &mut Trial, weights: &[f64], sampler: &impl Sampler<Domain = Discrete>, in_order: bool) {
    let largest = weights.iter().copied().fold(0.0, f64::max);
    let total: CompensatedSum = weights.iter().map(|w| w / largest).collect();
    let plain = weights.iter().fold(0.0_f32, |sum, &w| sum + w as f32);
    let off = f64::from(plain) / largest / total.value() - 1.0;
    if off.abs() > 1e-3 {
        trial.note(format!("a plain f32 sum is off by {:+.1}%", 100.0 * off));
    }
    let draw = |trial: &mut Trial, xi: f64| {
        let index = sampler.sample(&[xi]).map(|sample| sample.point);
        let weight = index.and_then(|i| weights.get(i));
        trial.must(weight.is_some_and(|&w| w > 0.0), || {
            format!("xi = {xi:e} draws {index:?}, which has the weight {weight:?}")
        });
        index
    };
    for xi in CORNERS {
        draw(trial, xi);
    }
    // Each cell of an alias table has two entries, one at either end.
    let mut drawn = vec![false; weights.len()];
    let ends = |i: usize| [i as f64, ((i + 1) as f64).next_down()].map(|x| x / weights.len() as f64);
    for xi in (0..weights.len()).filter(|_| !in_order).flat_map(ends) {
        if let Some(drawn) = draw(trial, xi.min(ONE_MINUS_EPSILON_F64)).and_then(|i| drawn.get_mut(i)) {
            *drawn = true;
        }
    }
    let (mut missed, mut missed_24) = (0, (0, 0.0));
    let mut start = CompensatedSum::new();
    for (i, w) in weights.iter().enumerate() {
        let mass = sampler.density(&i);
        trial.compare(mass, w / largest / total.value(), || format!("entry {i}"));
        let before = start.value();
        start.add(mass);
        if *w > 0.0 {
            let end = start.value();
            // At its start, in its middle or where the sampler itself says: an entry that none of them draws is lost.
            let own = sampler.invert(&i).map(|xi| xi[0]);
            let places = [Some(before), Some(0.5 * (before + end)), own];
            let places = places.into_iter().flatten().map(|xi| xi.min(ONE_MINUS_EPSILON_F64));
            missed += u64::from(!drawn[i] && !places.into_iter().any(|xi| draw(trial, xi) == Some(i)));
            if missed_by_24_bits((before, end)) {
                missed_24 = (missed_24.0 + 1, missed_24.1 + mass);
            }
        }
    }
    let of = weights.iter().filter(|&&w| w > 0.0).count() as u64;
    trial.reach(Reach { of, missed, missed_by_24_bits: in_order.then_some(missed_24) });
}

/// Weights that make no table.
fn refusals<S: 'static>(make: fn(&[f64]) -> Result<S, Error>) -> Vec<Row> {
    let row = |input: &str, should: &str, weights: Vec<f64>, is_right: fn(&Error) -> bool| {
        let ask = move |trial: &mut Trial| trial.refused(make(&weights), is_right);
        HERE.row(Kind::Refusal, input, should, (0.0, Unit::Absolute), ask)
    };
    let at_2 = |x: f64| vec![1.0, 0.0, x, 1.0, x];
    vec![
        row("no weights", "says so", vec![], |e| *e == Error::NoWeights),
        row("all 0", "says how many", vec![0.0; 7], |e| *e == Error::AllZero { count: 7 }),
        row(
            "NaN at 2 and 4",
            "names index 2",
            at_2(f64::NAN),
            |e| matches!(e, Error::Weight { index: 2, value } if value.is_nan()),
        ),
        row("-5e-324 at 2 and 4", "names index 2", at_2(-5e-324), |e| {
            *e == Error::Weight { index: 2, value: -5e-324 }
        }),
        row("infinite at 2 and 4", "names index 2", at_2(f64::INFINITY), |e| {
            *e == Error::Weight { index: 2, value: f64::INFINITY }
        }),
    ]
}
