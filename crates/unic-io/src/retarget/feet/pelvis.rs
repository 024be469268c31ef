//! Lowering the pelvis, so that legs reach their held feet.

use super::{
    foot::{Foot, FootTrack},
    held::FADE_SECONDS,
};
use glam::Vec3;
use unic_core::leg::Leg;
use unic_core::{clip::Clip, skeleton::Skeleton};

/// Largest drop of the pelvis for a leg's reach, metres. A larger one would show as a squat.
const MAX_DROP: f32 = 0.06;

/// Share of its length to which a leg is stretched at most.
const MAX_STRETCH: f32 = 0.999;

/// Lowers the body smoothly around frames in which a held foot is out of a leg's reach.
pub(super) fn lower_pelvis(clip: &mut Clip, skeleton: &Skeleton, feet: &[Foot], targets: &[FootTrack]) {
    let mut world = Vec::new();
    let mut drops: Vec<f32> = Vec::with_capacity(clip.len());
    for (frame, pose) in clip.poses.iter().enumerate() {
        skeleton.forward_kinematics(pose, &mut world);
        let needed = feet.iter().zip(targets).map(|(foot, target)| {
            let Leg { hip, knee, ankle, .. } = foot.leg;
            let [hip, knee, ankle] = [hip, knee, ankle].map(|j| world[j].translation);
            let length = MAX_STRETCH * (hip.distance(knee) + knee.distance(ankle));
            out_of_reach(hip, target.ankles[frame], length)
        });
        drops.push(needed.fold(0.0, f32::max).min(MAX_DROP));
    }
    let smooth = smoothed_above(&drops, (FADE_SECONDS * clip.fps).ceil() as usize);
    let lowered = clip.poses.iter_mut().zip(smooth);
    lowered.for_each(|(pose, drop)| pose.trans.y -= drop);
}

/// Returns how far a hip must come down for `ankle` to be within `length`, metres.
fn out_of_reach(hip: Vec3, ankle: Vec3, length: f32) -> f32 {
    // Pythagoras: the hip may be this high above an ankle at a horizontal distance `across`.
    let across = (hip - ankle).reject_from(Vec3::Y).length();
    let rise = (length * length - across * across).max(0.0).sqrt();
    (hip.y - ankle.y - rise).max(0.0)
}

/// Returns a smooth curve that is nowhere below the values: their running maximum over two radii,
/// averaged twice over one radius.
fn smoothed_above(values: &[f32], radius: usize) -> Vec<f32> {
    let around = |t: usize, radius: usize| t.saturating_sub(radius)..(t + radius + 1).min(values.len());
    let highest: Vec<f32> = (0..values.len())
        .map(|t| {
            values[around(t, 2 * radius)]
                .iter()
                .fold(0.0, |a, b| f32::max(a, *b))
        })
        .collect();
    let averaged = |curve: &[f32]| -> Vec<f32> {
        (0..curve.len())
            .map(|t| {
                let window = &curve[around(t, radius)];
                window.iter().sum::<f32>() / window.len() as f32
            })
            .collect()
    };
    // Two averages of one radius reach two radii, which is why the maximum is taken over two.
    averaged(&averaged(&highest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothed_curve_stays_above_its_values() {
        let mut values = vec![0.0; 60];
        values[30] = 1.0;
        values[33] = 0.5;
        values[0] = 0.25;
        let smooth = smoothed_above(&values, 4);
        assert!(smooth.iter().zip(&values).all(|(s, v)| *s >= v - 1e-6));
        let step = smooth.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        assert!(step < 0.2 && smooth[50] == 0.0, "{step}");
    }

    #[test]
    fn leg_out_of_reach_lowers_the_hip() {
        let drop = out_of_reach(Vec3::Y * 1.1, Vec3::new(0.6, 0.0, 0.0), 1.0);
        assert!((drop - 0.3).abs() < 1e-6);
        assert_eq!(out_of_reach(Vec3::Y * 0.7, Vec3::ZERO, 1.0), 0.0);
    }
}
