//! Strategies against one another: right ones don't differ whatever the seed, wrong ones do, and what can't be told is said to be so.
//!
//! Seeds are fixed, so a test passes always or never.

use crate::scenes::{cornell, data, shipped};
use assert_cmd::cargo::cargo_bin;
use glam::{DVec3, Vec3};
use std::f32::consts::FRAC_1_PI;
use std::fs;
use std::process::{Command, Output};
use tempfile::{TempDir, tempdir};
use warpcheck::estimator::{
    Accord, Blocks, Criteria, Doubt, Estimate, Film, Integrator, Judgement, Lights, Settings, Strategy,
    TileTest, agree, sample,
};
use warpcheck::random::{stream, unit_f64};
use warpcheck::report::{Style, accord_table};
use warpcheck::sampler::Heuristic;
use warpcheck::scene::{RayQueries, Scene};

const LIGHT: Strategy = Strategy::Light;
const MIS: Strategy = Strategy::Mis { brdf_weight: 0.5 };
const ALL: [Strategy; 4] = [Strategy::Brdf, LIGHT, MIS, Strategy::Uniform];

fn draw(scene: &Scene, lights: &Lights, strategy: Strategy, spp: u32, seed: u64, tile: usize) -> Estimate {
    sample(scene, lights, strategy, Settings { spp, seed }, tile, |_| true).unwrap()
}

fn judge(estimates: &[Estimate]) -> Accord {
    let accord = agree(estimates, Criteria::default()).unwrap();
    println!("{}", accord_table(&accord, estimates, Style::Plain));
    accord
}

/// 32 films of an estimator of the caller's: radiance of a place in the picture for variates.
fn films(scene: &Scene, passes: u32, seed: u64, estimate: impl Fn(f32, f32, [f64; 4]) -> Vec3) -> Vec<Film> {
    let (width, height) = (scene.picture.width as usize, scene.picture.height as usize);
    let film = |batch| {
        let mut film = Film::new(width, height);
        let mut rng = stream(seed, "films", batch);
        for (i, _) in (0..width * height).flat_map(|i| (0..passes).map(move |pass| (i, pass))) {
            let (x, y) = (i % width, i / width);
            let [dx, dy, xi @ ..] = [(); 6].map(|()| unit_f64(&mut rng));
            let radiance = estimate((x as f64 + dx) as f32, (y as f64 + dy) as f32, xi);
            film.add(x, y, radiance.as_dvec3());
        }
        film
    };
    (0..32).map(film).collect()
}

/// Whether the camera sees a lamp there.
fn shows_lamp(scene: &Scene, x: f32, y: f32) -> bool {
    scene.rays().closest(&scene.camera.ray(x, y)).is_some_and(|hit| scene.emitter_of(hit.triangle).is_some())
}

#[test]
fn right_strategies_do_not_differ() {
    right_strategies(&[1]);
}

/// Runs each of which may fail with probability 1e-3 at most.
#[test]
#[ignore = "long: more seeds"]
fn right_strategies_never_differ() {
    right_strategies(&[2, 3]);
}

fn right_strategies(seeds: &[u64]) {
    let (scene, lights) = cornell("64");
    for &seed in seeds {
        let estimates = ALL.map(|strategy| draw(&scene, &lights, strategy, 64, seed, 8));
        let accord = judge(&estimates);
        assert_ne!(accord.judgement(), Judgement::Differ, "seed {seed}");
        // Those that aim at the lamp settle it.
        let pair = accord.pairs.iter().find(|p| (p.first, p.second) == (1, 2)).unwrap();
        // (Not how much light is untested: the lamp itself, most of it, is beside a tile that a few pixels' corners of it fall into.)
        assert!(pair.brightness_within < 0.05 && pair.tested() > 45);
    }
}

