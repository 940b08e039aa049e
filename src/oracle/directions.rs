//! Densities of directions, per solid angle, from angles (`atan2` of sine and cosine) where the samplers use chords.

use glam::DVec3;
use std::f64::consts::PI;

/// The angle between two vectors, right to the last digits at any size (Kahan, "How Futile are Mindless Assessments of Roundoff", 2006).
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

/// cos alpha - 1 without cancellation.
fn cosine_less_one(alpha: f64) -> f64 {
    -2.0 * (0.5 * alpha).sin().powi(2)
}

/// Cosine-weighted hemisphere about +Z: cos theta / pi.
pub fn cosine(w: DVec3) -> f64 {
    (angle(w, DVec3::Z).cos() / PI).max(0.0)
}

/// Phong lobe about `mirror`: (n + 1) / 2 pi cos^n alpha for alpha < pi/2 and w above the horizon, else 0.
///
/// ```
/// use glam::DVec3;
/// let top = warpcheck::oracle::phong(DVec3::Z, 1.0, DVec3::Z);
/// assert!((top - 1.0 / std::f64::consts::PI).abs() < 1e-15);
/// ```
pub fn phong(mirror: DVec3, exponent: f64, w: DVec3) -> f64 {
    let alpha = angle(mirror, w);
    if w.z <= 0.0 || alpha >= 0.5 * PI {
        return 0.0;
    }
    (exponent + 1.0) / (2.0 * PI) * (exponent * cosine_less_one(alpha).ln_1p()).exp()
}

/// The share of a Phong lobe under the horizon, its mirror direction `elevation` radians (at least 0) above it: at the angle alpha from it, the
/// arc cos phi < -tan(elevation) / tan(alpha) of the circle is; midpoint rule in cos^(n + 1) alpha, which is uniform.
///
/// ```
/// let half = warpcheck::oracle::phong_under_horizon(0.0, 50.0);
/// assert!((half - 0.5).abs() < 1e-12);
/// ```
pub fn phong_under_horizon(elevation: f64, exponent: f64) -> f64 {
    const STEPS: u32 = 100_000;
    let arc = |i: u32| {
        let ln_cosine = ((f64::from(i) + 0.5) / f64::from(STEPS)).ln() / (exponent + 1.0);
        let sine = (-(2.0 * ln_cosine).exp_m1()).sqrt();
        let ratio = elevation.tan() * ln_cosine.exp() / sine;
        if ratio < 1.0 { ratio.acos() / PI } else { 0.0 }
    };
    (0..STEPS).map(arc).sum::<f64>() / f64::from(STEPS)
}

/// von Mises-Fisher: kappa e^(kappa cos alpha) / (4 pi sinh kappa), in logarithms (Fisher 1953).
pub fn von_mises_fisher(mean: DVec3, kappa: f64, w: DVec3) -> f64 {
    // sinh k = e^k (1 - e^-2k) / 2
    let log_sinh_less_kappa = (-(-2.0 * kappa).exp()).ln_1p() - 2.0_f64.ln();
    (kappa.ln() - (4.0 * PI).ln() - log_sinh_less_kappa + kappa * cosine_less_one(angle(mean, w))).exp()
}

/// Directions w that GGX visible normals of roughness `alpha` reflect `outgoing` into: G1(w_o) D(m) / (4 cos theta_o), with
/// D(m) = 1 / (pi a^2 cos^4 theta (1 + tan^2 theta / a^2)^2) and G1 = 1 / (1 + Lambda), Lambda = (sqrt(1 + a^2 tan^2 theta_o) - 1) / 2
/// (Walter et al. 2007, eq. 33; Heitz 2014, eq. 72). 0 under the horizon.
pub fn ggx_reflected(outgoing: DVec3, alpha: f64, w: DVec3) -> f64 {
    if w.z <= 0.0 {
        return 0.0;
    }
    let tangent = |v: DVec3| angle(v, DVec3::Z).tan();
    let m = outgoing + w;
    let theta = angle(m, DVec3::Z);
    let d = 1.0 / (PI * alpha.powi(2) * theta.cos().powi(4) * (1.0 + (theta.tan() / alpha).powi(2)).powi(2));
    let lambda = 0.5 * ((1.0 + (alpha * tangent(outgoing)).powi(2)).sqrt() - 1.0);
    d / (1.0 + lambda) / (4.0 * angle(outgoing, DVec3::Z).cos())
}
