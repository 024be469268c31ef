//! Drag of still and moving air.

use crate::{Cloth, Particles};
use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The air around the cloth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Air {
    /// kg/m³; zero for a vacuum.
    pub density: f32,
    /// Drag coefficient of a flat piece that moves along its normal: 1.2 for a square plate across
    /// a stream (Hoerner, "Fluid-dynamic drag", 1965, §3), less where neighbours shield it.
    pub normal_drag: f32,
    /// Drag coefficient along its surface, both sides together.
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
    /// No air at all.
    pub const NONE: Self = Self {
        density: 0.0,
        normal_drag: 0.0,
        tangential_drag: 0.0,
    };

    /// Change of velocity of a piece of cloth in `seconds`, m/s, from its velocity relative to the
    /// air, its unit normal and its mass per area in kg/m².
    ///
    /// The force per area is −½ ρ (C_n |v_n| v_n + C_t |v_t| v_t), with v_n and v_t along the normal
    /// and across it. Each part is integrated implicitly, so that thin cloth in a storm does at
    /// most what the air does.
    fn push(&self, relative: Vec3, normal: Vec3, area_density: f32, seconds: f32) -> Vec3 {
        let along = normal * relative.dot(normal);
        let across = relative - along;
        let per_speed = 0.5 * self.density * seconds / area_density;
        let slowed = |part: Vec3, coefficient: f32| {
            let rate = per_speed * coefficient * part.length();
            -part * (rate / (1.0 + rate))
        };
        slowed(along, self.normal_drag) + slowed(across, self.tangential_drag)
    }
}

/// Acceleration of particles by the air, kept for an interval.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drag {
    /// Change of momentum a third of each triangle gets, kg·m/s².
    forces: Vec<Vec3>,
    pub(crate) accelerations: Vec<Vec3>,
}

impl Drag {
    /// For the state at the start of an interval of `seconds` and a wind in m/s.
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
            // Stretched cloth catches more air than it weighs for.
            let area_density = mass / area.max(f32::MIN_POSITIVE);
            let normal = area_normal.normalize_or_zero();
            air.push(velocity - wind, normal, area_density, seconds) * (mass / (3.0 * seconds))
        };
        (cloth.rest.faces.par_iter().zip(&cloth.face_masses))
            .with_min_len(2048)
            .map(force)
            .collect_into_vec(&mut self.forces);
        let forces = &self.forces;
        (0..particles.positions.len())
            .into_par_iter()
            .with_min_len(2048)
            .map(|p| {
                let faces = cloth.starts[p] as usize..cloth.starts[p + 1] as usize;
                let sum: Vec3 = (cloth.around[faces].iter()).map(|&f| forces[f as usize]).sum();
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
        // Face on: ½ ρ C v² = area density · g.
        let (air, density) = (Air::default(), 0.15);
        let mut velocity = Vec3::ZERO;
        for _ in 0..2000 {
            velocity += Vec3::NEG_Y * 9.81 * 0.005;
            velocity += air.push(velocity, Vec3::Y, density, 0.005);
        }
        let terminal = (2.0 * density * 9.81 / air.density).sqrt();
        assert!((velocity.length() / terminal - 1.0).abs() < 0.03, "{velocity}");
    }

    #[test]
    fn no_storm_makes_cloth_faster_than_itself() {
        for speed in [1.0, 100.0, 1e6] {
            let push = Air::default().push(Vec3::X * -speed, Vec3::X, 1e-3, 0.01);
            assert!(push.x > 0.0 && push.x <= speed && push.y == 0.0);
        }
    }
}
