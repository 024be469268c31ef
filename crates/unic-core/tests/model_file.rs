//! Contract of the model file: a written model reads back with the same bytes and opens in Python.
//!
//! Damaged files are refused in one sentence, without a panic and without allocating more memory
//! than the file's size explains. The checksum detects every changed byte, and the reader behind it
//! is just as safe without.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;
#[path = "model_file/components.rs"]
mod components;

use common::*;
use glam::Vec2;
use proptest::prelude::*;
use serde_json::{Value, json};
use std::{process::Command, sync::Arc};
use unic_core::{
    Animator, Model, ModelFileError,
    config::ProjectionConfig,
    mesh::Uvs,
    model::ModelParts,
    model_file::{FORMAT_VERSION, Integrity, verify_checksum},
    projection::{StrainLimit, limited_pairs},
    skinning::SkinningWeights,
};

/// A small model with every optional tensor.
fn full_parts() -> ModelParts {
    let mut parts = parts(&variant("second order"));
    parts.garment.mask = Some(graded(13, 12));
    let weights = &parts.garment.weights;
    let joints = weights.joint_count();
    let turned = (0..weights.len()).map(|v| weights.row(v).map(move |(j, w)| ((j + 1) % joints, w)));
    parts.garment.carriers = Some(SkinningWeights::from_rows(joints, turned).unwrap());
    parts.garment.rest.uvs = Some(Uvs {
        coordinates: parts
            .garment
            .rest
            .vertices
            .iter()
            .map(|v| Vec2::new(v.x, v.y))
            .collect(),
        faces: parts.garment.rest.faces.clone(),
    });
    parts
}

/// The file of [`full_parts`], with sampling.
fn full() -> Vec<u8> {
    let model = Model::new(full_parts()).unwrap();
    model.with_sampling(0.5).unwrap().to_bytes().unwrap()
}

/// Returns the file with a changed header.
fn with_header(bytes: &[u8], change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let mut header: Value = serde_json::from_slice(&bytes[8..8 + length]).unwrap();
    change(&mut header);
    let mut header = serde_json::to_vec(&header).unwrap();
    header.resize(header.len().next_multiple_of(8), b' ');
    [
        &(header.len() as u64).to_le_bytes()[..],
        &header,
        &bytes[8 + length..],
    ]
    .concat()
}

/// Returns the file with changed `unic` metadata.
fn with_metadata(bytes: &[u8], change: impl FnOnce(&mut Value)) -> Vec<u8> {
    with_header(bytes, |header| {
        let text = &mut header["__metadata__"]["unic"];
        let mut metadata: Value = serde_json::from_str(text.as_str().unwrap()).unwrap();
        change(&mut metadata);
        *text = json!(metadata.to_string());
    })
}

/// Returns the error for a damaged file, whose checksum is skipped.
fn refusal(bytes: &[u8]) -> String {
    unchecked(bytes).expect_err("a damaged file").to_string()
}

/// Reads a file without its checksum, which would refuse most damage.
fn unchecked(bytes: &[u8]) -> Result<Model, ModelFileError> {
    Model::from_bytes_with(bytes, Integrity::Skip)
}

/// Reads a file without its checksum, and checks that it allocates in proportion to its size.
fn read_frugally(bytes: &[u8]) -> Result<Model, ModelFileError> {
    let mut result = None;
    let counted = allocation_counter::measure(|| result = Some(unchecked(bytes)));
    let allowed = 40 * bytes.len() as u64 + (1 << 20);
    assert!(
        counted.bytes_max <= allowed,
        "{} bytes for a file of {}",
        counted.bytes_max,
        bytes.len()
    );
    result.unwrap()
}

#[test]
fn models_read_back_with_the_same_bytes_and_move_the_same_way() {
    let poses = motion(5);
    for parts in variants().iter().map(parts).chain([full_parts()]) {
        let model = Model::new(parts.clone()).unwrap();
        let bytes = model.to_bytes().unwrap();
        assert_eq!(model.to_bytes().unwrap(), bytes);
        let read = read_frugally(&bytes).unwrap();
        assert!(Model::from_bytes(&bytes).unwrap().to_bytes().unwrap() == bytes);
        assert_eq!(read.to_parts(), parts);
        assert!(read.to_bytes().unwrap() == bytes);
        let [written, read] = [model, read].map(|m| run(&mut Animator::new(Arc::new(m)), &poses));
        assert_eq!(written, read);
    }
}

