//! Metrics of an evaluation, and the sums that they are computed from.

use crate::{
    life::{BandMetrics, LifeSums},
    predictor::Mode,
};
use glam::Vec3;
use serde::{Deserialize, Deserializer, Serialize};

/// Millimetres in a metre. Sums are in metres, metrics in millimetres.
const MM: f64 = 1e3;

/// Tolerance in frames when the time of a frame is compared with whole seconds, for frame rates
/// such as 29.97.
const FRAME_SLACK: f64 = 1e-6;

/// Distance of a prediction from the truth. Names and order of the fields are a public JSON
/// contract.
///
/// In the following e = ‖predicted − truth‖ of one vertex in one frame. Frame 0 is given to every
/// predictor and does not count. A value that is not finite (a diverged model) is `null` in JSON
/// and NaN here.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metrics {
    /// Square root of the mean of e² over frames and vertices, mm. This is the main metric.
    #[serde(deserialize_with = "number")]
    pub rmse_mm: f64,
    /// RMSE of single coordinates, mm: `rmse_mm` / √3.
    #[serde(deserialize_with = "number")]
    pub rmse_per_coordinate_mm: f64,
    /// Mean of e, mm (TailorNet's metric).
    #[serde(deserialize_with = "number")]
    pub mean_vertex_error_mm: f64,
    /// Mean over frames of the frame's RMSE, mm.
    #[serde(deserialize_with = "number")]
    pub mean_frame_rmse_mm: f64,
    /// Symmetric vertex-to-vertex Hausdorff distance of each frame, averaged over frames, mm.
    #[serde(deserialize_with = "number")]
    pub hausdorff_mm: f64,
    /// Share of garment vertices inside the body by the tangent plane of the nearest body vertex,
    /// %.
    #[serde(deserialize_with = "number")]
    pub intersecting_vertices_percent_paper: f64,
    /// Share of garment vertices inside the body by the sign at the closest surface point, %.
    #[serde(deserialize_with = "number")]
    pub intersecting_vertices_percent_closest: f64,
    /// Share of frames with any vertex inside the body by the closest surface point, %.
    #[serde(deserialize_with = "number")]
    pub intersecting_frames_percent: f64,
    /// Mean depth below the body's surface of the vertices inside, mm. 0 where none is inside.
    #[serde(deserialize_with = "number")]
    pub mean_depth_mm: f64,
    /// Largest depth below the body's surface, mm.
    #[serde(deserialize_with = "number")]
    pub max_depth_mm: f64,
    /// RMS second difference over time, divided by that of the truth. 1 matches the truth.
    #[serde(deserialize_with = "number")]
    pub jitter_ratio: f64,
    /// Mean of |l − l_truth| / l_truth over the garment's edges, %.
    #[serde(deserialize_with = "number")]
    pub edge_length_error_percent: f64,
    /// RMSE over the first second of free running, mm. `None` where no clip lasts that long, and in
    /// one-step evaluation.
    pub rmse_mm_at_1s: Option<f64>,
    /// RMSE over the fifth second of free running, mm; otherwise as `rmse_mm_at_1s`.
    pub rmse_mm_at_5s: Option<f64>,
    /// RMSE over the tenth second of free running, mm; otherwise as `rmse_mm_at_1s`.
    pub rmse_mm_at_10s: Option<f64>,
    /// RMSE over the sixtieth second of free running, mm; otherwise as `rmse_mm_at_1s`.
    pub rmse_mm_at_60s: Option<f64>,
    /// RMSE of each second of free running, mm. The last second may be incomplete. Empty in
    /// one-step evaluation.
    #[serde(deserialize_with = "numbers")]
    pub drift_mm: Vec<f64>,
    /// Wrinkles by wavelength, the finest band first. Empty in one-step evaluation, as the other
    /// measures of life are `None`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bands: Vec<BandMetrics>,
    /// 1st percentile over edges and frames of the signed strain against the rest length, %. It is
    /// not finite outside of −100 to 300 %.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "present"
    )]
    pub strain_p01_percent: Option<f64>,
    /// 99th percentile of the strain, %.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "present"
    )]
    pub strain_p99_percent: Option<f64>,
    /// 1st percentile of the truth's strain, %.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "present"
    )]
    pub strain_p01_percent_truth: Option<f64>,
    /// 99th percentile of the truth's strain, %.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "present"
    )]
    pub strain_p99_percent_truth: Option<f64>,
    /// RMS over edges and frames of the dihedral angle minus that at rest, divided by the truth's.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "present"
    )]
    pub bending_ratio: Option<f64>,
    /// 99th percentile over vertices and frames of ‖x_t − 2 x_{t−1} + x_{t−2}‖, divided by the
    /// truth's.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "present"
    )]
    pub popping_ratio: Option<f64>,
    /// Share of the garment's edges that pass through a face of the garment which they do not
    /// touch, over edges and frames, %.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "present"
    )]
    pub self_crossing_edges_percent: Option<f64>,
    /// The same share of the truth's edges, %.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "present"
    )]
    pub self_crossing_edges_percent_truth: Option<f64>,
}

