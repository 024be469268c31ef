//! `unic bench control`: how well a character follows commands.

use crate::{
    args::ControlArgs,
    interrupt,
    motion_source::{FPS, MotionSource, steered_character},
    output::{print, print_json, print_status},
    outputs::{Existing, Outputs},
};
use anyhow::{Context, Result};
use std::{fs, path::Path, sync::Arc};
use unic_core::{
    clip::Clip,
    motion_matching::{Controller, ControllerSettings},
};
use unic_eval::control::{ControlReport, ControlRun, Script};
use unic_io::{counted, write_motion};

/// Runs the scripts and prints their metrics.
pub(super) fn run(args: &ControlArgs) -> Result<()> {
    if let Some(folder) = &args.write_motion {
        let names = Script::ALL.map(|script| file_name(script, args.seed));
        Outputs::with_inputs(args.source.files().chain(&args.character.character))
            .folder(folder, names)
            .check(Existing::of(args.overwrite))?;
    }
    let source = MotionSource::read(steered_character(&args.character)?, FPS, &args.source, args.force)?;
    let settings = ControllerSettings::new(args.responsiveness);
    if let Some(folder) = &args.write_motion {
        write_runs(folder, &source, settings, args.seed)?;
    }
    let tags = source.tags();
    let observe = &mut |_: &ControlRun| Ok(interrupt::check()?);
    let report =
        ControlReport::measure::<anyhow::Error>(&source.database, settings, tags, args.seed, observe)?;
    match args.json {
        true => print_json(&report),
        false => print(&format!("{report}\n")),
    }
}

/// Runs all scripts and writes the poses of each.
fn write_runs(folder: &Path, source: &MotionSource, settings: ControllerSettings, seed: u64) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot create the folder", folder.display()))?;
    let mut controller = Controller::new(Arc::clone(&source.database), settings);
    controller.set_tags(source.tags())?;
    for script in Script::ALL {
        interrupt::check()?;
        let run = ControlRun::new(&mut controller, script, seed)?;
        let clip = Clip {
            name: script.name().into(),
            fps: run.fps,
            poses: run.ticks.into_iter().map(|tick| tick.pose).collect(),
            ground_height: 0.0,
            wind: Vec::new(),
        };
        let path = folder.join(file_name(script, seed));
        write_motion(&path, &clip, source.character.skeleton.names())?;
    }
    let motions = counted(Script::ALL.len(), "motion");
    print_status(&format!("{}: {motions}", folder.display()));
    Ok(())
}

fn file_name(script: Script, seed: u64) -> String {
    format!("{}_{seed}.npz", script.name())
}
