//! Springs of a skeleton's joints.

use glam::Vec3;
use unic_core::{
    motion::{JointSprings, Spring},
    skeleton::Skeleton,
};
use unic_io::joint_names::counterparts;

/// Largest number of joints with springs: the number of a human's joints in SMPL.
const MOST_JOINTS: usize = 24;

/// Springs that hang from the joints of a skeleton. Without springs no joint is listed.
pub(crate) fn joint_springs(springs: &[Spring], skeleton: &Skeleton) -> JointSprings {
    match springs {
        [] => JointSprings::default(),
        _ => JointSprings {
            joints: spread(skeleton.joints(), skeleton.root(), &pairs(skeleton)),
            springs: springs.to_vec(),
        },
    }
}

/// The joint on the other side of each joint. One without a counterpart, or in the middle, is its
/// own.
fn pairs(skeleton: &Skeleton) -> Vec<usize> {
    let own = || (0..skeleton.len()).collect();
    let found: Vec<usize> = counterparts(skeleton.names()).unwrap_or_else(own);
    let paired = |joint: usize| match found[found[joint]] == joint {
        true => found[joint],
        false => joint,
    };
    (0..skeleton.len()).map(paired).collect()
}

/// Lists the joints that springs hang from, ascending: all, or at most [`MOST_JOINTS`] that cover
/// the skeleton. Each is the farthest joint from those before, beginning at the root. A joint comes
/// with that of the other side, so that mirrored motion can be read.
fn spread(joints: &[Vec3], root: usize, pairs: &[usize]) -> Vec<usize> {
    if joints.len() <= MOST_JOINTS {
        return (0..joints.len()).collect();
    }
    let mut taken = vec![root, pairs[root]];
    taken.dedup();
    let mut gaps = vec![f32::INFINITY; joints.len()];
    let mut measured = 0;
    while taken.len() < MOST_JOINTS {
        for added in &taken[measured..] {
            let distances = joints.iter().map(|joint| joint.distance(joints[*added]));
            gaps.iter_mut()
                .zip(distances)
                .for_each(|(gap, d)| *gap = gap.min(d));
        }
        measured = taken.len();
        // A pair does not fit in the last place.
        let fits = |joint: &usize| pairs[*joint] == *joint || taken.len() + 2 <= MOST_JOINTS;
        // In reverse, so that the first of equals is taken.
        let left = (0..joints.len())
            .rev()
            .filter(fits)
            .filter(|joint| gaps[*joint] > 0.0);
        let Some(joint) = left.max_by(|a, b| gaps[*a].total_cmp(&gaps[*b])) else {
            break;
        };
        taken.push(joint);
        if pairs[joint] != joint {
            taken.push(pairs[joint]);
        }
    }
    taken.sort_unstable();
    taken
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Joints 0 to 9 in the middle, then so many on the left and as many on the right.
    fn figure(side: usize) -> (Vec<Vec3>, Vec<usize>) {
        let middle = (0..10).map(|i| Vec3::Y * 0.1 * i as f32);
        let of_side =
            |sign: f32| (1..=side).map(move |i| Vec3::new(sign * 0.05 * i as f32, 1.0, 0.01 * i as f32));
        let joints = middle.chain(of_side(1.0)).chain(of_side(-1.0)).collect();
        let left = (0..side).map(|i| 10 + side + i);
        let pairs = (0..10).chain(left).chain((0..side).map(|i| 10 + i)).collect();
        (joints, pairs)
    }

    #[test]
    fn at_most_24_joints_of_both_sides_have_springs() {
        for side in [8, 20, 40] {
            let (joints, pairs) = figure(side);
            let taken = spread(&joints, 3, &pairs);
            assert_eq!(taken.len(), MOST_JOINTS, "{side}");
            assert!(taken.is_sorted_by(|a, b| a < b), "{taken:?}");
            assert!(taken.contains(&3));
            assert!(
                taken.iter().all(|joint| taken.contains(&pairs[*joint])),
                "{taken:?}"
            );
            // The ends of the arms and of the spine.
            for end in [0, 9, 9 + side, 9 + 2 * side] {
                assert!(taken.contains(&end), "{end}: {taken:?}");
            }
        }
        let (joints, pairs) = figure(7);
        assert_eq!(spread(&joints, 3, &pairs), Vec::from_iter(0..24));
        let (mut joints, pairs) = figure(40);
        joints.fill(Vec3::ONE);
        assert_eq!(spread(&joints, 3, &pairs), [3], "joints that coincide");
    }
}
