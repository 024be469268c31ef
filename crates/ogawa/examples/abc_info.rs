//! Lists the objects of an Alembic file, with frames, times and extents of its meshes.
//!
//! ```text
//! cargo run --release -p ogawa --example abc_info -- walk.abc
//! ```

use ogawa::{
    Archive, Mesh, Result,
    archive::{Content, Property},
};
use std::{
    fs::File,
    io::{BufReader, Write},
    process::ExitCode,
};

type OpenArchive = Archive<BufReader<File>>;

fn main() -> ExitCode {
    let Some(path) = std::env::args_os().nth(1) else {
        eprintln!("expected a file: abc_info FILE");
        return ExitCode::FAILURE;
    };
    match describe(&path) {
        Ok(text) => {
            // A reader that closes the pipe has seen enough.
            let _ = std::io::stdout().write_all(text.as_bytes());
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("{}: {e}", path.to_string_lossy());
            ExitCode::FAILURE
        }
    }
}

fn describe(path: &std::ffi::OsStr) -> Result<String> {
    let mut archive = Archive::open(path)?;
    let mut text = format!(
        "library {}, {:?}\n",
        archive.library_version(),
        archive.metadata().text()
    );
    for (index, sampling) in archive.time_samplings().iter().enumerate() {
        text += &format!("time sampling {index}: {sampling:?}\n");
    }
    for (id, object) in archive.objects() {
        text += &format!("{:?} {:?}\n", archive.full_name(id), object.schema());
        describe_properties(&object.properties, 1, &mut text);
    }
    for mesh in archive.meshes()? {
        text += &describe_mesh(&mut archive, &mesh)?;
    }
    Ok(text)
}

fn describe_properties(properties: &[Property], depth: usize, text: &mut String) {
    for property in properties {
        let (indent, name) = ("  ".repeat(depth), &property.name);
        match &property.content {
            Content::Compound(properties) => {
                *text += &format!("{indent}{name:?}\n");
                describe_properties(properties, depth + 1, text);
            }
            Content::Samples(samples) => {
                let constant = if samples.is_constant() { ", constant" } else { "" };
                let (layout, data_type, count) = (samples.layout(), samples.data_type(), samples.count());
                *text += &format!("{indent}{name:?}: {layout:?} of {data_type}, {count} samples{constant}\n");
            }
        }
    }
}

fn describe_mesh(archive: &mut OpenArchive, mesh: &Mesh) -> Result<String> {
    let name = archive.full_name(mesh.object());
    let Some(last) = mesh.frames().checked_sub(1) else {
        return Ok(format!("mesh {name:?}: no frames\n"));
    };
    let (first_time, last_time) = (mesh.time(archive, 0), mesh.time(archive, last));
    let faces = mesh.faces(archive, 0)?.len();
    let mut text =
        format!("mesh {name:?}: {last} + 1 frames, {first_time} s to {last_time} s, {faces} faces\n");
    let mut positions = Vec::new();
    for frame in [0, last] {
        mesh.world_positions(archive, frame, &mut positions)?;
        let extent = |axis: usize| {
            let coordinates = || positions.iter().map(|p| p[axis]);
            let (low, high) = (
                coordinates().fold(f32::MAX, f32::min),
                coordinates().fold(f32::MIN, f32::max),
            );
            format!("{low:.4} to {high:.4}")
        };
        let [x, y, z] = [0, 1, 2].map(extent);
        text += &format!(
            "  frame {frame}: {} vertices, x {x}, y {y}, z {z}\n",
            positions.len()
        );
    }
    Ok(text)
}
