//! Contract: long-range limits act only where cloth is stretched. They conserve momentum, leave
//! held particles in place and respect holes.

use super::{LongRangeLimits, LongRangeScratch};
use crate::Particles;
use glam::{DVec3, Quat, Vec3};
use unic_core::mesh::TriMesh;

/// A sheet of `width` × `height` squares of `side` metres in the plane z = 0.
fn sheet(width: u32, height: u32, side: f32) -> TriMesh {
    let row = width + 1;
    let place = |i: u32| Vec3::new((i % row) as f32, (i / row) as f32, 0.0) * side;
    let faces = (0..width * height).flat_map(|q| {
        let a = q / width * row + q % width;
        [[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]
    });
    TriMesh::new((0..row * (height + 1)).map(place).collect(), faces.collect()).unwrap()
}

fn particles(positions: Vec<Vec3>) -> Particles {
    let count = positions.len();
    Particles {
        previous: positions.clone(),
        positions,
        velocities: vec![Vec3::ZERO; count],
        inverse_masses: vec![1.0; count],
    }
}

/// Positions after one projection of all limits.
fn solved(limits: &LongRangeLimits, positions: Vec<Vec3>) -> Vec<Vec3> {
    let mut particles = particles(positions);
    limits.solve(&mut particles, &mut LongRangeScratch::default());
    particles.positions
}

#[test]
fn unstretched_cloth_is_unchanged() {
    let sheet = sheet(60, 60, 0.01);
    let count = sheet.vertices.len();
    let limits = LongRangeLimits::build(&sheet, &vec![1e-4; count], &vec![false; count]);
    assert!(limits.levels.len() > 1 && limits.limit_count() > 300);
    let turn = Quat::from_rotation_x(1.0);
    let rolled = |v: &Vec3| Vec3::new(0.05 * (v.x / 0.05).sin(), v.y, 0.05 * (v.x / 0.05).cos());
    let unstretched: [Vec<Vec3>; 3] = [
        sheet.vertices.iter().map(|v| turn * *v).collect(),
        sheet.vertices.iter().map(rolled).collect(),
        sheet.vertices.iter().map(|v| *v * 0.7).collect(),
    ];
    for positions in unstretched {
        assert_eq!(solved(&limits, positions.clone()), positions);
    }
}

#[test]
fn projection_conserves_linear_and_angular_momentum() {
    let sheet = sheet(40, 50, 0.01);
    let masses: Vec<f32> = (0..sheet.vertices.len())
        .map(|i| 1e-4 * (1 + i % 3) as f32)
        .collect();
    let limits = LongRangeLimits::build(&sheet, &masses, &vec![false; masses.len()]);
    let stretched = |v: &Vec3| Vec3::new(v.x, v.y * 1.1, (v.x * 20.0).sin() * 0.01);
    let before: Vec<Vec3> = sheet.vertices.iter().map(stretched).collect();
    let after = solved(&limits, before.clone());
    let (mut linear, mut angular, mut sum) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for ((a, b), m) in before.iter().zip(&after).zip(&masses) {
        let moved = (b.as_dvec3() - a.as_dvec3()) * f64::from(*m);
        linear += moved;
        angular += a.as_dvec3().cross(moved);
        sum += moved.length();
    }
    assert!(sum > 1e-6);
    assert!(linear.length() < 1e-3 * sum, "{linear} of {sum}");
    assert!(angular.length() < 1e-3 * sum, "{angular} of {sum}");
    let height = |v: &[Vec3]| v[v.len() - 1].y - v[0].y;
    assert!(height(&after) < 0.99 * height(&before));
}

#[test]
fn held_particles_do_not_move() {
    let sheet = sheet(30, 60, 0.01);
    let is_held: Vec<bool> = sheet.vertices.iter().map(|v| v.y > 0.595).collect();
    let limits = LongRangeLimits::build(&sheet, &vec![1e-4; is_held.len()], &is_held);
    let lowered = |v: &Vec3| Vec3::new(v.x, 0.6 + (v.y - 0.6) * 1.2, 0.0);
    let before: Vec<Vec3> = sheet.vertices.iter().map(lowered).collect();
    let after = solved(&limits, before.clone());
    for i in (0..before.len()).filter(|&i| is_held[i]) {
        assert_eq!(before[i], after[i]);
    }
    assert!(after[0].y > before[0].y + 0.01);
}

#[test]
fn no_limit_spans_a_hole() {
    let mut holed = sheet(60, 60, 0.01);
    let middle = Vec3::new(0.3, 0.3, 0.0);
    let vertices = holed.vertices.clone();
    let is_cloth = |f: &[u32; 3]| f.iter().all(|&v| vertices[v as usize].distance(middle) > 0.1);
    holed.faces.retain(is_cloth);
    let count = holed.vertices.len();
    let limits = LongRangeLimits::build(&holed, &vec![1e-4; count], &vec![false; count]);
    let level = limits.levels.last().unwrap();
    let centre = |c: u32| -> Vec3 {
        let members = level.starts[c as usize] as usize..level.starts[c as usize + 1] as usize;
        level.members[members]
            .iter()
            .map(|member| holed.vertices[member.index as usize] * member.weight)
            .sum()
    };
    for limit in &level.limits {
        let [a, b] = limit.ends.map(centre);
        // The straight line between the two stays clear of the middle of the hole.
        let t = ((middle - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        assert!(a.lerp(b, t).distance(middle) > 0.06, "{a} {b}");
    }
}
