//! Contract: BVH motion of any skeleton is transferred to a character. Joint names, unit, up axis,
//! rest pose, bone axes and length of the spine do not matter, and standing feet are held.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{data, full_body_motion, humanoid, largest_differences, without_filters};
use glam::{EulerRot, Quat, Vec3};
use proptest::prelude::*;
use std::{f32::consts::FRAC_PI_2, fmt::Write, path::Path};
use unic_core::{
    Pose,
    character::Character,
    clip::Clip,
    skeleton::{SMPL_JOINT_NAMES, Skeleton},
    transform::Rigid,
};
use unic_io::{
    BoneMap, FootLock, MotionImport, MotionOptions, UpAxis, import_motion, measure_feet, read_character,
    write_bvh,
};

/// Conventions of a BVH file that a skeleton is written with.
struct BvhRig {
    names: Vec<String>,
    /// Rotation of each joint's axes in the T-pose relative to the zero pose.
    rest: Vec<Quat>,
    /// Number of file units in a metre.
    scale: f32,
    file_from_world: Quat,
}

impl BvhRig {
    /// SMPL's names, metres, Y up; the zero pose is the T-pose.
    fn smpl() -> Self {
        Self {
            names: SMPL_JOINT_NAMES.map(String::from).to_vec(),
            rest: vec![Quat::IDENTITY; 24],
            scale: 1.0,
            file_from_world: Quat::IDENTITY,
        }
    }

    /// Writes the clip for a rig whose zero pose has every joint j rotated by `rest[j]` away from
    /// the T-pose: the same world motion in other numbers.
    fn write(&self, skeleton: &Skeleton, clip: &Clip) -> String {
        let mut zero = Vec::new();
        let t_pose = Pose::from_axis_angles(Vec3::ZERO, &[Vec3::ZERO; 24]);
        skeleton.forward_kinematics(&t_pose, &mut zero);
        let mut text = String::from("HIERARCHY\n");
        let mut order = Vec::new();
        self.joint(skeleton, &zero, skeleton.root(), &mut text, &mut order);
        let (frames, time) = (clip.len(), 1.0 / clip.fps);
        writeln!(text, "MOTION\nFrames: {frames}\nFrame Time: {time:.9}").unwrap();
        let mut world: Vec<Rigid> = Vec::new();
        for pose in &clip.poses {
            skeleton.forward_kinematics(pose, &mut world);
            let root = self.file_from_world * world[skeleton.root()].translation * self.scale;
            write!(text, "{} {} {}", root.x, root.y, root.z).unwrap();
            for &j in &order {
                let turned = |j: usize| self.file_from_world * world[j].rotation * self.rest[j].inverse();
                let parent = skeleton.parents()[j].map_or(Quat::IDENTITY, turned);
                let (y, x, z) = (parent.inverse() * turned(j)).to_euler(EulerRot::YXZ);
                let [y, x, z] = [y, x, z].map(f32::to_degrees);
                write!(text, " {y} {x} {z}").unwrap();
            }
            text.push('\n');
        }
        text
    }

    fn joint(
        &self,
        skeleton: &Skeleton,
        zero: &[Rigid],
        joint: usize,
        text: &mut String,
        order: &mut Vec<usize>,
    ) {
        let parent = skeleton.parents()[joint];
        order.push(joint);
        let offset = parent.map_or(Vec3::ZERO, |p| {
            self.rest[p] * (zero[joint].translation - zero[p].translation) * self.scale
        });
        let word = if parent.is_some() { "JOINT" } else { "ROOT" };
        let positions = if parent.is_some() {
            "3"
        } else {
            "6 Xposition Yposition Zposition"
        };
        writeln!(
            text,
            "{word} {}\n{{\nOFFSET {} {} {}\nCHANNELS {positions} Yrotation Xrotation Zrotation",
            self.names[joint], offset.x, offset.y, offset.z
        )
        .unwrap();
        let children = (0..skeleton.len()).filter(|&j| skeleton.parents()[j] == Some(joint));
        children.for_each(|child| self.joint(skeleton, zero, child, text, order));
        text.push_str("}\n");
    }
}

fn import(text: &str, character: &Character, options: &MotionOptions) -> Result<MotionImport, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.bvh");
    std::fs::write(&path, text).unwrap();
    import_motion(&path, character, options).map_err(|e| e.to_string())
}