#[test]
fn a_model_on_another_mesh_reads_back_with_the_same_bytes() {
    let model = Model::new(full_parts()).unwrap();
    let mesh = tube(17, 9, 0.26).rest;
    let bytes = model.with_mesh(mesh).unwrap().to_bytes().unwrap();
    assert!(Model::from_bytes(&bytes).unwrap().to_bytes().unwrap() == bytes);
}

#[test]
fn every_changed_byte_is_detected() {
    let bytes = full();
    let tensors = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    for at in tensors..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 8);
        assert!(
            matches!(Model::from_bytes(&damaged), Err(ModelFileError::Damaged { .. })),
            "byte {at}"
        );
    }
    // Damage to the header may be found before the checksum.
    for at in 0..tensors {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 7);
        assert!(Model::from_bytes(&damaged).is_err(), "byte {at}");
    }
}

#[test]
fn a_wrong_checksum_is_an_error_that_can_be_skipped() {
    let sound = full();
    let expected = verify_checksum(&sound).unwrap().unwrap();
    // The lowest bit of a weight, which no other check detects.
    let bytes = with_data(&sound, "encoder.0.weight", |data| data[0] ^= 1);
    let Err(ModelFileError::Damaged {
        expected: written,
        found,
    }) = Model::from_bytes(&bytes)
    else {
        panic!("a damaged file is read");
    };
    assert_eq!(written, expected);
    assert!(
        found != written && found.starts_with("crc32:") && found.len() == 14,
        "{found}"
    );
    let sentence = Model::from_bytes(&bytes).unwrap_err().to_string();
    assert!(
        sentence.starts_with("the file is damaged: expected"),
        "{sentence}"
    );
    assert_eq!(verify_checksum(&bytes).unwrap_err().to_string(), sentence);
    run(
        &mut Animator::new(Arc::new(unchecked(&bytes).unwrap())),
        &motion(4),
    );
}

#[test]
fn files_without_a_checksum_are_read_and_other_kinds_refused() {
    let bytes = full();
    let without = with_metadata(&bytes, |m| {
        assert!(m.as_object_mut().unwrap().remove("checksum").is_some());
    });
    assert_eq!(verify_checksum(&without).unwrap(), None);
    assert!(Model::from_bytes(&without).unwrap().to_bytes().unwrap() == bytes);
    for other in [
        json!("md5:0"),
        json!("crc32:"),
        json!(7),
        json!(["crc32:00000000"]),
    ] {
        let bytes = with_metadata(&bytes, |m| m["checksum"] = other.clone());
        assert!(
            matches!(Model::from_bytes(&bytes), Err(ModelFileError::UnknownChecksum(_))),
            "{other}"
        );
    }
    let wrong = with_metadata(&bytes, |m| m["checksum"] = json!("crc32:0000000G"));
    assert!(matches!(
        Model::from_bytes(&wrong),
        Err(ModelFileError::Damaged { .. })
    ));
}

#[test]
fn text_that_looks_like_a_checksum_is_not_taken_for_it() {
    let mut parts = full_parts();
    parts.about.provenance = "crc32:00000000".into();
    let bytes = Model::new(parts).unwrap().to_bytes().unwrap();
    assert!(Model::from_bytes(&bytes).unwrap().to_bytes().unwrap() == bytes);
}

/// The tube is fine enough for chords, whose limits a file of edges alone does not have.
#[test]
fn limits_of_other_lengths_are_refused() {
    let variant = variant("second order");
    let mut parts = parts(&variant);
    parts.garment = tube(60, 24, 0.2);
    parts.prior = prior(parts.garment.rest.vertices.len(), variant.components);
    let mut config = ProjectionConfig::default();
    let all = limited_pairs(&config, &parts.garment.rest).len();
    config.coarse_sweeps = 0;
    let edges = limited_pairs(&config, &parts.garment.rest).len();
    parts.strain_limits = vec![
        StrainLimit {
            shortest: 0.0,
            longest: 1.0,
        };
        edges
    ];
    parts.config.projection = Some(config);
    let bytes = Model::new(parts).unwrap().to_bytes().unwrap();
    assert!(Model::from_bytes(&bytes).is_ok());
    let with_levels = with_metadata(&bytes, |m| {
        m["config"]["projection"]["coarse_sweeps"] = json!(4);
    });
    let expected = format!("expected {all} limits of lengths, found {edges}");
    assert!(
        refusal(&with_levels).contains(&expected),
        "{}",
        refusal(&with_levels)
    );
}

