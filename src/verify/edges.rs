//! Variates where floats break: 0, denormals, the steps of 24, 32 and 53 bits, around 1/2, the largest values under 1, in all combinations; and every knot
//! of the tables with its neighbours.

use super::check::{Case, Check, Needs, Rests};
use super::finding::{Finding, Verdict};
use super::probe::Probe;
use crate::random::{ONE_MINUS_EPSILON_F32, ONE_MINUS_EPSILON_F64};

/// The values that each variate takes.
pub(super) fn values() -> [f64; 14] {
    let power = |e: i32| 2.0_f64.powi(e);
    [
        0.0,
        f64::from_bits(1),
        f64::from(f32::from_bits(1)),
        power(-53),
        power(-32),
        power(-24),
        0.25,
        0.5 - power(-25),
        0.5_f64.next_down(),
        0.5,
        0.5_f64.next_up(),
        1.0 - power(-11),
        f64::from(ONE_MINUS_EPSILON_F32),
        ONE_MINUS_EPSILON_F64,
    ]
}

/// A knot, and one step of `f64`, `f32` and of a 24-bit lattice either side.
fn around(knot: f64) -> impl Iterator<Item = f64> {
    let (single, step) = (knot as f32, 2.0_f64.powi(-24));
    [
        knot,
        knot.next_down(),
        knot.next_up(),
        f64::from(single),
        f64::from(single.next_down()),
        f64::from(single.next_up()),
        knot - step,
        knot + step,
    ]
    .into_iter()
    .map(|xi| xi.clamp(0.0, ONE_MINUS_EPSILON_F64))
}

pub(super) struct Edges;

impl Check for Edges {
    fn name(&self) -> &'static str {
        "domain"
    }

    fn about(&self) -> &'static str {
        "points inside the domain and finite densities at variates where floats break and at the knots of tables"
    }

    fn rests(&self) -> Rests {
        Rests::NoCounts
    }

    fn needs(&self) -> Needs {
        Needs::Variates
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let (probe, dimensions) = (case.probe, case.probe.dimensions());
        let mut tried = Tried::default();
        let result = places(dimensions).try_for_each(|xi| tried.at(probe, &xi));
        let result = result.and_then(|()| knots(probe, &mut tried));
        let Tried { count, rejected } = tried;
        vec![match result {
            Err(why) => Finding::certain(self.name(), Verdict::Fail, why),
            Ok(()) => Finding::certain(
                self.name(),
                Verdict::Pass,
                format!("points and densities are sound at {count} edge variates ({rejected} rejected)"),
            ),
        }]
    }
}

/// Every knot of each variate with the others at the ends and in the middle.
fn knots(probe: &dyn Probe, tried: &mut Tried) -> Result<(), String> {
    let dimensions = probe.dimensions();
    let others = [0.0, 0.5, ONE_MINUS_EPSILON_F64];
    for dimension in 0..dimensions {
        for knot in probe.variate_knots(dimension) {
            for value in around(knot) {
                for other in others {
                    let mut xi = vec![other; dimensions];
                    xi[dimension] = value;
                    tried.at(probe, &xi)?;
                }
            }
        }
    }
    Ok(())
}

/// All combinations up to four variates; beyond that each value along each variate, the others at a quarter.
pub(super) fn places(dimensions: usize) -> impl Iterator<Item = Vec<f64>> {
    let values = values();
    let all = dimensions <= 4;
    let count = if all { values.len().pow(dimensions as u32) } else { values.len() * dimensions };
    (0..count).map(move |mut code| {
        let mut digit = || {
            let value = values[code % values.len()];
            code /= values.len();
            value
        };
        if all {
            return (0..dimensions).map(|_| digit()).collect();
        }
        let mut xi = vec![0.25; dimensions];
        let value = digit();
        xi[code] = value;
        xi
    })
}

/// What a sampler made of one edge value of one variate, the others at 1/2.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeProbe {
    /// Which variate, from 0.
    pub variate: usize,
    /// Its value.
    pub value: f64,
    /// The point in words; `None` if the sample was rejected.
    pub point: Option<String>,
    /// The density that came with it; NaN if the sample was rejected.
    pub density: f64,
    /// What is wrong with it.
    pub wrong: Option<String>,
}

/// Every edge value along every variate: what people look at, where the check tries all combinations.
pub(super) fn probes(probe: &dyn Probe) -> Vec<EdgeProbe> {
    let dimensions = probe.dimensions();
    let at = |variate: usize, value: f64| {
        let mut xi = vec![0.5; dimensions];
        xi[variate] = value;
        let look = probe.look(&xi);
        EdgeProbe {
            variate,
            value,
            density: look.as_ref().map_or(f64::NAN, |look| look.density),
            point: look.map(|look| look.point),
            wrong: Tried::default().at(probe, &xi).err(),
        }
    };
    (0..dimensions).flat_map(|variate| values().map(|value| at(variate, value))).collect()
}

#[derive(Default)]
struct Tried {
    count: u64,
    rejected: u64,
}

impl Tried {
    fn at(&mut self, probe: &dyn Probe, xi: &[f64]) -> Result<(), String> {
        self.count += 1;
        let Some(look) = probe.look(xi) else {
            self.rejected += 1;
            return Ok(());
        };
        let location =
            look.location.map_err(|why| format!("at xi = {xi:?} the point {} {why}", look.point))?;
        // On a rim a density may be 0; an entry that has no mass is never to be returned.
        if probe.space().is_atom(location.patch) && (look.density == 0.0 || look.asked == 0.0) {
            return Err(format!("at xi = {xi:?} it returns {}, whose mass is 0", look.point));
        }
        for (how, density) in [("returned", look.density), ("asked", look.asked)] {
            if density.is_nan() || density < 0.0 || density.is_infinite() {
                return Err(format!("at xi = {xi:?} the density {how} at {} is {density}", look.point));
            }
        }
        if let Some(rest) = probe.left_over(xi).filter(|rest| !(0.0..1.0).contains(rest)) {
            return Err(format!("at xi = {xi:?} the variate left over is {rest}, outside of [0, 1)"));
        }
        Ok(())
    }
}
