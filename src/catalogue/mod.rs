//! The samplers that ship, on the maps and meshes that ship: what `warpcheck verify` runs when nothing is named.
//!
//! This is where samplers are listed, and so the one place where they are trait objects ([`Subject`]). An [`Entry`] reads its data only when
//! it is made.

mod entries;
mod subject;

pub use entries::{Entry, entries};
pub use subject::{HistogramFigure, Subject};

use crate::spelling::edit_distance;
use std::path::{Path, PathBuf};

/// Why an entry can't be made, naming its file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A map can't be read.
    #[error(transparent)]
    Picture(#[from] crate::picture::Error),
    /// A mesh can't be read.
    #[error(transparent)]
    Scene(#[from] crate::scene::Error),
    /// What was read can't be sampled.
    #[error("{}: {error}", file.display())]
    Sampler {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        error: crate::sampler::Error,
    },
    /// A sampler can't be made from its parameters.
    #[error(transparent)]
    Parameter(#[from] crate::sampler::Error),
}

/// Reads an environment map and builds its tables.
///
/// # Errors
/// If the file can't be read, has a texel that is negative, NaN or infinite, or is black.
pub fn read_environment(
    file: &Path,
    rows: crate::sampler::RowWarp,
) -> Result<crate::sampler::Environment, Error> {
    crate::sampler::Environment::from_map(read_map(file)?, rows)
        .map_err(|error| Error::Sampler { file: file.into(), error })
}

/// Reads an environment map.
///
/// # Errors
/// If the file can't be read, or has a texel that is negative, NaN or infinite.
pub fn read_map(file: &Path) -> Result<crate::sampler::RadianceMap, Error> {
    let map = crate::picture::read(file)?;
    let (width, height) = (map.width(), map.height());
    crate::sampler::RadianceMap::new(width, height, map.into_pixels())
        .map_err(|error| Error::Sampler { file: file.into(), error })
}

/// The entries whose name is `wanted` or begins with it up to a `/`; if there is none, the nearest name.
///
/// # Errors
/// The name that is nearest to `wanted`, if any is near.
pub fn find<'a>(entries: &'a [Entry], wanted: &str) -> Result<Vec<&'a Entry>, Option<&'a str>> {
    let wanted = wanted.trim_end_matches('/');
    let found: Vec<_> = entries
        .iter()
        .filter(|e| e.name == wanted || e.name.strip_prefix(wanted).is_some_and(|rest| rest.starts_with('/')))
        .collect();
    if !found.is_empty() {
        return Ok(found);
    }
    // The name itself, or a family, whichever is nearer.
    let names = entries.iter().flat_map(|e| {
        let slashes = e.name.match_indices('/').map(|(i, _)| &e.name[..i]);
        slashes.chain([e.name.as_str()])
    });
    // What was cut short is nearer than what was misspelt.
    let distance = |name: &str| if name.starts_with(wanted) { 0 } else { edit_distance(wanted, name) };
    let nearest = names.map(|name| (distance(name), name)).min_by_key(|(distance, _)| *distance);
    Err(nearest
        .filter(|(distance, name)| *distance * 2 <= name.len().max(wanted.len()))
        .map(|(_, name)| name))
}
