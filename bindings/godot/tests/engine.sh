#!/usr/bin/env bash
# Runs the extension in a Godot: tests/engine.sh GODOT LIBRARY [SCRIPT [OPTION...]]
#
# GODOT is the engine, LIBRARY a built libgodot_unic.so. SCRIPT of tests/project is test.gd unless it is
# given. OPTIONs replace --headless. The motion and the expected vertices come from the example
# `expected`, which uses unic-core alone.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
godot=$1
library=$(realpath "$2")
script=${3:-test.gd}
options=("${@:4}")
garments=$here/../../../apps/unic-cli/garments
project=$(mktemp -d)
trap 'rm -rf "$project"' EXIT

cp "$here"/project/* "$here/../unic.gdextension" "$library" "$garments/tshirt.unic" "$project"
(cd "$here/.." && cargo run --release --locked --quiet --example expected -- "$garments/tshirt.unic" "$project")

# The settings and caches of the user stay as they are.
export HOME=$project/home XDG_DATA_HOME=$project/home XDG_CONFIG_HOME=$project/home XDG_CACHE_HOME=$project/home
mkdir -p "$HOME"
# The editor writes this list when it opens a project. Without a window it aborts at its end when it
# finds an extension for the first time (godotengine/godot#111048).
mkdir "$project/.godot"
echo res://unic.gdextension > "$project/.godot/extension_list.cfg"
timeout 300 "$godot" "${options[@]:---headless}" --fixed-fps 30 --path "$project" --script "$script"
