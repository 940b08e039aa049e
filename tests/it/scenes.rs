//! Scenes that ship, changed.

use std::fs;
use std::path::PathBuf;
use warpcheck::estimator::Lights;
use warpcheck::scene::Scene;

pub fn data(path: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "data", path].iter().collect()
}

/// A shipped scene with parts of its file replaced.
pub fn shipped(name: &str, changes: &[(&str, &str)]) -> (Scene, Lights) {
    let file = data(&format!("scene/{name}.toml"));
    let text = fs::read_to_string(&file).unwrap();
    let text = changes.iter().fold(text, |text, (from, to)| text.replace(from, to));
    let scene = Scene::from_toml(&text, &file).unwrap();
    let lights = Lights::load(&scene).unwrap();
    (scene, lights)
}

/// The Cornell box, of that many pixels along a side.
#[cfg(feature = "cli")]
pub fn cornell(size: &str) -> (Scene, Lights) {
    shipped("cornell", &[("= 256", &format!("= {size}"))])
}
