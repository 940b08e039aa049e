//! The samplers beside their floor, their plain form and the crates one would otherwise take, in one run, and one table of ratios at its end:
//!
//! ```text
//! cargo bench --bench ratios                       everything but growth, some minutes
//! cargo bench --bench ratios -- discrete           a group
//! GROWTH=docs/growth.svg cargo bench --bench ratios -- growth      cost against N, texels, samples and threads, as a picture
//! GROWTH_SAMPLES=1000000000 …                      … up to so many samples, and not 1e8
//! ```
//!
//! Everybody takes raw bits of the same fast generator. Buffers are used again; an iteration draws 4096 samples. Times are CPU times of the
//! thread (on Unix), so that a busy machine lengthens them by what it does to caches only; those of histograms, which are drawn by several
//! threads, are times on the wall.

use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{BenchmarkGroup, Throughput};
use glam::{DVec3, Vec2, Vec3};
use plotters::coord::Shift;
use plotters::prelude::*;
use rand::distr::{Distribution, weighted::WeightedIndex};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};
use rand_distr::weighted::WeightedAliasIndex;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};
use warpcheck::estimator::Clock;
use warpcheck::histogram::Histogram;
use warpcheck::random::{stream, unit_f64};
use warpcheck::sampler::*;
use warpcheck::verify::Settings;

/// Samples an iteration.
const SAMPLES: usize = 4096;

type Criterion = criterion::Criterion<CpuTime>;

/// CPU time of the thread.
struct CpuTime;

impl Measurement for CpuTime {
    type Intermediate = Clock;
    type Value = Duration;

    fn start(&self) -> Clock {
        Clock::start()
    }

    fn end(&self, clock: Clock) -> Duration {
        clock.read().cpu
    }

    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }

    fn zero(&self) -> Duration {
        Duration::ZERO
    }

    fn to_f64(&self, value: &Duration) -> f64 {
        value.as_nanos() as f64
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}

/// A folder of criterion's own.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("ratios")
}

struct Bench<'a> {
    group: BenchmarkGroup<'a, CpuTime>,
    rng: Xoshiro256PlusPlus,
}

impl<'a> Bench<'a> {
    fn new(c: &'a mut Criterion, name: &str, milliseconds: u64) -> Self {
        let mut group = c.benchmark_group(name);
        group
            .warm_up_time(Duration::from_millis(milliseconds / 3))
            .measurement_time(Duration::from_millis(milliseconds))
            .sample_size(20)
            .nresamples(2000)
            .throughput(Throughput::Elements(SAMPLES as u64));
        Self { group, rng: Xoshiro256PlusPlus::seed_from_u64(1) }
    }

    fn measure(&mut self, name: &str, mut work: impl FnMut(&mut Xoshiro256PlusPlus) -> u64) {
        let rng = &mut self.rng;
        self.group.bench_function(name, |b| b.iter(|| black_box(work(rng))));
    }

    /// One sample after the other.
    fn each(&mut self, name: &str, mut sample: impl FnMut(&mut Xoshiro256PlusPlus) -> u64) {
        self.measure(name, |rng| (0..SAMPLES).fold(0, |sum, _| sum ^ sample(rng)));
    }

    /// A buffer of random bits at a time.
    fn bits(&mut self, name: &str, mut fill: impl FnMut(&[u64], &mut [u32])) {
        let (mut bits, mut out) = ([0; 512], [0; 512]);
        self.measure(name, |rng| {
            let mut sum = 0;
            for _ in 0..SAMPLES / bits.len() {
                bits.fill_with(|| rng.next_u64());
                fill(&bits, &mut out);
                sum ^= u64::from(out.iter().fold(0, |a, b| a ^ b));
            }
            sum
        });
    }

    /// A buffer of indices at a time.
    fn indices(&mut self, name: &str, mut draw: impl FnMut(&mut Xoshiro256PlusPlus, &mut [u32])) {
        let mut out = [0; 512];
        self.measure(name, |rng| {
            let mut sum = 0;
            for _ in 0..SAMPLES / out.len() {
                draw(rng, &mut out);
                sum ^= u64::from(out.iter().fold(0, |a, b| a ^ b));
            }
            sum
        });
    }

