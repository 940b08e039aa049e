//! Points of triangles, directions of lobes, spherical triangles.

use super::*;

#[test]
fn warps_of_a_triangle_by_hand() {
    for (warp, xi, b) in [
        (TriangleWarp::LowDistortion, Vec2::new(0.25, 0.75), Vec3::new(0.125, 0.625, 0.25)),
        (TriangleWarp::LowDistortion, Vec2::new(0.75, 0.25), Vec3::new(0.625, 0.125, 0.25)),
        (TriangleWarp::LowDistortion, Vec2::new(0.5, 0.5), Vec3::new(0.25, 0.25, 0.5)),
        (TriangleWarp::SquareRoot, Vec2::new(0.25, 0.75), Vec3::new(0.5, 0.375, 0.125)),
        (TriangleWarp::SquareRoot, Vec2::new(0.0, 0.0), Vec3::X),
    ] {
        assert_eq!((warp.barycentric(xi), warp.invert(b)), (b, xi), "{warp:?}");
        let mut all = [Vec3::ZERO; 2];
        warp.barycentric_all(&[xi, xi], &mut all);
        assert_eq!(all, [b; 2]);
    }
}

#[test]
fn uniform_directions_by_hand() {
    // z = 1 - xi0, 1 - 2 xi0 or sqrt(1 - xi0); a twelfth of a turn.
    let (half, turned) =
        (Vec2::new(0.5, 1.0 / 12.0), |r: f32, z: f32| Vec3::new(r * 0.75_f32.sqrt(), r * 0.5, z));
    assert!((UniformHemisphere.sample(half) - turned(0.75_f32.sqrt(), 0.5)).length() < 1e-6);
    let low = UniformSphere.sample(Vec2::new(0.75, 1.0 / 12.0));
    assert!((low - turned(0.75_f32.sqrt(), -0.5)).length() < 1e-6);
    assert!((CosineHemisphere.sample(half) - turned(0.5_f32.sqrt(), 0.5_f32.sqrt())).length() < 1e-6);
    let below = Vec3::new(0.6, 0.0, -0.8);
    near(UniformSphere.density(below).into(), 0.25 / PI, 1e-6);
    near(UniformHemisphere.density(-below).into(), 0.5 / PI, 1e-6);
    near(UniformHemisphere.density(Vec3::X).into(), 0.5 / PI, 1e-6);
    near(CosineHemisphere.density(-below).into(), 0.8 / PI, 1e-6);
    assert_eq!((UniformHemisphere.density(below), CosineHemisphere.density(below)), (0.0, 0.0));
    // Three quarters of a turn.
    let w = DVec3::new(0.0, -0.6, 0.8);
    all_near(&UniformHemisphere.invert(&w).unwrap(), &[0.2, 0.75], 1e-12);
    all_near(&UniformSphere.invert(&w).unwrap(), &[0.1, 0.75], 1e-12);
    all_near(&UniformSphere.invert(&-w).unwrap(), &[0.9, 0.25], 1e-12);
    all_near(&CosineHemisphere.invert(&w).unwrap(), &[0.36, 0.75], 1e-12);
    let oblique = DVec3::new(0.48, -0.36, 0.8);
    all_near(&UniformHemisphere.invert(&oblique).unwrap()[..1], &[0.2], 1e-12);
    all_near(&UniformSphere.invert(&-oblique).unwrap()[..1], &[0.9], 1e-12);
    all_near(&CosineHemisphere.invert(&oblique).unwrap()[..1], &[0.36], 1e-12);
    // Beside the pole, where 1 - z has no digits.
    let beside = DVec3::new(6e-6, 8e-6, (1.0 - 1e-10_f64).sqrt());
    near(UniformHemisphere.invert(&beside).unwrap()[0], 5e-11, 1e-9);
    near(UniformSphere.invert(&beside).unwrap()[0], 2.5e-11, 1e-9);
    assert_eq!(CosineHemisphere.invert(&DVec3::X).unwrap()[1], 0.0);
    // An ulp below a whole turn, not one.
    let turn = CosineHemisphere.invert(&DVec3::new(1.0, -1e-300, 0.0)).unwrap()[1];
    assert!(turn < 1.0 && turn > 0.999, "{turn}");
}

