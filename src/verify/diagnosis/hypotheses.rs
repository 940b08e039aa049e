//! The mistakes that are known, as densities.

use super::counts::Counts;
use super::nodes::{Node, Nodes, charted};
use crate::domain::{Confusion, Keeps, Location, Space};
use crate::verify::check::Case;
use glam::DVec3;
use std::f64::consts::PI;

/// What a mistake makes of the claimed density.
pub(super) struct Hypothesis {
    pub name: String,
    /// A sentence without its full stop.
    pub text: String,
    /// How many parameters were fitted to the counts.
    pub parameters: u32,
    /// Masses of the cells, summing to 1.
    pub shape: Vec<f64>,
    /// What they summed to before, where that means something.
    pub integral: Option<f64>,
}

/// Collects hypotheses about one case.
struct Collector<'a> {
    case: &'a Case<'a>,
    nodes: &'a Nodes,
    counts: &'a Counts,
    all: Vec<Hypothesis>,
}

/// All of them, the plainer ones first.
pub(super) fn all(case: &Case<'_>, nodes: &Nodes, counts: &Counts) -> Vec<Hypothesis> {
    let mut c = Collector { case, nodes, counts, all: Vec::new() };
    c.rivals();
    c.factors();
    c.whole_densities();
    c.confusions();
    c.shifts();
    c.rows();
    c.patches();
    c.power();
    c.steps();
    c.tables();
    c.all.extend(crowd(counts));
    c.all.extend(hole(counts));
    c.all.extend(if c.space().axes() == 0 { moved(counts) } else { None });
    c.all
}

type ChartDensity<'a> = dyn Fn(&Node) -> f64 + 'a;

