//! Rasters of linear light: [`Picture`] (RGB) and [`Planes`] (any named channels).

use super::{Error, Shrink, resize};

/// A raster of linear RGB values, row 0 on top; at least one texel.
///
/// Nothing is assumed of the values: [`first_bad_texel`](Self::first_bad_texel) finds what cannot be radiance.
///
/// ```
/// use warpcheck::picture::Picture;
///
/// let picture = Picture::new(2, 1, vec![[0.0, 0.5, 1.0], [4.0, f32::NAN, 0.0]])?;
/// assert_eq!(picture.at(0, 0), [0.0, 0.5, 1.0]);
/// let bad = picture.first_bad_texel().unwrap();
/// assert_eq!((bad.column, bad.row, bad.channel), (1, 0, 'G'));
/// # Ok::<(), warpcheck::picture::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
}

/// A texel that no light can have: negative, infinite or not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadTexel {
    /// Column, from the left.
    pub column: usize,
    /// Row, from the top.
    pub row: usize,
    /// `'R'`, `'G'` or `'B'`.
    pub channel: char,
    /// The value found there.
    pub value: f32,
}

impl std::fmt::Display for BadTexel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "texel (column {}, row {}) has {} = {}", self.column, self.row, self.channel, self.value)
    }
}

impl Picture {
    /// A picture of `pixels` in row order, top row first.
    ///
    /// # Errors
    /// [`Error::Shape`] unless there are `width * height > 0` pixels.
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Result<Self, Error> {
        check_shape(width, height, pixels.len())?;
        Ok(Self { width, height, pixels })
    }

    /// A picture whose texel in column `x`, row `y` is `colour(x, y)`.
    ///
    /// # Panics
    /// If width or height is zero.
    #[track_caller]
    pub fn from_fn(width: usize, height: usize, mut colour: impl FnMut(usize, usize) -> [f32; 3]) -> Self {
        assert!(width > 0 && height > 0, "a picture has at least one texel, not {width} x {height}");
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| colour(x, y));
        Self { width, height, pixels: pixels.collect() }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All texels in row order.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// All texels in row order, to be changed.
    pub fn pixels_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.pixels
    }

    /// The texels, in row order.
    pub fn into_pixels(self) -> Vec<[f32; 3]> {
        self.pixels
    }

    /// The texel in column `x` of row `y`.
    ///
    /// # Panics
    /// Outside of the picture.
    #[track_caller]
    pub fn at(&self, x: usize, y: usize) -> [f32; 3] {
        assert!(x < self.width, "column {x} of a picture {} wide", self.width);
        self.pixels[y * self.width + x]
    }

    /// The first texel, in row order, with a negative, infinite or NaN channel.
    pub fn first_bad_texel(&self) -> Option<BadTexel> {
        self.pixels.iter().enumerate().find_map(|(i, texel)| {
            let channel = texel.iter().position(|v| !(v.is_finite() && *v >= 0.0))?;
            Some(BadTexel {
                column: i % self.width,
                row: i / self.width,
                channel: ['R', 'G', 'B'][channel],
                value: texel[channel],
            })
        })
    }

    /// Scaled to about `width` columns: enlarged by the largest whole factor that fits, or shrunk to exactly
    /// that width by a box filter; the aspect is kept.
    pub fn fit_width(&self, width: usize, shrink: Shrink) -> Self {
        let (width, height, pixels) =
            resize::fit(&self.pixels, self.width, self.height, width, |texels| match shrink {
                Shrink::Mean => resize::mean3(texels.map(|(t, w)| (t.map(f64::from), w))).map(|v| v as f32),
                Shrink::Max => texels
                    .map(|(t, _)| t)
                    .reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1]), a[2].max(b[2])])
                    .unwrap_or([0.0; 3]),
            });
        Self { width, height, pixels }
    }
}

/// Any number of named single-channel rasters of the same size, as an OpenEXR file holds them.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    width: usize,
    height: usize,
    planes: Vec<(String, Vec<f32>)>,
}

impl Planes {
    /// Planes of `width * height` values each, row 0 on top, sorted by name as OpenEXR wants it.
    ///
    /// # Errors
    /// [`Error::Shape`] if a plane has not `width * height > 0` values or there is no plane;
    /// [`Error::PlaneName`] if a name is empty, repeated, longer than 255 bytes or not printable ASCII.
    pub fn new(
        width: usize,
        height: usize,
        planes: impl IntoIterator<Item = (impl Into<String>, Vec<f32>)>,
    ) -> Result<Self, Error> {
        let mut planes: Vec<_> = planes.into_iter().map(|(name, values)| (name.into(), values)).collect();
        planes.sort_by(|a, b| a.0.cmp(&b.0));
        check_shape(width, height, planes.first().map_or(0, |(_, values)| values.len()))?;
        for (i, (name, values)) in planes.iter().enumerate() {
            check_shape(width, height, values.len())?;
            let problem = match name {
                _ if name.is_empty() => "it is empty",
                _ if name.len() > 255 => "it is longer than 255 bytes",
                _ if !name.bytes().all(|b| b.is_ascii_graphic() || b == b' ') => "it is not printable ASCII",
                _ if i > 0 && planes[i - 1].0 == *name => "it is taken",
                _ => continue,
            };
            return Err(Error::PlaneName { name: name.clone(), problem });
        }
        Ok(Self { width, height, planes })
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The names, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.planes.iter().map(|(name, _)| name.as_str())
    }

    /// The values of the plane called `name`, in row order.
    pub fn get(&self, name: &str) -> Option<&[f32]> {
        self.planes.iter().find(|(n, _)| n == name).map(|(_, values)| values.as_slice())
    }
}

impl From<&Picture> for Planes {
    /// The planes `B`, `G` and `R`.
    fn from(picture: &Picture) -> Self {
        let plane = |c: usize| picture.pixels.iter().map(|texel| texel[c]).collect();
        let planes = [("B", 2), ("G", 1), ("R", 0)].map(|(name, c)| (name.to_owned(), plane(c)));
        Self { width: picture.width, height: picture.height, planes: planes.into() }
    }
}

pub(super) fn check_shape(width: usize, height: usize, texels: usize) -> Result<(), Error> {
    match width.checked_mul(height) {
        Some(expected) if expected == texels && texels > 0 => Ok(()),
        _ => Err(Error::Shape { width, height, texels }),
    }
}
