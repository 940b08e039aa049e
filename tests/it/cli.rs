//! The program as its users meet it: exit codes, the files that it leaves, what it says, Ctrl-C.

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::{TempDir, tempdir};
use warpcheck::picture::{Picture, Planes, read, read_planes, write_exr};

const CORNELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml");

/// `warpcheck` with these words as arguments, to run in this folder.
fn warpcheck(folder: &TempDir, words: &str) -> Command {
    let mut command = Command::new(cargo_bin!("warpcheck"));
    command.current_dir(folder.path()).args(words.split_whitespace()).env_remove("COLUMNS");
    command.stdin(Stdio::null());
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Runs it and returns what it printed.
#[track_caller]
fn exits(folder: &TempDir, words: &str, code: i32) -> String {
    let Output { status, stdout, stderr } = warpcheck(folder, words).output().unwrap();
    let (stdout, stderr) = (text(&stdout), text(&stderr));
    assert_eq!(status.code(), Some(code), "{words}\n{stdout}\n{stderr}");
    assert_eq!(stderr, "", "{words}");
    stdout
}

/// The files under a folder, relative to it, in order; none if there is no such folder.
fn files(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).into_iter().flatten() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                false => found.push(path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned()),
            }
        }
    }
    found.sort();
    found
}

