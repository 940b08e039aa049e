//! Cells chosen by where the mass is: a k-d tree over (patch, chart coordinates), cut at the medians of pilot samples.
//!
//! A fixed grid either misses a peak or wastes its cells on the sky. Here every leaf holds about the same number
//! of pilots, so a lobe a thousandth of a radian wide gets as many cells as the rest of the sphere. The pilots
//! must not be the samples that are judged later: cells that depend on the data bias a test.

use super::{Location, Space};
use std::ops::Range;

/// A rectangle of one patch's chart, or a run of whole patches.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// The patches; more than one only where the rectangle is the whole chart.
    pub patches: Range<usize>,
    /// Lower chart coordinates.
    pub low: [f64; 2],
    /// Upper chart coordinates.
    pub high: [f64; 2],
}

impl Cell {
    /// The whole of a domain.
    pub fn whole(space: &dyn Space) -> Self {
        Self { patches: 0..space.patches(), low: [0.0; 2], high: [1.0; 2] }
    }
}

/// Chart coordinates across which a density may jump, per axis, ascending, inside (0, 1); the same on every patch.
/// Quadrature and cells keep to these lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Knots {
    /// Coordinates along each axis.
    pub axes: [Vec<f64>; 2],
}

impl Knots {
    /// Both sets of lines.
    pub fn merged(&self, other: &Self) -> Self {
        let merge = |axis: usize| {
            let mut all = [self.axes[axis].as_slice(), &other.axes[axis]].concat();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        };
        Self { axes: [merge(0), merge(1)] }
    }

    /// The knots of a density that is smooth on each texel of a `columns` (axis 1) x `rows` (axis 0) grid.
    pub fn grid(rows: usize, columns: usize) -> Self {
        let ticks = |n: usize| (1..n).map(|i| i as f64 / n as f64).collect();
        Self { axes: [ticks(rows), ticks(columns)] }
    }

    /// Rows and columns, if they are the lines of a [grid](Self::grid).
    fn even_grid(&self) -> Option<[usize; 2]> {
        let counts = [0, 1].map(|axis| self.axes[axis].len() + 1);
        (*self == Self::grid(counts[0], counts[1])).then_some(counts)
    }

    /// Rows and columns of texels, or of blocks of them as large as leaves no more than [`TEXELS`], or four times as many where sides can't be halved so
    /// far, if these are the lines of a grid.
    fn blocks(&self) -> Option<[usize; 2]> {
        let mut sides = self.even_grid()?;
        while sides[0] * sides[1] > TEXELS {
            let longer = usize::from(sides[1] > sides[0]);
            let Some(axis) = [longer, 1 - longer].into_iter().find(|&axis| sides[axis] % 2 == 0) else {
                return (sides[0] * sides[1] <= 4 * TEXELS).then_some(sides);
            };
            sides[axis] /= 2;
        }
        Some(sides)
    }

    /// Those strictly between `low` and `high`.
    pub(super) fn between(&self, axis: usize, low: f64, high: f64) -> &[f64] {
        let knots = &self.axes[axis];
        let start = knots.partition_point(|&k| k <= low);
        let end = knots.partition_point(|&k| k < high);
        &knots[start.min(end)..end]
    }
}

#[derive(Clone, Debug)]
struct Node {
    cell: Cell,
    /// Left child; the right one follows it. `None` at a leaf.
    children: Option<usize>,
    /// What the split compares: 0 the patch, 1 and 2 the chart axes.
    axis: usize,
    threshold: f64,
    /// Leaves below, as a range: children are numbered so that every node's leaves are contiguous.
    leaves: Range<usize>,
}

/// A node as the search for a leaf needs it, small enough for the cache.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// At a leaf, its number.
    threshold: f64,
    /// Left child, the right one follows; a leaf leads back to itself.
    next: u32,
    /// As in [`Node`]; [`LEAF`] at a leaf.
    axis: u32,
}

const LEAF: u32 = 3;
/// Locations that go down the tree side by side: each waits for memory at every node, and all wait at once.
const ABREAST: usize = 8;

