//! Histograms and renders as JSON for programs: what was drawn and how long it took.

use crate::estimator::Rendered;
use crate::histogram::Histogram;
use serde_json::{Value, json};
use std::time::Duration;

/// Histograms of one target at several counts, each with the time that it took. `schema_version` grows when the meaning of a field changes.
pub fn histograms_to_json(target: &str, seed: u64, drawn: &[(Histogram, Duration)]) -> Value {
    let runs = drawn.iter().map(|(h, time)| {
        json!({
            "samples": h.samples,
            "rejected": h.rejected,
            "outside": h.outside,
            "width": h.width,
            "height": h.height,
            "empty_pixels": h.counts.iter().filter(|c| **c == 0).count(),
            "largest_count": h.counts.iter().max(),
            "seconds": time.as_secs_f64(),
        })
    });
    json!({
        "kind": "histogram",
        "schema_version": 1,
        "program": concat!("warpcheck ", env!("CARGO_PKG_VERSION")),
        "target": target,
        "seed": seed,
        "histograms": runs.collect::<Vec<_>>(),
    })
}

/// Pictures of one scene. `schema_version` grows when the meaning of a field changes.
pub fn renders_to_json(scene: &str, seed: u64, rendered: &[Rendered]) -> Value {
    let pictures = rendered.iter().map(|r| {
        let pixels = r.film.pixels();
        let sum = pixels.iter().fold([0.0; 3], |sum: [f64; 3], p| {
            let mean = p.mean();
            [sum[0] + mean[0], sum[1] + mean[1], sum[2] + mean[2]]
        });
        let error = r.film.relative_error();
        json!({
            "strategy": r.strategy.to_string(),
            "samples_a_pixel": r.passes,
            "width": r.film.width(),
            "height": r.film.height(),
            "mean_radiance": sum.map(|s| s / pixels.len() as f64),
            // Of less than two samples nothing is known.
            "relative_standard_error": if error.is_finite() { json!(error) } else { Value::Null },
            "non_finite": r.non_finite,
            "seconds": r.time.as_secs_f64(),
        })
    });
    json!({
        "kind": "render",
        "schema_version": 1,
        "program": concat!("warpcheck ", env!("CARGO_PKG_VERSION")),
        "scene": scene,
        "seed": seed,
        "pictures": pictures.collect::<Vec<_>>(),
    })
}
