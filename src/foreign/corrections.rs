//! What is wrong with the densities that come with samples, where nothing else says what they should be: known mistakes are undone one after another, and
//! the rows are judged again. Those without which nothing is wrong any more are named.

use super::conventions::{convinces, first_of, settings_of};
use super::source::Held;
use super::{Convention, Coordinates, Layout};
use crate::domain::{Factor, Location};
use crate::verify::{
    Diagnosis, Evidence, Examination, Finding, Report, RowsError, Settings, Verdict, known_constant,
    known_to, recording,
};
use glam::DVec3;

/// The p-value has to rise by this factor: what hardly fails passes under much that is not its mistake.
pub(super) const GAIN: f64 = 1e6;
/// Rows that the axis of a lobe is taken from.
const SOME: usize = 1 << 14;

/// What may follow the words "the density".
enum Mistake {
    /// A factor is missing.
    Lacks(String),
    /// A factor is there once too often.
    Extra(String),
    /// Something else, in words.
    Other(String),
    /// Something else up to a constant, in words; whether that needs a word of its own.
    Shape(String, bool),
}

/// A mistake, and how it is undone: from the place of a sample and its density.
struct Correction {
    name: String,
    mistake: Mistake,
    undo: Undo,
}

type Undo = Box<dyn Fn(&Location, f64) -> f64 + Send + Sync>;

impl Correction {
    /// In words, where the density has to be multiplied by `constant` beside.
    fn words(&self, constant: Option<&Constant>) -> String {
        let of = |factor: &str, constant: Option<String>| match constant {
            None => factor.to_owned(),
            // In front of a name only what needs no brackets there.
            Some(c) if c.contains(['/', '.']) => format!("{factor} times {c}"),
            Some(c) => format!("{c} {factor}"),
        };
        match &self.mistake {
            Mistake::Lacks(factor) => {
                let factor = of(factor, constant.map(|c| c.name.clone()));
                format!(
                    "the density lacks a factor {factor}, most likely: multiplied by it, nothing is wrong"
                )
            }
            Mistake::Extra(factor) => {
                let factor = of(factor, constant.map(|c| c.inverse.clone()));
                format!(
                    "the density has a factor {factor} too many, most likely: divided by it, nothing is wrong"
                )
            }
            Mistake::Other(words) => format!("{words}, nothing is wrong"),
            Mistake::Shape(words, tells) => {
                let constant = if *tells && constant.is_some() { " times a constant" } else { "" };
                format!("{words}{constant}, most likely: held against that, nothing is wrong")
            }
        }
    }
}

/// What a density is to be multiplied by.
struct Constant {
    value: f64,
    name: String,
    /// The name of 1 / value.
    inverse: String,
    /// Whether it is one that is often forgotten.
    known: bool,
}

impl Constant {
    fn new((ratio, error): (f64, f64)) -> Self {
        let tolerance = known_to(error / ratio);
        match (known_constant(ratio, tolerance), known_constant(1.0 / ratio, tolerance)) {
            (Some((name, value)), Some((inverse, _))) => Self { value, name, inverse, known: true },
            _ => {
                let [name, inverse] = [ratio, 1.0 / ratio].map(|x| format!("{x:.3}"));
                Self { value: ratio, name, inverse, known: false }
            }
        }
    }
}

/// All of them, the plainer ones first.
fn corrections<D: Coordinates>(held: &Held, layout: &Layout, convention: &Convention<D>) -> Vec<Correction> {
    let domain = &convention.domain;
    let mut all = Vec::new();
    let factors = domain.factors();
    for power in [1, 2] {
        for &Factor { name, value } in &factors {
            let name = if power == 1 { name.to_owned() } else { format!("({name})^{power}") };
            factor(&mut all, name, move |at| value(at).powi(power));
        }
    }
    for (i, a) in factors.iter().enumerate() {
        for b in &factors[i + 1..] {
            let values = [a.value, b.value];
            factor(&mut all, format!("{} {}", a.name, b.name), move |at| values[0](at) * values[1](at));
        }
    }
    if let Some(axis) = axis_of_lobe(held, layout, convention) {
        let space = domain.clone();
        let cosine = move |at: &Location| space.direction(at).map_or(0.0, |w| w.dot(axis));
        let sine = {
            let cosine = cosine.clone();
            move |at: &Location| (1.0 - cosine(at).powi(2)).max(0.0).sqrt()
        };
        factor(&mut all, "cos of the angle to the lobe's axis".to_owned(), move |at| cosine(at).max(0.0));
        factor(&mut all, "sin of the angle to the lobe's axis".to_owned(), sine);
    }
    let mut other = |name: &str, mistake: Mistake, undo: Undo| {
        all.push(Correction { name: name.to_owned(), mistake, undo });
    };
    let column = |what: &str| {
        Mistake::Other(format!("the column holds {what} the density, most likely: read as that"))
    };
    other("1 / density", column("1 /"), Box::new(|_, p| 1.0 / p));
    other("logarithm of the density", column("the logarithm of"), Box::new(|_, p| p.exp()));
    let power = |what: &str| Mistake::Shape(format!("the samples follow the {what} of the density"), true);
    other("density's square root", power("square root"), Box::new(|_, p| p.sqrt()));
    other("density squared", power("square"), Box::new(|_, p| p * p));
    let uniform = domain.measure().is_finite().then_some(Factor { name: "uniform", value: |_| 1.0 });
    let usual = uniform.into_iter().chain(domain.usual_densities());
    for Factor { name, value } in usual.filter(|usual| !is_claimed(usual, held, layout, convention)) {
        let words = format!("the samples follow another density ({name})");
        other(name, Mistake::Shape(words, false), Box::new(move |at, _| value(at)));
    }
    all
}

