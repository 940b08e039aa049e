//! The scene file: TOML that names meshes, camera, environment and picture. Its keys stand in the module's front page.

use super::{Error, FovAxis, View};
use glam::{DVec3, Vec3};
use serde::Deserialize;
use std::{
    collections::BTreeMap,
    ops::Range,
    path::{Path, PathBuf},
};
use toml::Spanned;

/// How the values of an MTL file are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Convention {
    /// K_d / pi, plus a Phong lobe of weight K_s and exponent N_s, or a GGX lobe if the material has a roughness. K_d + K_s
    /// is at most 1 in each channel.
    Mtl,
    /// Either or: N_s at most 1 is K_d / pi; N_s above 1 is K_d (N_s + 1)/(2 pi) max(0, w_r . w_i)^N_s and nothing
    /// else. K_s is not used. K_d is at most 1 in each channel. With a roughness: K_d times the GGX lobe and nothing else.
    KdPhong,
}

/// How radiance becomes a picture on a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Display {
    /// The transfer function of sRGB.
    #[default]
    Srgb,
    /// L^(1/2.2), clipped.
    Gamma22,
}

/// Which axis of the scene points to the zenith of an environment map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// +Y, as in most scenes.
    #[default]
    Y,
    /// +Z: the scene's axes are the map's.
    Z,
}

/// Where shading normals come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Normals {
    #[default]
    File,
    Smooth,
    Flat,
}

/// An environment map that the scene is lit by; the map itself is not read here.
///
/// The map's frame has theta = 0, row 0, at +Z and phi counted from +X towards +Y. With [`UpAxis::Y`] the map's X, Y, Z
/// are the scene's X, -Z, Y; the rotation then turns the map about its zenith.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// The equirectangular map.
    pub file: PathBuf,
    /// Factor on its radiance, above 0.
    pub scale: f32,
    /// Rotation of the map about the zenith in radians, counterclockwise seen from above.
    pub rotation: f32,
    /// Which axis of the scene is the zenith.
    pub up: UpAxis,
}

impl Environment {
    /// A direction of the scene in the map's frame.
    ///
    /// ```
    /// use glam::Vec3;
    /// use warpcheck::scene::{Environment, UpAxis};
    /// let sky = Environment { file: "sky.hdr".into(), scale: 1.0, rotation: 0.0, up: UpAxis::Y };
    /// assert_eq!(sky.to_map(Vec3::Y), Vec3::Z);
    /// assert_eq!(sky.to_scene(Vec3::Z), Vec3::Y);
    /// ```
    pub fn to_map(&self, w: Vec3) -> Vec3 {
        let w = match self.up {
            UpAxis::Y => Vec3::new(w.x, -w.z, w.y),
            UpAxis::Z => w,
        };
        self.turn(w, -self.rotation)
    }

    /// A direction of the map's frame in the scene: the inverse of [`Environment::to_map`].
    pub fn to_scene(&self, w: Vec3) -> Vec3 {
        let w = self.turn(w, self.rotation);
        match self.up {
            UpAxis::Y => Vec3::new(w.x, w.z, -w.y),
            UpAxis::Z => w,
        }
    }

    fn turn(&self, w: Vec3, angle: f32) -> Vec3 {
        let (s, c) = angle.sin_cos();
        Vec3::new(c * w.x - s * w.y, s * w.x + c * w.y, w.z)
    }
}

/// The picture to make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picture {
    /// Pixels in a row, 1 to 16384.
    pub width: u32,
    /// Rows, 1 to 16384; at most 2^26 pixels in all.
    pub height: u32,
    /// How it is shown.
    pub display: Display,
    /// Factor on the radiance before it is shown, above 0.
    pub exposure: f32,
}

/// What to compare with. Nothing is read here, nor need the files exist.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// A picture of the same size, linear radiance.
    pub file: Option<PathBuf>,
    /// Block means and standard errors as JSON.
    pub blocks: Option<PathBuf>,
    /// The radiance of what has one in closed form, the same wherever it is seen, by the name of its material.
    pub radiance: BTreeMap<String, Vec3>,
}

