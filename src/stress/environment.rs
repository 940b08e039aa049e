//! Environment maps of odd sizes, enormous range and borders. The oracle is [`EnvironmentOracle`]: luminance over its integral, by plain sums in `f64`.

use super::{Component, Kind, Reach, Row, Trial, Unit, corner_pairs, lattice, missed_by_24_bits};
use crate::oracle::EnvironmentOracle;
use crate::sampler::{
    DiscreteCdf, Environment, EnvironmentSample, Error, Form, PackedEnvironment, RadianceMap, RowWarp,
    luminance,
};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

const HERE: Component = Component::Environment;

const WARPS: [RowWarp; 2] = [RowWarp::UniformV, RowWarp::UniformCosTheta];

pub(super) fn rows() -> Vec<Row> {
    let mut rows = maps();
    rows.extend(suns());
    rows.extend(borders());
    rows.extend(packed());
    rows.extend(refusals());
    rows
}

/// A map before it has tables.
#[derive(Clone)]
struct Map {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
}

impl Map {
    fn new(width: usize, height: usize, texel: impl Fn(usize, usize) -> [f32; 3]) -> Self {
        let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
        Self { width, height, texels }
    }

    /// Uneven, with some black texels, none of the same luminance as its neighbours.
    fn ragged(width: usize, height: usize) -> Self {
        Self::new(width, height, |x, y| {
            let i = (y * width + x) as f32;
            if (x + 2 * y) % 5 == 4 { [0.0; 3] } else { [(0.61 * i).sin().abs(), (i * 0.37) % 3.0, 0.01] }
        })
    }

    /// 1 everywhere but for one texel.
    fn sun(width: usize, height: usize, sun: f32, at: (usize, usize)) -> Self {
        Self::new(width, height, |x, y| [if (x, y) == at { sun } else { 1.0 }; 3])
    }

    fn is_lit(&self, column: usize, row: usize) -> bool {
        luminance(self.texels[row * self.width + column]) > 0.0
    }

    fn make(&self, rows: RowWarp) -> Result<Environment, Error> {
        Environment::new(self.width, self.height, self.texels.clone(), rows)
    }

    fn pack(&self, rows: RowWarp, form: Form) -> Result<PackedEnvironment, Error> {
        PackedEnvironment::new(RadianceMap::new(self.width, self.height, self.texels.clone())?, rows, form)
    }

    fn oracle(&self) -> EnvironmentOracle {
        EnvironmentOracle::new(self.width, self.height, &self.texels)
    }
}

fn density(oracle: &EnvironmentOracle, rows: RowWarp, w: DVec3) -> f64 {
    match rows {
        RowWarp::UniformV => oracle.uniform_v(w),
        RowWarp::UniformCosTheta => oracle.uniform_cos_theta(w),
    }
}

/// The two angles of a direction, from the nearer pole, without the cancellation of an arc cosine.
fn texel_of(map: &Map, w: DVec3) -> (usize, usize) {
    let theta = w.truncate().length().atan2(w.z);
    let phi = w.y.atan2(w.x).rem_euclid(2.0 * PI);
    let index = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
    (index(phi / (2.0 * PI), map.width), index(theta / PI, map.height))
}

/// What a map answers: the sample for variates, the density of a direction.
struct Answers<'a> {
    sample: &'a dyn Fn([f64; 2]) -> EnvironmentSample,
    density: &'a dyn Fn(Vec3) -> f32,
}

impl Answers<'_> {
    /// A sample lies in a texel with light, has its radiance, and a density that is positive and, asked both ways, the oracle's. Returns its texel.
    fn judge(
        &self,
        trial: &mut Trial,
        map: &Map,
        oracle: &EnvironmentOracle,
        rows: RowWarp,
        xi: [f64; 2],
    ) -> (usize, usize) {
        let s = (self.sample)(xi);
        let w = s.direction.as_dvec3();
        let (column, row) = texel_of(map, w);
        trial.must(
            map.is_lit(column, row) && s.radiance == map.texels[row * map.width + column].into(),
            || format!("xi = {xi:?} draws {w}, in texel ({column}, {row}), with the radiance {}", s.radiance),
        );
        trial
            .must(s.density > 0.0 && s.density.is_finite(), || format!("xi = {xi:?}: density {}", s.density));
        // Nearer to a pole the oracle's own theta, an arc cosine, has no digits.
        if w.truncate().length() > 1e-2 {
            let truth = density(oracle, rows, w);
            trial.compare(s.density.into(), truth, || format!("xi = {xi:?}"));
            trial.compare((self.density)(s.direction).into(), truth, || format!("direction {w}"));
        }
        (column, row)
    }
}

