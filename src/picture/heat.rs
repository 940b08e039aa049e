//! Heat maps: a figure a cell, drawn as colours.

use super::raster::check_shape;
use super::{Canvas, ColourMap, Error, Legend, Scale, Shrink, resize};

/// A raster of figures, row 0 on top; at least one cell. NaN marks a cell outside of the domain.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    width: usize,
    height: usize,
    values: Vec<f64>,
}

impl Field {
    /// A field of `values` in row order, top row first.
    ///
    /// # Errors
    /// [`Error::Shape`] unless there are `width * height > 0` values.
    pub fn new(width: usize, height: usize, values: Vec<f64>) -> Result<Self, Error> {
        check_shape(width, height, values.len())?;
        Ok(Self { width, height, values })
    }

    /// A field with `figure(x, y)` in column `x` of row `y`.
    ///
    /// # Panics
    /// If width or height is zero.
    #[track_caller]
    pub fn from_fn(width: usize, height: usize, mut figure: impl FnMut(usize, usize) -> f64) -> Self {
        assert!(width > 0 && height > 0, "a field has at least one cell, not {width} x {height}");
        let values = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| figure(x, y));
        Self { width, height, values: values.collect() }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All figures in row order.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The smallest and the largest finite figure; `None` if there is none.
    pub fn extent(&self) -> Option<(f64, f64)> {
        let finite = self.values.iter().copied().filter(|v| v.is_finite());
        finite.map(|v| (v, v)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// Scaled to about `width` columns, as [`Picture::fit_width`](super::Picture::fit_width); a cell that
    /// becomes one with others counts only if it is inside of the domain.
    pub fn fit_width(&self, width: usize, shrink: Shrink) -> Self {
        let (width, height, values) = resize::fit(&self.values, self.width, self.height, width, |cells| {
            let inside = cells.filter(|(v, _)| !v.is_nan());
            match shrink {
                Shrink::Mean => {
                    let (sum, weight) = inside.fold((0.0, 0.0), |(s, t), (v, w)| (s + v * w, t + w));
                    sum / weight
                }
                Shrink::Max => inside
                    .map(|(v, _)| v)
                    .reduce(|a, b| if b.abs() > a.abs() { b } else { a })
                    .unwrap_or(f64::NAN),
            }
        });
        Self { width, height, values }
    }
}

/// How a field is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heat {
    /// The colours.
    pub map: ColourMap,
    /// The figures along them.
    pub scale: Scale,
}

/// Cells outside of the domain: a faint chequerboard that no colour map has.
const OUTSIDE: [[u8; 3]; 2] = [[44, 46, 51], [52, 54, 60]];

impl Heat {
    /// For counts: [`ColourMap::Inferno`], logarithmic from 1 to the largest.
    pub fn counts(field: &Field) -> Self {
        let max = field.extent().map_or(1.0, |(_, max)| max);
        Self { map: ColourMap::Inferno, scale: Scale::Log { floor: 1.0, max: max.max(10.0) } }
    }

    /// For any other figure: [`ColourMap::Viridis`], linear from the smallest to the largest.
    pub fn linear(field: &Field) -> Self {
        let (min, max) = field.extent().unwrap_or((0.0, 1.0));
        Self { map: ColourMap::Viridis, scale: Scale::Linear { min, max } }
    }

    /// For residuals, in standard deviations: [`ColourMap::Diverging`], clipped at `limit` (5, say) both ways.
    pub fn residuals(limit: f64) -> Self {
        Self { map: ColourMap::Diverging, scale: Scale::Symmetric { limit } }
    }

    /// One pixel a cell.
    pub fn paint(self, field: &Field) -> Canvas {
        let pixels = field.values.iter().enumerate().map(|(i, &value)| {
            if value.is_nan() {
                OUTSIDE[(i % field.width + i / field.width) % 2]
            } else {
                self.map.colour(self.scale.position(value))
            }
        });
        Canvas::new(field.width, field.height, pixels.collect()).expect("a field's own shape")
    }

    /// What the colours mean; `unit` says what is counted or measured.
    pub fn legend(self, unit: impl Into<String>) -> Legend {
        Legend { map: self.map, scale: self.scale, unit: unit.into() }
    }
}
