//! Recovery: time until a disturbance no longer shows in the error.

use super::{
    clip_run::ClipRun,
    random_motion::smootherstep,
    runner::{Runner, refused},
    skinned_garment::SkinnedGarment,
};
use crate::{
    error::Result,
    metrics::{SquaredErrors, ratio},
};
use glam::{Quat, Vec3};
use serde::Serialize;
use std::f32::consts::TAU;
use unic_core::{Animator, AnimatorState, Pose, Start, clip::Clip, heading::Heading};
use unic_io::Capture;

/// Displacement of the root in a teleport, metres.
// Far beyond any step, and small enough to keep the precision of f32.
const TELEPORT: Vec3 = Vec3::new(5.0, 0.0, 0.0);
/// Length of the motion that is dropped, seconds.
const DROPPED_S: f32 = 0.5;
/// Duration of a cartwheel, which is a full turn about the forward axis, seconds.
const CARTWHEEL_S: f32 = 1.5;
/// Time between the disturbance and the second over which errors are compared, seconds.
const AFTER_S: f32 = 1.0;

/// Disturbance that no simulation goes through. The animator learns of a new start, and of nothing
/// else.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Disturbance {
    /// The animator starts at the mean displacement, which needs no simulated frame.
    MeanShape,
    /// The animator starts at the rest shape, skinned.
    RestShape,
    /// The animator starts at the true garment of another moment, of another clip where there is
    /// one. Its displacements are transferred to the pose.
    OtherGarment,
    /// The root jumps by 5 m between two frames and stays there.
    Teleport,
    /// The previous frame belongs to another moment, of another clip where there is one.
    Cut,
    /// Half a second of motion before the next frame is missing.
    Dropped,
    /// A full turn about the forward axis in a second and a half is inserted, in the pose of the
    /// moment.
    Cartwheel,
}

impl Disturbance {
    /// All kinds of disturbance.
    pub const ALL: [Self; 7] = [
        Self::MeanShape,
        Self::RestShape,
        Self::OtherGarment,
        Self::Teleport,
        Self::Cut,
        Self::Dropped,
        Self::Cartwheel,
    ];
}

/// Errors after one kind of disturbance, at moments spread over the test clips.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recovery {
    /// Kind of disturbance.
    pub disturbance: Disturbance,
    /// Number of disturbances.
    pub events: usize,
    /// RMSE over the second that begins one second after the disturbance, over all disturbances,
    /// mm.
    pub rmse_mm: f64,
    /// RMSE of the undisturbed free run from frame 0 over the same frames, mm.
    pub undisturbed_mm: f64,
    /// `rmse_mm` / `undisturbed_mm`.
    pub ratio: f64,
    /// Ratio of the same errors over the first second, which has no target.
    pub first_second_ratio: f64,
    /// Largest ratio after a single disturbance.
    pub worst_ratio: f64,
}

/// Frame of a clip with the animator's state in the undisturbed run.
#[derive(Clone, Copy)]
struct Moment<'a> {
    run: &'a ClipRun,
    frame: usize,
    state: &'a AnimatorState,
}

impl<'a> Moment<'a> {
    /// Returns the recorded moments of an undisturbed run.
    fn all(run: &'a ClipRun) -> impl Iterator<Item = Self> {
        let kept = run.moments.iter();
        kept.map(move |(frame, state)| Self {
            run,
            frame: *frame,
            state,
        })
    }
}

/// Measures all disturbances at all moments of the undisturbed runs.
pub(super) fn measure(runner: &mut Runner, runs: &[ClipRun]) -> Result<Vec<Recovery>> {
    let moments: Vec<Moment> = runs.iter().flat_map(Moment::all).collect();
    let frames = 2 * frames_in(AFTER_S, runner.fps());
    let cartwheels = moments.len() * frames_in(CARTWHEEL_S, runner.fps());
    let total = Disturbance::ALL.len() * moments.len() * frames + cartwheels;
    runner.begin_measure("recovery", total);
    let kinds = Disturbance::ALL.into_iter();
    kinds.map(|kind| recovery_from(runner, &moments, kind)).collect()
}

