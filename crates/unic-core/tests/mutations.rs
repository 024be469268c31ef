//! Contract of damaged files: no model file or saved state makes the reader panic, loop or allocate
//! memory out of proportion to the file. Every error is one sentence, and a model that is read
//! runs.
//!
//! The checksum is skipped, because it would refuse the damage before the reader sees it.
//!
//! `UNIC_MUTATION_SECONDS` is the time for each kind of model, `UNIC_MUTATION_SEED` repeats one
//! file ([`unic_mutation`]).

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

#[path = "motion_matching/common.rs"]
#[allow(dead_code, reason = "shared with the tests of motion matching")]
mod figures;

use common::{input, motion, parts, variant};
use std::{fs, path::Path, sync::Arc};
use unic_core::{
    Animator, IntersectionMode, Model, Start,
    mesh::Uvs,
    model::ModelParts,
    model_file::{Integrity, verify_checksum},
    motion_matching::{ChecksumRule, Command, Controller, ControllerSettings, Database, TaggedClip},
};
use unic_mutation::{Container, CountingAllocator, FuzzTarget, fuzz, scratch_folder};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Damages the file of a model in many ways.
fn damage(name: &str, parts: ModelParts) {
    let path = scratch_folder(Path::new(env!("CARGO_TARGET_TMPDIR")), name).join("model.unic");
    let sound = Model::new(parts).unwrap().to_bytes().unwrap();
    fs::write(&path, &sound).unwrap();
    let container = Container::Safetensors;
    let target = FuzzTarget {
        name,
        path: &path,
        container,
    };
    let tally = fuzz(&target, |path| {
        let bytes = fs::read(path).unwrap();
        let checked = Model::from_bytes(&bytes).map(drop);
        let model = Model::from_bytes_with(&bytes, Integrity::Skip).map_err(|e| e.to_string())?;
        // The checksum detects all damage, unless the file has lost it.
        if checked.is_ok() {
            assert!(bytes == sound || verify_checksum(&bytes).unwrap().is_none());
        }
        run(model);
        Ok(())
    });
    assert!(
        tally.refused > 100,
        "{name}: too few files are refused for a test"
    );
}

/// Motion databases are read from files too. One that is read can be searched and played.
#[test]
fn motion_databases() {
    let path =
        scratch_folder(Path::new(env!("CARGO_TARGET_TMPDIR")), "motion database").join("walk.unicmotn");
    let walk = figures::winding(60, 0.7);
    let clips = [TaggedClip::whole(&walk, "walk")];
    let database = Database::build(&figures::figure(), &clips, figures::figure_settings()).unwrap();
    let sound = database.to_bytes().unwrap();
    fs::write(&path, &sound).unwrap();
    let target = FuzzTarget {
        name: "motion database",
        path: &path,
        container: Container::Plain,
    };
    let tally = fuzz(&target, |path| {
        let bytes = fs::read(path).unwrap();
        // The checksum detects all damage.
        assert!(Database::from_bytes(&bytes).is_err() || bytes == sound);
        let database = Database::from_bytes_with(&bytes, ChecksumRule::Ignore).map_err(|e| e.to_string())?;
        for tag in database.tag_names() {
            assert!(database.tag_bit(tag).is_some());
        }
        let mut controller = Controller::new(Arc::new(database), ControllerSettings::default());
        let walk = Command::travel(glam::Vec2::Y);
        for _ in 0..20 {
            controller.step(&walk).map_err(|e| e.to_string())?;
        }
        Ok(())
    });
    assert!(tally.refused > 100 && tally.read > 10, "{tally}");
}

/// Saved states are read from files too. A state that is restored can be stepped.
#[test]
fn animator_states() {
    let path = scratch_folder(Path::new(env!("CARGO_TARGET_TMPDIR")), "animator state").join("state.json");
    let model = common::model(&variant("second order"));
    let poses = motion(4);
    let mut animator = Animator::new(model);
    common::run(&mut animator, &poses[..3]);
    fs::write(&path, serde_json::to_vec(animator.state()).unwrap()).unwrap();
    let target = FuzzTarget {
        name: "animator state",
        path: &path,
        container: Container::Plain,
    };
    let tally = fuzz(&target, |path| {
        let state = serde_json::from_slice(&fs::read(path).unwrap());
        // Errors of serde_json have a form of their own; those of the animator are checked.
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

/// Writes a model that was read again, and animates it if its skeleton fits the poses.
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
