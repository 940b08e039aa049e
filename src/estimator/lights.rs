//! All lights of a scene as one sampler of directions.
//!
//! Mesh emitters are sampled by area: one [`MeshLight`] over all of them, density 1 / total emissive area per
//! area. The environment is sampled by its marginal and conditional CDFs ([`Environment`]). Where a scene has
//! both, the emitters are chosen with probability q = 1/2 and the environment otherwise, whatever their powers;
//! so the density per solid angle as seen from x is
//!
//! - q |y - x|^2 / (A max(0, n_y . -w)) of the point y of an emitter, and
//! - (1 - q) p_map(w) of a direction in which nothing is met,
//!
//! with q = 1 without environment and q = 0 without emitters. A direction leads to one or the other, since what
//! is *visible* there is one thing: no sum of both is needed, nor over the emitters behind the first (see
//! [`MeshLight`] on the two densities).

use super::Error;
use crate::picture;
use crate::sampler::{Environment, MeshLight, RowWarp, Sides};
use crate::scene::{self, Scene, UpAxis};
use glam::Vec3;
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
    mesh: Option<MeshLight>,
    /// Radiance of each emitter.
    radiance: Box<[Vec3]>,
    sky: Option<Sky>,
    /// q: the probability of the emitters.
    mesh_share: f64,
}

/// An environment map and how it stands in the scene.
#[derive(Clone, Debug)]
struct Sky {
    map: Environment,
    place: scene::Environment,
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
        let file = || scene.file.clone();
        let mesh = if scene.emitters.is_empty() {
            None
        } else {
            let sides = |two_sided| if two_sided { Sides::Both } else { Sides::Front };
            let triangles = scene.emitters.iter().map(|e| (e.vertices, sides(e.two_sided)));
            Some(
                MeshLight::with_sides(triangles)
                    .map_err(|source| Error::Emitters { file: file(), source })?,
            )
        };
        let upright =
            || scene::Environment { file: PathBuf::new(), scale: 1.0, rotation: 0.0, up: UpAxis::Y };
        let sky = map.map(|map| Sky { map, place: scene.environment.clone().unwrap_or_else(upright) });
        let mesh_share = match (&mesh, &sky) {
            (Some(_), Some(_)) => 0.5,
            (Some(_), None) => 1.0,
            (None, Some(_)) => 0.0,
            (None, None) => return Err(Error::NoLight { file: file() }),
        };
        Ok(Self { mesh, radiance: scene.emitters.iter().map(|e| e.radiance).collect(), sky, mesh_share })
    }

    /// The lights of `scene`; reads its environment map, if it names one, and multiplies it by the scene's
    /// `scale`. Samples are uniform in cos theta inside a texel.
    ///
    /// # Errors
    /// As [`new`](Self::new), and if the map can't be read or has texels that are no radiance.
    pub fn load(scene: &Scene) -> Result<Self, Error> {
        let read = |place: &scene::Environment| {
            let map = picture::read(&place.file)?;
            let (width, height) = (map.width(), map.height());
            let mut texels = map.into_pixels();
            texels.iter_mut().flatten().for_each(|x| *x *= place.scale);
            Environment::new(width, height, texels, RowWarp::UniformCosTheta)
                .map_err(|source| Error::Map { file: place.file.clone(), source })
        };
        Self::new(scene, scene.environment.as_ref().map(read).transpose()?)
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
                let s = mesh.sample_from(x, [xi[0] / q, xi[1], xi[2]])?;
                Some(LightDraw {
                    direction: s.direction,
                    radiance: self.radiance[s.triangle],
                    density: (q * s.density) as f32,
                    target: Target::Point { point: s.point, emitter: s.triangle },
                })
            }
            (_, Some(Sky { map, place })) => {
                let s = map.sample([xi[1], xi[2]]);
                Some(LightDraw {
                    direction: place.to_scene(s.direction),
                    radiance: s.radiance,
                    density: (1.0 - q) as f32 * s.density,
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
        (self.mesh_share * mesh.density_from(x, y, emitter)) as f32
    }

    /// Density per solid angle of a direction that escapes.
    #[inline]
    pub fn density_of_sky(&self, w: Vec3) -> f32 {
        let Some(Sky { map, place }) = &self.sky else { return 0.0 };
        (1.0 - self.mesh_share) as f32 * map.density(place.to_map(w))
    }

    /// Radiance from a direction that escapes; 0 without environment.
    #[inline]
    pub fn sky_radiance(&self, w: Vec3) -> Vec3 {
        let Some(Sky { map, place }) = &self.sky else { return Vec3::ZERO };
        map.radiance(place.to_map(w))
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
        let map = Environment::new(16, 8, texels, RowWarp::UniformCosTheta).unwrap();
        let lights = Lights::new(&scene, Some(map)).unwrap();
        let x = Vec3::new(100.0, 20.0, 300.0);
        let mut rng = stream(1, "lights", 0);
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
            assert!((draw.density / asked - 1.0).abs() < 1e-6, "{draw:?}: {asked}");
        }
        assert!((4800..5200).contains(&points));
        let none = lights.sample(Vec3::new(278.0, 600.0, 280.0), [0.2; 3]); // above the lamp
        assert_eq!(none, None);
    }
}
