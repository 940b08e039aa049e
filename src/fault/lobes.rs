//! Lobes, and mixtures of them.

use super::{Fault, Specimen, Trial, Twin};
use crate::domain::{Hemisphere, Sphere};
use crate::random::{SplitMix64, to_f32, unit_f64};
use crate::sampler::{
    CosineHemisphere, Frame, GgxVisibleNormals, Mixture, PhongLobe, Sampler, UniformHemisphere,
    VonMisesFisher, from_fn,
};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};

/// 37 degrees from the normal.
const TILTED: Vec3 = Vec3::new(0.36, -0.48, 0.8);
/// 70 degrees from the normal.
const LOW: Vec3 = Vec3::new(0.0, 0.939_692_6, 0.342_020_14);
/// 85 degrees from the normal.
const GRAZING: Vec3 = Vec3::new(0.996_194_7, 0.0, 0.087_155_74);

fn phong(mirror: Vec3, exponent: f32) -> PhongLobe {
    PhongLobe::new(mirror, exponent).expect("a lobe")
}

fn ggx(alpha: f32) -> GgxVisibleNormals {
    GgxVisibleNormals::new(TILTED, alpha).expect("a lobe")
}

fn uniform_density(_: Vec3) -> f32 {
    UniformHemisphere.density(Vec3::Z)
}

/// GGX's G1 of the outgoing direction.
fn masking(alpha: f32) -> f64 {
    let (z, slope) =
        (f64::from(TILTED.z), f64::from(alpha * alpha) * TILTED.truncate().length_squared() as f64);
    2.0 * z / (z + (z * z + slope).sqrt())
}

