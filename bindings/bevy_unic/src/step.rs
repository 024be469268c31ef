//! Stepping garments at the rate of their models.

use crate::garment::{Display, GarmentFault, GarmentState, UnicGarment};
use bevy::prelude::*;
use std::sync::Arc;
use unic_core::{
    Pose, Start, StepInput,
    animator::AnimatorError,
    collider::{Collider, ColliderShape},
};
use unic_glam as core;

/// Most ticks in one frame. A program that stops for seconds would otherwise step through them all.
const MOST_TICKS: u32 = 4;

/// Steps all garments, side by side.
pub(crate) fn step(
    time: Res<Time>,
    commands: ParallelCommands,
    transforms: Query<&GlobalTransform>,
    mut garments: Query<(Entity, Ref<UnicGarment>, &mut GarmentState), Without<GarmentFault>>,
) {
    let frame_s = time.delta_secs_f64();
    garments.par_iter_mut().for_each(|(entity, garment, mut state)| {
        if garment.is_paused {
            state.has_started = false;
            return;
        }
        if let Err(fault) = advance(&mut state, &garment, &transforms, frame_s) {
            // Without the fault, it starts from the pose that is then.
            state.has_started = false;
            error!("garment {entity} on character {}: {fault}", garment.character);
            commands.command_scope(|mut commands| {
                commands.entity(entity).insert(fault);
            });
        }
    });
}

/// Takes the pose of this frame, and as many ticks as time has passed.
fn advance(
    state: &mut GarmentState,
    garment: &Ref<UnicGarment>,
    transforms: &Query<&GlobalTransform>,
    frame_s: f64,
) -> Result<(), GarmentFault> {
    std::mem::swap(&mut state.before, &mut state.now);
    let model = Arc::clone(state.animator.model());
    let skeleton = &model.character().skeleton;
    let Some(size) = state.rig.pose(skeleton, transforms, &mut state.now)? else {
        // The character is gone or has no transforms yet: the next one starts anew.
        state.has_started = false;
        return Ok(());
    };
    // A garment that has not started may have changed while nothing was stepped.
    if garment.is_changed() || state.shown.size != size || !state.has_started {
        let colliders = garment.colliders.iter().map(|collider| of_size(collider, size));
        state.animator.set_colliders(colliders);
    }
    state.shown.size = size;
    let moved = state.now.trans.distance(state.before.trans) * size;
    if !state.has_started || moved > garment.teleport_m {
        restart(state, garment)?;
    } else {
        tick(state, garment, frame_s)?;
    }
    Ok(show(state, garment)?)
}

fn restart(state: &mut GarmentState, garment: &UnicGarment) -> Result<(), AnimatorError> {
    let input = input(&state.now, garment, state.shown.size);
    state.animator.reset(&input, Start::MeanShape)?;
    state.interpolator.cut(&state.animator);
    state.has_started = true;
    state.clock.restart();
    Ok(())
}

fn tick(state: &mut GarmentState, garment: &UnicGarment, frame_s: f64) -> Result<(), AnimatorError> {
    state.clock.advance(frame_s, MOST_TICKS);
    while let Some(moment) = state.clock.take() {
        // Poses of ticks within a frame lie between those of two frames.
        let between = (moment < 1.0).then(|| state.before.interpolate(&state.now, moment));
        let pose = between.as_ref().unwrap_or(&state.now);
        state.animator.step(&input(pose, garment, state.shown.size))?;
        state.interpolator.tick(&state.animator);
    }
    Ok(())
}

/// Keeps the vertices of this frame for the mesh.
fn show(state: &mut GarmentState, garment: &UnicGarment) -> Result<(), AnimatorError> {
    let frame = match garment.display {
        Display::Ticks => state.animator.garment(),
        Display::Interpolated => {
            let share = state.clock.share();
            state.interpolator.show(&state.animator, &state.now, share)?
        }
    };
    state.shown.positions.clear();
    state.shown.positions.extend_from_slice(frame.positions);
    state.shown.normals.clear();
    state.shown.normals.extend_from_slice(frame.normals);
    state.shown.is_new = true;
    Ok(())
}

fn input<'a>(pose: &'a Pose, garment: &UnicGarment, size: f32) -> StepInput<'a> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: garment.ground_height / size,
        wind: core::Vec3::from_array((garment.wind / size).to_array()),
    }
}

/// A collider of the world, as a model sees it whose character has another size.
fn of_size(collider: &Collider, size: f32) -> Collider {
    let mut own = collider.clone();
    own.world_from_collider.translation /= size;
    match &mut own.shape {
        ColliderShape::HalfSpace | ColliderShape::Mesh(_) => (),
        ColliderShape::Sphere { radius_m } => *radius_m /= size,
        ColliderShape::Capsule {
            radius_m,
            half_length_m,
        } => {
            *radius_m /= size;
            *half_length_m /= size;
        }
    }
    own
}