/// Measures one kind of disturbance at all moments.
fn recovery_from(runner: &mut Runner, moments: &[Moment], disturbance: Disturbance) -> Result<Recovery> {
    let (mut first, mut second) = (ErrorPair::default(), ErrorPair::default());
    let mut worst_ratio = None;
    for (index, moment) in moments.iter().enumerate() {
        let disturbed = DisturbedRun::new(runner.capture, disturbance, moment, &other_moment(moments, index));
        let [soon, later] = disturbed.run(runner, moment)?;
        worst_ratio = [worst_ratio, Some(later.ratio())]
            .into_iter()
            .flatten()
            .max_by(f64::total_cmp);
        first.pool(&soon);
        second.pool(&later);
    }
    let mm = |sums: &SquaredErrors| sums.rmse_mm().unwrap_or(f64::NAN);
    Ok(Recovery {
        disturbance,
        events: moments.len(),
        rmse_mm: mm(&second.disturbed),
        undisturbed_mm: mm(&second.undisturbed),
        ratio: second.ratio(),
        first_second_ratio: first.ratio(),
        worst_ratio: worst_ratio.unwrap_or(f64::NAN),
    })
}

/// Errors of a disturbed and the undisturbed run over the same frames.
#[derive(Clone, Copy, Default)]
struct ErrorPair {
    disturbed: SquaredErrors,
    undisturbed: SquaredErrors,
}

impl ErrorPair {
    /// Adds other errors.
    fn pool(&mut self, other: &Self) {
        self.disturbed.pool(&other.disturbed);
        self.undisturbed.pool(&other.undisturbed);
    }

    /// Returns the ratio of the disturbed to the undisturbed RMSE.
    fn ratio(&self) -> f64 {
        ratio([self.disturbed.sum, self.undisturbed.sum])
    }
}

/// Returns the moment that is half of all moments further on, or the next one after it of another
/// clip where there is one.
fn other_moment<'a>(moments: &[Moment<'a>], index: usize) -> Moment<'a> {
    let at = |k: usize| moments[(index + moments.len() / 2 + k) % moments.len()];
    // Another clip differs more than another moment of the same one.
    let is_elsewhere = |e: &Moment| e.run.captured.clip.name != moments[index].run.captured.clip.name;
    (0..moments.len())
        .map(at)
        .find(is_elsewhere)
        .unwrap_or_else(|| at(0))
}

/// Returns the number of frames in a time, rounded.
fn frames_in(seconds: f32, fps: f32) -> usize {
    (seconds * fps).round() as usize
}

/// Run with a disturbance at one moment.
struct DisturbedRun<'a> {
    initial: InitialState<'a>,
    /// Motion of the run. The first pose is that of the moment.
    clip: Clip,
    /// Last step that belongs to the disturbance.
    last_disturbed: usize,
    /// Frame of the clip at that step.
    frame: usize,
    /// Translation of the run's motion from that of the clip, metres.
    moved: Vec3,
}

/// State of the animator at the first pose of a run.
enum InitialState<'a> {
    /// Reset to world positions, metres.
    Start(Vec<Vec3>),
    /// Reset to the mean displacement.
    MeanShape,
    /// Go on from a saved state.
    State(&'a AnimatorState),
}

impl<'a> DisturbedRun<'a> {
    /// Prepares the run from one moment. `other` gives the garment or the state of another moment.
    fn new(capture: &Capture, disturbance: Disturbance, moment: &Moment<'a>, other: &Moment<'a>) -> Self {
        let clip = &moment.run.captured.clip;
        // Two seconds follow: the one that is skipped and the one that is compared.
        let follow = |frame: usize| clip.poses[frame + 1..=frame + 2 * frames_in(AFTER_S, clip.fps)].iter();
        let initial = match disturbance {
            Disturbance::MeanShape => InitialState::MeanShape,
            Disturbance::RestShape => InitialState::Start(rest_shape(capture, moment)),
            Disturbance::OtherGarment => InitialState::Start(transferred(capture, other, moment)),
            Disturbance::Cut => InitialState::State(other.state),
            _ => InitialState::State(moment.state),
        };
        let mut poses = vec![clip.poses[moment.frame].clone()];
        let (mut frame, mut moved) = (moment.frame, Vec3::ZERO);
        match disturbance {
            Disturbance::Dropped => frame += frames_in(DROPPED_S, clip.fps),
            Disturbance::Teleport => moved = TELEPORT,
            Disturbance::Cartwheel => poses.extend(cartwheel(capture, &poses[0], clip.fps)),
            _ => {}
        }
        let last_disturbed = poses.len() - 1;
        poses.extend(follow(frame).map(|pose| Pose {
            trans: pose.trans + moved,
            local: pose.local.clone(),
        }));
        Self {
            initial,
            clip: Clip {
                poses,
                ..clip.clone()
            },
            last_disturbed,
            frame,
            moved,
        }
    }