impl Collector<'_> {
    fn space(&self) -> &dyn Space {
        self.case.probe.space()
    }

    fn push(&mut self, name: String, text: String, chart_density: &ChartDensity<'_>) {
        // What is left out then is asked by nobody.
        if self.case.settings.stopped() {
            return;
        }
        let leaves = self.nodes.masses(chart_density);
        self.push_leaves(name, text, 0, &leaves, true);
    }

    fn push_leaves(&mut self, name: String, text: String, parameters: u32, leaves: &[f64], proper: bool) {
        if let Some(shape) = self.counts.shape(leaves) {
            let integral = proper.then(|| leaves.iter().sum());
            self.all.push(Hypothesis { name, text, parameters, shape, integral });
        }
    }

    /// Densities that the sampler or its user names, and what is between them and the claimed one.
    fn rivals(&mut self) {
        let probe = self.case.probe;
        let Some(first) = self.nodes.nodes.first() else { return };
        let names: Vec<String> = probe
            .rivals_at(first.location.patch, first.location.at)
            .into_iter()
            .map(|(name, _)| name)
            .collect();
        if names.is_empty() {
            return;
        }
        let values: Vec<Vec<f64>> = crate::parallel::map(self.nodes.nodes.len(), |i| {
            let node = &self.nodes.nodes[i];
            let here = probe.rivals_at(node.location.patch, node.location.at);
            here.into_iter().map(|(_, value)| charted(value, node.jacobian)).collect()
        });
        for (k, name) in names.iter().enumerate() {
            let leaves = self.nodes.masses_by_index(&|i| values[i][k]);
            self.push_leaves(
                name.clone(),
                format!("the samples follow another density: {name}"),
                0,
                &leaves,
                false,
            );
            self.all.extend(share(self.counts, name, &leaves));
        }
    }

    /// A factor of the density that the samples lack, or the other way round.
    fn factor(&mut self, name: &str, value: &(dyn Fn(&Location) -> f64 + Sync)) {
        for (power, power_name) in [(1, name.to_owned()), (2, format!("({name})^2"))] {
            let times = move |node: &Node| node.chart_density() * value(&node.location).powi(power);
            self.push(
                format!("lacks {power_name}"),
                format!("the density lacks a factor {power_name}, or the sampler has it once too often"),
                &times,
            );
            let over = move |node: &Node| node.chart_density() / value(&node.location).powi(power);
            self.push(
                format!("extra {power_name}"),
                format!("the density has a factor {power_name} too many, or the sampler lacks it"),
                &over,
            );
        }
    }

    fn factors(&mut self) {
        let rows = &self.case.probe.knots().axes[0];
        for factor in self.space().factors() {
            self.factor(factor.name, &factor.value);
            if !rows.is_empty() {
                // A table weights whole rows by the factor at their centres.
                self.factor(factor.name, &|l| {
                    let row = rows.partition_point(|&k| k <= l.at[0]);
                    let low = if row == 0 { 0.0 } else { rows[row - 1] };
                    let high = rows.get(row).copied().unwrap_or(1.0);
                    (factor.value)(&Location { at: [0.5 * (low + high), l.at[1]], ..*l })
                });
            }
        }
        // A lobe that is not about +Z has its own sine and cosine.
        let mut mean = DVec3::ZERO;
        for (node, mass) in self.nodes.weighted() {
            let Some(w) = self.space().direction(&node.location) else { return };
            mean += mass * w;
        }
        let axis = mean.normalize_or_zero();
        if mean.length() > 0.1 * self.nodes.claimed.iter().sum::<f64>() && axis.z.abs() < 0.999_99 {
            let space = self.case.probe.space_for_keeps();
            let cosine = |l: &Location| space.direction(l).map_or(0.0, |w| w.dot(axis));
            self.factor("sin of the angle to the lobe's axis", &|l| {
                (1.0 - cosine(l).powi(2)).max(0.0).sqrt()
            });
            self.factor("cos of the angle to the lobe's axis", &|l| cosine(l).max(0.0));
        }
    }

    /// The samples follow, wholly or in part, a density that many samplers of this domain have.
    fn whole_densities(&mut self) {
        let uniform = |_: &Location| 1.0;
        let mut densities: Vec<(&str, Box<dyn Fn(&Location) -> f64 + Sync>)> = Vec::new();
        if self.space().measure().is_finite() {
            densities.push(("uniform", Box::new(uniform)));
        }
        for usual in self.space().usual_densities() {
            densities.push((usual.name, Box::new(usual.value)));
        }
        for (name, value) in densities {
            let leaves = self.nodes.masses(&|node| charted(value(&node.location), node.jacobian));
            let text = format!("the samples follow another density: {name}");
            self.push_leaves(name.to_owned(), text, 0, &leaves, false);
            self.all.extend(share(self.counts, name, &leaves));
        }
    }

    /// Points put where others belong.
    fn confusions(&mut self) {
        for confusion in self.space().confusions() {
            let text = format!("{}, in either the sampler or the density", confusion.name);
            self.confusion(&confusion, text);
        }
    }

    fn confusion(&mut self, confusion: &Confusion, text: String) {
        let (probe, nodes) = (self.case.probe, &self.nodes.nodes);
        // Many at a time: what answers may be at the other end of a pipe.
        const BLOCK: usize = 256;
        let block = |block: usize| -> Vec<f64> {
            let nodes = &nodes[block * BLOCK..nodes.len().min((block + 1) * BLOCK)];
            let (mut origins, mut answers, mut counts) = (Vec::new(), Vec::new(), Vec::new());
            for node in nodes {
                let before = origins.len();
                origins.extend((confusion.origins)(&node.location));
                counts.push(origins.len() - before);
            }
            probe.densities_at(&origins, &mut answers);
            let mut answers = answers.into_iter();
            let value = |(node, count): (&Node, usize)| {
                let density = |(density, jacobian): (f64, f64)| {
                    charted(density, if confusion.keeps == Keeps::Chart { jacobian } else { node.jacobian })
                };
                answers.by_ref().take(count).map(density).sum()
            };
            nodes.iter().zip(counts).map(value).collect()
        };
        let values = crate::parallel::map(nodes.len().div_ceil(BLOCK), block).concat();
        let leaves = self.nodes.masses_by_index(&|i| values[i]);
        self.push_leaves(confusion.name.to_owned(), text, 0, &leaves, true);
    }

    /// Tables looked up half a cell or one cell beside where they should be.
    fn shifts(&mut self) {
        let names = self.space().axis_names();
        for (axis, along) in names.into_iter().enumerate().take(self.space().axes()) {
            let Some(count) = even_spacing(&self.case.probe.knots().axes[axis]) else { continue };
            let wraps = self.space().wraps(axis);
            for (cells, words) in [(0.5, "half a cell"), (1.0, "one cell")] {
                for sign in [1.0, -1.0] {
                    let step = sign * cells / count as f64;
                    let origins = move |l: &Location| {
                        let mut from = *l;
                        from.at[axis] -= step;
                        if wraps {
                            from.at[axis] = from.at[axis].rem_euclid(1.0);
                        }
                        if (0.0..=1.0).contains(&from.at[axis]) { vec![from] } else { Vec::new() }
                    };
                    let confusion =
                        Confusion { name: "shift", origins: Box::new(origins), keeps: Keeps::Chart };
                    let text = format!(
                        "samples lie {words} {} along {along} of where the density has them",
                        if sign > 0.0 { "ahead" } else { "behind" }
                    );
                    self.confusion(&confusion, text);
                    if let Some(last) = self.all.last_mut().filter(|h| h.name == "shift") {
                        last.name = format!("{words} off along {along}");
                    }
                }
            }
        }
    }

    /// Rows of a table normalised each on its own.
    fn rows(&mut self) {
        let knots = &self.case.probe.knots().axes[0];
        if knots.is_empty() || self.space().axes() < 2 {
            return;
        }
        let row = |l: &Location| knots.partition_point(|&k| k <= l.at[0]);
        let (masses, measures) = self.nodes.by_class(knots.len() + 1, &row);
        let texts = [
            (
                "rows normalised",
                "rows are normalised each on its own, before they are weighted by their size",
            ),
            ("rows chosen alike", "all rows are chosen with the same probability"),
        ];
        for (weighted, (name, text)) in texts.into_iter().enumerate() {
            let density = |node: &Node| {
                let row = row(&node.location);
                let weight = if weighted == 0 { measures[row] } else { 1.0 };
                node.chart_density() * weight / masses[row]
            };
            self.push(name.to_owned(), text.to_owned(), &density);
        }
    }

    /// The probability with which a patch is selected.
    fn patches(&mut self) {
        let patches = self.space().patches();
        if patches < 2 || self.space().axes() == 0 {
            return;
        }
        let (masses, measures) = self.nodes.by_class(patches, &|l| l.patch);
        let on = |values: &[f64], node: &Node| node.chart_density() * values[node.location.patch];
        let over = |values: &[f64], node: &Node| node.chart_density() / values[node.location.patch];
        self.push(
            "patches chosen alike".to_owned(),
            "all patches are chosen with the same probability, whatever the density says".to_owned(),
            &|node| over(&masses, node),
        );
        self.push(
            "lacks the patch's measure".to_owned(),
            "the density lacks the measure of the patch: it leaves out the probability of selecting one"
                .to_owned(),
            &|node| on(&measures, node),
        );
        self.push(
            "extra patch's measure".to_owned(),
            "the density has the measure of the patch once too often, or the sampler lacks it".to_owned(),
            &|node| over(&measures, node),
        );
        self.push(
            "lacks the selection probability".to_owned(),
            "the density lacks the probability of selecting a patch, or the sampler has it twice".to_owned(),
            &|node| on(&masses, node),
        );
    }

    /// A power of the density: a missing square root, one too many, an exponent that is off.
    fn power(&mut self) {
        let largest =
            self.nodes.nodes.iter().map(|n| n.density).filter(|d| d.is_finite()).fold(0.0, f64::max);
        if !(largest > 0.0) {
            return;
        }
        let leaves = |ln_a: f64| {
            let a = ln_a.exp();
            self.nodes.masses(&move |node| charted((node.density / largest).powf(a), node.jacobian))
        };
        let g =
            |ln_a: f64| self.counts.shape(&leaves(ln_a)).map_or(f64::INFINITY, |shape| self.counts.g(&shape));
        let ln_a = minimise(-2.5, 2.5, 28, &g);
        let a = ln_a.exp();
        let (name, text) = match a {
            a if (a - 2.0).abs() < 0.05 => {
                ("density squared", "the samples follow the square of the density".to_owned())
            }
            a if (a - 0.5).abs() < 0.02 => {
                ("density's square root", "the samples follow the square root of the density".to_owned())
            }
            _ => ("power", format!("an exponent is off: the samples follow the density to the power {a:.4}")),
        };
        let leaves = leaves(ln_a);
        self.push_leaves(name.to_owned(), text, 1, &leaves, false);
    }

    /// One factor before a place, another one behind it.
    fn steps(&mut self) {
        let partition = &self.case.expectation.partition;
        let mut axes: Vec<Option<usize>> = (0..self.space().axes()).map(Some).collect();
        if self.space().patches() > 1 {
            axes.insert(0, None);
        }
        for axis in axes {
            let place = |leaf: usize| {
                let cell = &partition.leaves()[leaf];
                axis.map_or(cell.patches.start as f64, |axis| cell.low[axis])
            };
            let mut order: Vec<usize> = (0..partition.leaves().len()).collect();
            order.sort_by(|&a, &b| place(a).total_cmp(&place(b)));
            let Some((threshold, before, behind)) = self.step(&order, &place) else { continue };
            let factor = |leaf: usize| if place(leaf) < threshold { before } else { behind };
            let leaves: Vec<f64> =
                self.nodes.claimed.iter().enumerate().map(|(leaf, m)| m * factor(leaf)).collect();
            let last = axis.is_none() && threshold as usize + 1 == self.space().patches();
            let (name, at) = match axis {
                None if last && behind > before => {
                    ("the rest goes to the last entry".to_owned(), "the last index".into())
                }
                None if behind < 0.05 * before => ("absorbed tail".to_owned(), format!("index {threshold}")),
                None => ("step along the index".to_owned(), format!("index {threshold}")),
                Some(axis) => {
                    let name = self.space().axis_names()[axis];
                    (format!("step along {name}"), format!("{name} at {threshold:.4} of its range"))
                }
            };
            let text = format!(
                "from {at} on there are {behind:.4} times the samples that the density says, before {before:.4} times: a sum that stalls, or a normalisation that is stale or partial"
            );
            self.push_leaves(name, text, 2, &leaves, false);
        }
    }

    /// The place of the most likely change, and the factors on its two sides.
    fn step(&self, order: &[usize], place: &dyn Fn(usize) -> f64) -> Option<(f64, f64, f64)> {
        let (tally, claimed) = (self.case.tally, &self.nodes.claimed);
        let (o, m) = (self.counts.drawn, claimed.iter().sum::<f64>());
        let part = |o: f64, m: f64| if o > 0.0 { o * (o / m).ln() } else { 0.0 };
        let (mut below, mut mass) = (0.0, 0.0);
        let mut best: Option<(f64, (f64, f64, f64))> = None;
        for pair in order.windows(2) {
            below += tally.per_leaf[pair[0]] as f64;
            mass += claimed[pair[0]];
            if place(pair[0]) == place(pair[1]) || mass < 1e-9 || m - mass < 1e-9 {
                continue;
            }
            let gain = part(below, mass) + part(o - below, m - mass);
            if best.is_none_or(|(most, _)| gain > most) {
                let per = self.counts.all;
                best = Some((gain, (place(pair[1]), below / mass / per, (o - below) / (m - mass) / per)));
            }
        }
        Some(best?.1)
    }

    /// A table over both axes that is filled or looked up in ways that are no shift: by columns for rows, with a row or column too many, at its first cell for half
    /// of an axis that goes around.
    fn tables(&mut self) {
        let knots = self.case.probe.knots().clone();
        let counts = [0, 1].map(|axis| even_spacing(&knots.axes[axis]));
        let names = self.space().axis_names();
        for axis in 0..self.space().axes().min(2) {
            let Some(count) = counts[axis] else { continue };
            let along = names[axis];
            for (stretch, words) in [
                ((count + 1) as f64 / count as f64, "one cell too many"),
                ((count - 1) as f64 / count as f64, "one cell too few"),
            ] {
                let origins = move |l: &Location| {
                    let mut from = *l;
                    from.at[axis] *= stretch;
                    if from.at[axis] <= 1.0 { vec![from] } else { Vec::new() }
                };
                let text = format!("places along {along} are divided by {words}");
                self.renamed(format!("stretched along {along}"), text, Box::new(origins), Keeps::Chart);
            }
        }
        let [Some(rows), Some(columns)] = counts else { return };
        if rows == columns {
            return;
        }
        // Texel (row, column) holds what belongs to the one whose index by columns it has, times the size of its own row; both at their centres,
        // since densities per solid angle rise without bound inside of the rows at the poles.
        let probe = self.case.probe;
        let centre = |patch: usize, row: usize, column: usize| {
            probe
                .density_at(patch, [(row as f64 + 0.5) / rows as f64, (column as f64 + 0.5) / columns as f64])
        };
        let values = crate::parallel::map(self.nodes.nodes.len(), |i| {
            let Location { patch, at } = self.nodes.nodes[i].location;
            let cell = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
            let (row, column) = (cell(at[0], rows), cell(at[1], columns));
            let index = column * rows + row;
            let (density, _) = centre(patch, index / columns, index % columns);
            charted(density, centre(patch, row, column).1)
        });
        let leaves = self.nodes.masses_by_index(&|i| values[i]);
        self.push_leaves(
            "table read by columns".to_owned(),
            "texels are numbered by columns where they are numbered by rows".to_owned(),
            0,
            &leaves,
            true,
        );
    }

    fn renamed(
        &mut self,
        name: String,
        text: String,
        origins: Box<dyn Fn(&Location) -> Vec<Location> + Send + Sync>,
        keeps: Keeps,
    ) {
        let before = self.all.len();
        self.confusion(&Confusion { name: "", origins, keeps }, text);
        if let Some(last) = self.all[before..].last_mut() {
            last.name = name;
        }
    }
}

