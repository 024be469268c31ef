//! Bodies and a minimal integrator for the contact tests: free particles without cloth, moved by
//! gravity and contact alone.

#![allow(dead_code, unreachable_pub, reason = "each test takes what it needs")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use glam::{Affine3A, Quat, Vec3};
use unic_core::{mesh::TriMesh, subdivide::subdivided};
use unic_sim::{
    Particles,
    body::BodyInterval,
    contact::{BodyContacts, ContactSettings},
};

pub const GRAVITY: Vec3 = Vec3::new(0.0, -9.81, 0.0);
/// Length of an interval, seconds: a quarter of a frame at 30 fps.
pub const INTERVAL_S: f32 = 1.0 / 120.0;
/// Number of substeps in an interval.
pub const SUBSTEPS: usize = 5;

/// A closed sphere that faces outwards: an octahedron, subdivided `level + 1` times.
pub fn sphere(level: usize, radius: f32) -> TriMesh {
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let upper = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]];
    let lower = [[2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let mut mesh = TriMesh::new(axes.to_vec(), [upper, lower].concat()).unwrap();
    for _ in 0..=level {
        mesh = subdivided(&mesh).mesh;
        mesh.vertices.iter_mut().for_each(|v| *v = v.normalize());
    }
    mesh.vertices.iter_mut().for_each(|v| *v *= radius);
    mesh
}

/// A capsule along y: a sphere whose halves are moved apart by `half_length` metres each.
pub fn capsule(radius: f32, half_length: f32) -> TriMesh {
    let mut mesh = sphere(3, radius);
    for v in &mut mesh.vertices {
        if v.y.abs() > 1e-6 {
            v.y += half_length * v.y.signum();
        }
    }
    mesh
}

/// A sheet of squares in the xz plane that faces up and has its middle at the origin.
pub fn sheet(squares: u32, side: f32) -> TriMesh {
    let at = |x: u32, z: u32| z * (squares + 1) + x;
    let middle = squares as f32 * side / 2.0;
    let place = |i: u32| {
        let (x, z) = ((i % (squares + 1)) as f32, (i / (squares + 1)) as f32);
        Vec3::new(x * side - middle, 0.0, z * side - middle)
    };
    let corners = (0..squares).flat_map(|z| (0..squares).map(move |x| (x, z)));
    let faces = corners.flat_map(|(x, z)| {
        let [a, b, c, d] = [at(x, z), at(x, z + 1), at(x + 1, z + 1), at(x + 1, z)];
        [[a, b, c], [a, c, d]]
    });
    let vertices = (0..(squares + 1).pow(2)).map(place).collect();
    TriMesh::new(vertices, faces.collect()).unwrap()
}

/// Joins two meshes to one.
pub fn both(a: &TriMesh, b: &TriMesh) -> TriMesh {
    let count = a.vertices.len() as u32;
    let moved = b.faces.iter().map(|f| f.map(|v| v + count));
    TriMesh::new(
        [&a.vertices[..], &b.vertices].concat(),
        a.faces.iter().copied().chain(moved).collect(),
    )
    .unwrap()
}

/// Vertices of a mesh after a rotation and a translation.
pub fn placed(mesh: &TriMesh, rotation: Quat, translation: Vec3) -> Vec<Vec3> {
    let world_from_rest = Affine3A::from_rotation_translation(rotation, translation);
    let place = |&v: &Vec3| world_from_rest.transform_point3(v);
    mesh.vertices.iter().map(place).collect()
}

/// Particles of one gram each, at rest.
pub fn at_rest(positions: Vec<Vec3>) -> Particles {
    Particles {
        previous: positions.clone(),
        velocities: vec![Vec3::ZERO; positions.len()],
        inverse_masses: vec![1000.0; positions.len()],
        positions,
    }
}

/// Begins a substep: predicts positions under `gravity`.
pub fn predict(particles: &mut Particles, gravity: Vec3, dt: f32) {
    particles.previous.clone_from(&particles.positions);
    for (x, v) in particles.positions.iter_mut().zip(&mut particles.velocities) {
        *v += gravity * dt;
        *x += *v * dt;
    }
}

/// Ends a substep: computes velocities from positions.
pub fn finish(particles: &mut Particles, dt: f32) {
    let moved = particles.positions.iter().zip(&particles.previous);
    for ((x, before), v) in moved.zip(&mut particles.velocities) {
        *v = (x - before) / dt;
    }
}

/// Free particles in contact with a body.
pub struct Scene {
    pub interval: BodyInterval,
    pub contacts: BodyContacts,
    pub particles: Particles,
    pub gravity: Vec3,
}

impl Scene {
    pub fn new(body: &TriMesh, positions: Vec<Vec3>, settings: ContactSettings) -> Self {
        Self {
            interval: BodyInterval::new(body),
            contacts: BodyContacts::new(body, positions.len(), settings),
            particles: at_rest(positions),
            gravity: GRAVITY,
        }
    }

    /// Advances by one interval, at whose end the body's vertices are at `end`.
    pub fn advance(&mut self, end: &[Vec3]) {
        self.interval.advance(end);
        self.contacts
            .begin_interval(&self.interval, &self.particles, INTERVAL_S);
        let dt = INTERVAL_S / SUBSTEPS as f32;
        for substep in 0..SUBSTEPS {
            predict(&mut self.particles, self.gravity, dt);
            let fraction = |k: usize| k as f32 / SUBSTEPS as f32;
            self.contacts.project(
                &self.interval,
                fraction(substep),
                fraction(substep + 1),
                &mut self.particles,
            );
            finish(&mut self.particles, dt);
        }
    }
}
