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

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;
    use std::f64::consts::LN_2;

    /// Where `f` was asked, and the answer.
    fn asked(search: impl Fn(&dyn Fn(f64) -> f64) -> f64, f: fn(f64) -> f64) -> (Vec<f64>, f64) {
        let points = RefCell::new(Vec::new());
        let root = search(&|x| {
            points.borrow_mut().push(x);
            f(x)
        });
        (points.into_inner(), root)
    }

    #[track_caller]
    fn are(found: &(Vec<f64>, f64), points: &[f64], root: f64) {
        assert_eq!(found.0.len(), points.len(), "{found:?}");
        let near = |a: f64, b: f64| (a - b).abs() <= 2e-10 * b.abs().max(1.0);
        assert!(found.0.iter().zip(points).all(|(&a, &b)| near(a, b)) && near(found.1, root), "{found:?}");
    }

    /// Where the published algorithm goes, by a program of its own in Python after the paper's listing: the same root by more steps is no longer it.
    #[test]
    fn steps_of_the_published_algorithm() {
        let bracketed = |a: f64, b: f64| move |f: &dyn Fn(f64) -> f64| find_root(a, b, 1e-8, f);
        let cubic: fn(f64) -> f64 = |x| x.powi(3) - 2.0 * x - 5.0;
        let points =
            [2.0, 3.0, 2.5, 2.08449781367, 2.09472815631, 2.09455116882, 2.09455148154, 2.09455147654];
        are(&asked(bracketed(2.0, 3.0), cubic), &points, 2.0945514815426307);
        let pole: fn(f64) -> f64 = |x| 1.0 - x.powi(-2);
        let points =
            [0.5, 1.51, 1.005, 0.7525, 0.87875, 1.00033958645, 0.999999501073, 1.00000000005, 0.99999999505];
        are(&asked(bracketed(0.5, 1.51), pole), &points, 1.0000000000497262);
        let exponential: fn(f64) -> f64 = |x| x.exp() - 2.0;
        let points = [
            -4.0,
            3.0,
            -0.5,
            1.25,
            0.375,
            0.778682972433,
            0.688542425454,
            0.693191384032,
            0.693147174873,
            LN_2,
        ];
        are(&asked(bracketed(-4.0, 3.0), exponential), &points, LN_2);
        // No interpolation helps where f is flat: halves, 29 of them.
        let flat = asked(bracketed(-1.0, 4.0), |x| x.powi(9));
        assert_eq!((flat.0.len(), &flat.0[2..6]), (31, &[1.5, 0.25, -0.375, -0.0625][..]));
        assert!(flat.1.abs() < 1e-8, "{flat:?}");
    }

    #[test]
    fn steps_outwards_double() {
        let outwards = |start: f64| move |f: &dyn Fn(f64) -> f64| find_root_increasing(start, 0.5, 1e-8, f);
        let up = asked(outwards(1.0), |x| x.powi(3) - 1000.0);
        let steps = [1.0, 1.5, 2.5, 4.5, 8.5, 16.5];
        let inside = [
            8.5,
            16.5,
            12.5,
            9.786627789823191,
            10.012394872387944,
            9.999911310095074,
            10.000000003989117,
            9.999999998989113,
        ];
        are(&up, &[&steps[..], &inside].concat(), 10.0);
        let down = asked(outwards(1.0), |x| x + 100.0);
        let steps = [1.0, 0.5, -0.5, -2.5, -6.5, -14.5, -30.5, -62.5, -126.5];
        are(&down, &[&steps[..], &[-62.5, -126.5, -94.5, -100.0]].concat(), -100.0);
        // None to be found: the last point where there is a number.
        assert_eq!(asked(outwards(1.0), |_| -1.0).1, 1023_f64.exp2());
        assert_eq!(
            asked(outwards(1.0), |x| if x < 3.0 { -1.0 } else { f64::NAN }),
            (vec![1.0, 1.5, 2.5, 4.5], 2.5)
        );
    }
}
