//! Models, each in memory once.

use godot::{classes::FileAccess, global::Error, prelude::*};
use std::{
    cell::RefCell,
    collections::HashMap,
    sync::{Arc, Weak},
};
use thiserror::Error as ThisError;
use unic_core::{Model, ModelFileError};

/// Error of a model file.
#[derive(Debug, ThisError)]
pub(crate) enum LoadError {
    /// No path.
    #[error("expected a model file, found an empty path")]
    NoPath,
    /// A file that the engine does not open.
    #[error("cannot read {path}: {error:?}")]
    Read {
        /// Path in the engine's form.
        path: String,
        /// Error of the engine.
        error: Error,
    },
    /// Bytes that are no model.
    #[error("{path}: {error}")]
    Model {
        /// Path in the engine's form.
        path: String,
        /// Error of the reader.
        error: ModelFileError,
    },
    /// A share of vertices that the model does not allow.
    #[error("sampling: {0}")]
    Sampling(#[from] unic_core::model::ModelError),
}

/// A model and the checksum that its saved states carry.
#[derive(Debug)]
pub(crate) struct SharedModel {
    pub(crate) model: Arc<Model>,
    /// CRC-32 of the file.
    pub(crate) checksum: u32,
}

thread_local! {
    /// Models that garments wear, by path and sampling.
    static WORN: RefCell<HashMap<(String, u32), Weak<SharedModel>>> = RefCell::default();
}

/// Loads a model, or takes the one that another garment wears. `sampling` is the share of the vertices
/// that the networks see, above 0 and at most 1.
///
/// # Errors
/// Files that cannot be read or are no models; a sampling that the model does not allow.
pub(crate) fn load(path: &GString, sampling: f32) -> Result<Arc<SharedModel>, LoadError> {
    let key = (path.to_string(), sampling.to_bits());
    if let Some(model) = WORN.with_borrow(|worn| worn.get(&key).and_then(Weak::upgrade)) {
        return Ok(model);
    }
    let model = Arc::new(read(&key.0, sampling)?);
    WORN.with_borrow_mut(|worn| {
        worn.retain(|_, model| model.strong_count() > 0);
        worn.insert(key, Arc::downgrade(&model));
    });
    Ok(model)
}

fn read(path: &str, sampling: f32) -> Result<SharedModel, LoadError> {
    if path.is_empty() {
        return Err(LoadError::NoPath);
    }
    let bytes = FileAccess::get_file_as_bytes(path);
    if bytes.is_empty() {
        return Err(LoadError::Read {
            path: path.to_owned(),
            error: FileAccess::get_open_error(),
        });
    }
    let bytes = bytes.as_slice();
    let mut model = Model::from_bytes(bytes).map_err(|error| LoadError::Model {
        path: path.to_owned(),
        error,
    })?;
    if sampling != 1.0 {
        model = model.with_sampling(sampling)?;
    }
    Ok(SharedModel {
        model: Arc::new(model),
        checksum: crc32fast::hash(bytes),
    })
}
