//! Are several estimates of one picture right, and not only alike?
//!
//! Every estimate is made of independent batches, pictures of a few passes each, so that how means scatter is seen and not assumed. For each
//! pair of estimates, tile and channel, Welch's test of the batch means gives a p-value; the mean over the tiles of the relative difference
//! gives three more, which see what is small everywhere. All p-values of all pairs are corrected together (Holm). A map and a histogram of the
//! p-values show the rest (Jung, Hanika and Dachsbacher, "Detecting Bias in Monte Carlo Renderers using Welch's t-test", JCGT 9(2), 2020).
//!
//! Welch's test wants means that are normal. Light that comes in few, bright samples makes others: as long as none has come, the mean is
//! too small and its standard error knows nothing of it. So a tile
//!
//! - is *unseen* if it shows a lobe that so many samples of the strategy hardly find (those of lights, and sharp mirrors), or if fewer than
//!   [`Criteria::least_seen`] samples make up its mean in either estimate (Kish's effective number, see [`Blocks::effective`]). What is unseen here can be unseen in a tile that is bright for other reasons, so
//!   its neighbours are *beside* it, unless they are a hundred times brighter than either estimate of it, and neither is tested;
//! - is *thin* if fewer than [`Criteria::least_effective`] do; is *skewed* if the skewness of the batch means is more than 4 standard errors
//!   sqrt(6 / batches), as it is if less than about six samples decide; neighbours of skewed tiles count as skewed, since those may have had bad luck.
//!   Such tiles are put together, 2 x 2, 4 x 4, … places at a time, until they are neither, or they stay untested;
//! - hangs on *few pixels* if its difference would make the pair differ, and is nothing (p over 1%) without the three pixels that make up most of
//!   it. The corner of a small lamp that no sample has met yet looks like that, and so does a firefly; so does a mistake
//!   in three pixels, which more samples or smaller tiles tell apart;
//! - has a *tail around* it if its difference would make the pair differ, and would not if its means scattered as those of some tile at most four
//!   tiles away do. A lamp so small that one sample in a tile finds it, or none, makes a tile too dark without a sign of it, but not eighty of them;
//! - is *dark* if no estimate has seen light in it. That is agreement as far as anybody can tell, and is counted apart; two pictures that are dark
//!   all over are inconclusive.
//!
//! What stays untested is named, and makes a pair inconclusive if it would have been an alarm, or is more than [`Criteria::negligible`] of the light or
//! [`Criteria::negligible_tiles`] of the tiles. Events so rare that no estimate has a tile full of them leave no trace.
//!
//! What agreement is worth is said as an equivalence: the means differ by less than so much with 99% confidence ([`Pair::brightness_within`],
//! [`Pair::tiles_within`]), the ends of the intervals of the same tests.

use super::film::pixels_of_block;
use super::reach::out_of_reach;
use super::{Blocks, Error, Film, Judgement, Lights, Progress, Settings, Strategy, render};
use crate::picture::Picture;
use crate::random::stream;
use crate::scene::Scene;
use crate::statistics::welch::{Summary, welch_t_test};
use crate::statistics::{Moments, multiplicity, student_t};
use glam::DVec3;
use rand::Rng;

/// Confidence of the statement of equivalence.
pub const CONFIDENCE: f64 = 0.99;
/// Batches that a picture is made in, if it has as many passes.
const BATCHES: u32 = 32;
/// Fewest batches whose scatter says something.
const LEAST_BATCHES: u32 = 16;
/// Relative error that `f32` radiance has in any case.
const ROUNDING: f64 = 1e-6;
/// The count of a mean that is given with its error: as good as infinite.
const KNOWN: u64 = 1 << 40;
/// Standard errors of the skewness beyond which a mean is not normal.
const SKEWED: f64 = 4.0;
/// What is unseen in a tile matters to a neighbour from this share of its radiance on.
const NOTICED: f64 = 0.01;
/// Tiles are put together up to 2^3 along a side.
const LEVELS: u32 = 3;
/// Pixels that a difference must not hang on alone.
const HANGING: usize = 3;
/// The p-value from which on what is left without them is nothing.
const NOTHING_LEFT: f64 = 0.01;
/// Tiles to each side whose scatter a difference must stand out from.
const AROUND: usize = 4;

