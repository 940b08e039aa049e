//! Rows of numbers as text: CSV, or separated by semicolons, tabs or any number of blanks, with or without a line of names. Lines that begin with # are left
//! out, but for one right above the numbers that names the columns, as NumPy's `savetxt` writes it.

use super::columns::are_names;
use super::error::{ReadError, has_decimal_comma, in_line};
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

/// The words of a line, between blanks or between something else.
fn words(line: &[u8], delimiter: u8) -> impl Iterator<Item = &[u8]> {
    let parts = line.split(move |b| *b == delimiter || delimiter == b' ' && *b == b'\t');
    parts.map(<[u8]>::trim_ascii).filter(|word| !word.is_empty())
}

/// The first number of a line of numbers with decimal commas and something else between them.
fn decimal_comma(line: &[u8]) -> Option<String> {
    [b';', b' '].into_iter().find_map(|delimiter| {
        let texts: Vec<_> = words(line, delimiter).map(String::from_utf8_lossy).collect();
        let is_number = |text: &str| text.parse::<f64>().is_ok() || has_decimal_comma(text);
        let all = texts.len() > 1 && texts.iter().all(|text| is_number(text));
        texts.iter().find(|text| all && has_decimal_comma(text)).map(ToString::to_string)
    })
}

/// The names in a comment: words that all are names of columns; in a list with commas some of them are enough, since it is no sentence, and a
/// name that nobody knows is to be refused rather than passed over.
fn names_of_comment(line: &[u8]) -> Option<Vec<String>> {
    let line = String::from_utf8_lossy(line);
    let line = line.trim_start_matches('#').trim();
    let delimiter = [',', ';'].into_iter().find(|d| line.contains(*d));
    let names: Vec<String> = match delimiter {
        Some(delimiter) => line.split(delimiter).map(|name| name.trim().to_owned()).collect(),
        None => line.split_whitespace().map(str::to_owned).collect(),
    };
    let is_list = names.iter().all(|name| !name.is_empty() && !name.contains(char::is_whitespace));
    (is_list && are_names(&names, delimiter.is_some())).then_some(names)
}

/// Text whose runs of blanks are one: columns that stand below each other, and what stands before the first.
struct Collapsed {
    inner: Box<dyn Read + Send>,
    delimiter: u8,
    /// What the blanks seen last become; 0 where there are none.
    gap: u8,
    at_start: bool,
    block: Vec<u8>,
    ready: Vec<u8>,
    given: usize,
}

impl Collapsed {
    fn new(inner: Box<dyn Read + Send>, delimiter: u8) -> Self {
        let (block, ready) = (vec![0; START as usize], Vec::new());
        Self { inner, delimiter, gap: 0, at_start: true, block, ready, given: 0 }
    }
}

impl Read for Collapsed {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        while self.given == self.ready.len() {
            let read = self.inner.read(&mut self.block)?;
            if read == 0 {
                return Ok(0);
            }
            self.ready.clear();
            self.given = 0;
            for &byte in &self.block[..read] {
                match byte {
                    b'\t' => self.gap = self.delimiter,
                    b' ' if self.gap == 0 => self.gap = b' ',
                    b' ' => {}
                    b'\n' | b'\r' => {
                        (self.gap, self.at_start) = (0, true);
                        self.ready.push(byte);
                    }
                    _ => {
                        if self.gap != 0 && !self.at_start {
                            self.ready.push(self.gap);
                        }
                        (self.gap, self.at_start) = (0, false);
                        self.ready.push(byte);
                    }
                }
            }
        }
        let count = out.len().min(self.ready.len() - self.given);
        out[..count].copy_from_slice(&self.ready[self.given..][..count]);
        self.given += count;
        Ok(count)
    }
}

/// The rows of a text, and the names of its columns if it begins with them.
pub(super) fn rows(name: &str, reader: Box<dyn Read + Send>) -> Result<Named, ReadError> {
    let unread = |why: String| ReadError::Read { name: name.to_owned(), why };
    let mut reader = reader;
    let mut start = Vec::new();
    reader.by_ref().take(START).read_to_end(&mut start).map_err(|error| unread(error.to_string()))?;
    let (mut line, mut above): (&[u8], &[u8]) = (&[], &[]);
    for next in start.split(|b| matches!(b, b'\n' | b'\r')).map(<[u8]>::trim_ascii) {
        match next.first() {
            None => {}
            Some(b'#') => above = next,
            Some(_) => {
                line = next;
                break;
            }
        }
    }
    if let Some(number) = decimal_comma(line) {
        let why = format!("its numbers have decimal commas, as in `{number}`; write them with points");
        return Err(ReadError::Columns { name: name.to_owned(), why });
    }
    let mut delimiter = [b',', b';', b'\t', b' '].into_iter().find(|d| line.contains(d)).unwrap_or(b',');
    if delimiter == b'\t' && words(line, b' ').all(|word| number(word).is_some()) {
        delimiter = b' '; // no name has blanks in it: tabs and blanks may be mixed
    }
    let comment = names_of_comment(above);
    let rest: Box<dyn Read + Send> = Box::new(std::io::Cursor::new(start).chain(reader));
    let rest: Box<dyn Read + Send> = match delimiter {
        b' ' | b'\t' => Box::new(Collapsed::new(rest, delimiter)),
        _ => rest,
    };
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
        comment.filter(|names| names.len() == width).unwrap_or_default()
    };
    let names: Vec<String> = names.iter().map(|name| in_line(name)).collect();
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
                    let text: String = String::from_utf8_lossy(field).chars().take(40).collect();
                    let text = in_line(&text);
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
