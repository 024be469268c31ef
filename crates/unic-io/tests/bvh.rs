//! Contract: a BVH file of any skeleton and any channels is read with the poses that its numbers
//! define, and a damaged one is refused in one sentence that names the line.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::data;
use glam::Vec3;
use proptest::prelude::*;
use unic_io::Bvh;

fn parse(text: &str) -> Result<Bvh, String> {
    Bvh::parse("walk.bvh".as_ref(), text.as_bytes()).map_err(|e| e.to_string())
}

type Matrix = [[f64; 3]; 3];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let entry = |i: usize, j: usize| (0..3).map(|k| a[i][k] * b[k][j]).sum();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)))
}

fn image(a: &Matrix, v: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| (0..3).map(|k| a[i][k] * v[k]).sum())
}

/// Right-handed rotation about a coordinate axis, written out.
fn about(axis: char, degrees: f64) -> Matrix {
    let (s, c) = degrees.to_radians().sin_cos();
    match axis {
        'X' => [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]],
        'Y' => [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]],
        _ => [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
    }
}

fn rotation(order: &str, angles: [f64; 3]) -> Matrix {
    let factors: Vec<Matrix> = order.chars().zip(angles).map(|(c, a)| about(c, a)).collect();
    product(&product(&factors[0], &factors[1]), &factors[2])
}

fn channels(order: &str) -> String {
    order.chars().map(|c| format!("{c}rotation ")).collect()
}

proptest! {
    #[test]
    fn forward_kinematics_agree_with_matrices_in_all_orders(
        orders in [0usize..6, 0usize..6, 0usize..6],
        angles in prop::array::uniform9(-400.0f64..400.0),
        numbers in prop::array::uniform12(-20.0f64..20.0),
    ) {
        let all = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"];
        let [a, b, c] = orders.map(|o| all[o]);
        let v = |k: usize| [numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]];
        let text = |v: [f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
        // The root's positions come after its rotations, those of the middle joint in another
        // order.
        let file = format!(
            "HIERARCHY\nROOT a\n{{\nOFFSET 7 8 9\nCHANNELS 6 {} Xposition Yposition Zposition\n\
             JOINT b {{ OFFSET {}\n CHANNELS 3 {}\n JOINT c {{ OFFSET 1 2 3 CHANNELS 5 Zposition Xposition {} \
             End Site {{ OFFSET {} }} }} }} }}\nMOTION\nFrames: 1\nFrame Time: .01\n{} {} {} {} {} {}\n",
            channels(a), text(v(1)), channels(b), channels(c), text(v(3)),
            text([angles[0], angles[1], angles[2]]), text(v(0)), text([angles[3], angles[4], angles[5]]),
            numbers[8], numbers[6], text([angles[6], angles[7], angles[8]]),
        );
        let bvh = parse(&file).unwrap();
        prop_assert_eq!(bvh.joints()[2].end_sites[0], Vec3::from_array(v(3).map(|x| x as f32)));
        let mut world = Vec::new();
        bvh.world_from_joint(0, &mut world);
        let ra = rotation(a, [angles[0], angles[1], angles[2]]);
        let rb = product(&ra, &rotation(b, [angles[3], angles[4], angles[5]]));
        let rc = product(&rb, &rotation(c, [angles[6], angles[7], angles[8]]));
        let add = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        let pb = add(v(0), image(&ra, v(1)));
        // y has no channel: it is the offset's.
        let pc = add(pb, image(&rb, [numbers[6], 2.0, numbers[8]]));
        // Rotations are f32: the error of a position is their rounding times its distance.
        let reach = 1.0 + numbers.iter().map(|x| x.abs() as f32).sum::<f32>();
        for (joint, (r, p)) in [(ra, v(0)), (rb, pb), (rc, pc)].into_iter().enumerate() {
            let found = world[joint].translation;
            let error = found.distance(Vec3::from_array(p.map(|x| x as f32)));
            prop_assert!(error < 1e-6 * reach, "{joint}: {found} {p:?}");
            for (k, axis) in Vec3::AXES.into_iter().enumerate() {
                let expected = Vec3::from_array([r[0][k] as f32, r[1][k] as f32, r[2][k] as f32]);
                prop_assert!((world[joint].rotation * axis).distance(expected) < 3e-6);
            }
        }
    }
}

const SMALL: &str = "HIERARCHY
ROOT hip
{
\tOFFSET 0 1 0
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
\tJOINT left knee
\t{
\t\tOFFSET 0 -0.5 0
\t\tCHANNELS 3 Zrotation Xrotation Yrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 -0.5 0
\t\t}
\t}
}
MOTION
Frames: 2
Frame Time: 0.008333
0 1 0 10 20 30 -5 6 7
0 1.5 0 11 21 31 -4 5 6
";

