//! The strategies against one another, an independent renderer, and closed forms.
//!
//! Seeds are fixed, so a test passes always or never; levels are those at which a correct estimator would fail
//! by chance.

use crate::scenes::{data, shipped};
use glam::{DVec3, Vec3};
use std::{collections::HashSet, f64::consts::PI, fmt::Write, fs};
use tempfile::TempDir;
use warpcheck::estimator::{
    Agreement, Blocks, Film, LightSampling, Lights, Rendered, Rules, Settings, Strategy, compare, render,
};
use warpcheck::sampler::{Environment, Heuristic, RowWarp};
use warpcheck::scene::{RayQueries, Scene};

const UNIFORM: Strategy = Strategy::Uniform;
const BRDF: Strategy = Strategy::Brdf;
const LIGHT: Strategy = Strategy::Light;
const AUTO: Strategy = Strategy::MisAuto;
const TWO: Strategy = Strategy::MisTwo { heuristic: Heuristic::Balance };
const TWO_POWER: Strategy = Strategy::MisTwo { heuristic: Heuristic::Power };
const fn mis(brdf_weight: f64) -> Strategy {
    Strategy::Mis { brdf_weight }
}

/// The level of every comparison: a hundred of them fail by chance once in a thousand times.
const LEVEL: f64 = 1e-5;

/// The numbers in the array (of arrays) that follows a path of keys, in order; enough JSON for our own files.
fn numbers(json: &str, keys: &[&str]) -> Vec<f64> {
    let at = keys.iter().fold(json, |json, key| json.split_once(&format!("\"{key}\":")).expect(key).1);
    let mut depth = 0;
    let end = at.find(|c| {
        depth += i32::from(c == '[') - i32::from(c == ']');
        depth == 0 && c != ' '
    });
    let numbers = at[..end.unwrap()].split(['[', ']', ',', ' ', '\n']).filter(|s| !s.is_empty());
    numbers.map(|s| s.parse().unwrap()).collect()
}

fn triples(json: &str, keys: &[&str]) -> Vec<[f64; 3]> {
    numbers(json, keys).chunks_exact(3).map(|c| c.try_into().unwrap()).collect()
}

/// A shipped scene and its lights.
/// A scene made of polygons, each with the body of its material.
struct Made {
    obj: String,
    mtl: String,
    vertices: usize,
    tail: String,
}

impl Made {
    /// A picture of `size` pixels squared that shows a spot of `fov` degrees; `tail` is more of the scene file.
    fn new(convention: &str, eye: Vec3, at: Vec3, fov: f64, size: u32, tail: &str) -> Self {
        let up = (at - eye).any_orthogonal_vector();
        let tail = format!(
            "materials = \"{convention}\"\n[[mesh]]\nfile = \"made.obj\"\n[camera]\neye = {:?}\nat = {:?}\nup = {:?}\n\
             fov_degrees = {fov}\n[picture]\nwidth = {size}\nheight = {size}\n{tail}",
            eye.to_array(),
            at.to_array(),
            up.to_array(),
        );
        Self { obj: "mtllib made.mtl\n".into(), mtl: String::new(), vertices: 0, tail }
    }

    fn polygon(self, corners: &[Vec3], material: &str) -> Self {
        self.face(corners, Some(material))
    }

    /// A polygon of a new material, or of the one before it.
    fn face(mut self, corners: &[Vec3], material: Option<&str>) -> Self {
        if let Some(material) = material {
            writeln!(self.mtl, "newmtl m{}\n{material}", self.vertices).unwrap();
            writeln!(self.obj, "usemtl m{}", self.vertices).unwrap();
        }
        corners.iter().for_each(|p| writeln!(self.obj, "v {} {} {}", p.x, p.y, p.z).unwrap());
        let face = (1..=corners.len()).map(|i| (self.vertices + i).to_string()).collect::<Vec<_>>().join(" ");
        writeln!(self.obj, "f {face}").unwrap();
        self.vertices += corners.len();
        self
    }

    /// A square of half width `half` about `centre` that faces `normal`.
    fn square(self, centre: Vec3, normal: Vec3, half: f32, material: &str) -> Self {
        let a = normal.any_orthonormal_vector() * half;
        let b = normal.cross(a);
        self.polygon(&[centre + a + b, centre - a + b, centre - a - b, centre + a - b], material)
    }

    /// The same with emitters that emit on both sides.
    fn two_sided(mut self) -> Self {
        self.tail = self.tail.replace("[[mesh]]", "[[mesh]]\ntwo_sided = true");
        self
    }

    fn scene(self) -> Scene {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("made.obj"), self.obj).unwrap();
        fs::write(folder.path().join("made.mtl"), self.mtl).unwrap();
        Scene::from_toml(&self.tail, folder.path().join("made.toml")).unwrap()
    }
}

fn draw(scene: &Scene, lights: &Lights, strategy: Strategy, spp: u32, seed: u64) -> Rendered {
    let rendered = render(scene, lights, strategy, Settings { spp, seed }, |_| true);
    assert_eq!((rendered.passes, rendered.non_finite), (spp, 0), "{strategy}");
    rendered
}

fn blocks(scene: &Scene, lights: &Lights, strategy: Strategy, spp: u32) -> Blocks {
    // A seed of its own for every strategy: compared estimates have to be independent.
    let seed = strategy.to_string().bytes().fold(0, |hash, byte| hash * 31 + u64::from(byte));
    draw(scene, lights, strategy, spp, seed).film.blocks(16)
}

fn judge(title: &str, a: &Blocks, b: &Blocks, leave_out: impl Fn(usize, usize) -> bool) -> Agreement {
    let agreement = compare(a, b, Rules::default(), leave_out).unwrap();
    println!("{title}: {agreement}");
    agreement
}

