//! Time of a whole verification of a million samples: a smooth lobe, a peaky one, a map.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use std::path::Path;
use std::time::Duration;
use warpcheck::catalogue::read_environment;
use warpcheck::sampler::{CosineHemisphere, PhongLobe, RowWarp, Sampler};
use warpcheck::verify::Verdict;

const SAMPLES: u64 = 1_000_000;

fn measure<S: Sampler>(c: &mut Criterion, name: &str, sampler: &S) {
    let mut group = c.benchmark_group("verify");
    group.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(5)).sample_size(10);
    group.throughput(Throughput::Elements(SAMPLES));
    let run = || warpcheck::verify(sampler).samples(SAMPLES).run().verdict();
    assert_eq!(run(), Verdict::Pass, "{name}");
    group.bench_function(name, |b| b.iter(run));
    group.finish();
}

fn verify(c: &mut Criterion) {
    measure(c, "smooth lobe: cosine", &CosineHemisphere);
    let phong = PhongLobe::new(Vec3::new(0.36, -0.48, 0.8), 1e6).unwrap();
    measure(c, "peaky lobe: phong 1e6", &phong);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/env/noon_grass_512.hdr");
    measure(c, "map: 512 x 256", &read_environment(&file, RowWarp::UniformV).unwrap());
}

criterion_group!(benches, verify);
criterion_main!(benches);
