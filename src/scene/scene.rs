//! A scene in world space, ready to be asked.

use super::{
    Camera, Convention, Environment, Error, Hit, Material, Mesh, Picture, Ray, RayQueries, RayStructure,
    Rays, Reference,
    file::{MeshEntry, Normals, SceneFile},
    mesh::{Open, from_disk, load, text},
    offset_origin, offset_unit,
    rays::extent,
};
use glam::{DQuat, Vec3};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Coordinates beyond this would overflow when areas are formed in `f32`.
const FARTHEST: f32 = 1e15;

/// A triangle of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// World-space vertices, counterclockwise seen from the front.
    pub vertices: [Vec3; 3],
    /// Unit geometric normal on the front, computed in f64; zero if the triangle has no area.
    pub normal: Vec3,
    /// Area in square scene units.
    pub area: f64,
    /// Unit shading normals of the vertices, if the mesh has any.
    pub shading: Option<[Vec3; 3]>,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// A triangle that emits: K_e above 0, and an area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// World-space vertices.
    pub vertices: [Vec3; 3],
    /// Unit geometric normal on the side that emits.
    pub normal: Vec3,
    /// Area in square scene units.
    pub area: f64,
    /// Radiance, the same in all directions.
    pub radiance: Vec3,
    /// Whether the back emits as well.
    pub two_sided: bool,
}

/// A scene: triangles, materials, lights, camera, and what stands between two points.
///
/// ```
/// use warpcheck::scene::{RayQueries, Scene};
/// let scene = Scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml"))?;
/// assert_eq!(scene.triangles.len(), 36);
/// assert_eq!(scene.emissive_area(), 130.0 * 105.0);
/// let middle = scene.camera.ray(0.5 * scene.picture.width as f32, 0.5 * scene.picture.height as f32);
/// let hit = scene.rays().closest(&middle).unwrap();
/// let out = scene.leave(&hit, -middle.direction);
/// assert!(!scene.rays().occluded(&out)); // nothing between the camera and what it sees
/// # Ok::<(), warpcheck::scene::Error>(())
/// ```
#[derive(Debug)]
pub struct Scene {
    /// The scene file.
    pub file: PathBuf,
    /// All triangles, mesh after mesh in the order of the files; [`Hit::triangle`] counts them.
    pub triangles: Vec<Triangle>,
    /// All materials, after the scene file's changes; triangles of two meshes never share one.
    pub materials: Vec<Material>,
    /// How the materials are read.
    pub convention: Convention,
    /// The triangles that emit, in the order of `triangles`. May be empty if there is an environment.
    pub emitters: Vec<Emitter>,
    /// Who looks.
    pub camera: Camera,
    /// The light from outside, if any.
    pub environment: Option<Environment>,
    /// The picture to make.
    pub picture: Picture,
    /// What to compare with, if anything: another renderer's picture, closed forms.
    pub reference: Option<Reference>,
    rays: Rays,
    rays_time: Duration,
    offset_unit: f32,
    /// The place of each triangle among the emitters, or [`DARK`]: every hit asks.
    emitter_of: Box<[u32]>,
}

const DARK: u32 = u32::MAX;

impl Scene {
    /// Reads a scene file and the meshes that it names. Environment map and reference are not opened.
    ///
    /// # Errors
    /// Whatever is wrong with the files: see [`Error`].
    pub fn load(file: impl AsRef<Path>) -> Result<Self, Error> {
        let file = file.as_ref();
        Self::from_toml(&text(file, &load(file, &mut from_disk)?)?, file)
    }

