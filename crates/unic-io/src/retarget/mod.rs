//! Motion of any skeleton on a character.
//!
//! 1. Joints are told by their names ([`BoneMap`] helps where that fails) and by the tree.
//! 2. The file's unit and up axis follow from the length of the legs and the direction of the trunk.
//! 3. Every bone takes the source's rotation away from a reference pose in which both bodies stand;
//!    arms and legs are laid along the source's first, so that they point where its do whatever the
//!    rest pose (T, A, arms down). Spines of other lengths share the rotation out.
//! 4. The midpoint of the hips follows the source's, scaled by the ratio of the legs.
//! 5. The result passes a low-pass filter, and feet that stand are held: [`LowPass`](crate::LowPass), [`Feet`](crate::Feet).

mod bones;
pub(crate) mod feet;
mod leg;
pub(crate) mod low_pass;
mod names;
mod rig;
mod sides;
mod transfer;

pub use bones::BoneMap;
pub(crate) use bones::feet_by_name;
pub use feet::{FootMeasure, measure_feet};
pub(crate) use names::is_same_joint;
pub use sides::counterparts;

use crate::{
    bvh::Bvh,
    error::{Error, Result},
    motion::UpAxis,
};
use bones::{Bones, Tree};
use glam::{Quat, Vec3};
use rig::{Origin, Rig, mean_trunk};
use std::{f32::consts::FRAC_PI_2, path::Path};
use transfer::Transfer;
use unic_core::{character::Character, clip::Clip};

use transfer::swing;

/// Length of a grown person's leg from hip to ankle, metres.
const LEG_M: f32 = 0.84;

/// Units that files are in, metres.
const UNITS: [(&str, f32); 6] = [
    ("metres", 1.0),
    ("decimetres", 0.1),
    ("CMU's 1/0.45 inches", 0.0254 / 0.45),
    ("inches", 0.0254),
    ("centimetres", 0.01),
    ("millimetres", 0.001),
];

/// Cosine of the angle between trunk and up axis below which the axis is a guess: 45°.
const CERTAIN: f32 = 0.7;

/// What is known of a file before it is put on any character.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    rig: Rig,
    world_from_source: Quat,
    pub(crate) notes: Vec<String>,
}

impl Source {
    /// Joints, reference pose, up axis and unit of a file of at least two frames.
    pub(crate) fn new(path: &Path, bvh: &Bvh, map: &BoneMap, up: UpAxis) -> Result<Self> {
        if bvh.len() < 2 {
            return Err(Error::content(path, "at least two frames", bvh.len().to_string()));
        }
        let tree = Tree {
            path,
            names: bvh.joints().iter().map(|j| j.name.as_str()).collect(),
            parents: bvh.joints().iter().map(|j| j.parent).collect(),
        };
        let bones = Bones::identify(&tree, map)?;
        let mut notes = vec![format!("joints named as by {}", bones.family)];
        let world_from_source = y_up(mean_trunk(bvh, &bones)?, up, &mut notes);
        let rig = Rig::of_bvh(bvh, bones, world_from_source.inverse() * Vec3::Y)?;
        if let Origin::Frame(frame) = rig.origin {
            notes.push(format!(
                "the body does not stand in the zero pose: frame {frame} stands for it"
            ));
        }
        let leg = rig.leg_length();
        if !(leg.is_finite() && leg > f32::MIN_POSITIVE) {
            return Err(Error::content(path, "legs with a length", leg.to_string()));
        }
        notes.push(unit_note(leg));
        Ok(Self {
            rig,
            world_from_source,
            notes,
        })
    }

    /// The motion on a character, one pose a frame of the file.
    pub(crate) fn on(&self, path: &Path, bvh: &Bvh, character: &Character) -> Result<(Clip, Vec<String>)> {
        let skeleton = &character.skeleton;
        let target = Rig::of_skeleton(skeleton)?;
        let transfer = Transfer::new(skeleton, &self.rig, &target, self.world_from_source);
        let mut notes = self.notes.clone();
        notes.push(format!(
            "scaled by {:.4}, the ratio of the legs, to this body",
            transfer.scale
        ));
        let mut scratch = Vec::new();
        let poses: Result<Vec<_>> = (0..bvh.len())
            .map(|frame| transfer.pose(bvh, frame, &mut scratch))
            .collect();
        let poses = poses?;
        if let Some(frame) = poses.iter().position(|p| !p.is_valid()) {
            let found = format!("others in frame {frame}");
            return Err(Error::content(path, "positions that a body can take", found));
        }
        let clip = Clip {
            name: path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            fps: bvh.fps(),
            poses,
            ground_height: 0.0,
            wind: Vec::new(),
        };
        Ok((clip, notes))
    }
}

/// `world_from_source` for the axis that the trunk follows on average, or the one asked for.
fn y_up(trunk: Vec3, up: UpAxis, notes: &mut Vec<String>) -> Quat {
    let is_z = match up {
        UpAxis::Auto => trunk.z > trunk.y,
        UpAxis::Y => false,
        UpAxis::Z => true,
    };
    let along = if is_z { trunk.z } else { trunk.y };
    if up == UpAxis::Auto && along < CERTAIN {
        let (axis, other) = if is_z { ("Z", "Y") } else { ("Y", "Z") };
        notes.push(format!(
            "the up axis is uncertain, because the body does not stand for most of the clip: \
             {axis} is assumed, ask for {other} up if the character lies on the ground"
        ));
    }
    if !is_z {
        return Quat::IDENTITY;
    }
    notes.push("Z up converted to Y up".into());
    Quat::from_rotation_x(-FRAC_PI_2)
}

fn unit_note(leg: f32) -> String {
    let off = |unit: f32| (leg * unit / LEG_M).ln().abs();
    let nearest = UNITS.iter().min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    let (name, unit) = nearest.unwrap_or(&UNITS[0]);
    format!(
        "the unit is taken to be {name}: legs of {leg:.4} are {:.2} m",
        leg * unit
    )
}
