//! Codes that functions return.

use std::ffi::{CStr, c_char};

/// Result of a call. Codes other than `UNIC_STATUS_OK` come with a text: `unic_last_error`.
///
/// A call that fails changes nothing, except for `UNIC_STATUS_PANIC`.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicStatus {
    /// Success.
    Ok = 0,
    /// A pointer that must not be null is null.
    NullPointer = 1,
    /// A pointer to a struct is not aligned as its type asks.
    Misaligned = 2,
    /// A handle that was never made, or that is released.
    InvalidHandle = 3,
    /// The instance is in use by another thread, or by a callback of the same call.
    InUse = 4,
    /// A count, a stride or the size of a struct is not the expected one.
    WrongSize = 5,
    /// A number that is not accepted: NaN, out of range, a rotation that is not a unit quaternion.
    InvalidValue = 6,
    /// Bytes that are not a model which this version reads.
    BadModel = 7,
    /// A file that cannot be read.
    CannotRead = 8,
    /// Bytes that are not a saved state of this model.
    BadState = 9,
    /// A buffer that is too small for what is written to it.
    BufferTooSmall = 10,
    /// Threads that the system does not start.
    OutOfThreads = 11,
    /// A fault of the library. The instance of the call can only be released.
    Panic = 12,
    /// An instance in which an earlier call ended with `UNIC_STATUS_PANIC`.
    Broken = 13,
}

impl UnicStatus {
    const ALL: [(Self, &'static CStr); 14] = [
        (Self::Ok, c"ok"),
        (Self::NullPointer, c"null pointer"),
        (Self::Misaligned, c"misaligned pointer"),
        (Self::InvalidHandle, c"invalid handle"),
        (Self::InUse, c"in use"),
        (Self::WrongSize, c"wrong size"),
        (Self::InvalidValue, c"invalid value"),
        (Self::BadModel, c"bad model"),
        (Self::CannotRead, c"cannot read"),
        (Self::BadState, c"bad state"),
        (Self::BufferTooSmall, c"buffer too small"),
        (Self::OutOfThreads, c"out of threads"),
        (Self::Panic, c"panic"),
        (Self::Broken, c"broken"),
    ];
}

/// Name of a status in words, such as `wrong size`. Never null; lives as long as the library.
#[unsafe(no_mangle)]
pub extern "C" fn unic_status_name(status: u32) -> *const c_char {
    let found = UnicStatus::ALL.iter().find(|(s, _)| *s as u32 == status);
    found.map_or(c"unknown status", |(_, name)| *name).as_ptr()
}
