//! Phong, GGX and von Mises-Fisher lobes from flat to needle, from above to grazing, and directions that are uniform or weighted by the cosine. Oracles: densities
//! from angles, in `f64`; the quantiles of the polar angle; the part of a Phong lobe under the horizon, by a sum over circles.

use super::{Component, Kind, Reach, Row, Trial, Unit, corner_pairs, lattice, mean};
use crate::estimator::Reflection;
use crate::oracle;
use crate::random::to_f32;
use crate::sampler::{
    CosineHemisphere, Error, GgxVisibleNormals, PhongLobe, UniformHemisphere, UniformSphere, VonMisesFisher,
};
use crate::scene::{Convention, Material};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

const HERE: Component = Component::Lobes;

pub(super) fn rows() -> Vec<Row> {
    let mut rows = phong();
    rows.extend(ggx());
    rows.extend(von_mises_fisher());
    rows.extend(without_parameters());
    rows.extend(dark());
    rows
}

/// Degrees from the normal.
const INCIDENCES: [f64; 4] = [0.0, 85.0, 89.0, 89.99];

/// A unit vector so many degrees from the normal that normalising leaves alone: lobes normalise theirs, and are to be about this very one.
fn tilted(degrees: f64) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let mut w = DVec3::new(0.8 * sin, -0.6 * sin, cos).as_vec3();
    for _ in 0..8 {
        w = w.normalize();
    }
    w
}

/// Variates as a renderer has them.
fn variates(count: u32) -> impl Iterator<Item = Vec2> {
    corner_pairs().chain(lattice(count)).map(|xi| Vec2::from(xi.map(to_f32)))
}

/// What is asked of every lobe: samples are unit vectors above the surface, and the density at them is the oracle's. Variates that give nothing are
/// rejected mass. Returns the share of the lattice that was.
fn judge(
    trial: &mut Trial,
    sample: impl Fn(Vec2) -> Option<Vec3>,
    density: impl Fn(Vec3) -> f32,
    truth: impl Fn(DVec3) -> f64,
) -> f64 {
    judge_within(trial, |w| w.z > 0.0, sample, density, truth)
}

/// The same of directions that lie elsewhere.
fn judge_within(
    trial: &mut Trial,
    within: impl Fn(Vec3) -> bool,
    sample: impl Fn(Vec2) -> Option<Vec3>,
    density: impl Fn(Vec3) -> f32,
    truth: impl Fn(DVec3) -> f64,
) -> f64 {
    const COUNT: u32 = 16_384;
    for xi in variates(COUNT) {
        let Some(w) = sample(xi) else { continue };
        trial.must(within(w) && (w.length() - 1.0).abs() < 3e-7, || format!("xi = {xi} draws {w}"));
        let (found, truth) = (f64::from(density(w)), truth(w.as_dvec3()));
        // Under the least normal number f32 has no digits; the rim of a lobe, xi = 0, is there.
        if truth > f64::from(f32::MIN_POSITIVE) {
            trial.compare(found, truth, || format!("xi = {xi}"));
        } else {
            trial.must(found <= f64::from(f32::MIN_POSITIVE), || {
                format!("xi = {xi}: density {found:e}, truth {truth:e}")
            });
        }
    }
    let drawn = lattice(COUNT).filter_map(|xi| sample(Vec2::from(xi.map(to_f32))));
    let Reach { of, missed, .. } = Reach::told_apart(drawn.map(|w| w.to_array().map(f32::to_bits)));
    // Directions are f32: where variates share one, it is the grid of directions that is too coarse, not the lobe.
    if missed > 0 {
        trial.note(format!("f32 has {} directions for {of} variates", of - missed));
    }
    1.0 - of as f64 / f64::from(COUNT)
}

/// Distinct polar angles of samples whose first variates differ, and their distance from the quantile that `angle` says; all at the normal.
fn quantiles(trial: &mut Trial, sample: impl Fn(f32) -> Option<Vec3>, angle: impl Fn(f64) -> f64) {
    let angles = (0..4096_u16).filter_map(|i| {
        let xi = (f32::from(i) + 0.5) / 4096.0;
        let w = sample(xi)?.as_dvec3();
        let found = w.truncate().length().atan2(w.z);
        trial.compare(found, angle(f64::from(xi)), || format!("xi = {xi}"));
        Some(found.to_bits())
    });
    let reach = Reach::told_apart(angles);
    trial.reach(reach);
}

