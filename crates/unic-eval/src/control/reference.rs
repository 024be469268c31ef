//! Reference values of the captured motion itself.

use glam::Vec3;
use std::ops::Range;
use unic_core::{
    motion_matching::{Database, TagFilter},
    transform::Rigid,
};

/// Height above its rest height at which a toe no longer counts as on the ground, metres.
const SKATING_HEIGHT_M: f32 = 0.033;
/// Quantile of the velocity jumps of the captured motion.
const JUMP_QUANTILE: f64 = 0.99;

/// Values of the captured motion that runs are compared with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DataReference {
    /// Mean foot skating, m/s.
    pub skating_m_s: f64,
    /// 99th percentile over the frames of the largest velocity jump of any joint, m/s.
    pub jump_m_s: f64,
}

impl DataReference {
    /// Measures the frames of a database that a run with these tags may play.
    pub fn measure(database: &Database, tags: TagFilter) -> Self {
        let mut skating = Skating::default();
        let mut jumps = Vec::new();
        for frames in played(database, tags) {
            let positions: Vec<Vec<Vec3>> = frames.map(|frame| joint_positions(database, frame)).collect();
            for pair in positions.windows(2) {
                skating.add(database, &pair[0], &pair[1]);
            }
            jumps.extend((positions.windows(3)).map(|three| f64::from(velocity_jump(three, database.fps()))));
        }
        jumps.sort_by(f64::total_cmp);
        let at = (jumps.len() as f64 * JUMP_QUANTILE) as usize;
        Self {
            skating_m_s: skating.mean(),
            jump_m_s: jumps.get(at).copied().unwrap_or(f64::NAN),
        }
    }
}

/// Lists the longest ranges of a clip's frames that the tags accept.
fn played(database: &Database, tags: TagFilter) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for clip in database.clips() {
        for frame in (clip.first..clip.end()).filter(|&frame| tags.accepts(database.tags(frame))) {
            match ranges.last_mut() {
                Some(last) if last.end == frame && frame > clip.first => last.end += 1,
                _ => ranges.push(frame..frame + 1),
            }
        }
    }
    ranges
}

/// World positions of the joints of a frame in the space of its clip, metres.
fn joint_positions(database: &Database, frame: usize) -> Vec<Vec3> {
    let skeleton = database.skeleton();
    let world_from_root = database.root(frame).world_from_root();
    let mut local = database.rotations(frame).to_vec();
    let root = skeleton.root();
    local[root] = (world_from_root.rotation * local[root]).normalize();
    let pose = unic_core::Pose {
        trans: world_from_root.point(database.hips(frame)) - skeleton.joints()[root],
        local,
    };
    let mut world: Vec<Rigid> = Vec::new();
    skeleton.forward_kinematics(&pose, &mut world);
    world.iter().map(|joint| joint.translation).collect()
}

/// Largest change of the velocity of any joint between three successive frames, m/s.
pub(super) fn velocity_jump(three: &[impl AsRef<[Vec3]>], fps: f32) -> f32 {
    let [a, b, c] = [three[0].as_ref(), three[1].as_ref(), three[2].as_ref()];
    let jump = |j: usize| (c[j] - 2.0 * b[j] + a[j]).length() * fps;
    (0..a.len()).map(jump).fold(0.0, f32::max)
}

/// Mean foot skating: v (2 − 2^(h / 3.3 cm)) of both toes, with the horizontal speed v and the
/// height h above the rest height.
///
/// After Zhang et al. 2018, "Mode-Adaptive Neural Networks for Quadruped Motion Control".
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Skating {
    sum: f64,
    count: usize,
}

impl Skating {
    /// Adds the step from one frame to the next.
    pub(super) fn add(&mut self, database: &Database, before: &[Vec3], after: &[Vec3]) {
        let settings = database.settings();
        for (leg, rest) in settings.legs.iter().zip(settings.toe_heights_m) {
            let way = (after[leg.toe] - before[leg.toe]) * Vec3::new(1.0, 0.0, 1.0);
            let height = (after[leg.toe].y - rest).clamp(0.0, SKATING_HEIGHT_M);
            let share = 2.0 - (height / SKATING_HEIGHT_M).exp2();
            self.sum += f64::from(way.length() * database.fps() * share);
            self.count += 1;
        }
    }

    /// Mean, m/s.
    pub(super) fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}
