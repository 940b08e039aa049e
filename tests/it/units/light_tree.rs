use glam::Vec3;
use warpcheck::sampler::LightTree;

fn lights(count: usize) -> Vec<([Vec3; 3], f64)> {
    let at = |i: usize| {
        let (s, c) = (i as f32 * 2.4).sin_cos();
        let p = Vec3::new(s, c, 0.3 * (i as f32).sin()) * (1.0 + 0.2 * i as f32);
        ([p, p + 0.1 * Vec3::X, p + 0.1 * Vec3::Y], 1.0 + (i % 5) as f64)
    };
    (0..count).map(at).collect()
}

#[test]
fn what_is_chosen_has_the_mass_that_is_asked() {
    for count in [1, 2, 3, 7, 40] {
        let tree = LightTree::new(lights(count)).unwrap();
        for x in [Vec3::ZERO, Vec3::new(2.0, 1.0, 0.0), Vec3::new(1e6, 0.0, 3.0)] {
            let total: f64 = (0..count).map(|i| tree.mass(x, i)).sum();
            assert!((total - 1.0).abs() < 1e-14, "{count} lights: {total}");
            for xi in (0..64).map(|k| k as f64 / 64.0) {
                let (light, mass) = tree.choose(x, xi);
                assert_eq!(mass, tree.mass(x, light));
            }
        }
        assert_eq!(tree.mass(Vec3::ZERO, count), 0.0);
    }
}

/// Two small lights: 2 / 1 against 1 / 9 at three times the distance.
#[test]
fn power_over_squared_distance() {
    let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1e-3, 0.0), Vec3::new(x, 0.0, 1e-3)];
    let tree = LightTree::new([(at(1.0), 2.0), (at(-3.0), 1.0)]).unwrap();
    assert!((tree.mass(Vec3::ZERO, 0) - 18.0 / 19.0).abs() < 1e-5);
}
