//! The frames of a clip that a model gets most wrong.

use glam::Vec3;

/// One of them.
#[derive(Clone, Debug)]
pub(crate) struct WorstFrame {
    /// From 0.
    pub(crate) frame: usize,
    /// Metres.
    pub(crate) rmse: f64,
    /// What was predicted.
    pub(crate) positions: Vec<Vec3>,
}

/// Keeps the worst frames of a clip as they pass by, some way apart from one another: neighbours
/// would show the same thing.
#[derive(Clone, Debug)]
pub(crate) struct WorstFrames {
    most: usize,
    apart: usize,
    kept: Vec<WorstFrame>,
}

impl WorstFrames {
    /// At most `most` of a clip of `len` frames.
    pub(crate) fn new(most: usize, len: usize) -> Self {
        Self {
            most,
            apart: (len / (2 * most).max(1)).max(1),
            kept: Vec::new(),
        }
    }

    /// Frames must be offered in order; a diverged one (NaN) is worse than all others.
    pub(crate) fn offer(&mut self, frame: usize, predicted: &[Vec3], truth: &[Vec3]) {
        let rmse = rmse(predicted, truth);
        let Some(place) = self.place(frame, rmse) else {
            return;
        };
        if place < self.kept.len() {
            self.kept.remove(place);
        }
        self.kept.push(WorstFrame {
            frame,
            rmse,
            positions: predicted.to_vec(),
        });
    }

    /// Index of the kept frame that a new one takes the place of; the end where there is room.
    fn place(&self, frame: usize, rmse: f64) -> Option<usize> {
        // In order of frames: only the last one can be close.
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

    /// In the order of time.
    pub(crate) fn frames(&self) -> &[WorstFrame] {
        &self.kept
    }
}

/// Root mean square distance, metres.
pub(crate) fn rmse(predicted: &[Vec3], truth: &[Vec3]) -> f64 {
    let squares = predicted
        .iter()
        .zip(truth)
        .map(|(p, g)| f64::from(p.distance_squared(*g)));
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
    fn peaks_are_found_and_their_neighbours_left_out() {
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
