//! What shows in no density: weights, light counts, films, streams.

use super::{Fault, Specimen, Twin};
use crate::random::{stream, unit_f64};
use crate::sampler::{CosineHemisphere, UniformHemisphere};
use crate::verify::{Values, estimator};
use glam::{Vec2, Vec3};
use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

/// Radiance of a sky that is brighter on one side.
fn sky(w: Vec3) -> f64 {
    f64::from(1.0 + 0.5 * w.x)
}

/// The irradiance under that sky: its slant cancels.
const IRRADIANCE: f64 = PI;

/// Two samples, one from each density, with the weights that `weights` gives for the first and the second.
fn two_samples([a, b, c, d]: [f32; 4], weights: fn(f64, f64) -> [f64; 2]) -> f64 {
    let term = |w: Vec3, density: f32, which: usize| {
        let (p, q) = (f64::from(CosineHemisphere.density(w)), f64::from(UniformHemisphere.density(w)));
        let share = weights(p, q)[which];
        if density > 0.0 { share * sky(w) * f64::from(w.z) / f64::from(density) } else { 0.0 }
    };
    let (w1, w2) = (CosineHemisphere.sample(Vec2::new(a, b)), UniformHemisphere.sample(Vec2::new(c, d)));
    term(w1, CosineHemisphere.density(w1), 0) + term(w2, UniformHemisphere.density(w2), 1)
}

const MIS: Twin = Twin::new("two samples under the balance heuristic", || {
    Specimen::Estimator(|| {
        estimator(|xi: [f32; 4]| two_samples(xi, |p, q| [p / (p + q), q / (p + q)]), IRRADIANCE)
    })
});

/// A delta light of this irradiance beside the sky, at this cosine.
const DELTA: (f64, f64) = (4.0, 0.8);

fn with_delta(xi: [f32; 4], weight: f64) -> f64 {
    DELTA.0 * weight + two_samples(xi, |p, q| [p / (p + q), q / (p + q)])
}

const DELTA_LIGHT: Twin = Twin::new("a delta light and a sky", || {
    Specimen::Estimator(|| estimator(|xi: [f32; 4]| with_delta(xi, 1.0), IRRADIANCE + DELTA.0))
});

const LIGHTS: [f64; 5] = [1.0, 3.0, 0.5, 2.0, 1.5];

/// One of the lights, each as likely as the others, divided by the probability for `count` of them.
fn one_light(xi: f32, count: f64) -> f64 {
    LIGHTS[((5.0 * xi) as usize).min(4)] * count
}

const COUNT: Twin =
    Twin::new("one of five lights", || Specimen::Estimator(|| estimator(|xi: f32| one_light(xi, 5.0), 8.0)));

/// Sums each stream on a thread of its own.
fn film(streams: Vec<Values>) -> f64 {
    let sums: Vec<(f64, u64)> = std::thread::scope(|scope| {
        let threads: Vec<_> = streams
            .into_iter()
            .map(|values| {
                scope.spawn(move || {
                    values.fold((0.0, 0), |(sum, n), value| (sum + value.unwrap_or(0.0), n + 1))
                })
            })
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap_or((f64::NAN, 0))).collect()
    });
    let (sum, count) = sums.into_iter().fold((0.0, 0), |(a, n), (b, m)| (a + b, n + m));
    sum / f64::max(count as f64, 1.0)
}

const FILM: Twin = Twin::new("film with a sum a thread", || Specimen::Film(film));

/// Adds to one sum from all threads, by a load and a store where an exchange belongs.
fn racing(streams: Vec<Values>) -> f64 {
    let (sum, count) = (AtomicU64::new(0), AtomicU64::new(0));
    let add = |values: Values| {
        for value in values {
            let seen = f64::from_bits(sum.load(Ordering::Relaxed));
            // Between load and store another thread may add; on one core it is let.
            if count.fetch_add(1, Ordering::Relaxed).is_multiple_of(64) {
                std::thread::yield_now();
            }
            sum.store((seen + value.unwrap_or(0.0)).to_bits(), Ordering::Relaxed);
        }
    };
    std::thread::scope(|scope| {
        for values in streams {
            scope.spawn(|| add(values));
        }
    });
    f64::from_bits(sum.into_inner()) / f64::max(count.into_inner() as f64, 1.0)
}

fn in_order<T>(streams: Vec<Values>, start: T, add: impl FnMut(T, Option<f64>) -> T) -> T {
    streams.into_iter().flatten().fold(start, add)
}

