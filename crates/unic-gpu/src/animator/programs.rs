//! Programs of an animator: the work of the device in each of its calls.

use super::Buffers;
use crate::{
    GpuError, GpuModel, body::Handling, garment::is_in_frame, kernel::Dispatch, motion::Tick,
    program::Program,
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
                IntersectionMode::Robust { .. } => Some(body.robust(context, buffers, model)?),
            },
            mode,
        };
        let garment = &asset.garment;
        let mut complete_start = Program::default();
        if !is_in_frame(&asset.model) {
            let prior = asset.networks.record_prior(&buffers.vectors, Tick::First)?;
            complete_start.stage("prior", prior);
            complete_start.stage("rebase states", vec![garment.rebase_states(buffers)?]);
        }
        let mut set = Program::default();
        set.stage("set", vec![garment.states_from_shown(buffers)?]);
        recorder.show(&mut set)?;
        let mut skin_previous = Program::default();
        skin_previous.stage("skinning", vec![garment.prepare(buffers)?]);
        Ok(Self {
            skin_previous,
            resume_at_start: recorder.resume(Tick::First)?,
            resume: recorder.resume(Tick::Same)?,
            start_at_mean: recorder.start(garment.start_at_mean(buffers)?)?,
            start_at_shown: recorder.start(garment.states_from_shown(buffers)?)?,
            complete_start,
            step: recorder.step()?,
            set,
        })
    }
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
    fn start(&self, set_states: Dispatch) -> Result<Program, GpuError> {
        let (garment, buffers) = (&self.asset.garment, self.buffers);
        let mut program = Program::default();
        let prior = self.asset.networks.record_prior(&buffers.vectors, Tick::First)?;
        program.stage("prior", prior);
        let (prepare, clear) = (garment.prepare(buffers)?, garment.clear_velocities(buffers)?);
        program.stage("start", vec![prepare, set_states, clear]);
        self.show(&mut program)?;
        Ok(program)
    }

    /// Records the frame of a restored state.
    fn resume(&self, tick: Tick) -> Result<Program, GpuError> {
        let (garment, buffers) = (&self.asset.garment, self.buffers);
        let mut program = Program::default();
        let prior = self.asset.networks.record_prior(&buffers.vectors, tick)?;
        program.stage("prior", prior);
        program.stage("skinning", vec![garment.prepare(buffers)?]);
        self.show(&mut program)?;
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
        program.stage("prior", networks.record_prior(&buffers.vectors, Tick::Next)?);
        program.stage("encoder", networks.record_encoder(&buffers.vectors)?);
        program.stage("skinning", vec![garment.prepare(buffers)?]);
        program.stage("field", vec![field.dispatch(buffers)?]);
        // The paper's rule corrects states, so it precedes the positions.
        if let (IntersectionMode::Paper { .. }, Some(handling)) = (self.mode, &self.handling) {
            program.stage("body", handling.pose.clone());
            program.stage("intersections", vec![handling.correct.clone()]);
        }
        self.show(&mut program)?;
        if self.corrects_shown() == Some(Corrects::State) {
            program.stage("state", vec![garment.states_from_corrected(buffers)?]);
        }
        Ok(program)
    }

    /// Records the computation of shown positions and normals from the states.
    fn show(&self, program: &mut Program) -> Result<(), GpuError> {
        let garment = &self.asset.garment;
        program.stage("positions", vec![garment.write_positions(self.buffers)?]);
        if let (Some(_), Some(handling)) = (self.corrects_shown(), &self.handling) {
            program.stage("body", handling.pose.clone());
            program.stage("intersections", vec![handling.correct.clone()]);
        }
        program.stage("normals", vec![garment.mesh.normals(&self.buffers.shown)?]);
        Ok(())
    }

    /// Target of the robust rule's corrections; none in other modes.
    fn corrects_shown(&self) -> Option<Corrects> {
        match self.mode {
            IntersectionMode::Robust { corrects, .. } => Some(corrects),
            IntersectionMode::Off | IntersectionMode::Paper { .. } => None,
        }
    }
}
