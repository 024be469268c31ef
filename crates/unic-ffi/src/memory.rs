//! Memory of the caller: structs that are copied in and out, and rows of numbers with a stride.
//!
//! Pointers are checked for null, alignment, strides that make rows overlap, and sizes beyond the
//! address space. That it points to memory of the stated size is the caller's word.

use crate::error::Error;
use std::mem::size_of;

/// Struct without padding, for which every pattern of bits is a value.
///
/// # Safety
/// The type has these properties: its fields are numbers, pointers, nullable function pointers or
/// such structs.
pub(crate) unsafe trait Plain: Copy {}

/// Largest size of a struct that callers of a later version may pass, bytes.
const LARGEST_STRUCT: usize = 4096;

/// Checks that a pointer is neither null nor misaligned.
pub(crate) fn check_pointer<T>(what: &'static str, pointer: *const T) -> Result<(), Error> {
    if pointer.is_null() {
        return Err(Error::Null { what });
    }
    match pointer.is_aligned() {
        true => Ok(()),
        false => Err(Error::Misaligned {
            what,
            expected: align_of::<T>(),
            found: pointer.addr(),
        }),
    }
}

/// Copies a struct of fixed size.
///
/// # Safety
/// `pointer` is null, misaligned or points to a `T`.
pub(crate) unsafe fn read<T: Plain>(what: &'static str, pointer: *const T) -> Result<T, Error> {
    check_pointer(what, pointer)?;
    // SAFETY: neither null nor misaligned, so that it points to a `T` by this function's contract.
    Ok(unsafe { pointer.read() })
}

/// Checks the size that a caller states for a struct: at least that of this version.
pub(crate) fn check_struct_size(what: &'static str, expected: usize, found: usize) -> Result<(), Error> {
    match (expected..=LARGEST_STRUCT).contains(&found) {
        true => Ok(()),
        false => Err(Error::Size {
            what,
            expected,
            found,
        }),
    }
}

/// Copies a struct that begins with its size in bytes, which grows from version to version.
///
/// A caller of a later version may pass a larger struct. What this version does not know must be
/// zero, for it would be ignored.
///
/// # Safety
/// `pointer` is null, misaligned or points to a struct of as many bytes as its first field states.
pub(crate) unsafe fn read_sized<T: Plain>(what: &'static str, pointer: *const T) -> Result<T, Error> {
    check_pointer(what, pointer)?;
    // SAFETY: points to a struct whose first field is a `u32`, by this function's contract.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    let expected = size_of::<T>();
    check_struct_size(what, expected, size)?;
    // SAFETY: `size` bytes are readable, by this function's contract.
    let unknown = unsafe { std::slice::from_raw_parts(pointer.cast::<u8>().add(expected), size - expected) };
    if unknown.iter().any(|&byte| byte != 0) {
        return Err(Error::Value {
            what,
            expected: "zeros in the fields of later versions",
            found: "others".to_owned(),
        });
    }
    // SAFETY: at least a `T` is there.
    Ok(unsafe { pointer.read() })
}

/// Writes a struct of fixed size.
///
/// # Safety
/// `pointer` is null, misaligned or points to memory for a `T`.
pub(crate) unsafe fn write<T>(what: &'static str, pointer: *mut T, value: T) -> Result<(), Error> {
    check_pointer(what, pointer)?;
    // SAFETY: neither null nor misaligned, so that it points to memory for a `T`.
    unsafe { pointer.write(value) };
    Ok(())
}

/// Borrows bytes of the caller.
///
/// # Safety
/// `first` is null, or points to `length` bytes that nobody changes while the result is used.
pub(crate) unsafe fn bytes<'a>(
    what: &'static str,
    first: *const u8,
    length: usize,
) -> Result<&'a [u8], Error> {
    check_pointer(what, first)?;
    if isize::try_from(length).is_err() {
        return Err(Error::Value {
            what,
            expected: "bytes that fit in memory",
            found: length.to_string(),
        });
    }
    // SAFETY: not null, within the address space, and readable by this function's contract.
    Ok(unsafe { std::slice::from_raw_parts(first, length) })
}

/// Place of `count` rows of `N` numbers of 4 bytes, whose starts are `stride` bytes apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<const N: usize> {
    first: *mut u8,
    stride: usize,
    count: usize,
}

impl<const N: usize> Rows<N> {
    const ROW: usize = 4 * N;

    /// Checks a place in the caller's memory. A stride of 0 means rows without gaps.
    ///
    /// # Safety
    /// `first` is null, or points to `count` rows that stay readable as long as the value is used,
    /// and writable if it is written to.
    pub(crate) unsafe fn new(
        what: &'static str,
        first: *const u8,
        stride: usize,
        count: usize,
    ) -> Result<Self, Error> {
        let stride = if stride == 0 { Self::ROW } else { stride };
        if first.is_null() && count > 0 {
            return Err(Error::Null { what });
        }
        let expected = Self::ROW;
        if stride < expected {
            let found = stride;
            return Err(Error::Size {
                what,
                expected,
                found,
            });
        }
        let size = stride.checked_mul(count).filter(|&s| isize::try_from(s).is_ok());
        if size.is_none() {
            return Err(Error::Value {
                what,
                expected: "rows that fit in memory",
                found: format!("{count} rows of {stride} bytes"),
            });
        }
        let first = first.cast_mut();
        Ok(Self { first, stride, count })
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// Copies a row.
    ///
    /// # Panics
    /// When there is no such row.
    pub(crate) fn get(&self, row: usize) -> [f32; N] {
        assert!(row < self.count, "row {row} of {}", self.count);
        // SAFETY: within the rows that `new` was promised. Strides need not keep floats aligned.
        unsafe {
            self.first
                .add(row * self.stride)
                .cast::<[f32; N]>()
                .read_unaligned()
        }
    }

    /// Writes a row of floats or integers.
    ///
    /// # Panics
    /// When there is no such row, or `T` is not of 4 bytes.
    pub(crate) fn set<T: Copy>(&self, row: usize, value: [T; N]) {
        const { assert!(size_of::<T>() == 4) };
        assert!(row < self.count, "row {row} of {}", self.count);
        // SAFETY: as in `get`; the rows were promised to be writable.
        unsafe {
            self.first
                .add(row * self.stride)
                .cast::<[T; N]>()
                .write_unaligned(value)
        };
    }
}

/// Checks that a count is the expected one.
pub(crate) fn check_count(what: &'static str, expected: usize, found: usize) -> Result<(), Error> {
    match expected == found {
        true => Ok(()),
        false => Err(Error::Size {
            what,
            expected,
            found,
        }),
    }
}