/// Phong's lobe of exponent 3, on the axis: cos alpha = xi^(1/4), density 4 / 2 pi cos^3 alpha.
#[test]
fn a_phong_lobe_by_hand() {
    let lobe = PhongLobe::new(Vec3::Z, 3.0).unwrap();
    let w = lobe.sample(Vec2::new(1.0 / 16.0, 0.25)).unwrap();
    assert!((w - Vec3::new(0.0, 0.75_f32.sqrt(), 0.5)).length() < 1e-6, "{w}");
    near(lobe.density(w).into(), 2.0 / PI * 0.125, 1e-6);
    near(lobe.density(Vec3::Z).into(), 2.0 / PI, 1e-6);
    near(lobe.density(Vec3::new(0.28, 0.0, 0.96)).into(), 2.0 / PI * 0.96_f64.powi(3), 1e-6);
    assert_eq!(lobe.density(Vec3::new(0.6, 0.0, -0.8)), 0.0);
    // About X half of it is under the surface.
    let grazing = PhongLobe::new(Vec3::X, 1.0).unwrap();
    assert_eq!(
        [0.25, 0.75]
            .map(|turn| grazing.sample(Vec2::new(0.25, turn)).is_some())
            .iter()
            .filter(|s| **s)
            .count(),
        1
    );
    near(grazing.density(Vec3::new(0.6, 0.0, 0.8)).into(), 0.6 / PI, 1e-6);
    assert_eq!(grazing.density(Vec3::new(-0.6, 0.0, 0.8)), 0.0);
    assert_eq!(grazing.density(Vec3::new(0.8, 0.0, -0.6)), 0.0);
    // Near the mirror direction the cosine has no digits in `f32`, the chord has.
    let (narrow, w) = (PhongLobe::new(Vec3::Z, 1e6).unwrap(), Vec3::new(1e-3, 0.0, 1.0));
    near(narrow.density(w).into(), 1e6 / TAU * (1e6 * (-0.5e-6_f64).ln_1p()).exp(), 1e-5);
    let sharpest = |exponent| PhongLobe::new(Vec3::Z, exponent).unwrap();
    assert_eq!(sharpest(1e30), sharpest(PhongLobe::LARGEST_EXPONENT));
    assert_ne!(sharpest(1e8), sharpest(PhongLobe::LARGEST_EXPONENT));
}

/// kappa = 2: density 2 / (2 pi (1 - e^-4)) e^-2(1 - cos alpha).
#[test]
fn a_von_mises_fisher_lobe_by_hand() {
    let lobe = VonMisesFisher::new(Vec3::Z, 2.0).unwrap();
    let top = 2.0 / (TAU * (1.0 - (-4.0_f64).exp()));
    near(lobe.density(Vec3::Z).into(), top, 1e-6);
    near(lobe.density(Vec3::Y).into(), top * (-2.0_f64).exp(), 1e-6);
    near(lobe.density(Vec3::NEG_Z).into(), top * (-4.0_f64).exp(), 1e-6);
    // The share of the cap with cos alpha >= 1/2 is (1 - e^-1) / (1 - e^-4).
    let share = (1.0 - (-1.0_f32).exp()) / (1.0 - (-4.0_f32).exp());
    let expected = Vec3::new(0.75, 0.5 * 0.75_f32.sqrt(), 0.5);
    assert!((lobe.sample(Vec2::new(share, 1.0 / 12.0)) - expected).length() < 1e-6);
    assert!((lobe.sample(Vec2::new(0.0, 0.25)) - Vec3::Z).length() < 1e-6);
    // At kappa 1e4 e^-2e4 is nothing.
    let narrow = VonMisesFisher::new(Vec3::Z, 1e4).unwrap();
    near(narrow.density(Vec3::Z).into(), 1e4 / TAU, 1e-6);
}

