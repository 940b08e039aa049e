//! What a scene and a strategy need, and nothing else.
//!
//! A renderer that builds everything for every scene pays for it three times: in set-up time, in memory (and so in cache), and in branches. A
//! [`Plan`] looks first:
//!
//! | part | built if | otherwise |
//! | --- | --- | --- |
//! | ray structure | more than [`RayStructure::LONGEST_LIST`] triangles | the triangles one by one |
//! | emitter table | there are emitters, and a strategy draws from the lights | left out; triangles without area or emission are never in it |
//! | environment map | the scene names one | left out; one radiance if all texels are the same |
//! | environment tables | there is a map that varies, and a strategy draws from the lights | left out; a constant map is sampled uniformly |
//! | each glossy lobe | a material of a triangle has it | its code isn't in the loop (compiled once for each set of lobes) |
//! | weights of the pixels | the strategy is `mis:auto` | left out |
//!
//! Leaving out what is not used changes no bit. The one exception is the constant map, which is sampled from other variates.
//!
//! What is saved for each sample rather than once: no shadow ray is traced where emission, BRDF or cosine is 0 (see
//! [`Integrator`](super::Integrator)), and materials without a glossy lobe draw from none, so that `mis` on a diffuse scene is a mixture of the
//! cosine and the lights.

use super::brdf::{GGX, PHONG};
use super::lights::{Map, read_map, with_tables};
use super::{Error, LightSampling, Lights, Reflection, Selection, Strategy};
use crate::scene::{RayStructure, Scene};
use std::time::{Duration, Instant};

/// The lights of a scene as some strategies need them, and the list of what was built and what was not.
///
/// ```
/// use warpcheck::estimator::{LightSampling, Plan, Strategy};
/// use warpcheck::scene::Scene;
/// let scene = Scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml"))?;
/// let plan = Plan::of(&scene, &[Strategy::Brdf], LightSampling::default())?;
/// let table = plan.parts().iter().find(|part| part.name == "emitter table").unwrap();
/// assert!(!table.built && table.why.contains("no strategy draws from the lights"));
/// assert_eq!(plan.lights().table_bytes(), [0, 0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Plan {
    lights: Lights,
    parts: Vec<Part>,
}

/// Something that a scene may need.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What it is.
    pub name: &'static str,
    /// Whether it is there.
    pub built: bool,
    /// Why it is there, or why not; a phrase.
    pub why: String,
    /// What it takes in memory.
    pub bytes: usize,
    /// What it took to build; for the environment map, to read.
    pub time: Duration,
}

impl Part {
    fn built(name: &'static str, why: impl Into<String>, bytes: usize, time: Duration) -> Self {
        Self { name, built: true, why: why.into(), bytes, time }
    }

    fn left_out(name: &'static str, why: impl Into<String>) -> Self {
        Self { name, built: false, why: why.into(), bytes: 0, time: Duration::ZERO }
    }
}

impl Plan {
    /// What these strategies need together, with emitters sampled in this way. Reads the environment map, if the scene names one.
    ///
    /// # Errors
    /// As [`Lights::load_with`].
    pub fn of(scene: &Scene, strategies: &[Strategy], sampling: LightSampling) -> Result<Self, Error> {
        let mut parts = vec![rays(scene)];
        let drawn = strategies.iter().any(|s| s.draws_lights());
        let no_strategy = "no strategy draws from the lights";

        let start = Instant::now();
        let map = read_map(scene)?;
        let read = start.elapsed();
        let start = Instant::now();
        let map = match map {
            None => {
                let none = "the scene names no environment";
                parts.extend([
                    Part::left_out("environment map", none),
                    Part::left_out("environment tables", none),
                ]);
                None
            }
            Some(map) => {
                let bytes = size_of_val(map.texels());
                Some(match map.constant() {
                    Some(radiance) => {
                        let why = "one radiance: all texels are the same";
                        parts.push(Part::built("environment map", why, size_of_val(&radiance), read));
                        let why = "a constant map is sampled uniformly";
                        parts.push(Part::left_out("environment tables", why));
                        Map::Constant(radiance)
                    }
                    None => {
                        let why = format!("{} texels of radiance", map.texels().len());
                        parts.push(Part::built("environment map", why, bytes, read));
                        match drawn {
                            true => with_tables(scene, map)?,
                            false => {
                                parts.push(Part::left_out("environment tables", no_strategy));
                                Map::Radiance(map)
                            }
                        }
                    }
                })
            }
        };
        let tables = start.elapsed();
        let start = Instant::now();
        let lights = Lights::build(scene, map, drawn.then_some(sampling))?;
        let emitters = start.elapsed();
        let [mesh_bytes, sky_bytes] = lights.table_bytes();
        if sky_bytes > 0 {
            let why = "the map varies: marginal and conditional CDFs";
            parts.push(Part::built("environment tables", why, sky_bytes, tables));
        }
        parts.push(match scene.emitters.len() {
            0 => Part::left_out("emitter table", "no triangle emits"),
            _ if !drawn => Part::left_out("emitter table", no_strategy),
            count => {
                let by = match sampling.selection {
                    Selection::Area => "a CDF of areas with a guide",
                    Selection::Power => "a CDF of powers with a guide",
                    Selection::PowerOverDistance => "a tree of powers",
                };
                let others = scene.triangles.len() - count;
                let why = format!(
                    "{by} over {count} emitters; {others} triangles without emission or area are not in it"
                );
                Part::built("emitter table", why, mesh_bytes, emitters)
            }
        });
        parts.extend(lobes(scene));
        parts.push(match strategies.contains(&Strategy::MisAuto) {
            true => {
                let pixels = scene.picture.width as usize * scene.picture.height as usize;
                let why = "mis:auto chooses one for each pixel, before the first pass";
                Part::built("weights of the pixels", why, pixels * size_of::<f32>(), Duration::ZERO)
            }
            false => Part::left_out("weights of the pixels", "no strategy is mis:auto"),
        });
        Ok(Self { lights, parts })
    }

    /// The lights: for [`render`](super::render()).
    pub fn lights(&self) -> &Lights {
        &self.lights
    }

    /// What was looked at, and what came of it.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }
}

fn rays(scene: &Scene) -> Part {
    let (count, time) = (scene.triangles.len(), scene.rays_time());
    let bytes = scene.rays().bytes();
    match scene.rays().structure() {
        RayStructure::Tree => {
            Part::built("ray structure", format!("a tree over {count} triangles"), bytes, time)
        }
        RayStructure::List => {
            let why = format!("triangles are met one by one: there are {count}");
            Part { bytes, time, ..Part::left_out("ray structure", why) }
        }
    }
}

/// The lobes of materials that triangles have.
fn lobes(scene: &Scene) -> [Part; 2] {
    let mut used = vec![false; scene.materials.len()];
    scene.triangles.iter().for_each(|t| used[t.material as usize] = true);
    let materials = || scene.materials.iter().zip(&used).filter(|(_, used)| **used);
    [("Phong lobe", PHONG), ("GGX lobe", GGX)].map(|(name, lobe)| {
        let has = materials().filter(|(m, _)| Reflection::new(m, scene.convention).lobes() == lobe).count();
        match has {
            0 => Part::left_out(
                name,
                "no material has one: its code is not in the loop, and no strategy draws from it",
            ),
            n => Part::built(name, format!("{n} of {} materials", materials().count()), 0, Duration::ZERO),
        }
    })
}
