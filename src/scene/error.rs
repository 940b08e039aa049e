//! What can be wrong with a scene, told as one sentence that names the file, the line and the value.

use std::{io, path::PathBuf};

/// Why a mesh, a material library or a scene file was refused.
///
/// Lines count from 1. Messages are complete sentences without a final stop, so that a program can print them as they
/// are.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file could not be opened or read.
    #[error("cannot read {}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The file, a library with the mesh that names it, is larger than this reader is willing to hold in memory.
    #[error("{} is larger than {limit} bytes (with what was read before, if it is a library), which is the most that is read", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// The limit in bytes.
        limit: u64,
    },
    /// A line of an OBJ or MTL file does not have the form that its keyword asks for.
    #[error("{}:{line}: {what}", file.display())]
    Malformed {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What was expected and what was found.
        what: String,
    },
    /// A number of an OBJ or MTL file is NaN, infinite, or beyond the range of `f32`.
    #[error("{}:{line}: {what} is {value}, but it must be a finite number", file.display())]
    NotFinite {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// Which quantity.
        what: &'static str,
        /// The number as it was read.
        value: f32,
    },
    /// A material parameter is outside its range.
    #[error("{}:{line}: {what} of material `{material}` is {value}, but it must be {expected}", file.display())]
    MaterialRange {
        /// The MTL file, or the scene file if the value comes from there.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// Which parameter, as it is spelled in the file.
        what: &'static str,
        /// The name of the material.
        material: String,
        /// The value.
        value: f32,
        /// What is allowed.
        expected: &'static str,
    },
    /// A material returns more light than it receives.
    #[error("{}: material `{material}` reflects {value} in channel {channel}, more than it receives ({sum} must be at most 1)", file.display())]
    EnergyGain {
        /// The mesh that uses the material.
        file: PathBuf,
        /// The name of the material.
        material: String,
        /// 0 red, 1 green, 2 blue.
        channel: usize,
        /// The offending sum.
        value: f32,
        /// What is summed under the scene's convention.
        sum: &'static str,
    },
    /// A face refers to a vertex or a normal that the file has not defined above it.
    #[error("{}:{line}: the face refers to {what} {index}, but only {count} are defined above it", file.display())]
    IndexOutOfRange {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// `vertex`, `texture vertex` or `normal`.
        what: &'static str,
        /// The index as it is written: from 1, negative if it counts backwards.
        index: i64,
        /// How many there are so far.
        count: usize,
    },
    /// No fan of triangles from any one corner covers the polygon.
    #[error("{}:{line}: the polygon of {corners} corners is too concave or twisted to be cut into a fan; triangulate it first", file.display())]
    Polygon {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// How many corners the polygon has.
        corners: usize,
    },
    /// The mesh has no face: an empty file, or one that was cut off.
    #[error("{} has no faces ({vertices} vertices were read); is the file complete?", file.display())]
    NoFaces {
        /// The file.
        file: PathBuf,
        /// How many vertices it has.
        vertices: usize,
    },
    /// The material library that a mesh names cannot be read.
    #[error("{}:{line}: cannot read the material library {}: {source}", file.display(), library.display())]
    MissingLibrary {
        /// The OBJ file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The library as it was looked for.
        library: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// A face has no material, and the scene file gives none either.
    #[error("{}:{line}: {}; name a library with `mtllib` or give the mesh a `material` in the scene file", file.display(),
        match name { Some(n) => format!("material `{n}` is not defined"), None => "the face has no material".into() })]
    MissingMaterial {
        /// The OBJ file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The name after `usemtl`; `None` if a face comes before any.
        name: Option<String>,
    },
    /// The scene file is not valid TOML, or has keys or types that a scene does not have.
    #[error("{}:{line}: {message}", file.display())]
    Toml {
        /// The scene file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What the TOML reader says.
        message: String,
    },
    /// A value of the scene file cannot be used.
    #[error("{}:{line}: `{key}` {why}", file.display())]
    Value {
        /// The scene file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The key with its table, such as `camera.eye`.
        key: &'static str,
        /// Why it cannot be used.
        why: String,
    },
    /// Nothing in the scene emits light.
    #[error("{}: nothing emits light: no triangle with an area has K_e above 0, and there is no [environment]", file.display())]
    NoLight {
        /// The scene file.
        file: PathBuf,
    },
}
