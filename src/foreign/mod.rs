//! Samplers that are not in Rust: samples read from files and pipes, and programs that are asked for them.

mod convention;
mod coordinates;
mod process;
mod program;

pub use convention::{Convention, Frame, Measure};
pub use coordinates::Coordinates;
pub use process::{Greeting, ProgramError};
pub use program::{Program, Started, TIMEOUT};