/// A share of the samples comes from another density. The likelihood is concave in the share; below 0 the claimed density has too much of it.
fn share(counts: &Counts, name: &str, leaves: &[f64]) -> Option<Hypothesis> {
    let (claimed, other) = (counts.normalised(counts.claimed.clone())?, counts.shape(leaves)?);
    let least =
        claimed.iter().zip(&other).filter(|(m, r)| r > m).map(|(m, r)| -m / (r - m)).fold(-1.0, f64::max);
    let mix = |w: f64| -> Vec<f64> {
        claimed.iter().zip(&other).map(|(m, r)| ((1.0 - w) * m + w * r).max(0.0)).collect()
    };
    let w = minimise(least, 1.0, 40, &|w| counts.g(&mix(w)));
    if w.abs() < 1e-9 {
        return None;
    }
    let text = if w > 0.0 {
        format!("a share of {} of the samples comes from another density: {name}", percent(w))
    } else {
        format!("the density claims {} too much of a part: {name}", percent(-w))
    };
    let shape = mix(w);
    Some(Hypothesis {
        name: format!("share of {}", name.trim_start_matches("of ")),
        text,
        parameters: 1,
        shape,
        integral: None,
    })
}

/// No samples in a part of the domain, and nothing else wrong.
fn hole(counts: &Counts) -> Option<Hypothesis> {
    const LEAST: f64 = 0.02;
    let claimed = counts.normalised(counts.claimed.clone())?;
    let ratio = |cell: usize| counts.observed[cell] / (counts.drawn * claimed[cell]).max(1e-3);
    let heavy = |cell: &usize| counts.drawn * claimed[*cell] > 20.0;
    let is_empty = |cell: usize| ratio(cell) < 0.05;
    // What the density should be multiplied with where there are samples.
    let mut full: Vec<f64> = (0..claimed.len()).filter(heavy).map(ratio).filter(|r| *r >= 0.05).collect();
    full.sort_by(f64::total_cmp);
    let &level = full.get(full.len() / 2)?;
    // Cells that the border of the hole runs through have samples in a part of them.
    let is_cut = |cell: usize| {
        let expected = level * counts.drawn * claimed[cell];
        !is_empty(cell) && counts.observed[cell] < expected - 5.0 * expected.sqrt()
    };
    let held: f64 = (0..claimed.len()).filter(|&c| is_empty(c)).map(|c| claimed[c]).sum();
    let cut: Vec<usize> = (0..claimed.len()).filter(heavy).filter(|&c| is_cut(c)).collect();
    let on_border: f64 = cut.iter().map(|&c| claimed[c]).sum();
    let most = 4.0 * (claimed.len() as f64).sqrt();
    if !(LEAST..=1.0 - LEAST).contains(&held) || on_border > held || cut.len() as f64 > most {
        return None;
    }
    let shape = (0..claimed.len()).map(|cell| match cell {
        cell if is_empty(cell) || cut.contains(&cell) => counts.observed[cell] / counts.drawn,
        cell => level * claimed[cell],
    });
    let shape = counts.normalised(shape.collect())?;
    let first = (0..claimed.len()).find(|&c| is_empty(c)).unwrap_or(0);
    let text = format!(
        "there are no samples where the density has {} of its mass, for one at {}; everywhere else they follow it",
        percent(held),
        counts.places[first]
    );
    let parameters = 2 + cut.len() as u32;
    Some(Hypothesis { name: "hole".to_owned(), text, parameters, shape, integral: None })
}