/// Reads a number. `null` becomes NaN.
pub(crate) fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Reads a number whose key is present. `null` becomes NaN.
fn present<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    number(deserializer).map(Some)
}

/// Reads numbers. `null` becomes NaN.
fn numbers<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let all: Vec<Option<f64>> = Vec::deserialize(deserializer)?;
    Ok(all.into_iter().map(|n| n.unwrap_or(f64::NAN)).collect())
}

/// Measurements of one predicted frame, as sums in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameSums {
    /// Number of garment vertices V.
    pub vertices: usize,
    /// Σ e², m².
    pub squared: f64,
    /// Σ e, m.
    pub distance: f64,
    /// Symmetric Hausdorff distance, m.
    pub hausdorff: f64,
    /// Number of vertices whose nearest points were searched: V, or 0 in a frame without this
    /// search.
    pub probed: usize,
    /// Number of vertices inside by the paper's test.
    pub inside_paper: usize,
    /// Number of vertices inside by the closest surface point.
    pub inside_closest: usize,
    /// Σ depth of the vertices inside by the closest surface point, m.
    pub depth: f64,
    /// Largest depth of a vertex inside by the closest surface point, m.
    pub max_depth: f64,
    /// Σ |l − l_truth| / l_truth over the edges.
    pub edge_error: f64,
    /// Number of edges in `edge_error`.
    pub edges: usize,
    /// Σ ‖x_t − 2 x_{t−1} + x_{t−2}‖² of prediction and truth, m². Zero for the first frames.
    pub second_difference: [f64; 2],
}

/// Sums over the frames of one clip.
#[derive(Clone, Debug)]
pub struct ClipMetrics {
    fps: f64,
    mode: Mode,
    last_frame: usize,
    sums: PooledMetrics,
}

impl ClipMetrics {
    /// Starts with no frames. `fps` is the clip's frame rate.
    pub fn new(fps: f32, mode: Mode) -> Self {
        Self {
            fps: f64::from(fps),
            mode,
            last_frame: 0,
            sums: PooledMetrics::default(),
        }
    }

    /// Adds frame `frame`. Frame 0 is ignored. Frames must come in ascending order.
    pub fn add(&mut self, frame: usize, measured: &FrameSums) {
        if frame == 0 || measured.vertices == 0 {
            return;
        }
        self.last_frame = frame;
        self.sums.add(measured);
        // One-step predictions do not depend on the time since frame 0.
        if self.mode == Mode::FreeRunning {
            self.sums.second(self.second_of(frame)).add(measured);
        }
    }

    /// Returns the sums of the clip, which can be pooled with those of others.
    pub fn finish(mut self) -> PooledMetrics {
        // A second is complete when the frame after the clip's last would belong to a later one.
        let whole = self.second_of(self.last_frame + 1);
        for second in self.sums.seconds.iter_mut().take(whole) {
            second.whole = second.part;
        }
        self.sums
    }

    /// Returns the second of free running that a frame belongs to. Second k holds the times in (k,
    /// k + 1].
    fn second_of(&self, frame: usize) -> usize {
        // Frame k · fps ends second k and belongs to it.
        let end = (frame as f64 - FRAME_SLACK) / self.fps;
        end.max(0.0).floor() as usize
    }
}

/// Sum of squared errors, and number of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SquaredErrors {
    /// Sum of squared errors, m².
    pub(crate) sum: f64,
    /// Number of vertices.
    pub(crate) samples: usize,
}

impl SquaredErrors {
    /// Sums the squared distances between vertices, m².
    pub(crate) fn between(predicted: &[Vec3], truth: &[Vec3]) -> Self {
        let pairs = predicted.iter().zip(truth);
        Self {
            sum: pairs
                .map(|(p, g)| (p.as_dvec3() - g.as_dvec3()).length_squared())
                .sum(),
            samples: truth.len(),
        }
    }

    /// Returns the root mean square error, mm. `None` without samples.
    pub(crate) fn rmse_mm(&self) -> Option<f64> {
        (self.samples > 0).then(|| MM * (self.sum / self.samples as f64).sqrt())
    }

    /// Adds other errors.
    pub(crate) fn pool(&mut self, other: &Self) {
        self.sum += other.sum;
        self.samples += other.samples;
    }
}

/// Errors of one second of free running.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Second {
    /// Errors of all clips.
    part: SquaredErrors,
    /// Errors of the clips that last to the end of this second.
    whole: SquaredErrors,
}

impl Second {
    fn add(&mut self, frame: &FrameSums) {
        self.part.pool(&SquaredErrors {
            sum: frame.squared,
            samples: frame.vertices,
        });
    }
}

/// Sums over any number of clips.
///
/// Clips are pooled by adding sums, not by averaging means, so that a long clip counts more than a
/// short one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PooledMetrics {
    frames: usize,
    /// Number of frames with a search for nearest points.
    frames_probed: usize,
    /// Number of frames with a vertex inside the body.
    frames_inside: usize,
    /// Sum of the RMSE of each frame, m.
    frame_rmse: f64,
    /// Sums over all frames.
    total: FrameSums,
    /// Errors of each second of free running.
    seconds: Vec<Second>,
    /// Sums behind the measures of life. `None` where they are not measured.
    life: Option<LifeSums>,
}

