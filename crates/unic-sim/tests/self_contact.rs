//! Contract of contact of the cloth with itself:
//!
//! - Layers stay apart and on their sides.
//! - Momentum is conserved.
//! - Rest shapes whose layers touch stay at rest.
//! - Results have the same bytes for any number of threads.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod scene;

use glam::Vec3;
use scene::{GRAVITY, at_rest, both, finish, predict, sheet};
use unic_core::{mesh::TriMesh, surface::Surface, topology::edges};
use unic_sim::{
    Particles,
    contact::Friction,
    self_contact::{SelfContactSettings, SelfContacts},
};

const INTERVAL_S: f32 = 1.0 / 120.0;
const SUBSTEPS: usize = 5;

/// Two sheets of 20 cm, the upper one `gap` metres above the lower one. It is turned and shifted,
/// so that no two vertices are above each other.
fn sheets(gap: f32) -> TriMesh {
    let lower = sheet(20, 0.01);
    let mut upper = sheet(20, 0.01);
    let turn = glam::Quat::from_rotation_y(0.3);
    upper.vertices = scene::placed(&upper, turn, Vec3::new(0.003, gap, 0.004));
    both(&lower, &upper)
}

/// Cloth of edges with fixed lengths, which are projected ten times per substep.
struct Net {
    particles: Particles,
    contacts: SelfContacts,
    edges: Vec<NetEdge>,
    gravity: Vec3,
}

/// An edge of a net.
struct NetEdge {
    ends: [usize; 2],
    /// Rest length, metres.
    length: f32,
}

impl Net {
    fn new(rest: &TriMesh, settings: SelfContactSettings) -> Self {
        let length = |[a, b]: [usize; 2]| rest.vertices[a].distance(rest.vertices[b]);
        let edges = edges(&rest.faces).into_iter().map(|e| e.map(|v| v as usize));
        Self {
            particles: at_rest(rest.vertices.clone()),
            contacts: SelfContacts::new(rest, settings),
            edges: edges
                .map(|ends| NetEdge {
                    ends,
                    length: length(ends),
                })
                .collect(),
            gravity: GRAVITY,
        }
    }

    fn advance(&mut self, seconds: f32) {
        let dt = INTERVAL_S / SUBSTEPS as f32;
        for _ in 0..(seconds / INTERVAL_S).round() as usize {
            self.contacts.begin_interval(&self.particles, INTERVAL_S);
            for _ in 0..SUBSTEPS {
                predict(&mut self.particles, Vec3::ZERO, dt);
                self.accelerate(dt);
                (0..10).for_each(|_| self.keep_lengths());
                self.contacts.project(dt, &mut self.particles);
                finish(&mut self.particles, dt);
            }
        }
    }

    /// Applies gravity to free particles and keeps pinned ones in place.
    fn accelerate(&mut self, dt: f32) {
        let p = &mut self.particles;
        for ((x, v), w) in p
            .positions
            .iter_mut()
            .zip(&mut p.velocities)
            .zip(&p.inverse_masses)
        {
            if *w == 0.0 {
                *x -= *v * dt;
                *v = Vec3::ZERO;
            } else {
                *v += self.gravity * dt;
                *x += self.gravity * dt * dt;
            }
        }
    }

    fn keep_lengths(&mut self) {
        let Particles {
            positions,
            inverse_masses,
            ..
        } = &mut self.particles;
        for &NetEdge { ends: [a, b], length } in &self.edges {
            let along = positions[b] - positions[a];
            let sum = inverse_masses[a] + inverse_masses[b];
            if sum > 0.0 {
                let correction = along * ((along.length() - length) / (along.length() * sum));
                positions[a] += correction * inverse_masses[a];
                positions[b] -= correction * inverse_masses[b];
            }
        }
    }
}

/// Number of vertices of the upper sheet that are more than 1 mm below the lower one. Vertices over
/// its rim do not count, because edges can cross there.
fn passed_through(net: &Net, rest: &TriMesh) -> usize {
    let half = rest.vertices.len() / 2;
    let lower = rest.faces[..rest.faces.len() / 2].to_vec();
    let (posed, upper) = net.particles.positions.split_at(half);
    let surface = Surface::build(&TriMesh::new(posed.to_vec(), lower.clone()).unwrap());
    let is_rim = |v: u32| rest.vertices[v as usize].abs().max_element() > 0.085;
    let is_through = |p: &&Vec3| {
        let hit = surface.closest(**p).unwrap();
        let rim = lower[hit.face as usize].iter().any(|&v| is_rim(v));
        !rim && hit.signed_distance < -1e-3
    };
    upper.iter().filter(is_through).count()
}

#[test]
fn a_sheet_dropped_onto_another_stays_above_it() {
    let rest = sheets(0.05);
    let half = rest.vertices.len() / 2;
    let mut net = Net::new(&rest, SelfContactSettings::default());
    // The lower sheet is pinned.
    net.particles.inverse_masses[..half].fill(0.0);
    net.advance(1.5);
    assert_eq!(passed_through(&net, &rest), 0);
    let speeds = net.particles.velocities[half..].iter().map(|v| v.length());
    let mean = speeds.sum::<f32>() / half as f32;
    assert!(mean < 0.05, "not at rest: {mean} m/s");
}

