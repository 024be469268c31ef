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
    mut garments: Query<(Entity, &UnicGarment, &mut GarmentState), Without<GarmentFault>>,
) {
    let frame_s = time.delta_secs();
    garments.par_iter_mut().for_each(|(entity, garment, mut state)| {
        if garment.is_paused {
            state.clock.has_started = false;
            return;
        }
        if let Err(fault) = advance(&mut state, garment, &transforms, frame_s) {
            // Without the fault, it starts from the pose that is then.
            state.clock.has_started = false;
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
    garment: &UnicGarment,
    transforms: &Query<&GlobalTransform>,
    frame_s: f32,
) -> Result<(), GarmentFault> {
    std::mem::swap(&mut state.before, &mut state.now);
    let model = Arc::clone(state.animator.model());
    let skeleton = &model.character().skeleton;
    let Some(size) = state.rig.pose(skeleton, transforms, &mut state.now)? else {
        // The character is gone or has no transforms yet: the next one starts anew.
        state.clock.has_started = false;
        return Ok(());
    };
    state.shown.size = size;
    let colliders = garment.colliders.iter().map(|collider| of_size(collider, size));
    state.animator.set_colliders(colliders);
    let moved = state.now.trans.distance(state.before.trans) * size;
    if !state.clock.has_started || moved > garment.teleport_m {
        restart(state, garment)?;
    } else {
        tick(state, garment, frame_s, 1.0 / model.config().fps)?;
    }
    Ok(show(state, garment, 1.0 / model.config().fps)?)
}

fn restart(state: &mut GarmentState, garment: &UnicGarment) -> Result<(), AnimatorError> {
    let input = input(&state.now, garment, state.shown.size);
    state.animator.reset(&input, Start::MeanShape)?;
    state.interpolator.cut(&state.animator);
    state.clock.has_started = true;
    state.clock.unspent_s = 0.0;
    Ok(())
}

fn tick(
    state: &mut GarmentState,
    garment: &UnicGarment,
    frame_s: f32,
    tick_s: f32,
) -> Result<(), AnimatorError> {
    let mut unspent_s = state.clock.unspent_s + frame_s;
    // Half a percent early: frame times are rounded to nanoseconds.
    let ticks = ((unspent_s / tick_s + 0.005).floor() as u32).min(MOST_TICKS);
    for _ in 0..ticks {
        unspent_s -= tick_s;
        // Poses of ticks within a frame lie between those of two frames.
        let share = match frame_s > 0.0 {
            true => (1.0 - unspent_s / frame_s).clamp(0.0, 1.0),
            false => 1.0,
        };
        let pose = match share > 0.99 {
            true => state.now.clone(),
            false => state.before.interpolate(&state.now, share),
        };
        state.animator.step(&input(&pose, garment, state.shown.size))?;
        state.interpolator.tick(&state.animator);
    }
    // Time beyond the most ticks is lost: the cloth is slow rather than the program.
    state.clock.unspent_s = unspent_s.clamp(0.0, tick_s);
    Ok(())
}

/// Keeps the vertices of this frame for the mesh.
fn show(state: &mut GarmentState, garment: &UnicGarment, tick_s: f32) -> Result<(), AnimatorError> {
    let frame = match garment.display {
        Display::Ticks => state.animator.garment(),
        Display::Interpolated => {
            let share = state.clock.unspent_s / tick_s;
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
