//! Pictures of a result: what was observed, what was expected, what is left over; all samplers on one sheet.

use crate::picture::{Canvas, ColourMap, Error, Field, Heat, Planes, Scale, Sheet, Tile};
use crate::verify::{Examination, Report, ResidualMap};

/// Residuals are drawn up to this many standard deviations.
const SIGMAS: f64 = 5.0;
/// What is drawn as a chequer.
const NO_CELL: &str =
    "Dark chequer: outside of the domain, or expected to have too few samples for a cell of its own.";
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
            "{} samples, seed {}; averages over {} cells. {}. {NO_CELL}",
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
        .notes(format!(
            "What is left of counts after expected counts are taken off, cell by cell. A right sampler leaves noise. {NO_CELL}"
        ))
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
pub(super) fn density_heat<const N: usize>(fields: [&Field; N]) -> Heat {
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
