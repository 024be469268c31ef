//! Prints a frame of a mesh as OBJ text: world positions, texture coordinates, normals in the space of
//! the object, and faces.
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
    let normals = mesh.normals(&mut archive, frame)?;
    print(&positions, uvs.as_ref(), normals.as_ref(), &faces).map_err(|source| Error::Io {
        action: "print",
        source,
    })?;
    Ok(())
}

fn print(
    positions: &[[f32; 3]],
    uvs: Option<&Attribute<2>>,
    normals: Option<&Attribute<3>>,
    faces: &Faces,
) -> io::Result<()> {
    let mut out = BufWriter::new(io::stdout().lock());
    for [x, y, z] in positions {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for [u, v] in uvs.map_or(&[][..], |uvs| &uvs.values) {
        writeln!(out, "vt {u} {v}")?;
    }
    for [x, y, z] in normals.map_or(&[][..], |normals| &normals.values) {
        writeln!(out, "vn {x} {y} {z}")?;
    }
    let mut corner = 0;
    for face in faces.iter() {
        write!(out, "f")?;
        for &vertex in face {
            let uv = index(uvs, corner, vertex);
            let normal = index(normals, corner, vertex);
            write!(out, " {}/{uv}/{normal}", vertex + 1)?;
            corner += 1;
        }
        writeln!(out)?;
    }
    out.flush()
}

/// Index of the value of a corner, from 1 on; empty without one.
fn index<const N: usize>(attribute: Option<&Attribute<N>>, corner: usize, vertex: u32) -> String {
    let Some(attribute) = attribute else {
        return String::new();
    };
    let element = match attribute.scope {
        Scope::Corner => corner,
        Scope::Vertex => vertex as usize,
        Scope::Face | Scope::Constant => return String::new(),
    };
    let index = match &attribute.indices {
        Some(indices) => indices.get(element).map(|&index| index as usize),
        None => Some(element),
    };
    index.map_or(String::new(), |index| (index + 1).to_string())
}
