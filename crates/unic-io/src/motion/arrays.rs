//! Reading the arrays of a motion npz.

use super::{
    joints::{JointMapping, JointSources, JointTarget},
    layout::PoseLayout,
    plausibility::degrees,
};
use crate::{
    error::{Error, Result},
    finding::Finding,
    frame_rate::check_frame_rate,
    npy::{self, Array, Dim},
    npz::Npz,
};
use glam::Vec3;
use unic_core::{Pose, clip::Clip};

/// Names of the array of rotations.
pub(crate) const POSE_NAMES: [&str; 2] = ["poses", "pose"];
/// Names of the frame rate.
const FRAME_RATE_NAMES: [&str; 4] = ["mocap_framerate", "mocap_frame_rate", "fps", "framerate"];

/// Name of the array of air velocities: one vector for each frame, m/s, world space.
pub(crate) const WIND_NAME: &str = "wind";
/// Name of the ground's height in metres; 0 without it.
pub(crate) const GROUND_HEIGHT_NAME: &str = "ground_height";

/// Length of a rotation vector that counts as longer than a whole turn, radians: 2 π = 6.283 with a
/// margin for rounding.
const WHOLE_TURN: f32 = 6.4;

/// Number of leading values of a frame whose rotations are checked for degrees: the 22 body joints
/// that all layouts share.
const CHECKED_VALUES: usize = 66;

/// Poses and frame rate of a file, converted to the character's joints.
#[derive(Debug)]
pub(crate) struct MotionArrays {
    pub(crate) layout: PoseLayout,
    pub(crate) notes: Vec<String>,
    pub(crate) fps: f32,
    /// Probable mistakes in the numbers of the file.
    pub(crate) findings: Vec<Finding>,
    /// Height of the ground, metres.
    ground_height: f32,
    poses: Vec<Pose>,
    wind: Vec<Vec3>,
}

impl MotionArrays {
    /// Reads the arrays for the given joints.
    ///
    /// # Errors
    /// Missing arrays, another number of joints, joint names that do not fit, fewer than two
    /// frames, numbers that are not finite, a frame rate outside 1 to 1000.
    pub(crate) fn read(npz: &mut Npz, joints: &JointTarget) -> Result<Self> {
        Self::read_at(npz, joints, None)
    }

    /// Reads the arrays for the given joints. A file without a frame rate has `fps_of_file`.
    ///
    /// # Errors
    /// Those of [`read`](Self::read).
    pub(crate) fn read_at(npz: &mut Npz, joints: &JointTarget, fps_of_file: Option<f32>) -> Result<Self> {
        let name = npz.first_present(&POSE_NAMES).unwrap_or(POSE_NAMES[0]);
        let PoseShape { numbers, dims } = PoseShape::read(npz, name)?;
        let JointMapping {
            sources,
            layout,
            note,
        } = JointMapping::new(npz, name, numbers, joints)?;
        // Headers, names and the frame rate are checked before the poses, the largest array, are
        // read.
        let FrameRate { fps, note: fps_note } = FrameRate::read(npz, fps_of_file)?;
        let ground_height = ground_height(npz)?;
        let values = npz.finite::<f32>(name, &dims)?;
        check_frames(npz, name, &values)?;
        let mut notes: Vec<String> = (layout.note().into_iter()).chain(note).chain(fps_note).collect();
        // A translation of its own has precedence over one among the poses.
        let trans = translations(npz, &values, layout, &mut notes)?;
        let poses = (values.data.chunks_exact(numbers).zip(trans))
            .map(|(frame, trans)| pose(frame, trans, &sources))
            .collect::<Vec<_>>();
        let wind = match npz.contains(WIND_NAME) {
            true => npz.vectors(WIND_NAME, Dim::Is(poses.len()))?,
            false => Vec::new(),
        };
        Ok(Self {
            layout,
            notes,
            findings: degrees(share_of_turns(&values, numbers)).into_iter().collect(),
            fps,
            ground_height,
            poses,
            wind,
        })
    }

    /// Makes a clip of this name.
    pub(crate) fn into_clip(self, name: String) -> Clip {
        Clip {
            name,
            fps: self.fps,
            poses: self.poses,
            ground_height: self.ground_height,
            wind: self.wind,
        }
    }
}

/// Returns the number of rotation values in a frame of a file.
///
/// # Errors
/// No array of rotations, or one of another shape.
pub(super) fn numbers_a_frame(npz: &mut Npz) -> Result<usize> {
    let name = npz.first_present(&POSE_NAMES).unwrap_or(POSE_NAMES[0]);
    Ok(PoseShape::read(npz, name)?.numbers)
}

