//! Judges the findings of a whole run together.

use super::examination::{Against, Examination};
use super::finding::{Evidence, Finding, Verdict};
use super::power::Power;
use super::settings::Settings;
use crate::statistics::multiplicity::holm;
use std::fmt::{Display, Formatter};

/// A finding with its verdict, after correction over the whole run.
#[derive(Clone, Debug)]
pub struct Conclusion {
    /// The verdict.
    pub verdict: Verdict,
    /// The corrected p-value, the largest that the errors of the expected counts allow; `None` if no chance was involved.
    pub adjusted_p: Option<f64>,
    /// The finding.
    pub finding: Finding,
}

/// Everything that a run found, judged.
#[derive(Debug)]
pub struct Report {
    /// The samplers, in the order in which they were examined.
    pub examinations: Vec<Examination>,
    /// What was concluded of each, in the order of its findings.
    pub conclusions: Vec<Vec<Conclusion>>,
    /// Probability that a run of right samplers fails, at most.
    pub alpha: f64,
    /// The seed.
    pub seed: u64,
    /// Samples asked for, per sampler.
    pub samples: u64,
    /// p-values corrected together.
    pub tests: u64,
}

impl Report {
    /// Judges examinations together.
    pub fn new(examinations: Vec<Examination>, settings: &Settings) -> Self {
        // A p-value that could not be computed fails nobody; it makes its finding inconclusive below.
        let known = |p: f64| if p.is_nan() { 1.0 } else { p };
        let chances = |pick: fn(f64, f64) -> f64| {
            let all: Vec<f64> = examinations
                .iter()
                .flat_map(|e| &e.findings)
                .filter_map(|f| f.evidence.p_values())
                .map(|(p, conservative)| known(pick(p, conservative)))
                .collect();
            holm(&all).unwrap_or_else(|_| vec![1.0; all.len()]).into_iter()
        };
        let (mut raw, mut conservative) = (chances(|p, _| p), chances(|_, c| c));
        let tests = raw.len() as u64;
        let alpha = settings.own_alpha();
        let mut conclude = |finding: &Finding| {
            let (verdict, adjusted_p) = match (finding.evidence, finding.evidence.p_values()) {
                (Evidence::Certain(verdict), _) => (verdict, None),
                (_, None) => (Verdict::Inconclusive, None),
                (_, Some((p, _))) => {
                    let (raw, sure) = (raw.next().unwrap_or(1.0), conservative.next().unwrap_or(1.0));
                    let verdict = if !(sure >= alpha) {
                        Verdict::Fail
                    } else if raw < alpha || p.is_nan() {
                        Verdict::Inconclusive
                    } else {
                        Verdict::Pass
                    };
                    (verdict, Some(sure))
                }
            };
            Conclusion { verdict, adjusted_p, finding: finding.clone() }
        };
        let conclusions =
            examinations.iter().map(|e| e.findings.iter().map(&mut conclude).collect()).collect();
        Self { conclusions, alpha, seed: settings.seed, samples: settings.samples, tests, examinations }
    }

    /// The verdict on one sampler: the worst of its findings, of those that have an answer.
    pub fn verdict_on(&self, sampler: usize) -> Verdict {
        let answered =
            self.conclusions[sampler].iter().filter(|c| c.finding.evidence != Evidence::Unanswered);
        answered.map(|c| c.verdict).max().unwrap_or(Verdict::Inconclusive)
    }

    /// The verdict on the run: the worst of all.
    pub fn verdict(&self) -> Verdict {
        (0..self.examinations.len()).map(|i| self.verdict_on(i)).max().unwrap_or(Verdict::Inconclusive)
    }

    /// The smallest corrected p-value of a sampler.
    pub fn adjusted_p(&self, sampler: usize) -> Option<f64> {
        self.conclusions[sampler].iter().filter_map(|c| c.adjusted_p).min_by(f64::total_cmp)
    }

    /// The level at which each single test was made, at least: alpha shared among all tests.
    pub fn level(&self) -> f64 {
        self.alpha / self.tests.max(1) as f64
    }
}

