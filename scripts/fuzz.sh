#!/usr/bin/env bash
# Fuzzes every reader for so many seconds each: `scripts/fuzz.sh [SECONDS] [TARGET …]`. Needs `cargo install cargo-fuzz --locked` and a C++
# compiler; stable Rust will do, without a sanitizer. What it finds is left in fuzz/artifacts and ends the run with an error.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds=${1:-60}
targets=("${@:2}")
((${#targets[@]})) || targets=(hdr exr obj mtl scene samples)

# The seeds: small files under fuzz/seeds, and what ships.
declare -A shipped=([obj]=data/scene/cornell_measured.obj [mtl]="data/scene/*.mtl" [scene]="data/scene/*.toml")
for target in "${targets[@]}"; do
    corpus=fuzz/corpus/$target
    mkdir -p "$corpus"
    # shellcheck disable=SC2086 # the patterns are meant to be expanded
    cp $(compgen -G "fuzz/seeds/$target/*") ${shipped[$target]:-} "$corpus"
done
for target in "${targets[@]}"; do
    echo "=== $target, $seconds s"
    cargo fuzz run -s none "$target" -- -max_total_time="$seconds" -max_len=16384 -timeout=10 -rss_limit_mb=2048 \
        -dict=fuzz/words.dict -print_final_stats=1
done
