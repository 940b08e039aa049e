//! One run: what each check says at each level, and its p-values.

use super::LEVELS;
use crate::verify::{Evidence, Examination, Report, Settings, Verdict};

/// No p-value of a right sampler is below it, so that at this level nothing is suspicious.
const UNSUSPICIOUS: f64 = 1e-300;

/// What was made of some findings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    /// At each of the levels.
    pub verdicts: [Verdict; 3],
    /// How many p-values they have.
    pub tests: u64,
    /// Whether one of them fails without chance.
    pub certain: bool,
}

/// What one run showed.
pub(super) struct Observation {
    pub seed: u64,
    pub whole: Judged,
    /// Of each check that had an answer, alone.
    pub checks: Vec<(&'static str, Judged)>,
    /// Check, part, and p-value as computed.
    pub p_values: Vec<(&'static str, String, f64)>,
    /// Check and figures of what failed without chance.
    pub certain: Vec<(&'static str, String)>,
}

pub(super) fn observe(examine: &dyn Fn(&Settings) -> Examination, settings: &Settings) -> Observation {
    let at = |alpha: f64| examine(&Settings { alpha, ..settings.clone() });
    let mut examination = at(UNSUSPICIOUS);
    let mut checks: Vec<&'static str> = Vec::new();
    for finding in examination.findings.iter().filter(|f| f.evidence != Evidence::Unanswered) {
        if !checks.contains(&finding.check) {
            checks.push(finding.check);
        }
    }
    let mut p_values = Vec::new();
    let mut certain = Vec::new();
    for finding in &examination.findings {
        if let Some((p, _)) = finding.evidence.p_values() {
            p_values.push((finding.check, finding.part.clone(), p));
        }
        if finding.evidence == Evidence::Certain(Verdict::Fail) {
            certain.push((finding.check, finding.detail.clone()));
        }
    }
    let subjects: Vec<Option<&str>> = checks.iter().copied().map(Some).chain([None]).collect();
    let mut judged: Vec<Judged> = subjects
        .iter()
        .map(|&only| {
            let of = || examination.findings.iter().filter(move |f| only.is_none_or(|name| f.check == name));
            Judged {
                verdicts: [Verdict::Pass; 3],
                tests: of().filter(|f| f.evidence.p_values().is_some()).count() as u64,
                certain: of().any(|f| f.evidence == Evidence::Certain(Verdict::Fail)),
            }
        })
        .collect();
    for (level, alpha) in LEVELS.into_iter().enumerate() {
        let (mut verdicts, same) = judge(examination, &subjects, alpha);
        examination = same;
        // What fails by chance is examined once more before it fails.
        let by_chance = verdicts.iter().zip(&judged).any(|(v, j)| *v == Verdict::Fail && !j.certain);
        if by_chance {
            verdicts = judge(at(alpha), &subjects, alpha).0;
        }
        judged.iter_mut().zip(verdicts).for_each(|(judged, verdict)| judged.verdicts[level] = verdict);
    }
    let whole = judged.pop().unwrap_or(Judged { verdicts: [Verdict::Pass; 3], tests: 0, certain: false });
    Observation {
        seed: settings.seed,
        whole,
        checks: checks.into_iter().zip(judged).collect(),
        p_values,
        certain,
    }
}

/// The verdict at level `alpha` on the findings of one check each, or on all of them, and the examination again.
fn judge(mut examination: Examination, subjects: &[Option<&str>], alpha: f64) -> (Vec<Verdict>, Examination) {
    let settings = Settings { alpha, ..Settings::default() };
    let all = std::mem::take(&mut examination.findings);
    let mut verdicts = Vec::new();
    for only in subjects {
        let mine = all.iter().filter(|f| only.is_none_or(|name| f.check == name));
        examination.findings = mine.cloned().collect();
        let mut report = Report::new(vec![examination], &settings);
        verdicts.push(report.verdict());
        examination = report.examinations.swap_remove(0);
    }
    examination.findings = all;
    (verdicts, examination)
}
