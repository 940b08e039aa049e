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
            let graded = grading.axes.iter().any(|cuts| !cuts.is_empty());
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
