//! Contract: `unic export --onnx` writes a complete folder or says in one sentence why not. What
//! the graphs compute is the contract of `tests/onnx_graphs.py`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use std::{fs, path::Path};
use unic_core::Model;

/// Trains `tube.unic` and `paper.unic` on the capture `tube`.
fn models(folder: &Path) {
    write_capture(folder);
    train(folder, "tube.unic", "--steps 20");
    let sizes = "--set model.encoder.hidden=[8] --set model.field.width=8 --set batch.windows=4";
    succeeds(
        folder,
        &format!("train tube --preset paper {sizes} --steps 20 --out paper.unic"),
    );
}

/// The one sentence in which the program refuses a command.
fn refusal(folder: &Path, line: &str) -> String {
    let output = unic(folder, line);
    assert!(matches!(output.status.code(), Some(1 | 2)), "unic {line}");
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    stderr
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_folder_has_the_files_of_its_model_and_is_replaced_as_a_whole() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    models(folder);
    let summary = json(folder, "export tube.unic --onnx out/tube --json");
    assert_eq!(summary["vertices"].as_u64(), Some(VERTICES as u64));
    let mut listed = unic_onnx_files();
    listed.sort();
    assert_eq!(names(&folder.join("out/tube")), listed);
    // The description is written last: a folder that has one is complete.
    let written = summary["written"].as_array().unwrap();
    assert!(written.last().unwrap().as_str().unwrap().ends_with("model.json"));

    let error = refusal(folder, "export paper.unic --onnx out/tube");
    assert!(error.contains("--overwrite"), "{error}");
    succeeds(folder, "export paper.unic --onnx out/tube --overwrite");
    // The published method has no prior, and that of the other model is gone.
    listed.retain(|name| name != "prior.onnx");
    assert_eq!(names(&folder.join("out/tube")), listed);
}

#[test]
fn another_mesh_of_the_garment_gets_the_same_graphs() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    models(folder);
    let model = Model::from_bytes(&fs::read(folder.join("tube.unic")).unwrap()).unwrap();
    let mut mesh = model.garment().rest.clone();
    mesh.faces.truncate(mesh.faces.len() / 2);
    let used = mesh.faces.iter().flatten().max().unwrap();
    mesh.vertices.truncate(*used as usize + 1);
    mesh.uvs = None;
    unic_io::write_obj(&folder.join("half.obj"), &mesh).unwrap();
    succeeds(folder, "export tube.unic --onnx whole");
    let summary = json(
        folder,
        "export tube.unic --mesh half.obj --onnx half --force --json",
    );
    assert_eq!(summary["vertices"].as_u64(), Some(mesh.vertices.len() as u64));
    for name in unic_onnx_files().iter().filter(|name| name.ends_with(".onnx")) {
        let [whole, half] = ["whole", "half"].map(|of| fs::read(folder.join(of).join(name)).unwrap());
        assert_eq!(whole, half, "{name}");
    }
}

#[test]
fn models_that_cannot_be_exported_and_unusable_outputs_are_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    models(folder);
    fs::write(folder.join("file"), "").unwrap();
    let sampled = Model::from_bytes(&fs::read(folder.join("tube.unic")).unwrap())
        .unwrap()
        .with_sampling(0.5)
        .unwrap();
    fs::write(folder.join("sampled.unic"), sampled.to_bytes().unwrap()).unwrap();
    for (line, expected) in [
        ("export sampled.unic --onnx none", "samples"),
        ("export tube.unic --onnx file", "found a file"),
        ("export tube.unic --onnx tube", "a part of the capture"),
        ("export none.unic --onnx none", "none.unic"),
        ("export file --onnx none", "file"),
    ] {
        let error = refusal(folder, line);
        assert!(error.contains(expected), "{line}: {error}");
        assert!(!folder.join("none").exists(), "{line}");
    }
}

/// Names of all files of an export.
fn unic_onnx_files() -> Vec<String> {
    let stages = ["start", "tick", "motion", "skinning", "encoder", "prior", "field"];
    let graphs = stages.map(|stage| format!("{stage}.onnx"));
    let others = ["mesh.bin", "model.json"].map(str::to_owned);
    graphs.into_iter().chain(others).collect()
}
