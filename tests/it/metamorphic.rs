//! Relations between the answers of a table to related inputs: right builders keep to all, broken ones fail the one that should see them.

use glam::DVec3;
use std::f64::consts::TAU;
use warpcheck::domain::{Discrete, Sphere};
use warpcheck::sampler::*;
use warpcheck::verify::metamorphic::{maps, weights};
use warpcheck::verify::{Report, Verdict};

fn failed(report: &Report) -> Vec<&'static str> {
    let failed = report.conclusions[0].iter().filter(|c| c.verdict == Verdict::Fail);
    failed.map(|c| c.finding.check).collect()
}

#[track_caller]
fn fails(name: &str, report: Report, relation: &str) {
    let failed = failed(&report);
    assert!(failed.contains(&relation), "{name} fails {failed:?}, not {relation}:\n{report}");
}

#[test]
fn right_builders_keep_to_all() {
    weights(DiscreteCdf::new).run().assert();
    for warp in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        maps(|width, height, texels| Environment::new(width, height, texels, warp)).run().assert();
    }
    // A plain table in f64, as most people write it.
    let plain = |w: &[f64]| -> Result<_, String> {
        let total: f64 = w.iter().sum();
        if !(w.iter().all(|&w| w >= 0.0) && total > 0.0 && total.is_finite()) {
            return Err(format!("the sum of the weights is {total}, or one is negative"));
        }
        let (cdf, mass) = (running(w, 1.0 / total), w.iter().map(|w| w / total).collect::<Vec<_>>());
        Ok(table(move |xi| cdf.partition_point(|&c| c <= xi), mass))
    };
    weights(plain).run().assert();
}

#[test]
fn false_alarms_are_rare() {
    for seed in 100..110 {
        weights(DiscreteCdf::new).samples(8192).seed(seed).alpha(0.01).run().assert();
    }
}

fn running(weights: &[f64], factor: f64) -> Vec<f64> {
    let sums = weights.iter().scan(0.0, |sum, w| {
        *sum += w;
        Some(*sum * factor)
    });
    sums.collect()
}

fn table(choose: impl Fn(f64) -> usize + Sync, mass: Vec<f64>) -> impl Sampler<Domain = Discrete> {
    let last = mass.len() - 1;
    from_fn(Discrete::new(mass.len()), move |xi: f64| choose(xi).min(last), move |i: usize| mass[i])
}

#[test]
fn broken_tables() {
    fails(
        "an absolute threshold",
        weights(|w| DiscreteCdf::new(&w.iter().map(|&w| if w < 1e-9 { 0.0 } else { w }).collect::<Vec<_>>()))
            .run(),
        "scaling",
    );
    fails(
        "f32 sums",
        weights(|w| -> Result<_, String> {
            let cdf: Vec<f32> = w
                .iter()
                .scan(0.0_f32, |sum, &w| {
                    *sum += w as f32;
                    Some(*sum)
                })
                .collect();
            let (total, end): (f64, f32) = (w.iter().sum(), cdf[cdf.len() - 1]);
            let mass = w.iter().map(|w| w / total).collect();
            Ok(table(move |xi| cdf.partition_point(|&c| c <= xi as f32 * end), mass))
        })
        .run(),
        "permutation",
    );
    fails(
        "lower bound for upper bound",
        weights(|w| -> Result<_, String> {
            let total: f64 = w.iter().sum();
            let (cdf, mass) = (running(w, 1.0 / total), w.iter().map(|w| w / total).collect());
            Ok(table(move |xi| cdf.partition_point(|&c| c < xi), mass))
        })
        .run(),
        "zero weights",
    );
    fails(
        "the last weight is left out",
        weights(|w| {
            let mut w = w.to_vec();
            *w.last_mut().unwrap() = 0.0;
            DiscreteCdf::new(&w)
        })
        .run(),
        "bright entry",
    );
    fails(
        "a floor under the weights",
        weights(|w| DiscreteCdf::new(&w.iter().map(|w| w.max(1e-3)).collect::<Vec<_>>())).run(),
        "zero weights",
    );
    fails(
        "masses by rank",
        weights(|w| {
            let mut w = w.to_vec();
            w.sort_by(f64::total_cmp);
            DiscreteCdf::new(&w)
        })
        .run(),
        "bright entry",
    );
    fails(
        "weighted by position",
        weights(|w| {
            DiscreteCdf::new(&w.iter().enumerate().map(|(i, w)| w * (i + 1) as f64).collect::<Vec<_>>())
        })
        .run(),
        "permutation",
    );
    fails(
        "weights squared",
        weights(|w| DiscreteCdf::new(&w.iter().map(|w| w * w).collect::<Vec<_>>())).run(),
        "refinement",
    );
    fails("another size", weights(|w| DiscreteCdf::new(&w[1..])).run(), "permutation");
}