/// An estimate of a picture, tile by tile.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Whose it is.
    pub name: String,
    /// Pixels along the side of a tile.
    pub size: usize,
    /// Tiles in a row.
    pub columns: usize,
    /// Rows of tiles.
    pub rows: usize,
    /// Samples that were NaN or infinite, and count as 0.
    pub non_finite: u64,
    tiles: Vec<Tile>,
    batches: usize,
    /// Tiles with lobes that the samples hardly find.
    out_of_reach: Vec<bool>,
    /// All batches together; `None` if only tiles are known.
    film: Option<Film>,
}

#[derive(Clone, Debug, PartialEq)]
struct Tile {
    pixels: f64,
    /// Means of the batches, or one that is known.
    means: Vec<[f64; 3]>,
    /// The standard error of one that is known.
    error: [f64; 3],
    /// Kish's number is the square of the sum over the sum of squares, over samples.
    sum: [f64; 3],
    squares: [f64; 3],
}

/// A channel of some tiles together.
#[derive(Clone, Copy)]
struct Together {
    summary: Summary,
    skewness: f64,
    effective: f64,
}

impl Estimate {
    /// From independent films of one size, each with the same number of passes.
    ///
    /// # Panics
    /// If there are fewer than 16 films, or `size` is 0.
    pub fn from_films(name: impl Into<String>, films: &[Film], size: usize) -> Self {
        assert!(
            films.len() >= LEAST_BATCHES as usize,
            "the scatter of {} pictures says nothing",
            films.len()
        );
        let mut estimate =
            Self::empty(name.into(), &films[0].blocks(size), films[0].width(), films[0].height());
        films.iter().for_each(|film| estimate.add(film));
        estimate
    }

    /// From a picture, such as another renderer's, whose samples are not known.
    ///
    /// Unless it is said to be `exact`, its noise is estimated from how pixels differ from their neighbours: for a pixel b
    /// between a and c, (2 b - a - c)^2 / 6 has the variance of a pixel as its expectation where radiance is linear across the three, and more where it is not.
    /// Along rows and along columns apart, the less of the two for each tile. Pixels that share samples, as filters make them, look less noisy than they are.
    pub fn from_picture(name: impl Into<String>, picture: &Picture, size: usize, exact: bool) -> Self {
        let (width, height) = (picture.width(), picture.height());
        let mut film = Film::new(width, height);
        for (i, texel) in picture.pixels().iter().enumerate() {
            film.add(i % width, i / width, texel.map(f64::from).into());
        }
        let mut estimate = Self::known(name, &film.blocks(size), width, height);
        for (i, tile) in estimate.tiles.iter_mut().enumerate() {
            let block = pixels_of_block(i, size, [width, height]);
            let variance = if exact { DVec3::ZERO } else { noise(picture, block) };
            tile.error = (variance / tile.pixels).map(f64::sqrt).to_array();
        }
        estimate.film = Some(film);
        estimate
    }

    /// From means that are known with their errors, such as another renderer's. `width` and `height` are those of the picture.
    pub fn known(name: impl Into<String>, blocks: &Blocks, width: usize, height: usize) -> Self {
        let mut estimate = Self::empty(name.into(), blocks, width, height);
        for (i, tile) in estimate.tiles.iter_mut().enumerate() {
            (tile.means, tile.error) = (vec![blocks.means[i]], blocks.standard_errors[i]);
        }
        estimate
    }

    /// Samples a pixel of all batches; `None` for what is known without samples.
    pub fn samples(&self) -> Option<u64> {
        self.film.as_ref().filter(|_| !self.is_known()).map(|film| film.pixels()[0].count())
    }

