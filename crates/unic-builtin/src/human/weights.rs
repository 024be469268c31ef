//! Which joints carry which part of the skin.

use super::{
    anatomy::{Anatomy, Segment},
    proportions::Proportions,
};
use glam::Vec3;
use unic_core::skinning::{SkinningWeights, WeightsError};

/// Over this distance from a limb's own surface its share of a place falls by e, metres: the softness
/// of the lines where limbs meet.
const SOFTNESS_M: f32 = 0.007;

/// Weights of all 24 joints.
type Row = [f32; 24];

/// SMPL's left and right joints exchanged.
const EXCHANGED: [usize; 24] = [
    0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22,
];

/// Weights of all vertices of a mirrored body, `image` naming each vertex's mirror image: those of
/// the left side by place, those of the right mirrored.
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
            std::array::from_fn(|j| 0.5 * (row[j] + row[EXCHANGED[j]]))
        } else if vertices[v].x < 0.0 {
            EXCHANGED.map(|j| row[j])
        } else {
            row
        }
    };
    let rows = (0..vertices.len()).map(|v| row(v).into_iter().enumerate());
    SkinningWeights::from_rows(24, rows)
}

/// Weights that are symmetric up to rounding made so to the bit: each vertex's row and its image's
/// are averaged.
pub(super) fn mirrored_rows(
    weights: &SkinningWeights,
    image: &[u32],
) -> Result<SkinningWeights, WeightsError> {
    let dense = weights.to_dense();
    let row = |v: usize| (0..24).map(move |j| (j, 24 * v + j));
    let rows = (0..weights.len()).map(|v| {
        let other = 24 * image[v] as usize;
        let dense = &dense;
        row(v).map(move |(j, at)| (j, 0.5 * (dense[at] + dense[other + EXCHANGED[j]])))
    });
    SkinningWeights::from_rows(24, rows)
}

/// Weights at a place of the standard body's left half: those of the segments, by how near each is.
fn row_at(anatomy: &Anatomy, q: Vec3) -> Row {
    let distances = anatomy.segment_distances(q);
    let nearest = distances.iter().map(|d| d.1).fold(f32::MAX, f32::min);
    let mut sum = [0.0; 24];
    for (segment, distance) in distances {
        let share = ((nearest - distance) / SOFTNESS_M).exp();
        let row = carried_by(segment, q);
        (0..24).for_each(|j| sum[j] += share * row[j]);
    }
    sum
}

fn carried_by(segment: Segment, q: Vec3) -> Row {
    let mut row = [0.0; 24];
    match segment {
        Segment::Head => row[15] = 1.0,
        Segment::Trunk => {
            row[0] = 1.0;
            pass(&mut row, 0, 3, step(q.y - 0.985, 0.055));
            pass(&mut row, 3, 6, step(q.y - 1.075, 0.055));
            pass(&mut row, 6, 9, step(q.y - 1.185, 0.060));
            pass(&mut row, 9, 12, step(q.y - 1.445 + 0.3 * (q.z + 0.03), 0.040));
            // The chin is the head's, the nape at the same height the neck's.
            pass(&mut row, 12, 15, step(0.8 * (q.y - 1.522) + 0.6 * q.z, 0.035));
            let collar = step(q.x - 0.095, 0.065) * step(q.y - 1.325, 0.085);
            pass(&mut row, 9, 13, collar);
            pass(
                &mut row,
                0,
                1,
                step(q.x - 0.030, 0.040) * step(0.865 - q.y, 0.070),
            );
        }
        Segment::Arm => {
            row[13] = 1.0;
            pass(&mut row, 13, 16, step(q.x - 0.168, 0.050));
            pass(&mut row, 16, 18, step(q.x - 0.455, 0.040));
            pass(&mut row, 18, 20, step(q.x - 0.703, 0.028));
            pass(&mut row, 20, 22, step(q.x - 0.789, 0.016));
        }
        Segment::Leg => {
            row[0] = 1.0;
            pass(&mut row, 0, 1, step(0.872 - q.y, 0.075));
            pass(&mut row, 1, 4, step(0.484 - q.y, 0.050));
            pass(&mut row, 4, 7, step(0.080 - q.y + 0.4 * (q.z + 0.026), 0.032));
            pass(&mut row, 7, 10, step(q.z - 0.100, 0.022));
        }
    }
    row
}

/// Passes a share of one joint's weight on to the next.
fn pass(row: &mut Row, from: usize, to: usize, share: f32) {
    let passed = row[from] * share;
    row[from] -= passed;
    row[to] += passed;
}

/// Smooth step from 0 at −half to 1 at +half.
fn step(x: f32, half: f32) -> f32 {
    let t = (0.5 + 0.5 * x / half).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