/// D, G1 and the height-correlated G2 as Heitz (2014) has them, in `f64`.
#[test]
fn ggx_by_hand() {
    for (outgoing, alpha) in
        [(Vec3::Z, 1.0), (Vec3::new(0.6, 0.0, 0.8), 0.5), (Vec3::new(-0.48, 0.64, 0.6), 0.1)]
    {
        let lobe = GgxVisibleNormals::new(outgoing, alpha).unwrap();
        let (a, o) = (f64::from(alpha), outgoing.as_dvec3());
        let lambda = |w: DVec3| {
            let tangent = w.truncate().length_squared() / (w.z * w.z);
            0.5 * ((1.0 + a * a * tangent).sqrt() - 1.0)
        };
        for w in [
            Vec3::new(0.0, 0.0, 1.0),
            Vec3::new(-0.6, 0.0, 0.8),
            Vec3::new(0.36, -0.48, 0.8),
            Vec3::new(0.96, 0.0, 0.28),
        ] {
            let i = w.as_dvec3();
            let m = (i + o).normalize();
            let d = 1.0 / (PI * a * a * (m.truncate().length_squared() / (a * a) + m.z * m.z).powi(2));
            let density = d / ((1.0 + lambda(o)) * 4.0 * o.z);
            let brdf = d / ((1.0 + lambda(o) + lambda(i)) * 4.0 * o.z * i.z);
            near(lobe.density(w).into(), density, 1e-4);
            near((lobe.density(w) * lobe.brdf_over_density(w)).into(), brdf, 1e-4);
            assert_eq!(
                (
                    lobe.density(w * Vec3::new(1.0, 1.0, -1.0)),
                    lobe.brdf_over_density(w * Vec3::new(1.0, 1.0, -1.0))
                ),
                (0.0, 0.0)
            );
        }
        // The pole of the cap: the stretched direction and Z, added and stretched back.
        let stretched = DVec3::new(a * o.x, a * o.y, o.z).normalize();
        let expected = DVec3::new(a * stretched.x, a * stretched.y, 1.0 + stretched.z).normalize();
        assert!((lobe.normal(Vec2::new(0.3, 0.0)).as_dvec3() - expected).length() < 1e-6);
        // Halfway down the cap, a twelfth of a turn.
        let drop = 0.5 * (1.0 + stretched.z);
        let r = (drop * (2.0 - drop)).sqrt();
        let (x, y) = (r * 0.75_f64.sqrt() + stretched.x, 0.5 * r + stretched.y);
        let expected = DVec3::new(a * x, a * y, 1.0 - drop + stretched.z).normalize();
        let m = lobe.normal(Vec2::new(1.0 / 12.0, 0.5)).as_dvec3();
        assert!((m - expected).length() < 1e-6, "{m} {expected}");
        let reflected = 2.0 * o.dot(expected) * expected - o;
        let w = lobe.sample(Vec2::new(1.0 / 12.0, 0.5)).map(|w| w.as_dvec3());
        assert!(
            if reflected.z > 0.0 { w.unwrap().distance(reflected) < 1e-5 } else { w.is_none() },
            "{w:?} {reflected}"
        );
    }
}

/// An octant: the first variate is the angle about Y, the second what 1 - y is.
#[test]
fn an_octant_by_hand() {
    let octant =
        SphericalTriangle::new(Vec3::ONE, [Vec3::X, Vec3::Y, Vec3::Z].map(|v| v * 3.0 + Vec3::ONE)).unwrap();
    near(octant.solid_angle(), FRAC_PI_2, 1e-15);
    for (a, b) in [(0.0, 0.5), (0.3, 0.6), (0.7, 0.1), (0.999, 0.999)] {
        let ((sin, cos), y) = ((FRAC_PI_2 * a).sin_cos(), 1.0 - b);
        let r = (1.0_f64 - y * y).sqrt();
        let w = octant.sample([a, b]);
        assert!((w - DVec3::new(r * cos, y, r * sin)).length() < 1e-14, "{a} {b}: {w}");
        near(octant.density(w), 1.0 / FRAC_PI_2, 1e-15);
    }
    let inside = DVec3::new(0.1, 0.2, 0.3).normalize();
    for flip in
        [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, -1.0), DVec3::NEG_ONE]
    {
        assert_eq!(octant.density(inside * flip), 0.0);
    }
    // The other way round.
    let other = SphericalTriangle::new(Vec3::ZERO, [Vec3::Z, Vec3::Y, Vec3::X]).unwrap();
    near(other.density(inside), 1.0 / FRAC_PI_2, 1e-15);
    let ((sin, cos), w) = ((FRAC_PI_2 * 0.3).sin_cos(), other.sample([0.3, 1.0]));
    assert!((w - DVec3::new(sin, 0.0, cos)).length() < 1e-14, "{w}");
}

