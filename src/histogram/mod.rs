//! Histograms of samples over the picture of a domain, as densities.
//!
//! Every sample falls into a pixel of the domain's picture (latitude-longitude for the sphere, an equal-area disk for the
//! hemisphere, …). A pixel's count over the number of samples and over the pixel's measure is the density there, which is to be compared with
//! the density that the sampler claims.

use crate::domain::{Domain, Space};
use crate::random::{fill_unit, stream};
use crate::sampler::Sampler;
use crate::verify::{Drawn, Settings};

const SHARD: u64 = 1 << 16;
/// Shards between two looks at the clock.
const BATCH: u64 = 32;
/// Sub-pixels along an axis that measure how much of a pixel the domain covers.
const COVERAGE: usize = 4;

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
        let empty =
            Self { width, height, counts: vec![0; width * height], samples: 0, rejected: 0, outside: 0 };
        let mut total = empty.clone();
        let shards = settings.samples.div_ceil(SHARD);
        let mut next = 0;
        while next < shards && !(settings.stopped() && next > 0) {
            let batch = BATCH.min(shards - next);
            let merged = crate::parallel::fold(
                batch as usize,
                || empty.clone(),
                |sum, i| {
                    let shard = next + i as u64;
                    sum.draw_shard(
                        sampler,
                        settings.seed,
                        shard,
                        SHARD.min(settings.samples - shard * SHARD),
                    );
                },
                Self::merge,
            );
            total.merge(merged);
            next += batch;
            if let Some(progress) = &settings.progress {
                progress(Drawn { samples: total.samples, of: settings.samples });
            }
        }
        total
    }

    fn draw_shard<S: Sampler>(&mut self, sampler: &S, seed: u64, shard: u64, count: u64) {
        let domain = sampler.domain();
        let (width, height) = (self.width as f64, self.height as f64);
        let mut rng = stream(seed, "histogram", shard);
        let mut xi = vec![0.0; sampler.dimensions()];
        self.samples += count;
        for _ in 0..count {
            fill_unit(&mut rng, &mut xi);
            let Some(sample) = sampler.sample(&xi) else {
                self.rejected += 1;
                continue;
            };
            let Ok(location) = domain.locate(&sample.point) else {
                self.outside += 1;
                continue;
            };
            let [x, y] = domain.picture_position(&location);
            if x.is_nan() {
                continue; // an atom: its mass has no place in the picture
            }
            let column = ((x * width) as usize).min(self.width - 1);
            let row = ((y * height) as usize).min(self.height - 1);
            self.counts[row * self.width + column] += 1;
        }
    }

    fn merge(&mut self, other: Self) {
        self.counts.iter_mut().zip(&other.counts).for_each(|(a, b)| *a += b);
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
