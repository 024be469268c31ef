//! Does a garment come back to where it was? Creeping, measured standing.

use crate::{Cloth, Simulation, SimulationError, SimulationSettings, simulation::heading};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{
    character::Character,
    skeleton::{Pose, Skeleton},
};

/// The hem: particles this near to the lowest of the rest shape, as a share of its height.
const HEM_SHARE: f32 = 0.02;
/// Time to go over to standing, and time to stand, seconds.
const WAY_S: f32 = 1.0;
const STAND_S: f32 = 1.0;

/// A garment on a character that stands in its bind pose and has never moved: where its hem hangs.
///
/// Friction that ratchets, or cloth that stays caught, shows in no single frame of a clip, because
/// moving arms and legs lift a hem for good reasons. It shows when the character stands again.
#[derive(Clone, Debug)]
pub struct Standing {
    hem: Vec<usize>,
    height_m: f32,
}

impl Standing {
    /// Simulates it: two seconds and the settling. `goes_on` is asked before every frame; none is
    /// returned when it has said no.
    ///
    /// # Errors
    /// As [`Simulation::on_character`] and [`Simulation::settle`].
    pub fn new(
        cloth: &Arc<Cloth>,
        character: &Arc<Character>,
        settings: &SimulationSettings,
        mut goes_on: impl FnMut() -> bool,
    ) -> Result<Option<Self>, SimulationError> {
        let mut simulation =
            Simulation::on_character(Arc::clone(cloth), Arc::clone(character), settings.clone())?;
        let (skeleton, hem) = (&character.skeleton, hem(cloth));
        let pose = skeleton.bind_pose();
        if !simulation.settle_while([&pose; 2], Vec3::ZERO, &mut goes_on)? {
            return Ok(None);
        }
        for pose in Self::way_from(skeleton, &pose, settings.fps) {
            if !goes_on() {
                return Ok(None);
            }
            simulation.step_frame(&pose, Vec3::ZERO)?;
        }
        let height_m = height_m(&hem, &simulation, skeleton, &pose);
        Ok(Some(Self { hem, height_m }))
    }

    /// Frames that [`Standing::new`] simulates.
    pub fn frames(settings: &SimulationSettings) -> u64 {
        let frames = |seconds: f32| (seconds * settings.fps).ceil() as u64;
        frames(settings.settle.seconds()) + frames(WAY_S + STAND_S)
    }

    /// Poses that lead from the last one of a clip to standing where it is, and stay there: two
    /// seconds in all.
    pub fn way_from(skeleton: &Skeleton, last: &Pose, fps: f32) -> impl Iterator<Item = Pose> + use<> {
        let root = skeleton.root();
        let mut stand = skeleton.bind_pose();
        let bind = stand.local[root];
        stand.local[root] = heading(last.local[root] * bind.inverse()) * bind;
        stand.trans = last.trans;
        let last = last.clone();
        let frames = ((WAY_S + STAND_S) * fps).ceil() as u32;
        (1..=frames).map(move |t| last.interpolate(&stand, (t as f32 / (WAY_S * fps)).min(1.0)))
    }

    /// How much higher than here the hem hangs over the root joint, mm, in a simulation that has
    /// come to the end of [`Standing::way_from`] a pose `last`.
    pub fn creep_mm(&self, simulation: &Simulation, skeleton: &Skeleton, last: &Pose) -> f32 {
        1000.0 * (height_m(&self.hem, simulation, skeleton, last) - self.height_m)
    }
}

/// Mean height of particles over the root joint, which is where `pose` has it.
fn height_m(hem: &[usize], simulation: &Simulation, skeleton: &Skeleton, pose: &Pose) -> f32 {
    let positions = &simulation.particles().positions;
    let sum: f32 = hem.iter().map(|&particle| positions[particle].y).sum();
    sum / hem.len() as f32 - (skeleton.joints()[skeleton.root()] + pose.trans).y
}

/// Particles at the lower rim of the rest shape.
fn hem(cloth: &Cloth) -> Vec<usize> {
    let heights = cloth.rest().vertices.iter().map(|v| v.y);
    let low = heights.clone().fold(f32::INFINITY, f32::min);
    let high = heights.clone().fold(f32::NEG_INFINITY, f32::max);
    let top = low + HEM_SHARE * (high - low);
    let particles = heights.enumerate().filter(|(_, y)| *y <= top);
    particles.map(|(particle, _)| particle).collect()
}
