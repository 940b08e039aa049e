//! Histograms of samples over the picture of a domain, as densities.
//!
//! Every sample falls into a pixel of the domain's picture (latitude-longitude for the sphere, an equal-area disk for the
//! hemisphere, …). A pixel's count over the number of samples and over the pixel's measure is the density there, which is to be compared with
//! the density that the sampler claims.

use crate::domain::{Domain, Pixels};
use crate::pages::Pages;
use crate::random::{fill_unit, stream};
use crate::sampler::Sampler;
use crate::verify::{Drawn, Settings};

const SHARD: u64 = 1 << 16;
/// Shards between two looks at the clock, at least; …
const BATCH: u64 = 32;
/// … so many samples a pixel, …
const FILLED: u64 = 16;
/// … and no more than a count of 32 bits holds.
const MOST: u64 = u32::MAX as u64 / SHARD;
/// Samples that are drawn at a time.
const CHUNK: usize = 256;
/// Pixels from which on variates are sorted: their counts don't fit into the cache next to a processor.
const MANY: usize = 1 << 17;
/// Strata of the first variate that they are sorted into, …
const STRATA: usize = 128;
/// … and bytes of variates that a thread holds for it.
const HELD: usize = 1 << 23;
/// Sub-pixels along an axis that measure how much of a pixel the domain covers.
const COVERAGE: usize = 4;

/// Counts of one thread: half as wide as those that are kept, since they are hit in no order and caches are small.
struct Counts {
    pixels: Pages<u32>,
    samples: u64,
    rejected: u64,
    outside: u64,
}

/// Variates of samples, by strata of the first one. It is what selects rows and entries, so that the samples of one stratum read the same part of the
/// sampler's tables and, unless it loses order, fall into the same part of the picture; and nobody asks in which order samples were counted.
struct Strata {
    xi: Pages<f64>,
    /// Numbers that a stratum has place for, …
    most: usize,
    /// … and holds.
    held: [usize; STRATA],
}

impl Strata {
    /// For so many samples.
    fn new(samples: u64, dimensions: usize) -> Self {
        // A sixteenth more: four standard deviations of half a million samples.
        let most = (samples as usize / STRATA * 17 / 16) * dimensions;
        Self { xi: Pages::zeros(STRATA * most), most, held: [0; STRATA] }
    }
}

impl Counts {
    fn new(cells: usize) -> Self {
        Self { pixels: Pages::zeros(cells), samples: 0, rejected: 0, outside: 0 }
    }

    /// The samples of some shards.
    fn draw<D: Domain>(
        &mut self,
        sampler: &dyn Sampler<Domain = D>,
        pixels: &Pixels,
        settings: &Settings,
        shards: std::ops::Range<u64>,
        strata: &mut Option<Strata>,
    ) {
        let dimensions = sampler.dimensions();
        let mut buffer = vec![0.0; dimensions * CHUNK];
        for shard in shards {
            let mut rng = stream(settings.seed, "histogram", shard);
            let mut left = SHARD.min(settings.samples - shard * SHARD) as usize;
            self.samples += left as u64;
            while left > 0 {
                let drawn = left.min(CHUNK);
                left -= drawn;
                let xi = &mut buffer[..drawn * dimensions];
                fill_unit(&mut rng, xi);
                let Some(Strata { xi: strata, most, held }) = strata else {
                    self.count(sampler, pixels, xi);
                    continue;
                };
                for xi in xi.chunks_exact(dimensions) {
                    let i = ((xi[0] * STRATA as f64) as u32 as usize).min(STRATA - 1);
                    if held[i] == *most {
                        self.count(sampler, pixels, &strata[i * *most..][..held[i]]);
                        held[i] = 0;
                    }
                    let place = &mut strata[i * *most + held[i]..][..dimensions];
                    // Two numbers are moved faster than a function for any number of them is called.
                    match (place, xi) {
                        ([a, b], &[u, v]) => (*a, *b) = (u, v),
                        (place, xi) => place.copy_from_slice(xi),
                    }
                    held[i] += dimensions;
                }
            }
        }
        if let Some(Strata { xi, most, held }) = strata {
            for (i, held) in held.iter_mut().enumerate() {
                self.count(sampler, pixels, &xi[i * *most..][..*held]);
                *held = 0;
            }
        }
    }

    /// The samples of these variates.
    fn count<D: Domain>(&mut self, sampler: &dyn Sampler<Domain = D>, pixels: &Pixels, xi: &[f64]) {
        let (domain, dimensions) = (sampler.domain(), sampler.dimensions());
        let counts = &mut *self.pixels;
        let mut points = [const { None }; CHUNK];
        for xi in xi.chunks((dimensions * CHUNK).max(1)) {
            let points = &mut points[..xi.len() / dimensions.max(1)];
            sampler.fill_points(xi, points);
            let uncounted = domain.count_pixels(pixels, points, counts);
            self.rejected += uncounted.none;
            self.outside += uncounted.outside;
        }
    }

    fn merge(&mut self, other: Self) {
        self.pixels.iter_mut().zip(&*other.pixels).for_each(|(a, b)| *a += b);
        self.samples += other.samples;
        self.rejected += other.rejected;
        self.outside += other.outside;
    }
}

