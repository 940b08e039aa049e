//! Histograms of samples over the picture of a domain, as densities.
//!
//! Every sample falls into a pixel of the domain's picture (latitude-longitude for the sphere, an equal-area disk for the
//! hemisphere, …). A pixel's count over the number of samples and over the pixel's measure is the density there, which is to be compared with
//! the density that the sampler claims.

use crate::domain::{Domain, Pixels, Space};
use crate::random::{fill_unit, stream};
use crate::sampler::{Sampler, fill_vec};
use crate::verify::{Drawn, Settings};

const SHARD: u64 = 1 << 16;
/// Shards between two looks at the clock, at least; …
const BATCH: u64 = 32;
/// … so many samples a pixel, …
const FILLED: u64 = 16;
/// … and no more than a count of 32 bits holds.
const MOST: u64 = u32::MAX as u64 / SHARD;
/// Samples that are drawn at a time.
const CHUNK: usize = 1024;
/// Sub-pixels along an axis that measure how much of a pixel the domain covers.
const COVERAGE: usize = 4;

/// Counts of one thread: half as wide as those that are kept, since they are hit in no order and caches are small.
struct Counts {
    pixels: Vec<u32>,
    samples: u64,
    rejected: u64,
    outside: u64,
}

impl Counts {
    fn new(cells: usize) -> Self {
        Self { pixels: vec![0; cells], samples: 0, rejected: 0, outside: 0 }
    }

    fn draw<S: Sampler>(&mut self, sampler: &S, pixels: &Pixels, seed: u64, shard: u64, count: u64) {
        let (domain, dimensions) = (sampler.domain(), sampler.dimensions());
        let mut rng = stream(seed, "histogram", shard);
        let mut xi = vec![0.0; dimensions * CHUNK];
        let mut samples = Vec::with_capacity(CHUNK);
        self.samples += count;
        let mut left = count as usize;
        while left > 0 {
            let drawn = left.min(CHUNK);
            left -= drawn;
            let xi = &mut xi[..drawn * dimensions];
            fill_unit(&mut rng, xi);
            fill_vec(sampler, xi, &mut samples);
            for sample in &samples {
                match sample.as_ref().map(|sample| domain.pixel(pixels, &sample.point)) {
                    None => self.rejected += 1,
                    Some(Err(_)) => self.outside += 1,
                    Some(Ok(Some(pixel))) => self.pixels[pixel] += 1,
                    // An atom: its mass has no place in the picture.
                    Some(Ok(None)) => {}
                }
            }
        }
    }

    fn merge(&mut self, other: Self) {
        self.pixels.iter_mut().zip(&other.pixels).for_each(|(a, b)| *a += b);
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
        let cells = width * height;
        let empty = Self { width, height, counts: vec![0; cells], samples: 0, rejected: 0, outside: 0 };
        let pixels = Pixels::new(width, height);
        let mut total = empty;
        let shards = settings.samples.div_ceil(SHARD);
        // Adding up the threads' counts must cost less than filling them.
        let batch = BATCH.max(FILLED * cells as u64 / SHARD).min(MOST);
        let mut next = 0;
        while next < shards && !(settings.stopped() && next > 0) {
            let batch = batch.min(shards - next);
            let counted = crate::parallel::fold(
                batch as usize,
                || Counts::new(cells),
                |counts, i| {
                    let shard = next + i as u64;
                    let samples = SHARD.min(settings.samples - shard * SHARD);
                    counts.draw(sampler, &pixels, settings.seed, shard, samples);
                },
                Counts::merge,
            );
            total.add(&counted);
            next += batch;
            if let Some(progress) = &settings.progress {
                progress(Drawn { samples: total.samples, of: settings.samples });
            }
        }
        total
    }

    fn add(&mut self, other: &Counts) {
        self.counts.iter_mut().zip(&other.pixels).for_each(|(a, &b)| *a += u64::from(b));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{BarycentricWarp, CosineHemisphere, TriangleWarp};

    fn agrees<S: Sampler>(sampler: &S, size: usize) {
        let settings = Settings { samples: 2_000_000, seed: 5, ..Settings::default() };
        let histogram = Histogram::draw(sampler, size, size, &settings);
        let (drawn, claimed) = (histogram.density(&sampler.domain()), claimed_density(sampler, size, size));
        let (mut sum, mut cells) = (0.0, 0);
        for (i, (a, b)) in drawn.iter().zip(&claimed).enumerate() {
            if b.is_nan() || histogram.counts[i] < 2000 {
                continue;
            }
            sum += ((a - b) / b).powi(2) * histogram.counts[i] as f64;
            cells += 1;
        }
        // Pixels on the border are measured coarsely; those inside have a chi-square of about 1 each.
        assert!(cells > size && sum / f64::from(cells as u32) < 3.0, "{sum} over {cells} pixels");
    }

    #[test]
    fn densities_agree_with_what_is_claimed() {
        agrees(&CosineHemisphere, 24);
        agrees(&BarycentricWarp::new(TriangleWarp::SquareRoot, 3.0).unwrap(), 24);
    }
}
