//! Samplers broken in ways that are known are told apart by what is wrong with them; what nobody knows is not called by a name.

use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};
use warpcheck::domain::{
    Discrete, Disk, Domain, Hemisphere, Interval, Knots, MeshSurface, Sphere, Square, SurfacePoint, Triangle,
};
use warpcheck::sampler::*;
use warpcheck::verify;
use warpcheck::verify::{Diagnosis, Verdict};

const SAMPLES: u64 = 100_000;
const SEED: u64 = 11;

// Boxed, so that the checks are compiled once a domain and not once a sampler.
type Sample<'a, P> = Box<dyn Fn([f64; 4]) -> Option<P> + Sync + 'a>;
type Density<'a, P> = Box<dyn Fn(P) -> f64 + Sync + 'a>;

/// What should be said of a sampler, and what was.
struct Outcome {
    name: &'static str,
    expected: &'static [&'static str],
    diagnosis: Option<Diagnosis>,
}

struct Bench<D> {
    domain: D,
    knots: Knots,
    outcomes: Vec<Outcome>,
    /// Every `step`th of those that are named is asked.
    step: usize,
    named: usize,
}

impl<D: Domain> Bench<D>
where
    D::Point: IntoDraw<D::Point> + FromPoint<D::Point>,
    Option<D::Point>: IntoDraw<D::Point>,
{
    fn new(domain: D) -> Self {
        Self { domain, knots: Knots::default(), outcomes: Vec::new(), step: 1, named: 0 }
    }

    fn every(self, step: usize) -> Self {
        Self { step, ..self }
    }

    fn diagnose(
        &self,
        sample: impl Fn([f64; 4]) -> Option<D::Point> + Sync,
        density: impl Fn(D::Point) -> f64 + Sync,
    ) -> (Verdict, Option<Diagnosis>) {
        self.diagnose_boxed(Box::new(sample), Box::new(density))
    }

    fn diagnose_boxed(
        &self,
        sample: Sample<'_, D::Point>,
        density: Density<'_, D::Point>,
    ) -> (Verdict, Option<Diagnosis>) {
        let sampler = from_fn(self.domain.clone(), sample, density).with_knots(self.knots.clone());
        // Without what rests on quadrature where others fail too: it is made again where it is doubted, which takes far longer than the diagnosis.
        let run = |without: &[&str]| {
            let run = verify(&sampler).samples(SAMPLES).seed(SEED);
            without.iter().fold(run, |run, check| run.without(check)).run()
        };
        let mut report = run(&["normalisation", "chi-square", "distribution"]);
        if report.verdict() == Verdict::Pass {
            report = run(&[]);
        }
        (report.verdict(), report.examinations[0].diagnosis.clone())
    }

    #[track_caller]
    fn broken(
        &mut self,
        name: &'static str,
        expected: &'static [&'static str],
        sample: impl Fn([f64; 4]) -> Option<D::Point> + Sync,
        density: impl Fn(D::Point) -> f64 + Sync,
    ) {
        self.named += 1;
        if !self.named.is_multiple_of(self.step) {
            return;
        }
        let (verdict, diagnosis) = self.diagnose(sample, density);
        assert_eq!(verdict, Verdict::Fail, "{name} is not caught");
        self.outcomes.push(Outcome { name, expected, diagnosis });
    }
}

/// Says what was diagnosed wrongly; at least `least` must be right.
#[track_caller]
fn judge(outcomes: &[Outcome], least: f64) {
    let mut right = 0;
    let mut lines = String::new();
    for outcome in outcomes {
        let good = outcome.diagnosis.as_ref().is_some_and(|d| outcome.expected.iter().any(|name| d.is(name)));
        right += usize::from(good);
        let said = outcome.diagnosis.as_ref().map_or("nothing", |d| &d.text);
        lines += &format!("{} {}: {said}\n", if good { "right" } else { "WRONG" }, outcome.name);
    }
    println!("{right} of {}\n{lines}", outcomes.len());
    assert!(right as f64 >= least * outcomes.len() as f64, "{right} of {}\n{lines}", outcomes.len());
}

