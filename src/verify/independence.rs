//! Samples don't depend on each other, nor on what is left over of their variates.
//!
//! Tables of counts, class by class, tested for independence by Pearson's X^2 with (rows - 1)(columns - 1) degrees of freedom against the counts that
//! their own margins give (Pearson 1904; Agresti, "Categorical Data Analysis", section 3.2): no expected count enters, so no error of one.

use super::check::{Case, Check, Rests};
use super::expectation::{Expectation, LEAST};
use super::finding::{Evidence, Finding};
use super::probe::Probe;
use super::tally::{CLASSES, classes};
use crate::random::{fill_unit, stream};
use crate::statistics::chi_square;

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

    fn run(&self, case: &Case<'_>) -> Vec<Finding> {
        let classes = classes(case.expectation);
        let tally = case.tally;
        let mut findings = Vec::new();
        findings.extend(table(self.name(), "consecutive samples", &tally.pairs, classes));
        findings.extend(table(
            self.name(),
            "two streams",
            &streams(case.probe, case.expectation, case.settings.seed),
            classes,
        ));
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

/// Independence of rows and columns; `None` with fewer than two of either.
fn table(check: &'static str, part: &str, counts: &[u64], columns: usize) -> Option<Finding> {
    let rows = counts.len() / columns.max(1);
    let row_sums: Vec<f64> = counts.chunks_exact(columns).map(|row| row.iter().sum::<u64>() as f64).collect();
    let column_sums: Vec<f64> =
        (0..columns).map(|c| counts.iter().skip(c).step_by(columns).sum::<u64>() as f64).collect();
    let n: f64 = row_sums.iter().sum();
    // Rows and columns so light that their smallest cell expects too little are left out.
    let heaviest = |sums: &[f64]| sums.iter().copied().fold(0.0, f64::max);
    let keep = |sums: &[f64], other: f64| -> Vec<usize> {
        (0..sums.len())
            .filter(|&i| sums[i] * other / columns as f64 >= LEAST * n / 4.0 && sums[i] > 0.0)
            .collect()
    };
    let (used_rows, used_columns) =
        (keep(&row_sums, heaviest(&column_sums)), keep(&column_sums, heaviest(&row_sums)));
    let at = |r: usize, c: usize| counts[r * columns + c] as f64;
    let row_total: Vec<f64> = (0..rows).map(|r| used_columns.iter().map(|&c| at(r, c)).sum()).collect();
    let column_total: Vec<f64> = (0..columns).map(|c| used_rows.iter().map(|&r| at(r, c)).sum()).collect();
    let total: f64 = used_rows.iter().map(|&r| row_total[r]).sum();
    let (mut statistic, mut expects_enough) = (0.0, true);
    for &r in &used_rows {
        for &c in &used_columns {
            let expected = row_total[r] * column_total[c] / total;
            expects_enough &= expected >= LEAST / 4.0;
            statistic += (at(r, c) - expected).powi(2) / expected;
        }
    }
    if used_rows.len() < 2 || used_columns.len() < 2 || !expects_enough {
        return None;
    }
    let df = ((used_rows.len() - 1) * (used_columns.len() - 1)) as f64;
    let p = chi_square::sf(statistic, df).unwrap_or(f64::NAN);
    let detail = format!(
        "X^2 = {statistic:.1} at {df} degrees of freedom, {} x {} classes",
        used_rows.len(),
        used_columns.len()
    );
    Some(Finding::new(check, Evidence::Chance { p, conservative: p }, detail).part(part))
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
