//! States as bytes, to save games and to go back in time.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `unicstat` |
//! | 4 | version of this form, little-endian as all numbers |
//! | 4 | CRC-32 of the model's file |
//! | 4 | CRC-32 of what follows |
//! | rest | [`AnimatorState`] in the form of postcard |

use crate::{
    error::Error,
    instance::{Instance, UnicInstance, with},
    memory::{bytes, write},
    mesh::UnicVertices,
    status::UnicStatus,
};
use std::ffi::c_void;
use unic_core::AnimatorState;

const MAGIC: [u8; 8] = *b"unicstat";
const VERSION: u32 = 1;
const HEADER: usize = 20;

/// Saves everything that the next step depends on. Colliders and options are not part of it.
///
/// `size` gets the number of bytes. With null `bytes` nothing else is written; otherwise `capacity`
/// must be as large. The size may grow by some bytes over many steps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_instance_save(
    instance: *const UnicInstance,
    bytes: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> UnicStatus {
    with(instance, |instance| {
        instance.save()?;
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
        let state = decode(bytes, instance.checksum)?;
        instance.animator.restore(state)?;
        instance.display.cut(&instance.animator);
        let shown = instance.animator.garment();
        (instance.garment).write_vertices(&instance.axes, &to, shown.positions, shown.normals);
        Ok(())
    })
}

impl Instance {
    /// Writes the state to `saved`.
    fn save(&mut self) -> Result<(), Error> {
        let mut saved = std::mem::take(&mut self.saved);
        saved.clear();
        saved.extend_from_slice(&MAGIC);
        for number in [VERSION, self.checksum, 0] {
            saved.extend_from_slice(&number.to_le_bytes());
        }
        let mut saved = postcard::to_extend(self.animator.state(), saved).map_err(|e| Error::State {
            expected: "one that can be written".to_owned(),
            found: e.to_string(),
        })?;
        let (header, content) = saved.split_at_mut(HEADER);
        header[16..].copy_from_slice(&crc32fast::hash(content).to_le_bytes());
        self.saved = saved;
        Ok(())
    }
}

/// Reads the bytes of a state.
fn decode(bytes: &[u8], model: u32) -> Result<AnimatorState, Error> {
    let error = |expected: &str, found: String| {
        let expected = expected.to_owned();
        Err(Error::State { expected, found })
    };
    let Some((header, content)) = bytes.split_at_checked(HEADER) else {
        return error("at least 20 bytes", bytes.len().to_string());
    };
    let number = |at: usize| {
        let bytes = header.get(at..at + 4).and_then(|b| b.try_into().ok());
        u32::from_le_bytes(bytes.unwrap_or_default())
    };
    if !header.starts_with(&MAGIC) {
        return error("bytes that begin with `unicstat`", "others".to_owned());
    }
    if number(8) != VERSION {
        return error("version 1", number(8).to_string());
    }
    if number(12) != model {
        return error("a state of this model", "one of another".to_owned());
    }
    if number(16) != crc32fast::hash(content) {
        return error("undamaged bytes", "another checksum".to_owned());
    }
    match postcard::take_from_bytes(content) {
        Ok((state, [])) => Ok(state),
        Ok((_, rest)) => error("no bytes after the state", rest.len().to_string()),
        Err(e) => error("a complete state", e.to_string()),
    }
}
