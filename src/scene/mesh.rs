//! Meshes and materials from Wavefront OBJ and MTL files.
//!
//! [`tobj`] reads the formats; a pass over the text goes before it, because `tobj` names no line in its errors, takes
//! polylines for polygons, drops a library that cannot be read, and panics on a colour with fewer than three numbers.
//! The pass checks every number and every index, and hands on only lines that are known to be good.

use super::{Error, polygon};
use glam::{DVec3, Vec3};
use std::{
    borrow::Cow,
    collections::{HashMap, HashSet},
    fmt::Write as _,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

/// The largest file that is read, in bytes.
const LIMIT: u64 = 1 << 29;

/// A material as an MTL file states it; what the file leaves out is 0, and `ns` is 1.
///
/// How `kd`, `ks` and `ns` become a BRDF is for the scene to say ([`Convention`](super::Convention)). Textures
/// (`map_Kd` and so on) are not read. All values are linear.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name after `newmtl`.
    pub name: String,
    /// K_d, each channel at least 0.
    pub kd: Vec3,
    /// K_s, each channel at least 0.
    pub ks: Vec3,
    /// N_s, at least 0 and finite; 1e21 is fine.
    pub ns: f32,
    /// K_e: the radiance that the surface emits, the same in all directions of a side that emits.
    pub ke: Vec3,
    /// The roughness alpha of a GGX lobe in place of the Phong lobe, 1e-4 to 1; only scene files give one.
    pub roughness: Option<f32>,
}

impl Default for Material {
    fn default() -> Self {
        let (kd, ks, ke) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        Self { name: "default".into(), kd, ks, ns: 1.0, ke, roughness: None }
    }
}

impl Material {
    /// Whether any channel of K_e is above 0.
    pub fn emits(&self) -> bool {
        self.ke.max_element() > 0.0
    }

    /// The materials of an MTL file that is in memory; `file` stands for its place in messages.
    ///
    /// # Errors
    /// Whatever is wrong with the file: see [`Error`].
    ///
    /// ```
    /// let materials = warpcheck::scene::Material::from_mtl(b"newmtl lamp\nKe 1 2 3", "m.mtl")?;
    /// assert!(materials[0].emits());
    /// # Ok::<(), warpcheck::scene::Error>(())
    /// ```
    pub fn from_mtl(mtl: &[u8], file: impl AsRef<Path>) -> Result<Vec<Self>, Error> {
        let file = file.as_ref();
        let (_, checked) = check_mtl(file, &text(file, mtl)?)?;
        let (materials, _) = tobj::load_mtl_buf(&mut checked.as_bytes()).map_err(|e| refused(file, e))?;
        Ok(materials.into_iter().map(Self::from).collect())
    }
}

