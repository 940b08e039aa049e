//! E-process: a test of counts against known probabilities that may be looked at after every batch, and stopped or
//! continued at will.
//!
//! With q the probabilities, n_i the counts so far and N their sum, the likelihood ratio of a Dirichlet mixture of
//! concentration k, alpha_i = k q_i (Lindon and Malek, "Anytime-valid inference for multinomial count data", NeurIPS 2022):
//!
//! e_k = Gamma(k) / Gamma(k + N) * prod_i Gamma(k q_i + n_i) / (Gamma(k q_i) q_i^n_i), so that
//! ln e_k = sum_i R(k q_i, n_i) - R(k, N) with R(a, n) = ln[Gamma(a + n) / (Gamma(a) a^n)] = sum_(j < n) ln(1 + j/a).
//!
//! If q is right, e_k is a nonnegative martingale that starts at 1, and so is the mean over several k: the large ones
//! gain from small deviations, the small ones from large. P(sup e >= 1/p) <= p (Ville 1939): min(1, 1/sup e) is a p-value
//! however often one looks. The size of the batches doesn't matter, but only looks count towards the supremum.
//!
//! If q is known up to errors, the denominator prod q_i^n_i gives way to the largest likelihood of any probabilities p
//! within the errors: the ratio is no larger than it is for the true p, and Ville holds again. sup sum n_i ln p_i over
//! l_i <= p_i <= u_i, sum p_i = 1 is bounded for any lambda >= 0 by sum_i max_(p_i) (n_i ln p_i - lambda p_i) + lambda
//! (Lagrange duality); lambda = 0 stands for p_i = u_i, and the best one is found by bisection.

use super::CompensatedSum;
use super::error::Error;
use super::saddle::ln_rising;

/// Concentrations of the mixture. In m cells, k gains most from a deviation d^2 = sum (p_i - q_i)^2 / q_i of about m/k.
const CONCENTRATIONS: [f64; 12] = [1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12];
/// What rounding may have added to the sum of the probabilities, and takes off the borders of what is within the errors.
const ROUNDING: f64 = 1e-12;

/// A running test of counts against probabilities.
///
/// ```
/// use warpcheck::statistics::e_process::EProcess;
/// let mut test = EProcess::new(&[0.25, 0.25, 0.5], &[0.0; 3])?;
/// test.observe(&[27, 24, 49])?;
/// assert_eq!(test.anytime_p(), (1.0, 1.0));
/// test.observe(&[400, 100, 500])?;
/// assert!(test.anytime_p().0 < 1e-30);
/// # Ok::<(), warpcheck::statistics::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct EProcess {
    /// Centre of the mixture: the probabilities, and the error where the probability is 0, divided by their sum.
    centre: Vec<f64>,
    /// Whether any count at all refutes the probabilities as given.
    impossible: Vec<bool>,
    /// ln of what the centre is smaller than the given probabilities, the same for all cells.
    shift: f64,
    /// Smallest and largest probability within the errors; none if all errors are 0.
    bounds: Option<Vec<(f64, f64)>>,
    counts: Vec<u64>,
    ln_e: f64,
    ln_e_conservative: f64,
    largest: (f64, f64),
}

impl EProcess {
    /// A test that has seen no counts. `errors[i]` bounds the absolute error of `probabilities[i]`.
    ///
    /// The probabilities are divided by their sum. A cell may have probability 0: without an error, a count in it makes
    /// e infinite.
    ///
    /// # Errors
    /// Different lengths; no cell; an element that is negative, NaN or infinite; probabilities that don't add up to 1
    /// within the sum of the errors and 1e-12.
    pub fn new(probabilities: &[f64], errors: &[f64]) -> Result<Self, Error> {
        same_length("probabilities", probabilities.len(), "errors", errors.len())?;
        for (name, slice) in [("probabilities", probabilities), ("errors", errors)] {
            if let Some(index) = slice.iter().position(|x| !(*x >= 0.0 && x.is_finite())) {
                let required = "non-negative and finite";
                return Err(Error::Element { name, index, value: slice[index], required });
            }
        }
        let sum = |values: &[f64]| values.iter().copied().collect::<CompensatedSum>().value();
        let (total, slack) = (sum(probabilities), sum(errors));
        if probabilities.is_empty() {
            return Err(Error::TooFew { name: "probabilities", len: 0, min: 1 });
        }
        if !((total - 1.0).abs() <= slack + ROUNDING) || total == 0.0 {
            let required = "1 within the sum of the errors, and positive";
            return Err(Error::Argument { name: "sum of the probabilities", value: total, required });
        }
        let pairs = || probabilities.iter().zip(errors);
        // Where nothing is expected but an error remains, the mixture must be able to follow the counts.
        let weights: Vec<f64> =
            pairs().map(|(&p, &error)| if p > 0.0 { p } else { error.min(1.0) }).collect();
        let weight = sum(&weights);
        let bounds = pairs().map(|(&p, &error)| {
            let q = p / total;
            ((p - error).min(q).max(0.0) * (1.0 - ROUNDING), ((p + error).min(1.0).max(q)) * (1.0 + ROUNDING))
        });
        Ok(Self {
            centre: weights.iter().map(|w| w / weight).collect(),
            impossible: probabilities.iter().map(|&p| p == 0.0).collect(),
            shift: (total / weight).ln(),
            bounds: (slack > 0.0).then(|| bounds.collect()),
            counts: vec![0; probabilities.len()],
            ln_e: 0.0,
            ln_e_conservative: 0.0,
            largest: (0.0, 0.0),
        })
    }