impl Step {
    #[inline]
    fn child(self, coordinates: &[f64; 4]) -> usize {
        let right = coordinates[(self.axis & 3) as usize] >= self.threshold;
        self.next as usize + usize::from(right)
    }
}

/// Patch and chart coordinates by axis; nothing is as low as the last one, so that a leaf always leads to itself.
#[inline]
fn coordinates(location: &Location) -> [f64; 4] {
    [location.patch as f64, location.at[0], location.at[1], f64::NEG_INFINITY]
}

/// Where the search for a leaf may begin: the node that holds all of a patch, or all of a square of a grid over the chart of the only patch.
#[derive(Clone, Debug)]
struct Guide {
    nodes: Vec<u32>,
    /// Squares along each axis.
    sides: [u32; 2],
    /// The borders between squares, where these are no powers of two, so that in which square a coordinate lies is a matter of rounding; beyond the
    /// ends there is nothing.
    borders: [Vec<f64>; 2],
}

/// Patches up to which each is given where to begin.
const GUIDED_PATCHES: usize = 1 << 20;
/// Squares, at most, and for each leaf; they cost little and spare a peak's samples nothing, all others nearly the whole way down.
const SQUARES: usize = 1 << 17;
const SQUARES_PER_LEAF: usize = 4;
/// Texels, or blocks of them, for each of which there is a square: cells keep to the lines between them, so that hardly a search goes on from there.
const TEXELS: usize = 1 << 18;

impl Guide {
    fn new(sides: [u32; 2]) -> Self {
        let borders = sides.map(|side| {
            let border = |k: u32| match k {
                0 => f64::NEG_INFINITY,
                _ if k == side => f64::INFINITY,
                _ => f64::from(k) / f64::from(side),
            };
            if side.is_power_of_two() { Vec::new() } else { (0..=side).map(border).collect() }
        });
        Self { nodes: vec![0; sides[0] as usize * sides[1] as usize], sides, borders }
    }

    #[inline]
    fn start(&self, location: &Location) -> usize {
        let along = |axis: usize| {
            let (x, side, borders) = (location.at[axis], self.sides[axis], &self.borders[axis]);
            // 1 itself lies in the last square.
            let square = ((x * f64::from(side)) as i64 as usize).min(side as usize - 1);
            if borders.is_empty() {
                return square;
            }
            square + usize::from(x >= borders[square + 1]) - usize::from(x < borders[square])
        };
        let square =
            if self.sides == [1, 1] { location.patch } else { along(0) * self.sides[1] as usize + along(1) };
        self.nodes[square] as usize
    }
}

/// Where no square can be named.
pub(crate) const NO_SQUARE: u32 = u32::MAX;

/// Squares that each lie in one leaf: for most places no more has to be known than their square.
#[derive(Clone, Debug)]
pub(crate) struct Squares {
    /// Squares along each axis.
    pub sides: [usize; 2],
}

impl Squares {
    /// The squares, row after row, that places known to within `error` lie in; [`NO_SQUARE`] where that leaves a doubt.
    pub fn find(&self, places: &[Vec<f32>; 2], error: f32, out: &mut Vec<u32>) {
        const LANES: usize = 16;
        // Adding 1.5 2^23 rounds to an integer and leaves it in the lower bits.
        const ROUND: f32 = 12_582_912.0;
        const BITS: u32 = (1 << 22) - 1;
        // A number of a square is rounded nowhere.
        debug_assert!(self.sides[0] * self.sides[1] <= BITS as usize);
        out.clear();
        let sides = self.sides.map(|side| side as f32);
        // What is cut into one has no borders. Products and sums are rounded too.
        let reach = sides.map(|side| match side {
            1.0 => f32::INFINITY,
            side => 0.5 - (error + 2.0 * f32::EPSILON) * side,
        });
        let squares = |a: &[f32; LANES], b: &[f32; LANES]| {
            let mut squares = [0; LANES];
            for i in 0..LANES {
                let (s, t) = (a[i] * sides[0] - 0.5, b[i] * sides[1] - 0.5);
                let (row, column) = ((s + ROUND) - ROUND, (t + ROUND) - ROUND);
                let is_sure = ((s - row).abs() < reach[0]) & ((t - column).abs() < reach[1]);
                let is_inside = (row >= 0.0) & (row < sides[0]) & (column >= 0.0) & (column < sides[1]);
                // What is neither sure nor inside may be any number.
                let square = (row * sides[1] + column) + ROUND;
                squares[i] = if is_sure & is_inside { square.to_bits() & BITS } else { NO_SQUARE };
            }
            squares
        };
        let [(a, a_rest), (b, b_rest)] = [0, 1].map(|axis| places[axis].as_chunks::<LANES>());
        a.iter().zip(b).for_each(|(a, b)| out.extend_from_slice(&squares(a, b)));
        let (mut a, mut b) = ([f32::NAN; LANES], [f32::NAN; LANES]);
        a[..a_rest.len()].copy_from_slice(a_rest);
        b[..b_rest.len()].copy_from_slice(b_rest);
        out.extend_from_slice(&squares(&a, &b)[..a_rest.len()]);
    }
}

