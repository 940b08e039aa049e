//! A broken copy of each core sampler is caught, and its right twin passes with the same settings and seeds.

use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};
use warpcheck::domain::{
    Discrete, Hemisphere, Interval, MeshSurface, Sphere, Square, SurfacePoint, Triangle,
};
use warpcheck::fault;
use warpcheck::sampler::*;
use warpcheck::verify;
use warpcheck::verify::{Report, Verdict};

const SAMPLES: u64 = 200_000;
const SEED: u64 = 4;

fn run<S: Sampler>(sampler: &S) -> Report {
    verify(sampler).samples(SAMPLES).seed(SEED).undiagnosed().run()
}

/// Passes where it should, fails where it should, by the check that should see it.
#[track_caller]
fn tell_apart<R: Sampler, B: Sampler>(right: &R, broken: &B, caught_by: &str) {
    run(right).assert();
    let report = run(broken);
    assert_eq!(report.verdict(), Verdict::Fail, "not caught:\n{report}");
    let caught: Vec<_> = report.conclusions[0]
        .iter()
        .filter(|c| c.verdict == Verdict::Fail)
        .map(|c| c.finding.check)
        .collect();
    assert!(caught.contains(&caught_by), "caught by {caught:?}, not by {caught_by}:\n{report}");
}

/// A plain f32 running sum, binary search with the wrong bound.
#[test]
fn discrete_lower_bound_for_upper_bound() {
    let weights = [0.25, 0.0, 0.5, 0.25];
    let right = DiscreteCdf::new(&weights).unwrap();
    let cdf = [0.0_f32, 0.25, 0.25, 0.75];
    // Off by one: the entry below the one whose interval holds xi.
    let broken = from_fn(
        Discrete::new(4),
        move |xi: f64| cdf.partition_point(|&c| f64::from(c) <= xi).saturating_sub(2),
        move |i: usize| weights[i],
    );
    tell_apart(&right, &broken, "support");
}

#[test]
fn discrete_absorbed_tail() {
    let mut weights = vec![1e-8_f64; 200_000];
    weights[0] = 1.0;
    let right = DiscreteCdf::new(&weights).unwrap();
    let mut cdf = Vec::with_capacity(weights.len());
    let mut sum = 0.0_f32;
    for w in &weights {
        sum += *w as f32;
        cdf.push(f64::from(sum));
    }
    let last = weights.len() - 1;
    let broken = from_fn(
        Discrete::new(weights.len()),
        move |xi: f64| cdf.partition_point(|&c| c <= xi).min(last),
        move |i: usize| weights[i] / 1.002,
    );
    tell_apart(&right, &broken, "chi-square");
}

#[test]
fn barycentric_branch_squared() {
    let right = BarycentricWarp::new(TriangleWarp::LowDistortion, 1.0).unwrap();
    tell_apart(&right, &fault::barycentric_branch_squared(), "support");
}

#[test]
fn barycentric_without_square_root() {
    let right = BarycentricWarp::new(TriangleWarp::SquareRoot, 1.0).unwrap();
    let broken = from_fn(
        Triangle::with_area(1.0),
        |[u, v]: [f32; 2]| Vec3::new(1.0 - u, v * u, u * (1.0 - v)),
        |_: Vec3| 1.0_f32,
    );
    tell_apart(&right, &broken, "chi-square");
}

#[test]
fn triangle_area_without_a_half() {
    let broken = from_fn(
        Triangle::with_area(1.0),
        |xi: Vec2| TriangleWarp::LowDistortion.barycentric(xi),
        |_: Vec3| 0.5_f32,
    );
    tell_apart(&BarycentricWarp::new(TriangleWarp::LowDistortion, 1.0).unwrap(), &broken, "chi-square");
}

fn quad_light() -> MeshLight {
    let quad = [[0, 1, 2], [0, 2, 3]]
        .map(|t| t.map(|i: usize| [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 2.0, 0.0), Vec3::Y][i]));
    MeshLight::new(&quad, Sides::Front).unwrap()
}

