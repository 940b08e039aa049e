//! Nobody knows the density: two samplers against each other, points from a file, and the streams of a renderer's threads.
//!
//! ```text
//! cargo run --release --example without_density
//! ```

use warpcheck::domain::{Disk, Square};
use warpcheck::random::{stream, unit_f64};
use warpcheck::sampler::from_draws;
use warpcheck::verify::{PointsError, Samples, Verdict, compare, compare_samples, streams};

/// Two maps from the square to the disk. Broken: the second forgets the square root.
fn samplers() -> [Verdict; 2] {
    let polar = |radius: fn(f64) -> f64| {
        from_draws(Disk, move |[u, v]: [f64; 2]| {
            let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
            [radius(u) * cos, radius(u) * sin]
        })
    };
    let concentric = from_draws(Disk, |[u, v]: [f64; 2]| {
        let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        let (r, phi) = if a.abs() > b.abs() {
            (a, std::f64::consts::FRAC_PI_4 * (b / a))
        } else {
            (
                b,
                std::f64::consts::FRAC_PI_2
                    - std::f64::consts::FRAC_PI_4 * (if b == 0.0 { 0.0 } else { a / b }),
            )
        };
        [r * phi.cos(), r * phi.sin()]
    });
    let run = |other: &_| compare(&concentric, other).names("concentric", "polar").samples(100_000).run();
    let (right, wrong) = (run(&polar(f64::sqrt)), run(&polar(|u| u)));
    println!("{right}\n{wrong}");
    [right.verdict(), wrong.verdict()]
}

fn thread(seed: u64) -> Vec<[f64; 2]> {
    let mut rng = stream(seed, "a thread of a renderer", 0);
    (0..20_000).map(|_| [unit_f64(&mut rng), unit_f64(&mut rng)]).collect()
}

/// Points that were written down. Broken: one of the renderers has its axes squeezed.
fn points() -> Result<[Verdict; 2], PointsError> {
    let (first, second) = (Samples::new(Square, thread(1))?, Samples::new(Square, thread(2))?);
    let squeezed = Samples::new(Square, thread(3).into_iter().map(|[x, y]| [x, 0.97 * y]))?;
    let right = compare_samples(&first, &second).names("yesterday", "today").run();
    let wrong = compare_samples(&first, &squeezed).names("yesterday", "squeezed").run();
    println!("{right}\n{wrong}");
    Ok([right.verdict(), wrong.verdict()])
}

/// Threads of a renderer. Broken: the third one skips a point and goes on with the seed of the first.
fn threads() -> Result<[Verdict; 2], PointsError> {
    let right = streams(Square, &[thread(1), thread(2), thread(3)])?.name("threads").run();
    let lagged = thread(1).split_off(1);
    let wrong = streams(Square, &[thread(1), thread(2), lagged])?.name("threads, one seed twice").run();
    println!("{right}\n{wrong}");
    Ok([right.verdict(), wrong.verdict()])
}

/// The verdicts on each right variant and its broken copy.
pub fn verdicts() -> Result<[[Verdict; 2]; 3], PointsError> {
    Ok([samplers(), points()?, threads()?])
}

fn main() -> Result<(), PointsError> {
    verdicts().map(|_| ())
}
