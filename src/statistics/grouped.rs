//! Distribution functions of grouped data at the borders of the groups: what was counted, less what was to be expected.
//!
//! With n values in all, C_j of them in the first j groups of the given order and F_j the masses of these groups,
//! h_j = C_j / n - F_j. Above the median, both are summed from the far end, so that 1 - F_j keeps its digits too.

use super::CompensatedSum;
use super::error::{Error, require};

/// A border between two groups, or one of the two ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Border {
    /// F, the mass before it.
    pub below: f64,
    /// 1 - F, the mass behind it.
    pub above: f64,
    /// Share of the values before it, less F.
    pub excess: f64,
}

/// All borders of groups with `counts` and `masses`.
#[derive(Debug)]
pub(super) struct Borders {
    /// One more than there are groups.
    pub borders: Vec<Border>,
    /// Number of values.
    pub n: u64,
    /// Bound of the error of any F.
    pub error: f64,
}

impl Borders {
    pub fn new(counts: &[u64], masses: &[f64], error: f64) -> Result<Self, Error> {
        if counts.len() != masses.len() {
            let (left_len, right_len) = (counts.len(), masses.len());
            return Err(Error::Length { left: "counts", left_len, right: "masses", right_len });
        }
        if let Some(index) = masses.iter().position(|mass| !(*mass >= 0.0 && mass.is_finite())) {
            let required = "non-negative and finite";
            return Err(Error::Element { name: "masses", index, value: masses[index], required });
        }
        require(error >= 0.0, "error", error, "non-negative")?;
        let n = counts.iter().fold(0, |n: u64, &count| n.saturating_add(count));
        if n == 0 {
            return Err(Error::TooFew { name: "values in the groups", len: 0, min: 1 });
        }
        let total = masses.iter().copied().collect::<CompensatedSum>().value();
        require((total - 1.0).abs() <= error + 1e-12, "sum of the masses", total, "1 within the error")?;
        let cumulative = |order: &mut dyn Iterator<Item = (&u64, &f64)>| {
            let (mut count, mut mass) = (0_u64, CompensatedSum::new());
            let mut pairs = vec![(0.0, 0.0)];
            for (&c, &m) in order {
                count = count.saturating_add(c);
                mass.add(m);
                pairs.push((count as f64 / n as f64, mass.value() / total));
            }
            pairs
        };
        let below = cumulative(&mut counts.iter().zip(masses));
        let above = cumulative(&mut counts.iter().zip(masses).rev());
        let border = |(&(share, below), &(share_above, above)): (&(f64, f64), &(f64, f64))| {
            let excess = if below < 0.5 { share - below } else { above - share_above };
            Border { below, above, excess }
        };
        Ok(Self {
            borders: below.iter().zip(above.iter().rev()).map(border).collect(),
            n,
            // Division by the total moves a border by no more than that is off.
            error: error + if error > 0.0 { (total - 1.0).abs() } else { 0.0 },
        })
    }
}
