//! Which known mistake would explain the counts.
//!
//! A mistake is an alternative density: the claimed one with a factor more or less, taken from another place, mixed with another one. Each is
//! normalised to the samples drawn and compared by
//!
//! 2 ln L - k ln n
//!
//! with the claimed shape, k the number of its fitted parameters (the Bayesian information criterion; Schwarz 1978). With G = 2 sum O ln(O / E) this is
//! -G - k ln n, up to a constant. The best one explains the counts if its own G is within what its degrees of freedom allow, or if next to nothing of
//! the claimed density's excess is left; otherwise the diagnosis says that nothing known does.

mod counts;
mod direct;
mod hypotheses;
mod nodes;

use super::check::Case;
use crate::domain::{Integral, Space};
use counts::Counts;
use hypotheses::Hypothesis;
use nodes::Nodes;

/// 2 ln L by which a hypothesis must be better than the claimed shape before it is named: a p-value of 1e-8 or so over all hypotheses.
const GAIN: f64 = 50.0;
/// Share of the excess of G that may be left.
const LEFT: f64 = 0.05;
/// Noncentrality under which two hypotheses look the same.
const ALIKE: f64 = 9.0;
/// Relative error that a constant may have and still be named.
const NEAR: f64 = 3e-5;
/// A mean may be called a / b if b max(a, b) times its relative error is less: fractions so simple are so far apart.
const FRACTION: f64 = 0.1;
/// Standard errors that a mean of 1 / density may be off a constant that is named.
const SURE: f64 = 4.0;
/// A relative error from which on a mean says nothing of a constant.
const ROUGH: f64 = 0.05;
/// Other hypotheses that are listed.
const OTHERS: usize = 3;

/// What would explain the counts.
///
/// ```
/// use warpcheck::{domain::Hemisphere, sampler::{CosineHemisphere, UniformHemisphere, from_fn}};
/// use glam::{Vec2, Vec3};
/// let mine = from_fn(Hemisphere, |xi: Vec2| UniformHemisphere.sample(xi), |w: Vec3| CosineHemisphere.density(w));
/// let report = warpcheck::verify(&mine).samples(100_000).run();
/// let diagnosis = report.examinations[0].diagnosis.as_ref().unwrap();
/// assert!(diagnosis.explains && diagnosis.margin.unwrap() > 100.0);
/// assert!(diagnosis.is("extra cos theta") || diagnosis.is("uniform"), "{}", diagnosis.text);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// A short name of the mistake: "lacks cos theta".
    pub name: String,
    /// Other mistakes that would give the same counts here.
    pub alike: Vec<String>,
    /// A sentence or two with the figures.
    pub text: String,
    /// Whether the mistake explains the counts; if not, it is only the nearest one.
    pub explains: bool,
    /// Logarithm of the likelihood ratio to the claimed density.
    pub gain: f64,
    /// The same to the next mistake that could be told apart, less the penalties for fitted parameters; `None` where no counts were compared.
    pub margin: Option<f64>,
    /// The next ones, and by how much each is behind.
    pub others: Vec<(String, f64)>,
}

impl Diagnosis {
    /// Whether it names this mistake, alone or among those that look the same.
    pub fn is(&self, name: &str) -> bool {
        self.explains && (self.name == name || self.alike.iter().any(|other| other == name))
    }

    fn direct((name, text): direct::Mistake) -> Self {
        Self {
            name: name.to_owned(),
            alike: Vec::new(),
            text,
            explains: true,
            gain: 0.0,
            margin: None,
            others: Vec::new(),
        }
    }
}

/// To be asked where some finding is suspicious.
pub(super) fn diagnose(case: &Case<'_>) -> Option<Diagnosis> {
    // It takes longer than what was stopped.
    if case.settings.stopped() {
        return None;
    }
    direct::outside(case)
        .or_else(|| direct::nothing(case))
        .or_else(|| direct::not_finite(case))
        .or_else(|| direct::few_points(case))
        .map(Diagnosis::direct)
        .or_else(|| by_weights(case))
        .or_else(|| by_counts(case))
        .or_else(|| {
            direct::disagreement(case)
                .or_else(|| direct::edges(case))
                .or_else(|| direct::left_over(case))
                .or_else(|| direct::target(case))
                .or_else(|| direct::importance(case))
                .map(Diagnosis::direct)
        })
}

