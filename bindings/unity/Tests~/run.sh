#!/usr/bin/env bash
# Builds the package with mono against small stubs of Unity's types, and runs it with the native
# library for real.
#
#   cargo rustc --release -p unic-ffi --lib --crate-type cdylib
#   bindings/unity/Tests~/run.sh [PART_OF_A_TEST'S_NAME]
#
# $UNIC_LIBRARY names the folder of libunic.so (default: target/release).
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
package=$(dirname "$here")
repository=$(cd "$package/../.." && pwd)

for program in mono mcs cc; do
    if ! command -v "$program" > /dev/null; then
        echo "skipped: the Unity package, for $program is missing (Debian: mono-mcs, mono-runtime, libmono-system-core4.0-cil, gcc)"
        exit 0
    fi
done
library=${UNIC_LIBRARY:-${CARGO_TARGET_DIR:-$repository/target}/release}
if [ ! -e "$library/libunic.so" ]; then
    echo "expected libunic.so in $library, found none; build it as the head of this script says"
    exit 1
fi

out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
header=$repository/crates/unic-ffi/include
sources() { find "$@" -name '*.cs' | sort; }
# 0649, 0067: fields that Unity's serialisation fills.
compile() { mcs -nologo -unsafe -langversion:7.2 -warn:4 -warnaserror -nowarn:0649 "$@"; }

python3 "$package/Tools~/package.py"

compile -target:library -out:"$out/UnityEngine.dll" $(sources "$here/Stubs")
compile -target:library -out:"$out/Unic.Garments.dll" -r:"$out/UnityEngine.dll" $(sources "$package/Runtime")
compile -target:library -out:"$out/Unic.Garments.Editor.dll" -r:"$out/UnityEngine.dll" -r:"$out/Unic.Garments.dll" \
    $(sources "$package/Editor")
compile -target:library -out:"$out/Unic.Garments.Samples.Walk.dll" -r:"$out/UnityEngine.dll" \
    -r:"$out/Unic.Garments.dll" $(sources "$package/Samples~/Walk")

compile -target:exe -out:"$out/Layout.exe" "$package"/Runtime/Native/*.cs "$package/Runtime/UnicException.cs" \
    "$here/Layout/Layout.cs"
mono "$out/Layout.exe" probe "$header/unic.h" > "$out/probe.c"
cc -std=c11 -Wall -Wextra -Werror -I "$header" "$out/probe.c" -o "$out/probe"
"$out/probe" > "$out/layout.txt"
mono "$out/Layout.exe" check "$header/unic.h" "$out/layout.txt"

cc -std=c11 -O1 -Wall -Wextra -Werror -I "$header" "$here/Reference/reference.c" -L "$library" -lunic \
    -Wl,-rpath,"$library" -o "$out/reference"
compile -target:exe -out:"$out/Unic.Garments.MonoTests.exe" -r:"$out/UnityEngine.dll" -r:"$out/Unic.Garments.dll" \
    -r:"$out/Unic.Garments.Editor.dll" -r:"$out/Unic.Garments.Samples.Walk.dll" \
    $(sources "$package/Tests/Runtime" "$here/Mono")

export UNIC_TEST_MODEL=${UNIC_TEST_MODEL:-$repository/apps/unic-cli/garments/tshirt.unic}
export UNIC_TEST_FOLDER=$out UNIC_TEST_PACKAGE=$package
LD_LIBRARY_PATH=$library${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH} \
    mono "$out/Unic.Garments.MonoTests.exe" "$@"
