//! Trees of lights, lights of a few triangles, weights of strategies.

use super::*;

/// Four lights in a row along each axis, given in another order, from beside and from within: the boxes are known.
#[test]
fn a_tree_of_four_lights() {
    let order = [2, 0, 3, 1];
    let powers = [1.0, 2.0, 4.0, 3.0];
    for axis in 0..3 {
        // From corner to corner of a box of 0.2 x 0.1 x 0.1, the first along the axis, on which the origin lies between them.
        let across = DVec3::ONE - DVec3::AXES[axis];
        let away = 10.0 * across;
        let light = |k: usize| {
            let low = DVec3::AXES[axis] * (k as f64 - 2.0) + away;
            let high = low + DVec3::splat(0.1) + 0.1 * DVec3::AXES[axis];
            ([low.as_vec3(), high.as_vec3(), low.as_vec3()], powers[k])
        };
        let tree = LightTree::new(order.map(light)).unwrap();
        assert_eq!((tree.len(), tree.is_empty()), (4, false));
        let weight = |x: Vec3, from: usize, to: usize| {
            let (low, high) = (from as f64 - 2.0, to as f64 - 2.8);
            let centre = 0.5 * (low + high) * DVec3::AXES[axis] + 0.05 * across + away;
            let radius = 0.25 * ((high - low).powi(2) + 2.0 * 0.01);
            powers[from..to].iter().sum::<f64>() / centre.distance_squared(x.as_dvec3()).max(radius)
        };
        for x in [Vec3::new(0.3, -0.7, 1.1), Vec3::AXES[axis] * 0.4, Vec3::AXES[axis] * 3.1, Vec3::NEG_ONE] {
            let x = x + away.as_vec3();
            let to_left = |from, middle, to| {
                weight(x, from, middle) / (weight(x, from, middle) + weight(x, middle, to))
            };
            let (root, left, right) = (to_left(0, 2, 4), to_left(0, 1, 2), to_left(2, 3, 4));
            let expected =
                [root * left, root * (1.0 - left), (1.0 - root) * right, (1.0 - root) * (1.0 - right)];
            let mut start = 0.0;
            for (k, mass) in expected.into_iter().enumerate() {
                let given = order.iter().position(|&o| o == k).unwrap();
                near(tree.mass(x, given), mass, 1e-5);
                for part in [0.001, 0.5, 0.999] {
                    let (light, found) = tree.choose(x, start + part * mass);
                    assert_eq!(light, given, "axis {axis}, {x}, {k}");
                    near(found, mass, 1e-5);
                }
                start += mass;
            }
            assert_eq!(tree.mass(x, 4), 0.0);
        }
        // Seven nodes of 40 bytes, and two numbers a light.
        assert_eq!(tree.bytes(), 7 * 40 + 4 * 8);
    }
}

/// Two lights alike, from between them: a half each, the border itself to the second.
#[test]
fn the_border_between_two_lights() {
    let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, 1.0)];
    let tree = LightTree::new([(at(-1.0), 2.0), (at(1.0), 2.0)]).unwrap();
    for (xi, light) in [(0.0, 0), (0.5_f64.next_down(), 0), (0.5, 1), (1.0_f64.next_down(), 1)] {
        assert_eq!(tree.choose(Vec3::ZERO, xi), (light, 0.5), "{xi}");
    }
}

/// Powers whose products are no numbers.
#[test]
fn lights_of_enormous_power() {
    let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, 1.0)];
    let tree = LightTree::new([(at(-1.0), 1e300), (at(1.0), 3e300)]).unwrap();
    near(tree.mass(Vec3::ZERO, 1), 0.75, 1e-12);
}

/// Triangles all round, hit by a ray as Moeller and Trumbore have it: the density of a direction sums over all that it meets.
#[test]
fn densities_of_directions_sum_over_all_hits() {
    let mut rng = stream(21, "hits", 0);
    let mut draw = || DVec3::from_array([(); 3].map(|()| 2.0 * unit_f64(&mut rng) - 1.0)).as_vec3();
    let triangles: Vec<[Vec3; 3]> = (0..60)
        .map(|i| {
            // From large ones close by to small ones far away.
            let (centre, size) = (4.0 * draw(), 0.1 + 0.05 * i as f32);
            [(); 3].map(|()| centre + size * draw())
        })
        .collect();
    // Close to the largest, which then is nearly half of all directions.
    let [a, b, c] = triangles[59];
    let close = (a + b + c) / 3.0 + 1e-2 * (b - a).cross(c - a).normalize();
    for (x, sides) in [
        (close, Sides::Both),
        (Vec3::ZERO, Sides::Both),
        (Vec3::new(3.0, -2.0, 5.0), Sides::Front),
        (Vec3::X, Sides::Front),
    ] {
        let light = MeshLight::new(&triangles, sides).unwrap();
        let seen = light.seen_from(x);
        let mut met = 0;
        for _ in 0..2000 {
            let w = draw().as_dvec3().normalize();
            let hits = triangles.iter().filter_map(|t| {
                let [a, b, c] = t.map(|v| v.as_dvec3() - x.as_dvec3());
                let (ab, ac) = (b - a, c - a);
                let p = w.cross(ac);
                let determinant = ab.dot(p);
                let (u, q) = (-a.dot(p) / determinant, (-a).cross(ab));
                let (v, distance) = (w.dot(q) / determinant, ac.dot(q) / determinant);
                let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0;
                let cosine = -ab.cross(ac).normalize().dot(w);
                let lit = cosine > 0.0 || sides == Sides::Both;
                (inside && lit).then(|| distance * distance / cosine.abs())
            });
            let expected = hits.sum::<f64>() / light.area();
            met += u32::from(expected > 0.0);
            near(seen.density(&w), expected, 1e-4);
        }
        assert!(met > 50, "{met}");
    }
}

