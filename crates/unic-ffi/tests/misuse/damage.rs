//! Damaged models and saved states.

use super::*;

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
        (folder.path().to_owned(), "expected a file"),
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
