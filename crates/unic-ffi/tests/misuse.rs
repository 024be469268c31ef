//! Contract: what a library can see of a wrong call is a code and a text, and changes nothing. Null,
//! misaligned and released handles, wrong counts, strides and sizes, NaN, unknown values, damaged
//! files and states, calls on an instance that is in use.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::*;
use std::{
    ffi::{CString, c_void},
    mem::size_of,
    ptr::{null, null_mut},
};
use unic::*;
use unic_core::Pose;

/// Model, instance and a pose that works.
struct Scene {
    model: ModelHandle,
    instance: InstanceHandle,
    poses: Vec<Pose>,
    vertices: usize,
}

fn scene() -> Scene {
    let (core, model) = (core_model(), ModelHandle::open());
    Scene {
        instance: InstanceHandle::new(&model, |_| ()),
        poses: motion(&core, 4),
        vertices: core.vertex_count(),
        model,
    }
}

fn create(model: *const UnicModel, options: &UnicOptions) -> UnicStatus {
    let mut instance = null_mut();
    // SAFETY: a struct of its size and a place for a handle.
    let status = unsafe { unic_instance_create(model, options, &mut instance) };
    assert!(instance.is_null() || status == UnicStatus::Ok);
    status
}

#[test]
fn null_pointers_are_refused() {
    use UnicStatus::NullPointer;
    let Scene {
        model,
        instance,
        poses,
        ..
    } = scene();
    let pose = c_pose(&poses[0]);
    let input = c_input(&pose);
    let without_pose = UnicStepInput {
        pose: null(),
        ..input
    };
    let without_rotations = UnicPose {
        rotations: null(),
        ..pose
    };
    let mut size = 0;
    // SAFETY: null pointers and structs of their sizes.
    unsafe {
        let bytes = [0u8; 4];
        refused(
            unic_model_from_bytes(null(), 4, &mut null_mut()),
            NullPointer,
            "bytes",
        );
        refused(
            unic_model_from_bytes(bytes.as_ptr().cast(), 4, null_mut()),
            NullPointer,
            "model",
        );
        refused(unic_model_from_path(null(), &mut null_mut()), NullPointer, "path");
        refused(unic_model_info(null(), null_mut()), NullPointer, "model");
        refused(unic_model_info(model.0, null_mut()), NullPointer, "info");
        refused(unic_model_joint_name(model.0, 0, null_mut()), NullPointer, "name");
        refused(
            unic_model_joint_parents(model.0, null_mut(), 24),
            NullPointer,
            "parents",
        );
        refused(unic_options_init(null_mut(), 80), NullPointer, "options");
        refused(
            unic_instance_create(null(), null(), &mut null_mut()),
            NullPointer,
            "model",
        );
        refused(
            unic_instance_create(model.0, null(), null_mut()),
            NullPointer,
            "instance",
        );
        refused(
            unic_instance_set_colliders(instance.0, null(), 1),
            NullPointer,
            "colliders",
        );
        refused(
            unic_instance_step(null(), &input, null()),
            NullPointer,
            "instance",
        );
        refused(
            unic_instance_step(instance.0, null(), null()),
            NullPointer,
            "input",
        );
        refused(
            unic_instance_step(instance.0, &without_pose, null()),
            NullPointer,
            "pose",
        );
        refused(
            unic_instance_display(instance.0, null(), 0.5, null()),
            NullPointer,
            "pose",
        );
        let status = unic_instance_display(instance.0, &without_rotations, 0.5, null());
        refused(status, NullPointer, "rotations");
        refused(
            unic_instance_mesh_info(instance.0, 0, null_mut()),
            NullPointer,
            "info",
        );
        refused(
            unic_instance_save(instance.0, null_mut(), 0, null_mut()),
            NullPointer,
            "size",
        );
        refused(
            unic_instance_restore(instance.0, null(), 9, null()),
            NullPointer,
            "state",
        );
        // Outputs that are not wanted.
        ok(unic_instance_step(instance.0, &input, null()));
        ok(unic_instance_rest_joints(instance.0, null_mut(), null_mut(), 24));
        ok(unic_instance_save(instance.0, null_mut(), 0, &mut size));
    }
    refused(unic_model_retain(null()), NullPointer, "model");
    refused(unic_instance_release(null()), NullPointer, "instance");
}

