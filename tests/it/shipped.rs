//! The samplers that ship are right, peaky ones included.

use glam::Vec3;
use warpcheck::sampler::*;
use warpcheck::verify::{Report, Settings};
use warpcheck::{verify, verify::Examination};

fn tilted() -> Vec3 {
    Vec3::new(0.3, -0.5, 0.8).normalize()
}

fn examine<S: Sampler>(name: impl Into<String>, sampler: &S) -> Examination {
    let settings = Settings { samples: 120_000, seed: 20_26, ..Settings::default() };
    verify(sampler).name(name).settings(settings).examine()
}

fn assert_right(examinations: Vec<Examination>) {
    let settings = Settings { samples: 120_000, seed: 20_26, ..Settings::default() };
    for e in &examinations {
        println!(
            "{:40} {:?} {:?} evals {:?} cells {} power {:?}",
            e.name,
            e.time,
            e.integral,
            e.scales,
            e.cells.len(),
            e.power(1e-5)
        );
    }
    let report = Report::new(examinations, &settings);
    println!("{report}");
    report.assert();
}

#[cfg(feature = "render")]
#[test]
fn names_are_found_or_corrected() {
    use warpcheck::catalogue::{entries, find};
    let all = entries(std::path::Path::new("data"));
    assert_eq!(find(&all, "phong/50").unwrap().len(), 1);
    assert!(find(&all, "phong").unwrap().len() > 3);
    assert!(find(&all, "phon").is_err_and(|near| near == Some("phong")));
    assert!(find(&all, "ggx/0.05x").is_err_and(|near| near.is_some_and(|n| n.starts_with("ggx/"))));
    assert!(find(&all, "light/cornell").is_err_and(|near| near == Some("light/cornell-from-floor")));
    assert!(find(&all, "entirely-different-thing").is_err_and(|near| near.is_none()));
    let mut names: Vec<_> = all.iter().map(|e| &e.name).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), all.len(), "two entries share a name");
}

#[test]
fn smooth_directions() {
    assert_right(vec![
        examine("uniform sphere", &UniformSphere),
        examine("uniform hemisphere", &UniformHemisphere),
        examine("cosine hemisphere", &CosineHemisphere),
    ]);
}

const GRAZING: Vec3 = Vec3::new(0.996_194_7, 0.0, 0.087_155_74);

#[test]
fn peaky_directions() {
    assert_right(vec![
        examine("vMF", &VonMisesFisher::new(tilted(), 1e4).unwrap()),
        examine("Phong", &PhongLobe::new(tilted(), 1e6).unwrap()),
        examine("GGX", &GgxVisibleNormals::new(GRAZING, 0.1).unwrap()),
    ]);
}

#[test]
#[ignore = "long: every pair of a lobe and a direction"]
fn every_peaky_direction() {
    let mut all = Vec::new();
    for (kappa, mean) in pairs([1e2, 1e4, 1e6], [Vec3::NEG_Z, tilted()]) {
        all.push(examine(format!("vMF {kappa} {mean}"), &VonMisesFisher::new(mean, kappa).unwrap()));
    }
    for (exponent, mirror) in pairs([0.0, 1.0, 50.0, 1e4, 1e6], [GRAZING, tilted()]) {
        all.push(examine(format!("Phong {exponent} {mirror}"), &PhongLobe::new(mirror, exponent).unwrap()));
    }
    for (alpha, outgoing) in pairs([0.01, 0.1, 0.5, 1.0], [tilted(), GRAZING]) {
        all.push(examine(
            format!("GGX {alpha} {outgoing}"),
            &GgxVisibleNormals::new(outgoing, alpha).unwrap(),
        ));
    }
    assert_right(all);
}

fn pairs<const N: usize>(of: [f32; N], with: [Vec3; 2]) -> impl Iterator<Item = (f32, Vec3)> {
    of.into_iter().flat_map(move |a| with.map(|b| (a, b)))
}

#[test]
fn triangles_and_lights() {
    lights(&[0.5]);
}

#[test]
#[ignore = "long: lights from far and near"]
fn lights_from_far_and_near() {
    lights(&[3.0, 0.02]);
}

