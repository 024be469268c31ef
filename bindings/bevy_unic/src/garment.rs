//! Garments and what they consist of.

use crate::{
    mesh::Surface,
    model::UnicModel,
    rig::{Rig, SkinJoint},
};
use bevy::{
    mesh::skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    prelude::*,
};
use std::sync::Arc;
use thiserror::Error;
use unic_core::{
    Animator, AnimatorState, IntersectionMode, Layers, LiveGarment, Model, Pose,
    animator::{AnimatorError, Display, TeleportLimit},
    collider::Collider,
    parallel::Serial,
    rig::RigError,
};
use unic_glam as core;

/// A garment that follows a character.
///
/// The plug-in adds a mesh and moves it. The entity needs a material, and stands at the origin of
/// the world, without a parent: its vertices are where the cloth is.
#[derive(Clone, Component, Debug)]
#[require(Transform)]
pub struct UnicGarment {
    /// The trained garment. Model and character are read once, when both are loaded.
    pub model: Handle<UnicModel>,
    /// Entity of the character: its skinned mesh, or one above it, such as the root of a scene.
    pub character: Entity,
    /// Pictures between two ticks of the model.
    pub display: Display,
    /// Velocity of the air, m/s.
    pub wind: Vec3,
    /// Height of the ground, metres.
    pub ground_height: f32,
    /// Spheres, capsules, half-spaces and meshes that the cloth does not enter, in metres, world
    /// space. They act on models with robust intersection handling. Meshes keep their size for a
    /// character of another size than the model's.
    pub colliders: Vec<Collider>,
    /// Keeps the garment as it is, such as far from the camera. It starts anew afterwards, or
    /// continues a state that has been restored meanwhile.
    pub is_paused: bool,
    /// Speed of the root above which a movement of more than half a metre within a frame is a
    /// teleport, m/s; 0 for none. The garment is carried along in its shape, at rest.
    pub teleport_speed: f32,
}

impl UnicGarment {
    /// Makes a garment in still air, on ground at height 0.
    pub fn new(model: Handle<UnicModel>, character: Entity) -> Self {
        Self {
            model,
            character,
            display: Display::default(),
            wind: Vec3::ZERO,
            ground_height: 0.0,
            colliders: Vec::new(),
            is_paused: false,
            teleport_speed: TeleportLimit::default().speed_m_s,
        }
    }
}

/// Reason why a garment does not move. The plug-in adds it, and logs it once. Removing it lets the
/// plug-in try again.
#[derive(Clone, Component, Debug, Error)]
pub enum GarmentFault {
    /// The character does not fit the model.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A skinned mesh without bind poses for its joints.
    #[error("expected {expected} inverse bind poses, found {found}")]
    BindPoses {
        /// Number of joints.
        expected: usize,
        /// Number of bind poses.
        found: usize,
    },
    /// A pose that the model refuses.
    #[error(transparent)]
    Pose(#[from] Arc<AnimatorError>),
}

impl From<AnimatorError> for GarmentFault {
    fn from(error: AnimatorError) -> Self {
        Self::Pose(Arc::new(error))
    }
}

/// State of a garment in motion. The plug-in adds it when model and character are there.
#[derive(Component, Debug)]
pub struct GarmentState {
    pub(crate) rig: Rig,
    pub(crate) live: LiveGarment,
    pub(crate) surface: Surface,
    /// Pose of this frame.
    pub(crate) pose: Pose,
    /// Vertices to be shown.
    pub(crate) shown: Shown,
}

/// Vertices of this frame, before they are in the mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shown {
    pub(crate) is_new: bool,
    /// Size of the character in the world.
    pub(crate) size: f32,
    pub(crate) positions: Vec<core::Vec3>,
    pub(crate) normals: Vec<core::Vec3>,
}

impl GarmentState {
    fn new(model: &Arc<Model>, rig: Rig) -> Self {
        let mut live = LiveGarment::new(Arc::clone(model));
        // Garments are stepped side by side.
        live.set_threads(Arc::new(Serial));
        Self {
            rig,
            live,
            surface: Surface::new(&model.garment().rest),
            pose: model.character().skeleton.bind_pose(),
            shown: Shown::default(),
        }
    }

