//! Samplers that are not in Rust: samples read from files and pipes, and programs that are asked for them.
//!
//! - [`Samples`] reads NumPy arrays, text and bytes, row after row, however many there are, as [`Rows`](crate::verify::Rows) for
//!   [`recording`](crate::verify::recording);
//! - [`Program`] is a running program as a [`Sampler`](crate::sampler::Sampler), by the protocol of `docs/protocol.md`;
//! - [`Convention`] is what others mean by a direction and by a density.

mod binary;
mod columns;
mod convention;
mod conventions;
mod coordinates;
mod corrections;
mod domain_name;
mod error;
mod npy;
mod npz;
mod process;
mod program;
mod source;
mod table;
mod text;
mod two;

pub use binary::BinaryRows;
pub use columns::{Columns, Kind, Layout, Number};
pub use convention::{Convention, Frame, Measure, MeasureFactor};
pub use conventions::{AGAIN, Given, of_program, of_samples};
pub use coordinates::Coordinates;
pub use corrections::of_densities;
pub use domain_name::DomainName;
pub use error::{NotTheta, ReadError};
pub use npy::NpyHeader;
pub use process::{Greeting, ProgramError};
pub use program::{FIRST_TIMEOUT, Program, ProgramRows, Started, TIMEOUT, WithTable};
pub use source::{Held, Keeping, Place, Samples, read_array, read_to_nothing};
pub use table::{Table, TableError};
pub use two::{OneOfTwo, of_two};