/// The mass of a few entries goes to a few others, and nothing else is wrong.
fn moved(counts: &Counts) -> Option<Hypothesis> {
    const MOST: usize = 12;
    let claimed = counts.normalised(counts.claimed.clone())?;
    let excess = |cell: &usize| counts.observed[*cell] / counts.drawn - claimed[*cell];
    let noise = |cell: usize| (claimed[cell].max(1e-3 / counts.drawn) / counts.drawn).sqrt();
    let mut off: Vec<usize> = (0..claimed.len()).filter(|c| excess(c).abs() > 5.0 * noise(*c)).collect();
    off.sort_by(|a, b| (excess(b).abs() / noise(*b)).total_cmp(&(excess(a).abs() / noise(*a))));
    off.truncate(MOST.min(claimed.len() / 4));
    let (more, less): (Vec<usize>, Vec<usize>) = off.iter().partition(|c| excess(c) > 0.0);
    let (&most, &least) = (more.first()?, less.first()?);
    let gained: f64 = more.iter().map(excess).sum();
    let lost: f64 = -less.iter().map(excess).sum::<f64>();
    // What some have too much, the others have too little.
    if (gained - lost).abs() > 5.0 * off.iter().map(|&c| noise(c).powi(2)).sum::<f64>().sqrt() {
        return None;
    }
    let (shape, parameters) = if off.len() <= 2 {
        let share = (0.5 * (gained + lost)).min(claimed[least]);
        let mut shape = claimed.clone();
        shape[most] += share;
        shape[least] -= share;
        (shape, 3)
    } else {
        let mut shape = claimed.clone();
        off.iter().for_each(|&cell| shape[cell] = counts.observed[cell] / counts.drawn);
        (counts.normalised(shape)?, 2 * off.len() as u32)
    };
    let (from, to) = (counts.places[least].clone(), counts.places[most].clone());
    let entries = match (less.len(), more.len()) {
        (1, 1) => format!("from {from} to {to}"),
        (a, b) => format!("from {a} entries, first {from}, to {b}, first {to}"),
    };
    let text = format!(
        "a probability of {gained:.3e} moved {entries}: an entry of a table that was not filled or gave away too much, a search that is one step off at its ends"
    );
    Some(Hypothesis {
        name: "mass moved between entries".to_owned(),
        text,
        parameters,
        shape,
        integral: None,
    })
}

