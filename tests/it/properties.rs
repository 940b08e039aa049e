//! What holds for every input that a `f32` or `f64` can be: log-uniform over the whole range, zeros, denormals, powers of two and the ends
//! included. A constructor gives a value or a typed error; a sample lies in its domain, has a density, and the inverse leads back; masses sum
//! to 1; scaling by a power of two changes no bit; a p-value lies in [0, 1].
//!
//! The seed is fixed, so that no run differs from another; `PROPTEST_CASES=20000` looks at more.

use glam::{DVec3, Vec2, Vec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::f64::consts::PI;
use warpcheck::domain::Mixed;
use warpcheck::random::{ONE_MINUS_EPSILON_F64, to_f32};
use warpcheck::sampler::{Error, *};
use warpcheck::statistics::{
    Moments, anderson_darling, beta, binomial, chi_square, gamma, kolmogorov, multiplicity, normal, poisson,
    student_t, welch,
};

fn config() -> ProptestConfig {
    ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(4), ..Default::default() }
}

// ---- inputs ----

// Boxed, so that what draws and shrinks them is compiled once and not once a property.

/// Any finite `f64` that is not negative. Bits as an integer are nearly log-uniform.
fn magnitude() -> BoxedStrategy<f64> {
    prop_oneof![
        8 => (0..=f64::MAX.to_bits()).prop_map(f64::from_bits),
        2 => (-40.0..40.0_f64).prop_map(f64::exp2),
        1 => (0..52_u32).prop_map(|k| f64::from_bits(1 << k)),
        1 => (1..2047_u64).prop_map(|e| f64::from_bits(e << 52)),
        2 => prop::sample::select(vec![0.0, 5e-324, f64::MIN_POSITIVE, 0.1, 1.0, f64::MAX]),
    ]
    .boxed()
}

/// Any finite `f32` that is not negative.
fn magnitude_f32() -> BoxedStrategy<f32> {
    prop_oneof![
        8 => (0..=f32::MAX.to_bits()).prop_map(f32::from_bits),
        4 => (-20.0..20.0_f32).prop_map(f32::exp2),
        1 => (0..23_u32).prop_map(|k| f32::from_bits(1 << k)),
        1 => (1..255_u32).prop_map(|e| f32::from_bits(e << 23)),
        2 => prop::sample::select(vec![0.0, 1e-45, f32::MIN_POSITIVE, 0.1, 1.0, f32::MAX]),
    ]
    .boxed()
}

fn signed() -> BoxedStrategy<f64> {
    (magnitude(), any::<bool>()).prop_map(|(x, minus)| if minus { -x } else { x }).boxed()
}

fn signed_f32() -> BoxedStrategy<f32> {
    (magnitude_f32(), any::<bool>()).prop_map(|(x, minus)| if minus { -x } else { x }).boxed()
}

/// All that a `f32` can be.
fn anything_f32() -> BoxedStrategy<f32> {
    prop_oneof![8 => signed_f32(), 1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY])].boxed()
}

/// All that a `f64` can be.
fn anything() -> BoxedStrategy<f64> {
    prop_oneof![8 => signed(), 1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY])]
        .boxed()
}

/// A variate: anything in [0, 1), the steps near its ends more often.
fn variate() -> BoxedStrategy<f64> {
    prop_oneof![
        6 => 0.0..1.0_f64,
        2 => (0..1.0_f64.to_bits()).prop_map(f64::from_bits),
        1 => (1..=53_i32).prop_map(|k| 1.0 - (-f64::from(k)).exp2()),
        1 => (0..1_u32 << 24).prop_map(|k| f64::from(k) / f64::from(1 << 24)),
        2 => prop::sample::select(vec![0.0, 5e-324, 0.5, 0.5_f64.next_down(), ONE_MINUS_EPSILON_F64]),
    ]
    .boxed()
}

fn variates() -> BoxedStrategy<Vec2> {
    (variate(), variate()).prop_map(|(x, y)| Vec2::new(to_f32(x), to_f32(y))).boxed()
}

fn vector() -> BoxedStrategy<Vec3> {
    [signed_f32(), signed_f32(), signed_f32()].prop_map(Vec3::from).boxed()
}

/// A unit vector: evenly spread, nearly along an axis, or along it.
fn direction() -> BoxedStrategy<Vec3> {
    prop_oneof![[-1.0..1.0_f32, -1.0..1.0, -1.0..1.0].prop_map(Vec3::from), vector()]
        .prop_map(|v| {
            let v = v.as_dvec3();
            (v / v.abs().max_element()).try_normalize().unwrap_or(DVec3::Z).as_vec3()
        })
        .boxed()
}

fn is_unit(w: Vec3) -> bool {
    (w.as_dvec3().length() - 1.0).abs() < 1e-6
}

fn names(error: &Error, name: &str) -> bool {
    matches!(error, Error::Parameter { parameter, .. } if *parameter == name)
}

fn is_density(density: f64) -> bool {
    density.is_finite() && density >= 0.0
}

/// The weights of two strategies with a sample each, and of three with these shares.
fn weights_of<T: Real + Into<f64>>(heuristic: Heuristic, [a, b, c]: [T; 3], shares: [T; 3]) -> [f64; 5] {
    let among = |own| heuristic.weight_among(own, [(shares[0], a), (shares[1], b), (shares[2], c)]);
    [heuristic.weight(a, b), heuristic.weight(b, a), among(0), among(1), among(2)].map(Into::into)
}

