//! Times of the last frames.

use crate::play::Times;
use std::collections::VecDeque;

/// Number of frames that are kept.
const KEPT: usize = 120;

/// Times of a frame, seconds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FrameTime {
    pub(super) whole_s: f32,
    pub(super) play: Times,
}

impl FrameTime {
    /// Time for drawing, and for the display to be ready, seconds.
    pub(super) fn draw_s(&self) -> f32 {
        (self.whole_s - self.play.motion_s - self.play.garment_s).max(0.0)
    }
}

/// Times of the last frames.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameTimes {
    times: VecDeque<FrameTime>,
    frames: u64,
}

impl FrameTimes {
    /// Adds a frame.
    pub(super) fn push(&mut self, whole_s: f32, play: Times) {
        self.times.truncate(KEPT - 1);
        self.times.push_front(FrameTime {
            whole_s,
            play,
        });
        self.frames += 1;
    }

    /// Number of frames so far.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// Frames that are kept, the last one first.
    pub(super) fn iter(&self) -> impl Iterator<Item = &FrameTime> {
        self.times.iter()
    }

    /// Mean times.
    pub(super) fn means(&self) -> Means {
        let count = self.times.len().max(1) as f32;
        let sum = |value: fn(&FrameTime) -> f32| self.times.iter().map(value).sum::<f32>();
        let ticks = self.times.iter().map(|t| t.play.ticks).sum::<usize>();
        let by_tick = ticks.max(1) as f32;
        Means {
            frame_s: sum(|t| t.whole_s) / count,
            draw_s: sum(FrameTime::draw_s) / count,
            motion_s: sum(|t| t.play.motion_s) / by_tick,
            garment_s: sum(|t| t.play.garment_s) / by_tick,
        }
    }
}

/// Mean times, seconds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Means {
    /// A frame.
    pub(super) frame_s: f32,
    /// Drawing, and waiting for the display, in a frame.
    pub(super) draw_s: f32,
    /// Motion matching in a tick.
    pub(super) motion_s: f32,
    /// Bodies and garments in a tick.
    pub(super) garment_s: f32,
}
