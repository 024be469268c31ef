//! Contract: a rigged character and its motion are read from glTF as other programs show them.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{data, largest_distance, posed};
use glam::{Quat, Vec3};
use serde_json::{Value, json};
use std::{fs, path::Path};
use unic_core::skinning::SkinningWeights;
use unic_io::{
    Capture, MotionOptions, UpAxis,
    glb::{GlbScene, GlbWriter},
    import_motion, inspect,
    inspect::FileKind,
    read_character,
    rigged::{CharacterOptions, RiggedCharacter, RiggedFormat, read_rigged_character},
    write_character,
};

/// Largest distance of a posed vertex of the file, which has four weights a vertex, from the truth,
/// metres. An independent calculation gives the same distance.
const FOUR_WEIGHTS_M: f32 = 3.6e-3;
/// Largest distance from the truth with the same weights, metres.
const EXACT_M: f32 = 2e-5;

fn read_gltf_character(path: &Path) -> unic_io::Result<RiggedCharacter> {
    read_rigged_character(path, RiggedFormat::Gltf, &CharacterOptions::default())
}

#[test]
fn the_walk_of_blender_is_that_of_the_capture() {
    let (Some(glb), Some(root)) = (data("interop/body_walk.glb"), data("captures/tshirt_blender")) else {
        return;
    };
    let capture = Capture::open(&root).unwrap();
    let truth = capture.load_clip("walk_02_01").unwrap().clip;
    let read = read_gltf_character(&glb).unwrap();
    assert!(largest_distance(&read.character.body.vertices, &capture.character.body.vertices) < 1e-5);
    assert_eq!(read.character.body.faces, capture.character.body.faces);
    assert_eq!(read.character.file_mesh, None, "nothing is welded");
    assert_eq!(read.character.skeleton.len(), 24);
    let mut four_weights = capture.character.clone();
    let rows = (0..3738).map(|v| capture.character.weights.row(v).take(4));
    four_weights.weights = SkinningWeights::from_rows(24, rows).unwrap();
    // On its own rig, and on the capture's character, whose zero pose is another one.
    for (character, truth_on, limit) in [
        (&read.character, &capture.character, FOUR_WEIGHTS_M),
        (&read.character, &four_weights, EXACT_M),
        (&capture.character, &capture.character, EXACT_M),
    ] {
        let import = import_motion(&glb, character, &MotionOptions::default()).unwrap();
        println!("{:?}", import.notes);
        assert_eq!((import.clip.len(), import.clip.fps), (150, 30.0));
        assert!(import.findings.is_empty());
        let far = (import.clip.poses.iter().zip(&truth.poses))
            .map(|(pose, truth)| largest_distance(&posed(character, pose), &posed(truth_on, truth)))
            .fold(0.0, f32::max);
        println!("{:.4} mm", 1e3 * far);
        assert!(far < limit, "{far} m");
    }
}

#[test]
fn the_walk_is_retargeted_to_another_character() {
    let Some(glb) = data("interop/body_walk.glb") else {
        return;
    };
    let mut parts = read_character(&glb).unwrap().skeleton.to_parts();
    // A body of another size.
    parts.joints.iter_mut().for_each(|joint| *joint *= 0.8);
    let mut character = read_character(&glb).unwrap();
    character.skeleton = unic_core::skeleton::Skeleton::new(parts).unwrap();
    character.body.vertices.iter_mut().for_each(|v| *v *= 0.8);
    // glTF states its axis, so that an option for other files has no effect.
    let options = MotionOptions {
        up: UpAxis::Z,
        ..MotionOptions::default()
    };
    let import = import_motion(&glb, &character, &options).unwrap();
    let notes = import.notes.join("; ");
    assert!(notes.contains("scaled by 0.8000"), "{notes}");
    let head = character.skeleton.joint("head").unwrap();
    let mut joints = Vec::new();
    for pose in &import.clip.poses {
        character.skeleton.forward_kinematics(pose, &mut joints);
        assert!(
            (1.1..1.4).contains(&joints[head].translation.y),
            "{:?}",
            joints[head]
        );
    }
}

