//! Values as 64 bits: their type, and their place in the file or the value itself.

/// Bits of a [`Value`].
const IS_ARRAY: u64 = 1 << 63;
const IS_INLINE: u64 = 1 << 62;
const TYPE_SHIFT: u32 = 48;
/// Number of bits of a place.
const PLACE_BITS: u32 = 48;

/// Types of values, by their numbers in the format.
mod number {
    pub(super) const INT: u64 = 3;
    pub(super) const DOUBLE: u64 = 9;
    pub(super) const STRING: u64 = 10;
    pub(super) const TOKEN: u64 = 11;
    pub(super) const VEC2F: u64 = 20;
    pub(super) const VEC3F: u64 = 24;
    pub(super) const TOKEN_VECTOR: u64 = 41;
    pub(super) const SPECIFIER: u64 = 42;
    pub(super) const VARIABILITY: u64 = 44;
    pub(super) const TIME_SAMPLES: u64 = 46;
    pub(super) const DOUBLE_VECTOR: u64 = 48;
}

/// Types of the elements of arrays.
#[derive(Clone, Copy, Debug)]
pub(super) enum ArrayType {
    Int,
    Vec2f,
    Vec3f,
}

/// A value of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Value(pub(super) u64);

impl Value {
    /// Specifier of a prim that is defined here.
    pub(super) const DEFINITION: Value = Value::inline(number::SPECIFIER, 0);
    /// Variability of an attribute that never varies.
    pub(super) const UNIFORM: Value = Value::inline(number::VARIABILITY, 1);
    /// Array without elements, which has no place.
    pub(super) const fn empty(of: ArrayType) -> Self {
        Self(IS_ARRAY | of.number() << TYPE_SHIFT)
    }

    pub(super) const fn array(of: ArrayType, place: u64) -> Self {
        Self(IS_ARRAY | Self::at(of.number(), place).0)
    }

    pub(super) const fn token(index: u32) -> Self {
        Self::inline(number::TOKEN, index)
    }

    pub(super) const fn string(index: u32) -> Self {
        Self::inline(number::STRING, index)
    }

    pub(super) const fn double(place: u64) -> Self {
        Self::at(number::DOUBLE, place)
    }

    pub(super) const fn doubles(place: u64) -> Self {
        Self::at(number::DOUBLE_VECTOR, place)
    }

    pub(super) const fn tokens(place: u64) -> Self {
        Self::at(number::TOKEN_VECTOR, place)
    }

    pub(super) const fn time_samples(place: u64) -> Self {
        Self::at(number::TIME_SAMPLES, place)
    }

    const fn inline(of: u64, value: u32) -> Self {
        Self(IS_INLINE | of << TYPE_SHIFT | value as u64)
    }

    const fn at(of: u64, place: u64) -> Self {
        // 256 TiB: no file gets there.
        debug_assert!(place >> PLACE_BITS == 0);
        Self(of << TYPE_SHIFT | place)
    }
}

impl ArrayType {
    const fn number(self) -> u64 {
        match self {
            Self::Int => number::INT,
            Self::Vec2f => number::VEC2F,
            Self::Vec3f => number::VEC3F,
        }
    }
}
