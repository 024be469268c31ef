//! Windows and pictures of dressed characters.

#![forbid(unsafe_code)]

mod error;
mod figure;
mod follow;
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
pub use follow::FollowCamera;
pub use mesh::Mesh;
pub use movie::{EarlierFrames, MovieError, MovieFormat, MovieWriter};
pub use orbit::Orbit;
pub use painter::{Painter, PainterChoice};
pub use play::{Costume, PlaySession, PlaySettings, Steering, Times, play_in_window};
pub use posed::{Skinning, TickedShape};
pub use quality::{Quality, QualityControl, Samples};
pub use rasterised::rasterise;
pub use renderer::{Canvas, Renderer};
pub use scene::{Fabric, Focus, Mark, Material, Part, Print, Scene, Shading, Shape};
pub use vertex::Vertex;
pub use view::{
    AnimatedMesh, AnimationSource, CameraMotion, ClipSource, Loader, ModelSource, PaneChoice, PaneFacts, Prediction,
    Progress, Quantity, ShapeFrames, SheetLayout, Source, StageTimes, Track, TrackKind, ViewLooks, ViewSession,
    ViewSettings, ViewUpdate, draw_sheet, view_in_window,
};
pub use window::{AdapterKind, Pane, WindowDevice, WindowSettings, run_window, window_quality};

pub use eframe::{self, egui};
pub use unic_gpu::GpuContext;
