//! Rows of numbers in bytes, one behind the other: what pipes carry, and the body of a NumPy array.

use super::columns::{Kind, Number};
use super::error::ReadError;
use crate::verify::{Rows, RowsError};
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
    bytes: Vec<u8>,
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
        Self { name: name.into(), reader, numbers, stride, promised, read: 0, bytes: Vec::new() }
    }

    /// Fills the buffer as far as there is something to read.
    fn fill(&mut self, wanted: usize) -> Result<usize, ReadError> {
        self.bytes.resize(wanted, 0);
        let mut filled = 0;
        while filled < wanted {
            match self.reader.read(&mut self.bytes[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => {
                    return Err(ReadError::Read { name: self.name.clone(), why: error.to_string() });
                }
            }
        }
        Ok(filled)
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
        let left = self.promised.map_or(u64::MAX, |promised| promised - self.read);
        let rows = most.min((BLOCK / self.stride).max(1)).min(usize::try_from(left).unwrap_or(usize::MAX));
        let filled = self.fill(rows * self.stride)?;
        let whole = filled / self.stride;
        let bytes = &self.bytes[..whole * self.stride];
        let all = |number: Number| self.numbers.iter().all(|n| *n == number);
        if all(Number::F32) {
            out.extend(bytes.as_chunks::<4>().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))));
        } else if all(Number::F64) {
            out.extend(bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)));
        } else {
            for row in bytes.chunks_exact(self.stride) {
                let mut at = 0;
                for number in &self.numbers {
                    out.push(number.value(&row[at..]));
                    at += number.bytes;
                }
            }
        }
        self.read += whole as u64;
        let name = || self.name.clone();
        if filled % self.stride != 0 {
            let bytes = filled % self.stride;
            return Err(ReadError::Truncated { name: name(), row: self.read, bytes, of: self.stride }.into());
        }
        if whole < rows
            && let Some(of) = self.promised
        {
            return Err(ReadError::Short { name: name(), row: self.read, of }.into());
        }
        if whole == 0 && self.read == 0 && rows > 0 {
            return Err(ReadError::Empty { name: name() }.into());
        }
        Ok(whole)
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
