//! Contract: no damaged checkpoint or settings file makes a reader panic, run without
//! end or allocate memory out of proportion to the file. Every refusal is one sentence. A file that
//! is read can be used, or its use is refused with a sentence.
//!
//! `UNIC_MUTATION_SECONDS` is the time for each reader, `UNIC_MUTATION_SEED` repeats one file; see
//! [`unic_mutation`].

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::{dataset, small};
use std::{
    fs,
    path::{Path, PathBuf},
};
use unic_core::config::{EncoderConfig, FieldConfig, LatentCode};
use unic_mutation::{Container, CountingAllocator, FuzzTarget, fuzz, scratch_folder};
use unic_train::*;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn folder(name: &str) -> PathBuf {
    scratch_folder(Path::new(env!("CARGO_TARGET_TMPDIR")), name)
}

/// Networks so small that damage hits everything else as often as them.
fn tiny() -> TrainConfig {
    let mut config = small(Preset::Tiny);
    config.model.encoder = EncoderConfig {
        hidden: vec![2],
        channels: 2,
        categories: 2,
        code: LatentCode::PickedLogit,
    };
    config.model.field = FieldConfig {
        width: 8,
        hidden_layers: 2,
        skip: None,
    };
    config.optimiser.steps = 2;
    config
}

#[test]
fn checkpoints() {
    let (folder, config) = (folder("checkpoint"), tiny());
    let mut trainer = Trainer::new(dataset(&config), config).unwrap();
    trainer.run(Some(&folder), &mut |_| Control::Continue).unwrap();
    let path = folder.join("step-00000002.safetensors");
    let target = FuzzTarget {
        name: "checkpoint",
        path: &path,
        container: Container::Safetensors,
    };
    let tally = fuzz(&target, |path| {
        let checkpoint = Checkpoint::newest(&folder).map_err(|e| e.to_string())?;
        let checkpoint = checkpoint.ok_or("no checkpoint")?;
        trainer.resume(checkpoint, path).map_err(|e| e.to_string())?;
        trainer.model().map(drop).map_err(|e| e.to_string())
    });
    assert!(tally.refused > 100 && tally.read > 10, "{tally}");
}

#[test]
fn settings() {
    let path = folder("settings").join("config.toml");
    fs::write(&path, TrainConfig::preset(Preset::Standard).to_toml()).unwrap();
    let target = FuzzTarget {
        name: "settings",
        path: &path,
        container: Container::Plain,
    };
    let tally = fuzz(&target, |path| {
        let text = String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
        let config = TrainConfig::from_toml(&text).map_err(|e| e.to_string())?;
        for step in [0, 1, config.optimiser.steps, u64::MAX] {
            assert!(config.learning_rate(step) >= 0.0 && config.unroll(step) > 0);
        }
        // Numbers in text: written and read again they are the same.
        assert_eq!(TrainConfig::from_toml(&config.to_toml()).unwrap(), config);
        Ok(())
    });
    assert!(tally.refused > 100 && tally.read > 10, "{tally}");
}