/// Too many samples in a few places, and nothing else wrong.
fn crowd(counts: &Counts) -> Option<Hypothesis> {
    const MOST: usize = 64;
    const HELD: f64 = 0.05;
    let claimed = counts.normalised(counts.claimed.clone())?;
    let excess = |cell: usize| {
        let expected = (counts.drawn * claimed[cell]).max(1e-3);
        (counts.observed[cell] - expected) / expected.sqrt()
    };
    let mut order: Vec<usize> = (0..claimed.len()).collect();
    order.sort_by(|&a, &b| excess(b).total_cmp(&excess(a)));
    order.truncate(MOST.min(claimed.len() / 4));
    order.retain(|&cell| excess(cell) > 6.0);
    let held: f64 = order.iter().map(|&cell| claimed[cell]).sum();
    if order.is_empty() || held > HELD {
        return None;
    }
    let inside: f64 = order.iter().map(|&cell| counts.observed[cell] / counts.drawn).sum();
    let mut shape: Vec<f64> = claimed.iter().map(|m| m * (1.0 - inside) / (1.0 - held)).collect();
    for &cell in &order {
        shape[cell] = counts.observed[cell] / counts.drawn;
    }
    let text = format!(
        "{} of the samples crowd where the density has {} of its mass (clamped, left over or not finite before), first at {}; everywhere else they follow it",
        percent(inside),
        percent(held),
        counts.places[order[0]]
    );
    let parameters = 2 * order.len() as u32;
    Some(Hypothesis { name: "crowd".to_owned(), text, parameters, shape, integral: None })
}

/// The place of the least value of a function with one minimum, by golden sections (Kiefer 1953).
fn minimise(mut low: f64, mut high: f64, steps: usize, f: &dyn Fn(f64) -> f64) -> f64 {
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..steps {
        if fa < fb {
            (high, b, fb) = (b, a, fa);
            a = high - ratio * (high - low);
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + ratio * (high - low);
            fb = f(b);
        }
    }
    0.5 * (low + high)
}

/// How many cells knots at even distances make.
fn even_spacing(knots: &[f64]) -> Option<usize> {
    let count = knots.len() + 1;
    let even = |(i, &k): (usize, &f64)| (k * count as f64 - (i + 1) as f64).abs() < 1e-6;
    (count > 1 && knots.iter().enumerate().all(even)).then_some(count)
}

fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 0.01 { format!("{percent:.1e}%") } else { format!("{percent:.2}%") }
}

