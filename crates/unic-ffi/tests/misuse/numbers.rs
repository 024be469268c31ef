//! Options and numbers out of range.

use super::*;

/// Change of the default options.
type Change = fn(&mut UnicOptions);

fn create(model: *const UnicModel, options: &UnicOptions) -> UnicStatus {
    let mut instance = null_mut();
    // SAFETY: a struct of its size and a place for a handle.
    let status = unsafe { unic_instance_create(model, options, &mut instance) };
    assert!(instance.is_null() || status == UnicStatus::Ok);
    status
}

#[test]
fn unusable_options_are_refused() {
    let Scene { model, .. } = scene();
    let changes: [(&str, Change); 14] = [
        ("precision", |o| o.precision = 5),
        ("sampling", |o| o.sampling = -0.5),
        ("sampling", |o| o.sampling = 1.5),
        ("sampling", |o| o.sampling = f32::NAN),
        ("intersection", |o| o.intersection = 77),
        ("intersection_distance_m", |o| {
            o.intersection_distance_m = f32::NAN
        }),
        ("intersection_distance_m", |o| o.intersection_distance_m = -1.0),
        ("axes", |o| o.axes = u32::MAX),
        ("custom_axes", |o| {
            (o.axes, o.custom_axes) = (UnicAxes::Custom as u32, [1, 1, 2])
        }),
        ("metres_per_unit", |o| o.metres_per_unit = -1.0),
        ("vertex_layout", |o| o.vertex_layout = 2),
        ("threads", |o| o.threads = 3),
        ("thread_count", |o| o.thread_count = 257),
        ("precision_error", |o| o.precision_error = f32::NAN),
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
