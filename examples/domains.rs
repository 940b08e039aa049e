//! A sampler on each kind of domain, and a broken copy beside it: entries of a table, numbers, points of a disk, points on a mesh.
//!
//! ```text
//! cargo run --release --example domains
//! ```

use glam::Vec3;
use statrs::distribution::{Continuous, ContinuousCDF, Normal};
use std::f64::consts::{PI, TAU};
use warpcheck::domain::{Discrete, Disk, Interval, MeshSurface};
use warpcheck::sampler::{Sampler, TriangleWarp, from_fn, from_statrs};
use warpcheck::verify::{Verdict, verify};

fn both<A: Sampler, B: Sampler>(name: &str, right: &A, wrong: &B) -> [Verdict; 2] {
    let right = verify(right).name(name).samples(20_000).run();
    let wrong = verify(wrong).name(format!("{name}, broken")).samples(20_000).run();
    println!("{right}\n{wrong}");
    [right.verdict(), wrong.verdict()]
}

/// One of four entries; the density is the probability of an entry. Broken: the search stops one too early.
fn entries() -> [Verdict; 2] {
    let (mass, cdf) = ([0.1, 0.4, 0.0, 0.5], [0.1, 0.5, 0.5, 1.0]);
    let right =
        from_fn(Discrete::new(4), move |xi: f64| cdf.partition_point(|&c| c <= xi), move |i: usize| mass[i]);
    let early = move |xi: f64| cdf.partition_point(|&c| c <= xi).saturating_sub(1);
    let wrong = from_fn(Discrete::new(4), early, move |i: usize| mass[i]);
    both("table", &right, &wrong)
}

/// Distances in fog, exponential per length. Broken: ln xi for ln (1 - xi) is infinite at xi = 0.
fn distances() -> [Verdict; 2] {
    let density = |t: f64| 2.0 * (-2.0 * t).exp();
    let right = from_fn(Interval::positive(), |xi: f64| -0.5 * (-xi).ln_1p(), density);
    let wrong = from_fn(Interval::positive(), |xi: f64| -0.5 * xi.ln(), density);
    both("free path", &right, &wrong)
}

/// A distribution of `statrs`. Broken: a variance is taken for a standard deviation.
fn normal() -> [Verdict; 2] {
    let (right, taken) = (Normal::new(0.0, 2.0).unwrap(), Normal::new(0.0, 4.0).unwrap());
    let line = Interval::real_line();
    let wrong = from_fn(line, move |xi: f64| right.inverse_cdf(xi.max(1e-300)), move |x: f64| taken.pdf(x));
    both("normal", &from_statrs(line, right), &wrong)
}

/// A lens, uniform per area. Broken: the radius without its square root.
fn lens() -> [Verdict; 2] {
    let point = |r: f64, turn: f64| [r * (TAU * turn).cos(), r * (TAU * turn).sin()];
    let right = from_fn(Disk, move |[u, v]: [f64; 2]| point(u.sqrt(), v), |_: [f64; 2]| 1.0 / PI);
    let wrong = from_fn(Disk, move |[u, v]: [f64; 2]| point(u, v), |_: [f64; 2]| 1.0 / PI);
    both("lens", &right, &wrong)
}

/// Two triangles of areas 1 and 3, uniform per area. Broken: either with probability 1/2.
fn mesh() -> [Verdict; 2] {
    let draw = |first: f32| {
        move |[pick, u, v]: [f32; 3]| -> (usize, Vec3) {
            (usize::from(pick >= first), TriangleWarp::LowDistortion.barycentric([u, v].into()))
        }
    };
    let surface = MeshSurface::from_areas(vec![1.0, 3.0]);
    let right = from_fn(surface.clone(), draw(0.25), |_: (usize, Vec3)| 0.25);
    let wrong = from_fn(surface, draw(0.5), |_: (usize, Vec3)| 0.25);
    both("mesh", &right, &wrong)
}

/// The verdicts on each right variant and its broken copy.
pub fn verdicts() -> [[Verdict; 2]; 5] {
    [entries(), distances(), normal(), lens(), mesh()]
}

fn main() {
    verdicts();
}