#[test]
fn released_and_invented_handles_are_refused() {
    use UnicStatus::InvalidHandle;
    let Scene {
        model,
        instance,
        poses,
        ..
    } = scene();
    let input_pose = c_pose(&poses[0]);
    let input = c_input(&input_pose);
    let mut other = null_mut();
    // SAFETY: structs of their sizes; handles are not dereferenced.
    unsafe {
        ok(unic_instance_create(model.0, null(), &mut other));
        ok(unic_instance_release(other));
        refused(
            unic_instance_step(other, &input, null()),
            InvalidHandle,
            "instance",
        );
        refused(unic_instance_release(other), InvalidHandle, "instance");
        // A handle of the other kind, as a cast in C# gives it.
        refused(
            unic_instance_step(model.0.cast(), &input, null()),
            InvalidHandle,
            "instance",
        );
        refused(unic_model_retain(instance.0.cast()), InvalidHandle, "model");
        let invented = std::ptr::without_provenance(0xdead_beef);
        refused(
            unic_instance_step(invented, &input, null()),
            InvalidHandle,
            "instance",
        );
    }
    // An instance outlives its model's handle.
    ok(unic_model_retain(model.0));
    ok(unic_model_release(model.0));
    let released = ModelHandle::open();
    let instance = InstanceHandle::new(&released, |_| ());
    drop(released);
    // SAFETY: as above.
    ok(unsafe { unic_instance_step(instance.0, &input, null()) });
}

#[test]
fn wrong_counts_strides_and_sizes_are_refused() {
    use UnicStatus::{Misaligned, WrongSize};
    let Scene {
        model,
        instance,
        poses,
        vertices,
    } = scene();
    let pose = c_pose(&poses[0]);
    let input = c_input(&pose);
    let mut out = [(); 2].map(|()| vec![[0.0; 3]; vertices]);
    let to = buffers(&mut out);
    let mut faces = vec![0u32; 9];
    // SAFETY: structs of their sizes; refused buffers are not written to.
    unsafe {
        for (wrong, text) in [
            (
                UnicVertices {
                    count: vertices - 1,
                    ..to
                },
                "number of vertices",
            ),
            (
                UnicVertices {
                    count: vertices + 1,
                    ..to
                },
                "number of vertices",
            ),
            (
                UnicVertices {
                    position_stride: 8,
                    ..to
                },
                "positions",
            ),
            (
                UnicVertices {
                    normal_stride: 11,
                    ..to
                },
                "normals",
            ),
        ] {
            refused(unic_instance_step(instance.0, &input, &wrong), WrongSize, text);
        }
        let wrong = UnicVertices {
            position_stride: usize::MAX / 2,
            ..to
        };
        let status = unic_instance_step(instance.0, &input, &wrong);
        refused(status, UnicStatus::InvalidValue, "fit in memory");
        for size in [0, 4, size_of::<UnicStepInput>() as u32 - 4, u32::MAX] {
            let wrong = UnicStepInput { size, ..input };
            refused(unic_instance_step(instance.0, &wrong, null()), WrongSize, "input");
        }
        let fewer = UnicPose {
            joint_count: 23,
            ..pose
        };
        refused(
            unic_instance_display(instance.0, &fewer, 0.0, null()),
            WrongSize,
            "expected 24, found 23",
        );
        let narrow = UnicPose {
            rotation_stride: 15,
            ..pose
        };
        refused(
            unic_instance_display(instance.0, &narrow, 0.0, null()),
            WrongSize,
            "rotations",
        );
        let first = out[0].as_ptr().cast();
        let status = unic_instance_reset_to(instance.0, &input, first, 0, 7, null());
        refused(status, WrongSize, "start positions");
        let first = faces.as_mut_ptr();
        refused(
            unic_instance_mesh_faces(instance.0, 0, first, 3),
            WrongSize,
            "number of faces",
        );
        refused(
            unic_instance_mesh_sources(instance.0, 1, first, 9),
            WrongSize,
            "number of vertices",
        );
        refused(
            unic_model_joint_parents(model.0, first.cast(), 9),
            WrongSize,
            "parents",
        );
        refused(
            unic_instance_rest_joints(instance.0, null_mut(), null_mut(), 3),
            WrongSize,
            "joints",
        );
        let odd = (&raw const input).cast::<u8>().add(2).cast();
        refused(
            unic_instance_step(instance.0, odd, null()),
            Misaligned,
            "aligned to 8",
        );
        let mut info = UnicMeshInfo {
            size: 3,
            vertex_count: 0,
            face_count: 0,
            has_uvs: 0,
        };
        refused(
            unic_instance_mesh_info(instance.0, 0, &mut info),
            WrongSize,
            "info",
        );
        let mut size = 0;
        let few = faces.as_mut_ptr().cast();
        let status = unic_instance_save(instance.0, few, 8, &mut size);
        refused(status, UnicStatus::BufferTooSmall, "found 8");
        assert!(size > 1000);
    }
    assert!(out.iter().flatten().all(|row| *row == [0.0; 3]));
}

