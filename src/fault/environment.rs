//! Environment maps.

use super::{Boxed, Fault, Specimen, Trial, Twin};
use crate::domain::{Knots, Sphere};
use crate::random::ONE_MINUS_EPSILON_F64;
use crate::sampler::{DiscreteCdf, Environment, RowWarp, Sampler, from_fn, luminance};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

const WIDTH: usize = 32;
const HEIGHT: usize = 16;

/// A warm ground, a blue sky, a few lamps, in no symmetric way.
fn texel(column: usize, row: usize) -> [f32; 3] {
    let (x, y) = (column as f32, row as f32);
    let wave = 1.7 + (0.7 * x).sin() + 0.5 * (0.4 * x + 1.3 * y).cos();
    if row < 7 {
        [0.2 * wave, 0.3 * wave, (1.0 + 0.1 * y) * wave]
    } else {
        [wave, 0.3 * wave, 0.1 * wave * y / 16.0]
    }
}

fn colours() -> Vec<[f32; 3]> {
    (0..WIDTH * HEIGHT).map(|i| texel(i % WIDTH, i / WIDTH)).collect()
}

fn map(rows: RowWarp) -> Environment {
    Environment::new(WIDTH, HEIGHT, colours(), rows).expect("a map that can be sampled")
}

/// Every third column is black.
fn barred() -> Environment {
    let bars = colours()
        .iter()
        .enumerate()
        .map(|(i, &c)| if (i % WIDTH).is_multiple_of(3) { [0.0; 3] } else { c })
        .collect();
    Environment::new(WIDTH, HEIGHT, bars, RowWarp::UniformV).expect("a map that can be sampled")
}

fn sine(row: f64) -> f64 {
    (PI * row / HEIGHT as f64).sin()
}

/// The weight that a texel should have, in the form that is uniform in v.
fn weight(column: usize, row: usize) -> f64 {
    luminance(texel(column, row)) * sine(row as f64 + 0.5)
}

fn table(weight: impl Fn(usize, usize) -> f64) -> DiscreteCdf {
    let weights: Vec<f64> = (0..WIDTH * HEIGHT).map(|i| weight(i % WIDTH, i / WIDTH)).collect();
    DiscreteCdf::new(&weights).expect("weights that can be sampled")
}

