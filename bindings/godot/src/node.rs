//! The node that wears a model.
#![allow(missing_docs, reason = "the accessors that `export` writes have none")]

use crate::{
    body,
    garment::{Garment, Picture, Surroundings},
    mesh::{LayoutError, MovingMesh},
    model::{self, LoadError, SharedModel},
    rig::{Bone, Rig, RigError},
};
use glam::{Quat, Vec3};
use godot::{
    classes::{IMeshInstance3D, MeshInstance3D, Node, Skeleton3D},
    prelude::*,
};
use std::sync::Arc;
use thiserror::Error;
use unic_core::{AnimatorError, AnimatorState, transform::Rigid};

/// Signal of a skeleton when its modifiers are done and their poses still hold; since Godot 4.3.
const SKELETON_UPDATED: &str = "skeleton_updated";

/// Pictures between two ticks of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, GodotConvert, Var, Export)]
#[godot(via = i64)]
pub enum Display {
    /// The cloth is interpolated on the pose of each frame, up to a tick behind.
    #[default]
    Interpolated = 0,
    /// The cloth moves with the ticks alone.
    Ticks = 1,
}

/// A garment that follows the bones of a skeleton.
///
/// It stands at the origin of the world: its vertices are where the cloth is.
#[derive(Debug, GodotClass)]
#[class(base = MeshInstance3D, init)]
pub struct UnicGarment3D {
    /// Trained garment, a `.unic` file.
    #[export(file = "*.unic")]
    model_file: GString,
    /// Skeleton that wears the garment, or a node above it.
    #[export]
    #[init(val = NodePath::from(".."))]
    character: NodePath,
    /// Pictures between two ticks of the model.
    #[export]
    display: Display,
    /// Share of the vertices that the networks see.
    #[export(range = (0.05, 1.0))]
    #[init(val = 1.0)]
    sampling: f32,
    /// Velocity of the air, m/s.
    #[export]
    wind: Vector3,
    /// Height of the ground, metres.
    #[export]
    ground_height: f32,
    /// Keeps the garment as it is. It starts anew afterwards.
    #[export]
    paused: bool,
    /// Movement of the root within a frame that is a teleport, metres.
    #[export]
    #[init(val = 1.0)]
    teleport_distance: f32,
    /// Properties with which the garment was put on, or with which that failed.
    tried: Option<Choice>,
    worn: Option<Worn>,
    fault: Option<String>,
    /// Seconds that have passed since the last step.
    elapsed_s: f64,
    base: Base<MeshInstance3D>,
}

/// Properties whose change dresses the node anew.
#[derive(Clone, Debug, PartialEq)]
struct Choice {
    model_file: GString,
    character: NodePath,
    sampling: f32,
}

/// Garment on a skeleton.
#[derive(Debug)]
struct Worn {
    shared: Arc<SharedModel>,
    skeleton: Gd<Skeleton3D>,
    garment: Garment,
    mesh: MovingMesh,
    /// Bones after the skeleton's modifiers, in its space, a joint of the model each.
    skeleton_from_bone: Vec<Rigid>,
    /// Whether the bones are those of this frame.
    has_bones: bool,
}