/// A line for every sampler; for one that did not pass, what was found and where.
impl Display for Report {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        for (i, examination) in self.examinations.iter().enumerate() {
            let verdict = self.verdict_on(i);
            writeln!(
                f,
                "{verdict}: {} ({}, {} samples, seed {})",
                examination.name, examination.domain, examination.samples, self.seed
            )?;
            if verdict == Verdict::Pass {
                let power = examination.power(self.level());
                if !power.is_empty() {
                    let each =
                        |p: &Power| format!("{:.2}% over any {}%", 100.0 * p.error, (100.0 * p.mass).round());
                    let all: Vec<String> = power.iter().map(each).collect();
                    writeln!(
                        f,
                        "  would have caught, with probability 0.99, a relative error of {} of the mass in one piece",
                        all.join(", or ")
                    )?;
                }
                continue;
            }
            self.write_failure(f, i)?;
            let call = match examination.against {
                Against::Density => "verify(&sampler)",
                Against::Sampler(_) => "verify::compare(&first, &second)",
                Against::Points(_) | Against::Given | Against::OwnDensities | Against::Relations => continue, // the points are the caller's
            };
            writeln!(
                f,
                "  replay: warpcheck::{call}.samples({}).seed({}).alpha({})",
                examination.samples, self.seed, self.alpha
            )?;
        }
        Ok(())
    }
}

impl Report {
    /// What is wrong with one sampler: the findings that did not pass, and the worst places.
    pub fn write_failure(&self, f: &mut impl std::fmt::Write, sampler: usize) -> std::fmt::Result {
        let examination = &self.examinations[sampler];
        let mut by_counts = false;
        let (integral, error) = examination.integral;
        if matches!(examination.against, Against::Density | Against::Given) && !integral.is_nan() {
            write!(f, "  the density integrates to {integral:.6} +- {error:.0e}; ")?;
            writeln!(f, "{} of {} samples were rejected", examination.rejected, examination.samples)?;
        }
        if let Some(diagnosis) = &examination.diagnosis {
            writeln!(f, "  diagnosis: {}", diagnosis.text)?;
        }
        // Of each check the part that says it most clearly; the others say the same.
        let bad = || self.conclusions[sampler].iter().filter(|c| c.verdict != Verdict::Pass);
        let alike = |a: &Conclusion, b: &Conclusion| {
            (a.verdict, a.finding.check, a.adjusted_p.is_some())
                == (b.verdict, b.finding.check, b.adjusted_p.is_some())
        };
        for (i, conclusion) in bad().enumerate() {
            let p = |c: &Conclusion| c.adjusted_p.unwrap_or(0.0);
            let better = |(j, other): (usize, &Conclusion)| {
                alike(conclusion, other) && (p(other) < p(conclusion) || p(other) == p(conclusion) && j < i)
            };
            if bad().enumerate().any(better) {
                continue;
            }
            let finding = &conclusion.finding;
            write!(f, "  {}: {}", conclusion.verdict, finding.check)?;
            if !finding.part.is_empty() {
                write!(f, " ({})", finding.part)?;
            }
            write!(f, ": {}", finding.detail)?;
            if let Some(p) = conclusion.adjusted_p {
                by_counts = true;
                let p = p_value(p);
                write!(f, "; p {p} after correction for {} tests, level {}", self.tests, self.alpha)?;
            }
            match bad().filter(|other| alike(conclusion, other)).count() {
                1 => writeln!(f)?,
                parts => writeln!(f, "; and {} more of its parts", parts - 1)?,
            }
        }
        if by_counts {
            let worst = examination.worst_cells(5);
            if !worst.is_empty() {
                writeln!(f, "  worst places:")?;
            }
            for cell in worst {
                let residual = cell.residual();
                let sigmas =
                    if residual.abs() < 1e6 { format!("{residual:+.1}") } else { format!("{residual:+.1e}") };
                writeln!(
                    f,
                    "    {sigmas:>9} sigma  {} samples, {:.1} expected  at {}",
                    cell.observed, cell.expected, cell.place
                )?;
            }
        }
        Ok(())
    }
}

/// A p-value with its relation: "= 0.31", "= 2.4e-7", "< 1e-300" where it has no number left.
pub(crate) fn p_value(p: f64) -> String {
    match p {
        p if p < 1e-300 => "< 1e-300".to_owned(),
        p if p < 0.01 => format!("= {p:.1e}"),
        p => format!("= {p:.2}"),
    }
}
