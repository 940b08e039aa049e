//! What a scene needs, as a table for people and as JSON for programs.

use crate::estimator::Plan;
use std::fmt::Write;

/// One line a part: built or left out, bytes, time and why.
///
/// ```
/// use warpcheck::estimator::{LightSampling, Plan, Strategy};
/// let scene = warpcheck::scene::Scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml"))?;
/// let plan = Plan::of(&scene, &[Strategy::Light], LightSampling::default())?;
/// let table = warpcheck::report::plan_table(&plan);
/// assert!(table.contains("left out  environment map"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn plan_table(plan: &Plan) -> String {
    let mut out = format!("{:8}  {:21}  {:>10}  {:>10}  why\n", "", "part", "bytes", "ms");
    for part in plan.parts() {
        let state = if part.built { "built" } else { "left out" };
        let ms = part.time.as_secs_f64() * 1e3;
        let _ = writeln!(out, "{state:8}  {:21}  {:>10}  {ms:>10.3}  {}", part.name, part.bytes, part.why);
    }
    let _ = writeln!(
        out,
        "every sample: no shadow ray where the emission, the BRDF or the cosine is 0; no glossy lobe is drawn from for a material that has none"
    );
    out
}

/// All parts. `schema_version` grows when the meaning of a field changes.
#[cfg(feature = "json")]
pub fn plan_to_json(plan: &Plan) -> serde_json::Value {
    use serde_json::json;
    let parts = plan.parts().iter().map(|part| {
        json!({
            "name": part.name,
            "built": part.built,
            "why": part.why,
            "bytes": part.bytes,
            "seconds": part.time.as_secs_f64(),
        })
    });
    json!({
        "kind": "plan",
        "schema_version": 2,
        "program": concat!("warpcheck ", env!("CARGO_PKG_VERSION")),
        "parts": parts.collect::<Vec<_>>(),
    })
}