/// Renders with each strategy and compares all pairs; `leave_out` says for which blocks (column, row) a pair
/// can't be.
fn agree(
    scene: &Scene,
    lights: &Lights,
    strategies: &[(Strategy, u32)],
    leave_out: impl Fn([Strategy; 2], usize, usize) -> bool,
) {
    let draw = |&(strategy, spp)| (strategy, blocks(scene, lights, strategy, spp));
    let pictures: Vec<_> = strategies.iter().map(draw).collect();
    for (i, (a, first)) in pictures.iter().enumerate() {
        for (b, second) in &pictures[i + 1..] {
            let agreement = judge(&format!("{a} and {b}"), first, second, |x, y| leave_out([*a, *b], x, y));
            assert!(agreement.agrees(LEVEL), "{a} and {b}");
            assert!(agreement.compared >= 48, "{a} and {b}: hardly anything was compared");
        }
    }
}

/// Whether the mean of the picture is `expected`: within 4 standard errors, which are at most `precision` of
/// it.
fn expect(rendered: &Rendered, expected: f64, precision: f64) {
    let all = rendered.film.blocks(rendered.film.width());
    let (mean, error) = (all.means[0][0], all.standard_errors[0][0]);
    let strategy = rendered.strategy;
    println!("{strategy}: {mean:.6} ± {error:.6}, expected {expected:.6}");
    assert!(error <= precision * expected, "{strategy}: {mean} is known to {error} only");
    // Radiance is f32: a strategy without variance still rounds.
    assert!(
        (mean - expected).abs() <= 4.0 * error + 1e-6 * expected,
        "{strategy}: {mean} ± {error} for {expected}"
    );
}

/// The blocks (column, row) of 16 x 16 pixels in which the camera sees a lobe of at least this exponent.
fn sharp_blocks(scene: &Scene, exponent: f32) -> HashSet<(usize, usize)> {
    let (w, h) = (scene.picture.width * 2, scene.picture.height * 2);
    let grid = (0..=h).flat_map(|y| (0..=w).map(move |x| (x, y)));
    let sharp = grid.filter(|&(x, y)| {
        let hit = scene.rays().closest(&scene.camera.ray(x as f32 / 2.0, y as f32 / 2.0));
        hit.is_some_and(|hit| scene.material(hit.triangle).ns >= exponent)
    });
    sharp.map(|(x, y)| ((x / 32) as usize, (y / 32) as usize)).collect()
}

/// A shipped scene at 128 x 128 pixels with parts of its file replaced.
fn smaller(name: &str, changes: &[(&str, &str)]) -> (Scene, Lights) {
    shipped(name, &[&[("= 256", "= 128")], changes].concat())
}

// ---- Agreement ----

/// Mitsuba's picture of the same scene. Its means are written to 1e-8, which is a quarter of the darkest: that
/// rounding is part of their error. Its standard errors are said to be optimistic where the tail is heavy, but
/// ours are several times larger (3000 passes of `mis` still agree), so nothing else is allowed for.
#[test]
#[ignore = "long: many samples"]
fn an_independent_renderer_agrees() {
    let json = fs::read_to_string(data("reference/veach_a3_256x128.json")).unwrap();
    let means = triples(&json, &["block_mean"]);
    let rounding = 1e-8 / 12.0_f64.sqrt();
    let reference = Blocks {
        size: 16,
        columns: 16,
        rows: 8,
        effective: vec![[f64::INFINITY; 3]; means.len()],
        standard_errors: triples(&json, &["block_stderr"])
            .into_iter()
            .map(|e| e.map(|e| e.hypot(rounding)))
            .collect(),
        means,
    };
    let (scene, lights) = shipped("veach_a3", &[]);
    let ours = blocks(&scene, &lights, mis(0.5), 256);
    let agreement = judge("mis:0.5 and the reference", &ours, &reference, |_, _| false);
    assert!(agreement.agrees(LEVEL));
    assert!(agreement.compared > 300 && agreement.would_catch(LEVEL) < 0.01);
}

#[test]
#[ignore = "long: a contact sheet's worth of samples"]
fn strategies_agree_on_plates() {
    let (scene, lights) = shipped("veach_a3", &[]);
    let sharp = sharp_blocks(&scene, 1e4);
    println!("{} of 128 blocks show a plate of N_s 1e4 or 1e6: left out for `light`", sharp.len());
    assert!((20..40).contains(&sharp.len()));
    let strategies = [(BRDF, 256), (LIGHT, 64), (mis(0.25), 64), (mis(0.5), 64), (mis(0.75), 64)];
    // The light strategy seldom finds a sharp lobe, and when it does, the value is enormous.
    agree(&scene, &lights, &strategies, |pair, x, y| pair.contains(&LIGHT) && sharp.contains(&(x, y)));
}

#[test]
#[ignore = "long: many samples"]
fn strategies_agree_in_a_box_and_a_wrong_one_does_not() {
    let (scene, lights) = smaller("cornell", &[]);
    let strategies = [(UNIFORM, 256), (BRDF, 256), (LIGHT, 96), (mis(0.5), 96)];
    agree(&scene, &lights, &strategies, |_, _, _| false);

    let [light, mis] = [LIGHT, mis(0.25)].map(|strategy| blocks(&scene, &lights, strategy, 96));
    assert!(judge("right", &light, &mis, |_, _| false).agrees(LEVEL));
    // Divided by 2 % too much: no block shows it, all together do.
    let mut dark = light.clone();
    dark.means.iter_mut().chain(&mut dark.standard_errors).flatten().for_each(|x| *x /= 1.02);
    let judged = judge("2 % too dark", &dark, &mis, |_, _| false);
    assert!(!judged.agrees(LEVEL) && judged.would_catch(LEVEL) < 0.02);
    // A fifth too much in one block, in one channel: no mean shows it, the block does.
    let mut spot = light.clone();
    spot.means[35][1] *= 1.2;
    let judged = judge("a spot", &spot, &mis, |_, _| false);
    let worst = judged.largest.unwrap();
    assert_eq!((worst.column, worst.row, worst.channel), (3, 4, 1));
    assert!(!judged.agrees(LEVEL));
    assert!(
        compare(&light, &draw(&scene, &lights, LIGHT, 2, 1).film.blocks(8), Rules::default(), |_, _| false)
            .is_err()
    );
}

