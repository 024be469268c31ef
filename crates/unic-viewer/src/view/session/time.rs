//! Time of a view.

use super::ViewSession;
use crate::view::body::Body;

impl ViewSession {
    /// Duration of the longest motion, seconds, from the first frame to the end of the last one.
    pub fn duration(&self) -> f32 {
        let seconds = self
            .bodies
            .iter()
            .map(|body| body.frame_count() as f32 / body.fps());
        seconds.fold(0.0, f32::max)
    }

    /// Largest frame rate, frames a second.
    pub fn fps(&self) -> f32 {
        self.bodies.iter().map(Body::fps).fold(1.0, f32::max)
    }

    /// Time, seconds.
    pub fn seconds(&self) -> f32 {
        self.seconds
    }

    /// Index of the frame of a track at the present time.
    pub fn frame(&self, track: usize) -> usize {
        self.bodies[self.tracks[track].body].frame_at(self.seconds)
    }

    /// Number of frames and frames a second of a track.
    pub fn rate(&self, track: usize) -> (usize, f32) {
        let body = &self.bodies[self.tracks[track].body];
        (body.frame_count(), body.fps())
    }

    /// Goes to a time, which is kept within the motion.
    pub fn set_seconds(&mut self, seconds: f32) {
        let last = (self.duration() - 1.0 / self.fps()).max(0.0);
        self.seconds = match seconds.is_finite() {
            true => seconds.clamp(0.0, last),
            false => 0.0,
        };
    }

    /// Goes on by some seconds, and begins again at the end.
    pub fn advance(&mut self, seconds: f32) {
        let duration = self.duration();
        let next = self.seconds + seconds;
        self.seconds = if next < duration { next.max(0.0) } else { 0.0 };
    }

    /// Goes to the frame after or before the present one.
    pub fn step(&mut self, frames: i32) {
        let frame = (self.seconds * self.fps() + 1e-3).floor() + frames as f32;
        self.set_seconds(frame / self.fps());
    }

    /// Blocks until all that is shown at a time is computed.
    pub fn wait_for(&self, seconds: f32) {
        for track in self.visible() {
            let track = &self.tracks[track];
            track.wait_for(self.bodies[track.body].frame_at(seconds));
        }
    }

    /// Whether all that is shown at a time is computed.
    pub fn is_ready(&self, seconds: f32) -> bool {
        self.visible().into_iter().all(|track| {
            let track = &self.tracks[track];
            track.is_ready(self.bodies[track.body].frame_at(seconds))
        })
    }
}
