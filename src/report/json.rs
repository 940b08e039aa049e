//! A run as JSON, with a version, so that programs can rely on its shape.

use crate::verify::{Diagnosis, EdgeProbe, Evidence, Report, Verdict};
use serde_json::{Value, json};

fn verdict(v: Verdict) -> String {
    v.to_string()
}

/// A number, or null where JSON has none for it.
fn number(x: f64) -> Value {
    serde_json::Number::from_f64(x).map_or(Value::Null, Value::Number)
}

fn diagnosis(d: &Diagnosis) -> Value {
    let others = d
        .others
        .iter()
        .map(|(name, behind)| json!({ "name": name, "ln_likelihood_behind": number(*behind) }));
    json!({
        "name": d.name,
        "alike": d.alike,
        "text": d.text,
        "explains": d.explains,
        "ln_likelihood_gain": number(d.gain),
        "ln_likelihood_margin": d.margin.map_or(Value::Null, number),
        "others": others.collect::<Vec<_>>(),
    })
}

fn edge(edge: &EdgeProbe) -> Value {
    json!({
        "variate": edge.variate,
        "value": edge.value,
        "point": edge.point,
        "density": number(edge.density),
        "wrong": edge.wrong,
    })
}

/// Everything that a run found. `schema_version` grows when the meaning of a field changes.
///
/// ```
/// use warpcheck::sampler::UniformSphere;
/// let report = warpcheck::verify(&UniformSphere).samples(50_000).run();
/// let json = warpcheck::report::to_json(&report, |name| format!("warpcheck verify {name}"));
/// assert_eq!(json["schema_version"], 3);
/// assert_eq!(json["samplers"][0]["verdict"], "pass");
/// ```
pub fn to_json(report: &Report, replay: impl Fn(&str) -> String) -> Value {
    let samplers = report.examinations.iter().enumerate().map(|(i, e)| {
        let findings = report.conclusions[i].iter().map(|c| {
            let (p, conservative) = match c.finding.evidence.p_values() {
                None => (Value::Null, Value::Null),
                Some((p, conservative)) => (number(p), number(conservative)),
            };
            let ln_e = match c.finding.evidence {
                Evidence::Betting { conservative, .. } => number(conservative),
                _ => Value::Null,
            };
            json!({
                "check": c.finding.check,
                "part": c.finding.part,
                "verdict": verdict(c.verdict),
                "p": p,
                "p_conservative": conservative,
                "p_adjusted": c.adjusted_p.map_or(Value::Null, number),
                "ln_e": ln_e,
                "decides": c.finding.evidence != Evidence::Unanswered,
                "detail": c.finding.detail,
                "would_have_caught": c.finding.sees,
            })
        });
        let worst = e.worst_cells(10).into_iter().map(|cell| {
            json!({
                "place": cell.place,
                "observed": cell.observed,
                "expected": number(cell.expected),
                "residual": number(cell.residual()),
            })
        });
        let power = e.power(report.level());
        let power = power
            .iter()
            .map(|p| json!({ "mass": p.mass, "relative_error": number(p.error), "probability": 0.99 }));
        let phases =
            e.phases.iter().map(|(name, time)| json!({ "name": name, "seconds": time.as_secs_f64() }));
        json!({
            "name": e.name,
            "domain": e.domain,
            "per": e.per,
            "verdict": verdict(report.verdict_on(i)),
            "samples": e.samples,
            "rejected": e.rejected,
            "integral": { "value": number(e.integral.0), "error": number(e.integral.1) },
            "findings": findings.collect::<Vec<_>>(),
            "worst_cells": worst.collect::<Vec<_>>(),
            "power": power.collect::<Vec<_>>(),
            "diagnosis": e.diagnosis.as_ref().map_or(Value::Null, diagnosis),
            "p_by_samples": e.history.iter().map(|l| json!({ "samples": l.samples, "p": number(l.p) })).collect::<Vec<_>>(),
            "edges": e.edges.iter().map(edge).collect::<Vec<_>>(),
            "seconds": e.time.as_secs_f64(),
            "phases": phases.collect::<Vec<_>>(),
            "replay": replay(&e.name),
        })
    });
    json!({
        "kind": "verify",
        "schema_version": 3,
        "program": concat!("warpcheck ", env!("CARGO_PKG_VERSION")),
        "verdict": verdict(report.verdict()),
        "seed": report.seed,
        "samples": report.samples,
        "alpha": report.alpha,
        "tests": report.tests,
        "samplers": samplers.collect::<Vec<_>>(),
    })
}