#[test]
#[ignore = "long: many samples"]
fn strategies_agree_under_the_sky() {
    // A sun of one texel: only strategies that aim at it have a variance worth the name.
    let (scene, lights) = smaller("spot_env", &[]);
    let strategies = [(LIGHT, 64), (mis(0.25), 64), (mis(0.5), 64), (mis(0.75), 64)];
    agree(&scene, &lights, &strategies, |_, _, _| false);
    // Overcast, and shading normals that are not the geometric ones.
    let sky = ("spruit_sunrise_512.hdr\"", "potsdamer_platz_512.hdr\"\nrotate_degrees = 40.0\nscale = 2.5");
    let (scene, lights) = smaller("spot_env", &[sky, ("material =", "normals = \"smooth\"\nmaterial =")]);
    assert!(scene.triangles[0].shading.is_some());
    agree(&scene, &lights, &[(UNIFORM, 64), (BRDF, 64), (LIGHT, 64), (mis(0.5), 64)], |_, _, _| false);
}

/// A lamp, a sky, something in front of both, and a floor that is partly glossy.
#[test]
#[ignore = "long: many samples"]
fn strategies_agree_under_lamp_and_sky() {
    let sky = format!("[environment]\nfile = {:?}\n", data("env/potsdamer_platz_512.hdr"));
    let scene = Made::new("mtl", Vec3::new(0.0, 3.0, 6.0), Vec3::ZERO, 40.0, 64, &sky)
        .square(Vec3::ZERO, Vec3::Y, 4.0, "Kd .5 .4 .3\nKs .3 .3 .3\nNs 40")
        .square(Vec3::new(0.5, 0.5, 0.0), Vec3::Y, 0.6, "Kd .1 .2 .7")
        .square(Vec3::new(-1.5, 2.0, -0.5), Vec3::NEG_Y, 0.5, "Kd .2 .2 .2\nKe 8 6 4")
        .scene();
    let lights = Lights::load(&scene).unwrap();
    assert_eq!(lights.mesh_share(), 0.5);
    let strategies = [(UNIFORM, 256), (BRDF, 256), (LIGHT, 256), (mis(0.25), 256), (mis(0.75), 256)];
    agree(&scene, &lights, &strategies, |_, _, _| false);
}

#[test]
fn the_ends_of_mis_are_its_parts() {
    for name in ["veach_a3", "spot_env"] {
        let (scene, lights) = smaller(name, &[]);
        for (c, part) in [(0.0, LIGHT), (1.0, BRDF)] {
            assert!(draw(&scene, &lights, mis(c), 2, 1).film == draw(&scene, &lights, part, 2, 1).film);
        }
        assert!(draw(&scene, &lights, LIGHT, 2, 1).film != draw(&scene, &lights, BRDF, 2, 1).film);
    }
}

// ---- Closed forms ----

/// The three triangles of nori's tests, over a floor of albedo 1/2, and its radiance.
fn triangle_scenes(size: u32) -> Vec<(Scene, f64)> {
    let json = fs::read_to_string(data("reference/closed_forms.json")).unwrap();
    let lit = json.split("\"tri\"").skip(1).map(|rest| format!("\"tri\"{rest}"));
    let of = |entry: String| {
        let triangle: Vec<Vec3> =
            triples(&entry, &["tri"]).into_iter().map(|p| DVec3::from(p).as_vec3()).collect();
        let number = |key: &str| -> f64 {
            let rest = entry.split_once(&format!("\"{key}\":")).unwrap().1;
            rest.split([',', '}']).next().unwrap().trim().parse().unwrap()
        };
        let expected = number("Lr_albedo05");
        assert!((expected - number("published")).abs() < 1e-5);
        let floor = [Vec3::new(-9.0, 0.0, -9.0), Vec3::new(0.0, 0.0, 12.0), Vec3::new(9.0, 0.0, -9.0)];
        // From where the triangle is not in the way.
        let eyes = [Vec3::new(1.0, 0.2, 0.0), Vec3::new(0.0, 0.2, 1.0), Vec3::new(-1.0, 0.2, 0.0)];
        let mut scenes = eyes.into_iter().map(|eye| {
            Made::new("mtl", eye, Vec3::ZERO, 0.01, size, "")
                .two_sided()
                .polygon(&floor, "Kd .5 .5 .5")
                .polygon(&triangle, "Ke 1 1 1")
                .scene()
        });
        let middle = size as f32 / 2.0;
        let clear = |s: &Scene| s.rays().closest(&s.camera.ray(middle, middle)).unwrap().triangle == 0;
        (scenes.find(clear).unwrap(), expected)
    };
    lit.map(of).collect()
}

#[test]
#[ignore = "long: many samples"]
fn triangles_over_a_floor() {
    triangles(4e-3);
}

#[test]
#[ignore = "long: directions that seldom meet the lamp, to 1e-3"]
fn triangles_over_a_floor_closely() {
    triangles(1e-3);
}

/// `precision`: of the strategies that don't look for the lamp.
fn triangles(precision: f64) {
    for (scene, expected) in &triangle_scenes(512) {
        let lights = Lights::load(scene).unwrap();
        for (strategy, passes) in [(LIGHT, 4), (mis(0.5), 7)] {
            expect(&draw(scene, &lights, strategy, passes, 1), *expected, 1e-3);
        }
        // Few of these directions meet the triangle, so the relative variance of a sample is about 1 over twice
        // the radiance, and twice that.
        for (strategy, variance) in [(UNIFORM, 1.0), (BRDF, 0.55)] {
            let passes = variance / expected / precision.powi(2) / (512.0 * 512.0);
            // An error can be told from two passes on.
            expect(&draw(scene, &lights, strategy, passes.ceil().max(2.0) as u32, 1), *expected, precision);
        }
    }
}

