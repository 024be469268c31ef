//! Types of samples.

use std::fmt::{self, Display};

/// Plain type of a sample's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pod {
    /// One byte, 0 or 1.
    Bool,
    /// u8.
    U8,
    /// i8.
    I8,
    /// u16.
    U16,
    /// i16.
    I16,
    /// u32.
    U32,
    /// i32.
    I32,
    /// u64.
    U64,
    /// i64.
    I64,
    /// Half-precision number.
    F16,
    /// f32.
    F32,
    /// f64.
    F64,
    /// Text that ends in a zero byte.
    Text,
    /// Text of 32-bit characters that ends in zero.
    WideText,
}

/// All types, in the order of their numbers in files.
const PODS: [Pod; 14] = [
    Pod::Bool,
    Pod::U8,
    Pod::I8,
    Pod::U16,
    Pod::I16,
    Pod::U32,
    Pod::I32,
    Pod::U64,
    Pod::I64,
    Pod::F16,
    Pod::F32,
    Pod::F64,
    Pod::Text,
    Pod::WideText,
];

impl Pod {
    pub(crate) fn decode(number: u32) -> Option<Self> {
        PODS.get(number as usize).copied()
    }

    pub(crate) fn encode(self) -> u32 {
        self as u32
    }

    /// Number of bytes of a value; none for texts, whose lengths differ.
    pub fn size(self) -> Option<usize> {
        match self {
            Self::Bool | Self::U8 | Self::I8 => Some(1),
            Self::U16 | Self::I16 | Self::F16 => Some(2),
            Self::U32 | Self::I32 | Self::F32 => Some(4),
            Self::U64 | Self::I64 | Self::F64 => Some(8),
            Self::Text | Self::WideText => None,
        }
    }
}

/// Type of a property's elements: `extent` values of a plain type, as three floats for a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataType {
    /// Type of each value.
    pub pod: Pod,
    /// Number of values of an element, at least 1.
    pub extent: u8,
}

impl DataType {
    /// Makes the type of elements of `extent` values.
    pub const fn new(pod: Pod, extent: u8) -> Self {
        Self { pod, extent }
    }

    /// Number of bytes of an element; none for texts.
    pub fn size(self) -> Option<usize> {
        Some(self.pod.size()? * usize::from(self.extent))
    }
}

impl Display for DataType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} × {}", self.pod, self.extent)
    }
}

/// Rust type that elements of samples are read into: a number or an array of numbers.
///
/// A number also reads properties of a larger extent, one value after the other.
pub trait Element: Copy + private::Sealed {
    /// Type in the file.
    const TYPE: DataType;

    /// Decodes an element from as many bytes as the type has.
    #[doc(hidden)]
    fn decode(bytes: &[u8]) -> Self;

    /// Appends the bytes of an element.
    #[doc(hidden)]
    fn encode(self, into: &mut Vec<u8>);
}

mod private {
    pub trait Sealed {}
}

macro_rules! number {
    ($($number:ty => $pod:ident),*) => {$(
        impl private::Sealed for $number {}

        impl Element for $number {
            const TYPE: DataType = DataType::new(Pod::$pod, 1);

            fn decode(bytes: &[u8]) -> Self {
                let mut number = [0; size_of::<$number>()];
                number.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
                Self::from_le_bytes(number)
            }

            fn encode(self, into: &mut Vec<u8>) {
                into.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

number!(u8 => U8, i8 => I8, u16 => U16, i16 => I16, u32 => U32, i32 => I32, u64 => U64, i64 => I64,
    f32 => F32, f64 => F64);

impl private::Sealed for bool {}

impl Element for bool {
    const TYPE: DataType = DataType::new(Pod::Bool, 1);

    fn decode(bytes: &[u8]) -> Self {
        bytes.first().is_some_and(|&byte| byte != 0)
    }

    fn encode(self, into: &mut Vec<u8>) {
        into.push(u8::from(self));
    }
}

impl<T: Element, const N: usize> private::Sealed for [T; N] {}

impl<T: Element, const N: usize> Element for [T; N] {
    const TYPE: DataType = DataType::new(T::TYPE.pod, N as u8);

    fn decode(bytes: &[u8]) -> Self {
        let size = bytes.len() / N;
        std::array::from_fn(|i| T::decode(bytes.get(i * size..).unwrap_or_default()))
    }

    fn encode(self, into: &mut Vec<u8>) {
        self.into_iter().for_each(|number| number.encode(into));
    }
}

/// Bytes of several elements, as they stand in a file.
pub(crate) fn encode_all<T: Element>(elements: &[T], into: &mut Vec<u8>) {
    into.clear();
    into.reserve(size_of_val(elements));
    elements.iter().for_each(|element| element.encode(into));
}
