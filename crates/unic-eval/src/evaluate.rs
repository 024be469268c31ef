//! Evaluation: predictors run over clips of a capture, and every frame is measured.

use crate::{
    clip_evaluator::{ClipEvaluator, SumsByMode},
    error::{Error, Result},
    event::{Event, Observer, notify},
    kinematics::PreparedClip,
    life::judge,
    metrics::PooledMetrics,
    predictor::{MODEL, Mode, NamedPredictor},
    report::{ByMode, Evaluation, Scores},
    training::baseline_motion_spec,
};
use std::num::NonZeroUsize;
use unic_io::Capture;

/// Extent of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Protocol {
    /// Modes in which predictors run.
    pub modes: &'static [Mode],
    /// Number of frames to predict in each clip, from frame 1 on. `None` stands for all.
    pub frames: Option<NonZeroUsize>,
    /// Interval of the frames whose nearest points are searched, which takes most of the time.
    ///
    /// The Hausdorff distance and all metrics of the body come from these frames. Vertex errors,
    /// jitter and edge lengths come from every frame, measures of life from about ten in a second.
    pub nearest_every: NonZeroUsize,
}

impl Default for Protocol {
    /// All frames of whole clips, in both modes.
    fn default() -> Self {
        Self {
            modes: &[Mode::OneStep, Mode::FreeRunning],
            frames: None,
            nearest_every: NonZeroUsize::MIN,
        }
    }
}

/// Measures all predictors on the named clips of a capture, completely and in both modes.
///
/// Memory does not grow with the clips: one clip is open at a time, and its frames pass in chunks.
/// All predictors share the posed body and its trees. The result has the same bits for any number
/// of threads.
///
/// # Errors
/// No clips, files that cannot be used, and predictors or observers that fail.
pub fn evaluate(
    capture: &Capture,
    predictors: &mut [NamedPredictor],
    clips: &[String],
    observe: &mut Observer,
) -> Result<Evaluation> {
    evaluate_by(&Protocol::default(), capture, predictors, clips, observe)
}

/// Measures all predictors on the named clips of a capture as [`evaluate`] does, to the extent that
/// a protocol asks for.
///
/// # Errors
/// No clips, files that cannot be used, and predictors or observers that fail.
pub fn evaluate_by(
    protocol: &Protocol,
    capture: &Capture,
    predictors: &mut [NamedPredictor],
    clips: &[String],
    observe: &mut Observer,
) -> Result<Evaluation> {
    if clips.is_empty() {
        let capture = capture.manifest.name.clone();
        return Err(Error::NoClips { capture });
    }
    let spec = baseline_motion_spec(capture)?;
    let (modes, every) = (protocol.modes, protocol.nearest_every);
    let mut evaluator = ClipEvaluator::new(&capture.character, &capture.garment, modes, every)?;
    let mut windows = Vec::new();
    let mut pooled = vec![SumsByMode::default(); predictors.len()];
    let mut evaluation = Evaluation::default();
    for (index, name) in clips.iter().enumerate() {
        let mut captured = capture.load_clip(name)?;
        if let Some(frames) = protocol.frames {
            // Frame 0 is given and does not count.
            captured.clip.poses.truncate(frames.get() + 1);
        }
        let clip = PreparedClip::new(&spec, &capture.character.skeleton, captured);
        let started = Event::ClipStarted {
            clip: &clip,
            index,
            count: clips.len(),
        };
        notify(&clip, observe, &started)?;
        let results = evaluator.run(&clip, predictors, observe)?;
        let sums = results.sums;
        windows.push(results.windows);
        notify(&clip, observe, &Event::ClipFinished)?;
        evaluation.clips.insert(name.clone(), scores(predictors, &sums));
        // Clips are pooled in their order: floating-point sums depend on it.
        for (all, clip) in pooled.iter_mut().flatten().zip(sums.iter().flatten()) {
            all.pool(clip);
        }
    }
    evaluation.pooled = scores(predictors, &pooled);
    evaluation.judge = judge(predictors.iter().map(|named| named.name.as_str()), &windows);
    Ok(evaluation)
}

/// Turns the sums of each predictor into metrics. Modes without frames have none.
fn scores(predictors: &[NamedPredictor], sums: &[SumsByMode]) -> Scores {
    let mut scores = Scores::default();
    for (predictor, [one_step, free_running]) in predictors.iter().zip(sums) {
        let metrics = |s: &PooledMetrics| (s.frames() > 0).then(|| s.metrics());
        let by_mode = ByMode {
            one_step: metrics(one_step),
            free_running: metrics(free_running),
        };
        if predictor.name == MODEL {
            scores.model = Some(by_mode);
        } else {
            scores.baselines.insert(predictor.name.clone(), by_mode);
        }
    }
    scores
}