fn phong() -> Vec<Row> {
    let mut rows = Vec::new();
    for (name, n, allowed) in [
        ("0", 0.0_f32, 2e-6),
        ("1", 1.0, 1e-5),
        ("50", 50.0, 1e-5),
        ("1e4", 1e4, 1e-5),
        ("1e6", 1e6, 1e-5),
        ("1e9", 1e9, 3e-5),
        ("1e21", 1e21, 3e-5),
    ] {
        let kept = f64::from(n.min(PhongLobe::LARGEST_EXPONENT));
        let limit = n > PhongLobe::LARGEST_EXPONENT;
        let kind = if limit { Kind::Limit } else { Kind::Value };
        for incidence in INCIDENCES {
            let ask = move |trial: &mut Trial| {
                let mirror = tilted(incidence);
                let Some(lobe) = trial.accepted(PhongLobe::new(mirror, n)) else { return };
                let truth = |w| oracle::phong(mirror.as_dvec3(), kept, w);
                let rejected = judge(trial, |xi| lobe.sample(xi), |w| lobe.density(w), truth);
                let below = oracle::phong_under_horizon((90.0 - incidence).to_radians(), kept);
                trial.must((rejected - below).abs() < 2e-3, || {
                    format!("{:.2}% are below the horizon, not {:.2}%", 100.0 * rejected, 100.0 * below)
                });
                if below > 1e-4 {
                    trial.note(format!("{:.1}% below the horizon", 100.0 * rejected));
                }
            };
            let should = if limit { "the lobe of 1e9: a mirror" } else { "(n + 1)/2 pi cos^n; share below" };
            let input = format!("Phong {name}, incidence {incidence} deg");
            rows.push(HERE.row(kind, input, should, (allowed, Unit::Relative), ask));
        }
        let ask = move |trial: &mut Trial| {
            let Some(lobe) = trial.accepted(PhongLobe::new(Vec3::Z, n)) else { return };
            quantiles(
                trial,
                |xi| lobe.sample(Vec2::new(xi, 0.125)),
                |xi| {
                    let ln_cosine = xi.ln() / (kept + 1.0);
                    (-(2.0 * ln_cosine).exp_m1()).sqrt().atan2(ln_cosine.exp())
                },
            );
        };
        let should = "cos alpha = xi^(1/(n + 1))";
        rows.push(HERE.row(
            kind,
            format!("Phong {name}, 4096 quantiles"),
            should,
            (2e-6, Unit::Relative),
            ask,
        ));
    }
    for (input, n) in [("Phong -1e-45", -1e-45), ("Phong NaN", f32::NAN), ("Phong infinite", f32::INFINITY)] {
        rows.push(HERE.row(
            Kind::Refusal,
            input,
            "names the exponent",
            (0.0, Unit::Absolute),
            move |trial| {
                trial.refused(PhongLobe::new(Vec3::Z, n), |e| {
                    matches!(e, Error::Parameter { parameter: "exponent", .. })
                });
            },
        ));
    }
    rows
}

fn ggx() -> Vec<Row> {
    let mut rows = Vec::new();
    for alpha in [1e-4_f32, 1e-2, 0.1, 1.0] {
        for incidence in INCIDENCES {
            let ask = move |trial: &mut Trial| {
                let outgoing = tilted(incidence);
                let Some(lobe) = trial.accepted(GgxVisibleNormals::new(outgoing, alpha)) else { return };
                let truth = |w| oracle::ggx_reflected(outgoing.as_dvec3(), f64::from(alpha), w);
                let rejected = judge(trial, |xi| lobe.sample(xi), |w| lobe.density(w), truth);
                if rejected > 5e-4 {
                    trial.note(format!("{:.1}% below the horizon", 100.0 * rejected));
                }
            };
            let input = format!("GGX {alpha:e}, incidence {incidence} deg");
            rows.push(HERE.row(Kind::Value, input, "G1 D / (4 cos theta)", (2e-6, Unit::Relative), ask));
        }
        let ask = move |trial: &mut Trial| {
            let Some(lobe) = trial.accepted(GgxVisibleNormals::new(Vec3::Z, alpha)) else { return };
            // tan^2 theta_m = a^2 xi / (1 - xi); a normal beyond 45 degrees reflects under the surface.
            quantiles(
                trial,
                |xi| lobe.sample(Vec2::new(0.125, xi)),
                |xi| 2.0 * (f64::from(alpha) * (xi / (1.0 - xi)).sqrt()).atan(),
            );
        };
        let should = "tan^2 theta_m = a^2 xi/(1 - xi)";
        rows.push(HERE.row(
            Kind::Value,
            format!("GGX {alpha:e}, 4096 quantiles"),
            should,
            (2e-6, Unit::Relative),
            ask,
        ));
    }
    let z = |z: f32| Vec3::new((1.0 - z * z).sqrt(), 0.0, z);
    for (input, outgoing) in
        [("incidence 90 deg", z(0.0)), ("from below", z(-1e-7)), ("from straight below", Vec3::NEG_Z)]
    {
        rows.push(HERE.row(
            Kind::Refusal,
            format!("GGX, {input}"),
            "names the cosine",
            (0.0, Unit::Absolute),
            move |trial| {
                let right = |e: &Error| {
                    matches!(e, Error::Parameter { parameter: "cosine of the outgoing direction", .. })
                };
                trial.refused(GgxVisibleNormals::new(outgoing, 0.3), right);
            },
        ));
    }
    rows
}

