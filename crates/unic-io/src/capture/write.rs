//! Writing captures.

use super::{
    garment::{self, VertexAttributes},
    layout,
    manifest::{JointReference, Manifest, Split, Splits, check_clip_name},
};
use crate::{
    character::write_character,
    error::{Error, Result},
    frames::VertexFramesWriter,
    motion::{self, JointTarget, MotionArrays},
    npy::{read_npy_header, shape_text},
    npz::{Npz, NpzWriter},
};
use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::{
    Pose,
    character::{Character, Garment},
    clip::Clip,
    skeleton::Skeleton,
};

/// Writer of a capture. `capture.toml` is written last: a folder without it is not a capture.
#[derive(Debug)]
pub struct CaptureWriter {
    root: PathBuf,
    manifest: Manifest,
    skeleton: Skeleton,
    vertices: usize,
}

impl CaptureWriter {
    /// Starts a capture: writes the character and the garment.
    ///
    /// The writer fills in the manifest's splits and joint names, and checks its contact joints.
    ///
    /// # Errors
    /// A folder that holds a capture or cannot be written to; contact joints that the character
    /// does not have.
    pub fn create(
        root: &Path,
        manifest: Manifest,
        character: &Character,
        garment: &Garment,
        attributes: &VertexAttributes,
    ) -> Result<Self> {
        let path = layout::manifest(root);
        if path.exists() {
            return Err(Error::content(
                root,
                "a folder without a capture",
                "capture.toml in it",
            ));
        }
        // Checked before anything is written.
        let manifest = completed(manifest, &path, &character.skeleton)?;
        write_character(&layout::character(root), character)?;
        garment::write(root, garment, attributes)?;
        Ok(Self {
            root: root.to_path_buf(),
            manifest,
            skeleton: character.skeleton.clone(),
            vertices: garment.rest.vertices.len(),
        })
    }

    /// Starts a clip, whose garment frames are then pushed one by one. Several clips may be written
    /// at the same time.
    ///
    /// # Errors
    /// A name that is taken or no file name, another frame rate or number of joints than the
    /// capture's, fewer than two frames, wind for another number of frames.
    pub fn begin_clip(&mut self, clip: &Clip, split: Split) -> Result<ClipWriter> {
        self.check(clip)?;
        let path = layout::clip_garment(&self.root, &clip.name);
        let frames = VertexFramesWriter::create(&path, self.vertices)?;
        self.manifest.splits.of_mut(split).push(clip.name.clone());
        Ok(ClipWriter {
            path: layout::clip(&self.root, &clip.name),
            clip: clip.clone(),
            // Clips carry names, so that they are motion files for other characters as well.
            joint_names: self.skeleton.names().to_vec(),
            frames,
        })
    }

    /// Adds a clip that an earlier writer has finished in this folder, so that interrupted work can
    /// be resumed. Returns `false` if there is no such clip.
    ///
    /// # Errors
    /// A finished clip of another motion or garment; those of [`CaptureWriter::begin_clip`].
    pub fn keep_clip(&mut self, clip: &Clip, split: Split) -> Result<bool> {
        // A clip's motion is written after its garment: if it exists, both are complete.
        let path = layout::clip(&self.root, &clip.name);
        if !path.is_file() {
            return Ok(false);
        }
        self.check(clip)?;
        let mut npz = Npz::open(&path)?;
        let kept =
            MotionArrays::read(&mut npz, &JointTarget::Capture(&self.skeleton))?.into_clip(clip.name.clone());
        // The header is enough: the file was renamed only after all frames were synced.
        let garment = read_npy_header(&layout::clip_garment(&self.root, &clip.name))?.shape;
        let expected = [clip.len(), self.vertices, 3];
        if garment != expected {
            let expected = format!("a garment of shape {}", shape_text(&expected));
            return Err(Error::content(&path, expected, shape_text(&garment)));
        }
        if !is_same_motion(&kept, clip) {
            return Err(Error::content(&path, "the motion that is asked for", "another"));
        }
        self.manifest.splits.of_mut(split).push(clip.name.clone());
        Ok(true)
    }