/// Seen from its own plane a triangle has no solid angle: from beside, on an edge, in a corner and from within.
#[test]
fn triangles_seen_from_their_plane() {
    let corners = [Vec3::X, Vec3::new(-0.5, 0.75, 0.0), Vec3::new(-0.5, -0.75, 0.0)];
    for x in
        [Vec3::ZERO, Vec3::new(0.1, 0.2, 0.0), Vec3::new(-0.5, 0.0, 0.0), Vec3::X, Vec3::new(5.0, 0.0, 0.0)]
    {
        assert!(SphericalTriangle::new(x, corners).is_none(), "{x}");
    }
    // From just above its middle it is half of all directions.
    let above = SphericalTriangle::new(Vec3::Z * 1e-6, corners).unwrap();
    near(above.solid_angle(), TAU, 1e-5);
}

/// From (0, 0, 0) to (0, 3, 4), whose normal is -Z: distance 5, cosine 4/5.
#[test]
fn a_view_by_hand() {
    let view = View::new(Vec3::X, Vec3::new(1.0, 3.0, 4.0), Vec3::NEG_Z).unwrap();
    assert_eq!((view.distance_squared, view.cosine), (25.0, 0.8));
    assert!((view.direction - DVec3::new(0.0, 0.6, 0.8)).length() < 1e-15);
    near(view.per_solid_angle(2.0), 2.0 * 25.0 / 0.8, 1e-15);
    near(view.per_area(2.0), 2.0 * 0.8 / 25.0, 1e-15);
    assert_eq!(View::along(DVec3::new(0.0, 3.0, 4.0), Vec3::NEG_Z), Some(view));
    let behind = View::along(DVec3::new(0.0, 3.0, 4.0), Vec3::Z).unwrap();
    assert_eq!((behind.cosine, behind.per_solid_angle(2.0), behind.per_area(2.0)), (-0.8, 0.0, 0.0));
    assert_eq!(behind.two_sided(), view);
    let edge_on = View::along(DVec3::Y, Vec3::Z).unwrap();
    assert_eq!((edge_on.per_solid_angle(2.0), edge_on.per_area(2.0)), (0.0, 0.0));
    assert_eq!(View::new(Vec3::X, Vec3::X, Vec3::Z), None);
}

/// Half a face of a cube has a twelfth of the sphere. With a second variate of 1 samples lie on the arc from a to c, which the first cuts by area.
#[test]
fn shares_of_a_spherical_triangle() {
    let corners = [Vec3::new(-1.0, -1.0, 1.0), Vec3::new(1.0, -1.0, 1.0), Vec3::new(1.0, 1.0, 1.0)];
    let whole = SphericalTriangle::new(Vec3::ZERO, corners).unwrap();
    near(whole.solid_angle(), 4.0 * PI / 12.0, 1e-14);
    for share in [0.1, 0.5, 0.8] {
        let on_arc = whole.sample([share, 1.0]);
        let part = SphericalTriangle::new(Vec3::ZERO, [corners[0], corners[1], on_arc.as_vec3()]).unwrap();
        near(part.solid_angle(), share * whole.solid_angle(), 1e-6);
        assert!((on_arc.x - on_arc.y).abs() < 1e-14, "{on_arc}"); // the plane of a and c
        // And the second cuts the cosine with b.
        let b = corners[1].as_dvec3().normalize();
        near(1.0 - whole.sample([share, 0.25]).dot(b), 0.25 * (1.0 - on_arc.dot(b)), 1e-12);
    }
}
