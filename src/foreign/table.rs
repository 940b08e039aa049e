//! A density as a table over a domain, constant in each of its texels.
//!
//! Rows and columns follow the domain's chart: on the sphere row 0 begins at theta = 0 and column 0 at phi = 0, as in a lat-long map; on the hemisphere
//! theta ends at the horizon; on the disk rows are r and columns phi; on the square rows are y, from 0 up, and columns x. An interval and a discrete set have
//! one row.

use super::{Coordinates, Measure, MeasureFactor};
use crate::domain::{Cell, Knots, Location, Space};
use std::f64::consts::{PI, TAU};

/// What a table can't be made from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// Rows and columns don't fit the domain.
    #[error("a table of {rows} x {columns} numbers is none over the {domain}: {why}")]
    Shape {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
        /// The domain.
        domain: &'static str,
        /// Why not.
        why: String,
    },
    /// A number that is no density.
    #[error("row {row}, column {column} of the table is {value}; densities are finite and at least 0")]
    Texel {
        /// The row, from 0.
        row: usize,
        /// The column, from 0.
        column: usize,
        /// What stands there.
        value: f64,
    },
    /// All of it is 0.
    #[error("all of the table is 0")]
    Zero,
}

/// A table of densities.
#[derive(Clone, Debug)]
pub struct Table<D> {
    domain: D,
    rows: usize,
    columns: usize,
    values: Vec<f64>,
    measure: Measure,
    factor: MeasureFactor,
    integral: f64,
    /// The axes of the chart that rows and columns run along.
    axes: [usize; 2],
}

