//! Rows of numbers that somebody else made, and the blocks that they come in.

use std::borrow::Cow;
use std::error::Error;

/// What keeps rows from being read.
pub type RowsError = Box<dyn Error + Send + Sync>;

/// Rows of numbers, one after another: what files and pipes of samples hold.
pub trait Rows: Send {
    /// Numbers in a row.
    fn width(&self) -> usize;

    /// Appends up to `most` rows to `out` and returns how many; 0 at the end.
    ///
    /// # Errors
    /// Names the row that can't be read, or that is none.
    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError>;

    /// The same in a block of their own, in place of what `out` was, which is empty at the end: who has rows in one gives it away instead of copying it.
    ///
    /// # Errors
    /// As [`read`](Rows::read); `out` has the rows in front of what is wrong.
    fn block(&mut self, most: usize, out: &mut Block) -> Result<(), RowsError> {
        let (width, most) = (self.width(), most.min(BLOCK));
        let mut numbers = Vec::with_capacity(most * width);
        let mut read = Ok(1);
        while numbers.len() < most * width && read.as_ref().is_ok_and(|rows| *rows > 0) {
            read = self.read(most - numbers.len() / width, &mut numbers);
        }
        *out = Block::Numbers(numbers);
        read.map(|_| ())
    }

    /// How many rows there are in all, if that is known beforehand.
    fn count(&self) -> Option<u64> {
        None
    }
}

/// Rows of a block, unless somebody has them in others.
const BLOCK: usize = 1 << 14;

/// Numbers of some rows, as they were read: to make all of them wider, only to look at most of them once, costs as much as that look.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// Numbers.
    Numbers(Vec<f64>),
    /// Bytes of `f32`, little-endian.
    F32(Vec<u8>),
    /// Bytes of `f64`, little-endian.
    F64(Vec<u8>),
}

/// Numbers of some rows in a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece<'a> {
    /// Numbers.
    Numbers(&'a [f64]),
    /// Bytes of `f32`, little-endian.
    F32(&'a [[u8; 4]]),
    /// Bytes of `f64`, little-endian.
    F64(&'a [[u8; 8]]),
}

impl<'a> Piece<'a> {
    /// As numbers.
    pub fn numbers(self) -> Cow<'a, [f64]> {
        match self {
            Self::Numbers(numbers) => Cow::Borrowed(numbers),
            _ => {
                let mut out = Vec::new();
                self.append_to(&mut out);
                Cow::Owned(out)
            }
        }
    }

    /// Appends them as numbers.
    pub fn append_to(self, out: &mut Vec<f64>) {
        match self {
            Self::Numbers(numbers) => out.extend_from_slice(numbers),
            Self::F32(bytes) => out.extend(bytes.iter().map(|b| f64::from(f32::from_le_bytes(*b)))),
            Self::F64(bytes) => out.extend(bytes.iter().map(|b| f64::from_le_bytes(*b))),
        }
    }
}

impl Default for Block {
    fn default() -> Self {
        Self::Numbers(Vec::new())
    }
}

impl Block {
    /// How many numbers there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(numbers) => numbers.len(),
            Self::F32(bytes) => bytes.len() / 4,
            Self::F64(bytes) => bytes.len() / 8,
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All numbers.
    pub fn all(&self) -> Piece<'_> {
        self.piece(0, self.len())
    }

    /// `count` numbers from the `first` on.
    ///
    /// # Panics
    /// Where there are not so many.
    pub fn piece(&self, first: usize, count: usize) -> Piece<'_> {
        match self {
            Self::Numbers(numbers) => Piece::Numbers(&numbers[first..][..count]),
            Self::F32(bytes) => Piece::F32(&bytes.as_chunks().0[first..][..count]),
            Self::F64(bytes) => Piece::F64(&bytes.as_chunks().0[first..][..count]),
        }
    }
}

/// Rows in the blocks that they were read in, one after another, by their numbers.
pub(super) struct Blocks {
    /// The number of the first row of each, and the rows.
    blocks: Vec<(u64, Block)>,
    /// The number of the next row to come.
    pub end: u64,
    width: usize,
}

impl Blocks {
    pub fn new(width: usize) -> Self {
        Self { blocks: Vec::new(), end: 0, width }
    }

    pub fn push(&mut self, block: Block) {
        let rows = (block.len() / self.width) as u64;
        self.blocks.push((self.end, block));
        self.end += rows;
    }

    /// Rows before this one are asked for no more.
    pub fn forget_before(&mut self, row: u64) {
        let width = self.width;
        self.blocks.retain(|(first, block)| first + (block.len() / width) as u64 > row);
    }

