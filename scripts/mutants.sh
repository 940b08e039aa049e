#!/usr/bin/env bash
# Mutants of a folder and the tests that judge it: `scripts/mutants.sh [statistics|sampler|verify] [SHARD] [OPTION …]`, SHARD like 0/20 (every
# twentieth mutant). Needs `cargo install cargo-mutants --locked`. All of it takes the better part of a day; what a run found is in docs/mutants.md.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folders=("${1:-statistics}")
(($#)) || folders=(statistics sampler verify)
shard=${2:-}

for folder in "${folders[@]}"; do
    # Without the doctests, which cost a link each, and the statistical tests that take minutes.
    case $folder in
    statistics) tests=(--lib --test statistics) ;;
    sampler) tests=(--lib --test properties --test environment --test oracles --test broken) ;;
    verify) tests=(--lib --test checks --test broken --test metamorphic --test two_samples) ;;
    *) echo "no folder $folder: statistics, sampler or verify" >&2; exit 2 ;;
    esac
    # As arguments of every cargo command, so that the other tests aren't even built. Exit code 2 means that some mutants survived: the other
    # folders are still to be done.
    cargo mutants --file "src/$folder/**/*.rs" ${shard:+--shard "$shard" --sharding round-robin} \
        --output "mutants.out.$folder" "${tests[@]/#/--cargo-arg=}" "${@:3}" || (($? == 2))
done
