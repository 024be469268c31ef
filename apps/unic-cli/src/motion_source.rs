//! Steered characters: a character with its motion database, from built-in clips, motion files or a
//! database file.

use crate::{
    args::{CharacterArgs, ClipArgs, MotionSourceArgs},
    checks::ForceArgs,
    motion_file,
    output::print_status,
};
use anyhow::{Context, Result, bail};
use std::{path::Path, sync::Arc};
use unic_builtin::{human, motion::control_set};
use unic_core::{
    character::Character,
    clip::Clip,
    motion_matching::{Database, DatabaseSettings, TagFilter, TaggedClip},
    skeleton::Skeleton,
};
use unic_io::{
    import_character, joint_names::counterparts, read_motion_database, retarget::legs_of,
    rigged::CharacterOptions,
};

/// Frames a second of databases without a garment, and so of their controllers.
pub(crate) const FPS: f32 = 30.0;
/// Tag of clips that are never played.
const EXCLUDED: &str = "excluded";
/// Seed of the built-in clips.
const CLIP_SEED: u64 = 0;
/// Largest distance between a joint of a database and the same joint of its character, metres.
/// Numbers are written exactly; files of one character from two programs round them.
const SAME_JOINT_M: f32 = 1e-3;

/// Character with the database of its motion.
pub(crate) struct MotionSource {
    /// Character that is steered.
    pub(crate) character: Character,
    /// Motion of the character's skeleton.
    pub(crate) database: Arc<Database>,
}

impl MotionSource {
    /// Reads a database file, or makes a database from built-in clips or motion files.
    ///
    /// # Errors
    /// Files that cannot be read or are probable mistakes, a database of another skeleton than the
    /// character's or of another rate, clips that do not make a database.
    pub(crate) fn read(
        character: Character,
        fps: f32,
        args: &MotionSourceArgs,
        force: ForceArgs,
    ) -> Result<Self> {
        let Some(path) = &args.database else {
            return Self::build(character, fps, &args.clips, force);
        };
        let database = read_motion_database(path)?;
        check_skeleton(path, &database, &character.skeleton)?;
        if database.fps() != fps {
            let (path, found) = (path.display(), database.fps());
            bail!("{path}: expected {fps} frames a second, found {found}");
        }
        Ok(Self {
            character,
            database: Arc::new(database),
        })
    }

    /// Makes a database from built-in clips or motion files.
    ///
    /// # Errors
    /// Files that cannot be read or are probable mistakes, clips that do not make a database.
    pub(crate) fn build(character: Character, fps: f32, args: &ClipArgs, force: ForceArgs) -> Result<Self> {
        let clips = match args.motion.as_slice() {
            [] => control_set(&character, CLIP_SEED, fps)?,
            files => (files.iter())
                .map(|path| motion_file::read(path, &character, fps, &args.reading, force))
                .collect::<Result<_>>()?,
        };
        let database = Arc::new(database(&args.exclude, &character, &clips)?);
        Ok(Self { character, database })
    }

    /// Frames that are played.
    pub(crate) fn tags(&self) -> TagFilter {
        TagFilter {
            required: 0,
            excluded: self.database.tag_bit(EXCLUDED).unwrap_or(0),
        }
    }
}

/// Reads the character that is steered.
///
/// # Errors
/// A file that is no character.
pub(crate) fn steered_character(args: &CharacterArgs) -> Result<Character> {
    character(args.character.as_deref(), args.body.as_deref())
}

/// Reads a character, of several skinned meshes the one called `body`, or makes the built-in human.
///
/// # Errors
/// A file that is no character.
pub(crate) fn character(path: Option<&Path>, body: Option<&str>) -> Result<Character> {
    let options = CharacterOptions {
        body,
        ..CharacterOptions::default()
    };
    match path {
        Some(path) => {
            let import = import_character(path, &options)?;
            for note in &import.notes {
                print_status(&format!("{}: {note}", path.display()));
            }
            Ok(import.character)
        }
        None => Ok(human::human(&human::HumanParameters::default())?),
    }
}

fn database(exclude: &[String], character: &Character, clips: &[Clip]) -> Result<Database> {
    let legs = legs_of(&character.skeleton)
        .context("the character: expected joint names of two legs, found none that are known")?;
    let settings = DatabaseSettings {
        mirror: counterparts(character.skeleton.names()),
        ..DatabaseSettings::standard(character, legs)
    };
    let is_excluded = |clip: &Clip| {
        let name = clip.name.to_lowercase();
        exclude.iter().any(|word| name.contains(&word.to_lowercase()))
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

/// Checks that a database is of a character: its poses would bend another one.
fn check_skeleton(path: &Path, database: &Database, skeleton: &Skeleton) -> Result<()> {
    let (path, found) = (path.display(), database.skeleton());
    let [expected_len, found_len] = [skeleton.len(), found.len()];
    if expected_len != found_len {
        bail!(
            "{path}: expected {expected_len} joints as in the character, found {found_len}; a database is of one \
             character"
        );
    }
    let is_other = |&j: &usize| {
        let way = skeleton.joints()[j] - found.joints()[j];
        skeleton.parents()[j] != found.parents()[j] || way.length() > SAME_JOINT_M
    };
    if let Some(joint) = (0..expected_len).find(is_other) {
        let place = |of: &Skeleton| format!("{:.3}", of.joints()[joint]);
        bail!(
            "{path}: expected the character's skeleton, with joint {joint} at {}, found it at {}; a database is \
             of one character",
            place(skeleton),
            place(found)
        );
    }
    Ok(())
}
