//! Neural garments in Bevy.
//!
//! [`UnicPlugin`] loads models (`.unic`) as assets and moves garments with the characters that wear
//! them. A garment is an entity with a [`UnicGarment`] and a material. It follows the joints of a
//! [`SkinnedMesh`](bevy::mesh::skinning::SkinnedMesh), such as those of a glTF scene.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_unic::{UnicGarment, UnicPlugin};
//!
//! fn dress(mut commands: Commands, assets: Res<AssetServer>, characters: Query<Entity, Added<SceneRootOfHero>>) {
//!     for character in &characters {
//!         let model = assets.load("tshirt.unic");
//!         // Add a MeshMaterial3d, as to any mesh.
//!         commands.spawn(UnicGarment::new(model, character));
//!     }
//! }
//!
//! #[derive(Component)]
//! struct SceneRootOfHero;
//!
//! App::new().add_plugins(UnicPlugin).add_systems(Update, dress);
//! ```
//!
//! # Units, axes, time
//!
//! Model and Bevy have the same axes: right-handed, +Y up, a glTF character faces +Z, metres. A
//! character of another size is dressed in its size; scales that differ by axis are not supported.
//! The garment is stepped at the model's rate, whatever the display's rate is, in
//! [`PostUpdate`](bevy::app::PostUpdate) after the transforms are propagated.
//!
//! # Threads
//!
//! Garments are stepped side by side on Bevy's compute threads, each on one of them. The same
//! motion and frame times give the same bytes for any number of threads.

mod body;
mod garment;
mod mesh;
mod model;
mod rig;
mod step;

pub use body::spawn_character;
pub use garment::{GarmentFault, GarmentState, UnicGarment};
pub use model::{UnicModel, UnicModelError, UnicModelLoader};
pub use unic_core::{self, animator::Display, rig::RigError};

use bevy::{asset::AssetEventSystems, prelude::*, transform::TransformSystems};

/// Loads models and moves garments.
///
/// It needs Bevy's `AssetPlugin`, `TransformPlugin`, `TimePlugin` and `MeshPlugin`, all of which are
/// in `DefaultPlugins`.
#[derive(Clone, Copy, Debug, Default)]
pub struct UnicPlugin;

impl Plugin for UnicPlugin {
    fn build(&self, app: &mut App) {
        app.init_asset::<UnicModel>()
            .init_asset_loader::<UnicModelLoader>()
            .add_systems(
                PostUpdate,
                (garment::attach, step::step, mesh::write)
                    .chain()
                    .in_set(UnicSystems)
                    .after(TransformSystems::Propagate)
                    // Bounds and renderer hear of changed meshes by these events.
                    .before(AssetEventSystems),
            );
    }
}

/// Systems of [`UnicPlugin`], in [`PostUpdate`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, SystemSet)]
pub struct UnicSystems;
