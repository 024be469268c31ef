//! Low-pass filter against the noise of motion capture.
//!
//! A Butterworth filter of second order runs forwards and backwards, so that it has no delay
//! (Winter 2009, "Biomechanics and Motor Control of Human Movement", section 3.4.4.2). Rotations
//! are filtered as sign-continuous quaternions and normalised again: neighbouring frames differ so
//! little that the unit sphere is nearly flat. Single outlying frames are replaced before, because
//! a linear filter would spread them over their neighbours.

use glam::{Quat, Vec3};
use std::f64::consts::{PI, SQRT_2};
use unic_core::clip::Clip;

/// Cutoff for raw motion capture, Hz. Steps and swings are below 6 Hz, impacts reach 10 Hz.
pub(crate) const DEFAULT_HZ: f32 = 10.0;

/// Highest cutoff as a share of the frame rate. Close to the Nyquist frequency, half the frame
/// rate, the filter passes nearly everything and its coefficients are ill-conditioned.
const MAX_CUTOFF_SHARE: f32 = 0.45;

/// Number of frames on each side that a frame is compared with.
const NEIGHBOURS: usize = 2;

/// Distance of a rotation from the medoid of its neighbourhood above which it is a spike, radians.
/// In a steady turn every frame is the medoid itself.
const SPIKE_ANGLE: f32 = 0.35;
/// Distance of a root position from the medoid of its neighbourhood above which it is a spike,
/// metres.
const SPIKE_DISTANCE: f32 = 0.08;

/// Replaces spikes, then filters with a cutoff in Hz. Returns the number of spikes.
///
/// A cutoff of 0.45 times the frame rate or more filters nothing.
pub(crate) fn low_pass(clip: &mut Clip, hertz: f32) -> usize {
    let spikes = remove_spikes(clip);
    if hertz < MAX_CUTOFF_SHARE * clip.fps {
        let filter = Butterworth::new(f64::from(hertz), f64::from(clip.fps));
        let joints = clip.poses.first().map_or(0, |p| p.local.len());
        (0..joints).for_each(|joint| filter_rotations(clip, joint, &filter));
        filter_translations(clip, &filter);
    }
    spikes
}

/// Replaces spikes by the medoids of their neighbourhoods, and returns their number.
fn remove_spikes(clip: &mut Clip) -> usize {
    let joints = clip.poses.first().map_or(0, |p| p.local.len());
    let mut spikes = 0;
    for joint in 0..joints {
        let before: Vec<Quat> = clip.poses.iter().map(|p| p.local[joint]).collect();
        for spike in find_spikes(&before, |a, b| angle(*a, *b), SPIKE_ANGLE) {
            clip.poses[spike.frame].local[joint] = spike.replacement;
            spikes += 1;
        }
    }
    let before: Vec<Vec3> = clip.poses.iter().map(|p| p.trans).collect();
    for spike in find_spikes(&before, |a, b| a.distance(*b), SPIKE_DISTANCE) {
        clip.poses[spike.frame].trans = spike.replacement;
        spikes += 1;
    }
    spikes
}

/// An outlying frame of a track.
struct Spike<T> {
    frame: usize,
    /// Medoid of the neighbourhood: the value with the smallest sum of distances to the others.
    replacement: T,
}

/// Finds the frames that are farther than `limit` from the medoid of their neighbourhood.
///
/// A medoid is robust against the spike itself, and unlike a median it exists for rotations.
fn find_spikes<T: Copy>(track: &[T], distance: impl Fn(&T, &T) -> f32, limit: f32) -> Vec<Spike<T>> {
    let mut found = Vec::new();
    for frame in NEIGHBOURS..track.len().saturating_sub(NEIGHBOURS) {
        let around = &track[frame - NEIGHBOURS..=frame + NEIGHBOURS];
        // The cheap test first: a frame near one of its neighbours is no spike, and spikes are
        // rare.
        let is_near = |other: &T| distance(&track[frame], other) < limit;
        if is_near(&track[frame - 1]) || is_near(&track[frame + 1]) {
            continue;
        }
        let total = |a: &T| around.iter().map(|b| distance(a, b)).sum::<f32>();
        let medoid = around.iter().min_by(|a, b| total(a).total_cmp(&total(b)));
        if let Some(&replacement) = medoid.filter(|m| distance(&track[frame], m) > limit) {
            found.push(Spike { frame, replacement });
        }
    }
    found
}