/// Width and height of a PNG, which is decoded to the end.
fn png(path: impl AsRef<Path>) -> (u32, u32) {
    let picture = image::open(path.as_ref()).unwrap().into_rgb8();
    assert!(picture.pixels().any(|p| p != picture.get_pixel(0, 0)), "{} is blank", path.as_ref().display());
    picture.dimensions()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn keys(object: &Value) -> Vec<&str> {
    object.as_object().unwrap().keys().map(String::as_str).collect()
}

fn sum(planes: &Planes, name: &str) -> f64 {
    planes.get(name).unwrap().iter().map(|&x| f64::from(x)).sum()
}

// ---- what it says of itself ----

#[test]
fn help_fits_a_screen() {
    let folder = tempdir().unwrap();
    let help = exits(&folder, "--help", 0);
    assert!(help.lines().count() <= 50 && help.lines().all(|line| line.chars().count() <= 100), "{help}");
    for verb in
        ["verify", "calibrate", "faults", "stress", "histogram", "render", "plan", "converge", "agree"]
    {
        let help = exits(&folder, &format!("{verb} --help"), 0);
        assert!(help.lines().count() <= 50 && help.lines().all(|line| line.chars().count() <= 100), "{help}");
        assert_eq!(exits(&folder, &format!("help {verb}"), 0), help);
    }
    // `check --help` has all conventions, and takes two screens.
    let check = exits(&folder, "check -h", 0);
    assert!(check.lines().count() <= 50 && check.lines().all(|line| line.chars().count() <= 100), "{check}");
    insta::assert_snapshot!(help, @r"
    Find out whether Monte Carlo samplers are right, and how good they are.

    Without a command: verifies every sampler that ships, and makes a report.

    Usage: warpcheck [COMMAND]

    Commands:
      verify     Check samplers: all that ship, or those named (a family like `phong`, or `phong/50`)
      check      Check a sampler that is not in Rust: its samples from a file or a pipe, or the program
                 itself
      calibrate  Measure how often right samplers fail, beside how often they may
      faults     Run the battery on broken samplers, each beside its correct twin
      stress     Give samplers inputs that break f32, and tell what happened beside what should
      histogram  Draw samples of a map or of a shipped sampler and write their histogram
      render     Render a scene with one strategy, or all of them as a contact sheet
      converge   Measure the error of strategies against run time
      agree      Find out whether strategies agree with one another and with a reference
      plan       Show what a scene needs and what is left out, and why
      help       Print this message or the help of the given subcommand(s)

    Options:
      -h, --help
              Print help (see a summary with '-h')

      -V, --version
              Print version

    Examples:
      warpcheck                                       verify all that ships: warpcheck-out/index.html
      warpcheck verify environment --samples 10M      the environment maps only, with more samples
      warpcheck verify phong --report out             a family; a page for the browser, out/index.html
      warpcheck verify --list                         what there is
      warpcheck check --sampler 'python3 mine.py'     a sampler that is not in Rust (docs/protocol.md)
      warpcheck check dirs.npy --domain sphere        samples x,y,z,pdf from NumPy
      warpcheck calibrate --runs 1k                   false alarms of right samplers, measured
      warpcheck faults --list                         mistakes, most of them made in public
      warpcheck faults                                what catches them, and after how many samples
      warpcheck stress environment                    what maps of odd sizes and enormous range do
      warpcheck histogram data/env/noon_grass_512.hdr --samples 1M,10M,100M
      warpcheck histogram triangle/low-distortion     a shipped sampler on its own domain
      warpcheck render data/scene/veach_a3.toml --strategy mis:0.5 --spp 64
      warpcheck render data/scene/veach_a3.toml --sheet
      warpcheck converge data/scene/veach_a3.toml     error against run time, strategy by strategy
      warpcheck agree data/scene/cornell.toml         do the strategies estimate the same picture?
      warpcheck render data/scene/cornell.toml --error 0.02 --film
      warpcheck plan data/scene/cornell.toml          what the scene needs, and what is left out

    Exit codes: 0 pass, 1 fail, 2 bad input, 3 inconclusive, 130 Ctrl-C (what was done is kept).
    Also: warpcheck completions SHELL, warpcheck man [COMMAND].
    Counts take the suffixes k, M and G. Same seed, same bits, on any number of threads.
    ");
}

#[test]
fn the_list_names_every_sampler_and_every_name_is_found() {
    let folder = tempdir().unwrap();
    let list = exits(&folder, "verify --list", 0);
    let names: Vec<&str> = list.lines().map(|line| line.split("  ").next().unwrap()).collect();
    assert!(list.lines().all(|line| line.split_whitespace().count() > 2), "{list}");
    let families: BTreeSet<&str> = names.iter().map(|name| name.split('/').next().unwrap()).collect();
    let expected = [
        "broken",
        "discrete",
        "environment",
        "ggx",
        "hemisphere",
        "light",
        "mixture",
        "phong",
        "sphere",
        "triangle",
        "vmf",
    ];
    assert_eq!(families, expected.into());
    for map in ["blender_interior_512", "noon_grass_512", "potsdamer_platz_512", "spruit_sunrise_1k"] {
        for rows in ["uniform-v", "uniform-cos"] {
            assert!(names.contains(&format!("environment/{map}/{rows}").as_str()), "{list}");
        }
    }
    assert_eq!(exits(&folder, &format!("verify --list {}", names.join(" ")), 0), list);
    let triangles = exits(&folder, "verify --list triangle", 0);
    assert_eq!(triangles.lines().count(), 2, "{triangles}");
    assert_eq!(files(folder.path()), [""; 0]);
}

// ---- verify ----

/// What depends on the clock, out.
fn without_times(mut report: Value) -> Value {
    for sampler in report["samplers"].as_array_mut().unwrap() {
        assert!(sampler.as_object_mut().unwrap().remove("seconds").is_some_and(|s| s.as_f64() > Some(0.0)));
        assert!(sampler.as_object_mut().unwrap().remove("phases").is_some_and(|p| p.is_array()));
    }
    report
}

#[test]
fn verify_tells_people_and_programs() {
    let folder = tempdir().unwrap();
    let out = exits(&folder, "verify phong/50 triangle --samples 50k --out out --json out/run.json", 0);
    let names = ["phong/50", "triangle/low-distortion", "triangle/square-root"];
    let table: Vec<&str> = out.lines().skip(1).take_while(|line| !line.is_empty()).collect();
    let named: Vec<&str> = table.iter().map(|line| line.split_whitespace().next().unwrap()).collect();
    assert_eq!(named, names, "{out}");
    assert!(table.iter().all(|line| line.contains(" pass ") && line.contains(" 50000 ")), "{out}");
    assert!(out.contains("pass: 3 of 3 samplers pass, 0 fail, 0 inconclusive"), "{out}");
    let pictures =
        ["overview.png", "phong-50.png", "triangle-low-distortion.png", "triangle-square-root.png"];
    let mut left = files(&folder.path().join("out"));
    left.retain(|name| name != "run.json");
    assert_eq!(left, pictures);
    for picture in pictures {
        let (width, height) = png(folder.path().join("out").join(picture));
        assert!(width > 700 && height > 256, "{picture}: {width} x {height}");
    }

    let report = json(&folder.path().join("out/run.json"));
    let top =
        ["alpha", "kind", "program", "samplers", "samples", "schema_version", "seed", "tests", "verdict"];
    assert_eq!(keys(&report), top);
    assert_eq!((&report["schema_version"], &report["verdict"]), (&3.into(), &"pass".into()));
    assert_eq!(
        (&report["seed"], &report["samples"], &report["alpha"]),
        (&1.into(), &50_000.into(), &0.001.into())
    );
    let samplers = report["samplers"].as_array().unwrap();
    assert_eq!(samplers.iter().map(|s| s["name"].as_str().unwrap()).collect::<Vec<_>>(), names);
    let mut tests = 0;
    for sampler in samplers {
        let all = [
            "diagnosis",
            "domain",
            "edges",
            "findings",
            "integral",
            "name",
            "p_by_samples",
            "per",
            "phases",
            "power",
            "rejected",
            "replay",
            "samples",
            "seconds",
            "verdict",
            "worst_cells",
        ];
        assert_eq!(keys(sampler), all);
        assert_eq!((&sampler["samples"], &sampler["verdict"]), (&50_000.into(), &"pass".into()));
        let command = format!("warpcheck verify {} ", sampler["name"].as_str().unwrap());
        assert!(sampler["replay"].as_str().unwrap().starts_with(&command));
        let integral = &sampler["integral"];
        assert_eq!(keys(integral), ["error", "value"]);
        assert!(integral["value"].as_f64().unwrap() > 0.98 && integral["error"].as_f64().unwrap() < 1e-3);
        for finding in sampler["findings"].as_array().unwrap() {
            let all = [
                "check",
                "decides",
                "detail",
                "ln_e",
                "p",
                "p_adjusted",
                "p_conservative",
                "part",
                "verdict",
                "would_have_caught",
            ];
            assert_eq!(keys(finding), all);
            assert_eq!(finding["p"].is_null(), finding["p_adjusted"].is_null());
            tests += u64::from(finding["p"].is_number());
        }
        let cells = sampler["worst_cells"].as_array().unwrap();
        assert!(!cells.is_empty() && cells.len() <= 10);
        for cell in cells {
            assert_eq!(keys(cell), ["expected", "observed", "place", "residual"]);
        }
        let power = sampler["power"].as_array().unwrap();
        assert!(!power.is_empty());
        for p in power {
            assert_eq!(keys(p), ["mass", "probability", "relative_error"]);
        }
    }
    assert_eq!(report["tests"].as_u64(), Some(tests));

    // The line that replays one of them is a line that works, and finds the same.
    let replay = samplers[0]["replay"].as_str().unwrap().strip_prefix("warpcheck ").unwrap();
    exits(&folder, &format!("{replay} --out again --json again.json"), 0);
    let again = json(&folder.path().join("again.json"));
    for field in ["worst_cells", "rejected", "integral"] {
        assert_eq!(again["samplers"][0][field], samplers[0][field]);
    }
}

#[test]
fn a_seed_fixes_every_bit_on_any_number_of_threads() {
    let folder = tempdir().unwrap();
    let run = |threads: &str, seed: u32, out: &str| {
        let names = "phong/50-grazing discrete/areas-spot triangle/low-distortion";
        let words = format!("verify {names} --samples 40k --seed {seed} --out {out} --json {out}/run.json");
        let output = warpcheck(&folder, &words).env("RAYON_NUM_THREADS", threads).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let path = folder.path().join(out);
        let pictures = files(&path).into_iter().filter(|name| name.ends_with(".png"));
        let pictures: Vec<Vec<u8>> = pictures.map(|name| fs::read(path.join(name)).unwrap()).collect();
        assert_eq!(pictures.len(), 4);
        (without_times(json(&path.join("run.json"))), pictures)
    };
    let one = run("1", 7, "one");
    assert_eq!(one, run("2", 7, "two"));
    let other = run("2", 8, "other");
    assert_ne!(one.0["samplers"][0]["worst_cells"], other.0["samplers"][0]["worst_cells"]);
}

#[test]
fn too_few_samples_are_inconclusive() {
    let folder = tempdir().unwrap();
    let out = exits(&folder, "verify triangle/low-distortion --samples 10 --out out", 3);
    assert!(out.contains("inconclusive: triangle/low-distortion"), "{out}");
    assert!(out.contains("10 samples are too few"), "{out}");
    assert!(
        out.contains("replay: warpcheck verify triangle/low-distortion --samples 10 --seed 1 --alpha 0.001"),
        "{out}"
    );
    let planes = read_planes(folder.path().join("out/triangle-low-distortion.exr")).unwrap();
    assert_eq!(planes.names().collect::<Vec<_>>(), ["expected", "observed", "residual"]);
    exits(&folder, "verify triangle/low-distortion --samples 10 --out out --allow-inconclusive", 0);
}

#[test]
fn a_failure_says_what_where_and_how_to_see_it_again() {
    let folder = tempdir().unwrap();
    let broken =
        ["branch-squared", "no-square-root", "fold-missing"].map(|name| format!("broken/triangle/{name}"));
    let words =
        format!("verify {} triangle --samples 20k --seed 4 --out out --json run.json", broken.join(" "));
    let out = exits(&folder, &words, 1);
    assert!(out.contains("\nfail: 2 of 5 samplers pass, 3 fail, 0 inconclusive"), "{out}");
    let report = json(&folder.path().join("run.json"));
    assert_eq!(report["verdict"], "fail");
    let samplers = report["samplers"].as_array().unwrap();
    let mut by_counts = 0;
    for sampler in samplers {
        let name = sampler["name"].as_str().unwrap();
        let broken = name.starts_with("broken/");
        let exr = folder.path().join(format!("out/{}.exr", name.replace('/', "-")));
        assert_eq!((sampler["verdict"] == "fail", exr.exists()), (broken, broken), "{name}");
        if !broken {
            continue;
        }
        let begin = out.lines().skip_while(|line| *line != format!("fail: {name}"));
        let story: Vec<&str> = begin.take_while(|line| !line.is_empty()).collect();
        assert!(story.iter().any(|line| line.starts_with("  fail: ")), "{out}");
        let replay = format!("  replay: warpcheck verify {name} --samples 20000 --seed 4 --alpha 0.001");
        assert_eq!(story.last(), Some(&replay.as_str()), "{out}");
        if story.iter().any(|line| line.contains(" sigma ") && line.contains(" expected  at ")) {
            by_counts += 1;
            let planes = read_planes(exr).unwrap();
            let residuals = planes.get("residual").unwrap().iter().filter(|r| r.is_finite());
            let worst = f64::from(residuals.fold(0.0_f32, |worst, r| worst.max(r.abs())));
            // Rejected samples and the pool of light cells have no place in the picture.
            let drawn = |cell: &&Value| cell["place"].as_str().unwrap().contains("1 - b0");
            let cells = sampler["worst_cells"].as_array().unwrap();
            let Some(cell) = cells.iter().find(drawn) else { continue };
            let stated = cell["residual"].as_f64().unwrap().abs();
            assert!(stated > 5.0 && (worst / stated - 1.0).abs() < 1e-5, "{worst} drawn, {stated} stated");
        }
    }
    assert!(by_counts >= 2, "{out}");
    exits(&folder, "verify broken/lobes/uniform-for-cosine --samples 50k --allow-inconclusive --out out", 1);
}

#[test]
fn faults_are_listed_and_tried() {
    let folder = tempdir().unwrap();
    let list = exits(&folder, "faults --list", 0);
    assert!(list.contains("environment/sine-missing\n") && list.contains("    seen: "), "{list}");
    let out = exits(
        &folder,
        "faults triangle/branch-squared estimators/f32-film --seeds 2 --samples 20k --json f.json",
        0,
    );
    assert!(
        out.contains(
            "caught 2 of 2; diagnosed 2 (100%), 1 of them without help; correct twins: 3 of 3 runs passed"
        ),
        "{out}"
    );
    let report = json(&folder.path().join("f.json"));
    assert_eq!(report["faults"][0]["samples_median"], 1000);
    assert_eq!(report["score"]["caught"], 2);
    // Ten samples can't tell.
    exits(&folder, "faults triangle/branch-squared --samples 10 --seeds 1 --without-twins", 1);
}

// ---- what it refuses ----

#[test]
fn what_makes_no_sense_is_refused_in_one_sentence() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    let cornell = |words: &str| format!("render {CORNELL} {words}");
    for (words, sentence) in [
        ("verify phong/5O".to_owned(), "there is no sampler `phong/5O`; did you mean `phong/50`?"),
        ("verify trangle".to_owned(), "there is no sampler `trangle`; did you mean `triangle`?"),
        ("verify --list quaternions".to_owned(), "there is no sampler `quaternions` (--list shows all)"),
        ("histogram ggx/0.5x".to_owned(), "there is no file or sampler `ggx/0.5x`; did you mean `ggx/0.5`?"),
        (
            "histogram triangle".to_owned(),
            "`triangle` is a family; name one of triangle/low-distortion, triangle/square-root",
        ),
        ("verify --samples 0".to_owned(), "'0' for '--samples <SAMPLES>': there must be at least 1"),
        ("verify --samples -3".to_owned(), "'-3' for '--samples <SAMPLES>': there must be at least 1"),
        ("stress lobe".to_owned(), "there is no component `lobe`; there are discrete, triangle, solid-angle"),
        ("stress mixture --quick --json nowhere/run.json".to_owned(), "there is no folder nowhere"),
        ("stress --list --json rows.json".to_owned(), "'--list' cannot be used with '--json <FILE>'"),
        ("faults --list --report out".to_owned(), "'--list' cannot be used with '--report <DIR>'"),
        ("verify --checks --json checks.json".to_owned(), "'--checks' cannot be used with '--json <FILE>'"),
        ("verify --samples 1e99".to_owned(), "'1e99' for '--samples <SAMPLES>': too many: at most 1e12"),
        ("verify --samples many".to_owned(), "'many' for '--samples <SAMPLES>': not a count; write 300, 50k"),
        ("verify --samples 2.5".to_owned(), "'2.5' for '--samples <SAMPLES>': not a whole number"),
        ("verify --samples".to_owned(), "a value is required for '--samples <SAMPLES>'"),
        ("verify --seed -1".to_owned(), "'-1' for '--seed <SEED>'"),
        ("verify --alpha 2".to_owned(), "'2' for '--alpha <ALPHA>': must be a number between 0 and 1"),
        ("verify --alpha -1".to_owned(), "'-1' for '--alpha <ALPHA>': must be a number between 0 and 1"),
        ("verify --alpha nan".to_owned(), "'nan' for '--alpha <ALPHA>': must be a number between 0 and 1"),
        ("verify --data nowhere".to_owned(), "there is no folder nowhere"),
        ("verify --out file/out".to_owned(), "can't make the folder file/out"),
        ("verify --out file".to_owned(), "can't make the folder file"),
        ("histogram triangle/square-root --out file/out".to_owned(), "can't make the folder file/out"),
        (cornell("--out file/out"), "can't make the folder file/out"),
        ("verify --json none/run.json".to_owned(), "there is no folder none to write none/run.json into"),
        ("calibrate phong/5O".to_owned(), "there is no sampler `phong/5O`; did you mean `phong/50`?"),
        (
            "calibrate triangle broken/triangle".to_owned(),
            "`broken/triangle/branch-squared` is broken on purpose: only right samplers raise false alarms",
        ),
        ("faults lobes/phonk".to_owned(), "there is no fault `lobes/phonk` (--list shows all)"),
        ("calibrate --runs 0".to_owned(), "'0' for '--runs <RUNS>': there must be at least 1"),
        ("calibrate --runs some".to_owned(), "'some' for '--runs <RUNS>': not a count"),
        ("calibrate --samples 1.5".to_owned(), "'1.5' for '--samples <SAMPLES>': not a whole number"),
        ("calibrate --peeking -1".to_owned(), "'-1' for '--peeking <PEEKING>': there must be at least 1"),
        ("calibrate --json calibration.png".to_owned(), "calibration.png is the name of a picture"),
        ("calibrate --out file/out".to_owned(), "can't make the folder file/out"),
        ("verify --json .".to_owned(), ". is a folder, not a file"),
        ("histogram sphere/uniform --samples 1k,0".to_owned(), "'0' for '--samples <SAMPLES>'"),
        ("histogram sphere/uniform --height 0".to_owned(), "'0' for '--height <HEIGHT>'"),
        ("histogram sphere/uniform --height 1e9".to_owned(), "'1e9' for '--height <HEIGHT>'"),
        ("histogram sphere/uniform --rows diagonal".to_owned(), "[possible values: uniform-v, uniform-cos]"),
        (
            "histogram triangle/square-root --rows uniform-cos".to_owned(),
            "`triangle/square-root` is a sampler already",
        ),
        ("histogram".to_owned(), "required arguments were not provided: <TARGET>"),
        (cornell("--spp 0"), "'0' for '--spp <SPP>': there must be at least 1"),
        (cornell("--spp -1"), "'-1' for '--spp <SPP>': there must be at least 1"),
        (cornell("--spp 1,1e12"), "'1e12' for '--spp <SPP>': too many: at most 1e9"),
        (cornell("--exposure 0"), "'0' for '--exposure <FACTOR>': must be a positive number"),
        (cornell("--time -1"), "'-1' for '--time <SECONDS>': must be a positive number of seconds"),
        (cornell("--error -1"), "'-1' for '--error <RELATIVE>': must be a number between 0 and 1"),
        (cornell("--strategy bdpt"), "`bdpt` is no strategy; it must be uniform, brdf, light, mis, mis:C"),
        (cornell("--strategy mis:1.5"), "`mis:1.5` is no strategy"),
        ("verfy".to_owned(), "unrecognized subcommand 'verfy'; tip: a similar subcommand exists: 'verify'"),
    ] {
        let Output { status, stdout, stderr } = warpcheck(&folder, &words).output().unwrap();
        let said = text(&stderr);
        assert_eq!(status.code(), Some(2), "{words}: {said}");
        assert_eq!((said.lines().count(), text(&stdout).as_str()), (1, ""), "{words}: {said}");
        assert!(said.starts_with("warpcheck: ") && said.contains(sentence), "{words}: {said}");
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(left, ["file"], "{words} left something behind");
    }
}

// ---- calibrate ----

#[test]
fn calibrate_measures_false_alarms_and_draws_them() {
    calibrates("discrete/ragged", 24);
}

#[test]
#[ignore = "long: two samplers by 24 runs"]
fn calibrate_does_so_for_several_samplers() {
    calibrates("discrete/ragged triangle/low-distortion", 24);
}

fn calibrates(samplers: &str, runs: u32) {
    let folder = tempdir().unwrap();
    let words = format!("calibrate {samplers} --runs {runs} --samples 2k --peeking 17k --seed 5");
    let run = |threads: &str, out: &str| {
        let words = format!("{words} --out {out} --json {out}.json");
        let output = warpcheck(&folder, &words).env("RAYON_NUM_THREADS", threads).output().unwrap();
        assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""), "{output:?}");
        let svg = fs::read_to_string(folder.path().join(out).join("calibration.svg")).unwrap();
        (text(&output.stdout).replace(out, "out"), svg, json(&folder.path().join(format!("{out}.json"))))
    };
    let (table, svg, measured) = run("1", "run-1");
    let again = run("2", "run-2");
    assert_eq!(table, again.0);
    assert!(svg == again.1 && measured == again.2, "depends on threads");
    for line in
        ["whole verdict", "whole verdict, peeking", "sequential, peeking", "chi-square: least likely cell"]
    {
        assert!(table.lines().any(|l| l.starts_with(line)), "{line}: {table}");
    }
    assert!(
        table.contains(&format!("pass: {runs} runs, 2000 samples each"))
            && table.contains("plot: out/calibration.svg")
    );
    assert!(svg.starts_with("<svg") && svg.contains("chi-square"));
    assert_eq!((&measured["holds"], &measured["runs"]), (&true.into(), &runs.into()));
    let rows = measured["alarms"].as_array().unwrap();
    let whole = rows.iter().find(|row| row["name"] == "whole verdict" && row["mode"] == "fixed").unwrap();
    let rates = whole["tally"]["rates"].as_array().unwrap();
    assert_eq!(rates.iter().map(|r| r["level"].as_f64().unwrap()).collect::<Vec<_>>(), [0.05, 0.01, 0.001]);
    for rate in rates {
        let [low, high] = [0, 1].map(|i| rate["interval_95"][i].as_f64().unwrap());
        assert!((low..=high).contains(&rate["rate"].as_f64().unwrap()) && high < 0.5, "{rate}");
    }
    for part in measured["uniformity"].as_array().unwrap() {
        let classes = part["classes"].as_array().unwrap().iter().map(|c| c.as_u64().unwrap());
        assert_eq!(classes.sum::<u64>(), part["number"].as_u64().unwrap(), "{part}");
    }
    assert_eq!(
        files(folder.path()),
        ["run-1.json", "run-1/calibration.svg", "run-2.json", "run-2/calibration.svg"]
    );
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_runs_so_far() {
    let folder = tempdir().unwrap();
    let words = "calibrate discrete/ragged --runs 1M --samples 1k --peeking 1k --out out --json out/run.json";
    let out = interrupted(&folder, words);
    assert!(out.contains("stopped: ") && out.contains("of 1000000 runs were made"), "{out}");
    assert_eq!(files(folder.path()), ["out/calibration.svg", "out/run.json"]);
    let done = json(&folder.path().join("out/run.json"))["runs"].as_u64().unwrap();
    assert!((1..1_000_000).contains(&done), "{done}");
}

