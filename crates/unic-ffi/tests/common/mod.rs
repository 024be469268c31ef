//! The shipped T-shirt, a motion for it, and the interface's structs filled for a test.

#![allow(dead_code, reason = "each test uses its own part")]

use glam::{Quat, Vec3};
use std::{
    ffi::{CStr, CString},
    mem::size_of,
    path::{Path, PathBuf},
    ptr::{null, null_mut},
    sync::Arc,
};
use unic::*;
use unic_core::{Animator, Model, Pose, Start, StepInput, TickInterpolator, config::StateConfig};

/// Garment that comes with the program.
pub(crate) fn garment_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../apps/unic-cli/garments/tshirt.unic")
}

/// The same garment in the Rust library.
pub(crate) fn core_model() -> Arc<Model> {
    Arc::new(Model::from_bytes(&std::fs::read(garment_path()).unwrap()).unwrap())
}

/// The same garment with a field that moves it: training has scaled that of the shipped one by 0, so
/// that neither precision nor sampling would change anything. Given displacements then do not stay.
pub(crate) fn lively_model() -> Arc<Model> {
    let mut parts = core_model().to_parts();
    let StateConfig::Displacement(displacement) = &mut parts.config.state else {
        panic!("expected a displacement from a prior")
    };
    displacement.excursion_m = None;
    let last = parts.field.last_mut().unwrap();
    let mut noise = 1u32;
    for weight in &mut last.weight {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *weight = (noise as f32 / u32::MAX as f32 - 0.5) * 0.5;
    }
    Arc::new(Model::new(parts).unwrap())
}

/// Text of the last error.
pub(crate) fn last_error() -> String {
    // SAFETY: a text that is never null.
    unsafe { CStr::from_ptr(unic_last_error()) }
        .to_str()
        .unwrap()
        .to_owned()
}

/// Asserts success.
#[track_caller]
pub(crate) fn ok(status: UnicStatus) {
    assert_eq!(status, UnicStatus::Ok, "{}", last_error());
}

/// Asserts a refusal whose text contains `text`.
#[track_caller]
pub(crate) fn refused(status: UnicStatus, expected: UnicStatus, text: &str) {
    assert_eq!(status, expected, "{}", last_error());
    assert!(last_error().contains(text), "{}", last_error());
}

/// A model that is released at the end.
pub(crate) struct ModelHandle(pub(crate) *mut UnicModel);

// SAFETY: a handle is a number, which all threads may use.
unsafe impl Sync for ModelHandle {}

impl ModelHandle {
    pub(crate) fn open() -> Self {
        let path = CString::new(garment_path().to_str().unwrap()).unwrap();
        let mut model = null_mut();
        // SAFETY: a text and a place for a handle.
        ok(unsafe { unic_model_from_path(path.as_ptr(), &mut model) });
        Self(model)
    }

    /// A model by the bytes of its file.
    pub(crate) fn of(model: &Model) -> Self {
        let bytes = model.to_bytes().unwrap();
        let mut handle = null_mut();
        // SAFETY: bytes of their length, a place for a handle.
        ok(unsafe { unic_model_from_bytes(bytes.as_ptr().cast(), bytes.len(), &mut handle) });
        Self(handle)
    }
}

impl Drop for ModelHandle {
    fn drop(&mut self) {
        ok(unic_model_release(self.0));
    }
}

/// An instance that is released at the end.
pub(crate) struct InstanceHandle(pub(crate) *mut UnicInstance);

// SAFETY: a handle is a number, which all threads may use.
unsafe impl Sync for InstanceHandle {}
// SAFETY: as above.
unsafe impl Send for InstanceHandle {}

impl InstanceHandle {
    pub(crate) fn new(model: &ModelHandle, change: impl FnOnce(&mut UnicOptions)) -> Self {
        let mut options = options();
        change(&mut options);
        let mut instance = null_mut();
        // SAFETY: structs of their sizes.
        ok(unsafe { unic_instance_create(model.0, &options, &mut instance) });
        Self(instance)
    }

    /// The handle. A closure that calls this takes the whole struct to its thread.
    pub(crate) fn raw(&self) -> *mut UnicInstance {
        self.0
    }

    /// Resets or steps the instance and returns positions and normals.
    pub(crate) fn play(&self, call: Call, input: &UnicStepInput, vertices: usize) -> [Vec<[f32; 3]>; 2] {
        let mut out = [vec![[0.0; 3]; vertices], vec![[0.0; 3]; vertices]];
        let to = buffers(&mut out);
        // SAFETY: structs of their sizes, buffers of `vertices` rows.
        ok(unsafe {
            match call {
                Call::Reset => unic_instance_reset(self.0, input, &to),
                Call::Step => unic_instance_step(self.0, input, &to),
            }
        });
        out
    }
}

