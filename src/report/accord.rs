//! How estimates agree: a table for people, JSON for programs, maps and histograms of p-values.

use super::Style;
use crate::estimator::{Accord, Doubt, Estimate, Judgement, Pair, TileTest};
use crate::picture::{Canvas, ColourMap, Field, Heat, Scale, Sheet, Tile};
use crate::verify::{Verdict, p_value};
use std::fmt::Write;

/// Classes of the histogram of p-values.
const CLASSES: usize = 20;
/// Tiles that are named one by one.
const NAMED: usize = 8;

fn word(judgement: Judgement) -> (&'static str, Verdict) {
    match judgement {
        Judgement::Agree => ("agree", Verdict::Pass),
        Judgement::Differ => ("differ", Verdict::Fail),
        Judgement::Inconclusive => ("inconclusive", Verdict::Inconclusive),
    }
}

fn doubt_word(doubt: Doubt) -> &'static str {
    match doubt {
        Doubt::Unseen => "unseen",
        Doubt::Beside => "beside unseen",
        Doubt::Thin => "few samples",
        Doubt::Skewed => "heavy tail",
        Doubt::FewPixels => "differing in three pixels or fewer",
        Doubt::TailAround => "differing no more than tiles near them scatter",
    }
}

/// Untested tiles by the reason for it, and the first of each by column and row.
fn doubts(pair: &Pair, columns: usize) -> Vec<(Doubt, Vec<[usize; 2]>)> {
    let kinds =
        [Doubt::Unseen, Doubt::Beside, Doubt::Thin, Doubt::Skewed, Doubt::FewPixels, Doubt::TailAround];
    let of = |kind| {
        let tiles = pair.tiles.iter().enumerate().filter(move |(_, t)| **t == TileTest::Doubtful(kind));
        (kind, tiles.map(|(i, _)| [i % columns, i / columns]).collect::<Vec<_>>())
    };
    kinds.map(of).into_iter().filter(|(_, tiles)| !tiles.is_empty()).collect()
}

/// The rectangle of pixels that some tiles lie in.
fn around(tiles: &[[usize; 2]], size: usize) -> String {
    let ends = |k: usize| {
        let along = || tiles.iter().map(|t| t[k]);
        (along().min().unwrap_or(0) * size, (along().max().unwrap_or(0) + 1) * size - 1)
    };
    let ((left, right), (top, bottom)) = (ends(0), ends(1));
    format!("within columns {left}..{right}, rows {top}..{bottom}")
}

/// The tile with the least p-value.
fn worst(pair: &Pair) -> Option<(usize, f64, f64)> {
    let tested = pair.tiles.iter().enumerate().filter_map(|(i, t)| match *t {
        TileTest::Tested { p, difference, .. } => Some((i, p, difference)),
        _ => None,
    });
    tested.min_by(|a, b| a.1.total_cmp(&b.1))
}

fn percent(x: f64) -> String {
    match 100.0 * x {
        x if !x.is_finite() => "-".to_owned(),
        x if x < 9.995 => format!("{x:.2}%"),
        x => format!("{x:.0}%"),
    }
}

