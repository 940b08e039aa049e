//! Sine and cosine of an angle in turns, and the angle back to within 1e-5, by polynomials without branches: what a loop over a buffer is vectorised
//! from.
//!
//! With the turn t = (q + r) / 4, q the nearest integer to 4 t, r in [-1/2, 1/2] without rounding: sin (pi r / 2) = r P(r^2), cos (pi r / 2) = Q(r^2),
//! exchanged and negated by the last two bits of q. P and Q are minimax polynomials of degree 3 and 4 (Remez' algorithm in 40 digits), of
//! error 3.3e-9 (relative to the sine) and 4.8e-11.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// sin and cos of 2 pi `turn`, for turns in `[-1e6, 1e6]`: off by at most 4e-9, the sine near 0 by as much relative to itself.
#[inline(always)]
pub(crate) fn sin_cos(turn: f64) -> (f64, f64) {
    // Adding 1.5 2^52 rounds to an integer and leaves it in the lower bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let quarters = 4.0 * turn;
    let rounded = quarters + ROUND;
    let r = quarters - (rounded - ROUND);
    let y = r * r;
    let sin = r
        * (1.570_796_321_708_342_2
            + y * (-0.645_963_460_233_250_9
                + y * (0.079_680_032_769_168_41 + y * -0.004_601_657_888_985_372)));
    let cos = 0.999_999_999_952_600_5
        + y * (-1.233_700_540_647_37
            + y * (0.253_669_203_939_251_8
                + y * (-0.020_860_071_318_689_263 + y * 0.000_903_631_703_146_245_3)));
    let q = rounded.to_bits();
    let swap = (sin.to_bits() ^ cos.to_bits()) & 0_u64.wrapping_sub(q & 1);
    (
        f64::from_bits(sin.to_bits() ^ swap ^ ((q & 2) << 62)),
        f64::from_bits(cos.to_bits() ^ swap ^ ((q.wrapping_add(1) & 2) << 62)),
    )
}

/// How far [`abouts`] are off at most, in turns: 1e-5 radians and a few roundings.
pub(crate) const ERROR: f64 = 2e-6;

macro_rules! abouts {
    ($name:ident, $float:ident, $of:literal) => {
        /// The turn of each vector (x, y) in `[0, 1]` to within [`ERROR`]; under 1/2 (both included) for y >= 0, over it for y < 0.
        /// atan of a ratio up to 1 by Abramowitz and Stegun, 4.4.49.
        #[doc = $of]
        #[inline(always)]
        pub(crate) fn $name<const N: usize>(y: &[$float; N], x: &[$float; N]) -> [$float; N] {
            // Where directions fall is not to be predicted: signs are copied, and `max` need not care for NaN.
            let larger = |a: $float, b: $float| if a > b { a } else { b };
            let smaller = |a: $float, b: $float| if a < b { a } else { b };
            // Step by step for all: one of them after the other would wait for each product.
            let mut turns = [0.0; N];
            for i in 0..N {
                let (long, short) = (larger(x[i].abs(), y[i].abs()), smaller(x[i].abs(), y[i].abs()));
                turns[i] = short / larger(long, $float::MIN_POSITIVE);
            }
            for a in &mut turns {
                let b = *a * *a;
                let atan = *a
                    * (0.999_866 + b * (-0.330_299_5 + b * (0.180_141 + b * (-0.085_133 + b * 0.020_835_1))));
                *a = atan * (0.5 * std::$float::consts::FRAC_1_PI);
            }
            for i in 0..N {
                let quarter = 0.125 - (0.125 - turns[i]).copysign(x[i].abs() - y[i].abs());
                let half = 0.25 - (0.25 - quarter).copysign(x[i]);
                // -0 is no less than 0.
                turns[i] = 0.5 - (0.5 - half).copysign(y[i] + 0.0);
            }
            turns
        }
    };
}
abouts!(abouts, f64, "");
abouts!(
    abouts_f32,
    f32,
    "Twice as many fit into a vector register as of `f64`; vectors of 1e-38 and below have no turn."
);

/// The turn of one vector, as [`abouts`].
#[inline(always)]
pub(crate) fn about(y: f64, x: f64) -> f64 {
    abouts(&[y], &[x])[0]
}