#[test]
fn errors_and_panics_are_findings() {
    let report =
        weights(
            |w| if w.contains(&0.0) { Err("no zeros, please") } else { Ok(DiscreteCdf::new(w).unwrap()) },
        )
        .run();
    fails("a refusing builder", report, "zero weights");
    let report = weights(|w| -> Result<DiscreteCdf, String> { panic!("{} weights", w.len()) }).run();
    assert_eq!(report.verdict(), Verdict::Fail);
    assert!(format!("{report}").contains("it panics: 37 weights"), "{report}");
}

/// Enough for what is broken.
const FEWER: u64 = 8192;

/// A map that tabulates the luminance that `read` finds for (column, row) in the texels.
fn reading(
    read: impl Fn(usize, usize, (usize, usize), &[[f32; 3]]) -> f32,
) -> impl Fn(usize, usize, Vec<[f32; 3]>) -> Result<Environment, Error> {
    move |width, height, texels| {
        let read = |i| [read(i % width, i / width, (width, height), &texels); 3];
        Environment::new(width, height, (0..width * height).map(read).collect(), RowWarp::UniformV)
    }
}

fn level([r, g, b]: [f32; 3]) -> f32 {
    luminance([r, g, b]) as f32
}

#[test]
fn broken_maps() {
    let right = |x, y, (width, _): (usize, usize), texels: &[[f32; 3]]| level(texels[x + y * width]);
    maps(reading(right)).samples(FEWER).run().assert();
    let transposed = |x, y, (_, height): (usize, usize), texels: &[[f32; 3]]| level(texels[x * height + y]);
    fails("luminance read transposed", maps(reading(transposed)).samples(FEWER).run(), "rotation");
    fails("luminance read transposed", maps(reading(transposed)).samples(FEWER).run(), "bright entry");
    let swapped = |x, y, (width, height): (usize, usize), texels: &[[f32; 3]]| {
        if x < height { level(texels[x + y * width]) } else { 0.0 }
    };
    fails(
        "a loop over the height for the width",
        maps(reading(swapped)).samples(FEWER).run(),
        "bright entry",
    );
    fails("a loop over the height for the width", maps(reading(swapped)).samples(FEWER).run(), "mirror");
    let out_of_bounds = |x, y, (width, _): (usize, usize), texels: &[[f32; 3]]| level(texels[x * width + y]);
    fails("indices out of bounds", maps(reading(out_of_bounds)).samples(FEWER).run(), "bright entry");
    let skipped = |x, y, (width, height): (usize, usize), texels: &[[f32; 3]]| {
        if y + 1 < height { level(texels[x + y * width]) } else { 0.0 }
    };
    fails("the last row skipped", maps(reading(skipped)).samples(FEWER).run(), "bright entry");
    let alpha = |x, y, (width, _): (usize, usize), texels: &[[f32; 3]]| {
        let (flat, start) = (texels.as_flattened(), 4 * (x + y * width));
        flat.get(start..start + 3).map_or(0.0, |rgb| level([rgb[0], rgb[1], rgb[2]]))
    };
    fails("stride of RGBA over RGB", maps(reading(alpha)).samples(FEWER).run(), "bright entry");
    let shifted =
        |x, y, (width, _): (usize, usize), texels: &[[f32; 3]]| level(texels[(x + 1) % width + y * width]);
    fails("shifted by a column", maps(reading(shifted)).samples(FEWER).run(), "bright entry");
    let threshold = |x, y, (width, _): (usize, usize), texels: &[[f32; 3]]| {
        Some(level(texels[x + y * width])).filter(|&l| l > 1e-6).unwrap_or(0.0)
    };
    fails("an absolute threshold", maps(reading(threshold)).samples(FEWER).run(), "scaling");
    let floor =
        |x, y, (width, _): (usize, usize), texels: &[[f32; 3]]| level(texels[x + y * width]).max(0.01);
    fails("a floor under the luminance", maps(reading(floor)).samples(FEWER).run(), "zero weights");
}

/// u = phi / 2 pi is negative for half of the directions, and clamped to column 0.
#[test]
fn u_that_is_not_wrapped() {
    let build = |width, height, texels| -> Result<_, Error> {
        let map = Environment::new(width, height, texels, RowWarp::UniformV)?;
        let asked = map.clone();
        let density = move |w: DVec3| {
            let u = w.y.atan2(w.x) / TAU;
            let (r, phi) = (w.x.hypot(w.y), u.max(0.0) * TAU);
            Sampler::density(&asked, &DVec3::new(r * phi.cos(), r * phi.sin(), w.z))
        };
        Ok(from_fn(Sphere, move |xi: [f64; 2]| map.sample(xi).direction, density))
    };
    fails("u not wrapped", maps(build).run(), "mirror");
    fails("u not wrapped", maps(build).run(), "bright entry");
}
