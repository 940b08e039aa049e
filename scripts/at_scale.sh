#!/usr/bin/env bash
# Verifies every sampler that ships at 1e8 samples, and the four core ones (selection by weights, barycentric warp, mesh light by area, environment map)
# at 1e9: is the resolution of variates, tables and f32 arithmetic good enough not to be seen? An hour and more on two cores.
#
#   scripts/at_scale.sh [FOLDER]                      reports and pictures go there; warpcheck-out/at-scale unless told
#   SAMPLES=1M CORE_SAMPLES=10M scripts/at_scale.sh   a rehearsal
#
# Exit code: 0 if all pass, 1 if something fails, 3 if something is inconclusive, 2 if a run could not be made.
set -uo pipefail
out=$(realpath -m "${1:-$(dirname "$0")/../warpcheck-out/at-scale}")
cd "$(dirname "$0")/.." || exit 2
mkdir -p "$out" && cargo build --release --quiet || exit 2

status=0
verify() { # verify NAME COUNT SAMPLER…
    local name=$1 samples=$2 code
    shift 2
    echo "== $name: $samples samples each"
    target/release/warpcheck verify "$@" --samples "$samples" --out "$out/$name" --json "$out/$name.json"
    code=$?
    [ "$code" = 130 ] && exit 130
    # A failure outweighs a run that could not be made, which outweighs an inconclusive one.
    case "$status,$code" in
    *,0 | 1,* | 2,3) ;;
    *) status=$code ;;
    esac
}

verify all "${SAMPLES:-100M}"
verify core "${CORE_SAMPLES:-1G}" discrete/areas-teapot triangle/low-distortion light/cornell-from-floor \
    environment/spruit_sunrise_512/uniform-v
exit "$status"
