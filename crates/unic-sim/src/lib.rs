//! Cloth simulation on animated bodies.

pub mod body;
pub mod contact;
mod particles;
pub mod self_contact;

pub use particles::Particles;