fn direction(u: f64, v: f64) -> DVec3 {
    let (theta, phi) = (PI * v.clamp(1e-9, 1.0 - 1e-9), TAU * u);
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// (u, v) in [0, 1)^2.
fn uv(w: DVec3) -> [f64; 2] {
    let u = w.y.atan2(w.x) / TAU;
    [if u < 0.0 { u + 1.0 } else { u }, w.truncate().length().atan2(w.z) / PI]
        .map(|x| x.min(ONE_MINUS_EPSILON_F64))
}

/// (u, v) of a flat table of texels.
fn place(table: &DiscreteCdf, [a, b]: [f64; 2]) -> [f64; 2] {
    let choice = table.choose(a);
    let (column, row) = (choice.index % WIDTH, choice.index / WIDTH);
    [
        (column as f64 + choice.rest) / WIDTH as f64,
        ((row as f64 + b) / HEIGHT as f64).min(ONE_MINUS_EPSILON_F64),
    ]
}

/// The density per solid angle of texels with these probabilities, uniform inside each.
fn density(table: &DiscreteCdf, [u, v]: [f64; 2]) -> f64 {
    let (column, row) = ((u * WIDTH as f64) as usize, (v * HEIGHT as f64) as usize);
    let per_uv = table.mass(row.min(HEIGHT - 1) * WIDTH + column.min(WIDTH - 1)) * (WIDTH * HEIGHT) as f64;
    per_uv / (2.0 * PI * PI * (PI * v).sin().max(1e-12))
}

fn knots() -> Knots {
    Knots::grid(HEIGHT, WIDTH)
}

fn sampler(
    sample: impl Fn([f64; 2]) -> DVec3 + Send + Sync + 'static,
    density: impl Fn(DVec3) -> f64 + Send + Sync + 'static,
) -> impl Sampler<Domain = Sphere> + Send {
    from_fn(Sphere, sample, density).with_knots(knots())
}

/// Texels drawn by one table, the density claimed of another one.
fn tables(drawn: DiscreteCdf, claimed: DiscreteCdf) -> impl Sampler<Domain = Sphere> + Send {
    sampler(
        move |xi| {
            let [u, v] = place(&drawn, xi);
            direction(u, v)
        },
        move |w| density(&claimed, uv(w)),
    )
}

/// Drawn by a wrong table, with the density of the right one.
fn drawn(wrong: impl Fn(usize, usize) -> f64) -> Specimen {
    Specimen::sampler(tables(table(wrong), table(weight)))
}

/// A table that is wrong in the sampler and the density alike.
fn consistently(wrong: impl Fn(usize, usize) -> f64) -> impl Sampler<Domain = Sphere> + Send {
    let table = table(wrong);
    tables(table.clone(), table)
}

/// The right table; directions and densities are at the caller's mercy.
fn placed(
    moved: impl Fn([f64; 2]) -> [f64; 2] + Send + Sync + 'static,
    asked: impl Fn(DVec3) -> [f64; 2] + Send + Sync + 'static,
) -> Specimen {
    let (drawn, claimed) = (table(weight), table(weight));
    Specimen::sampler(sampler(
        move |xi| {
            let [u, v] = moved(place(&drawn, xi));
            direction(u, v)
        },
        move |w| density(&claimed, asked(w)),
    ))
}

/// Radiance, constant in each texel.
fn radiance(w: &DVec3) -> f64 {
    let [u, v] = uv(*w);
    luminance(texel((u * WIDTH as f64) as usize, (v * HEIGHT as f64) as usize))
}

/// Luminance of the barred map, interpolated between the middles of texels.
fn bilinear(w: &DVec3) -> f64 {
    let [u, v] = uv(*w);
    let (x, y) = (u * WIDTH as f64 - 0.5, (v * HEIGHT as f64 - 0.5).clamp(0.0, HEIGHT as f64 - 1.0));
    let at = |column: f64, row: f64| {
        let column = column.rem_euclid(WIDTH as f64) as usize % WIDTH;
        if column.is_multiple_of(3) { 0.0 } else { luminance(texel(column, (row as usize).min(HEIGHT - 1))) }
    };
    let (s, t) = (x - x.floor(), y - y.floor());
    let along = |row: f64| (1.0 - s) * at(x.floor(), row) + s * at(x.floor() + 1.0, row);
    (1.0 - t) * along(y.floor()) + t * along(y.floor() + 1.0)
}

/// Of the form that is uniform in v, inside the rows next to a pole; what the shipped maps have as well.
const SPREAD: f64 = 0.12;

fn following(sampler: impl Sampler<Domain = Sphere> + Send + 'static) -> Trial<Sphere> {
    Trial::new(sampler).importance(radiance, SPREAD)
}

fn build(width: usize, height: usize, texels: Vec<[f32; 3]>) -> Result<Boxed<Sphere>, String> {
    let map = Environment::new(width, height, texels, RowWarp::UniformV);
    Ok(Box::new(map.map_err(|error| error.to_string())?))
}

const MAP: Twin = Twin::new("environment map, uniform in v", || Specimen::sampler(map(RowWarp::UniformV)));
const TARGETED: Twin = Twin::new("environment map and its radiance", || {
    Trial::new(map(RowWarp::UniformV)).target(radiance).into()
});
const FOLLOWING: Twin =
    Twin::new("environment map that follows its luminance", || following(map(RowWarp::UniformV)).into());
const BARRED: Twin = Twin::new("barred environment map, its density enlarged by a texel", || {
    let wide = |column: usize, row: usize| weight(column, row).max(0.1);
    Trial::new(consistently(wide)).target(bilinear).into()
});
const BUILDER: Twin = Twin::new("builder of environment maps", || Specimen::Maps(build));

pub(super) fn faults() -> Vec<Fault> {
    vec![
        Fault::new(
            "environment/sine-missing",
            "texels are chosen by luminance alone: the poles get too many samples",
            MAP,
            || drawn(|column, row| luminance(texel(column, row))),
        )
        .seen("gkjohnson/three-gpu-pathtracer PR 813")
        .caught(&["chi-square"], &["extra sin theta"]),
        Fault::new(
            "environment/sine-twice",
            "the sine is in the texels already, and applied again",
            MAP,
            || drawn(|column, row| weight(column, row) * sine(row as f64 + 0.5)),
        )
        .seen("facebookresearch/goliath #12 (poles too dark)")
        .caught(&["chi-square"], &["lacks sin theta"]),
        Fault::new(
            "environment/sine-at-row-edge",
            "the sine is that of the row's upper edge: row 0 has no mass",
            TARGETED,
            || {
                Trial::new(consistently(|column, row| luminance(texel(column, row)) * sine(row as f64)))
                    .target(radiance)
                    .into()
            },
        )
        .seen("discussed in mmp/pbrt-v3 #62")
        .caught(&["support"], &["target without density"]),
        Fault::new("environment/pi-sine", "divided by pi sin theta, not by 2 pi^2 sin theta", MAP, || {
            let (drawn, claimed) = (table(weight), table(weight));
            Specimen::sampler(sampler(
                move |xi| {
                    let [u, v] = place(&drawn, xi);
                    direction(u, v)
                },
                move |w| density(&claimed, uv(w)) * TAU,
            ))
        })
        .seen("computergraphics.stackexchange 10824; NVIDIA/VisRTX PR 288 corrects a normalisation")
        .caught(&["chi-square", "normalisation", "jacobian"], &["constant 2 pi"]),
        Fault::new(
            "environment/width-for-height",
            "the loop that weights texels strides by the height",
            MAP,
            || {
                drawn(|column, row| {
                    let i = column * HEIGHT + row;
                    luminance(texel(i % WIDTH, i / WIDTH)) * sine(row as f64 + 0.5)
                })
            },
        )
        .seen("SmallVCM/SmallVCM #8 (a film's row is index / resY), raysan5/raylib #715 (y * height, which square textures hide)")
        .caught(&["chi-square"], &["table read by columns"]),
        Fault::new(
            "environment/theta-for-phi",
            "u turns theta and v turns phi in the direction",
            MAP,
            || placed(|[u, v]| [v, u], uv),
        )
        .seen("mitsuba-renderer/mitsuba3 PR 1541 (order of two angles)")
        .caught(&["chi-square"], &["theta and phi exchanged"])
        .held_back(),
        Fault::new(
            "environment/v-flipped",
            "row 0 is at the bottom in the sampler, at the top in the density",
            MAP,
            || placed(|[u, v]| [u, (1.0 - v).min(ONE_MINUS_EPSILON_F64)], uv),
        )
        .seen("tylermorganwall/rayrender #13 (a rogue minus sign or flipped axis)")
        .caught(&["chi-square"], &["v flipped (theta from the other pole)"]),
        Fault::new("environment/half-a-texel", "samples are half a texel beside the lookup", MAP, || {
            placed(|[u, v]| [u + 0.5 / WIDTH as f64, v], uv)
        })
        .seen("mmp/pbrt-v3 #62")
        .caught(&["chi-square"], &["half a cell off along phi"]),
        Fault::new(
            "environment/u-not-wrapped",
            "negative angles of atan2 are clamped to column 0 in the lookup",
            MAP,
            || placed(|at| at, |w| [(w.y.atan2(w.x) / TAU).max(0.0), uv(w)[1]]),
        )
        .seen("BachiLi/redner PR 179, mitsuba-renderer/mitsuba2 #458")
        .caught(&["chi-square"], &[]),
        Fault::new(
            "environment/one-row-too-many",
            "v is divided by one row more than there are",
            MAP,
            || placed(|[u, v]| [u, v * HEIGHT as f64 / (HEIGHT + 1) as f64], uv),
        )
        .seen("gkjohnson/three-gpu-pathtracer #541 (the last pixel can never be sampled)")
        .caught(&["chi-square"], &["stretched along theta"]),
        Fault::new(
            "environment/seam-over-1",
            "samples between the last column and the first are clamped to the seam",
            MAP,
            || {
                placed(
                    |[u, v]| [(u + 0.5 / WIDTH as f64).min(ONE_MINUS_EPSILON_F64), v],
                    |w| {
                        let [u, v] = uv(w);
                        [(u - 0.5 / WIDTH as f64).rem_euclid(1.0).min(ONE_MINUS_EPSILON_F64), v]
                    },
                )
            },
        )
        .seen("BachiLi/redner PR 179 (offsets over 1), xelatihy/yocto-gl #393")
        .caught(&["chi-square"], &["crowd"])
        .held_back(),
        Fault::new(
            "environment/bilinear-radiance",
            "radiance is interpolated, the density is constant in each texel: none beside bright ones",
            BARRED,
            || Trial::new(barred()).target(bilinear).into(),
        )
        .seen("mitsuba-renderer/mitsuba2 PR 173, mmp/pbrt-v3 #62")
        .caught(&["support"], &["target without density"]),
        Fault::new(
            "environment/corner-importance",
            "the importance of a texel is measured at its corner",
            FOLLOWING,
            || {
                let corner = |column: usize, row: usize| {
                    let around = [(0, 0), (WIDTH - 1, 0), (0, 1), (WIDTH - 1, 1)];
                    around
                        .iter()
                        .map(|(x, y)| luminance(texel((column + x) % WIDTH, row.saturating_sub(*y))))
                        .sum::<f64>()
                };
                following(consistently(move |column, row| corner(column, row) * sine(row as f64 + 0.5)))
                    .into()
            },
        )
        .seen("mmp/pbrt-v3 #62 (centre or border)")
        .caught(&["weights"], &[])
        .held_back(),
        Fault::new(
            "environment/rows-normalised-first",
            "rows are normalised before they are weighted by the sine",
            MAP,
            || {
                drawn(|column, row| {
                    let sum: f64 = (0..WIDTH).map(|c| luminance(texel(c, row))).sum();
                    luminance(texel(column, row)) / sum * sine(row as f64 + 0.5)
                })
            },
        )
        .seen("no thread about it was found")
        .caught(&["chi-square"], &["rows normalised"]),
        Fault::new(
            "environment/absolute-threshold",
            "what is dimmer than 1e-4 counts as black, whatever the unit",
            BUILDER,
            || {
                Specimen::Maps(|width, height, texels| {
                    let cut = |t: [f32; 3]| if luminance(t) < 1e-4 { [0.0; 3] } else { t };
                    build(width, height, texels.into_iter().map(cut).collect())
                })
            },
        )
        .seen("101001000/ElevenRender #13 (a dark map blacks the picture out)")
        .caught(&["scaling"], &["scaling"])
        .no_sampler(),
        Fault::new(
            "environment/alpha-as-red",
            "a map with alpha is read as if it had three channels",
            FOLLOWING,
            || {
                let channels: Vec<f32> = colours().iter().flat_map(|&[r, g, b]| [r, g, b, 1.0]).collect();
                let read = move |column: usize, row: usize| {
                    let first = 3 * (row * WIDTH + column);
                    luminance([channels[first], channels[first + 1], channels[first + 2]])
                        * sine(row as f64 + 0.5)
                };
                following(consistently(read)).into()
            },
        )
        .seen("mitsuba-renderer/mitsuba3 #1429 (a 4-channel map read as 3)")
        .caught(&["weights"], &[])
        .held_back(),
        Fault::new(
            "environment/luminance-swapped",
            "the coefficients of red and blue are exchanged: unbiased, but noisy",
            FOLLOWING,
            || {
                let swapped = |[r, g, b]: [f32; 3]| luminance([b, g, r]);
                following(consistently(move |column, row| {
                    swapped(texel(column, row)) * sine(row as f64 + 0.5)
                }))
                .rival("luminance with red and blue exchanged", move |w| {
                    let [u, v] = uv(*w);
                    swapped(texel((u * WIDTH as f64) as usize, (v * HEIGHT as f64) as usize))
                })
                .into()
            },
        )
        .seen("jwagner/smartcrop.js #77, CasparCG/server #177")
        .caught(&["weights"], &["importance of a rival"]),
    ]
}
