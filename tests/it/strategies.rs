//! Every strategy and every way to sample lights estimates the same integral.
//!
//! Seeds are fixed, so a test passes always or never; the level is that at which a right estimator would fail by chance.

use glam::Vec3;
use std::{fs, path::PathBuf};
use warpcheck::estimator::{
    AUTO_WEIGHTS, Blocks, Integrator, LightSampling, Lights, Plan, Rendered, Rules, Selection, Settings,
    Strategy, compare, render,
};
use warpcheck::sampler::{Heuristic, Placement};
use warpcheck::scene::{RayQueries, RayStructure, Scene};

const LEVEL: f64 = 1e-5;
const TWO: Strategy = Strategy::MisTwo { heuristic: Heuristic::Balance };
const TWO_POWER: Strategy = Strategy::MisTwo { heuristic: Heuristic::Power };

/// A shipped scene with a picture of this size.
fn scene(name: &str, size: u32) -> Scene {
    let file: PathBuf = [env!("CARGO_MANIFEST_DIR"), "data/scene", &format!("{name}.toml")].iter().collect();
    let text = fs::read_to_string(&file).unwrap();
    let picture = |line: &str| match line.split(" = ").next() {
        Some(side @ ("width" | "height")) => format!("{side} = {size}\n"),
        _ => format!("{line}\n"),
    };
    Scene::from_toml(&text.lines().map(picture).collect::<String>(), &file).unwrap()
}

fn draw(scene: &Scene, lights: &Lights, strategy: Strategy, spp: u32, seed: u64) -> Rendered {
    let rendered = render(scene, lights, strategy, Settings { spp, seed }, |_| true);
    assert_eq!((rendered.passes, rendered.non_finite), (spp, 0), "{strategy}");
    rendered
}

#[track_caller]
fn same(title: &str, a: &Blocks, b: &Blocks) {
    let agreement = compare(a, b, Rules::default(), |_, _| false).unwrap();
    println!("{title}: {agreement}");
    assert!(agreement.agrees(LEVEL), "{title}: {agreement}");
    assert!(agreement.compared >= 30, "{title}: hardly anything was compared");
}

/// Lamps of different power, one- and two-sided, near and far, and a sky.
#[test]
fn every_way_to_sample_lights_agrees() {
    every_way_agrees(&[Strategy::Light, TWO]);
}

#[test]
#[ignore = "long: more strategies"]
fn every_way_to_sample_lights_agrees_by_other_strategies() {
    every_way_agrees(&[Strategy::Mis { brdf_weight: 0.25 }, TWO_POWER]);
}

fn every_way_agrees(strategies: &[Strategy]) {
    let scene = scene("lamps_and_sky", 64);
    let lights = Lights::load(&scene).unwrap();
    let reference = draw(&scene, &lights, Strategy::Mis { brdf_weight: 0.5 }, 64, 1).film.blocks(16);
    for (i, sampling) in LightSampling::all().enumerate() {
        let lights = Lights::load_with(&scene, sampling).unwrap();
        for (j, &strategy) in strategies.iter().enumerate() {
            let drawn = draw(&scene, &lights, strategy, 16, 10 + (4 * i + j) as u64).film.blocks(16);
            same(&format!("{strategy} with lights by {sampling}"), &drawn, &reference);
        }
    }
}

/// GGX over a diffuse base with smooth normals, under a sun.
#[test]
#[ignore = "long: two skies"]
fn strategies_agree_on_ggx() {
    let scene = scene("spot_ggx", 64);
    let lights = Lights::load(&scene).unwrap();
    let two = draw(&scene, &lights, TWO, 32, 1).film.blocks(16);
    for (i, strategy) in [Strategy::Light, Strategy::MisAuto, TWO_POWER].into_iter().enumerate() {
        same(&strategy.to_string(), &draw(&scene, &lights, strategy, 32, 2 + i as u64).film.blocks(16), &two);
    }
    // The sky alone, which the lobes find.
    let mut overcast = self::scene("spot_ggx", 64);
    let sky = overcast.environment.as_mut().unwrap();
    sky.file = sky.file.with_file_name("potsdamer_platz_512.hdr");
    let lights = Lights::load(&overcast).unwrap();
    let two = draw(&overcast, &lights, TWO, 32, 1).film.blocks(16);
    same("brdf", &draw(&overcast, &lights, Strategy::Brdf, 32, 2).film.blocks(16), &two);
}

