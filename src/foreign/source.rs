//! Where samples come from: which reader a file or pipe needs, what its columns are, and a thread that reads ahead and looks for what can't be samples.

use super::binary::BinaryRows;
use super::columns::{Columns, DENSITY_IS_FIRST, Kind, Layout, Number, density_is_first};
use super::error::{NotTheta, ReadError};
use super::npy::{self, NpyHeader};
use super::{Convention, Coordinates, npz, text};
use crate::verify::{Block, Piece, Rows, RowsError};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};

/// A file, or standard input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A file; what it holds is told by its first bytes.
    File(PathBuf),
    /// Standard input.
    Stdin,
}

impl Place {
    /// What messages call it.
    pub fn name(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::Stdin => "standard input".to_owned(),
        }
    }

    fn open(&self) -> Result<Box<dyn Read + Send>, ReadError> {
        match self {
            Self::Stdin => Ok(Box::new(std::io::stdin())),
            Self::File(path) => match File::open(path) {
                Ok(file) if path.is_dir() => {
                    drop(file);
                    Err(ReadError::Read { name: self.name(), why: "it is a folder".to_owned() })
                }
                Ok(file) => Ok(Box::new(file)),
                Err(error) => Err(ReadError::Read { name: self.name(), why: error.to_string() }),
            },
        }
    }
}

/// Samples that are being read: rows, read ahead by a thread and found to be finite, and what their columns are.
pub struct Samples {
    rows: Ahead,
    layout: Layout,
}

/// Rows that a thread hands over at once, and how many such blocks wait to be fetched: all of them fit into the cache, or each number would go through the
/// memory once more.
const BLOCK: usize = 1 << 12;
const WAITING: usize = 16;

impl Samples {
    /// Opens a file or pipe of samples of a domain: `.npy`, `.npz`, text, or bytes if `columns` say how numbers are written.
    ///
    /// # Errors
    /// Where it can't be read, is empty, or has other columns than the domain needs.
    pub fn open<D: Coordinates>(
        place: &Place,
        columns: Option<&Columns>,
        convention: &Convention<D>,
    ) -> Result<Self, ReadError> {
        let Opened { name, rows, names, bytes } = Opened::new(place, columns)?;
        let names = match columns {
            Some(columns) => columns.names.clone(),
            None => named_by_domain(&names, &convention.domain),
        };
        let layout = Layout::new(&convention.domain, &names, rows.width())
            .map_err(|why| ReadError::Columns { name: name.clone(), why })?;
        let labels = if names.is_empty() { Layout::labels(&convention.domain, rows.width()) } else { names };
        let check = Check::new(name, convention.clone(), layout.clone(), labels, bytes);
        Ok(Self { rows: Ahead::new(rows, check), layout })
    }

    /// What the columns are.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }
}

/// A file or pipe whose reader has been chosen.
struct Opened {
    name: String,
    rows: Box<dyn Rows>,
    names: Vec<String>,
    /// How its numbers are written, if it is nothing but bytes.
    bytes: Option<Vec<Number>>,
}

impl Opened {
    fn new(place: &Place, columns: Option<&Columns>) -> Result<Self, ReadError> {
        let name = place.name();
        let mut reader = place.open()?;
        let mut magic = Vec::new();
        let read = reader.by_ref().take(8).read_to_end(&mut magic);
        read.map_err(|error| ReadError::Read { name: name.clone(), why: error.to_string() })?;
        if magic.is_empty() {
            return Err(ReadError::Empty { name });
        }
        let whole = |rest: Box<dyn Read + Send>| -> Box<dyn Read + Send> {
            Box::new(std::io::Cursor::new(magic.clone()).chain(rest))
        };
        let path = match place {
            Place::File(path) => Some(path.as_path()),
            Place::Stdin => None,
        };
        let typed = columns.and_then(|columns| columns.numbers.clone());
        let numbers = typed.clone();
        let (rows, names) = if magic.starts_with(npy::MAGIC) {
            let mut reader = whole(reader);
            let header = NpyHeader::read(&name, &mut reader)?;
            npy::rows(&name, &header, reader, path)?
        } else if magic.starts_with(b"PK\x03\x04") || magic.starts_with(b"PK\x05\x06") {
            let why = "an archive can't be read from a pipe; say a file".to_owned();
            npz::rows(path.ok_or(ReadError::Read { name: name.clone(), why })?)?
        } else if let Some(numbers) = numbers {
            let size = path
                .and_then(|path| path.metadata().ok())
                .filter(std::fs::Metadata::is_file)
                .map(|m| m.len());
            let stride: u64 = numbers.iter().map(|n| n.bytes as u64).sum();
            // A file that ends inside of a row is to be read up to there.
            let promised = size.filter(|size| size % stride == 0).map(|size| size / stride);
            let rows: Box<dyn Rows> = Box::new(BinaryRows::new(&name, whole(reader), numbers, promised));
            (rows, Vec::new())
        } else if magic.starts_with(b"\xff\xfe") || magic.starts_with(b"\xfe\xff") {
            let why = "it is UTF-16, or no text at all; text is to be UTF-8".to_owned();
            return Err(ReadError::Columns { name, why });
        } else if !is_text(&magic) {
            let why = "it is neither text nor an array; bytes need --columns with a type, such as x,y,z:f32"
                .to_owned();
            return Err(ReadError::Columns { name, why });
        } else {
            // Spreadsheets begin UTF-8 with a mark of byte order, which is no part of the first name.
            let text = magic.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&magic).to_vec();
            text::rows(&name, Box::new(std::io::Cursor::new(text).chain(reader)))?
        };
        let bytes = if magic.starts_with(npy::MAGIC) { None } else { typed };
        Ok(Self { name, rows, names, bytes })
    }
}