/// The lobe's samples, with a density made of the right one.
fn claiming<S>(lobe: S, claim: impl Fn(&S, DVec3) -> f64 + Send + Sync + 'static) -> Trial<Hemisphere>
where
    S: Sampler<Domain = Hemisphere> + Copy + Send + 'static,
{
    let claimed = move |w: DVec3| claim(&lobe, w);
    Trial::new(from_fn(Hemisphere, move |xi: [f64; 2]| lobe.sample(&xi).map(|s| s.point), claimed))
}

const COSINE: Twin = Twin::new("cosine-weighted hemisphere", || Specimen::sampler(CosineHemisphere));
const UNIFORM: Twin = Twin::new("uniform hemisphere", || Specimen::sampler(UniformHemisphere));
const PHONG: Twin = Twin::new("Phong lobe, exponent 50", || Specimen::sampler(phong(TILTED, 50.0)));
const FRACTIONAL: Twin = Twin::new("Phong lobe, exponent 2.5", || Specimen::sampler(phong(TILTED, 2.5)));
const PHONG_GRAZING: Twin = Twin::new("Phong lobe at 85 degrees", || Specimen::sampler(phong(GRAZING, 50.0)));
const GGX: Twin = Twin::new("GGX visible normals, alpha 0.5", || Specimen::sampler(ggx(0.5)));
const GGX_QUARTER: Twin = Twin::new("GGX visible normals, alpha 0.25", || Specimen::sampler(ggx(0.25)));
const MIXED: Twin = Twin::new("half cosine, half uniform", || Specimen::sampler(mixed(0.5)));
const PLASTIC: Twin = Twin::new("seven tenths cosine, three tenths Phong 20 at 70 degrees", || {
    Specimen::sampler(Mixture::new(0.7, CosineHemisphere, phong(LOW, 20.0)).expect("a share"))
});

fn mixed(c: f64) -> Mixture<CosineHemisphere, UniformHemisphere> {
    Mixture::new(c, CosineHemisphere, UniformHemisphere).expect("a share")
}

/// The roughness of the Beckmann normals.
const BECKMANN: f64 = 0.4;

/// Half-vectors of a Beckmann distribution (Walter et al. 2007, eq. 25 and 28): tan^2 theta = -alpha^2 ln(1 - xi0), density D cos theta.
fn beckmann(tangent: fn(f64) -> f64) -> Specimen {
    Specimen::sampler(from_fn(
        Hemisphere,
        move |[a, b]: [f64; 2]| {
            let tangent = tangent(-BECKMANN * BECKMANN * (-a).ln_1p());
            let (cos, phi) = (1.0 / tangent.hypot(1.0), TAU * b);
            DVec3::new(tangent * cos * phi.cos(), tangent * cos * phi.sin(), cos)
        },
        |m: DVec3| {
            let (squared, a2) = (m.truncate().length_squared() / (m.z * m.z), BECKMANN * BECKMANN);
            if m.z > 0.0 { (-squared / a2).exp() / (PI * a2 * m.z.powi(3)) } else { 0.0 }
        },
    ))
}

/// The concentration of the narrow lobe, about 1/20 of a degree wide.
const KAPPA: f32 = 1e6;

fn narrow() -> VonMisesFisher {
    VonMisesFisher::new(TILTED, KAPPA).expect("a concentration")
}

const NARROW: Twin = Twin::new("von Mises-Fisher, kappa 1e6", || Specimen::sampler(narrow()));

const NORMALS: Twin = Twin::new("Beckmann normals", || beckmann(f64::sqrt));

/// Directions within 50 degrees of the normal.
const CONE: f64 = 50.0 / 180.0 * PI;

fn cone(cosine: fn(f64) -> f64) -> Specimen {
    Specimen::sampler(
        from_fn(
            Hemisphere,
            move |[a, b]: [f64; 2]| {
                let (cos, phi) = (cosine(a), TAU * b);
                let sin = (1.0 - cos * cos).sqrt();
                DVec3::new(sin * phi.cos(), sin * phi.sin(), cos)
            },
            |w: DVec3| if w.z >= CONE.cos() { 1.0 / (TAU * (1.0 - CONE.cos())) } else { 0.0 },
        )
        .with_knots(crate::domain::Knots::grid(9, 1)),
    )
}

const UNIFORM_CONE: Twin = Twin::new("uniform cone", || cone(|xi| 1.0 - xi * (1.0 - CONE.cos())));

pub(super) fn faults() -> Vec<Fault> {
    vec![
        Fault::new(
            "lobes/cosine-for-uniform",
            "cosine-weighted samples with the density of uniform ones",
            COSINE,
            || {
                Specimen::sampler(from_fn(
                    Hemisphere,
                    |xi: Vec2| CosineHemisphere.sample(xi),
                    uniform_density,
                ))
            },
        )
        .seen("RayTracing/raytracing.github.io #933")
        .caught(&["chi-square"], &["lacks cos theta", "cosine-weighted"]),
        Fault::new(
            "lobes/uniform-for-cosine",
            "uniform samples with the density of cosine weighting",
            UNIFORM,
            || {
                Specimen::sampler(from_fn(
                    Hemisphere,
                    |xi: Vec2| UniformHemisphere.sample(xi),
                    |w: Vec3| CosineHemisphere.density(w),
                ))
            },
        )
        .seen("RayTracing/raytracing.github.io #145 is of the kind")
        .caught(&["chi-square"], &["extra cos theta", "uniform"]),
        Fault::new(
            "lobes/n-plus-2",
            "the Phong lobe is normalised by n + 2, as its reflectance is",
            PHONG,
            || claiming(phong(TILTED, 50.0), |lobe, w| Sampler::density(lobe, &w) * 52.0 / 51.0).into(),
        )
        .seen("wdas/brdf PR 8")
        .caught(&["normalisation", "chi-square", "jacobian"], &["constant (n + 2) / (n + 1), n = 50"]),
        Fault::new(
            "lobes/half-vector-jacobian",
            "the density of the half vector is not divided by 4 (w_o . w_h)",
            GGX,
            || {
                let four = |w: DVec3| 4.0 * TILTED.as_dvec3().dot((w + TILTED.as_dvec3()).normalize());
                claiming(ggx(0.5), move |lobe, w| Sampler::density(lobe, &w) * four(w))
                    .rival("divided by 4 (w_o . w_h)", |w| Sampler::density(&ggx(0.5), w))
                    .into()
            },
        )
        .seen("google/filament #6294")
        .caught(&["chi-square", "jacobian"], &["divided by 4 (w_o . w_h)"]),
        Fault::new(
            "lobes/roughness-squared-twice",
            "the density squares a roughness that is squared already",
            GGX,
            || {
                claiming(ggx(0.5), |_, w| Sampler::density(&ggx(0.25), &w))
                    .rival("the roughness not squared again", |w| Sampler::density(&ggx(0.5), w))
                    .into()
            },
        )
        .seen("NVIDIAGameWorks/Falcor #212")
        .caught(&["chi-square"], &["the roughness not squared again"]),
        Fault::new("lobes/masking-missing", "the density of visible normals lacks G1", GGX, || {
            claiming(ggx(0.5), |lobe, w| Sampler::density(lobe, &w) / masking(0.5)).into()
        })
        .seen("NVIDIA-RTX/Donut #23, Devsh-Graphics-Programming/Nabla (then IrrlichtBAW) PR 524")
        .caught(&["normalisation", "chi-square", "jacobian"], &["constant"]),
        Fault::new("lobes/beckmann-tangent", "the tangent of the half vector is its square", NORMALS, || {
            beckmann(|squared| squared)
        })
        .seen("Twinklebear/ChameleonRT #22 (GTR2, where the cosine lacks its root)")
        .caught(&["chi-square"], &[])
        .held_back(),
        Fault::new(
            "lobes/drawn-again",
            "a sample under the surface is silently drawn again",
            PHONG_GRAZING,
            || {
                let lobe = phong(GRAZING, 50.0);
                let again = move |[a, b, c]: [f64; 3]| {
                    // Tries of their own, from the bits of the last variate.
                    let mut rng = SplitMix64::from_variate(c);
                    let mut fresh = || Vec2::new(to_f32(unit_f64(&mut rng)), to_f32(unit_f64(&mut rng)));
                    let first = lobe.sample(Vec2::new(to_f32(a), to_f32(b)));
                    first.or_else(|| (0..64).find_map(|_| lobe.sample(fresh())))
                };
                Specimen::sampler(from_fn(Hemisphere, again, move |w: Vec3| lobe.density(w)))
            },
        )
        .seen(
            "pyne/pyne PR 556 (a particle that starts in a void is drawn again, 'not statistically correct')",
        )
        .caught(&["chi-square"], &["rejected samples drawn again"]),
        Fault::new(
            "lobes/pow-of-a-negative",
            "the cosine to a fractional exponent, negative behind the lobe",
            FRACTIONAL,
            || {
                claiming(phong(TILTED, 2.5), |_, w| {
                    let cosine = w.dot(TILTED.as_dvec3().normalize());
                    3.5 / TAU * cosine.powf(2.5)
                })
                .into()
            },
        )
        .seen("JoeyDeVries/LearnOpenGL #217")
        .caught(&["normalisation"], &["density not finite"])
        .held_back(),
        Fault::new(
            "lobes/chosen-lobe-only",
            "a mixture returns the density of the lobe that was chosen",
            MIXED,
            || {
                Specimen::sampler(from_fn(
                    Hemisphere,
                    |[pick, a, b]: [f32; 3]| {
                        let xi = Vec2::new(a, b);
                        if pick < 0.5 {
                            let w = CosineHemisphere.sample(xi);
                            (w, CosineHemisphere.density(w))
                        } else {
                            let w = UniformHemisphere.sample(xi);
                            (w, UniformHemisphere.density(w))
                        }
                    },
                    |w: Vec3| 0.5 * (CosineHemisphere.density(w) + UniformHemisphere.density(w)),
                ))
            },
        )
        .seen("mitsuba-renderer/mitsuba3 PR 1681 (blendbsdf)")
        .caught(&["agreement"], &["chosen part only"]),
        Fault::new(
            "lobes/selection-off-by-7-percent",
            "sample and density choose lobes with other probabilities",
            MIXED,
            || {
                Specimen::sampler(from_fn(
                    Hemisphere,
                    |xi: [f64; 3]| mixed(0.535).sample(&xi).map(|s| s.point),
                    |w: DVec3| mixed(0.5).density(&w),
                ))
            },
        )
        .seen("gkjohnson/three-gpu-pathtracer #847 (a ratio of 0.93)")
        .caught(&["chi-square", "distribution", "scan"], &["share of cosine-weighted", "share of uniform"]),
        Fault::new(
            "lobes/choice-depends-on-the-sample",
            "Fresnel's term of the sampled direction decides which lobe it was",
            PLASTIC,
            || {
                let lobe = phong(LOW, 20.0);
                let fresnel = |cosine: f32| 0.2 + 0.8 * (1.0 - cosine).powi(5);
                Specimen::sampler(from_fn(
                    Hemisphere,
                    move |[pick, a, b, c, d]: [f32; 5]| match lobe.sample(Vec2::new(a, b)) {
                        Some(w) if pick < fresnel(w.z) => Some(w),
                        None if pick < fresnel(LOW.z) => None,
                        _ => Some(CosineHemisphere.sample(Vec2::new(c, d))),
                    },
                    move |w: Vec3| {
                        let share = fresnel(LOW.z);
                        share * lobe.density(w) + (1.0 - share) * CosineHemisphere.density(w)
                    },
                ))
            },
        )
        .seen("OpenShadingLanguage PR 2158, knightcrawler25/GLSL-PathTracer #72")
        .caught(&["chi-square"], &[])
        .held_back(),
        Fault::new(
            "lobes/cone-uniform-in-angle",
            "directions of a cone are uniform in the angle, not in its cosine",
            UNIFORM_CONE,
            || cone(|xi| (CONE * xi).cos()),
        )
        .seen("maximeraafat/BlenderNeRF PR 38 (the same on a sphere)")
        .caught(&["chi-square"], &["extra sin theta", "uniform in theta and phi"]),
        Fault::new(
            "lobes/eight-bit-variates",
            "variates of 8 bits, as a texture of noise has them: 65,536 directions",
            COSINE,
            || {
                let texel = |xi: f64| ((256.0 * xi).floor() + 0.5) / 256.0;
                Specimen::sampler(from_fn(
                    Hemisphere,
                    move |[a, b]: [f64; 2]| {
                        CosineHemisphere.sample(Vec2::new(texel(a) as f32, texel(b) as f32))
                    },
                    |w: Vec3| CosineHemisphere.density(w),
                ))
            },
        )
        .seen("brian-team/brian2 #222 is of the kind (15 bits of rand)")
        .caught(&["repeats", "chi-square"], &["few points"]),
        Fault::new(
            "lobes/von-mises-fisher-by-cosine",
            "1 + ln(xi + (1 - xi) e^(-2 kappa)) / kappa in f32 leaves a narrow lobe a few rings",
            NARROW,
            || {
                let right = narrow();
                let frame = Frame::new(TILTED);
                Specimen::sampler(from_fn(
                    Sphere,
                    move |[a, b]: [f32; 2]| {
                        // xi = 0 would be another mistake: the logarithm of 0.
                        let cos = 1.0 + (a + f32::EPSILON).ln() / KAPPA;
                        let sin = (1.0 - cos * cos).max(0.0).sqrt();
                        let phi = std::f32::consts::TAU * b;
                        frame.to_world(Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)).normalize()
                    },
                    move |w: Vec3| right.density(w),
                ))
            },
        )
        .seen("numpy/numpy #17275 (von Mises samples of a large kappa look like a Cantor set)")
        .caught(&["chi-square"], &[]),
        Fault::new(
            "lobes/tails-of-another-roughness",
            "samples of one roughness, the density of a slightly larger one",
            GGX_QUARTER,
            || {
                claiming(ggx(0.25), |_, w| Sampler::density(&ggx(0.26), &w))
                    .rival("the roughness of the sampler", |w| Sampler::density(&ggx(0.25), w))
                    .into()
            },
        )
        .seen("appleseedhq/appleseed #1347 clamps roughness in one place")
        .caught(&["chi-square"], &["the roughness of the sampler"]),
    ]
}
