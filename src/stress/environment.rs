//! Environment maps of odd sizes, enormous range and borders. The oracle is [`EnvironmentOracle`]: luminance over its integral, by plain sums in `f64`.

use super::{
    BITS, Component, Kind, Reach, Row, Trial, Unit, corner_pairs, ends_of_cells, lattice, variates_in,
};
use crate::oracle::EnvironmentOracle;
use crate::sampler::{
    Environment, EnvironmentSample, Error, Form, PackedEnvironment, RadianceMap, RowWarp, luminance,
};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

const HERE: Component = Component::Environment;

const WARPS: [RowWarp; 2] = [RowWarp::UniformV, RowWarp::UniformCosTheta];

/// What the same map is asked of.
#[derive(Clone, Copy, PartialEq)]
enum Tables {
    /// [`Environment`].
    Baseline,
    /// [`PackedEnvironment`] with guides: rows of 2^31 steps.
    Guides,
    /// [`PackedEnvironment`] with an alias table: all texels in 2^53 steps.
    Alias,
}

impl Tables {
    const ALL: [Self; 3] = [Self::Baseline, Self::Guides, Self::Alias];

    /// Before the name of an input.
    fn prefix(self) -> &'static str {
        match self {
            Self::Baseline => "",
            Self::Guides => "guides: ",
            Self::Alias => "alias table: ",
        }
    }
}

/// All tables, with their names and what each is allowed to be off by.
fn each<T: Copy>(allowed: [T; 3]) -> impl Iterator<Item = (Tables, &'static str, T)> {
    Tables::ALL.into_iter().zip(allowed).map(|(tables, allowed)| (tables, tables.prefix(), allowed))
}

pub(super) fn rows() -> Vec<Row> {
    let mut rows = maps();
    rows.extend(suns());
    rows.extend(scales());
    rows.extend(borders());
    rows.extend(refusals());
    rows
}

/// What a map answers, whatever its tables are.
trait Answers {
    fn sample(&self, xi: [f64; 2]) -> EnvironmentSample;
    fn density(&self, w: Vec3) -> f32;
    fn radiance(&self, w: Vec3) -> Vec3;
    fn texel_mass(&self, column: usize, row: usize) -> f64;
    /// The variates of a texel; `None` in an alias table, where they lie in pieces.
    fn variates(&self, column: usize, row: usize) -> Option<[(f64, f64); 2]>;
}

impl Answers for Environment {
    fn sample(&self, xi: [f64; 2]) -> EnvironmentSample {
        self.sample(xi)
    }

    fn density(&self, w: Vec3) -> f32 {
        self.density(w)
    }

    fn radiance(&self, w: Vec3) -> Vec3 {
        self.radiance(w)
    }

    fn texel_mass(&self, column: usize, row: usize) -> f64 {
        self.texel_mass(column, row)
    }

    fn variates(&self, column: usize, row: usize) -> Option<[(f64, f64); 2]> {
        let across =
            self.conditional(row).map_or((0.0, 0.0), |c| (c.cumulative(column), c.cumulative(column + 1)));
        Some([(self.marginal().cumulative(row), self.marginal().cumulative(row + 1)), across])
    }
}

impl Answers for PackedEnvironment {
    fn sample(&self, xi: [f64; 2]) -> EnvironmentSample {
        self.sample(xi)
    }

    fn density(&self, w: Vec3) -> f32 {
        self.density(w)
    }

    fn radiance(&self, w: Vec3) -> Vec3 {
        self.map().radiance(w)
    }

    fn texel_mass(&self, column: usize, row: usize) -> f64 {
        self.texel_mass(column, row)
    }

    fn variates(&self, column: usize, row: usize) -> Option<[(f64, f64); 2]> {
        self.variates(column, row)
    }
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

