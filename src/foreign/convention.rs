//! What others mean by a direction and by a density: which way is up, and what a density is per.

use super::Coordinates;
use crate::domain::{Location, Space};
use glam::DVec3;
use std::f64::consts::PI;
use std::fmt::{Display, Formatter};
use std::str::FromStr;

/// A right- or left-handed frame whose axes are ours up to order and sign: each of our coordinates is one of theirs, perhaps negated.
///
/// Written as a name (`z-up`, `y-up`, `x-up`) or as what our x, y and z are in theirs: `y-up` is `x,-z,y`. Lat-long maps that begin elsewhere or run the
/// other way are frames too: `-x,-y,z` turns phi by half a turn, `y,-x,z` by a quarter, `x,-y,z` reverses it, `x,y,-z` counts theta from the other pole.
///
/// ```
/// use warpcheck::foreign::Frame;
/// let frame: Frame = "y-up".parse()?;
/// assert_eq!(frame, "x,-z,y".parse()?);
/// assert_eq!(frame.to_ours(glam::DVec3::Y), glam::DVec3::Z);
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    axes: [(usize, bool); 3],
}

impl Frame {
    /// Ours: theta from +Z, phi from +X towards +Y.
    pub const Z_UP: Self = Self { axes: [(0, false), (1, false), (2, false)] };
    /// Y is up; turned about X into ours, so that right-handed stays right-handed.
    pub const Y_UP: Self = Self { axes: [(0, false), (2, true), (1, false)] };
    /// X is up; the axes in rotation.
    pub const X_UP: Self = Self { axes: [(1, false), (2, false), (0, false)] };

    /// Their direction in our frame.
    pub fn to_ours(self, theirs: DVec3) -> DVec3 {
        let pick = |(axis, negated): (usize, bool)| if negated { -theirs[axis] } else { theirs[axis] };
        DVec3::from_array(self.axes.map(pick))
    }

    /// Our direction in their frame.
    pub fn to_theirs(self, ours: DVec3) -> DVec3 {
        let mut theirs = DVec3::ZERO;
        for (i, (axis, negated)) in self.axes.into_iter().enumerate() {
            theirs[axis] = if negated { -ours[i] } else { ours[i] };
        }
        theirs
    }

    /// All 48, those with names first, then by how many signs they change.
    pub fn all() -> Vec<Self> {
        let orders = [[0, 1, 2], [0, 2, 1], [1, 2, 0], [2, 0, 1], [1, 0, 2], [2, 1, 0]];
        let mut signs: Vec<u32> = (0..8).collect();
        signs.sort_by_key(|bits| bits.count_ones());
        let of =
            |bits: u32| orders.map(|order| Self { axes: [0, 1, 2].map(|i| (order[i], bits >> i & 1 == 1)) });
        let mut all = vec![Self::Z_UP, Self::Y_UP, Self::X_UP];
        for frame in signs.into_iter().flat_map(of) {
            if !all.contains(&frame) {
                all.push(frame);
            }
        }
        all
    }
}

impl Display for Frame {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::Z_UP => f.pad("z-up"),
            Self::Y_UP => f.pad("y-up"),
            Self::X_UP => f.pad("x-up"),
            Self { axes } => {
                let name = |(axis, negated): (usize, bool)| {
                    format!("{}{}", if negated { "-" } else { "" }, ["x", "y", "z"][axis])
                };
                f.pad(&axes.map(name).join(","))
            }
        }
    }
}

impl FromStr for Frame {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "z-up" => return Ok(Self::Z_UP),
            "y-up" => return Ok(Self::Y_UP),
            "x-up" => return Ok(Self::X_UP),
            _ => {}
        }
        let axis = |word: &str| {
            let (negated, letter) =
                word.trim().strip_prefix('-').map_or((false, word.trim()), |rest| (true, rest));
            Some((["x", "y", "z"].iter().position(|name| *name == letter)?, negated))
        };
        let axes: Option<Vec<_>> = text.split(',').map(axis).collect();
        let axes = axes.and_then(|axes| <[_; 3]>::try_from(axes).ok());
        axes.filter(|axes| (0..3).all(|axis| axes.iter().any(|a| a.0 == axis)))
            .map(|axes| Self { axes })
            .ok_or_else(|| format!("`{text}` is no frame; write z-up, y-up, x-up, or what our x, y and z are in theirs: x,-z,y"))
    }
}

