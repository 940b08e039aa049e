//! What is wrong with foreign samples, in sentences that name the row.

use super::Number;
use crate::domain::in_short;

/// Whether a text is a number but for a comma in the place of its point.
pub(super) fn has_decimal_comma(text: &str) -> bool {
    text.split_once(',').is_some_and(|(whole, part)| {
        part.starts_with(|c: char| c.is_ascii_digit()) && format!("{whole}.{part}").parse::<f64>().is_ok()
    })
}

/// What stands in a file, as a part of a sentence: in one line, not too long, and with nothing that a terminal obeys.
pub(super) fn in_line(text: &str) -> String {
    const LONGEST: usize = 200;
    let mut line = String::new();
    for c in text.chars().take(LONGEST) {
        if c.is_control() { line.extend(c.escape_debug()) } else { line.push(c) }
    }
    if text.chars().nth(LONGEST).is_some() { line + "…" } else { line }
}

fn hint(text: &str) -> &'static str {
    if has_decimal_comma(text) { " (decimal commas can't be read)" } else { "" }
}

/// What a column may be that is no angle from the pole in radians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NotTheta {
    /// An angle in degrees.
    Degrees,
    /// An angle in degrees, from the equator.
    LatitudeInDegrees,
    /// An angle from the equator.
    Latitude,
    /// The angle around the pole, and the column of that one is the angle from it.
    Phi,
    /// That can't be told of so few rows.
    Unknown,
}

impl NotTheta {
    fn words(self) -> &'static str {
        match self {
            Self::Degrees => ": are these degrees?",
            Self::LatitudeInDegrees => ": is it a latitude in degrees?",
            Self::Latitude => ": is it a latitude, from the equator?",
            Self::Phi => ": is it exchanged with phi, the angle around the pole?",
            Self::Unknown => "",
        }
    }
}

/// Why samples can't be read. Rows are numbered from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system would not let us read.
    #[error("can't read {name}: {why}")]
    Read {
        /// File or pipe.
        name: String,
        /// What the operating system says.
        why: String,
    },
    /// There is nothing in it.
    #[error("{name} is empty: there are no samples")]
    Empty {
        /// File or pipe.
        name: String,
    },
    /// It ends inside of a row.
    #[error("{name} ends in the middle of row {row}: {bytes} of its {of} bytes are there")]
    Truncated {
        /// File or pipe.
        name: String,
        /// The row.
        row: u64,
        /// Bytes of it that are there.
        bytes: usize,
        /// Bytes that it should have.
        of: usize,
    },
    /// It has fewer rows than its header says.
    #[error("{name} ends before row {row}, but its header promises {of} rows")]
    Short {
        /// File or pipe.
        name: String,
        /// The first row that is missing.
        row: u64,
        /// Rows promised.
        of: u64,
    },
    /// NaN or infinite.
    #[error("{name}, row {row}: {column} is {value}; samples must be finite numbers")]
    NotFinite {
        /// File or pipe.
        name: String,
        /// The row.
        row: u64,
        /// The column's name.
        column: String,
        /// What it is.
        value: f64,
    },
    /// Bytes in the other order.
    #[error(
        "{name}, row {row}: {} is no point, but with its bytes in the other order it is {}; the byte order is wrong from here on (f32be and f64be are big-endian)",
        in_short(.read),
        in_short(.swapped)
    )]
    Swapped {
        /// File or pipe.
        name: String,
        /// The row.
        row: u64,
        /// As read.
        read: Vec<f64>,
        /// With bytes swapped.
        swapped: Vec<f64>,
    },
    /// Floats of another size.
    #[error(
        "{name}, row 0: {} is no point, but as {is} it is {}; the numbers are {is}, not {told}", in_short(.read), in_short(.right)
    )]
    OtherFloats {
        /// File or pipe.
        name: String,
        /// As read.
        read: Vec<f64>,
        /// As it should be.
        right: Vec<f64>,
        /// What numbers were said to be.
        told: Number,
        /// What they are.
        is: Number,
    },
    /// A fraction where an index belongs.
    #[error("{name}, row {row}: {value} is no index; indices are whole numbers from 0")]
    Index {
        /// File or pipe.
        name: String,
        /// The row.
        row: u64,
        /// What it is.
        value: f64,
    },
    /// An angle from the pole that is none.
    #[error("{name}, row {row}: {column} is {value}; it is the angle from the pole in radians, 0 to pi{}", .guess.words())]
    Theta {
        /// File or pipe.
        name: String,
        /// The row.
        row: u64,
        /// The column's name.
        column: String,
        /// What it is.
        value: f64,
        /// What it may be.
        guess: NotTheta,
    },
    /// A field of a text file that is no number.
    #[error("{name}, row {row} (line {line}): {column} is `{text}`, which is no number{}", hint(.text))]
    Field {
        /// File.
        name: String,
        /// The row.
        row: u64,
        /// Its line, from 1.
        line: u64,
        /// The column's name.
        column: String,
        /// What stands there.
        text: String,
    },
    /// A row of a text file with more or fewer fields than the first.
    #[error("{name}, row {row} (line {line}) has {fields} fields where there should be {of}")]
    Fields {
        /// File.
        name: String,
        /// The row.
        row: u64,
        /// Its line, from 1.
        line: u64,
        /// Fields that it has.
        fields: usize,
        /// Fields that it should have.
        of: usize,
    },
    /// A header that can't be used.
    #[error("{name}: {why}")]
    Header {
        /// File or array.
        name: String,
        /// What is wrong with it.
        why: String,
    },
    /// Columns that are not what the domain needs.
    #[error("{name}: {why}")]
    Columns {
        /// File or pipe.
        name: String,
        /// What is wrong with them.
        why: String,
    },
}
