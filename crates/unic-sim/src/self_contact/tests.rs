//! Contract: vertices that are disabled in a fold of the body pass through, and return to their
//! side when they are enabled again.

use super::*;

/// A face, and a second one whose first vertex is 1 mm over it.
fn two_faces() -> (TriMesh, Particles) {
    let corners = [Vec3::ZERO, Vec3::Z * 0.1, Vec3::X * 0.1];
    let lone = [0.001, 0.101, 0.101].map(|y| Vec3::new(0.03, y, 0.03 + y));
    let rest = corners.iter().copied().chain(lone.map(|p| p + Vec3::Y)).collect();
    let rest = TriMesh::new(rest, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
    let positions: Vec<Vec3> = corners.iter().copied().chain(lone).collect();
    let particles = Particles {
        previous: positions.clone(),
        velocities: vec![Vec3::ZERO; 6],
        inverse_masses: vec![1.0; 6],
        positions,
    };
    (rest, particles)
}

fn height_over_face(particles: &Particles) -> f32 {
    let [a, b, c] = [0, 1, 2].map(|i| particles.positions[i]);
    let normal = (b - a).cross(c - a).normalize();
    (particles.positions[3] - a).dot(normal)
}

#[test]
fn disabled_vertices_pass_through_and_return_to_their_side() {
    let (rest, mut particles) = two_faces();
    let mut contacts = SelfContacts::new(&rest, SelfContactSettings::default());
    contacts.begin_interval(&particles, 0.01);
    contacts.disable_vertices(|particle| particle == 3);
    particles.positions[3].y = -0.002;
    contacts.project(0.01, &mut particles);
    assert!(height_over_face(&particles) < -0.0019, "it passes through");
    // Enabled again, it is on the wrong side and is pushed back.
    for _ in 0..200 {
        particles.previous.clone_from(&particles.positions);
        contacts.begin_interval(&particles, 0.01);
        contacts.project(0.01, &mut particles);
    }
    assert!(
        height_over_face(&particles) > 0.0,
        "{}",
        height_over_face(&particles)
    );
}