/// Where there are no expected counts: whether the means of 1 / density are those of a density times one constant.
fn by_weights(case: &Case<'_>) -> Option<Diagnosis> {
    if case.probe.has_density() || case.probe.partial() {
        return None;
    }
    let (ratio, error) = crate::verify::weights::common_ratio(case)?;
    of_weights(case.probe.space(), ratio, error)
}

/// Where the mean of 1 / density is `ratio` times the measure all over the domain.
fn of_weights(space: &dyn Space, ratio: f64, error: f64) -> Option<Diagnosis> {
    if (ratio - 1.0).abs() < 5.0 * error {
        return None;
    }
    let (ratio, tolerance) = (1.0 / ratio, known_to(error / ratio));
    of_mean(ratio, tolerance).map(|diagnosis| {
        let (measure, lobes) = (space.measure(), matches!(space.name(), "hemisphere" | "sphere"));
        let more = match hypotheses::exponent(ratio, tolerance).filter(|_| lobes) {
            _ if diagnosis.name != "constant" => String::new(),
            _ if measure.is_finite() && (ratio * measure - 1.0).abs() < tolerance => {
                format!(", 1 / the measure of the {}", space.name())
            }
            Some(n) => format!(", (n + 2) / (n + 1) if this is a lobe of exponent n = {n}"),
            None => String::new(),
        };
        let text = format!("{}{more} (the densities, all over the domain)", diagnosis.text);
        // All over the domain by one factor: so much is explained, whatever the factor.
        Diagnosis { text, explains: true, ..diagnosis }
    })
}

/// What would explain a mean that is `ratio` times what it should be, known up to a relative `tolerance`. A ratio that is no known number explains nothing.
pub(super) fn of_mean(ratio: f64, tolerance: f64) -> Option<Diagnosis> {
    if !(tolerance < ROUGH) {
        return None;
    }
    let known = known_constant(ratio, tolerance);
    let explains = known.is_some();
    let (name, text) = match known {
        Some((known, _)) => {
            (format!("constant {known}"), format!("every value is {known} times what it should be"))
        }
        None => ("constant".to_owned(), format!("the mean is {ratio:.6} times what it should be")),
    };
    Some(Diagnosis { name, explains, ..Diagnosis::direct(("", text)) })
}

/// The relative tolerance of a mean with this relative error.
pub(crate) fn known_to(error: f64) -> f64 {
    // What is known less well has a name only if it is that near.
    if error < ROUGH { (SURE * error).min(0.99 * ROUGH) } else { f64::NAN }
}

/// A name for a constant that is known up to a relative `tolerance`, and the constant of that name.
pub(crate) fn known_constant(ratio: f64, tolerance: f64) -> Option<(String, f64)> {
    // Of counts: 4 lights of 5, if so much can be told.
    let near = |(a, b): &(u32, u32)| (ratio * f64::from(*b) / f64::from(*a) - 1.0).abs() < tolerance;
    let fractions = (1..=12).flat_map(|b| (1..=12).filter(move |&a| a != b).map(move |a| (a, b)));
    let told_apart = |&(a, b): &(u32, u32)| f64::from(b * a.max(b)) * tolerance < FRACTION;
    let in_words = |(a, b): (u32, u32)| {
        let name = if b == 1 { a.to_string() } else { format!("{a} / {b}") };
        (name, f64::from(a) / f64::from(b))
    };
    hypotheses::constant(ratio, tolerance, 1)
        .or_else(|| fractions.filter(told_apart).find(near).map(in_words))
}

/// A hypothesis and how it fits.
struct Fit {
    hypothesis: Hypothesis,
    /// 2 ln L less the penalty, up to a constant.
    score: f64,
    g: f64,
}

