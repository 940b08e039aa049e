use glam::DVec3;
use std::f64::consts::PI;
use warpcheck::oracle::*;

#[test]
fn catalogue_values() {
    let v = DVec3::new;
    let close = |t: [DVec3; 3], truth: f64| {
        let found = solid_angle_of_triangle(t);
        assert!((found / truth - 1.0).abs() < 1e-12, "{found} {truth}");
    };
    close([DVec3::X, DVec3::Y, DVec3::Z], PI / 2.0);
    close([v(1.0, 1.0, 1.0), v(1.0, -1.0, -1.0), v(-1.0, 1.0, -1.0)], PI);
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    close([v(0.0, 1.0, golden), v(0.0, -1.0, golden), v(golden, 0.0, 1.0)], PI / 5.0);
    close([v(0.0, 0.0, 1.0), v(1e-4, 0.0, 1.0), v(0.0, 1e-4, 1.0)], 4.999_999_975_00e-9);
}

#[test]
fn half_space_gives_pi() {
    let far = 1e7;
    let square = [(-far, -far), (far, -far), (far, far), (-far, far)].map(|(x, y)| DVec3::new(x, y, 1.0));
    assert!((irradiance_of_polygon(&square, DVec3::Z) - PI).abs() < 1e-6);
}
