//! Mixtures, and deltas beside other samplers.

use super::*;

fn names(rivals: Vec<(&'static str, f64)>) -> Vec<f64> {
    rivals.into_iter().map(|r| r.1).collect()
}

#[test]
fn a_mixture_by_hand() {
    let (cosine, uniform) = (0.8 / PI, 0.5 / PI);
    let w = DVec3::new(0.0, -0.6, 0.8);
    let mixture = Mixture::new(0.25, CosineHemisphere, UniformHemisphere).unwrap();
    near(mixture.density(&w), 0.25 * cosine + 0.75 * uniform, 1e-6);
    let expected = [cosine, uniform, cosine + uniform, 0.75 * cosine + 0.25 * uniform];
    all_near(&names(mixture.rivals(&w)), &expected, 1e-6);
    assert_eq!(
        (mixture.dimensions(), mixture.variate_knots(0), mixture.variate_knots(1)),
        (3, vec![0.25], vec![])
    );
    // The border belongs to the second.
    let second = Sampler::sample(&UniformHemisphere, &[0.3, 0.4]).unwrap().point;
    assert_eq!(mixture.sample(&[0.25, 0.3, 0.4]).unwrap().point, second);
    assert_ne!(mixture.sample(&[0.25_f64.next_down(), 0.3, 0.4]).unwrap().point, second);
    // Either part leads back to the point.
    let preimages = mixture.preimages(&w).unwrap();
    let weights: Vec<f64> = preimages.iter().map(|p| p.weight).collect();
    assert_eq!(
        (weights, preimages.iter().map(|p| p.selecting).collect::<Vec<_>>()),
        (vec![0.25, 0.75], vec![1, 1])
    );
    all_near(&preimages[0].xi, &[0.125, 0.36, 0.75], 1e-12);
    all_near(&preimages[1].xi, &[0.625, 0.2, 0.75], 1e-12);
    for preimage in preimages {
        assert!((mixture.sample(&preimage.xi).unwrap().point - w).length() < 1e-6);
    }
    // Where one has no density, or none is chosen, the other is all there is.
    for (c, first) in [(0.0, false), (1.0, true)] {
        let one = Mixture::new(c, CosineHemisphere, UniformHemisphere).unwrap();
        let preimages = one.preimages(&w).unwrap();
        assert_eq!((preimages.len(), preimages[0].weight, one.variate_knots(0)), (1, 1.0, vec![]));
        all_near(&[preimages[0].xi[1]], &[if first { 0.36 } else { 0.2 }], 1e-12);
        let w = w.as_vec3();
        let other = if first { CosineHemisphere.density(w) } else { UniformHemisphere.density(w) };
        assert_eq!(one.density(&w.as_dvec3()), f64::from(other));
    }
    // Of weight 0, a part may even be infinite.
    let infinite = || {
        from_fn(
            Hemisphere,
            |[u, v]: [f32; 2]| CosineHemisphere.sample(Vec2::new(u, v)),
            |_: DVec3| f64::INFINITY,
        )
    };
    let uniform_alone = Sampler::density(&UniformHemisphere, &w);
    assert_eq!(Mixture::new(0.0, infinite(), UniformHemisphere).unwrap().density(&w), uniform_alone);
    assert_eq!(Mixture::new(1.0, UniformHemisphere, infinite()).unwrap().density(&w), uniform_alone);
    let under = Mixture::new(0.25, CosineHemisphere, UniformHemisphere).unwrap().preimages(&DVec3::NEG_Z);
    assert_eq!(under, Some(vec![]));
    let no_inverse = Mixture::new(0.25, CosineHemisphere, PhongLobe::new(Vec3::Z, 1.0).unwrap()).unwrap();
    assert_eq!(no_inverse.preimages(&w), None);
    assert!(Mixture::new(-0.01, CosineHemisphere, UniformHemisphere).is_err());
}

#[test]
fn a_mixture_of_tables_by_hand() {
    let tables = [[1.0, 1.0, 1.0, 1.0], [1.0, 1.0, 0.0, 0.0]].map(|w| DiscreteCdf::new(&w).unwrap());
    let [first, second] = tables;
    let mixture = Mixture::new(0.5, first, second).unwrap();
    all_near(&[mixture.density(&0), mixture.density(&2)], &[0.375, 0.125], 1e-15);
    near(mixture.cell_mass(&patches(1..3)).unwrap(), 0.5 * 0.5 + 0.5 * 0.5, 1e-15);
    near(mixture.cell_mass(&patches(2..4)).unwrap(), 0.25, 1e-15);
    all_near(&sorted(mixture.variate_knots(1)), &[0.25, 0.5, 0.75], 1e-15);
    assert_eq!((mixture.variate_knots(0), mixture.variate_knots(2)), (vec![0.5], vec![]));
    // Of another number of variates: the shorter part fills up with halves, and has no knots past its end.
    let light = plates(Sides::Front);
    let longer = Mixture::new(0.5, &light, Mixture::new(0.5, &light, &light).unwrap()).unwrap();
    assert_eq!(longer.dimensions(), 5);
    all_near(&longer.variate_knots(1), &[0.25, 0.5], 1e-15);
    all_near(&longer.variate_knots(2), &[0.25, 0.25], 1e-15);
    assert_eq!((longer.variate_knots(3), longer.variate_knots(4)), (vec![], vec![]));
    let point = SurfacePoint { triangle: 1, barycentric: DVec3::new(0.125, 0.625, 0.25) };
    let preimages = longer.preimages(&point).unwrap();
    let described: Vec<_> = preimages.iter().map(|p| (p.xi.len(), p.selecting)).collect();
    assert_eq!(described, [(5, 2), (5, 3), (5, 3)]);
    all_near(&preimages.iter().map(|p| p.weight).collect::<Vec<_>>(), &[0.375, 0.1875, 0.1875], 1e-15);
    all_near(&preimages[0].xi, &[0.25, 0.625, 0.25, 0.75, 0.5], 1e-6);
    all_near(&preimages[2].xi, &[0.75, 0.75, 0.625, 0.25, 0.75], 1e-6);
}

#[test]
fn a_delta_beside_a_table() {
    let table = DiscreteCdf::new(&[1.0; 4]).unwrap();
    let sampler = WithDelta::new(0.2, "mirror", &table).unwrap();
    assert_eq!((sampler.dimensions(), sampler.variate_knots(0)), (2, vec![0.2]));
    all_near(&sampler.variate_knots(1), &[0.25, 0.5, 0.75], 1e-15);
    assert_eq!((sampler.density(&Mixed::Atom(0)), sampler.density(&Mixed::Atom(1))), (0.2, 0.0));
    all_near(&[sampler.density(&Mixed::Continuous(3))], &[0.2], 1e-15);
    // Patch 4 is the atom.
    let masses = [0..2, 1..5, 4..5, 0..5].map(|cell| sampler.cell_mass(&patches(cell)).unwrap());
    all_near(&masses, &[0.4, 0.8, 0.2, 1.0], 1e-15);
    let light = plates(Sides::Front);
    let lit = WithDelta::new(0.2, "mirror", &light).unwrap();
    assert_eq!((lit.variate_knots(1), lit.variate_knots(2)), (light.variate_knots(0), vec![]));
    let point = Mixed::Continuous(SurfacePoint { triangle: 1, barycentric: DVec3::new(0.125, 0.625, 0.25) });
    near(lit.preimages(&point).unwrap()[0].weight, 0.8 * 0.75, 1e-15);
    let map = Environment::from_map(small_map(), RowWarp::UniformV).unwrap();
    assert_eq!(WithDelta::new(0.2, "mirror", &map).unwrap().knots(), Knots::grid(2, 4));
    assert_eq!(Mixture::new(0.2, &map, UniformSphere).unwrap().knots(), Knots::grid(2, 4));
    for c in [0.0, 1.0] {
        assert_eq!(WithDelta::new(c, "mirror", &table).unwrap().variate_knots(0), [0.0; 0]);
    }
    let drawn = sampler.sample(&[0.2, 0.3]).unwrap();
    assert_eq!(drawn.point, Mixed::Continuous(1));
    near(drawn.density, 0.2, 1e-15);
    assert_eq!(
        sampler.sample(&[0.2_f64.next_down(), 0.3]).unwrap(),
        Sample { point: Mixed::Atom(0), density: 0.2 }
    );
    let smooth = WithDelta::new(0.2, "mirror", CosineHemisphere).unwrap();
    let w = DVec3::new(0.0, -0.6, 0.8);
    let [preimage] = &smooth.preimages(&Mixed::Continuous(w)).unwrap()[..] else {
        panic!("not one preimage")
    };
    assert_eq!((preimage.selecting, preimage.weight), (1, 0.8));
    all_near(&preimage.xi, &[0.6, 0.36, 0.75], 1e-12);
    assert_eq!(smooth.preimages(&Mixed::Atom(0)), None);
    assert!(smooth.has_density());
    let drawn =
        WithDelta::new(0.2, "mirror", from_draws(warpcheck::domain::Disk, |xi: [f64; 2]| xi)).unwrap();
    assert!(!drawn.has_density());
}