fn von_mises_fisher() -> Vec<Row> {
    let mut rows = Vec::new();
    // What f32 makes of the lengths of both vectors counts kappa times, as it does for Phong.
    for (kappa, allowed) in [(1e-3_f32, 1e-5), (1.0, 1e-5), (100.0, 1e-5), (1e6, 1e-5), (1e9, 3e-5)] {
        let exact = f64::from(kappa);
        let ask = move |trial: &mut Trial| {
            let mean = tilted(85.0);
            let Some(lobe) = trial.accepted(VonMisesFisher::new(mean, kappa)) else { return };
            let truth = |w| oracle::von_mises_fisher(mean.as_dvec3(), exact, w);
            judge_within(trial, |_| true, |xi| Some(lobe.sample(xi)), |w| lobe.density(w), truth);
        };
        let input = format!("von Mises-Fisher {kappa:e}");
        let should = "k e^(k cos alpha)/(4 pi sinh k)";
        rows.push(HERE.row(Kind::Value, input, should, (allowed, Unit::Relative), ask));
        let ask = move |trial: &mut Trial| {
            let Some(lobe) = trial.accepted(VonMisesFisher::new(Vec3::Z, kappa)) else { return };
            // Of the cosine c, (1 - e^(-k (1 - c))) / (1 - e^(-2 k)) is left above it.
            let half_chord = |xi: f64| (-0.5 * (xi * (-2.0 * exact).exp_m1()).ln_1p() / exact).sqrt();
            quantiles(trial, |xi| Some(lobe.sample(Vec2::new(xi, 0.125))), |xi| 2.0 * half_chord(xi).asin());
        };
        let input = format!("von Mises-Fisher {kappa:e}, 4096 quantiles");
        rows.push(HERE.row(
            Kind::Value,
            input,
            "inverse of the CDF of cos alpha",
            (2e-6, Unit::Relative),
            ask,
        ));
    }
    for (input, kappa) in [("0", 0.0), ("-1", -1.0), ("NaN", f32::NAN), ("infinite", f32::INFINITY)] {
        let ask = move |trial: &mut Trial| {
            trial.refused(VonMisesFisher::new(Vec3::Z, kappa), |e| {
                matches!(e, Error::Parameter { parameter: "kappa", .. })
            });
        };
        let input = format!("von Mises-Fisher {input}");
        rows.push(HERE.row(Kind::Refusal, input, "names kappa", (0.0, Unit::Absolute), ask));
    }
    rows
}

