//! What must not change, or change in a known way, when the input of a table does.
//!
//! Nobody needs to know the right answer to ask such questions (Chen, Cheung and Yiu, "Metamorphic testing: a new approach for generating next test cases",
//! 1998): all weights times 2^60 is the same distribution, to the last bit; weights in another order have the same masses in that order; the one
//! bright texel is found where it is. They are put to whatever builds a table from weights ([`weights`]) or a map ([`maps`]).
//!
//! | relation | what it asks |
//! |---|---|
//! | scaling | all entries times 2^60 and 2^-60 change no bit of densities and points |
//! | permutation | (weights) other orders permute the masses and the samples; a heavy entry before or behind a long light tail does not matter |
//! | mirror | (maps) flipped columns mirror densities and samples |
//! | rotation | (maps) columns moved around rotate densities and samples |
//! | refinement | each weight in two, each texel in 2 x 2, keep masses and samples |
//! | bright entry | one entry a million times as bright as the others, at either end, in the middle, in every corner of the map: most samples lie there, and the density is largest there |
//! | zero weights | entries of weight 0 are never drawn and have no density, the first and the last included |
//! | refusal | NaN, infinite and negative entries, no entries, and nothing but zeros are refused, wherever they stand; a sum that overflows is refused, or is none |
//!
//! Masses are compared up to [`RELATIVE`] and [`ABSOLUTE`], which leaves room for tables in `f32`. Samples are compared by chi-square tests of homogeneity; their
//! p-values are corrected together by the [`Report`]. A builder that refuses an input, or panics on it, fails the relation; so does a table of another
//! size than its input. A map is taken as constant in each texel; one that is interpolated does not keep to refinement.

use super::examination::{Against, Examination};
use super::expectation::LEAST;
use super::finding::{Evidence, Finding, Verdict};
use super::report::Report;
use super::setters::setters;
use super::settings::Settings;
use crate::domain::{Discrete, Domain, Location, Space, Sphere};
use crate::random::{ONE_MINUS_EPSILON_F32, ONE_MINUS_EPSILON_F64, fill_unit, stream};
use crate::sampler::Sampler;
use crate::statistics::chi_square;
use std::cell::Cell as Counter;
use std::f64::consts::PI;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// Relative difference of two masses that nobody minds.
pub const RELATIVE: f64 = 1e-4;
/// Difference of two masses that nobody minds.
pub const ABSOLUTE: f64 = 1e-6;

/// Points whose bits are compared.
const POINTS: usize = 4096;
/// How bright the one bright entry is, among ones.
const BRIGHT: f64 = 1e6;
/// Entries of the short list of weights.
const FEW: usize = 37;
/// Entries of the long light tail, and the weight of each beside one entry of 1: less than half a step of `f32` at 1.
const TAIL: (usize, f64) = (100_000, 5e-8);
/// Of a long table, one in so many samples is drawn: it may be searched one by one.
const LONG_SHARE: u64 = 4;
/// Columns and rows of maps; no multiples of each other.
const SIZE: (usize, usize) = (12, 7);
/// Blocks of entries that samples and masses are summed over.
const BLOCKS: usize = 128;
/// How far rounding moves a direction over the border of a texel, in radians.
const BORDER: f64 = 3e-6;

/// Relations for a builder of discrete tables: from weights to a sampler of their indices, in their order.
///
/// ```
/// use warpcheck::sampler::DiscreteCdf;
/// use warpcheck::verify::metamorphic;
/// metamorphic::weights(DiscreteCdf::new).name("CDF").run().assert();
/// ```
pub fn weights<'a, S, E>(build: impl Fn(&[f64]) -> Result<S, E> + 'a) -> Relations<'a>
where
    S: Sampler<Domain = Discrete> + 'a,
    E: Display,
{
    Relations::new("weights", true, move |input: &Input| {
        let (table, entries) = (hold(build(&input.values))?, input.values.len());
        match table.space().patches() {
            found if found == entries => Ok(table),
            found => Err(format!("it has {found} entries for {entries} weights")),
        }
    })
}

