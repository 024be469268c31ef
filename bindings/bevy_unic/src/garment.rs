//! Garments and what they consist of.

use crate::{
    mesh::Surface,
    model::UnicModel,
    rig::{Rig, RigError, RigJoint},
};
use bevy::{
    mesh::skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    prelude::*,
};
use std::sync::Arc;
use thiserror::Error;
use unic_core::{
    Animator, Model, Pose, TickClock, TickInterpolator, animator::AnimatorError, collider::Collider,
    parallel::Serial,
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
    /// Keeps the garment as it is, such as far from the camera. It starts anew afterwards.
    pub is_paused: bool,
    /// Movement of the root within a frame after which the garment starts anew, metres.
    pub teleport_m: f32,
}

/// Pictures between two ticks of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Display {
    /// The cloth is interpolated on the pose of each frame, up to a tick behind.
    #[default]
    Interpolated,
    /// The cloth moves with the ticks alone.
    Ticks,
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
            teleport_m: 1.0,
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
    pub(crate) animator: Animator,
    pub(crate) interpolator: TickInterpolator,
    pub(crate) surface: Surface,
    pub(crate) clock: TickClock,
    /// Whether the animator continues a motion. If not, the next frame begins one.
    pub(crate) has_started: bool,
    /// Poses of the last and of this frame.
    pub(crate) before: Pose,
    pub(crate) now: Pose,
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
        let mut animator = Animator::new(Arc::clone(model));
        // Garments are stepped side by side.
        animator.set_threads(Arc::new(Serial));
        let pose = model.character().skeleton.bind_pose();
        Self {
            rig,
            animator,
            interpolator: TickInterpolator::default(),
            surface: Surface::new(&model.garment().rest),
            clock: TickClock::new(model.config().fps),
            has_started: false,
            before: pose.clone(),
            now: pose,
            shown: Shown::default(),
        }
    }

    /// The animator, for what the component has no field for.
    pub fn animator(&mut self) -> &mut Animator {
        &mut self.animator
    }

    /// Starts the garment anew in the next frame, as after a cut.
    pub fn restart(&mut self) {
        self.has_started = false;
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
        let rig = rig_joints(skin, inverse, &names)
            .and_then(|joints| Rig::new(&model.character().skeleton, &joints));
        match rig {
            Ok(rig) => {
                let state = GarmentState::new(model, rig);
                let mesh = Mesh3d(meshes.add(state.surface.mesh()));
                commands.entity(entity).insert((state, mesh));
            }
            Err(error) => {
                error!("garment {entity} on character {}: {error}", garment.character);
                commands.entity(entity).insert(GarmentFault::Rig(error));
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

fn rig_joints<'a>(
    skin: &SkinnedMesh,
    inverse: &SkinnedMeshInverseBindposes,
    names: &'a Query<&Name>,
) -> Result<Vec<RigJoint<'a>>, RigError> {
    let (expected, found) = (skin.joints.len(), inverse.len());
    if expected != found {
        return Err(RigError::BindPoses { expected, found });
    }
    let joint = |(&entity, inverse): (&Entity, &Mat4)| RigJoint {
        entity,
        name: names.get(entity).map_or("", |name| name.as_str()),
        mesh_from_joint: bevy::math::Affine3A::from_mat4(*inverse).inverse(),
    };
    Ok(skin.joints.iter().zip(inverse.iter()).map(joint).collect())
}