/// A struct of a later version is accepted as long as its new fields are zero.
#[test]
fn later_structs_are_accepted_if_their_new_fields_are_off() {
    #[repr(C)]
    struct Later {
        known: UnicOptions,
        unknown: u64,
    }
    let Scene { model, .. } = scene();
    let mut later = Later {
        known: options(),
        unknown: 7,
    };
    let size = size_of::<Later>() as u32;
    let pointer = (&raw mut later).cast::<UnicOptions>();
    // SAFETY: a struct of the stated size.
    unsafe {
        ok(unic_options_init(pointer, size));
        assert_eq!((later.known.size, later.unknown), (size, 0));
        let mut instance = null_mut();
        ok(unic_instance_create(model.0, pointer, &mut instance));
        ok(unic_instance_release(instance));
        later.unknown = 1;
        let status = unic_instance_create(model.0, (&raw const later).cast(), &mut instance);
        refused(status, UnicStatus::InvalidValue, "later versions");
    }
}

#[test]
fn unusable_options_are_refused() {
    let Scene { model, .. } = scene();
    let changes: [(&str, fn(&mut UnicOptions)); 13] = [
        ("precision", |o| o.precision = 5),
        ("sampling", |o| o.sampling = 0.0),
        ("sampling", |o| o.sampling = 1.5),
        ("sampling", |o| o.sampling = f32::NAN),
        ("intersection", |o| o.intersection = 77),
        ("intersection_distance_m", |o| {
            o.intersection_distance_m = f32::NAN
        }),
        ("axes", |o| o.axes = u32::MAX),
        ("custom_axes", |o| {
            (o.axes, o.custom_axes) = (UnicAxes::Custom as u32, [1, 1, 2])
        }),
        ("metres_per_unit", |o| o.metres_per_unit = -1.0),
        ("vertex_layout", |o| o.vertex_layout = 2),
        ("threads", |o| o.threads = 3),
        ("thread_count", |o| o.thread_count = 257),
        ("reserved", |o| o.reserved = 1),
    ];
    for (name, change) in changes {
        let mut options = options();
        change(&mut options);
        refused(create(model.0, &options), UnicStatus::InvalidValue, name);
    }
    let mut options = options();
    options.threads = UnicThreads::Caller as u32;
    refused(create(model.0, &options), UnicStatus::NullPointer, "parallel_for");
}