    fn empty(name: String, blocks: &Blocks, width: usize, height: usize) -> Self {
        let Blocks { size, columns, rows, .. } = *blocks;
        let along = |i: usize, all: usize| size.min(all - i * size) as f64;
        let tile = |i: usize| Tile {
            pixels: along(i % columns, width) * along(i / columns, height),
            means: Vec::new(),
            error: [0.0; 3],
            sum: [0.0; 3],
            squares: [0.0; 3],
        };
        let tiles = (0..columns * rows).map(tile).collect();
        let out_of_reach = vec![false; columns * rows];
        Self { name, size, columns, rows, non_finite: 0, tiles, batches: 0, out_of_reach, film: None }
    }

    fn add(&mut self, film: &Film) {
        let blocks = film.blocks(self.size);
        let passes = film.pixels()[0].count() as f64;
        for (i, tile) in self.tiles.iter_mut().enumerate() {
            tile.means.push(blocks.means[i]);
            for c in 0..3 {
                let sum = blocks.means[i][c] * tile.pixels * passes;
                tile.sum[c] += sum;
                if blocks.effective[i][c] > 0.0 {
                    tile.squares[c] += sum * sum / blocks.effective[i][c];
                }
            }
        }
        match &mut self.film {
            Some(all) => all.merge(film),
            None => self.film = Some(film.clone()),
        }
        self.batches += 1;
    }

    /// The means of the pixels of some tiles in a channel; `None` if they are not known.
    fn pixels(&self, tiles: &[usize], c: usize) -> Option<Vec<f64>> {
        let film = self.film.as_ref()?;
        let size = [film.width(), film.height()];
        let places = tiles.iter().flat_map(|&t| pixels_of_block(t, self.size, size));
        Some(places.map(|(x, y)| film.pixel(x, y).mean()[c]).collect())
    }

    /// The mean over a batch of some tiles.
    fn batch(&self, tiles: &[usize], batch: usize, c: usize) -> f64 {
        let area: f64 = tiles.iter().map(|&t| self.tiles[t].pixels).sum();
        tiles.iter().map(|&t| self.tiles[t].pixels * self.tiles[t].means[batch][c]).sum::<f64>() / area
    }

    fn mean(&self, tile: usize, c: usize) -> f64 {
        let means = &self.tiles[tile].means;
        means.iter().map(|m| m[c]).sum::<f64>() / means.len() as f64
    }

    /// The tiles at most `reach` places from one, itself among them.
    fn around(&self, tile: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
        let (columns, x, y) = (self.columns, tile % self.columns, tile / self.columns);
        let near = |at: usize, count: usize| at.saturating_sub(reach)..=(at + reach).min(count - 1);
        let (xs, ys) = (near(x, columns), near(y, self.rows));
        ys.flat_map(move |y| xs.clone().map(move |x| y * columns + x))
    }

    fn is_known(&self) -> bool {
        self.batches == 0
    }

    fn together(&self, tiles: &[usize], c: usize) -> Together {
        if self.is_known() {
            let area: f64 = tiles.iter().map(|&t| self.tiles[t].pixels).sum();
            let square =
                tiles.iter().map(|&t| (self.tiles[t].pixels / area * self.tiles[t].error[c]).powi(2));
            let mean = self.batch(tiles, 0, c);
            let summary = Summary { mean, variance: square.sum::<f64>() * KNOWN as f64, count: KNOWN };
            return Together { summary, skewness: 0.0, effective: f64::INFINITY };
        }
        let moments: Moments = (0..self.batches).map(|b| self.batch(tiles, b, c)).collect();
        let (sum, squares) = tiles
            .iter()
            .fold((0.0, 0.0), |(s, q), &t| (s + self.tiles[t].sum[c], q + self.tiles[t].squares[c]));
        Together {
            summary: (&moments).into(),
            skewness: moments.skewness().unwrap_or(0.0) / (6.0 / self.batches as f64).sqrt(),
            effective: if squares > 0.0 { sum * sum / squares } else { 0.0 },
        }
    }
}