/// Relations for a builder of environment maps: from width, height and linear RGB texels, row by row, to a sampler of directions. The frame is that of
/// [`Environment`](crate::sampler::Environment): row 0 at theta = 0 (+Z), column 0 from phi = 0 (+X) towards +Y.
///
/// ```
/// use warpcheck::sampler::{Environment, RowWarp};
/// use warpcheck::verify::metamorphic;
/// metamorphic::maps(|width, height, texels| Environment::new(width, height, texels, RowWarp::UniformV)).run().assert();
/// ```
pub fn maps<'a, S, E>(build: impl Fn(usize, usize, Vec<[f32; 3]>) -> Result<S, E> + 'a) -> Relations<'a>
where
    S: Sampler<Domain = Sphere> + 'a,
    E: Display,
{
    Relations::new("map", false, move |input: &Input| {
        hold(build(input.width, input.height(), input.texels()))
    })
}

fn hold<'a, S: Sampler + 'a, E: Display>(built: Result<S, E>) -> Result<Box<dyn Table + 'a>, String> {
    match built {
        Ok(sampler) => Ok(Box::new(Held { domain: sampler.domain(), sampler: Box::new(sampler) })),
        Err(error) => Err(format!("the builder refuses it: {error}")),
    }
}

/// What a builder is asked to build from.
#[derive(Clone)]
struct Input {
    name: String,
    /// Columns; of a list, all of it.
    width: usize,
    /// Weights, or brightnesses row by row.
    values: Vec<f64>,
    list: bool,
}

impl Input {
    fn list(name: &str, values: Vec<f64>) -> Self {
        Self { name: name.to_owned(), width: values.len(), values, list: true }
    }

    fn height(&self) -> usize {
        self.values.len() / self.width
    }

    /// Coloured by their brightness, in a way that no power of two changes.
    fn texels(&self) -> Vec<[f32; 3]> {
        let colour = |&v: &f64| {
            let mantissa = if v > 0.0 { v / v.log2().floor().exp2() } else { 1.0 };
            [v * mantissa, v, v * (3.0 - mantissa)].map(|channel| channel as f32)
        };
        self.values.iter().map(colour).collect()
    }

    fn is_long(&self) -> bool {
        self.values.len() > TAIL.0
    }

    /// The entry that a location lies in.
    fn entry_of(&self, location: &Location) -> usize {
        if self.list {
            return location.patch;
        }
        let index = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
        index(location.at[0], self.height()) * self.width + index(location.at[1], self.width)
    }

    /// The chart coordinates of a place in an entry, itself in `[0, 1]^2` (down, right).
    fn place(&self, entry: usize, [down, right]: [f64; 2]) -> (usize, [f64; 2]) {
        if self.list {
            return (entry, [0.0; 2]);
        }
        let (row, column) = ((entry / self.width) as f64, (entry % self.width) as f64);
        (0, [(row + down) / self.height() as f64, (column + right) / self.width as f64])
    }

    /// Whether a location is in an entry of weight 0, by more than a rounding.
    fn is_dark(&self, location: &Location) -> bool {
        if self.list || self.values[self.entry_of(location)] > 0.0 {
            return self.values[self.entry_of(location)] == 0.0;
        }
        let [v, u] = location.at;
        let (down, right) = (BORDER / PI, BORDER / (2.0 * PI * (PI * v).sin().max(BORDER)));
        [[-down, 0.0], [down, 0.0], [0.0, -right], [0.0, right]].into_iter().all(|[dv, du]| {
            let at = [(v + dv).clamp(0.0, 1.0), (u + du).rem_euclid(1.0)];
            self.values[self.entry_of(&Location { patch: 0, at })] == 0.0
        })
    }

    fn named(&self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self.clone() }
    }

    fn with(&self, name: impl Into<String>, value: impl Fn(usize) -> f64) -> Self {
        Self { values: (0..self.values.len()).map(value).collect(), ..self.named(name) }
    }
}

/// A sampler that was built, as the relations see it.
trait Table {
    fn space(&self) -> &dyn Space;
    fn dimensions(&self) -> usize;
    /// Density and Jacobian of the chart.
    fn density_at(&self, patch: usize, at: [f64; 2]) -> (f64, f64);
    /// Where a sample lies, or why it lies nowhere; `None` if it is rejected.
    fn location(&self, xi: &[f64]) -> Option<Result<Location, String>>;
    /// Point and density, to the last digit.
    fn sample(&self, xi: &[f64]) -> String;
}

struct Held<'a, D: Domain> {
    sampler: Box<dyn Sampler<Domain = D> + 'a>,
    domain: D,
}