fn weights() -> Vec<f64> {
    let raw: Vec<f64> = (0..40).map(|i| f64::from(1 + (i * 7 + 3) % 11)).collect();
    let sum: f64 = raw.iter().sum();
    raw.iter().map(|w| w / sum).collect()
}

fn search(weights: &[f64], xi: f64) -> usize {
    let mut sum = 0.0;
    let found = weights.iter().position(|w| {
        sum += w;
        xi < sum
    });
    found.unwrap_or(weights.len() - 1)
}

#[test]
fn discrete() {
    let p = weights();
    let n = p.len();
    let density = |i: usize| p[i];
    let mut bench = Bench::new(Discrete::new(n));
    let index = |xi: f64| search(&p, xi);
    bench.broken(
        "off by one, down",
        &["index one too small"],
        |[xi, ..]| Some(index(xi).saturating_sub(1)),
        density,
    );
    bench.broken(
        "off by one, up",
        &["index one too large"],
        |[xi, ..]| Some((index(xi) + 1).min(n - 1)),
        density,
    );
    bench.broken(
        "off by one, around",
        &["index one too large, wrapped around"],
        |[xi, ..]| Some((index(xi) + 1) % n),
        density,
    );
    bench.broken("reversed", &["indices reversed"], |[xi, ..]| Some(n - 1 - index(xi)), density);
    bench.broken("weights ignored", &["uniform"], |[xi, ..]| Some((xi * n as f64) as usize), density);
    let sum: f64 = p.iter().map(|w| w * w).sum();
    let squares: Vec<f64> = p.iter().map(|w| w * w / sum).collect();
    bench.broken("weights squared", &["density squared"], |[xi, ..]| Some(search(&squares, xi)), density);
    bench.broken("weights never normalised", &["constant 2"], |[xi, ..]| Some(index(xi)), |i| 2.0 * p[i]);
    // The table was built for a total that has shrunk since.
    let stale: Vec<f64> = p.iter().map(|w| 0.97 * w).collect();
    bench.broken(
        "stale total",
        &["the rest goes to the last entry"],
        |[xi, ..]| Some(search(&stale, xi)),
        density,
    );
    bench.broken(
        "the last ten never",
        &["absorbed tail"],
        |[xi, ..]| Some(search(&p[..30], xi * p[..30].iter().sum::<f64>())),
        density,
    );
    bench.broken(
        "half of the entries weighted twice",
        &["step along the index"],
        |[xi, ..]| {
            let weighted: Vec<f64> =
                p.iter().enumerate().map(|(i, w)| if i < 17 { 2.0 * w } else { *w }).collect();
            let sum: f64 = weighted.iter().sum();
            Some(search(&weighted, xi * sum))
        },
        density,
    );
    judge(&bench.outcomes, 0.9);
}

/// One variate in 2^53 gives no number, which no count shows.
#[test]
fn not_a_number_at_the_variate_0() {
    let mut bench = Bench::new(Interval::positive());
    let sample = |[xi, ..]: [f64; 4]| Some(-xi.ln() * if xi == 0.0 { 0.0 } else { 1.0 });
    bench.broken("0 times infinity", &["not finite at the end"], sample, |x| (-x).exp());
    judge(&bench.outcomes, 1.0);
}

