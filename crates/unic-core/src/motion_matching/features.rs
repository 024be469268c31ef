//! Features: the numbers by which frames are compared.

use super::root::RootFrame;
use crate::leg::Leg;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Content of a feature group. Vectors are in the root frame of their frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Feature {
    /// Position of a joint, metres: 3 numbers.
    JointPosition(usize),
    /// Velocity of a joint, m/s, a backward difference of world positions: 3 numbers.
    JointVelocity(usize),
    /// Positions (x, z) of the root at these times from the frame on, seconds; negative in the
    /// past. Metres: 2 numbers a time.
    TrajectoryPositions(Vec<f32>),
    /// Directions (x, z) that the root faces at these times, unit vectors: 2 numbers a time.
    TrajectoryDirections(Vec<f32>),
}

/// Feature with its weight. All numbers of a group are scaled by one standard deviation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeatureGroup {
    /// Content.
    pub feature: Feature,
    /// Factor of the group's differences, in standard deviations. 0 leaves the group out.
    pub weight: f32,
}

/// Times of the standard trajectory, seconds.
const TRAJECTORY_S: [f32; 3] = [1.0 / 3.0, 2.0 / 3.0, 1.0];

impl Feature {
    /// Number of numbers.
    pub fn len(&self) -> usize {
        match self {
            Self::JointPosition(_) | Self::JointVelocity(_) => 3,
            Self::TrajectoryPositions(seconds) | Self::TrajectoryDirections(seconds) => 2 * seconds.len(),
        }
    }

    /// Returns whether there are no numbers.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Joint of the feature; none for the trajectory.
    pub fn joint(&self) -> Option<usize> {
        match self {
            Self::JointPosition(joint) | Self::JointVelocity(joint) => Some(*joint),
            Self::TrajectoryPositions(_) | Self::TrajectoryDirections(_) => None,
        }
    }

    /// Times of the feature, seconds; empty for joints.
    pub fn seconds(&self) -> &[f32] {
        match self {
            Self::JointPosition(_) | Self::JointVelocity(_) => &[],
            Self::TrajectoryPositions(seconds) | Self::TrajectoryDirections(seconds) => seconds,
        }
    }

    /// Writes the numbers of a trajectory whose root frames `at` gives by their time, as seen from
    /// `root`. Leaves features of joints alone.
    pub(super) fn write_trajectory(&self, root: &RootFrame, at: impl Fn(f32) -> RootFrame, out: &mut [f32]) {
        for (&seconds, out) in self.seconds().iter().zip(out.chunks_exact_mut(2)) {
            let local = root.local_of(&at(seconds));
            let vector = match self {
                Self::TrajectoryDirections(_) => local.direction(),
                _ => local.position,
            };
            out.copy_from_slice(&vector.to_array());
        }
    }

    /// Writes the numbers of a joint at `position` with `velocity`, both in the root frame. Leaves
    /// features of the trajectory alone.
    pub(super) fn write_joint(&self, position: Vec3, velocity: Vec3, out: &mut [f32]) {
        match self {
            Self::JointPosition(_) => out.copy_from_slice(&position.to_array()),
            Self::JointVelocity(_) => out.copy_from_slice(&velocity.to_array()),
            Self::TrajectoryPositions(_) | Self::TrajectoryDirections(_) => {}
        }
    }
}

/// Returns the standard groups: positions and velocities of both feet, velocity of the hip, and
/// the trajectory over the next second; 27 numbers.
///
/// The features are those of D. Holden's public demonstration. The weights were chosen on the
/// scripts of `unic bench control`.
pub fn standard_groups(legs: &[Leg; 2], root_joint: usize) -> Vec<FeatureGroup> {
    let group = |feature, weight| FeatureGroup { feature, weight };
    let [left, right] = legs.map(|leg| leg.ankle);
    vec![
        group(Feature::JointPosition(left), 0.6),
        group(Feature::JointPosition(right), 0.6),
        group(Feature::JointVelocity(left), 1.4),
        group(Feature::JointVelocity(right), 1.4),
        group(Feature::JointVelocity(root_joint), 0.6),
        group(Feature::TrajectoryPositions(TRAJECTORY_S.to_vec()), 1.45),
        group(Feature::TrajectoryDirections(TRAJECTORY_S.to_vec()), 1.8),
    ]
}

/// Number of numbers of all groups.
pub(super) fn feature_len(groups: &[FeatureGroup]) -> usize {
    groups.iter().map(|g| g.feature.len()).sum()
}

/// Mean of each number and scale of each group: weight by standard deviation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeatureScale {
    /// Mean of each number.
    pub means: Vec<f32>,
    /// Factor of each number, the same within a group.
    pub scales: Vec<f32>,
}

/// Smallest standard deviation that is divided by. Features that hardly vary tell frames apart by
/// noise alone.
const LEAST_DEVIATION: f32 = 1e-3;

impl FeatureScale {
    /// Measures raw features, one row a frame.
    pub(super) fn of(groups: &[FeatureGroup], rows: &[f32]) -> Self {
        let len = feature_len(groups).max(1);
        let frames = (rows.len() / len).max(1) as f64;
        let mut sums = vec![(0.0f64, 0.0f64); len];
        for row in rows.chunks_exact(len) {
            for (sum, &x) in sums.iter_mut().zip(row) {
                sum.0 += f64::from(x);
                sum.1 += f64::from(x).powi(2);
            }
        }
        let means: Vec<f64> = sums.iter().map(|s| s.0 / frames).collect();
        let variances = (sums.iter().zip(&means)).map(|(s, m)| (s.1 / frames - m * m).max(0.0));
        let variances: Vec<f64> = variances.collect();
        let mut scales = Vec::with_capacity(len);
        let mut first = 0;
        for group in groups {
            let of_group = &variances[first..first + group.feature.len()];
            let deviation = (of_group.iter().sum::<f64>() / of_group.len().max(1) as f64).sqrt() as f32;
            let scale = group.weight / deviation.max(LEAST_DEVIATION);
            scales.extend(of_group.iter().map(|_| scale));
            first += of_group.len();
        }
        Self {
            means: means.into_iter().map(|m| m as f32).collect(),
            scales,
        }
    }

    /// Normalises one row: (x − mean) · scale.
    pub(super) fn normalise(&self, row: &mut [f32]) {
        for ((x, mean), scale) in row.iter_mut().zip(&self.means).zip(&self.scales) {
            *x = (*x - mean) * scale;
        }
    }
}