/// The p-values of right strategies are uniform: shares below some levels, within 4 standard errors for as many tests as there are tiles
/// (channels depend on each other).
#[test]
#[ignore = "long: a picture of 500 tiles"]
fn p_values_are_uniform() {
    let (scene, lights) = cornell("128");
    let estimates = [LIGHT, MIS].map(|strategy| draw(&scene, &lights, strategy, 64, 3, 8));
    let p = &judge(&estimates).pairs[0].p_values;
    assert!(p.len() > 500, "{}", p.len());
    for level in [0.05, 0.2, 0.5, 0.8] {
        let share = p.iter().filter(|p| **p < level).count() as f64 / p.len() as f64;
        let error = (level * (1.0 - level) / (p.len() as f64 / 3.0)).sqrt();
        println!("{share:.3} below {level}, ± {error:.3}");
        assert!((share - level).abs() < 4.0 * error, "{share} below {level}");
    }
}

/// The variates of a one-sample strategy, which uses four.
fn seven([a, b, c, d]: [f64; 4]) -> [f64; 7] {
    [a, b, c, d, 0.0, 0.0, 0.0]
}

/// A density that is 2% off, and the same estimator without the mistake.
#[test]
#[ignore = "long: three times 768 passes"]
fn a_density_that_is_off_is_caught() {
    let (scene, lights) = cornell("64");
    let right = draw(&scene, &lights, LIGHT, 768, 1, 8);
    let mis = Integrator::new(&scene, &lights, MIS);
    for (factor, expected) in
        [(1.0, Judgement::Agree), (1.02, Judgement::Differ), (1.0 / 1.02, Judgement::Differ)]
    {
        let films = films(&scene, 24, 2, |x, y, xi| {
            let divide = if shows_lamp(&scene, x, y) { 1.0 } else { factor };
            mis.radiance(x, y, seven(xi)) / divide
        });
        let accord = judge(&[right.clone(), Estimate::from_films("theirs", &films, 8)]);
        assert_eq!(accord.judgement(), expected, "{factor}");
        // What is said to be ruled out would be right: the factor lies within the bound if it is found to agree.
        assert!(accord.pairs[0].brightness_within < 0.03);
    }
}

/// A one-sample mixture of one's own for diffuse surfaces, in equal parts by cosine and by the area of the lamps, whose density of the lamps is `off` times what it
/// should be.
fn own_mixture(scene: &Scene, x: f32, y: f32, [pick, a, b, c]: [f64; 4], off: f32) -> Vec3 {
    let ray = scene.camera.ray(x, y);
    let Some(hit) = scene.rays().closest(&ray) else { return Vec3::ZERO };
    let emitted = scene.emitted(hit.triangle, -ray.direction);
    let geometric = scene.triangles[hit.triangle as usize].normal;
    let (normal, at) = (geometric * -geometric.dot(ray.direction).signum(), scene.point(&hit));
    let areas: Vec<f64> = scene.emitters.iter().map(|e| e.area).collect();
    let area: f64 = areas.iter().sum();
    let (point, emitter) = if pick < 0.5 {
        let (across, turn) = (b.sqrt(), std::f64::consts::TAU * c);
        let [u, v, up] = [across * turn.cos(), across * turn.sin(), (1.0 - b).sqrt()].map(|x| x as f32);
        let tangent = normal.any_orthonormal_vector();
        let w = tangent * u + normal.cross(tangent) * v + normal * up;
        let Some(next) = scene.rays().closest(&scene.leave(&hit, w)) else { return emitted };
        let Some(emitter) = scene.emitter_of(next.triangle) else { return emitted };
        (scene.point(&next), &scene.emitters[emitter])
    } else {
        let mut left = a * area;
        let chosen = areas.iter().position(|&area| {
            left -= area;
            left < 0.0
        });
        let emitter = &scene.emitters[chosen.unwrap_or(areas.len() - 1)];
        let (b, c) = (b.sqrt() as f32, c as f32);
        let [v0, v1, v2] = emitter.vertices;
        let point = v0 * (1.0 - b) + v1 * (b * (1.0 - c)) + v2 * (b * c);
        if !scene.sees(at, hit.triangle, point, emitter.triangle) {
            return emitted;
        }
        (point, emitter)
    };
    let w = (point - at).normalize();
    let (cosine, of_lamp) = (normal.dot(w).max(0.0), emitter.normal.dot(-w).max(0.0));
    if cosine * of_lamp == 0.0 {
        return emitted;
    }
    let lamps = at.distance_squared(point) / (of_lamp * area as f32);
    let density = 0.5 * cosine * FRAC_1_PI + 0.5 * off * lamps;
    emitted + scene.material(hit.triangle).kd * FRAC_1_PI * emitter.radiance * cosine / density
}

