//! Any bytes as an MTL file: materials whose values are what they may be, or a sentence.
#![no_main]

use libfuzzer_sys::fuzz_target;
use warpcheck::scene::Material;

fuzz_target!(|bytes: &[u8]| match Material::from_mtl(bytes, "m.mtl") {
    Ok(materials) => {
        for m in materials {
            assert!([m.kd, m.ks, m.ke].iter().all(|c| c.is_finite() && c.min_element() >= 0.0), "{m:?}");
            assert!(m.ns.is_finite() && m.ns >= 0.0, "{m:?}");
        }
    }
    Err(error) => assert_eq!(error.to_string().lines().count(), 1, "{error}"),
});
