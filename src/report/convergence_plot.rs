//! Error against run time as a plot.

use super::convergence::{all_exact, best_efficiency, seeds_of};
use super::plot::{Failure, colour, font};
use crate::estimator::{Convergence, Curve, Measured, standard_errors};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

const SIZE: (u32, u32) = (1120, 620);
const LEGEND: u32 = 330;
/// Of the dotted line: pixels that are drawn and those that are not.
const DOT: i32 = 2;
const HOLE: i32 = 5;

/// The plot as the text of an SVG file: the root of the squared error over the CPU time of a picture, both logarithmic, with 95%
/// intervals over seeds, the fitted powers of the time and their slopes; and the error of the reference, if it has one. What is exact has no points; if all
/// of them are, a sentence says so.
///
/// # Errors
/// [`std::fmt::Error`] if the text can't be put together, or nothing was measured.
pub fn convergence_plot(title: &str, found: &Convergence) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    draw(title, found, &mut text).map_err(|_| std::fmt::Error)?;
    if text.is_empty() { Err(std::fmt::Error) } else { Ok(text) }
}

/// Time, and the root of the error with the ends of its interval; the lower end is 0 if it may be anything.
fn points(curve: &Curve) -> Vec<(f64, [f64; 3])> {
    let rungs = curve.rungs.iter().filter(|r| r.squared.mean > 0.0 && r.cpu.mean > 0.0);
    let root = |x: f64| x.max(0.0).sqrt();
    rungs
        .map(|r| {
            let t = standard_errors((r.seeds as f64 - 1.0).max(1.0));
            let Measured { mean, error } = r.squared;
            let half = if error.is_nan() { 0.0 } else { t * error };
            (r.cpu.mean, [root(mean - half), root(mean), root(mean + half)])
        })
        .collect()
}