/// The greatest width and height of a picture.
const LARGEST_SIDE: i64 = 16384;
/// The greatest number of pixels.
const MOST_PIXELS: i64 = 1 << 26;

/// A number with its place in the file.
type Number = Spanned<f64>;
/// Three of them.
type Triple = Spanned<[f64; 3]>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScene {
    materials: Convention,
    mesh: Spanned<Vec<RawMesh>>,
    camera: Spanned<RawCamera>,
    environment: Option<RawEnvironment>,
    picture: RawPicture,
    reference: Option<Spanned<RawReference>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMesh {
    file: Spanned<PathBuf>,
    translate: Option<Triple>,
    scale: Option<Number>,
    rotate_y_degrees: Option<Number>,
    #[serde(default)]
    normals: Normals,
    #[serde(default)]
    two_sided: bool,
    emitters_reflect: Option<bool>,
    material: Option<RawMaterial>,
    #[serde(default)]
    materials: BTreeMap<String, Spanned<RawMaterial>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMaterial {
    kd: Option<Triple>,
    ks: Option<Triple>,
    ns: Option<Number>,
    ke: Option<Triple>,
    roughness: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCamera {
    eye: Triple,
    at: Triple,
    up: Option<Triple>,
    fov_degrees: Number,
    #[serde(default)]
    fov_axis: FovAxis,
    #[serde(default)]
    mirror: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEnvironment {
    file: PathBuf,
    scale: Option<Number>,
    rotate_degrees: Option<Number>,
    #[serde(default)]
    up: UpAxis,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPicture {
    width: Spanned<i64>,
    height: Spanned<i64>,
    #[serde(default)]
    display: Display,
    exposure: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawReference {
    file: Option<PathBuf>,
    blocks: Option<PathBuf>,
    #[serde(default)]
    radiance: BTreeMap<String, Triple>,
}

/// A scene file whose values are checked, with paths resolved.
pub(super) struct SceneFile {
    pub convention: Convention,
    pub meshes: Vec<MeshEntry>,
    pub view: View,
    /// The line of `[camera]`.
    pub camera_line: usize,
    pub environment: Option<Environment>,
    pub picture: Picture,
    pub reference: Option<Reference>,
    /// The materials that [`Reference::radiance`] names, and the lines that do.
    pub radiance_lines: Vec<(String, usize)>,
}

/// One `[[mesh]]`.
pub(super) struct MeshEntry {
    pub file: PathBuf,
    pub line: usize,
    pub translate: DVec3,
    pub scale: f64,
    /// Radians.
    pub rotate_y: f64,
    pub normals: Normals,
    pub two_sided: bool,
    pub emitters_reflect: bool,
    pub material: Option<Override>,
    /// What is replaced in materials by their name, and the line that says so.
    pub materials: Vec<(String, usize, Override)>,
}

/// What a `material` table, or one of `materials`, replaces.
pub(super) struct Override {
    pub kd: Option<Vec3>,
    pub ks: Option<Vec3>,
    pub ns: Option<f32>,
    pub ke: Option<Vec3>,
    pub roughness: Option<f32>,
}

impl SceneFile {
    /// Reads the text of the scene file at `file`; touches no other file.
    pub fn parse(file: &Path, text: &str) -> Result<Self, Error> {
        let raw: RawScene = toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(1, |span| line_of(text, span));
            // One sentence, where the reader may write several lines.
            let message = e.message().lines().map(str::trim).collect::<Vec<_>>().join("; ");
            Error::Toml { file: file.into(), line, message }
        })?;
        Checker { file, text }.scene(raw)
    }
}

fn line_of(text: &str, span: Range<usize>) -> usize {
    1 + text.bytes().take(span.start).filter(|&b| b == b'\n').count()
}

/// Turns what serde has read into what can be used.
struct Checker<'a> {
    file: &'a Path,
    text: &'a str,
}

impl Checker<'_> {
    fn wrong<T>(&self, span: Range<usize>, key: &'static str, why: impl Into<String>) -> Result<T, Error> {
        let line = line_of(self.text, span);
        Err(Error::Value { file: self.file.into(), line, key, why: why.into() })
    }

    /// A number that is finite in `f32`, too.
    fn number(&self, key: &'static str, n: Option<&Number>, default: f64) -> Result<f64, Error> {
        match n {
            Some(n) if !(*n.get_ref() as f32).is_finite() => {
                self.wrong(n.span(), key, format!("is {}, but it must be finite", n.get_ref()))
            }
            n => Ok(n.map_or(default, |n| *n.get_ref())),
        }
    }

    /// A number above 0, in `f32`, too.
    fn positive(&self, key: &'static str, n: Option<&Number>) -> Result<f64, Error> {
        let value = self.number(key, n, 1.0)?;
        match n {
            Some(n) if (value as f32) <= 0.0 => {
                self.wrong(n.span(), key, format!("is {value}, but it must be above 0"))
            }
            _ => Ok(value),
        }
    }

    fn triple(&self, key: &'static str, v: &Triple) -> Result<DVec3, Error> {
        let value = DVec3::from(*v.get_ref());
        match value.as_vec3().is_finite() {
            true => Ok(value),
            false => self.wrong(v.span(), key, "has a number that is not finite"),
        }
    }

    fn colour(&self, key: &'static str, v: Option<&Triple>) -> Result<Option<Vec3>, Error> {
        let Some(v) = v else { return Ok(None) };
        let value = self.triple(key, v)?.as_vec3();
        match value.min_element() < 0.0 {
            true => self.wrong(v.span(), key, "has a negative channel"),
            false => Ok(Some(value)),
        }
    }

    fn path(&self, path: &Path) -> PathBuf {
        self.file.parent().unwrap_or(Path::new("")).join(path)
    }

    fn scene(&self, raw: RawScene) -> Result<SceneFile, Error> {
        if raw.mesh.get_ref().is_empty() {
            return self.wrong(raw.mesh.span(), "mesh", "is empty, but a scene needs at least one mesh");
        }
        Ok(SceneFile {
            convention: raw.materials,
            meshes: raw.mesh.get_ref().iter().map(|m| self.mesh(m)).collect::<Result<_, _>>()?,
            view: self.view(raw.camera.get_ref())?,
            camera_line: line_of(self.text, raw.camera.span()),
            environment: raw.environment.as_ref().map(|e| self.environment(e)).transpose()?,
            picture: self.picture(&raw.picture)?,
            reference: raw.reference.as_ref().map(|r| self.reference(r)).transpose()?,
            radiance_lines: {
                let named = raw.reference.iter().flat_map(|r| &r.get_ref().radiance);
                named.map(|(name, radiance)| (name.clone(), line_of(self.text, radiance.span()))).collect()
            },
        })
    }

    fn mesh(&self, raw: &RawMesh) -> Result<MeshEntry, Error> {
        let named = |(name, m): (&String, &Spanned<RawMaterial>)| {
            Ok((name.clone(), line_of(self.text, m.span()), self.material(m.get_ref())?))
        };
        Ok(MeshEntry {
            file: self.path(raw.file.get_ref()),
            line: line_of(self.text, raw.file.span()),
            translate: match &raw.translate {
                Some(t) => self.triple("mesh.translate", t)?,
                None => DVec3::ZERO,
            },
            scale: self.positive("mesh.scale", raw.scale.as_ref())?,
            rotate_y: self.number("mesh.rotate_y_degrees", raw.rotate_y_degrees.as_ref(), 0.0)?.to_radians(),
            normals: raw.normals,
            two_sided: raw.two_sided,
            emitters_reflect: raw.emitters_reflect.unwrap_or(true),
            material: raw.material.as_ref().map(|m| self.material(m)).transpose()?,
            materials: raw.materials.iter().map(named).collect::<Result<_, _>>()?,
        })
    }

    fn material(&self, m: &RawMaterial) -> Result<Override, Error> {
        let ns = self.number("mesh.material.ns", m.ns.as_ref(), 1.0)? as f32;
        if let Some(n) = m.ns.as_ref().filter(|_| ns < 0.0) {
            return self.wrong(n.span(), "mesh.material.ns", format!("is {ns}, but it must be at least 0"));
        }
        let roughness = m.roughness.as_ref().map(|n| *n.get_ref() as f32);
        if let (Some(alpha), Some(n)) = (roughness, &m.roughness)
            && !(1e-4..=1.0).contains(&alpha)
        {
            let why = format!("is {alpha}, but it must be from 1e-4 to 1");
            return self.wrong(n.span(), "mesh.material.roughness", why);
        }
        Ok(Override {
            roughness,
            kd: self.colour("mesh.material.kd", m.kd.as_ref())?,
            ks: self.colour("mesh.material.ks", m.ks.as_ref())?,
            ns: m.ns.as_ref().map(|_| ns),
            ke: self.colour("mesh.material.ke", m.ke.as_ref())?,
        })
    }

    fn view(&self, raw: &RawCamera) -> Result<View, Error> {
        let fov = self.number("camera.fov_degrees", Some(&raw.fov_degrees), 0.0)?;
        if !(fov > 0.0 && fov < 180.0) {
            let why = format!("is {fov}, but it must be between 0 and 180");
            return self.wrong(raw.fov_degrees.span(), "camera.fov_degrees", why);
        }
        Ok(View {
            eye: self.triple("camera.eye", &raw.eye)?.as_vec3(),
            at: self.triple("camera.at", &raw.at)?.as_vec3(),
            up: match &raw.up {
                Some(up) => self.triple("camera.up", up)?.as_vec3(),
                None => Vec3::Y,
            },
            fov: fov.to_radians() as f32,
            fov_axis: raw.fov_axis,
            mirror: raw.mirror,
        })
    }

    fn environment(&self, raw: &RawEnvironment) -> Result<Environment, Error> {
        let rotation = self.number("environment.rotate_degrees", raw.rotate_degrees.as_ref(), 0.0)?;
        Ok(Environment {
            file: self.path(&raw.file),
            scale: self.positive("environment.scale", raw.scale.as_ref())? as f32,
            rotation: rotation.rem_euclid(360.0).to_radians() as f32,
            up: raw.up,
        })
    }

    fn reference(&self, raw: &Spanned<RawReference>) -> Result<Reference, Error> {
        let RawReference { file, blocks, radiance } = raw.get_ref();
        if file.is_none() && blocks.is_none() && radiance.is_empty() {
            let why = "has nothing to compare with: neither `file` nor `blocks` nor `radiance`";
            return self.wrong(raw.span(), "reference", why);
        }
        let path = |given: &Option<PathBuf>| given.as_ref().map(|p| self.path(p));
        let known = |(name, radiance): (&String, &Triple)| {
            let value = self.colour("reference.radiance", Some(radiance))?;
            Ok((name.clone(), value.unwrap_or_default()))
        };
        let radiance = radiance.iter().map(known).collect::<Result<_, _>>()?;
        Ok(Reference { file: path(file), blocks: path(blocks), radiance })
    }

    fn picture(&self, raw: &RawPicture) -> Result<Picture, Error> {
        let side = |key, n: &Spanned<i64>| match *n.get_ref() {
            n @ 1..=LARGEST_SIDE => Ok(n),
            other => {
                self.wrong(n.span(), key, format!("is {other}, but it must be between 1 and {LARGEST_SIDE}"))
            }
        };
        let (width, height) = (side("picture.width", &raw.width)?, side("picture.height", &raw.height)?);
        if width * height > MOST_PIXELS {
            let why = format!("makes {} pixels, but {MOST_PIXELS} are the most", width * height);
            return self.wrong(raw.height.span(), "picture.height", why);
        }
        Ok(Picture {
            width: width as u32,
            height: height as u32,
            display: raw.display,
            exposure: self.positive("picture.exposure", raw.exposure.as_ref())? as f32,
        })
    }
}
