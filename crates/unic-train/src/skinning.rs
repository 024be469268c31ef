//! Skinning weights of a garment, fitted to its captured motion.
//!
//! A garment seldom comes with weights of its own. Those of the nearest body vertices make a sleeve
//! follow the arm, where cloth hangs from the shoulder and the arm slides through it. A prior that is
//! linear in the motion cannot undo that in poses that it has not seen. So weights w and a shape p are
//! fitted together, vertex by vertex: the least squares of Σ_j w_j T_j(p) − x over the frames, with
//! T_j = `world_from_rest` of a joint and x the captured position. Skinning decompositions do the same
//! with bones of their own (Kavan, Sloan & O'Sullivan 2010, *Fast and Efficient Skinning of Animated
//! Meshes*).
//!
//! Squares of the error need no frame again once their sums are known: 4 × 4 matrices Σ T_jᵀ T_k of two
//! joints, which all vertices share, and vectors Σ T_jᵀ x of a vertex and a joint. Positions are
//! relative to the root joint, which changes no error as weights sum to 1. The model turns displacements
//! by blended quaternions and skins the rest shape, so the minimum is nearly that of its prior.

mod simplex;

use crate::mirror::mirrored_surface;
use glam::{DMat3, DMat4, DQuat, DVec3, DVec4};
use rayon::prelude::*;
use simplex::SimplexProblem;
use std::collections::BTreeMap;
use unic_core::{
    character::{Character, Garment},
    intersection::MIN_CARRYING_WEIGHT,
    skinning::SkinningWeights,
    surface_map::SurfaceMapError,
    weights::{sewn_weights, with_diffused_change},
};
use unic_eval::PreparedClip;
use unic_io::joint_names::counterparts;

/// Error, RMS in metres, that justifies a change of one vertex's weights by a norm of 1.
///
/// Weights of joints that have not moved against each other are not determined, and stay as they are.
/// Between 0.005 and 0.016 the error on motions left out changes by less than half a percent.
const WEIGHT_CHANGE_M: f64 = 0.01;

/// Generations of ancestors that a vertex may be bound to, beside the joints of its given weights.
const GENERATIONS: usize = 2;

/// Number of fits of the shape, each followed by one of the weights.
const ROUNDS: usize = 8;

/// Largest number of frames that are summed, at even distances over all clips. Frames that follow
/// each other say nearly the same.
const FRAMES: usize = 4096;

/// Number of vertices that are fitted together, whose positions lie side by side in a frame.
const BLOCK: usize = 256;

/// Largest number of joints of a vertex, before and after the fit. Ancestors do not count before it.
const MOST_JOINTS: usize = 8;

/// Length over which the change of the weights is smoothed, metres.
///
/// The vertices are fitted one by one. Where two joints move nearly alike, or a joint is among those of
/// one vertex and not of the next, the weights jump from one to the other, and the cloth has a crease.
const SMOOTHING_LENGTH_M: f32 = 0.03;

/// Smaller weights are left out: they move a vertex by less than a millimetre.
const LEAST_WEIGHT: f32 = 1e-3;

/// Fits skinning weights of the garment to what the clips show, and smooths the change over the garment.
/// The former ones become its carriers.
///
/// Where the mask is below 1, the former weights keep their share. Weights of a symmetric garment
/// are made symmetric where `mirror` asks for it.
///
/// # Errors
/// None for clips of this character and garment.
pub(crate) fn bind_to_motion(
    character: &Character,
    garment: &mut Garment,
    clips: &[PreparedClip],
    mirror: bool,
) -> Result<(), SurfaceMapError> {
    let given = garment.carriers().clone();
    let joints = JointFrames::new(character, clips);
    let vertices: Vec<usize> = (0..given.len()).collect();
    let fit = |block: &[usize]| joints.fit_block(character, garment, clips, block);
    let rows: Vec<Vec<Vec<(usize, f32)>>> = vertices.par_chunks(BLOCK).map(fit).collect();
    let rows = rows.into_iter().flatten().map(Vec::into_iter);
    let fitted = SkinningWeights::from_rows(character.skeleton.len(), rows)?;
    let mut weights = with_diffused_change(&given, &fitted, &garment.rest, SMOOTHING_LENGTH_M)?;
    if mirror && let Some(other) = mirror_image(character, garment, &weights)? {
        weights = weights.blended(&other, |_| 0.5)?;
    }
    let weights = weights.pruned(MOST_JOINTS, LEAST_WEIGHT);
    let weights = given.blended(&weights, |vertex| garment.share(vertex))?;
    garment.weights = sewn_weights(&weights, &garment.rest.vertices)?;
    garment.carriers = Some(given);
    Ok(())
}

