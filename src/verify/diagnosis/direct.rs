//! Mistakes that show without counts: points outside of the domain by a share that is known, densities that disagree, variates at their ends.

use crate::random::{fill_unit, stream};
use crate::verify::check::Case;
use crate::verify::probe::{Draw, Fate};
use crate::verify::repeats::{Repeated, repeated};
use crate::verify::support::target_fails;
use crate::verify::weights::relative_spread;

/// A short name and a sentence.
pub(super) type Mistake = (&'static str, String);

/// Standard errors that a share may be off.
const SURE: f64 = 5.0;

/// What a share of points outside of the domain says.
pub(super) fn outside(case: &Case<'_>) -> Option<Mistake> {
    let (tally, domain) = (case.tally, case.probe.space().name());
    let n = tally.samples as f64;
    let share = tally.outside.count as f64 / n;
    let near = |expected: f64| (share - expected).abs() < SURE * (expected * (1.0 - expected) / n).sqrt();
    let triangle = matches!(domain, "triangle" | "mesh surface");
    if tally.outside.count == 0 {
        None
    } else if triangle && near(1.0 / 48.0) {
        let text =
            "1/48 of the points leave the triangle, as with the branch xi0 < xi1^2 where xi0 < xi1 belongs";
        Some(("branch squared", text.to_owned()))
    } else if triangle && near(0.25) {
        let text = "a quarter of the points leave the triangle: of points over the diagonal only one coordinate is folded back";
        Some(("one coordinate folded", text.to_owned()))
    } else if triangle && near(0.5) {
        let text = "half of the points leave the triangle: the unit square is not folded onto it";
        Some(("fold missing", text.to_owned()))
    } else if tally.rejected == 0 && near(case.expectation.rejected().value) {
        let text = format!(
            "{:.3}% of the points lie outside, the share that the density leaves to rejection: they are returned, not rejected",
            100.0 * share
        );
        Some(("rejected samples returned", text))
    } else if domain == "hemisphere" && near(0.5) {
        let text = "half of the directions are under the horizon: the sphere is sampled for the hemisphere";
        Some(("sphere for hemisphere", text.to_owned()))
    } else {
        None
    }
}

/// Everything is rejected.
pub(super) fn nothing(case: &Case<'_>) -> Option<Mistake> {
    let tally = case.tally;
    let text = "every sample is rejected: the lamp's other side, the other hemisphere, an empty table";
    (tally.samples > 0 && tally.rejected == tally.samples).then(|| ("nothing is sampled", text.to_owned()))
}

/// The density is no number over a part of the domain.
pub(super) fn not_finite(case: &Case<'_>) -> Option<Mistake> {
    let (location, value) = case.expectation.total.bad?;
    let first = case.tally.invalid.first.as_ref().map_or(String::new(), |offence| {
        format!(", and at {} of {} samples ({})", case.tally.invalid.count, case.tally.samples, offence.what)
    });
    let place = case.probe.describe(location.patch, location.at);
    let name = if value < 0.0 { "density negative" } else { "density not finite" };
    Some((name, format!("the density is {value} at {place}{first}")))
}

/// The points are few: not some that are common, as where values are clamped, but all of them.
pub(super) fn few_points(case: &Case<'_>) -> Option<Mistake> {
    let Repeated { pairs, equal, points, allowed, .. } = repeated(case)?;
    few(pairs, equal, points, allowed)
}

/// Of so many pairs, equal ones and points that came more than once; `allowed` of them may be equal.
fn few(pairs: f64, equal: u64, points: u64, allowed: f64) -> Option<Mistake> {
    const COMMON: u64 = 50;
    let few = equal as f64 > 2.0 * allowed + 100.0 && equal < COMMON * points;
    few.then(|| {
        let text = format!(
            "there are about {:.0} points in all: variates of too few bits (a texture of noise, 15 bits of rand), or a table of points",
            pairs / equal as f64
        );
        ("few points", text)
    })
}

/// What is left over of a variate leaves [0, 1), or does not fill it.
pub(super) fn left_over(case: &Case<'_>) -> Option<Mistake> {
    const SAMPLES: usize = 1 << 14;
    if let Some(first) = &case.tally.left_over_outside.first {
        let text = format!("the variate left over leaves [0, 1): {}", first.what);
        return Some(("left-over variate outside", text));
    }
    let dimensions = case.probe.dimensions().max(1);
    let mut xi = vec![0.0; SAMPLES * dimensions];
    fill_unit(&mut stream(case.settings.seed, "diagnosis", 1), &mut xi);
    let rests: Vec<f64> = xi.chunks_exact(dimensions).filter_map(|xi| case.probe.left_over(xi)).collect();
    let largest = rests.iter().copied().fold(0.0, f64::max);
    // Of a thousand uniform variates none is over 0.9 with a probability of 1e-46.
    (rests.len() >= 1000 && largest < 0.9).then(|| {
        let text = format!(
            "the variate left over is never above {largest:.4}: it is not re-scaled by the mass of its entry"
        );
        ("left-over variate not re-scaled", text)
    })
}

/// There is no density where the target is positive.
pub(super) fn target(case: &Case<'_>) -> Option<Mistake> {
    let probe = case.probe;
    probe.target_at(0, [0.5; 2])?;
    let (mut without, mut all) = (0.0, 0.0);
    for cell in case.expectation.partition.leaves() {
        let middle = [0, 1].map(|axis| 0.5 * (cell.low[axis] + cell.high[axis]));
        for patch in cell.patches.clone() {
            let target = probe.target_at(patch, middle).unwrap_or(0.0);
            let (density, jacobian) = probe.density_at(patch, middle);
            if target > 0.0 && jacobian > 0.0 {
                let measure = jacobian
                    * (cell.high[0] - cell.low[0]).max(1e-300)
                    * (cell.high[1] - cell.low[1]).max(1e-300);
                all += measure;
                without += if density > 0.0 { 0.0 } else { measure };
            }
        }
    }
    let refused = target_fails(case);
    refused.map(|place| {
        let share = 100.0 * without / all;
        let text = format!(
            "the density is 0 where the target is positive ({share:.1}% of where it is; for one {place}): a row or column without mass, a lookup that interpolates where the table does not"
        );
        ("target without density", text)
    })
}

/// The density follows another function than the one it was made for.
pub(super) fn importance(case: &Case<'_>) -> Option<Mistake> {
    const SAMPLES: usize = 1 << 12;
    let dimensions = case.probe.dimensions().max(1);
    let mut xi = vec![0.0; SAMPLES * dimensions];
    fill_unit(&mut stream(case.settings.seed, "importance", 1), &mut xi);
    let (ratios, allowed) = case.probe.importance(&xi)?;
    let own = relative_spread(&ratios);
    if own <= allowed {
        return None;
    }
    let mut draws = Vec::new();
    case.probe.locate(&xi, &mut draws);
    let names: Vec<String> =
        case.probe.rivals_at(draws.first()?.patch, draws[0].at).into_iter().map(|(name, _)| name).collect();
    let mut of_rival = vec![Vec::new(); names.len()];
    for at in &draws {
        let (density, _) = case.probe.density_at(at.patch, at.at);
        let values = case.probe.rivals_at(at.patch, at.at);
        if density > 0.0 {
            of_rival.iter_mut().zip(values).for_each(|(all, (_, value))| all.push(value / density));
        }
    }
    let best =
        of_rival.iter().map(|ratios| relative_spread(ratios)).zip(&names).min_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((found, name)) if found <= 2.0 * allowed && found < 0.5 * own => Some((
            "importance of a rival",
            format!(
                "the density follows {name} (spread {found:.3}), not what it was made for (spread {own:.3})"
            ),
        )),
        _ => Some((
            "importance of another function",
            format!(
                "the density follows another function than the one that it was made for: their ratio spreads by {own:.3} of its mean"
            ),
        )),
    }
}

