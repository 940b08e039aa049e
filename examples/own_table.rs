//! A table of your own, without any reference: what must not change when its weights do.
//!
//! ```text
//! cargo run --release --example own_table
//! ```

use warpcheck::domain::Discrete;
use warpcheck::sampler::{Environment, RowWarp, Sampler, from_fn};
use warpcheck::verify::Verdict;
use warpcheck::verify::metamorphic::{maps, weights};

/// A running sum, searched. In `f32` it loses a long light tail behind a heavy weight.
fn table(
    weights: &[f64],
    add: fn(f64, f64) -> f64,
) -> Result<impl Sampler<Domain = Discrete> + use<>, String> {
    let mut sum = 0.0;
    let cdf: Vec<f64> = weights
        .iter()
        .map(|&w| {
            sum = add(sum, w);
            sum
        })
        .collect();
    if !(weights.iter().all(|&w| w >= 0.0) && sum > 0.0 && sum.is_finite()) {
        return Err("a weight is negative or no number, or all of them are 0".to_owned());
    }
    let (total, end): (f64, f64) = (weights.iter().sum(), sum);
    let mass: Vec<f64> = weights.iter().map(|w| w / total).collect();
    Ok(from_fn(
        Discrete::new(mass.len()),
        move |xi: f64| cdf.partition_point(|&c| c <= xi * end),
        move |i: usize| mass[i],
    ))
}

/// The verdicts on each right variant and its broken copy.
pub fn verdicts() -> [[Verdict; 2]; 2] {
    let right = weights(|w| table(w, |a, b| a + b)).name("sum in f64").run();
    let wrong = weights(|w| table(w, |a, b| f64::from(a as f32 + b as f32))).name("sum in f32").run();
    println!("{right}\n{wrong}");
    let tables = [right.verdict(), wrong.verdict()];

    // Broken: the map is read by columns.
    let by_columns = |width: usize, height: usize, texels: Vec<[f32; 3]>| {
        let texels = (0..width * height).map(|i| texels[i % width * height + i / width]).collect();
        Environment::new(width, height, texels, RowWarp::UniformV)
    };
    let right =
        maps(|width, height, texels| Environment::new(width, height, texels, RowWarp::UniformV)).run();
    let wrong = maps(by_columns).name("map, read by columns").run();
    println!("{right}\n{wrong}");
    [tables, [right.verdict(), wrong.verdict()]]
}

fn main() {
    verdicts();
}