/// A density that is 2% off inside of a mixture, where it is one of two.
#[test]
#[ignore = "long: three times 768 passes"]
fn a_density_that_is_off_in_a_mixture_is_caught() {
    let (scene, lights) = cornell("64");
    let right = draw(&scene, &lights, LIGHT, 768, 1, 8);
    for (off, expected) in [(1.0, Judgement::Agree), (1.02, Judgement::Differ), (0.98, Judgement::Differ)] {
        let films = films(&scene, 24, 2, |x, y, xi| own_mixture(&scene, x, y, xi, off));
        let accord = judge(&[right.clone(), Estimate::from_films("own mixture", &films, 8)]);
        assert_eq!(accord.judgement(), expected, "{off}");
    }
}

/// A light sampler of one's own that picks one of the lamp's triangles: it has to divide by the probability of the pick.
#[test]
fn a_missing_selection_probability_is_caught() {
    let (scene, lights) = cornell("64");
    let count = scene.emitters.len();
    assert_eq!(count, 2);
    let estimate = |x: f32, y: f32, xi: [f64; 4], pick: f32| {
        let ray = scene.camera.ray(x, y);
        let Some(hit) = scene.rays().closest(&ray) else { return Vec3::ZERO };
        let triangle = &scene.triangles[hit.triangle as usize];
        let emitted = scene.emitted(hit.triangle, -ray.direction);
        let normal = triangle.normal * -triangle.normal.dot(ray.direction).signum();
        let emitter = &scene.emitters[((xi[0] * count as f64) as usize).min(count - 1)];
        let (b, c) = (xi[1].sqrt(), xi[2]);
        let [v0, v1, v2] = emitter.vertices;
        let point = v0 * (1.0 - b) as f32 + v1 * (b * (1.0 - c)) as f32 + v2 * (b * c) as f32;
        let at = scene.point(&hit);
        let w = (point - at).normalize();
        let cosines = normal.dot(w).max(0.0) * emitter.normal.dot(-w).max(0.0);
        if cosines == 0.0 || !scene.sees(at, hit.triangle, point, emitter.triangle) {
            return emitted;
        }
        let density = pick / emitter.area as f32;
        let kd = scene.material(hit.triangle).kd;
        emitted + kd * FRAC_1_PI * emitter.radiance * cosines / (density * at.distance_squared(point))
    };
    let theirs = |name: &str, pick: f32| {
        Estimate::from_films(name, &films(&scene, 4, 5, |x, y, xi| estimate(x, y, xi, pick)), 8)
    };
    let right = draw(&scene, &lights, LIGHT, 128, 1, 8);
    // A tile above the lamp that hardly any sample lights may stay open.
    let control = judge(&[right.clone(), theirs("one of two", 0.5)]);
    assert!(control.judgement() != Judgement::Differ && control.pairs[0].tested() > 45);
    assert_eq!(judge(&[right, theirs("forgot the pick", 1.0)]).judgement(), Judgement::Differ);
}