    /// A buffer of pairs of variates at a time.
    fn pairs<T: Copy>(&mut self, name: &str, empty: T, mut fill: impl FnMut(&[[f64; 2]], &mut [T])) {
        let (mut xi, mut out) = ([[0.0; 2]; 512], [empty; 512]);
        self.measure(name, |rng| {
            for _ in 0..SAMPLES / xi.len() {
                xi.fill_with(|| [unit_f64(rng), unit_f64(rng)]);
                fill(&xi, &mut out);
                black_box(&mut out);
            }
            0
        });
    }
}

/// Uneven by a factor of 1e4, as the areas of a mesh are.
fn weights(entries: usize) -> Vec<f64> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    (0..entries).map(|_| 10.0_f64.powf(4.0 * unit_f64(&mut rng))).collect()
}

/// Sums up to each.
fn running_sums(weights: impl Iterator<Item = f64>) -> Vec<f64> {
    let sum = |sum: &mut f64, w| {
        *sum += w;
        Some(*sum)
    };
    weights.scan(0.0, sum).collect()
}

/// Inversion as it is written everywhere: a search in halves.
fn plain_search(bench: &mut Bench<'_>, weights: &[f64]) {
    let ends = running_sums(weights.iter().copied());
    let total = ends[ends.len() - 1];
    bench.each("partition_point", |rng| {
        let x = unit_f64(rng) * total;
        ends.partition_point(|&end| end <= x) as u64
    });
}

fn discrete(c: &mut Criterion) {
    for k in [10, 16, 20, 24] {
        let weights = weights(1 << k);
        let mut bench = Bench::new(c, &format!("discrete/2^{k}"), 900);
        bench.each("floor", |rng| rng.next_u64());
        let cdf = DiscreteCdf::new(&weights).unwrap();
        plain_search(&mut bench, &weights);
        {
            let index = WeightedIndex::new(&weights).unwrap();
            bench.each("rand WeightedIndex", |rng| index.sample(rng) as u64);
            bench.bits("DiscreteCdf", |bits, out| cdf.indices(bits, out));
        }
        {
            let guide = DiscreteGuide::from_cdf(cdf.clone());
            bench.each("DiscreteGuide, single", |rng| guide.choose(unit_f64(rng)).index as u64);
            bench.bits("DiscreteGuide", |bits, out| guide.indices(bits, out));
        }
        {
            let alias = WeightedAliasIndex::new(weights).unwrap();
            bench.each("rand_distr WeightedAliasIndex", |rng| alias.sample(rng) as u64);
        }
        let alias = DiscreteAlias::from_cdf(cdf);
        bench.each("DiscreteAlias, single", |rng| alias.choose(unit_f64(rng)).index as u64);
        bench.bits("DiscreteAlias, bits", |bits, out| alias.indices(bits, out));
        bench.indices("DiscreteAlias", |rng, out| alias.draw(rng, out));
    }
}

/// A sky with clouds, a dark ground and a sun; no map of this size ships.
fn sky(width: usize, height: usize) -> RadianceMap {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let sun = (width / 3, height / 4);
    let texels = (0..width * height)
        .map(|i| {
            let (column, row) = (i % width, i / width);
            let (x, y) = (column as f32 / width as f32, row as f32 / height as f32);
            let cloud = 1.0 + (20.0 * x).sin() * (13.0 * y + 5.0 * x).cos();
            let base = if y < 0.55 { 0.3 + cloud } else { 0.05 };
            let grain = (rng.next_u32() >> 8) as f32 / 16_777_216.0;
            let near = column.abs_diff(sun.0).max(row.abs_diff(sun.1)) * 400 < width;
            let light = base * (0.5 + grain) + if near { 2000.0 } else { 0.0 };
            [light, light, 1.2 * light]
        })
        .collect();
    RadianceMap::new(width, height, texels).unwrap()
}

/// Marginal and conditional as they are written everywhere: `f32`, searched in halves, interpolated.
struct Plain {
    width: usize,
    marginal: Vec<f32>,
    conditionals: Vec<f32>,
}

