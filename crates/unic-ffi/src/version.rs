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

/// Features of a library on a machine. Each is a bit of unic_features.
#[repr(u64)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicFeature {
    /// Models are read from paths.
    Paths = 1,
    /// UNIC_THREADS_POOL.
    Pool = 2,
    /// This processor has instructions for UNIC_PRECISION_BF16.
    Bf16Instructions = 4,
    /// This processor has instructions for UNIC_PRECISION_INT8.
    Int8Instructions = 8,
}

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

/// Features of the library on this machine: a sum of values of UnicFeature. Unknown ones are of
/// later versions.
#[unsafe(no_mangle)]
pub extern "C" fn unic_features() -> u64 {
    [
        (UnicFeature::Paths, true),
        (UnicFeature::Pool, true),
        (UnicFeature::Bf16Instructions, Precision::Bf16.has_own_products()),
        (UnicFeature::Int8Instructions, Precision::Int8.has_own_products()),
    ]
    .into_iter()
    .filter_map(|(feature, is_there)| is_there.then_some(feature as u64))
    .sum()
}

/// Name of the instruction set that a UnicPrecision runs on here, such as `avx512`. Null for
/// UNIC_PRECISION_AUTO and for an unknown precision.
#[unsafe(no_mangle)]
pub extern "C" fn unic_instructions(precision: u32) -> *const c_char {
    static NAMES: OnceLock<[CString; 4]> = OnceLock::new();
    let name = |p: Precision| CString::new(p.best_instructions().name());
    let names = NAMES.get_or_init(|| Precision::ALL.map(|p| name(p).unwrap_or_default()));
    let known = named_precision(precision).ok();
    let index = known.and_then(|known| Precision::ALL.iter().position(|p| *p == known));
    index.map_or(std::ptr::null(), |i| names[i].as_ptr())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::UnicPrecision;
    use std::ffi::CStr;

    #[test]
    fn features_and_names_are_those_of_the_processor() {
        for precision in Precision::ALL {
            let name = unic_instructions(UnicPrecision::from(precision) as u32);
            // SAFETY: a text that is never freed; a known precision has one.
            let name = unsafe { CStr::from_ptr(name) };
            assert_eq!(name.to_str(), Ok(precision.best_instructions().name()));
        }
        assert!(unic_instructions(UnicPrecision::Auto as u32).is_null());
        assert!(unic_instructions(5).is_null());
        let has = |feature: UnicFeature| unic_features() & feature as u64 != 0;
        assert!(has(UnicFeature::Paths) && has(UnicFeature::Pool));
        assert_eq!(
            has(UnicFeature::Bf16Instructions),
            Precision::Bf16.has_own_products()
        );
        assert_eq!(
            has(UnicFeature::Int8Instructions),
            Precision::Int8.has_own_products()
        );
    }
}
