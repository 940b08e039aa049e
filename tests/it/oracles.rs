//! The samplers' densities against oracles in f64 that share no code with them.

use glam::{DVec3, Vec2, Vec3};
use warpcheck::oracle;
use warpcheck::random::{fill_unit, stream, unit_f64};
use warpcheck::sampler::*;

/// Compares two densities at points that the sampler draws and at uniform ones.
#[track_caller]
fn agree<S: Sampler<Domain: warpcheck::domain::Domain<Point = DVec3>>>(
    name: &str,
    sampler: &S,
    truth: impl Fn(DVec3) -> f64,
    tolerance: f64,
) {
    agree_where(name, sampler, truth, tolerance, |_| true);
}

#[track_caller]
fn agree_where<S: Sampler<Domain: warpcheck::domain::Domain<Point = DVec3>>>(
    name: &str,
    sampler: &S,
    truth: impl Fn(DVec3) -> f64,
    tolerance: f64,
    wanted: impl Fn(DVec3) -> bool,
) {
    let mut rng = stream(11, name, 0);
    let mut xi = vec![0.0; sampler.dimensions()];
    let mut worst = (0.0, DVec3::ZERO);
    let mut compared = 0;
    for i in 0..20_000 {
        fill_unit(&mut rng, &mut xi);
        let w = if i % 2 == 0 {
            match sampler.sample(&xi) {
                Some(sample) => sample.point,
                None => continue,
            }
        } else {
            UniformHemisphere
                .sample(Vec2::new(unit_f64(&mut rng) as f32 * 0.999, unit_f64(&mut rng) as f32))
                .as_dvec3()
        };
        if !wanted(w) {
            continue;
        }
        let (found, true_density) = (sampler.density(&w), truth(w));
        if true_density == 0.0 {
            assert!(found < 1e-25, "{name}: {found:e} where there is nothing, at {w}");
            continue;
        }
        compared += 1;
        // Relative, but for densities that are far below those of any sample.
        let error = (found - true_density).abs() / (true_density + 1e-4);
        if !(error <= worst.0) {
            worst = (error, w);
        }
    }
    assert!(compared > 5000, "{name}: only {compared} points");
    assert!(worst.0 <= tolerance, "{name}: relative error {:.2e} at {}", worst.0, worst.1);
}

fn directions() -> [Vec3; 3] {
    [Vec3::Z, Vec3::new(0.36, -0.48, 0.8), Vec3::new(0.996_194_7, 0.0, 0.087_155_74).normalize()]
}

#[test]
fn lobes() {
    agree("cosine", &CosineHemisphere, oracle::cosine, 2e-6);
    for d in directions() {
        let unit = d.as_dvec3().normalize();
        // A direction in f32 is 3e-8 rad off, which the steepness of the lobe multiplies.
        for (n, tolerance) in [(0.0, 1e-6), (1.0, 1e-5), (50.0, 2e-5), (1e4, 2e-4), (1e6, 2e-3)] {
            let lobe = PhongLobe::new(d, n as f32).unwrap();
            agree(&format!("Phong {n} {d}"), &lobe, |w| oracle::phong(unit, n, w), tolerance);
        }
        for (kappa, tolerance) in [(0.1, 1e-6), (1e2, 2e-5), (1e4, 2e-4), (1e6, 2e-3)] {
            let lobe = VonMisesFisher::new(d, kappa as f32).unwrap();
            agree(
                &format!("vMF {kappa} {d}"),
                &lobe,
                |w| oracle::von_mises_fisher(unit, f64::from(kappa as f32), w),
                tolerance,
            );
        }
        for (alpha, tolerance) in [(0.01, 2e-4), (0.1, 2e-5), (0.5, 1e-5), (1.0, 1e-5)] {
            let lobe = GgxVisibleNormals::new(d, alpha as f32).unwrap();
            agree(
                &format!("GGX {alpha} {d}"),
                &lobe,
                |w| oracle::ggx_reflected(unit, f64::from(alpha as f32), w),
                tolerance,
            );
        }
    }
}

