//! Histograms: uniform samples, the map and importance samples at several counts; or samples of any sampler beside its density.

use super::super::residuals::density_heat;
use super::super::{EnvironmentFigure, dotted};
use super::figure::Figure;
use super::page::{Block, Page, Section, id};
use super::verify::count;
use crate::catalogue::HistogramFigure;
use crate::picture::{Field, Shrink};

/// Columns of a histogram on the page: more would only show noise.
const COLUMNS: usize = 384;

/// What an environment map has at one number of samples, ready for the page.
#[derive(Clone, Debug)]
pub struct EnvironmentStop {
    samples: u64,
    figures: Vec<Figure>,
}

impl EnvironmentStop {
    /// Draws the figures.
    pub fn new(name: &str, map: &EnvironmentFigure<'_>) -> Self {
        let (width, height) = (map.picture.width(), map.picture.height());
        let field = |values: &[f64]| {
            let field = Field::new(width, height, values.to_vec()).expect("the map's own shape");
            if width > COLUMNS { field.fit_width(COLUMNS, Shrink::Mean) } else { field }
        };
        let [uniform, target, importance] = [map.uniform, map.target, map.importance].map(field);
        let heat = density_heat([&target]);
        let alt = |what: &str| format!("{what} of {name}, latitude-longitude, theta = 0 on top");
        let unit = "density per solid angle";
        let figures = vec![
            Figure::heat("uniform", &uniform, heat, unit, alt("histogram of uniform samples"))
                .caption(format!("{} samples", count(map.uniform_samples))),
            Figure::heat("map", &target, heat, unit, alt("normalised luminance"))
                .caption("luminance, normalised"),
            Figure::heat("importance", &importance, heat, unit, alt("histogram of importance samples"))
                .caption(format!("{} samples", count(map.samples))),
        ];
        Self { samples: map.samples, figures }
    }
}

impl Page {
    /// An environment map: as it looks, with the first samples on it, and histograms at several counts.
    pub fn environment(
        &mut self,
        name: &str,
        map: &EnvironmentFigure<'_>,
        stops: Vec<EnvironmentStop>,
    ) -> &mut Self {
        let shown = map.tone.show(map.picture).fit_width(COLUMNS.min(map.picture.width()));
        let dots = |dots: &[[f64; 2]]| dotted(&shown, dots);
        let first = |dots: &[[f64; 2]]| format!("the first {}", count(dots.len() as u64));
        let looks = vec![
            Figure::canvas(
                "uniform",
                &dots(map.uniform_dots),
                format!("{name} with uniform samples as dots"),
            )
            .caption(first(map.uniform_dots)),
            Figure::canvas("map", &shown, format!("the environment map {name}, tone-mapped"))
                .caption("as it looks"),
            Figure::canvas(
                "importance",
                &dots(map.importance_dots),
                format!("{name} with importance samples as dots"),
            )
            .caption(first(map.importance_dots)),
        ];
        let stops = stops.into_iter().map(|stop| (format!("{} samples", count(stop.samples)), stop.figures));
        self.section(
            Section::new(id("map", name), format!("Environment map {name}"))
                .short("Map")
                .with(Block::Figures { figures: looks, zoom: false, hover: None })
                .with(Block::Stops { label: "importance samples".into(), stops: stops.collect() }),
        )
    }

    /// Histograms of a sampler beside the density that it claims, at several counts.
    pub fn histogram(&mut self, name: &str, figures: &[HistogramFigure]) -> &mut Self {
        let Some(last) = figures.last() else { return self };
        let field = |f: &HistogramFigure, values: &[f64]| {
            Field::new(f.histogram.width, f.histogram.height, values.to_vec())
                .expect("a histogram's own shape")
        };
        let heat = density_heat([&field(last, &last.claimed)]);
        let unit = format!("density per {}", last.per);
        let stops = figures.iter().map(|f| {
            let (drawn, claimed) = (field(f, &f.drawn), field(f, &f.claimed));
            let alt = |what: &str| format!("{what} of {name} over its {}; {}", f.domain, f.caption);
            let pictures = vec![
                Figure::heat("samples", &drawn, heat, &unit, alt("histogram of samples")).caption(format!(
                    "{} drawn, {} rejected",
                    count(f.histogram.samples),
                    count(f.histogram.rejected)
                )),
                Figure::heat("density", &claimed, heat, &unit, alt("density that is claimed"))
                    .caption(f.caption),
            ];
            (format!("{} samples", count(f.histogram.samples)), pictures)
        });
        self.section(
            Section::new(id("histogram", name), format!("Samples of {name}"))
                .short("Samples")
                .with(Block::Stops { label: "samples".into(), stops: stops.collect() }),
        )
    }
}
