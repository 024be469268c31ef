//! The command `unic import`: turns files of other programs into a clip of a capture.
//!
//! The clip is written in a temporary folder, checked there as every capture is, and then moved: a
//! capture that exists is never left with half a clip.

mod alignment;
mod folder;
mod garment;
mod notes;
mod report;

use crate::{
    args::{ImportArgs, MotionArgs, UpName},
    failure::Usage,
    folder_lock::FolderLock,
    interrupt, motion_file,
    progress::Progress,
};
use alignment::Alignment;
use anyhow::{Context, Result, anyhow};
use garment::Animation;
use notes::Notes;
use report::ImportSummary;
use std::{path::Path, time::Instant};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
    mesh::TriMesh,
};
use unic_io::{
    Capture, CaptureWriter, Manifest, Split,
    atomic::TemporaryFolder,
    capture::{VertexAttributes, default_weights, move_clip},
    check, read_character,
};

/// Imports a clip.
///
/// # Errors
/// Unusable options or inputs, files that do not fit each other or the capture, files that cannot
/// be read or written, an interruption.
pub(crate) fn run(args: &ImportArgs) -> Result<()> {
    let started = Instant::now();
    folder::check_outputs(args)?;
    // Held until the function returns: no other process writes into the folder.
    let _lock = FolderLock::acquire(&args.out)?;
    let before = folder::open(args)?;
    let mut notes = Notes::default();
    let figure = figure(args, before.as_ref(), &mut notes)?;
    let clip = clip(args, before.as_ref(), &figure, &mut notes)?;
    let manifest = folder::manifest(args, before.as_ref(), &clip, &notes)?;
    let alignment = Alignment::new(args, figure.animation.frames.len(), clip.len())?;
    alignment.describe(&args.motion, &mut notes);
    let clip = clip.part(alignment.motion.clone());
    let temporary = TemporaryFolder::create_in(&args.out)
        .with_context(|| format!("{}: cannot create a folder in it", args.out.display()))?;
    let staged = temporary.path();
    stage(args, staged, &figure, &clip, &alignment)?;
    check_clip(args, staged, &clip.name)?;
    // The last moment at which nothing has changed.
    interrupt::check()?;
    move_clip(staged, &args.out, &clip.name, &manifest)?;
    report::print_summary(
        args,
        &ImportSummary::new(args, &manifest, &clip, &figure.garment, notes, started.elapsed()),
    )
}

/// A character, its garment and the garment's animation.
struct Figure {
    character: Character,
    garment: Garment,
    attributes: VertexAttributes,
    animation: Animation,
}

/// Reads the character and the garment, and checks them against the capture that exists.
fn figure(args: &ImportArgs, before: Option<&Capture>, notes: &mut Notes) -> Result<Figure> {
    let character = character(args, before)?;
    let animation = Animation::read(args, notes)?;
    let rest = garment::rest(args, before, &animation, notes)?;
    garment::check_vertex_count(args, before, &animation, &rest)?;
    if let Some(capture) = before {
        return Ok(Figure {
            character: capture.character.clone(),
            garment: capture.garment.clone(),
            attributes: capture.attributes.clone(),
            animation,
        });
    }
    let path = args.rest.as_ref().unwrap_or(&args.garment);
    args.force
        .check_findings(path, &check::garment(&rest, &character))?;
    Ok(Figure {
        garment: with_default_weights(path, rest, &character)?,
        character,
        attributes: VertexAttributes::default(),
        animation,
    })
}

fn with_default_weights(path: &Path, rest: TriMesh, character: &Character) -> Result<Garment> {
    let weights = default_weights(&rest, character).map_err(|e| anyhow!("{}: {e}", path.display()))?;
    Ok(Garment::new(rest, weights))
}

/// Reads the character of `--character`, which is that of the capture if there is one.
fn character(args: &ImportArgs, before: Option<&Capture>) -> Result<Character> {
    let Some(path) = &args.character else {
        return match before {
            Some(capture) => Ok(capture.character.clone()),
            None => {
                let text = format!(
                    "--character: expected the character of a new capture, found none; {} holds no capture",
                    args.out.display()
                );
                Err(Usage(text).into())
            }
        };
    };
    let character = read_character(path)?;
    if let Some(capture) = before {
        capture.check_same_character(path, &character)?;
        return Ok(character);
    }
    args.force.check_findings(path, &check::character(&character))?;
    Ok(character)
}

/// Reads the motion at the frame rate of the capture, which is that of the garment.
fn clip(args: &ImportArgs, before: Option<&Capture>, figure: &Figure, notes: &mut Notes) -> Result<Clip> {
    let fps = garment::frame_rate(args, before, &figure.animation, notes)?;
    let reading = MotionArgs {
        up: UpName::Auto,
        bone_map: args.bone_map.clone(),
        low_pass: args.low_pass,
        repeat: None,
    };
    let import = motion_file::import(&args.motion, &figure.character, fps, &reading, args.force)?;
    import.notes.iter().for_each(|note| notes.add(&args.motion, note));
    let mut clip = import.clip;
    if fps.is_none() {
        let text = format!(
            "no frame rate stated: that of the motion is taken, {} fps; --fps states another",
            clip.fps
        );
        notes.add(&args.garment, &text);
    }
    if let Some(name) = &args.clip {
        clip.name.clone_from(name);
    }
    Ok(clip)
}

/// Writes the clip as a capture of its own.
fn stage(args: &ImportArgs, root: &Path, figure: &Figure, clip: &Clip, alignment: &Alignment) -> Result<()> {
    let mut manifest = Manifest::new("staged", clip.fps);
    manifest.contact_joints.clone_from(&args.contacts);
    let mut writer = CaptureWriter::create(
        root,
        manifest,
        &figure.character,
        &figure.garment,
        &figure.attributes,
    )
    .map_err(|e| anyhow!("{}", folder::outside(&e, root, &args.out)))?;
    let mut out = writer.begin_clip(clip, Split::Train)?;
    let mut progress = Progress::new("importing", 0, clip.len() as u64);
    let mut positions = Vec::new();
    for (done, frame) in alignment.garment.clone().enumerate() {
        interrupt::check()?;
        figure.animation.frame(frame, &mut positions);
        if let Some(vertex) = positions.iter().position(|v| !v.is_finite()) {
            let garment = args.garment.display();
            return Err(anyhow!(
                "{garment}: expected finite positions, found vertex {vertex} of frame {frame} at none"
            ));
        }
        out.push(&positions)?;
        progress.set(done as u64 + 1, String::new);
    }
    out.finish()?;
    Ok(writer.finish()?)
}

/// Checks the staged clip for probable mistakes: another unit, axis, vertex order or first frame.
fn check_clip(args: &ImportArgs, staged: &Path, name: &str) -> Result<()> {
    let capture = Capture::open(staged)?;
    let findings = check::clip(&capture, &capture.load_clip(name)?);
    args.force.check_findings(&args.garment, &findings)
}
