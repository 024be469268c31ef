//! The state that every constraint reads and moves.

use glam::Vec3;

/// Mass points of one garment, a vertex each, in world space.
///
/// Within a substep `positions` are predictions that constraints move; `previous` are the positions
/// at the substep's start, so that `positions - previous` is the motion that friction acts on.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Particles {
    /// Positions, metres.
    pub positions: Vec<Vec3>,
    /// Positions at the start of the substep, metres.
    pub previous: Vec<Vec3>,
    /// Velocities, metres a second.
    pub velocities: Vec<Vec3>,
    /// One over the mass, 1/kg; zero pins a particle.
    pub inverse_masses: Vec<f32>,
}
