//! Contract: a bending constraint is projected along the gradient of its hinge's angle, by the step
//! that XPBD prescribes; damping resists motion; slivers make no constraint.

use super::{BendBlock, BendConstraint};
use crate::{Particles, constraint::ColouredConstraints};
use glam::{DVec3, Vec3};
use proptest::prelude::*;

const SECONDS: f32 = 1e-3;

const FLAT: [Vec3; 4] = [
    Vec3::ZERO,
    Vec3::X,
    Vec3::new(0.4, 0.8, 0.0),
    Vec3::new(0.7, -0.9, 0.0),
];

/// Computes the angle of a hinge in f64, from its sine and cosine.
fn angle([a, b, left, right]: [DVec3; 4]) -> f64 {
    let e = (b - a).normalize();
    let (n, m) = (e.cross(left - a).normalize(), (right - a).cross(e).normalize());
    n.cross(m).dot(e).atan2(n.dot(m))
}

/// Computes the gradient of the angle at one corner by central differences.
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

/// Four particles at rest.
fn at(positions: [Vec3; 4], inverse_masses: &[f32]) -> Particles {
    Particles {
        positions: positions.to_vec(),
        previous: positions.to_vec(),
        velocities: vec![Vec3::ZERO; 4],
        inverse_masses: inverse_masses.to_vec(),
    }
}

proptest! {
    #[test]
    fn a_hinge_moves_along_the_gradient_of_its_angle(
        offsets in proptest::array::uniform12(-0.3f32..0.3), stiffness in 1e4f32..1e7,
    ) {
        let masses = [1.0, 2.0, 0.5, 0.0];
        // Stiff enough that the hinge closes much of its angle in a step of a millisecond.
        let one = BendConstraint::new([0, 1, 2, 3], FLAT, 1.0, stiffness, 0.0).unwrap();
        let start: [Vec3; 4] =
            std::array::from_fn(|i| FLAT[i] + Vec3::from_slice(&offsets[3 * i..3 * i + 3]));
        let mut particles = at(start, &masses);
        ColouredConstraints::<BendBlock, 4>::new(&[one], &masses).solve(&mut particles, SECONDS);

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
fn a_pleat_keeps_its_rest_angle_unless_the_share_is_reduced() {
    let mut pleat = FLAT;
    pleat[3] = Vec3::new(0.5, 0.3, 0.9);
    let masses = [1.0; 4];
    let solved = |share: f32| {
        let one = BendConstraint::new([0, 1, 2, 3], pleat, share, 1.0, 0.0).unwrap();
        let mut particles = at(pleat, &masses);
        ColouredConstraints::<BendBlock, 4>::new(&[one], &masses).solve(&mut particles, SECONDS);
        particles.positions
    };
    assert_eq!(solved(1.0), pleat);
    assert_ne!(solved(0.0), pleat);
}

#[test]
fn damping_slows_an_opening_hinge() {
    let masses = [0.0, 0.0, 0.0, 1.0];
    let mut moved = FLAT;
    moved[3].z = 0.02;
    let lift = |damping: f32| {
        let one = BendConstraint::new([0, 1, 2, 3], FLAT, 1.0, 1e-2, damping).unwrap();
        let mut particles = at(moved, &masses);
        particles.previous = FLAT.to_vec();
        ColouredConstraints::<BendBlock, 4>::new(&[one], &masses).solve(&mut particles, SECONDS);
        particles.positions[3].z
    };
    assert!(lift(0.1) < lift(0.0) && lift(0.1) > 0.0);
}

#[test]
fn a_sliver_makes_no_hinge() {
    let mut sliver = FLAT;
    sliver[2] = Vec3::X * 0.5;
    assert!(BendConstraint::new([0, 1, 2, 3], sliver, 1.0, 1.0, 0.0).is_none());
}
