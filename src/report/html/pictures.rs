//! Renders: strategies beside and over one another, their errors, how they converge, whether they agree, and what the scene needs.

use super::super::convergence::{best_efficiency, is_compared, over_best, ratio};
use super::super::convergence_sheet::{AtEqualTime, root_mean_square, winner_map};
use super::super::{accord, convergence_plot, convergence_table, region_ratios};
use super::figure::Figure;
use super::page::{Block, Cell, Column, Page, Row, Section, Table, id};
use super::verify::count;
use crate::estimator::{Accord, Convergence, Cost, Estimate, Film, Interval, Judgement, Plan};
use crate::picture::{ColourMap, Field, Heat, Scale, Tone};
use crate::verify::{Verdict, p_value};

/// Pictures that belong together: at equal samples, or at equal time.
#[derive(Clone, Debug)]
pub struct Group {
    /// "64 samples a pixel".
    pub name: String,
    /// A line about all of them; may be empty.
    pub note: String,
    /// Name and caption of each, and what was rendered.
    pub films: Vec<(String, String, Film)>,
}

/// Relative errors.
fn error_heat() -> Heat {
    Heat { map: ColourMap::Inferno, scale: Scale::Log { floor: 1e-3, max: 10.0 } }
}

/// The standard error that the film claims, over its mean: of a pixel, the root mean square over the channels, of the mean of the picture where it is dark.
fn claimed_error(film: &Film) -> Field {
    let means = || film.pixels().iter().map(|p| p.mean().iter().sum::<f64>() / 3.0);
    let epsilon = (0.1 * means().sum::<f64>() / film.pixels().len() as f64).powi(2).max(f64::MIN_POSITIVE);
    Field::from_fn(film.width(), film.height(), |x, y| {
        let pixel = film.pixel(x, y);
        let channels = pixel.mean().into_iter().zip(pixel.standard_error());
        (channels.map(|(m, e)| e * e / (m * m + epsilon)).sum::<f64>() / 3.0).sqrt()
    })
}

impl Page {
    /// Pictures of a scene at equal samples, with the standard errors that they claim.
    pub fn renders(&mut self, scene: &str, groups: &[Group], tone: Tone) -> &mut Self {
        let pictures = groups.iter().map(|group| {
            let figures = group.films.iter().map(|(name, caption, film)| {
                Figure::canvas(
                    name,
                    &tone.show(&film.picture()),
                    format!("{scene} by {name}, {}", group.name),
                )
                .caption(caption)
            });
            (group.name.clone(), group.note.clone(), figures.collect())
        });
        let errors = groups.iter().filter_map(|group| {
            // A single sample says nothing about its error.
            let films = group.films.iter().filter(|(_, _, film)| film.pixels().iter().all(|p| p.count() > 1));
            let figures = films.map(|(name, _, film)| {
                let map = claimed_error(film);
                let alt = format!("standard error of {scene} by {name}, {}", group.name);
                Figure::heat(name, &map, error_heat(), "standard error / radiance", alt)
                    .caption(format!("root mean square {:.3}", root_mean_square(&map)))
            });
            let figures: Vec<_> = figures.collect();
            let name = format!("{}: standard error", group.name);
            (!figures.is_empty()).then_some((name, String::new(), figures))
        });
        self.section(
            Section::new(id("render", scene), format!("{scene}: strategies at equal samples"))
                .short("Pictures")
                .with(Block::Words { text: "Choose two pictures and move the divide between them.".into() })
                .with(Block::Compare { groups: pictures.chain(errors).collect() }),
        )
    }

