//! The folder of the capture that an import makes or adds to.

use super::notes::Notes;
use crate::{args::ImportArgs, failure::Usage};
use anyhow::Result;
use std::path::{Path, PathBuf};
use toml::{Table, Value};
use unic_core::clip::Clip;
use unic_io::{
    Capture, Error, Manifest, Split,
    capture::{MANIFEST, OWN_FILES, capture_written_by, real_path},
};

/// Refuses outputs in another capture, as far as this can be checked before any work.
///
/// # Errors
/// A [`Usage`] that names the folder.
pub(super) fn check_outputs(args: &ImportArgs) -> Result<()> {
    let out = &args.out;
    // A linked folder of clips may belong to another capture, whose files would be overwritten.
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

/// Makes the manifest of the capture with the new clip.
///
/// # Errors
/// A clip of that name without `--overwrite` or that is an input; a test clip that does not exist.
pub(super) fn manifest(
    args: &ImportArgs,
    before: Option<&Capture>,
    clip: &Clip,
    notes: &Notes,
) -> Result<Manifest> {
    let mut manifest = match before {
        Some(capture) => capture.manifest.clone(),
        None => Manifest::new(name_of(&args.out), clip.fps),
    };
    if let Some(path) = before.and_then(|capture| capture.has_clip_files(&clip.name)) {
        refuse_taken(args, &path, clip)?;
    }
    // A clip that is imported again keeps its purpose.
    if manifest.splits.split_of(&clip.name).is_none() {
        manifest.splits.train.push(clip.name.clone());
    }
    for name in &args.test {
        if manifest.splits.split_of(name).is_none() {
            let names: Vec<&str> = manifest.splits.iter().map(|(name, _)| name).collect();
            let text = format!("--test: expected names among {}; found {name}", names.join(", "));
            return Err(Usage(text).into());
        }
        for split in Split::ALL {
            manifest.splits.of_mut(split).retain(|other| other != name);
        }
        manifest.splits.test.push(name.clone());
    }
    record(args, clip, notes, &mut manifest.source);
    Ok(manifest)
}

/// Refuses to replace a clip unless `--overwrite` is given, and always one that is an input.
fn refuse_taken(args: &ImportArgs, path: &Path, clip: &Clip) -> Result<()> {
    let is_input = |input: &PathBuf| {
        let input = real_path(input);
        // Inputs may be the motion or the garment of the clip itself.
        input == real_path(path)
            || input.file_stem() == Some(clip.name.as_ref()) && input.parent() == real_path(path).parent()
    };
    let text = if [&args.garment, &args.motion].into_iter().any(is_input) {
        format!(
            "{}: expected a new clip, found the input; --clip gives the clip another name",
            path.display()
        )
    } else if args.overwrite {
        return Ok(());
    } else {
        format!(
            "{}: expected no clip `{}`, found one; --overwrite replaces it, --clip gives another name",
            path.display(),
            clip.name
        )
    };
    Err(Usage(text).into())
}

/// Records the files and conversions of a clip in the manifest's table `[source]`.
fn record(args: &ImportArgs, clip: &Clip, notes: &Notes, source: &mut Table) {
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
        imports.insert(clip.name.clone(), Value::Table(entry));
    }
}

fn name_of(out: &Path) -> String {
    let name = real_path(out)
        .file_name()
        .map(|name| name.to_string_lossy().into_owned());
    name.unwrap_or_else(|| "capture".into())
}

/// Text of an error about a staged file, with the name that the file is to have.
pub(super) fn outside(error: &Error, staged: &Path, out: &Path) -> String {
    error
        .to_string()
        .replace(&staged.display().to_string(), &out.display().to_string())
}