/// Points of four threads, each with the stream that `number` gives it.
fn threads(seed: u64, number: fn(u64) -> u64) -> Vec<Vec<[f64; 2]>> {
    let points = |thread: u64| {
        let mut rng = stream(seed, "threads", number(thread));
        (0..4096).map(|_| [unit_f64(&mut rng), unit_f64(&mut rng)]).collect()
    };
    (0..4).map(points).collect()
}

const STREAMS: Twin =
    Twin::new("streams of four threads", || Specimen::Streams(|seed| threads(seed, |thread| thread)));

pub(super) fn faults() -> Vec<Fault> {
    vec![
        Fault::new(
            "estimators/weights-not-summing-to-1",
            "one weight by the balance heuristic, the other by the power heuristic",
            MIS,
            || {
                Specimen::Estimator(|| {
                    estimator(
                        |xi: [f32; 4]| two_samples(xi, |p, q| [p / (p + q), q * q / (p * p + q * q)]),
                        IRRADIANCE,
                    )
                })
            },
        )
        .seen("gkjohnson/three-gpu-pathtracer #847, NVIDIA/VisRTX PR 311")
        .caught(&["mean"], &[])
        .no_sampler(),
        Fault::new(
            "estimators/delta-light-weighted",
            "a delta light gets a MIS weight, though nothing else can hit it",
            DELTA_LIGHT,
            || {
                Specimen::Estimator(|| {
                    estimator(|xi: [f32; 4]| with_delta(xi, 1.0 / (1.0 + DELTA.1 / PI)), IRRADIANCE + DELTA.0)
                })
            },
        )
        .seen("nvpro-samples/vk_gltf_renderer #38, bevyengine/bevy #21967")
        .caught(&["mean"], &[])
        .no_sampler(),
        Fault::new(
            "estimators/wrong-light-count",
            "the probability of a light leaves one of them out of the count",
            COUNT,
            || Specimen::Estimator(|| estimator(|xi: f32| one_light(xi, 4.0), 8.0)),
        )
        .seen("RenderKit/ospray #552 (1 / (numLights - numGeoLights))")
        .caught(&["mean"], &["constant 4 / 5"])
        .no_sampler(),
        Fault::new("estimators/f32-film", "the film's sum is an f32, and stalls", FILM, || {
            Specimen::Film(|streams| {
                let (sum, count) = in_order(streams, (0.0_f32, 0_u64), |(sum, n), value| {
                    (sum + value.unwrap_or(0.0) as f32, n + 1)
                });
                f64::from(sum) / count.max(1) as f64
            })
        })
        .seen("mitsuba-renderer/mitsuba2 #82 (0.5 becomes 1 at 1e8 samples), LoveDaisy/ice_halo_sim PR 380")
        .caught(&["film"], &["constant"])
        .no_sampler(),
        Fault::new(
            "estimators/race-in-the-film",
            "two threads add to one pixel by load and store",
            FILM,
            || Specimen::Film(racing),
        )
        .seen("VITA-Group/LightGaussian #24 (a non-atomic += in a kernel)")
        .caught(&["film"], &["threads"])
        .no_sampler(),
        Fault::new("estimators/same-streams", "two threads start with one seed", STREAMS, || {
            Specimen::Streams(|seed| threads(seed, |thread| thread / 2))
        })
        .seen("JiayinCao/SORT #35")
        .caught(&["streams"], &["equal points"])
        .no_sampler(),
        Fault::new("estimators/rejected-not-counted", "rejected samples are left out of N", FILM, || {
            Specimen::Film(|streams| {
                let (sum, count) = in_order(streams, (0.0, 0_u64), |(sum, n), value| match value {
                    Some(value) => (sum + value, n + 1),
                    None => (sum, n),
                });
                if count > 0 { sum / count as f64 } else { 0.0 }
            })
        })
        .seen("discussed in RayTracing/raytracing.github.io #1021")
        .caught(&["film"], &["rejected"])
        .no_sampler(),
        Fault::new(
            "estimators/nan-in-the-film",
            "a pixel without an accepted sample divides 0 by 0",
            FILM,
            || {
                Specimen::Film(|streams| {
                    let (sum, count, all) = in_order(streams, (0.0, 0_u64, 0_u64), |(sum, n, all), value| {
                        (sum + value.unwrap_or(0.0), n + u64::from(value.is_some()), all + 1)
                    });
                    (sum / count as f64) * (count as f64 / all as f64)
                })
            },
        )
        .seen("RayTracing/raytracing.github.io #979 (black and white dots)")
        .caught(&["film"], &["nothing"])
        .no_sampler(),
    ]
}
