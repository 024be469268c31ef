//! Contract of motion specifications and normalisations: their values, and what is refused.

use super::*;
use crate::{mesh::TriMesh, skinning::SkinningWeights};

fn character() -> Character {
    let skeleton = skeleton(&[2, 0, -1]);
    let vertices = vec![Vec3::Y * 0.3, Vec3::Y * 1.8, Vec3::X];
    Character {
        body: TriMesh::new(vertices, vec![[0, 1, 2]]).unwrap(),
        weights: SkinningWeights::from_dense(&[1.0; 9], 3, 3).unwrap(),
        skeleton,
        file_mesh: None,
    }
}

#[test]
fn rest_heights_are_measured_from_the_lowest_vertex() {
    let mut character = character();
    let build = |contacts, character: &Character| {
        MotionSpec::new(
            MotionLayout::Heading,
            VelocityScheme::Backward,
            contacts,
            character,
        )
    };
    let spec = build([0, 1, 2, 1], &character).unwrap();
    let joints = character.skeleton.joints();
    assert_eq!(spec.contact_rest_heights_m[1], joints[1].y);
    character.body.vertices[2].y = 0.2;
    let raised = Vec3::Y * 5.0;
    character.body.vertices.iter_mut().for_each(|v| *v += raised);
    let spec = build([0; 4], &character).unwrap();
    assert!((spec.contact_rest_heights_m[0] - (character.skeleton.joints()[0].y - 5.2)).abs() < 1e-5);
    let refused = build([0, 1, 2, 3], &character);
    assert_eq!(refused, Err(MotionError::ContactJoint { joint: 3, joints: 3 }));
}

#[test]
fn specifications_and_states_of_files_are_checked() {
    let character = character();
    let mut spec = spec(MotionLayout::Paper, VelocityScheme::Forward, 3);
    assert_eq!(spec.check(&character.skeleton), Ok(()));
    let text = serde_json::to_string(&spec).unwrap();
    assert_eq!(serde_json::from_str::<MotionSpec>(&text).unwrap(), spec);
    assert!(text.contains(r#""layout":"paper","velocity":"forward""#));
    assert!(!text.contains("springs"), "files of earlier versions have none");
    let unknown = text.replace("layout", "layuot");
    assert!(serde_json::from_str::<MotionSpec>(&unknown).is_err());
    spec.springs = springs(3);
    let text = serde_json::to_string(&spec).unwrap();
    assert_eq!(serde_json::from_str::<MotionSpec>(&text).unwrap(), spec);
    spec.contact_rest_heights_m[2] = f32::NAN;
    let found = spec.check(&character.skeleton);
    assert!(matches!(found, Err(MotionError::NotFinite { element: 2, .. })));
    spec.springs.springs[1].damping_ratio = 1.0;
    let found = spec.check(&character.skeleton);
    let wrong = MotionError::Spring {
        frequency_hz: 2.0,
        damping_ratio: 1.0,
    };
    assert_eq!(found, Err(wrong));
    spec.springs.joints[2] = 3;
    let found = spec.check(&character.skeleton);
    assert_eq!(found, Err(MotionError::SpringJoint { joint: 3, joints: 3 }));
    spec.springs = springs(3);
    let pose = character.skeleton.bind_pose();
    let start = MotionInput {
        pose: &pose,
        next_pose: None,
        ground_height: 0.0,
        dt: 0.1,
        wind: Vec3::ZERO,
    };
    let state = MotionState::start(&spec, &character.skeleton, &start);
    let found = state.check(&spec, &skeleton(&SMPL_PARENTS));
    assert!(matches!(
        found,
        Err(MotionError::Length {
            expected: 24,
            found: 3,
            ..
        })
    ));
    let text = serde_json::to_value(&state).unwrap();
    for path in [
        "/heading/yaw",
        "/ground_height",
        "/vector/4",
        "/masses/1/velocity/2",
        "/world_from_joint/1/translation/0",
    ] {
        let mut damaged = text.clone();
        // JSON has no infinity, but a number beyond the range of f32 is read as one.
        *damaged.pointer_mut(path).unwrap() = 1e300.into();
        let damaged: MotionState = serde_json::from_value(damaged).unwrap();
        let found = damaged.check(&spec, &character.skeleton);
        assert!(
            matches!(found, Err(MotionError::NotFinite { .. })),
            "{path}: {found:?}"
        );
    }
}

#[test]
fn normalised_elements_have_mean_zero_and_deviation_one() {
    let (skeleton, poses) = (skeleton(&SMPL_PARENTS), motion(24).poses());
    let spec = spec(MotionLayout::Heading, VelocityScheme::Backward, 24);
    let vectors = streamed(&spec, &skeleton, &poses, Source::Clip);
    let fitted = Normalisation::fit(
        24,
        motion_len(24),
        NormalisationRule::PAPER,
        vectors.iter().map(Vec::as_slice),
    )
    .unwrap();
    let mut scaled = vectors.clone();
    scaled.iter_mut().for_each(|c| fitted.apply(c));
    let normalised: Vec<usize> = MotionSlices::new(24).normalised().flatten().collect();
    for i in 0..motion_len(24) {
        if !normalised.contains(&i) {
            assert!(vectors.iter().zip(&scaled).all(|(a, b)| a[i] == b[i]));
            continue;
        }
        let column = || scaled.iter().map(|c| f64::from(c[i]));
        let mean = column().sum::<f64>() / FRAMES as f64;
        let variance = column().map(|x| (x - mean).powi(2)).sum::<f64>() / FRAMES as f64;
        // The root's x and z are always zero in this layout.
        let expected = if [0, 2].contains(&i) { 0.0 } else { 1.0 };
        assert!(
            mean.abs() < 1e-4 && (variance - expected).abs() < 1e-3,
            "{i}: {mean} {variance}"
        );
    }
}

#[test]
fn normalisations_are_checked() {
    assert_eq!(
        Normalisation::fit(3, 43, NormalisationRule::PAPER, [[0.0; 0]; 0]),
        Ok(Normalisation::identity(43))
    );
    let wrong = Normalisation::fit(3, 43, NormalisationRule::PAPER, [&[0.0; 42][..]]);
    assert!(matches!(
        wrong,
        Err(MotionError::Length {
            expected: 43,
            found: 42,
            ..
        })
    ));
    let mut vector = [0.0; 43];
    vector[7] = f32::INFINITY;
    let wrong = Normalisation::fit(3, 43, NormalisationRule::PAPER, [&vector[..]]);
    assert!(matches!(wrong, Err(MotionError::NotFinite { element: 7, .. })));
    let mut normalisation = Normalisation::identity(43);
    assert_eq!(normalisation.check(43), Ok(()));
    assert!(normalisation.check(55).is_err());
    normalisation.std[5] = 0.0;
    assert!(matches!(
        normalisation.check(43),
        Err(MotionError::NotFinite { element: 5, .. })
    ));
}
