//! `unic play`: a dressed character that is steered.

mod crowd;
mod marks;
mod palette;
mod session;
mod settings;
mod steering;
mod window;

pub use session::{PlaySession, Times};
pub use settings::{Costume, PlaySettings, Settling};
pub use steering::Steering;
pub use window::play_in_window;
