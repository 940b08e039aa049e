//! A film on disk, from which a rendering goes on as if it had never stopped.
//!
//! A picture in `f32` has lost what is needed for that, so the sums are written as they are. All numbers are little-endian:
//!
//! | bytes | what |
//! | --- | --- |
//! | 16 | `warpcheck film`, padded with zeros |
//! | 4 | version: 1 |
//! | 8 + n | what was rendered: a number n, and so many bytes of UTF-8, one `name=value` a line |
//! | 4, 4 | width, height |
//! | 8, 8, 8 | passes, samples that were not finite, nanoseconds spent in passes |
//! | 56 for each pixel | sums of red, green, blue; sums of their squares; number of samples |
//! | 8 | FNV-1a of all before it |
//!
//! A film is continued only by the scene, lights, strategy and seed that it is of; anything else is refused, saying what differs.

use super::{Film, Lights, Pixel, Rendered, Strategy};
use crate::picture::{self, write_atomically};
use crate::random::fnv1a;
use crate::scene::Scene;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

const MAGIC: &[u8; 16] = b"warpcheck film\0\0";
const VERSION: u32 = 1;
/// Bytes of a pixel.
const PIXEL: usize = 56;

/// Why a film can't be read or continued.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FilmError {
    /// The file could not be read.
    #[error("cannot read {}: {source}", file.display())]
    Read {
        /// The film.
        file: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The file could not be written; the message names it.
    #[error(transparent)]
    Write(#[from] picture::Error),
    /// The file is no film, or damaged.
    #[error("{} is no film: {what}", file.display())]
    Malformed {
        /// The film.
        file: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// The film is of something else.
    #[error("{} is a film of another {what}: {found}, not {expected}", file.display())]
    Other {
        /// The film.
        file: PathBuf,
        /// What differs: `scene`, `strategy`, …
        what: &'static str,
        /// What the film is of.
        found: String,
        /// What it should be of.
        expected: String,
    },
}

/// What a film is of.
fn identity(scene: &Scene, lights: &Lights, strategy: Strategy, seed: u64) -> [(&'static str, String); 6] {
    let mut geometry = String::new();
    // Debug writes every bit of a float that it takes to read it back.
    let _ = write!(
        geometry,
        "{:?}{:?}{:?}{:?}{:?}",
        scene.triangles, scene.materials, scene.emitters, scene.convention, scene.camera
    );
    let sampling = match lights.sampling().filter(|_| strategy.draws_lights()) {
        Some(sampling) => sampling.to_string(),
        None => "none".to_owned(),
    };
    let picture = scene.picture;
    [
        ("picture", format!("{} x {} pixels", picture.width, picture.height)),
        ("scene", format!("fingerprint {:016x}", fnv1a(geometry.as_bytes()))),
        ("sky", format!("fingerprint {:016x}", lights.sky_fingerprint())),
        ("strategy", strategy.to_string()),
        ("light sampling", sampling),
        ("seed", seed.to_string()),
    ]
}

impl Rendered {
    /// Writes the film, whole or not at all, so that [`open`](Self::open) can go on with it. The scene and its lights are those it was
    /// rendered with.
    ///
    /// # Errors
    /// If the file can't be written.
    pub fn save(&self, file: impl AsRef<Path>, scene: &Scene, lights: &Lights) -> Result<(), FilmError> {
        let lines = identity(scene, lights, self.strategy, self.seed)
            .map(|(name, value)| format!("{name}={value}\n"));
        let text = lines.concat();
        let mut bytes = Vec::with_capacity(128 + text.len() + PIXEL * self.film.pixels().len());
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend((text.len() as u64).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes.extend((self.film.width() as u32).to_le_bytes());
        bytes.extend((self.film.height() as u32).to_le_bytes());
        let nanoseconds = self.time.as_nanos() as u64;
        for number in [u64::from(self.passes), self.non_finite, nanoseconds] {
            bytes.extend(number.to_le_bytes());
        }
        for pixel in self.film.pixels() {
            let (sums, count) = pixel.sums();
            sums.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
            bytes.extend(count.to_le_bytes());
        }
        bytes.extend(fnv1a(&bytes).to_le_bytes());
        Ok(write_atomically(file, |out| out.write_all(&bytes))?)
    }

    /// Reads a film of this scene, these lights, this strategy and this seed, to go on with [`resume`](Self::resume): the picture is the
    /// one that would have been made at once, bit for bit.
    ///
    /// # Errors
    /// If the file can't be read, is damaged, or is a film of something else.
    pub fn open(
        file: impl AsRef<Path>,
        scene: &Scene,
        lights: &Lights,
        strategy: Strategy,
        seed: u64,
    ) -> Result<Self, FilmError> {
        let file = file.as_ref();
        let bytes = std::fs::read(file).map_err(|source| FilmError::Read { file: file.into(), source })?;
        let malformed = |what: &str| FilmError::Malformed { file: file.into(), what: what.into() };
        let cut = || malformed("it ends too early; was it copied whole?");
        let body = bytes.strip_prefix(MAGIC).ok_or_else(|| malformed("it begins otherwise"))?;
        let mut rest = Reader(body);
        match rest.number::<4>().map(u32::from_le_bytes).ok_or_else(cut)? {
            VERSION => {}
            other => return Err(malformed(&format!("its version is {other}, and only {VERSION} is known"))),
        }
        // Before anything else is believed.
        let (all, sum) = bytes.split_last_chunk::<8>().ok_or_else(cut)?;
        if fnv1a(all) != u64::from_le_bytes(*sum) {
            return Err(malformed("its checksum is wrong: it is cut off or damaged"));
        }
        let length = rest.long().and_then(|n| usize::try_from(n).ok()).ok_or_else(cut)?;
        let text = std::str::from_utf8(rest.take(length).ok_or_else(cut)?);
        let text = text.map_err(|_| malformed("what it is of is no UTF-8"))?;
        for (what, expected) in identity(scene, lights, strategy, seed) {
            let value = |line: &'_ str| line.strip_prefix(what)?.strip_prefix('=').map(str::to_owned);
            let found = text.lines().find_map(value);
            let found = found.ok_or_else(|| malformed(&format!("it names no {what}")))?;
            if found != expected {
                return Err(FilmError::Other { file: file.into(), what, found, expected });
            }
        }
        let size = [(); 2].map(|()| rest.number::<4>().map(|n| u32::from_le_bytes(n) as usize));
        let [Some(width), Some(height)] = size else { return Err(cut()) };
        let numbers = [(); 3].map(|()| rest.long());
        let [Some(passes), Some(non_finite), Some(nanoseconds)] = numbers else { return Err(cut()) };
        if rest.0.len() != PIXEL * width * height + 8 {
            return Err(malformed("it has another number of pixels than it says"));
        }
        let mut film = Film::new(width, height);
        for pixel in film.pixels_mut() {
            let sums = [(); 6].map(|()| rest.long().map_or(f64::NAN, f64::from_bits));
            let count = rest.long().ok_or_else(cut)?;
            *pixel = Pixel::from_sums(sums, count);
        }
        Ok(Self {
            film,
            passes: u32::try_from(passes).map_err(|_| malformed("it has more passes than 2^32"))?,
            non_finite,
            time: Duration::from_nanos(nanoseconds),
            strategy,
            seed,
            weights: None,
        })
    }
}

struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    fn number<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn long(&mut self) -> Option<u64> {
        self.number().map(u64::from_le_bytes)
    }
}