impl<D: Domain> Table for Held<'_, D> {
    fn space(&self) -> &dyn Space {
        &self.domain
    }

    fn dimensions(&self) -> usize {
        self.sampler.dimensions()
    }

    fn density_at(&self, patch: usize, at: [f64; 2]) -> (f64, f64) {
        let (point, jacobian) = self.domain.point(patch, at);
        (self.sampler.density(&point), jacobian)
    }

    fn location(&self, xi: &[f64]) -> Option<Result<Location, String>> {
        let point = self.sampler.sample(xi)?.point;
        Some(self.domain.locate(&point).map_err(|why| format!("xi = {xi:?} gives {point:?}, which {why}")))
    }

    fn sample(&self, xi: &[f64]) -> String {
        self.sampler
            .sample(xi)
            .map_or("rejected".to_owned(), |s| format!("{:?} of density {:?}", s.point, s.density))
    }
}

/// Relations that are being set up; see [`weights`] and [`maps`].
pub struct Relations<'a> {
    build: Box<dyn Fn(&Input) -> Result<Box<dyn Table + 'a>, String> + 'a>,
    list: bool,
    name: String,
    settings: Settings,
}

impl<'a> Relations<'a> {
    setters! {
        name: "What the report calls the table.";
        samples: "How many samples to draw from each table that is built; 65,536 unless told.";
        seed: "The seed; 1 unless told.";
        alpha: "The probability that a right builder fails, at most; 1e-3 unless told.";
        settings;
        run: "Asks, and judges the answers.";
    }

    fn new(
        name: &str,
        list: bool,
        build: impl Fn(&Input) -> Result<Box<dyn Table + 'a>, String> + 'a,
    ) -> Self {
        let settings = Settings { samples: 1 << 16, ..Settings::default() };
        Self { build: Box::new(build), list, name: name.to_owned(), settings }
    }

    /// Leaves a relation out, by its name: "refusal" for a builder that has a use for negative weights.
    pub fn without(mut self, relation: &str) -> Self {
        self.settings.without.push(relation.to_owned());
        self
    }

    /// Asks without judging, so that several builders can be judged in one [`Report`].
    pub fn examine(self) -> Examination {
        let start = Instant::now();
        let asking = Asking { relations: &self, drawn: Counter::new(0), streams: Counter::new(0) };
        let mut findings = if self.list { asking.of_weights() } else { asking.of_maps() };
        findings.retain(|finding| !self.settings.without.iter().any(|name| name == finding.check));
        let domain: &dyn Space = if self.list { &Discrete::new(FEW) } else { &Sphere };
        Examination {
            findings,
            time: start.elapsed(),
            ..Examination::bare(self.name.clone(), domain, asking.drawn.get(), Against::Relations)
        }
    }
}

/// Samples by entry, and those that lie in none.
struct Counts {
    entries: Vec<u64>,
    rejected: u64,
}

/// What one relation found so far.
struct Relation {
    name: &'static str,
    wrong: Vec<String>,
    /// p-values, and what was compared.
    tests: Vec<(f64, String)>,
    asked: u64,
}

impl Relation {
    fn new(name: &'static str) -> Self {
        Self { name, wrong: Vec::new(), tests: Vec::new(), asked: 0 }
    }

    /// Asks one question, about the input of this name.
    fn ask(&mut self, input: &str, question: impl FnOnce(&mut Self) -> Result<(), String>) {
        self.asked += 1;
        let answer = catch_unwind(AssertUnwindSafe(|| question(self))).unwrap_or_else(|panic| {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
            Err(format!("it panics: {text}"))
        });
        if let Err(why) = answer {
            self.wrong.push(format!("{input}: {why}"));
        }
    }

    fn findings(self) -> Vec<Finding> {
        let (asked, more) = (self.asked, self.wrong.len().saturating_sub(1));
        let detail = match self.wrong.first() {
            None => format!("holds for {asked} inputs"),
            Some(first) if more == 0 => format!("one of {asked} inputs breaks it. {first}"),
            Some(first) => format!("{} of {asked} inputs break it. The first: {first}", more + 1),
        };
        let verdict = if self.wrong.is_empty() { Verdict::Pass } else { Verdict::Fail };
        let mut findings = vec![Finding::certain(self.name, verdict, detail)];
        let tests = self.tests.len() as f64;
        if let Some((p, what)) = self.tests.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
            let p = (p * tests).min(1.0);
            let evidence = Evidence::Chance { p, conservative: p };
            findings.push(Finding::new(self.name, evidence, what).part("samples"));
        }
        findings
    }
}