// ---- histogram ----

// ---- stress ----

#[test]
fn stress_tells_what_happened_beside_what_should() {
    let folder = tempdir().unwrap();
    let list = exits(&folder, "stress --list", 0);
    assert!(list.lines().count() > 100 && list.contains("(takes long)"), "{list}");
    assert!(list.contains("error: names index 2"), "{list}");
    let quick = exits(&folder, "stress mixture triangle --quick --list", 0);
    assert!(quick.lines().all(|line| line.starts_with("mixture") || line.starts_with("triangle")), "{quick}");
    assert!(!quick.contains("(takes long)"), "{quick}");
    assert_eq!(files(folder.path()), [""; 0]);

    let said = exits(&folder, "stress mixture triangle --quick --json run.json", 0);
    let rows = quick.lines().count();
    assert!(said.contains(&format!("pass: {rows} of {rows} rows are as they should be")), "{said}");
    // A line each for two components, or for all rows.
    assert_eq!(said.lines().filter(|line| line.starts_with("ok ")).count(), 2, "{said}");
    assert!(said.lines().count() < 12 && said.contains("lost/53b lost/24b"), "{said}");
    let long = exits(&folder, "stress mixture triangle --quick --long", 0);
    assert_eq!(long.lines().filter(|line| line.starts_with("ok ")).count(), rows, "{long}");
    // So few have a line each.
    let few = exits(&folder, "stress mixture --quick", 0);
    assert!(few.contains("what happened") && few.contains("c = 1"), "{few}");
    let report = json(&folder.path().join("run.json"));
    assert_eq!((&report["schema_version"], &report["ok"]), (&2.into(), &true.into()));
    let found = report["rows"].as_array().unwrap();
    assert_eq!(found.len(), rows);
    for row in found {
        let error = row["worst_error"].as_f64().unwrap_or(0.0);
        assert!(error <= row["allowed_error"].as_f64().unwrap() && row["ok"] == true, "{row}");
    }
    let mis = found.iter().find(|row| row["input"] == "power: 1e20 and 2e-23 in f32").unwrap();
    assert_eq!((&mis["kind"], &mis["component"]), (&"value".into(), &"mixture".into()));
}

