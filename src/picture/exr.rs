//! OpenEXR, block by block, so that what is missing is noticed and memory is bounded.

use std::collections::HashSet;
use std::io::Cursor;

use ::exr::block::reader::ChunksReader;
use ::exr::error::Error as ExrError;
use ::exr::meta::header::Header;
use ::exr::prelude::{Compression, MetaData, SampleType, f16};

use super::{Flaw, MAX_TEXELS};

/// Width, height, and the channels with their values as f32.
type Channels = (usize, usize, Vec<(String, Vec<f32>)>);

/// Decodes the finest level of the first layer that `wanted` finds channels in (by index); offsets of the data
/// window are dropped. Values of 32-bit integer channels are rounded to f32.
pub(super) fn decode(bytes: &[u8], wanted: impl Fn(&Header) -> Option<Vec<usize>>) -> Result<Channels, Flaw> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(flaw)?;
    for header in &meta.headers {
        check(header, bytes.len())?;
    }
    let found = meta.headers.iter().enumerate().find_map(|(i, header)| Some((i, wanted(header)?)));
    let Some((layer, channels)) = found else {
        let names = meta.headers.iter().flat_map(|h| &h.channels.list).map(|c| c.name.to_string());
        return Err(Flaw::Channels(names.collect()));
    };
    let header = &meta.headers[layer];
    let (width, height) = (header.layer_size.0, header.layer_size.1);
    if width * height * channels.len() > 4 * MAX_TEXELS as usize {
        let what = format!("{} channels of {width} x {height} texels at once", channels.len());
        return Err(Flaw::Unsupported(what));
    }

    let reader = ::exr::block::read(Cursor::new(bytes), false).map_err(flaw)?;
    let finest = |block: ::exr::block::BlockIndex| block.layer == layer && block.level.0 + block.level.1 == 0;
    let blocks = reader.filter_chunks(false, |_, _, block| finest(block)).map_err(flaw)?;
    let mut planes: Vec<_> = channels
        .iter()
        .map(|&c| (header.channels.list[c].name.to_string(), vec![0.0; width * height]))
        .collect();
    let (mut seen, mut covered) = (HashSet::new(), 0);
    for block in blocks.sequential_decompressor(false) {
        let block = block.map_err(flaw)?;
        // The table of contents may point to another block than it says.
        if !finest(block.index) || !seen.insert((block.index.pixel_position.0, block.index.pixel_position.1))
        {
            return Err(Flaw::Damaged("its table of blocks names one twice".to_owned()));
        }
        covered += block.index.pixel_size.area();
        for line in block.lines(&header.channels) {
            let at = line.location;
            let Some(slot) = channels.iter().position(|&c| c == at.channel) else { continue };
            let start = at.position.1 * width + at.position.0;
            let target = &mut planes[slot].1[start..start + at.sample_count];
            match header.channels.list[at.channel].sample_type {
                SampleType::F32 => line.read_samples_into_slice(target).map_err(flaw)?,
                SampleType::F16 => fill(target, line.read_samples::<f16>(), f16::to_f32)?,
                SampleType::U32 => fill(target, line.read_samples::<u32>(), |v| v as f32)?,
            }
        }
    }
    if covered != width * height {
        return Err(Flaw::Truncated(format!("after {covered} of {} texels", width * height)));
    }
    Ok((width, height, planes))
}

fn fill<T>(
    target: &mut [f32],
    samples: impl Iterator<Item = ::exr::error::Result<T>>,
    convert: impl Fn(T) -> f32,
) -> Result<(), Flaw> {
    for (slot, sample) in target.iter_mut().zip(samples) {
        *slot = convert(sample.map_err(flaw)?);
    }
    Ok(())
}

/// Refuses what the crate would stumble over, before it allocates anything.
fn check(header: &Header, file: usize) -> Result<(), Flaw> {
    let (width, height) = (header.layer_size.0 as u64, header.layer_size.1 as u64);
    // ZIP gets 1032 bytes into one, which are 516 values of 16 bits; all others pack less.
    let channels = header.channels.list.len().max(1);
    Flaw::check_size(width, height, 640 * file as u64 / channels as u64)?;
    if header.deep {
        return Err(Flaw::Unsupported("deep OpenEXR data".to_owned()));
    }
    // exr 1.74.2 has no decoder for HTJ2K. Its decoder for DWA claims whatever memory a damaged block asks for,
    // which ends the process, and the one for B44 overflows (a panic) on damaged blocks; both lose values anyway.
    use Compression::{B44, B44A, DWAA, DWAB, HTJ2K32, HTJ2K256};
    if let DWAA(_) | DWAB(_) | B44 | B44A | HTJ2K32 | HTJ2K256 = header.compression {
        let name = header.compression.to_string().to_uppercase();
        let name = name.trim_end_matches(" COMPRESSION");
        return Err(Flaw::Unsupported(format!(
            "OpenEXR compression {name}; ZIP, PIZ, RLE, PXR24 or none can be read"
        )));
    }
    if let Some(channel) = header.channels.list.iter().find(|c| c.sampling.area() != 1) {
        return Err(Flaw::Unsupported(format!("OpenEXR with the subsampled channel {}", channel.name)));
    }
    if header.chunk_count.saturating_mul(8) > file {
        return Err(Flaw::Truncated("in the table of blocks".to_owned()));
    }
    Ok(())
}

fn flaw(error: ExrError) -> Flaw {
    match error {
        ExrError::NotSupported(what) => Flaw::Unsupported(format!("OpenEXR with {what}")),
        // What the crate makes of every unexpected end.
        ExrError::Invalid(what) if what.contains("missing bytes") => {
            Flaw::Truncated("before all of its blocks".to_owned())
        }
        ExrError::Invalid(what) => Flaw::Damaged(what.into_owned()),
        error => Flaw::Damaged(error.to_string()),
    }
}