impl PooledMetrics {
    /// Adds the sums of other clips.
    pub fn pool(&mut self, other: &Self) {
        self.frames += other.frames;
        self.frames_probed += other.frames_probed;
        self.frames_inside += other.frames_inside;
        self.frame_rmse += other.frame_rmse;
        self.total.pool(&other.total);
        for (k, second) in other.seconds.iter().enumerate() {
            let mine = self.second(k);
            mine.part.pool(&second.part);
            mine.whole.pool(&second.whole);
        }
        match (&mut self.life, &other.life) {
            (Some(mine), Some(other)) => mine.pool(other),
            (mine, other) => *mine = mine.take().or_else(|| other.clone()),
        }
    }

    /// Sets the sums behind the measures of life, which [`ClipMetrics`] does not gather.
    pub(crate) fn set_life(&mut self, life: LifeSums) {
        self.life = Some(life);
    }

    /// Returns the number of frames.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Returns the metrics of everything that is pooled. They are NaN where nothing is.
    pub fn metrics(&self) -> Metrics {
        let total = &self.total;
        // Divisions by zero give NaN, which stands for metrics of nothing.
        let a_vertex = 1.0 / total.vertices as f64;
        let a_frame = 1.0 / self.frames as f64;
        let (a_probed_frame, a_probed_vertex) = (1.0 / self.frames_probed as f64, 1.0 / total.probed as f64);
        let rmse_mm = MM * (total.squared * a_vertex).sqrt();
        let at = |second: usize| self.seconds.get(second - 1)?.whole.rmse_mm();
        let drift = |s: &Second| s.part.rmse_mm().unwrap_or(f64::NAN);
        let mut metrics = Metrics {
            rmse_mm,
            rmse_per_coordinate_mm: rmse_mm / 3.0_f64.sqrt(),
            mean_vertex_error_mm: MM * total.distance * a_vertex,
            mean_frame_rmse_mm: MM * self.frame_rmse * a_frame,
            hausdorff_mm: MM * total.hausdorff * a_probed_frame,
            intersecting_vertices_percent_paper: 100.0 * total.inside_paper as f64 * a_probed_vertex,
            intersecting_vertices_percent_closest: 100.0 * total.inside_closest as f64 * a_probed_vertex,
            intersecting_frames_percent: 100.0 * self.frames_inside as f64 * a_probed_frame,
            // 0 vertices inside have depth 0, not NaN: that is the best result, not a missing one.
            mean_depth_mm: MM * total.depth / total.inside_closest.max(1) as f64,
            max_depth_mm: MM * total.max_depth,
            jitter_ratio: ratio(total.second_difference),
            edge_length_error_percent: 100.0 * total.edge_error / total.edges.max(1) as f64,
            rmse_mm_at_1s: at(1),
            rmse_mm_at_5s: at(5),
            rmse_mm_at_10s: at(10),
            rmse_mm_at_60s: at(60),
            drift_mm: self.seconds.iter().map(drift).collect(),
            ..Metrics::default()
        };
        if let Some(life) = &self.life {
            life.write(&mut metrics);
        }
        metrics
    }

    /// Adds one frame.
    fn add(&mut self, frame: &FrameSums) {
        self.frames += 1;
        self.frames_probed += usize::from(frame.probed > 0);
        self.frames_inside += usize::from(frame.inside_closest > 0);
        self.frame_rmse += (frame.squared / frame.vertices as f64).sqrt();
        self.total.pool(frame);
    }

    /// Returns second `k`, which is added where it is missing.
    fn second(&mut self, k: usize) -> &mut Second {
        if self.seconds.len() <= k {
            self.seconds.resize(k + 1, Second::default());
        }
        &mut self.seconds[k]
    }
}

impl FrameSums {
    fn pool(&mut self, other: &Self) {
        self.vertices += other.vertices;
        self.squared += other.squared;
        self.distance += other.distance;
        self.hausdorff += other.hausdorff;
        self.probed += other.probed;
        self.inside_paper += other.inside_paper;
        self.inside_closest += other.inside_closest;
        self.depth += other.depth;
        self.max_depth = self.max_depth.max(other.max_depth);
        self.edge_error += other.edge_error;
        self.edges += other.edges;
        for (sum, more) in (self.second_difference.iter_mut()).zip(other.second_difference) {
            *sum += more;
        }
    }
}

/// Returns the RMS ratio of the squared sums of prediction and truth. It is 1 where both are 0.
pub(crate) fn ratio([predicted, truth]: [f64; 2]) -> f64 {
    // 0 / 0 would be NaN for a garment that stands still in both.
    if predicted == 0.0 && truth == 0.0 {
        return 1.0;
    }
    (predicted / truth).sqrt()
}

#[cfg(test)]
mod tests;
