//! Reading vertex animations.

use crate::{
    error::{Error, Result},
    foreign_formats::refuse_foreign,
    frame_rate::check_frame_rate,
    frames::VertexFrames,
    mdd,
    npy::Dim,
    npz::Npz,
    obj, pc2,
};
use std::path::{Path, PathBuf};
use unic_core::mesh::TriMesh;

/// Names of the array of positions in npz files.
pub(crate) const POSITION_ARRAYS: [&str; 4] = ["vertices", "garment", "sim_res", "verts"];

/// Description of the accepted paths for errors.
const EXPECTED: &str = "a vertex cache (.pc2, .mdd, .npz, .npy or a folder of .obj)";

/// A vertex animation in the unit and axes of its file.
#[derive(Clone, Debug)]
pub struct VertexCache {
    /// Positions of all vertices in every frame.
    pub frames: VertexFrames,
    /// Frames per second, if the file states them.
    pub fps: Option<f32>,
    /// First frame with its faces, if the file has faces.
    pub mesh: Option<TriMesh>,
}

/// Reads a vertex animation: `.pc2`, `.mdd`, `.npz` (arrays `vertices`, `garment`, `sim_res` or `verts` of
/// shape (T, V, 3)), `.npy`, or a folder of OBJ files in the order of their names.
///
/// # Errors
/// A file that is none of these, is damaged, or changes its number of vertices.
pub fn read_vertex_cache(path: &Path) -> Result<VertexCache> {
    if path.is_dir() {
        return read_obj_folder(path);
    }
    // A missing file of any name is reported as missing.
    std::fs::metadata(path).map_err(Error::io(path, "open"))?;
    if mdd::is_mdd(path) {
        let cache = mdd::read_mdd(path)?;
        let fps = cache.fps();
        return Ok(VertexCache {
            fps,
            ..positions_only(cache.frames)
        });
    }
    refuse_foreign(path, EXPECTED)?;
    // By extension: the content of a `.npy` file does not tell an animation from other arrays.
    match path.extension().and_then(|e| e.to_str()) {
        Some("pc2") => Ok(positions_only(pc2::read_pc2(path)?.frames)),
        Some("npy") => Ok(positions_only(VertexFrames::open_npy(path)?)),
        Some("npz") => read_npz(path),
        other => Err(Error::content(
            path,
            EXPECTED,
            other.map_or("no file ending".into(), |e| format!(".{e}")),
        )),
    }
}

fn positions_only(frames: VertexFrames) -> VertexCache {
    VertexCache {
        frames,
        fps: None,
        mesh: None,
    }
}

fn read_npz(path: &Path) -> Result<VertexCache> {
    let mut npz = Npz::open(path)?;
    // Without any of the names the error asks for the first one.
    let name = npz.first_present(&POSITION_ARRAYS).unwrap_or(POSITION_ARRAYS[0]);
    let frames = frames_of(&mut npz, name)?;
    let fps = match npz.first_present(&["fps", "mocap_framerate", "mocap_frame_rate"]) {
        Some(key) => {
            let fps = npz.number(key)?;
            check_frame_rate(fps)
                .map_err(|found| npz.array_error(key, "a frame rate from 1 to 1000", found))?;
            Some(fps as f32)
        }
        None => None,
    };
    let mesh = if npz.contains("faces") {
        let faces = npz.array::<u32>("faces", &[Dim::Any("F"), Dim::Is(3)])?;
        let faces = faces.data.chunks_exact(3).map(|f| [f[0], f[1], f[2]]);
        let vertices = (frames.iter().next()).map(<[_]>::to_vec).unwrap_or_default();
        Some(
            TriMesh::new(vertices, faces.collect()).map_err(|source| Error::Mesh {
                path: path.to_path_buf(),
                source,
            })?,
        )
    } else {
        None
    };
    Ok(VertexCache { frames, fps, mesh })
}

/// Reads an array of shape (T, V, 3) as frames.
///
/// # Errors
/// Another shape or type, damaged data, no vertices.
pub(crate) fn frames_of(npz: &mut Npz, name: &str) -> Result<VertexFrames> {
    let array = npz.array::<f32>(name, &[Dim::Any("T"), Dim::Any("V"), Dim::Is(3)])?;
    let [len, vertex_count] = [array.shape[0], array.shape[1]];
    VertexFrames::new(array.data, len, vertex_count)
        .ok_or_else(|| npz.array_error(name, "at least one vertex a frame", "none"))
}

fn read_obj_folder(folder: &Path) -> Result<VertexCache> {
    let files = obj_files(folder)?;
    let Some(first) = files.first() else {
        return Err(Error::content(folder, "a folder of .obj files", "none"));
    };
    let mesh = obj::read_obj(first)?;
    // The first file is read twice, so that one loop checks and copies all frames.
    let mut data: Vec<f32> = Vec::new();
    for file in &files {
        let vertices = obj::read_obj(file)?.vertices;
        // Faces may differ between frames; they are taken from the first.
        if vertices.len() != mesh.vertices.len() {
            let expected = format!("{} vertices as in the first frame", mesh.vertices.len());
            return Err(Error::content(file, expected, vertices.len().to_string()));
        }
        data.extend_from_slice(bytemuck::cast_slice(&vertices));
    }
    let frames = VertexFrames::new(data, files.len(), mesh.vertices.len())
        .ok_or_else(|| Error::content(folder, "at least one vertex a frame", "none"))?;
    Ok(VertexCache {
        frames,
        fps: None,
        mesh: Some(mesh),
    })
}

/// Returns whether a folder holds OBJ files.
pub fn has_obj_files(folder: &Path) -> bool {
    obj_files(folder).is_ok_and(|files| !files.is_empty())
}

/// Lists the OBJ files of a folder, sorted by the number at the end of their names and then by
/// name: `f2` precedes `f10`.
///
/// # Errors
/// The folder cannot be listed.
pub(crate) fn obj_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(Error::io(folder, "list"))?;
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.map_err(Error::io(folder, "list"))?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
            files.push(path);
        }
    }
    files.sort_by_cached_key(|path| (frame_number(path), path.clone()));
    Ok(files)
}

/// Returns the number at the end of a file's name, if there is one.
fn frame_number(path: &Path) -> Option<u64> {
    let stem = path.file_stem()?.to_str()?;
    // Numbers beyond u64 count as none; such files are sorted by name.
    let digits = stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem[digits..].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_ordered_by_number() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["f10.obj", "f2.obj", "f1.OBJ", "readme.txt"] {
            std::fs::write(folder.path().join(name), "v 0 0 0\n").unwrap();
        }
        let names: Vec<_> = (obj_files(folder.path()).unwrap().iter())
            .map(|p| p.file_name().unwrap().to_str().unwrap().to_string())
            .collect();
        assert_eq!(names, ["f1.OBJ", "f2.obj", "f10.obj"]);
    }
}
