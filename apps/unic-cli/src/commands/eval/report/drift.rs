//! Chart of the error over the time of free running, one line per row.

use glam::Vec3;
use unic_eval::PreparedClip;
use unic_io::frames::GarmentFrames;
use unic_report::{Chart, Series};

use super::rows;

/// Smallest length of a bin in seconds. Errors of single frames are too noisy to read.
const LEAST_BIN_S: f32 = 0.1;
/// Largest number of bins, which limits the points of a line.
const MOST_BINS: usize = 150;

/// Squared errors of each row by frame, summed over all clips.
#[derive(Default)]
pub(super) struct Drift {
    fps: f32,
    truth: Option<GarmentFrames>,
    clips: usize,
    rows: Vec<(String, Vec<SquaredError>)>,
}

/// Sum of squared errors in m², with the number of its terms.
#[derive(Clone, Copy, Default)]
struct SquaredError {
    sum: f64,
    count: usize,
}

impl Drift {
    /// Begins the next clip.
    pub(super) fn start(&mut self, clip: &PreparedClip) {
        self.fps = clip.captured.clip.fps;
        self.truth = Some(clip.captured.garment.clone());
        self.clips += 1;
    }

    /// Adds the positions that a row predicts for a frame.
    pub(super) fn add(&mut self, row: &str, frame: usize, predicted: &[Vec3]) {
        let Some(truth) = &self.truth else { return };
        let pairs = predicted.iter().zip(truth.frame(frame));
        let squared: f64 = pairs.map(|(p, g)| f64::from(p.distance_squared(*g))).sum();
        // A vector instead of a map: there are about ten rows.
        let index = self.rows.iter().position(|(name, _)| name == row);
        let index = index.unwrap_or_else(|| {
            self.rows.push((row.to_owned(), Vec::new()));
            self.rows.len() - 1
        });
        let sums = &mut self.rows[index].1;
        if sums.len() <= frame {
            sums.resize(frame + 1, SquaredError::default());
        }
        sums[frame].sum += squared;
        sums[frame].count += predicted.len();
    }

    /// Chart with one line per row, in the order of the tables.
    pub(super) fn chart(&self) -> Chart {
        let bin = self.bin();
        let mut rows: Vec<&(String, Vec<SquaredError>)> = self.rows.iter().collect();
        rows.sort_by_key(|(name, _)| rows::row_order(name));
        let series = rows.into_iter().map(|(name, sums)| Series {
            name: rows::display_name(name),
            points: self.points(sums, bin),
        });
        Chart {
            title: "Error over time".into(),
            x: "time since the first frame, s".into(),
            y: "RMSE, mm".into(),
            series: series.collect(),
        }
    }

    /// Text below the chart that explains its lines.
    pub(super) fn note(&self) -> String {
        let clips = match self.clips {
            1 => "the clip".to_owned(),
            n => format!("all {n} clips that last that long"),
        };
        let seconds = self.bin() as f32 / self.fps.max(1.0);
        format!(
            "Free running from the first frame: RMSE over bins of {seconds:.2} s, over all vertices and {clips}. A line that leaves the chart at the top has diverged."
        )
    }

    /// Number of frames of a bin.
    fn bin(&self) -> usize {
        let longest = self.rows.iter().map(|(_, sums)| sums.len()).max().unwrap_or(0);
        let least = (LEAST_BIN_S * self.fps).round().max(1.0) as usize;
        least.max(longest.div_ceil(MOST_BINS))
    }

    /// Points of a line: time in seconds at the middle of a bin, RMSE in mm.
    fn points(&self, sums: &[SquaredError], bin: usize) -> Vec<(f64, f64)> {
        // Frame 0 is given and has no error.
        let bins = sums.get(1..).unwrap_or_default().chunks(bin).enumerate();
        let point = |(i, bin_sums): (usize, &[SquaredError])| {
            // The last bin may be shorter: its middle is computed from its own length.
            let middle = (1 + i * bin) as f64 + (bin_sums.len() - 1) as f64 / 2.0;
            let squared: f64 = bin_sums.iter().map(|frame| frame.sum).sum();
            let count: usize = bin_sums.iter().map(|frame| frame.count).sum();
            (
                middle / f64::from(self.fps),
                1e3 * (squared / count as f64).sqrt(),
            )
        };
        bins.map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_bin_is_the_rms_over_its_frames() {
        let sums = |errors: &[f64]| -> Vec<SquaredError> {
            let sum = |&e: &f64| SquaredError {
                sum: 2.0 * e * e,
                count: 2,
            };
            errors.iter().map(sum).collect()
        };
        let drift = Drift {
            fps: 30.0,
            ..Drift::default()
        };
        // Frame 0 is left out; the last bin is a part of one.
        let points = drift.points(&sums(&[9.0, 0.001, 0.007, 0.004]), 2);
        let expected = [(1.5 / 30.0, 5.0), (3.0 / 30.0, 4.0)];
        for ((x, y), (expected_x, expected_y)) in points.iter().zip(expected) {
            assert!(
                (x - expected_x).abs() < 1e-9 && (y - expected_y).abs() < 1e-9,
                "{points:?}"
            );
        }
        assert_eq!(points.len(), 2);
        assert!(drift.points(&[], 2).is_empty());
    }
}
