use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use warpcheck::sampler::SphericalTriangle;

/// Girard's sum of angles, in `f64`, where it has digits.
fn girard(v: [Vec3; 3]) -> f64 {
    let [a, b, c] = v.map(|v| v.as_dvec3().normalize());
    let angle = |at: DVec3, p: DVec3, q: DVec3| at.cross(p).angle_between(at.cross(q));
    angle(a, b, c) + angle(b, c, a) + angle(c, a, b) - PI
}

#[test]
fn solid_angles_are_those_of_girard_and_of_the_plane_limit() {
    for v in [
        [Vec3::X, Vec3::Y, Vec3::Z],
        [Vec3::new(1.0, 0.2, 0.1), Vec3::new(-0.5, 2.0, 0.3), Vec3::new(-0.5, -0.9, 0.2)],
        [Vec3::new(1.0, 0.0, -0.1), Vec3::new(-0.6, 0.9, -0.1), Vec3::new(-0.6, -0.9, -0.1)],
    ] {
        let triangle = SphericalTriangle::new(Vec3::ZERO, v).unwrap();
        assert!((triangle.solid_angle() - girard(v)).abs() < 1e-13);
    }
    let tiny = 1e-9_f32;
    let v = [Vec3::new(0.0, 0.0, 2.0), Vec3::new(tiny, 0.0, 2.0), Vec3::new(0.0, tiny, 2.0)];
    let plane = 0.5 * f64::from(tiny).powi(2) / 4.0;
    let triangle = SphericalTriangle::new(Vec3::ZERO, v).unwrap();
    assert!((triangle.solid_angle() / plane - 1.0).abs() < 1e-12);
    assert!(SphericalTriangle::new(Vec3::X, [Vec3::X, Vec3::Y, Vec3::Z]).is_none());
    assert!(SphericalTriangle::new(Vec3::ZERO, [Vec3::X, Vec3::Y, Vec3::NEG_X]).is_none());
}
