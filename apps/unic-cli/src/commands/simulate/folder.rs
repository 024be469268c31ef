//! The capture's folder: what an earlier run left, and what this one records.
//!
//! While clips are being made there is `simulation.toml` and no `capture.toml`; at the end it is the
//! other way round, and what was recorded is the capture's `[source]`. As long as a process writes, the
//! folder is locked.

use super::{
    distinct,
    inputs::{Cut, Job},
};
use crate::{args::SimulateArgs, failure::Usage, folder_lock::FolderLock};
use anyhow::{Context, Result, bail};
use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};
use toml::Value;
use unic_core::character::{Character, Garment};
use unic_io::{
    atomic,
    capture::{
        MANIFEST as FINISHED, OWN_FILES, UNFINISHED, VertexAttributes, capture_written_by, read_garment,
        real_path,
    },
    read_character,
};
use unic_sim::SimulationSettings;

/// How a run meets its folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing of a simulation.
    Nothing,
    /// A run that stopped: its finished clips are kept.
    Unfinished,
    /// The very capture that is asked for.
    Finished,
}

/// Refuses what would be lost, as far as it can be told before anything is made.
pub(super) fn refuse(args: &SimulateArgs) -> Result<()> {
    refuse_inputs_inside(args)?;
    refuse_other_captures(&args.out)?;
    // An unfinished simulation may still be going on, which its lock tells.
    let is_finished = args.out.join(FINISHED).exists();
    match is_finished && !args.resume && !args.overwrite {
        true => found(args, &toml::Table::new()).map(drop),
        false => Ok(()),
    }
}

/// Locks the folder, looks at it, empties it where `--overwrite` says so, and refuses what would be
/// lost. What a killed process has left half-written goes.
pub(super) fn open(args: &SimulateArgs, record: &toml::Table) -> Result<(FolderLock, Found)> {
    let lock = FolderLock::hold(&args.out)?;
    remove_leftovers(&args.out);
    if args.overwrite {
        clear(&args.out)?;
    }
    Ok((lock, found(args, record)?))
}

fn found(args: &SimulateArgs, record: &toml::Table) -> Result<Found> {
    let out = args.out.display();
    let [finished, unfinished] = [FINISHED, UNFINISHED].map(|name| args.out.join(name));
    match (finished.exists(), unfinished.exists()) {
        (false, false) => refuse_foreign(&args.out).map(|()| Found::Nothing),
        (true, _) if args.resume => {
            let mut manifest = read_table(&finished)?;
            let source = match manifest.remove("source") {
                Some(Value::Table(source)) => source,
                _ => toml::Table::new(),
            };
            same_record(&finished, &source, record).map(|()| Found::Finished)
        }
        (_, true) if args.resume => {
            same_record(&unfinished, &read_table(&unfinished)?, record).map(|()| Found::Unfinished)
        }
        (true, _) => {
            let text = format!("{out}: a capture is there already; --overwrite replaces it");
            Err(Usage(text).into())
        }
        _ => {
            let text = format!(
                "{out}: an unfinished simulation is there; --resume goes on with it, --overwrite starts again"
            );
            Err(Usage(text).into())
        }
    }
}

/// What is read must not be what is written: nobody's character or motion is ever lost.
fn refuse_inputs_inside(args: &SimulateArgs) -> Result<()> {
    let Ok(out) = args.out.canonicalize() else {
        return Ok(());
    };
    let inputs = [&args.character, &args.garment].into_iter().chain(&args.motion);
    let inside = |path: &&PathBuf| path.canonicalize().is_ok_and(|path| path.starts_with(&out));
    match inputs.into_iter().find(inside) {
        None => Ok(()),
        Some(input) => {
            let text = format!(
                "--out: expected a folder that holds none of the inputs, found {}",
                input.display()
            );
            Err(Usage(text).into())
        }
    }
}

/// The folder may be a capture, which `--overwrite` replaces, but not a part of another.
fn refuse_other_captures(out: &Path) -> Result<()> {
    let clips = out.join("clips");
    if real_path(&clips) != real_path(out).join("clips") {
        let text = format!(
            "--out: expected a folder of clips of its own, found the link {}",
            clips.display()
        );
        return Err(Usage(text).into());
    }
    match capture_written_by(out).filter(|capture| *capture != real_path(out)) {
        None => Ok(()),
        Some(capture) => {
            let text = format!(
                "--out: expected a folder of its own, found {}, which is a part of the capture {}",
                out.display(),
                capture.display()
            );
            Err(Usage(text).into())
        }
    }
}

/// Files of a capture that no simulation has begun are somebody's work.
fn refuse_foreign(out: &Path) -> Result<()> {
    match files(out).into_iter().find(|path| path.exists()) {
        None => Ok(()),
        Some(path) => {
            let text = format!(
                "{}: expected no files of a capture, found {}; --overwrite replaces them",
                out.display(),
                path.display()
            );
            Err(Usage(text).into())
        }
    }
}

/// From here on there is something to resume.
pub(super) fn begin(out: &Path, record: &toml::Table) -> Result<()> {
    let text = toml::to_string(record)?;
    Ok(atomic::write(&out.join(UNFINISHED), text.as_bytes())?)
}

