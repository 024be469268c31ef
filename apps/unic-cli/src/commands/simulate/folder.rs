//! Folder of the capture that is being simulated: its state, its lock and its record.
//!
//! A simulation records its inputs and settings in `simulation.toml`. `capture.toml` replaces that
//! file when all clips are finished, and then holds the record as its table `[source]`. A folder
//! with `simulation.toml` is therefore unfinished. It is locked as long as a process writes.

use super::inputs::{self, GarmentInput, Job, distinct};
use crate::{
    args::{MotionArgs, SimulateArgs, UpName},
    failure::Usage,
    folder_lock::FolderLock,
    outputs::refuse_other_captures,
};
use anyhow::{Context, Result, bail};
use std::{
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
};
use toml::Value;
use unic_core::character::{Character, Garment};
use unic_io::{
    LowPass, atomic,
    capture::{MANIFEST as FINISHED, OWN_FILES, UNFINISHED, VertexAttributes, read_garment},
    read_character,
};
use unic_sim::{Material, SimulationSettings};

/// State of the folder when a simulation begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FolderState {
    /// No files of a simulation.
    Empty,
    /// An interrupted simulation with the arguments of this one. Its finished clips are kept.
    Unfinished,
    /// The complete capture that the command asks for.
    Finished,
}

/// Refuses to overwrite inputs or captures, as far as this can be checked before any work.
///
/// # Errors
/// A [`Usage`] that names the folder and the file in it that would be lost.
pub(super) fn check_outputs(args: &SimulateArgs) -> Result<()> {
    refuse_inputs_inside(args)?;
    refuse_other_captures(&args.out)?;
    // An unfinished simulation is judged in `open`, under the lock: another process may be writing
    // it.
    let is_finished = args.out.join(FINISHED).exists();
    match is_finished && !args.resume && !args.overwrite {
        true => state(args, &toml::Table::new()).map(drop),
        false => Ok(()),
    }
}

/// Locks the folder and returns the lock with the state of the folder.
///
/// Removes temporary files of killed processes, and with `--overwrite` all files of a capture.
///
/// # Errors
/// Another process that holds the lock, an existing capture that the options do not resume or
/// overwrite, a record of other inputs or settings.
pub(super) fn open(args: &SimulateArgs, record: &toml::Table) -> Result<(FolderLock, FolderState)> {
    let lock = FolderLock::acquire(&args.out)?;
    remove_leftovers(&args.out);
    if args.overwrite {
        clear(&args.out)?;
    }
    Ok((lock, state(args, record)?))
}

fn state(args: &SimulateArgs, record: &toml::Table) -> Result<FolderState> {
    let out = args.out.display();
    let [finished, unfinished] = [FINISHED, UNFINISHED].map(|name| args.out.join(name));
    match (finished.exists(), unfinished.exists()) {
        (false, false) => refuse_foreign(&args.out).map(|()| FolderState::Empty),
        // Both files are there if a process was killed between its last two steps: the capture is
        // complete.
        (true, _) if args.resume => {
            let mut manifest = read_table(&finished)?;
            let source = match manifest.remove("source") {
                Some(Value::Table(source)) => source,
                _ => toml::Table::new(),
            };
            check_same_record(&finished, &source, record).map(|()| FolderState::Finished)
        }
        (_, true) if args.resume => check_same_record(&unfinished, &read_table(&unfinished)?, record)
            .map(|()| FolderState::Unfinished),
        (true, _) => {
            let text = format!("{out}: expected no capture, found one; --overwrite replaces it");
            Err(Usage(text).into())
        }
        _ => {
            let text = format!(
                "{out}: expected no simulation, found an unfinished one; --resume continues it, --overwrite \
                 starts again"
            );
            Err(Usage(text).into())
        }
    }
}