/// What every sampler of directions promises, at one point of the square and in one direction.
fn judge_directions(
    sampler: &impl Sampler<Domain: warpcheck::domain::Domain<Point = DVec3>>,
    xi: &[f64],
    w: Vec3,
    upper: bool,
) -> Result<(), TestCaseError> {
    if let Some(sample) = sampler.sample(xi) {
        prop_assert!(is_unit(sample.point.as_vec3()), "{sample:?}");
        prop_assert!(!upper || sample.point.z >= 0.0, "{sample:?}");
        prop_assert!(is_density(sample.density) && sample.density > 0.0, "{sample:?}");
        prop_assert_eq!(sample.density, sampler.density(&sample.point), "{:?}", sample.point);
        if let Some(back) = sampler.invert(&sample.point) {
            prop_assert!((back[0] - xi[0]).abs() < 1e-6, "{xi:?} {back:?}");
            let turn = (back[1] - xi[1]).abs();
            let radius = sample.point.truncate().length();
            prop_assert!(turn.min(1.0 - turn) * radius < 1e-6, "{xi:?} {back:?}");
        }
    }
    prop_assert!(is_density(sampler.density(&w.as_dvec3())), "{w}: {}", sampler.density(&w.as_dvec3()));
    Ok(())
}

// ---- samplers ----

