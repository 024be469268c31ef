//! Stepping garments at the rate of their models.

use crate::garment::{GarmentFault, GarmentState, UnicGarment};
use bevy::prelude::*;
use std::sync::Arc;
use unic_core::{
    AnimatorError, Surroundings,
    animator::TeleportLimit,
    collider::{Collider, ColliderShape},
};
use unic_glam as core;

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
            leave_out(&mut state);
            return;
        }
        if let Err(fault) = advance(&mut state, &garment, &transforms, frame_s) {
            // Without the fault, it starts from the pose that is then.
            leave_out(&mut state);
            error!("garment {entity} on character {}: {fault}", garment.character);
            commands.command_scope(|mut commands| {
                commands.entity(entity).insert(fault);
            });
        }
    });
}

/// Leaves out a frame.
fn leave_out(state: &mut GarmentState) {
    state.live.interrupt();
    // Colliders that change meanwhile are taken when the character has a size again.
    state.shown.size = 0.0;
}

/// Takes the pose of this frame, and as many ticks as time has passed.
fn advance(
    state: &mut GarmentState,
    garment: &Ref<UnicGarment>,
    transforms: &Query<&GlobalTransform>,
    frame_s: f64,
) -> Result<(), GarmentFault> {
    let model = Arc::clone(state.live.model());
    let skeleton = &model.character().skeleton;
    let Some(size) = state.rig.pose(skeleton, transforms, &mut state.pose)? else {
        // The character is gone or has no transforms yet.
        leave_out(state);
        return Ok(());
    };
    if garment.is_changed() || state.shown.size != size {
        let colliders = garment.colliders.iter().map(|collider| of_size(collider, size));
        state.live.set_colliders(colliders);
    }
    state.shown.size = size;
    let around = Surroundings {
        size,
        wind: core::Vec3::from_array(garment.wind.to_array()),
        ground_height: garment.ground_height,
        teleports: TeleportLimit::with_speed(garment.teleport_speed),
    };
    state.live.advance(frame_s, &state.pose, &around)?;
    Ok(show(state, garment)?)
}

/// Keeps the vertices of this frame for the mesh.
fn show(state: &mut GarmentState, garment: &UnicGarment) -> Result<(), AnimatorError> {
    let frame = state.live.show(garment.display)?;
    state.shown.positions.clear();
    state.shown.positions.extend_from_slice(frame.positions);
    state.shown.normals.clear();
    state.shown.normals.extend_from_slice(frame.normals);
    state.shown.is_new = true;
    Ok(())
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