/// A triangle mesh with a material for each triangle, in the coordinates of its file.
///
/// Triangles stand in the order of the file's faces; a polygon of n corners becomes n - 2 of them. Vertices that no
/// face uses are left out; a vertex may stand in `positions` more than once (objects, groups and seams repeat it).
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions`, counterclockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals of the vertices, as many as `positions`, if the file has any; zero where it has none.
    pub normals: Option<Vec<Vec3>>,
    /// Index into `materials`, as many as `triangles`.
    pub material_of_triangle: Vec<u32>,
    /// Materials, in the order of their libraries; the one that stood in for a missing one comes last.
    pub materials: Vec<Material>,
    /// Names of the objects and groups that have faces, in the order of the file, without repetitions in a row.
    pub names: Vec<String>,
}

impl Mesh {
    /// Reads an OBJ file and the material libraries that it names (relative to the file).
    ///
    /// # Errors
    /// Whatever is wrong with the files: see [`Error`]. Every face must have a material.
    ///
    /// ```
    /// let data = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell_measured.obj");
    /// let mesh = warpcheck::scene::Mesh::read(data)?;
    /// assert_eq!(mesh.triangles.len(), 36);
    /// # Ok::<(), warpcheck::scene::Error>(())
    /// ```
    pub fn read(file: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read_with(file, None)
    }

    /// Like [`Mesh::read`], with a material for faces whose material is nowhere defined.
    ///
    /// ```
    /// use warpcheck::scene::{Material, Mesh};
    /// let data = concat!(env!("CARGO_MANIFEST_DIR"), "/data/mesh/spot.obj");
    /// assert!(Mesh::read(data).is_err()); // says `usemtl white`, names no library
    /// assert_eq!(Mesh::read_with(data, Some(Material::default()))?.triangles.len(), 5856);
    /// # Ok::<(), warpcheck::scene::Error>(())
    /// ```
    pub fn read_with(file: impl AsRef<Path>, fallback: Option<Material>) -> Result<Self, Error> {
        let file = file.as_ref();
        Self::from_obj(&load(file, &mut from_disk)?, file, fallback, from_disk)
    }

    /// Like [`Mesh::read_with`], for an OBJ file that is in memory. `file` stands for its place in messages and in the paths of the
    /// libraries, whose bytes `open` is asked for.
    ///
    /// # Errors
    /// As for [`Mesh::read`].
    ///
    /// ```
    /// let obj = b"mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3";
    /// let mesh = warpcheck::scene::Mesh::from_obj(obj, "m.obj", None, |_| Ok(b"newmtl a\nKd 1 1 1".to_vec()))?;
    /// assert_eq!(mesh.triangles.len(), 1);
    /// # Ok::<(), warpcheck::scene::Error>(())
    /// ```
    pub fn from_obj(
        obj: &[u8],
        file: impl AsRef<Path>,
        fallback: Option<Material>,
        mut open: impl FnMut(&Path) -> io::Result<Vec<u8>>,
    ) -> Result<Self, Error> {
        let file = file.as_ref();
        let checked = check_obj(file, &text(file, obj)?, fallback.is_some(), &mut open)?;
        Self::assemble(file, checked, fallback)
    }

    fn assemble(file: &Path, checked: Checked, fallback: Option<Material>) -> Result<Self, Error> {
        let options = tobj::LoadOptions { single_index: true, ..Default::default() };
        let library = |name: &Path| match checked.libraries.get(name) {
            Some(text) => tobj::load_mtl_buf(&mut text.as_bytes()),
            None => Err(tobj::LoadError::OpenFileFailed),
        };
        let (models, materials) = tobj::load_obj_buf(&mut checked.text.as_bytes(), &options, library)
            .map_err(|e| refused(file, e))?;
        let mut materials: Vec<Material> =
            materials.map_err(|e| refused(file, e))?.into_iter().map(Material::from).collect();
        let missing = materials.len() as u32;
        let mut mesh = Self {
            positions: Vec::new(),
            triangles: Vec::new(),
            normals: None,
            material_of_triangle: Vec::new(),
            materials: Vec::new(),
            names: Vec::new(),
        };
        let mut lines = checked.face_lines.iter();
        for tobj::Model { mesh: part, name } in models.iter().filter(|m| !m.mesh.indices.is_empty()) {
            let base = mesh.positions.len();
            mesh.positions.extend(part.positions.chunks_exact(3).map(Vec3::from_slice));
            // tobj pushes a normal only for a corner that has one, so equal lengths mean that all have.
            if !part.normals.is_empty() && part.normals.len() == part.positions.len() {
                let normals = mesh.normals.get_or_insert_default();
                normals.resize(base, Vec3::ZERO);
                normals.extend(part.normals.chunks_exact(3).map(|n| Vec3::from_slice(n).normalize_or_zero()));
            }
            let mut corners = part.indices.as_slice();
            let mut arities = part.face_arities.iter();
            while !corners.is_empty() {
                let (face, rest) = corners.split_at(arities.next().map_or(3, |&n| n as usize));
                corners = rest;
                let line = *lines.next().expect("tobj keeps one face for each line that was checked");
                let at = |i: u32| mesh.positions[base + i as usize].as_dvec3();
                let apex = polygon::fan_apex(face.len(), |i| at(face[i])).ok_or_else(|| Error::Polygon {
                    file: file.into(),
                    line,
                    corners: face.len(),
                })?;
                let corner = |i: usize| base as u32 + face[(apex + i) % face.len()];
                mesh.triangles.extend((1..face.len() - 1).map(|i| [corner(0), corner(i), corner(i + 1)]));
                let material = part.material_id.map_or(missing, |m| m as u32);
                mesh.material_of_triangle.resize(mesh.triangles.len(), material);
            }
            if mesh.names.last() != Some(name) {
                mesh.names.push(name.clone());
            }
        }
        if let Some(normals) = &mut mesh.normals {
            normals.resize(mesh.positions.len(), Vec3::ZERO);
        }
        materials.extend(fallback.filter(|_| mesh.material_of_triangle.contains(&missing)));
        mesh.materials = materials;
        Ok(mesh)
    }

    /// Replaces the normals by smooth ones: at each position the mean of the normals of the triangles that meet there,
    /// weighted by area (twice the area is what the cross product brings). Vertices at equal positions share a normal.
    pub fn smooth_normals(&mut self) {
        let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits); // -0 and 0 are one place
        let mut sums: HashMap<[u32; 3], DVec3> = HashMap::new();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| self.positions[i as usize].as_dvec3());
            for &i in triangle {
                *sums.entry(key(self.positions[i as usize])).or_default() += (b - a).cross(c - a);
            }
        }
        let normal = |p: &Vec3| sums.get(&key(*p)).map_or(Vec3::ZERO, |n| n.normalize_or_zero().as_vec3());
        self.normals = Some(self.positions.iter().map(normal).collect());
    }
}

