//! Which column of a row is what: coordinates of the point, the density, a weight or value, whether the sample was kept.

use super::{Convention, Coordinates, Frame};
use crate::spelling::meant;
use crate::verify::{Batch, Piece, Row};
use std::f64::consts::{PI, TAU};
use std::fmt::{Display, Formatter};
use std::str::FromStr;

/// How a number is written in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Number {
    /// Floating point, signed or unsigned.
    pub kind: Kind,
    /// Bytes: 1, 2, 4 or 8.
    pub bytes: usize,
    /// Most significant byte first.
    pub big_endian: bool,
}

/// What a number's bits mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// IEEE 754, of 4 or 8 bytes.
    Float,
    /// Two's complement.
    Signed,
    /// Without sign.
    Unsigned,
}

impl Number {
    /// 32-bit float, little-endian.
    pub const F32: Self = Self { kind: Kind::Float, bytes: 4, big_endian: false };
    /// 64-bit float, little-endian.
    pub const F64: Self = Self { kind: Kind::Float, bytes: 8, big_endian: false };

    /// The value of [`bytes`](Self::bytes) bytes. Integers beyond 2^53 are rounded.
    #[inline]
    pub fn value(self, bytes: &[u8]) -> f64 {
        let mut word = [0; 8];
        word[..self.bytes].copy_from_slice(&bytes[..self.bytes]);
        if self.big_endian {
            word[..self.bytes].reverse();
        }
        let bits = u64::from_le_bytes(word);
        match self.kind {
            Kind::Float if self.bytes == 4 => f64::from(f32::from_bits(bits as u32)),
            Kind::Float => f64::from_bits(bits),
            Kind::Unsigned => bits as f64,
            Kind::Signed => {
                let unused = 64 - 8 * self.bytes as u32;
                ((bits << unused) as i64 >> unused) as f64
            }
        }
    }

    /// What the bytes of floats of this type are, read as floats of other types of another size.
    pub(super) fn otherwise(self, values: &[f64]) -> impl Iterator<Item = (Self, Vec<f64>)> {
        let bytes: Vec<u8> = values.iter().flat_map(|&value| self.bytes_of(value)).collect();
        let other = if self.bytes == 4 { Self::F64 } else { Self::F32 };
        [self.big_endian, !self.big_endian].into_iter().map(move |big_endian| {
            let number = Self { big_endian, ..other };
            (number, bytes.chunks_exact(number.bytes).map(|bytes| number.value(bytes)).collect())
        })
    }

    /// The bytes of a float that was read from them.
    fn bytes_of(self, value: f64) -> Vec<u8> {
        let mut bytes = match (self.kind, self.bytes) {
            (Kind::Float, 4) => (value as f32).to_le_bytes().to_vec(),
            _ => value.to_le_bytes().to_vec(),
        };
        if self.big_endian {
            bytes.reverse();
        }
        bytes
    }

    /// What the same bytes are in the other order.
    pub(super) fn swapped(self, value: f64) -> f64 {
        match (self.kind, self.bytes) {
            (Kind::Float, 4) => f64::from(f32::from_bits((value as f32).to_bits().swap_bytes())),
            (Kind::Float, _) => f64::from_bits(value.to_bits().swap_bytes()),
            _ => value,
        }
    }
}

impl Display for Number {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let kind = match self.kind {
            Kind::Float => 'f',
            Kind::Signed => 'i',
            Kind::Unsigned => 'u',
        };
        write!(f, "{kind}{}{}", 8 * self.bytes, if self.big_endian { "be" } else { "" })
    }
}

impl FromStr for Number {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, big_endian) = text.strip_suffix("be").map_or((text, false), |name| (name, true));
        let number = |kind, bytes| Ok(Self { kind, bytes, big_endian });
        match name {
            "f32" => number(Kind::Float, 4),
            "f64" => number(Kind::Float, 8),
            "i8" => number(Kind::Signed, 1),
            "i16" => number(Kind::Signed, 2),
            "i32" => number(Kind::Signed, 4),
            "i64" => number(Kind::Signed, 8),
            "u8" => number(Kind::Unsigned, 1),
            "u16" => number(Kind::Unsigned, 2),
            "u32" => number(Kind::Unsigned, 4),
            "u64" => number(Kind::Unsigned, 8),
            _ => Err(format!(
                "`{text}` is no type of number; there are f32, f64, i8 to i64, u8 to u64, and each with `be` behind it for big-endian"
            )),
        }
    }
}