/// The cow under every map that ships: what aims at the sky, with lobes and without.
#[test]
#[ignore = "long: five skies"]
fn strategies_agree_under_every_map() {
    let maps = concat!(env!("CARGO_MANIFEST_DIR"), "/data/env");
    let mut maps: Vec<PathBuf> = fs::read_dir(maps).unwrap().map(|entry| entry.unwrap().path()).collect();
    maps.sort();
    assert_eq!(maps.len(), 5);
    for map in maps {
        let mut scene = scene("spot_env", 64);
        scene.environment.as_mut().unwrap().file = map.clone();
        let lights = Lights::load(&scene).unwrap();
        let two = draw(&scene, &lights, TWO, 64, 1).film.blocks(16);
        for (i, strategy) in [Strategy::Light, Strategy::MisAuto, TWO_POWER].into_iter().enumerate() {
            let drawn = draw(&scene, &lights, strategy, 64, 2 + i as u64).film.blocks(16);
            same(&format!("{strategy} under {}", map.display()), &drawn, &two);
        }
    }
}

/// What a density that is 5% too small all over does to a picture, at this many samples.
#[test]
#[ignore = "long: 256 samples a pixel"]
fn five_percent_more_light_are_seen() {
    let scene = scene("lamps_and_sky", 64);
    let [right, other] =
        [LightSampling::default(), LightSampling { selection: Selection::Power, ..Default::default() }].map(
            |sampling| draw(&scene, &Lights::load_with(&scene, sampling).unwrap(), Strategy::Light, 256, 3),
        );
    let mut wrong = right.film.blocks(16);
    wrong.means.iter_mut().chain(&mut wrong.standard_errors).flatten().for_each(|x| *x *= 1.05);
    let judged = compare(&wrong, &other.film.blocks(16), Rules::default(), |_, _| false).unwrap();
    assert!(!judged.agrees(LEVEL), "{judged}");
}

/// Under a small bright lamp and a large faint one, selection that knows power and distance has less variance than
/// selection by area.
#[test]
fn better_selections_are_better() {
    let scene = scene("lamps_and_sky", 64);
    let error = |selection| {
        let sampling = LightSampling { selection, placement: Placement::SolidAngle };
        let lights = Lights::load_with(&scene, sampling).unwrap();
        let all = draw(&scene, &lights, Strategy::Light, 64, 5).film.blocks(64);
        all.standard_errors[0].iter().sum::<f64>()
    };
    let [area, power, distance] =
        [Selection::Area, Selection::Power, Selection::PowerOverDistance].map(error);
    println!("area {area:.3e}, power {power:.3e}, power/d2 {distance:.3e}");
    assert!(power < area && distance < power);
}

