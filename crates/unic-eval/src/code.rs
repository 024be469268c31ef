//! Certainty of a model's motion code: how clearly motions select its categories.

use crate::kinematics::PreparedClip;
use serde::{Deserialize, Serialize};
use unic_core::{Model, network::EncoderScratch};

/// Certainty with which motions select the categories of a model's code.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CodeCertainty {
    /// Largest probability in the softmax of a channel's logits, averaged over channels and frames.
    /// 1 means that every category is certain.
    pub mean_top_probability: f64,
    /// Top probability of a uniform distribution: one over the number of categories.
    pub uniform: f64,
    /// Number of measured frames.
    pub frames: usize,
}

/// Largest number of measured frames, spread over all clips. An encoder of the published size reads
/// 94 MB for each.
const MOST_FRAMES: usize = 200;

impl CodeCertainty {
    /// Measures clips that are prepared with the model's own motion specification.
    ///
    /// Returns `None` where channels have a single category, so that nothing is selected, and where
    /// there are no frames.
    pub fn measure(model: &Model, clips: &[PreparedClip]) -> Option<Self> {
        let categories = model.config().encoder.categories;
        let pairs = |c: &PreparedClip| 1..c.kinematics.len();
        let all: usize = clips.iter().map(|c| pairs(c).len()).sum();
        if categories < 2 || all == 0 {
            return None;
        }
        let (mut scratch, mut input) = (EncoderScratch::default(), Vec::new());
        let (mut sum, mut frames) = (0.0, 0);
        // Every nth frame over all clips, so that long clips count more than short ones.
        let places = clips.iter().flat_map(|c| pairs(c).map(move |t| (c, t)));
        for (clip, t) in places.step_by(all.div_ceil(MOST_FRAMES)) {
            let pair = [clip.kinematics.motion(t - 1), clip.kinematics.motion(t)];
            model.normalisation().write_pair(pair, &mut input);
            sum += f64::from(model.encoder().top_probability(&input, &mut scratch));
            frames += 1;
        }
        Some(Self {
            mean_top_probability: sum / frames as f64,
            uniform: 1.0 / categories as f64,
            frames,
        })
    }

    /// Measures the named clips of a capture, as [`measure`](Self::measure) does.
    ///
    /// # Errors
    /// Files that cannot be used.
    pub fn of_clips(
        model: &Model,
        capture: &unic_io::Capture,
        names: &[String],
    ) -> crate::Result<Option<Self>> {
        let skeleton = &model.character().skeleton;
        let prepare = |name: &String| {
            let captured = capture.load_clip(name)?;
            Ok(PreparedClip::new(&model.config().motion, skeleton, captured))
        };
        let clips: crate::Result<Vec<_>> = names.iter().map(prepare).collect();
        Ok(Self::measure(model, &clips?))
    }
}

impl std::fmt::Display for CodeCertainty {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{:.3}, where {:.3} is undecided and 1 certain",
            self.mean_top_probability, self.uniform
        )
    }
}
