//! Skinning weights and linear blend skinning.
//!
//! For tools that import characters, and for training.

use crate::transform::Rigid;
use glam::{Mat3A, Quat, Vec3, Vec3A};
use std::collections::BTreeMap;
use thiserror::Error;

/// Sparse skinning weights: for every vertex the joints that move it, with weights that sum to one.
///
/// The entries of a row are in descending order of weight. Joints without weight are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinningWeights {
    joint_count: usize,
    /// Starts of rows: the entries of vertex i are `starts[i]..starts[i + 1]`.
    starts: Vec<u32>,
    joints: Vec<u16>,
    weights: Vec<f32>,
}

/// Error of skinning weights that are not valid.
#[derive(Debug, Error, PartialEq)]
pub enum WeightsError {
    /// Array whose length is not vertices × joints.
    #[error("skinning weights: expected {expected} numbers (vertices x joints), found {found}")]
    Shape {
        /// Number of vertices times number of joints.
        expected: usize,
        /// Length of the array.
        found: usize,
    },
    /// Weight that is negative, NaN or infinite.
    #[error("skinning weights: weight {weight} of vertex {vertex} is negative or not finite")]
    Value {
        /// Index of the vertex.
        vertex: usize,
        /// Value of the weight.
        weight: f32,
    },
    /// Vertex that no joint moves.
    #[error("skinning weights: vertex {vertex} has no weight on any joint")]
    Empty {
        /// Index of the vertex.
        vertex: usize,
    },
    /// Joint index beyond the joints, or beyond u16.
    #[error("skinning weights: joint {joint} of vertex {vertex} is not among the {joints} joints")]
    Joint {
        /// Index of the vertex.
        vertex: usize,
        /// Index of the joint.
        joint: usize,
        /// Number of joints.
        joints: usize,
    },
}

impl SkinningWeights {
    /// Makes weights from a dense row-major array of vertices × joints. Rows are normalised to one.
    ///
    /// # Errors
    /// Fails on a wrong length, on weights that are negative or not finite, and on vertices without
    /// weight.
    pub fn from_dense(dense: &[f32], vertices: usize, joints: usize) -> Result<Self, WeightsError> {
        if vertices.checked_mul(joints) != Some(dense.len()) || joints == 0 {
            return Err(WeightsError::Shape {
                expected: vertices.saturating_mul(joints),
                found: dense.len(),
            });
        }
        let rows = dense.chunks_exact(joints);
        Self::from_rows(joints, rows.map(|row| row.iter().copied().enumerate()))
    }

    /// Makes weights from rows of (joint, weight). Rows are normalised to one; rows that are
    /// normalised already keep their bits.
    ///
    /// # Errors
    /// Fails on joints out of range, on weights that are negative or not finite, and on vertices
    /// without weight.
    pub fn from_rows<Row>(joint_count: usize, rows: impl Iterator<Item = Row>) -> Result<Self, WeightsError>
    where
        Row: Iterator<Item = (usize, f32)>,
    {
        let mut all = Self {
            joint_count,
            starts: vec![0],
            joints: Vec::new(),
            weights: Vec::new(),
        };
        let mut entries = Vec::new();
        for (vertex, row) in rows.enumerate() {
            entries.clear();
            for (joint, weight) in row {
                check_entry(vertex, joint, weight, joint_count)?;
                if weight > 0.0 {
                    entries.push((joint as u16, weight));
                }
            }
            all.push_row(vertex, &mut entries)?;
        }
        Ok(all)
    }