fn triangles(step: usize) {
    let warp =
        |u: f64, v: f64| TriangleWarp::LowDistortion.barycentric(Vec2::new(u as f32, v as f32)).as_dvec3();
    let mut bench = Bench::new(Triangle::with_area(1.0)).every(step);
    let one = |_: DVec3| 1.0;
    bench.broken(
        "square root missing",
        &["without the square root at vertex 0", "extra distance from vertex 0 (1 - b0)"],
        |[u, v, ..]| Some(DVec3::new(1.0 - u, v * u, u * (1.0 - v))),
        one,
    );
    bench.broken(
        "square root missing, other vertex",
        &["without the square root at vertex 1"],
        |[u, v, ..]| Some(DVec3::new(v * u, 1.0 - u, u * (1.0 - v))),
        one,
    );
    bench.broken("fold missing", &["fold missing"], |[u, v, ..]| Some(DVec3::new(u, v, 1.0 - u - v)), one);
    bench.broken(
        "branch squared",
        &["branch squared"],
        |[u, v, ..]| {
            let (b0, b1) = if u < v * v { (0.5 * u, v - 0.5 * u) } else { (u - 0.5 * v, 0.5 * v) };
            Some(DVec3::new(b0, b1, 1.0 - b0 - b1))
        },
        one,
    );
    bench.broken("area without a half", &["constant 1 / 2"], |[u, v, ..]| Some(warp(u, v)), |_| 0.5);
    bench.broken(
        "three variates over their sum",
        &["of three variates divided by their sum"],
        |[u, v, w, _]| Some(DVec3::new(u, v, w) / (u + v + w)),
        one,
    );
    let linear = |b: DVec3| 3.0 * b.x;
    // Dirichlet (2, 1, 1): two of the four gaps that three variates leave, joined (Devroye 1986, V.2).
    let dirichlet = |[u, v, w, _]: [f64; 4]| {
        let mut x = [u, v, w];
        x.sort_by(f64::total_cmp);
        DVec3::new(x[1], x[2] - x[1], 1.0 - x[2])
    };
    bench.broken(
        "vertices exchanged",
        &["vertices 0 and 1 exchanged"],
        |xi| {
            let b = dirichlet(xi);
            Some(DVec3::new(b.y, b.x, b.z))
        },
        linear,
    );
    bench.broken("a density ignored", &["uniform"], |[u, v, ..]| Some(warp(u, v)), linear);
    judge(&bench.outcomes, 0.9);
}

fn mesh_surfaces(step: usize) {
    let areas = [1.0, 0.5, 2.0];
    let total = 3.5;
    let on = |triangle: usize, u: f64, v: f64| {
        let barycentric = TriangleWarp::LowDistortion.barycentric(Vec2::new(u as f32, v as f32)).as_dvec3();
        Some(SurfacePoint { triangle, barycentric })
    };
    let by_area = |xi: f64| search(&areas.map(|a| a / total), xi);
    let mut bench = Bench::new(MeshSurface::from_areas(areas.to_vec())).every(step);
    bench.broken(
        "triangles alike",
        &["patches chosen alike", "extra patch's measure"],
        |[s, u, v, _]| on(((3.0 * s) as usize).min(2), u, v),
        |_| 1.0 / total,
    );
    bench.broken(
        "selection probability left out",
        &["lacks the patch's measure"],
        |[s, u, v, _]| on(by_area(s), u, v),
        |p: SurfacePoint| 1.0 / areas[p.triangle],
    );
    bench.broken(
        "selection probability left out, triangles alike",
        &["constant the number of patches"],
        |[s, u, v, _]| on(((3.0 * s) as usize).min(2), u, v),
        |p: SurfacePoint| 1.0 / areas[p.triangle],
    );
    bench.broken(
        "off by one",
        &["index one too large, wrapped around"],
        |[s, u, v, _]| on((by_area(s) + 1) % 3, u, v),
        |_| 1.0 / total,
    );
    judge(&bench.outcomes, 0.9);
}

fn polar(theta: f64, phi: f64) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

#[test]
fn hemisphere() {
    hemispheres(4);
}

#[test]
fn triangle() {
    triangles(4);
}

#[test]
fn mesh_surface() {
    mesh_surfaces(4);
}

#[test]
fn flat() {
    flats(4);
}

#[test]
#[ignore = "long: all of them"]
fn every_one() {
    hemispheres(1);
    triangles(1);
    mesh_surfaces(1);
    flats(1);
}

