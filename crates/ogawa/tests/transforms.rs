//! Contract: positions in world space follow the transforms of all ancestors at the frame's time,
//! up to the first transform that does not inherit.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::*;
use ogawa::{
    Archive,
    archive::{DataType, ObjectTree, Pod, SampleLayout, TimeSampling},
};

/// World positions of the only mesh in all frames, below the transforms from the top on.
fn world(mut file: File, transforms: Vec<ObjectTree>, halves: TimeSampling) -> Vec<[f32; 3]> {
    let point = point(&mut file);
    world_of(file, point, transforms, halves)
}

fn world_of(
    file: File,
    cage: ObjectTree,
    transforms: Vec<ObjectTree>,
    halves: TimeSampling,
) -> Vec<[f32; 3]> {
    let bytes = nested(file, cage, transforms, halves);
    let mut archive = Archive::from_bytes(&bytes).unwrap();
    let mesh = archive.meshes().unwrap()[0].clone();
    let mut points = Vec::new();
    (0..mesh.frames())
        .map(|frame| {
            mesh.world_positions(&mut archive, frame, &mut points).unwrap();
            assert_eq!(mesh.faces(&mut archive, frame).unwrap().corners(), [0, 0, 0]);
            points[0]
        })
        .collect()
}

fn every_half_second() -> TimeSampling {
    TimeSampling::Uniform {
        start: 0.0,
        step: 0.5,
    }
}

const TRANSLATE: u8 = 0x10;
const SCALE: u8 = 0x00;

#[test]
fn transforms_of_ancestors_are_applied_from_the_inside_out() {
    let mut file = file();
    let outer = transform(&mut file, "outer", true, TRANSLATE, &[&[10.0, 0.0, 0.0]]);
    let inner = transform(&mut file, "inner", true, SCALE, &[&[2.0, 2.0, 2.0]]);
    let moved = world(file, vec![outer, inner], every_half_second());
    assert_eq!(moved, [[12.0, 4.0, 6.0], [12.0, 4.0, 6.0], [12.0, 4.0, 8.0]]);
}

#[test]
fn a_transform_that_does_not_inherit_hides_those_above() {
    let mut file = file();
    let outer = transform(&mut file, "outer", true, TRANSLATE, &[&[10.0, 0.0, 0.0]]);
    let inner = transform(&mut file, "inner", false, SCALE, &[&[2.0, 2.0, 2.0]]);
    let moved = world(file, vec![outer, inner], every_half_second());
    assert_eq!(moved[0], [2.0, 4.0, 6.0]);
}

#[test]
fn animated_transforms_are_taken_at_the_time_of_the_frame() {
    let steps: [[f64; 3]; 5] = std::array::from_fn(|i| [i as f64, 0.0, 0.0]);
    let samples: Vec<&[f64]> = steps.iter().map(<[f64; 3]>::as_slice).collect();
    for (sampling, expected) in [
        (every_half_second(), [1.0, 3.0, 5.0]),
        // Frames at 0, 1 and 2 s; the samples of the transform at 0, 0.1, 1, 1.1, 2 s.
        (
            TimeSampling::Cyclic {
                times: vec![0.0, 0.1],
                period: 1.0,
            },
            [1.0, 3.0, 5.0],
        ),
        (
            TimeSampling::Acyclic(vec![0.0, 0.2, 0.4, 1.1, 9.0]),
            [1.0, 4.0, 4.0],
        ),
    ] {
        let mut file = file();
        let moving = transform(&mut file, "moving", true, TRANSLATE, &samples);
        let x: Vec<f32> = world(file, vec![moving], sampling).iter().map(|p| p[0]).collect();
        assert_eq!(x, expected);
    }
}

#[test]
fn a_still_mesh_has_the_frames_of_the_transform_that_moves_it() {
    let mut file = file();
    let moving = transform(
        &mut file,
        "moving",
        true,
        TRANSLATE,
        &[&[0.0; 3], &[0.0; 3], &[0.0, 5.0, 0.0]],
    );
    let still = transform(&mut file, "still", true, TRANSLATE, &[&[1.0, 0.0, 0.0]]);
    let point: &[[f32; 3]] = &[[0.0; 3]];
    let three = (DataType::new(Pod::F32, 3), FRAMES);
    let positions = property(&mut file, "P", SampleLayout::Array, three, &[point]);
    let cage = cage(&mut file, positions);
    let moved = world_of(file, cage, vec![moving, still], every_half_second());
    assert_eq!(moved, [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 5.0, 0.0]]);
}

#[test]
fn operations_without_their_values_are_refused() {
    let mut file = file();
    let broken = transform(&mut file, "broken", true, 0x30, &[&[1.0, 2.0, 3.0]]);
    let point = point(&mut file);
    let bytes = nested(file, point, vec![broken], every_half_second());
    let mut archive = Archive::from_bytes(&bytes).unwrap();
    let mesh = archive.meshes().unwrap()[0].clone();
    let error = mesh
        .world_positions(&mut archive, 0, &mut Vec::new())
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "/broken: expected values for each operation from 0 to 6, found 3 for the operations [48]"
    );
}