    /// Sorts, normalises and appends the row of the next vertex.
    fn push_row(&mut self, vertex: usize, row: &mut [(u16, f32)]) -> Result<(), WeightsError> {
        let sum: f32 = row.iter().map(|(_, w)| w).sum();
        if sum <= 0.0 || !sum.is_finite() {
            return Err(WeightsError::Empty { vertex });
        }
        row.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        // Rounding leaves the sum of a normalised row slightly off one. Dividing again would change
        // the row each time that it is written and read.
        let is_normalised = (sum - 1.0).abs() <= row.len() as f32 * f32::EPSILON;
        let scale = if is_normalised { 1.0 } else { sum };
        for &(joint, weight) in row.iter() {
            // A tiny weight beside a large one may underflow to zero.
            if weight / scale > 0.0 {
                self.joints.push(joint);
                self.weights.push(weight / scale);
            }
        }
        self.starts.push(self.joints.len() as u32);
        Ok(())
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of joints J that the rows refer to.
    pub fn joint_count(&self) -> usize {
        self.joint_count
    }

    /// Iterates over (joint, weight) of one vertex, in descending order of weight.
    pub fn row(&self, vertex: usize) -> impl ExactSizeIterator<Item = (usize, f32)> + Clone {
        let range = self.starts[vertex] as usize..self.starts[vertex + 1] as usize;
        (self.joints[range.clone()].iter().zip(&self.weights[range])).map(|(&j, &w)| (usize::from(j), w))
    }

    /// Expands the weights to a dense row-major array of vertices × joints, as files hold them.
    pub fn to_dense(&self) -> Vec<f32> {
        let mut dense = vec![0.0; self.len() * self.joint_count];
        for (vertex, row) in dense.chunks_exact_mut(self.joint_count).enumerate() {
            self.row(vertex).for_each(|(j, w)| row[j] += w);
        }
        dense
    }

    /// Returns the rows of the vertices that `vertices` names, bit for bit.
    ///
    /// # Panics
    /// If a vertex is beyond the last.
    pub fn gathered(&self, vertices: impl Iterator<Item = usize>) -> Self {
        let mut gathered = Self {
            joint_count: self.joint_count,
            starts: vec![0],
            joints: Vec::new(),
            weights: Vec::new(),
        };
        for vertex in vertices {
            let range = self.starts[vertex] as usize..self.starts[vertex + 1] as usize;
            gathered.joints.extend_from_slice(&self.joints[range.clone()]);
            gathered.weights.extend_from_slice(&self.weights[range]);
            gathered.starts.push(gathered.joints.len() as u32);
        }
        gathered
    }

    /// Returns weights with at most `count` joints a vertex and none below `min_weight`, normalised
    /// again. The heaviest joint of a vertex always stays.
    pub fn pruned(&self, count: usize, min_weight: f32) -> Self {
        let mut pruned = Self {
            joint_count: self.joint_count,
            starts: vec![0],
            joints: Vec::new(),
            weights: Vec::new(),
        };
        for vertex in 0..self.len() {
            let kept = (self.row(vertex).take(count.max(1)).enumerate())
                .take_while(|(rank, (_, w))| *rank == 0 || *w >= min_weight)
                .map(|(_, entry)| entry);
            let sum: f32 = kept.clone().map(|(_, w)| w).sum();
            for (joint, weight) in kept {
                pruned.joints.push(joint as u16);
                pruned.weights.push(weight / sum);
            }
            pruned.starts.push(pruned.joints.len() as u32);
        }
        pruned
    }

    /// Returns weights that pass to `other` by a share of each vertex, 0 to 1. Rows with a share of 0
    /// or 1 keep their bits.
    ///
    /// Linear blend skinning is linear in the weights: it puts a vertex between its two places.
    ///
    /// # Errors
    /// Fails where both rows of a vertex underflow to nothing, which finite weights do not.
    ///
    /// # Panics
    /// When `other` has fewer vertices.
    pub fn blended(&self, other: &Self, share: impl Fn(usize) -> f32) -> Result<Self, WeightsError> {
        let rows = (0..self.len()).map(|vertex| {
            let row: Vec<(usize, f32)> = match share(vertex) {
                0.0 => self.row(vertex).collect(),
                1.0 => other.row(vertex).collect(),
                share => {
                    // In the order of the joints.
                    let mut sums = BTreeMap::new();
                    for (weights, part) in [(self, 1.0 - share), (other, share)] {
                        let row = weights.row(vertex);
                        row.for_each(|(joint, w)| *sums.entry(joint).or_insert(0.0) += part * w);
                    }
                    sums.into_iter().collect()
                }
            };
            row.into_iter()
        });
        Self::from_rows(self.joint_count, rows)
    }

    /// Computes the position of one vertex by linear blend skinning: Σ_j w_j · world_from_rest_j
    /// (rest), metres.
    pub fn position(&self, vertex: usize, rest: Vec3, world_from_rest: &[Rigid]) -> Vec3 {
        (self.row(vertex))
            .map(|(j, w)| world_from_rest[j].point(rest) * w)
            .sum()
    }

    /// Computes the skinning rotation of one vertex: the normalised blend of its joints'
    /// quaternions.
    ///
    /// Each quaternion takes the sign that brings it to the hemisphere of the heaviest joint's.
    /// Unlike the blended matrix the result is a rotation in every pose, so a displacement in its
    /// frame has the same length in the world.
    pub fn rotation(&self, vertex: usize, world_from_rest: &[Rigid]) -> Quat {
        let mut row = self.row(vertex);
        let Some((first, weight)) = row.next() else {
            return Quat::IDENTITY;
        };
        let leading = world_from_rest[first].rotation;
        let sum = row.fold(leading * weight, |sum, (j, w)| {
            let q = world_from_rest[j].rotation;
            let sign = if q.dot(leading) < 0.0 { -w } else { w };
            sum + q * sign
        });
        // No division by zero: every term has a non-negative component along the leading
        // quaternion, and that one has the largest weight.
        sum.normalize()
    }

    /// Skins all vertices by linear blend skinning: `rest` in bind-pose space to `world`, metres.
    ///
    /// # Panics
    /// When the number of vertices in `rest` is not that of the weights.
    pub fn skin(&self, rest: &[Vec3], world_from_rest: &[Rigid], world: &mut Vec<Vec3>) {
        assert_eq!(rest.len(), self.len(), "vertices to skin");
        // A matrix rotates a point with fewer operations than a quaternion, and each joint moves
        // many. The result differs from `position` by rounding.
        let columns: Vec<(Mat3A, Vec3A)> = (world_from_rest.iter())
            .map(|t| (Mat3A::from_quat(t.rotation), t.translation.into()))
            .collect();
        world.clear();
        world.extend(rest.iter().enumerate().map(|(vertex, &point)| {
            let point = Vec3A::from(point);
            let blend = |sum, (j, w): (usize, f32)| sum + (columns[j].0 * point + columns[j].1) * w;
            Vec3::from(self.row(vertex).fold(Vec3A::ZERO, blend))
        }));
    }
}

fn check_entry(vertex: usize, joint: usize, weight: f32, joints: usize) -> Result<(), WeightsError> {
    if joint >= joints || joint > usize::from(u16::MAX) {
        return Err(WeightsError::Joint {
            vertex,
            joint,
            joints,
        });
    }
    if !weight.is_finite() || weight < 0.0 {
        return Err(WeightsError::Value { vertex, weight });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_joints() -> (SkinningWeights, Vec<Rigid>) {
        let weights = SkinningWeights::from_dense(&[1.0, 0.0, 0.5, 0.5, 1.0, 3.0], 3, 2).unwrap();
        let turn = Rigid::new(Quat::from_rotation_y(1.2), Vec3::new(0.1, 0.2, 0.3));
        (weights, vec![Rigid::IDENTITY, turn])
    }

    #[test]
    fn skinning_blends_positions_and_normalises_rows() {
        let (weights, transforms) = two_joints();
        let rest = [Vec3::X, Vec3::Y, Vec3::Z];
        let mut world = Vec::new();
        weights.skin(&rest, &transforms, &mut world);
        let turned = transforms[1].point(Vec3::Z);
        assert!((world[0] - Vec3::X).length() < 1e-6);
        assert!((world[2] - (Vec3::Z * 0.25 + turned * 0.75)).length() < 1e-6);
        for (v, position) in world.iter().enumerate() {
            assert!((weights.position(v, rest[v], &transforms) - *position).length() < 1e-6);
        }
    }

    #[test]
    fn the_blended_rotation_ignores_the_sign_of_quaternions() {
        let (weights, mut transforms) = two_joints();
        let before = weights.rotation(1, &transforms);
        transforms[1].rotation = -transforms[1].rotation;
        let after = weights.rotation(1, &transforms);
        assert!(before.dot(after).abs() > 1.0 - 1e-6);
        assert!((before.angle_between(Quat::IDENTITY) - 0.6).abs() < 1e-3);
    }

    #[test]
    fn dense_round_trip_and_pruning() {
        let (weights, _) = two_joints();
        assert_eq!(weights.to_dense(), [1.0, 0.0, 0.5, 0.5, 0.25, 0.75]);
        assert_eq!(weights.pruned(1, 0.0).to_dense(), [1.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        assert_eq!(weights.pruned(2, 0.3).to_dense()[4..], [0.0, 1.0]);
    }

    #[test]
    fn blended_weights_skin_a_vertex_between_both_places() {
        let (weights, transforms) = two_joints();
        let other = SkinningWeights::from_dense(&[0.0, 1.0, 0.9, 0.1, 0.5, 0.5], 3, 2).unwrap();
        let shares = [0.0, 1.0, 0.3];
        let blended = weights.blended(&other, |vertex| shares[vertex]).unwrap();
        assert!(blended.row(0).eq(weights.row(0)) && blended.row(1).eq(other.row(1)));
        let place = |weights: &SkinningWeights| weights.position(2, Vec3::ONE, &transforms);
        let expected = place(&weights).lerp(place(&other), 0.3);
        assert!(place(&blended).distance(expected) < 1e-6);
    }

    #[test]
    fn underflowing_weights_have_no_entry_and_a_joint_given_twice_is_summed() {
        let tiny = SkinningWeights::from_dense(&[1e20, 1e-30], 1, 2).unwrap();
        assert_eq!(tiny.row(0).collect::<Vec<_>>(), [(0, 1.0)]);
        let twice = [[(1, 1.0), (1, 1.0)].into_iter()].into_iter();
        let twice = SkinningWeights::from_rows(2, twice).unwrap();
        assert_eq!(twice.to_dense(), [0.0, 1.0]);
    }

    #[test]
    fn invalid_weights_are_refused() {
        let from = |dense: &[f32]| SkinningWeights::from_dense(dense, 1, 2);
        assert!(matches!(from(&[1.0]), Err(WeightsError::Shape { .. })));
        assert!(matches!(from(&[1.0, -0.1]), Err(WeightsError::Value { .. })));
        assert!(matches!(from(&[f32::NAN, 1.0]), Err(WeightsError::Value { .. })));
        assert_eq!(from(&[0.0, 0.0]), Err(WeightsError::Empty { vertex: 0 }));
    }
}
