//! Mixtures at their ends, MIS weights of densities whose squares `f32` does not hold, the film after 1e8 passes, and what a comparison says of a light that
//! hardly a sample meets. Oracles: the parts themselves; weights from logarithms, in `f64`; irradiance in closed form (Lambert).

use super::{BITS, Component, Kind, Reach, Row, Trial, Unit, lattice, variates_in};
use crate::estimator::{Film, Judgement, Pixel, Rules, compare};
use crate::oracle::irradiance_of_polygon;
use crate::random::{stream, to_f32, unit_f64};
use crate::sampler::{
    CosineHemisphere, Heuristic, MeshLight, Mixture, PhongLobe, Sampler, SeenFrom, Sides, UniformHemisphere,
};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

const HERE: Component = Component::Mixture;

pub(super) fn rows() -> Vec<Row> {
    let mut rows = ends();
    rows.extend(weights());
    rows.extend(passes());
    rows.extend(unseen());
    rows
}

/// A needle in directions that the other part never draws is where a mixture shows what it adds up.
fn needle() -> PhongLobe {
    PhongLobe::new(Vec3::new(0.6, 0.0, 0.8), 1e9).expect("a unit vector")
}

fn ends() -> Vec<Row> {
    let end = |c: f64, which: &str| {
        let ask = move |trial: &mut Trial| {
            let Some(mixture) = trial.accepted(Mixture::new(c, CosineHemisphere, needle())) else { return };
            for (i, [a, b]) in super::corner_pairs().chain(lattice(4_096)).enumerate() {
                let pick = super::CORNERS[i % super::CORNERS.len()];
                let part = match c {
                    0.0 => Sampler::sample(&needle(), &[a, b]),
                    _ => Sampler::sample(&CosineHemisphere, &[a, b]),
                };
                let found = mixture.sample(&[pick, a, b]);
                trial.must(found.map(|s| s.point) == part.map(|s| s.point), || {
                    format!("{found:?}, not {part:?}")
                });
                let (Some(found), Some(part)) = (found, part) else { continue };
                trial.compare(found.density, part.density, || format!("xi = ({pick}, {a}, {b})"));
                trial.compare(mixture.density(&found.point), part.density, || found.point);
            }
        };
        HERE.row(
            Kind::Value,
            format!("c = {c}"),
            format!("the {which} part, bit for bit"),
            (0.0, Unit::UlpF64),
            ask,
        )
    };
    // A part is lost if no variate picks it.
    let step = 0.5 * f64::EPSILON;
    let rare = |c: f64, input: &str| {
        let ask = move |trial: &mut Trial| {
            let Some(mixture) = trial.accepted(Mixture::new(c, CosineHemisphere, needle())) else { return };
            let parts =
                [Sampler::sample(&CosineHemisphere, &[0.3, 0.6]), Sampler::sample(&needle(), &[0.3, 0.6])];
            let mut reach = Reach::default();
            for (part, (interval, mass)) in parts.iter().zip([((0.0, c), c), ((c, 1.0), 1.0 - c)]) {
                let drawn = BITS.map(|bits| {
                    variates_in(interval, bits).any(|pick| {
                        let found = mixture.sample(&[pick, 0.3, 0.6]);
                        found.map(|s| s.point) == part.as_ref().map(|s| s.point)
                    })
                });
                reach.count(drawn, mass);
            }
            trial.reach(reach);
        };
        HERE.row(Kind::Value, input, "both parts are drawn", (0.0, Unit::Absolute), ask)
    };
    let nothing = |trial: &mut Trial| {
        let Some(mixture) = trial.accepted(Mixture::new(0.5, UniformHemisphere, needle())) else { return };
        for w in [DVec3::new(0.6, 0.0, -0.8), DVec3::NEG_Z, DVec3::new(1.0, 0.0, -1e-45)] {
            trial.compare(mixture.density(&w), 0.0, || format!("mixture at {w:?}"));
        }
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            trial.compare(heuristic.weight(0.0_f32, 0.0).into(), 0.0, || format!("{heuristic:?}"));
            trial.compare(heuristic.weight(0.0_f64, -0.0), 0.0, || format!("{heuristic:?}"));
        }
    };
    let refused = |trial: &mut Trial| {
        let mixture = Mixture::new(1.0_f64.next_up(), CosineHemisphere, UniformHemisphere);
        trial.refused(mixture, |e| matches!(e, crate::sampler::Error::Parameter { parameter: "c", .. }));
    };
    vec![
        end(0.0, "second"),
        end(1.0, "first"),
        rare(step, "c = 2^-53"),
        rare(1.0 - step, "c = 1 - 2^-53"),
        HERE.row(
            Kind::Value,
            "both densities 0",
            "density and weights 0, not NaN",
            (0.0, Unit::Absolute),
            nothing,
        ),
        HERE.row(Kind::Refusal, "c just over 1", "names c", (0.0, Unit::Absolute), refused),
    ]
}

/// The weight of the first of two densities, from their logarithms.
fn true_weight(heuristic: Heuristic, own: f64, other: f64) -> f64 {
    let power = if heuristic == Heuristic::Power { 2.0 } else { 1.0 };
    1.0 / (1.0 + (power * (other.ln() - own.ln())).exp())
}

