//! What a check is, and the list of all of them.

use super::expectation::Expectation;
use super::finding::Finding;
use super::probe::Probe;
use super::settings::Settings;
use super::tally::Tally;

/// What a check looks at.
pub(super) struct Case<'a> {
    pub probe: &'a dyn Probe,
    pub expectation: &'a Expectation,
    pub tally: &'a Tally,
    pub settings: &'a Settings,
}

/// When a check is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rests {
    /// It needs no counts: made once, also in a run that stops as soon as it knows.
    NoCounts,
    /// On the integral of the density: made again when the quadrature has been doubted.
    Quadrature,
    /// On counts of a number of samples that was fixed before: not for a run that stops when it likes.
    Counts,
    /// On counts and their expected values: made again when the quadrature behind them has been doubted.
    ExpectedCounts,
}

/// What a check can't do without.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Needs {
    /// Samples.
    Samples,
    /// A density for every sample, or a weight whose mean is known.
    Weights,
    /// A density for every point.
    Density,
    /// Both, to compare them.
    TwoDensities,
    /// Samples for variates of its own choice.
    Variates,
}

impl Needs {
    pub fn met_by(self, probe: &dyn Probe) -> bool {
        match self {
            Self::Samples => true,
            Self::Weights => probe.tells_densities() || !probe.known().is_empty(),
            Self::Density => probe.has_density(),
            Self::TwoDensities => probe.returns_density() && probe.has_density(),
            Self::Variates => probe.pilots().is_none(),
        }
    }
}

/// One question that is put to a sampler.
pub(super) trait Check: Sync {
    fn name(&self) -> &'static str;
    /// What it asks, in half a line.
    fn about(&self) -> &'static str;
    fn rests(&self) -> Rests;
    fn needs(&self) -> Needs;
    /// What it found; nothing where the question doesn't apply.
    fn run(&self, case: &Case<'_>) -> Vec<Finding>;
}

/// All checks, in the order in which they are reported.
pub(super) const BATTERY: [&dyn Check; 12] = [
    &super::edges::Edges,
    &super::support::Support,
    &super::agreement::Agreement,
    &super::normalisation::Normalisation,
    &super::jacobian::JacobianIdentity,
    &super::round_trip::RoundTripIdentity,
    &super::goodness::GoodnessOfFit,
    &super::scan::Scan,
    &super::marginals::Marginals,
    &super::weights::Weights,
    &super::independence::Independence,
    &super::repeats::Repeats,
];

/// Name of every check of the battery, and what it asks.
///
/// ```
/// assert!(warpcheck::verify::checks().any(|(name, _)| name == "chi-square"));
/// ```
pub fn checks() -> impl Iterator<Item = (&'static str, &'static str)> {
    BATTERY.iter().map(|check| (check.name(), check.about()))
}
