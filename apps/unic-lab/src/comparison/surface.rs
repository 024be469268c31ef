//! Conversion between world positions and the quantity that a subspace holds: displacements from
//! skinning, or positions relative to the root joint.

use super::config::SurfaceKind;
use glam::Vec3;
use unic_core::{
    character::Garment,
    features::{PointFrame, StateFrame},
};
use unic_eval::{ClipKinematics, PreparedClip};
use unic_train::displacements;

impl SurfaceKind {
    /// Returns the true garment of a frame in the form of this subspace, metres.
    pub(super) fn of_frame(self, garment: &Garment, clip: &PreparedClip, frame: usize) -> Vec<Vec3> {
        match self {
            Self::Displacement => displacements(garment, clip, frame),
            Self::RootRelative => {
                let place = StateFrame::of_position(clip.kinematics.world_from_state(frame));
                let world = clip.captured.garment.frame(frame).iter();
                world.map(|x| place.to_state(*x)).collect()
            }
        }
    }

    /// Computes the world positions of a garment in the form of this subspace, metres.
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
                let place = StateFrame::of_position(kinematics.world_from_state(frame));
                positions.extend(surface.map(|x| place.to_world(x)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_core::motion::{MotionLayout, MotionSpec, VelocityScheme};
    use unic_io::Split;
    use unic_testdata::{Figure, Take, capture, take};

    fn prepared(take: Take) -> PreparedClip {
        let figure = Figure::tube();
        let (layout, velocity) = (MotionLayout::Paper, VelocityScheme::Forward);
        let spec = MotionSpec::new(layout, velocity, figure.contact_joints, &figure.character).unwrap();
        let (_folder, capture) = capture(&figure, &[(take, Split::Train)]);
        let captured = capture.load_clip("take").unwrap();
        PreparedClip::new(&spec, &figure.character.skeleton, captured)
    }

    #[test]
    fn conversion_is_invertible_and_independent_of_the_distance_travelled() {
        let garment = Figure::tube().garment;
        let here = take("take", 2, 20);
        let mut there = here.clone();
        for (t, (pose, vertices)) in there.clip.poses.iter_mut().zip(&mut there.garment).enumerate() {
            let by = Vec3::new(0.2, 0.0, -0.1) * t as f32;
            pose.trans += by;
            vertices.iter_mut().for_each(|v| *v += by);
        }
        let clips = [prepared(here), prepared(there)];
        let mut world = Vec::new();
        for kind in [SurfaceKind::Displacement, SurfaceKind::RootRelative] {
            let [near, far] = [0, 1].map(|i| kind.of_frame(&garment, &clips[i], 19));
            assert!(
                near.iter().zip(&far).all(|(a, b)| a.distance(*b) < 1e-5),
                "{kind:?}"
            );
            let surface = far.into_iter();
            kind.to_world(&garment, &clips[1].kinematics, 19, surface, &mut world);
            let truth = clips[1].captured.garment.frame(19);
            assert!(
                world.iter().zip(truth).all(|(a, b)| a.distance(*b) < 1e-5),
                "{kind:?}"
            );
        }
    }
}
