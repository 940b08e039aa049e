//! A finite set of entries, measured by counting: a density is the probability mass of an entry.

use super::mistake::of_indices;
use super::{Cell, Confusion, Domain, Location, Outside, Space};

/// The indices `0..len`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discrete {
    len: usize,
}

impl Discrete {
    /// The indices `0..len`.
    ///
    /// # Panics
    /// If `len` is 0: an empty set carries no probability.
    #[track_caller]
    pub fn new(len: usize) -> Self {
        assert!(len > 0, "a discrete domain needs at least one entry");
        Self { len }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Never true: an empty set cannot be made.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

impl Space for Discrete {
    fn confusions(&self) -> Vec<Confusion> {
        of_indices(self.len)
    }

    fn cell_measure(&self, cell: &Cell) -> f64 {
        cell.patches.len() as f64
    }

    fn name(&self) -> &'static str {
        "discrete"
    }

    fn per(&self) -> &'static str {
        "entry (mass)"
    }

    fn measure(&self) -> f64 {
        self.len as f64
    }

    fn patches(&self) -> usize {
        self.len
    }

    fn axes(&self) -> usize {
        0
    }

    fn describe(&self, cell: &Cell) -> String {
        match cell.patches.end - cell.patches.start {
            1 => format!("index {}", cell.patches.start),
            _ => format!("indices {}..={}", cell.patches.start, cell.patches.end - 1),
        }
    }

    fn picture_aspect(&self) -> f64 {
        4.0
    }

    fn picture_location(&self, x: f64, _: f64) -> Option<Location> {
        Some(Location { patch: ((x * self.len as f64) as usize).min(self.len - 1), at: [0.0; 2] })
    }

    fn picture_position(&self, location: &Location) -> [f64; 2] {
        [(location.patch as f64 + 0.5) / self.len as f64, 0.5]
    }

    fn picture_scale(&self, _: f64, _: f64) -> f64 {
        self.len as f64
    }

    fn picture_caption(&self) -> &'static str {
        "entries in order of index, left to right"
    }
}

impl Domain for Discrete {
    type Point = usize;

    fn point(&self, patch: usize, _: [f64; 2]) -> (usize, f64) {
        (patch, 1.0)
    }

    /// Nothing has so many entries that the upper half of all numbers could be indices: there are those that were below 0 where they came from.
    fn in_words(&self, index: &usize) -> String {
        (*index as isize).to_string()
    }

    fn locate(&self, index: &usize) -> Result<Location, Outside> {
        if *index < self.len {
            Ok(Location { patch: *index, at: [0.0; 2] })
        } else {
            Err(Outside(format!("is index {} of {} entries", self.in_words(index), self.len)))
        }
    }
}
