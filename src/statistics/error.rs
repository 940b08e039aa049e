/// Why a statistic could not be computed: always a fault of the input, which the message names.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scalar argument is outside the range for which the figure is defined.
    #[error("{name} is {value}, but must be {required}")]
    Argument {
        /// Name of the argument.
        name: &'static str,
        /// The value that was given.
        value: f64,
        /// What would have been accepted.
        required: &'static str,
    },
    /// One element of a slice is outside its range.
    #[error("{name}[{index}] is {value}, but must be {required}")]
    Element {
        /// Name of the slice.
        name: &'static str,
        /// Position of the offending element.
        index: usize,
        /// The value found there.
        value: f64,
        /// What would have been accepted.
        required: &'static str,
    },
    /// Two slices that are read side by side differ in length.
    #[error("{left} has {left_len} elements, but {right} has {right_len}")]
    Length {
        /// Name of the first slice.
        left: &'static str,
        /// Its length.
        left_len: usize,
        /// Name of the second slice.
        right: &'static str,
        /// Its length.
        right_len: usize,
    },
    /// Fewer elements than the figure needs.
    #[error("{name} has {len} elements, but at least {min} are needed")]
    TooFew {
        /// Name of the slice, or of the count.
        name: &'static str,
        /// How many there are.
        len: u64,
        /// How many are needed.
        min: u64,
    },
    /// Observed and expected counts have different totals, so that they are not counts of one experiment.
    #[error("observed counts add up to {observed}, expected counts to {expected}")]
    Total {
        /// Sum of the observed counts.
        observed: f64,
        /// Sum of the expected counts.
        expected: f64,
    },
}

/// `Ok(value)` if `ok`, otherwise an [`Error::Argument`] that names it.
pub(super) fn require(
    ok: bool,
    name: &'static str,
    value: f64,
    required: &'static str,
) -> Result<f64, Error> {
    if ok { Ok(value) } else { Err(Error::Argument { name, value, required }) }
}

/// A probability, ends included.
pub(super) fn probability(name: &'static str, value: f64) -> Result<f64, Error> {
    require((0.0..=1.0).contains(&value), name, value, "a probability in [0, 1]")
}

/// A probability, ends excluded.
pub(super) fn inner_probability(name: &'static str, value: f64) -> Result<f64, Error> {
    require(value > 0.0 && value < 1.0, name, value, "a probability in (0, 1)")
}
