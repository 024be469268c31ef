//! Bending, self-crossings and life of the cloth that a model shows in free running.
//!
//! All are measured in the first [`JUDGED_START_S`] seconds of a clip, then summed over clips.

use super::{MeanSquare, See, run_freely};
use crate::{error::TrainError, event::Control};
use glam::Vec3;
use std::{iter::zip, sync::Arc};
use unic_core::{
    animator::{Animator, Start, StepInput},
    config::IntersectionMode,
    model::Model,
};
use unic_eval::{BendingRatio, Liveliness, LivingMeasure, PreparedClip, SelfCrossingShares};

/// Duration at the start of each clip in which the shown cloth is judged, in seconds.
pub(crate) const JUDGED_START_S: f32 = 10.0;

/// Callback before each frame, from several threads. Its answer to stop ends a measurement with
/// [`TrainError::Stopped`].
pub(crate) type Ask<'a> = dyn Fn() -> Control + Sync + 'a;

/// Bending and error in a clip, in about ten frames a second. Intersections are not handled.
pub(crate) struct ClipBending {
    ratio: BendingRatio,
    error: MeanSquare,
}

impl ClipBending {
    /// Animates a model. `ratio` has no frames yet.
    pub(crate) fn measure(
        mut ratio: BendingRatio,
        model: &Arc<Model>,
        clip: &PreparedClip,
        ask: &Ask,
    ) -> Result<Self, TrainError> {
        let fps = model.config().fps;
        let every = (fps / 10.0).round().max(1.0) as usize;
        let mut error = MeanSquare::default();
        run_start(model, clip, ask, &mut |t, predicted, truth| {
            if t.is_multiple_of(every) {
                ratio.add(predicted, truth);
                error.add(predicted, truth);
            }
        })?;
        Ok(Self { ratio, error })
    }
}

/// Bending by the truth's and error of several clips.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bending {
    /// Logarithm of the bending by the truth's over all clips: lively ones decide. None if it is not
    /// finite, and without a truth that bends.
    pub(crate) all: Option<f64>,
    /// Mean over the clips of the logarithm of the bending by the truth's, so that neither a calm motion
    /// nor a lively one decides alone. None if it is not finite, and where no truth bends.
    pub(crate) by_clip: Option<f64>,
    /// RMSE, metres.
    pub(crate) rmse: f64,
}

impl Bending {
    pub(crate) fn over(clips: &[ClipBending]) -> Self {
        let ratios = clips.iter().map(|clip| &clip.ratio);
        let all = BendingRatio::over(ratios.clone()).map(f64::ln);
        Self {
            all: all.filter(|all| all.is_finite()),
            by_clip: mean(ratios.filter_map(BendingRatio::ratio).map(f64::ln)),
            rmse: MeanSquare::over(clips.iter().map(|clip| &clip.error)).root(),
        }
    }
}

/// Self-crossings and error in a clip, in about three frames a second. Intersections are handled as the
/// model says: the handling makes some of the crossings.
pub(crate) struct ClipCrossings {
    /// Share of the edges by which the prediction has more crossings than the truth. None for a clip that
    /// is too short.
    excess: Option<f64>,
    error: MeanSquare,
}

impl ClipCrossings {
    /// Animates a model. `crossings` has no frames yet.
    pub(crate) fn measure(
        mut crossings: SelfCrossingShares,
        model: &Arc<Model>,
        clip: &PreparedClip,
        ask: &Ask,
    ) -> Result<Self, TrainError> {
        let fps = model.config().fps;
        let (most, every) = living_frames(fps);
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
        let mut error = MeanSquare::default();
        for t in 1..clip.len().min(most) {
            go_on(ask)?;
            running.step(&input(t))?;
            if t.is_multiple_of(every) {
                let predicted = shown.restore(running.state().clone())?.positions;
                crossings.add(predicted, garment.frame(t));
                error.add(predicted, garment.frame(t));
            }
        }
        // Not a maximum, which would hide NaN.
        let excess = crossings
            .shares()
            .map(|[predicted, truth]| match predicted < truth {
                true => 0.0,
                false => predicted - truth,
            });
        Ok(Self { excess, error })
    }
}