/// A square of half width 1 at height 1: four rectangles of factor F(1, 1). One side of a lamp is dark unless
/// it has two.
#[test]
fn a_lamp_has_the_sides_that_it_has() {
    let json = fs::read_to_string(data("reference/closed_forms.json")).unwrap();
    let factor: f64 =
        json.split_once("\"1,1\":").unwrap().1.split(',').next().unwrap().trim().parse().unwrap();
    let lamp = |normal| {
        Made::new("mtl", Vec3::new(4.0, 0.4, 0.0), Vec3::ZERO, 0.01, 128, "")
            .square(Vec3::new(0.3, 0.0, 0.2), Vec3::Y, 3.0, "Kd .6 .6 .6")
            .square(Vec3::Y, normal, 1.0, "Ke 2 2 2")
    };
    let expected = 0.6 * 2.0 * 4.0 * factor;
    let lit = [lamp(Vec3::NEG_Y), lamp(Vec3::NEG_Y).two_sided(), lamp(Vec3::Y).two_sided()];
    for (scene, strategy) in
        lit.map(Made::scene).iter().flat_map(|s| [UNIFORM, BRDF, LIGHT, mis(0.5)].map(|x| (s, x)))
    {
        expect(&draw(scene, &Lights::load(scene).unwrap(), strategy, 6, 3), expected, 6e-3);
    }
    let scene = lamp(Vec3::Y).scene();
    for strategy in [UNIFORM, BRDF, LIGHT, mis(0.5)] {
        let dark = draw(&scene, &Lights::load(&scene).unwrap(), strategy, 2, 1).film;
        assert!(dark.pixels().iter().all(|p| p.mean() == [0.0; 3]), "{strategy}");
    }
}

/// A diffuse square under a sky of radiance 1 has its albedo.
#[test]
fn white_furnace() {
    furnace(2e-3, &[UNIFORM, BRDF, LIGHT, mis(0.5)]);
}

#[test]
#[ignore = "long: to 1e-3"]
fn white_furnace_closely() {
    furnace(1e-3, &ALL);
}

fn furnace(precision: f64, strategies: &[Strategy]) {
    let scene = sky_scene(Vec3::Y, 64);
    let map = Environment::new(16, 8, vec![[1.0; 3]; 128], RowWarp::UniformCosTheta).unwrap();
    let lights = Lights::new(&scene, Some(map)).unwrap();
    for &strategy in strategies {
        // Whose directions follow the cosine has no variance.
        let precision = if strategy == BRDF { 1e-6 } else { precision };
        known_to(precision, &scene, &lights, strategy, 0.5, 0.0);
    }
}

/// A square of albedo 1/2 that faces `normal`, and whatever sky.
fn sky_scene(normal: Vec3, size: u32) -> Scene {
    let sky = format!("[environment]\nfile = {:?}\n", data("env/spruit_sunrise_512.hdr"));
    let slant = normal + 0.5 * normal.any_orthonormal_vector();
    Made::new("mtl", slant, Vec3::ZERO, 1.0, size, &sky)
        .square(Vec3::ZERO, normal, 3.0, "Kd .5 .5 .5")
        .scene()
}

/// pi / albedo times the radiance of a diffuse square is the irradiance, known for six axes. The reference
/// counts phi clockwise from -x seen from above, we counterclockwise from +x: its x axis is ours turned round.
#[test]
#[ignore = "long: a sun that is seldom met"]
fn irradiance_of_a_sunrise() {
    let json = fs::read_to_string(data("reference/env_irradiance.json")).unwrap();
    for (axis, normal) in AXES {
        let expected = triples(&json, &["spruit_sunrise_512.hdr", "irradiance", axis])[0];
        let scene = sky_scene(normal, 128);
        let lights = Lights::load(&scene).unwrap();
        for strategy in [LIGHT, mis(0.5)] {
            let all = draw(&scene, &lights, strategy, 32, 1).film.blocks(128);
            for (channel, &expected) in expected.iter().enumerate() {
                let [mean, error] =
                    [all.means[0][channel], all.standard_errors[0][channel]].map(|x| x * PI / 0.5);
                let z = (mean - expected) / error;
                println!(
                    "{axis} {strategy} {channel}: {mean:.5} ± {error:.5} for {:.5}, z = {z:.2}",
                    expected
                );
                assert!(z.abs() < 4.0 && error < 0.015 * mean, "{axis} {strategy} {channel}");
            }
        }
    }
}

/// An exponent of 1e21 is a mirror: K_d cos theta of what it reflects.
#[test]
fn an_enormous_exponent_is_a_mirror() {
    mirrors(&["1e21"]);
}

#[test]
#[ignore = "long: many samples"]
fn enormous_exponents_are_mirrors() {
    mirrors(&["1e6", "1e9"]);
}

fn mirrors(exponents: &[&str]) {
    for exponent in exponents {
        let scene = Made::new("kd-phong", Vec3::new(3.0, 3.0, 0.0), Vec3::ZERO, 1.0, 32, "")
            .square(Vec3::ZERO, Vec3::Y, 1.0, &format!("Kd .8 .8 .8\nNs {exponent}"))
            .square(Vec3::new(-3.0, 3.0, 0.0), Vec3::new(0.6, -0.8, 0.0), 1.0, "Ke 2 2 2\nNs 1\nKd 0 0 0")
            .scene();
        let lights = Lights::load(&scene).unwrap();
        for strategy in [BRDF, mis(0.5)] {
            let rendered = draw(&scene, &lights, strategy, 128, 1);
            let mean = rendered.film.blocks(32).means[0][0];
            // A field of view of 1 degree sees a range of angles whose mean cosine is cos 45 degrees to 1e-4.
            assert!((mean / (1.6 * 0.5_f64.sqrt()) - 1.0).abs() < 5e-3, "{exponent} {strategy}: {mean}");
        }
    }
}

/// Whether the mean of the picture is `expected` at a relative standard error of 1e-3, with as many passes as a pilot says that takes. `off`
/// is by how much the scene may differ from what the closed form is of.
fn known(scene: &Scene, lights: &Lights, strategy: Strategy, expected: f64, off: f64) {
    known_to(1e-3, scene, lights, strategy, expected, off);
}

fn known_to(precision: f64, scene: &Scene, lights: &Lights, strategy: Strategy, expected: f64, off: f64) {
    known_in_colour(precision, scene, lights, strategy, [expected; 3], off);
}

