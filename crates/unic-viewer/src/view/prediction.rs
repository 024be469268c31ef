//! Shapes that are computed ahead in a thread of their own.

use super::source::ShapeFrames;
use glam::Vec3;
use std::sync::{
    Arc, Condvar, Mutex, MutexGuard, PoisonError,
    atomic::{AtomicBool, Ordering},
};
use std::time::Instant;
use unic_core::{
    Animator, Model, Start, StepInput,
    animator::Stage,
    character::{Character, Garment},
    clip::Clip,
};

/// Positions of a garment in free running, computed ahead of what is shown.
///
/// The thread ends with the last frame, after a failure, or when the prediction is dropped.
#[derive(Debug)]
pub struct Prediction {
    shared: Arc<Shared>,
    frames: usize,
}

/// Mean times of the stages of a step, milliseconds, in the order of [`Stage::ALL`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    sums_ms: [f64; Stage::ALL.len()],
    steps: usize,
}

/// State of a [`Prediction`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// Number of frames that are computed.
    pub done: usize,
    /// Number of frames of the motion.
    pub all: usize,
    /// Mean times of a step.
    pub stages: StageTimes,
    /// Reason why the computation has ended early.
    pub failure: Option<String>,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    grown: Condvar,
    stop: AtomicBool,
}

#[derive(Debug, Default)]
struct State {
    frames: Vec<Arc<[Vec3]>>,
    /// Root mean square distance from the truth in each frame, metres; empty without a truth.
    rmse_m: Vec<f32>,
    stages: StageTimes,
    failure: Option<String>,
}

impl StageTimes {
    /// Mean time of each stage, milliseconds.
    pub fn mean_ms(&self) -> impl Iterator<Item = (Stage, f64)> + '_ {
        let steps = self.steps.max(1) as f64;
        Stage::ALL.into_iter().zip(self.sums_ms.map(|sum| sum / steps))
    }

    /// Mean time of a step, milliseconds. Zero before the first one.
    pub fn step_ms(&self) -> f64 {
        self.sums_ms.iter().sum::<f64>() / self.steps.max(1) as f64
    }

    /// Number of steps that were measured.
    pub fn steps(&self) -> usize {
        self.steps
    }
}

impl Prediction {
    /// Runs a model on a motion. It starts from the true first frame, or from the mean shape
    /// without a truth.
    pub fn of_model(model: Arc<Model>, motion: Arc<Clip>, truth: Option<Arc<dyn ShapeFrames>>) -> Self {
        let mut animator = Animator::new(model);
        let frames = motion.len();
        let first = truth.clone();
        Self::start(frames, truth, move |frame, stages| {
            let input = StepInput::of_clip(&motion, frame);
            let garment = match (frame, &first) {
                (0, Some(truth)) => animator.reset(&input, Start::Positions(truth.positions(0))),
                (0, None) => animator.reset(&input, Start::MeanShape),
                _ => stages.measure(&mut animator, &input),
            };
            garment
                .map(|garment| garment.positions.into())
                .map_err(|error| error.to_string())
        })
    }

    /// Skins the rest shape of a garment to a motion.
    pub fn of_skinning(
        character: Arc<Character>,
        garment: Arc<Garment>,
        motion: Arc<Clip>,
        truth: Option<Arc<dyn ShapeFrames>>,
    ) -> Self {
        let (mut joints, mut world_from_rest, mut positions) = (Vec::new(), Vec::new(), Vec::new());
        Self::start(motion.len(), truth, move |frame, _| {
            let skeleton = &character.skeleton;
            skeleton.forward_kinematics(&motion.poses[frame], &mut joints);
            skeleton.world_from_rest(&joints, &mut world_from_rest);
            garment
                .weights
                .skin(&garment.rest.vertices, &world_from_rest, &mut positions);
            Ok(positions.as_slice().into())
        })
    }

