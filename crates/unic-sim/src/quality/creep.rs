//! Creep: the displacement of a garment that remains after a clip, measured on a standing
//! character.

use crate::{Cloth, Simulation, SimulationError, SimulationSettings, simulation::heading};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Pose, character::Character, skeleton::Skeleton};

/// Height of the hem, as a share of the rest shape's height from its lowest particle up.
const HEM_SHARE: f32 = 0.02;

/// Time to move from the last pose of a clip to standing, seconds.
const MOVE_S: f32 = 1.0;

/// Time to stand afterwards, seconds.
const STAND_S: f32 = 1.0;

/// Reference for creep: the height of a garment's hem on a character that stands in its bind pose
/// and has not moved.
///
/// Friction that ratchets and cloth that stays caught are not visible in a single frame, because
/// moving arms and legs lift a hem as well. They are visible when the character stands again.
#[derive(Clone, Debug)]
pub struct CreepReference {
    /// Particles of the hem.
    hem: Vec<usize>,
    /// Mean height of the hem over the root joint, metres.
    height_m: f32,
}

impl CreepReference {
    /// Simulates the garment on the standing character: settling, then two seconds.
    ///
    /// `keep_going` is called before every frame. Returns `None` when it has returned false.
    ///
    /// # Errors
    /// Returns the errors of [`Simulation::on_character`] and [`Simulation::settle`].
    pub fn new(
        cloth: &Arc<Cloth>,
        character: &Arc<Character>,
        settings: &SimulationSettings,
        mut keep_going: impl FnMut() -> bool,
    ) -> Result<Option<Self>, SimulationError> {
        let mut simulation =
            Simulation::on_character(Arc::clone(cloth), Arc::clone(character), settings.clone())?;
        let (skeleton, hem) = (&character.skeleton, hem(cloth));
        let pose = skeleton.bind_pose();
        if !simulation.settle_while(&pose, &pose, Vec3::ZERO, &mut keep_going)? {
            return Ok(None);
        }
        // The same two seconds as after a clip, so that slow sagging cancels in the difference.
        for pose in Self::poses_to_standing(skeleton, &pose, settings.fps) {
            if !keep_going() {
                return Ok(None);
            }
            simulation.step_frame(&pose, Vec3::ZERO)?;
        }
        // Relative to the root joint, so that the place of the character does not matter.
        let height_m = height_m(&hem, &simulation, skeleton, &pose);
        Ok(Some(Self { hem, height_m }))
    }

    /// Returns the number of frames that [`CreepReference::new`] simulates.
    pub fn frame_count(settings: &SimulationSettings) -> u64 {
        let frames = |seconds: f32| (seconds * settings.fps).ceil() as u64;
        frames(settings.settle.seconds()) + frames(MOVE_S + STAND_S)
    }

    /// Returns poses that lead from the last pose of a clip to the bind pose at the same place and
    /// heading, and stay there: two seconds in total.
    pub fn poses_to_standing(
        skeleton: &Skeleton,
        last: &Pose,
        fps: f32,
    ) -> impl Iterator<Item = Pose> + use<> {
        let root = skeleton.root();
        let mut stand = skeleton.bind_pose();
        let bind = stand.local[root];
        stand.local[root] = heading(last.local[root] * bind.inverse()) * bind;
        stand.trans = last.trans;
        let last = last.clone();
        let frames = ((MOVE_S + STAND_S) * fps).ceil() as u32;
        (1..=frames).map(move |t| last.interpolate(&stand, (t as f32 / (MOVE_S * fps)).min(1.0)))
    }

    /// Returns the creep of a garment, mm: the height of its hem over the root joint, minus that of
    /// the reference.
    ///
    /// The simulation must have stepped through [`CreepReference::poses_to_standing`] from the pose
    /// `last`.
    pub fn creep_mm(&self, simulation: &Simulation, skeleton: &Skeleton, last: &Pose) -> f32 {
        1000.0 * (height_m(&self.hem, simulation, skeleton, last) - self.height_m)
    }
}

/// Returns the mean height of the hem over the root joint in `pose`, metres.
fn height_m(hem: &[usize], simulation: &Simulation, skeleton: &Skeleton, pose: &Pose) -> f32 {
    let positions = &simulation.particles().positions;
    let sum: f32 = hem.iter().map(|&particle| positions[particle].y).sum();
    sum / hem.len() as f32 - (skeleton.joints()[skeleton.root()] + pose.trans).y
}

/// Lists the particles of the hem, the lowest ones of the rest shape.
fn hem(cloth: &Cloth) -> Vec<usize> {
    let heights = cloth.rest().vertices.iter().map(|v| v.y);
    let low = heights.clone().fold(f32::INFINITY, f32::min);
    let high = heights.clone().fold(f32::NEG_INFINITY, f32::max);
    let top = low + HEM_SHARE * (high - low);
    let particles = heights.enumerate().filter(|(_, y)| *y <= top);
    particles.map(|(particle, _)| particle).collect()
}