/// Densities against the oracle's, samples in texels with light, every lit texel reachable.
fn judge(trial: &mut Trial, map: &Map, rows: RowWarp) {
    let oracle = map.oracle();
    let Some(made) = trial.accepted(map.make(rows)) else { return };
    let answers = Answers { sample: &|xi| made.sample(xi), density: &|w| made.density(w) };
    let drawn = |trial: &mut Trial, xi: [f64; 2]| answers.judge(trial, map, &oracle, rows, xi);
    for xi in corner_pairs().chain(lattice(4_096)) {
        drawn(trial, xi);
    }
    // Every lit texel, from the middle of its variates.
    let (mut of, mut missed, mut missed_24) = (0, 0, (0, 0.0));
    let interval = |table: &DiscreteCdf, i: usize| (table.cumulative(i), table.cumulative(i + 1));
    for row in 0..map.height {
        let lit = (0..map.width).filter(|&column| map.is_lit(column, row));
        let Some(conditional) = made.conditional(row) else {
            let dark = lit.count() as u64;
            (of, missed) = (of + dark, missed + dark);
            continue;
        };
        let marginal = made.marginal();
        let row_lost = missed_by_24_bits(interval(marginal, row));
        for column in lit {
            of += 1;
            let xi = [marginal.variate(row, 0.5), conditional.variate(column, 0.5)];
            missed += u64::from(drawn(trial, xi) != (column, row));
            if row_lost || missed_by_24_bits(interval(conditional, column)) {
                missed_24 = (missed_24.0 + 1, missed_24.1 + made.texel_mass(column, row));
            }
        }
    }
    trial.reach(Reach { of, missed, missed_by_24_bits: Some(missed_24) });
}

fn name(rows: RowWarp) -> &'static str {
    match rows {
        RowWarp::UniformV => "v",
        RowWarp::UniformCosTheta => "cos theta",
    }
}

/// A row for each of the two forms.
fn both(input: &str, allowed: f64, map: impl Fn() -> Map + Clone + Send + Sync + 'static) -> Vec<Row> {
    let should = "L / integral of L; no black texel";
    let row_of = |rows| {
        let map = map.clone();
        let ask = move |trial: &mut Trial| judge(trial, &map(), rows);
        HERE.row(Kind::Value, format!("{input}, {}", name(rows)), should, (allowed, Unit::Relative), ask)
    };
    WARPS.map(row_of).into()
}

/// Sizes, and where the light is.
fn maps() -> Vec<Row> {
    // Densities are f32, and near a pole the steps of f32 directions are many ulp of sin theta.
    let fine = 2e-6;
    let mut rows = Vec::new();
    for (width, height) in [(1, 1), (1, 300), (300, 1), (3, 7)] {
        rows.extend(both(&format!("{width}x{height}"), fine, move || Map::ragged(width, height)));
    }
    let large = both("8192x4096", fine, || Map::ragged(8192, 4096));
    rows.extend(large.into_iter().map(Row::heavy));
    rows.extend(both("top, middle and last rows black", fine, || {
        Map::new(
            16,
            12,
            |x, y| if matches!(y, 0 | 1 | 6 | 11) { [0.0; 3] } else { [x as f32 + 1.0, 2.0, 0.5] },
        )
    }));
    for warp in WARPS {
        let ask =
            move |trial: &mut Trial| {
                let (width, height) = (7, 5);
                for bright in 0..width * height {
                    let map = Map::new(width, height, |x, y| {
                        if y * width + x == bright { [2.0, 1.0, 0.5] } else { [0.0; 3] }
                    });
                    judge(trial, &map, warp);
                }
            };
        let input = format!("one bright texel of 7x5, anywhere, {}", name(warp));
        rows.push(HERE.row(Kind::Value, input, "only it is drawn", (fine, Unit::Relative), ask));
    }
    rows
}

