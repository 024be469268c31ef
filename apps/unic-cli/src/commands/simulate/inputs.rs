//! Inputs of a simulation: character, garment and motions, built in or read from files.

use crate::{args::SimulateArgs, failure::Usage, mesh_units::MeshUnits, motion_file, output::print_status};
use anyhow::{Result, anyhow};
use glam::{Quat, Vec3};
use std::{
    f32::consts::PI,
    path::{Path, PathBuf},
};
use unic_builtin::{
    garments::{Fabric, FlaredSkirt, GarmentError, GarmentMesh, PleatedDress, Robe, TShirt, TulleSkirt},
    human::{HumanParameters, human},
    motion::{STANDARD_SEED, standard_set},
};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
    mesh::TriMesh,
};
use unic_io::{
    Assumed, Split,
    capture::{VertexAttributes, default_weights, read_garment},
    import_character, read_obj,
    rigged::CharacterOptions,
};
use unic_sim::Material;

/// Name of the built-in character on the command line.
const HUMAN: &str = "human";

/// Built-in garments by their names on the command line.
const GARMENTS: [(&str, Maker); 5] = [
    ("tshirt", |c| TShirt::default().make(c)),
    ("skirt", |c| FlaredSkirt::default().make(c)),
    ("pleated_dress", |c| PleatedDress::default().make(c)),
    ("tulle_skirt", |c| TulleSkirt::default().make(c)),
    ("robe", |c| Robe::default().make(c)),
];

/// Constructor of a built-in garment, cut to the size of a character.
type Maker = fn(&Character) -> Result<GarmentMesh, GarmentError>;

/// Garment with the properties that the simulation uses.
pub(super) struct GarmentInput {
    /// Rest shape and skinning weights.
    pub(super) garment: Garment,
    /// Values per vertex that go into `garment.npz`.
    pub(super) attributes: VertexAttributes,
    /// Material of each face.
    pub(super) materials: Vec<Material>,
    /// Names of the part numbers in `attributes.groups`; empty for garments read from files.
    pub(super) parts: Vec<String>,
}

/// Source of built-in motions.
const BUILT_IN: &str = "built in";

/// Motion to simulate.
pub(super) struct Job {
    /// Motion at the capture's frame rate.
    pub(super) clip: Clip,
    /// Split of the capture that the clip belongs to.
    pub(super) split: Split,
    /// File of the motion, or [`BUILT_IN`].
    pub(super) source: String,
}

/// Returns the character of `--character`: built in, a file, or a folder with `character.npz`.
pub(super) fn character(args: &SimulateArgs) -> Result<Character> {
    // A built-in name wins over a folder or file of that name, here and for garments and motions: a
    // folder that happens to be called "skirt" must not change what --garment skirt means.
    if args.character.as_os_str() == HUMAN {
        return Ok(human(&HumanParameters::default())?);
    }
    let path = file_or_file_in(&args.character, "character.npz");
    // The motions' axis holds for a character too that does not state its own.
    let options = CharacterOptions {
        assumed: Assumed {
            up: unic_io::UpAxis::from(args.reading.up).stated(),
            ..Assumed::default()
        },
        body: args.body.as_deref(),
    };
    let import = import_character(&path, &options)?;
    for note in &import.notes {
        print_status(&format!("{}: {note}", path.display()));
    }
    Ok(import.character)
}

/// Returns the garment of `--garment`: built in, an .obj file, or a folder with `garment.obj` and
/// optionally `garment.npz`.
pub(super) fn garment(args: &SimulateArgs, character: &Character) -> Result<GarmentInput> {
    let is_file = built_in_garment(&args.garment).is_none() && !args.garment.is_dir();
    if !is_file && (args.scale.is_some() || args.garment_up.is_some()) {
        let found = args.garment.display();
        let text = format!("--scale, --garment-up: expected an .obj file as the garment, found {found}");
        return Err(Usage(text).into());
    }
    match built_in_garment(&args.garment) {
        Some(make) => built_in(args, make(character)?, character),
        None => garment_from_files(args, character),
    }
}