fn by_counts(case: &Case<'_>) -> Option<Diagnosis> {
    let total = case.expectation.total;
    // NaN where there is no density. One that is no number somewhere has been told of; masses that the sampler gives may yet be negative.
    let known = total.value > 0.0 && total.value.is_finite() && total.error.is_finite();
    if !(known && case.expectation.leaves.iter().all(|leaf| leaf.value >= 0.0)) {
        return None;
    }
    let counts = Counts::new(case);
    if counts.drawn < 1000.0 || counts.observed.len() < 2 {
        return None;
    }
    let nodes = Nodes::new(case);
    let shape = counts.normalised(counts.claimed.clone())?;
    let hypotheses = hypotheses::all(case, &nodes, &counts);
    if case.settings.stopped() {
        return None;
    }
    let constant = constant(total, case.probe.space(), &counts, &shape);
    likeliest(total, &counts, &shape, hypotheses, constant)
}

/// What explains the counts best: the claimed shape, times a constant if there is one, or a hypothesis.
fn likeliest(
    total: Integral,
    counts: &Counts,
    shape: &[f64],
    hypotheses: Vec<Hypothesis>,
    constant: Option<Diagnosis>,
) -> Option<Diagnosis> {
    let (g_shape, ln_n) = (counts.g(shape), counts.drawn.ln());
    let shape_fits = counts.accepts(shape, 0);
    let tried = hypotheses.len() + 1;
    let mut fits: Vec<Fit> = hypotheses
        .into_iter()
        .filter(|h| counts.distance(&h.shape, shape) > ALIKE)
        .map(|hypothesis| {
            let g = counts.g(&hypothesis.shape);
            Fit { score: -g - f64::from(hypothesis.parameters) * ln_n, g, hypothesis }
        })
        .collect();
    fits.sort_by(|a, b| b.score.total_cmp(&a.score)); // stable: the plainer one first
    let gained = fits.first().is_some_and(|best| best.score + g_shape > GAIN);
    if !gained {
        return match constant {
            Some(mut constant) if shape_fits => {
                constant.margin = fits.first().map(|next| 0.5 * (-g_shape - next.score));
                constant.others = behind(&fits, -g_shape);
                Some(constant)
            }
            _ if shape_fits => None,
            _ => Some(unknown(tried, None, counts, 0.0)),
        };
    }
    let best_score = fits[0].score;
    let alike = |fit: &Fit| {
        best_score - fit.score < GAIN
            && counts.distance(&fit.hypothesis.shape, &fits[0].hypothesis.shape) < ALIKE
    };
    let mut marks = fits.iter().map(alike).collect::<Vec<bool>>().into_iter();
    let (mut same, rest): (Vec<Fit>, Vec<Fit>) =
        fits.into_iter().partition(|_| marks.next().unwrap_or(false));
    // Of those that look the same the one with the fewest parameters, then the plainest.
    same.sort_by_key(|fit| fit.hypothesis.parameters);
    let best = &same[0];
    let df = counts.df(&best.hypothesis.shape);
    let left = (best.g - df).max(0.0) / (g_shape - df).max(1.0);
    let accepted = counts.accepts(&best.hypothesis.shape, best.hypothesis.parameters);
    let gain = 0.5 * (counts.g_claimed() - best.g);
    if !(accepted || left < LEFT) {
        return Some(unknown(tried, Some((best, left)), counts, gain));
    }
    let margin = rest.first().map(|next| 0.5 * (best_score - next.score));
    let mut names: Vec<String> = Vec::new();
    let mut text = best.hypothesis.text.clone();
    for fit in &same[1..] {
        let name = &fit.hypothesis.name;
        if *name != best.hypothesis.name && !names.contains(name) {
            names.push(name.clone());
        }
    }
    if !names.is_empty() {
        text += &format!(" (or, which looks the same here: {})", names.join("; "));
    }
    text += &side(total, counts, best.hypothesis.integral);
    if !accepted {
        text += &format!("; {:.1}% of the deviation is left", 100.0 * left);
    }
    text += &format!("; ln L {gain:.0} over the claimed density");
    if let (Some(margin), Some(next)) = (margin, rest.first()) {
        text += &format!(", {margin:.0} over the next of {tried} known mistakes ({})", next.hypothesis.name);
    }
    Some(Diagnosis {
        name: best.hypothesis.name.clone(),
        alike: names,
        text,
        explains: true,
        gain,
        margin,
        others: behind(&rest, best_score),
    })
}

fn behind(fits: &[Fit], best: f64) -> Vec<(String, f64)> {
    fits.iter().take(OTHERS).map(|fit| (fit.hypothesis.name.clone(), 0.5 * (best - fit.score))).collect()
}

