//! One sample of the radiance that arrives at a pixel.
//!
//! A camera ray finds the point x; its emission towards the camera is added as it is, and the light that it
//! reflects is estimated with one direction w, drawn as the strategy says from a density p per solid angle:
//!
//!   L_i(x, w) f_r(w_o, w) max(n . w, 0) / p(w).
//!
//! - A direction from the BRDF or the hemisphere is followed to the first thing on it: L_i is an emitter's K_e
//!   on the sides that emit, the environment's radiance if nothing is met, 0 otherwise.
//! - A direction from the lights counts if the shadow ray reaches the very triangle that was drawn, or, for the
//!   environment, meets nothing. No shadow ray is traced where emission, BRDF or cosine is 0.
//! - `mis` divides either by c p_brdf + (1 - c) p_light, where p_light is of the *visible* point in that
//!   direction: it is on the triangle that was hit or reached, so both ways give the same density (see
//!   [`crate::sampler::MeshLight`]).
//! - `mis-two` draws both, divides each by its own density, and adds them with the weights of a [`Heuristic`], formed
//!   from the same two densities.
//!
//! Surfaces have two sides, and the one that the camera sees is shaded. Directions have to leave on that side
//! of both the geometric and the shading normal, so that no light leaks through; where the camera looks at the
//! back of a shading normal, the geometric one is used. What falls under the surface has value 0 and is a
//! sample like any other: nothing is ever drawn again.

use super::brdf::{ALL_LOBES, Lobes, NO_LOBES};
use super::{AUTO_WEIGHTS, Brdf, Lights, Reflection, Strategy, Target};
use crate::random::to_f32;
use crate::sampler::{Frame, Heuristic, UniformHemisphere, luminance};
use crate::scene::{Hit, Ray, RayQueries, Scene};
use glam::{Vec2, Vec3};

/// Estimates radiance with a strategy. See the file for its mathematics.
///
/// ```
/// use warpcheck::estimator::{Integrator, Lights, Strategy};
/// use warpcheck::scene::Scene;
/// let scene = Scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml"))?;
/// let lights = Lights::load(&scene)?;
/// let integrator = Integrator::new(&scene, &lights, Strategy::Light);
/// let lamp = scene.camera.pixel_of(glam::Vec3::new(278.0, 548.0, 279.5)).unwrap();
/// let radiance = integrator.radiance(lamp[0], lamp[1], [0.5; 7]);
/// assert!(radiance.x >= 17.0); // K_e, and what the lamp reflects of itself: nothing
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Integrator<'a> {
    scene: &'a Scene,
    lights: &'a Lights,
    reflections: Box<[Reflection]>,
    strategy: Strategy,
    directions: Directions,
    lobes: Lobes,
}

/// The most variates that one estimate takes.
pub const VARIATES: usize = 7;

#[derive(Clone, Copy, Debug)]
pub(super) enum Directions {
    Uniform,
    /// c p_brdf + (1 - c) p_light, with the ends `brdf` and `light`.
    Mixture(f32),
    Both(Heuristic),
}

/// A direction in which there is light.
struct Found {
    /// L_i f_r max(n . w, 0).
    value: Vec3,
    /// p_brdf and p_light there, per solid angle; the one by which it was not drawn is 0 if nobody asked.
    brdf: f32,
    light: f32,
}

/// Light that arrives unless something stands in its way.
struct Unshaded {
    found: Found,
    way: Way,
}

/// What has to be free for light to arrive.
#[derive(Clone, Copy)]
enum Way {
    /// Between two points on triangles.
    Points([(Vec3, u32); 2]),
    /// All of a ray.
    Ray(Ray),
}

impl Way {
    #[inline]
    fn is_free(&self, scene: &Scene) -> bool {
        match self {
            Self::Points([(from, on), (to, on_other)]) => scene.sees(*from, *on, *to, *on_other),
            Self::Ray(ray) => !scene.rays().occluded(ray),
        }
    }
}