/// Refuses an output folder that contains one of the inputs, which `--overwrite` would delete.
fn refuse_inputs_inside(args: &SimulateArgs) -> Result<()> {
    // A folder that does not exist contains nothing.
    let Ok(out) = args.out.canonicalize() else {
        return Ok(());
    };
    let inside = |path: &&PathBuf| path.canonicalize().is_ok_and(|path| path.starts_with(&out));
    match inputs::files(args).find(inside) {
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

/// Refuses a folder with files of a capture that no simulation has written.
fn refuse_foreign(out: &Path) -> Result<()> {
    match capture_files(out).into_iter().find(|path| path.exists()) {
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

/// Writes the record of a simulation, which can then be resumed.
pub(super) fn write_record(out: &Path, record: &toml::Table) -> Result<()> {
    let text = toml::to_string(record)?;
    Ok(atomic::write(&out.join(UNFINISHED), text.as_bytes())?)
}

fn read_table(path: &Path) -> Result<toml::Table> {
    let text = fs::read_to_string(path).with_context(|| format!("{} cannot be read", path.display()))?;
    toml::from_str(&text).with_context(|| format!("{}: expected a TOML table", path.display()))
}

/// Compares the records of two runs of a simulation.
///
/// # Errors
/// The first input or setting that differs: clips made with it would not belong to one capture.
fn check_same_record(path: &Path, before: &toml::Table, record: &toml::Table) -> Result<()> {
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

/// The order of the vertices in the character's file is for exports, and earlier versions did not write it.
fn is_same_character(a: &Character, b: &Character) -> bool {
    a.body == b.body && a.skeleton == b.skeleton && a.weights == b.weights
}

/// Compares the character and garment with those that an unfinished simulation has written.
///
/// The record holds only their paths, and the files there may have changed.
///
/// # Errors
/// A character or garment that differs, or cannot be read.
pub(super) fn check_same_inputs(out: &Path, character: &Character, input: &GarmentInput) -> Result<()> {
    let path = out.join("character.npz");
    if path.exists() && !is_same_character(&read_character(&path)?, character) {
        bail!(
            "{}: expected the character of the unfinished simulation, found another",
            path.display()
        );
    }
    let path = out.join("garment.obj");
    if path.exists() {
        let (garment, attributes) = read_garment(out, character)?;
        if !is_same_garment(&garment, &attributes, input) {
            bail!(
                "{}: expected the garment of the unfinished simulation, found another",
                path.display()
            );
        }
    }
    Ok(())
}

/// Compares everything of a garment that the simulation uses, which skinning weights are not.
fn is_same_garment(garment: &Garment, attributes: &VertexAttributes, input: &GarmentInput) -> bool {
    let (before, now) = (&garment.rest, &input.garment.rest);
    before.vertices == now.vertices && before.faces == now.faces && *attributes == input.attributes
}

/// Removes the record of a finished simulation, if it is there.
pub(super) fn remove_record(out: &Path) -> Result<()> {
    let path = out.join(UNFINISHED);
    match fs::remove_file(&path) {
        Err(e) if e.kind() != ErrorKind::NotFound => {
            Err(e).with_context(|| format!("{} cannot be removed", path.display()))
        }
        _ => Ok(()),
    }
}

/// Inputs and settings that the capture depends on. `--resume` requires them to be the same.
pub(super) fn record(
    args: &SimulateArgs,
    input: &GarmentInput,
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
    if !input.parts.is_empty() {
        set(
            "parts",
            Value::Array(input.parts.iter().cloned().map(Value::String).collect()),
        );
    }
    set("clips", Value::Table(jobs.iter().map(clip).collect()));
    set("settings", Value::Table(settings_table(args, input, settings)));
    table
}

/// Settings that the capture depends on besides its inputs.
fn settings_table(args: &SimulateArgs, input: &GarmentInput, settings: &SimulationSettings) -> toml::Table {
    let number = |x: f32| Value::Float(x.into());
    let steps = settings.intervals_per_frame * settings.substeps_per_interval;
    let wind = args.wind.unwrap_or_default().to_array().map(number).to_vec();
    let materials = distinct(&input.materials);
    let materials = materials.iter().map(|m| Value::Table(material_table(m)));
    let thickness_m = settings.contact.map_or(0.0, |contact| contact.thickness_m);
    [
        ("fps", number(args.fps)),
        ("substeps", Value::Integer(steps.into())),
        ("thickness_m", number(thickness_m)),
        ("self_collision", Value::Boolean(settings.self_contact.is_some())),
        ("wind_m_per_s", Value::Array(wind)),
        ("breeze_m_per_s", number(args.breeze.unwrap_or_default())),
        ("materials", Value::Array(materials.collect())),
        ("motion_files", Value::Table(reading_table(&args.reading))),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into_iter()
    .collect()
}

/// Record of a material. Its keys are those of the file, which names of fields may not change.
fn material_table(material: &Material) -> toml::Table {
    let Material {
        area_density,
        warp_stiffness,
        weft_stiffness,
        shear_stiffness,
        bending_stiffness,
        bending_damping_s,
        thickness,
        static_friction,
        sliding_friction,
    } = *material;
    [
        ("area_density", area_density),
        ("warp_stiffness", warp_stiffness),
        ("weft_stiffness", weft_stiffness),
        ("shear_stiffness", shear_stiffness),
        ("bending_stiffness", bending_stiffness),
        ("bending_damping_s", bending_damping_s),
        ("thickness", thickness),
        ("static_friction", static_friction),
        ("sliding_friction", sliding_friction),
    ]
    .map(|(key, value)| (key.to_owned(), Value::Float(value.into())))
    .into_iter()
    .collect()
}

/// Record of the options for motion files. Options that are not given have no key.
fn reading_table(reading: &MotionArgs) -> toml::Table {
    let MotionArgs {
        up,
        bone_map,
        low_pass,
        repeat,
    } = reading;
    let up = match up {
        UpName::Auto => "auto",
        UpName::Y => "y",
        UpName::Z => "z",
    };
    let low_pass_hz = low_pass.map(|low_pass| match low_pass {
        LowPass::Auto => Value::String("auto".into()),
        LowPass::Hertz(hz) => Value::Float(hz.into()),
        LowPass::Off => Value::Float(0.0),
    });
    let bone_map = bone_map.as_ref().map(|path| path.display().to_string());
    let repeat = repeat.map(|times| Value::Integer(times.get().try_into().unwrap_or(i64::MAX)));
    [
        ("up", Some(Value::String(up.into()))),
        ("bone_map", bone_map.map(Value::String)),
        ("low_pass_hz", low_pass_hz),
        ("repeat", repeat),
    ]
    .into_iter()
    .filter_map(|(key, value)| Some((key.to_owned(), value?)))
    .collect()
}

/// Removes the files of a capture. Other files in the folder stay.
pub(super) fn clear(out: &Path) -> Result<()> {
    for path in capture_files(out).iter().filter(|path| path.exists()) {
        fs::remove_file(path).with_context(|| format!("{} cannot be removed", path.display()))?;
    }
    Ok(())
}

/// Removes temporary files of killed processes.
fn remove_leftovers(out: &Path) {
    atomic::remove_leftovers(out, |name| OWN_FILES.contains(&name));
    atomic::remove_leftovers(&out.join("clips"), is_clip_file);
}

fn is_clip_file(name: &str) -> bool {
    name.ends_with(".npz") || name.ends_with(".garment.npy")
}

/// Paths of the files that a simulation writes: its own files, existing or not, and existing clips.
fn capture_files(out: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = OWN_FILES.iter().map(|name| out.join(name)).collect();
    for entry in fs::read_dir(out.join("clips")).into_iter().flatten().flatten() {
        if is_clip_file(&entry.file_name().to_string_lossy()) {
            paths.push(entry.path());
        }
    }
    paths
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::NonZeroUsize;

    // An unfinished simulation of an earlier build is resumed only if the record has the same keys.
    #[test]
    fn the_record_has_the_keys_that_files_have() {
        let reading = MotionArgs {
            up: UpName::Z,
            bone_map: Some("bones.toml".into()),
            low_pass: Some(LowPass::Hertz(10.0)),
            repeat: NonZeroUsize::new(3),
        };
        let expected = "bone_map = \"bones.toml\"\nlow_pass_hz = 10.0\nrepeat = 3\nup = \"z\"\n";
        assert_eq!(toml::to_string(&reading_table(&reading)).unwrap(), expected);
        let keys: Vec<String> = material_table(&Material::COTTON).keys().cloned().collect();
        let expected = [
            "area_density",
            "bending_damping_s",
            "bending_stiffness",
            "shear_stiffness",
            "sliding_friction",
            "static_friction",
            "thickness",
            "warp_stiffness",
            "weft_stiffness",
        ];
        assert_eq!(keys, expected);
    }
}
