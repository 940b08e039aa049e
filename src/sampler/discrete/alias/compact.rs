//! What is read of an alias table whose cells don't fit into a cache: as little memory as answers nearly every search. Only a step that this can't tell its
//! entry is told it by the cell itself, so every answer is that of the cell.
//!
//! *Halves* of cells, 4 bytes each, have the alias and the first bits of theta, as many as there is place for: of a table of 2^22 entries one step in 2^10 begins with
//! the very same bits.
//!
//! Where these don't fit either, *lines* of the cache hold 28 cells each, of 2 bytes: 8 bits of theta, and how far the alias lies behind one of two entries,
//! of which the line tells the numbers. The sweep that made the table is why that is enough. The alias of a heavy entry's cell is the next heavy entry,
//! which lies in the same line or soon after; those of light cells go up from cell to cell, and 28 of them use up no more than a few
//! dozen entries, wherever these are. One step in 2^8, and those of an alias that is too far behind, ask the cell.

use super::{AliasCells, Cells, PIECE};
use crate::pages::Pages;
use crate::parallel;
use crate::sampler::discrete::{in_wide_batches, step_of};
use std::hint::select_unpredictable;

/// Bytes of cells from which on half as many are read quicker.
const MANY: usize = 1 << 20;
/// Bytes of cells from which on a quarter as many are.
const TOO_MANY: usize = 1 << 26;
/// Steps searched together.
const WIDE: usize = 128;

/// Beside the cells of a table.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Compact {
    Halves(Halves),
    Lines(Lines),
}

impl Compact {
    /// None for cells that are few enough themselves.
    pub(super) fn new(cells: &AliasCells) -> Option<Self> {
        match cells.bytes() {
            ..MANY => None,
            MANY..TOO_MANY => Some(Self::Halves(Halves::new(cells))),
            TOO_MANY.. => Some(Self::Lines(Lines::new(cells))),
        }
    }

    /// The entries of the upper 53 bits of each number.
    pub(super) fn indices(&self, cells: &AliasCells, bits: &[u64], out: &mut [u32]) {
        let cells = Cells { cells: &cells.cells, mask: cells.mask };
        // The same for both, whose batches are compiled at two widths each.
        macro_rules! search {
            ($form:ident) => {
                in_wide_batches::<WIDE, _, _>(
                    bits,
                    out,
                    |bits, out| *out = $form.batch(cells, bits),
                    |bits, out| *out = $form.batch(cells, bits),
                    |bits| cells.batch(&[bits])[0],
                )
            };
        }
        match self {
            Self::Halves(halves) => search!(halves),
            Self::Lines(lines) => search!(lines),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Halves(Halves { cells, .. }) => size_of_val(&**cells),
            Self::Lines(Lines { lines }) => size_of_val(&**lines),
        }
    }
}

/// The first halves of cells.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Halves {
    /// The first bits of theta, and the alias in the lower ones.
    cells: Pages<u32>,
    /// The bits of the alias.
    mask: u32,
}

impl Halves {
    fn new(cells: &AliasCells) -> Self {
        let mask = u32::try_from(cells.cells.len().next_power_of_two() - 1).expect("fewer than 2^32 entries");
        let mut halves = Pages::zeros(cells.cells.len());
        parallel::chunks_mut(&mut halves, PIECE, |piece, halves| {
            for (half, &cell) in halves.iter_mut().zip(&cells.cells[piece * PIECE..]) {
                *half = (cell >> 32) as u32 & !mask | (cell & cells.mask) as u32;
            }
        });
        Self { cells: halves, mask }
    }

    #[inline(always)]
    fn batch<const N: usize>(&self, cells: Cells<'_>, bits: &[u64; N]) -> [u32; N] {
        let halves = &*self.cells;
        let (mut own, mut lo, mut packed, mut out) = ([0; N], [0; N], [0; N], [0; N]);
        for i in 0..N {
            let product = u128::from(step_of(bits[i]) << 11) * halves.len() as u128;
            (own[i], lo[i]) = ((product >> 64) as u32, (product as u64 >> 32) as u32 & !self.mask);
            packed[i] = halves[own[i] as usize];
        }
        // Seldom one of so many: whether there is any is told by all at once.
        let mut unsure = false;
        for i in 0..N {
            let theta = packed[i] & !self.mask;
            out[i] = if lo[i] < theta { own[i] } else { packed[i] & self.mask };
            unsure |= lo[i] == theta;
        }
        if unsure {
            for i in 0..N {
                if lo[i] == packed[i] & !self.mask {
                    out[i] = cells.batch(&[bits[i]])[0];
                }
            }
        }
        out
    }
}

/// Numbers in a line of 64 bytes.
const LINE: usize = 16;
/// Cells in a line, behind its two entries.
const IN_LINE: usize = 28;
/// The bits of how far an alias is, all of them set if it is farther.
const FAR: u32 = 127;
/// Set where the alias counts from the line's own first entry.
const NEAR: u32 = 128;

/// The beginnings of cells by lines: the least of the aliases that are nowhere near, the first cell of the line, and the cells, two in each number.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lines {
    lines: Pages<u32>,
}