/// An estimate whose shadow ray is still to be traced: many of those are traced together.
pub(super) struct Begun {
    emitted: Vec3,
    reflected: Option<Vec3>,
    /// What comes to that where the way is free.
    light: Option<(Vec3, Way)>,
}

impl Begun {
    /// The radiance, once the way of the light is looked at.
    #[inline]
    pub fn finish(self, scene: &Scene) -> Vec3 {
        let light = self.light.filter(|(_, way)| way.is_free(scene)).map(|(light, _)| light);
        let reflected = match (self.reflected, light) {
            (Some(lobe), Some(light)) => Some(lobe + light),
            (one, other) => one.or(other),
        };
        self.emitted + reflected.unwrap_or(Vec3::ZERO)
    }
}

/// A point that the camera sees, and how it reflects towards it.
struct Shade {
    hit: Hit,
    point: Vec3,
    /// The geometric normal on the side that is seen.
    side: Vec3,
    /// About the shading normal.
    frame: Frame,
    brdf: Brdf,
}

/// f_r max(n . w, 0), and the density p_brdf.
struct Response {
    world: Vec3,
    value: Vec3,
    density: f32,
}

impl<'a> Integrator<'a> {
    /// An integrator for a scene; `lights` have to be made from the same.
    ///
    /// # Panics
    /// If the weight of a [`Strategy::Mis`] is not in [0, 1], or the strategy samples lights that were built to be looked
    /// at only.
    pub fn new(scene: &'a Scene, lights: &'a Lights, strategy: Strategy) -> Self {
        let directions = match strategy {
            Strategy::Uniform => Directions::Uniform,
            Strategy::Brdf => Directions::Mixture(1.0),
            Strategy::Light => Directions::Mixture(0.0),
            Strategy::Mis { brdf_weight: c } => {
                assert!((0.0..=1.0).contains(&c), "the weight of the BRDF is {c}; it must be from 0 to 1");
                Directions::Mixture(c as f32)
            }
            Strategy::MisAuto => Directions::Mixture(0.5),
            Strategy::MisTwo { heuristic } => Directions::Both(heuristic),
        };
        assert!(
            lights.sampling().is_some() || !strategy.draws_lights(),
            "the lights were built without what `{strategy}` samples them by"
        );
        let reflections: Box<[_]> =
            scene.materials.iter().map(|m| Reflection::new(m, scene.convention)).collect();
        let used = scene.triangles.iter().map(|t| reflections[t.material as usize].lobes());
        let lobes = used.fold(NO_LOBES, |lobes, lobe| lobes | lobe);
        Self { scene, lights, reflections, strategy, directions, lobes }
    }

    /// The same with the code of all lobes, present or not: for comparisons. No bit changes.
    pub fn with_all_lobes(self) -> Self {
        Self { lobes: ALL_LOBES, ..self }
    }

    /// The scene that is lit.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// How directions are drawn.
    pub fn strategy(&self) -> Strategy {
        self.strategy
    }

    /// How many variates an estimate uses: the others of the [`VARIATES`] are ignored.
    pub fn variates(&self) -> usize {
        if matches!(self.directions, Directions::Both(_)) { VARIATES } else { 4 }
    }

    /// The lobes that the scene has.
    pub(super) fn lobes(&self) -> Lobes {
        self.lobes
    }

    pub(super) fn directions(&self) -> Directions {
        self.directions
    }

    /// An estimate of the radiance at a point of the picture (in [pixel coordinates](crate::scene::Camera)),
    /// for variates in `[0, 1)`: the first chooses between BRDF and lights, the next three the direction; `mis-two` takes
    /// these three for the BRDF and the last three for the lights. ([`Strategy::MisAuto`] has its weights
    /// from [`render`](super::render); here it is `mis:0.5`.)
    #[inline]
    pub fn radiance(&self, x: f32, y: f32, xi: [f64; VARIATES]) -> Vec3 {
        self.begin::<ALL_LOBES>(self.directions, x, y, xi).finish(self.scene)
    }

