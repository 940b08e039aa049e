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

    fn lat_long(&self) -> &LatLong {
        self.lat_long.get_or_init(|| LatLong::new(self.width, self.height))
    }

    /// The pixel of a direction in a latitude-longitude picture.
    #[inline]
    pub(super) fn of_direction(&self, w: glam::DVec3) -> usize {
        let (column, row, _) = self.lat_long().texel_of(w);
        row * self.width + column
    }

    /// [`of_direction`](Self::of_direction) for the directions with these x, y and z.
    #[inline]
    pub(super) fn of_directions<const N: usize>(&self, w: &[[f64; N]; 3]) -> [usize; N] {
        self.lat_long().texels_of(w).map(|(column, row)| row * self.width + column)
    }
}

/// Points that [`Domain::count_pixels`](super::Domain::count_pixels) finds no pixel for, atoms aside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uncounted {
    /// How many are `None`.
    pub none: u64,
    /// How many lie outside of the domain.
    pub outside: u64,
}
