//! Rows of numbers in bytes, one behind the other: what pipes carry, and the body of a NumPy array.

use super::columns::{Kind, Number};
use super::error::ReadError;
use crate::verify::{Block, Rows, RowsError};
use std::io::Read;

/// Bytes that are read in one go.
const BLOCK: usize = 1 << 18;

/// Rows of numbers of given types.
pub struct BinaryRows {
    name: String,
    reader: Box<dyn Read + Send>,
    numbers: Vec<Number>,
    stride: usize,
    promised: Option<u64>,
    read: u64,
}

impl BinaryRows {
    /// Rows of these numbers; `promised` of them, if a header says so.
    pub fn new(
        name: impl Into<String>,
        reader: Box<dyn Read + Send>,
        numbers: Vec<Number>,
        promised: Option<u64>,
    ) -> Self {
        let stride = numbers.iter().map(|n| n.bytes).sum();
        Self { name: name.into(), reader, numbers, stride, promised, read: 0 }
    }

    /// The bytes of so many rows, as far as there is something to read, and how many whole rows that are.
    fn bytes(&mut self, rows: usize) -> Result<(Vec<u8>, usize), ReadError> {
        let mut bytes = Vec::with_capacity(rows * self.stride);
        let read = self.reader.by_ref().take((rows * self.stride) as u64).read_to_end(&mut bytes);
        read.map_err(|error| ReadError::Read { name: self.name.clone(), why: error.to_string() })?;
        let whole = bytes.len() / self.stride;
        self.read += whole as u64;
        Ok((bytes, whole))
    }

    fn rows_in_one_go(&self, most: usize) -> usize {
        let left = self.promised.map_or(u64::MAX, |promised| promised - self.read);
        most.min((BLOCK / self.stride).max(1)).min(usize::try_from(left).unwrap_or(usize::MAX))
    }

    /// Whether all numbers are of one type.
    fn all_are(&self, number: Number) -> bool {
        self.numbers.iter().all(|n| *n == number)
    }

    /// What is wrong where of so many rows wanted there are only so many bytes.
    fn missing(&self, wanted: usize, bytes: usize) -> Result<(), ReadError> {
        let (name, whole, bytes) = (|| self.name.clone(), bytes / self.stride, bytes % self.stride);
        if bytes != 0 {
            return Err(ReadError::Truncated { name: name(), row: self.read, bytes, of: self.stride });
        }
        if whole < wanted
            && let Some(of) = self.promised
        {
            return Err(ReadError::Short { name: name(), row: self.read, of });
        }
        if whole == 0 && self.read == 0 && wanted > 0 {
            return Err(ReadError::Empty { name: name() });
        }
        Ok(())
    }
}

impl Rows for BinaryRows {
    fn width(&self) -> usize {
        self.numbers.len()
    }

    fn count(&self) -> Option<u64> {
        self.promised
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        let mut block = Block::default();
        let read = self.block(most, &mut block);
        block.all().append_to(out);
        read.map(|()| block.len() / self.width())
    }

    /// Bytes as they were read, where they are floats of the usual kinds.
    fn block(&mut self, most: usize, out: &mut Block) -> Result<(), RowsError> {
        *out = Block::default();
        let wanted = self.rows_in_one_go(most);
        let (mut bytes, whole) = self.bytes(wanted)?;
        let missing = self.missing(wanted, bytes.len());
        bytes.truncate(whole * self.stride);
        *out = if self.all_are(Number::F32) {
            Block::F32(bytes)
        } else if self.all_are(Number::F64) {
            Block::F64(bytes)
        } else {
            let mut numbers = Vec::with_capacity(whole * self.numbers.len());
            for row in bytes.chunks_exact(self.stride) {
                let mut at = 0;
                for number in &self.numbers {
                    numbers.push(number.value(&row[at..]));
                    at += number.bytes;
                }
            }
            Block::Numbers(numbers)
        };
        Ok(missing?)
    }
}

/// Sources of as many rows, side by side.
pub struct SideBySide(pub Vec<Box<dyn Rows>>);

impl Rows for SideBySide {
    fn width(&self) -> usize {
        self.0.iter().map(|rows| rows.width()).sum()
    }

    fn count(&self) -> Option<u64> {
        self.0.first().and_then(|rows| rows.count())
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        let most = most.min(1 << 14);
        let mut parts = Vec::with_capacity(self.0.len());
        for rows in &mut self.0 {
            let (mut part, mut there) = (Vec::new(), 0);
            while there < most {
                match rows.read(most - there, &mut part)? {
                    0 => break,
                    n => there += n,
                }
            }
            parts.push((rows.width(), part));
        }
        // Sources that promise different numbers of rows are refused before.
        let rows = parts.iter().map(|(width, part)| part.len() / width).min().unwrap_or(0);
        for row in 0..rows {
            for (width, part) in &parts {
                out.extend_from_slice(&part[row * width..][..*width]);
            }
        }
        Ok(rows)
    }
}

/// The type of NumPy's `<f4`, `>f8`, `|u1`, ….
pub(super) fn numpy_type(text: &str) -> Result<Number, String> {
    let refuse = || format!("its type is `{text}`; f4, f8 and integers can be read");
    let mut letters = text.chars();
    let big_endian = match letters.next() {
        Some('>') => true,
        Some('<' | '|') => false,
        Some('=') => cfg!(target_endian = "big"),
        _ => return Err(refuse()),
    };
    let kind = match letters.next() {
        Some('f') => Kind::Float,
        Some('i') => Kind::Signed,
        Some('u' | 'b') => Kind::Unsigned,
        _ => return Err(refuse()),
    };
    let bytes = match letters.as_str() {
        "1" if kind != Kind::Float => 1,
        "2" if kind != Kind::Float => 2,
        "4" => 4,
        "8" => 8,
        _ => return Err(refuse()),
    };
    Ok(Number { kind, bytes, big_endian })
}