/// A partition of a domain into leaf cells, and the tree over them.
#[derive(Clone, Debug)]
pub struct Partition {
    nodes: Vec<Node>,
    steps: Vec<Step>,
    guide: Option<Guide>,
    leaves: Vec<Cell>,
    /// The box that each leaf's pilots span, `None` without any or over several patches.
    pilot_boxes: Vec<Option<[[f64; 2]; 2]>>,
}

/// A coarser partition: which group each leaf falls into.
#[derive(Clone, Debug)]
pub struct Groups {
    /// The group of each leaf; `None` where the leaf is in the pool of light cells.
    pub of_leaf: Vec<Option<usize>>,
    /// The cell that each group covers.
    pub cells: Vec<Cell>,
}

const DEPTH_LIMIT: usize = 96;

impl Partition {
    /// Cuts `domain` so that each leaf holds at most `per_leaf` of the pilots, as far as atoms allow.
    pub fn from_pilots(space: &dyn Space, pilots: Vec<Location>, knots: &Knots, per_leaf: usize) -> Self {
        let blocks = knots.blocks().map_or_else(Knots::default, |[rows, columns]| Knots::grid(rows, columns));
        let mut whole = Self::cut(space, Cell::whole(space), pilots, [knots, &blocks], per_leaf);
        whole.guide = Some(whole.guide_of(space, knots));
        whole
    }

    /// Cuts one cell of `domain` likewise; all pilots must lie in it.
    pub fn within(
        space: &dyn Space,
        cell: Cell,
        pilots: Vec<Location>,
        knots: &Knots,
        per_leaf: usize,
    ) -> Self {
        Self::cut(space, cell, pilots, [knots, &Knots::default()], per_leaf)
    }

    /// The same, where it may along the second of two sets of lines.
    fn cut(
        space: &dyn Space,
        cell: Cell,
        mut pilots: Vec<Location>,
        knots: [&Knots; 2],
        per_leaf: usize,
    ) -> Self {
        let root = Node { cell, children: None, axis: 0, threshold: 0.0, leaves: 0..0 };
        let mut tree = Self {
            nodes: vec![root],
            steps: Vec::new(),
            guide: None,
            leaves: Vec::new(),
            pilot_boxes: Vec::new(),
        };
        tree.grow(space, 0, &mut pilots, knots, per_leaf.max(1), 0);
        let step = |(index, node): (usize, &Node)| match node.children {
            Some(left) => Step { threshold: node.threshold, next: left as u32, axis: node.axis as u32 },
            None => Step { threshold: node.leaves.start as f64, next: index as u32, axis: LEAF },
        };
        tree.steps = tree.nodes.iter().enumerate().map(step).collect();
        tree
    }

