//! Samples don't depend on each other, nor on what is left over of their variates.
//!
//! Tables of counts, class by class, are tested against the counts that their own margins give: no expected count enters, so no error of one.

use super::check::{Case, Check, Needs, Rests};
use super::expectation::{Expectation, LEAST};
use super::finding::{Evidence, Finding};
use super::probe::Probe;
use super::tally::{CLASSES, classes};
use crate::random::{fill_unit, stream};
use crate::statistics::chi_square;

/// What the lightest cell of a table expects at least; the cells beside it expect more (Cochran 1954).
const LIGHT: f64 = 2.0;
/// Samples of each of two streams that are held against each other.
const STREAM: usize = 1 << 14;

pub(super) struct Independence;

impl Check for Independence {
    fn name(&self) -> &'static str {
        "independence"
    }

    fn about(&self) -> &'static str {
        "consecutive samples, streams, and the point and the variate left over don't depend on each other"
    }

    fn rests(&self) -> Rests {
        Rests::Counts
    }

    fn needs(&self) -> Needs {
        Needs::Samples
    }

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let classes = classes(case.expectation);
        let tally = case.tally;
        let mut findings = Vec::new();
        findings.extend(table(self.name(), "consecutive samples", &tally.pairs, classes));
        if Needs::Variates.met_by(case.probe) {
            let counts = streams(case.probe, case.expectation, case.settings.seed);
            findings.extend(table(self.name(), "two streams", &counts, classes));
        }
        if tally.left_over.iter().any(|&count| count > 0) {
            findings.extend(table(self.name(), "point and variate left over", &tally.left_over, CLASSES));
            let mut margin = vec![0; CLASSES];
            tally
                .left_over
                .chunks_exact(CLASSES)
                .for_each(|row| margin.iter_mut().zip(row).for_each(|(a, b)| *a += b));
            findings.extend(uniform(self.name(), &margin));
        }
        findings
    }
}

/// The table of the classes of two streams' samples, side by side.
fn streams(probe: &dyn Probe, expectation: &Expectation, seed: u64) -> Vec<u64> {
    let classes = classes(expectation);
    let Some(scale) = expectation.scales.first() else { return vec![0; classes * classes] };
    let class_of = |stream_number: u64| -> Vec<usize> {
        let mut rng = stream(seed, "two streams", stream_number);
        let mut xi = vec![0.0; probe.dimensions().max(1) * STREAM];
        fill_unit(&mut rng, &mut xi);
        let mut draws = Vec::new();
        probe.draw(&xi, usize::MAX, &mut draws, &mut Vec::new());
        let leaf = |draw: &super::probe::Draw| expectation.partition.leaf_of(&draw.location);
        draws
            .iter()
            .map(|draw| match draw.fate {
                super::probe::Fate::Drawn => scale.of_leaf[leaf(draw)].unwrap_or(classes - 1),
                _ => classes - 1,
            })
            .collect()
    };
    let mut counts = vec![0; classes * classes];
    for (a, b) in class_of(0).into_iter().zip(class_of(1)) {
        counts[a * classes + b] += 1;
    }
    counts
}

/// Independence of rows and columns, but for those so light that a cell expects less than [`LIGHT`]; `None` with fewer than two of either.
fn table(check: &'static str, part: &str, counts: &[u64], columns: usize) -> Option<Finding> {
    let mut counts = counts.to_vec();
    let rows = counts.len() / columns.max(1);
    loop {
        let row_sums: Vec<u64> = counts.chunks_exact(columns).map(|row| row.iter().sum()).collect();
        let column_sums: Vec<u64> =
            (0..columns).map(|c| counts.iter().skip(c).step_by(columns).sum()).collect();
        let lightest = |sums: &[u64]| {
            sums.iter().copied().enumerate().filter(|(_, sum)| *sum > 0).min_by_key(|(_, sum)| *sum)
        };
        let ((row, a), (column, b)) = (lightest(&row_sums)?, lightest(&column_sums)?);
        let n: u64 = row_sums.iter().sum();
        if a as f64 * b as f64 >= LIGHT * n as f64 {
            break;
        }
        // The margins themselves decide what is left out, and a table is judged given its margins.
        if a <= b {
            counts[row * columns..][..columns].fill(0);
        } else {
            (0..rows).for_each(|row| counts[row * columns + column] = 0);
        }
    }
    let figure = chi_square::independence(&counts, columns).ok()?;
    let detail = format!("X^2 = {:.1} at {} degrees of freedom", figure.statistic, figure.df);
    Some(Finding::new(check, Evidence::Chance { p: figure.p, conservative: figure.p }, detail).part(part))
}

fn uniform(check: &'static str, counts: &[u64]) -> Option<Finding> {
    let n: u64 = counts.iter().sum();
    let expected = n as f64 / counts.len() as f64;
    if expected < LEAST {
        return None;
    }
    let figure = chi_square::statistic(counts, &vec![expected; counts.len()]).ok()?;
    let detail = format!(
        "X^2 = {:.1} at {} degrees of freedom: is the variate left over uniform?",
        figure.statistic, figure.df
    );
    Some(
        Finding::new(check, Evidence::Chance { p: figure.p, conservative: figure.p }, detail)
            .part("variate left over"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Interval;
    use crate::sampler::from_fn;
    use crate::verify::expectation::told;
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;
    use crate::verify::tally::Tally;

    /// Variates left over are judged as soon as there are any, in some of their classes or in all.
    #[test]
    fn variates_left_over_in_all_classes() {
        let line = Interval::new(0.0, 1.0);
        let (sampler, extras) = (from_fn(line, |u: f64| u, |_: f64| 1.0), Extras::default());
        let (probe, settings) = (Subject::new(&sampler, &extras), Settings::default());
        let expectation = told::expectation(&line, [told::integral(0.25, 0.0); 4], vec![]);
        let found = |left_over: [u64; CLASSES]| {
            let tally = Tally { left_over: left_over.into(), ..Tally::default() };
            let case = Case { probe: &probe, expectation: &expectation, tally: &tally, settings: &settings };
            Independence
                .run(&case)
                .into_iter()
                .map(|finding| (finding.part, finding.detail))
                .collect::<Vec<_>>()
        };
        let said = |x2: &str| {
            let detail = format!("X^2 = {x2} at 15 degrees of freedom: is the variate left over uniform?");
            vec![("variate left over".to_owned(), detail)]
        };
        let mut most = [10; CLASSES];
        assert_eq!(found(most), said("0.0"));
        (most[3], most[7]) = (0, 20);
        assert_eq!(found(most), said("20.0"));
        assert_eq!(found([0; CLASSES]), vec![]);
    }
}