    /// Error against run time, strategies at equal time and at equal samples with their errors, and which of them wins where.
    ///
    /// # Errors
    /// As [`convergence_plot`].
    pub fn convergence(
        &mut self,
        scene: &str,
        found: &Convergence,
        setup: Cost,
        times: &[AtEqualTime],
        equal: &[Group],
        tone: Tone,
    ) -> Result<&mut Self, std::fmt::Error> {
        let size = (found.reference.picture.width(), found.reference.picture.height());
        let svg =
            convergence_plot(&format!("{scene}, {} x {}: error against run time", size.0, size.1), found)?;
        let best = best_efficiency(found);
        let rows = found.curves.iter().filter_map(|curve| {
            let last = curve.last()?;
            let slope = curve.slope_time.filter(|_| is_compared(curve));
            let over = if is_compared(curve) { best / curve.efficiency } else { f64::NAN };
            Some(Row::new([
                Cell::new(curve.strategy.to_string()),
                Cell::number(f64::from(last.passes), count(u64::from(last.passes))),
                Cell::number(last.cpu.mean, format!("{:.3}", last.cpu.mean)),
                Cell::number(last.squared.mean, format!("{:.3e}", last.squared.mean.max(0.0).sqrt())),
                Cell::number(last.relative.mean, format!("{:.3}", last.relative.mean.max(0.0).sqrt())),
                Cell::number(
                    slope.map_or(f64::NAN, |s| s.value),
                    slope.map_or("–".into(), |s| format!("{:.3} ± {:.3}", s.value, s.half_width)),
                ),
                Cell::number(over, over_best(over)),
            ]))
        });
        let table = Table {
            caption: format!("{} pictures of each strategy; slopes with 95% intervals", found.seeds),
            columns: vec![
                Column::words("strategy"),
                Column::numbers("samples a pixel"),
                Column::numbers("CPU s"),
                Column::numbers("rms error"),
                Column::numbers("relative rms"),
                Column::numbers("slope over time")
                    .about("of the error; -0.5 is what a sum of independent samples does"),
                Column::numbers("time over best").about("for equal error"),
            ],
            rows: rows.collect(),
            filter: false,
        };
        let mut regions = vec![Column::words("part of the picture"), Column::numbers("pixels")];
        regions.extend(found.curves.iter().map(|c| Column::numbers(c.strategy.to_string())));
        let parts = region_ratios(found).into_iter().map(|(name, pixels, ratios)| {
            let head = [Cell::new(name), Cell::number(pixels as f64, count(pixels as u64))];
            let over_least = |r: Interval| Cell::number(r.value, ratio(r));
            Row::new(head.into_iter().chain(ratios.into_iter().map(over_least)))
        });
        let parts = Table {
            caption: "rms error at equal time over that of the best strategy, with 95% intervals".into(),
            columns: regions,
            rows: parts.collect(),
            filter: false,
        };
        let timed = times.iter().map(|at| {
            let films = found.curves.iter().zip(&at.pictures);
            Group {
                name: format!("{:.3} s", at.seconds),
                note: String::new(),
                films: films
                    .map(|(c, (spp, film))| {
                        (
                            c.strategy.to_string(),
                            format!("{} samples a pixel", count(u64::from(*spp))),
                            film.clone(),
                        )
                    })
                    .collect(),
            }
        });
        // The longest time first: it shows most.
        let mut timed: Vec<Group> = timed.collect();
        timed.reverse();
        let mut groups = Vec::new();
        let all = timed.iter().map(|g| (format!("equal time, {}", g.name), g));
        for (name, group) in all.chain(equal.iter().map(|g| (format!("equal samples, {}", g.name), g))) {
            let picture = |(strategy, caption, film): &(String, String, Film)| {
                let alt = format!("{scene} by {strategy} at {name}");
                Figure::canvas(strategy, &tone.show(&film.picture()), alt).caption(caption)
            };
            let error = |(strategy, _, film): &(String, String, Film)| {
                let map = found.error_map(film);
                let alt = format!("relative error of {scene} by {strategy} at {name}");
                Figure::heat(strategy, &map, error_heat(), "|x − r| / sqrt(r² + ε)", alt)
                    .caption(format!("relative rms error {:.3}", root_mean_square(&map)))
            };
            groups.push((name.clone(), group.note.clone(), group.films.iter().map(picture).collect()));
            groups.push((format!("{name}: error"), String::new(), group.films.iter().map(error).collect()));
        }
        let winners = found.curves.iter().enumerate();
        let names: Vec<String> = winners
            .map(|(i, c)| format!("{} {}", super::super::convergence_sheet::colour_name(i), c.strategy))
            .collect();
        groups.push((
            "reference".into(),
            String::new(),
            vec![
                Figure::canvas(
                    "reference",
                    &tone.show(&found.reference.picture),
                    format!("{scene}, the reference"),
                )
                .caption("what they are compared with"),
                Figure::canvas(
                    "who wins where",
                    &winner_map(found),
                    "the strategy of least error for its time, tile by tile",
                )
                .caption(format!("least squared error × time: {}; dim: may be chance", names.join(", "))),
            ],
        ));
        Ok(self
            .fact("scene", format!("{scene}, {} x {}", size.0, size.1))
            .section(
                Section::new(id("converge", scene), format!("{scene}: error against run time"))
                    .short("Convergence")
                    .with(Block::Plots {
                        plots: vec![(svg, "Error over CPU time, both logarithmic; bars are 95% intervals, lines the fitted powers".into())],
                    })
                    .with(Block::Table(table))
                    .with(Block::Table(parts))
                    .with(Block::More {
                        summary: "all figures".into(),
                        blocks: vec![Block::Text { text: convergence_table(found, setup, None) }],
                    }),
            )
            .section(
                Section::new(id("strategies", scene), format!("{scene}: strategies over one another"))
                    .short("Strategies")
                    .with(Block::Words { text: "Choose two pictures and move the divide between them.".into() })
                    .with(Block::Compare { groups }),
            ))
    }

