//! Selection by an alias table, in exact integers.
//!
//! The 2^53 steps of the variate are dealt to N cells, each of c_i = floor or ceil of 2^53 / N steps. A cell gives its first t_i steps
//! to its own entry and the others to its alias (Walker 1974), so that one cell is all that a search reads. The masses are those of [`DiscreteCdf`], in
//! steps, and the construction only moves whole steps: every entry keeps exactly its own.
//!
//! A cell is 8 bytes: with lo = step N mod 2^53, the step belongs to the cell's own entry if lo < theta. All theta in an interval of N integers
//! give the same t_i, so one with floor(log2 N) lower bits of zero is among them, and those and the 11 bits that a step doesn't have hold the alias.
//!
//! Where the cells don't fit into a cache, a form of 4 or 2 bytes a cell answers nearly every search ([`compact`]).
//!
//! Construction by the sweep of Hübschle-Schneider and Sanders ("Parallel Weighted Random Sampling", 2022): light entries, each leaving a deficit, and
//! heavy ones, each with an excess, are laid side by side in order of index; a light cell takes its alias from the heavy entry in whose
//! excess its deficit begins, and what then is missing at the end of the heavy entry's own cell comes from the next heavy one. Where deficit
//! and excess meet follows from their running sums alone, so that every piece of the table can be made by itself: in parallel, the same bits on any
//! number of threads, without any further memory.

mod compact;

use super::{BATCH, Choice, DiscreteCdf, STEPS, in_batches, position_of, step_at, step_of};
use crate::pages::Pages;
use crate::parallel;
use crate::random::ONE_MINUS_EPSILON_F64;
use crate::sampler::Error;
use compact::Compact;
use rand::Rng;

/// Bytes of cells that are near enough for nobody to wait for them.
const CACHED: usize = 1 << 18;
/// Steps searched together where only the index is wanted: what fits into registers.
const FEW: usize = 8;
/// Cells made by one task.
const PIECE: usize = 1 << 14;

/// A table to select an index in one memory access, from independent variates: their order is lost.
///
/// ```
/// use warpcheck::sampler::DiscreteAlias;
/// let table = DiscreteAlias::new(&[1.0, 0.0, 3.0])?;
/// assert_eq!(table.mass(1), 0.0);
/// assert!((table.mass(2) - 0.75).abs() < 1e-15);
/// let mut out = [0; 4];
/// table.indices(&[0, 1 << 62, 1 << 63, u64::MAX], &mut out);
/// assert!(out.iter().all(|&i| i == 0 || i == 2));
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DiscreteAlias {
    /// For the masses; not searched.
    cdf: DiscreteCdf,
    cells: AliasCells,
    /// Beside cells that are too many for the cache.
    compact: Option<Compact>,
}

impl DiscreteAlias {
    /// A table for these weights, which need not be normalised.
    ///
    /// # Errors
    /// Without weights, if there are 2^32 or more, if all are 0, or if one is negative, NaN or infinite (named by its index).
    pub fn new(weights: &[f64]) -> Result<Self, Error> {
        Ok(Self::from_cdf(DiscreteCdf::new(weights)?))
    }

    /// An alias table with the masses of this one.
    pub fn from_cdf(cdf: DiscreteCdf) -> Self {
        let cells = AliasCells::new(cdf.len(), |i| cdf.steps(i));
        let compact = Compact::new(&cells);
        Self { cdf, cells, compact }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.cdf.len()
    }

    /// Never true: an empty table cannot be made.
    pub fn is_empty(&self) -> bool {
        self.cdf.is_empty()
    }

    /// The entry for a variate in `[0, 1)`. What lies outside is moved to the nearest end, NaN to 0.
    #[inline]
    pub fn choose(&self, xi: f64) -> Choice {
        let (index, rest) = self.cells.choose(step_at(position_of(xi)));
        Choice { index, mass: self.cdf.mass(index), rest }
    }

