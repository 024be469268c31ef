//! Animator: one instance of a model on one character, stepped on the device.

mod buffers;
mod programs;
mod saved_state;
mod upload;

pub(crate) use buffers::{Buffers, OrderBuffers};

use crate::{GpuError, GpuModel, mesh::SHOWN_BYTES, program::StageTime};
use glam::Vec3;
use programs::Programs;
use std::sync::Arc;
use unic_core::{
    IntersectionMode, Model, Start, StepInput,
    motion::MotionState,
    replay::{Replay, ReplayState},
};
use upload::{Frame, TickSettings, Upload};
use wgpu::Buffer;

/// Garment in motion on a device: a shared [`GpuModel`] with its own state and scratch memory.
///
/// Use it like [`unic_core::Animator`] on the CPU: [`reset`](Self::reset) at the first frame and
/// after a cut, then [`step`](Self::step) at the model's frame rate. Calls return when the work is
/// submitted. [`vertex_buffer`](Self::vertex_buffer) holds the garment for work that is submitted
/// after.
#[derive(Debug)]
pub struct GpuAnimator {
    asset: Arc<GpuModel>,
    mode: IntersectionMode,
    /// Motion vectors: the part of the state that is on the host.
    motion: MotionState,
    /// True until the first step after a reset.
    at_start: bool,
    /// Number of steps since the reset.
    ticks: u64,
    /// State of the prior's replay, which searches on the host.
    replay: Option<ReplayState>,
    wind: Vec3,
    buffers: Buffers,
    programs: Programs,
    upload: Upload,
}

/// Garment that was copied from a device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GarmentCopy {
    /// World position of each vertex of the model's mesh, metres.
    pub positions: Vec<Vec3>,
    /// Unit normal of each vertex, weighted by area.
    pub normals: Vec<Vec3>,
}

impl GpuAnimator {
    /// Stride of a vertex in [`vertex_buffer`](Self::vertex_buffer), bytes.
    pub const VERTEX_STRIDE: u64 = SHOWN_BYTES as u64;

