//! Scenes: what there is to light, what lights it, and who looks.
//!
//! A [`Scene`] comes from a TOML file (its keys are listed below) that names Wavefront meshes. It is a flat list of
//! triangles in world space with materials, the list of those that emit, a camera, an environment's settings, and an
//! answer to ray queries ([`RayQueries`]).
//!
//! # The scene file
//! ```toml
//! materials = "kd-phong"            # or "mtl": how K_d, K_s, N_s become a BRDF
//!
//! [[mesh]]                          # one or more; applied in the order scale, rotate, translate
//! file = "room.obj"                 # like every path, relative to the scene file
//! scale = 1.0
//! rotate_y_degrees = 0.0            # counterclockwise seen from +y
//! translate = [0.0, 0.0, 0.0]
//! normals = "file"                  # shading normals: "file" (if it has any), "smooth", "flat"
//! two_sided = false                 # whether emitters emit from their back as well
//! emitters_reflect = true           # false: K_d and K_s of materials with K_e above 0 count as 0
//! material = { kd = [0.5, 0.5, 0.5], ks = [0.0, 0.0, 0.0], ns = 1.0, ke = [0.0, 0.0, 0.0] }  # replaces what it names;
//!                                   # roughness = 0.2 makes the glossy lobe a GGX one of that alpha, and n_s counts no more
//! materials.floor = { kd = [0.2, 0.2, 0.2] }   # the same for the material of that name, after `material`
//!
//! [camera]
//! eye = [0.0, 1.0, 5.0]
//! at = [0.0, 1.0, 0.0]
//! up = [0.0, 1.0, 0.0]              # this is the default
//! fov_degrees = 40.0
//! fov_axis = "vertical"             # the default; "horizontal", "smaller"
//! mirror = false                    # true: left and right exchanged
//!
//! [environment]                     # optional
//! file = "sky.hdr"
//! scale = 1.0                       # multiplies the radiance
//! rotate_degrees = 0.0              # counterclockwise seen from the zenith
//! up = "y"                          # the default; which axis of the scene is the map's zenith: "y", "z"
//!
//! [picture]
//! width = 256
//! height = 128
//! display = "srgb"                  # the default; "gamma22"
//! exposure = 1.0                    # multiplies the radiance before display
//!
//! [reference]                       # optional: what the picture should be, by one or more of
//! file = "room.exr"                 # another renderer's picture, with which `warpcheck agree` compares
//! blocks = "room.json"              # its block means and their standard errors, preferred to the picture
//! radiance = { floor = [0.8, 0.5, 0.2] }   # closed forms, by material, with which `warpcheck converge` compares:
//!                                   # what is seen of that material has this radiance everywhere
//! ```
//!
//! Required are `materials`, at least one `mesh` with its `file`, the camera's `eye`, `at` and `fov_degrees`, the
//! picture's `width` and `height`, and the `file` of an environment. The rest defaults to what is shown,
//! except that without `material` a mesh keeps the materials of its file. Unknown keys are errors.

mod camera;
mod error;
mod file;
mod mesh;
mod polygon;
mod rays;
#[allow(clippy::module_inception)]
mod scene;

pub use camera::{Camera, FovAxis, View};
pub use error::Error;
pub use file::{Convention, Display, Environment, Picture, Reference, UpAxis};
pub use mesh::{Material, Mesh};
pub use rays::{
    BruteForce, Bvh, Hit, Ray, RayQueries, RayStructure, Rays, TriangleList, offset_origin, offset_unit,
};
pub use scene::{Emitter, Scene, Triangle};