    /// The entries for 64 random bits each: [`choose`](Self::choose) at the variate of their upper 53.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn indices(&self, bits: &[u64], out: &mut [u32]) {
        assert_eq!(bits.len(), out.len(), "as many bits as indices");
        match &self.compact {
            Some(compact) => compact.indices(&self.cells, bits, out),
            None => self.cells.indices(bits, out),
        }
    }

    /// The entries for the next numbers of a generator, 64 bits each: [`indices`](Self::indices) of them, and the fastest way to draw.
    ///
    /// ```
    /// use rand::{Rng, SeedableRng, rngs::Xoshiro256PlusPlus};
    /// use warpcheck::sampler::DiscreteAlias;
    /// let table = DiscreteAlias::new(&[1.0, 0.0, 3.0])?;
    /// let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    /// let (mut drawn, mut same) = ([0; 100], [0; 100]);
    /// table.draw(&mut rng.clone(), &mut drawn);
    /// table.indices(&[(); 100].map(|()| rng.next_u64()), &mut same);
    /// assert_eq!(drawn, same);
    /// # Ok::<(), warpcheck::sampler::Error>(())
    /// ```
    #[inline]
    pub fn draw(&self, rng: &mut impl Rng, out: &mut [u32]) {
        if self.cells.bytes() <= CACHED {
            self.cells.draw(rng, out);
            return;
        }
        // Nothing but loads, so that the processor has as many as it can under way.
        let mut bits = [0; 256];
        for out in out.chunks_mut(bits.len()) {
            let bits = &mut bits[..out.len()];
            bits.fill_with(|| rng.next_u64());
            self.indices(bits, out);
        }
    }

    /// [`choose`](Self::choose) for many variates.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn choose_all(&self, xi: &[f64], out: &mut [Choice]) {
        assert_eq!(xi.len(), out.len(), "as many variates as choices");
        for (xi, out) in xi.chunks(BATCH).zip(out.chunks_mut(BATCH)) {
            for (&xi, choice) in xi.iter().zip(&mut *out) {
                (choice.index, choice.rest) = self.cells.choose(step_at(position_of(xi)));
            }
            // Another place in memory, so all of them in one go.
            out.iter_mut().for_each(|choice| choice.mass = self.cdf.mass(choice.index));
        }
    }

    /// The probability with which [`choose`](Self::choose) returns an entry; 0 past the end.
    #[inline]
    pub fn mass(&self, index: usize) -> f64 {
        self.cdf.mass(index)
    }

    /// The probability of all entries before `index`.
    pub fn cumulative(&self, index: usize) -> f64 {
        self.cdf.cumulative(index)
    }

    /// A variate at which this entry is chosen, with this rest in the part of it that lies in one cell: the entry's own or, where that has nothing
    /// of it, the first that has. NaN for an entry of mass 0.
    pub fn variate(&self, index: usize, rest: f64) -> f64 {
        let Some((start, end)) = self.cells.part_of(index) else { return f64::NAN };
        (start as f64 + rest * (end - start) as f64).min((end as f64).next_down()) / STEPS
    }

    /// Bytes that the table takes.
    pub fn bytes(&self) -> usize {
        self.cdf.bytes() + self.cells.bytes() + self.compact.as_ref().map_or(0, Compact::bytes)
    }

    /// The borders of some cells, and of the parts inside.
    pub(in crate::sampler) fn some_boundaries(&self) -> Vec<f64> {
        self.cells.some_borders()
    }
}

/// The cells of an alias table over 2^53 steps.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::sampler) struct AliasCells {
    /// theta 2^11, and the alias in the lower bits.
    cells: Pages<u64>,
    /// The bits of the alias.
    mask: u64,
}

/// How the steps are dealt to N cells.
#[derive(Clone, Copy)]
struct Deal {
    cells: u64,
    /// 2^53 = cells each + more.
    each: u64,
    more: u64,
}

impl Deal {
    fn new(cells: usize) -> Self {
        let cells = cells as u64;
        Self { cells, each: (1 << 53) / cells, more: (1 << 53) % cells }
    }

    /// The first step of a cell: ceil(c 2^53 / N).
    fn start(&self, cell: usize) -> u64 {
        let cell = cell as u64;
        // c < 2^32 and more < N < 2^32.
        let part = if self.more == 0 { 0 } else { (cell * self.more).div_ceil(self.cells) };
        cell * self.each + part
    }

    fn capacity(&self, cell: usize) -> u64 {
        if self.more == 0 { self.each } else { self.start(cell + 1) - self.start(cell) }
    }

    /// What `steps` steps of a cell's start are in its lo.
    fn theta(&self, cell: usize, steps: u64) -> u64 {
        // start N - c 2^53, in 0..N.
        let first = self.start(cell).wrapping_mul(self.cells).wrapping_sub((cell as u64) << 53);
        steps * self.cells + first
    }
}

