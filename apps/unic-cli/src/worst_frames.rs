//! Frames of a clip in which a model has its largest errors.

use glam::Vec3;

/// Frame with a large error.
#[derive(Clone, Debug)]
pub(crate) struct WorstFrame {
    /// Frame of the clip, from 0.
    pub(crate) frame: usize,
    /// RMSE over the vertices, metres.
    pub(crate) rmse: f64,
    /// Predicted positions of the vertices, metres.
    pub(crate) positions: Vec<Vec3>,
}

/// Selection of the worst frames of a clip, made while the frames are predicted.
///
/// The frames keep a distance from each other, because neighbouring frames are nearly equal.
#[derive(Clone, Debug)]
pub(crate) struct WorstFrames {
    /// Largest number of frames.
    most: usize,
    /// Smallest distance between two of them, in frames.
    apart: usize,
    /// Frames selected so far, in the order of time.
    kept: Vec<WorstFrame>,
}

impl WorstFrames {
    /// Creates a selection of at most `most` frames of a clip of `len` frames.
    pub(crate) fn new(most: usize, len: usize) -> Self {
        Self {
            most,
            // Half of the distance of frames spread evenly over the clip: errors may lie closer.
            apart: (len / (2 * most).max(1)).max(1),
            kept: Vec::new(),
        }
    }

    /// Offers the next frame. Frames come in order; a diverged one (NaN) is worse than all others.
    pub(crate) fn offer(&mut self, frame: usize, predicted: &[Vec3], truth: &[Vec3]) {
        let rmse = rmse(predicted, truth);
        let Some(index) = self.index_to_replace(frame, rmse) else {
            return;
        };
        // Removed and pushed instead of replaced, so that the order of time is kept.
        if index < self.kept.len() {
            self.kept.remove(index);
        }
        self.kept.push(WorstFrame {
            frame,
            rmse,
            positions: predicted.to_vec(),
        });
    }

    /// Index of the selected frame that a new one replaces; the length if there is room for one
    /// more. `None` if the new frame is not selected.
    fn index_to_replace(&self, frame: usize, rmse: f64) -> Option<usize> {
        // Frames come in order, so that only the last one selected can be too close.
        let close = self.kept.last().filter(|last| frame < last.frame + self.apart);
        if let Some(last) = close {
            return rmse.total_cmp(&last.rmse).is_gt().then_some(self.kept.len() - 1);
        }
        if self.kept.len() < self.most {
            return Some(self.kept.len());
        }
        let least = (0..self.kept.len()).min_by(|&a, &b| self.kept[a].rmse.total_cmp(&self.kept[b].rmse))?;
        rmse.total_cmp(&self.kept[least].rmse).is_gt().then_some(least)
    }

    /// Selected frames in the order of time.
    pub(crate) fn frames(&self) -> &[WorstFrame] {
        &self.kept
    }
}

/// Root mean square of the distances between two sets of positions, metres.
pub(crate) fn rmse(predicted: &[Vec3], truth: &[Vec3]) -> f64 {
    let squares = predicted
        .iter()
        .zip(truth)
        .map(|(p, g)| f64::from(p.distance_squared(*g)));
    // `abs` clears the sign of NaN, which `total_cmp` would else order below all numbers.
    (squares.sum::<f64>() / predicted.len().max(1) as f64)
        .sqrt()
        .abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst(errors: &[f32], most: usize) -> Vec<usize> {
        let mut worst = WorstFrames::new(most, errors.len());
        for (frame, &error) in errors.iter().enumerate() {
            worst.offer(frame, &[Vec3::X * error], &[Vec3::ZERO]);
        }
        worst.frames().iter().map(|w| w.frame).collect()
    }

    #[test]
    fn peaks_are_selected_without_their_neighbours() {
        let peaks = [30, 60, 95];
        let height = |t: i32| {
            peaks
                .iter()
                .map(|p| 1.0 / (1.0 + (t - p).abs() as f32))
                .fold(0.0, f32::max)
        };
        let errors: Vec<f32> = (0..120).map(height).collect();
        assert_eq!(worst(&errors, 3), [30, 60, 95]);
    }

    #[test]
    fn a_diverged_frame_is_the_worst() {
        let mut errors = vec![1.0; 40];
        errors[20] = f32::NAN;
        assert!(worst(&errors, 1).contains(&20));
        assert!(worst(&[], 3).is_empty());
    }
}
