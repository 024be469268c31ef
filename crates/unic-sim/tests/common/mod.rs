//! Pieces of cloth for tests, and how they are simulated.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test file uses its own part, and is a crate"
)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::Vec3;
use std::sync::Arc;
use unic_core::mesh::TriMesh;
use unic_sim::{Air, Cloth, ClothSpec, Material, Simulation, SimulationSettings};

/// A horizontal sheet of equilateral triangles with sides of `side` metres and `columns` × `rows`
/// vertices. Rows run along x; every other one is shifted by half a side.
pub fn sheet(columns: u32, rows: u32, side: f32) -> TriMesh {
    let place = |i: u32| {
        let (column, row) = ((i % columns) as f32, i / columns);
        let x = column + 0.5 * (row % 2) as f32;
        Vec3::new(x, 0.0, row as f32 * 0.75f32.sqrt()) * side
    };
    let square = |q: u32| {
        let (row, column) = (q / (columns - 1), q % (columns - 1));
        let a = row * columns + column;
        let (b, c, d) = (a + 1, a + columns, a + columns + 1);
        if row % 2 == 0 {
            [[a, c, b], [b, c, d]]
        } else {
            [[a, c, d], [a, d, b]]
        }
    };
    let faces = (0..(columns - 1) * (rows - 1)).flat_map(square);
    TriMesh::new((0..columns * rows).map(place).collect(), faces.collect()).unwrap()
}

/// Settings without air and without damping, except for the material's own.
pub fn vacuum() -> SimulationSettings {
    SimulationSettings {
        air: Air::NONE,
        damping_per_s: 0.0,
        ..Default::default()
    }
}

/// A simulation of cloth of one material, with the vertices pinned for which `is_pinned` is true.
pub fn pinned(
    mesh: TriMesh,
    material: Material,
    settings: SimulationSettings,
    is_pinned: impl Fn(Vec3) -> bool,
) -> Simulation {
    let pins = (0..mesh.vertices.len() as u32).filter(|&v| is_pinned(mesh.vertices[v as usize]));
    let spec = ClothSpec {
        pins: pins.collect(),
        ..ClothSpec::new(mesh.clone(), material)
    };
    Simulation::new(Arc::new(Cloth::new(&spec).unwrap()), settings).unwrap()
}

/// Advances a simulation by `seconds`, without wind.
pub fn run(simulation: &mut Simulation, seconds: f32) {
    let frames = (seconds * simulation.settings().fps).round() as u32;
    for _ in 0..frames {
        simulation.step_still(Vec3::ZERO).unwrap();
    }
}
