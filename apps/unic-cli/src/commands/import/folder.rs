//! The folder of the capture that an import makes or adds to.

use super::notes::Notes;
use crate::{args::ImportArgs, failure::Usage};
use anyhow::{Result, anyhow};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};
use toml::{Table, Value};
use unic_core::clip::Clip;
use unic_io::{
    Capture, Manifest, Split,
    capture::{MANIFEST, OWN_FILES, real_path},
};

/// Opens the capture in the folder, if there is one.
///
/// # Errors
/// Files of a capture without its manifest; a capture that cannot be read.
pub(super) fn open(args: &ImportArgs) -> Result<Option<Capture>> {
    let out = &args.out;
    if out.join(MANIFEST).exists() {
        return Ok(Some(Capture::open(out)?));
    }
    match own_files(out).find(|path| path.exists()) {
        None => Ok(None),
        Some(path) => {
            let text = format!(
                "{}: expected a capture or no files of one, found {} without {MANIFEST}; choose another folder",
                out.display(),
                path.display()
            );
            Err(Usage(text).into())
        }
    }
}

fn own_files(out: &Path) -> impl Iterator<Item = PathBuf> {
    OWN_FILES
        .iter()
        .copied()
        .chain(["clips"])
        .map(|name| out.join(name))
}

/// Checks the name of a clip against the capture, before any frame is written.
///
/// # Errors
/// A clip of that name without `--overwrite` or that is an input; a test clip that does not exist.
pub(super) fn check_clip(args: &ImportArgs, before: Option<&Capture>, clip: &Clip) -> Result<()> {
    if let Some(capture) = before {
        refuse_taken(args, capture, &clip.name)?;
    }
    let clips = before.map(|capture| &capture.manifest.splits);
    let is_clip = |name: &str| name == clip.name || clips.is_some_and(|clips| clips.split_of(name).is_some());
    let Some(name) = args.test.iter().find(|name| !is_clip(name)) else {
        return Ok(());
    };
    let mut names: Vec<&str> = (clips.into_iter().flat_map(|clips| clips.iter()))
        .map(|(name, _)| name)
        .collect();
    names.push(&clip.name);
    let text = format!("--test: expected names among {}, found {name}", names.join(", "));
    Err(Usage(text).into())
}

/// Refuses to replace a clip unless `--overwrite` is given, and always one that is an input.
fn refuse_taken(args: &ImportArgs, capture: &Capture, name: &str) -> Result<()> {
    let mut files = capture.clip_files(name).into_iter().filter(|path| path.exists());
    let inputs = [Some(&args.garment), Some(&args.motion), args.rest.as_ref()];
    let is_input = |file: &PathBuf| {
        let file = real_path(file);
        inputs.iter().flatten().any(|input| real_path(input) == file)
    };
    let Some(first) = files.clone().find(is_input).or_else(|| files.next()) else {
        return Ok(());
    };
    let path = first.display();
    let text = if is_input(&first) {
        format!("{path}: expected a new clip, found the input; --clip gives the clip another name")
    } else if args.overwrite {
        return Ok(());
    } else {
        format!(
            "{path}: expected no clip `{name}`, found one; --overwrite replaces it, --clip gives another name"
        )
    };
    Err(Usage(text).into())
}

/// Makes the manifest of the capture with the new clip, whose own manifest is `alone`.
pub(super) fn manifest(
    args: &ImportArgs,
    before: Option<&Capture>,
    alone: Manifest,
    notes: &Notes,
) -> Manifest {
    let clips: Vec<String> = alone.splits.train.clone();
    let mut manifest = match before {
        Some(capture) => capture.manifest.clone(),
        // Joint names and contact joints are those that the writer has filled in.
        None => Manifest {
            name: name_of(&args.out),
            provenance: names_of_inputs(args),
            ..alone
        },
    };
    if let Some(text) = &args.provenance {
        manifest.provenance.clone_from(text);
    }
    for name in &clips {
        // A clip that is imported again keeps its purpose.
        if manifest.splits.split_of(name).is_none() {
            manifest.splits.train.push(name.clone());
        }
        record(args, name, notes, &mut manifest.source);
    }
    for name in &args.test {
        for split in Split::ALL {
            manifest.splits.of_mut(split).retain(|other| other != name);
        }
        manifest.splits.test.push(name.clone());
    }
    manifest
}

/// Records the files and conversions of a clip in the manifest's table `[source]`.
fn record(args: &ImportArgs, clip: &str, notes: &Notes, source: &mut Table) {
    let text = |path: &Path| Value::String(path.display().to_string());
    let mut entry = Table::new();
    entry.insert("garment".into(), text(&args.garment));
    entry.insert("motion".into(), text(&args.motion));
    if let Some(path) = &args.character {
        entry.insert("character".into(), text(path));
    }
    if let Some(path) = &args.rest {
        entry.insert("rest".into(), text(path));
    }
    let notes = notes.0.iter().cloned().map(Value::String).collect();
    entry.insert("notes".into(), Value::Array(notes));
    // A capture that `unic simulate` has made has a table of clips too, of other content.
    let imports = source
        .entry("imports")
        .or_insert_with(|| Value::Table(Table::new()));
    if let Value::Table(imports) = imports {
        imports.insert(clip.to_owned(), Value::Table(entry));
    }
}

/// Provenance where the user states none: the names of the files, without the folders of a machine.
fn names_of_inputs(args: &ImportArgs) -> String {
    let inputs = [Some(&args.garment), args.character.as_ref(), args.rest.as_ref()];
    let name = |path: &PathBuf| {
        path.file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let mut names: Vec<String> = inputs.into_iter().flatten().map(name).collect();
    names.push(name(&args.motion));
    // One file may be the character and its motion.
    let mut seen = BTreeSet::new();
    names.retain(|name| seen.insert(name.clone()));
    format!("imported from {}; licence not stated", names.join(", "))
}

fn name_of(out: &Path) -> String {
    let name = real_path(out)
        .file_name()
        .map(|name| name.to_string_lossy().into_owned());
    name.unwrap_or_else(|| "capture".into())
}

/// Gives an error about a staged file the name that the file is to have, and names the option that
/// helps. Other errors stay as they are.
pub(super) fn outside(error: anyhow::Error, staged: &Path, out: &Path) -> anyhow::Error {
    let staged = staged.display().to_string();
    let text = error.to_string();
    if !text.contains(&staged) {
        return error;
    }
    let text = text.replace(&staged, &out.display().to_string());
    match text.contains("contact_joints") {
        true => anyhow!("{text}; --contacts names them"),
        false => anyhow!("{text}"),
    }
}
