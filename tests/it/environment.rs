//! The three densities of the environment sampler, and what it does with odd and bad maps.

use glam::{DVec2, Vec3};
use std::f64::consts::PI;
use warpcheck::domain::{Cell, Domain, Integrator, Knots, Sphere};
use warpcheck::sampler::{Environment, Error, RowWarp, Sampler};

const ROWS: [RowWarp; 2] = [RowWarp::UniformV, RowWarp::UniformCosTheta];

/// The marginal over v, the conditionals over u, and the density per solid angle over the sphere each integrate to 1.
#[track_caller]
fn densities_integrate_to_one(name: &str, map: &Environment) {
    let (width, height) = (map.width(), map.height());
    let centre = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    // Gauss' three points in every row: in the cos theta form the marginal is a sine there.
    let gauss = [(-0.6_f64.sqrt(), 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.6_f64.sqrt(), 5.0 / 18.0)];
    let in_row = |row: usize| {
        gauss.map(|(x, weight)| ((row as f64 + 0.5 + 0.5 * x) / height as f64, weight / height as f64))
    };
    // Rows of coarse maps are wide: split them, so that three points are enough.
    let marginal: f64 = if height >= 32 {
        (0..height).flat_map(in_row).map(|(v, weight)| weight * map.density_v(v)).sum()
    } else {
        let n = 4096 * height;
        (0..n).map(|i| map.density_v(centre(i, n)) / n as f64).sum()
    };
    assert!((marginal - 1.0).abs() < 1e-6, "{name}: the marginal integrates to {marginal}");
    for row in 0..height {
        let v = centre(row, height);
        let conditional: Option<f64> =
            (0..width).map(|column| Some(map.density_u(centre(column, width), v)? / width as f64)).sum();
        if let Some(conditional) = conditional {
            assert!((conditional - 1.0).abs() < 1e-6, "{name}: row {row} integrates to {conditional}");
        }
        // Joint over marginal is conditional.
        let (joint, column) =
            (map.density_uv(DVec2::new(centre(width / 2, width), v)), centre(width / 2, width));
        let product = map.density_v(v) * map.density_u(column, v).unwrap_or(0.0);
        assert!((joint - product).abs() <= 1e-9 * product.max(1e-12), "{name}: row {row}: {joint} {product}");
    }
    let integrator =
        Integrator { relative_tolerance: 1e-7, absolute_tolerance: 0.0, max_evaluations: 20_000_000 };
    let whole = integrator
        .integrate(&Sphere, &Cell::whole(&Sphere), &Knots::grid(height, width), |w| map_density(map, w));
    assert!((whole.value - 1.0).abs() < 1e-6, "{name}: per solid angle {whole:?}");
    assert!(whole.error < 1e-5, "{name}: {whole:?}");
}

fn map_density(map: &Environment, w: &glam::DVec3) -> f64 {
    Sampler::density(map, w)
}

#[test]
fn small_maps() {
    for rows in ROWS {
        for (width, height) in [(1, 1), (1, 6), (9, 1), (3, 7)] {
            let texels = (0..width * height)
                .map(|i| [((i * i) as f32 * 0.37).sin().abs(), 0.2, (i % 4) as f32])
                .collect();
            densities_integrate_to_one(
                &format!("{rows:?} {width}x{height}"),
                &Environment::new(width, height, texels, rows).unwrap(),
            );
        }
    }
}

#[cfg(feature = "pictures")]
#[test]
fn shipped_maps() {
    shipped(1);
}

#[cfg(feature = "pictures")]
#[test]
#[ignore = "long: all of them"]
fn every_shipped_map() {
    shipped(usize::MAX);
}

/// The first of them.
#[cfg(feature = "pictures")]
fn shipped(count: usize) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data/env");
    let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let mut maps: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "hdr")).collect();
    assert!(maps.len() >= 5, "only {} maps in {folder}", maps.len());
    // By name, so that every map has the same warp everywhere.
    maps.sort();
    for (i, path) in maps.iter().take(count).enumerate() {
        let picture = warpcheck::picture::read(path).unwrap();
        let (width, height) = (picture.width(), picture.height());
        let rows = ROWS[i % ROWS.len()];
        let map = Environment::new(width, height, picture.pixels().to_vec(), rows).unwrap();
        densities_integrate_to_one(&format!("{rows:?} {}", path.display()), &map);
    }
}

