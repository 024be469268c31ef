//! What an engine links to wear a neural garment.

pub mod character;
pub mod clip;
pub mod mesh;
pub mod skeleton;
pub mod skinning;
pub mod transform;