/// The variance of a pixel of a block as [`Estimate::from_picture`] says; 0 if no pixel has two neighbours.
fn noise(picture: &Picture, block: impl Iterator<Item = (usize, usize)> + Clone) -> DVec3 {
    let at = |x: usize, y: usize| DVec3::from(picture.at(x, y).map(f64::from));
    let bend = |a: DVec3, b: DVec3, c: DVec3| (2.0 * b - a - c).powf(2.0) / 6.0;
    let rows = block.clone().filter(|&(x, _)| x > 0 && x + 1 < picture.width());
    let columns = block.filter(|&(_, y)| y > 0 && y + 1 < picture.height());
    let rows = mean(rows.map(|(x, y)| bend(at(x - 1, y), at(x, y), at(x + 1, y))));
    let columns = mean(columns.map(|(x, y)| bend(at(x, y - 1), at(x, y), at(x, y + 1))));
    match (rows, columns) {
        (Some(rows), Some(columns)) => rows.min(columns),
        (one, other) => one.or(other).unwrap_or(DVec3::ZERO),
    }
}

/// `None` of nothing.
fn mean(values: impl Iterator<Item = DVec3>) -> Option<DVec3> {
    let (sum, count) = values.fold((DVec3::ZERO, 0), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// The samples a pixel that [`sample`] takes where `spp` are asked for: a multiple of the batches (32, or as many as there are passes; at least 16).
pub fn sampled_passes(spp: u32) -> u32 {
    spp.div_ceil(batches(spp)) * batches(spp)
}

fn batches(spp: u32) -> u32 {
    spp.clamp(LEAST_BATCHES, BATCHES)
}

/// Renders an estimate of [`sampled_passes`] passes a pixel.
/// `on_pass` says whether to go on; `None` if it did not.
///
/// # Panics
/// If `tile` is 0.
pub fn sample(
    scene: &Scene,
    lights: &Lights,
    strategy: Strategy,
    Settings { spp, seed }: Settings,
    tile: usize,
    mut on_pass: impl FnMut(Progress) -> bool,
) -> Option<Estimate> {
    let (batches, passes) = (batches(spp), sampled_passes(spp));
    let empty = Film::new(scene.picture.width as usize, scene.picture.height as usize);
    let mut estimate =
        Estimate::empty(strategy.to_string(), &empty.blocks(tile), empty.width(), empty.height());
    estimate.out_of_reach = out_of_reach(scene, strategy, passes, tile);
    let mut go_on = true;
    for batch in 0..batches {
        // A seed for every strategy and batch: what is compared has to be independent.
        let seed = stream(seed, &format!("agree {strategy}"), u64::from(batch)).next_u64();
        let settings = Settings { spp: passes / batches, seed };
        let rendered = render(scene, lights, strategy, settings, |progress| {
            go_on = on_pass(progress);
            go_on
        });
        if !go_on {
            return None;
        }
        estimate.non_finite += rendered.non_finite;
        estimate.add(&rendered.film);
    }
    Some(estimate)
}

/// When tiles are tested, and what is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Criteria {
    /// Probability that a run of right estimates is judged wrong; 1e-3 by default.
    pub level: f64,
    /// Effective samples below which a tile is unseen; 10 by default.
    pub least_seen: f64,
    /// Effective samples below which it is thin; 100 by default.
    pub least_effective: f64,
    /// Share of the light that may be in untested tiles of a pair that agrees; 1% by default.
    pub negligible: f64,
    /// Share of the tiles with light that may be untested; 5% by default.
    pub negligible_tiles: f64,
}

impl Default for Criteria {
    fn default() -> Self {
        Self {
            level: 1e-3,
            least_seen: 10.0,
            least_effective: 100.0,
            negligible: 0.01,
            negligible_tiles: 0.05,
        }
    }
}

/// Why a tile was not tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doubt {
    /// Hardly a sample of one of the estimates makes up its mean.
    Unseen,
    /// It is next to one that is unseen.
    Beside,
    /// Few samples of one of the estimates do.
    Thin,
    /// So do its brightest ones, or those of a neighbour.
    Skewed,
    /// The two differ in a few pixels, and nowhere else.
    FewPixels,
    /// They differ by no more than tiles near it scatter.
    TailAround,
}

/// What became of a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TileTest {
    /// No estimate has seen light.
    Dark,
    /// Not tested.
    Doubtful(Doubt),
    /// Tested, alone or with others.
    Tested {
        /// The least p-value of its channels, not corrected.
        p: f64,
        /// Difference over mean, first less second, of the channel that this is the p-value of.
        difference: f64,
        /// Places along the side of the square that was tested together.
        together: u32,
    },
}

