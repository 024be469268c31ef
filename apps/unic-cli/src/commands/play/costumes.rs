//! Costumes of a play, from model files.

use crate::{
    args::{LooksArgs, PlayArgs},
    garments::Shipped,
    model_file,
    motion_source::MotionSource,
};
use anyhow::Result;
use std::{path::Path, sync::Arc};
use unic_core::{
    Model,
    motion_matching::{Database, TagFilter},
};
use unic_viewer::{Costume, Fabric, GpuContext, Material, Outfit, Print, ViewerError};

/// Looks of costumes, in turn.
const CLOTHS: [Material; 4] = [
    Material::SHIRT,
    Material::cloth(Fabric::Twill, [0.56, 0.15, 0.17]).printed(Print::Checks, [0.16, 0.16, 0.24]),
    Material::cloth(Fabric::Linen, [0.78, 0.74, 0.64]),
    Material::cloth(Fabric::Satin, [0.20, 0.36, 0.30]),
];

/// Models with the motion of their characters.
pub(super) struct Wardrobe {
    items: Vec<Item>,
    looks: LooksArgs,
}

struct Item {
    name: String,
    model: Arc<Model>,
    database: Arc<Database>,
    tags: TagFilter,
}

impl Wardrobe {
    /// Reads the models, or takes those that come with the program, and the motion for the
    /// characters of all.
    ///
    /// # Errors
    /// Files that are no models, motion that does not fit.
    pub(super) fn read(args: &PlayArgs) -> Result<Self> {
        let models: Vec<(String, Arc<Model>)> = match args.models.as_slice() {
            [] => Shipped::ALL.into_iter().map(read).collect::<Result<_>>()?,
            paths => paths.iter().map(|path| named(path)).collect::<Result<_>>()?,
        };
        let precise = |model: Arc<Model>| Arc::new(args.precision.apply(Arc::unwrap_or_clone(model)));
        let mut items: Vec<Item> = Vec::new();
        for (name, model) in models {
            let model = precise(model);
            let wears = |item: &&Item| is_same_character(&item.model, &model);
            let (database, tags) = match items.iter().find(wears) {
                Some(item) => (Arc::clone(&item.database), item.tags),
                None => motion(args, &model)?,
            };
            items.push(Item {
                name,
                model,
                database,
                tags,
            });
        }
        Ok(Self {
            items,
            looks: args.looks.clone(),
        })
    }

    /// Prepares the models for the processor, or for a device.
    pub(super) fn costumes(&self, device: Option<&GpuContext>) -> Result<Vec<Costume>, ViewerError> {
        let costume = |(item, cloth): (&Item, Material)| {
            let (model, cloth) = (Arc::clone(&item.model), self.looks.cloth(cloth));
            Ok(Costume {
                outfit: Arc::new(Outfit::new(item.name.clone(), model, cloth, device)?),
                database: Arc::clone(&item.database),
                tags: item.tags,
            })
        };
        let cloths = CLOTHS.into_iter().cycle();
        self.items.iter().zip(cloths).map(costume).collect()
    }
}

/// Reads a model file, or takes the garment of this name that comes with the program.
fn named(path: &Path) -> Result<(String, Arc<Model>)> {
    let is_shipped = |garment: &Shipped| path.as_os_str() == garment.name() && !path.exists();
    if let Some(garment) = Shipped::ALL.into_iter().find(is_shipped) {
        return read(garment);
    }
    let name = path.file_stem().unwrap_or(path.as_os_str());
    Ok((
        name.to_string_lossy().into_owned(),
        Arc::new(model_file::read(path)?),
    ))
}

fn read(garment: Shipped) -> Result<(String, Arc<Model>)> {
    Ok((garment.name().into(), Arc::new(garment.model()?)))
}

fn is_same_character(a: &Model, b: &Model) -> bool {
    let [(a, a_fps), (b, b_fps)] = [a, b].map(|model| (&model.character().skeleton, model.config().fps));
    a == b && a_fps == b_fps
}

/// Motion for the character of a model, at the model's rate.
fn motion(args: &PlayArgs, model: &Model) -> Result<(Arc<Database>, TagFilter)> {
    let source = MotionSource::read(
        model.character().clone(),
        model.config().fps,
        &args.source,
        args.force,
    )?;
    Ok((Arc::clone(&source.database), source.tags()))
}