/// Weights of the other side for a symmetric garment on a skeleton whose joints name their sides, none
/// for others.
fn mirror_image(
    character: &Character,
    garment: &Garment,
    weights: &SkinningWeights,
) -> Result<Option<SkinningWeights>, SurfaceMapError> {
    let counterparts = counterparts(character.skeleton.names());
    let (Some(other_side), Some(map)) = (counterparts, mirrored_surface(&garment.rest)) else {
        return Ok(None);
    };
    let there = map.interpolate_weights(weights)?;
    let row = |vertex: usize| there.row(vertex).map(|(joint, w)| (other_side[joint], w));
    let rows = (0..there.len()).map(row);
    Ok(Some(SkinningWeights::from_rows(weights.joint_count(), rows)?))
}

/// Joints in the frames that are summed.
struct JointFrames {
    /// Clip and frame of each frame that is summed.
    frames: Vec<(usize, usize)>,
    /// Place of the root joint in each frame, metres.
    roots: Vec<DVec3>,
    /// Transforms of all joints from points relative to the root joint in the rest pose to points
    /// relative to it in the frame, frames × J.
    posed: Vec<DMat4>,
    /// Root joint in the rest pose.
    centre: DVec3,
    joint_count: usize,
    /// Σ T_jᵀ T_k over the frames, J × J.
    products: Vec<DMat4>,
    /// Whether a joint moves any vertex of the body. Joints that do not, such as one on the ground
    /// between the feet, may be anywhere.
    deforms: Vec<bool>,
}

impl JointFrames {
    fn new(character: &Character, clips: &[PreparedClip]) -> Self {
        let skeleton = &character.skeleton;
        let (joint_count, root) = (skeleton.len(), skeleton.root());
        let all = clips.iter().enumerate();
        let all = all.flat_map(|(number, clip)| (0..clip.len()).map(move |frame| (number, frame)));
        let step = all.clone().count().div_ceil(FRAMES).max(1);
        let frames: Vec<(usize, usize)> = all.step_by(step).collect();
        let centre = skeleton.joints()[root].as_dvec3();
        let (mut roots, mut posed) = (Vec::new(), Vec::new());
        for &(clip, frame) in &frames {
            let world_from_rest = clips[clip].kinematics.world_from_rest(frame);
            let place = world_from_rest[root].point(skeleton.joints()[root]).as_dvec3();
            roots.push(place);
            posed.extend(world_from_rest.iter().map(|joint| {
                let rotation: DQuat = joint.rotation.as_dquat();
                let translation = joint.translation.as_dvec3() + rotation * centre - place;
                DMat4::from_rotation_translation(rotation, translation)
            }));
        }
        let mut deforms = vec![false; joint_count];
        let rows = (0..character.weights.len()).flat_map(|vertex| character.weights.row(vertex));
        rows.for_each(|(joint, _)| deforms[joint] = true);
        let mut joints = Self {
            frames,
            roots,
            posed,
            centre,
            joint_count,
            products: Vec::new(),
            deforms,
        };
        // Half of the pairs, because T_kᵀ T_j is the transpose of T_jᵀ T_k.
        let upper: Vec<Vec<DMat4>> = (0..joint_count)
            .into_par_iter()
            .map(|j| (j..joint_count).map(|k| joints.product(j, k)).collect())
            .collect();
        let product = |j: usize, k: usize| match j <= k {
            true => upper[j][k - j],
            false => upper[k][j - k].transpose(),
        };
        joints.products = (0..joint_count * joint_count)
            .map(|pair| product(pair / joint_count, pair % joint_count))
            .collect();
        joints
    }

    /// Σ T_jᵀ T_k, of which the last row and column are sums of positions.
    fn product(&self, j: usize, k: usize) -> DMat4 {
        let frames = self.posed.chunks_exact(self.joint_count);
        let sum = frames.map(|posed| affine_product(&posed[j], &posed[k]));
        sum.fold(DMat4::ZERO, |sum, product| sum + product)
    }

    /// Fits neighbouring vertices: their rows of (joint, weight).
    fn fit_block(
        &self,
        character: &Character,
        garment: &Garment,
        clips: &[PreparedClip],
        vertices: &[usize],
    ) -> Vec<Vec<(usize, f32)>> {
        let binding = |vertex: &usize| self.binding(character, garment.carriers(), *vertex);
        let mut bindings: Vec<Binding> = vertices.iter().map(binding).collect();
        for (index, &(clip, frame)) in self.frames.iter().enumerate() {
            let posed = &self.posed[index * self.joint_count..];
            let positions = clips[clip].captured.garment.frame(frame);
            for (&vertex, binding) in vertices.iter().zip(&mut bindings) {
                binding.add_frame(posed, positions[vertex].as_dvec3() - self.roots[index]);
            }
        }
        let fitted = vertices.iter().zip(&bindings);
        fitted
            .map(|(&vertex, binding)| self.fit(garment, vertex, binding))
            .collect()
    }