impl<D: Coordinates> Table<D> {
    /// From numbers row after row, per `measure`.
    ///
    /// # Errors
    /// If the shape is not one of the domain's, or a number is negative, infinite or NaN, or all are 0.
    pub fn new(
        domain: D,
        rows: usize,
        columns: usize,
        values: Vec<f64>,
        measure: Measure,
    ) -> Result<Self, TableError> {
        let shape =
            |why: &str| TableError::Shape { rows, columns, domain: domain.name(), why: why.to_owned() };
        match domain.name() {
            "triangle" => return Err(shape("its chart has no rows and columns that others would use")),
            "discrete" if rows != 1 || columns != domain.patches() => {
                return Err(shape(&format!("it has {} entries", domain.patches())));
            }
            "interval" if rows != 1 => return Err(shape("it has one row")),
            "interval" if !domain.measure().is_finite() => return Err(shape("the interval has no end")),
            _ if rows * columns != values.len() || values.is_empty() => {
                return Err(shape("their number is another"));
            }
            _ => {}
        }
        if let Some(i) = values.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            return Err(TableError::Texel { row: i / columns, column: i % columns, value: values[i] });
        }
        let (axes, factor) = (axes(&domain), measure.factor(&domain));
        let mut table = Self { domain, rows, columns, values, measure, factor, integral: 0.0, axes };
        table.integral = (0..table.values.len())
            .map(|i| table.values[i] * table.texel_measure(i / columns, i % columns))
            .sum();
        if table.integral > 0.0 { Ok(table) } else { Err(TableError::Zero) }
    }

    /// The integral.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Divided by its integral.
    pub fn normalised(mut self) -> Self {
        let integral = std::mem::replace(&mut self.integral, 1.0);
        self.values.iter_mut().for_each(|v| *v /= integral);
        self
    }

    /// The measure of a texel, in the table's own.
    fn texel_measure(&self, row: usize, column: usize) -> f64 {
        if self.domain.axes() == 0 {
            return if self.measure == Measure::Uniform { 1.0 / self.columns as f64 } else { 1.0 };
        }
        let ([down, across], count) = (self.axes, [self.rows as f64, self.columns as f64]);
        let mut cell = Cell::whole(&self.domain);
        (cell.low[down], cell.high[down]) = (row as f64 / count[0], (row + 1) as f64 / count[0]);
        (cell.low[across], cell.high[across]) = (column as f64 / count[1], (column + 1) as f64 / count[1]);
        let range = if self.domain.name() == "hemisphere" { 0.5 * PI } else { PI };
        let part = 1.0 / (count[0] * count[1]);
        match self.measure {
            Measure::Uv => part,
            Measure::ThetaPhi => range * TAU * part,
            Measure::RPhi => TAU * part,
            Measure::Uniform => self.domain.cell_measure(&cell) / self.domain.measure(),
            Measure::ProjectedSolidAngle => {
                // Half of the sine squared, which turns back at the horizon.
                let below = |v: f64| {
                    let theta = range * v;
                    let half = 0.5 * theta.sin().powi(2);
                    if theta > 0.5 * PI { 1.0 - half } else { half }
                };
                (below(cell.high[0]) - below(cell.low[0])) * TAU / count[1]
            }
            _ => self.domain.cell_measure(&cell),
        }
    }

    /// The density at a location, per the domain's own measure.
    #[inline]
    pub fn at(&self, location: &Location) -> f64 {
        self.converted(self.values[self.texel(location)], location)
    }

    /// The densities at many locations, in their order, appended to `out`.
    pub fn at_many(&self, locations: &[Location], out: &mut Vec<f64>) {
        // Texels are all over the memory: loops with nothing else in them wait for many at once.
        let mut texels = [0; 64];
        for locations in locations.chunks(texels.len()) {
            for (texel, location) in texels.iter_mut().zip(locations) {
                *texel = self.texel(location);
            }
            let start = out.len();
            out.extend(texels[..locations.len()].iter().map(|&texel| self.values[texel]));
            for (value, location) in out[start..].iter_mut().zip(locations) {
                *value = self.converted(*value, location);
            }
        }
    }

    /// Whether the texels of a cell, and what rounding makes of its borders, are positive.
    pub fn is_positive_over(&self, cell: &Cell) -> bool {
        if self.domain.axes() == 0 {
            return self.values[cell.patches.clone()].iter().all(|value| *value > 0.0);
        }
        let [down, across] = self.axes;
        let range = |axis: usize, n: usize| {
            let near = |x: f64| ((x * n as f64).max(0.0) as usize).min(n - 1);
            near(cell.low[axis] - ROUNDING)..=near(cell.high[axis] + ROUNDING)
        };
        range(down, self.rows).all(|row| {
            let texels = &self.values[row * self.columns..][..self.columns];
            texels[range(across, self.columns)].iter().all(|value| *value > 0.0)
        })
    }

    #[inline]
    fn texel(&self, location: &Location) -> usize {
        if self.domain.axes() == 0 {
            return location.patch;
        }
        let [row, column] = self.place(location);
        row * self.columns + column
    }

    /// Row and column.
    #[inline]
    fn place(&self, location: &Location) -> [usize; 2] {
        // Signed on the way: what converts to it is one instruction.
        let index = |x: f64, n: usize| ((x * n as f64) as i64 as usize).min(n - 1);
        let [down, across] = self.axes;
        [index(location.at[down], self.rows), index(location.at[across], self.columns)]
    }

    /// What stands in the table, per the domain's own measure.
    #[inline]
    fn converted(&self, value: f64, location: &Location) -> f64 {
        let converted = value * self.factor.at(location);
        if converted.is_finite() { converted } else { self.converted_beside(value, location) }
    }

    /// At a pole, where a density per (u, v) is infinite per solid angle: as in the middle of the texel, since all of its mass is finite.
    #[cold]
    fn converted_beside(&self, value: f64, location: &Location) -> f64 {
        let ([row, _], mut beside) = (self.place(location), *location);
        beside.at[self.axes[0]] = (row as f64 + 0.5) / self.rows as f64;
        value * self.factor.at(&beside)
    }

    /// The density at a point, per the domain's own measure; 0 outside.
    pub fn density(&self, point: &D::Point) -> f64 {
        self.domain.locate(point).map_or(0.0, |location| self.at(&location))
    }

    /// The least and the largest density that the texel of a point and those around it give there: what a density is that a table only samples.
    pub fn range(&self, point: &D::Point) -> [f64; 2] {
        let Ok(location) = self.domain.locate(point) else { return [0.0; 2] };
        if self.domain.axes() == 0 {
            return [self.at(&location); 2];
        }
        let [row, column] = self.place(&location);
        let rows = self.around(self.axes[0], row, self.rows);
        let columns = self.around(self.axes[1], column, self.columns);
        let values =
            rows.iter().flat_map(|row| columns.iter().map(move |column| row * self.columns + column));
        values.fold([f64::INFINITY, 0.0], |[low, high], texel| {
            let density = self.converted(self.values[texel], &location);
            [low.min(density), high.max(density)]
        })
    }

    /// An index along an axis of the chart, the one before and the one behind it, as far as there are any.
    fn around(&self, axis: usize, index: usize, count: usize) -> [usize; 3] {
        if self.domain.wraps(axis) {
            [(index + count - 1) % count, index, (index + 1) % count]
        } else {
            [index.saturating_sub(1), index, (index + 1).min(count - 1)]
        }
    }

    /// The lines between texels.
    pub fn knots(&self) -> Knots {
        grid(&self.domain, self.rows, self.columns)
    }
}

/// Of coordinates of a chart, more than enough.
const ROUNDING: f64 = 1e-14;

/// The axes of the chart that rows and columns run along.
fn axes(space: &dyn Space) -> [usize; 2] {
    if matches!(space.name(), "sphere" | "hemisphere" | "disk") { [0, 1] } else { [1, 0] }
}

/// The lines between the texels of a table of so many rows and columns.
pub(super) fn grid(space: &dyn Space, rows: usize, columns: usize) -> Knots {
    if space.axes() == 0 {
        return Knots::default();
    }
    let [rows, columns] = Knots::grid(rows, columns).axes;
    Knots { axes: if axes(space) == [0, 1] { [rows, columns] } else { [columns, rows] } }
}
