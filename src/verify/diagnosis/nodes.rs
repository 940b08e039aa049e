//! Where densities are compared: a few fixed points in every leaf of the partition.
//!
//! What a hypothesis makes of the claimed density is mostly a smooth factor. So its mass in a leaf is the claimed mass, which careful quadrature gave,
//! times the ratio of two sums over the same points: the edges and peaks of the claimed density cancel.

use crate::domain::{Cell, Knots, Location};
use crate::verify::check::Case;
use std::ops::Range;

/// Pairs of points that each axis of a leaf gets: the more leaves there are, the less a factor changes within one; what a mistake does to a table changes
/// from texel to texel.
fn panels(leaves: usize, is_table: bool) -> usize {
    match leaves {
        0..0x400 => 4,
        0x400..=0x1000 if is_table => 4,
        0x400..0x2000 if !is_table => 2,
        _ => 1,
    }
}

/// Pieces that knots may cut a leaf into, along an axis.
const PIECES: usize = 33;
/// Patches that are looked at, at most; of more, every second one, or third, ….
const PATCHES: usize = 1 << 18;

/// Gauss' two points on [0, 1].
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

pub(super) struct Node {
    pub location: Location,
    /// Chart area that it stands for.
    pub weight: f64,
    pub density: f64,
    pub jacobian: f64,
}

impl Node {
    /// The claimed density per chart area.
    pub fn chart_density(&self) -> f64 {
        charted(self.density, self.jacobian)
    }
}

/// A density per chart area; none at a pole, or farther out than numbers go.
pub(super) fn charted(density: f64, jacobian: f64) -> f64 {
    let product = density * jacobian;
    if product.is_finite() && product > 0.0 { product } else { 0.0 }
}

pub(super) struct Nodes {
    pub nodes: Vec<Node>,
    /// The nodes of each leaf.
    of_leaf: Vec<Range<usize>>,
    /// Claimed mass of each leaf.
    pub claimed: Vec<f64>,
    /// The same by the nodes alone.
    raw: Vec<f64>,
}

impl Nodes {
    pub fn new(case: &Case<'_>) -> Self {
        let (probe, partition) = (case.probe, &case.expectation.partition);
        let leaves = partition.leaves();
        let axes = probe.space().axes();
        let is_table = probe.knots().axes.iter().any(|knots| !knots.is_empty());
        let panels = panels(leaves.len(), is_table);
        let stride = probe.space().patches().div_ceil(PATCHES);
        let per_leaf = crate::parallel::map(leaves.len(), |leaf| {
            let cell = &leaves[leaf];
            // Where most of a cell is empty, closer to its samples.
            let grading = partition.grading(leaf);
            let graded = grading.axes.iter().take(axes).any(|cuts| !cuts.is_empty());
            let panels = if graded { 1 } else { panels };
            let along = |axis: usize| -> Vec<(f64, f64)> {
                if axis >= axes {
                    return vec![(0.0, 1.0)];
                }
                points(cell, axis, probe.knots(), &grading, panels)
            };
            let (first, second) = (along(0), along(1));
            let mut nodes = Vec::new();
            for patch in cell.patches.clone().step_by(stride) {
                let represented = stride.min(cell.patches.end - patch) as f64;
                for (a, wa) in &first {
                    for (b, wb) in &second {
                        let location = Location { patch, at: [*a, *b] };
                        let weight = wa * wb * represented;
                        nodes.push(Node { location, weight, density: 0.0, jacobian: 0.0 });
                    }
                }
            }
            let places: Vec<Location> = nodes.iter().map(|node: &Node| node.location).collect();
            let mut answers = Vec::new();
            probe.densities_at(&places, &mut answers);
            for (node, answer) in nodes.iter_mut().zip(answers) {
                (node.density, node.jacobian) = answer;
            }
            nodes
        });
        let (mut nodes, mut of_leaf) = (Vec::new(), Vec::new());
        for leaf in per_leaf {
            of_leaf.push(nodes.len()..nodes.len() + leaf.len());
            nodes.extend(leaf);
        }
        let claimed = case.expectation.masses();
        let mut all = Self { nodes, of_leaf, claimed, raw: Vec::new() };
        all.raw = all.sums(&|node| node.chart_density());
        all
    }