/// A film whose sums have 6 bits stalls after some hundred samples, as `f32` does after 2^24.
#[test]
#[ignore = "long: films of many batches"]
fn a_stalled_film_is_caught() {
    let (scene, lights) = cornell("12");
    let integrator = Integrator::new(&scene, &lights, MIS);
    let rounded = |x: f64, bits: i32| {
        if x == 0.0 {
            return 0.0;
        }
        let step = 2.0_f64.powi(x.log2().floor() as i32 - bits + 1);
        (x / step).round() * step
    };
    for (bits, expected) in [(30, Judgement::Agree), (6, Judgement::Differ)] {
        let films: Vec<_> = (0..32)
            .map(|batch| {
                let mut film = Film::new(12, 12);
                let mut rng = stream(4, "stalled", batch);
                for i in 0..12 * 12 {
                    let (x, y) = (i % 12, i / 12);
                    let mut sum = DVec3::ZERO;
                    for _ in 0..256 {
                        let [dx, dy, xi @ ..] = [(); 6].map(|()| unit_f64(&mut rng));
                        let radiance =
                            integrator.radiance((x as f64 + dx) as f32, (y as f64 + dy) as f32, seven(xi));
                        let next = (sum + radiance.as_dvec3()).map(|s| rounded(s, bits));
                        film.add(x, y, next - sum);
                        sum = next;
                    }
                }
                film
            })
            .collect();
        let estimates =
            [draw(&scene, &lights, LIGHT, 1024, 1, 4), Estimate::from_films("short sums", &films, 4)];
        assert_eq!(judge(&estimates).judgement(), expected, "{bits} bits");
    }
}

/// Samples of the lamp see the diffuse base of a mirror and nothing else of it, so that their mean there looks as if it were known.
#[test]
fn a_mirror_over_a_diffuse_base_is_no_alarm() {
    let (scene, lights) = shipped("three_spheres", &[("= 256", "= 64"), ("= 128", "= 32")]);
    let two = Strategy::MisTwo { heuristic: Heuristic::Balance };
    let estimates = [LIGHT, two].map(|strategy| draw(&scene, &lights, strategy, 64, 1, 8));
    let accord = judge(&estimates);
    assert_eq!(accord.judgement(), Judgement::Inconclusive);
    assert!(accord.pairs[0].count(|t| *t == TileTest::Doubtful(Doubt::Unseen)) > 0);
}

/// Light sampling hardly ever finds the lobe of a sharp plate: neither agreement nor an alarm, and the plates are named.
#[test]
fn heavy_tails_are_inconclusive() {
    heavy_tails(&[1]);
}

#[test]
#[ignore = "long: more seeds"]
fn heavy_tails_are_always_inconclusive() {
    heavy_tails(&[2, 3]);
}

fn heavy_tails(seeds: &[u64]) {
    let (scene, lights) = shipped("veach_a3", &[("= 256", "= 128"), ("= 128\ndisplay", "= 64\ndisplay")]);
    assert_eq!((scene.picture.width, scene.picture.height), (128, 64));
    for &seed in seeds {
        let estimates = [LIGHT, MIS].map(|strategy| draw(&scene, &lights, strategy, 128, seed, 4));
        let accord = judge(&estimates);
        assert_eq!(accord.judgement(), Judgement::Inconclusive, "seed {seed}");
        let pair = &accord.pairs[0];
        let (mut sharp, mut lit) = (0, 0);
        for (i, tile) in pair.tiles.iter().enumerate() {
            let (x, y) = (i % 32 * 4, i / 32 * 4);
            let ns = |dx: u32, dy: u32| {
                let ray = scene.camera.ray(x as f32 + dx as f32, y as f32 + dy as f32);
                scene.rays().closest(&ray).map_or(0.0, |hit| scene.material(hit.triangle).ns)
            };
            let corners = [ns(0, 0), ns(4, 0), ns(0, 4), ns(4, 4)];
            if corners.iter().all(|n| *n >= 1e4) {
                sharp += 1;
                lit += usize::from(matches!(tile, TileTest::Doubtful(_)));
                // Never tested alone; together with others only if enough of it was seen.
                assert!(!matches!(tile, TileTest::Tested { together: 1, .. }), "({x}, {y}) {tile:?}");
            }
        }
        assert!(sharp > 20 && lit > 10, "{lit} of {sharp} tiles");
        let unseen = pair.count(|t| *t == TileTest::Doubtful(Doubt::Unseen));
        assert!(unseen > 10, "{unseen}");
        assert!(accord_table(&accord, &estimates, Style::Plain).contains("tiles unseen, within columns"));
    }
}

