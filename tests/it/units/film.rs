use glam::DVec3;
use warpcheck::estimator::{Film, Pixel};
use warpcheck::statistics::Moments;

#[test]
fn sums_do_not_stall() {
    let mut pixel = Pixel::default();
    let n = 1_u64 << 25;
    for _ in 0..n {
        pixel.add(DVec3::splat(0.5));
    }
    assert_eq!(pixel.count(), n);
    assert_eq!(pixel.mean(), [0.5; 3]);
    assert_eq!(pixel.standard_error(), [0.0; 3]);
    // The mistake that this avoids.
    let stalled = (0..n).fold(0.0_f32, |sum, _| sum + 0.5);
    assert_eq!(stalled / n as f32, 0.25);
}

#[test]
fn relative_error_of_a_picture() {
    let mut film = Film::new(2, 1);
    assert_eq!(film.relative_error(), f64::INFINITY);
    for x in [1.0, 3.0] {
        film.add(0, 0, DVec3::splat(x)); // 2 with standard error 1
        film.add(1, 0, DVec3::splat(2.0));
    }
    assert!((film.relative_error() - 0.5_f64.sqrt() / 2.0).abs() < 1e-12);
}

#[test]
fn agrees_with_moments() {
    let samples: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 0.77).sin() + 1.5).collect();
    let moments: Moments = samples.iter().copied().collect();
    let mut parts = [Pixel::default(); 2];
    samples.iter().enumerate().for_each(|(i, &x)| parts[i % 2].add(DVec3::new(x, 0.0, 2.0 * x)));
    let [mut pixel, other] = parts;
    pixel.merge(&other);
    assert!((pixel.mean()[0] - moments.mean()).abs() < 1e-14);
    let error = moments.standard_error().unwrap();
    assert!((pixel.standard_error()[0] / error - 1.0).abs() < 1e-12);
    assert!((pixel.standard_error()[2] / error / 2.0 - 1.0).abs() < 1e-12);
    assert_eq!(pixel.standard_error()[1], 0.0);
}

#[test]
fn blocks_at_the_border_are_smaller() {
    let mut film = Film::new(3, 2);
    for (x, y) in (0..6).map(|i| (i % 3, i / 3)) {
        for side in [-1.0, 1.0] {
            film.add(x, y, DVec3::splat(x as f64 + 10.0 * y as f64 + side));
        }
    }
    let blocks = film.blocks(2);
    assert_eq!((blocks.columns, blocks.rows), (2, 1));
    assert_eq!(blocks.means, [[5.5; 3], [7.0; 3]]);
    // Each pixel's mean has standard error 1.
    assert_eq!(blocks.standard_errors[0], [0.5; 3]);
    assert!((blocks.standard_errors[1][0] - 0.5_f64.sqrt()).abs() < 1e-15);
    let nothing = Film::new(1, 1).blocks(4);
    assert_eq!((nothing.means[0], nothing.effective[0]), ([0.0; 3], [0.0; 3]));
    assert_eq!(nothing.standard_errors[0], [f64::INFINITY; 3]);
}

#[test]
fn effective_number_of_samples() {
    let mut film = Film::new(1, 1);
    for i in 0..100 {
        film.add(0, 0, if i < 7 { DVec3::new(3.0, 1.0, 0.0) } else { DVec3::Y });
    }
    assert_eq!(film.blocks(1).effective, [[7.0, 100.0, 0.0]]);
}