    /// Sorts the clips of each split in the order of `names`; clips that are not named come last.
    ///
    /// Clips that are written at the same time are added in a random order.
    pub fn order_clips<'a>(&mut self, names: impl IntoIterator<Item = &'a str>) {
        let names: Vec<&str> = names.into_iter().collect();
        let rank = |clip: &String| names.iter().position(|name| name == clip).unwrap_or(names.len());
        for split in Split::ALL {
            self.manifest.splits.of_mut(split).sort_by_key(rank);
        }
    }

    /// Writes `capture.toml`.
    ///
    /// # Errors
    /// A clip that is not finished; the file cannot be written.
    pub fn finish(self) -> Result<()> {
        for (name, _) in self.manifest.splits.iter() {
            let path = layout::clip(&self.root, name);
            if !path.is_file() {
                return Err(Error::content(&path, "a finished clip", "none"));
            }
        }
        self.manifest.write(&layout::manifest(&self.root))
    }

    /// Checks that a clip fits the capture.
    fn check(&self, clip: &Clip) -> Result<()> {
        check_clip_name(&self.root, &clip.name)?;
        let path = layout::clip(&self.root, &clip.name);
        // Every fault is reported before the first frame, because a simulation of hours may follow.
        let error = |expected: String, found: String| Err(Error::content(&path, expected, found));
        if self.manifest.splits.split_of(&clip.name).is_some() {
            return error("a new name".into(), format!("a second clip `{}`", clip.name));
        }
        // Exactly equal: resampling is the caller's decision.
        if clip.fps != self.manifest.fps {
            return error(
                format!("{} frames per second", self.manifest.fps),
                clip.fps.to_string(),
            );
        }
        if clip.len() < 2 {
            return error("at least two frames".into(), clip.len().to_string());
        }
        if let Some(pose) = clip.poses.iter().find(|p| p.local.len() != self.skeleton.len()) {
            return error(
                format!("{} joints", self.skeleton.len()),
                pose.local.len().to_string(),
            );
        }
        match clip.wind.len() {
            found if found > 0 && found != clip.len() => {
                error(format!("wind for {} frames", clip.len()), found.to_string())
            }
            _ => Ok(()),
        }
    }
}

/// Largest distance of translations (metres) and winds (m/s) of the same motion.
const SAME_VECTOR: f32 = 1e-5;
/// Largest angle between rotations of the same motion, radians. They are stored as rotation
/// vectors, and the arc cosine of the angle between nearly equal f32 quaternions is rounded to
/// about 1e-3.
const SAME_ANGLE: f32 = 2e-3;

/// Returns whether two clips have the same motion, up to the rounding of the stored form.
fn is_same_motion(kept: &Clip, clip: &Clip) -> bool {
    let close = |(a, b): (&Pose, &Pose)| {
        let turned = a.local.iter().zip(&b.local).map(|(a, b)| a.angle_between(*b));
        a.trans.distance(b.trans) < SAME_VECTOR && turned.fold(0.0, f32::max) < SAME_ANGLE
    };
    let is_same_wind = |t: usize| kept.wind_at(t).distance(clip.wind_at(t)) < SAME_VECTOR;
    kept.len() == clip.len()
        && kept.poses.iter().zip(&clip.poses).all(close)
        && (0..clip.len()).all(is_same_wind)
}

/// Fills in joint names and contact joints, and empties the splits.
fn completed(mut manifest: Manifest, path: &Path, skeleton: &Skeleton) -> Result<Manifest> {
    // Stored explicitly: names that a reader would find today may be found differently by a later
    // version.
    manifest.joint_names = skeleton.names().to_vec();
    let contacts = manifest.contacts(path, skeleton)?;
    manifest.contact_joints = Some(contacts.map(JointReference::Index));
    manifest.splits = Splits::default();
    Ok(manifest)
}

/// Writer of one clip of a capture.
#[derive(Debug)]
pub struct ClipWriter {
    path: PathBuf,
    clip: Clip,
    joint_names: Vec<String>,
    frames: VertexFramesWriter,
}

impl ClipWriter {
    /// Adds the garment of the next frame, metres, world space.
    ///
    /// # Errors
    /// Another number of vertices, positions that are not finite; the file cannot be written.
    pub fn push(&mut self, garment: &[Vec3]) -> Result<()> {
        if let Some(vertex) = garment.iter().position(|v| !v.is_finite()) {
            let found = format!(
                "vertex {vertex} at {} in frame {}",
                garment[vertex],
                self.frames.len()
            );
            return Err(Error::content(&self.path, "finite positions", found));
        }
        self.frames.push(garment)
    }

    /// Completes the clip.
    ///
    /// # Errors
    /// More or fewer frames than the clip has; the files cannot be written.
    pub fn finish(self) -> Result<()> {
        let frames = self.clip.len();
        if self.frames.len() != frames {
            let expected = format!("{frames} garment frames");
            return Err(Error::content(
                &self.path,
                expected,
                self.frames.len().to_string(),
            ));
        }
        // The motion comes after the garment: its file marks a complete clip.
        self.frames.finish()?;
        let mut npz = NpzWriter::create(&self.path)?;
        motion::write_arrays(&mut npz, &self.clip, &self.joint_names)?;
        npz.finish()
    }
}