/// A rod of two joints on a root that moves, 100 units tall below a node of scale 0.01 with Z up.
struct Rod {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Rod {
    fn add(&mut self, bytes: &[u8], kind: &str, component: u32, count: usize) -> usize {
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.views
            .push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }));
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": component, "count": count, "type": kind,
            "min": [0, 0, 0], "max": [0, 0, 0],
        }));
        self.accessors.len() - 1
    }

    fn floats(&mut self, values: &[f32], kind: &str, count: usize) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.add(&bytes, kind, 5126, count)
    }

    /// Writes the file, with changes of the document.
    fn write(path: &Path, change: impl FnOnce(&mut Value)) {
        let mut rod = Self {
            binary: Vec::new(),
            views: Vec::new(),
            accessors: Vec::new(),
        };
        // Z up, centimetres: two triangles at the bottom, one at the top, with a repeated vertex.
        let corners = [
            [0.0, 0.0, 0.0],
            [10.0, 0.0, 0.0],
            [0.0, 10.0, 0.0],
            [0.0, 0.0, 0.0],
            [0.0, 10.0, 0.0],
            [-10.0, 0.0, 0.0],
            [0.0, 0.0, 100.0],
            [10.0, 0.0, 100.0],
            [0.0, 10.0, 100.0_f32],
        ];
        let positions = rod.floats(corners.as_flattened(), "VEC3", 9);
        let joints: Vec<u8> = (0..9)
            .flat_map(|v| [if v < 6 { 1 } else { 2 }, 0, 0, 0])
            .collect();
        let joints = rod.add(&joints, "VEC4", 5121, 9);
        let weights: Vec<u8> = (0..9).flat_map(|_| [255, 0, 0, 0]).collect();
        let weights = rod.add(&weights, "VEC4", 5121, 9);
        rod.accessors[weights]["normalized"] = json!(true);
        // The joints: a root at the origin, one above it, one at half of the height.
        let bind = |z: f32| {
            let mut matrix = glam::Mat4::IDENTITY;
            matrix.w_axis.z = -z;
            matrix.to_cols_array()
        };
        let binds: Vec<f32> = [bind(0.0), bind(0.0), bind(50.0)].concat();
        let binds = rod.floats(&binds, "MAT4", 3);
        let times = rod.floats(&[0.0, 0.5, 1.0], "SCALAR", 3);
        let turn = Quat::from_rotation_x(1.0);
        let keys = [Quat::IDENTITY, Quat::IDENTITY.slerp(turn, 0.5), turn].map(|q| q.to_array());
        let turns = rod.floats(keys.as_flattened(), "VEC4", 3);
        let moves = rod.floats(&[0.0, 0.0, 0.0, 0.0, 50.0, 0.0, 0.0, 100.0, 0.0], "VEC3", 3);
        let upright = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2).to_array();
        let mut document = json!({
            "asset": { "version": "2.0" },
            "scene": 0, "scenes": [{ "nodes": [0] }],
            "nodes": [
                { "name": "armature", "children": [1, 4], "scale": [0.01, 0.01, 0.01], "rotation": upright },
                { "name": "root", "children": [2] },
                { "name": "hips", "children": [3] },
                { "name": "chest", "translation": [0, 0, 50] },
                { "name": "body", "mesh": 0, "skin": 0 },
            ],
            "meshes": [{ "primitives": [{ "attributes": {
                "POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights } }] }],
            "skins": [{ "joints": [1, 2, 3], "inverseBindMatrices": binds }],
            "animations": [{ "name": "bend", "channels": [
                { "sampler": 0, "target": { "node": 3, "path": "rotation" } },
                { "sampler": 1, "target": { "node": 2, "path": "translation" } },
            ], "samplers": [{ "input": times, "output": turns }, { "input": times, "output": moves }] }],
        });
        document["accessors"] = json!(rod.accessors);
        document["bufferViews"] = json!(rod.views);
        document["buffers"] = json!([{ "byteLength": rod.binary.len() }]);
        change(&mut document);
        let mut json = serde_json::to_vec(&document).unwrap();
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = 28 + json.len() + rod.binary.len();
        let word = |x: usize| (x as u32).to_le_bytes();
        let bytes = [
            b"glTF",
            &word(2)[..],
            &word(length),
            &word(json.len()),
            b"JSON",
            &json,
            &word(rod.binary.len()),
            b"BIN\0",
            &rod.binary,
        ]
        .concat();
        fs::write(path, bytes).unwrap();
    }
}

#[test]
fn units_axes_seams_and_idle_roots_are_converted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rod.glb");
    Rod::write(&path, |_| ());
    let read = read_gltf_character(&path).unwrap();
    let character = &read.character;
    assert_eq!(character.skeleton.names(), ["hips", "chest"]);
    assert!(character.skeleton.joints()[1].distance(Vec3::new(0.0, 0.5, 0.0)) < 1e-6);
    let mesh = character.file_mesh.as_ref().unwrap();
    assert_eq!(mesh.body_vertices, [0, 1, 2, 0, 2, 3, 4, 5, 6]);
    // A capture and a model keep it.
    let npz = folder.path().join("character.npz");
    write_character(&npz, character).unwrap();
    assert_eq!(read_character(&npz).unwrap(), *character);
    assert_eq!(character.body.faces, [[0, 1, 2], [0, 2, 3], [4, 5, 6]]);
    assert!(character.body.vertices[4].distance(Vec3::Y) < 1e-6);
    let notes = read.notes.join("; ");
    assert!(
        notes.contains("hips is the root") && notes.contains("7 of 9 vertices"),
        "{notes}"
    );

    let options = MotionOptions {
        fps_of_file: Some(20.0),
        ..MotionOptions::default()
    };
    let import = import_motion(&path, character, &options).unwrap();
    assert_eq!((import.clip.len(), import.clip.fps), (21, 20.0));
    // Half-way: moved by 0.5 m along the file's Y, which is -Z, and bent about X by half a radian.
    let chest = Quat::from_rotation_x(0.5) * Vec3::new(0.0, 0.5, 0.0);
    let expected = Vec3::new(0.0, 0.5, -0.5) + chest;
    let found = posed(character, &import.clip.poses[10])[4];
    assert!(found.distance(expected) < 1e-5, "{found} {expected}");
    let report = inspect(&path).unwrap();
    assert_eq!(report.kind, FileKind::Character);
    assert_eq!(report.get("animations"), Some("1: bend"));
}

/// The own writer keeps bind rotations and any number of weights, and reading takes both back.
#[test]
fn written_files_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.glb");
    let figure = unic_testdata::Figure::mixamo();
    let clip = unic_testdata::mixamo_clip("walk", 0, 20);
    let scene = GlbScene {
        name: "walk",
        character: &figure.character,
        garment: &figure.garment.rest,
        fps: 24.0,
        frames: clip.len(),
    };
    let mut writer = GlbWriter::create(&path, &scene).unwrap();
    for pose in &clip.poses {
        writer.push(pose, &figure.garment.rest.vertices).unwrap();
    }
    writer.finish().unwrap();
    let read = read_character(&path).unwrap();
    assert_eq!(read.skeleton.names(), figure.character.skeleton.names());
    for character in [&read, &figure.character] {
        let import = import_motion(&path, character, &MotionOptions::default()).unwrap();
        assert_eq!((import.clip.len(), import.clip.fps), (20, 24.0));
        for (found, truth) in import.clip.poses.iter().zip(&clip.poses) {
            let far = largest_distance(&posed(character, found), &posed(&figure.character, truth));
            assert!(far < 1e-5, "{far} m");
        }
    }
}

/// Change of a document, and words of the message about it.
type Fault<'a> = (&'a dyn Fn(&mut Value), &'a str);

#[test]
fn faults_are_named_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rod.glb");
    let two = |d: &mut Value| {
        d["nodes"][0]["children"] = json!([1, 4, 5]);
        d["nodes"]
            .as_array_mut()
            .unwrap()
            .push(json!({ "name": "hair", "mesh": 0, "skin": 0 }));
    };
    let changes: [Fault; 13] = [
        (&two, "body, hair"),
        (
            &|d| d["nodes"][4]["skin"] = Value::Null,
            "a skinned mesh, found none",
        ),
        (
            &|d| d["skins"][0]["inverseBindMatrices"] = Value::Null,
            "inverse bind matrices",
        ),
        (&|d| d["nodes"][3]["children"] = json!([1]), "a tree of nodes"),
        (
            &|d| d["nodes"][0]["scale"] = json!([0.01, 0.02, 0.01]),
            "same scale",
        ),
        (
            &|d| d["nodes"][0]["scale"] = json!([-0.01, 0.01, 0.01]),
            "not mirrored",
        ),
        (
            &|d| d["accessors"][0]["count"] = json!(4_000_000_000_u32),
            "accessor 0 inside its buffer",
        ),
        (
            &|d| d["bufferViews"][0]["byteOffset"] = json!(100_000),
            "accessor 0 inside its buffer",
        ),
        (
            &|d| d["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
            "glTF document",
        ),
        (
            &|d| d["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(99),
            "index 99 of",
        ),
        (
            &|d| d["animations"][0]["channels"][0]["target"]["node"] = json!(99),
            "index 99 of",
        ),
        (
            &|d| d["animations"][0]["channels"][0]["target"]["path"] = json!("turn"),
            "an unknown property",
        ),
        (
            &|d| d["meshes"][0]["primitives"][0]["mode"] = json!(1),
            "triangles",
        ),
    ];
    for (change, words) in changes {
        Rod::write(&path, change);
        let message = read_character(&path).unwrap_err().to_string();
        assert!(message.contains(words) && !message.contains('\n'), "{message}");
        assert!(message.starts_with(&path.display().to_string()), "{message}");
    }
    Rod::write(&path, |d| d["animations"] = json!([]));
    let character = read_character(&path).unwrap();
    let message = import_motion(&path, &character, &MotionOptions::default())
        .unwrap_err()
        .to_string();
    assert!(message.contains("an animation, found none"), "{message}");
}