struct Asking<'a, 'b> {
    relations: &'b Relations<'a>,
    drawn: Counter<u64>,
    /// Every table that is drawn from has a stream of its own.
    streams: Counter<u64>,
}

impl<'a> Asking<'a, '_> {
    fn build(&self, input: &Input) -> Result<Box<dyn Table + 'a>, String> {
        (self.relations.build)(input)
    }

    fn of_weights(&self) -> Vec<Finding> {
        let wave = |i: usize| if i.is_multiple_of(6) { 0.0 } else { 1.5 + (i as f64 * 1.7).sin() };
        let uneven = Input::list("uneven weights", (0..FEW).map(wave).collect());
        let orders: [(&str, Box<dyn Fn(usize) -> usize>); 2] = [
            ("uneven weights, reversed", Box::new(|i| FEW - 1 - i)),
            ("uneven weights, every fifth", Box::new(|i| 5 * i % FEW)),
        ];
        let mut permutation = Relation::new("permutation");
        for (name, order) in orders {
            let moved = uneven.with(name, |i| uneven.values[order(i)]);
            permutation.ask(name, |r| self.compare(r, &uneven, &moved, &order));
        }
        let long = TAIL.0 + 1;
        let tail = |i: usize| if i == 0 { 1.0 } else { TAIL.1 };
        let tail = Input::list("a heavy weight before a light tail", (0..long).map(tail).collect());
        let back = |i: usize| long - 1 - i;
        let behind = tail.with("a heavy weight behind a light tail", |i| tail.values[back(i)]);
        permutation
            .ask("a heavy weight before and behind a light tail", |r| self.compare(r, &tail, &behind, &back));

        let mut refinement = Relation::new("refinement");
        // Halves, and a quarter and three of them in turn: a table of squared weights keeps to halves alone.
        let share = |i: usize| [0.5, 0.5, 0.25, 0.75][i % 4];
        let halves = (0..2 * FEW).map(|i| share(i) * uneven.values[i / 2]).collect();
        let halves = Input::list("uneven weights, each in two", halves);
        refinement.ask(&halves.name, |r| self.compare(r, &uneven, &halves, &|i| i / 2));

        let bright = [("first", 0), ("middle", FEW / 2), ("last", FEW - 1)];
        let only = |at: usize| {
            uneven.with(format!("only weight {at} is not 0"), move |i| f64::from(u8::from(i == at)))
        };
        let zeros = [
            uneven.clone(),
            uneven.with("every second weight is 0, the last as well", |i| (i % 2) as f64),
            uneven.with("zeros but for five in the middle", |i| f64::from(u8::from((16..21).contains(&i)))),
            only(0),
            only(FEW - 1),
        ];
        let relations = [
            self.scaling(&uneven),
            permutation,
            refinement,
            self.bright(&uneven, &bright),
            self.zeros(&zeros),
            self.refusal(&uneven),
        ];
        relations.into_iter().flat_map(Relation::findings).collect()
    }

    fn of_maps(&self) -> Vec<Finding> {
        let (width, height) = SIZE;
        let wave = |i: usize| 1.5 + ((i % width) as f64 * 1.7).sin() + 0.3 * (i / width) as f64;
        let values = (0..width * height).map(wave).collect();
        let uneven = Input { name: format!("an uneven {width} x {height} map"), width, values, list: false };
        let column_from = |column: &dyn Fn(usize) -> usize, i: usize| i / width * width + column(i % width);

        let mut mirror = Relation::new("mirror");
        let flip = |i: usize| column_from(&|column| width - 1 - column, i);
        let flipped = uneven.with("the map mirrored", |i| uneven.values[flip(i)]);
        mirror.ask(&flipped.name, |r| self.compare(r, &uneven, &flipped, &flip));

        let mut rotation = Relation::new("rotation");
        for by in [1, 5] {
            let turn = |i: usize| column_from(&|column| (column + width - by) % width, i);
            let turned = uneven.with(format!("the map rotated by {by} columns"), |i| uneven.values[turn(i)]);
            rotation.ask(&turned.name, |r| self.compare(r, &uneven, &turned, &turn));
        }

        let mut refinement = Relation::new("refinement");
        let coarse = |i: usize| i / (2 * width) / 2 * width + i % (2 * width) / 2;
        let fine = Input {
            name: "each texel in 2 x 2".into(),
            width: 2 * width,
            values: (0..4 * width * height).map(|i| uneven.values[coarse(i)]).collect(),
            list: false,
        };
        refinement.ask(&fine.name, |r| self.compare(r, &uneven, &fine, &coarse));

        let at = |column: usize, row: usize| row * width + column;
        let bright = [
            ("left of the top row", at(0, 0)),
            ("right of the top row", at(width - 1, 0)),
            ("left of the bottom row", at(0, height - 1)),
            ("right of the bottom row", at(width - 1, height - 1)),
            ("middle of the top row", at(width / 2, 0)),
            ("middle of the bottom row", at(width / 2, height - 1)),
            ("middle", at(width / 2, height / 2)),
            ("left", at(0, height / 2)),
            ("right", at(width - 1, height / 2)),
        ];
        let dark = |name: &str, is_dark: &dyn Fn(usize, usize) -> bool| {
            uneven.with(name, |i| if is_dark(i % width, i / width) { 0.0 } else { uneven.values[i] })
        };
        let zeros = [
            dark("a map with a dark first row and column", &|column, row| column == 0 || row == 0),
            dark("a map with a dark last row and column", &|column, row| {
                column == width - 1 || row == height - 1
            }),
            dark("a chequered map", &|column, row| (column + row) % 2 == 0),
        ];
        let relations = [
            self.scaling(&uneven),
            mirror,
            rotation,
            refinement,
            self.bright(&uneven, &bright),
            self.zeros(&zeros),
            self.refusal(&uneven),
        ];
        relations.into_iter().flat_map(Relation::findings).collect()
    }

    /// Powers of two change no bit.
    fn scaling(&self, input: &Input) -> Relation {
        let mut relation = Relation::new("scaling");
        for exponent in [60, -60] {
            let factor = 2.0_f64.powi(exponent);
            let name = format!("{}, times 2^{exponent}", input.name);
            let scaled = input.with(&name, |i| factor * input.values[i]);
            relation.ask(&name, |_| {
                let (plain, scaled) = (self.build(input)?, self.build(&scaled)?);
                for entry in 0..input.values.len() {
                    let (patch, at) = input.place(entry, [0.4, 0.3]);
                    let (a, b) = (plain.density_at(patch, at).0, scaled.density_at(patch, at).0);
                    if a.to_bits() != b.to_bits() {
                        return Err(format!(
                            "the density in entry {entry} is {b:?}, and {a:?} without the factor"
                        ));
                    }
                }
                for xi in edges(plain.dimensions()).chain(self.some_variates(plain.dimensions())) {
                    let (a, b) = (plain.sample(&xi), scaled.sample(&xi));
                    if a != b {
                        return Err(format!("xi = {xi:?} gives {b}, and {a} without the factor"));
                    }
                }
                Ok(())
            });
        }
        relation
    }

    /// The masses and samples of `moved`, entry i of which is or lies in entry `of(i)` of `base`.
    fn compare(
        &self,
        relation: &mut Relation,
        base: &Input,
        moved: &Input,
        of: &dyn Fn(usize) -> usize,
    ) -> Result<(), String> {
        let table = self.build(base).map_err(|why| format!("{}: {why}", base.name))?;
        let other = self.build(moved)?;
        let entries = base.values.len();
        let block = |entry: usize| if entries <= BLOCKS { entry } else { entry * BLOCKS / entries };
        let there = masses(&*other, moved);
        let here = masses(&*table, base);
        let mut joined = vec![0.0; entries];
        there.iter().enumerate().for_each(|(i, mass)| joined[of(i)] += mass);
        let blocks = |masses: &[f64]| {
            let mut sums = vec![0.0; entries.min(BLOCKS)];
            masses.iter().enumerate().for_each(|(i, mass)| sums[block(i)] += mass);
            sums
        };
        let differ = |a: f64, b: f64| !((a - b).abs() <= RELATIVE * a.abs().max(b.abs()) + ABSOLUTE);
        for (what, a, b) in [("entry", &here, &joined), ("block", &blocks(&here), &blocks(&joined))] {
            if let Some(i) = (0..a.len()).find(|&i| differ(a[i], b[i])) {
                return Err(format!(
                    "{what} {i} of {} had the mass {:e}, and here it has {:e}",
                    base.name, a[i], b[i]
                ));
            }
        }
        let (a, b) = (self.count(&*table, base)?, self.count(&*other, moved)?);
        let mut columns = vec![(0, 0); entries.min(BLOCKS)];
        a.entries.iter().enumerate().for_each(|(i, count)| columns[block(i)].0 += count);
        b.entries.iter().enumerate().for_each(|(i, count)| columns[block(of(i))].1 += count);
        columns.push((a.rejected, b.rejected));
        // Light columns share one, by the counts of both.
        let is_light = |pair: &(u64, u64)| ((pair.0 + pair.1) as f64) < 2.0 * LEAST;
        let pool = columns.iter().filter(|p| is_light(p)).fold((0, 0), |sum, p| (sum.0 + p.0, sum.1 + p.1));
        columns.retain(|pair| !is_light(pair));
        columns.push(pool);
        let (first, second): (Vec<u64>, Vec<u64>) = columns.into_iter().unzip();
        if let Ok(figure) = chi_square::two_sample(&first, &second) {
            let (statistic, df) = (figure.statistic, figure.df);
            let what = format!(
                "X^2 = {statistic:.1} at {df} degrees of freedom: {} against {}",
                moved.name, base.name
            );
            relation.tests.push((figure.p, what));
        }
        Ok(())
    }

    /// One bright entry is found where it is.
    fn bright(&self, input: &Input, places: &[(&str, usize)]) -> Relation {
        let mut relation = Relation::new("bright entry");
        for &(place, bright) in places {
            let name = format!("the bright entry is {place}, at {}", where_is(input, bright));
            let input = input.with(&name, |i| if i == bright { BRIGHT } else { 1.0 });
            relation.ask(&name, |_| {
                let table = self.build(&input)?;
                let density = |entry: usize| {
                    let (patch, at) = input.place(entry, [0.5; 2]);
                    table.density_at(patch, at).0
                };
                let (largest, most) = largest(input.values.len(), density);
                if largest != bright {
                    return Err(format!("the density is largest at {}, {most:e}", where_is(&input, largest)));
                }
                let counts = self.count(&*table, &input)?;
                let (found, all) = (counts.entries[bright], self.samples(&input));
                if 2 * found <= all {
                    let (crowd, _) = largest_count(&counts.entries);
                    let crowd = where_is(&input, crowd);
                    return Err(format!("{found} of {all} samples lie there; most of them at {crowd}"));
                }
                Ok(())
            });
        }
        relation
    }

    /// Entries of weight 0 are never drawn, and have no density.
    fn zeros(&self, inputs: &[Input]) -> Relation {
        let mut relation = Relation::new("zero weights");
        for input in inputs {
            relation.ask(&input.name, |_| {
                let table = self.build(input)?;
                let has_density =
                    |&(entry, mass): &(usize, f64)| input.values[entry] == 0.0 && mass > ABSOLUTE;
                if let Some((entry, mass)) = masses(&*table, input).into_iter().enumerate().find(has_density)
                {
                    return Err(format!("the mass at {} is {mass:e}, its weight 0", where_is(input, entry)));
                }
                for xi in edges(table.dimensions()).chain(self.some_variates(table.dimensions())) {
                    match table.location(&xi) {
                        Some(Ok(location)) if input.is_dark(&location) => {
                            let place = where_is(input, input.entry_of(&location));
                            return Err(format!("xi = {xi:?} draws {place}, of weight 0"));
                        }
                        Some(Err(why)) => return Err(why),
                        _ => {}
                    }
                }
                Ok(())
            });
        }
        relation
    }

    /// What can't be sampled is refused.
    fn refusal(&self, uneven: &Input) -> Relation {
        let mut relation = Relation::new("refusal");
        let last = uneven.values.len() - 1;
        let mut bad: Vec<Input> = Vec::new();
        for (place, at) in [("first", 0), ("middle", last / 2), ("last", last)] {
            for value in [f64::NAN, f64::INFINITY, -1.0] {
                let name = format!("the {place} entry is {value}");
                bad.push(uneven.with(name, |i| if i == at { value } else { uneven.values[i] }));
            }
        }
        bad.push(uneven.with("all entries are 0", |_| 0.0));
        if uneven.list {
            bad.push(Input { values: Vec::new(), ..uneven.named("no entries") });
        }
        for input in bad {
            relation.ask(&input.name, |_| match self.build(&input) {
                Err(_) => Ok(()),
                Ok(_) => Err("it is accepted".to_owned()),
            });
        }
        // Each of them is a number even in f32, their sum is not.
        let huge = uneven.with("entries of 1e38 each", |_| 1e38);
        relation.ask(&huge.name, |_| {
            let Ok(table) = self.build(&huge) else { return Ok(()) };
            let masses = masses(&*table, &huge);
            match masses.iter().position(|&mass| !(mass > 0.0 && mass < 1.0)) {
                Some(entry) => Err(format!("the mass at {} is {}", where_is(&huge, entry), masses[entry])),
                None => Ok(()),
            }
        });
        relation
    }

    fn samples(&self, input: &Input) -> u64 {
        let samples = self.relations.settings.samples;
        if input.is_long() { samples.div_ceil(LONG_SHARE) } else { samples }
    }

    fn variates(&self, dimensions: usize, count: u64) -> impl Iterator<Item = Vec<f64>> + use<> {
        let number = self.streams.replace(self.streams.get() + 1);
        let mut rng = stream(self.relations.settings.seed, "metamorphic", number);
        self.drawn.set(self.drawn.get() + count);
        (0..count).map(move |_| {
            let mut xi = vec![0.0; dimensions];
            fill_unit(&mut rng, &mut xi);
            xi
        })
    }

    fn some_variates(&self, dimensions: usize) -> impl Iterator<Item = Vec<f64>> + use<> {
        self.variates(dimensions, POINTS as u64)
    }

    fn count(&self, table: &dyn Table, input: &Input) -> Result<Counts, String> {
        let mut counts = Counts { entries: vec![0; input.values.len()], rejected: 0 };
        for xi in self.variates(table.dimensions(), self.samples(input)) {
            match table.location(&xi) {
                Some(location) => counts.entries[input.entry_of(&location?)] += 1,
                None => counts.rejected += 1,
            }
        }
        Ok(counts)
    }
}

