//! Files that are there whole or not at all.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

use super::Error;

/// A sampler's or file's name as a file name: what is no letter, digit, dot, line or dash becomes a dash.
///
/// ```
/// assert_eq!(warpcheck::picture::file_stem("phong/1e6"), "phong-1e6");
/// ```
pub fn file_stem(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || "._-".contains(c) { c } else { '-' }).collect()
}

/// Writes a file through `fill`, whole or not at all.
///
/// The bytes go to a temporary name in the same folder, are flushed to the disk, and only then take the place
/// of what stood there. When anything fails, the temporary is removed and the old file is as it was. A symbolic
/// link is followed; a device or pipe (`/dev/stdout`), which cannot be replaced, is written to directly.
///
/// ```
/// use std::io::Write;
/// use warpcheck::picture::write_atomically;
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("report.json");
/// write_atomically(&path, |out| writeln!(out, "{{}}"))?;
/// assert!(write_atomically(&path, |_| Err(std::io::Error::other("no more"))).is_err());
/// assert_eq!(std::fs::read_to_string(&path)?, "{}\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Write`], naming `path`, if `fill` or the operating system fails, or the old file is read-only.
pub fn write_atomically(
    path: impl AsRef<Path>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Error> {
    let path = path.as_ref();
    replace(path, Box::new(fill)).map_err(|source| Error::write(path, source))
}

type Fill<'a> = Box<dyn FnOnce(&mut dyn Write) -> io::Result<()> + 'a>;

fn replace(path: &Path, fill: Fill<'_>) -> io::Result<()> {
    let old = match fs::metadata(path) {
        Ok(meta) if meta.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(meta) if !meta.is_file() => {
            let mut out = BufWriter::new(OpenOptions::new().write(true).open(path)?);
            fill(&mut out)?;
            return out.flush();
        }
        Ok(meta) if meta.permissions().readonly() => return Err(io::ErrorKind::PermissionDenied.into()),
        Ok(meta) => Some((fs::canonicalize(path)?, meta)),
        Err(_) => None,
    };
    let target = old.as_ref().map_or(path, |(real, _)| real);
    let (file, mut temporary) = Temporary::beside(target)?;
    let mut out = BufWriter::new(file);
    fill(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    if let Some((_, meta)) = &old {
        file.set_permissions(meta.permissions())?;
    }
    file.sync_all()?;
    drop(file);
    fs::rename(&temporary.path, target)?;
    temporary.taken = true;
    Ok(())
}

/// A file that goes when we leave, even by a panic, unless it has been taken.
struct Temporary {
    path: PathBuf,
    taken: bool,
}

impl Temporary {
    fn beside(target: &Path) -> io::Result<(File, Self)> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        if target.file_name().is_none() {
            return Err(io::ErrorKind::InvalidFilename.into());
        }
        loop {
            // Not made of the target's name, which may be as long as names can be.
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            let path =
                target.with_file_name(OsString::from(format!(".warpcheck-{}-{number}.tmp", process::id())));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((file, Self { path, taken: false })),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.taken {
            // The error that brought us here is the one to report.
            let _ = fs::remove_file(&self.path);
        }
    }
}
