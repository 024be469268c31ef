//! Reading captures.

use super::{
    folder::FolderKind,
    garment::{self, VertexAttributes, WeightsSource},
    layout,
    manifest::{Manifest, Split, check_clip_name},
};
use crate::{
    cache::frames_of,
    character::read_named_character,
    error::{Error, Result},
    finding::Finding,
    frames::{FrameVertex, GarmentFrames, VertexFrames},
    motion::{JointTarget, MotionArrays, PoseLayout},
    npy,
    npz::Npz,
};
use std::path::{Path, PathBuf};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
};

/// An open capture. All files are read except the clips, which are read on demand.
#[derive(Clone, Debug)]
pub struct Capture {
    /// Path of the folder.
    pub root: PathBuf,
    /// Content of `capture.toml`.
    pub manifest: Manifest,
    /// Body, skeleton and skinning weights.
    pub character: Character,
    /// Rest shape and skinning weights of the garment.
    pub garment: Garment,
    /// Origin of the garment's skinning weights.
    pub weights_source: WeightsSource,
    /// Optional attributes of the garment's vertices.
    pub attributes: VertexAttributes,
    /// Joints that touch the ground: L ankle, L foot, R ankle, R foot.
    pub contact_joints: [usize; 4],
}

/// One clip of a capture. Motion, garment and body have the same number of frames T ≥ 2.
#[derive(Clone, Debug)]
pub struct CapturedClip {
    /// Motion of the character.
    pub clip: Clip,
    /// Positions of the garment's vertices.
    pub garment: GarmentFrames,
    /// Positions of the body's vertices, if they differ from those of skinning.
    pub body: Option<VertexFrames>,
    /// Probable mistakes in the numbers of the motion.
    pub findings: Vec<Finding>,
}

/// Counts of a clip, read from the headers of its files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClipSummary {
    /// Number of frames of the motion.
    pub pose_frames: usize,
    /// Shape of the garment's array.
    pub garment_shape: Vec<usize>,
    /// `true` if the garment is in a `.npy` file of its own.
    pub is_mapped: bool,
}

impl Capture {
    /// Opens the folder of a capture.
    ///
    /// # Errors
    /// Missing or damaged files, counts that contradict each other, splits that name missing clips.
    pub fn open(root: &Path) -> Result<Self> {
        let path = layout::manifest(root);
        if !path.exists() {
            let found = FolderKind::of(root).description();
            return Err(Error::content(
                root,
                "a capture (a folder with capture.toml)",
                found,
            ));
        }
        let manifest = Manifest::read(&path)?;
        // A missing clip is reported here and not after hours of training.
        check_clips_exist(root, &path, &manifest)?;
        let names = manifest.joint_names.clone();
        let character = read_named_character(&layout::character(root), names)?;
        let contact_joints = manifest.contacts(&path, &character.skeleton)?;
        let read = garment::read(root, &character)?;
        Ok(Self {
            root: root.to_path_buf(),
            manifest,
            character,
            garment: read.garment,
            weights_source: read.weights_source,
            attributes: read.attributes,
            contact_joints,
        })
    }

    /// Names of the clips of one split, in the manifest's order.
    pub fn clip_names(&self, split: Split) -> &[String] {
        self.manifest.splits.of(split)
    }

    /// Lists the names of all clips on disk, sorted, including those that no split names.
    ///
    /// # Errors
    /// The folder cannot be listed.
    pub fn clips_on_disk(&self) -> Result<Vec<String>> {
        clips_on_disk(&self.root)
    }

    /// Reads a clip. A garment in a `.npy` file of its own is mapped.
    ///
    /// Every position is checked to be finite, which reads a mapped garment once.
    ///
    /// # Errors
    /// No such clip, another number of joints or vertices, another frame rate than the manifest's,
    /// different numbers of frames, fewer than two frames, numbers that are not finite.
    pub fn load_clip(&self, name: &str) -> Result<CapturedClip> {
        // The name comes from a caller and becomes part of a path.
        check_clip_name(&self.root, name)?;
        let path = layout::clip(&self.root, name);
        let mut npz = Npz::open(&path)?;
        let (clip, findings) = self.read_motion(&mut npz, name)?;
        let frames = clip.len();
        let garment = self.read_garment(&mut npz, name, frames)?;
        let body = match npz.contains("body") {
            true => {
                let body = frames_of(&mut npz, "body")?;
                let vertices = self.character.body.vertices.len();
                Some(checked(&path, "body", body, frames, vertices)?)
            }
            false => None,
        };
        Ok(CapturedClip {
            clip,
            garment,
            body,
            findings,
        })
    }

