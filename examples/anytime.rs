//! A run that stops as soon as it knows: many samples are allowed, a broken sampler needs few of them.
//!
//! ```text
//! cargo run --release --example anytime
//! ```

use glam::Vec3;
use warpcheck::domain::Hemisphere;
use warpcheck::sampler::{CosineHemisphere, from_fn};
use warpcheck::verify::{Verdict, verify};

/// The verdicts on each right variant and its broken copy.
pub fn verdicts() -> [[Verdict; 2]; 1] {
    // Broken: a twentieth of the turn is left out.
    let wrong = from_fn(
        Hemisphere,
        |[u, v]: [f32; 2]| CosineHemisphere.sample([u, 0.95 * v].into()),
        |w: Vec3| CosineHemisphere.density(w),
    );
    let right = verify(&CosineHemisphere).name("cosine").anytime().samples(200_000).run();
    let wrong = verify(&wrong).name("cosine, not all around").anytime().samples(200_000).run();
    println!("{right}\n{wrong}");
    let drawn = wrong.examinations[0].samples;
    println!("the broken one was known after {drawn} of 200000 samples");
    assert!(drawn < 200_000);
    [[right.verdict(), wrong.verdict()]]
}

fn main() {
    verdicts();
}
