//! One instance of a model on one character, stepped on the device.

use crate::{
    GpuError, GpuModel,
    body::Handling,
    garment::{GarmentBuffers, is_in_frame},
    kernel::Dispatch,
    mesh::SHOWN_BYTES,
    motion::Tick,
    program::{Program, StageTime},
};
use glam::{Quat, Vec3};
use std::sync::Arc;
use unic_core::{
    animator::{Start, StepInput},
    config::{Corrects, IntersectionMode},
    model::Model,
    motion::MotionState,
    transform::Rigid,
};
use wgpu::{Buffer, BufferUsages};

/// One garment in motion on a device: a shared [`GpuModel`], its own state and scratch memory.
///
/// As [`unic_core::animator::Animator`] is on the CPU: [`reset`](Self::reset) at the first frame and after a
/// cut, then [`step`](Self::step) at the model's frame rate. Calls return when the work is
/// submitted; [`vertex_buffer`](Self::vertex_buffer) holds the garment for whatever is submitted after.
#[derive(Debug)]
pub struct GpuAnimator {
    asset: Arc<GpuModel>,
    mode: IntersectionMode,
    /// State on the host: the motion vectors. The rest of the state is on the device.
    motion: MotionState,
    /// Has no step been taken since the reset?
    at_start: bool,
    buffers: Buffers,
    programs: Programs,
    upload: Upload,
}

/// State and scratch on the device.
#[derive(Debug)]
struct Buffers {
    tick: Buffer,
    /// The recurrence's memory, which is state, and the vectors of one frame.
    vectors: Buffer,
    points: Buffer,
    /// State of every vertex.
    states: Buffer,
    inputs: Buffer,
    shown: Buffer,
}

/// What the device does in every call.
#[derive(Debug, Default)]
struct Programs {
    start_at_mean: Program,
    start_at_shown: Program,
    complete_start: Program,
    step: Program,
    set: Program,
}

/// Host memory on its way to the device. Scratch.
#[derive(Debug, Default)]
struct Upload {
    pair: Vec<f32>,
    world_from_rest: Vec<Rigid>,
    tick: Vec<[f32; 4]>,
    shown: Vec<[Vec3; 2]>,
}

/// A garment that was copied from a device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GarmentCopy {
    /// World positions, metres, one a vertex of the model's mesh.
    pub positions: Vec<Vec3>,
    /// Unit normals, area-weighted.
    pub normals: Vec<Vec3>,
}

impl GpuAnimator {
    /// Bytes from one vertex to the next in [`vertex_buffer`](Self::vertex_buffer).
    pub const VERTEX_STRIDE: u64 = SHOWN_BYTES as u64;

