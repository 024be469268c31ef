//! Normalised motion vectors of a clip.

use crate::mirror::{MirrorMap, View};
use unic_core::motion::Normalisation;
use unic_eval::PreparedClip;

/// Normalised motion vectors of one clip, as they are and mirrored.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionVectors {
    /// Number of elements in a vector.
    pub len: usize,
    plain: Vec<f32>,
    mirrored: Option<Vec<f32>>,
}

impl MotionVectors {
    /// Takes vectors as they are, without mirror images.
    pub fn of_plain(len: usize, plain: Vec<f32>) -> Self {
        Self {
            len,
            plain,
            mirrored: None,
        }
    }

    /// Normalises the motion vector of every frame of a clip, and its mirror image where there is a
    /// map.
    pub fn new(clip: &PreparedClip, normalisation: &Normalisation, mirror: Option<&MirrorMap>) -> Self {
        let normalised = |mut vector: Vec<f32>| {
            normalisation.apply(&mut vector);
            vector
        };
        let frames = || (0..clip.len()).map(|t| clip.kinematics.motion(t));
        Self {
            len: normalisation.mean.len(),
            plain: frames().flat_map(|c| normalised(c.to_vec())).collect(),
            mirrored: mirror.map(|m| frames().flat_map(|c| normalised(m.apply(c))).collect()),
        }
    }

    /// The same vectors with zeros for the elements that are not `kept`, one flag an element.
    pub(crate) fn with_only(&self, kept: &[bool]) -> Self {
        debug_assert_eq!(kept.len(), self.len);
        let only = |all: &Vec<f32>| {
            let pairs = all.iter().zip(kept.iter().cycle());
            pairs.map(|(x, kept)| if *kept { *x } else { 0.0 }).collect()
        };
        Self {
            len: self.len,
            plain: only(&self.plain),
            mirrored: self.mirrored.as_ref().map(only),
        }
    }

    /// Returns whether mirror images are there.
    pub fn is_mirrored(&self) -> bool {
        self.mirrored.is_some()
    }

    /// The vector of one frame; the mirrored one where there is a mirror map.
    pub fn frame(&self, frame: usize, view: View) -> &[f32] {
        let all = match (view, &self.mirrored) {
            (View::Mirrored, Some(mirrored)) => mirrored,
            _ => &self.plain,
        };
        &all[frame * self.len..(frame + 1) * self.len]
    }
}
