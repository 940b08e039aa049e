//! Histograms and estimators beside what they can't be faster than.
//!
//! ```text
//! cargo bench --bench rendering                    some minutes; ends with a table
//! cargo bench --bench rendering -- histogram       a group
//! ```
//!
//! - `histogram`: 2^24 samples of a map of 2048 x 1024 texels into as many pixels, on all threads: one sample at a time with angles by `atan2`, as
//!   everybody writes it first, and [`Histogram::draw`].
//! - `rays`: camera rays and the diffuse bounces behind them, one thread: the ray library alone (`obvhs`, its eight-wide tree, its own triangle test), our
//!   tree with the watertight test, and a pass of the strategy `brdf`, which shoots such rays and does all the rest.

use criterion::Criterion;
use glam::{DVec3, Vec2, Vec3};
use obvhs::ray::RayHit;
use obvhs::{BvhBuildParams, cwbvh::builder::build_cwbvh_from_tris, triangle::Triangle};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};
use warpcheck::estimator::{Integrator, LightSampling, Plan, Strategy, VARIATES};
use warpcheck::histogram::Histogram;
use warpcheck::random::{fill_unit, stream, unit_f64};
use warpcheck::sampler::*;
use warpcheck::scene::{Ray, RayQueries, Scene, offset_origin, offset_unit};
use warpcheck::verify::Settings;

const SAMPLES: u64 = 1 << 24;

/// Seconds, the least of some: what others do on the machine only adds.
fn least<T>(times: usize, mut work: impl FnMut() -> T) -> f64 {
    let mut time = || {
        let start = Instant::now();
        black_box(work());
        start.elapsed().as_secs_f64()
    };
    (0..times).map(|_| time()).fold(f64::INFINITY, f64::min)
}

/// A sky, a dark ground, a sun; no map of this size ships.
fn sky(width: usize, height: usize) -> RadianceMap {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let texels = (0..width * height)
        .map(|i| {
            let (column, row) = (i % width, i / width);
            let base = if 2 * row < height { 1.0 } else { 0.05 };
            let grain = (rng.next_u32() >> 8) as f32 / 16_777_216.0;
            let sun = column.abs_diff(width / 3).max(row.abs_diff(height / 4)) * 400 < width;
            [base * (0.5 + grain) + if sun { 2000.0 } else { 0.0 }; 3]
        })
        .collect();
    RadianceMap::new(width, height, texels).expect("a map")
}

/// One sample after the other, with angles.
fn plain(map: &Environment, width: usize, height: usize) -> Vec<u64> {
    let threads = rayon::current_num_threads() as u64;
    let count = |thread: u64| {
        let mut rng = stream(1, "plain", thread);
        let mut counts = vec![0_u64; width * height];
        for _ in 0..SAMPLES / threads {
            let mut xi = [0.0; 2];
            fill_unit(&mut rng, &mut xi);
            let w: DVec3 = map.sample(xi).direction.as_dvec3();
            let (theta, phi) = (w.z.clamp(-1.0, 1.0).acos(), w.y.atan2(w.x).rem_euclid(TAU));
            let column = ((phi / TAU * width as f64) as usize).min(width - 1);
            let row = ((theta / PI * height as f64) as usize).min(height - 1);
            counts[row * width + column] += 1;
        }
        counts
    };
    let add = |mut a: Vec<u64>, b: Vec<u64>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    (0..threads).into_par_iter().map(count).reduce_with(add).unwrap_or_default()
}

fn histogram(c: &mut Criterion, table: &mut Vec<String>) {
    let (width, height) = (2048, 1024);
    let map = sky(width, height);
    let guide = PackedEnvironment::new(map.clone(), RowWarp::UniformV, Form::Ordered).expect("tables");
    let alias = PackedEnvironment::new(map.clone(), RowWarp::UniformV, Form::Unordered).expect("tables");
    let baseline = Environment::from_map(map, RowWarp::UniformV).expect("tables");
    let settings = Settings { samples: SAMPLES, ..Settings::default() };
    let ours = |map: &PackedEnvironment| Histogram::draw(map, width, height, &settings).counts[0];
    let mut group = c.benchmark_group("histogram");
    group.warm_up_time(Duration::from_millis(1)).sample_size(10).measurement_time(Duration::from_secs(3));
    group.bench_function("one at a time, angles", |b| b.iter(|| plain(&baseline, width, height)[0]));
    group.bench_function("guide", |b| b.iter(|| ours(&guide)));
    group.bench_function("alias", |b| b.iter(|| ours(&alias)));
    group.finish();
    let per_sample = 1e9 / SAMPLES as f64;
    let theirs = per_sample * least(3, || plain(&baseline, width, height));
    for (name, map) in [("guide", &guide), ("alias", &alias)] {
        let time = per_sample * least(5, || ours(map));
        table.push(format!(
            "histogram, {name}: {time:.1} ns a sample on {} threads, {theirs:.1} one at a time: {:.1} times faster",
            rayon::current_num_threads(),
            theirs / time
        ));
    }
}