#[test]
fn environments() {
    for (width, height) in [(1, 1), (1, 9), (8, 1), (3, 7), (64, 32)] {
        let texels: Vec<[f32; 3]> =
            (0..width * height).map(|i| [(i as f32 * 0.61).sin().abs(), (i % 5) as f32, 0.01]).collect();
        let truth = oracle::EnvironmentOracle::new(width, height, &texels);
        let map = |rows| Environment::new(width, height, texels.clone(), rows).unwrap();
        let name = format!("{width} x {height}");
        // The oracle takes theta from the cosine, which knows nothing of the last digits near a pole.
        let off_poles = |w: DVec3| w.truncate().length() > 0.1;
        agree_where(&name, &map(RowWarp::UniformV), |w| truth.uniform_v(w), 2e-5, off_poles);
        agree_where(&name, &map(RowWarp::UniformCosTheta), |w| truth.uniform_cos_theta(w), 1e-6, off_poles);
    }
}

/// E[1 / density] over the directions of a light is its solid angle.
#[test]
fn solid_angle_of_a_light() {
    let triangle = [Vec3::new(1.0, 0.0, 0.2), Vec3::new(0.1, 1.2, 0.0), Vec3::new(-0.3, -0.2, 1.5)];
    for x in [Vec3::ZERO, Vec3::new(0.5, 0.5, 0.45), Vec3::new(-3.0, 2.0, 1.0)] {
        let truth = oracle::solid_angle_of_triangle(triangle.map(|v| (v - x).as_dvec3()));
        let light = MeshLight::new(&[triangle], Sides::Both).unwrap();
        let mut rng = stream(3, "solid angle", 0);
        let moments: warpcheck::statistics::Moments = (0..400_000)
            .map(|_| {
                let xi = [unit_f64(&mut rng), unit_f64(&mut rng), unit_f64(&mut rng)];
                1.0 / light.sample_from(x, xi).expect("both sides emit").density
            })
            .collect();
        let error = moments.standard_error().unwrap();
        assert!(
            (moments.mean() - truth).abs() < 4.5 * error + 1e-6 * truth,
            "{x}: {} +- {error}, truth {truth}",
            moments.mean()
        );
        assert!(error < 0.01 * truth, "the test could not tell: {error} of {truth}");
    }
}

/// Nothing shared between these and the closed forms that came with the data.
#[test]
fn published_triangle_lights() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/data/reference/closed_forms.json");
    let text = std::fs::read_to_string(file).unwrap();
    // Three triangles, each "tri", "E", "solid_angle": pick the numbers out of the text, so that the library alone can run this.
    let numbers = |key: &str, count: usize| -> Vec<Vec<f64>> {
        text.match_indices(&format!("\"{key}\""))
            .map(|(at, _)| {
                text[at + key.len() + 3..]
                    .split(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c)))
                    .filter_map(|word| word.parse().ok())
                    .take(count)
                    .collect()
            })
            .collect()
    };
    let (triangles, irradiances, angles) = (numbers("tri", 9), numbers("E", 1), numbers("solid_angle", 1));
    assert_eq!(triangles.len(), 3);
    for i in 0..3 {
        let t = &triangles[i];
        let vertices = [0, 3, 6].map(|k| DVec3::new(t[k], t[k + 1], t[k + 2]));
        let angle = oracle::solid_angle_of_triangle(vertices);
        assert!((angle / angles[i][0] - 1.0).abs() < 1e-9, "{angle} {}", angles[i][0]);
        let irradiance = oracle::irradiance_of_polygon(&vertices, DVec3::Y);
        assert!((irradiance / irradiances[i][0] - 1.0).abs() < 1e-9, "{irradiance} {}", irradiances[i][0]);
    }
}