/// Counts of samples per pixel of a domain's picture, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Samples per pixel.
    pub counts: Vec<u64>,
    /// Samples drawn, rejected ones and those outside of the domain included.
    pub samples: u64,
    /// Samples that the sampler rejected.
    pub rejected: u64,
    /// Samples that lie outside of the domain.
    pub outside: u64,
}

impl Histogram {
    /// Draws `settings.samples` samples, fewer if stopped, into `width` x `height` pixels. The same seed gives the same counts on any
    /// number of threads.
    ///
    /// ```
    /// use warpcheck::histogram::Histogram;
    /// use warpcheck::sampler::UniformSphere;
    /// use warpcheck::verify::Settings;
    /// let settings = Settings { samples: 10_000, ..Settings::default() };
    /// let histogram = Histogram::draw(&UniformSphere, 8, 4, &settings);
    /// assert_eq!(histogram.counts.iter().sum::<u64>(), 10_000);
    /// ```
    pub fn draw<S: Sampler>(sampler: &S, width: usize, height: usize, settings: &Settings) -> Self {
        Self::draw_any(sampler, width, height, settings)
    }

    /// Compiled once a domain.
    fn draw_any<D: Domain>(
        sampler: &dyn Sampler<Domain = D>,
        width: usize,
        height: usize,
        settings: &Settings,
    ) -> Self {
        let cells = width * height;
        let empty = Self { width, height, counts: vec![0; cells], samples: 0, rejected: 0, outside: 0 };
        let pixels = Pixels::new(width, height);
        let mut total = empty;
        let shards = settings.samples.div_ceil(SHARD);
        // Adding up the threads' counts must cost less than filling them.
        let batch = BATCH.max(FILLED * cells as u64 / SHARD).min(MOST);
        // Shards whose variates are sorted together.
        let per_sample = size_of::<f64>() * sampler.dimensions();
        let worth_it = cells >= MANY && settings.samples >= cells as u64 / 4 && per_sample > 0;
        let together = if worth_it { ((HELD / per_sample) as u64 / SHARD).max(1) } else { 1 };
        let mut next = 0;
        while next < shards && !(settings.stopped() && next > 0) {
            let batch = batch.min(shards - next);
            let counted = crate::parallel::fold(
                batch.div_ceil(together) as usize,
                || {
                    let sorted = together > 1;
                    let strata = sorted.then(|| Strata::new(together * SHARD, sampler.dimensions()));
                    (Counts::new(cells), strata)
                },
                |(counts, strata), i| {
                    let first = next + i as u64 * together;
                    let shards = first..(first + together).min(next + batch);
                    counts.draw(sampler, &pixels, settings, shards, strata);
                },
                |(total, _), (counts, _)| total.merge(counts),
            );
            total.add(&counted.0);
            next += batch;
            if let Some(progress) = &settings.progress {
                progress(Drawn { samples: total.samples, of: settings.samples });
            }
        }
        total
    }

    fn add(&mut self, other: &Counts) {
        self.counts.iter_mut().zip(&*other.pixels).for_each(|(a, &b)| *a += u64::from(b));
        self.samples += other.samples;
        self.rejected += other.rejected;
        self.outside += other.outside;
    }

    /// The density of every pixel, per the domain's measure; NaN where a pixel shows nothing of the domain.
    pub fn density<D: Domain>(&self, domain: &D) -> Vec<f64> {
        let (width, height) = (self.width as f64, self.height as f64);
        let weight = width * height / self.samples.max(1) as f64;
        (0..self.counts.len())
            .map(|i| {
                let (column, row) = ((i % self.width) as f64, (i / self.width) as f64);
                // The measure of what the pixel shows of the domain, from a few places in it.
                let places = (0..COVERAGE * COVERAGE).filter_map(|k| {
                    let place = |k: usize| (k as f64 + 0.5) / COVERAGE as f64;
                    let x = (column + place(k % COVERAGE)) / width;
                    let y = (row + place(k / COVERAGE)) / height;
                    domain.picture_location(x, y).map(|_| domain.picture_scale(x, y))
                });
                let measure = places.sum::<f64>() / (COVERAGE * COVERAGE) as f64;
                if measure > 0.0 { self.counts[i] as f64 * weight / measure } else { f64::NAN }
            })
            .collect()
    }
}

/// The density that a sampler claims at the middle of every pixel of its domain's picture; NaN outside.
pub fn claimed_density<S: Sampler>(sampler: &S, width: usize, height: usize) -> Vec<f64> {
    claimed_by(sampler, width, height)
}

fn claimed_by<D: Domain>(sampler: &dyn Sampler<Domain = D>, width: usize, height: usize) -> Vec<f64> {
    let domain = sampler.domain();
    crate::parallel::map(height, |row| {
        (0..width)
            .map(|column| {
                let (x, y) = ((column as f64 + 0.5) / width as f64, (row as f64 + 0.5) / height as f64);
                domain
                    .picture_location(x, y)
                    .map_or(f64::NAN, |l| sampler.density(&domain.point(l.patch, l.at).0))
            })
            .collect::<Vec<_>>()
    })
    .concat()
}
