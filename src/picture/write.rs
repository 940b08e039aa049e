//! Writing pictures, each whole or not at all, the same bytes for the same picture.

use std::collections::HashMap;
use std::io::{self, Cursor};
use std::path::Path;

use ::exr::prelude::{
    AnyChannel, AnyChannels, Compression as ExrCompression, Encoding, FlatSamples, Image, SmallVec, Text,
    WritableImage,
};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::{Canvas, Error, Picture, Planes, write_atomically};

/// How an OpenEXR file is packed; neither loses a bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Not at all.
    None,
    /// ZIP over blocks of 16 rows.
    #[default]
    Zip,
}

/// Writes an 8-bit RGB PNG. A [`Picture`] becomes a canvas by a [`Tone`](super::Tone).
///
/// # Errors
/// [`Error::Write`], naming the path; nothing is left behind then.
pub fn write_png(path: impl AsRef<Path>, canvas: &Canvas) -> Result<(), Error> {
    let path = path.as_ref();
    let side = |n: usize| u32::try_from(n).map_err(|error| Error::write(path, io::Error::other(error)));
    let (width, height) = (side(canvas.width())?, side(canvas.height())?);
    write_atomically(path, |out| {
        PngEncoder::new(out)
            .write_image(canvas.pixels().as_flattened(), width, height, ExtendedColorType::Rgb8)
            .map_err(io::Error::other)
    })
}

/// The bytes of an 8-bit RGB PNG, packed as tightly as is usual.
///
/// # Panics
/// If a side has more than 2^31 pixels.
pub fn encode_png(canvas: &Canvas) -> Vec<u8> {
    pack(canvas, png::ColorType::Rgb, None, canvas.pixels().as_flattened())
}

/// The bytes of a PNG with a palette, a third of the size; `None` if it has more than 256 colours.
///
/// ```
/// use warpcheck::picture::{Canvas, encode_indexed_png};
/// assert!(encode_indexed_png(&Canvas::filled(8, 8, [1, 2, 3])).is_some_and(|png| png.starts_with(b"\x89PNG")));
/// ```
pub fn encode_indexed_png(canvas: &Canvas) -> Option<Vec<u8>> {
    let mut places = HashMap::new();
    let mut palette: Vec<u8> = Vec::new();
    let indices = canvas.pixels().iter().map(|pixel| {
        let next = places.len();
        let index = *places.entry(*pixel).or_insert(next);
        if index == next {
            palette.extend(pixel);
        }
        u8::try_from(index).ok()
    });
    let indices: Vec<u8> = indices.collect::<Option<_>>()?;
    Some(pack(canvas, png::ColorType::Indexed, Some(palette), &indices))
}

fn pack(canvas: &Canvas, colour: png::ColorType, palette: Option<Vec<u8>>, bytes: &[u8]) -> Vec<u8> {
    let side = |n: usize| u32::try_from(n).expect("a canvas of less than 2^31 pixels a side");
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, side(canvas.width()), side(canvas.height()));
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    // Neighbouring indices of a palette don't predict each other.
    if let Some(palette) = palette {
        encoder.set_palette(palette);
        encoder.set_filter(png::Filter::NoFilter);
    }
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(bytes));
    written.expect("memory takes everything");
    out
}

/// Writes linear RGB as an OpenEXR file with 32-bit floats, bit for bit, ZIP-compressed.
///
/// # Errors
/// [`Error::Write`], naming the path; nothing is left behind then.
pub fn write_exr(path: impl AsRef<Path>, picture: &Picture) -> Result<(), Error> {
    write_planes(path, &picture.into(), Compression::Zip)
}

/// Writes named planes as an OpenEXR file with 32-bit floats, bit for bit.
///
/// # Errors
/// [`Error::Write`], naming the path; nothing is left behind then.
pub fn write_planes(path: impl AsRef<Path>, planes: &Planes, compression: Compression) -> Result<(), Error> {
    write_atomically(path, |out| {
        let channels: SmallVec<[_; 4]> = planes
            .names()
            .map(|name| {
                let values = planes.get(name).expect("its own name").to_vec();
                AnyChannel::new(Text::from(name), FlatSamples::F32(values))
            })
            .collect();
        let packed = match compression {
            Compression::None => ExrCompression::Uncompressed,
            Compression::Zip => ExrCompression::ZIP16,
        };
        let encoding = Encoding { compression: packed, ..Encoding::UNCOMPRESSED };
        let size = (planes.width(), planes.height());
        let image = Image::from_encoded_channels(size, encoding, AnyChannels::sort(channels));
        // In memory first: the format goes back to fill in its table of blocks.
        let mut bytes = Cursor::new(Vec::new());
        image.write().non_parallel().to_buffered(&mut bytes).map_err(io::Error::other)?;
        out.write_all(bytes.get_ref())
    })
}