/// What the entries lack to fill their cells (side 0), or have too much for them (side 1), summed over the pieces before each piece.
struct Sums<M> {
    deal: Deal,
    mass: M,
    before: Vec<[u64; 2]>,
}

impl<M: Fn(usize) -> u64 + Sync> Sums<M> {
    fn new(entries: usize, mass: M) -> Self {
        let mut new = Self { deal: Deal::new(entries), mass, before: vec![[0; 2]] };
        let pieces = parallel::map(entries.div_ceil(PIECE), |piece| {
            let range = piece * PIECE..entries.min((piece + 1) * PIECE);
            range.map(|i| new.of(i)).fold([0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
        });
        let mut sum = [0; 2];
        for piece in pieces {
            sum = [sum[0] + piece[0], sum[1] + piece[1]];
            new.before.push(sum);
        }
        assert_eq!(sum[0], sum[1], "masses have to fill the cells");
        new
    }

    #[inline]
    fn of(&self, entry: usize) -> [u64; 2] {
        let (mass, capacity) = ((self.mass)(entry), self.deal.capacity(entry));
        [capacity.saturating_sub(mass), mass.saturating_sub(capacity)]
    }

    /// A walk that has not yet passed `sum`.
    fn walk(&self, side: usize, sum: u64) -> Walk<'_, M> {
        let piece = self.before.partition_point(|before| before[side] <= sum) - 1;
        Walk { sums: self, side, next: piece * PIECE, last: 0, sum: self.before[piece][side] }
    }
}

/// Goes along the entries that have something on one side, and adds it up.
struct Walk<'a, M> {
    sums: &'a Sums<M>,
    side: usize,
    next: usize,
    /// The last entry that was added.
    last: usize,
    sum: u64,
}

impl<M: Fn(usize) -> u64 + Sync> Walk<'_, M> {
    /// To the next entry that has something. There has to be one.
    #[inline]
    fn advance(&mut self) {
        loop {
            if self.next.is_multiple_of(PIECE) {
                // Over pieces without any.
                let rest = &self.sums.before[self.next / PIECE..];
                let empty = rest.windows(2).take_while(|w| w[0][self.side] == w[1][self.side]).count();
                self.next += empty * PIECE;
            }
            self.last = self.next;
            self.next += 1;
            let amount = self.sums.of(self.last)[self.side];
            self.sum += amount;
            if amount > 0 {
                return;
            }
        }
    }
}

/// Cells while they are searched.
#[derive(Clone, Copy)]
struct Cells<'a> {
    cells: &'a [u64],
    mask: u64,
}

impl Cells<'_> {
    /// The entries of the upper 53 bits of each number, without a branch.
    #[inline(always)]
    fn batch<const N: usize>(self, bits: &[u64; N]) -> [u32; N] {
        let (mut own, mut lo, mut packed, mut out) = ([0; N], [0; N], [0; N], [0; N]);
        for i in 0..N {
            let product = u128::from(step_of(bits[i]) << 11) * self.cells.len() as u128;
            (own[i], lo[i]) = ((product >> 64) as u32, product as u64);
            packed[i] = self.cells[own[i] as usize];
        }
        for i in 0..N {
            let is_own = lo[i] < packed[i] & !self.mask;
            out[i] = if is_own { own[i] } else { (packed[i] & self.mask) as u32 };
        }
        out
    }
}

impl AliasCells {
    /// From the masses of the entries in steps, which have to add up to 2^53; fewer than 2^32 entries.
    pub(in crate::sampler) fn new(entries: usize, mass: impl Fn(usize) -> u64 + Sync) -> Self {
        let sums = Sums::new(entries, mass);
        let mask = (1 << (11 + entries.ilog2())) - 1;
        let mut cells = Pages::zeros(entries);
        parallel::chunks_mut(&mut cells, PIECE, |piece, cells| {
            let [mut deficit, mut excess] = sums.before[piece];
            let (mut donors, mut debtors) = (sums.walk(1, deficit), sums.walk(0, excess));
            for (i, cell) in (piece * PIECE..).zip(cells) {
                let [lacks, exceeds] = sums.of(i);
                let capacity = sums.deal.capacity(i);
                let (own, alias) = if lacks > 0 {
                    while donors.sum <= deficit {
                        donors.advance();
                    }
                    deficit += lacks;
                    (capacity - lacks, donors.last)
                } else if exceeds > 0 {
                    excess += exceeds;
                    while debtors.sum < excess {
                        debtors.advance();
                    }
                    match debtors.sum - excess {
                        0 => (capacity, i),
                        // The next heavy entry pays what this one has given too much.
                        over => {
                            let mut next = Walk { sums: &sums, side: 1, next: i + 1, last: i, sum: 0 };
                            next.advance();
                            (capacity - over, next.last)
                        }
                    }
                } else {
                    (capacity, i)
                };
                // A full cell is one whose other entry is its own.
                let theta = if alias == i { 0 } else { (sums.deal.theta(i, own) << 11) & !mask };
                *cell = theta | alias as u64;
            }
        });
        Self { cells, mask }
    }