/// Every `step`th of those that are known on the hemisphere, the triangle, a mesh, flat domains.
fn hemispheres(step: usize) {
    let mut bench = Bench::new(Hemisphere).every(step);
    let cosine = |w: DVec3| w.z / PI;
    let uniform = |_: DVec3| 1.0 / TAU;
    let malley = |u: f64, v: f64| {
        let phi = TAU * v;
        DVec3::new(u.sqrt() * phi.cos(), u.sqrt() * phi.sin(), (1.0 - u).sqrt())
    };
    let flat = |u: f64, v: f64| polar((1.0 - u).acos(), TAU * v);
    bench.broken(
        "cosine sampled, uniform density",
        &["lacks cos theta", "cosine-weighted"],
        |[u, v, ..]| Some(malley(u, v)),
        uniform,
    );
    bench.broken(
        "uniform sampled, cosine density",
        &["extra cos theta", "uniform"],
        |[u, v, ..]| Some(flat(u, v)),
        cosine,
    );
    bench.broken(
        "uniform in theta",
        &["uniform in theta and phi", "extra sin theta"],
        |[u, v, ..]| Some(polar(0.5 * PI * u, TAU * v)),
        uniform,
    );
    bench.broken(
        "square root missing",
        &["of a radius without its square root"],
        |[u, v, ..]| Some(malley(u * u, v)),
        cosine,
    );
    bench.broken("pi missing", &["constant pi"], |[u, v, ..]| Some(malley(u, v)), |w| w.z);
    let mirror = Vec3::new(0.6, 0.0, 0.8);
    let lobe = PhongLobe::new(mirror, 50.0).unwrap();
    let phong = |u: f64, v: f64| lobe.sample(Vec2::new(u as f32, v as f32)).map(|w| w.as_dvec3());
    let density = |w: DVec3| f64::from(lobe.density(w.as_vec3()));
    bench.broken(
        "n + 2 for n + 1",
        &["constant (n + 2) / (n + 1), n = 50"],
        |[u, v, ..]| phong(u, v),
        |w| density(w) * 52.0 / 51.0,
    );
    let sharper = PhongLobe::new(mirror, 60.0).unwrap();
    bench.broken(
        "another exponent",
        &["power"],
        |[u, v, ..]| sharper.sample(Vec2::new(u as f32, v as f32)).map(|w| w.as_dvec3()),
        density,
    );
    bench.broken(
        "mirror vector with the wrong sign",
        &["x mirrored", "phi half a turn off"],
        |[u, v, ..]| phong(u, v).map(|w| DVec3::new(-w.x, w.y, w.z)),
        density,
    );
    let grazing = PhongLobe::new(Vec3::new(0.996_194_7, 0.0, 0.087_155_74), 50.0).unwrap();
    let at_grazing = |u: f64, v: f64| grazing.sample(Vec2::new(u as f32, v as f32)).map(|w| w.as_dvec3());
    bench.broken(
        "drawn again",
        &["rejected samples drawn again"],
        |[a, b, c, d]| {
            // Tries of their own, by a hash of the variates (Steele, Lea and Flood 2014).
            let fresh = |k: u64| {
                let mut x = c.to_bits() ^ d.to_bits().rotate_left(32) ^ k.wrapping_mul(0x9e37_79b9_7f4a_7c15);
                for factor in [0xbf58_476d_1ce4_e5b9_u64, 0x94d0_49bb_1331_11eb] {
                    x = (x ^ (x >> 30)).wrapping_mul(factor);
                }
                (x ^ (x >> 31)) as f64 / 2.0_f64.powi(64)
            };
            at_grazing(a, b).or_else(|| (1..64).find_map(|k| at_grazing(fresh(2 * k), fresh(2 * k + 1))))
        },
        |w| f64::from(grazing.density(w.as_vec3())),
    );
    let outgoing = Vec3::new(0.8, 0.0, 0.6);
    let ggx = GgxVisibleNormals::new(outgoing, 0.5).unwrap();
    let g1 = 2.0 * outgoing.z / (outgoing.z + (outgoing.z.powi(2) + 0.25 * outgoing.x.powi(2)).sqrt());
    bench.broken(
        "visible normals without masking",
        &["constant"],
        |[u, v, ..]| ggx.sample(Vec2::new(u as f32, v as f32)).map(|w| w.as_dvec3()),
        |w| f64::from(ggx.density(w.as_vec3()) / g1),
    );
    let mixture = |w: DVec3| 0.5 * (cosine(w) + uniform(w));
    bench.broken(
        "probabilities that differ by 7%",
        &["share of cosine-weighted", "share of uniform"],
        |[pick, u, v, _]| Some(if pick < 0.535 { malley(u, v) } else { flat(u, v) }),
        mixture,
    );
    bench.broken("one lobe only", &["cosine-weighted"], |[_, u, v, _]| Some(malley(u, v)), mixture);
    let chosen = from_fn(
        Hemisphere,
        |[pick, u, v]: [f64; 3]| {
            let w = if pick < 0.5 { malley(u, v) } else { flat(u, v) };
            (w, if pick < 0.5 { cosine(w) } else { uniform(w) })
        },
        mixture,
    );
    bench.outcomes.push(Outcome {
        name: "density of the chosen lobe only",
        expected: &["chosen part only"],
        diagnosis: verify(&chosen).samples(SAMPLES).seed(SEED).run().examinations[0].diagnosis.clone(),
    });
    judge(&bench.outcomes, 0.9);
}

