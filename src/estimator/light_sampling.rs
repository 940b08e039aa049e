//! How a point of the emitters is drawn: which triangle, and where on it.
//!
//! | selection | probability of triangle i of area A_i and radiance L_i |
//! | --- | --- |
//! | area | A_i / sum A |
//! | power | Phi_i / sum Phi, Phi_i = pi A_i s_i lum(L_i), s_i = 1 or 2 sides, lum the luminance |
//! | power/d2 | by Phi_i over squared distance, through a tree ([`LightTree`](crate::sampler::LightTree)) |
//!
//! A point on it is uniform in area or in solid angle ([`Placement`]). All six combinations estimate the same integral.

use super::Error;
use crate::sampler::Placement;
use std::{fmt, str::FromStr};

/// By what a triangle of the emitters is selected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Selection {
    /// By area: the baseline.
    #[default]
    Area,
    /// By power.
    Power,
    /// By power over squared distance to the point that is lit.
    PowerOverDistance,
}

/// How a point of the emitters is drawn.
///
/// Each part is written and read as on the command line: `area`, `power`, `power/d2`; `area`, `solid-angle`.
///
/// ```
/// use warpcheck::estimator::{LightSampling, Selection};
/// use warpcheck::sampler::Placement;
/// let sampling = LightSampling { selection: "power/d2".parse()?, placement: "solid-angle".parse()? };
/// assert_eq!(sampling.selection, Selection::PowerOverDistance);
/// assert_eq!(sampling.placement, Placement::SolidAngle);
/// assert_eq!(sampling.to_string(), "power/d2, solid-angle");
/// # Ok::<(), warpcheck::estimator::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightSampling {
    /// Which triangle.
    pub selection: Selection,
    /// Where on it.
    pub placement: Placement,
}

impl LightSampling {
    /// All combinations, the baseline first.
    pub fn all() -> impl Iterator<Item = Self> {
        SELECTIONS
            .into_iter()
            .flat_map(|(selection, _)| PLACEMENTS.map(|(placement, _)| Self { selection, placement }))
    }
}

const SELECTIONS: [(Selection, &str); 3] =
    [(Selection::Area, "area"), (Selection::Power, "power"), (Selection::PowerOverDistance, "power/d2")];
const PLACEMENTS: [(Placement, &str); 2] =
    [(Placement::Area, "area"), (Placement::SolidAngle, "solid-angle")];

fn name<T: PartialEq>(list: &[(T, &'static str)], value: T) -> &'static str {
    list.iter().find(|(item, _)| *item == value).map_or("", |(_, name)| name)
}

fn read<T: Copy>(list: &[(T, &'static str)], given: &str) -> Result<T, Error> {
    let found = list.iter().find(|(_, name)| *name == given).map(|(item, _)| *item);
    found.ok_or_else(|| {
        let known = list.iter().map(|(_, name)| *name).collect::<Vec<_>>().join(", ");
        Error::LightSampling { given: given.into(), known }
    })
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(name(&SELECTIONS, *self))
    }
}

impl FromStr for Selection {
    type Err = Error;

    fn from_str(given: &str) -> Result<Self, Error> {
        read(&SELECTIONS, given)
    }
}

impl fmt::Display for Placement {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(name(&PLACEMENTS, *self))
    }
}

impl FromStr for Placement {
    type Err = Error;

    fn from_str(given: &str) -> Result<Self, Error> {
        read(&PLACEMENTS, given)
    }
}

impl fmt::Display for LightSampling {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}, {}", self.selection, self.placement)
    }
}