    fn make(&self, tables: Tables, rows: RowWarp) -> Result<Box<dyn Answers>, Error> {
        let map = RadianceMap::new(self.width, self.height, self.texels.clone())?;
        Ok(match tables {
            Tables::Baseline => Box::new(Environment::from_map(map, rows)?),
            Tables::Guides => Box::new(PackedEnvironment::new(map, rows, Form::Guide)?),
            Tables::Alias => Box::new(PackedEnvironment::new(map, rows, Form::Alias)?),
        })
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

/// A map, what it answers, and what it should answer.
struct Judge<'a> {
    map: &'a Map,
    oracle: EnvironmentOracle,
    rows: RowWarp,
    made: &'a dyn Answers,
    /// Texels (column, row) lighter than a step, which have one: nobody can say what their density should be.
    one_step: &'a dyn Fn(usize, usize) -> bool,
}

impl Judge<'_> {
    /// A sample lies in a texel with light, has its radiance, and a density that is positive and, asked both ways, the oracle's. Returns its texel.
    fn sample(&self, trial: &mut Trial, xi: [f64; 2]) -> (usize, usize) {
        let s = self.made.sample(xi);
        let w = s.direction.as_dvec3();
        let (column, row) = texel_of(self.map, w);
        let radiance = self.map.texels[row * self.map.width + column];
        trial.must(self.map.is_lit(column, row) && s.radiance == radiance.into(), || {
            format!("xi = {xi:?} draws {w}, in texel ({column}, {row}), with the radiance {}", s.radiance)
        });
        trial
            .must(s.density > 0.0 && s.density.is_finite(), || format!("xi = {xi:?}: density {}", s.density));
        // Nearer to a pole the oracle's own theta, an arc cosine, has no digits.
        if w.truncate().length() > 1e-2 {
            let asked = self.made.density(s.direction);
            if (self.one_step)(column, row) {
                trial.must((asked / s.density - 1.0).abs() < 1e-5, || {
                    format!("xi = {xi:?}: density {}, asked {asked}", s.density)
                });
            } else {
                let truth = density(&self.oracle, self.rows, w);
                trial.compare(s.density.into(), truth, || format!("xi = {xi:?}"));
                trial.compare(asked.into(), truth, || format!("direction {w}"));
            }
        }
        (column, row)
    }

    /// Which lit texels are drawn by variates from inside their intervals, or from both ends of the cells of an alias table. No dark one has a mass.
    fn reach(&self, trial: &mut Trial) {
        let Map { width, height, .. } = *self.map;
        let mut found = vec![[false; 2]; width * height];
        let mut draw = |xi: [f64; 2], k: usize, judge: &mut dyn FnMut([f64; 2]) -> (usize, usize)| {
            let (column, row) = judge(xi);
            found[row * width + column][k] = true;
            (column, row)
        };
        // What 53 bits draw is judged.
        let mut judged = |xi| self.sample(trial, xi);
        let mut plain = |xi| texel_of(self.map, self.made.sample(xi).direction.as_dvec3());
        let judges: [&mut dyn FnMut([f64; 2]) -> (usize, usize); 2] = [&mut judged, &mut plain];
        for (k, (judge, bits)) in judges.into_iter().zip(BITS).enumerate() {
            if self.made.variates(0, 0).is_none() {
                for xi in ends_of_cells(width * height, bits).flatten() {
                    draw([xi, 0.5], k, judge);
                }
                continue;
            }
            for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
                let intervals = self.made.variates(column, row).unwrap_or_default();
                let [down, across] = intervals.map(|interval| variates_in(interval, bits));
                let _ =
                    down.zip(across).any(|(down, across)| draw([down, across], k, judge) == (column, row));
            }
        }
        let mut reach = Reach::default();
        for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
            let mass = self.made.texel_mass(column, row);
            if self.map.is_lit(column, row) {
                reach.count(found[row * width + column], mass);
            } else {
                trial.must(mass == 0.0, || format!("black texel ({column}, {row}) has the mass {mass:e}"));
            }
        }
        trial.reach(reach);
    }
}