/// What `tobj` refuses although the pass before it did not.
fn refused(file: &Path, error: tobj::LoadError) -> Error {
    Error::Malformed { file: file.into(), line: 1, what: error.to_string() }
}

impl From<tobj::Material> for Material {
    fn from(m: tobj::Material) -> Self {
        let colour = |c: Option<[f32; 3]>| c.map_or(Vec3::ZERO, Vec3::from);
        Self {
            name: m.name,
            kd: colour(m.diffuse),
            ks: colour(m.specular),
            ns: m.shininess.unwrap_or(1.0),
            ke: colour(m.emissive),
            roughness: None,
        }
    }
}

/// What the pass over an OBJ file leaves for `tobj`.
struct Checked {
    /// Only lines that matter, each known to be good.
    text: String,
    /// The line of each face.
    face_lines: Vec<usize>,
    /// The text of each library, cleaned in the same way, by the name that `mtllib` uses.
    libraries: HashMap<PathBuf, String>,
}

/// How files are read: from the disk, or from wherever the caller keeps them.
pub(super) type Open<'a> = &'a mut dyn FnMut(&Path) -> io::Result<Vec<u8>>;

/// The content of a regular file, up to the first byte that is too many; others (pipes, devices) might never end.
pub(super) fn from_disk(file: &Path) -> io::Result<Vec<u8>> {
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("not a regular file"));
    }
    let mut bytes = Vec::new();
    File::open(file)?.take(LIMIT + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// What `open` says about a file.
pub(super) fn load(file: &Path, open: Open) -> Result<Vec<u8>, Error> {
    open(file).map_err(|source| Error::Io { file: file.into(), source })
}

/// The bytes of a file as text; what is not UTF-8 (old comments, mostly) is replaced.
pub(super) fn text<'a>(file: &Path, bytes: &'a [u8]) -> Result<Cow<'a, str>, Error> {
    if bytes.len() as u64 > LIMIT {
        return Err(Error::TooLarge { file: file.into(), limit: LIMIT });
    }
    Ok(String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)))
}

/// A line of a file, for messages, cut into its keyword and the rest.
struct Line<'a> {
    file: &'a Path,
    number: usize,
    key: &'a str,
    rest: &'a str,
}