#[test]
fn a_constant_map_is_uniform() {
    for (width, height) in [(1, 1), (5, 3), (64, 32)] {
        let map =
            Environment::new(width, height, vec![[0.25, 3.0, 1.0]; width * height], RowWarp::UniformCosTheta)
                .unwrap();
        for i in 0..1000 {
            let w = Sphere.point(0, [(i as f64 * 0.618) % 1.0, (i as f64 * 0.414) % 1.0]).0;
            let density = map_density(&map, &w) * 4.0 * PI;
            assert!((density - 1.0).abs() < 1e-12, "{width}x{height} at {w}: {density}");
        }
    }
}

/// One bright texel anywhere, corners and poles included, is found where it is.
#[test]
fn one_bright_texel_is_found() {
    let (width, height) = (7, 5);
    for rows in ROWS {
        for bright in 0..width * height {
            let mut texels = vec![[0.0; 3]; width * height];
            texels[bright] = [2.0, 1.0, 0.5];
            let map = Environment::new(width, height, texels, rows).unwrap();
            for (a, b) in [
                (0.0, 0.0),
                (0.5, 0.5),
                (0.999_999_9, 0.0),
                (0.0, 0.999_999_9),
                (1.0_f64.next_down(), 1.0_f64.next_down()),
            ] {
                let sample = map.sample([a, b]);
                let (column, row) =
                    ((sample.uv.x * width as f64) as usize, (sample.uv.y * height as f64) as usize);
                assert_eq!((column, row), (bright % width, bright / width), "{rows:?}");
                assert_eq!(sample.radiance, Vec3::new(2.0, 1.0, 0.5));
                assert_eq!(
                    map.radiance(sample.direction),
                    sample.radiance,
                    "{rows:?}: the direction has left the texel"
                );
                let again = map.density(sample.direction);
                assert!((again / sample.density - 1.0).abs() < 1e-5, "{rows:?}: {again} {}", sample.density);
            }
        }
    }
}

/// A power of two on all texels changes no bit of what is drawn.
#[test]
fn scaling_changes_no_bit() {
    let texels: Vec<[f32; 3]> = (0..15).map(|i| [i as f32, 1.0, (i % 3) as f32]).collect();
    for rows in ROWS {
        let scaled = |s: f32| {
            let texels = texels.iter().map(|t| t.map(|x| x * s)).collect();
            let map = Environment::new(5, 3, texels, rows).unwrap();
            [[0.1, 0.9], [0.5, 0.5], [0.77, 0.31]]
                .map(|xi| (map.sample(xi).direction, map.sample(xi).density))
        };
        assert_eq!(scaled(1.0), scaled(2.0_f32.powi(60)));
        assert_eq!(scaled(1.0), scaled(2.0_f32.powi(-60)));
    }
}

#[test]
fn bad_maps_are_refused() {
    let with = |index: usize, texel: [f32; 3]| {
        let mut texels = vec![[1.0; 3]; 6];
        texels[index] = texel;
        Environment::new(3, 2, texels, RowWarp::UniformV).map(|_| ())
    };
    assert_eq!(with(4, [1.0, -0.5, 1.0]), Err(Error::Texel { column: 1, row: 1, channel: 'G', value: -0.5 }));
    assert!(matches!(
        with(2, [1.0, 1.0, f32::NAN]),
        Err(Error::Texel { column: 2, row: 0, channel: 'B', .. })
    ));
    assert!(matches!(
        with(0, [f32::INFINITY, 1.0, 1.0]),
        Err(Error::Texel { column: 0, row: 0, channel: 'R', .. })
    ));
    let black = Environment::new(3, 2, vec![[0.0; 3]; 6], RowWarp::UniformV).map(|_| ());
    assert_eq!(black, Err(Error::Black { width: 3, height: 2 }));
    let size = Environment::new(3, 3, vec![[1.0; 3]; 6], RowWarp::UniformV).map(|_| ());
    assert_eq!(size, Err(Error::MapSize { width: 3, height: 3, texels: 6 }));
}
