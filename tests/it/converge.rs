//! Error against run time: the measures are those of what is known, and nothing but times depends on the machine.

use crate::scenes::{cornell, data, shipped};
use assert_cmd::cargo::cargo_bin;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tempfile::tempdir;
use warpcheck::estimator::{
    Budget, Convergence, Cost, Experiment, Lights, Strategy, Truth, convergence, regions_by_material,
};
use warpcheck::picture::Picture;
use warpcheck::report::{convergence_plot, convergence_table, convergence_to_json, region_ratios};
use warpcheck::sampler::Heuristic;
use warpcheck::scene::Scene;

const LIGHT: Strategy = Strategy::Light;
const MIS: Strategy = Strategy::Mis { brdf_weight: 0.5 };

fn plan(strategies: &[Strategy], passes: u32) -> Experiment {
    let (strategies, budget) = (strategies.to_vec(), Budget::Passes(passes));
    Experiment { strategies, budget, seeds: 5, ..Experiment::default() }
}

#[test]
fn errors_fall_by_the_root() {
    let (scene, lights) = cornell("32");
    let strategies = [Strategy::Brdf, LIGHT, MIS, Strategy::Uniform];
    let plan = Experiment { regions: regions_by_material(&scene), ..plan(&strategies, 64) };
    let found = convergence(&scene, &lights, &plan);
    assert_eq!(found.reference.run.unwrap().1, 16 * 64);
    for curve in &found.curves {
        let slope = curve.slope_samples.unwrap();
        let last = curve.last().unwrap();
        println!("{}: {slope:?}, claimed {}, bias^2 {:?}", curve.strategy, curve.claimed, curve.squared_bias);
        assert!(slope.contains(-0.5) && slope.half_width < 0.2, "{}: {slope:?}", curve.strategy);
        assert_eq!(curve.rungs.iter().map(|r| r.passes).collect::<Vec<_>>(), [1, 2, 4, 8, 16, 32, 64]);
        // Films know their error, and there is no bias.
        assert!((curve.claimed - 1.0).abs() < 0.25, "{}", curve.claimed);
        assert!(curve.squared_bias.mean.abs() < 4.0 * curve.squared_bias.error);
        assert!(curve.outliers.mean > 0.001 && curve.outliers.mean < 1.0);
        assert!(last.worst_tile.mean > last.relative.mean && last.squared.error > 0.0);
        // Parts leave out the pixels of edges.
        assert!(
            last.regions.len() > 3 && last.regions.iter().any(|m| m.mean > 0.0 && m.mean < last.squared.mean)
        );
        // Four times the samples for half the error.
        let [once, again] = [1.0, 0.5].map(|f| curve.to_reach(f * last.squared.mean.sqrt()).unwrap().0);
        assert!((again / once / 4.0 - 1.0).abs() < 0.6 && (once / 64.0 - 1.0).abs() < 0.3, "{once} {again}");
        assert!(last.cpu.mean > 0.0 && curve.efficiency > 0.0);
    }
    // Error at equal samples: aiming at the lamp beats hoping for it.
    let squared = |i: usize| found.curves[i].last().unwrap().squared.mean;
    assert!(squared(1) < squared(0) && squared(0) < squared(3));
    let svg = convergence_plot("box", &found).unwrap();
    assert!(svg.starts_with("<svg") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    for word in ["light", "mis:0.5", "slope -1/2", "5 seeds"] {
        assert!(svg.contains(word), "{word}");
    }
    let pictures = found.at_equal_time(&scene, &lights, 1e-9);
    assert!(pictures.iter().all(|(passes, film)| *passes == 1 && film.pixel(3, 3).count() == 1));
    // Hoping for the lamp in all directions alike wins nowhere but by chance; aiming at it wins somewhere for sure.
    let winners = found.winners();
    assert_eq!(winners.len(), 16);
    let won = winners.iter().flatten();
    assert!(won.clone().all(|w| w.lead >= 1.0 && !(w.is_sure && w.strategy == 3)), "{winners:?}");
    assert!(won.clone().any(|w| w.is_sure && w.strategy == 1), "{winners:?}");
    let parts = region_ratios(&found);
    assert_eq!(
        (parts[0].0.as_str(), parts[0].1, parts.len()),
        ("whole picture", 1024, 1 + found.regions.len())
    );
    for (name, _, ratios) in parts {
        // The lamp is seen without error.
        if ratios.iter().all(|r| r.value == 0.0) {
            assert_eq!(name, "light");
            continue;
        }
        assert_eq!(ratios.iter().filter(|r| r.value == 1.0 && r.half_width == 0.0).count(), 1, "{name}");
        assert!(ratios.iter().all(|r| r.value >= 1.0 && r.half_width.is_finite()), "{name}: {ratios:?}");
    }
}

/// All pictures share the reference: where its error is what decides, as on the white walls, the errors that they have scatter from one reference to the next as the
/// error bars say, though they scatter much less from picture to picture. In the whole picture the edges of the lamp decide, which all of them have.
#[test]
fn chance_in_the_reference_is_in_the_error_bars() {
    chance_in_the_reference(16);
}

#[test]
#[ignore = "long: forty references"]
fn chance_in_forty_references_is_in_the_error_bars() {
    chance_in_the_reference(40);
}

fn chance_in_the_reference(seeds: u64) {
    let (scene, lights) = cornell("16");
    let regions = regions_by_material(&scene);
    let (largest, _) =
        regions.iter().enumerate().max_by_key(|(_, r)| r.pixels.len()).expect("the box has materials");
    let truth = Truth::LongRun(Some(Strategy::Uniform));
    let plan = Experiment { truth, regions, ..plan(&[LIGHT], 16) };
    let (mut whole, mut relative, mut part) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..seeds {
        let found = convergence(&scene, &lights, &Experiment { seed, ..plan.clone() });
        let last = found.curves[0].last().unwrap();
        whole.push(last.squared);
        relative.push(last.relative);
        part.push(last.regions[largest]);
    }
    for (name, measured) in [("whole", whole), ("relative", relative), ("part", part)] {
        let n = measured.len() as f64;
        let mean = measured.iter().map(|m| m.mean).sum::<f64>() / n;
        let scatter = (measured.iter().map(|m| (m.mean - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let claimed = (measured.iter().map(|m| m.error.powi(2)).sum::<f64>() / n).sqrt();
        println!("{name}: {mean:.3e}, scatters by {scatter:.3e}, claimed {claimed:.3e}");
        assert!((0.6..1.7).contains(&(claimed / scatter)), "{name}: {scatter} {claimed}");
    }
}

/// What everybody believes of multiple importance sampling, at an equal number of rays (times are for `converge` itself): the two-sample estimator has less error over the
/// whole of the plates than either of its parts with twice the samples, and is not much worse than the better of the two on any plate. Errors fall by the root.
#[test]
#[ignore = "long: two million pixels of 128 samples"]
fn both_together_are_best_on_the_plates() {
    let file = data("scene/veach_a3.toml");
    let scene = Scene::load(&file).unwrap();
    let lights = Lights::load(&scene).unwrap();
    let two = Strategy::MisTwo { heuristic: Heuristic::Balance };
    let regions = regions_by_material(&scene);
    let plan = Experiment { regions, ..plan(&[Strategy::Brdf, LIGHT, two], 128) };
    let found = convergence(&scene, &lights, &plan);
    let at = |i: usize, passes| found.curves[i].rungs.iter().find(|r| r.passes == passes).unwrap();
    let (brdf, light, two) = (at(0, 128), at(1, 128), at(2, 64));
    println!("mean squared errors {:?} {:?} {:?}", brdf.squared, light.squared, two.squared);
    assert!(two.squared.mean + 2.0 * two.squared.error < brdf.squared.mean.min(light.squared.mean));
    for (i, (name, pixels)) in found.regions.iter().enumerate() {
        let [brdf, light, two] = [brdf, light, two].map(|r| r.regions[i].mean.sqrt());
        println!(
            "{name}, {pixels} pixels: {brdf:.5} {light:.5} {two:.5}, {:.2} times the better",
            two / brdf.min(light)
        );
        assert!(two <= 2.5 * brdf.min(light), "{name}");
    }
    for i in [0, 2] {
        let slope = found.curves[i].slope_samples.unwrap();
        println!("{}: {slope:?}", found.curves[i].strategy);
        assert!(slope.contains(-0.5) && slope.half_width < 0.1, "{slope:?}");
    }
}

/// Against a picture that is 10% too bright, the squared bias is that of the tenth, and the error stops falling.
#[test]
#[ignore = "long: 256 samples a pixel by five seeds"]
fn bias_is_measured() {
    let (scene, lights) = cornell("32");
    let right = convergence(&scene, &lights, &plan(&[LIGHT], 64)).reference.picture;
    let bright = Picture::from_fn(32, 32, |x, y| right.at(x, y).map(|r| 1.1 * r));
    let expected =
        right.pixels().iter().flatten().map(|&r| (0.1 * f64::from(r)).powi(2)).sum::<f64>() / 3072.0;
    let wrong = Experiment { truth: Truth::Picture(bright), ..plan(&[LIGHT], 256) };
    let curve = &convergence(&scene, &lights, &wrong).curves[0];
    let (bias, last) = (curve.squared_bias, curve.last().unwrap().squared.mean);
    println!("bias^2 {bias:?}, expected {expected}, error^2 {last}");
    assert!((bias.mean - expected).abs() < 0.15 * expected && bias.mean > 2.0 * bias.error);
    assert!(last > bias.mean && curve.claimed < 0.9);
    assert!(!curve.slope_samples.unwrap().contains(-0.5));
}

/// The samples of a lamp never find a mirror, and have no variance there: they are no reference, and their figures none to go by.
#[test]
fn who_has_not_seen_the_mirror_is_no_judge() {
    let (scene, lights) = shipped("three_spheres", &[("= 256", "= 64"), ("= 128", "= 32")]);
    let found = convergence(&scene, &lights, &plan(&[LIGHT, Strategy::MisAuto], 8));
    assert_eq!(found.reference.run, Some((Strategy::MisTwo { heuristic: Heuristic::Balance }, 16 * 8)));
    let [light, auto] = &found.curves[..] else { panic!() };
    println!("{} of the tiles, claimed {}", light.out_of_reach, light.claimed);
    assert!(light.out_of_reach > 0.03 && light.claimed < 0.5);
    assert_eq!(auto.out_of_reach, 0.0);
    // Weights are chosen before the first pass, and that pass is like the others.
    let first = &auto.rungs[0];
    assert!(auto.before.mean > 4.0 * first.cpu.mean, "{:?} {:?}", auto.before, first.cpu);
    let table = convergence_table(&found, Cost::default(), None);
    assert!(
        table.contains("light: its samples hardly find the lobes") && table.contains("mis:auto: "),
        "{table}"
    );
    let json = convergence_to_json(&found, Cost::default(), Some(0.02));
    assert!(json["strategies"][0]["to_reach"].is_null(), "{json}");
    assert_eq!(json["strategies"][1]["to_reach"]["rms_error"], 0.02);
}

/// What the command says, with standard error, and its exit code.
fn converge(folder: &Path, words: &str) -> (Option<i32>, String) {
    let mut command = Command::new(cargo_bin!("warpcheck"));
    let output = command.current_dir(folder).arg("converge").args(words.split_whitespace()).output().unwrap();
    (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

/// The radiance of the furnace is its albedo: the scene says so, and only the pixels that show nothing but the ball are compared with it. A direction w uniform on
/// the hemisphere gives 2 a cos(w), of variance a^2 / 3.
#[test]
fn a_closed_form_is_the_reference() {
    let (scene, lights) = shipped("furnace", &[("= 64", "= 32")]);
    let truth = Truth::closed_form(&scene).unwrap();
    let plan = plan(&[Strategy::Uniform, LIGHT, Strategy::Brdf], 64);
    let found =
        convergence(&scene, &lights, &Experiment { truth, regions: regions_by_material(&scene), ..plan });
    let albedo = [0.8, 0.5, 0.2];
    assert_eq!(found.reference.parts, [("ball".to_owned(), albedo)]);
    let pixels = found.reference.pixels();
    assert!((300..512).contains(&pixels) && found.regions == [("ball".to_owned(), pixels)], "{pixels}");
    let expected = albedo.map(|a| f64::from(a).powi(2)).iter().sum::<f64>() / 3.0 / 3.0 / 64.0;
    for curve in &found.curves[..2] {
        let (slope, last, bias) = (curve.slope_samples.unwrap(), curve.last().unwrap(), curve.squared_bias);
        println!("{}: {slope:?}, {:?} of {expected}, bias^2 {bias:?}", curve.strategy, last.squared);
        assert!(slope.contains(-0.5) && slope.half_width < 0.1, "{slope:?}");
        assert!(bias.mean.abs() < 4.0 * bias.error && bias.error < 0.03 * last.squared.mean, "{bias:?}");
        assert!((curve.claimed - 1.0).abs() < 0.1, "{}", curve.claimed);
        assert_eq!(last.regions, [last.squared]);
    }
    let uniform = found.curves[0].last().unwrap().squared.mean;
    assert!((uniform / expected - 1.0).abs() < 0.1, "{uniform} of {expected}");
    assert!(found.curves[2].is_exact());
    // Nothing is said of the sky.
    let film = &found.at_equal_time(&scene, &lights, 1e-9)[0].1;
    let map = found.error_map(film);
    assert_eq!(map.values().iter().filter(|e| e.is_finite()).count(), pixels);
    assert!(map.values()[0].is_nan() && found.winners()[0].is_none());
    let table = convergence_table(&found, Cost::default(), None);
    assert!(
        table.contains(&format!("closed form of the scene (ball), at the {pixels} of 1024 pixels")),
        "{table}"
    );
    let json = convergence_to_json(&found, Cost::default(), None);
    assert_eq!(json["reference"]["pixels"], pixels);
    assert_eq!(json["reference"]["radiance"]["ball"].as_array().unwrap().len(), 3);
}

/// The command takes the closed form of the scene, unless it is told otherwise or looks at another scene.
#[test]
fn the_command_takes_the_closed_form() {
    let folder = tempdir().unwrap();
    let scene = data("scene/furnace.toml");
    let run = |more: &str| {
        converge(folder.path(), &format!("{} --strategy uniform --spp 2 --seeds 2 {more}", scene.display()))
    };
    let sky = data("env/noon_grass_512.hdr");
    for (more, says) in [
        ("", "closed form of the scene (ball)"),
        ("--reference mis-two", "reference: mis-two at 32 samples"),
        ("--reference 0.8,0.5,0.2", "reference: given"),
        (&format!("--map {}", sky.display()), "[reference] is left out: it is not of this --map"),
    ] {
        let (code, said) = run(more);
        assert!(code == Some(0) && said.contains(says), "{more}: {said}");
    }
    for wrong in ["0.8,0.5", "1,1,-1"] {
        let (code, said) = run(&format!("--reference {wrong}"));
        assert!(code == Some(2) && said.contains(&format!("a reference of radiance {wrong}")), "{said}");
    }
}

/// A square of albedo 0.5 that fills the picture, under a sky of radiance 1: `brdf` has no error.
#[test]
fn exact_strategies_are_told_so() {
    let folder = tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("square.mtl"), "newmtl square\nKd 0.5 0.5 0.5\n").unwrap();
    let mesh = "mtllib square.mtl\nusemtl square\nv -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nf 1 2 3 4\n";
    fs::write(path("square.obj"), mesh).unwrap();
    fs::copy(data("scene/white.hdr"), path("white.hdr")).unwrap();
    let scene = "materials = \"mtl\"\n[[mesh]]\nfile = \"square.obj\"\n[camera]\neye = [0, 0, 4]\nat = [0, 0, 0]\n\
                 fov_degrees = 30\n[environment]\nfile = \"white.hdr\"\n[picture]\nwidth = 16\nheight = 16\n";
    fs::write(path("square.toml"), scene).unwrap();
    let run = |strategies: &str| {
        let words = format!("square.toml --strategy {strategies} --reference 0.5 --spp 8 --seeds 3");
        let (code, said) =
            converge(folder.path(), &format!("{words} --out out --json out/c.json --report page"));
        assert_eq!(code, Some(0), "{said}");
        assert!(path("out/square-converge-sheet.png").exists());
        let text = |file: &str| fs::read_to_string(path(file)).unwrap();
        let (svg, csv) = (text("out/square-converge.svg"), text("out/square-converge.csv"));
        for text in [&said, &svg, &csv] {
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        }
        let json: serde_json::Value = serde_json::from_str(&text("out/c.json")).unwrap();
        (said, svg, json)
    };
    let sentence = "all strategies are exact: there is no error to draw";
    let (said, svg, json) = run("brdf");
    assert!(said.contains("all strategies are exact, but for rounding") && svg.contains(sentence), "{said}");
    assert_eq!(json["strategies"][0]["exact"], true);
    for key in ["efficiency", "to_reach", "slope_over_time"] {
        assert!(json["strategies"][0][key].is_null(), "{key}: {json}");
    }
    let (said, svg, json) = run("uniform,brdf,mis-two");
    let row = said.lines().find(|line| line.starts_with("whole picture")).unwrap();
    let cells: Vec<_> = row.split_whitespace().skip(3).collect();
    assert!(cells.contains(&"exact") && cells.contains(&"1.00") && !cells.contains(&"-"), "{said}");
    assert!(said.contains("\nbrdf: exact, but for rounding") && !svg.contains(sentence), "{said}");
    for part in json["equal_time"].as_array().unwrap() {
        let over_best = |i: usize| part["rms_error_over_best"][i]["value"].as_f64().unwrap();
        assert!(over_best(0) >= 1.0 && over_best(1) == 0.0 && over_best(2) >= 1.0, "{part}");
    }
}

/// Everything but the times: JSON without them.
fn without_times(found: &Convergence) -> serde_json::Value {
    let mut json = convergence_to_json(found, Cost::default(), None);
    assert!(json.as_object_mut().unwrap().remove("equal_time").is_some());
    for strategy in json["strategies"].as_array_mut().unwrap() {
        for key in
            ["slope_over_time", "squared_error_over_time", "efficiency", "to_reach", "cpu_seconds_before"]
        {
            assert!(strategy.as_object_mut().unwrap().remove(key).is_some(), "{key}");
        }
        for rung in strategy["rungs"].as_array_mut().unwrap() {
            for key in ["cpu_seconds", "wall_seconds"] {
                assert!(rung.as_object_mut().unwrap().remove(key).is_some(), "{key}");
            }
        }
    }
    json
}

#[test]
fn threads_change_no_bit() {
    let (scene, lights) = cornell("16");
    let plan = plan(&[LIGHT, Strategy::Brdf], 12);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        without_times(&pool.install(|| convergence(&scene, &lights, &plan)))
    };
    let once = on(1);
    assert_eq!(on(2), once);
    assert_eq!(on(5), once);
    assert_ne!(without_times(&convergence(&scene, &lights, &Experiment { seed: 2, ..plan.clone() })), once);
    // A strategy has the same pictures in any company.
    let alone =
        Experiment { strategies: vec![Strategy::Brdf], truth: Truth::LongRun(Some(LIGHT)), ..plan.clone() };
    let both = Experiment { truth: Truth::LongRun(Some(LIGHT)), ..plan };
    let [alone, both] = [alone, both].map(|plan| without_times(&convergence(&scene, &lights, &plan)));
    assert_eq!(alone["strategies"][0], both["strategies"][1]);
}

#[test]
fn what_is_done_is_kept() {
    let (scene, lights) = cornell("16");
    let stop = Arc::new(AtomicBool::new(false));
    let mine = Arc::clone(&stop);
    // The reference has 1024 passes, a picture 64: in the second picture at the latest.
    let progress = move |done: u64, total: u64| {
        assert!(done <= total && total == 64 * 10 + 1024);
        mine.store(done >= 1024 + 100, Ordering::Relaxed);
    };
    let plan = Experiment { progress: Some(Arc::new(progress)), stop: Some(stop), ..plan(&[LIGHT, MIS], 64) };
    let found = convergence(&scene, &lights, &plan);
    assert!(found.stopped);
    let rungs: usize = found.curves.iter().map(|c| c.rungs.len()).sum();
    assert!((7..=14).contains(&rungs), "{rungs}");
    assert!(found.curves.iter().all(|c| c.rungs.iter().all(|r| r.seeds <= 2)));
}

#[test]
fn the_command_leaves_plot_table_and_sheet() {
    let folder = tempdir().unwrap();
    let text = fs::read_to_string(data("scene/cornell.toml")).unwrap();
    let mesh = data("scene/cornell_measured.obj");
    let text = text.replace("cornell_measured.obj", mesh.to_str().unwrap()).replace("256", "24");
    fs::write(folder.path().join("stamp.toml"), text).unwrap();
    let run = |words: &str| {
        let mut command = Command::new(cargo_bin!("warpcheck"));
        let output = command.current_dir(folder.path()).args(words.split_whitespace()).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, said, told) =
        run("converge stamp.toml --strategy light,mis:0.25 --spp 16 --seeds 3 --out out --json out/c.json");
    assert_eq!((code, told.as_str()), (Some(0), ""), "{said}");
    for word in ["rms error", "slope: time", "whole picture", "reference: ", "set-up", "contact sheet: "] {
        assert!(said.contains(word), "{word} in {said}");
    }
    let out = folder.path().join("out");
    let csv = fs::read_to_string(out.join("stamp-converge.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 5, "{csv}");
    let json: serde_json::Value = serde_json::from_slice(&fs::read(out.join("c.json")).unwrap()).unwrap();
    // Two columns more for each part of the picture, the last of which are those of the last part.
    let parts = json["equal_time"].as_array().unwrap();
    assert!(csv.lines().all(|line| line.split(',').count() == 11 + 2 * (parts.len() - 1)), "{csv}");
    let name = parts.last().unwrap()["part"].as_str().unwrap();
    assert!(csv.lines().next().unwrap().ends_with(&format!(",squared_error {name},squared_error_se {name}")));
    let last = &json["strategies"][1]["rungs"][4]["regions"][name];
    for (back, key) in [(1, "mean"), (0, "standard_error")] {
        let field: f64 = csv.lines().last().unwrap().rsplit(',').nth(back).unwrap().parse().unwrap();
        assert!((field / last[key].as_f64().unwrap() - 1.0).abs() < 1e-12, "{key}: {field} {last}");
    }
    assert_eq!((json["schema_version"].as_u64(), json["strategies"].as_array().unwrap().len()), (Some(2), 2));
    assert!(fs::read_to_string(out.join("stamp-converge.svg")).unwrap().contains("slope -1/2"));
    let sheet = image::open(out.join("stamp-converge-sheet.png")).unwrap();
    assert!(sheet.width() > 512);
    assert_eq!(
        run("converge stamp.toml --strategy light --time 0.02 --seeds 2 --reference brdf --out out").0,
        Some(0)
    );
    let (code, said, _) = run("converge stamp.toml --strategy light --spp 1 --seeds 2 --out out");
    assert!(code == Some(0) && said.starts_with("2 samples a pixel: 1 has no standard error"), "{said}");
    for (words, why) in [
        ("converge stamp.toml --reference blocks.json", "only `agree` compares"),
        ("converge stamp.toml --spp 4 --time 1", "--time"),
        ("converge stamp.toml --seeds 1", "--seeds"),
        ("converge stamp.toml --reference=-1", "makes no sense"),
        ("converge stamp.toml --reference none.exr", "none.exr"),
        ("converge none.toml", "none.toml"),
    ] {
        let (code, said, told) = run(words);
        assert_eq!((code, said.as_str(), told.lines().count()), (Some(2), "", 1), "{words}: {told}");
        assert!(told.contains(why), "{words}: {told}");
    }
}
