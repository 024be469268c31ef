//! Contract: no damaged model file makes the reader panic, hang or hold memory out of proportion to the
//! file; every refusal is one sentence; a model that is read runs.
//!
//! The checksum is skipped, for it would hide the damage from the reader behind it.
//!
//! `UNIC_MUTATION_SECONDS` is the time for each kind of model, `UNIC_MUTATION_SEED` repeats one file;
//! see [`unic_mutation`].

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{input, motion, parts, variant};
use std::{fs, path::Path, sync::Arc};
use unic_core::{
    Integrity,
    animator::{Animator, Start},
    config::IntersectionMode,
    mesh::Uvs,
    model::{Model, ModelParts},
    verify_checksum,
};
use unic_mutation::{Container, Counting, Subject, survive, workshop};

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn damage(name: &str, parts: ModelParts) {
    let path = workshop(Path::new(env!("CARGO_TARGET_TMPDIR")), name).join("model.unic");
    let sound = Model::new(parts).unwrap().to_bytes().unwrap();
    fs::write(&path, &sound).unwrap();
    let container = Container::Safetensors;
    let subject = Subject {
        name,
        path: &path,
        container,
    };
    let tally = survive(&subject, |path| {
        let bytes = fs::read(path).unwrap();
        let checked = Model::from_bytes(&bytes).map(drop);
        let model = Model::from_bytes_with(&bytes, Integrity::Skip).map_err(|e| e.to_string())?;
        // Damage is noticed, or there is none: the sound file, or one whose checksum is gone.
        if checked.is_ok() {
            assert!(bytes == sound || verify_checksum(&bytes).unwrap().is_none());
        }
        run(model);
        Ok(())
    });
    assert!(tally.refused > 100, "{name}: damage that nobody sees is none");
}

/// Saved states come from files as well: what is restored goes on.
#[test]
fn animator_states() {
    let path = workshop(Path::new(env!("CARGO_TARGET_TMPDIR")), "animator state").join("state.json");
    let model = common::model(&variant("second order"));
    let poses = motion(4);
    let mut animator = Animator::new(model);
    common::run(&mut animator, &poses[..3]);
    fs::write(&path, serde_json::to_vec(animator.state()).unwrap()).unwrap();
    let subject = Subject {
        name: "animator state",
        path: &path,
        container: Container::Plain,
    };
    let tally = survive(&subject, |path| {
        let state = serde_json::from_slice(&fs::read(path).unwrap());
        // What the format says is the format's; what the animator says is ours.
        let Ok(state) = state else {
            return Err("no state".into());
        };
        animator.restore(state).map_err(|e| e.to_string())?;
        animator
            .step(&input(&poses, 3))
            .map(drop)
            .map_err(|e| e.to_string())
    });
    assert!(tally.refused > 100 && tally.read > 10, "{tally}");
}

/// A pose that does not fit the model's skeleton is refused, everything else is animated; and what was
/// read can be written.
fn run(model: Model) {
    let bytes = model.to_bytes().unwrap();
    assert!(Model::from_bytes(&bytes).unwrap().to_bytes().unwrap() == bytes);
    let mut animator = Animator::new(Arc::new(model));
    let poses = motion(3);
    if animator.reset(&input(&poses, 0), Start::MeanShape).is_ok() {
        (1..poses.len()).for_each(|t| assert!(animator.step(&input(&poses, t)).is_ok()));
    }
}

#[test]
fn displacement_models() {
    let mut parts = parts(&variant("second order"));
    let rest = &mut parts.garment.rest;
    rest.uvs = Some(Uvs {
        coordinates: rest.vertices.iter().map(|v| v.truncate()).collect(),
        faces: rest.faces.clone(),
    });
    damage("displacement model", parts);
}

#[test]
fn position_models() {
    let mut parts = parts(&variant("paper"));
    parts.config.intersection = IntersectionMode::Paper { relaxation_m: 0.005 };
    damage("position model", parts);
}
