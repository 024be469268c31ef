//! Prints a frame of a mesh as OBJ text: world positions, texture coordinates and faces.
//!
//! ```text
//! cargo run --release -p ogawa --example abc_frame -- walk.abc /garment/garmentShape 12
//! ```

use ogawa::{Archive, Attribute, Error, Faces, Scope};
use std::{
    error,
    io::{self, BufWriter, Write},
};

fn main() -> Result<(), Box<dyn error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, name, frame] = arguments.as_slice() else {
        return Err("expected a file, the full name of a mesh and a frame".into());
    };
    let frame = frame.parse()?;
    let mut archive = Archive::open(path)?;
    let meshes = archive.meshes()?;
    let Some(mesh) = meshes.iter().find(|m| archive.full_name(m.object()) == *name) else {
        return Err(format!("{path}: no mesh {name}").into());
    };
    let mut positions = Vec::new();
    mesh.world_positions(&mut archive, frame, &mut positions)?;
    let uvs = mesh.uvs(&mut archive, frame)?;
    let faces = mesh.faces(&mut archive, frame)?;
    print(&positions, uvs.as_ref(), &faces).map_err(|source| Error::Io {
        action: "print",
        source,
    })?;
    Ok(())
}

fn print(positions: &[[f32; 3]], uvs: Option<&Attribute<2>>, faces: &Faces) -> io::Result<()> {
    let mut out = BufWriter::new(io::stdout().lock());
    for [x, y, z] in positions {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [u, v] in uvs.map_or(&[][..], |uvs| &uvs.values) {
        writeln!(out, "vt {u} {v}")?;
    }
    let mut corner = 0;
    for face in faces.iter() {
        write!(out, "f")?;
        for &vertex in face {
            match uvs.and_then(|uvs| uv_index(uvs, corner, vertex)) {
                Some(uv) => write!(out, " {}/{}", vertex + 1, uv + 1)?,
                None => write!(out, " {}", vertex + 1)?,
            }
            corner += 1;
        }
        writeln!(out)?;
    }
    out.flush()
}

/// Index of the texture coordinates of a corner.
fn uv_index(uvs: &Attribute<2>, corner: usize, vertex: u32) -> Option<usize> {
    let element = match uvs.scope {
        Scope::Corner => corner,
        Scope::Vertex => vertex as usize,
        Scope::Face | Scope::Constant => return None,
    };
    match &uvs.indices {
        Some(indices) => Some(*indices.get(element)? as usize),
        None => Some(element),
    }
}
