//! A rig for a body of which only the animated surface is known.
//!
//! Simulators take bodies as vertex caches, without joints. The joints come from the file of the
//! motion that moved the body. Rest shape and skinning weights are fitted, so that linear blend
//! skinning reproduces the sampled frames x(v, t):
//!
//! min Σ ‖Σⱼ wⱼ(v) (Rⱼ(t) r(v) + qⱼ(t)) − x(v, t)‖², with wⱼ ≥ 0 and Σⱼ wⱼ = 1
//!
//! (Rⱼ, qⱼ) is `world_from_rest` of joint j, which the motion states. Weights w, rest shape r and
//! what the motion leaves open are fitted in turn, as in Le and Deng 2012, "Smooth Skinning
//! Decomposition with Rigid Bones", where the bones are unknown too. BVH leaves the unit of length
//! open, rotations in SMPL's order leave the places of the joints open.
//!
//! The rest pose is that of the motion file: the bind pose of a rig, the zero pose of a BVH file,
//! SMPL's T-pose.

mod body_file;
mod joints;
mod linear;
mod motion_skeleton;
mod rest;
mod weights;

#[cfg(test)]
mod tests;

pub use body_file::UnriggedBody;
pub use motion_skeleton::MotionSkeleton;

use crate::error::{Error, Result};
use glam::Vec3;
use joints::{Sampled, Unknown};
use std::path::Path;
use unic_core::{
    character::Character,
    mesh::TriMesh,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
    transform::Rigid,
};

/// Number of rounds of weights and rest shape.
pub const ROUNDS: usize = 8;
/// Number of rounds of weights, rest shape and joints. Weights and rest shape absorb a part of
/// a wrong unit, so that its error falls slowly.
const ROUNDS_OF_JOINTS: usize = 20;
/// Number of vertices that joints are placed by.
const SAMPLED_VERTICES: usize = 400;
/// Largest number of joints a vertex, as many as engines skin with.
const MAX_JOINTS: usize = 8;
/// Smallest weight that is kept.
const MIN_WEIGHT: f32 = 1e-3;
/// RMS distance above which the motion is not that of the body, metres.
pub const MAX_RMS_M: f32 = 0.05;

/// A frame of a body's animation.
#[derive(Clone, Debug)]
pub struct BodyFrame {
    /// Time from the start of the motion, seconds.
    pub seconds: f64,
    /// Positions, metres, Y up.
    pub vertices: Vec<Vec3>,
}

/// A character whose skinning reproduces an animated body.
#[derive(Clone, Debug)]
pub struct FittedRig {
    /// Body in the rest pose of the motion file, joints and skinning weights.
    pub character: Character,
    /// RMS distance of the skinned vertices from the given ones, metres.
    pub rms_m: f32,
    /// Largest distance, metres.
    pub largest_m: f32,
}

/// Fits a rig to frames of a body with the triangles `faces`. `path` is the body's file, for errors.
///
/// The work grows with frames times vertices; some sixty frames of different poses are enough.
/// `progress` gets the number of finished rounds, of [`ROUNDS`], and may end the fit with an error.
///
/// # Errors
/// Fewer than two frames, frames of different numbers of vertices, a mesh or skeleton with faults, a
/// motion that does not move the body; an error of `progress`.
pub fn fit_rig<E: From<Error>>(
    path: &Path,
    faces: &[[u32; 3]],
    frames: &[BodyFrame],
    motion: &MotionSkeleton,
    mut progress: impl FnMut(usize) -> std::result::Result<(), E>,
) -> std::result::Result<FittedRig, E> {
    check_frames(path, frames)?;
    progress(0)?;
    let mut fit = Fit::new(motion, frames);
    if motion.unknown != Unknown::Nothing {
        fit.place_joints(path, &strided(frames), &mut || progress(0))?;
    }
    let positions: Vec<&[Vec3]> = frames.iter().map(|frame| frame.vertices.as_slice()).collect();
    let mut round = fit.round(path, &positions, None)?;
    for done in 1..ROUNDS {
        progress(done)?;
        round = fit.round(path, &positions, Some(&round.rest))?;
    }
    progress(ROUNDS)?;
    Ok(fit.judged(path, faces, &positions, round)?)
}

fn check_frames(path: &Path, frames: &[BodyFrame]) -> Result<()> {
    if frames.len() < 2 {
        let expected = "at least two frames of the body during the motion";
        return Err(Error::content(path, expected, frames.len().to_string()));
    }
    let count = frames[0].vertices.len();
    let Some(other) = frames.iter().find(|frame| frame.vertices.len() != count) else {
        return Ok(());
    };
    let expected = format!("{count} vertices of the body in every frame");
    Err(Error::content(path, expected, other.vertices.len().to_string()))
}