impl<'a> Line<'a> {
    /// The lines that say something.
    fn all(file: &'a Path, text: &'a str) -> impl Iterator<Item = Line<'a>> {
        text.lines().enumerate().filter_map(move |(i, line)| {
            let line = line.trim();
            let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            (!key.is_empty() && !key.starts_with('#')).then_some(Line {
                file,
                number: i + 1,
                key,
                rest: rest.trim(),
            })
        })
    }

    /// The words up to a comment.
    fn words(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.rest.split('#').next().unwrap_or("").split_whitespace()
    }

    fn malformed(&self, what: impl Into<String>) -> Error {
        Error::Malformed { file: self.file.into(), line: self.number, what: what.into() }
    }

    /// All words as finite numbers.
    fn numbers(&self, what: &'static str) -> Result<Vec<f32>, Error> {
        self.words()
            .map(|word| {
                let value: f32 = word.parse().map_err(|_| {
                    self.malformed(format!("{what} needs numbers, but `{}` is none", excerpt(word)))
                })?;
                self.finite(what, value)
            })
            .collect()
    }

    fn finite(&self, what: &'static str, value: f32) -> Result<f32, Error> {
        match value.is_finite() {
            true => Ok(value),
            false => Err(Error::NotFinite { file: self.file.into(), line: self.number, what, value }),
        }
    }
}

/// The beginning of a word, for messages: garbage can be long.
fn excerpt(word: &str) -> String {
    let mut short: String = word.chars().take(40).collect();
    if short.len() < word.len() {
        short.push('…');
    }
    short
}

/// Checks every line of an OBJ file and keeps those that describe the surface.
fn check_obj(file: &Path, obj: &str, allow_missing: bool, open: Open) -> Result<Checked, Error> {
    let mut out =
        Checked { text: String::with_capacity(obj.len()), face_lines: Vec::new(), libraries: HashMap::new() };
    let mut counts = [0_usize; 3]; // v, vt, vn
    let mut known = HashSet::new();
    let mut read = obj.len();
    let mut has_material = false;
    for line in Line::all(file, obj) {
        match line.key {
            "v" => {
                let n = line.numbers("a vertex")?;
                // Three coordinates, then a weight or a colour.
                let point = match n[..] {
                    [x, y, z] | [x, y, z, _, _, _] => [x, y, z],
                    [x, y, z, w] => [x / w, y / w, z / w],
                    _ => {
                        return Err(line.malformed(format!(
                            "a vertex has 3 coordinates (and a weight or a colour), not {} numbers",
                            n.len()
                        )));
                    }
                };
                for value in point {
                    line.finite("a vertex coordinate", value)?;
                }
                let [x, y, z] = point;
                counts[0] += 1;
                let _ = writeln!(out.text, "v {x} {y} {z}");
            }
            "vn" => {
                let n = line.numbers("a normal")?;
                let [x, y, z] = n[..] else {
                    return Err(line.malformed(format!("a normal has 3 numbers, not {}", n.len())));
                };
                counts[2] += 1;
                let _ = writeln!(out.text, "vn {x} {y} {z}");
            }
            "vt" => counts[1] += 1, // only counted: texture coordinates have no use here
            "f" => {
                if !has_material && !allow_missing {
                    return Err(Error::MissingMaterial { file: file.into(), line: line.number, name: None });
                }
                out.text.push('f');
                let mut corners = 0;
                for corner in line.words() {
                    let [v, _, vn] = check_corner(&line, corner, counts)?;
                    let v = v.unwrap_or_default();
                    let _ = match vn {
                        Some(n) => write!(out.text, " {v}//{n}"),
                        None => write!(out.text, " {v}"),
                    };
                    corners += 1;
                }
                if corners < 3 {
                    let found = format!("a face needs at least 3 corners, but this one has {corners}");
                    return Err(line.malformed(found));
                }
                out.text.push('\n');
                out.face_lines.push(line.number);
            }
            "usemtl" => {
                has_material = known.contains(line.rest);
                if line.rest.is_empty() {
                    return Err(line.malformed("`usemtl` needs the name of a material"));
                }
                if !has_material && !allow_missing {
                    let name = Some(excerpt(line.rest));
                    return Err(Error::MissingMaterial { file: file.into(), line: line.number, name });
                }
                let _ = writeln!(out.text, "usemtl {}", line.rest);
            }
            "mtllib" => {
                if line.rest.is_empty() {
                    return Err(line.malformed("`mtllib` needs the name of a file"));
                }
                if !out.libraries.contains_key(Path::new(line.rest)) {
                    let library = file.parent().unwrap_or(Path::new("")).join(line.rest);
                    let bytes = open(&library).map_err(|source| Error::MissingLibrary {
                        file: file.into(),
                        line: line.number,
                        library: library.clone(),
                        source,
                    })?;
                    // One large library under many names (m.mtl, d/../m.mtl, …) must not fill the memory either.
                    read += bytes.len();
                    if read as u64 > LIMIT {
                        return Err(Error::TooLarge { file: library, limit: LIMIT });
                    }
                    let (names, checked) = check_mtl(&library, &text(&library, &bytes)?)?;
                    known.extend(names);
                    out.libraries.insert(line.rest.into(), checked);
                    let _ = writeln!(out.text, "mtllib {}", line.rest);
                }
            }
            "o" | "g" => {
                let _ = writeln!(out.text, "{} {}", line.key, line.rest);
            }
            _ => {} // smoothing groups, lines, points, curves: nothing that light falls on
        }
    }
    if out.face_lines.is_empty() {
        return Err(Error::NoFaces { file: file.into(), vertices: counts[0] });
    }
    Ok(out)
}

