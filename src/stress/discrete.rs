//! Selection by weights. The oracle is w / sum w, with a compensated sum of weights that were divided by the largest.

use super::{BITS, CORNERS, Component, Kind, Reach, Relative, Row, Trial, Unit, ends_of_cells, variates_in};
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

/// Lights by power over squared distance: from anywhere the masses sum to 1, each light is drawn, and what is drawn has the mass that is asked.
fn light_trees() -> Vec<Row> {
    let from = |input: &str, lights: fn() -> Vec<([Vec3; 3], f64)>, places: &'static [Vec3]| {
        let ask = move |trial: &mut Trial| {
            let lights = lights();
            let count = lights.len();
            let Some(tree) = trial.accepted(LightTree::new(lights)) else { return };
            let mut reach = Reach::default();
            for &x in places {
                let masses = (0..count).map(|light| tree.mass(x, light));
                trial.compare(masses.collect::<CompensatedSum>().value(), 1.0, || {
                    format!("sum of the masses from {x}")
                });
                let interval = |light| tree.interval(x, light);
                reach_of_lights(trial, &mut reach, count, |xi| tree.choose(x, xi), interval);
                for xi in CORNERS.into_iter().chain(super::lattice(512).map(|[xi, _]| xi)) {
                    let (light, mass) = tree.choose(x, xi);
                    trial.must(light < count && mass == tree.mass(x, light), || {
                        format!("from {x}, xi = {xi}: light {light} with the mass {mass:e}")
                    });
                }
            }
            trial.reach(reach);
        };
        let should = "masses sum to 1, each is drawn";
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
        HERE.row(Kind::Refusal, input, "names light 1", (0.0, Unit::Absolute), ask)
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

/// Which of so many lights are drawn from inside their intervals.
fn reach_of_lights(
    trial: &mut Trial,
    reach: &mut Reach,
    count: usize,
    choose: impl Fn(f64) -> (usize, f64),
    interval: impl Fn(usize) -> Option<(f64, f64)>,
) {
    for light in 0..count {
        let Some(interval) = interval(light) else {
            return trial.must(false, || format!("light {light} has no interval"));
        };
        let drawn = BITS.map(|bits| variates_in(interval, bits).any(|xi| choose(xi).0 == light));
        reach.count(drawn, interval.1 - interval.0);
    }
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
    let share_of = |weight: f64| weight / largest / total.value();
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
    let mut found = if in_order { Vec::new() } else { vec![[false; 2]; weights.len()] };
    for (k, &bits) in BITS.iter().enumerate().filter(|_| !in_order) {
        for xi in ends_of_cells(weights.len(), bits).flatten() {
            if let Some(found) = draw(trial, xi).and_then(|i| found.get_mut(i)) {
                found[k] = true;
            }
        }
    }
    let positive = weights.iter().filter(|&&w| w > 0.0).count();
    let mut relative = Relative { share: positive as f64 * STEP, ..Relative::default() };
    let (mut reach, mut elsewhere) = (Reach::default(), false);
    let mut start = CompensatedSum::new();
    for (i, &weight) in weights.iter().enumerate() {
        let mass = sampler.density(&i);
        let truth = share_of(weight);
        trial.compare(mass, truth, || format!("entry {i}"));
        let before = start.value();
        start.add(mass);
        if weight > 0.0 {
            relative.count(mass, truth);
            let drawn = if in_order {
                let interval = (before, start.value());
                let mut by =
                    BITS.map(|bits| variates_in(interval, bits).any(|xi| draw(trial, xi) == Some(i)));
                if !by[0] {
                    // What is not in order knows best.
                    let own = sampler.invert(&i).map(|xi| xi[0].min(ONE_MINUS_EPSILON_F64));
                    by[0] = own.is_some_and(|xi| draw(trial, xi) == Some(i));
                    elsewhere |= by[0];
                }
                by
            } else {
                found[i]
            };
            reach.count(drawn, mass);
        }
    }
    if elsewhere {
        reach.missed_by_24_bits = None;
    }
    trial.note(relative.to_string());
    trial.relative(relative);
    trial.reach(reach);
}

impl Relative {
    fn count(&mut self, mass: f64, truth: f64) {
        let error = Unit::Relative.error(mass, truth);
        let (count, worst) = if truth >= self.share {
            (&mut self.heavy, &mut self.worst)
        } else {
            self.of_one_step += u64::from(mass == STEP);
            (&mut self.light, &mut self.worst_of_light)
        };
        *count += 1;
        *worst = worst.max(error);
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_light_is_counted() {
        let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, 1.0)];
        let tree = LightTree::new((0..9).map(|i| (at(i as f32), 10.0_f64.powi(-3 * i)))).unwrap();
        for (lost, missed) in [(9, 0), (0, 1), (5, 1)] {
            let choose = |xi| Some(tree.choose(Vec3::ZERO, xi)).filter(|c| c.0 != lost).unwrap_or((1, 0.5));
            let mut reach = Reach::default();
            reach_of_lights(&mut Trial::new(), &mut reach, 9, choose, |light| {
                tree.interval(Vec3::ZERO, light)
            });
            assert_eq!((reach.of, reach.missed), (9, missed), "{lost}");
            // 1e-9 of the power at eight times the distance is less than 2^-24.
            assert!(reach.missed_by_24_bits.is_some_and(|(by_24, _)| by_24 > 4), "{lost}: {reach:?}");
        }
    }

    /// By brute force: nine cells of 2^4 variates.
    #[test]
    fn ends_of_cells_are_the_first_and_last_of_each() {
        for cells in [1, 3, 9, 16, 40] {
            let of = |k: u32| (k as usize * cells) >> 4;
            let ends: Vec<[f64; 2]> = ends_of_cells(cells, 4).collect();
            let mut by_hand: Vec<[f64; 2]> = Vec::new();
            for k in 0..16 {
                let xi = f64::from(k) / 16.0;
                match by_hand.last_mut() {
                    Some(last) if k > 0 && of(k) == of(k - 1) => last[1] = xi,
                    _ => by_hand.push([xi, xi]),
                }
            }
            assert_eq!(ends, by_hand, "{cells}");
        }
    }

    #[test]
    fn variates_lie_inside() {
        let all = |interval, bits| variates_in(interval, bits).collect::<Vec<_>>();
        assert_eq!(all((0.25, 1.0), 2), [0.25, 0.5, 0.75]);
        assert_eq!(all((0.3, 0.5), 2), [0.0; 0]);
        assert_eq!(all((0.3, 0.51), 2), [0.5; 3]);
        assert_eq!(all((0.5, 0.5), 53), [0.0; 0]);
        assert_eq!(all((1.0 - STEP, 1.0), 53), [1.0 - STEP; 3]);
        assert_eq!(all((f64::NAN, f64::NAN), 53), [0.0; 0]);
    }
}