/// Camera rays, and a diffuse bounce from where they hit.
fn shot(scene: &Scene, passes: usize) -> Vec<Ray> {
    let mut rng = stream(1, "bench rays", 0);
    let (width, height) = (scene.picture.width, scene.picture.height);
    let extent =
        scene.triangles.iter().flat_map(|t| t.vertices).map(|v| v.abs().max_element()).fold(0.0, f32::max);
    let unit = offset_unit(extent);
    let mut rays = Vec::new();
    for (y, x) in (0..height * passes as u32).flat_map(|y| (0..width).map(move |x| (y % height, x))) {
        let [dx, dy, a, b] = [(); 4].map(|()| unit_f64(&mut rng) as f32);
        let ray = scene.camera.ray(x as f32 + dx, y as f32 + dy);
        rays.push(ray);
        let Some(hit) = scene.rays().closest(&ray) else { continue };
        let [p, q, r] = scene.triangles[hit.triangle as usize].vertices;
        let normal = (q - p).cross(r - p).normalize();
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let frame = Frame::new(normal);
        let direction =
            frame.to_world(CosineHemisphere.sample(Vec2::new(a.min(0.999_999), b.min(0.999_999))));
        let origin = offset_origin(ray.at(hit.t), normal, unit);
        rays.push(Ray { from: Some(hit.triangle), ..Ray::new(origin, direction) });
    }
    rays
}

fn rays(c: &mut Criterion, table: &mut Vec<String>) {
    for name in ["cornell", "veach_a3", "spot_env"] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("data/scene/{name}.toml"));
        let scene = Scene::load(file).expect("a scene that ships");
        let rays = shot(&scene, 1);
        let vertices = |t: &warpcheck::scene::Triangle| {
            let [v0, v1, v2] = t.vertices.map(Into::into);
            Triangle { v0, v1, v2 }
        };
        let triangles: Vec<Triangle> = scene.triangles.iter().map(vertices).collect();
        let tree =
            build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        let theirs: Vec<_> = rays
            .iter()
            .map(|r| obvhs::ray::Ray::new(r.origin.into(), r.direction.into(), 0.0, f32::INFINITY))
            .collect();
        let alone = || {
            theirs
                .iter()
                .filter(|ray| {
                    let mut hit = RayHit::none();
                    tree.ray_traverse(**ray, &mut hit, |ray, id| {
                        triangles[tree.primitive_indices[id] as usize].intersect(ray)
                    })
                })
                .count()
        };
        let ours = || rays.iter().filter(|ray| scene.rays().closest(ray).is_some()).count();
        let plan = Plan::of(&scene, &[Strategy::Brdf], LightSampling::default()).expect("lights");
        let integrator = Integrator::new(&scene, plan.lights(), Strategy::Brdf);
        let (width, height) = (scene.picture.width, scene.picture.height);
        let pass = || {
            let mut rng = stream(2, "bench pass", 0);
            let mut sum = Vec3::ZERO;
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x as f32, y as f32))) {
                let [dx, dy] = [(); 2].map(|()| unit_f64(&mut rng) as f32);
                let mut xi = [0.0; VARIATES];
                fill_unit(&mut rng, &mut xi[..4]);
                sum += integrator.radiance(x + dx, y + dy, xi);
            }
            sum
        };
        let mut group = c.benchmark_group(format!("rays/{name}"));
        group
            .warm_up_time(Duration::from_millis(200))
            .sample_size(10)
            .measurement_time(Duration::from_secs(2));
        group.bench_function("obvhs alone", |b| b.iter(alone));
        group.bench_function("tree, watertight test", |b| b.iter(ours));
        group.bench_function("a pass by brdf", |b| b.iter(pass));
        group.finish();
        let count = rays.len() as f64 * 1e-6;
        let [alone, ours, pass] = [count / least(9, alone), count / least(9, ours), count / least(9, pass)];
        let pixels = f64::from(width * height) * 1e-6;
        table.push(format!(
            "rays, {name}: obvhs alone {alone:.2} M/s, ours {ours:.2} ({:.0}%), in a pass {pass:.2} ({:.0}% of alone; {:.2} M camera samples a second, one thread)",
            100.0 * ours / alone,
            100.0 * pass / alone,
            pass * pixels / count,
        ));
    }
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let named: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted = |group: &str| named.is_empty() || named.iter().any(|name| group.starts_with(name.as_str()));
    let mut table = Vec::new();
    if wanted("histogram") {
        histogram(&mut criterion, &mut table);
    }
    if wanted("rays") {
        rays(&mut criterion, &mut table);
    }
    criterion.final_summary();
    println!();
    table.iter().for_each(|line| println!("{line}"));
}
