//! Summaries of files of any kind, with their problems.

mod alembic;
mod arrays;
mod capture;
mod mesh;
mod model;
mod motion;
mod motion_database;
mod report;
mod rigged;

pub use report::{Fact, FileKind, Inspection};

use crate::{
    atomic::parent_folder,
    bvh::is_bvh,
    cache,
    capture::{FolderKind, MANIFEST},
    error::{Error, Result},
    foreign_formats::{PartlyReadFormat, is_foreign, partly_read, refuse_foreign},
    rigged::RiggedFormat,
};
use std::{fs::File, io::Read, path::Path};
use unic_core::motion_matching::MAGIC as MOTION_DATABASE;

/// Number of first bytes that a file is recognised by.
const START_BYTES: u64 = 12;

/// Summarises a file or folder of any kind that the project knows.
///
/// Faults of the content become [`Inspection::problems`]. Only a path that cannot be opened is an
/// error.
///
/// # Errors
/// No such file or folder.
pub fn inspect(path: &Path) -> Result<Inspection> {
    if path.is_dir() {
        return inspect_folder(path);
    }
    if path.file_name().is_some_and(|n| n == MANIFEST) {
        return inspect_folder(parent_folder(path));
    }
    // The first bytes decide before the extension: files are often renamed.
    let mut start = Vec::new();
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    file.take(START_BYTES)
        .read_to_end(&mut start)
        .map_err(Error::io(path, "read"))?;
    if let Some(format) = partly_read(path) {
        return Ok(match format {
            PartlyReadFormat::Alembic => alembic::inspect(path),
            PartlyReadFormat::Mdd => arrays::mdd(path),
            PartlyReadFormat::Gltf => rigged::inspect(path, RiggedFormat::Gltf),
            PartlyReadFormat::Fbx => rigged::inspect(path, RiggedFormat::Fbx),
            PartlyReadFormat::Usd => rigged::inspect(path, RiggedFormat::Usd),
            PartlyReadFormat::Pickle => arrays::body_model(path),
        });
    }
    Ok(if is_foreign(path) {
        unknown(path, &start)
    } else if start.starts_with(b"PK") {
        arrays::npz(path)
    } else if start.starts_with(b"\x93NUMPY") {
        arrays::npy(path)
    } else if start.starts_with(b"POINTCACHE2") {
        arrays::point_cache(path)
    } else if start.starts_with(&MOTION_DATABASE) {
        motion_database::inspect(path)
    } else if is_bvh(path)? {
        motion::bvh(path)
    } else if start.get(8) == Some(&b'{') {
        // A safetensors file: eight bytes of length, then a JSON object.
        model::inspect(path)
    } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
        mesh::inspect(path)
    } else {
        unknown(path, &start)
    })
}

fn inspect_folder(folder: &Path) -> Result<Inspection> {
    if folder.join(MANIFEST).exists() {
        return Ok(capture::inspect(folder));
    }
    let kind = FolderKind::of(folder);
    if kind != FolderKind::Other || cache::obj_files(folder)?.is_empty() {
        let mut report = Inspection::new(folder, FileKind::Folder);
        let found = kind.description();
        report.fact("folder", found.as_str());
        if !matches!(kind, FolderKind::Character | FolderKind::Garment) {
            report.problem(format!(
                "expected a capture or a folder of .obj files, found {found}"
            ));
        }
        return Ok(report);
    }
    Ok(arrays::mesh_sequence(folder))
}

fn unknown(path: &Path, start: &[u8]) -> Inspection {
    let mut report = Inspection::new(path, FileKind::Unknown);
    if report
        .ok_or_problem(refuse_foreign(path, "a file that unic reads"))
        .is_none()
    {
        return report;
    }
    report.problem(format!(
        "{}: expected an npz, npy, OBJ, PC2, MDD, Alembic, glTF, FBX, USD, BVH, motion database or model \
         file or a capture folder, found a file that begins with \"{}\"",
        path.display(),
        start.escape_ascii()
    ));
    report
}
