//! The pixels of a domain's picture, for histograms.

use super::LatLong;
use std::sync::OnceLock;

/// A grid of pixels over a domain's picture, row 0 on top.
///
/// ```
/// use warpcheck::domain::{Domain, Pixels, Sphere};
/// let pixels = Pixels::new(8, 4);
/// let index = Sphere.pixel(&pixels, &glam::DVec3::new(0.6, 0.1, -0.79).normalize()).unwrap();
/// assert_eq!(index, Some(3 * 8)); // theta = 142 degrees: the last row; phi a little over 0
/// ```
#[derive(Clone, Debug)]
pub struct Pixels {
    width: usize,
    height: usize,
    lat_long: OnceLock<LatLong>,
}

impl Pixels {
    /// So many columns and rows.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, lat_long: OnceLock::new() }
    }

    /// The pixel, row after row, of a place in the picture, x to the right and y down in `[0, 1]`; `None` for NaN: an atom has no place.
    #[inline]
    pub fn at(&self, [x, y]: [f64; 2]) -> Option<usize> {
        if x.is_nan() {
            return None;
        }
        let column = ((x * self.width as f64) as u32 as usize).min(self.width - 1);
        let row = ((y * self.height as f64) as u32 as usize).min(self.height - 1);
        Some(row * self.width + column)
    }

    /// The pixel of a direction in a latitude-longitude picture.
    #[inline]
    pub(super) fn of_direction(&self, w: glam::DVec3) -> usize {
        let lat_long = self.lat_long.get_or_init(|| LatLong::new(self.width, self.height));
        let (column, row, _) = lat_long.texel_of(w);
        row * self.width + column
    }
}
