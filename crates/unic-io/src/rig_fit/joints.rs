//! Linear least squares for the places of joints that a motion file leaves open.
//!
//! With rigid bones the translation of joint j is linear in the joints' rest places J:
//! qⱼ = q_root + Σ (R_parent(k) − Rₖ) Jₖ over the joints k from the root's child to j, and
//! q_root = moved + (U − R_root) J_root with the root's movement from its rest place and the rotation U
//! from the file's axes. So positions are linear in J, or in one factor of all lengths.

use super::{
    linear::solve,
    motion_skeleton::MotionSkeleton,
    rest::{blended, inverted},
};
use glam::{DMat3, DVec3, Mat3, Quat, Vec3};
use unic_core::{skinning::SkinningWeights, transform::Rigid};

/// Pull of each bone to the usual one, as the weight of its squared change beside the mean squared error
/// of a vertex. Joints that hardly turn, and places along the only axis of a hinge, are not determined.
const PULL: f64 = 3e-3;
/// Pull of the root's place and of the unit of length, which every frame determines.
const PULL_OF_ORIGIN: f64 = 1e-9;

/// Part of the joints' places that a motion file does not state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unknown {
    /// Places of all joints are stated, in metres.
    Nothing,
    /// Places are stated in an unknown unit.
    Unit,
    /// Rotations and the root's movement in metres alone are stated.
    Joints,
}

/// Frames, weights and transforms that unknowns are fitted to.
pub(super) struct Sampled<'a> {
    pub(super) positions: &'a [&'a [Vec3]],
    /// `world_from_rest` with the unknowns as they are.
    pub(super) transforms: &'a [Vec<Rigid>],
    pub(super) weights: &'a SkinningWeights,
}

/// Normal equations of some unknowns. The rest position of each vertex is eliminated.
struct Normal {
    matrix: Vec<f64>,
    right: Vec<f64>,
    rows: usize,
}

impl Normal {
    fn new(unknowns: usize) -> Self {
        Self {
            matrix: vec![0.0; unknowns * unknowns],
            right: vec![0.0; unknowns],
            rows: 0,
        }
    }

    /// Adds the equations of a vertex, x = A r + C θ + offset in each frame: (A, C, x − offset).
    fn add_vertex(&mut self, equations: &[(Mat3, Vec<Vec3>, Vec3)]) {
        let unknowns = self.right.len();
        let squares = equations.iter().map(|(linear, ..)| linear.as_dmat3());
        let own: DMat3 = squares.map(|linear| linear.transpose() * linear).sum();
        // A vertex whose rotations cancel tells nothing.
        let Some(inverse) = inverted(own) else { return };
        let mut mixed = vec![DVec3::ZERO; unknowns];
        let mut own_right = DVec3::ZERO;
        for (linear, columns, value) in equations {
            let transposed = linear.as_dmat3().transpose();
            own_right += transposed * value.as_dvec3();
            for (mixed, column) in mixed.iter_mut().zip(columns) {
                *mixed += transposed * column.as_dvec3();
            }
            for (i, column) in columns.iter().enumerate() {
                self.right[i] += f64::from(column.dot(*value));
                for (k, other) in columns.iter().enumerate().take(i + 1) {
                    self.matrix[i * unknowns + k] += f64::from(column.dot(*other));
                }
            }
        }
        // The rest position takes its share of every column.
        for (i, column) in mixed.iter().enumerate() {
            let solved = inverse * *column;
            self.right[i] -= solved.dot(own_right);
            for (k, other) in mixed.iter().enumerate().take(i + 1) {
                self.matrix[i * unknowns + k] -= solved.dot(*other);
            }
        }
        self.rows += equations.len();
    }

    /// Solves for the unknowns, with a pull to `usual`.
    fn solve(mut self, usual: &[f64], pulls: &[f64]) -> Vec<f64> {
        let unknowns = usual.len();
        for (i, (usual, pull)) in usual.iter().zip(pulls).enumerate() {
            let pull = pull * self.rows as f64;
            self.matrix[i * unknowns + i] += pull;
            self.right[i] += pull * usual;
            for k in 0..i {
                self.matrix[k * unknowns + i] = self.matrix[i * unknowns + k];
            }
        }
        solve(&mut self.matrix, &mut self.right);
        self.right
    }
}

