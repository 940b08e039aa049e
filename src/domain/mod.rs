//! The spaces that points live in: their measure, their charts, their cells.
//!
//! A domain is cut into *patches* (one for a sphere, one per triangle of a mesh, one per entry of a discrete
//! set), and each patch has a *chart*: a map from `[0, 1]^axes` onto the patch, with its Jacobian. Everything
//! that checks need (cells, quadrature, pictures) is written once against these two maps, in `f64`.
//!
//! The charts are chosen for quadrature and independence, not for sampling: no chart is the warp of a sampler
//! that is judged on it.

mod atoms;
mod direction;
mod discrete;
mod flat;
mod lat_long;
mod mistake;
mod partition;
mod pixels;
mod quadrature;
mod surface;
pub(crate) mod turns;

pub use atoms::{Mixed, WithAtoms};
pub use direction::{Hemisphere, Sphere};
pub use discrete::Discrete;
pub use flat::{Disk, Interval, Square};
pub(crate) use lat_long::LatLong;
pub use mistake::{Confusion, Factor, Keeps};
pub use partition::{Cell, Groups, Knots, Partition};
pub(crate) use partition::{Squares, nearest};
pub use pixels::{Pixels, Uncounted};
pub use quadrature::{ChartDensity, Integral, Integrator, integrate_at_random};
pub use surface::{MeshSurface, SurfacePoint, Triangle};

use std::fmt::{Debug, Display};

/// A point, or other numbers, in few digits: `(0.897, 0.431, -9.51e-3)`. For people; who wants it again has the variates.
pub(crate) fn in_short(point: &impl Debug) -> String {
    let short = |number: &str| match number.parse::<f64>() {
        Ok(x) if !number.contains(['.', 'e']) || !x.is_finite() || x == 0.0 => number.to_owned(),
        Ok(x) if (0.01..1e4).contains(&x.abs()) => format!("{x:.3}"),
        Ok(x) => format!("{x:.2e}"),
        Err(_) => number.to_owned(),
    };
    let text = format!("{point:?}");
    // Without the name of its type.
    let is_name = |name: &str| name.chars().all(char::is_alphanumeric);
    let numbers = text.find('(').filter(|at| is_name(&text[..*at])).map_or(text.as_str(), |at| &text[at..]);
    let pieces = numbers.split_inclusive(|c: char| " ,()[]".contains(c));
    pieces
        .map(|piece| {
            let number = piece.trim_end_matches(|c: char| " ,()[]".contains(c));
            short(number) + &piece[number.len()..]
        })
        .collect()
}

/// How far a coordinate may stray from where it should be (unit length, barycentric coordinates, ends of an
/// interval) before a point counts as outside: a dozen `f32` roundings.
pub const TOLERANCE: f64 = 1.5e-6;

/// Where a point lies: its patch, and its coordinates in that patch's chart, each in `[0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// Index of the patch.
    pub patch: usize,
    /// Chart coordinates; those past the patch's axes are 0.
    pub at: [f64; 2],
}

/// Why a point is not in a domain, as a phrase: "has length 0.93".
#[derive(Clone, Debug, PartialEq)]
pub struct Outside(pub String);

impl Display for Outside {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

/// What a domain is as far as it can be told without its points: patches and charts, their measure, how they are drawn. Everything that is
/// counted, cut into cells or integrated is written against this, so that it is compiled once and not once a sampler.
pub trait Space: Debug + Send + Sync + 'static {
    /// What the domain is called: "sphere".
    fn name(&self) -> &'static str;

    /// What a density on it is per: "solid angle".
    fn per(&self) -> &'static str;

    /// Total measure; may be infinite.
    fn measure(&self) -> f64;

    /// Number of patches, at least 1.
    fn patches(&self) -> usize {
        1
    }

    /// Number of chart coordinates, 0 (an atom) to 2; the same for all patches.
    fn axes(&self) -> usize {
        2
    }

