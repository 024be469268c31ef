//! Tests of `unic-core` without its development dependencies, so that they build for other
//! processors in seconds. `tests/cross.sh` runs them on 64-bit ARM (qemu) and WebAssembly (node).

// The re-export makes the build compile all of unic-core, model file and animator included.
pub use unic_core;
