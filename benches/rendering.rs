//! Estimators beside what they can't be faster than.
//!
//! ```text
//! cargo bench --bench rendering                    some minutes; ends with a table
//! cargo bench --bench rendering -- rays            a group
//! ```
//!
//! - `rays`: camera rays and the diffuse bounces behind them, one thread: the ray library alone (`obvhs`, its eight-wide tree, its own triangle test), our
//!   tree with the watertight test, and a pass of the strategy `brdf`, which shoots such rays and does all the rest.

use criterion::Criterion;
use glam::{Vec2, Vec3};
use obvhs::ray::RayHit;
use obvhs::{BvhBuildParams, cwbvh::builder::build_cwbvh_from_tris, triangle::Triangle};
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};
use warpcheck::estimator::{Integrator, LightSampling, Plan, Strategy, VARIATES};
use warpcheck::random::{fill_unit, stream, unit_f64};
use warpcheck::sampler::*;
use warpcheck::scene::{Ray, RayQueries, Scene, offset_origin, offset_unit};

/// Seconds, the least of some: what others do on the machine only adds.
fn least<T>(times: usize, mut work: impl FnMut() -> T) -> f64 {
    let mut time = || {
        let start = Instant::now();
        black_box(work());
        start.elapsed().as_secs_f64()
    };
    (0..times).map(|_| time()).fold(f64::INFINITY, f64::min)
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
    if wanted("rays") {
        rays(&mut criterion, &mut table);
    }
    criterion.final_summary();
    println!();
    table.iter().for_each(|line| println!("{line}"));
}
