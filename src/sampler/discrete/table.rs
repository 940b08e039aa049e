//! One face for the forms of a table.

use super::{Choice, DiscreteAlias, DiscreteCdf, DiscreteGuide};
use crate::sampler::Error;

/// Which form a table has.
///
/// | form | bytes an entry | memory accesses | order of xi | take it for |
/// |---|---|---|---|---|
/// | `Cdf` | 8 | log2 N, one after the other | kept | a few entries; as the baseline |
/// | `Guide` | 20 to 32 | one, for one variate in ten two | kept | stratified or low-discrepancy variates, or if in doubt |
/// | `Alias` | 16, of which 8 are searched; from 2^17 entries on 20, and 4 | one | lost | independent variates, where speed is all |
///
/// Order is kept where a larger variate never gives a smaller index: then strata of the variate are strata of the table, and neighbouring
/// variates give neighbouring entries. The masses are the same in all forms, to the last bit. One at a time, a sample waits for memory; many at a time
/// ([`Sampler::fill`](crate::sampler::Sampler::fill), [`DiscreteTable::indices`]) wait together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Form {
    /// The fastest form that keeps the order of the variates: a guide, or a plain CDF for a few entries.
    #[default]
    Ordered,
    /// The fastest form, whatever becomes of the order: an alias table, or a plain CDF for a few entries.
    Unordered,
    /// A CDF, searched in halves.
    Cdf,
    /// A CDF with a guide.
    Guide,
    /// An alias table.
    Alias,
}

/// Up to here a binary search is as fast as anything: it takes two steps.
const FEW: usize = 4;

impl Form {
    /// The form for `entries` entries: [`Cdf`](Self::Cdf), [`Guide`](Self::Guide) or [`Alias`](Self::Alias).
    pub fn chosen(self, entries: usize) -> Self {
        match self {
            Self::Ordered | Self::Unordered if entries <= FEW => Self::Cdf,
            Self::Ordered => Self::Guide,
            Self::Unordered => Self::Alias,
            named => named,
        }
    }
}

/// A table to select an index with given probabilities, in any form; [`Form`] says what sets them apart.
///
/// An entry of weight 0 is never returned; one of positive weight, however small, can be: it has a mass of 2^-53 at least.
///
/// ```
/// use warpcheck::sampler::{DiscreteTable, Form};
/// let weights: Vec<f64> = (0..1000).map(f64::from).collect();
/// let table = DiscreteTable::new(&weights, Form::Ordered)?;
/// assert_eq!(table.form(), Form::Guide);
/// let same = DiscreteTable::new(&weights, Form::Unordered)?; // faster, but neighbouring variates lead anywhere
/// assert_eq!(same.form(), Form::Alias);
/// assert_eq!(table.mass(700), same.mass(700));
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum DiscreteTable {
    /// A CDF, searched in halves.
    Cdf(DiscreteCdf),
    /// A CDF with a guide.
    Guide(DiscreteGuide),
    /// An alias table.
    Alias(DiscreteAlias),
}

/// What all forms do, done by the one that it is.
macro_rules! dispatch {
    ($self:ident, $table:ident => $what:expr) => {
        match $self {
            Self::Cdf($table) => $what,
            Self::Guide($table) => $what,
            Self::Alias($table) => $what,
        }
    };
}

impl DiscreteTable {
    /// A table for these weights, which need not be normalised.
    ///
    /// # Errors
    /// Without weights, if there are 2^32 or more, if all are 0, or if one is negative, NaN or infinite (named by its index).
    pub fn new(weights: &[f64], form: Form) -> Result<Self, Error> {
        let cdf = DiscreteCdf::new(weights)?;
        Ok(match form.chosen(cdf.len()) {
            Form::Guide => Self::Guide(DiscreteGuide::from_cdf(cdf)),
            Form::Alias => Self::Alias(DiscreteAlias::from_cdf(cdf)),
            _ => Self::Cdf(cdf),
        })
    }

    /// Which form it has: [`Form::Cdf`], [`Form::Guide`] or [`Form::Alias`].
    pub fn form(&self) -> Form {
        match self {
            Self::Cdf(_) => Form::Cdf,
            Self::Guide(_) => Form::Guide,
            Self::Alias(_) => Form::Alias,
        }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        dispatch!(self, table => table.len())
    }

    /// Never true: an empty table cannot be made.
    pub fn is_empty(&self) -> bool {
        dispatch!(self, table => table.is_empty())
    }

    /// The entry for a variate in `[0, 1)`. What lies outside is moved to the nearest end, NaN to 0.
    #[inline]
    pub fn choose(&self, xi: f64) -> Choice {
        dispatch!(self, table => table.choose(xi))
    }

    /// The entries for 64 random bits each: [`choose`](Self::choose) at the variate of their upper 53.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn indices(&self, bits: &[u64], out: &mut [u32]) {
        dispatch!(self, table => table.indices(bits, out))
    }

    /// [`choose`](Self::choose) for many variates.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn choose_all(&self, xi: &[f64], out: &mut [Choice]) {
        dispatch!(self, table => table.choose_all(xi, out))
    }

    /// The probability with which [`choose`](Self::choose) returns an entry; 0 past the end.
    #[inline]
    pub fn mass(&self, index: usize) -> f64 {
        dispatch!(self, table => table.mass(index))
    }

    /// The probability of all entries before `index`.
    pub fn cumulative(&self, index: usize) -> f64 {
        dispatch!(self, table => table.cumulative(index))
    }

    /// A variate at which this entry is chosen with this rest. Of several in an alias table one.
    pub fn variate(&self, index: usize, rest: f64) -> f64 {
        dispatch!(self, table => table.variate(index, rest))
    }

    /// Bytes that the table takes.
    pub fn bytes(&self) -> usize {
        dispatch!(self, table => table.bytes())
    }

    pub(in crate::sampler) fn some_boundaries(&self) -> Vec<f64> {
        dispatch!(self, table => table.some_boundaries())
    }
}
