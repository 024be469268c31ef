//! Memory of the caller: structs that are copied in and out, and rows of numbers with a stride.
//!
//! Pointers are checked for null, alignment, strides that make rows overlap, and sizes beyond the
//! address space. That it points to memory of the stated size is the caller's word.

use crate::error::Error;
use std::mem::{MaybeUninit, size_of};

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

/// Struct that begins with its size in bytes, a `u32`, which the caller sets. Later versions append
/// fields to it. Zero is the default of every field.
pub(crate) trait Growing: Plain {
    /// Size in the first version of the interface, bytes: the least that a caller may state. It stays
    /// when fields are appended.
    const FIRST_SIZE: usize;

    /// Checks the size that a caller states.
    fn check_size(what: &'static str, found: usize) -> Result<(), Error> {
        match (Self::FIRST_SIZE..=LARGEST_STRUCT).contains(&found) {
            true => Ok(()),
            false => Err(Error::StructSize {
                what,
                least: Self::FIRST_SIZE,
                found,
            }),
        }
    }
}

/// Copies a struct that begins with its size.
///
/// Fields that a caller of an earlier version does not have are zero. A caller of a later version may
/// pass a larger struct. What this version does not know must be zero, for it would be ignored.
///
/// # Safety
/// `pointer` is null, misaligned or points to a struct of as many bytes as its first field states.
pub(crate) unsafe fn read_sized<T: Growing>(what: &'static str, pointer: *const T) -> Result<T, Error> {
    check_pointer(what, pointer)?;
    // SAFETY: points to a struct whose first field is a `u32`, by this function's contract.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    T::check_size(what, size)?;
    // SAFETY: `size` bytes are readable, by this function's contract.
    let given = unsafe { std::slice::from_raw_parts(pointer.cast::<u8>(), size) };
    let (known, unknown) = given.split_at(size.min(size_of::<T>()));
    if unknown.iter().any(|&byte| byte != 0) {
        return Err(Error::value(
            what,
            "zeros in the fields of later versions",
            "others",
        ));
    }
    let mut value = MaybeUninit::<T>::zeroed();
    // SAFETY: `known` is no longer than a `T`, for which every pattern of bits is a value.
    unsafe {
        known.as_ptr().copy_to(value.as_mut_ptr().cast(), known.len());
        Ok(value.assume_init())
    }
}

/// Writes a struct of which the caller has `size` bytes, and zeros to what this version does not
/// know of it. Its first field becomes `size`.
///
/// # Safety
/// `pointer` is null, misaligned or points to memory of `size` bytes.
pub(crate) unsafe fn write_sized<T: Growing>(
    what: &'static str,
    pointer: *mut T,
    size: u32,
    value: T,
) -> Result<(), Error> {
    check_pointer(what, pointer)?;
    T::check_size(what, size as usize)?;
    let known = (size as usize).min(size_of::<T>());
    // SAFETY: `size` bytes are writable, by this function's contract, and at least the first field is
    // there.
    unsafe {
        pointer.cast::<u8>().write_bytes(0, size as usize);
        (&raw const value).cast::<u8>().copy_to(pointer.cast(), known);
        pointer.cast::<u32>().write(size);
    }
    Ok(())
}

/// Writes a struct whose first field the caller has set to its size.
///
/// # Safety
/// `pointer` is null, misaligned or points to a struct of as many bytes as its first field states.
pub(crate) unsafe fn answer_sized<T: Growing>(
    what: &'static str,
    pointer: *mut T,
    value: T,
) -> Result<(), Error> {
    check_pointer(what, pointer)?;
    // SAFETY: passed on.
    unsafe {
        let size = pointer.cast::<u32>().read();
        write_sized(what, pointer, size, value)
    }
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
        return Err(Error::value(what, "bytes that fit in memory", length));
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
            return Err(Error::value(
                what,
                "rows that fit in memory",
                format_args!("{count} rows of {stride} bytes"),
            ));
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Struct to which the second version has appended a field.
    #[repr(C)]
    #[derive(Clone, Copy, Debug, PartialEq)]
    struct Grown {
        size: u32,
        first: u32,
        appended: u32,
    }

    // SAFETY: three numbers of 4 bytes.
    unsafe impl Plain for Grown {}

    impl Growing for Grown {
        const FIRST_SIZE: usize = 8;
    }

    const VALUE: Grown = Grown {
        size: 0,
        first: 5,
        appended: 6,
    };

    fn read_words(words: &[u32]) -> Result<Grown, Error> {
        // SAFETY: as many words as the first one states, in bytes.
        unsafe { read_sized("struct", words.as_ptr().cast()) }
    }

    #[test]
    fn fields_that_an_earlier_caller_lacks_are_zero() {
        let read = |words: &[u32]| read_words(words).unwrap();
        let expected = |size, appended| Grown {
            size,
            first: 5,
            appended,
        };
        assert_eq!(read(&[8, 5]), expected(8, 0));
        assert_eq!(read(&[12, 5, 6]), expected(12, 6));
        assert_eq!(read(&[16, 5, 6, 0]), expected(16, 6));
        assert!(matches!(read_words(&[16, 5, 6, 1]), Err(Error::Value { .. })));
    }

    #[test]
    fn sizes_below_that_of_the_first_version_are_refused() {
        for size in [0, 4, 7, LARGEST_STRUCT as u32 + 1] {
            let error = read_words(&[size, 5, 6]).unwrap_err();
            assert!(matches!(error, Error::StructSize { least: 8, .. }), "{error}");
            let mut words = [size, 1, 2];
            // SAFETY: a refused size is not written to.
            let error = unsafe { answer_sized("struct", words.as_mut_ptr().cast(), VALUE) }.unwrap_err();
            assert!(matches!(error, Error::StructSize { least: 8, .. }), "{error}");
            assert_eq!(words, [size, 1, 2]);
        }
    }

    #[test]
    fn answers_have_the_size_of_the_caller() {
        let answer = |size: u32| {
            let mut words = [9; 5];
            words[0] = size;
            // SAFETY: room for five words.
            unsafe { answer_sized("struct", words.as_mut_ptr().cast(), VALUE) }.unwrap();
            words
        };
        assert_eq!(answer(8), [8, 5, 9, 9, 9]);
        assert_eq!(answer(12), [12, 5, 6, 9, 9]);
        // The tail of a later version.
        assert_eq!(answer(16), [16, 5, 6, 0, 9]);
    }
}