/// Returns the angle of the rotation between two rotations, radians.
fn angle(a: Quat, b: Quat) -> f32 {
    // The absolute value identifies q and −q; rounding may bring the product above 1.
    2.0 * a.dot(b).abs().min(1.0).acos()
}

/// Filters the local rotations of a joint.
fn filter_rotations(clip: &mut Clip, joint: usize, filter: &Butterworth) {
    let mut tracks = vec![Vec::new(); 4];
    let mut previous = Quat::IDENTITY;
    for pose in &clip.poses {
        let q = pose.local[joint];
        // q and −q are one rotation: a jump between them would be filtered as a movement.
        previous = if q.dot(previous) < 0.0 { -q } else { q };
        tracks
            .iter_mut()
            .zip(previous.to_array())
            .for_each(|(t, x)| t.push(f64::from(x)));
    }
    tracks.iter_mut().for_each(|track| filter.apply(track));
    for (frame, pose) in clip.poses.iter_mut().enumerate() {
        // The components of the mean of nearby unit quaternions are a little short of length 1.
        let filtered = [0, 1, 2, 3].map(|k| tracks[k][frame] as f32);
        let filtered = Quat::from_array(filtered);
        // Alternating opposite rotations cancel, and the rest has no direction: the frame stays
        // then.
        if filtered.length_squared() > 0.25 {
            pose.local[joint] = filtered.normalize();
        }
    }
}

/// Filters the translation of the root.
fn filter_translations(clip: &mut Clip, filter: &Butterworth) {
    for axis in 0..3 {
        let mut track: Vec<f64> = clip.poses.iter().map(|p| f64::from(p.trans[axis])).collect();
        filter.apply(&mut track);
        let filtered = clip.poses.iter_mut().zip(track);
        filtered.for_each(|(pose, x)| pose.trans[axis] = x as f32);
    }
}

/// Coefficients of a Butterworth low-pass filter of second order. f64, because the poles approach 1
/// for low cutoffs.
struct Butterworth {
    /// Factors on the current input and the two before it.
    input: [f64; 3],
    /// Factors on the two previous outputs, which are subtracted.
    output: [f64; 2],
    /// Number of frames added at both ends, in which the filter settles.
    padding: usize,
}

impl Butterworth {
    /// Computes the coefficients by the bilinear transform.
    ///
    /// Each pass halves the power at its own cutoff. For both passes together to halve it at
    /// `hertz`, the cutoff of one pass is higher by the factor 1 / (√2 − 1)^¼ = 1.247.
    fn new(hertz: f64, fps: f64) -> Self {
        // Prewarping corrects the frequency scale of the bilinear transform; its tangent diverges
        // at half the frame rate.
        let warped = (PI * (hertz / fps).min(0.49)).tan();
        let w = warped / (SQRT_2 - 1.0).powf(0.25);
        let k = 1.0 + SQRT_2 * w + w * w;
        let gain = w * w / k;
        Self {
            input: [gain, 2.0 * gain, gain],
            output: [2.0 * (w * w - 1.0) / k, (1.0 - SQRT_2 * w + w * w) / k],
            // Two periods of the cutoff, in which the filter's response has decayed.
            padding: (2.0 * fps / hertz).ceil() as usize,
        }
    }

    /// Filters a track forwards and backwards.
    ///
    /// The track is continued by its point reflection at both end points, so that a steady change
    /// stays steady up to the ends.
    fn apply(&self, track: &mut [f64]) {
        let (count, Some((&first, &last))) = (track.len(), track.first().zip(track.last())) else {
            return;
        };
        let padding = self.padding.min(count - 1);
        let before = (1..=padding).rev().map(|i| 2.0 * first - track[i]);
        let after = (1..=padding).map(|i| 2.0 * last - track[count - 1 - i]);
        let mut padded: Vec<f64> = before.chain(track.iter().copied()).chain(after).collect();
        self.pass(&mut padded);
        padded.reverse();
        self.pass(&mut padded);
        padded.reverse();
        track.copy_from_slice(&padded[padding..padding + count]);
    }