    /// Whether strategies estimate the same picture.
    pub fn accord(&mut self, scene: &str, accord: &Accord, estimates: &[Estimate]) -> &mut Self {
        let verdict = |j| match j {
            Judgement::Agree => Verdict::Pass,
            Judgement::Differ => Verdict::Fail,
            Judgement::Inconclusive => Verdict::Inconclusive,
        };
        let within =
            |x: f64| Cell::number(x, if x.is_finite() { format!("{:.2}%", 100.0 * x) } else { "–".into() });
        let name = |i: usize| estimates[i].name.as_str();
        let mut pairs: Vec<_> = accord.pairs.iter().collect();
        pairs.sort_by_key(|p| std::cmp::Reverse(verdict(p.judgement)));
        let rows = pairs.iter().map(|pair| {
            Row::new([
                Cell::verdict(
                    verdict(pair.judgement),
                    format!("{} / {}", name(pair.first), name(pair.second)),
                ),
                Cell::number(pair.p, p_value(pair.p).trim_start_matches("= ").to_owned()),
                Cell::number(pair.tested() as f64, count(pair.tested() as u64)),
                Cell::number(pair.doubtful() as f64, count(pair.doubtful() as u64)),
                within(pair.untested_light),
                within(pair.brightness_within),
                within(pair.tiles_within),
            ])
            .judged(verdict(pair.judgement))
        });
        let table = Table {
            caption: "pairs that do not agree come first".into(),
            columns: vec![
                Column::words("pair"),
                Column::numbers("corrected p"),
                Column::numbers("tiles tested"),
                Column::numbers("untested"),
                Column::numbers("of the light").about("in tiles that were not tested"),
                Column::numbers("means within").about("with 99% confidence"),
                Column::numbers("tiles within").about("with 99% confidence, each tested tile"),
            ],
            rows: rows.collect(),
            filter: true,
        };
        let mut section = Section::new(id("agree", scene), format!("{scene}: do strategies agree?"))
            .short("Agreement")
            .with(Block::Table(table))
            .with(Block::Words {
                text: "Chequered tiles have no light or were not tested. Right estimates leave no pattern in the maps.".into(),
            });
        for pair in &pairs {
            let title = format!("{} / {}", name(pair.first), name(pair.second));
            let [p, difference] = accord::maps(pair, estimates);
            let figures = vec![
                Figure::heat(
                    "1 / p",
                    &p.0,
                    p.1,
                    "1 / p, the least channel",
                    format!("p-values of {title}, tile by tile"),
                ),
                Figure::heat(
                    "difference",
                    &difference.0,
                    difference.1,
                    "(first − second) / mean",
                    format!("relative difference of {title}, tile by tile"),
                ),
            ];
            section.blocks.push(Block::More {
                summary: title,
                blocks: vec![Block::Figures { figures, zoom: true, hover: None }],
            });
        }
        let count_of = |j| accord.pairs.iter().filter(|p| p.judgement == j).count();
        self.judged(verdict(accord.judgement()))
            .says(format!(
                "{} of {} pairs of estimates agree, {} differ, {} inconclusive; {} p-values corrected together (Holm).",
                count_of(Judgement::Agree),
                accord.pairs.len(),
                count_of(Judgement::Differ),
                count_of(Judgement::Inconclusive),
                count(accord.tests as u64)
            ))
            .fact("false alarms after correction", format!("{:?} of runs", accord.criteria.level))
            .section(section)
    }

    /// What a scene needs, what is left out, and why.
    pub fn plan(&mut self, scene: &str, plan: &Plan) -> &mut Self {
        let rows = plan.parts().iter().map(|part| {
            let ms = part.time.as_secs_f64() * 1e3;
            Row::new([
                Cell::new(part.name),
                Cell::new(if part.built { "built" } else { "left out" }),
                Cell::number(part.bytes as f64, count(part.bytes as u64)),
                Cell::number(ms, format!("{ms:.3}")),
                Cell::new(part.why.clone()),
            ])
        });
        let table = Table {
            caption: String::new(),
            columns: vec![
                Column::words("part"),
                Column::words(""),
                Column::numbers("bytes"),
                Column::numbers("ms"),
                Column::words("why"),
            ],
            rows: rows.collect(),
            filter: false,
        };
        self.section(
            Section::new(id("plan", scene), format!("{scene}: what the scene needs"))
                .short("Plan")
                .with(Block::Table(table)),
        )
    }
}
