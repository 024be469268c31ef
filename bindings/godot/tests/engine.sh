#!/usr/bin/env bash
# Runs the extension in a Godot: tests/engine.sh GODOT LIBRARY [SCRIPT [OPTION...]]
#
# GODOT is the engine, LIBRARY a built libgodot_unic.so. SCRIPT of tests/project is test.gd unless it is
# given. OPTIONs replace --headless. The motion and the expected vertices come from the example
# `expected`, which uses unic-core alone. Without SCRIPT the project in example runs, too.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
godot=$1
library=$(realpath "$2")
script=${3:-test.gd}
options=("${@:4}")
garments=$here/../../../apps/unic-cli/garments
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
project=$scratch/bindings/godot/test
mkdir -p "$project"

cp "$here"/project/* "$here/../unic.gdextension" "$library" "$garments/tshirt.unic" "$project"
(cd "$here/.." && cargo run --release --locked --quiet --example expected -- "$garments/tshirt.unic" "$project")

# The settings and caches of the user stay as they are.
export HOME=$scratch/home XDG_DATA_HOME=$scratch/home XDG_CONFIG_HOME=$scratch/home XDG_CACHE_HOME=$scratch/home
mkdir -p "$HOME"

# Runs the engine on a project.
engine() {
    local folder=$1
    shift
    # The editor writes this list when it opens a project. Without a window it aborts at its end when it
    # finds an extension for the first time (godotengine/godot#111048).
    mkdir -p "$folder/.godot"
    echo res://unic.gdextension > "$folder/.godot/extension_list.cfg"
    timeout 300 "$godot" "${options[@]:---headless}" --fixed-fps 30 --path "$folder" "$@"
}

engine "$project" --script "$script"
if (($# > 2)); then
    exit
fi

# The example finds garment and library by their places in this repository.
example=$scratch/bindings/godot/example
mkdir -p "$scratch/target/release" "$scratch/apps/unic-cli/garments"
cp -r "$here/../example" "$example"
cp "$here/example_check.gd" "$example"
cp "$library" "$scratch/target/release/libgodot_unic.so"
cp "$garments/tshirt.unic" "$scratch/apps/unic-cli/garments"
engine "$example" --script example_check.gd
# Its main scene as a user starts it. A fault is an error of the node.
engine "$example" --quit-after 60 2>&1 | tee "$scratch/example.log"
if grep -q "ERROR" "$scratch/example.log"; then
    echo "FAILED: the example prints errors"
    exit 1
fi