/// What a density is per.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Solid angle, of directions.
    SolidAngle,
    /// Solid angle times |cos theta|.
    ProjectedSolidAngle,
    /// d theta d phi.
    ThetaPhi,
    /// Texture coordinates: (phi / 2 pi, theta / pi) of the sphere, (phi / 2 pi, 2 theta / pi) of the hemisphere, (b1, b2) of a triangle, (x, y) of
    /// the square.
    Uv,
    /// Area, of flat domains.
    Area,
    /// d r d phi, of the disk.
    RPhi,
    /// Length, of an interval.
    Length,
    /// Mass, of entries.
    Mass,
    /// The uniform density: 1 is uniform.
    Uniform,
}

impl Measure {
    const ALL: [(Self, &'static str); 9] = [
        (Self::SolidAngle, "solid-angle"),
        (Self::ProjectedSolidAngle, "projected-solid-angle"),
        (Self::ThetaPhi, "theta-phi"),
        (Self::Uv, "uv"),
        (Self::Area, "area"),
        (Self::RPhi, "r-phi"),
        (Self::Length, "length"),
        (Self::Mass, "mass"),
        (Self::Uniform, "uniform"),
    ];

    /// Those that make sense on a domain, its own first.
    pub fn of(space: &dyn Space) -> Vec<Self> {
        let mut all = match space.name() {
            "sphere" | "hemisphere" => {
                vec![Self::SolidAngle, Self::ProjectedSolidAngle, Self::ThetaPhi, Self::Uv]
            }
            "square" | "triangle" => vec![Self::Area, Self::Uv],
            "disk" => vec![Self::Area, Self::RPhi],
            "interval" => vec![Self::Length],
            _ => vec![Self::Mass],
        };
        if space.measure().is_finite() {
            all.push(Self::Uniform);
        }
        all
    }

    /// What a density per this measure is to be multiplied by to be one per the domain's own.
    pub fn factor(self, space: &dyn Space) -> MeasureFactor {
        // A convention asks it of every sample: names are compared only where that matters.
        let half_turns = || if space.name() == "hemisphere" { 0.5 } else { 1.0 };
        match self {
            Self::SolidAngle | Self::Area | Self::Length | Self::Mass => MeasureFactor::Same(1.0),
            Self::ProjectedSolidAngle => MeasureFactor::Cosine { range: half_turns() * PI },
            Self::ThetaPhi => MeasureFactor::Sine { half_turns: half_turns(), scale: 1.0 },
            Self::Uv => match space.name() {
                "sphere" | "hemisphere" => MeasureFactor::Sine {
                    half_turns: half_turns(),
                    scale: 1.0 / (2.0 * PI * half_turns() * PI),
                },
                "triangle" => MeasureFactor::Same(0.5 / space.measure()),
                _ => MeasureFactor::Same(1.0),
            },
            Self::RPhi => MeasureFactor::Radius,
            Self::Uniform => MeasureFactor::Same(1.0 / space.measure()),
        }
    }
}

/// What densities per a [`Measure`] are to be multiplied by, on a domain, asked of every place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeasureFactor {
    /// The same everywhere.
    Same(f64),
    /// |cos theta|; theta is `range` times the first axis of the chart.
    Cosine {
        /// Radians.
        range: f64,
    },
    /// `scale` / sin theta; theta is pi times `half_turns` times the first axis of the chart.
    Sine {
        /// 1 on the sphere, 1/2 on the hemisphere.
        half_turns: f64,
        /// What stands above the sine.
        scale: f64,
    },
    /// 1 / r, the first axis of the chart of the disk.
    Radius,
}

impl MeasureFactor {
    /// At a place. Infinite at poles and in the middle of a disk where a density per its chart is.
    #[inline]
    pub fn at(self, place: &Location) -> f64 {
        let first = place.at[0];
        match self {
            Self::Same(factor) => factor,
            Self::Cosine { range } => (range * first).cos().abs(),
            Self::Sine { half_turns, scale } => scale / sine_of_half_turns(half_turns * first),
            Self::Radius => 1.0 / first,
        }
    }
}

