//! Models: garments of characters, read once and shared.

use crate::{
    error::{Error, c_string, guard},
    memory::{self, Growing, Plain, Rows, answer_sized, check_count, check_pointer, write},
    registry::Registry,
    status::UnicStatus,
};
use std::{
    ffi::{CStr, CString, c_char, c_void},
    mem::{offset_of, size_of},
    sync::{Arc, Mutex, PoisonError},
};
use unic_core::{Model, Precision};

/// A trained garment of a character. It does not change, and all threads may use it.
///
/// A handle, not a pointer: it is never dereferenced.
pub struct UnicModel {
    _private: [u8; 0],
}

/// Sizes and constants of a model.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct UnicModelInfo {
    /// Size of the struct in bytes, set by the caller.
    pub size: u32,
    /// Number of joints of the character.
    pub joint_count: u32,
    /// Index of the root joint.
    pub root_joint: u32,
    /// Number of vertices of the garment, without the copies of UNIC_VERTEX_LAYOUT_SPLIT.
    pub vertex_count: u32,
    /// Number of triangles of the garment.
    pub face_count: u32,
    /// Number of vertices of the body, without copies.
    pub body_vertex_count: u32,
    /// Number of triangles of the body.
    pub body_face_count: u32,
    /// Steps a second.
    pub fps: f32,
}

// SAFETY: eight numbers of 4 bytes.
unsafe impl Plain for UnicModelInfo {}
const _: () = assert!(size_of::<UnicModelInfo>() == 8 * 4, "padding");

impl Growing for UnicModelInfo {
    const FIRST_SIZE: usize = offset_of!(Self, fps) + size_of::<f32>();
}

pub(crate) static MODELS: Registry<SharedModel> = Registry::new("model");

/// Model with what C needs of it.
pub(crate) struct SharedModel {
    pub(crate) model: Arc<Model>,
    /// Checksum of the file, which marks saved states.
    pub(crate) checksum: u32,
    joint_names: Vec<CString>,
    variants: Mutex<Vec<Variant>>,
}

/// Model packed for another precision or sampling.
struct Variant {
    precision: Precision,
    sampling: Option<f32>,
    model: Arc<Model>,
}

/// Variants that are kept without an instance: as many as an engine has levels of detail.
const MOST_VARIANTS: usize = 8;

impl SharedModel {
    fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let model = Model::from_bytes(bytes)?;
        let names = model.character().skeleton.names();
        Ok(Self {
            joint_names: names.iter().map(|name| c_string(name)).collect(),
            checksum: crc32fast::hash(bytes),
            model: Arc::new(model),
            variants: Mutex::default(),
        })
    }

    /// Finds or makes the model of a precision and a share of samples; none is that of the file.
    /// Instances share it.
    pub(crate) fn variant(&self, precision: Precision, sampling: Option<f32>) -> Result<Arc<Model>, Error> {
        if precision == self.model.precision() && sampling.is_none() {
            return Ok(Arc::clone(&self.model));
        }
        let mut variants = self.variants.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |v: &&Variant| v.precision == precision && v.sampling == sampling;
        if let Some(found) = variants.iter().find(same) {
            return Ok(Arc::clone(&found.model));
        }
        let packed = Model::clone(&self.model).with_precision(precision);
        let made = match sampling {
            None => packed,
            Some(share) => packed.with_sampling(share)?,
        };
        let model = Arc::new(made);
        if variants.len() >= MOST_VARIANTS {
            variants.retain(|v| Arc::strong_count(&v.model) > 1);
        }
        variants.push(Variant {
            precision,
            sampling,
            model: Arc::clone(&model),
        });
        Ok(model)
    }
}

/// Reads a model from the bytes of its file, which may be freed afterwards.
///
/// `model` gets the handle, which unic_model_release ends.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_model_from_bytes(
    bytes: *const c_void,
    length: usize,
    model: *mut *mut UnicModel,
) -> UnicStatus {
    guard(|| {
        check_pointer("model", model)?;
        // SAFETY: passed on.
        let bytes = unsafe { memory::bytes("bytes", bytes.cast(), length) }?;
        let shared = SharedModel::from_bytes(bytes)?;
        // SAFETY: checked above.
        unsafe { write("model", model, MODELS.insert(Arc::new(shared))) }
    })
}

