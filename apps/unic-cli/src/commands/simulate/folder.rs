//! The capture's folder: what an earlier run left, and what this one records.
//!
//! While clips are being made there is `simulation.toml` and no `capture.toml`; at the end it is the
//! other way round, and what was recorded is the capture's `[source]`.

use super::{
    distinct,
    inputs::{Cut, Job},
};
use crate::{args::SimulateArgs, failure::Usage};
use anyhow::{Context, Result, bail};
use std::{
    fs,
    path::{Path, PathBuf},
};
use toml::Value;
use unic_core::character::{Character, Garment};
use unic_io::{
    atomic,
    capture::{VertexAttributes, read_garment},
    read_character,
};
use unic_sim::SimulationSettings;

const UNFINISHED: &str = "simulation.toml";
const FINISHED: &str = "capture.toml";

/// How a run meets its folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing of a simulation.
    Nothing,
    /// A run that stopped: its finished clips are kept.
    Unfinished,
}

/// Looks at the folder, empties it where `--overwrite` says so, and refuses what would be lost.
pub(super) fn open(args: &SimulateArgs, record: &toml::Table) -> Result<Found> {
    let out = &args.out;
    refuse_inputs_inside(args)?;
    if args.overwrite {
        clear(out)?;
    }
    if out.join(FINISHED).exists() {
        let text = format!(
            "{}: a capture is there already; --overwrite replaces it",
            out.display()
        );
        return Err(Usage(text).into());
    }
    let path = out.join(UNFINISHED);
    if !path.exists() {
        refuse_foreign(out)?;
        fs::create_dir_all(out).with_context(|| format!("{}: the folder cannot be made", out.display()))?;
        return Ok(Found::Nothing);
    }
    if !args.resume {
        let text = format!(
            "{}: an unfinished simulation is there; --resume goes on with it, --overwrite starts again",
            out.display()
        );
        return Err(Usage(text).into());
    }
    same_record(&path, record)?;
    Ok(Found::Unfinished)
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

/// The first setting or input that is another than before would make another capture.
fn same_record(path: &Path, record: &toml::Table) -> Result<()> {
    let text = fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    let before: toml::Table =
        toml::from_str(&text).with_context(|| format!("{}: expected a TOML table", path.display()))?;
    let keys = before.keys().chain(record.keys());
    match keys.into_iter().find(|&key| before.get(key) != record.get(key)) {
        None => Ok(()),
        Some(key) => {
            let show = |table: &toml::Table| table.get(key).map_or("none".into(), ToString::to_string);
            bail!(
                "{}: expected {key} = {} as before, found {}",
                path.display(),
                show(&before),
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
    fs::remove_file(&path).with_context(|| format!("{} cannot be removed", path.display()))
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
        ("materials", Value::Array(materials)),
        ("motion_files", Value::String(format!("{:?}", args.reading))),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into_iter()
    .collect()
}

/// Removes the files of a capture and nothing else: the folder may hold more.
fn clear(out: &Path) -> Result<()> {
    for path in files(out).iter().filter(|path| path.exists()) {
        fs::remove_file(path).with_context(|| format!("{} cannot be removed", path.display()))?;
    }
    Ok(())
}

/// Paths of the files that a simulation writes, whether they are there or not.
fn files(out: &Path) -> Vec<PathBuf> {
    let named = [
        FINISHED,
        UNFINISHED,
        "character.npz",
        "garment.obj",
        "garment.npz",
        "simulation.json",
    ];
    let mut paths: Vec<PathBuf> = named.iter().map(|name| out.join(name)).collect();
    for entry in fs::read_dir(out.join("clips")).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.ends_with(".npz") || name.ends_with(".garment.npy") {
            paths.push(entry.path());
        }
    }
    paths
}
