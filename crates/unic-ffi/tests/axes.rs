//! Contract: in other axes and units, and with other kinds of rotations, an instance gives the same
//! garment, converted. Faces wind as the axes ask, and copies of vertices lie on their sources.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

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
        // Rounded centimetres may push a vertex that is between two colliders the other way.
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
            count * 1000 > vertices * 995,
            "{:?}: {count} of {vertices}",
            engine.axes
        );
    }
}

/// Faces of a mesh, as an instance gives them.
fn faces(instance: &InstanceHandle, mesh: UnicMesh) -> (UnicMeshInfo, Vec<[u32; 3]>) {
    let mut info = UnicMeshInfo {
        size: size_of::<UnicMeshInfo>() as u32,
        vertex_count: 0,
        face_count: 0,
        has_uvs: 0,
    };
    // SAFETY: structs and buffers of their sizes.
    unsafe {
        ok(unic_instance_mesh_info(instance.0, mesh as u32, &mut info));
        let mut faces = vec![[0; 3]; info.face_count as usize];
        let first = faces.as_mut_ptr().cast();
        ok(unic_instance_mesh_faces(
            instance.0,
            mesh as u32,
            first,
            faces.len(),
        ));
        (info, faces)
    }
}

/// The normals of faces, in the formula of each base, point as the normals of vertices do.
#[test]
fn faces_wind_as_the_axes_ask() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let pose = &motion(&model, 1)[0];
    for engine in &ENGINES {
        let instance = instance(engine, &handle);
        let theirs = converted(engine, pose);
        instance.play(Call::Reset, &c_input(&c_pose(&theirs)), model.vertex_count());
        let (info, faces) = faces(&instance, UnicMesh::Body);
        let mut out = [(); 2].map(|()| vec![[0.0; 3]; info.vertex_count as usize]);
        // SAFETY: buffers of their sizes.
        ok(unsafe { unic_instance_body(instance.0, &buffers(&mut out)) });
        let [positions, normals] = out.map(|rows| rows.into_iter().map(Vec3::from_array).collect::<Vec<_>>());
        let agrees = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| positions[v as usize]);
            (b - a).cross(c - a).dot(normals[face[0] as usize]) > 0.0
        };
        let share = faces.iter().filter(|face| agrees(face)).count() as f32 / faces.len() as f32;
        assert!(share > 0.95, "{:?}: {share}", engine.axes);
    }
}

#[test]
fn split_vertices_lie_on_their_sources_and_have_one_texture_coordinate() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let pose = &motion(&model, 1)[0];
    let plain = InstanceHandle::new(&handle, |_| ());
    let split = InstanceHandle::new(&handle, |o| o.vertex_layout = UnicVertexLayout::Split as u32);
    let (info, split_faces) = faces(&split, UnicMesh::Garment);
    let count = info.vertex_count as usize;
    let (mut sources, mut uvs) = (vec![0u32; count], vec![[0f32; 2]; count]);
    // SAFETY: buffers of their sizes.
    unsafe {
        ok(unic_instance_mesh_sources(
            split.0,
            0,
            sources.as_mut_ptr(),
            count,
        ));
        let status = unic_instance_mesh_uvs(split.0, 0, uvs.as_mut_ptr().cast(), 0, count);
        match (info.has_uvs, &model.garment().rest.uvs) {
            (1, Some(of_corners)) => {
                ok(status);
                for (face, corners) in split_faces.iter().zip(&of_corners.faces) {
                    for (&vertex, &corner) in face.iter().zip(corners) {
                        assert_eq!(
                            uvs[vertex as usize],
                            of_corners.coordinates[corner as usize].to_array()
                        );
                    }
                }
            }
            (0, None) => refused(status, UnicStatus::InvalidValue, "texture coordinates"),
            other => panic!("{other:?}"),
        }
    }
    let pose = c_pose(pose);
    let expected = plain.play(Call::Reset, &c_input(&pose), model.vertex_count());
    let found = split.play(Call::Reset, &c_input(&pose), count);
    for (found, expected) in found.iter().zip(&expected) {
        assert!(
            found
                .iter()
                .zip(&sources)
                .all(|(row, &source)| *row == expected[source as usize])
        );
    }
    let of_sources = split_faces.iter().map(|face| face.map(|v| sources[v as usize]));
    assert!(of_sources.eq(model.garment().rest.faces.iter().copied()));
}

#[test]
fn joints_are_those_of_the_model() {
    let (model, handle) = (core_model(), ModelHandle::open());
    let skeleton = &model.character().skeleton;
    let mut info = UnicModelInfo {
        size: size_of::<UnicModelInfo>() as u32,
        joint_count: 0,
        root_joint: 9,
        vertex_count: 0,
        face_count: 0,
        body_vertex_count: 0,
        body_face_count: 0,
        fps: 0.0,
    };
    // SAFETY: structs and buffers of their sizes.
    unsafe {
        ok(unic_model_info(handle.0, &mut info));
        assert_eq!(info.joint_count as usize, skeleton.len());
        assert_eq!(info.root_joint as usize, skeleton.root());
        assert_eq!(info.vertex_count as usize, model.vertex_count());
        assert_eq!(info.body_face_count as usize, model.character().body.faces.len());
        assert_eq!(info.fps, model.config().fps);
        let mut parents = vec![0; skeleton.len()];
        ok(unic_model_joint_parents(
            handle.0,
            parents.as_mut_ptr(),
            parents.len(),
        ));
        for (joint, name) in skeleton.names().iter().enumerate() {
            let mut found = std::ptr::null();
            ok(unic_model_joint_name(handle.0, joint as u32, &mut found));
            assert_eq!(std::ffi::CStr::from_ptr(found).to_str().unwrap(), name);
            assert_eq!(parents[joint], skeleton.parents()[joint].map_or(-1, |p| p as i32));
        }
        let status = unic_model_joint_name(handle.0, 24, &mut std::ptr::null());
        refused(status, UnicStatus::InvalidValue, "joint");
        for engine in &ENGINES {
            let instance = instance(engine, &handle);
            let (mut positions, mut rotations) = (vec![[0f32; 3]; 24], vec![[0f32; 4]; 24]);
            let first = positions.as_mut_ptr().cast();
            ok(unic_instance_rest_joints(
                instance.0,
                first,
                rotations.as_mut_ptr().cast(),
                24,
            ));
            let points = skeleton.joints().iter().map(|p| (engine.point)(*p));
            assert!(largest(&positions, points) < 1e-5 * engine.scale);
            // Rest rotations in the world are the rest pose.
            let pose = UnicPose {
                root: positions[skeleton.root()],
                root_kind: UnicRoot::Position as u32,
                rotation_kind: UnicRotations::World as u32,
                joint_count: 24,
                rotations: rotations.as_ptr().cast(),
                rotation_stride: 0,
            };
            ok(unic_instance_step(instance.0, &c_input(&pose), std::ptr::null()));
            let mut body = [vec![[0.0; 3]; model.character().body.vertices.len()], vec![]];
            let mut to = buffers(&mut body);
            to.normals = null_mut();
            ok(unic_instance_body(instance.0, &to));
            let rest = model.character().body.vertices.iter().map(|p| (engine.point)(*p));
            assert!(largest(&body[0], rest) < 1e-4 * engine.scale, "{:?}", engine.axes);
        }
    }
}
