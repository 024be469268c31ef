//! `unic play`: a dressed character that is steered.

mod crowd;
mod marks;
mod palette;
mod session;
mod settings;
mod window;

pub use session::{PlaySession, Steering, Times};
pub use settings::{Costume, PlaySettings};
pub use window::play_in_window;
