//! Time of one sample, in groups that begin with their floor: the variates alone. Where another crate does the same, it stands beside ours.

use criterion::{
    BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main, measurement::WallTime,
};
use glam::{Vec2, Vec3};
use rand::distr::{Distribution, weighted::WeightedIndex};
use rand_chacha::ChaCha8Rng;
use rand_distr::weighted::WeightedAliasIndex;
use std::hint::black_box;
use std::path::Path;
use std::time::Duration;
use warpcheck::catalogue::read_environment;
use warpcheck::random::{stream, to_f32, unit_f64};
use warpcheck::sampler::*;

fn group<'a>(c: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = c.benchmark_group(name);
    group
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1200))
        .sample_size(30);
    group.throughput(Throughput::Elements(1));
    group
}

/// Two variates as a renderer takes them.
fn pair(rng: &mut ChaCha8Rng) -> Vec2 {
    Vec2::new(to_f32(unit_f64(rng)), to_f32(unit_f64(rng)))
}

/// Measures what is done with a generator.
fn measure<T>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    mut work: impl FnMut(&mut ChaCha8Rng) -> T,
) {
    let mut rng = stream(1, "bench", 0);
    group.bench_function(name, |b| b.iter(|| black_box(work(&mut rng))));
}

fn discrete(c: &mut Criterion) {
    for entries in [1 << 10, 1 << 20] {
        let mut group = group(c, &format!("discrete/{entries}"));
        // Uneven by a factor of 1e4, as the areas of a mesh are.
        let mut rng = stream(2, "weights", 0);
        let weights: Vec<f64> = (0..entries).map(|_| 10.0_f64.powf(4.0 * unit_f64(&mut rng))).collect();
        measure(&mut group, "floor", unit_f64);
        let ours = DiscreteCdf::new(&weights).unwrap();
        measure(&mut group, "DiscreteCdf", |rng| ours.choose(unit_f64(rng)));
        let index = WeightedIndex::new(&weights).unwrap();
        measure(&mut group, "rand WeightedIndex", |rng| index.sample(rng));
        let alias = WeightedAliasIndex::new(weights).unwrap();
        measure(&mut group, "rand_distr WeightedAliasIndex", |rng| alias.sample(rng));
    }
}

fn triangle(c: &mut Criterion) {
    let mut group = group(c, "triangle");
    measure(&mut group, "floor", pair);
    measure(&mut group, "low distortion", |rng| TriangleWarp::LowDistortion.barycentric(pair(rng)));
    measure(&mut group, "square root", |rng| TriangleWarp::SquareRoot.barycentric(pair(rng)));
}

fn environment(c: &mut Criterion) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/env/spruit_sunrise_1k.hdr");
    let mut group = group(c, "environment");
    measure(&mut group, "floor", |rng| [unit_f64(rng), unit_f64(rng)]);
    for (name, rows) in [("uniform v", RowWarp::UniformV), ("uniform cos", RowWarp::UniformCosTheta)] {
        let map = read_environment(&file, rows).unwrap();
        measure(&mut group, &format!("{name}: sample"), |rng| map.sample([unit_f64(rng), unit_f64(rng)]));
        measure(&mut group, &format!("{name}: density"), |rng| map.density(UniformSphere.sample(pair(rng))));
    }
    measure(&mut group, "uniform sphere: sample", |rng| UniformSphere.sample(pair(rng)));
}

fn directions(c: &mut Criterion) {
    let mut group = group(c, "directions");
    let tilted = Vec3::new(0.36, -0.48, 0.8);
    let phong = PhongLobe::new(tilted, 50.0).unwrap();
    let ggx = GgxVisibleNormals::new(tilted, 0.3).unwrap();
    measure(&mut group, "floor", pair);
    measure(&mut group, "cosine: sample", |rng| CosineHemisphere.sample(pair(rng)));
    measure(&mut group, "phong 50: sample", |rng| phong.sample(pair(rng)));
    measure(&mut group, "ggx 0.3: sample", |rng| ggx.sample(pair(rng)));
    measure(&mut group, "cosine: sample, density", |rng| {
        let w = CosineHemisphere.sample(pair(rng));
        (w, CosineHemisphere.density(w))
    });
    measure(&mut group, "phong 50: sample, density", |rng| {
        phong.sample(pair(rng)).map(|w| (w, phong.density(w)))
    });
    measure(&mut group, "ggx 0.3: sample, density", |rng| ggx.sample(pair(rng)).map(|w| (w, ggx.density(w))));
}

criterion_group!(benches, discrete, triangle, environment, directions);
criterion_main!(benches);