/// The rare sample of enormous value that a strategy makes, and has not made yet.
#[test]
fn what_has_not_come_yet_is_no_difference() {
    let films = |odds: f64, seed| {
        let film = |batch| {
            let mut film = Film::new(16, 16);
            let mut rng = stream(seed, "rare", batch);
            for i in 0..16 * 16 * 4 {
                let rare = if unit_f64(&mut rng) < odds { 0.5 / odds } else { 0.0 };
                film.add(i % 16, i / 16 % 16, DVec3::splat(unit_f64(&mut rng) + rare));
            }
            film
        };
        Estimate::from_films("rare", &(0..32).map(film).collect::<Vec<_>>(), 8)
    };
    // Three bright samples a tile: without the look at skewness every fifth run would be an alarm.
    let mut inconclusive = 0;
    for seed in 0..20 {
        let accord = judge(&[films(0.5, 1), films(3.0 / (64.0 * 128.0), seed + 2)]);
        assert_ne!(accord.judgement(), Judgement::Differ, "seed {seed}");
        inconclusive += usize::from(accord.judgement() == Judgement::Inconclusive);
    }
    assert!(inconclusive >= 15, "{inconclusive} of 20");
}

/// An independent renderer's block means, which `mis` and `brdf` agree with.
fn reference() -> Estimate {
    let text = fs::read(data("reference/veach_a3_256x128.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let triples = |key: &str| -> Vec<[f64; 3]> {
        let rows = json[key].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
        rows.map(|block| [0, 1, 2].map(|c| block[c].as_f64().unwrap())).collect()
    };
    // Means are written to 1e-8.
    let rounding = 1e-8 / 12.0_f64.sqrt();
    let (means, errors) = (triples("block_mean"), triples("block_stderr"));
    let standard_errors = errors.into_iter().map(|e| e.map(|e| e.hypot(rounding))).collect();
    let effective = vec![[f64::INFINITY; 3]; means.len()];
    Estimate::known(
        "reference",
        &Blocks { size: 16, columns: 16, rows: 8, means, standard_errors, effective },
        256,
        128,
    )
}

fn against_the_reference(spp: u32, tested: usize, within: f64) {
    let (scene, lights) = shipped("veach_a3", &[]);
    for (strategy, share) in [(MIS, 1.0), (Strategy::Brdf, 0.3)] {
        let accord = judge(&[draw(&scene, &lights, strategy, spp, 1, 16), reference()]);
        let pair = &accord.pairs[0];
        assert_ne!(pair.judgement, Judgement::Differ, "{strategy}");
        assert!(pair.tested() as f64 > share * tested as f64, "{strategy}: {} tested", pair.tested());
        assert!(pair.brightness_within < within / share, "{strategy}: {}", pair.brightness_within);
    }
}

#[test]
#[ignore = "long: many samples"]
fn the_reference_of_the_plates_agrees() {
    against_the_reference(64, 80, 0.02);
}

/// `cargo test --release --test it -- --ignored agree::`: a few minutes.
#[test]
#[ignore = "long: 2048 samples a pixel"]
fn the_reference_of_the_plates_agrees_closely() {
    against_the_reference(2048, 100, 0.005);
}

#[test]
fn shapes_and_numbers_that_are_none() {
    let film = |value: f64| {
        let mut film = Film::new(8, 8);
        (0..128).for_each(|i| film.add(i % 8, i / 8 % 8, DVec3::splat(value)));
        film
    };
    let flat = |value: f64, size| Estimate::from_films("flat", &vec![film(value); 16], size);
    assert_eq!(judge(&[flat(1.0, 4), flat(1.0, 4)]).judgement(), Judgement::Agree);
    assert_eq!(judge(&[flat(1.0, 4), flat(1.0 + 1e-7, 4)]).judgement(), Judgement::Agree);
    assert_eq!(judge(&[flat(1.0, 4), flat(1.001, 4)]).judgement(), Judgement::Differ);
    let dark = judge(&[flat(0.0, 4), flat(0.0, 4)]);
    assert_eq!(dark.pairs[0].count(|t| *t == TileTest::Dark), 4);
    // One that has seen light where the other has not is no alarm.
    assert_eq!(judge(&[flat(1.0, 4), flat(0.0, 4)]).judgement(), Judgement::Inconclusive);
    let mut bad = flat(1.0, 4);
    bad.non_finite = 1;
    assert_eq!(judge(&[flat(1.0, 4), bad]).judgement(), Judgement::Differ);
    assert!(agree(&[flat(1.0, 4), flat(1.0, 8)], Criteria::default()).is_err());
}

/// Films of a radiance that is known, with the noise of a uniform variate of that half width around it.
fn noisy(size: usize, half: f64, seed: u64, radiance: impl Fn(usize, usize) -> f64) -> Vec<Film> {
    let film = |batch| {
        let mut film = Film::new(size, size);
        let mut rng = stream(seed, "noisy", batch);
        for i in (0..size * size).flat_map(|i| [i, i]) {
            let (x, y) = (i % size, i / size);
            film.add(x, y, DVec3::splat(radiance(x, y) + half * (2.0 * unit_f64(&mut rng) - 1.0)));
        }
        film
    };
    (0..32).map(film).collect()
}

/// Light that a strategy has not met yet in one pixel, or that another has met once too often, is no mistake that is proved; the same light over the
/// whole tile is one.
#[test]
fn a_difference_in_a_few_pixels_is_doubtful() {
    let plain = |seed| noisy(16, 0.3, seed, |_, _| 1.0);
    let wrong = |seed, pixels: usize| {
        let share = 0.5 / pixels as f64;
        noisy(
            16,
            0.3,
            seed,
            move |x, y| if y * 8 + x < pixels && x < 8 && y < 8 { 1.0 + 64.0 * share } else { 1.0 },
        )
    };
    let right = Estimate::from_films("right", &plain(1), 8);
    for (pixels, expected) in
        [(1, Judgement::Inconclusive), (3, Judgement::Inconclusive), (16, Judgement::Differ)]
    {
        let accord = judge(&[right.clone(), Estimate::from_films("other", &wrong(2, pixels), 8)]);
        assert_eq!(accord.judgement(), expected, "{pixels} pixels");
        let doubtful = accord.pairs[0].tiles[0] == TileTest::Doubtful(Doubt::FewPixels);
        assert_eq!(doubtful, pixels <= 3, "{pixels} pixels");
    }
}

/// One sample in a few thousand finds a small lamp, and is worth a sixth of the light of a tile: tiles that none has found are too dark, by more than
/// they scatter, yet no alarm. The same lack is one where no tile near has found it either.
#[test]
fn a_lamp_that_few_tiles_have_seen_is_no_alarm() {
    const SIDE: usize = 160;
    let films = |seed, last: usize| -> Vec<Film> {
        let film = |batch| {
            let mut film = Film::new(SIDE, SIDE);
            let mut rng = stream(seed, "rare", batch);
            for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
                let [noise, pick] = [(); 2].map(|()| unit_f64(&mut rng));
                let found = if x < last && pick < 2e-4 { 0.2 / 2e-4 } else { 0.0 };
                film.add(x, y, DVec3::splat(0.7 + 0.6 * noise + found));
            }
            film
        };
        (0..32).map(film).collect()
    };
    let blocks = Film::new(SIDE, SIDE).blocks(8);
    let all = blocks.columns * blocks.rows;
    let known = Blocks { means: vec![[1.2; 3]; all], standard_errors: vec![[0.0; 3]; all], ..blocks };
    let known = Estimate::known("known", &known, SIDE, SIDE);
    for seed in 1..=3 {
        let accord = judge(&[Estimate::from_films("rare", &films(seed, SIDE), 8), known.clone()]);
        assert_ne!(accord.judgement(), Judgement::Differ, "seed {seed}");
        assert!(accord.pairs[0].count(|t| *t == TileTest::Doubtful(Doubt::TailAround)) > 0, "seed {seed}");
    }
    let accord = judge(&[Estimate::from_films("half", &films(1, SIDE / 2), 8), known]);
    assert_eq!(accord.judgement(), Judgement::Differ);
}