    fn sums(&self, chart_density: &dyn Fn(&Node) -> f64) -> Vec<f64> {
        let sum = |range: &Range<usize>| {
            self.nodes[range.clone()].iter().map(|node| node.weight * chart_density(node)).sum()
        };
        self.of_leaf.iter().map(sum).collect()
    }

    /// The mass of each leaf under a density per chart area.
    pub fn masses(&self, chart_density: &dyn Fn(&Node) -> f64) -> Vec<f64> {
        self.masses_by_index(&|node| chart_density(&self.nodes[node]))
    }

    /// The same, of a density given for each node by its index.
    pub fn masses_by_index(&self, chart_density: &dyn Fn(usize) -> f64) -> Vec<f64> {
        let (mut masses, mut unseen) = (Vec::with_capacity(self.of_leaf.len()), Vec::new());
        let (mut seen, mut seen_claimed) = (0.0, 0.0);
        for (leaf, range) in self.of_leaf.iter().enumerate() {
            let (mut sum, mut same_support) = (0.0, true);
            for (i, node) in range.clone().zip(&self.nodes[range.clone()]) {
                let value = chart_density(i);
                let value = if value.is_finite() && value > 0.0 { value } else { 0.0 };
                sum += node.weight * value;
                same_support &= (value > 0.0) == (node.chart_density() > 0.0);
            }
            let claimed = self.claimed[leaf];
            if same_support && self.raw[leaf] > 0.0 {
                sum *= claimed / self.raw[leaf];
                seen += sum;
                seen_claimed += claimed;
            } else if sum == 0.0 && claimed > 0.0 && self.raw[leaf] == 0.0 {
                unseen.push(leaf); // a sliver of the support that no node is in
            }
            masses.push(sum);
        }
        for leaf in unseen {
            masses[leaf] = self.claimed[leaf] * seen / f64::max(seen_claimed, 1e-300);
        }
        masses
    }

    /// Each node with the claimed mass that it stands for.
    pub fn weighted(&self) -> impl Iterator<Item = (&Node, f64)> {
        self.of_leaf.iter().enumerate().flat_map(|(leaf, range)| {
            let raw = self.raw[leaf];
            let correction = if raw > 0.0 { self.claimed[leaf] / raw } else { 0.0 };
            self.nodes[range.clone()]
                .iter()
                .map(move |node| (node, correction * node.weight * node.chart_density()))
        })
    }

    /// Sums over classes of nodes, of the claimed mass and of the domain's measure.
    pub fn by_class(&self, count: usize, class: &dyn Fn(&Location) -> usize) -> (Vec<f64>, Vec<f64>) {
        let (mut masses, mut measures) = (vec![0.0; count], vec![0.0; count]);
        for (node, mass) in self.weighted() {
            let class = class(&node.location);
            masses[class] += mass;
            measures[class] += node.weight * charted(1.0, node.jacobian);
        }
        (masses, measures)
    }
}

