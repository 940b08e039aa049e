//! What leaving out gains.
//!
//! - `rays`: closest hits by a list and by a tree of n triangles: where they break even ([`RayStructure::LONGEST_LIST`]).
//! - `set-up`: lights as the strategy needs them, and everything.
//! - `pass`: one pass over a picture with what was planned, and with everything built (tree, all tables, all lobes).
//!
//! After the last, the ratios everything / planned of a pass are printed, and what set-up takes, one line a scene.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::Vec3;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};
use warpcheck::estimator::{Integrator, LightSampling, Lights, Plan, Settings, Strategy, render};
use warpcheck::random::{stream, unit_f64};
use warpcheck::scene::{Ray, RayQueries, RayStructure, Rays, Scene};

const SCENES: [(&str, Strategy); 6] = [
    ("veach_a3", Strategy::Mis { brdf_weight: 0.5 }),
    ("cornell", Strategy::Light),
    ("furnace", Strategy::Light),
    ("spot_env", Strategy::Brdf),
    ("lamps_and_sky", Strategy::Brdf),
    ("three_spheres", Strategy::Mis { brdf_weight: 0.5 }),
];

fn load(name: &str) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("data/scene/{name}.toml"));
    Scene::load(file).expect("a scene that ships")
}

/// Random triangles, and rays from a larger box about them.
fn rays(c: &mut Criterion) {
    let mut rng = stream(1, "bench rays", 0);
    let mut point =
        |scale: f64| Vec3::from_array([(); 3].map(|()| (scale * (unit_f64(&mut rng) - 0.5)) as f32));
    let rays: Vec<_> = (0..1024).map(|_| Ray::new(point(4.0), point(2.0))).collect();
    let mut group = c.benchmark_group("rays");
    group
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(600))
        .sample_size(10);
    for count in [2, 4, 6, 8, 12, 16, 24, 36] {
        let triangles: Vec<_> = (0..count)
            .map(|_| {
                let p = point(2.0);
                [p, p + point(1.5), p + point(1.5)]
            })
            .collect();
        for structure in [RayStructure::List, RayStructure::Tree] {
            let built = Rays::new(&triangles, structure);
            group.bench_function(BenchmarkId::new(format!("{structure:?}"), count), |b| {
                b.iter(|| rays.iter().filter(|ray| black_box(built.closest(ray)).is_some()).count());
            });
        }
    }
    group.finish();
}

fn set_up(c: &mut Criterion) {
    let mut group = c.benchmark_group("set-up");
    group.warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1)).sample_size(10);
    for (name, strategy) in SCENES {
        let scene = load(name);
        let sampling = LightSampling::default();
        group.bench_function(BenchmarkId::new("planned", name), |b| {
            b.iter(|| Plan::of(&scene, &[strategy], sampling).expect("lights"));
        });
        group.bench_function(BenchmarkId::new("everything", name), |b| {
            b.iter(|| Lights::load(&scene).expect("lights"));
        });
    }
    group.finish();
}

/// Milliseconds, the least of some: what others do on the machine only adds.
fn milliseconds<T>(mut work: impl FnMut() -> T) -> f64 {
    let once = |_| {
        let start = Instant::now();
        black_box(work());
        1e3 * start.elapsed().as_secs_f64()
    };
    (0..12).map(once).fold(f64::INFINITY, f64::min)
}

/// Of a pass.
fn of_pass(integrator: &Integrator, scene: &Scene, lights: &Lights) -> f64 {
    let mut picture = render(scene, lights, integrator.strategy(), Settings { spp: 0, seed: 1 }, |_| true);
    let mut passes = 0;
    milliseconds(|| {
        passes += 1;
        picture.resume_with(integrator, passes, |_| true);
    })
}

fn pass(c: &mut Criterion) {
    let mut group = c.benchmark_group("pass");
    group.warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1)).sample_size(10);
    let mut ratios = Vec::new();
    for (name, strategy) in SCENES {
        let (scene, trees) = (load(name), load(name).with_rays(RayStructure::Tree));
        let (plan_it, load_all) = (
            || Plan::of(&scene, &[strategy], LightSampling::default()).expect("lights"),
            || Lights::load(&scene).expect("lights"),
        );
        let (plan, all) = (plan_it(), load_all());
        let planned = Integrator::new(&scene, plan.lights(), strategy);
        let everything = Integrator::new(&trees, &all, strategy).with_all_lobes();
        for (what, integrator, scene, lights) in
            [("planned", &planned, &scene, plan.lights()), ("everything", &everything, &trees, &all)]
        {
            let mut picture = render(scene, lights, strategy, Settings { spp: 0, seed: 1 }, |_| true);
            group.bench_function(BenchmarkId::new(what, name), |b| {
                b.iter(|| {
                    let next = picture.passes + 1;
                    picture.resume_with(integrator, next, |_| true);
                });
            });
        }
        // In turn, so that a slow spell of the machine hits both.
        let (mut least, mut most) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..3 {
            least = least.min(of_pass(&planned, &scene, plan.lights()));
            most = most.min(of_pass(&everything, &trees, &all));
        }
        ratios.push((name, strategy, most / least, milliseconds(plan_it), milliseconds(load_all)));
    }
    group.finish();
    for (name, strategy, ratio, planned, everything) in ratios {
        println!(
            "{name:14} {:8} a pass with everything takes {ratio:.2} times as long as planned; lights {everything:.3} ms, planned {planned:.3} ms",
            strategy.to_string()
        );
    }
}

criterion_group!(benches, rays, set_up, pass);
criterion_main!(benches);