/// However little light a tile has that would have been an alarm: it is named, and the pictures do not agree.
#[test]
fn what_would_have_been_an_alarm_is_not_negligible() {
    let right = Estimate::from_films("right", &noisy(128, 0.3, 1, |_, _| 1.0), 8);
    let spot = |x, y| if (x, y) == (20, 20) { 33.0 } else { 1.0 };
    let accord = judge(&[right, Estimate::from_films("spot", &noisy(128, 0.3, 2, spot), 8)]);
    let pair = &accord.pairs[0];
    assert!(
        pair.untested_light < 0.01 && pair.doubtful() == 1,
        "{} {}",
        pair.untested_light,
        pair.doubtful()
    );
    assert_eq!(accord.judgement(), Judgement::Inconclusive);
}

/// The noise of a picture whose samples are not known is seen in its pixels, on a slope too; said to be exact, it is a difference.
#[test]
fn noise_of_a_picture_is_estimated() {
    let slope = |x: usize, y: usize| 1.0 + 0.05 * x as f64 + 0.02 * y as f64;
    let right = Estimate::from_films("right", &noisy(32, 0.3, 1, slope), 8);
    let picture = |factor: f64, seed| {
        let film = &noisy(32, 0.6, seed, slope)[0];
        warpcheck::picture::Picture::from_fn(32, 32, |x, y| {
            film.pixel(x, y).mean().map(|v| (v * factor) as f32)
        })
    };
    for seed in 2..12 {
        let known = |factor, exact| Estimate::from_picture("picture", &picture(factor, seed), 8, exact);
        assert_eq!(judge(&[right.clone(), known(1.0, false)]).judgement(), Judgement::Agree, "seed {seed}");
        assert_eq!(judge(&[right.clone(), known(1.1, false)]).judgement(), Judgement::Differ, "seed {seed}");
        assert_eq!(judge(&[right.clone(), known(1.0, true)]).judgement(), Judgement::Differ, "seed {seed}");
    }
}