#[test]
fn two_plates_of_light() {
    let light = plates(Sides::Front);
    assert_eq!((light.len(), light.is_empty(), light.area()), (2, false, 2.0));
    // Two triangles, their ends, and eight buckets of a guide.
    assert_eq!(light.bytes(), 2 * 64 + 2 * 8 + 8 * 8);
    all_near(&[light.mass(0), light.mass(1)], &[0.25, 0.75], 1e-15);
    all_near(&[light.density_on(0), light.density_on(1), light.density_on(2)], &[0.5, 0.5, 0.0], 1e-15);
    assert_eq!(light.select(0.7).0, 1);
    near(light.select(0.7).1, 0.75, 1e-15);
    all_near(&light.variate_knots(0), &[0.25], 1e-15);
    assert_eq!(light.variate_knots(1), [0.0; 0]);
    near(light.left_over(&[0.625, 0.0, 0.0]).unwrap(), 0.5, 1e-14);
    near(light.domain().measure(), 2.0, 1e-15);
    // The fold of (0.25, 0.75) is (0.125, 0.625, 0.25).
    let s = light.sample_surface([0.1, 0.25, 0.75]);
    assert_eq!((s.triangle, s.barycentric, s.normal), (0, Vec3::new(0.125, 0.625, 0.25), Vec3::NEG_Z));
    assert!((s.point - Vec3::new(0.25, 0.625, 1.0)).length() < 1e-6, "{s:?}");
    near(s.density, 0.5, 1e-15);
    let root = plates(Sides::Front).with_warp(TriangleWarp::SquareRoot).sample_surface([0.1, 0.25, 0.5]);
    assert_eq!(root.barycentric, Vec3::new(0.5, 0.25, 0.25));
    // From the origin: distance d, cosine 1 / d.
    let seen = light.sample_from(Vec3::ZERO, [0.1, 0.25, 0.75]).unwrap();
    let d = (0.25_f64.powi(2) + 0.625_f64.powi(2) + 1.0).sqrt();
    near(seen.distance.into(), d, 1e-6);
    near(seen.density, 0.5 * d.powi(3), 1e-6);
    near(light.density_from(Vec3::ZERO, seen.point, 0), 0.5 * d.powi(3), 1e-6);
    assert!((seen.direction.as_dvec3() - DVec3::new(0.25, 0.625, 1.0) / d).length() < 1e-6);
    assert_eq!((seen.triangle, light.density_from(Vec3::ZERO, seen.point, 2)), (0, 0.0));
    // From above it is dark, unless both sides emit.
    let above = Vec3::new(0.0, 0.0, 2.0);
    assert!(light.sample_from(above, [0.1, 0.25, 0.75]).is_none());
    assert_eq!(light.density_from(above, seen.point, 0), 0.0);
    let both = plates(Sides::Both);
    near(both.sample_from(above, [0.1, 0.25, 0.75]).unwrap().density, 0.5 * d.powi(3), 1e-6);
    near(both.density_from(above, seen.point, 0), 0.5 * d.powi(3), 1e-6);
    // Uniform in the solid angle of the small one.
    let small = [Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 1.0)];
    let angle = SphericalTriangle::new(Vec3::ZERO, small).unwrap();
    let within = |light: &MeshLight, x| light.sample_selected(x, (0, 0.3), Placement::SolidAngle, [0.3, 0.6]);
    let (s, w) = (within(&light, Vec3::ZERO).unwrap(), angle.sample([0.3, 0.6]));
    assert!(
        (s.direction.as_dvec3() - w).length() < 1e-6 && (s.point.as_dvec3() - w / w.z).length() < 1e-6,
        "{s:?}"
    );
    near(s.distance.into(), 1.0 / w.z, 1e-6);
    near(s.density, 0.3 / angle.solid_angle(), 1e-12);
    near(light.density_selected(Vec3::ZERO, s.point, (0, 0.3), Placement::SolidAngle), s.density, 1e-12);
    assert_eq!(s.triangle, 0);
    assert!(within(&light, above).is_none() && within(&both, above).is_some());
    assert_eq!(light.density_selected(above, s.point, (0, 0.3), Placement::SolidAngle), 0.0);
    // Weights count: 1/2 times 9 against 3/2.
    let [a, b] = [small, [small[0], small[2] * Vec3::new(3.0, 1.0, 1.0), small[1]]];
    let weighted = MeshLight::weighted([(a, Sides::Front, 9.0), (b, Sides::Both, 1.0)]).unwrap();
    all_near(
        &[weighted.mass(0), weighted.mass(1), weighted.density_on(0), weighted.area()],
        &[0.75, 0.25, 1.5, 2.0],
        1e-15,
    );
    assert!(matches!(MeshLight::weighted([(a, Sides::Front, -1.0)]), Err(Error::Weight { index: 0, .. })));
    assert_eq!(
        MeshLight::weighted([(a, Sides::Front, 0.0)]).map(|_| ()),
        Err(Error::NoArea { triangles: 1 })
    );
}

