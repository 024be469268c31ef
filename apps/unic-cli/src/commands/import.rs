//! The command `unic import`: turns files of other programs into a clip of a capture.
//!
//! The clip is written in a temporary folder, checked there as every capture is, and then moved: a
//! capture that exists is never left with half a clip.

mod alignment;
mod animation;
mod folder;
mod garment;
mod notes;
mod report;
mod rest;
mod sequence;
mod unrigged;

use crate::{
    args::{ImportArgs, MeshUpName, UpName},
    failure::Usage,
    folder_lock::FolderLock,
    interrupt,
    output::print_status,
    outputs::refuse_other_captures,
    progress::Progress,
};
use alignment::Alignment;
use animation::{Animation, MeshChoice};
use anyhow::{Result, anyhow};
use notes::Notes;
use report::{ImportSummary, SequencesSummary};
use rest::FirstFrame;
use sequence::Import;
use std::{path::Path, time::Instant};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
    mesh::TriMesh,
};
use unic_io::{
    BoneMap, Capture, CaptureWriter, FootLock, GroundPlacement, LowPass, Manifest, MotionOptions, Split,
    UpAxis,
    capture::{JointReference, StagedClip, VertexAttributes, default_weights, finish_moves},
    check, import_character, import_motion,
};

/// Imports a clip, or one of each sequence of a folder.
///
/// # Errors
/// Unusable options or inputs, files that do not fit each other or the capture, files that cannot
/// be read or written, an interruption. The clips before it stay.
pub(crate) fn run(args: &ImportArgs) -> Result<()> {
    refuse_other_captures(&args.out)?;
    // Held until the function returns: no other process writes into the folder.
    let _lock = FolderLock::acquire(&args.out)?;
    finish_moves(&args.out)?;
    let (clips, kept) = match sequence::resolve(args)? {
        Import::Clip(clip) => {
            let summary = import(&clip)?;
            say_if_none_is_held_out(&args.out)?;
            return report::print_summary(args.json, &summary);
        }
        Import::Sequences { clips, kept } => (clips, kept),
    };
    let mut summary = SequencesSummary::new(&args.out, kept);
    for clip in &clips {
        summary.imported(import(clip)?);
    }
    say_if_none_is_held_out(&args.out)?;
    report::print_sequences(args.json, &summary)
}

fn say_if_none_is_held_out(out: &Path) -> Result<()> {
    if Capture::open(out)?.manifest.splits.test.is_empty() {
        let out = out.display();
        print_status(&format!(
            "{out}: no clip is held out for evaluation yet; --test names one"
        ));
    }
    Ok(())
}

/// Imports one clip into the folder of the capture, which is locked.
fn import(args: &ImportArgs) -> Result<ImportSummary> {
    let started = Instant::now();
    let before = folder::open(args)?;
    let mut notes = Notes::default();
    let mut body = unrigged::Body::open(args, &mut notes)?;
    let character = match &mut body {
        Some(body) => of_unrigged(args, before.as_ref(), body, &mut notes)?,
        None => character(args, before.as_ref(), &mut notes)?,
    };
    let choice = MeshChoice {
        path: &args.garment,
        object: args.object.as_deref(),
        other_vertices: character.body.vertices.len(),
    };
    let mut animation = Animation::open(args, &choice, &mut notes)?;
    let clip = clip(args, before.as_ref(), &character, &animation, &mut notes)?;
    if let Some(body) = &mut body {
        check_body(args, before.as_ref(), body, (&character, &clip), &mut notes)?;
    }
    folder::check_clip(args, before.as_ref(), &clip)?;
    let alignment = Alignment::new(args, animation.len(), clip.len())?;
    alignment.describe(&args.motion, &mut notes);
    let clip = clip.part(alignment.motion.clone());
    let first = FirstFrame {
        character: &character,
        pose: &clip.poses[0],
        frame: alignment.garment.start,
    };
    let rest = rest::rest(args, before.as_ref(), &mut animation, &first, &mut notes)?;
    garment::check_vertices(args, before.as_ref(), &animation, &rest)?;
    let mut figure = figure(args, before.as_ref(), character, animation, rest)?;
    let staged = StagedClip::create_in(&args.out)?;
    let alone = stage(args, staged.path(), &mut figure, &clip, &alignment)
        .map_err(|e| folder::outside(e, staged.path(), &args.out))?;
    let manifest = folder::manifest(args, before.as_ref(), alone, &notes);
    // The last moment at which nothing has changed.
    interrupt::check()?;
    staged.commit(&clip.name, &manifest)?;
    let counted = (&manifest, &figure.garment);
    Ok(ImportSummary::new(args, counted, &clip, notes, started.elapsed()))
}

/// Checks that the character follows the animated body.
fn check_body(
    args: &ImportArgs,
    before: Option<&Capture>,
    body: &mut unrigged::Body,
    (character, clip): (&Character, &Clip),
    notes: &mut Notes,
) -> Result<()> {
    let rms = body.check_follows(args, character, clip)?;
    if let (Some(_), Some(path)) = (before, &args.character) {
        let text = format!(
            "the character of the capture is taken: vertices are {:.2} mm off (RMS)",
            1e3 * rms
        );
        notes.add(path, &text);
    }
    Ok(())
}