    /// Whether a patch is a single point with a mass of its own: all of a discrete set, the deltas of a mixture.
    fn is_atom(&self, _patch: usize) -> bool {
        self.axes() == 0
    }

    /// A place in space for a location, such that near locations are near. Unless told, patches lie side by side.
    fn embed(&self, location: &Location) -> [f64; 3] {
        [2.0 * location.patch as f64, location.at[0], location.at[1]]
    }

    /// The measure of a cell, in closed form; may be infinite.
    fn cell_measure(&self, cell: &Cell) -> f64;

    /// The lengths, in any common unit, of a chart rectangle's sides on the domain. Only used to keep cells compact.
    fn extent(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        [high[0] - low[0], high[1] - low[1]]
    }

    /// Where a cell is, for people: "theta 10.0..12.5 deg, phi 0.0..90.0 deg".
    fn describe(&self, cell: &Cell) -> String;

    /// Factors that a density on this domain often lacks, or has once too often; the diagnosis tries them.
    fn factors(&self) -> Vec<Factor> {
        Vec::new()
    }

    /// Densities, up to a constant, that samples on this domain often have by mistake. The uniform one need not be among them.
    fn usual_densities(&self) -> Vec<Factor> {
        Vec::new()
    }

    /// Ways in which points of this domain are often put where other points belong.
    fn confusions(&self) -> Vec<Confusion> {
        Vec::new()
    }

    /// What the chart axes are called.
    fn axis_names(&self) -> [&'static str; 2] {
        ["x", "y"]
    }

    /// Whether the two ends of a chart axis are the same place.
    fn wraps(&self, _axis: usize) -> bool {
        false
    }

    /// The unit vector at a location, where points are directions.
    fn direction(&self, _location: &Location) -> Option<glam::DVec3> {
        None
    }

    /// Width over height of the picture that [`picture_location`](Self::picture_location) fills.
    fn picture_aspect(&self) -> f64 {
        1.0
    }

    /// What the point (x, y) of a picture, both in `[0, 1]` and y growing downwards, shows; `None` for background.
    fn picture_location(&self, x: f64, y: f64) -> Option<Location>;

    /// Where in the picture a location is drawn; the inverse of [`picture_location`](Self::picture_location).
    fn picture_position(&self, location: &Location) -> [f64; 2];

    /// d measure / d picture area at a place of the picture: what turns a histogram of pixels into a density.
    fn picture_scale(&self, x: f64, y: f64) -> f64;

    /// What the axes of the picture are, for its caption.
    fn picture_caption(&self) -> &'static str;
}

/// A measure space with charts. See the [module](self) for the idea.
///
/// ```
/// use warpcheck::domain::{Domain, Sphere};
/// let (w, jacobian) = Sphere.point(0, [0.5, 0.25]); // theta = pi/2, phi = pi/2
/// assert!((w - glam::DVec3::Y).length() < 1e-15);
/// assert!((jacobian - 2.0 * std::f64::consts::PI.powi(2)).abs() < 1e-12); // d solid angle / d chart
/// ```
pub trait Domain: Space + Clone {
    /// A point of the domain.
    type Point: Clone + Debug + Send + Sync;

    /// The point at chart coordinates `at` of `patch`, and the Jacobian d measure / d chart there.
    fn point(&self, patch: usize, at: [f64; 2]) -> (Self::Point, f64);

    /// The inverse of [`point`](Self::point).
    ///
    /// # Errors
    /// Says why where the point is not in the domain: not finite, not of unit length, outside.
    fn locate(&self, point: &Self::Point) -> Result<Location, Outside>;

    /// A point in few digits, for people.
    fn in_words(&self, point: &Self::Point) -> String {
        in_short(point)
    }

    /// [`locate`](Self::locate) for many points, whose places are appended to `out`, `None` for one that is not in the domain: the same to a few roundings
    /// of the chart coordinates, and quicker where several fit into a vector register.
    fn locate_many(&self, points: &[Self::Point], out: &mut Vec<Option<Location>>) {
        out.extend(points.iter().map(|point| self.locate(point).ok()));
    }

