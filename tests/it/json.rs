//! What `--json` writes is what docs/json.schema.json says: no field is missing, none is undocumented.

use assert_cmd::cargo::cargo_bin;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::tempdir;

/// The part of JSON Schema that ours uses; a word that isn't known here is a mistake, not a rule that is passed over.
struct Schema(Value);

impl Schema {
    fn load() -> Self {
        let text = fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/json.schema.json")).unwrap();
        Self(serde_json::from_slice(&text).unwrap())
    }

    fn of_kind(&self, kind: &str) -> Value {
        json!({ "$ref": format!("#/$defs/{kind}") })
    }

    /// What is wrong with `value`, and where.
    fn check(&self, rule: &Value, value: &Value, at: &str) -> Result<(), String> {
        let fail = |why: String| Err(format!("{at}: {why}"));
        for (word, said) in rule.as_object().unwrap() {
            match word.as_str() {
                "$schema" | "title" | "description" | "$defs" => {}
                "$ref" => {
                    let name = said.as_str().unwrap().strip_prefix("#/$defs/").unwrap();
                    self.check(&self.0["$defs"][name], value, at)?;
                }
                "anyOf" => {
                    let tried: Vec<_> =
                        said.as_array().unwrap().iter().map(|rule| self.check(rule, value, at)).collect();
                    if !tried.iter().any(Result::is_ok) {
                        return fail(format!("none of {tried:?}"));
                    }
                }
                "const" if said != value => return fail(format!("{value} is not {said}")),
                "enum" if !said.as_array().unwrap().contains(value) => {
                    return fail(format!("{value} is none of {said}"));
                }
                "const" | "enum" => {}
                "type" => {
                    let is = |name: &Value| match name.as_str().unwrap() {
                        "integer" => value.is_u64() || value.is_i64(),
                        "number" => value.is_number(),
                        "string" => value.is_string(),
                        "boolean" => value.is_boolean(),
                        "null" => value.is_null(),
                        "array" => value.is_array(),
                        "object" => value.is_object(),
                        other => panic!("the type {other} is not known here"),
                    };
                    let fits = said.as_array().map_or_else(|| is(said), |names| names.iter().any(is));
                    if !fits {
                        return fail(format!("{value} is not of type {said}"));
                    }
                }
                "minimum" if value.as_f64() < said.as_f64() && !value.is_null() => {
                    return fail(format!("{value} < {said}"));
                }
                "maximum" if value.as_f64() > said.as_f64() => return fail(format!("{value} > {said}")),
                "minimum" | "maximum" => {}
                "items" => {
                    for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                        self.check(said, item, &format!("{at}[{i}]"))?;
                    }
                }
                "properties" => {
                    for (name, item) in value.as_object().into_iter().flatten() {
                        if let Some(rule) = said.get(name) {
                            self.check(rule, item, &format!("{at}.{name}"))?;
                        }
                    }
                }
                "required" => {
                    let missing =
                        said.as_array().unwrap().iter().find(|n| value.get(n.as_str().unwrap()).is_none());
                    if let Some(name) = missing.filter(|_| value.is_object()) {
                        return fail(format!("{name} is missing"));
                    }
                }
                "additionalProperties" => {
                    let known = |name: &str| rule.get("properties").is_some_and(|p| p.get(name).is_some());
                    for (name, item) in
                        value.as_object().into_iter().flatten().filter(|(name, _)| !known(name))
                    {
                        if said == &Value::Bool(false) {
                            return fail(format!("{name} is not documented"));
                        }
                        self.check(said, item, &format!("{at}.{name}"))?;
                    }
                }
                other => panic!("the rule {other} is not known here"),
            }
        }
        Ok(())
    }
}

fn run(folder: &Path, words: &str, codes: &[i32]) -> Value {
    let mut command = Command::new(cargo_bin!("warpcheck"));
    command
        .current_dir(folder)
        .args(words.split_whitespace())
        .args(["--json", "run.json"])
        .stdin(Stdio::null());
    let output = command.output().unwrap();
    assert!(codes.contains(&output.status.code().unwrap()), "{words}: {output:?}");
    serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap()
}