#[test]
fn motion_of_the_character_itself_is_unchanged() {
    let (character, clip) = (humanoid(), full_body_motion(40));
    let skeleton = &character.skeleton;
    let import = import(
        &BvhRig::smpl().write(skeleton, &clip),
        &character,
        &without_filters(),
    )
    .unwrap();
    let (angle, distance) = largest_differences(&import.clip, &clip);
    // The file holds degrees and metres with seven digits.
    assert!(angle < 2e-5 && distance < 2e-6, "{angle} rad, {distance} m");
    assert_eq!((import.clip.fps, import.clip.ground_height), (30.0, 0.0));
}

#[test]
fn real_body_keeps_its_walk() {
    let Some(body) = data("body/character.npz") else {
        return;
    };
    let Some(walk) = data("motion/locomotion/Walk1.npz") else {
        return;
    };
    let character = read_character(&body).unwrap();
    let mut clip = import_motion(&walk, &character, &without_filters()).unwrap().clip;
    clip.poses.truncate(200);
    let import = import(
        &BvhRig::smpl().write(&character.skeleton, &clip),
        &character,
        &without_filters(),
    )
    .unwrap();
    let (angle, distance) = largest_differences(&import.clip, &clip);
    assert!(angle < 5e-5 && distance < 5e-6, "{angle} rad, {distance} m");
}

#[test]
fn names_unit_and_axes_do_not_matter() {
    let (character, clip) = (humanoid(), full_body_motion(30));
    let mixamo = |name: &str| {
        let (side, part) = match name.split_once('_') {
            Some(("L", part)) => ("Left", part),
            Some(("R", part)) => ("Right", part),
            _ => ("", name),
        };
        let part = match part {
            "pelvis" => "Hips",
            "hip" => "UpLeg",
            "knee" => "Leg",
            "ankle" => "Foot",
            "foot" => "ToeBase",
            "collar" => "Shoulder",
            "shoulder" => "Arm",
            "elbow" => "ForeArm",
            "wrist" => "Hand",
            "hand" => "HandMiddle1",
            "spine1" => "Spine",
            "spine2" => "Spine1",
            "spine3" => "Spine2",
            other => other,
        };
        format!("mixamorig:{side}{part}")
    };
    let turns = [Quat::IDENTITY, Quat::from_rotation_x(FRAC_PI_2)];
    for (scale, unit) in [
        (1.0, "metres"),
        (100.0, "centimetres"),
        (39.37, "inches"),
        (17.72, "CMU"),
    ] {
        for file_from_world in turns {
            // The zero pose is in the file's axes as well.
            let rig = BvhRig {
                names: SMPL_JOINT_NAMES.map(mixamo).to_vec(),
                rest: vec![file_from_world; 24],
                scale,
                file_from_world,
            };
            let import = import(
                &rig.write(&character.skeleton, &clip),
                &character,
                &without_filters(),
            )
            .unwrap();
            let (angle, distance) = largest_differences(&import.clip, &clip);
            assert!(
                angle < 5e-5 && distance < 1e-5,
                "{unit}: {angle} rad, {distance} m"
            );
            let notes = import.notes.join("\n");
            let says_z = notes.contains("Z up converted");
            assert_eq!(says_z, file_from_world != Quat::IDENTITY);
            assert!(notes.contains(unit) && notes.contains("Mixamo"), "{notes}");
        }
    }
}

/// Largest distance of joint positions between two clips, metres.
fn max_distance(character: &Character, a: &Clip, b: &Clip, joints: &[usize]) -> f32 {
    let (mut p, mut q) = (Vec::new(), Vec::new());
    let mut farthest = 0.0_f32;
    for (x, y) in a.poses.iter().zip(&b.poses) {
        character.skeleton.forward_kinematics(x, &mut p);
        character.skeleton.forward_kinematics(y, &mut q);
        let distances = joints
            .iter()
            .map(|&j| p[j].translation.distance(q[j].translation));
        farthest = distances.fold(farthest, f32::max);
    }
    farthest
}

