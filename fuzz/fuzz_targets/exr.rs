//! Any bytes as OpenEXR: a picture, and all of its channels, or a flaw.
#![no_main]

use libfuzzer_sys::fuzz_target;
use warpcheck::picture::{decode, decode_planes};

fuzz_target!(|bytes: &[u8]| {
    // The other format has a target of its own.
    if bytes.starts_with(b"#?") {
        return;
    }
    match decode(bytes) {
        Ok(picture) => assert_eq!(picture.pixels().len(), picture.width() * picture.height()),
        Err(flaw) => assert!(!flaw.to_string().is_empty()),
    }
    if let Err(flaw) = decode_planes(bytes) {
        assert!(!flaw.to_string().is_empty());
    }
});