    /// Finds where each search may begin.
    fn guide_of(&self, space: &dyn Space, knots: &Knots) -> Guide {
        if space.patches() > 1 {
            let patches = space.patches().min(GUIDED_PATCHES);
            let nodes = (0..patches).map(|patch| self.topmost_of_patch(patch)).collect();
            return Guide { nodes, ..Guide::new([1; 2]) };
        }
        let squares = (SQUARES_PER_LEAF * self.leaves.len()).min(SQUARES).next_power_of_two();
        let bits = squares.ilog2();
        let mut sides = match space.axes() {
            0 => [1, 1],
            1 => [1 << bits, 1],
            _ => [1 << (bits / 2), 1 << (bits - bits / 2)],
        };
        if let Some(blocks) = knots.blocks().filter(|[a, b]| a * b > 1) {
            sides = blocks.map(|n| n as u32);
            while 2 * sides[0] as usize * sides[1] as usize <= squares {
                // Along the axis of longer squares; an axis without texels has no length.
                let axis = usize::from(space.axes() > 1 && sides[1] < sides[0]);
                sides[axis] *= 2;
            }
        }
        let mut guide = Guide::new(sides);
        self.guide_squares(&mut guide, 0, [0; 2], sides.map(|side| side as usize));
        guide
    }

    /// The squares of a domain of one patch, and the leaf that each lies in, row after row along the second axis; `None` if it is cut.
    pub(crate) fn squares(&self) -> Option<(Squares, Vec<Option<usize>>)> {
        let guide = self.guide.as_ref().filter(|guide| guide.sides != [1, 1])?;
        let leaf = |&node: &u32| {
            let node = &self.nodes[node as usize];
            node.children.is_none().then_some(node.leaves.start)
        };
        let sides = guide.sides.map(|side| side as usize);
        Some((Squares { sides }, guide.nodes.iter().map(leaf).collect()))
    }

    /// The lowest node that holds all of a patch, if it is cut by patches down to there.
    fn topmost_of_patch(&self, patch: usize) -> u32 {
        let mut node = 0;
        while let (Some(left), 0) = (self.nodes[node].children, self.nodes[node].axis) {
            node = left + usize::from(patch as f64 >= self.nodes[node].threshold);
        }
        node as u32
    }

    /// Notes the lowest node that holds each square of the block of so many squares from `first` on, all of which `node` holds.
    fn guide_squares(&self, guide: &mut Guide, mut node: usize, first: [usize; 2], count: [usize; 2]) {
        let sides = guide.sides;
        while let Some(left) = self.nodes[node].children {
            let (axis, threshold) = (self.nodes[node].axis - 1, self.nodes[node].threshold);
            let [low, high] =
                [first[axis], first[axis] + count[axis]].map(|k| k as f64 / f64::from(sides[axis]));
            if high <= threshold {
                node = left;
            } else if low >= threshold {
                node = left + 1;
            } else {
                break;
            }
        }
        let longer = usize::from(count[1] > count[0]);
        if self.nodes[node].children.is_none() || count == [1, 1] {
            for a in first[0]..first[0] + count[0] {
                let row = a * sides[1] as usize + first[1];
                guide.nodes[row..row + count[1]].fill(node as u32);
            }
            return;
        }
        let (mut half, mut second, mut rest) = (count, first, count);
        half[longer] /= 2;
        second[longer] += half[longer];
        rest[longer] -= half[longer];
        self.guide_squares(guide, node, first, half);
        self.guide_squares(guide, node, second, rest);
    }

    fn grow(
        &mut self,
        space: &dyn Space,
        node: usize,
        pilots: &mut [Location],
        knots: [&Knots; 2],
        per_leaf: usize,
        depth: usize,
    ) {
        let first_leaf = self.leaves.len();
        let cell = self.nodes[node].cell.clone();
        let split = if pilots.len() > per_leaf && depth < DEPTH_LIMIT {
            choose_split(space, &cell, pilots, knots)
        } else {
            None
        };
        match split {
            None => {
                self.pilot_boxes.push(if cell.patches.len() == 1 { bounding_box(pilots) } else { None });
                self.leaves.push(cell);
            }
            Some((axis, threshold)) => {
                let below = partition_in_place(pilots, |p| coordinate(p, axis) < threshold);
                let left = self.nodes.len();
                let (low, high) = cell.split(axis, threshold);
                for cell in [low, high] {
                    self.nodes.push(Node { cell, children: None, axis: 0, threshold: 0.0, leaves: 0..0 });
                }
                let (a, b) = pilots.split_at_mut(below);
                self.grow(space, left, a, knots, per_leaf, depth + 1);
                self.grow(space, left + 1, b, knots, per_leaf, depth + 1);
                let node = &mut self.nodes[node];
                (node.children, node.axis, node.threshold) = (Some(left), axis, threshold);
            }
        }
        self.nodes[node].leaves = first_leaf..self.leaves.len();
    }