/// The smallest of Marschner's lamps is found by one sample of the BRDF in a tile, or by none.
#[test]
#[ignore = "long: four seeds"]
fn plates_under_five_lamps_are_no_alarm() {
    let (scene, lights) = shipped("veach_marschner", &[]);
    for seed in 1..=4 {
        let strategies = [Strategy::Brdf, MIS, Strategy::MisTwo { heuristic: Heuristic::Balance }];
        let accord = judge(&strategies.map(|strategy| draw(&scene, &lights, strategy, 64, seed, 8)));
        assert_ne!(accord.judgement(), Judgement::Differ, "seed {seed}");
        // Both that aim at lamps and lobes have seen most of it.
        let pair = accord.pairs.iter().find(|p| (p.first, p.second) == (1, 2)).unwrap();
        assert!(
            pair.tested() > 800 && pair.brightness_within < 0.02,
            "{} {}",
            pair.tested(),
            pair.brightness_within
        );
    }
}

/// A picture of the plates as people have it: no seed is an alarm, though a corner of the smallest lamp is met by few samples, by `brdf` by far the fewest.
#[test]
#[ignore = "long: six seeds, and a thousand samples a pixel"]
fn the_picture_of_the_plates_is_no_alarm() {
    let (scene, lights) = shipped("veach_a3", &[]);
    let picture = warpcheck::picture::read(data("reference/veach_a3_256x128.exr")).unwrap();
    let against = |strategy, spp, seed| {
        let reference = Estimate::from_picture("reference", &picture, 8, false);
        let accord = judge(&[draw(&scene, &lights, strategy, spp, seed, 8), reference]);
        assert_ne!(accord.judgement(), Judgement::Differ, "{strategy}, seed {seed}");
        assert!(accord.pairs[0].tested() > 250, "{strategy}: {}", accord.pairs[0].tested());
    };
    (1..=6).for_each(|seed| against(MIS, 64, seed));
    against(Strategy::Brdf, 1024, 1);
}

// ---- The command ----