/// Directions whose only extremes are those of the variates: density and quantiles of each.
fn without_parameters() -> Vec<Row> {
    /// A sampler's name, where it draws, its samples and density, the true density, and the quantiles of theta.
    struct Directions {
        name: &'static str,
        within: fn(Vec3) -> bool,
        sample: fn(Vec2) -> Vec3,
        density: fn(Vec3) -> f32,
        truth: fn(DVec3) -> f64,
        angle: fn(f64) -> f64,
    }
    let all = [
        Directions {
            name: "uniform on the sphere",
            within: |_| true,
            sample: |xi| UniformSphere.sample(xi),
            density: |w| UniformSphere.density(w),
            truth: |_| 1.0 / (4.0 * PI),
            angle: |xi| 2.0 * xi.sqrt().asin(),
        },
        Directions {
            name: "uniform on the hemisphere",
            within: |w| w.z > 0.0,
            sample: |xi| UniformHemisphere.sample(xi),
            density: |w| UniformHemisphere.density(w),
            truth: |_| 1.0 / (2.0 * PI),
            angle: |xi| 2.0 * (0.5 * xi).sqrt().asin(),
        },
        Directions {
            name: "cosine-weighted",
            within: |w| w.z > 0.0,
            sample: |xi| CosineHemisphere.sample(xi),
            density: |w| CosineHemisphere.density(w),
            truth: oracle::cosine,
            angle: |xi| xi.sqrt().asin(),
        },
    ];
    let rows_of = |directions: Directions| {
        let Directions { name, within, sample, density, truth, angle } = directions;
        let of_densities = move |trial: &mut Trial| {
            judge_within(trial, within, |xi| Some(sample(xi)), density, truth);
        };
        let of_quantiles =
            move |trial: &mut Trial| quantiles(trial, |xi| Some(sample(Vec2::new(xi, 0.125))), angle);
        let allowed = (2e-6, Unit::Relative);
        [
            HERE.row(Kind::Value, name, "density of the oracle", allowed, of_densities),
            HERE.row(
                Kind::Value,
                format!("{name}, 4096 quantiles"),
                "inverse of the CDF of theta",
                allowed,
                of_quantiles,
            ),
        ]
    };
    all.into_iter().flat_map(rows_of).collect()
}

/// A material that is looked at edge-on, or from below.
fn dark() -> Vec<Row> {
    let material =
        |ks: f32, ns: f32| Material { kd: Vec3::splat(0.5), ks: Vec3::splat(ks), ns, ..Material::default() };
    let row_of = move |(input, z): (&str, f32)| {
        let ask = move |trial: &mut Trial| {
            let out = Vec3::new(-(1.0 - z * z).sqrt(), 0.0, z);
            let ggx = |roughness| Material { roughness: Some(roughness), ..material(0.5, 1.0) };
            let phong = [0.0, 0.5, 0.5, 0.5].into_iter().zip([1.0, 1.0, 50.0, 1e21]);
            for material in phong.map(|(ks, ns)| material(ks, ns)).chain([1e-4, 0.3, 1.0].map(ggx)) {
                let brdf = Reflection::new(&material, Convention::Mtl).seen_from(out);
                for xi in variates(256) {
                    let drawn = brdf.sample([0.3, xi.x, xi.y]);
                    trial.must(drawn.is_none(), || format!("xi = {xi} draws {drawn:?}"));
                }
                for w in lattice(256).map(|[a, b]| Vec3::new(a as f32 - 0.5, b as f32 - 0.5, 0.5).normalize())
                {
                    let (value, density) = brdf.evaluate(w);
                    trial.must(value == Vec3::ZERO, || format!("{w}: reflects {value}"));
                    trial.compare(density.into(), 0.0, || w);
                }
            }
        };
        HERE.row(
            Kind::Limit,
            format!("diffuse + Phong or GGX, {input}"),
            "black, pdf 0, no sample",
            (0.0, Unit::Absolute),
            ask,
        )
    };
    let mut rows: Vec<Row> = [
        ("incidence 90 deg", 0.0),
        ("incidence 90 deg, -0.0", -0.0),
        ("from below", -1e-7),
        ("from straight below", -1.0),
    ]
    .map(row_of)
    .into();
    rows.push(HERE.row(
        Kind::Value,
        "diffuse + Phong 50, incidence 89.99 deg",
        "f/p has the albedo as its mean",
        (1e-3, Unit::Relative),
        |trial| {
            // What a diffuse lobe reflects does not depend on the incidence: drawn by the mixture, whose density is exact.
            let material =
                Material { kd: Vec3::splat(0.5), ks: Vec3::splat(0.25), ns: 50.0, ..Material::default() };
            let brdf = Reflection::new(&material, Convention::Mtl).seen_from(tilted(89.99));
            let diffuse = f64::from(0.5 * std::f32::consts::FRAC_1_PI);
            let picks = 15_u8; // a third of them to the lobe, as its share is
            let terms = (0..picks).flat_map(|pick| lattice(65_536).map(move |xi| (pick, xi)));
            let albedo = mean(terms.map(|(pick, [a, b])| {
                let pick = (f32::from(pick) + 0.5) / f32::from(picks);
                brdf.sample([pick, to_f32(a), to_f32(b)])
                    .map_or(0.0, |w| diffuse * f64::from(w.z / brdf.evaluate(w).1))
            }));
            trial.compare(albedo, 0.5, || "diffuse part");
        },
    ));
    rows
}