impl Drop for InstanceHandle {
    fn drop(&mut self) {
        ok(unic_instance_release(self.0));
    }
}

#[derive(Clone, Copy)]
pub(crate) enum Call {
    Reset,
    Step,
}

/// Default options.
pub(crate) fn options() -> UnicOptions {
    let mut options = std::mem::MaybeUninit::uninit();
    // SAFETY: room for the struct, which is filled.
    unsafe {
        ok(unic_options_init(
            options.as_mut_ptr(),
            size_of::<UnicOptions>() as u32,
        ));
        options.assume_init()
    }
}

/// Buffers of positions and normals without gaps.
pub(crate) fn buffers([positions, normals]: &mut [Vec<[f32; 3]>; 2]) -> UnicVertices {
    UnicVertices {
        positions: positions.as_mut_ptr().cast(),
        position_stride: 0,
        normals: normals.as_mut_ptr().cast(),
        normal_stride: 0,
        count: positions.len(),
    }
}

/// Pose as the Rust library has it.
pub(crate) fn c_pose(pose: &Pose) -> UnicPose {
    UnicPose {
        root: pose.trans.to_array(),
        root_kind: UnicRoot::Translation as u32,
        rotation_kind: UnicRotations::Local as u32,
        joint_count: pose.local.len() as u32,
        rotations: pose.local.as_ptr().cast(),
        rotation_stride: size_of::<Quat>(),
    }
}

/// Input of a step without ground and wind.
pub(crate) fn c_input(pose: &UnicPose) -> UnicStepInput {
    UnicStepInput {
        size: size_of::<UnicStepInput>() as u32,
        ground_height: 0.0,
        wind: [0.0; 3],
        reserved: 0,
        pose,
        next_pose: null(),
    }
}

/// Input of the Rust library.
pub(crate) fn input(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: Vec3::ZERO,
    }
}

/// A character that walks along a circle and swings its arms and legs.
pub(crate) fn motion(model: &Model, frames: usize) -> Vec<Pose> {
    let skeleton = &model.character().skeleton;
    let pose = |t: usize| {
        let seconds = t as f32 / model.config().fps;
        let mut pose = skeleton.bind_pose();
        pose.trans = Vec3::new(1.0 - seconds.cos(), 0.02 * (9.0 * seconds).sin(), seconds.sin());
        pose.local[skeleton.root()] = Quat::from_rotation_y(seconds);
        for (name, swing) in [
            ("L_shoulder", 0.5),
            ("R_shoulder", -0.5),
            ("spine2", 0.2),
            ("L_hip", 0.4),
        ] {
            let joint = skeleton.joint(name).unwrap();
            pose.local[joint] *= Quat::from_rotation_x(swing * (5.0 * seconds).sin());
        }
        pose.local.iter_mut().for_each(|q| *q = q.normalize());
        pose
    };
    (0..frames).map(pose).collect()
}

/// Positions and normals of each frame of a motion by the Rust library.
pub(crate) fn core_frames(model: &Arc<Model>, poses: &[Pose]) -> Vec<[Vec<[f32; 3]>; 2]> {
    let mut animator = Animator::new(Arc::clone(model));
    animator.set_threads(Arc::new(unic_core::parallel::Serial));
    (poses.iter().enumerate())
        .map(|(t, pose)| {
            let shown = match t {
                0 => animator.reset(&input(pose), Start::MeanShape),
                _ => animator.step(&input(pose)),
            };
            let shown = shown.unwrap();
            [shown.positions, shown.normals].map(|v| v.iter().map(|p| p.to_array()).collect())
        })
        .collect()
}

/// Animator and display of the Rust library after a motion.
pub(crate) fn core_display(model: &Arc<Model>, poses: &[Pose]) -> (Animator, TickInterpolator) {
    let mut animator = Animator::new(Arc::clone(model));
    let mut display = TickInterpolator::default();
    for (t, pose) in poses.iter().enumerate() {
        match t {
            0 => {
                animator.reset(&input(pose), Start::MeanShape).unwrap();
                display.cut(&animator);
            }
            _ => {
                animator.step(&input(pose)).unwrap();
                display.tick(&animator);
            }
        }
    }
    (animator, display)
}

/// Plays a motion by the C interface.
pub(crate) fn c_frames(
    instance: &InstanceHandle,
    poses: &[Pose],
    vertices: usize,
) -> Vec<[Vec<[f32; 3]>; 2]> {
    (poses.iter().enumerate())
        .map(|(t, pose)| {
            let pose = c_pose(pose);
            let call = if t == 0 { Call::Reset } else { Call::Step };
            instance.play(call, &c_input(&pose), vertices)
        })
        .collect()
}