    /// Begins the same for other directions, with the code of these lobes.
    #[inline]
    pub(super) fn begin<const LOBES: Lobes>(
        &self,
        directions: Directions,
        x: f32,
        y: f32,
        xi: [f64; VARIATES],
    ) -> Begun {
        let ray = self.scene.camera.ray(x, y);
        let Some(hit) = self.scene.rays().closest(&ray) else {
            let emitted = self.lights.sky_radiance(ray.direction);
            return Begun { emitted, reflected: None, light: None };
        };
        let out = -ray.direction;
        let emitted = self.scene.emitted(hit.triangle, out);
        let (reflected, light) = match self.shade::<LOBES>(hit, out) {
            Some(shade) => self.direct::<LOBES>(directions, &shade, xi),
            None => (None, None),
        };
        Begun { emitted, reflected, light }
    }

    /// What one sample of the mixture with c = 1/2 says about the second moment of the luminance under each of
    /// [`AUTO_WEIGHTS`].
    pub(super) fn second_moments(&self, x: f32, y: f32, xi: [f64; VARIATES]) -> [f64; AUTO_WEIGHTS.len()] {
        let ray = self.scene.camera.ray(x, y);
        let shade =
            self.scene.rays().closest(&ray).and_then(|hit| self.shade::<ALL_LOBES>(hit, -ray.direction));
        let [pick, a, b, c, ..] = xi;
        let found = shade.and_then(|shade| match pick < 0.5 {
            true => self.along_lobe::<ALL_LOBES>(&shade, [a, b, c], true),
            false => {
                let light = self.along_light::<ALL_LOBES>(&shade, [a, b, c])?;
                light.way.is_free(self.scene).then_some(light.found)
            }
        });
        let Some(Found { value, brdf, light }) = found else { return Default::default() };
        let under = |c: f32| f64::from(c * brdf + (1.0 - c) * light);
        let square = luminance(value.to_array()).powi(2) / under(0.5);
        let moments = AUTO_WEIGHTS.map(|c| square / under(c));
        // An infinite density says that everything is in one place, whatever c.
        if moments.iter().all(|m| m.is_finite()) { moments } else { Default::default() }
    }

    /// The point of a hit; `None` if it is black or seen edge-on.
    #[inline]
    fn shade<const LOBES: Lobes>(&self, hit: Hit, out: Vec3) -> Option<Shade> {
        let triangle = &self.scene.triangles[hit.triangle as usize];
        let reflection = &self.reflections[triangle.material as usize];
        let facing = triangle.normal.dot(out);
        if reflection.is_black() || facing == 0.0 {
            return None;
        }
        let turn = 1.0_f32.copysign(facing);
        let side = triangle.normal * turn;
        let mut normal = self.scene.shading_normal(&hit) * turn;
        if normal.dot(out) <= 0.0 {
            normal = side;
        }
        let frame = Frame::new(normal);
        let brdf = reflection.seen_among::<LOBES>(frame.to_local(out));
        Some(Shade { point: self.scene.point(&hit), hit, side, frame, brdf })
    }

    /// One estimate of the light that is reflected; `None` is 0. What comes from where lights are only counts if its way is free.
    #[inline]
    fn direct<const LOBES: Lobes>(
        &self,
        directions: Directions,
        at: &Shade,
        xi: [f64; VARIATES],
    ) -> (Option<Vec3>, Option<(Vec3, Way)>) {
        let [pick, a, b, c, d, e, f] = xi;
        match directions {
            Directions::Uniform => (self.uniformly::<LOBES>(at, [b, c]), None),
            Directions::Mixture(share) => {
                let value = |found: &Found| found.value / mix(share, found.brdf, found.light);
                // pick < 1, so that c = 1 is always and c = 0 never.
                match to_f32(pick) < share {
                    true => {
                        let found = self.along_lobe::<LOBES>(at, [a, b, c], share < 1.0);
                        (found.map(|found| value(&found)), None)
                    }
                    false => {
                        let light = self.along_light::<LOBES>(at, [a, b, c]);
                        (None, light.map(|light| (value(&light.found), light.way)))
                    }
                }
            }
            Directions::Both(heuristic) => {
                let lobe = self.along_lobe::<LOBES>(at, [a, b, c], true).map(|found| {
                    let weight = heuristic.weight(found.brdf, found.light);
                    found.value * (weight / found.brdf)
                });
                let light = self.along_light::<LOBES>(at, [d, e, f]).map(|Unshaded { found, way }| {
                    let weight = heuristic.weight(found.light, found.brdf);
                    (found.value * (weight / found.light), way)
                });
                (lobe, light)
            }
        }
    }