    /// Like [`Scene::load`], for a scene file whose text is at hand; `file` stands for its place in messages and in
    /// relative paths, and is not opened.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn from_toml(text: &str, file: impl AsRef<Path>) -> Result<Self, Error> {
        Self::from_toml_with(text, file, from_disk)
    }

    /// Like [`Scene::from_toml`], without the disk: `open` is asked for the bytes of the meshes and of their libraries.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn from_toml_with(
        text: &str,
        file: impl AsRef<Path>,
        mut open: impl FnMut(&Path) -> io::Result<Vec<u8>>,
    ) -> Result<Self, Error> {
        let file = file.as_ref();
        let described = SceneFile::parse(file, text)?;
        let picture = described.picture;
        let wrong = |line, key, why: &str| Error::Value { file: file.into(), line, key, why: why.into() };
        let camera = Camera::new(described.view, picture.width, picture.height)
            .map_err(|why| wrong(described.camera_line, "camera", why))?;
        let (mut triangles, mut materials, mut emitters) = (Vec::new(), Vec::new(), Vec::new());
        for entry in &described.meshes {
            let mesh = entry.read(described.convention, &mut open)?;
            let absent = |name: &str| mesh.materials.iter().all(|m| m.name != name);
            if let Some((name, line, _)) = entry.materials.iter().find(|(name, ..)| absent(name)) {
                let why = format!("names `{name}`, but {} has no such material", entry.file.display());
                return Err(wrong(*line, "mesh.materials", &why));
            }
            let first = triangles.len();
            triangles.extend(entry.place(&mesh, materials.len() as u32));
            let reached = triangles[first..].iter().flat_map(|t: &Triangle| t.vertices);
            if !reached.map(|p| p.abs().max_element()).all(|x| x <= FARTHEST) {
                return Err(wrong(entry.line, "mesh", "has a vertex farther than 1e15 from the origin"));
            }
            materials.extend(mesh.materials);
            emitters.extend((first..).zip(&triangles[first..]).filter_map(|(id, t)| {
                let radiance = materials[t.material as usize].ke;
                let emits = t.area > 0.0 && t.normal != Vec3::ZERO && radiance.max_element() > 0.0;
                let Triangle { vertices, normal, area, .. } = *t;
                let two_sided = entry.two_sided;
                emits.then_some(Emitter { triangle: id as u32, vertices, normal, area, radiance, two_sided })
            }));
        }
        let has = |name: &str| materials.iter().any(|m: &Material| m.name == name);
        if let Some((name, line)) = described.radiance_lines.iter().find(|(name, _)| !has(name)) {
            let names: BTreeSet<_> = materials.iter().map(|m| format!("`{}`", m.name)).collect();
            let names = names.into_iter().collect::<Vec<_>>().join(", ");
            let why = format!("names `{name}`, but the materials of the scene are {names}");
            return Err(wrong(*line, "reference.radiance", &why));
        }
        if emitters.is_empty() && described.environment.is_none() {
            return Err(Error::NoLight { file: file.into() });
        }
        let mut emitter_of = vec![DARK; triangles.len()].into_boxed_slice();
        for (place, emitter) in (0..).zip(&emitters) {
            emitter_of[emitter.triangle as usize] = place;
        }
        let vertices: Vec<_> = triangles.iter().map(|t| t.vertices).collect();
        let (rays, rays_time) = timed(&vertices, RayStructure::for_triangles(vertices.len()));
        Ok(Self {
            file: file.into(),
            rays,
            rays_time,
            offset_unit: offset_unit(extent(&vertices)),
            emitter_of,
            triangles,
            materials,
            convention: described.convention,
            emitters,
            camera,
            environment: described.environment,
            picture,
            reference: described.reference,
        })
    }

    /// The answer to ray queries: a tree, unless [`RayStructure`] says that a list will do.
    pub fn rays(&self) -> &Rays {
        &self.rays
    }

    /// The same scene with ray queries answered in this way.
    pub fn with_rays(self, structure: RayStructure) -> Self {
        let (rays, rays_time) = timed(&self.vertices(), structure);
        Self { rays, rays_time, ..self }
    }

    /// How long it took to build what answers ray queries.
    pub fn rays_time(&self) -> Duration {
        self.rays_time
    }

    /// The vertices of all triangles, as another implementation of [`RayQueries`] wants them.
    pub fn vertices(&self) -> Vec<[Vec3; 3]> {
        self.triangles.iter().map(|t| t.vertices).collect()
    }

    /// The sum of the emitters' areas.
    pub fn emissive_area(&self) -> f64 {
        self.emitters.iter().map(|e| e.area).sum()
    }

    /// The emitter that a triangle is, as an index into [`Scene::emitters`].
    #[inline]
    pub fn emitter_of(&self, triangle: u32) -> Option<usize> {
        let place = *self.emitter_of.get(triangle as usize)?;
        (place != DARK).then_some(place as usize)
    }

    /// The material of a triangle.
    pub fn material(&self, triangle: u32) -> &Material {
        &self.materials[self.triangles[triangle as usize].material as usize]
    }

    /// The point of a hit, from its barycentric coordinates: nearer to the surface than the point on the ray.
    pub fn point(&self, hit: &Hit) -> Vec3 {
        let [a, b, c] = self.triangles[hit.triangle as usize].vertices.map(|p| p.as_dvec3());
        (a + (b - a) * hit.u as f64 + (c - a) * hit.v as f64).as_vec3()
    }

    /// The shading normal at a hit, on the front; the geometric normal if there is no other.
    pub fn shading_normal(&self, hit: &Hit) -> Vec3 {
        let triangle = &self.triangles[hit.triangle as usize];
        let Some([a, b, c]) = triangle.shading else { return triangle.normal };
        (a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v).normalize_or(triangle.normal)
    }

    /// The radiance that leaves a triangle towards `w` (a direction away from the surface, of any length).
    pub fn emitted(&self, triangle: u32, w: Vec3) -> Vec3 {
        match self.emitter_of(triangle).map(|i| &self.emitters[i]) {
            Some(e) if e.normal.dot(w) > 0.0 || (e.two_sided && e.normal.dot(w) < 0.0) => e.radiance,
            _ => Vec3::ZERO,
        }
    }

    /// An endless ray from a hit into a direction: starts beside the surface, on the side that it leaves to
    /// ([`offset_origin`]), and does not meet the triangle that it comes from.
    pub fn leave(&self, hit: &Hit, direction: Vec3) -> Ray {
        self.leave_point(self.point(hit), hit.triangle, direction)
    }

    /// [`Scene::leave`] for any point of a triangle.
    pub fn leave_point(&self, point: Vec3, triangle: u32, direction: Vec3) -> Ray {
        let normal = self.triangles[triangle as usize].normal;
        let side = if normal.dot(direction) < 0.0 { -normal } else { normal };
        let origin = offset_origin(point, side, self.offset_unit);
        Ray { from: Some(triangle), ..Ray::new(origin, direction) }
    }

    /// Whether `point` on triangle `from` sees `target` on triangle `triangle`: [`RayQueries::reaches`] from beside the
    /// surface, on the side that faces the target. No triangle sees itself.
    pub fn sees(&self, point: Vec3, from: u32, target: Vec3, triangle: u32) -> bool {
        if from == triangle {
            return false;
        }
        let ray = self.leave_point(point, from, target - point);
        self.rays.reaches(ray.origin, ray.from, target, triangle)
    }
}

