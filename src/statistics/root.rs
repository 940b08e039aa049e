//! A root of a continuous function inside a bracket, without derivatives.
//!
//! Chandrupatla, "A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function
//! without using derivatives", Advances in Engineering Software 28 (1997): inverse quadratic interpolation
//! where its criterion holds, bisection elsewhere.

/// The root of `f` between `a` and `b`, which must bracket it, to about `tolerance` (absolute) or the last bits.
pub(super) fn find_root(mut a: f64, mut b: f64, tolerance: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut fa, mut fb) = (f(a), f(b));
    let mut t = 0.5;
    for _ in 0..200 {
        let x = a + t * (b - a);
        let fx = f(x);
        let (c, fc);
        if fx.signum() == fa.signum() {
            (c, fc) = (a, fa);
        } else {
            (c, fc) = (b, fb);
            (b, fb) = (a, fa);
        }
        (a, fa) = (x, fx);
        let (best, f_best) = if fa.abs() < fb.abs() { (a, fa) } else { (b, fb) };
        let limit = (2.0 * f64::EPSILON * best.abs() + 0.5 * tolerance) / (b - a).abs();
        if f_best == 0.0 || limit > 0.5 {
            return best;
        }
        let xi = (a - b) / (c - b);
        let phi = (fa - fb) / (fc - fb);
        t = if phi * phi < xi && (1.0 - phi).powi(2) < 1.0 - xi {
            fa / (fb - fa) * (fc / (fb - fc)) + (c - a) / (b - a) * (fa / (fc - fa)) * (fb / (fc - fb))
        } else {
            0.5
        };
        t = if t.is_finite() { t.clamp(limit, 1.0 - limit) } else { 0.5 };
    }
    a
}

/// Steps from `start` outwards, doubling, until `f` (increasing) has changed sign; then finds the root there.
pub(super) fn find_root_increasing(start: f64, step: f64, tolerance: f64, f: impl Fn(f64) -> f64) -> f64 {
    let below = f(start) < 0.0;
    let (mut near, mut stride) = (start, if below { step } else { -step });
    for _ in 0..1100 {
        let far = near + stride;
        let value = f(far);
        if !far.is_finite() || value.is_nan() {
            break;
        }
        if (value < 0.0) != below {
            return find_root(near, far, tolerance, f);
        }
        near = far;
        stride *= 2.0;
    }
    near
}
