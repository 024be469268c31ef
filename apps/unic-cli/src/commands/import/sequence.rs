//! Folders in which Marvelous Designer and CLO users keep a simulated sequence.
//!
//! | path in the folder | content |
//! |---|---|
//! | `deformation/*.obj` | garment, one file a frame |
//! | `animation.fbx`, or the only FBX or BVH file | character and its motion, or joints and their motion alone |
//! | `motion/*.obj` | body, one file a frame, for joints without a skinned mesh |
//!
//! A folder of such folders is imported whole.

use crate::{
    args::{ImportArgs, ImportFiles},
    failure::Usage,
};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use unic_io::{
    Capture,
    cache::has_obj_files,
    rig_fit::UnriggedBody,
    rigged::{RiggedFormat, has_skinned_mesh},
};

/// Folder of the garment's frames in a sequence.
const FRAMES: &str = "deformation";
/// Folder of the body's frames.
const BODY: &str = "motion";
/// File of the character and its motion, where there are several FBX files.
const RIG: &str = "animation.fbx";

/// Clips that one command imports.
pub(super) enum Import {
    Clip(Box<ImportArgs>),
    /// A clip of each sequence of a folder, and the names of those that the capture has already.
    Sequences {
        clips: Vec<ImportArgs>,
        kept: Vec<String>,
    },
}

/// Returns the options of an import with all of its files, some of which a sequence folder provides.
///
/// # Errors
/// No motion, a sequence folder without a motion file or with several.
pub(super) fn resolve(args: &ImportArgs) -> Result<Import> {
    let ImportFiles {
        garment,
        motion,
        character,
    } = args.files.clone();
    let sequences = sequences_in(&garment);
    if !sequences.is_empty() {
        return several(args, sequences);
    }
    if garment.join(FRAMES).is_dir() {
        let has_capture = unic_io::capture::is_capture(&args.out);
        return Ok(Import::Clip(Box::new(sequence(args, &garment, has_capture)?)));
    }
    let Some(motion) = motion else {
        let text = "--motion: expected the motion of the character, found none";
        return Err(Usage(text.to_owned()).into());
    };
    Ok(Import::Clip(Box::new(ImportArgs {
        garment,
        motion,
        character,
        ..args.clone()
    })))
}

/// Folders of sequences in a folder, by name.
fn sequences_in(folder: &Path) -> Vec<PathBuf> {
    if folder.join(FRAMES).is_dir() {
        return Vec::new();
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    found.retain(|path| path.join(FRAMES).is_dir() && !is_hidden(path));
    found.sort();
    found
}

/// Options for each sequence that the capture has not. A test clip is stated with its sequence.
fn several(args: &ImportArgs, folders: Vec<PathBuf>) -> Result<Import> {
    check_options_of_several(args)?;
    let names: Vec<String> = folders.iter().filter_map(|folder| name(folder)).collect();
    if let Some(other) = args.test.iter().find(|test| !names.contains(test)) {
        let names = names.join(", ");
        let text = format!("--test: expected names among {names}, found {other}");
        return Err(Usage(text).into());
    }
    let splits = match unic_io::capture::is_capture(&args.out) {
        true => Some(Capture::open(&args.out)?.manifest.splits),
        false => None,
    };
    let is_kept = |name: &String| {
        let split = splits.as_ref().and_then(|splits| splits.split_of(name));
        split.is_some() && !args.overwrite
    };
    let kept: Vec<String> = names.iter().filter(|name| is_kept(name)).cloned().collect();
    if let Some(name) = args.test.iter().find(|name| kept.contains(name)) {
        let text = format!("--test: expected new clips, found {name}; --overwrite imports it again");
        return Err(Usage(text).into());
    }
    let new = (folders.iter().zip(&names)).filter(|(_, name)| !kept.contains(name));
    let options = |(i, (folder, _)): (usize, (&PathBuf, _))| {
        let mut options = sequence(args, folder, splits.is_some() || i > 0)?;
        (options.test).retain(|test| options.clip.as_ref() == Some(test));
        Ok(options)
    };
    let clips = new.enumerate().map(options).collect::<Result<_>>()?;
    Ok(Import::Sequences { clips, kept })
}

/// Refuses options that hold for one clip.
fn check_options_of_several(args: &ImportArgs) -> Result<()> {
    let is_animation = match &args.files.character {
        Some(path) => UnriggedBody::find(path, args.body.as_deref())?.is_some(),
        None => false,
    };
    let one = [
        ("--motion", args.files.motion.is_some()),
        ("--clip", args.clip.is_some()),
        ("--character", is_animation),
    ];
    match one.into_iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((option, _)) => {
            let found = args.files.garment.display();
            let text = format!("{option}: expected a garment of one clip, found the sequences in {found}");
            Err(Usage(text).into())
        }
    }
}

