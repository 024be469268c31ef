//! Contract of the GLB writer: files meet the demands of glTF, and the skin, the morph targets and
//! their animation reproduce every frame when they are evaluated by the specification. Other
//! readers check the same in tests/readers.py, tests/blender_readers.py and tests/glb.mjs.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod file;
mod refusals;
mod scene;

use file::Glb;
use glam::{Mat4, Quat, Vec3, Vec4};
use scene::{FRAMES, Scene, largest_distance};
use serde_json::Value;
use std::collections::BTreeMap;
use unic_core::{mesh::vertex_normals, skinning::SkinningWeights};

/// World transforms of the joints: node j is joint j.
fn world_from_joint(glb: &Glb, local: impl Fn(usize) -> (Vec3, Quat)) -> BTreeMap<usize, Mat4> {
    fn descend(
        glb: &Glb,
        node: usize,
        parent: Mat4,
        local: &impl Fn(usize) -> (Vec3, Quat),
        out: &mut BTreeMap<usize, Mat4>,
    ) {
        let (translation, rotation) = local(node);
        let world = parent * Mat4::from_rotation_translation(rotation, translation);
        out.insert(node, world);
        for child in file::indices(&glb.json["nodes"][node]["children"]) {
            descend(glb, child, world, local, out);
        }
    }
    let root = glb.json["skins"][0]["skeleton"].as_u64().unwrap() as usize;
    let mut out = BTreeMap::new();
    descend(glb, root, Mat4::IDENTITY, &local, &mut out);
    out
}

/// Translation and rotation of a node without animation.
fn rest_transform(glb: &Glb, node: usize) -> (Vec3, Quat) {
    let node = &glb.json["nodes"][node];
    let numbers = |key: &str| -> Vec<f32> { serde_json::from_value(node[key].clone()).unwrap() };
    (
        Vec3::from_slice(&numbers("translation")),
        Quat::from_slice(&numbers("rotation")),
    )
}

/// Translation and rotation of a node at a key of the animation.
fn key_transform(glb: &Glb, node: usize, frame: usize) -> (Vec3, Quat) {
    let (mut translation, mut rotation) = rest_transform(glb, node);
    for (target, path, output) in glb.channels() {
        match (target == node, path.as_str()) {
            (true, "rotation") => rotation = Quat::from_slice(&glb.rows(output)[frame]),
            (true, "translation") => translation = Vec3::from_slice(&glb.rows(output)[frame]),
            _ => {}
        }
    }
    (translation, rotation)
}

/// Positions of the skinned body, by §3.7.3.3 of the specification.
fn body(glb: &Glb, local: impl Fn(usize) -> (Vec3, Quat)) -> Vec<Vec3> {
    let worlds = world_from_joint(glb, local);
    let joints = file::indices(&glb.json["skins"][0]["joints"]);
    let inverse = glb.rows(glb.json["skins"][0]["inverseBindMatrices"].as_u64().unwrap() as usize);
    let world_from_bind: Vec<Mat4> = (joints.iter().zip(&inverse))
        .map(|(joint, m)| worlds[joint] * Mat4::from_cols_slice(m))
        .collect();
    let positions = glb.vectors(glb.attribute(0, "POSITION").unwrap());
    let mut out = vec![Vec3::ZERO; positions.len()];
    for set in 0.. {
        let Some(joints) = glb.attribute(0, &format!("JOINTS_{set}")) else {
            break;
        };
        let weights = glb.rows(glb.attribute(0, &format!("WEIGHTS_{set}")).unwrap());
        for (v, (joints, weights)) in glb.rows(joints).iter().zip(&weights).enumerate() {
            for (&joint, &weight) in joints.iter().zip(weights) {
                out[v] += weight * world_from_bind[joint as usize].transform_point3(positions[v]);
            }
        }
    }
    out
}

/// Weights of the garment's morph targets in each frame.
fn morph_weights(glb: &Glb) -> Vec<Vec<f32>> {
    let mut outputs = (glb.channels().into_iter()).filter(|(_, path, _)| path == "weights");
    let flat: Vec<f32> = glb.rows(outputs.next().unwrap().2).concat();
    flat.chunks_exact(FRAMES - 1).map(<[f32]>::to_vec).collect()
}

