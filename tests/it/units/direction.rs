use glam::DVec3;
use warpcheck::domain::{Domain, Hemisphere, Sphere};
use warpcheck::random::{stream, unit_f64};

/// Directions all over the sphere and within 1e-12 rad of poles, seam and horizon, and what lies on them.
fn directions() -> Vec<DVec3> {
    let mut rng = stream(5, "directions", 0);
    let mut all = vec![DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    all.extend([DVec3::new(-1.0, -0.0, 0.0), DVec3::new(-0.0, 0.0, 1.0), DVec3::new(1.0, 1e-300, -0.0)]);
    for i in 0..3000 {
        let scale = [1.0, 1e-4, 1e-12][i % 3];
        let mut step = || scale * (2.0 * unit_f64(&mut rng) - 1.0);
        let from = [DVec3::ZERO, DVec3::Z, -DVec3::Z, DVec3::X, -DVec3::X][i / 3 % 5];
        all.push((from + DVec3::new(step(), step(), step())).normalize());
    }
    all
}

fn same(domain: &impl Domain<Point = DVec3>, points: &[DVec3]) {
    let mut many = Vec::new();
    domain.locate_many(points, &mut many);
    assert_eq!(many.len(), points.len());
    for (w, many) in points.iter().zip(many) {
        match (domain.locate(w).ok(), many) {
            (Some(one), Some(many)) => {
                for (a, b) in one.at.into_iter().zip(many.at) {
                    assert!((a - b).abs() <= 4e-16 * a, "{w}: {a} {b}");
                    assert!((0.0..=1.0).contains(&b), "{w}: {b}");
                }
            }
            (one, many) => assert_eq!(one, many, "{w}"),
        }
    }
}

#[test]
fn many_are_located_as_one_is() {
    let mut points = directions();
    for n in 0..4 {
        same(&Sphere, &points[n..]); // with 0 to 3 left over
        same(&Hemisphere, &points[n..]);
    }
    points.extend([DVec3::NAN, DVec3::splat(1.0), DVec3::ZERO, DVec3::new(f64::INFINITY, 0.0, 0.0)]);
    same(&Sphere, &points);
    same(&Hemisphere, &points);
}

#[test]
fn rough_places_are_near() {
    fn near(domain: &impl Domain<Point = DVec3>, points: &[DVec3]) {
        let mut rough = [Vec::new(), Vec::new()];
        let error = domain.locate_roughly(points, &mut rough);
        assert_eq!([rough[0].len(), rough[1].len()], [points.len(); 2]);
        let rough = (0..points.len()).map(|i| [rough[0][i], rough[1][i]]);
        for (w, at) in points.iter().zip(rough).filter(|(_, at)| !at[1].is_nan()) {
            let exact = domain.locate(w).unwrap().at;
            let off = [0, 1].map(|axis| (f64::from(at[axis]) - exact[axis]).abs());
            assert!(off.iter().all(|off| *off <= f64::from(error)), "{w}: {at:?}");
        }
        let mut none = [Vec::new(), Vec::new()];
        domain.locate_roughly(&[DVec3::NAN, DVec3::splat(1.0), DVec3::ZERO, DVec3::INFINITY], &mut none);
        assert!(none[1].len() == 4 && none[1].iter().all(|phi| phi.is_nan()), "{none:?}");
    }
    let mut points = directions();
    points.extend([1e-20, 1e-39, 1e-50].map(|x| DVec3::new(x, x, 1.0)));
    near(&Sphere, &points);
    near(&Sphere, &points[3..]);
    near(&Hemisphere, &points);
    let mut below = [Vec::new(), Vec::new()];
    Hemisphere.locate_roughly(&[-DVec3::Z], &mut below);
    assert!(below[1][0].is_nan());
}