/// Whether bytes are the beginning of a text in UTF-8; its last letter may be cut off.
fn is_text(bytes: &[u8]) -> bool {
    let is_control = |b: &u8| b.is_ascii_control() && !b.is_ascii_whitespace();
    let is_utf8 = std::str::from_utf8(bytes).map_or_else(|error| error.error_len().is_none(), |_| true);
    is_utf8 && !bytes.iter().any(is_control)
}

impl Rows for Samples {
    fn width(&self) -> usize {
        self.rows.width
    }

    fn count(&self) -> Option<u64> {
        self.rows.count
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        self.rows.read(most, out)
    }

    fn block(&mut self, most: usize, out: &mut Block) -> Result<(), RowsError> {
        self.rows.block(most, out)
    }
}

/// Columns of an array with two axes in an archive have no names: they are those of the domain's points, in order.
fn named_by_domain<D: Coordinates>(names: &[String], domain: &D) -> Vec<String> {
    let mut own = domain.names().iter();
    let all: Vec<String> = names
        .iter()
        .map(|name| {
            if name.is_empty() {
                own.next().map_or_else(|| "?".to_owned(), |n| (*n).to_owned())
            } else {
                name.clone()
            }
        })
        .collect();
    // Nothing but the array: it may have a density behind the point.
    if names.iter().all(String::is_empty) { Vec::new() } else { all }
}

/// Looks for rows that can't be samples.
struct Check {
    name: String,
    used: Vec<usize>,
    kept: Option<usize>,
    names: Vec<String>,
    discrete: Option<usize>,
    /// Columns of theta and phi.
    angles: Option<[usize; 2]>,
    /// What the first rows are, if they are no points only because they are read in the wrong way.
    misread: Option<Misread>,
    /// Whether a row is a point of the domain, once its bytes are swapped.
    swapped: Option<Box<dyn Fn(&[f64]) -> Option<Vec<f64>> + Send>>,
    read: u64,
}

type Misread = Box<dyn Fn(&[f64]) -> Result<(), ReadError> + Send>;

/// Rows that are looked at, to find out how they are misread.
const FIRST: usize = 64;

/// Whether nearly no row is a point until all are, as floats of another size; or all are directions, once they are read behind the density.
fn misread<D: Coordinates>(
    name: &str,
    convention: &Convention<D>,
    layout: &Layout,
    numbers: Option<&[Number]>,
    bounded: bool,
) -> Misread {
    let (name, convention, layout) = (name.to_owned(), convention.clone(), layout.clone());
    let told = numbers.and_then(|numbers| {
        let first = numbers[0];
        (first.kind == Kind::Float && numbers.iter().all(|n| *n == first)).then_some((first, numbers.len()))
    });
    Box::new(move |rows| {
        if layout.is_direction_then_density(&convention.domain) && density_is_first(rows) {
            let why = format!("{DENSITY_IS_FIRST} (--columns pdf,x,y,z says so)");
            return Err(ReadError::Columns { name: name.clone(), why });
        }
        let Some((told, width)) = told.filter(|_| bounded) else { return Ok(()) };
        let is_sound = |row: &[f64]| {
            layout.used().iter().all(|&column| row[column].is_finite())
                && convention.domain.locate(&layout.point(&convention, row)).is_ok()
        };
        let sound = rows.chunks_exact(width).filter(|row| is_sound(row)).count();
        if 2 * sound * width >= rows.len() {
            return Ok(());
        }
        let points = |row: &[f64]| layout.point_columns().iter().map(|&column| row[column]).collect();
        for (is, others) in told.otherwise(rows) {
            if others.len() >= width && others.chunks_exact(width).all(is_sound) {
                let (name, read, right) = (name.clone(), points(rows), points(&others));
                return Err(ReadError::OtherFloats { name, read, right, told, is });
            }
        }
        Ok(())
    })
}

