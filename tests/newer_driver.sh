#!/usr/bin/env bash
# Runs the GPU tests on a newer software driver than the system's: lavapipe of Debian unstable, in
# its own folder. It has cooperative matrices (8 by 8) and runs the trainer's kernels, on which the
# driver of Mesa 22.3 crashes. Needs root and debootstrap. Building the trainer with Vulkan takes
# long.
#
#   tests/newer_driver.sh [FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."

# cargo calls the script with --exec as its runner: it then runs a test program inside the folder.
if [ "${1:-}" = --exec ]; then
    folder=$2 program=$3
    shift 3
    install "$program" "$folder/test"
    exec chroot "$folder" /test "$@"
fi

folder=$(realpath -m "${1:-target/newer_driver}")
if [ ! -e "$folder/usr/share/vulkan" ]; then
    debootstrap --variant=minbase --include=mesa-vulkan-drivers,libvulkan1 sid "$folder"
fi
mountpoint -q "$folder/proc" || mount --bind /proc "$folder/proc"
trap 'umount "$folder/proc"' EXIT

export CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUNNER="$PWD/tests/newer_driver.sh --exec $folder"
cargo test -p unic-gpu --tests -- --nocapture
cargo test -p unic-train --features vulkan --test processor -- --nocapture
