//! Numbers in, a figure out: the statistics that judge samples.
//!
//! Nothing here knows what a sample is; every file is one idea, begins with its formula and source, and states the
//! accuracy that `tests/it/statistics.rs` measures against tables of many digits in `data/oracle`. Bad input is an [`Error`]
//! that names it, never a panic. Tails keep their relative accuracy down to the smallest `f64`, because a p-value of
//! 1e-200 that is adjusted for a thousand tests must still be the right number.
//!
//! | question | file |
//! | --- | --- |
//! | do counts fit expected counts, or other counts? what would the test have caught? | [`chi_square`] |
//! | do counts fit, looked at as often as one likes? | [`e_process`] |
//! | is a count of hits right, exactly? | [`binomial`], [`poisson`] |
//! | are values uniform, known one by one or in groups? do two samples agree? | [`kolmogorov`], [`anderson_darling`] |
//! | do two means agree? | [`welch`] |
//! | how much is a p-value worth among many? | [`multiplicity`] |
//! | is a mean what it should be, and is the sample fit to tell? | [`Moments::mean_test`] |
//! | how to add without losing bits | [`CompensatedSum`], [`Moments`] |
//! | the distributions below these | [`normal`], [`student_t`], [`gamma`], [`beta`] |

pub mod anderson_darling;
pub mod beta;
pub mod binomial;
pub mod chi_square;
pub mod e_process;
mod error;
pub mod gamma;
mod grouped;
pub mod kolmogorov;
mod moments;
pub mod multiplicity;
mod noncentral_chi_square;
pub mod normal;
pub mod poisson;
mod root;
mod saddle;
pub mod student_t;
mod sum;
pub mod welch;

pub use error::Error;
pub use moments::{MeanTest, Moments, Trust};
pub use sum::CompensatedSum;