/// Positions or normals of the garment with these morph weights.
fn garment(glb: &Glb, weights: &[f32], semantic: &str) -> Vec<Vec3> {
    let primitive = &glb.json["meshes"][1]["primitives"][0];
    let mut out = glb.vectors(glb.attribute(1, semantic).unwrap());
    for (target, &weight) in primitive["targets"].as_array().unwrap().iter().zip(weights) {
        let deltas = glb.vectors(target[semantic].as_u64().unwrap() as usize);
        out.iter_mut().zip(deltas).for_each(|(v, d)| *v += weight * d);
    }
    out
}

#[test]
fn body_equals_skinning_in_every_frame() {
    let scene = Scene::new();
    let glb = scene.write();
    for (frame, expected) in scene.body_frames().iter().enumerate() {
        let found = body(&glb, |node| key_transform(&glb, node, frame));
        assert!(largest_distance(&found, expected) < 3e-6, "frame {frame}");
    }
}

#[test]
fn nodes_show_the_first_frame() {
    let scene = Scene::new();
    let glb = scene.write();
    let found = body(&glb, |node| rest_transform(&glb, node));
    assert!(largest_distance(&found, &scene.body_frames()[0]) < 3e-6);
    let found = garment(&glb, &[], "POSITION");
    assert_eq!(found[..scene.garment.vertices.len()], scene.frames[0]);
}

#[test]
fn garment_is_exact_at_frames_and_linear_between() {
    let scene = Scene::new();
    let glb = scene.write();
    let weights = morph_weights(&glb);
    let count = scene.garment.vertices.len();
    for (frame, expected) in scene.frames.iter().enumerate() {
        let found = garment(&glb, &weights[frame], "POSITION");
        assert!(
            largest_distance(&found[..count], expected) < 3e-7,
            "frame {frame}"
        );
    }
    let between: Vec<f32> = (weights[3].iter().zip(&weights[4]))
        .map(|(a, b)| 0.75 * a + 0.25 * b)
        .collect();
    let expected: Vec<Vec3> = (scene.frames[3].iter().zip(&scene.frames[4]))
        .map(|(a, b)| a.lerp(*b, 0.25))
        .collect();
    let found = garment(&glb, &between, "POSITION");
    assert!(largest_distance(&found[..count], &expected) < 3e-7);
}

#[test]
fn normals_belong_to_each_frame() {
    let scene = Scene::new();
    let glb = scene.write();
    let weights = morph_weights(&glb);
    let mut expected = Vec::new();
    for frame in [0, 1, FRAMES - 1] {
        vertex_normals(&scene.frames[frame], &scene.garment.faces, &mut expected);
        let found = garment(&glb, &weights[frame], "NORMAL");
        assert!(
            largest_distance(&found[..expected.len()], &expected) < 1e-6,
            "frame {frame}"
        );
    }
}

#[test]
fn seam_copies_stay_together() {
    let scene = Scene::new();
    let glb = scene.write();
    let (uvs, count) = (scene.garment.uvs.as_ref().unwrap(), scene.garment.vertices.len());
    let found = glb.rows(glb.attribute(1, "TEXCOORD_0").unwrap());
    let last = garment(&glb, &morph_weights(&glb)[FRAMES - 1], "POSITION");
    let corners = glb.rows(
        glb.json["meshes"][1]["primitives"][0]["indices"]
            .as_u64()
            .unwrap() as usize,
    );
    assert!(found.len() > count && corners.len() == 3 * scene.garment.faces.len());
    let expected = scene
        .garment
        .faces
        .as_flattened()
        .iter()
        .zip(uvs.faces.as_flattened());
    for (corner, (&vertex, &uv)) in corners.iter().zip(expected) {
        let (corner, uv) = (corner[0] as usize, uvs.coordinates[uv as usize]);
        assert_eq!(found[corner], [uv.x, 1.0 - uv.y]);
        assert!(last[corner].distance(scene.frames[FRAMES - 1][vertex as usize]) < 3e-7);
    }
}