    /// The entry of a step of `0..2^53`.
    #[cfg(test)]
    fn index(&self, step: u64) -> u32 {
        let mut out = [0];
        self.indices(&[step << 11], &mut out);
        out[0]
    }

    /// The entries of the upper 53 bits of each number.
    fn indices(&self, bits: &[u64], out: &mut [u32]) {
        let cells = Cells { cells: &self.cells, mask: self.mask };
        in_batches::<FEW, _, _>(
            bits,
            out,
            |bits, out| *out = cells.batch(bits),
            |bits| cells.batch(&[bits])[0],
        );
    }

    /// The entries for a generator's next numbers.
    #[inline]
    fn draw(&self, rng: &mut impl Rng, out: &mut [u32]) {
        let cells = Cells { cells: &self.cells, mask: self.mask };
        for out in out {
            *out = cells.batch(&[rng.next_u64()])[0];
        }
    }

    /// The entry of a step, and where in its part of the cell the step lies, in `[0, 1)`.
    #[inline]
    pub(in crate::sampler) fn choose(&self, step: u64) -> (usize, f64) {
        let (cell, lo) = self.cell_of(step);
        self.chosen(cell, lo, self.cells[cell])
    }

    /// What a cell, which is `packed`, tells a step with this lo.
    #[inline(always)]
    fn chosen(&self, cell: usize, lo: u64, packed: u64) -> (usize, f64) {
        let (theta, alias) = (packed & !self.mask, packed & self.mask);
        let own = lo < theta;
        // 2^64 - theta is one more than fits where theta is 0; in f64 it makes no difference.
        let (from, width) = if own { (0, theta) } else { (theta, u64::MAX - theta) };
        let rest = (lo - from) as f64 / width as f64;
        (if own { cell } else { alias as usize }, rest.min(ONE_MINUS_EPSILON_F64))
    }

    /// [`choose`](Self::choose) for variates, all cells first.
    #[inline]
    pub(in crate::sampler) fn choose_batch<const N: usize>(&self, xi: &[f64; N]) -> [(usize, f64); N] {
        let (mut cells, mut lo, mut packed, mut chosen) = ([0; N], [0; N], [0; N], [(0, 0.0); N]);
        for i in 0..N {
            (cells[i], lo[i]) = self.cell_of(step_at(position_of(xi[i])));
        }
        // Nothing else between the loads, or what follows each keeps the next from being under way.
        for i in 0..N {
            packed[i] = self.cells[cells[i]];
        }
        for i in 0..N {
            chosen[i] = self.chosen(cells[i], lo[i], packed[i]);
        }
        chosen
    }

    /// A step's cell, and lo 2^11.
    #[inline]
    fn cell_of(&self, step: u64) -> (usize, u64) {
        let product = u128::from(step << 11) * self.cells.len() as u128;
        ((product >> 64) as usize, product as u64)
    }

    pub(in crate::sampler) fn bytes(&self) -> usize {
        size_of_val(&*self.cells)
    }

    /// Where a cell begins, where its own part ends, and where it ends, in steps.
    fn borders(&self, cell: usize) -> [u64; 3] {
        let (deal, packed) = (Deal::new(self.cells.len()), self.cells[cell]);
        let start = deal.start(cell);
        let own = if packed & self.mask == cell as u64 {
            deal.capacity(cell)
        } else {
            ((packed & !self.mask) >> 11).saturating_sub(deal.theta(cell, 0)).div_ceil(deal.cells)
        };
        [start, start + own, start + deal.capacity(cell)]
    }

    /// The borders of 256 cells, and of the parts inside, as variates.
    pub(in crate::sampler) fn some_borders(&self) -> Vec<f64> {
        let cells = (0..self.cells.len()).step_by(self.cells.len().div_ceil(256));
        let borders = cells.flat_map(|cell| self.borders(cell)).map(|border| border as f64 / STEPS);
        borders.filter(|&xi| xi > 0.0 && xi < 1.0).collect()
    }

