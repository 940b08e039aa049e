//! Contact sheets: canvases in a grid, with everything a reader needs beside them.

use super::legend::{BACKGROUND, INK, LINE, PALE};
use super::{Canvas, Legend, TextSize, draw_text, text_width, wrap_text};

/// One picture of a [`Sheet`], with what belongs to it alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    canvas: Canvas,
    caption: String,
    legend: Option<Legend>,
}

impl Tile {
    /// A tile without caption or legend.
    pub fn new(canvas: Canvas) -> Self {
        Self { canvas, caption: String::new(), legend: None }
    }

    /// With a line or more beneath it.
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    /// With a colour bar beneath it.
    pub fn legend(mut self, legend: Legend) -> Self {
        self.legend = Some(legend);
        self
    }
}

/// A grid of tiles with a title, column headers, row labels, and legends that hold for all of it.
///
/// Tiles come out `tile_width` wide: smaller ones are enlarged by the largest whole factor that fits (texels
/// stay square and sharp), larger ones shrunk. Text that is too long for its place is broken into lines, never
/// cut or drawn over something.
///
/// ```
/// use warpcheck::picture::{Canvas, Sheet, Tile};
///
/// let tile = |grey| Tile::new(Canvas::filled(64, 32, [grey; 3])).caption(format!("grey {grey}"));
/// let sheet = Sheet::new("greys").columns(["dark", "light"]).row("", [tile(64), tile(192)]).draw();
/// assert!(sheet.width() > 2 * 256);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    title: String,
    notes: String,
    columns: Vec<String>,
    rows: Vec<(String, Vec<Tile>)>,
    legends: Vec<Legend>,
    tile_width: usize,
    text: TextSize,
}

const MARGIN: usize = 24;
const GAP: usize = 20;
/// Between a picture and the text that belongs to it.
const NEAR: usize = 8;
const LABEL_GLYPHS: usize = 16;

impl Sheet {
    /// An empty sheet; the title may be empty.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            notes: String::new(),
            columns: Vec::new(),
            rows: Vec::new(),
            legends: Vec::new(),
            tile_width: 256,
            text: TextSize::SMALL,
        }
    }

    /// With a paragraph under the title.
    pub fn notes(mut self, notes: impl Into<String>) -> Self {
        self.notes = notes.into();
        self
    }

    /// With headers over the columns, from the left.
    pub fn columns(mut self, headers: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.columns = headers.into_iter().map(Into::into).collect();
        self
    }

    /// With one more row; the label may be empty. Rows may be of different lengths.
    pub fn row(mut self, label: impl Into<String>, tiles: impl IntoIterator<Item = Tile>) -> Self {
        self.rows.push((label.into(), tiles.into_iter().collect()));
        self
    }

    /// With a colour bar that holds for the whole sheet.
    pub fn legend(mut self, legend: Legend) -> Self {
        self.legends.push(legend);
        self
    }

    /// With tiles about this wide, in pixels; 256 otherwise.
    pub fn tile_width(mut self, width: usize) -> Self {
        self.tile_width = width.max(1);
        self
    }

    /// With text of this size ([`TextSize::SMALL`] otherwise); the title is twice as large.
    pub fn text_size(mut self, text: TextSize) -> Self {
        self.text = text;
        self
    }

    /// Draws the whole sheet.
    pub fn draw(&self) -> Canvas {
        let text = self.text;
        let large = TextSize { across: text.across * 2, down: text.down * 2 };
        let count = self.rows.iter().map(|(_, tiles)| tiles.len()).max().unwrap_or(0).max(self.columns.len());
        let cell = self.tile_width;
        let label = self.rows.iter().map(|(label, _)| block(label, LABEL_GLYPHS, text).0).max().unwrap_or(0);
        let left = MARGIN + if label > 0 { label + GAP } else { 0 };
        let grid = (count * (cell + GAP)).saturating_sub(GAP);
        // Not so narrow that a title becomes a column of syllables.
        let width = (left + grid).max(MARGIN + 40 * text.width()) + MARGIN;
        let inner = width - 2 * MARGIN;

        let mut page = Page { canvas: Vec::new(), bottom: MARGIN };
        if !self.title.is_empty() {
            page.text(MARGIN, &self.title, inner, large, INK, Align::Left);
        }
        if !self.notes.is_empty() {
            page.bottom += if self.title.is_empty() { 0 } else { NEAR + 2 };
            page.text(MARGIN, &self.notes, inner, text, PALE, Align::Left);
        }
        if page.bottom > MARGIN {
            page.bottom += GAP;
        }

        let headers: Vec<_> = self.columns.iter().map(|h| block(h, cell / text.width(), text).1).collect();
        if let Some(&tallest) = headers.iter().max().filter(|&&h| h > 0) {
            let top = page.bottom;
            for (i, header) in self.columns.iter().enumerate() {
                page.bottom = top + tallest - headers[i];
                page.text(left + i * (cell + GAP), header, cell, text, INK, Align::Centre);
            }
            page.bottom = top + tallest + NEAR;
        }

        for (i, (label, tiles)) in self.rows.iter().enumerate() {
            if i > 0 {
                page.bottom += GAP;
            }
            let fitted: Vec<_> = tiles.iter().map(|tile| tile.canvas.fit_width(cell)).collect();
            let tallest = fitted.iter().map(Canvas::height).max().unwrap_or(0);
            let (_, label_height) = block(label, LABEL_GLYPHS, text);
            let top = page.bottom;
            let picture = tallest.max(label_height);
            page.bottom = top + (picture - label_height) / 2;
            page.text(MARGIN, label, LABEL_GLYPHS * text.width(), text, INK, Align::Left);
            let mut bottom = top + picture;
            for (k, (tile, canvas)) in tiles.iter().zip(fitted).enumerate() {
                let x = left + k * (cell + GAP);
                let y = top + (picture - canvas.height()) / 2;
                page.framed(&canvas, x + (cell - canvas.width()) / 2, y);
                page.bottom = top + picture;
                if !tile.caption.is_empty() {
                    page.bottom += NEAR;
                    page.text(x, &tile.caption, cell, text, PALE, Align::Centre);
                }
                if let Some(legend) = &tile.legend {
                    page.bottom += NEAR;
                    let long = canvas.width().max(cell / 2);
                    page.below(legend.draw(long, text), x + (cell - long) / 2);
                }
                bottom = bottom.max(page.bottom);
            }
            page.bottom = bottom;
        }

        for legend in &self.legends {
            page.bottom += GAP;
            let long = inner.min(480 * text.across);
            page.below(legend.draw(long, text), MARGIN + (inner - long) / 2);
        }
        page.finish(width)
    }
}