/// A sun in a sky that is all the light there is in the sun's shadow; and scales.
fn suns() -> Vec<Row> {
    let mut rows = Vec::new();
    for (sun, allowed) in [(1e5, 2e-6), (1e10, 1e-5)] {
        for warp in WARPS {
            let ask = move |trial: &mut Trial| {
                let map = Map::sun(512, 256, sun, (100, 60));
                plain_f32(trial, &map);
                judge(trial, &map, warp);
            };
            let input = format!("sun of {sun:e}, sky of 1, 512x256, {}", name(warp));
            // In the sun's row a texel of sky has few of the 2^53 steps.
            rows.push(HERE.row(
                Kind::Value,
                input,
                "the sky stays reachable",
                (allowed, Unit::Relative),
                ask,
            ));
        }
    }
    for exponent in [60, -60] {
        let ask = move |trial: &mut Trial| {
            let map = Map::ragged(64, 32);
            let mut scaled = map.clone();
            scaled.texels.iter_mut().flatten().for_each(|x| *x *= 2.0_f32.powi(exponent));
            for warp in WARPS {
                let [Some(one), Some(other)] = [&map, &scaled].map(|m| trial.accepted(m.make(warp))) else {
                    return;
                };
                for xi in corner_pairs().chain(lattice(4_096)) {
                    let (a, b) = (one.sample(xi), other.sample(xi));
                    trial.compare(b.density.into(), a.density.into(), || format!("xi = {xi:?}"));
                    trial.must(a.direction == b.direction, || {
                        format!("xi = {xi:?}: {} {}", a.direction, b.direction)
                    });
                }
            }
        };
        rows.push(HERE.row(
            Kind::Value,
            format!("scaled by 2^{exponent}"),
            "the same bits",
            (0.0, Unit::UlpF32),
            ask,
        ));
    }
    rows
}

/// The same of packed tables, where a texel that has light has a step at least: what it says its mass is, is what is searched.
fn judge_packed(trial: &mut Trial, map: &Map, rows: RowWarp, form: Form) {
    let oracle = map.oracle();
    let Some(made) = trial.accepted(map.pack(rows, form)) else { return };
    let answers = Answers { sample: &|xi| made.sample(xi), density: &|w| made.density(w) };
    for xi in corner_pairs().chain(lattice(4_096)) {
        answers.judge(trial, map, &oracle, rows, xi);
    }
    reach_packed(trial, map, &made);
}

/// Which lit texels have no step; no dark one has one.
fn reach_packed(trial: &mut Trial, map: &Map, made: &PackedEnvironment) {
    let (mut of, mut missed) = (0, 0);
    for (row, column) in (0..map.height).flat_map(|row| (0..map.width).map(move |column| (row, column))) {
        let mass = made.texel_mass(column, row);
        if map.is_lit(column, row) {
            of += 1;
            missed += u64::from(mass == 0.0);
        } else {
            trial.must(mass == 0.0, || format!("black texel ({column}, {row}) has the mass {mass:e}"));
        }
    }
    trial.reach(Reach { of, missed, missed_by_24_bits: None });
}