/// Reads a model from a file. `path` is in UTF-8.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_model_from_path(path: *const c_char, model: *mut *mut UnicModel) -> UnicStatus {
    guard(|| {
        check_pointer("model", model)?;
        // SAFETY: passed on.
        let path = unsafe { text("path", path) }?;
        let bytes = read_file(path).map_err(|source| Error::Read {
            path: path.to_owned(),
            source,
        })?;
        let shared = SharedModel::from_bytes(&bytes)?;
        // SAFETY: checked above.
        unsafe { write("model", model, MODELS.insert(Arc::new(shared))) }
    })
}

/// Adds an owner to a model, who calls unic_model_release too.
#[unsafe(no_mangle)]
pub extern "C" fn unic_model_retain(model: *const UnicModel) -> UnicStatus {
    guard(|| MODELS.retain(model))
}

/// Ends the use of a model by one owner. Its instances live on.
#[unsafe(no_mangle)]
pub extern "C" fn unic_model_release(model: *const UnicModel) -> UnicStatus {
    guard(|| MODELS.release(model))
}

/// Writes the sizes of a model. The caller sets `info->size` first.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_model_info(model: *const UnicModel, info: *mut UnicModelInfo) -> UnicStatus {
    guard(|| {
        let shared = MODELS.get(model)?;
        let (character, rest) = (shared.model.character(), &shared.model.garment().rest);
        let value = UnicModelInfo {
            size: 0, // That of the caller stays.
            joint_count: character.skeleton.len() as u32,
            root_joint: character.skeleton.root() as u32,
            vertex_count: rest.vertices.len() as u32,
            face_count: rest.faces.len() as u32,
            body_vertex_count: character.body.vertices.len() as u32,
            body_face_count: character.body.faces.len() as u32,
            fps: shared.model.config().fps,
        };
        // SAFETY: passed on.
        unsafe { answer_sized("info", info, value) }
    })
}

/// Writes the name of a joint. The text lives as long as the model's handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_model_joint_name(
    model: *const UnicModel,
    joint: u32,
    name: *mut *const c_char,
) -> UnicStatus {
    guard(|| {
        let shared = MODELS.get(model)?;
        let found = shared.joint_names.get(joint as usize);
        let found =
            found.ok_or_else(|| Error::value("joint", "an index below the number of joints", joint))?;
        // SAFETY: passed on.
        unsafe { write("name", name, found.as_ptr()) }
    })
}

/// Writes the parent of each joint, -1 for the root. `count` is the number of joints.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn unic_model_joint_parents(
    model: *const UnicModel,
    parents: *mut i32,
    count: usize,
) -> UnicStatus {
    guard(|| {
        let shared = MODELS.get(model)?;
        let skeleton = &shared.model.character().skeleton;
        check_count("number of parents", skeleton.len(), count)?;
        // SAFETY: passed on.
        let rows = unsafe { Rows::<1>::new("parents", parents.cast(), 0, count) }?;
        for (joint, parent) in skeleton.parents().iter().enumerate() {
            rows.set(joint, [parent.map_or(-1, |p| p as i32)]);
        }
        Ok(())
    })
}

/// Reads a whole file. A device or a pipe may have no end, and is refused.
fn read_file(path: &str) -> std::io::Result<Vec<u8>> {
    match std::fs::metadata(path)?.is_file() {
        true => std::fs::read(path),
        false => Err(std::io::Error::other("expected a file, found something else")),
    }
}

/// Reads a text of the caller.
///
/// # Safety
/// `pointer` is null or points to a text that ends with a zero byte and outlives the result.
unsafe fn text<'a>(what: &'static str, pointer: *const c_char) -> Result<&'a str, Error> {
    if pointer.is_null() {
        return Err(Error::Null { what });
    }
    // SAFETY: by this function's contract.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|e| Error::value(what, "UTF-8", e))
}
