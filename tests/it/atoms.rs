//! Mixtures with delta parts: a smooth conductor over a diffuse base, right and wrong.

use glam::{DVec3, Vec3};
use warpcheck::domain::{Hemisphere, Mixed, WithAtoms};
use warpcheck::sampler::*;
use warpcheck::verify;
use warpcheck::verify::{Report, Verdict};

const MIRROR: f32 = 0.3;

fn run<S: Sampler>(sampler: &S) -> Report {
    verify(sampler).samples(200_000).seed(5).run()
}

fn domain() -> WithAtoms<Hemisphere> {
    WithAtoms::named(Hemisphere, ["the mirror direction"])
}

fn draw(probability: f32) -> impl Fn([f32; 3]) -> Mixed<Vec3> + Sync {
    move |[pick, u, v]| {
        if pick < probability {
            Mixed::Atom(0)
        } else {
            Mixed::Continuous(CosineHemisphere.sample([u, v].into()))
        }
    }
}

fn density(w: Mixed<Vec3>) -> f32 {
    match w {
        Mixed::Atom(_) => MIRROR,
        Mixed::Continuous(w) => (1.0 - MIRROR) * CosineHemisphere.density(w),
    }
}

#[track_caller]
fn fails_by(report: &Report, check: &str) {
    let caught = |c: &verify::Conclusion| c.verdict == Verdict::Fail && c.finding.check == check;
    assert!(report.conclusions[0].iter().any(caught), "not caught by {check}:\n{report}");
}

#[test]
fn a_right_mixture_passes() {
    let report = run(&from_fn(domain(), draw(MIRROR), density));
    report.assert();
    // The density comes along, or the sample is rejected.
    run(&from_fn(
        domain(),
        |xi: [f32; 3]| {
            let w = draw(MIRROR)(xi);
            (w, density(w))
        },
        density,
    ))
    .assert();
    let half = |xi: [f32; 3]| Some(draw(MIRROR)(xi)).filter(|w| matches!(w, Mixed::Atom(0)) || xi[2] < 0.5);
    let half_density = |w: Mixed<Vec3>| match w {
        Mixed::Continuous(w) if w.y < 0.0 => 0.0,
        w => density(w),
    };
    run(&from_fn(domain(), half, half_density)).assert();
}

#[test]
fn the_helper_is_right_and_nests() {
    for c in [0.0, 0.001, 0.3] {
        run(&WithDelta::new(c, "mirror", CosineHemisphere).unwrap()).assert();
    }
    // One atom and nothing else leaves nothing to compare.
    assert_eq!(
        run(&WithDelta::new(1.0, "mirror", CosineHemisphere).unwrap()).verdict(),
        Verdict::Inconclusive
    );
    let two = WithDelta::new(0.2, "light", WithDelta::new(0.3, "mirror", CosineHemisphere).unwrap()).unwrap();
    assert_eq!(two.density(&Mixed::Continuous(Mixed::Atom(0))), 0.8 * 0.3);
    run(&two).assert();
    assert!(WithDelta::new(1.5, "mirror", CosineHemisphere).is_err());
    // Knots of the map must not cut the atom.
    let texels = (0..16 * 8).map(|i| [(i % 5) as f32; 3]).collect();
    let map = Environment::new(16, 8, texels, RowWarp::UniformV).unwrap();
    run(&WithDelta::new(0.4, "sun", map).unwrap()).assert();
}

#[test]
fn many_atoms_some_never_drawn() {
    let domain = WithAtoms::new(Hemisphere, 40);
    let sampler = from_fn(
        domain,
        |[pick, u, v]: [f64; 3]| {
            if pick < 0.5 {
                Mixed::Atom((pick * 2.0 * 20.0) as usize * 2)
            } else {
                Mixed::Continuous(UniformHemisphere.sample([u as f32, v as f32].into()).as_dvec3())
            }
        },
        |w: Mixed<DVec3>| match w {
            Mixed::Atom(i) => {
                if i % 2 == 0 {
                    0.5 / 20.0
                } else {
                    0.0
                }
            }
            Mixed::Continuous(_) => 0.25 / std::f64::consts::PI,
        },
    );
    run(&sampler).assert();
}

#[test]
fn a_wrong_delta_probability_is_caught() {
    fails_by(&run(&from_fn(domain(), draw(1.07 * MIRROR), density)), "chi-square");
}

#[test]
fn a_delta_added_to_the_continuous_density_is_caught() {
    let added = |w: Mixed<Vec3>| match w {
        Mixed::Atom(_) => MIRROR,
        Mixed::Continuous(w) => MIRROR + (1.0 - MIRROR) * CosineHemisphere.density(w),
    };
    fails_by(&run(&from_fn(domain(), draw(MIRROR), added)), "normalisation");
    // Only in the density that comes with the sample.
    let returned = |xi: [f32; 3]| {
        let w = draw(MIRROR)(xi);
        (w, added(w))
    };
    fails_by(&run(&from_fn(domain(), returned, density)), "agreement");
}

#[test]
fn an_atom_out_of_range_is_named() {
    let report = run(&from_fn(domain(), |_: [f32; 1]| Mixed::<Vec3>::Atom(1), density));
    fails_by(&report, "support");
    assert!(format!("{report}").contains("is atom 1 of 1"), "{report}");
}

#[test]
fn pictures_leave_atoms_out() {
    let sampler = WithDelta::new(0.5, "mirror", CosineHemisphere).unwrap();
    let examination = verify(&sampler).samples(100_000).examine();
    let map = examination.map(64);
    let shown: f64 = map.observed.iter().filter(|v| v.is_finite()).sum::<f64>() * 8.0 / (64.0 * 64.0);
    assert!((shown - 0.5).abs() < 0.02, "{shown}");
    assert!(examination.cells.iter().any(|c| c.place == "mirror"));
}