/// Python program that prints name, type, shape and sum of every tensor, and the metadata.
const PYTHON: &str = "
import json, sys
from safetensors import safe_open
with safe_open(sys.argv[1], framework='numpy') as f:
    tensors = {k: [str(f.get_tensor(k).dtype), list(f.get_tensor(k).shape), float(f.get_tensor(k).astype('f8').sum())] for k in f.keys()}
    print(json.dumps([tensors, json.loads(f.metadata()['unic'])]))
";

#[test]
fn python_opens_it() {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let has = Command::new(&python)
        .args(["-c", "import numpy, safetensors"])
        .output();
    if !has.is_ok_and(|o| o.status.success()) {
        eprintln!("skipped: {python} has no packages numpy and safetensors");
        return;
    }
    let file = std::env::temp_dir().join(format!("unic-{}.unic", std::process::id()));
    std::fs::write(&file, full()).unwrap();
    let output = Command::new(&python)
        .args(["-c", PYTHON])
        .arg(&file)
        .output()
        .unwrap();
    std::fs::remove_file(&file).unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let seen: Value = serde_json::from_slice(&output.stdout).unwrap();
    let (tensors, metadata, parts) = (&seen[0], &seen[1], full_parts());
    assert_eq!(metadata["version"], FORMAT_VERSION);
    assert_eq!(metadata["config"]["field"]["width"], 18);
    assert_eq!(metadata["about"]["name"], "tube");
    let vertices = parts.garment.rest.vertices.len();
    assert_eq!(tensors["field.0.weight"][0], "float32");
    assert_eq!(tensors["field.0.weight"][1], json!([18, 15 + 6]));
    assert_eq!(tensors["garment.vertices"][1], json!([vertices, 3]));
    assert_eq!(tensors["garment.faces"][0], "uint32");
    assert_eq!(tensors["prior.shapes"][0], "int16");
    assert_eq!(tensors["prior.shapes"][1], json!([vertices, 3, 3]));
    let sum: f64 = parts.field[0].weight.iter().map(|w| f64::from(*w)).sum();
    assert!((tensors["field.0.weight"][2].as_f64().unwrap() - sum).abs() < 1e-9);
}

#[test]
fn a_truncated_file_is_refused_wherever_it_ends() {
    let bytes = full();
    let header = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let edges = [0, 1, 7, 8, 9, header - 1, header, header + 1, bytes.len() - 1];
    for end in edges.into_iter().chain((0..bytes.len()).step_by(97)) {
        assert!(
            read_frugally(&bytes[..end]).is_err(),
            "{end} of {} bytes",
            bytes.len()
        );
    }
    assert!(
        read_frugally(&[bytes.clone(), vec![0]].concat()).is_err(),
        "one byte too many"
    );
}

#[test]
fn other_files_are_refused() {
    assert!(refusal(b"o garment\nv 0 0 0\n").contains("expected a unic model (safetensors)"));
    assert!(refusal(&u64::MAX.to_le_bytes()).contains("expected a unic model (safetensors)"));
    let plain = with_header(&full(), |header| header["__metadata__"] = json!({"format": "pt"}));
    assert!(matches!(Model::from_bytes(&plain), Err(ModelFileError::NotUnic)));
    let bare = with_header(&full(), |header| {
        header.as_object_mut().unwrap().remove("__metadata__");
    });
    assert!(matches!(Model::from_bytes(&bare), Err(ModelFileError::NotUnic)));
    let text = with_header(&full(), |header| header["__metadata__"]["unic"] = json!("unic"));
    assert!(matches!(unchecked(&text), Err(ModelFileError::Metadata(_))));
    let unknown = with_metadata(&full(), |m| m["config"]["gain"] = json!(1));
    assert!(refusal(&unknown).contains("gain"));
}

