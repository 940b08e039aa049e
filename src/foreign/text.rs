//! Rows of numbers as text: CSV, or separated by semicolons, tabs or blanks, with or without a line of names; lines that begin with # are left out.

use super::error::ReadError;
use super::npy::Named;
use crate::verify::{Rows, RowsError};
use std::io::Read;

/// Rows of a text file.
struct TextRows {
    name: String,
    reader: csv::Reader<Box<dyn Read + Send>>,
    record: csv::ByteRecord,
    /// The first record, where it is no line of names.
    waiting: bool,
    names: Vec<String>,
    width: usize,
    read: u64,
}

/// What the separator is told by.
const START: u64 = 1 << 16;

fn number(field: &[u8]) -> Option<f64> {
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// The rows of a text, and the names of its columns if it begins with them.
pub(super) fn rows(name: &str, reader: Box<dyn Read + Send>) -> Result<Named, ReadError> {
    let unread = |why: String| ReadError::Read { name: name.to_owned(), why };
    let mut reader = reader;
    let mut start = Vec::new();
    reader.by_ref().take(START).read_to_end(&mut start).map_err(|error| unread(error.to_string()))?;
    let line = start.split(|b| *b == b'\n').find(|line| !line.is_empty() && line[0] != b'#').unwrap_or(&[]);
    let delimiter =
        [b',', b';', b'\t', b' '].into_iter().find(|d| line.trim_ascii().contains(d)).unwrap_or(b',');
    let rest: Box<dyn Read + Send> = Box::new(std::io::Cursor::new(start).chain(reader));
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .delimiter(delimiter)
        .from_reader(rest);
    let mut record = csv::ByteRecord::new();
    if !reader.read_byte_record(&mut record).map_err(|error| unread(error.to_string()))? {
        return Err(ReadError::Empty { name: name.to_owned() });
    }
    let width = record.len();
    // A line of names has no number in it; what has some is a row, and is wrong where it has none.
    let has_names = record.iter().all(|field| number(field).is_none());
    let names: Vec<String> = if has_names {
        record.iter().map(|field| String::from_utf8_lossy(field).into_owned()).collect()
    } else {
        Vec::new()
    };
    let rows = TextRows {
        name: name.to_owned(),
        reader,
        record,
        waiting: !has_names,
        names: names.clone(),
        width,
        read: 0,
    };
    Ok((Box::new(rows), names))
}

impl Rows for TextRows {
    fn width(&self) -> usize {
        self.width
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        let name = || self.name.clone();
        let mut rows = 0;
        while rows < most.min(1 << 14) {
            if !std::mem::take(&mut self.waiting) {
                let more = self.reader.read_byte_record(&mut self.record);
                if !more.map_err(|error| ReadError::Read { name: name(), why: error.to_string() })? {
                    break;
                }
            }
            let (record, row) = (&self.record, self.read);
            let line = record.position().map_or(0, csv::Position::line);
            if record.len() != self.width {
                return Err(ReadError::Fields {
                    name: name(),
                    row,
                    line,
                    fields: record.len(),
                    of: self.width,
                }
                .into());
            }
            for (i, field) in record.iter().enumerate() {
                let Some(value) = number(field) else {
                    let column = self.names.get(i).cloned().unwrap_or_else(|| format!("column {i}"));
                    let text = String::from_utf8_lossy(field).chars().take(40).collect();
                    return Err(ReadError::Field { name: name(), row, line, column, text }.into());
                };
                out.push(value);
            }
            (rows, self.read) = (rows + 1, self.read + 1);
        }
        if rows == 0 && self.read == 0 {
            return Err(ReadError::Empty { name: name() }.into());
        }
        Ok(rows)
    }
}
