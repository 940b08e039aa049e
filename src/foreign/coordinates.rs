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

    /// What is no index (negative, a fraction, NaN) becomes the largest one, which no set has.
    fn point_of(&self, numbers: &[f64]) -> usize {
        let index = numbers[0];
        if index >= 0.0 && index.fract() == 0.0 { index as usize } else { usize::MAX }
    }

    fn numbers_of(&self, point: &usize, out: &mut Vec<f64>) {
        out.push(*point as f64);
    }
}
