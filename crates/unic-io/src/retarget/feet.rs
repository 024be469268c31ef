//! Feet that stand neither slide nor sink.
//!
//! The ball of a foot (SMPL's foot joint) stands while it is slow and low. Through each such phase
//! it is held where it is on average, on the ground; between phases the correction fades, so that
//! swings stay as they are. The leg follows by inverse kinematics, and the toes lie on the ground.

use super::{
    bones::{BoneMap, Bones, Tree},
    leg::Leg,
    names::{Part, Side},
    transfer::swing,
};
use glam::{Quat, Vec3};
use std::{ops::Range, path::Path};
use unic_core::{character::Character, clip::Clip, skeleton::Skeleton, transform::Rigid};

/// Below this speed a ball of the foot may stand, m/s: planted ones drift by less, swinging ones
/// pass 1 m/s.
const STANDING_SPEED: f32 = 0.35;

/// How far above its height at rest a standing ball may be, metres.
const STANDING_HEIGHT: f32 = 0.04;

/// Shortest phase that counts, and longest interruption that does not, seconds.
const SHORTEST_PHASE: f32 = 0.1;
const LONGEST_GAP: f32 = 0.05;

/// A foot that creeps further than this from where it stood stands elsewhere, metres.
const CREEP: f32 = 0.04;

/// Time in which a correction fades in and out, seconds: much less than a swing.
const FADE: f32 = 0.15;

/// Below this speed of ankle and ball a foot is taken to be flat, m/s, and this long it must be so
/// before its tilt is believed, seconds.
const FLAT_SPEED: f32 = 0.2;
const FLAT_SECONDS: f32 = 0.3;

/// Largest tilt that is a difference between skeletons and no pose, radians: 25°.
const MOST_TILT: f32 = 0.44;

/// Height of the ball above its height at rest from which toes are left alone, metres.
const TOES_FREE: f32 = 0.08;

/// How far one leg's reach may pull the pelvis down, metres.
const MOST_DROP: f32 = 0.06;

/// How well feet stand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FootMeasure {
    /// Seconds that a foot stands, both feet together.
    pub standing_seconds: f32,
    /// Mean horizontal speed of standing balls of the foot, m/s.
    pub slide: f32,
    /// Largest depth of a ball of the foot below its height on the ground, metres.
    pub deepest: f32,
    /// Mean distance of standing balls from their height on the ground, metres.
    pub height_error: f32,
}

/// One foot of a character.
struct Foot {
    leg: Leg,
    /// Heights of the joints above the sole when the foot is flat, metres.
    ball_height: f32,
    ankle_height: f32,
}

/// World positions of one foot, a frame each.
struct Track {
    balls: Vec<Vec3>,
    ankles: Vec<Vec3>,
}

/// Phases in which the feet of a clip stand.
pub(crate) struct Contacts {
    feet: Vec<Foot>,
    phases: Vec<Vec<Range<usize>>>,
}

/// Re-seats a clip on the ground that its standing feet are on, y = 0, and holds those feet.
/// Says what it did; characters without named feet stay as they are.
pub(crate) fn hold(clip: &mut Clip, character: &Character, notes: &mut Vec<String>) {
    let Some(feet) = feet_of(character) else {
        notes.push("the character has no joints named as feet: feet are not held".into());
        return;
    };
    feet.iter()
        .for_each(|foot| level(clip, &character.skeleton, foot));
    let ground = ground_height(clip, &character.skeleton, &feet);
    clip.poses.iter_mut().for_each(|p| p.trans.y -= ground);
    clip.ground_height = 0.0;
    let contacts = Contacts::find(clip, &character.skeleton, feet);
    let before = contacts.measure(clip, &character.skeleton);
    contacts.hold(clip, &character.skeleton);
    let after = contacts.measure(clip, &character.skeleton);
    notes.push(format!(
        "feet held where they stand ({:.1} s of both): they slid at {:.3} m/s, now {:.3} m/s",
        before.standing_seconds, before.slide, after.slide
    ));
}

/// How well the feet of a clip stand, in the phases that `reference` tells: the same motion, perhaps
/// before something was done to it, frame by frame. `None` for characters without named feet.
pub fn measure_feet(clip: &Clip, reference: &Clip, character: &Character) -> Option<FootMeasure> {
    let feet = feet_of(character)?;
    let contacts = Contacts::find(reference, &character.skeleton, feet);
    Some(contacts.measure(clip, &character.skeleton))
}

