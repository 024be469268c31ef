//! The command `unic export`: writes a model as ONNX graphs.

use crate::{
    args::ExportArgs,
    model_file,
    output::{print, print_json},
    outputs::{Existing, Outputs},
};
use anyhow::{Context, Result, anyhow};
use serde::Serialize;
use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};
use unic_core::Model;
use unic_io::{atomic, check, counted, read_obj};

/// Makes the graphs of a model and writes them.
///
/// # Errors
/// Unusable options or inputs, a model that no graph can be made of, a file that cannot be written.
pub(crate) fn run(args: &ExportArgs) -> Result<()> {
    let names = unic_onnx::FILES.map(str::to_owned);
    Outputs::with_inputs([&args.model].into_iter().chain(&args.mesh))
        .folder(&args.onnx, names)
        .check(Existing::of(args.overwrite))?;
    let model = read_model(args)?;
    let files = unic_onnx::export(&model).map_err(|e| anyhow!("{}: {e}", args.model.display()))?;
    let written = write(&args.onnx, &files)?;
    print_summary(args, &model, written)
}

/// Reads the model, with the mesh of `--mesh` if there is one.
fn read_model(args: &ExportArgs) -> Result<Model> {
    let model = model_file::read(&args.model)?;
    let Some(path) = &args.mesh else { return Ok(model) };
    let mesh = read_obj(path)?;
    args.force
        .check_findings(path, &check::other_mesh(&mesh, &model.garment().rest))?;
    model
        .with_mesh(mesh)
        .map_err(|e| anyhow!("{}: {e}", path.display()))
}

/// Writes the files and returns their paths.
///
/// The description is removed first and written last: a folder that has one is complete.
fn write(folder: &Path, files: &[unic_onnx::ExportFile]) -> Result<Vec<PathBuf>> {
    remove(&folder.join(unic_onnx::DESCRIPTION))?;
    // Files of another model that this one does not have.
    let kept = |name: &&str| files.iter().any(|file| file.name == *name);
    for name in unic_onnx::FILES.iter().filter(|name| !kept(name)) {
        remove(&folder.join(name))?;
    }
    let (last, first): (Vec<_>, Vec<_>) = files.iter().partition(|file| file.name == unic_onnx::DESCRIPTION);
    let mut written = Vec::new();
    for file in first.into_iter().chain(last) {
        let path = folder.join(&file.name);
        atomic::write(&path, &file.bytes)?;
        written.push(path);
    }
    Ok(written)
}

fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| format!("{}: cannot remove the earlier file", path.display()))
        }
        _ => Ok(()),
    }
}

/// Object that `--json` prints.
#[derive(Serialize)]
struct Exported<'a> {
    folder: &'a Path,
    vertices: usize,
    joints: usize,
    fps: f32,
    written: Vec<PathBuf>,
}

fn print_summary(args: &ExportArgs, model: &Model, written: Vec<PathBuf>) -> Result<()> {
    let exported = Exported {
        folder: &args.onnx,
        vertices: model.vertex_count(),
        joints: model.character().skeleton.len(),
        fps: model.config().fps,
        written,
    };
    if args.json {
        return print_json(&exported);
    }
    let paths: Vec<String> = (exported.written.iter())
        .map(|path| format!("  {}\n", path.display()))
        .collect();
    print(&format!(
        "{} vertices and {} at {} fps\n{}",
        exported.vertices,
        counted(exported.joints, "joint"),
        exported.fps,
        paths.concat()
    ))
}