#[test]
fn unusable_numbers_are_refused_and_change_nothing() {
    use UnicStatus::InvalidValue;
    let Scene {
        instance,
        poses,
        vertices,
        ..
    } = scene();
    let expected = c_frames(&instance, &poses, vertices);
    c_frames(&instance, &poses[..3], vertices);
    let good = c_pose(&poses[3]);
    let changed = |joint: usize, w: f32| {
        let mut pose = poses[3].clone();
        pose.local[joint].w = w;
        pose
    };
    for kind in [
        UnicRotations::Local,
        UnicRotations::World,
        UnicRotations::FromRest,
    ] {
        for w in [f32::NAN, f32::INFINITY, 3.0] {
            let bad = changed(5, w);
            let pose = UnicPose {
                rotation_kind: kind as u32,
                ..c_pose(&bad)
            };
            // SAFETY: structs of their sizes.
            let status = unsafe { unic_instance_step(instance.0, &c_input(&pose), null()) };
            refused(status, InvalidValue, "rotation of joint 5");
        }
    }
    let start = vec![[f32::NAN; 3]; vertices];
    // SAFETY: structs and buffers of their sizes.
    unsafe {
        for pose in [
            UnicPose {
                root: [0.0, f32::NAN, 0.0],
                ..good
            },
            UnicPose {
                root: [1e30, 0.0, 0.0],
                ..good
            },
            UnicPose { root_kind: 2, ..good },
            UnicPose {
                rotation_kind: 3,
                ..good
            },
        ] {
            assert_eq!(
                unic_instance_step(instance.0, &c_input(&pose), null()),
                InvalidValue
            );
            assert_eq!(
                unic_instance_reset(instance.0, &c_input(&pose), null()),
                InvalidValue
            );
            assert_eq!(
                unic_instance_display(instance.0, &pose, 0.5, null()),
                InvalidValue
            );
        }
        for input in [
            UnicStepInput {
                ground_height: f32::NAN,
                ..c_input(&good)
            },
            UnicStepInput {
                wind: [0.0, f32::INFINITY, 0.0],
                ..c_input(&good)
            },
            UnicStepInput {
                reserved: 1,
                ..c_input(&good)
            },
        ] {
            assert_eq!(unic_instance_step(instance.0, &input, null()), InvalidValue);
        }
        refused(
            unic_instance_display(instance.0, &good, f32::NAN, null()),
            InvalidValue,
            "share",
        );
        let (input, first) = (c_input(&good), start.as_ptr().cast());
        let status = unic_instance_reset_to(instance.0, &input, first, 0, vertices, null());
        refused(status, InvalidValue, "position of vertex 0");
        refused(
            unic_instance_mesh_faces(instance.0, 2, null_mut(), 0),
            InvalidValue,
            "UnicMesh",
        );
        for collider in [
            UnicCollider {
                shape: 3,
                radius: 1.0,
                a: [0.0; 3],
                b: [1.0; 3],
            },
            UnicCollider {
                shape: 0,
                radius: 0.0,
                a: [1.0; 3],
                b: [1.0; 3],
            },
            UnicCollider {
                shape: 1,
                radius: f32::NAN,
                a: [0.0; 3],
                b: [1.0; 3],
            },
            UnicCollider {
                shape: 2,
                radius: 1.0,
                a: [0.0; 3],
                b: [f32::NAN; 3],
            },
        ] {
            assert_eq!(
                unic_instance_set_colliders(instance.0, &collider, 1),
                InvalidValue
            );
        }
        let status = unic_instance_set_colliders(instance.0, std::ptr::dangling(), usize::MAX);
        refused(status, InvalidValue, "number of colliders");
    }
    assert!(instance.play(Call::Step, &c_input(&good), vertices) == expected[3]);
}

