//! Contract: in other axes and units, and with other kinds of rotations, an instance gives the same
//! garment, converted. Faces wind as the axes ask, and copies of vertices lie on their sources.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

#[path = "../common/mod.rs"]
mod common;
mod meshes;

use common::*;
use glam::{Quat, Vec3};
use std::ptr::null_mut;
use unic::*;
use unic_core::{Model, Pose};

/// Axes of an engine, with the conversion written down by hand.
struct Engine {
    axes: UnicAxes,
    point: fn(Vec3) -> Vec3,
    rotation: fn(Quat) -> Quat,
    /// Units of a metre.
    scale: f32,
}

const ENGINES: [Engine; 4] = [
    Engine {
        axes: UnicAxes::Model,
        point: |p| p,
        rotation: |q| q,
        scale: 1.0,
    },
    Engine {
        axes: UnicAxes::Unity,
        point: |p| Vec3::new(-p.x, p.y, p.z),
        rotation: |q| Quat::from_xyzw(q.x, -q.y, -q.z, q.w),
        scale: 1.0,
    },
    Engine {
        axes: UnicAxes::Unreal,
        point: |p| Vec3::new(p.z, -p.x, p.y) * 100.0,
        rotation: |q| Quat::from_xyzw(-q.z, q.x, -q.y, q.w),
        scale: 100.0,
    },
    Engine {
        axes: UnicAxes::Blender,
        point: |p| Vec3::new(p.x, -p.z, p.y),
        rotation: |q| Quat::from_xyzw(q.x, -q.z, q.y, q.w),
        scale: 1.0,
    },
];

/// A pose in an engine's axes.
fn converted(engine: &Engine, pose: &Pose) -> Pose {
    Pose {
        trans: (engine.point)(pose.trans),
        local: pose.local.iter().map(|q| (engine.rotation)(*q)).collect(),
    }
}

fn instance(engine: &Engine, model: &ModelHandle) -> InstanceHandle {
    InstanceHandle::new(model, |o| o.axes = engine.axes as u32)
}

/// Largest distance between rows.
fn largest(found: &[[f32; 3]], expected: impl Iterator<Item = Vec3>) -> f32 {
    let distance = |(a, b): (&[f32; 3], Vec3)| Vec3::from_array(*a).distance(b);
    found.iter().zip(expected).map(distance).fold(0.0, f32::max)
}

#[test]
fn engines_get_the_same_garment_in_their_own_axes() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 6), model.vertex_count());
    let expected = core_frames(&model, &poses);
    for engine in &ENGINES {
        let theirs: Vec<_> = poses.iter().map(|pose| converted(engine, pose)).collect();
        let found = c_frames(&instance(engine, &handle), &theirs, vertices);
        for (found, expected) in found.iter().zip(&expected) {
            let points = expected[0].iter().map(|p| (engine.point)(Vec3::from_array(*p)));
            let distance = largest(&found[0], points);
            // Centimetres are rounded on the way in, mirrored numbers are not.
            let tolerance = if engine.scale == 1.0 {
                0.0
            } else {
                1e-4 * engine.scale
            };
            assert!(distance <= tolerance, "{:?}: {distance}", engine.axes);
            let normals = expected[1]
                .iter()
                .map(|n| (engine.point)(Vec3::from_array(*n)) / engine.scale);
            assert!(largest(&found[1], normals) < 1e-2);
        }
    }
}

/// Rotations in the world and from the rest pose, computed from forward kinematics.
fn other_kinds(model: &Model, pose: &Pose) -> [(UnicRotations, Vec<Quat>, Vec3); 2] {
    let skeleton = &model.character().skeleton;
    let (mut world_from_joint, mut world_from_rest) = (Vec::new(), Vec::new());
    skeleton.forward_kinematics(pose, &mut world_from_joint);
    skeleton.world_from_rest(&world_from_joint, &mut world_from_rest);
    let root = world_from_joint[skeleton.root()].translation;
    let rotations = |t: &[unic_core::transform::Rigid]| t.iter().map(|t| t.rotation).collect();
    [
        (UnicRotations::World, rotations(&world_from_joint), root),
        (UnicRotations::FromRest, rotations(&world_from_rest), root),
    ]
}

