//! How soon is a garment as good as if nothing had happened?

use super::{
    clip_run::ClipRun,
    random_motion::ease,
    subject::{Carried, Subject, refused},
};
use crate::{
    error::Result,
    metrics::{Squared, ratio},
};
use glam::{Quat, Vec3};
use serde::Serialize;
use std::f32::consts::TAU;
use unic_core::{
    animator::{Animator, AnimatorState, Start},
    clip::Clip,
    heading::Heading,
    skeleton::Pose,
};
use unic_io::Capture;

/// Between frames, metres.
const TELEPORT: Vec3 = Vec3::new(5.0, 0.0, 0.0);
/// Of motion that never arrives, seconds.
const DROPPED_S: f32 = 0.5;
/// Of a full turn about the forward axis, seconds.
const CARTWHEEL_S: f32 = 1.5;
/// What is compared is the second that begins so long after the disturbance, seconds.
const AFTER_S: f32 = 1.0;

/// Something that no simulation goes through. The animator is told of a new start and of nothing else.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Disturbance {
    /// A start from the garment as it hangs on average, as without any simulated frame.
    MeanShape,
    /// A start from the rest shape, carried by the skeleton.
    RestShape,
    /// A start from the true garment of another moment (of another clip where there is one), carried over
    /// by its displacements.
    OtherGarment,
    /// The root is moved by 5 m between two frames, and stays so.
    Teleport,
    /// The frame before belongs to another moment (of another clip where there is one).
    Cut,
    /// The half second before the next frame never arrives.
    Dropped,
    /// A full turn about the forward axis in a second and a half, in the pose of the moment, is inserted.
    Cartwheel,
}

impl Disturbance {
    /// All of them.
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

/// One kind of disturbance, at moments spread over the test clips.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recovery {
    /// Which.
    pub disturbance: Disturbance,
    /// How often.
    pub events: usize,
    /// RMSE over the second that begins one second after the disturbance, over all events, mm.
    pub rmse_mm: f64,
    /// Of the undisturbed free run from frame 0, over the same frames of the clips, mm.
    pub undisturbed_mm: f64,
    /// The first by the second.
    pub ratio: f64,
    /// The same ratio over the first second, which no target is set for.
    pub first_second_ratio: f64,
    /// The largest such ratio of a single event.
    pub worst_ratio: f64,
}

/// A moment of a clip.
#[derive(Clone, Copy)]
struct Event<'a> {
    run: &'a ClipRun,
    frame: usize,
    state: &'a AnimatorState,
}

impl<'a> Event<'a> {
    fn all(run: &'a ClipRun) -> impl Iterator<Item = Self> {
        let kept = run.events.iter();
        kept.map(move |(frame, state)| Self {
            run,
            frame: *frame,
            state,
        })
    }
}

/// All disturbances at all moments.
pub(super) fn measure(subject: &mut Subject, runs: &[ClipRun]) -> Result<Vec<Recovery>> {
    let events: Vec<Event> = runs.iter().flat_map(Event::all).collect();
    let frames = 2 * frames_in(AFTER_S, subject.fps());
    let cartwheels = events.len() * frames_in(CARTWHEEL_S, subject.fps());
    let total = Disturbance::ALL.len() * events.len() * frames + cartwheels;
    subject.begin("recovery", total);
    let kinds = Disturbance::ALL.into_iter();
    kinds.map(|kind| of_kind(subject, &events, kind)).collect()
}

fn of_kind(subject: &mut Subject, events: &[Event], disturbance: Disturbance) -> Result<Recovery> {
    let (mut first, mut second) = (Compared::default(), Compared::default());
    let mut worst_ratio = None;
    for (index, event) in events.iter().enumerate() {
        let script = Script::new(subject.capture, disturbance, event, &other(events, index));
        let [soon, later] = script.play(subject, event)?;
        worst_ratio = [worst_ratio, Some(later.ratio())]
            .into_iter()
            .flatten()
            .max_by(f64::total_cmp);
        first.pool(&soon);
        second.pool(&later);
    }
    let mm = |sums: &Squared| sums.rmse_mm().unwrap_or(f64::NAN);
    Ok(Recovery {
        disturbance,
        events: events.len(),
        rmse_mm: mm(&second.disturbed),
        undisturbed_mm: mm(&second.undisturbed),
        ratio: second.ratio(),
        first_second_ratio: first.ratio(),
        worst_ratio: worst_ratio.unwrap_or(f64::NAN),
    })
}

/// Two runs over the same frames.
#[derive(Clone, Copy, Default)]
struct Compared {
    disturbed: Squared,
    undisturbed: Squared,
}

impl Compared {
    fn pool(&mut self, other: &Self) {
        self.disturbed.pool(&other.disturbed);
        self.undisturbed.pool(&other.undisturbed);
    }

    fn ratio(&self) -> f64 {
        ratio([self.disturbed.sum, self.undisturbed.sum])
    }
}

/// Half of all events further on, or the next after that of another clip where there is one.
fn other<'a>(events: &[Event<'a>], index: usize) -> Event<'a> {
    let at = |k: usize| events[(index + events.len() / 2 + k) % events.len()];
    let is_elsewhere = |e: &Event| e.run.captured.clip.name != events[index].run.captured.clip.name;
    (0..events.len())
        .map(at)
        .find(is_elsewhere)
        .unwrap_or_else(|| at(0))
}

