//! Calls of every tick and of every displayed frame.

use crate::{
    error::Error,
    instance::{Instance, UnicInstance, with},
    memory::{Rows, check_count},
    mesh::UnicVertices,
    pose::{UnicPose, UnicStepInput},
    status::UnicStatus,
};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Start, mesh::vertex_normals};

/// Begins a sequence: at its first frame, or at the frame after a cut or a teleport.
///
/// The garment starts at rest in the mean shape of training. `vertices` gets it; null if not wanted.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_reset(
    instance: *const UnicInstance,
    input: *const UnicStepInput,
    vertices: *const UnicVertices,
) -> UnicStatus {
    // SAFETY: passed on.
    with(instance, |instance| unsafe {
        reset(instance, input, FirstShape::Mean, vertices)
    })
}

/// Begins a sequence with given positions, of a simulation or a cache.
///
/// `positions` are three floats for each of `count` vertices of the model, without the copies of
/// UNIC_VERTEX_LAYOUT_SPLIT, `stride` bytes apart (0 for 12).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_reset_to(
    instance: *const UnicInstance,
    input: *const UnicStepInput,
    positions: *const f32,
    stride: usize,
    count: usize,
    vertices: *const UnicVertices,
) -> UnicStatus {
    with(instance, |instance| {
        let expected = instance.animator.model().vertex_count();
        check_count("number of start positions", expected, count)?;
        // SAFETY: passed on.
        let rows = unsafe { Rows::<3>::new("positions", positions.cast(), stride, count) }?;
        let axes = instance.axes;
        let read = (0..count).map(|row| axes.point_in(rows.get(row)));
        instance.start_positions.clear();
        instance.start_positions.extend(read);
        // SAFETY: passed on.
        unsafe { reset(instance, input, FirstShape::Given, vertices) }
    })
}

/// Shape that a reset starts from.
enum FirstShape {
    Mean,
    /// The instance's `start_positions`.
    Given,
}

unsafe fn reset(
    instance: &mut Instance,
    input: *const UnicStepInput,
    shape: FirstShape,
    vertices: *const UnicVertices,
) -> Result<(), Error> {
    // SAFETY: passed on.
    let to = unsafe { instance.garment.vertex_rows(vertices) }?;
    let model = Arc::clone(instance.animator.model());
    // SAFETY: passed on.
    let input = unsafe { instance.poses.step_input(&model, input) }?;
    let start = match shape {
        FirstShape::Mean => Start::MeanShape,
        FirstShape::Given => Start::Positions(&instance.start_positions),
    };
    instance.animator.reset(&input, start)?;
    instance.display.cut(&instance.animator);
    let shown = instance.animator.garment();
    (instance.garment).write_vertices(&instance.axes, &to, shown.positions, shown.normals);
    Ok(())
}

/// Advances the garment by one tick, 1 / fps seconds of the model, to a new pose.
///
/// `vertices` gets the garment; null if not wanted. After the first few steps, a step allocates
/// nothing. It gives the same bytes on any threads.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_step(
    instance: *const UnicInstance,
    input: *const UnicStepInput,
    vertices: *const UnicVertices,
) -> UnicStatus {
    with(instance, |instance| {
        // Before the step, so that a call with wrong buffers changes nothing.
        // SAFETY: passed on.
        let to = unsafe { instance.garment.vertex_rows(vertices) }?;
        let model = Arc::clone(instance.animator.model());
        // SAFETY: passed on.
        let input = unsafe { instance.poses.step_input(&model, input) }?;
        instance.animator.step(&input)?;
        instance.display.tick(&instance.animator);
        let shown = instance.animator.garment();
        (instance.garment).write_vertices(&instance.axes, &to, shown.positions, shown.normals);
        Ok(())
    })
}

/// Writes the garment between the last two ticks, on the displayed pose, for displays of any rate.
///
/// `share` is the way from the tick before the last one (0) to the last one (1); numbers outside
/// that range are clamped. Changes nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_display(
    instance: *const UnicInstance,
    pose: *const UnicPose,
    share: f32,
    vertices: *const UnicVertices,
) -> UnicStatus {
    with(instance, |instance| {
        if share.is_nan() {
            return Err(Error::value("share", "a number", share));
        }
        // SAFETY: passed on.
        let to = unsafe { instance.garment.vertex_rows(vertices) }?;
        let model = Arc::clone(instance.animator.model());
        // SAFETY: passed on.
        let pose = unsafe { instance.poses.pose(&model, pose) }?;
        let shown = instance.display.show(&instance.animator, pose, share)?;
        (instance.garment).write_vertices(&instance.axes, &to, shown.positions, shown.normals);
        Ok(())
    })
}

/// Writes the body in the pose of the last step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_body(
    instance: *const UnicInstance,
    vertices: *const UnicVertices,
) -> UnicStatus {
    with(instance, |instance| {
        // SAFETY: passed on.
        let to = unsafe { instance.body.vertex_rows(vertices) }?;
        let positions: &mut Vec<Vec3> = &mut instance.body_positions;
        instance.animator.body(positions);
        let faces = &instance.animator.model().character().body.faces;
        vertex_normals(positions, faces, &mut instance.body_normals);
        (instance.body).write_vertices(&instance.axes, &to, positions, &instance.body_normals);
        Ok(())
    })
}
