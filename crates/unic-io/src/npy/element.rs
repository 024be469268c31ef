//! Element types that arrays are read as.

use super::header::{Dtype, DtypeKind};
use half::f16;

/// A number type that arrays are read as.
///
/// `f32` and `f64` accept floats of any width and integers. Integers and `bool` accept integers
/// only, so that a file whose faces are floating point is reported and not truncated.
pub trait Element: Copy + sealed::Decode {
    /// Description of acceptable elements for messages: "numbers", "integers", ...
    const EXPECTED: &'static str;
}

pub(crate) mod sealed {
    use super::{Dtype, DtypeKind};

    pub trait Decode: Sized {
        /// Returns whether elements of `dtype` can be decoded to this type.
        fn accepts(dtype: Dtype) -> bool;
        /// Decodes one little-endian element of an accepted type; `None` when out of range.
        fn decode(kind: DtypeKind, bytes: &[u8]) -> Option<Self>;
    }
}

fn is_integer(dtype: Dtype) -> bool {
    matches!(
        dtype.kind,
        DtypeKind::Bool | DtypeKind::Signed | DtypeKind::Unsigned
    )
}

fn is_number(dtype: Dtype) -> bool {
    is_integer(dtype) || (dtype.kind == DtypeKind::Float && matches!(dtype.size, 2 | 4 | 8))
}

/// Decodes a little-endian integer of up to eight bytes. `i128` holds both `i64` and `u64`.
fn integer(kind: DtypeKind, bytes: &[u8]) -> i128 {
    let mut wide = [0; 8];
    let count = bytes.len().min(8);
    wide[..count].copy_from_slice(&bytes[..count]);
    // Shifting the sign bit to the top and back extends it over the unused bytes.
    let unused = 64 - 8 * count as u32;
    if kind == DtypeKind::Signed {
        i128::from((i64::from_le_bytes(wide) << unused) >> unused)
    } else {
        i128::from(u64::from_le_bytes(wide))
    }
}

/// Decodes a little-endian float or integer.
fn number(kind: DtypeKind, bytes: &[u8]) -> f64 {
    match (kind, bytes) {
        (DtypeKind::Float, &[a, b]) => f16::from_le_bytes([a, b]).to_f64(),
        (DtypeKind::Float, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        (DtypeKind::Float, &[a, b, c, d, e, f, g, h]) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        _ => integer(kind, bytes) as f64,
    }
}

impl sealed::Decode for f64 {
    fn accepts(dtype: Dtype) -> bool {
        is_number(dtype)
    }

    fn decode(kind: DtypeKind, bytes: &[u8]) -> Option<Self> {
        Some(number(kind, bytes))
    }
}

impl sealed::Decode for f32 {
    fn accepts(dtype: Dtype) -> bool {
        is_number(dtype)
    }

    fn decode(kind: DtypeKind, bytes: &[u8]) -> Option<Self> {
        Some(number(kind, bytes) as f32)
    }
}

impl sealed::Decode for i64 {
    fn accepts(dtype: Dtype) -> bool {
        is_integer(dtype)
    }

    fn decode(kind: DtypeKind, bytes: &[u8]) -> Option<Self> {
        integer(kind, bytes).try_into().ok()
    }
}

impl sealed::Decode for u32 {
    fn accepts(dtype: Dtype) -> bool {
        is_integer(dtype)
    }

    fn decode(kind: DtypeKind, bytes: &[u8]) -> Option<Self> {
        integer(kind, bytes).try_into().ok()
    }
}

impl sealed::Decode for bool {
    fn accepts(dtype: Dtype) -> bool {
        is_integer(dtype)
    }

    fn decode(kind: DtypeKind, bytes: &[u8]) -> Option<Self> {
        Some(integer(kind, bytes) != 0)
    }
}

impl Element for f64 {
    const EXPECTED: &'static str = "numbers";
}

impl Element for f32 {
    const EXPECTED: &'static str = "numbers";
}

impl Element for i64 {
    const EXPECTED: &'static str = "integers";
}

impl Element for u32 {
    const EXPECTED: &'static str = "integers from 0 to 4294967295";
}

impl Element for bool {
    const EXPECTED: &'static str = "truth values";
}

#[cfg(test)]
mod tests {
    use super::{sealed::Decode, *};

    #[test]
    fn narrow_integers_keep_their_sign() {
        assert_eq!(i64::decode(DtypeKind::Signed, &[0xff]), Some(-1));
        assert_eq!(i64::decode(DtypeKind::Unsigned, &[0xff]), Some(255));
        assert_eq!(
            i64::decode(DtypeKind::Signed, &i64::MIN.to_le_bytes()),
            Some(i64::MIN)
        );
        assert_eq!(i64::decode(DtypeKind::Unsigned, &u64::MAX.to_le_bytes()), None);
        assert_eq!(u32::decode(DtypeKind::Signed, &(-1_i16).to_le_bytes()), None);
    }

    #[test]
    fn floats_of_every_width() {
        assert_eq!(f32::decode(DtypeKind::Float, &[0x00, 0xc1]), Some(-2.5));
        assert_eq!(
            f32::decode(DtypeKind::Float, &(-2.5_f32).to_le_bytes()),
            Some(-2.5)
        );
        assert_eq!(f64::decode(DtypeKind::Float, &0.1_f64.to_le_bytes()), Some(0.1));
        assert_eq!(
            f64::decode(DtypeKind::Signed, &(-7_i32).to_le_bytes()),
            Some(-7.0)
        );
    }
}