/// Names of columns in their order, and how their numbers are written where that isn't said by the file.
///
/// `x,y,z,pdf:f32`: a type counts for its column and all before it that have none.
///
/// ```
/// use warpcheck::foreign::{Columns, Number};
/// let columns: Columns = "x,y:f64,pdf:f32".parse()?;
/// assert_eq!(columns.names, ["x", "y", "pdf"]);
/// assert_eq!(columns.numbers, Some(vec![Number::F64, Number::F64, Number::F32]));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// The names.
    pub names: Vec<String>,
    /// How the numbers are written.
    pub numbers: Option<Vec<Number>>,
}

impl FromStr for Columns {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (mut names, mut numbers) = (Vec::new(), Vec::new());
        for word in text.split(',') {
            let (name, number) =
                word.split_once(':').map_or((word, None), |(name, number)| (name, Some(number)));
            if name.trim().is_empty() {
                return Err(format!("`{text}` has a column without a name"));
            }
            names.push(name.trim().to_owned());
            if let Some(number) = number {
                numbers.resize(names.len(), number.trim().parse::<Number>()?);
            }
        }
        let numbers = match numbers.len() {
            0 => None,
            n if n == names.len() => Some(numbers),
            n => {
                return Err(format!(
                    "the column `{}` has no type; a type counts for its column and all before it",
                    names[n]
                ));
            }
        };
        Ok(Self { names, numbers })
    }
}

/// Where the coordinates of a point are.
#[derive(Clone, Debug, PartialEq)]
enum Place {
    /// As the domain has them, side by side.
    Run(Vec<usize>),
    /// As the domain has them.
    Direct(Vec<usize>),
    /// (u, v) of a lat-long map: phi / 2 pi and theta / range.
    LatLong([usize; 2]),
    /// (theta, phi) in radians.
    Angles([usize; 2]),
    /// b1 and b2, b0 being what is left to 1.
    Barycentric([usize; 2]),
}

impl Place {
    fn of(columns: Vec<usize>) -> Self {
        let side_by_side = columns.windows(2).all(|pair| pair[1] == pair[0] + 1);
        if side_by_side { Self::Run(columns) } else { Self::Direct(columns) }
    }
}

/// What each column of a row is.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    place: Place,
    density: Option<usize>,
    weight: Option<usize>,
    value: Option<usize>,
    kept: Option<usize>,
}

/// What is said where [`density_is_first`].
pub(super) const DENSITY_IS_FIRST: &str = "columns 2 to 4 are unit vectors: is the density first?";

