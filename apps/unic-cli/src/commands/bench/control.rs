//! `unic bench control`: how well a character follows commands.

use crate::{
    args::ControlArgs,
    interrupt, motion_file,
    output::{print, print_json},
};
use anyhow::{Context, Result, bail};
use std::sync::Arc;
use unic_builtin::{human, motion::control_set};
use unic_core::{
    character::Character,
    clip::Clip,
    motion_matching::{ControllerSettings, Database, DatabaseSettings, TagFilter, TaggedClip},
};
use unic_eval::control::ControlReport;
use unic_io::{joint_names::counterparts, read_character, retarget::legs_of};

/// Frames a second of the database and of the controller.
const FPS: f32 = 30.0;
/// Tag of clips that are never played.
const EXCLUDED: &str = "excluded";
/// Seed of the built-in clips.
const CLIP_SEED: u64 = 0;

/// Runs the scripts and prints their metrics.
pub(super) fn run(args: &ControlArgs) -> Result<()> {
    let Motion { character, clips } = motion(args)?;
    let database = Arc::new(database(args, &character, &clips)?);
    let tags = TagFilter {
        required: 0,
        excluded: database.tag_bit(EXCLUDED).unwrap_or(0),
    };
    let settings = ControllerSettings::new(args.responsiveness);
    let report = ControlReport::measure::<anyhow::Error>(&database, settings, tags, args.seed, &mut |_| {
        Ok(interrupt::check()?)
    })?;
    match args.json {
        true => print_json(&report),
        false => print(&format!("{report}\n")),
    }
}

/// Clips with the character that they move.
struct Motion {
    character: Character,
    clips: Vec<Clip>,
}

fn motion(args: &ControlArgs) -> Result<Motion> {
    let character = match &args.character {
        Some(path) => read_character(path)?,
        None => human::human(&human::HumanParameters::default())?,
    };
    if args.motion.is_empty() {
        let clips = control_set(&character, CLIP_SEED, FPS)?;
        return Ok(Motion { character, clips });
    }
    let read = |path| motion_file::read(path, &character, FPS, &args.reading, args.force);
    let clips = args.motion.iter().map(|path| read(path)).collect::<Result<_>>()?;
    Ok(Motion { character, clips })
}

fn database(args: &ControlArgs, character: &Character, clips: &[Clip]) -> Result<Database> {
    let legs = legs_of(&character.skeleton)
        .context("the character: expected joint names of two legs, found none that are known")?;
    let settings = DatabaseSettings {
        mirror: counterparts(character.skeleton.names()),
        ..DatabaseSettings::standard(character, legs)
    };
    let is_excluded = |clip: &Clip| {
        let name = clip.name.to_lowercase();
        args.exclude
            .iter()
            .any(|word| name.contains(&word.to_lowercase()))
    };
    if clips.iter().all(is_excluded) {
        bail!("--exclude: expected a clip that is left, found none");
    }
    let tagged: Vec<TaggedClip> = (clips.iter())
        .map(|clip| match is_excluded(clip) {
            true => TaggedClip::whole(clip, EXCLUDED),
            false => TaggedClip::untagged(clip),
        })
        .collect();
    Ok(Database::build(&character.skeleton, &tagged, settings)?)
}
