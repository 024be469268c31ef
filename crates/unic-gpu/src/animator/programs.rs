//! Programs of an animator: the work of the device in each of its calls.

use super::Buffers;
use crate::{
    GpuError, GpuModel,
    body::Handling,
    garment::is_in_frame,
    kernel::Dispatch,
    motion::Tick,
    program::Program,
    projection::{Projection, ProjectionTick},
    start_memory::MemoryUpdate,
};
use unic_core::{Corrects, IntersectionMode};

/// Programs of one animator. Each is recorded once and submitted any number of times.
#[derive(Debug, Default)]
pub(super) struct Programs {
    /// Reset to the mean shape.
    pub(super) start_at_mean: Program,
    /// Reset to given positions.
    pub(super) start_at_shown: Program,
    /// Completion of frame 0 in the first step, which knows its velocities.
    pub(super) complete_start: Program,
    /// Step to the next frame.
    pub(super) step: Program,
    /// Replacement of the garment by given positions.
    pub(super) set: Program,
    /// Skinning of the frame before a restored one, for the velocities of its points.
    pub(super) skin_previous: Program,
    /// Restored state of frame 0.
    pub(super) resume_at_start: Program,
    /// Restored state of a later frame.
    pub(super) resume: Program,
}

impl Programs {
    pub(super) fn new(asset: &GpuModel, buffers: &Buffers, mode: IntersectionMode) -> Result<Self, GpuError> {
        let (context, model, body) = (&asset.context, &asset.model, &asset.body);
        let recorder = Recorder {
            asset,
            buffers,
            handling: match mode {
                IntersectionMode::Off => None,
                IntersectionMode::Paper { .. } => Some(body.paper(context, buffers, model)?),
                IntersectionMode::Robust { corrects, .. } => Some(body.robust(asset, buffers, corrects)?),
            },
            mode,
        };
        let garment = &asset.garment;
        let mut complete_start = Program::default();
        if !is_in_frame(&asset.model) {
            let prior =
                asset
                    .networks
                    .record_prior(&buffers.vectors, Tick::First, MemoryUpdate::CountAgain)?;
            complete_start.stage("prior", prior);
            complete_start.stage("rebase states", vec![garment.rebase_states(buffers)?]);
        }
        let mut set = Program::default();
        if !is_in_frame(&asset.model) {
            // Without the residual of a replay now, which would be forgotten with the rest.
            let given = asset.networks.record_given(&buffers.vectors)?;
            set.stage("prior", vec![given, garment.refresh_prior(buffers)?]);
        }
        set.stage("set", vec![garment.states_from_shown(buffers)?]);
        set.stage("set", recorder.clear_offsets()?);
        recorder.show(&mut set, OffsetUpdate::Keep)?;
        let mut skin_previous = Program::default();
        skin_previous.stage("skinning", vec![garment.prepare(buffers)?]);
        Ok(Self {
            skin_previous,
            resume_at_start: recorder.resume(Tick::First)?,
            resume: recorder.resume(Tick::Same)?,
            // A mean over many shapes is too short, unlike given positions.
            start_at_mean: recorder.start(
                MemoryUpdate::BeginAtMean,
                garment.start_at_mean(buffers)?,
                OffsetUpdate::Advance(ProjectionTick::Start),
            )?,
            start_at_shown: recorder.start(
                match is_in_frame(&asset.model) {
                    // Root-relative states are measured from no prior, and never fade.
                    true => MemoryUpdate::BeginAtMean,
                    false => MemoryUpdate::BeginGiven,
                },
                garment.states_from_shown(buffers)?,
                OffsetUpdate::Keep,
            )?,
            complete_start,
            step: recorder.step()?,
            set,
        })
    }
}

/// Change of the strain projection's offsets before positions are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OffsetUpdate {
    /// Offsets stay.
    Keep,
    /// Offsets advance to the predicted positions.
    Advance(ProjectionTick),
}

/// Recorder of programs for one animator.
struct Recorder<'a> {
    asset: &'a GpuModel,
    buffers: &'a Buffers,
    mode: IntersectionMode,
    handling: Option<Handling>,
}

