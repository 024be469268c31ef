//! `unic view`: models, captures and animations side by side.

mod body;
mod layout;
mod panes;
mod prediction;
mod quantity;
mod session;
mod sheet;
mod source;
mod track;
mod window;

pub use prediction::{Prediction, Progress, StageTimes};
pub use quantity::{PaneFacts, Quantity};
pub use session::{CameraMotion, PaneChoice, Side, Subject, ViewLooks, ViewSession};
pub use sheet::{SheetLayout, draw_sheet};
pub use source::{AnimatedMesh, AnimationSource, ClipSource, ModelSource, ShapeFrames, Source};
pub use track::{Track, TrackKind};
pub use window::{Loader, ViewSettings, ViewUpdate, view_in_window};
