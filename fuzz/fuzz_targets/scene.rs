//! Any bytes as a scene file over one mesh: a scene that answers rays, or a sentence.
#![no_main]

use libfuzzer_sys::fuzz_target;
use warpcheck::scene::{RayQueries, Scene};

const OBJ: &[u8] = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nusemtl lamp\nf 1 2 3\nusemtl grey\nf 2 4 3\n";
const MTL: &[u8] = b"newmtl grey\nKd .5 .5 .5\nnewmtl lamp\nKe 5 5 5\n";

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    let open = |file: &std::path::Path| {
        Ok(if file.extension().is_some_and(|e| e == "mtl") { MTL } else { OBJ }.to_vec())
    };
    match Scene::from_toml_with(&text, "s.toml", open) {
        Ok(scene) => {
            let (width, height) = (scene.picture.width as f32, scene.picture.height as f32);
            for at in [0.0, 0.5, 1.0] {
                let ray = scene.camera.ray(at * width, at * height);
                assert!(ray.direction.is_finite());
                if let Some(hit) = scene.rays().closest(&ray) {
                    assert!((hit.triangle as usize) < scene.triangles.len());
                    scene.rays().occluded(&scene.leave(&hit, -ray.direction));
                }
            }
            assert!(scene.emissive_area().is_finite());
        }
        Err(error) => assert_eq!(error.to_string().lines().count(), 1, "{error}"),
    }
});
