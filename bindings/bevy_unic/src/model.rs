//! Models as assets.

use bevy::{
    asset::{AssetLoader, LoadContext, io::Reader},
    prelude::*,
};
use std::sync::Arc;
use thiserror::Error;
use unic_core::{Model, model_file::ModelFileError};

/// A trained garment: an immutable model that all of its garments share.
#[derive(Asset, Clone, Debug, TypePath)]
pub struct UnicModel(pub Arc<Model>);

/// Loader of `.unic` files.
#[derive(Clone, Copy, Debug, Default, TypePath)]
pub struct UnicModelLoader;

/// Error of a model file.
#[derive(Debug, Error)]
pub enum UnicModelError {
    /// A file that cannot be read.
    #[error("cannot read: {0}")]
    Read(#[from] std::io::Error),
    /// Bytes that are no model.
    #[error(transparent)]
    Model(#[from] ModelFileError),
}

impl AssetLoader for UnicModelLoader {
    type Asset = UnicModel;
    type Settings = ();
    type Error = UnicModelError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        _settings: &(),
        _context: &mut LoadContext<'_>,
    ) -> Result<UnicModel, UnicModelError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        Ok(UnicModel(Arc::new(Model::from_bytes(&bytes)?)))
    }

    fn extensions(&self) -> &[&str] {
        &["unic"]
    }
}
