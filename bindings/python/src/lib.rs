//! Neural garments in Python: the extension module `unic._unic`.
//!
//! | content | module |
//! |---|---|
//! | models, characters, meshes: assets, whose arrays are views | [`model`], [`character`], [`mesh`] |
//! | poses and motions | [`pose`], [`motion`] |
//! | garments in motion | [`animator`], [`stepping`], [`collider`], [`threads`] |
//! | captures and files | [`capture`], [`files`] |
//! | numpy arrays in and out | [`arrays`], [`numbers`], [`targets`] |
//! | errors, and panics that become errors | [`error`] |
//! | the program `unic` | [`program`] |
//!
//! The description of every class for users is in `unic/_unic.pyi`. Classes are frozen: they have
//! no state but that of an animator, which is behind a lock.

mod animator;
mod arrays;
mod capture;
mod character;
mod collider;
mod error;
mod files;
mod mesh;
mod model;
mod motion;
mod motion_options;
mod names;
mod numbers;
mod pose;
mod program;
mod stepping;
mod targets;
mod threads;

use pyo3::prelude::*;

/// The extension module.
#[pymodule]
mod _unic {
    #[pymodule_export]
    use super::{
        animator::Animator,
        capture::{Capture, CapturedClip},
        character::Character,
        collider::Collider,
        files::{VertexAnimation, read_character, read_mesh, read_vertex_animation},
        mesh::Mesh,
        model::Model,
        motion::Motion,
        pose::Pose,
        program::{read_scene, read_scenes_with, run},
    };
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
