//! invert(sample(xi)) = xi, for samplers that offer an inverse.
//!
//! Where the map squeezes variates together (phi at a pole, an `f32` point in a narrow lobe) the variates can't come back, but their point must.

use super::check::{Case, Check, Needs, Rests};
use super::finding::{Finding, Verdict};
use crate::random::{fill_unit, stream};

const PLACES: usize = 1024;
/// Variates that come back this near are the same, …
const NEAR: f64 = 1e-3;
/// … and so are points this near, relative to a domain of measure 1 or more.
const SAME_POINT: f64 = 4e-6;

pub(super) struct RoundTripIdentity;

impl Check for RoundTripIdentity {
    fn name(&self) -> &'static str {
        "round trip"
    }

    fn about(&self) -> &'static str {
        "the inverse of a sample's point gives its variates back"
    }

    fn rests(&self) -> Rests {
        Rests::NoCounts
    }

    fn needs(&self) -> Needs {
        Needs::Variates
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let probe = case.probe;
        let mut rng = stream(case.settings.seed, "round trip", 0);
        let mut xi = vec![0.0; probe.dimensions()];
        let measure = probe.space().measure();
        let tolerance = SAME_POINT * if measure.is_finite() { measure.max(1.0) } else { 1.0 };
        let (mut asked, mut wrong, mut first) = (0, 0, None);
        for _ in 0..PLACES {
            fill_unit(&mut rng, &mut xi);
            let Some(trip) = probe.round_trip(&xi) else { continue };
            asked += 1;
            let inside = trip.xi.iter().all(|x| (-1e-6..=1.0 + 1e-6).contains(x));
            let near =
                trip.xi.len() == xi.len() && trip.xi.iter().zip(&xi).all(|(a, b)| (a - b).abs() <= NEAR);
            if inside && (near || trip.distance <= tolerance) {
                continue;
            }
            wrong += 1;
            first.get_or_insert_with(|| {
                format!("xi = {xi:?} gives {}, whose inverse is {:?}", trip.point, trip.xi)
            });
        }
        if asked == 0 {
            return Vec::new();
        }
        vec![match first {
            // A rare one may sit on the border between two branches.
            Some(first) if wrong > asked / 200 => Finding::certain(
                self.name(),
                Verdict::Fail,
                format!("{wrong} of {asked} samples don't come back; the first: {first}"),
            ),
            _ => Finding::certain(
                self.name(),
                Verdict::Pass,
                format!("{} of {asked} samples come back through the inverse", asked - wrong),
            )
            .sees(format!(
                "a wrong inverse over {:.1}% of the variates",
                100.0 * (0.005 + 10.0 / asked as f64)
            )),
        }]
    }
}
