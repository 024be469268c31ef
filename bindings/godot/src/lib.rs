//! Neural garments in Godot 4, as a GDExtension.
//!
//! The extension has one class, the node `UnicGarment3D`: a mesh that follows a `Skeleton3D`. Its
//! properties and methods are on the page of the extension, `bindings/godot/README.md`.
//!
//! The modules [`surface`], [`tangents`] and [`garment`] need no engine. They are public for tests and for
//! the program that writes the engine test's expectations.
//!
//! # Units, axes, time
//!
//! Model and Godot have the same axes: right-handed, +Y up, metres; a glTF character faces +Z. A
//! character of another size is dressed in its size. The garment is stepped at the model's rate,
//! whatever the display's rate is, after all `_process` of a frame and after the skeleton's
//! modifiers.

mod body;
mod entry;
pub mod garment;
mod mesh;
mod model;
mod node;
pub mod surface;
pub mod tangents;
mod worn;

pub use node::{Display, UnicGarment3D};