impl Plain {
    fn new(map: &RadianceMap) -> Self {
        let (width, height) = (map.width(), map.height());
        let cdf = |weights: &mut dyn Iterator<Item = f64>, out: &mut Vec<f32>| {
            let sums = running_sums(weights);
            let total = sums[sums.len() - 1];
            out.extend(std::iter::once(0.0).chain(sums.iter().map(|s| (s / total) as f32)));
            total
        };
        let (mut marginal, mut conditionals) = (Vec::new(), Vec::new());
        let sums: Vec<f64> = map
            .texels()
            .chunks(width)
            .enumerate()
            .map(|(row, texels)| {
                let sine = (PI * (row as f64 + 0.5) / height as f64).sin();
                sine * cdf(&mut texels.iter().map(|&t| luminance(t)), &mut conditionals)
            })
            .collect();
        cdf(&mut sums.into_iter(), &mut marginal);
        Self { width, marginal, conditionals }
    }

    fn search(cdf: &[f32], xi: f32) -> (usize, f32) {
        let i = (cdf.partition_point(|&c| c <= xi).max(1) - 1).min(cdf.len() - 2);
        (i, (xi - cdf[i]) / (cdf[i + 1] - cdf[i]))
    }

    fn uv(&self, xi: [f64; 2]) -> [f64; 2] {
        let (row, down) = Self::search(&self.marginal, xi[0] as f32);
        let stride = self.width + 1;
        let conditional = &self.conditionals[row * stride..(row + 1) * stride];
        let (column, across) = Self::search(conditional, xi[1] as f32);
        [
            f64::from(column as f32 + across) / self.width as f64,
            f64::from(row as f32 + down) / (self.marginal.len() - 1) as f64,
        ]
    }
}

/// The floor, and the search as everybody writes it first.
fn plain_maps(bench: &mut Bench<'_>, map: &RadianceMap) {
    bench.pairs("floor", [0.0; 2], |xi, out| out.copy_from_slice(xi));
    let plain = Plain::new(map);
    bench.pairs("two binary searches", [0.0; 2], |xi, out| {
        out.iter_mut().zip(xi).for_each(|(uv, &xi)| *uv = plain.uv(xi));
    });
}

fn environment(c: &mut Criterion) {
    for (width, height) in [(2048, 1024), (8192, 4096)] {
        let map = Arc::new(sky(width, height));
        let mut bench = Bench::new(c, &format!("environment/{width}x{height}"), 1500);
        plain_maps(&mut bench, &map);
        for (name, form) in [("guide", Form::Guide), ("alias", Form::Alias)] {
            let map = PackedEnvironment::new(map.clone(), RowWarp::UniformV, form).unwrap();
            bench.pairs(&format!("{name}: (u, v)"), [0.0; 2], |xi, out| map.uv_all(xi, out));
            bench.pairs(&format!("{name}: sample"), EnvironmentSample::default(), |xi, out| {
                map.sample_all(xi, out);
            });
            bench.each(&format!("{name}: density"), |rng| {
                let w = UniformSphere.sample(Vec2::new(unit_f64(rng) as f32, unit_f64(rng) as f32));
                u64::from(map.density(w).to_bits())
            });
        }
        if width <= 2048 {
            let baseline = Environment::from_map((*map).clone(), RowWarp::UniformV).unwrap();
            bench.pairs("Environment: sample", EnvironmentSample::default(), |xi, out| {
                out.iter_mut().zip(xi).for_each(|(sample, &xi)| *sample = baseline.sample(xi));
            });
            bench.each("Environment: density", |rng| {
                let w = UniformSphere.sample(Vec2::new(unit_f64(rng) as f32, unit_f64(rng) as f32));
                u64::from(baseline.density(w).to_bits())
            });
        }
    }
}

fn direction(c: &mut Criterion) {
    let mut bench = Bench::new(c, "direction", 700);
    bench.pairs("floor", Vec3::ZERO, |xi, out| {
        out.iter_mut().zip(xi).for_each(|(w, &[u, v])| *w = Vec3::new(u as f32, v as f32, 0.0));
    });
    bench.pairs("sin_cos", Vec3::ZERO, |xi, out| {
        out.iter_mut().zip(xi).for_each(|(w, &[u, v])| {
            let (sin_phi, cos_phi) = (TAU * u).sin_cos();
            let (sine, cosine) = (PI * v).sin_cos();
            *w = Vec3::new((sine * cos_phi) as f32, (sine * sin_phi) as f32, cosine as f32);
        });
    });
    bench.pairs("polynomial", Vec3::ZERO, |xi, out| {
        out.iter_mut().zip(xi).for_each(|(w, &uv)| *w = PackedEnvironment::direction_of(uv));
    });
}