#[test]
fn mis_auto_is_unbiased_and_keeps_to_its_weights() {
    let scene = scene("three_spheres", 64);
    let lights = Lights::load(&scene).unwrap();
    let two = draw(&scene, &lights, TWO, 96, 1).film.blocks(16);
    let mut auto = draw(&scene, &lights, Strategy::MisAuto, 96, 2);
    same("mis:auto and mis-two", &auto.film.blocks(16), &two);
    let weights = auto.weights().unwrap().to_vec();
    assert!(weights.iter().all(|c| AUTO_WEIGHTS.contains(c)));
    // Where the mirror shows the lamp, it wants the lobe; the floor wants the lamp.
    let on = |exponent: f32| -> Vec<f32> {
        let shows = |&i: &usize| {
            let ray = scene.camera.ray((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5);
            scene.rays().closest(&ray).is_some_and(|hit| scene.material(hit.triangle).ns == exponent)
        };
        (0..weights.len()).filter(shows).map(|i| weights[i]).collect()
    };
    let (mirror, floor) = (on(1e21), on(1.0));
    assert!(mirror.iter().any(|&c| c > 0.5));
    assert!(floor.iter().filter(|&&c| c < 0.5).count() * 10 > floor.len() * 9);
    // Continued or at once, on any number of threads.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut paused = pool.install(|| draw(&scene, &lights, Strategy::MisAuto, 3, 2));
    paused.resume(&scene, &lights, 5, |_| true);
    auto = draw(&scene, &lights, Strategy::MisAuto, 5, 2);
    assert!(paused.film == auto.film && paused.weights() == auto.weights());
}

/// A convex body of albedo 0.8, 0.5, 0.2 under a sky of 1.
#[test]
fn white_furnace() {
    let scene = scene("furnace", 64);
    let lights = Lights::load(&scene).unwrap();
    let strategies = [
        Strategy::Uniform,
        Strategy::Brdf,
        Strategy::Light,
        Strategy::Mis { brdf_weight: 0.5 },
        Strategy::MisAuto,
        TWO,
        TWO_POWER,
    ];
    for strategy in strategies {
        let film = draw(&scene, &lights, strategy, 24, 1).film;
        let pixels: Vec<_> =
            (16..48).flat_map(|y| (16..48).map(move |x| (x, y))).map(|(x, y)| film.pixel(x, y)).collect();
        for (channel, albedo) in [0.8, 0.5, 0.2].into_iter().enumerate() {
            let n = pixels.len() as f64;
            let mean = pixels.iter().map(|p| p.mean()[channel]).sum::<f64>() / n;
            let error = pixels.iter().map(|p| p.standard_error()[channel].powi(2)).sum::<f64>().sqrt() / n;
            assert!((mean - albedo).abs() <= 4.0 * error + 1e-6, "{strategy} {channel}: {mean} ± {error}");
            assert!(error < 1e-2 * albedo, "{strategy}: {error}");
        }
    }
}

/// What a plan leaves out changes no bit, but for a constant sky, which is drawn from other variates.
#[test]
fn leaving_out_changes_no_bit() {
    let power = Strategy::MisTwo { heuristic: Heuristic::Power };
    let all = [
        Strategy::Uniform,
        Strategy::Brdf,
        Strategy::Light,
        Strategy::Mis { brdf_weight: 0.5 },
        TWO,
        power,
        Strategy::MisAuto,
    ];
    for name in
        ["cornell", "spot_env", "spot_ggx", "lamps_and_sky", "three_spheres", "veach_a3", "veach_marschner"]
    {
        let scene = scene(name, 32);
        let everything = Lights::load(&scene).unwrap();
        let trees = self::scene(name, 32).with_rays(RayStructure::Tree);
        let lists = self::scene(name, 32).with_rays(RayStructure::List);
        // The last two are made of the same parts: one scene with everything in it will do.
        let strategies = if name == "lamps_and_sky" { &all[..] } else { &all[..5] };
        for &strategy in strategies {
            let plan = Plan::of(&scene, &[strategy], LightSampling::default()).unwrap();
            let planned = draw(&scene, plan.lights(), strategy, 2, 1).film;
            let mut all = draw(&trees, &everything, strategy, 0, 1);
            let integrator = Integrator::new(&trees, &everything, strategy).with_all_lobes();
            all.resume_with(&integrator, 2, |_| true);
            assert!(planned == all.film, "{name} by {strategy}");
            if name == "cornell" {
                assert!(
                    planned == draw(&lists, &everything, strategy, 2, 1).film,
                    "{strategy}: list and tree"
                );
            }
        }
    }
    let scene = scene("furnace", 32);
    let plan = Plan::of(&scene, &[Strategy::Light], LightSampling::default()).unwrap();
    let [planned, all] = [(plan.lights(), 1), (&Lights::load(&scene).unwrap(), 2)]
        .map(|(lights, seed)| draw(&scene, lights, Strategy::Light, 256, seed).film);
    assert!(planned != all);
    let agreement = compare(&planned.blocks(4), &all.blocks(4), Rules::default(), |_, _| false).unwrap();
    assert!(agreement.agrees(LEVEL) && agreement.compared > 60, "{agreement}");
}

#[test]
fn a_plan_says_what_is_there_and_why() {
    let built = |name: &str, strategy: Strategy| -> Vec<&'static str> {
        let plan = Plan::of(&scene(name, 32), &[strategy], LightSampling::default()).unwrap();
        assert!(plan.parts().iter().all(|p| !p.why.is_empty()));
        plan.parts().iter().filter(|p| p.built).map(|p| p.name).collect()
    };
    assert_eq!(built("cornell", Strategy::Light), ["ray structure", "emitter table"]);
    assert_eq!(built("cornell", Strategy::Uniform), ["ray structure"]);
    assert_eq!(built("furnace", TWO), ["ray structure", "environment map"]);
    assert_eq!(built("spot_env", Strategy::Brdf), ["ray structure", "environment map", "Phong lobe"]);
    assert_eq!(
        built("lamps_and_sky", Strategy::MisAuto),
        [
            "ray structure",
            "environment map",
            "environment tables",
            "emitter table",
            "Phong lobe",
            "weights of the pixels"
        ]
    );
}

