//! Broken samplers: each is a working sampler with one mistake, most of them seen in public.
//!
//! A check is worth what it catches. [`all`] lists the faults with their correct twins, [`examine`] runs the battery on one of them: it is the battery's
//! own mutation test. `warpcheck faults` prints the table.
//!
//! Most are samplers ([`Trial`]); what shows in no density is a builder of tables, a set of streams, a film or an estimator ([`Specimen`]).

mod discrete;
mod environment;
mod estimators;
mod examination;
mod lobes;
mod solid_angle;
mod specimen;
mod triangle;

pub use examination::{Help, Outcome, Plan, Score, examine, examine_twin};
pub use specimen::{Boxed, Specimen, Trial};

/// A correct specimen.
#[derive(Clone, Copy)]
pub struct Twin {
    /// What it is; twins of one name are the same.
    pub name: &'static str,
    make: fn() -> Specimen,
}

impl Twin {
    const fn new(name: &'static str, make: fn() -> Specimen) -> Self {
        Self { name, make }
    }

    /// Makes it.
    pub fn make(&self) -> Specimen {
        (self.make)()
    }
}

/// A specimen with one mistake.
#[derive(Clone, Copy)]
pub struct Fault {
    /// Its name: family, then what sets it apart.
    pub name: &'static str,
    /// What is wrong.
    pub wrong: &'static str,
    /// Where it, or one of its kind, was seen in public, or what it imitates.
    pub seen: &'static str,
    /// The check that should catch it, one of those named.
    pub caught_by: &'static [&'static str],
    /// Names of diagnoses that are right. Where counts are not what gives it away, the part of the check that does.
    pub diagnoses: &'static [&'static str],
    /// Whether it is a sampler.
    sampler: bool,
    /// Whether it was kept aside while the checks that the collection asked for were written.
    pub held_back: bool,
    /// The same without the mistake.
    pub twin: Twin,
    broken: fn() -> Specimen,
}

impl Fault {
    const fn new(name: &'static str, wrong: &'static str, twin: Twin, broken: fn() -> Specimen) -> Self {
        Self {
            name,
            wrong,
            seen: "",
            caught_by: &[],
            diagnoses: &[],
            sampler: true,
            held_back: false,
            twin,
            broken,
        }
    }

    const fn seen(self, seen: &'static str) -> Self {
        Self { seen, ..self }
    }

    const fn caught(self, caught_by: &'static [&'static str], diagnoses: &'static [&'static str]) -> Self {
        Self { caught_by, diagnoses, ..self }
    }

    /// No sampler: there is nothing to draw pictures of.
    const fn no_sampler(self) -> Self {
        Self { sampler: false, ..self }
    }

    const fn held_back(self) -> Self {
        Self { held_back: true, ..self }
    }

    /// Makes it.
    pub fn make(&self) -> Specimen {
        (self.broken)()
    }

    /// Whether it is a sampler, and not a builder, a film, streams or an estimator.
    pub fn is_sampler(&self) -> bool {
        self.sampler
    }

    /// The part of the name before the slash.
    pub fn family(&self) -> &'static str {
        self.name.split('/').next().unwrap_or(self.name)
    }
}

/// All faults, family by family.
///
/// ```
/// let faults = warpcheck::fault::all();
/// assert!(faults.len() >= 60);
/// let fault = faults.iter().find(|f| f.name == "lobes/uniform-for-cosine").unwrap();
/// let report = fault.make().examine(fault.name, &warpcheck::verify::Settings { samples: 10_000, ..Default::default() });
/// assert!(report.diagnosis.unwrap().is("uniform"));
/// ```
pub fn all() -> Vec<Fault> {
    [
        discrete::faults(),
        triangle::faults(),
        solid_angle::faults(),
        environment::faults(),
        lobes::faults(),
        estimators::faults(),
    ]
    .concat()
}

/// The fault of this name.
pub fn named(name: &str) -> Option<Fault> {
    all().into_iter().find(|fault| fault.name == name)
}