/// Lit by one texel and a darker column; values that both file formats hold exactly.
fn small_map() -> Picture {
    Picture::from_fn(8, 4, |x, y| match (x, y) {
        (5, 1) => [8.0, 8.0, 8.0],
        (2, _) => [1.0, 0.5, 0.25],
        _ => [0.0; 3],
    })
}

fn write_hdr(path: &Path, picture: &Picture) {
    let pixels: Vec<_> = picture.pixels().iter().map(|&p| image::Rgb(p)).collect();
    let encoder = image::codecs::hdr::HdrEncoder::new(fs::File::create(path).unwrap());
    encoder.encode(&pixels, picture.width(), picture.height()).unwrap();
}

#[test]
fn histograms_of_a_map() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write_exr(path("sky.exr"), &small_map()).unwrap();
    write_hdr(&path("land.hdr"), &small_map());
    let said = exits(&folder, "histogram sky.exr --samples 20k,1500,20k --out out", 0);
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines.len(), 2, "{said}");
    assert!(lines[0].starts_with("1500 samples in ") && lines[0].contains("out/sky-1500.png"), "{said}");
    assert!(lines[1].starts_with("20000 samples in ") && lines[1].contains("out/sky-20k.png"), "{said}");
    let expected = ["sky-1500.exr", "sky-1500.png", "sky-20k.exr", "sky-20k.png"];
    assert_eq!(files(&path("out")), expected);
    for (name, samples) in [("sky-1500", 1500.0), ("sky-20k", 20e3)] {
        png(path("out").join(name).with_extension("png"));
        let planes = read_planes(path("out").join(name).with_extension("exr")).unwrap();
        assert_eq!((planes.width(), planes.height()), (8, 4));
        let names: BTreeSet<_> = planes.names().collect();
        assert_eq!(names, ["claimed", "counts", "importance", "target", "uniform"].into());
        assert_eq!(sum(&planes, "counts"), samples);
        let plane = |name| planes.get(name).unwrap();
        // Solid angle of a texel of row 0 and 3, of row 1 and 2.
        let quarter = std::f64::consts::FRAC_PI_4;
        let angles = [1.0 - quarter.cos(), quarter.cos()].map(|x| x * quarter);
        for i in 0..32 {
            let lit = small_map().pixels()[i] != [0.0; 3];
            for name in ["counts", "importance", "target", "claimed"] {
                assert_eq!(plane(name)[i] > 0.0, lit, "{name} of texel {i}");
            }
            let angle = angles[usize::from((1..=2).contains(&(i / 8)))];
            let density = f64::from(plane("counts")[i]) / samples / angle;
            // The histogram measures its pixels by a few places in each.
            assert!((f64::from(plane("importance")[i]) - density).abs() <= 3e-3 * density, "texel {i}");
        }
        let bright = f64::from(plane("counts")[8 + 5]) / samples;
        assert!((0.80..0.92).contains(&bright), "{bright} of the samples in the brightest texel");
    }
    // The format of the map changes nothing, nor does the number of threads; the seed does.
    for (words, same) in [("", true), ("--seed 1", true), ("--seed 2", false)] {
        let command = format!("histogram land.hdr --samples 20k --out again {words}");
        warpcheck(&folder, &command).env("RAYON_NUM_THREADS", "1").output().unwrap();
        let [one, two] = ["out/sky-20k.exr", "again/land-20k.exr"].map(|name| fs::read(path(name)).unwrap());
        assert_eq!(one == two, same, "{command}");
    }
}