fn known_in_colour(
    precision: f64,
    scene: &Scene,
    lights: &Lights,
    strategy: Strategy,
    expected: [f64; 3],
    off: f64,
) {
    let means_of = |r: &Rendered| {
        let all = r.film.blocks(r.film.width());
        [0, 1, 2].map(|c| (all.means[0][c], all.standard_errors[0][c]))
    };
    let pilot = means_of(&draw(scene, lights, strategy, 16, 100));
    let worst = pilot.map(|(mean, error)| error / mean).into_iter().fold(0.0, f64::max);
    let passes = (16.0 * (worst / (0.85 * precision)).powi(2)).ceil().max(16.0);
    assert!(passes < 1e6, "{strategy}: {passes} passes");
    let found = means_of(&draw(scene, lights, strategy, passes as u32, 7));
    for (channel, ((mean, error), expected)) in found.into_iter().zip(expected).enumerate() {
        println!("{strategy} {channel}: {mean:.6} ± {error:.6}, expected {expected:.6}, {passes} passes");
        assert!(error <= precision * expected, "{strategy} {channel}: {mean} is known to {error} only");
        assert!(
            (mean - expected).abs() <= 4.0 * error + (off + 1e-6) * expected,
            "{strategy} {channel}: {mean} ± {error} for {expected}"
        );
    }
}

const ALL: [Strategy; 7] = [UNIFORM, BRDF, LIGHT, mis(0.5), AUTO, TWO, TWO_POWER];

/// Every strategy, and every way to draw from the emitters by the strategies that do.
fn known_by_all(scene: &Scene, expected: f64, off: f64) {
    known_by(&ALL, scene, expected, off);
}

fn known_by(strategies: &[Strategy], scene: &Scene, expected: f64, off: f64) {
    let lights = Lights::load(scene).unwrap();
    strategies.iter().for_each(|&strategy| known(scene, &lights, strategy, expected, off));
    if scene.emitters.is_empty() {
        return;
    }
    // The first way is the one above.
    for sampling in LightSampling::all().skip(1) {
        let lights = Lights::load_with(scene, sampling).unwrap();
        println!("{sampling}");
        [LIGHT, TWO].iter().for_each(|&strategy| known(scene, &lights, strategy, expected, off));
    }
}

/// Strategies that aim, with the default way to draw from the emitters.
fn known_by_some(scene: &Scene, expected: f64) {
    let lights = Lights::load(scene).unwrap();
    [LIGHT, mis(0.5), TWO_POWER]
        .iter()
        .for_each(|&strategy| known_to(3e-3, scene, &lights, strategy, expected, 0.0));
}

/// A polygon of five corners, tilted: Lambert's E = L / 2 times the sum over edges of the angle they are seen under times the cosine of
/// the plane through them and the point.
#[test]
fn a_polygon_over_a_floor() {
    let (scene, expected) = polygon();
    known_by_some(&scene, expected);
}

#[test]
#[ignore = "long: all strategies and ways to draw"]
fn a_polygon_over_a_floor_by_all() {
    let (scene, expected) = polygon();
    known_by_all(&scene, expected, 0.0);
}

fn polygon() -> (Scene, f64) {
    let corners: Vec<_> = (0..5)
        .map(|i| f64::from(i) * 2.0 * PI / 5.0)
        .map(|a| DVec3::new(0.4 + a.cos(), 1.1 + 0.3 * a.cos(), a.sin()))
        .collect();
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let sum = edges.map(|(a, b)| a.angle_between(*b) * a.cross(*b).normalize().y).sum::<f64>();
    let expected = 0.5 / PI * 3.0 * 0.5 * sum.abs();
    let mut lamp: Vec<Vec3> = corners.iter().map(|c| c.as_vec3()).collect();
    if (lamp[1] - lamp[0]).cross(lamp[2] - lamp[0]).y > 0.0 {
        lamp.reverse();
    }
    let scene = Made::new("mtl", Vec3::new(-4.0, 0.4, 0.0), Vec3::ZERO, 0.01, 128, "")
        .square(Vec3::ZERO, Vec3::Y, 3.0, "Kd .5 .5 .5")
        .polygon(&lamp, "Ke 3 3 3")
        .scene();
    (scene, expected)
}

/// Of a cosine lobe, what an emitter holds that only strategies which aim at it are asked for.
const SELDOM: f64 = 0.1;
const AIMING: [Strategy; 5] = [LIGHT, mis(0.5), AUTO, TWO, TWO_POWER];

/// A rectangle above a point, parallel to its plane, and one that stands on it, by their configuration factors at unit distance (two
/// mirrored halves, so that its width is from -A to A).
fn rectangles(cases: &[(&str, [f32; 2])]) {
    let json = fs::read_to_string(data("reference/closed_forms.json")).unwrap();
    for &(kind, [a, b]) in cases {
        let table = json.split_once(&format!("\"{kind}\":")).unwrap().1;
        let factor = table.split_once(&format!("\"{a},{b}\":")).unwrap().1.split([',', '}']).next().unwrap();
        let expected = 0.6 * 2.0 * 2.0 * factor.trim().parse::<f64>().unwrap();
        let lamp = match kind {
            "Fpar" => {
                [Vec3::new(b, 1.0, -a), Vec3::new(b, 1.0, a), Vec3::new(0.0, 1.0, a), Vec3::new(0.0, 1.0, -a)]
            }
            _ => {
                [Vec3::new(1.0, 0.0, -a), Vec3::new(1.0, 0.0, a), Vec3::new(1.0, b, a), Vec3::new(1.0, b, -a)]
            }
        };
        let scene = Made::new("mtl", Vec3::new(-4.0, 0.4, 0.1), Vec3::ZERO, 0.001, 128, "")
            .two_sided()
            .square(Vec3::ZERO, Vec3::Y, 3.0, "Kd .6 .6 .6")
            .polygon(&lamp, "Ke 2 2 2\nKd 0 0 0")
            .scene();
        println!("{kind} {a},{b}");
        // A thousandth of what is hardly ever met takes hours.
        known_by(if expected < 0.6 * 2.0 * SELDOM { &AIMING } else { &ALL }, &scene, expected, 0.0);
    }
}

