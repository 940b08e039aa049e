//! What all samplers have: the trait, pointers to them, closures.

use super::*;

/// A reference and a box answer as the sampler does, and do not fall back on what the trait has for all.
#[test]
fn pointers_to_samplers_answer_like_them() {
    /// Answers everything with something of its own.
    struct Odd;
    impl Sampler for Odd {
        type Domain = warpcheck::domain::Interval;
        fn domain(&self) -> Self::Domain {
            warpcheck::domain::Interval::positive()
        }
        fn dimensions(&self) -> usize {
            1
        }
        fn sample(&self, xi: &[f64]) -> Option<Sample<f64>> {
            (xi[0] < 0.5).then_some(Sample { point: xi[0], density: 2.0 })
        }
        fn fill(&self, _: &[f64], samples: &mut [Option<Sample<f64>>]) {
            samples.fill(Some(Sample { point: 7.0, density: 8.0 }));
        }
        fn fill_points(&self, _: &[f64], points: &mut [Option<f64>]) {
            points.fill(Some(9.0));
        }
        fn density(&self, x: &f64) -> f64 {
            3.0 * x
        }
        fn density_many(&self, points: &[f64], out: &mut Vec<f64>) {
            out.clear();
            out.resize(points.len(), 5.0);
        }
        fn invert(&self, x: &f64) -> Option<Vec<f64>> {
            Some(vec![*x])
        }
        fn preimages(&self, _: &f64) -> Option<Vec<Preimage>> {
            Some(vec![])
        }
        fn left_over(&self, xi: &[f64]) -> Option<f64> {
            Some(xi[0])
        }
        fn variate_knots(&self, dimension: usize) -> Vec<f64> {
            vec![dimension as f64]
        }
        fn rivals(&self, x: &f64) -> Vec<(&'static str, f64)> {
            vec![("rival", *x)]
        }
        fn cell_mass(&self, _: &Cell) -> Option<f64> {
            Some(0.25)
        }
        fn has_density(&self) -> bool {
            false
        }
        fn is_slow(&self) -> bool {
            true
        }
        fn density_range(&self, x: &f64) -> Option<[f64; 2]> {
            Some([*x, 2.0 * x])
        }
        fn knots(&self) -> Knots {
            Knots::grid(2, 3)
        }
    }
    fn judge(sampler: impl Sampler<Domain = warpcheck::domain::Interval>) {
        assert_eq!((sampler.dimensions(), sampler.has_density(), sampler.is_slow()), (1, false, true));
        assert_eq!(
            (sampler.domain().measure(), sampler.density_range(&3.0)),
            (f64::INFINITY, Some([3.0, 6.0]))
        );
        assert_eq!(sampler.sample(&[0.25]), Some(Sample { point: 0.25, density: 2.0 }));
        assert_eq!(sampler.sample(&[0.75]), None);
        let (mut samples, mut points, mut densities) = ([None; 2], [None; 2], vec![1.0]);
        sampler.fill(&[0.1, 0.2], &mut samples);
        sampler.fill_points(&[0.1, 0.2], &mut points);
        sampler.density_many(&[0.1, 0.2], &mut densities);
        assert_eq!(samples, [Some(Sample { point: 7.0, density: 8.0 }); 2]);
        assert_eq!((points, densities), ([Some(9.0); 2], vec![5.0; 2]));
        assert_eq!(
            (sampler.density(&2.0), sampler.invert(&0.5), sampler.preimages(&0.5)),
            (6.0, Some(vec![0.5]), Some(vec![]))
        );
        assert_eq!(
            (sampler.left_over(&[0.5]), sampler.variate_knots(4), sampler.rivals(&3.0)),
            (Some(0.5), vec![4.0], vec![("rival", 3.0)])
        );
        assert_eq!((sampler.cell_mass(&patches(0..1)), sampler.knots()), (Some(0.25), Knots::grid(2, 3)));
    }
    judge(&Odd);
    judge(Box::new(Odd));
}

