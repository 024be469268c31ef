//! Free-running error during training, by the animator that users run.

use crate::{error::TrainError, event::Control, fit::Fit};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::{iter::zip, sync::Arc};
use unic_core::{
    animator::{Animator, Start, StepInput},
    config::IntersectionMode,
    mesh::TriMesh,
    model::{Model, ModelError},
    prior::Prior,
};
use unic_eval::{BendingRatio, Liveliness, LivingMeasure, PreparedClip, SelfCrossingShares};

/// Relation of validation clips to the fit that is measured on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ValidationMotion {
    /// The fit has not seen them: their error is that of unseen motion.
    Unseen,
    /// The fit was trained on one of them: the error is too small for unseen motion. A capture with
    /// one training clip has nothing else to measure on.
    TrainedOn,
}

impl ValidationMotion {
    /// Compares the names of the clips of a fit.
    pub(crate) fn of(validation: &[PreparedClip], training: &[PreparedClip]) -> Self {
        let is_trained_on = |clip: &PreparedClip| training.iter().any(|t| t.name() == clip.name());
        match validation.iter().any(is_trained_on) {
            true => Self::TrainedOn,
            false => Self::Unseen,
        }
    }
}

/// Result of a run's validation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Validation {
    /// The fit that was measured.
    pub fit: Fit,
    /// Relation of the clips to that fit.
    pub motion: ValidationMotion,
    /// The clips that it was measured on.
    pub clips: Vec<String>,
    /// Free-running RMSE, millimetres, with the share below.
    pub rmse_mm: f64,
    /// Factor of the field's output, 0 to 1, with the least error in the clips' first [`JUDGED_S`]
    /// seconds.
    pub field_share: f32,
    /// Share of an offset's bending that a sweep of the strain projection removes, 0 to 1. With it
    /// the garment bends about as much as the truth, on the starts of these clips and of some that the
    /// fit has trained on, each with the prior of the other motions. None without a projection.
    pub bending: Option<f32>,
    /// Least lengths of the chords of taut cloth that hangs free of the body, in standard deviations
    /// below their mean in training. Below the largest of the settings only where the garment, with the
    /// bending above, bends over a tenth more than the truth on the same starts, on average over the
    /// clips. None without a
    /// projection, and without such chords.
    pub chord_deviations: Option<f32>,
    /// Least distance along the smoothed cloth that pushes restore, in mean edge lengths; 0 for no
    /// pushes. With it the garment passes through itself least beyond what the truth does on the same
    /// starts, at an error of at most 1 % more. None without a projection.
    pub order: Option<f32>,
    /// Factor of the replayed wrinkles, 0.5 to 4. With it they come and go as much as the truth's on the
    /// same starts, or as much as `replay.cost` allows. None without a replay, with fewer than five
    /// motions, on a clip that the fit has trained on, and where no truth wrinkles.
    pub replay_factor: Option<f32>,
}

/// Values of a model that a validation chooses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Chosen {
    /// Factor of the field's output, 0 to 1.
    pub(crate) field_share: f32,
    /// Bending of the strain projection; none for that of the settings.
    pub(crate) bending: Option<f32>,
    /// Least lengths of free chords; none for those of the settings.
    pub(crate) chord_deviations: Option<f32>,
    /// Order of the strain projection; none for that of the settings.
    pub(crate) order: Option<f32>,
    /// Factor of the replayed wrinkles; none for 1.
    pub(crate) replay_factor: Option<f32>,
}

impl Chosen {
    /// The values before a validation: the whole field, and the settings.
    pub(crate) const SETTINGS: Self = Self {
        field_share: 1.0,
        bending: None,
        chord_deviations: None,
        order: None,
        replay_factor: None,
    };

    /// Multiplies the wrinkles that a prior replays by the factor.
    pub(crate) fn scale_replay(&self, prior: &mut Prior) -> Result<(), TrainError> {
        if let Some(factor) = self.replay_factor
            && let Some(replay) = prior.replay.take()
        {
            prior.replay = Some(replay.scaled(factor).map_err(ModelError::from)?);
        }
        Ok(())
    }
}