/// Two estimates beside each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// The first, as its place on the list.
    pub first: usize,
    /// The second.
    pub second: usize,
    /// Tiles in row order.
    pub tiles: Vec<TileTest>,
    /// p-values of all tests of tiles, channels apart.
    pub p_values: Vec<f64>,
    /// Mean relative difference, first less second, and its standard error, for each channel that could be compared.
    pub brightness: [Option<(f64, f64)>; 3],
    /// The mean relative difference is less than this, in every channel, with 99% confidence; infinite if nothing was compared.
    pub brightness_within: f64,
    /// The relative difference of no tested tile is more than this, with 99% confidence for all of them together.
    pub tiles_within: f64,
    /// Share of the light in tiles that were not tested.
    pub untested_light: f64,
    /// The least p-value, corrected for all tests of all pairs.
    pub p: f64,
    /// What it comes to.
    pub judgement: Judgement,
}

impl Pair {
    /// How many tiles are so.
    pub fn count(&self, which: impl Fn(&TileTest) -> bool) -> usize {
        self.tiles.iter().filter(|t| which(t)).count()
    }

    /// Tested tiles.
    pub fn tested(&self) -> usize {
        self.count(|t| matches!(t, TileTest::Tested { .. }))
    }

    /// Tiles with light that were not tested.
    pub fn doubtful(&self) -> usize {
        self.count(|t| matches!(t, TileTest::Doubtful(_)))
    }
}

/// How several estimates agree.
#[derive(Clone, Debug, PartialEq)]
pub struct Accord {
    /// Every two of them.
    pub pairs: Vec<Pair>,
    /// p-values that were corrected together.
    pub tests: usize,
    /// What was allowed.
    pub criteria: Criteria,
    /// Whether an estimate had samples that were NaN or infinite.
    pub non_finite: bool,
}

impl Accord {
    /// What it comes to: that of the worst pair. Samples that are NaN or infinite are wrong whatever the means are.
    pub fn judgement(&self) -> Judgement {
        let any = |j| self.pairs.iter().any(|p| p.judgement == j);
        match () {
            () if self.non_finite || any(Judgement::Differ) => Judgement::Differ,
            () if self.pairs.is_empty() || any(Judgement::Inconclusive) => Judgement::Inconclusive,
            () => Judgement::Agree,
        }
    }
}

/// Compares every two estimates.
///
/// ```
/// use warpcheck::estimator::{Criteria, Judgement, Lights, Settings, Strategy, agree, sample};
/// use warpcheck::scene::Scene;
/// let file = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scene/cornell.toml");
/// let text = std::fs::read_to_string(file)?.replace("256", "32");
/// let scene = Scene::from_toml(&text, file)?;
/// let lights = Lights::load(&scene)?;
/// let settings = Settings { spp: 256, seed: 1 };
/// let estimates = [Strategy::Light, Strategy::Mis { brdf_weight: 0.5 }]
///     .map(|strategy| sample(&scene, &lights, strategy, settings, 8, |_| true).unwrap());
/// let accord = agree(&estimates, Criteria::default())?;
/// assert_eq!(accord.judgement(), Judgement::Agree);
/// assert!(accord.pairs[0].brightness_within < 0.05);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If their tiles are not the same.
pub fn agree(estimates: &[Estimate], criteria: Criteria) -> Result<Accord, Error> {
    let shape = |e: &Estimate| [e.columns, e.rows, e.size];
    if let Some(other) = estimates.iter().find(|e| shape(e) != shape(&estimates[0])) {
        return Err(Error::Shape { first: shape(&estimates[0]), second: shape(other) });
    }
    let (mut pairs, mut p_values) = (Vec::new(), Vec::new());
    let number = estimates.len() * estimates.len().saturating_sub(1) / 2;
    for second in 1..estimates.len() {
        for first in 0..second {
            let (pair, ps) =
                compare_two([&estimates[first], &estimates[second]], [first, second], number, &criteria);
            p_values.push(ps);
            pairs.push(pair);
        }
    }
    let all = p_values.concat();
    let adjusted = multiplicity::holm(&all).unwrap_or_default();
    let mut from = 0;
    for (pair, ps) in pairs.iter_mut().zip(&p_values) {
        pair.p = adjusted[from..from + ps.len()].iter().copied().fold(1.0, f64::min);
        from += ps.len();
        let lit = pair.tested() + pair.doubtful();
        // What would have been an alarm is never negligible.
        let alarmed =
            pair.count(|t| matches!(t, TileTest::Doubtful(Doubt::FewPixels | Doubt::TailAround))) > 0;
        // Two black pictures are no evidence.
        let untested = lit == 0
            || alarmed
            || pair.doubtful() as f64 > criteria.negligible_tiles * lit as f64
            || pair.untested_light > criteria.negligible;
        pair.judgement = match () {
            () if pair.p < criteria.level => Judgement::Differ,
            () if untested => Judgement::Inconclusive,
            () => Judgement::Agree,
        };
    }
    let non_finite = estimates.iter().any(|e| e.non_finite > 0);
    Ok(Accord { pairs, tests: all.len(), criteria, non_finite })
}

