//! Pointers that are null, and handles that are released or invented.

use super::*;

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
fn a_misaligned_place_leaves_the_other_one_alone() {
    let Scene { instance, .. } = scene();
    let (mut precision, mut words) = (9, [7u32; 2]);
    let askew: *mut u32 = words.as_mut_ptr().cast::<u8>().wrapping_add(1).cast();
    // SAFETY: places for two numbers, one of which is misaligned and refused.
    unsafe {
        let status = unic_instance_precision(instance.0, &mut precision, askew);
        refused(status, UnicStatus::Misaligned, "is_slower_than_f32");
        let status = unic_instance_precision(instance.0, askew, &mut precision);
        refused(status, UnicStatus::Misaligned, "precision");
        assert_eq!((precision, words), (9, [7; 2]));
        ok(unic_instance_precision(instance.0, null_mut(), &mut precision));
    }
    assert!(precision < 2, "{precision}");
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