#[test]
fn whitespace_and_case_do_not_matter() {
    let expected = parse(SMALL).unwrap();
    assert_eq!(
        (expected.len(), expected.channel_count(), expected.fps()),
        (2, 9, 120.0)
    );
    assert_eq!(expected.joints()[1].name, "left knee");
    for other in [
        SMALL.replace('\n', "\r\n"),
        SMALL.replace('\n', "\r"),
        SMALL.replace('\t', "   ").replace('\n', "\n\n \t"),
        SMALL.replace("\n\t{", " {").replace("OFFSET", "offset"),
        format!("\u{feff}{SMALL}"),
        SMALL.replace("Frames:", "Frames :").replace("Time:", "Time :"),
        SMALL.replace("End Site", "End Site toe").replace("1.5", "15e-1"),
    ] {
        assert_eq!(parse(&other), Ok(expected.clone()), "{other}");
    }
}

#[test]
fn errors_name_the_line() {
    for (from, to, words) in [
        ("ROOT", "ROOTS", "expected ROOT in line 2, found `ROOTS`"),
        (
            "OFFSET 0 1 0",
            "OFFSET 0 1",
            "expected a finite number in line 5, found `CHANNELS`",
        ),
        (
            "0 1 0 10",
            "0 1 nan 10",
            "expected a finite number in line 19, found `nan`",
        ),
        (
            "0 1 0 10",
            "0 1 0,5 10",
            "expected a finite number in line 19, found `0,5`",
        ),
        (
            "Zrotation Xrotation Yrotation\n\t\tEnd",
            "Zrotation Xrotation\n\t\tEnd",
            "expected a channel",
        ),
        (
            "CHANNELS 3",
            "CHANNELS 7",
            "channels from 0 to 6 in line 9, found `7`",
        ),
        ("Zrotation Xr", "Wrotation Xr", "found `Wrotation`"),
        (
            "left knee",
            "hip",
            "expected joints of different names in line 6, found `hip`",
        ),
        ("left knee", "", "expected the name of a joint in line 6"),
        (
            "Frames: 2",
            "Frames: 3",
            "expected 3 frames of 9 numbers, found 18 numbers",
        ),
        (
            "Frames: 2",
            "Frames: 1",
            "expected 1 frames of 9 numbers, found 18 numbers",
        ),
        ("Frames: 2", "Frames: 18446744073709551615", "found 18 numbers"),
        (
            "Frames: 2",
            "Frames: -2",
            "expected a number of frames in line 17, found `-2`",
        ),
        (
            "0.008333",
            "0",
            "expected a frame time of 0.001 to 1 second in line 18, found `0`",
        ),
        ("0.008333", "-0.01", "found `-0.01`"),
        (
            "}\nMOTION",
            "\nMOTION",
            "expected JOINT, End Site or } in line 16, found `MOTION`",
        ),
        ("HIERARCHY", "", "expected HIERARCHY in line 2, found `ROOT`"),
    ] {
        let text = SMALL.replacen(from, to, 1);
        assert_ne!(text, SMALL);
        let error = parse(&text).unwrap_err();
        assert!(
            error.contains(words) && error.lines().count() == 1,
            "{error}\nnot: {words}"
        );
    }
    let end = SMALL.find("MOTION").unwrap();
    assert!(
        parse(&SMALL[..end])
            .unwrap_err()
            .contains("expected MOTION, found the end of the file")
    );
}

#[test]
fn deep_skeletons_do_not_exhaust_the_stack() {
    let depth = 50_000;
    let mut text = String::from("HIERARCHY\nROOT j { OFFSET 0 1 0 CHANNELS 1 Zrotation\n");
    (0..depth).for_each(|j| text += &format!("JOINT j{j} {{ OFFSET 0 1 0 CHANNELS 0\n"));
    text += &"}".repeat(depth + 1);
    text += "\nMOTION\nFrames: 1\nFrame Time: 0.01\n0\n";
    let bvh = parse(&text).unwrap();
    let mut world = Vec::new();
    bvh.world_from_joint(0, &mut world);
    assert_eq!(world[depth].translation.y, depth as f32 + 1.0);
}

#[test]
fn cmu_files_are_read() {
    for (name, frames) in [("131_02", 1247), ("131_03", 1102)] {
        let Some(path) = data(&format!("motion/cmu_bvh/{name}.bvh")) else {
            return;
        };
        let bvh = Bvh::read(&path).unwrap();
        assert_eq!((bvh.len(), bvh.fps()), (frames, 120.0));
        assert_eq!(bvh.joints()[0].name, "Hips");
    }
}
