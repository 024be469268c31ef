//! Folders in which Marvelous Designer and CLO users keep a simulated sequence.
//!
//! | path in the folder | content |
//! |---|---|
//! | `deformation/*.obj` | garment, one file a frame |
//! | `animation.fbx`, or the only FBX file | character and its motion, or joints and their motion alone |
//! | `motion/*.obj` | body, one file a frame, for joints without a skinned mesh |

use crate::{
    args::{ImportArgs, ImportFiles},
    failure::Usage,
};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use unic_io::{
    cache::has_obj_files,
    rigged::{RiggedFormat, has_skinned_mesh},
};

/// Folder of the garment's frames in a sequence.
const FRAMES: &str = "deformation";
/// Folder of the body's frames.
const BODY: &str = "motion";
/// File of the character and its motion, where there are several FBX files.
const RIG: &str = "animation.fbx";

/// Returns the options of an import with all of its files, some of which a sequence folder provides.
///
/// # Errors
/// No motion, a sequence folder without an FBX file or with several.
pub(super) fn resolve(args: &ImportArgs) -> Result<ImportArgs> {
    let ImportFiles {
        garment,
        motion,
        character,
    } = args.files.clone();
    let frames = garment.join(FRAMES);
    let is_sequence = frames.is_dir();
    let motion = match motion {
        Some(motion) => motion,
        None if is_sequence => rig(&garment)?,
        None => {
            let text = "--motion: expected the motion of the character, found none";
            return Err(Usage(text.to_owned()).into());
        }
    };
    let mut resolved = args.clone();
    if is_sequence {
        let has_capture = unic_io::capture::is_capture(&args.out);
        resolved.character = match character {
            // A capture has its character already, which an animated body is checked against.
            None => body(&garment, &motion)?.filter(|own| !has_capture || *own != motion),
            given => given,
        };
        resolved.clip = args.clip.clone().or_else(|| name(&garment));
        resolved.garment = frames;
    } else {
        resolved.character = character;
        resolved.garment = garment;
    }
    resolved.motion = motion;
    Ok(resolved)
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

/// Finds the FBX file of a sequence.
fn rig(folder: &Path) -> Result<PathBuf> {
    let preferred = folder.join(RIG);
    if preferred.is_file() {
        return Ok(preferred);
    }
    let entries = std::fs::read_dir(folder).with_context(|| format!("{}: cannot read", folder.display()))?;
    let mut found: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    let is_hidden = |path: &Path| name(path).is_some_and(|name| name.starts_with('.'));
    found.retain(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("fbx")) && !is_hidden(path));
    match found.as_slice() {
        [path] => Ok(path.clone()),
        _ => bail!(
            "{}: expected {RIG} or one FBX file beside {FRAMES}, found {}; --motion names the motion",
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
        resolve(&Line::parse_from(line.split(' ')).args)
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
            error.contains("expected animation.fbx or one FBX file"),
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