/// Width and height in pixels of `text`, broken after `columns` glyphs.
fn block(text: &str, columns: usize, size: TextSize) -> (usize, usize) {
    let lines = wrap_text(text, columns);
    let width = lines.iter().map(|line| text_width(line, size)).max().unwrap_or(0);
    (width, (lines.len() * leading(size)).saturating_sub(leading(size) - size.height()))
}

fn leading(size: TextSize) -> usize {
    size.height() + 4 * size.down
}

#[derive(Clone, Copy)]
enum Align {
    Left,
    Centre,
}

/// A page that grows downwards: what is drawn is kept until its height is known.
struct Page {
    canvas: Vec<(Canvas, usize, usize)>,
    bottom: usize,
}

impl Page {
    /// Puts `text` at the bottom, in `width` pixels from column `x` on.
    fn text(&mut self, x: usize, text: &str, width: usize, size: TextSize, colour: [u8; 3], align: Align) {
        let columns = (width / size.width()).max(1);
        let (_, height) = block(text, columns, size);
        for (i, line) in wrap_text(text, columns).iter().enumerate() {
            if line.is_empty() {
                continue;
            }
            let long = text_width(line, size);
            let mut strip = Canvas::filled(long, size.height(), BACKGROUND);
            draw_text(&mut strip, 0, 0, line, size, colour);
            let indent = match align {
                Align::Left => 0,
                Align::Centre => width.saturating_sub(long) / 2,
            };
            self.canvas.push((strip, x + indent, self.bottom + i * leading(size)));
        }
        self.bottom += height;
    }

    /// Puts `canvas` at the bottom.
    fn below(&mut self, canvas: Canvas, x: usize) {
        let y = self.bottom;
        self.bottom += canvas.height();
        self.canvas.push((canvas, x, y));
    }

    /// Puts `canvas` somewhere, a thin line around it.
    fn framed(&mut self, canvas: &Canvas, x: usize, y: usize) {
        let frame = Canvas::filled(canvas.width() + 2, canvas.height() + 2, LINE);
        self.canvas.push((frame, x - 1, y - 1));
        self.canvas.push((canvas.clone(), x, y));
    }

    fn finish(self, width: usize) -> Canvas {
        let mut sheet = Canvas::filled(width, self.bottom + MARGIN, BACKGROUND);
        for (canvas, x, y) in &self.canvas {
            sheet.paste(canvas, *x, *y);
        }
        sheet
    }
}