    /// The leaf cells; a leaf is named by its index here.
    pub fn leaves(&self) -> &[Cell] {
        &self.leaves
    }

    /// The box that a leaf's pilots span, along the axes of the chart: lows and highs. `None` without pilots, or over several patches.
    pub(crate) fn pilot_box(&self, leaf: usize) -> Option<[[f64; 2]; 2]> {
        self.pilot_boxes[leaf]
    }

    /// Where quadrature over a leaf should cut first: at distances from its pilots that double, as far as the leaf is much larger than
    /// the box that they span. So a cell at the edge of a light or a lobe, nearly all of it empty, is looked at where the mass is.
    pub fn grading(&self, leaf: usize) -> Knots {
        let mut cuts = Knots::default();
        let Some([low, high]) = self.pilot_boxes[leaf] else { return cuts };
        let cell = &self.leaves[leaf];
        for axis in 0..2 {
            let size = cell.high[axis] - cell.low[axis];
            let step = (high[axis] - low[axis]).max(1e-6 * size);
            let graded = |room: f64| {
                let steps = std::iter::successors(Some(step), |d| Some(3.0 * d + step));
                steps.take_while(move |d| room > 2.0 * step && 1.5 * d < room).collect::<Vec<_>>()
            };
            cuts.axes[axis].extend(graded(low[axis] - cell.low[axis]).iter().rev().map(|d| low[axis] - d));
            cuts.axes[axis].extend(graded(cell.high[axis] - high[axis]).iter().map(|d| high[axis] + d));
        }
        cuts
    }

    /// Every cell of the tree, from the whole domain down to the leaves, with the leaves that it holds.
    pub fn nodes(&self) -> impl Iterator<Item = (&Cell, Range<usize>)> {
        self.nodes.iter().map(|node| (&node.cell, node.leaves.clone()))
    }

    /// The leaf that holds a location.
    #[inline]
    pub fn leaf_of(&self, location: &Location) -> usize {
        let coordinates = coordinates(location);
        let mut node = self.start(location);
        while self.steps[node].axis != LEAF {
            node = self.steps[node].child(&coordinates);
        }
        self.steps[node].threshold as usize
    }

    #[inline]
    fn start(&self, location: &Location) -> usize {
        match &self.guide {
            Some(guide) if location.patch < GUIDED_PATCHES => guide.start(location),
            _ => 0,
        }
    }

    /// The leaves that hold some locations, in their order.
    pub fn leaves_of<'a>(
        &self,
        locations: impl ExactSizeIterator<Item = &'a Location> + Clone,
        out: &mut Vec<usize>,
    ) {
        out.clear();
        let mut rest = locations;
        while rest.len() >= ABREAST {
            let mut nodes = [0; ABREAST];
            let all: [[f64; 4]; ABREAST] = std::array::from_fn(|i| {
                rest.next().map_or([0.0; 4], |location| {
                    nodes[i] = self.start(location);
                    coordinates(location)
                })
            });
            loop {
                let mut inner = false;
                for (node, coordinates) in nodes.iter_mut().zip(&all) {
                    let step = self.steps[*node];
                    inner |= step.axis != LEAF;
                    *node = step.child(coordinates);
                }
                if !inner {
                    break;
                }
            }
            out.extend(nodes.map(|node| self.steps[node].threshold as usize));
        }
        out.extend(rest.map(|location| self.leaf_of(location)));
    }

    /// The coarser partition whose cells are the topmost nodes of at most `target` mass; whatever weighs less
    /// than `floor` goes to the pool instead. What has no finite mass is not cut: no cut would make it lighter.
    pub fn group(&self, leaf_mass: &[f64], target: f64, floor: f64) -> Groups {
        let mut groups = Groups { of_leaf: vec![None; self.leaves.len()], cells: Vec::new() };
        let masses = self.node_masses(leaf_mass);
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index];
            if masses[index] < floor {
                continue;
            }
            match node.children {
                // A node both of whose halves are light is itself the cell.
                Some(left)
                    if masses[index] > target
                        && masses[index].is_finite()
                        && (masses[left] >= floor || masses[left + 1] >= floor) =>
                {
                    stack.extend([left + 1, left]);
                }
                _ => {
                    for leaf in node.leaves.clone() {
                        groups.of_leaf[leaf] = Some(groups.cells.len());
                    }
                    groups.cells.push(node.cell.clone());
                }
            }
        }
        groups
    }

    fn node_masses(&self, leaf_mass: &[f64]) -> Vec<f64> {
        // Children come after their parents, so one sweep from the back sums bottom-up.
        let mut masses = vec![0.0; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate().rev() {
            masses[index] = match node.children {
                Some(left) => masses[left] + masses[left + 1],
                None => leaf_mass[node.leaves.start],
            };
        }
        masses
    }
}

