#!/usr/bin/env bash
# Makes the pictures of README.md anew, in docs/. Some minutes on two cores, and a quarter of an hour for the calibration.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
warpcheck() { cargo run --release --quiet -- "$@" --out "$out"; }
warpcheck verify
cp "$out/overview.png" docs/overview.png
warpcheck verify broken/environment/sine-missing || [ $? = 1 ] # it is broken
cp "$out/broken-environment-sine-missing.png" docs/failure.png
warpcheck histogram data/env/spruit_sunrise_512.hdr --samples 10M
cp "$out/spruit_sunrise_512-10M.png" docs/histogram.png
warpcheck render data/scene/veach_a3.toml --sheet --exposure 20
cp "$out/veach_a3-sheet.png" docs/sheet.png
warpcheck converge data/scene/veach_a3.toml --strategy brdf,light,mis:0.5,mis:auto,mis-two --spp 96
cp "$out/veach_a3-converge.svg" docs/converge.svg
for scene in veach_a3 cornell furnace spot_env lamps_and_sky three_spheres; do
    echo "== $scene" && cargo run --release --quiet -- plan "data/scene/$scene.toml"
done >docs/plans.txt
WARPCHECK_SCREENSHOTS="$out" cargo test --release --test it samplers_in_a_browser -- --ignored # wants chromium and chromedriver
cp "$out/report.png" docs/report.png
cp "$out/report-phone.png" docs/report-phone.png
warpcheck calibrate
cp "$out/calibration.svg" docs/calibration.svg
GROWTH=docs/growth.svg cargo bench --quiet --bench ratios -- growth