/// Vertices at equal distances in the order of the file, in every frame.
fn strided(frames: &[BodyFrame]) -> Vec<Vec<Vec3>> {
    let stride = |count: usize| count.div_ceil(SAMPLED_VERTICES).max(1);
    let frame = |frame: &BodyFrame| {
        let vertices = frame.vertices.iter().step_by(stride(frame.vertices.len()));
        vertices.copied().collect()
    };
    frames.iter().map(frame).collect()
}

/// Weights and rest shape of one round, with the transforms that they are fitted to.
struct Round {
    /// `world_from_rest` of each joint in each frame.
    transforms: Vec<Vec<Rigid>>,
    weights: SkinningWeights,
    rest: Vec<Vec3>,
}

/// Joints of the motion in the sampled frames, with what has been found about their places.
struct Fit<'a> {
    motion: &'a MotionSkeleton,
    /// Rotation from the rest pose and position of each joint in each frame, in the motion's own unit.
    frames: Vec<Vec<Rigid>>,
    /// Joints in the rest pose, metres.
    joints: Vec<Vec3>,
    /// Joints of a usual body of this height, metres.
    usual: Vec<Vec3>,
    /// Metres in a unit of the root's movement.
    unit: f32,
}

impl<'a> Fit<'a> {
    fn new(motion: &'a MotionSkeleton, frames: &[BodyFrame]) -> Self {
        let sampled: Vec<Vec<Rigid>> = frames.iter().map(|frame| motion.at(frame.seconds)).collect();
        let size = motion.size_for(&frames[0].vertices, &sampled[0]);
        let (size, unit) = match motion.unknown {
            Unknown::Nothing => (1.0, 1.0),
            Unknown::Unit => (size, size),
            Unknown::Joints => (size, 1.0),
        };
        let mut joints: Vec<Vec3> = motion.joints.iter().map(|joint| size * *joint).collect();
        if motion.unknown == Unknown::Joints {
            // Translations are relative to a place of the root that the file does not state.
            let far = motion.root_turn.inverse() * middle_from(&frames[0].vertices, &sampled[0]);
            joints.iter_mut().for_each(|joint| *joint += far);
        }
        Self {
            motion,
            frames: sampled,
            usual: joints.clone(),
            joints,
            unit,
        }
    }

    /// Fits weights and rest shape to the joints as they are.
    fn round(&self, path: &Path, positions: &[&[Vec3]], rest: Option<&[Vec3]>) -> Result<Round> {
        let transforms = self.transforms();
        let weights = self.weights(path, positions, rest, &transforms)?;
        Ok(Round {
            rest: rest::fit(positions, &transforms, &weights),
            transforms,
            weights,
        })
    }

    /// `world_from_rest` of each joint in each frame: rotations of the motion, rigid bones.
    fn transforms(&self) -> Vec<Vec<Rigid>> {
        let root = self.motion.root;
        let frame = |world: &Vec<Rigid>| {
            let mut out = world.clone();
            // Movement of the root from its rest place, wherever that is.
            let turn = self.motion.root_turn;
            let moved = self.unit * (world[root].translation - turn * self.motion.joints[root]);
            let place = self.joints[root];
            out[root].translation = moved + turn * place - out[root].vector(place);
            for &(joint, parent) in &self.motion.parents_first {
                let place = self.joints[joint];
                out[joint].translation = out[parent].point(place) - out[joint].vector(place);
            }
            out
        };
        self.frames.iter().map(frame).collect()
    }

    /// Fits the weights of all vertices, to the rest shape if one is known.
    fn weights(
        &self,
        path: &Path,
        frames: &[&[Vec3]],
        rest: Option<&[Vec3]>,
        transforms: &[Vec<Rigid>],
    ) -> Result<SkinningWeights> {
        let bones: Vec<Vec<[Vec3; 2]>> = self.bones(&transforms[0]);
        let (mut positions, mut distances) = (Vec::new(), Vec::new());
        let row = |vertex: usize| {
            positions.clear();
            positions.extend(frames.iter().map(|frame| frame[vertex]));
            distances.clear();
            distances.extend(bones.iter().map(|bones| weights::distance(positions[0], bones)));
            let predicted = weights::prediction(positions[0], rest.map(|rest| rest[vertex]), transforms);
            weights::fit_vertex(&positions, predicted, &distances).into_iter()
        };
        let rows = (0..frames[0].len()).map(row);
        let fitted = SkinningWeights::from_rows(self.joints.len(), rows);
        let fitted = fitted.map_err(|source| Error::Weights {
            path: path.to_path_buf(),
            source,
        })?;
        Ok(fitted.pruned(MAX_JOINTS, MIN_WEIGHT))
    }

