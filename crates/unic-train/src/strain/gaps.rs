//! Distances of a garment from the body in training.

use rayon::prelude::*;
use unic_core::{character::Character, surface::Surface};
use unic_eval::PreparedClip;

/// Largest number of frames that distances are measured in, over all clips.
const MOST_FRAMES: usize = 48;

/// Quantile of a vertex's distances over the frames that is its gap. Cloth that hangs free touches the body
/// at times: thighs push a skirt. Cloth on the body seldom leaves it.
const QUANTILE: f32 = 0.9;

/// Returns the gap of each of `vertices` to the body, metres: the 90th percentile of its distances.
/// Negative inside the body; infinite without frames and without a body.
pub(super) fn body_gaps(character: &Character, clips: &[PreparedClip], vertices: &[u32]) -> Vec<f32> {
    let frames: Vec<(&PreparedClip, usize)> = (clips.iter())
        .flat_map(|clip| (0..clip.len()).map(move |t| (clip, t)))
        .collect();
    let step = frames.len().div_ceil(MOST_FRAMES).max(1);
    let mut surface = Surface::build(&character.body);
    let mut body = Vec::new();
    let mut distances = vec![Vec::new(); vertices.len()];
    for (clip, t) in frames.into_iter().step_by(step) {
        clip.pose_body(character, t, &mut body);
        surface.refit(&body);
        let garment = clip.captured.garment.frame(t);
        let measure = |(distances, &vertex): (&mut Vec<f32>, &u32)| {
            let point = surface.closest(garment[vertex as usize]);
            distances.push(point.map_or(f32::INFINITY, |point| point.signed_distance));
        };
        distances.par_iter_mut().zip(vertices).for_each(measure);
    }
    distances.iter_mut().map(|d| quantile(d)).collect()
}

/// Returns the [`QUANTILE`] of distances.
fn quantile(distances: &mut [f32]) -> f32 {
    let last = distances.len().saturating_sub(1);
    distances.sort_by(f32::total_cmp);
    let at = (QUANTILE * last as f32).round() as usize;
    distances.get(at).copied().unwrap_or(f32::INFINITY)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]
mod tests {
    use super::*;
    use crate::{Dataset, Fit, Preset, TrainConfig};
    use glam::Vec3;
    use unic_io::Split;
    use unic_testdata::{Figure, Take, capture, take};

    /// Gaps of a tube around a column that stands 1 m beside it in every `period`th frame.
    fn gaps(period: usize) -> Vec<f32> {
        let figure = Figure::tube();
        let Take { clip, .. } = take("walk", 0, 48);
        let mut garment = figure.skinned(&clip);
        let beside = garment.iter_mut().step_by(period).flatten();
        beside.for_each(|position| *position += Vec3::X);
        let (_folder, capture) = capture(&figure, &[(Take { clip, garment }, Split::Train)]);
        let config = TrainConfig::preset(Preset::Tiny);
        let data = Dataset::load(capture, &config, Fit::AllClips).unwrap();
        body_gaps(&data.capture.character, &data.clips, &[0, 20, 40])
    }

    #[test]
    fn cloth_hangs_free_that_is_often_away_from_the_body() {
        for (period, range) in [(16, -0.03..0.03), (4, 0.5..1.5)] {
            let gaps = gaps(period);
            assert!(gaps.iter().all(|gap| range.contains(gap)), "{period}: {gaps:?}");
        }
    }

    #[test]
    fn a_gap_is_the_90th_percentile_of_the_distances() {
        let mut distances: Vec<f32> = (0..=20).rev().map(|i| i as f32).collect();
        assert_eq!(quantile(&mut distances), 18.0);
        assert_eq!(quantile(&mut [0.5]), 0.5);
        assert_eq!(quantile(&mut []), f32::INFINITY);
    }
}
