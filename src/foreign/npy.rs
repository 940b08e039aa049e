//! NumPy's `.npy`, versions 1 to 3 (NEP 1 and `numpy.lib.format`): a line of Python that says type, order and shape, then the numbers.

use super::binary::{BinaryRows, SideBySide, numpy_type};
use super::columns::Number;
use super::error::{ReadError, in_line};
use crate::verify::Rows;
use std::fs::File;
use std::io::{Cursor, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

/// What the header of an array says.
#[derive(Clone, Debug, PartialEq)]
pub struct NpyHeader {
    /// Names and types of the fields of a row: one without a name for a plain array.
    pub fields: Vec<(String, Number)>,
    /// Column after column.
    pub fortran_order: bool,
    /// The shape.
    pub shape: Vec<u64>,
    /// Bytes in front of the numbers.
    pub bytes: u64,
}

/// The magic string at the front.
pub(super) const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// A header longer than this is none.
const LONGEST: usize = 1 << 20;
/// NumPy has no arrays of more.
const MOST_AXES: usize = 64;

impl NpyHeader {
    /// Reads the header of an array, and not a byte more.
    ///
    /// # Errors
    /// Where it is no header of an array, or one of numbers that can't be read.
    pub fn read(name: &str, reader: &mut dyn Read) -> Result<Self, ReadError> {
        let wrong = |why: String| ReadError::Header { name: name.to_owned(), why };
        let ends = |_| wrong("it ends inside of the header".to_owned());
        let mut start = [0; 8];
        reader.read_exact(&mut start).map_err(ends)?;
        if &start[..6] != MAGIC {
            return Err(wrong("it is no NumPy array: the magic string is missing".to_owned()));
        }
        let (length, before) = match start[6] {
            1 => {
                let mut length = [0; 2];
                reader.read_exact(&mut length).map_err(ends)?;
                (usize::from(u16::from_le_bytes(length)), 10)
            }
            2 | 3 => {
                let mut length = [0; 4];
                reader.read_exact(&mut length).map_err(ends)?;
                (u32::from_le_bytes(length) as usize, 12)
            }
            version => {
                return Err(wrong(format!(
                    "it is of version {version} of the format; 1, 2 and 3 can be read"
                )));
            }
        };
        if length > LONGEST {
            return Err(wrong(format!("its header of {length} bytes is too long to be one")));
        }
        let mut text = vec![0; length];
        reader.read_exact(&mut text).map_err(ends)?;
        let text = String::from_utf8_lossy(&text);
        let mut header = parse(&text).map_err(|why| {
            wrong(format!("{} in its header `{}`", in_line(&why), in_line(text.trim_end())))
        })?;
        header.bytes = before + length as u64;
        Ok(header)
    }

    /// Rows and columns: a plain array has one axis or two.
    pub(super) fn rows_and_columns(&self, name: &str) -> Result<(u64, usize), ReadError> {
        let wrong = |why: String| ReadError::Header { name: name.to_owned(), why };
        let columns = match self.shape[..] {
            [_] => 1,
            [_, columns] if (1..=64).contains(&columns) && self.fields.len() == 1 => columns as usize,
            [columns, rows] if self.fields.len() == 1 && (1..=64).contains(&columns) && rows > columns => {
                return Err(wrong(format!(
                    "its shape is {:?}, but samples are rows: transpose it (a.T)",
                    self.shape
                )));
            }
            _ => {
                return Err(wrong(format!(
                    "its shape is {:?}; samples are rows, so it must be [rows] or [rows, columns] with 64 columns at most",
                    self.shape
                )));
            }
        };
        Ok((self.shape[0], columns))
    }
}

/// The little of Python that headers are written in.
struct Python<'a> {
    rest: &'a str,
}

impl<'a> Python<'a> {
    fn skip(&mut self, token: &str) -> bool {
        self.rest = self.rest.trim_start();
        match self.rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn expect(&mut self, token: &str) -> Result<(), String> {
        if self.skip(token) { Ok(()) } else { Err(format!("`{token}` is missing")) }
    }

    fn string(&mut self) -> Result<&'a str, String> {
        let quote = if self.skip("'") { '\'' } else { self.expect("\"").map(|()| '"')? };
        let (string, rest) = self.rest.split_once(quote).ok_or("a string doesn't end")?;
        self.rest = rest;
        Ok(string)
    }

    fn number(&mut self) -> Result<u64, String> {
        self.rest = self.rest.trim_start();
        let digits = self.rest.len() - self.rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let (number, rest) = self.rest.split_at(digits);
        self.rest = rest.strip_prefix('L').unwrap_or(rest); // Python 2
        number.parse().map_err(|_| "there is no number".to_owned())
    }

    fn fields(&mut self) -> Result<Vec<(String, Number)>, String> {
        if !self.skip("[") {
            return Ok(vec![(String::new(), numpy_type(self.string()?)?)]);
        }
        let mut fields = Vec::new();
        while !self.skip("]") {
            self.expect("(")?;
            let name = self.string()?.to_owned();
            self.expect(",")?;
            let number = numpy_type(self.string()?)?;
            if !self.skip(")") {
                return Err(format!("the field `{name}` is an array of its own, which can't be read"));
            }
            fields.push((name, number));
            self.skip(",");
        }
        if fields.is_empty() { Err("there are no fields".to_owned()) } else { Ok(fields) }
    }
}

