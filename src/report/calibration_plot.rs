//! A calibration as a plot: measured rates over nominal ones, and p-values against the uniform distribution.

use super::plot::{Failure, colour, font};
use crate::calibration::{Calibration, Claim, Mode, Row, Subject};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

const SIZE: (u32, u32) = (1240, 560);
const LEGEND: u32 = 230;
/// Rates below it are drawn on it.
const FLOOR: f64 = 1e-4;
/// Kolmogorov's distance times sqrt n that is passed with probability 0.01.
const BAND: f64 = 1.628;
/// Lower and upper end of the right panel, in widths of the band.
const ENDS: (f64, f64) = (-3.0, 2.0);

/// The plot as the text of an SVG file.
///
/// Left: for every check and the whole verdict the measured rate of alarms over the level, both logarithmic, with its 95% interval, those of one
/// level side by side in a band; checks that may raise no alarm at all are left out. Right: for every part of every check, over p, the share of p-values
/// below p minus p, in widths of Kolmogorov's 99% band of as many values; what is beyond the axis is not drawn.
///
/// # Errors
/// [`std::fmt::Error`] if the text can't be put together.
pub fn calibration_plot(calibration: &Calibration) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    draw(calibration, &mut text).map_err(|_| std::fmt::Error)?;
    Ok(text)
}

/// What is drawn of a row: those that involve chance.
fn series(calibration: &Calibration) -> Vec<(&Row, RGBColor)> {
    let rows = calibration.rows.iter().filter(|row| !row.all.is_certain());
    // The runs that stop early repeat the checks that don't count.
    let rows = rows
        .filter(|row| row.mode == Mode::Fixed || row.subject == Subject::Whole || row.name() == "sequential");
    rows.enumerate()
        .map(|(i, row)| {
            let whole = row.subject == Subject::Whole && row.mode == Mode::Fixed;
            (row, if whole { BLACK } else { colour(i) })
        })
        .collect()
}

fn draw<'a>(calibration: &Calibration, text: &'a mut String) -> Result<(), Failure<'a>> {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let (panels, legend) = root.split_horizontally(SIZE.0 - LEGEND);
    let (left, right) = panels.split_horizontally((SIZE.0 - LEGEND) / 2);
    let series = series(calibration);
    rates(&left, &series)?;
    distributions(&right, calibration, &series)?;
    explain(&legend, calibration, &series)?;
    root.present()
}

/// A square for the whole verdict, a triangle for peeking, a disk for a single check.
#[derive(Clone, Copy, PartialEq)]
enum Marker {
    Square,
    Triangle,
    Disk,
}

fn marker(row: &Row) -> Marker {
    match (row.mode, row.subject) {
        (Mode::Anytime, _) => Marker::Triangle,
        (_, Subject::Whole) => Marker::Square,
        _ => Marker::Disk,
    }
}

/// A marker in pixels.
fn mark<'a>(
    area: &DrawingArea<SVGBackend<'a>, Shift>,
    (x, y): (i32, i32),
    marker: Marker,
    colour: RGBColor,
) -> Result<(), Failure<'a>> {
    match marker {
        Marker::Square => area.draw(&Rectangle::new([(x - 5, y - 5), (x + 5, y + 5)], colour.filled())),
        Marker::Triangle => area.draw(&TriangleMarker::new((x, y), 6, colour.filled())),
        Marker::Disk => area.draw(&Circle::new((x, y), 4, colour.filled())),
    }
}