    /// Position and normal as two `Float32x3`, at the shader locations 0 and 1.
    pub const VERTEX_ATTRIBUTES: [wgpu::VertexAttribute; 2] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];

    /// An animator at the mean shape in the bind pose.
    ///
    /// # Errors
    /// Memory that does not suffice, an intersection handling that devices do not have.
    pub fn new(asset: Arc<GpuModel>) -> Result<Self, GpuError> {
        let model = Arc::clone(&asset.model);
        let bind_pose = model.character().skeleton.bind_pose();
        let input = StepInput {
            pose: &bind_pose,
            next_pose: None,
            ground_height: 0.0,
        };
        let mode = model.config().intersection;
        let (buffers, programs) = asset.context.checked(|| {
            let buffers = Buffers::new(&asset);
            let programs = Programs::new(&asset, &buffers, mode)?;
            Ok((buffers, programs))
        })?;
        let mut animator = Self {
            motion: start_motion(&model, &input),
            at_start: true,
            mode,
            buffers,
            programs,
            upload: Upload::default(),
            asset,
        };
        animator.reset(&input, Start::MeanShape)?;
        Ok(animator)
    }

    /// The shared asset.
    pub fn asset(&self) -> &Arc<GpuModel> {
        &self.asset
    }

    /// Intersection handling in force: the model's own, unless replaced.
    pub fn intersection(&self) -> IntersectionMode {
        self.mode
    }

    /// Replaces the model's intersection handling from the next step on; kept over resets. `mode`
    /// passes [`IntersectionMode::check`].
    ///
    /// # Errors
    /// A handling that devices do not have; the one in force stays.
    pub fn set_intersection(&mut self, mode: IntersectionMode) -> Result<(), GpuError> {
        let (asset, buffers) = (&self.asset, &self.buffers);
        self.programs = asset.context.checked(|| Programs::new(asset, buffers, mode))?;
        self.mode = mode;
        Ok(())
    }

    /// Frame 0 of a sequence, or the frame after a cut.
    ///
    /// # Errors
    /// A pose of another skeleton, positions of another mesh, numbers that are not finite; the
    /// state stays as it was.
    pub fn reset(&mut self, input: &StepInput, start: Start) -> Result<(), GpuError> {
        let model = &self.asset.model;
        input.check(model)?;
        start.check(model)?;
        self.motion = start_motion(model, input);
        self.at_start = true;
        let (before, now) = self.motion.pair();
        self.upload.pair(&self.asset, &self.buffers, [before, now]);
        self.upload_tick();
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

    /// One tick of 1 / fps seconds to a new pose.
    ///
    /// # Errors
    /// A pose of another skeleton, with numbers that are not finite or farther than 1000 km from the
    /// origin; the state stays as it was.
    pub fn step(&mut self, input: &StepInput) -> Result<(), GpuError> {
        self.advance(input)?;
        self.programs.step.submit(&self.asset.context);
        Ok(())
    }

    /// As [`step`](Self::step), and blocks until the device has told how long each stage took.
    ///
    /// # Errors
    /// As [`step`](Self::step); a device that cannot tell or is lost.
    pub fn step_timed(&mut self, input: &StepInput) -> Result<Vec<StageTime>, GpuError> {
        self.advance(input)?;
        self.programs.step.submit_timed(&self.asset.context)
    }

    /// Replaces the garment at the current frame by given world positions in metres, as
    /// [`unic_core::animator::Animator::set_garment`] does: the garment of the frame before stays.
    ///
    /// # Errors
    /// Positions of another mesh or that are not finite; the state stays as it was.
    pub fn set_garment(&mut self, positions: &[Vec3]) -> Result<(), GpuError> {
        Start::Positions(positions).check(&self.asset.model)?;
        self.upload.positions(&self.asset, &self.buffers, positions);
        self.programs.set.submit(&self.asset.context);
        Ok(())
    }

    /// Positions and normals, world: six f32 a vertex, in the order of the model's mesh. Usages are
    /// `VERTEX`, `STORAGE`, `COPY_SRC` and `COPY_DST`.
    pub fn vertex_buffer(&self) -> &Buffer {
        &self.buffers.shown
    }

    /// Blocks until the device is done and copies the garment.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn read_back(&self) -> Result<GarmentCopy, GpuError> {
        let bytes = SHOWN_BYTES * self.asset.model.vertex_count();
        let copied = self.asset.context.download(&self.buffers.shown, bytes as u64)?;
        let shown: Vec<[Vec3; 2]> = bytemuck::pod_collect_to_vec(&copied);
        Ok(GarmentCopy {
            positions: shown.iter().map(|[position, _]| *position).collect(),
            normals: shown.iter().map(|[_, normal]| *normal).collect(),
        })
    }

    /// The motion vectors of a new pose, and what the device needs to know of them.
    fn advance(&mut self, input: &StepInput) -> Result<(), GpuError> {
        let asset = Arc::clone(&self.asset);
        let model = &asset.model;
        input.check(model)?;
        let (spec, skeleton) = (&model.config().motion, &model.character().skeleton);
        self.motion.advance(spec, skeleton, &input.motion(model));
        let (before, now) = self.motion.pair();
        if self.at_start {
            self.upload.pair(&asset, &self.buffers, [before, before]);
            self.programs.complete_start.submit(&asset.context);
        }
        self.upload.pair(&asset, &self.buffers, [before, now]);
        self.upload_tick();
        self.at_start = false;
        Ok(())
    }

    fn upload_tick(&mut self) {
        let skeleton = &self.asset.model.character().skeleton;
        let Upload {
            world_from_rest,
            tick,
            ..
        } = &mut self.upload;
        skeleton.world_from_rest(self.motion.world_from_joint(), world_from_rest);
        let frame = self.motion.world_from_frame();
        let handling = match self.mode {
            IntersectionMode::Off => 0.0,
            IntersectionMode::Paper { relaxation_m } => relaxation_m,
            IntersectionMode::Robust { margin_m, .. } => margin_m,
        };
        tick.clear();
        let first = f32::from(u8::from(self.at_start));
        tick.extend([quadruple(frame.rotation), frame.translation.extend(first).to_array()]);
        tick.push([handling, 0.0, 0.0, 0.0]);
        tick.extend(
            (world_from_rest.iter())
                .flat_map(|joint| [quadruple(joint.rotation), joint.translation.extend(0.0).to_array()]),
        );
        let queue = self.asset.context.queue();
        queue.write_buffer(&self.buffers.tick, 0, bytemuck::cast_slice(tick));
    }
}

fn start_motion(model: &Model, input: &StepInput) -> MotionState {
    let (spec, skeleton) = (&model.config().motion, &model.character().skeleton);
    MotionState::start(spec, skeleton, &input.motion(model))
}

fn quadruple(rotation: Quat) -> [f32; 4] {
    rotation.to_array()
}

impl Upload {
    /// A pair of motion vectors, normalised.
    fn pair(&mut self, asset: &GpuModel, buffers: &Buffers, pair: [&[f32]; 2]) {
        let pair_at = 4 * asset.networks.pair as u64;
        asset.model.normalisation().write_pair(pair, &mut self.pair);
        let queue = asset.context.queue();
        queue.write_buffer(&buffers.vectors, pair_at, bytemuck::cast_slice(&self.pair));
    }