    /// Segments from each joint to its children in a frame.
    fn bones(&self, world_from_rest: &[Rigid]) -> Vec<Vec<[Vec3; 2]>> {
        let place = |joint: usize| world_from_rest[joint].point(self.joints[joint]);
        let mut bones = vec![Vec::new(); self.joints.len()];
        for &(joint, parent) in &self.motion.parents_first {
            bones[parent].push([place(parent), place(joint)]);
        }
        for (joint, bones) in bones.iter_mut().enumerate() {
            if bones.is_empty() {
                bones.push([place(joint); 2]);
            }
        }
        bones
    }

    /// Fits what the motion leaves open, to some vertices of the body.
    /// `check` may end the fit before each round.
    fn place_joints<E: From<Error>>(
        &mut self,
        path: &Path,
        frames: &[Vec<Vec3>],
        check: &mut dyn FnMut() -> std::result::Result<(), E>,
    ) -> std::result::Result<(), E> {
        let positions: Vec<&[Vec3]> = frames.iter().map(Vec::as_slice).collect();
        let mut round = self.round(path, &positions, None)?;
        for _ in 0..ROUNDS_OF_JOINTS {
            check()?;
            let sampled = Sampled {
                positions: &positions,
                transforms: &round.transforms,
                weights: &round.weights,
            };
            if self.motion.unknown == Unknown::Unit {
                let factor = joints::fit_scale(&sampled);
                self.unit *= factor;
                self.joints.iter_mut().for_each(|joint| *joint *= factor);
            } else {
                self.joints = joints::fit_joints(&sampled, self.motion, &self.joints, &self.usual);
            }
            round = self.round(path, &positions, Some(&round.rest))?;
        }
        Ok(())
    }

    /// Makes the character and measures it against the frames.
    ///
    /// # Errors
    /// A mesh or skeleton with faults, a body that is elsewhere.
    fn judged(
        &self,
        path: &Path,
        faces: &[[u32; 3]],
        positions: &[&[Vec3]],
        round: Round,
    ) -> Result<FittedRig> {
        let (rms_m, largest_m) = distances(&round, positions);
        if rms_m.is_nan() || rms_m >= MAX_RMS_M {
            let expected = "a body that the joints of the motion move (both from one scene, with one start, \
                            one up axis and one unit)";
            let found = format!("one that is {rms_m:.2} m off (RMS)");
            return Err(Error::content(path, expected, found));
        }
        let motion = self.motion;
        let parents = motion.parents.iter();
        let skeleton = Skeleton::new(SkeletonParts {
            names: motion.names.clone(),
            parents: parents
                .map(|parent| parent.map_or(-1, |joint| joint as i64))
                .collect(),
            joints: self.joints.clone(),
            rest_pose: Vec::new(),
        });
        let skeleton = skeleton.map_err(|source| Error::Skeleton {
            path: motion.path.clone(),
            source,
        })?;
        let body = TriMesh::new(round.rest, faces.to_vec()).map_err(|source| Error::Mesh {
            path: path.to_path_buf(),
            source,
        })?;
        Ok(FittedRig {
            character: Character {
                body,
                skeleton,
                weights: round.weights,
                file_mesh: None,
            },
            rms_m,
            largest_m,
        })
    }
}

/// Vector from the middle of some joints to that of a body.
fn middle_from(body: &[Vec3], joints: &[Rigid]) -> Vec3 {
    let middle = |places: &mut dyn Iterator<Item = Vec3>| {
        let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = places.fold(empty, |(low, high), place| (low.min(place), high.max(place)));
        0.5 * (low + high)
    };
    middle(&mut body.iter().copied()) - middle(&mut joints.iter().map(|joint| joint.translation))
}

/// RMS and largest distance of the skinned vertices from the given ones, metres.
fn distances(round: &Round, positions: &[&[Vec3]]) -> (f32, f32) {
    let (mut sum, mut largest, mut skinned) = (0.0f64, 0.0f32, Vec::new());
    for (frame, world_from_rest) in positions.iter().zip(&round.transforms) {
        round.weights.skin(&round.rest, world_from_rest, &mut skinned);
        for (a, b) in skinned.iter().zip(*frame) {
            let far = a.distance(*b);
            sum += f64::from(far * far);
            largest = largest.max(far);
        }
    }
    let count = positions.len() * round.rest.len();
    ((sum / count.max(1) as f64).sqrt() as f32, largest)
}
