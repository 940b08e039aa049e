//! Samplers that are no plain density: a material with a mirror in it, and one that rejects.
//!
//! ```text
//! cargo run --release --example deltas_and_rejection
//! ```

use glam::Vec3;
use warpcheck::domain::{Disk, Hemisphere, Mixed, WithAtoms};
use warpcheck::sampler::{CosineHemisphere, from_fn};
use warpcheck::verify::{Verdict, verify};

/// A smooth coat over a diffuse base: an atom, of mass 0.2, beside a density. Broken: the coat is chosen a little too often.
fn coated() -> [Verdict; 2] {
    let domain = || WithAtoms::named(Hemisphere, ["the mirror direction"]);
    let draw = |coat: f32| {
        move |[pick, u, v]: [f32; 3]| match pick < coat {
            true => Mixed::Atom(0),
            false => Mixed::Continuous(CosineHemisphere.sample([u, v].into())),
        }
    };
    let density = |w: Mixed<Vec3>| match w {
        Mixed::Atom(_) => 0.2,
        Mixed::Continuous(w) => 0.8 * CosineHemisphere.density(w),
    };
    let right = verify(&from_fn(domain(), draw(0.2), density)).name("coated").samples(100_000).run();
    let wrong =
        verify(&from_fn(domain(), draw(0.214), density)).name("coated, 7% off").samples(100_000).run();
    println!("{right}\n{wrong}");
    [right.verdict(), wrong.verdict()]
}

/// Points of a square, those outside of its disk rejected: a density of 1/4 integrates to pi/4, and the rest must be rejected. Broken: the density of
/// one that tries again.
fn rejecting() -> [Verdict; 2] {
    let draw = |[u, v]: [f64; 2]| {
        let p = [2.0 * u - 1.0, 2.0 * v - 1.0];
        (p[0] * p[0] + p[1] * p[1] < 1.0).then_some(p)
    };
    let right = from_fn(Disk, draw, |_: [f64; 2]| 0.25);
    let wrong = from_fn(Disk, draw, |_: [f64; 2]| std::f64::consts::FRAC_1_PI);
    let right = verify(&right).name("rejecting").samples(100_000).run();
    let wrong = verify(&wrong).name("rejecting, normalised").samples(100_000).run();
    println!("{right}\n{wrong}");
    [right.verdict(), wrong.verdict()]
}

/// The verdicts on each right variant and its broken copy.
pub fn verdicts() -> [[Verdict; 2]; 2] {
    [coated(), rejecting()]
}

fn main() {
    verdicts();
}