fn map(width: usize, height: usize) -> Vec<[f32; 3]> {
    let texel = |i: usize| 0.2 + ((i % width) as f32 * 0.9).sin().abs() + (i / width) as f32 * 0.1;
    (0..width * height).map(|i| [texel(i); 3]).collect()
}

#[test]
#[ignore = "long: twelve broken maps"]
fn environment() {
    let (width, height) = (16, 8);
    let right = Environment::new(width, height, map(width, height), RowWarp::UniformV).unwrap();
    let sample = |u: f64, v: f64| Environment::sample(&right, [u, v]).direction.as_dvec3();
    let density = |w: DVec3| Sampler::density(&right, &w);
    let sine = |w: DVec3| w.truncate().length();
    let turned = |w: DVec3, angle: f64| glam::DMat3::from_rotation_z(angle) * w;
    let mut bench = Bench::new(Sphere);
    bench.knots = Knots::grid(height, width);
    bench.broken(
        "sine missing in the density",
        &["extra sin theta"],
        |[u, v, ..]| Some(sample(u, v)),
        |w| density(w) * sine(w),
    );
    bench.broken(
        "sine twice in the density",
        &["lacks sin theta"],
        |[u, v, ..]| Some(sample(u, v)),
        |w| density(w) / sine(w).max(1e-9),
    );
    bench.broken(
        "pi sine for 2 pi^2 sine",
        &["constant 2 pi"],
        |[u, v, ..]| Some(sample(u, v)),
        |w| density(w) * TAU,
    );
    bench.broken(
        "theta and phi exchanged",
        &["theta and phi exchanged"],
        |[a, b, ..]| {
            let uv = Environment::sample(&right, [a, b]).uv;
            Some(polar(uv.x * PI, uv.y * TAU))
        },
        density,
    );
    bench.broken(
        "v flipped",
        &["v flipped (theta from the other pole)"],
        |[u, v, ..]| Some(sample(u, v) * DVec3::new(1.0, 1.0, -1.0)),
        density,
    );
    bench.broken(
        "half a texel off",
        &["half a cell off along phi"],
        |[u, v, ..]| Some(turned(sample(u, v), PI / 16.0)),
        density,
    );
    bench.broken(
        "a texel off",
        &["one cell off along phi"],
        |[u, v, ..]| Some(turned(sample(u, v), -PI / 8.0)),
        density,
    );
    bench.broken(
        "half a turn off",
        &["phi half a turn off"],
        |[u, v, ..]| Some(turned(sample(u, v), PI)),
        density,
    );
    bench.broken(
        "y up",
        &["y up for z up"],
        |[u, v, ..]| {
            let w = sample(u, v);
            Some(DVec3::new(w.x, -w.z, w.y))
        },
        density,
    );
    // Each row is divided by its own sum, then weighted by the sine.
    let rows: Vec<f32> =
        (0..height).map(|row| (0..width).map(|column| right.texel(column, row)[0]).sum()).collect();
    let normalised = (0..width * height).map(|i| [right.texel(i % width, i / width)[0] / rows[i / width]; 3]);
    let normalised = Environment::new(width, height, normalised.collect(), RowWarp::UniformV).unwrap();
    bench.broken(
        "rows normalised before the sine",
        &["rows normalised"],
        |[u, v, ..]| Some(Environment::sample(&normalised, [u, v]).direction.as_dvec3()),
        density,
    );
    bench.broken(
        "uniform over the sphere",
        &["uniform"],
        |[u, v, ..]| Some(polar((1.0 - 2.0 * u).acos(), TAU * v)),
        density,
    );
    judge(&bench.outcomes, 0.9);
}