/// Packed tables: rows of 2^31 steps, or all texels in 2^53.
fn packed() -> Vec<Row> {
    let mut rows = Vec::new();
    let mut both = |input: &str, allowed: [f64; 2], map: &dyn Fn() -> Map, should: &str| {
        for ((form, allowed), warp) in [(Form::Guide, allowed[0]), (Form::Alias, allowed[1])]
            .into_iter()
            .flat_map(|form| WARPS.map(|warp| (form, warp)))
        {
            let map = map();
            let ask = move |trial: &mut Trial| judge_packed(trial, &map, warp, form);
            let words = if form == Form::Guide { "guides" } else { "alias table" };
            let input = format!("{words}: {input}, {}", name(warp));
            rows.push(HERE.row(Kind::Value, input, should, (allowed, Unit::Relative), ask));
        }
    };
    let should = "L / integral of L; no black texel";
    // A step is 2^-31 of a row, the darkest texel of the ragged ones 3e-6 of its row.
    let fine = [2e-4, 2e-6];
    for (width, height) in [(1, 1), (1, 300), (300, 1), (3, 7)] {
        both(&format!("{width}x{height}"), fine, &|| Map::ragged(width, height), should);
    }
    // A texel of sky is 1e-5 of the sun's row, 20,000 steps.
    both(
        "sun of 1e5, sky of 1, 512x256",
        [1e-4, 2e-6],
        &|| Map::sun(512, 256, 1e5, (100, 60)),
        "the sky stays reachable",
    );
    rows.push(HERE.row(
        Kind::Limit,
        "guides: sun of 1e10, sky of 1, 512x256",
        "a step for each texel of the sun's row",
        (0.0, Unit::Absolute),
        |trial| {
            let map = Map::sun(512, 256, 1e10, (100, 60));
            let Some(made) = trial.accepted(map.pack(RowWarp::UniformV, Form::Guide)) else { return };
            reach_packed(trial, &map, &made);
            let ratio = made.texel_mass(99, 60) / made.texel_mass(100, 60) * 1e10;
            trial.note(format!("beside the sun the sky has {ratio:.1} times its share"));
        },
    ));
    for form in [Form::Guide, Form::Alias] {
        rows.push(HERE.row(
            Kind::Refusal,
            format!("{form:?}: all black"),
            "says so",
            (0.0, Unit::Absolute),
            move |trial| {
                let black = Map::new(7, 5, |_, _| [0.0; 3]).pack(RowWarp::UniformCosTheta, form);
                trial.refused(black, |e| *e == Error::Black { width: 7, height: 5 });
            },
        ));
    }
    rows
}

/// How many texels have no width in a plain CDF of `f32`, over all texels in a row.
fn plain_f32(trial: &mut Trial, map: &Map) {
    let weights: Vec<f32> = map.texels.iter().map(|&t| luminance(t) as f32).collect();
    let total = weights.iter().fold(0.0_f32, |sum, w| sum + w);
    let mut sum = 0.0_f32;
    let lost = weights.iter().filter(|&&w| {
        let before = sum / total;
        sum += w;
        sum / total == before
    });
    match 100.0 * lost.count() as f64 / weights.len() as f64 {
        0.0 => {}
        percent => trial.note(format!("a plain f32 CDF has no width for {percent:.1}% of the texels")),
    }
}

