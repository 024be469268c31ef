//! Contract: results do not depend on the numbering of the mesh or on the number of threads. Broken
//! meshes and extreme speeds stay stable, and invalid input is an error.

mod common;

use common::{pinned, run, sheet};
use glam::Vec3;
use std::sync::Arc;
use unic_core::mesh::TriMesh;
use unic_sim::{
    Cloth, ClothSpec, Material, Simulation, SimulationError, SimulationSettings,
    self_contact::SelfContactSettings,
};

/// Vertices of a sheet that is pinned at two corners, after some frames.
fn drape(mesh: TriMesh, frames: u32) -> Vec<Vec3> {
    let settings = SimulationSettings {
        self_contact: Some(SelfContactSettings::default()),
        ..Default::default()
    };
    let mut cloth = pinned(mesh, Material::COTTON, settings, |v| {
        v.z < 1e-4 && (v.x < 0.03 || v.x > 0.2)
    });
    run(&mut cloth, frames as f32 / 30.0);
    cloth.vertices().to_vec()
}

#[test]
fn results_do_not_depend_on_the_numbering_of_the_mesh() {
    let mesh = sheet(25, 25, 0.01);
    let count = mesh.vertices.len() as u32;
    // 7919 is prime, so that this is a permutation of the vertices.
    let renumbered = |v: u32| (v * 7919 + 13) % count;
    let mut other = mesh.clone();
    for v in 0..count {
        other.vertices[renumbered(v) as usize] = mesh.vertices[v as usize];
    }
    other.faces = mesh
        .faces
        .iter()
        .rev()
        .map(|&[a, b, c]| [b, c, a].map(renumbered))
        .collect();
    let (one, two) = (drape(mesh, 20), drape(other, 20));
    let worst = (0..count)
        .map(|v| one[v as usize].distance(two[renumbered(v) as usize]))
        .fold(0.0, f32::max);
    // Particles are sorted by position. Only the first corner of each triangle differs, and with it
    // the rounding of what is computed from the input mesh.
    assert!(worst < 1e-5, "{worst}");
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| drape(sheet(120, 110, 0.004), 6))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(5));
}

#[test]
fn broken_meshes_stay_stable_and_seams_stay_closed() {
    // Two sheets that share a seam of split vertices, a third triangle on an inner edge, a triangle
    // without area, a sliver, a separate part and a vertex without faces.
    let left = sheet(12, 12, 0.01);
    let count = left.vertices.len() as u32;
    let mut mesh = left.clone();
    mesh.vertices
        .extend(left.vertices.iter().map(|v| Vec3::new(v.x, v.y, -v.z)));
    mesh.faces.extend(
        left.faces
            .iter()
            .map(|&[a, b, c]| [a + count, c + count, b + count]),
    );
    let next = mesh.vertices.len() as u32;
    mesh.vertices.extend([
        Vec3::new(0.05, 0.02, 0.05),
        Vec3::new(0.05, 0.3, 0.0),
        Vec3::new(0.06, 0.3, 0.0),
        Vec3::new(0.05, 0.3, 0.01),
        Vec3::new(1.0, 1.0, -1.0),
    ]);
    let [a, b, _] = mesh.faces[100];
    mesh.faces
        .extend([[a, b, next], [0, 0, 5], [0, 1, 3], [next + 1, next + 2, next + 3]]);
    let settings = SimulationSettings::default();
    let mut cloth = pinned(mesh, Material::COTTON, settings, |v| v.z > 0.09);
    run(&mut cloth, 1.0);
    let moved = cloth.vertices();
    for v in (0..count).filter(|&v| left.vertices[v as usize].z == 0.0) {
        assert_eq!(
            moved[v as usize],
            moved[(v + count) as usize],
            "the seam has opened"
        );
    }
    let loose = moved[next as usize + 1];
    assert!(loose.y < -0.3, "the loose part has not fallen: {loose}");
}

#[test]
fn extreme_speeds_do_not_explode() {
    let settings = SimulationSettings::default();
    let mut cloth = pinned(sheet(20, 20, 0.01), Material::TULLE, settings, |v| v.z < 1e-4);
    cloth.set_velocities(|v| Vec3::new((1e3 * v.x).sin(), (7e2 * v.z).cos(), 1.0) * 1e4);
    run(&mut cloth, 1.0);
    let farthest = cloth.vertices().iter().map(|v| v.length()).fold(0.0, f32::max);
    assert!(farthest < 1.0, "{farthest}");
}

#[test]
fn invalid_input_is_an_error() {
    let cloth = Arc::new(Cloth::new(&ClothSpec::new(sheet(4, 4, 0.1), Material::SILK)).unwrap());
    let bad = SimulationSettings {
        fps: 0.0,
        ..Default::default()
    };
    let refused = Simulation::new(Arc::clone(&cloth), bad).map(|_| ()).unwrap_err();
    assert!(matches!(refused, SimulationError::Setting { name: "fps", .. }));
    let mut simulation = Simulation::new(cloth, SimulationSettings::default()).unwrap();
    assert_eq!(
        simulation.step_still(Vec3::NAN).map(|_| ()),
        Err(SimulationError::Wind)
    );
    simulation.set_velocities(|_| Vec3::NAN);
    let exploded = simulation.step_still(Vec3::ZERO).map(|_| ());
    assert!(
        matches!(exploded, Err(SimulationError::NotFinite { .. })),
        "{exploded:?}"
    );
}
