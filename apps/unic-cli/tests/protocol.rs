//! Contract: `--as` converts the folder of a published data set to a capture. `--protocol` measures
//! free running alone, over the number of frames of the protocol.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::*;
use glam::{Quat, Vec3};
use std::{f32::consts::FRAC_PI_2, fs, path::Path};
use unic_core::mesh::TriMesh;
use unic_io::{NpzWriter, write_obj};
use unic_testdata::{Figure, take};

/// Position of the template's pelvis in metres, Z up.
const PELVIS: Vec3 = Vec3::new(0.0, -0.0215, 0.9048);
/// Number of frames of a clip, more than the 300 of the VTO protocol.
const LONG: usize = 320;

/// Vector with Y up, turned to Z up: (x, −z, y).
fn z_up(v: Vec3) -> Vec3 {
    Vec3::new(v.x, -v.z, v.y)
}

/// Writes the tube in the layout of VirtualBones, and its character beside it.
fn virtual_bones(folder: &Path) {
    let figure = Figure::tube();
    unic_io::write_character(&folder.join("body.npz"), &figure.character).unwrap();
    let data = folder.join("dress");
    fs::create_dir(&data).unwrap();
    let (skeleton, rest) = (&figure.character.skeleton, &figure.garment.rest);
    let pelvis = skeleton.joints()[0];
    let template = rest.vertices.iter().map(|v| (z_up(*v - pelvis) + PELVIS) * 10.0);
    let template = TriMesh::new(template.collect(), rest.faces.clone()).unwrap();
    write_obj(&data.join("template.obj"), &template).unwrap();
    for seed in 0..3 {
        let take = take("motion", seed, LONG);
        let (mut pose, mut trans) = (Vec::new(), Vec::new());
        for frame in &take.clip.poses {
            let upright = Quat::from_rotation_x(FRAC_PI_2) * frame.local[0];
            let joints = std::iter::once(upright).chain(frame.local[1..].iter().copied());
            pose.extend(joints.flat_map(|q| q.to_scaled_axis().to_array()));
            trans.extend((z_up(frame.trans + pelvis) - PELVIS).to_array());
        }
        let sim_res: Vec<f32> = take
            .garment
            .iter()
            .flatten()
            .flat_map(|x| z_up(*x).to_array())
            .collect();
        let mut npz = NpzWriter::create(&data.join(format!("{seed}.npz"))).unwrap();
        npz.f32s("pose", &[LONG, JOINTS, 3], &pose).unwrap();
        npz.f32s("trans", &[LONG, 3], &trans).unwrap();
        npz.f32s("sim_res", &[LONG, VERTICES, 3], &sim_res).unwrap();
        npz.finish().unwrap();
    }
}

#[test]
fn a_data_set_is_converted_trained_on_and_measured() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    virtual_bones(path);
    let baselines = json(
        path,
        "eval --baselines dress --protocol virtualbones --character body.npz --as tube --json",
    );
    assert_eq!(baselines["protocol"], "virtualbones");
    let skinning = &baselines["baselines"]["skinning"];
    assert!(skinning["one_step"].is_null() && skinning["free_running"]["rmse_mm"].as_f64().unwrap() > 1.0);

    train(path, "tube.unic", "--steps 10");
    let measured = json(path, "eval tube.unic tube --protocol vto --json");
    let model = &measured["model"];
    assert!(model["one_step"].is_null());
    // The drift has one value per second: 300 frames are ten seconds at 30 fps.
    assert_eq!(model["free_running"]["drift_mm"].as_array().unwrap().len(), 10);
    let table = succeeds(path, "eval tube.unic tube --protocol vto");
    let expected = model["free_running"]["mean_vertex_error_mm"].as_f64().unwrap();
    assert!(
        table.contains(&format!("mean vertex error {expected:.2} mm")),
        "{table}"
    );

    let output = unic(path, "eval tube.unic dress --protocol virtualbones");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--as CAPTURE --character"));
}