/// The fold as it is printed, with its branch.
fn printed(xi: Vec2) -> Vec3 {
    let (b0, b1);
    if xi.x < xi.y {
        b0 = xi.x / 2.0;
        b1 = xi.y - b0;
    } else {
        b1 = xi.y / 2.0;
        b0 = xi.x - b1;
    }
    Vec3::new(b0, b1, 1.0 - b0 - b1)
}

fn triangle(c: &mut Criterion) {
    let mut bench = Bench::new(c, "triangle", 700);
    let mut buffers = |name: &str, mut warp: Box<dyn FnMut(&[Vec2], &mut [Vec3])>| {
        let (mut xi, mut out) = ([Vec2::ZERO; 512], [Vec3::ZERO; 512]);
        bench.measure(name, |rng| {
            for _ in 0..SAMPLES / xi.len() {
                xi.fill_with(|| {
                    let bits = rng.next_u64();
                    let unit = |bits: u32| (bits >> 8) as f32 * (1.0 / 16_777_216.0);
                    Vec2::new(unit(bits as u32), unit((bits >> 32) as u32))
                });
                warp(&xi, &mut out);
                black_box(&mut out);
            }
            0
        });
    };
    buffers("floor", Box::new(|xi, out| out.iter_mut().zip(xi).for_each(|(b, xi)| *b = xi.extend(0.0))));
    buffers(
        "low distortion as printed",
        Box::new(|xi, out| {
            out.iter_mut().zip(xi).for_each(|(b, &xi)| *b = printed(xi));
        }),
    );
    buffers("square root", Box::new(|xi, out| TriangleWarp::SquareRoot.barycentric_all(xi, out)));
    buffers("low distortion", Box::new(|xi, out| TriangleWarp::LowDistortion.barycentric_all(xi, out)));
}