    /// The chart coordinates of many points of a domain of one patch, appended to `out` axis by axis, to within the error that is returned, and the quicker for it;
    /// NaN, at least one, of points that [`locate`](Self::locate) may not take.
    fn locate_roughly(&self, points: &[Self::Point], out: &mut [Vec<f32>; 2]) -> f32 {
        let mut places = Vec::with_capacity(points.len());
        self.locate_many(points, &mut places);
        for (axis, out) in out.iter_mut().enumerate() {
            let rough = |place: &Location| place.at[axis] as f32;
            out.extend(places.iter().map(|place| place.as_ref().map_or(f32::NAN, rough)));
        }
        0.5 * f32::EPSILON
    }

    /// The pixel of the domain's picture that a point falls into; `None` for an atom, which has no place there.
    ///
    /// # Errors
    /// As [`locate`](Self::locate).
    #[inline]
    fn pixel(&self, pixels: &Pixels, point: &Self::Point) -> Result<Option<usize>, Outside> {
        self.locate(point).map(|location| pixels.at(self.picture_position(&location)))
    }

    /// Adds each point to the count of its [`pixel`](Self::pixel), and says which have none. An atom isn't counted anywhere: its mass has no place in the
    /// picture.
    fn count_pixels(&self, pixels: &Pixels, points: &[Option<Self::Point>], counts: &mut [u32]) -> Uncounted {
        let mut uncounted = Uncounted::default();
        for point in points {
            match point.as_ref().map(|point| self.pixel(pixels, point)) {
                None => uncounted.none += 1,
                Some(Err(_)) => uncounted.outside += 1,
                Some(Ok(Some(pixel))) => counts[pixel] += 1,
                Some(Ok(None)) => {}
            }
        }
        uncounted
    }

    /// Points a step of `epsilon` (relative to the size of the domain) to all sides of `point`, inside the
    /// domain: what rounding could have made of it. Empty for atoms.
    fn neighbours(&self, point: &Self::Point, epsilon: f64) -> Vec<Self::Point> {
        let (Ok(here), axes) = (self.locate(point), self.axes()) else { return Vec::new() };
        (0..axes)
            .flat_map(|axis| [-epsilon, epsilon].map(|step| (axis, step)))
            .map(|(axis, step)| {
                let mut at = here.at;
                at[axis] = (at[axis] + step).clamp(0.0, 1.0);
                self.point(here.patch, at).0
            })
            .collect()
    }

    /// How large the numbers are that [`displacement`](Self::displacement) is formed from: what one rounding of a point is relative to.
    fn magnitude(&self, _point: &Self::Point) -> f64 {
        let measure = self.measure();
        if measure.is_finite() { measure.powf(1.0 / self.axes().max(1) as f64) } else { 1.0 }
    }

    /// The step from one point to a nearby one, in coordinates whose determinant is the measure at `from` (those past the domain's axes are
    /// 0); `None` between patches or out of the domain. What derivatives of a sampler are formed from.
    fn displacement(&self, from: &Self::Point, to: &Self::Point) -> Option<[f64; 2]> {
        let (a, b) = (self.locate(from).ok()?, self.locate(to).ok()?);
        let jacobian = self.point(a.patch, a.at).1;
        (a.patch == b.patch).then(|| [jacobian * (b.at[0] - a.at[0]), b.at[1] - a.at[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_short() {
        let w = glam::DVec3::new(0.89712345, 0.43, -9.514791423647385e-3);
        assert_eq!(in_short(&w), "(0.897, 0.430, -9.51e-3)");
        assert_eq!(in_short(&vec![1e-40, 0.0, f64::NAN]), "[1.00e-40, 0.0, NaN]");
        assert_eq!((in_short(&7_usize), in_short(&0.25)), ("7".to_owned(), "0.250".to_owned()));
    }
}
