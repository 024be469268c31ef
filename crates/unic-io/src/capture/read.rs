//! Reading captures.

use super::{
    garment::{self, VertexAttributes, WeightsSource},
    layout,
    manifest::{Manifest, Split, check_clip_name},
};
use crate::{
    cache::frames_of,
    character::read_named_character,
    check::Finding,
    error::{Error, Result},
    formats::folder_that_is_no_capture,
    frames::{GarmentFrames, VertexFrames},
    motion::{Joints, MotionArrays, PoseLayout},
    npy,
    npz::Npz,
};
use std::path::{Path, PathBuf};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
};

/// An open capture: everything but the clips, which are read when asked for.
#[derive(Clone, Debug)]
pub struct Capture {
    /// The folder.
    pub root: PathBuf,
    /// What `capture.toml` says.
    pub manifest: Manifest,
    /// The body.
    pub character: Character,
    /// Rest shape and skinning weights.
    pub garment: Garment,
    /// Where the garment's weights come from.
    pub weights_source: WeightsSource,
    /// What else is known of the garment's vertices.
    pub attributes: VertexAttributes,
    /// Joints that touch the ground: L ankle, L foot, R ankle, R foot.
    pub contact_joints: [usize; 4],
}

/// One clip of a capture; everything has the same number of frames T ≥ 2.
#[derive(Clone, Debug)]
pub struct CapturedClip {
    /// The character's motion.
    pub clip: Clip,
    /// The garment's vertices.
    pub garment: GarmentFrames,
    /// The body's vertices, where they are not what skinning gives.
    pub body: Option<VertexFrames>,
    /// Probable mistakes in the numbers of the motion.
    pub findings: Vec<Finding>,
}

/// A clip's counts, from the headers of its files alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClipSummary {
    /// Frames of the motion.
    pub pose_frames: usize,
    /// Shape of the garment's array.
    pub garment_shape: Vec<usize>,
    /// Whether the garment lies in its own `.npy`.
    pub is_mapped: bool,
}

impl Capture {
    /// Opens the folder of a capture.
    ///
    /// # Errors
    /// Missing or damaged files, counts that contradict each other, splits that name clips which
    /// are not there.
    pub fn open(root: &Path) -> Result<Self> {
        let path = layout::manifest(root);
        if !path.exists() {
            let found = folder_that_is_no_capture(root);
            return Err(Error::content(
                root,
                "a capture (a folder with capture.toml)",
                found,
            ));
        }
        let manifest = Manifest::read(&path)?;
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

    /// Names of all clips on disk, sorted, whether a split names them or not.
    ///
    /// # Errors
    /// The folder cannot be listed.
    pub fn clips_on_disk(&self) -> Result<Vec<String>> {
        clips_on_disk(&self.root)
    }

    /// Reads a clip; its garment is mapped where it lies in its own `.npy`.
    ///
    /// Every position is checked to be finite, which reads a mapped garment once.
    ///
    /// # Errors
    /// No such clip, another number of joints or vertices, another frame rate than the manifest's,
    /// frames that do not match, fewer than two, numbers that are not finite.
    pub fn load_clip(&self, name: &str) -> Result<CapturedClip> {
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

    /// Counts of a clip without reading its frames.
    ///
    /// # Errors
    /// No such clip, headers that are damaged.
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
        let arrays = MotionArrays::read(npz, &Joints::Own(&self.character.skeleton))?;
        if arrays.layout != PoseLayout::Native {
            let expected = format!("3 x {} numbers a frame", self.character.skeleton.len());
            return Err(npz.array_error("poses", expected, format!("{:?}", arrays.layout)));
        }
        let fps = self.manifest.fps;
        // Stored as f32 or f64: the same rate may differ in the last digit.
        if (arrays.fps - fps).abs() > 1e-4 * fps {
            let expected = format!("the capture's {fps} frames per second");
            return Err(Error::content(npz.path(), expected, arrays.fps.to_string()));
        }
        if !npz.contains("trans") {
            return Err(Error::content(npz.path(), "an array `trans` (T, 3)", "none"));
        }
        let findings = arrays.findings.clone();
        Ok((arrays.into_clip(name.into()), findings))
    }

    fn read_garment(&self, npz: &mut Npz, name: &str, frames: usize) -> Result<GarmentFrames> {
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
    match found.first_not_finite() {
        None => Ok(found),
        Some((t, v)) => {
            let place = format!("{} at frame {t}, vertex {v}", found.frame(t)[v]);
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

pub(crate) fn clips_on_disk(root: &Path) -> Result<Vec<String>> {
    let folder = layout::clips(root);
    let entries = std::fs::read_dir(&folder).map_err(Error::io(&folder, "list"))?;
    let mut names = Vec::new();
    for entry in entries {
        let name = entry.map_err(Error::io(&folder, "list"))?.file_name();
        let name = name.to_string_lossy();
        if let Some(stem) = name.strip_suffix(".npz").filter(|s| !s.starts_with('.')) {
            names.push(stem.to_string());
        }
    }
    names.sort();
    Ok(names)
}