fn lights(heights: &[f32]) {
    let mut all = Vec::new();
    for warp in [TriangleWarp::LowDistortion, TriangleWarp::SquareRoot] {
        all.push(examine(format!("{warp:?}"), &BarycentricWarp::new(warp, 2.0).unwrap()));
    }
    let quad = [[0, 1, 2], [0, 2, 3]]
        .map(|t| t.map(|i: usize| [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y][i]));
    let light = MeshLight::new(&quad, Sides::Front).unwrap();
    all.push(examine("quad", &light));
    for &height in heights {
        all.push(examine(format!("quad from {height}"), &light.seen_from(Vec3::new(0.3, 0.4, height))));
    }
    all.push(examine("discrete", &DiscreteCdf::new(&[1.0, 0.0, 2.0, 3.0, 1e-7]).unwrap()));
    let many: Vec<f64> = (0..100_000).map(|i| f64::from(i % 1000).powi(3)).collect();
    all.push(examine("discrete 1e5", &DiscreteCdf::new(&many).unwrap()));
    all.push(examine(
        "mixture",
        &Mixture::new(0.3, CosineHemisphere, PhongLobe::new(tilted(), 1e3).unwrap()).unwrap(),
    ));
    assert_right(all);
}

#[test]
fn environments() {
    maps(&[RowWarp::UniformCosTheta], &[(1, 1), (6, 1), (3, 7)]);
}

#[test]
#[ignore = "long: both warps of rows, maps of every shape"]
fn every_environment() {
    maps(&[RowWarp::UniformV, RowWarp::UniformCosTheta], &[(1, 1), (1, 5), (6, 1), (3, 7), (64, 32)]);
}

fn maps(warps: &[RowWarp], shapes: &[(usize, usize)]) {
    let mut all = Vec::new();
    for &rows in warps {
        for &(w, h) in shapes {
            let texels: Vec<[f32; 3]> =
                (0..w * h).map(|i| [(i as f32 * 0.7).sin().abs(), 0.1, (i % 3) as f32]).collect();
            all.push(examine(format!("{rows:?} {w}x{h}"), &Environment::new(w, h, texels, rows).unwrap()));
        }
        let mut sun = vec![[0.1, 0.1, 0.1]; 256 * 128];
        sun[100 + 256 * 40] = [1e5; 3];
        all.push(examine(format!("{rows:?} sun"), &Environment::new(256, 128, sun, rows).unwrap()));
    }
    assert_right(all);
}

#[test]
fn histograms_agree_with_what_is_claimed() {
    use warpcheck::histogram::{Histogram, claimed_density};
    fn agrees<S: Sampler>(sampler: &S, size: usize) {
        let settings = Settings { samples: 1_000_000, seed: 5, ..Settings::default() };
        let histogram = Histogram::draw(sampler, size, size, &settings);
        let (drawn, claimed) = (histogram.density(&sampler.domain()), claimed_density(sampler, size, size));
        let (mut sum, mut cells) = (0.0, 0);
        for (i, (a, b)) in drawn.iter().zip(&claimed).enumerate() {
            if b.is_nan() || histogram.counts[i] < 1000 {
                continue;
            }
            sum += ((a - b) / b).powi(2) * histogram.counts[i] as f64;
            cells += 1;
        }
        // Pixels on the border are measured coarsely; those inside have a chi-square of about 1 each.
        assert!(cells > size && sum / f64::from(cells as u32) < 3.0, "{sum} over {cells} pixels");
    }
    agrees(&CosineHemisphere, 24);
    agrees(&BarycentricWarp::new(TriangleWarp::SquareRoot, 3.0).unwrap(), 24);
}

#[test]
fn a_light_tree_chooses_with_the_mass_that_it_says() {
    let light = |i: usize| {
        let (s, c) = (i as f32 * 2.4).sin_cos();
        let p = Vec3::new(s, c, 0.3 * (i as f32).sin()) * (1.0 + 0.2 * i as f32);
        ([p, p + 0.1 * Vec3::X, p + 0.1 * Vec3::Y], 1.0 + (i % 5) as f64)
    };
    let (tree, x) = (LightTree::new((0..40).map(light)).unwrap(), Vec3::new(1.0, 2.0, 0.5));
    let sampler = from_fn(
        warpcheck::domain::Discrete::new(40),
        |[u]: [f64; 1]| tree.choose(x, u).0,
        |i: usize| tree.mass(x, i),
    );
    assert_right(vec![examine("light tree", &sampler)]);
}
