//! Samples that bring their own densities, and nothing else to hold them against: what is right is never called wrong, however peaky or rough, and what
//! could not be judged is not said to pass.

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};
use warpcheck::domain::{Domain, Hemisphere, Sphere, Square};
use warpcheck::random::{stream, unit_f64};
use warpcheck::verify::{Report, Row, Rows, RowsError, Settings, Verdict, recording};

/// Rows of a point's coordinates and a density.
struct Drawn {
    numbers: Vec<f64>,
    width: usize,
    at: usize,
}

impl Rows for Drawn {
    fn width(&self) -> usize {
        self.width
    }

    fn count(&self) -> Option<u64> {
        Some((self.numbers.len() / self.width) as u64)
    }

    fn read(&mut self, most: usize, out: &mut Vec<f64>) -> Result<usize, RowsError> {
        let end = (self.at + most * self.width).min(self.numbers.len());
        out.extend_from_slice(&self.numbers[self.at..end]);
        let read = (end - self.at) / self.width;
        self.at = end;
        Ok(read)
    }
}

/// Judges `count` samples: a `draw` gives coordinates and the density that is claimed.
fn judged<D: Domain, const N: usize>(
    domain: D,
    point: impl Fn(&[f64]) -> D::Point + Send + Sync,
    (count, seed): (usize, u64),
    mut draw: impl FnMut(&mut dyn FnMut() -> f64) -> ([f64; N], f64),
) -> Report {
    let mut rng = stream(seed, "own densities", 0);
    let mut next = || unit_f64(&mut rng);
    let mut numbers = Vec::with_capacity(count * (N + 1));
    for _ in 0..count {
        let (coordinates, density) = draw(&mut next);
        numbers.extend(coordinates);
        numbers.push(density);
    }
    let rows = Drawn { numbers, width: N + 1, at: 0 };
    let row = |row: &[f64]| Row { point: Some(point(&row[..N])), density: Some(row[N]), weight: None };
    let settings = Settings { diagnose: false, ..Settings::default() };
    let examination = recording(domain, rows, row).unwrap().examine(&settings).unwrap();
    Report::new(vec![examination], &settings)
}

fn up(z: f64, turn: f64) -> [f64; 3] {
    let s = (1.0 - z * z).max(0.0).sqrt();
    [s * (TAU * turn).cos(), s * (TAU * turn).sin(), z]
}

/// Lobes around z: the cosine of a variate, and the density of a cosine.
#[derive(Clone, Copy)]
enum Lobe {
    Cosine,
    Phong(f64),
    /// Normals of GGX, per solid angle of the normal.
    Ggx(f64),
    VonMisesFisher(f64),
}

const LOBES: [(&str, Lobe); 8] = [
    ("cosine", Lobe::Cosine),
    ("Phong 20", Lobe::Phong(20.0)),
    ("Phong 2000", Lobe::Phong(2000.0)),
    ("GGX 0.3", Lobe::Ggx(0.3)),
    ("GGX 0.05", Lobe::Ggx(0.05)),
    ("von Mises-Fisher 1", Lobe::VonMisesFisher(1.0)),
    ("von Mises-Fisher 10", Lobe::VonMisesFisher(10.0)),
    ("von Mises-Fisher 1000", Lobe::VonMisesFisher(1000.0)),
];

impl Lobe {
    fn draw(self, u: f64) -> f64 {
        match self {
            Self::Cosine => (1.0 - u).sqrt(),
            Self::Phong(n) => (1.0 - u).powf(1.0 / (n + 1.0)),
            Self::Ggx(alpha) => 1.0 / (1.0 + alpha * alpha * u / (1.0 - u)).sqrt(),
            Self::VonMisesFisher(kappa) => 1.0 + (u + (1.0 - u) * (-2.0 * kappa).exp()).ln() / kappa,
        }
    }

    fn density(self, z: f64) -> f64 {
        match self {
            Self::Cosine => z / PI,
            Self::Phong(n) => (n + 1.0) / TAU * z.powf(n),
            Self::Ggx(alpha) => {
                let square = alpha * alpha;
                square * z / (PI * (z * z * (square - 1.0) + 1.0).powi(2))
            }
            Self::VonMisesFisher(kappa) => {
                kappa / (TAU * (1.0 - (-2.0 * kappa).exp())) * (kappa * (z - 1.0)).exp()
            }
        }
    }

    /// Samples of this lobe that claim `claimed(z)`.
    fn judged(self, sampled: (usize, u64), claimed: impl Fn(f64) -> f64) -> Report {
        let draw = |next: &mut dyn FnMut() -> f64| {
            let (z, turn) = (self.draw(next()), next());
            (up(z, turn), claimed(z))
        };
        match self {
            Self::VonMisesFisher(_) => judged(Sphere, DVec3::from_slice, sampled, draw),
            _ => judged(Hemisphere, DVec3::from_slice, sampled, draw),
        }
    }
}

/// A map of `side` x `side` texels on the square, each of weight `weight(index)`, sampled and judged.
fn map(side: usize, sampled: (usize, u64), weight: impl Fn(usize) -> f64) -> Report {
    let weights: Vec<f64> = (0..side * side).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    let ends: Vec<f64> = weights
        .iter()
        .scan(0.0, |end, w| {
            *end += w;
            Some(*end)
        })
        .collect();
    judged(
        Square,
        |p| DVec2::new(p[0], p[1]),
        sampled,
        |next| {
            let xi = next() * sum;
            let texel = ends.partition_point(|&end| end <= xi).min(weights.len() - 1);
            let at = |index: usize, u: f64| (index as f64 + u) / side as f64;
            let point = [at(texel % side, next()), at(texel / side, next())];
            (point, weights[texel] / sum * (side * side) as f64)
        },
    )
}