#[test]
#[should_panic(expected = "built without what `light` samples them by")]
fn lights_to_look_at_cannot_be_sampled() {
    let scene = scene("cornell", 32);
    let plan = Plan::of(&scene, &[Strategy::Brdf], LightSampling::default()).unwrap();
    draw(&scene, plan.lights(), Strategy::Light, 1, 1);
}

// ---- films ----

#[test]
fn a_saved_film_goes_on_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.film");
    let scene = scene("lamps_and_sky", 24);
    let lights = Lights::load(&scene).unwrap();
    for strategy in [Strategy::Light, Strategy::MisAuto, TWO_POWER] {
        draw(&scene, &lights, strategy, 3, 7).save(&file, &scene, &lights).unwrap();
        let mut resumed = Rendered::open(&file, &scene, &lights, strategy, 7).unwrap();
        assert_eq!(resumed.passes, 3);
        resumed.resume(&scene, &lights, 5, |_| true);
        let once = draw(&scene, &lights, strategy, 5, 7);
        assert!(resumed.film == once.film && resumed.passes == 5, "{strategy}");
    }
}

#[test]
fn a_film_of_something_else_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.film");
    let scene = scene("lamps_and_sky", 24);
    let lights = Lights::load(&scene).unwrap();
    draw(&scene, &lights, Strategy::Light, 2, 7).save(&file, &scene, &lights).unwrap();
    let refused = |scene: &Scene, lights: &Lights, strategy, seed, parts: &[&str]| {
        let error = Rendered::open(&file, scene, lights, strategy, seed).unwrap_err().to_string();
        assert!(error.contains("a.film"), "{error}");
        parts.iter().for_each(|part| assert!(error.contains(part), "`{part}` is not in: {error}"));
    };
    refused(&scene, &lights, Strategy::Brdf, 7, &["another strategy", "light, not brdf"]);
    refused(&scene, &lights, Strategy::Light, 8, &["another seed", "7, not 8"]);
    let larger = self::scene("lamps_and_sky", 25);
    refused(&larger, &lights, Strategy::Light, 7, &["another picture", "24 x 24 pixels, not 25 x 25"]);
    let other = self::scene("cornell", 24);
    refused(&other, &Lights::load(&other).unwrap(), Strategy::Light, 7, &["another scene"]);
    let power = LightSampling { selection: Selection::Power, ..Default::default() };
    let by_power = Lights::load_with(&scene, power).unwrap();
    refused(
        &scene,
        &by_power,
        Strategy::Light,
        7,
        &["another light sampling", "area, area, not power, area"],
    );

    let whole = fs::read(&file).unwrap();
    let damaged = |bytes: &[u8], part: &str| {
        fs::write(&file, bytes).unwrap();
        refused(&scene, &lights, Strategy::Light, 7, &["is no film", part]);
    };
    damaged(b"P6\n24 24\n", "begins otherwise");
    damaged(&whole[..whole.len() - 1], "checksum");
    damaged(&whole[..18], "ends too early");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    damaged(&flipped, "checksum");
    let mut newer = whole.clone();
    newer[16] = 9;
    damaged(&newer, "version is 9");
    fs::remove_file(&file).unwrap();
    refused(&scene, &lights, Strategy::Light, 7, &["cannot read"]);
}

