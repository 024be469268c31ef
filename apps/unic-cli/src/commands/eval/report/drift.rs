//! Error against time of free running, for every row.

use glam::Vec3;
use unic_eval::PreparedClip;
use unic_io::frames::GarmentFrames;
use unic_report::{Chart, Series};

use super::scores;

/// Least length of a bin, seconds, and most bins: single frames are noise.
const LEAST_BIN_S: f32 = 0.1;
const MOST_BINS: usize = 150;

/// Sums of squared errors by frame, over all clips.
#[derive(Default)]
pub(super) struct Drift {
    fps: f32,
    truth: Option<GarmentFrames>,
    clips: usize,
    rows: Vec<(String, Vec<Sum>)>,
}

/// Squared errors in m², and how many.
#[derive(Clone, Copy, Default)]
struct Sum {
    squared: f64,
    count: usize,
}

impl Drift {
    /// The next clip.
    pub(super) fn start(&mut self, clip: &PreparedClip) {
        self.fps = clip.captured.clip.fps;
        self.truth = Some(clip.captured.garment.clone());
        self.clips += 1;
    }

    /// A frame of a row.
    pub(super) fn add(&mut self, row: &str, frame: usize, predicted: &[Vec3]) {
        let Some(truth) = &self.truth else { return };
        let pairs = predicted.iter().zip(truth.frame(frame));
        let squared: f64 = pairs.map(|(p, g)| f64::from(p.distance_squared(*g))).sum();
        let index = self.rows.iter().position(|(name, _)| name == row);
        let index = index.unwrap_or_else(|| {
            self.rows.push((row.to_owned(), Vec::new()));
            self.rows.len() - 1
        });
        let sums = &mut self.rows[index].1;
        if sums.len() <= frame {
            sums.resize(frame + 1, Sum::default());
        }
        sums[frame].squared += squared;
        sums[frame].count += predicted.len();
    }

    /// One line a row, in the order of the tables.
    pub(super) fn chart(&self) -> Chart {
        let bin = self.bin();
        let mut rows: Vec<&(String, Vec<Sum>)> = self.rows.iter().collect();
        rows.sort_by_key(|(name, _)| scores::place(name));
        let series = rows.into_iter().map(|(name, sums)| Series {
            name: scores::display_name(name),
            points: self.points(sums, bin),
        });
        Chart {
            title: "Error over time".into(),
            x: "time since the first frame, s".into(),
            y: "RMSE, mm".into(),
            series: series.collect(),
        }
    }

    /// What the lines are.
    pub(super) fn note(&self) -> String {
        let clips = match self.clips {
            1 => "the clip".to_owned(),
            n => format!("all {n} clips that last that long"),
        };
        let seconds = self.bin() as f32 / self.fps.max(1.0);
        format!(
            "Free running from the first frame: RMSE over bins of {seconds:.2} s, over all vertices and {clips}. A line that leaves the axes above has diverged."
        )
    }

    /// Frames a bin.
    fn bin(&self) -> usize {
        let longest = self.rows.iter().map(|(_, sums)| sums.len()).max().unwrap_or(0);
        let least = (LEAST_BIN_S * self.fps).round().max(1.0) as usize;
        least.max(longest.div_ceil(MOST_BINS))
    }

    /// Frame 0 is given and belongs to no bin.
    fn points(&self, sums: &[Sum], bin: usize) -> Vec<(f64, f64)> {
        let bins = sums.get(1..).unwrap_or_default().chunks(bin).enumerate();
        let point = |(i, bin_sums): (usize, &[Sum])| {
            let middle = (1 + i * bin) as f64 + (bin_sums.len() - 1) as f64 / 2.0;
            let squared: f64 = bin_sums.iter().map(|sum| sum.squared).sum();
            let count: usize = bin_sums.iter().map(|sum| sum.count).sum();
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
    fn bins_are_pooled_over_frames_and_clips_by_sums() {
        let sums = |errors: &[f64]| -> Vec<Sum> {
            let sum = |&e: &f64| Sum {
                squared: 2.0 * e * e,
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