#[test]
fn rest_pose_of_limbs_does_not_matter() {
    let (character, clip) = (humanoid(), full_body_motion(30));
    let zero = character.skeleton.joints();
    let mut rig = BvhRig::smpl();
    // Each bone is rotated by the smallest rotation; hands follow their forearms.
    let mut lay = |from: usize, to: usize, angle: f32, along: &[usize]| {
        let bone = (zero[to] - zero[from]).normalize();
        let target = Quat::from_rotation_z(angle * zero[from].x.signum()) * bone;
        along
            .iter()
            .for_each(|&j| rig.rest[j] = Quat::from_rotation_arc(bone, target));
    };
    for side in [0, 1] {
        lay(16 + side, 18 + side, -1.4, &[16 + side]);
        lay(18 + side, 20 + side, -1.2, &[18, 20, 22].map(|j| j + side));
        lay(1 + side, 4 + side, 0.3, &[1 + side]);
        lay(4 + side, 7 + side, 0.2, &[4 + side]);
    }
    let import = import(
        &rig.write(&character.skeleton, &clip),
        &character,
        &without_filters(),
    )
    .unwrap();
    let all: Vec<usize> = (0..22).collect();
    let off = max_distance(&character, &import.clip, &clip, &all);
    assert!(off < 1e-4, "{off}");
    let (angle, _) = largest_differences(&import.clip, &clip);
    assert!(angle < 2e-3, "{angle}");
}

#[test]
fn rigs_without_a_standing_zero_pose_use_a_standing_frame() {
    let (character, mut clip) = (humanoid(), full_body_motion(60));
    // A frame in which the body stands upright with straight legs.
    clip.poses[17].local.fill(Quat::IDENTITY);
    clip.poses[17].local[0] = Quat::from_rotation_y(0.7);
    let mut rig = BvhRig::smpl();
    for (j, rest) in rig.rest.iter_mut().enumerate() {
        let j = j as f32;
        *rest = Quat::from_euler(EulerRot::XYZ, 0.9 * j, 2.1 + j, -1.7 * j);
    }
    let import = import(
        &rig.write(&character.skeleton, &clip),
        &character,
        &without_filters(),
    )
    .unwrap();
    let notes = import.notes.join("\n");
    assert!(notes.contains("frame 17 stands for it"), "{notes}");
    let all: Vec<usize> = (0..24).collect();
    let off = max_distance(&character, &import.clip, &clip, &all);
    assert!(off < 1e-4, "{off}");
}

#[test]
fn spines_of_other_lengths_reach_the_same_chest() {
    let (character, clip) = (humanoid(), full_body_motion(30));
    let text = BvhRig::smpl().write(&character.skeleton, &clip);
    // A further joint in the spine, without channels and with an unknown name.
    let mut still = clip.clone();
    still.poses.iter_mut().for_each(|p| p.local[6] = Quat::IDENTITY);
    let longer = text.replacen(
        "JOINT spine2",
        "JOINT spine15 { OFFSET 0 0 0 CHANNELS 0\nJOINT spine2",
        1,
    );
    let end = longer.find("MOTION").unwrap();
    let longer = format!("{}}}\n{}", &longer[..end], &longer[end..]);
    let import = import(&longer, &character, &without_filters()).unwrap();
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for (x, y) in import.clip.poses.iter().zip(&clip.poses) {
        character.skeleton.forward_kinematics(x, &mut a);
        character.skeleton.forward_kinematics(y, &mut b);
        for j in [0, 9, 12, 15, 16, 18] {
            assert!(a[j].rotation.dot(b[j].rotation).abs() > 1.0 - 1e-5, "{j}");
        }
        // The rotation is distributed over another number of joints, so that positions differ a
        // little.
        assert!(a[6].translation.distance(b[6].translation) < 0.05);
    }
}

