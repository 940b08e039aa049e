//! All lights of a scene as one sampler of directions.
//!
//! Mesh emitters are one [`MeshLight`], sampled as [`LightSampling`] says: by area, the density is 1 / total
//! emissive area per area. The environment is sampled by its marginal and conditional CDFs ([`Environment`]), or
//! uniformly if it is the same in all directions. Where a scene has
//! both, the emitters are chosen with probability q = 1/2 and the environment otherwise, whatever their powers;
//! so the density per solid angle as seen from x is
//!
//! - q p(y) |y - x|^2 / max(0, n_y . -w) of the point y of an emitter, p(y) per area (or q m / omega if triangle and
//!   point are drawn by mass m and uniformly in solid angle omega), and
//! - (1 - q) p_map(w) of a direction in which nothing is met,
//!
//! with q = 1 without environment and q = 0 without emitters. A direction leads to one or the other, since what
//! is *visible* there is one thing: no sum of both is needed, nor over the emitters behind the first (see
//! [`MeshLight`] on the two densities).

use super::{Error, LightSampling, Selection};
use crate::picture;
use crate::random::{fnv1a, to_f32};
use crate::sampler::{
    Environment, LightSample, LightTree, MeshLight, Placement, RadianceMap, RowWarp, Sides, UniformSphere,
    luminance,
};
use crate::scene::{self, Emitter, Scene, UpAxis};
use glam::{Vec2, Vec3};
use std::f64::consts::PI;
use std::path::PathBuf;

/// The light sampler of a scene.
///
/// ```
/// use warpcheck::estimator::{Lights, Target};
/// use warpcheck::scene::Scene;
/// let scene = Scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml"))?;
/// let lights = Lights::load(&scene)?;
/// let floor = glam::Vec3::new(278.0, 0.0, 279.0);
/// let draw = lights.sample(floor, [0.5, 0.5, 0.5]).unwrap();
/// let Target::Point { point, emitter } = draw.target else { panic!("the box has no sky") };
/// assert_eq!(lights.density_of_point(floor, point, emitter), draw.density);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Lights {
    mesh: Option<Emitters>,
    /// Radiance of each emitter.
    radiance: Box<[Vec3]>,
    sky: Option<Sky>,
    /// q: the probability of the emitters.
    mesh_share: f64,
    /// `None` if nothing was built to sample the lights.
    sampling: Option<LightSampling>,
}

/// The emitters of a scene, to be sampled.
#[derive(Clone, Debug)]
struct Emitters {
    light: MeshLight,
    /// For [`Selection::PowerOverDistance`]; otherwise the light's own table is searched.
    tree: Option<LightTree>,
    placement: Placement,
}

/// An environment map and how it stands in the scene.
#[derive(Clone, Debug)]
struct Sky {
    map: Map,
    place: scene::Environment,
}

/// What is there of an environment map.
#[derive(Clone, Debug)]
pub(super) enum Map {
    /// Radiance, and tables to sample it by.
    Sampled(Box<Environment>),
    /// Radiance alone: it can't be sampled.
    Radiance(RadianceMap),
    /// The same radiance everywhere, sampled uniformly.
    Constant(Vec3),
}

/// What a drawn direction is meant to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// A point of an emitter.
    Point {
        /// The point, in the scene.
        point: Vec3,
        /// Index into [`Scene::emitters`].
        emitter: usize,
    },
    /// The environment.
    Sky,
}

/// A direction towards a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightDraw {
    /// Unit vector, in the scene.
    pub direction: Vec3,
    /// Radiance that arrives if nothing is in the way.
    pub radiance: Vec3,
    /// Density per solid angle, the choice between emitters and environment included.
    pub density: f32,
    /// What has to be visible.
    pub target: Target,
}

impl Lights {
    /// The lights of `scene`, with `map` as its environment if there is one. The map stands as the scene's
    /// `[environment]` says, or, if the scene has none, with its zenith up (+Y). Its radiance is taken as it
    /// is, the scene's `scale` has to be in it.
    ///
    /// # Errors
    /// If there is neither an emitter nor a map, or the emitters can't be sampled.
    pub fn new(scene: &Scene, map: Option<Environment>) -> Result<Self, Error> {
        Self::build(scene, map.map(|map| Map::Sampled(Box::new(map))), Some(LightSampling::default()))
    }

    /// The lights of `scene`; reads its environment map, if it names one, and multiplies it by the scene's
    /// `scale`. Samples are uniform in cos theta inside a texel. Emitters are sampled by area.
    ///
    /// # Errors
    /// As [`new`](Self::new), and if the map can't be read or has texels that are no radiance.
    pub fn load(scene: &Scene) -> Result<Self, Error> {
        Self::load_with(scene, LightSampling::default())
    }

    /// Like [`load`](Self::load), with emitters sampled in this way.
    ///
    /// # Errors
    /// As [`load`](Self::load), and if the power of an emitter can't be formed.
    pub fn load_with(scene: &Scene, sampling: LightSampling) -> Result<Self, Error> {
        let map = read_map(scene)?.map(|map| with_tables(scene, map)).transpose()?;
        Self::build(scene, map, Some(sampling))
    }