#[test]
fn other_versions_are_refused_whatever_their_metadata() {
    for (version, found) in [
        (json!(0), 0),
        (json!(FORMAT_VERSION + 1), FORMAT_VERSION + 1),
        (json!(u32::MAX), u32::MAX),
        (json!("one"), 0),
        (Value::Null, 0),
    ] {
        let bytes = with_metadata(&full(), |m| *m = json!({"version": version, "unknown": "key"}));
        let error = Model::from_bytes(&bytes).unwrap_err();
        let expected = FORMAT_VERSION;
        assert!(
            matches!(error, ModelFileError::Version { expected: e, found: f } if (e, f) == (expected, found)),
            "{error}"
        );
    }
}

#[test]
fn a_misspelt_tensor_is_named() {
    let bytes = full();
    let mut names = Vec::new();
    with_header(&bytes, |header| {
        names.extend(
            header
                .as_object()
                .unwrap()
                .keys()
                .filter(|k| *k != "__metadata__")
                .cloned(),
        )
    });
    assert_eq!(
        names.len(),
        2 * (3 + 5 + 1 + 5 + 1) + 1 + 4 + 3 + 3 + 5 + 3 + 3 + 5 + 3 + 2,
        "{names:?}"
    );
    for name in names {
        let renamed = with_header(&bytes, |header| {
            let tensor = header.as_object_mut().unwrap().remove(&name).unwrap();
            header[format!("{name}.old")] = tensor;
        });
        assert!(
            refusal(&renamed).contains(name.rsplit_once('.').unwrap().0),
            "{name}: {}",
            refusal(&renamed)
        );
        let turned = with_header(&bytes, |header| {
            header[&name]["shape"].as_array_mut().unwrap().insert(0, json!(1))
        });
        assert!(refusal(&turned).contains(&name), "{name}: {}", refusal(&turned));
        let retyped = with_header(&bytes, |header| {
            let other = match header[&name]["dtype"].as_str().unwrap() {
                "F32" => "I32",
                "U32" => "F32",
                "U16" => "F16",
                "I16" => "U16",
                "I8" => "U8",
                _ => "F64",
            };
            header[&name]["dtype"] = json!(other);
        });
        assert!(refusal(&retyped).contains(&name), "{name}: {}", refusal(&retyped));
    }
}

#[test]
fn states_that_contain_the_distance_travelled_are_refused() {
    let bytes = model(&variant("paper")).to_bytes().unwrap();
    let old = with_metadata(&bytes, |m| {
        assert_eq!(m["config"]["state"], json!("root_relative"));
        m["config"]["state"] = json!("position");
    });
    let text = refusal(&old);
    assert!(
        text.contains("position") && text.contains("train the model again"),
        "{text}"
    );
}

#[test]
fn a_file_without_a_code_has_picked_logits() {
    let bytes = full();
    let older = with_metadata(&bytes, |m| {
        let encoder = m["config"]["encoder"].as_object_mut().unwrap();
        assert_eq!(encoder.remove("code"), Some(json!("picked_logit")));
    });
    assert_eq!(unchecked(&older).unwrap().to_bytes().unwrap(), bytes);
}