/// Directions at the borders of the map.
fn borders() -> Vec<Row> {
    let exactly = |trial: &mut Trial| {
        for (width, height) in [(1, 1), (5, 3), (64, 32), (1024, 512)] {
            let map = Map::new(width, height, |_, _| [0.25, 3.0, 1.0]);
            let Some(made) = trial.accepted(map.make(RowWarp::UniformCosTheta)) else { return };
            for xi in corner_pairs().chain(lattice(1_024)) {
                let s = made.sample(xi);
                trial.compare(s.density.into(), 0.25 / PI, || format!("{width}x{height}, xi = {xi:?}"));
                trial.compare(made.density(s.direction).into(), 0.25 / PI, || s.direction);
            }
        }
    };
    // Where each direction is in a map of 8 x 4, column and row; at a pole every column is right.
    let over = 1.0 + 1e-7_f32;
    let directions = [
        (Vec3::Z, None, 0),
        (Vec3::NEG_Z, None, 3),
        (Vec3::new(-0.0, -0.0, 1.0), None, 0),
        (Vec3::new(-0.0, 0.0, -over), None, 3),
        (Vec3::new(0.0, 0.0, over), None, 0),
        (Vec3::new(1e-30, -1e-30, over), Some(7), 0),
        (Vec3::new(-0.8, 0.0, 0.6), Some(4), 1),
        (Vec3::new(-0.8, -0.0, 0.6), Some(4), 1),
        (Vec3::new(-0.8, -1e-45, 0.6), Some(4), 1),
        (Vec3::new(0.8, -0.0, -0.6), Some(0), 2),
        (Vec3::new(0.8, -1e-45, -0.6), Some(7), 2),
        (Vec3::new(1.0, 0.0, -0.0), Some(0), 2),
    ];
    let map = Map::new(8, 4, |x, y| [(x + 1) as f32, (8 * y + 1) as f32, 0.0]);
    let ask = move |trial: &mut Trial| {
        let oracle = map.oracle();
        let Some(made) = trial.accepted(map.make(RowWarp::UniformCosTheta)) else { return };
        for (w, column, row) in directions {
            let found = made.radiance(w);
            let at = (found.x as usize - 1, (found.y as usize - 1) / 8);
            trial.must(column.is_none_or(|column| column == at.0) && row == at.1, || {
                format!("{w:?} is in texel {at:?}, not ({column:?}, {row})")
            });
            // The oracle's density at the middle of that texel.
            let (sin, cos) = ((at.0 as f64 + 0.5) / 8.0 * 2.0 * PI).sin_cos();
            let (z, r) = (((at.1 as f64 + 0.5) / 4.0 * PI).cos(), ((at.1 as f64 + 0.5) / 4.0 * PI).sin());
            let truth = oracle.uniform_cos_theta(DVec3::new(r * cos, r * sin, z));
            trial.compare(made.density(w).into(), truth, || format!("{w:?}"));
        }
    };
    let poles = |trial: &mut Trial| {
        let map = Map::ragged(8, 4);
        let Some(made) = trial.accepted(map.make(RowWarp::UniformV)) else { return };
        for w in [Vec3::Z, Vec3::NEG_Z, Vec3::new(-0.0, 1e-38, 1.0), Vec3::new(0.0, 0.0, -1.000_000_1)] {
            let found = made.density(w);
            trial.must(found.is_finite() && found > 1e6, || format!("{w:?}: density {found}"));
            trial.note(format!("{found:.1e}"));
        }
    };
    vec![
        HERE.row(Kind::Value, "constant map, cos theta", "exactly 1/(4 pi)", (0.5, Unit::UlpF32), exactly),
        HERE.row(
            Kind::Value,
            "poles, phi = +-pi, -0.0, |z| = 1 + 1e-7",
            "the texel there, and its density",
            (1.0, Unit::UlpF32),
            ask,
        ),
        HERE.row(
            Kind::Limit,
            "poles, v: density 1/sin theta",
            "finite: as at sin theta = 1e-12",
            (0.0, Unit::Absolute),
            poles,
        ),
    ]
}

/// What is no map.
fn refusals() -> Vec<Row> {
    let with = |input: &str, should: &str, texel: [f32; 3], is_right: fn(&Error) -> bool| {
        let ask = move |trial: &mut Trial| {
            let map = Map::new(7, 5, |x, y| if (x, y) == (5, 3) { texel } else { [1.0; 3] });
            trial.refused(map.make(RowWarp::UniformV), is_right);
        };
        HERE.row(Kind::Refusal, input, should, (0.0, Unit::Absolute), ask)
    };
    let names = "names the texel and the channel";
    vec![
        with(
            "a NaN",
            names,
            [1.0, 1.0, f32::NAN],
            |e| matches!(e, Error::Texel { column: 5, row: 3, channel: 'B', value } if value.is_nan()),
        ),
        with("a negative channel", names, [-1e-45, 1.0, 1.0], |e| {
            *e == Error::Texel { column: 5, row: 3, channel: 'R', value: -1e-45 }
        }),
        with("an infinite channel", names, [1.0, f32::INFINITY, 1.0], |e| {
            *e == Error::Texel { column: 5, row: 3, channel: 'G', value: f32::INFINITY }
        }),
        HERE.row(Kind::Refusal, "all black", "says so", (0.0, Unit::Absolute), |trial| {
            let black = Map::new(7, 5, |_, _| [0.0; 3]).make(RowWarp::UniformCosTheta);
            trial.refused(black, |e| *e == Error::Black { width: 7, height: 5 });
        }),
        HERE.row(
            Kind::Refusal,
            "6 texels for usize::MAX x 2",
            "names both",
            (0.0, Unit::Absolute),
            |trial| {
                let map = Environment::new(usize::MAX, 2, vec![[1.0; 3]; 6], RowWarp::UniformV);
                trial.refused(map, |e| *e == Error::MapSize { width: usize::MAX, height: 2, texels: 6 });
            },
        ),
    ]
}
