//! The list.

use super::{Error, Subject, read_environment};
use crate::fault::{self, Fault};
use crate::sampler::*;
use crate::scene::{Material, Mesh};
use glam::Vec3;
use std::path::{Path, PathBuf};

/// A sampler that ships, not yet made.
pub struct Entry {
    /// Its name: family, then what sets it apart.
    pub name: String,
    /// What it is, in half a line.
    pub about: String,
    /// Whether it is right. What is broken is there to be looked at, and only made when named.
    pub right: bool,
    make: Box<dyn Fn() -> Result<Box<dyn Subject>, Error> + Send + Sync>,
}

impl Entry {
    /// Makes the sampler; reads the files that it needs.
    ///
    /// # Errors
    /// If a file can't be read or used.
    pub fn make(&self) -> Result<Box<dyn Subject>, Error> {
        (self.make)()
    }
}

/// The maps that ship.
const MAPS: [&str; 5] = [
    "spruit_sunrise_512",
    "noon_grass_512",
    "potsdamer_platz_512",
    "blender_interior_512",
    "spruit_sunrise_1k",
];

/// All samplers that ship, with their data under the folder `data`.
pub fn entries(data: &Path) -> Vec<Entry> {
    let mut all = List { data: data.into(), entries: Vec::new() };
    all.discrete();
    all.triangles();
    all.lights();
    all.environments();
    all.packed_environments();
    all.directions();
    all.mixtures();
    all.broken();
    all.entries
}

struct List {
    data: PathBuf,
    entries: Vec<Entry>,
}

