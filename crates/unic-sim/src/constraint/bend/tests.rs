//! The projection is that of the hinge's angle, in value and gradient.

use super::{Bend, BendBlock};
use crate::{Particles, constraint::Coloured};
use glam::{DVec3, Vec3};
use proptest::prelude::*;

const SECONDS: f32 = 1e-3;

const FLAT: [Vec3; 4] = [
    Vec3::ZERO,
    Vec3::X,
    Vec3::new(0.4, 0.8, 0.0),
    Vec3::new(0.7, -0.9, 0.0),
];

/// The angle by the arc tangent of its sine and cosine.
fn angle([a, b, left, right]: [DVec3; 4]) -> f64 {
    let e = (b - a).normalize();
    let (n, m) = (e.cross(left - a).normalize(), (right - a).cross(e).normalize());
    n.cross(m).dot(e).atan2(n.dot(m))
}

fn gradient(x: [DVec3; 4], corner: usize) -> DVec3 {
    let step = 1e-6;
    DVec3::from_array(std::array::from_fn(|axis| {
        let at = |by: f64| {
            let mut moved = x;
            moved[corner][axis] += by;
            angle(moved)
        };
        (at(step) - at(-step)) / (2.0 * step)
    }))
}

fn at(places: [Vec3; 4], masses: &[f32]) -> Particles {
    Particles {
        positions: places.to_vec(),
        previous: places.to_vec(),
        velocities: vec![Vec3::ZERO; 4],
        inverse_masses: masses.to_vec(),
    }
}

proptest! {
    #[test]
    fn a_hinge_moves_along_the_gradient_of_its_angle(
        offsets in proptest::array::uniform12(-0.3f32..0.3), stiffness in 1e4f32..1e7,
    ) {
        let masses = [1.0, 2.0, 0.5, 0.0];
        // Stiff enough in a step of a millisecond for the hinge to move by a good part of its angle.
        let one = Bend::new([0, 1, 2, 3], FLAT, 1.0, stiffness, 0.0).unwrap();
        let start: [Vec3; 4] =
            std::array::from_fn(|i| FLAT[i] + Vec3::from_slice(&offsets[3 * i..3 * i + 3]));
        let mut particles = at(start, &masses);
        Coloured::<BendBlock, 4>::new(&[one], &masses).solve(&mut particles, SECONDS);

        let x = start.map(|v| v.as_dvec3());
        let gradients = [0, 1, 2, 3].map(|corner| gradient(x, corner));
        let mobility: f64 = (0..4).map(|i| f64::from(masses[i]) * gradients[i].length_squared()).sum();
        let compliance = f64::from(one.compliance) / f64::from(SECONDS).powi(2);
        let lambda = -angle(x) / (mobility + compliance);
        for i in 0..4 {
            let expected = gradients[i] * f64::from(masses[i]) * lambda;
            let moved = particles.positions[i].as_dvec3() - x[i];
            let tolerance = 1e-4 * expected.length() + 1e-5;
            prop_assert!((moved - expected).length() < tolerance, "{} {}", moved, expected);
        }
    }
}

#[test]
fn a_pleat_at_rest_stays_and_a_share_of_its_angle_can_be_pressed_out() {
    let mut pleat = FLAT;
    pleat[3] = Vec3::new(0.5, 0.3, 0.9);
    let masses = [1.0; 4];
    let solved = |share: f32| {
        let one = Bend::new([0, 1, 2, 3], pleat, share, 1.0, 0.0).unwrap();
        let mut particles = at(pleat, &masses);
        Coloured::<BendBlock, 4>::new(&[one], &masses).solve(&mut particles, SECONDS);
        particles.positions
    };
    assert_eq!(solved(1.0), pleat);
    assert_ne!(solved(0.0), pleat);
}

#[test]
fn friction_slows_a_hinge_that_opens() {
    let masses = [0.0, 0.0, 0.0, 1.0];
    let mut moved = FLAT;
    moved[3].z = 0.02;
    let lift = |damping: f32| {
        let one = Bend::new([0, 1, 2, 3], FLAT, 1.0, 1e-2, damping).unwrap();
        let mut particles = at(moved, &masses);
        particles.previous = FLAT.to_vec();
        Coloured::<BendBlock, 4>::new(&[one], &masses).solve(&mut particles, SECONDS);
        particles.positions[3].z
    };
    assert!(lift(0.1) < lift(0.0) && lift(0.1) > 0.0);
}

#[test]
fn a_sliver_is_no_hinge() {
    let mut sliver = FLAT;
    sliver[2] = Vec3::X * 0.5;
    assert!(Bend::new([0, 1, 2, 3], sliver, 1.0, 1.0, 0.0).is_none());
}
