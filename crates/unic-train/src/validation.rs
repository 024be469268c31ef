//! Free-running error during training, by the animator that users run.

mod shown;
mod trial;

pub(crate) use shown::{
    Ask, Bending, ClipBending, ClipCrossings, ClipLife, Crossings, JUDGED_START_S, Life, living_frames,
    true_liveliness,
};
pub use trial::{Chosen, Measured, ShownTrial};

use crate::{error::TrainError, event::Control, fit::Fit};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use unic_core::{
    animator::{Animator, Start, StepInput},
    config::IntersectionMode,
    model::Model,
};
use unic_eval::PreparedClip;

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
    /// Trials that chose bending, chords, factor and order, in the order of measurement. Not in the model
    /// file.
    #[serde(skip)]
    pub trials: Vec<ShownTrial>,
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

    /// Distances of several clips together.
    fn over<'a>(clips: impl IntoIterator<Item = &'a Self>) -> Self {
        let sum = |all: Self, clip: &Self| Self {
            sum: all.sum + clip.sum,
            count: all.count + clip.count,
        };
        clips.into_iter().fold(Self::default(), sum)
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
