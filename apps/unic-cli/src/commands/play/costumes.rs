//! Costumes of a play, from model files.

use crate::{model_file, motion_source::MotionSource};
use anyhow::{Result, bail};
use std::{path::PathBuf, sync::Arc};
use unic_core::{
    Model,
    motion_matching::{Database, TagFilter},
};
use unic_viewer::{Costume, Fabric, GpuContext, Material, Outfit, Print, ViewerError};

/// Looks of costumes, in turn.
const CLOTHS: [Material; 4] = [
    Material::cloth(Fabric::Jersey, [0.16, 0.25, 0.45]).printed(Print::Stripes, [0.92, 0.89, 0.82]),
    Material::cloth(Fabric::Twill, [0.56, 0.15, 0.17]).printed(Print::Checks, [0.16, 0.16, 0.24]),
    Material::cloth(Fabric::Linen, [0.78, 0.74, 0.64]),
    Material::cloth(Fabric::Satin, [0.20, 0.36, 0.30]),
];

/// Models with the motion of their character.
pub(super) struct Wardrobe {
    models: Vec<(String, Arc<Model>)>,
    database: Arc<Database>,
    tags: TagFilter,
}

impl Wardrobe {
    /// Reads the models.
    ///
    /// # Errors
    /// A file that is no model, a model of another character or rate than the motion's.
    pub(super) fn read(paths: &[PathBuf], source: &MotionSource) -> Result<Self> {
        let read = |path: &PathBuf| {
            let model = model_file::read(path)?;
            let (expected, found) = (source.database.fps(), model.config().fps);
            if expected != found {
                bail!(
                    "{}: expected a model at {expected} frames a second, as the motion, found {found}",
                    path.display()
                );
            }
            let name = path.file_stem().unwrap_or(path.as_os_str());
            Ok((name.to_string_lossy().into_owned(), Arc::new(model)))
        };
        Ok(Self {
            models: paths.iter().map(read).collect::<Result<_>>()?,
            database: Arc::clone(&source.database),
            tags: source.tags(),
        })
    }

    /// Prepares the models for the processor, or for a device.
    pub(super) fn costumes(self, device: Option<&GpuContext>) -> Result<Vec<Costume>, ViewerError> {
        let cloths = CLOTHS.into_iter().cycle();
        let costume = |((name, model), cloth)| {
            Ok(Costume {
                outfit: Arc::new(Outfit::new(name, model, cloth, device)?),
                database: Arc::clone(&self.database),
                tags: self.tags,
            })
        };
        self.models.into_iter().zip(cloths).map(costume).collect()
    }
}