fn timed(vertices: &[[Vec3; 3]], structure: RayStructure) -> (Rays, Duration) {
    let start = Instant::now();
    (Rays::new(vertices, structure), start.elapsed())
}

impl MeshEntry {
    /// The mesh with the materials that this scene gives it, in its own coordinates.
    fn read(&self, convention: Convention, open: Open) -> Result<Mesh, Error> {
        let fallback = self.material.as_ref().map(|_| Material::default());
        let mut mesh = Mesh::from_obj(&load(&self.file, open)?, &self.file, fallback, open)?;
        match self.normals {
            Normals::File => {}
            Normals::Smooth => mesh.smooth_normals(),
            Normals::Flat => mesh.normals = None,
        }
        for m in &mut mesh.materials {
            let by_name = self.materials.iter().filter(|(name, ..)| *name == m.name).map(|(.., new)| new);
            for new in self.material.iter().chain(by_name) {
                m.kd = new.kd.unwrap_or(m.kd);
                m.ks = new.ks.unwrap_or(m.ks);
                m.ns = new.ns.unwrap_or(m.ns);
                m.ke = new.ke.unwrap_or(m.ke);
                m.roughness = new.roughness.or(m.roughness);
            }
            if !self.emitters_reflect && m.emits() {
                (m.kd, m.ks) = (Vec3::ZERO, Vec3::ZERO);
            }
            let (reflected, sum) = match convention {
                Convention::Mtl => (m.kd + m.ks, "K_d + K_s"),
                Convention::KdPhong => (m.kd, "K_d"),
            };
            let channel = reflected.max_position();
            let value = reflected[channel];
            if value > 1.0 + 1e-6 {
                let (file, material) = (self.file.clone(), m.name.clone());
                return Err(Error::EnergyGain { file, material, channel, value, sum });
            }
        }
        Ok(mesh)
    }

    /// The triangles in world space; their materials are counted from `material`.
    fn place(&self, mesh: &Mesh, material: u32) -> impl Iterator<Item = Triangle> {
        let turn = DQuat::from_rotation_y(self.rotate_y);
        let still = self.rotate_y == 0.0;
        let turned = move |v: Vec3| if still { v.as_dvec3() } else { turn * v.as_dvec3() };
        let placed = move |p: Vec3| (turned(p) * self.scale + self.translate).as_vec3();
        mesh.triangles.iter().zip(&mesh.material_of_triangle).map(move |(corners, &index)| {
            let vertices = corners.map(|i| placed(mesh.positions[i as usize]));
            let [a, b, c] = vertices.map(|p| p.as_dvec3());
            let cross = (b - a).cross(c - a);
            let normal = cross.normalize_or_zero().as_vec3();
            let shading = mesh.normals.as_ref().map(|normals| {
                corners.map(|i| match turned(normals[i as usize]).as_vec3() {
                    Vec3::ZERO => normal,
                    n => n,
                })
            });
            Triangle { vertices, normal, area: 0.5 * cross.length(), shading, material: material + index }
        })
    }
}