impl From<&Validation> for Chosen {
    fn from(validation: &Validation) -> Self {
        Self {
            field_share: validation.field_share,
            bending: validation.bending,
            chord_deviations: validation.chord_deviations,
            order: validation.order,
            replay_factor: validation.replay_factor,
        }
    }
}

/// Duration at the start of each clip on which shares of the field are compared, in seconds.
pub const JUDGED_S: f32 = 20.0;

/// Duration at the start of each clip in which bending is judged, in seconds.
pub(crate) const BENDING_S: f32 = 10.0;

/// RMSE in metres of a model that runs free from frame 0 through every clip, frame 0 not counted.
///
/// # Errors
/// Clips of another skeleton or garment.
pub fn free_running_rmse(model: &Arc<Model>, clips: &[PreparedClip]) -> Result<f64, TrainError> {
    let intersection = model.config().intersection;
    free_running_rmse_of(model, clips, usize::MAX, intersection, &mut || Control::Continue)
}

/// Callback before each frame. Its answer to stop ends a measurement with [`TrainError::Stopped`].
pub(crate) type Proceed<'a> = dyn FnMut() -> Control + 'a;

/// Asks whether to stop.
pub(crate) fn go_on(proceed: &mut Proceed) -> Result<(), TrainError> {
    match proceed() {
        Control::Continue => Ok(()),
        Control::Stop => Err(TrainError::Stopped),
    }
}

/// RMSE in metres of single steps from the true frame before, over the first `most` frames of every
/// clip; intersections are not handled.
pub(crate) fn one_step_rmse_of(
    model: &Arc<Model>,
    clips: &[PreparedClip],
    most: usize,
    proceed: &mut Proceed,
) -> Result<f64, TrainError> {
    let mut error = MeanSquare::default();
    for clip in clips {
        let mut animator = Animator::new(model.clone());
        animator.set_intersection(IntersectionMode::Off);
        let garment = &clip.captured.garment;
        let input = |t: usize| StepInput::of_clip(&clip.captured.clip, t);
        animator.reset(&input(0), Start::Positions(garment.frame(0)))?;
        for t in 1..clip.len().min(most) {
            go_on(proceed)?;
            error.add(animator.step(&input(t))?.positions, garment.frame(t));
            // The next step starts from the true garment instead of the prediction.
            animator.set_garment(garment.frame(t))?;
        }
    }
    Ok(error.root())
}

/// Mean squared distance of points.
#[derive(Default)]
struct MeanSquare {
    sum: f64,
    count: usize,
}

impl MeanSquare {
    fn add(&mut self, predicted: &[Vec3], truth: &[Vec3]) {
        let pairs = predicted.iter().zip(truth);
        // In f64: a long clip adds millions of small squares.
        self.sum += pairs.map(|(p, g)| f64::from(p.distance_squared(*g))).sum::<f64>();
        self.count += predicted.len();
    }

    fn root(&self) -> f64 {
        (self.sum / self.count.max(1) as f64).sqrt()
    }
}

/// RMSE in metres in free running over the first `most` frames of every clip, frame 0 not counted,
/// with the given intersection handling.
pub(crate) fn free_running_rmse_of(
    model: &Arc<Model>,
    clips: &[PreparedClip],
    most: usize,
    intersection: IntersectionMode,
    proceed: &mut Proceed,
) -> Result<f64, TrainError> {
    let mut error = MeanSquare::default();
    run_freely(
        model,
        clips,
        most,
        intersection,
        proceed,
        &mut |_, predicted, truth| {
            error.add(predicted, truth);
        },
    )?;
    Ok(error.root())
}

/// Bending and error of models in free running in the first [`BENDING_S`] seconds of several clips, in
/// about ten frames a second. Intersections are not handled.
pub(crate) struct FreeBending {
    /// Ratio over all clips so far.
    ratio: BendingRatio,
    /// Ratio without frames, with which each clip starts.
    empty: BendingRatio,
    /// Logarithms of the ratios of the clips.
    by_clip: Vec<f64>,
    error: MeanSquare,
}