/// Coordinates beyond these are looked at twice.
const LARGE: f64 = 1e3;
const SMALL: f64 = 1e-30;

impl Check {
    fn new<D: Coordinates>(
        name: String,
        convention: Convention<D>,
        layout: Layout,
        names: Vec<String>,
        numbers: Option<Vec<Number>>,
    ) -> Self {
        let discrete = (convention.domain.axes() == 0).then(|| layout.point_columns()[0]);
        let (used, kept, angles) = (layout.used(), layout.kept_column(), layout.angles());
        let bounded = convention.domain.measure().is_finite() && convention.domain.axes() > 1;
        let misread = Some(misread(&name, &convention, &layout, numbers.as_deref(), bounded));
        let swapped = numbers.filter(|n| bounded && n.iter().any(|n| n.kind == Kind::Float)).map(|numbers| {
            let swap = move |row: &[f64]| -> Option<Vec<f64>> {
                let columns = layout.point_columns();
                let odd = |x: f64| x.abs() > LARGE || x != 0.0 && x.abs() < SMALL;
                if !columns.iter().any(|&c| odd(row[c]))
                    || convention.domain.locate(&layout.point(&convention, row)).is_ok()
                {
                    return None;
                }
                let other: Vec<f64> = row.iter().zip(&numbers).map(|(&x, n)| n.swapped(x)).collect();
                let plausible = |x: f64| x == 0.0 || (1e-9..=LARGE).contains(&x.abs());
                let sound = columns.iter().all(|&c| plausible(other[c]))
                    && convention.domain.locate(&layout.point(&convention, &other)).is_ok();
                sound.then(|| columns.iter().map(|&c| other[c]).collect())
            };
            Box::new(swap) as Box<dyn Fn(&[f64]) -> Option<Vec<f64>> + Send>
        });
        Self { name, used, kept, names, discrete, angles, misread, swapped, read: 0 }
    }

    fn look(&mut self, block: &Block, width: usize) -> Result<(), ReadError> {
        if let Some(misread) = self.misread.take() {
            misread(&block.piece(0, block.len().min(FIRST * width)).numbers())?;
        }
        if self.discrete.is_none() && self.angles.is_none() && !any_is_odd(block) {
            self.read += (block.len() / width) as u64;
            return Ok(());
        }
        let numbers = block.all().numbers();
        for row in numbers.chunks_exact(width) {
            self.look_at(row)?;
            if let Some(angles) = self.angles.filter(|angles| self.is_kept(row) && !is_theta(row[angles[0]]))
            {
                return Err(ReadError::Theta {
                    name: self.name.clone(),
                    row: self.read,
                    column: self.names[angles[0]].clone(),
                    value: row[angles[0]],
                    guess: self.not_theta(numbers.chunks_exact(width), angles),
                });
            }
            self.read += 1;
        }
        Ok(())
    }

    fn is_kept(&self, row: &[f64]) -> bool {
        self.kept.is_none_or(|kept| row[kept] != 0.0)
    }

    /// What the column of theta may be, by all rows that there are; nothing is said for the sake of a few of them.
    fn not_theta<'a>(&self, rows: impl Iterator<Item = &'a [f64]>, [theta, phi]: [usize; 2]) -> NotTheta {
        const FEW: usize = 8;
        let rows: Vec<[f64; 2]> =
            rows.filter(|row| self.is_kept(row)).map(|row| [row[theta], row[phi]]).collect();
        let wrong = rows.iter().filter(|[theta, _]| !is_theta(*theta)).count();
        let all = |is: fn(&[f64; 2]) -> bool| rows.iter().all(is);
        if rows.len() < FEW || FEW * wrong < rows.len() {
            NotTheta::Unknown
        } else if !all(|[theta, _]| theta.abs() <= TAU + ROUNDED) {
            if all(|[theta, _]| *theta >= -ROUNDED) { NotTheta::Degrees } else { NotTheta::LatitudeInDegrees }
        } else if all(|[_, phi]| is_theta(*phi)) {
            NotTheta::Phi
        } else if all(|[theta, _]| theta.abs() <= FRAC_PI_2 + ROUNDED) {
            NotTheta::Latitude
        } else {
            NotTheta::Unknown
        }
    }

    fn look_at(&self, row: &[f64]) -> Result<(), ReadError> {
        let name = || self.name.clone();
        if !self.is_kept(row) {
            return Ok(()); // its point is not looked at
        }
        if let Some(other) = self.swapped.as_ref().and_then(|swapped| swapped(row)) {
            return Err(ReadError::Swapped {
                name: name(),
                row: self.read,
                read: row.to_vec(),
                swapped: other,
            });
        }
        if let Some(&column) = self.used.iter().find(|&&c| !row[c].is_finite()) {
            let label = self.names[column].clone();
            return Err(ReadError::NotFinite {
                name: name(),
                row: self.read,
                column: label,
                value: row[column],
            });
        }
        if let Some(value) = self.discrete.map(|column| row[column]).filter(|x| x.fract() != 0.0) {
            return Err(ReadError::Index { name: name(), row: self.read, value });
        }
        Ok(())
    }
}