/// Points and weights along one axis of a cell, between its knots if they are few.
fn points(cell: &Cell, axis: usize, knots: &Knots, grading: &Knots, panels: usize) -> Vec<(f64, f64)> {
    let (low, high) = (cell.low[axis], cell.high[axis]);
    let mut ends = vec![low];
    let inside = knots.axes[axis].iter().copied().filter(|&k| k > low && k < high);
    if inside.clone().take(PIECES).count() < PIECES {
        ends.extend(inside);
    }
    ends.extend(grading.axes[axis].iter().copied().filter(|&x| x > low && x < high));
    ends.sort_by(f64::total_cmp);
    ends.push(high);
    let piece = |ends: &[f64]| {
        let (start, width) = (ends[0], (ends[1] - ends[0]) / panels as f64);
        (0..panels).flat_map(move |panel| GAUSS.map(|x| (start + (panel as f64 + x) * width, 0.5 * width)))
    };
    ends.windows(2).flat_map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Interval, Partition};
    use crate::sampler::{Sampler, from_fn};
    use crate::verify::expectation::{Expectation, told};
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;
    use crate::verify::tally::Tally;

    #[track_caller]
    fn all_near(found: &[f64], expected: &[f64]) {
        let same =
            found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(same, "{found:?}, not {expected:?}");
    }

    #[test]
    fn fewer_points_in_more_leaves() {
        let smooth = [1, 1023, 1024, 4096, 4097, 8191, 8192].map(|leaves| panels(leaves, false));
        let table = [1, 1023, 1024, 4096, 4097, 8191, 8192].map(|leaves| panels(leaves, true));
        assert_eq!((smooth, table), ([4, 4, 2, 2, 2, 2, 1], [4, 4, 4, 4, 1, 1, 1]));
    }

    #[test]
    fn densities_of_charts() {
        assert_eq!((charted(2.0, 3.0), charted(2.0, 0.0), charted(-2.0, 3.0)), (6.0, 0.0, 0.0));
        assert_eq!(
            (charted(f64::INFINITY, 1.0), charted(f64::NAN, 1.0), charted(-2.0, -3.0)),
            (0.0, 0.0, 6.0)
        );
    }

    /// Gauss' two points integrate cubics, panel by panel, between knots if they are few.
    #[test]
    fn points_along_an_axis() {
        let cell = Cell { patches: 0..1, low: [0.25, 0.5], high: [0.75, 1.0] };
        let knots = |axis: usize, all: Vec<f64>| {
            let mut knots = Knots::default();
            knots.axes[axis] = all;
            knots
        };
        let none = Knots::default();
        let sum = |points: &[(f64, f64)], f: &dyn Fn(f64) -> f64| {
            points.iter().map(|(x, w)| w * f(*x)).sum::<f64>()
        };
        for panels in [1, 2, 4] {
            let all = points(&cell, 0, &none, &none, panels);
            assert_eq!(all.len(), 2 * panels);
            all_near(
                &[sum(&all, &|_| 1.0), sum(&all, &|x| x.powi(3))],
                &[0.5, (0.75_f64.powi(4) - 0.25_f64.powi(4)) / 4.0],
            );
        }
        all_near(&[sum(&points(&cell, 1, &none, &none, 1), &|x| x)], &[0.375]);
        // A step at a knot inside is no hindrance; knots on the border are none.
        let step = |x: f64| if x < 0.3 { 1.0 } else { 3.0 };
        let all = points(&cell, 0, &knots(0, vec![0.1, 0.25, 0.3, 0.75]), &none, 1);
        assert_eq!(all.len(), 4);
        all_near(&[sum(&all, &step)], &[0.05 + 1.35]);
        let graded = points(&cell, 0, &knots(0, vec![0.3]), &knots(0, vec![0.25, 0.28, 0.75]), 1);
        assert_eq!(graded.len(), 6);
        all_near(&[sum(&graded, &step)], &[0.05 + 1.35]);
        assert!(graded.windows(2).all(|pair| pair[0].0 < pair[1].0));
        // Of 32 knots inside all are kept, of 33 none.
        let many = |count: usize| {
            points(
                &cell,
                0,
                &knots(0, (1..=count).map(|i| 0.25 + 0.5 * i as f64 / (count + 1) as f64).collect()),
                &none,
                1,
            )
            .len()
        };
        assert_eq!((many(32), many(33)), (66, 2));
    }

    /// Leaves that pilots fill have four panels; along the axis that a line hasn't, nobody looks whether they do.
    #[test]
    fn nodes_of_leaves_on_a_line() {
        let (sampler, extras) =
            (from_fn(Interval::new(0.0, 1.0), |u: f64| u, |_: f64| 1.0), Extras::default());
        let expectation = told::expectation(&sampler.domain(), [told::integral(0.25, 0.0); 4], vec![]);
        let (probe, tally, settings) =
            (Subject::new(&sampler, &extras), Tally::default(), Settings::default());
        let nodes_of = |expectation: &Expectation| {
            Nodes::new(&Case { probe: &probe, expectation, tally: &tally, settings: &settings })
        };
        let nodes = nodes_of(&expectation);
        assert_eq!(nodes.of_leaf, [0..8, 8..16, 16..24, 24..32]);
        all_near(&nodes.raw, &[0.25; 4]);
        // Of a thousand two are enough, where there is no table.
        let pilot = |i: usize| Location { patch: 0, at: [(i as f64 + 0.5) / 4096.0, 0.0] };
        let leaves = vec![told::integral(1.0 / 1024.0, 0.0); 1024];
        let pilots = (0..4096).map(pilot).collect();
        let partition = Partition::from_pilots(&sampler.domain(), pilots, &Knots::default(), 4);
        let nodes = nodes_of(&Expectation { partition, leaves, ..expectation });
        assert_eq!((nodes.of_leaf.len(), nodes.nodes.len()), (1024, 4 * 1024));
    }

    /// Two leaves of two nodes each, one of them without density; and a third that no node shows.
    fn nodes() -> Nodes {
        let node = |patch: usize, density: f64| Node {
            location: Location { patch, at: [0.0; 2] },
            weight: 0.5,
            density,
            jacobian: 2.0,
        };
        let mut nodes = Nodes {
            nodes: vec![node(0, 1.0), node(0, 3.0), node(1, 0.0), node(1, 2.0), node(2, 0.0), node(2, 0.0)],
            of_leaf: vec![0..2, 2..4, 4..6],
            claimed: vec![5.0, 1.0, 0.5],
            raw: vec![],
        };
        nodes.raw = nodes.sums(&|node| node.chart_density());
        nodes
    }

    #[test]
    fn masses_of_leaves() {
        let nodes = nodes();
        all_near(&nodes.raw, &[4.0, 2.0, 0.0]);
        // The claimed density has the claimed masses.
        all_near(&nodes.masses(&|node| node.chart_density()), &[5.0, 1.0, 0.5]);
        // Twice as much of all has twice of them, what no node has seen included.
        all_near(&nodes.masses(&|node| 2.0 * node.chart_density()), &[10.0, 2.0, 1.0]);
        // Twice as much in the first leaf: of those that are seen 11 for 6.
        all_near(
            &nodes.masses(&|node| node.chart_density() * if node.location.patch == 0 { 2.0 } else { 1.0 }),
            &[10.0, 1.0, 0.5 * 11.0 / 6.0],
        );
        // Where the support is another the nodes are all there is: no ratio to the claimed mass.
        all_near(&nodes.masses(&|_| 3.0), &[5.0 * 3.0 / 4.0, 3.0, 3.0]);
        all_near(
            &nodes.masses(&|node| if node.location.patch == 0 { 1.0 } else { 0.0 }),
            &[5.0 / 4.0, 0.0, 0.5 / 4.0],
        );
        // Also where it is another one at every node: what is seen has then seven tenths.
        all_near(
            &nodes.masses_by_index(&|i| [1.4, 4.2, 1.0, 0.0, 0.0, 0.0][i]),
            &[5.0 * 1.4 / 2.0, 0.5, 0.5 * 1.4 / 2.0],
        );
        all_near(
            &nodes.masses_by_index(&|i| [1.0, f64::NAN, 0.0, 8.0, f64::INFINITY, -1.0][i]),
            &[0.5, 2.0, 1.0],
        );
        all_near(&nodes.masses_by_index(&|_| 0.0), &[0.0, 0.0, 0.0]);
        let weighted: Vec<f64> = nodes.weighted().map(|(_, mass)| mass).collect();
        all_near(&weighted, &[1.25, 3.75, 0.0, 1.0, 0.0, 0.0]);
        let (masses, measures) = nodes.by_class(2, &|l| usize::from(l.patch > 0));
        all_near(&masses, &[5.0, 1.0]);
        all_near(&measures, &[2.0, 4.0]);
    }
}