    fn start(
        frames: usize,
        truth: Option<Arc<dyn ShapeFrames>>,
        mut shape: impl FnMut(usize, &mut StageTimes) -> Result<Arc<[Vec3]>, String> + Send + 'static,
    ) -> Self {
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let work = move || {
            let _announcing = AnnouncesPanic(&theirs);
            let mut stages = StageTimes::default();
            for frame in 0..frames {
                if theirs.stop.load(Ordering::Relaxed) {
                    return;
                }
                let shape = shape(frame, &mut stages);
                let known = truth.as_ref().filter(|truth| frame < truth.frame_count());
                let mut state = theirs.lock();
                match shape {
                    Ok(positions) => {
                        if let Some(truth) = known {
                            state.rmse_m.push(rmse(&positions, truth.positions(frame)));
                        }
                        state.frames.push(positions);
                    }
                    Err(failure) => state.failure = Some(failure),
                }
                state.stages = stages;
                let failed = state.failure.is_some();
                drop(state);
                theirs.grown.notify_all();
                if failed {
                    return;
                }
            }
        };
        let spawned = std::thread::Builder::new().name("prediction".into()).spawn(work);
        if let Err(error) = spawned {
            shared.lock().failure = Some(format!("a thread cannot be started: {error}"));
        }
        Self { shared, frames }
    }

    /// State of the computation.
    pub fn progress(&self) -> Progress {
        let state = self.shared.lock();
        Progress {
            done: state.frames.len(),
            all: self.frames,
            stages: state.stages,
            failure: state.failure.clone(),
        }
    }

    /// Number of frames of the motion.
    pub fn frame_count(&self) -> usize {
        self.frames
    }

    /// Whether the thread has nothing left to do.
    pub fn has_ended(&self) -> bool {
        let state = self.shared.lock();
        state.failure.is_some() || state.frames.len() == self.frames
    }

    /// World positions in a frame, metres; none as long as they are not computed.
    pub fn positions(&self, frame: usize) -> Option<Arc<[Vec3]>> {
        self.shared.lock().frames.get(frame).cloned()
    }

    /// Whether nothing is to be waited for: the frame is computed, or never will be.
    pub fn is_ready(&self, frame: usize) -> bool {
        let state = self.shared.lock();
        state.failure.is_some() || frame < state.frames.len() || frame >= self.frames
    }

    /// Blocks until a frame is computed, or the computation has failed.
    pub fn wait_for(&self, frame: usize) {
        let mut state = self.shared.lock();
        let frame = frame.min(self.frames.saturating_sub(1));
        while state.frames.len() <= frame && state.failure.is_none() && self.frames > 0 {
            let woken = self.shared.grown.wait(state);
            state = woken.unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Root mean square distance from the truth in the frames so far, metres; empty without a
    /// truth.
    pub fn rmse_m(&self) -> Vec<f32> {
        self.shared.lock().rmse_m.clone()
    }
}

impl Drop for Prediction {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}

impl Shared {
    /// Locks the state, also after a panic in another thread: it is valid at any time.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl StageTimes {
    /// Steps an animator and adds the times of the stages.
    fn measure<'a>(
        &mut self,
        animator: &'a mut Animator,
        input: &StepInput,
    ) -> Result<unic_core::GarmentFrame<'a>, unic_core::AnimatorError> {
        let mut last = Instant::now();
        let sums = &mut self.sums_ms;
        let frame = animator.step_observed(input, &mut |stage| {
            let now = Instant::now();
            sums[stage as usize] += (now - last).as_secs_f64() * 1e3;
            last = now;
        })?;
        self.steps += 1;
        Ok(frame)
    }
}

/// Root mean square distance of corresponding vertices, metres. Zero without vertices.
pub(super) fn rmse(positions: &[Vec3], truth: &[Vec3]) -> f32 {
    let pairs = positions.iter().zip(truth);
    let squares: f64 = pairs.map(|(a, b)| f64::from(a.distance_squared(*b))).sum();
    (squares / positions.len().max(1) as f64).sqrt() as f32
}
/// Tells those who wait that the thread ends by a panic.
struct AnnouncesPanic<'a>(&'a Shared);

impl Drop for AnnouncesPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.lock().failure = Some("the prediction has ended by an internal error".into());
            self.0.grown.notify_all();
        }
    }
}
