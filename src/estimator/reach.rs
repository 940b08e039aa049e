//! Lobes that a strategy hardly ever finds.
//!
//! Whoever draws directions uniformly has a sample in a lobe that fills the share s of the hemisphere with about that probability, and whoever draws points on
//! lights with more, if the lobe shows one. A tile in which that makes fewer than [`LEAST`] samples has a mean that knows nothing of the lobe, and so has the scatter of
//! its batches: the few samples that find it, of enormous values, are still to come.

use super::brdf::Reflection;
use super::{Strategy, WINNER_TILE};
use crate::scene::{RayQueries, Scene};

/// Samples in a lobe from which on its light is taken as seen.
const LEAST: f64 = 16.0;

/// The share of the tiles of 8 pixels that show a lobe which `spp` samples a pixel of the strategy hardly find: the lobes of Phong and GGX by the share of the
/// hemisphere that they fill, for `uniform`, `light` and `mis:0`, which draw no direction from them. 0 for the others.
///
/// ```
/// use warpcheck::estimator::{Strategy, share_out_of_reach};
/// use warpcheck::scene::Scene;
/// let scene = Scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/three_spheres.toml"))?;
/// assert!(share_out_of_reach(&scene, Strategy::Light, 64) > 0.03);
/// assert_eq!(share_out_of_reach(&scene, Strategy::Brdf, 64), 0.0);
/// # Ok::<(), warpcheck::scene::Error>(())
/// ```
pub fn share_out_of_reach(scene: &Scene, strategy: Strategy, spp: u32) -> f64 {
    let tiles = out_of_reach(scene, strategy, spp, WINNER_TILE);
    tiles.iter().filter(|&&beyond| beyond).count() as f64 / tiles.len() as f64
}

/// The same for each tile of `size` pixels, row after row.
pub(super) fn out_of_reach(scene: &Scene, strategy: Strategy, spp: u32, size: usize) -> Vec<bool> {
    let (width, height) = (scene.picture.width as usize, scene.picture.height as usize);
    let (columns, rows) = (width.div_ceil(size), height.div_ceil(size));
    let draws_from_lobes = match strategy {
        Strategy::Uniform | Strategy::Light => false,
        Strategy::Mis { brdf_weight } => brdf_weight > 0.0,
        Strategy::Brdf | Strategy::MisAuto | Strategy::MisTwo { .. } => true,
    };
    if draws_from_lobes {
        return vec![false; columns * rows];
    }
    // Lobes by the share of the hemisphere that they fill, and the rays of each tile that show them.
    let mut tiles: Vec<Vec<(f64, f64)>> = vec![Vec::new(); columns * rows];
    // The corner and the middle of a pixel.
    const RAYS: [f32; 2] = [0.0, 0.5];
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        for offset in RAYS {
            let Some(hit) = scene.rays().closest(&scene.camera.ray(x as f32 + offset, y as f32 + offset))
            else {
                continue;
            };
            let reflection = Reflection::new(scene.material(hit.triangle), scene.convention);
            let Some(share) = reflection.lobe_share() else { continue };
            let seen = &mut tiles[y / size * columns + x / size];
            match seen.iter_mut().find(|(known, _)| *known == share) {
                Some((_, rays)) => *rays += 1.0,
                None => seen.push((share, 1.0)),
            }
        }
    }
    let each = f64::from(spp) / RAYS.len() as f64;
    tiles.iter().map(|seen| seen.iter().any(|(share, rays)| rays * each * share < LEAST)).collect()
}
