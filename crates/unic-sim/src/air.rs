//! Aerodynamic drag on the cloth, in still air and in wind.

use crate::{Cloth, Particles};
use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The air around the cloth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Air {
    /// Density of the air, kg/m³; zero for a vacuum.
    pub density: f32,
    /// Drag coefficient of a flat piece that moves along its normal. A square plate across a stream
    /// has 1.2 (Hoerner, "Fluid-dynamic drag", 1965, §3); neighbours shield a piece of cloth.
    pub normal_drag: f32,
    /// Drag coefficient of motion along the surface, both sides together.
    pub tangential_drag: f32,
}

impl Default for Air {
    fn default() -> Self {
        Self {
            density: 1.2,
            normal_drag: 1.0,
            tangential_drag: 0.03,
        }
    }
}

impl Air {
    /// A vacuum.
    pub const NONE: Self = Self {
        density: 0.0,
        normal_drag: 0.0,
        tangential_drag: 0.0,
    };

    /// Computes the change of velocity of a piece of cloth by drag during `seconds`, m/s.
    ///
    /// `relative` is the velocity relative to the air in m/s, `normal` the unit normal, and
    /// `area_density` the mass per area in kg/m². The force per area is
    /// −½ ρ (C_n |v_n| v_n + C_t |v_t| v_t), with v_n along the normal and v_t perpendicular to it.
    fn velocity_change(&self, relative: Vec3, normal: Vec3, area_density: f32, seconds: f32) -> Vec3 {
        let along = normal * relative.dot(normal);
        let across = relative - along;
        let per_speed = 0.5 * self.density * seconds / area_density;
        let slowed = |part: Vec3, coefficient: f32| {
            // Integrated semi-implicitly: an explicit step of the quadratic law would reverse the
            // velocity of light cloth in a strong wind, and the simulation would explode.
            let rate = per_speed * coefficient * part.length();
            -part * (rate / (1.0 + rate))
        };
        slowed(along, self.normal_drag) + slowed(across, self.tangential_drag)
    }
}

/// Accelerations of particles by drag, constant during an interval.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drag {
    /// Force on each corner of a triangle, N: a third of the triangle's drag. Scratch.
    forces: Vec<Vec3>,
    /// Acceleration of each particle, m/s².
    pub(crate) accelerations: Vec<Vec3>,
}

impl Drag {
    /// Computes the accelerations from the state at the start of an interval of `seconds` and a
    /// wind in m/s.
    pub(crate) fn update(
        &mut self,
        air: &Air,
        cloth: &Cloth,
        particles: &Particles,
        wind: Vec3,
        seconds: f32,
    ) {
        if air.density == 0.0 {
            self.accelerations.clear();
            self.accelerations.resize(particles.positions.len(), Vec3::ZERO);
            return;
        }
        let force = |(face, &mass): (&[u32; 3], &f32)| {
            let [a, b, c] = face.map(|p| particles.positions[p as usize]);
            let area_normal = (b - a).cross(c - a);
            let velocity = face
                .iter()
                .map(|&p| particles.velocities[p as usize])
                .sum::<Vec3>()
                / 3.0;
            let area = 0.5 * area_normal.length();
            // The current area, not the rest area: stretched cloth catches more air.
            let area_density = mass / area.max(f32::MIN_POSITIVE);
            let normal = area_normal.normalize_or_zero();
            air.velocity_change(velocity - wind, normal, area_density, seconds) * (mass / (3.0 * seconds))
        };
        (cloth.rest.faces.par_iter().zip(&cloth.face_masses))
            .with_min_len(2048)
            .map(force)
            .collect_into_vec(&mut self.forces);
        let forces = &self.forces;
        // Each particle gathers from its triangles in a fixed order. Scattering from the triangles
        // would need atomics, and the sums would depend on the threads.
        (0..particles.positions.len())
            .into_par_iter()
            .with_min_len(2048)
            .map(|p| {
                let faces = cloth.face_starts[p] as usize..cloth.face_starts[p + 1] as usize;
                let faces = &cloth.faces_of_particles[faces];
                let sum: Vec3 = faces.iter().map(|&f| forces[f as usize]).sum();
                sum * particles.inverse_masses[p]
            })
            .collect_into_vec(&mut self.accelerations);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_falling_sheet_reaches_its_terminal_speed() {
        // Broadside: ½ ρ C v² = area density · g.
        let (air, density) = (Air::default(), 0.15);
        let mut velocity = Vec3::ZERO;
        for _ in 0..2000 {
            velocity += Vec3::NEG_Y * 9.81 * 0.005;
            velocity += air.velocity_change(velocity, Vec3::Y, density, 0.005);
        }
        let terminal = (2.0 * density * 9.81 / air.density).sqrt();
        assert!((velocity.length() / terminal - 1.0).abs() < 0.03, "{velocity}");
    }

    #[test]
    fn wind_never_accelerates_cloth_beyond_its_own_speed() {
        for speed in [1.0, 100.0, 1e6] {
            let change = Air::default().velocity_change(Vec3::X * -speed, Vec3::X, 1e-3, 0.01);
            assert!(change.x > 0.0 && change.x <= speed && change.y == 0.0);
        }
    }
}
