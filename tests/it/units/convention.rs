use glam::DVec3;
use std::f64::consts::PI;
use warpcheck::domain::{Cell, Disk, Hemisphere, Integrator, Knots, Sphere, Triangle};
use warpcheck::foreign::*;

#[test]
fn frames_invert_and_are_all_different() {
    let all = Frame::all();
    assert_eq!(all.len(), 48);
    let w = DVec3::new(0.1, 0.2, 0.3);
    for (i, frame) in all.iter().enumerate() {
        assert_eq!(frame.to_theirs(frame.to_ours(w)), w);
        assert_eq!(frame.to_string().parse(), Ok(*frame));
        assert!(all[..i].iter().all(|other| other.to_ours(w) != frame.to_ours(w)));
    }
    assert!("x,x,y".parse::<Frame>().is_err() && "x,y".parse::<Frame>().is_err());
}

/// The uniform density of each measure's own coordinates integrates to 1 once it is per the domain's.
#[test]
fn measures_integrate_to_one() {
    fn total<D: Coordinates>(domain: D, measure: Measure, theirs: f64) -> f64 {
        let convention = Convention { measure, ..Convention::new(domain.clone()) };
        let f = |p: &D::Point| convention.density(p, theirs);
        Integrator::default().integrate(&domain, &Cell::whole(&domain), &Knots::default(), f).value
    }
    for (found, name) in [
        (total(Sphere, Measure::Uv, 1.0), "uv"),
        (total(Hemisphere, Measure::Uv, 1.0), "uv"),
        (total(Sphere, Measure::ThetaPhi, 0.5 / (PI * PI)), "theta, phi"),
        (total(Hemisphere, Measure::ProjectedSolidAngle, 1.0 / PI), "projected"),
        (total(Triangle::with_area(3.0), Measure::Uv, 2.0), "triangle"),
        (total(Disk, Measure::RPhi, 0.5 / PI), "disk"),
        (total(Sphere, Measure::Uniform, 1.0), "uniform"),
    ] {
        assert!((found - 1.0).abs() < 1e-6, "{name}: {found}");
    }
}