#[test]
#[ignore = "long: quadrature over the edges of a lamp"]
fn solid_angle() {
    let quad = [[0, 1, 2], [0, 2, 3]]
        .map(|t| t.map(|i: usize| [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 2.0, 0.0), Vec3::Y][i]));
    let light = MeshLight::new(&quad, Sides::Front).unwrap();
    let x = Vec3::new(0.4, 0.3, 0.7);
    let right = light.seen_from(x);
    let distance = |w: DVec3| f64::from(x.z) / -w.z;
    let density = |w: DVec3| if w.z < 0.0 { right.density(&w) } else { 0.0 };
    let sample = |[a, b, c, _]: [f64; 4]| light.sample_from(x, [a, b, c]).map(|s| s.direction.as_dvec3());
    let mut bench = Bench::new(Sphere);
    bench.broken("cosine missing", &["extra cos theta"], sample, |w| density(w) * w.z.abs());
    bench.broken("cosine on the wrong side", &["extra (cos theta)^2"], sample, |w| density(w) * w.z * w.z);
    bench.broken("distance squared twice", &["lacks (cos theta)^2"], sample, |w| {
        density(w) * distance(w).powi(2)
    });
    bench.broken("selection probability left out", &["constant 2"], sample, |w| density(w) / 0.5);
    // About an axis that is not the domain's.
    let (t, b, axis) = (DVec3::Y, DVec3::new(-0.8, 0.0, 0.6), DVec3::new(0.6, 0.0, 0.8));
    let half_angle = 0.5_f64;
    bench.broken(
        "cone uniform in its angle",
        &["extra sin of the angle to the lobe's axis"],
        |[u, v, ..]| {
            let w = polar(half_angle * u, TAU * v);
            Some((w.x * t + w.y * b + w.z * axis).normalize())
        },
        |w| if w.dot(axis) >= half_angle.cos() { 1.0 / (TAU * (1.0 - half_angle.cos())) } else { 0.0 },
    );
    judge(&bench.outcomes, 0.9);
}

#[test]
fn rivals() {
    // No power of the claimed density, and no part of it.
    let sharp = |x: f64| 1.0 + 0.5 * (TAU * x).sin();
    let sampler = from_fn(Interval::new(0.0, 1.0), |xi: f64| xi.sqrt(), sharp);
    let report = verify(&sampler).samples(SAMPLES).seed(SEED).rival("the ramp", |x| 2.0 * x).run();
    let diagnosis = report.examinations[0].diagnosis.as_ref().unwrap();
    assert!(diagnosis.is("the ramp"), "{}", diagnosis.text);
    assert!(
        report.to_string().contains("  diagnosis: the samples follow another density: the ramp"),
        "{report}"
    );
}