/// Samples of a histogram of a map, one after the other, with angles, as everybody writes it first.
fn plain_histogram(map: &Environment, width: usize, height: usize, samples: u64) -> Vec<u64> {
    let threads = rayon::current_num_threads() as u64;
    let count = |thread: u64| {
        let mut rng = stream(1, "plain", thread);
        let mut counts = vec![0_u64; width * height];
        for _ in 0..samples / threads {
            let w: DVec3 = map.sample([unit_f64(&mut rng), unit_f64(&mut rng)]).direction.as_dvec3();
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

/// Nanoseconds a sample on so many threads: the median of some, but the first.
fn wall(threads: usize, samples: u64, times: usize, mut work: impl FnMut(u64) -> u64 + Send) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let mut time = || {
        let start = Instant::now();
        black_box(pool.install(|| work(samples)));
        start.elapsed().as_secs_f64() * 1e9 / samples as f64
    };
    if times > 1 {
        time();
    }
    let mut all: Vec<f64> = (0..times).map(|_| time()).collect();
    all.sort_by(f64::total_cmp);
    all[times / 2]
}

/// Size of the map and of its histograms.
const SIZE: (usize, usize) = (2048, 1024);

/// What draws a histogram.
enum Drawer {
    Plain(Environment),
    Ours(PackedEnvironment),
}

impl Drawer {
    fn plain() -> Self {
        Self::Plain(Environment::from_map(sky(SIZE.0, SIZE.1), RowWarp::UniformV).unwrap())
    }

    fn ours(form: Form) -> Self {
        Self::Ours(PackedEnvironment::new(sky(SIZE.0, SIZE.1), RowWarp::UniformV, form).unwrap())
    }

    fn draw(&self, samples: u64) -> u64 {
        match self {
            Self::Plain(map) => plain_histogram(map, SIZE.0, SIZE.1, samples)[0],
            Self::Ours(map) => {
                let settings = Settings { samples, ..Settings::default() };
                Histogram::draw(map, SIZE.0, SIZE.1, &settings).counts[0]
            }
        }
    }

    fn time(&self, threads: usize, samples: u64, times: usize) -> f64 {
        wall(threads, samples, times, |samples| self.draw(samples))
    }
}

/// Lines for the table.
fn histograms() -> Vec<Ratio> {
    const SAMPLES: u64 = 1 << 24;
    let plain = Drawer::plain();
    let theirs = [1, 2].map(|threads| plain.time(threads, SAMPLES, 3));
    drop(plain);
    let mut lines = Vec::new();
    for (name, form) in [("guide", Form::Guide), ("alias", Form::Alias)] {
        let ours = Drawer::ours(form);
        for threads in [1, 2] {
            lines.push(Ratio {
                group: format!("histogram, {threads} threads"),
                ours: name.into(),
                here: ours.time(threads, SAMPLES, 5),
                floor: f64::NAN,
                theirs: "one at a time, with angles".into(),
                there: theirs[threads - 1],
                at_least: 6.0,
            });
        }
    }
    lines
}

/// A curve of the growth: its name, and its points.
type Curve = (&'static str, Vec<(f64, f64)>);

/// Sizes of maps, in rows.
const HEIGHTS: [usize; 8] = [32, 64, 128, 256, 512, 1024, 2048, 4096];

/// Cost against entries and texels.
fn growth(c: &mut Criterion) {
    if std::env::var_os("GROWTH").is_none() {
        return;
    }
    for k in (4..=24).step_by(2) {
        let weights = weights(1 << k);
        let mut bench = Bench::new(c, &format!("growth/2^{k}"), 250);
        bench.each("floor", |rng| rng.next_u64());
        let cdf = DiscreteCdf::new(&weights).unwrap();
        plain_search(&mut bench, &weights);
        {
            let alias = WeightedAliasIndex::new(weights).unwrap();
            bench.each("rand_distr WeightedAliasIndex", |rng| alias.sample(rng) as u64);
        }
        let guide = DiscreteGuide::from_cdf(cdf.clone());
        bench.bits("DiscreteGuide", |bits, out| guide.indices(bits, out));
        drop(guide);
        let alias = DiscreteAlias::from_cdf(cdf);
        bench.indices("DiscreteAlias", |rng, out| alias.draw(rng, out));
    }
    for height in HEIGHTS {
        let map = Arc::new(sky(2 * height, height));
        let mut bench = Bench::new(c, &format!("growth/{height} rows"), 250);
        plain_maps(&mut bench, &map);
        for (name, form) in [("guide", Form::Guide), ("alias", Form::Alias)] {
            let map = PackedEnvironment::new(map.clone(), RowWarp::UniformV, form).unwrap();
            bench.pairs(name, [0.0; 2], |xi, out| map.uv_all(xi, out));
        }
    }
}

/// Cost of a histogram against samples and threads. The plain form costs the same for any number of samples, and is left out where it takes minutes.
fn growth_of_histograms() -> Vec<Curve> {
    let most = std::env::var("GROWTH_SAMPLES")
        .map_or(100_000_000, |text| text.parse().expect("GROWTH_SAMPLES is no number"));
    let counts = |most: u64| (4..).map(|k| 10_u64.pow(k)).take_while(move |&n| n <= most);
    let curve = |drawer: &Drawer, threads: usize, most: u64| {
        let times = |samples| if samples <= 1_000_000 { 5 } else { 1 };
        counts(most).map(|n| (n as f64, drawer.time(threads, n, times(n)))).collect()
    };
    let plain = Drawer::plain();
    let mut curves = vec![
        ("one at a time, 1 thread", curve(&plain, 1, 10_000_000.min(most))),
        ("one at a time, 2 threads", curve(&plain, 2, 10_000_000.min(most))),
    ];
    drop(plain);
    let ours = Drawer::ours(Form::Guide);
    curves.push(("guide, 1 thread", curve(&ours, 1, most)));
    curves.push(("guide, 2 threads", curve(&ours, 2, most)));
    curves
}

/// Whether the command line names other groups only: then nothing has to be built for this one.
fn is_left_out(group: &str) -> bool {
    let named: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    !named.is_empty() && !named.iter().any(|name| name.starts_with(group) || group.starts_with(name.as_str()))
}

/// Nanoseconds a sample, the median that criterion found in this run.
fn nanoseconds(group: &str, name: &str, since: SystemTime) -> Option<f64> {
    // As criterion makes file names of ids.
    let safe = |id: &str| id.replace(['?', '"', '/', '\\', '*', '<', '>', ':', '|', '^'], "_");
    let file = folder().join(safe(group)).join(safe(name)).join("new/estimates.json");
    let metadata = std::fs::metadata(&file).ok()?;
    if metadata.modified().ok()? < since {
        return None;
    }
    let estimates: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).ok()?).ok()?;
    Some(estimates["median"]["point_estimate"].as_f64()? / SAMPLES as f64)
}

/// A line of the table.
struct Ratio {
    group: String,
    ours: String,
    /// Nanoseconds a sample.
    here: f64,
    floor: f64,
    theirs: String,
    there: f64,
    at_least: f64,
}

/// What has to be how many times faster than what.
fn ratios(since: SystemTime, others: Vec<Ratio>) {
    let mut lines = Vec::new();
    let mut line = |group: &str, ours: &str, theirs: &str, at_least: f64| {
        let of = |name: &str| nanoseconds(group, name, since);
        if let (Some(here), Some(there)) = (of(ours), of(theirs)) {
            let floor = of("floor").unwrap_or(f64::NAN);
            let [group, ours, theirs] = [group, ours, theirs].map(String::from);
            lines.push(Ratio { group, ours, here, floor, theirs, there, at_least });
        }
    };
    for k in [10, 16, 20, 24] {
        line(&format!("discrete/2^{k}"), "DiscreteAlias", "rand_distr WeightedAliasIndex", 3.0);
    }
    for (k, at_least) in [(10, 4.0), (16, 8.0), (20, 12.0), (24, 12.0)] {
        line(&format!("discrete/2^{k}"), "DiscreteGuide", "partition_point", at_least);
    }
    for k in [10, 16, 20, 24] {
        line(&format!("discrete/2^{k}"), "DiscreteGuide", "rand WeightedIndex", 3.0);
    }
    for (size, at_least) in [("2048x1024", 5.0), ("8192x4096", 8.0)] {
        let group = format!("environment/{size}");
        line(&group, "guide: (u, v)", "two binary searches", at_least);
        line(&group, "alias: (u, v)", "two binary searches", at_least);
        line(&group, "guide: sample", "Environment: sample", 5.0);
        line(&group, "guide: density", "Environment: density", 1.0);
    }
    line("direction", "polynomial", "sin_cos", 3.0);
    line("triangle", "low distortion", "square root", 1.0 / 1.3);
    line("triangle", "low distortion", "low distortion as printed", 1.0);
    lines.extend(others);
    if !lines.is_empty() {
        println!("\nns a sample, medians; times faster, and how many times are wanted");
        println!(
            "{:<22} {:<18} {:>8} {:>7}   {:<30} {:>8} {:>8} {:>7}",
            "group", "ours", "ns", "floor", "beside", "ns", "faster", "wanted"
        );
    }
    for Ratio { group, ours, here, floor, theirs, there, at_least } in lines {
        let faster = there / here;
        let said = if faster >= at_least { "yes" } else { "NO" };
        println!(
            "{group:<22} {ours:<18} {here:>8.2} {floor:>7.2}   {theirs:<30} {there:>8.2} {faster:>8.2} {at_least:>7.2}  {said}"
        );
    }
}

/// The colour of a kind of curve, the same in all panels, and its width: curves that are alike but for one thread are thin.
fn stroke(name: &str) -> (RGBColor, u32) {
    let colour = match name.split(',').next().unwrap_or(name) {
        "floor" => RGBColor(90, 90, 90),
        "partition_point" | "two binary searches" | "one at a time" => RGBColor(213, 94, 0),
        "DiscreteGuide" | "guide" => RGBColor(0, 114, 178),
        "DiscreteAlias" | "alias" => RGBColor(0, 158, 115),
        _ => RGBColor(204, 121, 167), // another crate
    };
    (colour, if name.ends_with("1 thread") { 1 } else { 3 })
}

/// A panel of the plot, both axes logarithmic.
fn panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    caption: &str,
    x_name: &str,
    curves: Vec<Curve>,
) -> Result<(), Box<dyn std::error::Error>>
where
    B::ErrorType: 'static,
{
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)))
    };
    let points = || curves.iter().flat_map(|(_, points)| points);
    let (left, right) = range(&mut points().map(|p| p.0));
    let (low, high) = range(&mut points().map(|p| p.1));
    // Room for the names.
    let top = high * (high / low).powf(0.55) * 1.5;
    let font = |size: i32| ("sans-serif", size).into_font();
    let power = |x: &f64| match x.log10().round() {
        k if k < 4.0 => format!("{x}"),
        k => format!("1e{k}"),
    };
    let mut chart = ChartBuilder::on(area)
        .caption(caption, font(17))
        .margin(10)
        .x_label_area_size(44)
        .y_label_area_size(58)
        .build_cartesian_2d((left..right).log_scale(), (low / 1.5..top).log_scale())?;
    chart
        .configure_mesh()
        .x_desc(x_name)
        .y_desc("ns a sample")
        .label_style(font(13))
        .axis_desc_style(font(15))
        .light_line_style(WHITE)
        .x_label_formatter(&power)
        .y_label_formatter(&power)
        .draw()?;
    for (name, points) in curves {
        let (colour, width) = stroke(name);
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(width)).point_size(2))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(width)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .label_font(font(14))
        .background_style(WHITE.mix(0.8))
        .draw()?;
    Ok(())
}

