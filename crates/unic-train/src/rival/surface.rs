//! What a subspace holds of the garment: displacements from skinning, or positions about the root joint.

use super::config::SurfaceKind;
use crate::prior::displacements;
use glam::Vec3;
use unic_core::{
    character::Garment,
    features::{Place, PointFrame},
};
use unic_eval::{ClipKinematics, PreparedClip};

impl SurfaceKind {
    /// The garment of a frame as the subspace holds it, metres.
    pub(super) fn of_frame(self, garment: &Garment, clip: &PreparedClip, frame: usize) -> Vec<Vec3> {
        match self {
            Self::Displacement => displacements(garment, clip, frame),
            Self::RootRelative => {
                let place = Place::in_frame(clip.kinematics.world_from_state(frame));
                let world = clip.captured.garment.frame(frame).iter();
                world.map(|x| place.to_state(*x)).collect()
            }
        }
    }

    /// Where such a garment puts its vertices in the world, metres.
    pub(super) fn to_world(
        self,
        garment: &Garment,
        kinematics: &ClipKinematics,
        frame: usize,
        surface: impl ExactSizeIterator<Item = Vec3>,
        positions: &mut Vec<Vec3>,
    ) {
        positions.clear();
        match self {
            Self::Displacement => {
                let world_from_rest = kinematics.world_from_rest(frame);
                let place = |(v, u)| PointFrame::new(garment, v, world_from_rest).position(u);
                positions.extend(surface.enumerate().map(place));
            }
            Self::RootRelative => {
                let place = Place::in_frame(kinematics.world_from_state(frame));
                positions.extend(surface.map(|x| place.to_world(x)));
            }
        }
    }
}
