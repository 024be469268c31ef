//! The state of the simulated cloth.

use glam::Vec3;

/// Mass points of one garment, in world space.
///
/// Within a substep `positions` are predictions, which constraints correct. `previous` holds the
/// positions at the start of the substep, so that `positions - previous` is the displacement that
/// friction acts on.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Particles {
    /// Positions, metres.
    pub positions: Vec<Vec3>,
    /// Positions at the start of the substep, metres.
    pub previous: Vec<Vec3>,
    /// Velocities, m/s.
    pub velocities: Vec<Vec3>,
    /// Inverse masses, 1/kg; a particle of zero inverse mass is pinned.
    pub inverse_masses: Vec<f32>,
}
