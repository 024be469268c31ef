//! States as bytes, to save games and to go back in time, in the form of
//! [`AnimatorState::save`].

use crate::{
    error::Error,
    instance::{UnicInstance, with},
    memory::{bytes, write},
    mesh::UnicVertices,
    status::UnicStatus,
};
use std::ffi::c_void;
use unic_core::AnimatorState;

/// Saves everything that the next step depends on. Colliders and options are not part of it.
///
/// `size` gets the number of bytes, also with UNIC_STATUS_BUFFER_TOO_SMALL: the only value that a
/// call writes when it fails. With null `bytes` nothing else is written; otherwise `capacity` must be
/// as large. The size may grow by some bytes over many steps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_save(
    instance: *const UnicInstance,
    bytes: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> UnicStatus {
    with(instance, |instance| {
        let state = instance.animator.state();
        state.save(instance.checksum, &mut instance.saved)?;
        let saved = &instance.saved;
        // SAFETY: passed on.
        unsafe { write("size", size, saved.len()) }?;
        if bytes.is_null() {
            return Ok(());
        }
        if capacity < saved.len() {
            return Err(Error::Buffer {
                expected: saved.len(),
                found: capacity,
            });
        }
        // SAFETY: room for at least as many bytes, by the contract of all functions.
        unsafe { saved.as_ptr().copy_to(bytes.cast(), saved.len()) };
        Ok(())
    })
}

/// Restores a saved state of the same model, whose instance may have had other options.
///
/// Later steps give the same bytes as they gave after it. `vertices` gets the garment; null if not
/// wanted. unic_instance_display shows the restored tick until the next step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_restore(
    instance: *const UnicInstance,
    state: *const c_void,
    size: usize,
    vertices: *const UnicVertices,
) -> UnicStatus {
    with(instance, |instance| {
        // SAFETY: passed on.
        let to = unsafe { instance.garment.vertex_rows(vertices) }?;
        // SAFETY: passed on.
        let bytes = unsafe { bytes("state", state.cast(), size) }?;
        let state = AnimatorState::from_saved(bytes, instance.checksum)?;
        instance.animator.restore(state)?;
        instance.display.cut(&instance.animator);
        let shown = instance.animator.garment();
        (instance.garment).write_vertices(&instance.axes, &to, shown.positions, shown.normals);
        Ok(())
    })
}