    /// Lights with what is needed to sample them in one way, or to look at them only.
    pub(super) fn build(
        scene: &Scene,
        map: Option<Map>,
        sampling: Option<LightSampling>,
    ) -> Result<Self, Error> {
        if scene.emitters.is_empty() && map.is_none() {
            return Err(Error::NoLight { file: scene.file.clone() });
        }
        let sampled = sampling.filter(|_| !scene.emitters.is_empty());
        let mesh = sampled.map(|sampling| Emitters::new(scene, sampling)).transpose()?;
        let upright =
            || scene::Environment { file: PathBuf::new(), scale: 1.0, rotation: 0.0, up: UpAxis::Y };
        let sky = map.map(|map| Sky { map, place: scene.environment.clone().unwrap_or_else(upright) });
        let mesh_share = match (scene.emitters.is_empty(), &sky) {
            (true, _) => 0.0,
            (false, Some(_)) => 0.5,
            (false, None) => 1.0,
        };
        let radiance = scene.emitters.iter().map(|e| e.radiance).collect();
        Ok(Self { mesh, radiance, sky, mesh_share, sampling })
    }

    /// How emitters are sampled; `None` if nothing was built to sample lights, so that only strategies that don't can
    /// be used.
    pub fn sampling(&self) -> Option<LightSampling> {
        self.sampling
    }

    /// A number for what the environment sends and how it is sampled; 0 without one. That it was the same is certain up to 2^-64.
    pub(super) fn sky_fingerprint(&self) -> u64 {
        let Some(Sky { map, place }) = &self.sky else { return 0 };
        let bytes = |texels: &[[f32; 3]]| -> Vec<u8> {
            texels.iter().flatten().flat_map(|x| x.to_bits().to_le_bytes()).collect()
        };
        let mut all = match map {
            Map::Sampled(map) => bytes(map.map().texels()),
            Map::Radiance(map) => bytes(map.texels()),
            // Drawn from other variates than a map of one texel.
            Map::Constant(radiance) => [b"constant".as_slice(), &bytes(&[radiance.to_array()])].concat(),
        };
        all.extend(format!("{} {:?}", place.rotation, place.up).into_bytes());
        fnv1a(&all)
    }

    /// Bytes that the tables take by which lights are sampled: those of the emitters, and those of the environment.
    pub fn table_bytes(&self) -> [usize; 2] {
        let mesh = |m: &Emitters| m.light.bytes() + m.tree.as_ref().map_or(0, LightTree::bytes);
        let sky = match self.sky.as_ref().map(|sky| &sky.map) {
            Some(Map::Sampled(map)) => map.table_bytes(),
            _ => 0,
        };
        [self.mesh.as_ref().map_or(0, mesh), sky]
    }

    /// The probability q with which a sample is of the emitters.
    pub fn mesh_share(&self) -> f64 {
        self.mesh_share
    }

    /// A direction from `x` towards a light for variates in `[0, 1)`; `None` where it is an emitter's dark
    /// side. Whether the target is visible is for the caller to find out.
    #[inline]
    pub fn sample(&self, x: Vec3, xi: [f64; 3]) -> Option<LightDraw> {
        let q = self.mesh_share;
        match (&self.mesh, &self.sky) {
            (Some(mesh), _) if xi[0] < q => {
                let s = mesh.sample(x, [xi[0] / q, xi[1], xi[2]])?;
                Some(LightDraw {
                    direction: s.direction,
                    radiance: self.radiance[s.triangle],
                    density: (q * s.density) as f32,
                    target: Target::Point { point: s.point, emitter: s.triangle },
                })
            }
            (_, Some(Sky { map, place })) => {
                let (w, radiance, density) = match map {
                    Map::Sampled(map) => {
                        let s = map.sample([xi[1], xi[2]]);
                        (s.direction, s.radiance, s.density)
                    }
                    &Map::Constant(radiance) => {
                        let w = UniformSphere.sample(Vec2::new(to_f32(xi[1]), to_f32(xi[2])));
                        (w, radiance, UniformSphere.density(w))
                    }
                    Map::Radiance(_) => return None,
                };
                Some(LightDraw {
                    direction: place.to_scene(w),
                    radiance,
                    density: (1.0 - q) as f32 * density,
                    target: Target::Sky,
                })
            }
            _ => None,
        }
    }

    /// Density per solid angle, as seen from `x`, of the point `y` of an emitter: what [`sample`](Self::sample)
    /// gives if it draws that point.
    #[inline]
    pub fn density_of_point(&self, x: Vec3, y: Vec3, emitter: usize) -> f32 {
        let Some(mesh) = &self.mesh else { return 0.0 };
        (self.mesh_share * mesh.density(x, y, emitter)) as f32
    }

    /// Density per solid angle of a direction that escapes.
    #[inline]
    pub fn density_of_sky(&self, w: Vec3) -> f32 {
        let Some(Sky { map, place }) = &self.sky else { return 0.0 };
        let density = match map {
            Map::Sampled(map) => map.density(place.to_map(w)),
            Map::Constant(_) => UniformSphere.density(w),
            Map::Radiance(_) => 0.0,
        };
        (1.0 - self.mesh_share) as f32 * density
    }