fn rates<'a>(
    area: &DrawingArea<SVGBackend<'a>, Shift>,
    series: &[(&Row, RGBColor)],
) -> Result<(), Failure<'a>> {
    let range = (FLOOR * 0.8)..0.2;
    let mut chart = ChartBuilder::on(area)
        .caption("rate of alarms of right samplers", font(18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d((4e-4..0.12).log_scale(), range.log_scale())?;
    chart
        .configure_mesh()
        .x_desc("nominal: level alpha")
        .y_desc("measured, with 95% interval")
        .axis_desc_style(font(15))
        .label_style(font(13))
        .light_line_style(WHITE)
        .bold_line_style(BLACK.mix(0.12))
        .x_label_formatter(&|x| format!("{x}"))
        .y_label_formatter(&|y| format!("{y}"))
        .draw()?;
    // Side by side, so that the intervals don't hide each other: all that stands in a level's band is to be held against the line across it. Two
    // levels are a factor of 5 apart at least.
    let step = 0.11_f64.min(1.5 / series.len().max(1) as f64);
    let half = step * (0.5 * series.len() as f64 + 0.1);
    let mut levels: Vec<f64> =
        series.iter().flat_map(|(row, _)| row.all.rates.iter().map(|r| r.level)).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    for level in levels {
        let (left, right) = (level * (-half).exp(), level * half.exp());
        chart.draw_series([Rectangle::new([(left, FLOOR * 0.8), (right, 0.2)], BLACK.mix(0.06).filled())])?;
        chart
            .draw_series(LineSeries::new([(left, level), (right, level)], BLACK.mix(0.6).stroke_width(2)))?;
    }
    for (i, &(row, colour)) in series.iter().enumerate() {
        let beside = (step * (i as f64 - 0.5 * (series.len() as f64 - 1.0))).exp();
        for rate in &row.all.rates {
            let x = rate.level * beside;
            let share = rate.alarms as f64 / row.all.runs.max(1) as f64;
            let [low, high, at] =
                [rate.interval.lower, rate.interval.upper, share].map(|y| y.clamp(FLOOR, 0.2));
            chart.draw_series(LineSeries::new([(x, low), (x, high)], colour.stroke_width(2)))?;
            let pixel = chart.backend_coord(&(x, at));
            let origin = area.get_base_pixel();
            mark(area, (pixel.0 - origin.0, pixel.1 - origin.1), marker(row), colour)?;
        }
    }
    Ok(())
}

fn distributions<'a>(
    area: &DrawingArea<SVGBackend<'a>, Shift>,
    calibration: &Calibration,
    series: &[(&Row, RGBColor)],
) -> Result<(), Failure<'a>> {
    let mut chart = ChartBuilder::on(area)
        .caption("distribution of p-values", font(18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..1.0, ENDS.0..ENDS.1)?;
    chart
        .configure_mesh()
        .x_desc("p")
        .y_desc("share of p-values below p, minus p, in 99% bands")
        .axis_desc_style(font(15))
        .label_style(font(13))
        .light_line_style(WHITE)
        .bold_line_style(BLACK.mix(0.12))
        .draw()?;
    chart.draw_series([Rectangle::new([(0.0, -1.0), (1.0, 1.0)], BLACK.mix(0.08).filled())])?;
    let range = (ENDS.0, ENDS.1);
    for &(row, colour) in series {
        for part in calibration.uniformity_of(row).into_iter().filter(|u| u.sampler.is_none()) {
            let band = BAND / (part.p_values.len() as f64).sqrt();
            let is_uniform = part.claim == Claim::Uniform;
            // At 0 and 1 nothing can be off; where values are heaped at 1, the way there says nothing.
            let curve = (0..200 + i32::from(is_uniform)).map(|i| {
                let p = f64::from(i) / 200.0;
                let off = if i % 200 == 0 { 0.0 } else { part.share_up_to(p) - p };
                (p, off / band)
            });
            for piece in within(&curve.collect::<Vec<_>>(), range) {
                if is_uniform {
                    chart.draw_series(LineSeries::new(piece, colour.stroke_width(2)))?;
                } else {
                    chart.draw_series(DashedLineSeries::new(piece, 3, 4, colour.stroke_width(1)))?;
                }
            }
        }
    }
    Ok(())
}

/// The pieces of a curve whose ordinates are within a range.
fn within(curve: &[(f64, f64)], (low, high): (f64, f64)) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    for pair in curve.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        if y0.max(y1) < low || y0.min(y1) > high {
            continue;
        }
        let ends = [(x0, y0), (x1, y1)].map(|(x, y)| {
            let clipped = y.clamp(low, high);
            if clipped == y { (x, y) } else { (x0 + (x1 - x0) * (clipped - y0) / (y1 - y0), clipped) }
        });
        match pieces.last_mut().filter(|piece| piece.last() == Some(&ends[0])) {
            Some(piece) => piece.push(ends[1]),
            None => pieces.push(ends.to_vec()),
        }
    }
    pieces
}

fn explain<'a>(
    area: &DrawingArea<SVGBackend<'a>, Shift>,
    calibration: &Calibration,
    series: &[(&Row, RGBColor)],
) -> Result<(), Failure<'a>> {
    let middle = |size| font(size).pos(Pos::new(HPos::Left, VPos::Center));
    let mut y = 60;
    for &(row, colour) in series {
        let name = match row.mode {
            Mode::Fixed => row.name().to_owned(),
            Mode::Anytime => format!("{}, peeking", row.name()),
        };
        area.draw(&PathElement::new([(4, y), (32, y)], colour.stroke_width(2)))?;
        mark(area, (18, y), marker(row), colour)?;
        area.draw(&Text::new(name, (42, y), middle(15)))?;
        y += 24;
    }
    let lines = [
        "left: points of one level stand".to_owned(),
        "side by side in its band; the".to_owned(),
        "line across it is the level".to_owned(),
        format!("rates below {FLOOR} at {FLOOR}"),
        String::new(),
        "right: a curve for each part of a".to_owned(),
        "check, all in the check's colour".to_owned(),
        "solid: claims to be uniform".to_owned(),
        "dashed: may be larger,".to_owned(),
        "so may fall below the band".to_owned(),
        format!("(not drawn below {})", ENDS.0),
        "grey: 99% band of Kolmogorov".to_owned(),
        String::new(),
        format!("{} runs, seed {}", calibration.runs, calibration.seed),
    ];
    y -= 4;
    for line in lines {
        y += if line.is_empty() { 10 } else { 18 };
        area.draw(&Text::new(line, (4, y), middle(13)))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::within;

    #[test]
    fn curves_end_at_the_axis() {
        let curve = [(0.0, 0.0), (1.0, -2.0), (2.0, -2.0), (3.0, 0.0), (4.0, 0.5)];
        let pieces = [vec![(0.0, 0.0), (0.5, -1.0)], vec![(2.5, -1.0), (3.0, 0.0), (4.0, 0.5)]];
        assert_eq!(within(&curve, (-1.0, 1.0)), pieces);
        assert_eq!(within(&curve, (-3.0, 1.0)), [curve.to_vec()]);
    }
}
