use glam::Vec3;
use std::f64::consts::TAU;
use warpcheck::estimator::Reflection;
use warpcheck::random::{stream, to_f32, unit_f64};
use warpcheck::scene::{Convention, Material};

fn material(kd: f32, ks: f32, ns: f32) -> Material {
    Material { kd: Vec3::splat(kd), ks: Vec3::splat(ks), ns, ..Material::default() }
}

/// f cos / p over samples has the albedo as its mean: for the lobe (n + 1)/(n + 2) at normal incidence.
#[test]
fn albedo_at_normal_incidence() {
    let cases = [
        (Convention::Mtl, material(0.3, 0.5, 10.0), 0.3 + 0.5 * 11.0 / 12.0),
        (Convention::Mtl, material(0.3, 0.0, 10.0), 0.3),
        (Convention::KdPhong, material(0.8, 0.5, 10.0), 0.8 * 11.0 / 12.0),
        (Convention::KdPhong, material(0.8, 0.5, 1.0), 0.8),
        (Convention::KdPhong, material(1.0, 0.0, 1e6), 1.0),
        (Convention::KdPhong, material(1.0, 0.0, 1e21), 1.0),
    ];
    for (convention, material, albedo) in cases {
        let brdf = Reflection::new(&material, convention).seen_from(Vec3::Z);
        let mut rng = stream(1, "brdf", 0);
        let n = 200_000;
        let weight = |w: Vec3| {
            let (f, p) = brdf.evaluate(w);
            assert!(f.is_finite() && p > 0.0, "{material:?} at {w}: {f} {p}");
            f64::from(f.x * w.z / p)
        };
        let sum: f64 = (0..n)
            .filter_map(|_| brdf.sample([(); 3].map(|()| to_f32(unit_f64(&mut rng)))))
            .map(weight)
            .sum();
        assert!((sum / n as f64 - albedo).abs() < 2e-3, "{material:?}: {} for {albedo}", sum / n as f64);
    }
}

/// The GGX lobe is reciprocal, and reflects all it receives but for what is masked: a smooth one everything.
#[test]
fn ggx_is_reciprocal_and_keeps_energy() {
    let ggx = |alpha| {
        let material = Material { roughness: Some(alpha), ..material(0.0, 1.0, 1.0) };
        Reflection::new(&material, Convention::Mtl)
    };
    let (a, b) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.48, 0.64, 0.6));
    for alpha in [0.05, 0.3, 1.0] {
        let [there, back] = [(a, b), (b, a)].map(|(o, i)| ggx(alpha).seen_from(o).evaluate(i).0.x);
        assert!((there / back - 1.0).abs() < 1e-5, "{there} {back}");
    }
    // The albedos of the rough ones by midpoints over the hemisphere in Python, 600 x 600, D G2 / 4 cos theta_o with its own D and G2.
    for (alpha, least, most) in [(0.01, 0.995, 1.001), (0.3, 0.8555, 0.8575), (1.0, 0.3493, 0.3533)] {
        let brdf = ggx(alpha).seen_from(a);
        let (n, mut albedo) = (400, 0.0);
        let mut rng = stream(2, "ggx", 0);
        for _ in 0..n * n {
            let xi = [(); 3].map(|()| to_f32(unit_f64(&mut rng)));
            let Some(w) = brdf.sample(xi) else { continue };
            let (f, p) = brdf.evaluate(w);
            albedo += f64::from(f.x * w.z / p) / f64::from(n * n);
        }
        assert!((least..most).contains(&albedo), "alpha {alpha}: {albedo}");
    }
}

#[test]
fn sharp_lobe_keeps_its_digits() {
    // In the plane of incidence, 1 mrad off the mirror direction, n = 1e6: cos^n = exp(-n alpha^2 / 2).
    let out = Vec3::new(-0.6, 0.0, 0.8);
    let brdf = Reflection::new(&material(1.0, 0.0, 1e6), Convention::KdPhong).seen_from(out);
    let angle = 0.6_f64.asin() + 1e-3;
    let (f, _) = brdf.evaluate(Vec3::new(angle.sin() as f32, 0.0, angle.cos() as f32));
    let exact = 1_000_001.0 / TAU * (1e6 * 1e-3_f64.cos().ln()).exp();
    assert!((f64::from(f.x) / exact - 1.0).abs() < 1e-3, "{} for {exact}", f.x);
}

#[test]
fn black_is_black() {
    assert!(Reflection::new(&material(0.0, 0.0, 5.0), Convention::Mtl).is_black());
    assert!(Reflection::new(&material(0.0, 0.5, 5.0), Convention::KdPhong).is_black());
}