fn frames_in(seconds: f32, fps: f32) -> usize {
    (seconds * fps).round() as usize
}

/// What an animator goes through from a moment of a clip on.
struct Script<'a> {
    begin: Begin<'a>,
    /// The first pose is that of the moment.
    clip: Clip,
    /// The step after which nothing disturbs any more, and the frame of the event's clip then.
    over: usize,
    frame: usize,
    /// From the place of the event's clip to the script's, metres.
    moved: Vec3,
}

/// Where the animator is at the script's first pose.
enum Begin<'a> {
    Start(Vec<Vec3>),
    MeanShape,
    State(&'a AnimatorState),
}

impl<'a> Script<'a> {
    fn new(capture: &Capture, disturbance: Disturbance, event: &Event<'a>, other: &Event<'a>) -> Self {
        let clip = &event.run.captured.clip;
        let follow = |frame: usize| clip.poses[frame + 1..=frame + 2 * frames_in(AFTER_S, clip.fps)].iter();
        let begin = match disturbance {
            Disturbance::MeanShape => Begin::MeanShape,
            Disturbance::RestShape => Begin::Start(rest_shape(capture, event)),
            Disturbance::OtherGarment => Begin::Start(carried_over(capture, other, event)),
            Disturbance::Cut => Begin::State(other.state),
            _ => Begin::State(event.state),
        };
        let mut poses = vec![clip.poses[event.frame].clone()];
        let (mut frame, mut moved) = (event.frame, Vec3::ZERO);
        match disturbance {
            Disturbance::Dropped => frame += frames_in(DROPPED_S, clip.fps),
            Disturbance::Teleport => moved = TELEPORT,
            Disturbance::Cartwheel => poses.extend(cartwheel(capture, &poses[0], clip.fps)),
            _ => {}
        }
        let over = poses.len() - 1;
        poses.extend(follow(frame).map(|pose| Pose {
            trans: pose.trans + moved,
            local: pose.local.clone(),
        }));
        Self {
            begin,
            clip: Clip {
                poses,
                ..clip.clone()
            },
            over,
            frame,
            moved,
        }
    }

    /// This run and the undisturbed one over the first and over the second second.
    fn play(&self, subject: &mut Subject, event: &Event) -> Result<[Compared; 2]> {
        let garment = &event.run.captured.garment;
        let mut seconds = [Compared::default(); 2];
        let after = self.over + frames_in(AFTER_S, self.clip.fps);
        let mut here = Vec::new();
        let mut visit = |step: usize, animator: &Animator| {
            if step <= self.over {
                return;
            }
            let frame = self.frame + step - self.over;
            here.clear();
            here.extend(animator.garment().positions.iter().map(|x| *x - self.moved));
            seconds[usize::from(step > after)].pool(&Compared {
                disturbed: Squared::between(&here, garment.frame(frame)),
                undisturbed: event.run.errors[frame],
            });
        };
        let steps = self.clip.len();
        match &self.begin {
            Begin::MeanShape => subject.run(&self.clip, 0..steps, Start::MeanShape, &mut visit)?,
            Begin::Start(at) => subject.run(&self.clip, 0..steps, Start::Positions(at), &mut visit)?,
            Begin::State(state) => {
                let restored = subject.animator.restore((*state).clone());
                restored.map(|_| ()).map_err(|e| refused(&self.clip, e))?;
                subject.go_on(&self.clip, 1..steps, &mut visit)?;
            }
        }
        Ok(seconds)
    }
}

fn pose_at<'a>(event: &Event<'a>) -> &'a Pose {
    &event.run.captured.clip.poses[event.frame]
}

fn rest_shape(capture: &Capture, event: &Event) -> Vec<Vec3> {
    let mut carried = Carried::new(capture);
    carried.pose(pose_at(event));
    let vertices = 0..capture.garment.rest.vertices.len();
    vertices.map(|vertex| carried.frame(vertex).skinned).collect()
}

/// The garment of one moment in the pose of another.
fn carried_over(capture: &Capture, from: &Event, to: &Event) -> Vec<Vec3> {
    let mut carried = [Carried::new(capture), Carried::new(capture)];
    carried[0].pose(pose_at(from));
    carried[1].pose(pose_at(to));
    let garment = from.run.captured.garment.frame(from.frame).iter().enumerate();
    let place = |(vertex, &x): (usize, &Vec3)| {
        let displacement = carried[0].displacement(vertex, x);
        carried[1].frame(vertex).position(displacement)
    };
    garment.map(place).collect()
}

/// Ends in the pose that it begins from.
fn cartwheel(capture: &Capture, from: &Pose, fps: f32) -> Vec<Pose> {
    let root = capture.character.skeleton.root();
    let forward = Heading::start(from.local[root]).rotation() * Vec3::Z;
    let steps = frames_in(CARTWHEEL_S, fps);
    let turned = |step: usize| {
        let mut pose = from.clone();
        let angle = TAU * ease(step as f32 / steps as f32);
        pose.local[root] = (Quat::from_axis_angle(forward, angle) * pose.local[root]).normalize();
        pose
    };
    (1..=steps).map(turned).collect()
}