fn flats(step: usize) {
    let mut disk = Bench::new(Disk);
    disk.broken(
        "square root missing",
        &["uniform in r and phi", "extra r"],
        |[u, v, ..]| Some(DVec2::from_angle(TAU * v) * u),
        |_| 1.0 / PI,
    );
    judge(&disk.outcomes, 1.0);
    let mut square = Bench::new(Square).every(step);
    let ramp = |p: DVec2| 2.0 * p.x * (0.5 + p.y);
    let in_y = |v: f64| (0.25 + 2.0 * v).sqrt() - 0.5;
    square.broken(
        "axes exchanged",
        &["x and y exchanged"],
        |[u, v, ..]| Some(DVec2::new(in_y(v), u.sqrt())),
        ramp,
    );
    square.broken("mirrored", &["x mirrored"], |[u, v, ..]| Some(DVec2::new(1.0 - u.sqrt(), in_y(v))), ramp);
    square.broken("square root missing", &["extra x"], |[u, v, ..]| Some(DVec2::new(u, in_y(v))), ramp);
    square.broken(
        "crowd in a rare place",
        &["crowd"],
        |[pick, u, v, _]| {
            Some(if pick < 0.003 {
                DVec2::new(0.3 + 0.002 * u, 0.7 + 0.002 * v)
            } else {
                DVec2::new(u.sqrt(), in_y(v))
            })
        },
        ramp,
    );
    square.broken(
        "half of the table is stale",
        &["step along x"],
        |[pick, u, v, _]| {
            let x = if pick < 0.4 { 0.5 * u.sqrt() } else { (0.25 + 0.75 * u).sqrt() };
            Some(DVec2::new(x, in_y(v)))
        },
        ramp,
    );
    judge(&square.outcomes, 0.9);
    let mut line = Bench::new(Interval::positive()).every(step);
    line.broken("another rate", &["power"], |[u, ..]| Some(-(-u).ln_1p() / 1.1), |x| (-x).exp());
    line.broken(
        "rate without its constant",
        &["constant 1 / 2"],
        |[u, ..]| Some(-0.5 * (-u).ln_1p()),
        |x| (-2.0 * x).exp(),
    );
    judge(&line.outcomes, 1.0);
}

/// Defects that nobody listed get no name.
#[test]
fn unknown_defects_are_called_unknown() {
    let none = |diagnosis: Option<Diagnosis>| {
        let diagnosis = diagnosis.expect("there is something to say");
        assert!(!diagnosis.explains && diagnosis.name == "unknown", "{}", diagnosis.text);
        assert!(diagnosis.text.starts_with("none of the "), "{}", diagnosis.text);
    };
    // By rejection of u (1 + sin) waves: a density that is on no list.
    let wave = |f: f64, u: f64, pick: f64| {
        if pick < 0.5 + 0.4 * (f * TAU * u).sin() { u } else { (u + 0.5 / f).fract() }
    };
    let square = Bench::new(Square);
    none(square.diagnose(|[u, v, p, _]| Some(DVec2::new(wave(3.0, u, p), v)), |_| 1.0).1);
    none(square.diagnose(|[u, v, p, q]| Some(DVec2::new(wave(2.0, u, p), wave(5.0, v, q))), |_| 1.0).1);
    let sphere = Bench::new(Sphere);
    none(
        sphere
            .diagnose(
                |[u, v, p, _]| Some(polar((1.0 - 2.0 * u).acos(), TAU * wave(4.0, v, p))),
                |_| 0.25 / PI,
            )
            .1,
    );
    let p = weights();
    let jittered: Vec<f64> =
        p.iter().enumerate().map(|(i, w)| w * if i % 3 == 1 { 1.5 } else { 1.0 }).collect();
    let sum: f64 = jittered.iter().sum();
    none(
        Bench::new(Discrete::new(p.len())).diagnose(|[xi, ..]| Some(search(&jittered, xi * sum)), |i| p[i]).1,
    );
}

/// Nothing is said of right samplers, nor of counts that are right where something else is wrong.
#[test]
fn right_counts_have_no_diagnosis() {
    for seed in 0..8 {
        let report = verify(&CosineHemisphere).samples(50_000).seed(seed).run();
        assert_eq!(report.verdict(), Verdict::Pass, "{report}");
        assert_eq!(report.examinations[0].diagnosis, None, "{report}");
    }
    let sum = from_fn(Interval::new(0.0, 1.0), |[u, v]: [f64; 2]| (u + v).fract(), |_: f64| 1.0);
    let report = verify(&sum).samples(50_000).seed(SEED).run();
    assert_eq!(report.examinations[0].diagnosis, None, "{report}");
}