/// A line for every pair, and below them which tiles were not tested and why, and where the worst differences are.
pub fn accord_table(accord: &Accord, estimates: &[Estimate], style: Style) -> String {
    let mut out = String::new();
    let name = |p: &Pair| format!("{} / {}", estimates[p.first].name, estimates[p.second].name);
    let width = accord.pairs.iter().map(|p| name(p).chars().count()).max().unwrap_or(0).max("pair".len());
    let _ = writeln!(
        out,
        "{:width$}  {:12} {:>9} {:>8} {:>6} {:>8} {:>10}  {:>9} {:>13} {:>12}",
        "pair",
        "verdict",
        "corr. p",
        "tested",
        "dark",
        "untested",
        "of light",
        "p < 5%",
        "means within",
        "tiles within"
    );
    for pair in &accord.pairs {
        let (says, verdict) = word(pair.judgement);
        let below = pair.p_values.iter().filter(|p| **p < 0.05).count() as f64;
        let _ = writeln!(
            out,
            "{:width$}  {} {:>9} {:>8} {:>6} {:>8} {:>10}  {:>9} {:>13} {:>12}",
            name(pair),
            style.paint(&format!("{says:12}"), verdict),
            p_value(pair.p).trim_start_matches("= ").replace("< ", "<"),
            pair.tested(),
            pair.count(|t| *t == TileTest::Dark),
            pair.doubtful(),
            percent(pair.untested_light),
            percent(below / pair.p_values.len().max(1) as f64),
            percent(pair.brightness_within),
            percent(pair.tiles_within)
        );
    }
    let _ = writeln!(
        out,
        "means within: with 99% confidence the mean relative difference of the tiles that were tested alone, and are known to a tenth, is less than this; tiles within: that of every tested tile"
    );
    let size = estimates.first().map_or(1, |e| e.size);
    let columns = estimates.first().map_or(1, |e| e.columns);
    for pair in accord.pairs.iter().filter(|p| p.judgement != Judgement::Agree) {
        let (says, verdict) = word(pair.judgement);
        let _ = writeln!(out, "\n{}: {}", style.paint(says, verdict), name(pair));
        for (kind, tiles) in doubts(pair, columns) {
            let some =
                tiles.iter().take(NAMED).map(|[x, y]| format!("({x}, {y})")).collect::<Vec<_>>().join(" ");
            let more = if tiles.len() > NAMED { " …" } else { "" };
            let _ = writeln!(
                out,
                "  {:4} tiles {}, {}: {some}{more}",
                tiles.len(),
                doubt_word(kind),
                around(&tiles, size)
            );
        }
        if let (Some((tile, p, difference)), Judgement::Differ) = (worst(pair), pair.judgement) {
            let _ = writeln!(
                out,
                "  worst tile ({}, {}): {:+.2}%, p {}",
                tile % columns,
                tile / columns,
                100.0 * difference,
                p_value(p)
            );
        }
        if pair.judgement == Judgement::Differ {
            for (channel, found) in ["red", "green", "blue"].iter().zip(pair.brightness) {
                if let Some((difference, error)) = found {
                    let _ = writeln!(
                        out,
                        "  {channel}: on average {:+.3} ± {:.3}%",
                        100.0 * difference,
                        100.0 * error
                    );
                }
            }
        }
    }
    for estimate in estimates.iter().filter(|e| e.non_finite > 0) {
        let _ = writeln!(
            out,
            "\n{}: {} samples were NaN or infinite and count as black: this is a bug",
            estimate.name, estimate.non_finite
        );
    }
    let (says, verdict) = word(accord.judgement());
    let count = |j| accord.pairs.iter().filter(|p| p.judgement == j).count();
    let _ = writeln!(
        out,
        "\n{}: {} of {} pairs agree, {} differ, {} inconclusive\n\
         tiles of {size} pixels; {} p-values corrected together (Holm): right estimates are judged wrong with probability {:?} at most",
        style.paint(says, verdict),
        count(Judgement::Agree),
        accord.pairs.len(),
        count(Judgement::Differ),
        count(Judgement::Inconclusive),
        accord.tests,
        accord.criteria.level
    );
    out
}

/// Everything that was found. `schema_version` grows when the meaning of a field changes.
#[cfg(feature = "json")]
pub fn accord_to_json(accord: &Accord, estimates: &[Estimate], seed: u64) -> serde_json::Value {
    use serde_json::{Value, json};
    let columns = estimates.first().map_or(1, |e| e.columns);
    // In row order; null where nothing was tested.
    let tile = |test: &TileTest| match *test {
        TileTest::Tested { p, difference, .. } => json!({ "p": p, "relative_difference": difference }),
        TileTest::Dark | TileTest::Doubtful(_) => Value::Null,
    };
    let pairs = accord.pairs.iter().map(|pair| {
        let untested = doubts(pair, columns)
            .into_iter()
            .map(|(kind, tiles)| (doubt_word(kind).to_owned(), json!(tiles)));
        let brightness = pair.brightness.map(|b| {
            b.map_or(
                Value::Null,
                |(difference, error)| json!({ "relative_difference": difference, "standard_error": error }),
            )
        });
        json!({
            "first": estimates[pair.first].name,
            "second": estimates[pair.second].name,
            "verdict": word(pair.judgement).0,
            "p_adjusted": pair.p,
            "tested": pair.tested(),
            "dark": pair.count(|t| *t == TileTest::Dark),
            "untested": untested.collect::<serde_json::Map<_, _>>(),
            "untested_light": pair.untested_light,
            "brightness": brightness,
            "brightness_within": pair.brightness_within,
            "tiles_within": pair.tiles_within,
            "p_classes": classes(pair),
            "tiles": pair.tiles.iter().map(tile).collect::<Vec<_>>(),
        })
    });
    let strategies = estimates
        .iter()
        .map(|e| json!({ "name": e.name, "samples": e.samples(), "non_finite": e.non_finite }));
    json!({
        "kind": "agree",
        "schema_version": 2,
        "program": concat!("warpcheck ", env!("CARGO_PKG_VERSION")),
        "verdict": word(accord.judgement()).0,
        "seed": seed,
        "level": accord.criteria.level,
        "confidence": crate::estimator::AGREEMENT_CONFIDENCE,
        "tests": accord.tests,
        "tile": estimates.first().map_or(0, |e| e.size),
        "columns": columns,
        "estimates": strategies.collect::<Vec<_>>(),
        "pairs": pairs.collect::<Vec<_>>(),
    })
}

