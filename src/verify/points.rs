//! Points that somebody else drew.

use crate::domain::{Domain, Location, Outside, Space};
use crate::sampler::ToPoint;

/// Why points can't be judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PointsError {
    /// A point is not in the domain.
    #[error("point {index}, {point}, {why}")]
    Point {
        /// Which point, from 0.
        index: usize,
        /// What it is.
        point: String,
        /// What is wrong with it.
        why: Outside,
    },
    /// A point of a stream is not in the domain.
    #[error("stream {stream}: point {index}, {point}, {why}")]
    PointOfStream {
        /// Which stream, from 0.
        stream: usize,
        /// Which point of it, from 0.
        index: usize,
        /// What it is.
        point: String,
        /// What is wrong with it.
        why: Outside,
    },
    /// No streams.
    #[error("there are no streams to look at")]
    NoStreams,
    /// A stream without points.
    #[error("stream {stream} has no points")]
    EmptyStream {
        /// Which stream, from 0.
        stream: usize,
    },
}

/// Points on a domain, drawn elsewhere: read from a file, traced by a renderer. For [`compare_samples`](super::compare_samples).
///
/// ```
/// use warpcheck::{domain::Square, verify::Samples};
/// let read = Samples::new(Square, [[0.1, 0.2], [0.3, 0.4], [1.5, 0.6]]);
/// assert_eq!(read.unwrap_err().to_string(), "point 2, (1.500, 0.600), is [1.5, 0.6], outside of the unit square");
/// ```
#[derive(Clone, Debug)]
pub struct Samples<D> {
    pub(super) domain: D,
    pub(super) locations: Vec<Location>,
    pub(super) rejected: u64,
}

impl<D: Domain> Samples<D> {
    /// The points as types that convert to the domain's, in the order in which they were drawn.
    ///
    /// # Errors
    /// [`PointsError::Point`] names the first that is not in the domain.
    pub fn new<T: ToPoint<D::Point>>(
        domain: D,
        points: impl IntoIterator<Item = T>,
    ) -> Result<Self, PointsError> {
        let points = points.into_iter().map(ToPoint::to_point);
        match locate(&domain, points) {
            Ok(locations) => Ok(Self { domain, locations, rejected: 0 }),
            Err((index, point, why)) => Err(PointsError::Point { index, point, why }),
        }
    }

    /// How many variates gave no point, beside those that gave one; 0 unless told.
    pub fn rejected(self, rejected: u64) -> Self {
        Self { rejected, ..self }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.locations.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.locations.is_empty()
    }
}

/// The locations of points, or the index of the first outside of the domain.
pub(super) fn locate<D: Domain>(
    domain: &D,
    points: impl Iterator<Item = D::Point>,
) -> Result<Vec<Location>, (usize, String, Outside)> {
    let locate = |(index, point): (usize, D::Point)| {
        domain.locate(&point).map_err(|why| (index, domain.in_words(&point), why))
    };
    points.enumerate().map(locate).collect()
}

/// Whether two domains of one type are the same one, as far as their spaces tell.
pub(super) fn same(a: &dyn Space, b: &dyn Space) -> bool {
    a.patches() == b.patches() && (a.measure() == b.measure() || a.measure().is_nan())
}
