//! Skinning weights of the built-in human.

use super::{
    anatomy::{Anatomy, Segment, SegmentDistance},
    proportions::Proportions,
};
use glam::Vec3;
use unic_core::skinning::{SkinningWeights, WeightsError};

/// Distance over which the influence of a body segment falls by a factor of e, metres.
///
/// It sets how soft the transitions between limbs are.
const SOFTNESS_M: f32 = 0.007;

/// Weights of all 24 joints for one vertex.
type WeightRow = [f32; 24];

/// Index of each joint's mirror image in SMPL's order.
const MIRRORED_JOINT: [usize; 24] = [
    0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22,
];

/// Computes the weights of all vertices of a symmetric body.
///
/// `image` holds the index of each vertex's mirror image. The left side is computed, the right side
/// mirrors it.
pub(super) fn symmetric(
    anatomy: &Anatomy,
    proportions: &Proportions,
    vertices: &[Vec3],
    image: &[u32],
) -> Result<SkinningWeights, WeightsError> {
    let row = |v: usize| {
        let left = Vec3::new(vertices[v].x.abs(), vertices[v].y, vertices[v].z);
        let row = row_at(anatomy, proportions.standard(left));
        if image[v] as usize == v {
            // A vertex on the midplane follows both sides equally.
            std::array::from_fn(|j| 0.5 * (row[j] + row[MIRRORED_JOINT[j]]))
        } else if vertices[v].x < 0.0 {
            MIRRORED_JOINT.map(|j| row[j])
        } else {
            row
        }
    };
    let rows = (0..vertices.len()).map(|v| row(v).into_iter().enumerate());
    SkinningWeights::from_rows(24, rows)
}

/// Makes weights that are symmetric up to rounding symmetric to the bit.
///
/// The row of each vertex is averaged with the mirrored row of its mirror image.
pub(super) fn symmetrised(weights: &SkinningWeights, image: &[u32]) -> Result<SkinningWeights, WeightsError> {
    let dense = weights.to_dense();
    let row = |v: usize| (0..24).map(move |j| (j, 24 * v + j));
    let rows = (0..weights.len()).map(|v| {
        let other = 24 * image[v] as usize;
        let dense = &dense;
        row(v).map(move |(j, at)| (j, 0.5 * (dense[at] + dense[other + MIRRORED_JOINT[j]])))
    });
    SkinningWeights::from_rows(24, rows)
}

/// Unnormalised weights at a point on the left half of the standard body: a blend of the weights of
/// all segments, in which nearer segments count more.
fn row_at(anatomy: &Anatomy, q: Vec3) -> WeightRow {
    let distances = anatomy.segment_distances(q);
    let nearest = distances.iter().map(|d| d.distance).fold(f32::MAX, f32::min);
    let mut sum = [0.0; 24];
    for SegmentDistance { segment, distance } in distances {
        // Relative to the nearest segment, so that the exponentials do not all underflow.
        let share = ((nearest - distance) / SOFTNESS_M).exp();
        let row = segment_weights(segment, q);
        (0..24).for_each(|j| sum[j] += share * row[j]);
    }
    sum
}

/// Weights of a point that belongs to one segment alone; they sum to 1.
///
/// The full weight starts at the first joint of a chain. At each further joint it is handed on over
/// a smooth step around the joint's position.
fn segment_weights(segment: Segment, q: Vec3) -> WeightRow {
    let mut row = [0.0; 24];
    match segment {
        Segment::Head => row[15] = 1.0,
        Segment::Trunk => {
            row[0] = 1.0;
            hand_on(&mut row, 0, 3, step(q.y - 0.985, 0.055));
            hand_on(&mut row, 3, 6, step(q.y - 1.075, 0.055));
            hand_on(&mut row, 6, 9, step(q.y - 1.185, 0.060));
            hand_on(&mut row, 9, 12, step(q.y - 1.445 + 0.3 * (q.z + 0.03), 0.040));
            // The chin follows the head; the nape at the same height follows the neck.
            hand_on(&mut row, 12, 15, step(0.8 * (q.y - 1.522) + 0.6 * q.z, 0.035));
            let collar = step(q.x - 0.095, 0.065) * step(q.y - 1.325, 0.085);
            hand_on(&mut row, 9, 13, collar);
            let thigh = step(q.x - 0.030, 0.040) * step(0.865 - q.y, 0.070);
            hand_on(&mut row, 0, 1, thigh);
        }
        Segment::Arm => {
            row[13] = 1.0;
            hand_on(&mut row, 13, 16, step(q.x - 0.168, 0.050));
            hand_on(&mut row, 16, 18, step(q.x - 0.455, 0.040));
            hand_on(&mut row, 18, 20, step(q.x - 0.703, 0.028));
            hand_on(&mut row, 20, 22, step(q.x - 0.789, 0.016));
        }
        Segment::Leg => {
            row[0] = 1.0;
            hand_on(&mut row, 0, 1, step(0.872 - q.y, 0.075));
            hand_on(&mut row, 1, 4, step(0.484 - q.y, 0.050));
            // The transition lies higher at the instep than at the heel.
            hand_on(&mut row, 4, 7, step(0.080 - q.y + 0.4 * (q.z + 0.026), 0.032));
            hand_on(&mut row, 7, 10, step(q.z - 0.100, 0.022));
        }
    }
    row
}

/// Moves a share of one joint's weight to another joint.
fn hand_on(row: &mut WeightRow, from: usize, to: usize, share: f32) {
    let moved = row[from] * share;
    row[from] -= moved;
    row[to] += moved;
}

/// Cubic smooth step from 0 at −`half` to 1 at +`half`.
fn step(x: f32, half: f32) -> f32 {
    let t = (0.5 + 0.5 * x / half).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