impl FreeBending {
    /// Prepares measurements of a garment.
    pub(crate) fn new(rest: &TriMesh) -> Self {
        let empty = BendingRatio::new(rest);
        Self {
            ratio: empty.clone(),
            empty,
            by_clip: Vec::new(),
            error: MeanSquare::default(),
        }
    }

    /// Animates a model on the next clip.
    pub(crate) fn add(
        &mut self,
        model: &Arc<Model>,
        clip: &PreparedClip,
        proceed: &mut Proceed,
    ) -> Result<(), TrainError> {
        let fps = model.config().fps;
        let (most, every) = ((BENDING_S * fps) as usize, (fps / 10.0).round().max(1.0) as usize);
        let (clips, off) = (std::slice::from_ref(clip), IntersectionMode::Off);
        let mut of_clip = self.empty.clone();
        run_freely(model, clips, most, off, proceed, &mut |t, predicted, truth| {
            if t.is_multiple_of(every) {
                self.ratio.add(predicted, truth);
                of_clip.add(predicted, truth);
                self.error.add(predicted, truth);
            }
        })?;
        self.by_clip.extend(of_clip.ratio().map(f64::ln));
        Ok(())
    }

    /// Logarithm of the bending by the truth's, over all clips: lively ones decide. None if it is not
    /// finite, and without a truth that bends.
    pub(crate) fn excess(&self) -> Option<f64> {
        let excess = self.ratio.ratio().map(f64::ln);
        excess.filter(|excess| excess.is_finite())
    }

    /// Mean over the clips of the logarithm of the bending by the truth's, so that neither a calm motion
    /// nor a lively one decides alone. None if it is not finite, and where no truth bends.
    pub(crate) fn mean_excess(&self) -> Option<f64> {
        // Without a clip the quotient is not finite.
        let mean = self.by_clip.iter().sum::<f64>() / self.by_clip.len() as f64;
        mean.is_finite().then_some(mean)
    }

    /// RMSE, metres.
    pub(crate) fn rmse(&self) -> f64 {
        self.error.root()
    }
}

/// Self-crossings and error of models in free running in the first [`BENDING_S`] seconds of several
/// clips, in about three frames a second. Intersections are handled as the model says: the handling
/// makes some of the crossings.
#[derive(Default)]
pub(crate) struct FreeCrossings {
    /// Shares of the edges of each clip by which the prediction has more crossings than the truth.
    excess: Vec<f64>,
    error: MeanSquare,
}

impl FreeCrossings {
    /// Animates a model on the next clip. `crossings` has no frames yet.
    pub(crate) fn add(
        &mut self,
        mut crossings: SelfCrossingShares,
        model: &Arc<Model>,
        clip: &PreparedClip,
        proceed: &mut Proceed,
    ) -> Result<(), TrainError> {
        let fps = model.config().fps;
        let (most, every) = ((BENDING_S * fps) as usize, (fps / 3.0).round().max(1.0) as usize);
        let garment = &clip.captured.garment;
        let input = |t: usize| StepInput::of_clip(&clip.captured.clip, t);
        let mut shown = Animator::new(model.clone());
        let mut running = shown.clone();
        // Handling of what is shown changes no later frame and takes most of the time, so that the
        // frames between are left out.
        if !shown.intersection().corrects_state() {
            running.set_intersection(IntersectionMode::Off);
        }
        running.reset(&input(0), Start::Positions(garment.frame(0)))?;
        for t in 1..clip.len().min(most) {
            go_on(proceed)?;
            running.step(&input(t))?;
            if t.is_multiple_of(every) {
                let predicted = shown.restore(running.state().clone())?.positions;
                crossings.add(predicted, garment.frame(t));
                self.error.add(predicted, garment.frame(t));
            }
        }
        let Some([predicted, truth]) = crossings.shares() else {
            // The clip is too short to judge.
            return Ok(());
        };
        // Not a maximum, which would hide NaN.
        self.excess.push(match predicted < truth {
            true => 0.0,
            false => predicted - truth,
        });
        Ok(())
    }

