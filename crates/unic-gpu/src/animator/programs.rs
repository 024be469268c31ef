//! What the device does in every call of an animator.

use super::Buffers;
use crate::{
    GpuError, GpuModel, body::Handling, garment::is_in_frame, kernel::Dispatch, motion::Tick,
    program::Program,
};
use unic_core::config::{Corrects, IntersectionMode};

/// What the device does in every call.
#[derive(Debug, Default)]
pub(super) struct Programs {
    pub(super) start_at_mean: Program,
    pub(super) start_at_shown: Program,
    pub(super) complete_start: Program,
    pub(super) step: Program,
    pub(super) set: Program,
    /// The frame before a restored one.
    pub(super) carry: Program,
    pub(super) resume_at_start: Program,
    pub(super) resume: Program,
}

impl Programs {
    pub(super) fn new(asset: &GpuModel, of: &Buffers, mode: IntersectionMode) -> Result<Self, GpuError> {
        let recorder = Recorder {
            asset,
            of,
            handling: match mode {
                IntersectionMode::Off => None,
                IntersectionMode::Paper { .. } => Some(asset.body.paper(&asset.context, of, &asset.model)?),
                IntersectionMode::Robust { .. } => {
                    Some(asset.body.robust(&asset.context, of, &asset.model)?)
                }
            },
            mode,
        };
        let garment = &asset.garment;
        let mut complete_start = Program::default();
        if !is_in_frame(&asset.model) {
            complete_start.stage("prior", asset.networks.record_prior(&of.vectors, Tick::First)?);
            complete_start.stage("rehang", vec![garment.rehang(of)?]);
        }
        let mut set = Program::default();
        set.stage("set", vec![garment.take_shown(of)?]);
        recorder.show(&mut set)?;
        let mut carry = Program::default();
        carry.stage("carry", vec![garment.prepare(of)?]);
        Ok(Self {
            carry,
            resume_at_start: recorder.resume(Tick::First)?,
            resume: recorder.resume(Tick::Same)?,
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
    of: &'a Buffers,
    mode: IntersectionMode,
    handling: Option<Handling>,
}

impl Recorder<'_> {
    /// `take` sets the states.
    fn start(&self, take: Dispatch) -> Result<Program, GpuError> {
        let (garment, of) = (&self.asset.garment, self.of);
        let mut program = Program::default();
        program.stage(
            "prior",
            self.asset.networks.record_prior(&of.vectors, Tick::First)?,
        );
        program.stage("start", vec![garment.prepare(of)?, take, garment.hold(of)?]);
        self.show(&mut program)?;
        Ok(program)
    }

    /// The frame of a restored state.
    fn resume(&self, tick: Tick) -> Result<Program, GpuError> {
        let mut program = Program::default();
        program.stage("prior", self.asset.networks.record_prior(&self.of.vectors, tick)?);
        program.stage("carry", vec![self.asset.garment.prepare(self.of)?]);
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
        program.stage("prior", networks.record_prior(&of.vectors, Tick::Next)?);
        program.stage("encoder", networks.record_encoder(&of.vectors)?);
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
        program.stage("normals", vec![garment.mesh.normals(&self.of.shown)?]);
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
