//! The arrays of a motion file, and the layouts that they come in.

use super::joints::{Joints, Order, Sources};
use crate::{
    character::positions,
    check::{self, Finding},
    error::{Error, Result},
    npy::{self, Array, Dim},
    npz::Npz,
};
use glam::Vec3;
use unic_core::{
    clip::Clip,
    skeleton::{Pose, SMPL_JOINT_NAMES},
};

pub(crate) const POSE_NAMES: [&str; 2] = ["poses", "pose"];
const FRAME_RATE_NAMES: [&str; 4] = ["mocap_framerate", "mocap_frame_rate", "fps", "framerate"];

/// Key of the air's velocity, m/s, world space, one a frame.
pub(crate) const WIND_NAME: &str = "wind";
/// Key of the ground's height in metres, when it is not 0.
pub(crate) const GROUND_HEIGHT_NAME: &str = "ground_height";

/// Joints of the SMPL family that carry the body: the rest are hands, jaw and eyes.
const BODY_JOINTS: usize = 22;

/// Longer rotations are seldom, radians.
const MORE_THAN_A_TURN: f32 = 6.4;

/// Which joints a frame of a motion file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseLayout {
    /// The character's own joints.
    Native,
    /// 72 numbers for SMPL's 24 joints and 3 for the translation.
    SmplWithTranslation,
    /// 52 joints: SMPL's first 22, then 30 of the fingers.
    SmplH,
    /// 55 joints: SMPL's first 22, then jaw, eyes and fingers.
    SmplX,
}

impl PoseLayout {
    /// The layout of frames of `numbers` numbers for a character of `joints` joints.
    pub(super) fn of(numbers: usize, joints: usize) -> Option<Self> {
        let smpl = joints == SMPL_JOINT_NAMES.len();
        match numbers {
            n if n > 0 && Some(n) == joints.checked_mul(3) => Some(Self::Native),
            75 if smpl => Some(Self::SmplWithTranslation),
            156 if smpl => Some(Self::SmplH),
            165 if smpl => Some(Self::SmplX),
            _ => None,
        }
    }

    /// Joints to take from a frame; the character's others do not turn.
    pub(super) fn joints_taken(self, joints: usize) -> usize {
        match self {
            Self::Native | Self::SmplWithTranslation => joints,
            Self::SmplH | Self::SmplX => BODY_JOINTS,
        }
    }

    fn note(self) -> Option<String> {
        let text = match self {
            Self::Native | Self::SmplWithTranslation => return None,
            Self::SmplH => "SMPL-H layout: 22 body joints taken, fingers left out, hands rigid",
            Self::SmplX => "SMPL-X layout: 22 body joints taken, jaw, eyes and fingers left out, hands rigid",
        };
        Some(text.into())
    }
}

/// Poses and frame rate as the file holds them, brought to the character's joints.
#[derive(Debug)]
pub(crate) struct MotionArrays {
    pub(crate) layout: PoseLayout,
    pub(crate) notes: Vec<String>,
    pub(crate) fps: f32,
    /// Probable mistakes in the numbers themselves.
    pub(crate) findings: Vec<Finding>,
    ground_height: f32,
    poses: Vec<Pose>,
    wind: Vec<Vec3>,
}