    /// Radiance from a direction that escapes; 0 without environment.
    #[inline]
    pub fn sky_radiance(&self, w: Vec3) -> Vec3 {
        let Some(Sky { map, place }) = &self.sky else { return Vec3::ZERO };
        match map {
            Map::Sampled(map) => map.radiance(place.to_map(w)),
            Map::Radiance(map) => map.radiance(place.to_map(w)),
            &Map::Constant(radiance) => radiance,
        }
    }
}

/// The environment map that a scene names, multiplied by its `scale`.
pub(super) fn read_map(scene: &Scene) -> Result<Option<RadianceMap>, Error> {
    let Some(place) = &scene.environment else { return Ok(None) };
    let map = picture::read(&place.file)?;
    let (width, height) = (map.width(), map.height());
    let mut texels = map.into_pixels();
    texels.iter_mut().flatten().for_each(|x| *x *= place.scale);
    // Also for a strategy that draws nothing from it: a black sky is a mistake in the file.
    let lit = |map: RadianceMap| match map.constant() {
        Some(Vec3::ZERO) => Err(crate::sampler::Error::Black { width, height }),
        _ => Ok(Some(map)),
    };
    RadianceMap::new(width, height, texels)
        .and_then(lit)
        .map_err(|source| Error::Map { file: place.file.clone(), source })
}

pub(super) fn with_tables(scene: &Scene, map: RadianceMap) -> Result<Map, Error> {
    let file = || scene.environment.as_ref().map_or_else(PathBuf::new, |place| place.file.clone());
    let map = Environment::from_map(map, RowWarp::UniformCosTheta);
    map.map(|map| Map::Sampled(Box::new(map))).map_err(|source| Error::Map { file: file(), source })
}

impl Emitters {
    fn new(scene: &Scene, LightSampling { selection, placement }: LightSampling) -> Result<Self, Error> {
        let sides = |e: &Emitter| if e.two_sided { Sides::Both } else { Sides::Front };
        // Per area; the luminance of a radiance of 1e-45 is no 0 in f64.
        let exitance = |e: &Emitter| {
            let sides = if e.two_sided { 2.0 } else { 1.0 };
            PI * sides * luminance(e.radiance.to_array())
        };
        let weight = |e: &Emitter| if selection == Selection::Area { 1.0 } else { exitance(e) };
        let wrong = |source| Error::Emitters { file: scene.file.clone(), source };
        let triangles = scene.emitters.iter().map(|e| (e.vertices, sides(e), weight(e)));
        let powers = || scene.emitters.iter().map(|e| (e.vertices, e.area * exitance(e)));
        let tree = (selection == Selection::PowerOverDistance).then(|| LightTree::new(powers()));
        Ok(Self {
            light: MeshLight::weighted(triangles).map_err(wrong)?,
            tree: tree.transpose().map_err(wrong)?,
            placement,
        })
    }

    #[inline]
    fn sample(&self, x: Vec3, [pick, u, v]: [f64; 3]) -> Option<LightSample> {
        let selected = match &self.tree {
            Some(tree) => tree.choose(x, pick),
            None => self.light.select(pick),
        };
        self.light.sample_selected(x, selected, self.placement, [u, v])
    }

    #[inline]
    fn density(&self, x: Vec3, y: Vec3, emitter: usize) -> f64 {
        let mass = match &self.tree {
            Some(tree) => tree.mass(x, emitter),
            None => self.light.mass(emitter),
        };
        self.light.density_selected(x, y, (emitter, mass), self.placement)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{stream, unit_f64};

    /// A lamp under a sky: what is drawn has the density that is asked for afterwards, and each half of the
    /// samples is of one of both.
    #[test]
    fn draws_have_the_density_that_queries_give() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml");
        let scene = Scene::load(file).unwrap();
        let texels = (0..128).map(|i| [i as f32; 3]).collect();
        let map = with_tables(&scene, RadianceMap::new(16, 8, texels).unwrap()).unwrap();
        let x = Vec3::new(100.0, 20.0, 300.0);
        let mut rng = stream(1, "lights", 0);
        for sampling in LightSampling::all() {
            let lights = Lights::build(&scene, Some(map.clone()), Some(sampling)).unwrap();
            let mut points = 0;
            for _ in 0..10_000 {
                let draw = lights.sample(x, [(); 3].map(|()| unit_f64(&mut rng))).unwrap();
                let asked = match draw.target {
                    Target::Point { point, emitter } => {
                        points += 1;
                        lights.density_of_point(x, point, emitter)
                    }
                    Target::Sky => {
                        assert_eq!(draw.radiance, lights.sky_radiance(draw.direction));
                        lights.density_of_sky(draw.direction)
                    }
                };
                assert!((draw.density / asked - 1.0).abs() < 1e-6, "{sampling}: {draw:?}: {asked}");
            }
            assert!((4800..5200).contains(&points));
            let none = lights.sample(Vec3::new(278.0, 600.0, 280.0), [0.2; 3]); // above the lamp
            assert_eq!(none, None, "{sampling}");
        }
    }
}
