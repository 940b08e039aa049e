use warpcheck::domain::*;

/// Charts, pictures and measures of one domain fit together.
fn fits<D: Domain>(domain: D) {
    let grid = [0.013, 0.29, 0.5, 0.77, 0.96];
    for patch in [0, domain.patches() / 2, domain.patches() - 1] {
        for (a, b) in grid.into_iter().flat_map(|a| grid.map(|b| (a, b))) {
            if domain.axes() > 0 && domain.is_atom(patch) {
                let (point, jacobian) = domain.point(patch, [a, b]);
                let found = domain.locate(&point).unwrap();
                assert_eq!((found.patch, found.at, jacobian), (patch, [0.0; 2], 1.0));
                assert!(domain.picture_position(&found).iter().all(|x| x.is_nan()));
                assert!(domain.neighbours(&point, 1e-3).is_empty());
                continue;
            }
            let at =
                if domain.axes() == 0 { [0.0; 2] } else { [a, if domain.axes() == 2 { b } else { 0.0 }] };
            let (point, jacobian) = domain.point(patch, at);
            assert!(jacobian > 0.0);
            // A small step has the measure that the Jacobian says.
            if domain.axes() == 2 {
                let h = 1e-6;
                let step = |to: [f64; 2]| domain.displacement(&point, &domain.point(patch, to).0).unwrap();
                let (s, t) = (step([at[0] + h, at[1]]), step([at[0], at[1] + h]));
                let measure = (s[0] * t[1] - s[1] * t[0]).abs() / (h * h);
                assert!((measure / jacobian - 1.0).abs() < 1e-4, "{}: {measure} {jacobian}", domain.name());
            }
            let found = domain.locate(&point).unwrap_or_else(|why| panic!("{point:?} {why}"));
            assert_eq!(found.patch, patch);
            for axis in 0..2 {
                assert!((found.at[axis] - at[axis]).abs() < 1e-12, "{} {at:?} {found:?}", domain.name());
            }
            let [x, y] = domain.picture_position(&found);
            let drawn = domain.picture_location(x, y).expect("a location is drawn inside the picture");
            assert_eq!(drawn.patch, patch);
            for axis in 0..domain.axes() {
                assert!((drawn.at[axis] - at[axis]).abs() < 1e-7, "{} {at:?} {drawn:?}", domain.name());
            }
        }
    }
    if domain.measure().is_finite() {
        measures_fit(&domain, &|cell| {
            Integrator::default().integrate(&domain, cell, &Knots::default(), |_| 1.0).value
        });
    }
}

/// The measures that are stated are those that quadrature and the picture find.
fn measures_fit(space: &dyn Space, integral: &dyn Fn(&Cell) -> f64) {
    let whole = Cell::whole(space);
    let part = match space.axes() {
        0 => Cell { patches: 1..space.patches() - 1, ..whole.clone() },
        1 => Cell { patches: 0..1, low: [0.2, 0.0], high: [0.7, 1.0] },
        _ => Cell { patches: 0..1, low: [0.2, 0.3], high: [0.7, 0.4] },
    };
    for (cell, stated) in
        [(&whole, space.measure()), (&whole, space.cell_measure(&whole)), (&part, space.cell_measure(&part))]
    {
        let found = integral(cell);
        assert!((found / stated - 1.0).abs() < 1e-9, "{}: {found} {stated}", space.name());
    }
    // The picture shows the whole measure.
    let n = 600;
    let mut shown = 0.0;
    for i in 0..n * n {
        let (x, y) = (((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64);
        if space.picture_location(x, y).is_some() {
            shown += space.picture_scale(x, y) / (n * n) as f64;
        }
    }
    let atoms = (0..space.patches()).filter(|&p| space.axes() > 0 && space.is_atom(p)).count();
    shown += atoms as f64; // which have no place in it
    assert!((shown / space.measure() - 1.0).abs() < 0.005, "{}: {shown}", space.name());
}

#[test]
fn charts_and_pictures_fit() {
    fits(Sphere);
    fits(Hemisphere);
    fits(Square);
    fits(Disk);
    fits(Discrete::new(7));
    fits(Triangle::with_area(2.5));
    fits(MeshSurface::from_areas(vec![1.0, 2.0, 0.5, 3.0]));
    fits(Interval::new(-1.0, 3.0));
    fits(WithAtoms::new(Hemisphere, 1));
    fits(WithAtoms::new(MeshSurface::from_areas(vec![1.0, 0.5]), 3));
    fits(WithAtoms::new(Interval::new(-1.0, 3.0), 2));
    fits(Interval::real_line());
    fits(Interval::positive());
    fits(Interval::new(f64::NEG_INFINITY, 2.0));
}

#[test]
fn atoms_are_named_and_counted() {
    let domain = WithAtoms::named(Square, ["the mirror", "the sun"]);
    let cell = |patches| Cell { patches, low: [0.0; 2], high: [1.0; 2] };
    assert_eq!(domain.describe(&cell(1..2)), "the mirror");
    assert_eq!(
        domain.describe(&cell(0..3)),
        "x 0.00000..1.00000, y 0.00000..1.00000, and the mirror, the sun"
    );
    assert_eq!((domain.cell_measure(&cell(1..3)), domain.cell_measure(&cell(0..2))), (2.0, 2.0));
    assert!(domain.locate(&Mixed::Atom(2)).is_err());
    assert!(!domain.is_atom(0) && domain.is_atom(1));
}

#[test]
fn quadrature_states_its_error() {
    let integrator = Integrator { max_evaluations: 400_000, ..Integrator::default() };
    // A Gaussian a hundredth wide, a step, a singularity: the error is real.
    let cases: [(&str, fn(f64) -> f64, f64); 3] = [
        ("peak", |x| (-((x - 0.3) / 1e-2).powi(2)).exp(), 1e-2 * std::f64::consts::PI.sqrt()),
        ("step", |x| if x < 1.0 / 3.0 { 1.0 } else { 0.0 }, 1.0 / 3.0),
        ("singular", |x| 0.5 / x.sqrt(), 1.0),
    ];
    for (name, f, truth) in cases {
        let domain = Interval::new(0.0, 1.0);
        let i = integrator.integrate(&domain, &Cell::whole(&domain), &Knots::default(), |x| f(*x));
        assert!((i.value - truth).abs() <= 2.0 * i.error.max(1e-12), "{name}: {i:?}, truth {truth}");
        assert!(i.error < 1e-5 * truth, "{name}: {i:?}");
    }
}