/// Densities against the oracle's, samples in texels with light, every lit texel reachable.
fn judge(trial: &mut Trial, map: &Map, tables: Tables, rows: RowWarp) {
    judge_but(trial, map, tables, rows, &|_, _| false);
}

/// The same but for the densities of texels that are lighter than a step. Returns what was judged.
fn judge_but(
    trial: &mut Trial,
    map: &Map,
    tables: Tables,
    rows: RowWarp,
    one_step: &dyn Fn(usize, usize) -> bool,
) -> Option<Box<dyn Answers>> {
    let made = trial.accepted(map.make(tables, rows))?;
    let judge = Judge { map, oracle: map.oracle(), rows, made: &*made, one_step };
    for xi in corner_pairs().chain(lattice(4_096)) {
        judge.sample(trial, xi);
    }
    judge.reach(trial);
    Some(made)
}

fn name(rows: RowWarp) -> &'static str {
    match rows {
        RowWarp::UniformV => "even in v",
        RowWarp::UniformCosTheta => "even in cos theta",
    }
}

/// A row for all tables and both ways to place directions inside a row of texels.
fn all(
    input: &str,
    should: &str,
    allowed: [f64; 3],
    map: impl Fn() -> Map + Clone + Send + Sync + 'static,
) -> Vec<Row> {
    let mut rows = Vec::new();
    for (tables, prefix, allowed) in each(allowed) {
        for warp in WARPS {
            let map = map.clone();
            let ask = move |trial: &mut Trial| judge(trial, &map(), tables, warp);
            let input = format!("{prefix}{input}, {}", name(warp));
            rows.push(HERE.row(Kind::Value, input, should, (allowed, Unit::Relative), ask));
        }
    }
    rows
}

/// Sizes, and where the light is.
fn maps() -> Vec<Row> {
    // Densities are f32, and near a pole the steps of f32 directions are many ulp of sin theta.
    let fine = 2e-6;
    // A step of guides is 2^-31 of a row, the darkest texel of the ragged ones 3e-6 of its row, of 8192 columns 1e-7.
    let ragged = |guides| [fine, guides, fine];
    let should = "L / integral of L; no black texel";
    let mut rows = Vec::new();
    for (width, height) in [(1, 1), (1, 300), (300, 1), (3, 7)] {
        rows.extend(all(&format!("{width}x{height}"), should, ragged(2e-4), move || {
            Map::ragged(width, height)
        }));
    }
    // An alias table deals 2^53 steps to all texels: here the darkest at a pole has 4e-7 of the mean texel's mass, about 115 steps, and may be half of one off.
    let large = all("8192x4096", should, [fine, 1e-2, 5e-3], || Map::ragged(8192, 4096));
    rows.extend(large.into_iter().map(Row::heavy));
    rows.extend(all("rows 0, 1, 6 and 11 black", should, [fine; 3], || {
        Map::new(
            16,
            12,
            |x, y| if matches!(y, 0 | 1 | 6 | 11) { [0.0; 3] } else { [x as f32 + 1.0, 2.0, 0.5] },
        )
    }));
    for ((tables, prefix, fine), warp) in each([fine; 3]).flat_map(|each| WARPS.map(|warp| (each, warp))) {
        let ask =
            move |trial: &mut Trial| {
                let (width, height) = (7, 5);
                for bright in 0..width * height {
                    let map = Map::new(width, height, |x, y| {
                        if y * width + x == bright { [2.0, 1.0, 0.5] } else { [0.0; 3] }
                    });
                    judge(trial, &map, tables, warp);
                }
            };
        let input = format!("{prefix}one bright texel of 7x5, {}", name(warp));
        rows.push(HERE.row(Kind::Value, input, "only it is drawn, anywhere", (fine, Unit::Relative), ask));
    }
    rows
}