/// The indices `v/vt/vn` of one corner, from 1, checked against what is defined so far.
fn check_corner(line: &Line, corner: &str, counts: [usize; 3]) -> Result<[Option<usize>; 3], Error> {
    const KINDS: [&str; 3] = ["vertex", "texture vertex", "normal"];
    let mut out = [None; 3];
    for (i, word) in corner.split('/').enumerate() {
        if word.is_empty() && i > 0 && i < 3 {
            continue;
        }
        let index: i64 = match word.parse() {
            Ok(index) if i < 3 => index,
            _ => {
                let found =
                    format!("`{}` is no corner of a face (v, v/vt, v//vn or v/vt/vn)", excerpt(corner));
                return Err(line.malformed(found));
            }
        };
        let count = counts[i];
        let resolved = if index < 0 { count as i128 + index as i128 + 1 } else { index as i128 };
        if resolved < 1 || resolved > count as i128 {
            let file = line.file.into();
            return Err(Error::IndexOutOfRange { file, line: line.number, what: KINDS[i], index, count });
        }
        out[i] = Some(resolved as usize);
    }
    Ok(out)
}

/// Checks an MTL file; returns the names it defines and the lines that matter.
fn check_mtl(file: &Path, text: &str) -> Result<(Vec<String>, String), Error> {
    let mut names: Vec<String> = Vec::new();
    let mut out = String::new();
    for line in Line::all(file, text) {
        let what = match line.key {
            "Kd" => "Kd",
            "Ks" => "Ks",
            "Ke" => "Ke",
            "Ns" => "Ns",
            "newmtl" if line.rest.is_empty() => return Err(line.malformed("`newmtl` needs a name")),
            "newmtl" => {
                names.push(line.rest.to_owned());
                let _ = writeln!(out, "newmtl {}", line.rest);
                continue;
            }
            _ => continue, // textures, transparency, illumination models
        };
        let Some(material) = names.last() else {
            return Err(line.malformed(format!("`{what}` stands before the first `newmtl`")));
        };
        let numbers = line.numbers(what)?;
        let values = match (what == "Ns", &numbers[..]) {
            (true, [_]) | (false, [_, _, _]) => numbers,
            (false, &[grey]) => vec![grey; 3], // the format: g and b default to r
            _ => {
                let expected = if what == "Ns" { "1 number" } else { "3 numbers" };
                let found = format!("`{what}` has {expected}, not {}", numbers.len());
                return Err(line.malformed(found));
            }
        };
        if let Some(&value) = values.iter().find(|&&v| v < 0.0) {
            return Err(Error::MaterialRange {
                file: file.into(),
                line: line.number,
                what,
                material: excerpt(material),
                value,
                expected: "at least 0",
            });
        }
        out.push_str(what);
        for value in values {
            let _ = write!(out, " {value}");
        }
        out.push('\n');
    }
    Ok((names, out))
}
