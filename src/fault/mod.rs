//! Broken samplers: each is a working sampler with one mistake that has been made in public.
//!
//! A check is worth what it catches. These three show what a failure looks like (`warpcheck verify broken`).

use crate::domain::{Hemisphere, Sphere, Triangle};
use crate::random::ONE_MINUS_EPSILON_F64;
use crate::sampler::{
    CosineHemisphere, DiscreteCdf, Environment, Sampler, UniformHemisphere, from_fn, luminance,
};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};

/// The barycentric warp with the branch `xi0 < xi1^2`, as a widely copied text prints it: 1/48 of the square leaves the triangle.
pub fn barycentric_branch_squared() -> impl Sampler<Domain = Triangle> {
    from_fn(
        Triangle::with_area(1.0),
        |[u, v]: [f32; 2]| {
            let (b0, b1) = if u < v * v { (0.5 * u, v - 0.5 * u) } else { (u - 0.5 * v, 0.5 * v) };
            Vec3::new(b0, b1, 1.0 - b0 - b1)
        },
        |_: Vec3| 1.0_f32,
    )
}

/// Sampled uniformly, with the density of cosine weighting.
pub fn uniform_with_cosine_density() -> impl Sampler<Domain = Hemisphere> {
    from_fn(Hemisphere, |xi: Vec2| UniformHemisphere.sample(xi), |w: Vec3| CosineHemisphere.density(w))
}

/// An environment map whose texels are chosen by luminance alone: without sin theta, the poles get too many samples.
///
/// # Errors
/// If the map can't be sampled.
pub fn environment_without_sine(
    map: Environment,
) -> Result<impl Sampler<Domain = Sphere>, crate::sampler::Error> {
    let (width, height) = (map.width(), map.height());
    let texels = (0..width * height).map(|i| luminance(map.texel(i % width, i / width)));
    let knots = map.knots();
    let table = DiscreteCdf::new(&texels.collect::<Vec<_>>())?;
    Ok(from_fn(
        Sphere,
        move |[a, b]: [f64; 2]| {
            let choice = table.choose(a);
            let u = ((choice.index % width) as f64 + choice.rest) / width as f64;
            let v = (((choice.index / width) as f64 + b) / height as f64).min(ONE_MINUS_EPSILON_F64);
            let (theta, phi) = (PI * v, TAU * u);
            DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
        },
        move |w: DVec3| Sampler::density(&map, &w),
    )
    .with_knots(knots))
}