/// A sun in a sky that is all the light there is in the sun's shadow.
fn suns() -> Vec<Row> {
    const AT: (usize, usize) = (100, 60);
    let mut rows = Vec::new();
    // In the sun's row a texel of sky has few of the 2^53 steps; with guides and a sun of 1e5 it has 20,000, with 1e10 less than one. An alias table deals 2^53
    // to all texels: beside 1e10 there are 5000 for one at a pole.
    for (sun, allowed) in [(1e5, [2e-6, 1e-4, 2e-6]), (1e10, [1e-5, 1e-5, 3e-4])] {
        for ((tables, prefix, allowed), warp) in each(allowed).flat_map(|each| WARPS.map(|warp| (each, warp)))
        {
            let coarse = tables == Tables::Guides && sun > 1e9;
            let ask = move |trial: &mut Trial| {
                let map = Map::sun(512, 256, sun, AT);
                plain_f32(trial, &map);
                let one_step = |column, row| coarse && row == AT.1 && column != AT.0;
                let made = judge_but(trial, &map, tables, warp, &one_step);
                if let Some(made) = made.filter(|_| coarse) {
                    let ratio =
                        made.texel_mass(AT.0 - 1, AT.1) / made.texel_mass(AT.0, AT.1) * f64::from(sun);
                    trial.note(format!("beside the sun the sky has {ratio:.1} times its share"));
                }
            };
            let (kind, should) = match coarse {
                true => (Kind::Limit, "a step for each texel of its row"),
                false => (Kind::Value, "the sky stays reachable"),
            };
            let input = format!("{prefix}sun of {sun:e} over 1, 512x256, {}", name(warp));
            rows.push(HERE.row(kind, input, should, (allowed, Unit::Relative), ask));
        }
    }
    rows
}

