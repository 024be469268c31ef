//! Pictures of garments on characters, drawn on the CPU.
//!
//! They need no GPU, and are equal on every machine of one kind. A picture has three inputs:
//! [`Surface`]s (borrowed triangle meshes in world space, metres, +Y up), a [`Camera`], and a
//! [`Scene`] that adds ground and background. [`render`] draws an [`Image`], which can be labelled,
//! tiled by [`grid`] and saved.
//!
//! ```
//! use glam::Vec3;
//! use unic_raster::{Camera, Colouring, Scene, Surface, render, vertex_normals};
//!
//! let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y];
//! let faces = [[0, 1, 2]];
//! let normals = vertex_normals(&vertices, &faces)?;
//! let triangle = Surface {
//!     vertices: &vertices,
//!     faces: &faces,
//!     normals: &normals,
//!     colour: Colouring::Solid([0.8, 0.3, 0.2]),
//! };
//! let camera = Camera::framing(Vec3::ZERO, Vec3::ONE, 0.4, 0.2, 1.0)?;
//! let mut image = render(&Scene::new(&[triangle]), &camera, 64, 64)?;
//! image.draw_text(4, 4, 1, [40, 40, 40], "frame 1");
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("triangle.png");
//! image.save_png(&path)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Features:
//!
//! - near clipping and watertight coverage in fixed point, with four samples per pixel,
//! - perspective-correct attributes,
//! - a key light with a shadow map, a fill light and hemispheric ambient light,
//! - back faces that are slightly darker,
//! - soft shadows and a half-metre grid on the ground.
//!
//! There is no transparency, and there are no textures. The ground does not intersect the geometry:
//! it is drawn behind all surfaces, so that feet below the floor stay visible.
//!
//! Triangles with a non-finite vertex are skipped. The pixels do not depend on the number of
//! threads.

#![forbid(unsafe_code)]

mod camera;
mod colour;
mod error;
mod font;
mod ground;
mod image;
mod light;
mod moving;
mod palette;
mod project;
mod raster;
mod render;
mod sheet;
mod surface;

pub use camera::Camera;
pub use colour::{heat_colour, heat_colours, linear_from_srgb};
pub use error::RasterError;
pub use image::{Image, MAX_IMAGE_SIDE};
pub use moving::{GifWriter, encode_gif};
pub use render::{Ground, Scene, render};
pub use sheet::{captioned, grid};
pub use surface::{Colouring, Surface, vertex_normals};
