//! What an estimate can't be made from.

use crate::{picture, sampler};
use std::path::PathBuf;

/// Why there are no lights, no strategy or no comparison.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The environment map could not be read; the message names the file.
    #[error(transparent)]
    Picture(#[from] picture::Error),
    /// The environment map was read, but nothing can be sampled from it.
    #[error("{}: {source}", file.display())]
    Map {
        /// The map.
        file: PathBuf,
        /// What is wrong with it.
        source: sampler::Error,
    },
    /// The emitters of the scene can't be sampled.
    #[error("{}: {source}", file.display())]
    Emitters {
        /// The scene file.
        file: PathBuf,
        /// What is wrong with them.
        source: sampler::Error,
    },
    /// Neither an emitter nor a map.
    #[error("{}: there is no light to sample: no emitters, and no environment map was given", file.display())]
    NoLight {
        /// The scene file.
        file: PathBuf,
    },
    /// Not the name of a strategy.
    #[error(
        "`{given}` is no strategy; it must be uniform, brdf, light, mis, mis:C with C from 0 to 1, mis:auto, mis-two, or mis-two:power"
    )]
    Strategy {
        /// What was given.
        given: String,
    },
    /// Not the name of a way to sample lights.
    #[error("`{given}` is no way to sample lights; it must be one of {known}")]
    LightSampling {
        /// What was given.
        given: String,
        /// What there is.
        known: String,
    },
    /// Two pictures of different shape can't be compared.
    #[error("{} x {} blocks of {} pixels cannot be compared with {} x {} blocks of {}",
        first[0], first[1], first[2], second[0], second[1], second[2])]
    Shape {
        /// Columns, rows and block size of the first.
        first: [usize; 3],
        /// Those of the second.
        second: [usize; 3],
    },
}