    /// World positions to where they are shown.
    fn positions(&mut self, asset: &GpuModel, buffers: &Buffers, positions: &[Vec3]) {
        self.shown.clear();
        self.shown.extend(positions.iter().map(|&p| [p, Vec3::ZERO]));
        let queue = asset.context.queue();
        queue.write_buffer(&buffers.shown, 0, bytemuck::cast_slice(&self.shown));
    }
}

impl Buffers {
    fn new(asset: &GpuModel) -> Self {
        /// Quadruples of a vertex's `Point` and `VertexState`, see `places.wgsl`.
        const POINT: usize = 4;
        const STATE: usize = 2;
        let (context, model) = (&asset.context, &asset.model);
        let vertices = model.vertex_count();
        let joints = model.character().skeleton.len();
        let inputs = model.field().point_inputs() * asset.field.shape.stride(vertices);
        let zeroed = |label, bytes| context.zeroed(label, bytes, BufferUsages::empty());
        Self {
            tick: zeroed("tick", 16 * (3 + 2 * joints)),
            vectors: asset.networks.vectors(context),
            points: zeroed("points", 16 * POINT * vertices),
            states: zeroed("states", 16 * STATE * vertices),
            inputs: zeroed("inputs", 4 * inputs),
            shown: context.zeroed("garment", SHOWN_BYTES * vertices, BufferUsages::VERTEX),
        }
    }

    fn garment(&self) -> GarmentBuffers<'_> {
        GarmentBuffers {
            tick: &self.tick,
            vectors: &self.vectors,
            points: &self.points,
            states: &self.states,
            inputs: &self.inputs,
            shown: &self.shown,
        }
    }
}

impl Programs {
    fn new(asset: &GpuModel, buffers: &Buffers, mode: IntersectionMode) -> Result<Self, GpuError> {
        let of = buffers.garment();
        let recorder = Recorder {
            asset,
            of,
            handling: match mode {
                IntersectionMode::Off => None,
                IntersectionMode::Paper { .. } => Some(asset.body.paper(&asset.context, of, &asset.model)?),
                IntersectionMode::Robust { .. } => Some(asset.body.robust(&asset.context, of, &asset.model)?),
            },
            mode,
        };
        let garment = &asset.garment;
        let mut complete_start = Program::default();
        if !is_in_frame(&asset.model) {
            complete_start.stage("prior", asset.networks.record_prior(of.vectors, Tick::First)?);
            complete_start.stage("rehang", vec![garment.rehang(of)?]);
        }
        let mut set = Program::default();
        set.stage("set", vec![garment.take_shown(of)?]);
        recorder.show(&mut set)?;
        Ok(Self {
            start_at_mean: recorder.start(garment.take_mean(of)?)?,
            start_at_shown: recorder.start(garment.take_shown(of)?)?,
            complete_start,
            step: recorder.step()?,
            set,
        })
    }
}

/// Writes programs for one animator.
struct Recorder<'a> {
    asset: &'a GpuModel,
    of: GarmentBuffers<'a>,
    mode: IntersectionMode,
    handling: Option<Handling>,
}

impl Recorder<'_> {
    /// `take` sets the states.
    fn start(&self, take: Dispatch) -> Result<Program, GpuError> {
        let (garment, of) = (&self.asset.garment, self.of);
        let mut program = Program::default();
        program.stage("prior", self.asset.networks.record_prior(of.vectors, Tick::First)?);
        program.stage("start", vec![garment.prepare(of)?, take, garment.hold(of)?]);
        self.show(&mut program)?;
        Ok(program)
    }

    fn step(&self) -> Result<Program, GpuError> {
        let GpuModel {
            networks,
            garment,
            field,
            ..
        } = self.asset;
        let of = self.of;
        let mut program = Program::default();
        program.stage("prior", networks.record_prior(of.vectors, Tick::Next)?);
        program.stage("encoder", networks.record_encoder(of.vectors)?);
        program.stage("skinning", vec![garment.prepare(of)?]);
        program.stage("field", vec![field.dispatch(of)?]);
        if let (IntersectionMode::Paper { .. }, Some(handling)) = (self.mode, &self.handling) {
            program.stage("body", handling.pose.clone());
            program.stage("intersections", vec![handling.correct.clone()]);
        }
        self.show(&mut program)?;
        if self.corrects_shown() == Some(Corrects::State) {
            program.stage("state", vec![garment.take_moved(of)?]);
        }
        Ok(program)
    }

    /// Positions and normals from states.
    fn show(&self, program: &mut Program) -> Result<(), GpuError> {
        let garment = &self.asset.garment;
        program.stage("positions", vec![garment.show(self.of)?]);
        if let (Some(_), Some(handling)) = (self.corrects_shown(), &self.handling) {
            program.stage("body", handling.pose.clone());
            program.stage("intersections", vec![handling.correct.clone()]);
        }
        program.stage("normals", vec![garment.mesh.normals(self.of.shown)?]);
        Ok(())
    }

    /// Are shown positions moved off the body, and the states with them?
    fn corrects_shown(&self) -> Option<Corrects> {
        match self.mode {
            IntersectionMode::Robust { corrects, .. } => Some(corrects),
            IntersectionMode::Off | IntersectionMode::Paper { .. } => None,
        }
    }
}
