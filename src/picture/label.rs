//! Text in an 8 x 8 bitmap font, so that no font file is needed and every machine draws the same pixels.

use font8x8::{BASIC_FONTS, GREEK_FONTS, LATIN_UNICODE, UnicodeFonts};

use super::Canvas;

/// Side of an unscaled glyph in pixels, spacing included.
pub const GLYPH: usize = 8;

/// By which whole factors glyphs are scaled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextSize {
    /// Horizontal factor: a glyph is `8 * across` pixels wide.
    pub across: usize,
    /// Vertical factor: a line is `8 * down` pixels high.
    pub down: usize,
}

impl TextSize {
    /// 8 x 8 pixels a glyph.
    pub const SMALL: Self = Self { across: 1, down: 1 };
    /// 16 x 16 pixels a glyph.
    pub const LARGE: Self = Self { across: 2, down: 2 };

    /// Width of a glyph in pixels.
    pub fn width(self) -> usize {
        GLYPH * self.across
    }

    /// Height of a glyph in pixels.
    pub fn height(self) -> usize {
        GLYPH * self.down
    }
}

/// Width in pixels of `text`, which is one line.
///
/// ```
/// use warpcheck::picture::{TextSize, text_width};
/// assert_eq!(text_width("chi²", TextSize::LARGE), 64);
/// ```
pub fn text_width(text: &str, size: TextSize) -> usize {
    text.chars().count() * size.width()
}

/// Draws one line, its top left corner in column `x` of row `y`; clipped at the edges. ASCII, Latin-1 and Greek
/// can be drawn, some typographic signs become their ASCII likeness, and anything else a question mark.
pub fn draw_text(canvas: &mut Canvas, x: usize, y: usize, text: &str, size: TextSize, colour: [u8; 3]) {
    for (i, glyph) in text.chars().map(glyph).enumerate() {
        for (row, bits) in glyph.into_iter().enumerate() {
            for column in (0..GLYPH).filter(|column| bits >> column & 1 == 1) {
                let left = x + (i * GLYPH + column) * size.across;
                canvas.fill(left, y + row * size.down, size.across, size.down, colour);
            }
        }
    }
}

/// Breaks `text` into lines of at most `columns` glyphs, between words where possible; a longer word is cut, behind its slashes, hyphens and underscores
/// where possible.
///
/// ```
/// use warpcheck::picture::wrap_text;
/// assert_eq!(wrap_text("two sample MIS", 10), ["two sample", "MIS"]);
/// assert_eq!(wrap_text("environment/noon_grass/guide", 17), ["environment/", "noon_grass/guide"]);
/// ```
pub fn wrap_text(text: &str, columns: usize) -> Vec<String> {
    let columns = columns.max(1);
    let mut lines: Vec<String> = Vec::new();
    for paragraph in text.lines() {
        let mut line = String::new();
        let mut used = 0;
        for word in paragraph.split_whitespace() {
            let letters: Vec<char> = word.chars().collect();
            for (i, piece) in pieces(&letters, columns).into_iter().enumerate() {
                if used > 0 && (i > 0 || used + 1 + piece.len() > columns) {
                    lines.push(std::mem::take(&mut line));
                    used = 0;
                }
                if used > 0 {
                    line.push(' ');
                    used += 1;
                }
                line.extend(piece);
                used += piece.len();
            }
        }
        lines.push(line);
    }
    lines
}

/// The parts of a word that fit into lines. A slash is better to break at than a hyphen, wherever it stands.
fn pieces(word: &[char], columns: usize) -> Vec<&[char]> {
    let (mut pieces, mut rest) = (Vec::new(), word);
    while rest.len() > columns {
        let behind = |sign: char| rest[..columns].iter().rposition(|&letter| letter == sign).map(|at| at + 1);
        let at = behind('/').or_else(|| behind('-').max(behind('_'))).unwrap_or(columns);
        pieces.push(&rest[..at]);
        rest = &rest[at..];
    }
    pieces.push(rest);
    pieces
}

fn glyph(letter: char) -> [u8; GLYPH] {
    let letter = match letter {
        '\u{2010}'..='\u{2015}' | '\u{2212}' => '-',
        '\u{2018}' | '\u{2019}' => '\'',
        '\u{201c}' | '\u{201d}' => '"',
        '≤' => '<',
        '≥' => '>',
        '\t' | '\u{a0}' => ' ',
        letter => letter,
    };
    // By position: font8x8 0.3.1 keys three signs of its Latin table as '²', and finds the acute accent.
    let latin = || LATIN_UNICODE.get((letter as usize).checked_sub(0xa0)?).map(|glyph| glyph.byte_array());
    let drawn = BASIC_FONTS.get(letter).or_else(latin).or_else(|| GREEK_FONTS.get(letter));
    drawn.unwrap_or_else(|| BASIC_FONTS.get('?').expect("ASCII has it"))
}
