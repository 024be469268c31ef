//! Lengths of a garment's edges and chords in training clips, the limits of the strain projection.

use glam::Vec3;
use rayon::prelude::*;
use unic_core::{
    config::ProjectionConfig,
    mesh::TriMesh,
    projection::{StrainLimit, limited_pairs, welded_edges},
};
use unic_eval::PreparedClip;

/// Largest number of frames that lengths are measured in. Neighbouring frames differ little.
const MOST_FRAMES: usize = 2000;

/// Least length of a chord below its mean, in standard deviations. Folds shorten chords, so that
/// their lengths vary much, and a narrow range would pull folds out. The chords are for lengths that
/// hardly occur in training.
const CHORD_DEVIATIONS: f32 = 1.5;

/// Longest chord at rest that has a least length, metres. Longer ones pass joints, and are shorter
/// than ever before when the body folds as it never did in training.
const LONGEST_CHORD_M: f32 = 0.08;

/// Greatest length of a chord, as a multiple of its greatest length in training. The edges between
/// its ends limit it better: a limit from training pulls the sleeve off an arm that is raised higher
/// than there.
const CHORD_STRETCH: f32 = 2.0;

/// Returns the range of length of each of the garment's [`limited_pairs`]: for edges, the mean over
/// the clips and `deviations` standard deviations to both sides; for chords, from
/// [`CHORD_DEVIATIONS`] below the mean, or zero for those longer than [`LONGEST_CHORD_M`], to
/// [`CHORD_STRETCH`] times the greatest length.
pub(crate) fn strain_limits(
    rest: &TriMesh,
    config: &ProjectionConfig,
    clips: &[PreparedClip],
    deviations: f32,
) -> Vec<StrainLimit> {
    let frames: usize = clips.iter().map(PreparedClip::len).sum();
    let every = frames.div_ceil(MOST_FRAMES).max(1);
    let measured: Vec<&[Vec3]> = (clips.iter())
        .flat_map(|clip| {
            (0..clip.len())
                .step_by(every)
                .map(|t| clip.captured.garment.frame(t))
        })
        .collect();
    limits_in(rest, config, &measured, deviations)
}

fn limits_in(
    rest: &TriMesh,
    config: &ProjectionConfig,
    frames: &[&[Vec3]],
    deviations: f32,
) -> Vec<StrainLimit> {
    let edges = welded_edges(rest).len();
    let limit = |(i, pair): (usize, &[u32; 2])| match i < edges {
        true => limit_of(pair, frames, deviations),
        false => {
            let [a, b] = pair.map(|v| rest.vertices[v as usize]);
            chord_limit_of(pair, frames, a.distance(b))
        }
    };
    let pairs = limited_pairs(config, rest);
    pairs.par_iter().enumerate().map(limit).collect()
}

fn limit_of(pair: &[u32; 2], frames: &[&[Vec3]], deviations: f32) -> StrainLimit {
    // Sums of differences from the first length: those of squares alone would cancel.
    let length = |frame: &[Vec3]| f64::from(frame[pair[0] as usize].distance(frame[pair[1] as usize]));
    let first = frames.first().map_or(0.0, |frame| length(frame));
    let (mut sum, mut squares) = (0.0, 0.0);
    for frame in frames {
        let difference = length(frame) - first;
        sum += difference;
        squares += difference * difference;
    }
    let count = frames.len().max(1) as f64;
    let mean = sum / count;
    let deviation = (squares / count - mean * mean).max(0.0).sqrt() * f64::from(deviations);
    let longest = (first + mean + deviation) as f32;
    StrainLimit {
        shortest: ((first + mean - deviation) as f32).max(0.0),
        // A limit of zero is not usable; an edge may be that short where vertices coincide.
        longest: longest.max(f32::MIN_POSITIVE),
    }
}

fn chord_limit_of(chord: &[u32; 2], frames: &[&[Vec3]], rest_length: f32) -> StrainLimit {
    let length = |frame: &&[Vec3]| frame[chord[0] as usize].distance(frame[chord[1] as usize]);
    let limit = limit_of(chord, frames, CHORD_DEVIATIONS);
    StrainLimit {
        shortest: if rest_length > LONGEST_CHORD_M {
            0.0
        } else {
            limit.shortest
        },
        longest: frames.iter().map(length).fold(f32::MIN_POSITIVE, f32::max) * CHORD_STRETCH,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_mean_and_deviations_of_the_lengths() {
        let frame = |x: f32| vec![Vec3::ZERO, Vec3::new(x, 0.0, 0.0)];
        let frames = [frame(1.0), frame(1.2), frame(0.8), frame(1.0)];
        let frames: Vec<&[Vec3]> = frames.iter().map(Vec::as_slice).collect();
        let limit = limit_of(&[0, 1], &frames, 2.0);
        let deviation = 0.02f32.sqrt();
        assert!(
            (limit.shortest - (1.0 - 2.0 * deviation)).abs() < 1e-5,
            "{limit:?}"
        );
        assert!(
            (limit.longest - (1.0 + 2.0 * deviation)).abs() < 1e-5,
            "{limit:?}"
        );
    }

    #[test]
    fn chords_may_become_much_longer_than_in_training_and_long_ones_shorter() {
        let at = |i: u32| 0.012 * Vec3::new((i % 30) as f32, (i / 30) as f32, 0.0);
        let corners = (0..900u32).filter(|i| i % 30 < 29 && i / 30 < 29);
        let faces = corners.flat_map(|i| [[i, i + 1, i + 31], [i, i + 31, i + 30]]);
        let rest = TriMesh::new((0..900).map(at).collect(), faces.collect()).unwrap();
        let scaled = |scale: f32| rest.vertices.iter().map(|v| *v * scale).collect::<Vec<_>>();
        let frames = [0.9, 1.1].map(scaled);
        let frames: Vec<&[Vec3]> = frames.iter().map(Vec::as_slice).collect();
        let config = ProjectionConfig::default();
        let limits = limits_in(&rest, &config, &frames, 0.5);
        let (pairs, edges) = (limited_pairs(&config, &rest), welded_edges(&rest).len());
        assert_eq!(limits.len(), pairs.len());
        assert!(pairs.len() > edges);
        let mut counts = [0; 3];
        for (i, ([a, b], limit)) in pairs.into_iter().zip(limits).enumerate() {
            let length = at(a).distance(at(b));
            // The lengths deviate by a tenth.
            let [shortest, longest] = match i < edges {
                true => [1.0 - 0.05, 1.0 + 0.05],
                false if length > LONGEST_CHORD_M => [0.0, 1.1 * CHORD_STRETCH],
                false => [1.0 - 0.1 * CHORD_DEVIATIONS, 1.1 * CHORD_STRETCH],
            };
            counts[usize::from(i >= edges) + usize::from(length > LONGEST_CHORD_M)] += 1;
            assert!(
                (limit.shortest / length - shortest).abs() < 1e-4,
                "{i}: {limit:?}"
            );
            assert!((limit.longest / length - longest).abs() < 1e-4, "{i}: {limit:?}");
        }
        assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
    }
}