#[test]
#[ignore = "long: many samples"]
fn rectangles_over_a_floor() {
    rectangles(&[("Fpar", [2.0, 0.5]), ("Fper", [2.0, 2.0])]);
}

/// `cargo test --release --test it -- --ignored all_rectangles`: long.
#[test]
#[ignore = "long: many samples"]
fn all_rectangles_over_a_floor() {
    let sides = [0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0];
    let pairs = sides.iter().flat_map(|&a| sides.map(|b| [a, b]));
    let cases: Vec<_> = pairs.flat_map(|p| [("Fpar", p), ("Fper", p)]).collect();
    rectangles(&cases);
}

/// A sphere of sin(angular radius) `sine`, its centre `angle` degrees from the normal, where its lower part is under the horizon.
fn spheres(cases: &[(f64, f64)], strategies: &[Strategy]) {
    let json = fs::read_to_string(data("reference/closed_forms.json")).unwrap();
    let table = triples(&json, &["sphere"]);
    for &(sine, angle) in cases {
        let [.., irradiance] = *table.iter().find(|row| row[..2] == [sine, angle]).unwrap();
        // Latitudes and longitudes: the outline is a polygon of 192 corners, 2e-4 smaller than its circle.
        const N: usize = 192;
        let (s, c) = angle.to_radians().sin_cos();
        let centre = DVec3::new(s, c, 0.0);
        let at = |i: usize, j: usize| {
            let (theta, phi) = (PI * i as f64 / (N / 2) as f64, 2.0 * PI * (j % N) as f64 / N as f64);
            (centre + sine * DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()))
                .as_vec3()
        };
        // Seen from below the plane's edge the sphere would be in the way: the camera looks from the other side.
        let eye = Vec3::new(-4.0, 0.6, 0.0);
        let mut made =
            Made::new("mtl", eye, Vec3::ZERO, 0.001, 64, "").square(Vec3::ZERO, Vec3::Y, 0.05, "Kd .5 .5 .5");
        for (i, j) in (0..N / 2).flat_map(|i| (0..N).map(move |j| (i, j))) {
            let quad = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            let corners: Vec<_> = match i {
                0 => vec![quad[0], quad[2], quad[3]],
                _ if i == N / 2 - 1 => vec![quad[0], quad[1], quad[2]],
                _ => quad.to_vec(),
            };
            made = made.face(&corners, (i + j == 0).then_some("Ke 1 1 1\nKd 0 0 0"));
        }
        let scene = made.scene();
        assert!(scene.emitters[0].normal.dot(scene.emitters[0].vertices[0] - centre.as_vec3()) > 0.0);
        let lights = Lights::load(&scene).unwrap();
        println!("sphere {sine} {angle}");
        for &strategy in strategies {
            if irradiance == 0.0 {
                let dark = draw(&scene, &lights, strategy, 64, 7);
                assert!(dark.film.pixels().iter().all(|p| p.mean() == [0.0; 3]), "{strategy}");
                continue;
            }
            // What is left of it above the horizon shrinks faster than the sphere: like the 5/2th power of the angle.
            let left = 90.0 + sine.asin().to_degrees() - angle;
            let off = if angle < 90.0 { 3e-4 } else { 3e-4_f64.max(2.5 * 1.4e-4 * sine.to_degrees() / left) };
            if irradiance >= PI * SELDOM || AIMING.contains(&strategy) {
                known(&scene, &lights, strategy, 0.5 / PI * irradiance, off);
            }
        }
    }
}

#[test]
#[ignore = "long: many samples"]
fn a_sphere_partly_under_the_horizon() {
    spheres(&[(0.9, 60.0)], &[UNIFORM, BRDF]);
}

/// `cargo test --release --test it -- --ignored all_spheres`: long. All 24 that are tabled.
#[test]
#[ignore = "long: many samples"]
fn all_spheres_partly_under_the_horizon() {
    for sine in [0.1, 0.5, 0.9] {
        let angles = [0.0, 30.0, 60.0, 75.0, 90.0, 100.0, 110.0, 120.0];
        spheres(&angles.map(|angle| (sine, angle)), &ALL);
    }
}

/// A Phong lobe under a sky of radiance 1 has its albedo: less than 1 where a part of the lobe is under the surface.
fn phong_furnaces(exponents: &[&str], strategies: &[Strategy]) {
    let json = fs::read_to_string(data("reference/closed_forms.json")).unwrap();
    for exponent in exponents {
        let albedos = numbers(&json, &["phong_albedo", exponent]);
        for (angle, albedo) in [0.0_f32, 30.0, 60.0, 80.0].into_iter().zip(albedos) {
            let (s, c) = angle.to_radians().sin_cos();
            let sky = format!("[environment]\nfile = {:?}\n", data("env/potsdamer_platz_512.hdr"));
            let scene = Made::new("kd-phong", 10.0 * Vec3::new(s, c, 0.0), Vec3::ZERO, 0.001, 64, &sky)
                .square(Vec3::ZERO, Vec3::Y, 1.0, &format!("Kd 1 1 1\nNs {exponent}"))
                .scene();
            let map = Environment::new(16, 8, vec![[1.0; 3]; 128], RowWarp::UniformCosTheta).unwrap();
            let lights = Lights::new(&scene, Some(map)).unwrap();
            println!("exponent {exponent}, {angle} degrees");
            strategies.iter().for_each(|&strategy| known(&scene, &lights, strategy, albedo, 0.0));
        }
    }
}

#[test]
#[ignore = "long: many samples"]
fn a_phong_lobe_has_its_albedo() {
    phong_furnaces(&["10", "50", "1000", "10000"], &[BRDF, mis(0.5), AUTO, TWO, TWO_POWER]);
}

