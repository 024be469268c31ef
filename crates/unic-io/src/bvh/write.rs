//! Writing BVH files.

use crate::{
    atomic::AtomicFile,
    error::{Error, Result},
};
use glam::{EulerRot, Vec3};
use std::{
    io::{self, Write},
    path::Path,
};
use unic_core::{Pose, clip::Clip, skeleton::Skeleton, transform::Rigid};

/// Units of the file in a metre. Readers of BVH take centimetres.
const CENTIMETRES: f32 = 100.0;
/// Length of the bone of a leaf joint, as a share of the bone that leads to it.
const END_SITE_SHARE: f32 = 0.5;

/// Writes a clip as a BVH file in centimetres, +Y up, atomically.
///
/// The zero pose of the file is that of the skeleton. The root has six channels, every other joint
/// three rotations in the order Z, X, Y. White space in names becomes `_`.
///
/// # Errors
/// The file cannot be written.
pub fn write_bvh(path: &Path, clip: &Clip, skeleton: &Skeleton) -> Result<()> {
    let mut file = AtomicFile::create(path)?;
    write(&mut file, clip, skeleton).map_err(Error::io(path, "write"))?;
    file.finish()
}

fn write(out: &mut impl Write, clip: &Clip, skeleton: &Skeleton) -> io::Result<()> {
    let mut order = Vec::new();
    // Places in the zero pose, which is not that of the body where the bind pose has rotations.
    let (zero, mut places) = (vec![Vec3::ZERO; skeleton.len()], Vec::new());
    skeleton.forward_kinematics(&Pose::from_axis_angles(Vec3::ZERO, &zero), &mut places);
    writeln!(out, "HIERARCHY")?;
    write_joint(out, (skeleton, &places), skeleton.root(), 0, &mut order)?;
    let frame_time = 1.0 / f64::from(clip.fps);
    writeln!(out, "MOTION\nFrames: {}\nFrame Time: {frame_time:.9}", clip.len())?;
    for pose in &clip.poses {
        let root = CENTIMETRES * (skeleton.joints()[skeleton.root()] + pose.trans);
        write!(out, "{:.5} {:.5} {:.5}", root.x, root.y, root.z)?;
        for &joint in &order {
            let (z, x, y) = pose.local[joint].to_euler(EulerRot::ZXY);
            for angle in [z, x, y] {
                write!(out, " {:.5}", angle.to_degrees())?;
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Writes a joint with all joints below it, and appends them to `order`.
fn write_joint(
    out: &mut impl Write,
    (skeleton, places): (&Skeleton, &[Rigid]),
    joint: usize,
    depth: usize,
    order: &mut Vec<usize>,
) -> io::Result<()> {
    order.push(joint);
    let indent = "  ".repeat(depth);
    let parent = skeleton.parents()[joint];
    let (keyword, channels) = match parent {
        None => (
            "ROOT",
            "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
        ),
        Some(_) => ("JOINT", "3 Zrotation Xrotation Yrotation"),
    };
    let name = skeleton.names()[joint].replace(char::is_whitespace, "_");
    writeln!(out, "{indent}{keyword} {name}\n{indent}{{")?;
    let start = parent.map_or(Vec3::ZERO, |parent| places[parent].translation);
    let offset = CENTIMETRES * (places[joint].translation - start);
    write_offset(out, &indent, offset)?;
    writeln!(out, "{indent}  CHANNELS {channels}")?;
    let children = (0..skeleton.len()).filter(|&child| skeleton.parents()[child] == Some(joint));
    let children: Vec<usize> = children.collect();
    for &child in &children {
        write_joint(out, (skeleton, places), child, depth + 1, order)?;
    }
    if children.is_empty() {
        writeln!(out, "{indent}  End Site\n{indent}  {{")?;
        write_offset(out, &format!("{indent}  "), END_SITE_SHARE * offset)?;
        writeln!(out, "{indent}  }}")?;
    }
    writeln!(out, "{indent}}}")
}

fn write_offset(out: &mut impl Write, indent: &str, offset: Vec3) -> io::Result<()> {
    writeln!(
        out,
        "{indent}  OFFSET {:.5} {:.5} {:.5}",
        offset.x, offset.y, offset.z
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Bvh;
    use unic_core::skeleton::SkeletonParts;

    #[test]
    fn joints_of_the_file_are_where_forward_kinematics_puts_them() {
        // The parent of the root's second child comes behind it in the order of the skeleton.
        let skeleton = Skeleton::new(SkeletonParts {
            names: ["pelvis", "toe L", "knee"].map(str::to_owned).to_vec(),
            parents: vec![-1, 2, 0],
            joints: vec![Vec3::Y, Vec3::new(0.1, 0.0, 0.2), Vec3::new(0.1, 0.5, 0.0)],
            // The body is modelled in another pose than the zero pose.
            rest_pose: vec![Vec3::ZERO, Vec3::Y * 0.3, Vec3::Z * 0.6],
        })
        .unwrap();
        let turns = [
            Vec3::new(0.3, -2.0, 0.5),
            Vec3::X * 0.2,
            Vec3::new(-1.0, 0.4, 1.1),
        ];
        let poses =
            [Vec3::ZERO, Vec3::new(1.0, -0.2, 3.0)].map(|trans| Pose::from_axis_angles(trans, &turns));
        let clip = Clip {
            name: "a".into(),
            fps: 30.0,
            poses: poses.to_vec(),
            ground_height: 0.0,
            wind: Vec::new(),
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bvh");
        write_bvh(&path, &clip, &skeleton).unwrap();
        let bvh = Bvh::read(&path).unwrap();
        assert_eq!((bvh.len(), bvh.fps()), (2, 30.0));
        let (mut found, mut expected) = (Vec::new(), Vec::new());
        for (frame, pose) in clip.poses.iter().enumerate() {
            bvh.world_from_joint(frame, &mut found);
            skeleton.forward_kinematics(pose, &mut expected);
            for (joint, name) in [(0, "pelvis"), (1, "knee"), (2, "toe_L")] {
                assert_eq!(bvh.joints()[joint].name, name);
                let own = skeleton.joint(&name.replace('_', " ")).unwrap();
                let off = found[joint].translation / CENTIMETRES - expected[own].translation;
                assert!(off.length() < 1e-6, "{name}: {off}");
                assert!(found[joint].rotation.dot(expected[own].rotation).abs() > 1.0 - 1e-6);
            }
        }
    }
}