/// Reason why a garment does not move.
#[derive(Debug, Error)]
enum Fault {
    #[error(transparent)]
    Load(#[from] LoadError),
    #[error("expected a Skeleton3D at or under the node {0}, found none")]
    Skeleton(NodePath),
    #[error(transparent)]
    Rig(#[from] RigError),
    #[error(transparent)]
    Layout(#[from] LayoutError),
    #[error(transparent)]
    Pose(#[from] AnimatorError),
}

#[godot_api]
impl IMeshInstance3D for UnicGarment3D {
    fn ready(&mut self) {
        self.base_mut().set_as_top_level(true);
        self.base_mut().set_global_transform(Transform3D::IDENTITY);
    }

    fn exit_tree(&mut self) {
        // The character may be another one at the next place.
        self.undress();
    }

    fn process(&mut self, delta: f64) {
        self.elapsed_s += delta;
        // After all nodes have posed the skeleton, and after its modifiers.
        self.run_deferred_gd(|mut node| {
            if node.is_instance_valid() && node.is_inside_tree() {
                node.bind_mut().frame();
            }
        });
    }
}

#[godot_api]
impl UnicGarment3D {
    /// Says once why the garment does not move.
    #[signal]
    fn faulted(reason: GString);

    /// Starts the garment anew in the next frame, as after a cut. Tries again after a fault.
    #[func]
    fn restart(&mut self) {
        self.fault = None;
        if let Some(worn) = &mut self.worn {
            worn.garment.restart();
        }
    }

    /// Carries the garment to the pose of the next frame in its shape, at rest.
    #[func]
    fn teleport(&mut self) {
        if let Some(worn) = &mut self.worn {
            worn.garment.teleport();
        }
    }

    /// Reason why the garment does not move; empty if it does.
    #[func]
    fn fault(&self) -> GString {
        GString::from(self.fault.as_deref().unwrap_or_default())
    }

    /// Bytes of the garment's state after the last tick; empty before the first one.
    #[func]
    fn save_state(&self) -> PackedByteArray {
        let mut saved = Vec::new();
        let Some(worn) = &self.worn else {
            return PackedByteArray::new();
        };
        if let Some(state) = worn.garment.state()
            && let Err(error) = state.save(worn.shared.checksum, &mut saved)
        {
            godot_error!("{error}");
        }
        PackedByteArray::from(saved)
    }

    /// Continues from the bytes of a state of the same model. Returns whether they fit; an error says
    /// why not.
    #[func]
    fn restore_state(&mut self, bytes: PackedByteArray) -> bool {
        if self.worn.is_none() && self.fault.is_none() {
            self.put_on();
        }
        let Some(worn) = &mut self.worn else {
            godot_error!(
                "{}: a state is restored to a garment without fault",
                self.base().get_name()
            );
            return false;
        };
        let restored = AnimatorState::from_saved(bytes.as_slice(), worn.shared.checksum)
            .map_err(|error| error.to_string())
            .and_then(|state| worn.garment.restore(state).map_err(|error| error.to_string()));
        if let Err(error) = &restored {
            godot_error!("{}: {error}", self.base().get_name());
        }
        restored.is_ok()
    }

    /// Vertices of the model in this frame, metres, world space; empty before the first frame.
    #[func]
    fn vertices(&self) -> PackedVector3Array {
        self.worn
            .as_ref()
            .map(|worn| worn.mesh.shown())
            .unwrap_or_default()
    }

    /// Ticks a second of the model; 0 if none is worn.
    #[func]
    fn tick_rate(&self) -> f32 {
        self.worn
            .as_ref()
            .map_or(0.0, |worn| worn.shared.model.config().fps)
    }

    /// Makes the character of a model: a skeleton with the skinned body as a child; null if the file is
    /// no model.
    #[func]
    fn make_character(model_file: GString) -> Option<Gd<Skeleton3D>> {
        match model::load(&model_file, 1.0) {
            Ok(shared) => Some(body::make_character(&shared.model)),
            Err(error) => {
                godot_error!("{error}");
                None
            }
        }
    }

    /// Keeps the bones while the skeleton's modifiers hold. The skeleton calls it.
    #[func(rename = _keep_bones)]
    fn keep_bones(&mut self) {
        if let Some(worn) = &mut self.worn {
            worn.read_bones();
        }
    }
}

impl UnicGarment3D {
    /// Moves the garment to this frame.
    fn frame(&mut self) {
        let frame_s = std::mem::take(&mut self.elapsed_s) as f32;
        self.drop_what_changed();
        if self.fault.is_some() {
            return;
        }
        if self.paused {
            if let Some(worn) = &mut self.worn {
                worn.garment.restart();
            }
            return;
        }
        if self.worn.is_none() {
            self.put_on();
        }
        let around = Surroundings {
            picture: match self.display {
                Display::Interpolated => Picture::Interpolated,
                Display::Ticks => Picture::Tick,
            },
            wind: vec3(self.wind),
            ground_height: self.ground_height,
            teleport_m: self.teleport_distance,
        };
        let Some(worn) = &mut self.worn else {
            return;
        };
        match worn.advance(frame_s, &around) {
            Ok(None) => {}
            Ok(Some((size, aabb))) => {
                let scaled = Basis::from_scale(Vector3::splat(size));
                let mut base = self.base_mut();
                base.set_global_transform(Transform3D::new(scaled, Vector3::ZERO));
                base.set_custom_aabb(aabb);
            }
            Err(error) => self.say(&Fault::Pose(error)),
        }
    }

    /// Takes the garment off if its properties or its skeleton are others than when it was put on.
    fn drop_what_changed(&mut self) {
        let has_gone = |worn: &Worn| !worn.skeleton.is_instance_valid();
        if self.tried != Some(self.choice()) || self.worn.as_ref().is_some_and(has_gone) {
            self.undress();
            self.fault = None;
        }
    }

    fn choice(&self) -> Choice {
        Choice {
            model_file: self.model_file.clone(),
            character: self.character.clone(),
            sampling: self.sampling,
        }
    }

    fn put_on(&mut self) {
        let choice = self.choice();
        self.tried = Some(choice.clone());
        match self.dress(choice) {
            Ok(worn) => self.worn = Some(worn),
            Err(fault) => self.say(&fault),
        }
    }

    fn dress(&mut self, choice: Choice) -> Result<Worn, Fault> {
        let shared = model::load(&choice.model_file, choice.sampling)?;
        let node = self.base().get_node_or_null(&choice.character);
        let found = node.and_then(largest_skeleton);
        let Some(mut skeleton) = found else {
            return Err(Fault::Skeleton(choice.character));
        };
        let joints = &shared.model.character().skeleton;
        let garment = Garment::new(&shared.model, Rig::new(joints, &rests(&skeleton))?);
        let mesh = MovingMesh::new(&shared.model.garment().rest)?;
        let keep = self.base().callable("_keep_bones");
        if skeleton.has_signal(SKELETON_UPDATED) && !skeleton.is_connected(SKELETON_UPDATED, &keep) {
            skeleton.connect(SKELETON_UPDATED, &keep);
        }
        self.base_mut().set_mesh(&mesh.mesh());
        Ok(Worn {
            skeleton_from_bone: vec![Rigid::IDENTITY; joints.len()],
            has_bones: false,
            shared,
            skeleton,
            garment,
            mesh,
        })
    }

    fn undress(&mut self) {
        let Some(mut worn) = self.worn.take() else {
            return;
        };
        let keep = self.base().callable("_keep_bones");
        if worn.skeleton.is_instance_valid() && worn.skeleton.is_connected(SKELETON_UPDATED, &keep) {
            worn.skeleton.disconnect(SKELETON_UPDATED, &keep);
        }
    }

    /// Says once why the garment does not move.
    fn say(&mut self, fault: &Fault) {
        let reason = fault.to_string();
        godot_error!("{}: {reason}", self.base().get_name());
        self.fault = Some(reason.clone());
        let reason = GString::from(&reason);
        self.signals().faulted().emit(&reason);
    }
}

impl Worn {
    /// Takes the bones from the skeleton.
    fn read_bones(&mut self) {
        for (slot, bone) in self.skeleton_from_bone.iter_mut().zip(self.garment.bones()) {
            if let Some(bone) = bone {
                *slot = rigid(self.skeleton.get_bone_global_pose(bone as i32));
            }
        }
        self.has_bones = true;
    }

    /// Moves the garment by a frame. Returns the size of the character, and the box around the garment
    /// in the size of the model; none if the skeleton has no size.
    fn advance(&mut self, frame_s: f32, around: &Surroundings) -> Result<Option<(f32, Aabb)>, AnimatorError> {
        // A skeleton that has not moved, or an engine older than 4.3, tells nothing.
        if !std::mem::take(&mut self.has_bones) {
            self.read_bones();
            self.has_bones = false;
        }
        let to_world = self.skeleton.get_global_transform();
        let turn = rigid(to_world).rotation;
        let world_from_bone: Vec<Rigid> = (self.skeleton_from_bone.iter())
            .map(|bone| {
                let [x, y, z] = bone.translation.to_array();
                let place = to_world * Vector3::new(x, y, z);
                Rigid::new(turn * bone.rotation, vec3(place))
            })
            .collect();
        let frame = self.garment.advance(&world_from_bone, frame_s, around)?;
        Ok(frame.map(|frame| (frame.size, self.mesh.write(&frame))))
    }
}

/// Skeleton with the most bones at or under a node: hair and props may have skeletons of their own.
fn largest_skeleton(node: Gd<Node>) -> Option<Gd<Skeleton3D>> {
    let mut found: Option<Gd<Skeleton3D>> = None;
    let mut open = vec![node];
    while let Some(node) = open.pop() {
        open.extend(node.get_children().iter_shared());
        if let Ok(skeleton) = node.try_cast::<Skeleton3D>()
            && found
                .as_ref()
                .is_none_or(|found| skeleton.get_bone_count() > found.get_bone_count())
        {
            found = Some(skeleton);
        }
    }
    found
}

/// Bones of a skeleton in its rest pose.
fn rests(skeleton: &Gd<Skeleton3D>) -> Vec<Bone> {
    let bone = |bone: i32| Bone {
        name: skeleton.get_bone_name(bone).to_string(),
        skeleton_from_bone: rigid(skeleton.get_bone_global_rest(bone)),
    };
    (0..skeleton.get_bone_count()).map(bone).collect()
}

/// Rotation and place of a transform that may scale.
fn rigid(transform: Transform3D) -> Rigid {
    let q = transform.basis.orthonormalized().get_quaternion();
    Rigid::new(Quat::from_xyzw(q.x, q.y, q.z, q.w), vec3(transform.origin))
}

fn vec3(v: Vector3) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}
