//! Any bytes as a Radiance HDR picture: a picture of the size announced, or a flaw.
#![no_main]

use libfuzzer_sys::fuzz_target;
use warpcheck::picture::{MAX_TEXELS, decode};

fuzz_target!(|bytes: &[u8]| match decode(bytes) {
    Ok(picture) => {
        let texels = picture.width() * picture.height();
        assert_eq!(picture.pixels().len(), texels);
        assert!((1..=MAX_TEXELS as usize).contains(&texels));
        assert_eq!(picture.first_bad_texel(), None, "Radiance has no negative and no infinite values");
    }
    Err(flaw) => assert!(!flaw.to_string().is_empty()),
});
