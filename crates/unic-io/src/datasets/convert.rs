//! Converting the folder of a data set to a capture.

use super::{
    Dataset, FPS,
    fit::{CoordinateFrame, nearest, nearest_to_bind_pose, unposed},
    sequence::{GarmentSequence, files},
    virtual_bones, vto,
};
use crate::{
    capture::{CaptureWriter, Manifest, Split, default_weights},
    error::{Error, Result},
};
use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::{
    character::{Character, Garment},
    mesh::TriMesh,
};

/// Number of sequences, sorted by name, of which one is a test clip. The data sets define no split.
const TEST_EVERY: usize = 5;

/// Result of a conversion.
#[derive(Clone, Debug)]
pub struct Converted {
    /// Number of clips in the capture.
    pub clips: usize,
    /// Descriptions of the converter's decisions, one sentence each.
    pub notes: Vec<String>,
}

/// Converts the data set in `folder` to the capture `out`. The character must have the data set's
/// body and skeleton.
///
/// The rest shape is the data set's template. A data set without one uses the frame nearest to the
/// bind pose, transformed to that pose with the weights of the nearest body vertices. Every fifth
/// sequence by name is a test clip.
///
/// # Errors
/// No sequences, files of another layout, a garment that is not on the character, a folder that
/// cannot be written.
pub fn convert(dataset: Dataset, folder: &Path, character: &Character, out: &Path) -> Result<Converted> {
    let mut notes = Vec::new();
    let files = of_one_body(dataset, files(dataset, folder)?, &mut notes);
    let garment = garment(dataset, folder, &files, character, &mut notes)?;
    // `files` returned at least one. All sequences of a release have one coordinate frame, so that
    // the first one decides.
    let frame = frame(dataset, &files[0], character, &garment)?;
    notes.push(format!("positions are taken as {}", frame.name()));
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let mut manifest = Manifest::new(name, FPS);
    manifest.provenance = dataset.provenance().into();
    let mut writer = CaptureWriter::create(out, manifest, character, &garment, &Default::default())?;
    for (i, path) in files.iter().enumerate() {
        let sequence = GarmentSequence::read(dataset, path, character)?;
        check_vertices(path, &sequence, &garment)?;
        write(&mut writer, &sequence, split(i, files.len()), frame, character)?;
    }
    writer.finish()?;
    notes.push(format!("every {TEST_EVERY}th sequence by name is to test on"));
    let clips = files.len();
    Ok(Converted { clips, notes })
}

/// Returns the split of a sequence: every fifth is a test clip; of fewer than five, the last one
/// is.
fn split(index: usize, count: usize) -> Split {
    let is_last_of_few = count < TEST_EVERY && index + 1 == count;
    match index % TEST_EVERY == TEST_EVERY - 1 || is_last_of_few {
        true => Split::Test,
        false => Split::Train,
    }
}

/// Makes the garment: its rest shape and default skinning weights.
fn garment(
    dataset: Dataset,
    folder: &Path,
    files: &[PathBuf],
    character: &Character,
    notes: &mut Vec<String>,
) -> Result<Garment> {
    let rest = match dataset {
        Dataset::Vto => rest_from_frames(files, character, notes)?,
        Dataset::VirtualBones => virtual_bones::template(folder, character)?,
    };
    // The data sets have no skinning weights for a given character's skeleton.
    let weights = default_weights(&rest, character).map_err(|source| Error::Weights {
        path: folder.to_owned(),
        source,
    })?;
    Ok(Garment::new(rest, weights))
}

/// Determines the coordinate frame of a data set's positions from its first sequence.
fn frame(
    dataset: Dataset,
    first: &Path,
    character: &Character,
    garment: &Garment,
) -> Result<CoordinateFrame> {
    let sequence = GarmentSequence::read(dataset, first, character)?;
    check_vertices(first, &sequence, garment)?;
    let frames: &[CoordinateFrame] = match dataset {
        Dataset::Vto => &[CoordinateFrame::World],
        Dataset::VirtualBones => &CoordinateFrame::CANDIDATES,
    };
    nearest(first, frames, &sequence, character, garment)
}

/// Writes a sequence as a clip, with positions in world space.
fn write(
    writer: &mut CaptureWriter,
    sequence: &GarmentSequence,
    split: Split,
    frame: CoordinateFrame,
    character: &Character,
) -> Result<()> {
    let (skeleton, mut joints) = (&character.skeleton, Vec::new());
    let mut out = writer.begin_clip(&sequence.clip, split)?;
    for (pose, garment) in sequence.clip.poses.iter().zip(&sequence.garment) {
        // Positions may be relative to the root joint of the same frame.
        skeleton.forward_kinematics(pose, &mut joints);
        let root = joints[skeleton.root()];
        let world: Vec<Vec3> = garment.iter().map(|&x| frame.world(x, root)).collect();
        out.push(&world)?;
    }
    out.finish()
}

/// Keeps the sequences of the first file's body shape.
fn of_one_body(dataset: Dataset, files: Vec<PathBuf>, notes: &mut Vec<String>) -> Vec<PathBuf> {
    if dataset != Dataset::Vto {
        return files;
    }
    let (shape, all) = (vto::shape_of(&files[0]), files.len());
    let kept: Vec<PathBuf> = files.into_iter().filter(|f| vto::shape_of(f) == shape).collect();
    if kept.len() < all {
        notes.push(format!(
            "{} sequences of {shape}; {} of other shapes left out",
            kept.len(),
            all - kept.len()
        ));
    }
    kept
}

/// Makes a rest shape from the frame nearest to the bind pose among all sequences.
fn rest_from_frames(files: &[PathBuf], character: &Character, notes: &mut Vec<String>) -> Result<TriMesh> {
    let mut best: Option<(f32, String, TriMesh)> = None;
    // Sequences are read a second time for writing, so that memory holds only one of them.
    for path in files {
        let sequence = GarmentSequence::read(Dataset::Vto, path, character)?;
        let nearest = nearest_to_bind_pose(character, &sequence.clip.poses);
        if best.as_ref().is_none_or(|(least, ..)| nearest.rotation < *least) {
            let t = nearest.frame;
            let vertices = unposed(path, character, &sequence.clip.poses[t], &sequence.garment[t])?;
            let mesh = TriMesh::new(vertices, sequence.faces).map_err(|source| Error::Mesh {
                path: path.clone(),
                source,
            })?;
            best = Some((
                nearest.rotation,
                format!("frame {t} of {}", sequence.clip.name),
                mesh,
            ));
        }
    }
    let Some((_, name, mesh)) = best else {
        return Err(Error::content(Path::new(""), "sequences", "none"));
    };
    notes.push(format!(
        "the rest shape is that of {name}, carried back to the bind pose"
    ));
    Ok(mesh)
}

fn check_vertices(path: &Path, sequence: &GarmentSequence, garment: &Garment) -> Result<()> {
    let (expected, found) = (garment.rest.vertices.len(), sequence.garment[0].len());
    match expected == found {
        true => Ok(()),
        false => Err(Error::content(
            path,
            format!("a garment of {expected} vertices"),
            found.to_string(),
        )),
    }
}
