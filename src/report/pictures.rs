//! Pictures of a result: what was observed, what was expected, what is left over; histograms; all samplers on one sheet.

use crate::catalogue::HistogramFigure;
use crate::picture::{Canvas, ColourMap, Error, Field, Heat, Planes, Scale, Sheet, Tile};
use crate::verify::{Examination, Report, ResidualMap};

/// Residuals are drawn up to this many standard deviations.
const SIGMAS: f64 = 5.0;
/// Height of a drawn map; its width follows from the domain.
const HEIGHT: usize = 256;

/// Observed, expected and signed standardised residual side by side, with legends.
pub fn residual_sheet(report: &Report, sampler: usize) -> Canvas {
    let examination = &report.examinations[sampler];
    let map = map_of(examination);
    let [observed, expected, residual] = fields(&map);
    let heat = density_heat([&observed, &expected]);
    let unit = format!("density per {}", examination.per);
    Sheet::new(format!("{}: {}", examination.name, report.verdict_on(sampler)))
        .notes(format!(
            "{} samples, seed {}; averages over {} cells. {}.",
            examination.samples,
            report.seed,
            examination.cells.len(),
            examination.picture_caption
        ))
        .columns(["observed", "expected", "residual"])
        .row(
            "",
            [
                Tile::new(heat.paint(&observed)).legend(heat.legend(&unit)),
                Tile::new(heat.paint(&expected)).legend(heat.legend(&unit)),
                residual_tile(&residual),
            ],
        )
        .tile_width(384)
        .draw()
}

fn residual_tile(residual: &Field) -> Tile {
    let heat = Heat::residuals(SIGMAS);
    Tile::new(heat.paint(residual)).legend(heat.legend("(observed - expected) / standard deviation"))
}

/// The residual maps of all samplers of a run on one sheet.
pub fn overview_sheet(report: &Report) -> Canvas {
    const COLUMNS: usize = 6;
    let tiles: Vec<Tile> = (0..report.examinations.len())
        .map(|i| {
            let examination = &report.examinations[i];
            let [_, _, residual] = fields(&map_of(examination));
            Tile::new(Heat::residuals(SIGMAS).paint(&residual)).caption(format!(
                "{}: {}",
                examination.name,
                report.verdict_on(i)
            ))
        })
        .collect();
    let mut sheet = Sheet::new(format!("residuals of {} samplers: {}", tiles.len(), report.verdict()))
        .notes("What is left of counts after expected counts are taken off, cell by cell. A right sampler leaves noise.")
        .legend(Heat::residuals(SIGMAS).legend("(observed - expected) / standard deviation"))
        .tile_width(256);
    for row in tiles.chunks(COLUMNS) {
        sheet = sheet.row("", row.to_vec());
    }
    sheet.draw()
}

/// The same figures for programs: planes `observed`, `expected`, `residual`.
///
/// # Errors
/// Never for a map that was drawn here; the type says so because planes check their size.
pub fn residual_planes(examination: &Examination) -> Result<Planes, Error> {
    let map = map_of(examination);
    let plane = |values: &[f64]| values.iter().map(|&v| v as f32).collect::<Vec<_>>();
    let planes = [
        ("observed", plane(&map.observed)),
        ("expected", plane(&map.expected)),
        ("residual", plane(&map.residual)),
    ];
    Planes::new(map.width, map.height, planes)
}

fn map_of(examination: &Examination) -> ResidualMap {
    // Strips (discrete, interval) need no height.
    examination.map(if examination.axes == 2 { HEIGHT } else { HEIGHT / 2 })
}

fn fields(map: &ResidualMap) -> [Field; 3] {
    [&map.observed, &map.expected, &map.residual]
        .map(|values| Field::new(map.width, map.height, values.clone()).expect("a map's own shape"))
}

/// One scale for densities that are to be compared: logarithmic if they span more than a factor of 30, from the least to the greatest but for
/// a thousandth at either end, which a sun would otherwise take all the colours for.
fn density_heat<const N: usize>(fields: [&Field; N]) -> Heat {
    let positive = fields.iter().flat_map(|f| f.values()).copied().filter(|v| v.is_finite() && *v > 0.0);
    let mut values: Vec<f64> = positive.collect();
    values.sort_by(f64::total_cmp);
    let rank = |share: f64| values.get((share * (values.len() as f64 - 1.0)).round() as usize).copied();
    let scale = match (rank(0.001), rank(0.999)) {
        (Some(low), Some(high)) if high > 30.0 * low => Scale::Log { floor: low.max(1e-8 * high), max: high },
        // Room for noise above the greatest density.
        (_, Some(high)) => Scale::Linear { min: 0.0, max: 1.4 * high },
        _ => Scale::Linear { min: 0.0, max: 1.0 },
    };
    Heat { map: ColourMap::Inferno, scale }
}

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
    let dotted = |dots: &[[f64; 2]]| {
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
    };
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