/// `cargo test --release --test it -- --ignored phong_lobes`: some minutes.
#[test]
#[ignore = "long: a lobe is seldom met by directions that don't know it"]
fn phong_lobes_by_strategies_that_miss_them() {
    phong_furnaces(&["10", "50", "1000", "10000"], &[UNIFORM, LIGHT]);
}

/// The albedo of the GGX lobe of roughness alpha, seen from 0, 30, 60 and 80 degrees off the normal: the integral of D G2 / (4 cos theta_o) over the hemisphere,
/// by SciPy's adaptive quadrature over half vectors and, in another form, a midpoint rule over directions; 1 - ln 2 for alpha 1 from above.
const GGX_ALBEDOS: [(f64, [f64; 4]); 4] = [
    (0.1, [0.98830406, 0.98608694, 0.96920498, 0.89551875]),
    (0.3, [0.87735842, 0.86387290, 0.82171100, 0.84823238]),
    (0.6, [0.59152278, 0.59631552, 0.64266598, 0.77871214]),
    (1.0, [0.30685282, 0.33519408, 0.45069386, 0.66818594]),
];

/// A GGX lobe under a sky of radiance 1 has its albedo: less than 1, since light that would be scattered twice is lost.
fn ggx_furnaces(precision: f64, albedos: &[(f64, [f64; 4])], strategies: &[Strategy]) {
    for (alpha, albedos) in albedos {
        for (angle, &albedo) in [0.0_f32, 30.0, 60.0, 80.0].into_iter().zip(albedos) {
            let (s, c) = angle.to_radians().sin_cos();
            let sky = format!("[environment]\nfile = {:?}\n", data("env/potsdamer_platz_512.hdr"));
            let mut made = Made::new("kd-phong", 10.0 * Vec3::new(s, c, 0.0), Vec3::ZERO, 0.001, 32, &sky);
            let material = format!("[[mesh]]\nmaterial = {{ kd = [1, 1, 1], roughness = {alpha:?} }}");
            made.tail = made.tail.replace("[[mesh]]", &material);
            let scene = made.square(Vec3::ZERO, Vec3::Y, 1.0, "Kd 1 1 1").scene();
            let map = Environment::new(16, 8, vec![[1.0; 3]; 128], RowWarp::UniformCosTheta).unwrap();
            let lights = Lights::new(&scene, Some(map)).unwrap();
            println!("roughness {alpha}, {angle} degrees");
            strategies
                .iter()
                .for_each(|&strategy| known_to(precision, &scene, &lights, strategy, albedo, 0.0));
        }
    }
}

#[test]
fn a_ggx_lobe_has_its_albedo() {
    ggx_furnaces(3e-3, &GGX_ALBEDOS[2..3], &[BRDF, mis(0.5), TWO]);
}

#[test]
#[ignore = "long: many samples"]
fn ggx_lobes_have_their_albedo_by_all() {
    ggx_furnaces(1e-3, &GGX_ALBEDOS, &[BRDF, mis(0.5), AUTO, TWO, TWO_POWER]);
    // Directions that don't know the narrowest hardly meet it.
    ggx_furnaces(3e-3, &GGX_ALBEDOS[1..], &[UNIFORM, LIGHT]);
}

/// See [`irradiance_of_a_sunrise`].
fn irradiances(precision: f64, map: &str, axes: &[(&str, Vec3)], strategies: &[Strategy]) {
    let json = fs::read_to_string(data("reference/env_irradiance.json")).unwrap();
    let published = |axis: &str, _| triples(&json, &[map, "irradiance", axis])[0];
    irradiances_of(precision, map, axes, strategies, published);
}

/// The sum over texels of radiance times solid angle times the cosine at the centre, which is off by 1e-5 where the sun is high, and 1e-3 where it sets.
fn irradiance_by_sum(map: &warpcheck::picture::Picture, normal: Vec3) -> [f64; 3] {
    let (width, height) = (map.width(), map.height());
    let theta = |row: f64| PI * row / height as f64;
    let mut sum = DVec3::ZERO;
    for (i, texel) in map.pixels().iter().enumerate() {
        let (x, y) = ((i % width) as f64, (i / width) as f64);
        let (phi, solid_angle) = (
            2.0 * PI * (x + 0.5) / width as f64,
            2.0 * PI / width as f64 * (theta(y).cos() - theta(y + 1.0).cos()),
        );
        // Counterclockwise from +x, seen from above.
        let (sin, cos) = theta(y + 0.5).sin_cos();
        let w = DVec3::new(sin * phi.cos(), cos, -sin * phi.sin());
        sum += DVec3::from(texel.map(f64::from)) * solid_angle * w.dot(normal.as_dvec3()).max(0.0);
    }
    sum.to_array()
}

fn irradiances_of(
    precision: f64,
    map: &str,
    axes: &[(&str, Vec3)],
    strategies: &[Strategy],
    of: impl Fn(&str, Vec3) -> [f64; 3],
) {
    for &(axis, normal) in axes {
        let expected = of(axis, normal).map(|e| e * 0.5 / PI);
        let sky = format!("[environment]\nfile = {:?}\n", data(&format!("env/{map}")));
        let slant = normal + 0.5 * normal.any_orthonormal_vector();
        let scene = Made::new("mtl", slant, Vec3::ZERO, 1.0, 128, &sky)
            .square(Vec3::ZERO, normal, 3.0, "Kd .5 .5 .5")
            .scene();
        let lights = Lights::load(&scene).unwrap();
        println!("{map} {axis}");
        strategies
            .iter()
            .for_each(|&strategy| known_in_colour(precision, &scene, &lights, strategy, expected, 0.0));
    }
}

const AXES: [(&str, Vec3); 6] = [
    ("+y", Vec3::Y),
    ("-y", Vec3::NEG_Y),
    ("+x", Vec3::NEG_X),
    ("-x", Vec3::X),
    ("+z", Vec3::Z),
    ("-z", Vec3::NEG_Z),
];

#[test]
fn irradiance_of_an_overcast_sky() {
    irradiances(3e-3, "potsdamer_platz_512.hdr", &AXES[..1], &[BRDF, TWO]);
}