/// The growth as an SVG.
fn plot(file: &Path, since: SystemTime, histograms: Vec<Curve>) -> Result<(), Box<dyn std::error::Error>> {
    let entries =
        ["partition_point", "rand_distr WeightedAliasIndex", "DiscreteGuide", "DiscreteAlias", "floor"];
    let entries = entries.map(|name| {
        let at = |k: i32| Some((2.0_f64.powi(k), nanoseconds(&format!("growth/2^{k}"), name, since)?));
        (name, (4..=24).step_by(2).filter_map(at).collect::<Vec<_>>())
    });
    let texels = ["two binary searches", "guide", "alias", "floor"].map(|name| {
        let time = |height| nanoseconds(&format!("growth/{height} rows"), name, since);
        let at = |&height: &usize| Some(((2 * height * height) as f64, time(height)?));
        (name, HEIGHTS.iter().filter_map(at).collect::<Vec<_>>())
    });
    if entries.iter().chain(&texels).chain(&histograms).any(|(_, points)| points.is_empty()) {
        return Ok(());
    }
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (1290, 430)).into_drawing_area();
        root.fill(&WHITE)?;
        let areas = root.split_evenly((1, 3));
        panel(&areas[0], "an index out of N", "N", entries.into())?;
        panel(&areas[1], "(u, v) of a map", "texels, 64 x 32 to 8192 x 4096", texels.into())?;
        panel(&areas[2], "histogram of a map of 2048 x 1024", "samples", histograms)?;
        root.present()?;
    }
    let unfinished = file.with_extension("svg.part");
    std::fs::write(&unfinished, text)?;
    std::fs::rename(&unfinished, file)?;
    println!("{} is written", file.display());
    Ok(())
}

fn main() {
    let since = SystemTime::now();
    let mut criterion = criterion::Criterion::default()
        .with_measurement(CpuTime)
        .output_directory(&folder())
        .configure_from_args();
    let groups: [(&str, fn(&mut Criterion)); 5] = [
        ("discrete", discrete),
        ("environment", environment),
        ("direction", direction),
        ("triangle", triangle),
        ("growth", growth),
    ];
    for (name, group) in groups {
        if !is_left_out(name) {
            group(&mut criterion);
        }
    }
    criterion.final_summary();
    ratios(since, if is_left_out("histogram") { Vec::new() } else { histograms() });
    if let Some(file) = std::env::var_os("GROWTH").filter(|_| !is_left_out("growth"))
        && let Err(error) = plot(Path::new(&file), since, growth_of_histograms())
    {
        eprintln!("{}: {error}", Path::new(&file).display());
        std::process::exit(2);
    }
}
