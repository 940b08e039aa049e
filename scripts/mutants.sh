#!/usr/bin/env bash
# Mutants of a folder and the tests that judge it: `scripts/mutants.sh [statistics|sampler|verify] [SHARD] [OPTION …]`, SHARD like 0/20 (every
# twentieth mutant). Needs `cargo install cargo-mutants --locked`. All of it takes days on two cores; what a run found is in docs/mutants.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folders=("${1:-statistics}")
(($#)) || folders=(statistics sampler verify)
shard=${2:-}

for folder in "${folders[@]}"; do
    # Without the statistical tests that take minutes; the unit tests of what stands beside the folder are quick.
    unit=(domain:: fault:: oracle:: random:: sampler:: units::)
    binaries=(it)
    case $folder in
    statistics) tests=(statistics::) ;;
    sampler) tests=(by_hand:: properties:: environment:: oracles:: broken::) ;;
    verify) unit+=(verify::) binaries+=(by_hand) tests=(by_hand:: counts:: diagnoses:: films_and_means:: jacobians:: mistakes:: pairs:: relations:: reports:: rows:: sequences::
        streams:: variates:: weights:: checks:: broken:: metamorphic:: two_samples::) ;;
    *) echo "no folder $folder: statistics, sampler or verify" >&2; exit 2 ;;
    esac
    # Without the doctests, which cost a link each. Exit code 2 means that some mutants survived: the other folders are still to be done.
    cargo mutants --file "src/$folder/**/*.rs" ${shard:+--shard "$shard" --sharding round-robin} \
        --output "mutants.out.$folder" --cargo-arg=--lib "${binaries[@]/#/--cargo-arg=--test=}" "${@:3}" \
        -- -- "${unit[@]}" "${tests[@]}" || (($? == 2))
done
