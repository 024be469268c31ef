//! What an engine links to wear a neural garment.

pub mod animator;
pub mod character;
pub mod config;
pub mod features;
pub mod model;
mod model_file;
pub mod network;
pub mod prior;
pub mod clip;
pub mod heading;
pub mod mesh;
pub mod motion;
pub mod skeleton;
pub mod skinning;
pub mod transform;
pub mod closest;
pub mod intersection;
pub mod subdivide;
pub mod surface;
pub mod surface_map;
pub mod topology;
pub mod weights;
mod bvh;
mod diffusion;
mod triangle;

pub use model_file::{FORMAT_VERSION, ModelFileError};

#[cfg(test)]
mod shapes;