fn weights() -> Vec<Row> {
    let mut rows = Vec::new();
    for (name, heuristic) in [("power", Heuristic::Power), ("balance", Heuristic::Balance)] {
        let pairs = |trial: &mut Trial, densities: &[f32], heuristic: Heuristic| {
            for &own in densities {
                for &other in densities {
                    let truth = true_weight(heuristic, own.into(), other.into());
                    trial.compare(heuristic.weight(own, other).into(), truth, || {
                        format!("{own:e} beside {other:e}")
                    });
                }
            }
        };
        rows.push(HERE.row(
            Kind::Value,
            format!("{name}: 1e20 and 2e-23 in f32"),
            "1 and 0, not NaN",
            (2.0, Unit::UlpF32),
            move |trial| {
                pairs(trial, &[1e20, 2e-23], heuristic);
                if heuristic == Heuristic::Power {
                    let (p, q) = (1e20_f32, 2e-23_f32);
                    trial.note(format!("p^2 / (p^2 + q^2) as it stands is {}", p * p / (p * p + q * q)));
                }
            },
        ));
        rows.push(HERE.row(
            Kind::Value,
            format!("{name}: 1e-45 to f32::MAX"),
            "right to the last bits, in pairs",
            (3.0, Unit::UlpF32),
            move |trial| {
                let decades = (-44..=38).map(|e| 10.0_f64.powi(e) as f32);
                let densities: Vec<f32> =
                    [1e-45, f32::MIN_POSITIVE, f32::MAX, 1.5, 1.0].into_iter().chain(decades).collect();
                pairs(trial, &densities, heuristic);
            },
        ));
        rows.push(HERE.row(
            Kind::Limit,
            format!("{name}: infinite densities"),
            "take all, and share it",
            (0.0, Unit::Absolute),
            move |trial| {
                let infinite = f32::INFINITY;
                trial.compare(heuristic.weight(infinite, 1.0).into(), 1.0, || "infinite beside 1");
                trial.compare(heuristic.weight(1.0, infinite).into(), 0.0, || "1 beside infinite");
                trial.compare(heuristic.weight(infinite, infinite).into(), 0.5, || "both infinite");
            },
        ));
    }
    rows
}

/// Running means.
fn passes() -> Vec<Row> {
    let after = |passes: u64, input: &str| {
        let ask = move |trial: &mut Trial| {
            let mut pixel = Pixel::default();
            let mut plain = 0.0_f32;
            for _ in 0..passes {
                pixel.add(DVec3::splat(0.5));
                plain += 0.5;
            }
            pixel.mean().into_iter().for_each(|mean| trial.compare(mean, 0.5, || "mean"));
            trial.must(pixel.standard_error() == [0.0; 3], || format!("{:?}", pixel.standard_error()));
            trial.note(format!("an f32 sum gives {:.3}", f64::from(plain) / passes as f64));
        };
        HERE.row(Kind::Value, input, "mean 0.5 exactly", (0.0, Unit::UlpF64), ask)
    };
    vec![after(1 << 25, "2^25 passes of 0.5"), after(100_000_000, "1e8 passes of 0.5").heavy()]
}

/// A white floor under a lamp, by directions of its BRDF and by points of the lamp.
fn unseen() -> Vec<Row> {
    let lamp = |edge: f32, expected: Judgement| {
        let ask = move |trial: &mut Trial| {
            let triangle =
                [Vec3::new(-edge, -edge, 1.0), Vec3::new(0.0, edge, 1.0), Vec3::new(edge, -edge, 1.0)];
            let Some(light) = trial.accepted(MeshLight::new(&[triangle], Sides::Both)) else { return };
            let (brdf, by_light) = (film(&light, true), film(&light, false));
            let [brdf, by_light] = [brdf, by_light].map(|film| film.blocks(8));
            let truth = irradiance_of_polygon(&triangle.map(|v| v.as_dvec3()), DVec3::Z) / PI;
            let found = super::mean(by_light.means.iter().map(|mean| mean[0]));
            trial.compare(found, truth, || "by points of the lamp");
            match compare(&brdf, &by_light, Rules::default(), |_, _| false) {
                Err(error) => trial.must(false, || error.to_string()),
                Ok(agreement) => {
                    let judgement = agreement.judgement(1e-3);
                    let (compared, too_few) = (agreement.compared, agreement.too_few);
                    trial.note(format!(
                        "{judgement:?}: {compared} means compared, {too_few} with too few samples"
                    ));
                    trial.must(judgement == expected, || format!("{judgement:?}, not {expected:?}"));
                }
            }
        };
        let size = format!("light of edge {edge:?}, by the BRDF only");
        let should = match expected {
            Judgement::Agree => "agrees with light sampling",
            _ => "inconclusive, not pass",
        };
        HERE.row(
            if expected == Judgement::Agree { Kind::Value } else { Kind::Limit },
            size,
            should,
            (5e-3, Unit::Relative),
            ask,
        )
    };
    vec![lamp(1e-4, Judgement::Inconclusive), lamp(1.0, Judgement::Agree)]
}

/// Radiance of a white diffuse floor under a lamp of radiance 1, 64 samples in each of 32 x 32 pixels.
fn film(light: &MeshLight, by_brdf: bool) -> Film {
    const SIDE: usize = 32;
    let mut film = Film::new(SIDE, SIDE);
    let lamp = SeenFrom::new(light, Vec3::ZERO);
    let mut rng = stream(1, if by_brdf { "stress by BRDF" } else { "stress by light" }, 0);
    for i in 0..64 * SIDE * SIDE {
        let [a, b, c] = [(); 3].map(|()| unit_f64(&mut rng));
        let radiance = if by_brdf {
            let w = CosineHemisphere.sample(Vec2::new(to_f32(a), to_f32(b))).as_dvec3();
            if lamp.density(&w) > 0.0 { 1.0 } else { 0.0 } // f cos / p = 1
        } else {
            light
                .sample_from(Vec3::ZERO, [a, b, c])
                .map_or(0.0, |s| f64::from(s.direction.z) / PI / s.density)
        };
        film.add(i % SIDE, i / SIDE % SIDE, DVec3::splat(radiance));
    }
    film
}
