//! What the chi-square test would have caught.
//!
//! A density that is wrong by the factor 1 + e over the share y of the mass, and right by the same amount too little elsewhere, adds the noncentrality
//! n e^2 y / (1 - y) to the statistic of a scale whose cells the region fills (Agresti, "Categorical Data Analysis", section 6.6). A region in one piece does not fill the cells on
//! its border: of the m cells that a compact one covers, along each axis s = m^(1/axes) of them, at worst s - 1 are full and two half, so that
//! ((s - 1/2) / s)^axes of the noncentrality is left. The scale that sees best counts, at its own share of the level, or the [scan](super::scan) if that
//! sees better.

use super::scan;
use crate::statistics::{chi_square as tail, normal};

/// A relative error of `error` over any `mass` of the distribution, in one piece, would have been caught with probability 0.99.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// Share of the mass.
    pub mass: f64,
    /// Relative error of the density over it.
    pub error: f64,
}

/// The shares that are told.
const SHARES: [f64; 4] = [0.01, 0.05, 0.2, 0.5];

pub(super) fn power(axes: usize, scales: &[usize], samples: u64, alpha: f64) -> Vec<Power> {
    let at = |mass: f64| {
        let best = scales
            .iter()
            .filter(|&&cells| cells > 1)
            .filter_map(|&cells| {
                let needed = tail::noncentrality_for_power(alpha, cells as f64 - 1.0, 0.99).ok()?;
                Some(needed / filled(axes, mass * cells as f64))
            })
            .min_by(f64::total_cmp)?;
        let by_cells = (best * (1.0 - mass) / (samples as f64 * mass)).sqrt();
        let windows = scales.last().is_some_and(|&cells| cells >= scan::PIECES as usize);
        let by_windows = if windows {
            scan::detectable(mass, samples as f64, alpha / scan::tests())
        } else {
            f64::INFINITY
        };
        Some(Power { mass, error: by_cells.min(by_windows) })
    };
    SHARES.into_iter().filter_map(at).collect()
}

/// The probability with which a relative error over a `mass` in one piece is caught by the scale that sees it best, or by the scan; `None` where nothing
/// was counted.
pub(super) fn probability(
    axes: usize,
    scales: &[usize],
    samples: u64,
    alpha: f64,
    mass: f64,
    error: f64,
) -> Option<f64> {
    let lambda = samples as f64 * error * error * mass / (1.0 - mass);
    let by_cells = scales.iter().filter(|&&cells| cells > 1).filter_map(|&cells| {
        let df = cells as f64 - 1.0;
        let seen = lambda * filled(axes, mass * cells as f64);
        tail::noncentral_sf(tail::isf(alpha, df).ok()?, df, seen).ok()
    });
    let best = by_cells.max_by(f64::total_cmp)?;
    if scales.last().is_none_or(|&cells| cells < scan::PIECES as usize) {
        return Some(best);
    }
    let level = alpha / scan::tests();
    let sees = scan::detectable(mass, samples as f64, level);
    let critical = normal::isf((0.5 * level).max(1e-300)).ok()?;
    let by_windows = normal::sf(critical - (critical + 2.33) * error / sees);
    Some(best.max(by_windows))
}

/// The share of the noncentrality that the borders of a region of `cells` cells leave.
fn filled(axes: usize, cells: f64) -> f64 {
    match axes {
        // Entries have no borders, but a cell may hold many of them.
        0 => cells.min(1.0),
        _ if cells <= 1.0 => 0.5_f64.powi(axes as i32) * cells,
        _ => {
            let side = cells.powf(1.0 / axes as f64);
            ((side - 0.5) / side).powi(axes as i32)
        }
    }
}