/// A valley whose smooth normals point up at its bottom, and a lamp behind its left wall: the bottom faces the lamp by its shading normal, but
/// only through the wall it is on. Nothing may come through.
#[test]
fn smooth_normals_leak_no_light() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write(
        "valley.obj",
        "mtllib m.mtl\nusemtl grey\nv -1 1 -5\nv -1 1 5\nv 0 0 5\nv 0 0 -5\nv 1 1 5\nv 1 1 -5\nf 1 2 3 4\nf 4 3 5 6\n",
    );
    write("lamp.obj", "mtllib m.mtl\nusemtl lamp\nv -3 0 -1\nv -3 .8 -1\nv -3 .8 1\nv -3 0 1\nf 1 2 3 4\n");
    write("m.mtl", "newmtl grey\nKd .5 .5 .5\nKs .4 .4 .4\nNs 5\nnewmtl lamp\nKd 0 0 0\nKe 9 9 9\n");
    let toml = "materials = \"mtl\"\n[[mesh]]\nfile = \"valley.obj\"\nnormals = \"smooth\"\n[[mesh]]\nfile = \"lamp.obj\"\n\
        [camera]\neye = [0.0, 5.0, 0.0]\nat = [0.0, 0.0, 0.0]\nup = [0.0, 0.0, 1.0]\nfov_degrees = 15.0\n\
        [picture]\nwidth = 16\nheight = 16\n";
    for lobe in ["", "material = { roughness = 0.5 }\n"] {
        let toml = toml.replace("normals = \"smooth\"\n", &format!("normals = \"smooth\"\n{lobe}"));
        let scene = Scene::from_toml(&toml, folder.path().join("s.toml")).unwrap();
        let lamp = scene.emitters[0].vertices[1];
        // So that there is something to leak.
        let bent =
            (0..16).flat_map(|y| (0..16).map(move |x| (x as f32 + 0.5, y as f32 + 0.5))).filter(|&(x, y)| {
                let hit = scene.rays().closest(&scene.camera.ray(x, y)).unwrap();
                let to = lamp - scene.point(&hit);
                let up = |n: Vec3| n * n.y.signum();
                let flat = up(scene.triangles[hit.triangle as usize].normal);
                scene.emitted(scene.emitters[0].triangle, -to) != Vec3::ZERO
                    && flat.dot(to) < 0.0
                    && up(scene.shading_normal(&hit)).dot(to) > 0.0
            });
        assert!(bent.count() > 10);
        for sampling in LightSampling::all() {
            let lights = Lights::load_with(&scene, sampling).unwrap();
            for strategy in [Strategy::Uniform, Strategy::Brdf, Strategy::Light, TWO] {
                let film = draw(&scene, &lights, strategy, 16, 1).film;
                assert!(film.pixels().iter().all(|p| p.mean() == [0.0; 3]), "{strategy} by {sampling}");
            }
        }
    }
}
