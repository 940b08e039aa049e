//! Pictures of histograms, beside what they should look like.

use super::residuals::density_heat;
use crate::catalogue::HistogramFigure;
use crate::picture::{Canvas, Field, Sheet, Tile};

/// A histogram beside the density that the sampler claims.
pub fn histogram_sheet(name: &str, figure: &HistogramFigure) -> Canvas {
    let (width, height) = (figure.histogram.width, figure.histogram.height);
    let field = |values: &[f64]| Field::new(width, height, values.to_vec()).expect("a histogram's own shape");
    let (drawn, claimed) = (field(&figure.drawn), field(&figure.claimed));
    let heat = density_heat([&claimed]);
    let unit = format!("density per {}", figure.per);
    Sheet::new(name)
        .notes(format!(
            "{} samples, {} rejected, on the {}. {}.",
            figure.histogram.samples, figure.histogram.rejected, figure.domain, figure.caption
        ))
        .columns(["samples drawn", "density claimed"])
        .row("", [&drawn, &claimed].map(|f| Tile::new(heat.paint(f)).legend(heat.legend(&unit))))
        .tile_width(width.clamp(512, 1024))
        .draw()
}

/// An environment map between uniform samples and importance samples: the first few as dots on the darkened map, and the histograms of
/// all of them.
pub fn environment_sheet(name: &str, map: &EnvironmentFigure<'_>) -> Canvas {
    let (width, height) = (map.picture.width(), map.picture.height());
    let shown = map.tone.show(map.picture);
    let dotted = |dots: &[[f64; 2]]| dotted(&shown, dots);
    let field = |values: &[f64]| Field::new(width, height, values.to_vec()).expect("the map's own shape");
    let [uniform, target, importance] = [map.uniform, map.target, map.importance].map(field);
    let heat = density_heat([&target]);
    let counts = |n: u64| format!("histogram of {n} samples");
    Sheet::new(name)
        .notes("Above: the map, and the first samples on it. Below: all samples as a histogram, beside what they should look like.")
        .columns(["uniform samples", "the map", "importance samples"])
        .row(
            "",
            [
                Tile::new(dotted(map.uniform_dots)).caption(format!("the first {}", map.uniform_dots.len())),
                Tile::new(shown.clone()).caption("as it looks"),
                Tile::new(dotted(map.importance_dots)).caption(format!("the first {}", map.importance_dots.len())),
            ],
        )
        .row(
            "",
            [
                Tile::new(heat.paint(&uniform)).caption(counts(map.uniform_samples)),
                Tile::new(heat.paint(&target)).caption("luminance, normalised"),
                Tile::new(heat.paint(&importance)).caption(counts(map.samples)),
            ],
        )
        .legend(heat.legend("density per solid angle"))
        .tile_width(512)
        .draw()
}

/// A darkened map with dots on it.
pub(super) fn dotted(shown: &Canvas, dots: &[[f64; 2]]) -> Canvas {
    let (width, height) = (shown.width(), shown.height());
    let dark = shown.pixels().iter().map(|p| p.map(|c| (f64::from(c) * 0.45) as u8)).collect();
    let mut canvas = Canvas::new(width, height, dark).expect("the map's own shape");
    for [x, y] in dots {
        let (x, y) = ((x * width as f64) as isize, (y * height as f64) as isize);
        for (dx, dy) in [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)] {
            let (x, y) = (x + dx, y + dy);
            if (0..width as isize).contains(&x) && (0..height as isize).contains(&y) {
                canvas.set(x as usize, y as usize, [90, 220, 255]);
            }
        }
    }
    canvas
}

/// What [`environment_sheet`] shows. All rasters have the size of the picture.
pub struct EnvironmentFigure<'a> {
    /// The map.
    pub picture: &'a crate::picture::Picture,
    /// How it is shown.
    pub tone: crate::picture::Tone,
    /// Importance samples in their histogram.
    pub samples: u64,
    /// Uniform samples in theirs.
    pub uniform_samples: u64,
    /// Histogram of uniform samples, as a density per solid angle.
    pub uniform: &'a [f64],
    /// Histogram of importance samples, likewise.
    pub importance: &'a [f64],
    /// Luminance over its integral: the density to aim at.
    pub target: &'a [f64],
    /// The first uniform samples, as places in the picture.
    pub uniform_dots: &'a [[f64; 2]],
    /// The first importance samples, likewise.
    pub importance_dots: &'a [[f64; 2]],
}
