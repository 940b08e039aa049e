#!/usr/bin/env bash
# Judges samplers that nobody here wrote. Needs requirements.txt installed; WARPCHECK and PYTHON name the programs.
# Usage: run.sh [COUNT]; prints one line for each. Not part of any test.
set -uo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
warpcheck=${WARPCHECK:-$here/../../../target/release/warpcheck} python=${PYTHON:-python3}
count=${1:-1000000}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# What was asked, and the line of the table; of what did not pass also why.
judge() {
    local title=$1; shift
    local said; said=$("$warpcheck" check "$@" --name "$title" 2>&1)
    local code=$?
    printf '%d  %s\n' "$code" "$(grep -m1 -F "$title " <<<"$said" || head -1 <<<"$said")"
    [ $code = 0 ] || grep -E '^  (diagnosis|fail|inconclusive)' <<<"$said" | cut -c1-300
}

"$python" "$here/samples.py" "$folder" "$count"
for name in numpy-sphere scipy-vmf-1 scipy-vmf-30 scipy-uniform-direction broken-sphere; do
    judge $name "$folder/$name.npy" --domain sphere
done
for name in scipy-dirichlet-flat scipy-dirichlet; do judge $name "$folder/$name.npy" --domain triangle; done
judge scipy-beta "$folder/scipy-beta.npy" --domain interval
judge scipy-truncnorm "$folder/scipy-truncnorm.npy" --domain interval:0.2:0.8
judge numpy-choice "$folder/numpy-choice.npy" --domain discrete:6

map=$here/../../../data/env/noon_grass_512.hdr
ask() { judge "mitsuba-$1" --sampler "$python $here/mitsuba_sampler.py $2" --samples "$count" --timeout 60; }
ask uniform-sphere square-to-uniform_sphere
ask cosine-hemisphere square-to-cosine_hemisphere
ask disk-concentric square-to-uniform_disk_concentric
ask vmf-30 "square-to-von_mises_fisher 30"
ask ggx-visible-0.3 "ggx 0.3"
ask ggx-all-0.3 "ggx-all 0.3"
ask beckmann-visible-0.3 "beckmann 0.3"
ask envmap "envmap $map"
