#!/usr/bin/env bash
# Makes src/recurrence/pretrained.safetensors, the unit that recurrences start from.
#
#   cargo build --release -p unic-cli -p unic-lab
#   crates/unic-train/pretrain.sh WORK_FOLDER LOCOMOTION_FOLDER
#
# LOCOMOTION_FOLDER holds the 21 motions of the O3DE gem MotionMatching (Apache-2.0 or MIT) as AMASS npz
# files of SMPL's joints. The two that the accuracy page tests on are left out, as are the motions
# that the demo tests on. $UNIC and $UNIC_LAB name the programs (default: those in target/release).
# Two cores take half an hour.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
unic=${UNIC:-$here/../../target/release/unic}
lab=${UNIC_LAB:-$here/../../target/release/unic-lab}
work=${1:?expected a folder to work in}
motions=${2:?expected the folder of the locomotion motions}

names=(idle walk_speeds walk_circles walk_slalom walk_starts_stops run_speeds run_circles run_slalom
    run_starts_stops squats_jumps arms_trunk mixed sprint_stop)
motion=()
for file in "$motions"/*.npz; do
    case $file in
    */TurnOnSpot1.npz | */Acceleration1.npz) ;;
    *) motion+=("$file") ;;
    esac
done

"$lab" wardrobe "$work/wardrobe" --overwrite
captures=()
for garment in loose_shirt tight_shirt long_skirt short_skirt; do
    # The first 20 s of each motion. sprint_stop is held out.
    "$unic" simulate --garment "$work/wardrobe/$garment" --motion "${motion[@]}" "${names[@]}" \
        --test sprint_stop --seconds 20 --out "$work/$garment" --overwrite
    captures+=("$work/$garment")
done
"$lab" pretrain "${captures[@]}" --out "$here/src/recurrence/pretrained.safetensors" --overwrite