    /// The animator, to be read.
    pub fn animator(&self) -> &Animator {
        self.live.animator()
    }

    /// Starts the garment anew in the next frame, as after a cut: in the mean shape of training.
    pub fn restart(&mut self) {
        self.live.restart();
    }

    /// Carries the garment to the pose of the next frame in its shape, at rest.
    pub fn teleport(&mut self) {
        self.live.teleport();
    }

    /// Copies the state after the last tick; none before the first frame.
    pub fn save(&self) -> Option<AnimatorState> {
        self.live.state().cloned()
    }

    /// Continues from a state of the same model in the next frame, wherever the character is then.
    ///
    /// # Errors
    /// A state of another model. The garment goes on as before.
    pub fn restore(&mut self, state: AnimatorState) -> Result<(), AnimatorError> {
        self.live.restore(state)
    }

    /// Replaces the intersection handling of the model.
    pub fn set_intersection(&mut self, mode: IntersectionMode) {
        self.live.set_intersection(mode);
    }

    /// Sets the layers of the garment, whose order is kept.
    ///
    /// # Errors
    /// Layers of another mesh.
    pub fn set_layers(&mut self, layers: Layers) -> Result<(), AnimatorError> {
        self.live.set_layers(layers)
    }
}

/// Gives a state and a mesh to garments whose model and character are loaded.
pub(crate) fn attach(
    mut commands: Commands,
    models: Res<Assets<UnicModel>>,
    bind_poses: Res<Assets<SkinnedMeshInverseBindposes>>,
    mut meshes: ResMut<Assets<Mesh>>,
    waiting: Query<(Entity, &UnicGarment), (Without<GarmentState>, Without<GarmentFault>)>,
    characters: Query<(Option<&SkinnedMesh>, Option<&Children>)>,
    names: Query<&Name>,
) {
    for (entity, garment) in &waiting {
        let Some(UnicModel(model)) = models.get(&garment.model) else {
            continue;
        };
        let Some(skin) = skinned_mesh(garment.character, &characters) else {
            continue;
        };
        let Some(inverse) = bind_poses.get(&skin.inverse_bindposes) else {
            continue;
        };
        let rig = skin_joints(skin, inverse, &names)
            .and_then(|joints| Ok(Rig::new(&model.character().skeleton, &joints)?));
        match rig {
            Ok(rig) => {
                let state = GarmentState::new(model, rig);
                let mesh = Mesh3d(meshes.add(state.surface.mesh()));
                commands.entity(entity).insert((state, mesh));
            }
            Err(fault) => {
                error!("garment {entity} on character {}: {fault}", garment.character);
                commands.entity(entity).insert(fault);
            }
        }
    }
}

/// The skinned mesh of an entity, or the one with the most joints below it: hair and clothes may have
/// skins of their own.
fn skinned_mesh<'a>(
    character: Entity,
    characters: &'a Query<(Option<&SkinnedMesh>, Option<&Children>)>,
) -> Option<&'a SkinnedMesh> {
    let mut found: Option<&SkinnedMesh> = None;
    let mut open = vec![character];
    while let Some(entity) = open.pop() {
        let Ok((skin, children)) = characters.get(entity) else {
            continue;
        };
        let joints = |skin: Option<&SkinnedMesh>| skin.map_or(0, |skin| skin.joints.len());
        if joints(skin) > joints(found) {
            found = skin;
        }
        open.extend(children.into_iter().flatten());
    }
    found
}

fn skin_joints<'a>(
    skin: &SkinnedMesh,
    inverse: &SkinnedMeshInverseBindposes,
    names: &'a Query<&Name>,
) -> Result<Vec<SkinJoint<'a>>, GarmentFault> {
    let (expected, found) = (skin.joints.len(), inverse.len());
    if expected != found {
        return Err(GarmentFault::BindPoses { expected, found });
    }
    let joint = |(&entity, inverse): (&Entity, &Mat4)| SkinJoint {
        entity,
        name: names.get(entity).map_or("", |name| name.as_str()),
        mesh_from_joint: bevy::math::Affine3A::from_mat4(*inverse).inverse(),
    };
    Ok(skin.joints.iter().zip(inverse.iter()).map(joint).collect())
}
