//! What is simulated: character, garment, motions.

use crate::{args::SimulateArgs, failure::Usage, motion_file};
use anyhow::{Result, anyhow};
use glam::{Quat, Vec3};
use std::{
    f32::consts::PI,
    path::{Path, PathBuf},
};
use unic_builtin::{
    garments::{Fabric, FlaredSkirt, GarmentError, GarmentMesh, PleatedDress, Robe, TShirt, TulleSkirt},
    human::{HumanParameters, human},
    motion::standard_set,
};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
    mesh::TriMesh,
};
use unic_io::{
    Split,
    capture::{VertexAttributes, default_weights, read_garment},
    read_character, read_obj,
};
use unic_sim::Material;

/// The built-in character's name on the command line.
const HUMAN: &str = "human";

/// The built-in garments by their names on the command line.
const GARMENTS: [(&str, Maker); 5] = [
    ("tshirt", |c| TShirt::default().make(c)),
    ("skirt", |c| FlaredSkirt::default().make(c)),
    ("pleated_dress", |c| PleatedDress::default().make(c)),
    ("tulle_skirt", |c| TulleSkirt::default().make(c)),
    ("robe", |c| Robe::default().make(c)),
];

type Maker = fn(&Character) -> Result<GarmentMesh, GarmentError>;

/// Seed of the built-in motions: everybody has the same.
const MOTION_SEED: u64 = 1;

/// A garment with all that a simulation needs to know of it.
pub(super) struct Cut {
    /// Rest shape and skinning weights.
    pub(super) garment: Garment,
    /// What goes into `garment.npz`.
    pub(super) attributes: VertexAttributes,
    /// One a face.
    pub(super) materials: Vec<Material>,
    /// What the part numbers of `attributes.groups` are called; empty where nobody has named them.
    pub(super) parts: Vec<String>,
}

/// A motion and what it is for.
pub(super) struct Job {
    /// At the capture's frame rate.
    pub(super) clip: Clip,
    /// Split of the capture.
    pub(super) split: Split,
    /// Where it comes from.
    pub(super) source: String,
}

/// The character: built in, a file, or a folder with `character.npz`.
pub(super) fn character(args: &SimulateArgs) -> Result<Character> {
    if args.character.as_os_str() == HUMAN && !args.character.exists() {
        return Ok(human(&HumanParameters::default())?);
    }
    let path = inside(&args.character, "character.npz");
    Ok(read_character(&path)?)
}

/// The garment: built in, an .obj, or a folder with `garment.obj` and perhaps `garment.npz`.
pub(super) fn garment(args: &SimulateArgs, character: &Character) -> Result<Cut> {
    let name = args.garment.to_string_lossy();
    match GARMENTS.iter().find(|(built_in, _)| *built_in == name) {
        Some((_, make)) if !args.garment.exists() => built_in(args, make(character)?, character),
        _ => users(args, character),
    }
}

fn built_in(args: &SimulateArgs, made: GarmentMesh, character: &Character) -> Result<Cut> {
    let pinned = made.attached();
    let attributes = VertexAttributes {
        pinned: pinned.contains(&true).then_some(pinned),
        groups: (made.parts.len() > 1).then(|| made.part_of_vertex.clone()),
    };
    let fabric_of = |face: &[u32; 3]| {
        let parts = face.map(|v| made.part_of_vertex[v as usize]);
        // A face across a seam is of the part that has more of it.
        let part = if parts[1] == parts[2] { parts[1] } else { parts[0] };
        args.material
            .map_or_else(|| material(made.parts[part as usize].fabric), Material::from)
    };
    Ok(Cut {
        materials: made.mesh.faces.iter().map(fabric_of).collect(),
        parts: made.parts.iter().map(|p| p.name.clone()).collect(),
        garment: dressed(made.mesh, character, &args.garment)?,
        attributes,
    })
}

fn users(args: &SimulateArgs, character: &Character) -> Result<Cut> {
    let (garment, attributes) = if args.garment.is_dir() {
        read_garment(&args.garment, character)?
    } else if args.garment.exists() || args.garment.extension().is_some() {
        let mesh = read_obj(&args.garment)?;
        (
            dressed(mesh, character, &args.garment)?,
            VertexAttributes::default(),
        )
    } else {
        let names: Vec<&str> = GARMENTS.iter().map(|(name, _)| *name).collect();
        let expected = names.join(", ");
        let found = args.garment.display();
        return Err(Usage(format!(
            "--garment: expected an .obj file, a folder with garment.obj, or one of {expected}; found {found}"
        ))
        .into());
    };
    let material = args.material.map_or(Material::COTTON, Material::from);
    Ok(Cut {
        materials: vec![material; garment.rest.faces.len()],
        parts: Vec::new(),
        garment,
        attributes,
    })
}

fn dressed(rest: TriMesh, character: &Character, path: &Path) -> Result<Garment> {
    let weights = default_weights(&rest, character).map_err(|e| anyhow!("{}: {e}", path.display()))?;
    Ok(Garment::new(rest, weights))
}

fn material(fabric: Fabric) -> Material {
    match fabric {
        Fabric::Cotton => Material::COTTON,
        Fabric::Denim => Material::DENIM,
        Fabric::Silk => Material::SILK,
        Fabric::Tulle => Material::TULLE,
    }
}

