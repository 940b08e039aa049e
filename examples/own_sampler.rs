//! A sampler of your own, right and wrong: a cone of directions, uniform per solid angle and (wrongly) uniform in the angle.
//!
//! ```text
//! cargo run --release --example own_sampler
//! ```

use glam::Vec3;
use std::f32::consts::TAU;
use warpcheck::domain::Sphere;
use warpcheck::sampler::from_fn;
use warpcheck::verify::Verdict;

/// Half the opening angle.
const ANGLE: f32 = 0.4;

fn direction(one_minus_cosine: f32, turn: f32) -> Vec3 {
    let r = (one_minus_cosine * (2.0 - one_minus_cosine)).sqrt();
    let (sin, cos) = (TAU * turn).sin_cos();
    Vec3::new(r * cos, r * sin, 1.0 - one_minus_cosine)
}

/// 1 over the solid angle of the cone, inside of it.
fn density(w: Vec3) -> f32 {
    let inside = w.z >= ANGLE.cos();
    if inside { 1.0 / (TAU * (1.0 - ANGLE.cos())) } else { 0.0 }
}

/// The verdicts on each right variant and its broken copy.
pub fn verdicts() -> [[Verdict; 2]; 1] {
    let right = from_fn(Sphere, |[u, v]: [f32; 2]| direction(u * (1.0 - ANGLE.cos()), v), density);
    let wrong = from_fn(Sphere, |[u, v]: [f32; 2]| direction(1.0 - (u * ANGLE).cos(), v), density);
    let right = warpcheck::verify(&right).name("cone, uniform per solid angle").samples(100_000).run();
    let wrong = warpcheck::verify(&wrong).name("cone, uniform in the angle").samples(100_000).run();
    println!("{right}\n{wrong}");
    [[right.verdict(), wrong.verdict()]]
}

fn main() {
    verdicts();
}
