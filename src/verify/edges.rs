//! Variates where floats break: 0, the largest value under 1, the steps of 24 and 32 bits, around 1/2, in all combinations.

use super::finding::{Finding, Verdict};
use crate::domain::Domain;
use crate::random::{ONE_MINUS_EPSILON_F32, ONE_MINUS_EPSILON_F64};
use crate::sampler::Sampler;

const CHECK: &str = "edges";

/// The values that each variate takes.
fn values() -> [f64; 12] {
    let power = |e: i32| 2.0_f64.powi(e);
    [
        0.0,
        f64::from_bits(1),
        power(-53),
        power(-32),
        power(-24),
        0.25,
        0.5_f64.next_down(),
        0.5,
        0.5_f64.next_up(),
        1.0 - power(-11),
        f64::from(ONE_MINUS_EPSILON_F32),
        ONE_MINUS_EPSILON_F64,
    ]
}

pub(super) fn check<S: Sampler>(sampler: &S) -> Finding {
    let (domain, dimensions, values) = (sampler.domain(), sampler.dimensions(), values());
    let (mut rejected, mut tried) = (0_u64, 0_u64);
    let mut try_at = |xi: &[f64]| -> Result<(), String> {
        tried += 1;
        let Some(sample) = sampler.sample(xi) else {
            rejected += 1;
            return Ok(());
        };
        domain.locate(&sample.point).map_err(|why| format!("the point {:?} {why}", sample.point))?;
        for (how, density) in [("returned", sample.density), ("asked", sampler.density(&sample.point))] {
            if density.is_nan() || density < 0.0 || density.is_infinite() {
                return Err(format!("the density {how} at {:?} is {density}", sample.point));
            }
        }
        Ok(())
    };
    // All combinations up to four variates; beyond that each value along each variate, the others at a quarter.
    let combinations: Box<dyn Iterator<Item = Vec<f64>>> = if dimensions <= 4 {
        let count = values.len().pow(dimensions as u32);
        Box::new((0..count).map(move |mut code| {
            let mut digit = || {
                let value = values[code % values.len()];
                code /= values.len();
                value
            };
            (0..dimensions).map(|_| digit()).collect()
        }))
    } else {
        Box::new((0..dimensions * values.len()).map(move |i| {
            let mut xi = vec![0.25; dimensions];
            xi[i / values.len()] = values[i % values.len()];
            xi
        }))
    };
    for xi in combinations {
        if let Err(why) = try_at(&xi) {
            return Finding::certain(CHECK, Verdict::Fail, format!("at xi = {xi:?} {why}"));
        }
    }
    Finding::certain(
        CHECK,
        Verdict::Pass,
        format!("points and densities are sound at {tried} edge variates ({rejected} rejected)"),
    )
}