/// How the density that comes with a sample differs from the one that is asked.
pub(super) fn disagreement(case: &Case<'_>) -> Option<Mistake> {
    const SAMPLES: usize = 1 << 14;
    if case.tally.disagreement.wrong == 0 {
        return None;
    }
    let (probe, partition) = (case.probe, &case.expectation.partition);
    let mut xi = vec![0.0; SAMPLES * probe.dimensions().max(1)];
    fill_unit(&mut stream(case.settings.seed, "diagnosis", 0), &mut xi);
    let (mut draws, mut values) = (Vec::new(), Vec::new());
    probe.draw(&xi, 1, &mut draws, &mut values);
    let ln_ratio = |draw: &Draw| (draw.density / draw.asked).ln();
    let sound: Vec<(usize, f64)> = draws
        .iter()
        .filter(|d| d.fate == Fate::Drawn && ln_ratio(d).is_finite())
        .map(|d| (partition.leaf_of(&d.location), ln_ratio(d)))
        .collect();
    let count = sound.len() as f64;
    if sound.len() < SAMPLES / 16 {
        return None;
    }
    let mean = sound.iter().map(|(_, r)| r).sum::<f64>() / count;
    let overall = sound.iter().map(|(_, r)| (r - mean).powi(2)).sum::<f64>() / count;
    if overall < 1e-8 {
        let text =
            format!("the density returned with a sample is {:.6} times the one at its point", mean.exp());
        return Some(("constant in the density returned", text));
    }
    // Scatter inside of leaves, where the point hardly varies: what is left depends on something else than the point.
    let mut of_leaf = vec![(0.0, 0.0, 0.0); partition.leaves().len()];
    for &(leaf, r) in &sound {
        let (n, sum, squares) = &mut of_leaf[leaf];
        (*n, *sum, *squares) = (*n + 1.0, *sum + r, *squares + r * r);
    }
    let inside = of_leaf.iter().filter(|(n, ..)| *n > 1.0);
    let (within, free) =
        inside.fold((0.0, 0.0), |(a, b), (n, sum, squares)| (a + squares - sum * sum / n, b + n - 1.0));
    if within / f64::max(free, 1.0) > 0.2 * overall {
        let text = "the density returned with a sample depends on more than its point, as when a mixture returns the density of the chosen part only";
        return Some(("chosen part only", text.to_owned()));
    }
    let text = "the density returned with a sample is another function of the point than the density asked";
    Some(("density returned is another", text.to_owned()))
}