/// Returns the factor by which all lengths of the motion are to be multiplied.
pub(super) fn fit_scale(sampled: &Sampled<'_>) -> f32 {
    let mut normal = Normal::new(1);
    for vertex in 0..sampled.weights.len() {
        let equations = frames(sampled, vertex, |linear, offset, _, position| {
            (linear, vec![offset], position)
        });
        normal.add_vertex(&equations);
    }
    {
        let factor = normal.solve(&[1.0], &[PULL_OF_ORIGIN])[0] as f32;
        if factor.is_finite() && factor > 0.0 {
            factor
        } else {
            1.0
        }
    }
}

/// Returns the places of the joints in the rest pose, near `usual` where the motion does not tell.
pub(super) fn fit_joints(
    sampled: &Sampled<'_>,
    motion: &MotionSkeleton,
    joints: &[Vec3],
    usual: &[Vec3],
) -> Vec<Vec3> {
    let numbers = |joints: &[Vec3]| -> Vec<f64> {
        let numbers = joints.iter().flat_map(|joint| joint.to_array());
        numbers.map(f64::from).collect()
    };
    let bones = |places: &[Vec3]| -> Vec<Vec3> {
        let of = |joint: usize| places[joint] - motion.parents[joint].map_or(Vec3::ZERO, |p| places[p]);
        (0..places.len()).map(of).collect()
    };
    let before = numbers(&bones(joints));
    let mut normal = Normal::new(before.len());
    let mut below = vec![0.0; joints.len()];
    for vertex in 0..sampled.weights.len() {
        weights_below(motion, sampled.weights, vertex, &mut below);
        let equations = frames(sampled, vertex, |linear, offset, transforms, position| {
            let columns = columns(motion, &below, transforms);
            let known: Vec3 = (columns.iter().zip(&before))
                .map(|(column, place)| *column * *place as f32)
                .sum();
            // What the joints' places do not explain is the root's movement.
            (linear, columns, position - (offset - known))
        });
        normal.add_vertex(&equations);
    }
    let mut pulls = vec![PULL; before.len()];
    // Every frame tells where the root is: translations are relative to its place, which is not usual.
    pulls[3 * motion.root..3 * motion.root + 3].fill(PULL_OF_ORIGIN);
    let solved = normal.solve(&numbers(&bones(usual)), &pulls);
    let mut places: Vec<Vec3> = (solved.chunks_exact(3))
        .map(|place| DVec3::from_slice(place).as_vec3())
        .collect();
    for &(joint, parent) in &motion.parents_first {
        let origin = places[parent];
        places[joint] += origin;
    }
    places
}

/// Makes an equation for each frame of a vertex from its map, its offset and its position.
fn frames<E>(
    sampled: &Sampled<'_>,
    vertex: usize,
    equation: impl Fn(Mat3, Vec3, &[Rigid], Vec3) -> E,
) -> Vec<E> {
    let frames = sampled.positions.iter().zip(sampled.transforms);
    let one = |(frame, transforms): (&&[Vec3], &Vec<Rigid>)| {
        let (linear, offset) = blended(sampled.weights, vertex, transforms);
        equation(linear, offset, transforms, frame[vertex])
    };
    frames.map(one).collect()
}

/// Sum of the weights of each joint and all joints below it.
fn weights_below(motion: &MotionSkeleton, weights: &SkinningWeights, vertex: usize, below: &mut [f32]) {
    below.fill(0.0);
    weights
        .row(vertex)
        .for_each(|(joint, weight)| below[joint] += weight);
    for &(joint, parent) in motion.parents_first.iter().rev() {
        below[parent] += below[joint];
    }
}

/// Effect of the bone that leads to each joint on the position of a vertex: that of the joint's place and
/// of all places below it.
fn columns(motion: &MotionSkeleton, below: &[f32], transforms: &[Rigid]) -> Vec<Vec3> {
    let mut columns = vec![Vec3::ZERO; 3 * below.len()];
    let mut set = |joint: usize, above: Quat| {
        let rotation = Mat3::from_quat(transforms[joint].rotation);
        let effect = (Mat3::from_quat(above) - rotation) * below[joint];
        columns[3 * joint..3 * joint + 3].copy_from_slice(&[effect.x_axis, effect.y_axis, effect.z_axis]);
    };
    set(motion.root, motion.root_turn);
    for &(joint, parent) in &motion.parents_first {
        set(joint, transforms[parent].rotation);
    }
    for &(joint, parent) in motion.parents_first.iter().rev() {
        for axis in 0..3 {
            let effect = columns[3 * joint + axis];
            columns[3 * parent + axis] += effect;
        }
    }
    columns
}
