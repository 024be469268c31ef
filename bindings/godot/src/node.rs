//! The node that wears a model.
#![allow(missing_docs, reason = "the accessors that `export` writes have none")]

use crate::{
    body,
    garment::{BodyContact, FrameChoice},
    model,
    worn::{Fault, Worn, vec3},
};
use godot::{
    classes::{IMeshInstance3D, MeshInstance3D, Skeleton3D},
    prelude::*,
};
use unic_core::{
    AnimatorState, Surroundings,
    animator::{self, TeleportLimit},
};

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
    /// Moves vertices out of the body, as the model was trained.
    #[export]
    #[init(val = true)]
    body_contact: bool,
    /// Velocity of the air, m/s.
    #[export]
    wind: Vector3,
    /// Height of the ground, metres.
    #[export]
    ground_height: f32,
    /// Keeps the garment as it is. It starts anew afterwards, or continues a state that has been
    /// restored meanwhile.
    #[export]
    paused: bool,
    /// Speed of the root above which a movement of more than half a metre within a frame is a
    /// teleport, m/s; 0 for none.
    #[export]
    #[init(val = TeleportLimit::default().speed_m_s)]
    teleport_speed: f32,
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
        self.worn.as_ref().map(|worn| worn.vertices()).unwrap_or_default()
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
        let frame_s = std::mem::take(&mut self.elapsed_s);
        self.drop_what_changed();
        if self.fault.is_some() {
            return;
        }
        if self.paused {
            if let Some(worn) = &mut self.worn {
                worn.garment.interrupt();
            }
            return;
        }
        if self.worn.is_none() {
            self.put_on();
        }
        let choice = self.frame_choice();
        let Some(worn) = &mut self.worn else {
            return;
        };
        match worn.advance(frame_s, &choice) {
            Ok(None) => {}
            Ok(Some((size, aabb))) => {
                let scaled = Basis::from_scale(Vector3::splat(size));
                let mut base = self.base_mut();
                base.set_global_transform(Transform3D::new(scaled, Vector3::ZERO));
                base.set_custom_aabb(aabb);
            }
            Err(error) => self.say(&Fault::Frame(error)),
        }
    }

    fn frame_choice(&self) -> FrameChoice {
        FrameChoice {
            display: match self.display {
                Display::Interpolated => animator::Display::Interpolated,
                Display::Ticks => animator::Display::Ticks,
            },
            contact: match self.body_contact {
                true => BodyContact::OfModel,
                false => BodyContact::Ignored,
            },
            around: Surroundings {
                wind: vec3(self.wind),
                ground_height: self.ground_height,
                teleports: TeleportLimit::with_speed(self.teleport_speed),
                ..Surroundings::default()
            },
        }
    }

    /// Takes the garment off if its properties or its skeleton are others than when it was put on.
    fn drop_what_changed(&mut self) {
        if self.tried != Some(self.choice()) || self.worn.as_ref().is_some_and(Worn::has_no_skeleton) {
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
        let node = node.ok_or_else(|| Fault::Skeleton(choice.character.clone()))?;
        let worn = Worn::new(shared, node, choice.character)?;
        worn.listen(&self.base().callable("_keep_bones"));
        self.base_mut().set_mesh(&worn.mesh());
        Ok(worn)
    }

    fn undress(&mut self) {
        if let Some(worn) = self.worn.take() {
            worn.stop_listening(&self.base().callable("_keep_bones"));
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
