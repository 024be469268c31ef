//! Contract: each strain of a triangle is projected along its gradient, by the step that XPBD
//! prescribes; rest shapes have no strain, however thin they are.

use super::{InPlane, StretchBlock, StretchConstraint};
use crate::{Particles, constraint::ColouredConstraints};
use glam::{DVec3, Vec3};
use proptest::prelude::*;

const SECONDS: f32 = 1e-3;

fn point(reach: f32) -> impl Strategy<Value = Vec3> {
    let axis = || -reach..=reach;
    (axis(), axis(), axis()).prop_map(Vec3::from)
}

/// Computes weft, warp and shear strain in f64, from their definitions.
fn strains(one: &StretchConstraint, x: [DVec3; 3]) -> [f64; 3] {
    let [p, q] = one.shape.map(|s| s.as_dvec2());
    let (d1, d2) = (x[1] - x[0], x[2] - x[0]);
    let (weft, warp) = (d1 * p.x + d2 * q.x, d1 * p.y + d2 * q.y);
    let green = |f: DVec3| 0.5 * (f.length_squared() - 1.0);
    [green(weft), green(warp), weft.dot(warp)]
}

/// Computes the gradient of one strain at one corner by central differences.
fn gradient(one: &StretchConstraint, kind: usize, x: [DVec3; 3], corner: usize) -> DVec3 {
    let step = 1e-6;
    DVec3::from_array(std::array::from_fn(|axis| {
        let at = |by: f64| {
            let mut moved = x;
            moved[corner][axis] += by;
            strains(one, moved)[kind]
        };
        (at(step) - at(-step)) / (2.0 * step)
    }))
}

proptest! {
    #[test]
    fn each_strain_moves_along_its_gradient(
        offset in [point(0.15), point(0.15), point(0.15)], warp in point(1.0), kind in 0usize..3,
    ) {
        let rest = [Vec3::ZERO, Vec3::new(1.0, 0.2, 0.0), Vec3::new(0.3, 0.9, 0.1)];
        let of_kind = |k: usize| if k == kind { 500.0 } else { 0.0 };
        let stiffness = InPlane { weft: of_kind(0), warp: of_kind(1), shear: of_kind(2) };
        let one = StretchConstraint::new([0, 1, 2], rest, warp, stiffness);
        let start = [0, 1, 2].map(|i| rest[i] + offset[i]);
        let masses = vec![2.0, 1.0, 0.5];
        let mut particles = Particles {
            positions: start.to_vec(),
            previous: start.to_vec(),
            velocities: vec![Vec3::ZERO; 3],
            inverse_masses: masses.clone(),
        };
        ColouredConstraints::<StretchBlock, 3>::new(&[one], &masses).solve(&mut particles, SECONDS);

        let x = start.map(|v| v.as_dvec3());
        let gradients = [0, 1, 2].map(|corner| gradient(&one, kind, x, corner));
        let mobility: f64 = (0..3).map(|i| f64::from(masses[i]) * gradients[i].length_squared()).sum();
        let compliance = 1.0 / (500.0 * f64::from(one.area) * f64::from(SECONDS).powi(2));
        let lambda = -strains(&one, x)[kind] / (mobility + compliance);
        for i in 0..3 {
            let expected = gradients[i] * f64::from(masses[i]) * lambda;
            let moved = particles.positions[i].as_dvec3() - x[i];
            prop_assert!((moved - expected).length() < 2e-6, "{moved} {expected}");
        }
    }

    #[test]
    fn a_triangle_at_rest_has_no_strain_however_thin(
        a in point(1.0), b in point(1.0), c in point(1.0), warp in point(1.0), flat in 0.0f32..1.0,
    ) {
        let c = a.lerp(b, 0.4).lerp(c, flat * flat * flat);
        prop_assume!(a.distance(b) > 1e-2);
        let stiffness = InPlane { weft: 100.0, warp: 100.0, shear: 100.0 };
        let one = StretchConstraint::new([0, 1, 2], [a, b, c], warp, stiffness);
        prop_assert!(one.shape.iter().all(|s| s.is_finite()) && one.area > 0.0);
        let height = (b - a).cross(c - a).length() / a.distance(b);
        if height > 0.05 {
            let x = [a, b, c].map(|v| v.as_dvec3());
            prop_assert!(strains(&one, x).iter().all(|e| e.abs() < 1e-4));
        }
    }
}

#[test]
fn warp_is_the_direction_that_warp_stiffness_resists() {
    // Only the warp, along +Y, is stiff: a triangle stretched along X stays stretched.
    let rest = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let stiffness = InPlane {
        weft: 0.0,
        warp: 1e6,
        shear: 0.0,
    };
    let one = StretchConstraint::new([0, 1, 2], rest, Vec3::Y, stiffness);
    let solved = |x: [Vec3; 3]| {
        let mut particles = Particles {
            positions: x.to_vec(),
            previous: x.to_vec(),
            velocities: vec![Vec3::ZERO; 3],
            inverse_masses: vec![1.0; 3],
        };
        ColouredConstraints::<StretchBlock, 3>::new(&[one], &[1.0; 3]).solve(&mut particles, SECONDS);
        particles.positions
    };
    assert_eq!(solved([Vec3::ZERO, Vec3::X * 1.5, Vec3::Y])[1], Vec3::X * 1.5);
    assert!(solved([Vec3::ZERO, Vec3::X, Vec3::Y * 1.5])[2].y < 1.45);
}