impl List {
    fn add<S: Sampler + Send + 'static>(
        &mut self,
        name: impl Into<String>,
        about: impl Into<String>,
        make: impl Fn(&Path) -> Result<S, Error> + Send + Sync + 'static,
    ) {
        let data = self.data.clone();
        let make = move || Ok(Box::new(make(&data)?) as Box<dyn Subject>);
        self.entries.push(Entry {
            name: name.into(),
            about: about.into(),
            right: true,
            make: Box::new(make),
        });
    }

    fn discrete(&mut self) {
        for mesh in ["spot", "teapot"] {
            self.add(
                format!("discrete/areas-{mesh}"),
                format!("triangles of {mesh}.obj by area"),
                move |data| {
                    let file = data.join(format!("mesh/{mesh}.obj"));
                    let areas: Vec<f64> = triangles(&file, |_| true)?.iter().map(|&t| area(t)).collect();
                    DiscreteCdf::new(&areas).map_err(|error| Error::Sampler { file, error })
                },
            );
        }
        self.add("discrete/texels-spruit", "131072 texels by luminance, one of them 57% of it", |data| {
            let file = data.join("env/spruit_sunrise_512.hdr");
            let map = crate::picture::read(&file)?;
            let weights: Vec<f64> = map.pixels().iter().map(|&t| luminance(t)).collect();
            DiscreteCdf::new(&weights).map_err(|error| Error::Sampler { file, error })
        });
        for (name, how, form) in
            [("guide", "a guide table", Form::Guide), ("alias", "an alias table", Form::Alias)]
        {
            self.add(
                format!("discrete/texels-spruit-{name}"),
                format!("the same texels in {how}"),
                move |data| {
                    let file = data.join("env/spruit_sunrise_512.hdr");
                    let map = crate::picture::read(&file)?;
                    let weights: Vec<f64> = map.pixels().iter().map(|&t| luminance(t)).collect();
                    DiscreteTable::new(&weights, form).map_err(|error| Error::Sampler { file, error })
                },
            );
        }
        self.add("discrete/ragged", "seven weights from 1e-30 to 1e30, zeros between", |_| {
            Ok(DiscreteCdf::new(&[0.0, 1e30, 0.0, 3e30, 1e-30, 5e29, 0.0])?)
        });
    }

    fn triangles(&mut self) {
        for (name, warp) in
            [("low-distortion", TriangleWarp::LowDistortion), ("square-root", TriangleWarp::SquareRoot)]
        {
            self.add(format!("triangle/{name}"), "barycentric warp of the unit square", move |_| {
                Ok(BarycentricWarp::new(warp, 0.7)?)
            });
        }
    }

    fn lights(&mut self) {
        self.add("light/spot", "points on spot, 5856 triangles, by area", |data| {
            light(&data.join("mesh/spot.obj"), |_| true)
        });
        self.add("light/teapot", "points on the teapot, 992 triangles, by area", |data| {
            light(&data.join("mesh/teapot.obj"), |_| true)
        });
        self.add("light/cornell-from-floor", "directions to the Cornell box's lamp from its floor", |data| {
            let lamp = light(&data.join("scene/cornell_measured.obj"), Material::emits)?;
            Ok(SeenFrom::new(lamp, Vec3::new(180.0, 0.0, 170.0)))
        });
        self.add("light/cornell-from-ceiling", "the same, grazing, from just under the ceiling", |data| {
            let lamp = light(&data.join("scene/cornell_measured.obj"), Material::emits)?;
            Ok(SeenFrom::new(lamp, Vec3::new(400.0, 540.0, 300.0)))
        });
        self.add(
            "light/sphere-from-plate",
            "directions to a sphere of 960 triangles, half of them turned away",
            |data| {
                let sphere = light(&data.join("scene/veach_a3.obj"), |m| m.name == "light4")?;
                Ok(SeenFrom::new(sphere, Vec3::new(1.0, 1.0, 0.5)))
            },
        );
        self.add("light/triangle", "directions through a triangle, uniform in its solid angle", |_| {
            let vertices = [Vec3::new(0.2, 0.1, 1.0), Vec3::new(1.5, -0.3, 0.8), Vec3::new(-0.4, 1.1, 1.4)];
            let seen = SphericalTriangle::new(Vec3::new(0.1, 0.2, 0.3), vertices);
            Ok(seen.ok_or(crate::sampler::Error::NoArea { triangles: 1 })?)
        });
    }

    fn environments(&mut self) {
        for map in MAPS {
            for (name, rows) in [("uniform-v", RowWarp::UniformV), ("uniform-cos", RowWarp::UniformCosTheta)]
            {
                let how = if rows == RowWarp::UniformV { "v" } else { "cos theta" };
                self.add(
                    format!("environment/{map}/{name}"),
                    format!("{map}.hdr by luminance, uniform in {how} inside a row"),
                    move |data| read_environment(&data.join(format!("env/{map}.hdr")), rows),
                );
            }
        }
    }

    /// The compact forms, each with one of the ways to place theta.
    fn packed_environments(&mut self) {
        for (map, name, form, rows) in [
            ("spruit_sunrise_512", "guide", Form::Guide, RowWarp::UniformV),
            ("potsdamer_platz_512", "guide-cos", Form::Guide, RowWarp::UniformCosTheta),
            ("spruit_sunrise_512", "alias", Form::Alias, RowWarp::UniformV),
            ("potsdamer_platz_512", "alias-cos", Form::Alias, RowWarp::UniformCosTheta),
        ] {
            let about = match form {
                Form::Alias => format!("{map}.hdr in one alias table"),
                _ => format!("{map}.hdr in guide tables"),
            };
            self.add(format!("environment/{map}/{name}"), about, move |data| {
                let file = data.join(format!("env/{map}.hdr"));
                PackedEnvironment::new(super::read_map(&file)?, rows, form)
                    .map_err(|error| Error::Sampler { file, error })
            });
        }
    }

    fn directions(&mut self) {
        self.add("sphere/uniform", "all directions", |_| Ok(UniformSphere));
        self.add("hemisphere/uniform", "upper directions", |_| Ok(UniformHemisphere));
        self.add("hemisphere/cosine", "cosine-weighted directions", |_| Ok(CosineHemisphere));
        for kappa in [1e2_f32, 1e4, 1e6] {
            self.add(
                format!("vmf/{kappa:e}"),
                format!("von Mises-Fisher lobe, kappa {kappa:e}"),
                move |_| Ok(VonMisesFisher::new(tilted(), kappa)?),
            );
        }
        for (name, exponent) in [("1", 1.0_f32), ("50", 50.0), ("1e4", 1e4), ("1e6", 1e6)] {
            self.add(
                format!("phong/{name}"),
                format!("Phong lobe, exponent {name}, mirror at 37 degrees"),
                move |_| Ok(PhongLobe::new(tilted(), exponent)?),
            );
        }
        self.add("phong/50-grazing", "the same at 85 degrees: 27% of it is under the surface", |_| {
            Ok(PhongLobe::new(grazing(), 50.0)?)
        });
        for alpha in [0.01_f32, 0.1, 0.5, 1.0] {
            self.add(
                format!("ggx/{alpha}"),
                format!("GGX visible normals, alpha {alpha}, at 37 degrees"),
                move |_| Ok(GgxVisibleNormals::new(tilted(), alpha)?),
            );
        }
        self.add("ggx/0.3-grazing", "GGX visible normals, alpha 0.3, at 85 degrees", |_| {
            Ok(GgxVisibleNormals::new(grazing(), 0.3)?)
        });
    }

    /// The faults that are samplers.
    fn broken(&mut self) {
        for fault in fault::all().into_iter().filter(Fault::is_sampler) {
            self.entries.push(Entry {
                name: format!("broken/{}", fault.name),
                about: fault.wrong.to_owned(),
                right: false,
                make: Box::new(move || Ok(Box::new(fault.make()))),
            });
        }
    }

    fn mixtures(&mut self) {
        self.add("mixture/cosine-phong", "half cosine, half Phong 1000: a plastic", |_| {
            Ok(Mixture::new(0.5, CosineHemisphere, PhongLobe::new(tilted(), 1e3)?)?)
        });
        self.add("mixture/vmf-environment", "a quarter lobe, three quarters sky: one-sample MIS", |data| {
            let sky = read_environment(&data.join("env/potsdamer_platz_512.hdr"), RowWarp::UniformCosTheta)?;
            Ok(Mixture::new(0.25, VonMisesFisher::new(tilted(), 500.0)?, sky)?)
        });
        self.add("mixture/only-first", "weight 1: exactly the first sampler", |_| {
            Ok(Mixture::new(1.0, CosineHemisphere, UniformHemisphere)?)
        });
    }
}

/// 37 degrees from the normal, in no special direction.
fn tilted() -> Vec3 {
    Vec3::new(0.36, -0.48, 0.8)
}

/// 85 degrees from the normal.
fn grazing() -> Vec3 {
    let angle = 85.0_f32.to_radians();
    Vec3::new(angle.sin(), 0.0, angle.cos())
}

/// The triangles of a mesh whose material is wanted.
fn triangles(file: &Path, wanted: impl Fn(&Material) -> bool) -> Result<Vec<[Vec3; 3]>, Error> {
    let mesh = Mesh::read_with(file, Some(Material::default()))?;
    Ok(mesh
        .triangles
        .iter()
        .zip(&mesh.material_of_triangle)
        .filter(|(_, material)| wanted(&mesh.materials[**material as usize]))
        .map(|(triangle, _)| triangle.map(|i| mesh.positions[i as usize]))
        .collect())
}

fn light(file: &Path, wanted: impl Fn(&Material) -> bool) -> Result<MeshLight, Error> {
    MeshLight::new(&triangles(file, wanted)?, Sides::Front)
        .map_err(|error| Error::Sampler { file: file.into(), error })
}

fn area(triangle: [Vec3; 3]) -> f64 {
    let [a, b, c] = triangle.map(|v| v.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}
