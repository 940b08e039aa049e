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
pub use pixels::Pixels;
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

    /// [`locate`](Self::locate) for many points, whose places are appended to `out`, `None` for one that is not in the domain: the same to a few roundings
    /// of the chart coordinates, and quicker where several fit into a vector register.
    fn locate_many(&self, points: &[Self::Point], out: &mut Vec<Option<Location>>) {
        out.extend(points.iter().map(|point| self.locate(point).ok()));
    }

    /// The chart coordinates of many points of a domain of one patch, appended to `out`, to within the error that is returned, and the quicker for it; NaN of points
    /// that [`locate`](Self::locate) may not take.
    fn locate_roughly(&self, points: &[Self::Point], out: &mut Vec<[f32; 2]>) -> f32 {
        let mut places = Vec::with_capacity(points.len());
        self.locate_many(points, &mut places);
        let rough = |place: &Location| place.at.map(|x| x as f32);
        out.extend(places.iter().map(|place| place.as_ref().map_or([f32::NAN; 2], rough)));
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

    /// Charts, pictures and measures of one domain fit together.
    fn fits<D: Domain>(domain: D) {
        let grid = [0.013, 0.29, 0.5, 0.77, 0.96];
        for patch in [0, domain.patches() / 2, domain.patches() - 1] {
            for (a, b) in grid.into_iter().flat_map(|a| grid.map(|b| (a, b))) {
                if domain.axes() > 0 && domain.is_atom(patch) {
                    let (point, jacobian) = domain.point(patch, [a, b]);
                    let found = domain.locate(&point).unwrap();
                    assert_eq!((found.patch, found.at, jacobian), (patch, [0.0; 2], 1.0));
                    assert!(domain.picture_position(&found).iter().all(|x| x.is_nan()));
                    assert!(domain.neighbours(&point, 1e-3).is_empty());
                    continue;
                }
                let at =
                    if domain.axes() == 0 { [0.0; 2] } else { [a, if domain.axes() == 2 { b } else { 0.0 }] };
                let (point, jacobian) = domain.point(patch, at);
                assert!(jacobian > 0.0);
                // A small step has the measure that the Jacobian says.
                if domain.axes() == 2 {
                    let h = 1e-6;
                    let step =
                        |to: [f64; 2]| domain.displacement(&point, &domain.point(patch, to).0).unwrap();
                    let (s, t) = (step([at[0] + h, at[1]]), step([at[0], at[1] + h]));
                    let measure = (s[0] * t[1] - s[1] * t[0]).abs() / (h * h);
                    assert!(
                        (measure / jacobian - 1.0).abs() < 1e-4,
                        "{}: {measure} {jacobian}",
                        domain.name()
                    );
                }
                let found = domain.locate(&point).unwrap_or_else(|why| panic!("{point:?} {why}"));
                assert_eq!(found.patch, patch);
                for axis in 0..2 {
                    assert!((found.at[axis] - at[axis]).abs() < 1e-12, "{} {at:?} {found:?}", domain.name());
                }
                let [x, y] = domain.picture_position(&found);
                let drawn = domain.picture_location(x, y).expect("a location is drawn inside the picture");
                assert_eq!(drawn.patch, patch);
                for axis in 0..domain.axes() {
                    assert!((drawn.at[axis] - at[axis]).abs() < 1e-7, "{} {at:?} {drawn:?}", domain.name());
                }
            }
        }
        if domain.measure().is_finite() {
            let whole =
                Integrator::default().integrate(&domain, &Cell::whole(&domain), &Knots::default(), |_| 1.0);
            assert!((whole.value / domain.measure() - 1.0).abs() < 1e-9, "{}: {whole:?}", domain.name());
            let part = match domain.axes() {
                0 => Cell { patches: 1..domain.patches() - 1, ..Cell::whole(&domain) },
                _ => Cell { patches: 0..1, low: [0.2, 0.3], high: [0.7, 0.4] },
            };
            let part =
                if domain.axes() == 1 { Cell { low: [0.2, 0.0], high: [0.7, 1.0], ..part } } else { part };
            for cell in [Cell::whole(&domain), part] {
                let integral =
                    Integrator::default().integrate(&domain, &cell, &Knots::default(), |_| 1.0).value;
                let closed = domain.cell_measure(&cell);
                assert!((integral / closed - 1.0).abs() < 1e-9, "{}: {integral} {closed}", domain.name());
            }
            // The picture shows the whole measure.
            let n = 600;
            let mut shown = 0.0;
            for i in 0..n * n {
                let (x, y) = (((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64);
                if domain.picture_location(x, y).is_some() {
                    shown += domain.picture_scale(x, y) / (n * n) as f64;
                }
            }
            let atoms = (0..domain.patches()).filter(|&p| domain.axes() > 0 && domain.is_atom(p)).count();
            shown += atoms as f64; // which have no place in it
            assert!((shown / domain.measure() - 1.0).abs() < 0.005, "{}: {shown}", domain.name());
        }
    }

    #[test]
    fn charts_and_pictures_fit() {
        fits(Sphere);
        fits(Hemisphere);
        fits(Square);
        fits(Disk);
        fits(Discrete::new(7));
        fits(Triangle::with_area(2.5));
        fits(MeshSurface::from_areas(vec![1.0, 2.0, 0.5, 3.0]));
        fits(Interval::new(-1.0, 3.0));
        fits(WithAtoms::new(Hemisphere, 1));
        fits(WithAtoms::new(MeshSurface::from_areas(vec![1.0, 0.5]), 3));
        fits(WithAtoms::new(Interval::new(-1.0, 3.0), 2));
        fits(Interval::real_line());
        fits(Interval::positive());
        fits(Interval::new(f64::NEG_INFINITY, 2.0));
    }

    #[test]
    fn atoms_are_named_and_counted() {
        let domain = WithAtoms::named(Square, ["the mirror", "the sun"]);
        let cell = |patches| Cell { patches, low: [0.0; 2], high: [1.0; 2] };
        assert_eq!(domain.describe(&cell(1..2)), "the mirror");
        assert_eq!(
            domain.describe(&cell(0..3)),
            "x 0.00000..1.00000, y 0.00000..1.00000, and the mirror, the sun"
        );
        assert_eq!((domain.cell_measure(&cell(1..3)), domain.cell_measure(&cell(0..2))), (2.0, 2.0));
        assert!(domain.locate(&Mixed::Atom(2)).is_err());
        assert!(!domain.is_atom(0) && domain.is_atom(1));
    }

    #[test]
    fn quadrature_states_its_error() {
        let integrator = Integrator { max_evaluations: 400_000, ..Integrator::default() };
        // A Gaussian a hundredth wide, a step, a singularity: the error is real.
        let cases: [(&str, fn(f64) -> f64, f64); 3] = [
            ("peak", |x| (-((x - 0.3) / 1e-2).powi(2)).exp(), 1e-2 * std::f64::consts::PI.sqrt()),
            ("step", |x| if x < 1.0 / 3.0 { 1.0 } else { 0.0 }, 1.0 / 3.0),
            ("singular", |x| 0.5 / x.sqrt(), 1.0),
        ];
        for (name, f, truth) in cases {
            let domain = Interval::new(0.0, 1.0);
            let i = integrator.integrate(&domain, &Cell::whole(&domain), &Knots::default(), |x| f(*x));
            assert!((i.value - truth).abs() <= 2.0 * i.error.max(1e-12), "{name}: {i:?}, truth {truth}");
            assert!(i.error < 1e-5 * truth, "{name}: {i:?}");
        }
    }

    #[test]
    fn points_in_short() {
        let w = glam::DVec3::new(0.89712345, 0.43, -9.514791423647385e-3);
        assert_eq!(in_short(&w), "(0.897, 0.430, -9.51e-3)");
        assert_eq!(in_short(&vec![1e-40, 0.0, f64::NAN]), "[1.00e-40, 0.0, NaN]");
        assert_eq!((in_short(&7_usize), in_short(&0.25)), ("7".to_owned(), "0.250".to_owned()));
    }
}
