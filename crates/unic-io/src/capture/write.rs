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
    motion::{self, Joints, MotionArrays},
    npy::{read_npy_header, shape_text},
    npz::{Npz, NpzWriter},
};
use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
    skeleton::{Pose, Skeleton},
};

/// A capture being written. `capture.toml` comes last: a folder without it is not a capture.
#[derive(Debug)]
pub struct CaptureWriter {
    root: PathBuf,
    manifest: Manifest,
    skeleton: Skeleton,
    vertices: usize,
}

impl CaptureWriter {
    /// Starts a capture: writes the character and the garment. The manifest's splits and joint
    /// names are filled in by the writer; its contact joints are checked.
    ///
    /// # Errors
    /// The folder holds a capture already or cannot be written to; a manifest that could not be
    /// read again.
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

    /// Starts a clip; its garment frames are then pushed one by one. Several clips may be written
    /// at the same time.
    ///
    /// # Errors
    /// A name that is taken or no file name, another frame rate or number of joints than the
    /// capture's, fewer than two frames, wind for another number of them.
    pub fn begin_clip(&mut self, clip: &Clip, split: Split) -> Result<ClipWriter> {
        self.check(clip)?;
        let path = layout::clip_garment(&self.root, &clip.name);
        let frames = VertexFramesWriter::create(&path, self.vertices)?;
        self.manifest.splits.of_mut(split).push(clip.name.clone());
        Ok(ClipWriter {
            path: layout::clip(&self.root, &clip.name),
            clip: clip.clone(),
            joint_names: self.skeleton.names().to_vec(),
            frames,
        })
    }

    /// Takes a clip that an earlier writer finished in this folder, as work that goes on after an
    /// interruption does; false where there is none.
    ///
    /// # Errors
    /// As [`CaptureWriter::begin_clip`]; a clip of another length or garment.
    pub fn keep_clip(&mut self, clip: &Clip, split: Split) -> Result<bool> {
        // A clip's motion is written after its garment: where it is, both are whole.
        let path = layout::clip(&self.root, &clip.name);
        if !path.is_file() {
            return Ok(false);
        }
        self.check(clip)?;
        let mut npz = Npz::open(&path)?;
        let kept = MotionArrays::read(&mut npz, &Joints::Own(&self.skeleton))?.into_clip(clip.name.clone());
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

    /// Lists the clips of each split in the order of `names`, whatever the order in which they were
    /// begun or kept; clips that are not named come last.
    pub fn order_clips<'a>(&mut self, names: impl IntoIterator<Item = &'a str>) {
        let names: Vec<&str> = names.into_iter().collect();
        let place = |clip: &String| names.iter().position(|name| name == clip).unwrap_or(names.len());
        for split in Split::ALL {
            self.manifest.splits.of_mut(split).sort_by_key(place);
        }
    }

    /// Writes `capture.toml`.
    ///
    /// # Errors
    /// A clip that was begun and not finished; the file cannot be written.
    pub fn finish(self) -> Result<()> {
        for (name, _) in self.manifest.splits.iter() {
            let path = layout::clip(&self.root, name);
            if !path.is_file() {
                return Err(Error::content(&path, "a finished clip", "none"));
            }
        }
        self.manifest.write(&layout::manifest(&self.root))
    }

    fn check(&self, clip: &Clip) -> Result<()> {
        check_clip_name(&self.root, &clip.name)?;
        let path = layout::clip(&self.root, &clip.name);
        let error = |expected: String, found: String| Err(Error::content(&path, expected, found));
        if self.manifest.splits.split_of(&clip.name).is_some() {
            return error("a new name".into(), format!("a second clip `{}`", clip.name));
        }
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

/// Up to what rotations lose on their way through axis-angle vectors.
fn is_same_motion(kept: &Clip, clip: &Clip) -> bool {
    let close = |(a, b): (&Pose, &Pose)| {
        let turned = a.local.iter().zip(&b.local).map(|(a, b)| a.angle_between(*b));
        a.trans.distance(b.trans) < 1e-5 && turned.fold(0.0, f32::max) < 2e-3
    };
    let is_same_air = |t: usize| kept.wind_at(t).distance(clip.wind_at(t)) < 1e-5;
    kept.len() == clip.len()
        && kept.poses.iter().zip(&clip.poses).all(close)
        && (0..clip.len()).all(is_same_air)
}

fn completed(mut manifest: Manifest, path: &Path, skeleton: &Skeleton) -> Result<Manifest> {
    manifest.joint_names = skeleton.names().to_vec();
    let contacts = manifest.contacts(path, skeleton)?;
    manifest.contact_joints = Some(contacts.map(JointReference::Index));
    manifest.splits = Splits::default();
    Ok(manifest)
}

/// One clip being written.
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
        self.frames.finish()?;
        let mut npz = NpzWriter::create(&self.path)?;
        motion::write_arrays(&mut npz, &self.clip, &self.joint_names)?;
        npz.finish()
    }
}
