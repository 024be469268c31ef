//! Writing OBJ files.

use crate::{
    atomic::AtomicFile,
    error::{Error, Result},
};
use glam::Vec3;
use std::{
    io::{self, Write},
    path::Path,
};
use unic_core::mesh::TriMesh;

/// Writes a mesh as an OBJ file, atomically. Coordinates have enough digits to be read back as the
/// same f32.
///
/// # Errors
/// The file cannot be written.
pub fn write_obj(path: &Path, mesh: &TriMesh) -> Result<()> {
    let mut file = AtomicFile::create(path)?;
    write_obj_to(&mut file, mesh).map_err(Error::io(path, "write"))?;
    file.finish()
}

/// Writes a mesh in OBJ format to `out`, as [`write_obj`] does.
///
/// # Errors
/// Those of `out`.
pub fn write_obj_to(out: &mut impl Write, mesh: &TriMesh) -> io::Result<()> {
    write_mesh(out, mesh, &mesh.vertices)
}

/// Writes a mesh in OBJ format with `positions` instead of its own.
pub(crate) fn write_mesh(out: &mut impl Write, mesh: &TriMesh, positions: &[Vec3]) -> io::Result<()> {
    // Rust prints the shortest decimal number that is read back as the same f32.
    for v in positions {
        writeln!(out, "v {} {} {}", v.x, v.y, v.z)?;
    }
    let Some(uvs) = &mesh.uvs else {
        return mesh.faces.iter().try_for_each(|&face| {
            let [a, b, c] = face.map(one_based);
            writeln!(out, "f {a} {b} {c}")
        });
    };
    for uv in &uvs.coordinates {
        writeln!(out, "vt {} {}", uv.x, uv.y)?;
    }
    mesh.faces.iter().zip(&uvs.faces).try_for_each(|(&face, &uv)| {
        let ([a, b, c], [s, t, u]) = (face.map(one_based), uv.map(one_based));
        writeln!(out, "f {a}/{s} {b}/{t} {c}/{u}")
    })
}

/// Converts an index to OBJ's, which begin at one. `u64` holds `u32::MAX` + 1.
fn one_based(index: u32) -> u64 {
    u64::from(index) + 1
}