    /// First and last step (exclusive) of a part that belongs to an entry: in its own cell, or in the first other one.
    fn part_of(&self, entry: usize) -> Option<(u64, u64)> {
        let [start, own, _] = self.borders(entry);
        if own > start {
            return Some((start, own));
        }
        let foreign = |&cell: &usize| self.cells[cell] & self.mask == entry as u64;
        (0..self.cells.len())
            .filter(foreign)
            .map(|cell| self.borders(cell))
            .find(|[_, own, end]| end > own)
            .map(|[_, own, end]| (own, end))
    }

    /// How many steps each entry has, counted from the cells.
    #[cfg(test)]
    fn steps(&self) -> Vec<u64> {
        let mut steps = vec![0; self.cells.len()];
        for cell in 0..self.cells.len() {
            let [start, own, end] = self.borders(cell);
            steps[cell] += own - start;
            steps[(self.cells[cell] & self.mask) as usize] += end - own;
        }
        steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{stream, unit_f64};
    use rand::Rng;

    /// Every entry gets exactly the steps of the CDF, and the borders found are those that a search sees.
    fn exact(weights: &[f64]) {
        let cdf = DiscreteCdf::new(weights).unwrap();
        let table = DiscreteAlias::from_cdf(cdf.clone());
        let steps: Vec<u64> = (0..weights.len()).map(|i| cdf.steps(i)).collect();
        assert_eq!(table.cells.steps(), steps);
        for cell in (0..weights.len()).step_by(weights.len().div_ceil(1000)) {
            let [start, own, end] = table.cells.borders(cell);
            let alias = (table.cells.cells[cell] & table.cells.mask) as u32;
            for step in [start, own - u64::from(own > start)] {
                if step < own {
                    assert_eq!(table.cells.index(step), cell as u32, "{} {cell}", weights.len());
                }
            }
            for step in [own, end - 1] {
                if own < end {
                    assert_eq!(table.cells.index(step), alias, "{} {cell}", weights.len());
                }
            }
        }
        for i in (0..weights.len()).step_by(weights.len().div_ceil(100)) {
            if weights[i] > 0.0 {
                for rest in [0.0, 0.5, ONE_MINUS_EPSILON_F64] {
                    assert_eq!(table.choose(table.variate(i, rest)).index, i);
                }
            } else {
                assert!(table.variate(i, 0.5).is_nan());
            }
        }
    }

    #[test]
    fn cells_hold_exactly_the_masses() {
        let mut rng = stream(1, "alias", 0);
        for entries in [1, 2, 3, 5, 7, 64, 100, 1000, 1023, 1024, 1025, 70_000, 131_072] {
            let mut draw = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
                (0..entries).map(|_| f(unit_f64(&mut rng))).collect()
            };
            exact(&draw(&|_| 1.0));
            exact(&draw(&|u| 10.0_f64.powf(8.0 * u)));
            exact(&draw(&|u| if u < 0.5 { 0.0 } else { u }).iter().map(|w| w + 1e-300).collect::<Vec<_>>());
            let mut one = draw(&|_| 0.0);
            one[entries / 2] = 1.0;
            exact(&one);
            let mut heavy = draw(&|_| 1e-9);
            heavy[entries - 1] = 1.0;
            exact(&heavy);
            let mut sorted = draw(&|u| u + 0.01);
            sorted.sort_by(f64::total_cmp);
            exact(&sorted);
            sorted.reverse();
            exact(&sorted);
        }
    }

    #[test]
    fn the_left_over_is_uniform_in_its_part() {
        let table = DiscreteAlias::new(&[1.0, 5.0, 0.3]).unwrap();
        let mut rng = stream(2, "alias", 0);
        let (mut sums, mut counts) = ([0.0; 3], [0.0; 3]);
        for _ in 0..30_000 {
            let choice = table.choose((rng.next_u64() >> 11) as f64 / STEPS);
            assert!((0.0..1.0).contains(&choice.rest));
            sums[choice.index] += choice.rest;
            counts[choice.index] += 1.0;
        }
        for (sum, count) in sums.iter().zip(counts) {
            let sigma = (1.0_f64 / 12.0 / count).sqrt();
            assert!((sum / count - 0.5).abs() < 5.0 * sigma, "{sums:?} {counts:?}");
        }
    }
}