/// Samplers of directions take two variates, and the trait shows what their own methods answer, in `f64`.
#[test]
fn the_trait_shows_samplers_as_they_are() {
    #[track_caller]
    fn judge(
        sampler: &impl Sampler<Domain: warpcheck::domain::Domain<Point = DVec3>>,
        measure: f64,
        own_sample: impl Fn(Vec2) -> Option<DVec3>,
        own_density: impl Fn(Vec3) -> f64,
    ) {
        assert_eq!(sampler.dimensions(), 2);
        near(sampler.domain().measure(), measure, 1e-15);
        for xi in [[0.25, 0.125], [0.5, 0.625], [0.75, 0.875]] {
            let sample = sampler.sample(&xi);
            assert_eq!(sample.map(|s| s.point), own_sample(Vec2::new(xi[0] as f32, xi[1] as f32)));
            if let Some(sample) = sample {
                let density = own_density(sample.point.as_vec3());
                near(sample.density, density, 1e-6);
                near(sampler.density(&sample.point), density, 1e-6);
            }
        }
    }
    let up = Vec3::new(0.36, -0.48, 0.8);
    let some = |w: Vec3| Some(w.as_dvec3());
    let (half, whole) = (TAU, 2.0 * TAU);
    judge(
        &CosineHemisphere,
        half,
        |xi| some(CosineHemisphere.sample(xi)),
        |w| CosineHemisphere.density(w).into(),
    );
    judge(
        &UniformHemisphere,
        half,
        |xi| some(UniformHemisphere.sample(xi)),
        |w| UniformHemisphere.density(w).into(),
    );
    judge(&UniformSphere, whole, |xi| some(UniformSphere.sample(xi)), |w| UniformSphere.density(w).into());
    let phong = PhongLobe::new(up, 3.0).unwrap();
    judge(&phong, half, |xi| phong.sample(xi).and_then(some), |w| phong.density(w).into());
    let ggx = GgxVisibleNormals::new(up, 0.4).unwrap();
    judge(&ggx, half, |xi| ggx.sample(xi).and_then(some), |w| ggx.density(w).into());
    let lobe = VonMisesFisher::new(up, 2.0).unwrap();
    judge(&lobe, whole, |xi| some(lobe.sample(xi)), |w| lobe.density(w).into());
    let octant = SphericalTriangle::new(Vec3::ZERO, [Vec3::X, Vec3::Y, Vec3::Z]).unwrap();
    let place = |xi: Vec2| xi.as_dvec2().to_array();
    judge(&octant, whole, |xi| Some(octant.sample(place(xi))), |_| 1.0 / FRAC_PI_2);
    assert_eq!(Sampler::density(&octant, &DVec3::NEG_ONE.normalize()), 0.0);
    for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
        let map = Environment::from_map(small_map(), rows).unwrap();
        judge(&map, whole, |xi| some(map.sample(place(xi)).direction), |w| map.density(w).into());
        for form in [Form::Guide, Form::Alias] {
            let map = PackedEnvironment::new(small_map(), rows, form).unwrap();
            judge(&map, whole, |xi| some(map.sample(place(xi)).direction), |w| map.density(w).into());
        }
    }
    // About an oblique direction: along its own tangents.
    let Frame { tangent, bitangent, normal } = Frame::new(up);
    assert!(
        (tangent.cross(bitangent) - normal).length() < 1e-6
            && tangent.is_normalized()
            && tangent.dot(up).abs() < 1e-6
    );
    for (v, local) in [(tangent, Vec3::X), (bitangent, Vec3::Y), (normal, Vec3::Z)] {
        assert!(
            (Frame::new(up).to_local(v) - local).length() < 1e-6
                && (Frame::new(up).to_world(local) - v).length() < 1e-6
        );
    }
}

