use warpcheck::picture::Scale;

#[test]
fn positions_and_ticks() {
    let residuals = Scale::Symmetric { limit: 5.0 };
    assert_eq!([-9.0, -5.0, 0.0, 2.5, 5.0].map(|v| residuals.position(v)), [0.0, 0.0, 0.5, 0.75, 1.0]);
    assert!(residuals.position(f64::NAN).is_nan());
    let labels = |scale: Scale| scale.ticks().into_iter().map(|t| t.label).collect::<Vec<_>>();
    assert_eq!(labels(residuals), ["<=-5", ">=5", "0", "-2.5", "2.5"]);
    assert_eq!(labels(Scale::Log { floor: 1.0, max: 1e5 })[..5], ["<=1", ">=1e5", "10", "100", "1000"]);
    assert_eq!(labels(Scale::Linear { min: 0.0, max: 1.0 }), ["0", "1", "0.25", "0.5", "0.75"]);
    for scale in [
        Scale::Linear { min: 3.0, max: 3.0 },
        Scale::Linear { min: f64::NAN, max: 1.0 },
        Scale::Linear { min: f64::MIN, max: f64::MAX },
        Scale::Log { floor: 1e-300, max: 1e300 },
        Scale::Symmetric { limit: f64::INFINITY },
        Scale::Log { floor: 1.0, max: 1.0 },
    ] {
        assert!(scale.ticks().iter().all(|t| (0.0..=1.0).contains(&t.position)), "{scale:?}");
        assert!(scale.ticks().len() < 40);
    }
}
