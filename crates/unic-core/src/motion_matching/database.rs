//! Database: the frames of all clips, with what is needed to find, play and mirror them.

use super::{
    error::{DatabaseError, check_count},
    features::{Feature, FeatureGroup, FeatureScale, feature_len, standard_groups},
    index::FeatureIndex,
    root::RootFrame,
};
use crate::{character::Character, leg::Leg, skeleton::Skeleton};
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// Largest number of tags: the bits of a word.
pub(super) const MAX_TAGS: usize = 32;
/// Largest coordinate of a position, metres. Differences of larger ones may overflow.
pub(super) const FARTHEST_M: f32 = 1e6;

/// Definition of a database, chosen before it is built.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatabaseSettings {
    /// Features by which frames are compared.
    pub groups: Vec<FeatureGroup>,
    /// Joints of the left and of the right leg.
    pub legs: [Leg; 2],
    /// Heights of the toe joints above the soles of flat feet, metres.
    pub toe_heights_m: [f32; 2],
    /// Joint with left and right exchanged, for each joint. If present, every clip is also stored
    /// mirrored.
    pub mirror: Option<Vec<usize>>,
    /// Part at the end of each clip where no search ends, seconds: the rest of it is too short.
    pub end_margin_s: f32,
    /// Speed of a toe below which its foot stands, m/s.
    pub contact_speed_m_s: f32,
    /// Height of a toe above its rest height up to which its foot stands, metres.
    pub contact_height_m: f32,
}

impl DatabaseSettings {
    /// Returns the standard settings for a character, which stands on its lowest vertex in the bind
    /// pose.
    pub fn standard(character: &Character, legs: [Leg; 2]) -> Self {
        let skeleton = &character.skeleton;
        let heights = |points: &[Vec3]| points.iter().map(|p| p.y).reduce(f32::min);
        let sole = heights(&character.body.vertices)
            .or(heights(skeleton.joints()))
            .unwrap_or(0.0);
        Self {
            groups: standard_groups(&legs, skeleton.root()),
            legs,
            toe_heights_m: legs.map(|leg| skeleton.joints()[leg.toe].y - sole),
            mirror: None,
            end_margin_s: 1.0 / 3.0,
            contact_speed_m_s: 0.25,
            contact_height_m: 0.05,
        }
    }

    /// Checks the settings for a skeleton.
    pub(super) fn check(&self, skeleton: &Skeleton) -> Result<(), DatabaseError> {
        let joints = skeleton.len();
        let of_legs = self.legs.iter().flat_map(|l| [l.hip, l.knee, l.ankle, l.toe]);
        let of_groups = self.groups.iter().filter_map(|g| g.feature.joint());
        let of_mirror = self.mirror.iter().flatten().copied();
        if let Some(joint) = of_legs.chain(of_groups).chain(of_mirror).find(|&j| j >= joints) {
            return Err(DatabaseError::Joint { joint, joints });
        }
        if let Some(mirror) = &self.mirror {
            check_count("mirrored joints", joints, mirror.len())?;
        }
        let unusable = |what| Err(DatabaseError::Number { what });
        let seconds = |g: &FeatureGroup| g.feature.seconds().iter().all(|s| s.abs() <= MAX_TRAJECTORY_S);
        if !self.groups.iter().all(seconds) {
            return unusable("time of a trajectory");
        }
        if !(self.groups.iter()).all(|g| (0.0..=MAX_WEIGHT).contains(&g.weight)) {
            return unusable("weight of a feature");
        }
        let lengths = [self.end_margin_s, self.contact_speed_m_s, self.contact_height_m];
        if !lengths.iter().all(|x| (0.0..=100.0).contains(x)) {
            return unusable("margin or contact threshold");
        }
        if !self.toe_heights_m.iter().all(|h| h.abs() <= 100.0) {
            return unusable("height of a toe");
        }
        match feature_len(&self.groups) {
            0 => unusable("number of features"),
            _ => Ok(()),
        }
    }
}

/// Farthest time of a trajectory feature, seconds.
const MAX_TRAJECTORY_S: f32 = 10.0;
/// Largest weight of a feature.
const MAX_WEIGHT: f32 = 1e6;

/// Whether a stored clip is as captured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum View {
    /// Captured view.
    Direct,
    /// With left and right exchanged.
    Mirrored,
}

