//! Contract: every check finds its mistake and names the cause, and correct input has no findings.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::{Mat3, Quat, Vec3};
use std::{f32::consts::FRAC_PI_2, path::Path};
use unic_core::{
    character::Character,
    clip::Clip,
    mesh::TriMesh,
    skeleton::{SMPL_JOINT_NAMES, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_io::{
    Capture, Split,
    check::{self, Finding, mesh, motion, other_mesh},
};
use unic_testdata::{Figure, Take, take, write_capture};

/// Asserts that there is one finding and that its message contains all `words`.
fn assert_one(findings: &[Finding], words: &[&str]) {
    let texts: Vec<String> = findings.iter().map(ToString::to_string).collect();
    let [text] = texts.as_slice() else {
        panic!("expected one finding of {words:?}, found {texts:?}")
    };
    for word in words {
        assert!(text.contains(word), "expected {word} in: {text}");
    }
    assert!(
        text.contains(": found ") && text.contains(": probably ") && text.contains("; "),
        "{text}"
    );
}

fn moved(mesh: &TriMesh, by: Mat3) -> TriMesh {
    TriMesh {
        vertices: mesh.vertices.iter().map(|v| by * *v).collect(),
        ..mesh.clone()
    }
}

fn scale(factor: f32) -> Mat3 {
    Mat3::from_diagonal(Vec3::splat(factor))
}

#[test]
fn correct_input_has_no_findings() {
    let Figure {
        character, garment, ..
    } = Figure::tube();
    assert_eq!(check::character(&character), []);
    assert_eq!(check::garment(&garment.rest, &character), []);
    assert_eq!(other_mesh(&garment.rest, &garment.rest), []);
    assert_eq!(motion(&take("a", 1, 60).clip, Some(&character.skeleton)), []);
    assert_eq!(findings_of(|_| {}), []);
}

#[test]
fn wrong_units_axes_and_places_of_garments_are_found() {
    let Figure {
        character, garment, ..
    } = Figure::tube();
    let found = |by: Mat3| check::garment(&moved(&garment.rest, by), &character);
    assert_one(&found(scale(1000.0)), &["millimetres", "by 0.001"]);
    assert_one(&found(scale(100.0)), &["centimetres", "by 0.01"]);
    assert_one(
        &found(Mat3::from_quat(Quat::from_rotation_x(FRAC_PI_2))),
        &["Z up", "-90 degrees about X"],
    );
    let mut beside = garment.rest.clone();
    beside.vertices.iter_mut().for_each(|v| v.x += 3.0);
    assert_one(
        &check::garment(&beside, &character),
        &["another place", "bind pose"],
    );
    let mut narrow = garment.rest.clone();
    narrow
        .vertices
        .iter_mut()
        .for_each(|v| *v *= Vec3::new(0.5, 1.0, 0.5));
    assert_one(
        &check::garment(&narrow, &character),
        &["100 % of its vertices inside", "bind pose"],
    );
}

#[test]
fn garments_facing_backwards_are_found() {
    let Figure {
        mut character,
        garment,
        ..
    } = Figure::tube();
    let belly = |mesh: &mut TriMesh| {
        mesh.vertices
            .iter_mut()
            .for_each(|v| v.z *= if v.z > 0.0 { 2.0 } else { 1.0 })
    };
    let mut rest = garment.rest;
    belly(&mut character.body);
    belly(&mut rest);
    assert_eq!(check::garment(&rest, &character), []);
    let turned = moved(
        &rest,
        Mat3::from_quat(Quat::from_rotation_y(std::f32::consts::PI)),
    );
    assert_one(
        &check::garment(&turned, &character),
        &["faces -Z", "180 degrees about Y"],
    );
}

#[test]
fn wrong_starts_are_found() {
    let Figure {
        character, garment, ..
    } = Figure::tube();
    let take = take("a", 1, 3);
    let found =
        |positions: &[Vec3]| check::start(positions, &garment, &character.skeleton, &take.clip.poses[0]);
    assert_eq!(found(&take.garment[0]), []);
    let changed = |change: &dyn Fn(usize, Vec3) -> Vec3| -> Vec<Vec3> {
        take.garment[0]
            .iter()
            .enumerate()
            .map(|(i, v)| change(i, *v))
            .collect()
    };
    assert_one(&found(&changed(&|_, v| 1000.0 * v)), &["start", "millimetres"]);
    assert_one(&found(&changed(&|_, v| v + Vec3::X)), &["start", "m (RMS)"]);
    // A quarter of the vertices in another order does not change the median edge.
    let part = changed(&|i, v| if i < 15 { take.garment[0][(7 * i) % 60] } else { v });
    assert_one(&found(&part), &["start", "another order"]);
}

#[test]
fn other_meshes_of_wrong_units_or_garments_are_found() {
    let rest = Figure::tube().garment.rest;
    assert_one(&other_mesh(&moved(&rest, scale(1000.0)), &rest), &["millimetres"]);
    let turned = Mat3::from_quat(Quat::from_rotation_x(FRAC_PI_2));
    assert_one(&other_mesh(&moved(&rest, turned), &rest), &["Z up"]);
    let wide = Mat3::from_diagonal(Vec3::new(3.0, 1.0, 3.0));
    assert_one(&other_mesh(&moved(&rest, wide), &rest), &["another garment"]);
}

#[test]
fn fans_loose_points_and_degenerate_faces_are_found() {
    let mut rest = Figure::tube().garment.rest;
    rest.vertices.push(Vec3::Y);
    assert_one(&mesh("mesh", &rest), &["a vertex without a face"]);
    let first = rest.vertices.len() as u32;
    let rim = (0..100).map(|i| Quat::from_rotation_y(0.06 * i as f32) * Vec3::new(0.3, 1.0, 0.0));
    rest.vertices.extend(rim);
    rest.faces = (1..99).map(|i| [first, first + i, first + i + 1]).collect();
    rest.faces.push([0, 1, 1]);
    let texts: Vec<String> = mesh("mesh", &rest).iter().map(ToString::to_string).collect();
    assert!(
        texts.iter().any(|t| t.contains("98 triangles around one vertex")),
        "{texts:?}"
    );
    assert!(
        texts.iter().any(|t| t.contains("1 triangle without an area")),
        "{texts:?}"
    );
}

/// SMPL's joints in a T-pose, in its order.
fn smpl() -> Character {
    let side = |x: f32, y: f32, z: f32| [Vec3::new(x, y, z), Vec3::new(-x, y, z)];
    let [hip, knee, ankle, foot] = [
        side(0.1, 0.9, 0.0),
        side(0.1, 0.5, 0.0),
        side(0.1, 0.1, 0.0),
        side(0.1, 0.03, 0.12),
    ];
    let [collar, shoulder, elbow, wrist, hand] = [0.08, 0.18, 0.45, 0.7, 0.8].map(|x| side(x, 1.4, 0.0));
    let middle = |y: f32| Vec3::new(0.0, y, 0.0);
    let mut joints = vec![
        middle(0.95),
        hip[0],
        hip[1],
        middle(1.05),
        knee[0],
        knee[1],
        middle(1.2),
    ];
    joints.extend([ankle[0], ankle[1], middle(1.3), foot[0], foot[1], middle(1.45)]);
    joints.extend([
        collar[0],
        collar[1],
        middle(1.6),
        shoulder[0],
        shoulder[1],
        elbow[0],
        elbow[1],
    ]);
    joints.extend([wrist[0], wrist[1], hand[0], hand[1]]);
    let parents = vec![
        -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
    ];
    let tube = Figure::tube().character;
    with_skeleton(
        tube,
        SkeletonParts {
            names: SMPL_JOINT_NAMES.map(str::to_owned).to_vec(),
            parents,
            joints,
            rest_pose: Vec::new(),
        },
    )
}

fn with_skeleton(character: Character, parts: SkeletonParts) -> Character {
    let joints = parts.joints.len();
    let rows = (0..character.body.vertices.len()).map(|v| std::iter::once((v % 2, 1.0)));
    Character {
        skeleton: Skeleton::new(parts).unwrap(),
        weights: SkinningWeights::from_rows(joints, rows).unwrap(),
        ..character
    }
}

/// The body and the joints, transformed by a matrix.
fn turned(character: &Character, by: Mat3) -> Character {
    let mut parts = character.skeleton.to_parts();
    parts.joints.iter_mut().for_each(|j| *j = by * *j);
    let body = moved(&character.body, by);
    with_skeleton(
        Character {
            body,
            ..character.clone()
        },
        parts,
    )
}

#[test]
fn wrong_units_and_axes_of_bodies_are_found() {
    let smpl = smpl();
    assert_eq!(check::character(&smpl), []);
    assert_one(
        &check::character(&turned(&smpl, scale(100.0))),
        &["extent of 160", "centimetres"],
    );
    let facing = Mat3::from_quat(Quat::from_rotation_y(std::f32::consts::PI));
    assert_one(
        &check::character(&turned(&smpl, facing)),
        &["feet that point along -Z", "face +Z"],
    );
    let lying = Mat3::from_quat(Quat::from_rotation_x(FRAC_PI_2));
    let texts: Vec<String> = check::character(&turned(&smpl, lying))
        .iter()
        .map(ToString::to_string)
        .collect();
    assert!(texts.iter().any(|t| t.contains("Z up")), "{texts:?}");
}

#[test]
fn inverted_mirrored_and_unskinned_bodies_are_found() {
    let smpl = smpl();
    let mut inward = smpl.clone();
    inward.body.faces.iter_mut().for_each(|face| face.swap(0, 1));
    assert_one(&check::character(&inward), &["a volume of -", "flip the normals"]);
    let mut swapped = smpl.skeleton.to_parts();
    swapped.joints.iter_mut().for_each(|j| j.x = -j.x);
    assert_one(
        &check::character(&with_skeleton(smpl.clone(), swapped)),
        &["left joints on the right side"],
    );
    let rows = (0..smpl.body.vertices.len()).map(|_| std::iter::once((0, 1.0)));
    let weights = SkinningWeights::from_rows(24, rows).unwrap();
    assert_one(
        &check::character(&Character {
            weights,
            ..smpl.clone()
        }),
        &["one joint alone", "bind the mesh"],
    );
    let mut apart = smpl.skeleton.to_parts();
    apart.joints.iter_mut().for_each(|j| *j *= 100.0);
    assert_one(&check::character(&with_skeleton(smpl, apart)), &["centimetres"]);
}

#[test]
fn duplicate_and_assumed_joint_names_are_found() {
    let smpl = smpl();
    let mut twice = smpl.skeleton.to_parts();
    twice.names[23] = "R_wrist".to_owned();
    assert_one(
        &check::character(&with_skeleton(smpl.clone(), twice)),
        &["two joints named `R_wrist`"],
    );
    let mut nameless = smpl.skeleton.to_parts();
    // Depth first, the order of Blender's bones.
    let order = [
        0, 1, 4, 7, 10, 2, 5, 8, 11, 3, 6, 9, 12, 15, 13, 16, 18, 20, 22, 14, 17, 19, 21, 23,
    ];
    let place = |joint: i64| {
        order
            .iter()
            .position(|j| *j as i64 == joint)
            .map_or(-1, |p| p as i64)
    };
    nameless.parents = order
        .iter()
        .map(|j| place(smpl.skeleton.to_parts().parents[*j]))
        .collect();
    nameless.joints = order.iter().map(|j| smpl.skeleton.joints()[*j]).collect();
    nameless.names = Vec::new();
    let texts: Vec<String> = check::character(&with_skeleton(smpl, nameless))
        .iter()
        .map(ToString::to_string)
        .collect();
    assert!(
        texts.iter().any(|t| t.contains("in another tree than SMPL's")),
        "{texts:?}"
    );
}

#[test]
fn wrong_units_jumps_and_motionless_motions_are_found() {
    let Figure { character, .. } = Figure::tube();
    let found = |change: &dyn Fn(&mut Clip)| {
        let mut clip = take("a", 1, 60).clip;
        change(&mut clip);
        motion(&clip, Some(&character.skeleton))
    };
    let centimetres = |clip: &mut Clip| {
        clip.poses
            .iter_mut()
            .for_each(|p| p.trans = 100.0 * (p.trans + Vec3::Y))
    };
    assert_one(
        &found(&centimetres),
        &["above the ground", "centimetres", "by 0.01"],
    );
    let jump = |clip: &mut Clip| clip.poses[30..].iter_mut().for_each(|p| p.trans.x += 2.0);
    assert_one(&found(&jump), &["m/s in frame 29", "two takes"]);
    let still = |clip: &mut Clip| {
        let first = clip.poses[0].clone();
        clip.poses = vec![first; 2];
    };
    assert_one(&found(&still), &["2 frames that are all the same", "bake"]);
    let degrees = |clip: &mut Clip| {
        let wild = |q: Quat| Quat::from_scaled_axis(q.to_scaled_axis() * 180.0 / std::f32::consts::PI);
        clip.poses
            .iter_mut()
            .flat_map(|p| &mut p.local)
            .for_each(|q| *q = wild(*q));
    };
    assert_one(&found(&degrees), &["from frame to frame", "degrees"]);
}

/// Findings in a capture of one changed clip.
fn findings_of(change: impl Fn(&mut Take)) -> Vec<Finding> {
    let folder = tempfile::tempdir().unwrap();
    let mut take = take("walk", 1, 90);
    change(&mut take);
    let root = folder.path().join("tube");
    write_capture(&root, &Figure::tube(), &[(take, Split::Train)]);
    all(&root)
}

fn all(root: &Path) -> Vec<Finding> {
    let capture = Capture::open(root).unwrap();
    check::capture::<unic_io::Error>(&capture, &Split::ALL, &mut || Ok(())).unwrap()
}

#[test]
fn wrong_vertex_orders_and_units_of_clips_are_found() {
    let shuffled = findings_of(|take| {
        let count = take.garment[0].len();
        for frame in &mut take.garment {
            *frame = (0..count).map(|v| frame[(37 * v + 11) % count]).collect();
        }
    });
    assert_one(&shuffled, &["clip `walk`", "times as long", "another order"]);
    let large = findings_of(|take| take.garment.iter_mut().flatten().for_each(|v| *v *= 100.0));
    assert_one(&large, &["100.", "centimetres", "by 0.01"]);
}

#[test]
fn time_shifts_and_motionless_garments_are_found() {
    let late = |frames: usize| {
        move |take: &mut Take| {
            let before = take.garment.clone();
            let last = before.len();
            take.garment = (0..last)
                .map(|t| before[t.saturating_sub(frames)].clone())
                .collect();
        }
    };
    assert_one(&findings_of(late(9)), &["frames after its body", "same frame"]);
    let early = findings_of(|take| {
        take.garment.rotate_left(6);
        let last = take.garment.len();
        let held = take.garment[last - 7].clone();
        take.garment[last - 6..]
            .iter_mut()
            .for_each(|frame| frame.clone_from(&held));
    });
    assert_one(&early, &["frames before its body"]);
    // A skirt: its hem lags by six frames, its waistband is on time.
    let loose = |take: &mut Take| {
        let before = take.garment.clone();
        let heights: Vec<f32> = before[0].iter().map(|v| v.y).collect();
        let top = heights.iter().copied().fold(f32::MIN, f32::max);
        let bottom = heights.iter().copied().fold(f32::MAX, f32::min);
        for (t, frame) in take.garment.iter_mut().enumerate() {
            for (v, position) in frame.iter_mut().enumerate() {
                let late = (6.0 * (top - heights[v]) / (top - bottom)).round() as usize;
                *position = before[t.saturating_sub(late)][v];
            }
        }
    };
    let found = findings_of(loose);
    assert!(found.is_empty(), "{found:?}");
    let late_and_loose = findings_of(|take| {
        loose(take);
        late(9)(take);
    });
    assert_one(&late_and_loose, &["frames after its body"]);
    let still = findings_of(|take| {
        let first = take.garment[0].clone();
        take.garment.iter_mut().for_each(|frame| frame.clone_from(&first));
    });
    assert_one(&still, &["does not move", "bake"]);
    let beside = findings_of(|take| take.garment.iter_mut().flatten().for_each(|v| v.x += 1.0));
    assert_one(&beside, &["1.00 m (RMS)"]);
}
