//! Lengths of a garment's edges and chords in training clips, the limits of the strain projection.

mod gaps;
#[cfg(test)]
mod tests;

use crate::config::MOST_CHORD_DEVIATIONS;
use gaps::body_gaps;
use glam::Vec3;
use rayon::prelude::*;
use unic_core::{
    character::Character,
    config::ProjectionConfig,
    mesh::TriMesh,
    projection::{StrainLimit, limited_pairs, welded_edges},
};
use unic_eval::PreparedClip;

/// Largest number of frames that lengths are measured in. Neighbouring frames differ little.
const MOST_FRAMES: usize = 2000;

/// Longest chord at rest that has a least length, metres. Longer ones pass joints, and are shorter
/// than ever before when the body folds as it never did in training.
const LONGEST_CHORD_M: f32 = 0.08;

/// Greatest length of a chord, as a multiple of its greatest length in training. The edges between
/// its ends limit it better: a limit from training pulls the sleeve off an arm that is raised higher
/// than there.
const CHORD_STRETCH: f32 = 2.0;

/// Distances from the body, metres, between which a chord goes over from lying on the body to hanging
/// free.
const FREE_FROM_M: [f32; 2] = [0.02, 0.04];

/// Deviations of a length as a share of its mean between which a chord goes over from taut cloth, such as
/// that along the weight of a skirt, to cloth that folds. Longer chords would pull folds out.
const TAUT_UNTIL: [f32; 2] = [0.08, 0.16];

/// Limits of the lengths of a garment's [`limited_pairs`].
#[derive(Clone, Debug, Default)]
pub(crate) struct MeasuredStrain {
    /// Limits with the widest range of chords. Folds shorten chords, so that their lengths vary much, and
    /// a narrow range would pull folds out. Where a limb is raised higher than in training, it would
    /// pull cloth off the limb.
    limits: Vec<StrainLimit>,
    free_chords: Vec<FreeChord>,
}

/// A chord with a least length in cloth that hangs free of the body and taut, at least partly.
#[derive(Clone, Copy, Debug)]
struct FreeChord {
    /// Place among the limits.
    pair: usize,
    /// Its lengths in training.
    lengths: Lengths,
    /// 0 for cloth that lies on the body or folds, 1 for taut cloth that hangs free.
    share: f32,
}

/// Mean and standard deviation of a length, metres.
#[derive(Clone, Copy, Debug)]
struct Lengths {
    mean: f64,
    deviation: f64,
}

impl MeasuredStrain {
    /// Measures the range of length of each of the garment's [`limited_pairs`]: for edges, the mean
    /// over the clips and `deviations` standard deviations to both sides; for chords, from
    /// [`MOST_CHORD_DEVIATIONS`] below the mean, or zero for those longer than [`LONGEST_CHORD_M`], to
    /// [`CHORD_STRETCH`] times the greatest length.
    pub(crate) fn new(
        rest: &TriMesh,
        character: &Character,
        config: &ProjectionConfig,
        clips: &[PreparedClip],
        deviations: f32,
    ) -> Self {
        let frames: usize = clips.iter().map(PreparedClip::len).sum();
        let every = frames.div_ceil(MOST_FRAMES).max(1);
        let measured: Vec<&[Vec3]> = (clips.iter())
            .flat_map(|clip| {
                (0..clip.len())
                    .step_by(every)
                    .map(|t| clip.captured.garment.frame(t))
            })
            .collect();
        Self::of_frames(rest, config, &measured, deviations, |ends| {
            body_gaps(character, clips, ends)
        })
    }