/// Names of ratios that a density is often off by, and their values.
pub(super) fn constant(ratio: f64, tolerance: f64, patches: usize) -> Option<(String, f64)> {
    let known = [
        ("2", 2.0),
        ("pi", PI),
        ("2 pi", 2.0 * PI),
        ("4 pi", 4.0 * PI),
        ("pi / 2", 0.5 * PI),
        ("pi^2", PI * PI),
        ("2 pi^2", 2.0 * PI * PI),
        ("4", 4.0),
        ("180 / pi", 180.0 / PI),
    ];
    let near = |value: f64| (ratio / value - 1.0).abs() < tolerance;
    for (name, value) in known {
        if near(value) {
            return Some((name.to_owned(), value));
        }
        if near(1.0 / value) {
            let inverse = match name.split_once(" / ") {
                Some((above, below)) => format!("{below} / {above}"),
                None if name.contains(' ') => format!("1 / ({name})"),
                None => format!("1 / {name}"),
            };
            return Some((inverse, 1.0 / value));
        }
    }
    let count = patches as f64;
    if patches > 1 && near(count) {
        return Some(("the number of patches".to_owned(), count));
    }
    if patches > 1 && near(1.0 / count) {
        return Some(("1 / the number of patches".to_owned(), 1.0 / count));
    }
    None
}