#[test]
fn a_constant_map_is_uniform_in_cos_theta() {
    let folder = tempdir().unwrap();
    write_exr(folder.path().join("grey.exr"), &Picture::from_fn(6, 3, |_, _| [0.5; 3])).unwrap();
    exits(&folder, "histogram grey.exr --rows uniform-cos --height 16 --samples 1k --out out", 0);
    let planes = read_planes(folder.path().join("out/grey-uniform-cos-1k.exr")).unwrap();
    assert_eq!((planes.width(), planes.height()), (32, 16));
    let everywhere = 0.25 * std::f32::consts::FRAC_1_PI;
    assert!(planes.get("claimed").unwrap().iter().all(|p| (p / everywhere - 1.0).abs() < 1e-5));
}

#[test]
fn histograms_of_samplers_on_their_own_domains() {
    let folder = tempdir().unwrap();
    for (name, width, height) in [
        ("triangle/square-root", 64, 64),
        ("hemisphere/cosine", 64, 64),
        ("sphere/uniform", 128, 64),
        ("discrete/ragged", 256, 64),
        ("sphere", 128, 64), // a family of one
    ] {
        let out = TempDir::new_in(folder.path()).unwrap();
        let words = format!("histogram {name} --samples 10k,20k --height 64 --out {}", out.path().display());
        let said = exits(&folder, &words, 0);
        assert_eq!(said.lines().count(), 2, "{said}");
        let found = files(out.path());
        assert_eq!(found.len(), 4, "{found:?}");
        for (files, samples) in found.chunks(2).zip([10e3, 20e3]) {
            png(out.path().join(&files[1]));
            let planes = read_planes(out.path().join(&files[0])).unwrap();
            assert_eq!((planes.width(), planes.height()), (width, height), "{name}");
            assert_eq!(planes.names().collect::<Vec<_>>(), ["claimed", "counts", "drawn"]);
            assert_eq!(sum(&planes, "counts"), samples, "{name}");
        }
    }
}

