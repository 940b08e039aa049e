//! The examples say what they claim: right variants pass, broken ones fail.

use warpcheck::verify::Verdict;

#[allow(dead_code)]
#[path = "../../examples/anytime.rs"]
mod anytime;
#[allow(dead_code)]
#[path = "../../examples/deltas_and_rejection.rs"]
mod deltas_and_rejection;
#[allow(dead_code)]
#[path = "../../examples/domains.rs"]
mod domains;
#[allow(dead_code)]
#[path = "../../examples/own_sampler.rs"]
mod own_sampler;
#[allow(dead_code)]
#[path = "../../examples/own_table.rs"]
mod own_table;
#[allow(dead_code)]
#[path = "../../examples/without_density.rs"]
mod without_density;

#[track_caller]
fn told_apart(verdicts: &[[Verdict; 2]]) {
    for (i, pair) in verdicts.iter().enumerate() {
        assert_eq!(*pair, [Verdict::Pass, Verdict::Fail], "pair {i}");
    }
}

#[test]
fn own_sampler_is_told_apart() {
    told_apart(&own_sampler::verdicts());
}

#[test]
fn domains_are_told_apart() {
    told_apart(&domains::verdicts());
}

#[test]
fn deltas_and_rejection_are_told_apart() {
    told_apart(&deltas_and_rejection::verdicts());
}

#[test]
fn samples_without_density_are_told_apart() {
    told_apart(&without_density::verdicts().unwrap());
}

#[test]
fn anytime_runs_are_told_apart() {
    told_apart(&anytime::verdicts());
}

#[test]
fn own_tables_are_told_apart() {
    told_apart(&own_table::verdicts());
}