fn feet_of(character: &Character) -> Option<Vec<Foot>> {
    let skeleton = &character.skeleton;
    let tree = Tree {
        path: Path::new("character"),
        names: skeleton.names().iter().map(String::as_str).collect(),
        parents: skeleton.parents().to_vec(),
    };
    let bones = Bones::identify(&tree, &BoneMap::default()).ok()?;
    let sole = character.body.vertices.iter().map(|v| v.y).reduce(f32::min)?;
    let foot = |side: Side| {
        let joint = |part: Part| bones.limb(part, side);
        let leg = Leg {
            hip: joint(Part::Hip)?,
            knee: joint(Part::Knee)?,
            ankle: joint(Part::Ankle)?,
            toe: joint(Part::Toe)?,
        };
        Some(Foot {
            ball_height: skeleton.joints()[leg.toe].y - sole,
            ankle_height: skeleton.joints()[leg.ankle].y - sole,
            leg,
        })
    };
    Side::ALL.map(foot).into_iter().collect()
}

fn tracks(clip: &Clip, skeleton: &Skeleton, feet: &[Foot]) -> Vec<Track> {
    let mut world = Vec::new();
    let empty = || Track {
        balls: Vec::with_capacity(clip.len()),
        ankles: Vec::with_capacity(clip.len()),
    };
    let mut tracks: Vec<Track> = feet.iter().map(|_| empty()).collect();
    for pose in &clip.poses {
        skeleton.forward_kinematics(pose, &mut world);
        for (track, foot) in tracks.iter_mut().zip(feet) {
            track.balls.push(world[foot.leg.toe].translation);
            track.ankles.push(world[foot.leg.ankle].translation);
        }
    }
    tracks
}

/// Speed by central differences, one-sided at the ends, m/s.
fn speed(track: &[Vec3], frame: usize, fps: f32) -> f32 {
    let (before, after) = (frame.saturating_sub(1), (frame + 1).min(track.len() - 1));
    track[after].distance(track[before]) * fps / (after - before).max(1) as f32
}

/// Turns a foot by one rotation in all frames, so that it is level in the median over those in which
/// it rests: skeletons differ in where the ankle's axes lie when the foot is flat.
fn level(clip: &mut Clip, skeleton: &Skeleton, foot: &Foot) {
    let Some(track) = tracks(clip, skeleton, std::slice::from_ref(foot)).pop() else {
        return;
    };
    let rests = |t: usize| {
        let fastest = speed(&track.balls, t, clip.fps).max(speed(&track.ankles, t, clip.fps));
        fastest < FLAT_SPEED
    };
    let mut world = Vec::new();
    let joint = foot.leg.ankle;
    let level_up = up_when_flat(skeleton, joint);
    let mut ups: Vec<Vec3> = Vec::new();
    for t in (0..clip.len()).filter(|&t| rests(t)) {
        skeleton.forward_kinematics(&clip.poses[t], &mut world);
        ups.push(world[joint].rotation.inverse() * Vec3::Y);
    }
    if (ups.len() as f32) < FLAT_SECONDS * clip.fps {
        return;
    }
    let median = Vec3::from_array([0, 1, 2].map(|axis| {
        let mut values: Vec<f32> = ups.iter().map(|up| up[axis]).collect();
        values.sort_by(f32::total_cmp);
        values[values.len() / 2]
    }));
    let turn = swing(level_up, median.normalize_or(level_up));
    if turn.w.abs() < (0.5 * MOST_TILT).cos() {
        return;
    }
    let locals = clip.poses.iter_mut().map(|pose| &mut pose.local[joint]);
    locals.for_each(|local| *local = (*local * turn).normalize());
}

/// Up in a joint's own axes when the foot is flat, as it is in the bind pose.
fn up_when_flat(skeleton: &Skeleton, joint: usize) -> Vec3 {
    let mut bind = Vec::new();
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind);
    bind[joint].rotation.inverse() * Vec3::Y
}

