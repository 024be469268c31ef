#!/usr/bin/env bash
# Makes the garments that come with `unic`: tshirt.unic and skirt.unic beside this script.
#
#   cargo build --release -p unic-cli
#   apps/unic-cli/garments/make.sh WORK_FOLDER [GARMENT...]
#
# WORK_FOLDER gets the motion, the captures and the training runs, about 1.2 GB. $UNIC names the
# program (default: target/release/unic). Two cores take about an hour in all. A training takes up
# to 13 GB of memory.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
unic=${UNIC:-$here/../../../target/release/unic}
work=${1:?expected a folder to work in}
shift
garments=("$@")
[ ${#garments[@]} -gt 0 ] || garments=(tshirt skirt)
mkdir -p "$work"

# Motion of the built-in human, steered on the built-in clips. Test motion has a seed of its own.
for seed in 1 2 3 12; do
    "$unic" bench control --seed "$seed" --write-motion "$work/motion" --overwrite >"$work/control_$seed.txt"
done

motion=()
for name in circle_1 square_1 slalom_1 reversals_1 start_stop_1 random_stick_1 random_stick_2 \
    random_mouse_1 random_mouse_2 random_mouse_3 random_mouse_12; do
    motion+=("$work/motion/$name.npz")
done

for garment in "${garments[@]}"; do
    # The built-in clip `idle` is half a minute of standing.
    "$unic" simulate --garment "$garment" --motion idle "${motion[@]}" --test random_mouse_12 \
        --out "$work/$garment" --overwrite
    "$unic" train "$work/$garment" --preset standard --seed 1 \
        --out "$work/$garment.unic" --overwrite
    "$unic" eval "$work/$garment.unic" "$work/$garment" | tee "$work/$garment.txt"
    cp "$work/$garment.unic" "$here/$garment.unic"
done
