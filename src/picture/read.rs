//! Reading pictures, whatever their file is called.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use super::{Error, Flaw, Picture, Planes, exr, hdr};

/// No picture of [`MAX_TEXELS`](super::MAX_TEXELS) needs more: four channels of 32 bits, uncompressed.
const MAX_BYTES: u64 = super::MAX_TEXELS * 16 + (1 << 20);

/// Reads a Radiance HDR or OpenEXR file as linear RGB, told apart by their first bytes.
///
/// Values stay as they are: no exposure, no white balance, no judgement of negative or non-finite ones (ask
/// [`Picture::first_bad_texel`]). Of OpenEXR the first layer is taken that has channels `R`, `G` and `B`, or `Y`
/// (then grey), at its finest level and without the offset of its data window.
///
/// # Errors
/// [`Error::Read`] if the file is missing, no regular file or not readable; [`Error::Decode`] with the [`Flaw`]
/// if its content is not a whole picture of 1 to [`MAX_TEXELS`](super::MAX_TEXELS) texels. Memory is only
/// claimed for a size that has been checked.
pub fn read(path: impl AsRef<Path>) -> Result<Picture, Error> {
    let path = path.as_ref();
    decode(&bytes(path)?).map_err(|flaw| flaw.at(path))
}

/// Reads every channel of the first layer of an OpenEXR file.
///
/// # Errors
/// As [`read`]; also [`Flaw::Unknown`] for a Radiance HDR file.
pub fn read_planes(path: impl AsRef<Path>) -> Result<Planes, Error> {
    let path = path.as_ref();
    decode_planes(&bytes(path)?).map_err(|flaw| flaw.at(path))
}

/// [`read`] for a file that is in memory already.
///
/// # Errors
/// The [`Flaw`] that keeps the bytes from being a picture.
pub fn decode(bytes: &[u8]) -> Result<Picture, Flaw> {
    match format(bytes)? {
        Format::Hdr => hdr::decode(bytes),
        Format::Exr => {
            let (width, height, planes) = exr::decode(bytes, |header| {
                let index = |name: &str| header.channels.list.iter().position(|c| c.name == *name);
                match (index("R"), index("G"), index("B"), index("Y")) {
                    (Some(r), Some(g), Some(b), _) => Some(vec![r, g, b]),
                    (_, _, _, Some(y)) => Some(vec![y]),
                    _ => None,
                }
            })?;
            let plane = |c: usize| planes[c.min(planes.len() - 1)].1.as_slice();
            let (r, g, b) = (plane(0), plane(1), plane(2));
            Ok(Picture::from_fn(width, height, |x, y| {
                let i = y * width + x;
                [r[i], g[i], b[i]]
            }))
        }
    }
}

/// [`read_planes`] for a file that is in memory already.
///
/// # Errors
/// The [`Flaw`] that keeps the bytes from being planes.
pub fn decode_planes(bytes: &[u8]) -> Result<Planes, Flaw> {
    let Format::Exr = format(bytes)? else { return Err(Flaw::Unknown) };
    let (width, height, planes) =
        exr::decode(bytes, |header| Some((0..header.channels.list.len()).collect()))?;
    Planes::new(width, height, planes).map_err(|error| Flaw::Damaged(error.to_string()))
}

enum Format {
    Hdr,
    Exr,
}

fn format(bytes: &[u8]) -> Result<Format, Flaw> {
    const EXR: &[u8] = &[0x76, 0x2f, 0x31, 0x01];
    const HDR: [&[u8]; 2] = [b"#?RADIANCE", b"#?RGBE"];
    let truncated = |magic: &[u8]| bytes.len() < magic.len() && magic.starts_with(bytes);
    if bytes.is_empty() {
        Err(Flaw::Empty)
    } else if bytes.starts_with(EXR) {
        Ok(Format::Exr)
    } else if HDR.iter().any(|magic| bytes.starts_with(magic)) {
        Ok(Format::Hdr)
    } else if truncated(EXR) || HDR.iter().any(|magic| truncated(magic)) {
        Err(Flaw::Truncated("in its first bytes".to_owned()))
    } else {
        Err(Flaw::Unknown)
    }
}

/// The content of a regular file that can be a picture; others (pipes, devices) might never end.
fn bytes(path: &Path) -> Result<Vec<u8>, Error> {
    let load = || {
        let meta = fs::metadata(path)?;
        if !meta.is_file() {
            return Err(io::Error::other("not a regular file"));
        }
        let mut bytes = Vec::new();
        File::open(path)?.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(io::Error::other(format!("larger than {MAX_BYTES} bytes")));
        }
        Ok(bytes)
    };
    load().map_err(|source| Error::read(path, source))
}