/// One test of means: its p-value, the relative difference, its standard error and degrees of freedom.
struct Tested {
    p: f64,
    mean: f64,
    difference: f64,
    error: f64,
    df: f64,
}

fn test(a: Summary, b: Summary) -> Tested {
    let mean = 0.5 * (a.mean + b.mean).abs();
    // Rounding, as a scatter of batches that would explain it.
    let widen =
        |s: Summary| Summary { variance: s.variance + (ROUNDING * mean).powi(2) * s.count as f64, ..s };
    let (a, b) = (widen(a), widen(b));
    let error = (a.variance / a.count as f64 + b.variance / b.count as f64).sqrt();
    // A mean that is no number is as wrong as can be.
    let (p, df) = welch_t_test(a, b).map_or((0.0, 1.0), |w| (w.p, w.df));
    Tested { p, mean, difference: (a.mean - b.mean) / mean, error: error / mean, df }
}

impl Tested {
    /// The largest relative difference that this is compatible with, one of so many statements that hold together.
    fn within(&self, statements: usize) -> f64 {
        let tail = 0.5 * (1.0 - CONFIDENCE) / statements as f64;
        self.difference.abs() + student_t::isf(tail, self.df).unwrap_or(f64::INFINITY) * self.error
    }
}

/// The pair, one of so many, but for what depends on others, and its p-values.
fn compare_two(
    both: [&Estimate; 2],
    [first, second]: [usize; 2],
    number_of_pairs: usize,
    criteria: &Criteria,
) -> (Pair, Vec<f64>) {
    let (columns, rows) = (both[0].columns, both[0].rows);
    let number = columns * rows;
    let lit = |tile: usize, c: usize| both.iter().any(|e| e.mean(tile, c) != 0.0);
    let beyond = |t: usize| both.iter().any(|e| e.out_of_reach[t]);
    let own = |t: usize| if beyond(t) { Some(Doubt::Unseen) } else { doubt(both, &[t], criteria, lit) };
    let doubts: Vec<_> = (0..number).map(own).collect();
    let brightest = |t: usize| (0..3).map(|c| both[0].mean(t, c).max(both[1].mean(t, c))).sum::<f64>();
    let mut tiles: Vec<_> = (0..number)
        .map(|t| match doubts[t] {
            _ if (0..3).all(|c| !lit(t, c)) => TileTest::Dark,
            Some(Doubt::Unseen) => TileTest::Doubtful(Doubt::Unseen),
            _ if both[0]
                .around(t, 1)
                .any(|n| doubts[n] == Some(Doubt::Unseen) && brightest(n) > NOTICED * brightest(t)) =>
            {
                TileTest::Doubtful(Doubt::Beside)
            }
            Some(own) => TileTest::Doubtful(own),
            None if both[0].around(t, 1).any(|n| doubts[n] == Some(Doubt::Skewed)) => {
                TileTest::Doubtful(Doubt::Skewed)
            }
            // Until it is tested.
            None => TileTest::Tested { p: f64::NAN, difference: 0.0, together: 1 },
        })
        .collect();

    // Sets of tiles, and the tests of their channels.
    let mut examined: Vec<(Vec<usize>, Vec<(usize, Tested)>)> = Vec::new();
    let mut examine = |set: &[usize], together: u32, tiles: &mut Vec<TileTest>| {
        let channels = (0..3).filter(|&c| set.iter().any(|&t| lit(t, c)));
        let found: Vec<_> = channels
            .map(|c| (c, test(both[0].together(set, c).summary, both[1].together(set, c).summary)))
            .collect();
        if let Some((_, least)) = found.iter().min_by(|a, b| a.1.p.total_cmp(&b.1.p)) {
            let test = TileTest::Tested { p: least.p, difference: least.difference, together };
            set.iter().for_each(|&t| tiles[t] = test);
        }
        examined.push((set.to_vec(), found));
    };
    for t in 0..number {
        if matches!(tiles[t], TileTest::Tested { .. }) {
            examine(&[t], 1, &mut tiles);
        }
    }
    // What can be put together, in growing squares.
    for side in (1..=LEVELS).map(|level| 1_usize << level) {
        for corner in 0..columns.div_ceil(side) * rows.div_ceil(side) {
            let (left, top) =
                (corner % columns.div_ceil(side) * side, corner / columns.div_ceil(side) * side);
            let set: Vec<_> = (top..(top + side).min(rows))
                .flat_map(|y| (left..(left + side).min(columns)).map(move |x| y * columns + x))
                .filter(|&t| matches!(tiles[t], TileTest::Doubtful(Doubt::Thin | Doubt::Skewed)))
                .collect();
            if set.len() > 1 && doubt(both, &set, criteria, lit).is_none() {
                examine(&set, side as u32, &mut tiles);
            }
        }
    }

    // Only what would be an alarm is looked at again, so that the p-values of right estimates stay uniform.
    let all_tests = examined.iter().map(|(_, found)| found.len()).sum::<usize>() * number_of_pairs;
    let alarm = criteria.level / all_tests.max(1) as f64;
    examined.retain(|(set, found)| {
        let alarms: Vec<_> = found.iter().filter(|(_, t)| t.p < alarm).collect();
        let reason = match () {
            () if alarms.is_empty() => return true,
            () if alarms.iter().all(|(c, t)| hangs_on_few(both, set, *c, t)) => Doubt::FewPixels,
            () if alarms.iter().all(|(c, _)| beside_such_tails(both, set, *c).p >= alarm) => {
                Doubt::TailAround
            }
            () => return true,
        };
        set.iter().for_each(|&t| tiles[t] = TileTest::Doubtful(reason));
        false
    });
    let tests: Vec<_> = examined.into_iter().flat_map(|(_, found)| found).map(|(_, test)| test).collect();

    let p_values: Vec<f64> = tests.iter().map(|t| t.p).collect();
    let tiles_within = tests.iter().map(|t| t.within(tests.len())).reduce(f64::max).unwrap_or(f64::INFINITY);
    let overall = [0, 1, 2].map(|c| brightness(both, &tiles, c, lit));
    let brightness_within =
        overall.iter().flatten().map(|t| t.within(3)).reduce(f64::max).unwrap_or(f64::INFINITY);
    let light = |t: usize| brightest(t) * both[0].tiles[t].pixels;
    // (Not `sum`, which is -0 of nothing.)
    let untested =
        (0..number).filter(|&t| matches!(tiles[t], TileTest::Doubtful(_))).map(light).fold(0.0, |a, b| a + b);
    let all: f64 = (0..number).map(light).sum();
    let mut corrected = p_values.clone();
    corrected.extend(overall.iter().flatten().map(|t| t.p));
    let pair = Pair {
        first,
        second,
        tiles,
        p_values,
        brightness: overall.map(|t| t.map(|t| (t.difference, t.error))),
        brightness_within,
        tiles_within,
        untested_light: if all > 0.0 { untested / all } else { 0.0 },
        p: 1.0,
        judgement: Judgement::Inconclusive,
    };
    (pair, corrected)
}