proptest! {
    #![proptest_config(config())]

    /// All forms of a table: the same masses; those that keep order agree for every variate.
    #[test]
    fn discrete(weights in prop::collection::vec(magnitude(), 1..40), xi in prop::collection::vec(variate(), 8), shift in -300..300_i32) {
        let cdf = match DiscreteCdf::new(&weights) {
            Ok(cdf) => cdf,
            Err(error) => {
                prop_assert_eq!(error, Error::AllZero { count: weights.len() });
                prop_assert!(weights.iter().all(|w| *w == 0.0));
                return Ok(());
            }
        };
        let largest = weights.iter().copied().fold(0.0, f64::max);
        let share = |w: f64| w / largest;
        let total: f64 = weights.iter().map(|w| share(*w)).sum();
        // Where no weight leaves the range of f64.
        let scaled: Vec<f64> = weights.iter().map(|w| w * f64::from(shift).exp2()).collect();
        let exact = weights.iter().zip(&scaled).all(|(w, s)| s.is_finite() && s * f64::from(-shift).exp2() == *w);
        for form in [Form::Cdf, Form::Guide, Form::Alias] {
            let table = DiscreteTable::new(&weights, form).unwrap();
            prop_assert_eq!((table.form(), table.len()), (form, weights.len()));
            prop_assert_eq!((0..weights.len()).map(|i| table.mass(i)).sum::<f64>(), 1.0);
            for (i, &w) in weights.iter().enumerate() {
                prop_assert_eq!(table.mass(i) > 0.0, w > 0.0);
                prop_assert!((table.mass(i) - share(w) / total).abs() < 1e-14, "{} {}", table.mass(i), share(w) / total);
                prop_assert!(w == 0.0 || table.choose(table.variate(i, 0.5)).index == i, "{form:?} {i}");
            }
            for &xi in &xi {
                let choice = table.choose(xi);
                prop_assert!(weights[choice.index] > 0.0 && (0.0..1.0).contains(&choice.rest), "{xi} {choice:?}");
                prop_assert_eq!(choice.mass, table.mass(choice.index));
                let (mut together, mut index) = ([Choice::default()], [0]);
                table.choose_all(&[xi], &mut together);
                table.indices(&[((xi * 2.0_f64.powi(53)) as u64) << 11], &mut index);
                prop_assert_eq!((together[0], index[0] as usize), (choice, choice.index));
                if form == Form::Alias {
                    continue;
                }
                prop_assert_eq!(choice, cdf.choose(xi));
                let back = table.variate(choice.index, choice.rest);
                prop_assert!((back - xi).abs() <= f64::EPSILON, "{xi} {back}");
                let knots = [table.cumulative(choice.index), table.cumulative(choice.index + 1)];
                prop_assert!(knots[0] <= xi && xi < knots[1]);
                prop_assert_eq!(table.choose(knots[0]).index, choice.index);
            }
            if exact {
                prop_assert_eq!(DiscreteTable::new(&scaled, form).unwrap(), table);
            }
        }
    }

    #[test]
    fn discrete_names_what_it_refuses(mut weights in prop::collection::vec(magnitude(), 1..40), bad in anything(), at: prop::sample::Index) {
        let index = at.index(weights.len());
        weights[index] = bad;
        let made = [
            DiscreteCdf::new(&weights).map(|_| ()),
            DiscreteGuide::new(&weights).map(|_| ()),
            DiscreteAlias::new(&weights).map(|_| ()),
        ];
        for made in made {
            match made {
                Err(Error::Weight { index: named, .. }) => prop_assert!(named == index && !(bad >= 0.0 && bad.is_finite())),
                Err(error) => prop_assert_eq!(error, Error::AllZero { count: weights.len() }),
                Ok(()) => prop_assert!(bad >= 0.0 && bad.is_finite()),
            }
        }
    }

    /// MIS weights: each in [0, 1], their sum 1 unless nobody draws there.
    #[test]
    fn heuristics(densities in [magnitude(), magnitude(), magnitude()], single in [magnitude_f32(), magnitude_f32(), magnitude_f32()]) {
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            let double = weights_of(heuristic, densities, [1.0, 3.0, 0.25]);
            let rounded = weights_of(heuristic, single, [1.0, 3.0, 0.25]);
            for (weights, densities, epsilon) in [(double, densities, f64::EPSILON), (rounded, single.map(f64::from), f32::EPSILON.into())] {
                prop_assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)), "{heuristic:?} {densities:?}: {weights:?}");
                for (weights, densities) in [(&weights[..2], &densities[..2]), (&weights[2..], &densities[..])] {
                    let truth = if densities.iter().all(|d| *d == 0.0) { 0.0 } else { 1.0 };
                    let sum: f64 = weights.iter().sum();
                    prop_assert!((sum - truth).abs() <= 4.0 * epsilon, "{heuristic:?} {densities:?}: {weights:?}");
                }
                // Who has the larger density has no smaller weight.
                prop_assert!(densities[0] >= densities[1] || weights[0] <= weights[1], "{heuristic:?} {densities:?}: {weights:?}");
            }
        }
    }

    #[test]
    fn triangle(xi in variates(), area in anything_f32()) {
        for warp in [TriangleWarp::LowDistortion, TriangleWarp::SquareRoot] {
            let b = warp.barycentric(xi);
            prop_assert!(b.min_element() >= 0.0 && b.max_element() <= 1.0, "{b}");
            prop_assert!((b.as_dvec3().element_sum() - 1.0).abs() <= 2.0 * f64::from(f32::EPSILON), "{b}");
            let back = warp.invert(b);
            // The square root squeezes a side of the square into a vertex, where the second variate is lost.
            let squeezed = if warp == TriangleWarp::SquareRoot { xi.x.sqrt() } else { 1.0 };
            let off = (back - xi).abs() * Vec2::new(1.0, squeezed);
            prop_assert!(off.max_element() < 1e-6, "{warp:?} {xi} {b} {back}");
            match BarycentricWarp::new(warp, area) {
                Ok(warp) => prop_assert!(area > 0.0 && warp.density() > 0.0 && warp.density().is_finite()),
                Err(error) => prop_assert!(
                    !(area >= f32::MIN_POSITIVE && area.is_finite()) && names(&error, "area")
                ),
            }
        }
    }

    #[test]
    fn frame(normal in direction(), w in direction()) {
        let Frame { tangent, bitangent, .. } = Frame::new(normal);
        let axes = [tangent, bitangent, normal].map(|v| v.as_dvec3());
        prop_assert!(axes.iter().all(|a| is_unit(a.as_vec3())), "{axes:?}");
        prop_assert!((axes[0].cross(axes[1]) - axes[2]).length() < 1e-6, "{axes:?}");
        let frame = Frame::new(normal);
        prop_assert!((frame.to_local(frame.to_world(w)) - w).length() < 1e-6);
    }

    #[test]
    fn view(x in vector(), y in vector(), normal in direction(), per_area in magnitude_f32()) {
        let Some(view) = View::new(x, y, normal) else {
            prop_assert_eq!(x, y);
            return Ok(());
        };
        prop_assert!((view.direction.length() - 1.0).abs() < 1e-12, "{view:?}");
        prop_assert!(view.distance_squared > 0.0 && view.distance_squared.is_finite(), "{view:?}");
        prop_assert!(view.cosine.abs() <= 1.0 + 1e-6);
        let per_area = f64::from(per_area);
        for view in [view, view.two_sided()] {
            let there = view.per_solid_angle(per_area);
            prop_assert!(there >= 0.0, "{view:?} {there}");
            let back = view.per_area(there);
            prop_assert!(if view.cosine > 0.0 { (back - per_area).abs() <= 1e-12 * per_area } else { back == 0.0 }, "{view:?} {back}");
        }
    }

    #[test]
    fn uniform_and_cosine_directions(xi in variates(), w in direction()) {
        let xi = [f64::from(xi.x), f64::from(xi.y)];
        judge_directions(&CosineHemisphere, &xi, w, true)?;
        judge_directions(&UniformHemisphere, &xi, w, true)?;
        judge_directions(&UniformSphere, &xi, w, false)?;
    }

    #[test]
    fn phong(mirror in direction(), exponent in anything_f32(), xi in variates(), w in direction()) {
        let xi = [f64::from(xi.x), f64::from(xi.y)];
        for exponent in [exponent, exponent.abs().rem_euclid(30.0).exp2().min(1e9)] {
            match PhongLobe::new(mirror, exponent) {
                Ok(lobe) => judge_directions(&lobe, &xi, w, true)?,
                Err(error) => {
                    prop_assert!(names(&error, "exponent"));
                    prop_assert!(!(0.0..=1e9).contains(&exponent));
                }
            }
        }
    }

    #[test]
    fn ggx(outgoing in direction(), alpha in anything_f32(), known in -13.28..0.0_f32, xi in variates(), w in direction()) {
        let xi = [f64::from(xi.x), f64::from(xi.y)];
        for alpha in [alpha, known.exp2()] {
            match GgxVisibleNormals::new(outgoing, alpha) {
                Ok(lobe) => {
                    judge_directions(&lobe, &xi, w, true)?;
                    let opposite = Vec3::new(-outgoing.x, -outgoing.y, outgoing.z);
                    judge_directions(&lobe, &xi, opposite, true)?;
                }
                Err(error) => prop_assert!(
                    !(1e-4..=1.0).contains(&alpha) || outgoing.z < f32::MIN_POSITIVE, "{error}"
                ),
            }
        }
    }

    #[test]
    fn von_mises_fisher(mean in direction(), kappa in anything_f32(), known in -9.9..29.8_f32, xi in variates(), w in direction()) {
        let xi = [f64::from(xi.x), f64::from(xi.y)];
        for kappa in [kappa, known.exp2()] {
            match VonMisesFisher::new(mean, kappa) {
                Ok(lobe) => judge_directions(&lobe, &xi, w, false)?,
                Err(error) => {
                    prop_assert!(names(&error, "kappa"));
                    prop_assert!(!(1e-3..=1e9).contains(&kappa));
                }
            }
        }
    }

    #[test]
    fn directions_of_other_lengths_are_refused(v in [anything_f32(), anything_f32(), anything_f32()].prop_map(Vec3::from)) {
        let unit = (v.length() - 1.0).abs() <= 0.001;
        prop_assert_eq!(PhongLobe::new(v, 1.0).is_ok(), unit);
        prop_assert_eq!(VonMisesFisher::new(v, 1.0).is_ok(), unit);
        prop_assert_eq!(GgxVisibleNormals::new(v, 0.5).is_ok(), unit && v.z >= f32::MIN_POSITIVE);
    }

    #[test]
    fn mixture(c in prop_oneof![anything(), variate(), Just(1.0)], mirror in direction(), xi in [variate(), variate(), variate()], w in direction()) {
        let lobe = PhongLobe::new(mirror, 1e4).unwrap();
        let Ok(mixture) = Mixture::new(c, lobe, CosineHemisphere) else {
            prop_assert!(!(0.0..=1.0).contains(&c));
            return Ok(());
        };
        let xi = [xi[0], f64::from(to_f32(xi[1])), f64::from(to_f32(xi[2]))];
        judge_directions(&mixture, &xi, w, true)?;
        let w = w.as_dvec3();
        let [mixed, first, second] = [mixture.density(&w), Sampler::density(&lobe, &w), Sampler::density(&CosineHemisphere, &w)];
        prop_assert!(mixed <= first.max(second) * (1.0 + 1e-12) && mixed >= first.min(second) * (1.0 - 1e-12));
        match c {
            0.0 => prop_assert_eq!((mixed, mixture.sample(&xi)), (second, Sampler::sample(&CosineHemisphere, &xi[1..]))),
            1.0 => prop_assert_eq!((mixed, mixture.sample(&xi)), (first, Sampler::sample(&lobe, &xi[1..]))),
            _ => {}
        }
    }

    #[test]
    fn with_delta(c in prop_oneof![anything(), variate(), Just(1.0)], xi in [variate(), variate(), variate()], w in direction()) {
        let Ok(material) = WithDelta::new(c, "the mirror direction", CosineHemisphere) else {
            prop_assert!(!(0.0..=1.0).contains(&c));
            return Ok(());
        };
        let Sample { point, density } = material.sample(&xi).unwrap();
        let cosine = Sampler::sample(&CosineHemisphere, &xi[1..]).unwrap();
        let (drawn, mass) = match xi[0] < c {
            true => (Mixed::Atom(0), c),
            false => (Mixed::Continuous(cosine.point), (1.0 - c) * cosine.density),
        };
        prop_assert_eq!((point, density), (drawn, mass));
        prop_assert!(is_density(density) && density > 0.0, "{density}");
        prop_assert_eq!(material.density(&point), density);
        let w = w.as_dvec3();
        prop_assert_eq!(material.density(&Mixed::Continuous(w)), (1.0 - c) * Sampler::density(&CosineHemisphere, &w));
        prop_assert_eq!([0, 1].map(|atom| material.density(&Mixed::Atom(atom))), [c, 0.0]);
    }

    /// A diffuse part and a Phong or a GGX lobe: what is drawn is drawn by the part that the first variate picks, and has the density that is asked.
    #[cfg(feature = "render")]
    #[test]
    fn reflection(
        [kd, ks, shape] in [magnitude_f32(), magnitude_f32(), magnitude_f32()],
        out in direction(),
        pick in variate(),
        xi in variates(),
        w in direction(),
    ) {
        use warpcheck::estimator::Reflection;
        use warpcheck::scene::{Convention, Material};
        // Some steps of the least numbers that f32 holds.
        const LEAST: f64 = 1e-44;
        let phong = PhongLobe::new(Vec3::new(-out.x, -out.y, out.z), shape).unwrap();
        let ggx = GgxVisibleNormals::new(out, shape.clamp(1e-4, 1.0)).ok();
        for roughness in [None, Some(shape)] {
            let material = Material { kd: Vec3::splat(kd), ks: Vec3::splat(ks), ns: shape, roughness, ..Material::default() };
            let brdf = Reflection::new(&material, Convention::Mtl).seen_from(out);
            let drawn = brdf.sample([to_f32(pick), xi.x, xi.y]);
            if !(out.z > 0.0) || kd == 0.0 && ks == 0.0 {
                prop_assert_eq!((drawn, brdf.evaluate(w)), (None, (Vec3::ZERO, 0.0)));
                continue;
            }
            let lobe = |w: Vec3| if roughness.is_none() { Some(phong.density(w)) } else { ggx.map(|ggx| ggx.density(w)) };
            // So near the horizon that there is no lobe the diffuse part has it all.
            let share = if ks > 0.0 && lobe(w).is_some() { f64::from(ks) / (f64::from(kd) + f64::from(ks)) } else { 0.0 };
            let parts = if roughness.is_none() { phong.sample(xi) } else { ggx.and_then(|ggx| ggx.sample(xi)) };
            let parts = [parts, Some(CosineHemisphere.sample(xi))];
            prop_assert!(parts.contains(&drawn), "{drawn:?} of {parts:?}");
            // Where rounding has no part in the choice.
            if (pick - share).abs() > 1e-6 {
                prop_assert_eq!(drawn, parts[usize::from(pick > share)]);
            }
            for w in drawn.into_iter().chain([w]) {
                let (value, density) = brdf.evaluate(w);
                if w.z <= 0.0 {
                    prop_assert_eq!((value, density), (Vec3::ZERO, 0.0));
                    continue;
                }
                let [cosine, glossy] = [CosineHemisphere.density(w), lobe(w).unwrap_or(0.0)].map(f64::from);
                let truth = (1.0 - share) * cosine + share * glossy;
                prop_assert!((f64::from(density) - truth).abs() <= 1e-6 * (cosine + glossy) + LEAST, "{material:?} {w}: {density} {truth}");
                prop_assert!(value.min_element() >= 0.0, "{value}");
            }
            if let Some(w) = drawn {
                prop_assert!(is_unit(w) && w.z > 0.0, "{w}");
                let density = brdf.evaluate(w).1;
                prop_assert!(density > 0.0 && density.is_finite(), "{material:?} {w}: {density}");
            }
        }
    }

    #[test]
    fn environment(
        width in 1..7_usize,
        texels in prop::collection::vec([magnitude_f32(), magnitude_f32(), magnitude_f32()], 1..36),
        black in prop::collection::vec(any::<bool>(), 36),
        xi in prop::collection::vec([variate(), variate()], 8),
        w in direction(),
        shift in -60..60_i32,
    ) {
        let height = texels.len() / width;
        let mut texels = texels[..width * height].to_vec();
        texels.iter_mut().zip(&black).for_each(|(t, &black)| if black { *t = [0.0; 3] });
        let scaled: Vec<_> = texels.iter().map(|t| t.map(|x| x * (shift as f32).exp2())).collect();
        let exact = texels.iter().zip(&scaled).all(|(t, s)| s.map(|x| x * (-shift as f32).exp2()) == *t);
        for rows in [RowWarp::UniformV, RowWarp::UniformCosTheta] {
            let map = match Environment::new(width, height, texels.clone(), rows) {
                Ok(map) => map,
                Err(Error::Black { .. }) => {
                    prop_assert!(texels.iter().all(|t| *t == [0.0; 3]));
                    continue;
                }
                Err(error) => {
                    prop_assert_eq!((error, height), (Error::MapSize { width, height, texels: 0 }, 0));
                    continue;
                }
            };
            let cells = || (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
            let total: f64 = cells().map(|(column, row)| map.texel_mass(column, row)).sum();
            prop_assert!((total - 1.0).abs() < 1e-13, "{total}");
            for (column, row) in cells() {
                prop_assert_eq!(map.texel_mass(column, row) > 0.0, luminance(map.texel(column, row)) > 0.0);
            }
            for &xi in &xi {
                let s = map.sample(xi);
                prop_assert!(is_unit(s.direction) && luminance(s.radiance.into()) > 0.0, "{s:?}");
                prop_assert!((0.0..=1.0).contains(&s.uv.x) && (0.0..=1.0).contains(&s.uv.y), "{s:?}");
                prop_assert!(s.density.is_finite() && s.density > 0.0, "{s:?}");
                let asked = map.density(s.direction);
                prop_assert!((asked - s.density).abs() <= 1e-5 * s.density, "{s:?} {asked}");
                prop_assert_eq!(map.radiance(s.direction), s.radiance);
            }
            let density = Sampler::density(&map, &w.as_dvec3());
            prop_assert!(is_density(density) && (density > 0.0) == (luminance(map.radiance(w).into()) > 0.0), "{density}");
            if exact {
                let scaled = Environment::new(width, height, scaled.clone(), rows).unwrap();
                prop_assert_eq!(Sampler::density(&scaled, &w.as_dvec3()), density);
                for &xi in &xi {
                    let (a, b) = (map.sample(xi), scaled.sample(xi));
                    prop_assert_eq!((a.direction, a.uv, a.density), (b.direction, b.uv, b.density));
                }
            }
        }
    }

    /// Both packed forms: one at a time and many at a time the same bits, and what is drawn has light.
    #[test]
    fn packed_environment(
        width in 1..40_usize,
        texels in prop::collection::vec([magnitude_f32(), magnitude_f32(), magnitude_f32()], 1..200),
        black in prop::collection::vec(any::<bool>(), 200),
        xi in prop::collection::vec([variate(), variate()], 40),
        w in direction(),
    ) {
        let height = texels.len() / width;
        let mut texels = texels[..width * height].to_vec();
        texels.iter_mut().zip(&black).for_each(|(t, &black)| if black { *t = [0.0; 3] });
        let Ok(map) = RadianceMap::new(width, height, texels.clone()) else { return Ok(()) };
        for (rows, form) in [
            (RowWarp::UniformV, Form::Guide),
            (RowWarp::UniformCosTheta, Form::Guide),
            (RowWarp::UniformV, Form::Alias),
            (RowWarp::UniformCosTheta, Form::Alias),
        ] {
            let Ok(packed) = PackedEnvironment::new(map.clone(), rows, form) else {
                prop_assert!(texels.iter().all(|t| *t == [0.0; 3]));
                continue;
            };
            let cells = || (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
            let total: f64 = cells().map(|(column, row)| packed.texel_mass(column, row)).sum();
            prop_assert!((total - 1.0).abs() < 1e-12, "{total}");
            for (column, row) in cells() {
                let lit = luminance(texels[row * width + column]) > 0.0;
                prop_assert_eq!(packed.texel_mass(column, row) > 0.0, lit, "{} {}", column, row);
            }
            let mut together = vec![EnvironmentSample::default(); xi.len()];
            packed.sample_all(&xi, &mut together);
            for (&xi, s) in xi.iter().zip(&together) {
                prop_assert_eq!(packed.sample(xi), *s);
                prop_assert!(is_unit(s.direction) && luminance(s.radiance.into()) > 0.0, "{s:?}");
                prop_assert!(s.density.is_finite() && s.density > 0.0, "{s:?}");
                let asked = packed.density(s.direction);
                prop_assert!((asked - s.density).abs() <= 1e-5 * s.density, "{s:?} {asked}");
            }
            prop_assert!(is_density(Sampler::density(&packed, &w.as_dvec3())));
        }
    }

    /// Powers and places of any size, from anywhere.
    #[test]
    fn light_tree(
        lights in prop::collection::vec(([vector(), vector(), vector()], magnitude()), 1..20),
        x in vector(),
        xi in prop::collection::vec(variate(), 8),
    ) {
        let tree = match LightTree::new(lights.iter().copied()) {
            Ok(tree) => tree,
            Err(error) => {
                let first = lights.iter().position(|l| l.1 == 0.0);
                prop_assert_eq!(Some(error), first.map(|index| Error::Power { index, value: 0.0 }));
                return Ok(());
            }
        };
        let masses: Vec<f64> = (0..lights.len()).map(|light| tree.mass(x, light)).collect();
        prop_assert!(masses.iter().all(|&mass| mass > 0.0 && mass <= 1.0), "{masses:?}");
        prop_assert!((masses.iter().sum::<f64>() - 1.0).abs() < 1e-13, "{masses:?}");
        for (light, &mass) in masses.iter().enumerate() {
            // From the first variate to the last of 53 bits.
            let (start, end) = tree.interval(x, light).unwrap();
            for xi in [start, end - 0.5 * f64::EPSILON] {
                prop_assert_eq!(tree.choose(x, xi), (light, mass));
            }
        }
        for xi in xi {
            let (light, mass) = tree.choose(x, xi);
            prop_assert_eq!(mass, masses[light]);
        }
    }

    /// Triangles of any size and shape: none, or a solid angle up to 2 pi and unit vectors.
    #[test]
    fn spherical_triangle(
        vertices in [vector(), vector(), vector()],
        x in vector(),
        xi in prop::collection::vec([variate(), variate()], 8),
        w in direction(),
    ) {
        let Some(triangle) = SphericalTriangle::new(x, vertices) else { return Ok(()) };
        let omega = triangle.solid_angle();
        prop_assert!(omega > 0.0 && omega <= 2.0 * PI * (1.0 + 1e-12), "{omega}");
        for xi in xi {
            let w = triangle.sample(xi);
            prop_assert!(w.is_normalized(), "{xi:?}: {w}");
        }
        let density = triangle.density(w.as_dvec3());
        prop_assert!(density == 0.0 || density == 1.0 / omega, "{density}");
    }

    #[test]
    fn mesh_light(
        triangles in prop::collection::vec([vector(), vector(), vector()], 1..6),
        both: bool,
        xi in prop::collection::vec([variate(), variate(), variate()], 4),
        x in vector(),
        w in direction(),
    ) {
        judge_light(&triangles, both, &xi, x, w)?;
    }

    /// Lights that are seen: triangles of any size at any place, from nearby.
    #[test]
    fn mesh_light_from_nearby(
        corners in prop::collection::vec([[-1.0..1.0_f32, -1.0..1.0, -1.0..1.0], [-1.0..1.0, -1.0..1.0, -1.0..1.0], [-1.0..1.0, -1.0..1.0, -1.0..1.0]], 1..6),
        exponent in -60..60_i32,
        sizes in prop::collection::vec(-20..20_i32, 6),
        both: bool,
        xi in prop::collection::vec([variate(), variate(), variate()], 4),
        x in [-2.0..2.0_f32, -2.0..2.0, -2.0..2.0].prop_map(Vec3::from),
        w in direction(),
    ) {
        let unit = (exponent as f32).exp2();
        let scaled = |by: f32| -> Vec<[Vec3; 3]> {
            corners.iter().zip(&sizes).map(|(t, &size)| t.map(|c| Vec3::from(c) * (size as f32).exp2() * by)).collect()
        };
        judge_light(&scaled(unit), both, &xi, x * unit, w)?;
        // Directions and densities per solid angle know no unit of length.
        let sides = if both { Sides::Both } else { Sides::Front };
        let lights = [1.0, unit].map(|by| MeshLight::new(&scaled(by), sides));
        let [Ok(one), Ok(other)] = &lights else { return Ok(()) };
        for &xi in &xi {
            let [a, b] = [one.sample_from(x, xi), other.sample_from(x * unit, xi)];
            let seen = |s: LightSample| (s.triangle, s.direction, s.density);
            prop_assert_eq!(a.map(seen), b.map(seen));
        }
    }
}

fn judge_light(
    triangles: &[[Vec3; 3]],
    both: bool,
    xi: &[[f64; 3]],
    x: Vec3,
    w: Vec3,
) -> Result<(), TestCaseError> {
    let light = match MeshLight::new(triangles, if both { Sides::Both } else { Sides::Front }) {
        Ok(light) => light,
        Err(error) => {
            prop_assert_eq!(error, Error::NoArea { triangles: triangles.len() });
            return Ok(());
        }
    };
    prop_assert!(light.area() > 0.0 && light.area().is_finite());
    let area = |t: &[Vec3; 3]| {
        let [a, b, c] = t.map(|v| v.as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    };
    let total: f64 = triangles.iter().enumerate().map(|(i, t)| light.density_on(i) * area(t)).sum();
    prop_assert!((total - 1.0).abs() < 1e-12, "{total}");
    let seen = light.seen_from(x);
    for &xi in xi {
        let s = light.sample_surface(xi);
        prop_assert!(s.point.is_finite() && is_unit(s.normal), "{s:?}");
        let Sample { point, density } = Sampler::sample(&light, &xi).unwrap();
        prop_assert!(is_density(density) && density > 0.0, "{density}");
        prop_assert_eq!(density, Sampler::density(&light, &point));
        let back = Sampler::invert(&light, &point).unwrap();
        let again = Sampler::sample(&light, &back).unwrap().point;
        prop_assert_eq!(again.triangle, point.triangle);
        prop_assert!((again.barycentric - point.barycentric).length() < 1e-6);
        if let Some(s) = light.sample_from(x, xi) {
            prop_assert!(is_unit(s.direction) && s.distance >= 0.0, "{s:?}");
            prop_assert!(s.density > 0.0, "{s:?}");
            // Up to directions that round out of their triangle.
            let density = Sampler::density(&seen, &s.direction.as_dvec3());
            prop_assert!(density >= 0.0, "{s:?} {density}");
        }
    }
    let density = Sampler::density(&seen, &w.as_dvec3());
    prop_assert!(density >= 0.0, "{density}");
    Ok(())
}

// ---- statistics ----

/// Every p is a probability; an error is one that says something.
fn probabilities<const N: usize>(
    found: [Result<f64, warpcheck::statistics::Error>; N],
) -> Result<(), TestCaseError> {
    for (i, found) in found.iter().enumerate() {
        match found {
            Ok(p) => prop_assert!((0.0..=1.0).contains(p), "figure {i} is {p}"),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
    Ok(())
}

proptest! {
    // Each case asks thirty functions.
    #![proptest_config(ProptestConfig { cases: config().cases / 4, ..config() })]

    #[test]
    fn tails(x in anything(), df in anything(), n in prop_oneof![any::<u64>(), 1..1000_u64], k in prop_oneof![any::<u64>(), 0..1000_u64], p in prop_oneof![anything(), variate()]) {
        probabilities([
            Ok(normal::sf(x)).map(|p| if x.is_nan() { 0.0 } else { p }),
            chi_square::sf(x, df),
            chi_square::cdf(x, df),
            chi_square::ln_sf(x, df).map(f64::exp),
            chi_square::sf(x.abs(), df.abs()),
            student_t::sf(x, df.abs()),
            gamma::lower(df, x),
            gamma::upper(df.abs(), x.abs()),
            beta::lower(df.abs(), x.abs(), p),
            binomial::pmf(k, n, p),
            binomial::upper_tail(k, n, p),
            binomial::lower_tail(k, n, p),
            binomial::two_sided(k, n, p),
            binomial::ln_upper_tail(k, n, p).map(f64::exp),
            poisson::pmf(k, x.abs()),
            poisson::upper_tail(k, x.abs()),
            poisson::lower_tail(k, x.abs()),
            poisson::two_sided(k, x.abs()),
            kolmogorov::sf(x, n),
            kolmogorov::sf(p, n),
            kolmogorov::two_sample_sf(p, 1 + n % 300, 1 + k % 300),
            kolmogorov::two_sample_sf(p, n, k),
            anderson_darling::sf(x, n),
            multiplicity::sidak(p, n),
        ])?;
        if let Ok(x) = chi_square::isf(p, df) {
            prop_assert!(x >= 0.0, "{x}");
        }
        if let Ok(interval) = binomial::clopper_pearson(k, n, p) {
            prop_assert!(0.0 <= interval.lower && interval.lower <= interval.upper && interval.upper <= 1.0, "{interval:?}");
            // Ends are good to 1e-10; a confidence of 1e-300 leaves no more between them.
            let share = k as f64 / n as f64;
            prop_assert!(interval.lower * (1.0 - 1e-9) <= share && share <= interval.upper * (1.0 + 1e-9), "{interval:?} {k} {n}");
        }
    }

    #[test]
    fn tests_of_counts(
        counts in prop::collection::vec(prop_oneof![any::<u64>(), 0..100_u64], 0..12),
        expected in prop::collection::vec(anything(), 0..12),
        columns in 0..5_usize,
        n in 0..1000_u64,
    ) {
        let fitting: Vec<f64> = expected.iter().map(|e| e.abs()).filter(|e| e.is_finite()).collect();
        let largest = fitting.iter().copied().fold(0.0, f64::max);
        let total: f64 = fitting.iter().map(|e| e / largest).sum();
        let shares: Vec<f64> = fitting.iter().map(|e| e / largest / total).collect();
        let small: Vec<u64> = shares.iter().enumerate().map(|(i, s)| (s * n as f64).round() as u64 + i as u64 % 2).collect();
        let all = small.iter().sum::<u64>() as f64;
        let scaled: Vec<f64> = shares.iter().map(|s| s * all).collect();
        let other: Vec<u64> = small.iter().rev().copied().collect();
        probabilities([
            chi_square::statistic(&counts, &expected).map(|f| f.p),
            chi_square::statistic(&small, &scaled).map(|f| f.p),
            chi_square::g_statistic(&small, &scaled).map(|f| f.p),
            chi_square::williams_g_statistic(&small, &scaled).map(|f| f.p),
            chi_square::two_sample(&small, &other).map(|f| f.p),
            chi_square::two_sample_g(&small, &other).map(|f| f.p),
            chi_square::two_sample(&counts, &counts).map(|f| f.p),
            chi_square::independence(&counts, columns).map(|f| f.p),
            kolmogorov::grouped(&small, &shares, 0.0).map(|f| f.p),
            anderson_darling::grouped(&small, &shares, 0.0).map(|f| f.p),
        ])?;
    }

    #[test]
    fn tests_of_values(mut values in prop::collection::vec(variate(), 0..40), mut others in prop::collection::vec(signed(), 0..40), any in anything()) {
        values.sort_by(f64::total_cmp);
        others.sort_by(f64::total_cmp);
        probabilities([
            kolmogorov::one_sample(&values).map(|f| f.p),
            kolmogorov::one_sample(&others).map(|f| f.p),
            kolmogorov::two_sample(&values, &others).map(|f| f.p),
            kolmogorov::two_sample(&[any], &others).map(|f| f.p),
            anderson_darling::one_sample(&values).map(|f| f.p),
            multiplicity::holm(&values).map(|p| p.iter().copied().fold(0.0, f64::max)),
        ])?;
    }

    #[test]
    fn moments(values in prop::collection::vec(prop_oneof![signed(), -1e3..1e3_f64], 0..40), cut: prop::sample::Index, expected in anything(), error in anything()) {
        let all: Moments = values.iter().copied().collect();
        let cut = cut.index(values.len() + 1);
        let mut merged: Moments = values[..cut].iter().copied().collect();
        merged.merge(&values[cut..].iter().copied().collect());
        prop_assert_eq!((merged.count(), merged.smallest(), merged.largest()), (all.count(), all.smallest(), all.largest()));
        for moments in [all, merged] {
            // Deviations beyond 1e154 have no squares: then variances are infinite or NaN, and tests refuse.
            if values.iter().all(|v| v.abs() < 1e150) {
                prop_assert!(moments.variance().is_none_or(|v| v >= 0.0 && v.is_finite()), "{moments:?}");
            }
            if let Ok(test) = moments.mean_test(expected, error) {
                probabilities([Ok(test.p), Ok(test.p_conservative)])?;
                prop_assert!(test.p <= test.p_conservative, "{test:?}");
            }
            let summary = welch::Summary::from(&moments);
            let fixed = welch::Summary { mean: expected, variance: error, count: 7 };
            probabilities([welch::welch_t_test(summary, fixed).map(|w| w.p), welch::welch_t_test(fixed, fixed).map(|w| w.p)])?;
        }
    }
}

#[cfg(feature = "render")]
mod film {
    use super::*;
    use warpcheck::estimator::Film;

    proptest! {
        #![proptest_config(config())]

        #[test]
        fn film(radiance in prop::collection::vec(magnitude_f32(), 1..40), cut: prop::sample::Index, shift in -60..60_i32) {
            let cut = cut.index(radiance.len());
            let exposed = |radiance: &[f32], by: f64| {
                let mut film = Film::new(1, 1);
                radiance.iter().for_each(|&r| film.add(0, 0, DVec3::splat(f64::from(r) * by)));
                film
            };
            let film = exposed(&radiance, 1.0);
            let mut merged = exposed(&radiance[..cut], 1.0);
            merged.merge(&exposed(&radiance[cut..], 1.0));
            let (least, most) = radiance.iter().fold((f64::MAX, 0.0_f64), |(a, b), &r| (a.min(r.into()), b.max(r.into())));
            for film in [&film, &merged] {
                let pixel = film.pixel(0, 0);
                prop_assert_eq!(pixel.count(), radiance.len() as u64);
                let [mean, error] = [pixel.mean()[0], pixel.standard_error()[0]];
                prop_assert!(mean >= least * (1.0 - 1e-14) && mean <= most * (1.0 + 1e-14), "{mean}");
                prop_assert!(radiance.len() < 2 || (0.0..=most).contains(&error), "{error}");
            }
            let by = f64::from(shift).exp2();
            let scaled = exposed(&radiance, by);
            let (a, b) = (film.pixel(0, 0), scaled.pixel(0, 0));
            prop_assert_eq!(a.mean().map(|m| m * by), b.mean());
            prop_assert_eq!(a.standard_error().map(|e| e * by), b.standard_error());
        }
    }
}
