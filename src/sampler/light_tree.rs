//! Selection by power over squared distance.
//!
//! Seen from x, a light of power P at distance d brings P / d^2: where lights are many, selection should follow that, and no table can, since the weights differ
//! at every x. A binary tree over the lights can (Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018): from
//! the root, one variate goes to the left child with probability
//!
//!   p = w_left / (w_left + w_right),   w = P / max(d^2, r^2),
//!
//! P the summed power of a node, d the distance from x to the centre of its bounding box, r half its diagonal (closer than that, the box has no
//! distance worth the name). p is kept 2^-30 away from 0 and 1.
//!
//! What is divided on the way down are the 2^53 steps of the variate: a node with s of them leaves floor(p s) to its left child, but as many to either as it has
//! lights. So every light has a step at least, and is reached by 53-bit variates from everywhere, which a product of probabilities doesn't promise
//! (two levels of 2^-30 are less than a step); and the masses are whole numbers of steps that sum to 2^53, the same in `choose` and `mass`.
//!
//! The tree is cut in the middle along the widest axis, so its depth is log2 of the number of lights, and its shape needs no pointers: in preorder a
//! node with k lights is followed by its left half, k / 2 lights in 2 (k / 2) - 1 nodes, and that by the right half.

use super::Error;
use super::discrete::{STEPS, inside};
use glam::{DVec3, Vec3};

/// The least probability of a child.
const LEAST: f64 = 1.0 / (1 << 30) as f64;

/// Triangles, selected by power over squared distance as seen from a point. See the file for its mathematics.
///
/// ```
/// use glam::Vec3;
/// use warpcheck::sampler::LightTree;
/// let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x + 0.1, 0.0, 0.0), Vec3::new(x, 0.1, 0.0)];
/// let tree = LightTree::new([(at(0.0), 1.0), (at(4.0), 1.0)])?;
/// let (index, mass) = tree.choose(Vec3::Z, 0.3);
/// assert_eq!((index, mass), (0, tree.mass(Vec3::Z, 0)));
/// assert!(mass > 0.9); // the near one: 1 against 1/17
/// # Ok::<(), warpcheck::sampler::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct LightTree {
    /// In preorder.
    nodes: Box<[Node]>,
    /// The light at each place of the tree's lower end, and the place of each light.
    lights: Box<[u32]>,
    places: Box<[u32]>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    centre: DVec3,
    /// r^2.
    least: f64,
    power: f64,
}

/// A node, its index, and the places under it.
#[derive(Clone, Copy)]
struct Branch {
    node: usize,
    from: usize,
    to: usize,
}

impl Branch {
    fn lights(self) -> u64 {
        (self.to - self.from) as u64
    }

    fn halves(self) -> Option<[Self; 2]> {
        let Self { node, from, to } = self;
        let middle = from + (to - from) / 2;
        let left = Self { node: node + 1, from, to: middle };
        (to - from > 1).then_some([left, Self { node: node + 2 * (middle - from), from: middle, to }])
    }
}

impl LightTree {
    /// A tree over triangles and their powers, all above 0 in any unit.
    ///
    /// # Errors
    /// Without triangles, or if a power is not finite and above 0 or a vertex is not finite (named by its index).
    pub fn new(lights: impl IntoIterator<Item = ([Vec3; 3], f64)>) -> Result<Self, Error> {
        let lights: Vec<_> = lights.into_iter().collect();
        for (index, &(vertices, power)) in lights.iter().enumerate() {
            if let Some(&vertex) = vertices.iter().find(|v| !v.is_finite()) {
                return Err(Error::Vertex { triangle: index, vertex });
            }
            if !(power.is_finite() && power > 0.0) {
                return Err(Error::Power { index, value: power });
            }
        }
        if lights.is_empty() {
            return Err(Error::NoWeights);
        }
        // Against the largest, so that no sum overflows.
        let largest = lights.iter().map(|l| l.1).fold(0.0, f64::max);
        let bounds = |(vertices, power): &([Vec3; 3], f64)| {
            let [a, b, c] = vertices.map(|v| v.as_dvec3());
            (a.min(b).min(c), a.max(b).max(c), power / largest)
        };
        let bounds: Vec<_> = lights.iter().map(bounds).collect();
        let mut order: Vec<u32> = (0..bounds.len() as u32).collect();
        let mut nodes = Vec::with_capacity(2 * order.len() - 1);
        grow(&bounds, &mut order, &mut nodes);
        let mut places = vec![0; order.len()];
        order.iter().zip(0..).for_each(|(&light, place)| places[light as usize] = place);
        Ok(Self { nodes: nodes.into(), lights: order.into(), places: places.into() })
    }

    /// The light for a variate in `[0, 1)` as seen from `x`, and its probability. What lies outside is moved to the nearest end, NaN to 0.
    #[inline]
    pub fn choose(&self, x: Vec3, xi: f64) -> (usize, f64) {
        let (mut at, mut steps, mut step) = (self.root(), STEPS as u64, (inside(xi) * STEPS) as u64);
        while let Some([left, right]) = at.halves() {
            let to_left = self.steps_to_left(x, left, right, steps);
            (at, steps, step) = match step < to_left {
                true => (left, to_left, step),
                false => (right, steps - to_left, step - to_left),
            };
        }
        (self.lights[at.from] as usize, steps as f64 / STEPS)
    }

