//! Inputs of a network: elements of motion vectors.

use super::config::{ComparisonConfig, MotionElements};
use unic_core::motion::MotionSlices;
use unic_train::{MotionVectors, View};

/// Chosen elements of the motion vectors of chosen frames, normalised.
#[derive(Clone, Debug)]
pub(super) struct Features {
    /// Indices into the motion vector.
    elements: Vec<usize>,
    /// Ages of the motion vectors, frames.
    lags: Vec<usize>,
}

impl Features {
    /// Chooses the elements and frames that the settings ask for.
    pub(super) fn new(config: &ComparisonConfig, joints: usize, fps: f32) -> Self {
        let slices = MotionSlices::new(joints);
        let elements = match config.reads {
            // The second row of the root's rotation, whose axis is the vertical, is the vertical in
            // the root's frame.
            MotionElements::Pose => {
                let up = slices.root_orientation.start + 3..slices.root_orientation.end;
                up.chain(slices.joint_rotations).collect()
            }
            MotionElements::All => (0..slices.contacts.end).collect(),
        };
        // An age above zero must not round to the current frame.
        let lag = |s: &f32| ((s * fps).round() as usize).max(usize::from(*s > 0.0));
        let mut lags: Vec<usize> = config.lags_s.iter().map(lag).collect();
        // At low frame rates several ages are the same frame, which is read once.
        lags.dedup();
        Self { elements, lags }
    }

    /// Returns the number of inputs.
    pub(super) fn len(&self) -> usize {
        self.elements.len() * self.lags.len()
    }

    /// Appends the inputs of a frame. Before frame 0 the motion is that of frame 0.
    pub(super) fn write(&self, motion: &MotionVectors, view: View, frame: usize, out: &mut Vec<f32>) {
        for lag in &self.lags {
            let vector = motion.frame(frame.saturating_sub(*lag), view);
            out.extend(self.elements.iter().map(|&e| vector[e]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::ComparisonKind;

    #[test]
    fn ages_are_frames_and_frame_0_extends_backwards() {
        let config = ComparisonConfig {
            lags_s: vec![0.0, 0.001, 0.1],
            ..ComparisonConfig::of(ComparisonKind::VirtualBones)
        };
        let features = Features::new(&config, 1, 30.0);
        let len = 19;
        let motion = MotionVectors::of_plain(len, (0..len * 8).map(|i| (i / len) as f32).collect());
        let read = |frame: usize| {
            let mut out = Vec::new();
            features.write(&motion, View::Direct, frame, &mut out);
            assert_eq!(out.len(), features.len());
            [0, len, 2 * len].map(|i| out[i])
        };
        assert_eq!(read(6), [6.0, 5.0, 3.0]);
        assert_eq!(read(2), [2.0, 1.0, 0.0]);
        assert_eq!(read(0), [0.0; 3]);
    }
}