/// Angles in texts have few digits: pi may be 3.142.
const ROUNDED: f64 = 1e-3;

/// Whether an angle may be one from the pole, in radians.
fn is_theta(angle: f64) -> bool {
    (-ROUNDED..=PI + ROUNDED).contains(&angle)
}

/// Whether there is a number that is worth to be looked at: most blocks have none, which is seen faster than where it would be.
fn any_is_odd(block: &Block) -> bool {
    let is_odd = |x: f64| !(x.abs() <= LARGE) | (x.abs() < SMALL);
    match block.all() {
        Piece::Numbers(numbers) => numbers.iter().fold(false, |any, x| any | is_odd(*x)),
        Piece::F64(bytes) => bytes.iter().fold(false, |any, b| any | is_odd(f64::from_le_bytes(*b))),
        // Twice as many fit into a vector register.
        Piece::F32(bytes) => bytes.iter().fold(false, |any, b| {
            let x = f32::from_le_bytes(*b).abs();
            any | !(x <= LARGE as f32) | (x < SMALL as f32)
        }),
    }
}

/// Rows that a thread reads while others are judged.
struct Ahead {
    blocks: Receiver<Result<Block, RowsError>>,
    block: Block,
    /// Numbers of the block that were handed out.
    at: usize,
    width: usize,
    count: Option<u64>,
    over: bool,
}

impl Ahead {
    fn new(mut rows: Box<dyn Rows>, mut check: Check) -> Self {
        let (width, count) = (rows.width(), rows.count());
        let (send, blocks) = sync_channel(WAITING);
        std::thread::spawn(move || {
            loop {
                let mut block = Block::default();
                // What stands in front of a broken row is judged: the row to be named is the first that is wrong.
                let read = rows.block(BLOCK, &mut block);
                let looked = check.look(&block, width);
                let (ends, answer) = match (looked, read) {
                    (Err(odd), _) => (true, Err(odd.into())),
                    (Ok(()), Err(error)) => (true, Err(error)),
                    (Ok(()), Ok(())) if block.is_empty() => break,
                    (Ok(()), Ok(())) => (false, Ok(block)),
                };
                if send.send(answer).is_err() || ends {
                    break;
                }
            }
        });
        Self { blocks, block: Block::default(), at: 0, width, count, over: false }
    }

    /// Sees to it that there are rows at hand, unless there are no more.
    fn fetch(&mut self) -> Result<(), RowsError> {
        while self.at == self.block.len() && !self.over {
            match self.blocks.recv() {
                Ok(Ok(block)) => (self.block, self.at) = (block, 0),
                Ok(Err(error)) => {
                    self.over = true;
                    return Err(error);
                }
                Err(_) => self.over = true,
            }
        }
        Ok(())
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        self.fetch()?;
        let numbers = (most * self.width).min(self.block.len() - self.at);
        self.block.piece(self.at, numbers).append_to(out);
        self.at += numbers;
        Ok(numbers / self.width)
    }

    fn block(&mut self, most: usize, out: &mut Block) -> Result<(), RowsError> {
        *out = Block::default();
        self.fetch()?;
        if self.at == 0 && self.block.len() <= most * self.width {
            *out = std::mem::take(&mut self.block);
        } else {
            let mut numbers = Vec::new();
            self.read(most, &mut numbers)?;
            *out = Block::Numbers(numbers);
        }
        Ok(())
    }
}

/// Rows held in memory.
#[derive(Clone, Debug, Default)]
pub struct Held {
    numbers: Vec<f64>,
    width: usize,
    at: usize,
}

impl Held {
    /// The same rows from the first on.
    pub fn again(&self) -> Self {
        Self { at: 0, ..self.clone() }
    }