/// Shape of an array of rotations: (T, N) or (T, K, 3).
struct PoseShape {
    /// Number of values in a frame: N or 3 K.
    numbers: usize,
    /// Dimensions to read the array with.
    dims: Vec<Dim>,
}

impl PoseShape {
    fn read(npz: &mut Npz, name: &str) -> Result<Self> {
        let shape = npz.header(name)?.shape;
        match *shape.as_slice() {
            [_, numbers] => Ok(Self {
                numbers,
                dims: vec![Dim::Any("T"), Dim::Is(numbers)],
            }),
            [_, joints, 3] => Ok(Self {
                numbers: joints.saturating_mul(3),
                dims: vec![Dim::Any("T"), Dim::Is(joints), Dim::Is(3)],
            }),
            _ => Err(npz.array_error(
                name,
                "shape (T, 3 J) or (T, J, 3)",
                format!("shape {}", npy::shape_text(&shape)),
            )),
        }
    }
}

fn check_frames(npz: &Npz, name: &str, values: &Array<f32>) -> Result<()> {
    let frames = values.shape[0];
    if frames < 2 {
        return Err(npz.array_error(name, "at least two frames", frames.to_string()));
    }
    Ok(())
}

/// Returns the share of rotation vectors that are longer than a whole turn.
///
/// The root is left out: its rotations may accumulate over turns.
fn share_of_turns(values: &Array<f32>, numbers: usize) -> f32 {
    let frames = values.data.chunks_exact(numbers);
    let rotations = frames.flat_map(|frame| frame[..numbers.min(CHECKED_VALUES)].chunks_exact(3).skip(1));
    let (mut turns, mut count) = (0, 0);
    for rotation in rotations {
        count += 1;
        turns += usize::from(Vec3::from_slice(rotation).length() > WHOLE_TURN);
    }
    turns as f32 / count.max(1) as f32
}

/// Reads the translations, which may be part of the poses or missing.
fn translations(
    npz: &mut Npz,
    values: &Array<f32>,
    layout: PoseLayout,
    notes: &mut Vec<String>,
) -> Result<Vec<Vec3>> {
    let frames = values.shape[0];
    if npz.contains("trans") {
        return npz.vectors("trans", Dim::Is(frames));
    }
    if layout == PoseLayout::SmplWithTranslation {
        notes.push("the last 3 of 75 numbers a frame are taken as the translation".into());
        // Behind 72 rotation values.
        let tails = values.data.chunks_exact(75).map(|f| Vec3::from_slice(&f[72..]));
        return Ok(tails.collect());
    }
    notes.push("no array `trans`: the root stays where the bind pose has it".into());
    Ok(vec![Vec3::ZERO; frames])
}

/// Makes the pose of one frame; joints without a source keep their bind rotation.
fn pose(frame: &[f32], trans: Vec3, sources: &JointSources) -> Pose {
    let rotation = |joint: usize| match sources.of(joint) {
        Some(source) => Vec3::from_slice(&frame[3 * source..3 * source + 3]),
        None => Vec3::ZERO,
    };
    let axis_angles: Vec<Vec3> = (0..sources.len()).map(rotation).collect();
    Pose::from_axis_angles(trans, &axis_angles)
}

/// Frames per second of a file.
struct FrameRate {
    fps: f32,
    /// Statement about a rate that the file does not state.
    note: Option<String>,
}

impl FrameRate {
    fn read(npz: &mut Npz, fps_of_file: Option<f32>) -> Result<Self> {
        let Some(name) = npz.first_present(&FRAME_RATE_NAMES) else {
            return Self::assumed(npz, fps_of_file);
        };
        let fps = npz.number(name)?;
        check_frame_rate(fps).map_err(|found| npz.array_error(name, "a frame rate from 1 to 1000", found))?;
        Ok(Self {
            fps: fps as f32,
            note: None,
        })
    }

    fn assumed(npz: &Npz, fps: Option<f32>) -> Result<Self> {
        let Some(fps) = fps.filter(|fps| check_frame_rate(f64::from(*fps)).is_ok()) else {
            let names = npz.names().join(", ");
            let expected = "a frame rate (`mocap_framerate`, `mocap_frame_rate` or `fps`)";
            return Err(Error::content(npz.path(), expected, format!("only {names}")));
        };
        Ok(Self {
            fps,
            note: Some(format!("no frame rate in the file: {fps} fps are taken")),
        })
    }
}

fn ground_height(npz: &mut Npz) -> Result<f32> {
    if npz.contains(GROUND_HEIGHT_NAME) {
        return npz.number(GROUND_HEIGHT_NAME).map(|h| h as f32);
    }
    Ok(0.0)
}