/// How many p-values lie in each twentieth of [0, 1].
fn classes(pair: &Pair) -> Vec<u64> {
    let mut classes = vec![0; CLASSES];
    pair.p_values.iter().for_each(|p| classes[((p * CLASSES as f64) as usize).min(CLASSES - 1)] += 1);
    classes
}

/// The map of 1 / p and that of relative differences, and how they are drawn.
pub(super) fn maps(pair: &Pair, estimates: &[Estimate]) -> [(Field, Heat); 2] {
    let p_heat = Heat { map: ColourMap::Inferno, scale: Scale::Log { floor: 1.0, max: 1e6 } };
    let difference_heat = Heat { map: ColourMap::Diverging, scale: Scale::Symmetric { limit: 0.1 } };
    let (columns, rows) = estimates.first().map_or((1, 1), |e| (e.columns, e.rows));
    let field = |f: fn(f64, f64) -> f64| {
        Field::from_fn(columns, rows, |x, y| match pair.tiles[y * columns + x] {
            TileTest::Tested { p, difference, .. } => f(p, difference),
            TileTest::Dark | TileTest::Doubtful(_) => f64::NAN,
        })
    };
    [(field(|p, _| 1.0 / p.max(1e-300)), p_heat), (field(|_, difference| difference), difference_heat)]
}

/// For every pair the map of p-values, the map of relative differences, and the histogram of the p-values beside the uniform law.
pub fn accord_sheet(title: &str, accord: &Accord, estimates: &[Estimate]) -> Canvas {
    let columns = estimates.first().map_or(1, |e| e.columns);
    let mut legends = Vec::new();
    let mut sheet = Sheet::new(title)
        .notes("Chequered tiles have no light or were not tested. Right estimates have p-values spread evenly, and no pattern in the maps.")
        .columns(["1 / p, the least channel", "first less second", "histogram of p-values"])
        .tile_width((columns * 16).clamp(256, 512));
    for pair in &accord.pairs {
        let label = format!("{} / {}", estimates[pair.first].name, estimates[pair.second].name);
        let [(p_map, p_heat), (difference, difference_heat)] = maps(pair, estimates);
        legends = vec![p_heat.legend("1 / p"), difference_heat.legend("relative difference")];
        sheet = sheet.row(
            label,
            [
                Tile::new(p_heat.paint(&p_map)).caption(format!(
                    "{}, corrected p {}",
                    word(pair.judgement).0,
                    p_value(pair.p)
                )),
                Tile::new(difference_heat.paint(&difference)).caption(format!(
                    "means within {}, {} of the light untested",
                    percent(pair.brightness_within),
                    percent(pair.untested_light)
                )),
                Tile::new(histogram(&classes(pair)))
                    .caption(format!("{} tests; the line is the uniform law", pair.p_values.len())),
            ],
        );
    }
    legends.into_iter().fold(sheet, Sheet::legend).draw()
}

/// Bars from the bottom; a line where all would end if p were uniform.
fn histogram(classes: &[u64]) -> Canvas {
    const SIZE: (usize, usize) = (240, 120);
    let mut canvas = Canvas::filled(SIZE.0, SIZE.1, [34, 36, 40]);
    let number: u64 = classes.iter().sum();
    let expected = number as f64 / classes.len() as f64;
    let most = classes.iter().copied().max().unwrap_or(0) as f64;
    let scale = (SIZE.1 - 4) as f64 / most.max(2.0 * expected).max(1.0);
    let bar = SIZE.0 / classes.len();
    for (i, &count) in classes.iter().enumerate() {
        let high = ((count as f64 * scale) as usize).min(SIZE.1);
        canvas.fill(i * bar, SIZE.1 - high, bar - 1, high, [86, 180, 233]);
    }
    canvas.fill(0, SIZE.1 - 1 - (expected * scale) as usize, SIZE.0, 1, [230, 159, 0]);
    canvas
}
