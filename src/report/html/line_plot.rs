//! Small plots of lines: a figure against another.

use super::super::plot::{Failure, colour, font};
use plotters::coord::ranged1d::AsRangedCoord;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Series of points, each with a name.
pub(super) type Series = (String, Vec<(f64, f64)>);

const SIZE: (u32, u32) = (480, 270);

/// A plot with axes of any kind; `line` is a horizontal line with its name.
pub(super) fn plot<X, Y>(
    (x_name, x): (&str, X),
    (y_name, y): (&str, Y),
    series: &[Series],
    line: Option<(f64, &str)>,
    figures: (fn(f64) -> String, fn(f64) -> String),
) -> String
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let mut text = String::new();
    match draw((x_name, x), (y_name, y), series, line, figures, &mut text) {
        Ok(()) => text,
        Err(_) => String::new(), // a string takes everything: never
    }
}

fn draw<'a, X, Y>(
    (x_name, x): (&str, X),
    (y_name, y): (&str, Y),
    series: &[Series],
    line: Option<(f64, &str)>,
    (x_figure, y_figure): (fn(f64) -> String, fn(f64) -> String),
    text: &'a mut String,
) -> Result<(), Failure<'a>>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    let mut chart = ChartBuilder::on(&root)
        .margin(8)
        .margin_right(20)
        .x_label_area_size(38)
        .y_label_area_size(58)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .x_desc(x_name)
        .y_desc(y_name)
        .x_labels(10)
        .y_labels(6)
        .axis_desc_style(font(13))
        .label_style(font(12))
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_label_formatter(&|x| x_figure(*x))
        .y_label_formatter(&|y| y_figure(*y))
        .draw()?;
    let ends = series
        .iter()
        .flat_map(|s| &s.1)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.0), b.max(p.0)));
    if let Some((level, name)) = line {
        chart.draw_series(DashedLineSeries::new(
            [(ends.0, level), (ends.1, level)],
            5,
            4,
            BLACK.mix(0.6).stroke_width(1),
        ))?;
        chart.draw_series([Text::new(
            name.to_owned(),
            (ends.0, level),
            font(12).pos(Pos::new(HPos::Left, VPos::Bottom)),
        )])?;
    }
    for (i, (name, points)) in series.iter().enumerate() {
        let colour = colour(i);
        let drawn = chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
        if series.len() > 1 {
            drawn
                .label(name.clone())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
        }
        if points.len() <= 24 {
            chart.draw_series(points.iter().map(|&p| Circle::new(p, 3, colour.filled())))?;
        }
    }
    if series.len() > 1 {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .label_font(font(12))
            .background_style(WHITE.mix(0.85))
            .border_style(TRANSPARENT)
            .draw()?;
    }
    root.present()
}
