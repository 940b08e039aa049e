//! Probabilities of the Poisson and binomial families at one point, for real arguments, without cancellation.
//!
//! Loader, "Fast and accurate computation of binomial probabilities" (2000): with Stirling's error
//! d(x) = ln Gamma(x + 1) - [ln(2 pi x)/2 + x ln x - x] and the deviance D(x; m) = x ln(x/m) + m - x,
//! - m^x e^-m / Gamma(x + 1) = exp(-d(x) - D(x; m)) / sqrt(2 pi x)                                    (eq. 4)
//! - C(n, a) x^a y^b = sqrt(n / (2 pi a b)) exp(d(n) - d(a) - d(b) - D(a; n x) - D(b; n y)), n = a + b  (eq. 2)
//!
//! All exponents are small where the probability is large: a naive ln Gamma would lose 10 digits at n = 1e10.

use std::f64::consts::TAU;

/// Error of Stirling's formula for ln Gamma(x + 1), x > 0; absolute error below 5e-15.
pub(super) fn stirling_error(mut x: f64) -> f64 {
    let mut shifted = 0.0;
    while x < 16.0 {
        shifted += (x + 0.5) * (1.0 / x).ln_1p() - 1.0;
        x += 1.0;
    }
    let r = 1.0 / (x * x);
    let series = 1.0 / 12.0
        - r * (1.0 / 360.0
            - r * (1.0 / 1260.0 - r * (1.0 / 1680.0 - r * (1.0 / 1188.0 - r * 691.0 / 360360.0))));
    shifted + series / x
}

/// Deviance x ln(x/m) + m - x, given the difference `d` = x - m as exactly as the caller knows it.
pub(super) fn deviance(x: f64, m: f64, d: f64) -> f64 {
    if x == 0.0 {
        return m;
    }
    if d.abs() >= 0.1 * (x + m) {
        let ratio = x / m;
        // Where the quotient leaves the range, the difference of logarithms has the digits.
        let ln = if ratio.is_normal() { ratio.ln() } else { x.ln() - m.ln() };
        return x * ln - d;
    }
    let v = d / (x + m);
    let (mut sum, mut power) = (d * v, 2.0 * x * v);
    // |v| < 0.1: each term is a hundredth of the one before.
    for j in 1..12 {
        power *= v * v;
        sum += power / f64::from(2 * j + 1);
    }
    sum
}

/// ln[x^a e^-x / Gamma(a + 1)]: the logarithm of the Poisson probability of `a` at mean `x`, a and x real.
pub(super) fn ln_poisson(a: f64, x: f64) -> f64 {
    if a == 0.0 { -x } else { -stirling_error(a) - deviance(a, x, a - x) - 0.5 * (TAU * a).ln() }
}

/// a - (a + b) x, rounded once; `x` and `y` = 1 - x, of which the smaller is taken at its word.
pub(super) fn offset(a: f64, b: f64, x: f64, y: f64) -> f64 {
    if x <= y { (a + b).mul_add(-x, a) } else { (a + b).mul_add(y, -b) }
}

/// ln[Gamma(a + b + 1) / (Gamma(a + 1) Gamma(b + 1)) x^a y^b]: the binomial probability of `a` hits and `b` misses.
pub(super) fn ln_binomial(a: f64, b: f64, x: f64, y: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        let (count, ln) = if a == 0.0 { (b, ln_complement(x, y)) } else { (a, ln_complement(y, x)) };
        return if count == 0.0 { 0.0 } else { count * ln };
    }
    let n = a + b;
    let d = offset(a, b, x, y);
    stirling_error(n) - stirling_error(a) - stirling_error(b) - deviance(a, n * x, d) - deviance(b, n * y, -d)
        + 0.5 * (n / a / b / TAU).ln()
}

/// ln(y) for y = 1 - x, through the smaller of the two.
fn ln_complement(x: f64, y: f64) -> f64 {
    if x < y { (-x).ln_1p() } else { y.ln() }
}

/// ln[Gamma(a + n) / (Gamma(a) a^n)] = sum over j < n of ln(1 + j/a), for a > 0 and n = 0, 1, 2, ...
///
/// Relative error below 1e-13 wherever the value is above 1, absolute error below 1e-13 elsewhere.
pub(super) fn ln_rising(a: f64, n: f64) -> f64 {
    if n <= 1.0 {
        return 0.0;
    }
    if a < 1.0 {
        // One step up takes the pole of Gamma at 0 out: the first factor is 1, all others are (a + j)/a.
        return ln_rising(a + 1.0, n - 1.0) + (n - 1.0) * (a.ln_1p() - a.ln());
    }
    deviance(a + n, a, n) - 0.5 * (n / a).ln_1p() + (stirling_error(a + n) - stirling_error(a))
}

/// Nodes and weights of the 16-point Gauss-Legendre rule on [-1, 1], positive half.
pub(super) const GAUSS: [(f64, f64); 8] = [
    (0.09501250983763744, 0.1894506104550685),
    (0.2816035507792589, 0.18260341504492358),
    (0.45801677765722737, 0.16915651939500254),
    (0.6178762444026438, 0.14959598881657674),
    (0.755404408355003, 0.12462897125553388),
    (0.8656312023878318, 0.09515851168249279),
    (0.9445750230732326, 0.062253523938647894),
    (0.9894009349916499, 0.027152459411754096),
];

/// Integral over t from 0 to `end` of exp(ln_f(t)), for the tail of a log-concave density that starts near
/// exp(0) = 1 and falls off within a few times `scale`: Gauss-Legendre panels of two scales each, until one adds
/// nothing.
pub(super) fn tail_integral(scale: f64, end: f64, ln_f: impl Fn(f64) -> f64) -> f64 {
    let (mut total, mut start) = (0.0, 0.0);
    // Some twenty panels do; the bound is for densities so narrow that a step from `start` is lost in rounding.
    for _ in 0..1000 {
        let half = scale.min(0.5 * (end - start));
        let middle = start + half;
        let panel: f64 = GAUSS
            .iter()
            .map(|(x, w)| w * (ln_f(middle - half * x).exp() + ln_f(middle + half * x).exp()))
            .sum();
        total += half * panel;
        start += 2.0 * half;
        if half * panel < 1e-17 * total || start >= end {
            break;
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::ln_rising;

    #[test]
    fn ln_rising_matches_the_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/oracle/ln_rising.csv");
        let text = std::fs::read_to_string(path).unwrap();
        let mut worst = (0.0, "");
        for line in text.lines().skip(1) {
            let row: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            let error = (ln_rising(row[0], row[1]) - row[2]).abs() / row[2].max(1.0);
            if !(error <= worst.0) {
                worst = (error, line);
            }
        }
        println!("largest error {:.1e} at {}", worst.0, worst.1);
        assert!(text.lines().count() > 100 && worst.0 < 1e-13, "{worst:?}");
    }
}