    /// Reads the counts of a clip without its frames.
    ///
    /// # Errors
    /// No such clip, damaged headers.
    pub fn summarise_clip(&self, name: &str) -> Result<ClipSummary> {
        check_clip_name(&self.root, name)?;
        let mut npz = Npz::open(&layout::clip(&self.root, name))?;
        let pose_frames = npz.header("poses")?.shape.first().copied().unwrap_or(0);
        let path = layout::clip_garment(&self.root, name);
        let is_mapped = path.exists();
        let header = if is_mapped {
            npy::read_npy_header(&path)?
        } else {
            npz.header("garment")?
        };
        Ok(ClipSummary {
            pose_frames,
            garment_shape: header.shape,
            is_mapped,
        })
    }

    fn read_motion(&self, npz: &mut Npz, name: &str) -> Result<(Clip, Vec<Finding>)> {
        let arrays = MotionArrays::read(npz, &JointTarget::Capture(&self.character.skeleton))?;
        // Other layouts leave joints out, which a motion file may do and a capture may not.
        if arrays.layout != PoseLayout::Native {
            let expected = format!("3 x {} numbers a frame", self.character.skeleton.len());
            return Err(npz.array_error("poses", expected, format!("{:?}", arrays.layout)));
        }
        let fps = self.manifest.fps;
        // Clips store the rate as f32 or f64, so that equal rates may differ in the last digit.
        if (arrays.fps - fps).abs() > 1e-4 * fps {
            let expected = format!("the capture's {fps} frames per second");
            return Err(Error::content(npz.path(), expected, arrays.fps.to_string()));
        }
        // Without a translation the garment could not be where the body is.
        if !npz.contains("trans") {
            return Err(Error::content(npz.path(), "an array `trans` (T, 3)", "none"));
        }
        let findings = arrays.findings.clone();
        Ok((arrays.into_clip(name.into()), findings))
    }

    fn read_garment(&self, npz: &mut Npz, name: &str, frames: usize) -> Result<GarmentFrames> {
        // The file of its own has precedence: writers of this crate make nothing else.
        let mapped = layout::clip_garment(&self.root, name);
        let vertices = self.garment.rest.vertices.len();
        if mapped.exists() {
            let garment = VertexFrames::open_npy(&mapped)?;
            return checked(&mapped, "garment", garment, frames, vertices);
        }
        if !npz.contains("garment") {
            let expected = format!("an array `garment`, or a file {name}.garment.npy beside it");
            return Err(Error::content(npz.path(), expected, "neither"));
        }
        let garment = frames_of(npz, "garment")?;
        checked(npz.path(), "garment", garment, frames, vertices)
    }
}

/// Checks that an array has these numbers of frames and vertices, and finite positions.
fn checked(
    path: &Path,
    array: &str,
    found: VertexFrames,
    frames: usize,
    vertices: usize,
) -> Result<VertexFrames> {
    let error = |expected: String, found: String| Error::Array {
        path: path.to_path_buf(),
        array: array.into(),
        expected,
        found,
    };
    if (found.len(), found.vertex_count()) != (frames, vertices) {
        return Err(error(
            format!("shape ({frames}, {vertices}, 3)"),
            format!("shape ({}, {}, 3)", found.len(), found.vertex_count()),
        ));
    }
    match found.first_non_finite() {
        None => Ok(found),
        Some(FrameVertex { frame, vertex }) => {
            let position = found.frame(frame)[vertex];
            let place = format!("{position} at frame {frame}, vertex {vertex}");
            Err(error("finite positions".into(), place))
        }
    }
}

fn check_clips_exist(root: &Path, path: &Path, manifest: &Manifest) -> Result<()> {
    let missing = |&(name, _): &(&str, Split)| !layout::clip(root, name).is_file();
    match manifest.splits.iter().find(missing) {
        None => Ok(()),
        Some((name, split)) => Err(Error::content(
            path,
            format!(
                "a file clips/{name}.npz for the clip that [splits] {} names",
                split.name()
            ),
            "none",
        )),
    }
}

/// Lists the names of all clips in a capture's folder, sorted.
fn clips_on_disk(root: &Path) -> Result<Vec<String>> {
    let folder = layout::clips(root);
    let entries = std::fs::read_dir(&folder).map_err(Error::io(&folder, "list"))?;
    let mut names = Vec::new();
    for entry in entries {
        let name = entry.map_err(Error::io(&folder, "list"))?.file_name();
        let name = name.to_string_lossy();
        // Names with a leading dot are temporary files.
        if let Some(stem) = name.strip_suffix(".npz").filter(|s| !s.starts_with('.')) {
            names.push(stem.to_string());
        }
    }
    names.sort();
    Ok(names)
}