#[test]
fn all_kinds_of_rotations_describe_the_same_pose() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 5), model.vertex_count());
    let expected = core_frames(&model, &poses);
    for engine in &ENGINES {
        for kind in 0..2 {
            let instance = instance(engine, &handle);
            let mut found = Vec::new();
            for (t, pose) in poses.iter().enumerate() {
                let (rotation_kind, rotations, root) =
                    other_kinds(&model, pose).into_iter().nth(kind).unwrap();
                let rotations: Vec<_> = rotations.into_iter().map(engine.rotation).collect();
                let pose = UnicPose {
                    root: (engine.point)(root).to_array(),
                    root_kind: UnicRoot::Position as u32,
                    rotation_kind: rotation_kind as u32,
                    joint_count: rotations.len() as u32,
                    rotations: rotations.as_ptr().cast(),
                    rotation_stride: 0,
                };
                let call = if t == 0 { Call::Reset } else { Call::Step };
                found = instance.play(call, &c_input(&pose), vertices)[0].clone();
            }
            let points = expected[4][0]
                .iter()
                .map(|p| (engine.point)(Vec3::from_array(*p)));
            let distance = largest(&found, points) / engine.scale;
            assert!(distance < 1e-4, "{:?}, {kind}: {distance} m", engine.axes);
        }
    }
}

#[test]
fn ground_wind_and_colliders_are_converted() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let (poses, vertices) = (motion(&model, 4), model.vertex_count());
    let play = |engine: &Engine| {
        let instance = InstanceHandle::new(&handle, |o| {
            o.axes = engine.axes as u32;
            o.intersection = UnicIntersection::Robust as u32;
        });
        let point = |x, y, z| (engine.point)(Vec3::new(x, y, z)).to_array();
        let shape = |shape, a, b| UnicCollider {
            shape: shape as u32,
            radius: 0.15 * engine.scale,
            a,
            b,
        };
        let colliders = [
            shape(UnicShape::HalfSpace, point(0.0, 0.9, 0.0), point(0.1, 2.0, 0.0)),
            shape(UnicShape::Sphere, point(0.1, 1.25, 0.27), [0.0; 3]),
            shape(UnicShape::Capsule, point(-0.3, 1.0, 0.27), point(0.3, 1.1, 0.27)),
        ];
        // SAFETY: an array of three.
        ok(unsafe { unic_instance_set_colliders(instance.0, colliders.as_ptr(), 3) });
        let mut found = Vec::new();
        for (t, pose) in poses.iter().enumerate() {
            let theirs = converted(engine, pose);
            let pose = c_pose(&theirs);
            let input = UnicStepInput {
                ground_height: 0.05 * engine.scale,
                wind: point(2.0, -0.5, 3.0),
                ..c_input(&pose)
            };
            let call = if t == 0 { Call::Reset } else { Call::Step };
            found = instance.play(call, &input, vertices)[0].clone();
        }
        found
    };
    let expected = play(&ENGINES[0]);
    for engine in &ENGINES[1..] {
        // Rounded centimetres may push a vertex that is between two colliders the other way, and the
        // cloth around it along: 47 vertices under an arm. A wrong conversion moves far more.
        let near = |(found, expected): (&[f32; 3], &[f32; 3])| {
            let expected = (engine.point)(Vec3::from_array(*expected));
            Vec3::from_array(*found).distance(expected) < 1e-3 * engine.scale
        };
        let count = play(engine)
            .iter()
            .zip(&expected)
            .filter(|pair| near(*pair))
            .count();
        assert!(
            count * 100 > vertices * 98,
            "{:?}: {count} of {vertices}",
            engine.axes
        );
    }
}