#[test]
fn colliding_sheets_do_not_pass_through_and_conserve_momentum() {
    let rest = sheets(0.03);
    let half = rest.vertices.len() / 2;
    let mut net = Net::new(&rest, SelfContactSettings::default());
    net.gravity = Vec3::ZERO;
    net.particles.velocities[..half].fill(Vec3::new(0.2, 0.5, 0.1));
    net.particles.velocities[half..].fill(Vec3::new(-0.3, -0.5, 0.0));
    let momentum = |net: &Net| {
        net.particles
            .velocities
            .iter()
            .map(|v| v.as_dvec3())
            .sum::<glam::DVec3>()
    };
    let energy = |net: &Net| {
        net.particles
            .velocities
            .iter()
            .map(|v| v.length_squared())
            .sum::<f32>()
    };
    let (start, mut last) = (momentum(&net), energy(&net));
    for _ in 0..60 {
        net.advance(INTERVAL_S);
        assert!(
            energy(&net) < last * 1.02,
            "energy grew from {last} to {}",
            energy(&net)
        );
        last = energy(&net);
    }
    let change = (momentum(&net) - start).length() / rest.vertices.len() as f64;
    assert!(change < 1e-4, "{change} m/s a particle");
    assert_eq!(passed_through(&net, &rest), 0);
}

#[test]
fn layers_that_touch_in_the_rest_shape_stay_at_rest() {
    for gap in [0.0, 1e-6, 0.0005, 0.0019] {
        let rest = sheets(gap);
        let mut net = Net::new(&rest, SelfContactSettings::default());
        net.gravity = Vec3::ZERO;
        net.advance(0.1);
        for (p, at_rest) in net.particles.positions.iter().zip(&rest.vertices) {
            // Within their plane the vertices shift by rounding errors of the edges.
            assert!(
                (p.y - at_rest.y).abs() < 1e-6 && p.distance(*at_rest) < 1e-4,
                "gap {gap}: {p} from {at_rest}"
            );
        }
    }
}

/// Moves the first corner of a triangle along a path next to a pinned sheet, one point per
/// interval. Returns the displacement by contact at the last point, metres.
fn displacement_after(path: &[Vec3]) -> Vec3 {
    let cloth = sheet(10, 0.01);
    let far = [Vec3::Y, Vec3::Y + Vec3::X * 0.01, Vec3::Y + Vec3::Z * 0.01];
    let rest = both(&cloth, &TriMesh::new(far.to_vec(), vec![[0, 1, 2]]).unwrap());
    let mut particles = at_rest(rest.vertices.clone());
    let moved = cloth.vertices.len();
    particles.inverse_masses[..moved].fill(0.0);
    let mut contacts = SelfContacts::new(&rest, SelfContactSettings::default());
    for point in path {
        particles.positions[moved] = *point;
        particles.previous[moved] = *point;
        contacts.begin_interval(&particles, INTERVAL_S);
    }
    contacts.project(INTERVAL_S, &mut particles);
    particles.positions[moved] - path[path.len() - 1]
}

#[test]
fn a_vertex_keeps_its_side_through_a_face_and_changes_it_around_a_hem() {
    let at = |x: f32, y: f32| Vec3::new(x, y, 0.0023);
    // From 3 mm above the sheet to 1 mm below it, and one face farther: it is pushed back up.
    let through = displacement_after(&[at(0.001, 0.003), at(0.001, -0.001), at(0.008, -0.001)]);
    assert!(through.y > 1e-3, "{through}");
    // Around the hem, which is at 5 cm, to a point below the sheet: it is pushed down.
    let around = [
        (0.047, 0.003),
        (0.0515, 0.003),
        (0.0515, -0.003),
        (0.047, -0.003),
        (0.047, -0.001),
    ];
    let around = displacement_after(&around.map(|(x, y)| at(x, y)));
    assert!(around.y < -5e-4, "{around}");
}

#[test]
fn a_layer_on_a_slope_sticks_with_friction_and_slides_without() {
    for (coefficient, holds) in [(0.5, true), (0.0, false)] {
        let rest = sheets(0.0025);
        let half = rest.vertices.len() / 2;
        let friction = Friction {
            r#static: coefficient,
            dynamic: coefficient,
        };
        let mut net = Net::new(
            &rest,
            SelfContactSettings {
                friction,
                ..Default::default()
            },
        );
        net.particles.inverse_masses[..half].fill(0.0);
        // A slope of 15 degrees: tan = 0.27.
        net.gravity = glam::Quat::from_rotation_z(0.26) * GRAVITY;
        net.advance(0.2);
        let moved = |i: usize| net.particles.positions[i].distance(rest.vertices[i]);
        let middle = half + half / 2;
        assert_eq!(moved(middle) < 2e-3, holds, "{} m", moved(middle));
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut net = Net::new(&sheets(0.004), SelfContactSettings::default());
            net.particles.inverse_masses[..441].fill(0.0);
            net.advance(0.2);
            net.particles
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(7));
}

#[test]
fn positions_that_are_not_finite_make_no_contact() {
    let rest = sheets(0.001);
    let mut particles = at_rest(rest.vertices.clone());
    particles.positions[3] = Vec3::NAN;
    particles.positions[500] = Vec3::INFINITY;
    let mut contacts = SelfContacts::new(&rest, SelfContactSettings::default());
    contacts.begin_interval(&particles, INTERVAL_S);
    contacts.project(1e-3, &mut particles);
    let bad = particles.positions.iter().filter(|p| !p.is_finite()).count();
    assert_eq!(bad, 2);
}