#[test]
fn influences_are_complete_and_heaviest_first() {
    let scene = Scene::new();
    let glb = scene.write();
    let set = |name: &str| glb.rows(glb.attribute(0, name).unwrap());
    let (joints, weights) = (
        [set("JOINTS_0"), set("JOINTS_1")],
        [set("WEIGHTS_0"), set("WEIGHTS_1")],
    );
    assert!(glb.attribute(0, "JOINTS_2").is_none());
    for v in 0..scene.character.body.vertices.len() {
        let row: Vec<f32> = weights.iter().flat_map(|set| set[v].clone()).collect();
        let used: Vec<u32> = (joints.iter().flat_map(|set| set[v].clone()).zip(&row))
            .filter(|(joint, weight)| {
                assert!(**weight > 0.0 || *joint == 0.0, "padding is joint 0");
                **weight > 0.0
            })
            .map(|(joint, _)| joint as u32)
            .collect();
        let distinct: std::collections::BTreeSet<_> = used.iter().collect();
        assert_eq!(distinct.len(), used.len(), "vertex {v}");
        assert!(row.is_sorted_by(|a, b| a >= b));
        // The tolerance of the Khronos validator.
        assert!(
            (row.iter().sum::<f32>() - 1.0).abs() <= 2e-7 * used.len() as f32,
            "vertex {v}"
        );
    }
}

#[test]
fn more_than_256_joints_are_written() {
    let scene = Scene::new().with_joint_chain(300);
    let glb = scene.write();
    let joints = glb.attribute(0, "JOINTS_0").unwrap();
    assert_eq!(glb.json["accessors"][joints]["componentType"], 5123);
    let found = body(&glb, |node| key_transform(&glb, node, FRAMES - 1));
    let distance = largest_distance(&found, &scene.body_frames()[FRAMES - 1]);
    // 300 products round by 6e-8 m each on both sides; a wrong joint is centimetres away.
    assert!(distance < 5e-5, "{distance} m");
}

#[test]
fn duplicate_influences_are_merged() {
    let mut scene = Scene::new();
    let rows = (0..scene.character.body.vertices.len()).map(|_| [(2, 0.4), (0, 0.35), (2, 0.25)].into_iter());
    scene.character.weights = SkinningWeights::from_rows(6, rows).unwrap();
    let glb = scene.write();
    let row = |name: &str| glb.rows(glb.attribute(0, name).unwrap())[0].clone();
    assert_eq!(row("JOINTS_0"), [2.0, 0.0, 0.0, 0.0]);
    assert_eq!(row("WEIGHTS_0"), [0.4 + 0.25, 0.35, 0.0, 0.0]);
}

#[test]
fn normals_without_a_face_are_unit_vectors() {
    let mut scene = Scene::new();
    scene.garment.vertices.push(Vec3::ZERO);
    scene.frames.iter_mut().for_each(|frame| frame.push(Vec3::ZERO));
    let glb = scene.write();
    for mesh in [0, 1] {
        let normals = glb.vectors(glb.attribute(mesh, "NORMAL").unwrap());
        assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    }
}

#[test]
fn rotations_are_unit_and_sign_continuous() {
    let glb = Scene::new().write();
    for (_, path, output) in glb.channels() {
        if path == "rotation" {
            let keys: Vec<Vec4> = glb.rows(output).iter().map(|q| Vec4::from_slice(q)).collect();
            assert!(keys.iter().all(|q| (q.length() - 1.0).abs() < 1e-6));
            assert!(keys.windows(2).all(|pair| pair[0].dot(pair[1]) >= 0.0));
        }
    }
}

#[test]
fn chunks_views_and_accessors_are_aligned_and_in_bounds() {
    let glb = Scene::new().write();
    let views = glb.json["bufferViews"].as_array().unwrap();
    let mut end = 0;
    for view in views {
        let (offset, length) = (
            file::number(&view["byteOffset"]),
            file::number(&view["byteLength"]),
        );
        assert!(offset == end && offset % 4 == 0 && length > 0);
        end += length;
    }
    assert_eq!(end, glb.binary.len());
    assert_eq!(file::number(&glb.json["buffers"][0]["byteLength"]), end);
    for accessor in glb.json["accessors"].as_array().unwrap() {
        let view = &views[file::number(&accessor["bufferView"])];
        let bytes = file::number(&accessor["count"]) * file::element_size(accessor);
        assert!(bytes > 0 && file::offset(accessor) + bytes <= file::number(&view["byteLength"]));
        if let Some(stride) = view.get("byteStride") {
            assert_eq!(file::number(stride), file::element_size(accessor));
        }
    }
}