/// What speaks against testing some tiles as one.
fn doubt(
    both: [&Estimate; 2],
    set: &[usize],
    criteria: &Criteria,
    lit: impl Fn(usize, usize) -> bool,
) -> Option<Doubt> {
    let channels = (0..3).filter(|&c| set.iter().any(|&t| lit(t, c)));
    let seen: Vec<_> = channels.flat_map(|c| both.map(|e| e.together(set, c))).collect();
    match () {
        () if seen.iter().any(|s| s.effective < criteria.least_seen) => Some(Doubt::Unseen),
        () if seen.iter().any(|s| s.skewness.abs() > SKEWED) => Some(Doubt::Skewed),
        () if seen.iter().any(|s| s.effective < criteria.least_effective) => Some(Doubt::Thin),
        () => None,
    }
}

/// Whether the difference of some tiles is nothing without the few pixels that make up most of it; not if pixels are not known.
fn hangs_on_few(both: [&Estimate; 2], set: &[usize], c: usize, test: &Tested) -> bool {
    let [Some(a), Some(b)] = both.map(|e| e.pixels(set, c)) else { return false };
    let mut differences: Vec<f64> =
        a.iter().zip(&b).map(|(a, b)| (a - b) * test.difference.signum()).collect();
    differences.sort_by(|x, y| y.total_cmp(x));
    let left = differences.iter().skip(HANGING).sum::<f64>() / a.len() as f64;
    student_t::sf(left / (test.error * test.mean), test.df).is_ok_and(|tail| 2.0 * tail > NOTHING_LEFT)
}