fn factor(
    all: &mut Vec<Correction>,
    name: String,
    value: impl Fn(&Location) -> f64 + Clone + Send + Sync + 'static,
) {
    let times = value.clone();
    all.push(Correction {
        name: format!("lacks {name}"),
        mistake: Mistake::Lacks(name.clone()),
        undo: Box::new(move |at, p| p * times(at)),
    });
    all.push(Correction {
        name: format!("extra {name}"),
        mistake: Mistake::Extra(name),
        undo: Box::new(move |at, p| p / value(at)),
    });
}

/// The axis of a lobe that is not about +Z: the mean direction of samples that are all around.
fn axis_of_lobe<D: Coordinates>(held: &Held, layout: &Layout, convention: &Convention<D>) -> Option<DVec3> {
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for point in held.rows(SOME).filter_map(|row| layout.row(convention, row).point) {
        sum += convention.domain.direction(&convention.domain.locate(&point).ok()?)?;
        count += 1.0;
    }
    let axis = sum.normalize_or_zero();
    (sum.length() > 0.1 * count && axis.z < 0.999).then_some(axis)
}

/// Whether the density is this one, up to a constant, at most samples: then the samples don't follow another one, whatever is wrong at the others.
fn is_claimed<D: Coordinates>(
    usual: &Factor,
    held: &Held,
    layout: &Layout,
    convention: &Convention<D>,
) -> bool {
    const EQUAL: f64 = 1e-3;
    let ratio = |row: &[f64]| {
        let row = layout.row(convention, row);
        let at = convention.domain.locate(&row.point?).ok()?;
        Some(row.density? / (usual.value)(&at))
    };
    let mut ratios: Vec<f64> = held.rows(SOME).filter_map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    let Some(&median) = ratios.get(ratios.len() / 2) else { return false };
    2 * ratios.iter().filter(|ratio| (*ratio / median - 1.0).abs() < EQUAL).count() > ratios.len()
}

/// The p-value of the means of 1 / density; 0 where something is wrong for certain.
fn p_of(examination: &Examination) -> f64 {
    let p = |finding: &Finding| match finding.evidence {
        Evidence::Certain(Verdict::Fail) => Some(0.0),
        evidence => evidence.p_values().map(|(_, p)| p).filter(|_| finding.check == "weights"),
    };
    examination.findings.iter().filter_map(p).fold(1.0, f64::min)
}

/// Undoes known mistakes in the densities of the rows that were kept; what makes them pass is the diagnosis. `told` hears what is tried.
///
/// # Errors
/// None that reading memory could give.
pub fn of_densities<D: Coordinates>(
    held: &Held,
    layout: &Layout,
    convention: &Convention<D>,
    settings: &Settings,
    told: &dyn Fn(&str),
) -> Result<Option<Diagnosis>, RowsError> {
    let settings = settings_of(settings);
    let domain = &convention.domain;
    let judged = |undone: Option<(&Correction, f64)>| -> Result<Examination, RowsError> {
        let row = |numbers: &[f64]| {
            let mut row = layout.row(convention, numbers);
            if let (Some((correction, constant)), Some(point), Some(density)) =
                (undone, &row.point, row.density)
                && let Ok(at) = domain.locate(point)
            {
                row.density = Some(constant * (correction.undo)(&at, density));
            }
            row
        };
        recording(domain.clone(), held.again(), row)?.examine(&settings)
    };
    let before = judged(None)?;
    let least = GAIN * p_of(&before);
    let of_densities = |check: &str| matches!(check, "weights" | "support");
    let report = Report::new(vec![before], &settings);
    let failed = || report.conclusions.iter().flatten().filter(|c| c.verdict == Verdict::Fail);
    // So few rows don't show what is wrong, or something is that is not in the densities.
    if failed().count() == 0 || failed().any(|c| !of_densities(c.finding.check)) {
        return Ok(None);
    }
    let mut found: Vec<(u8, (String, String))> = Vec::new();
    for correction in corrections(held, layout, convention) {
        if settings.stopped() {
            return Ok(None);
        }
        told(&correction.name);
        let passes =
            |examination: Examination| p_of(&examination) > least && convinces(examination, &settings);
        let examination = judged(Some((&correction, 1.0)))?;
        let ratio = examination.common_ratio;
        let (rank, words) = if passes(examination) {
            (0, correction.words(None))
        } else {
            let Some(constant) = ratio.map(Constant::new) else { continue };
            let rank = match correction.mistake {
                Mistake::Other(_) => continue,
                // Whatever a density is to be divided by for an integral of 1.
                Mistake::Shape(_, tells) => 1 + u8::from(tells),
                Mistake::Lacks(_) | Mistake::Extra(_) => 2 - u8::from(constant.known),
            };
            if !passes(judged(Some((&correction, constant.value)))?) {
                continue;
            }
            (rank, correction.words(Some(&constant)))
        };
        found.push((rank, (correction.name, words)));
    }
    found.sort_by_key(|(rank, _)| *rank); // stable: the plainer one first
    Ok(first_of(found.into_iter().map(|(_, found)| found), &settings))
}
