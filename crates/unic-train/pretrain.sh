#!/usr/bin/env bash
# Makes src/recurrence/pretrained.safetensors, the unit that recurrences start from.
#
#   cargo build --release -p unic-cli -p unic-lab
#   crates/unic-train/pretrain.sh WORK_FOLDER LOCOMOTION_FOLDER
#
# LOCOMOTION_FOLDER holds the 21 motions of the O3DE gem MotionMatching (copyright Contributors to
# the Open 3D Engine, Apache-2.0 or MIT) as AMASS npz files of SMPL's joints. The five that tables
# test on are left out, as are the demo's motions. $UNIC and $UNIC_LAB name the programs (default:
# those in target/release). Two cores take half an hour.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
unic=${UNIC:-$here/../../target/release/unic}
lab=${UNIC_LAB:-$here/../../target/release/unic-lab}
work=${1:?expected a folder to work in}
motions=${2:?expected the folder of the locomotion motions}

names=(idle run_speeds run_slalom run_starts_stops squats_jumps sprint_stop)
motion=()
for file in "$motions"/*.npz; do
    case $file in
    */TurnOnSpot1.npz | */Acceleration1.npz | */Snake1.npz) ;;
    */FreeRoaming2.npz | */WalkStopTurnPivot1.npz) ;;
    *) motion+=("$file") ;;
    esac
done

if [ ${#motion[@]} -ne 16 ]; then
    echo "$motions: expected 16 motions to learn from, found ${#motion[@]}" >&2
    exit 1
fi

"$lab" wardrobe "$work/wardrobe" --overwrite
captures=()
for garment in loose_shirt tight_shirt long_skirt short_skirt; do
    # The first 20 s of each motion. sprint_stop is held out.
    "$unic" simulate --garment "$work/wardrobe/$garment" --motion "${motion[@]}" "${names[@]}" \
        --test sprint_stop --seconds 20 --out "$work/$garment" --overwrite
    captures+=("$work/$garment")
done
"$lab" pretrain "${captures[@]}" --out "$here/src/recurrence/pretrained.safetensors" --overwrite