#[test]
fn mesh_light_chooses_triangles_uniformly() {
    let light = quad_light();
    let areas = [1.0, 0.5];
    let broken = from_fn(
        MeshSurface::from_areas(areas.to_vec()),
        |[s, u, v]: [f32; 3]| SurfacePoint {
            triangle: usize::from(s >= 0.5),
            barycentric: TriangleWarp::LowDistortion.barycentric(Vec2::new(u, v)).as_dvec3(),
        },
        move |_: SurfacePoint| 1.0 / 1.5,
    );
    tell_apart(&light, &broken, "chi-square");
}

/// Solid angle: the cosine is missing, the distance is not squared, the selection probability is left out.
#[test]
fn solid_angle_mistakes() {
    let light = quad_light();
    let x = Vec3::new(0.4, 0.3, 0.7);
    let right = light.seen_from(x);
    run(&right).assert();
    let mistakes: [(&str, fn(f64, f64, f64) -> f64); 4] = [
        ("cosine missing", |p, _, cos| p * cos),
        ("distance not squared", |p, d, _| p / d),
        ("distance squared twice", |p, d, _| p * d * d),
        ("selection probability left out", |p, _, _| p / 0.5),
    ];
    for (name, mistake) in mistakes {
        let density = |w: DVec3| {
            let p = right.density(&w);
            let distance = f64::from(x.z) / -w.z;
            mistake(p, distance, -w.z)
        };
        let sample = |xi: [f64; 3]| light.sample_from(x, xi).map(|s| s.direction);
        let report = run(&from_fn(Sphere, sample, density));
        assert_eq!(report.verdict(), Verdict::Fail, "{name}:\n{report}");
    }
}

fn smooth_map(width: usize, height: usize) -> Vec<[f32; 3]> {
    let texel = |i: usize| 0.2 + ((i % width) as f32 * 0.9).sin().abs() + (i / width) as f32 * 0.1;
    (0..width * height).map(|i| [texel(i); 3]).collect()
}

