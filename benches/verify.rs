//! What a verification costs, and what it sees for that.
//!
//! - `judged`: a million samples drawn, counted and compared with their expected counts, quadrature included, on one thread: the part that other tools have.
//! - `battery`: everything that is asked by default, on one thread and on all.
//! - `found`: the time until a planted error of 1% over half of the mass is found: at the smallest power of two of samples that finds it for ten seeds in
//!   ten, and by looking after every batch.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DVec2, Vec3};
use std::hint::black_box;
use std::path::Path;
use std::time::Duration;
use warpcheck::catalogue::read_environment;
use warpcheck::domain::Square;
use warpcheck::sampler::{CosineHemisphere, Environment, PhongLobe, RowWarp, Sampler, from_fn};
use warpcheck::verify::{Report, Settings, Verdict, checks};

const SAMPLES: u64 = 1_000_000;

/// All checks but the one that counts.
fn but_counts() -> Vec<String> {
    checks()
        .map(|(name, _)| name.to_owned())
        .filter(|name| name != "chi-square" && name != "normalisation")
        .collect()
}

fn run<S: Sampler>(sampler: &S, settings: &Settings) -> Report {
    warpcheck::verify(sampler).settings(settings.clone()).run()
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool of a few threads");
    pool.install(work)
}

fn measure<S: Sampler>(c: &mut Criterion, name: &str, sampler: &S) {
    let all = Settings { samples: SAMPLES, ..Settings::default() };
    let counts = Settings { without: but_counts(), ..all.clone() };
    assert_eq!(run(sampler, &all).verdict(), Verdict::Pass, "{name}");
    for (what, settings, threads) in [("judged", &counts, 1), ("battery", &all, 1), ("battery", &all, 0)] {
        let mut group = c.benchmark_group(what);
        group
            .warm_up_time(Duration::from_millis(500))
            .measurement_time(Duration::from_secs(4))
            .sample_size(10);
        group.throughput(Throughput::Elements(SAMPLES));
        let id = if threads == 1 { "1 thread" } else { "all threads" };
        group.bench_function(BenchmarkId::new(name, id), |b| {
            on_threads(threads, || b.iter(|| black_box(run(sampler, settings).tests)));
        });
        group.finish();
    }
}

fn verify(c: &mut Criterion) {
    measure(c, "smooth lobe, cosine", &CosineHemisphere);
    measure(c, "peaky lobe, phong 1e6", &PhongLobe::new(Vec3::new(0.36, -0.48, 0.8), 1e6).expect("a lobe"));
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/env/noon_grass_512.hdr");
    measure(c, "map, 512 x 256", &read_environment(&file, RowWarp::UniformV).expect("a map that ships"));
    // No map of this size ships: the one that does, enlarged, each texel as bright as the one it lies in.
    let map = warpcheck::picture::read(&file).expect("a map that ships");
    let (width, height) = (map.width(), map.height());
    let texels = (0..2048 * 1024)
        .map(|i| map.pixels()[(i / 2048) * height / 1024 * width + (i % 2048) * width / 2048])
        .collect();
    let large = Environment::new(2048, 1024, texels, RowWarp::UniformV).expect("an enlarged map");
    measure(c, "map, 2048 x 1024", &large);
}

/// 1% too many samples in half of the square.
fn planted() -> impl Sampler<Domain = Square> {
    let claimed = |_: DVec2| 1.0;
    from_fn(
        Square,
        |[pick, u, v]: [f64; 3]| {
            if pick < 0.01 && u > 0.5 { DVec2::new(u - 0.5, v) } else { DVec2::new(u, v) }
        },
        claimed,
    )
}

fn found(c: &mut Criterion) {
    let broken = planted();
    let finds = |samples: u64| {
        (0..10).all(|seed| {
            run(&broken, &Settings { samples, seed, ..Settings::default() }).verdict() == Verdict::Fail
        })
    };
    let samples = (14..).map(|k| 1 << k).find(|&samples| finds(samples)).expect("it is found in the end");
    let fixed = Settings { samples, ..Settings::default() };
    let anytime = Settings { samples: 1 << 30, anytime: true, ..Settings::default() };
    let stopped: Vec<u64> = (0..10)
        .map(|seed| run(&broken, &Settings { seed, ..anytime.clone() }).examinations[0].samples)
        .collect();
    println!(
        "1% over half of the mass: {samples} samples find it for 10 seeds of 10; looking after every batch stops at {stopped:?}"
    );
    let mut group = c.benchmark_group("found");
    group.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(4)).sample_size(10);
    for (name, settings) in [("fixed number of samples", &fixed), ("anytime", &anytime)] {
        group.bench_function(name, |b| {
            on_threads(1, || b.iter(|| assert_eq!(run(&broken, settings).verdict(), Verdict::Fail)));
        });
    }
    group.finish();
}

criterion_group!(benches, verify, found);
criterion_main!(benches);
