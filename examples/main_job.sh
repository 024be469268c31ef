#!/bin/sh
# The main job on a capture: learn the garment, measure it on clips that it has never seen, animate
# it on any motion.
#
#   examples/main_job.sh CAPTURE MOTION.npz [BUDGET] [OUT]
#
# CAPTURE is a folder (docs/reference/capture.md). BUDGET is a training time such as 45m; without it
# the preset's number of steps counts. OUT is the folder of the results.
set -eu
capture=${1:?CAPTURE, a folder with capture.toml}
motion=${2:?MOTION.npz, poses for the same skeleton}
budget=${3:-}
out=${4:-runs/$(basename "$capture")}

cargo build --release -p unic-cli
unic=${CARGO_TARGET_DIR:-target}/release/unic
if [ -f "$out/garment.run/config.toml" ]; then
    "$unic" train "$capture" --resume --out "$out/garment.unic"
else
    "$unic" train "$capture" ${budget:+--budget "$budget"} --out "$out/garment.unic"
fi
"$unic" eval "$out/garment.unic" "$capture" --pictures "$out/worst"
"$unic" animate "$out/garment.unic" --motion "$motion" --out "$out/garment.pc2" --overwrite
