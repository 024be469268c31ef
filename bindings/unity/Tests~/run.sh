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
# 0649: fields that Unity's serialisation fills. The editor's part and the sample have no unsafe code.
safely() { mcs -nologo -langversion:7.2 -warn:4 -warnaserror -nowarn:0649 "$@"; }
compile() { safely -unsafe "$@"; }

python3 "$package/Tools~/package.py"
cp -r "$package" "$out/package"
python3 "$out/package/Tools~/package.py" --library "$library/libunic.so" linux-x86_64 > /dev/null
python3 "$out/package/Tools~/package.py" > /dev/null

compile -target:library -out:"$out/UnityEngine.dll" $(sources "$here/Stubs")
# -doc: a public member without a comment is an error.
compile -target:library -doc:"$out/Unic.Garments.xml" -out:"$out/Unic.Garments.dll" -r:"$out/UnityEngine.dll" $(sources "$package/Runtime")
safely -target:library -doc:"$out/Unic.Garments.Editor.xml" -out:"$out/Unic.Garments.Editor.dll" -r:"$out/UnityEngine.dll" -r:"$out/Unic.Garments.dll" \
    $(sources "$package/Editor")
safely -target:library -out:"$out/Unic.Garments.Samples.Walk.dll" -r:"$out/UnityEngine.dll" \
    -r:"$out/Unic.Garments.dll" $(sources "$package/Samples~/Walk")

# The code that users are shown.
for page in "$package/README.md" "$package/Documentation~/com.unic.garments.md"; do
    {
        echo "using Unic; using UnityEngine; class Page { void Run(UnicModel model, GameObject character, Material material,"
        echo "SkinnedMeshRenderer skin) {"
        awk '/^```/ { on = /^```csharp/; next } on' "$page"
        echo "} }"
    } > "$out/page.cs"
    safely -target:library -out:"$out/page.dll" -r:"$out/UnityEngine.dll" -r:"$out/Unic.Garments.dll" "$out/page.cs"
done

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
if [ $# = 0 ]; then
    (unset LD_LIBRARY_PATH; UNIC_TEST_NO_LIBRARY=1 mono "$out/Unic.Garments.MonoTests.exe" MissingLibrary)
fi