// ---- render ----

fn size(picture: &Picture) -> (usize, usize) {
    (picture.width(), picture.height())
}

#[test]
fn a_picture_for_every_strategy_and_count() {
    let folder = tempdir().unwrap();
    let render = |words: &str, threads: &str| {
        let words = format!("render {CORNELL} {words}");
        let output = warpcheck(&folder, &words).env("RAYON_NUM_THREADS", threads).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        text(&output.stdout)
    };
    let said = render("--strategy light,mis:0.25 --spp 2,1 --out out", "2");
    assert_eq!(said.lines().count(), 4, "{said}");
    let stems = ["light-1spp", "light-2spp", "mis-0.25-1spp", "mis-0.25-2spp"];
    let expected: Vec<_> =
        stems.iter().flat_map(|s| ["exr", "png"].map(|e| format!("cornell-{s}.{e}"))).collect();
    let out = folder.path().join("out");
    assert_eq!(files(&out), expected);
    for stem in stems {
        let path = out.join(format!("cornell-{stem}.exr"));
        let picture = read(&path).unwrap();
        assert_eq!(size(&picture), (256, 256));
        assert_eq!(picture.first_bad_texel(), None);
        let mean = picture.pixels().iter().map(|p| f64::from(p[0])).sum::<f64>() / 65536.0;
        assert!((0.1..1.0).contains(&mean), "{mean}");
        assert_eq!(png(path.with_extension("png")), (256, 256));
    }
    // One pass more is what two passes would have been, whatever the threads; another seed is another picture.
    render("--strategy light --spp 2 --out again", "1");
    render("--strategy light --spp 2 --seed 2 --out other", "1");
    let bytes = |out: &str, e: &str| {
        fs::read(folder.path().join(out).join(format!("cornell-light-2spp.{e}"))).unwrap()
    };
    for extension in ["exr", "png"] {
        assert!(bytes("out", extension) == bytes("again", extension));
        assert!(bytes("out", extension) != bytes("other", extension));
    }
    // Brighter on a screen, the same light.
    render("--strategy light --spp 2 --exposure 4 --out bright", "2");
    assert!(bytes("out", "exr") == bytes("bright", "exr") && bytes("out", "png") != bytes("bright", "png"));
}

/// The Cornell box as a stamp, so that many passes take no time.
fn small_scene(folder: &TempDir) -> PathBuf {
    let scene = fs::read_to_string(CORNELL).unwrap();
    let mesh = format!("{}/data/scene/cornell_measured.obj", env!("CARGO_MANIFEST_DIR"));
    let scene = scene.replace("cornell_measured.obj", &mesh).replace("256", "24");
    let file = folder.path().join("stamp.toml");
    fs::write(&file, scene).unwrap();
    file
}

#[test]
fn the_contact_sheet_shows_strategies_by_counts() {
    let folder = tempdir().unwrap();
    small_scene(&folder);
    let said = exits(&folder, "render stamp.toml --sheet --out all", 0);
    assert_eq!(said.lines().count(), 5 * 3 + 1, "{said}");
    assert_eq!(said.lines().last(), Some("contact sheet: all/stamp-sheet.png"));
    let strategies = ["brdf", "light", "mis-0.25", "mis-0.5", "mis-0.75"];
    let pictures = strategies.iter().flat_map(|s| [1, 10, 100].map(|spp| format!("stamp-{s}-{spp}spp")));
    let mut expected: Vec<_> = pictures.flat_map(|p| ["exr", "png"].map(|e| format!("{p}.{e}"))).collect();
    expected.push("stamp-sheet.png".to_owned());
    expected.sort();
    assert_eq!(files(&folder.path().join("all")), expected);
    let (width, height) = png(folder.path().join("all/stamp-sheet.png"));
    assert!(width > 3 * 256 && height > 5 * 256, "{width} x {height}");

    exits(&folder, "render stamp.toml --sheet --spp 1,2 --strategy uniform --out two", 0);
    let (narrow, low) = png(folder.path().join("two/stamp-sheet.png"));
    assert!(narrow < width - 200 && low < height - 3 * 256, "{narrow} x {low}");
}

