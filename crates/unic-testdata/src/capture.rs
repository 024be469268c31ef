//! Figures and takes, and writing them as a capture.

use glam::Vec3;
use std::path::Path;
use tempfile::TempDir;
use unic_core::{
    Pose,
    character::{Character, Garment},
    clip::Clip,
};
use unic_io::{Capture, CaptureWriter, Manifest, Split, capture::JointReference};

/// A character with its garment.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Body and skeleton.
    pub character: Character,
    /// Garment on the body.
    pub garment: Garment,
    /// Indices of the left ankle and foot and the right ankle and foot.
    pub contact_joints: [usize; 4],
}

/// A motion with the positions of the garment.
#[derive(Clone, Debug)]
pub struct Take {
    /// Motion of the character.
    pub clip: Clip,
    /// World positions of the garment's vertices by frame, metres.
    pub garment: Vec<Vec<Vec3>>,
}

impl Figure {
    /// World positions of the garment's rest shape under linear blend skinning, by frame of a clip,
    /// metres.
    pub fn skinned(&self, clip: &Clip) -> Vec<Vec<Vec3>> {
        let skeleton = &self.character.skeleton;
        let frame = |pose: &Pose| {
            let (mut joints, mut transforms, mut positions) = (Vec::new(), Vec::new(), Vec::new());
            skeleton.forward_kinematics(pose, &mut joints);
            skeleton.world_from_rest(&joints, &mut transforms);
            let Garment { rest, weights, .. } = &self.garment;
            weights.skin(&rest.vertices, &transforms, &mut positions);
            positions
        };
        clip.poses.iter().map(frame).collect()
    }
}

/// Writes takes as a capture in the folder `root` and opens it. Its name is that of the folder.
///
/// # Panics
/// Panics if the capture cannot be written or read again.
pub fn write_capture(root: &Path, figure: &Figure, takes: &[(Take, Split)]) -> Capture {
    let name = root.file_name().unwrap().to_string_lossy();
    let fps = takes.first().map_or(crate::FPS, |(take, _)| take.clip.fps);
    let mut manifest = Manifest::new(name.as_ref(), fps);
    manifest.provenance = "made by a test".into();
    manifest.contact_joints = Some(figure.contact_joints.map(JointReference::Index));
    let Figure {
        character, garment, ..
    } = figure;
    let mut writer = CaptureWriter::create(root, manifest, character, garment, &Default::default()).unwrap();
    for (take, split) in takes {
        let mut out = writer.begin_clip(&take.clip, *split).unwrap();
        take.garment.iter().for_each(|frame| out.push(frame).unwrap());
        out.finish().unwrap();
    }
    writer.finish().unwrap();
    Capture::open(root).unwrap()
}

/// Writes takes as a capture in a temporary folder, which is removed when the first value is
/// dropped.
///
/// Clips of the open capture stay readable after that.
///
/// # Panics
/// Panics if the capture cannot be written or read again.
pub fn capture(figure: &Figure, takes: &[(Take, Split)]) -> (TempDir, Capture) {
    let folder = tempfile::tempdir().unwrap();
    let capture = write_capture(&folder.path().join("tube"), figure, takes);
    (folder, capture)
}