impl MotionArrays {
    pub(crate) fn read(npz: &mut Npz, joints: &Joints) -> Result<Self> {
        let name = npz.first_of(&POSE_NAMES).unwrap_or(POSE_NAMES[0]);
        let (numbers, dims) = frame_numbers(npz, name)?;
        let Order {
            sources,
            layout,
            note,
        } = Order::of(npz, name, numbers, joints)?;
        let fps = frame_rate(npz)?;
        let ground_height = ground_height(npz)?;
        let values = npz.finite::<f32>(name, &dims)?;
        check_frames(npz, name, &values)?;
        let mut notes: Vec<String> = layout.note().into_iter().chain(note).collect();
        let trans = translations(npz, &values, layout, &mut notes)?;
        let poses = (values.data.chunks_exact(numbers).zip(trans))
            .map(|(frame, trans)| pose(frame, trans, &sources))
            .collect::<Vec<_>>();
        let wind = match npz.contains(WIND_NAME) {
            true => positions(npz, WIND_NAME, Dim::Is(poses.len()))?,
            false => Vec::new(),
        };
        Ok(Self {
            layout,
            notes,
            findings: check::degrees(share_of_turns(&values, numbers))
                .into_iter()
                .collect(),
            fps,
            ground_height,
            poses,
            wind,
        })
    }

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

/// Numbers a frame of an array of shape (T, N) or (T, K, 3), and that shape.
fn frame_numbers(npz: &mut Npz, name: &str) -> Result<(usize, Vec<Dim>)> {
    let shape = npz.header(name)?.shape;
    match *shape.as_slice() {
        [_, numbers] => Ok((numbers, vec![Dim::Any("T"), Dim::Is(numbers)])),
        [_, joints, 3] => Ok((
            joints.saturating_mul(3),
            vec![Dim::Any("T"), Dim::Is(joints), Dim::Is(3)],
        )),
        _ => Err(npz.array_error(
            name,
            "shape (T, 3 J) or (T, J, 3)",
            format!("shape {}", npy::shape_text(&shape)),
        )),
    }
}

fn check_frames(npz: &Npz, name: &str, values: &Array<f32>) -> Result<()> {
    let frames = values.shape[0];
    if frames < 2 {
        return Err(npz.array_error(name, "at least two frames", frames.to_string()));
    }
    Ok(())
}

/// Part of the rotations that are longer than a turn; those of the root may be counted up over turns.
fn share_of_turns(values: &Array<f32>, numbers: usize) -> f32 {
    let frames = values.data.chunks_exact(numbers);
    let rotations = frames.flat_map(|frame| frame[..numbers.min(66)].chunks_exact(3).skip(1));
    let (mut turns, mut count) = (0, 0);
    for rotation in rotations {
        count += 1;
        turns += usize::from(Vec3::from_slice(rotation).length() > MORE_THAN_A_TURN);
    }
    turns as f32 / count.max(1) as f32
}

fn translations(
    npz: &mut Npz,
    values: &Array<f32>,
    layout: PoseLayout,
    notes: &mut Vec<String>,
) -> Result<Vec<Vec3>> {
    let frames = values.shape[0];
    if npz.contains("trans") {
        return positions(npz, "trans", Dim::Is(frames));
    }
    if layout == PoseLayout::SmplWithTranslation {
        notes.push("the last 3 of 75 numbers a frame are taken as the translation".into());
        let tails = values.data.chunks_exact(75).map(|f| Vec3::from_slice(&f[72..]));
        return Ok(tails.collect());
    }
    notes.push("no array `trans`: the root stays where the bind pose has it".into());
    Ok(vec![Vec3::ZERO; frames])
}

fn pose(frame: &[f32], trans: Vec3, sources: &Sources) -> Pose {
    let rotation = |joint: usize| match sources.of(joint) {
        Some(source) => Vec3::from_slice(&frame[3 * source..3 * source + 3]),
        None => Vec3::ZERO,
    };
    let axis_angles: Vec<Vec3> = (0..sources.len()).map(rotation).collect();
    Pose::from_axis_angles(trans, &axis_angles)
}

fn frame_rate(npz: &mut Npz) -> Result<f32> {
    let Some(name) = npz.first_of(&FRAME_RATE_NAMES) else {
        let names = npz.names().join(", ");
        let expected = "a frame rate (`mocap_framerate`, `mocap_frame_rate` or `fps`)";
        return Err(Error::content(npz.path(), expected, format!("only {names}")));
    };
    let fps = npz.number(name)?;
    check_frame_rate(fps).map_err(|found| npz.array_error(name, "a frame rate from 1 to 1000", found))?;
    Ok(fps as f32)
}

/// Rates outside would ask for absurd numbers of frames.
pub(crate) fn check_frame_rate(fps: f64) -> std::result::Result<(), String> {
    if (1.0..=1000.0).contains(&fps) {
        return Ok(());
    }
    Err(fps.to_string())
}

fn ground_height(npz: &mut Npz) -> Result<f32> {
    if npz.contains(GROUND_HEIGHT_NAME) {
        return npz.number(GROUND_HEIGHT_NAME).map(|h| h as f32);
    }
    Ok(0.0)
}
