//! Points as rows of numbers, which is what files and pipes carry.

use super::Frame;
use crate::domain::{Discrete, Disk, Domain, Hemisphere, Interval, Sphere, Square, Triangle};
use glam::{DVec2, DVec3};

/// A domain whose points are rows of numbers: two for the square and the disk, three for directions and for barycentric coordinates, one for numbers and
/// indices.
///
/// ```
/// use warpcheck::{domain::Square, foreign::Coordinates};
/// assert_eq!((Square.names(), Square.point_of(&[0.25, 0.5])), (["x", "y"].as_slice(), glam::DVec2::new(0.25, 0.5)));
/// ```
pub trait Coordinates: Domain {
    /// What the numbers of a point are called; as many as there are.
    fn names(&self) -> &'static [&'static str];

    /// The point with these numbers, in the domain or not.
    fn point_of(&self, numbers: &[f64]) -> Self::Point;

    /// Appends the numbers of a point.
    fn numbers_of(&self, point: &Self::Point, out: &mut Vec<f64>);

    /// A point of a foreign frame in ours. Only directions have a frame.
    fn to_ours(&self, point: Self::Point, _frame: Frame) -> Self::Point {
        point
    }

    /// A point of ours in a foreign frame.
    fn to_theirs(&self, point: &Self::Point, _frame: Frame) -> Self::Point {
        point.clone()
    }

    /// Whether points have a frame.
    fn has_frame(&self) -> bool {
        false
    }
}

macro_rules! flat {
    ($($domain:ty),+) => {$(
impl Coordinates for $domain {
    fn names(&self) -> &'static [&'static str] {
        &["x", "y"]
    }

    #[inline(always)]
    fn point_of(&self, numbers: &[f64]) -> DVec2 {
        DVec2::from_slice(numbers)
    }

    fn numbers_of(&self, point: &DVec2, out: &mut Vec<f64>) {
        out.extend(point.to_array());
    }
}
    )+};
}
flat!(Square, Disk);

macro_rules! directions {
    ($($domain:ty),+) => {$(
impl Coordinates for $domain {
    fn names(&self) -> &'static [&'static str] {
        &["x", "y", "z"]
    }

    #[inline(always)]
    fn point_of(&self, numbers: &[f64]) -> DVec3 {
        DVec3::from_slice(numbers)
    }

    fn numbers_of(&self, point: &DVec3, out: &mut Vec<f64>) {
        out.extend(point.to_array());
    }

    fn to_ours(&self, point: DVec3, frame: Frame) -> DVec3 {
        frame.to_ours(point)
    }

    fn to_theirs(&self, point: &DVec3, frame: Frame) -> DVec3 {
        frame.to_theirs(*point)
    }

    fn has_frame(&self) -> bool {
        true
    }
}
    )+};
}
directions!(Hemisphere, Sphere);

impl Coordinates for Triangle {
    fn names(&self) -> &'static [&'static str] {
        &["b0", "b1", "b2"]
    }

    #[inline(always)]
    fn point_of(&self, numbers: &[f64]) -> DVec3 {
        DVec3::from_slice(numbers)
    }

    fn numbers_of(&self, point: &DVec3, out: &mut Vec<f64>) {
        out.extend(point.to_array());
    }
}

impl Coordinates for Interval {
    fn names(&self) -> &'static [&'static str] {
        &["x"]
    }

    fn point_of(&self, numbers: &[f64]) -> f64 {
        numbers[0]
    }

    fn numbers_of(&self, point: &f64, out: &mut Vec<f64>) {
        out.push(*point);
    }
}

impl Coordinates for Discrete {
    fn names(&self) -> &'static [&'static str] {
        &["i"]
    }

    /// What is no index is one that no set has: a negative number its two's complement, by which it is told again; a fraction, NaN, or what is too large the largest
    /// `isize`.
    fn point_of(&self, numbers: &[f64]) -> usize {
        let index = numbers[0];
        let index = if index.fract() == 0.0 { index as isize } else { isize::MAX };
        index as usize
    }

    fn numbers_of(&self, point: &usize, out: &mut Vec<f64>) {
        out.push(*point as isize as f64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_no_index() {
        let some = Discrete::new(6);
        let told = |x: f64| {
            let (point, mut numbers) = (some.point_of(&[x]), Vec::new());
            some.numbers_of(&point, &mut numbers);
            (some.locate(&point).map_or_else(|why| why.0, |at| at.patch.to_string()), numbers[0])
        };
        assert_eq!([0.0, -0.0, 5.0].map(told), [("0".into(), 0.0), ("0".into(), 0.0), ("5".into(), 5.0)]);
        for x in [-1.0, -7.0, 6.0] {
            assert_eq!(told(x), (format!("is index {x} of 6 entries"), x));
        }
        for x in [0.5, -0.5, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(told(x).0, format!("is index {} of 6 entries", isize::MAX));
        }
        assert_eq!(told(-1e300).0, format!("is index {} of 6 entries", isize::MIN));
    }
}