/// Straight up, through the plates of another light below it: the density sums over both, and the rivals are mistaken in one factor.
#[test]
fn rivals_of_a_light() {
    // A slope with normal (0.6, 0, -0.8) through (0, 0, 2), of area 2; a plate at height 1, of area 1/2.
    let (along, across) = (Vec3::new(0.8, 0.0, 0.6), Vec3::Y);
    let at = |centre: Vec3, a: Vec3, b: Vec3| [centre - a - b, centre - a + b, centre + a];
    let slope = at(Vec3::Z * 2.0, along, across);
    let plate = at(Vec3::Z, 0.5 * Vec3::X, 0.5 * Vec3::Y);
    let light = MeshLight::new(&[slope, plate], Sides::Front).unwrap();
    near(light.area(), 2.5, 1e-6);
    let seen = light.seen_from(Vec3::ZERO);
    let up = DVec3::new(1e-4, 1e-4, 1.0).normalize();
    near(seen.density(&up), 0.4 * (4.0 / 0.8 + 1.0), 1e-3);
    let expected = [
        0.4 * (4.0 + 1.0),
        0.4 * (4.0 * 0.8 + 1.0),
        0.4 * (2.0 / 0.8 + 1.0),
        0.4 * (16.0 / 0.8 + 1.0),
        0.4 * (1.0 / 0.8 + 1.0),
        0.4 * 2.0,
    ];
    for ((what, found), expected) in seen.rivals(&up).into_iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-3, "{what}: {found}, not {expected}");
    }
    assert_eq!(seen.rivals(&up).len(), 6);
    let (sample, own) =
        (seen.sample(&[0.1, 0.3, 0.4]).unwrap(), light.sample_from(Vec3::ZERO, [0.1, 0.3, 0.4]).unwrap());
    assert_eq!((sample.point, sample.density), (own.direction.as_dvec3(), seen.density(&sample.point)));
    // No direction slips between two triangles.
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 1.0));
    let quad = [[0, 2, 1], [0, 3, 2]].map(|t| t.map(|i: usize| corners[i]));
    let quad = MeshLight::new(&quad, Sides::Front).unwrap();
    assert!(quad.seen_from(Vec3::ZERO).density(&DVec3::Z) > 0.0);
    assert_eq!((seen.density(&-up), seen.density(&DVec3::X)), (0.0, 0.0));
    assert_eq!(
        (seen.dimensions(), seen.variate_knots(0), seen.variate_knots(1)),
        (3, light.variate_knots(0), vec![])
    );
}

#[test]
fn weights_of_strategies() {
    let strategies = [(2.0, 1.0), (1.0, 4.0), (1.0, 0.0)];
    for (own, balance, power) in [(0, 2.0 / 6.0, 4.0 / 20.0), (1, 4.0 / 6.0, 16.0 / 20.0), (2, 0.0, 0.0)] {
        all_near(&[Heuristic::Balance.weight_among(own, strategies)], &[balance], 1e-15);
        all_near(&[Heuristic::Power.weight_among(own, strategies)], &[power], 1e-15);
    }
    // Products of what is tiny: their ratio is 1, their squares are nothing.
    assert_eq!(Heuristic::Power.weight_among(0, [(1.0, 1e-200), (1e-200, 1.0)]), 0.5);
    assert_eq!(Heuristic::Balance.weight_among(0, [(1e-200, 1.0), (1e-200, 1.0)]), 0.5);
    // A large share of a strategy that never draws here.
    let shares = [(1e-30_f32, 1.0), (1e30, 0.0), (1e-30, 1.0)];
    assert_eq!(Heuristic::Balance.weight_among(0, shares), 0.5);
    // A large density of a strategy that never draws.
    near(Heuristic::Power.weight_among(0, [(1.0, 3.0), (0.0, 1e300), (2.0, 2.0)]), 9.0 / 25.0, 1e-15);
}