fn warpcheck(folder: &TempDir, words: &str) -> (Option<i32>, String, String) {
    let mut command = Command::new(cargo_bin!("warpcheck"));
    command.current_dir(folder.path()).args(words.split_whitespace());
    let Output { status, stdout, stderr } = command.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (status.code(), text(stdout), text(stderr))
}

fn small_scene(folder: &TempDir) {
    let mesh = data("scene/cornell_measured.obj");
    let text = fs::read_to_string(data("scene/cornell.toml")).unwrap();
    let text = text.replace("cornell_measured.obj", mesh.to_str().unwrap()).replace("256", "32");
    fs::write(folder.path().join("stamp.toml"), text).unwrap();
}

#[test]
fn exit_codes_tell_the_verdict() {
    let folder = tempdir().unwrap();
    small_scene(&folder);
    let (code, said, told) =
        warpcheck(&folder, "agree stamp.toml --strategy light,mis:0.5 --spp 256 --out out --json out/a.json");
    assert_eq!((code, told.as_str()), (Some(0), ""), "{said}");
    assert!(
        said.contains("agree: 1 of 1 pairs agree") && said.contains("maps: out/stamp-agree.png"),
        "{said}"
    );
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("out/a.json")).unwrap()).unwrap();
    assert_eq!((json["schema_version"].as_u64(), json["verdict"].as_str()), (Some(2), Some("agree")));
    assert!(json["pairs"][0]["brightness_within"].as_f64().unwrap() < 0.05);
    // Every tile is there, tested or not, and none has a p-value that would not agree.
    let tiles = json["pairs"][0]["tiles"].as_array().unwrap();
    let p = tiles.iter().filter_map(|t| t["p"].as_f64());
    assert_eq!((tiles.len(), json["estimates"][1]["samples"].as_u64()), (16, Some(256)));
    assert_eq!(p.clone().count() as u64, json["pairs"][0]["tested"].as_u64().unwrap());
    assert!(p.clone().all(|p| p > 1e-6 && p <= 1.0) && p.count() > 8, "{tiles:?}");
    image::open(folder.path().join("out/stamp-agree.png")).unwrap();

    // A picture of the same scene agrees; a brighter one does not.
    warpcheck(&folder, "render stamp.toml --strategy light --spp 1024 --seed 9 --out made");
    let file = folder.path().join("made/stamp-light-1024spp.exr");
    let picture = warpcheck::picture::read(&file).unwrap();
    let agree = "agree stamp.toml --strategy light --spp 128 --out out --reference";
    let (code, said, _) = warpcheck(&folder, &format!("{agree} {}", file.display()));
    assert_eq!(code, Some(0), "{said}");
    let brighter = warpcheck::picture::Picture::from_fn(32, 32, |x, y| picture.at(x, y).map(|v| v * 1.05));
    warpcheck::picture::write_exr(folder.path().join("brighter.exr"), &brighter).unwrap();
    let (code, said, _) = warpcheck(&folder, &format!("{agree} brighter.exr"));
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("differ: light / reference") && said.contains("worst tile"), "{said}");

    let few = "agree stamp.toml --strategy light,uniform --spp 16 --out out";
    let (code, said, _) = warpcheck(&folder, few);
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("inconclusive: light / uniform") && said.contains("tiles"), "{said}");
    assert_eq!(warpcheck(&folder, &format!("{few} --allow-inconclusive")).0, Some(0));
    for (words, why) in [
        ("agree stamp.toml --strategy light", "agrees with itself"),
        ("agree stamp.toml --strategy cosine", "is no strategy"),
        ("agree stamp.toml --reference nothing.exr", "nothing.exr"),
        ("agree stamp.toml --reference stamp.json", "stamp.json"),
        ("agree stamp.toml --tile 0", "--tile"),
    ] {
        let (code, said, told) = warpcheck(&folder, words);
        assert_eq!((code, said.as_str(), told.lines().count()), (Some(2), "", 1), "{words}: {told}");
        assert!(told.contains(why), "{words}: {told}");
    }
}
