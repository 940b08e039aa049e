//! Any bytes as an OBJ file, and behind a zero byte as the MTL file that answers to every name: a mesh whose indices hold, or a sentence.
#![no_main]

use libfuzzer_sys::fuzz_target;
use warpcheck::scene::{Material, Mesh};

fuzz_target!(|bytes: &[u8]| {
    let (obj, mtl) = bytes.split_at(bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len()));
    for fallback in [None, Some(Material::default())] {
        match Mesh::from_obj(obj, "m.obj", fallback, |_| Ok(mtl.to_vec())) {
            Ok(mut mesh) => {
                mesh.smooth_normals();
                assert!(mesh.positions.iter().all(|p| p.is_finite()));
                assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < mesh.positions.len()));
                assert_eq!(mesh.material_of_triangle.len(), mesh.triangles.len());
                assert!(mesh.material_of_triangle.iter().all(|&i| (i as usize) < mesh.materials.len()));
                assert_eq!(mesh.normals.map(|n| n.len()), Some(mesh.positions.len()));
            }
            Err(error) => assert_eq!(error.to_string().lines().count(), 1, "{error}"),
        }
    }
});