/// The motions with their splits, in the order of the command line.
pub(super) fn jobs(args: &SimulateArgs, character: &Character) -> Result<Vec<Job>> {
    let mut jobs = match args.motion.is_empty() {
        true => built_in_motions(args, character)?,
        false => named_motions(args, character)?,
    };
    refuse_namesakes(&jobs)?;
    name_splits(args, &mut jobs)?;
    if let Some(wind) = args.wind {
        let blow = |job: &mut Job| job.clip.wind = vec![wind; job.clip.len()];
        jobs.iter_mut().for_each(blow);
    }
    if let Some(speed) = args.breeze {
        let windy = in_breeze(&jobs, speed);
        jobs.extend(windy);
        refuse_namesakes(&jobs)?;
    }
    if let Some(seconds) = args.seconds {
        jobs.iter_mut().for_each(|job| {
            let frames = (seconds * job.clip.fps).ceil() as usize;
            job.clip.poses.truncate(frames.max(2));
            job.clip.wind.truncate(job.clip.poses.len());
        });
    }
    Ok(jobs)
}

/// Every training motion once more, in a wind on top of its own: successive ones from directions a
/// golden angle apart, so that any number of them covers the circle evenly.
fn in_breeze(jobs: &[Job], speed: f32) -> Vec<Job> {
    let golden_angle = PI * (3.0 - 5f32.sqrt());
    let train = jobs.iter().filter(|job| job.split == Split::Train);
    let windy = |(i, job): (usize, &Job)| {
        let breeze = Quat::from_rotation_y(i as f32 * golden_angle) * Vec3::Z * speed;
        let mut clip = job.clip.clone();
        clip.name.push_str("_breeze");
        clip.wind = (0..clip.len()).map(|t| job.clip.wind_at(t) + breeze).collect();
        Job {
            clip,
            split: Split::Train,
            source: format!("{} in a breeze of {speed} m/s", job.source),
        }
    };
    train.enumerate().map(windy).collect()
}

/// The standard set, with its own test clips.
fn built_in_motions(args: &SimulateArgs, character: &Character) -> Result<Vec<Job>> {
    let set = standard_set(character, MOTION_SEED, args.fps)?;
    let job = |split| {
        move |clip| Job {
            clip,
            split,
            source: "built in".into(),
        }
    };
    let train = set.train.into_iter().map(job(Split::Train));
    Ok(train.chain(set.test.into_iter().map(job(Split::Test))).collect())
}

/// Files and built-in clips. The last of several is held out: without a clip that training does not
/// see nothing could be measured.
fn named_motions(args: &SimulateArgs, character: &Character) -> Result<Vec<Job>> {
    let is_last = |i: usize| i > 0 && i + 1 == args.motion.len();
    let mut built_in = None;
    let mut jobs = Vec::new();
    for (i, path) in args.motion.iter().enumerate() {
        let (clip, source) = if path.exists() || path.extension().is_some() {
            let clip = motion_file::read(path, character, args.fps, &args.reading, args.force)?;
            (clip, path.display().to_string())
        } else {
            let clips = match built_in.take() {
                Some(clips) => clips,
                None => built_in_motions(args, character)?,
            };
            let clip = built_in_clip(&clips, path)?;
            built_in = Some(clips);
            (clip, "built in".into())
        };
        let split = if is_last(i) { Split::Test } else { Split::Train };
        jobs.push(Job { clip, split, source });
    }
    Ok(jobs)
}

fn built_in_clip(jobs: &[Job], name: &Path) -> Result<Clip> {
    match jobs.iter().find(|job| name.as_os_str() == job.clip.name.as_str()) {
        Some(job) => Ok(job.clip.clone()),
        None => {
            let names: Vec<&str> = jobs.iter().map(|job| job.clip.name.as_str()).collect();
            let (names, found) = (names.join(", "), name.display());
            let text = format!("--motion: expected a file or one of {names}; found {found}");
            Err(Usage(text).into())
        }
    }
}

fn refuse_namesakes(jobs: &[Job]) -> Result<()> {
    let mut names: Vec<&str> = jobs.iter().map(|job| job.clip.name.as_str()).collect();
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        None => Ok(()),
        Some(pair) => {
            let name = pair[0];
            let text = format!("--motion: expected files of different names, found {name} twice");
            Err(Usage(text).into())
        }
    }
}

/// `--test` and `--validation` say which clips are which.
fn name_splits(args: &SimulateArgs, jobs: &mut [Job]) -> Result<()> {
    let mut named = args.test.iter().chain(&args.validation);
    if let Some(name) = named.find(|name| !jobs.iter().any(|job| job.clip.name == **name)) {
        let names: Vec<&str> = jobs.iter().map(|job| job.clip.name.as_str()).collect();
        let names = names.join(", ");
        let text = format!("--test and --validation: expected names among {names}; found {name}");
        return Err(Usage(text).into());
    }
    for job in jobs {
        job.split = if args.validation.contains(&job.clip.name) {
            Split::Validation
        } else if args.test.contains(&job.clip.name) {
            Split::Test
        } else if args.test.is_empty() {
            job.split
        } else {
            Split::Train
        };
    }
    Ok(())
}

fn inside(path: &Path, name: &str) -> PathBuf {
    match path.is_dir() {
        true => path.join(name),
        false => path.to_owned(),
    }
}