/// Toes lie on the ground while the ball is on it, and are as they were once it is
/// [`TOES_FREE`] above: markers hardly tell how toes bend, and bent down they would sink.
fn lay_toes(clip: &mut Clip, skeleton: &Skeleton, foot: &Foot) {
    let flat_up = up_when_flat(skeleton, foot.leg.toe);
    let mut world = Vec::new();
    for pose in &mut clip.poses {
        skeleton.forward_kinematics(pose, &mut world);
        let toe = world[foot.leg.toe];
        let height = toe.translation.y - foot.ball_height;
        let laid = swing(toe.rotation * flat_up, Vec3::Y);
        let share = 1.0 - (height / TOES_FREE).clamp(0.0, 1.0);
        let by = toe.rotation.inverse() * Quat::IDENTITY.slerp(laid, share) * toe.rotation;
        pose.local[foot.leg.toe] = (pose.local[foot.leg.toe] * by).normalize();
    }
}

/// Median height of the lower foot's sole over the frames in which it is slow: jumps and swings do
/// not count, and as many soles are a little above as a little below.
fn ground_height(clip: &Clip, skeleton: &Skeleton, feet: &[Foot]) -> f32 {
    let tracks = tracks(clip, skeleton, feet);
    let lowest = |frame: usize| {
        let soles = tracks.iter().zip(feet).map(|(track, foot)| {
            let height = track.balls[frame].y - foot.ball_height;
            (height, speed(&track.balls, frame, clip.fps))
        });
        soles.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut all: Vec<(f32, f32)> = (0..clip.len()).filter_map(lowest).collect();
    if all.iter().any(|(_, speed)| *speed < STANDING_SPEED) {
        all.retain(|(_, speed)| *speed < STANDING_SPEED);
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.get(all.len() / 2).map_or(0.0, |(height, _)| *height)
}

impl Contacts {
    /// The clip stands on its `ground_height`.
    fn find(clip: &Clip, skeleton: &Skeleton, feet: Vec<Foot>) -> Self {
        let tracks = tracks(clip, skeleton, &feet);
        let phases = (tracks.iter().zip(&feet))
            .map(|(track, foot)| phases(&track.balls, foot.ball_height + clip.ground_height, clip.fps))
            .collect();
        Self { feet, phases }
    }

    fn measure(&self, clip: &Clip, skeleton: &Skeleton) -> FootMeasure {
        let tracks = tracks(clip, skeleton, &self.feet);
        let (mut measure, mut steps, mut frames) = (FootMeasure::default(), 0, 0);
        for ((track, foot), phases) in tracks.iter().zip(&self.feet).zip(&self.phases) {
            let above = |p: &Vec3| p.y - clip.ground_height - foot.ball_height;
            let depth = track.balls.iter().map(|p| -above(p)).fold(0.0, f32::max);
            measure.deepest = measure.deepest.max(depth);
            for standing in phases.iter().filter_map(|p| track.balls.get(p.clone())) {
                let moved = standing
                    .windows(2)
                    .map(|p| (p[1] - p[0]).reject_from(Vec3::Y).length());
                measure.slide += moved.sum::<f32>();
                measure.height_error += standing.iter().map(|p| above(p).abs()).sum::<f32>();
                steps += standing.len() - 1;
                frames += standing.len();
            }
        }
        measure.standing_seconds = steps as f32 / clip.fps;
        measure.slide /= measure.standing_seconds.max(f32::MIN_POSITIVE);
        measure.height_error /= frames.max(1) as f32;
        measure
    }

    fn hold(&self, clip: &mut Clip, skeleton: &Skeleton) {
        let tracks = tracks(clip, skeleton, &self.feet);
        let targets: Vec<Track> = (tracks.iter().zip(&self.feet).zip(&self.phases))
            .map(|((track, foot), phases)| held(track, foot, phases, clip.fps))
            .collect();
        lower_pelvis(clip, skeleton, &self.feet, &targets);
        let mut world: Vec<Rigid> = Vec::new();
        for (frame, pose) in clip.poses.iter_mut().enumerate() {
            skeleton.forward_kinematics(pose, &mut world);
            for (foot, target) in self.feet.iter().zip(&targets) {
                let ends = (target.ankles[frame], target.balls[frame]);
                foot.leg.reach(skeleton, pose, &world, ends);
            }
        }
        for foot in &self.feet {
            lay_toes(clip, skeleton, foot);
        }
    }
}

/// Frames in which a ball of the foot stands at `height`.
fn phases(balls: &[Vec3], height: f32, fps: f32) -> Vec<Range<usize>> {
    let stands =
        |t: usize| speed(balls, t, fps) < STANDING_SPEED && (balls[t].y - height).abs() < STANDING_HEIGHT;
    let mut found: Vec<Range<usize>> = Vec::new();
    for t in (0..balls.len()).filter(|&t| stands(t)) {
        match found.last_mut() {
            Some(last) if (t - last.end) as f32 <= LONGEST_GAP * fps => last.end = t + 1,
            _ => found.push(t..t + 1),
        }
    }
    let long = |phase: &Range<usize>| phase.len() as f32 >= SHORTEST_PHASE * fps && phase.len() > 1;
    let parts = found.into_iter().flat_map(|phase| split_creep(balls, phase, fps));
    parts.filter(long).collect()
}

/// Cuts a phase where the foot has crept away, with time to fade between the parts.
fn split_creep(balls: &[Vec3], phase: Range<usize>, fps: f32) -> Vec<Range<usize>> {
    let margin = (0.5 * FADE * fps).ceil() as usize;
    let (mut parts, mut start) = (Vec::new(), phase.start);
    for t in phase.clone() {
        if t >= start && (balls[t] - balls[start]).reject_from(Vec3::Y).length() > CREEP {
            parts.push(start..t.saturating_sub(margin).max(start));
            start = t + margin;
        }
    }
    if start < phase.end {
        parts.push(start..phase.end);
    }
    parts
}

/// Where ball and ankle go.
fn held(track: &Track, foot: &Foot, phases: &[Range<usize>], fps: f32) -> Track {
    let corrections = corrections(&track.balls, foot.ball_height, phases, fps);
    let (mut balls, mut ankles) = (Vec::new(), Vec::new());
    for ((ball, ankle), correction) in track.balls.iter().zip(&track.ankles).zip(corrections) {
        let mut ball_held = ball + correction;
        ball_held.y = ball_held.y.max(foot.ball_height);
        // The whole foot moves; a heel that would sink turns the foot about its ball.
        let mut ankle_held = ankle + (ball_held - ball);
        ankle_held.y = ankle_held.y.max(foot.ankle_height);
        let along = (ankle_held - ball_held).normalize_or(Vec3::Y);
        ankles.push(ball_held + along * ball.distance(*ankle));
        balls.push(ball_held);
    }
    Track { balls, ankles }
}

/// What holds the ball of a foot in its phases, and fades between them.
fn corrections(balls: &[Vec3], height: f32, phases: &[Range<usize>], fps: f32) -> Vec<Vec3> {
    let mut corrections = vec![Vec3::ZERO; balls.len()];
    for phase in phases {
        let standing = &balls[phase.clone()];
        let mut anchor = standing.iter().sum::<Vec3>() / standing.len() as f32;
        anchor.y = height;
        for (correction, ball) in corrections[phase.clone()].iter_mut().zip(standing) {
            *correction = anchor - ball;
        }
    }
    let ends = phases.iter().map(|p| p.end - 1);
    let starts = phases.iter().map(|p| p.start).skip(1);
    for (end, start) in ends.zip(starts) {
        fade(&mut corrections, Some(end), Some(start), fps);
    }
    fade(&mut corrections, None, phases.first().map(|p| p.start), fps);
    fade(&mut corrections, phases.last().map(|p| p.end - 1), None, fps);
    corrections
}

/// Fills the frames between the last frame of one phase and the first of the next.
fn fade(corrections: &mut [Vec3], end: Option<usize>, start: Option<usize>, fps: f32) {
    if end.is_none() && start.is_none() {
        return;
    }
    let frames = (FADE * fps).max(1.0);
    let range = end.map_or(0, |e| e + 1)..start.unwrap_or(corrections.len());
    for t in range {
        let weight = |from: Option<usize>| {
            let away = from.map_or(1.0, |f| (t.abs_diff(f) as f32 / frames).min(1.0));
            let gone = away * away * (3.0 - 2.0 * away);
            (1.0 - gone, from.map_or(Vec3::ZERO, |f| corrections[f]))
        };
        let ((before, a), (after, b)) = (weight(end), weight(start));
        // In a gap shorter than two fades the weights overlap: together they are one at most.
        corrections[t] = (a * before + b * after) / (before + after).max(1.0);
    }
}

/// Lowers the body where a held foot is out of a leg's reach, smoothly.
fn lower_pelvis(clip: &mut Clip, skeleton: &Skeleton, feet: &[Foot], targets: &[Track]) {
    let mut world = Vec::new();
    let mut drops: Vec<f32> = Vec::with_capacity(clip.len());
    for (frame, pose) in clip.poses.iter().enumerate() {
        skeleton.forward_kinematics(pose, &mut world);
        let needed = feet.iter().zip(targets).map(|(foot, target)| {
            let Leg { hip, knee, ankle, .. } = foot.leg;
            let [hip, knee, ankle] = [hip, knee, ankle].map(|j| world[j].translation);
            let length = 0.999 * (hip.distance(knee) + knee.distance(ankle));
            out_of_reach(hip, target.ankles[frame], length)
        });
        drops.push(needed.fold(0.0, f32::max).min(MOST_DROP));
    }
    let smooth = smoothed_above(&drops, (FADE * clip.fps).ceil() as usize);
    let lowered = clip.poses.iter_mut().zip(smooth);
    lowered.for_each(|(pose, drop)| pose.trans.y -= drop);
}

/// How far a hip must come down until `ankle` is within `length`.
fn out_of_reach(hip: Vec3, ankle: Vec3, length: f32) -> f32 {
    let across = (hip - ankle).reject_from(Vec3::Y).length();
    let rise = (length * length - across * across).max(0.0).sqrt();
    (hip.y - ankle.y - rise).max(0.0)
}

/// A smooth curve that is nowhere below the values: their running maximum, averaged over the same
/// window twice.
fn smoothed_above(values: &[f32], radius: usize) -> Vec<f32> {
    let around = |t: usize, radius: usize| t.saturating_sub(radius)..(t + radius + 1).min(values.len());
    let highest: Vec<f32> = (0..values.len())
        .map(|t| {
            values[around(t, 2 * radius)]
                .iter()
                .fold(0.0, |a, b| f32::max(a, *b))
        })
        .collect();
    let averaged = |curve: &[f32]| -> Vec<f32> {
        (0..curve.len())
            .map(|t| {
                let window = &curve[around(t, radius)];
                window.iter().sum::<f32>() / window.len() as f32
            })
            .collect()
    };
    averaged(&averaged(&highest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smoothed_curve_stays_above() {
        let mut values = vec![0.0; 60];
        values[30] = 1.0;
        values[33] = 0.5;
        values[0] = 0.25;
        let smooth = smoothed_above(&values, 4);
        assert!(smooth.iter().zip(&values).all(|(s, v)| *s >= v - 1e-6));
        let step = smooth.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        assert!(step < 0.2 && smooth[50] == 0.0, "{step}");
    }

    #[test]
    fn corrections_hold_in_phases_and_fade_between() {
        let fps = 30.0;
        let balls: Vec<Vec3> = (0..60).map(|t| Vec3::X * 0.01 * t as f32).collect();
        let found = corrections(&balls, 0.02, &[10..20, 40..50], fps);
        for phase in [10..20, 40..50] {
            let held: Vec<Vec3> = phase.map(|t| balls[t] + found[t]).collect();
            assert!(
                held.iter()
                    .all(|p| p.distance(held[0]) < 1e-6 && (p.y - 0.02).abs() < 1e-6)
            );
        }
        assert_eq!(
            (found[0], found[30], found[59]),
            (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO)
        );
        let steps = found.windows(2).map(|w| w[0].distance(w[1]));
        assert!(steps.fold(0.0, f32::max) < 0.025);
    }

    #[test]
    fn a_leg_out_of_reach_lowers_the_hip() {
        let drop = out_of_reach(Vec3::Y * 1.1, Vec3::new(0.6, 0.0, 0.0), 1.0);
        assert!((drop - 0.3).abs() < 1e-6);
        assert_eq!(out_of_reach(Vec3::Y * 0.7, Vec3::ZERO, 1.0), 0.0);
    }
}