/// Whether rows of four numbers are no directions with a density behind them, but one with a direction behind it.
pub(super) fn density_is_first(rows: &[f64]) -> bool {
    const SOME: usize = 8;
    let is_unit = |w: &[f64]| (w.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-4;
    // The points of rejected samples may be anything.
    let rows = || rows.chunks_exact(4).filter(|row| row.iter().all(|x| x.is_finite()));
    let of_unit = |from: usize| rows().filter(|row| is_unit(&row[from..from + 3])).count();
    let count = rows().count();
    count >= SOME && of_unit(1) == count && 2 * of_unit(0) < count
}

/// Names of columns beside those of points.
const OTHERS: [&str; 5] = ["pdf", "weight", "value", "kept", "_"];

/// Names of coordinates on any domain.
const COORDINATES: [&str; 12] = ["x", "y", "z", "u", "v", "theta", "phi", "b0", "b1", "b2", "i", "index"];

/// What others call them.
const ALSO: [(&str, &str); 4] = [("density", "pdf"), ("wx", "x"), ("wy", "y"), ("wz", "z")];

/// A name as we have it, in lower case.
fn ours(name: &str) -> String {
    let name = name.to_lowercase();
    ALSO.iter().find(|(theirs, _)| *theirs == name).map_or(name, |(_, ours)| (*ours).to_owned())
}

/// Whether words name the columns of samples on some domain: one is a coordinate, and all others are known or, `some`, may be anything.
pub(super) fn are_names(words: &[String], some: bool) -> bool {
    let is_one_of = |all: &[&str], word: &String| all.contains(&ours(word).as_str());
    words.iter().any(|word| is_one_of(&COORDINATES, word))
        && words.iter().all(|word| some || is_one_of(&COORDINATES, word) || is_one_of(&OTHERS, word))
}

/// Appends the points of rows that are nothing else.
fn points<D: Coordinates, const N: usize>(domain: &D, rows: Piece<'_>, out: &mut Vec<D::Point>) {
    match rows {
        Piece::Numbers(rows) => out.extend(rows.as_chunks::<N>().0.iter().map(|row| domain.point_of(row))),
        Piece::F32(rows) => out.extend(rows.as_chunks::<N>().0.iter().map(|row| {
            let number = |bytes| f64::from(f32::from_le_bytes(bytes));
            domain.point_of(&row.map(number))
        })),
        Piece::F64(rows) => out
            .extend(rows.as_chunks::<N>().0.iter().map(|row| domain.point_of(&row.map(f64::from_le_bytes)))),
    }
}

impl Layout {
    /// From names of columns, in upper or lower case; without any, those of the point, and behind them perhaps the density.
    ///
    /// # Errors
    /// Says which columns the domain needs.
    pub fn new<D: Coordinates>(domain: &D, names: &[String], width: usize) -> Result<Self, String> {
        let own = domain.names();
        let wanted = || {
            let more = match domain.name() {
                "sphere" | "hemisphere" => " (or u,v, or theta,phi)",
                "triangle" => " (or b1,b2)",
                "square" => " (or u,v)",
                _ => "",
            };
            format!(
                "points of the {} are {}{more}, with {} beside them",
                domain.name(),
                own.join(","),
                OTHERS.join(", ")
            )
        };
        if names.is_empty() {
            let density = match width.checked_sub(own.len()) {
                Some(0) => None,
                Some(1) => Some(own.len()),
                _ => {
                    return Err(format!("there are {width} columns; say which with --columns: {}", wanted()));
                }
            };
            let place = Place::of((0..own.len()).collect());
            return Ok(Self { place, density, weight: None, value: None, kept: None });
        }
        if names.len() != width {
            return Err(format!("{} columns are named, but there are {width}", names.len()));
        }
        let theirs = names;
        let names: Vec<String> = names.iter().map(|name| ours(name)).collect();
        for (i, name) in names.iter().enumerate() {
            if let Some(first) = names[..i].iter().position(|other| name != "_" && other == name) {
                let same = theirs[first].to_lowercase() == theirs[i].to_lowercase();
                let also =
                    if same { String::new() } else { format!(", `{}` and `{}`", theirs[first], theirs[i]) };
                return Err(format!("there are two columns `{name}`{also}"));
            }
        }
        let find = |name: &str| names.iter().position(|n| n == name);
        let all = |wanted: &[&str]| wanted.iter().map(|name| find(name)).collect::<Option<Vec<_>>>();
        let pair = |a: &str, b: &str| Some([find(a)?, find(b)?]);
        let (place, used): (Option<Place>, &[&str]) = if let Some(direct) = all(own) {
            (Some(Place::of(direct)), own)
        } else if let (true, Some(uv)) = (domain.has_frame(), pair("u", "v")) {
            (Some(Place::LatLong(uv)), &["u", "v"])
        } else if let (true, Some(angles)) = (domain.has_frame(), pair("theta", "phi")) {
            (Some(Place::Angles(angles)), &["theta", "phi"])
        } else if let ("square", Some(uv)) = (domain.name(), pair("u", "v")) {
            (Some(Place::of(uv.to_vec())), &["u", "v"])
        } else if let ("triangle", Some(b)) = (domain.name(), pair("b1", "b2")) {
            (Some(Place::Barycentric(b)), &["b1", "b2"])
        } else if let ("discrete", Some(index)) = (domain.name(), find("index")) {
            (Some(Place::of(vec![index])), &["index"])
        } else {
            (None, &[])
        };
        let Some(place) = place else {
            return Err(format!("the columns {} hold no point: {}", names.join(","), wanted()));
        };
        if let Some(odd) =
            names.iter().find(|name| !used.contains(&name.as_str()) && !OTHERS.contains(&name.as_str()))
        {
            let known = [own, &OTHERS].concat();
            let near =
                meant(odd, &known).map_or_else(String::new, |near| format!(", did you mean `{near}`?"));
            return Err(format!(
                "nobody knows what the column `{odd}` is{near} (`_` leaves one out): {}",
                wanted()
            ));
        }
        let layout = Self {
            place,
            density: find("pdf"),
            weight: find("weight"),
            value: find("value"),
            kept: find("kept"),
        };
        match layout {
            Self { value: Some(_), density: None, .. } => {
                Err("a column of values needs one of densities, `pdf`".to_owned())
            }
            Self { value: Some(_), weight: Some(_), .. } => {
                Err("there is a column of weights and one of values".to_owned())
            }
            layout => Ok(layout),
        }
    }

    /// Whether there is a column of densities.
    pub fn has_density(&self) -> bool {
        self.density.is_some()
    }

    /// Whether there is a column of weights or values.
    pub fn has_weight(&self) -> bool {
        self.weight.or(self.value).is_some()
    }

    /// The columns that must be finite: all that are read.
    pub(super) fn used(&self) -> Vec<usize> {
        let mut used = self.point_columns().to_vec();
        used.extend([self.density, self.weight, self.value, self.kept].into_iter().flatten());
        used
    }

    /// What each column is called, where nobody named them: by its number and what it is taken for.
    pub(super) fn labels<D: Coordinates>(domain: &D, width: usize) -> Vec<String> {
        let names = domain.names().iter().chain(&["pdf"]).enumerate().take(width);
        names.map(|(column, name)| format!("column {column} ({name})")).collect()
    }

    /// Whether a row is a direction with its density behind it and nothing else.
    pub(super) fn is_direction_then_density<D: Coordinates>(&self, domain: &D) -> bool {
        domain.has_frame()
            && self.place == Place::Run(vec![0, 1, 2])
            && self.used() == [0, 1, 2, 3]
            && self.has_density()
    }

    /// Columns of the point.
    pub(super) fn point_columns(&self) -> &[usize] {
        match &self.place {
            Place::Run(columns) | Place::Direct(columns) => columns,
            Place::LatLong(pair) | Place::Angles(pair) | Place::Barycentric(pair) => pair,
        }
    }

    /// The columns of theta and phi, if the point is these.
    pub(super) fn angles(&self) -> Option<[usize; 2]> {
        match &self.place {
            Place::Angles(pair) => Some(*pair),
            _ => None,
        }
    }

    /// The column that says whether the sample was kept.
    pub(super) fn kept_column(&self) -> Option<usize> {
        self.kept
    }

    /// The point of a row, as the convention has it.
    #[inline(always)]
    pub fn point<D: Coordinates>(&self, convention: &Convention<D>, row: &[f64]) -> D::Point {
        let direction = |theta: f64, phi: f64| {
            let ((sin_theta, cos_theta), (sin, cos)) = (theta.sin_cos(), phi.sin_cos());
            convention.point(&[sin_theta * cos, sin_theta * sin, cos_theta])
        };
        match &self.place {
            // Need not be copied.
            Place::Run(columns) => convention.point(&row[columns[0]..]),
            Place::Direct(columns) => match columns[..] {
                [a] => convention.point(&[row[a]]),
                [a, b] => convention.point(&[row[a], row[b]]),
                _ => convention.point(&[row[columns[0]], row[columns[1]], row[columns[2]]]),
            },
            &Place::LatLong([u, v]) => {
                let range = if convention.domain.name() == "hemisphere" { 0.5 * PI } else { PI };
                direction(range * row[v], TAU * row[u])
            }
            &Place::Angles([theta, phi]) => direction(row[theta], row[phi]),
            &Place::Barycentric([b, c]) => convention.point(&[1.0 - row[b] - row[c], row[b], row[c]]),
        }
    }

    /// What a row says.
    #[inline(always)]
    pub fn row<D: Coordinates>(&self, convention: &Convention<D>, row: &[f64]) -> Row<D::Point> {
        let point = self.point(convention, row);
        let density = self.density.map(|column| convention.density(&point, row[column]));
        let weight = match (self.weight, self.value, density) {
            (Some(weight), ..) => Some(row[weight]),
            (None, Some(value), Some(density)) => Some(row[value] / density),
            _ => None,
        };
        let kept = self.kept.is_none_or(|column| row[column] != 0.0);
        Row { point: kept.then_some(point), density, weight }
    }

    /// What some rows of `width` numbers say: the points, and what is beside them.
    pub fn batch<D: Coordinates>(
        &self,
        convention: &Convention<D>,
        rows: Piece<'_>,
        width: usize,
        out: &mut Batch<D::Point>,
    ) {
        let domain = &convention.domain;
        // As they stand there, which is asked once and not of each row.
        let run = match &self.place {
            Place::Run(columns)
                if self.kept.is_none() && !self.has_weight() && convention.frame == Frame::Z_UP =>
            {
                Some(columns[0])
            }
            _ => None,
        };
        // Nothing but points, of a size that the compiler knows.
        match (run, width, self.density) {
            (Some(0), 2, None) => return points::<D, 2>(domain, rows, &mut out.points),
            (Some(0), 3, None) => return points::<D, 3>(domain, rows, &mut out.points),
            _ => {}
        }
        let numbers = rows.numbers();
        let rows = numbers.chunks_exact(width);
        if let Some(first) = run {
            let start = out.points.len();
            out.points.extend(rows.clone().map(|row| domain.point_of(&row[first..])));
            if let Some(column) = self.density {
                let points = &out.points[start..];
                let densities = rows.zip(points).map(|(row, point)| convention.density(point, row[column]));
                out.densities.extend(densities);
            }
            return;
        }
        rows.for_each(|row| out.push(self.row(convention, row)));
    }
}