fn parse(text: &str) -> Result<NpyHeader, String> {
    let mut python = Python { rest: text };
    let (mut fields, mut fortran_order, mut shape) = (None, None, None);
    python.expect("{")?;
    while !python.skip("}") {
        let key = python.string()?;
        python.expect(":")?;
        match key {
            "descr" => fields = Some(python.fields()?),
            "fortran_order" if python.skip("True") => fortran_order = Some(true),
            "fortran_order" => fortran_order = python.expect("False").map(|()| Some(false))?,
            "shape" => {
                python.expect("(")?;
                let mut sizes = Vec::new();
                while !python.skip(")") {
                    sizes.push(python.number()?);
                    python.skip(",");
                    if sizes.len() > MOST_AXES {
                        return Err(format!("its shape has more than {MOST_AXES} axes"));
                    }
                }
                shape = Some(sizes);
            }
            other => return Err(format!("the key `{other}` is unknown")),
        }
        python.skip(",");
    }
    let missing = |key: &str| format!("`{key}` is missing");
    Ok(NpyHeader {
        fields: fields.ok_or_else(|| missing("descr"))?,
        fortran_order: fortran_order.ok_or_else(|| missing("fortran_order"))?,
        shape: shape.ok_or_else(|| missing("shape"))?,
        bytes: 0,
    })
}

/// Rows, and the names of their columns if the array has any.
pub(super) type Named = (Box<dyn Rows>, Vec<String>);

/// The rows of an array behind its header. `file` is where the same array can be opened again, if it is a file: one that was written column after
/// column is read by as many readers as it has columns. Any other of that kind (in an archive, from a pipe) is held in memory.
pub(super) fn rows(
    name: &str,
    header: &NpyHeader,
    reader: Box<dyn Read + Send>,
    file: Option<&Path>,
) -> Result<Named, ReadError> {
    let (count, columns) = header.rows_and_columns(name)?;
    if count == 0 {
        return Err(ReadError::Empty { name: name.to_owned() });
    }
    if let [(field, number)] = &header.fields[..]
        && field.is_empty()
    {
        if header.fortran_order && columns > 1 {
            return by_columns(name, header, *number, (count, columns), reader, file)
                .map(|rows| (rows, Vec::new()));
        }
        return Ok((
            Box::new(BinaryRows::new(name, reader, vec![*number; columns], Some(count))),
            Vec::new(),
        ));
    }
    let (names, numbers) = header.fields.iter().map(|(name, number)| (in_line(name), *number)).unzip();
    Ok((Box::new(BinaryRows::new(name, reader, numbers, Some(count))), names))
}

fn by_columns(
    name: &str,
    header: &NpyHeader,
    number: Number,
    (count, columns): (u64, usize),
    mut reader: Box<dyn Read + Send>,
    file: Option<&Path>,
) -> Result<Box<dyn Rows>, ReadError> {
    let unread = |why: String| ReadError::Read { name: name.to_owned(), why };
    let bytes = count.checked_mul(number.bytes as u64);
    let all = bytes.and_then(|bytes| bytes.checked_mul(columns as u64)?.checked_add(header.bytes));
    let Some(bytes) = bytes.filter(|_| all.is_some_and(|all| i64::try_from(all).is_ok())) else {
        let why = format!("its shape is {:?}: nothing is so large", header.shape);
        return Err(ReadError::Header { name: name.to_owned(), why });
    };
    let mut column = |column: u64| -> Result<Box<dyn Rows>, ReadError> {
        let part: Box<dyn Read + Send> = match file {
            Some(file) => {
                let mut reader = File::open(file).map_err(|error| unread(error.to_string()))?;
                let start = SeekFrom::Start(header.bytes + column * bytes);
                reader.seek(start).map_err(|error| unread(error.to_string()))?;
                Box::new(reader.take(bytes))
            }
            None => {
                // Grows by what is there: a header may promise anything.
                let mut held = Vec::new();
                reader.by_ref().take(bytes).read_to_end(&mut held).map_err(|error| {
                    unread(match error.kind() {
                        ErrorKind::OutOfMemory => "it was written column after column (Fortran order), has to be held in memory for that, and does not fit; numpy.ascontiguousarray turns it".to_owned(),
                        _ => error.to_string(),
                    })
                })?;
                Box::new(Cursor::new(held))
            }
        };
        Ok(Box::new(BinaryRows::new(name, part, vec![number], Some(count))))
    };
    let all = (0..columns as u64).map(&mut column).collect::<Result<Vec<_>, _>>()?;
    Ok(Box::new(SideBySide(all)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_numpy() {
        let header = parse("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 2), }      \n").unwrap();
        assert_eq!(
            (header.fields[0].1, header.shape, header.fortran_order),
            (Number::F32, vec![3, 2], false)
        );
        let header =
            parse("{'descr': [('x', '<f4'), ('pdf', '>f8')], 'fortran_order': False, 'shape': (7,), }")
                .unwrap();
        assert_eq!(header.fields[1].0, "pdf");
        for bad in [
            "",
            "{'descr': '<f2', 'fortran_order': False, 'shape': (3,)}",
            "{'shape': (1,)}",
            "{'descr': '<c8'}",
            "{'x",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
