//! SIMD: the processor's instruction sets, chosen at run time, and vector registers of f32.
//!
//! For this crate's own inner loops and for tools that measure them. Engines have no use for it:
//! [`Model::from_bytes`](crate::Model::from_bytes) chooses the fastest set.
//!
//! [`Instructions`] names a set. Geometry runs plain loops on it (`Instructions::run`), which the
//! compiler turns into vector code; the networks have kernels written for each set
//! ([`Precision::instructions`](crate::Precision::instructions)). Results of geometry are the
//! same bits on all sets.

mod aligned;
mod float;
mod instructions;
#[cfg(target_arch = "x86_64")]
pub mod matrix_units;

pub(crate) use aligned::AlignedWords;
pub(crate) use float::Float;
pub use instructions::Instructions;
