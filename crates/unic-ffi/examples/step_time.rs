//! Time of a step by the C interface, beside the Rust animator.
//!
//! ```sh
//! cargo run --release -p unic-ffi --example step_time -- MODEL.unic
//! ```
//!
//! It plays the same motion by both in turns, on one thread, and prints the median microseconds of
//! processor time of a step. The C interface converts the pose, writes to the caller's buffers and
//! records the tick for the display as well.

use cpu_time::ThreadTime;
use glam::{Quat, Vec3};
use std::{error::Error, ffi::CString, ptr::null_mut, sync::Arc};
use unic::*;
use unic_core::{Animator, Model, Pose, Start, StepInput, parallel::Serial};

const FRAMES: usize = 300;
/// Frames of the crowds.
const CROWD_FRAMES: usize = 30;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("expected an argument, MODEL.unic")?;
    let model = Arc::new(Model::from_bytes(&std::fs::read(&path)?)?);
    let mut animator = Animator::new(Arc::clone(&model));
    animator.set_threads(Arc::new(Serial));
    let instance = instances(&path, 1)?[0];
    let poses: Vec<Pose> = (0..FRAMES).map(|t| pose(&model, t)).collect();
    animator.reset(&input(&poses[0]), Start::MeanShape)?;
    let mut rows = vec![[0f32; 6]; model.vertex_count()];
    let (mut rust, mut c) = (Vec::new(), Vec::new());
    for pose in &poses {
        let start = ThreadTime::now();
        animator.step(&input(pose))?;
        rust.push(start.elapsed());
        let start = ThreadTime::now();
        step(instance, pose, &mut rows);
        c.push(start.elapsed());
    }
    assert!(
        rows.iter()
            .zip(animator.garment().positions)
            .all(|(row, p)| row[..3] == p.to_array())
    );
    for (name, times) in [("Rust", &mut rust), ("C", &mut c)] {
        times.sort();
        println!("{name}: {:.0} us a step", 1e6 * times[FRAMES / 2].as_secs_f64());
    }
    unic_instance_release(instance);
    crowds(&path, &poses, &mut rows)
}

/// Prints the time of a tick of several characters, one after the other on one thread, and their memory.
fn crowds(path: &str, poses: &[Pose], rows: &mut [[f32; 6]]) -> Result<(), Box<dyn Error>> {
    let before = resident_mib();
    for characters in [1, 16, 64] {
        let instances = instances(path, characters)?;
        let mut times = Vec::new();
        for pose in &poses[..CROWD_FRAMES] {
            let start = ThreadTime::now();
            instances.iter().for_each(|instance| step(*instance, pose, rows));
            times.push(start.elapsed());
        }
        times.sort();
        let ms = 1e3 * times[CROWD_FRAMES / 2].as_secs_f64();
        // Released memory stays with the process, so that only growth counts.
        let memory = match (before, resident_mib()) {
            (Some(before), Some(now)) => format!("{:.0} MiB more than before", now - before),
            _ => "memory not known".to_owned(),
        };
        println!("{characters} characters: {ms:.1} ms a tick, {memory}");
        for instance in instances {
            unic_instance_release(instance);
        }
    }
    Ok(())
}

/// Resident memory of the process, MiB, where the system tells it.
fn resident_mib() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

/// Instances of one model with the default options, on the calling thread.
fn instances(path: &str, count: usize) -> Result<Vec<*mut UnicInstance>, Box<dyn Error>> {
    let mut model = null_mut();
    let path = CString::new(path)?;
    let mut instances = vec![null_mut(); count];
    // SAFETY: a text and places for handles.
    unsafe {
        assert_eq!(unic_model_from_path(path.as_ptr(), &mut model), UnicStatus::Ok);
        for instance in &mut instances {
            let status = unic_instance_create(model, std::ptr::null(), instance);
            assert_eq!(status, UnicStatus::Ok);
        }
    }
    unic_model_release(model);
    Ok(instances)
}

/// A step into a vertex buffer of positions and normals.
fn step(instance: *const UnicInstance, pose: &Pose, rows: &mut [[f32; 6]]) {
    let pose = UnicPose {
        root: pose.trans.to_array(),
        root_kind: UnicRoot::Translation as u32,
        rotation_kind: UnicRotations::Local as u32,
        joint_count: pose.local.len() as u32,
        rotations: pose.local.as_ptr().cast(),
        rotation_stride: 0,
    };
    let input = UnicStepInput {
        size: size_of::<UnicStepInput>() as u32,
        ground_height: 0.0,
        wind: [0.0; 3],
        reserved: 0,
        pose: &pose,
        next_pose: std::ptr::null(),
    };
    let first: *mut f32 = rows.as_mut_ptr().cast();
    let vertices = UnicVertices {
        positions: first,
        position_stride: 24,
        normals: first.wrapping_add(3),
        normal_stride: 24,
        count: rows.len(),
    };
    // SAFETY: structs and buffers of their sizes.
    let status = unsafe { unic_instance_step(instance, &input, &vertices) };
    assert_eq!(status, UnicStatus::Ok);
}

/// A character that walks along a circle and swings its arms.
fn pose(model: &Model, frame: usize) -> Pose {
    let skeleton = &model.character().skeleton;
    let seconds = frame as f32 / model.config().fps;
    let mut pose = skeleton.bind_pose();
    pose.trans = Vec3::new(1.0 - seconds.cos(), 0.0, seconds.sin());
    pose.local[skeleton.root()] = Quat::from_rotation_y(seconds);
    for (name, swing) in [("L_shoulder", 0.3), ("R_shoulder", -0.3)] {
        if let Some(joint) = skeleton.joint(name) {
            pose.local[joint] = Quat::from_rotation_x(swing * (4.0 * seconds).sin());
        }
    }
    pose
}

fn input(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: Vec3::ZERO,
    }
}
