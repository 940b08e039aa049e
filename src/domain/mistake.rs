//! What is often got wrong on a domain: factors, whole densities, and places taken for each other.

use super::Location;

/// A named function of a location.
///
/// ```
/// use warpcheck::domain::{Hemisphere, Location, Space};
/// let cosine = Hemisphere.factors().into_iter().find(|f| f.name == "cos theta").unwrap();
/// let pole = Location { patch: 0, at: [0.0, 0.0] };
/// assert_eq!((cosine.value)(&pole), 1.0);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Factor {
    /// What it is called: "sin theta".
    pub name: &'static str,
    /// Its value, at least 0; without a unit.
    pub value: fn(&Location) -> f64,
}

/// Which density a [`Confusion`] carries along with the points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keeps {
    /// The one per the domain's measure: the map is an isometry, or the density is asked at the wrong point.
    Measure,
    /// The one per chart area: coordinates are exchanged before they become a point.
    Chart,
}

/// Points put where other points belong: an axis mirrored, two axes exchanged.
pub struct Confusion {
    /// What it is called: "v flipped".
    pub name: &'static str,
    /// The locations from which samples end up at a location.
    pub origins: Box<dyn Fn(&Location) -> Vec<Location> + Send + Sync>,
    /// What stays the same on the way.
    pub keeps: Keeps,
}

impl Confusion {
    /// One that takes each location from one other.
    pub fn new(name: &'static str, keeps: Keeps, origin: fn([f64; 2]) -> [f64; 2]) -> Self {
        let origins = move |l: &Location| vec![Location { at: origin(l.at), ..*l }];
        Self { name, origins: Box::new(origins), keeps }
    }

    /// One that takes each patch from others; chart coordinates stay.
    pub fn of_patches(
        name: &'static str,
        origins: impl Fn(usize) -> std::ops::Range<usize> + Send + Sync + 'static,
    ) -> Self {
        let origins =
            move |l: &Location| origins(l.patch).map(|patch| Location { patch, at: l.at }).collect();
        Self { name, origins: Box::new(origins), keeps: Keeps::Chart }
    }
}

/// Confusions of the indices of `count` patches.
pub(super) fn of_indices(count: usize) -> Vec<Confusion> {
    let last = count - 1;
    if last == 0 {
        return Vec::new();
    }
    vec![
        Confusion::of_patches("index one too small", move |i| match i {
            0 => 0..2.min(count), // the first one stays where it is
            i => i + 1..(i + 2).min(count).max(i + 1),
        }),
        Confusion::of_patches("index one too large", move |i| match i {
            0 => 0..0,
            i if i == last => last - 1..count,
            i => i - 1..i,
        }),
        Confusion::of_patches("index one too small, wrapped around", move |i| {
            let from = (i + 1) % count;
            from..from + 1
        }),
        Confusion::of_patches("index one too large, wrapped around", move |i| {
            let from = (i + last) % count;
            from..from + 1
        }),
        Confusion::of_patches("indices reversed", move |i| last - i..count - i),
    ]
}
