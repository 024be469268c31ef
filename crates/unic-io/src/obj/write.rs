//! Writing OBJ.

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

/// Writes a mesh, atomically. Coordinates are written with as many digits as bring the same f32
/// back.
///
/// # Errors
/// The file cannot be written.
pub fn write_obj(path: &Path, mesh: &TriMesh) -> Result<()> {
    let mut file = AtomicFile::create(path)?;
    write_obj_to(&mut file, mesh).map_err(Error::io(path, "write"))?;
    file.finish()
}

/// Writes a mesh to a file that is open already; see [`write_obj`].
///
/// # Errors
/// As `out`.
pub fn write_obj_to(out: &mut impl Write, mesh: &TriMesh) -> io::Result<()> {
    write_mesh(out, mesh, &mesh.vertices)
}

/// The mesh with other positions.
pub(crate) fn write_mesh(out: &mut impl Write, mesh: &TriMesh, positions: &[Vec3]) -> io::Result<()> {
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

/// OBJ counts from one.
fn one_based(index: u32) -> u64 {
    u64::from(index) + 1
}
