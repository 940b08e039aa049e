//! Samplers where the answer is known by hand: closed forms, tables of a few entries, how many bytes a table takes. (Verifications: `tests/by_hand/`.)

mod directions;
mod lights;
mod maps;
mod mixtures;
mod pointers;
mod tables;

use glam::{DVec2, DVec3, Vec2, Vec3};
use rand::Rng;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use warpcheck::domain::{Cell, Hemisphere, Knots, Mixed, Space, SurfacePoint};
use warpcheck::random::{stream, unit_f64};
use warpcheck::sampler::*;

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found}, not {expected}");
}

#[track_caller]
fn all_near(found: &[f64], expected: &[f64], off: f64) {
    let same = found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= off);
    assert!(same, "{found:?}, not {expected:?}");
}

/// Ascending, each once.
fn sorted(mut knots: Vec<f64>) -> Vec<f64> {
    knots.sort_by(f64::total_cmp);
    knots.dedup();
    knots
}

fn patches(patches: std::ops::Range<usize>) -> Cell {
    Cell { patches, low: [0.0; 2], high: [1.0; 2] }
}

const FORMS: [Form; 3] = [Form::Cdf, Form::Guide, Form::Alias];

/// Four columns, the rows 1 1 1 1 and 1 2 3 2: the lower has two thirds of the light.
fn small_map() -> RadianceMap {
    let texels = [1, 1, 1, 1, 1, 2, 3, 2].map(|x| [x as f32; 3]);
    RadianceMap::new(4, 2, texels.to_vec()).unwrap()
}

/// Two triangles at height 1, of areas 1/2 and 3/2, facing down.
fn plates(sides: Sides) -> MeshLight {
    let small = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 1.0)];
    let large = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.0, -1.0, 1.0), Vec3::new(-3.0, 0.0, 1.0)];
    MeshLight::new(&[small, [large[0], large[2], large[1]]], sides).unwrap()
}