/// Self-crossings and error of several clips.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossings {
    /// Mean over the clips of what each has more than the truth, 0 to 1. NaN where a prediction is not
    /// finite, and where all clips are too short.
    pub(crate) excess: f64,
    /// RMSE of the shown garment, metres.
    pub(crate) rmse: f64,
}

impl Crossings {
    pub(crate) fn over(clips: &[ClipCrossings]) -> Self {
        let excess: Vec<f64> = clips.iter().filter_map(|clip| clip.excess).collect();
        Self {
            excess: excess.iter().sum::<f64>() / excess.len() as f64,
            rmse: MeanSquare::over(clips.iter().map(|clip| &clip.error)).root(),
        }
    }
}

/// Life and error in a clip. Intersections are not handled.
pub(crate) struct ClipLife {
    wrinkles: Liveliness,
    error: MeanSquare,
}

impl ClipLife {
    /// Animates a model.
    pub(crate) fn measure(
        measure: &LivingMeasure,
        model: &Arc<Model>,
        clip: &PreparedClip,
        ask: &Ask,
    ) -> Result<Self, TrainError> {
        let (_, every) = living_frames(model.config().fps);
        let (mut shown, mut error) = (Vec::<Vec<Vec3>>::new(), MeanSquare::default());
        run_start(model, clip, ask, &mut |t, predicted, truth| {
            error.add(predicted, truth);
            if t.is_multiple_of(every) {
                shown.push(predicted.to_vec());
            }
        })?;
        let shown: Vec<_> = shown.iter().map(Vec::as_slice).collect();
        Ok(Self {
            wrinkles: measure.liveliness(&shown),
            error,
        })
    }
}

/// Life and error of several clips.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Life {
    /// Logarithm of the living ratio, averaged over the clips so that neither a calm motion nor a
    /// lively one decides alone. None if it is not finite, and where no truth is alive.
    pub(crate) excess: Option<f64>,
    /// RMSE, metres.
    pub(crate) rmse: f64,
}

impl Life {
    /// Compares clips with the truth of each.
    pub(crate) fn over(clips: &[ClipLife], truth: &[Liveliness]) -> Self {
        let ratios = zip(clips, truth).filter_map(|(clip, truth)| clip.wrinkles.ratio(truth));
        Self {
            excess: mean(ratios.map(f64::ln)),
            rmse: MeanSquare::over(clips.iter().map(|clip| &clip.error)).root(),
        }
    }
}

/// Liveliness of the truth in the frames in which [`ClipLife`] measures a model.
pub(crate) fn true_liveliness(
    measure: &LivingMeasure,
    clip: &PreparedClip,
    ask: &Ask,
) -> Result<Liveliness, TrainError> {
    go_on(ask)?;
    let (most, every) = living_frames(clip.captured.clip.fps);
    let frames = (1..clip.len().min(most)).filter(|t| t.is_multiple_of(every));
    let frames: Vec<_> = frames.map(|t| clip.captured.garment.frame(t)).collect();
    Ok(measure.liveliness(&frames))
}

/// Number of frames of a clip in which life is judged, and the interval of those that are measured:
/// about three in a second, which wrinkles hardly outrun.
pub(crate) fn living_frames(fps: f32) -> (usize, usize) {
    (judged_start(fps), (fps / 3.0).round().max(1.0) as usize)
}

/// Number of frames in which the shown cloth is judged.
fn judged_start(fps: f32) -> usize {
    (JUDGED_START_S * fps) as usize
}

/// Runs a model freely through the start of a clip, without intersection handling.
fn run_start(model: &Arc<Model>, clip: &PreparedClip, ask: &Ask, see: &mut See) -> Result<(), TrainError> {
    let (clips, off) = (std::slice::from_ref(clip), IntersectionMode::Off);
    run_freely(
        model,
        clips,
        judged_start(model.config().fps),
        off,
        &mut || ask(),
        see,
    )
}

/// Asks whether to stop.
fn go_on(ask: &Ask) -> Result<(), TrainError> {
    super::go_on(&mut || ask())
}

/// Mean of numbers; none without any, and if it is not finite.
fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let numbers: Vec<f64> = numbers.collect();
    // Without numbers the quotient is not finite.
    let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
    mean.is_finite().then_some(mean)
}