    /// Measures lengths in frames. `gaps` returns the distances of vertices from the body, metres.
    fn of_frames(
        rest: &TriMesh,
        config: &ProjectionConfig,
        frames: &[&[Vec3]],
        deviations: f32,
        gaps: impl FnOnce(&[u32]) -> Vec<f32>,
    ) -> Self {
        let pairs = limited_pairs(config, rest);
        let (edges, chords) = pairs.split_at(welded_edges(rest).len());
        let is_short = |&&[a, b]: &&[u32; 2]| {
            let [a, b] = [a, b].map(|v| rest.vertices[v as usize]);
            a.distance(b) <= LONGEST_CHORD_M
        };
        let edge_limit = |edge| limit_of(lengths_of(edge, frames), deviations);
        let chord_limit = |chord| StrainLimit {
            shortest: match is_short(&chord) {
                true => limit_of(lengths_of(chord, frames), MOST_CHORD_DEVIATIONS).shortest,
                false => 0.0,
            },
            longest: greatest_length(chord, frames) * CHORD_STRETCH,
        };
        let limits = edges.par_iter().map(edge_limit);
        let limits = limits.chain(chords.par_iter().map(chord_limit)).collect();
        let short = (edges.len()..).zip(chords).filter(|(_, chord)| is_short(chord));
        Self {
            limits,
            free_chords: free_chords(&short.collect::<Vec<_>>(), frames, gaps),
        }
    }

    /// Limits with which chords of taut cloth that hangs free keep at least their mean minus
    /// `chord_deviations` standard deviations. Other chords have [`MOST_CHORD_DEVIATIONS`].
    pub(crate) fn limits(&self, chord_deviations: f32) -> Vec<StrainLimit> {
        let mut limits = self.limits.clone();
        for chord in &self.free_chords {
            let deviations = MOST_CHORD_DEVIATIONS + chord.share * (chord_deviations - MOST_CHORD_DEVIATIONS);
            limits[chord.pair].shortest = limit_of(chord.lengths, deviations).shortest;
        }
        limits
    }

    /// Returns whether some cloth hangs free and taut, so that `chord_deviations` change limits.
    pub(crate) fn hangs_free(&self) -> bool {
        !self.free_chords.is_empty()
    }
}

/// Lists the chords of taut cloth that hangs free, given chords with their places among the limits.
fn free_chords(
    chords: &[(usize, &[u32; 2])],
    frames: &[&[Vec3]],
    gaps: impl FnOnce(&[u32]) -> Vec<f32>,
) -> Vec<FreeChord> {
    let mut ends: Vec<u32> = chords.iter().flat_map(|(_, chord)| **chord).collect();
    ends.sort_unstable();
    ends.dedup();
    if ends.is_empty() {
        return Vec::new();
    }
    let gaps = gaps(&ends);
    // Every end is in the list.
    let gap = |vertex: &u32| ends.binary_search(vertex).map_or(0.0, |place| gaps[place]);
    let free = |&(pair, chord): &(usize, &[u32; 2])| {
        let lengths = lengths_of(chord, frames);
        let [a, b] = chord;
        FreeChord {
            pair,
            share: freedom(gap(a).min(gap(b))) * tautness(lengths),
            lengths,
        }
    };
    // NaN is no share.
    let chords = chords.par_iter().map(free).filter(|chord| chord.share > 0.0);
    chords.collect()
}

/// Share to which a chord hangs free, given the distance of its nearer end from the body, metres.
fn freedom(gap: f32) -> f32 {
    let [on_body, free] = FREE_FROM_M;
    ((gap - on_body) / (free - on_body)).clamp(0.0, 1.0)
}

/// Share to which a chord is taut.
fn tautness(lengths: Lengths) -> f32 {
    let [taut, folding] = TAUT_UNTIL;
    // Without a length the quotient is not finite, and the chord is not taut.
    let variation = (lengths.deviation / lengths.mean) as f32;
    ((folding - variation) / (folding - taut)).clamp(0.0, 1.0)
}

fn lengths_of(pair: &[u32; 2], frames: &[&[Vec3]]) -> Lengths {
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
    Lengths {
        mean: first + mean,
        deviation: (squares / count - mean * mean).max(0.0).sqrt(),
    }
}

fn limit_of(lengths: Lengths, deviations: f32) -> StrainLimit {
    let range = lengths.deviation * f64::from(deviations);
    StrainLimit {
        shortest: ((lengths.mean - range) as f32).max(0.0),
        // A limit of zero is not usable; an edge may be that short where vertices coincide.
        longest: ((lengths.mean + range) as f32).max(f32::MIN_POSITIVE),
    }
}

fn greatest_length(chord: &[u32; 2], frames: &[&[Vec3]]) -> f32 {
    let length = |frame: &&[Vec3]| frame[chord[0] as usize].distance(frame[chord[1] as usize]);
    frames.iter().map(length).fold(f32::MIN_POSITIVE, f32::max)
}
