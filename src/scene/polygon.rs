//! Cutting a polygon into a fan of triangles.

use glam::DVec3;

/// The corner from which a fan of triangles covers the polygon without folding over; `None` if there is none.
///
/// The fan from corner a is good if none of its triangles turns against the polygon as a whole, whose orientation is
/// that of Newell's normal (Sutherland, Sproull and Schumacker 1974), the sum of the cross products along the border.
/// Any corner of a convex polygon will do; a quadrilateral with a dent has to be cut from the dent. Corners in a line
/// and repeated corners give triangles of no area, which do no harm.
///
/// The number of corners looked at is bounded, so that a polygon of a million corners costs no more than reading it.
pub(super) fn fan_apex(corners: usize, at: impl Fn(usize) -> DVec3) -> Option<usize> {
    if corners < 4 {
        return Some(0);
    }
    let origin = at(0);
    let turn = |apex: usize, i: usize| {
        let [a, b, c] = [0, i, i + 1].map(|k| at((apex + k) % corners) - origin);
        (b - a).cross(c - a)
    };
    let newell: DVec3 = (1..corners - 1).map(|i| turn(0, i)).sum();
    let tolerance = -1e-9 * newell.length_squared();
    let tried = corners.min(1.max(10_000_000 / corners));
    (0..tried).find(|&apex| (1..corners - 1).all(|i| turn(apex, i).dot(newell) >= tolerance))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apex(points: &[[f64; 2]]) -> Option<usize> {
        fan_apex(points.len(), |i| DVec3::new(points[i][0], points[i][1], 3.0))
    }

    #[test]
    fn convex_polygons_are_cut_from_the_first_corner() {
        assert_eq!(apex(&[[0., 0.], [1., 0.], [1., 1.], [0., 1.]]), Some(0));
        assert_eq!(apex(&[[0., 0.], [1., 0.], [2., 0.], [2., 1.], [0., 1.]]), Some(0));
        assert_eq!(apex(&[[0., 0.]; 5]), Some(0));
    }

    #[test]
    fn a_dent_is_cut_from_the_dent() {
        assert_eq!(apex(&[[0., 0.], [4., 0.], [1., 1.], [0., 4.]]), Some(0));
        assert_eq!(apex(&[[4., 0.], [1., 1.], [0., 4.], [0., 0.]]), Some(1));
    }

    #[test]
    fn what_no_fan_covers_is_refused() {
        let star: Vec<_> = (0..10)
            .map(|i| (i as f64 * 0.628_318_53, if i % 2 == 0 { 1.0 } else { 0.2 }))
            .map(|(a, r)| [r * f64::cos(a), r * f64::sin(a)])
            .collect();
        assert_eq!(apex(&star), None);
    }
}