fn built_in_garment(name: &Path) -> Option<Maker> {
    let garment = GARMENTS
        .iter()
        .find(|(built_in, _)| name.as_os_str() == *built_in);
    garment.map(|(_, make)| *make)
}

/// Returns the paths of all inputs that are read from files.
pub(super) fn files(args: &SimulateArgs) -> impl Iterator<Item = &PathBuf> {
    let character = Some(&args.character).filter(|path| path.as_os_str() != HUMAN);
    let garment = Some(&args.garment).filter(|path| built_in_garment(path).is_none());
    let motions = motion_file::files(&args.motion);
    character.into_iter().chain(garment).chain(motions)
}

fn built_in(args: &SimulateArgs, built: GarmentMesh, character: &Character) -> Result<GarmentInput> {
    let pinned = built.attached();
    // Arrays that hold no information are left out of `garment.npz`.
    let attributes = VertexAttributes {
        pinned: pinned.contains(&true).then_some(pinned),
        groups: (built.parts.len() > 1).then(|| built.part_of_vertex.clone()),
    };
    let fabric_of = |face: &[u32; 3]| {
        let parts = face.map(|v| built.part_of_vertex[v as usize]);
        // A face across a seam belongs to the part with two of its corners. A face of three parts
        // belongs to that of its first corner.
        let part = if parts[1] == parts[2] { parts[1] } else { parts[0] };
        args.material
            .map_or_else(|| material_of(built.parts[part as usize].fabric), Material::from)
    };
    Ok(GarmentInput {
        materials: built.mesh.faces.iter().map(fabric_of).collect(),
        parts: built.parts.iter().map(|p| p.name.clone()).collect(),
        garment: with_default_weights(built.mesh, character, &args.garment)?,
        attributes,
    })
}