#[test]
fn a_film_goes_on_where_it_stopped() {
    let folder = tempdir().unwrap();
    small_scene(&folder);
    let lit = "render stamp.toml --strategy mis-two --lights power/d2 --triangles solid-angle";
    let said = exits(&folder, &format!("{lit} --spp 3 --film --out a"), 0);
    assert!(said.ends_with("film: a/stamp-mis-two.film\n"), "{said}");
    exits(&folder, &format!("{lit} --spp 6 --snapshots 4,5,6 --resume a/stamp-mis-two.film --out b"), 0);
    exits(&folder, &format!("{lit} --spp 6 --film --out c"), 0);
    let picture = |out: &str| fs::read(folder.path().join(out).join("stamp-mis-two-6spp.exr")).unwrap();
    assert!(picture("b") == picture("c"));
    let snapshots: Vec<_> =
        [4, 5, 6].iter().flat_map(|n| ["exr", "png"].map(|e| format!("stamp-mis-two-{n}spp.{e}"))).collect();
    assert_eq!(files(&folder.path().join("b")), snapshots);
    for (words, part) in [
        (format!("{lit} --seed 2 --resume a/stamp-mis-two.film"), "a film of another seed: 1, not 2"),
        (
            format!("{lit} --spp 2 --resume a/stamp-mis-two.film"),
            "the film has 3 passes already, more than --spp 2",
        ),
        (
            "render stamp.toml --resume a/stamp-mis-two.film".into(),
            "a film of another strategy: mis-two, not mis:0.5",
        ),
        (format!("render {CORNELL} --resume a/stamp-mis-two.film"), "a film of another picture: 24 x 24"),
        ("render stamp.toml --strategy brdf,light --resume a/stamp-mis-two.film".into(), "2 were named"),
        (
            "render stamp.toml --spp 6 --snapshots 4,9".into(),
            "no snapshot after 9 samples a pixel: --spp is 6",
        ),
        ("render stamp.toml --strategy light,brdf,light".into(), "--strategy names light twice"),
        ("agree stamp.toml --strategy mis:0.5,mis:.5".into(), "--strategy names mis:0.5 twice"),
        ("render stamp.toml --map sky.hdr".into(), "has no [environment]"),
        ("render stamp.toml --lights distance".into(), "must be one of area, power, power/d2"),
    ] {
        let Output { status, stdout, stderr } = warpcheck(&folder, &words).output().unwrap();
        let said = text(&stderr);
        assert_eq!((status.code(), text(&stdout).as_str()), (Some(2), ""), "{words}: {said}");
        assert!(said.contains(part) && said.lines().count() == 1, "{words}: {said}");
    }
}

#[test]
fn strategies_are_compared_with_the_reference_of_their_scene() {
    let folder = tempdir().unwrap();
    let own = |file: &str, blocks: &str| {
        let scene = small_scene(&folder);
        let text = fs::read_to_string(&scene).unwrap();
        let blocks = if blocks.is_empty() { String::new() } else { format!("blocks = \"{blocks}\"\n") };
        fs::write(scene, format!("{text}\n[reference]\nfile = \"{file}\"\n{blocks}")).unwrap();
    };
    let agree = |words: &str, code: i32| {
        exits(&folder, &format!("agree stamp.toml --spp 32 --allow-inconclusive --out out {words}"), code)
    };
    for (name, size) in [("black.exr", 24), ("large.exr", 25)] {
        write_exr(folder.path().join(name), &Picture::from_fn(size, size, |_, _| [0.0; 3])).unwrap();
    }
    own("black.exr", "gone.json");
    let said = agree("--strategy light", 1);
    assert!(said.starts_with("reference: ") && said.contains("black.exr, as the scene says"), "{said}");
    let two = "--strategy light,mis:0.5";
    for (file, words, says) in [
        ("black.exr", "--no-reference", ""),
        ("large.exr", "", "is left out: "),
        ("gone.exr", "", "is left out: "),
    ] {
        own(file, "");
        let said = agree(&format!("{two} {words}"), 0);
        assert!(said.contains(says) && !said.contains("as the scene says"), "{file}: {said}");
    }
}

#[test]
fn rendering_stops_at_an_error_or_a_time() {
    let folder = tempdir().unwrap();
    small_scene(&folder);
    let passes = |out: &str| -> u32 {
        let files = files(&folder.path().join(out));
        let stem =
            files.iter().find_map(|f| f.strip_prefix("stamp-light-")?.strip_suffix("spp.exr")).unwrap();
        stem.parse().unwrap()
    };
    let error = |e: f64, out: &str| {
        exits(&folder, &format!("render stamp.toml --strategy light --error {e} --out {out}"), 0);
        passes(out)
    };
    // Half the error, four times the samples.
    let (rough, fine) = (error(0.2, "rough"), error(0.1, "fine"));
    assert!(rough >= 16 && fine > 2 * rough && fine < 8 * rough, "{rough} {fine}");
    assert!((16..=rough).contains(&error(0.99, "least")));
    // What it can't see is in no error.
    let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene");
    let spheres = fs::read_to_string(format!("{scenes}/three_spheres.toml")).unwrap();
    let spheres = spheres.replace("three_spheres.obj", &format!("{scenes}/three_spheres.obj"));
    let spheres = spheres.replace("= 256", "= 32").replace("= 128", "= 16");
    fs::write(folder.path().join("spheres.toml"), spheres).unwrap();
    let said = exits(&folder, "render spheres.toml --strategy light,brdf --error 0.9 --out spheres", 0);
    assert_eq!(said.matches("its samples hardly find the lobes that").count(), 1, "{said}");
    exits(&folder, "render stamp.toml --strategy light --time 0.05 --out timed", 0);
    assert!(passes("timed") >= 1);
}

#[test]
fn a_plan_is_printed() {
    let folder = tempdir().unwrap();
    let said = exits(&folder, &format!("plan {CORNELL} --strategy brdf --json plan.json"), 0);
    assert!(
        said.contains("left out  emitter table") && said.contains("no strategy draws from the lights"),
        "{said}"
    );
    let plan = json(&folder.path().join("plan.json"));
    let parts = plan["parts"].as_array().unwrap();
    let table = parts.iter().find(|p| p["name"] == "emitter table").unwrap();
    assert_eq!((table["built"].as_bool(), table["bytes"].as_u64()), (Some(false), Some(0)));
    let said = exits(&folder, &format!("plan {CORNELL} --lights power/d2"), 0);
    assert!(
        said.contains("built     emitter table") && said.contains("a tree of powers over 2 emitters"),
        "{said}"
    );
}

// ---- Ctrl-C and closed pipes ----

