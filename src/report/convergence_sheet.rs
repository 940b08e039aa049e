//! Pictures of strategies at equal time, their errors, and which of them wins where.

use super::palette::PALETTE;
use crate::estimator::{Convergence, Film, WINNER_TILE};
use crate::picture::{Canvas, ColourMap, Field, Heat, Scale, Sheet, Tile, Tone};

/// What [`convergence_sheet`] shows for one time.
pub struct AtEqualTime {
    /// CPU seconds.
    pub seconds: f64,
    /// Passes and picture of each strategy.
    pub pictures: Vec<(u32, Film)>,
}

/// For each time a row of pictures and one of their errors; below them the reference and the map of winners.
pub fn convergence_sheet(title: &str, found: &Convergence, times: &[AtEqualTime], tone: Tone) -> Canvas {
    let heat = Heat { map: ColourMap::Inferno, scale: Scale::Log { floor: 1e-3, max: 10.0 } };
    let width = found.reference.picture.width().clamp(256, 512);
    let mut sheet = Sheet::new(format!("{title}: strategies at equal time"))
        .notes("Errors are relative: |x - r| / sqrt(r^2 + epsilon). Times are CPU seconds of one thread.")
        .columns(found.curves.iter().map(|c| c.strategy.to_string()))
        .tile_width(width);
    for at in times {
        let pictures = at.pictures.iter().map(|(passes, film)| {
            Tile::new(tone.show(&film.picture())).caption(format!("{passes} samples a pixel"))
        });
        sheet = sheet.row(format!("{:.3} s", at.seconds), pictures);
        let errors = at.pictures.iter().map(|(_, film)| {
            let map = found.error_map(film);
            Tile::new(heat.paint(&map)).caption(format!("relative rms error {:.3}", root_mean_square(&map)))
        });
        sheet = sheet.row("error", errors);
    }
    let names: Vec<_> =
        found.curves.iter().enumerate().map(|(i, c)| format!("{} {}", colour_name(i), c.strategy)).collect();
    let caption = format!("least squared error x time: {}; dim: may be chance", names.join(", "));
    sheet
        .row(
            "reference",
            [
                Tile::new(tone.show(&found.reference.picture)).caption("what they are compared with"),
                Tile::new(winner_map(found)).caption(caption),
            ],
        )
        .legend(heat.legend("relative error"))
        .draw()
}

/// A colour for the strategy that needs the least time for equal error at each pixel's tile; dim if another may need less as well, for all that is known
/// ([`crate::estimator::Winner::is_sure`]), grey where there is no error.
pub fn winner_map(found: &Convergence) -> Canvas {
    let picture = &found.reference.picture;
    let columns = picture.width().div_ceil(WINNER_TILE);
    let winners = found.winners();
    let mut canvas = Canvas::filled(picture.width(), picture.height(), [70; 3]);
    for (x, y) in (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y))) {
        if let Some(winner) = winners[y / WINNER_TILE * columns + x / WINNER_TILE] {
            let colour = PALETTE[winner.strategy % PALETTE.len()].0;
            canvas.set(x, y, if winner.is_sure { colour } else { colour.map(|v| v / 3 + 20) });
        }
    }
    canvas
}

/// Of the cells inside of the domain.
pub(super) fn root_mean_square(field: &Field) -> f64 {
    let finite: Vec<f64> = field.values().iter().copied().filter(|v| v.is_finite()).collect();
    (finite.iter().map(|v| v * v).sum::<f64>() / finite.len().max(1) as f64).sqrt()
}

pub(super) fn colour_name(i: usize) -> &'static str {
    PALETTE[i % PALETTE.len()].1
}
