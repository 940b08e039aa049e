//! What can go wrong with a picture, by whose fault it is.

use std::io;
use std::path::{Path, PathBuf};

use super::MAX_TEXELS;

/// Why a picture could not be made, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system would not let us read.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// The file asked for.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The file was read, but holds no picture that we can use.
    #[error("{}: {flaw}", .path.display())]
    Decode {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong with its content.
        flaw: Flaw,
    },
    /// The file could not be written; what stood there before still stands.
    #[error("cannot write {}: {source}", .path.display())]
    Write {
        /// The file asked for.
        path: PathBuf,
        /// What the operating system or the encoder says.
        source: io::Error,
    },
    /// A raster whose number of texels is not width times height, or is zero.
    #[error("{texels} texels given for a raster of {width} x {height}")]
    Shape {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Texels given.
        texels: usize,
    },
    /// A plane whose name is empty, used twice, longer than 255 bytes or not plain ASCII.
    #[error("{name:?} cannot name a plane: {problem}")]
    PlaneName {
        /// The name given.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
}

impl Error {
    pub(super) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_owned(), source }
    }

    pub(super) fn write(path: &Path, source: io::Error) -> Self {
        Self::Write { path: path.to_owned(), source }
    }
}

/// What is wrong with the bytes of a file that should have been a picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Flaw {
    /// There is not a single byte.
    #[error("the file is empty")]
    Empty,
    /// The first bytes are those of neither format.
    #[error("not a picture we can read (neither Radiance HDR nor OpenEXR)")]
    Unknown,
    /// The data stops too early.
    #[error("truncated: the file ends {0}")]
    Truncated(String),
    /// The data contradicts itself or the format.
    #[error("damaged: {0}")]
    Damaged(String),
    /// Valid, but of a kind that is not read here.
    #[error("not supported: {0}")]
    Unsupported(String),
    /// Nothing to see, or more than [`MAX_TEXELS`].
    #[error("announces {width} x {height} texels; 1 to {MAX_TEXELS} can be read")]
    Size {
        /// Columns, as the header says.
        width: u64,
        /// Rows, as the header says.
        height: u64,
    },
    /// An OpenEXR file with neither `R`, `G`, `B` nor `Y`.
    #[error("has no channels R, G, B and no Y, only: {}", .0.join(", "))]
    Channels(
        /// The names of the channels that are there.
        Vec<String>,
    ),
}

impl Flaw {
    pub(super) fn at(self, path: &Path) -> Error {
        Error::Decode { path: path.to_owned(), flaw: self }
    }

    /// Refuses a size before anything is allocated for it: one that is too large, and one for which the file is too small, `packed` being the
    /// most texels that so many bytes can hold.
    pub(super) fn check_size(width: u64, height: u64, packed: u64) -> Result<(), Self> {
        match width.checked_mul(height) {
            Some(texels @ 1..=MAX_TEXELS) if texels > packed => {
                Err(Self::Truncated(format!("too early for {width} x {height} texels")))
            }
            Some(1..=MAX_TEXELS) => Ok(()),
            _ => Err(Self::Size { width, height }),
        }
    }
}