#[test]
fn required_bounds_are_exact() {
    let glb = Scene::new().write();
    let mut demanded: Vec<usize> = vec![
        glb.attribute(0, "POSITION").unwrap(),
        glb.attribute(1, "POSITION").unwrap(),
    ];
    let targets = glb.json["meshes"][1]["primitives"][0]["targets"]
        .as_array()
        .unwrap();
    demanded.extend(targets.iter().map(|target| file::number(&target["POSITION"])));
    let samplers = glb.json["animations"][0]["samplers"].as_array().unwrap();
    demanded.extend(samplers.iter().map(|sampler| file::number(&sampler["input"])));
    for accessor in demanded {
        let rows = glb.rows(accessor);
        let bound = |fold: fn(f32, f32) -> f32| -> Vec<f64> {
            let column = |c: usize| rows.iter().map(|row| row[c]).reduce(fold).unwrap();
            (0..rows[0].len()).map(|c| f64::from(column(c))).collect()
        };
        let bounds_of = |key: &str| -> Vec<f64> {
            serde_json::from_value(glb.json["accessors"][accessor][key].clone()).unwrap()
        };
        assert_eq!(
            (bounds_of("min"), bounds_of("max")),
            (bound(f32::min), bound(f32::max))
        );
    }
}

#[test]
fn keys_have_the_frame_rate() {
    let glb = Scene::new().write();
    let animation = &glb.json["animations"][0];
    assert_eq!(animation["name"], "walk");
    let times = glb.rows(file::number(&animation["samplers"][0]["input"]));
    assert_eq!(times.len(), FRAMES);
    for (frame, time) in times.iter().enumerate() {
        assert_eq!(time[0], frame as f32 / scene::FPS);
    }
    for sampler in animation["samplers"].as_array().unwrap() {
        assert_eq!(sampler["interpolation"], "LINEAR");
    }
}

#[test]
fn nodes_and_materials_are_named_and_garments_double_sided() {
    let scene = Scene::new();
    let glb = scene.write();
    let names: Vec<&str> = (glb.json["nodes"].as_array().unwrap().iter())
        .map(|node| node["name"].as_str().unwrap())
        .collect();
    let mut expected: Vec<&str> = scene
        .character
        .skeleton
        .names()
        .iter()
        .map(String::as_str)
        .collect();
    expected.extend(["body", "garment"]);
    assert_eq!(names, expected);
    let of = |mesh: usize| {
        let material = file::number(&glb.json["meshes"][mesh]["primitives"][0]["material"]);
        glb.json["materials"][material].clone()
    };
    assert_eq!(
        (&of(0)["doubleSided"], &of(1)["doubleSided"]),
        (&Value::Null, &Value::Bool(true))
    );
    let targets = glb.json["meshes"][1]["extras"]["targetNames"].as_array().unwrap();
    assert_eq!(
        (targets.len(), &targets[0]),
        (FRAMES - 1, &Value::from("frame_0001"))
    );
}

#[test]
fn single_frame_has_no_targets() {
    let glb = Scene::new().cut(1).write();
    let primitive = &glb.json["meshes"][1]["primitives"][0];
    assert!(primitive.get("targets").is_none() && glb.json["meshes"][1].get("extras").is_none());
    assert!(glb.channels().iter().all(|(_, path, _)| path != "weights"));
    assert!(
        glb.json["bufferViews"]
            .as_array()
            .unwrap()
            .iter()
            .all(|view| file::number(&view["byteLength"]) > 0)
    );
}

#[test]
fn writing_is_deterministic() {
    assert_eq!(Scene::new().bytes(), Scene::new().bytes());
}
