//! Pictures: read light probes, write evidence.

mod atomic;
mod canvas;
mod error;
mod exr;
mod hdr;
mod raster;
mod read;
mod resize;
mod tone;
mod write;

pub use atomic::write_atomically;
pub use canvas::Canvas;
pub use error::{Error, Flaw};
pub use raster::{BadTexel, Picture, Planes};
pub use read::{decode, decode_planes, read, read_planes};
pub use resize::Shrink;
pub use tone::{Tone, decode_srgb, encode_gamma, encode_srgb, expose, log_position, quantise};
pub use write::{Compression, write_exr, write_planes, write_png};

/// The most texels that a file may announce: 2^27, enough for 16384 x 8192.
pub const MAX_TEXELS: u64 = 1 << 27;
