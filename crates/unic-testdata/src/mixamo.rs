//! Figure with Mixamo's 65 joints, fingers included, in Mixamo's names and order.

use crate::{capture::Figure, motion::FPS};
use glam::{Quat, Vec3};
use unic_core::{
    Pose,
    character::Character,
    clip::Clip,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// Number of joints of [`Figure::mixamo`].
pub const MIXAMO_JOINTS: usize = 65;

/// Distance at which the influence of a joint on a vertex has fallen by a factor of e, metres.
const REACH_M: f32 = 0.15;

const FINGERS: [&str; 5] = ["Thumb", "Index", "Middle", "Ring", "Pinky"];

/// Rig under construction: one entry per joint in each list.
#[derive(Default)]
struct RigBuilder {
    names: Vec<String>,
    /// Index of each joint's parent; −1 for the root.
    parents: Vec<i64>,
    /// Positions in a T-pose, metres.
    places: Vec<Vec3>,
}

impl RigBuilder {
    /// Adds a joint and returns its index.
    fn add(&mut self, name: &str, parent: i64, place: Vec3) -> i64 {
        self.names.push(format!("mixamorig:{name}"));
        self.parents.push(parent);
        self.places.push(place);
        self.names.len() as i64 - 1
    }

    /// Adds a chain of joints and returns the index of the last one.
    fn chain(&mut self, mut parent: i64, joints: &[(String, Vec3)]) -> i64 {
        for (name, place) in joints {
            parent = self.add(name, parent, *place);
        }
        parent
    }

    /// Adds an arm; `x` is the sign of its side.
    fn arm(&mut self, chest: i64, side: &str, x: f32) {
        let at = |name: &str, along: f32| (format!("{side}{name}"), Vec3::new(x * along, 1.42, 0.0));
        let bones = [
            at("Shoulder", 0.05),
            at("Arm", 0.17),
            at("ForeArm", 0.44),
            at("Hand", 0.7),
        ];
        let hand = self.chain(chest, &bones);
        for (k, finger) in FINGERS.iter().enumerate() {
            let z = 0.04 - 0.02 * k as f32;
            let joint = |n: usize| {
                let along = x * (0.72 + 0.03 * n as f32);
                (format!("{side}Hand{finger}{n}"), Vec3::new(along, 1.42, z))
            };
            self.chain(hand, &[1, 2, 3, 4].map(joint));
        }
    }

    /// Adds a leg; `x` is the sign of its side.
    fn leg(&mut self, hips: i64, side: &str, x: f32) {
        let at = |name: &str, y: f32, z: f32| (format!("{side}{name}"), Vec3::new(0.1 * x, y, z));
        let bones = [
            at("UpLeg", 0.9, 0.0),
            at("Leg", 0.5, 0.01),
            at("Foot", 0.1, -0.02),
            at("ToeBase", 0.03, 0.1),
            at("Toe_End", 0.03, 0.16),
        ];
        self.chain(hips, &bones);
    }

    fn mixamo() -> Self {
        let mut rig = Self::default();
        let hips = rig.add("Hips", -1, Vec3::Y * 0.95);
        let up = |name: &str, y: f32| (name.to_owned(), Vec3::Y * y);
        let chest = rig.chain(hips, &[up("Spine", 1.05), up("Spine1", 1.18), up("Spine2", 1.3)]);
        rig.chain(
            chest,
            &[up("Neck", 1.48), up("Head", 1.55), up("HeadTop_End", 1.72)],
        );
        // Mixamo lists both arms before both legs.
        for (side, x) in [("Left", 1.0), ("Right", -1.0)] {
            rig.arm(chest, side, x);
        }
        for (side, x) in [("Left", 1.0), ("Right", -1.0)] {
            rig.leg(hips, side, x);
        }
        rig
    }

    /// Skinning weights that are smooth in space: every joint near a vertex moves it.
    fn weights(&self, vertices: &[Vec3]) -> SkinningWeights {
        let share = |v: Vec3, joint: Vec3| (-(v.distance(joint) / REACH_M).powi(2)).exp();
        let rows = vertices
            .iter()
            .map(|&v| self.places.iter().map(move |&j| share(v, j)).enumerate());
        SkinningWeights::from_rows(self.places.len(), rows).unwrap()
    }
}

impl Figure {
    /// The tube and its body on Mixamo's 65 joints in a T-pose.
    pub fn mixamo() -> Self {
        let (tube, rig) = (Self::tube(), RigBuilder::mixamo());
        let body = tube.character.body;
        let mut garment = tube.garment;
        garment.weights = rig.weights(&garment.rest.vertices);
        let weights = rig.weights(&body.vertices);
        let joint = |name: &str| rig.names.iter().position(|n| n.ends_with(name)).unwrap();
        let contact_joints = ["LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase"].map(joint);
        let skeleton = Skeleton::new(SkeletonParts {
            names: rig.names,
            parents: rig.parents,
            joints: rig.places,
            ..SkeletonParts::default()
        });
        let skeleton = skeleton.unwrap();
        assert_eq!(skeleton.len(), MIXAMO_JOINTS);
        Self {
            character: Character {
                body,
                skeleton,
                weights,
                file_mesh: None,
            },
            garment,
            contact_joints,
        }
    }
}

/// Clip of a walk in which every joint swings independently, fingers too; `seed` shifts it in time.
pub fn mixamo_clip(name: &str, seed: usize, frames: usize) -> Clip {
    let pose = |t: usize| {
        let s = (t + 17 * seed) as f32 / FPS;
        let joint = |j: usize| {
            // Each joint has an axis, a frequency and a phase of its own.
            let k = j as f32;
            let axis = Vec3::new((1.3 * k).sin(), (0.7 * k).cos(), (2.1 * k).sin()).normalize();
            Quat::from_axis_angle(axis, 0.25 * ((2.0 + 0.05 * k) * s + k).sin())
        };
        Pose {
            trans: Vec3::new(0.1 * (3.0 * s).sin(), 0.02 * (6.0 * s).cos(), 0.4 * s),
            local: (0..MIXAMO_JOINTS).map(joint).collect(),
        }
    };
    Clip {
        name: name.into(),
        fps: FPS,
        poses: (0..frames).map(pose).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    }
}