/// 1, 2 and 5 times powers of ten; others would not fit beside them.
fn figure(x: f64) -> String {
    let power = x.log10().floor() as i32;
    let digit = x / 10_f64.powi(power);
    match digit {
        d if ![1.0, 2.0, 5.0, 10.0].iter().any(|r| (d - r).abs() < 1e-6) => String::new(),
        _ if (-3..4).contains(&power) => {
            format!("{x:.3}").trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        _ => format!("{x:.0e}"),
    }
}

fn draw<'a>(title: &str, found: &Convergence, text: &'a mut String) -> Result<(), Failure<'a>> {
    let series: Vec<_> =
        found.curves.iter().map(|c| if c.is_exact() { Vec::new() } else { points(c) }).collect();
    let all = || series.iter().flatten();
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)))
    };
    let floor = found.reference.squared_error.sqrt();
    let nothing = all().next().is_none();
    // Without a point, the times that were measured, and errors of any size.
    let measured = found.curves.iter().flat_map(|c| &c.rungs).map(|r| r.cpu.mean).filter(|t| *t > 0.0);
    let times = ends(&mut all().map(|p| p.0).chain(measured.filter(|_| nothing)));
    let none = [1e-6, 1.0].into_iter().filter(|_| nothing);
    let errors = ends(&mut all().map(|p| p.1[1]).chain((floor > 0.0).then_some(floor)).chain(none));
    if times.1 == 0.0 {
        return Ok(());
    }
    let (x, y) = ((times.0 / 1.5, times.1 * 1.5), (errors.0 / 2.0, errors.1 * 2.0));

    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let (panel, legend) = root.split_horizontally(SIZE.0 - LEGEND);
    let mut chart = ChartBuilder::on(&panel)
        .caption(title, font(20))
        .margin(12)
        .x_label_area_size(48)
        .y_label_area_size(78)
        .build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("CPU time of a picture, in seconds")
        .y_desc("error: root mean square, in radiance")
        .axis_desc_style(font(16))
        .label_style(font(14))
        .light_line_style(WHITE)
        .bold_line_style(BLACK.mix(0.14))
        .x_label_formatter(&|x| figure(*x))
        .y_label_formatter(&|y| figure(*y))
        .draw()?;
    if floor > 0.0 {
        chart.draw_series(DashedLineSeries::new(
            [(x.0, floor), (x.1, floor)],
            6,
            5,
            BLACK.mix(0.5).stroke_width(1),
        ))?;
        chart.draw_series([Text::new(
            "error of the reference (taken off)",
            (x.0 * 1.05, floor * 0.97),
            font(13),
        )])?;
    }
    // What the root of a sum of independent samples does, from the middle of the first curve.
    let guide = (times.0 * times.1).sqrt();
    let height = (errors.0 * errors.1).sqrt();
    if nothing {
        let sentence = match all_exact(found) {
            true => "all strategies are exact: there is no error to draw",
            false => "no error can be told from 0",
        };
        let centred = font(18).pos(Pos::new(HPos::Center, VPos::Center));
        chart.draw_series([Text::new(sentence, (guide, height), centred)])?;
    } else {
        let line = [times.0, times.1].map(|t| (t, height * (t / guide).powf(-0.5)));
        let dots = BLACK.mix(0.45).stroke_width(2);
        chart.draw_series(DashedLineSeries::new(line, DOT as u32, HOLE as u32, dots))?;
    }
    for (i, (curve, points)) in found.curves.iter().zip(&series).enumerate() {
        let colour = colour(i);
        let law = curve.fit_time.filter(|_| curve.sees_all());
        if let (Some((a, b)), Some(first), Some(last)) = (law, points.first(), points.last()) {
            let ends = [first.0, last.0].map(|t| (t, (a * t.powf(b)).sqrt()));
            chart.draw_series(LineSeries::new(ends, colour.stroke_width(2)))?;
        }
        for &(t, [low, at, high]) in points {
            let ends = [low, high.min(y.1)];
            if low <= y.0 {
                // It may be anything: the bar has no lower end.
                let thin = colour.mix(0.35).stroke_width(1);
                chart.draw_series(LineSeries::new([(t, y.0), (t, at)], thin))?;
            }
            let bar = ends.map(|e| (t, if e <= y.0 { at } else { e }));
            chart.draw_series(LineSeries::new(bar, colour.stroke_width(2)))?;
            for end in ends.into_iter().filter(|e| *e > y.0) {
                let cap = [(t / 1.025, end), (t * 1.025, end)];
                chart.draw_series(LineSeries::new(cap, colour.stroke_width(2)))?;
            }
            chart.draw_series([Circle::new((t, at), 4, colour.filled())])?;
        }
    }

    let middle = |size| font(size).pos(Pos::new(HPos::Left, VPos::Center));
    let best = best_efficiency(found);
    let mut y = 64;
    for (i, curve) in found.curves.iter().enumerate() {
        let colour = colour(i);
        legend.draw(&PathElement::new([(4, y), (36, y)], colour.stroke_width(2)))?;
        legend.draw(&Circle::new((20, y), 4, colour.filled()))?;
        legend.draw(&Text::new(curve.strategy.to_string(), (46, y), middle(17)))?;
        let slope = match curve.slope_time {
            _ if curve.is_exact() => "exact, but for rounding".to_owned(),
            _ if !curve.sees_all() => "no slope".to_owned(),
            Some(s) if s.half_width.is_finite() => format!("slope {:.3} ± {:.3}", s.value, s.half_width),
            Some(s) => format!("slope {:.3}", s.value),
            None => "no slope".to_owned(),
        };
        legend.draw(&Text::new(slope, (46, y + 22), middle(15)))?;
        let efficiency = match best / curve.efficiency {
            _ if curve.is_exact() => String::new(),
            _ if !curve.sees_all() => "has not seen all there is".to_owned(),
            x if !x.is_finite() => String::new(),
            x if x < 1.005 => "the most efficient".to_owned(),
            x if x < 9.95 => format!("{x:.1} times the time for equal error"),
            x => format!("{x:.0} times the time for equal error"),
        };
        legend.draw(&Text::new(efficiency, (46, y + 42), middle(15)))?;
        y += 78;
    }
    y += 8;
    if !nothing {
        for x in (4..36).step_by((DOT + HOLE) as usize) {
            legend.draw(&PathElement::new([(x, y), (x + DOT, y)], BLACK.mix(0.45).stroke_width(2)))?;
        }
        legend.draw(&Text::new("slope -1/2", (46, y), middle(14)))?;
    }
    for line in [
        format!("{} seeds; bars and ± are 95% intervals", seeds_of(found)),
        "time of one thread, without set-up".to_owned(),
        match found.reference.run {
            Some((strategy, passes)) => format!("reference: {strategy} at {passes} samples a pixel"),
            None if found.reference.parts.is_empty() => "reference: given".to_owned(),
            None => "reference: closed form of the scene".to_owned(),
        },
    ] {
        y += 24;
        legend.draw(&Text::new(line, (4, y), middle(14)))?;
    }
    root.present()
}