    /// Vertex attributes: position and normal as two `Float32x3`, at the shader locations 0 and 1.
    pub const VERTEX_ATTRIBUTES: [wgpu::VertexAttribute; 2] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];

    /// Creates an animator at the mean shape in the bind pose.
    ///
    /// # Errors
    /// Fails on too little memory and on meshes that exceed the device's limits.
    pub fn new(asset: Arc<GpuModel>) -> Result<Self, GpuError> {
        let model = Arc::clone(&asset.model);
        let bind_pose = model.character().skeleton.bind_pose();
        let input = StepInput {
            pose: &bind_pose,
            next_pose: None,
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        let mode = model.config().intersection;
        let (buffers, programs) = asset.context.checked(|| {
            let buffers = Buffers::new(&asset);
            let programs = Programs::new(&asset, &buffers, mode)?;
            Ok((buffers, programs))
        })?;
        // The reset below replaces this motion state; it only has to be a valid one.
        let mut animator = Self {
            motion: start_motion(&model, &input),
            at_start: true,
            ticks: 0,
            replay: None,
            wind: Vec3::ZERO,
            mode,
            buffers,
            programs,
            upload: Upload::default(),
            asset,
        };
        animator.reset(&input, Start::MeanShape)?;
        Ok(animator)
    }

    /// Asset that the animator shares with others.
    pub fn asset(&self) -> &Arc<GpuModel> {
        &self.asset
    }

    /// Current intersection handling: the model's own, unless it was replaced.
    pub fn intersection(&self) -> IntersectionMode {
        self.mode
    }

    /// Replaces the model's intersection handling from the next step on; resets keep it. `mode`
    /// must pass [`IntersectionMode::check`].
    ///
    /// # Errors
    /// Fails on too little memory; the current handling then stays.
    pub fn set_intersection(&mut self, mode: IntersectionMode) -> Result<(), GpuError> {
        let (asset, buffers) = (&self.asset, &self.buffers);
        self.programs = asset.context.checked(|| Programs::new(asset, buffers, mode))?;
        self.mode = mode;
        Ok(())
    }

    /// Starts at frame 0 of a sequence, or at the frame after a cut.
    ///
    /// # Errors
    /// Fails on a pose of another skeleton, positions of another mesh and numbers that are not
    /// finite. The state then stays as it was.
    pub fn reset(&mut self, input: &StepInput, start: Start) -> Result<(), GpuError> {
        let model = &self.asset.model;
        input.check(model)?;
        start.check(model)?;
        self.motion = start_motion(model, input);
        (self.at_start, self.ticks) = (true, 0);
        self.replay = model.prior().replay.as_ref().map(Replay::start);
        self.wind = input.wind;
        self.upload
            .residuals(&self.asset, &self.buffers, self.replay.as_ref());
        let (before, now) = self.motion.pair();
        self.upload.pair(&self.asset, &self.buffers, [before, now]);
        self.upload_tick(Frame::Current);
        let program = match start {
            Start::MeanShape => &self.programs.start_at_mean,
            Start::Positions(positions) => {
                self.upload.positions(&self.asset, &self.buffers, positions);
                &self.programs.start_at_shown
            }
        };
        program.submit(&self.asset.context);
        Ok(())
    }

    /// Steps by one tick of 1 / fps seconds to a new pose.
    ///
    /// Each channel of the motion's code takes its largest logit. Devices draw no
    /// [noise](unic_core::CodeSampling), also after the state of an animator that does.
    ///
    /// # Errors
    /// Fails on a pose of another skeleton, on numbers that are not finite, and on a pose farther
    /// than 1000 km from the origin. The state then stays as it was.
    pub fn step(&mut self, input: &StepInput) -> Result<(), GpuError> {
        self.advance(input)?;
        self.programs.step.submit(&self.asset.context);
        Ok(())
    }

    /// Steps like [`step`](Self::step), blocks until the device is done, and returns the time of
    /// each stage.
    ///
    /// # Errors
    /// Fails on the input that [`step`](Self::step) refuses, and when the device has no timestamps
    /// or is lost.
    pub fn step_timed(&mut self, input: &StepInput) -> Result<Vec<StageTime>, GpuError> {
        self.advance(input)?;
        self.programs.step.submit_timed(&self.asset.context)
    }

    /// Replaces the garment at the current frame by given world positions in metres, as
    /// [`unic_core::Animator::set_garment`] does. The garment of the previous frame stays.
    ///
    /// # Errors
    /// Fails on positions of another mesh or that are not finite. The state then stays as it was.
    pub fn set_garment(&mut self, positions: &[Vec3]) -> Result<(), GpuError> {
        Start::Positions(positions).check(&self.asset.model)?;
        self.upload.positions(&self.asset, &self.buffers, positions);
        self.programs.set.submit(&self.asset.context);
        Ok(())
    }

    /// Buffer of world positions and normals: six f32 a vertex, in the order of the model's mesh.
    /// Its usages are `VERTEX`, `STORAGE`, `COPY_SRC` and `COPY_DST`.
    pub fn vertex_buffer(&self) -> &Buffer {
        &self.buffers.shown
    }

    /// Blocks until the device is done and copies the garment.
    ///
    /// # Errors
    /// Fails when the device is lost.
    pub fn read_back(&self) -> Result<GarmentCopy, GpuError> {
        let bytes = SHOWN_BYTES * self.asset.model.vertex_count();
        let copied = self
            .asset
            .context
            .download(&self.buffers.shown, 0, bytes as u64)?;
        let shown: Vec<[Vec3; 2]> = bytemuck::pod_collect_to_vec(&copied);
        Ok(GarmentCopy {
            positions: shown.iter().map(|[position, _]| *position).collect(),
            normals: shown.iter().map(|[_, normal]| *normal).collect(),
        })
    }

    /// Advances the motion vectors to a new pose and uploads them.
    fn advance(&mut self, input: &StepInput) -> Result<(), GpuError> {
        let asset = Arc::clone(&self.asset);
        let model = &asset.model;
        input.check(model)?;
        let (spec, skeleton) = (&model.config().motion, &model.character().skeleton);
        self.motion.advance(spec, skeleton, &input.motion(model));
        self.wind = input.wind;
        let (before, now) = self.motion.pair();
        // The first step knows the velocities of frame 0, and so the prior from which its
        // displacements are counted.
        if self.at_start {
            self.upload.normalise(&asset, [before, now]);
            self.upload.begin(&asset, self.replay.as_mut());
            self.upload.residuals(&asset, &self.buffers, self.replay.as_ref());
            self.upload.pair(&asset, &self.buffers, [before, before]);
            self.programs.complete_start.submit(&asset.context);
        }
        self.upload.pair(&asset, &self.buffers, [before, now]);
        self.upload.advance(&asset, self.replay.as_mut());
        self.upload.residuals(&asset, &self.buffers, self.replay.as_ref());
        self.upload_tick(Frame::Current);
        self.at_start = false;
        self.ticks += 1;
        Ok(())
    }

    fn upload_tick(&mut self, frame: Frame) {
        let settings = TickSettings {
            frame,
            mode: self.mode,
            wind: self.wind,
        };
        self.upload
            .tick(&self.asset, &self.buffers, &self.motion, settings);
    }
}

fn start_motion(model: &Model, input: &StepInput) -> MotionState {
    let (spec, skeleton) = (&model.config().motion, &model.character().skeleton);
    MotionState::start(spec, skeleton, &input.motion(model))
}