    /// Joints that a vertex may be bound to: its heaviest ones, and ancestors that move the body.
    /// Without joints of little weight the error on motions left out grows by up to 1.4 %.
    fn binding(&self, character: &Character, weights: &SkinningWeights, vertex: usize) -> Binding {
        let parents = character.skeleton.parents();
        let kept = || weights.row(vertex).take(MOST_JOINTS);
        let sum: f64 = kept().map(|(_, w)| f64::from(w)).sum();
        let mut given: BTreeMap<usize, f64> = kept().map(|(joint, w)| (joint, f64::from(w) / sum)).collect();
        for (joint, _) in kept().filter(|(_, w)| *w >= MIN_CARRYING_WEIGHT) {
            let ancestors = std::iter::successors(parents[joint], |above| parents[*above]);
            let moving = ancestors.filter(|above| self.deforms[*above]);
            moving.take(GENERATIONS).for_each(|above| {
                given.entry(above).or_insert(0.0);
            });
        }
        let (joints, given): (Vec<usize>, Vec<f64>) = given.into_iter().unzip();
        Binding {
            moments: vec![DVec4::ZERO; joints.len()],
            joints,
            given,
        }
    }

    /// Fits one vertex: its row of (joint, weight).
    fn fit(&self, garment: &Garment, vertex: usize, binding: &Binding) -> Vec<(usize, f32)> {
        if binding.joints.len() < 2 || self.frames.is_empty() {
            return garment.carriers().row(vertex).collect();
        }
        let Binding {
            joints,
            given,
            moments,
        } = binding;
        let rest = garment.rest.vertices[vertex].as_dvec3() - self.centre;
        let mut weights = given.clone();
        for _ in 0..ROUNDS {
            let point = self.shape(binding, &weights, rest).extend(1.0);
            let square = |j: usize, k: usize| point.dot(self.products[j * self.joint_count + k] * point);
            let row = |&j: &usize| joints.iter().map(|&k| square(j, k)).collect();
            let problem = SimplexProblem {
                squares: joints.iter().map(row).collect(),
                targets: moments.iter().map(|moment| moment.dot(point)).collect(),
                given,
                stiffness: self.frames.len() as f64 * WEIGHT_CHANGE_M * WEIGHT_CHANGE_M,
            };
            problem.solve(&mut weights);
        }
        let row = joints.iter().copied().zip(weights.iter().map(|w| *w as f32));
        row.filter(|(_, w)| *w > 0.0).collect()
    }

    /// Shape of a vertex, relative to the root joint, with the least squares under given weights. A
    /// thousandth of the frames' weight holds it to the rest shape, for motion that leaves it open.
    fn shape(&self, binding: &Binding, weights: &[f64], rest: DVec3) -> DVec3 {
        let Binding { joints, moments, .. } = binding;
        let hold = 1e-3 * self.frames.len() as f64;
        let (mut normal, mut right) = (DMat3::from_diagonal(DVec3::splat(hold)), hold * rest);
        for (&j, (&w, moment)) in joints.iter().zip(weights.iter().zip(moments)) {
            right += w * moment.truncate();
            for (&k, &other) in joints.iter().zip(weights) {
                let product = &self.products[j * self.joint_count + k];
                normal += DMat3::from_mat4(*product) * (w * other);
                right -= product.w_axis.truncate() * (w * other);
            }
        }
        // The normal matrix is positive definite: at least `hold` times the identity.
        normal.inverse() * right
    }
}

/// Joints that a vertex may be bound to, and what the frames say of them.
struct Binding {
    /// Joints in ascending order.
    joints: Vec<usize>,
    /// Former weights, which sum to 1.
    given: Vec<f64>,
    /// Σ T_jᵀ x over the frames for each of them.
    moments: Vec<DVec4>,
}

impl Binding {
    /// Adds a frame with the transforms of all joints and the position x of the vertex.
    fn add_frame(&mut self, posed: &[DMat4], x: DVec3) {
        for (moment, &joint) in self.moments.iter_mut().zip(&self.joints) {
            let t = &posed[joint];
            let columns = [t.x_axis, t.y_axis, t.z_axis, t.w_axis];
            *moment += DVec4::from_array(columns.map(|column| column.truncate().dot(x)));
        }
    }
}

/// Tᵀ U of two affine transforms, as the 3 × 4 matrices of their upper rows.
fn affine_product(t: &DMat4, u: &DMat4) -> DMat4 {
    let rows = |m: &DMat4| [m.x_axis, m.y_axis, m.z_axis, m.w_axis].map(DVec4::truncate);
    let (t, u) = (rows(t), rows(u));
    DMat4::from_cols_array_2d(&u.map(|column| t.map(|row| row.dot(column))))
}