/// The exponent n of a lobe whose density is (n + 2) / (n + 1) times what it should be, as far as whole numbers can be told apart.
pub(super) fn exponent(ratio: f64, tolerance: f64) -> Option<f64> {
    let (inverse, n) = (1.0 / (ratio - 1.0), (1.0 / (ratio - 1.0)).round() - 1.0);
    let told_apart = inverse * inverse * tolerance < 0.4;
    let near = (ratio / ((n + 2.0) / (n + 1.0)) - 1.0).abs() < tolerance;
    (n >= 1.0 && told_apart && near).then_some(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_sections_find_the_least_value() {
        for least in [-0.9, 0.0, 0.3, 1.7] {
            let found = minimise(-1.0, 2.0, 40, &|x| (x - least).powi(2));
            assert!((found - least).abs() < 1e-7, "{found}, not {least}");
        }
        // Each step leaves 0.618 of the interval: at its end the least value is at most half of that off.
        let asked = std::cell::Cell::new(0);
        let at_end = minimise(0.0, 1.0, 10, &|x| {
            asked.set(asked.get() + 1);
            x
        });
        assert!((at_end - 0.5 * 0.618_033_988_75_f64.powi(10)).abs() < 1e-9 && asked.get() == 12);
        assert!((minimise(0.0, 1.0, 10, &|x| -x) + at_end - 1.0).abs() < 1e-9);
    }

    #[track_caller]
    fn all_near(found: &[f64], expected: &[f64]) {
        let same =
            found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8);
        assert!(same, "{found:?}, not {expected:?}");
    }

    /// So many cells in a row with this value each.
    fn runs(runs: &[(usize, f64)]) -> Vec<f64> {
        runs.iter().flat_map(|&(count, value)| vec![value; count]).collect()
    }

    /// Of an even density no more can be taken than leaves the first cell empty: a quarter, though the last cell has yet more samples.
    #[test]
    fn shares_end_at_an_empty_cell() {
        let counts = Counts::exact(&[0.0, 2400.0, 6600.0], &[0.2 / 3.0, 1.0 / 3.0, 0.6], 0.0);
        let share = share(&counts, "of uniform", &[1.0; 3]).unwrap();
        assert_eq!(
            (share.name.as_str(), share.text.as_str(), share.parameters),
            ("share of uniform", "the density claims 25.00% too much of a part: of uniform", 1)
        );
        all_near(&share.shape, &[0.0, 1.0 / 3.0, 2.0 / 3.0]);
    }

    #[test]
    fn holes_and_their_borders() {
        // Empty, on the border, full.
        let counts =
            Counts::exact(&runs(&[(24, 0.0), (15, 60.0), (25, 150.0)]), &runs(&[(64, 1.0 / 64.0)]), 0.0);
        let hole = hole(&counts).unwrap();
        assert_eq!((hole.name.as_str(), hole.parameters), ("hole", 2 + 15));
        assert_eq!(
            hole.text,
            "there are no samples where the density has 37.50% of its mass, for one at cell 0; everywhere else they follow it"
        );
        all_near(&hole.shape, &runs(&[(24, 0.0), (15, 60.0 / 4650.0), (25, 150.0 / 4650.0)]));
    }

    /// Cells on the border have five standard errors less than they should: of 100 samples 50.
    #[test]
    fn borders_of_holes() {
        let parameters = |cut: f64| {
            let observed = runs(&[(24, 0.0), (3, cut), (37, 100.0)]);
            hole(&Counts::exact(&observed, &runs(&[(64, 1.0 / 64.0)]), 0.0)).unwrap().parameters
        };
        assert_eq!([49.0, 51.0, 60.0, 90.0].map(parameters), [2 + 3, 2, 2, 2]);
    }

    /// Cells that expect less than 20 samples don't say how many times the density the others have, however many they are.
    #[test]
    fn holes_are_judged_by_heavy_cells() {
        let masses = runs(&[(50, 1.0 / 56.0), (60, 0.1 / 56.0)]);
        let counts = Counts::exact(&runs(&[(24, 0.0), (6, 60.0), (20, 150.0), (60, 5.0)]), &masses, 0.0);
        let shape = hole(&counts).unwrap().shape;
        all_near(&shape, &runs(&[(24, 0.0), (6, 60.0 / 4260.0), (20, 150.0 / 4260.0), (60, 15.0 / 4260.0)]));
    }

    #[test]
    fn holes_that_are_none() {
        let is = |observed: &[(usize, f64)], masses: &[(usize, f64)]| {
            let (observed, masses) = (runs(observed), runs(masses));
            let total: f64 = masses.iter().sum();
            let masses: Vec<f64> = masses.iter().map(|m| m / total).collect();
            hole(&Counts::exact(&observed, &masses, 0.0)).is_some()
        };
        // A border of more than what it is around.
        let bordered = |cut: usize| is(&[(10, 0.0), (cut, 60.0), (54 - cut, 150.0)], &[(64, 1.0)]);
        assert!(bordered(10) && !bordered(11));
        // Of a hundred cells 40 may be on the border.
        let frayed = |cut: usize| is(&[(14, 0.0), (cut, 40.0), (86 - cut, 100.0)], &[(14, 4.0), (86, 1.0)]);
        assert!(frayed(40) && !frayed(41));
        // Less than 2% of the mass, or all but 2%.
        let held = |share: f64| is(&[(1, 0.0), (1, 7000.0)], &[(1, share), (1, 1.0 - share)]);
        assert_eq!([0.019, 0.021, 0.979, 0.981].map(held), [false, true, true, false]);
    }

    #[test]
    fn masses_that_are_moved() {
        let cells = |mut all: Vec<f64>, some: [f64; 2]| {
            (all[5], all[12]) = (some[0], some[1]);
            all
        };
        // To an entry that is never drawn, from one that is so rarely.
        let rest = (1.0 - 2e-4) / 38.0;
        let claimed = cells(vec![rest; 40], [2e-4, 0.0]);
        let found =
            moved(&Counts::exact(&cells(vec![1e6 * rest; 40], [50.0, 150.0]), &claimed, 0.0)).unwrap();
        assert_eq!((found.name.as_str(), found.parameters), ("mass moved between entries", 3));
        assert!(
            found.text.starts_with("a probability of 1.500e-4 moved from cell 5 to cell 12: "),
            "{}",
            found.text
        );
        all_near(&found.shape, &cells(vec![rest; 40], [5e-5, 1.5e-4]));
        // The first of several are those that stand out most, wherever they are.
        for at in [[5, 12, 20, 30], [20, 30, 5, 12]] {
            let mut observed = vec![250.0; 40];
            for (cell, more) in at.into_iter().zip([-90.0, 100.0, -200.0, 190.0]) {
                observed[cell] += more;
            }
            let several = moved(&Counts::exact(&observed, &[0.025; 40], 0.0)).unwrap();
            let entries = format!("from 2 entries, first cell {}, to 2, first cell {}: ", at[2], at[3]);
            assert!(
                several.text.starts_with(&format!("a probability of 2.900e-2 moved {entries}")),
                "{}",
                several.text
            );
            assert_eq!(several.parameters, 2 * 4);
        }
        // A few are a quarter at most: two of eight, which don't balance, or three of twelve.
        let to_one = |entries: usize| {
            let mut observed = vec![1000.0; entries];
            (observed[2], observed[4], observed[6]) = (1800.0, 600.0, 600.0);
            moved(&Counts::exact(&observed, &vec![1.0 / entries as f64; entries], 0.0)).is_some()
        };
        assert_eq!([8, 12].map(to_one), [false, true]);
        // What one has too much the other has too little, within five standard errors of both: 0.0112.
        let judged = |more: f64, less: f64| {
            let drawn = 1e4;
            let some = [0.025 - less, 0.025 + more];
            let others = (1.0 - some[0] - some[1]) / 38.0;
            moved(&Counts::exact(
                &cells(vec![drawn * others; 40], some.map(|m| drawn * m)),
                &[0.025; 40],
                0.0,
            ))
        };
        all_near(&judged(0.02, 0.01).unwrap().shape, &cells(vec![0.025; 40], [0.01, 0.04]));
        assert!(judged(0.021, 0.01).is_some() && judged(0.0215, 0.01).is_none());
    }

    #[test]
    fn crowds() {
        let counts = |crowded: &[(usize, f64)]| {
            let mut observed = vec![0.0; 50];
            crowded.iter().for_each(|&(cell, count)| observed[cell] = count);
            let rest = (1e4 - observed.iter().sum::<f64>()) / (50 - crowded.len()) as f64;
            observed.iter_mut().filter(|o| **o == 0.0).for_each(|o| *o = rest);
            Counts::exact(&observed, &[0.02; 50], 0.0)
        };
        let found = crowd(&counts(&[(3, 500.0), (7, 700.0)])).unwrap();
        assert_eq!((found.name.as_str(), found.parameters), ("crowd", 4));
        assert!(
            found.text.starts_with("12.00% of the samples crowd where the density has 4.00% of its mass (")
                && found.text.ends_with(", first at cell 7; everywhere else they follow it"),
            "{}",
            found.text
        );
        let mut shape = vec![0.02 * 0.88 / 0.96; 50];
        (shape[3], shape[7]) = (0.05, 0.07);
        all_near(&found.shape, &shape);
        assert_eq!(crowd(&counts(&[(3, 500.0)])).map(|one| one.parameters), Some(2));
        // A few are a quarter at most, of eight cells the two that are the fullest.
        let masses = runs(&[(3, 0.01), (5, 0.97 / 5.0)]);
        let observed = [&[200.0, 400.0, 300.0][..], &[9100.0 / 5.0; 5]].concat();
        let two = crowd(&Counts::exact(&observed, &masses, 0.0)).unwrap();
        assert!(
            two.parameters == 4
                && two.text.starts_with("7.00% of the samples crowd where the density has 2.00%"),
            "{}",
            two.text
        );
        // What holds more than a twentieth of the mass is no few places.
        assert!(crowd(&counts(&[(3, 500.0), (7, 700.0), (9, 600.0)])).is_none());
        assert!(crowd(&counts(&[])).is_none());
    }

    #[test]
    fn even_knots() {
        assert_eq!((even_spacing(&[]), even_spacing(&[0.5]), even_spacing(&[0.4])), (None, Some(2), None));
        assert_eq!(even_spacing(&[0.25, 0.5, 0.75]), Some(4));
        assert_eq!((even_spacing(&[0.2, 0.5, 0.75]), even_spacing(&[0.25, 0.5])), (None, None));
        assert_eq!(even_spacing(&[0.25 + 0.2e-6, 0.5, 0.75 - 0.2e-6]), Some(4));
        assert_eq!(
            (even_spacing(&[0.25 + 0.3e-6, 0.5, 0.75]), even_spacing(&[0.25, 0.5, 0.75 - 0.3e-6])),
            (None, None)
        );
    }

    #[test]
    fn shares_in_words() {
        assert_eq!([percent(0.1234), percent(1e-4), percent(0.99e-4)], ["12.34%", "0.01%", "9.9e-3%"]);
    }

    #[test]
    fn constants_have_names() {
        let name = |ratio: f64| constant(ratio, 1e-5, 1).unwrap_or_default().0;
        for (expected, value) in [
            ("2", 2.0),
            ("pi", PI),
            ("2 pi", 2.0 * PI),
            ("4 pi", 4.0 * PI),
            ("pi / 2", PI / 2.0),
            ("pi^2", PI * PI),
            ("2 pi^2", 2.0 * PI * PI),
            ("4", 4.0),
            ("180 / pi", 180.0 / PI),
        ] {
            assert_eq!((name(value), name(value * 1.000_009)), (expected.to_owned(), expected.to_owned()));
            let inverse = match expected {
                "pi / 2" => "2 / pi".to_owned(),
                "180 / pi" => "pi / 180".to_owned(),
                "2 pi" | "4 pi" | "2 pi^2" => format!("1 / ({expected})"),
                _ => format!("1 / {expected}"),
            };
            assert_eq!((name(1.0 / value), name(0.999_991 / value)), (inverse.clone(), inverse));
            assert_ne!(name(value * 1.000_011), expected);
        }
        let of_patches = |ratio: f64, patches: usize| constant(ratio, 1e-5, patches).map(|(name, _)| name);
        assert_eq!(of_patches(7.0, 7).as_deref(), Some("the number of patches"));
        assert_eq!(of_patches(1.0 / 7.0, 7).as_deref(), Some("1 / the number of patches"));
        assert_eq!((of_patches(7.0, 8), of_patches(1.0, 1)), (None, None));
        assert_eq!((name(1.5), name(1.51), name(0.9)), (String::new(), String::new(), String::new()));
        // The constant itself is what its name says, not the ratio.
        let value = |ratio: f64, patches: usize| constant(ratio, 1e-5, patches).map(|(_, value)| value);
        assert_eq!(
            [PI, 1.0 / PI, 1.0 / 4.0].map(|x| value(x * 1.000_001, 1)),
            [Some(PI), Some(1.0 / PI), Some(0.25)]
        );
        assert_eq!([7.0, 1.0 / 7.0].map(|x| value(x * 1.000_001, 7)), [Some(7.0), Some(1.0 / 7.0)]);
    }

    /// (n + 2) / (n + 1), as long as its neighbours are farther off than the tolerance.
    #[test]
    fn exponents_of_lobes() {
        let n = |ratio: f64| exponent(ratio, 1e-5);
        assert_eq!((n(1.5), n(22.0 / 21.0), n(4.0 / 3.0)), (Some(1.0), Some(20.0), Some(2.0)));
        assert_eq!((n(1.51), n(0.9), n(2.0), n(1.0 + 1.0 / 198.0)), (None, None, None, Some(197.0)));
        assert_eq!((n(1.500_01), n(1.500_02)), (Some(1.0), None));
        // 200^2 times the tolerance is 0.4.
        assert_eq!(n(1.0 + 1.0 / 202.0), None);
        // Both are less, not equal: 2^2 times a tenth, and what 1.53 is off.
        assert_eq!((exponent(1.5, 0.1), exponent(1.5, 0.0999)), (None, Some(1.0)));
        let off = 1.53 / 1.5 - 1.0;
        assert_eq!((exponent(1.53, off), exponent(1.53, 1.001 * off)), (None, Some(1.0)));
    }
}