fn read_table(path: &Path) -> Result<toml::Table> {
    let text = fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    toml::from_str(&text).with_context(|| format!("{}: expected a TOML table", path.display()))
}

/// The first setting or input that is another than before would make another capture.
fn same_record(path: &Path, before: &toml::Table, record: &toml::Table) -> Result<()> {
    let keys = before.keys().chain(record.keys());
    match keys.into_iter().find(|&key| before.get(key) != record.get(key)) {
        None => Ok(()),
        Some(key) => {
            let show = |table: &toml::Table| table.get(key).map_or("none".into(), ToString::to_string);
            bail!(
                "{}: expected {key} = {} as before, found {}",
                path.display(),
                show(before),
                show(record)
            )
        }
    }
}

/// Finished clips belong to the character and garment that lie beside them.
pub(super) fn check_same_inputs(out: &Path, character: &Character, cut: &Cut) -> Result<()> {
    let path = out.join("character.npz");
    if path.exists() && read_character(&path)? != *character {
        bail!(
            "{}: expected the character of the unfinished simulation, found another",
            path.display()
        );
    }
    let path = out.join("garment.obj");
    if path.exists() && !is_same_garment(&read_garment(out, character)?, cut) {
        bail!(
            "{}: expected the garment of the unfinished simulation, found another",
            path.display()
        );
    }
    Ok(())
}

/// Skinning weights play no part in a simulation.
fn is_same_garment((garment, attributes): &(Garment, VertexAttributes), cut: &Cut) -> bool {
    let (before, now) = (&garment.rest, &cut.garment.rest);
    before.vertices == now.vertices && before.faces == now.faces && *attributes == cut.attributes
}

/// `simulation.toml` has served its purpose.
pub(super) fn close(out: &Path) -> Result<()> {
    let path = out.join(UNFINISHED);
    match fs::remove_file(&path) {
        Err(e) if e.kind() != ErrorKind::NotFound => {
            Err(e).with_context(|| format!("{} cannot be removed", path.display()))
        }
        _ => Ok(()),
    }
}

/// What the capture is made from: inputs and settings, compared when a run goes on.
pub(super) fn record(
    args: &SimulateArgs,
    cut: &Cut,
    jobs: &[Job],
    settings: &SimulationSettings,
) -> toml::Table {
    let clip = |job: &Job| {
        let text = format!("{}, {} frames: {}", job.split.name(), job.clip.len(), job.source);
        (job.clip.name.clone(), Value::String(text))
    };
    let mut table = toml::Table::new();
    let mut set = |key: &str, value: Value| table.insert(key.into(), value);
    set(
        "simulator",
        Value::String(format!("unic {}", env!("CARGO_PKG_VERSION"))),
    );
    set("character", Value::String(args.character.display().to_string()));
    set("garment", Value::String(args.garment.display().to_string()));
    if !cut.parts.is_empty() {
        set(
            "parts",
            Value::Array(cut.parts.iter().cloned().map(Value::String).collect()),
        );
    }
    set("clips", Value::Table(jobs.iter().map(clip).collect()));
    set("settings", Value::Table(settings_table(args, cut, settings)));
    table
}

/// What the result depends on besides the inputs.
fn settings_table(args: &SimulateArgs, cut: &Cut, settings: &SimulationSettings) -> toml::Table {
    let number = |x: f32| Value::Float(x.into());
    let steps = settings.intervals_per_frame * settings.substeps_per_interval;
    let wind = args.wind.unwrap_or_default().to_array().map(number).to_vec();
    let materials = distinct(&cut.materials)
        .iter()
        .map(|m| Value::String(format!("{m:?}")))
        .collect();
    let thickness_m = settings.contact.map_or(0.0, |contact| contact.thickness_m);
    [
        ("fps", number(args.fps)),
        ("substeps", Value::Integer(steps.into())),
        ("thickness_m", number(thickness_m)),
        ("self_collision", Value::Boolean(settings.self_contact.is_some())),
        ("wind_m_per_s", Value::Array(wind)),
        ("breeze_m_per_s", number(args.breeze.unwrap_or_default())),
        ("materials", Value::Array(materials)),
        ("motion_files", Value::String(format!("{:?}", args.reading))),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into_iter()
    .collect()
}

/// Removes the files of a capture and nothing else: the folder may hold more.
pub(super) fn clear(out: &Path) -> Result<()> {
    for path in files(out).iter().filter(|path| path.exists()) {
        fs::remove_file(path).with_context(|| format!("{} cannot be removed", path.display()))?;
    }
    Ok(())
}

fn remove_leftovers(out: &Path) {
    atomic::remove_leftovers(out, |name| OWN_FILES.contains(&name));
    atomic::remove_leftovers(&out.join("clips"), is_of_a_clip);
}

fn is_of_a_clip(name: &str) -> bool {
    name.ends_with(".npz") || name.ends_with(".garment.npy")
}

/// Paths of the files that a simulation writes, whether they are there or not.
fn files(out: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = OWN_FILES.iter().map(|name| out.join(name)).collect();
    for entry in fs::read_dir(out.join("clips")).into_iter().flatten().flatten() {
        if is_of_a_clip(&entry.file_name().to_string_lossy()) {
            paths.push(entry.path());
        }
    }
    paths
}