/// Options for the sequence in a folder.
fn sequence(args: &ImportArgs, folder: &Path, has_capture: bool) -> Result<ImportArgs> {
    let motion = match &args.files.motion {
        Some(motion) => motion.clone(),
        None => motion_in(folder)?,
    };
    let character = match args.files.character.clone() {
        // A capture has its character already, which an animated body is checked against.
        None => body(folder, &motion)?.filter(|own| !has_capture || *own != motion),
        given => given,
    };
    Ok(ImportArgs {
        garment: folder.join(FRAMES),
        clip: args.clip.clone().or_else(|| name(folder)),
        motion,
        character,
        ..args.clone()
    })
}

/// The character of a sequence: the motion's own, or the animated body. A rig comes with its motion.
fn body(folder: &Path, motion: &Path) -> Result<Option<PathBuf>> {
    let frames = Some(folder.join(BODY)).filter(|frames| has_obj_files(frames));
    if RiggedFormat::of(motion).is_some() && (frames.is_none() || has_skinned_mesh(motion)?) {
        return Ok(Some(motion.to_path_buf()));
    }
    Ok(frames)
}

fn name(folder: &Path) -> Option<String> {
    Some(folder.file_name()?.to_string_lossy().into_owned())
}

fn is_hidden(path: &Path) -> bool {
    name(path).is_some_and(|name| name.starts_with('.'))
}

/// Finds the motion file of a sequence.
fn motion_in(folder: &Path) -> Result<PathBuf> {
    let preferred = folder.join(RIG);
    if preferred.is_file() {
        return Ok(preferred);
    }
    let entries = std::fs::read_dir(folder).with_context(|| format!("{}: cannot read", folder.display()))?;
    let mut found: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    let is_motion = |path: &Path| {
        let ending = path.extension().map(|e| e.to_ascii_lowercase());
        ending.is_some_and(|ending| ending == "fbx" || ending == "bvh")
    };
    found.retain(|path| is_motion(path) && !is_hidden(path));
    match found.as_slice() {
        [path] => Ok(path.clone()),
        _ => bail!(
            "{}: expected {RIG} or one FBX or BVH file beside {FRAMES}, found {}; --motion names the motion",
            folder.display(),
            found.len()
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: ImportArgs,
    }

    fn resolved(line: &str) -> Result<ImportArgs> {
        match resolve(&Line::parse_from(line.split(' ')).args)? {
            Import::Clip(clip) => Ok(*clip),
            Import::Sequences { clips, .. } => panic!("{} sequences", clips.len()),
        }
    }

    #[test]
    fn a_sequence_brings_its_frames_its_rig_and_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let sequence = folder.path().join("sequence_07");
        std::fs::create_dir_all(sequence.join(FRAMES)).unwrap();
        let line = format!(
            "import --garment {} --out {}/made",
            sequence.display(),
            folder.path().display()
        );
        let error = resolved(&line).unwrap_err().to_string();
        assert!(
            error.contains("expected animation.fbx or one FBX or BVH file"),
            "{error}"
        );
        let rig = sequence.join("take.FBX");
        std::fs::write(&rig, "").unwrap();
        let args = resolved(&line).unwrap();
        assert_eq!((&args.garment, &args.motion), (&sequence.join(FRAMES), &rig));
        assert_eq!(
            (args.character.as_ref(), args.clip.as_deref()),
            (Some(&rig), Some("sequence_07"))
        );
        let args = resolved(&format!("{line} --motion a.bvh --character b.npz --clip c")).unwrap();
        assert_eq!(args.motion, PathBuf::from("a.bvh"));
        assert_eq!(args.character, Some("b.npz".into()));
        assert_eq!(args.clip.as_deref(), Some("c"));
        std::fs::write(sequence.join("other.fbx"), "").unwrap();
        assert!(resolved(&line).is_err());
        std::fs::write(sequence.join(RIG), "").unwrap();
        assert_eq!(resolved(&line).unwrap().motion, sequence.join(RIG));
    }

    #[test]
    fn other_garments_need_a_motion() {
        let error = resolved("import --garment a.pc2 --out c")
            .unwrap_err()
            .to_string();
        assert!(error.contains("--motion: expected"), "{error}");
        let args = resolved("import --garment a.pc2 --motion b.bvh --out c").unwrap();
        assert_eq!((args.garment, args.character), ("a.pc2".into(), None));
    }
}