    /// Adds the counts of one more batch, and looks at the result.
    ///
    /// # Errors
    /// A length other than that of the probabilities.
    pub fn observe(&mut self, counts: &[u64]) -> Result<(), Error> {
        same_length("counts", counts.len(), "probabilities", self.counts.len())?;
        for (total, &count) in self.counts.iter_mut().zip(counts) {
            *total = total.saturating_add(count);
        }
        let total = self.counts.iter().map(|&n| n as f64).sum::<f64>();
        let mixture = self.ln_mixture(total);
        let refuted = self.impossible.iter().zip(&self.counts).any(|(&impossible, &n)| impossible && n > 0);
        self.ln_e = if refuted { f64::INFINITY } else { mixture + total * self.shift };
        self.ln_e_conservative = self.ln_e.min(mixture + self.ln_denominators());
        self.largest.0 = self.largest.0.max(self.ln_e);
        self.largest.1 = self.largest.1.max(self.ln_e_conservative);
        Ok(())
    }

    /// ln of the mean e_k against the centre.
    fn ln_mixture(&self, total: f64) -> f64 {
        let of = |k: f64| {
            let cells = self.centre.iter().zip(&self.counts).filter(|(_, n)| **n > 1);
            let sum: CompensatedSum = cells.map(|(&c, &n)| ln_rising(k * c, n as f64)).collect();
            sum.value() - ln_rising(k, total)
        };
        ln_mean_e(&CONCENTRATIONS.map(of))
    }

    /// ln of the centre's likelihood over the largest likelihood within the errors.
    fn ln_denominators(&self) -> f64 {
        let mut certain = self.centre.iter().zip(&self.counts);
        if certain.any(|(&c, &n)| c == 0.0 && n > 0) {
            return f64::INFINITY;
        }
        let Some(bounds) = &self.bounds else { return f64::INFINITY };
        let cells = || self.counts.iter().map(|&n| n as f64).zip(bounds);
        let best = |lambda: f64, n: f64, &(low, high): &(f64, f64)| {
            if n == 0.0 { if lambda > 0.0 { low } else { 0.0 } } else { (n / lambda).clamp(low, high) }
        };
        let excess = |lambda: f64| {
            let sum: CompensatedSum = cells().map(|(n, bound)| best(lambda, n, bound)).collect();
            sum.value() - 1.0
        };
        // n_i >= 1 and p_i <= 1: no lambda in (0, 1) is the best one.
        let (mut low, mut high) = (0.0, 700.0);
        let lambda = if excess(1.0) <= 0.0 {
            0.0
        } else {
            for _ in 0..64 {
                let middle = 0.5 * (low + high);
                if excess(f64::exp(middle)) > 0.0 { low = middle } else { high = middle }
            }
            f64::exp(high)
        };
        let ratio: CompensatedSum = cells()
            .zip(&self.centre)
            .filter(|((n, _), _)| *n > 0.0)
            .map(|((n, bound), &c)| {
                let p = best(lambda, n, bound);
                n * if c > 0.5 * p && c < 2.0 * p { ((c - p) / p).ln_1p() } else { c.ln() - p.ln() }
            })
            .collect();
        let dual = if lambda > 0.0 { lambda * excess(lambda) } else { 0.0 };
        ratio.value() + dual
    }

    /// ln e after all counts so far, with the probabilities as given.
    pub fn ln_e(&self) -> f64 {
        self.ln_e
    }

    /// ln e, valid for any probabilities within the errors; never above [`Self::ln_e`].
    pub fn ln_e_conservative(&self) -> f64 {
        self.ln_e_conservative
    }

    /// The largest [`Self::ln_e`] and [`Self::ln_e_conservative`] of all looks; at least 0, their value before the first.
    pub fn largest(&self) -> (f64, f64) {
        self.largest
    }

    /// The p-values that hold at any number of looks: 1 / sup e, with the probabilities as given, and within the errors.
    pub fn anytime_p(&self) -> (f64, f64) {
        ((-self.largest.0).exp(), (-self.largest.1).exp())
    }
}

fn same_length(
    left: &'static str,
    left_len: usize,
    right: &'static str,
    right_len: usize,
) -> Result<(), Error> {
    if left_len == right_len { Ok(()) } else { Err(Error::Length { left, left_len, right, right_len }) }
}

/// ln of the mean of the e-values of which the logarithms are given: an e-value again, whatever their dependence. 0, no
/// evidence, for an empty slice.
///
/// ```
/// use warpcheck::statistics::e_process::ln_mean_e;
/// assert!((ln_mean_e(&[1000.0, f64::NEG_INFINITY]) - (1000.0 - f64::ln(2.0))).abs() < 1e-12);
/// ```
pub fn ln_mean_e(ln_e: &[f64]) -> f64 {
    if ln_e.is_empty() {
        return 0.0;
    }
    let top = ln_e.iter().fold(f64::NEG_INFINITY, |top, &x| if x > top || x.is_nan() { x } else { top });
    if !top.is_finite() {
        return top;
    }
    let sum: f64 = ln_e.iter().map(|x| (x - top).exp()).sum();
    top + (sum / ln_e.len() as f64).ln()
}
