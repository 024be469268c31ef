#!/usr/bin/env bash
# Tests the field's kernels on processors that this machine does not have: compiles unic-core for
# 64-bit ARM and for WebAssembly with simd128, and runs the test suite under qemu and node. The
# compiler, its libraries and qemu are unpacked from Debian packages into the target folder; nothing
# is installed. If they cannot be downloaded, the script prints a line and succeeds.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}/cross
mkdir -p "$target"
target=$(cd "$target" && pwd)
root=$target/root

# Runs apt for two architectures with its own package lists, so that the machine's do not change.
apt() {
    APT_CONFIG=$target/apt.conf "$@" 2> "$target/apt.log"
}

apt_begin() {
    mkdir -p "$target"/apt/{lists,archives}/partial "$target/debs"
    cat > "$target/apt.conf" <<CONF
APT::Architectures { "amd64"; "arm64"; };
APT::Sandbox::User "root";
Dir::State "$target/apt";
Dir::Cache "$target/apt";
Dir::State::status "/var/lib/dpkg/status";
CONF
    apt timeout 60 apt-get update -qq
}

# Prints the dependency of a package whose name matches a pattern, for names that contain a version.
dependency() {
    apt apt-cache depends "$1" | sed -n "s/^ *Depends: \($2\)\$/\1/p" | head -n 1
}

packages() {
    local std llvm gcc
    std=$(dependency libstd-rust-web-dev 'libstd-rust-web-[0-9.]*')
    llvm=$(dependency "$std" 'libllvm[0-9]*')
    gcc=$(dependency gcc-aarch64-linux-gnu 'gcc-[0-9]*-aarch64-linux-gnu')
    echo rustc-web rust-web-src libstd-rust-web-dev "$std" "$llvm" wasi-libc libstd-rust-web-dev:arm64 \
        qemu-user-static "$gcc" "cpp-${gcc#gcc-}" binutils-aarch64-linux-gnu libc6-arm64-cross libc6-dev-arm64-cross \
        linux-libc-dev-arm64-cross "lib${gcc%-aarch64-linux-gnu}-dev-arm64-cross" libgcc-s1-arm64-cross
}

unpack() {
    case $1 in
        # Only the standard library is needed of the compiler's source.
        *rust-web-src*) dpkg --fsys-tarfile "$1" | tar -x -C "$root" --wildcards './usr/src/*/library' './usr/lib' ;;
        *) dpkg -x "$1" "$root" ;;
    esac
}

get_compiler() {
    [ -e "$root/complete" ] && return
    [ "$(dpkg --print-architecture)" = amd64 ] && apt_begin || return
    local list deb
    list=$(packages) && (cd "$target/debs" && apt timeout 120 apt-get download -qq $list) || return
    rm -rf "$root" && mkdir -p "$root"
    for deb in "$target"/debs/*.deb; do unpack "$deb" || return; done
    rm -r "$target/debs"
    touch "$root/complete"
}

# Runs this machine's cargo with the unpacked compiler.
cargo_with() {
    LD_LIBRARY_PATH=$root/usr/lib/x86_64-linux-gnu RUSTC=$root/usr/bin/rustc CARGO_TARGET_DIR=$target \
        cargo "$@" --release -p unic-portability
}

arm() {
    local libraries=$root/usr/aarch64-linux-gnu/lib
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER
    CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=$(ls "$root"/usr/bin/aarch64-linux-gnu-gcc-[0-9]* | head -n 1)
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUSTFLAGS="-Clink-arg=--sysroot=$root -Clink-arg=-B$libraries \
        -Clink-arg=-B$root/usr/bin/aarch64-linux-gnu- -Clink-arg=-L$libraries"
    export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="$root/usr/bin/qemu-aarch64-static -cpu ${1:-max} \
        -L $root/usr/aarch64-linux-gnu"
    cargo_with test --test field --target aarch64-unknown-linux-gnu
}

# Debian has the standard library for WebAssembly as source only. It is built here, which a stable
# compiler does with RUSTC_BOOTSTRAP=1. Debian's C library for WebAssembly has no threads: these
# functions stay undefined (--unresolved-symbols=ignore-all) and are never called.
wasm() {
    local lld
    lld=$(find "$(rustc --print sysroot)" -name rust-lld | head -n 1)
    [ -n "$lld" ] || { echo "skipped: no linker for WebAssembly"; return; }
    export RUSTC_BOOTSTRAP=1 CARGO_TARGET_WASM32_WASIP1_LINKER=$lld
    export CARGO_TARGET_WASM32_WASIP1_RUSTFLAGS="-Ctarget-feature=+simd128 -Clinker-flavor=wasm-ld \
        -Clink-self-contained=no -Clink-arg=-L$root/usr/lib/wasm32-wasi \
        -Clink-arg=$root/usr/lib/wasm32-wasi/crt1-command.o -Clink-arg=-lc \
        -Clink-arg=--unresolved-symbols=ignore-all"
    export CARGO_TARGET_WASM32_WASIP1_RUNNER="node --no-warnings $PWD/tests/wasi.mjs"
    local run=
    node --version > /dev/null 2>&1 || { echo "skipped: no node to run WebAssembly"; run=--no-run; }
    cargo_with test --test field --target wasm32-wasip1 -Zbuild-std=std,panic_abort,test $run
}

get_compiler || { echo "skipped: no compiler for other processors: $(tail -n 1 "$target/apt.log")"; exit 0; }
(arm)
# A processor without dot product instructions.
(arm cortex-a53)
(wasm)
