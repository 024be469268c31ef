//! Copies the meshes of an Alembic file into a new one: world positions, faces, texture coordinates
//! and normals by vertex. Transforms become part of the positions.
//!
//! ```text
//! cargo run --release -p ogawa --example abc_copy -- walk.abc copy.abc
//! ```

use ogawa::{
    Archive, ArchiveWriter, FrameTiming, Mesh, MeshDescription, ObjectId, Scope, archive::TimeSampling,
};
use std::{collections::HashSet, error, fs::File, io::BufReader};

fn main() -> Result<(), Box<dyn error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [from, to] = arguments.as_slice() else {
        return Err("expected two files: abc_copy FROM TO".into());
    };
    let mut archive = Archive::open(from)?;
    let meshes = archive.meshes()?;
    let mut writer = ArchiveWriter::create(to, timing(&archive, &meshes))?;
    let mut names = HashSet::new();
    for mesh in meshes.iter().filter(|mesh| mesh.frames() > 0) {
        let mut name = name(&archive, mesh).to_owned();
        // Names that differed by their parents need to differ by themselves.
        while !names.insert(name.clone()) {
            name.push('_');
        }
        copy(&mut archive, mesh, &name, &mut writer)?;
    }
    writer.save()?;
    Ok(())
}

/// Name that programs show: that of the transform around a mesh if there is one.
fn name<'a>(archive: &'a Archive<BufReader<File>>, mesh: &'a Mesh) -> &'a str {
    match archive.object(mesh.object()).parent() {
        Some(parent) if parent != ObjectId::TOP => &archive.object(parent).name,
        _ => mesh.name(),
    }
}

/// Frame rate of the first mesh that has several frames, and the time of its frame 0.
fn timing(archive: &Archive<BufReader<File>>, meshes: &[Mesh]) -> FrameTiming {
    let mesh = meshes.iter().find(|mesh| mesh.frames() > 1);
    let start = mesh.map_or(0.0, |mesh| mesh.time(archive, 0));
    let step = mesh.map_or(1.0, |mesh| mesh.time(archive, 1) - start);
    let uniform = |sampling: &&TimeSampling| matches!(sampling, TimeSampling::Uniform { .. });
    assert!(
        archive.time_samplings().iter().all(|s| uniform(&s)),
        "samples at equal distances"
    );
    FrameTiming {
        fps: 1.0 / step,
        start,
    }
}

fn copy(
    archive: &mut Archive<BufReader<File>>,
    mesh: &Mesh,
    name: &str,
    writer: &mut ArchiveWriter<ogawa::NewFile>,
) -> ogawa::Result<()> {
    let (faces, uvs) = (mesh.faces(archive, 0)?, mesh.uvs(archive, 0)?);
    let mut positions = Vec::new();
    mesh.world_positions(archive, 0, &mut positions)?;
    let id = writer.add_mesh(&MeshDescription {
        name,
        vertices: positions.len(),
        faces: &faces,
        uvs: uvs.as_ref(),
    })?;
    for frame in 0..mesh.frames() {
        mesh.world_positions(archive, frame, &mut positions)?;
        let normals = mesh.normals(archive, frame)?;
        match normals.filter(|normals| normals.scope == Scope::Vertex && normals.indices.is_none()) {
            Some(normals) => writer.push_with_normals(id, &positions, &normals.values)?,
            None => writer.push(id, &positions)?,
        }
    }
    Ok(())
}