    /// `f` of the numbers of so many rows from this one on, piece by piece.
    pub fn each_piece(&self, mut row: u64, count: usize, mut f: impl FnMut(Piece<'_>)) {
        let end = row + count as u64;
        let mut at = self.blocks.partition_point(|(first, _)| *first <= row) - 1;
        while row < end {
            let (first, block) = &self.blocks[at];
            let from = (row - first) as usize * self.width;
            let numbers = ((end - row) as usize * self.width).min(block.len() - from);
            f(block.piece(from, numbers));
            row += (numbers / self.width) as u64;
            at += 1;
        }
    }
}

#[cfg(test)]
pub(super) mod told {
    use super::{Rows, RowsError};

    /// Rows that a test made up.
    pub struct Given<const N: usize>(pub std::vec::IntoIter<[f64; N]>);

    impl<const N: usize> Rows for Given<N> {
        fn width(&self) -> usize {
            N
        }
        fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
            let before = out.len();
            out.extend(self.0.by_ref().take(most).flatten());
            Ok((out.len() - before) / N)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of two, a few at a time.
    struct Pairs(std::ops::Range<u16>);

    impl Rows for Pairs {
        fn width(&self) -> usize {
            2
        }
        fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
            let before = out.len();
            for i in self.0.by_ref().take(most.min(3)) {
                if i == 13 {
                    return Err("there is no row 13".into());
                }
                out.extend([f64::from(i), -f64::from(i)]);
            }
            Ok((out.len() - before) / 2)
        }
    }

    #[test]
    fn blocks_hold_what_was_read() {
        let (mut rows, mut block) = (Pairs(0..10), Block::default());
        let pairs = |rows: std::ops::Range<u8>| rows.flat_map(|i| [f64::from(i), -f64::from(i)]).collect();
        for expected in [pairs(0..7), pairs(7..10), vec![]] {
            rows.block(7, &mut block).unwrap();
            assert_eq!(block.is_empty(), expected.is_empty());
            assert_eq!(block, Block::Numbers(expected));
        }
        let mut broken = Pairs(9..14);
        assert_eq!(broken.block(7, &mut block).unwrap_err().to_string(), "there is no row 13");
        assert_eq!(block, Block::Numbers(pairs(9..13)));
        let numbers = [0.1_f32, -2.5, f32::MAX, f32::NAN];
        let bytes = |f: fn(f32) -> Vec<u8>| numbers.iter().flat_map(|x| f(*x)).collect::<Vec<u8>>();
        let (singles, doubles) = (
            Block::F32(bytes(|x| x.to_le_bytes().to_vec())),
            Block::F64(bytes(|x| f64::from(x).to_le_bytes().to_vec())),
        );
        for block in [singles, doubles] {
            assert_eq!((block.len(), &*block.piece(1, 2).numbers()), (4, &[-2.5, f64::from(f32::MAX)][..]));
        }
    }

    /// Whatever they are held in, rows are found by their numbers, also across blocks.
    #[test]
    fn rows_of_several_blocks() {
        let mut blocks = Blocks::new(2);
        let numbers = |rows: std::ops::Range<u8>| rows.flat_map(|i| [f64::from(i), f64::from(i) + 0.5]);
        blocks.push(Block::Numbers(numbers(0..3).collect()));
        blocks.push(Block::F32(numbers(3..5).flat_map(|x| (x as f32).to_le_bytes()).collect()));
        blocks.push(Block::F64(numbers(5..9).flat_map(f64::to_le_bytes).collect()));
        let of = |blocks: &Blocks, first: u64, count: usize| {
            let (mut all, mut pieces) = (Vec::new(), Vec::new());
            blocks.each_piece(first, count, |piece| {
                piece.append_to(&mut all);
                pieces.push(piece.numbers().len());
            });
            (all, pieces)
        };
        assert_eq!(of(&blocks, 1, 6), (numbers(1..7).collect(), vec![4, 4, 4]));
        assert_eq!(of(&blocks, 3, 2), (numbers(3..5).collect(), vec![4]));
        assert_eq!(of(&blocks, 8, 1), (numbers(8..9).collect(), vec![2]));
        assert_eq!(blocks.end, 9);
        blocks.forget_before(4);
        assert_eq!(blocks.blocks.iter().map(|(first, _)| *first).collect::<Vec<_>>(), [3, 5]);
        blocks.push(Block::Numbers(numbers(9..11).collect()));
        assert_eq!(of(&blocks, 4, 7), (numbers(4..11).collect(), vec![2, 8, 4]));
        blocks.forget_before(11);
        assert!(blocks.blocks.is_empty() && blocks.end == 11);
    }
}