    /// Returns the errors of this run and of the undisturbed one, over the first and the second
    /// second.
    fn run(&self, runner: &mut Runner, moment: &Moment) -> Result<[ErrorPair; 2]> {
        let garment = &moment.run.captured.garment;
        let mut seconds = [ErrorPair::default(); 2];
        let end_of_first = self.last_disturbed + frames_in(AFTER_S, self.clip.fps);
        let mut at_moment = Vec::new();
        let mut visit = |step: usize, animator: &Animator| {
            if step <= self.last_disturbed {
                return;
            }
            let frame = self.frame + step - self.last_disturbed;
            at_moment.clear();
            // The truth does not teleport: predictions are moved back to its place.
            at_moment.extend(animator.garment().positions.iter().map(|x| *x - self.moved));
            seconds[usize::from(step > end_of_first)].pool(&ErrorPair {
                disturbed: SquaredErrors::between(&at_moment, garment.frame(frame)),
                undisturbed: moment.run.errors[frame],
            });
        };
        let steps = self.clip.len();
        match &self.initial {
            InitialState::MeanShape => runner.run(&self.clip, 0..steps, Start::MeanShape, &mut visit)?,
            InitialState::Start(at) => runner.run(&self.clip, 0..steps, Start::Positions(at), &mut visit)?,
            InitialState::State(state) => {
                let restored = runner.animator.restore((*state).clone());
                restored.map(|_| ()).map_err(|e| refused(&self.clip, e))?;
                runner.step_through(&self.clip, 1..steps, &mut visit)?;
            }
        }
        Ok(seconds)
    }
}

/// Returns the pose of a moment.
fn pose_at<'a>(moment: &Moment<'a>) -> &'a Pose {
    &moment.run.captured.clip.poses[moment.frame]
}

/// Returns the skinned rest shape in the pose of a moment.
fn rest_shape(capture: &Capture, moment: &Moment) -> Vec<Vec3> {
    let mut skinned = SkinnedGarment::new(capture);
    skinned.pose(pose_at(moment));
    let vertices = 0..capture.garment.rest.vertices.len();
    vertices.map(|vertex| skinned.frame(vertex).skinned).collect()
}

/// Returns the garment of one moment in the pose of another: the same displacements.
fn transferred(capture: &Capture, from: &Moment, to: &Moment) -> Vec<Vec3> {
    let mut skinned = [SkinnedGarment::new(capture), SkinnedGarment::new(capture)];
    skinned[0].pose(pose_at(from));
    skinned[1].pose(pose_at(to));
    let garment = from.run.captured.garment.frame(from.frame).iter().enumerate();
    let place = |(vertex, &x): (usize, &Vec3)| {
        let displacement = skinned[0].displacement(vertex, x);
        skinned[1].frame(vertex).position(displacement)
    };
    garment.map(place).collect()
}

/// Returns the poses of a cartwheel after the pose `from`. The last one is `from` again.
fn cartwheel(capture: &Capture, from: &Pose, fps: f32) -> Vec<Pose> {
    let root = capture.character.skeleton.root();
    let forward = Heading::start(from.local[root]).rotation() * Vec3::Z;
    let steps = frames_in(CARTWHEEL_S, fps);
    let turned = |step: usize| {
        let mut pose = from.clone();
        let angle = TAU * smootherstep(step as f32 / steps as f32);
        pose.local[root] = (Quat::from_axis_angle(forward, angle) * pose.local[root]).normalize();
        pose
    };
    (1..=steps).map(turned).collect()
}
