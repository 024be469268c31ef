//! The animator under test, on clips of a capture or on motion made from them.

use super::{Tick, Watcher};
use crate::error::{Error, Result};
use glam::Vec3;
use std::ops::Range;
use unic_core::{
    animator::{Animator, AnimatorError, Start, StepInput},
    character::Garment,
    clip::Clip,
    features::PointFrame,
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};
use unic_io::Capture;

/// What is tested, on what, and who watches.
pub(super) struct Subject<'a> {
    pub(super) capture: &'a Capture,
    pub(super) animator: Animator,
    watch: &'a mut Watcher<'a>,
    tick: Tick,
}

/// What a run does with each frame: its number, and the animator after it.
pub(super) type Visit<'a> = dyn FnMut(usize, &Animator) + 'a;

impl<'a> Subject<'a> {
    pub(super) fn new(capture: &'a Capture, animator: Animator, watch: &'a mut Watcher<'_>) -> Self {
        Self {
            capture,
            animator,
            watch,
            tick: Tick {
                measure: "",
                done: 0,
                total: 0,
            },
        }
    }

    pub(super) fn fps(&self) -> f32 {
        self.animator.model().config().fps
    }

    pub(super) fn skeleton(&self) -> &'a Skeleton {
        &self.capture.character.skeleton
    }

    /// Of a clip, without reading it.
    pub(super) fn frames(&self, name: &str) -> Result<usize> {
        Ok(self.capture.summarise_clip(name)?.pose_frames)
    }

    /// The measure that the next frames belong to.
    pub(super) fn begin(&mut self, measure: &'static str, total: usize) {
        self.tick = Tick {
            measure,
            done: 0,
            total,
        };
    }

    /// Resets at the first of the frames and steps through the others; none leave the animator as it is.
    pub(super) fn run(
        &mut self,
        clip: &Clip,
        frames: Range<usize>,
        start: Start,
        visit: &mut Visit,
    ) -> Result<()> {
        if frames.is_empty() {
            return Ok(());
        }
        let first = self
            .animator
            .reset(&StepInput::of_clip(clip, frames.start), start);
        first.map(|_| ()).map_err(|e| refused(clip, e))?;
        visit(frames.start, &self.animator);
        self.go_on(clip, frames.start + 1..frames.end, visit)
    }

    /// Steps through the frames from the state that the animator is in.
    pub(super) fn go_on(&mut self, clip: &Clip, frames: Range<usize>, visit: &mut Visit) -> Result<()> {
        for frame in frames {
            let stepped = self.animator.step(&StepInput::of_clip(clip, frame));
            stepped.map(|_| ()).map_err(|e| refused(clip, e))?;
            visit(frame, &self.animator);
            self.tick.done += 1;
            (self.watch)(&self.tick).map_err(Error::Stopped)?;
        }
        Ok(())
    }
}

pub(super) fn refused(clip: &Clip, source: AnimatorError) -> Error {
    Error::Animator {
        clip: clip.name.clone(),
        source,
    }
}

/// Where the skeleton carries a garment in one pose after another.
pub(super) struct Carried<'a> {
    skeleton: &'a Skeleton,
    garment: &'a Garment,
    world_from_joint: Vec<Rigid>,
    world_from_rest: Vec<Rigid>,
}

impl<'a> Carried<'a> {
    pub(super) fn new(capture: &'a Capture) -> Self {
        Self {
            skeleton: &capture.character.skeleton,
            garment: &capture.garment,
            world_from_joint: Vec::new(),
            world_from_rest: Vec::new(),
        }
    }

    pub(super) fn pose(&mut self, pose: &Pose) {
        let Self { skeleton, .. } = self;
        skeleton.forward_kinematics(pose, &mut self.world_from_joint);
        skeleton.world_from_rest(&self.world_from_joint, &mut self.world_from_rest);
    }

    pub(super) fn frame(&self, vertex: usize) -> PointFrame {
        PointFrame::new(self.garment, vertex, &self.world_from_rest)
    }

    pub(super) fn displacement(&self, vertex: usize, world: Vec3) -> Vec3 {
        self.frame(vertex).displacement(world)
    }

    /// Largest displacement of any vertex, metres; not a number where a position is none.
    pub(super) fn largest(&self, world: &[Vec3]) -> f32 {
        // Rotating changes no length.
        let length = |(vertex, x): (usize, &Vec3)| {
            let rest = self.garment.rest.vertices[vertex];
            let skinned = self.garment.weights.position(vertex, rest, &self.world_from_rest);
            x.distance(skinned)
        };
        let lengths = world.iter().enumerate().map(length);
        lengths.fold(0.0, |most, d| if d > most || d.is_nan() { d } else { most })
    }
}