#[test]
fn unknown_names_need_a_bone_map() {
    let (character, clip) = (humanoid(), full_body_motion(10));
    let mut rig = BvhRig::smpl();
    rig.names = (0..24).map(|j| format!("Knochen {j}")).collect();
    let text = rig.write(&character.skeleton, &clip);
    let error = import(&text, &character, &without_filters()).unwrap_err();
    assert!(
        error.contains("expected joints for L_hip") && error.contains("Knochen 0"),
        "{error}"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bones.toml");
    let lines = (0..24).map(|j| format!("{} = \"Knochen {j}\"\n", SMPL_JOINT_NAMES[j]));
    std::fs::write(&path, format!("[bones]\n{}", lines.collect::<String>())).unwrap();
    let mut options = without_filters();
    options.bones = BoneMap::read(&path).unwrap();
    let clip_again = import(&text, &character, &options).unwrap().clip;
    let (angle, distance) = largest_differences(&clip_again, &clip);
    assert!(angle < 2e-5 && distance < 2e-6, "{angle} rad, {distance} m");
    for (line, words) in [
        ("[bones]\nL_thigh = \"a\"", "expected bones among pelvis"),
        ("[joints]\nL_hip = \"a\"", "expected a table [bones]"),
    ] {
        std::fs::write(&path, line).unwrap();
        let error = BoneMap::read(&path).unwrap_err().to_string();
        assert!(error.contains(words) && error.lines().count() == 1, "{error}");
    }
    options.bones = BoneMap::new([("L_hip", "nobody")]).unwrap();
    let error = import(&text, &character, &options).unwrap_err();
    assert!(
        error.contains("the joint `nobody` that the bone map names"),
        "{error}"
    );
}

fn cmu(name: &str, options: &MotionOptions) -> Option<(Character, MotionImport)> {
    let character = read_character(&data("body/character.npz")?).unwrap();
    let path = data(&format!("motion/cmu_bvh/{name}.bvh"))?;
    let import = import_motion(&path, &character, options).unwrap();
    Some((character, import))
}

fn at_30() -> MotionOptions {
    MotionOptions {
        fps: Some(30.0),
        ..MotionOptions::default()
    }
}

#[test]
fn standing_feet_neither_slide_nor_sink() {
    for name in ["131_02", "131_03"] {
        let free = MotionOptions {
            feet: FootLock::Keep,
            ..at_30()
        };
        let Some((character, before)) = cmu(name, &free) else {
            return;
        };
        let Some((_, after)) = cmu(name, &at_30()) else {
            return;
        };
        let [before, after] = [before, after].map(|i| i.clip);
        let measure = |clip: &Clip| measure_feet(clip, &before, &character).unwrap();
        let (b, a) = (measure(&before), measure(&after));
        eprintln!("{name}: before {b:?}\n        after  {a:?}");
        assert!(a.standing_seconds > 2.0);
        assert!(a.slide < 0.02 && a.slide < 0.3 * b.slide, "{a:?}");
        assert!(a.deepest < 0.002 && a.height_error < 0.005, "{a:?}");
        // The correction is smooth: no joint rotates much faster than before.
        let fastest = |clip: &Clip| {
            let turns = clip.poses.windows(2).flat_map(|p| {
                (p[0].local.iter().zip(&p[1].local))
                    .map(|(a, b)| a.angle_between(*b))
                    .collect::<Vec<_>>()
            });
            turns.fold(0.0, f32::max) * clip.fps
        };
        assert!(
            fastest(&after) < 1.25 * fastest(&before) + 2.0,
            "{} {}",
            fastest(&after),
            fastest(&before)
        );
        let moved = max_distance(&character, &before, &after, &(0..24).collect::<Vec<_>>());
        eprintln!("        farthest joint moved {moved:.3} m");
        assert!(moved < 0.12, "{moved}");
    }
}

/// The skinned soles are on the ground. Foot locking itself uses joints only.
#[test]
fn soles_are_on_the_ground() {
    for name in ["131_02", "131_03"] {
        let Some((character, import)) = cmu(name, &at_30()) else {
            return;
        };
        let (mut joints, mut transforms, mut body) = (Vec::new(), Vec::new(), Vec::new());
        let mut lowest: Vec<f32> = Vec::new();
        for pose in &import.clip.poses {
            character.skeleton.forward_kinematics(pose, &mut joints);
            character.skeleton.world_from_rest(&joints, &mut transforms);
            (character.weights).skin(&character.body.vertices, &transforms, &mut body);
            lowest.push(body.iter().map(|v: &Vec3| v.y).fold(f32::INFINITY, f32::min));
        }
        lowest.sort_by(f32::total_cmp);
        let at = |share: f32| lowest[(share * (lowest.len() - 1) as f32) as usize];
        eprintln!(
            "{name}: lowest point {:.4} m, 5 % {:.4}, median {:.4}, 95 % {:.4}",
            at(0.0),
            at(0.05),
            at(0.5),
            at(0.95)
        );
        assert!(at(0.5).abs() < 0.004, "{}", at(0.5));
        assert!(at(0.05) > -0.01 && at(0.0) > -0.015, "{} {}", at(0.05), at(0.0));
    }
}

/// Joint positions agree with another program's transfer of the same take to the same body, once
/// time, place and heading are aligned.
#[test]
fn retargeting_of_another_program_agrees() {
    let Some((character, ours)) = cmu("131_03", &at_30()) else {
        return;
    };
    let Some(path) = data("captures/tshirt_blender/clips/mj_131_03.npz") else {
        return;
    };
    let theirs = import_motion(&path, &character, &without_filters()).unwrap().clip;
    let (ours, theirs) = (local(&character, &ours.clip), local(&character, &theirs));
    let error = |shift: usize, j: usize| {
        let pairs = theirs.iter().zip(&ours[shift..]);
        pairs.map(|(a, b)| a[j].distance(b[j])).sum::<f32>() / theirs.len() as f32
    };
    let mean = |shift: usize| (0..24).map(|j| error(shift, j)).sum::<f32>() / 24.0;
    let shifts = 0..=ours.len() - theirs.len();
    let best = shifts.min_by(|a, b| mean(*a).total_cmp(&mean(*b))).unwrap();
    let joints: Vec<String> = (0..24)
        .map(|j| format!("{} {:.0}", SMPL_JOINT_NAMES[j], 1e3 * error(best, j)))
        .collect();
    eprintln!(
        "frame {best}: mean {:.1} mm; {}",
        1e3 * mean(best),
        joints.join(", ")
    );
    assert!(mean(best) < 0.05, "{}", mean(best));
}

/// Joint positions relative to the root in the coordinate frame of the heading.
fn local(character: &Character, clip: &Clip) -> Vec<Vec<Vec3>> {
    let mut world = Vec::new();
    let frame = |pose: &Pose| {
        character.skeleton.forward_kinematics(pose, &mut world);
        let heading = unic_core::heading::Heading::start(world[0].rotation)
            .rotation()
            .inverse();
        let root = world[0].translation;
        world.iter().map(|w| heading * (w.translation - root)).collect()
    };
    clip.poses.iter().map(frame).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn damaged_files_never_panic(cut in 0usize..20_000, flips in prop::collection::vec((0usize..20_000, 0u8..=255), 0..6)) {
        let character = humanoid();
        let mut bytes = BvhRig::smpl().write(&character.skeleton, &full_body_motion(4)).into_bytes();
        if cut % 3 == 0 {
            bytes.truncate(cut % bytes.len());
        }
        for (at, byte) in flips {
            if !bytes.is_empty() {
                let at = at % bytes.len();
                bytes[at] = byte;
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.bvh");
        std::fs::write(&path, &bytes).unwrap();
        let options = MotionOptions { fps: Some(30.0), ..MotionOptions::default() };
        if let Ok(import) = import_motion(&path, &character, &options) {
            prop_assert!(import.clip.poses.iter().all(Pose::is_valid));
        }
        let _ = unic_io::inspect(Path::new(&path));
    }
}

#[test]
fn requested_up_axis_is_used() {
    let (character, clip) = (humanoid(), full_body_motion(10));
    let text = BvhRig::smpl().write(&character.skeleton, &clip);
    let mut options = without_filters();
    options.up = UpAxis::Z;
    let import = import(&text, &character, &options).unwrap();
    let up = import.clip.poses[0].local[0] * Vec3::Y;
    assert!(up.distance(-Vec3::Z) < 1e-5, "{up}");
}

/// Files of fewer than two frames and tables of wrong names are refused, also where the joints are the
/// character's own.
#[test]
fn the_characters_own_joints_excuse_no_fault() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.bvh");
    let mut character = humanoid();
    let clip = full_body_motion(5);
    let mut parts = character.skeleton.to_parts();
    parts.names = (0..parts.joints.len())
        .map(|joint| format!("bone{joint}"))
        .collect();
    character.skeleton = Skeleton::new(parts).unwrap();
    write_bvh(&path, &clip, &character.skeleton).unwrap();
    let read = |options: &MotionOptions| import_motion(&path, &character, options);
    assert!(read(&MotionOptions::default()).is_ok());
    let options = MotionOptions {
        bones: BoneMap::new([("L_hip", "nobody")]).unwrap(),
        ..MotionOptions::default()
    };
    assert!(read(&options).is_err(), "the table is followed");
    let text = std::fs::read_to_string(&path).unwrap();
    for frames in [0, 1] {
        let start = text.find("Frames:").unwrap();
        let mut lines = text[start..].lines();
        let (_, time) = (lines.next(), lines.next().unwrap());
        let rows: String = lines.take(frames).map(|line| format!("{line}\n")).collect();
        std::fs::write(
            &path,
            format!("{}Frames: {frames}\n{time}\n{rows}", &text[..start]),
        )
        .unwrap();
        let error = read(&MotionOptions::default()).unwrap_err().to_string();
        assert!(error.contains("expected at least two frames"), "{error}");
    }
}