#[test]
fn all_documents_follow_the_schema() {
    let folder = tempdir().unwrap();
    let data = |file: &str| format!("{}/data/scene/{file}", env!("CARGO_MANIFEST_DIR"));
    let scene = fs::read_to_string(data("cornell.toml")).unwrap();
    let scene = scene.replace("cornell_measured.obj", &data("cornell_measured.obj")).replace("256", "16");
    fs::write(folder.path().join("stamp.toml"), scene).unwrap();
    for file in ["furnace.toml", "furnace.obj", "furnace.mtl", "white.hdr"] {
        fs::copy(data(file), folder.path().join(file)).unwrap();
    }
    let schema = Schema::load();
    for (kind, words, codes) in [
        (
            "verify",
            "verify broken/triangle/branch-squared broken/lobes/uniform-for-cosine triangle --samples 10k",
            [1],
        ),
        ("verify", "verify triangle/low-distortion --samples 20k --anytime", [0]),
        ("faults", "faults triangle/branch-squared estimators/f32-film --seeds 1 --samples 5k", [0]),
        ("stress", "stress mixture triangle --quick", [0]),
        ("histogram", "histogram triangle/low-distortion --samples 1k,2k --height 16", [0]),
        ("render", "render stamp.toml --strategy light,brdf --spp 1,2", [0]),
        ("plan", "plan stamp.toml", [0]),
        ("converge", "converge stamp.toml --strategy light,brdf --spp 8 --seeds 2", [0]),
        ("converge", "converge stamp.toml --strategy light --spp 2 --seeds 2 --reference 0.5", [0]),
        ("converge", "converge furnace.toml --strategy uniform,brdf --spp 2 --seeds 2", [0]),
        ("agree", "agree stamp.toml --strategy light,brdf --spp 32 --allow-inconclusive", [0]),
        ("calibrate", "calibrate triangle/low-distortion --runs 2 --samples 2k --peeking 17k", [0]),
    ] {
        let document = run(folder.path(), words, &codes);
        assert_eq!(document["kind"], kind, "{words}");
        schema.check(&schema.of_kind(kind), &document, kind).unwrap_or_else(|why| panic!("{words}: {why}"));
        schema.check(&schema.0, &document, "any").unwrap();
        // It would notice.
        let mut more = document.clone();
        more["surprise"] = true.into();
        assert!(
            schema
                .check(&schema.of_kind(kind), &more, kind)
                .unwrap_err()
                .contains("surprise is not documented")
        );
        let mut less = document.clone();
        less.as_object_mut().unwrap().remove("program");
        assert!(schema.check(&schema.of_kind(kind), &less, kind).unwrap_err().contains("missing"));
        let mut other = document;
        other["schema_version"] = 99.into();
        assert!(schema.check(&schema.of_kind(kind), &other, kind).is_err());
    }
}

#[test]
fn p_values_on_the_way_tell_right_from_wrong() {
    let folder = tempdir().unwrap();
    let words = "verify broken/lobes/uniform-for-cosine triangle/low-distortion --samples 200k --seed 3";
    let document = run(folder.path(), words, &[1]);
    let path = |i: usize| -> Vec<(u64, f64)> {
        let looks = document["samplers"][i]["p_by_samples"].as_array().unwrap().iter();
        looks.map(|l| (l["samples"].as_u64().unwrap(), l["p"].as_f64().unwrap())).collect()
    };
    let (wrong, right) = (path(0), path(1));
    assert_eq!(wrong.iter().map(|l| l.0).collect::<Vec<_>>(), [16384, 32768, 65536, 131_072, 200_000]);
    assert!(wrong.windows(2).all(|w| w[1].1 <= w[0].1) && wrong[0].1 < 1e-6, "{wrong:?}");
    assert!(right.iter().all(|l| l.1 > 1e-4), "{right:?}");
    // 14 edge values of each of two variates, all sound.
    let edges = document["samplers"][1]["edges"].as_array().unwrap();
    assert!(
        edges.len() == 28 && edges.iter().all(|e| e["wrong"].is_null() && e["density"].as_f64() > Some(0.0))
    );
    let phases = document["samplers"][1]["phases"].as_array().unwrap();
    let sum: f64 = phases.iter().map(|p| p["seconds"].as_f64().unwrap()).sum();
    assert!(phases.len() == 4 && sum <= document["samplers"][1]["seconds"].as_f64().unwrap());
}
