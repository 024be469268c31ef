//! Left-right mirroring of training data.
//!
//! With M the reflection of x, a mirrored garment vertex has M·rest, M·u and rotation M R M:
//! nothing has to be simulated, skinned or looked up again, and the mesh need not be symmetric,
//! since the field is pointwise. The motion vector mirrors by swapping joints and flipping signs.

use glam::Vec3;
use std::borrow::Cow;
use unic_core::{
    mesh::TriMesh,
    motion::{JointSprings, MotionError, MotionSlices, Normalisation, NormalisationRule, motion_len},
    skeleton::Skeleton,
    surface_map::SurfaceMap,
};
use unic_io::joint_names::counterparts;

/// Mirrors motion vectors of one skeleton: `out[i] = sign[i] · c[source[i]]`.
#[derive(Clone, Debug)]
pub struct MirrorMap {
    source: Vec<usize>,
    sign: Vec<f32>,
}

/// Signs of a polar vector (positions, velocities), an axial vector (angular velocity) and the
/// first two rows of a rotation under x ↦ −x.
const POLAR: [f32; 3] = [-1.0, 1.0, 1.0];
const AXIAL: [f32; 3] = [1.0, -1.0, -1.0];
const ROTATION: [f32; 6] = [1.0, -1.0, -1.0, -1.0, 1.0, 1.0];

impl MirrorMap {
    /// Creates the map from joint names in any spelling that [`counterparts`] reads. Returns none
    /// if a joint that names a side has no counterpart, if no joint names a side, and if springs
    /// hang from one side alone.
    pub fn new(springs: &JointSprings, skeleton: &Skeleton) -> Option<Self> {
        let counterparts = counterparts(skeleton.names())?;
        let slices = MotionSlices::new(skeleton.len());
        let len = motion_len(skeleton.len()) + springs.numbers();
        let mut map = Self {
            source: (0..len).collect(),
            sign: vec![1.0; len],
        };
        map.block(slices.root_position.start, slices.root_position.start, &POLAR);
        map.block(slices.root_velocity.start, slices.root_velocity.start, &POLAR);
        map.block(
            slices.root_orientation.start,
            slices.root_orientation.start,
            &ROTATION,
        );
        map.block(
            slices.root_angular_velocity.start,
            slices.root_angular_velocity.start,
            &AXIAL,
        );
        let locals: Vec<usize> = (0..skeleton.len()).filter(|j| *j != skeleton.root()).collect();
        let slot = |joint: usize| locals.iter().position(|j| *j == joint);
        for (to, &joint) in locals.iter().enumerate() {
            let from = slot(counterparts[joint])?;
            let rotations = slices.joint_rotations.start;
            map.block(rotations + 6 * to, rotations + 6 * from, &ROTATION);
            for start in [slices.joint_positions.start, slices.joint_velocities.start] {
                map.block(start + 3 * to, start + 3 * from, &POLAR);
            }
        }
        // Contacts are left ankle, left foot, right ankle, right foot.
        let contacts = slices.contacts.start;
        map.source[slices.contacts].copy_from_slice(&[contacts + 2, contacts + 3, contacts, contacts + 1]);
        let (first, of_joint) = (motion_len(skeleton.len()), springs.springs.len());
        for (to, &joint) in springs.joints.iter().enumerate() {
            let from = springs.joints.iter().position(|j| *j == counterparts[joint])?;
            for spring in 0..of_joint {
                let [to, from] = [to, from].map(|joint| first + 3 * (joint * of_joint + spring));
                map.block(to, from, &POLAR);
            }
        }
        Some(map)
    }

    fn block(&mut self, to: usize, from: usize, signs: &[f32]) {
        for (i, sign) in signs.iter().enumerate() {
            self.source[to + i] = from + i;
            self.sign[to + i] = *sign;
        }
    }

    /// Returns the motion vector of the mirrored motion.
    pub fn apply(&self, vector: &[f32]) -> Vec<f32> {
        let pairs = self.source.iter().zip(&self.sign);
        pairs.map(|(&from, sign)| vector[from] * sign).collect()
    }
}

/// Fits the normalisation to the motion vectors of a training: the captured ones, and the mirrored
/// ones where there is a map. Without the mirrored ones, a movement of one side alone would be out
/// of range on the other side.
///
/// # Errors
/// Vectors of another length than `len`, elements that are not finite.
pub fn normalisation<'a>(
    joints: usize,
    len: usize,
    rule: NormalisationRule,
    vectors: impl Iterator<Item = &'a [f32]> + Clone,
    mirror: Option<&MirrorMap>,
) -> Result<Normalisation, MotionError> {
    let others = mirror.into_iter().flat_map(|map| {
        let vectors = vectors.clone();
        vectors.map(|vector| Cow::Owned(map.apply(vector)))
    });
    Normalisation::fit(
        joints,
        len,
        rule,
        vectors.clone().map(Cow::Borrowed).chain(others),
    )
}

