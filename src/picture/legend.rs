//! Legends: a bar of colours with what they mean.

use super::{Canvas, ColourMap, Scale, TextSize, draw_text, text_width, wrap_text};

pub(super) const BACKGROUND: [u8; 3] = [26, 27, 30];
pub(super) const INK: [u8; 3] = [226, 227, 230];
pub(super) const PALE: [u8; 3] = [160, 163, 170];
pub(super) const LINE: [u8; 3] = [78, 80, 86];

const BAR: usize = 12;
const MARK: usize = 4;

/// What the colours of a heat map mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// The colours.
    pub map: ColourMap,
    /// The figures along them.
    pub scale: Scale,
    /// What is counted or measured, and its unit.
    pub unit: String,
}

impl Legend {
    /// A colour bar `width` pixels wide, ticks and figures beneath it, the unit below.
    pub fn draw(&self, width: usize, size: TextSize) -> Canvas {
        let lines = wrap_text(&self.unit, (width / size.width()).max(1));
        let leading = size.height() + size.down * 5;
        let figures = BAR + MARK + 3;
        let height = figures + leading * (1 + lines.len());
        let mut canvas = Canvas::filled(width, height, BACKGROUND);
        let width = canvas.width();

        for x in 0..width {
            let position = (x as f64 + 0.5) / width as f64;
            canvas.fill(x, 0, 1, BAR, self.map.colour(position));
        }
        // Ends come first; a figure that would touch one that stands already is left out, its mark is kept.
        let mut taken: Vec<(usize, usize)> = Vec::new();
        for tick in self.scale.ticks() {
            let x = ((tick.position * width as f64) as usize).min(width - 1);
            canvas.fill(x, BAR, 1, MARK, PALE);
            let long = text_width(&tick.label, size);
            let left = x.saturating_sub(long / 2).min(width.saturating_sub(long));
            let right = left + long;
            if taken.iter().all(|&(from, to)| right + size.width() <= from || to + size.width() <= left) {
                draw_text(&mut canvas, left, figures, &tick.label, size, INK);
                taken.push((left, right));
            }
        }
        for (i, line) in lines.iter().enumerate() {
            let left = width.saturating_sub(text_width(line, size)) / 2;
            draw_text(&mut canvas, left, figures + leading * (i + 1), line, size, PALE);
        }
        canvas
    }
}
