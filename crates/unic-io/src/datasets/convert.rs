//! From a data set's folder to a capture.

use super::{
    Dataset, FPS,
    fit::{Frame, calmest, nearest, unposed},
    sequence::{Sequence, files},
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

/// Every so many sequences, by name, one is to test on: the data sets name none.
const TEST_EVERY: usize = 5;

/// What a conversion did.
#[derive(Clone, Debug)]
pub struct Converted {
    /// Sequences in the capture.
    pub clips: usize,
    /// One sentence a decision.
    pub notes: Vec<String>,
}

/// Makes the capture `out` of a data set that lies in `folder`, on a character that has the data set's body and skeleton.
///
/// The rest shape is the data set's template, or without one the frame nearest to the bind pose, carried back to it by the
/// nearest body vertices. Every fifth sequence by name is for testing.
///
/// # Errors
/// No sequences, files of another layout, a garment that is not on the character, a folder that cannot be written.
pub fn convert(dataset: Dataset, folder: &Path, character: &Character, out: &Path) -> Result<Converted> {
    let mut notes = Vec::new();
    let files = chosen(dataset, files(dataset, folder)?, &mut notes);
    let garment = garment(dataset, folder, &files, character, &mut notes)?;
    let frame = frame(dataset, &files[0], character, &garment)?;
    notes.push(format!("positions are taken as {}", frame.name()));
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let mut manifest = Manifest::new(name, FPS);
    manifest.provenance = dataset.provenance().into();
    let mut writer = CaptureWriter::create(out, manifest, character, &garment, &Default::default())?;
    for (i, path) in files.iter().enumerate() {
        let sequence = Sequence::read(dataset, path, character)?;
        check_vertices(path, &sequence, &garment)?;
        write(&mut writer, &sequence, split(i, files.len()), frame, character)?;
    }
    writer.finish()?;
    notes.push(format!("every {TEST_EVERY}th sequence by name is to test on"));
    let clips = files.len();
    Ok(Converted { clips, notes })
}

/// Every fifth is to test on, and of fewer the last.
fn split(index: usize, count: usize) -> Split {
    let is_last_of_few = count < TEST_EVERY && index + 1 == count;
    match index % TEST_EVERY == TEST_EVERY - 1 || is_last_of_few {
        true => Split::Test,
        false => Split::Train,
    }
}

fn garment(
    dataset: Dataset,
    folder: &Path,
    files: &[PathBuf],
    character: &Character,
    notes: &mut Vec<String>,
) -> Result<Garment> {
    let rest = match dataset {
        Dataset::Vto => rest_of_calmest(files, character, notes)?,
        Dataset::VirtualBones => virtual_bones::template(folder, character)?,
    };
    let weights = default_weights(&rest, character).map_err(|source| Error::Weights {
        path: folder.to_owned(),
        source,
    })?;
    Ok(Garment::new(rest, weights))
}

/// What the positions of a data set are, by its first sequence.
fn frame(dataset: Dataset, first: &Path, character: &Character, garment: &Garment) -> Result<Frame> {
    let sequence = Sequence::read(dataset, first, character)?;
    check_vertices(first, &sequence, garment)?;
    let frames: &[Frame] = match dataset {
        Dataset::Vto => &[Frame::World],
        Dataset::VirtualBones => &Frame::UNSAID,
    };
    nearest(first, frames, &sequence, character, garment)
}

fn write(
    writer: &mut CaptureWriter,
    sequence: &Sequence,
    split: Split,
    frame: Frame,
    character: &Character,
) -> Result<()> {
    let (skeleton, mut joints) = (&character.skeleton, Vec::new());
    let mut out = writer.begin_clip(&sequence.clip, split)?;
    for (pose, garment) in sequence.clip.poses.iter().zip(&sequence.garment) {
        skeleton.forward_kinematics(pose, &mut joints);
        let root = joints[skeleton.root()];
        let world: Vec<Vec3> = garment.iter().map(|&x| frame.world(x, root)).collect();
        out.push(&world)?;
    }
    out.finish()
}

/// Sequences of one body: the first file's.
fn chosen(dataset: Dataset, files: Vec<PathBuf>, notes: &mut Vec<String>) -> Vec<PathBuf> {
    if dataset != Dataset::Vto {
        return files;
    }
    let (shape, all) = (vto::shape_of(&files[0]), files.len());
    let chosen: Vec<PathBuf> = files.into_iter().filter(|f| vto::shape_of(f) == shape).collect();
    if chosen.len() < all {
        notes.push(format!(
            "{} sequences of {shape}; {} of other shapes left out",
            chosen.len(),
            all - chosen.len()
        ));
    }
    chosen
}

fn rest_of_calmest(files: &[PathBuf], character: &Character, notes: &mut Vec<String>) -> Result<TriMesh> {
    let mut best: Option<(f32, String, TriMesh)> = None;
    for path in files {
        let sequence = Sequence::read(Dataset::Vto, path, character)?;
        let (t, turned) = calmest(character, &sequence.clip.poses);
        if best.as_ref().is_none_or(|(least, ..)| turned < *least) {
            let vertices = unposed(path, character, &sequence.clip.poses[t], &sequence.garment[t])?;
            let mesh = TriMesh::new(vertices, sequence.faces).map_err(|source| Error::Mesh {
                path: path.clone(),
                source,
            })?;
            best = Some((turned, format!("frame {t} of {}", sequence.clip.name), mesh));
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

fn check_vertices(path: &Path, sequence: &Sequence, garment: &Garment) -> Result<()> {
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
