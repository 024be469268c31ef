//! Windows and pictures of dressed characters.

#![forbid(unsafe_code)]

mod error;
mod mesh;
mod movie;
mod orbit;
mod posed;
mod quality;
mod renderer;
mod scene;
mod vertex;
mod window;

pub use error::ViewerError;
pub use mesh::Mesh;
pub use movie::{EarlierFrames, MovieError, MovieFormat, MovieWriter};
pub use orbit::Orbit;
pub use posed::{Skinning, TickedShape};
pub use quality::{Quality, QualityControl, Samples};
pub use renderer::{Canvas, Renderer};
pub use scene::{Fabric, Focus, Mark, Material, Part, Print, Scene, Shading, Shape};
pub use vertex::Vertex;
pub use window::{AdapterKind, Pane, WindowDevice, WindowSettings, run_window, window_quality};

pub use eframe::{self, egui};