/// View of a training window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// The motion as captured.
    Direct,
    /// The motion with left and right exchanged.
    Mirrored,
}

impl View {
    /// Returns a point or displacement in this view. The function is its own inverse.
    pub fn of(self, vector: Vec3) -> Vec3 {
        match self {
            Self::Direct => vector,
            Self::Mirrored => mirrored(vector),
        }
    }
}

/// Reflects a point or displacement: x becomes −x.
pub fn mirrored(vector: Vec3) -> Vec3 {
    Vec3::new(-vector.x, vector.y, vector.z)
}

/// Largest mean distance, in metres, between a garment and its mirror image at which the garment
/// counts as symmetric.
const SYMMETRIC_M: f32 = 0.005;

/// Maps the vertices of a mirrored garment to the garment's own surface. Returns none for a garment
/// that is not symmetric.
pub fn mirrored_surface(rest: &TriMesh) -> Option<SurfaceMap> {
    let points: Vec<Vec3> = rest.vertices.iter().map(|v| mirrored(*v)).collect();
    let map = SurfaceMap::new(rest, &points).ok()?;
    let total: f32 = map.distances().sum();
    (total <= SYMMETRIC_M * points.len() as f32).then_some(map)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;
    use unic_core::{
        motion::{MotionInput, MotionLayout, MotionSpec, MotionState, Spring, SpringDamping, VelocityScheme},
        skeleton::{Pose, SkeletonParts},
    };

    /// A symmetric stick figure with two legs and two arms.
    fn figure() -> Skeleton {
        let names = ["pelvis", "L_leg", "R_leg", "spine", "L_arm", "R_arm"];
        Skeleton::new(SkeletonParts {
            names: names.map(String::from).to_vec(),
            parents: vec![-1, 0, 0, 0, 3, 3],
            joints: vec![
                Vec3::new(0.0, 1.0, 0.0),
                Vec3::new(0.1, 0.5, 0.02),
                Vec3::new(-0.1, 0.5, 0.02),
                Vec3::new(0.0, 1.4, 0.0),
                Vec3::new(0.4, 1.4, 0.1),
                Vec3::new(-0.4, 1.4, 0.1),
            ],
            rest_pose: vec![],
        })
        .unwrap()
    }

    fn mirrored_pose(pose: &Pose) -> Pose {
        let swap = [0, 2, 1, 3, 5, 4];
        let flip = |q: Quat| Quat::from_xyzw(q.x, -q.y, -q.z, q.w);
        Pose {
            trans: mirrored(pose.trans),
            local: swap.map(|j| flip(pose.local[j])).to_vec(),
        }
    }

    /// A spring of every joint, the right side first.
    fn springs() -> JointSprings {
        JointSprings {
            joints: vec![0, 2, 1, 3, 5, 4],
            springs: [0.7, 2.0]
                .map(|frequency_hz| Spring {
                    frequency_hz,
                    damping_ratio: 0.3,
                    damping: SpringDamping::Air,
                })
                .to_vec(),
        }
    }

    fn vectors(layout: MotionLayout, poses: &[Pose]) -> Vec<Vec<f32>> {
        let spec = MotionSpec {
            layout,
            velocity: VelocityScheme::Backward,
            contact_joints: [1, 1, 2, 2],
            contact_rest_heights_m: [0.0; 4],
            springs: springs(),
        };
        let skeleton = figure();
        let input = |pose| MotionInput {
            pose,
            next_pose: None,
            ground_height: 0.45,
            dt: 1.0 / 30.0,
            wind: Vec3::ZERO,
        };
        let mut state = MotionState::start(&spec, &skeleton, &input(&poses[0]));
        (poses[1..].iter())
            .map(|pose| {
                state.advance(&spec, &skeleton, &input(pose));
                state.pair().1.to_vec()
            })
            .collect()
    }

    #[test]
    fn mirrored_vector_equals_the_vector_of_the_mirrored_motion() {
        let pose = |t: f32| Pose {
            trans: Vec3::new(t, 0.1 * t.sin(), 2.0 * t),
            local: (0..6)
                .map(|j| Quat::from_scaled_axis(Vec3::new(0.3, 1.1, -0.7) * (t + j as f32).sin()))
                .collect(),
        };
        let poses: Vec<Pose> = (0..5).map(|f| pose(f as f32 / 7.0)).collect();
        let other: Vec<Pose> = poses.iter().map(mirrored_pose).collect();
        let map = MirrorMap::new(&springs(), &figure()).unwrap();
        for layout in [
            MotionLayout::Heading,
            MotionLayout::Paper,
            MotionLayout::PaperRootRelative,
        ] {
            for (a, b) in vectors(layout, &poses).iter().zip(vectors(layout, &other)) {
                for (i, (a, b)) in map.apply(a).iter().zip(&b).enumerate() {
                    assert!((a - b).abs() < 2e-4, "{layout:?} number {i}: {a} {b}");
                }
            }
        }
    }
}