/// Environment: the sine is missing from the weights or from the density, (u, v) is half a texel off, theta is flipped.
#[test]
fn environment_mistakes() {
    let (width, height) = (16, 8);
    let right = Environment::new(width, height, smooth_map(width, height), RowWarp::UniformV).unwrap();
    run(&right).assert();
    let theta_of = |w: DVec3| w.truncate().length().atan2(w.z);
    let turned = |w: DVec3, angle: f64| (glam::DMat3::from_rotation_z(angle)) * w;
    let density = |w: DVec3| Sampler::density(&right, &w);
    let sample = |xi: [f64; 2]| Environment::sample(&right, xi).direction.as_dvec3();
    type Pair<'a> =
        (&'a str, Box<dyn Fn([f64; 2]) -> DVec3 + Sync + 'a>, Box<dyn Fn(DVec3) -> f64 + Sync + 'a>);
    let mistakes: [Pair<'_>; 5] = [
        ("sine missing in the density", Box::new(sample), Box::new(move |w| density(w) * theta_of(w).sin())),
        ("pi sine for 2 pi^2 sine", Box::new(sample), Box::new(move |w| density(w) * TAU)),
        ("half a texel off", Box::new(move |xi| turned(sample(xi), PI / 16.0)), Box::new(density)),
        ("v flipped", Box::new(move |xi| sample(xi) * DVec3::new(1.0, 1.0, -1.0)), Box::new(density)),
        ("7% off in the pdf", Box::new(sample), Box::new(move |w| density(w) * 1.07)),
    ];
    for (name, sample, density) in mistakes {
        let report = run(&from_fn(Sphere, sample, density));
        assert_eq!(report.verdict(), Verdict::Fail, "{name}:\n{report}");
    }
    // The table itself without the sine: its own density is no longer that of its samples.
    let without_sine = fault::environment_without_sine(right.clone()).unwrap();
    assert_eq!(run(&without_sine).verdict(), Verdict::Fail);
}

#[test]
fn cosine_sampled_with_a_uniform_density_and_back() {
    let uniform_density = |_: Vec3| 0.5 * std::f32::consts::FRAC_1_PI;
    tell_apart(
        &CosineHemisphere,
        &from_fn(Hemisphere, |xi: Vec2| CosineHemisphere.sample(xi), uniform_density),
        "chi-square",
    );
    tell_apart(&UniformHemisphere, &fault::uniform_with_cosine_density(), "chi-square");
}

#[test]
fn phong_mistakes() {
    let mirror = Vec3::new(0.6, 0.0, 0.8);
    let right = PhongLobe::new(mirror, 50.0).unwrap();
    // n + 2 for n + 1.
    let sample = |xi: Vec2| right.sample(xi);
    tell_apart(
        &right,
        &from_fn(Hemisphere, sample, |w: Vec3| right.density(w) * 52.0 / 51.0),
        "normalisation",
    );
    // Under the surface: silently tried again, density unchanged.
    let grazing = PhongLobe::new(Vec3::new(0.996_194_7, 0.0, 0.087_155_74), 50.0).unwrap();
    let retried = from_fn(
        Hemisphere,
        |[a, b, c, d]: [f32; 4]| grazing.sample(Vec2::new(a, b)).or_else(|| grazing.sample(Vec2::new(c, d))),
        |w: Vec3| grazing.density(w),
    );
    tell_apart(&grazing, &retried, "chi-square");
}

#[test]
fn ggx_without_masking() {
    let outgoing = Vec3::new(0.8, 0.0, 0.6);
    let right = GgxVisibleNormals::new(outgoing, 0.5).unwrap();
    let broken = from_fn(
        Hemisphere,
        |xi: Vec2| right.sample(xi),
        |w: Vec3| {
            let g1 =
                2.0 * outgoing.z / (outgoing.z + (outgoing.z.powi(2) + 0.25 * outgoing.x.powi(2)).sqrt());
            right.density(w) / g1
        },
    );
    tell_apart(&right, &broken, "chi-square");
}

#[test]
fn mixture_mistakes() {
    let right = Mixture::new(0.5, CosineHemisphere, UniformHemisphere).unwrap();
    // The density of the chosen lobe only comes with the sample.
    let chosen_only = from_fn(
        Hemisphere,
        |[pick, a, b]: [f32; 3]| {
            let xi = Vec2::new(a, b);
            if pick < 0.5 {
                let w = CosineHemisphere.sample(xi);
                (w, CosineHemisphere.density(w))
            } else {
                let w = UniformHemisphere.sample(xi);
                (w, UniformHemisphere.density(w))
            }
        },
        |w: Vec3| 0.5 * (CosineHemisphere.density(w) + UniformHemisphere.density(w)),
    );
    tell_apart(&right, &chosen_only, "agreement");
    // Selection probabilities differ by 7% between sample and density.
    let other = Mixture::new(0.535, CosineHemisphere, UniformHemisphere).unwrap();
    let differing =
        from_fn(Hemisphere, |xi: [f64; 3]| other.sample(&xi).map(|s| s.point), |w: DVec3| right.density(&w));
    tell_apart(&right, &differing, "chi-square");
}

/// NaN at one variate in 2^24.
#[test]
fn nan_at_the_edge() {
    let broken = from_fn(
        Interval::positive(),
        |xi: f32| -xi.ln() * if xi == 0.0 { 0.0 } else { 1.0 }, // inf * 0
        |x: f32| (-x).exp(),
    );
    let right = from_fn(Interval::positive(), |xi: f32| -(-xi).ln_1p(), |x: f32| (-x).exp());
    tell_apart(&right, &broken, "domain");
}

/// 0.3% of the samples lie where the density claims 4e-6 of the mass.
#[test]
fn a_crowd_in_a_rare_place() {
    let side = 0.002_f64; // 4e-6 of the unit square
    let broken = from_fn(
        Square,
        move |[pick, u, v]: [f64; 3]| if pick < 0.003 { [0.3 + side * u, 0.7 + side * v] } else { [u, v] },
        |_: [f64; 2]| 1.0,
    );
    tell_apart(&from_fn(Square, |[u, v]: [f64; 2]| [u, v], |_: [f64; 2]| 1.0), &broken, "chi-square");
}