    /// Mean over the clips of what each has more than the truth, 0 to 1. NaN where a prediction is not
    /// finite, and where all clips are too short.
    pub(crate) fn excess(&self) -> f64 {
        self.excess.iter().sum::<f64>() / self.excess.len() as f64
    }

    /// RMSE of the shown garment, metres.
    pub(crate) fn rmse(&self) -> f64 {
        self.error.root()
    }
}

/// Life and error of models in free running in the first [`BENDING_S`] seconds of several clips.
/// Intersections are not handled.
#[derive(Default)]
pub(crate) struct FreeLife {
    /// Wrinkles in each clip.
    clips: Vec<Liveliness>,
    error: MeanSquare,
}

impl FreeLife {
    /// Animates a model on the next clip.
    pub(crate) fn add(
        &mut self,
        measure: &LivingMeasure,
        model: &Arc<Model>,
        clip: &PreparedClip,
        proceed: &mut Proceed,
    ) -> Result<(), TrainError> {
        let (most, every) = living_frames(model.config().fps);
        let (clips, off) = (std::slice::from_ref(clip), IntersectionMode::Off);
        let mut shown: Vec<Vec<Vec3>> = Vec::new();
        run_freely(model, clips, most, off, proceed, &mut |t, predicted, truth| {
            self.error.add(predicted, truth);
            if t.is_multiple_of(every) {
                shown.push(predicted.to_vec());
            }
        })?;
        let shown: Vec<_> = shown.iter().map(Vec::as_slice).collect();
        self.clips.push(measure.liveliness(&shown));
        Ok(())
    }

    /// Logarithm of the living ratio, averaged over the clips so that neither a calm motion nor a
    /// lively one decides alone. None where no truth is alive.
    pub(crate) fn excess(&self, truth: &[Liveliness]) -> Option<f64> {
        let ratios = zip(&self.clips, truth).filter_map(|(clip, truth)| clip.ratio(truth));
        let logarithms: Vec<f64> = ratios.map(f64::ln).collect();
        let mean = logarithms.iter().sum::<f64>() / logarithms.len() as f64;
        (!logarithms.is_empty()).then_some(mean)
    }

    /// RMSE, metres.
    pub(crate) fn rmse(&self) -> f64 {
        self.error.root()
    }
}

/// Liveliness of the truth in the frames in which [`FreeLife`] measures a model.
pub(crate) fn true_liveliness(measure: &LivingMeasure, clip: &PreparedClip) -> Liveliness {
    let (most, every) = living_frames(clip.captured.clip.fps);
    let frames = (1..clip.len().min(most)).filter(|t| t.is_multiple_of(every));
    let frames: Vec<_> = frames.map(|t| clip.captured.garment.frame(t)).collect();
    measure.liveliness(&frames)
}

/// Number of frames of a clip in which life is judged, and the interval of those that are measured:
/// about three in a second, which wrinkles hardly outrun.
pub(crate) fn living_frames(fps: f32) -> (usize, usize) {
    ((BENDING_S * fps) as usize, (fps / 3.0).round().max(1.0) as usize)
}

/// Receiver of the index, the predicted and the true positions of a frame.
type See<'a> = dyn FnMut(usize, &[Vec3], &[Vec3]) + 'a;

/// Runs a model freely from frame 0 through the first `most` frames of every clip. `see` gets
/// each later frame.
fn run_freely(
    model: &Arc<Model>,
    clips: &[PreparedClip],
    most: usize,
    intersection: IntersectionMode,
    proceed: &mut Proceed,
    see: &mut See,
) -> Result<(), TrainError> {
    for clip in clips {
        let mut animator = Animator::new(model.clone());
        animator.set_intersection(intersection);
        let garment = &clip.captured.garment;
        let motion = &clip.captured.clip;
        let input = |t: usize| StepInput::of_clip(motion, t);
        animator.reset(&input(0), Start::Positions(garment.frame(0)))?;
        for t in 1..clip.len().min(most) {
            go_on(proceed)?;
            see(t, animator.step(&input(t))?.positions, garment.frame(t));
        }
    }
    Ok(())
}