#[test]
fn absurd_sizes_are_refused_before_memory_is_allocated() {
    let bytes = full();
    for huge in [u64::MAX, 1 << 62, 1 << 40, 70_000, 0] {
        for path in [
            "/config/field/width",
            "/config/field/hidden_layers",
            "/config/encoder/channels",
            "/config/encoder/categories",
            "/config/encoder/hidden/0",
            "/config/motion/contact_joints/1",
        ] {
            let changed = with_metadata(&bytes, |m| *m.pointer_mut(path).unwrap() = json!(huge));
            // Joint 0 may be a contact joint; all other values are too large or zero.
            assert_eq!(
                read_frugally(&changed).is_ok(),
                path.ends_with("joints/1") && huge == 0,
                "{path} = {huge}"
            );
        }
        let shape = with_header(&bytes, |header| {
            header["garment.vertices"]["shape"] = json!([huge, 3])
        });
        assert!(read_frugally(&shape).is_err());
        let offsets = with_header(&bytes, |header| {
            header["garment.vertices"]["data_offsets"] = json!([0, huge])
        });
        assert!(read_frugally(&offsets).is_err());
    }
    let header = [&(1u64 << 40).to_le_bytes()[..], &bytes[8..]].concat();
    assert!(read_frugally(&header).is_err());
    for (path, value) in [
        ("/config/fps", json!(0.0)),
        ("/config/fps", json!(1e39)),
        ("/config/state/displacement/memory_s", json!(1e12)),
    ] {
        let changed = with_metadata(&bytes, |m| *m.pointer_mut(path).unwrap() = value.clone());
        assert!(read_frugally(&changed).is_err(), "{path} = {value}");
    }
    // The field of this model is not zero, so no excursion is usable.
    for value in [json!(0.0), json!(-1), json!(0.02)] {
        let changed = with_metadata(&bytes, |m| {
            m["config"]["state"]["displacement"]["excursion_m"] = value.clone();
        });
        let refused = read_frugally(&changed).unwrap_err().to_string();
        assert!(refused.contains("state.excursion_m"), "{refused}");
    }
}

/// Returns the file with changed bytes of a tensor.
fn with_data(bytes: &[u8], name: &str, change: impl FnOnce(&mut [u8])) -> Vec<u8> {
    let start = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let (mut range, mut bytes) = (0..0, bytes.to_vec());
    with_header(&bytes, |header| {
        let offset = |i: usize| start + header[name]["data_offsets"][i].as_u64().unwrap() as usize;
        range = offset(0)..offset(1);
    });
    change(&mut bytes[range]);
    bytes
}

#[test]
fn unusable_numbers_are_refused() {
    let bytes = full();
    let put = |name: &str, word: [u8; 4]| with_data(&bytes, name, |data| data[..4].copy_from_slice(&word));
    let floats = [
        "encoder.0.weight",
        "field.4.bias",
        "garment.vertices",
        "character.vertices",
        "character.joints",
        "character.rest_pose",
        "garment.skinning.weights",
        "garment.rest_box",
        "garment.mask",
        "motion.mean",
        "motion.std",
        "motion.limit",
        "prior.mean",
        "prior.steps",
        "prior.0.weight",
        "recurrence.poles",
        "recurrence.head.weight",
    ];
    for name in floats {
        for value in [f32::NAN, f32::INFINITY] {
            assert!(
                read_frugally(&put(name, value.to_le_bytes())).is_err(),
                "{name} {value}"
            );
        }
    }
    for value in [-1.0, f32::MAX] {
        let step = put("prior.steps", value.to_le_bytes());
        assert!(read_frugally(&step).is_err(), "a step of {value}");
    }
    let unstable = put("recurrence.poles", 1.5f32.to_le_bytes());
    assert!(
        read_frugally(&unstable).is_err(),
        "a pole outside of the unit circle"
    );
    for name in ["motion.std", "motion.limit"] {
        for value in [0.0f32, -1.0] {
            assert!(
                read_frugally(&put(name, value.to_le_bytes())).is_err(),
                "{name} {value}"
            );
        }
    }
    for name in [
        "garment.faces",
        "character.faces",
        "garment.uv.faces",
        "garment.skinning.counts",
        "garment.skinning.joints",
    ] {
        assert!(
            read_frugally(&put(name, u32::MAX.to_le_bytes())).is_err(),
            "{name}"
        );
    }
    // The root's parent, -1, becomes a number far below -1.
    assert!(read_frugally(&put("character.parents", [7, 0, 0, 0])).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// A damaged file is refused, or is a model that runs: without the checksum, a change of a
    /// weight cannot be detected.
    #[test]
    fn flipped_bytes_never_panic(at in 0.0f64..1.0, flips in 1u8..=255, in_header in any::<bool>()) {
        let mut bytes = full();
        let header = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        let place = if in_header { header } else { bytes.len() } as f64 * at;
        bytes[place as usize] ^= flips;
        match read_frugally(&bytes) {
            Err(error) => prop_assert!(!error.to_string().is_empty()),
            Ok(model) => { run(&mut Animator::new(Arc::new(model)), &motion(4)); }
        }
    }
}
