//! Pictures: read light probes, write evidence.
//!
//! Three rasters, all with row 0 on top and texels in row order:
//!
//! | type | texel | meaning |
//! | --- | --- | --- |
//! | [`Picture`] | `[f32; 3]` | linear RGB, any range: radiance |
//! | [`Field`] | `f64` | a figure a cell (a count, a residual), NaN outside of the domain |
//! | [`Canvas`] | `[u8; 3]` | sRGB bytes, ready for a screen |
//!
//! [`read`] makes a picture from Radiance HDR or OpenEXR; [`Tone`] shows a picture and [`Heat`] a field as a
//! canvas; [`Sheet`] lays canvases out with their labels and [`Legend`]s. [`write_exr`], [`write_png`] and
//! [`write_atomically`] never leave half a file behind.
//!
//! ```
//! use warpcheck::picture::{Field, Heat, Sheet, Tile, write_png};
//!
//! let counts = Field::from_fn(32, 16, |x, y| (x * y) as f64);
//! let residuals = Field::from_fn(32, 16, |x, y| (x as f64 - 15.5) / (y as f64 + 1.0));
//!
//! let counted = Heat::counts(&counts);
//! let judged = Heat::residuals(5.0);
//! let sheet = Sheet::new("uniform sphere")
//!     .columns(["counts", "residuals"])
//!     .row("512 cells", [
//!         Tile::new(counted.paint(&counts)).legend(counted.legend("samples a cell")),
//!         Tile::new(judged.paint(&residuals)).legend(judged.legend("standard deviations")),
//!     ]);
//!
//! let folder = tempfile::tempdir()?;
//! write_png(folder.path().join("sphere.png"), &sheet.draw())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod atomic;
mod canvas;
mod colour;
mod error;
mod exr;
mod hdr;
mod heat;
mod label;
mod legend;
mod raster;
mod read;
mod resize;
mod scale;
mod sheet;
mod tone;
mod write;

pub use atomic::{file_stem, write_atomically};
pub use canvas::Canvas;
pub use colour::ColourMap;
pub use error::{Error, Flaw};
pub use heat::{Field, Heat};
pub use label::{GLYPH, TextSize, draw_text, text_width, wrap_text};
pub use legend::Legend;
pub use raster::{BadTexel, Picture, Planes};
pub use read::{decode, decode_planes, read, read_planes};
pub use resize::Shrink;
pub use scale::{Scale, Tick};
pub use sheet::{Sheet, Tile};
pub use tone::{Tone, decode_srgb, encode_gamma, encode_srgb, expose, log_position, quantise};
pub use write::{Compression, encode_indexed_png, encode_png, write_exr, write_planes, write_png};

/// The most texels that a file may announce: 2^27, enough for 16384 x 8192.
pub const MAX_TEXELS: u64 = 1 << 27;