/// What the trait has for samplers that say nothing of their own.
#[test]
fn what_samplers_do_unless_told() {
    let warp = BarycentricWarp::new(TriangleWarp::LowDistortion, 2.0).unwrap();
    let b = DVec3::new(0.125, 0.625, 0.25);
    assert_eq!(warp.preimages(&b), Some(vec![Preimage { xi: vec![0.25, 0.75], selecting: 0, weight: 1.0 }]));
    assert_eq!((Sampler::density(&warp, &b), warp.density(), warp.domain().measure()), (0.5, 0.5, 2.0));
    let (mut densities, mut points) = (vec![7.0], [None; 2]);
    warp.density_many(&[b, b], &mut densities);
    assert_eq!(densities, [0.5, 0.5]);
    warp.fill_points(&[0.25, 0.75, 0.0, 0.0], &mut points);
    assert_eq!(points, [Some(b), Some(DVec3::Z)]);
    assert!(warp.has_density() && !warp.is_slow());
    assert_eq!(warp.density_range(&b), None);
    assert_eq!((warp.left_over(&[0.5; 2]), warp.rivals(&b), warp.variate_knots(0)), (None, vec![], vec![]));
    assert_eq!((warp.knots(), warp.cell_mass(&patches(0..1))), (Knots::default(), None));
    // Three variates for two axes have no inverse of their own.
    let light = plates(Sides::Front);
    assert_eq!(light.seen_from(Vec3::ZERO).preimages(&DVec3::Z), None);
    assert_eq!(light.seen_from(Vec3::ZERO).invert(&DVec3::Z), None);
    let odd =
        from_fn(warpcheck::domain::Disk, |xi: [f64; 2]| xi, |_: DVec2| 1.0).with_knots(Knots::grid(2, 2));
    assert_eq!((odd.knots(), odd.dimensions()), (Knots::grid(2, 2), 2));
    // One variate, vectors of them.
    let line = || warpcheck::domain::Interval::new(0.0, 1.0);
    let single = from_fn(line(), |x: f64| (x, 3.0), |x: f64| 4.0 * x);
    assert_eq!(single.sample(&[0.25]), Some(Sample { point: 0.25, density: 3.0 }));
    assert_eq!((single.dimensions(), single.density(&0.5)), (1, 2.0));
    let single = from_fn(line(), |x: f32| x, |x: f32| 4.0 * x);
    assert_eq!(single.sample(&[0.25]), Some(Sample { point: 0.25, density: 1.0 }));
    let vector = from_fn(warpcheck::domain::Sphere, |v: Vec3| v, |_: Vec3| 1.0);
    assert_eq!(
        (vector.dimensions(), vector.sample(&[0.0, 0.5, 0.25]).unwrap().point),
        (3, DVec3::new(0.0, 0.5, 0.25))
    );
    // Atoms among them, rejected or not, with a density or not.
    let mixed = || warpcheck::domain::WithAtoms::named(warpcheck::domain::Disk, ["atom"]);
    let density = |_: Mixed<DVec2>| 5.0;
    let point = |[u, v]: [f64; 2]| if u < 0.5 { Mixed::Atom(0) } else { Mixed::Continuous(DVec2::new(u, v)) };
    let kept = |xi: [f64; 2]| xi[1] < 0.5;
    let expected = |density| {
        [Mixed::Atom(0), Mixed::Continuous(DVec2::new(0.75, 0.25))]
            .map(|point| Some(Sample { point, density }))
    };
    let drawn = |s: &dyn Fn(&[f64]) -> Option<Sample<Mixed<DVec2>>>| [s(&[0.25, 0.25]), s(&[0.75, 0.25])];
    let plain = from_fn(mixed(), point, density);
    assert_eq!(drawn(&|xi| plain.sample(xi)), expected(5.0));
    let dense = from_fn(mixed(), move |xi: [f64; 2]| (point(xi), 6.0), density);
    assert_eq!(drawn(&|xi| dense.sample(xi)), expected(6.0));
    let some = from_fn(mixed(), move |xi: [f64; 2]| kept(xi).then(|| point(xi)), density);
    assert_eq!((drawn(&|xi| some.sample(xi)), some.sample(&[0.25, 0.75])), (expected(5.0), None));
    let both = from_fn(mixed(), move |xi: [f64; 2]| kept(xi).then(|| (point(xi), 6.0)), density);
    assert_eq!((drawn(&|xi| both.sample(xi)), both.sample(&[0.25, 0.75])), (expected(6.0), None));
    // The last step before 0 is a point like others.
    let exponential =
        from_statrs(warpcheck::domain::Interval::positive(), statrs::distribution::Exp::new(1.0).unwrap());
    let step = 2.0_f64.powi(-53);
    near(exponential.sample(&[step]).unwrap().point, step, 1e-9);
    assert!(exponential.sample(&[0.0]).unwrap().point > 0.0);
    let drawn = from_draws(warpcheck::domain::Disk, |xi: [f64; 2]| xi);
    assert_eq!(drawn.dimensions(), 2);
    assert!(drawn.density(&DVec2::ZERO).is_nan() && !drawn.has_density());
    let sample = drawn.sample(&[0.25, 0.5]).unwrap();
    assert!(sample.point == DVec2::new(0.25, 0.5) && sample.density.is_nan());
}