/// Which side the integral points to: a density that lacks a factor hardly integrates to 1 by accident.
fn side(total: Integral, counts: &Counts, integral: Option<f64>) -> String {
    let Some(integral) = integral else { return String::new() };
    let should = counts.drawn / counts.all;
    let near = 1e-3 + 4.0 * ((1.0 - should) / counts.all).sqrt() + total.error;
    let (claimed_off, off) = ((total.value - should).abs(), (integral - should).abs());
    if claimed_off < near && off > 5.0 * near {
        "; the density integrates as it should, which points to the sampler".to_owned()
    } else if off < near && claimed_off > 5.0 * near {
        "; so changed the density would integrate as it should, which points to the density".to_owned()
    } else {
        String::new()
    }
}

/// The shape is right, the integral is not.
fn constant(total: Integral, space: &dyn Space, counts: &Counts, shape: &[f64]) -> Option<Diagnosis> {
    let should = counts.drawn / counts.all;
    let ratio = total.value / should;
    let noise = ((1.0 - should) / counts.drawn).sqrt();
    let tolerance = NEAR + total.error / total.value + 4.0 * noise;
    if (ratio - 1.0).abs() <= tolerance {
        return None;
    }
    let gain = 0.5 * (counts.g_claimed() - counts.g(shape));
    let known = hypotheses::constant(ratio, tolerance, space.patches());
    // A name for what any constant may be chance for; only lobes have exponents.
    let directions = matches!(space.name(), "hemisphere" | "sphere");
    let exponent = hypotheses::exponent(ratio, tolerance).filter(|_| directions);
    let figures = format!("its integral is {:.6} where {should:.6} of the samples are drawn", total.value);
    let (name, text) = match (known, exponent) {
        (Some((known, _)), _) => (
            format!("constant {known}"),
            format!(
                "the shape of the density is right, but it is {known} times what it should be; {figures}"
            ),
        ),
        (None, Some(n)) => (
            format!("constant (n + 2) / (n + 1), n = {n}"),
            format!(
                "the shape of the density is right, but it is {ratio:.6} times what it should be: (n + 2) / (n + 1) if this is a lobe of exponent n = {n}, or another \
                 constant; {figures}"
            ),
        ),
        (None, None) if ratio < 1.0 && counts.rejected < 0.5 * counts.all * counts.rejected_claimed => (
            "rejected samples drawn again".to_owned(),
            format!(
                "samples that the density leaves to rejection are drawn again, while the density is not raised by {:.6} = 1 / (1 - rejected), or it is too small by that constant; {figures}",
                1.0 / ratio
            ),
        ),
        (None, None) => (
            "constant".to_owned(),
            format!(
                "the shape of the density is right, but its normalisation is off by {:+.4}%; {figures}",
                100.0 * (ratio - 1.0)
            ),
        ),
    };
    Some(Diagnosis { name, alike: Vec::new(), text, explains: true, gain, margin: None, others: Vec::new() })
}