/// What comes out where a variate is 0, just under 1, or at a knot of a table.
pub(super) fn edges(case: &Case<'_>) -> Option<Mistake> {
    const KNOTS: usize = 256;
    let probe = case.probe;
    if probe.pilots().is_some() {
        return None;
    }
    let discrete = probe.space().axes() == 0;
    for dimension in 0..probe.dimensions() {
        let knots = probe.variate_knots(dimension);
        for value in crate::verify::edges::values().into_iter().chain(knots.into_iter().take(KNOTS)) {
            let mut xi = vec![0.5; probe.dimensions()];
            xi[dimension] = value;
            let Some(look) = probe.look(&xi) else { continue };
            let at = match value {
                0.0 => "at the variate 0".to_owned(),
                value if value > 0.999_999 => "at the largest variate under 1".to_owned(),
                value => format!("where a variate is {value}, a boundary of the table,"),
            };
            match &look.location {
                Err(why) if why.contains("not finite") => {
                    return Some(("not finite at the end", format!("{at} the point {why}")));
                }
                Err(why) => return Some(("outside at the end", format!("{at} the point {why}"))),
                Ok(_) if look.density == 0.0 && discrete => {
                    let text = format!(
                        "{at} an entry of mass 0 is returned, as by a search with < where <= belongs"
                    );
                    return Some(("entry of mass 0", text));
                }
                Ok(_) if !look.density.is_finite() => {
                    return Some((
                        "density not finite at the end",
                        format!("{at} the density is {}", look.density),
                    ));
                }
                Ok(_) => {}
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_are_few() {
        let is = |equal: u64, points: u64, allowed: f64| few(1e6, equal, points, allowed).is_some();
        // More than twice what is allowed and a hundred, …
        assert_eq!([99, 100, 101, 102].map(|equal| is(equal, 100, 0.0)), [false, false, true, true]);
        assert_eq!([179, 180, 181].map(|equal| is(equal, 180, 40.0)), [false, false, true]);
        // … but of each point less than fifty.
        assert_eq!([9999, 10_000, 10_001].map(|equal| is(equal, 200, 0.0)), [true, false, false]);
        assert_eq!(
            [(0, 0), (50, 40), (1_000_000, 1)].map(|(equal, points)| is(equal, points, 0.0)),
            [false; 3]
        );
        let (name, text) = few(1e6, 250, 200, 0.0).unwrap();
        assert_eq!(name, "few points");
        assert!(text.starts_with("there are about 4000 points in all: variates of too few bits"), "{text}");
    }
}
