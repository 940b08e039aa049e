//! [`Canvas`]: display-ready bytes to draw on.

use super::raster::check_shape;
use super::tone::{decode_srgb, encode_srgb, quantise};
use super::{Error, resize};

/// A raster of sRGB bytes, row 0 on top; at least one pixel. Drawing outside of it is clipped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// A canvas of `pixels` in row order, top row first.
    ///
    /// # Errors
    /// [`Error::Shape`] unless there are `width * height > 0` pixels.
    pub fn new(width: usize, height: usize, pixels: Vec<[u8; 3]>) -> Result<Self, Error> {
        check_shape(width, height, pixels.len())?;
        Ok(Self { width, height, pixels })
    }

    /// A canvas of one colour (of at least 1 x 1).
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels in row order.
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }

    /// Sets the pixel in column `x` of row `y`, if there is one.
    pub fn set(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if x < self.width && y < self.height {
            self.pixels[y * self.width + x] = colour;
        }
    }

    /// Fills `width` by `height` pixels from column `x`, row `y` on.
    pub fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, colour: [u8; 3]) {
        for row in y..(y + height).min(self.height) {
            for column in x..(x + width).min(self.width) {
                self.set(column, row, colour);
            }
        }
    }

    /// Copies `picture` here, its top left corner to column `x` of row `y`.
    pub fn paste(&mut self, picture: &Self, x: usize, y: usize) {
        for (row, pixels) in picture.pixels.chunks_exact(picture.width).enumerate() {
            for (column, &pixel) in pixels.iter().enumerate() {
                self.set(x + column, y + row, pixel);
            }
        }
    }

    /// Scaled to about `width` columns: enlarged by the largest whole factor that fits, or shrunk to exactly
    /// that width by a box filter that averages light, not bytes; the aspect is kept.
    pub fn fit_width(&self, width: usize) -> Self {
        let linear: [f64; 256] = std::array::from_fn(|b| f64::from(decode_srgb(b as f32 / 255.0)));
        let (width, height, pixels) = resize::fit(&self.pixels, self.width, self.height, width, |texels| {
            resize::mean3(texels.map(|(t, w)| (t.map(|b| linear[usize::from(b)]), w)))
                .map(|v| quantise(encode_srgb(v as f32)))
        });
        Self { width, height, pixels }
    }
}
