//! Windows and pictures of dressed characters.
//!
//! A [`Scene`] is a list of [`Part`]s: a [`Mesh`] in a [`Shape`], with a [`Material`]. A
//! [`Renderer`] draws it on a graphics device to a [`Canvas`], and [`rasterise`] draws it without
//! one. [`Painter`] takes whichever the machine has, for pictures and movies:
//!
//! ```
//! use glam::Vec3;
//! use std::sync::Arc;
//! use unic_core::mesh::TriMesh;
//! use unic_raster::Ground;
//! use unic_viewer::{
//!     Fabric, Focus, Material, Mesh, Orbit, Painter, PainterChoice, Part, Print, Scene, Shading, Shape, Vertex,
//! };
//!
//! let corners = vec![Vec3::Y, Vec3::new(0.5, 1.0, 0.0), Vec3::new(0.0, 0.4, 0.0)];
//! let flag = TriMesh::new(corners, vec![[0, 2, 1]])?;
//! let mesh = Arc::new(Mesh::new(&flag));
//! let vertices: Vec<Vertex> = (flag.vertices.iter())
//!     .map(|&position| Vertex { position, normal: Vec3::Z })
//!     .collect();
//! let part = Part {
//!     mesh: &mesh,
//!     shape: Shape::Host(&vertices),
//!     material: Material::cloth(Fabric::Linen, [0.7, 0.2, 0.2]).printed(Print::Dots, [1.0; 3]),
//!     colours: None,
//!     shading: Shading::Lit,
//! };
//! let scene = Scene {
//!     parts: &[part],
//!     marks: &[],
//!     ground: Ground::Height(0.0),
//!     to_key: Vec3::new(0.6, 0.8, 0.0),
//!     focus: Focus::around(flag.vertices.iter().copied()),
//! };
//! let mut painter = Painter::new(PainterChoice::Software, [64, 48])?;
//! let image = painter.picture(&scene, &Orbit::person(Vec3::Y * 0.7).camera()?)?;
//! assert_eq!((image.width(), image.height()), (64, 48));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! - [`Figure`] is a character that wears an [`Outfit`]: body and garment, stepped at the model's
//!   rate on the processor or on a device, and shown at any rate.
//! - [`PlaySession`] steers figures by motion matching; [`play_in_window`] shows it in a window.
//! - [`ViewSession`] shows models, captures and animations side by side; [`view_in_window`] shows it
//!   in a window.
//! - [`MovieWriter`] writes pictures as a GIF, an MP4 or a folder of frames.
//! - [`run_window`] opens a window on a device, and a [`Pane`] shows a scene in a part of it.
//!   [`QualityControl`] keeps frames within a time.
//!
//! Nothing here reads files. World space is that of `unic-core`: metres, +Y up.

#![forbid(unsafe_code)]

mod error;
mod figure;
mod follow;
mod free_name;
mod mesh;
mod movie;
mod orbit;
mod painter;
mod play;
mod posed;
mod quality;
mod rasterised;
mod renderer;
mod scene;
mod vertex;
mod view;
mod window;

pub use error::ViewerError;
pub use figure::{Figure, Looks, Outfit};
pub use follow::{FollowCamera, SUN};
pub use mesh::Mesh;
pub use movie::{EarlierFrames, MovieError, MovieFormat, MovieWriter};
pub use orbit::Orbit;
pub use painter::{Painter, PainterChoice};
pub use play::{Costume, PlaySession, PlaySettings, Settling, Steering, Times, play_in_window};
pub use posed::{Skinning, TickedShape};
pub use quality::{Quality, QualityControl, Samples};
pub use rasterised::rasterise;
pub use renderer::{Canvas, Renderer};
pub use scene::{Fabric, Focus, Mark, Material, Part, Print, Scene, Shading, Shape};
pub use vertex::Vertex;
pub use view::{
    AnimatedMesh, AnimationSource, CameraMotion, ClipSource, Loader, ModelSource, PaneChoice, PaneFacts,
    Prediction, Progress, Quantity, ShapeFrames, SheetLayout, Side, Source, StageTimes, Subject, Track,
    TrackKind, ViewLooks, ViewSession, ViewSettings, ViewUpdate, draw_sheet, view_in_window,
};
pub use window::{AdapterKind, Pane, WindowDevice, WindowSettings, run_window, window_quality};

pub use eframe::{self, egui};
pub use unic_gpu::GpuContext;
