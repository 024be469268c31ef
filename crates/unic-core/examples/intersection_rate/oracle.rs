//! Closest points by parry3d, for comparison.

use super::{median, scene::Scene};
use cpu_time::ThreadTime;
use parry3d::{math::Vector, query::PointQuery, shape::TriMesh};
use std::hint::black_box;

/// Number of frames that are measured: few, because parry3d builds a new tree for each.
const FRAMES: usize = 5;

pub(crate) struct Oracle;

impl Oracle {
    /// Measures the build of a tree over the posed body, and the search for the closest point to
    /// every garment vertex, on one thread.
    pub(crate) fn print(scene: &Scene) {
        let (mut build, mut query) = (Vec::new(), Vec::new());
        for frame in scene.frames.iter().take(FRAMES) {
            let vector = |p: &glam::Vec3| Vector::new(p.x, p.y, p.z);
            let vertices = frame.body.iter().map(vector).collect();
            let start = ThreadTime::now();
            let mesh = TriMesh::new(vertices, scene.character.body.faces.clone()).expect("a sound mesh");
            build.push(start.elapsed().as_secs_f64() * 1e3);
            let start = ThreadTime::now();
            for p in &frame.garment {
                black_box(mesh.project_local_point(vector(p), false));
            }
            query.push(start.elapsed().as_secs_f64() * 1e3);
        }
        println!("  {:24} {:8.3}", "parry3d, tree", median(&build));
        println!("  {:24} {:8.3}", "parry3d, closest points", median(&query));
    }
}