/// sin(pi x) for x from 0 to 1, to 3e-14 of itself, also at both ends. The terms of Taylor's series, which a compiler takes for several samples at once, where it waits for a call of the library's sine.
#[inline]
fn sine_of_half_turns(x: f64) -> f64 {
    let t = PI * x.min(1.0 - x);
    let square = t * t;
    // t^19 / 19!, the first that is left out, is 4e-14 at a quarter turn.
    let series = [272.0, 210.0, 156.0, 110.0, 72.0, 42.0, 20.0, 6.0];
    t * series.into_iter().fold(1.0, |sum, of: f64| 1.0 - square * (1.0 / of) * sum)
}

impl Display for Measure {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.pad(Self::ALL.iter().find(|(measure, _)| measure == self).map_or("", |(_, name)| name))
    }
}

impl FromStr for Measure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|(_, name)| *name == text).map(|(measure, _)| measure).ok_or_else(|| {
            format!("`{text}` is no measure; there are {}", Self::ALL.map(|(_, name)| name).join(", "))
        })
    }
}

/// A domain as others write its points and densities.
#[derive(Clone, Debug)]
pub struct Convention<D> {
    /// The domain.
    pub domain: D,
    /// Their frame.
    pub frame: Frame,
    /// What their densities are per.
    pub measure: Measure,
}

impl<D: Coordinates> Convention<D> {
    /// Ours.
    pub fn new(domain: D) -> Self {
        let measure = Measure::of(&domain)[0];
        Self { domain, frame: Frame::Z_UP, measure }
    }

    /// The point of their numbers.
    #[inline(always)]
    pub fn point(&self, numbers: &[f64]) -> D::Point {
        let point = self.domain.point_of(numbers);
        if self.frame == Frame::Z_UP { point } else { self.domain.to_ours(point, self.frame) }
    }

    /// Appends their numbers of a point.
    pub fn numbers(&self, point: &D::Point, out: &mut Vec<f64>) {
        self.domain.numbers_of(&self.domain.to_theirs(point, self.frame), out);
    }

    /// Their density at a point, per the domain's own measure. Where the point is outside of the domain, as it is.
    #[inline]
    pub fn density(&self, point: &D::Point, theirs: f64) -> f64 {
        let factor = self.measure.factor(&self.domain);
        if theirs == 0.0 || factor == MeasureFactor::Same(1.0) {
            return theirs;
        }
        self.domain.locate(point).map_or(theirs, |at| theirs * factor.at(&at))
    }

    /// The same domain under every other convention that there is, in the order in which they are likely.
    pub fn others(&self) -> Vec<Self> {
        let frames = if self.domain.has_frame() { Frame::all() } else { vec![self.frame] };
        let measures = Measure::of(&self.domain);
        let with = |frame: Frame, measure: Measure| Self { domain: self.domain.clone(), frame, measure };
        let same_frame = measures.iter().filter(|m| **m != self.measure).map(|&m| with(self.frame, m));
        let same_measure = frames.iter().filter(|f| **f != self.frame).map(|&f| with(f, self.measure));
        same_frame.chain(same_measure).collect()
    }

    /// In words, as options of the command line.
    pub fn words(&self) -> String {
        let frame = if self.domain.has_frame() { format!("--frame {} ", self.frame) } else { String::new() };
        format!("{frame}--measure {}", self.measure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_is_the_sine() {
        for i in 0..=1000 {
            // From 1e-15 to a half, evenly and in magnitude, and as far from the other end.
            for x in [f64::from(i) / 2000.0, 10_f64.powf(-15.0 * f64::from(i) / 1000.0) / 2.0] {
                let sine = (PI * x).sin();
                assert!((sine_of_half_turns(x) - sine).abs() <= 1e-13 * sine, "{x}");
                assert_eq!(sine_of_half_turns(1.0 - x), sine_of_half_turns(1.0 - (1.0 - x)), "{x}");
            }
        }
        assert_eq!([0.0, 1.0].map(sine_of_half_turns), [0.0; 2]);
    }
}