impl Recorder<'_> {
    /// Records a reset; `set_states` computes the states of frame 0.
    fn start(
        &self,
        memory: MemoryUpdate,
        set_states: Dispatch,
        offsets: OffsetUpdate,
    ) -> Result<Program, GpuError> {
        let (garment, buffers) = (&self.asset.garment, self.buffers);
        let mut program = Program::default();
        let prior = self
            .asset
            .networks
            .record_prior(&buffers.vectors, Tick::First, memory)?;
        program.stage("prior", prior);
        let prepare = garment.prepare(buffers)?;
        let clear = garment.clear_velocities(&buffers.states)?;
        program.stage("start", vec![prepare, set_states, clear]);
        program.stage("start", self.clear_offsets()?);
        self.show(&mut program, offsets)?;
        Ok(program)
    }

    /// Makes the dispatch that sets offsets to zero, if there are any.
    fn clear_offsets(&self) -> Result<Vec<Dispatch>, GpuError> {
        let projection = self.projection().into_iter();
        projection.map(|p| p.clear_offsets(self.buffers)).collect()
    }

    /// Records the frame of a restored state.
    fn resume(&self, tick: Tick) -> Result<Program, GpuError> {
        let (garment, buffers) = (&self.asset.garment, self.buffers);
        let mut program = Program::default();
        let prior = self
            .asset
            .networks
            .record_prior(&buffers.vectors, tick, MemoryUpdate::Keep)?;
        program.stage("prior", prior);
        program.stage("skinning", vec![garment.prepare(buffers)?]);
        self.show(&mut program, OffsetUpdate::Keep)?;
        Ok(program)
    }

    /// Records a step to the next frame.
    fn step(&self) -> Result<Program, GpuError> {
        let GpuModel {
            networks,
            garment,
            field,
            ..
        } = self.asset;
        let buffers = self.buffers;
        let mut program = Program::default();
        let memory = match self.mode.corrects_state() {
            true => MemoryUpdate::AdvanceFading,
            false => MemoryUpdate::Advance,
        };
        let prior = networks.record_prior(&buffers.vectors, Tick::Next, memory)?;
        program.stage("prior", prior);
        // A model that keeps given displacements has a field of zero (`Model::new`).
        let is_skipped = self.asset.model.is_field_skipped();
        if !is_skipped {
            program.stage("encoder", networks.record_encoder(&buffers.vectors)?);
        }
        program.stage("skinning", vec![garment.prepare(buffers)?]);
        let advance = match is_skipped {
            true => garment.fade(buffers)?,
            false => field.dispatch(buffers)?,
        };
        program.stage("field", vec![advance]);
        let corrects_state = self.corrects_shown() == Some(Corrects::State);
        // The paper's rule corrects states, so it precedes the positions.
        if let IntersectionMode::Paper { .. } = self.mode {
            self.correct(&mut program);
        }
        // With offsets shown positions are not those of the states, which are corrected before.
        if corrects_state && self.projection().is_some() {
            program.stage("positions", vec![garment.write_positions(buffers)?]);
            self.correct(&mut program);
            program.stage("state", vec![garment.states_from_corrected(buffers)?]);
        }
        self.show(&mut program, OffsetUpdate::Advance(ProjectionTick::Next))?;
        // Without offsets one correction serves both: states take what is shown.
        if corrects_state && self.projection().is_none() {
            program.stage("state", vec![garment.states_from_corrected(buffers)?]);
        }
        Ok(program)
    }

    /// Records the computation of shown positions and normals from the states.
    fn show(&self, program: &mut Program, offsets: OffsetUpdate) -> Result<(), GpuError> {
        let (garment, buffers) = (&self.asset.garment, self.buffers);
        program.stage("positions", vec![garment.write_positions(buffers)?]);
        if let Some(projection) = self.projection() {
            program.stage("projection", self.advance_offsets(projection, offsets)?);
            program.stage("positions", vec![projection.add_offsets(buffers)?]);
        }
        if let (Some(_), Some(handling)) = (self.corrects_shown(), &self.handling) {
            if let Some(projection) = self.projection() {
                program.stage("intersections", projection.measure_uncorrected(buffers)?);
            }
            self.correct(program);
            program.stage("intersections", handling.relax.clone());
        }
        program.stage("normals", vec![garment.mesh.normals(&buffers.shown)?]);
        Ok(())
    }

    /// Makes the dispatches that change the offsets.
    fn advance_offsets(
        &self,
        projection: &Projection,
        update: OffsetUpdate,
    ) -> Result<Vec<Dispatch>, GpuError> {
        let buffers = self.buffers;
        let OffsetUpdate::Advance(tick) = update else {
            return Ok(Vec::new());
        };
        let mut dispatches = projection.advance(buffers, tick)?;
        if tick == ProjectionTick::Start {
            dispatches.push(self.asset.garment.clear_velocities(&buffers.offsets)?);
        }
        Ok(dispatches)
    }

    /// Records the correction of the mode, and the pose of the body before it.
    fn correct(&self, program: &mut Program) {
        if let Some(handling) = &self.handling {
            // The body has one pose in a program.
            if !program.has("body") {
                program.stage("body", handling.pose.clone());
            }
            program.stage("intersections", handling.correct.clone());
        }
    }

    fn projection(&self) -> Option<&Projection> {
        self.asset.projection.as_ref()
    }

    /// Target of the robust rule's corrections; none in other modes.
    fn corrects_shown(&self) -> Option<Corrects> {
        match self.mode {
            IntersectionMode::Robust { corrects, .. } => Some(corrects),
            IntersectionMode::Off | IntersectionMode::Paper { .. } => None,
        }
    }
}