impl Lines {
    fn new(cells: &AliasCells) -> Self {
        let alias = |cell: usize| (cells.cells[cell] & cells.mask) as u32;
        let mut lines = Pages::zeros(cells.cells.len().div_ceil(IN_LINE) * LINE);
        parallel::chunks_mut(&mut lines, PIECE, |piece, lines| {
            for (number, line) in (piece * PIECE / LINE..).zip(lines.chunks_exact_mut(LINE)) {
                let first = number * IN_LINE;
                let range = first..cells.cells.len().min(first + IN_LINE);
                let near = |alias: u32| alias.checked_sub(first as u32).filter(|&far| far < FAR);
                let least =
                    range.clone().map(alias).filter(|&alias| near(alias).is_none()).min().unwrap_or(0);
                (line[0], line[1]) = (least, first as u32);
                for (slot, cell) in range.enumerate() {
                    let behind = match near(alias(cell)) {
                        Some(far) => NEAR | far,
                        None => (alias(cell) - least).min(FAR),
                    };
                    let theta = (cells.cells[cell] >> 56) as u32;
                    line[2 + slot / 2] |= (theta << 8 | behind) << (16 * (slot % 2));
                }
            }
        });
        Self { lines }
    }

    #[inline(always)]
    fn batch<const N: usize>(&self, cells: Cells<'_>, bits: &[u64; N]) -> [u32; N] {
        let lines = &*self.lines;
        let (mut own, mut lo, mut place, mut pair, mut out) = ([0; N], [0; N], [0; N], [0; N], [0; N]);
        for i in 0..N {
            let product = u128::from(step_of(bits[i]) << 11) * cells.cells.len() as u128;
            (own[i], lo[i]) = ((product >> 64) as u32, (product as u64 >> 56) as u8);
            // Among halves of numbers, of which each line has four before its cells.
            place[i] = (own[i] as usize + own[i] as usize / IN_LINE * 4 + 4) / 2;
        }
        // Nothing else between the loads, or fewer of them are under way.
        for i in 0..N {
            pair[i] = lines[place[i]];
        }
        let (mut unsure, mut count) = ([0_u8; N], 0);
        const { assert!(N <= 1 << u8::BITS) };
        for i in 0..N {
            // A line's first cell has an even number.
            let cell = pair[i] >> (own[i] % 2 * 16);
            let (theta, far) = ((cell >> 8) as u8, cell & FAR);
            // An address, and not a choice that nobody could foresee.
            let behind = lines[place[i] & !(LINE - 1) | usize::from(cell & NEAR != 0)];
            out[i] = select_unpredictable(lo[i] < theta, own[i], behind.wrapping_add(far));
            unsure[count] = i as u8;
            count += usize::from((lo[i] == theta) | (far == FAR));
        }
        for &i in &unsure[..count] {
            out[usize::from(i)] = cells.batch(&[bits[usize::from(i)]])[0];
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::super::DiscreteAlias;
    use super::*;
    use crate::random::{stream, unit_f64};
    use rand::Rng;

    /// Both forms and the cells, at both ends of all parts of some cells and in between.
    fn same(table: &DiscreteAlias, name: &str) {
        let entries = table.len();
        let mut rng = stream(3, "alias", 0);
        let cells = (0..entries).step_by(if entries > 10_000 { 7 } else { 1 });
        let borders = cells.flat_map(|cell| table.cells.borders(cell));
        let steps = borders.flat_map(|b| [b.saturating_sub(1), b]).filter(|&step| step < 1 << 53);
        let mut bits: Vec<u64> = steps.map(|step| step << 11).collect();
        bits.extend((0..100_000).map(|_| rng.next_u64()));
        let (mut quick, mut sure) = (vec![0; bits.len()], vec![0; bits.len()]);
        table.cells.indices(&bits, &mut sure);
        for compact in [Compact::Halves(Halves::new(&table.cells)), Compact::Lines(Lines::new(&table.cells))]
        {
            compact.indices(&table.cells, &bits, &mut quick);
            assert!(quick == sure, "{entries} {name}");
        }
    }

    #[test]
    fn compact_cells_answer_as_the_cells_do() {
        let mut rng = stream(3, "alias", 0);
        for entries in [1, 27, 28, 29, 1000, 131_072, 131_073, 200_000, 1 << 18] {
            let weights: Vec<f64> = (0..entries).map(|_| 10.0_f64.powf(6.0 * unit_f64(&mut rng))).collect();
            same(&DiscreteAlias::new(&weights).unwrap(), "uneven");
        }
    }

    /// Heavy entries that are rare, all at one end, or in runs, so that aliases lie far apart, before their cells or a long way behind.
    #[test]
    fn nor_does_it_matter_where_heavy_entries_are() {
        let heavy: [(&str, fn(usize) -> bool); 4] = [
            ("one in 200", |i| i % 200 == 77),
            ("first", |i| i < 100),
            ("last", |i| i >= 19_900),
            ("runs", |i| i / 300 % 7 == 3),
        ];
        for (name, heavy) in heavy {
            let weights: Vec<f64> =
                (0..20_000).map(|i| if heavy(i) { 100.0 + (i % 13) as f64 } else { 0.1 }).collect();
            same(&DiscreteAlias::new(&weights).unwrap(), name);
        }
    }

    /// What the lines are for: of uneven weights next to no alias is too far away.
    #[test]
    fn lines_tell_nearly_every_alias() {
        let mut rng = stream(4, "alias", 0);
        let weights: Vec<f64> = (0..1 << 18).map(|_| 10.0_f64.powf(4.0 * unit_f64(&mut rng))).collect();
        let lines = Lines::new(&DiscreteAlias::new(&weights).unwrap().cells);
        let cells = lines
            .lines
            .chunks(LINE)
            .flat_map(|line| &line[2..])
            .flat_map(|pair| [pair & FAR, pair >> 16 & FAR]);
        let far = cells.filter(|&far| far == FAR).count();
        assert!(far < weights.len() / 1000, "{far}");
    }
}