/// Normal numbers that stay the same, by their index: sums of hashes would do, but their tails are short.
fn normals(count: usize) -> Vec<f64> {
    let mut rng = stream(3, "texels", 0);
    (0..count)
        .map(|_| (-2.0 * (1.0 - unit_f64(&mut rng)).ln()).sqrt() * (TAU * unit_f64(&mut rng)).cos())
        .collect()
}

fn said(report: &Report) -> String {
    format!("{}\n{report}", report.verdict())
}

#[test]
fn right_lobes_pass_and_say_what_they_would_have_caught() {
    for (name, lobe) in LOBES {
        let report = lobe.judged((300_000, 1), |z| lobe.density(z));
        assert_eq!(report.verdict(), Verdict::Pass, "{name}: {}", said(&report));
        let power = report.examinations[0].power(report.level());
        assert!(power.len() == 1 && power[0].mass > 0.5 && power[0].error < 0.1, "{name}: {power:?}");
    }
}

/// Each lobe with one of the two.
#[test]
fn seven_percent_are_caught_either_way() {
    for (lobe, factor) in LOBES.into_iter().zip([0.93, 1.07].into_iter().cycle()) {
        is_caught(lobe, factor);
    }
}

#[test]
#[ignore = "long: every lobe with the other"]
fn seven_percent_are_caught_the_other_way() {
    for (lobe, factor) in LOBES.into_iter().zip([1.07, 0.93].into_iter().cycle()) {
        is_caught(lobe, factor);
    }
}

#[track_caller]
fn is_caught((name, lobe): (&str, Lobe), factor: f64) {
    let report = lobe.judged((400_000, 2), |z| factor * lobe.density(z));
    assert_eq!(report.verdict(), Verdict::Fail, "{name} x {factor}: {}", said(&report));
}

#[test]
fn another_lobes_densities_never_pass() {
    for (sampled, claimed) in [
        (Lobe::Phong(200.0), Lobe::Phong(400.0)),
        (Lobe::Phong(200.0), Lobe::Phong(100.0)),
        (Lobe::Cosine, Lobe::Phong(0.0)),
        (Lobe::Phong(0.0), Lobe::Cosine),
        (Lobe::Ggx(0.3), Lobe::Ggx(0.09)),
        (Lobe::Ggx(0.09), Lobe::Ggx(0.3)),
    ] {
        for count in [60_000, 300_000] {
            let report = sampled.judged((count, 3), |z| claimed.density(z));
            assert!(report.verdict() != Verdict::Pass, "{}", said(&report));
        }
    }
}

#[test]
fn few_samples_are_no_evidence() {
    for count in [1, 2, 10, 300] {
        let report = Lobe::Cosine.judged((count, 4), |z| Lobe::Cosine.density(z));
        assert_eq!(report.verdict(), Verdict::Inconclusive, "{count}: {}", said(&report));
    }
}

/// Dark texels that no sample meets would lower the means of 1 / density.
#[test]
fn rough_maps_are_not_called_wrong() {
    let stars = normals(64 * 64);
    let checkered = |texel: usize| if (texel % 64 + texel / 64).is_multiple_of(2) { 1.0 } else { 1e-3 };
    for count in [20_000, 60_000, 300_000] {
        for (name, report) in [
            ("checkered", map(64, (count, 5), checkered)),
            ("starry", map(64, (count, 5), |texel| (3.0 * stars[texel]).exp())),
            ("grainy", map(64, (count, 5), |texel| stars[texel].exp())),
        ] {
            assert!(report.verdict() != Verdict::Fail, "{name}, {count}: {}", said(&report));
        }
    }
}

/// At a level of 5%, so that there is something to count.
#[test]
#[ignore = "long: thousands of runs"]
fn false_alarms_are_as_rare_as_promised() {
    let stars = normals(64 * 64);
    let (mut runs, mut alarms) = (0_u64, Vec::new());
    for seed in 100..200 {
        for count in [20_000, 60_000, 150_000] {
            let lobes =
                LOBES.iter().map(|(name, lobe)| (*name, lobe.judged((count, seed), |z| lobe.density(z))));
            let maps = [("starry", 3.0), ("grainy", 1.0), ("soft", 0.3)]
                .map(|(name, spread)| (name, map(64, (count, seed), |texel| (spread * stars[texel]).exp())));
            for (name, report) in lobes.chain(maps) {
                let settings = Settings { alpha: 0.05, ..Settings::default() };
                let report = Report::new(report.examinations, &settings);
                runs += 1;
                if report.verdict() == Verdict::Fail {
                    alarms.push((name, count, seed));
                }
            }
        }
    }
    println!("{} of {runs}: {alarms:?}", alarms.len());
    // 5% of 3300 are 165, and three standard deviations 38.
    assert!(alarms.len() as f64 <= 0.05 * runs as f64 + 3.0 * (0.0475 * runs as f64).sqrt(), "{alarms:?}");
}
