//! Counts, strides and sizes of structs.

use super::*;

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

/// A program of an earlier version has zeros where later ones have more options.
#[test]
fn zero_is_the_default_of_every_option() {
    let Scene {
        model,
        poses,
        vertices,
        ..
    } = scene();
    let options = options();
    // SAFETY: numbers and pointers without padding.
    let bytes: [u8; size_of::<UnicOptions>()] = unsafe { std::mem::transmute(options) };
    let (size, rest) = bytes.split_at(size_of::<u32>());
    assert_eq!(size, (bytes.len() as u32).to_ne_bytes());
    assert!(rest.iter().all(|byte| *byte == 0), "{options:?}");
    // Custom axes that are not set are the model's.
    let frames = |axes: UnicAxes| {
        let instance = InstanceHandle::new(&model, |o| o.axes = axes as u32);
        c_frames(&instance, &poses, vertices)
    };
    assert!(frames(UnicAxes::Custom) == frames(UnicAxes::Model));
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

/// A caller of a later version must not take its own bytes for an answer.
#[test]
fn later_structs_that_are_asked_for_have_zeros_in_their_new_fields() {
    #[repr(C)]
    struct Later<T> {
        known: T,
        unknown: [u8; 12],
    }
    let Scene { model, instance, .. } = scene();
    // SAFETY: structs of the stated sizes.
    unsafe {
        let mut of_model: Later<UnicModelInfo> = std::mem::zeroed();
        of_model.known.size = size_of::<Later<UnicModelInfo>>() as u32;
        of_model.unknown = [7; 12];
        ok(unic_model_info(model.0, (&raw mut of_model).cast()));
        assert_eq!((of_model.known.size, of_model.unknown), (44, [0; 12]));
        assert_eq!(of_model.known.joint_count, 24);
        let mut of_mesh: Later<UnicMeshInfo> = std::mem::zeroed();
        of_mesh.known.size = size_of::<Later<UnicMeshInfo>>() as u32;
        of_mesh.unknown = [7; 12];
        ok(unic_instance_mesh_info(instance.0, 0, (&raw mut of_mesh).cast()));
        assert_eq!((of_mesh.known.size, of_mesh.unknown), (28, [0; 12]));
        assert_eq!(of_mesh.known.vertex_count, 3788);
    }
}

/// A caller of the first version goes on working: its structs are the least that is accepted.
#[test]
fn structs_smaller_than_those_of_the_first_version_are_refused() {
    let Scene { model, instance, .. } = scene();
    let pointers = 2 * size_of::<usize>() as u32;
    let mut given = options();
    let mut made = null_mut();
    // SAFETY: structs of their sizes.
    unsafe {
        given.size = 14 * 4 + pointers;
        ok(unic_instance_create(model.0, &given, &mut made));
        ok(unic_instance_release(made));
        given.size -= 1;
        let status = unic_instance_create(model.0, &given, &mut made);
        refused(
            status,
            UnicStatus::WrongSize,
            "at least 72 bytes, found one of 71",
        );
        let status = unic_options_init(&mut given, 4);
        refused(status, UnicStatus::WrongSize, "at least 72 bytes, found one of 4");
        let mut info: UnicModelInfo = std::mem::zeroed();
        info.size = 28;
        refused(
            unic_model_info(model.0, &mut info),
            UnicStatus::WrongSize,
            "at least 32 bytes",
        );
        let mut info: UnicMeshInfo = std::mem::zeroed();
        info.size = 12;
        let status = unic_instance_mesh_info(instance.0, 0, &mut info);
        refused(status, UnicStatus::WrongSize, "at least 16 bytes");
    }
}