fn bounding_box(pilots: &[Location]) -> Option<[[f64; 2]; 2]> {
    let extreme = |start: f64, pick: fn(f64, f64) -> f64| {
        [0, 1].map(|axis| pilots.iter().map(|p| p.at[axis]).fold(start, pick))
    };
    (!pilots.is_empty()).then(|| [extreme(f64::INFINITY, f64::min), extreme(f64::NEG_INFINITY, f64::max)])
}

impl Cell {
    fn split(&self, axis: usize, threshold: f64) -> (Self, Self) {
        let (mut low, mut high) = (self.clone(), self.clone());
        if axis == 0 {
            low.patches.end = threshold as usize;
            high.patches.start = threshold as usize;
        } else {
            low.high[axis - 1] = threshold;
            high.low[axis - 1] = threshold;
        }
        (low, high)
    }
}

#[inline]
fn coordinate(location: &Location, axis: usize) -> f64 {
    match axis {
        0 => location.patch as f64,
        _ => location.at[axis - 1],
    }
}

/// Moves what satisfies `predicate` to the front and counts it.
fn partition_in_place(pilots: &mut [Location], predicate: impl Fn(&Location) -> bool) -> usize {
    let mut front = 0;
    for i in 0..pilots.len() {
        if predicate(&pilots[i]) {
            pilots.swap(front, i);
            front += 1;
        }
    }
    front
}

fn choose_split(
    space: &dyn Space,
    cell: &Cell,
    pilots: &mut [Location],
    [knots, blocks]: [&Knots; 2],
) -> Option<(usize, f64)> {
    if cell.patches.end - cell.patches.start > 1 {
        let middle = pilots.len() / 2;
        pilots.select_nth_unstable_by_key(middle, |p| p.patch);
        let median = pilots[middle].patch;
        // Put the median patch on the side that leaves the halves more even.
        let below = pilots.iter().filter(|p| p.patch < median).count();
        let through = pilots.iter().filter(|p| p.patch <= median).count();
        let threshold = if below.abs_diff(middle) <= through.abs_diff(middle) { median } else { median + 1 };
        return Some((0, threshold.clamp(cell.patches.start + 1, cell.patches.end - 1) as f64));
    }
    if space.is_atom(cell.patches.start) {
        return None; // all of its samples lie at one place of its chart
    }
    if let Some(split) = (0..space.axes()).find_map(|axis| middle_of_gap(cell, pilots, axis)) {
        return Some(split);
    }
    let mut candidates: Vec<(f64, usize, [f64; 3])> = (0..space.axes())
        .map(|axis| {
            let (near, middle, far) =
                (pilots.len() / 8, pilots.len() / 2, pilots.len() - 1 - pilots.len() / 8);
            let mut rank = |k: usize| {
                pilots.select_nth_unstable_by(k, |a, b| a.at[axis].total_cmp(&b.at[axis])).1.at[axis]
            };
            let (low, median, high) = (rank(near), rank(middle), rank(far));
            let (mut a, mut b) = (cell.low, cell.high);
            (a[axis], b[axis]) = (low, high);
            (space.extent(a, b)[axis], axis, [low, median, high])
        })
        .collect();
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
    candidates.into_iter().find_map(|(_, axis, [near, median, far])| {
        let (low, high) = (cell.low[axis], cell.high[axis]);
        let inside = knots.between(axis, low, high);
        // Between blocks, if that leaves an eighth of the pilots on either side.
        let block = Some(blocks.between(axis, low, high)).filter(|inside| !inside.is_empty());
        let block = block.map(|inside| nearest(median, inside)).filter(|&x| near < x && x <= far);
        let knot = || if inside.is_empty() { median } else { nearest(median, inside) };
        let threshold = block.unwrap_or_else(knot);
        (threshold > low && threshold < high && high - low > 1e-13).then_some((axis + 1, threshold))
    })
}

