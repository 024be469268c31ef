//! Files with a body's animation and no rig.

use crate::{
    alembic::AlembicReader,
    cache::{POSITION_ARRAYS, has_obj_files},
    error::{Error, Result},
    mesh_names::{listed, named},
    npy::read_npy_header,
    npz::Npz,
    rigged::{RiggedFormat, contents},
};
use std::path::{Path, PathBuf};

/// Name of the body's mesh in files of `unic animate`. It is taken where nothing else tells the body from
/// other meshes.
const BODY: &str = "body";

/// A body's animation without a rig.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnriggedBody {
    /// Name of the mesh, in a file of named meshes.
    pub mesh: Option<String>,
    /// OBJ file with the faces, beside a file that holds positions alone.
    pub faces: Option<PathBuf>,
}

impl UnriggedBody {
    /// Looks into a file for the animation of a body without a rig: Alembic, USD without a skinned mesh,
    /// PC2, MDD, a folder of OBJ files, npz with positions over time. `None` for all other files. Of
    /// several meshes the one of the name `body` is taken, else the one that is called so.
    ///
    /// # Errors
    /// A damaged file, several meshes of which none is chosen.
    pub fn find(path: &Path, body: Option<&str>) -> Result<Option<Self>> {
        let names = match RiggedFormat::of(path) {
            Some(RiggedFormat::Usd) => match unskinned_meshes(path)? {
                Some(names) => names,
                None => return Ok(None),
            },
            Some(RiggedFormat::Gltf | RiggedFormat::Fbx) => return Ok(None),
            None if AlembicReader::is_alembic(path) => {
                let reader = AlembicReader::open(path)?;
                (0..reader.len()).map(|mesh| reader.name(mesh)).collect()
            }
            None if is_positions_alone(path) => {
                let faces = Some(path.with_extension("obj")).filter(|path| path.is_file());
                return Ok(Some(Self { mesh: None, faces }));
            }
            None => return Ok(None),
        };
        let mesh = Some(chosen(path, &names, body)?);
        Ok(Some(Self { mesh, faces: None }))
    }
}

/// Names of the meshes of a USD file without a skinned one.
fn unskinned_meshes(path: &Path) -> Result<Option<Vec<String>>> {
    let found = contents(path, RiggedFormat::Usd)?;
    if !found.skinned.is_empty() || !found.others.iter().any(|mesh| mesh.samples > 1) {
        // A character, or a file of which the reader of characters says what it lacks.
        return Ok(None);
    }
    Ok(Some(found.others.into_iter().map(|mesh| mesh.name).collect()))
}

fn is_positions_alone(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    match ending.to_str() {
        Some("pc2" | "mdd") => true,
        Some("npz") => has_positions_over_time(path),
        Some("npy") => read_npy_header(path).is_ok_and(|header| header.shape.len() == 3),
        _ => path.is_dir() && has_obj_files(path),
    }
}

fn has_positions_over_time(path: &Path) -> bool {
    let Ok(mut npz) = Npz::open(path) else {
        return false;
    };
    // The reader takes the first of these arrays too.
    let Some(name) = POSITION_ARRAYS.iter().find(|name| npz.contains(name)) else {
        return false;
    };
    // A character has weights. A clip of a capture has a garment beside its poses.
    let is_other = npz.contains("weights") || (*name == "garment" && npz.contains("poses"));
    !is_other && npz.header(name).is_ok_and(|header| header.shape.len() == 3)
}

fn chosen(path: &Path, names: &[String], body: Option<&str>) -> Result<String> {
    let index = match (body, names) {
        (Some(name), _) => named(path, names, name)?,
        (None, [_]) => 0,
        (None, _) => called_body(names).ok_or_else(|| {
            let found = format!("{}; --body names it", listed(names));
            Error::content(path, "one mesh, the body", found)
        })?,
    };
    Ok(names[index].clone())
}

/// The only mesh that is called body, else the only one whose parent is.
fn called_body(names: &[String]) -> Option<usize> {
    let only = |depth: usize| {
        let is_body = |name: &String| {
            let part = name.rsplit('/').nth(depth);
            part.is_some_and(|part| part.eq_ignore_ascii_case(BODY))
        };
        let mut found = (0..names.len()).filter(|mesh| is_body(&names[*mesh]));
        found.next().filter(|_| found.next().is_none())
    };
    only(0).or_else(|| only(1))
}