    /// The estimate by one direction of the hemisphere.
    #[inline]
    fn uniformly<const LOBES: Lobes>(&self, at: &Shade, [a, b]: [f64; 2]) -> Option<Vec3> {
        let local = UniformHemisphere.sample(Vec2::new(to_f32(a), to_f32(b)));
        let response = at.response::<LOBES>(local, at.frame.to_world(local))?;
        let (radiance, _) = self.arriving(at, response.world)?;
        Some(response.value * radiance / UniformHemisphere.density(local))
    }

    /// Light in a direction of the lobes; `None` is darkness.
    #[inline]
    fn along_lobe<const LOBES: Lobes>(&self, at: &Shade, xi: [f64; 3], ask_light: bool) -> Option<Found> {
        let local = at.brdf.sample_among::<LOBES>(xi.map(to_f32))?;
        let response = at.response::<LOBES>(local, at.frame.to_world(local))?;
        let (radiance, target) = self.arriving(at, response.world)?;
        let light = match target {
            _ if !ask_light => 0.0,
            Target::Point { point, emitter } => self.lights.density_of_point(at.point, point, emitter),
            Target::Sky => self.lights.density_of_sky(response.world),
        };
        Some(Found { value: response.value * radiance, brdf: response.density, light })
    }

    /// Light from where the lights are; `None` is darkness.
    #[inline]
    fn along_light<const LOBES: Lobes>(&self, at: &Shade, xi: [f64; 3]) -> Option<Unshaded> {
        let draw = self.lights.sample(at.point, xi)?;
        if draw.radiance == Vec3::ZERO {
            return None;
        }
        let response = at.response::<LOBES>(at.frame.to_local(draw.direction), draw.direction)?;
        let way = match draw.target {
            Target::Point { point, emitter } => {
                let triangle = self.scene.emitters[emitter].triangle;
                Way::Points([(at.point, at.hit.triangle), (point, triangle)])
            }
            Target::Sky => Way::Ray(self.scene.leave(&at.hit, draw.direction)),
        };
        let found =
            Found { value: response.value * draw.radiance, brdf: response.density, light: draw.density };
        Some(Unshaded { found, way })
    }

    /// What arrives along `w`, and where it comes from; `None` is darkness.
    #[inline]
    fn arriving(&self, at: &Shade, w: Vec3) -> Option<(Vec3, Target)> {
        let (radiance, target) = match self.scene.rays().closest(&self.scene.leave(&at.hit, w)) {
            None => (self.lights.sky_radiance(w), Target::Sky),
            Some(hit) => {
                let emitter = self.scene.emitter_of(hit.triangle)?;
                let radiance = self.scene.emitted(hit.triangle, -w);
                (radiance, Target::Point { point: self.scene.point(&hit), emitter })
            }
        };
        (radiance != Vec3::ZERO).then_some((radiance, target))
    }
}

impl Shade {
    /// What the point makes of light from a direction, given in both frames; `None` if it is nothing.
    #[inline]
    fn response<const LOBES: Lobes>(&self, local: Vec3, world: Vec3) -> Option<Response> {
        if local.z <= 0.0 || world.dot(self.side) <= 0.0 {
            return None;
        }
        let (value, density) = self.brdf.evaluate_among::<LOBES>(local);
        let value = value * local.z;
        (value != Vec3::ZERO).then_some(Response { world, value, density })
    }
}

/// c a + (1 - c) b, where a part of weight 0 adds nothing, be it infinite.
#[inline]
fn mix(c: f32, a: f32, b: f32) -> f32 {
    match c {
        0.0 => b,
        1.0 => a,
        _ => c * a + (1.0 - c) * b,
    }
}
