//! Reading and writing a skinned body, `character.npz`.

use crate::{
    error::{Error, Result},
    foreign_formats::{PartlyReadFormat, partly_read, refuse_foreign},
    joint_names::ARRAY_NAME as JOINT_NAMES,
    npy::Dim,
    npz::{Npz, NpzWriter},
    rigged::{CharacterOptions, RiggedCharacter, RiggedFormat, read_rigged_character},
    smpl_model,
};
use std::{fs, path::Path};
use unic_core::{
    Model,
    character::{Character, FileMesh},
    mesh::TriMesh,
    skeleton::{SMPL_JOINT_NAMES, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// Files that characters are read from, for errors.
const EXPECTED: &str = "a character (npz, glTF, FBX, USD, a model or a pickle of SMPL)";

/// Array of the body's vertex for each vertex of its file.
const FILE_VERTICES: &str = "file_vertices";

/// Array of the faces of the body's file.
const FILE_FACES: &str = "file_faces";

/// Reads a character from an npz, glTF, FBX or USD file, in metres, Y up. A model (`.unic`) has the
/// character that it was trained on.
///
/// A file with a rig has one skinned mesh; [`crate::rigged`] describes what is read of it. The arrays of an
/// npz are `vertices` (B, 3), `faces` (F, 3), `joints` (J, 3), `parents` (J), `weights` (B,
/// J), and optionally `rest_pose` (J, 3), `joint_names` (J), `file_vertices` (W) and `file_faces` (E, 3).
///
/// # Errors
/// Missing arrays, shapes that contradict each other, a mesh, skeleton or weights with faults.
pub fn read_character(path: &Path) -> Result<Character> {
    read_named_character(path, Vec::new())
}

/// A character, with the conversions that made it.
#[derive(Clone, Debug)]
pub struct CharacterImport {
    /// Body, skeleton and skinning weights; metres, +Y up.
    pub character: Character,
    /// Descriptions of the conversions, one sentence each.
    pub notes: Vec<String>,
}

/// Reads a character as [`read_character`] does, with notes about what was converted.
///
/// # Errors
/// Those of [`read_character`].
pub fn import_character(path: &Path, options: &CharacterOptions<'_>) -> Result<CharacterImport> {
    if let Some(format) = RiggedFormat::of(path) {
        let RiggedCharacter { character, notes, .. } = read_rigged_character(path, format, options)?;
        return Ok(CharacterImport { character, notes });
    }
    let character = read_character(path)?;
    let notes = match is_smpl_model(path) {
        true => vec![smpl_model::NOTE.to_owned()],
        false => Vec::new(),
    };
    Ok(CharacterImport { character, notes })
}

/// Returns whether a file that is read as a character is a body model of SMPL.
fn is_smpl_model(path: &Path) -> bool {
    is_pickle(path) || Npz::open(path).is_ok_and(|npz| smpl_model::is_model(&npz))
}

fn is_pickle(path: &Path) -> bool {
    partly_read(path) == Some(PartlyReadFormat::Pickle)
}

/// Reads a character with the given joint names; an empty list takes those of the file.
///
/// # Errors
/// Names in another order than the file's; those of [`read_character`].
pub(crate) fn read_named_character(path: &Path, names: Vec<String>) -> Result<Character> {
    if let Some(format) = RiggedFormat::of(path) {
        return Ok(read_rigged_character(path, format, &CharacterOptions::default())?.character);
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("unic")) {
        return of_model(path);
    }
    if is_pickle(path) {
        return smpl_model::read_pickle(path);
    }
    refuse_foreign(path, EXPECTED)?;
    refuse_mesh(path)?;
    let mut npz = Npz::open(path)?;
    if smpl_model::is_model(&npz) {
        return smpl_model::read_npz(&mut npz);
    }
    let body = read_mesh(&mut npz)?;
    let skeleton = read_skeleton(&mut npz, names)?;
    // The file stores weights densely, one column for each joint; in memory they are sparse.
    let shape = [Dim::Is(body.vertices.len()), Dim::Is(skeleton.len())];
    let weights = read_weights(&mut npz, shape)?;
    let file_mesh = read_file_mesh(&mut npz, body.vertices.len())?;
    Ok(Character {
        body,
        skeleton,
        weights,
        file_mesh,
    })
}

/// Reads the character that a model was trained on.
fn of_model(path: &Path) -> Result<Character> {
    let bytes = fs::read(path).map_err(Error::io(path, "read"))?;
    match Model::from_bytes(&bytes) {
        Ok(model) => Ok(model.character().clone()),
        Err(error) => Err(Error::content(path, "a model", error.to_string())),
    }
}

/// Refuses a mesh, which a newcomer takes for a character.
fn refuse_mesh(path: &Path) -> Result<()> {
    match path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
        true => Err(Error::content(
            path,
            EXPECTED,
            "a mesh (OBJ), which has no skeleton",
        )),
        false => Ok(()),
    }
}

fn read_mesh(npz: &mut Npz) -> Result<TriMesh> {
    let vertices = npz.vectors("vertices", Dim::Any("B"))?;
    let faces = npz.array::<u32>("faces", &[Dim::Any("F"), Dim::Is(3)])?;
    let faces = faces.data.chunks_exact(3).map(|f| [f[0], f[1], f[2]]);
    TriMesh::new(vertices, faces.collect()).map_err(|source| Error::Mesh {
        path: npz.path().to_path_buf(),
        source,
    })
}

/// Reads the order of the vertices in the file of a body with welded ones, if there is one.
fn read_file_mesh(npz: &mut Npz, vertices: usize) -> Result<Option<FileMesh>> {
    if !npz.contains(FILE_VERTICES) {
        return Ok(None);
    }
    let body_vertices = npz.array::<u32>(FILE_VERTICES, &[Dim::Any("W")])?.data;
    let faces = npz.array::<u32>(FILE_FACES, &[Dim::Any("E"), Dim::Is(3)])?;
    let faces = faces.data.chunks_exact(3).map(|f| [f[0], f[1], f[2]]);
    let mesh = FileMesh {
        body_vertices,
        faces: faces.collect(),
    };
    match mesh.check(vertices) {
        Ok(()) => Ok(Some(mesh)),
        Err(source) => Err(Error::Mesh {
            path: npz.path().to_path_buf(),
            source,
        }),
    }
}

fn read_skeleton(npz: &mut Npz, names: Vec<String>) -> Result<Skeleton> {
    let joints = npz.vectors("joints", Dim::Any("J"))?;
    let count = Dim::Is(joints.len());
    let parents = npz.array::<i64>("parents", &[count])?.data;
    let rest_pose = if npz.contains("rest_pose") {
        npz.vectors("rest_pose", count)?
    } else {
        Vec::new()
    };
    let own = match npz.contains(JOINT_NAMES) {
        true => with_smpl_spelling(npz.text(JOINT_NAMES)?),
        false => Vec::new(),
    };
    refuse_another_order(npz, &own, &names)?;
    let names = if names.is_empty() { own } else { names };
    Skeleton::new(SkeletonParts {
        names,
        parents,
        joints,
        rest_pose,
    })
    .map_err(|source| Error::Skeleton {
        path: npz.path().to_path_buf(),
        source,
    })
}

/// Refuses given names that are the file's names in another order. Given names may be new ones, but
/// a permutation is a mistake that would exchange joints.
fn refuse_another_order(npz: &Npz, own: &[String], others: &[String]) -> Result<()> {
    let sorted = |names: &[String]| {
        let mut names = names.to_vec();
        names.sort_unstable();
        names
    };
    // A renamed joint is allowed; equal sets of names in another order are not.
    let swapped = own.iter().zip(others).find(|(own, other)| own != other);
    match swapped.filter(|_| sorted(own) == sorted(others)) {
        None => Ok(()),
        Some((own, other)) => {
            let expected = format!("the order of the manifest's joint_names, in which {other} stands here");
            Err(npz.array_error(JOINT_NAMES, expected, own.as_str()))
        }
    }
}

/// Converts SMPL's names to one spelling: `left_hip` and `L_hip` are both in use.
fn with_smpl_spelling(names: Vec<String>) -> Vec<String> {
    let short = |name: &String| name.replace("left_", "L_").replace("right_", "R_");
    let spelled: Vec<String> = names.iter().map(short).collect();
    // Only a complete set is respelled: in another skeleton the words may be parts of other names.
    if spelled == SMPL_JOINT_NAMES {
        spelled
    } else {
        names
    }
}

/// Reads the array `weights` of the given shape (vertices, joints).
///
/// # Errors
/// No such array, another shape, weights that are negative, not finite or all zero.
pub(crate) fn read_weights(npz: &mut Npz, shape: [Dim; 2]) -> Result<SkinningWeights> {
    let dense = npz.array::<f32>("weights", &shape)?;
    SkinningWeights::from_dense(&dense.data, dense.shape[0], dense.shape[1]).map_err(|source| {
        Error::Weights {
            path: npz.path().to_path_buf(),
            source,
        }
    })
}

/// Writes a character as an npz that [`read_character`] reads, atomically.
///
/// # Errors
/// The file cannot be written.
pub fn write_character(path: &Path, character: &Character) -> Result<()> {
    let Character {
        body,
        skeleton,
        weights,
        file_mesh,
    } = character;
    let parts = skeleton.to_parts();
    // −1 is the parent of the root.
    let parents: Vec<i32> = parts.parents.iter().map(|&p| p as i32).collect();
    let faces: Vec<i32> = body.faces.as_flattened().iter().map(|&i| i as i32).collect();
    let (vertices, joints) = (body.vertices.len(), skeleton.len());
    let mut npz = NpzWriter::create(path)?;
    npz.f32s("vertices", &[vertices, 3], bytemuck::cast_slice(&body.vertices))?;
    npz.i32s("faces", &[body.faces.len(), 3], &faces)?;
    npz.f32s("joints", &[joints, 3], bytemuck::cast_slice(&parts.joints))?;
    npz.i32s("parents", &[joints], &parents)?;
    npz.text(JOINT_NAMES, &parts.names)?;
    npz.f32s("weights", &[vertices, joints], &weights.to_dense())?;
    npz.f32s("rest_pose", &[joints, 3], bytemuck::cast_slice(&parts.rest_pose))?;
    if let Some(mesh) = file_mesh {
        let faces: Vec<i32> = mesh.faces.as_flattened().iter().map(|&i| i as i32).collect();
        npz.u32s(FILE_VERTICES, &mesh.body_vertices)?;
        npz.i32s(FILE_FACES, &[mesh.faces.len(), 3], &faces)?;
    }
    npz.finish()
}
