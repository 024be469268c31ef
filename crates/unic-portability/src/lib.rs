//! Tests of `unic-core` that need nothing but it, so that they build for other processors in seconds: what
//! `tests/cross.sh` runs on 64-bit ARM (qemu) and WebAssembly (node).

// The model file and the animator are compiled with it.
pub use unic_core;