    /// Filters a track in one direction.
    fn pass(&self, track: &mut [f64]) {
        // As if the track had been constant before its start, so that there is no initial swing.
        let start = track.first().copied().unwrap_or(0.0);
        let (mut inputs, mut outputs) = ([start; 2], [start; 2]);
        for x in track {
            let y = self.input[0] * *x + self.input[1] * inputs[0] + self.input[2] * inputs[1]
                - self.output[0] * outputs[0]
                - self.output[1] * outputs[1];
            inputs = [*x, inputs[0]];
            outputs = [y, outputs[0]];
            *x = y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_core::Pose;

    fn sine(hertz: f64, fps: f64) -> Vec<f64> {
        (0..600)
            .map(|t| (2.0 * PI * hertz * t as f64 / fps).sin())
            .collect()
    }

    /// Amplitude of a sine in the middle of the track, away from the ends.
    fn amplitude(track: &[f64]) -> f64 {
        let middle = &track[150..450];
        (middle.iter().map(|x| x * x).sum::<f64>() / 150.0).sqrt()
    }

    #[test]
    fn cutoff_halves_the_power_without_delay() {
        let filter = Butterworth::new(10.0, 120.0);
        for (hertz, least, most) in [(1.0, 0.999, 1.001), (10.0, 0.70, 0.715), (40.0, 0.0, 0.005)] {
            let mut track = sine(hertz, 120.0);
            filter.apply(&mut track);
            let found = amplitude(&track);
            assert!((least..=most).contains(&found), "{hertz} Hz: {found}");
        }
        // In phase: filtering scales a sine and does not shift it.
        let (mut track, whole) = (sine(5.0, 120.0), sine(5.0, 120.0));
        filter.apply(&mut track);
        let product: f64 = track[150..450]
            .iter()
            .zip(&whole[150..450])
            .map(|(a, b)| a * b)
            .sum();
        let correlation = product / (150.0 * amplitude(&track));
        assert!((correlation - 1.0).abs() < 1e-6, "{correlation}");
    }

    #[test]
    fn steady_change_is_kept_up_to_the_ends() {
        let filter = Butterworth::new(8.0, 120.0);
        let line: Vec<f64> = (0..200).map(|t| 0.3 + 0.02 * f64::from(t)).collect();
        let mut track = line.clone();
        filter.apply(&mut track);
        let off = track
            .iter()
            .zip(&line)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(off < 2e-3, "{off}");
        filter.apply(&mut [1.0]);
        filter.apply(&mut []);
    }

    fn turning(frames: usize, fps: f32) -> Clip {
        let pose = |f: usize| Pose {
            trans: Vec3::X * f as f32 / fps,
            local: vec![Quat::from_rotation_y(3.0 * f as f32 / fps)],
        };
        Clip {
            name: "turn".into(),
            fps,
            poses: (0..frames).map(pose).collect(),
            ground_height: 0.0,
            wind: Vec::new(),
        }
    }

    #[test]
    fn spikes_are_removed_and_their_neighbours_kept() {
        let clean = turning(300, 120.0);
        let mut clip = clean.clone();
        clip.poses[100].local[0] *= Quat::from_rotation_x(1.5);
        clip.poses[200].trans.y += 0.5;
        assert_eq!(low_pass(&mut clip, 10.0), 2);
        for (a, b) in clip.poses.iter().zip(&clean.poses) {
            assert!(angle(a.local[0], b.local[0]) < 0.03 && a.trans.distance(b.trans) < 0.01);
        }
        assert_eq!(low_pass(&mut clean.clone(), 10.0), 0);
    }

    #[test]
    fn result_does_not_depend_on_quaternion_signs() {
        let mut clip = turning(400, 60.0);
        let mut flipped = clip.clone();
        flipped
            .poses
            .iter_mut()
            .step_by(2)
            .for_each(|p| p.local[0] = -p.local[0]);
        low_pass(&mut clip, 6.0);
        low_pass(&mut flipped, 6.0);
        for (a, b) in clip.poses.iter().zip(&flipped.poses) {
            assert!(a.local[0].dot(b.local[0]).abs() > 1.0 - 1e-6);
        }
    }
}