    /// The probability of a light as seen from `x`; 0 past the end.
    #[inline]
    pub fn mass(&self, x: Vec3, light: usize) -> f64 {
        self.steps(x, light).map_or(0.0, |[_, steps]| steps as f64 / STEPS)
    }

    /// The variates `[start, end)` at which a light is chosen as seen from `x`, in multiples of 2^-53; `None` past the end.
    pub fn interval(&self, x: Vec3, light: usize) -> Option<(f64, f64)> {
        self.steps(x, light).map(|[start, steps]| (start as f64 / STEPS, (start + steps) as f64 / STEPS))
    }

    /// The first step of a light, and how many it has.
    #[inline]
    fn steps(&self, x: Vec3, light: usize) -> Option<[u64; 2]> {
        let place = *self.places.get(light)? as usize;
        let (mut at, mut start, mut steps) = (self.root(), 0, STEPS as u64);
        while let Some([left, right]) = at.halves() {
            let to_left = self.steps_to_left(x, left, right, steps);
            (at, start, steps) = match place < left.to {
                true => (left, start, to_left),
                false => (right, start + to_left, steps - to_left),
            };
        }
        Some([start, steps])
    }

    /// How many of a node's steps the left child has.
    #[inline]
    fn steps_to_left(&self, x: Vec3, left: Branch, right: Branch, steps: u64) -> u64 {
        let share = (self.to_left(x, left, right) * steps as f64) as u64;
        share.clamp(left.lights(), steps - right.lights())
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Never true: an empty tree cannot be made.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Bytes that the tree takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.lights) + size_of_val(&*self.places)
    }

    fn root(&self) -> Branch {
        Branch { node: 0, from: 0, to: self.lights.len() }
    }

    #[inline]
    fn to_left(&self, x: Vec3, left: Branch, right: Branch) -> f64 {
        let [(p, d), (q, e)] = [left, right].map(|branch| {
            let Node { centre, least, power } = self.nodes[branch.node];
            (power, centre.distance_squared(x.as_dvec3()).max(least))
        });
        // w_left / (w_left + w_right) without the quotients. Powers 1e-308 of the largest, and products of what is tiny, are no numbers any more.
        let sum = p * e + q * d;
        if sum > 0.0 { (p * e / sum).clamp(LEAST, 1.0 - LEAST) } else { 0.5 }
    }
}

/// Appends the tree over `order` in preorder, and sorts `order` into its places.
fn grow(bounds: &[(DVec3, DVec3, f64)], order: &mut [u32], nodes: &mut Vec<Node>) {
    let of = |&i: &u32| bounds[i as usize];
    let whole = order.iter().map(of).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1), a.2 + b.2));
    let Some((low, high, power)) = whole else { return };
    let centre = 0.5 * (low + high);
    // A triangle that is a point to f64 would be at distance 0 of itself.
    let least = (0.25 * (high - low).length_squared()).max(f64::MIN_POSITIVE);
    nodes.push(Node { centre, least, power });
    if order.len() > 1 {
        let axis = (high - low).max_position();
        let middle = |i: &u32| of(i).0[axis] + of(i).1[axis];
        order.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
        let (left, right) = order.split_at_mut(order.len() / 2);
        grow(bounds, left, nodes);
        grow(bounds, right, nodes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_and_faint_lights_are_still_reached() {
        let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, 1.0)];
        let tree = LightTree::new([(at(0.0), 1e30), (at(1e15), 1e-30)]).unwrap();
        assert_eq!(tree.mass(Vec3::ZERO, 1), LEAST);
        assert_eq!(tree.choose(Vec3::ZERO, 1.0 - f64::EPSILON), (1, LEAST));
        let wrong = LightTree::new([(at(0.0), 1.0), (at(1.0), 0.0)]).unwrap_err();
        assert_eq!(wrong, Error::Power { index: 1, value: 0.0 });
        assert_eq!(wrong.to_string(), "light 1 has the power 0.0; powers must be finite and above 0");
        assert!(LightTree::new([]).is_err());
    }

    /// Three levels of 2^-30 are less than a step: a step it is, and the intervals lie side by side.
    #[test]
    fn every_light_has_a_step() {
        let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1.0, 0.0), Vec3::new(x, 0.0, 1.0)];
        let power = |i: i32| 10.0_f64.powi(-20 * i);
        let tree = LightTree::new((0..16).map(|i| (at(4.0 * i as f32), power(i)))).unwrap();
        let mut end = 0.0;
        for light in 0..16 {
            let (start, next) = tree.interval(Vec3::ZERO, light).unwrap();
            assert_eq!(start, end, "{light}");
            for xi in [start, next - 1.0 / STEPS] {
                assert_eq!(tree.choose(Vec3::ZERO, xi), (light, next - start), "{light}, {xi}");
            }
            end = next;
        }
        assert_eq!((end, tree.mass(Vec3::ZERO, 15)), (1.0, 1.0 / STEPS));
        assert_eq!(tree.interval(Vec3::ZERO, 16), None);
    }
}
