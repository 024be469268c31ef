//! Writes the rig and the motion of the test in the engine, and where `unic-core` alone puts the
//! garment: `motion.json`, and `expected.bin` with three f32 a vertex and a frame.
//!
//! `cargo run --release --example expected -- MODEL FOLDER`

mod walk;

use std::{
    fmt::{Debug, Write},
    fs,
    path::Path,
    process::ExitCode,
    sync::Arc,
};
use unic_core::{Animator, Model, Pose, Start, transform::Rigid};

const FRAMES: usize = 100;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, folder] = arguments.as_slice() else {
        eprintln!("usage: expected MODEL FOLDER");
        return ExitCode::from(2);
    };
    match write(Path::new(model), Path::new(folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("expected: {error}");
            ExitCode::FAILURE
        }
    }
}

fn write(model: &Path, folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let model = Arc::new(Model::from_bytes(&fs::read(model)?)?);
    let mut animator = Animator::new(Arc::clone(&model));
    let mut positions: Vec<u8> = Vec::new();
    let mut poses = Vec::new();
    for tick in 0..FRAMES {
        let pose = walk::pose_at(&model, tick as f32);
        let input = walk::input(&pose);
        let frame = match tick {
            0 => animator.reset(&input, Start::MeanShape)?,
            _ => animator.step(&input)?,
        };
        let numbers = frame.positions.iter().flat_map(|p| p.to_array());
        positions.extend(numbers.flat_map(f32::to_le_bytes));
        poses.push(pose);
    }
    fs::create_dir_all(folder)?;
    fs::write(folder.join("expected.bin"), positions)?;
    fs::write(folder.join("motion.json"), json(&model, &poses)?)?;
    Ok(())
}

/// Rig and motion: transforms are a quaternion x, y, z, w and a place in metres, relative to the
/// parent. A frame has the place of the root and a rotation for each joint.
fn json(model: &Model, poses: &[Pose]) -> Result<String, std::fmt::Error> {
    let skeleton = &model.character().skeleton;
    let mut bind = Vec::new();
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind);
    let local = |(joint, parent): (usize, &Option<usize>)| {
        let local = match *parent {
            Some(parent) => bind[parent].inverse() * bind[joint],
            None => bind[joint],
        };
        numbers(&local)
    };
    let rests: Vec<[f32; 7]> = skeleton.parents().iter().enumerate().map(local).collect();
    let parents = skeleton.parents().iter();
    let parents: Vec<i64> = parents.map(|parent| parent.map_or(-1, |p| p as i64)).collect();
    let mut text = String::new();
    writeln!(text, "{{\"fps\": {:?},", model.config().fps)?;
    writeln!(text, "\"vertices\": {},", model.vertex_count())?;
    list(&mut text, "names", skeleton.names())?;
    list(&mut text, "parents", &parents)?;
    list(&mut text, "rests", &rests)?;
    let root = skeleton.joints()[skeleton.root()];
    let places: Vec<[f32; 3]> = poses.iter().map(|pose| (root + pose.trans).to_array()).collect();
    let rotations = |pose: &Pose| -> Vec<[f32; 4]> { pose.local.iter().map(|q| q.to_array()).collect() };
    let rotations: Vec<Vec<[f32; 4]>> = poses.iter().map(rotations).collect();
    list(&mut text, "places", &places)?;
    list(&mut text, "rotations", &rotations)?;
    writeln!(text, "\"frames\": {}}}", poses.len())?;
    Ok(text)
}

fn numbers(transform: &Rigid) -> [f32; 7] {
    let ([x, y, z, w], [a, b, c]) = (transform.rotation.to_array(), transform.translation.to_array());
    [x, y, z, w, a, b, c]
}

/// A line of the document. Lists, numbers and plain names are the same in Rust and JSON.
fn list<T: Debug>(text: &mut String, name: &str, values: &[T]) -> std::fmt::Result {
    writeln!(text, "\"{name}\": {values:?},")
}