#[test]
#[ignore = "long: many samples"]
fn irradiance_of_an_overcast_sky_more_finely() {
    irradiances(1e-3, "potsdamer_platz_512.hdr", &AXES[..1], &[UNIFORM, BRDF, LIGHT, TWO]);
    irradiances(1e-3, "potsdamer_platz_512.hdr", &AXES[1..2], &[BRDF]);
}

/// `cargo test --release --test it -- --ignored irradiance_along`: half an hour, most of it the last line.
#[test]
#[ignore = "long: most samples go to a sun that is behind the surface"]
fn irradiance_along_all_axes() {
    irradiances(1e-3, "potsdamer_platz_512.hdr", &AXES, &ALL);
    irradiances(1e-3, "spruit_sunrise_512.hdr", &AXES, &AIMING);
    // A sun of one texel in 131,072: to a thousandth these would take 1e10 samples.
    irradiances(1e-2, "spruit_sunrise_512.hdr", &AXES, &[UNIFORM, BRDF]);
}

/// The sum is the published one where there is one; of the other maps it is all there is.
#[test]
fn irradiance_is_a_sum_over_texels() {
    let map = "potsdamer_platz_512.hdr";
    let json = fs::read_to_string(data("reference/env_irradiance.json")).unwrap();
    let picture = warpcheck::picture::read(data(&format!("env/{map}"))).unwrap();
    for (axis, normal) in AXES {
        let (sum, published) =
            (irradiance_by_sum(&picture, normal), triples(&json, &[map, "irradiance", axis])[0]);
        for (sum, published) in sum.into_iter().zip(published) {
            assert!((sum / published - 1.0).abs() < 1e-4, "{axis}: {sum} {published}");
        }
    }
    known_by_sum(3e-3, "blender_interior_512.hdr", &AXES[..1], &[LIGHT]);
}

fn known_by_sum(precision: f64, map: &str, axes: &[(&str, Vec3)], strategies: &[Strategy]) {
    let picture = warpcheck::picture::read(data(&format!("env/{map}"))).unwrap();
    irradiances_of(precision, map, axes, strategies, |_, normal| irradiance_by_sum(&picture, normal));
}

/// `cargo test --release --test it -- --ignored irradiance_of_all_maps`: some minutes.
#[test]
#[ignore = "long: most samples go to a sun that is behind the surface"]
fn irradiance_of_all_maps_along_their_axes() {
    for map in ["noon_grass_512.hdr", "blender_interior_512.hdr"] {
        known_by_sum(1e-3, map, &AXES, &AIMING);
    }
    irradiances(1e-3, "spruit_sunrise_1k.hdr", &AXES, &AIMING);
}

/// `cargo test --release --test it -- --ignored triangles_to`: a minute. [`triangles_over_a_floor`] at the precision of the others.
#[test]
#[ignore = "long: small triangles are seldom met"]
fn triangles_to_a_thousandth() {
    for (scene, expected) in triangle_scenes(128) {
        known_by_all(&scene, expected, 0.0);
    }
}

// ---- Bits ----

#[test]
fn threads_and_pauses_change_no_bit() {
    let (scene, lights) = shipped("veach_a3", &[]);
    for strategy in [UNIFORM, mis(0.5)] {
        let once = draw(&scene, &lights, strategy, 4, 9);
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert!(
                pool.install(|| draw(&scene, &lights, strategy, 4, 9)).film == once.film,
                "{threads} threads"
            );
        }
        let mut seen = Vec::new();
        let mut paused = render(&scene, &lights, strategy, Settings { spp: 4, seed: 9 }, |p| {
            seen.push((p.passes, p.total, p.film.pixel(7, 7).count()));
            p.passes < 3
        });
        assert_eq!(seen, [(1, 4, 1), (2, 4, 2), (3, 4, 3)]);
        assert!(paused.passes == 3 && paused.film != once.film);
        paused.resume(&scene, &lights, 4, |_| true);
        assert!(paused.film == once.film);
        assert!(draw(&scene, &lights, strategy, 4, 10).film != once.film);
    }
}

/// Radiance close to the end of f32 overflows when it is divided by a density under 1: counted, and kept out of
/// the film.
#[test]
fn what_is_not_finite_is_counted() {
    let scene = sky_scene(Vec3::Y, 32);
    let map = Environment::new(4, 2, vec![[3e38; 3]; 8], RowWarp::UniformCosTheta).unwrap();
    let lights = Lights::new(&scene, Some(map)).unwrap();
    let rendered = render(&scene, &lights, LIGHT, Settings { spp: 4, seed: 1 }, |_| true);
    assert!(rendered.non_finite > 100, "{}", rendered.non_finite);
    assert!(rendered.film.pixels().iter().all(|p| p.count() == 4 && p.mean().iter().all(|x| x.is_finite())));
}

#[test]
fn missing_lights_are_named() {
    let scene = Made::new("mtl", Vec3::Y, Vec3::ZERO, 1.0, 8, "[environment]\nfile = \"no such sky.hdr\"")
        .square(Vec3::ZERO, Vec3::Y, 1.0, "Kd .5 .5 .5")
        .scene();
    let error = Lights::load(&scene).unwrap_err().to_string();
    assert!(error.contains("no such sky.hdr"), "{error}");
    let error = Lights::new(&scene, None).unwrap_err().to_string();
    assert!(error.contains("made.toml") && error.contains("no light"), "{error}");
}

/// The questions that anybody's film is asked.
#[test]
fn the_film_is_verified() {
    let mean = |streams: Vec<warpcheck::verify::Values>| {
        let film = std::sync::Mutex::new(Film::new(1, 1));
        std::thread::scope(|scope| {
            for stream in streams {
                let film = &film;
                scope.spawn(move || {
                    let mut mine = Film::new(1, 1);
                    stream.for_each(|x| mine.add(0, 0, DVec3::splat(x.unwrap_or(0.0))));
                    film.lock().unwrap().merge(&mine);
                });
            }
        });
        film.into_inner().unwrap().pixel(0, 0).mean()[1]
    };
    warpcheck::verify::film(mean).name("our film").run().assert();
}