#[test]
fn damaged_models_are_refused() {
    let bytes = std::fs::read(garment_path()).unwrap();
    let open = |bytes: &[u8]| {
        let mut model = null_mut();
        // SAFETY: bytes of their length.
        let status = unsafe { unic_model_from_bytes(bytes.as_ptr().cast(), bytes.len(), &mut model) };
        assert!(model.is_null());
        assert_eq!(status, UnicStatus::BadModel, "{}", last_error());
    };
    for length in [0, 1, 7, 8, 9, 1000, bytes.len() / 2, bytes.len() - 1] {
        open(&bytes[..length]);
    }
    let mut flipped = bytes.clone();
    for at in [0, 9, 5000, bytes.len() / 2, bytes.len() - 1] {
        flipped[at] ^= 0x10;
        open(&flipped);
        flipped[at] ^= 0x10;
    }
    let folder = tempfile::tempdir().unwrap();
    for (path, text) in [
        (folder.path().join("none.unic"), "none.unic"),
        (folder.path().to_owned(), ""),
    ] {
        let path = CString::new(path.to_str().unwrap()).unwrap();
        // SAFETY: a text and a place for a handle.
        let status = unsafe { unic_model_from_path(path.as_ptr(), &mut null_mut()) };
        refused(status, UnicStatus::CannotRead, text);
    }
    // SAFETY: as above.
    let status = unsafe { unic_model_from_path(c"\xff\xfe".as_ptr(), &mut null_mut()) };
    refused(status, UnicStatus::InvalidValue, "UTF-8");
}

#[test]
fn damaged_states_are_refused_and_change_nothing() {
    let Scene {
        instance,
        poses,
        vertices,
        ..
    } = scene();
    let expected = c_frames(&instance, &poses, vertices);
    c_frames(&instance, &poses[..3], vertices);
    let mut size = 0;
    // SAFETY: buffers of their sizes.
    let mut bytes = unsafe {
        ok(unic_instance_save(instance.0, null_mut(), 0, &mut size));
        let mut bytes = vec![0u8; size];
        ok(unic_instance_save(
            instance.0,
            bytes.as_mut_ptr().cast(),
            size,
            &mut size,
        ));
        bytes
    };
    let restore = |bytes: &[u8]| {
        // SAFETY: bytes of their length.
        let status = unsafe { unic_instance_restore(instance.0, bytes.as_ptr().cast(), bytes.len(), null()) };
        assert_eq!(status, UnicStatus::BadState, "{}", last_error());
    };
    let boundaries = (0..60)
        .chain((60..size).step_by(size / 50))
        .chain(size - 40..size);
    for length in boundaries.clone() {
        restore(&bytes[..length]);
    }
    for at in boundaries {
        bytes[at] ^= 0x40;
        restore(&bytes);
        bytes[at] ^= 0x40;
    }
    bytes.push(0);
    restore(&bytes);
    let good = c_pose(&poses[3]);
    assert!(instance.play(Call::Step, &c_input(&good), vertices) == expected[3]);
}

/// Calls the instance that is being stepped, whose handle is the context.
unsafe extern "C" fn call_again(context: *mut c_void, _: u32, job: UnicJob, data: *mut c_void) {
    // SAFETY: the cell of the test below.
    let instance: *const UnicInstance = unsafe { *context.cast::<*const UnicInstance>() };
    if !instance.is_null() {
        let stride = 0;
        // SAFETY: structs of their sizes; the job with its data.
        unsafe {
            let status = unic_instance_mesh_faces(instance, 0, null_mut(), stride);
            refused(status, UnicStatus::InUse, "one thread at a time");
            job.unwrap()(data);
        }
    }
}

#[test]
fn an_instance_in_use_refuses_other_calls() {
    let Scene { model, poses, .. } = scene();
    let mut cell: *const UnicInstance = null();
    let context = &raw mut cell;
    let instance = InstanceHandle::new(&model, |o| {
        o.threads = UnicThreads::Caller as u32;
        o.thread_count = 2;
        o.parallel_for = Some(call_again);
        o.parallel_context = context.cast();
    });
    // SAFETY: the cell above, which only the callback on this thread reads.
    unsafe { context.write(instance.0) };
    let pose = c_pose(&poses[0]);
    // SAFETY: structs of their sizes.
    ok(unsafe { unic_instance_step(instance.0, &c_input(&pose), null()) });
}