/// The test of some tiles if their means scattered as those of the restless ones around them, which may have seen what these have not.
fn beside_such_tails(both: [&Estimate; 2], set: &[usize], c: usize) -> Tested {
    let around = || set.iter().flat_map(|&t| both[0].around(t, AROUND));
    let [a, b] = both.map(|e| {
        let own = e.together(set, c).summary;
        let restless = |n: usize| {
            let there = e.together(&[n], c).summary;
            // What is brighter scatters more.
            let scale = if there.mean.abs() > own.mean.abs() { (own.mean / there.mean).powi(2) } else { 1.0 };
            scale * there.variance / set.len() as f64
        };
        Summary { variance: around().map(restless).fold(own.variance, f64::max), ..own }
    });
    test(a, b)
}

/// The mean relative difference over the tiles that were tested alone and are known to a tenth; `None` if it is skewed, or there are none.
fn brightness(
    both: [&Estimate; 2],
    tiles: &[TileTest],
    c: usize,
    lit: impl Fn(usize, usize) -> bool,
) -> Option<Tested> {
    let alone = |t: &usize| matches!(tiles[*t], TileTest::Tested { together: 1, .. }) && lit(*t, c);
    let middle = |t: usize| 0.5 * (both[0].mean(t, c) + both[1].mean(t, c));
    let known = |t: &usize| {
        let squares = both.map(|e| e.together(&[*t], c).summary).map(|s| s.variance / s.count as f64);
        squares.iter().sum::<f64>().sqrt() < 0.1 * middle(*t)
    };
    let used: Vec<_> = (0..tiles.len()).filter(alone).filter(known).collect();
    if used.is_empty() {
        return None;
    }
    let n = used.len() as f64;
    let of = |e: &Estimate| {
        let batch = |b: usize| used.iter().map(|&t| e.tiles[t].means[b][c] / middle(t)).sum::<f64>() / n;
        if e.is_known() {
            let square = used.iter().map(|&t| (e.tiles[t].error[c] / middle(t) / n).powi(2)).sum::<f64>();
            return Some(Summary { mean: batch(0), variance: square * KNOWN as f64, count: KNOWN });
        }
        let moments: Moments = (0..e.batches).map(batch).collect();
        let skewness = moments.skewness().unwrap_or(0.0) / (6.0 / e.batches as f64).sqrt();
        (skewness.abs() <= SKEWED).then_some((&moments).into())
    };
    Some(test(of(both[0])?, of(both[1])?))
}
