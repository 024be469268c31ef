//! Version and features of the library.

use crate::options::named_precision;
use std::{
    ffi::{CString, c_char},
    sync::OnceLock,
};
use unic_core::Precision;

/// Version of this interface. It grows by one when a function or a struct changes so that programs
/// must be compiled again; additions leave it.
pub const UNIC_ABI_VERSION: u32 = 1;

/// Feature: models are read from paths.
pub const UNIC_FEATURE_PATHS: u64 = 1;
/// Feature: UNIC_THREADS_POOL.
pub const UNIC_FEATURE_POOL: u64 = 2;
/// Feature: this processor has instructions for UNIC_PRECISION_BF16.
pub const UNIC_FEATURE_BF16_INSTRUCTIONS: u64 = 4;
/// Feature: this processor has instructions for UNIC_PRECISION_INT8.
pub const UNIC_FEATURE_INT8_INSTRUCTIONS: u64 = 8;

/// Version of the interface that the library has. Compare it with UNIC_ABI_VERSION of the header.
#[unsafe(no_mangle)]
pub extern "C" fn unic_abi_version() -> u32 {
    UNIC_ABI_VERSION
}

/// Version of the library, such as `0.1.0`. Never null.
#[unsafe(no_mangle)]
pub extern "C" fn unic_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Features of the library on this machine: a sum of UNIC_FEATURE constants. Unknown ones are of
/// later versions.
#[unsafe(no_mangle)]
pub extern "C" fn unic_features() -> u64 {
    let mut features = UNIC_FEATURE_PATHS | UNIC_FEATURE_POOL;
    // On these sets products of the precision are instructions; other sets compute them from others.
    let has_own = |precision: Precision| {
        let name = instructions_name(precision);
        ["Amx", "Avx512", "NeonDot"].contains(&name.as_str())
    };
    if has_own(Precision::Bf16) {
        features |= UNIC_FEATURE_BF16_INSTRUCTIONS;
    }
    if has_own(Precision::Int8) {
        features |= UNIC_FEATURE_INT8_INSTRUCTIONS;
    }
    features
}

/// Name of the instruction set that a UnicPrecision runs on here, such as `Avx512`. Null for
/// UNIC_PRECISION_AUTO and for an unknown precision.
#[unsafe(no_mangle)]
pub extern "C" fn unic_instructions(precision: u32) -> *const c_char {
    static NAMES: OnceLock<[CString; 4]> = OnceLock::new();
    let names =
        NAMES.get_or_init(|| Precision::ALL.map(|p| CString::new(instructions_name(p)).unwrap_or_default()));
    let known = named_precision(precision).ok();
    let index = known.and_then(|known| Precision::ALL.iter().position(|p| *p == known));
    index.map_or(std::ptr::null(), |i| names[i].as_ptr())
}

fn instructions_name(precision: Precision) -> String {
    format!("{:?}", precision.best_instructions())
}
