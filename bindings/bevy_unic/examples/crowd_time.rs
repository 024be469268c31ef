//! Time of a tick on all compute threads, and memory, for 1, 16 and 64 characters in the T-shirt that
//! comes with `unic`, without a window.
//!
//! `cargo run --release --example crowd_time`

use bevy::{
    mesh::{MeshPlugin, skinning::SkinnedMeshInverseBindposes},
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_unic::{Display, UnicGarment, UnicModel, UnicPlugin, spawn_character};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use unic_core::Model;

const GARMENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../apps/unic-cli/garments");
const TICKS: usize = 30;

fn main() {
    // Memory that was released stays with the process, so that crowds that grow are measured from one start.
    let before = resident_mib();
    for characters in [1, 16, 64] {
        let mut app = App::new();
        let assets = AssetPlugin {
            file_path: GARMENTS.into(),
            ..default()
        };
        app.add_plugins((MinimalPlugins, assets, TransformPlugin, MeshPlugin, UnicPlugin));
        app.add_systems(Update, swing);
        let model = dressed(&mut app, characters);
        let tick = Duration::from_secs_f64(1.0 / f64::from(model.config().fps));
        app.insert_resource(TimeUpdateStrategy::ManualDuration(tick));
        (0..3).for_each(|_| app.update());
        let mut times: Vec<Duration> = Vec::new();
        for _ in 0..TICKS {
            let start = Instant::now();
            app.update();
            times.push(start.elapsed());
        }
        times.sort();
        let ms = 1e3 * times[TICKS / 2].as_secs_f64();
        let each = ms / characters as f64;
        let memory = match (before, resident_mib()) {
            (Some(before), Some(now)) => format!("{:.0} MiB more than before", now - before),
            _ => "memory not known".to_owned(),
        };
        println!("{characters} characters: {ms:.1} ms a tick, {each:.2} ms each, {memory}");
    }
}

/// Resident memory of the process, MiB, where the system tells it.
fn resident_mib() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

/// Spawns characters with garments when the model is loaded.
fn dressed(app: &mut App, characters: usize) -> Arc<Model> {
    let handle: Handle<UnicModel> = app.world().resource::<AssetServer>().load("tshirt.unic");
    let model = loop {
        app.update();
        if let Some(UnicModel(model)) = app.world().resource::<Assets<UnicModel>>().get(&handle) {
            break Arc::clone(model);
        }
    };
    let spawned = Arc::clone(&model);
    let spawn = move |mut commands: Commands,
                      mut meshes: ResMut<Assets<Mesh>>,
                      mut bind_poses: ResMut<Assets<SkinnedMeshInverseBindposes>>| {
        for _ in 0..characters {
            let (character, _) = spawn_character(&mut commands, &mut meshes, &mut bind_poses, &spawned);
            commands.spawn(UnicGarment {
                display: Display::Ticks,
                ..UnicGarment::new(handle.clone(), character)
            });
        }
    };
    let system = app.world_mut().register_system(spawn);
    if let Err(error) = app.world_mut().run_system(system) {
        error!("the characters are not spawned: {error}");
    }
    model
}

fn swing(time: Res<Time>, mut joints: Query<(&Name, &mut Transform)>) {
    let turn = Quat::from_rotation_x(0.3 * (5.0 * time.elapsed_secs()).sin());
    for (name, mut transform) in &mut joints {
        if ["L_hip", "L_shoulder"].contains(&name.as_str()) {
            transform.rotation = turn;
        }
    }
}