/// The mass of every entry: of texels by Gauss' 4 points in theta, which leave nothing of a sine, and 4 midpoints in phi.
fn masses(table: &dyn Table, input: &Input) -> Vec<f64> {
    const SIDE: usize = 4;
    const GAUSS: [(f64, f64); SIDE] = [
        (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
        (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
        (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
        (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
    ];
    let mass = |entry: usize| {
        if input.list {
            return table.density_at(entry, [0.0; 2]).0;
        }
        let mut sum = 0.0;
        for (down, weight) in GAUSS {
            for column in 0..SIDE {
                let (patch, at) = input.place(entry, [down, (column as f64 + 0.5) / SIDE as f64]);
                let (density, jacobian) = table.density_at(patch, at);
                sum += weight / SIDE as f64 * density * jacobian;
            }
        }
        sum / input.values.len() as f64
    };
    (0..input.values.len()).map(mass).collect()
}

fn where_is(input: &Input, entry: usize) -> String {
    if input.list {
        format!("index {entry}")
    } else {
        format!("column {}, row {}", entry % input.width, entry / input.width)
    }
}

fn largest(entries: usize, of: impl Fn(usize) -> f64) -> (usize, f64) {
    let all = (0..entries).map(|entry| (entry, of(entry)));
    all.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN))
}

fn largest_count(counts: &[u64]) -> (usize, f64) {
    largest(counts.len(), |entry| counts[entry] as f64)
}

/// The ends and the middle of each variate, in all combinations up to four of them.
fn edges(dimensions: usize) -> impl Iterator<Item = Vec<f64>> {
    let values = [0.0, 0.5, f64::from(ONE_MINUS_EPSILON_F32), ONE_MINUS_EPSILON_F64];
    let combined = dimensions.min(4) as u32;
    (0..values.len().pow(combined)).map(move |code| {
        let digit = |i: usize| values[code / values.len().pow((i as u32).min(combined - 1)) % values.len()];
        (0..dimensions).map(digit).collect()
    })
}