/// A character, its garment and the garment's animation.
struct Figure {
    character: Character,
    garment: Garment,
    attributes: VertexAttributes,
    animation: Animation,
    /// Joints that touch the ground, unless their names tell.
    contacts: Option<[JointReference; 4]>,
}

/// Makes the figure of a new capture, whose rest shape is checked, or that of the capture that
/// exists.
fn figure(
    args: &ImportArgs,
    before: Option<&Capture>,
    character: Character,
    animation: Animation,
    rest: TriMesh,
) -> Result<Figure> {
    if let Some(capture) = before {
        return Ok(Figure {
            character: capture.character.clone(),
            garment: capture.garment.clone(),
            attributes: capture.attributes.clone(),
            animation,
            contacts: Some(capture.contact_joints.map(JointReference::Index)),
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
        contacts: args.contacts.clone(),
    })
}

fn with_default_weights(path: &Path, rest: TriMesh, character: &Character) -> Result<Garment> {
    let weights = default_weights(&rest, character).map_err(|e| anyhow!("{}: {e}", path.display()))?;
    Ok(Garment::new(rest, weights))
}

/// Makes a character of a body without a rig, or takes that of the capture.
fn of_unrigged(
    args: &ImportArgs,
    before: Option<&Capture>,
    body: &mut unrigged::Body,
    notes: &mut Notes,
) -> Result<Character> {
    if let Some(capture) = before {
        return Ok(capture.character.clone());
    }
    let character = body.character(args, &motion_options(args, None)?, notes)?;
    args.force
        .check_findings(&args.garment, &check::character(&character))?;
    Ok(character)
}

/// Reads the character of `--character`, which is that of the capture if there is one.
fn character(args: &ImportArgs, before: Option<&Capture>, notes: &mut Notes) -> Result<Character> {
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
    let import = import_character(path, &args.character_options())?;
    import.notes.iter().for_each(|note| notes.add(path, note));
    let character = import.character;
    if let Some(capture) = before {
        capture.check_same_character(path, &character)?;
        return Ok(character);
    }
    args.force.check_findings(path, &check::character(&character))?;
    Ok(character)
}

/// Reads the motion at the frame rate of the capture, which is that of the garment.
fn clip(
    args: &ImportArgs,
    before: Option<&Capture>,
    character: &Character,
    animation: &Animation,
    notes: &mut Notes,
) -> Result<Clip> {
    let fps = garment::frame_rate(args, before, animation, notes)?;
    let options = motion_options(args, fps)?;
    let import = import_motion(&args.motion, character, &options)?;
    args.force.check_findings(&args.motion, &import.findings)?;
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

/// Options of the motion's reader, for a motion at `fps`.
fn motion_options(args: &ImportArgs, fps: Option<f32>) -> Result<MotionOptions> {
    Ok(MotionOptions {
        fps,
        fps_of_file: args.fps.or(fps),
        metres_per_unit: args.scale,
        up: up_of_motion(args),
        bones: (args.bone_map.as_deref().map(BoneMap::read))
            .transpose()?
            .unwrap_or_default(),
        // The garment was simulated on the motion as it is. Whatever moves the body takes it away
        // from the garment.
        ground: GroundPlacement::Keep,
        feet: FootLock::Keep,
        low_pass: args.low_pass.unwrap_or(LowPass::Off),
        ..MotionOptions::default()
    })
}

fn up_of_motion(args: &ImportArgs) -> UpAxis {
    let of_all = args.up.map(|up| match up {
        MeshUpName::Y => UpAxis::Y,
        MeshUpName::Z => UpAxis::Z,
    });
    args.motion_up.map(UpName::into).or(of_all).unwrap_or_default()
}

/// Writes the clip as a capture of its own, and checks it for probable mistakes: another unit, axis,
/// vertex order or first frame. Returns the manifest of that capture.
fn stage(
    args: &ImportArgs,
    root: &Path,
    figure: &mut Figure,
    clip: &Clip,
    alignment: &Alignment,
) -> Result<Manifest> {
    let mut manifest = Manifest::new("staged", clip.fps);
    let Figure {
        character,
        garment,
        attributes,
        animation,
        contacts,
    } = figure;
    manifest.contact_joints.clone_from(contacts);
    let mut writer = CaptureWriter::create(root, manifest, character, garment, attributes)?;
    let mut out = writer.begin_clip(clip, Split::Train)?;
    let mut progress = Progress::new("importing", 0, clip.len() as u64);
    let mut positions = Vec::new();
    for (done, frame) in alignment.garment.clone().enumerate() {
        interrupt::check()?;
        animation.frame(frame, &mut positions)?;
        out.push(&positions)?;
        progress.set(done as u64 + 1, String::new);
    }
    out.finish()?;
    writer.finish()?;
    let capture = Capture::open(root)?;
    let findings = check::clip(&capture, &capture.load_clip(&clip.name)?);
    args.force.check_findings(&args.garment, &findings)?;
    Ok(capture.manifest)
}
