//! Solid angles and irradiance in closed form.

use glam::DVec3;

/// The solid angle of a triangle seen from the origin, by tan(Omega / 2) = a . (b x c) / (abc + (a . b) c + (b . c) a + (c . a) b) (Van Oosterom and
/// Strackee 1983). Positive, whichever side is seen.
///
/// ```
/// use glam::DVec3;
/// let octant = warpcheck::oracle::solid_angle_of_triangle([DVec3::X, DVec3::Y, DVec3::Z]);
/// assert!((octant - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
/// ```
pub fn solid_angle_of_triangle([a, b, c]: [DVec3; 3]) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let numerator = a.dot(b.cross(c)).abs();
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * numerator.atan2(denominator)
}

/// The irradiance at the origin, on a surface with this unit normal, from a convex polygon of radiance 1 that faces it: Lambert's
/// E = 1/2 sum Theta_i (Gamma_i . n) over the edges of the polygon, cut off at the horizon (Arvo 1995, eq. 3.1 to 3.3).
pub fn irradiance_of_polygon(vertices: &[DVec3], normal: DVec3) -> f64 {
    let above = clip(vertices, normal);
    let edges = (0..above.len()).map(|i| (above[i], above[(i + 1) % above.len()]));
    let sum: f64 = edges
        .map(|(a, b)| {
            let cross = a.cross(b);
            let theta = cross.length().atan2(a.dot(b));
            theta * cross.normalize_or_zero().dot(normal)
        })
        .sum();
    0.5 * sum.abs()
}

/// Sutherland and Hodgman 1974, for one plane.
fn clip(vertices: &[DVec3], normal: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (i, &a) in vertices.iter().enumerate() {
        let b = vertices[(i + 1) % vertices.len()];
        let (da, db) = (a.dot(normal), b.dot(normal));
        if da >= 0.0 {
            kept.push(a);
        }
        if (da < 0.0) != (db < 0.0) {
            kept.push(a + (b - a) * (da / (da - db)));
        }
    }
    kept
}