/// The angle of each vector (x, y) in `[0, 2 pi]`, to within 9e-16 (of itself below 1), as `atan2` has it but for negative ones, which are a turn further
/// on; where that rounds to a whole turn, a whole turn.
///
/// atan t = t + t^3 P(t^2) for |t| <= tan(pi / 8), P a minimax polynomial of degree 9 (Remez' algorithm in 50 digits; 3.5e-17 of atan), and
/// atan (a / b) = pi / 4 + atan ((a - b) / (a + b)) beyond that.
#[inline(always)]
pub(crate) fn angles<const N: usize>(y: &[f64; N], x: &[f64; N]) -> [f64; N] {
    const P: [f64; 10] = [
        -0.333_333_333_333_302_2,
        0.199_999_999_991_046_83,
        -0.142_857_141_965_251_11,
        0.111_111_067_034_552_2,
        -0.090_907_835_261_663_03,
        0.076_900_833_239_438_1,
        -0.066_412_460_298_377_43,
        0.056_931_639_474_783_53,
        -0.043_608_237_136_266_22,
        0.021_280_130_607_041_378,
    ];
    const TAN_EIGHTH: f64 = std::f64::consts::SQRT_2 - 1.0;
    let long_and_short = |i: usize| {
        let (across, up) = (x[i].abs(), y[i].abs());
        if across > up { (across, up) } else { (up, across) }
    };
    let is_steep = |(long, short): (f64, f64)| short > TAN_EIGHTH * long;
    // Step by step for all: one of them after the other would wait for each product.
    let (mut t, mut square, mut p, mut angles) = ([0.0; N], [0.0; N], [P[9]; N], [0.0; N]);
    for i in 0..N {
        let (long, short) = long_and_short(i);
        let steep = is_steep((long, short));
        let above = if steep { short - long } else { short };
        let below = if steep { short + long } else { long };
        t[i] = above / if below > 0.0 { below } else { 1.0 };
        square[i] = t[i] * t[i];
    }
    for k in (0..9).rev() {
        for i in 0..N {
            p[i] = P[k] + square[i] * p[i];
        }
    }
    for i in 0..N {
        let atan = t[i] + t[i] * (square[i] * p[i]);
        // With what pi / 4 loses to rounding.
        let eighth =
            if is_steep(long_and_short(i)) { FRAC_PI_4 + (atan + 3.061_616_997_868_383e-17) } else { atan };
        let quarter = if y[i].abs() > x[i].abs() { FRAC_PI_2 - eighth } else { eighth };
        // -0 as the standard library has it.
        let half = if x[i].is_sign_negative() { PI - quarter } else { quarter };
        angles[i] = if y[i] < 0.0 { TAU - half } else { half };
    }
    angles
}

#[cfg(test)]
mod tests {
    use super::*;

    const OF_SINES: f64 = 4e-9;

    #[test]
    fn errors_are_what_is_stated() {
        let (mut worst, mut worst_sine, mut worst_turn) = (0.0_f64, 0.0_f64, 0.0_f64);
        for i in 0..400_003 {
            let turn = f64::from(i) / 400_003.0;
            let ((sin, cos), (s, c)) = (sin_cos(turn), (TAU * turn).sin_cos());
            worst = worst.max((sin - s).abs()).max((cos - c).abs());
            worst_turn = worst_turn.max((about(s, c) - turn).abs());
            worst_turn = worst_turn.max((f64::from(abouts_f32(&[s as f32], &[c as f32])[0]) - turn).abs());
            let small = turn * 1e-3;
            worst_sine = worst_sine.max((sin_cos(small).0 / (TAU * small).sin() - 1.0).abs().min(1.0));
        }
        println!("{worst:e} {worst_sine:e} {worst_turn:e}");
        // Not only below what is stated, but near it: the bound is no guess.
        assert!(worst < OF_SINES && worst > 0.5 * OF_SINES, "{worst:e}");
        assert!(worst_sine < OF_SINES || worst_sine == 1.0, "{worst_sine:e}");
        assert!(worst_turn < ERROR && worst_turn > 0.5 * ERROR, "{worst_turn:e}");
        assert_eq!(sin_cos(0.0).0, 0.0);
        assert!(sin_cos(0.5).0.abs() < 1e-16 && sin_cos(0.5).1 < -0.999_999_999);
    }

    #[test]
    fn angles_are_those_of_the_standard_library() {
        let mut worst = 0.0_f64;
        for i in 0..400_003 {
            let (angle, length) = (TAU * f64::from(i) / 400_003.0, 2.0_f64.powi(i % 80 - 40));
            let (y, x) = (length * angle.sin(), length * angle.cos());
            let right = y.atan2(x).rem_euclid(TAU);
            let found = angles(&[y, 0.0], &[x, 1.0])[0];
            worst = worst.max((found - right).abs() / right.clamp(1e-300, 1.0));
        }
        println!("{worst:e}");
        assert!(worst < 9e-16, "{worst:e}"); // one unit in the last place of 2 pi
        let signs = [-1.0, -1e-300, -0.0, 0.0, 1e-300, 1.0];
        for (y, x) in signs.into_iter().flat_map(|y| signs.map(|x| (y, x))) {
            let phi = f64::atan2(y, x);
            let right = if phi < 0.0 { phi + TAU } else { phi.abs() };
            let found = angles(&[y], &[x])[0];
            assert!((found - right).abs() < 9e-16, "{y} {x} {found} {right}");
        }
    }

    #[test]
    fn halves_are_never_mistaken() {
        for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (-1.0, 1e-300), (1.0, 1e-300), (0.0, 0.0)] {
            assert!((0.0..=0.5).contains(&about(y, x)), "{x} {y}");
            assert!((0.5..=1.0).contains(&about(-1e-300_f64.max(y), x)), "{x} {y}");
        }
    }
}
