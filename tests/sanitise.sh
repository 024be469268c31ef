#!/usr/bin/env bash
# Tests of the C interface's threads under ThreadSanitizer, with a standard library that is built for
# it: without, its locks look like races. Needs a nightly toolchain with the component rust-src; if
# there is none, the script prints a line and succeeds.
set -euo pipefail
cd "$(dirname "$0")/.."
target=$(realpath "${CARGO_TARGET_DIR:-target}")/sanitise

if ! source=$(rustc +nightly --print sysroot 2> /dev/null)/lib/rustlib/src/rust/library || [[ ! -d $source ]]; then
    echo "skipped: no nightly toolchain with rust-src (rustup component add rust-src --toolchain nightly)"
    exit 0
fi
host=$(rustc +nightly -vV | sed -n 's/^host: //p')
RUSTFLAGS=-Zsanitizer=thread cargo +nightly test --release -Zbuild-std --target "$host" --target-dir "$target" \
    -p unic-ffi --lib --test threads --test animator
