//! Sums over samples, and what is read from them.
//!
//! Sums of radiance and of its square, in `f64`. An `f32` sum stalls when it is 2^24 times a sample; here 1e8
//! samples of equal size lose at most 1e-8 of their mean, typically 1e-12. The variance is
//! (S_2 - S_1^2 / n)/(n - 1), which resolves standard deviations down to 1e-6 of the mean (`f32` radiance does
//! not go far below); where rounding would make it negative it is 0.

use crate::picture::Picture;
use glam::DVec3;

/// What a pixel has seen: linear RGB radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    sum: DVec3,
    squares: DVec3,
    count: u64,
}

impl Pixel {
    /// Adds a sample; it has to be finite.
    #[inline]
    pub fn add(&mut self, radiance: DVec3) {
        self.sum += radiance;
        self.squares += radiance * radiance;
        self.count += 1;
    }

    /// Adds all that `other` has seen.
    pub fn merge(&mut self, other: &Self) {
        self.sum += other.sum;
        self.squares += other.squares;
        self.count += other.count;
    }

    /// The sums of the channels and of their squares, and the number of samples: everything.
    pub(super) fn sums(&self) -> ([f64; 6], u64) {
        let ([a, b, c], [d, e, f]) = (self.sum.to_array(), self.squares.to_array());
        ([a, b, c, d, e, f], self.count)
    }

    pub(super) fn from_sums([a, b, c, d, e, f]: [f64; 6], count: u64) -> Self {
        Self { sum: DVec3::new(a, b, c), squares: DVec3::new(d, e, f), count }
    }

    /// How many samples.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The mean of each channel; 0 without samples.
    pub fn mean(&self) -> [f64; 3] {
        (self.sum / self.count.max(1) as f64).to_array()
    }

    /// The standard error of each mean; infinite below two samples, which say nothing about it.
    pub fn standard_error(&self) -> [f64; 3] {
        if self.count < 2 {
            return [f64::INFINITY; 3];
        }
        let n = self.count as f64;
        let spread = (self.squares - self.sum * self.sum / n).max(DVec3::ZERO);
        (spread / (n - 1.0) / n).map(f64::sqrt).to_array()
    }
}

/// The pixels of a picture, row 0 on top.
///
/// ```
/// use warpcheck::estimator::Film;
/// let mut film = Film::new(2, 1);
/// for x in [1.0, 3.0] {
///     film.add(0, 0, [x, 0.0, 0.0].into());
/// }
/// assert_eq!(film.pixel(0, 0).mean(), [2.0, 0.0, 0.0]);
/// assert_eq!(film.pixel(0, 0).standard_error(), [1.0, 0.0, 0.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: usize,
    height: usize,
    pixels: Vec<Pixel>,
}

impl Film {
    /// A film that has seen nothing.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![Pixel::default(); width * height] }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row after row.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    pub(super) fn pixels_mut(&mut self) -> &mut [Pixel] {
        &mut self.pixels
    }

    /// The pixel in column `x` of row `y`.
    pub fn pixel(&self, x: usize, y: usize) -> &Pixel {
        assert!(x < self.width, "column {x} of {}", self.width);
        &self.pixels[y * self.width + x]
    }

    /// Adds a sample of finite radiance to a pixel.
    pub fn add(&mut self, x: usize, y: usize, radiance: DVec3) {
        assert!(x < self.width, "column {x} of {}", self.width);
        self.pixels[y * self.width + x].add(radiance);
    }

    /// Adds all that another film of the same size has seen.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!((self.width, self.height), (other.width, other.height), "films of different sizes");
        self.pixels.iter_mut().zip(&other.pixels).for_each(|(a, b)| a.merge(b));
    }

    /// How far the picture is from its limit: the root of the mean squared standard error of the pixels' luminance, over their mean
    /// luminance. Infinite below two samples a pixel, and without light.
    ///
    /// The channels of a sample are taken as fully correlated, so that the error of the luminance is the luminance of the errors: too careful
    /// rather than too bold. What no sample has seen is not in it, as in any standard error.
    pub fn relative_error(&self) -> f64 {
        let luminance = |[r, g, b]: [f64; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let n = self.pixels.len() as f64;
        let squares = self.pixels.iter().map(|p| luminance(p.standard_error()).powi(2)).sum::<f64>() / n;
        let mean = self.pixels.iter().map(|p| luminance(p.mean())).sum::<f64>() / n;
        if mean > 0.0 { squares.sqrt() / mean } else { f64::INFINITY }
    }

    /// Whether no sample has met any light.
    pub fn is_black(&self) -> bool {
        self.pixels.iter().all(|p| p.mean() == [0.0; 3])
    }

    /// The mean radiance as a picture.
    pub fn picture(&self) -> Picture {
        Picture::from_fn(self.width, self.height, |x, y| self.pixel(x, y).mean().map(|v| v as f32))
    }

    /// Means over blocks of `size` x `size` pixels, smaller at the right and lower border.
    ///
    /// # Panics
    /// If `size` is 0.
    pub fn blocks(&self, size: usize) -> Blocks {
        let (columns, rows) = (self.width.div_ceil(size), self.height.div_ceil(size));
        let mut blocks = Blocks {
            size,
            columns,
            rows,
            means: vec![[0.0; 3]; columns * rows],
            standard_errors: vec![[0.0; 3]; columns * rows],
            effective: vec![[0.0; 3]; columns * rows],
        };
        for block in 0..columns * rows {
            let pixels = pixels_of_block(block, size, [self.width, self.height]);
            let number = pixels.clone().count() as f64;
            let (mut mean, mut variance) = (DVec3::ZERO, DVec3::ZERO);
            let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
            for pixel in pixels.map(|(x, y)| self.pixel(x, y)) {
                mean += DVec3::from(pixel.mean());
                variance += DVec3::from(pixel.standard_error()).map(|e| e * e);
                sum += pixel.sum;
                squares += pixel.squares;
            }
            blocks.means[block] = (mean / number).to_array();
            blocks.standard_errors[block] = (variance.map(f64::sqrt) / number).to_array();
            // Without light no sample counts.
            blocks.effective[block] = (sum * (sum / squares.max(DVec3::splat(f64::MIN_POSITIVE)))).to_array();
        }
        blocks
    }
}

/// Columns and rows of the pixels of a block of `size` x `size` in a picture of some width and height, row after row.
pub(super) fn pixels_of_block(
    block: usize,
    size: usize,
    [width, height]: [usize; 2],
) -> impl Iterator<Item = (usize, usize)> + Clone {
    let columns = width.div_ceil(size);
    let (left, top) = (block % columns * size, block / columns * size);
    let (right, bottom) = ((left + size).min(width), (top + size).min(height));
    (top..bottom).flat_map(move |y| (left..right).map(move |x| (x, y)))
}

/// Means over square blocks of pixels, row after row, linear RGB radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocks {
    /// Pixels along a side of a block.
    pub size: usize,
    /// Blocks in a row.
    pub columns: usize,
    /// Rows of blocks.
    pub rows: usize,
    /// Mean over the block.
    pub means: Vec<[f64; 3]>,
    /// Its standard error, from the variances of the pixels: the differences between pixels are no error.
    /// Infinite if a pixel has fewer than two samples.
    pub standard_errors: Vec<[f64; 3]>,
    /// How many samples the mean hangs on: (sum x)^2 / sum x^2 over all samples x of the block (Kish 1965), k
    /// if k of them have the same radiance and the others none. Few mean that the standard error itself can't
    /// be trusted. Infinite where unknown.
    pub effective: Vec<[f64; 3]>,
}