/// Place of a clip in the database.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredClip {
    /// Name of the clip.
    pub name: String,
    /// Captured or mirrored view.
    pub view: View,
    /// First frame.
    pub first: usize,
    /// Number of frames.
    pub len: usize,
}

impl StoredClip {
    /// Frame behind the last one.
    pub fn end(&self) -> usize {
        self.first + self.len
    }
}

/// Frames that are played: one entry a frame, but for `rotations`, which has one a frame and joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Frames {
    /// Root frames in the space of their clip.
    pub(super) roots: Vec<RootFrame>,
    /// Positions of the root joint in the root frame, metres, above ground height 0.
    pub(super) hips: Vec<Vec3>,
    /// Local rotations; that of the root joint relative to the root frame.
    pub(super) rotations: Vec<Quat>,
    /// Tags, as bits.
    pub(super) tags: Vec<u32>,
    /// Feet that stand, as bits: left 1, right 2.
    pub(super) contacts: Vec<u32>,
}

/// Motion database, an asset: clips as flat arrays with a search index.
///
/// Made by [`Database::build`] from clips or by [`Database::from_bytes`] from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Database {
    pub(super) skeleton: Skeleton,
    pub(super) settings: DatabaseSettings,
    pub(super) fps: f32,
    pub(super) tag_names: Vec<String>,
    pub(super) clips: Vec<StoredClip>,
    pub(super) frames: Frames,
    pub(super) scale: FeatureScale,
    pub(super) index: FeatureIndex,
}

impl Database {
    /// Skeleton of the poses.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Settings that the database was built with.
    pub fn settings(&self) -> &DatabaseSettings {
        &self.settings
    }

    /// Frames a second, the rate of a controller's steps.
    pub fn fps(&self) -> f32 {
        self.fps
    }

    /// Number of frames, mirrored ones included.
    pub fn len(&self) -> usize {
        self.frames.roots.len()
    }

    /// Returns whether there are no frames; never true.
    pub fn is_empty(&self) -> bool {
        self.frames.roots.is_empty()
    }

    /// Clips, in the order of their frames.
    pub fn clips(&self) -> &[StoredClip] {
        &self.clips
    }

    /// Clip of a frame.
    ///
    /// # Panics
    /// When the database does not have the frame.
    pub fn clip_of(&self, frame: usize) -> &StoredClip {
        // Clips are not empty and lie one behind the other.
        &self.clips[self.clips.partition_point(|clip| clip.end() <= frame)]
    }

    /// Names of the tags; the position of each is its bit.
    pub fn tag_names(&self) -> &[String] {
        &self.tag_names
    }

    /// Bits of a tag; none for an unknown one.
    pub fn tag_bit(&self, name: &str) -> Option<u32> {
        self.tag_names
            .iter()
            .position(|tag| tag == name)
            .map(|bit| 1 << bit)
    }

    /// Tags of a frame, as bits.
    pub fn tags(&self, frame: usize) -> u32 {
        self.frames.tags[frame]
    }

    /// Normalised features of a frame, in the order of the groups.
    pub fn features(&self, frame: usize) -> impl Iterator<Item = f32> + '_ {
        self.index.row(frame)
    }

    /// Means and scales of the features.
    pub fn scale(&self) -> &FeatureScale {
        &self.scale
    }

    /// Feet that stand in a frame: left and right.
    pub fn contacts(&self, frame: usize) -> [bool; 2] {
        [1, 2].map(|bit| self.frames.contacts[frame] & bit != 0)
    }

    /// Root frame in the space of its clip.
    pub fn root(&self, frame: usize) -> RootFrame {
        self.frames.roots[frame]
    }

    /// Position of the root joint in the root frame, metres.
    pub fn hips(&self, frame: usize) -> Vec3 {
        self.frames.hips[frame]
    }

    /// Local rotations of a frame; that of the root joint is relative to the root frame.
    pub fn rotations(&self, frame: usize) -> &[Quat] {
        let joints = self.skeleton.len();
        &self.frames.rotations[frame * joints..(frame + 1) * joints]
    }

    /// Number of frames that `seconds` are.
    pub(super) fn frames_in(&self, seconds: f32) -> usize {
        (seconds * self.fps).round().max(0.0) as usize
    }

    /// First number of each group, in the order of the groups.
    pub(super) fn offsets(&self) -> impl Iterator<Item = (usize, &Feature)> {
        self.settings.groups.iter().scan(0, |next, group| {
            let first = *next;
            *next += group.feature.len();
            Some((first, &group.feature))
        })
    }
}
