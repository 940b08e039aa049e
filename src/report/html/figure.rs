//! Figures: pictures as data URIs, with legends made of text.

use crate::picture::{Canvas, ColourMap, Field, Heat, encode_indexed_png, encode_png};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

/// Columns of a picture that is shown, at most.
const WIDEST: usize = 512;
/// Colours along a scale; two more are for cells outside of the domain.
const LEVELS: f64 = 253.0;
/// Letters that fit along a legend, on a phone too.
const LETTERS: f64 = 34.0;

/// A picture with what a reader needs beside it.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    name: String,
    src: String,
    alt: String,
    width: usize,
    height: usize,
    caption: String,
    legend: Option<Legend>,
}

#[derive(Clone, Debug, Serialize)]
struct Legend {
    map: &'static str,
    ticks: Vec<(f64, String)>,
    unit: String,
}

fn uri(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}

const MAPS: [(ColourMap, &str); 3] =
    [(ColourMap::Inferno, "inferno"), (ColourMap::Viridis, "viridis"), (ColourMap::Diverging, "diverging")];

/// The colour maps as classes of CSS.
pub(super) fn gradients() -> String {
    let gradient = |(map, name): (ColourMap, &str)| {
        let stops: Vec<String> = (0..=24)
            .map(|i| {
                let [r, g, b] = map.colour(f64::from(i) / 24.0);
                format!("#{r:02x}{g:02x}{b:02x}")
            })
            .collect();
        format!(".bar.{name}{{background:linear-gradient(90deg,{})}}\n", stops.join(","))
    };
    MAPS.map(gradient).concat()
}

impl Figure {
    /// A picture as it is; `alt` says what it shows to those who don't see it.
    pub fn canvas(name: impl Into<String>, canvas: &Canvas, alt: impl Into<String>) -> Self {
        let fitted = (canvas.width() > WIDEST).then(|| canvas.fit_width(WIDEST));
        let canvas = fitted.as_ref().unwrap_or(canvas);
        Self {
            name: name.into(),
            src: uri(&encode_png(canvas)),
            alt: alt.into(),
            width: canvas.width(),
            height: canvas.height(),
            caption: String::new(),
            legend: None,
        }
    }

    /// A heat map with its legend; `unit` says what is counted or measured.
    pub fn heat(
        name: impl Into<String>,
        field: &Field,
        heat: Heat,
        unit: &str,
        alt: impl Into<String>,
    ) -> Self {
        let fitted = (field.width() > WIDEST).then(|| field.fit_width(WIDEST, crate::picture::Shrink::Mean));
        let field = fitted.as_ref().unwrap_or(field);
        // So few colours that a byte tells them: a third of the size, and nobody sees it.
        let values = field.values().iter().map(|&v| (heat.scale.position(v) * LEVELS).round() / LEVELS);
        let steps = Field::new(field.width(), field.height(), values.collect()).expect("its own shape");
        let unit_scale = Heat { scale: crate::picture::Scale::Linear { min: 0.0, max: 1.0 }, ..heat };
        let canvas = unit_scale.paint(&steps);
        let src = uri(&encode_indexed_png(&canvas).unwrap_or_else(|| encode_png(&canvas)));
        let map = MAPS.iter().find(|(map, _)| *map == heat.map).map_or("inferno", |(_, name)| name);
        let legend = Legend { map, ticks: ticks(heat), unit: unit.to_owned() };
        Self {
            name: name.into(),
            src,
            alt: alt.into(),
            width: canvas.width(),
            height: canvas.height(),
            caption: String::new(),
            legend: Some(legend),
        }
    }

    /// With a line beneath it.
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }
}

/// Ends first; what would touch one that stands already is left out.
fn ticks(heat: Heat) -> Vec<(f64, String)> {
    let mut kept: Vec<(f64, String)> = Vec::new();
    let half = |label: &str| 0.5 * (label.chars().count() as f64 + 1.5) / LETTERS;
    // At the ends they are aligned with them.
    let middle = |position: f64, label: &str| position.clamp(half(label), 1.0 - half(label));
    for tick in heat.scale.ticks() {
        let at = middle(tick.position, &tick.label);
        let clear = kept.iter().all(|(p, l)| (middle(*p, l) - at).abs() >= half(l) + half(&tick.label));
        if clear {
            kept.push((tick.position, tick.label.replace("<=", "≤").replace(">=", "≥")));
        }
    }
    kept.into_iter().map(|(p, l)| (100.0 * p, l)).collect()
}

/// The index of the cell of every pixel as a picture that a script can read: red is the low byte, green the next; blue is 1 inside.
pub(super) fn index_uri(width: usize, height: usize, cells: &[Option<u32>]) -> String {
    let pixels = cells.iter().map(|cell| match cell {
        Some(i) => [(i & 255) as u8, (i >> 8 & 255) as u8, 1 + (i >> 16 & 127) as u8],
        None => [0; 3],
    });
    let canvas = Canvas::new(width, height, pixels.collect()).expect("a map's own shape");
    uri(&encode_png(&canvas))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Scale;
    use std::collections::HashSet;

    fn colours(canvas: &Canvas) -> usize {
        canvas.pixels().iter().collect::<HashSet<_>>().len()
    }

    #[test]
    fn a_heat_map_fits_a_palette_and_its_legend_does_not_overlap() {
        let field =
            Field::from_fn(300, 40, |x, y| if y == 0 { f64::NAN } else { x as f64 * 0.013 + y as f64 });
        let heat = Heat::linear(&field);
        assert!(colours(&heat.paint(&field)) > 256);
        let figure = Figure::heat("f", &field, heat, "samples", "a ramp");
        let png = STANDARD.decode(figure.src.strip_prefix("data:image/png;base64,").unwrap()).unwrap();
        assert_eq!(png[25], 3, "colour type of the header: indexed");
        for scale in [Scale::Log { floor: 1e-4, max: 1e6 }, Scale::Symmetric { limit: 5.0 }] {
            let ticks = ticks(Heat { map: ColourMap::Inferno, scale });
            assert!(ticks.len() >= 3 && ticks.iter().all(|t| (0.0..=100.0).contains(&t.0)), "{ticks:?}");
        }
    }
}