fn unknown(tried: usize, nearest: Option<(&Fit, f64)>, counts: &Counts, gain: f64) -> Diagnosis {
    let mut text =
        format!("none of the {tried} known mistakes explains the counts in {} cells", counts.observed.len());
    if let Some((fit, left)) = nearest {
        text += &format!(
            "; the nearest, \"{}\", leaves {:.0}% of the deviation",
            fit.hypothesis.name,
            100.0 * left
        );
    }
    let others = nearest.map(|(fit, _)| (fit.hypothesis.name.clone(), 0.0)).into_iter().collect();
    Diagnosis {
        name: "unknown".to_owned(),
        alike: Vec::new(),
        text,
        explains: false,
        gain,
        margin: None,
        others,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::{Hemisphere, Interval, Square};
    use crate::sampler::{Sampler, from_fn};
    use crate::verify::expectation::told::{self, integral};
    use crate::verify::probe::{Extras, Subject};
    use crate::verify::settings::Settings;
    use crate::verify::tally::Tally;

    fn hypothesis(name: &str, parameters: u32, shape: [f64; 4]) -> Hypothesis {
        let text = format!("as {name} says");
        Hypothesis { name: name.to_owned(), text, parameters, shape: shape.into(), integral: None }
    }

    /// 10,000 samples, where 2500 are claimed for each of four cells.
    const SKEWED: [f64; 4] = [4000.0, 3000.0, 2000.0, 1000.0];

    fn found(
        observed: [f64; 4],
        hypotheses: Vec<Hypothesis>,
        constant: Option<Diagnosis>,
    ) -> Option<Diagnosis> {
        let counts = Counts::exact(&observed, &[0.25; 4], 0.0);
        likeliest(integral(1.0, 0.0), &counts, &[0.25; 4], hypotheses, constant)
    }

    /// 2 sum O ln(O / E), of as many expected as observed.
    fn g(observed: [f64; 4], shape: [f64; 4]) -> f64 {
        let cell = |(o, m): (f64, f64)| 2.0 * o * (o / (1e4 * m)).ln();
        observed.into_iter().zip(shape).map(cell).sum()
    }

    #[track_caller]
    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-5 * expected.abs(), "{found}, not {expected}");
    }

    /// Counts in quarters of a line are compared from a thousand samples on, where all masses are known.
    #[test]
    fn when_counts_are_compared() {
        let sampler = from_fn(Interval::new(0.0, 1.0), |u: f64| u, |_: f64| 1.0);
        let (extras, settings) = (Extras::default(), Settings::default());
        let probe = Subject::new(&sampler, &extras);
        let explained = |per_leaf: [u64; 4], leaves: [Integral; 4]| {
            let expectation = told::expectation(&sampler.domain(), leaves, vec![]);
            let tally =
                Tally { samples: per_leaf.iter().sum(), per_leaf: per_leaf.into(), ..Tally::default() };
            let case = Case { probe: &probe, expectation: &expectation, tally: &tally, settings: &settings };
            by_counts(&case).is_some()
        };
        let known = [integral(0.25, 0.0); 4];
        let of_last = |last: u64, leaves: [Integral; 4]| explained([400, 300, 200, last], leaves);
        assert_eq!([99, 100].map(|last| of_last(last, known)), [false, true]);
        for (value, error) in [(0.25, f64::INFINITY), (f64::INFINITY, 0.0), (f64::NAN, 0.0), (-0.1, 0.0)] {
            let leaves = [known[0], known[0], known[0], integral(value, error)];
            assert!(!of_last(100, leaves), "{value} +- {error}");
        }
    }

    #[test]
    fn the_likeliest_is_named() {
        let (right, close) = ([0.4, 0.3, 0.2, 0.1], [0.41, 0.3, 0.2, 0.09]);
        // 13.4 behind in twice ln L for its counts, and 18 or 55 for parameters.
        let hypotheses = || {
            vec![
                hypothesis("close", 0, close),
                hypothesis("fitted", 2, right),
                hypothesis("six", 6, right),
                hypothesis("right", 0, right),
            ]
        };
        let best = found(SKEWED, hypotheses(), None).unwrap();
        assert_eq!((best.name.as_str(), best.explains), ("right", true));
        // Of the same shape, and by less than 50 behind. The other two are told from it: by their counts, or by what they cost.
        assert_eq!(best.alike, ["fitted"]);
        let margins = [0.5 * g(SKEWED, close), 0.5 * 6.0 * 1e4_f64.ln()];
        assert_eq!(best.others.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["close", "six"]);
        near(best.others[0].1, margins[0]);
        near(best.others[1].1, margins[1]);
        near(best.margin.unwrap(), margins[0]);
        near(best.gain, 0.5 * g(SKEWED, [0.25; 4]));
        assert_eq!(
            best.text,
            format!(
                "as right says (or, which looks the same here: fitted); ln L {:.0} over the claimed density, {:.0} over the next of 5 known mistakes (close)",
                best.gain, margins[0]
            )
        );
        let alone = found(SKEWED, vec![hypothesis("right", 0, right)], None).unwrap();
        assert_eq!(
            (alone.text, alone.margin, alone.alike.len(), alone.others.len()),
            (format!("as right says; ln L {:.0} over the claimed density", best.gain), None, 0, 0)
        );
        // A name is told once.
        let twice = vec![hypothesis("right", 0, right), hypothesis("right", 1, right)];
        assert!(found(SKEWED, twice, None).unwrap().alike.is_empty());
    }

    /// Of what the claimed shape's G is above its three degrees of freedom, 5% may be left.
    #[test]
    fn what_is_left_of_a_deviation() {
        let left = |shape: [f64; 4]| (g(SKEWED, shape) - 3.0) / (g(SKEWED, [0.25; 4]) - 3.0);
        let (near_it, farther) = ([0.43, 0.27, 0.2, 0.1], [0.45, 0.25, 0.2, 0.1]);
        assert!((0.02..0.03).contains(&left(near_it)) && (0.06..0.08).contains(&left(farther)));
        let best = found(SKEWED, vec![hypothesis("near", 0, near_it)], None).unwrap();
        assert!(best.explains);
        assert_eq!(
            best.text,
            format!(
                "as near says; {:.1}% of the deviation is left; ln L {:.0} over the claimed density",
                100.0 * left(near_it),
                0.5 * (g(SKEWED, [0.25; 4]) - g(SKEWED, near_it))
            )
        );
        // Of 64 cells 94 of 1807 above 63 are left: 5.2%, where of 1933 it would be 4.9%.
        let halves = |a: f64, b: f64| [vec![a; 32], vec![b; 32]].concat();
        let cells = |observed: f64, shape: f64| {
            let counts = Counts::exact(&halves(100.0 + observed, 100.0 - observed), &[1.0 / 64.0; 64], 0.0);
            let near = Hypothesis {
                shape: halves((1.0 + shape) / 64.0, (1.0 - shape) / 64.0),
                ..hypothesis("near", 0, [0.0; 4])
            };
            let excess = |shape: &[f64]| counts.g(shape) - 63.0;
            let (left, all) = (excess(&near.shape), excess(&[1.0 / 64.0; 64]));
            assert!(
                (0.0502..0.054).contains(&(left / all)) && left / (all + 126.0) < 0.0498,
                "{left} of {all}"
            );
            likeliest(integral(1.0, 0.0), &counts, &[1.0 / 64.0; 64], vec![near], None).unwrap()
        };
        assert!(!cells(52.7, 0.386).explains);
        let unknown = found(SKEWED, vec![hypothesis("farther", 0, farther)], None).unwrap();
        assert_eq!((unknown.name.as_str(), unknown.explains, unknown.margin), ("unknown", false, None));
        assert_eq!(unknown.others, [("farther".to_owned(), 0.0)]);
        assert_eq!(
            unknown.text,
            format!(
                "none of the 2 known mistakes explains the counts in 4 cells; the nearest, \"farther\", leaves {:.0}% of the deviation",
                100.0 * left(farther)
            )
        );
    }

    /// A shape that is right may yet be a constant off.
    #[test]
    fn where_no_hypothesis_is_likelier() {
        let (observed, other) = ([2520.0, 2480.0, 2510.0, 2490.0], [0.27, 0.23, 0.25, 0.25]);
        let hypotheses = || vec![hypothesis("other", 1, other)];
        assert_eq!(found(observed, hypotheses(), None), None);
        let constant = Diagnosis::direct(("constant 2", String::new()));
        let best = found(observed, hypotheses(), Some(constant.clone())).unwrap();
        let margin = 0.5 * (g(observed, other) + 1e4_f64.ln() - g(observed, [0.25; 4]));
        assert_eq!((best.name.as_str(), best.others.len()), ("constant 2", 1));
        near(best.margin.unwrap(), margin);
        near(best.others[0].1, margin);
        // Where the shape is wrong as well it is none.
        let none = found(SKEWED, vec![], Some(constant)).unwrap();
        assert_eq!(
            (none.name.as_str(), none.text.as_str()),
            ("unknown", "none of the 1 known mistakes explains the counts in 4 cells")
        );
    }

    /// A tenth rejected of 1000 samples: 0.9 is known to 0.001 + 0.04, and the integral to 0.002.
    #[test]
    fn sides_that_integrals_point_to() {
        let counts = Counts::exact(&[400.0, 500.0], &[0.4, 0.5], 100.0);
        let points = |claimed: f64, changed: f64| {
            let text = side(integral(claimed, 0.002), &counts, Some(changed));
            text.rsplit_once(' ').map_or(String::new(), |(_, last)| last.to_owned())
        };
        assert_eq!([points(0.9 - 0.0425, 0.9 - 0.216), points(0.9 + 0.0425, 0.9 + 0.216)], ["sampler"; 2]);
        assert_eq!([points(0.9 - 0.216, 0.9 - 0.0425), points(0.9 + 0.216, 0.9 + 0.0425)], ["density"; 2]);
        for (claimed, changed) in [(0.0435, 0.5), (0.0, 0.214), (0.5, 0.0435), (0.214, 0.0), (0.0, 0.0)] {
            assert_eq!(points(0.9 + claimed, 0.9 + changed), "");
        }
        assert_eq!(side(integral(0.9, 0.0), &counts, None), "");
    }

    #[test]
    fn constants_that_are_off() {
        let judged = |total: Integral, observed: [f64; 2], rejected: f64| {
            let counts = Counts::exact(&observed, &[0.5 * total.value; 2], rejected);
            constant(total, &Square, &counts, &[0.5; 2]).map(|d| (d.name, d.gain)).unwrap_or_default()
        };
        let name = |total: Integral, drawn: f64, rejected: f64| judged(total, [0.5 * drawn; 2], rejected).0;
        // Of 900 that are drawn and 100 that are not the share is known to 4 sqrt(0.1 / 900) = 4.2%.
        let of_900 = |ratio: f64| name(integral(0.9 * ratio, 0.0), 900.0, 100.0);
        assert_eq!([1.0, 0.959, 1.041].map(of_900), [""; 3]);
        assert_eq!([1.043, 1.1].map(of_900), ["constant"; 2]);
        // The integral's error counts in proportion to it.
        assert_eq!(name(integral(0.56, 0.1), 1000.0, 0.0), "constant 1 / 2");
        // Less than half of what is claimed to be rejected: 70 of 1000.
        assert_eq!(name(integral(0.86, 0.0), 931.0, 69.0), "rejected samples drawn again");
        assert_eq!(name(integral(0.86, 0.0), 929.0, 71.0), "constant");
        // Just half of 128 in 1024 is as claimed.
        let of_1024 = |rejected: f64| name(integral(0.875, 0.0), 1024.0 - rejected, rejected);
        assert_eq!([63.0, 64.0].map(of_1024), ["rejected samples drawn again", "constant"]);
        // Of n samples where c n are claimed, by Poisson's distribution; less what the shape is off.
        let (_, gain) = judged(integral(2.0, 0.0), [5200.0, 4800.0], 0.0);
        near(gain, 1e4 * (2.0 - 1.0 - 2.0_f64.ln()));
    }

    #[test]
    fn means_in_small_numbers() {
        let name = |ratio: f64, tolerance: f64| of_mean(ratio, tolerance).map(|d| d.name).unwrap_or_default();
        for (ratio, expected) in [
            (0.8, "constant 4 / 5"),
            (0.75, "constant 3 / 4"),
            (2.5, "constant 5 / 2"),
            (7.0 / 12.0, "constant 7 / 12"),
            (3.0, "constant 3"),
            (11.0, "constant 11"),
            (1.0 / 3.0, "constant 1 / 3"),
            (2.0, "constant 2"),
            (0.13, "constant"),
        ] {
            assert_eq!(name(ratio, 1e-5), expected);
            assert_eq!(name(ratio * (1.0 + 0.9e-5), 1e-5), expected);
            assert_eq!(name(ratio * (1.0 - 1.1e-5), 1e-5), "constant");
        }
        // A fraction of greater numbers must be known more closely: 5 * 5 times the tolerance is a tenth at most.
        assert_eq!(
            (name(0.8, 3.9e-3), name(0.8, 4.1e-3), name(2.5, 9.9e-3), name(2.5, 0.0101)),
            (
                "constant 4 / 5".to_owned(),
                "constant".to_owned(),
                "constant 5 / 2".to_owned(),
                "constant".to_owned()
            )
        );
        assert_eq!(
            (name(0.13, 0.049), name(0.13, 0.051), name(0.13, f64::NAN)),
            ("constant".to_owned(), String::new(), String::new())
        );
        let [known, odd] = [0.75, 0.13].map(|ratio| of_mean(ratio, 1e-5).unwrap());
        assert_eq!(known.text, "every value is 3 / 4 times what it should be");
        assert_eq!(odd.text, "the mean is 0.130000 times what it should be");
        assert!(known.explains && !odd.explains);
        // What is known to a twentieth says nothing.
        assert_eq!((name(0.13, 0.0499), name(0.13, ROUGH)), ("constant".to_owned(), String::new()));
    }

    /// Four standard errors, but for a name less than a twentieth.
    #[test]
    fn how_well_means_are_known() {
        assert_eq!([0.001, 0.01, 0.012].map(known_to), [0.004, 0.04, 0.048]);
        near(known_to(0.013), 0.0495);
        near(known_to(0.0499), 0.0495);
        assert!(known_to(0.05).is_nan() && known_to(f64::NAN).is_nan());
    }

    #[test]
    fn constants_and_their_values() {
        for (ratio, expected, value) in
            [(0.8, "4 / 5", 0.8), (3.0, "3", 3.0), (5.0, "5", 5.0), (0.2, "1 / 5", 0.2), (2.5, "5 / 2", 2.5)]
        {
            assert_eq!(known_constant(ratio, 1e-5), Some((expected.to_owned(), value)));
        }
        // Nearer than the tolerance, and farther from others than a tenth: 1 * 10 * 0.01.
        let off = 0.8016 * 5.0 / 4.0 - 1.0;
        let name = |ratio: f64, tolerance: f64| known_constant(ratio, tolerance).map(|(name, _)| name);
        assert_eq!((name(0.8016, off), name(0.8016, 1.001 * off).as_deref()), (None, Some("4 / 5")));
        assert_eq!((name(10.0, 0.01), name(10.0, 0.0099).as_deref()), (None, Some("10")));
    }

    /// Densities that are a constant too large all over the domain, of which means of 1 / density tell.
    #[test]
    fn constants_of_weights() {
        let text = |space: &dyn Space, times: f64, error: f64| {
            let diagnosis = of_weights(space, 1.0 / times, error / times)?;
            assert!(diagnosis.explains);
            let of_all = diagnosis.text.strip_suffix(" (the densities, all over the domain)");
            Some(of_all.unwrap_or_else(|| panic!("{}", diagnosis.text)).to_owned())
        };
        let plain = |ratio: &str| Some(format!("the mean is {ratio} times what it should be"));
        let with = |ratio: &str, more: &str| plain(ratio).map(|text| format!("{text}, {more}"));
        // By less than five standard errors.
        assert_eq!((text(&Square, 1.04, 0.0099), text(&Square, 1.04, 0.0076)), (None, plain("1.040000")));
        // (n + 2) / (n + 1) is said of lobes, and of what has no name of its own.
        let lobe = 22.0 / 21.0;
        assert_eq!(
            text(&Hemisphere, lobe, 1e-4),
            with("1.047619", "(n + 2) / (n + 1) if this is a lobe of exponent n = 20")
        );
        assert_eq!(text(&Square, lobe, 1e-4), plain("1.047619"));
        assert_eq!(text(&Hemisphere, 1.03, 1e-5), plain("1.030000"));
        assert_eq!(
            text(&Hemisphere, 4.0 / 3.0, 1e-4).as_deref(),
            Some("every value is 4 / 3 times what it should be")
        );
        // So is 1 / the measure.
        assert_eq!(
            text(&Interval::new(0.0, 1.37), 1.0 / 1.37, 1e-4),
            with("0.729927", "1 / the measure of the interval")
        );
        assert_eq!(
            text(&Interval::new(0.0, 0.5), 2.0, 1e-4).as_deref(),
            Some("every value is 2 times what it should be")
        );
        assert_eq!(text(&Interval::new(0.0, f64::INFINITY), 16.0, 1e-4), plain("16.000000"));
        // Within four standard errors of it.
        let off = 1e-3;
        let near_it = Interval::new(0.0, (1.0 + off) / 16.0);
        let off = 16.0 * Space::measure(&near_it) - 1.0;
        assert_eq!(
            (text(&near_it, 16.0, 0.25 * off), text(&near_it, 16.0, 0.2501 * off)),
            (plain("16.000000"), with("16.000000", "1 / the measure of the interval"))
        );
    }
}
