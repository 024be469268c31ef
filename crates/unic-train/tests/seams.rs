//! Contract: a garment of panels that are not welded stays closed in free running on new motion,
//! whatever happens to vertices inside the body, with the state on all vertices or on few, and even
//! where the user's skinning weights differ across the seam.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::Vec3;
use std::sync::Arc;
use unic_core::{
    Animator, Corrects, IntersectionMode, Model, Start, StepInput, mesh::TriMesh, skinning::SkinningWeights,
    topology::weld,
};
use unic_io::{Capture, Split};
use unic_train::*;

/// Rounding of positions near 1 m, carried through skinning.
const CLOSED_M: f32 = 1e-6;

/// Panels of the tube, and for each of their vertices the tube's vertex at the same place.
fn panels() -> (TriMesh, Vec<u32>) {
    let tube = garment().rest;
    let mut origin: Vec<u32> = Vec::new();
    let mut faces = Vec::new();
    // Three panels: front, back, and the lower half of neither.
    let panel = |face: &[u32; 3]| {
        let middle = face.iter().map(|&v| tube.vertices[v as usize]).sum::<Vec3>() / 3.0;
        if middle.y < 0.9 {
            2
        } else {
            usize::from(middle.z > 0.0)
        }
    };
    for part in 0..3 {
        let mut here = std::collections::BTreeMap::new();
        for face in tube.faces.iter().filter(|face| panel(face) == part) {
            faces.push(face.map(|v| {
                *here.entry(v).or_insert_with(|| {
                    origin.push(v);
                    origin.len() as u32 - 1
                })
            }));
        }
    }
    let vertices = origin.iter().map(|&v| tube.vertices[v as usize]).collect();
    (TriMesh::new(vertices, faces).unwrap(), origin)
}

/// The tube cut into panels, with weights that differ between them.
fn cut(origin: &[u32], rest: TriMesh) -> Figure {
    let mut figure = Figure::tube();
    let dense = figure.garment.weights.to_dense();
    let joints = figure.character.skeleton.len();
    let row = |(i, &v): (usize, &u32)| {
        let mut row = dense[v as usize * joints..][..joints].to_vec();
        row[i % 2] += 0.2;
        row
    };
    let rows: Vec<f32> = origin.iter().enumerate().flat_map(row).collect();
    figure.garment.weights = SkinningWeights::from_dense(&rows, origin.len(), joints).unwrap();
    figure.garment.rest = rest;
    figure
}

fn panelled_capture(origin: &[u32], rest: TriMesh) -> (tempfile::TempDir, Capture) {
    let splits = [Split::Train, Split::Train, Split::Train, Split::Validation];
    let takes: Vec<(Take, Split)> = (splits.into_iter().enumerate())
        .map(|(i, split)| {
            let mut take = take(&format!("take{i}"), i, FRAMES);
            for frame in &mut take.garment {
                *frame = origin.iter().map(|&v| frame[v as usize]).collect();
            }
            (take, split)
        })
        .collect();
    unic_testdata::capture(&cut(origin, rest), &takes)
}

fn largest_gap(positions: &[Vec3], first_at: &[u32]) -> f32 {
    let gaps = positions.iter().zip(first_at);
    gaps.map(|(x, &first)| x.distance(positions[first as usize]))
        .fold(0.0, f32::max)
}

#[test]
fn seams_stay_closed_in_free_running() {
    let (rest, origin) = panels();
    let first_at = weld(&rest.vertices);
    assert!(
        first_at
            .iter()
            .enumerate()
            .filter(|(v, first)| *v as u32 != **first)
            .count()
            > 12
    );
    let (_folder, capture) = panelled_capture(&origin, rest);
    let mut config = small(Preset::Tiny);
    config.optimiser.steps = 30;
    config.optimiser.learning_rate = 0.01;
    let mut trainer = Trainer::new(
        FieldData::prepare(capture, &config, Fit::HeldOut).unwrap(),
        config,
    )
    .unwrap();
    run(&mut trainer);
    let model = trainer.model().unwrap();
    let motion = clip("new", 9, 300);
    let robust = |corrects| IntersectionMode::Robust {
        margin_m: 0.003,
        corrects,
    };
    let modes = [
        IntersectionMode::Off,
        IntersectionMode::Paper { relaxation_m: 0.005 },
        robust(Corrects::Display),
        robust(Corrects::State),
    ];
    for share in [1.0, 0.4] {
        let model: Arc<Model> = Arc::new(model.clone().with_sampling(share).unwrap());
        for mode in modes {
            let mut animator = Animator::new(Arc::clone(&model));
            animator.set_intersection(mode);
            let mut largest = 0.0f32;
            for (t, pose) in motion.poses.iter().enumerate() {
                let input = StepInput {
                    pose,
                    next_pose: None,
                    ground_height: 0.0,
                    wind: Vec3::ZERO,
                };
                let garment = match t {
                    0 => animator.reset(&input, Start::MeanShape),
                    _ => animator.step(&input),
                };
                largest = largest.max(largest_gap(garment.unwrap().positions, &first_at));
            }
            assert!(largest < CLOSED_M, "{share}, {mode:?}: a seam of {largest} m");
        }
    }
}