    /// Some rows, evenly spread.
    pub(super) fn rows(&self, about: usize) -> impl Iterator<Item = &[f64]> {
        let step = (self.numbers.len() / self.width / about).max(1);
        self.numbers.chunks_exact(self.width).step_by(step)
    }
}

impl Rows for Held {
    fn width(&self) -> usize {
        self.width
    }

    fn count(&self) -> Option<u64> {
        Some((self.numbers.len() / self.width) as u64)
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        let numbers = (most * self.width).min(self.numbers.len() - self.at);
        out.extend_from_slice(&self.numbers[self.at..][..numbers]);
        self.at += numbers;
        Ok(numbers / self.width)
    }
}

/// Rows that are read, of which the first are kept for a second look.
pub struct Keeping<R = Samples> {
    rows: R,
    kept: std::sync::Arc<std::sync::Mutex<Held>>,
    most: usize,
}

impl<R: Rows> Keeping<R> {
    /// Keeps the first `most` rows; they are found in what is returned beside it.
    pub fn new(rows: R, most: usize) -> (Self, std::sync::Arc<std::sync::Mutex<Held>>) {
        let held = Held { numbers: Vec::new(), width: rows.width(), at: 0 };
        let kept = std::sync::Arc::new(std::sync::Mutex::new(held));
        (Self { rows, kept: std::sync::Arc::clone(&kept), most }, kept)
    }

    fn keep(&mut self, numbers: &[f64]) {
        if self.most > 0 {
            let width = self.rows.width();
            let keep = (numbers.len() / width).min(self.most);
            self.most -= keep;
            let mut kept = self.kept.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            kept.numbers.extend_from_slice(&numbers[..keep * width]);
        }
    }
}

impl<R: Rows> Rows for Keeping<R> {
    fn width(&self) -> usize {
        self.rows.width()
    }

    fn count(&self) -> Option<u64> {
        self.rows.count()
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        let before = out.len();
        let read = self.rows.read(most, out)?;
        self.keep(&out[before..]);
        Ok(read)
    }

    fn block(&mut self, most: usize, out: &mut Block) -> Result<(), RowsError> {
        let read = self.rows.block(most, out);
        self.keep(&out.piece(0, out.len().min(self.most * self.rows.width())).numbers());
        read
    }
}

/// Reads a place to its end and does nothing with it: what samples through a pipe cost before anybody looks at them. Returns the bytes.
///
/// # Errors
/// Where it can't be read.
pub fn read_to_nothing(place: &Place) -> Result<u64, ReadError> {
    let mut reader = place.open()?;
    let (mut block, mut bytes) = (vec![0; 1 << 18], 0);
    loop {
        match reader.read(&mut block) {
            Ok(0) => return Ok(bytes),
            Ok(n) => bytes += n as u64,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(ReadError::Read { name: place.name(), why: error.to_string() }),
        }
    }
}

/// An array of at most two axes, read whole: rows, columns and numbers, row after row.
///
/// # Errors
/// Where it can't be read, or has more axes.
pub fn read_array(path: &Path) -> Result<(usize, usize, Vec<f64>), ReadError> {
    let name = path.display().to_string();
    let mut reader = Place::File(path.to_owned()).open()?;
    let header = NpyHeader::read(&name, &mut reader)?;
    let wrong = |why: String| ReadError::Header { name: name.clone(), why };
    let [(field, number)] = &header.fields[..] else {
        return Err(wrong("it has fields; a table has none".to_owned()));
    };
    let (rows, columns) = match header.shape[..] {
        [columns] => (1, columns),
        [rows, columns] => (rows, columns),
        _ => return Err(wrong(format!("its shape is {:?}; a table has one axis or two", header.shape))),
    };
    let count = rows.checked_mul(columns).filter(|n| *n > 0 && *n <= 1 << 30 && field.is_empty());
    let count = count.ok_or_else(|| wrong(format!("its shape is {:?}, which is no table", header.shape)))?;
    let mut array = BinaryRows::new(&name, reader, vec![*number], Some(count));
    let mut numbers = Vec::new();
    while array.read(BLOCK, &mut numbers).map_err(|error| match error.downcast::<ReadError>() {
        Ok(error) => *error,
        Err(error) => wrong(error.to_string()),
    })? > 0
    {}
    let (rows, columns) = (rows as usize, columns as usize);
    if header.fortran_order && rows > 1 {
        numbers = (0..rows * columns).map(|i| numbers[(i % columns) * rows + i / columns]).collect();
    }
    Ok((rows, columns, numbers))
}