/// Powers of two change no bit.
fn scales() -> Vec<Row> {
    let mut rows = Vec::new();
    for ((tables, prefix, ()), exponent) in
        each([(); 3]).flat_map(|each| [60, -60].map(|exponent| (each, exponent)))
    {
        let ask = move |trial: &mut Trial| {
            let map = Map::ragged(64, 32);
            let mut scaled = map.clone();
            scaled.texels.iter_mut().flatten().for_each(|x| *x *= 2.0_f32.powi(exponent));
            for warp in WARPS {
                let [Some(one), Some(other)] = [&map, &scaled].map(|m| trial.accepted(m.make(tables, warp)))
                else {
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
            format!("{prefix}scaled by 2^{exponent}"),
            "the same bits",
            (0.0, Unit::UlpF32),
            ask,
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
    let mut rows = Vec::new();
    // Half a step is rounding. A fifth of the 2^31 steps of a row is no whole number; beside a pole a texel of 1024 x 512 has 8e7 of the 2^53, of which one is an
    // eighth of a step of f32.
    for (tables, prefix, allowed) in each([0.5, 0.55, 0.65]) {
        let exactly = move |trial: &mut Trial| {
            for (width, height) in [(1, 1), (5, 3), (64, 32), (1024, 512)] {
                let map = Map::new(width, height, |_, _| [0.25, 3.0, 1.0]);
                let Some(made) = trial.accepted(map.make(tables, RowWarp::UniformCosTheta)) else { return };
                for xi in corner_pairs().chain(lattice(1_024)) {
                    let s = made.sample(xi);
                    trial.compare(s.density.into(), 0.25 / PI, || format!("{width}x{height}, xi = {xi:?}"));
                    trial.compare(made.density(s.direction).into(), 0.25 / PI, || s.direction);
                }
            }
        };
        let input = format!("{prefix}constant map, {}", name(RowWarp::UniformCosTheta));
        rows.push(HERE.row(Kind::Value, input, "1/(4 pi) to rounding", (allowed, Unit::UlpF32), exactly));
    }
    for (tables, prefix, allowed) in each([1.2e-7, 2e-4, 1.2e-7]) {
        let ask = move |trial: &mut Trial| directions(trial, tables);
        let input = format!("{prefix}poles, phi = +-pi, -0.0, |z| = 1 + 1e-7");
        let should = "the texel there, its density";
        rows.push(HERE.row(Kind::Value, input, should, (allowed, Unit::Relative), ask));
    }
    for (tables, prefix, allowed) in each([1.2e-7, 2e-4, 1.2e-7]) {
        let ask = move |trial: &mut Trial| poles(trial, tables);
        let input = format!("{prefix}poles, {}: 1/sin theta", name(RowWarp::UniformV));
        let should = "finite: as at sin theta = 1e-12";
        rows.push(HERE.row(Kind::Limit, input, should, (allowed, Unit::Relative), ask));
    }
    rows
}

/// The middle of a texel.
fn middle_of(map: &Map, column: usize, row: usize) -> DVec3 {
    let (sin, cos) = ((column as f64 + 0.5) / map.width as f64 * 2.0 * PI).sin_cos();
    let (r, z) = ((row as f64 + 0.5) / map.height as f64 * PI).sin_cos();
    DVec3::new(r * cos, r * sin, z)
}

/// The density of a direction against the nearest of those that are right: at a pole that of every column is.
fn compare_with_columns(
    trial: &mut Trial,
    found: f64,
    columns: impl Iterator<Item = usize>,
    truth: impl Fn(usize) -> f64,
    w: Vec3,
) {
    let distance = |&truth: &f64| (found - truth).abs();
    let nearest = columns.map(truth).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    trial.compare(found, nearest.unwrap_or(f64::NAN), || format!("{w:?}"));
}

/// Where directions are in a map of 8 x 4, whose texels all have another density.
fn directions(trial: &mut Trial, tables: Tables) {
    // Column and row; at a pole every column is right.
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
    // Red tells column and row of a radiance.
    let numbered = Map::new(8, 4, |x, y| [x as f32 + 1.0, 8.0 * y as f32 + 1.0, 1.0]);
    let [Some(made), Some(numbers)] =
        [Map::ragged(8, 4), numbered].map(|map| trial.accepted(map.make(tables, RowWarp::UniformCosTheta)))
    else {
        return;
    };
    let (map, oracle) = (Map::ragged(8, 4), Map::ragged(8, 4).oracle());
    for (w, column, row) in directions {
        let found = numbers.radiance(w);
        let at = (found.x as usize - 1, (found.y as usize - 1) / 8);
        trial.must(column.is_none_or(|column| column == at.0) && row == at.1, || {
            format!("{w:?} is in texel {at:?}, not ({column:?}, {row})")
        });
        let truth = |column| oracle.uniform_cos_theta(middle_of(&map, column, row));
        let columns = (0..map.width).filter(|&c| column.is_none_or(|column| c == column));
        compare_with_columns(trial, made.density(w).into(), columns, truth, w);
    }
}

/// Densities at and beside the poles, where 1 / sin theta is infinite or nearly so.
fn poles(trial: &mut Trial, tables: Tables) {
    let map = Map::ragged(8, 4);
    let oracle = map.oracle();
    let Some(made) = trial.accepted(map.make(tables, RowWarp::UniformV)) else { return };
    let mut largest = 0.0_f64;
    for (w, column, row) in [
        (Vec3::Z, None, 0),
        (Vec3::NEG_Z, None, 3),
        (Vec3::new(-0.0, 1e-38, 1.0), Some(2), 0),
        (Vec3::new(0.0, 0.0, -1.000_000_1), None, 3),
        // Nothing is held back here.
        (Vec3::new(1e-11, 1e-12, 1.0), Some(0), 0),
        (Vec3::new(1e-11, -1e-12, -1.0), Some(7), 3),
    ] {
        // The density times sin theta is the same all over a texel.
        let truth = |column| {
            let middle = middle_of(&map, column, row);
            let sine = w.as_dvec3().truncate().length().max(1e-12);
            oracle.uniform_v(middle) * middle.truncate().length() / sine
        };
        let found = f64::from(made.density(w));
        let columns = (0..map.width).filter(|&c| column.is_none_or(|column| c == column));
        compare_with_columns(trial, found, columns, truth, w);
        trial.must(found.is_finite(), || format!("{w:?}: density {found}"));
        largest = largest.max(found);
    }
    trial.note(format!("densities up to {largest:.1e}"));
}

/// What is no map.
fn refusals() -> Vec<Row> {
    let with = |input: &str, should: &str, texel: [f32; 3], is_right: fn(&Error) -> bool| {
        let ask = move |trial: &mut Trial| {
            let map = Map::new(7, 5, |x, y| if (x, y) == (5, 3) { texel } else { [1.0; 3] });
            trial.refused(map.make(Tables::Baseline, RowWarp::UniformV), is_right);
        };
        HERE.row(Kind::Refusal, input, should, (0.0, Unit::Absolute), ask)
    };
    let names = "names the texel and the channel";
    let mut rows = vec![
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
    ];
    for (tables, prefix, ()) in each([(); 3]) {
        let ask = move |trial: &mut Trial| {
            let black = Map::new(7, 5, |_, _| [0.0; 3]).make(tables, RowWarp::UniformCosTheta);
            trial.refused(black, |e| *e == Error::Black { width: 7, height: 5 });
        };
        let input = format!("{prefix}all black");
        rows.push(HERE.row(Kind::Refusal, input, "says so", (0.0, Unit::Absolute), ask));
    }
    rows.push(HERE.row(
        Kind::Refusal,
        "guides: 65537x1",
        "names the width",
        (0.0, Unit::Absolute),
        |trial| {
            let wide = Map::new(65_537, 1, |_, _| [1.0; 3]).make(Tables::Guides, RowWarp::UniformV);
            trial.refused(wide, |e| matches!(e, Error::Parameter { parameter: "width of the map", .. }));
        },
    ));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws something else instead of one texel.
    struct Losing<'a> {
        made: &'a dyn Answers,
        map: &'a Map,
        lost: (usize, usize),
    }

    impl Answers for Losing<'_> {
        fn sample(&self, xi: [f64; 2]) -> EnvironmentSample {
            let s = self.made.sample(xi);
            let hit = texel_of(self.map, s.direction.as_dvec3()) == self.lost;
            if hit { self.made.sample([0.0, 0.0]) } else { s }
        }

        fn density(&self, w: Vec3) -> f32 {
            self.made.density(w)
        }

        fn radiance(&self, w: Vec3) -> Vec3 {
            self.made.radiance(w)
        }

        fn texel_mass(&self, column: usize, row: usize) -> f64 {
            self.made.texel_mass(column, row)
        }

        fn variates(&self, column: usize, row: usize) -> Option<[(f64, f64); 2]> {
            self.made.variates(column, row)
        }
    }

    #[test]
    fn a_lost_texel_is_counted() {
        let map = Map::ragged(16, 8);
        let lit = (0..16 * 8).filter(|i| map.is_lit(i % 16, i / 16)).count() as u64;
        for (tables, rows) in Tables::ALL.into_iter().flat_map(|tables| WARPS.map(|rows| (tables, rows))) {
            let made = map.make(tables, rows).unwrap();
            for lost in [None, Some((3, 2)), Some((14, 7))] {
                let losing = Losing { made: &*made, map: &map, lost: lost.unwrap_or((usize::MAX, 0)) };
                let mut trial = Trial::new();
                Judge { map: &map, oracle: map.oracle(), rows, made: &losing, one_step: &|_, _| false }
                    .reach(&mut trial);
                let reach = trial.reach.unwrap();
                let missed = u64::from(lost.is_some());
                assert_eq!((reach.of, reach.missed), (lit, missed), "{lost:?}");
                assert_eq!(reach.missed_by_24_bits.map(|(by_24, _)| by_24), Some(missed), "{lost:?}");
            }
        }
    }
}
