//! Radiance HDR (`.hdr`, `.pic`), after Ward's `color.c`.
//!
//! Our own decoder rather than that of the `image` crate, which overflows (a panic) on chains of old-style run
//! markers, lets a run of length zero pass, never compares the length that a scanline announces with the
//! picture's, and knows one of the eight orientations. The tests hold both against each other.

use super::{Flaw, Picture};

/// Decodes a whole file. A mantissa m with exponent e is m * 2^(e - 136), exactly; `EXPOSURE` and `COLORCORR`
/// are not applied.
pub(super) fn decode(bytes: &[u8]) -> Result<Picture, Flaw> {
    let mut rest = bytes;
    let orientation = header(&mut rest)?;
    let Orientation { lines, length, .. } = orientation;
    // A constant scanline of 2^15 texels in old runs has 2731 a byte, and nobody's is longer.
    Flaw::check_size(length as u64, lines as u64, 4096 * rest.len() as u64)?;

    // Grows with the data that is there: a header alone allocates nothing.
    let mut scanned: Vec<[u8; 4]> = Vec::new();
    for line in 0..lines {
        scanline(&mut rest, length, &mut scanned).map_err(|problem| match problem {
            Problem::End => Flaw::Truncated(format!("in scanline {line} of {lines}")),
            Problem::Bad(what) => Flaw::Damaged(format!("scanline {line} of {lines} {what}")),
        })?;
    }
    let (width, height) = if orientation.rows_first { (length, lines) } else { (lines, length) };
    Ok(Picture::from_fn(width, height, |x, y| {
        let x = if orientation.x_grows { x } else { width - 1 - x };
        let y = if orientation.y_grows { height - 1 - y } else { y };
        texel(scanned[if orientation.rows_first { y * width + x } else { x * height + y }])
    }))
}

fn texel([r, g, b, e]: [u8; 4]) -> [f32; 3] {
    // 2^(e - 136) made of its bits: f32 could not hold it for small e, and the product is exact in f32.
    let unit = if e == 0 { 0.0 } else { f64::from_bits((u64::from(e) + 1023 - 136) << 52) };
    [r, g, b].map(|m| (f64::from(m) * unit) as f32)
}

/// How scanlines lie in the picture. The usual `-Y height +X width`: rows first, y falling, x growing.
struct Orientation {
    lines: usize,
    length: usize,
    rows_first: bool,
    x_grows: bool,
    y_grows: bool,
}

fn header(rest: &mut &[u8]) -> Result<Orientation, Flaw> {
    let mut line = || {
        let end = rest.iter().position(|&b| b == b'\n');
        let end = end.ok_or_else(|| Flaw::Truncated("in the header".to_owned()))?;
        let line = String::from_utf8_lossy(&rest[..end]).trim_end_matches('\r').to_owned();
        *rest = &rest[end + 1..];
        Ok(line)
    };
    loop {
        let line = line()?;
        if line.is_empty() {
            break;
        }
        if let Some(format) = line.strip_prefix("FORMAT=").map(str::trim)
            && format != "32-bit_rle_rgbe"
        {
            return Err(Flaw::Unsupported(format!("Radiance format {format:.40}, only 32-bit_rle_rgbe")));
        }
    }
    let size = line()?;
    let damaged = || Flaw::Damaged(format!("{size:.60?} is no size like \"-Y 256 +X 512\""));
    let words: Vec<_> = size.split_whitespace().collect();
    let &[first, lines, second, length] = words.as_slice() else { return Err(damaged()) };
    let (rows_first, x, y) = match (first, second) {
        ("-Y" | "+Y", "-X" | "+X") => (true, second, first),
        ("-X" | "+X", "-Y" | "+Y") => (false, first, second),
        _ => return Err(damaged()),
    };
    // As u32: then no sum or product of two of them overflows.
    let number = |word: &str| word.parse::<u32>().map(|n| n as usize).map_err(|_| damaged());
    Ok(Orientation {
        lines: number(lines)?,
        length: number(length)?,
        rows_first,
        x_grows: x == "+X",
        y_grows: y == "+Y",
    })
}

enum Problem {
    End,
    Bad(&'static str),
}

fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], Problem> {
    let (taken, after) = rest.split_first_chunk().ok_or(Problem::End)?;
    *rest = after;
    Ok(*taken)
}

/// Appends one scanline of `length` texels.
fn scanline(rest: &mut &[u8], length: usize, out: &mut Vec<[u8; 4]>) -> Result<(), Problem> {
    match *rest {
        [2, 2, high @ ..=127, low, ..] if (8..=32767).contains(&length) => {
            if usize::from(u16::from_be_bytes([*high, *low])) != length {
                return Err(Problem::Bad("is not as long as the picture is wide"));
            }
            *rest = &rest[4..];
            run_length(rest, length, out)
        }
        _ => flat(rest, length, out),
    }
}

/// Each of the four components by itself: a byte n <= 128 is followed by n values, a larger one by a value that
/// is meant n - 128 times.
fn run_length(rest: &mut &[u8], length: usize, out: &mut Vec<[u8; 4]>) -> Result<(), Problem> {
    let start = out.len();
    out.resize(start + length, [0; 4]);
    for component in 0..4 {
        let mut at = start;
        while at < out.len() {
            let [code] = take(rest)?;
            let count = usize::from(if code > 128 { code - 128 } else { code });
            if count == 0 {
                return Err(Problem::Bad("has a run of length zero"));
            }
            if at + count > out.len() {
                return Err(Problem::Bad("has a run that leaves the picture"));
            }
            let repeated = if code > 128 { Some(take::<1>(rest)?[0]) } else { None };
            for texel in &mut out[at..at + count] {
                texel[component] = match repeated {
                    Some(value) => value,
                    None => take::<1>(rest)?[0],
                };
            }
            at += count;
        }
    }
    Ok(())
}

/// Plain texels, among which (1, 1, 1, n) repeats the one before n times; markers in a row are the digits of
/// one number to the base 256, lowest first.
fn flat(rest: &mut &[u8], length: usize, out: &mut Vec<[u8; 4]>) -> Result<(), Problem> {
    let end = out.len() + length;
    let (mut shift, mut last) = (0, None);
    while out.len() < end {
        match take(rest)? {
            [1, 1, 1, digit] => {
                let Some(last) = last else { return Err(Problem::Bad("begins with a repeat marker")) };
                let count = if shift <= 24 { usize::from(digit) << shift } else { usize::MAX };
                if count > end - out.len() {
                    return Err(Problem::Bad("has a run that leaves the picture"));
                }
                out.resize(out.len() + count, last);
                shift += 8;
            }
            texel => {
                out.push(texel);
                (shift, last) = (0, Some(texel));
            }
        }
    }
    Ok(())
}
