//! Where on the domain: the figures of every cell, and the rasters that pictures are made of.

use crate::domain::{Cell, Partition, Space};

/// What a cell of the finest scale counted.
#[derive(Clone, Debug, PartialEq)]
pub struct CellFigure {
    /// The cell.
    pub cell: Cell,
    /// Where it is, in words.
    pub place: String,
    /// Samples counted.
    pub observed: u64,
    /// Samples expected.
    pub expected: f64,
    /// Samples drawn in all.
    pub samples: u64,
    /// Where two samplers are compared, the samples drawn of the other: the expected count is then the share of these samples in the counts of both.
    /// Otherwise 0.
    pub others: u64,
}

impl CellFigure {
    /// The signed standardised residual (O - E) / sqrt(E (1 - E / n)): about standard normal if the sampler is right. In a comparison with m samples of
    /// another, the variance is m / (n + m) of that (Haberman 1973).
    pub fn residual(&self) -> f64 {
        let (n, m) = (self.samples as f64, self.others as f64);
        let free = if self.others > 0 { m / (n + m) } else { 1.0 };
        let variance = self.expected * (1.0 - self.expected / n) * free;
        let difference = self.observed as f64 - self.expected;
        if variance > 1e-9 * self.expected {
            difference / variance.sqrt()
        } else if difference.abs() <= 1e-6 * self.expected {
            0.0 // all samples are expected here, and all are here
        } else {
            difference.signum() * f64::INFINITY
        }
    }
}

/// Rasters of what was observed, expected and left over, row 0 on top; NaN where there is nothing to show.
#[derive(Clone, Debug)]
pub struct ResidualMap {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Density observed, averaged over each cell, per the domain's measure.
    pub observed: Vec<f64>,
    /// Density expected, averaged over each cell, per the domain's measure.
    pub expected: Vec<f64>,
    /// Signed standardised residual of each cell.
    pub residual: Vec<f64>,
    /// Which of the [cells](super::Examination::cells) it is.
    pub cell: Vec<Option<u32>>,
}

/// Draws a [`ResidualMap`] of any height; kept instead of the map, which few runs ask for.
pub(super) type Painter = Box<dyn Fn(usize) -> ResidualMap + Send + Sync>;

pub(super) fn painter(
    space: Box<dyn Space>,
    partition: Partition,
    cells: Vec<CellFigure>,
    cell_of_leaf: Vec<Option<usize>>,
) -> Painter {
    Box::new(move |height| {
        let measures: Vec<f64> = cells.iter().map(|c| space.cell_measure(&c.cell)).collect();
        let height = height.max(1);
        let width = ((height as f64 * space.picture_aspect()).round() as usize).max(1);
        let blank = vec![f64::NAN; width * height];
        let mut map = ResidualMap {
            width,
            height,
            observed: blank.clone(),
            expected: blank.clone(),
            cell: vec![None; width * height],
            residual: blank,
        };
        for i in 0..width * height {
            let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            let place = space.picture_location(x / width as f64, y / height as f64);
            let Some(cell) = place.and_then(|p| cell_of_leaf[partition.leaf_of(&p)]) else { continue };
            let figure = &cells[cell];
            let weight = 1.0 / (figure.samples as f64 * measures[cell]);
            map.observed[i] = figure.observed as f64 * weight;
            map.expected[i] = figure.expected * weight;
            map.residual[i] = figure.residual();
            map.cell[i] = u32::try_from(cell).ok();
        }
        map
    })
}