/// Starts it, presses Ctrl-C a moment after it has made `out`, and returns what it printed.
#[cfg(unix)]
#[track_caller]
fn interrupted(folder: &TempDir, words: &str) -> String {
    let wait_for = |what: &str, mut done: Box<dyn FnMut() -> bool + '_>| {
        let start = Instant::now();
        while !done() {
            assert!(start.elapsed() < Duration::from_secs(20), "{words}: no {what} in 20 s");
            thread::sleep(Duration::from_millis(20));
        }
    };
    let mut child = warpcheck(folder, words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for("folder", Box::new(|| folder.path().join("out").is_dir()));
    thread::sleep(Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "{words}: over before Ctrl-C");
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let mut ended = false;
    let start = Instant::now();
    while !ended && start.elapsed() < Duration::from_secs(20) {
        thread::sleep(Duration::from_millis(20));
        ended = child.try_wait().unwrap().is_some();
    }
    if !ended {
        child.kill().unwrap();
    }
    let Output { status, stdout, stderr } = child.wait_with_output().unwrap();
    assert!(ended, "{words}: did not stop in 20 s");
    assert_eq!((status.code(), text(&stderr).as_str()), (Some(130), ""), "{words}");
    text(&stdout)
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_was_verified() {
    let folder = tempdir().unwrap();
    let out = interrupted(&folder, "verify hemisphere --samples 10G --out out --json out/run.json");
    assert!(out.contains("stopped: 1 of 2 samplers were examined"), "{out}");
    assert_eq!(files(folder.path()), ["out/hemisphere-uniform.png", "out/overview.png", "out/run.json"]);
    png(folder.path().join("out/hemisphere-uniform.png"));
    let report = json(&folder.path().join("out/run.json"));
    let drawn = report["samplers"][0]["samples"].as_u64().unwrap();
    assert!((1_000_000..1_000_000_000).contains(&drawn), "{drawn}");
    assert_eq!(report["verdict"], "pass");
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_histogram_so_far() {
    for target in ["sky.exr", "triangle/square-root"] {
        let folder = tempdir().unwrap();
        write_exr(folder.path().join("sky.exr"), &small_map()).unwrap();
        let out = interrupted(&folder, &format!("histogram {target} --samples 10G,20G --out out"));
        let drawn: f64 = out.split(' ').next().unwrap().parse().unwrap();
        assert!((1e6..1e9).contains(&drawn), "{out}");
        let stem = target.trim_end_matches(".exr").replace('/', "-");
        // Named by what was drawn, a whole number of shards.
        let expected = ["exr", "png"].map(|e| format!("{stem}-{drawn}.{e}"));
        assert_eq!(files(&folder.path().join("out")), expected);
        png(folder.path().join("out").join(&expected[1]));
        let planes = read_planes(folder.path().join("out").join(&expected[0])).unwrap();
        assert!((sum(&planes, "counts") / drawn - 1.0).abs() < 1e-6);
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_the_passes_so_far() {
    let folder = tempdir().unwrap();
    small_scene(&folder);
    let out = interrupted(
        &folder,
        "render stamp.toml --sheet --strategy light,brdf --spp 1,1000000 --film --out out",
    );
    assert_eq!(out.lines().count(), 5, "{out}");
    assert!(out.contains("stopped: what is above"), "{out}");
    let expected = files(&folder.path().join("out"));
    let passes = |name: &String| name.strip_prefix("stamp-light-")?.strip_suffix("spp.exr")?.parse().ok();
    let mut made: Vec<u32> = expected.iter().filter_map(passes).collect();
    made.sort_unstable();
    assert!(matches!(made[..], [1, most] if (2..1_000_000).contains(&most)), "{made:?}");
    let mut all: Vec<_> =
        made.iter().flat_map(|n| ["exr", "png"].map(|e| format!("stamp-light-{n}spp.{e}"))).collect();
    all.extend(["stamp-light.film", "stamp-sheet.png"].map(str::to_owned));
    all.sort();
    assert_eq!(expected, all);
    let go_on = "render stamp.toml --strategy light --spp 1 --resume out/stamp-light.film";
    let said = text(&warpcheck(&folder, go_on).output().unwrap().stderr);
    assert!(said.contains("passes already"), "{said}");
    for name in expected.iter().filter(|name| !name.ends_with("film")) {
        let path = folder.path().join("out").join(name);
        match name.ends_with("exr") {
            true => assert_eq!(size(&read(path).unwrap()), (24, 24)),
            false => drop(png(path)),
        }
    }
}

/// Killed, without a chance to do anything about it.
#[test]
fn a_film_is_saved_on_the_way() {
    let folder = tempdir().unwrap();
    small_scene(&folder);
    let words = "render stamp.toml --strategy light --spp 100000000 --film --save-every 0.05 --out out";
    let mut child = warpcheck(&folder, words).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let film = folder.path().join("out/stamp-light.film");
    let begun = Instant::now();
    while !film.exists() && begun.elapsed() < Duration::from_secs(60) {
        thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let go_on = "render stamp.toml --strategy light --resume out/stamp-light.film";
    let told = text(&warpcheck(&folder, &format!("{go_on} --spp 1")).output().unwrap().stderr);
    let saved = told.split("the film has ").nth(1).and_then(|t| t.split(' ').next()).unwrap();
    let spp = saved.parse::<u32>().unwrap() + 2;
    exits(&folder, &format!("{go_on} --spp {spp} --out on"), 0);
    exits(&folder, &format!("render stamp.toml --strategy light --spp {spp} --out once"), 0);
    let picture =
        |out: &str| fs::read(folder.path().join(format!("{out}/stamp-light-{spp}spp.exr"))).unwrap();
    assert!(picture("on") == picture("once"), "{spp}");
}

#[test]
fn a_reader_that_leaves_early_is_no_trouble() {
    let folder = tempdir().unwrap();
    small_scene(&folder);
    for words in [
        "--help",
        "verify --list",
        "verify sphere triangle --samples 20k --out out",
        "histogram triangle/square-root --samples 1k,2k --height 32 --out out",
        "render stamp.toml --spp 1,2 --sheet --out out",
    ] {
        let mut child =
            warpcheck(&folder, words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let Output { status, stderr, .. } = child.wait_with_output().unwrap();
        assert_eq!((status.code(), text(&stderr).as_str()), (Some(0), ""), "{words}");
    }
    assert!(files(&folder.path().join("out")).contains(&"stamp-sheet.png".to_owned()), "the work is done");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said() {
    let folder = tempdir().unwrap();
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = warpcheck(&folder, "verify --list").stdout(full).output().unwrap();
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.starts_with("warpcheck: can't write the result: ") && said.lines().count() == 1, "{said}");
}