/// A cut through the middle of the widest stretch without pilots, if that is half of the cell or more: two clusters (two lamps, or a lobe
/// across the seam of the chart) want cells of their own.
fn middle_of_gap(cell: &Cell, pilots: &[Location], axis: usize) -> Option<(usize, f64)> {
    const BINS: usize = 16;
    let (low, size) = (cell.low[axis], cell.high[axis] - cell.low[axis]);
    let mut ends = [(f64::INFINITY, f64::NEG_INFINITY); BINS];
    for pilot in pilots {
        let x = pilot.at[axis];
        let (least, greatest) = &mut ends[(((x - low) / size * BINS as f64) as usize).min(BINS - 1)];
        (*least, *greatest) = (least.min(x), greatest.max(x));
    }
    let filled = || ends.iter().filter(|(least, greatest)| least <= greatest);
    let (width, middle) = filled()
        .zip(filled().skip(1))
        .map(|(a, b)| (b.0 - a.1, 0.5 * (a.1 + b.0)))
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    (width >= 0.5 * size && middle > low && middle < cell.high[axis]).then_some((axis + 1, middle))
}

/// The knot nearest to `x`.
pub(crate) fn nearest(x: f64, knots: &[f64]) -> f64 {
    let after = knots.partition_point(|&k| k < x);
    [after.checked_sub(1), Some(after)]
        .into_iter()
        .flatten()
        .filter_map(|i| knots.get(i))
        .copied()
        .min_by(|a, b| (a - x).abs().total_cmp(&(b - x).abs()))
        .unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Discrete, Square};

    #[test]
    fn the_guide_leads_to_the_leaf_that_the_root_leads_to() {
        let peaked =
            |i: usize| Location { patch: 0, at: [(i as f64 / 4e3).powi(9), (i as f64 * 0.37) % 1.0] };
        let triangles =
            |i: usize| Location { patch: i % 37, at: [(i as f64 * 0.61) % 1.0, (i as f64 * 0.37) % 1.0] };
        let ring = Discrete::new(40);
        let on_a_line = |i: usize| Location { at: [peaked(i).at[0], 0.0], ..peaked(i) };
        let line = crate::domain::Interval::new(0.0, 1.0);
        let cases: [(&dyn Space, Vec<Location>, Knots); 9] = [
            (&Square, (0..4000).map(peaked).collect(), Knots::default()),
            (&Square, (0..4000).map(peaked).collect(), Knots::grid(3, 7)),
            (&Square, (0..4000).map(peaked).collect(), Knots::grid(200, 49)),
            (&Square, (0..4000).map(peaked).collect(), Knots::grid(1500, 900)),
            (&Square, (0..4000).map(peaked).collect(), Knots::grid(1, 1000)),
            (&crate::domain::Sphere, (0..4000).map(peaked).collect(), Knots::default()),
            (&crate::domain::Sphere, (0..4000).map(peaked).collect(), Knots::grid(64, 128)),
            (&line, (0..4000).map(on_a_line).collect(), Knots::grid(300, 1)),
            (&ring, (0..4000).map(triangles).collect(), Knots::default()),
        ];
        for (space, mut places, knots) in cases {
            let partition = Partition::from_pilots(space, places.clone(), &knots, 4);
            // On the lines and a rounding beside them.
            let beside = |x: &f64| [x * (1.0 - f64::EPSILON), *x, x * (1.0 + f64::EPSILON)];
            let along = |axis: usize| knots.axes[axis].iter().flat_map(beside).collect::<Vec<_>>();
            places.extend(along(0).iter().map(|&x| Location { patch: 0, at: [x, 0.0] }));
            places.extend(along(1).iter().map(|&y| Location { patch: 0, at: [0.75, y] }));
            places.extend(
                [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.5, 0.5], [0.25, 1.0 - 1e-16]]
                    .map(|at| Location { patch: 0, at }),
            );
            for place in &places {
                let coordinates = coordinates(place);
                let mut node = 0;
                while partition.steps[node].axis != LEAF {
                    node = partition.steps[node].child(&coordinates);
                }
                assert_eq!(partition.leaf_of(place), partition.nodes[node].leaves.start, "{place:?}");
            }
            let mut all = Vec::new();
            partition.leaves_of(places.iter(), &mut all);
            assert!(places.iter().zip(all).all(|(place, leaf)| partition.leaf_of(place) == leaf));
        }
    }

    /// Squares are named where a place is sure to be in them, and lie in the leaf that all of their places lie in.
    #[test]
    fn squares_of_rough_places() {
        let pilots: Vec<Location> = (0..4000)
            .map(|i| Location { patch: 0, at: [(i as f64 / 4e3).powi(3), (i as f64 * 0.381_966) % 1.0] })
            .collect();
        for knots in [Knots::default(), Knots::grid(20, 30), Knots::grid(200, 300), Knots::grid(2048, 1024)] {
            let partition = Partition::from_pilots(&Square, pilots.clone(), &knots, 4);
            let (squares, leaves) = partition.squares().unwrap();
            let [rows, columns] = squares.sides;
            let (error, mut found, mut sure) = (1e-5_f32, Vec::new(), 0);
            // As far off as they may be, to all sides.
            let mut places: Vec<[f64; 2]> = pilots.iter().map(|p| p.at).collect();
            places.extend([[1.0, 0.5], [0.5, 1.0], [0.0; 2]]);
            let off = |i: usize, x: f64, bit: usize| (x + if i & bit == 0 { 9e-6 } else { -9e-6 }) as f32;
            let odd = [[f32::NAN, 0.5], [0.5, f32::NAN], [1.1, 0.3], [-1e-3, 0.2], [f32::MAX, -f32::MAX]];
            let rough = [0, 1].map(|axis| {
                let ours = places.iter().enumerate().map(|(i, at)| off(i, at[axis], 1 << axis));
                ours.chain(odd.iter().map(|at| at[axis])).collect::<Vec<_>>()
            });
            squares.find(&rough, error, &mut found);
            assert_eq!(found.len(), rough[0].len());
            assert_eq!(found[places.len()..], [NO_SQUARE; 5]);
            for (at, square) in places.iter().zip(found) {
                let inside = |x: f64, n: usize| {
                    let part = (x * n as f64).fract();
                    part > 2.5e-5 * n as f64 && part < 1.0 - 2.5e-5 * n as f64
                };
                if square == NO_SQUARE {
                    assert!(!(inside(at[0], rows) && inside(at[1], columns)), "{at:?}");
                    continue;
                }
                let [row, column] = [(at[0] * rows as f64) as usize, (at[1] * columns as f64) as usize];
                assert_eq!(square as usize, row * columns + column, "{at:?}");
                if let Some(leaf) = leaves[square as usize] {
                    sure += 1;
                    assert_eq!(partition.leaf_of(&Location { patch: 0, at: *at }), leaf);
                }
            }
            assert!(sure > 500, "{sure}");
        }
        // Across a line there are no borders.
        let line = crate::domain::Interval::new(0.0, 1.0);
        let on_it = (0..400).map(|i| Location { patch: 0, at: [f64::from(i) / 400.0, 0.0] }).collect();
        let (squares, _) = Partition::from_pilots(&line, on_it, &Knots::grid(10, 1), 40).squares().unwrap();
        let mut found = Vec::new();
        squares.find(&[vec![0.06, 0.1, 0.96], vec![0.0; 3]], 1e-6, &mut found);
        let side = squares.sides[0] as f32;
        assert_eq!(found, [(0.06 * side) as u32, NO_SQUARE, (0.96 * side) as u32]);
        assert!(Partition::from_pilots(&Discrete::new(4), vec![], &Knots::default(), 4).squares().is_none());
    }
}