fn garment_from_files(args: &SimulateArgs, character: &Character) -> Result<GarmentInput> {
    let (garment, attributes) = if args.garment.is_dir() {
        read_garment(&args.garment, character)?
    // A missing file with an ending gives the reader's error. A bare word is a mistyped built-in
    // name.
    } else if args.garment.exists() || args.garment.extension().is_some() {
        let units = MeshUnits::stated(args.garment_up, args.scale);
        let mesh = units.mesh(read_obj(&args.garment)?);
        for note in units.notes() {
            print_status(&format!("{}: {note}", args.garment.display()));
        }
        (
            with_default_weights(mesh, character, &args.garment)?,
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
    Ok(GarmentInput {
        materials: vec![material; garment.rest.faces.len()],
        parts: Vec::new(),
        garment,
        attributes,
    })
}

/// Garment with skinning weights diffused from those of the body.
fn with_default_weights(rest: TriMesh, character: &Character, path: &Path) -> Result<Garment> {
    let weights = default_weights(&rest, character).map_err(|e| anyhow!("{}: {e}", path.display()))?;
    Ok(Garment::new(rest, weights))
}

fn material_of(fabric: Fabric) -> Material {
    match fabric {
        Fabric::Cotton => Material::COTTON,
        Fabric::Denim => Material::DENIM,
        Fabric::Silk => Material::SILK,
        Fabric::Tulle => Material::TULLE,
    }
}

/// Different materials in the order in which they first occur.
pub(super) fn distinct(materials: &[Material]) -> Vec<Material> {
    // Materials hold floats, which can be neither hashed nor sorted; there are at most a few.
    let mut distinct: Vec<Material> = Vec::new();
    for material in materials {
        if !distinct.contains(material) {
            distinct.push(*material);
        }
    }
    distinct
}

/// Returns the motions with their splits, in the order of the command line.
pub(super) fn jobs(args: &SimulateArgs, character: &Character) -> Result<Vec<Job>> {
    let mut jobs = match args.motion.is_empty() {
        true => built_in_motions(args, character)?,
        false => named_motions(args, character)?,
    };
    refuse_duplicate_names(&jobs)?;
    assign_splits(args, &mut jobs)?;
    if let Some(wind) = args.wind {
        let blow = |job: &mut Job| job.clip.wind = vec![wind; job.clip.len()];
        jobs.iter_mut().for_each(blow);
    }
    if let Some(speed) = args.breeze {
        let copies = copies_in_wind(&jobs, speed);
        jobs.extend(copies);
        // A motion may already be called NAME_breeze.
        refuse_duplicate_names(&jobs)?;
    }
    if let Some(seconds) = args.seconds {
        jobs.iter_mut().for_each(|job| {
            let frames = (seconds * job.clip.fps).ceil() as usize;
            // A clip needs two frames for a velocity.
            job.clip.poses.truncate(frames.max(2));
            job.clip.wind.truncate(job.clip.poses.len());
        });
    }
    Ok(jobs)
}

/// Copies of all training motions in an additional steady wind of `speed` m/s.
fn copies_in_wind(jobs: &[Job], speed: f32) -> Vec<Job> {
    // Directions that follow each other at the golden angle cover the circle evenly for any number
    // of motions.
    let golden_angle = PI * (3.0 - 5f32.sqrt());
    let train = jobs.iter().filter(|job| job.split == Split::Train);
    let in_wind = |(i, job): (usize, &Job)| {
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
    train.enumerate().map(in_wind).collect()
}

/// All built-in motions, with the splits of the standard set.
fn built_in_motions(args: &SimulateArgs, character: &Character) -> Result<Vec<Job>> {
    let set = standard_set(character, STANDARD_SEED, args.fps)?;
    let job = |split| {
        move |clip| Job {
            clip,
            split,
            source: BUILT_IN.into(),
        }
    };
    let train = set.train.into_iter().map(job(Split::Train));
    Ok(train.chain(set.test.into_iter().map(job(Split::Test))).collect())
}

/// Motions of `--motion`, files and built-in ones. The last of several is a test clip.
fn named_motions(args: &SimulateArgs, character: &Character) -> Result<Vec<Job>> {
    // Without a clip that training does not open, no error on unseen motion could be measured.
    let is_last = |i: usize| i > 0 && i + 1 == args.motion.len();
    let read = |(i, path): (usize, &PathBuf)| {
        let source = match motion_file::is_built_in(path) {
            true => BUILT_IN.into(),
            false => path.display().to_string(),
        };
        Ok(Job {
            clip: motion_file::read(path, character, args.fps, &args.reading, args.force)?,
            split: if is_last(i) { Split::Test } else { Split::Train },
            source,
        })
    };
    args.motion.iter().enumerate().map(read).collect()
}

/// Refuses two motions of one name, which would be one clip.
fn refuse_duplicate_names(jobs: &[Job]) -> Result<()> {
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

/// Assigns splits by `--test` and `--validation`.
fn assign_splits(args: &SimulateArgs, jobs: &mut [Job]) -> Result<()> {
    let mut named = args.test.iter().chain(&args.validation);
    if let Some(name) = named.find(|name| !jobs.iter().any(|job| job.clip.name == **name)) {
        let names: Vec<&str> = jobs.iter().map(|job| job.clip.name.as_str()).collect();
        let names = names.join(", ");
        let text = format!("--test and --validation: expected names among {names}; found {name}");
        return Err(Usage(text).into());
    }
    for job in jobs {
        // Without `--test` the defaults stay; with it, clips that it does not name are for
        // training.
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

/// The path itself, or for a folder the file `name` in it.
fn file_or_file_in(path: &Path, name: &str) -> PathBuf {
    match path.is_dir() {
        true => path.join(name),
        false => path.to_owned(),
    }
}
